//! Invalid numbers in forms, in every strategy.
//!
//! In: programs with one computed number that is a probability outside [0, 1], a negative weight, a deviation of 0, or
//! NaN. Out: an error. Invariant: it names the factor with its form, the context, and the number; no answer contains a
//! NaN, an infinity or a negative probability.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask, ask_over_time, ask_with, compile_by};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::sample::Sampling;
use bp_core::compiler::source::Source;
use bp_core::compiler::strategies::join_tree::{Marginals, MarginalsSession, Named, most_probable};
use bp_core::compiler::syntax::compile;

/// Domain of Y, its form where K is one of 0..=3, the context that is refused, and the message about the number.
const FINITE: &[(&str, &str, &str, &str)] = &[
    ("bool", "bernoulli(K / 2)", "K = 3", "the probability is 1.5, but it must lie between 0 and 1"),
    ("bool", "bernoulli(0.5 - K / 2)", "K = 2", "the probability is -0.5,"),
    ("bool", "bernoulli(if K > 2 { K } else { 0.5 })", "K = 3", "the probability is 3,"),
    ("bool", "bernoulli(K / K)", "K = 0", "the probability is NaN,"),
    ("bool", "bernoulli(sqrt(K - 1))", "K = 0", "the probability is NaN,"),
    ("bool", "bernoulli(exp(1000 * K) / 2)", "K = 1", "the probability is inf,"),
    ("bool", "if K == 2 { bernoulli(K) } else { bernoulli(0.5) }", "K = 2", "the probability is 2,"),
    ("bool", "categorical(1 - p, p)", "", "probability 1 is -0.25,"),
    ("bool", "categorical(p / 2, p / 2)", "", "the sum of the probabilities is 1.25, but it must be 1"),
    (
        "0..=2",
        "categorical(K / 4, 0.5, 0.5)",
        "K = 1",
        "the sum of the probabilities is 1.25, but it must be 1",
    ),
    ("0..=2", "softmax(ln(K - 1), 0, 0)", "K = 0", "probability 1 is NaN,"),
    ("0..=2", "weights(K - Y)", "K = 0", "the weight of Y = 1 is -1, but it must be finite and not negative"),
    ("0..=2", "weights(1 / (K - Y))", "K = 0", "the weight of Y = 0 is inf,"),
    ("bool", "mixture(K - 1, bernoulli(0.2), 2 - K, bernoulli(0.3))", "K = 0", "weight 1 is -1,"),
    (
        "bool",
        "mixture(K / 4, bernoulli(0.2), 0.5, bernoulli(0.3))",
        "K = 0",
        "the sum of the weights is 0.5,",
    ),
    ("0..=5", "normal(2, K - 1)", "K = 0", "the standard deviation is -1, but it must be greater than 0"),
    ("0..=5", "normal(2, K)", "K = 0", "the standard deviation is 0,"),
    ("0..=5", "normal(1 / K, 1)", "K = 0", "the mean is inf, but it must be a finite number"),
    ("0..=5", "poisson(K)", "K = 0", "the rate is 0,"),
    ("0..=5", "binomial(3, K / 2)", "K = 3", "the probability is 1.5,"),
    ("0..=5", "binomial(K - 1, 0.5)", "K = 0", "the number of trials is -1,"),
    ("0..=5", "half_normal(K)", "K = 0", "the scale is 0, but it must be greater than 0"),
    ("0..=5", "half_cauchy(K - 1)", "K = 0", "the scale is -1,"),
    ("0..=5", "student_t(K, 0, 1)", "K = 0", "the degrees of freedom is 0, but it must be greater than 0"),
    ("0..=5", "student_t(3, 1 / K, 1)", "K = 0", "the location is inf, but it must be a finite number"),
    ("0..=5", "cauchy(0, K)", "K = 0", "the scale is 0,"),
    ("0..=5", "laplace(ln(K - 1), 1)", "K = 0", "the location is NaN,"),
    (
        "0..=5",
        "geometric(K / 3)",
        "K = 0",
        "the probability is 0, but it must be greater than 0, and 1 at most",
    ),
    ("0..=5", "negative_binomial(K, 0.5)", "K = 0", "the number of successes is 0,"),
    (
        "0..=5",
        "negative_binomial(2, (K + 1) / 3)",
        "K = 3",
        "the probability is 1.33333333333333, but it must be",
    ),
    (
        "0..=5",
        "zero_inflated(K / 2, poisson(1))",
        "K = 3",
        "weight 1 is 1.5, but it must lie between 0 and 1",
    ),
    ("0..=5", "zero_inflated(0.5, poisson(K))", "K = 0", "the rate is 0,"),
    ("bool", "bernoulli(logistic(sqrt(K - 1)))", "K = 0", "probability 1 is NaN,"),
    ("bool", "bernoulli(probit(sqrt(K - 1)))", "K = 0", "probability 1 is NaN,"),
    ("0..=5", "gamma(K - 1, 1)", "K = 0", "the shape is -1,"),
    ("0..=5", "uniform(K, 2)", "K = 2", "the upper bound is 2, but it must be greater than the first"),
    (
        "0..=5",
        "truncated(normal(2, 1), 3, 2 + K)",
        "K = 0",
        "the upper bound is 2, but it must be greater than",
    ),
    ("0..=5", "dirac(1 / K)", "K = 0", "the value is inf, but it must be a finite number"),
    ("bins(0, 1, 4)", "beta(K, 1)", "K = 0", "the a is 0,"),
    ("bins(0, 1, 4)", "normal(0, K)", "K = 0", "the standard deviation is 0,"),
    ("bins(0, 1, 4)", "truncated(exponential(K), 0.2, 0.8)", "K = 0", "the rate is 0,"),
    ("circle(0, 360, 8)", "von_mises(0, K)", "K = 0", "the concentration is 0,"),
    ("{ none } or 1..=4", "normal_bins(2, K - 2)", "K = 0", "the standard deviation is -2,"),
];

