//! Every form over every domain that it fits.
//!
//! In: one-factor programs. Out: their answers. Invariant: expected values are computed by hand, or from densities and
//! cumulative distributions that are tested against statrs.

use crate::support::{all_near, model_of, question};
use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::law::Law;

/// P(X | A B E) with two truth values and a real parent.
fn answer(domain: &str, form: &str, text: &str) -> Vec<f64> {
    let model = model_of(&format!(
        "program One {{ parameters {{ m[1..=2] : real = [0.5, -1.5]; }} variables {{ A, B : bool; K : 1..=2; X : {domain}; }}
         decomposition {{ P(A) P(B) P(K) P(X | A B K) }}
         forms {{ P(A) = bernoulli(0.5); P(B) = bernoulli(0.5); P(K) = uniform; P(X | A B K) = {form}; }} }}"
    ));
    let answers = ask(&model, &question(&model, text), &Inputs::new())
        .unwrap_or_else(|error| panic!("{form}: {error}"));
    answers[0].answer.iter().map(|row| row.figure.number().unwrap()).collect()
}

const KNOWN: &str = "A = true, B = false, K = 2";

fn normalised(weights: Vec<f64>) -> Vec<f64> {
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / total).collect()
}

/// Laws with parameters, as written and as numbers.
const LAWS: [(&str, Law, &[f64]); 17] = [
    ("uniform(0, 4)", Law::Uniform, &[0.0, 4.0]),
    ("normal(2, 1.5)", Law::Normal, &[2.0, 1.5]),
    ("lognormal(0.5, 0.6)", Law::Lognormal, &[0.5, 0.6]),
    ("exponential(0.7)", Law::Exponential, &[0.7]),
    ("gamma(2, 0.8)", Law::Gamma, &[2.0, 0.8]),
    ("beta(2, 3)", Law::Beta, &[2.0, 3.0]),
    ("von_mises(1, 2)", Law::VonMises, &[1.0, 2.0]),
    ("weibull(1.5, 2)", Law::Weibull, &[1.5, 2.0]),
    ("half_normal(1.3)", Law::HalfNormal, &[1.3]),
    ("half_cauchy(0.6)", Law::HalfCauchy, &[0.6]),
    ("student_t(3, 1, 0.8)", Law::StudentT, &[3.0, 1.0, 0.8]),
    ("cauchy(1, 0.6)", Law::Cauchy, &[1.0, 0.6]),
    ("laplace(1, 0.6)", Law::Laplace, &[1.0, 0.6]),
    ("binomial(5, 0.3)", Law::Binomial, &[5.0, 0.3]),
    ("poisson(2.2)", Law::Poisson, &[2.2]),
    ("negative_binomial(2.5, 0.4)", Law::NegativeBinomial, &[2.5, 0.4]),
    ("geometric(0.3)", Law::Geometric, &[0.3]),
];

#[test]
fn laws_of_reals_are_densities() {
    for (form, law, parameters) in &LAWS[..13] {
        for x in [0.25, 0.75, 3.5, -1.0] {
            let found = answer("real", form, &format!("P(X = {x} | {KNOWN})"));
            all_near(&found, &[law.density(x, parameters)], 1e-13);
        }
    }
}

#[test]
fn laws_over_integers_are_their_densities_normalised() {
    for (form, law, parameters) in LAWS.iter().filter(|(_, law, _)| *law != Law::Beta) {
        let expected = normalised((0..=6).map(|x| law.density(f64::from(x), parameters)).collect());
        all_near(&answer("0..=6", form, &format!("P(X | {KNOWN})")), &expected, 1e-13);
    }
}

#[test]
fn laws_over_bins_are_their_masses() {
    for (form, law, parameters) in &LAWS[..13] {
        let edges: Vec<f64> = (0..=10).map(|edge| f64::from(edge) * 0.1).collect();
        let masses = edges
            .windows(2)
            .map(|bin| law.cumulative(bin[1], parameters) - law.cumulative(bin[0], parameters));
        // Five Gauss–Legendre points are exact to 1e-9 here; closed forms to rounding.
        all_near(
            &answer("bins(0, 1, 10)", form, &format!("P(X | {KNOWN})")),
            &normalised(masses.collect()),
            2e-9,
        );
    }
    let edges = [0.0, 0.5, 3.0];
    let masses = edges.windows(2).map(|bin| {
        Law::Weibull.cumulative(bin[1], &[1.5, 2.0]) - Law::Weibull.cumulative(bin[0], &[1.5, 2.0])
    });
    all_near(
        &answer("bins[0, 0.5, 3]", "weibull(1.5, 2)", &format!("P(X | {KNOWN})")),
        &normalised(masses.collect()),
        1e-12,
    );
}

#[test]
fn laws_on_a_circle_go_the_shorter_way_round() {
    // Around 355°, 5° is as far as 345°.
    let found = answer("circle(0, 360, 36)", "normal(355, 20)", &format!("P(X | {KNOWN})"));
    assert_eq!(found[35], found.iter().copied().fold(0.0, f64::max));
    all_near(&[found[0], found[1]], &[found[34], found[33]], 1e-14);
    let found = answer("circle(0, 360, 36)", "von_mises(355, 3)", &format!("P(X | {KNOWN})"));
    let angle = |bin: i32| (f64::from(10 * bin + 5) - 355.0).to_radians();
    all_near(&found, &normalised((0..36).map(|bin| (3.0 * angle(bin).cos()).exp()).collect()), 1e-13);
}

