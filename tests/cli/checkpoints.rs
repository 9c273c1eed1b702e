//! `--checkpoint` and `--resume`: whatever ends a render, its image is the one that nothing would have ended.

use std::{
    fs,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::{Run, code, refused, scene, stderr, triangle};

#[test]
fn a_resumed_render_is_the_uninterrupted_one() {
    let run = Run::new();
    for (integrator, options) in [
        ("path", &["--sampler", "sobol"][..]),
        ("light", &["--filter", "blackman-harris"]),
        ("bdpt", &["--transparent"]),
    ] {
        let with = |name, more: &[&str]| run.image(name, &[&["-i", integrator], options, more].concat());
        let whole = with("whole.exr", &["--spp", "7"]);
        for first in ["1", "4", "7"] {
            with("first.exr", &["--spp", first, "--checkpoint", "kept.exr", "--threads", "1"]);
            let rest = with("rest.exr", &["--spp", "7", "--resume", "kept.exr", "--checkpoint", "end.exr"]);
            assert!(rest == whole, "{integrator} resumed after {first}");
            with("rest.exr", &["--spp", "7", "--checkpoint", "uninterrupted.exr"]);
            let [end, uninterrupted] = ["end.exr", "uninterrupted.exr"].map(|name| fs::read(run.path(name)).unwrap());
            assert!(end == uninterrupted, "checkpoints are as exact as images");
        }
    }
}

#[test]
fn a_shard_is_resumed_as_an_image_is() {
    let run = Run::new();
    let common = ["-i", "bdpt", "--spp", "9"];
    let whole = run.image("whole.exr", &common);
    // The second half of eight samples is 4..8; of nine, it begins there as well.
    run.image("old.exr", &["-i", "bdpt", "--spp", "8", "--shard", "2/2"]);
    run.image("2.exr", &[&common[..], &["--shard", "2/2", "--resume", "old.exr"]].concat());
    run.image("1.exr", &[&common[..], &["--shard", "1/2"]].concat());
    let output = run.pathspace(&["merge", "2.exr", "1.exr", "-o", "merged.exr"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(whole == fs::read(run.path("merged.exr")).unwrap());
    refused(
        &run.render(&[&common[..], &["-q", "--resume", "2.exr", "-o", "no.exr"]].concat()),
        3,
        "begin with number 4",
    );
}

#[test]
fn a_checkpoint_of_something_else_is_refused() {
    let run = Run::new();
    run.image("a.exr", &["-q", "--spp", "4", "--checkpoint", "auto.exr"]);
    // A pilot that chooses another integrator because of what is other is no news.
    for (options, about) in [(["--max-depth", "5"], "max-depth"), (["--filter", "blackman-harris"], "filter")] {
        refused(&run.render(&[&["-q", "--resume", "auto.exr", "-o", "no.exr"], &options[..]].concat()), 3, about);
    }
    run.image("a.exr", &["-q", "-i", "bdpt", "--spp", "4", "--checkpoint", "kept.exr"]);
    let resume = |options: &[&str]| {
        let integrator: &[&str] = if options.contains(&"-i") { &[] } else { &["-i", "bdpt"] };
        run.render(&[&["-q", "--resume", "kept.exr", "-o", "no.exr"], integrator, options].concat())
    };
    for (options, about) in [
        (&["--seed", "1"][..], "seed is '0' there, and seed is '1' here"),
        (&["-i", "light"], "integrator"),
        (&["--sampler", "independent"], "sampler"),
        (&["--max-depth", "5"], "max-depth"),
        (&["--roulette", "off"], "roulette"),
        (&["--filter", "blackman-harris"], "filter"),
        (&["--clamp", "1"], "clamp is not given there"),
        (&["--transparent"], "background"),
        (&["--crop", "0,0,8,8"], "crop"),
        (&["--camera", "0", "--look-at", "0,1,4,0,1,0"], "--look-at"),
        (&["--env-color", "1"], "environment"),
        (&["--spp", "3"], "only 3 are wanted"),
        (&["--spp", "9", "--shard", "2/2"], "begin with number 0"),
    ] {
        let exit = if about == "--look-at" { 2 } else { 3 };
        refused(&resume(options), exit, about);
    }
    refused(&resume(&["--look-at", "0,1,4,0,1,0"]), 3, "camera");
    fs::write(run.path("t.gltf"), triangle("0.0")).unwrap();
    let small = ["render", "t.gltf", "-q", "--width", "16", "--height", "12", "-i", "bdpt"];
    let other = [&small[..], &["--resume", "kept.exr", "-o", "no.exr"]].concat();
    refused(&run.pathspace(&other), 3, "the scene has hash");
    for (name, contents) in
        [("empty.exr", &b""[..]), ("text.exr", b"hello"), ("cut.exr", &fs::read(run.path("kept.exr")).unwrap()[..2000])]
    {
        fs::write(run.path(name), contents).unwrap();
        refused(&run.render(&["-q", "--resume", name, "-o", "no.exr"]), 3, name);
    }
    refused(&run.render(&["-q", "--resume", "a.exr", "-o", "no.exr"]), 3, "a finished image");
    refused(&run.render(&["-q", "--resume", "nobody.exr", "-o", "no.exr"]), 3, "nobody.exr");
    assert!(!run.files().contains(&"no.exr".to_owned()));
}

#[test]
fn a_checkpoint_has_a_place_of_its_own() {
    let run = Run::new();
    refused(&run.render(&["--checkpoint", "kept.png", "-o", "a.png"]), 2, ".exr file");
    refused(&run.render(&["--checkpoint", "a.exr", "-o", "a.exr"]), 2, "at once");
    refused(&run.render(&["--checkpoint", "no/a.exr", "-o", "a.exr"]), 4, "no folder");
    refused(&run.render(&["--checkpoint-every", "5s", "-o", "a.exr"]), 2, "--checkpoint");
    refused(&run.render(&["--checkpoint", "k.exr", "--checkpoint-every", "0", "-o", "a.exr"]), 2, "positive");
    assert!(run.files().is_empty());
}

#[test]
fn a_render_that_is_killed_goes_on_from_its_checkpoint() {
    kill(10);
}

/// `cargo test --release --test cli -- --ignored a_hundred_kills`
#[test]
#[ignore = "the long form of the test above"]
fn a_hundred_kills() {
    kill(100);
}

/// Kills renders at `times` moments, spread over the time that one takes, with no time to clean up. The checkpoint is
/// then a whole one, or not there yet, and the render that goes on from it ends with the bytes of one that was left
/// alone. Where none of these came between the first checkpoint and the image, others follow as soon as there is a
/// checkpoint.
fn kill(times: u32) {
    /// So many moments that are chosen by what is there are enough.
    const MOST: u32 = 50;
    const SPP: &str = "48";
    let run = Run::new();
    for (integrator, times) in ["path", "light", "bdpt"].into_iter().zip([times.div_ceil(3), times / 3, times / 3]) {
        let start = Instant::now();
        let options = ["-q", "--spp", SPP, "-i", integrator, "--checkpoint-every", "1ms"];
        let whole = run.image("whole.exr", &[&options[..], &["--checkpoint", "whole-checkpoint.exr"]].concat());
        let takes = start.elapsed();
        let mut interrupted = 0;
        for i in 0..times + MOST {
            if i >= times && interrupted > 0 {
                break;
            }
            let kept = run.path("kept.exr");
            let _ = fs::remove_file(&kept);
            let killed = [&options[..], &["--checkpoint", "kept.exr", "-o", "killed.exr"]].concat();
            let mut child = start_render(&run, &killed);
            if i < times {
                thread::sleep(takes.mul_f64((f64::from(i) + 0.5) / f64::from(times)));
            } else {
                while !kept.exists() && child.try_wait().unwrap().is_none() {
                    thread::sleep(Duration::from_micros(200));
                }
            }
            child.kill().unwrap();
            child.wait().unwrap();
            interrupted += u32::from(kept.exists() && !run.path("killed.exr").exists());
            let resume = ["-q", "--spp", SPP, "-i", integrator, "--resume", "kept.exr"];
            let again = if kept.exists() { &resume[..] } else { &resume[..5] };
            assert!(whole == run.image("killed.exr", again), "{integrator}, killed {i} of {times}");
            fs::remove_file(run.path("killed.exr")).unwrap();
        }
        assert!(interrupted > 0, "{integrator}: no kill came between the first checkpoint and the image");
    }
}

/// The same render as [`Run::render`], going on in the background.
fn start_render(run: &Run, options: &[&str]) -> Child {
    let scene = scene();
    let mut command = Command::new(env!("CARGO_BIN_EXE_pathspace"));
    command.args(["render", scene.to_str().unwrap(), "--width", "16", "--height", "12"]).args(options);
    command.current_dir(run.folder.path()).stderr(Stdio::piped()).spawn().unwrap()
}

/// A disk without room: the file there stays, the render goes on, and its end says what is missing.
#[cfg(unix)]
#[test]
fn a_full_disk_keeps_the_previous_files() {
    let run = Run::new();
    let (scene, program) = (scene(), env!("CARGO_BIN_EXE_pathspace"));
    fs::write(run.path("a.exr"), "old image").unwrap();
    fs::write(run.path("kept.exr"), "old checkpoint").unwrap();
    let render = format!(
        // Files may have one block, and a write beyond is an error, as on a full disk.
        "trap '' XFSZ; ulimit -f 1; exec {program} render {} --width 32 --height 24 --spp 4 -i path \
         --checkpoint-every 1ms --checkpoint kept.exr -o a.exr",
        scene.display()
    );
    let output = Command::new("sh").args(["-c", &render]).current_dir(run.folder.path()).output().unwrap();
    let said = stderr(&output);
    assert_eq!(code(&output), 4, "{said}");
    assert!(said.contains("rendering goes on") && said.contains("error: cannot write 'kept.exr'"), "{said}");
    assert!(fs::read(run.path("a.exr")).unwrap() == b"old image");
    assert!(fs::read(run.path("kept.exr")).unwrap() == b"old checkpoint");
    assert_eq!(run.files(), ["a.exr", "kept.exr"], "nothing is left beside them");
}

#[test]
fn time_is_that_of_a_run_and_its_samples_can_be_resumed() {
    let run = Run::new();
    run.image("a.exr", &["-q", "--time", "50ms", "--checkpoint", "kept.exr"]);
    let start = Instant::now();
    run.image("b.exr", &["-q", "--time", "50ms", "--resume", "kept.exr", "--checkpoint", "kept.exr"]);
    assert!(start.elapsed() >= Duration::from_millis(25), "it does make samples");
    let output = run.pathspace(&["merge", "kept.exr", "-o", "c.exr"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(fs::read(run.path("b.exr")).unwrap() == fs::read(run.path("c.exr")).unwrap());
}
