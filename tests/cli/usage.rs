//! What is wrong with a command, a scene or an output is said in one sentence, before anything is rendered.

use std::{fs, path::Path};

use crate::{Run, code, refused, scene, stderr, stdout, triangle};

#[test]
fn help_and_version_are_answers() {
    let run = Run::new();
    for arguments in [
        &["--help"][..],
        &["render", "--help"],
        &["merge", "--help"],
        &["verify", "--help"],
        &["info", "-h"],
        &["--version"],
    ] {
        let output = run.pathspace(arguments);
        assert_eq!(code(&output), 0);
        assert!(!output.stdout.is_empty() && output.stderr.is_empty());
    }
    let help = stdout(&run.pathspace(&["render", "--help"]));
    for option in [
        "--spp",
        "--time",
        "--max-depth",
        "--look-at",
        "--only-strategy",
        "--memory-limit",
        "--resume",
        "--shard",
        "--limit",
        "default: auto",
    ] {
        assert!(help.contains(option), "{option}");
    }
}

#[test]
fn help_and_pages_list_the_same_exit_codes() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scripting.md")).unwrap();
    let listed: Vec<_> = page.lines().filter(|l| l.starts_with("| ") && l.as_bytes()[2].is_ascii_digit()).collect();
    let help = stdout(&Run::new().pathspace(&["--help"]));
    let (_, table) = help.split_once("Exit codes:\n").unwrap();
    let codes = table.lines().map(|line| line.trim().split_once("  ").unwrap());
    assert_eq!(codes.map(|(code, meaning)| format!("| {code} | {meaning} |")).collect::<Vec<_>>(), listed);
}

#[test]
fn no_command_shows_the_help() {
    let output = Run::new().pathspace(&[]);
    assert_eq!(code(&output), 2);
    assert!(stderr(&output).contains("Usage:"));
}

#[test]
fn wrong_usage_is_refused() {
    let run = Run::new();
    refused(&run.pathspace(&["paint"]), 2, "paint");
    refused(&run.pathspace(&["render"]), 2, "SCENE");
    for (options, about) in [
        (&["-i", "whitted"][..], "whitted"),
        (&["--spp", "0"], "--spp"),
        (&["--spp", "many"], "--spp"),
        (&["--spp", "4", "--time", "1s"], "--time"),
        (&["--time", "soon"], "30s"),
        (&["--time", "0s"], "positive"),
        (&["--width", "0"], "--width"),
        (&["--max-depth", "0"], "--max-depth"),
        (&["--max-depth", "256"], "--max-depth"),
        (&["--filter", "gauss"], "gauss"),
        (&["--build", "slow"], "slow"),
        (&["--exposure", "nan"], "finite"),
        (&["--tone", "aces"], "filmic"),
        (&["--white-balance", "100"], "from 1667 to 25000 kelvin"),
        (&["--blades", "2"], "0, or a number from 3 to 64"),
        (&["--blade-rotation", "20"], "--blades"),
        (&["--clamp", "-1"], "--clamp"),
        (&["--roulette", "sometimes"], "off"),
        (&["--crop", "5,5,5,9"], "at least one pixel"),
        (&["--crop", "1,2,3"], "x0,y0,x1,y1"),
        (&["--crop", "-1,0,2,2"], "--crop"),
        (&["--threads", "0"], "--threads"),
        (&["--only-strategy", "1,0"], "at least 1"),
        (&["--only-strategy", "2,2", "--max-depth", "2"], "--max-depth"),
        (&["--unweighted"], "--only-strategy"),
        (&["--look-at", "0,0,0,0,0,0"], "look at"),
        (&["--look-at", "0,0,1,0,0,0", "--camera", "0"], "--camera"),
        (&["--aperture", "-1", "--focus", "2"], "--aperture"),
        (&["--aperture", "0.1", "--focus", "0"], "--focus"),
        (&["--memory-limit", "lots"], "4GiB"),
        (&["-q", "-v"], "--verbose"),
        (&["--env-rotate", "90"], "--env"),
        (&["--env", "a.hdr", "--env-color", "1"], "--env-color"),
        (&["--env-color", "1,-2,3"], "between 0 and"),
        (&["--env-color", "grey"], "grey"),
        (&["--env-scale", "0"], "positive"),
        (&["--nonsense"], "--nonsense"),
    ] {
        refused(&run.render(options), 2, about);
    }
    assert!(run.files().is_empty());
}

