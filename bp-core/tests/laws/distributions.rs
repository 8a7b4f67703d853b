//! Distributions as numbers, compared with the kernels; and their draws.
//!
//! In: one-factor programs, random parents. Out: pass if both agree to 1e-12. Invariant: both evaluate the equations of
//! `forms/`; `tests/agreement` compares these with enumeration and quadrature, which share no code with them, and the
//! densities of laws are tested against statrs.

use crate::support::{model_of, question};
use bp_core::compiler::answer::ask;
use bp_core::compiler::distribution::{Distribution, Setting};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::exec::scalar::{Extended, Scalar};
use bp_core::compiler::ids::VariableId;
use bp_core::compiler::law::Law;
use bp_core::compiler::model::Model;
use bp_core::compiler::random::seeded;
use rand::RngExt;

fn one(domain: &str, form: &str) -> Model {
    model_of(&format!(
        "program One {{ parameters {{ m[1..=2] : real = [0.5, -1.5]; }}
         variables {{ A, B : bool; K : 1..=2; X : {domain}; }}
         decomposition {{ P(A) P(B) P(K) P(X | A B K) }}
         forms {{ P(A) = bernoulli(0.5); P(B) = bernoulli(0.5); P(K) = uniform; P(X | A B K) = {form}; }} }}"
    ))
}

fn variable(model: &Model, name: &str) -> VariableId {
    model.variable(name).unwrap()
}

/// The distribution of X at these values of the parents.
fn distribution(model: &Model, [a, b, k]: [usize; 3]) -> Distribution {
    let inputs = Inputs::new();
    let setting = Setting::new(model, &inputs).unwrap();
    let instance = setting.ordered().unwrap().pop().unwrap();
    let mut values = vec![f64::NAN; setting.slots()];
    for (name, value) in [("A", a), ("B", b), ("K", k)] {
        values[setting.slots_of(variable(model, name)).start] = value as f64;
    }
    setting.distribution(&instance, &values).unwrap()
}

fn kernel(model: &Model, searched: &str, [a, b, k]: [usize; 3]) -> Vec<f64> {
    let text = format!("P({searched} | A = {}, B = {}, K = {})", a == 1, b == 1, k + 1);
    let answers = ask(model, &question(model, &text), &Inputs::new()).unwrap();
    answers[0].answer.iter().map(|row| row.figure.number().unwrap()).collect()
}

fn parents() -> impl Iterator<Item = [usize; 3]> {
    (0..8).map(|number| [number & 1, number >> 1 & 1, number >> 2 & 1])
}

