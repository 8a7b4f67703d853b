//! Localisation of a boat: all 101 · 101 positions, one after the other.
//!
//! In: the programs of the boat. Out: pass or fail. Invariant: a bearing is from the boat to the landmark, on the
//! integers 0..=359 without wrapping; distances are on 0..=100.

use super::laws::{entropy, largest, normal, normalised};
use super::{answers, near, probabilities, program};
use bp_core::compiler::answer::Figure;

const LANDMARKS: [[f64; 2]; 3] = [[-50.0, -50.0], [-50.0, 0.0], [0.0, -50.0]];
const BEARINGS: [usize; 3] = [225, 180, 270];

fn distance(landmark: usize, x: f64, y: f64) -> f64 {
    (x - LANDMARKS[landmark][0]).hypot(y - LANDMARKS[landmark][1])
}

fn bearing(landmark: usize, x: f64, y: f64) -> f64 {
    let [across, upwards] = LANDMARKS[landmark];
    (upwards - y).atan2(across - x).to_degrees().rem_euclid(360.0)
}

/// The likelihood of a distance.
fn far(landmark: usize, read: usize, x: f64, y: f64) -> f64 {
    let d = distance(landmark, x, y);
    normal(0, 100, d, d / 10.0 + 5.0)[read]
}

/// The likelihood of a bearing.
fn towards(landmark: usize, read: usize, deviation: f64, x: f64, y: f64) -> f64 {
    normal(0, 359, bearing(landmark, x, y), deviation)[read]
}

/// P(X Y | …) by [X][Y], from the likelihood at each position.
fn places(likelihood: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let places = (-50..=50).flat_map(|x| (-50..=50).map(move |y| (f64::from(x), f64::from(y))));
    normalised(places.map(|(x, y)| likelihood(x, y)).collect())
}

fn fused(distances: [Option<usize>; 3], bearings: [Option<usize>; 3]) -> Vec<f64> {
    places(|x, y| {
        let far = (0..3).filter_map(|one| Some(far(one, distances[one]?, x, y)));
        let towards = (0..3).filter_map(|one| Some(towards(one, bearings[one]?, 10.0, x, y)));
        far.chain(towards).product()
    })
}

fn entropies(file: &str, question: &str, given: &[(&str, &[f64])]) -> Vec<f64> {
    let answers = answers(&program(file), question, given).unwrap();
    let number = |figure| match figure {
        Figure::Entropy { entropy, .. } => entropy,
        other => panic!("{other:?} is no entropy"),
    };
    answers.iter().map(|answer| number(answer.answer[0].figure)).collect()
}

const CENTRE: usize = 50 * 101 + 50;

#[test]
fn bearings_and_distances_are_fused() {
    let model = program("boat");
    let seen = BEARINGS.map(Some);
    let all = [Some(71), Some(50), Some(50)];
    let expected = [
        ("bearings", fused([None; 3], seen)),
        ("all", fused(all, seen)),
        ("two_distances", fused([None, Some(50), Some(50)], [None; 3])),
        ("wrong_distance", fused([Some(71), Some(50), Some(90)], seen)),
        ("outlier", fused(all, [Some(225), Some(180), Some(320)])),
    ];
    for (asked, expected) in &expected {
        near(&probabilities(&model, asked, &[]), expected, 1e-10);
    }
    let [bearings, all, two, ..] = expected.map(|(_, expected)| expected);
    assert_eq!((largest(&bearings), largest(&all)), (CENTRE, CENTRE));
    assert!(entropy(&all) < entropy(&bearings), "six readings say more than three");
    // Two distances leave two positions: the true one, and the first landmark; none between them.
    let at = |x: usize, y: usize| two[x * 101 + y];
    assert!(at(0, 0) > 10.0 * at(25, 25) && at(50, 50) > 10.0 * at(25, 25));
    near(&entropies("boat", "uncertainty", &[]), &[entropy(&bearings), entropy(&two)], 1e-11);
    let place = answers(&model, "place", &[]).unwrap().remove(0).answer;
    let named: Vec<_> = place[0].values.iter().map(|(_, value)| value.as_str()).collect();
    assert_eq!((place.len(), named), (1, vec!["0", "0"]));
}

#[test]
fn farther_bearings_are_less_sure() {
    let model = program("boat_relaxed");
    let deviation = |d: usize| (20.0 - 500.0 / (10.0 + d as f64)).max(5.0);
    let expected = places(|x, y| {
        (0..3)
            .zip([71, 50, 50])
            .map(|(one, d)| far(one, d, x, y) * towards(one, BEARINGS[one], deviation(d), x, y))
            .product()
    });
    near(&probabilities(&model, "all", &[]), &expected, 1e-10);
    let along = (-50..=50).map(f64::from).map(|x| {
        let one = |one: usize| -> f64 {
            let d = distance(one, x, 0.0);
            let far = normal(0, 100, d, d / 10.0 + 5.0);
            (0..=100).map(|d| far[d] * towards(one, BEARINGS[one], deviation(d), x, 0.0)).sum()
        };
        (0..3).map(one).product()
    });
    near(&probabilities(&model, "along", &[]), &normalised(along.collect()), 1e-10);
}

