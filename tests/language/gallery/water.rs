//! Water treatment: the table of one unit and the questions to the centre, against sums over all hidden variables.
//!
//! In: `water_unit.bp`, `water_centre.bp`. Out: pass or fail. Invariant: an output outside 0..=10 has probability 0,
//! and the rest is renormalised; an impossible context has a row of zeros.

use super::{answers, near, probabilities, program};
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse_question};

type Row = [f64; 11];

/// The output of a unit.
fn output([i0, i1, f, c, h]: [i32; 5]) -> i32 {
    let alpha = (i0 + i1 + f + c - h).div_euclid(3);
    let optimum = (i0 + i1 + 10).div_euclid(3);
    if alpha < 0 {
        0
    } else if alpha <= optimum {
        alpha
    } else {
        2 * optimum - alpha
    }
}

/// P(O | I0 I1 S C) for some values of F: all that agree with the sensor, or one.
fn unit(i0: i32, i1: i32, c: i32, filters: impl Iterator<Item = i32>) -> Row {
    let mut row = [0.0; 11];
    for f in filters {
        for h in 0..=10 {
            if let Some(cell) = row.get_mut(output([i0, i1, f, c, h]) as usize) {
                *cell += 1.0;
            }
        }
    }
    let total: f64 = row.iter().sum();
    row.map(|count| if total > 0.0 { count / total } else { 0.0 })
}

fn seen(i0: i32, s: i32) -> impl Iterator<Item = i32> {
    (0..=10).filter(move |f| (i0 + f).div_euclid(2) == s)
}

#[test]
fn the_table_of_the_unit_has_161_051_numbers() {
    let model = program("water_unit");
    let found = answers(&model, "output", &[]).unwrap().remove(0).answer;
    assert_eq!(found.len(), 161_051);
    let (mut rows, mut impossible) = (found.iter(), 0);
    for (i0, i1) in (0..=10).flat_map(|i0| (0..=10).map(move |i1| (i0, i1))) {
        for (s, c) in (0..=10).flat_map(|s| (0..=10).map(move |c| (s, c))) {
            let expected = unit(i0, i1, c, seen(i0, s));
            impossible += usize::from(expected.iter().all(|p| *p == 0.0));
            for (o, p) in expected.iter().enumerate() {
                let row = rows.next().unwrap();
                // Left fastest, then the known variables in the order of the question.
                let values: Vec<i32> = row.values.iter().map(|(_, value)| value.parse().unwrap()).collect();
                assert_eq!(values, [i0, i1, s, c, o as i32]);
                assert!((row.p().unwrap() - p).abs() < 1e-14, "{values:?}: {row:?}, expected {p}");
            }
        }
    }
    assert_eq!(impossible, 6655);
}

const FLOWS: &str = "I0 = 2, I1 = 8, I3 = 10, S0 = 5, S1 = 5, S3 = 9";

/// P(O2 S2 F2 | C0 C1 C2) by [O2], summed over the wanted values of F2. O2 depends on the third unit's sensor, and on
/// its filter only through it.
fn third(controls: [i32; 3], sensed: i32, wanted: impl Fn(i32) -> bool) -> Row {
    let mut row = [0.0; 11];
    let (first, second) = (unit(2, 8, controls[0], seen(2, 5)), unit(2, 8, controls[1], seen(2, 5)));
    for (o0, p) in (0..).zip(first) {
        for (o1, q) in (0..).zip(second).filter(|(_, q)| p * q > 0.0) {
            // All values of the filter that the sensor allows are equally probable a priori.
            let filters = seen(o0, sensed).filter(|f| wanted(*f)).count() as f64 / 11.0;
            let one = unit(o0, o1, controls[2], seen(o0, sensed));
            row.iter_mut().zip(one).for_each(|(sum, r)| *sum += p * q * filters * r);
        }
    }
    row
}

/// P(O3 = o | O2) by [o].
fn fourth(second: &Row, control: i32) -> Row {
    let mut row = [0.0; 11];
    for (o2, p) in (0..).zip(second) {
        let one = unit(10, o2, control, seen(10, 9));
        row.iter_mut().zip(one).for_each(|(sum, q)| *sum += p * q);
    }
    row
}

fn normalised(row: &[f64]) -> Vec<f64> {
    let total: f64 = row.iter().sum();
    row.iter().map(|p| p / total).collect()
}

#[test]
fn the_centre_predicts() {
    let expected = fourth(&third([5, 5, 5], 7, |_| true), 5);
    near(&probabilities(&program("water_centre"), "prediction", &[]), &normalised(&expected), 1e-12);
}

