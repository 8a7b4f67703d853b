//! Learning over time, compared with counts and with a Baum–Welch written out here.
//!
//! In: programs with hidden or seen states, sequences. Out: parameters and ln L. Invariant: expected values are counted
//! by hand, or those of the equations of Rabiner (1989, section III.C) for two states, iterated until they converge.

use crate::support::{model_of, question};
use bp_core::compiler::data::read_table;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::learn::{Case, Columns, Learned, Learner};
use bp_core::compiler::model::Model;
use std::path::Path;

fn learned(model: &Model, table: &str, sequence: Option<&str>) -> Result<Learned, String> {
    let table = read_table(Path::new("data.csv"), table.as_bytes()).unwrap();
    let mut learner = Learner::new(model).map_err(|error| error.to_string())?;
    let columns = Columns { sequence: sequence.map(str::to_owned), ..Columns::default() };
    learner.observe_table(&table, &columns).map_err(|error| error.to_string())?;
    learner.learned().map_err(|error| error.to_string())
}

fn numbers(learned: &Learned, name: &str) -> Vec<f64> {
    learned.model().parameters.values().find(|parameter| parameter.name == name).unwrap().default.clone()
}

const WEATHER: &str = "program Weather { variables { X, X^-1 : { Dry, Wet }; }
    decomposition { P(X^-1) P(X | X^-1) }
    forms { P(X^-1) = previous(X) else categorical(1, 0); P(X | X^-1) = unknown(histogram); } }";

#[test]
fn observed_transitions_are_counted_along_the_sequence() {
    let model = model_of(WEATHER);
    let near = |learned: &Learned| {
        let text = learned.text();
        let tokens = text.split(|letter: char| !(letter.is_ascii_digit() || ".e-".contains(letter)));
        let found: Vec<f64> =
            tokens.filter(|token| token.starts_with('0')).filter_map(|token| token.parse().ok()).collect();
        let expected = [1.0 / 3.0, 2.0 / 3.0, 0.5, 0.5];
        assert_eq!(found.len(), 4, "{text}");
        assert!(found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-12), "{text}");
    };
    // Dry before the first: dry to dry, dry to wet, wet to wet, wet to dry, dry to wet.
    let one = learned(&model, "X\nDry\nWet\nWet\nDry\nWet\n", None).unwrap();
    near(&one);
    let expected = (1.0f64 / 3.0).ln() + 2.0 * (2.0f64 / 3.0).ln() + 2.0 * 0.5f64.ln();
    assert!((one.report.ln_likelihood - expected).abs() < 1e-12, "{}", one.report.ln_likelihood);
    // Rows with X^-1 are transitions, each by itself.
    let open = model_of(&WEATHER.replace("categorical(1, 0)", "uniform"));
    near(&learned(&open, "X^-1,X\nDry,Wet\nWet,Dry\nDry,Dry\nDry,Wet\nWet,Wet\n", None).unwrap());
    // Two sequences, their rows mixed: both begin dry.
    let table = "Who,X\nb,Dry\na,Wet\nb,Wet\na,Wet\na,Dry\n";
    let two = learned(&model, table, Some("Who")).unwrap();
    // b: dry, dry, wet; a: dry, wet, wet, dry. Dry to dry once, to wet twice; wet to wet once, to dry once.
    near(&two);
    assert_eq!(two.report.cases, 5);
    let wrong = learned(&model, "Who,X\nb,Dry\n,Wet\n", Some("Who")).unwrap_err();
    assert!(wrong.contains("row 3") && wrong.contains("sequence"), "{wrong}");
    let wrong = learned(&model, "Who,X\nb,Dry\n", Some("Whom")).unwrap_err();
    assert!(wrong.contains("`Who`"), "{wrong}");
    let still = model_of(
        "program Still { variables { X : bool; } decomposition { P(X) } forms { P(X) = unknown; } }",
    );
    let wrong = learned(&still, "Who,X\nb,true\n", Some("Who")).unwrap_err();
    assert!(wrong.contains("X^-1"), "{wrong}");
}

