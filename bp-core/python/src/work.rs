//! Work that may take long, and Ctrl-C.
//!
//! In: a computation. Out: its result, or `KeyboardInterrupt`. Invariant: the interpreter lock is free meanwhile, and
//! signals are handled within [`GLANCE`]; a computation that was interrupted changes nothing that is visible.

use bp_core::compiler::progress;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// The time between two looks for signals.
const GLANCE: Duration = Duration::from_millis(50);

/// Runs a computation on a thread of its own, and handles signals meanwhile. After an interrupt, draws stop at once; other
/// work goes on in the background until its end, without effect.
///
/// # Errors
/// `KeyboardInterrupt`, or what another signal handler raises.
pub(crate) fn patiently<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    patiently_until(py, |_| work())
}

/// The same, of work that looks from time to time whether it is still wanted.
///
/// # Errors
/// As [`patiently`].
pub(crate) fn patiently_until<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> T + Send + 'static,
) -> PyResult<T> {
    let unwanted = Arc::new(AtomicBool::new(false));
    let (send, mut results) = sync_channel(1);
    let seen = Arc::clone(&unwanted);
    let worker = std::thread::spawn(move || drop(send.send(work(&seen))));
    loop {
        let next = &mut results;
        match py.detach(move || next.recv_timeout(GLANCE)) {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let panic = worker.join().expect_err("internal: a worker without a result has panicked");
                std::panic::resume_unwind(panic);
            }
        }
        if let Err(interrupt) = py.check_signals() {
            unwanted.store(true, Relaxed);
            if progress::stop() {
                // The request is forgotten only after the draws have seen it.
                py.detach(move || worker.join()).ok();
                progress::resume();
            }
            return Err(interrupt);
        }
    }
}