const FINITE: [(&str, &str); 64] = [
    ("bool", "bernoulli(if A { 0.2 } else { 0.1 * K })"),
    ("bool", "mixture(0.5, bernoulli(0.2), 0.5, mixture(0.5, bernoulli(1), 0.5, bernoulli(0)))"),
    ("bool", "dirac(A and not B)"),
    ("1..=3", "uniform"),
    ("1..=3", "dirac(K + 2)"),
    ("1..=3", "categorical(0.2, 0.5, 0.3)"),
    ("1..=3", "histogram(1, 3, 4)"),
    ("1..=3", "laplace_succession(0, K, 4)"),
    ("0..=3", "weights(if A { X + 1 } else { if X == K { 1 } else { 0 } })"),
    ("0..=3", "weights(if A and B { 0 } else { 1 })"),
    ("{ Left, Ahead, Right }", "softmax(0, m[K], 1000 - 999)"),
    ("{ No } or 1..=6", "normal_bins(2.5 + m[K], 0.7)"),
    ("{ No } or 1..=6", "normal_bins(if A { 6.6 } else { 6.4 }, 0.7)"),
    ("0..=6", "uniform(0, 4)"),
    ("0..=6", "normal(2 + m[K], 1.5)"),
    ("0..=6", "normal(500 * m[K], 1.5)"),
    ("0..=6", "lognormal(0.5, 0.6)"),
    ("0..=6", "exponential(0.7)"),
    ("0..=6", "gamma(2, 0.8)"),
    ("0..=6", "von_mises(1, 2)"),
    ("0..=6", "weibull(1.5, 2)"),
    ("0..=6", "binomial(5, 0.3)"),
    ("0..=6", "poisson(2.2)"),
    ("0..=6", "half_normal(1.5)"),
    ("0..=6", "half_cauchy(K)"),
    ("-3..=6", "student_t(3, m[K], 1.5)"),
    ("-3..=6", "cauchy(m[K], 0.5)"),
    ("-3..=6", "laplace(m[K], K)"),
    ("0..=6", "negative_binomial(K, 0.4)"),
    ("0..=6", "geometric(0.3)"),
    ("-1..=6", "zero_inflated(0.1 * K, poisson(K))"),
    ("bool", "bernoulli(logistic(m[K]))"),
    ("bool", "bernoulli(probit(m[K]))"),
    ("-3..=6", "if A { normal(K, 1) } else if B { poisson(2) } else { uniform }"),
    ("0..=6", "truncated(normal(2, 1.5), 1, 2 + K)"),
    ("0..=6", "mixture(0.25, poisson(K), 0.75, normal(0, 1))"),
    ("bins(0, 1, 10)", "uniform(0, 4)"),
    ("bins(0, 1, 10)", "normal(m[K], 0.3)"),
    ("bins(0, 1, 10)", "lognormal(0.5, 0.6)"),
    ("bins(0, 1, 10)", "exponential(0.7)"),
    ("bins(0, 1, 10)", "gamma(2, 0.8)"),
    ("bins(0, 1, 10)", "beta(2, 3)"),
    ("bins(0, 1, 10)", "von_mises(1, 2)"),
    ("bins(0, 1, 10)", "weibull(1.5, 2)"),
    ("bins(-1, 1, 10)", "half_normal(0.4)"),
    ("bins(-1, 1, 10)", "half_cauchy(0.4)"),
    ("bins(-1, 1, 10)", "student_t(0.5, m[K], 0.3)"),
    ("bins(-1, 1, 10)", "cauchy(m[K], 0.3)"),
    ("bins(-1, 1, 10)", "laplace(m[K], 0.3)"),
    ("bins(0, 1, 10)", "truncated(cauchy(0.5, 0.3), 0.2, 0.7)"),
    ("bins(0, 1, 10)", "truncated(gamma(2, K), 0.25, 0.77)"),
    ("bins(0, 1, 10)", "mixture(0.25, truncated(beta(2, 3), 0.13, 0.5), 0.75, normal(m[K], 0.3))"),
    ("circle(0, 6, 6)", "truncated(normal(m[K], 1.5), 1.25, 4.75)"),
    ("circle(0, 6, 6)", "truncated(von_mises(m[K], 2), 1.25, 4.75)"),
    ("bins[0, 0.5, 3]", "weibull(1.5, 2)"),
    ("bins[0, 0.5, 3]", "gamma(1.5, K)"),
    ("bins(0, 1, 10)", "truncated(normal(0.5, 0.3), 0.2, 0.7)"),
    ("bins(-50, 50, 20)", "dirac(m[K] * 10)"),
    ("bins(-50, 50, 20)", "dirac(if A { 50 } else { -10 })"),
    ("circle(0, 360, 36)", "normal(355 * K, 20)"),
    ("circle(0, 360, 36)", "von_mises(355, 3)"),
    ("circle(0, 360, 36)", "dirac(725 * m[K])"),
    ("circle(0, 360, 36)", "uniform"),
    ("circle(0, 360, 36)", "mixture(0.5, normal(0, 10), 0.5, uniform)"),
];