/// A hidden chain of two states: P(true) at the start, after each state, and of the observation in each.
#[derive(Clone, Debug)]
struct Chain {
    start: f64,
    a: [f64; 2],
    b: [f64; 2],
}

fn of(p: f64, truth: usize) -> f64 {
    if truth == 1 { p } else { 1.0 - p }
}

/// ln P of a sequence; the expected counts of the first state, transitions and emissions.
type Counts = (f64, [f64; 2], [[f64; 2]; 2], [[f64; 2]; 2]);

impl Chain {
    /// ln L, and expected counts of the first state, of transitions and of observations.
    fn expect(&self, sequence: &[Option<usize>]) -> Counts {
        let emitted = |state: usize, seen: Option<usize>| seen.map_or(1.0, |seen| of(self.b[state], seen));
        // The first is the state before the first row.
        let mut alpha = vec![[1.0 - self.start, self.start]];
        let mut ln = 0.0;
        for seen in sequence {
            let last = alpha[alpha.len() - 1];
            let next = [0, 1].map(|now| {
                (0..2).map(|before| last[before] * of(self.a[before], now)).sum::<f64>() * emitted(now, *seen)
            });
            let total = next[0] + next[1];
            ln += total.ln();
            alpha.push(next.map(|p| p / total));
        }
        let mut beta = vec![[1.0, 1.0]; alpha.len()];
        for at in (0..sequence.len()).rev() {
            let back = [0, 1].map(|before| {
                (0..2)
                    .map(|now| of(self.a[before], now) * emitted(now, sequence[at]) * beta[at + 1][now])
                    .sum::<f64>()
            });
            beta[at] = back.map(|p| p / (back[0] + back[1]));
        }
        let (mut start, mut moved, mut shown) = ([0.0; 2], [[0.0; 2]; 2], [[0.0; 2]; 2]);
        let first = [0, 1].map(|state| alpha[0][state] * beta[0][state]);
        (0..2).for_each(|state| start[state] += first[state] / (first[0] + first[1]));
        for at in 0..sequence.len() {
            let mut pair = [[0.0; 2]; 2];
            let mut total = 0.0;
            for (before, now) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                pair[before][now] = alpha[at][before]
                    * of(self.a[before], now)
                    * emitted(now, sequence[at])
                    * beta[at + 1][now];
                total += pair[before][now];
            }
            for (before, now) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                moved[before][now] += pair[before][now] / total;
                if let Some(seen) = sequence[at] {
                    shown[now][seen] += pair[before][now] / total;
                }
            }
        }
        (ln, start, moved, shown)
    }

    /// ln L at convergence of Baum–Welch.
    fn learn(&mut self, sequences: &[Vec<Option<usize>>], start: bool) -> f64 {
        let mut last = f64::NEG_INFINITY;
        loop {
            let (mut ln, mut first, mut moved, mut shown) = (0.0, [0.0; 2], [[0.0; 2]; 2], [[0.0; 2]; 2]);
            for sequence in sequences {
                let expected = self.expect(sequence);
                ln += expected.0;
                for (state, other) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    first[state] += if other == 0 { expected.1[state] } else { 0.0 };
                    moved[state][other] += expected.2[state][other];
                    shown[state][other] += expected.3[state][other];
                }
            }
            if ln - last < 1e-14 * ln.abs() {
                return ln;
            }
            last = ln;
            if start {
                self.start = first[1] / (first[0] + first[1]);
            }
            self.a = moved.map(|row| row[1] / (row[0] + row[1]));
            self.b = shown.map(|row| row[1] / (row[0] + row[1]));
        }
    }
}

