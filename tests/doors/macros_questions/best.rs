//! `argmax` and `max`: the answer is a value of its domain, with its probability.

use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
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

use best::L;
use voices::S;

#[test]
fn the_answer_is_a_value_of_the_domain_with_its_probability() {
    let value = best::value().ask().unwrap();
    assert_eq!((value.argmax(), value.max()), (Some(7), 0.5));
    let largest = best::largest().ask().unwrap();
    assert_eq!((largest.argmax(), largest.max()), (Some(7), 0.5));
    // (7, High) has .5 · .6, more than (5, Low) with .25 · .9.
    let pair = best::pair().ask().unwrap();
    assert_eq!(pair.argmax(), Some((7, L::High)));
    assert!((pair.max() - 0.3).abs() < 1e-15);
    // A bin is its centre: 6 is between 2 and 10.
    for (x, centre, p) in [(5, 1.0, 1.0), (7, 6.0, 0.8)] {
        let bin = best::bin().x(x).ask().unwrap();
        assert_eq!((bin.argmax(), bin.max()), (Some(centre), p));
    }
    // High: .025, .125, .3 of .45.
    let both = best::both().ask().unwrap();
    let expected = [(5, 1.0 / 18.0), (6, 5.0 / 18.0), (7, 12.0 / 18.0)];
    assert!(expected.iter().all(|(x, p)| (both.p(*x) - p).abs() < 1e-15));
    assert_eq!((both.argmax_x(), both.argmax_x_2()), (Some(7), Some(7)));
    assert_eq!((both.max_x(), both.max_x_2()), (both.p(7), both.p(7)));
}

#[test]
fn of_equals_the_first_or_the_nearest_is_taken_as_by_the_text() {
    let tie = best::tie().ask().unwrap();
    assert_eq!((tie.argmax(), tie.max()), (Some(L::Low), 0.5));
    for (heading, nearest) in [([0.0, 1.0], L::Low), ([1.0, 0.0], L::High), ([2.0, 2.0], L::Low)] {
        let near = best::near().heading(&heading).ask().unwrap();
        assert_eq!(near.argmax(), Some(nearest));
        let model = best::model();
        let text = ask(&model, model.question("near").unwrap(), &Inputs::new().array("heading", &heading));
        assert_eq!(text.unwrap()[0].answer[0].values[0].1, format!("{nearest:?}"));
    }
    let wrong = best::near().heading(&[1.0; 3]).ask();
    assert!(wrong.unwrap_err().to_string().contains("heading"));
}

#[test]
fn each_context_has_its_own_answer_and_the_impossible_has_none() {
    // E is true for 5 and 7, and false for 6, with certainty.
    let mut rows = best::rows::Answer::<f32>::default();
    let report = best::rows::Question::new().run_into(&mut rows).unwrap();
    assert_eq!(report.impossible, 3);
    let expected = [(5, true, L::Low, 0.9), (6, false, L::Low, 0.5), (7, true, L::High, 0.6)];
    for (x, e, l, p) in expected {
        assert_eq!((rows.argmax(x, e), rows.max(x, e)), (Some(l), p));
        assert_eq!((rows.argmax(x, !e), rows.max(x, !e)), (None, 0.0));
    }
    assert_eq!(rows.argmax(8, true), None);
}

#[test]
fn each_element_of_a_plate_has_its_own_answer() {
    // H true: left .25 · loud against right .25 · .5; H false: none .5 against them.
    let loud = [1f64, 0.0, 0.5, 1.0];
    let who = voices::who().cells(4).loud(&loud).h(&[1.0, 1.0, 1.0, 0.0]).ask().unwrap();
    assert_eq!(who.report().impossible, 0);
    assert_eq!(
        [0, 1, 2, 3, 4].map(|cell| who.argmax(cell)),
        [Some(S::Left), Some(S::Right), Some(S::Left), Some(S::None), None]
    );
    let expected = [2.0 / 3.0, 1.0, 0.5, 0.8];
    assert!((0..4).all(|cell| (who.max(cell) - expected[cell]).abs() < 1e-15), "{who:?}");
}