#[test]
fn a_clue_about_the_view_changes_how_sure_the_place_is() {
    let model = program("boat_soft");
    let with = |clear: f64| {
        let of = |deviation: f64, x, y| -> f64 {
            (0..3).map(|one| towards(one, BEARINGS[one], deviation, x, y)).product()
        };
        places(|x, y| clear * of(10.0, x, y) + (1.0 - clear) * of(30.0, x, y))
    };
    let mut found = Vec::new();
    for clear in [1.0, 0.5, 0.1, 0.0] {
        let expected = with(clear);
        near(&probabilities(&model, "place", &[("clear", &[clear])]), &expected, 1e-10);
        assert_eq!(largest(&expected), CENTRE);
        found.push(entropies("boat_soft", "uncertainty", &[("clear", &[clear])])[0]);
        near(&[*found.last().unwrap()], &[entropy(&expected)], 1e-11);
    }
    // Jeffrey's rule: the probabilities of the view, unclear or clear, weigh the two answers.
    let expected: Vec<f64> = with(0.0).iter().zip(with(1.0)).map(|(p, q)| 0.9 * p + 0.1 * q).collect();
    near(&probabilities(&model, "clue", &[]), &expected, 1e-10);
    assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "the less clear, the less sure: {found:?}");
}

#[test]
fn a_sensor_that_may_be_faulty_informs_less() {
    let model = program("fault_tree");
    let of = |one: usize, fault: f64, x, y| {
        let d = distance(one, x, y);
        fault / 101.0 + (1.0 - fault) * normal(0, 100, d, d / 10.0 + 1.0)[50]
    };
    let expected = places(|x, y| of(1, 0.02, x, y) * of(2, 0.0298, x, y));
    near(&probabilities(&model, "place", &[]), &expected, 1e-10);
    let mut faults = [0.0; 4];
    for (place, weight) in faults.iter_mut().enumerate() {
        let all = (-50..=50).flat_map(|x| (-50..=50).map(move |y| (f64::from(x), f64::from(y))));
        let one = |landmark: usize, faulty: bool, fault: f64, x, y| match faulty {
            true => fault / 101.0,
            false => of(landmark, fault, x, y) - fault / 101.0,
        };
        let sum = all.map(|(x, y)| one(1, place / 2 == 1, 0.02, x, y) * one(2, place % 2 == 1, 0.0298, x, y));
        *weight = sum.sum();
    }
    near(&probabilities(&model, "faulty", &[]), &normalised(faults.to_vec()), 1e-10);
}

#[test]
fn two_ways_to_know_the_place_are_stitched() {
    let model = program("stitching");
    let weight = |x: f64, y: f64| {
        let near = (0..3)
            .zip([99, 73, 73])
            .map(|(one, d)| if x >= 0.0 && y >= 0.0 { far(one, d, x, y) } else { 1.0 / 101.0 });
        let seen = (0..3)
            .zip([225, 200, 250])
            .map(|(one, b)| if x <= 0.0 && y <= 0.0 { towards(one, b, 10.0, x, y) } else { 1.0 / 360.0 });
        near.chain(seen).product()
    };
    let expected = places(weight);
    near(&probabilities(&model, "place", &[]), &expected, 1e-10);
    let mut sides = [0.0; 4];
    for (place, p) in expected.iter().enumerate() {
        let (x, y) = (place / 101, place % 101);
        sides[2 * usize::from(x >= 50 && y >= 50) + usize::from(x <= 50 && y <= 50)] += p;
    }
    near(&probabilities(&model, "side", &[]), &sides, 1e-10);
}

#[test]
fn coarse_bearings_predict_danger() {
    // NE, SE, NW, SW.
    let quadrant = |one: usize, x: f64, y: f64| {
        let [across, upwards] = LANDMARKS[one];
        2 * usize::from(across - x <= 0.0) + usize::from(upwards - y <= 0.0)
    };
    let probability = |seen: usize, truth: usize| [0.5, 0.2, 0.1][(seen ^ truth).count_ones() as usize];
    let mut expected = Vec::new();
    for place in 0..64 {
        let seen = [place / 16, place / 4 % 4, place % 4];
        let mut weights = [0.0; 2];
        for (x, y) in (-49..=50).flat_map(|x| (-49..=50).map(move |y| (f64::from(x), f64::from(y)))) {
            let p: f64 = (0..3).map(|one| probability(seen[one], quadrant(one, x, y))).product();
            let danger = (30.0 / (1.0 + distance(0, x, y))).min(1.0);
            weights[0] += p * (1.0 - danger);
            weights[1] += p * danger;
        }
        expected.extend(normalised(weights.to_vec()));
    }
    near(&probabilities(&program("classification"), "dangers", &[]), &expected, 1e-11);
}
