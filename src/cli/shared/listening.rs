//! Work on the threads of a pool that says how far it is to the thread that waits for it.

use std::{
    ops::ControlFlow,
    panic,
    sync::{
        atomic::{AtomicBool, Ordering::SeqCst},
        mpsc,
    },
    thread,
};

use rayon::ThreadPool;

/// Does `work` on the pool. What it says comes to `listen` on this thread, where a bar is drawn; when that breaks,
/// `work` hears so at its next word.
pub fn listening<T: Send, R: Send>(
    pool: &ThreadPool,
    work: impl FnOnce(&mut dyn FnMut(T) -> ControlFlow<()>) -> R + Send,
    mut listen: impl FnMut(T) -> ControlFlow<()>,
) -> R {
    let (words, heard) = mpsc::channel();
    let ended = &AtomicBool::new(false);
    thread::scope(|scope| {
        let worker = scope.spawn(move || {
            let mut say = |word| {
                // Nobody listening is no reason to stop.
                words.send(word).unwrap_or(());
                if ended.load(SeqCst) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            pool.install(|| work(&mut say))
        });
        for word in heard {
            if listen(word).is_break() {
                ended.store(true, SeqCst);
            }
        }
        worker.join().unwrap_or_else(|panic| panic::resume_unwind(panic))
    })
}
