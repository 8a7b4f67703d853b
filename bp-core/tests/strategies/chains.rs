//! Finite states over time, compared with enumeration and published figures.
//!
//! In: hidden Markov programs and observations. Out: filtered, predicted, smoothed and most likely states. Invariant:
//! expected values are those of Russell and Norvig (*Artificial Intelligence*, 3rd ed., section 15.2), of the sum over
//! every sequence of states, or counted by hand.

use crate::support::{all_near, model_of, question};
use bp_core::compiler::answer::{Answer, ask, ask_over_time};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Notation, Options, plan};
use bp_core::compiler::sample::Sampling;
use proptest::prelude::*;

/// A row for each instant; NaN where nothing was observed.
fn asked(model: &Model, text: &str, names: &[&str], rows: &[Vec<f64>]) -> Result<Answer, Error> {
    let observed = |row: &Vec<f64>| {
        let cells = names.iter().zip(row).filter(|(_, value)| !value.is_nan());
        cells.map(|(name, value)| ((*name).to_owned(), *value)).collect::<Vec<_>>()
    };
    let rows: Vec<_> = rows.iter().map(observed).collect();
    let answers = ask_over_time(model, &question(model, text), &rows, &Inputs::new(), Sampling::default());
    answers.map(|mut answers| answers.remove(0))
}

/// The probabilities, row by row.
fn figures(answer: &Answer) -> Vec<f64> {
    answer.answer.iter().map(|row| row.p().unwrap()).collect()
}

const UMBRELLA: &str = "program World over t in Time { variables { Rain, Rain^-1, Umbrella : bool; }
    decomposition { P(Rain^-1) P(Rain | Rain^-1) P(Umbrella | Rain) }
    forms { P(Rain^-1) = previous(Rain) else bernoulli(0.5); P(Rain | Rain^-1) = bernoulli(if Rain^-1 { 0.7 } else { 0.3 });
            P(Umbrella | Rain) = bernoulli(if Rain { 0.9 } else { 0.2 }); } }";

#[test]
fn the_umbrella_world_of_russell_and_norvig() {
    let model = model_of(UMBRELLA);
    let on = |text: &str, rows: &[f64]| {
        let rows: Vec<Vec<f64>> = rows.iter().map(|value| vec![*value]).collect();
        asked(&model, text, &["Umbrella"], &rows).unwrap()
    };
    all_near(&figures(&on("filter P(Rain | Umbrella)", &[1.0])), &[0.182, 0.818], 5e-4);
    all_near(&figures(&on("filter P(Rain | Umbrella)", &[1.0, 1.0])), &[0.117, 0.883], 5e-4);
    all_near(&figures(&on("smooth P(Rain | Umbrella)", &[1.0, 1.0])), &[0.117, 0.883, 0.117, 0.883], 5e-4);
    // P(u₁ u₂) = (0.9 · 0.5 + 0.2 · 0.5) · P(u₂ | u₁); 0.627 · 0.9 + 0.373 · 0.2 is the second.
    let ln = on("filter P(Rain | Umbrella)", &[1.0, 1.0]).ln_evidence.unwrap();
    let rain = 0.7 * (0.45 / 0.55) + 0.3 * (0.1 / 0.55);
    assert!((ln - (0.55f64 * (0.9 * rain + 0.2 * (1.0 - rain))).ln()).abs() < 1e-12);
    // Without umbrellas the belief returns to ½: p ↦ 0.3 + 0.4 p.
    let far = on("predict(3) P(Rain | Umbrella)", &[1.0, 1.0]);
    let two = figures(&on("filter P(Rain | Umbrella)", &[1.0, 1.0]))[1];
    all_near(&figures(&far)[1..], &[0.5 + 0.4f64.powi(3) * (two - 0.5)], 1e-12);
    // Fig. 15.5: true, true, false, true, true.
    let likely = on("sequence P(Rain | Umbrella)", &[1.0, 1.0, 0.0, 1.0, 1.0]);
    let values: Vec<&str> = likely.answer.iter().map(|row| row.values[1].1.as_str()).collect();
    assert_eq!(values, ["true", "true", "false", "true", "true"]);
    assert_eq!(likely.answer[2].values[0], ("t".to_owned(), "3".to_owned()));
    // A day without observation is a day all the same.
    let gap = on("filter P(Rain | Umbrella)", &[1.0, f64::NAN, f64::NAN]);
    all_near(&figures(&gap)[1..], &[0.5 + 0.4f64.powi(2) * (0.9 / 1.1 - 0.5)], 1e-12);
}

