//! What a file offers to be shown or not: variants of materials, invisible nodes.

use super::*;
use crate::scene::{geometry::PrimitiveId, material::MaterialId};

/// A triangle with a material, and two variants of which one gives it another.
fn sneaker() -> Value {
    let mut document = triangle();
    document["materials"] = json!([{ "name": "plain" }, { "name": "red" }]);
    document["extensionsUsed"] = json!(["KHR_materials_variants"]);
    let names = json!([{ "name": "street" }, { "name": "beach" }, {}]);
    document["extensions"] = json!({ "KHR_materials_variants": { "variants": names } });
    let primitive = &mut document["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    let mappings = json!([{ "variants": [2], "material": 0 }, { "variants": [1, 7], "material": 1 }]);
    primitive["extensions"] = json!({ "KHR_materials_variants": { "mappings": mappings } });
    document
}

fn shown(document: &Value, variant: Option<&str>) -> Result<Loaded, LoadError> {
    let options = LoadOptions { variant, ..LoadOptions::default() };
    crate::io::read(document.to_string().as_bytes(), Path::new("."), "x.gltf", &options)
}

#[test]
fn a_variant_gives_primitives_its_materials() {
    for (variant, material, index) in
        [(None, 0, None), (Some("beach"), 1, Some(1)), (Some("1"), 1, Some(1)), (Some("street"), 0, Some(0))]
    {
        let loaded = shown(&sneaker(), variant).unwrap();
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        assert_eq!(loaded.geometry.material(PrimitiveId::world(0)), MaterialId(material), "{variant:?}");
        assert_eq!(
            (loaded.summary.variant, &loaded.summary.variants[..2]),
            (index, &["street", "beach"].map(str::to_owned)[..])
        );
    }
}

#[test]
fn a_variant_that_is_not_there_is_a_sentence() {
    let error = shown(&sneaker(), Some("sea")).map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "x.gltf: there is no variant “sea”: the file has 0 “street”, 1 “beach”, 2 “”");
    let error = shown(&triangle(), Some("0")).map(|_| ()).unwrap_err().to_string();
    assert_eq!(error, "x.gltf: there is no variant “0”: the file has none");
    let mapping = "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings";
    let beyond = changed(sneaker(), &format!("{mapping}/1/material"), json!(2));
    let error = shown(&beyond, Some("beach")).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains(&format!("{mapping}/1/material: this index points to no material")), "{error}");
    assert!(shown(&changed(sneaker(), mapping, json!(3)), Some("beach")).is_ok());
}

#[test]
fn invisible_nodes_are_not_there_but_for_cameras() {
    let hidden = |visible: Value| json!({ "KHR_node_visibility": { "visible": visible } });
    let mut document = triangle();
    let mut lamp = hidden(json!(true));
    lamp["KHR_lights_punctual"] = json!({ "light": 0 });
    let mut ball = hidden(json!(true));
    ball["PATHSPACE_sphere"] = json!({ "radius": 1 });
    document["nodes"] = json!([
        { "children": [1, 2, 3, 4], "extensions": hidden(json!(false)) },
        { "mesh": 0 },
        { "extensions": lamp },
        { "extensions": ball },
        { "camera": 0 },
    ]);
    document["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }]);
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    document["extensionsUsed"] = json!(["KHR_node_visibility", "KHR_lights_punctual", "PATHSPACE_sphere"]);
    let count = |document: &Value| {
        let loaded = load(document).unwrap();
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let geometry = &loaded.geometry;
        (geometry.triangle_count(), geometry.sphere_count(), loaded.lights.len(), loaded.cameras.len())
    };
    assert_eq!(count(&document), (0, 0, 0, 1));
    let there = changed(document.clone(), "/nodes/0/extensions", json!({ "KHR_node_visibility": {} }));
    assert_eq!(count(&there), (1, 1, 1, 1));
    let wrong = changed(document, "/nodes/0/extensions", hidden(json!(0)));
    let error = load(&wrong).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("/nodes/0/extensions/KHR_node_visibility/visible: this is neither"), "{error}");
}
