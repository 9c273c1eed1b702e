//! `--at` and `--frames`: scenes at a time, and images of many times.

use std::{fs, path::Path};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use crate::{Run, code, pixels, refused, stderr, stdout, triangle};

/// [`triangle`], which shines, with these numbers of an animation of node 0 from 0 s to 1 s.
fn moving(channels: &[(&str, &str, &[f32])]) -> Value {
    let mut document: Value = serde_json::from_str(&triangle("0.0")).unwrap();
    document["materials"] = json!([{ "emissiveFactor": [1.0, 0.5, 0.25], "doubleSided": true }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    let mut bytes: Vec<u8> = [0.0_f32, 1.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let view = json!({ "bufferView": 1, "componentType": 5126 });
    let accessor = |offset: usize, count: usize, kind: &str| {
        let mut accessor = view.clone();
        (accessor["byteOffset"], accessor["count"], accessor["type"]) = (json!(offset), json!(count), json!(kind));
        accessor
    };
    let mut accessors = vec![document["accessors"][0].clone(), accessor(0, 2, "SCALAR")];
    let (mut samplers, mut targets) = (Vec::new(), Vec::new());
    for (i, (path, kind, values)) in channels.iter().enumerate() {
        let width = if *kind == "VEC3" { 3 } else { 1 };
        accessors.push(accessor(bytes.len(), values.len() / width, kind));
        bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
        samplers.push(json!({ "input": 1, "output": i + 2 }));
        targets.push(json!({ "sampler": i, "target": { "node": 0, "path": path } }));
    }
    document["accessors"] = json!(accessors);
    let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes));
    document["buffers"].as_array_mut().unwrap().push(json!({ "byteLength": bytes.len(), "uri": uri }));
    document["bufferViews"].as_array_mut().unwrap().push(json!({ "buffer": 1, "byteLength": bytes.len() }));
    document["animations"] = json!([{ "name": "slide", "channels": targets, "samplers": samplers }]);
    document
}

/// A run with the file `a.gltf`, of a triangle that slides from x = 0 to x = 1 in a second.
fn sliding() -> Run {
    let run = Run::new();
    let document = moving(&[("translation", "VEC3", &[0., 0., 0., 1., 0., 0.])]);
    fs::write(run.path("a.gltf"), document.to_string()).unwrap();
    run
}

const SMALL: [&str; 11] =
    ["-i", "path", "--width", "12", "--height", "8", "--look-at", "0.5,0.5,4,0.5,0.5,0", "--threads", "2", "--quiet"];

fn render(run: &Run, options: &[&str]) -> std::process::Output {
    run.pathspace(&[&["render", "a.gltf"], &SMALL[..], options].concat())
}

#[track_caller]
fn rendered(run: &Run, options: &[&str]) {
    let output = render(run, options);
    assert_eq!(code(&output), 0, "{options:?}: {}", stderr(&output));
}

fn file(run: &Run, name: impl AsRef<Path>) -> Vec<u8> {
    fs::read(run.folder.path().join(name)).unwrap()
}

#[test]
fn a_frame_is_the_render_at_its_time_with_its_seed() {
    let run = sliding();
    rendered(&run, &["--spp", "3", "--seed", "5", "--frames", "0..3", "--fps", "3", "-o", "f.exr", "-o", "f_##.png"]);
    let mut names: Vec<_> = (0..4).flat_map(|f| [format!("f.000{f}.exr"), format!("f_0{f}.png")]).collect();
    names.push("a.gltf".to_owned());
    names.sort();
    assert_eq!(run.files(), names);
    for (frame, at, seed) in [(0, "0", "5"), (1, "0.33333334", "6"), (2, "0.6666667", "7"), (3, "1", "8")] {
        rendered(&run, &["--spp", "3", "--seed", seed, "--at", at, "-o", "one.exr"]);
        let name = format!("f.000{frame}.exr");
        assert!(file(&run, &name) == file(&run, "one.exr"), "{name}");
        rendered(&run, &["--spp", "3", "--seed", "5", "--frames", &frame.to_string(), "--fps", "3", "-o", "alone.exr"]);
        assert!(file(&run, &name) == file(&run, format!("alone.000{frame}.exr")), "{name} alone");
    }
    let lit = |frame: u32| {
        let image = pixels(&file(&run, format!("f.000{frame}.exr")));
        let column = |x: u32| (0..image.height).map(|y| image.get(x, y).r()).sum::<f32>();
        (0..image.width).map(|x| x as f32 * column(x)).sum::<f32>() / (0..image.width).map(column).sum::<f32>()
    };
    let places: Vec<_> = (0..4).map(lit).collect();
    assert!(places.windows(2).all(|pair| pair[1] > pair[0] + 0.3), "{places:?}");
}

#[test]
fn frames_that_are_finished_are_left_and_begun_ones_gone_on_with() {
    let run = sliding();
    let frames = ["--frames", "0..3", "--fps", "3", "--spp", "6", "-o", "f.exr"];
    rendered(&run, &frames);
    let wanted: Vec<_> = (0..4).map(|f| file(&run, format!("f.000{f}.exr"))).collect();
    // Frame 1 is missing, 2 has other settings, 3 was begun and has a checkpoint.
    fs::remove_file(run.path("f.0001.exr")).unwrap();
    rendered(&run, &["--frames", "2", "--fps", "3", "--spp", "6", "--max-depth", "3", "-o", "f.exr"]);
    rendered(&run, &["--frames", "3", "--fps", "3", "--spp", "2", "--checkpoint", "c.exr", "-o", "f.exr"]);
    let before = fs::metadata(run.path("f.0000.exr")).unwrap().modified().unwrap();
    let output = run.pathspace(&[&["render", "a.gltf"], &SMALL[..10], &frames, &["--resume", "c.exr"]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = stderr(&output);
    assert_eq!(said.matches("is finished").count(), 1, "{said}");
    assert!(said.contains("frame 3 of 0..3, 1 s") && said.contains("'f.0000.exr' is finished"), "{said}");
    assert_eq!(fs::metadata(run.path("f.0000.exr")).unwrap().modified().unwrap(), before);
    for (frame, wanted) in wanted.iter().enumerate() {
        assert!(file(&run, format!("f.000{frame}.exr")) == *wanted, "frame {frame}");
    }
    // Without --resume nothing is kept.
    rendered(&run, &frames);
    assert_ne!(fs::metadata(run.path("f.0000.exr")).unwrap().modified().unwrap(), before);
}

#[test]
fn options_of_time_that_contradict_each_other_are_refused() {
    let run = sliding();
    for (options, about) in [
        (&["--at", "1", "--frames", "0..1"][..], "cannot be used with"),
        (&["--frames", "0..1", "--shard", "1/2"], "cannot be used with"),
        (&["--frames", "3..1"], "the first frame is not after the last"),
        (&["--fps", "30"], "--frames"),
        (&["--animation", "0"], "--at"),
        (&["--at", "nan"], "--at"),
        (&["--at", "0", "--animation", "jump"], "there is no animation “jump”: the file has 0 “slide”"),
        (&["--frames", "0..1", "--time", "1s", "--resume", "c.exr"], "cannot tell which frames"),
    ] {
        refused(&render(&run, &[options, &["-o", "no.exr"]].concat()), 2, about);
    }
    assert_eq!(run.files(), ["a.gltf"]);
}

#[test]
fn every_command_shows_a_scene_at_a_time() {
    let run = sliding();
    let info = |options: &[&str]| stdout(&run.pathspace(&[&["info", "a.gltf"], options].concat()));
    assert!(info(&[]).contains("animations 1: 0 'slide' (1 s)\n") && info(&[]).contains("warning    its animation"));
    let posed = info(&["--at", "0.5", "--animation", "slide"]);
    assert!(
        posed.contains("(1 s, shown at 0.5 s)") && posed.contains("bounds     [0.5, 0, 0] to [1.5, 1, 0]"),
        "{posed}"
    );
    let json: Value = serde_json::from_str(&info(&["--at", "0.25", "--json"])).unwrap();
    assert_eq!(json["animations"], json!([{ "name": "slide", "seconds": 1.0, "shown": true }]));
    assert_eq!((&json["at"], &json["geometry"]["bounds"]["min"][0]), (&json!(0.25), &json!(0.25)));
    // Column 8 of 12 sees x ≈ 1.3, where the triangle is at 1 s.
    let trace = |at: &str| {
        let traced = run
            .pathspace(&[&["trace", "a.gltf"], &SMALL[..8], &["--spp", "16", "--pixel", "8,4", "--at", at]].concat());
        assert_eq!(code(&traced), 0, "{}", stderr(&traced));
        stdout(&traced)
    };
    assert_ne!(trace("0"), trace("1"));
}

#[test]
fn a_frame_has_a_time() {
    let run = sliding();
    refused(&render(&run, &["--frames", "1..2", "--fps", "1e-40", "-o", "f.exr"]), 2, "beyond all times");
}

/// A morph target at a time is the mesh with its corners written there.
#[test]
fn a_posed_scene_is_the_image_of_one_that_was_written_so() {
    let run = Run::new();
    let mut document = moving(&[("weights", "SCALAR", &[0., 1.]), ("translation", "VEC3", &[0., 0., 0., 0., 0.5, 0.])]);
    // The target is the mesh itself: at weight w it is 1 + w times as large.
    document["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }]);
    fs::write(run.path("a.gltf"), document.to_string()).unwrap();
    rendered(&run, &["--spp", "4", "--at", "0.5", "-o", "posed.exr"]);
    let mut written: Value = serde_json::from_str(&document.to_string()).unwrap();
    written.as_object_mut().unwrap().remove("animations");
    written["nodes"][0]["scale"] = json!([1.5, 1.5, 1.5]);
    written["nodes"][0]["translation"] = json!([0.0, 0.25, 0.0]);
    fs::write(run.path("a.gltf"), written.to_string()).unwrap();
    rendered(&run, &["--spp", "4", "-o", "written.exr"]);
    let [posed, written] = ["posed.exr", "written.exr"].map(|name| pixels(&file(&run, name)));
    assert_eq!(posed.pixels, written.pixels);
}