#[test]
fn a_hundred_thousand_instants_do_not_underflow() {
    let model = model_of(UMBRELLA);
    let rows: Vec<Vec<f64>> = (0..100_000).map(|day| vec![f64::from(u8::from(day % 3 > 0))]).collect();
    let smooth = asked(&model, "smooth P(Rain | Umbrella)", &["Umbrella"], &rows).unwrap();
    assert_eq!(smooth.answer.len(), 200_000);
    assert!(figures(&smooth).iter().all(|p| (0.0..=1.0).contains(p)));
    // ln P grows by the same for each three days, once the start is forgotten.
    let shorter = asked(&model, "filter P(Rain | Umbrella)", &["Umbrella"], &rows[..50_002]).unwrap();
    let each = (smooth.ln_evidence.unwrap() - shorter.ln_evidence.unwrap()) / 49_998.0;
    assert!((smooth.ln_evidence.unwrap() - each * 100_000.0).abs() < 3.0, "{each}");
    let likely = asked(&model, "sequence P(Rain | Umbrella)", &["Umbrella"], &rows).unwrap();
    assert_eq!(likely.answer.len(), 100_000);
}

/// A program with two carried states, one depending on the other, and observations of both and of neither.
#[derive(Debug)]
struct World {
    first: [f64; 2],
    second: [f64; 2],
    a: [f64; 2],
    b: [f64; 4],
    z: [f64; 4],
}

impl World {
    fn text(&self) -> String {
        let Self { first, second, a, b, z } = self;
        format!(
            "program Two {{ variables {{ A, A^-1, B, B^-1, H, Z : bool; Y : real; }}
             decomposition {{ P(A^-1) P(B^-1 | A^-1) P(A | A^-1) P(B | B^-1 A) P(H | A) P(Z | H B) P(Y | A) }}
             forms {{ P(A^-1) = previous(A) else bernoulli({}); P(B^-1 | A^-1) = bernoulli(if A^-1 {{ {} }} else {{ {} }});
                      P(A | A^-1) = bernoulli(if A^-1 {{ {} }} else {{ {} }});
                      P(B | B^-1 A) = bernoulli(if A {{ if B^-1 {{ {} }} else {{ {} }} }} else {{ if B^-1 {{ {} }} else {{ {} }} }});
                      P(H | A) = bernoulli(if A {{ 0.9 }} else {{ 0.4 }});
                      P(Z | H B) = bernoulli(if H {{ if B {{ {} }} else {{ {} }} }} else {{ if B {{ {} }} else {{ {} }} }});
                      P(Y | A) = normal(if A {{ 1 }} else {{ 0 }}, 0.8); }} }}",
            first[1], second[1], second[0], a[1], a[0], b[3], b[2], b[1], b[0], z[3], z[2], z[1], z[0]
        )
    }

    /// P(sequence of (A, B), observations) for every sequence, the state before the first instant summed out.
    fn joint(&self, rows: &[Vec<f64>]) -> Vec<f64> {
        let length = rows.len();
        let of = |p: f64, truth: usize| if truth == 1 { p } else { 1.0 - p };
        let likelihood = |row: &[f64], a: usize, b: usize| {
            let mut p = 1.0;
            if !row[0].is_nan() {
                let hidden = [0.4, 0.9][a];
                let z = |h: usize| of(self.z[h * 2 + b], row[0] as usize);
                p *= hidden * z(1) + (1.0 - hidden) * z(0);
            }
            if !row[1].is_nan() {
                let standard = (row[1] - a as f64) / 0.8;
                p *= (-0.5 * standard * standard).exp() / (0.8 * std::f64::consts::TAU.sqrt());
            }
            p
        };
        let step = |[a0, b0]: [usize; 2], [a, b]: [usize; 2]| of(self.a[a0], a) * of(self.b[a * 2 + b0], b);
        (0..1usize << (2 * length))
            .map(|number| {
                let state = |instant: usize| [number >> (2 * instant) & 1, number >> (2 * instant + 1) & 1];
                let mut p = 0.0;
                for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    p += of(self.first[1], a) * of(self.second[a], b) * step([a, b], state(0));
                }
                for (instant, row) in rows.iter().enumerate() {
                    let [a, b] = state(instant);
                    p *= likelihood(row, a, b);
                    if instant > 0 {
                        p *= step(state(instant - 1), [a, b]);
                    }
                }
                p
            })
            .collect()
    }
}

