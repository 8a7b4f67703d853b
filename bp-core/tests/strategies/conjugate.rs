//! Conjugate priors: posteriors under their usual names.
//!
//! In: programs with `beta`, `gamma` and `dirichlet` priors. Out: posteriors, predictions, ln P(evidence). Invariant: expected values
//! are exact fractions, computed by hand.

use crate::support::close;
use bp_core::prelude::*;
use statrs::distribution::{Beta, ContinuousCDF, Gamma, StudentsT};

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

const COIN: &str = "program Coin {
    variables { Theta : real; Heads : 0..=10; Next : bool; }
    decomposition { P(Theta) P(Heads | Theta) P(Next | Theta) }
    forms { P(Theta) = beta(2, 3); P(Heads | Theta) = binomial(10, Theta); P(Next | Theta) = bernoulli(Theta); }
}";

/// beta(2, 3) and 7 of 10: beta(9, 6). B(2, 3) = 1/12, B(9, 6) = 1/18018, 120 ways: P = 120 · 12 / 18018 = 80/1001.
#[test]
fn a_coin_has_a_beta_distribution() {
    let posterior = program(COIN).ask("P(Theta | Heads = 7)").unwrap();
    assert_eq!((posterior.strategy().name(), posterior.warning()), ("conjugate", None));
    assert!(posterior.to_string().contains("beta(9, 6)"), "{posterior}");
    close(posterior.mean().unwrap(), 0.6);
    close(posterior.variance().unwrap(), 54.0 / (225.0 * 16.0));
    close(posterior.mode().unwrap()["Theta"].as_f64().unwrap(), 8.0 / 13.0);
    close(posterior.ln_evidence().unwrap(), (80.0f64 / 1001.0).ln());
    let law = Beta::new(9.0, 6.0).unwrap();
    for level in [0.001, 0.05, 0.5, 0.95, 0.999] {
        let found = posterior.quantile(level).unwrap();
        assert!((found - law.inverse_cdf(level)).abs() < 1e-9, "{found} at {level}");
    }
    // The density 9!·... at one half: x⁸ (1 − x)⁵ · 18018.
    close(posterior.p(0.5).unwrap(), 18018.0 * 0.5f64.powi(13));
    close(program(COIN).ask("P(Next | Heads = 7)").unwrap().p(true).unwrap(), 0.6);
    close(program(COIN).ask("expectation P(Theta | Next = true)").unwrap().number().unwrap(), 0.5);
    // All values of a count: the beta-binomial distribution sums to one; P(10) = B(12, 3) / B(2, 3) = 12/1092.
    let heads = program(COIN).ask("P(Heads)").unwrap();
    close(heads.p(10).unwrap(), 12.0 / 1092.0);
    close((0..=10).map(|value| heads.p(value).unwrap()).sum(), 1.0);
}

/// Rows of two groups with an unknown each; which group is data.
#[test]
fn rows_are_counted_in_their_groups() {
    let text = "program Groups {
        variables { Theta[g in Groups] : real; Won[row in Rows] : bool; }
        decomposition { prod(g in Groups) { P(Theta[g]) } prod(row in Rows) { P(Won[row] | Theta) } }
        forms { P(Theta[g]) = uniform(0, 1); P(Won[row] | Theta) = bernoulli(Theta[group[row]]); }
    }";
    let count = 20_000;
    let groups = (0..=count).map(|row| if row % 4 == 0 { "a" } else { "b" });
    // Of a every second one is won, of b every third.
    let won = |row: usize| if row.is_multiple_of(4) { row.is_multiple_of(8) } else { row.is_multiple_of(3) };
    let cells = (0..=count).map(|row| if row == count { "NA".to_owned() } else { won(row).to_string() });
    let rows = Rows::new().column("group", groups).column("Won", cells);
    let program = program(text).rows(rows).unwrap();
    let posterior = program.ask("P(Theta)").unwrap();
    assert_eq!(posterior.strategy().name(), "conjugate");
    let of = |group: usize| {
        let own = (0..count).filter(|row| (row % 4 == 0) == (group == 0));
        let (all, wins) = own.fold((0, 0), |(all, wins), row| (all + 1, wins + usize::from(won(row))));
        (1 + wins) as f64 / (2 + all) as f64
    };
    close(posterior.of("Theta[a]").unwrap().mean().unwrap(), of(0));
    close(posterior.of("Theta[b]").unwrap().mean().unwrap(), of(1));
}