/// The same for a real Y that is observed.
const REAL: &[(&str, &str, &str)] = &[
    ("normal(K, K - 1)", "K = 0", "the standard deviation is -1,"),
    ("normal(ln(K - 1), 1)", "K = 0", "the mean is NaN,"),
    ("exponential(K)", "K = 0", "the rate is 0,"),
    ("lognormal(0, K)", "K = 0", "the standard deviation of the logarithm is 0,"),
    ("gamma(2, K)", "K = 0", "the rate is 0,"),
    ("beta(1, K)", "K = 0", "the b is 0,"),
    ("weibull(K, 1)", "K = 0", "the shape is 0,"),
    ("von_mises(0, K - 1)", "K = 0", "the concentration is -1,"),
    ("half_normal(K)", "K = 0", "the scale is 0,"),
    ("half_cauchy(1 / K)", "K = 0", "the scale is inf,"),
    ("student_t(4, 0, K)", "K = 0", "the scale is 0,"),
    ("cauchy(0, K - 1)", "K = 0", "the scale is -1,"),
    ("laplace(0, K)", "K = 0", "the scale is 0,"),
    ("uniform(K - 1, 1)", "K = 2", "the upper bound is 1,"),
    ("mixture(K, normal(0, 1), 1 - K, normal(1, 1))", "K = 2", "weight 1 is 2,"),
    ("mixture(0.5, normal(0, K), 0.5, normal(1, 1))", "K = 0", "the standard deviation is 0,"),
    ("truncated(normal(0, K - 1), 0, 1)", "K = 0", "the standard deviation is -1,"),
    ("truncated(normal(0, 1), 0, K)", "K = 0", "the upper bound is 0,"),
];

fn program(domain: &str, form: &str, more: (&str, &str, &str)) -> String {
    format!(
        "program One {{ parameters {{ p : real = 1.25; }} variables {{ K : 0..=3; Y : {domain}; {} }}
         decomposition {{ P(K) P(Y | K) {} }} forms {{ P(K) = uniform; P(Y | K) = {form}; {} }} }}",
        more.0, more.1, more.2
    )
}

#[track_caller]
fn refused(found: Result<impl std::fmt::Debug, Error>, expected: [&str; 3]) {
    let error = found.expect_err(&format!("{expected:?}"));
    assert!(matches!(error, Error::Number { .. }), "{error}");
    let text = error.to_string();
    assert!(expected.iter().all(|part| text.contains(part)), "{text}\nexpected {expected:?}");
}

#[test]
fn kernels_refuse_them() {
    for (domain, form, context, number) in FINITE {
        let model = model_of(&program(domain, form, ("", "", "")));
        for text in ["P(Y)", "P(K Y)", "entropy P(Y | K)", "argmax P(K | Y)", "P(K | Y)"] {
            let found = ask(&model, &question(&model, text), &Inputs::new());
            refused(found, ["`P(Y | K) = ", context, number]);
        }
    }
    for (form, context, number) in REAL {
        let model = model_of(&program("real", form, ("", "", "")));
        for text in ["P(K | Y = 0.5)", "entropy P(K | Y = 0.5)"] {
            let found = ask(&model, &question(&model, text), &Inputs::new());
            refused(found, ["`P(Y | K) = ", context, number]);
        }
    }
}

