//! Bins: their edges, restricted distributions, and distributions far narrower, or far away.
//!
//! In: programs of one variable. Out: probabilities. Invariant: expected values are closed forms, worked out in the
//! comments; no expected value comes from this crate.

use crate::support::{model_of, question};
use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Bins;
use bp_core::prelude::*;

/// The probabilities of the values of X.
fn probabilities(domain: &str, form: &str) -> Vec<f64> {
    let model = model_of(&format!(
        "program One {{ variables {{ X : {domain}; }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}"
    ));
    let answers = ask(&model, &question(&model, "P(X)"), &Inputs::new());
    let answers = answers.unwrap_or_else(|error| panic!("{domain} {form}: {error}"));
    answers[0].answer.iter().map(|row| row.p().unwrap()).collect()
}

#[track_caller]
fn near(domain: &str, form: &str, expected: &[f64]) {
    let found = probabilities(domain, form);
    assert_eq!(found.len(), expected.len(), "{domain} {form}");
    let close = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() <= 1e-12);
    assert!(close, "{domain} {form}: {found:?}, expected {expected:?}");
}

/// Each mass divided by their sum.
fn shares(masses: &[f64]) -> Vec<f64> {
    let total: f64 = masses.iter().sum();
    masses.iter().map(|mass| mass / total).collect()
}

/// The integral of x e⁻ˣ, the density of gamma(2, 1), between two bounds.
fn gamma_mass(from: f64, to: f64) -> f64 {
    let below = |x: f64| 1.0 - (1.0 + x) * (-x).exp();
    below(to) - below(from)
}

#[test]
fn a_truncated_distribution_has_the_mass_of_a_part_of_a_bin() {
    let parts =
        |ends: &[f64]| shares(&ends.windows(2).map(|pair| gamma_mass(pair[0], pair[1])).collect::<Vec<_>>());
    let five = "bins(0, 10, 5)";
    let with_none = |mut masses: Vec<f64>| {
        masses.push(0.0);
        masses
    };
    near(five, "truncated(gamma(2, 1), 1.5, 7)", &with_none(parts(&[1.5, 2.0, 4.0, 6.0, 7.0])));
    near(five, "truncated(gamma(2, 1), 1, 7)", &with_none(parts(&[1.0, 2.0, 4.0, 6.0, 7.0])));
    near(five, "truncated(gamma(2, 1), 3.2, 3.8)", &[0.0, 1.0, 0.0, 0.0, 0.0]);
    near("bins[0, 2, 4, 10]", "truncated(gamma(2, 1), 1.5, 7)", &parts(&[1.5, 2.0, 4.0, 7.0]));
    // Lengths ½, 2, 2 and 1.
    let even = [1.0, 4.0, 4.0, 2.0, 0.0].map(|mass| mass / 11.0);
    near(five, "truncated(uniform(0, 10), 1.5, 7)", &even);
}

/// The density of von_mises(m, κ) is 1/2π for a small κ; that of a very wide normal distribution is flat too.
#[test]
fn a_truncated_distribution_of_a_circle_has_the_mass_of_a_part_of_a_bin() {
    near("circle(0, 6, 3)", "truncated(von_mises(1, 1e-30), 1, 4.5)", &shares(&[1.0, 2.0, 0.5]));
    near("circle(0, 6, 3)", "truncated(normal(1, 1e9), 1, 4.5)", &shares(&[1.0, 2.0, 0.5]));
    near("circle(0, 6, 3)", "truncated(normal(3, 1), 2.5, 3.5)", &[0.0, 1.0, 0.0]);
    // Parts of two bins, on both sides of the mean.
    near("circle(0, 6, 6)", "truncated(normal(3, 1), 2.5, 3.5)", &[0.0, 0.0, 0.5, 0.5, 0.0, 0.0]);
}

#[test]
fn whole_numbers_are_not_cut_into_bins() {
    for form in [
        "poisson(2)",
        "binomial(4, 0.5)",
        "geometric(0.5)",
        "mixture(0.5, poisson(2), 0.5, normal(1, 1))",
        "unknown(poisson)",
    ] {
        let text = format!(
            "program One {{ variables {{ X : bins(0, 10, 5); }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}"
        );
        let message = Program::parse(&text).err().unwrap_or_else(|| panic!("{form} is accepted")).to_string();
        assert!(
            message.contains("distributes whole numbers") && message.contains("X : 0..=100"),
            "{message}"
        );
    }
}

