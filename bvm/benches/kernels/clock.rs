//! Timing on a shared machine, and the table of results.
//!
//! In: tasks. Out: for each the minimum and the median time, on one thread and on two. Invariant: tasks alternate, so
//! that disturbances affect all.

use std::time::Instant;

/// One thing to do.
pub(crate) type Task<'t> = (&'static str, Box<dyn FnMut() + Send + 't>);

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

/// As [`race`], with this many threads to share work among.
pub(crate) fn race_on(threads: usize, seconds: f64, tasks: &mut [Task<'_>]) -> Vec<Time> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| race(seconds, tasks))
}

/// The subject of a row of the table.
pub(crate) struct Work<'w> {
    /// The computation.
    pub(crate) title: &'w str,
    /// Bytes read and written once by a run; 0 where that is meaningless.
    pub(crate) bytes: usize,
    /// The unit of the times, and its number in a second.
    pub(crate) unit: (&'w str, f64),
}

/// Prints the head of the table.
pub(crate) fn head() {
    println!("\n{:<34}{:^38}{:^30}", "", "one thread", "two threads");
    println!(
        "{:<34}{:>10}{:>10}{:>8}{:>10}{:>10}{:>10}{:>8}",
        "", "least", "median", "ratio", "GB/s", "least", "median", "ratio"
    );
}

/// Times tasks on one thread and on two, and prints a row for each; ratios are to the first one, of least times.
pub(crate) fn table(work: &Work<'_>, seconds: f64, tasks: &mut [Task<'_>]) {
    let (unit, scale) = work.unit;
    match work.bytes {
        0 => println!("{} [{unit}]", work.title),
        bytes => println!("{} [{unit}; {:.1} MB are read and written]", work.title, bytes as f64 / 1e6),
    }
    let (one, two) = (race_on(1, seconds, tasks), race_on(2, seconds, tasks));
    for ((name, _), (first, second)) in tasks.iter().zip(one.iter().zip(&two)) {
        let rate = match work.bytes {
            0 => String::new(),
            bytes => format!("{:.1}", bytes as f64 / first.least / 1e9),
        };
        println!(
            "  {name:<32}{:>10.3}{:>10.3}{:>8.2}{rate:>10}{:>10.3}{:>10.3}{:>8.2}",
            first.least * scale,
            first.median * scale,
            first.least / one[0].least,
            second.least * scale,
            second.median * scale,
            second.least / two[0].least,
        );
    }
}