fn chance() -> impl Strategy<Value = f64> {
    (1..100u32).prop_map(|percent| f64::from(percent) / 100.0)
}

fn worlds() -> impl Strategy<Value = (World, Vec<Vec<f64>>)> {
    let four = || [chance(), chance(), chance(), chance()];
    let world = ([chance(), chance()], [chance(), chance()], [chance(), chance()], four(), four())
        .prop_map(|(first, second, a, b, z)| World { first, second, a, b, z });
    let cell = prop_oneof![Just(f64::NAN), Just(0.0), Just(1.0)];
    let real = prop_oneof![Just(f64::NAN), (-20..40i32).prop_map(|tenths| f64::from(tenths) / 10.0)];
    let rows = proptest::collection::vec((cell, real).prop_map(|(z, y)| vec![z, y]), 1..5);
    (world, rows)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(11), ..ProptestConfig::default() })]

    #[test]
    fn two_carried_states_are_the_sum_over_all_sequences((world, rows) in worlds()) {
        let model = model_of(&world.text());
        let joint = world.joint(&rows);
        let total: f64 = joint.iter().sum();
        let on = |text: &str| asked(&model, text, &["Z", "Y"], &rows).unwrap();
        let length = rows.len();
        // P(A B at an instant), A first.
        let at = |instant: usize| {
            let mut p = [0.0; 4];
            for (number, weight) in joint.iter().enumerate() {
                p[(number >> (2 * instant) & 1) * 2 + (number >> (2 * instant + 1) & 1)] += weight / total;
            }
            p
        };
        let filter = on("filter P(A B | Z Y)");
        all_near(&figures(&filter), &at(length - 1), 1e-10);
        prop_assert!((filter.ln_evidence.unwrap() - total.ln()).abs() < 1e-9);
        let smooth: Vec<f64> = (0..length).flat_map(at).collect();
        all_near(&figures(&on("smooth P(A B | Z Y)")), &smooth, 1e-10);
        let b: Vec<f64> = (0..length).flat_map(|instant| { let p = at(instant); [p[0] + p[2], p[1] + p[3]] }).collect();
        all_near(&figures(&on("smooth P(B | Z Y)")), &b, 1e-10);
        // H is hidden, searched and not carried: if no Z depends on it, it is P(H | A) averaged over P(A).
        if rows[length - 1][0].is_nan() {
            let p = at(length - 1);
            let h = 0.4 * (p[0] + p[1]) + 0.9 * (p[2] + p[3]);
            all_near(&figures(&on("filter P(H | Z Y)")), &[1.0 - h, h], 1e-10);
        }
        let last = at(length - 1);
        let ahead = world.a[1] * (last[2] + last[3]) + world.a[0] * (last[0] + last[1]);
        all_near(&figures(&on("predict(1) P(A | Z Y)")), &[1.0 - ahead, ahead], 1e-10);
        let likely = on("sequence P(A B | Z Y)");
        let truth = |row: usize, column: usize| usize::from(likely.answer[row].values[column].1 == "true");
        let found = (0..length).fold(0, |number, instant| number | truth(instant, 1) << (2 * instant) | truth(instant, 2) << (2 * instant + 1));
        let best = joint.iter().copied().fold(0.0, f64::max);
        prop_assert!(joint[found] >= best * (1.0 - 1e-9), "{} of {best}", joint[found]);
    }
}

