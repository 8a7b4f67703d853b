//! Answers and ln P far below the range of f64.
//!
//! In: programs whose probabilities and densities underflow. Out: answers, compared with logarithms computed by hand or
//! by mpmath at 50 digits (each formula is next to its constant). Invariant: no expected value is output of this crate.

mod forms;
mod laws;
mod printed;
mod trees;
mod windows;

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use std::fmt::Write;

fn try_answer(text: &str, asked: &str, inputs: &Inputs<'_, f64>) -> Result<Answer, Error> {
    let model = model_of(text);
    Ok(ask(&model, &question(&model, asked), inputs)?.remove(0))
}

fn answer(text: &str, asked: &str, inputs: &Inputs<'_, f64>) -> Answer {
    try_answer(text, asked, inputs).unwrap_or_else(|error| panic!("{asked}: {error}"))
}

fn numbers(answer: &Answer) -> Vec<f64> {
    let number = |figure| match figure {
        Figure::Probability { p } => p,
        Figure::Divergence { divergence, .. } => divergence,
        Figure::Entropy { entropy, .. } => entropy,
        Figure::Information { information } => information,
        Figure::Expectation { expectation, .. } => expectation,
        other => panic!("{other:?}"),
    };
    answer.answer.iter().map(|row| number(row.figure)).collect()
}

#[track_caller]
fn near(found: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= relative * expected.abs(), "{found} {expected}");
    }
}

#[track_caller]
fn has_ln_evidence(answer: &Answer, expected: f64) {
    near(&[answer.ln_evidence.unwrap()], &[expected], 1e-12);
}

/// 1 / (1 + eˣ) and its complement, for a difference of two logarithms.
fn odds(ln_first: f64, ln_second: f64) -> [f64; 2] {
    [1.0 / (1.0 + (ln_second - ln_first).exp()), 1.0 / (1.0 + (ln_first - ln_second).exp())]
}

#[test]
fn hundreds_of_readings_of_a_real() {
    let text = "program A {
        variables { H : bool; G[1..=300] : real; }
        decomposition { P(H) prod(j) { P(G[j] | H) } }
        forms { P(H) = uniform; P(G[j] | H) = normal(if H { 0 } else { 1 }, 1); }
    }";
    // All are 3: -300 * 3**2 / 2 against -300 * 2**2 / 2.
    let readings = [3.0; 300];
    let given = answer(text, "P(H | G = g)", &Inputs::new().array("g", &readings));
    // mpmath: exp(-750) / (1 + exp(-750)); -600 - 300 log(sqrt(2 pi)) - log(2)
    assert_eq!(numbers(&given)[0], 1.0);
    assert!(numbers(&given)[1] <= 2e-325, "{given:?}");
    has_ln_evidence(&given, -876.374_707_141_961_8);
}

#[test]
fn densities_that_fall_and_rise_again() {
    // Half of the densities are about 1e-200, half 1e200: exponents up to 10⁶ in all. The second hypothesis differs by e
    // in one of them.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(14);
    for count in [10usize, 200, 1000] {
        let (mut names, mut factors, mut forms, mut known) =
            (String::new(), String::new(), String::new(), String::new());
        let mut ln = 0.0;
        for number in 0..count {
            let small = number < count / 2;
            // At z deviations of s: exp(-z²/2) / (s √(2π)); s = 10⁻²⁰⁰ with z = 0, s = 1 with z = 30.
            let (s, z) = match small {
                true => (1.0, 30.0 + random.random::<f64>()),
                false => (10f64.powi(-random.random_range(150..250)), 0.0),
            };
            write!(names, "X{number}, ").unwrap();
            write!(factors, "P(X{number} | H) ").unwrap();
            let other = if number == 0 {
                format!("if H {{ {s:e} }} else {{ {:e} }}", s * 2.0)
            } else {
                format!("{s:e}")
            };
            writeln!(forms, "P(X{number} | H) = normal(0, {other});").unwrap();
            write!(known, ", X{number} = {}", s * z).unwrap();
            if number > 0 {
                ln += -0.5 * z * z - s.ln() - 0.5 * std::f64::consts::TAU.ln();
            }
        }
        let names = names.trim_end_matches(", ");
        let text = format!(
            "program Two {{ variables {{ H : bool; {names} : real; }} decomposition {{ P(H) {factors} }}
            forms {{ P(H) = uniform; {forms} }} }}"
        );
        let given = answer(&text, &format!("P(H | {})", &known[2..]), &Inputs::new());
        let z: f64 = known[2..].split(", ").next().unwrap().split(" = ").nth(1).unwrap().parse().unwrap();
        let of = |s: f64| -0.5 * (z / s).powi(2) - s.ln() - 0.5 * std::f64::consts::TAU.ln();
        near(&numbers(&given), &odds(of(2.0), of(1.0)), 1e-9);
        let larger = of(2.0).max(of(1.0));
        let two = ((of(2.0) - larger).exp() + (of(1.0) - larger).exp()).ln() + larger;
        near(&[given.ln_evidence.unwrap()], &[ln + two - 2f64.ln()], 1e-12);
    }
}