#[test]
fn a_missing_row_is_predicted() {
    let text = "program Throws {
        variables { Theta : real; Y[row in Rows] : bool; }
        decomposition { P(Theta) prod(row in Rows) { P(Y[row] | Theta) } }
        forms { P(Theta) = beta(1, 2); P(Y[row] | Theta) = bernoulli(Theta); }
    }";
    let rows = Rows::new().column("Y", ["true", "true", "false", "NA"]);
    let posterior = program(text).rows(rows).unwrap().ask("P(Y)").unwrap();
    // beta(3, 3)
    close(posterior.p(true).unwrap(), 0.5);
}

/// dirichlet(1, 2, 3) and counts 4, 0, 2: dirichlet(5, 2, 5).
#[test]
fn proportions_have_a_dirichlet_distribution() {
    let text = "program Ballots {
        variables { Share, Votes : real[3]; Next : { Red, Green, Blue }; }
        decomposition { P(Share) P(Votes | Share) P(Next | Share) }
        forms { P(Share) = dirichlet(1, 2, 3); P(Votes | Share) = multinomial(6, Share); P(Next | Share) = categorical(Share); }
    }";
    let ballots = |asked: &str| {
        let question = program(text).question(asked).unwrap();
        question.given("votes", vec![4.0, 0.0, 2.0]).unwrap().ask().unwrap()
    };
    let posterior = ballots("P(Share | Votes = votes)");
    assert_eq!(posterior.strategy().name(), "conjugate");
    assert!(posterior.to_string().contains("beta(5, 7)"), "{posterior}");
    close(posterior.of("Share[1]").unwrap().mean().unwrap(), 2.0 / 12.0);
    close(posterior.covariance("Share[0]", "Share[1]").unwrap(), -10.0 / (144.0 * 13.0));
    // 15 ways; Γ(5) Γ(2) Γ(5) / Γ(12) times Γ(6) / (Γ(1) Γ(2) Γ(3)).
    close(posterior.ln_evidence().unwrap(), (15.0 * 24.0 * 24.0 / 39_916_800.0 * 120.0 / 2.0f64).ln());
    let next = ballots("P(Next | Votes = votes)");
    close(next.p("Green").unwrap(), 2.0 / 12.0);
}

/// gamma(3, 2), 4 events in 2 hours and 1 in half an hour: gamma(8, 4.5).
#[test]
fn rates_have_a_gamma_distribution() {
    let text = "program Calls {
        variables { Rate : real; Calls[row in Rows] : real; Wait : real; }
        decomposition { P(Rate) prod(row in Rows) { P(Calls[row] | Rate) } P(Wait | Rate) }
        forms { P(Rate) = gamma(3, 2); P(Calls[row] | Rate) = poisson(Rate * hours[row]); P(Wait | Rate) = exponential(2 * Rate); }
    }";
    let rows = Rows::new().column("hours", [2.0, 0.5]).column("Calls", [4.0, 1.0]);
    let calls = program(text).rows(rows).unwrap();
    let posterior = calls.ask("P(Rate)").unwrap();
    assert!(posterior.to_string().contains("gamma(8, 4.5)"), "{posterior}");
    close(posterior.mean().unwrap(), 16.0 / 9.0);
    // 2⁴/4! · ½ · Γ(8)/Γ(3) · 2³/4.5⁸
    let expected = 16.0 / 24.0 * 0.5 * 2520.0 * 8.0 / 4.5f64.powi(8);
    close(posterior.ln_evidence().unwrap(), expected.ln());
    let waited = calls.ask("P(Rate | Wait = 3)").unwrap();
    assert!(waited.to_string().contains("gamma(9, 10.5)"), "{waited}");
}

