//! Tests the tests: plants one mistake after the other and says which test noticed.
//!
//! `cargo run --release --example mistakes -- [NAME…|--all|--ci|--list]`
//!
//! `tests/mistakes.toml` lists them. This copies the project to `target/mistakes`, puts a switch at each place, builds
//! what the tests need once, checks that they are green with every switch off, and then turns on one mistake after the
//! other. The exit code is 1 if one was missed. `--ci` tries those that tests of the library see, which takes little
//! more than one build.

#![allow(clippy::print_stdout, clippy::print_stderr)] // a program of its own, which talks to the terminal

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs, io,
    ops::Range,
    path::{Path, PathBuf},
    process::{Command, ExitCode, Stdio},
    time::Instant,
};

use serde::Deserialize;

const USAGE: &str = "usage: mistakes [NAME…|--all|--ci|--list]";
/// The variable by which the copy's programs know the mistake's number.
const VARIABLE: &str = "PATHSPACE_MISTAKE";
/// In this time `pathspace verify` has to find what it suspects, and to confirm it.
const VERIFY_TIME: &str = "20s";
/// What is asked at every switch.
const SWITCH: &str = r#"
/// Whether the planted mistake of this number is turned on.
#[doc(hidden)]
#[inline]
#[allow(missing_docs)]
pub fn is_planted(number: usize) -> bool {
    static CHOSEN: std::sync::LazyLock<Option<usize>> =
        std::sync::LazyLock::new(|| std::env::var("PATHSPACE_MISTAKE").ok()?.parse().ok());
    *CHOSEN == Some(number)
}
"#;

#[derive(Deserialize)]
struct List {
    mistake: Vec<Mistake>,
}

#[derive(Deserialize)]
struct Mistake {
    name: String,
    what: String,
    tests: Vec<Test>,
    at: Vec<Place>,
}

#[derive(Deserialize)]
struct Place {
    file: String,
    right: String,
    wrong: String,
}

/// A test: in the library's own or in `tests/transport`, or what a person does who distrusts the renderer on a scene.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(try_from = "String")]
enum Test {
    Lib(String),
    Transport(String),
    /// `pathspace verify` of a scene, which has to end with exit code 1.
    Verify(String),
}

impl TryFrom<String> for Test {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match text.split_once(' ') {
            Some(("lib", name)) => Ok(Self::Lib(name.to_owned())),
            Some(("transport", name)) => Ok(Self::Transport(name.to_owned())),
            Some(("verify", scene)) => Ok(Self::Verify(scene.to_owned())),
            _ => Err(format!("'{text}' is none of 'lib NAME', 'transport NAME' and 'verify SCENE'")),
        }
    }
}

impl Test {
    fn name(&self) -> String {
        match self {
            Self::Lib(name) => name.clone(),
            Self::Transport(name) => format!("transport {name}"),
            Self::Verify(scene) => format!("pathspace verify {scene}"),
        }
    }
}

