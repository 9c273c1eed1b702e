//! `--checkpoint`: the render so far, in a file from which it can go on.

use std::{
    cell::Cell,
    collections::BTreeMap,
    ffi::{OsStr, OsString},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use pathspace::{
    film::{Format, check_writable, write_atomically},
    render::Renderer,
    scene::camera::Sensor,
};

use crate::cli::{
    self,
    render::args::PartArgs,
    shared::{exit::Failure, pictures::Outputs, saved, terminal::Terminal},
};

/// Writes checkpoints while a render goes on, and one at its end.
pub struct Keeper<'a> {
    /// Where, if that was asked for.
    path: Option<PathBuf>,
    /// Where a render that was interrupted goes if it was not.
    otherwise: PathBuf,
    every: Duration,
    last: Instant,
    sensor: Sensor,
    settings: &'a BTreeMap<String, String>,
    /// How many passes the whole render has.
    whole: Option<u32>,
    written: Cell<u32>,
    spent: Cell<Duration>,
}

impl<'a> Keeper<'a> {
    /// Refuses a place where no checkpoint can be written, or one that an output takes.
    pub fn check(args: &PartArgs, outputs: &Outputs) -> Result<(), Failure> {
        let Some(path) = &args.checkpoint else { return Ok(()) };
        let name = path.display();
        if Format::of(path) != Ok(Format::Exr) {
            return Err(Failure::usage(format!("cannot write '{name}': a checkpoint is an .exr file")));
        }
        if outputs.paths().any(|output| output == path) {
            return Err(Failure::usage(format!("cannot write '{name}': it is the checkpoint and an output at once")));
        }
        check_writable(path).map_err(|error| Failure::output(error.to_string()))
    }

    pub fn new(
        args: &PartArgs,
        outputs: &Outputs,
        sensor: Sensor,
        settings: &'a BTreeMap<String, String>,
        whole: Option<u32>,
    ) -> Self {
        let otherwise = outputs.paths().next().map_or("pathspace".into(), PathBuf::clone);
        Self {
            path: args.checkpoint.clone(),
            otherwise: otherwise.with_extension("checkpoint.exr"),
            every: args.checkpoint_every,
            last: Instant::now(),
            sensor,
            settings,
            whole,
            written: Cell::new(0),
            spent: Cell::default(),
        }
    }

    /// Writes a checkpoint if there is to be one, and the last one is old enough. A disk that is full now may have room
    /// later: the render goes on, and the file there stays as it was.
    pub fn after_pass(&mut self, renderer: &Renderer<'_>, terminal: Terminal) {
        let Some(path) = self.path.as_ref().filter(|_| self.last.elapsed() >= self.every) else { return };
        if let Err(failure) = self.write(path, renderer) {
            terminal.warn(format_args!("{}; rendering goes on", failure.sentence));
        }
        self.last = Instant::now();
    }

    /// Writes the checkpoint of a render that is at its end, if there is to be one, and says where it is.
    pub fn at_end(&self, renderer: &Renderer<'_>) -> Result<Option<&Path>, Failure> {
        self.path.as_deref().map(|path| self.write(path, renderer).map(|()| path)).transpose()
    }

    /// Writes the checkpoint of a render that was interrupted, asked for or not.
    pub fn at_interruption(&self, renderer: &Renderer<'_>) -> Result<&Path, Failure> {
        let path = self.path.as_ref().unwrap_or(&self.otherwise);
        self.write(path, renderer).map(|()| path.as_path())
    }

    /// Checkpoints so far.
    pub fn written(&self) -> u32 {
        self.written.get()
    }

    /// The time that they took.
    pub fn spent(&self) -> Duration {
        self.spent.get()
    }

    fn write(&self, path: &Path, renderer: &Renderer<'_>) -> Result<(), Failure> {
        let start = Instant::now();
        let bytes = saved::encode(renderer, self.sensor, self.settings, self.whole)
            .map_err(|error| Failure::output(format!("cannot write '{}': {error}", path.display())))?;
        write_atomically(path, &bytes).map_err(|error| Failure::output(error.to_string()))?;
        self.written.set(self.written.get() + 1);
        self.spent.set(self.spent.get() + start.elapsed());
        Ok(())
    }
}

/// The command that goes on from the checkpoint: the same one with `--resume`.
pub fn resume_command(checkpoint: &Path) -> String {
    words(cli::words().iter().cloned(), checkpoint).iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// The command that is running, without the place of the program.
pub fn this_command() -> String {
    let options = cli::words().iter().skip(1).map(|word| quoted(word));
    std::iter::once("pathspace".to_owned()).chain(options).collect::<Vec<_>>().join(" ")
}

fn words(command: impl Iterator<Item = OsString>, checkpoint: &Path) -> Vec<OsString> {
    let mut words = Vec::new();
    let mut resumed = false;
    for word in command {
        let text = word.to_string_lossy().into_owned();
        // The value of an option that is left out is left out as well.
        if !resumed && text != "--resume" && !text.starts_with("--resume=") {
            words.push(word);
        }
        resumed = text == "--resume";
    }
    words.extend(["--resume".into(), checkpoint.into()]);
    words
}

/// As a shell reads it back.
fn quoted(word: &OsStr) -> String {
    let word = word.to_string_lossy();
    let plain = |c: char| c.is_alphanumeric() || "-_=+./:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_said_so_that_a_shell_reads_it_back() {
        let said = |command: &[&str]| {
            let words = words(command.iter().map(OsString::from), Path::new("my file.exr"));
            words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
        };
        let expected = "pathspace render 'a b.glb' --spp 4 --resume 'my file.exr'";
        assert_eq!(said(&["pathspace", "render", "a b.glb", "--spp", "4"]), expected);
        assert_eq!(said(&["pathspace", "render", "--resume", "x", "a b.glb", "--spp", "4"]), expected);
        assert_eq!(said(&["pathspace", "render", "a b.glb", "--resume=x", "--spp", "4"]), expected);
        assert_eq!(quoted(OsStr::new("it's")), r"'it'\''s'");
    }
}
