//! Tests the tests: plants one mistake after the other and says which test noticed.
//!
//! `cargo run --release --example mistakes -- [NAME…|--all|--ci|--list] [--markdown]`
//!
//! Builds the program, the library's tests and `tests/transport` once with the feature `mistakes`, in a target folder of their own,
//! checks that the tests of the table are green, and then runs each mistake's. The exit code is 1 if a mistake was missed.

#![allow(clippy::print_stdout, clippy::print_stderr)] // a program of its own, which talks to the terminal

#[path = "../src/mistake/list.rs"]
mod list;
#[path = "mistakes/table.rs"]
mod table;

use std::{
    env,
    path::PathBuf,
    process::{Command, ExitCode, Stdio},
    time::Instant,
};

use list::Mistake;
use table::{Test, killers};

const USAGE: &str = "usage: mistakes [NAME…|--all|--ci|--list] [--markdown]";

/// What a run in CI tries: one of each floor and kind, most by tests that take less than a second.
fn in_ci(mistake: Mistake) -> bool {
    killers(mistake).iter().all(|test| matches!(test, Test::Lib(_)))
        || matches!(mistake, Mistake::NoShadingFactor | Mistake::LightsTwice | Mistake::CropShiftsNumbers)
}

/// In this time `pathspace verify` has to find what it suspects, and to confirm it.
const VERIFY_TIME: &str = "20s";

/// The executables of one build.
struct Built {
    lib: PathBuf,
    transport: PathBuf,
    program: PathBuf,
}

fn main() -> ExitCode {
    let (flags, names): (Vec<String>, Vec<String>) = env::args().skip(1).partition(|a| a.starts_with("--"));
    let has = |flag: &str| flags.iter().any(|f| f == flag);
    if let Some(odd) = flags.iter().find(|f| !["--all", "--ci", "--list", "--markdown"].contains(&f.as_str())) {
        return refuse(&format!("there is no option '{odd}'; {USAGE}"));
    }
    if has("--list") {
        Mistake::ALL.iter().for_each(|m| println!("{:24} {}", m.name(), m.what()));
        return ExitCode::SUCCESS;
    }
    let mut wanted = Vec::new();
    for name in &names {
        match Mistake::named(name) {
            Some(mistake) => wanted.push(mistake),
            None => return refuse(&format!("there is no mistake '{name}'; --list names them all")),
        }
    }
    if has("--ci") {
        wanted.extend(Mistake::ALL.iter().copied().filter(|m| in_ci(*m)));
    } else if wanted.is_empty() {
        wanted.extend(Mistake::ALL);
    }
    match run(&wanted, has("--markdown")) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => refuse(&error),
    }
}

/// The line of a mistake in TESTING.md.
fn line(mistake: Mistake, by: &str) -> String {
    format!("| `{}`: {} | `{by}` |", mistake.name(), mistake.what())
}

/// Holds the list in TESTING.md to the table.
fn check_list() -> Result<(), String> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("TESTING.md");
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{} cannot be read: {e}", path.display()))?;
    let listed = |m: &Mistake| killers(*m).iter().any(|test| text.contains(&line(*m, &test.name())));
    match Mistake::ALL.iter().find(|m| !listed(m)) {
        Some(mistake) => {
            Err(format!("TESTING.md does not list {} with its test; --markdown prints the list", mistake.name()))
        }
        None => Ok(()),
    }
}

fn refuse(what: &str) -> ExitCode {
    eprintln!("error: {what}");
    ExitCode::from(2)
}

