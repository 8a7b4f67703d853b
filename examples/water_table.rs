//! A water treatment unit as one table: P(O | I0 I1 S C), 161 051 numbers in one call of compiled code.
//!
//! An output that would be negative has probability 0, and the others are renormalised. An impossible context has a row
//! of zeros. Chapter 3 of Bessière et al. (2013).

use bp_core::prelude::Error;
use bp_macros::bayesian_program;

bayesian_program!("examples/water_unit.bp");

fn main() -> Result<(), Error> {
    let start = std::time::Instant::now();
    let table = water_unit::output().ask()?;
    println!("161 051 numbers in {:.1} ms", start.elapsed().as_secs_f64() * 1e3);

    // Indices: first the searched variable, then the known ones.
    let row =
        |[i0, i1, s, c]: [i64; 4]| -> [f64; 11] { std::array::from_fn(|o| table.p(o as i64, i0, i1, s, c)) };
    for context in [[1, 0, 5, 10], [0, 1, 5, 10], [5, 5, 5, 5], [0, 5, 9, 5]] {
        println!("I0 I1 S C = {context:?}: {:.4?}", row(context));
    }
    assert_eq!(table.distribution().len(), 161_051);
    assert!((row([1, 0, 5, 10])[0] - 2.0 / 7.0).abs() < 1e-12 && (row([0, 1, 5, 10])[0] - 0.3).abs() < 1e-12);
    assert_eq!(table.report().impossible, 6655);
    Ok(())
}