#[test]
fn a_dirac_into_bins_lands_in_the_bin_that_holds_it() {
    let at = |domain: &str, value: &str| {
        let found = answer(domain, &format!("dirac({value})"), &format!("P(X | {KNOWN})"));
        found.iter().position(|p| *p == 1.0)
    };
    assert_eq!(at("bins(-50, 50, 20)", "m[K] * 10"), Some(7), "-15 opens the bin [-15; -10[");
    assert_eq!(at("bins(-50, 50, 20)", "50"), Some(19));
    assert_eq!(at("bins[0, 1, 10]", "1"), Some(1));
    assert_eq!(at("circle(0, 360, 36)", "-1"), Some(35));
    assert_eq!(at("circle(0, 360, 36)", "725"), Some(0));
}

#[test]
fn bins_are_their_centres_in_expressions_and_hold_numbers_as_evidence() {
    let model = model_of(
        "program Two { variables { X : bins(-10, 10, 4); G : bins[0, 1, 4]; Y : -9..=9; }
         decomposition { P(X) P(G) P(Y | X G) }
         forms { P(X) = uniform; P(G) = uniform; P(Y | X G) = dirac(floor(X + G)); } }",
    );
    let ask_one = |text: &str| {
        let answer = ask(&model, &question(&model, text), &Inputs::new()).unwrap().remove(0).answer;
        answer
            .into_iter()
            .filter(|row| row.p().unwrap() > 0.0)
            .map(|row| row.values[0].1.clone())
            .collect::<Vec<_>>()
    };
    // 2.5 + 2.5 = 5; -7.5 + 0.5 = -7.
    assert_eq!(ask_one("P(Y | X = 3.3, G = 2)"), ["5"]);
    assert_eq!(ask_one("P(Y | X = -10, G = 0)"), ["-7"]);
    assert_eq!(ask_one("P(X | Y = 5)"), ["2.5"]);
}

#[test]
fn truncated_laws_are_normalised_between_their_bounds() {
    let cut = |x: f64| Law::Normal.density(x, &[2.0, 1.5]);
    let total = Law::Normal.cumulative(3.0, &[2.0, 1.5]) - Law::Normal.cumulative(1.0, &[2.0, 1.5]);
    let of = |x: f64| answer("real", "truncated(normal(2, 1.5), 1, 3)", &format!("P(X = {x} | {KNOWN})"))[0];
    all_near(&[of(1.5), of(0.9), of(3.1)], &[cut(1.5) / total, 0.0, 0.0], 1e-13);
    let found = answer("0..=6", "truncated(normal(2, 1.5), 1, 3)", &format!("P(X | {KNOWN})"));
    let expected = normalised(
        (0..=6).map(f64::from).map(|x| if (1.0..=3.0).contains(&x) { cut(x) } else { 0.0 }).collect(),
    );
    all_near(&found, &expected, 1e-13);
}

#[test]
fn mixtures_are_weighted_sums() {
    let found =
        answer("real", "mixture(0.3, normal(0, 1), 0.7, exponential(2))", &format!("P(X = 0.5 | {KNOWN})"));
    all_near(
        &found,
        &[0.3 * Law::Normal.density(0.5, &[0.0, 1.0]) + 0.7 * Law::Exponential.density(0.5, &[2.0])],
        1e-14,
    );
    let nested = answer(
        "bool",
        "mixture(0.5, bernoulli(0.2), 0.5, mixture(0.5, bernoulli(1), 0.5, bernoulli(0)))",
        &format!("P(X = true | {KNOWN})"),
    );
    all_near(&nested, &[0.35], 1e-15);
}

#[test]
fn many_causes_and_scores_follow_their_equations() {
    let table = |form: &str, p: [f64; 4]| {
        for (position, (a, b)) in [("false", "false"), ("false", "true"), ("true", "false"), ("true", "true")]
            .into_iter()
            .enumerate()
        {
            // K is no cause: these forms are tried on two of them.
            let model = model_of(&format!(
                "program C {{ variables {{ A, B, X : bool; }} decomposition {{ P(A) P(B) P(X | A B) }}
                 forms {{ P(A) = bernoulli(0.5); P(B) = bernoulli(0.5); P(X | A B) = {form}; }} }}"
            ));
            let text = format!("P(X = true | A = {a}, B = {b})");
            let found =
                ask(&model, &question(&model, &text), &Inputs::new()).unwrap()[0].answer[0].p().unwrap();
            all_near(&[found], &[p[position]], 1e-15);
        }
    };
    table("noisy_or(0.4, 0.8, 0.1)", [0.1, 1.0 - 0.9 * 0.2, 1.0 - 0.9 * 0.6, 1.0 - 0.9 * 0.6 * 0.2]);
    table("noisy_or(0.4, 0.8)", [0.0, 0.8, 0.4, 1.0 - 0.6 * 0.2]);
    table("noisy_and(0.4, 0.8, 0.1)", [0.9 * 0.6 * 0.2, 0.9 * 0.6, 0.9 * 0.2, 0.9]);
    let e = |x: f64| x.exp();
    let found = answer("{ Left, Ahead, Right }", "softmax(0, m[K], 1000 - 999)", &format!("P(X | {KNOWN})"));
    all_near(&found, &normalised(vec![1.0, e(-1.5), e(1.0)]), 1e-15);
    // Scores that would overflow.
    let found = answer("bool", "softmax(2000, 2001)", &format!("P(X | {KNOWN})"));
    all_near(&found, &[1.0 / (1.0 + e(1.0)), e(1.0) / (1.0 + e(1.0))], 1e-15);
}

