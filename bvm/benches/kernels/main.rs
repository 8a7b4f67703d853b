//! Kernels beside loops written by hand, and beside the memory they run in: `cargo bench -p bvm --bench kernels`.
//!
//! In: nothing; the state is made up, the same each time. Out: one table. Invariant: what is timed has been
//! compared with the loop written by hand first; ratios are of one run, in turns, because the machine is shared.

mod cell;
mod clock;
mod hand;
mod others;
mod triad;

fn main() {
    // `cargo test --benches` only wants to know that it runs.
    let seconds = if std::env::args().any(|argument| argument == "--bench") { 1.0 } else { 0.0 };
    println!("Least and median of runs taken in turns; ratios to the first line of each table.");
    triad::run(seconds);
    cell::run(seconds);
    others::run(seconds);
}
