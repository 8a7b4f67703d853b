//! Quantiles, intervals and modes, from every strategy.
//!
//! In: programs and questions. Out: numbers of their answers. Invariant: an expected value is counted by hand, or is mpmath's at 50
//! digits; draws are seeded, and their bounds are given in standard errors.

use bp_core::compiler::answer::Figure;
use bp_core::prelude::*;

/// P(k) = k² / 91: the cumulatives are 1, 5, 14, 30, 55 and 91 of 91.
const LOADED: &str =
    "program Loaded { variables { Face : 1..=6; High : bool; } decomposition { P(Face) P(High | Face) }
    forms { P(Face) = weights(Face * Face); P(High | Face) = dirac(Face > 4); } }";

const BINS: &str = "program Binned { variables { X : bins(0, 10, 5); G : circle(0, 360, 36); S : bool; }
    decomposition { P(S) P(X | S) P(G) }
    forms { P(S) = bernoulli(0.5); P(G) = uniform;
        P(X | S) = if S { categorical(0.1, 0.2, 0.4, 0.2, 0.1) } else { categorical(0.5, 0.5, 0, 0, 0) }; } }";

/// T given A = 22 has the precision 1.04 and the mean 22.8 / 1.04.
const ROOM: &str = "program Room { variables { T, A, N : real; K : bool; } decomposition { P(T) P(A | T) P(N) P(K | N) }
    forms { P(T) = normal(20, 5); P(A | T) = normal(T, 1); P(N) = exponential(2); P(K | N) = bernoulli(0.5); } }";

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|wrong| panic!("{wrong}"))
}

fn ask(program: &Program, question: &str) -> Posterior {
    program.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"))
}

/// Level and quantile of each row; the level of an interval comes with both ends.
fn rows(answer: &Posterior) -> Vec<Vec<f64>> {
    let numbers = |figure: &Figure| match figure {
        Figure::Quantile { level, quantile, error: None } => vec![*level, *quantile],
        Figure::Interval { level, interval, errors: None } => vec![*level, interval[0], interval[1]],
        other => panic!("{other:?}"),
    };
    answer.answer().answer.iter().map(|row| numbers(&row.figure)).collect()
}

#[track_caller]
fn close(found: &[Vec<f64>], expected: &[&[f64]]) {
    let same = |(found, expected): (&Vec<f64>, &&[f64])| {
        found.len() == expected.len()
            && found.iter().zip(*expected).all(|(one, other)| (one - other).abs() < 1e-12)
    };
    assert!(
        found.len() == expected.len() && found.iter().zip(expected).all(same),
        "{found:?}, not {expected:?}"
    );
}

#[test]
fn a_finite_quantile_is_the_first_value_whose_cumulative_reaches_the_level() {
    for by in ["sums", "join_tree"] {
        let loaded = program(LOADED).by(by).unwrap();
        let quantiles = |question: &str| rows(&ask(&loaded, question));
        close(&quantiles("quantile(0.1, 0.5, 0.9) P(Face)"), &[&[0.1, 3.0], &[0.5, 5.0], &[0.9, 6.0]]);
        // 55/91, which is reached, though its digits are rounded.
        close(&quantiles("quantile(0.6043956043956044) P(Face)"), &[&[0.6043956043956044, 5.0]]);
        close(&quantiles("interval(0.9) P(Face)"), &[&[0.9, 2.0, 6.0]]);
        // Of the 30 that are low 14 are at most 3; of the 61 that are high 25 are 5.
        close(&quantiles("quantile(0.5) P(Face | High)"), &[&[0.5, 4.0], &[0.5, 6.0]]);
        // Each searched variable by itself: P(High) = 61/91.
        close(
            &quantiles("quantile(0.3, 0.4) P(Face High)"),
            &[&[0.3, 4.0], &[0.4, 5.0], &[0.3, 0.0], &[0.4, 1.0]],
        );
        // Squares of faces: at least half of it is at 25 and 36.
        close(&quantiles("quantile(0.5) P(Face * Face)"), &[&[0.5, 25.0]]);
    }
    let posterior = ask(&program(LOADED), "P(Face)");
    assert_eq!((posterior.quantile(0.5).unwrap(), posterior.interval(0.9).unwrap()), (5.0, [2.0, 6.0]));
    assert_eq!(ask(&program(LOADED), "quantile(0.1) P(Face)").number().unwrap(), 3.0);
}

/// Cumulatives 0.1, 0.3, 0.7 at the edges 2, 4, 6: 2 + 2 · 0.15/0.2, and 4 + 2 · 0.2/0.4.
#[test]
fn within_a_bin_probability_is_spread_evenly() {
    let binned = program(BINS);
    close(&rows(&ask(&binned, "quantile(0.25, 0.5) P(X | S = true)")), &[&[0.25, 3.5], &[0.5, 5.0]]);
    assert!((ask(&binned, "P(X | S = true)").quantile(0.25).unwrap() - 3.5).abs() < 1e-12);
    let drawn = ask(&binned.clone().by("weighting").unwrap().seed(5), "P(X | S = true)");
    let [found, error] = drawn.quantile_and_error(0.25).unwrap();
    assert!(error > 0.0 && (found - 3.5).abs() < 4.0 * error, "{found} ± {error}");
    let Err(wrong) = binned.ask("quantile(0.5) P(G)") else { panic!("a circle has no quantile") };
    assert!(wrong.to_string().contains("whose values have no first: it has no quantile"), "{wrong}");
    assert!(ask(&binned, "P(G)").quantile(0.5).unwrap_err().to_string().contains("circle"));
}