#[test]
fn a_million_nats_below_zero() {
    let text = "program Far {
        variables { H : bool; X[1..=400] : real; }
        decomposition { P(H) prod(j) { P(X[j] | H) } }
        forms { P(H) = uniform; P(X[j] | H) = normal(if H { 0.0001 } else { 0 }, 1); }
    }";
    let readings = [70.7; 400];
    let given = answer(text, "P(H | X = x)", &Inputs::new().array("x", &readings));
    // mpmath: l0 = -200 * 70.7**2, l1 = -200 * 70.6999**2; exp(l0) / (exp(l0) + exp(l1)); log((exp(l0) + exp(l1)) / 2)
    // - 400 log(sqrt(2 pi))
    near(&numbers(&given)[..1], &[0.055_829_835_290_818_03], 1e-9);
    near(&[given.ln_evidence.unwrap()], &[-1_000_063.383_113_592_6], 1e-14);
}

#[test]
fn four_factors_of_1e_100() {
    let text = "program Tiny {
        variables { A : bool; B, C, D, E : bool; }
        decomposition { P(A) P(B | A) P(C | A) P(D | A) P(E | A) }
        forms {
            P(A) = bernoulli(0.25);
            P(B | A) = bernoulli(if A { 1e-100 } else { 3e-100 });
            P(C | A) = bernoulli(if A { 4e-100 } else { 1e-100 });
            P(D | A) = bernoulli(if A { 1e-100 } else { 2e-100 });
            P(E | A) = bernoulli(if A { 5e-100 } else { 1e-100 });
        }
    }";
    let given = answer(text, "P(A | B = true, C = true, D = true, E = true)", &Inputs::new());
    // 1/4 · 1 · 4 · 1 · 5 against 3/4 · 3 · 1 · 2 · 1: 5 to 4.5, times 10⁻⁴⁰⁰.
    near(&numbers(&given), &[9.0 / 19.0, 10.0 / 19.0], 1e-14);
    has_ln_evidence(&given, 9.5f64.ln() - 400.0 * std::f64::consts::LN_10);
    // The same as a table of contexts, of which one alone underflows.
    let table = answer(text, "P(A | B, C, D, E)", &Inputs::new());
    near(&numbers(&table)[30..], &[9.0 / 19.0, 10.0 / 19.0], 1e-14);
    // Soft evidence of a value that has a probability of 10⁻³⁰⁰ after the others: P(A | B C D E) as before.
    let soft = answer(text, "P(A | B = true, C = true, D = true, E soft [0, 1])", &Inputs::new());
    near(&numbers(&soft), &[9.0 / 19.0, 10.0 / 19.0], 1e-14);
}

#[test]
fn subnormal_densities_keep_their_digits() {
    let text = "program Far {
        variables { K : { a, b }; Y : real; }
        decomposition { P(K) P(Y | K) }
        forms { P(K) = uniform; P(Y | K) = normal(if K == a { 0 } else { -0.0388 }, 1); }
    }";
    let given = answer(text, "P(K | Y = 38.55)", &Inputs::new());
    // mpmath: a = exp(-38.55**2 / 2), b = exp(-38.5888**2 / 2); a / (a + b); log((a + b) / 2 / sqrt(2 pi))
    let a = 0.817_050_795_074_173;
    near(&numbers(&given), &[a, 1.0 - a], 1e-11);
    near(&[given.ln_evidence.unwrap()], &[-744.461_281_700_383_2], 1e-14);
}

#[test]
fn a_hundred_thousand_tosses() {
    let text = "program Toss {
        parameters { N : size = 100000; }
        variables { H : bool; G[1..=N] : bool; }
        decomposition { P(H) prod(j) { P(G[j] | H) } }
        forms { P(H) = uniform; P(G[j] | H) = bernoulli(if H { 0.5 } else { 0.5001 }); }
    }";
    let tosses: Vec<f64> = (0..100_000).map(|toss| f64::from(toss % 2)).collect();
    let given = answer(text, "P(H | G = g)", &Inputs::new().array("g", &tosses));
    // mpmath: l0 = 50000 (log(0.5001) + log(0.4999)), l1 = 100000 log(0.5); 1 / (1 + exp(l1 - l0));
    // log((exp(l0) + exp(l1)) / 2)
    near(&numbers(&given), &[0.499_500_000_156_666_7, 0.500_499_999_843_333_3], 1e-9);
    near(&[given.ln_evidence.unwrap()], &[-69_314.719_055_494_55], 1e-12);
}

