//! `pathspace render`: which options change the file, and which must not.

use std::fs;

use crate::{Run, code, pixels, refused, stderr, stdout, triangle};

#[test]
fn outputs_have_default_names_that_the_last_line_says() {
    let run = Run::new();
    let output = run.render(&["--spp", "2", "-i", "path"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(run.files(), ["cornell-box-path.exr", "cornell-box-path.png"]);
    assert!(output.stdout.is_empty());
    let text = stderr(&output);
    let mut lines = text.lines().rev();
    assert_eq!(lines.next().unwrap(), "wrote cornell-box-path.exr and cornell-box-path.png");
    let summary = lines.next().unwrap();
    assert!(summary.starts_with("2 spp in ") && summary.contains("noise ") && summary.contains("relMSE"), "{summary}");
}

#[test]
fn quiet_is_quiet_and_verbose_says_more() {
    let run = Run::new();
    let output = run.render(&["--spp", "1", "-q", "-o", "a.png"]);
    assert_eq!((code(&output), stderr(&output).as_str()), (0, ""));
    let verbose = stderr(&run.render(&["--spp", "1", "-v", "-o", "a.png"]));
    assert!(verbose.contains("materials") && verbose.contains("exposure"), "{verbose}");
    assert!(verbose.contains("noise unknown (one sample per pixel)"), "{verbose}");
}

#[test]
fn every_thread_count_writes_the_same_bytes() {
    let run = Run::new();
    for integrator in ["path", "light", "hybrid", "bdpt"] {
        let options = ["--light-samples", "2", "--lights", "tree", "--splits", "2"];
        let roulette = ["--roulette", "throughput:2", "--connection-roulette", "0.5,50%"];
        let more = if integrator == "light" { &roulette[..] } else { &[options.as_slice(), &roulette].concat() };
        let shared = ["--light-vertices", "2", "--light-paths", "2"];
        let all = [&[][..], more, &shared];
        for more in if integrator == "bdpt" { &all[..] } else { &all[..2] } {
            let usual = ["--spp", "4", "-i", integrator, "--threads"];
            let with = |threads| run.image("a.exr", &[&usual[..], &[threads], more].concat());
            let one = with("1");
            assert_eq!(one, with("2"), "{integrator}");
            assert_eq!(one, with("5"), "{integrator}");
        }
    }
}

#[test]
fn a_tree_built_fast_renders_the_same_bytes() {
    let run = Run::new();
    for integrator in ["path", "bdpt"] {
        let with = |effort| run.image("a.exr", &["--spp", "4", "-i", integrator, "--build", effort]);
        assert_eq!(with("fast"), with("best"), "{integrator}");
    }
}

#[test]
fn what_changes_pixels_changes_the_file() {
    let run = Run::new();
    let usual = run.image("a.exr", &["--spp", "2"]);
    for options in [
        &["--spp", "3"][..],
        &["--spp", "2", "--seed", "1"],
        &["--spp", "2", "--filter", "blackman-harris"],
        &["--spp", "2", "--clamp", "0.01"],
        &["--spp", "2", "--crop", "0,0,8,8"],
        &["--spp", "2", "-i", "light"],
        &["--spp", "2", "--env-color", "1"],
        &["--spp", "2", "--splits", "2"],
        &["--spp", "2", "--rays", "2"],
        &["--spp", "2", "--light-paths", "2"],
        &["--spp", "2", "--light-paths", "1/2"],
        &["--spp", "2", "--light-vertices", "2"],
        &["--spp", "2", "-i", "vcm"],
        &["--spp", "2", "--lights", "uniform"],
        &["--spp", "2", "--lights", "all"],
        &["--spp", "2", "--lights", "tree"],
        &["--spp", "2", "--roulette", "throughput:2"],
        &["--spp", "2", "--connection-roulette", "0.5,50%"],
        &["--spp", "2", "--preset", "direct"],
        &["--spp", "2", "--preset", "whitted"],
        &["--spp", "2", "--paths", "C.L"],
    ] {
        assert_ne!(usual, run.image("b.exr", options), "{options:?}");
    }
}

#[test]
fn options_without_a_use_are_refused() {
    let run = Run::new();
    for (options, said) in [
        (&["-i", "light", "--splits", "2"][..], "no paths from the camera"),
        (&["-i", "light", "--lights", "tree"], "samples no lights"),
        (&["-i", "path-hemisphere", "--light-samples", "2"], "samples no lights"),
        (&["-i", "path-hemisphere", "--connection-roulette", "1,50%"], "no connections"),
        (&["-i", "path", "--hemisphere", "uniform"], "--hemisphere says how"),
        (&["-i", "area", "--hemisphere", "uniform"], "--hemisphere says how"),
        (&["-i", "area", "--only-strategy", "1,2"], "no strategies"),
        (&["-i", "area", "--splits", "2"], "no paths from the camera"),
        (&["-i", "area", "--light-paths", "2"], "no paths from lights"),
        (&["-i", "area", "--lights", "tree"], "uniform or power"),
        (&["-i", "area", "--light-samples", "2"], "one sample of each length"),
        (&["-i", "light", "--rays", "2"], "no rays at the first surface"),
        (&["-i", "path", "--light-paths", "2"], "no paths from lights"),
        (&["--light-vertices", "2", "--light-paths", "1/2"], "leave one of the two out"),
        (&["--light-paths", "0"], "1 to 1024 for each pixel, or 1/N"),
        (&["--light-paths", "2/3"], "1 to 1024 for each pixel, or 1/N"),
        (&["--light-vertices", "2", "--light-paths", "1024"], "MB of light paths for each thread"),
        (&["-i", "hybrid", "--light-vertices", "2"], "connects no vertices of light paths"),
        (&["-i", "bdpt", "--merge-radius", "0.1"], "merges no paths"),
        (&["-i", "vcm", "--merge-radius", "1e30"], "a radius from 1e-9 to 1e9 metres is needed"),
        (&["-i", "vcm", "--light-paths", "1024", "--memory-limit", "20M"], "light vertices of 196608 light paths"),
        (&["--rays", "2", "--splits", "2"], "cannot be used with"),
        (&["--preset", "direct", "--paths", "C.L"], "cannot be used with"),
        (&["--preset", "direct", "--min-depth", "3"], "no path has 3 edges"),
        (&["--paths", "C<D'foil'>L"], "no material of the scene is called 'foil'"),
        (&["--paths", "C("], "character 3"),
        (&["--connection-roulette", "1"], "0.1,50%"),
    ] {
        refused(&run.render(&[&["--spp", "1", "-o", "a.exr"], options].concat()), 2, said);
    }
}

#[test]
fn the_bias_of_merging_is_said() {
    let run = Run::new();
    let said = |options: &[&str]| {
        let output = run.render(&[&["--spp", "3", "-o", "a.exr"], options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        stderr(&output) + &stdout(&output)
    };
    let shrinking = said(&["-i", "vcm"]);
    assert!(shrinking.contains("note: the image is consistent, not unbiased: paths merge within"), "{shrinking}");
    let fixed = said(&["-i", "vcm", "--merge-radius", "0.25"]);
    assert!(fixed.contains("not consistent: paths merge within 0.25 m in every pass"), "{fixed}");
    // One strategy's image has no bias, whatever weighs it; nor has what does not merge.
    for options in [&["-i", "vcm", "--only-strategy", "1,2"][..], &["-i", "bdpt"]] {
        assert!(!said(options).contains("paths merge"), "{options:?}");
    }
    let [a, b] = ["0.25", "0.5"].map(|radius| run.image("a.exr", &["-i", "vcm", "--merge-radius", radius]));
    assert_ne!(pixels(&a).pixels, pixels(&b).pixels);
}

#[test]
fn presets_are_what_they_stand_for() {
    let run = Run::new();
    let pixels_of = |options: &[&str]| {
        let image = pixels(&run.image("a.exr", &[&["--spp", "2"], options].concat()));
        (0..12).flat_map(|y| (0..16).map(move |x| (x, y))).map(|(x, y)| image.get(x, y)).collect::<Vec<_>>()
    };
    assert_eq!(pixels_of(&["--preset", "direct"]), pixels_of(&["--max-depth", "2"]));
    assert_eq!(pixels_of(&["--preset", "whitted"]), pixels_of(&["--paths", "CS*[DG]?L"]));
    assert_eq!(pixels_of(&["--rays", "3"]), pixels_of(&["--light-samples", "3", "--splits", "3"]));
    assert_ne!(pixels_of(&["--preset", "whitted"]), pixels_of(&[]));
}

#[test]
fn a_crop_is_the_slice_of_the_full_image() {
    let run = Run::new();
    for integrator in ["path", "light", "bdpt"] {
        for filter in ["box", "blackman-harris"] {
            let common = ["--spp", "2", "-i", integrator, "--filter", filter];
            let full = pixels(&run.image("full.exr", &common));
            let part = pixels(&run.image("part.exr", &[&common[..], &["--crop", "3,2,11,12"]].concat()));
            assert_eq!((part.width, part.height), (8, 10));
            for (x, y) in (0..8).flat_map(|x| (0..10).map(move |y| (x, y))) {
                assert_eq!(part.get(x, y), full.get(x + 3, y + 2), "{integrator} {filter} ({x}, {y})");
            }
        }
    }
}

#[test]
fn files_hold_no_paths_and_existing_ones_are_replaced() {
    let run = Run::new();
    fs::write(run.path("a.exr"), "old").unwrap();
    let bytes = run.image("a.exr", &["--spp", "2"]);
    assert_eq!(run.files(), ["a.exr"], "nothing is left beside it");
    let text = String::from_utf8_lossy(&bytes).into_owned();
    assert!(text.contains("pathspace.integrator") && text.contains("bdpt"));
    for private in [run.folder.path().to_str().unwrap(), env!("CARGO_MANIFEST_DIR"), "cornell-box.glb"] {
        assert!(!text.contains(private), "{private}");
    }
}

#[test]
fn options_that_change_nothing_are_said_to() {
    let run = Run::new();
    let said = |options: &[&str]| {
        let output = run.render(&[&["--spp", "1", "-o", "a.png"], options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        stderr(&output)
    };
    assert!(said(&["--env-scale", "2"]).contains("--env-scale has no effect"));
    assert!(!said(&["--env-scale", "2", "--env-color", "1"]).contains("no effect"));
    assert!(said(&["-i", "area", "--max-depth", "5"]).contains("paths of 4 edges"));
    assert!(!said(&["-i", "area", "--max-depth", "4"]).contains("paths of 4 edges"));
}

#[test]
fn a_time_ends_a_render() {
    let run = Run::new();
    let output = run.render(&["--time", "200ms", "-o", "a.png"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains(" spp in "));
}

#[test]
fn a_scene_of_several_is_chosen() {
    let run = Run::new();
    let two = triangle("0.0").replace(
        r#""scene": 0, "scenes": [{ "nodes": [0] }]"#,
        r#""scene": 0, "scenes": [{ "nodes": [0] }, { "name": "void", "nodes": [] }]"#,
    );
    fs::write(run.path("two.gltf"), two).unwrap();
    let described = |scene: &str| stdout(&run.pathspace(&["info", "two.gltf", "--scene", scene]));
    assert!(described("0").contains("1 triangles") && described("void").contains("0 triangles"));
    refused(&run.pathspace(&["info", "two.gltf", "--scene", "day"]), 2, "the file has 0, 1 “void”");
    refused(&run.pathspace(&["render", "two.gltf", "--scene", "2"]), 2, "the file has 0, 1 “void”");
    let render = ["render", "two.gltf", "-q", "--width", "8", "--height", "8", "--spp", "1", "-o", "a.exr"];
    assert_eq!(code(&run.pathspace(&[&render[..], &["--scene", "void"]].concat())), 0);
    assert!(String::from_utf8_lossy(&fs::read(run.path("a.exr")).unwrap()).contains("pathspace.scene-index"));
}

#[test]
fn a_transparent_background_is_an_alpha_channel() {
    let run = Run::new();
    // A triangle before nothing, in the middle of the image.
    fs::write(run.path("t.gltf"), triangle("0.0")).unwrap();
    let out = ["-o", "a.png", "-o", "a.exr"];
    let size = ["--width", "16", "--height", "16", "--spp", "4", "-q"];
    for integrator in ["path", "light"] {
        let options = [&["render", "t.gltf", "--transparent", "-i", integrator][..], &size, &out].concat();
        let output = run.pathspace(&options);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let png = image::open(run.path("a.png")).unwrap();
        assert!(png.color().has_alpha());
        let png = png.into_rgba8();
        assert_eq!((png.get_pixel(0, 0).0[3], png.get_pixel(7, 8).0[3]), (0, 255), "{integrator}");
        let exr = fs::read(run.path("a.exr")).unwrap();
        assert!(String::from_utf8_lossy(&exr).contains("pathspace.background"));
    }
}

#[test]
fn a_noise_ends_a_render_where_it_is_reached() {
    let run = Run::new();
    let noisy = ["-i", "path", "--noise", "12%", "--stats", "s.json", "-o", "a.exr"];
    let spp = |output: &std::process::Output| -> u32 {
        let said = stderr(output);
        let line = said.lines().find(|line| line.contains(" spp in ")).unwrap();
        line.split(' ').next().unwrap().parse().unwrap()
    };
    let output = run.render(&noisy);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let end = spp(&output);
    assert!(end.is_power_of_two() && (16..65536).contains(&end), "{end}");
    let bytes = fs::read(run.path("a.exr")).unwrap();
    assert!(String::from_utf8_lossy(&bytes).contains("0.12 on 95 % of tiles: reached"));
    let same = run.image("b.exr", &["-i", "path", "--spp", &end.to_string()]);
    assert_eq!(pixels(&bytes), pixels(&same), "it is the render of as many samples");

    // Half the noise takes about four times as many samples, whatever happens on the way.
    let (quarter, some) = (["-i", "path", "--noise", "6%"], (end + 3).to_string());
    let whole = run.image("whole.exr", &quarter);
    let kept = run.image("kept.exr", &["-i", "path", "--spp", &some, "--checkpoint", "k.exr"]);
    assert_ne!(whole, kept);
    let output =
        run.render(&[&quarter[..], &["--resume", "k.exr", "--checkpoint", "k.exr", "-o", "rest.exr"]].concat());
    assert!((2 * end..=16 * end).contains(&spp(&output)), "{}", stderr(&output));
    assert!(whole == fs::read(run.path("rest.exr")).unwrap(), "{}", stderr(&output));
    assert!(
        whole == run.image("rest.exr", &[&quarter[..], &["--resume", "k.exr"]].concat()),
        "it is good enough already"
    );

    let output = run.render(&["-i", "path", "--noise", "1%", "--spp", "32", "-o", "a.exr"]);
    assert!(stderr(&output).contains("32 spp are not enough for --noise 0.01"), "{}", stderr(&output));
    refused(&run.render(&["--noise", "5%", "--time", "1s"]), 2, "--time");
    refused(&run.render(&["--noise", "5%", "--shard", "1/2"]), 2, "--shard");
    refused(&run.render(&["--noise", "0"]), 2, "5%");
}

#[test]
fn tone_and_white_balance_are_for_png_alone() {
    let run = Run::new();
    let usual = ["-q", "--spp", "2", "--exposure", "0"];
    let [exr, png] = ["a.exr", "a.png"].map(|name| run.image(name, &usual));
    for options in [&["--tone", "filmic"][..], &["--tone", "agx"], &["--white-balance", "3000"]] {
        let [same, other] = ["b.exr", "b.png"].map(|name| run.image(name, &[&usual[..], options].concat()));
        assert!(same == exr && other != png, "{options:?}");
    }
    assert!(run.image("c.png", &[&usual[..], &["--tone", "none"]].concat()) == png);
}