#[test]
fn join_trees_refuse_them() {
    for (domain, form, context, number) in FINITE {
        let model = model_of(&program(domain, form, ("", "", "")));
        let found = marginals(&model, &[]);
        refused(found, ["`P(Y | K) = ", context, number]);
    }
}

/// The marginals of a program by a join tree.
fn marginals(model: &Model, evidence: &[(&str, &str)]) -> Result<Vec<f64>, Error> {
    let named = Named::new(model.clone(), &[])?;
    let evidence = named.evidence(evidence.iter().copied(), [])?;
    let given: Vec<usize> = evidence.hard.iter().map(|(variable, _)| *variable).collect();
    // By a value that is given each time, and by a likelihood of 0 and 1, as for cases with many patterns.
    let (sliced, weighed) = (
        Marginals::new(&named.network, &given, &[], &named.shown())?,
        Marginals::new(&named.network, &[], &given, &named.shown())?,
    );
    let (mut first, mut second) = (sliced.session(), weighed.session());
    first.ask(&evidence)?;
    second.ask(&evidence)?;
    let all = |session: &MarginalsSession<'_>| {
        named.shown().iter().flat_map(|one| session.posterior(*one, &evidence)).collect::<Vec<f64>>()
    };
    let found = all(&first);
    assert!(found.iter().zip(all(&second)).all(|(p, q)| (p - q).abs() < 1e-15), "{found:?}");
    most_probable(&named.network, &evidence)?;
    Ok(found)
}

#[test]
fn a_known_value_alone_excludes_a_context() {
    // P(Y = true | K) = K / 2: K = 3 is refused wherever it is not excluded by a value.
    let model = model_of(&program("bool", "bernoulli(K / 2)", ("", "", "")));
    assert_eq!(marginals(&model, &[("K", "1")]).unwrap(), [0.0, 1.0, 0.0, 0.0, 0.5, 0.5]);
    let number = ["`P(Y | K) = bernoulli(K / 2)`", "K = 3", "the probability is 1.5"];
    refused(marginals(&model, &[("Y", "true")]), number);
    for text in ["P(Y | K virtual [0, 1, 0, 0])", "P(Y | K soft [0, 1, 0, 0])", "P(K | Y = true)"] {
        refused(ask(&model, &question(&model, text), &Inputs::new()), number);
    }
}

#[test]
fn draws_refuse_them() {
    // H is a real that is not observed directly: its posterior has no closed form.
    let hidden = (
        "H : real; E : bool;",
        "P(H) P(E | H)",
        "P(H) = normal(0, 1); P(E | H) = bernoulli(1 / (1 + exp(-H)));",
    );
    let sampling = Sampling { particles: 200, seed: 1 };
    for (domain, form, context, number) in FINITE {
        let model = model_of(&program(domain, form, hidden));
        let found = ask_with(&model, &question(&model, "P(H Y | E = true)"), &Inputs::new(), sampling);
        refused(
            found,
            ["`P(Y | K) = ", context.split(" = ").next().unwrap(), number.split(' ').next().unwrap()],
        );
    }
    for (form, ..) in REAL {
        let model = model_of(&program("real", form, hidden));
        let found = ask_with(&model, &question(&model, "P(H | Y = 0.5, E = true)"), &Inputs::new(), sampling);
        refused(found, ["`P(Y | K) = ", "K = ", "but it must"]);
    }
}

#[test]
fn a_chance_beyond_one_is_refused_though_the_product_is_a_probability() {
    // With both causes 1 − (1 − 1.25)² is 0.9375.
    let model = model_of(
        "program Noisy { parameters { p : real = 1.25; } variables { A, B, Y : bool; } decomposition { P(A) P(B) P(Y | A B) }
         forms { P(A) = bernoulli(1); P(B) = bernoulli(1); P(Y | A B) = noisy_or(p, p); } }",
    );
    let found = ask(&model, &question(&model, "P(Y | A = true, B = true)"), &Inputs::new());
    refused(found, ["`P(Y | A B) = bernoulli(…)`", "A = true, B = true", "the probability is 1.25,"]);
}

#[test]
fn chains_over_time_refuse_them() {
    let text = "program Slow over t in T { variables { X, X^-1 : 0..=3; Y : real; }
        decomposition { P(X^-1) P(X | X^-1) P(Y | X) }
        forms { P(X^-1) = previous(X) else uniform; P(X | X^-1) = uniform; P(Y | X) = normal(0, X); } }";
    let model = model_of(text);
    for word in ["filter", "smooth", "sequence"] {
        let rows = vec![vec![("Y".to_owned(), 1.0)]; 3];
        let asked = question(&model, &format!("{word} P(X | Y)"));
        let found = ask_over_time(&model, &asked, &rows, &Inputs::new(), Sampling::default());
        refused(found, ["`P(Y | X) = normal(0, X)`", "X = 0", "the standard deviation is 0,"]);
    }
}

