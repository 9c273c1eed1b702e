//! Files that are wrong, or legal and extreme: each is rendered, or refused with its exit code and one sentence that
//! has a place.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::{Run, code, refused, scene, stderr, triangle};

/// No broken file may take longer than this, or more memory.
const PATIENCE: Duration = Duration::from_secs(10);
const KIBIBYTES: u32 = 2 << 20;

/// Runs the command on a file, with the limits above.
fn limited(run: &Run, arguments: &[&str], file: &Path) -> Output {
    let program = env!("CARGO_BIN_EXE_pathspace");
    let mut command = Command::new(if cfg!(target_os = "linux") { "sh" } else { program });
    if cfg!(target_os = "linux") {
        command.args(["-c", &format!("ulimit -v {KIBIBYTES}; exec \"$0\" \"$@\""), program]);
    }
    let mut child = command
        .args(arguments)
        .arg(file)
        .current_dir(run.folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{} hangs", file.display());
        }
        thread::sleep(Duration::from_millis(1));
    }
    child.wait_with_output().unwrap()
}

/// What `info` and `render` make of a file; their exit codes are 0 or 3, and a refusal is one sentence.
fn judge(run: &Run, file: &Path) -> [Output; 2] {
    let render = ["render", "--width", "8", "--height", "8", "--spp", "1", "--threads", "2", "-q", "-o", "a.exr"];
    [&["info"][..], &render].map(|arguments| one(run, arguments, file))
}

/// What `render` makes of a file's animations.
fn posed(run: &Run, file: &Path) -> Output {
    let small = ["--width", "8", "--height", "8", "--spp", "1", "--threads", "2", "-q", "-o", "a.exr"];
    one(run, &[&["render", "--at", "0.5"], &small[..]].concat(), file)
}

fn one(run: &Run, arguments: &[&str], file: &Path) -> Output {
    let output = limited(run, arguments, file);
    let (said, name) = (stderr(&output), file.display());
    match output.status.code() {
        Some(0) => assert!(said.is_empty(), "{name}: {said}"),
        Some(3) => {
            let one = said.starts_with("error: ") && said.ends_with('\n') && said.trim_end().lines().count() == 1;
            assert!(one && !said.trim_end().contains(char::is_control), "{name}: no sentence: {said:?}");
            let place = [", /", ", byte ", ", line ", "cannot read "].iter().any(|place| said.contains(place));
            assert!(place, "{name}: where? {said}");
        }
        other => panic!("{name}: {arguments:?} ends with {other:?}: {said}"),
    }
    output
}

#[test]
fn every_malformed_file_of_ours_ends_as_documented() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/malformed");
    let table = fs::read_to_string(folder.join("expected.tsv")).unwrap();
    let run = Run::new();
    let mut listed = BTreeSet::new();
    for line in table.lines().filter(|line| !line.starts_with('#')) {
        let [file, exit, about] = line.split('\t').collect::<Vec<_>>()[..] else { panic!("three columns: {line}") };
        let path = folder.join(file);
        // Nobody sees what is wrong with an animation that is not played.
        let rest = if file.starts_with("animation-") { Vec::new() } else { judge(&run, &path).to_vec() };
        for output in rest.into_iter().chain([posed(&run, &path)]) {
            let said = stderr(&output);
            assert_eq!(code(&output).to_string(), exit, "{file}: {said}");
            assert!(said.contains(about), "{file}: nothing about '{about}': {said}");
        }
        listed.insert(file.to_owned());
    }
    let names = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let there: BTreeSet<_> = names.filter(|name| name != "README.md" && name != "expected.tsv").collect();
    assert_eq!(listed, there, "the table has every file");
    assert!(listed.len() > 80);
}

#[test]
fn every_malformed_file_of_others_is_rendered_or_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/public/malformed");
    let mut files = Vec::new();
    collect(&folder, &mut files);
    if files.is_empty() {
        #[expect(clippy::print_stderr, reason = "what a test could not look at must be said")]
        {
            eprintln!("NOT TESTED: there are no files in {}", folder.display());
        }
        return;
    }
    let run = Run::new();
    let mut refusals = 0;
    for file in &files {
        let [info, _] = judge(&run, file);
        posed(&run, file);
        refusals += usize::from(code(&info) == 3);
        // The reports are those of Khronos' validator, which knows what is legal.
        let report = fs::read(format!("{}.report.json", file.display())).ok();
        let report: Option<serde_json::Value> = report.map(|bytes| serde_json::from_slice(&bytes).unwrap());
        if report.is_some_and(|report| report["issues"]["numErrors"] == 0) {
            assert_eq!(code(&info), 0, "{} is legal: {}", file.display(), stderr(&info));
        }
    }
    assert!(refusals > files.len() / 3, "{refusals} of {} are refused", files.len());
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
            files.push(path);
        }
    }
}

