//! Numbers beyond the range of f64, and invalid numbers of a form, through the macro.

use bp_core::compiler::error::Error;
use bp_macros::bayesian_program;

bayesian_program! {
    program Tiny {
        variables { A, B, C, D, E : bool; }
        decomposition { P(A) P(B | A) P(C | A) P(D | A) P(E | A) }
        forms {
            P(A) = bernoulli(0.25);
            P(B | A) = bernoulli(if A { 1e-100 } else { 2e-100 });
            P(C | A) = bernoulli(if A { 1e-100 } else { 0.5e-100 });
            P(D | A) = bernoulli(if A { 3e-100 } else { 1e-100 });
            P(E | A) = bernoulli(if A { 1e-100 } else { 1e-100 });
        }
        question a { P(A | B = true, C = true, D = true, E = true) }
        question best { argmax P(A | B = true, C = true, D = true, E = true) }
    }
}

bayesian_program! {
    program Rates {
        parameters { rate : real = 0.5; }
        variables { X : 1..=3; Y : bool; Z : bool; }
        decomposition { P(X) P(Y | X) P(Z | Y) }
        forms {
            P(X) = uniform;
            P(Y | X) = bernoulli(rate * X);
            P(Z | Y) = bernoulli(if Y { 1 } else { 0.5 });
        }
        question x { P(X | Y = y) }
        question z { P(X | Z = false, Y = y) }
    }
}

bayesian_program! {
    program Plate over c in Cells {
        parameters { rate[Cells] : real; }
        variables { X : 1..=3; Y : bool; }
        decomposition { P(X) P(Y | X) }
        forms { P(X) = uniform; P(Y | X) = bernoulli(rate[c] * X); }
        question x { P(X | Y = y) }
    }
}

#[test]
fn products_beyond_the_range_of_numbers_are_computed_again() {
    // .25 · 1 · 1 · 3 · 1 against .75 · 2 · .5 · 1 · 1, times 1e-400.
    let double = tiny::a().ask().unwrap();
    assert!([false, true].iter().all(|a| (double.p(*a) - 0.5).abs() < 1e-12), "{double:?}");
    let single = tiny::a::Question::<f32>::new().ask().unwrap();
    assert!([false, true].iter().all(|a| (single.p(*a) - 0.5).abs() < 1e-6), "{single:?}");
    let best = tiny::best().ask().unwrap();
    assert!((best.max() - 0.5).abs() < 1e-12 && best.argmax().is_some(), "{best:?}");
}

#[test]
fn a_number_that_a_form_cannot_have_is_reported_with_its_form() {
    let answer = rates::x().rate(0.25).y(true).ask().unwrap();
    // 1 : 2 : 3
    assert!([1.0, 2.0, 3.0].iter().all(|x| (answer.p(*x as i64) - x / 6.0).abs() < 1e-15), "{answer:?}");
    for rate in [-0.5, 2.0, f64::NAN, f64::INFINITY] {
        let error = rates::x().rate(rate).y(true).ask().unwrap_err();
        assert!(error.to_string().contains("rate"), "{error}");
    }
    // By default the rate is 0.5.
    let error = rates::x().y(true).ask().unwrap_err();
    assert!(matches!(&error, Error::Number { .. }), "{error}");
    let message = error.to_string();
    assert!(["P(Y | X)", "bernoulli", "X = 3", "1.5"].iter().all(|word| message.contains(word)), "{message}");
    let asked = plate::x().cells(3).y(&[1f32; 3]);
    assert!(asked.rate(&[0.1, 0.5, 0.2]).ask().is_err());
    assert_eq!(asked.rate(&[0.1, 0.0, 0.2]).ask().unwrap().report().impossible, 1);
}

#[test]
fn the_factor_that_makes_evidence_impossible_is_named() {
    let error = rates::z().rate(0.25).y(true).ask().unwrap_err();
    assert!(matches!(error, Error::Impossible(_)) && error.to_string().contains("P(Z | Y)"), "{error}");
}
