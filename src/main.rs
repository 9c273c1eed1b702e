//! The command line program; the renderer is in the library.

mod cli;

use std::{env, process::ExitCode};

fn main() -> ExitCode {
    cli::run(env::args_os().collect()).into()
}
