//! Documents at a time: the same as documents with the numbers of that time written into them.

use super::*;
use crate::io::{animation::PROPERTIES, limits::PosedAt};

/// What a channel of a test animates: a pointer, the type of its values, and those of all keys.
struct Channel<'a>(&'a str, &'a str, &'a [f32]);

/// `document` with an animation of these channels, whose keys are at these times.
fn animated(mut document: Value, times: &[f32], interpolation: &str, channels: &[Channel<'_>]) -> Value {
    let (buffer, view) =
        (document["buffers"].as_array().unwrap().len(), document["bufferViews"].as_array().unwrap().len());
    let mut bytes = Vec::new();
    let mut push = |document: &mut Value, numbers: &[f32], kind: &str| {
        let width = match kind {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 1,
        };
        let accessors = document["accessors"].as_array_mut().unwrap();
        let (offset, count) = (bytes.len(), numbers.len() / width);
        accessors.push(if kind == "FLAGS" {
            bytes.extend(numbers.iter().map(|&x| x as u8));
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            json!({ "bufferView": view, "byteOffset": offset, "componentType": 5121, "count": count, "type": "SCALAR" })
        } else {
            bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
            json!({ "bufferView": view, "byteOffset": offset, "componentType": 5126, "count": count, "type": kind })
        });
        accessors.len() - 1
    };
    let input = push(&mut document, times, "SCALAR");
    let (mut samplers, mut list) = (Vec::new(), Vec::new());
    for (i, Channel(pointer, kind, values)) in channels.iter().enumerate() {
        let output = push(&mut document, values, kind);
        samplers.push(json!({ "input": input, "interpolation": interpolation, "output": output }));
        let parts: Vec<_> = pointer.split('/').collect();
        let target = match parts[..] {
            ["", "nodes", node, path] => json!({ "node": node.parse::<usize>().unwrap(), "path": path }),
            _ => json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": pointer } } }),
        };
        list.push(json!({ "sampler": i, "target": target }));
    }
    let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes));
    document["buffers"].as_array_mut().unwrap().push(json!({ "byteLength": bytes.len(), "uri": uri }));
    document["bufferViews"].as_array_mut().unwrap().push(json!({ "buffer": buffer, "byteLength": bytes.len() }));
    let mut animations = document["animations"].as_array().cloned().unwrap_or_default();
    animations.push(json!({ "channels": list, "samplers": samplers }));
    document["animations"] = json!(animations);
    document
}

fn at(document: &Value, seconds: f32, animation: Option<&str>) -> Result<Loaded, LoadError> {
    let options = LoadOptions { at: Some(PosedAt { seconds, animation }), ..LoadOptions::default() };
    crate::io::read(document.to_string().as_bytes(), Path::new("."), "x.gltf", &options)
}

/// All that is seen of a document.
fn seen(loaded: Loaded) -> String {
    let Loaded { geometry, materials, lights, cameras, .. } = loaded;
    format!("{geometry:?} {materials:?} {lights:?} {cameras:?}")
}

/// A triangle with a morph target and a textured material, a spot light, two cameras and a sphere.
fn everything() -> Value {
    let mut document = triangle();
    document["nodes"] = json!([
        { "mesh": 0, "weights": [0.0] },
        { "camera": 0 },
        { "camera": 1 },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "extensions": { "PATHSPACE_sphere": { "radius": 1.0 } } },
        { "mesh": 0 },
    ]);
    document["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4, 5]);
    document["meshes"][0]["weights"] = json!([0.0]);
    document["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    document["materials"] = json!([{}]);
    let lens = json!({ "PATHSPACE_thin_lens": { "aperture": 0.1, "focusDistance": 1.0 } });
    document["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 }, "extensions": lens },
        { "type": "orthographic", "orthographic": { "xmag": 1.0, "ymag": 1.0, "znear": 0.1, "zfar": 1.0 } },
    ]);
    let spot = json!({ "type": "spot", "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.9 } });
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [spot] } });
    let png = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81y\
               tgAAAABJRU5ErkJggg==";
    document["images"] = json!([{ "uri": png }]);
    document["textures"] = json!([{ "source": 0 }]);
    document
}

