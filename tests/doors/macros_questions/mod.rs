//! The macro's questions: numbers given at run time are values, names are any that the checker accepts, and a question
//! without an answer is an error.
//!
//! In: programs written here. Out: answers counted by hand. Invariant: a number that is not a value of the domain is an
//! error that names the input, the number and the domain; the code around a program may deny warnings or have no
//! prelude.
#![deny(warnings)]

use bp_core::compiler::answer::{ask, compile};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::exec::compiled::Report;
use bp_core::compiler::model::Model;
use bp_macros::bayesian_program;

use dice::Far;
use lamps::Lamp;

mod best;
mod names;
mod numbers;

bayesian_program! {
    program Dice {
        variables { First, Second : 1..=6; Sum : 2..=12; Far : { Near } or 5..=10; }
        decomposition { P(First) P(Second) P(Sum | First Second) P(Far | First) }
        forms {
            P(First) = uniform;
            P(Second) = uniform;
            P(Sum | First Second) = dirac(First + Second);
            P(Far | First) = dirac(First + 4);
        }
        question first { P(First | Sum = s) }
        question at { P(First = f | Sum = s) }
        question far { P(First | Far = d) }
        question whole { P(First | Sum) }
    }
}

bayesian_program! {
    program Lamps {
        parameters { w : real = 2; }
        variables { Fault : bool; Lamp : { Off, Dim, Bright }; Angle : circle(0, 360, 4); Volt : bins[0, 1, 10]; X : real; }
        decomposition { P(Fault) P(Lamp | Fault) P(Angle | Fault) P(Volt | Fault) P(X | Fault) }
        forms {
            P(Fault) = bernoulli(0.25);
            P(Lamp | Fault) = table { false: 0.1, 0.2, 0.7; true: 0.6, 0.3, 0.1; };
            P(Angle | Fault) = table { false: 0.1, 0.2, 0.3, 0.4; true: 0.4, 0.3, 0.2, 0.1; };
            P(Volt | Fault) = table { false: 0.8, 0.2; true: 0.5, 0.5; };
            P(X | Fault) = if Fault { uniform(0, 4) } else { uniform(0, 1) };
        }
        question lamp { P(Fault | Lamp = lamp) }
        question angle { P(Fault | Angle = angle) }
        question volt { P(Fault | Volt = volt) }
        question x { P(Fault | X = x) }
        question fault { P(Lamp | Fault = fault) }
    }
}

bayesian_program! {
    program Scale {
        parameters { w : real = 2; }
        variables { X : bool; }
        decomposition { P(X) }
        forms { P(X) = bernoulli(1 / w); }
        question half { P(X) }
    }
}

bayesian_program! {
    program Family over c in Cells {
        parameters { N : size; }
        variables { A : bool; Z[i in 1..=N] : 3..=5; }
        decomposition { P(A) prod(i) { P(Z[i] | A) } }
        forms { P(A) = uniform; P(Z[i] | A) = table { false: 0.5, 0.5, 0; true: 0, 0.25, 0.75; }; }
        question a { P(A | Z = z) }
    }
}

/// A question's answer, or its error message.
macro_rules! asked {
    ($question:expr) => {{ $question.ask().map(|answer| answer.distribution().to_vec()).map_err(|error| error.to_string()) }};
}

fn near(found: Result<Vec<f64>, String>, expected: &[f64]) {
    let found = found.unwrap();
    assert_eq!(found.len(), expected.len(), "{found:?}");
    assert!(found.iter().zip(expected).all(|(p, q)| (p - q).abs() < 1e-15), "{found:?}, not {expected:?}");
}

/// The same question, interpreted from the text, with one number given.
fn of_text(model: &Model, question: &str, name: &str, number: f64) -> Result<Vec<f64>, String> {
    let answers = ask(model, model.question(question).unwrap(), &Inputs::new().number(name, number));
    let answers = answers.map_err(|error| error.to_string())?;
    Ok(answers[0].answer.iter().map(|row| row.p().unwrap()).collect())
}