#[test]
fn impossible_observations_are_reported() {
    let model = model_of(
        "program Sure { variables { X, X^-1, Z : bool; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else bernoulli(0); P(X | X^-1) = dirac(X^-1); P(Z | X) = bernoulli(if X { 1 } else { 0 }); } }",
    );
    let error = asked(&model, "filter P(X | Z)", &["Z"], &[vec![0.0], vec![1.0]]).unwrap_err().to_string();
    assert!(error.contains("instant 2") && error.contains("probability zero"), "{error}");
    assert!(error.contains("`Z = true` is impossible there") && error.contains("`P(Z | X)` is 0"), "{error}");
    let error = asked(&model, "filter P(X | Z)", &["Q"], &[vec![0.0]]).unwrap_err().to_string();
    assert!(error.contains("`Q`") && error.contains("`Z`"), "{error}");
    let error = asked(&model, "filter P(X | Z)", &["Z"], &[vec![0.0], vec![2.0]]).unwrap_err().to_string();
    assert!(error.contains("instant 2") && error.contains("2 is not"), "{error}");
    let error = asked(&model, "filter P(X | Z)", &["Z"], &[]).unwrap_err().to_string();
    assert!(error.contains("no instant"), "{error}");
    let error = ask(&model, &question(&model, "filter P(X | Z)"), &Inputs::new()).unwrap_err().to_string();
    assert!(error.contains("over time"), "{error}");
    let two = model_of(UMBRELLA);
    let error = asked(&two, "sequence P(Umbrella)", &[], &[vec![]]).unwrap_err().to_string();
    assert!(error.contains("search `Rain` too"), "{error}");
    let made = plan(&two, &question(&two, "smooth P(Rain | Umbrella)"), Options::default()).unwrap();
    let lines = made.derivation(&two, Notation::Unicode);
    assert!(lines[0].1.contains("finite"), "{lines:?}");
    let product = "P(Rain | Rain⁻¹) P(Umbrella | Rain) α(Rain⁻¹)";
    assert!(lines[0].2.contains(product), "{lines:?}");
    let [backward, both] =
        ["β(Rain⁻¹) ∝ Σ_Rain P(Rain | Rain⁻¹) P(Umbrella | Rain) β(Rain)", "α(Rain) β(Rain)"];
    assert!(lines[1].2 == backward && lines[2].2.ends_with(both), "{lines:?}");
}

#[test]
fn a_state_that_cannot_be_at_the_start_has_its_transition_all_the_same() {
    let model = model_of(
        "program H { variables { X, X^-1, Z : bool; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else bernoulli(1); P(X | X^-1) = table { false: 0.9, 0.1; true: 0.5, 0.5; };
                 P(Z | X) = bernoulli(if X { 0.8 } else { 0.3 }); } }",
    );
    // ½ · 0.3 and ½ · 0.8; then 0.9 · 0.15 + 0.5 · 0.4 = 0.335 and 0.215, seen with 0.3 and 0.8.
    let answer = asked(&model, "filter P(X | Z)", &["Z"], &[vec![1.0], vec![1.0]]).unwrap();
    all_near(&figures(&answer), &[0.1005 / 0.2725, 0.172 / 0.2725], 1e-14);
    assert!((answer.ln_evidence.unwrap() - 0.2725f64.ln()).abs() < 1e-14);
    // It begins false with certainty, and once true remains true.
    let model = model_of(
        "program S { variables { S, S^-1, Z : bool; } decomposition { P(S^-1) P(S | S^-1) P(Z | S) }
         forms { P(S^-1) = previous(S) else bernoulli(0); P(S | S^-1) = table { false: 0.5, 0.5; true: 0, 1; };
                 P(Z | S) = bernoulli(if S { 0.9 } else { 0.1 }); } }",
    );
    // 0.05, 0.45; 0.0025, 0.4275; 0.000125, 0.385875.
    let answer = asked(&model, "filter P(S | Z)", &["Z"], &[vec![1.0], vec![1.0], vec![1.0]]).unwrap();
    all_near(&figures(&answer), &[0.000125 / 0.386, 0.385875 / 0.386], 1e-14);
    assert!((answer.ln_evidence.unwrap() - 0.386f64.ln()).abs() < 1e-14);
}

