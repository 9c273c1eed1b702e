//! `-i auto`: the choice of an integrator, where it is said and kept, and that the image is the chosen one's.

use std::{fs, path::Path};

use crate::{Run, code, pixels, refused, stderr};

/// The line that says what was chosen.
fn choice(output: &std::process::Output) -> Option<String> {
    stderr(output).lines().find_map(|line| line.strip_prefix("auto: ")).map(str::to_owned)
}

/// The integrator that it names.
fn chosen(line: &str) -> &str {
    line.split([',', ' ']).next().unwrap()
}

/// The options that ask for what it names: its integrator, and perhaps how many light paths.
fn by_name(line: &str) -> Vec<&str> {
    let named = line.split_once(", since ").expect("a reason").0;
    ["-i"].into_iter().chain(named.split(' ')).collect()
}

fn header(file: &Path, name: &str) -> Option<String> {
    let meta = exr::meta::MetaData::read_from_file(file, false).unwrap();
    let attributes = &meta.headers[0].own_attributes.other;
    let value = attributes.get(&exr::meta::attribute::Text::from(&*format!("pathspace.{name}")))?;
    match value {
        exr::meta::attribute::AttributeValue::Text(text) => Some(text.to_string()),
        other => panic!("{name} is {other:?}"),
    }
}

#[test]
fn the_image_is_that_of_the_integrator_it_names() {
    let run = Run::new();
    let output = run.render(&["--spp", "3", "-o", "auto.exr"]);
    assert_eq!(code(&output), 0);
    let line = choice(&output).expect("what was chosen");
    let name = chosen(&line);
    assert!(["path", "hybrid", "bdpt", "bdpt-sds", "vcm"].contains(&name), "{line}");
    assert!(line.contains("for the same noise"), "{line}");
    let auto = fs::read(run.path("auto.exr")).unwrap();
    let named = run.image("by-name.exr", &[&["--spp", "3"], &by_name(&line)[..]].concat());
    assert_eq!(pixels(&auto), pixels(&named));
    let text = header(&run.path("auto.exr"), "choice").expect("the reason");
    assert_eq!(Some(text.as_str()), line.split_once(", since ").map(|(_, why)| format!("auto: {why}")).as_deref());
    assert_eq!(header(&run.path("auto.exr"), "integrator").as_deref(), Some(name));
    assert_eq!(header(&run.path("by-name.exr"), "choice"), None);
}