/// A sequence sampled from a chain, with Knuth's linear congruential generator.
fn drawn(seed: u64, length: usize) -> Vec<Option<usize>> {
    let mut state = seed;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let mut hidden = 0;
    (0..length)
        .map(|_| {
            hidden = usize::from(unit() < [0.1, 0.85][hidden]);
            let seen = usize::from(unit() < [0.15, 0.8][hidden]);
            if unit() < 0.1 { None } else { Some(seen) }
        })
        .collect()
}

fn table(sequences: &[Vec<Option<usize>>]) -> String {
    let mut text = "Who,F\n".to_owned();
    for (number, sequence) in sequences.iter().enumerate() {
        for seen in sequence {
            let seen = seen.map_or(String::new(), |seen| seen.to_string());
            text.push_str(&format!("s{number},{seen}\n"));
        }
    }
    text
}

#[test]
fn hidden_states_are_baum_welch() {
    let sequences: Vec<Vec<Option<usize>>> = vec![drawn(1, 150), drawn(2, 40), drawn(3, 80), drawn(9, 1)];
    let begun = Chain { start: 0.5, a: [0.2, 0.7], b: [0.3, 0.6] };
    let program = |start: &str| {
        model_of(&format!(
            "program Chain {{ parameters {{ a[0..=1] : probability = [0.2, 0.7]; b[0..=1] : probability = [0.3, 0.6]; s : probability = 0.5; }}
             variables {{ S, S^-1 : bool; F : bool; }} decomposition {{ P(S^-1) P(S | S^-1) P(F | S) }}
             forms {{ P(S^-1) = previous(S) else {start}; P(S | S^-1) = bernoulli(a[S^-1]); P(F | S) = bernoulli(b[S]); }}
             identification {{ a, b{} from x; }} }}",
            if start.contains('s') { ", s" } else { "" }
        ))
    };
    for (start, is_learned) in [("bernoulli(0.5)", false), ("bernoulli(s)", true)] {
        let is_learned = is_learned && start.contains("(s)");
        let text = program(if is_learned { start } else { "uniform" });
        let mut expected = begun.clone();
        let ln = expected.learn(&sequences, is_learned);
        let found = learned(&text, &table(&sequences), Some("Who")).unwrap();
        let near = |found: &[f64], expected: &[f64]| {
            found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 2e-5)
        };
        let (a, b) = (numbers(&found, "a"), numbers(&found, "b"));
        assert!(near(&a, &expected.a) && near(&b, &expected.b), "{a:?} {b:?}, expected {expected:?}");
        assert!((found.report.ln_likelihood - ln).abs() < 1e-6, "{} {ln}", found.report.ln_likelihood);
        if is_learned {
            let s = numbers(&found, "s");
            assert!((s[0] - expected.start).abs() < 1e-3, "{s:?}, expected {expected:?}");
        }
        let course = found.report.expectation.as_ref().unwrap();
        assert!(course.trail.windows(2).all(|pair| pair[1] >= pair[0] - 1e-9), "{:?}", course.trail);
        // `filter` gives the same ln P for the learned program.
        let rows: Vec<_> = (sequences[0].iter())
            .map(|seen| seen.map(|seen| ("F".to_owned(), seen as f64)).into_iter().collect::<Vec<_>>())
            .collect();
        let asked = question(found.model(), "filter P(S | F)");
        let sampling = bp_core::compiler::sample::Sampling::default();
        let inputs = Inputs::new();
        let answers =
            bp_core::compiler::answer::ask_over_time(found.model(), &asked, &rows, &inputs, sampling)
                .unwrap();
        let chain = Chain {
            start: if is_learned { numbers(&found, "s")[0] } else { 0.5 },
            a: [a[0], a[1]],
            b: [b[0], b[1]],
        };
        let own = chain.expect(&sequences[0]).0;
        assert!((answers[0].ln_evidence.unwrap() - own).abs() < 1e-9);
    }
}

