//! Textures, vertex colours and tangents from documents made by hand.

use std::{io::Cursor, sync::Arc};

use glam::{DMat4, DQuat, DVec3, Vec2, Vec3, Vec4};
use image::{DynamicImage, GrayAlphaImage, GrayImage, ImageFormat, RgbImage, RgbaImage};

use super::*;
use crate::io::{influence::Influences, part::Part, tangent};
use crate::math::Rgb;
use crate::scene::{
    geometry::{Attributes, Geometry, Mesh, Placement, PrimitiveId, STEEPEST},
    material::{Material, MaterialId, VertexColors},
    texture::{Encoding, Filter, Image, Texels, Texture, Wrap},
};

pub(super) fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

pub(super) fn uri(bytes: &[u8]) -> String {
    format!("data:image/whatever;base64,{}", STANDARD.encode(bytes))
}

/// Two texels: 255 188 10 and 0 255 51.
fn two_texels() -> DynamicImage {
    RgbImage::from_raw(2, 1, vec![255, 188, 10, 0, 255, 51]).unwrap().into()
}

/// A triangle with texture coordinates (0,0), (1,0), (0,1) in two sets, the second halved, and the one image `bytes`.
pub(super) fn textured(image: &[u8], material: &Value) -> Value {
    let floats: [f32; 30] = [
        0., 0., 0., 1., 0., 0., 0., 1., 0., // positions
        0., 0., 1., 0., 0., 1., 0., 0., 1., // normals
        0., 0., 1., 0., 0., 1., // TEXCOORD_0
        0., 0., 0.5, 0., 0., 0.5, // TEXCOORD_1
    ];
    let mut bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([255, 0, 0, 255, 255, 51, 0, 255]); // colours of two vertices; the third is the next four bytes
    bytes.extend([255, 255, 255, 0]);
    let view = |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let accessor =
        |view: usize, kind: &str| json!({ "bufferView": view, "componentType": 5126, "count": 3, "type": kind });
    json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TEXCOORD_1": 3 }, "material": 0,
        }] }],
        "materials": [material],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }],
        "images": [{ "uri": uri(image) }],
        "accessors": [
            accessor(0, "VEC3"), accessor(1, "VEC3"), accessor(2, "VEC2"), accessor(3, "VEC2"),
            { "bufferView": 4, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4" },
        ],
        "bufferViews": [view(0, 36), view(36, 36), view(72, 24), view(96, 24), view(120, 12)],
        "buffers": [{ "byteLength": bytes.len(), "uri": uri(&bytes) }],
    })
}

fn base_color() -> Value {
    json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } })
}

fn first(loaded: &Loaded) -> &Material {
    &loaded.materials[0]
}

fn base(loaded: &Loaded) -> Texture {
    first(loaded).maps.as_ref().unwrap().base_color.clone().unwrap()
}

#[test]
fn an_image_is_read_in_every_format_and_depth() {
    let two = two_texels();
    let exact = [two.to_rgb8().into(), two.to_rgba8().into(), two.to_rgb16().into(), two.to_rgba16().into()];
    let exact: [DynamicImage; 4] = exact;
    for (image, format) in exact.iter().map(|i| (i, ImageFormat::Png)).chain([(&two, ImageFormat::WebP)]) {
        let loaded = load(&textured(&encoded(image, format), &base_color())).unwrap();
        let found = base(&loaded).lookup(Vec2::new(0.2, 0.5));
        let expected = Vec4::new(1.0, 0.502_886, 0.003_035_27, 1.0);
        assert!((found - expected).abs().max_element() < 1e-5, "{format:?}: {found}");
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    }
    // JPEG loses a little.
    let flat = RgbImage::from_pixel(16, 16, image::Rgb([255, 188, 10])).into();
    let loaded = load(&textured(&encoded(&flat, ImageFormat::Jpeg), &base_color())).unwrap();
    let found = base(&loaded).lookup(Vec2::new(0.2, 0.5));
    assert!((found - Vec4::new(1.0, 0.503, 0.003, 1.0)).abs().max_element() < 0.02, "{found}");
    let grey = GrayImage::from_raw(1, 1, vec![188]).unwrap().into();
    let grey_alpha = GrayAlphaImage::from_raw(1, 1, vec![188, 51]).unwrap().into();
    for (image, alpha) in [(grey, 1.0), (grey_alpha, 0.2)] {
        let loaded = load(&textured(&encoded(&image, ImageFormat::Png), &base_color())).unwrap();
        let found = base(&loaded).lookup(Vec2::ZERO);
        assert!((found - Vec3::splat(0.502_886).extend(alpha)).abs().max_element() < 1e-5, "{found}");
    }
}

