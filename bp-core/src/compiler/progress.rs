//! The progress of long work, and requests to stop it.
//!
//! In: steps reported by sampling or filtering; requests of the host to stop. Out: the progress. Invariant: the
//! progress report does not change the result. A process does one long work at a time, so the state is global, like the
//! signals.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

static DONE: AtomicUsize = AtomicUsize::new(0);
static TOTAL: AtomicUsize = AtomicUsize::new(0);
static STOPPED: AtomicBool = AtomicBool::new(false);
static ADVICE: Mutex<Option<String>> = Mutex::new(None);

/// Requests that the current work stops early with its result so far; `false` if none can.
pub fn stop() -> bool {
    let runs = TOTAL.load(Relaxed) > 0;
    if runs {
        STOPPED.store(true, Relaxed);
    }
    runs
}

/// Forgets a request to stop, once the work that it concerned has ended: for hosts that live on, such as an interpreter.
pub fn resume() {
    STOPPED.store(false, Relaxed);
}

/// Whether a stop was requested.
pub fn is_stopped() -> bool {
    STOPPED.load(Relaxed)
}

/// The kind of work that runs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Running {
    /// Draws, of which there may be none yet.
    Draws,
    /// Steps of learning, each of which leaves estimates.
    Steps,
}

/// The work that runs.
pub fn running() -> Option<Running> {
    match TOTAL.load(Relaxed) {
        0 => None,
        WITHOUT_END => Some(Running::Steps),
        _ => Some(Running::Draws),
    }
}

/// Sets what a user may do where the work that follows takes long.
pub fn advise(advice: Option<String>) {
    if let Ok(mut own) = ADVICE.lock() {
        *own = advice;
    }
}

/// What a user may do where work takes long.
pub fn advice() -> Option<String> {
    ADVICE.lock().ok().and_then(|advice| advice.clone())
}

/// The steps done, and the total; `None` if no long work runs, or the total is unknown.
pub fn steps() -> Option<(usize, usize)> {
    let total = TOTAL.load(Relaxed);
    (total > 0 && total < WITHOUT_END).then(|| (DONE.load(Relaxed).min(total), total))
}

/// The steps of work that ends at convergence.
const WITHOUT_END: usize = usize::MAX;

/// Work that can be stopped early with its result so far.
pub(crate) struct Work(());

impl Work {
    /// Begins work with this number of steps.
    pub(crate) fn of(steps: usize) -> Self {
        DONE.store(0, Relaxed);
        TOTAL.store(steps, Relaxed);
        Self(())
    }

    /// Begins work with an unknown number of steps.
    pub(crate) fn without_end() -> Self {
        Self::of(WITHOUT_END)
    }

    /// Reports a step; returns whether to continue. Work that is not to continue ends.
    pub(crate) fn goes_on(&self) -> bool {
        let goes_on = self.may_go_on();
        if !goes_on {
            self.ends();
        }
        goes_on
    }

    /// Reports a step; returns whether to continue, where the work may have to go on to have a result.
    pub(crate) fn may_go_on(&self) -> bool {
        DONE.fetch_add(1, Relaxed);
        !is_stopped()
    }

    /// Reports that the work ends with the result so far, which may take a while to put together.
    pub(crate) fn ends(&self) {
        TOTAL.store(0, Relaxed);
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        TOTAL.store(0, Relaxed);
    }
}