/// ln P of the rows by `filter`, whose messages are potentials and not flat arrays.
fn filtered(model: &Model, asked: &str, rows: &[Vec<(String, f64)>]) -> f64 {
    let (asked, inputs) = (question(model, asked), Inputs::new());
    let sampling = bp_core::compiler::sample::Sampling::default();
    let answers = bp_core::compiler::answer::ask_over_time(model, &asked, rows, &inputs, sampling).unwrap();
    answers[0].ln_evidence.unwrap()
}

#[test]
fn states_in_part_seen_and_hidden_causes_have_the_likelihood_of_the_filter() {
    let model = model_of(
        "program Mixed { variables { S, S^-1 : { a, b, c }; X, X^-1 : bool; K : 0..=1; Y : real; Z : { u, v, w }; }
         decomposition { P(S^-1) P(X^-1) P(S | S^-1 X^-1) P(X | X^-1 S) P(K | S) P(Y | K X) P(Z | S) }
         forms { P(S^-1) = previous(S) else unknown(dirichlet(1)); P(X^-1) = previous(X) else bernoulli(0.3);
                 P(S | S^-1 X^-1) = unknown(dirichlet(2)); P(X | X^-1 S) = unknown; P(K | S) = unknown;
                 P(Y | K X) = unknown(normal); P(Z | S) = unknown(dirichlet(1)); } }",
    );
    let mut state = 11_u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let (mut table, mut rows) = ("X,Y,Z\n".to_owned(), Vec::new());
    for _ in 0..60 {
        let (x, z) = (usize::from(unit() < 0.4), (3.0 * unit()) as usize);
        let (y, seen) = (unit() * 3.0 + 2.0 * x as f64, unit());
        let mut row = vec![("Y".to_owned(), y)];
        if seen < 0.7 {
            row.push(("X".to_owned(), x as f64));
        }
        if seen > 0.2 {
            row.push(("Z".to_owned(), z as f64));
        }
        let x = if seen < 0.7 { x.to_string() } else { String::new() };
        let z = if seen > 0.2 { ["u", "v", "w"][z] } else { "" };
        table.push_str(&format!("{x},{y},{z}\n"));
        rows.push(row);
    }
    let read = read_table(Path::new("data.csv"), table.as_bytes()).unwrap();
    let mut learner = Learner::new(&model).unwrap();
    let columns = Columns { hidden: vec!["K".to_owned()], ..Columns::default() };
    learner.observe_table(&read, &columns).unwrap();
    let settings = bp_core::compiler::learn::Settings { iterations: 60, ..Default::default() };
    let found = learner.learned_with(&settings, &mut |_, _| {}).unwrap();
    let (own, asked) = (found.report.ln_likelihood, filtered(found.model(), "filter P(S | X, Y, Z)", &rows));
    assert!((own - asked).abs() < 1e-9, "{own}, by the filter {asked}");
    let trail = &found.report.expectation.as_ref().unwrap().trail;
    assert!(trail.windows(2).all(|pair| pair[1] >= pair[0] - 1e-9), "{trail:?}");
}

#[test]
fn three_states_and_800_rows_come_to_rest_without_creeping() {
    let model = model_of(
        "program Three { variables { S, S^-1, Z : { a, b, c }; } decomposition { P(S^-1) P(S | S^-1) P(Z | S) }
         forms { P(S^-1) = previous(S) else uniform; P(S | S^-1) = unknown(histogram); P(Z | S) = unknown(histogram); } }",
    );
    let mut state = 5_u64;
    let mut draw = |chances: [f64; 3]| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let unit = (state >> 33) as f64 / (1u64 << 31) as f64;
        usize::from(unit > chances[0]) + usize::from(unit > chances[0] + chances[1])
    };
    let (mut hidden, mut table, mut rows) = (0, "Z\n".to_owned(), Vec::new());
    for _ in 0..800 {
        hidden = draw([[0.9, 0.07, 0.03], [0.1, 0.8, 0.1], [0.05, 0.15, 0.8]][hidden]);
        let seen = draw([[0.7, 0.2, 0.1], [0.2, 0.6, 0.2], [0.1, 0.2, 0.7]][hidden]);
        table.push_str(["a\n", "b\n", "c\n"][seen]);
        rows.push(vec![("Z".to_owned(), seen as f64)]);
    }
    let found = learned(&model, &table, None).unwrap();
    let course = found.report.expectation.as_ref().unwrap();
    assert!(course.converged && course.steps < 1000, "{} steps", course.steps);
    let asked = filtered(found.model(), "filter P(S | Z)", &rows);
    assert!((found.report.ln_likelihood - asked).abs() < 1e-9, "{asked}");
}

