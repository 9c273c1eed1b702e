//! KTX2 images: files of the Basis Universal encoder, and what is wrong with others.

use sha2::{Digest as _, Sha256};

use super::*;
use crate::io::{
    Limits, ktx2,
    tests::textures::{encoded, textured},
};

/// Files of the Basis Universal encoder 2.5 (npm's ktx2-encoder 0.6), and the hashes of what its decoder makes of their
/// first levels.
fn vectors() -> Vec<(String, Vec<u8>, Value)> {
    let vectors: Vec<Value> = serde_json::from_str(include_str!("ktx2.json")).unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    vectors
        .iter()
        .map(|v| (text(&v["name"]), STANDARD.decode(text(&v["encoded"])).unwrap(), v["sha256"].clone()))
        .collect()
}

fn read(bytes: &[u8], limits: &Limits) -> Result<([u32; 2], Vec<u8>), String> {
    ktx2::rgba(bytes, &mut 0, limits, "/images/0").map_err(|fault| fault.at("x.gltf").to_string())
}

#[test]
fn files_of_basis_universal_are_what_its_decoder_makes_of_them() {
    for (name, bytes, hash) in vectors() {
        let (size, rgba) = read(&bytes, &Limits::default()).unwrap();
        let have: String = Sha256::digest(&rgba).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!((size, json!(have)), ([18, 13], hash), "{name}");
    }
}

#[test]
fn a_ktx2_texture_is_its_texels_as_png() {
    let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    for (name, bytes, _) in vectors() {
        let (_, rgba) = read(&bytes, &Limits::default()).unwrap();
        let plain = ::image::RgbaImage::from_raw(18, 13, rgba).unwrap();
        let plain = load(&textured(&encoded(&plain.into(), ::image::ImageFormat::Png), &material)).unwrap();
        let mut document = textured(&bytes, &material);
        document["images"] = json!([{ "uri": "missing.png" }, document["images"][0]]);
        document["textures"][0]["extensions"] = json!({ "KHR_texture_basisu": { "source": 1 } });
        document["extensionsUsed"] = json!(["KHR_texture_basisu"]);
        document["extensionsRequired"] = json!(["KHR_texture_basisu"]);
        let loaded = load(&document).unwrap();
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        let image = |loaded: &Loaded| loaded.materials[0].maps.as_ref().unwrap().base_color.clone().unwrap().image;
        assert!(image(&loaded) == image(&plain), "{name}");
    }
}

#[test]
fn what_is_wrong_with_a_ktx2_image_is_said() {
    let files = vectors();
    let [etc1s, .., uastc, zstandard] = &files[..] else { panic!("five files") };
    let cases: [(&[u8], usize, u64, &str); 12] = [
        (&etc1s.1, 24, 0, "has another number of dimensions"),
        (&etc1s.1, 20, 0xffff_ffff_ffff, "/images/0: with the image's 4294967295 × 65535 there are"),
        (&etc1s.1, 36, 6, "is an array, a cube"),
        (&etc1s.1, 40, 99, "it has no texels or levels"),
        (&etc1s.1, 48, 0xffff_fff0, "its format descriptor reaches beyond its end"),
        (&etc1s.1, 64, u64::MAX - 4, "its codebooks reaches beyond its end"),
        (&etc1s.1, 72, 30, "its codebooks are longer than announced"),
        (&etc1s.1, 80, u64::MAX - 4, "its first level reaches beyond its end"),
        (&etc1s.1, 44, 2, "is neither ETC1S with BasisLZ nor UASTC"),
        (&uastc.1, 12, 37, "is neither ETC1S with BasisLZ nor UASTC"),
        (&uastc.1, 88, 64, "its first level has another size"),
        (&zstandard.1, 96, 1 << 60, "its first level has another size"),
    ];
    for (bytes, at, number, sentence) in cases {
        let mut bytes = bytes.to_vec();
        let long = at >= 64 || number > u64::from(u32::MAX);
        let number = number.to_le_bytes();
        bytes[at..at + if long { 8 } else { 4 }].copy_from_slice(&number[..if long { 8 } else { 4 }]);
        let error = read(&bytes, &Limits::default()).unwrap_err();
        assert!(error.contains(sentence), "{error}");
    }
    let error = read(&uastc.1, &Limits { texels: 233, ..Limits::default() }).unwrap_err();
    assert!(error.contains("18 × 13") && error.contains("--limit texels=N"), "{error}");
}

#[test]
fn files_that_are_cut_or_changed_are_refused_or_read() {
    for (_, bytes, _) in vectors() {
        (0..bytes.len()).for_each(|cut| drop(read(&bytes[..cut], &Limits::default())));
        for i in 12..bytes.len() {
            for change in [0x01, 0x80, 0xff] {
                let mut bytes = bytes.clone();
                bytes[i] ^= change;
                drop(read(&bytes, &Limits { texels: 1 << 20, ..Limits::default() }));
            }
        }
    }
}
