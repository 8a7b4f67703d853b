//! The limits of this machine: the memory triad a = b + s·c, and multiplications and additions in registers.
//!
//! In: working sets. Out: bytes and operations per second, on one thread and on two. Invariant: plain stores, 12 bytes for
//! each element (a line that is written is also read: 16 pass); the arithmetic multiplies and adds separately, as every
//! back end does, so that answers are the same on every processor.

use crate::clock::{Task, race_on};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::hint::black_box;

/// Rounds of the arithmetic, and numbers in registers.
const ROUNDS: usize = 200_000;
const LANES: usize = 128;

struct Arithmetic(f32);

impl NullaryFnOnce for Arithmetic {
    type Output = f32;

    #[inline(always)]
    fn call(self) -> f32 {
        let mut sums = [self.0; LANES];
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = *sum * 0.999 + 0.001;
            }
        }
        sums.iter().sum()
    }
}

/// Prints the limits of the machine.
pub(crate) fn run(seconds: f64) {
    println!("{:<34}{:>12}{:>12}", "The machine, at best, f32", "one thread", "two threads");
    for mebibytes in [1usize, 18, 600] {
        let count = mebibytes * (1 << 20) / 12;
        let rounds = (18 / mebibytes).max(1);
        let rates = [1, 2].map(|threads| {
            let mut sets: Vec<[Vec<f32>; 3]> = (0..threads)
                .map(|_| [0.0, 1.0, 2.0].map(|start| vec![start; count / threads.max(1)]))
                .collect();
            let triad = || {
                sets.par_iter_mut().for_each(|[a, b, c]| {
                    for _ in 0..rounds {
                        for (a, (b, c)) in a.iter_mut().zip(b.iter().zip(&*c)) {
                            *a = b + 0.5 * c;
                        }
                        black_box(&mut *a);
                    }
                });
            };
            let mut tasks: Vec<Task<'_>> = vec![("triad", Box::new(triad))];
            let time = race_on(threads, seconds, &mut tasks)[0];
            (12 * count * rounds) as f64 / time.least / 1e9
        });
        let title = format!("triad over {mebibytes} MiB, GB/s");
        println!("  {title:<32}{:>12.1}{:>12.1}", rates[0], rates[1]);
    }
    let rates = [1, 2].map(|threads: usize| {
        let work = || {
            (0..threads).into_par_iter().for_each(|thread| {
                black_box(Arch::new().dispatch(Arithmetic(black_box(thread as f32))));
            });
        };
        let mut tasks: Vec<Task<'_>> = vec![("arithmetic", Box::new(work))];
        let time = race_on(threads, seconds, &mut tasks)[0];
        (2 * threads * ROUNDS * LANES) as f64 / time.least / 1e9
    });
    println!("  {:<32}{:>12.1}{:>12.1}", "multiply and add, GFLOP/s", rates[0], rates[1]);
}