#[test]
fn gestures_left_to_right_are_forward_backward_and_viterbi_over_twelve_states() {
    // Three gestures of four states; the feature of each is normal. One begins in the first state with certainty.
    let mean =
        |g: usize, s: usize| [[0.0, 1.5, 3.0, 1.0], [2.0, 0.5, -1.0, 0.0], [1.0, 2.5, 1.0, -2.0]][g][s];
    let means: Vec<String> = (0..12).map(|state| mean(state / 4, state % 4).to_string()).collect();
    let model = model_of(&format!(
        "program Gesture {{ parameters {{ m[0..=2, 0..=3] : real = [{}]; stay : probability = 0.7; }}
         variables {{ G, G^-1 : {{ Wave, Point, Bye }}; S, S^-1 : 0..=3; F : real; }}
         decomposition {{ P(G^-1) P(S^-1) P(G | G^-1) P(S | S^-1) P(F | G S) }}
         forms {{ P(G^-1) = previous(G) else uniform; P(S^-1) = previous(S) else categorical(1, 0, 0, 0);
           P(G | G^-1) = table {{ Wave: 1, 0, 0; Point: 0, 1, 0; Bye: 0, 0, 1; }};
           P(S | S^-1) = weights(if S == S^-1 {{ if S == 3 {{ 1 }} else {{ stay }} }} else if S == S^-1 + 1 {{ 1 - stay }} else {{ 0 }});
           P(F | G S) = normal(match G {{ Wave => m[0, S], Point => m[1, S], Bye => m[2, S] }}, 0.6); }} }}",
        means.join(", ")
    ));
    let seen = [0.2, -0.1, 1.1, 1.9, f64::NAN, 3.4, 2.7, 1.2, 0.8, 1.1];
    let rows: Vec<Vec<f64>> = seen.iter().map(|value| vec![*value]).collect();
    let step = |before: usize, now: usize| match (before / 4 == now / 4, before % 4, now % 4) {
        (false, ..) => 0.0,
        (_, 3, 3) => 1.0,
        (_, one, other) if one == other => 0.7,
        (_, one, other) if one + 1 == other => 0.3,
        _ => 0.0,
    };
    let emitted = |state: usize, value: f64| {
        let standard = (value - mean(state / 4, state % 4)) / 0.6;
        let density = (-0.5f64 * standard * standard).exp() / (0.6 * std::f64::consts::TAU.sqrt());
        if value.is_nan() { 1.0 } else { density }
    };
    let start = |state: usize| if state.is_multiple_of(4) { 1.0 / 3.0 } else { 0.0 };
    let mut forward: Vec<Vec<f64>> = vec![(0..12).map(start).collect()];
    let mut best: Vec<Vec<(f64, usize)>> = Vec::new();
    for (instant, value) in seen.iter().enumerate() {
        let last = &forward[instant];
        let next = |now: usize| {
            (0..12).map(|before| last[before] * step(before, now)).sum::<f64>() * emitted(now, *value)
        };
        let next: Vec<f64> = (0..12).map(next).collect();
        let way = |now: usize| match best.last() {
            None => (next[now], 0),
            Some(last) => (0..12)
                .map(|before| (last[before].0 * step(before, now) * emitted(now, *value), before))
                .fold((0.0, 0), |best, other| if other.0 > best.0 { other } else { best }),
        };
        best.push((0..12).map(way).collect());
        forward.push(next);
    }
    let mut backward = vec![vec![1.0; 12]];
    for value in seen[1..].iter().rev() {
        let after = backward.last().unwrap().clone();
        let back = |before: usize| {
            (0..12).map(|now| step(before, now) * emitted(now, *value) * after[now]).sum::<f64>()
        };
        backward.push((0..12).map(back).collect());
    }
    backward.reverse();
    let total: f64 = forward[seen.len()].iter().sum();
    let filter = asked(&model, "filter P(G | F)", &["F"], &rows).unwrap();
    let last = &forward[seen.len()];
    let gestures: Vec<f64> = (0..3).map(|g| last[4 * g..4 * g + 4].iter().sum::<f64>() / total).collect();
    all_near(&figures(&filter), &gestures, 1e-12);
    assert!((filter.ln_evidence.unwrap() - total.ln()).abs() < 1e-10);
    let smooth: Vec<f64> = (forward[1..].iter().zip(&backward))
        .flat_map(|(one, other)| one.iter().zip(other).map(|(a, b)| a * b / total).collect::<Vec<_>>())
        .collect();
    all_near(&figures(&asked(&model, "smooth P(G S | F)", &["F"], &rows).unwrap()), &smooth, 1e-12);
    let ends = best.last().unwrap().iter().enumerate();
    let mut state = ends.max_by(|one, other| one.1.0.total_cmp(&other.1.0)).unwrap().0;
    let mut path = vec![state];
    for way in best[1..].iter().rev() {
        state = way[state].1;
        path.insert(0, state);
    }
    let sequence = asked(&model, "sequence P(G S | F)", &["F"], &rows).unwrap();
    let found: Vec<usize> = (sequence.answer.iter())
        .map(|row| {
            let gesture = ["Wave", "Point", "Bye"].iter().position(|name| *name == row.values[1].1);
            gesture.unwrap() * 4 + row.values[2].1.parse::<usize>().unwrap()
        })
        .collect();
    assert_eq!(found, path);
}