/// A predicate of an unknown is the mass of its posterior; what else depends on it is drawn from this posterior, not from the prior,
/// whose draws are nearly all 0 here.
#[test]
fn what_depends_on_an_unknown_is_answered_by_its_posterior() {
    let text = "program Calls {
        variables { Rate : real; Calls[row in Rows] : real; Next : real; }
        decomposition { P(Rate) prod(row in Rows) { P(Calls[row] | Rate) } P(Next | Rate) }
        forms { P(Rate) = gamma(0.001, 0.001); P(Calls[row] | Rate) = poisson(Rate); P(Next | Rate) = poisson(Rate); }
    }";
    let calls = program(text).rows(Rows::new().column("Calls", vec![50.0; 300])).unwrap();
    let law = Gamma::new(15_000.001, 300.001).unwrap();
    for (question, expected) in [
        ("P(Rate > 50.3)", law.sf(50.3)),
        ("P(2 * Rate < 101)", law.cdf(50.5)),
        ("P(Rate > 49.5 and Rate < 50)", law.cdf(50.0) - law.cdf(49.5)),
    ] {
        let found = calls.ask(question).unwrap();
        assert_eq!(found.strategy().name(), "conjugate");
        let p = found.p(true).unwrap();
        assert!((p - expected).abs() < 1e-9, "{question}: {p}, expected {expected}");
    }
    let mean = 15_000.001 / 300.001;
    for (question, expected) in [("P(Rate * Rate)", mean * mean + mean / 300.001), ("P(Next)", mean)] {
        let found = calls.ask(question).unwrap();
        let [value, error] = found.mean_and_error().unwrap();
        assert!((value - expected).abs() < 4.0 * error, "{question}: {value} ± {error}, expected {expected}");
        assert_eq!(found.warning(), None);
        let all = found.estimate().unwrap();
        assert!((all.effective - all.particles as f64).abs() < 1e-6, "{all:?}");
    }
}

/// Of a law of which nothing is observed too: the tail of a Student distribution with 4 degrees of freedom.
#[test]
fn a_predicate_of_a_prior_is_its_mass() {
    let tail = program(
        "program Tail { variables { X : real; } decomposition { P(X) } forms { P(X) = student_t(4, 0, 1); } }",
    );
    let found = tail.ask("P(X > 4)").unwrap();
    assert_eq!(found.estimate().map(|it| it.particles), None);
    let expected = StudentsT::new(0.0, 1.0, 4.0).unwrap().sf(4.0);
    assert!((found.p(true).unwrap() - expected).abs() < 1e-12, "{found}");
}

#[test]
fn an_impossible_observation_is_named() {
    let text = "program Calls { variables { Rate : real; Calls[1..=2] : real; }
        decomposition { P(Rate) prod(i) { P(Calls[i] | Rate) } }
        forms { P(Rate) = gamma(3, 2); P(Calls[i] | Rate) = poisson(3 * Rate); } }";
    let error = program(text).ask("P(Rate | Calls[1] = 4.5)").unwrap_err().to_string();
    assert!(error.contains("is 0 for `Calls[1] = 4.5`"), "{error}");
}

#[test]
fn other_forms_are_refused() {
    let refused = |text: &str, asked: &str, words: &str| {
        let error = program(text).by("conjugate").unwrap().ask(asked).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    let text =
        "program Calls { variables { Rate : real; Calls : 0..=9; } decomposition { P(Rate) P(Calls | Rate) }
        forms { P(Rate) = gamma(3, 2); P(Calls | Rate) = poisson(Rate); } }";
    refused(
        text,
        "P(Rate | Calls = 3)",
        "is normalised over its range, so that its rate has no conjugate prior",
    );
    let text = "program Odd { variables { Theta : real; Y : bool; } decomposition { P(Theta) P(Y | Theta) }
        forms { P(Theta) = beta(1, 1); P(Y | Theta) = bernoulli(Theta * Theta); } }";
    refused(text, "P(Theta | Y = true)", "is not of a form with a conjugate prior");
    refused(COIN, "information P(Theta | Heads = 7)", "`information`");
    let flat = "program Flat { variables { Theta : real; Y : bool; } decomposition { P(Theta) P(Y | Theta) }
        forms { P(Theta) = beta(0.5, 0.5); P(Y | Theta) = bernoulli(Theta); } }";
    refused(flat, "argmax P(Theta)", "has its largest density at more than one value");
}

