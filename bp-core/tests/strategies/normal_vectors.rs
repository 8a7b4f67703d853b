//! Vectors with a covariance matrix, and their components, in every strategy.
//!
//! In: programs of vectors. Out: answers. Invariant: expected numbers are computed by NumPy from the equations written
//! beside them (conditioning by K = P Hᵀ (H P Hᵀ + R)⁻¹, the filter of Kalman, the smoother of Rauch, Tung and Striebel),
//! in matrices, where the crate takes one component after the other.

use bp_core::Error;
use bp_core::prelude::*;
use serde_json::Value as Json;

#[track_caller]
fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-10 * expected.abs().max(1.0), "{found}, expected {expected}");
}

fn json(answer: &Posterior) -> Json {
    serde_json::to_value(answer).unwrap()
}

#[track_caller]
fn law(found: &Json, mean: [f64; 2], covariance: &Json, expected: [[f64; 2]; 2]) {
    for row in 0..2 {
        near(found[row]["mean"].as_f64().unwrap_or(f64::NAN), mean[row]);
        (0..2).for_each(|at| near(covariance[row][at].as_f64().unwrap_or(f64::NAN), expected[row][at]));
    }
}

#[track_caller]
fn fails(program: Result<impl Sized, Error>, words: &[&str]) {
    let error = program.err().expect("it fails").to_string();
    words.iter().for_each(|word| assert!(error.contains(word), "{error}"));
}

const PLANE: &str = "program Plane over t in Time {
    parameters { S[0..=1, 0..=1] : real; }
    variables { X, Z : real[2]; }
    decomposition { P(X) P(Z | X) }
    forms { P(X) = normal(0, 3); P(Z | X) = normal(X, S); }
    question where_ { P(X | Z) }
}";

#[test]
fn a_vector_seen_with_correlated_noise() {
    // P = 9 I, R = S, z = (1, −2).
    let plane = Program::parse(PLANE).unwrap().with("S", [[1.0, 0.5], [0.5, 2.0]]).unwrap();
    let seen = plane.question("where_").unwrap().given("Z", [1.0, -2.0]).unwrap().ask().unwrap();
    let answer = json(&seen);
    let covariance = [[0.8815489749430512, 0.36902050113895224], [0.36902050113895224, 1.619589977220956]];
    law(&answer["answer"], [0.9840546697038726, -1.6810933940774488], &answer["covariance"], covariance);
    near(seen.ln_evidence().unwrap(), -4.428437451156917);
    near(seen.covariance("X[0]", "X[1]").unwrap(), covariance[0][1]);
    // The joint law of both before any reading: Cov(X, Z) = 9 I, Var Z = 9 I + S.
    let all = plane.ask("P(X, Z)").unwrap();
    for (one, other, expected) in
        [("X[0]", "Z[0]", 9.0), ("X[0]", "Z[1]", 0.0), ("Z[0]", "Z[1]", 0.5), ("Z[1]", "Z[1]", 11.0)]
    {
        near(all.covariance(one, other).unwrap(), expected);
    }
    // ½ ln det(2πe V), of V as above: det V = 0.8815489749430512 · 1.619589977220956 − 0.36902050113895224².
    let determinant: f64 = 0.8815489749430512 * 1.619589977220956 - 0.36902050113895224_f64.powi(2);
    near(
        seen.entropy().unwrap(),
        (std::f64::consts::TAU * std::f64::consts::E).ln() + 0.5 * determinant.ln(),
    );
}

