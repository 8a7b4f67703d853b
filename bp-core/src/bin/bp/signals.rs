//! Signals, and the progress of long work.
//!
//! In: SIGINT, SIGTERM and SIGHUP (Ctrl-C and closing the window elsewhere). Out: sampling stops with the draws made so
//! far, and the command continues and prints the answer; any other work ends immediately. Invariant: a second signal
//! ends the process immediately, and so does the first, after a moment, if there is no draw yet to answer from; files have no name until they are complete (`files.rs`), so no partial file remains.

use crate::program;
use bp_core::compiler::progress::{self, Running};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

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
            std::thread::spawn(move || end_late_work(status));
            return;
        }
        std::process::exit(status);
    });
    // If handlers cannot be installed, the default behaviour stays.
    drop(listening);
    std::thread::spawn(|| show(std::io::stderr().is_terminal()));
}

/// The longest wait for work that is asked to stop.
const PATIENCE: Duration = Duration::from_millis(900);

/// Ends the process if its work has not stopped in time; learning ends after its present step.
fn end_late_work(status: i32) {
    std::thread::sleep(PATIENCE);
    match progress::running() {
        None => {}
        Some(Running::Steps) => program::warn("note: it stops after this step; Ctrl-C again ends it at once"),
        Some(Running::Draws) => {
            program::warn("error: interrupted before there were enough draws to answer from");
            std::process::exit(status);
        }
    }
}

/// Notes once how long work will take that takes long.
fn note_length((done, total): (usize, usize), begun: Instant) -> bool {
    let spent = begun.elapsed().as_secs_f64();
    if spent < 4.0 || done == 0 {
        return false;
    }
    let left = spent * (total as f64 / done as f64 - 1.0);
    if left > 30.0 {
        let time = match left {
            left if left < 90.0 => format!("{left:.0} seconds"),
            left if left < 5400.0 => format!("{:.0} minutes", left / 60.0),
            left => format!("{:.0} hours", left / 3600.0),
        };
        let mut line = format!(
            "note: all draws would take another {time}; `--particles N` makes fewer, Ctrl-C answers from those so far"
        );
        if let Some(advice) = progress::advice() {
            line.push_str(&format!("; {advice}"));
        }
        program::warn(&line);
    }
    true
}

/// Shows a bar while long work runs.
fn show(on_terminal: bool) {
    let style = ProgressStyle::with_template(
        "{bar:40} {pos}/{len}, {eta} left; Ctrl-C answers from the draws so far",
    );
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let mut bar: Option<ProgressBar> = None;
    let (mut begun, mut noted) = (None, false);
    loop {
        std::thread::sleep(GLANCE);
        match progress::steps() {
            None => {
                begun = None;
                drop(bar.take().inspect(ProgressBar::finish_and_clear));
            }
            Some(steps) if !noted && note_length(steps, *begun.get_or_insert_with(Instant::now)) => {
                noted = true
            }
            Some((done, total)) if on_terminal => {
                let bar = bar.get_or_insert_with(|| ProgressBar::new(total as u64).with_style(style.clone()));
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            }
            Some(_) => {}
        }
    }
}