#[test]
fn samplers_transforms_and_sets_are_honoured() {
    let mut material = base_color();
    material["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(1);
    let loaded = load(&textured(&encoded(&two_texels(), ImageFormat::Png), &material)).unwrap();
    let texture = base(&loaded);
    assert_eq!((texture.wrap, texture.filter, texture.uv_set), ([Wrap::Clamp, Wrap::Mirror], Filter::Nearest, 1));
    assert_eq!(texture.encoding, Encoding::Srgb);
    let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::new(0.5, 0.25));
    assert_eq!((at.uv(1), at.uv(0)), (Vec2::new(0.25, 0.125), Vec2::ZERO), "set 0 is not read, nothing asks for it");

    material["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = json!({ "KHR_texture_transform":
        { "offset": [0.25, 0.5], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2.0, 3.0], "texCoord": 0 } });
    let texture = base(&load(&textured(&encoded(&two_texels(), ImageFormat::Png), &material)).unwrap());
    assert_eq!(texture.uv_set, 0);
    // (u, v) → (2u, 3v), turned counter-clockwise on the image whose v goes down → (3v, −2u), moved by (1/4, 1/2).
    let found = texture.transform.transform_point2(Vec2::new(0.1, 0.2));
    assert!((found - Vec2::new(0.85, 0.3)).length() < 1e-6, "{found}");
}

#[test]
fn each_slot_multiplies_its_parameter() {
    let material = json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 1.0, 1.0, 1.0], "baseColorTexture": { "index": 0 },
            "metallicFactor": 0.5, "roughnessFactor": 0.5, "metallicRoughnessTexture": { "index": 0 },
        },
        "emissiveFactor": [0.0, 1.0, 1.0], "emissiveTexture": { "index": 0 },
        "extensions": {
            "KHR_materials_emissive_strength": { "emissiveStrength": 10.0 },
            "KHR_materials_specular": {
                "specularFactor": 0.5, "specularTexture": { "index": 0 },
                "specularColorFactor": [2.0, 2.0, 2.0], "specularColorTexture": { "index": 0 },
            },
        },
    });
    let image = RgbaImage::from_raw(1, 1, vec![255, 188, 51, 204]).unwrap().into();
    let loaded = load(&textured(&encoded(&image, ImageFormat::Png), &material)).unwrap();
    let maps = first(&loaded).maps.as_ref().unwrap();
    let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::new(0.3, 0.3));
    let (p, srgb) = (maps.parameters(&at), Rgb::new(1.0, 0.502_886, 0.033_104_8));
    assert!((p.base_color - srgb * Rgb::new(0.5, 1.0, 1.0)).abs().max_element() < 1e-6, "{}", p.base_color);
    assert!((p.metallic - 0.5 * 0.2).abs() < 1e-6 && (p.roughness - 0.5 * 188.0 / 255.0).abs() < 1e-6);
    assert!((p.specular - 0.5 * 0.8).abs() < 1e-6);
    assert!((p.specular_color - 2.0 * srgb).abs().max_element() < 1e-5);
    assert!((maps.emission(&at) - srgb).abs().max_element() < 1e-6);
    assert_eq!(first(&loaded).emission, Rgb::new(0.0, 10.0, 10.0));
}