#[test]
fn what_is_no_covariance_is_refused_with_its_reason() {
    let with = |rows: [[f64; 2]; 2]| Program::parse(PLANE).unwrap().with("S", rows);
    let ask = |rows: [[f64; 2]; 2], by: &str| {
        let program = with(rows)?.by(by)?;
        program.question("P(X | Z)")?.given("Z", [1.0, -2.0])?.ask()
    };
    for by in ["gaussian", "weighting"] {
        fails(
            ask([[1.0, 0.5], [0.7, 2.0]], by),
            &["P(Z | X) = normal(X, S)", "[[1, 0.5], [0.7, 2]] is not symmetric"],
        );
        fails(
            ask([[1.0, 2.0], [2.0, 1.0]], by),
            &["P(Z | X) = normal(X, S)", "not positive semi-definite", "eigenvalue -1"],
        );
    }
    let one = Program::parse(PLANE).unwrap().with("S", 2.0).unwrap();
    fails(
        one.question("P(X | Z)").unwrap().given("Z", [1.0, -2.0]).unwrap().ask(),
        &["`S` is given one number", "4 entries"],
    );
    fails(
        Program::parse(&PLANE.replace("S[0..=1, 0..=1]", "S[0..=2, 0..=2]")),
        &["is 2 × 2, but `S` is 3 × 3"],
    );
    fails(Program::parse(&PLANE.replace("S[0..=1, 0..=1]", "S[Axes, Axes]")), &["`S[0..=1, 0..=1]`"]);
    fails(Program::parse(&PLANE.replace("normal(X, S)", "normal(X, [[1, 2], [2, 1]])")), &["eigenvalue -1"]);
    fails(Program::parse(&PLANE.replace("normal(X, S)", "normal(X, [1, 2])")), &["a number or a matrix"]);
}

/// Var X = [4 −1; −1 3], E X = (1, 2).
const PAIR: &str = "program Pair {
    variables { X : real[2]; Y : real; }
    decomposition { P(X) P(Y | X) }
    forms { P(X) = normal([1, 2], [[4, -1], [-1, 3]]); P(Y | X) = normal(2 * X[0] - X[1], 1); }
}";

#[test]
fn a_matrix_in_the_text_and_components_in_means_questions_and_evidence() {
    let pair = Program::parse(PAIR).unwrap();
    // h = (2, −1), y = 3.
    let seen = pair.ask("P(X | Y = 3)").unwrap();
    let answer = json(&seen);
    let covariance = [[0.625, 0.875], [0.875, 1.9583333333333333]];
    law(&answer["answer"], [2.125, 1.375], &answer["covariance"], covariance);
    near(seen.ln_evidence().unwrap(), -2.6954654483786458);
    let first = pair.ask("P(X[0] | Y = 3)").unwrap();
    near(first.mean().unwrap(), 2.125);
    near(first.variance().unwrap(), 0.625);
    // Given X₀ = ½: 2 + (−1/4)(½ − 1), variance 3 − 1/4.
    let second = pair.ask("P(X[1] | X[0] = 0.5)").unwrap();
    near(second.mean().unwrap(), 2.125);
    near(second.deviation().unwrap(), 1.6583123951777);
    // Both components are known: Y has its own noise alone.
    let both = pair.ask("P(Y | X[0] = 0.5, X[1] = 1)").unwrap();
    near(both.mean().unwrap(), 0.0);
    near(both.variance().unwrap(), 1.0);
    // P(X₀ > X₁) = Φ(−1 / √(4 + 3 + 2)), Φ(−1/3) = 0.36944134018176367 (tables).
    near(pair.ask("P(X[0] > X[1])").unwrap().p(true).unwrap(), 0.36944134018176367);
    // P(0 < X₀ < 3) = Φ(1) − Φ(−½); comparisons of two components are not one of one.
    let between = pair.ask("P(X[0] > 0 and X[0] < 3)").unwrap();
    near(between.p(true).unwrap(), 0.8413447460685429 - 0.3085375387259869);
    let corner = pair.clone().draws(40_000).seed(1).ask("P(X[0] > 0 and X[1] < 3)").unwrap();
    assert!(!corner.strategy().is_exact());
    fails(Program::parse(&PAIR.replace("X[1], 1)", "X[2], 1)")), &["components 0..=1: there is no `X[2]`"]);
    fails(pair.ask("P(X[2])"), &["components 0..=1"]);
}

