//! Ctrl-C, and the signal by which other programs ask this one to end.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first such signal.
pub(super) static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on the first signal sets [`INTERRUPTED`], and a second one ends the program at once.
pub(super) fn watch() -> anyhow::Result<()> {
    ctrlc::set_handler(interrupt)?;
    watch_termination()
}

/// SIGTERM as Ctrl-C; SIGHUP is left alone, so that `nohup` works.
#[cfg(unix)]
fn watch_termination() -> anyhow::Result<()> {
    let mut signals = signal_hook::iterator::Signals::new([signal_hook::consts::SIGTERM])?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        for _ in signals.forever() {
            interrupt();
        }
    })?;
    Ok(())
}

#[cfg(not(unix))]
fn watch_termination() -> anyhow::Result<()> {
    Ok(())
}

fn interrupt() {
    if INTERRUPTED.swap(true, Ordering::Relaxed) {
        std::process::exit(1);
    }
}
