//! Work that may take long, and Ctrl-C.
//!
//! In: a computation. Out: its result, or `KeyboardInterrupt`. Invariant: the interpreter lock is free meanwhile, and
//! signals are handled within [`GLANCE`]; a computation that was interrupted changes nothing that is visible.

use bp_core::compiler::progress::{self, Unwanted};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// The time between two looks for signals.
const GLANCE: Duration = Duration::from_millis(50);

/// Runs a computation on a thread of its own, and handles signals meanwhile. After an interrupt it is left to itself: draws and
/// learning soon see that they are not wanted, other work goes on in the background until its end, without effect.
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
    let unwanted = Unwanted::default();
    let (send, results) = sync_channel(1);
    let seen = Unwanted::clone(&unwanted);
    let hosted = move || progress::abandonable(Some(Unwanted::clone(&seen)), || work(&seen));
    let worker = std::thread::spawn(move || drop(send.send(hosted())));
    match received(py, results, &unwanted)? {
        Some(done) => Ok(done),
        None => {
            let panic = worker.join().expect_err("internal: a worker without a result has panicked");
            std::panic::resume_unwind(panic);
        }
    }
}

/// What another thread sends, with the signals handled meanwhile, the last time after it has come; `None` if it has ended without.
/// After an interrupt, it is `unwanted`.
///
/// # Errors
/// As [`patiently`].
pub(crate) fn received<T: Send>(
    py: Python<'_>,
    mut results: Receiver<T>,
    unwanted: &AtomicBool,
) -> PyResult<Option<T>> {
    loop {
        let next = &mut results;
        let found = py.detach(move || next.recv_timeout(GLANCE));
        if let Err(interrupt) = py.check_signals() {
            unwanted.store(true, Relaxed);
            return Err(interrupt);
        }
        match found {
            Ok(done) => return Ok(Some(done)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
        }
    }
}