/// gamma(0.001, 0.001) and 4, 7, 5 events: gamma(16.001, 3.001). beta(4, 4): integrals of polynomials. In 50 digits.
#[test]
fn predicates_of_unknowns_are_integrals_of_their_posterior() {
    let events = program(
        "program Events { variables { L : real; N[1..=3] : real; } decomposition { P(L) prod(i) { P(N[i] | L) } }
         forms { P(L) = gamma(0.001, 0.001); P(N[i] | L) = poisson(L); } }",
    );
    let known = "N[1] = 4, N[2] = 7, N[3] = 5";
    let above = events.ask(&format!("P(L > 6 | {known})")).unwrap();
    assert_eq!(above.strategy().name(), "conjugate");
    close(above.p(true).unwrap(), 0.286_265_771_203_119);
    close(
        events.ask(&format!("P(12 - 2 * L < 0 | {known})")).unwrap().p(true).unwrap(),
        0.286_265_771_203_119,
    );
    let coins = program(
        "program Coins { variables { Theta[1..=2] : real; } decomposition { prod(i) { P(Theta[i]) } }
         forms { P(Theta[i]) = beta(4, 4); } }",
    );
    close(coins.ask("P(Theta[2] > 0.6)").unwrap().p(true).unwrap(), 0.289_792);
    let inside = coins.ask("P(Theta[1] > 0.2 and not Theta[1] > 0.5)").unwrap();
    close(inside.p(true).unwrap(), 0.466_656);
    close(coins.ask("P(Theta[1] > 2)").unwrap().p(true).unwrap(), 0.0);
    let error = events.ask("P(L | N[1] = 4.5)").unwrap_err().to_string();
    assert!(error.contains("is 0 for `N[1] = 4.5`"), "{error}");
}

/// A strong prior is updated by a few observations: no digit is lost in a difference of large logarithms. ln P in 60 digits
/// (mpmath 1.3).
#[test]
fn strong_priors_keep_the_digits_of_ln_p() {
    let ln = |text: &str, question: &str| program(text).ask(question).unwrap().ln_evidence().unwrap();
    let coin = "program Coin { variables { Theta : real; Y : 0..=4; } decomposition { P(Theta) P(Y | Theta) }
        forms { P(Theta) = beta(1e8, 3e8); P(Y | Theta) = binomial(4, Theta); } }";
    // 4 ways of 3 successes.
    close(ln(coin, "P(Theta | Y = 3)"), 4f64.ln() - 4.446_565_140_811_453);
    let events = "program Events { variables { L : real; N[1..=3], T : real; }
        decomposition { P(L) prod(i) { P(N[i] | L) } P(T | L) }
        forms { P(L) = gamma(1e10, 1e10); P(N[i] | L) = poisson(L); P(T | L) = exponential(L); } }";
    close(ln(events, "P(L | N[1] = 0, N[2] = 1, N[3] = 3)"), -4.791_759_469_378_055);
    close(ln(events, "P(L | T = 0.1234567)"), -0.123_456_700_011_583_6);
}

/// beta(9, 6) and gamma(7, 3): entropies in 40 digits (mpmath 1.3, ψ and ln Γ).
#[test]
fn entropy_mode_and_draws_of_a_named_law() {
    let number = |question: &str| program(COIN).ask(question).unwrap().number().unwrap();
    close(number("entropy P(Theta | Heads = 7)"), -0.688_340_101_424_494_5);
    let mode = program(COIN).ask("argmax P(Theta | Heads = 7)").unwrap();
    close(mode.mode().unwrap()["Theta"].as_f64().unwrap(), 8.0 / 13.0);
    // 18018 x⁸ (1 − x)⁵ at 8/13.
    close(number("max P(Theta | Heads = 7)"), 18018.0 * (8.0f64 / 13.0).powi(8) * (5.0f64 / 13.0).powi(5));
    let events = "program Events { variables { L : real; N : real; } decomposition { P(L) P(N | L) }
        forms { P(L) = gamma(2, 2); P(N | L) = poisson(L); } }";
    close(program(events).ask("entropy P(L | N = 5)").unwrap().number().unwrap(), 1.243_932_912_751_188_5);
    let draws = program(COIN).ask("draw(4000) P(Theta | Heads = 7)").unwrap();
    let rows = draws.answer().answer.iter();
    let all: Vec<f64> = rows.map(|row| row.values[0].1.parse().unwrap()).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    // The deviation of beta(9, 6) is 0.1225: of the mean of 4000, 0.0019.
    assert!(all.len() == 4000 && (mean - 0.6).abs() < 0.008, "{mean}");
}