#[test]
fn draws_agree_with_the_closed_form() {
    let pair = Program::parse(PAIR).unwrap();
    for by in ["weighting", "gibbs"] {
        let drawn = pair.clone().by(by).unwrap().draws(40_000).seed(7).ask("P(X | Y = 3)").unwrap();
        for (name, mean, variance) in [("X[0]", 2.125, 0.625), ("X[1]", 1.375, 1.9583333333333333)] {
            let own = drawn.of(name).unwrap();
            let [found, error] = own.mean_and_error().unwrap();
            assert!((found - mean).abs() <= 4.0 * error && error < 0.05, "{by} {name} {found} ± {error}");
            assert!((own.variance().unwrap() / variance - 1.0).abs() < 0.1, "{by} {name}");
        }
        assert!((drawn.covariance("X[0]", "X[1]").unwrap() - 0.875).abs() < 0.1, "{by}");
    }
    // Only one component of a vector is observed; rank one: X₁ = 2 X₀.
    let line = Program::parse(
        "program Line { variables { X : real[2]; } decomposition { P(X) }
         forms { P(X) = normal(0, [[1, 2], [2, 4]]); } }",
    )
    .unwrap();
    let exact = line.ask("P(X | X[1] = 3)").unwrap();
    near(exact.of("X[0]").unwrap().mean().unwrap(), 1.5);
    near(exact.of("X[0]").unwrap().deviation().unwrap(), 0.0);
    fails(line.ask("P(X | X[0] = 1, X[1] = 3)"), &["impossible"]);
    let drawn = line.by("weighting").unwrap().draws(10_000).ask("P(X)").unwrap();
    assert!((drawn.covariance("X[0]", "X[1]").unwrap() - 2.0).abs() < 0.2);
}

/// Position and velocity: A = [1 ½; 0 1].
const TRACK: &str = "program Track over t in Time {
    parameters { Q[0..=1, 0..=1], R[0..=1, 0..=1] : real; dt : real = 0.5; }
    variables { X, Z : real[2]; }
    decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
    forms {
        P(X^-1) = previous(X) else normal([1, 0], [[2, 0.5], [0.5, 1]]);
        P(X | X^-1) = normal([X^-1[0] + dt * X^-1[1], X[1]^-1], Q);
        P(Z | X) = normal(X, R);
    }
}";

fn track() -> Program {
    let program = Program::parse(TRACK).unwrap();
    program.with("Q", [[0.3, 0.1], [0.1, 0.2]]).unwrap().with("R", [[1.0, 0.4], [0.4, 0.5]]).unwrap()
}

#[test]
fn over_time_it_is_a_kalman_filter_with_matrices() {
    let seen = [
        evidence! { "Z[0]": 1.2, "Z[1]": 0.1 },
        evidence! { "Z[0]": 1.0, "Z[1]": 0.9 },
        evidence! { "Z[0]": 2.5, "Z[1]": 1.1 },
    ];
    let ask = |question: &str, seen: &[Evidence]| track().question(question).unwrap().over(seen).unwrap();
    let last = ask("filter P(X | Z)", &seen);
    assert_eq!(last.strategy().name(), "gaussian");
    let answer = json(&last);
    let covariance = [[0.5430247168436865, 0.21450148728668106], [0.2145014872866809, 0.23781437685566945]];
    law(&answer["answer"], [1.9544099862894901, 0.7940347910321439], &answer["covariance"], covariance);
    near(last.ln_evidence().unwrap(), -7.640596756116797);
    let smooth = json(&ask("smooth P(X | Z)", &seen));
    let covariance = [[0.32633397441477846, 0.08681306701760746], [0.08681306701760755, 0.1819736742298819]];
    law(&smooth["answer"], [1.2107266167229696, 0.4237181474324875], &smooth["covariance"][0], covariance);
    // The position was not observed at the second instant.
    let part = [seen[0].clone(), evidence! { "Z[1]": 0.9 }, seen[2].clone()];
    let missing = ask("filter P(X | Z)", &part);
    let answer = json(&missing);
    let covariance = [[0.6297366490591991, 0.21444134552273403], [0.21444134552273397, 0.23781441856886482]];
    law(&answer["answer"], [2.2345011648038415, 0.7938405250630733], &answer["covariance"], covariance);
    near(missing.ln_evidence().unwrap(), -6.207834727026441);
    // Particles carry the normal law of what is linear: with nothing to draw they are exact.
    let particles =
        track().by("particles").unwrap().draws(10).question("filter P(X | Z)").unwrap().over(&part).unwrap();
    near(particles.of("X[0]").unwrap().mean().unwrap(), 2.2345011648038415);
    near(particles.of("X[1]").unwrap().variance().unwrap(), 0.23781441856886482);
    near(particles.ln_evidence().unwrap(), -6.207834727026441);
    // A component alone.
    let velocity = ask("filter P(X[1] | Z)", &seen);
    near(velocity.mean().unwrap(), 0.7940347910321439);
    near(velocity.variance().unwrap(), 0.23781437685566945);
}