#[test]
fn vertex_colours_make_a_material_of_their_own() {
    let mut document = textured(&encoded(&two_texels(), ImageFormat::Png), &json!({}));
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(4);
    let loaded = load(&document).unwrap();
    assert!(first(&loaded).maps.is_none());
    let colored = &loaded.materials[loaded.geometry.material(PrimitiveId::world(0)).0 as usize];
    let maps = colored.maps.as_ref().unwrap();
    assert_eq!(maps.vertex_colors, VertexColors::BaseColor);
    let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::new(0.5, 0.5));
    assert!((at.color() - Vec4::new(1.0, 0.6, 0.5, 0.5)).abs().max_element() < 1e-4, "{}", at.color());
    assert!((maps.parameters(&at).base_color - Rgb::new(1.0, 0.6, 0.5)).abs().max_element() < 1e-4);
}

#[test]
fn unlit_is_an_emitter_of_its_base_colour() {
    let mut material = base_color();
    material["extensions"] = json!({ "KHR_materials_unlit": {} });
    let loaded = load(&textured(&encoded(&two_texels(), ImageFormat::Png), &material)).unwrap();
    let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::ZERO);
    let maps = first(&loaded).maps.as_ref().unwrap();
    assert_eq!((first(&loaded).emission, maps.parameters(&at).base_color), (Rgb::ONE, Rgb::ZERO));
    assert!((maps.emission(&at) - Rgb::new(1.0, 0.502_886, 0.003_035_27)).abs().max_element() < 1e-5);
}

#[test]
fn tangents_are_made_where_the_file_has_none() {
    let material = json!({ "normalTexture": { "index": 0, "scale": 0.5 } });
    let normal = RgbImage::from_raw(1, 1, vec![255, 128, 128]).unwrap().into();
    let document = textured(&encoded(&normal, ImageFormat::Png), &material);
    let frame = |document: &Value| {
        let loaded = load(document).unwrap();
        let surface = loaded.geometry.surface_at(PrimitiveId::world(0), Vec2::splat(0.3)).unwrap();
        loaded.geometry.tangent_frame(PrimitiveId::world(0), &surface).unwrap()
    };
    // u goes along x and v along y; up on the image is against v.
    let made = frame(&document);
    assert!((made.tangent - Vec3::X).length() < 1e-5 && (made.bitangent + Vec3::Y).length() < 1e-5, "{made:?}");
    // A mirrored node carries the image's axes with it, and keeps the front where it was.
    let mirrored = frame(&changed(document.clone(), "/nodes/0/scale", json!([-1.0, 1.0, 1.0])));
    assert!((mirrored.tangent + Vec3::X).length() < 1e-5, "{mirrored:?}");
    assert!((mirrored.bitangent + Vec3::Y).length() < 1e-5, "{mirrored:?}");
    assert!((mirrored.normal - Vec3::Z).length() < 1e-5, "{mirrored:?}");

    let loaded = load(&document).unwrap();
    let map = first(&loaded).maps.as_ref().unwrap().normal.clone().unwrap();
    let n = map.shading_normal(Vec2::ZERO, &made, Vec3::Z);
    // (1, 0, 0) of the texture, halved, with its zeros at 128/255: that low, it is lifted.
    let zero = 2.0 * 128.0 / 255.0 - 1.0;
    let flat = Vec3::new(0.5, -0.5 * zero, 0.0).normalize();
    let expected = (flat * (1.0 - STEEPEST * STEEPEST).sqrt()).with_z(STEEPEST);
    assert!((n - expected).length() < 1e-5, "{n} for {expected}");
}