#[test]
fn linear_and_gaussian_programs_refuse_them() {
    let text = "program Line { parameters { s : real = 1; } variables { X : real; Y : real; }
        decomposition { P(X) P(Y | X) } forms { P(X) = normal(0, 1); P(Y | X) = normal(X / s, s); } }";
    let model = model_of(text);
    let asked = question(&model, "P(X | Y = 2)");
    for (number, words) in [(0.0, "is 0,"), (-2.0, "is -2,"), (1e-300, "beyond the range of numbers")] {
        let found = ask(&model, &asked, &Inputs::new().number("s", number));
        refused(found, ["`P(Y | X) = normal(X / s, s)`", "the standard deviation", words]);
    }
    for number in [f64::NAN, f64::INFINITY] {
        let error = ask(&model, &asked, &Inputs::new().number("s", number)).unwrap_err().to_string();
        assert!(error.contains("`s`") && error.contains("finite"), "{error}");
    }
}

#[test]
fn rounding_is_not_refused() {
    // 1 − 0.9 − 0.1 is −2.8e-17: a probability of 0.
    let text = "program Rest { parameters { a : real = 0.9; b : real = 0.1; } variables { Y : 0..=2; Z : bool; }
        decomposition { P(Y) P(Z | Y) }
        forms { P(Y) = categorical(a, b, 1 - a - b); P(Z | Y) = bernoulli(if Y == 0 { a + b } else { 1 - a - b }); } }";
    let model = model_of(text);
    for text in ["P(Y)", "P(Y | Z = true)", "P(Z | Y)"] {
        for answer in ask(&model, &question(&model, text), &Inputs::new()).unwrap() {
            assert!(answer.answer.iter().all(|row| row.p().unwrap() >= 0.0), "{answer:?}");
        }
    }
}

#[test]
fn rounding_of_constants_and_in_laws_is_clamped() {
    // 1 − 0.9 − 0.1 is −2.8e-17, and 3 · 0.1 / 0.3 is 1 + 2.2e-16.
    let text = "program Rest { parameters { a : real = 0.9; b : real = 0.1; } variables { A, B, C, D, E : bool; K, M : 0..=2; }
        decomposition { P(A) P(B) P(C) P(D | A) P(E) P(K) P(M) }
        forms {
            P(A) = bernoulli(1 - 0.9 - 0.1);
            P(B) = categorical(0.9 + 0.1, 1 - 0.9 - 0.1);
            P(C) = bernoulli(3 * b / 0.3);
            P(D | A) = noisy_or(1 - a - b);
            P(E) = mixture(1 - a - b, bernoulli(0.5), a + b, bernoulli(0.25));
            P(K) = binomial(2, 1 - a - b);
            P(M) = binomial(2, 1 - 0.9 - 0.1);
        } }";
    let model = model_of(text);
    for (text, expected) in [
        ("P(A)", &[1.0, 0.0][..]),
        ("P(B)", &[1.0, 0.0]),
        ("P(C)", &[0.0, 1.0]),
        ("P(D)", &[1.0, 0.0]),
        ("P(E)", &[0.75, 0.25]),
        ("P(K)", &[1.0, 0.0, 0.0]),
        ("P(M)", &[1.0, 0.0, 0.0]),
    ] {
        for by in [Strategy::Sums, Strategy::JoinTree] {
            let answer = compile_by(&model, &question(&model, text), Some(by)).unwrap().ask(&Inputs::new());
            let found: Vec<f64> = answer.unwrap()[0].answer.iter().map(|row| row.p().unwrap()).collect();
            assert_eq!(found, expected, "{text} {by:?}");
        }
    }
    // Numbers as they stand, in the program or given for a parameter, are not rounded.
    let literal = Source::new("test", text.replace("bernoulli(1 - 0.9 - 0.1)", "bernoulli(-0.0000001)"));
    let wrong = compile(&literal).unwrap_err().render(&literal, false);
    assert!(wrong.contains("a probability lies between 0 and 1, but this is -1e-7"), "{wrong}");
    let model = model_of(&text.replace("bernoulli(3 * b / 0.3)", "bernoulli(b)"));
    let given = Inputs::new().number("b", -1e-7);
    refused(ask(&model, &question(&model, "P(C)"), &given), ["P(C) = bernoulli(b)", "", "is -1e-7"]);
}

