//! `--progress` and `--stats`: what scripts learn of a render.

use std::fs;

use serde_json::Value;

use crate::{Run, code, refused, stderr, stdout};

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"))).collect()
}

fn keys(object: &Value) -> Vec<&str> {
    let mut keys: Vec<_> = object.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

#[test]
fn progress_as_json_has_stable_keys() {
    let run = Run::new();
    let options =
        ["-q", "--time", "2500ms", "-i", "path", "--progress", "json", "-o", "a.png", "--checkpoint", "k.exr"];
    let output = run.render(&options);
    assert_eq!((code(&output), stderr(&output).as_str()), (0, ""));
    let events = lines(&stdout(&output));
    let names: Vec<_> = events.iter().map(|event| event["event"].as_str().unwrap()).collect();
    assert!(names.len() >= 3 && names[0] == "start" && names[names.len() - 1] == "end", "{names:?}");
    assert!(names[1..names.len() - 1].iter().all(|name| *name == "progress"));
    let start = [
        "event",
        "first_sample",
        "frame",
        "height",
        "integrator",
        "layout",
        "resumed_spp",
        "scene",
        "version",
        "whole_spp",
        "width",
    ];
    assert_eq!(keys(&events[0]), start);
    let progress =
        ["elapsed", "event", "fraction", "left", "noise", "of", "rays_per_second", "samples_per_second", "spp"];
    assert_eq!(keys(&events[1]), progress);
    assert!(events[1]["fraction"].as_f64().unwrap() > 0.2 && events[1]["spp"].as_u64().unwrap() > 0);
    let end = &events[names.len() - 1];
    assert_eq!(keys(end), ["black", "checkpoint", "elapsed", "event", "exit", "files", "noise", "outcome", "spp"]);
    assert_eq!((&end["files"][0], &end["checkpoint"], &end["exit"]), (&"a.png".into(), &"k.exr".into(), &0.into()));
}

#[test]
fn progress_goes_where_it_is_asked_for() {
    let run = Run::new();
    let said = |style: &str| {
        let output = run.render(&["--time", "1300ms", "-i", "path", "-o", "a.png", "--progress", style]);
        assert_eq!(code(&output), 0);
        assert!(output.stdout.is_empty());
        stderr(&output).lines().filter(|line| line.contains(" left")).count()
    };
    assert_eq!([said("auto"), said("plain"), said("none")].map(|lines| lines > 0), [true, true, false]);
    refused(&run.render(&["--progress", "loud"]), 2, "loud");
}

#[test]
fn statistics_count_what_was_done() {
    let run = Run::new();
    let stats = |options: &[&str]| -> Value {
        run.image("a.exr", &[&["-q", "--stats", "stats.json", "--threads", "2"], options].concat());
        serde_json::from_slice(&fs::read(run.path("stats.json")).unwrap()).unwrap()
    };
    let path = stats(&["-i", "path", "--spp", "4", "--checkpoint", "k.exr"]);
    assert_eq!((&path["samples"], &path["spp"], &path["threads"]), (&(16 * 12 * 4).into(), &4.into(), &2.into()));
    assert_eq!((&path["outcome"], &path["exit"], &path["layout"]), (&"done".into(), &0.into(), &2.into()));
    let rays = |stats: &Value, kind: &str| stats["rays"][kind].as_u64().unwrap();
    assert!(rays(&path, "camera") >= 16 * 12 * 4 && rays(&path, "visibility") > 0 && rays(&path, "light") == 0);
    let sum: u64 = ["camera", "light", "visibility"].iter().map(|kind| rays(&path, kind)).sum();
    assert_eq!(rays(&path, "all"), sum);
    for phase in ["read", "build", "resume", "render", "write", "checkpoints", "all"] {
        assert!(path["seconds"][phase].as_f64().unwrap() >= 0.0, "{phase}");
    }
    let (film, wide) = (path["memory"]["film"].as_u64().unwrap(), path["memory"]["wide_sums"].as_u64().unwrap());
    assert!(film >= 16 * 12 * 48 + wide && film < 16 * 12 * 200, "{film}, of which wide sums take {wide}");
    if cfg!(target_os = "linux") {
        assert!(path["memory"]["peak"].as_u64().unwrap() > 1 << 20);
    }
    assert!(path["rejected"].as_object().unwrap().is_empty() && path["film_errors"]["non_finite"] == 0);
    let light = stats(&["-i", "light", "--spp", "4"]);
    assert!(rays(&light, "camera") == 0 && rays(&light, "light") > 0);

    let lookups = |stats: &Value| ["made", "found"].map(|kind| stats["lookups"][kind].as_u64().unwrap());
    let vcm = stats(&["-i", "vcm", "--spp", "4", "--checkpoint", "v.exr"]);
    let [made, found] = lookups(&vcm);
    assert!(lookups(&light) == [0, 0] && made > 0 && made <= rays(&vcm, "camera") && found > 0, "{vcm}");
    let longer = stats(&["-i", "vcm", "--spp", "9", "--resume", "v.exr"]);
    assert_eq!(lookups(&longer), lookups(&stats(&["-i", "vcm", "--spp", "9"])));

    // Counts are of the image; what this run added is apart.
    let whole = stats(&["-i", "path", "--spp", "9"]);
    let resumed = stats(&["-i", "path", "--spp", "9", "--resume", "k.exr"]);
    assert_eq!((&whole["rays"], &whole["samples"]), (&resumed["rays"], &resumed["samples"]));
    assert_eq!((&resumed["resumed_spp"], &resumed["this_run"]["samples"]), (&4.into(), &(16 * 12 * 5).into()));
}

#[test]
fn statistics_have_a_place_of_their_own() {
    let run = Run::new();
    refused(&run.render(&["--stats", "a.exr", "-o", "a.exr"]), 2, "at once");
    refused(&run.render(&["--stats", "no/s.json", "-o", "a.exr"]), 4, "no folder");
    assert!(run.files().is_empty());
}