const MEASURED: &str = "program Measured {
    variables { Tau, Mu, Y[1..=5], Next : real; }
    decomposition { P(Tau) P(Mu | Tau) prod(i) { P(Y[i] | Mu Tau) } P(Next | Mu Tau) }
    forms {
        P(Tau) = gamma(2, 3); P(Mu | Tau) = normal(1, 1 / sqrt(0.5 * Tau));
        P(Y[i] | Mu Tau) = normal(Mu, sqrt(1 / Tau)); P(Next | Mu Tau) = normal(Mu, 1 / sqrt(Tau));
    }
}";

/// The normal–gamma prior in its textbook form (DeGroot 1970, section 9.6), in 40 digits; ln P also by quadrature over τ (mpmath).
#[test]
fn a_mean_and_a_precision_have_a_closed_form() {
    let measured = program(MEASURED);
    let known = "Y[1] = 1.2, Y[2] = 0.7, Y[3] = 2.9, Y[4] = 1.4, Y[5] = 3.3";
    let ask = |question: &str| measured.ask(&format!("{question} | {known})")).unwrap();
    let tau = ask("P(Tau");
    assert_eq!((tau.strategy().name(), tau.warning()), ("conjugate", None));
    close(tau.mean().unwrap(), 0.782_052_294_810_016_6);
    close(tau.variance().unwrap(), 0.135_912_398_181_691_8);
    close(tau.ln_evidence().unwrap(), -9.017_278_943_550_782);
    let mean = ask("P(Mu");
    assert!(mean.to_string().contains("student_t(9, "), "{mean}");
    close(mean.mean().unwrap(), 1.0 + 9.0 / 11.0);
    close(mean.variance().unwrap(), 0.298_913_813_459_268);
    let above = ask("P(Mu > 2");
    assert_eq!(above.strategy().name(), "conjugate");
    close(above.p(true).unwrap(), 0.357_424_904_645_219_2);
    close(ask("P(Next").variance().unwrap(), 1.942_939_787_485_242);
    // Draws of the program agree within four standard errors.
    let drawn = measured.by("weighting").unwrap().ask(&format!("P(Mu | {known})")).unwrap();
    let [found, error] = drawn.mean_and_error().unwrap();
    assert!((found - 20.0 / 11.0).abs() < 4.0 * error, "{found} ± {error}");
}

/// A regression with known coefficients of the prior and an unknown precision, by matrix algebra in 40 digits (mpmath).
#[test]
fn a_regression_with_unknown_noise_has_a_closed_form() {
    let line = program(
        "program Line {
            parameters { x[0..=3] : real = [0, 1, 2, 3]; }
            variables { Tau, A, B, Y[0..=3] : real; }
            decomposition { P(Tau) P(A | Tau) P(B | Tau) prod(i) { P(Y[i] | A B Tau) } }
            forms {
                P(Tau) = exponential(0.5); P(A | Tau) = normal(0, 2 * pow(Tau, -0.5)); P(B | Tau) = normal(1, 3 / sqrt(Tau));
                P(Y[i] | A B Tau) = normal(A * x[i] + B, 1 / sqrt(Tau));
            }
        }",
    );
    let known = "Y[0] = 1.1, Y[1] = 2.9, Y[2] = 5.2, Y[3] = 6.8";
    let both = line.ask(&format!("P(A, B | {known})")).unwrap();
    assert_eq!(both.strategy().name(), "conjugate");
    close(both.of("A").unwrap().mean().unwrap(), 1.854_366_543_665_436_7);
    close(both.of("B").unwrap().mean().unwrap(), 1.212_546_125_461_254_6);
    close(both.covariance("A", "B").unwrap(), -0.131_744_938_113_587_78);
    close(both.ln_evidence().unwrap(), -7.001_256_796_796_45);
    close(line.ask(&format!("P(Tau | {known})")).unwrap().mean().unwrap(), 3.024_966_203_227_127);
    // Precise measurements in a coarse unit: Q is 10⁻¹⁰ of what it is in the other.
    let tiny = program(
        "program Tiny { variables { Tau, Y[1..=3] : real; } decomposition { P(Tau) prod(i) { P(Y[i] | Tau) } }
         forms { P(Tau) = gamma(1, 1e-10); P(Y[i] | Tau) = normal(0, 1 / sqrt(Tau)); } }",
    );
    // a′ = 1 + 3/2, b′ = 10⁻¹⁰ (1 + (1 + 4 + 9)/2).
    let tau = tiny.ask("P(Tau | Y[1] = 1e-5, Y[2] = 2e-5, Y[3] = -3e-5)").unwrap();
    close(tau.mean().unwrap() / 1e10, 2.5 / 8.0);
    let wrong = "program Wrong { variables { Tau, M, Y : real; } decomposition { P(Tau) P(M) P(Y | M Tau) }
        forms { P(Tau) = gamma(2, 3); P(M) = normal(0, 1); P(Y | M Tau) = normal(M, 1 / sqrt(Tau)); } }";
    let error = program(wrong).by("conjugate").unwrap().ask("P(Tau | Y = 1)").unwrap_err().to_string();
    assert!(
        error
            .contains("`P(M)` is not normal with a standard deviation that is a number over the square root"),
        "{error}"
    );
}

