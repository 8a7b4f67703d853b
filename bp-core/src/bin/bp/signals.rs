//! Ctrl-C and other requests to end, and how far long work is.
//!
//! In: SIGINT, SIGTERM and SIGHUP (Ctrl-C and closing the window elsewhere). Out: work that draws stops with the draws that
//! it has, and the command goes on to write the answer; any other work ends at once. Invariant: a second request ends the
//! process whatever it does; files are written under no name until they are whole (`files.rs`), so none is left half.

use bp_core::progress;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::Duration;

/// The exit code of a command that was interrupted.
pub(crate) const INTERRUPTED: i32 = 1;

/// How often it is looked how far the work is.
const GLANCE: Duration = Duration::from_millis(150);

/// Listens to signals, and shows on a terminal how far long work is.
pub(crate) fn listen() {
    let mut asked = false;
    let listening = ctrlc::set_handler(move || {
        if !std::mem::replace(&mut asked, true) && progress::stop() {
            return;
        }
        std::process::exit(INTERRUPTED);
    });
    // Where nothing can listen, the system's own habits stay.
    drop(listening);
    if std::io::stderr().is_terminal() {
        std::thread::spawn(show);
    }
}

/// Shows a bar while long work runs.
fn show() {
    let style =
        ProgressStyle::with_template("{bar:40} {pos}/{len}, {eta} left; Ctrl-C answers with what there is");
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
