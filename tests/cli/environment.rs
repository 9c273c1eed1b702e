//! Light from around the scene: maps, and the neutral sky of a scene without light.

use std::fs;

use serde_json::{Value, json};

use crate::{Run, code, pixels, refused, stderr, stdout, triangle};

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
    assert!((corner.r() - 1.0).abs() < 0.2, "the background is the environment: {corner}");
    let (said, _) = render(&["--env-color", "2"]);
    assert!(!said.contains("no light"), "{said}");
    let glaring = ["render", "-q", "dark.gltf", "--env-color", "1e20", "--env-scale", "1e20"];
    refused(&run.pathspace(&glaring), 2, "the limit");
    let (said, image) = render(&["--env-color", "0"]);
    assert!(said.contains("black"), "{said}");
    assert_eq!(image.get(0, 0).r(), 0.0);
}

/// A cube of white texels around the triangle.
fn inside_a_cube() -> String {
    const WHITE: &str = "data:image/png;base64,\
        iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4//8/AAX+Av4N70a4AAAAAElFTkSuQmCC";
    let mut document: Value = serde_json::from_str(&triangle("0.0")).unwrap();
    document["extensionsUsed"] = json!(["EXT_lights_image_based"]);
    document["images"] = json!([{ "uri": WHITE }]);
    document["scenes"][0]["extensions"] = json!({ "EXT_lights_image_based": { "light": 0 } });
    document["extensions"] = json!({ "EXT_lights_image_based": { "lights": [{
        "intensity": 3, "specularImages": [[0, 0, 0, 0, 0, 0]], "specularImageSize": 1,
        "irradianceCoefficients": vec![[0.0; 3]; 9] }] } });
    document.to_string()
}

#[test]
fn a_files_own_environment_is_there_unless_another_is_asked_for() {
    let run = Run::new();
    fs::write(run.path("own.gltf"), inside_a_cube()).unwrap();
    assert!(stdout(&run.pathspace(&["info", "own.gltf"])).contains("1 environments"));
    for (options, radiance, warns) in [
        (&[][..], 3.0, false),
        (&["--env-scale", "2"], 6.0, false),
        (&["--env-color", "0.5"], 0.5, true),
        (&["--env-color", "0.5", "--env-scale", "2"], 1.0, true),
    ] {
        let small = ["render", "own.gltf", "--width", "8", "--height", "8", "--spp", "4", "-o", "a.exr"];
        let output = run.pathspace(&[&small[..], options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let said = stderr(&output);
        assert_eq!(said.contains("the file's own environment"), warns, "{options:?}: {said}");
        assert!(!said.contains("no light") && !said.contains("no effect"), "{said}");
        let corner = pixels(&fs::read(run.path("a.exr")).unwrap()).get(0, 0);
        assert!((corner.r() / radiance - 1.0).abs() < 0.2, "{options:?}: {corner}");
    }
    let glaring = ["render", "-q", "own.gltf", "--env-scale", "1e38"];
    refused(&run.pathspace(&glaring), 2, "--env-scale");
}
