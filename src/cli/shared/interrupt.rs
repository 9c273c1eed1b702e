//! Ctrl-C and SIGTERM: the first one asks for an end, the second one is one.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst},
    },
    thread,
    time::Duration,
};

use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
};

use crate::cli::shared::{exit::Exit, terminal::Terminal};

/// Whether the person, or the system, has asked the program to end.
///
/// Signals are handled however they were set before: a shell starts what a script puts into the background with SIGINT
/// ignored, and a render there is to end well, too.
pub struct Interrupt {
    /// The latest signal's number, 0 before there was one.
    signal: Arc<AtomicUsize>,
    /// Whether the next signal ends the program on the spot.
    at_once: Arc<AtomicBool>,
    /// How often there was something to lose, and how often it was brought to safety: once for each image.
    spared: AtomicUsize,
    settled: Arc<AtomicUsize>,
}

impl Interrupt {
    const WATCH: Duration = Duration::from_millis(300);
    const ENDS: [(i32, Exit); 2] = [(SIGINT, Exit::Interrupted), (SIGTERM, Exit::Terminated)];

    /// Watches for signals. Until [`Interrupt::spare`] each ends the program at once, since nothing would be lost.
    pub fn watch() -> io::Result<Self> {
        let at_once = Arc::new(AtomicBool::new(true));
        let this = Self { signal: Arc::default(), at_once, spared: AtomicUsize::new(0), settled: Arc::default() };
        for (signal, exit) in Self::ENDS {
            // Actions run in this order: a signal that may end the program has done so before it asks for anything.
            flag::register_conditional_shutdown(signal, exit as i32, this.at_once.clone())?;
            flag::register(signal, this.at_once.clone())?;
            flag::register_usize(signal, this.signal.clone(), signal as usize)?;
        }
        Ok(this)
    }

    /// From now on there is something to lose: the next signal asks, and the one after it ends the program. Where the
    /// end of the pass keeps a person waiting, a line says that.
    pub fn spare(&self, terminal: Terminal) {
        self.at_once.store(false, SeqCst);
        let (signal, settled) = (self.signal.clone(), self.settled.clone());
        let this = self.spared.fetch_add(1, SeqCst) + 1;
        let watch = move || {
            while settled.load(SeqCst) < this {
                let asked = signal.load(SeqCst) != 0;
                thread::sleep(Self::WATCH);
                if asked && settled.load(SeqCst) < this {
                    return terminal.say("finishing this pass to keep it; a second Ctrl-C or SIGTERM stops at once");
                }
            }
        };
        // Without such a thread there is no line, and the rest is as it was.
        let _ = thread::Builder::new().name("interrupt".to_owned()).spawn(watch);
    }

    /// The passes are over.
    pub fn settle(&self) {
        self.settled.store(self.spared.load(SeqCst), SeqCst);
    }

    /// How the program is to end, if it was asked to.
    pub fn asked(&self) -> Option<Exit> {
        let signal = self.signal.load(SeqCst);
        Self::ENDS.into_iter().find(|(number, _)| *number as usize == signal).map(|(_, exit)| exit)
    }
}
