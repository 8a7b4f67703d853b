//! Networks and iterations: layers, and a boat whose answers are its next priors.
//!
//! In: `layered_network.bp`, `pseudo_kalman.bp`, `markov_localisation.bp`, `asia.bp`. Out: pass or fail. Invariant:
//! layers are summed over all 2¹⁶ states; the filter carries the marginals of both coordinates, as in its text.

use super::laws::{in_bins, normal, normalised};
use super::{answers, near, probabilities, program};
use bp_core::compiler::answer::ask_over_time;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::sample::Sampling;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse_question};

/// The probability of a state of sixteen bits, layer by layer, the first four the causes.
fn layered(state: usize) -> f64 {
    let on = |layer: usize, node: usize| state >> (4 * layer + node % 4) & 1 == 1;
    let mut p = 1.0;
    for (layer, node) in (0..4).flat_map(|layer| (0..4).map(move |node| (layer, node))) {
        let likely = layer > 0 && (on(layer - 1, node) || on(layer - 1, node + 1));
        p *= if on(layer, node) == likely { 0.9 } else { 0.1 };
    }
    p
}

#[test]
fn layers_are_summed() {
    let model = program("layered_network");
    for evidence in 0..16 {
        let given = |name: char| (1..=4).map(move |node| format!("{name}{node}"));
        let values: Vec<[f64; 1]> = (0..4).map(|node| [(evidence >> node & 1) as f64]).collect();
        let (causes, effects): (Vec<_>, Vec<_>) = (given('a').collect(), given('d').collect());
        let (mut effect, mut cause) = ([0.0; 2], [0.0; 2]);
        for state in 0..1 << 16 {
            if state & 15 == evidence {
                effect[state >> 12 & 1] += layered(state);
            }
            if state >> 12 == evidence {
                cause[state & 1] += layered(state);
            }
        }
        for (asked, names, weights) in [("effect", &causes, effect), ("cause", &effects, cause)] {
            let given: Vec<(&str, &[f64])> =
                names.iter().zip(&values).map(|(name, value)| (name.as_str(), value.as_slice())).collect();
            near(&probabilities(&model, asked, &given), &normalised(weights.to_vec()), 1e-12);
        }
    }
}

fn seen(bearings: [usize; 3], x: f64, y: f64) -> f64 {
    let landmarks = [[-50.0, -50.0], [-50.0, 0.0], [0.0, -50.0]];
    let one = |([across, upwards], read): ([f64; 2], usize)| {
        let bearing: f64 = (upwards - y).atan2(across - x).to_degrees();
        normal(0, 359, bearing.rem_euclid(360.0), 10.0)[read]
    };
    landmarks.into_iter().zip(bearings).map(one).product()
}

/// The marginals of X and Y after one step, from those before it.
fn step(before: &[Vec<f64>; 2], [dx, dy]: [f64; 2], deviation: f64, bearings: [usize; 3]) -> [Vec<f64>; 2] {
    let count = before[0].len();
    let centre = |bin: usize| -50.0 + 100.0 * (bin as f64 + 0.5) / count as f64;
    let predicted = |prior: &[f64], by: f64| {
        let mut sum = vec![0.0; count];
        for (bin, p) in prior.iter().enumerate() {
            let law = in_bins([-50.0, 50.0], count, centre(bin) + by, deviation);
            sum.iter_mut().zip(law).for_each(|(sum, q)| *sum += p * q);
        }
        sum
    };
    let (x, y) = (predicted(&before[0], dx), predicted(&before[1], dy));
    let mut after = [vec![0.0; count], vec![0.0; count]];
    for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
        let p = x[i] * y[j] * seen(bearings, centre(i), centre(j));
        after[0][i] += p;
        after[1][j] += p;
    }
    after.map(normalised)
}

fn follows(file: &str, bins: usize, moved: Option<[i32; 2]>, deviation: f64) {
    let model = program(file);
    let mut belief = [vec![1.0 / bins as f64; bins], vec![1.0 / bins as f64; bins]];
    for bearings in [[225, 180, 270], [222, 184, 265], [220, 188, 262]] {
        let command = moved.unwrap_or([0, 0]);
        let expected = step(&belief, command.map(f64::from), deviation, bearings);
        let numbers: Vec<[f64; 1]> = bearings.iter().map(|b| [*b as f64]).collect();
        let moves = command.map(|by| [f64::from(by)]);
        let mut given: Vec<(&str, &[f64])> = vec![
            ("previous X", &belief[0]),
            ("previous Y", &belief[1]),
            ("b1", &numbers[0]),
            ("b2", &numbers[1]),
            ("b3", &numbers[2]),
        ];
        if moved.is_some() {
            given.extend([("mx", moves[0].as_slice()), ("my", moves[1].as_slice())]);
        }
        let found = answers(&model, "place", &given).unwrap();
        for (answer, expected) in found.iter().zip(&expected) {
            let found: Vec<f64> = answer.answer.iter().map(|row| row.p().unwrap()).collect();
            near(&found, expected, 1e-8);
        }
        belief = expected;
    }
}

#[test]
fn a_drifting_boat_is_followed() {
    follows("pseudo_kalman", 20, None, 5.0);
}

#[test]
fn a_steered_boat_is_followed() {
    follows("markov_localisation", 30, Some([3, -2]), 2.0);
}

/// Bearings at each instant.
type Bearings = [[Option<usize>; 3]];