const MIXED: &str = "program Mixed {
    variables { K : bool; X : real[2]; Y : real; }
    decomposition { P(K) P(X | K) P(Y | X) }
    forms {
        P(K) = bernoulli(0.3);
        P(X | K) = if K { normal([2, 1], [[2, -0.3], [-0.3, 0.5]]) } else { normal(0, [[1, 0.5], [0.5, 2]]) };
        P(Y | X) = normal(X[0] + X[1], 1);
    }
}";

#[test]
fn a_mixture_of_normal_vectors() {
    let mixed = Program::parse(MIXED).unwrap();
    let seen = mixed.ask("P(X | Y = 2)").unwrap();
    assert_eq!(seen.strategy().name(), "mixture");
    let answer = json(&seen);
    let covariance = [[0.8984088763019793, -0.3328582943065149], [-0.3328582943065149, 0.6419367918586667]];
    law(&answer["answer"], [0.936931223179482, 0.9714465065102136], &answer["covariance"], covariance);
    near(seen.ln_evidence().unwrap(), -1.945853162106296);
    near(mixed.ask("P(K | Y = 2)").unwrap().p(true).unwrap(), 0.4140256556019056);
    near(mixed.ask("expectation P(X[1] | Y = 2)").unwrap().number().unwrap(), 0.9714465065102136);
    // Both densities at (1, ½).
    let class = mixed.question("P(K | X)").unwrap().given("X", [1.0, 0.5]).unwrap().ask().unwrap();
    assert_eq!(class.strategy().name(), "mixture");
    near(class.p(true).unwrap(), 0.3241816454232083);
    near(class.ln_evidence().unwrap(), -2.5825289590212743);
    let components = mixed.ask("P(K | X[0] = 1, X[1] = 0.5)").unwrap();
    near(components.p(true).unwrap(), 0.3241816454232083);
}

#[test]
fn a_hidden_state_seen_through_a_vector_some_of_whose_components_are_missing() {
    let program = Program::parse(
        "program Hidden over t in Time {
            variables { S : bool; Z : real[2]; }
            decomposition { P(S^-1) P(S | S^-1) P(Z | S) }
            forms {
                P(S^-1) = previous(S) else bernoulli(0.5);
                P(S | S^-1) = table { false: 0.8, 0.2; true: 0.3, 0.7; };
                P(Z | S) = if S { normal([2, 1], [[2, -0.3], [-0.3, 0.5]]) } else { normal(0, [[1, 0.5], [0.5, 2]]) };
            }
        }",
    )
    .unwrap();
    let seen = [
        evidence! { "Z[0]": 1.0, "Z[1]": 0.5 },
        evidence! { "Z[1]": 0.2 },
        evidence! { "Z[0]": 1.5 },
        evidence! { "Z[0]": 0.1, "Z[1]": 1.2 },
    ];
    let last = program.question("filter P(S | Z)").unwrap().over(&seen).unwrap();
    assert_eq!(last.strategy().name(), "chain");
    near(last.p(true).unwrap(), 0.45210266110407843);
    near(last.ln_evidence().unwrap(), -8.083400023590748);
}