/// Families of which one form does not scale with the precision are estimated: their exact answers would be wrong.
#[test]
fn forms_that_do_not_scale_with_the_precision_are_not_conjugate() {
    for (prior, mean, deviation) in [
        ("normal(0, 1)", "Mu", "1 / sqrt(Tau)"),
        ("normal(1, 2 / sqrt(Tau))", "Mu", "1 / Tau"),
        ("normal(1, 2 / sqrt(Tau))", "Mu + Tau", "1 / sqrt(Tau)"),
        ("normal(1, 2 / sqrt(Tau))", "Mu", "1"),
        ("normal(1, 2 / sqrt(Tau))", "Mu", "1 / sqrt(Tau) + 0.1"),
    ] {
        let text = format!(
            "program F {{ variables {{ Tau, Mu, Y[1..=3] : real; }} decomposition {{ P(Tau) P(Mu | Tau) prod(i) {{ P(Y[i] | Mu Tau) }} }}
             forms {{ P(Tau) = gamma(3, 2); P(Mu | Tau) = {prior}; P(Y[i] | Mu Tau) = normal({mean}, {deviation}); }} }}"
        );
        let tau = program(&text).draws(500).ask("P(Tau | Y = [1.5, 2, 4])").unwrap();
        assert_ne!(tau.strategy().name(), "conjugate", "{prior} {mean} {deviation}");
    }
    // The closed form in 40 digits (mpmath): Q of data on a large scale loses no digits of N.
    let large = program(
        "program Large { variables { Tau, Mu, Y[1..=6] : real; } decomposition { P(Tau) P(Mu) prod(i) { P(Y[i] | Mu Tau) } }
         forms { P(Tau) = gamma(2, 1); P(Mu) = flat; P(Y[i] | Mu Tau) = normal(Mu, 1 / sqrt(Tau)); } }",
    );
    let data = "[1528412411.49, 1875007314.33, 1220586489.68, 1797713184.16, 1422253638.69, 1421546704.81]";
    let tau = large.ask(&format!("P(Tau | Y = {data})")).unwrap();
    close(tau.mean().unwrap() * 1e17, 2.916_471_341_240_979_5);
    close(tau.ln_evidence().unwrap(), -181.136_258_745_995_8);
}

/// P(X < 1) under gamma(a, a), and 5 % quantiles, in 30 digits (mpmath: Temme's expansion and quadrature).
#[test]
fn strong_gamma_distributions_have_both_tails() {
    for (a, below, quantile) in [
        (1e8, 0.500_013_298_076_014_1, 0.999_835_520_322_645_9),
        (1e10, 0.500_001_329_807_601_3, 0.999_983_551_520_582_2),
        (1e12, 0.500_000_132_980_760_1, 0.999_998_355_146_941_6),
        (1e14, 0.500_000_013_298_076, 0.999_999_835_514_643),
    ] {
        let text = format!(
            "program G {{ variables {{ L : real; }} decomposition {{ P(L) }} forms {{ P(L) = gamma({a}, {a}); }} }}"
        );
        close(program(&text).ask("P(L < 1)").unwrap().p(true).unwrap(), below);
        let found = program(&text).ask("P(L)").unwrap().quantile(0.05).unwrap();
        assert!((found - quantile).abs() < 1e-15, "{found}, expected {quantile}");
    }
}