#[test]
fn the_law_of_the_start_can_be_unknown_and_is_written_back() {
    let model = model_of(
        "program Chain { variables { S, S^-1 : bool; F : bool; } decomposition { P(S^-1) P(S | S^-1) P(F | S) }
         forms { P(S^-1) = previous(S) else unknown(histogram); P(S | S^-1) = bernoulli(if S^-1 { 0.9 } else { 0.2 });
                 P(F | S) = bernoulli(if S { 1 } else { 0 }); } }",
    );
    // S is seen through F: true in three of four sequences. With P(S^-1) = p: P(true) = 0.2 + 0.7 p, at most where that is ¾.
    let found = learned(&model, "Who,F\na,true\nb,true\nc,false\nd,true\n", Some("Who")).unwrap();
    let text = found.text();
    assert!(text.contains("P(S^-1) = bernoulli(0.7857"), "{text}");
    let expected = 3.0 * 0.75f64.ln() + 0.25f64.ln();
    assert!((found.report.ln_likelihood - expected).abs() < 1e-8, "{}", found.report.ln_likelihood);
    // One by one, as a stream: one sequence.
    let mut learner = Learner::new(&model).unwrap();
    for seen in ["true", "true"] {
        learner.observe(&Case::new(&model).with_value(&model, "F", seen).unwrap()).unwrap();
    }
    let stream = learner.learned().unwrap();
    // All observations favour a start that is true: ln 0.9 twice.
    assert!(
        (stream.report.ln_likelihood - 2.0 * 0.9f64.ln()).abs() < 1e-6,
        "{}",
        stream.report.ln_likelihood
    );
    let case = Case::new(&model).with_value(&model, "F", "false").unwrap();
    let mut learner = Learner::new(&model).unwrap();
    learner.observe_sequence(&[case.clone(), case]).unwrap();
    assert!((learner.learned().unwrap().report.ln_likelihood - 2.0 * 0.8f64.ln()).abs() < 1e-6);
}

/// With a = P(true | false) and b = P(true | true) the likelihood of the rows is ½ a · ½ (1 − b) · ½ (a + b) · ½ b, which is largest at
/// a = 1 and b = 1/√3.
#[test]
fn a_missing_cell_of_the_instant_before() {
    use bp_core::prelude::*;
    let text = "program Pairs { variables { X, X^-1 : bool; } decomposition { P(X^-1) P(X | X^-1) }
        forms { P(X^-1) = previous(X) else bernoulli(0.5); P(X | X^-1) = unknown(histogram); } }";
    let rows = Learning::new()
        .column("X", ["true", "false", "true", "true"])
        .column("X^-1", ["false", "true", "", "true"]);
    let learned = Program::parse(text).unwrap().learn(rows).unwrap();
    let text = learned.text().unwrap();
    let p = learned.program().ask("P(X = true | X^-1 = true)").unwrap().number().unwrap();
    assert!((p - 1.0 / 3f64.sqrt()).abs() < 1e-5, "{text}");
    let p = learned.program().ask("P(X = true | X^-1 = false)").unwrap().number().unwrap();
    assert!((p - 1.0).abs() < 1e-5, "{text}");
}