#[test]
fn counts_become_probabilities() {
    all_near(&answer("1..=3", "histogram(1, 3, 4)", &format!("P(X | {KNOWN})")), &[0.125, 0.375, 0.5], 1e-15);
    all_near(
        &answer("1..=3", "laplace_succession(0, 3, 4)", &format!("P(X | {KNOWN})")),
        &[0.1, 0.4, 0.5],
        1e-15,
    );
}

#[test]
fn weights_are_normalised_for_each_context() {
    let found = answer("0..=3", "weights(if A { X + 1 } else { 1 })", "P(X | A B = false, K = 1)");
    all_near(&found, &[0.25, 0.25, 0.25, 0.25, 0.1, 0.2, 0.3, 0.4], 1e-15);
    // The normaliser of one context does not touch the others: A stays as likely as it was.
    let found =
        answer("0..=3", "weights(if A { X + 1 } else { 1 })", "P(A = true | X = 3, B = false, K = 1)");
    all_near(&found, &[0.4 / 0.65], 1e-15);
}

#[test]
fn a_table_may_stand_in_a_branch_and_may_be_large() {
    let model = model_of(
        "program T { variables { S : bool; A, X : 1..=4; } decomposition { P(S) P(A) P(X | S A) }
         forms { P(S) = bernoulli(0.5); P(A) = uniform; P(X | S A) = if S { uniform } else { categorical(0.1, 0.2, 0.3, 0.4) }; }
         }",
    );
    let found: Vec<f64> = ask(&model, &question(&model, "P(S | X = 4)"), &Inputs::new()).unwrap()[0]
        .answer
        .iter()
        .map(|row| row.p().unwrap())
        .collect();
    all_near(&found, &[0.4 / 0.65, 0.25 / 0.65], 1e-15);
    let rows: Vec<String> = (1..=4)
        .map(|a| (1..=4).map(|x| if a == x { "0.7" } else { "0.1" }).collect::<Vec<_>>().join(", "))
        .collect();
    let model = model_of(&format!(
        "program T {{ variables {{ A, X : 1..=4; }} decomposition {{ P(A) P(X | A) }} forms {{ P(A) = uniform; P(X | A) = table {{ {} }}; }} }}",
        rows.join("; ")
    ));
    let found: Vec<f64> = ask(&model, &question(&model, "P(A | X = 2)"), &Inputs::new()).unwrap()[0]
        .answer
        .iter()
        .map(|row| row.p().unwrap())
        .collect();
    all_near(&found, &[0.1, 0.7, 0.1, 0.1], 1e-15);
}

#[test]
fn functions_are_those_of_the_field() {
    let value = |expression: &str| {
        let found = answer("real", &format!("normal({expression}, 1)"), &format!("P(X = 0 | {KNOWN})"))[0];
        (-2.0 * (found / Law::Normal.density(0.0, &[0.0, 1.0])).ln()).sqrt()
    };
    for (expression, expected) in [
        ("sin(1)", 1f64.sin()),
        ("cos(1)", 1f64.cos()),
        ("atan2(1, 2)", 1f64.atan2(2.0)),
        ("pow(1.5, 2)", 2.25),
        ("mod(-1, 3)", 2.0),
        ("log2(8)", 3.0),
        ("ceil(0.2)", 1.0),
        ("round(2.5)", 3.0),
        ("ln_gamma(5)", 24f64.ln()),
    ] {
        all_near(&[value(expression)], &[expected], 1e-7);
    }
}

#[test]
fn a_function_of_rust_is_a_field() {
    let model = model_of(
        "program F { parameters { f[0..=2, 1..=3] : real; } variables { A : 0..=2; B : 1..=3; C : 0..=9; }
         decomposition { P(A) P(B) P(C | A B) } forms { P(A) = uniform; P(B) = uniform; P(C | A B) = dirac(f[A, B]); } }",
    );
    let inputs = Inputs::new().function("f", [0..=2, 1..=3], |[a, b]| (a * b) as f64);
    let found = ask(&model, &question(&model, "P(A, B | C = 2)"), &inputs).unwrap().remove(0).answer;
    let likely: Vec<String> = found
        .iter()
        .filter(|row| row.p().unwrap() > 0.0)
        .map(|row| format!("{}{}", row.values[0].1, row.values[1].1))
        .collect();
    assert_eq!(likely, ["12", "21"]);
}