#[test]
fn a_value_is_a_value_through_every_door() {
    // Sum 9 is 3+6, 4+5, 5+4, 6+3; 12 is 6+6 alone.
    let nine = [0.0, 0.0, 0.25, 0.25, 0.25, 0.25];
    near(asked!(dice::first().s(9)), &nine);
    near(of_text(&dice::model(), "first", "s", 9.0), &nine);
    near(asked!(dice::first().s(12)), &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    near(asked!(dice::at().f(4).s(9)), &[0.25]);
    // In `{ Near } or 5..=10`, 5 and more are themselves, and Near is the number below.
    near(asked!(dice::far().d(6)), &[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    near(of_text(&dice::model(), "far", "d", 6.0), &[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    // P(Fault | Dim): 0.75 · 0.2 against 0.25 · 0.3.
    near(asked!(lamps::lamp().lamp(Lamp::Dim)), &[2.0 / 3.0, 1.0 / 3.0]);
    near(asked!(lamps::fault().fault(true)), &[0.6, 0.3, 0.1]);
    // 100° is in the second quarter, −10° and 350° in the last: .75 · .4 against .25 · .1.
    near(asked!(lamps::angle().angle(100.0)), &[2.0 / 3.0, 1.0 / 3.0]);
    for angle in [-10.0, 350.0, 710.0] {
        near(asked!(lamps::angle().angle(angle)), &[12.0 / 13.0, 1.0 / 13.0]);
        near(of_text(&lamps::model(), "angle", "angle", angle), &[12.0 / 13.0, 1.0 / 13.0]);
    }
    // 1 V is in the second bin: .75 · .2 against .25 · .5.
    for volt in [1.0, 3.0, 10.0] {
        near(asked!(lamps::volt().volt(volt)), &[6.0 / 11.0, 5.0 / 11.0]);
        near(of_text(&lamps::model(), "volt", "volt", volt), &[6.0 / 11.0, 5.0 / 11.0]);
    }
    near(asked!(lamps::x().x(0.5)), &[12.0 / 13.0, 1.0 / 13.0]);
}

#[test]
fn an_answer_is_read_by_value_and_values_outside_the_domain_have_probability_0() {
    // P(First = 4 | Sum = 9) = ¼; the table is indexed by the searched value, then by the known one.
    let answer = dice::first().s(9).ask().unwrap();
    assert_eq!([answer.p(4), answer.p(2), answer.p(7), answer.p(i64::MIN)], [0.25, 0.0, 0.0, 0.0]);
    let whole = dice::whole().ask().unwrap();
    assert_eq!((whole.p(4, 9), whole.p(1, 2), whole.p(1, 13)), (0.25, 1.0, 0.0));
    let lamp = lamps::fault().fault(false).ask().unwrap();
    assert_eq!([Lamp::Off, Lamp::Dim, Lamp::Bright].map(|value| lamp.p(value)), [0.1, 0.2, 0.7]);
    assert_eq!(dice::at().f(4).s(9).ask().unwrap().p(), 0.25);
    // `2` is half of a default that is not given.
    assert_eq!(scale::half().ask().unwrap().p(true), 0.5);
    assert_eq!(scale::half().w(4.0).ask().unwrap().p(true), 0.25);
}

#[test]
fn missing_inputs_without_a_default_are_named() {
    let message = dice::first().ask().unwrap_err().to_string();
    assert!(
        message.contains("`s`") && message.contains("was not given") && message.contains(".s(…)"),
        "{message}"
    );
}

#[test]
fn values_outside_the_domain_are_refused_with_the_domain() {
    let refuses = |found: Result<Vec<f64>, String>, number: f64, words: &[&str]| {
        let message = found.unwrap_err();
        let number = if number.abs() > 1e21 { format!("{number:e}") } else { number.to_string() };
        let number = format!("{number} is not a value of");
        assert!(words.iter().chain([&number.as_str()]).all(|word| message.contains(word)), "{message}");
    };
    for s in [-1, 1, 13, i64::MAX] {
        refuses(asked!(dice::first().s(s)), s as f64, &["`s`", "`Sum`", "2..=12"]);
    }
    for s in [-1.0, 1.0, 13.0, 3.5, f64::NAN, 1e30, f64::INFINITY] {
        refuses(of_text(&dice::model(), "first", "s", s), s, &["`s`", "`Sum`", "2..=12"]);
    }
    for f in [0, 7] {
        refuses(asked!(dice::at().f(f).s(9)), f as f64, &["`f`", "`First`", "1..=6"]);
    }
    refuses(asked!(dice::far().d(11)), 11.0, &["`d`", "`Far`", "5..=10"]);
    refuses(asked!(lamps::volt().volt(11.0)), 11.0, &["`volt`", "bins[0, 1, 10]"]);
    for angle in [f64::NAN, f64::INFINITY] {
        refuses(asked!(lamps::angle().angle(angle)), angle, &["`angle`", "circle"]);
        refuses(asked!(lamps::x().x(angle)), angle, &["`x`", "real"]);
    }
}

#[test]
fn impossible_evidence_is_an_error_where_there_is_no_plate() {
    // X above 4 is impossible; so is Far if Near.
    let error = lamps::x().x(5.0).ask().unwrap_err();
    assert!(matches!(&error, Error::Impossible(why) if why.question == "P(Fault | X = x)"), "{error}");
    assert!(dice::far().d(Far::Near).ask().is_err());
    // The whole table has no impossible context; zero probabilities within a context do not count.
    let mut table = dice::whole::Answer::<f32>::default();
    assert_eq!(dice::whole::Question::new().run_into(&mut table).unwrap(), Report { impossible: 0 });
    assert_eq!(table.distribution().len(), 66);
}

#[test]
fn over_a_plate_values_are_values_and_the_impossible_is_counted() {
    // By [i][c]: 3 is impossible with A, 5 without, so that 3 and 5 together are impossible.
    let z = [3.0, 4.0, 5.0, 3.0, 4.0, 5.0, 5.0, 5.0];
    let run = |z: &[f64]| family::a().n(2).cells(4).z(z).ask().map_err(|error| error.to_string());
    let answer = run(&z).unwrap();
    assert_eq!(answer.report(), Report { impossible: 1 });
    // Cells: (3, 4), (4, 5), (5, 5), (3, 5).
    near(Ok(answer.p(false).to_vec()), &[1.0, 0.0, 0.0, 0.0]);
    near(Ok(answer.p(true).to_vec()), &[0.0, 1.0, 1.0, 0.0]);
    // Two cells of 4: .25 : .0625.
    let answer = run(&[4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0]).unwrap();
    assert_eq!((answer.report().impossible, answer.p(false)[0]), (0, 0.8));
    for (place, wrong) in [(0, 2.0), (5, 6.0), (7, 3.5), (2, f64::NAN)] {
        let mut z = z;
        z[place] = wrong;
        let message = run(&z).unwrap_err();
        let words = [format!("`z[{place}]`"), format!("{wrong} is not"), "3..=5".to_owned()];
        assert!(words.iter().all(|word| message.contains(word.as_str())), "{message}");
    }
    // By lanes, the same.
    let model = family::model();
    let compiled = compile(&model, model.question("a").unwrap()).unwrap();
    let inputs = Inputs::new().size("N", 2).number("N", 2.0).size("Cells", 4).array("z", &z);
    let found: Vec<f64> =
        compiled.ask(&inputs).unwrap()[0].answer.iter().map(|row| row.p().unwrap()).collect();
    assert_eq!(found.iter().filter(|p| **p == 1.0).count(), 3, "{found:?}");
}

bayesian_program! {
    program Unrelated {
        variables { Delta : 0..=2; Zeta : { Near } or 5..=6; }
        decomposition { P(Delta) P(Zeta) }
        forms { P(Delta) = weights(1 + Delta); P(Zeta) = uniform; }
        question open { P(Delta | Zeta = z) }
    }
}

#[test]
fn a_value_on_which_the_answer_does_not_depend_is_taken_and_checked() {
    for z in [unrelated::Zeta::Near, unrelated::Zeta::Number(6)] {
        assert!((unrelated::open().z(z).ask().unwrap().p(2) - 0.5).abs() < 1e-15);
    }
    let error = unrelated::open().z(9).ask().unwrap_err().to_string();
    assert!(error.contains("`z`: 9 is not a value of `Zeta`"), "{error}");
    assert!(unrelated::open().ask().unwrap_err().to_string().contains("`z`"));
}
