//! Kernels beside loops written by hand, and beside the memory they run in: `cargo bench -p bvm --bench kernels`.
//!
//! In: nothing; the state is made up, the same each time. Out: one table, in f32 on one thread and on two; with the
//! feature `gpu`, shaders too. Invariant: what is timed has been
//! compared with the loop written by hand first; ratios are of one run, in turns, because the machine is shared.

mod cell;
mod clock;
mod hand;
mod hand_senses;
mod hand_tiles;
mod machine;
mod others;

fn main() {
    // `cargo test --benches` only wants to know that it runs.
    let seconds = if std::env::args().any(|argument| argument == "--bench") { 1.0 } else { 0.0 };
    machine::run(0.5 * seconds);
    clock::head();
    cell::run(seconds);
    others::run(seconds);
    cell::scale(seconds);
}