/// Under a lamp in a bulb, whose light reaches the mirror by caustics alone.
#[test]
fn merging_is_chosen_where_it_is_needed_and_admitted() {
    let run = Run::new();
    let bulb = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bulb.glb");
    let render = |options: &[&str]| {
        let common = ["render", bulb.to_str().unwrap(), "--width", "64", "--spp", "1", "-o", "bulb.exr"];
        let output = run.pathspace(&[&common[..], options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        choice(&output).expect("what was chosen")
    };
    assert_eq!(chosen(&render(&[])), "vcm");
    let unbiased = render(&["--unbiased"]);
    assert!(
        ["path", "hybrid", "bdpt"].contains(&chosen(&unbiased))
            && !unbiased.contains("vcm")
            && !unbiased.contains("sds"),
        "{unbiased}"
    );
}

#[test]
fn options_that_others_lack_narrow_the_choice() {
    let run = Run::new();
    for (options, only) in [
        (&["--light-vertices", "2", "--unbiased"][..], "bdpt"),
        (&["--only-strategy", "2,2"], "bdpt"),
        (&["--only-strategy", "3,3"], "bdpt"),
    ] {
        let output = run.render(&[options, &["--spp", "1", "-o", "image.exr"]].concat());
        assert_eq!((code(&output), choice(&output)), (0, None), "{}", stderr(&output));
        assert_eq!(header(&run.path("image.exr"), "integrator").as_deref(), Some(only), "{options:?}");
    }
    let nothing = run.render(&["--merge-radius", "0.1", "--unbiased"]);
    refused(&nothing, 2, "-i bdpt merges no paths");
    for option in [&["--unbiased"][..], &["--choice", "choice.json"]] {
        refused(&run.render(&[&["-i", "bdpt"], option].concat()), 2, "--unbiased and --choice are for -i auto");
    }
}

#[test]
fn a_file_keeps_the_choice() {
    let run = Run::new();
    let common = ["--spp", "2", "--choice", "choice.json"];
    let first = run.render(&[&common[..], &["-o", "first.exr"]].concat());
    assert!(code(&first) == 0 && choice(&first).is_some(), "{}", stderr(&first));
    let text = fs::read_to_string(run.path("choice.json")).unwrap();
    let again = run.render(&[&common[..], &["-o", "again.exr"]].concat());
    assert_eq!(code(&again), 0);
    assert!(choice(&again).is_some_and(|line| line.contains("as 'choice.json' has it")), "there is no second pilot");
    let without = run.render(&["--spp", "2", "-o", "without.exr"]);
    assert_eq!(code(&without), 0);
    let [first, again, without] = ["first.exr", "again.exr", "without.exr"].map(|x| fs::read(run.path(x)).unwrap());
    assert!(first == again && again == without, "the same file with and without");
    assert_eq!(fs::read_to_string(run.path("choice.json")).unwrap(), text);
    // A person may write it, too.
    for (text, integrator, paths) in [
        (r#"{ "integrator": "path" }"#, "path", None),
        (r#"{ "integrator": "vcm" }"#, "vcm", None),
        (r#"{ "integrator": "vcm", "light_paths": "1/8" }"#, "vcm", Some("1/8")),
        (r#"{ "integrator": "vcm", "light_paths": 0.125 }"#, "vcm", Some("1/8")),
    ] {
        fs::write(run.path("choice.json"), text).unwrap();
        assert_eq!(code(&run.render(&[&common[..], &["-o", "named.exr"]].concat())), 0);
        assert_eq!(header(&run.path("named.exr"), "integrator").as_deref(), Some(integrator));
        assert_eq!(header(&run.path("named.exr"), "light-paths").as_deref(), paths, "{text}");
    }
    for (text, about) in [
        ("{", "holds no choice"),
        ("{}", "it names no 'integrator'"),
        (r#"{ "integrator": "area" }"#, "'area' with 1 light paths is none of path, hybrid, bdpt, bdpt-sds, vcm"),
        (r#"{ "integrator": "path", "light_paths": "1/8" }"#, "'path' with 1/8 light paths is none of path"),
        (r#"{ "integrator": "vcm", "light_paths": [1] }"#, "light paths are 1 to 1024 for each pixel, or 1/N"),
        (r#"{ "integrator": "vcm", "light_paths": "8/8" }"#, "light paths are 1 to 1024 for each pixel, or 1/N"),
        (r#"{ "integrator": "path", "scene": "another" }"#, "is for another scene"),
    ] {
        fs::write(run.path("choice.json"), text).unwrap();
        refused(&run.render(&common), 3, about);
    }
    // What it does not say, the options do.
    fs::write(run.path("choice.json"), r#"{ "integrator": "bdpt" }"#).unwrap();
    let two = run.render(&[&common[..], &["--light-paths", "2", "-o", "two.exr"]].concat());
    assert_eq!(code(&two), 0, "{}", stderr(&two));
    assert_eq!(header(&run.path("two.exr"), "light-paths").as_deref(), Some("2"));
    refused(&run.render(&["--choice", "no/such/folder/choice.json"]), 4, "no/such/folder");
    let alone = ["--light-vertices", "2", "--unbiased", "--choice", "choice.json"];
    refused(&run.render(&alone), 2, "leave nothing but -i bdpt to choose");
}

/// Where memory has no room for the light vertices of `vcm`, and light vertices to choose from are none of `hybrid`'s.
#[test]
fn what_memory_leaves_is_said_and_kept() {
    let run = Run::new();
    let options = ["--light-vertices", "2", "--light-paths", "600", "--max-depth", "4", "--memory-limit", "5M"];
    let output = run.render(&[&options[..], &["--spp", "1", "--choice", "choice.json", "-o", "image.exr"]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let line = choice(&output).expect("what was chosen");
    assert_eq!(line, "bdpt --light-paths 600, since no other fits into memory");
    let kept: serde_json::Value = serde_json::from_slice(&fs::read(run.path("choice.json")).unwrap()).unwrap();
    assert_eq!((&kept["integrator"], &kept["light_paths"]), (&"bdpt".into(), &"600".into()));
}

#[test]
fn shards_choose_as_the_whole_does() {
    let run = Run::new();
    let output = run.render(&["--spp", "4", "-o", "whole.exr"]);
    let line = choice(&output).expect("what was chosen");
    let whole = fs::read(run.path("whole.exr")).unwrap();
    run.image("part-1.exr", &["--spp", "4", "--shard", "1/2"]);
    // One whose integrator somebody has named is a part of the same image.
    run.image("part-2.exr", &[&["--spp", "4", "--shard", "2/2"], &by_name(&line)[..]].concat());
    let merged = run.pathspace(&["merge", "part-1.exr", "part-2.exr", "-o", "merged.exr"]);
    assert_eq!(code(&merged), 0, "{}", stderr(&merged));
    assert_eq!(fs::read(run.path("merged.exr")).unwrap(), whole);
}

#[test]
fn trace_chooses_as_render_does() {
    let run = Run::new();
    let scene = crate::scene();
    let small = ["--width", "16", "--height", "12", "--spp", "2"];
    let output = run.pathspace(&[&["trace", scene.to_str().unwrap(), "--pixel", "5,5"], &small[..]].concat());
    let line = choice(&output).expect("what was chosen");
    let rendered = run.render(&["--spp", "2", "-o", "image.exr"]);
    assert_eq!(choice(&rendered), Some(line.clone()));
    assert!(crate::stdout(&output).contains(&by_name(&line).join(" ")), "{}", crate::stdout(&output));
}
