//! Images in which no light has arrived: nothing is known of their noise, and a sentence says why.

use std::fs;

use crate::{Run, code, stderr, triangle};

/// A triangle in the sun, and another 300 km away: light that is spread over both meets neither.
fn far_speck() -> String {
    let nodes = r#""nodes": [{ "mesh": 0 }, { "mesh": 0, "translation": [300000, 0, 0] },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } } }, { "camera": 0, "translation": [0.3, 0.3, 2] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "directional", "intensity": 3 }] } }"#;
    let document = triangle("0.0").replacen(r#""nodes": [{ "mesh": 0 }]"#, nodes, 1);
    document.replacen(r#""scenes": [{ "nodes": [0] }]"#, r#""scenes": [{ "nodes": [0, 1, 2, 3] }]"#, 1)
}

#[test]
fn a_black_image_has_unknown_noise_and_says_why() {
    let run = Run::new();
    fs::write(run.path("speck.gltf"), far_speck()).unwrap();
    let render = |options: &[&str]| {
        let small = ["render", "speck.gltf", "--width", "8", "--height", "8", "-o", "a.exr", "--stats", "a.json"];
        let spp: &[&str] = if options.contains(&"--spp") { &[] } else { &["--spp", "4"] };
        let output = run.pathspace(&[&small[..], spp, options].concat());
        let stats: serde_json::Value = serde_json::from_slice(&fs::read(run.path("a.json")).unwrap()).unwrap();
        (code(&output), stderr(&output), stats)
    };
    let known = |stats: &serde_json::Value| (stats["noise"].is_number(), stats["black"].is_string());
    let (exit, said, stats) = render(&["-i", "path"]);
    assert!(exit == 0 && said.contains("noise ") && !said.contains("black"), "{said}");
    assert_eq!(known(&stats), (true, false));

    for (options, why) in [
        (&["-i", "light"][..], "no path from the lights met a surface in the image"),
        (&["-i", "path", "--paths", "C.*S+L"], "no path that --paths 'C.*S+L' keeps was found"),
        (&["-i", "path", "--max-depth", "1"], "--max-depth 1"),
    ] {
        let (exit, said, stats) = render(options);
        assert_eq!(exit, 0, "{said}");
        assert!(said.contains("noise unknown (no light has arrived"), "{options:?}: {said}");
        assert!(said.contains("the image is black") && said.contains(why), "{options:?}: {said}");
        assert_eq!(known(&stats), (false, true), "{options:?}");
        let file = fs::read(run.path("a.exr")).unwrap();
        assert!(String::from_utf8_lossy(&file).contains("unknown: no light has arrived"));
    }
    // Black is not good enough for any noise.
    let (_, said, stats) = render(&["-i", "light", "--spp", "32", "--noise", "50%"]);
    assert!(said.contains("32 spp are not enough for --noise 0.5"), "{said}");
    assert_eq!(stats["noise_reached"], false);
}