/// Where densities are beyond the range of numbers, the largest one wins.
#[test]
fn a_very_narrow_or_distant_distribution_is_on_its_nearest_value() {
    for (domain, form, only) in [
        // The nearest to 0.2 is 0.
        ("-1..=2", "normal(0.2, 1e-20)", 1),
        ("-1..=2", "laplace(0.2, 1e-50)", 1),
        ("-1..=2", "student_t(1e300, 0.2, 1e-20)", 1),
        // e^1e17 is beyond the last value; e^0.1 is 1.1.
        ("1..=3", "lognormal(1e17, 1)", 2),
        ("-1..=3", "lognormal(0.1, 1e-300)", 2),
        ("1..=3", "lognormal(-1e17, 1)", 0),
        // e^(−1e300 x), x > 0
        ("-1..=3", "gamma(1, 1e300)", 2),
        ("bins(-1, 3, 4)", "gamma(1e300, 1)", 3),
        ("circle(0, 6, 6)", "von_mises(0.2, 1e100)", 0),
        ("circle(0, 6, 6)", "normal(0.2, 1e-100)", 0),
    ] {
        let mut expected = vec![0.0; probabilities(domain, form).len()];
        expected[only] = 1.0;
        near(domain, form, &expected);
    }
    // e^(x − 1e17) over each bin; and a normal density whose logarithm has the slope 1e17/s² = 1/10 at 4.
    let slope = |slope: f64| shares(&[3.0, 2.0, 1.0, 0.0].map(|bins: f64| (-slope * bins).exp()));
    near("bins(0, 4, 4)", "laplace(1e17, 1)", &slope(1.0));
    near("bins(0, 4, 4)", "normal(1e17, 1e9)", &slope(0.1));
    near("bins(0, 4, 4)", "normal(1e17, 1)", &[0.0, 0.0, 0.0, 1.0]);
    // Two values equally near.
    near("0..=2", "normal(0.5, 1e-30)", &[0.5, 0.5, 0.0]);
    // 1e17 is 4 mod 6.
    for law in ["von_mises", "normal"] {
        let (far, here) = (format!("{law}(1e17, 2)"), format!("{law}(4, 2)"));
        near("circle(0, 6, 6)", &far, &probabilities("circle(0, 6, 6)", &here));
    }
}

#[test]
fn decimals_are_in_the_bin_above_their_edge() {
    // Bounds, number of bins, and numbers with the edge that each of them is in exact arithmetic.
    type Case<'c> = (f64, f64, usize, &'c [(f64, usize)]);
    let cases: [Case<'_>; 4] = [
        (0.0, 1.0, 10, &[(0.3, 3), (0.6, 6), (0.7, 7), (0.1 + 0.2, 3), (3.0 * 0.1, 3), (1.0 - 0.7, 3)]),
        (0.0, 0.7, 7, &[(0.3, 3), (0.6, 6), (0.1, 1)]),
        (0.0, 100.0, 1000, &[(0.3, 3), (0.6, 6), (0.7, 7), (4.1, 41)]),
        (-1.0, 1.0, 20, &[(0.3 - 0.1 - 0.2, 10), (-0.7, 3), (0.3, 13)]),
    ];
    for (low, high, count, numbers) in cases {
        for circle in [false, true] {
            let bins = Bins::even(low, high, count, circle).unwrap();
            for (number, edge) in numbers {
                assert_eq!(bins.holding(*number), Some(*edge), "{number} in ({low}, {high}, {count})");
            }
        }
        // The same in a kernel.
        for (number, edge) in numbers {
            let text = format!("dirac({number:?})");
            let found = probabilities(&format!("bins({low:?}, {high:?}, {count})"), &text);
            assert_eq!(found.iter().position(|p| *p == 1.0), Some(*edge), "{text}: {found:?}");
        }
    }
    let between = Bins::between(vec![0.0, 0.1, 0.2, 0.3, 0.4]).unwrap();
    assert_eq!((between.holding(0.1 + 0.2), between.holding(1.0 - 0.7)), (Some(3), Some(3)));
    near("bins[0, 0.1, 0.2, 0.3, 0.4]", "dirac(1 - 0.7)", &[0.0, 0.0, 0.0, 1.0]);
    // The ends, within rounding; and numbers that differ from an edge by more.
    let tenths = Bins::even(0.0, 1.0, 10, false).unwrap();
    assert_eq!((tenths.holding(0.1 + 0.2 + 0.7), tenths.holding(1.0 + 1e-14)), (Some(9), None));
    assert_eq!((tenths.holding(-1e-17), tenths.holding(-1e-14)), (Some(0), None));
    assert_eq!(tenths.holding(0.3 - 1e-14), Some(2));
    let narrow = Bins::between(vec![0.0, 1e-20, 1.0, 1.0 + f64::EPSILON]).unwrap();
    assert_eq!((narrow.holding(5e-21), narrow.holding(1.0 - f64::EPSILON)), (Some(0), Some(1)));
}
