//! `--shard` and `pathspace merge`: parts make the whole, to the byte, and nothing else does.

use std::fs;

use crate::{Run, code, refused, stderr, triangle};

const SPP: &str = "8";

/// Renders the shards 1 to `count`, with threads of their own, and returns their names.
fn shards(run: &Run, integrator: &str, count: u32, options: &[&str]) -> Vec<String> {
    let render = |i: u32| {
        let (shard, name) = (format!("{i}/{count}"), format!("{i}-of-{count}.exr"));
        let threads = ["1", "2", "5"][i as usize % 3];
        let own = ["-q", "-i", integrator, "--spp", SPP, "--shard", &shard, "--threads", threads, "-o", &name];
        let output = run.render(&[&own[..], options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        name
    };
    (1..=count).map(render).collect()
}

/// `pathspace merge` of these files in this order.
fn merge(run: &Run, files: &[String], options: &[&str]) -> std::process::Output {
    let files: Vec<_> = files.iter().map(String::as_str).collect();
    run.pathspace(&[&["merge"], &files[..], options].concat())
}

#[test]
fn any_number_of_shards_in_any_order_is_the_single_render() {
    let run = Run::new();
    for (integrator, options) in [
        ("path", &[][..]),
        ("light", &["--filter", "blackman-harris"]),
        ("bdpt", &["--transparent", "--crop", "2,1,13,9"]),
    ] {
        let single = ["--spp", SPP, "-i", integrator, "-o", "single.png"];
        let whole = run.image("single.exr", &[&single[..], options].concat());
        for count in [1, 2, 3, 7, 16] {
            let mut files = shards(&run, integrator, count, options);
            // An order that is neither that of the shards nor its reverse.
            files.sort_by_key(|name| name.bytes().map(|b| u32::from(b) * 7 % 11).sum::<u32>());
            let output = merge(&run, &files, &["-o", "merged.exr", "-o", "merged.png"]);
            assert_eq!(code(&output), 0, "{}", stderr(&output));
            assert!(whole == fs::read(run.path("merged.exr")).unwrap(), "{integrator} in {count} shards");
            assert!(fs::read(run.path("single.png")).unwrap() == fs::read(run.path("merged.png")).unwrap());
        }
    }
}

#[test]
fn threads_do_not_change_a_shard() {
    let run = Run::new();
    for integrator in ["path", "light", "bdpt"] {
        let with =
            |threads| run.image("a.exr", &["--spp", SPP, "-i", integrator, "--shard", "2/3", "--threads", threads]);
        let one = with("1");
        assert!(one == with("2") && one == with("5"), "{integrator}");
    }
}

#[test]
fn shards_have_names_of_their_own_and_are_ordinary_images() {
    use exr::prelude::{FlatSamples, read_first_flat_layer_from_file};
    let run = Run::new();
    let output = run.render(&["--spp", "3", "-i", "path", "--shard", "2/16"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(run.files(), ["cornell-box-path-2-of-16.exr"]);
    assert!(stderr(&output).contains("no samples"), "three samples leave most of 16 shards empty: {}", stderr(&output));
    let image = read_first_flat_layer_from_file(run.path("cornell-box-path-2-of-16.exr")).unwrap();
    let channels = image.layer_data.channel_data.list;
    assert_eq!((channels.len(), channels[0].name.to_string().as_str()), (18, "even.B.fine"));
    assert!(
        channels.iter().all(|channel| matches!(&channel.sample_data, FlatSamples::U32(words) if words.len() == 192))
    );
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let run = Run::new();
    let files = shards(&run, "path", 4, &[]);
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| files[i].clone());
    let out = ["-q", "-o", "out.exr"];
    let pick = |files: &[&String]| files.iter().map(|&file| file.clone()).collect::<Vec<_>>();
    refused(&merge(&run, &pick(&[&a, &c, &d]), &out), 3, "none of the numbers 2 to 3");
    refused(&merge(&run, &pick(&[&b, &c]), &out), 3, "0 to 1 and 6 to 7");
    refused(&merge(&run, &pick(&[&a, &b, &c, &d, &b]), &out), 3, "both have the samples number 2 to 3");
    for (options, about) in [
        (&["--seed", "1"][..], "seed"),
        (&["-i", "light"], "integrator"),
        (&["--spp", "16"], "16"),
        (&["--max-depth", "3"], "max-depth"),
        (&["--height", "13"], "16×13"),
        (&["--crop", "0,0,8,8"], "crop"),
        (&["--transparent"], "background"),
        (&["--env-color", "1"], "environment"),
    ] {
        let mut own = vec!["-q", "--shard", "2/4", "-o", "other.exr"];
        own.extend(options);
        if !options.contains(&"-i") {
            own.extend(["-i", "path"]);
        }
        if !options.contains(&"--spp") {
            own.extend(["--spp", SPP]);
        }
        let size =
            if options.contains(&"--height") { &["--width", "16"][..] } else { &["--width", "16", "--height", "12"] };
        let scene = crate::scene();
        let output = run.pathspace(&[&["render", scene.to_str().unwrap()], size, &own].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        refused(&merge(&run, &pick(&[&a, &"other.exr".to_owned()]), &out), 3, about);
    }
    fs::write(run.path("t.gltf"), triangle("0.0")).unwrap();
    let other =
        ["render", "t.gltf", "--width", "16", "--height", "12", "-q", "--spp", SPP, "-i", "path", "--shard", "2/4"];
    assert_eq!(code(&run.pathspace(&[&other[..], &["-o", "other.exr"]].concat())), 0);
    refused(&merge(&run, &pick(&[&a, &"other.exr".to_owned()]), &out), 3, "the scene has hash");
    run.image("image.exr", &["-q", "--spp", "1"]);
    refused(&merge(&run, &pick(&[&a, &"image.exr".to_owned()]), &out), 3, "a finished image");
    refused(&merge(&run, &pick(&[&a, &"t.gltf".to_owned()]), &out), 3, "no checkpoint or shard");
    refused(&merge(&run, &pick(&[&a, &"nobody.exr".to_owned()]), &out), 3, "nobody.exr");
    refused(&merge(&run, &pick(&[&a]), &["-q", "-o", "out.jpg"]), 2, ".exr or .png");
    refused(&merge(&run, &pick(&[&a]), &["-q", "-o", "nowhere/out.exr"]), 4, "no folder");
    refused(&merge(&run, &files, &["-q", "-o", "out.exr", "--memory-limit", "1KiB"]), 2, "--memory-limit");
    refused(&run.pathspace(&["merge", &a]), 2, "--output");
    assert!(!run.files().contains(&"out.exr".to_owned()));
}

#[test]
fn a_part_is_merged_if_that_is_asked_for_and_says_so() {
    let run = Run::new();
    let files = shards(&run, "bdpt", 4, &[]);
    let output = merge(&run, &files[..2], &["--partial", "-o", "out.exr"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(
        stderr(&output).contains("only 4 of 8 samples per pixel are merged: 4 to 7 are missing"),
        "{}",
        stderr(&output)
    );
    let half = run.image("half.exr", &["--spp", "4", "-i", "bdpt"]);
    assert!(half == fs::read(run.path("out.exr")).unwrap(), "the first half is a render of half as many samples");
    let output = merge(&run, &files[1..3], &["--partial", "-o", "out.exr"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let middle = String::from_utf8_lossy(&fs::read(run.path("out.exr")).unwrap()).into_owned();
    assert!(middle.contains("pathspace.passes") && middle.contains("2 to 5"));
    let empty = shards(&run, "bdpt", 16, &[]);
    refused(&merge(&run, &empty[..1], &["-q", "--partial", "-o", "no.exr"]), 3, "no sample");
}

/// A thousand files are merged in groups, and the groups then.
#[test]
fn shards_of_shards_are_shards() {
    let run = Run::new();
    for (integrator, options) in
        [("path", &[][..]), ("light", &[]), ("bdpt", &["--transparent", "--layers", "bounces"])]
    {
        let whole = run.image("single.exr", &[&["--spp", SPP, "-i", integrator], options].concat());
        let halves = shards(&run, integrator, 2, options);
        let expected = halves.iter().map(|name| fs::read(run.path(name)).unwrap()).collect::<Vec<_>>();
        let quarters = shards(&run, integrator, 4, options);
        for (half, name) in ["a.exr", "b.exr"].into_iter().enumerate() {
            let mut pair = quarters[2 * half..2 * half + 2].to_vec();
            pair.reverse();
            let output = merge(&run, &pair, &["--as-shard", "-o", name]);
            assert_eq!(code(&output), 0, "{}", stderr(&output));
            assert!(
                fs::read(run.path(name)).unwrap() == expected[half],
                "{integrator}: it is the shard of its samples"
            );
        }
        let output = run.pathspace(&["merge", "b.exr", "a.exr", "-o", "merged.exr"]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        assert!(fs::read(run.path("merged.exr")).unwrap() == whole, "{integrator}");
        let apart = [quarters[0].clone(), quarters[2].clone()];
        let out = ["-q", "--as-shard", "-o", "no.exr"];
        refused(&merge(&run, &apart, &out), 3, "the samples 0 to 1 and 4 to 5 are not one range");
        refused(&merge(&run, &apart[..1], &["-q", "--as-shard", "-o", "no.png"]), 2, "a shard is exact sums");
        refused(&merge(&run, &apart[..1], &[&out[..], &["--partial"]].concat()), 2, "--partial");
        assert!(!run.files().iter().any(|name| name.starts_with("no.")));
    }
}

#[test]
fn a_shard_that_is_no_file_of_sums_is_refused() {
    let run = Run::new();
    refused(&run.render(&["-q", "--shard", "1/2", "-o", "a.png"]), 2, "shard");
    refused(&run.render(&["-q", "--shard", "0/2"]), 2, "1/N");
    refused(&run.render(&["-q", "--shard", "3/2"]), 2, "1/N");
    refused(&run.render(&["-q", "--shard", "1"]), 2, "2/16");
    refused(&run.render(&["-q", "--shard", "1/2", "--time", "1s"]), 2, "--time");
    assert!(run.files().is_empty());
}

/// What could not be added stays known through files and merges, and every command that has it says so.
#[test]
fn what_is_missing_is_said_to_the_end() {
    use pathspace::film::{CheckpointFile, DepositErrors, Film, Sums, encode_checkpoint};
    let run = Run::new();
    let files = shards(&run, "path", 2, &[]);
    run.image("a.exr", &["-q", "-i", "path", "--spp", "4", "--checkpoint", "k.exr"]);
    for name in [files[1].as_str(), "k.exr"] {
        // The same sums, with a count of deposits that were not among them.
        let file = CheckpointFile::open(&run.path(name)).unwrap();
        let mut header = file.header().clone();
        let film = Film::new(header.sensor, header.crop, pathspace::sampling::Filter::Box, header.scale);
        let sums = Sums { film: &film, alpha_sums: None, layers: Vec::new() };
        file.add_to(&sums).unwrap();
        header.errors = DepositErrors { non_finite: 3, overflow: 0 };
        fs::write(run.path(name), encode_checkpoint(&sums, &header).unwrap()).unwrap();
    }
    let incomplete = |output: &std::process::Output| {
        assert_eq!(code(output), 6, "{}", stderr(output));
        assert!(stderr(output).contains("3 contributions were not finite"), "{}", stderr(output));
    };
    incomplete(&merge(&run, &files, &["-o", "merged.exr"]));
    assert!(run.path("merged.exr").exists());
    incomplete(&merge(&run, &files, &["--as-shard", "-o", "whole.exr"]));
    incomplete(&merge(&run, &["whole.exr".to_owned()], &["-o", "again.exr"]));
    let stats = ["--resume", "k.exr", "--stats", "s.json"];
    incomplete(&run.render(&[&["-i", "path", "--spp", "8", "-o", "b.exr"][..], &stats].concat()));
    let json: serde_json::Value = serde_json::from_slice(&fs::read(run.path("s.json")).unwrap()).unwrap();
    assert_eq!((&json["exit"], &json["outcome"]), (&6.into(), &"incomplete".into()));
    assert_eq!(json["film_errors"]["non_finite"], 3);
}

#[test]
fn shards_of_an_older_layout_are_refused_in_a_sentence() {
    let run = Run::new();
    let files = shards(&run, "path", 1, &[]);
    let mut bytes = fs::read(run.path(&files[0])).unwrap();
    let name = b"pathspace.state.layout\0string\0\x01\0\0\0";
    let place = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len();
    bytes[place] = b'1';
    fs::write(run.path("old.exr"), bytes).unwrap();
    refused(
        &merge(&run, &["old.exr".to_owned()], &["-q", "-o", "out.exr"]),
        3,
        "another version of pathspace wrote it",
    );
}
