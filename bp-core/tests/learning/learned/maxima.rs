//! Convergence of EM: it reaches a maximum, in few steps.
//!
//! In: mixtures whose components overlap. Out: the estimates, and the number of steps. Invariant: the maximum is that
//! of plain EM, written out here and iterated until it converges.

use crate::support::learning::{near, program, seen};
use bp_core::compiler::learn::{Learned, Settings};

/// Numbers in [0, 1[ from Knuth's linear congruence.
fn units(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    }
}

fn found(text: &str, table: &str) -> Learned {
    let learned = seen(text, table).learned_with(&Settings::default(), &mut |_, _| {}).unwrap();
    let course = learned.report.expectation.as_ref().unwrap();
    assert!(course.converged && course.steps < 400, "{} steps", course.steps);
    learned
}

fn parameter(learned: &Learned, name: &str) -> Vec<f64> {
    learned.model().parameters.values().find(|it| it.name == name).unwrap().default.clone()
}

/// Weight of the first component, means, deviations: plain EM until nothing changes.
fn plain(numbers: &[f64], mut at: [f64; 5]) -> [f64; 5] {
    for _ in 0..200_000 {
        let [p, m, n, s, t] = at;
        let mut sums = [[0.0; 3]; 2];
        for x in numbers {
            let one = p / s * (-0.5 * ((x - m) / s).powi(2)).exp();
            let other = (1.0 - p) / t * (-0.5 * ((x - n) / t).powi(2)).exp();
            for (sums, share) in sums.iter_mut().zip([one / (one + other), other / (one + other)]) {
                sums.iter_mut().zip([1.0, *x, x * x]).for_each(|(sum, power)| *sum += share * power);
            }
        }
        let law =
            |[total, sum, squares]: [f64; 3]| (sum / total, (squares / total - (sum / total).powi(2)).sqrt());
        let ((m, s), (n, t)) = (law(sums[0]), law(sums[1]));
        let next = [sums[0][0] / numbers.len() as f64, m, n, s, t];
        if next.iter().zip(at).all(|(next, at)| (next - at).abs() < 1e-13) {
            return next;
        }
        at = next;
    }
    panic!("plain EM has not come to rest");
}

#[test]
fn two_normal_laws_that_overlap_are_those_of_plain_em() {
    let mut unit = units(7);
    let numbers: Vec<f64> = (0..1000)
        .map(|_| {
            // Twelve uniform numbers less six are nearly normal.
            let normal = (0..12).map(|_| unit()).sum::<f64>() - 6.0;
            if unit() < 0.3 { normal } else { 2.2 + 1.1 * normal }
        })
        .collect();
    let text = "program Two {
        parameters { p : probability = 0.5; mu[0..=1] : real = [2, 0]; sigma[0..=1] : real = [1, 1]; }
        variables { First : bool; X : real; } decomposition { P(First) P(X | First) }
        forms { P(First) = bernoulli(p); P(X | First) = normal(mu[First], sigma[First]); }
        identification { p, mu, sigma from x; } }";
    let table: String =
        std::iter::once("X\n".to_owned()).chain(numbers.iter().map(|x| format!("{x}\n"))).collect();
    let learned = found(text, &table);
    let [p, m, n, s, t] = plain(&numbers, [0.5, 0.0, 2.0, 1.0, 1.0]);
    near(&parameter(&learned, "p"), &[p], 1e-4);
    near(&parameter(&learned, "mu"), &[n, m], 1e-4);
    near(&parameter(&learned, "sigma"), &[t, s], 1e-4);
}

#[test]
fn ten_rows_with_weights_come_to_rest() {
    // Three answers that depend on a hidden class: eight rows with the weights of an equal mixture of the laws 0.7,
    // 0.6, 0.8 and 0.3, 0.2, 0.4. Two more rows are uninformative.
    let chance = |row: usize, laws: [f64; 3]| -> f64 {
        laws.iter().enumerate().map(|(bit, p)| if row >> bit & 1 == 1 { *p } else { 1.0 - p }).product()
    };
    let mut table = "A,B,C,w\n".to_owned();
    for row in (0..8).chain([3, 5]) {
        let weight = 500.0 * (chance(row, [0.7, 0.6, 0.8]) + chance(row, [0.3, 0.2, 0.4]));
        let weight = if row == 3 || row == 5 { 0.5 * weight } else { weight };
        table.push_str(&format!("{},{},{},{weight}\n", row & 1, row >> 1 & 1, row >> 2 & 1));
    }
    let text = program(
        "K, A, B, C : bool;",
        "P(K) P(A | K) P(B | K) P(C | K)",
        "P(K) = unknown(histogram); P(A | K) = unknown(histogram); P(B | K) = unknown(histogram); P(C | K) = unknown(histogram);",
    );
    let table = bp_core::compiler::data::read_table(std::path::Path::new("d.csv"), table.as_bytes()).unwrap();
    let mut learner = bp_core::compiler::learn::Learner::new(&crate::support::model_of(&text)).unwrap();
    let columns = bp_core::compiler::learn::Columns {
        hidden: vec!["K".to_owned()],
        weight: Some("w".to_owned()),
        ..Default::default()
    };
    learner.observe_table(&table, &columns).unwrap();
    let learned = learner.learned().unwrap();
    let course = learned.report.expectation.as_ref().unwrap();
    assert!(course.converged && course.steps < 400, "{} steps", course.steps);
    // The weights are exactly those of a mixture: the maximum is their own entropy.
    let own = |row: usize| 0.5 * (chance(row, [0.7, 0.6, 0.8]) + chance(row, [0.3, 0.2, 0.4]));
    let expected: f64 = (0..8).map(|row| 1000.0 * own(row) * own(row).ln()).sum();
    let found = learned.report.ln_likelihood;
    assert!((found - expected).abs() < 1e-6, "{found}, expected {expected}");
}

#[test]
fn hidden_states_with_laws_over_integers_are_separated_from_every_start() {
    // Laws over integers have no closed M step: without their normaliser the step is too long where both are nearly equal.
    // The largest ln L over two rows of transitions, two means and two deviations by the simplex method of Nelder and Mead,
    // apart from this program, with the forward recursion: −13.743 358 8; with the moments of the values as means and
    // deviations, as without the normaliser, −13.743 519 3, where EM must not stop.
    let text = program(
        "S, S^-1 : bool; Y : 0..=20;",
        "P(S^-1) P(S | S^-1) P(Y | S)",
        "P(S^-1) = previous(S) else uniform; P(S | S^-1) = unknown(histogram); P(Y | S) = unknown(normal);",
    );
    let learner = seen(&text, "Y\n3\n4\n15\n16\n2\n3\n3\n17\n");
    for seed in 0..12 {
        let settings = Settings { seed, ..Settings::default() };
        let learned = learner.learned_with(&settings, &mut |_, _| {}).unwrap();
        let course = learned.report.expectation.as_ref().unwrap();
        assert!(course.converged && course.steps < 10_000, "seed {seed}: {} steps", course.steps);
        let found = learned.report.ln_likelihood;
        assert!((-13.743_359_5..=-13.743_358).contains(&found), "seed {seed}: {found}");
    }
}
