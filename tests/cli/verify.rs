//! `pathspace verify`: answers, exit codes, and the folder it writes.

use std::{fs, path::Path, process::Output};

use crate::{Run, code, pixels, refused, scene, stderr, stdout};

/// `pathspace verify` of the Cornell box, small and reproducible.
fn verify(run: &Run, options: &[&str]) -> Output {
    let scene = scene();
    let small = ["verify", scene.to_str().unwrap(), "--width", "32"];
    run.pathspace(&[&small[..], options].concat())
}

#[test]
fn integrators_that_agree_are_said_to_and_shown() {
    let run = Run::new();
    fs::create_dir(run.path("out")).unwrap();
    fs::write(run.path("out/mine.txt"), "kept").unwrap();
    let options = ["--spp", "150", "--bias", "5%", "-i", "path,light,bdpt", "-o", "out", "--json"];
    let output = verify(&run, &options);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&json["outcome"], &json["exit"], &json["layout"]), (&"agree".into(), &0.into(), &1.into()));
    assert!(json["visible"].as_f64().unwrap() <= 0.05);
    assert_eq!(json["integrators"].as_array().unwrap().len(), 3);
    assert_eq!(json["integrators"][1]["uncovered"].as_f64(), Some(0.0), "the box has neither mirrors nor glass");
    let shares: f64 = json["classes"].as_array().unwrap().iter().map(|c| c["share"].as_f64().unwrap()).sum();
    assert!((shares - 1.0).abs() < 1e-9, "classes are a partition: {shares}");
    for row in json["comparisons"].as_array().unwrap() {
        for member in ["pair", "paths", "p", "share", "difference", "visible", "verdict"] {
            assert!(!row[member].is_null(), "{member}: {row}");
        }
    }
    let files: Vec<_> = json["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap().to_owned()).collect();
    for file in ["path.exr", "light.png", "bdpt.exr", "difference.png", "p-values.exr", "verify.json"] {
        assert!(files.iter().any(|f| f == file), "{file}");
    }
    let mut found: Vec<_> =
        fs::read_dir(run.path("out")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    found.sort();
    let mut expected = [files, vec!["mine.txt".to_owned()]].concat();
    expected.sort();
    assert_eq!(found, expected, "nothing is lost and nothing is left over");
    let saved: serde_json::Value = serde_json::from_slice(&fs::read(run.path("out/verify.json")).unwrap()).unwrap();
    assert_eq!(saved, json);
    assert_eq!(pixels(&fs::read(run.path("out/path.exr")).unwrap()).width, 32);
}

/// Surfaces that coincide, from bug reports: a lamp flush with a ceiling, and cards that overlap.
#[test]
fn coincident_surfaces_are_the_same_for_all_integrators() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/reports");
    if !folder.is_dir() {
        #[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
        let () = eprintln!("SKIPPED: {} is not here, so nothing was verified", folder.display());
        return;
    }
    let run = Run::new();
    for name in ["flush-lamp-ceiling-first", "flush-lamp-lamp-first", "coplanar-overlap"] {
        let file = folder.join(name).with_extension("glb");
        let options = ["verify", file.to_str().unwrap(), "--width", "24", "--bias", "8%", "--spp", "300", "-o", name];
        let output = run.pathspace(&options);
        assert_eq!(code(&output), 0, "{name}: {}{}", stdout(&output), stderr(&output));
    }
}

#[test]
fn a_verification_is_reproducible_for_any_number_of_threads() {
    let run = Run::new();
    let with = |threads: &str| {
        let options = ["--spp", "4", "-i", "path,light", "--threads", threads, "--json", "-q"];
        let mut json: serde_json::Value = serde_json::from_str(&stdout(&verify(&run, &options))).unwrap();
        let members = json["integrators"].as_array_mut().unwrap();
        members.iter_mut().for_each(|one| one["seconds"] = 0.into());
        (json, fs::read(run.path("cornell-box-verify/path.exr")).unwrap())
    };
    assert_eq!(with("1"), with("3"));
}

#[test]
fn too_short_a_verification_says_how_long_would_be_enough() {
    let run = Run::new();
    let output = verify(&run, &["--time", "100ms", "-o", "out"]);
    assert_eq!(code(&output), 5, "{}", stdout(&output));
    let text = stdout(&output);
    assert!(
        text.contains("undecided: in ") && text.contains("--time ") && text.contains("should be about enough"),
        "{text}"
    );
    assert!(run.path("out/verify.json").exists());
    let output = verify(&run, &["--spp", "4", "-q"]);
    assert_eq!((code(&output), stdout(&output).as_str(), stderr(&output).as_str()), (5, "", ""));
    assert_eq!(run.files(), ["cornell-box-verify", "out"]);
}

#[test]
fn wrong_verifications_are_refused_before_they_start() {
    let run = Run::new();
    fs::write(run.path("file"), "kept").unwrap();
    for (options, exit, about) in [
        (&["-i", "path"][..], 2, "nothing to be compared with"),
        (&["-i", "path,light,path"], 2, "twice"),
        (&["-i", "path,area"], 2, "area"),
        (&["--bias", "2"], 2, "2%"),
        (&["--spp", "1"], 2, "--spp"),
        (&["--spp", "4", "--time", "1s"], 2, "--time"),
        (&["--memory-limit", "1k"], 2, "--memory-limit"),
        (&["--camera", "nobody"], 2, "nobody"),
        (&["-o", "no/where"], 4, "no folder"),
        (&["-o", "file"], 4, "not a folder"),
    ] {
        refused(&verify(&run, &[&["-q"][..], options].concat()), exit, about);
    }
    refused(&run.pathspace(&["verify", "no-such-scene.glb"]), 3, "no-such-scene.glb");
    assert_eq!(run.files(), ["file"]);
}
