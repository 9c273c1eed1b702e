//! The program as a person or a script meets it: exit codes, sentences, files.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// The program, run in its own folder so that nothing is written anywhere else.
struct Run {
    folder: tempfile::TempDir,
}

impl Run {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn files(&self) -> Vec<String> {
        let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<_> = fs::read_dir(self.folder.path()).unwrap().map(name).collect();
        names.sort();
        names
    }

    fn pathspace(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_pathspace")).args(arguments).current_dir(self.folder.path()).output().unwrap()
    }

    /// `pathspace render` of the Cornell box at a size that takes no time.
    fn render(&self, options: &[&str]) -> Output {
        let scene = scene();
        let small = ["render", scene.to_str().unwrap(), "--width", "16", "--height", "12"];
        self.pathspace(&[&small[..], options].concat())
    }

    /// Renders to `name`, which must succeed, and returns the file.
    fn image(&self, name: &str, options: &[&str]) -> Vec<u8> {
        let output = self.render(&[options, &["-o", name]].concat());
        assert_eq!(code(&output), 0, "{options:?}: {}", stderr(&output));
        fs::read(self.path(name)).unwrap()
    }
}

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.glb")
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Refused with this exit code and one sentence that contains `about`, before anything was written.
#[track_caller]
fn refused(output: &Output, exit: i32, about: &str) {
    let text = stderr(output);
    assert_eq!(code(output), exit, "{text}");
    assert!(text.starts_with("error: ") && text.trim_end().lines().count() == 1, "not one sentence: {text}");
    assert!(text.contains(about), "nothing about '{about}': {text}");
    assert!(output.stdout.is_empty());
}

#[test]
fn help_and_version_are_answers() {
    let run = Run::new();
    for arguments in [&["--help"][..], &["render", "--help"], &["verify", "--help"], &["info", "-h"], &["--version"]] {
        let output = run.pathspace(arguments);
        assert_eq!(code(&output), 0);
        assert!(!output.stdout.is_empty() && output.stderr.is_empty());
    }
    let help = stdout(&run.pathspace(&["render", "--help"]));
    for option in ["--spp", "--time", "--max-depth", "--look-at", "--only-strategy", "--memory-limit", "default: bdpt"]
    {
        assert!(help.contains(option), "{option}");
    }
}

#[test]
fn help_and_readme_list_the_same_exit_codes() {
    let readme = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    let help = stdout(&Run::new().pathspace(&["--help"]));
    for (exit, meaning) in pathspace::cli::Exit::TABLE {
        let code = exit as u8;
        assert!(readme.contains(&format!("| {code} | {meaning} |")), "README: {code} {meaning}");
        assert!(help.contains(&format!("{code}  {meaning}")), "--help: {code} {meaning}");
    }
}

#[test]
fn no_command_shows_the_help() {
    let output = Run::new().pathspace(&[]);
    assert_eq!(code(&output), 2);
    assert!(stderr(&output).contains("Usage:"));
}

#[test]
fn wrong_usage_is_refused() {
    let run = Run::new();
    refused(&run.pathspace(&["paint"]), 2, "paint");
    refused(&run.pathspace(&["render"]), 2, "SCENE");
    for (options, about) in [
        (&["-i", "whitted"][..], "whitted"),
        (&["--spp", "0"], "--spp"),
        (&["--spp", "many"], "--spp"),
        (&["--spp", "4", "--time", "1s"], "--time"),
        (&["--time", "soon"], "30s"),
        (&["--time", "0s"], "positive"),
        (&["--width", "0"], "--width"),
        (&["--max-depth", "0"], "--max-depth"),
        (&["--max-depth", "256"], "--max-depth"),
        (&["--filter", "gauss"], "gauss"),
        (&["--exposure", "nan"], "finite"),
        (&["--clamp", "-1"], "--clamp"),
        (&["--roulette", "sometimes"], "off"),
        (&["--crop", "5,5,5,9"], "at least one pixel"),
        (&["--crop", "1,2,3"], "x0,y0,x1,y1"),
        (&["--crop", "-1,0,2,2"], "--crop"),
        (&["--threads", "0"], "--threads"),
        (&["--only-strategy", "1,0"], "at least 1"),
        (&["--only-strategy", "2,2", "--max-depth", "2"], "--max-depth"),
        (&["--unweighted"], "--only-strategy"),
        (&["--look-at", "0,0,0,0,0,0"], "look at"),
        (&["--look-at", "0,0,1,0,0,0", "--camera", "0"], "--camera"),
        (&["--aperture", "-1", "--focus", "2"], "--aperture"),
        (&["--aperture", "0.1", "--focus", "0"], "--focus"),
        (&["--memory-limit", "lots"], "4GiB"),
        (&["-q", "-v"], "--verbose"),
        (&["--env-rotate", "90"], "--env"),
        (&["--env", "a.hdr", "--env-color", "1"], "--env-color"),
        (&["--env-color", "1,-2,3"], "between 0 and"),
        (&["--env-color", "grey"], "grey"),
        (&["--env-scale", "0"], "positive"),
        (&["--nonsense"], "--nonsense"),
    ] {
        refused(&run.render(options), 2, about);
    }
    assert!(run.files().is_empty());
}

