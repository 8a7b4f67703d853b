//! Kernels, hand-written loops, and the bandwidth of memory: `cargo bench -p bvm --bench kernels`.
//!
//! In: nothing; the state is made up, the same each time. Out: one table, in f32 on one thread and on two; with the
//! feature `gpu`, shaders too; `ONLY=cell` (`machine`, `others`, `frames`, `hearing`, `scale`): one part of it. Invariant: every
//! kernel is compared with the loop written by hand before it is timed; ratios are of one run, in turns, because the
//! machine is shared.

mod cell;
mod clock;
mod frames;
mod hand;
mod hand_rows;
mod hand_senses;
mod hearing;
mod layouts;
mod machine;
mod others;

fn main() {
    // `cargo test --benches` only checks that it runs.
    let seconds = if std::env::args().any(|argument| argument == "--bench") { 1.0 } else { 0.0 };
    let only = std::env::var("ONLY").ok();
    let parts: [(&str, &dyn Fn()); 6] = [
        ("machine", &|| machine::run(0.5 * seconds)),
        ("cell", &|| cell::run(seconds)),
        ("others", &|| others::run(seconds)),
        ("frames", &|| frames::run(seconds)),
        ("hearing", &|| hearing::run(seconds)),
        ("scale", &|| cell::scale(seconds)),
    ];
    for (name, part) in parts.iter().filter(|(name, _)| only.as_deref().is_none_or(|only| only == *name)) {
        if matches!(*name, "cell") || only.as_deref() == Some(name) {
            clock::head();
        }
        part();
    }
}
