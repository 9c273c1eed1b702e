//! `pathspace trace`.

use serde_json::Value;

use super::*;

/// `pathspace trace` of the Cornell box at the size of [`Run::render`].
fn trace(run: &Run, options: &[&str]) -> Output {
    let scene = scene();
    let small = ["trace", scene.to_str().unwrap(), "--width", "16", "--height", "12"];
    run.pathspace(&[&small[..], options].concat())
}

fn json(output: &Output) -> Value {
    assert_eq!(code(output), 0, "{}", stderr(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_pixel_is_that_of_the_rendered_file() {
    let run = Run::new();
    for options in [
        &["-i", "path"][..],
        &["-i", "light"],
        &["-i", "bdpt", "--filter", "blackman-harris"],
        &["-i", "vcm"],
        &["-i", "vcm", "--paths", "C.*[DG].*L"],
        &["-i", "hybrid", "--clamp", "0.5", "--seed", "3"],
        &["-i", "bdpt", "--only-strategy", "1,2", "--unweighted"],
        &["-i", "bdpt", "--light-vertices", "2"],
    ] {
        let options = [options, &["--spp", "4"]].concat();
        let image = pixels(&run.image("out.exr", &options));
        for [x, y] in [[7, 5], [15, 11]] {
            let pixel = format!("{x},{y}");
            let answer = json(&trace(&run, &[&options[..], &["--pixel", &pixel, "--json"]].concat()));
            let traced = [0, 1, 2].map(|channel| answer["value"][channel].as_f64().unwrap() as f32);
            assert_eq!(traced, image.pixels[y * 16 + x].to_array(), "{options:?} {pixel}");
            for one in answer["largest"].as_array().unwrap() {
                let weights = one["techniques"].as_array().unwrap().iter().map(|x| x["w"].as_f64().unwrap());
                assert!((weights.sum::<f64>() - 1.0).abs() < 1e-9);
                assert_eq!(one["edges"].as_array().unwrap().len() + 1, one["vertices"].as_array().unwrap().len());
            }
        }
    }
}

/// What a person is to learn: which path it was, and what would have found it.
#[test]
fn a_person_reads_the_path_and_the_better_technique() {
    let run = Run::new();
    let options = ["--pixel", "7,9", "--spp", "4", "--top", "2", "-i", "path-hemisphere"];
    let output = trace(&run, &options);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let text = stdout(&output);
    for words in ["pixel 7,9 of 16×12, -i path-hemisphere, 4 spp", "light (surface)", "'white'", "diffuse reflection"]
    {
        assert!(text.contains(words), "no '{words}' in\n{text}");
    }
    assert!(text.contains("times as often, but is not in -i path-hemisphere (choose -i path"), "{text}");
    assert_eq!(trace(&run, &options).stdout, output.stdout);
    assert_eq!(trace(&run, &[&options[..], &["--threads", "3"]].concat()).stdout, output.stdout);
}

#[test]
fn what_cannot_be_traced_is_refused_in_a_sentence() {
    let run = Run::new();
    refused(&trace(&run, &["--pixel", "16,0"]), 2, "outside the image of 16×12 pixels");
    refused(&trace(&run, &["--pixel", "-1,0"]), 2, "not such a number");
    refused(&trace(&run, &["--pixel", "1"]), 2, "two whole numbers");
    refused(&trace(&run, &[]), 2, "--pixel");
    refused(&trace(&run, &["--pixel", "1,1", "-i", "path", "--merge-radius", "1"]), 2, "-i bdpt-sds and vcm");
    refused(&trace(&run, &["--pixel", "1,1", "-i", "vcm", "--memory-limit", "1k"]), 2, "--memory-limit");
    refused(&run.pathspace(&["trace", "nothing.glb", "--pixel", "1,1"]), 3, "nothing.glb");
    assert!(run.files().is_empty());
}