#[test]
fn formats_are_known_by_extension() {
    let run = Run::new();
    for name in ["picture.jpg", "picture", "picture.exr.gz"] {
        refused(&run.render(&["-o", name]), 2, ".exr or .png");
    }
}

#[test]
fn a_missing_or_broken_scene_is_refused() {
    let run = Run::new();
    for command in ["render", "info"] {
        refused(&run.pathspace(&[command, "no-such-scene.glb"]), 3, "no-such-scene.glb");
        fs::write(run.path("empty.glb"), "").unwrap();
        refused(&run.pathspace(&[command, "empty.glb"]), 3, "empty.glb");
        refused(&run.pathspace(&[command, "."]), 3, "cannot read .");
    }
    assert_eq!(run.files(), ["empty.glb"]);
}

#[test]
fn a_damaged_scene_is_refused_with_the_place_of_the_damage() {
    let run = Run::new();
    let whole = fs::read(scene()).unwrap();
    fs::write(run.path("cut.glb"), &whole[..whole.len() - 100]).unwrap();
    refused(&run.pathspace(&["render", "cut.glb"]), 3, "cut.glb");
    fs::write(run.path("typo.gltf"), "{ \"asset\": { \"version\": \"2.0\" }, }").unwrap();
    refused(&run.pathspace(&["render", "typo.gltf"]), 3, "line 1");
    fs::write(run.path("range.gltf"), triangle("0.0").replace("\"POSITION\": 0", "\"POSITION\": 7")).unwrap();
    refused(&run.pathspace(&["render", "range.gltf"]), 3, "/meshes/0/primitives/0");
    fs::write(run.path("nan.gltf"), triangle("nan")).unwrap();
    refused(&run.pathspace(&["render", "nan.gltf"]), 3, "/accessors/0");
    fs::write(run.path("good.gltf"), triangle("0.0")).unwrap();
    assert_eq!(code(&run.pathspace(&["info", "good.gltf"])), 0, "the undamaged document is fine");
}

/// A document of one triangle, whose first coordinate is `x`.
fn triangle(x: &str) -> String {
    let corners: [f32; 9] = [x.parse().unwrap(), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = corners.iter().flat_map(|c| c.to_le_bytes()).collect();
    let escaped: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }} }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                         "min": [0, 0, 0], "max": [1, 1, 0] }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}],
        "buffers": [{{ "byteLength": 36, "uri": "data:application/octet-stream,{escaped}" }}] }}"#
    )
}

#[test]
fn outputs_are_checked_before_the_scene_is_read() {
    let run = Run::new();
    fs::create_dir(run.path("folder.exr")).unwrap();
    fs::write(run.path("old.png"), "old").unwrap();
    let scene = "no-such-scene.glb";
    refused(&run.pathspace(&["render", scene, "-o", "nowhere/a.exr"]), 4, "no folder");
    refused(&run.pathspace(&["render", scene, "-o", "folder.exr"]), 4, "folder");
    refused(&run.pathspace(&["render", scene, "-o", "old.png", "-o", "old.png/a.exr"]), 4, "not a folder");
    assert_eq!(fs::read(run.path("old.png")).unwrap(), b"old");
    assert_eq!(run.files(), ["folder.exr", "old.png"]);
}