/// What a material needs besides a property of this pointer, for the property to be seen.
fn material_with(pointer: &str) -> Value {
    let texture = json!({ "index": 0 });
    let name = pointer.split('/').find(|part| part.starts_with("KHR_materials_")).unwrap_or_default();
    let mut material = match name {
        "KHR_materials_anisotropy" => json!({ name: { "anisotropyStrength": 0.25 } }),
        "KHR_materials_clearcoat" => json!({ name: { "clearcoatFactor": 0.25, "clearcoatNormalTexture": texture } }),
        "KHR_materials_diffuse_transmission" => json!({ name: { "diffuseTransmissionFactor": 0.25 } }),
        // The least thickness is that of black texels.
        "KHR_materials_iridescence" if pointer.ends_with("Minimum") => {
            json!({ name: { "iridescenceFactor": 0.25, "iridescenceThicknessTexture": texture } })
        }
        "KHR_materials_dispersion" => json!({
            "KHR_materials_transmission": { "transmissionFactor": 1.0 },
            "KHR_materials_volume": { "thicknessFactor": 1.0 },
        }),
        "KHR_materials_iridescence" => json!({ name: { "iridescenceFactor": 0.25 } }),
        "KHR_materials_pbrSpecularGlossiness" => json!({ name: {} }),
        "KHR_materials_sheen" => json!({ name: { "sheenColorFactor": [0.25, 0.25, 0.25] } }),
        "KHR_materials_volume" => {
            let thickness = if pointer.ends_with("thicknessFactor") { 0.0 } else { 1.0 };
            let color = [0.1, 0.2, 0.3];
            let volume = json!({ "thicknessFactor": thickness, "attenuationColor": color, "attenuationDistance": 2.0 });
            json!({ name: volume, "KHR_materials_transmission": { "transmissionFactor": 1.0 } })
        }
        _ => json!({}),
    };
    let base = json!({ "metallicFactor": 0.0 });
    material = json!({ "extensions": material, "emissiveFactor": [0.1, 0.1, 0.1], "pbrMetallicRoughness": base });
    if pointer.ends_with("alphaCutoff") {
        material["alphaMode"] = json!("MASK");
        material["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 1.0, 1.0, 0.25]);
    }
    if pointer.contains("/normalTexture") {
        material["normalTexture"] = texture;
    } else if pointer.contains("baseColorTexture") {
        material["pbrMetallicRoughness"]["baseColorTexture"] = texture;
    }
    material
}

/// The same number for a property in an animation and in the JSON is the same scene, and another scene than without.
#[test]
fn whatever_can_be_animated_is_what_the_document_says_at_that_time() {
    let transforms = ["offset", "rotation", "scale"].map(|end| {
        format!("/materials/{{}}/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/{end}")
    });
    let patterns = PROPERTIES.iter().map(|(pattern, _)| (*pattern).to_owned()).chain(transforms);
    for pattern in patterns {
        let index = match pattern.split('/').nth(1).unwrap() {
            "nodes" if pattern.contains("sphere") => "4",
            "cameras" if pattern.contains("orthographic") => "1",
            _ => "0",
        };
        let pointer = pattern.replacen("{}", index, 1).replace("{}", "0");
        let (kind, value): (_, Vec<f32>) = match pointer.rsplit('/').next().unwrap() {
            "visible" => ("FLAGS", vec![0.0]),
            "rotation" if pointer.starts_with("/nodes") => ("VEC4", vec![0.6, 0.0, 0.0, 0.8]),
            "offset" => ("VEC2", vec![0.25, 0.5]),
            "scale" if pointer.contains("transform") => ("VEC2", vec![0.25, 0.5]),
            "scale" if pointer.contains("normalTexture") || pointer.contains("NormalTexture") => ("SCALAR", vec![0.5]),
            "baseColorFactor" | "diffuseFactor" => ("VEC4", vec![0.5, 0.25, 0.75, 1.0]),
            "specularFactor" if pointer.contains("Glossiness") => ("VEC3", vec![0.5, 0.25, 0.75]),
            "translation" | "scale" | "color" | "emissiveFactor" => ("VEC3", vec![0.5, 0.25, 0.75]),
            color if color.contains("Color") => ("VEC3", vec![0.5, 0.25, 0.75]),
            "ior" | "iridescenceIor" => ("SCALAR", vec![1.75]),
            "iridescenceThicknessMaximum" | "iridescenceThicknessMinimum" => ("SCALAR", vec![250.0]),
            _ => ("SCALAR", vec![0.375]),
        };
        let mut document = everything();
        document["materials"] = json!([material_with(&pointer)]);
        let mut value_json = match kind {
            "FLAGS" => json!(false),
            "SCALAR" if !pointer.ends_with("/weights") => json!(value[0]),
            _ => json!(value),
        };
        let written = written(document.clone(), &pointer, value_json.take());
        let keys = [value.clone(), value.clone()].concat();
        let moved = animated(document.clone(), &[1.0, 2.0], "STEP", &[Channel(&pointer, kind, &keys)]);
        let found = at(&moved, 1.5, None).unwrap_or_else(|error| panic!("{pointer}: {error}"));
        assert!(found.warnings.iter().all(|warning| !warning.contains("animat")), "{pointer}: {:?}", found.warnings);
        let found = seen(found);
        assert_eq!(found, seen(load(&written).unwrap()), "{pointer}");
        assert_ne!(found, seen(load(&document).unwrap()), "{pointer} is not read");
    }
}

/// `document` with a value at a pointer, and the objects on the way there.
fn written(mut document: Value, pointer: &str, value: Value) -> Value {
    let mut place = &mut document;
    for part in pointer.split('/').skip(1) {
        place = match place {
            Value::Array(array) => &mut array[part.parse::<usize>().unwrap()],
            object => &mut object[part],
        };
    }
    *place = value;
    document
}

#[test]
fn nodes_move_between_keys() {
    let halves = [0., 0., 0., 1., 0., 0., 1., 0.];
    let channels = [
        Channel("/nodes/0/translation", "VEC3", &[0., 0., 0., 4., 8., 0.]),
        Channel("/nodes/0/rotation", "VEC4", &halves),
    ];
    let document = animated(triangle(), &[1.0, 3.0], "LINEAR", &channels);
    // A quarter of the way: moved by (1, 2, 0), turned by 45° about z.
    let bounds = at(&document, 1.5, None).unwrap().geometry.bounds().unwrap();
    let r = 0.5_f32.sqrt();
    assert!((bounds.min - Vec3::new(1.0 - r, 2.0, 0.0)).length() < 1e-6, "{bounds:?}");
    assert!((bounds.max - Vec3::new(1.0 + r, 2.0 + r, 0.0)).length() < 1e-6, "{bounds:?}");
    let rest = load(&document).unwrap();
    assert_eq!(rest.geometry.bounds().unwrap().max, Vec3::new(1., 1., 0.));
    assert!(
        rest.warnings[0].contains("not played") && rest.warnings[0].contains("--at SECONDS"),
        "{:?}",
        rest.warnings
    );
    assert_eq!((rest.summary.at, rest.summary.animations[0].seconds), (None, Some(3.0)));
    let posed = at(&document, 9.0, None).unwrap();
    assert_eq!((posed.summary.at, posed.summary.animations[0].shown), (Some(9.0), true));
    assert_eq!(posed.warnings, [""; 0]);
    assert_eq!(
        at(&triangle(), 0.0, None).unwrap().warnings,
        ["the file has no animation: at all times it looks the same"]
    );
}

#[test]
fn emitters_and_lamps_move_with_their_nodes() {
    let mut document = everything();
    document["materials"] = json!([{ "emissiveFactor": [1.0, 1.0, 1.0] }]);
    let there = [
        Channel("/nodes/0/translation", "VEC3", &[1., 2., 3.]),
        Channel("/nodes/3/translation", "VEC3", &[4., 5., 6.]),
    ];
    let loaded = at(&animated(document, &[0.0], "LINEAR", &there), 0.0, None).unwrap();
    assert!(
        matches!(loaded.lights[0], crate::io::PunctualLight::Spot { position, .. } if position == Vec3::new(4., 5., 6.))
    );
    assert!(loaded.is_lit() && loaded.geometry.bounds().unwrap().max.z == 3.0);
}

/// Animations that move different things are shown together, others one at a time.
#[test]
fn animations_of_different_things_are_one() {
    let up = |node: u32, y: f32| (format!("/nodes/{node}/translation"), [0.0, y, 0.0]);
    let document = |second: u32| {
        let mut document = everything();
        for (pointer, value) in [up(0, 10.0), up(second, 20.0)] {
            document = animated(document, &[0.0], "STEP", &[Channel(&pointer, "VEC3", &value)]);
        }
        document["animations"][1]["name"] = json!("jump");
        document
    };
    let top = |document: &Value, name| at(document, 0.0, name).unwrap().geometry.bounds().unwrap().max.y.round();
    assert_eq!(top(&document(4), None), 21.0);
    assert_eq!(at(&document(4), 0.0, None).unwrap().warnings, [""; 0]);
    assert_eq!((top(&document(4), Some("0")), top(&document(4), Some("jump"))), (11.0, 21.0));
    let same = document(0);
    let loaded = at(&same, 0.0, None).unwrap();
    assert!(
        loaded.warnings[0].ends_with("(--animation NAME shows another); the file has 0, 1 “jump”"),
        "{:?}",
        loaded.warnings
    );
    assert_eq!(loaded.summary.animations.iter().map(|a| a.shown).collect::<Vec<_>>(), [true, false]);
    assert_eq!((top(&same, None), top(&same, Some("jump"))), (11.0, 21.0));
    let error = at(&same, 0.0, Some("2")).map(|_| ()).unwrap_err().to_string();
    assert_eq!(error, "x.gltf: there is no animation “2”: the file has 0, 1 “jump”");
    assert!(at(&triangle(), 0.0, Some("0")).is_err());
}

/// One weight is a part of all weights, and what is not read is moved by nobody.
#[test]
fn animations_overlap_in_what_is_read_alone() {
    let shown = |second: &str| {
        let mut document = animated(everything(), &[0.0], "STEP", &[Channel("/nodes/0/weights", "SCALAR", &[0.5])]);
        let unread = || Channel("/cameras/0/perspective/znear", "SCALAR", &[1.]);
        for pointer in ["/cameras/0/perspective/znear", second] {
            document = animated(document, &[0.0], "STEP", &[Channel(pointer, "SCALAR", &[1.]), unread()]);
        }
        let loaded = at(&document, 0.0, None).unwrap();
        loaded.summary.animations.iter().map(|animation| animation.shown).collect::<Vec<_>>()
    };
    assert_eq!(shown("/nodes/0/weights/0"), [true, false, false]);
    assert_eq!(shown("/cameras/0/perspective/yfov"), [true; 3]);
    // An index has one form (RFC 6901): others point to nothing that is read.
    let odd = animated(everything(), &[0.0], "STEP", &[Channel("/materials/+0/alphaCutoff", "SCALAR", &[1.])]);
    let loaded = at(&odd, 0.0, None).unwrap();
    assert!(loaded.warnings[0].contains("“/materials/+0/alphaCutoff” is left out"), "{:?}", loaded.warnings);
}

#[test]
fn no_sphere_comes_into_being() {
    let radius = Channel("/nodes/1/extensions/PATHSPACE_sphere/radius", "SCALAR", &[1.]);
    let error = at(&animated(everything(), &[0.0], "STEP", &[radius]), 0.0, None).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("which the file does not have"), "{error}");
}

