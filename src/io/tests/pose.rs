//! Morph targets and skins.

use super::*;

/// [`triangle`] with more bytes behind its 76, and what they mean.
fn with_bytes(more: &[u8], accessors: &[Value]) -> Value {
    let positions: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., 0.];
    let normals: [f32; 9] = [0., 0., 1., 0., 0., 1., 0., 0., 1.];
    let mut bytes: Vec<u8> = positions.iter().chain(&normals).flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0, 1, 2, 0]);
    bytes.extend(more);
    let mut document = document(&bytes);
    let view = json!({ "buffer": 0, "byteOffset": 76, "byteLength": more.len() });
    document["bufferViews"].as_array_mut().unwrap().push(view);
    document["accessors"].as_array_mut().unwrap().extend(accessors.iter().cloned());
    document
}

fn accessor(offset: usize, component: u32, count: u32, kind: &str) -> Value {
    let normalized = component != 5126 && offset == 1000;
    json!({ "bufferView": 3, "byteOffset": offset, "componentType": component, "count": count, "type": kind,
        "normalized": normalized })
}

fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// The box around the loaded triangles, and N_g and N_s in the middle of the first.
fn shape(document: &Value) -> (Vec3, Vec3, Vec3, Vec3) {
    let mut g = load(document).unwrap().geometry;
    let b = g.bounds().unwrap();
    g.build();
    let s = g.sample(crate::scene::geometry::PrimitiveId::world(0), glam::Vec2::splat(0.3));
    (b.min, b.max, s.normal, s.shading_normal)
}

#[test]
fn morph_targets_move_positions_and_normals_by_their_weights() {
    // Target 0 lifts all by 1; target 1 moves corner 1 along z by 4 and tilts the normals.
    let lift = [0., 0., 1., 0., 0., 1., 0., 0., 1.];
    let far = [0., 0., 0., 0., 0., 4., 0., 0., 0.];
    let tilt = [-1., 0., 0., -1., 0., 0., -1., 0., 0.];
    let more = bytes(&[lift, far, tilt].concat());
    let mut document = with_bytes(
        &more,
        &[accessor(0, 5126, 3, "VEC3"), accessor(36, 5126, 3, "VEC3"), accessor(72, 5126, 3, "VEC3")],
    );
    document["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 3 }, { "POSITION": 4, "NORMAL": 5 }]);
    assert_eq!(shape(&document).1, Vec3::new(1., 1., 0.), "without weights, the base");
    document["meshes"][0]["weights"] = json!([0.5, 0.25]);
    let (min, max, normal, shading) = shape(&document);
    assert_eq!((min, max), (Vec3::new(0., 0., 0.5), Vec3::new(1., 1., 1.5)));
    assert!((normal - Vec3::new(-1., 0., 1.).normalize()).length() < 1e-6);
    assert!((shading - Vec3::new(-0.25, 0., 1.).normalize()).length() < 1e-6);
    // The node's weights stand in for the mesh's.
    document["nodes"][0]["weights"] = json!([2.0, 0.0]);
    assert_eq!(shape(&document).1, Vec3::new(1., 1., 2.));
    document["nodes"][0]["weights"] = json!([2.0]);
    assert!(load(&document).unwrap_err().to_string().contains("2 morph targets here, and 1 weights"));
    document["nodes"][0]["weights"] = json!([1.0, 1.0]);
    document["accessors"][4]["count"] = json!(2);
    assert!(load(&document).unwrap_err().to_string().contains("2 displacements for 3 vertices"));
}

/// The triangle on two joints: node 1, moved by (0, 0, 5), and node 2 below it, a half turn about y there. The skinned
/// node is moved too, which must not matter.
fn skinned(joints: &[u8], joints_as: Value, weights: &[u8], weights_as: Value) -> Value {
    let mut identity = [0.0_f32; 16];
    (0..4).for_each(|i| identity[5 * i] = 1.0);
    // The second joint was bound at x = 1.
    let mut second = identity;
    second[12] = -1.0;
    let mut more = bytes(&[identity, second].concat());
    let (at_joints, at_weights) = (more.len(), more.len() + joints.len());
    more.extend(joints);
    more.extend(weights);
    let mut document = with_bytes(&more, &[accessor(0, 5126, 2, "MAT4"), joints_as, weights_as]);
    document["accessors"][4]["byteOffset"] = json!(at_joints);
    document["accessors"][5]["byteOffset"] = json!(at_weights);
    document["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(4);
    document["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(5);
    document["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100., 0., 0.] },
        { "translation": [0., 0., 5.], "children": [2] },
        { "translation": [1., 0., 0.], "rotation": [0., 1., 0., 0.] },
    ]);
    document["scenes"][0]["nodes"] = json!([0, 1]);
    document["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": 3 }]);
    document
}

