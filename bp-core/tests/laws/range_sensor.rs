//! The range sensor: the chain scan against the 2^(N−1) hidden states, and published reference posteriors.
//!
//! In: the program of `tests/programs/line_of_sight.bp` and variants of its priors. Out: P(Z | O C) by kernels.
//! Invariant: brute force adds the elementary model over every state of the hidden cells; it shares with the plan only
//! the program's text.

use crate::support::{model_of, program};
use bp_core::compiler::exec::{Inputs, Outputs, interpret};
use bp_core::compiler::ids::ValueId;
use bp_core::compiler::kernel::{Node, Reduce};
use bp_core::compiler::lower::{Lowered, lower};
use bp_core::compiler::model::Model;
use bp_core::compiler::operators::Unary;
use bp_core::compiler::plan::{Options, Rewrites, Route, plan};

/// Φ((x − m) / s)
fn below(x: f64, mean: f64, deviation: f64) -> f64 {
    0.5 * libm::erfc((mean - x) / (deviation * std::f64::consts::SQRT_2))
}

/// P_k(z), with z = 0 for "no detection"; k = n + 1 where no cell is occupied.
fn elementary(n: usize, sigma: f64, k: usize, z: usize) -> f64 {
    if k > n {
        return if z == 0 { 1.0 } else { 0.0 };
    }
    let mean = k as f64 - 0.5;
    match z {
        0 => 1.0 - below(n as f64, mean, sigma),
        1 => below(1.0, mean, sigma),
        _ => below(z as f64, mean, sigma) - below(z as f64 - 1.0, mean, sigma),
    }
}

/// Σ over the states of the hidden cells; `prior(j, o, c)` is P(G[j] | O C).
fn brute(
    n: usize,
    sigma: f64,
    c: usize,
    o: usize,
    z: usize,
    prior: &dyn Fn(usize, usize, usize) -> f64,
) -> f64 {
    let hidden: Vec<usize> = (1..=n).filter(|j| *j != c).collect();
    let mut sum = 0.0;
    for state in 0..1usize << hidden.len() {
        let (mut p, mut first) = (1.0, if o == 1 { c } else { n + 1 });
        for (bit, j) in hidden.iter().enumerate() {
            let occupied = state >> bit & 1 == 1;
            p *= if occupied { prior(*j, o, c) } else { 1.0 - prior(*j, o, c) };
            if occupied {
                first = first.min(*j);
            }
        }
        sum += p * elementary(n, sigma, first, z);
    }
    sum
}

fn lowered(model: &Model, rewrites: Rewrites) -> Lowered {
    let question = model.question("reading").unwrap();
    let plan = plan(model, question, Options { rewrites, ..Options::default() }).unwrap();
    let Route::Exact(exact) = &plan.routes[0] else { panic!("the sensor is discrete") };
    lower(model, exact, "reading").unwrap()
}

/// \[o\]\[c\]\[z\] of one ray, whatever the order of the axes.
fn reading(model: &Model, rewrites: Rewrites, inputs: &Inputs<'_, f64>, n: usize) -> Vec<Vec<Vec<f64>>> {
    let lowered = lowered(model, rewrites);
    let outputs: Outputs<f64> = interpret(&lowered.kernel, inputs).unwrap();
    let names: Vec<String> = lowered.outputs[0].variables.iter().map(|id| model.variable_name(*id)).collect();
    assert_eq!(names, ["O", "C", "Z"]);
    let cells = outputs.get(lowered.outputs[0].key);
    assert_eq!(cells.len(), 2 * n * (n + 1));
    let at = |o: usize, c: usize, z: usize| cells[(o * n + c - 1) * (n + 1) + z];
    (0..2).map(|o| (1..=n).map(|c| (0..=n).map(|z| at(o, c, z)).collect()).collect()).collect()
}

fn inputs(n: usize, sigma: f64) -> Inputs<'static, f64> {
    Inputs::new().size("N", n).size("Rays", 1).number("sigma_min", 1.0).number("sigma", sigma)
}