#[test]
fn formats_are_known_by_extension() {
    let run = Run::new();
    for name in ["picture.jpg", "picture", "picture.exr.gz"] {
        refused(&run.render(&["-o", name]), 2, ".exr or .png");
    }
}

#[test]
fn a_missing_or_broken_scene_is_refused() {
    let run = Run::new();
    for command in ["render", "info"] {
        refused(&run.pathspace(&[command, "no-such-scene.glb"]), 3, "no-such-scene.glb");
        fs::write(run.path("empty.glb"), "").unwrap();
        refused(&run.pathspace(&[command, "empty.glb"]), 3, "empty.glb");
        refused(&run.pathspace(&[command, "."]), 3, "cannot read .");
    }
    assert_eq!(run.files(), ["empty.glb"]);
}

#[test]
fn a_damaged_scene_is_refused_with_the_place_of_the_damage() {
    let run = Run::new();
    let whole = fs::read(scene()).unwrap();
    fs::write(run.path("cut.glb"), &whole[..whole.len() - 100]).unwrap();
    refused(&run.pathspace(&["render", "cut.glb"]), 3, "cut.glb");
    fs::write(run.path("typo.gltf"), "{ \"asset\": { \"version\": \"2.0\" }, }").unwrap();
    refused(&run.pathspace(&["render", "typo.gltf"]), 3, "line 1");
    fs::write(run.path("range.gltf"), triangle("0.0").replace("\"POSITION\": 0", "\"POSITION\": 7")).unwrap();
    refused(&run.pathspace(&["render", "range.gltf"]), 3, "/meshes/0/primitives/0");
    fs::write(run.path("nan.gltf"), triangle("nan")).unwrap();
    refused(&run.pathspace(&["render", "nan.gltf"]), 3, "/accessors/0");
    fs::write(run.path("good.gltf"), triangle("0.0")).unwrap();
    assert_eq!(code(&run.pathspace(&["info", "good.gltf"])), 0, "the undamaged document is fine");
}

#[test]
fn outputs_are_checked_before_the_scene_is_read() {
    let run = Run::new();
    fs::create_dir(run.path("folder.exr")).unwrap();
    fs::write(run.path("old.png"), "old").unwrap();
    let scene = "no-such-scene.glb";
    refused(&run.pathspace(&["render", scene, "-o", "nowhere/a.exr"]), 4, "no folder");
    refused(&run.pathspace(&["render", scene, "-o", "folder.exr"]), 4, "folder");
    refused(&run.pathspace(&["render", scene, "-o", "old.png", "-o", "old.png/a.exr"]), 4, "not a folder");
    assert_eq!(fs::read(run.path("old.png")).unwrap(), b"old");
    assert_eq!(run.files(), ["folder.exr", "old.png"]);
}

#[test]
fn what_only_the_scene_can_tell_is_refused_before_rendering() {
    let run = Run::new();
    refused(&run.render(&["-q", "--crop", "0,0,17,4"]), 2, "16×12");
    refused(&run.render(&["-q", "--camera", "nobody"]), 2, "nobody");
    refused(&run.render(&["-q", "--aperture", "0.1"]), 2, "--focus");
    refused(&run.render(&["-q", "--focus", "2"]), 2, "--aperture");
    refused(&run.render(&["-q", "--blades", "6"]), 2, "--blades needs a lens");
    let scene = scene();
    let huge = ["render", scene.to_str().unwrap(), "-q", "--width", "32768", "--height", "32768"];
    refused(&run.pathspace(&huge), 2, "--memory-limit");
    assert!(run.files().is_empty());
}
