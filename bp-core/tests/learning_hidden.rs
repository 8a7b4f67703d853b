//! Learning with missing cells and hidden variables, and from many cases.
//!
//! In: cases drawn from a seed, cells of them left out. Out: learned programs. Invariant: the truth that was drawn from, or
//! a fixed point worked out by hand; likelihood never falls, and order leaves no trace.

mod support;

use bp_core::data::read_table;
use bp_core::law::Law;
use bp_core::learn::{Case, Learner, Settings};
use bp_core::model::Model;
use proptest::prelude::*;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use std::path::Path;
use support::learning::{answer, both, near, program, seen, written};
use support::model_of;

const MIXTURE: &str = "program Weights {
    parameters { p : probability = 0.7; mu[0..=1] : real = [70, 20]; sigma[0..=1] : real = 40; }
    variables { Light : bool; Weight : real; }
    decomposition { P(Light) P(Weight | Light) }
    forms { P(Light) = bernoulli(p); P(Weight | Light) = normal(mu[Light], sigma[Light]); }
    identification { p, mu, sigma from weights; }
    question light { P(Light = true) }
}";

#[test]
fn two_normal_laws_are_told_apart() {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(5);
    let model = model_of(MIXTURE);
    let weight = model.variable("Weight").unwrap();
    let mut learner = Learner::new(&model).unwrap();
    let mut weights: Vec<f64> = Vec::new();
    for _ in 0..1000 {
        let light = generator.random::<f64>() < 0.55;
        let truth = if light { [45.0, 10.0] } else { [55.0, 15.0] };
        weights.push(Law::Normal.draw(&mut generator, &truth));
        learner.observe(&Case::new(&model).with(weight, weights[weights.len() - 1])).unwrap();
    }
    let settings = Settings { threshold: 1e-3, ..Settings::default() };
    let learned = learner.learned_with(&settings, &mut |_, _| {}).unwrap();
    assert!(learned.report.expectation.as_ref().unwrap().converged);
    assert_eq!(learned.report.hidden, ["Light"]);
    // Wilks: twice the gain over the truth follows χ² with 5 degrees of freedom, above 25.7 once in 10 000.
    let truth =
        |x: f64| 0.55 * Law::Normal.density(x, &[45.0, 10.0]) + 0.45 * Law::Normal.density(x, &[55.0, 15.0]);
    let gain = learned.report.ln_likelihood - weights.iter().map(|x| truth(*x).ln()).sum::<f64>();
    assert!(gain > -0.5 && 2.0 * gain < 25.7, "{gain}");
    let default = |name: &str| {
        let model = learned.model();
        model.parameters.values().find(|it| it.name == name).unwrap().default.clone()
    };
    let (mu, sigma) = (default("mu"), default("sigma"));
    // The start says which of the two is light; the laws overlap, and so are told roughly.
    near(&[mu[1], mu[0]], &[45.0, 55.0], 5.0);
    near(&[sigma[1], sigma[0]], &[10.0, 15.0], 3.0);
    let words = written(MIXTURE, &learned);
    assert!(words.contains("identification { p, mu, sigma from weights; }"), "{words}");
    both(MIXTURE, &learned, "P(Light = true | Weight = 40)");
}

/// A tree of four variables, its root perhaps hidden.
const TREE: &str = "program Tree {
    variables { H : { A, B }; X, Y : bool; Z : 0..=2; R : real; }
    decomposition { P(H) P(X | H) P(Y | H) P(Z | H X) P(R | H) }
    forms {
        P(H) = unknown(histogram); P(X | H) = unknown; P(Y | H) = unknown(histogram);
        P(Z | H X) = unknown(dirichlet(0.5)); P(R | H) = unknown(normal);
    }
}";

/// Cases of the tree as cells, drawn from laws of its own; in some, cells are missing.
fn drawn(seed: u64, count: usize, missing: f64, hides: bool) -> Vec<Vec<Option<f64>>> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..count)
        .map(|_| {
            let mut chance = |p: f64| generator.random::<f64>() < p;
            let h = chance(0.4);
            let x = chance(if h { 0.9 } else { 0.2 });
            let y = chance(if h { 0.7 } else { 0.1 });
            let z = f64::from(u8::from(chance(0.5))) + f64::from(u8::from(h && x));
            let lost: Vec<bool> = (0..4).map(|_| chance(missing)).collect();
            let r = Law::Normal.draw(&mut generator, &[if h { 3.0 } else { -1.0 }, 1.0]);
            let number = |truth: bool| f64::from(u8::from(truth));
            let shown = |lost: bool, number: f64| (!lost).then_some(number);
            vec![
                shown(hides || lost[0], number(h)),
                shown(lost[1], number(x)),
                shown(lost[2], number(y)),
                shown(lost[3], z),
                Some(r),
            ]
        })
        .collect()
}