fn compare(
    model: &Model,
    inputs: &Inputs<'_, f64>,
    n: usize,
    sigma: f64,
    prior: &dyn Fn(usize, usize, usize) -> f64,
) {
    let found = reading(model, Rewrites::default(), inputs, n);
    for (o, c, z) in (0..2).flat_map(|o| (1..=n).flat_map(move |c| (0..=n).map(move |z| (o, c, z)))) {
        let expected = brute(n, sigma, c, o, z, prior);
        let p = found[o][c - 1][z];
        assert!(
            (p - expected).abs() <= 1e-12,
            "N = {n}, O = {o}, C = {c}, Z = {z}: {p}, expected {expected}"
        );
    }
    for row in found.iter().flatten() {
        assert!((row.iter().sum::<f64>() - 1.0).abs() <= 1e-12, "a row sums to one");
    }
}

#[test]
fn the_scan_equals_the_sum_over_all_hidden_states() {
    let model = model_of(&program("line_of_sight"));
    for n in 1..=12 {
        compare(&model, &inputs(n, 0.6), n, 0.6, &|_, _, _| 0.5);
    }
}

/// The program with another prior for the hidden cells.
fn with_prior(form: &str) -> Model {
    let text =
        program("line_of_sight").replace("P(G[j] | O C) = uniform", &format!("P(G[j] | O C) = {form}"));
    model_of(&text.replace("sigma_min : real;", "sigma_min : real; p[1..=N] : probability;"))
}

#[test]
fn hidden_cells_may_have_any_prior_0_and_1_among_them() {
    let model = with_prior("bernoulli(p[j])");
    let priors = [0.2, 0.0, 0.7, 1.0, 0.35, 0.0, 1.0, 0.6, 0.5, 0.9];
    for n in [1, 2, 4, 7, 10] {
        let inputs = inputs(n, 0.8).array("p", &priors[..n]);
        compare(&model, &inputs, n, 0.8, &|j, _, _| priors[j - 1]);
    }
    for certain in [[0.0; 5], [1.0; 5]] {
        compare(&model, &inputs(5, 0.3).array("p", &certain), 5, 0.3, &|j, _, _| certain[j - 1]);
    }
}

#[test]
fn hidden_cells_may_depend_on_known_variables() {
    let model = with_prior("bernoulli(if O { 0.1 * p[j] } else { p[C] })");
    let priors = [0.2, 0.0, 0.7, 1.0, 0.35, 0.4];
    let prior = |j: usize, o: usize, c: usize| if o == 1 { 0.1 * priors[j - 1] } else { priors[c - 1] };
    compare(&model, &inputs(6, 0.5).array("p", &priors), 6, 0.5, &prior);
}

#[test]
fn enumeration_and_scan_agree_and_rules_change_nothing() {
    let text = program("line_of_sight").replace("1..=N", "1..=8").replace("N : size; ", "");
    let model = model_of(&text);
    let inputs = inputs(8, 0.6);
    let all = Rewrites::default();
    let scanned = reading(&model, all, &inputs, 8);
    let left_out = [
        Rewrites { scan: false, ..all },
        Rewrites { barren: false, ..all },
        Rewrites { cancel: false, ..all },
        Rewrites { order: false, ..all },
        Rewrites { scan: false, order: false, cancel: false, ..all },
    ];
    for rewrites in left_out {
        let other = reading(&model, rewrites, &inputs, 8);
        for (p, q) in scanned.iter().flatten().flatten().zip(other.iter().flatten().flatten()) {
            assert!((p - q).abs() <= 1e-12, "{rewrites:?}: {p} and {q}");
        }
    }
}

/// P(O = 1 | z) per cell for a prior of ½.
fn posterior(sigma: f64, z: usize) -> Vec<f64> {
    let model = model_of(&program("line_of_sight"));
    let table = reading(&model, Rewrites::default(), &inputs(10, sigma), 10);
    (0..10).map(|c| table[1][c][z] / (table[0][c][z] + table[1][c][z])).collect()
}

#[track_caller]
fn printed(found: &[f64], expected: &[f64]) {
    for (cell, (p, q)) in found.iter().zip(expected).enumerate() {
        assert!((p - q).abs() <= 0.5e-4, "cell {}: {p}, printed as {q}", cell + 1);
    }
}

