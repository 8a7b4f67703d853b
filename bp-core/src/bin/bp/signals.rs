//! Signals, and the progress of long work.
//!
//! In: SIGINT, SIGTERM and SIGHUP (Ctrl-C and closing the window elsewhere). Out: sampling stops with the draws made so
//! far, and the command continues and prints the answer; any other work ends immediately. Invariant: a second signal
//! ends the process immediately; files have no name until they are complete (`files.rs`), so no partial file remains.

use bp_core::compiler::progress;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::Duration;

/// The exit status of a command that was interrupted.
pub(crate) const INTERRUPTED: i32 = 1;

/// The interval between checks of the progress.
const GLANCE: Duration = Duration::from_millis(150);

/// Handles signals, and shows the progress of long work on a terminal; `status` is the exit status of a command that a signal
/// ends.
pub(crate) fn listen(status: i32) {
    let mut asked = false;
    let listening = ctrlc::set_handler(move || {
        if !std::mem::replace(&mut asked, true) && progress::stop() {
            return;
        }
        std::process::exit(status);
    });
    // If handlers cannot be installed, the default behaviour stays.
    drop(listening);
    if std::io::stderr().is_terminal() {
        std::thread::spawn(show);
    }
}

/// Shows a bar while long work runs.
fn show() {
    let style = ProgressStyle::with_template(
        "{bar:40} {pos}/{len}, {eta} left; Ctrl-C answers from the draws so far",
    );
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let mut bar: Option<ProgressBar> = None;
    loop {
        std::thread::sleep(GLANCE);
        match progress::steps() {
            None => drop(bar.take().inspect(ProgressBar::finish_and_clear)),
            Some((done, total)) => {
                let bar = bar.get_or_insert_with(|| ProgressBar::new(total as u64).with_style(style.clone()));
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            }
        }
    }
}
