//! Ctrl-C and SIGTERM: once, and nothing is lost; twice, and it is over.
#![cfg(unix)]

use std::{
    fs,
    io::{BufRead, BufReader},
    process::{Child, Command, Output, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::{Run, code, refused, scene, stderr};

/// More samples than anybody waits for.
const ENDLESS: &str = "1000000";

/// An endless render that has written a checkpoint, and so is in the middle of its passes.
fn endless(run: &Run, options: &[&str]) -> Child {
    begun(run, options, "started.exr")
}

/// The same, whose first checkpoint has this name.
fn begun(run: &Run, options: &[&str], first: &str) -> Child {
    let scene = scene();
    let mut command = Command::new(env!("CARGO_BIN_EXE_pathspace"));
    command
        .args(["render", scene.to_str().unwrap(), "--width", "16", "--height", "12", "--spp", ENDLESS])
        .args(options);
    command.args(["--checkpoint", "started.exr", "--checkpoint-every", "1ms"]);
    let child = command.current_dir(run.folder.path()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(|| run.path(first).exists());
    child
}

fn wait_for(mut happened: impl FnMut() -> bool) {
    let start = Instant::now();
    while !happened() {
        assert!(start.elapsed() < Duration::from_secs(30), "it does not happen");
        thread::sleep(Duration::from_millis(5));
    }
}

fn signal(process: u32, name: &str) {
    let status = Command::new("sh").args(["-c", &format!("kill -{name} {process}")]).status().unwrap();
    assert!(status.success());
}

fn number_before(text: &str, after: &str) -> u32 {
    let before = text.split(after).next().unwrap();
    before.rsplit(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap()
}

#[test]
fn one_signal_ends_with_an_image_a_checkpoint_and_the_command_that_goes_on() {
    for (name, exit, layers) in [("INT", 130, &[][..]), ("TERM", 143, &["--layers", "classes"])] {
        let run = Run::new();
        let own = [&["-i", "path"], layers].concat();
        let child = endless(&run, &[&own[..], &["-o", "a.exr"]].concat());
        signal(child.id(), name);
        let output: Output = child.wait_with_output().unwrap();
        let said = stderr(&output);
        assert_eq!(code(&output), exit, "{said}");
        let last = said.lines().last().unwrap();
        assert!(last.starts_with("interrupted; to go on: ") && last.ends_with(" --resume started.exr"), "{said}");
        let spp = number_before(said.lines().rev().nth(2).unwrap(), " spp in ");
        let (spp, more) = (spp.to_string(), (spp + 3).to_string());
        let same = run.image("b.exr", &[&own[..], &["--spp", &spp]].concat());
        assert!(same == fs::read(run.path("a.exr")).unwrap(), "the image of {spp} whole passes");
        // The command that was said goes on, here to a nearer end.
        let command = last.split_once("go on: ").unwrap().1.replace(ENDLESS, &more);
        let again = Command::new("sh").args(["-c", &command]).current_dir(run.folder.path()).output().unwrap();
        assert_eq!(code(&again), 0, "{command}: {}", stderr(&again));
        let same = run.image("b.exr", &[&own[..], &["--spp", &more]].concat());
        assert!(same == fs::read(run.path("a.exr")).unwrap(), "the image of {more} passes");
    }
}

#[test]
fn frames_go_on_by_the_command_that_is_said() {
    let run = Run::new();
    let options = ["-i", "path", "--frames", "0..1", "-o", "a.exr"];
    let child = begun(&run, &options, "started.0000.exr");
    signal(child.id(), "INT");
    let output: Output = child.wait_with_output().unwrap();
    let said = stderr(&output);
    assert_eq!(code(&output), 130, "{said}");
    let last = said.lines().last().unwrap();
    assert!(last.starts_with("interrupted; to go on: ") && last.ends_with(" --resume started.exr"), "{said}");
    assert_eq!(run.files(), ["a.0000.exr", "started.0000.exr"], "the second frame is not begun");
    let more = (number_before(said.lines().rev().nth(2).unwrap(), " spp in ") + 3).to_string();
    let command = last.split_once("go on: ").unwrap().1.replace(ENDLESS, &more);
    let again = Command::new("sh").args(["-c", &command]).current_dir(run.folder.path()).output().unwrap();
    assert_eq!(code(&again), 0, "{command}: {}", stderr(&again));
    for (seed, name) in [("0", "a.0000.exr"), ("1", "a.0001.exr")] {
        let whole = run.image("b.exr", &["-i", "path", "--spp", &more, "--seed", seed]);
        assert!(whole == fs::read(run.path(name)).unwrap(), "{name}");
    }
}

#[test]
fn a_signal_is_heard_in_the_background_of_a_script() {
    let run = Run::new();
    // A shell without job control starts what is in the background with SIGINT ignored.
    let script = format!(
        "{} render {} --width 16 --height 12 --spp {ENDLESS} --checkpoint k.exr --checkpoint-every 1ms -o a.exr & echo \
         $! > pid; \
         wait $!; echo $? > exit",
        env!("CARGO_BIN_EXE_pathspace"),
        scene().display()
    );
    let mut shell =
        Command::new("sh").args(["-c", &script]).current_dir(run.folder.path()).stderr(Stdio::null()).spawn().unwrap();
    wait_for(|| run.path("k.exr").exists());
    signal(fs::read_to_string(run.path("pid")).unwrap().trim().parse().unwrap(), "INT");
    shell.wait().unwrap();
    assert_eq!(fs::read_to_string(run.path("exit")).unwrap().trim(), "130");
    assert_eq!(run.files(), ["a.exr", "exit", "k.exr", "pid"]);
}

/// A render whose messages can be waited for.
fn talking(run: &Run, options: &[&str]) -> (Child, impl FnMut(&str)) {
    let scene = scene();
    let mut command = Command::new(env!("CARGO_BIN_EXE_pathspace"));
    command.args(["render", scene.to_str().unwrap()]).args(options).current_dir(run.folder.path());
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    (child, move |text| assert!(lines.any(|line| line.unwrap().contains(text)), "nothing about '{text}'"))
}

#[test]
fn a_page_has_what_was_measured_by_then() {
    for (name, exit) in [("INT", 130), ("TERM", 143)] {
        let run = Run::new();
        let scene = scene();
        let mut command = Command::new(env!("CARGO_BIN_EXE_pathspace"));
        let mut child = command
            .args(["converge", scene.to_str().unwrap(), "--width", "16", "--height", "12", "--time", "1h"])
            .args(["-i", "path,bdpt", "-o", "page.html"])
            .current_dir(run.folder.path())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
        assert!(lines.any(|line| line.contains("reference and path classes")), "it says how far it is");
        signal(child.id(), name);
        let rest: Vec<_> = lines.collect();
        assert_eq!(child.wait().unwrap().code(), Some(exit), "{rest:?}");
        assert!(rest.last().unwrap().contains("interrupted"), "{rest:?}");
        assert_eq!(run.files(), ["page.csv", "page.html", "page.json"]);
        let json: serde_json::Value = serde_json::from_slice(&fs::read(run.path("page.json")).unwrap()).unwrap();
        assert_eq!(json["ended_early"], true);
        assert!(json["integrators"][1]["snapshots"][0]["spp"].as_u64().unwrap() >= 1);
    }
}

#[test]
fn without_a_checkpoint_of_its_own_an_interrupted_render_makes_one() {
    let run = Run::new();
    let (mut child, mut says) = talking(&run, &["--width", "16", "--spp", ENDLESS, "-o", "a.png"]);
    says("spp, ");
    signal(child.id(), "INT");
    says("--resume a.checkpoint.exr");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(run.files(), ["a.checkpoint.exr", "a.png"]);
}

#[test]
fn an_interrupted_shard_keeps_its_checkpoint_and_makes_no_shard() {
    let run = Run::new();
    let child = endless(&run, &["--shard", "2/3", "-o", "shard.exr"]);
    signal(child.id(), "TERM");
    let output = child.wait_with_output().unwrap();
    assert_eq!(code(&output), 143, "{}", stderr(&output));
    assert_eq!(run.files(), ["started.exr"], "half a shard is none");
    refused(&run.pathspace(&["merge", "started.exr", "-q", "-o", "a.exr"]), 3, "none of the numbers 0 to");
    let partial = run.pathspace(&["merge", "started.exr", "--partial", "-o", "a.exr"]);
    assert_eq!(code(&partial), 0, "{}", stderr(&partial));
}

#[test]
fn a_second_signal_ends_at_once() {
    let run = Run::new();
    // One pass of this takes far longer than the test.
    let options = ["-v", "--width", "2000", "-o", "a.exr", "--threads", "1", "--weights", "plain"];
    let (mut child, mut says) = talking(&run, &options);
    says("rendering 2000");
    // Until the first pass has begun a signal ends it at once, too; a pilot of weights would take long.
    thread::sleep(Duration::from_secs(1));
    signal(child.id(), "INT");
    says("a second Ctrl-C");
    assert!(child.try_wait().unwrap().is_none(), "one signal waits for the end of the pass");
    let start = Instant::now();
    signal(child.id(), "INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(start.elapsed() < Duration::from_secs(5));
    assert!(run.files().is_empty());
}
