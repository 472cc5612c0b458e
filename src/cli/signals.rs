//! Ctrl-C, and the signal by which other programs ask this one to end.

use std::sync::atomic::{AtomicBool, Ordering};

use super::CliError;

/// Set by the first such signal.
pub(super) static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Set while the first signal may end the program at once.
static BUILDING: AtomicBool = AtomicBool::new(false);

/// Does work that writes no file and does not look at [`INTERRUPTED`]: a signal ends the program in its midst.
pub(super) fn while_building<T>(work: impl FnOnce() -> T) -> T {
    BUILDING.store(true, Ordering::Relaxed);
    let made = work();
    BUILDING.store(false, Ordering::Relaxed);
    made
}

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
    let is_second = INTERRUPTED.swap(true, Ordering::Relaxed);
    if is_second || BUILDING.load(Ordering::Relaxed) {
        if !is_second {
            say!("trimray: {}", CliError::Interrupted);
        }
        std::process::exit(1);
    }
}