#[test]
fn over_finite_domains_both_engines_agree() {
    for (domain, form) in FINITE {
        let model = one(domain, form);
        for parents in parents() {
            let found = match distribution(&model, parents) {
                Distribution::Finite(found) => found,
                Distribution::Wide(found) => found.iter().map(|p| p.to_f64()).collect(),
                other => panic!("{form}: {other:?}"),
            };
            let sum: f64 = found.iter().sum();
            assert!((sum - 1.0).abs() < 1e-12 || sum == 0.0, "{form} {parents:?}: {sum}");
            if sum == 0.0 {
                // A Dirac outside its domain: such parents have probability 0, also in the kernel.
                let [a, b, k] = parents;
                let text = format!("P(X | A = {}, B = {}, K = {})", a == 1, b == 1, k + 1);
                let error = ask(&model, &question(&model, &text), &Inputs::new()).unwrap_err();
                assert!(matches!(error, Error::Impossible(_)), "{form} {parents:?}: {error}");
                continue;
            }
            let expected = kernel(&model, "X", parents);
            assert_eq!(found.len(), expected.len(), "{form}");
            for (p, q) in found.iter().zip(&expected) {
                assert!((p - q).abs() < 1e-12, "{form} {parents:?}: {found:?}, kernel {expected:?}");
            }
        }
    }
}

const REAL: [&str; 18] = [
    "uniform(0, 4)",
    "normal(m[K], if A { 1 } else { 2 })",
    "lognormal(0.5, 0.6)",
    "exponential(0.7 * K)",
    "gamma(2, 0.8)",
    "beta(2, 3)",
    "von_mises(1, 2)",
    "weibull(1.5, 2)",
    "half_normal(1.5)",
    "half_cauchy(K)",
    "student_t(50 * K, m[K], 0.3)",
    "cauchy(m[K], 0.5)",
    "laplace(m[K], K)",
    "truncated(normal(2, 1.5), 0.2, 3)",
    "truncated(cauchy(2, 1.5), 0.2, 3)",
    "truncated(laplace(2, 1.5), 0.2, 3)",
    "mixture(0.3, normal(0, 1), 0.7, exponential(2))",
    "if A { normal(0, 1) } else if B { gamma(2, K) } else { mixture(1, normal(K, 2)) }",
];

#[test]
fn densities_of_reals_are_those_of_the_kernel() {
    for form in REAL {
        let model = one("real", form);
        for (parents, x) in parents().flat_map(|parents| [0.25, 0.75, 3.5, -1.0].map(|x| (parents, x))) {
            let found = distribution(&model, parents).ln_density(x).exp();
            let expected = kernel(&model, &format!("X = {x}"), parents)[0];
            assert!((found - expected).abs() < 1e-12, "{form} {parents:?} {x}: {found}, kernel {expected}");
        }
    }
}

#[test]
fn families_and_tables_over_several_variables_agree() {
    let model = model_of(
        "program Many { parameters { N : size = 3; s[1..=3] : real = [0.5, 1, 2]; }
         variables { A : bool; D : 1..=3; Z[1..=N] : real; X, Y : bool; }
         decomposition { P(A) P(D | A) prod(i) { P(Z[i] | D) } P(X Y | A D) }
         forms { P(A) = bernoulli(0.3); P(D | A) = categorical(0.2, 0.3, 0.5);
                 P(Z[i] | D) = normal(D * i, s[i]);
                 P(X Y | A D) = table { 0.1, 0.2, 0.3, 0.4; 0.4, 0.3, 0.2, 0.1; 0.25, 0.25, 0.25, 0.25;
                                        0.7, 0.1, 0.1, 0.1; 0.1, 0.7, 0.1, 0.1; 0.1, 0.1, 0.1, 0.7; }; } }",
    );
    let (z, inputs) = ([0.3, 2.0, 5.0], Inputs::new());
    let setting = Setting::new(&model, &inputs).unwrap();
    let instances = setting.ordered().unwrap();
    assert_eq!(instances.len(), 6, "A, D, three of Z, and X with Y");
    // P(A D X Y z) by products, for every assignment.
    let mut joint = Vec::new();
    for number in 0..24usize {
        let mut values = vec![f64::NAN; setting.slots()];
        let parts = [("A", number & 1), ("X", number >> 1 & 1), ("Y", number >> 2 & 1), ("D", number / 8)];
        for (name, value) in parts {
            values[setting.slots_of(variable(&model, name)).start] = value as f64;
        }
        let slots = setting.slots_of(variable(&model, "Z"));
        values[slots].copy_from_slice(&z);
        let ln: f64 = instances.iter().map(|one| setting.ln_density(one, &values).unwrap()).sum();
        joint.push((parts.map(|(_, value)| value), ln.exp()));
    }
    let total: f64 = joint.iter().map(|(_, p)| p).sum();
    let given = Inputs::new().array("Z", &z).size("N", 3);
    let answers = ask(&model, &question(&model, "P(A X Y D | Z)"), &given).unwrap();
    assert_eq!(answers[0].answer.len(), 24);
    for row in &answers[0].answer {
        let value = |name: &str| row.values.iter().find(|(known, _)| known == name).unwrap().1.clone();
        let truth = |name: &str| usize::from(value(name) == "true");
        let wanted = [truth("A"), truth("X"), truth("Y"), value("D").parse::<usize>().unwrap() - 1];
        let (_, p) = joint.iter().find(|(values, _)| *values == wanted).unwrap();
        assert!((p / total - row.p().unwrap()).abs() < 1e-12, "{wanted:?}");
    }
}

