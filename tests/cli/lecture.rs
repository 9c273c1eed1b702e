//! `docs/lecture.md`: every command that it gives does what it says, with fewer samples.

use std::fs;

use crate::{Run, code, stderr};

const PAGE: &str = include_str!("../../docs/lecture.md");

/// The commands between the fences of shell code; a line that ends with a backslash goes on in the next.
fn commands() -> Vec<String> {
    let blocks = PAGE.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap_or_default());
    let text = blocks.collect::<String>().replace("\\\n", "");
    text.lines().map(str::to_owned).collect()
}

#[test]
fn every_command_of_the_lecture_runs() {
    let run = Run::new();
    std::os::unix::fs::symlink(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes"), run.path("scenes")).unwrap();
    let mut ran = 0;
    for command in commands() {
        let mut words: Vec<_> = command.split_whitespace().map(|word| word.trim_matches('\'').to_owned()).collect();
        assert_eq!(words.remove(0), "pathspace", "{command}");
        for i in 1..words.len() {
            match words[i - 1].as_str() {
                "--spp" => words[i] = words[i].parse::<u32>().unwrap().min(4).to_string(),
                "--width" => words[i] = "24".to_owned(),
                "--rays" | "--light-samples" => words[i] = words[i].parse::<u32>().unwrap().min(8).to_string(),
                // Below this it may say that there was too little time.
                "--time" => words[i] = "1s".to_owned(),
                _ => {}
            }
        }
        if words[0] == "render" && !command.contains("--width") {
            words.extend(["--width".to_owned(), "24".to_owned()]);
        }
        let output = run.pathspace(&words.iter().map(String::as_str).collect::<Vec<_>>());
        let too_little_time = words[0] == "verify" && code(&output) == 5;
        assert!(code(&output) == 0 || too_little_time, "{command}: {}", stderr(&output));
        if let Some(at) = words.iter().position(|word| word == "-o") {
            assert!(fs::metadata(run.path(&words[at + 1])).is_ok_and(|file| file.len() > 0), "{command}");
        }
        ran += 1;
    }
    assert!(ran >= 20, "{ran} commands");
}

#[test]
fn the_lecture_names_code_that_is_there() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/");
    let quoted = PAGE.split('`').skip(1).step_by(2);
    let files: Vec<_> = quoted.filter(|name| name.starts_with("src/") || name.starts_with("tests/")).collect();
    assert!(files.len() > 10);
    for file in files {
        assert!(fs::exists(format!("{root}{file}")).unwrap(), "{file}");
    }
    let source = |file: &str| fs::read_to_string(format!("{root}{file}")).unwrap();
    for (file, function) in [
        ("src/path/joined.rs", "pub fn contribution"),
        ("src/path/subpath.rs", "fn walk("),
        ("src/path/subpath.rs", "fn scatter("),
        ("src/scene/light/mod.rs", "pub fn sample_next_event"),
        ("src/path/mis.rs", "pub fn mis_weight"),
        ("src/path/strategy.rs", "pub fn with_light_samples"),
        ("src/path/strategy.rs", "pub fn with_splits"),
        ("src/scene/light/tree.rs", "struct LightTree"),
        ("src/scene/mod.rs", "pub fn spread_radiance"),
        ("src/integrator/estimator.rs", "fn consider("),
        ("src/scene/light/choice.rs", "fn by_kind_and_power"),
        ("src/scene/mod.rs", "pub fn trace("),
        ("src/integrator/estimator.rs", "pub fn estimate_from_camera"),
        ("src/path/definition.rs", "pub fn geometry_term"),
    ] {
        assert!(source(file).contains(function), "{function} in {file}");
    }
}
