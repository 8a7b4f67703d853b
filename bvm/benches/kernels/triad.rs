//! The memory triad a = b + s·c: what this machine moves.
//!
//! In: working sets. Out: bytes per second, 12 for each element. Invariant: one thread, plain stores.

use crate::clock::{Task, race};
use std::hint::black_box;

/// Prints the table.
pub(crate) fn run(seconds: f64) {
    println!("\nMemory triad, f32, one thread, 12 B for each element");
    println!("  {:<34}{:>13}{:>13}", "working set", "best GB/s", "median GB/s");
    for mebibytes in [1usize, 18, 600] {
        let count = mebibytes * (1 << 20) / 12;
        let (mut a, b, c) = (vec![0.0f32; count], vec![1.0f32; count], vec![2.0f32; count]);
        let rounds = (18 / mebibytes).max(1);
        let triad = || {
            for _ in 0..rounds {
                for (a, (b, c)) in a.iter_mut().zip(b.iter().zip(&c)) {
                    *a = b + 0.5 * c;
                }
                black_box(&mut a);
            }
        };
        let mut tasks: Vec<Task<'_>> = vec![("triad", Box::new(triad))];
        let time = race(seconds, &mut tasks)[0];
        let rate = |time: f64| (12 * count * rounds) as f64 / time / 1e9;
        println!("  {:<34}{:>13.1}{:>13.1}", format!("{mebibytes} MiB"), rate(time.least), rate(time.median));
    }
}