/// The boat asked over time: the joint law of both coordinates is carried, and bearings are evidence.
fn is_filtered(file: &str, bins: usize, moves: &[[i32; 2]], deviation: f64, bearings: &Bearings) {
    let model = program(file);
    let centre = |bin: usize| -50.0 + 100.0 * (bin as f64 + 0.5) / bins as f64;
    let law = |by: i32| -> Vec<Vec<f64>> {
        let from = |bin: usize| in_bins([-50.0, 50.0], bins, centre(bin) + f64::from(by), deviation);
        (0..bins).map(from).collect()
    };
    let landmarks = [[-50.0, -50.0], [-50.0, 0.0], [0.0, -50.0]];
    let mut belief = vec![vec![1.0 / (bins * bins) as f64; bins]; bins];
    let mut ln = 0.0;
    for (instant, seen) in bearings.iter().enumerate() {
        let [dx, dy] = moves.get(instant).copied().unwrap_or([0, 0]);
        let (across, upwards) = (law(dx), law(dy));
        let mut moved = vec![vec![0.0; bins]; bins];
        for (i, j, to) in
            (0..bins).flat_map(|i| (0..bins).flat_map(move |j| (0..bins).map(move |to| (i, j, to))))
        {
            moved[to][j] += belief[i][j] * across[i][to];
        }
        let mut next = vec![vec![0.0; bins]; bins];
        for (i, j, to) in
            (0..bins).flat_map(|i| (0..bins).flat_map(move |j| (0..bins).map(move |to| (i, j, to))))
        {
            next[i][to] += moved[i][j] * upwards[j][to];
        }
        for (i, j) in (0..bins).flat_map(|i| (0..bins).map(move |j| (i, j))) {
            for (landmark, read) in landmarks.iter().zip(seen) {
                let bearing = (landmark[1] - centre(j)).atan2(landmark[0] - centre(i)).to_degrees();
                next[i][j] *= read.map_or(1.0, |read| normal(0, 359, bearing.rem_euclid(360.0), 10.0)[read]);
            }
        }
        let total: f64 = next.iter().flatten().sum();
        // Each move is one of eleven.
        ln += total.ln() - if moves.is_empty() { 0.0 } else { 2.0 * 11.0f64.ln() };
        belief = next.into_iter().map(|row| row.into_iter().map(|p| p / total).collect()).collect();
    }
    let rows: Vec<Vec<(String, f64)>> = (bearings.iter().enumerate())
        .map(|(instant, seen)| {
            let read = ["B1", "B2", "B3"].into_iter().zip(seen);
            let mut row: Vec<(String, f64)> =
                read.filter_map(|(name, read)| Some((name.to_owned(), (*read)? as f64))).collect();
            if let Some([dx, dy]) = moves.get(instant) {
                row.extend([("Mx".to_owned(), f64::from(*dx)), ("My".to_owned(), f64::from(*dy))]);
            }
            row
        })
        .collect();
    let moved = if moves.is_empty() { "" } else { "Mx My " };
    let source = Source::new("question", format!("filter P(X Y | {moved}B1 B2 B3)"));
    let question = parse_question(&source, &model).unwrap();
    let answers = ask_over_time(&model, &question, &rows, &Inputs::new(), Sampling::default()).unwrap();
    let found: Vec<f64> = answers[0].answer.iter().map(|row| row.p().unwrap()).collect();
    near(&found, &belief.concat(), 1e-10);
    assert!((answers[0].ln_evidence.unwrap() - ln).abs() < 1e-8, "{:?} {ln}", answers[0].ln_evidence);
}

#[test]
fn the_boats_are_filtered_over_time() {
    let bearings = [
        [Some(228), Some(178), Some(270)],
        [Some(222), None, Some(261)],
        [None; 3],
        [Some(218), Some(189), None],
    ];
    is_filtered("pseudo_kalman", 20, &[], 5.0, &bearings);
    is_filtered("markov_localisation", 30, &[[3, 2], [4, 1], [0, -2], [-5, 5]], 2.0, &bearings);
}

#[test]
fn a_subroutine_equals_its_table_and_can_be_replaced() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/sprinkler.bp");
    let text = std::fs::read_to_string(path).unwrap();
    let with = |paris: &str, nice: &str| {
        let text = text.replace("ask(Paris.rain)", paris).replace("ask(Nice.rain)", nice);
        let model = compile(&Source::new("sprinkler", text)).unwrap();
        ["rain", "wet", "where"].map(|asked| probabilities(&model, asked, &[])).concat()
    };
    let without = with("bernoulli(0.3)", "bernoulli(0.1)");
    near(&with("ask(Paris.rain)", "ask(Nice.rain)"), &without, 1e-15);
    // Another Paris: .5 / (.5 + .5 · .9).
    near(&with("bernoulli(0.5)", "ask(Nice.rain)")[1..2], &[0.5 / 0.95], 1e-14);
}

#[test]
fn shortness_of_breath_after_a_visit_to_asia() {
    // Over all 2⁸ states, the diseases as bits: tuberculosis, cancer, bronchitis; and smoking.
    let mut weights = [[0.0; 2]; 2];
    for state in 0..16usize {
        let on = |bit: usize| state >> bit & 1 == 1;
        let of = |truth: bool, p: f64| if truth { p } else { 1.0 - p };
        let either = on(0) || on(1);
        let breath = [[0.1, 0.8], [0.7, 0.9]][usize::from(either)][usize::from(on(2))];
        let p = 0.5
            * of(on(0), 0.05)
            * of(on(1), if on(3) { 0.1 } else { 0.01 })
            * of(on(2), if on(3) { 0.6 } else { 0.3 })
            * breath;
        weights[0][usize::from(on(0))] += p;
        weights[1][usize::from(on(1))] += p;
    }
    let found = answers(&program("asia"), "after", &[]).unwrap();
    for (answer, weights) in found.iter().zip(weights) {
        let found: Vec<f64> = answer.answer.iter().map(|row| row.p().unwrap()).collect();
        near(&found, &normalised(weights.to_vec()), 1e-12);
    }
}
