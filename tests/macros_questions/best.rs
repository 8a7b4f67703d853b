//! `argmax` and `max`: the answer is the value, as a value of its domain, with its probability.

use bp_core::answer::ask;
use bp_core::exec::Inputs;
use bp_macros::bayesian_program;

bayesian_program! {
    program Best {
        variables { X : 5..=7; L : { Low, High }; B : bins[0, 2, 10]; E : bool; }
        decomposition { P(X) P(L | X) P(B | X) P(E | X L) }
        forms {
            P(X) = table { 0.25, 0.25, 0.5; };
            P(L | X) = table { 5: 0.9, 0.1; 6: 0.5, 0.5; 7: 0.4, 0.6; };
            P(B | X) = table { 5: 1, 0; 6: 0.5, 0.5; 7: 0.2, 0.8; };
            P(E | X L) = bernoulli(if X == 6 { 0 } else { 1 });
        }
        question value { argmax P(X) }
        question largest { max P(X) }
        question pair { argmax P(X L) }
        question bin { argmax P(B | X = x) }
        question tie { argmax P(L | X = 6) }
        question near { argmax P(L | X = 6) nearest heading }
        question rows { argmax P(L | X E) }
        question both { P(X | L = High); max P(X | L = High); argmax P(X | L = High) }
    }
}

bayesian_program! {
    program Voices over c in Cells {
        parameters { loud[Cells] : probability; }
        variables { S : { None, Left, Right }; H : bool; }
        decomposition { P(S) P(H | S) }
        forms {
            P(S) = categorical(0.5, 0.25, 0.25);
            P(H | S) = bernoulli(if S == None { 0 } else if S == Left { loud[c] } else { 0.5 });
        }
        question who { argmax P(S | H = h) }
    }
}

/// A question that needs nothing given, answered.
macro_rules! answered {
    ($question:ident) => {{
        let mut answer = best::$question::Outputs::<f64>::default();
        best::$question::run(&best::$question::Inputs {}, &mut answer).unwrap();
        answer
    }};
}

#[test]
fn the_answer_is_a_value_of_the_domain_with_its_probability() {
    let value = answered!(value);
    assert_eq!((value.argmax_x, value.max_x), (vec![Some(7.0)], vec![0.5]));
    let largest = answered!(largest);
    assert_eq!((largest.argmax_x, largest.max_x), (vec![Some(7.0)], vec![0.5]));
    // (7, High) has .5 · .6, more than (5, Low) with .25 · .9.
    let pair = answered!(pair);
    assert_eq!((pair.argmax_x, pair.argmax_l), (vec![Some(7.0)], vec![Some(1.0)]));
    assert!((pair.max_x_l[0] - 0.3).abs() < 1e-15);
    // A bin is its centre: 6 is between 2 and 10.
    for (x, centre, p) in [(5.0, 1.0, 1.0), (7.0, 6.0, 0.8)] {
        let mut bin = best::bin::Outputs::<f64>::default();
        best::bin::run(&best::bin::Inputs { x }, &mut bin).unwrap();
        assert_eq!((bin.argmax_b, bin.max_b), (vec![Some(centre)], vec![p]));
    }
    // High: .025, .125, .3 of .45.
    let both = answered!(both);
    assert!(both.p_x.iter().zip([1.0 / 18.0, 5.0 / 18.0, 12.0 / 18.0]).all(|(p, q)| (p - q).abs() < 1e-15));
    assert_eq!((both.argmax_x, both.argmax_x_2), (vec![Some(7.0)], vec![Some(7.0)]));
    assert_eq!((both.max_x[0], both.max_x_2[0]), (both.p_x[2], both.p_x[2]));
}

#[test]
fn of_equals_the_first_or_the_nearest_is_taken_as_by_the_text() {
    let tie = answered!(tie);
    assert_eq!((tie.argmax_l, tie.max_l), (vec![Some(0.0)], vec![0.5]));
    for (heading, nearest) in [([0.0, 1.0], 0.0), ([1.0, 0.0], 1.0), ([2.0, 2.0], 0.0)] {
        let mut near = best::near::Outputs::<f64>::default();
        best::near::run(&best::near::Inputs { heading: &heading }, &mut near).unwrap();
        assert_eq!(near.argmax_l, [Some(nearest)]);
        let model = best::model();
        let text = ask(&model, model.question("near").unwrap(), &Inputs::new().array("heading", &heading));
        assert_eq!(text.unwrap()[0].answer[0].values[0].1, ["Low", "High"][nearest as usize]);
    }
    let wrong = best::near::run(
        &best::near::Inputs { heading: &[1.0; 3] },
        &mut Default::default() as &mut best::near::Outputs<f64>,
    );
    assert!(wrong.unwrap_err().to_string().contains("heading"));
}

#[test]
fn each_context_has_its_own_answer_and_the_impossible_has_none() {
    // By [X][E]: E is true for 5 and 7, and false for 6, for sure.
    let mut rows = best::rows::Outputs::<f32>::default();
    let report = best::rows::run(&best::rows::Inputs {}, &mut rows).unwrap();
    assert_eq!(report.impossible, 3);
    assert_eq!(rows.argmax_l, [None, Some(0.0), Some(0.0), None, None, Some(1.0)]);
    assert_eq!(rows.max_l, [0.0, 0.9, 0.5, 0.0, 0.0, 0.6]);
}

#[test]
fn each_element_of_a_plate_has_its_own_answer() {
    // H true: left .25 · loud against right .25 · .5; H false: none .5 against them.
    let mut who = voices::who::Outputs::<f64>::default();
    let inputs = voices::who::Inputs { cells: 4, loud: &[1.0, 0.0, 0.5, 1.0], h: &[1.0, 1.0, 1.0, 0.0] };
    assert_eq!(voices::who::run(&inputs, &mut who).unwrap().impossible, 0);
    assert_eq!(who.argmax_s, [Some(1.0), Some(2.0), Some(1.0), Some(0.0)]);
    let expected = [2.0 / 3.0, 1.0, 0.5, 0.8];
    assert!(who.max_s.iter().zip(expected).all(|(p, q)| (p - q).abs() < 1e-15), "{:?}", who.max_s);
}