#[test]
fn finite_variables_and_reals_asked_together() {
    let mixed = Program::parse(MIXED).unwrap();
    let seen = mixed.ask("P(K, X | Y = 2)").unwrap();
    assert_eq!(seen.strategy().name(), "mixture");
    let answer = json(&seen);
    // P(K), and then the normal law of X given each value.
    let rows = answer["answer"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    near(rows[0]["p"].as_f64().unwrap(), 0.5859743443980946);
    near(rows[1]["p"].as_f64().unwrap(), 0.4140256556019056);
    assert_eq!(
        (&rows[2]["values"]["K"], &rows[4]["values"]["K"]),
        (&Json::from("false"), &Json::from("true"))
    );
    law(&Json::from(&rows[2..4]), [0.6, 1.0], &answer["covariance"][0], [[0.55, -0.25], [-0.25, 0.75]]);
    let covariance = [[1.003448275862069, -0.41724137931034483], [-0.41724137931034483, 0.4862068965517241]];
    law(
        &Json::from(&rows[4..6]),
        [1.4137931034482758, 0.9310344827586207],
        &answer["covariance"][1],
        covariance,
    );
    // Their joint density at K = true, X = (1, ½), the parts, and Cov(K, X₀) = P(K) P(¬K) (m₁ − m₀).
    near(seen.p((true, 1.0, 0.5)).unwrap(), 0.06038191639015438);
    near(seen.of("K").unwrap().p(true).unwrap(), 0.4140256556019056);
    near(seen.of("X[1]").unwrap().mean().unwrap(), 0.9714465065102136);
    let expected = 0.5859743443980946 * 0.4140256556019056 * (1.4137931034482758 - 0.6);
    near(seen.covariance("K", "X[0]").unwrap(), expected);
    near(seen.covariance("X[1]", "X[0]").unwrap(), -0.3328582943065149);
    // The order of the question, and another finite variable that is summed out.
    let two = Program::parse(
        "program Two { variables { K, J : bool; X : real; } decomposition { P(K) P(J) P(X | K J) }
         forms { P(K) = bernoulli(0.4); P(J) = bernoulli(0.5);
                 P(X | K J) = normal((if K { 1 } else { -1 }) + (if J { 0.5 } else { -0.5 }), 1); } }",
    )
    .unwrap();
    let both = json(&two.ask("P(X, K)").unwrap());
    for (row, mean) in [(2, -1.0), (3, 1.0)] {
        near(both["answer"][row]["mean"].as_f64().unwrap(), mean);
        near(both["answer"][row]["deviation"].as_f64().unwrap(), 1.25f64.sqrt());
    }
    // X is symmetric about 1 given K; half of P(K) in the table of both.
    near(two.ask("P(K, J)").unwrap().p((true, false)).unwrap(), 0.2);
}

#[test]
fn soft_evidence_beside_reals_is_mixed_from_the_exact_answer() {
    let mixed = Program::parse(MIXED).unwrap();
    // P′(X | Y = 2) = ½ P(X | K, Y = 2) + ½ P(X | ¬K, Y = 2).
    let soft = mixed.ask("P(X | Y = 2, K soft [0.5, 0.5])").unwrap();
    assert_eq!(soft.strategy().name(), "mixture");
    near(soft.of("X[0]").unwrap().mean().unwrap(), 0.5 * 0.6 + 0.5 * 1.4137931034482758);
    let between = 0.25 * (1.4137931034482758f64 - 0.6).powi(2);
    near(soft.of("X[0]").unwrap().variance().unwrap(), 0.5 * 0.55 + 0.5 * 1.003448275862069 + between);
    let mean = mixed.ask("expectation P(X[1] | Y = 2, K soft [0, 1])").unwrap();
    near(mean.number().unwrap(), 0.9310344827586207);
    fails(
        mixed.ask("entropy P(X | Y = 2, K soft [0.5, 0.5])"),
        &["`entropy` of several reals together is not computed: ask for each real alone"],
    );
    // Without a closed form both `explain` and `ask` refuse, for the same reason.
    let curved = Program::parse(
        "program Curved { variables { K : bool; X, Y : real; } decomposition { P(K) P(X | K) P(Y | X) }
         forms { P(K) = bernoulli(0.3); P(X | K) = normal(if K { 1 } else { 0 }, 1); P(Y | X) = normal(X * X, 1); } }",
    )
    .unwrap();
    let question = "P(X | Y = 2, K soft [0.5, 0.5])";
    let reason = "soft evidence on `K` is mixed from exact answers only, and `X` is real";
    fails(curved.ask(question), &[reason]);
    let parsed = bp_core::compiler::syntax::parse_question(
        &bp_core::compiler::source::Source::new("question", question),
        curved.model(),
    );
    let options = bp_core::compiler::plan::Options { all_offers: true, ..Default::default() };
    fails(bp_core::compiler::plan::plan(curved.model(), &parsed.unwrap(), options), &[reason]);
}

