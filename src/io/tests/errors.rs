//! Each way to be wrong has its sentence.

use super::*;

fn refused(document: &Value, parts: &[&str]) {
    says(load(document), parts);
}

fn says(result: Result<Loaded, LoadError>, parts: &[&str]) {
    let error = result.expect_err("this must be refused").to_string();
    assert!(!error.contains('\n'), "{error}");
    for part in parts {
        assert!(error.contains(part), "“{part}” is missing in: {error}");
    }
}

#[test]
fn files_that_are_not_there_or_not_glb() {
    says(crate::io::load(Path::new("no/such.glb")), &["cannot read no/such.glb", "check the name"]);
    says(crate::io::load(Path::new(env!("CARGO_MANIFEST_DIR"))), &["not a regular file"]);
    let read = |bytes: &[u8]| crate::io::read(bytes, Path::new("."), "x.glb", &LoadOptions::default());
    let whole = glb(r#"{"asset":{"version":"2.0"}}"#, Some(&[1, 2, 3, 4]));
    assert!(read(&whole).is_ok());
    for n in 1..whole.len() {
        says(read(&whole[..n]), &["x.glb"]);
    }
    says(read(b""), &["the file is empty"]);
    says(read(&whole[..whole.len() - 5]), &["byte 55", "truncated"]);
    says(read(b"glTF\x01\0\0\0\x0c\0\0\0"), &["version 1"]);
    says(read(b"glTF\x02\0\0\0\x0c\0\0\0"), &["no JSON chunk"]);
    says(read(b"glTF\x02\0\0\0\x01\0\0\0"), &["no JSON chunk"]);
    says(read(b"a text\nof two lines"), &["line 1, column 1"]);
    let mut chunk = whole;
    chunk[12] = 0xff;
    says(read(&chunk), &["byte 12", "beyond the end"]);
}

#[test]
fn json_errors_name_their_place() {
    let read = |text: &str| crate::io::read(text.as_bytes(), Path::new("."), "x.gltf", &LoadOptions::default());
    says(read("{\n \"asset\": {\"version\": 2.0}}"), &["x.gltf, line 2", "expected a string"]);
    says(read("{\"asset\":"), &["EOF", "column"]);
    says(read(r#"{"asset":{"version":"1.0"},"meshes":{"a":{}}}"#), &["glTF “1.0”, not 2.0"]);
    says(read(r#"{"asset":{"version":"1.0"}}"#), &["/asset/version"]);
    says(read(r#"{"asset":{"version":"2.0","minVersion":"2.7"}}"#), &["/asset/minVersion"]);
    says(read(r#"{"asset":{"version":"2.\n\u001b[31m0"},"meshes":3}"#), &["expected a sequence"]);
    says(read(&format!("{{\"extensions\":{{\"X\":{}", "[".repeat(100_000))), &["recursion limit"]);
}

#[test]
fn indices_out_of_range() {
    let cases = [
        ("/scene", 1, "/scene"),
        ("/scenes/0/nodes/0", 7, "/scenes/0/nodes/0"),
        ("/nodes/0/mesh", 7, "/nodes/0/mesh"),
        ("/nodes/0/camera", 7, "/nodes/0/camera"),
        ("/meshes/0/primitives/0/attributes/POSITION", 9, "/meshes/0/primitives/0/attributes/POSITION"),
        ("/meshes/0/primitives/0/attributes/NORMAL", 9, "/meshes/0/primitives/0/attributes/NORMAL"),
        ("/meshes/0/primitives/0/indices", 9, "/meshes/0/primitives/0/indices"),
        ("/meshes/0/primitives/0/material", 0, "/meshes/0/primitives/0/material"),
        ("/accessors/1/bufferView", 3, "/accessors/1/bufferView"),
        ("/bufferViews/2/buffer", 1, "/bufferViews/2/buffer"),
    ];
    for (pointer, value, place) in cases {
        refused(&with(pointer, json!(value)), &[&format!("x.gltf, {place}: ")]);
    }
    let mut bytes =
        STANDARD.decode(triangle()["buffers"][0]["uri"].as_str().unwrap().split_once(',').unwrap().1).unwrap();
    bytes[73] = 3;
    refused(&document(&bytes), &["/accessors/2: element 1 is index 3, and there are 3 positions"]);
    bytes[73] = 1;
    bytes[16..20].copy_from_slice(&f32::NAN.to_le_bytes());
    refused(&document(&bytes), &["/accessors/0: the position in element 1 is not finite"]);
}

#[test]
fn arrays_that_leave_their_buffers() {
    refused(&with("/accessors/0/count", json!(4)), &["/accessors/0: 4 elements of 12 bytes"]);
    refused(&with("/accessors/0/byteOffset", json!(u64::MAX)), &["/accessors/0"]);
    refused(&with("/accessors/0/count", json!(u64::MAX / 16)), &["/accessors/0/count", "is the limit"]);
    refused(&with("/accessors/0/type", json!("MAT9")), &["/accessors/0/type"]);
    refused(&with("/accessors/0/type", json!("SCALAR")), &["/accessors/0/type", "VEC3"]);
    refused(&with("/accessors/2/componentType", json!(5126)), &["/accessors/2"]);
    refused(
        &with("/accessors/2/componentType", json!(5120)),
        &["/accessors/2/componentType: indices must be unsigned"],
    );
    refused(&with("/accessors/0/componentType", json!(1)), &["/accessors/0/componentType"]);
    refused(&with("/accessors/1/count", json!(2)), &["2 normals for 3 positions"]);
    refused(&with("/bufferViews/2/byteLength", json!(5)), &["/bufferViews/2"]);
    refused(&with("/bufferViews/2/byteOffset", json!(u64::MAX)), &["/bufferViews/2"]);
    refused(&with("/bufferViews/0/byteStride", json!(3)), &["/bufferViews/0/byteStride"]);
    refused(&with("/buffers/0/byteLength", json!(1000)), &["/buffers/0/byteLength", "1000 bytes and has 76"]);
    refused(&with("/buffers/0", json!({ "byteLength": 76 })), &["/buffers/0", "no URI"]);
    let sparse = |count: u64, index_type: u32| {
        json!({ "count": count, "indices": { "bufferView": 2, "componentType": index_type },
            "values": { "bufferView": 1 } })
    };
    refused(&with("/accessors/0/sparse", sparse(4, 5121)), &["/accessors/0/sparse/count"]);
    refused(&with("/accessors/0/sparse", sparse(3, 5125)), &["/accessors/0/sparse"]);
    refused(&with("/accessors/0/sparse", sparse(1, 5126)), &["/accessors/0/sparse/indices/componentType"]);
    let zeros = json!({ "componentType": 5126, "count": 1_u64 << 40, "type": "VEC3", "sparse": sparse(1, 5121) });
    refused(&with("/accessors/0", zeros), &["is the limit"]);
}

#[test]
fn buffers_that_cannot_be_had() {
    let uri = |uri: &str| with("/buffers/0/uri", json!(uri));
    for bad in
        ["../secret.bin", "%2e%2e/secret.bin", "/etc/passwd", "http://a.b/c.bin", "a\\..\\b.bin", "", "a/../../b"]
    {
        refused(&uri(bad), &["/buffers/0/uri", "leads out of the model's folder"]);
    }
    refused(&uri("no such.bin"), &["cannot read the buffer “no such.bin”", "one folder"]);
    refused(&uri("line\nbreak.bin"), &["line\u{fffd}break"]);
    refused(&uri("data:application/octet-stream;base64,@@@@"), &["not base64"]);
    refused(&uri("data:application/octet-stream;base64"), &["no comma"]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a b.bin"), [0; 76]).unwrap();
    std::fs::write(folder.path().join("x.gltf"), uri("a%20b.bin").to_string()).unwrap();
    assert_eq!(crate::io::load(&folder.path().join("x.gltf")).unwrap().geometry.triangle_count(), 1);
}

#[test]
fn hierarchies_that_are_no_trees() {
    let nodes = |nodes: Value| with("/nodes", nodes);
    refused(&nodes(json!([{ "children": [0] }])), &["/nodes/0", "own ancestor"]);
    refused(&nodes(json!([{}, { "children": [2] }, { "children": [1] }])), &["own ancestor"]);
    refused(&nodes(json!([{ "children": [2] }, { "children": [2] }, {}])), &["/nodes/1/children/0", "node 0"]);
    refused(&nodes(json!([{}, { "children": [0] }])), &["/scenes/0/nodes/0", "child of node 1"]);
    refused(&with("/scenes/0/nodes", json!([0, 0])), &["/scenes/0/nodes/1", "twice"]);
    refused(&with("/nodes/0/rotation", json!([0, 0, 0, 0])), &["/nodes/0/rotation"]);
    refused(&with("/nodes/0/scale", json!([1e39, 1, 1])), &["/nodes/0/scale"]);
    refused(&with("/nodes/0/matrix", json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])), &["/nodes/0/matrix"]);
    let far = json!([{ "children": [1], "scale": [1e30, 1, 1] }, { "mesh": 0, "scale": [1e30, 1, 1] }]);
    refused(&nodes(far), &["/nodes/1", "vertex 1"]);
    let deep: Vec<_> = (1..20_000).map(|i| json!({ "children": [i] })).chain([json!({ "mesh": 0 })]).collect();
    assert_eq!(load(&nodes(json!(deep))).unwrap().geometry.triangle_count(), 1);
}

#[test]
fn extensions_by_name() {
    let required = json!(["EXT_texture_avif", "KHR_materials_volume", "X\u{7}Y"]);
    refused(&with("/extensionsRequired", required), &["extensions “EXT_texture_avif”, “X\u{fffd}Y” are not"]);
    let textures = json!(["EXT_texture_avif", "EXT_meshopt_compression", "MSFT_texture_dds"]);
    let help = "“gltf-transform png IN.glb OUT.glb” turns its textures into PNG, save its textures as PNG; export";
    refused(&with("/extensionsRequired", textures), &[help]);
    let used = load(&with("/extensionsUsed", json!(["ACME_xmp", "KHR_materials_ior"]))).unwrap();
    assert_eq!(used.warnings.len(), 1);
    assert!(used.warnings[0].contains("“ACME_xmp”"));
}

#[test]
fn spheres_lights_and_cameras_out_of_bounds() {
    let sphere = |sphere: Value| with("/nodes/0/extensions", json!({ "PATHSPACE_sphere": sphere }));
    for radius in [json!(0), json!(-1), json!("1"), json!(1e300), Value::Null] {
        refused(&sphere(json!({ "radius": radius })), &["/nodes/0/extensions/PATHSPACE_sphere/radius"]);
    }
    refused(&sphere(json!(3)), &["/radius"]);
    refused(&sphere(json!({ "radius": 1, "material": 0 })), &["/PATHSPACE_sphere/material"]);
    let lit = |light: Value| {
        let document = with("/nodes/0/extensions", json!({ "KHR_lights_punctual": { "light": 0 } }));
        changed(document, "/extensions", json!({ "KHR_lights_punctual": { "lights": [light] } }))
    };
    refused(&lit(json!({ "type": "point", "intensity": -1 })), &["/lights/0", "non-negative"]);
    refused(&lit(json!({ "type": "point", "intensity": 2e30 })), &["/lights/0", "2e30", "1e30 is the limit"]);
    refused(&lit(json!({ "type": "area" })), &["/lights/0/type"]);
    refused(
        &lit(json!({ "type": "spot", "spot": { "innerConeAngle": 1, "outerConeAngle": 0.5 } })),
        &["/lights/0/spot"],
    );
    refused(&with("/nodes/0/extensions", json!({ "KHR_lights_punctual": { "light": 0 } })), &["/nodes/0/extensions"]);
    let seen = |lens: Value| {
        let document = with("/nodes/0/camera", json!(0));
        changed(document, "/cameras", json!([{ "type": "perspective", "perspective": lens }]))
    };
    refused(&seen(json!({ "yfov": 4, "znear": 1 })), &["/cameras/0/perspective/yfov"]);
    refused(&seen(json!({ "yfov": 1e-20, "znear": 1 })), &["/cameras/0/perspective/yfov", "is the least"]);
    refused(&seen(json!({ "yfov": 1, "znear": 1, "aspectRatio": 0 })), &["/cameras/0/perspective/aspectRatio"]);
    let lens = |lens: Value| {
        let document = seen(json!({ "yfov": 1, "znear": 1 }));
        changed(document, "/cameras/0/extensions", json!({ "PATHSPACE_thin_lens": lens }))
    };
    let place = "/cameras/0/extensions/PATHSPACE_thin_lens";
    refused(&lens(json!({ "focusDistance": 1 })), &[place, "/aperture: a lens needs"]);
    refused(&lens(json!({ "aperture": -0.1, "focusDistance": 1 })), &[place, "no diameter"]);
    refused(&lens(json!({ "aperture": 1e30, "focusDistance": 1 })), &[place, "no diameter"]);
    refused(&lens(json!({ "aperture": 0.1, "focusDistance": 0 })), &[place, "the focus distance lies"]);
    refused(&lens(json!({ "aperture": 0.1, "focusDistance": "far" })), &[place, "/focusDistance: "]);
    let iris = |blades: Value, rotation: Value| {
        lens(json!({ "aperture": 1, "focusDistance": 1, "blades": blades, "rotation": rotation }))
    };
    refused(&iris(json!(2), json!(0)), &[place, "/blades: the number of blades is not one of 3 to 64"]);
    refused(&iris(json!(6), json!("much")), &[place, "/rotation: this is no angle"]);
    let film = |x: f64, y: f64| {
        let document = with("/nodes/0/camera", json!(0));
        let film = json!({ "xmag": x, "ymag": y, "znear": 0, "zfar": 1 });
        changed(document, "/cameras", json!([{ "type": "orthographic", "orthographic": film }]))
    };
    refused(&film(0.0, 1.0), &["/cameras/0/orthographic/xmag", "no extent"]);
    refused(&film(1.0, 3e38), &["/cameras/0/orthographic/ymag", "no extent"]);
    let both = changed(film(1.0, 1.0), "/cameras/0/extensions", json!({ "PATHSPACE_thin_lens": {} }));
    refused(&both, &[place, "no lens"]);
    let flat = changed(seen(json!({ "yfov": 1, "znear": 1 })), "/nodes/0/scale", json!([0, 0, 0]));
    refused(&flat, &["/nodes/0", "no direction"]);
    refused(&with("/materials", json!([{ "emissiveFactor": [1e39, 0, 0] }])), &["/materials/0", "emissiveFactor"]);
    let bright = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 1e31 } });
    let bright = json!([{ "emissiveFactor": [1, 1, 1], "extensions": bright }]);
    refused(&with("/materials", bright), &["/materials/0/emissiveFactor", "1e30 is the limit"]);
}

#[test]
fn metadata_is_no_reason_for_a_warning() {
    let names = json!(["EXT_mesh_features", "EXT_structural_metadata", "KHR_xmp", "KHR_xmp_json_ld"]);
    let mut document = changed(triangle(), "/extensionsUsed", names.clone());
    assert_eq!(load(&document).unwrap().warnings, Vec::<String>::new());
    document["extensionsRequired"] = names;
    assert_eq!(load(&document).unwrap().warnings, Vec::<String>::new());
}

#[test]
fn required_extensions_of_materials_are_ignored_on_request_and_no_others() {
    let read = |required: Value, policy| {
        let mut document = triangle();
        document["extensionsRequired"] = required.clone();
        document["extensionsUsed"] = required;
        let options = LoadOptions { required: policy, ..LoadOptions::default() };
        crate::io::read(document.to_string().as_bytes(), Path::new("."), "x.gltf", &options)
    };
    let materials = json!(["ACME_materials_fuzz", "ACME_materials_velvet"]);
    let error = read(materials.clone(), Required::Honoured).unwrap_err().to_string();
    assert!(error.contains("“ACME_materials_fuzz”") && error.contains("--ignore-required"), "{error}");
    let warnings = read(materials, Required::MaterialsIgnored).unwrap().warnings;
    let loud: Vec<_> = warnings.iter().filter(|w| w.contains("REQUIRES")).collect();
    assert!(loud.len() == 2 && loud[0].contains("ACME_materials_fuzz") && warnings.len() == 2, "{warnings:?}");
    for others in [json!(["ACME_materials_fuzz", "EXT_texture_avif"]), json!(["ACME_x"])] {
        let error = read(others, Required::MaterialsIgnored).unwrap_err().to_string();
        assert!(error.contains("not supported") && !error.contains("--ignore-required"), "{error}");
    }
}
