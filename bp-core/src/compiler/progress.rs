//! The progress of long work, and requests to stop it.
//!
//! In: steps reported by sampling or filtering; requests of the host to stop. Out: the progress. Invariant: the
//! progress report does not change the result. A command does one long work at a time, so its state is global, like the
//! signals; a host that does several, such as an interpreter, gives each a token by which it is abandoned alone.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

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

/// Says that the work of a host is not wanted any more.
pub type Unwanted = Arc<AtomicBool>;

thread_local! {
    /// The token of the work of this thread.
    static HOST: RefCell<Option<Unwanted>> = const { RefCell::new(None) };
}

/// Does some work, which ends early, with the error `Interrupted`, once it is not wanted.
pub fn abandonable<T>(unwanted: Option<Unwanted>, work: impl FnOnce() -> T) -> T {
    let before = HOST.replace(unwanted);
    let done = work();
    HOST.set(before);
    done
}

/// The token of the work of this thread, for the threads that help it.
pub fn host() -> Option<Unwanted> {
    HOST.with_borrow(Clone::clone)
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
pub(crate) struct Work {
    host: Option<Unwanted>,
}

impl Work {
    /// Begins work with this number of steps.
    pub(crate) fn of(steps: usize) -> Self {
        DONE.store(0, Relaxed);
        TOTAL.store(steps, Relaxed);
        Self { host: host() }
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
        !is_stopped() && self.is_wanted()
    }

    /// Whether a result is wanted, that of the steps so far at least.
    pub(crate) fn is_wanted(&self) -> bool {
        self.host.as_ref().is_none_or(|unwanted| !unwanted.load(Relaxed))
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