#[test]
fn hundreds_of_densities_in_one_instant_are_added_as_logarithms() {
    let model = model_of(
        "program Rig { variables { S, S^-1 : bool; Y[1..=400] : real; }
         decomposition { P(S^-1) P(S | S^-1) prod(i) { P(Y[i] | S) } }
         forms { P(S^-1) = previous(S) else bernoulli(0); P(S | S^-1) = table { false: 0.9, 0.1; true: 0, 1; };
                 P(Y[i] | S) = normal(if S { 3 } else { 0 }, 1); } }",
    );
    let names: Vec<String> = (1..=400).map(|sensor| format!("Y[{sensor}]")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    // First a reading near 3, then near 0: since true stays true, either all states are false, or it became true at
    // some instant.
    let values = [2.0, 0.2, 0.1];
    let rows: Vec<Vec<f64>> = values.iter().map(|value| vec![*value; 400]).collect();
    let ln = |s: f64, y: f64| 400.0 * (-0.5 * (y - 3.0 * s).powi(2) - 0.5 * std::f64::consts::TAU.ln());
    let history = |turned: usize| {
        let of = |instant: usize| ln(f64::from(u8::from(instant >= turned)), values[instant]);
        let change = if turned < 3 { 0.1f64.ln() } else { 0.0 };
        (0..3).map(of).sum::<f64>() + turned as f64 * 0.9f64.ln() + change
    };
    let histories: Vec<f64> = (0..=3).map(history).collect();
    let most = histories.iter().copied().fold(f64::MIN, f64::max);
    let total = most + histories.iter().map(|ln| (ln - most).exp()).sum::<f64>().ln();
    let answer = asked(&model, "filter P(S | Y)", &names, &rows).unwrap();
    all_near(&figures(&answer), &[(histories[3] - total).exp(), 1.0 - (histories[3] - total).exp()], 1e-10);
    assert!((answer.ln_evidence.unwrap() / total - 1.0).abs() < 1e-12, "{:?} {total}", answer.ln_evidence);
    // It cannot become true, although the readings favour it: their likelihood in the other state is smaller by
    // e^−1800.
    let stays = model_of(
        "program Rig { variables { S, S^-1 : bool; Y[1..=400] : real; }
         decomposition { P(S^-1) P(S | S^-1) prod(i) { P(Y[i] | S) } }
         forms { P(S^-1) = previous(S) else bernoulli(0); P(S | S^-1) = dirac(S^-1);
                 P(Y[i] | S) = normal(if S { 3 } else { 0 }, 1); } }",
    );
    let answer = asked(&stays, "filter P(S | Y)", &names, &[vec![3.0; 400], vec![3.0; 400]]).unwrap();
    all_near(&figures(&answer), &[1.0, 0.0], 0.0);
    let expected = 2.0 * ln(0.0, 3.0);
    assert!((answer.ln_evidence.unwrap() / expected - 1.0).abs() < 1e-12, "{:?}", answer.ln_evidence);
    // Some elements of a family are observed, the others are not.
    let answer = asked(&model, "filter P(S | Y)", &names[..1], &[vec![2.0]]).unwrap();
    let odds = 0.9 * (-2.0f64).exp() / (0.1 * (-0.5f64).exp());
    all_near(&figures(&answer), &[odds / (1.0 + odds), 1.0 / (1.0 + odds)], 1e-13);
}
