//! Predictions from conjugate posteriors: of counts and of waits at one value, and beside likelihoods.
//!
//! In: programs. Out: probabilities and densities. Invariant: expected values are closed forms of 30 digits (mpmath 1.3): negative
//! binomial, beta-binomial, Lomax.

use bp_core::compiler::answer::Figure;
use bp_core::prelude::*;

fn ask(program: &str, text: &str) -> Posterior {
    Program::parse(program).unwrap().ask(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[track_caller]
fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-13 * expected.abs(), "{found}, expected {expected}");
}

#[track_caller]
fn has_probability(found: &Posterior, expected: f64) {
    match found.answer().answer[0].figure {
        Figure::Probability { p } => near(p, expected),
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn counts_and_waits_at_a_value() {
    let events = "program Events {
        variables { L, Z, E, N : real; Y[i in 1..=4] : real; }
        decomposition { P(L) prod(i) { P(Y[i] | L) } P(Z | L) P(E | L) P(N) }
        forms {
            P(L) = gamma(2, 1); P(Y[i] | L) = poisson(L); P(Z | L) = poisson(3 * L); P(E | L) = exponential(L);
            P(N) = poisson(2);
        }
    }";
    let next = ask(events, "P(Z = 3 | Y = [1, 2, 3, 4])");
    has_probability(&next, 0.068_195_449_287_600_24);
    has_probability(&ask(events, "P(Y[4] = 3 | Y[1] = 1, Y[2] = 2)"), 0.129_776_000_976_562_5);
    has_probability(&ask(events, "P(Z = 2.5 | Y = [1, 2, 3, 4])"), 0.0);
    let wait = ask(events, "P(E = 0.5 | Y = [1, 2, 3, 4])");
    match wait.answer().answer[0].figure {
        Figure::Density { density } => near(density, 0.695_194_511_368_051_2),
        ref other => panic!("{other:?}"),
    }
    // A count has a probability, whatever its domain: 8/6 · exp(−2).
    has_probability(&ask(events, "P(N = 3)"), 8.0 / 6.0 * (-2f64).exp());
    let trials = "program Trials {
        variables { T, A, B : real; }
        decomposition { P(T) P(A | T) P(B | T) }
        forms { P(T) = beta(2, 3); P(A | T) = binomial(10, T); P(B | T) = binomial(10, T); }
    }";
    has_probability(&ask(trials, "P(B = 4 | A = 7)"), 0.116_603_849_777_892_74);
}

/// The class has the weights P(k) P(y | k) Σ_u P(u | k) λ(u); the rate is gamma(8, 4) or gamma(8, 10).
#[test]
fn likelihoods_beside_a_summed_class() {
    let classes = "program Classes {
        variables { K : { a, b }; T : real; Y[i in 1..=3] : real; U : bool; }
        decomposition { P(K) P(T) P(U | K) prod(i) { P(Y[i] | K T) } }
        forms {
            P(K) = categorical(0.3, 0.7); P(T) = gamma(2, 1);
            P(U | K) = bernoulli(if K == a { 0.9 } else { 0.2 });
            P(Y[i] | K T) = poisson(if K == a { T } else { 3 * T });
        }
    }";
    let known = "Y = [1, 2, 3], U virtual [0.2, 0.8]";
    let class = ask(classes, &format!("P(K | {known})"));
    assert!(class.estimate().is_none());
    near(class.p("a").unwrap(), 0.674_735_804_679_095_7);
    near(class.ln_evidence().unwrap(), -6.161_744_009_589_389);
    near(ask(classes, &format!("P(T | {known})")).mean().unwrap(), 1.609_682_965_614_915);
}

/// Components of proportions depend on each other; those of a mixture of named distributions are drawn with their class.
#[test]
fn draws_of_unknowns_are_joint() {
    let shares = "program Shares {
        variables { S : real[3]; V : real[3]; } decomposition { P(S) P(V | S) }
        forms { P(S) = dirichlet(1, 1, 1); P(V | S) = multinomial(6, S); }
    }";
    let numbers = |found: &Posterior| -> Vec<Vec<f64>> {
        let row = |row: &bp_core::compiler::answer::Row| {
            row.values.iter().map(|(_, text)| text.parse().unwrap()).collect()
        };
        found.answer().answer.iter().map(row).collect()
    };
    for text in ["draw(200) P(S[0], S[1])", "draw(200) P(S[0], S[1] | V = [1, 2, 3])"] {
        let found = ask(shares, text);
        assert!(numbers(&found).iter().all(|both| both[0] + both[1] <= 1.0), "{found}");
    }
    let classes = "program Classes {
        variables { K : { a, b }; X, Y, C : real; }
        decomposition { P(K) P(X) P(Y) P(C | K X Y) }
        forms {
            P(K) = categorical(0.25, 0.75); P(X) = gamma(100, 1); P(Y) = gamma(100, 1);
            P(C | K X Y) = if K == a { poisson(X) } else { poisson(Y) };
        }
    }";
    let found = ask(classes, "draw(4000) P(X, Y | C = 100)");
    assert!(found.estimate().is_none(), "exact draws");
    let drawn = numbers(&found);
    let mean = |of: &dyn Fn(&Vec<f64>) -> f64| drawn.iter().map(of).sum::<f64>() / drawn.len() as f64;
    // The posterior of either rate is gamma(200, 2) with its weight and its prior else: all have the mean 100.
    assert!((mean(&|both| both[0]) - 100.0).abs() < 1.0 && (mean(&|both| both[1]) - 100.0).abs() < 1.0);
    let variance = mean(&|both| (both[0] - 100.0).powi(2));
    // 0.25 · 50 + 0.75 · 100.
    assert!((variance - 87.5).abs() < 8.0, "{variance}");
}

#[test]
fn a_parameter_with_a_default_is_a_searched_value() {
    let text =
        "program Values { parameters { a : integer = 2; } variables { X : 0..=3; } decomposition { P(X) }
        forms { P(X) = categorical(0.1, 0.2, 0.3, 0.4); } question one { P(X = a) } }";
    let program = Program::parse(text).unwrap();
    near(program.ask("one").unwrap().number().unwrap(), 0.3);
    near(program.question("one").unwrap().given("a", 1).unwrap().ask().unwrap().number().unwrap(), 0.2);
}

/// Of 250 trials with a uniform probability each number of successes has the probability 1/251.
#[test]
fn the_marginal_likelihood_of_a_model() {
    let coins = "program Coins {
        variables { Model : { Fair, Bent }; Theta, Heads : real; }
        decomposition { P(Model) P(Theta) P(Heads | Model Theta) }
        forms {
            P(Model) = uniform; P(Theta) = beta(1, 1);
            P(Heads | Model Theta) = if Model == Fair { binomial(250, 0.5) } else { binomial(250, Theta) };
        }
    }";
    has_probability(&ask(coins, "P(Heads = 140 | Model = Bent)"), 1.0 / 251.0);
    // 250! / (140! 110!) / 2²⁵⁰.
    has_probability(&ask(coins, "P(Heads = 140 | Model = Fair)"), 0.008_357_181_724_918_199);
}