/// The document with these tangents.
fn with_tangents(mut document: Value, tangents: [[f32; 4]; 3]) -> Value {
    let uri_of = document["buffers"][0]["uri"].as_str().unwrap().to_owned();
    let mut bytes = STANDARD.decode(uri_of.split_once(',').unwrap().1).unwrap();
    let view = json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": 48 });
    bytes.extend(tangents.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    document["buffers"][0] = json!({ "byteLength": bytes.len(), "uri": uri(&bytes) });
    document["bufferViews"].as_array_mut().unwrap().push(view);
    let accessor = json!({ "bufferView": 5, "componentType": 5126, "count": 3, "type": "VEC4" });
    document["accessors"].as_array_mut().unwrap().push(accessor);
    document["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(5);
    document
}

#[test]
fn tangents_without_a_direction_are_made_anew() {
    let material = json!({ "normalTexture": { "index": 0 } });
    let normal = RgbImage::from_raw(1, 1, vec![255, 128, 128]).unwrap().into();
    let document = textured(&encoded(&normal, ImageFormat::Png), &material);
    let tangent = |tangents: [[f32; 4]; 3]| {
        let loaded = load(&with_tangents(document.clone(), tangents)).unwrap();
        let surface = loaded.geometry.surface_at(PrimitiveId::world(0), Vec2::splat(0.3)).unwrap();
        let frame = loaded.geometry.tangent_frame(PrimitiveId::world(0), &surface).unwrap();
        (frame.tangent, loaded.warnings)
    };
    let good = [0.6, 0.8, 0.0, -1.0];
    let (own, warnings) = tangent([good; 3]);
    assert!((own - Vec3::new(0.6, 0.8, 0.0)).length() < 1e-5 && warnings.is_empty(), "{own}, {warnings:?}");
    for bad in [[f32::NAN; 4], [f32::INFINITY, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]] {
        let (made, warnings) = tangent([good, bad, bad]);
        assert!((made - Vec3::X).length() < 1e-5, "{bad:?}: {made}");
        let expected =
            "/meshes/0/primitives/0: 2 tangents have no direction: all are made anew from the texture coordinates";
        assert_eq!(warnings, [expected]);
    }
}

#[test]
fn an_instance_has_the_axes_of_its_copy() {
    let (positions, normals) =
        ([Vec3::ZERO, Vec3::X, Vec3::new(0.2, 1.0, 0.1)], [Vec3::new(0.1, 0.2, 1.0).normalize(); 3]);
    let tangents = vec![Vec4::new(0.6, 0.8, 0.0, -1.0), Vec4::new(0.8, 0.6, 0.0, -1.0), Vec4::new(1.0, 0.0, 0.0, -1.0)];
    let attributes = Attributes { tangents: tangents.clone(), ..Attributes::default() };
    for scale in [DVec3::new(1.0, 2.0, 0.5), DVec3::new(-1.0, 2.0, 0.5)] {
        let m = DMat4::from_scale_rotation_translation(scale, DQuat::from_rotation_x(0.4), DVec3::X);
        let to_world = placed(m).to_world;
        let mut instanced = Geometry::default();
        let mut mesh = Mesh::default();
        mesh.add_triangles_with(&positions, Some(&normals), &attributes, &[[0, 1, 2]], MaterialId(0));
        let mesh = instanced.add_mesh(mesh);
        instanced.add_instance(mesh, Placement::new(to_world).unwrap());
        let part = Part {
            positions: positions.to_vec(),
            normals: Some(normals.to_vec()),
            attributes: attributes.clone(),
            triangles: vec![[0, 1, 2]],
            influences: Default::default(),
            material: 0,
        };
        let world = part::place(&part, &placed(m)).unwrap();
        let mut copied = Geometry::default();
        let normals = world.normals.as_deref();
        copied.add_triangles_with(&world.positions, normals, &world.attributes, &world.triangles, MaterialId(0));
        // A mirror exchanges the last two corners of the copy.
        let b = Vec2::new(0.2, 0.5);
        let frame = |g: &Geometry, id, b| g.tangent_frame(id, &g.surface_at(id, b).unwrap()).unwrap();
        let one = frame(&instanced, PrimitiveId::of(0, 0), b);
        let other = frame(&copied, PrimitiveId::world(0), if scale.x < 0.0 { Vec2::new(b.y, b.x) } else { b });
        for (x, y) in [(one.tangent, other.tangent), (one.bitangent, other.bitangent), (one.normal, other.normal)] {
            assert!((x - y).length() < 1e-5, "{one:?}, {other:?}");
        }
    }
}

#[test]
fn a_normal_below_the_surface_is_lifted_to_the_horizon() {
    let material = json!({ "normalTexture": { "index": 0 } });
    let normal = RgbImage::from_raw(1, 1, vec![255, 128, 0]).unwrap().into();
    let loaded = load(&textured(&encoded(&normal, ImageFormat::Png), &material)).unwrap();
    let surface = loaded.geometry.surface_at(PrimitiveId::world(0), Vec2::splat(0.3)).unwrap();
    let frame = loaded.geometry.tangent_frame(PrimitiveId::world(0), &surface).unwrap();
    let map = first(&loaded).maps.as_ref().unwrap().normal.clone().unwrap();
    let n = map.shading_normal(Vec2::ZERO, &frame, surface.normal);
    assert!(n.dot(Vec3::Z) > 0.0 && n.z < 0.06 && n.x > 0.99, "{n}");
    let behind = map.shading_normal(Vec2::ZERO, &frame, -surface.normal);
    assert!(behind.dot(-Vec3::Z) > 0.0, "{behind}");
}

#[test]
fn webp_of_the_extension_comes_before_the_fallback() {
    let mut document = textured(&encoded(&two_texels(), ImageFormat::WebP), &base_color());
    document["images"] = json!([{ "uri": "missing.png" }, document["images"][0]]);
    document["textures"][0]["extensions"] = json!({ "EXT_texture_webp": { "source": 1 } });
    document["extensionsUsed"] = json!(["EXT_texture_webp"]);
    let loaded = load(&document).unwrap();
    assert!(base(&loaded).lookup(Vec2::ZERO).x == 1.0 && loaded.warnings.is_empty());
}

#[test]
fn what_is_wrong_with_an_image_is_one_sentence() {
    let good = encoded(&two_texels(), ImageFormat::Png);
    let mut huge = good.clone();
    // The header's width and height, and its checksum.
    huge[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    let checksum = crc(&huge[12..29]).to_be_bytes();
    huge[29..33].copy_from_slice(&checksum);
    let mut outside = textured(&good, &base_color());
    outside["images"][0] = json!({ "uri": "../secret.png" });
    let mut set = textured(&good, &base_color());
    set["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(4);
    let cases = [
        (textured(&good[..good.len() / 2], &base_color()), "x.gltf, /images/0: the PNG image is broken"),
        (textured(b"GIF89a..", &base_color()), "/images/0: the image is neither PNG, JPEG, WebP nor KTX2"),
        (textured(&huge, &base_color()), "/images/0: with the image's 65536 × 65536 there are 4294967296 texels"),
        (outside, "/images/0/uri: the URI “../secret.png” leads out of the model's folder"),
        (set, "/accessors/4/type: texture coordinates have type VEC2"),
    ];
    for (document, expected) in cases {
        let error = load(&document).unwrap_err().to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
    }
}

/// The checksum of a PNG chunk (CRC-32).
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}

#[test]
fn a_black_emissive_texture_lights_nothing() {
    let material = json!({ "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 } });
    for (value, lit) in [(0, false), (1, true)] {
        let image = RgbImage::from_pixel(4, 4, image::Rgb([0, value, 0])).into();
        let loaded = load(&textured(&encoded(&image, ImageFormat::Png), &material)).unwrap();
        assert_eq!((first(&loaded).emits(), loaded.is_lit()), (lit, lit));
    }
}

#[test]
fn tangents_around_a_vertex_of_very_many_triangles_are_made() {
    // A fan: every triangle shares the vertex in the middle, and its edges with its neighbours.
    let n = 3000_u32;
    let around = (0..=n).map(|i| Vec2::from_angle(std::f32::consts::PI * i as f32 / n as f32));
    let uv: Vec<_> = std::iter::once(Vec2::ZERO).chain(around).collect();
    let mut attributes = Attributes::default();
    attributes.uv[0] = uv.clone();
    let mut part = Part {
        positions: uv.iter().map(|p| p.extend(0.0)).collect(),
        normals: Some(vec![Vec3::Z; uv.len()]),
        attributes,
        triangles: (1..=n).map(|i| [0, i, i + 1]).collect(),
        influences: Influences::default(),
        material: 0,
    };
    let image = Image::new(1, 1, Texels::U8(vec![128, 128, 255]));
    assert!(tangent::generate(&mut part, &Texture::new(Arc::new(image), Encoding::Linear)));
    assert!((part.attributes.tangents[0].truncate() - Vec3::X).length() < 1e-3, "{}", part.attributes.tangents[0]);
}
