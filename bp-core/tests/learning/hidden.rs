//! Learning with missing cells and hidden variables, and from many cases.
//!
//! In: cases drawn from a seed, cells of them left out. Out: learned programs. Invariant: expected values are the
//! parameters of the simulation, or a fixed point computed by hand; the likelihood never decreases, and the order of
//! cases does not matter.

use crate::support::learning::{answer, both, near, program, seen, written};
use crate::support::model_of;
use bp_core::compiler::data::read_table;
use bp_core::compiler::law::Law;
use bp_core::compiler::learn::{Case, Columns, Learned, Learner, Settings};
use bp_core::compiler::model::Model;
use proptest::prelude::*;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use std::path::Path;

const MIXTURE: &str = "program Weights {
    parameters { p : probability = 0.7; mu[0..=1] : real = [70, 20]; sigma[0..=1] : real = 40; }
    variables { Light : bool; Weight : real; }
    decomposition { P(Light) P(Weight | Light) }
    forms { P(Light) = bernoulli(p); P(Weight | Light) = normal(mu[Light], sigma[Light]); }
    identification { p, mu, sigma from weights; }
    question light { P(Light = true) }
}";

#[test]
fn two_normal_laws_are_separated() {
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
    // The initial values determine which component is the light one; the laws overlap, so the likelihood bound above is
    // sharper than a bound for each number.
    let mu = default(&learned, "mu");
    assert!(mu[1] < mu[0], "{mu:?}");
    let words = written(MIXTURE, &learned);
    assert!(words.contains("identification { p, mu, sigma from weights; }"), "{words}");
    both(MIXTURE, &learned, "P(Light = true | Weight = 40)");
}