#[test]
fn the_centre_is_controlled() {
    let model = program("water_centre");
    let (mut nine, mut good) = (Vec::new(), Vec::new());
    for place in 0..11 * 11 * 11 {
        let second = third([place / 121, place / 11 % 11, place % 11], 7, |_| true);
        for control in 0..=10 {
            let last = fourth(&second, control);
            nine.push(last[9]);
            good.push(last[5..].iter().sum());
        }
    }
    for (asked, wanted, scores) in [("control", "O3 = 9", nine), ("constraint", "Good = true", good)] {
        let expected = normalised(&scores);
        let asked_all = format!("P(C0 C1 C2 C3 | {FLOWS}, S2 = 7, {wanted})");
        near(&probabilities(&model, &asked_all, &[]), &expected, 1e-11);
        let best = expected.iter().copied().fold(0.0, f64::max);
        let found = answers(&model, asked, &[]).unwrap().remove(0).answer;
        assert_eq!(found.len(), expected.iter().filter(|p| **p > best * (1.0 - 1e-9)).count());
        assert!(found.iter().all(|row| (row.p().unwrap() - best).abs() < 1e-12 * best));
        if asked == "control" {
            assert_eq!(found.len(), 196);
            assert!((best - 1.504465e-4).abs() < 5e-11, "{best}");
            let named = |row: &bp_core::compiler::answer::Row| {
                row.values.iter().map(|(_, v)| v.clone()).collect::<Vec<_>>()
            };
            assert!(found.iter().any(|row| named(row) == ["6", "6", "4", "9"]));
        }
    }
}

#[test]
fn the_centre_is_diagnosed() {
    let weights: Vec<f64> = (0..=10).map(|f| fourth(&third([5, 5, 5], 4, |one| one == f), 5)[7]).collect();
    near(&probabilities(&program("water_centre"), "diagnosis", &[]), &normalised(&weights), 1e-12);
}

/// The centre without subroutines: 23 variables of 11 values, eight of them with a Dirac.
fn written_out() -> Model {
    let text = std::fs::read_to_string(super::folder().join("water_unit.bp")).unwrap();
    let (start, end) = (text.find("let alpha").unwrap(), text.find(";\n    }").unwrap());
    let output = &text[start..end];
    let (mut decomposition, mut forms) = (String::new(), String::new());
    for (unit, (first, second)) in [("I0", "I1"), ("I0", "I1"), ("O0", "O1"), ("I3", "O2")].iter().enumerate()
    {
        let [f, c, h, s, o] = ["F", "C", "H", "S", "O"].map(|name| format!("{name}{unit}"));
        let of_unit = (output.replace("I0", "FIRST").replace("I1", second).replace("FIRST", first))
            .replace("+ F ", &format!("+ {f} "))
            .replace("+ C ", &format!("+ {c} "))
            .replace("- H)", &format!("- {h})"));
        let (sees, gives) =
            (format!("P({s} | {first} {f})"), format!("P({o} | {first} {second} {f} {c} {h})"));
        decomposition += &format!("P({f}) P({c}) P({h}) {sees} {gives} ");
        forms += &format!("P({f}) = uniform; P({c}) = uniform; P({h}) = uniform; ");
        forms += &format!("{sees} = dirac(floor(({first} + {f}) / 2)); {gives} = {of_unit};\n");
    }
    let of = |name: &str| (0..4).map(|unit| format!("{name}{unit}")).collect::<Vec<_>>().join(", ");
    let text = format!(
        "program Centre {{ variables {{ I0, I1, I3, {}, {}, {}, {}, {} : 0..=10; }}
         decomposition {{ P(I0) P(I1) P(I3) {decomposition} }}
         forms {{ P(I0) = uniform; P(I1) = uniform; P(I3) = uniform; {forms} }} }}",
        of("F"),
        of("C"),
        of("H"),
        of("S"),
        of("O"),
    );
    let source = Source::new("centre", text);
    compile(&source).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)))
}

#[test]
fn the_centre_written_out_answers_the_same_and_as_fast() {
    let (centre, written_out) = (program("water_centre"), written_out());
    // More is known about the filter here: its water flows through it, while the centre's units are known by their
    // sensors.
    for name in ["prediction", "control"] {
        let asked = centre.ask_text(&centre.question(name).unwrap().asks[0]);
        let question = parse_question(&Source::new("question", asked.as_str()), &written_out).unwrap();
        // Substituted for their variables, the Diracs would join eleven variables: 11^9 products and more.
        for route in &plan(&written_out, &question, Options::default()).unwrap().routes {
            assert!(matches!(route, Route::Exact(exact) if exact.cost < 5e6), "{name}");
        }
        near(&probabilities(&written_out, &asked, &[]), &probabilities(&centre, &asked, &[]), 1e-11);
    }
}