#[test]
fn posteriors_are_those_of_the_reference() {
    printed(&posterior(0.6, 3), &[0.0223, 0.3639, 0.7229, 0.5434, 0.5007, 0.5]);
    printed(&posterior(0.6, 6), &[0.0, 0.0, 0.0001, 0.0223, 0.3639, 0.7229, 0.5434, 0.5007, 0.5, 0.5]);
    let nothing = posterior(0.6, 0);
    printed(&nothing[..1], &[0.0]);
    printed(&nothing[7..], &[0.0001, 0.0102, 0.1717]);
    printed(&posterior(0.3, 3), &[0.0, 0.0934, 0.93, 0.5117, 0.5]);
}

#[test]
fn closed_forms_with_weights_that_halve() {
    // P(z | O_c = 1) = Σ_{k<c} 2^−k P_k + 2^−(c−1) P_c; for O_c = 0 the farther cells replace P_c.
    let (n, sigma) = (20, 0.6);
    let model = model_of(&program("line_of_sight"));
    let table = reading(&model, Rewrites::default(), &inputs(n, sigma), n);
    let half = |power: usize| 0.5f64.powi(power as i32);
    for (c, z) in (1..=n).flat_map(|c| (0..=n).map(move |z| (c, z))) {
        let nearer: f64 = (1..c).map(|k| half(k) * elementary(n, sigma, k, z)).sum();
        let beyond: f64 = (c + 1..=n).map(|k| half(k - 1) * elementary(n, sigma, k, z)).sum();
        let none = half(n - 1) * elementary(n, sigma, n + 1, z);
        assert!((table[1][c - 1][z] - nearer - half(c - 1) * elementary(n, sigma, c, z)).abs() <= 1e-12);
        assert!((table[0][c - 1][z] - nearer - beyond - none).abs() <= 1e-12);
    }
}

/// The number of evaluations of all nests for one ray of n cells.
fn iterations(lowered: &Lowered, n: usize) -> usize {
    let kernel = &lowered.kernel;
    let extent = |axis: &bp_core::compiler::ids::AxisId| {
        let extent = &kernel.axes[*axis].extent;
        let size = match extent.size.map(|key| kernel.size(key).name.as_str()) {
            Some("N") => n as i64,
            Some(_) => 1,
            None => 0,
        };
        (size + extent.offset) as usize
    };
    let of = |nest: &bp_core::compiler::kernel::Nest| {
        let folded: &[_] = if let Reduce::Fold(_, axes) = &nest.reduce { axes } else { &[] };
        kernel.buffers[nest.out].axes.iter().chain(folded).map(extent).product::<usize>()
    };
    kernel.nests.iter().map(of).sum()
}

#[test]
fn one_reading_costs_a_number_of_steps_that_grows_like_n() {
    // At one z: for each cell c and both states, so O(N) answers in O(N) steps.
    let text = program("line_of_sight").replace("P(Z | O C)", "P(Z = z | O C)");
    let model = model_of(&text);
    let lowered = lowered(&model, Rewrites::default());
    let steps = |n| iterations(&lowered, n);
    assert!(steps(200) <= 2 * steps(100) && steps(100) < 40 * 100, "{} and {}", steps(100), steps(200));
}

#[test]
fn one_reading_takes_one_cumulative_for_each_edge() {
    // Neighbours share their edges, and if no cell is hit "no detection" is certain, which needs no evaluation.
    let text = program("line_of_sight").replace("P(Z | O C)", "P(Z = z | O C)");
    let kernel = lowered(&model_of(&text), Rewrites::default()).kernel;
    let mut used: Vec<ValueId> = kernel.nests.iter().map(|nest| nest.value).collect();
    let mut at = 0;
    while let Some(value) = used.get(at).copied() {
        let operands = kernel.operands(value).into_iter();
        let more: Vec<ValueId> = operands.filter(|operand| !used.contains(operand)).collect();
        used.extend(more);
        at += 1;
    }
    let cumulative =
        |value: &&ValueId| matches!(kernel.nodes[**value], Node::Unary(Unary::NormalCumulative, _));
    let found: std::collections::BTreeSet<&ValueId> = used.iter().filter(cumulative).collect();
    assert_eq!(found.len(), 1);
}