fn observed(model: &Model, cells: &[Vec<Option<f64>>]) -> Learner {
    let mut learner = Learner::new(model).unwrap();
    for row in cells {
        let mut it = Case::new(model);
        for (id, cell) in model.variables.ids().zip(row) {
            it = cell.map_or(it.clone(), |number| it.with(id, number));
        }
        learner.observe(&it).unwrap();
    }
    learner
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn no_step_loses_likelihood(seed in any::<u64>(), missing in 0.0..0.4_f64, hides: bool) {
        let model = model_of(TREE);
        let learner = observed(&model, &drawn(seed, 40, missing, hides));
        let settings = Settings { seed, iterations: 25, threshold: 0.0 };
        let learned = learner.learned_with(&settings, &mut |_, _| {}).unwrap();
        for pair in learned.report.expectation.iter().flat_map(|course| course.trail.windows(2)) {
            prop_assert!(pair[1] >= pair[0] - 1e-9 * pair[0].abs(), "{pair:?}");
        }
    }

    #[test]
    fn a_stream_and_a_batch_are_the_same(seed in any::<u64>(), missing in prop_oneof![Just(0.0), Just(0.2)]) {
        let model = model_of(TREE);
        let cells = drawn(seed, 30, missing, false);
        let whole = observed(&model, &cells).learned().unwrap();
        let mut other = cells.clone();
        other.reverse();
        let mut learner = observed(&model, &other[..11]);
        // What is asked in between changes nothing.
        let _ = learner.learned();
        for row in &other[11..] {
            let mut it = Case::new(&model);
            for (id, cell) in model.variables.ids().zip(row) {
                it = cell.map_or(it.clone(), |number| it.with(id, number));
            }
            learner.observe(&it).unwrap();
        }
        let streamed = learner.learned().unwrap();
        prop_assert_eq!(whole.model(), streamed.model());
        prop_assert_eq!(whole.report, streamed.report);
    }

    #[test]
    fn arbitrary_bytes_are_a_table_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..200), text in "[XYHZR,\\n0-9.\"A?-]{0,80}") {
        let model = model_of(TREE);
        for bytes in [bytes.as_slice(), text.as_bytes()] {
            if let Ok(table) = read_table(Path::new("any.csv"), bytes) {
                let mut learner = Learner::new(&model).unwrap();
                if learner.observe_table(&table).is_ok() {
                    let _ = learner.learned_with(&Settings { iterations: 3, ..Settings::default() }, &mut |_, _| {});
                }
            }
        }
    }
}

#[test]
fn the_truth_that_was_drawn_comes_back() {
    let model = model_of(TREE);
    let count = 20_000;
    let learned = observed(&model, &drawn(3, count, 0.0, false)).learned().unwrap();
    let expect = |asked: &str, truth: f64, of: f64| {
        let found = answer(learned.model(), asked)[0];
        let deviation = (truth * (1.0 - truth) / (of * count as f64)).sqrt();
        assert!((found - truth).abs() < 4.0 * deviation, "{asked}: {found} {truth}");
    };
    expect("P(H = B)", 0.4, 1.0);
    expect("P(X = true | H = B)", 0.9, 0.4);
    expect("P(Y = true | H = A)", 0.1, 0.6);
    expect("P(Z = 1 | H = B, X = true)", 0.5, 0.36);
    // With a tenth of all cells missing at random the truth comes back too, a little less sharply.
    let learned = observed(&model, &drawn(4, 4000, 0.1, false)).learned().unwrap();
    for (asked, truth) in [("P(H = B)", 0.4), ("P(X = true | H = B)", 0.9), ("P(Y = true | H = A)", 0.1)] {
        near(&answer(learned.model(), asked), &[truth], 4.0 * (truth * (1.0 - truth) / 1300.0).sqrt());
    }
}

#[test]
fn missing_values_of_a_known_family_are_worked_out_by_hand() {
    // One EM step from A = ½: of the case without A, P(A | B = true) = ½·0.8 / (½·0.8 + ½·0.2) = 0.8. The fixed point of
    // a = (1 + q) / 3 with q = 0.8 a / (0.8 a + 0.2 (1 − a)) solves 3a − 1 = 4a / (3a + 1): 9a² − 4a − 1 = 0.
    let text = program(
        "A, B : bool;",
        "P(A) P(B | A)",
        "P(A) = unknown(histogram); P(B | A) = bernoulli(if A { 0.8 } else { 0.2 });",
    );
    let learner = seen(&text, "A,B\n1,\n0,1\n,1\n");
    let settings = Settings { iterations: 10_000, threshold: 0.0, ..Settings::default() };
    let learned = learner.learned_with(&settings, &mut |_, _| {}).unwrap();
    near(&both(&text, &learned, "P(A = true)"), &[(4.0 + 52.0_f64.sqrt()) / 18.0], 1e-6);
    assert_eq!(learned.report.cells_missing, 2);
    // P(B | A) is as it was.
    near(&both(&text, &learned, "P(B = true | A = true)"), &[0.8], 0.0);
}
