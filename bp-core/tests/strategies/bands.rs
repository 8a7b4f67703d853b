//! Chains whose transition is a band and a background, against recursions over all states.
//!
//! In: programs of "near, or anywhere". Out: filtered and smoothed distributions, the most probable sequence. Invariant:
//! the expected values come from loops over all pairs of states, written here.

use super::guided::column;
use crate::support::{model_of, question};
use bp_core::compiler::answer::{Row, ask_over_time};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::sample::Sampling;

const STATES: usize = 120;

/// With probability 0.05 anywhere, otherwise one step to the right or none; the reading is near the state.
fn program(emission: &str, domain: &str) -> String {
    format!(
        "program Walk over t in Time {{ variables {{ X : 0..={}; Jump : bool; Z : {domain}; }}
         decomposition {{ P(X^-1) P(Jump) P(X | X^-1 Jump) P(Z | X) }}
         forms {{ P(X^-1) = dirac(7); P(Jump) = bernoulli(0.05);
                 P(X | X^-1 Jump) = if Jump {{ uniform }} else {{ weights(if X == X^-1 {{ 0.7 }} else {{ if X == X^-1 + 1 {{ 0.3 }} else {{ 0 }} }}) }};
                 P(Z | X) = {emission}; }} }}",
        STATES - 1
    )
}

/// T(i, j), by hand: the last state stays, its weights are 0.7 / 0.7.
fn transition(i: usize, j: usize) -> f64 {
    let near = match (i, j) {
        _ if i == STATES - 1 => f64::from(u8::from(j == i)),
        _ if j == i => 0.7,
        _ if j == i + 1 => 0.3,
        _ => 0.0,
    };
    0.05 / STATES as f64 + 0.95 * near
}

struct Expected {
    filtered: Vec<Vec<f64>>,
    smoothed: Vec<Vec<f64>>,
    path: Vec<usize>,
    ln_evidence: f64,
}

fn expected(readings: &[f64], density: impl Fn(f64, usize) -> f64) -> Expected {
    let (mut now, mut ln_evidence) = (vec![0.0; STATES], 0.0);
    now[7] = 1.0;
    let (mut filtered, mut best, mut traces) = (Vec::new(), now.clone(), Vec::new());
    for z in readings {
        let mut next = vec![0.0; STATES];
        let (mut largest, mut trace) = (vec![0.0; STATES], vec![0; STATES]);
        for j in 0..STATES {
            for i in 0..STATES {
                let p = transition(i, j) * density(*z, j);
                next[j] += now[i] * p;
                // Before the first instant the state is known.
                if best[i] * p > largest[j] {
                    (largest[j], trace[j]) = (best[i] * p, i);
                }
            }
        }
        let (total, most): (f64, f64) = (next.iter().sum(), largest.iter().copied().fold(0.0, f64::max));
        ln_evidence += total.ln();
        now = next.iter().map(|p| p / total).collect();
        best = largest.iter().map(|p| p / most).collect();
        filtered.push(now.clone());
        traces.push(trace);
    }
    let mut back = vec![1.0; STATES];
    let mut smoothed = Vec::new();
    for (alpha, z) in filtered.iter().zip(readings).rev() {
        let joint: Vec<f64> = alpha.iter().zip(&back).map(|(a, b)| a * b).collect();
        let total: f64 = joint.iter().sum();
        smoothed.push(joint.iter().map(|p| p / total).collect());
        let before: Vec<f64> = (0..STATES)
            .map(|i| (0..STATES).map(|j| transition(i, j) * density(*z, j) * back[j]).sum())
            .collect();
        let most = before.iter().copied().fold(0.0, f64::max);
        back = before.iter().map(|p| p / most).collect();
    }
    smoothed.reverse();
    let mut state = (0..STATES).max_by(|i, j| best[*i].total_cmp(&best[*j])).unwrap();
    let mut path = Vec::new();
    for trace in traces.iter().rev() {
        path.push(state);
        state = trace[state];
    }
    path.reverse();
    Expected { filtered, smoothed, path, ln_evidence }
}

fn compare(deviation: f64, readings: &[f64]) {
    let density = |z: f64, state: usize| {
        let distance = (z - state as f64) / deviation;
        (-0.5 * distance * distance).exp() / (deviation * std::f64::consts::TAU.sqrt())
    };
    let expected = expected(readings, density);
    let model = model_of(&program(&format!("normal(X, {deviation})"), "real"));
    let rows = column("Z", readings);
    let asked = |text: &str| {
        let question = question(&model, text);
        ask_over_time(&model, &question, &rows, &Inputs::new(), Sampling::default()).unwrap().remove(0)
    };
    let smoothed = asked("smooth P(X | Z)");
    let all = smoothed.answer.iter().map(|row| row.p().unwrap());
    for (found, expected) in all.zip(expected.smoothed.iter().flatten()) {
        assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
    }
    assert!((smoothed.ln_evidence.unwrap() / expected.ln_evidence - 1.0).abs() < 1e-12);
    let last = asked("filter P(X | Z)");
    let found: Vec<f64> = last.answer.iter().map(|row| row.p().unwrap()).collect();
    let filtered = expected.filtered.last().unwrap();
    assert_eq!(found.len(), STATES);
    assert!(found.iter().zip(filtered).all(|(p, q)| (p - q).abs() < 1e-12), "{found:?}");
    let path = asked("sequence P(X | Z)");
    let of = |row: &Row| row.values.iter().find(|(name, _)| name == "X").unwrap().1.parse::<usize>().unwrap();
    assert_eq!(path.answer.iter().map(of).collect::<Vec<_>>(), expected.path);
}

/// A jump from 12 to 80, and back.
const READINGS: [f64; 12] = [7.3, 8.1, 8.0, 9.6, 80.4, 81.0, 79.2, 82.5, 11.0, 13.2, 12.1, 14.0];

#[test]
fn near_or_anywhere_is_filtered_smoothed_and_decoded_as_over_all_pairs() {
    compare(30.0, &READINGS);
}

#[test]
fn the_same_where_messages_span_more_than_f64_represents() {
    compare(2.0, &READINGS);
}