/// Every byte of a shard's header, changed; whatever it announces then. What is changed where nothing is checked does
/// no harm.
#[test]
fn shards_that_are_wrong_are_merged_and_resumed_to_the_same_bytes_or_refused() {
    let run = Run::new();
    let own = ["--spp", "4", "-i", "path", "--layers", "bounces", "--max-depth", "3"];
    let whole = run.image("whole.exr", &own);
    run.image("1.exr", &[&own[..], &["--shard", "1/2"]].concat());
    let other = run.image("2.exr", &[&own[..], &["--shard", "2/2"]].concat());
    // Behind it are the sums of the image and three layers.
    let header = other.len() - 16 * 12 * 4 * 48;
    let scene = scene();
    let resume = ["--width", "16", "--height", "12", "-q", "--shard", "1/2", "-o", "b.exr", "--resume", "bad.exr"];
    let mut refusals = 0;
    for (i, place) in (0..header).step_by(13).enumerate() {
        let mut bytes = other.clone();
        bytes[place] ^= [0x01, 0x80, 0xff][i % 3];
        fs::write(run.path("bad.exr"), bytes).unwrap();
        let merge = ["merge", "-q", "-o", "a.exr", "1.exr"];
        let merged = limited(&run, &merge, Path::new("bad.exr"));
        let resumed = limited(&run, &[&["render"], &own[..], &resume].concat(), &scene);
        assert!(matches!(resumed.status.code(), Some(2 | 3)), "byte {place}: the samples 2 to 3 are those of 2/2");
        for output in [&merged, &resumed] {
            let said = stderr(output);
            match output.status.code() {
                Some(0) => {
                    assert!(said.is_empty() && fs::read(run.path("a.exr")).unwrap() == whole, "byte {place}: {said}");
                }
                Some(2 | 3) => {
                    let one = said.starts_with("error: ") && said.trim_end().lines().count() == 1;
                    assert!(one && !said.trim_end().contains(char::is_control), "byte {place}: {said:?}");
                    refusals += 1;
                }
                other => panic!("byte {place} ends with {other:?}: {said}"),
            }
        }
    }
    assert!(refusals > 300, "{refusals}");
}

#[test]
fn limits_are_where_they_are_set() {
    let run = Run::new();
    fs::write(run.path("t.gltf"), triangle("0.0")).unwrap();
    let child =
        triangle("0.0").replace("\"nodes\": [{ \"mesh\": 0 }]", "\"nodes\": [{ \"children\": [1] }, { \"mesh\": 0 }]");
    fs::write(run.path("child.gltf"), child).unwrap();
    for (file, below, enough, place) in [
        ("t.gltf", "file-bytes=100", "file-bytes=1M", "cannot read"),
        ("t.gltf", "vertices=2", "vertices=3", "/accessors/0/count"),
        ("child.gltf", "depth=1", "depth=2", "/nodes/1"),
        (scene().to_str().unwrap(), "triangles=3", "triangles=1K", "/nodes/"),
        (scene().to_str().unwrap(), "instances=1", "instances=100", "/nodes/"),
    ] {
        let name = below.split('=').next().unwrap();
        let output = run.pathspace(&["info", file, "--limit", below]);
        refused(&output, 3, place);
        assert!(stderr(&output).contains(&format!("--limit {name}=N")), "{}", stderr(&output));
        let output = run.pathspace(&["info", file, "--limit", below, "--limit", enough]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
    }
    let scenes = scene().parent().unwrap().to_owned();
    let textured = scenes.join("textured-room.glb");
    refused(&run.pathspace(&["info", textured.to_str().unwrap(), "--limit", "texels=9"]), 3, "/images/");
    let sky = scenes.join("outdoor-sky.hdr");
    refused(
        &run.render(&["-q", "--env", sky.to_str().unwrap(), "--limit", "environment-texels=9"]),
        3,
        "outdoor-sky.hdr",
    );
    refused(&run.render(&["--limit", "height=9"]), 2, "environment-texels");
    refused(&run.render(&["--limit", "texels"]), 2, "environment-texels");
}

#[test]
fn a_model_reads_no_files_but_its_own() {
    let run = Run::new();
    let (head, tail) = (triangle("0.0"), r#"" }] }"#);
    let data = head.split_once("data:").unwrap().1.split_once('"').unwrap().0.to_owned();
    let bytes: Vec<u8> = data.split('%').skip(1).map(|byte| u8::from_str_radix(&byte[..2], 16).unwrap()).collect();
    let pointing = |uri: &str| format!("{}{uri}{tail}", head.split_once("data:").unwrap().0);
    fs::create_dir_all(run.path("model/below")).unwrap();
    fs::write(run.path("secret.bin"), &bytes).unwrap();
    fs::write(run.path("model/below/own.bin"), &bytes).unwrap();
    let outside = run.path("secret.bin");
    let info = |uri: &str, options: &[&str]| {
        fs::write(run.path("model/a.gltf"), pointing(uri)).unwrap();
        run.pathspace(&[&["info", "model/a.gltf"], options].concat())
    };
    assert_eq!(code(&info("below/own.bin", &[])), 0);
    assert_eq!(code(&info("./below/own.bin", &[])), 0);
    for uri in ["../secret.bin", "below/../../secret.bin", "%2e%2e/secret.bin", outside.to_str().unwrap()] {
        refused(&info(uri, &[]), 3, "leads out of the model's folder");
        let allowed = info(uri, &["--allow-outside"]);
        assert_eq!(code(&allowed), 0, "{uri}: {}", stderr(&allowed));
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&outside, run.path("model/link.bin")).unwrap();
        refused(&info("link.bin", &[]), 3, "leads out of the model's folder");
        assert_eq!(code(&info("link.bin", &["--allow-outside"])), 0);
        std::os::unix::fs::symlink("below/own.bin", run.path("model/inner.bin")).unwrap();
        assert_eq!(code(&info("inner.bin", &[])), 0, "a link that stays inside");
    }
}