#[test]
fn what_only_the_scene_can_tell_is_refused_before_rendering() {
    let run = Run::new();
    refused(&run.render(&["-q", "--crop", "0,0,17,4"]), 2, "16×12");
    refused(&run.render(&["-q", "--camera", "nobody"]), 2, "nobody");
    refused(&run.render(&["-q", "--aperture", "0.1"]), 2, "--focus");
    refused(&run.render(&["-q", "--focus", "2"]), 2, "--aperture");
    let scene = scene();
    let huge = ["render", scene.to_str().unwrap(), "-q", "--width", "32768", "--height", "32768"];
    refused(&run.pathspace(&huge), 2, "--memory-limit");
    assert!(run.files().is_empty());
}

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
        let with = |threads| run.image("a.exr", &["--spp", "4", "-i", integrator, "--threads", threads]);
        let one = with("1");
        assert_eq!(one, with("2"), "{integrator}");
        assert_eq!(one, with("5"), "{integrator}");
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
    ] {
        assert_ne!(usual, run.image("b.exr", options), "{options:?}");
    }
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

fn pixels(file: &[u8]) -> pathspace::film::Image {
    use exr::prelude::{ReadChannels, ReadLayers, Vec2, read};
    use pathspace::{film::Image, math::Rgb};
    let blank = |size: Vec2<usize>, _: &_| Image {
        width: size.0 as u32,
        height: size.1 as u32,
        pixels: vec![Rgb::ZERO; size.0 * size.1],
    };
    let set = |image: &mut Image, Vec2(x, y): Vec2<usize>, (r, g, b): (f32, f32, f32)| {
        image.pixels[y * image.width as usize + x] = Rgb::new(r, g, b);
    };
    let layers = read().no_deep_data().largest_resolution_level().rgb_channels(blank, set);
    layers
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(file))
        .unwrap()
        .layer_data
        .channel_data
        .pixels
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

/// A Radiance file of 8 × 4 pixels without compression, grey but for a column.
fn environment() -> Vec<u8> {
    let mut file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n".to_vec();
    for i in 0..32 {
        file.extend(if i % 8 == 3 { [255, 128, 0, 132] } else { [128, 128, 128, 129] });
    }
    file
}

#[test]
fn an_environment_map_is_recorded_by_its_hash_and_placement() {
    let run = Run::new();
    fs::write(run.path("sky.hdr"), environment()).unwrap();
    fs::copy(run.path("sky.hdr"), run.path("same.hdr")).unwrap();
    // Nothing of the sky reaches into the Cornell box but through its open side.
    let with = |options: &[&str]| run.image("a.exr", &[&["--spp", "2"], options].concat());
    let usual = with(&["--env", "sky.hdr"]);
    assert_eq!(usual, with(&["--env", "same.hdr", "--env-rotate", "0"]));
    let text = String::from_utf8_lossy(&usual).into_owned();
    assert!(text.contains("pathspace.environment") && !text.contains("sky.hdr"));
    for options in [&["--env-rotate", "90"][..], &["--env-scale", "2"]] {
        assert_ne!(usual, with(&[&["--env", "sky.hdr"], options].concat()), "{options:?}");
    }
}

#[test]
fn an_environment_that_cannot_be_read_is_refused() {
    let run = Run::new();
    fs::write(run.path("text.hdr"), "no picture").unwrap();
    fs::write(run.path("cut.hdr"), &environment()[..70]).unwrap();
    for (file, about) in
        [("nowhere.hdr", "nowhere.hdr"), ("text.hdr", "neither a Radiance"), ("cut.hdr", "cannot be decoded")]
    {
        refused(&run.render(&["-q", "--env", file]), 3, about);
    }
}