#[test]
fn normal_quantiles_have_a_closed_form() {
    let room = program(ROOM);
    let found = ask(&room, "quantile(0.1, 0.5, 0.9) P(T | A = 22)");
    close(
        &rows(&found),
        &[&[0.1, 20.666_412_223_002_442], &[0.5, 21.923_076_923_076_923], &[0.9, 23.179_741_623_151_404]],
    );
    let interval = ask(&room, "interval(0.9) P(T | A = 22)");
    close(&rows(&interval), &[&[0.9, 20.310_165_242_148_187, 23.535_988_604_005_66]]);
    let [low, high] = ask(&room, "P(T | A = 22)").interval(0.9).unwrap();
    assert!((low - 20.310_165_242_148_187).abs() < 1e-12 && (high - 23.535_988_604_005_66).abs() < 1e-12);
    // The same by draws, within four standard errors that they give.
    let drawn = room.clone().by("weighting").unwrap().draws(100_000).seed(3);
    for row in &ask(&drawn, "quantile(0.1, 0.9) P(T | A = 22)").answer().answer {
        let Figure::Quantile { level, quantile, error: Some(error) } = row.figure else { panic!("{row:?}") };
        let expected = if level < 0.5 { 20.666_412_223_002_442 } else { 23.179_741_623_151_404 };
        assert!(error > 0.0 && error < 0.2 && (quantile - expected).abs() < 4.0 * error, "{row:?}");
    }
    let Figure::Interval { errors: Some(_), .. } =
        ask(&drawn, "interval(0.9) P(T)").answer().answer[0].figure
    else {
        panic!("an interval of draws has errors")
    };
}

/// The level is N(0, 1) and moves by N(0, 1): after seeing 3 its mean is 2 and its variance 2/3.
#[test]
fn quantiles_over_time() {
    let level = program(
        "program Level { variables { L, L^-1, Z : real; } decomposition { P(L^-1) P(L | L^-1) P(Z | L) }
         forms { P(L^-1) = previous(L) else normal(0, 1); P(L | L^-1) = normal(L^-1, 1); P(Z | L) = normal(L, 1); } }",
    );
    let seen = [evidence! { Z: 3.0 }];
    for when in ["filter", "smooth"] {
        let question = format!("quantile(0.1, 0.9) {when} P(L | Z)");
        let answer = level.question(&question).unwrap().over(&seen).unwrap();
        close(&rows(&answer), &[&[0.1, 0.953_617_528_450_259_1], &[0.9, 3.046_382_471_549_741]]);
    }
    // Particles that carry a normal law each know any quantile.
    let drawn = level
        .clone()
        .by("particles")
        .unwrap()
        .seed(2)
        .question("filter P(L | Z)")
        .unwrap()
        .over(&seen)
        .unwrap();
    let found = drawn.quantile(0.1).unwrap();
    assert!((found - 0.953_617_528_450_259_1).abs() < 0.05, "{found}");
}

#[test]
fn the_mode_of_draws() {
    // The density of an exponential law is largest at 0; the half-sample mode of 20 000 draws is near.
    assert_eq!(ask(&program(ROOM), "argmax P(N | K = true)").mode().unwrap()["N"].as_f64(), Some(0.0));
    let room = program(ROOM).by("weighting").unwrap().draws(20_000).seed(4);
    let mode = ask(&room, "argmax P(N | K = true)");
    assert_eq!(mode.answer().answer[0].figure, Figure::Mode { by: "half-sample mode" });
    let found: f64 = mode.answer().answer[0].values[0].1.parse().unwrap();
    assert!((0.0..0.1).contains(&found), "{found}");
    assert!((0.0..0.1).contains(&ask(&room, "P(N | K = true)").mode().unwrap()["N"].as_f64().unwrap()));
    // Of finite variables the most frequent value.
    let loaded = program(LOADED).by("weighting").unwrap().seed(1);
    let best = ask(&loaded, "argmax P(Face | High = true)");
    let Figure::Estimated { p, error } = best.answer().answer[0].figure else { panic!("{best}") };
    assert!(best.answer().answer[0].values[0].1 == "6" && (p - 36.0 / 61.0).abs() < 4.0 * error, "{best}");
}

#[test]
fn levels_are_probabilities_strictly_between_0_and_1() {
    let loaded = program(LOADED);
    for (question, message) in [
        ("quantile(1.5) P(Face)", "takes probabilities above 0 and below 1, but 1.5 is not"),
        ("quantile(-0.1) P(Face)", "but -0.1 is not"),
        ("quantile(90) P(Face)", "90 % is `0.9`"),
        ("interval(0) P(Face)", "`interval(0)` takes probabilities above 0 and below 1"),
        ("interval(0.5, 0.9) P(Face)", "`interval` takes one number, found `0.9`"),
        ("quantile P(Face)", "write `quantile(0.1, 0.5, 0.9) P(…)`"),
        ("entropy(2) P(Face)", "`entropy` takes no number, found `2`"),
    ] {
        let Err(wrong) = loaded.ask(question) else { panic!("{question} is answered") };
        assert!(wrong.to_string().contains(message), "{question}: {wrong}");
    }
}
