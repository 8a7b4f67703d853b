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

/// The text of each program, asked at run time, has the answers of the emitted filter.
mod doors {
    use super::near;
    use bp_core::prelude::*;

    #[test]
    fn a_chain_and_a_normal_law_are_the_same_by_text() {
        let door = Program::parse(super::finite::door::SOURCE).unwrap();
        let mut by_text = door.filter("P(Open | Seen)").unwrap();
        let mut state = super::finite::door::open::State::<f64>::new();
        for seen in [Some(true), None, Some(false), Some(true)] {
            let question = super::finite::door::open();
            let (found, report) = match seen {
                Some(seen) => (by_text.step(evidence! { Seen: seen }), question.seen(seen).step(&mut state)),
                None => (by_text.step(evidence! {}), question.step(&mut state)),
            };
            assert_eq!(report.unwrap().impossible, 0);
            near("open", state.p(true), found.unwrap().p(true).unwrap(), 1e-13);
        }
        let cart = Program::parse(super::normal::cart::SOURCE).unwrap().with("q", 0.3).unwrap();
        let mut by_text = cart.filter("P(X | Z U)").unwrap();
        let mut state = super::normal::cart::place::State::<f64>::new();
        for z in [Some(1.5), None, Some(-2.0)] {
            let question = super::normal::cart::place().q(0.3);
            let (found, report) = match z {
                Some(z) => (by_text.step(evidence! { Z: z, U: 0.5 }), question.z(z).u(0.5).step(&mut state)),
                None => (by_text.step(evidence! { U: 0.5 }), question.u(0.5).step(&mut state)),
            };
            assert_eq!(report.unwrap().impossible, 0);
            let found = found.unwrap();
            near("mean", state.mean(), found.mean().unwrap(), 1e-12);
            near("deviation", state.deviation(), found.deviation().unwrap(), 1e-12);
        }
    }
}