#[test]
fn the_value_of_a_dirac_that_is_summed_out() {
    // ln(X − 1) is NaN for X = 0, −∞ for X = 1, and 0 for X = 2.
    let text = "program Z { variables { X : 0..=2; Y : real; Z : bool; } decomposition { P(X) P(Y | X) P(Z | Y) }
        forms { P(X) = uniform; P(Y | X) = dirac(ln(X - 1)); P(Z | Y) = bernoulli(if Y >= 0 { 0.9 } else { 0.2 }); } }";
    let model = model_of(text);
    for asked in ["P(Z)", "P(X | Z = true)", "P(Z | X)"] {
        let found = ask(&model, &question(&model, asked), &Inputs::new());
        refused(
            found,
            ["`P(Y | X) = dirac(ln(X - 1))`, where X = 0", "the value is NaN,", "a finite number"],
        );
    }
    let known = ask(&model, &question(&model, "P(Z | X = 2)"), &Inputs::new()).unwrap().remove(0);
    assert_eq!(known.answer[1].p(), Some(0.9));
    let literal = Source::new("test", text.replace("ln(X - 1)", "1 / 0"));
    let wrong = compile(&literal).unwrap_err().render(&literal, false);
    assert!(wrong.contains("the value of a `dirac` must be a finite number, but this is inf"), "{wrong}");
}

#[test]
fn a_noisy_or_with_a_cause_that_rounding_made_negative() {
    // The other cause decides: 0.75, and not the rounded 0.
    let text = "program Two { parameters { a : real = 0.9; b : real = 0.1; } variables { A, B, D : bool; }
        decomposition { P(A) P(B) P(D | A B) }
        forms { P(A) = bernoulli(0.5); P(B) = bernoulli(0.5); P(D | A B) = noisy_or(1 - a - b, 0.75); } }";
    let model = model_of(text);
    for by in [Strategy::Sums, Strategy::JoinTree] {
        let asked = question(&model, "P(D | A = true, B = true)");
        let answer = compile_by(&model, &asked, Some(by)).unwrap().ask(&Inputs::new()).unwrap().remove(0);
        assert_eq!(answer.answer[1].p(), Some(0.75), "{by:?}");
    }
}

#[test]
fn a_number_that_the_evidence_excludes_does_no_harm() {
    let model = model_of(&program("bool", "bernoulli(K / 2)", ("", "", "")));
    // P(Y = true | K = 1) = ½.
    let answer = ask(&model, &question(&model, "P(Y | K = 1)"), &Inputs::new()).unwrap().remove(0);
    assert_eq!(answer.answer[1].p(), Some(0.5));
}

#[test]
fn an_impossible_context_has_zeros_or_no_row() {
    let text = "program Never { variables { X, Y : bool; } decomposition { P(X) P(Y | X) }
        forms { P(X) = bernoulli(0); P(Y | X) = bernoulli(0.3); } }";
    let model = model_of(text);
    let asked =
        |text: &str| -> Answer { ask(&model, &question(&model, text), &Inputs::new()).unwrap().remove(0) };
    let rows = |text: &str| asked(text).answer.len();
    assert_eq!(
        asked("P(Y | X)").answer.iter().map(|row| row.p().unwrap()).collect::<Vec<_>>(),
        [0.7, 0.3, 0.0, 0.0]
    );
    assert_eq!(
        ["entropy", "argmax", "max", "best(2)"].map(|word| rows(&format!("{word} P(Y | X)"))),
        [1, 1, 1, 2]
    );
    let answer = asked("entropy P(Y | X)");
    let Figure::Entropy { entropy, .. } = answer.answer[0].figure else { panic!("{answer:?}") };
    // −0.3 ln 0.3 − 0.7 ln 0.7
    assert!((entropy - 0.610_864_302_054_893_5).abs() < 1e-15, "{entropy}");
    assert_eq!(answer.answer[0].values, [("X".to_owned(), "false".to_owned())]);
}

#[test]
fn a_draw_beyond_the_range_of_numbers_is_an_error() {
    let text = "program Wide { variables { X : real; E : bool; } decomposition { P(X) P(E | X) }
        forms { P(X) = lognormal(0, 2000); P(E | X) = bernoulli(if X > 1 { 0.9 } else { 0.1 }); } }";
    let model = model_of(text);
    let sampling = Sampling { particles: 500, seed: 1 };
    for text in ["P(X | E = true)", "expectation P(X | E = true)"] {
        let error =
            ask_with(&model, &question(&model, text), &Inputs::new(), sampling).unwrap_err().to_string();
        assert!(error.contains("beyond the range of numbers"), "{error}");
    }
}