fn main() -> ExitCode {
    match run() {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Tries the mistakes that the arguments name; returns how many were missed.
fn run() -> Result<usize, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = fs::read_to_string(root.join("tests/mistakes.toml")).map_err(|e| format!("tests/mistakes.toml: {e}"))?;
    let List { mistake: all } = toml::from_str(&list).map_err(|e| format!("tests/mistakes.toml: {e}"))?;
    let Some(wanted) = wanted(&all, env::args().skip(1))? else {
        all.iter().for_each(|m| println!("{:24} {}", m.name, m.what));
        return Ok(0);
    };
    let start = Instant::now();
    let tree = root.join("target/mistakes");
    let planted = plant(&all, root)?;
    copy(root, &tree, Path::new(""), &planted).map_err(|e| format!("cannot copy to {}: {e}", tree.display()))?;
    let tests: BTreeSet<&Test> = wanted.iter().flat_map(|&number| &all[number].tests).collect();
    let built = Built::new(&tree, &root.join("target"), &tests)?;
    // Cargo takes what was built from the copy for builds of the project itself: it is to find them out of date.
    touch(&tree.join("src/lib.rs")).map_err(|e| format!("src/lib.rs of the copy: {e}"))?;
    eprintln!("built in {:.0} s", start.elapsed().as_secs_f32());
    for test in tests {
        if built.outcome(test, None)? == Outcome::Red {
            return Err(format!("{} fails without any mistake", test.name()));
        }
    }
    eprintln!("green without a mistake after {:.0} s", start.elapsed().as_secs_f32());
    let mut missed = 0;
    for &number in &wanted {
        let began = Instant::now();
        let mut by = None;
        for test in &all[number].tests {
            if built.outcome(test, Some(number))? == Outcome::Red {
                by = Some(test.name());
                break;
            }
        }
        missed += usize::from(by.is_none());
        let by = by.unwrap_or_else(|| "missed".to_owned());
        println!("{:24} {:6.1} s  {by}", all[number].name, began.elapsed().as_secs_f32());
    }
    eprintln!("{} mistakes, {missed} missed, in {:.0} s", wanted.len(), start.elapsed().as_secs_f32());
    Ok(missed)
}

/// The numbers of the mistakes that the arguments name; `None` for a list of all.
fn wanted(all: &[Mistake], arguments: impl Iterator<Item = String>) -> Result<Option<Vec<usize>>, String> {
    let is_quick = |m: &Mistake| m.tests.iter().all(|test| matches!(test, Test::Lib(_)));
    let mut wanted = Vec::new();
    for argument in arguments {
        match argument.as_str() {
            "--list" => return Ok(None),
            "--all" => wanted.extend(0..all.len()),
            "--ci" => wanted.extend((0..all.len()).filter(|&number| is_quick(&all[number]))),
            flag if flag.starts_with("--") => return Err(format!("there is no option '{flag}'; {USAGE}")),
            name => match all.iter().position(|m| m.name == name) {
                Some(number) => wanted.push(number),
                None => return Err(format!("there is no mistake '{name}'; --list names them all")),
            },
        }
    }
    Ok(Some(if wanted.is_empty() { (0..all.len()).collect() } else { wanted }))
}

/// The sources with a switch at each place of each mistake, by their paths in the project.
fn plant(all: &[Mistake], root: &Path) -> Result<BTreeMap<PathBuf, String>, String> {
    let mut switches: BTreeMap<&str, Vec<(Range<usize>, String)>> = BTreeMap::new();
    let read = |file: &str| fs::read_to_string(root.join(file)).map_err(|e| format!("{file}: {e}"));
    for (number, mistake) in all.iter().enumerate() {
        for place in &mistake.at {
            let (range, right) = place.find(&read(&place.file)?).map_err(|e| format!("{}: {e}", mistake.name))?;
            let switch = format!("(if crate::is_planted({number}) {{ {} }} else {{ {right} }})", place.wrong);
            switches.entry(&place.file).or_default().push((range, switch));
        }
    }
    let lib = format!("#![allow(warnings)]\n{}{SWITCH}", read("src/lib.rs")?);
    let mut planted = BTreeMap::from([(PathBuf::from("src/lib.rs"), lib)]);
    for (file, mut switches) in switches {
        let mut text = planted.remove(Path::new(file)).map_or_else(|| read(file), Ok)?;
        switches.sort_by_key(|(range, _)| range.start);
        if let Some(pair) = switches.windows(2).find(|pair| pair[0].0.end > pair[1].0.start) {
            return Err(format!("{file}: two mistakes are at one place: {} and {}", pair[0].1, pair[1].1));
        }
        // From the end, so that places stay where they are.
        switches.into_iter().rev().for_each(|(range, switch)| text.replace_range(range, &switch));
        planted.insert(file.into(), text);
    }
    Ok(planted)
}

impl Place {
    /// Where in the text of the file the expression is that goes wrong, and what it is.
    fn find<'a>(&'a self, text: &str) -> Result<(Range<usize>, &'a str), String> {
        let Self { file, right, .. } = self;
        let marked = right.split_once('«').and_then(|(before, rest)| Some((before, rest.split_once('»')?)));
        let (before, (inner, after)) = marked.ok_or(format!("'{right}' has no expression between « and »"))?;
        let found: Vec<_> = text.match_indices(&format!("{before}{inner}{after}")).map(|(at, _)| at).collect();
        match found[..] {
            [at] => Ok((at + before.len()..at + before.len() + inner.len(), inner)),
            _ => Err(format!("{file} has '{right}' {} times, not once", found.len())),
        }
    }
}

/// Writes a file as it is.
fn touch(file: &Path) -> io::Result<()> {
    fs::write(file, fs::read(file)?)
}