/// Tries the mistakes; returns how many were missed.
fn run(wanted: &[Mistake], markdown: bool) -> Result<usize, String> {
    if !markdown {
        check_list()?;
    }
    let start = Instant::now();
    let built = build()?;
    eprintln!("built in {:.0} s", start.elapsed().as_secs_f32());
    let mut tests = Vec::new();
    for test in wanted.iter().flat_map(|m| killers(*m)) {
        if !tests.contains(test) {
            tests.push(*test);
        }
    }
    for test in tests {
        if outcome(&built, test, None)? == Outcome::Red {
            return Err(format!("{} fails without any mistake", test.name()));
        }
    }
    eprintln!("green without a mistake after {:.0} s", start.elapsed().as_secs_f32());
    if markdown {
        println!("| mistake | caught by |\n|---|---|");
    }
    let mut missed = 0;
    for mistake in wanted {
        let began = Instant::now();
        let mut by = None;
        for test in killers(*mistake) {
            if outcome(&built, *test, Some(*mistake))? == Outcome::Red {
                by = Some(test.name());
                break;
            }
        }
        missed += usize::from(by.is_none());
        let by = by.unwrap_or_else(|| "missed".to_owned());
        if markdown {
            println!("{}", line(*mistake, &by));
        } else {
            println!("{:24} {:6.1} s  {by}", mistake.name(), began.elapsed().as_secs_f32());
        }
    }
    eprintln!("{} mistakes, {missed} missed, in {:.0} s", wanted.len(), start.elapsed().as_secs_f32());
    Ok(missed)
}

/// Builds the tests with the feature, where ordinary builds do not see it.
fn build() -> Result<Built, String> {
    let root = env!("CARGO_MANIFEST_DIR");
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.current_dir(root).args(["test", "--release", "--locked", "--features", "mistakes", "--no-run"]);
    command.args(["--lib", "--test", "transport", "--target-dir", "target/mistakes"]);
    command.args(["--message-format", "json-render-diagnostics"]).stderr(Stdio::inherit());
    let output = command.output().map_err(|e| format!("cargo cannot be run: {e}"))?;
    if !output.status.success() {
        return Err("the tests cannot be built".to_owned());
    }
    let messages: Vec<serde_json::Value> =
        String::from_utf8_lossy(&output.stdout).lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let executable = |name: &str, kind: &str, test: bool| {
        let is_wanted = |m: &&serde_json::Value| {
            let target = &m["target"];
            target["name"] == name && target["kind"][0] == kind && m["profile"]["test"] == test
        };
        let path = messages.iter().filter(is_wanted).find_map(|m| m["executable"].as_str());
        path.map(PathBuf::from).ok_or_else(|| format!("cargo names no executable of the {kind} {name}"))
    };
    Ok(Built {
        lib: executable("pathspace", "lib", true)?,
        transport: executable("transport", "test", true)?,
        program: executable("pathspace", "bin", false)?,
    })
}

#[derive(PartialEq, Eq)]
enum Outcome {
    Green,
    Red,
}

/// Runs one test with a mistake, or without any.
fn outcome(built: &Built, test: Test, mistake: Option<Mistake>) -> Result<Outcome, String> {
    // What `verify` writes is of no interest.
    let folder = tempfile::tempdir().map_err(|e| format!("there is no temporary folder: {e}"))?;
    let mut command = match test {
        Test::Lib(_) => Command::new(&built.lib),
        Test::Transport(_) => Command::new(&built.transport),
        Test::Verify(_) => Command::new(&built.program),
    };
    match test {
        Test::Lib(filter) | Test::Transport(filter) => command.arg(filter),
        Test::Verify(scene) => command.args(["verify", scene, "--time", VERIFY_TIME, "-o"]).arg(folder.path()),
    };
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env_remove("PATHSPACE_MISTAKE");
    if let Some(mistake) = mistake {
        command.env("PATHSPACE_MISTAKE", mistake.name());
    }
    let output = command.output().map_err(|e| format!("{} cannot be run: {e}", test.name()))?;
    if let Test::Verify(_) = test {
        // Too noisy to say (5) is no finding.
        return match output.status.code() {
            Some(1) => Ok(Outcome::Red),
            Some(0 | 5) => Ok(Outcome::Green),
            _ => Err(format!("{} fails: {}", test.name(), String::from_utf8_lossy(&output.stderr))),
        };
    }
    // A filter that matches nothing is green, and would catch nothing ever after.
    if String::from_utf8_lossy(&output.stdout).contains("running 0 tests") {
        return Err(format!("there is no test {}", test.name()));
    }
    Ok(if output.status.success() { Outcome::Green } else { Outcome::Red })
}
