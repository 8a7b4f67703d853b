//! Numbers beyond the range of f64, and numbers that a form cannot have, through the macro.

use bp_core::error::Error;
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
    let mut double = tiny::a::Outputs::<f64>::default();
    tiny::a::run(&tiny::a::Inputs {}, &mut double).unwrap();
    assert!(double.p_a.iter().all(|p| (p - 0.5).abs() < 1e-12), "{double:?}");
    let mut single = tiny::a::Outputs::<f32>::default();
    tiny::a::run(&tiny::a::Inputs {}, &mut single).unwrap();
    assert!(single.p_a.iter().all(|p| (p - 0.5).abs() < 1e-6), "{single:?}");
    let mut best = tiny::best::Outputs::<f64>::default();
    tiny::best::run(&tiny::best::Inputs {}, &mut best).unwrap();
    assert!((best.max_a[0] - 0.5).abs() < 1e-12 && best.argmax_a[0].is_some(), "{best:?}");
}

#[test]
fn a_number_that_a_form_cannot_have_is_told_with_its_form() {
    let mut answer = rates::x::Outputs::<f64>::default();
    rates::x::run(&rates::x::Inputs { rate: 0.25, y: 1.0 }, &mut answer).unwrap();
    // 1 : 2 : 3
    assert!(answer.p_x.iter().zip([1.0, 2.0, 3.0]).all(|(p, q)| (p - q / 6.0).abs() < 1e-15), "{answer:?}");
    for rate in [-0.5, 2.0, f64::NAN, f64::INFINITY] {
        let told = rates::x::run(&rates::x::Inputs { rate, y: 1.0 }, &mut answer).unwrap_err();
        assert!(told.to_string().contains("rate"), "{told}");
    }
    let told = rates::x::run(&rates::x::Inputs { rate: 0.5, y: 1.0 }, &mut answer).unwrap_err();
    assert!(matches!(&told, Error::Number { .. }), "{told}");
    let told = told.to_string();
    assert!(["P(Y | X)", "bernoulli", "X = 3", "1.5"].iter().all(|word| told.contains(word)), "{told}");
    let mut plate = plate::x::Outputs::<f32>::default();
    let inputs = plate::x::Inputs { cells: 3, rate: &[0.1, 0.5, 0.2], y: &[1.0; 3] };
    assert!(plate::x::run(&inputs, &mut plate).is_err());
    let inputs = plate::x::Inputs { rate: &[0.1, 0.0, 0.2], ..inputs };
    assert_eq!(plate::x::run(&inputs, &mut plate).unwrap().impossible, 1);
}

#[test]
fn what_makes_evidence_impossible_is_named() {
    let mut answer = rates::z::Outputs::<f64>::default();
    let told = rates::z::run(&rates::z::Inputs { rate: 0.25, y: 1.0 }, &mut answer).unwrap_err();
    assert!(matches!(told, Error::Impossible(_)) && told.to_string().contains("P(Z | Y)"), "{told}");
}
