//! `pathspace compare`: errors, bounds, differences.

use std::fs;

use pathspace::{compare::Metric, math::Rgb};
use serde_json::Value;

use crate::{Run, code, pixels, refused, scene, stdout};

#[test]
fn errors_shrink_with_samples_and_bounds_decide_the_exit_code() {
    let run = Run::new();
    let noisy = pixels(&run.image("noisy.exr", &["-q", "-i", "path", "--spp", "4"]));
    let better = pixels(&run.image("better.exr", &["-q", "-i", "path", "--spp", "64", "--seed", "1"]));
    let reference = pixels(&run.image("reference.exr", &["-q", "--spp", "256", "--seed", "2"]));

    let output = run.pathspace(&["compare", "noisy.exr", "better.exr", "--reference", "reference.exr", "--json"]);
    assert_eq!(code(&output), 0);
    let answer: Value = serde_json::from_str(&stdout(&output)).unwrap();
    for (row, image, file) in [(0, &noisy, "noisy.exr"), (1, &better, "better.exr")] {
        let row = &answer["images"][row];
        assert_eq!(row["file"], file);
        for metric in Metric::ALL {
            // JSON is read to within a rounding.
            let (said, expected) = (row[metric.name()].as_f64().unwrap(), metric.between(image, &reference));
            assert!((said - expected).abs() <= 1e-14 * expected, "{}: {said}, {expected}", metric.name());
        }
    }
    let error = |row: usize| answer["images"][row]["relmse"].as_f64().unwrap();
    assert!(error(0) > 4.0 * error(1), "16 times the samples: {} and {}", error(0), error(1));

    let between = (error(0) * error(1)).sqrt();
    let bounded = |image: &str| {
        let bound = format!("relmse={between}");
        run.pathspace(&["compare", image, "reference.exr", "--fail-above", &bound, "--fail-above", "mape=9"])
    };
    let failed = bounded("noisy.exr");
    assert_eq!((code(&failed), code(&bounded("better.exr"))), (1, 0));
    assert!(stdout(&failed).ends_with(&format!("relmse of noisy.exr is above {between}\n")), "{}", stdout(&failed));
    assert_eq!(stdout(&run.pathspace(&["compare", "noisy.exr", "better.exr", "-q"])), "");
}

#[test]
fn the_difference_is_an_image() {
    let run = Run::new();
    let a = pixels(&run.image("a.exr", &["-q", "-i", "path", "--spp", "2"]));
    let b = pixels(&run.image("b.exr", &["-q", "-i", "path", "--spp", "2", "--exposure", "1", "--seed", "3"]));
    let output = run.pathspace(&["compare", "a.exr", "b.exr", "-o", "d.exr", "-o", "d.png"]);
    assert_eq!(code(&output), 0);
    let difference = pixels(&fs::read(run.path("d.exr")).unwrap());
    let expected: Vec<Rgb> = a.pixels.iter().zip(&b.pixels).map(|(a, b)| *a - *b).collect();
    assert!(difference.pixels == expected && expected.iter().any(|d| d.min_element() < 0.0));
    assert_eq!(run.files(), ["a.exr", "b.exr", "d.exr", "d.png"]);
    // Equal images: white.
    assert_eq!(code(&run.pathspace(&["compare", "a.exr", "a.exr", "-o", "d.png", "--fail-above", "mse=0"])), 0);
    let white = image::open(run.path("d.png")).unwrap().into_rgb8();
    assert!(white.pixels().all(|p| p.0 == [255; 3]));
}

#[test]
fn what_cannot_be_compared_is_said() {
    let run = Run::new();
    run.image("a.exr", &["-q", "-i", "path", "--spp", "1"]);
    run.image("b.exr", &["-q", "-i", "path", "--spp", "1", "--crop", "0,0,4,5"]);
    run.image("c.png", &["-q", "-i", "path", "--spp", "1"]);
    fs::write(run.path("broken.exr"), [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0, 9]).unwrap();
    for (arguments, exit, about) in [
        (&["a.exr", "b.exr"][..], 3, "16 × 12 pixels and 'b.exr' 4 × 5"),
        (&["a.exr", "a.exr", "--reference", "b.exr"], 3, "one size"),
        (&["a.exr", "c.png"], 3, "no OpenEXR file"),
        (&["a.exr", "none.exr"], 3, "none.exr"),
        (&["broken.exr", "a.exr"], 3, "cannot be decoded"),
        (&["a.exr", "a.exr", "-o", "d.jpg"], 2, ".exr or .png"),
        (&["a.exr", "a.exr", "-o", "no/d.png"], 4, "no folder"),
        (&["a.exr", "a.exr", "--fail-above", "psnr=3"], 2, "relmse-trimmed"),
        (&["a.exr", "a.exr", "--fail-above", "mse=-1"], 2, "not negative"),
        (&["a.exr"], 2, "<B>"),
    ] {
        refused(&run.pathspace(&[&["compare"], arguments].concat()), exit, about);
    }
    assert_eq!(run.files(), ["a.exr", "b.exr", "broken.exr", "c.png"]);
}

#[test]
fn halves_tell_bias_from_noise() {
    let run = Run::new();
    let scene = scene();
    let render = |name: &str, options: &[&str]| {
        let large =
            ["render", scene.to_str().unwrap(), "--width", "64", "--height", "48", "--spp", "64", "-q", "-o", name];
        assert_eq!(code(&run.pathspace(&[&large[..], options].concat())), 0);
    };
    render("a.exr", &["--data", "halves", "-i", "path"]);
    render("b.exr", &["--data", "halves", "--seed", "1", "-i", "bdpt"]);
    render("clamped.exr", &["--data", "halves", "--seed", "2", "--clamp", "0.05", "-i", "path"]);
    render("plain.exr", &[]);
    let p = |a: &str, b: &str| {
        let answer: Value = serde_json::from_str(&stdout(&run.pathspace(&["compare", a, b, "--json"]))).unwrap();
        answer["p_of_no_bias"].as_f64()
    };
    assert!(p("a.exr", "b.exr").unwrap() > 1e-3, "two integrators, one image");
    assert!(p("a.exr", "clamped.exr").unwrap() < 1e-6, "what is cut off is missing");
    assert_eq!(p("plain.exr", "plain.exr"), None);
    let said = stdout(&run.pathspace(&["compare", "a.exr", "clamped.exr"]));
    assert!(said.contains("these images are not of one expectation"), "{said}");
}
