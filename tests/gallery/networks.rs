//! Networks and iterations: layers, and a boat whose answers are its next priors.
//!
//! In: `layered_network.bp`, `pseudo_kalman.bp`, `markov_localisation.bp`, `asia.bp`. Out: nothing where all is well.
//! Invariant: layers are summed over all 2¹⁶ states; the filter carries the marginals of both coordinates on, as its text
//! says.

use crate::laws::{in_bins, normal, normalised};
use crate::{answers, near, probabilities, program};
use bp_core::source::Source;
use bp_core::syntax::compile;

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
        let told = moved.unwrap_or([0, 0]);
        let expected = step(&belief, told.map(f64::from), deviation, bearings);
        let numbers: Vec<[f64; 1]> = bearings.iter().map(|b| [*b as f64]).collect();
        // A move of −5 is the first of the values.
        let moves = told.map(|by| [f64::from(by + 5)]);
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

#[test]
fn a_subroutine_is_what_it_says_and_can_be_replaced() {
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