#[test]
fn laws_over_a_domain_far_from_their_mean() {
    let text = "program Bins {
        variables { H : bool; Y : bins(0, 10, 10); K : 0..=20; }
        decomposition { P(H) P(Y | H) P(K | H) }
        forms {
            P(H) = uniform;
            P(Y | H) = normal(if H { 5 } else { -400 }, 1);
            P(K | H) = poisson(if H { 3 } else { 20000 });
        }
    }";
    // mpmath, of normal(-400, 1): (Phi(401 - k) - Phi(400 - k)) over their sum, k = 1: 1.1587e-174
    let masses = numbers(&answer(text, "P(Y | H = false)", &Inputs::new()));
    near(&masses[..2], &[1.0, 1.158_712_334_284_296_6e-174], 1e-10);
    // mpmath: 20000**k / k! over their sum, k from 0 to 20.
    let counts = numbers(&answer(text, "P(K | H = false)", &Inputs::new()));
    near(&counts[19..], &[0.000_999_000_050_045_035_8, 0.999_000_050_045_035_8], 1e-10);
    // P(K = 20 | H) is 0.999 against 20! 3^-20 …: a factor normalised before the product does not underflow.
    let below: f64 = (0..20)
        .map(|k: i32| {
            (f64::from(k) - 20.0) * 3f64.ln() + (k + 1..=20).map(|n| f64::from(n).ln()).sum::<f64>()
        })
        .map(f64::exp)
        .sum();
    let three = 1.0 / (1.0 + below);
    let given = answer(text, "P(H | K = 20)", &Inputs::new());
    near(&numbers(&given)[1..], &[three / (three + 0.999_000_050_045_035_8)], 1e-9);
}

#[test]
fn weights_of_any_size_are_normalised() {
    let text = "program Weighed {
        variables { K : 1..=3; B : bool; }
        decomposition { P(K) P(B | K) }
        forms { P(K) = weights(exp(-1000 * K)); P(B | K) = bernoulli(exp(500 * K - 2000) / (1 + exp(500 * K - 2000))); }
    }";
    // e⁻¹⁰⁰⁰, e⁻²⁰⁰⁰ …; B is true with e⁻¹⁵⁰⁰, e⁻¹⁰⁰⁰, e⁻⁵⁰⁰: products e⁻²⁵⁰⁰, e⁻³⁰⁰⁰, e⁻³⁵⁰⁰.
    let given = answer(text, "P(K | B = true)", &Inputs::new());
    near(&numbers(&given)[..2], &[1.0, (-500f64).exp()], 1e-12);
    near(&[given.ln_evidence.unwrap()], &[-1500.0], 1e-14);
}

#[test]
fn likelihoods_of_any_size() {
    let text = "program Three {
        variables { A, B, C : bool; } decomposition { P(A) P(B | A) P(C | A) }
        forms {
            P(A) = bernoulli(0.4); P(B | A) = bernoulli(if A { 0.9 } else { 0.2 });
            P(C | A) = bernoulli(if A { 0.7 } else { 0.5 });
        }
    }";
    for scale in [1e-320f64, 1e-300, 1e-10, 1e300] {
        let (two, three) = (2.0 * scale, 3.0 * scale);
        let asked = format!("P(A | B virtual [{two:e}, {scale:e}], C virtual [{scale:e}, {three:e}])");
        let given = answer(text, &asked, &Inputs::new());
        // A false: 0.6 (0.8 · 2 + 0.2 · 1) (0.5 · 1 + 0.5 · 3); A true: 0.4 (0.1 · 2 + 0.9 · 1) (0.3 · 1 + 0.7 · 3).
        let (no, yes) = (0.6 * 1.8 * 2.0, 0.4 * 1.1 * 2.4);
        // A subnormal scale has few digits.
        let digits = if scale < 1e-310 { 1e-3 } else { 1e-14 };
        near(&numbers(&given), &[no / (no + yes), yes / (no + yes)], digits);
        near(&[given.ln_evidence.unwrap()], &[(no + yes).ln() + 2.0 * scale.ln()], digits);
    }
}