/// A component that is known where draws answer: given R = 1 and U the vector is N([1, U], [[1, ½], [½, 1]]); the odds of U by
/// W[1] = 0.3 are N(0.3; 1, 1) / N(0.3; 0, 1) = exp(0.3 − ½), and W[0] has the mean 1 + (0.3 − U) / 2.
#[test]
fn a_component_is_known_where_draws_answer() {
    let program = Program::parse(
        "program Parts {
            variables { R : real; U : bool; W : real[2]; }
            decomposition { P(R) P(U) P(W | R U) }
            forms {
                P(R) = gamma(2, 1);
                P(U) = bernoulli(0.5);
                P(W | R U) = normal([R, if U { 1 } else { 0 }], [[1, 0.5], [0.5, 1]]);
            }
        }",
    )
    .unwrap();
    let p = 1.0 / (1.0 + 0.2f64.exp());
    for by in ["weighting", "gibbs"] {
        let program = program.clone().by(by).unwrap();
        let found =
            program.ask("P(W[0] | W[1] = 0.3, R = 1)").unwrap_or_else(|error| panic!("{by}: {error}"));
        let mean = found.mean().unwrap();
        assert!((mean - (1.15 - 0.5 * p)).abs() < 0.03, "{by}: {mean}");
        let found = program.ask("P(U | W[1] = 0.3, R = 1)").unwrap();
        assert!((found.p(true).unwrap() - p).abs() < 0.02, "{by}: {found}");
    }
}

/// Z = X + noise of variance 1. Given Z₀ = 1: X₁ has mean ¼ and variance 2 − ½²/2. Given both, with S = [[2, ½], [½, 3]], the means of X
/// are Σ S⁻¹ z, S⁻¹ z = (2, 7/2)/(23/4).
#[test]
fn components_are_known_alone_in_marginals_and_in_cases() {
    let program = Program::parse(
        "program Pair { variables { X, Z : real[2]; } decomposition { P(X) P(Z | X) }
         forms { P(X) = normal(0, [[1, 0.5], [0.5, 2]]); P(Z | X) = normal(X, 1); } }",
    )
    .unwrap();
    let mut evidence = Evidence::new();
    evidence.set("Z[0]", 1.0);
    let second = program.marginals(&evidence).unwrap().of("X[1]").unwrap();
    assert!((second.mean().unwrap() - 0.25).abs() < 1e-14);
    assert!((second.variance().unwrap() - 1.875).abs() < 1e-14);
    evidence.set("Z[1]", 2.0);
    let first = program.marginals(&evidence).unwrap().of("X[0]").unwrap();
    assert!((first.mean().unwrap() - 3.75 / 5.75).abs() < 1e-14);
    let cases = Cases::new().column("Z[0]", ["1", "1"]).column("Z[1]", ["2", ""]);
    let batch = program.batch(cases).unwrap();
    let place = batch.columns.iter().position(|name| name == "X[1].mean").unwrap();
    let means: Vec<f64> = batch.rows.iter().map(|row| row.as_ref().unwrap()[place]).collect();
    assert!((means[0] - 8.0 / 5.75).abs() < 1e-14 && (means[1] - 0.25).abs() < 1e-14, "{means:?}");
}