#[test]
fn draws_have_the_distribution_that_they_are_drawn_from() {
    let mut random = seeded(7, "draws");
    let finite = Distribution::Finite(vec![0.2, 0.0, 0.5, 0.3]);
    let mut counts = [0.0; 4];
    (0..40_000).for_each(|_| counts[finite.draw(&mut random).unwrap() as usize] += 1.0 / 40_000.0);
    for (found, expected) in counts.iter().zip([0.2f64, 0.0, 0.5, 0.3]) {
        assert!((found - expected).abs() < 0.01, "{counts:?}");
    }
    assert_eq!(Distribution::Finite(vec![0.0; 3]).draw(&mut random), None);
    // A normal law far in its tail: 8 to 9 deviations out, where rejection would never end. E = φ(8)/Q(8) ≈ 8.1213.
    let law = Law::Normal;
    let mass = law.mass(&mut bp_core::compiler::law::Numbers, 8.0, 9.0, &[0.0, 1.0]).unwrap();
    let tail = Distribution::Truncated {
        law,
        parameters: [0.0, 1.0, 0.0],
        bounds: [8.0, 9.0],
        mass: Extended::from_f64(mass),
    };
    let drawn: Vec<f64> = (0..4000).map(|_| tail.draw(&mut random).unwrap()).collect();
    assert!(drawn.iter().all(|x| (8.0..=9.0).contains(x)));
    let mean = drawn.iter().sum::<f64>() / 4000.0;
    assert!((mean - 8.1213).abs() < 0.006, "{mean}");
    let two = Distribution::Mixture(vec![(0.25, Distribution::Point(4.0)), (0.75, Distribution::Point(0.0))]);
    let mean = (0..40_000).map(|_| two.draw(&mut random).unwrap()).sum::<f64>() / 40_000.0;
    assert!((mean - 1.0).abs() < 0.03, "{mean}");
    assert_eq!(random.random::<u64>(), {
        let mut again = seeded(7, "draws");
        (0..40_000).for_each(|_| {
            finite.draw(&mut again);
        });
        (0..4000).for_each(|_| {
            tail.draw(&mut again);
        });
        (0..40_000).for_each(|_| {
            two.draw(&mut again);
        });
        again.random::<u64>()
    });
}

#[test]
fn invalid_parameters_are_reported() {
    let model = one("real", "normal(0, m[K])");
    let inputs = Inputs::new();
    let setting = Setting::new(&model, &inputs).unwrap();
    let instance = setting.ordered().unwrap().pop().unwrap();
    let mut values = vec![0.0; setting.slots()];
    values[setting.slots_of(variable(&model, "K")).start] = 1.0;
    let message = setting.distribution(&instance, &values).unwrap_err().to_string();
    assert!(
        message.contains("`P(X | A B K) = normal(0, m[K])`, where")
            && message.contains("-1.5")
            && message.contains("greater than 0"),
        "{message}"
    );
    let missing = model_of(
        "program Q { parameters { q : probability; } variables { A : bool; } decomposition { P(A) } forms { P(A) = bernoulli(q); } }",
    );
    assert!(Setting::new(&missing, &inputs).unwrap_err().to_string().contains("`q`"));
    let wrong = Inputs::new().number("q", 2.0);
    assert!(Setting::new(&missing, &wrong).unwrap_err().to_string().contains("between 0 and 1"));
}