/// A tree of four variables, its root optionally hidden.
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
        let settings = Settings { seed, iterations: 25, threshold: 0.0, tolerance: 0.0 };
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
        // Asking in between changes nothing.
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
        let hidden = ["H", "X", "Y", "Z", "R"].map(str::to_owned).to_vec();
        let columns = Columns { hidden, ..Columns::default() };
        for bytes in [bytes.as_slice(), text.as_bytes()] {
            if let Ok(table) = read_table(Path::new("any.csv"), bytes) {
                let mut learner = Learner::new(&model).unwrap();
                if learner.observe_table(&table, &columns).is_ok() {
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
    // With a tenth of all cells missing at random the estimates are again near the truth, with a slightly larger error.
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

/// ln of the density of a normal law, written out here.
fn ln_pdf(x: f64, mean: f64, deviation: f64) -> f64 {
    let z = (x - mean) / deviation;
    -0.5 * z * z - deviation.ln() - 0.5 * (2.0 * std::f64::consts::PI).ln()
}

/// The numbers of a learned parameter.
fn default(learned: &Learned, name: &str) -> Vec<f64> {
    learned.model().parameters.values().find(|it| it.name == name).unwrap().default.clone()
}

#[test]
fn by_default_a_mixture_is_learned_to_its_maximum() {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(77);
    let model = model_of(MIXTURE);
    let weight = model.variable("Weight").unwrap();
    let mut learner = Learner::new(&model).unwrap();
    let mut xs: Vec<f64> = Vec::new();
    for _ in 0..1000 {
        let light = generator.random::<f64>() < 0.55;
        let truth = if light { [45.0, 10.0] } else { [58.0, 12.0] };
        xs.push(Law::Normal.draw(&mut generator, &truth));
        learner.observe(&Case::new(&model).with(weight, xs[xs.len() - 1])).unwrap();
    }
    let learned = learner.learned().unwrap();
    let course = learned.report.expectation.as_ref().unwrap();
    assert!(course.converged && !course.held, "{}", course.steps);
    // Plain steps from the same start, until nothing moves.
    let (mut p, mut mu, mut sigma) = (0.7_f64, [70.0_f64, 20.0], [40.0_f64, 40.0]);
    let mut ln = f64::NEG_INFINITY;
    for _ in 0..200_000 {
        let (mut sums, mut total) = ([[0.0; 3]; 2], 0.0);
        for x in &xs {
            let terms = [0, 1].map(|k| [1.0 - p, p][k].ln() + ln_pdf(*x, mu[k], sigma[k]));
            let most = terms[0].max(terms[1]);
            let sum = terms.iter().map(|term| (term - most).exp()).sum::<f64>();
            total += most + sum.ln();
            for (sums, term) in sums.iter_mut().zip(terms) {
                let share = (term - most).exp() / sum;
                *sums = [sums[0] + share, sums[1] + share * x, sums[2] + share * x * x];
            }
        }
        let before = [p, mu[0], mu[1], sigma[0], sigma[1]];
        p = sums[1][0] / xs.len() as f64;
        mu = [0, 1].map(|k| sums[k][1] / sums[k][0]);
        for k in 0..2 {
            let deviation: f64 = sums[k][2] / sums[k][0] - mu[k] * mu[k];
            sigma[k] = deviation.sqrt();
        }
        ln = total;
        let after = [p, mu[0], mu[1], sigma[0], sigma[1]];
        if before.iter().zip(after).all(|(before, after)| (before - after).abs() < 1e-12 * after.abs()) {
            break;
        }
    }
    let found = [default(&learned, "p"), default(&learned, "mu"), default(&learned, "sigma")].concat();
    near(&found, &[p, mu[0], mu[1], sigma[0], sigma[1]], 2e-3);
    near(&found[..1], &[p], 5e-5);
    assert!(
        (learned.report.ln_likelihood - ln).abs() < 1e-7 * ln.abs(),
        "{} {ln}",
        learned.report.ln_likelihood
    );
}

#[test]
fn a_component_that_closes_in_on_equal_values_is_held() {
    let text = program(
        "K : { a, b }; X : real;",
        "P(K) P(X | K)",
        "P(K) = unknown(histogram); P(X | K) = unknown(normal);",
    );
    let table = format!("X\n{}3\n4\n5\n6\n7\n4.5\n5.5\n5\n4\n6\n", "0\n".repeat(10));
    let mut highest: Vec<f64> = Vec::new();
    for seed in 0..4 {
        let settings = Settings { seed, threshold: 1e-9, ..Settings::default() };
        let learned = seen(&text, &table).learned_with(&settings, &mut |_, _| {}).unwrap();
        let course = learned.report.expectation.as_ref().unwrap();
        assert!(course.converged, "{seed}");
        for pair in course.trail.windows(2) {
            assert!(pair[1] >= pair[0] - 1e-12 * pair[0].abs(), "{seed}: {pair:?}");
        }
        if learned.report.ln_likelihood > 0.0 {
            assert_eq!(learned.report.forms[1].floored, 1, "{seed}");
            highest.push(learned.report.ln_likelihood);
        }
        model_of(&written(&text, &learned));
    }
    // The floor depends on the values, not on the initial point: one component holds the zeros, with a millionth of the
    // deviation of 0, 3, 4, 4.5, 5, 5.5, 6, 7; the other holds the rest, of mean 5 and variance 1.25.
    let values = [0.0, 3.0, 4.0, 4.5, 5.0, 5.5, 6.0, 7.0];
    let mean = values.iter().sum::<f64>() / 8.0;
    let floor = 1e-6 * (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 8.0).sqrt();
    let rest = [3.0, 4.0, 5.0, 6.0, 7.0, 4.5, 5.5, 5.0, 4.0, 6.0];
    let of_rest: f64 = rest.iter().map(|x| ln_pdf(*x, 5.0, 1.25_f64.sqrt())).sum();
    let expected = 20.0 * 0.5_f64.ln() + 10.0 * ln_pdf(0.0, 0.0, floor) + of_rest;
    assert!(!highest.is_empty());
    near(&highest, &vec![expected; highest.len()], 1e-6);
}

#[test]
fn a_law_of_equal_values_is_their_own_and_not_that_of_all() {
    // A thousand zeros: their rate goes to 0, and is not written as 0.
    let zeros =
        program("A : bool; N : 0..=60;", "P(A) P(N | A)", "P(A) = uniform; P(N | A) = unknown(poisson);");
    let table = format!("A,N\n{}1,17\n1,22\n", "0,0\n".repeat(1000));
    let learned = seen(&zeros, &table).learned().unwrap();
    assert_eq!((learned.report.forms[0].floored, learned.report.forms[0].empty), (1, 0));
    near(&both(&zeros, &learned, "P(N = 0 | A = false)"), &[1.0], 1e-11);
    // Rate 19.5: ln P of 17 and 22, normalised over 0..=60, which is 1 to 10⁻¹².
    let ln = |n: u32| f64::from(n) * 19.5_f64.ln() - 19.5 - (1..=n).map(|k| f64::from(k).ln()).sum::<f64>();
    near(&[learned.report.ln_likelihood], &[ln(17) + ln(22) + 1002.0 * 0.5_f64.ln()], 1e-8);
    for law in ["normal", "lognormal", "uniform", "gamma", "weibull", "exponential", "beta"] {
        let text = program(
            "A : bool; X : real;",
            "P(A) P(X | A)",
            &format!("P(A) = uniform; P(X | A) = unknown({law});"),
        );
        let (same, others) = if law == "exponential" { ("0", ["1", "3"]) } else { ("0.25", ["0.5", "0.75"]) };
        let table = format!("A,X\n{}1,{}\n1,{}\n", format!("0,{same}\n").repeat(5), others[0], others[1]);
        let learned = seen(&text, &table).learned().unwrap();
        assert_eq!(learned.report.forms[0].floored, 1, "{law}");
        // All of its mass is near the value: the density there is higher than that of any law fitted to all values.
        assert!(both(&text, &learned, &format!("P(X = {same} | A = false)"))[0] > 100.0, "{law}");
        let alike = format!("A,X\n{}", format!("0,{same}\n").repeat(5));
        assert!(seen(&text, &alike).learned().is_err(), "{law}: no data separate the values");
    }
}

#[test]
fn many_reals_do_not_underflow() {
    // 400 reals of 20 cases, far from both laws: P of a case is about e^−1000 000 under either.
    let names: Vec<String> = (0..400).map(|number| format!("F{number}")).collect();
    let factors: String = names.iter().map(|name| format!(" P({name} | C)")).collect();
    let forms: String = names
        .iter()
        .map(|name| format!(" P({name} | C) = normal(if C {{ mean }} else {{ 1 }}, 1);"))
        .collect();
    let text = program(
        &format!("C : bool; {} : real;", names.join(", ")),
        &format!("P(C){factors}"),
        &format!("P(C) = bernoulli(p);{forms}"),
    )
    .replace("variables", "parameters { p : probability = 0.4; mean : real = 2; } variables")
    .replace("forms {", "identification { p, mean from d; } forms {");
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut table = names.join(",");
    let (mut high, mut total, mut sum) = (0.0, 0.0, 0.0);
    for case in 0..20 {
        let is_high = case % 4 == 0;
        high += f64::from(u8::from(is_high));
        let cells: Vec<f64> =
            names.iter().map(|_| (if is_high { 90.0 } else { 1.0 }) + generator.random::<f64>()).collect();
        total += if is_high { cells.len() as f64 } else { 0.0 };
        sum += if is_high { cells.iter().sum::<f64>() } else { 0.0 };
        let cells: Vec<String> = cells.iter().map(f64::to_string).collect();
        table.push_str(&format!("\n{}", cells.join(",")));
    }
    let learned = seen(&text, &table).learned().unwrap();
    // The two components are well separated, so the maximum is that of cases with C known.
    near(&default(&learned, "p"), &[high / 20.0], 1e-9);
    near(&default(&learned, "mean"), &[sum / total], 1e-9 * 90.0);
    assert!(learned.report.ln_likelihood.is_finite() && learned.report.ln_likelihood < -8000.0);
}

#[test]
fn the_likelihood_is_that_of_the_whole_program() {
    // H hidden and known, S learned and sometimes missing, Z known: enumerated by hand.
    let text = program(
        "H, S : bool; Z : real; D : bool;",
        "P(H) P(S | H) P(Z | S H) P(D | S)",
        "P(H) = bernoulli(0.3); P(S | H) = bernoulli(s[H]); P(D | S) = dirac(not S);
         P(Z | S H) = normal(if S and H { 2 } else { 0 }, 1.5);",
    )
    .replace("variables", "parameters { s[0..=1] : probability = [0.2, 0.7]; } variables")
    .replace("forms {", "identification { s from d; } forms {");
    let rows = [(Some(true), 1.0), (None, -0.5), (Some(false), 2.2), (None, 2.7), (Some(true), 0.3)];
    let table = rows.iter().fold("S,Z,D\n".to_owned(), |table, (s, z)| {
        let (s, d) = s.map_or((String::new(), String::new()), |s| (s.to_string(), (!s).to_string()));
        format!("{table}{s},{z},{d}\n")
    });
    let learned = seen(&text, &table).learned().unwrap();
    let s_of = default(&learned, "s");
    let mut ln = 0.0;
    for (s, z) in rows {
        let mut p = 0.0;
        for h in [false, true] {
            for value in [false, true].into_iter().filter(|value| s.is_none_or(|s| s == *value)) {
                let chance = s_of[usize::from(h)];
                p += if h { 0.3 } else { 0.7 }
                    * if value { chance } else { 1.0 - chance }
                    * ln_pdf(z, if value && h { 2.0 } else { 0.0 }, 1.5).exp();
            }
        }
        ln += p.ln();
    }
    near(&[learned.report.ln_likelihood], &[ln], 1e-11);
    assert_eq!(*learned.report.expectation.unwrap().trail.last().unwrap(), learned.report.ln_likelihood);
}
