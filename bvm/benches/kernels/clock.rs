//! A stopwatch for a machine that others use too.
//!
//! In: things to do. Out: for each the least and the median time. Invariant: they take turns, so that what
//! disturbs one disturbs all.

use std::time::Instant;

/// One thing to do.
pub(crate) type Task<'t> = (&'static str, Box<dyn FnMut() + 't>);

/// Least and median seconds of one run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Time {
    /// The least.
    pub(crate) least: f64,
    /// The median.
    pub(crate) median: f64,
}

/// Times tasks in turns, for about `seconds` altogether and at least three turns.
pub(crate) fn race(seconds: f64, tasks: &mut [Task<'_>]) -> Vec<Time> {
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); tasks.len()];
    let begin = Instant::now();
    for turn in 0.. {
        for ((_, run), times) in tasks.iter_mut().zip(&mut times) {
            let start = Instant::now();
            run();
            // The first turn warms up.
            if turn > 0 {
                times.push(start.elapsed().as_secs_f64());
            }
        }
        if turn >= 3 && begin.elapsed().as_secs_f64() > seconds {
            break;
        }
    }
    let time = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        Time { least: times[0], median: times[times.len() / 2] }
    };
    times.into_iter().map(time).collect()
}

/// Times tasks in turns and prints them beside the first one; `per` is what a run does, of the unit named.
pub(crate) fn table(title: &str, seconds: f64, scale: (f64, &str), tasks: &mut [Task<'_>]) -> Vec<Time> {
    println!("\n{title}");
    let unit = scale.1;
    println!(
        "  {:<34}{:>13}{:>13}{:>16}",
        "",
        format!("least {unit}"),
        format!("median {unit}"),
        "ratio (median)"
    );
    let times = race(seconds, tasks);
    for ((name, _), time) in tasks.iter().zip(&times) {
        let ratio = (time.least / times[0].least, time.median / times[0].median);
        println!(
            "  {name:<34}{:>13.3}{:>13.3}{:>8.2} ({:.2})",
            time.least * scale.0,
            time.median * scale.0,
            ratio.0,
            ratio.1
        );
    }
    times
}
