//! The command line: options in, images and exit codes out.
//!
//! Two crates compile these modules: the program, and the Python package in `python/`, which renders by the same
//! options and carries the program.

mod compare;
pub mod converge;
mod denoise;
pub mod info;
mod merge;
pub mod render;
pub mod shared;
mod trace;
pub mod verify;

use std::{
    ffi::OsString,
    panic::{self, PanicHookInfo},
    sync::{Once, OnceLock},
};

use clap::{Parser, Subcommand, error::ErrorKind};

use self::shared::{
    exit::{Exit, Failure},
    terminal,
};

/// Renders glTF scenes by path, light and bidirectional path tracing over one path-space core.
#[derive(Debug, Parser)]
#[command(name = "pathspace", version, after_help = Exit::help(), max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to image files
    #[command(after_help = Exit::help())]
    Render(Box<render::args::RenderArgs>),
    /// Put the shards of a render together: exactly the image that one render would have made
    #[command(after_help = Exit::help())]
    Merge(merge::MergeArgs),
    /// Take the noise out of an image with Open Image Denoise: to look at, as the result is biased
    #[command(after_help = Exit::help())]
    Denoise(denoise::DenoiseArgs),
    /// Check that the integrators agree on a scene, and say what each of them cannot see
    #[command(after_help = Exit::help())]
    Verify(Box<verify::VerifyArgs>),
    /// Say how far an image is from another, or two from a reference
    #[command(after_help = Exit::help())]
    Compare(compare::CompareArgs),
    /// Measure how fast integrators converge on a scene, as a page to look at
    #[command(after_help = Exit::help())]
    Converge(Box<converge::ConvergeArgs>),
    /// Explain a pixel: the paths that make it as bright as it is, and which technique finds them best
    #[command(after_help = Exit::help())]
    Trace(Box<trace::TraceArgs>),
    /// Say what a scene file holds: geometry, cameras, materials, lights, warnings
    #[command(after_help = Exit::help())]
    Info(info::InfoArgs),
}

/// The words of the command that is running; where the program is a part of another process, the process has others.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// The program's name and its arguments.
pub fn words() -> &'static [OsString] {
    WORDS.get().map_or(&[], Vec::as_slice)
}

/// Runs the program with these words, its name first; every error has been said when it returns.
pub fn run(words: Vec<OsString>) -> Exit {
    panic::set_hook(Box::new(ask_for_a_report));
    let words = WORDS.get_or_init(|| words);
    guarded(|| match Cli::try_parse_from(words) {
        Ok(cli) => match dispatch(&cli.command) {
            Ok(exit) => exit,
            Err(failure) => {
                terminal::error(&failure.sentence);
                failure.exit
            }
        },
        Err(error) => explain_usage(&error),
    })
}

fn dispatch(command: &Command) -> Result<Exit, Failure> {
    match command {
        Command::Render(args) => render::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Denoise(args) => denoise::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Converge(args) => converge::run(args),
        Command::Trace(args) => trace::run(args),
        Command::Info(args) => info::run(args).map(|()| Exit::Done),
    }
}

/// Says what is wrong with the arguments in one sentence, or shows the help that was asked for.
fn explain_usage(error: &clap::Error) -> Exit {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // As with every answer, a closed pipe is no failure.
            let _ = error.print();
            Exit::Done
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            Exit::Usage
        }
        _ => {
            terminal::error(one_sentence(&error.render().to_string()));
            Exit::Usage
        }
    }
}

/// The first paragraph of clap's message, on one line and without its prefix.
pub fn one_sentence(message: &str) -> String {
    let paragraph = message.split("\n\n").next().unwrap_or_default();
    let line = paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
    format!("{} (see 'pathspace --help')", line.trim_start_matches("error: "))
}

/// Turns a panic, which is always a bug of ours, into its exit code.
fn guarded(program: impl FnOnce() -> Exit + panic::UnwindSafe) -> Exit {
    panic::catch_unwind(program).unwrap_or(Exit::Bug)
}

/// What a panic says instead of a stack trace.
fn ask_for_a_report(panic: &PanicHookInfo<'_>) {
    // Several threads may meet the same bug.
    static ASKED: Once = Once::new();
    ASKED.call_once(|| {
        let payload = panic.payload();
        let literal = payload.downcast_ref::<&str>().copied();
        let what = literal.or(payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message");
        let what = what.replace('\n', " ");
        let place = panic.location().map(|l| format!(" at {}:{}", l.file(), l.line())).unwrap_or_default();
        terminal::error(format_args!(
            "this is a bug in pathspace ({what}{place}); please report it together with the command and the scene"
        ));
    });
}

#[cfg(test)]
mod tests {
    use std::env;

    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_options_are_consistent() {
        Cli::command().debug_assert();
    }

    /// What `--help` prints, command by command.
    fn reference() -> String {
        let mut page =
            "# Options\n\nWhat `pathspace COMMAND --help` prints. A test keeps this page current, and writes it with\n\
            `PATHSPACE_WRITE_DOCS=1 cargo test --release reference`.\n"
                .to_owned();
        let mut program = Cli::command().term_width(100).after_help("");
        program.build();
        for command in program.get_subcommands_mut().filter(|command| command.get_name() != "help") {
            let name = command.get_name().to_owned();
            let help = command.clone().term_width(100).after_help("").render_long_help().to_string();
            let lines: Vec<_> = help.trim_end().lines().map(str::trim_end).collect();
            page += &format!("\n## `pathspace {name}`\n\n```text\n{}\n```\n", lines.join("\n"));
        }
        page + "\nExit codes, of every command: [scripting](scripting.md).\n"
    }

    #[test]
    fn the_reference_of_options_is_current() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/options.md");
        if env::var_os("PATHSPACE_WRITE_DOCS").is_some() {
            std::fs::write(&path, reference()).expect("a page to write");
        }
        assert_eq!(std::fs::read_to_string(path).unwrap_or_default(), reference());
    }

    #[test]
    fn usage_errors_become_one_sentence() {
        for arguments in [&["pathspace", "paint"][..], &["pathspace", "render"], &["pathspace", "info", "--nonsense"]] {
            let error = Cli::try_parse_from(arguments).unwrap_err();
            let sentence = one_sentence(&error.render().to_string());
            assert!(!sentence.contains('\n') && !sentence.starts_with("error"), "{sentence}");
        }
    }

    #[test]
    fn a_panic_ends_in_its_own_exit_code() {
        assert_eq!(guarded(|| panic!("planted")), Exit::Bug);
    }
}
