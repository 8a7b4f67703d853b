//! Probabilities of forms that f64 rounds to 0.
//!
//! In: programs whose forms have probabilities such as e⁻⁸⁰⁰. Out: the answers of every strategy, compared with logarithms by hand.

use super::{answer, has_ln_evidence, near, numbers, odds};
use crate::support::model_of;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::io::{Format, Network, lost};
use bp_core::prelude::*;

/// ½ e⁻⁸⁰⁰ against ½ e⁻⁷⁰⁰ e⁻⁴⁰⁰.
const TWO: &str = "program Two {
    variables { A, C, D : bool; }
    decomposition { P(A) P(C | A) P(D | A) }
    forms {
        P(A) = uniform;
        P(C | A) = bernoulli(if A { exp(-700) } else { exp(-800) });
        P(D | A) = bernoulli(if A { exp(-400) } else { 1 });
    }
}";

#[test]
fn every_strategy_of_finite_variables() {
    let table = TWO.replace(
        "bernoulli(if A { exp(-700) } else { exp(-800) })",
        "table { 1 - exp(-800), exp(-800); 1 - exp(-700), exp(-700) }",
    );
    for text in [TWO, &table] {
        let program = Program::parse(text).unwrap();
        for strategy in ["sums", "join_tree"] {
            let given = program.clone().by(strategy).unwrap().ask("P(A | C = true, D = true)").unwrap();
            near(&numbers(given.answer()), &odds(-800.0, -1100.0), 1e-12);
            has_ln_evidence(given.answer(), -800.0 - 2f64.ln());
        }
    }
}

#[test]
fn instants() {
    let text = "program Kept {
        variables { A, A^-1, C : bool; }
        decomposition { P(A^-1) P(A | A^-1) P(C | A) }
        forms {
            P(A^-1) = previous(A) else uniform;
            P(A | A^-1) = bernoulli(if A^-1 { 1 } else { 0 });
            P(C | A) = bernoulli(if A { exp(-750) } else { exp(-760) });
        }
    }";
    let program = Program::parse(text).unwrap();
    let mut filter = program.filter("P(A | C)").unwrap();
    for steps in [1.0, 2.0] {
        let now = filter.step(evidence! { C: true }).unwrap();
        near(&numbers(now.answer()), &odds(-760.0 * steps, -750.0 * steps), 1e-12);
    }
}

#[test]
fn mixtures_and_chains() {
    // Z ~ N(0, 1.25) given K, else N(20, 1.25): at 30 they differ by (900 − 100) / 2.5 = 320 where P(C | K) differs by 100.
    let text = "program Mixed {
        variables { K, C : bool; Y, Z : real; }
        decomposition { P(K) P(C | K) P(Y | K) P(Z | Y K) }
        forms {
            P(K) = uniform;
            P(C | K) = bernoulli(if K { exp(-700) } else { exp(-800) });
            P(Y | K) = normal(if K { 0 } else { 20 }, 1);
            P(Z | Y K) = normal(Y, 0.5);
        }
    }";
    let exact = answer(text, "P(K | C = true, Z = 30)", &Inputs::new());
    near(&numbers(&exact), &odds(-800.0, -1020.0), 1e-10);
    let program = Program::parse(text).unwrap().by("gibbs").unwrap();
    assert_eq!(program.ask("P(K | C = true, Z = 30)").unwrap().p(false).unwrap(), 1.0);
}

#[test]
fn learned_numbers() {
    let text = TWO.replace("P(A) = uniform", "P(A) = unknown(histogram)");
    let program = Program::parse(&text).unwrap();
    let cases = Learning::new().hidden("A").column("C", [true, true]).column("D", [true, true]);
    let learned = program.learn(cases).unwrap();
    // P(A = false) = 1: each case has e⁻⁸⁰⁰.
    assert!((learned.report().ln_likelihood + 1600.0).abs() < 1e-6, "{}", learned.report().ln_likelihood);
}

#[test]
fn files_cannot_hold_them() {
    let network = Network { model: model_of(TWO), known: Vec::new(), ln_scale: 0.0, warnings: Vec::new() };
    let said = lost(&network, Format::Bif).unwrap().join(" ");
    assert!(said.contains("`C = true` at A = false is e^-800"), "{said}");
}
