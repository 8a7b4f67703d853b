//! Emitted filters: programs over time, compiled by the macro.
//!
//! In: programs written here, and observations instant by instant, some of them missing. Out: pass if the answers of each
//! instant, in f64 and f32, are those expected. Invariant: expected values of finite programs come from the enumeration of all
//! histories, those of normal ones from a filter written here; neither shares code with the library.

mod finite;
mod normal;
mod series;

/// Asserts that two numbers agree.
fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    let most = tolerance * expected.abs().max(1.0);
    assert!((found - expected).abs() <= most, "{what}: {found}, expected {expected}");
}
