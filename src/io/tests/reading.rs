//! What is read.

use super::*;
use crate::math::Rgb;
use crate::{
    io::{NamedCamera, PunctualLight, ThinLens, View},
    scene::{
        bsdf::Bsdf,
        camera::Blades,
        material::{AlphaMode, EmissionSides},
    },
};

#[test]
fn a_triangle_is_read_with_its_winding_and_normals() {
    let w = world(&triangle());
    assert_eq!(w.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(w.normals.as_deref(), Some([Vec3::Z; 3].as_slice()));
    assert_eq!(facing(&w), Vec3::Z);
    let loaded = load(&triangle()).unwrap();
    assert_eq!((loaded.geometry.triangle_count(), loaded.materials.len(), loaded.hash.len()), (1, 1, 64));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    assert!(matches!(loaded.materials[0].bsdf, Bsdf::MetallicRoughness(m) if m.metallic == 1.0 && m.alpha == 1.0));
}

#[test]
fn a_mirrored_node_keeps_the_front_on_its_side() {
    // Mirroring in x leaves the side that faces +z facing +z; in z, the front goes over to −z.
    for (scale, front) in [([-2., 1., 1.], Vec3::Z), ([1., 1., -3.], Vec3::NEG_Z), ([-1., -1., -1.], Vec3::NEG_Z)] {
        let w = world(&with("/nodes/0/scale", json!(scale)));
        assert_eq!(facing(&w), front, "{scale:?}");
        assert!((w.normals.unwrap()[0] - front).length() < 1e-6, "N_s goes with N_g under {scale:?}");
    }
}

#[test]
fn normals_go_with_the_inverse_transpose() {
    let part = part::Part {
        positions: vec![Vec3::X, Vec3::Y, Vec3::Z],
        normals: Some(vec![Vec3::ONE.normalize(); 3]),
        triangles: vec![[0, 1, 2]],
        attributes: Default::default(),
        influences: Default::default(),
        material: 0,
    };
    let matrices = [
        DMat4::from_scale(DVec3::new(1., 4., 0.5)),
        DMat4::from_scale(DVec3::new(-1., 4., 0.5)) * DMat4::from_rotation_x(0.7),
        DMat4::from_cols_array(&[1., 0., 0., 0., 0.9, 1., 0., 0., 0., -0.3, -2., 0., 5., 6., 7., 1.]),
    ];
    for matrix in matrices {
        let w = part::place(&part, &placed(matrix)).unwrap();
        assert!((w.normals.as_ref().unwrap()[0] - facing(&w)).length() < 1e-5, "{matrix}");
    }
}

#[test]
fn transforms_nest() {
    let mut document = triangle();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    document["nodes"] = json!([
        { "children": [1], "translation": [10., 0., 0.], "rotation": [0., 0., half, half] },
        { "children": [2], "matrix": [2., 0., 0., 0., 0., 2., 0., 0., 0., 0., 2., 0., 1., 0., 0., 1.] },
        { "mesh": 0 },
    ]);
    let w = world(&document);
    // A quarter turn about z after scaling by 2 and moving by 1 along x.
    for (have, want) in w.positions.iter().zip([Vec3::new(10., 1., 0.), Vec3::new(10., 3., 0.), Vec3::new(8., 1., 0.)])
    {
        assert!((*have - want).length() < 1e-6, "{have} {want}");
    }
}

#[test]
fn indices_have_three_types_and_vertices_may_be_strided() {
    let stride = 20;
    let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.0_f32]];
    for (component, size) in [(5121, 1), (5123, 2), (5125, 4)] {
        let mut bytes = vec![0_u8; 4];
        for p in positions {
            bytes.extend(p.iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0xff; 8]);
        }
        let first = bytes.len();
        for index in [2_u32, 1, 3] {
            bytes.extend(&index.to_le_bytes()[..size]);
        }
        let mut document = document(&bytes);
        document["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 }, "indices": 1 });
        document["accessors"] = json!([
            { "bufferView": 0, "byteOffset": 4, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": component, "count": 3, "type": "SCALAR" }]);
        document["bufferViews"] = json!([
            { "buffer": 0, "byteLength": 4 + 3 * stride + 12, "byteStride": stride },
            { "buffer": 0, "byteOffset": first, "byteLength": 3 * size }]);
        let w = world(&document);
        assert_eq!(w.triangles, [[2, 1, 3]]);
        assert_eq!(w.positions, positions.map(Vec3::from));
        assert!(w.normals.is_none());
    }
}

#[test]
fn strips_fans_and_lists_without_indices() {
    let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.0_f32]];
    let bytes: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let cases = [
        (5, vec![[0, 1, 2], [1, 3, 2]]),
        (6, vec![[1, 2, 0], [2, 3, 0]]),
        (4, vec![[0, 1, 2]]),
        (1, vec![]),
        (0, vec![]),
    ];
    for (mode, triangles) in cases {
        let mut document = document(&bytes);
        document["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 }, "mode": mode });
        document["accessors"] = json!([{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }]);
        document["bufferViews"] = json!([{ "buffer": 0, "byteLength": 48 }]);
        assert_eq!(load(&document).unwrap().geometry.triangle_count(), triangles.len() as u64, "mode {mode}");
        if !triangles.is_empty() {
            assert_eq!(world(&document).triangles, triangles, "mode {mode}");
        }
        assert_eq!(load(&document).unwrap().warnings.len(), usize::from(!matches!(mode, 5 | 6)), "mode {mode}");
    }
}

#[test]
fn sparse_and_quantized_accessors() {
    let mut bytes = vec![1_u8, 0, 0, 0]; // The sparse index, padded.
    bytes.extend([3.0_f32, 4., 5.].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([0x81, 0x7f, 0x80, 0, 0, 0, 0, 0]); // −127, 127, −128 as normalized bytes.
    let mut document = document(&bytes);
    document["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 } });
    document["bufferViews"] = json!([
        { "buffer": 0, "byteLength": 4 },
        { "buffer": 0, "byteOffset": 4, "byteLength": 12 },
        { "buffer": 0, "byteOffset": 16, "byteLength": 8, "byteStride": 4 }]);
    let sparse =
        json!({ "count": 1, "indices": { "bufferView": 0, "componentType": 5121 }, "values": { "bufferView": 1 } });
    document["accessors"] = json!([{ "componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse }]);
    assert_eq!(world(&document).positions, [Vec3::ZERO, Vec3::new(3., 4., 5.), Vec3::ZERO]);
    document["accessors"] =
        json!([{ "bufferView": 2, "componentType": 5120, "normalized": true, "count": 2, "type": "VEC3" }]);
    assert_eq!(world(&document).positions[0], Vec3::new(-1., 1., -1.));
}

#[test]
fn an_empty_file_of_any_kind_is_a_scene() {
    for document in [
        json!({ "asset": { "version": "2.0" } }),
        json!({ "asset": { "version": "2.0" }, "scenes": [{ "name": "empty" }] }),
        json!({ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [] }] }),
    ] {
        assert_eq!(load(&document).unwrap().geometry.triangle_count(), 0);
    }
    let binary =
        crate::io::read(&glb(r#"{"asset":{"version":"2.0"}}"#, None), Path::new("."), "x.glb", &LoadOptions::default())
            .unwrap();
    assert!(binary.summary.binary);
}

#[test]
fn the_hash_is_that_of_the_bytes() {
    let hash = |document: &Value| load(document).unwrap().hash;
    assert_eq!(hash(&triangle()), hash(&triangle()));
    assert_ne!(hash(&triangle()), hash(&with("/nodes/0/name", json!("other"))));
}

#[test]
fn materials_become_bsdfs() {
    let mut document = triangle();
    let lambert = json!({ "specularFactor": 0.0 });
    document["materials"] = json!([
        { "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorFactor": [0.5, 0.25, 0, 1] },
          "extensions": { "KHR_materials_specular": lambert } },
        { "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.5 },
          "extensions": { "KHR_materials_ior": { "ior": 2.0 },
            "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [1, 2, 20] } } },
        { "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0 }, "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_volume": {
            "thicknessFactor": 1, "attenuationColor": [1, 0.5, 0], "attenuationDistance": 2 } } },
        { "pbrMetallicRoughness": { "metallicFactor": 0 }, "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 0.5 }, "KHR_materials_volume": {} } },
        { "emissiveFactor": [1, 0.5, 0], "doubleSided": true, "pbrMetallicRoughness": { "metallicFactor": 0 },
          "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8 } } },
        { "pbrMetallicRoughness": { "metallicFactor": 1 },
          "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 } } },
    ]);
    let loaded = load(&document).unwrap();
    let m = &loaded.materials;
    assert!(matches!(m[0].bsdf, Bsdf::Diffuse(d) if d.albedo == Rgb::new(0.5, 0.25, 0.0)));
    let Bsdf::MetallicRoughness(rough) = m[1].bsdf else { panic!("{:?}", m[1]) };
    assert!((rough.dielectric_f0 - Rgb::new(0.5 / 9.0, 1.0 / 9.0, 0.5)).abs().element_sum() < 1e-6, "{rough:?}");
    assert_eq!((rough.alpha, rough.dielectric_f90), (0.25, 0.5));
    assert!(matches!(m[2].bsdf, Bsdf::Dielectric(d) if d.ior == 1.5 && d.transmission == 1.0));
    let expected = Rgb::new(0.0, 2.0_f32.ln() / 2.0, 1e6_f32.ln() / 2.0);
    assert!((m[2].absorption - expected).abs().element_sum() < 1e-5, "{}", m[2].absorption);
    assert!(matches!(m[3].bsdf, Bsdf::Thin(t) if t.transmission == 0.5), "no thickness: no volume");
    assert_eq!((m[4].emission, m[4].emission_sides), (Rgb::new(8.0, 4.0, 0.0), EmissionSides::Both));
    assert!(matches!(m[5].bsdf, Bsdf::MetallicRoughness(_)), "a metal does not transmit");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn volumes_disperse() {
    let glass = |thickness: f32, dispersion: Value| {
        json!({ "pbrMetallicRoughness": { "metallicFactor": 0 }, "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": { "thicknessFactor": thickness },
            "KHR_materials_dispersion": dispersion } })
    };
    let read = |material: Value| load(&with("/materials", json!([material])));
    let loaded = read(glass(1.0, json!({ "dispersion": 0.36 }))).unwrap();
    assert_eq!((loaded.materials[0].dispersion, &loaded.warnings[..]), (0.36, &[][..]));
    let loaded = read(glass(1.0, json!({}))).unwrap();
    assert_eq!((loaded.materials[0].dispersion, &loaded.warnings[..]), (0.0, &[][..]));
    let thin = read(glass(0.0, json!({ "dispersion": 0.36 }))).unwrap();
    assert_eq!(thin.materials[0].dispersion, 0.0);
    let warning = "material “material 0” bounds no volume: KHR_materials_dispersion is not applied to it";
    assert_eq!(thin.warnings, [warning]);
    let negative = read(glass(1.0, json!({ "dispersion": -1 }))).unwrap();
    assert_eq!(negative.materials[0].dispersion, 0.0);
    assert!(negative.warnings[0].ends_with("dispersion -1 is taken as 0"), "{:?}", negative.warnings);
    assert!(read(glass(1.0, json!({ "dispersion": "much" }))).is_err());
}

#[test]
fn the_wanted_scene_is_shown() {
    let mut document = with("/scenes", json!([{ "name": "full", "nodes": [0] }, { "name": "0" }, {}]));
    document["scene"] = json!(0);
    let options = |scene| LoadOptions { scene, ..LoadOptions::default() };
    let read = |wanted| {
        let text = document.to_string();
        crate::io::read(text.as_bytes(), Path::new("."), "x.gltf", &options(wanted))
    };
    for (wanted, shown, triangles) in
        [(None, 0, 1), (Some("full"), 0, 1), (Some("1"), 1, 0), (Some("2"), 2, 0), (Some("0"), 1, 0)]
    {
        let loaded = read(wanted).unwrap();
        assert_eq!((loaded.summary.scene, loaded.geometry.triangle_count()), (Some(shown), triangles), "{wanted:?}");
        assert_eq!(loaded.warnings.len(), usize::from(wanted.is_none()), "{:?}", loaded.warnings);
    }
    for wanted in ["3", "-1", "Full", ""] {
        let error = read(Some(wanted)).unwrap_err().to_string();
        assert!(error.ends_with(&format!("there is no scene “{wanted}”: the file has 0 “full”, 1 “0”, 2")), "{error}");
    }
    let none = json!({ "asset": { "version": "2.0" } }).to_string();
    let error =
        crate::io::read(none.as_bytes(), Path::new("."), "x.gltf", &options(Some("0"))).unwrap_err().to_string();
    assert!(error.ends_with("the file has none"), "{error}");
}

#[test]
fn alpha_modes_are_read() {
    let mut document = triangle();
    let pbr = json!({ "baseColorFactor": [1, 1, 1, 0.25] });
    document["materials"] = json!([
        { "pbrMetallicRoughness": pbr },
        { "pbrMetallicRoughness": pbr, "alphaMode": "BLEND" },
        { "pbrMetallicRoughness": pbr, "alphaMode": "MASK" },
        { "pbrMetallicRoughness": pbr, "alphaMode": "MASK", "alphaCutoff": 0.25 },
        { "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 1.5] }, "alphaMode": "BLEND" },
        { "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 1.5] } },
    ]);
    let loaded = load(&document).unwrap();
    let modes: Vec<_> = loaded.materials[..6].iter().map(|m| m.alpha_mode).collect();
    assert_eq!(
        modes,
        [
            AlphaMode::Opaque,
            AlphaMode::Blend { factor: 0.25 },
            AlphaMode::Mask { factor: 0.25, cutoff: 0.5 },
            AlphaMode::Opaque,
            AlphaMode::Opaque,
            AlphaMode::Opaque,
        ]
    );
    assert_eq!(modes.iter().map(|c| c.alpha(1.0)).collect::<Vec<_>>(), [1.0, 0.25, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(loaded.warnings.len(), 1, "{:?}", loaded.warnings);
    document["materials"][1]["alphaMode"] = json!("GLASS");
    assert!(load(&document).unwrap_err().to_string().contains("/materials/1/alphaMode"));
}

#[test]
fn lights_and_cameras_stand_in_world_space() {
    let mut document = triangle();
    document["nodes"] = json!([
        { "children": [1, 2], "translation": [0, 5, 0], "rotation": [1, 0, 0, 0], "scale": [3, 3, 3] },
        { "camera": 0, "translation": [1, 0, 0] },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } } }]);
    document["cameras"] =
        json!([{ "type": "perspective", "name": "eye", "perspective": { "yfov": 1.0, "znear": 0.1 } }]);
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 10, "color": [1, 0.5, 0], "spot": {} }] } });
    let loaded = load(&document).unwrap();
    // Half a turn about x takes −z to +z and y to −y.
    let eye = NamedCamera {
        name: "eye".to_owned(),
        position: Vec3::new(3., 5., 0.),
        forward: Vec3::Z,
        up: Vec3::NEG_Y,
        view: View::Perspective { yfov: 1.0, lens: None },
        aspect: None,
    };
    assert_eq!(loaded.cameras, [eye]);
    let spot = PunctualLight::Spot {
        position: Vec3::new(0., 5., 0.),
        direction: Vec3::Z,
        intensity: Rgb::new(10., 5., 0.),
        inner: 0.0,
        outer: std::f32::consts::FRAC_PI_4,
    };
    assert_eq!(loaded.lights, [spot]);
}

#[test]
fn lenses_and_orthographic_films_are_in_metres_of_the_world() {
    let seen = |camera: Value| {
        let document = changed(with("/nodes/0/camera", json!(0)), "/nodes/0/scale", json!([3, 3, 3]));
        let loaded = load(&changed(document, "/cameras", json!([camera]))).unwrap();
        (loaded.cameras[0].view, loaded.cameras[0].aspect, loaded.warnings)
    };
    let through = |lens: Value| {
        let extensions = json!({ "PATHSPACE_thin_lens": lens });
        seen(json!({ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 }, "extensions": extensions }))
    };
    let lens = ThinLens { aperture: 0.05, focus: 2.0, blades: None };
    let perspective = |lens| (View::Perspective { yfov: 1.0, lens: Some(lens) }, None, vec![]);
    assert_eq!(through(json!({ "aperture": 0.05, "focusDistance": 2 })), perspective(lens));
    let bladed = |count, rotation| ThinLens { blades: Blades::new(count, rotation), ..lens };
    let six = json!({ "aperture": 0.05, "focusDistance": 2, "blades": 6 });
    assert_eq!(through(six), perspective(bladed(6, 0.0)));
    let turned = json!({ "aperture": 0.05, "focusDistance": 2, "blades": 5, "rotation": 0.5 });
    assert_eq!(through(turned), perspective(bladed(5, 0.5)));
    let film = |x: f64, y: f64| {
        let orthographic = json!({ "xmag": x, "ymag": y, "znear": 0, "zfar": 9 });
        json!({ "type": "orthographic", "orthographic": orthographic })
    };
    assert_eq!(seen(film(3.0, 2.0)), (View::Orthographic { height: 4.0 }, Some(1.5), vec![]));
    let (view, aspect, warnings) = seen(film(-3.0, 2.0));
    assert_eq!((view, aspect), (View::Orthographic { height: 4.0 }, Some(1.5)));
    assert!(warnings.len() == 1 && warnings[0].contains("negative"), "{warnings:?}");
}

#[test]
fn emission_that_lamps_outshine_is_said_to_be() {
    let document = |emission: [f32; 3], light: Value| {
        let mut document = triangle();
        document["materials"] = json!([{ "emissiveFactor": emission }]);
        document["meshes"][0]["primitives"][0]["material"] = json!(0);
        document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
        document["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
        load(&document).unwrap().warnings
    };
    let said = document([1.0, 1.0, 1.0], json!({ "type": "directional", "intensity": 1000 }));
    assert_eq!(said.len(), 1, "{said:?}");
    for part in ["/materials/0", "1.000 nit", "318 nit", "KHR_materials_emissive_strength"] {
        assert!(said[0].contains(part), "{part}: {said:?}");
    }
    // The triangle's bounds have a diagonal of √2: the radius squared is ½.
    assert_eq!(document([1.0; 3], json!({ "type": "point", "intensity": 160 })).len(), 1);
    assert_eq!(document([1.0; 3], json!({ "type": "point", "intensity": 150 })).len(), 0);
    assert_eq!(document([1.0; 3], json!({ "type": "directional", "intensity": 3 })).len(), 0);
    assert_eq!(document([0.0; 3], json!({ "type": "directional", "intensity": 1000 })).len(), 0);
}

#[test]
fn outshone_emission_is_that_of_a_material_which_is_seen_and_lit() {
    let sun = json!({ "lights": [{ "type": "directional", "intensity": 1000 }] });
    let mut document = changed(triangle(), "/extensions", json!({ "KHR_lights_punctual": sun }));
    document["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    document["materials"] =
        json!([{ "name": "sign", "emissiveFactor": [0.5, 0.5, 0.5] }, { "emissiveFactor": [1, 1, 1] }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    // Colours make a variant of the material, whose name in the file is still the same.
    let red = changed(document.clone(), "/meshes/0/primitives/0/attributes/COLOR_0", json!(0));
    for document in [document.clone(), red] {
        let said = load(&document).unwrap().warnings;
        assert!(said.len() == 1 && said[0].starts_with("/materials/0 (“sign”): "), "{said:?}");
    }
    document["materials"][0] = json!({ "extensions": { "KHR_materials_unlit": {} } });
    assert!(load(&document).unwrap().warnings.is_empty());
}

#[test]
fn a_spot_as_wide_as_a_right_angle_rounds_to_is_one() {
    let cone = json!({ "innerConeAngle": 1.570_797, "outerConeAngle": 1.570_797 });
    let mut document = with("/nodes/0/extensions", json!({ "KHR_lights_punctual": { "light": 0 } }));
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": cone }] } });
    load(&document).unwrap().lights[0].to_light();
}

#[test]
fn a_scene_is_lit_by_lamps_or_by_surfaces_that_emit() {
    assert!(!load(&triangle()).unwrap().is_lit());
    let mut document = with("/materials", json!([{ "emissiveFactor": [0, 0.1, 0] }]));
    assert!(!load(&document).unwrap().is_lit(), "nothing uses the material");
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    assert!(load(&document).unwrap().is_lit());
    let mut document = with("/nodes/0/extensions", json!({ "KHR_lights_punctual": { "light": 0 } }));
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    assert!(load(&document).unwrap().is_lit());
}

#[test]
fn spheres_scale_with_their_node() {
    let sphere = json!({ "PATHSPACE_sphere": { "radius": 0.5 } });
    let mut document = changed(with("/nodes/0/extensions", sphere), "/nodes/0/scale", json!([-2, -2, -2]));
    assert_eq!(load(&document).unwrap().geometry.sphere_count(), 1);
    assert_eq!(placed(DMat4::from_scale(DVec3::splat(-2.0))).uniform_scale(), Some(2.0));
    assert_eq!(placed(DMat4::from_scale(DVec3::new(2., 2., 2.01))).uniform_scale(), None);
    document["nodes"][0]["scale"] = json!([1, 2, 1]);
    assert!(load(&document).unwrap_err().to_string().contains("uniform scale"));
}

#[test]
fn normals_without_direction_come_from_the_triangles() {
    let mut bytes: Vec<u8> = [0., 0., 0., 1., 0., 0., 0., 1., 0.0_f32].iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([f32::NAN; 3].iter().chain(&[0.0; 3]).chain(&[1., 0., 0.]).flat_map(|x| x.to_le_bytes()));
    bytes.extend([0, 1, 2, 0]);
    assert_eq!(world(&document(&bytes)).normals.unwrap(), [Vec3::Z, Vec3::Z, Vec3::X]);
    assert!(load(&document(&bytes)).unwrap().warnings[0].contains("2 normals"));
}