#[test]
fn a_scene_without_light_gets_a_neutral_environment_that_is_announced() {
    let run = Run::new();
    fs::write(run.path("dark.gltf"), triangle("0.0")).unwrap();
    assert!(stdout(&run.pathspace(&["info", "dark.gltf"])).contains("adds an environment of radiance 1"));
    let render = |options: &[&str]| {
        let small = ["render", "dark.gltf", "--width", "8", "--height", "8", "--spp", "4", "-o", "a.exr"];
        let output = run.pathspace(&[&small[..], options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        (stderr(&output), pixels(&fs::read(run.path("a.exr")).unwrap()))
    };
    let (said, image) = render(&[]);
    assert_eq!(said.matches("no light").count(), 1, "{said}");
    let corner = image.get(0, 0);
    assert!((corner.x - 1.0).abs() < 0.2, "the background is the environment: {corner}");
    let (said, _) = render(&["--env-color", "2"]);
    assert!(!said.contains("no light"), "{said}");
    let glaring = ["render", "-q", "dark.gltf", "--env-color", "1e20", "--env-scale", "1e20"];
    refused(&run.pathspace(&glaring), 2, "the limit");
    let (said, image) = render(&["--env-color", "0"]);
    assert!(said.contains("black"), "{said}");
    assert_eq!(image.get(0, 0).x, 0.0);
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
fn info_answers_programs_in_json() {
    let run = Run::new();
    let output = run.pathspace(&["info", scene().to_str().unwrap(), "--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let info: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let is =
        |pointer: &str, expected: serde_json::Value| assert_eq!(info.pointer(pointer), Some(&expected), "{pointer}");
    is("/layout", 1.into());
    is("/scene", 0.into());
    is("/binary", true.into());
    is("/lights/emissive_triangles", 2.into());
    is("/lights/suns", 0.into());
    is("/materials/0/alpha/mode", "opaque".into());
    is("/materials/0/textures", serde_json::json!({}));
    is("/punctual_lights", serde_json::json!([]));
    is("/cameras/0/type", "perspective".into());
    is("/cameras/0/position", vec![2.78, 2.73, -8.0].into());
    is("/cameras/0/lens", serde_json::Value::Null);
    is("/warnings", serde_json::Value::Array(vec![]));
    for member in ["hash", "generator", "scenes", "file", "geometry", "materials", "extensions"] {
        assert!(!info[member].is_null() || member == "generator", "{member}: {info}");
    }
    assert_eq!(info["geometry"]["bounds"]["min"].as_array().unwrap().len(), 3);
    assert_eq!(stdout(&run.pathspace(&["info", scene().to_str().unwrap(), "--json"])), stdout(&output));
}

#[test]
fn info_names_every_light_and_texture() {
    let run = Run::new();
    let info = |scene: &str| -> serde_json::Value {
        let path = format!("{}/scenes/{scene}.glb", env!("CARGO_MANIFEST_DIR"));
        serde_json::from_str(&stdout(&run.pathspace(&["info", &path, "--json"]))).unwrap()
    };
    let lights = info("glass-and-metal")["punctual_lights"].as_array().unwrap().clone();
    let types: Vec<_> = lights.iter().map(|light| light["type"].as_str().unwrap()).collect();
    assert_eq!(types, ["point", "spot"]);
    assert!(lights[1]["outerConeAngle"].as_f64().unwrap() > lights[1]["innerConeAngle"].as_f64().unwrap());
    let room = info("textured-room");
    let textures = |slot: &str| {
        room["materials"].as_array().unwrap().iter().filter(|m| m["textures"][slot]["width"].is_u64()).count()
    };
    assert!(textures("base_color") > 0 && textures("normal") > 0 && textures("emission") == 1, "{room}");
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
fn info_describes_a_scene() {
    let run = Run::new();
    let output = run.pathspace(&["info", scene().to_str().unwrap()]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let text = stdout(&output);
    for part in ["hash", "triangles", "materials", "lights", "camera"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(run.files().is_empty());
}

/// `pathspace verify` of the Cornell box, small and reproducible.
fn verify(run: &Run, options: &[&str]) -> Output {
    let scene = scene();
    let small = ["verify", scene.to_str().unwrap(), "--width", "32"];
    run.pathspace(&[&small[..], options].concat())
}

#[test]
fn integrators_that_agree_are_said_to_and_shown() {
    let run = Run::new();
    fs::create_dir(run.path("out")).unwrap();
    fs::write(run.path("out/mine.txt"), "kept").unwrap();
    let options = ["--spp", "150", "--bias", "5%", "-i", "path,light,bdpt", "-o", "out", "--json"];
    let output = verify(&run, &options);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&json["outcome"], &json["exit"], &json["layout"]), (&"agree".into(), &0.into(), &1.into()));
    assert!(json["visible"].as_f64().unwrap() <= 0.05);
    assert_eq!(json["integrators"].as_array().unwrap().len(), 3);
    assert_eq!(json["integrators"][1]["uncovered"].as_f64(), Some(0.0), "the box has neither mirrors nor glass");
    let shares: f64 = json["classes"].as_array().unwrap().iter().map(|c| c["share"].as_f64().unwrap()).sum();
    assert!((shares - 1.0).abs() < 1e-9, "classes are a partition: {shares}");
    for row in json["comparisons"].as_array().unwrap() {
        for member in ["pair", "paths", "p", "share", "difference", "visible", "verdict"] {
            assert!(!row[member].is_null(), "{member}: {row}");
        }
    }
    let files: Vec<_> = json["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap().to_owned()).collect();
    for file in ["path.exr", "light.png", "bdpt.exr", "difference.png", "p-values.exr", "verify.json"] {
        assert!(files.iter().any(|f| f == file), "{file}");
    }
    let mut found: Vec<_> =
        fs::read_dir(run.path("out")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    found.sort();
    let mut expected = [files, vec!["mine.txt".to_owned()]].concat();
    expected.sort();
    assert_eq!(found, expected, "nothing is lost and nothing is left over");
    let saved: serde_json::Value = serde_json::from_slice(&fs::read(run.path("out/verify.json")).unwrap()).unwrap();
    assert_eq!(saved, json);
    assert_eq!(pixels(&fs::read(run.path("out/path.exr")).unwrap()).width, 32);
}

#[test]
fn a_verification_is_reproducible_for_any_number_of_threads() {
    let run = Run::new();
    let with = |threads: &str| {
        let options = ["--spp", "4", "-i", "path,light", "--threads", threads, "--json", "-q"];
        let mut json: serde_json::Value = serde_json::from_str(&stdout(&verify(&run, &options))).unwrap();
        let members = json["integrators"].as_array_mut().unwrap();
        members.iter_mut().for_each(|one| one["seconds"] = 0.into());
        (json, fs::read(run.path("cornell-box-verify/path.exr")).unwrap())
    };
    assert_eq!(with("1"), with("3"));
}

#[test]
fn too_short_a_verification_says_how_long_would_be_enough() {
    let run = Run::new();
    let output = verify(&run, &["--time", "100ms", "-o", "out"]);
    assert_eq!(code(&output), 5, "{}", stdout(&output));
    let text = stdout(&output);
    assert!(
        text.contains("too noisy to say") && text.contains("--time ") && text.contains("would be enough"),
        "{text}"
    );
    assert!(run.path("out/verify.json").exists());
    let output = verify(&run, &["--spp", "4", "-q"]);
    assert_eq!((code(&output), stdout(&output).as_str(), stderr(&output).as_str()), (5, "", ""));
    assert_eq!(run.files(), ["cornell-box-verify", "out"]);
}

#[test]
fn wrong_verifications_are_refused_before_they_start() {
    let run = Run::new();
    fs::write(run.path("file"), "kept").unwrap();
    for (options, exit, about) in [
        (&["-i", "path"][..], 2, "nothing to be compared with"),
        (&["-i", "path,light,path"], 2, "twice"),
        (&["-i", "path,area"], 2, "area"),
        (&["--bias", "2"], 2, "2%"),
        (&["--spp", "1"], 2, "--spp"),
        (&["--spp", "4", "--time", "1s"], 2, "--time"),
        (&["--memory-limit", "1k"], 2, "--memory-limit"),
        (&["--camera", "nobody"], 2, "nobody"),
        (&["-o", "no/where"], 4, "no folder"),
        (&["-o", "file"], 4, "not a folder"),
    ] {
        refused(&verify(&run, &[&["-q"][..], options].concat()), exit, about);
    }
    refused(&run.pathspace(&["verify", "no-such-scene.glb"]), 3, "no-such-scene.glb");
    assert_eq!(run.files(), ["file"]);
}