#[test]
fn skins_stand_where_their_joints_are() {
    // Corner 0 belongs to joint 0, corner 1 to joint 1, corner 2 half to each, by weights that do not sum to 1.
    let joints = [0_u8, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0];
    let wide: Vec<u8> = joints.iter().flat_map(|&j| u16::from(j).to_le_bytes()).collect();
    let weights = bytes(&[1., 0., 0., 0., 1., 0., 0., 0., 0.25, 0.25, 0., 0.]);
    let small = [255_u8, 0, 0, 0, 255, 0, 0, 0, 64, 64, 0, 0];
    let normalized = json!({ "bufferView": 3, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4" });
    let cases = [
        skinned(&joints, accessor(0, 5121, 3, "VEC4"), &weights, accessor(0, 5126, 3, "VEC4")),
        skinned(&wide, accessor(0, 5123, 3, "VEC4"), &weights, accessor(0, 5126, 3, "VEC4")),
        skinned(&joints, accessor(0, 5121, 3, "VEC4"), &small, normalized),
    ];
    for document in &cases {
        let loaded = load(document).unwrap();
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        // (0, 0, 0) → (0, 0, 5). (1, 0, 0) is the second joint's origin → (1, 0, 5). (0, 1, 0) → the mean of (0, 1, 5)
        // and, half a turn about the second joint, (2, 1, 5).
        let b = loaded.geometry.bounds().unwrap();
        assert!((b.min - Vec3::new(0., 0., 5.)).length() < 1e-5, "{b:?}");
        assert!((b.max - Vec3::new(1., 1., 5.)).length() < 1e-5, "{b:?}");
    }
    let mut document = cases[0].clone();
    document["nodes"][1]["scale"] = json!([1., 1., -1.]);
    assert_eq!(shape(&document).2, Vec3::NEG_Z, "joints that mirror leave the front on its side");
}

/// Joints far away, in which each corner is a weighted mean of places that f32 cannot hold.
#[test]
fn a_skin_far_from_the_origin_keeps_its_shape() {
    let joints = [0_u8, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0];
    let weights = bytes(&[1., 0., 0., 0., 1., 0., 0., 0., 0.75, 0.25, 0., 0.]);
    let near = skinned(&joints, accessor(0, 5121, 3, "VEC4"), &weights, accessor(0, 5126, 3, "VEC4"));
    let wanted = load(&near).unwrap().geometry.bounds().unwrap();
    for offset in
        [DVec3::new(1e5 + 0.3, -1e5, 0.0), DVec3::new(-3_761_603.743_620_786, 4_105_279.007_277_16, 3_870_314.849)]
    {
        let joint = (offset + DVec3::new(0.0, 0.0, 5.0)).to_array();
        let far = load(&changed(near.clone(), "/nodes/1/translation", json!(joint))).unwrap();
        assert!((far.centre - offset).length() < 20.0 && far.warnings.is_empty(), "{} {:?}", far.centre, far.warnings);
        let found = far.geometry.bounds().unwrap();
        for (found, wanted) in [(found.min, wanted.min), (found.max, wanted.max)] {
            let off = (far.centre + found.as_dvec3() - offset - wanted.as_dvec3()).abs().max_element();
            assert!(off < 3e-6, "{off} m at {offset}");
        }
    }
}

#[test]
fn bad_skins_are_a_sentence_and_joints_elsewhere_a_warning() {
    let (joints, weights) = ([0_u8, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0], bytes(&[1.; 12]));
    let document = skinned(&joints, accessor(0, 5121, 3, "VEC4"), &weights, accessor(0, 5126, 3, "VEC4"));
    let sentence = |document: &Value| load(document).unwrap_err().to_string();
    assert!(sentence(&document).contains("element 1 names joint 7, and the skin has 2"));
    assert!(sentence(&changed(document.clone(), "/accessors/3/count", json!(1))).contains("1 of them for 2 joints"));
    assert!(
        sentence(&changed(document.clone(), "/accessors/4/componentType", json!(5120))).contains("joints are unsigned")
    );
    assert!(
        sentence(&changed(document.clone(), "/accessors/5/count", json!(2))).contains("2 elements for 3 positions")
    );
    let elsewhere = changed(document, "/scenes/0/nodes", json!([0]));
    let loaded = load(&elsewhere).unwrap();
    assert!(loaded.warnings[0].contains("not in the scene"), "{:?}", loaded.warnings);
    assert_eq!(loaded.geometry.bounds().unwrap().min.x, 100.0);
}
