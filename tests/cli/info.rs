//! `pathspace info`, for people and for programs.

use std::fs;

use crate::{Run, code, scene, stderr, stdout, triangle};

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

#[test]
fn info_says_which_volumes_are_no_bodies() {
    let run = Run::new();
    let glass = r#""materials": [{ "name": "window", "extensions": {
        "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_volume": { "thicknessFactor": 1 } },
        "pbrMetallicRoughness": { "metallicFactor": 0 } }], "meshes": [{ "primitives": [{ "material": 0, "#;
    let document = triangle("0").replace(r#""meshes": [{ "primitives": [{ "#, glass);
    fs::write(run.path("open.gltf"), document).unwrap();
    let text = stdout(&run.pathspace(&["info", "open.gltf"]));
    assert!(text.contains("“window”") && text.contains("not closed (3 edges"), "{text}");
    let info: serde_json::Value =
        serde_json::from_str(&stdout(&run.pathspace(&["info", "open.gltf", "--json"]))).unwrap();
    assert!(info["warnings"][0].as_str().is_some_and(|w| w.contains("not closed (3 edges")), "{info}");
}

#[test]
fn variants_are_listed_and_chosen() {
    let run = Run::new();
    let names = r#""extensionsUsed": ["KHR_materials_variants"], "extensions": { "KHR_materials_variants": {
        "variants": [{ "name": "street" }, { "name": "beach" }] } }, "asset""#;
    fs::write(run.path("t.gltf"), triangle("0.0").replacen("\"asset\"", names, 1)).unwrap();
    let output = run.pathspace(&["info", "t.gltf", "--variant", "beach"]);
    assert!(stdout(&output).contains("variants   2: 0 'street', 1 'beach' (shown)\n"), "{}", stdout(&output));
    let output = run.pathspace(&["info", "t.gltf", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&json["variants"][1], &json["variant"]), (&"beach".into(), &serde_json::Value::Null));
    for command in ["info", "render", "verify", "converge"] {
        let output = run.pathspace(&[command, "t.gltf", "--variant", "sea"]);
        assert_eq!(code(&output), 2, "{}", stderr(&output));
        let sentence = "there is no variant “sea”: the file has 0 “street”, 1 “beach”";
        assert!(stderr(&output).contains(sentence), "{}", stderr(&output));
    }
    let small = ["render", "t.gltf", "-q", "--spp", "1", "--width", "8", "--height", "8", "-o", "a.exr"];
    assert_eq!(code(&run.pathspace(&[&small[..], &["--variant", "0"]].concat())), 0);
    assert!(String::from_utf8_lossy(&fs::read(run.path("a.exr")).unwrap()).contains("pathspace.variant"));
}

#[test]
fn info_names_measured_metals() {
    let run = Run::new();
    let metal = r#"{ "extensions": { "PATHSPACE_materials_metal": { "name": "Au" } } }"#;
    let document = triangle("0").replacen("\"meshes\"", &format!("\"materials\": [{metal}], \"meshes\""), 1);
    let document = document.replacen("{ \"POSITION\": 0 }", "{ \"POSITION\": 0 }, \"material\": 0", 1);
    fs::write(run.path("gold.gltf"), document).unwrap();
    let text = stdout(&run.pathspace(&["info", "gold.gltf"]));
    assert!(text.contains("measured: Au"), "{text}");
    let json: serde_json::Value =
        serde_json::from_str(&stdout(&run.pathspace(&["info", "gold.gltf", "--json"]))).unwrap();
    assert_eq!(json["materials"][0]["metal"], "Au");
}
