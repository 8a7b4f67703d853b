//! Long work: how far it has come, and a request to stop.
//!
//! In: what draws, or goes from instant to instant, says what it has done; the host asks it to stop. Out: how far it is.
//! Invariant: what is not stopped is not changed by being watched. One process does one long work at a time; that is why
//! this is the state of the process, like the signals that it serves.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

static DONE: AtomicUsize = AtomicUsize::new(0);
static TOTAL: AtomicUsize = AtomicUsize::new(0);
static STOPPED: AtomicBool = AtomicBool::new(false);

/// Asks the work that runs to stop with what it has; `false` where none runs that could.
pub fn stop() -> bool {
    let runs = TOTAL.load(Relaxed) > 0;
    if runs {
        STOPPED.store(true, Relaxed);
    }
    runs
}

/// Whether work was asked to stop.
pub fn is_stopped() -> bool {
    STOPPED.load(Relaxed)
}

/// Steps that have been done, and all that are to be; `None` where nothing long runs, or nobody knows how long.
pub fn steps() -> Option<(usize, usize)> {
    let total = TOTAL.load(Relaxed);
    (total > 0 && total < WITHOUT_END).then(|| (DONE.load(Relaxed).min(total), total))
}

/// The steps of work that ends when it comes to rest.
const WITHOUT_END: usize = usize::MAX;

/// Work that can be stopped with what it has.
pub(crate) struct Work(());

impl Work {
    /// Work of so many steps begins.
    pub(crate) fn of(steps: usize) -> Self {
        DONE.store(0, Relaxed);
        TOTAL.store(steps, Relaxed);
        Self(())
    }

    /// Work of which nobody knows how many steps it takes.
    pub(crate) fn without_end() -> Self {
        Self::of(WITHOUT_END)
    }

    /// Whether it goes on; a step has been done where it does.
    pub(crate) fn goes_on(&self) -> bool {
        DONE.fetch_add(1, Relaxed);
        !is_stopped()
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        TOTAL.store(0, Relaxed);
    }
}
