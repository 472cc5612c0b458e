//! Long work beside Python: other threads of it go on, and Ctrl-C ends the work.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;

/// How often Python is asked whether there was Ctrl-C.
const INTERVAL: Duration = Duration::from_millis(100);

/// Runs work in a thread of its own while Python's signals are watched; on Ctrl-C, or if `meanwhile`, which is called now and then,
/// fails, the work is asked to end, and the exception is raised when it has.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
    meanwhile: impl Fn(Python<'_>) -> PyResult<()> + Sync,
) -> PyResult<T> {
    let cancel = AtomicBool::new(false);
    py.detach(|| {
        std::thread::scope(|scope| {
            let (done, is_done) = channel();
            let cancel = &cancel;
            let worker = scope.spawn(move || {
                let result = work(cancel);
                // the other end waits until it is told, or until this end is gone
                let _ = done.send(());
                result
            });
            let mut raised = None;
            while is_done.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none()
                    && let Err(exception) =
                        Python::attach(|py| py.check_signals().and_then(|()| meanwhile(py)))
                {
                    cancel.store(true, Ordering::Relaxed);
                    raised = Some(exception);
                }
            }
            let result = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            raised.map_or(Ok(result), Err)
        })
    })
}
