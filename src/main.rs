//! The command line program; the renderer is in the library.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(feature = "mistakes")]
    #[allow(clippy::print_stderr)] // a build for testing the tests says so before anything else
    if let Err(unknown) = pathspace::mistake::check() {
        eprintln!("error: {unknown}");
        return ExitCode::from(2);
    }
    cli::run().into()
}