#[test]
fn what_is_not_read_is_left_out_with_a_warning() {
    let channels = [
        Channel("/cameras/0/perspective/znear", "SCALAR", &[1.]),
        Channel("/accessors/0/count", "SCALAR", &[9e9]),
        Channel("/nodes/0/children", "SCALAR", &[0.]),
        Channel("/nodes/0/translation", "VEC3", &[0., 0., 5.]),
    ];
    let loaded = at(&animated(everything(), &[0.0], "STEP", &channels), 0.0, None).unwrap();
    let wanted = "what animates “/cameras/0/perspective/znear” (and 2 more like it) is left out";
    assert!(loaded.warnings[0].starts_with(wanted), "{:?}", loaded.warnings);
    assert_eq!(loaded.geometry.bounds().unwrap().max.z, 5.0);
}

#[test]
fn a_bad_animation_is_a_sentence() {
    let fine = animated(everything(), &[0.0, 1.0], "LINEAR", &[Channel("/nodes/0/translation", "VEC3", &[0.0; 6])]);
    let (input, output) = (3, 4);
    let sentence = |document: &Value| at(document, 0.5, None).map(|_| ()).unwrap_err().to_string();
    let times =
        |times: &[f32]| animated(everything(), times, "LINEAR", &[Channel("/nodes/0/scale", "VEC3", &[0.0; 6])]);
    let one = |pointer: &str, kind: &str, values: &[f32]| {
        animated(everything(), &[0.0, 1.0], "LINEAR", &[Channel(pointer, kind, values)])
    };
    let mut matrix = fine.clone();
    let identity = DMat4::IDENTITY.to_cols_array();
    matrix["nodes"][0] = json!({ "mesh": 0, "matrix": identity });
    let cases = [
        (times(&[0.0, f32::NAN]), "/accessors/3: the time in element 1 is not finite: NaN"),
        (times(&[1.0, 0.5]), "/accessors/3: the times of an animation decrease from 1 to 0.5 in element 1"),
        (times(&[]), "/accessors/3: an animation has no keys here"),
        (times(&[0.0, 1.0, 2.0]), "/accessors/4: an animation has 2 values for 3 keys, not one each"),
        (
            changed(fine.clone(), &format!("/accessors/{input}/type"), json!("VEC2")),
            "the times of an animation are scalars",
        ),
        (
            changed(fine.clone(), &format!("/accessors/{input}/componentType"), json!(5125)),
            "the times of an animation are fl",
        ),
        (changed(fine.clone(), &format!("/accessors/{output}/type"), json!("SCALAR")), "makes of this has type VEC3"),
        (
            changed(fine.clone(), &format!("/accessors/{output}/componentType"), json!(5125)),
            "the values of an animation are",
        ),
        (changed(fine.clone(), "/animations/0/samplers/0/input", json!(99)), "points to nothing"),
        (
            changed(fine.clone(), "/animations/0/samplers/0/interpolation", json!("CUBICSPLINE")),
            "2 values for 2 keys, not three",
        ),
        (changed(fine.clone(), "/animations/0/channels/0/sampler", json!(1)), "points to no"),
        (changed(fine.clone(), "/animations/0/channels/0/target/node", json!(77)), "points to no"),
        (
            one("/nodes/0/translation", "VEC3", &[0., 0., 0., 0., f32::INFINITY, 0.]),
            "the value in element 1 of an animation",
        ),
        (one("/nodes/0/rotation", "VEC4", &[0.0; 8]), "no unit quaternion"),
        (one("/nodes/0/weights", "SCALAR", &[0.0; 3]), "3 values for 2 keys, not one each for each morph target"),
        (one("/nodes/0/weights", "SCALAR", &[0.0; 4]), "1 morph targets here, and 2 weights"),
        (one("/nodes/77/extensions/KHR_node_visibility/visible", "FLAGS", &[0.0; 2]), "true and false have steps only"),
        (
            one("/materials/3/alphaCutoff", "SCALAR", &[0.0; 2]),
            "“/materials/3/alphaCutoff”, which the file does not have",
        ),
        (one("/materials/0/normalTexture/scale", "SCALAR", &[0.0; 2]), "which the file does not have"),
        (one("/cameras/1/perspective/yfov", "SCALAR", &[1.0; 2]), "which the file does not have"),
        (one("/cameras/0/perspective/yfov", "SCALAR", &[-1.0; 2]), "/cameras/0/perspective/yfov"),
        (matrix, "the node has a matrix, which must not be animated"),
    ];
    for (document, wanted) in cases {
        let error = sentence(&document);
        assert!(error.contains(wanted) && !error.contains('\n'), "{error} does not say {wanted}");
    }
}

#[test]
fn a_channel_that_points_nowhere_is_a_sentence() {
    let channel = Channel("/materials/0/alphaCutoff", "SCALAR", &[0.0; 2]);
    let fine = animated(everything(), &[0.0, 1.0], "LINEAR", &[channel]);
    let nothing = changed(fine, "/animations/0/channels/0/target/extensions", json!({}));
    let error = at(&nothing, 0.5, None).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("there is no pointer to what the channel animates"), "{error}");
}