#[test]
fn answers_made_of_tiny_probabilities() {
    let text = "program Pair {
        variables { X, Y : bool; Z, W : bool; }
        decomposition { P(X) P(Y | X) P(Z | X) P(W | X) }
        forms {
            P(X) = bernoulli(1e-200); P(Y | X) = bernoulli(if X { 1 } else { 0 });
            P(Z | X) = bernoulli(if X { 1e-250 } else { 1e-250 }); P(W | X) = bernoulli(if X { 2e-250 } else { 1e-250 });
        }
    }";
    // X and Y are equal: p = 10⁻²⁰⁰ has the information −p ln p + p.
    let p = 1e-200;
    let information = numbers(&answer(text, "information P(X, Y)", &Inputs::new()));
    // f64 rounds 1 − p to 1, so the last term p is lost.
    near(&information, &[p * 200.0 * std::f64::consts::LN_10 + p], 3e-3);
    // Given Z and W the odds of X are those of W alone, 2 · 10⁻²⁰⁰.
    let entropy = numbers(&answer(text, "entropy P(X | Z = true, W = true)", &Inputs::new()));
    let q: f64 = 2e-200;
    near(&entropy, &[-q * q.ln() + q], 3e-3);
    // ln (1 / (2 · 10⁻²⁰⁰ …)): Σ p ln(p / q) between two posteriors whose ratio exceeds the exponents of f64.
    let far = "program Far {
        variables { H : bool; G[1..=40] : real; }
        decomposition { P(H) prod(j) { P(G[j] | H) } }
        forms { P(H) = uniform; P(G[j] | H) = normal(if H { 1 } else { -1 }, 1); }
    }";
    let (up, down) = ([20.0; 40], [-20.0; 40]);
    let inputs = Inputs::new().array("up", &up).array("down", &down);
    let divergence = numbers(&answer(far, "divergence P(H | G = up) from P(H | G = down)", &inputs));
    // ln p(true | up) is −e⁻¹⁶⁰⁰, ln p(true | down) is −2 · 40 · 20.
    near(&divergence, &[1600.0], 1e-12);
}

#[test]
fn impossible_evidence_names_its_factor() {
    let text = "program Chain {
        variables { A, B, C : bool; N : 0..=3; }
        decomposition { P(A) P(B | A) P(C | B) P(N) }
        forms {
            P(A) = uniform; P(B | A) = bernoulli(if A { 1 } else { 1e-300 });
            P(C | B) = bernoulli(if B { 1 } else { 0 }); P(N) = categorical(0.5, 0.5, 0, 0);
        }
    }";
    let refusal = |asked: &str| {
        let error = try_answer(text, asked, &Inputs::new()).unwrap_err();
        assert!(matches!(error, Error::Impossible(_)), "{error}");
        error.to_string()
    };
    let message = refusal("P(A | N = 1, B = true, C = false)");
    assert!(message.contains("`P(C | B)` is 0 for `C = false` where `B = true`"), "{message}");
    let message = refusal("P(A | C = true, N = 2)");
    assert!(message.contains("`P(N)` is 0 for `N = 2`"), "{message}");
    let message = refusal("P(B | C = false, A = true)");
    assert!(message.contains("`P(C | B)` is 0 for `C = false` where `B = true`"), "{message}");
    // An improbable event is not an error.
    let given = answer(text, "P(A | B = true, C = true)", &Inputs::new());
    near(&numbers(&given), &[1e-300, 1.0], 1e-14);
    // A form without a possible value, beyond a variable that has one.
    let text = "program Never { variables { D, E : 0..=2; } decomposition { P(D) P(E | D) }
        forms { P(D) = dirac(2); P(E | D) = dirac(D + 1); } }";
    for asked in ["P(E)", "P(D)"] {
        let message = try_answer(text, asked, &Inputs::new()).unwrap_err().to_string();
        let expected =
            format!("`{asked}` has probability zero: `P(E | D)` is 0 for every value where `D = 2`");
        assert_eq!(message, expected);
    }
    // A value that is impossible whatever the value of a variable without one.
    let text =
        "program Imp { variables { A : 0..=2; E : 0..=1; G : bool; } decomposition { P(A) P(E) P(G | A E) }
        forms { P(A) = table { 0.5, 0, 0.5 }; P(E) = table { 1, 0 }; P(G | A E) = uniform; } }";
    for asked in ["P(G | A, E = 1)", "argmax P(G | A, E = 1)", "entropy P(G | A, E = 1)"] {
        let message = try_answer(text, asked, &Inputs::new()).unwrap_err().to_string();
        assert!(message.contains("`P(E)` is 0 for `E = 1`"), "{message}");
    }
}