/// Makes `tree` a copy of the project with these files instead of its own. What stays the same is not written, so that
/// nothing is built twice.
fn copy(root: &Path, tree: &Path, folder: &Path, instead: &BTreeMap<PathBuf, String>) -> io::Result<()> {
    let is_left_out = |path: &Path| ["target", ".git", "fuzz"].map(Path::new).contains(&path);
    fs::create_dir_all(tree.join(folder))?;
    let mut kept = BTreeSet::new();
    for entry in fs::read_dir(root.join(folder))? {
        let entry = entry?;
        let path = folder.join(entry.file_name());
        if is_left_out(&path) {
            continue;
        }
        kept.insert(entry.file_name());
        if entry.path().is_dir() {
            copy(root, tree, &path, instead)?;
            continue;
        }
        let contents =
            instead.get(&path).map_or_else(|| fs::read(entry.path()), |text| Ok(text.clone().into_bytes()))?;
        if fs::read(tree.join(&path)).ok().as_ref() != Some(&contents) {
            fs::write(tree.join(&path), contents)?;
        }
    }
    for entry in fs::read_dir(tree.join(folder))? {
        let entry = entry?;
        if kept.contains(&entry.file_name()) {
            continue;
        }
        if entry.path().is_dir() { fs::remove_dir_all(entry.path())? } else { fs::remove_file(entry.path())? }
    }
    Ok(())
}

/// The executables of one build.
struct Built {
    tree: PathBuf,
    lib: Option<PathBuf>,
    transport: Option<PathBuf>,
    program: Option<PathBuf>,
}

#[derive(PartialEq, Eq)]
enum Outcome {
    Green,
    Red,
}

impl Built {
    /// Builds what the tests need, with the project's own dependencies.
    fn new(tree: &Path, target: &Path, tests: &BTreeSet<&Test>) -> Result<Self, String> {
        let needs = |wanted: fn(&Test) -> bool| tests.iter().any(|test| wanted(test));
        let lib = needs(|test| matches!(test, Test::Lib(_)));
        // Cargo builds the program for the tests beside the library.
        let beside = needs(|test| !matches!(test, Test::Lib(_)));
        let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        command.current_dir(tree).args(["test", "--release", "--locked", "--no-run"]);
        command.arg("--target-dir").arg(target).args(["--message-format", "json-render-diagnostics"]);
        command.args(lib.then_some("--lib")).args(beside.then_some(["--test", "transport"]).into_iter().flatten());
        let output = command.stderr(Stdio::inherit()).output().map_err(|e| format!("cargo cannot be run: {e}"))?;
        if !output.status.success() {
            return Err("the tests cannot be built with the mistakes planted".to_owned());
        }
        let lines = String::from_utf8_lossy(&output.stdout);
        let messages: Vec<serde_json::Value> = lines.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
        let executable = |name: &str, kind: &str, is_test: bool| {
            let is_wanted = |m: &&serde_json::Value| {
                let target = &m["target"];
                target["name"] == name && target["kind"][0] == kind && m["profile"]["test"] == is_test
            };
            messages.iter().filter(is_wanted).find_map(|m| m["executable"].as_str()).map(PathBuf::from)
        };
        Ok(Self {
            tree: tree.to_owned(),
            lib: executable("pathspace", "lib", true),
            transport: executable("transport", "test", true),
            program: executable("pathspace", "bin", false),
        })
    }

    /// Runs one test with a mistake, or without any.
    fn outcome(&self, test: &Test, mistake: Option<usize>) -> Result<Outcome, String> {
        // What `verify` writes is of no interest.
        let folder = tempfile::tempdir().map_err(|e| format!("there is no temporary folder: {e}"))?;
        let program = match test {
            Test::Lib(_) => &self.lib,
            Test::Transport(_) => &self.transport,
            Test::Verify(_) => &self.program,
        };
        let mut command = Command::new(program.as_ref().ok_or_else(|| format!("cargo has not built {}", test.name()))?);
        match test {
            Test::Lib(filter) | Test::Transport(filter) => command.arg(filter),
            Test::Verify(scene) => command.args(["verify", scene, "--time", VERIFY_TIME, "-o"]).arg(folder.path()),
        };
        command.current_dir(&self.tree).env_remove(VARIABLE);
        if let Some(number) = mistake {
            command.env(VARIABLE, number.to_string());
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
}
