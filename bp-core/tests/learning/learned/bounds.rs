//! Bounds of the parameters: the floor of a width, the limit of a shape.
//!
//! In: values of which many are equal, or few differ. Out: estimates, and why they are at a bound. Invariant: expected numbers
//! are from mpmath with 30 digits, or computed by hand.

use crate::support::learning::{both, near, program, seen};
use crate::support::model_of;
use bp_core::compiler::data::read_table;
use bp_core::compiler::learn::{Columns, Learner, Report, Settings};
use std::path::Path;

fn report(domain: &str, law: &str, values: &str) -> Report {
    let text = program(&format!("X : {domain};"), "P(X)", &format!("P(X) = unknown({law});"));
    let table = format!("X\n{}\n", values.replace(' ', "\n"));
    seen(&text, &table).learned().unwrap_or_else(|error| panic!("{law} {values}: {error}")).report
}

#[test]
fn laws_with_heavy_tails_are_the_most_likely_with_a_scale_above_the_floor() {
    // Σ ln f(x) at (10⁶, ½, ½), (1, 0, 10⁻⁶), (1, 0, 3 · 10⁻⁶), (10⁶, 3/2, 3/2); cauchy at (½, ½), (½, ½), (0, 10⁻⁶).
    for (law, values, expected, bounds) in [
        ("student_t", "0 1", -1.451_583_705_289_288_2, (0, 1)),
        ("student_t", "0 0 1", 10.381_320_900_415_074, (1, 0)),
        ("student_t", "3 0 0 3 0", 2.598_799_685_374_724_8, (1, 0)),
        ("student_t", "0 0 3 3", -7.297_616_565_251_015, (0, 1)),
        ("cauchy", "0 1", -2.289_459_771_698_800_3, (0, 0)),
        ("cauchy", "0 0 1 1", -4.578_919_543_397_601, (0, 0)),
        ("cauchy", "0 0 1", 10.381_320_900_415_074, (1, 0)),
    ] {
        let report = report("real", law, values);
        let found = report.ln_likelihood;
        assert!((found - expected).abs() < 1e-6, "{law} {values}: {found}, expected {expected}");
        assert_eq!((report.forms[0].floored, report.forms[0].limited), bounds, "{law} {values}");
    }
}

#[test]
fn values_that_differ_are_not_reported_as_equal() {
    for (domain, law, values) in [
        ("real", "student_t", "1 2 2 3 4"),
        ("0..=9", "negative_binomial", "1 2"),
        ("real", "gamma", "1 1.0000001"),
        ("real", "von_mises", "0 3.141592653589793"),
    ] {
        let report = report(domain, law, values);
        assert_eq!((report.forms[0].floored, report.forms[0].limited), (0, 1), "{law}");
    }
}

#[test]
fn contexts_without_cases_are_empty_and_not_at_the_floor() {
    let sounds = "program Sounds over C in Grid {
        parameters { mu[Grid], sigma : real; }
        variables { Tau : real; }
        decomposition { P(Tau) }
        forms { P(Tau) = normal(mu[C], sigma); }
        identification { mu from recordings by C; sigma from recordings; }
    }";
    let report = seen(sounds, "C,Tau\n0,1\n3,4\n").learned().unwrap().report;
    assert_eq!((report.forms[0].contexts, report.forms[0].floored, report.forms[0].empty), (4, 2, 2));
}

#[test]
fn the_floor_holds_for_cases_with_weights() {
    let text = program("R : real;", "P(R)", "P(R) = unknown(normal);");
    let table = read_table(Path::new("d.csv"), "R,w\n2,1\n3,1e-20\n5,1e-30\n".as_bytes()).unwrap();
    let mut learner = Learner::new(&model_of(&text)).unwrap();
    learner.observe_table(&table, &Columns { weight: Some("w".to_owned()), ..Columns::default() }).unwrap();
    let learned = learner.learned().unwrap();
    assert_eq!(learned.report.forms[0].floored, 1);
    // A millionth of the deviation of 2, 3 and 5: their squares from the mean 10/3 are 16/9, 1/9 and 25/9.
    let floor = 1e-6 * (42.0f64 / 27.0).sqrt();
    let density = 1.0 / (floor * (2.0 * std::f64::consts::PI).sqrt());
    near(&both(&text, &learned, "P(R = 2)"), &[density], 1e-8 * density);
}

#[test]
fn a_mixture_with_heavy_tails_keeps_the_likelihood_of_its_course() {
    let text =
        program("K : bool; X : real;", "P(K) P(X | K)", "P(K) = unknown; P(X | K) = unknown(student_t);");
    for seed in 0..4 {
        let settings = Settings { seed, ..Settings::default() };
        let learned = seen(&text, "X\n0\n1\n10\n11\n").learned_with(&settings, &mut |_, _| {}).unwrap();
        // One normal law for all, m = 11/2, s² = 101/4.
        let one = -2.0 * ((2.0 * std::f64::consts::PI * 25.25).ln() + 1.0);
        let found = learned.report.ln_likelihood;
        assert!(found > one - 1e-3, "seed {seed}: {found}, one law has {one}");
        let trail = learned.report.expectation.unwrap().trail;
        assert!(trail.windows(2).all(|pair| pair[1] >= pair[0] - 1e-12 * pair[0].abs()), "{seed}");
    }
}

/// Truncated to 0..=9, the likelihood of values that are all 9 increases with the rate: P(9) = 1 / (1 + 9/r + 72/r² + …).
#[test]
fn a_rate_ends_at_a_limit_where_all_values_are_the_largest() {
    for (domain, law, values, most) in [
        ("0..=9", "poisson", "9 9 9", 9e6),
        ("0..=9", "geometric", "9 9 9", 9e6),
        ("bins(0, 10, 5)", "exponential", "9.5 9.2 9.9", 9e6),
    ] {
        let text = program(
            &format!("A : {{ a, b }}; X : {domain};"),
            "P(A) P(X | A)",
            &format!("P(A) = unknown(dirichlet(1)); P(X | A) = unknown({law});"),
        );
        let rows: Vec<String> = values.split(' ').map(|value| format!("b,{value}\n")).collect();
        let table = format!("A,X\na,1\na,2\na,4\n{},2\n", rows.concat());
        let learned = seen(&text, &table).learned().unwrap_or_else(|error| panic!("{law}: {error}"));
        let report = learned.report.clone();
        assert!(report.expectation.as_ref().is_some_and(|course| course.converged), "{law}");
        assert_eq!((report.forms[1].limited, report.forms[1].floored), (1, 0), "{law}");
        // The number of the second context, in the written program.
        let words = learned.text();
        let own = words.split(&format!("b => {law}(")).nth(1).and_then(|rest| rest.split(')').next());
        let number: f64 = own.unwrap_or_else(|| panic!("{words}")).parse().unwrap();
        let mean = match law {
            "poisson" => number,
            "geometric" => (1.0 - number) / number,
            _ => 1.0 / number,
        };
        assert!((0.01 * most..=most).contains(&mean), "{law}: {mean}");
        // Under poisson(r) 9 has 1 − 9/r; a geometric law or an exponential one is flat.
        let last = both(&text, &learned, "P(X | A = b)").pop().unwrap();
        let expected = match law {
            "poisson" => 1.0,
            "geometric" => 0.1,
            _ => 0.2,
        };
        assert!((last - expected).abs() < 2e-4, "{law}: {last}");
    }
}
