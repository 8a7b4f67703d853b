//! Robots: behaviours, their choice, and what sensors reveal about the light.
//!
//! In: the programs of the Khepera. Out: pass or fail. Invariant: speeds are a normal law on −10..=10.

use super::laws::{entropy, largest, normal, normalised};
use super::{near, probabilities, program};

fn speed(mean: f64, deviation: f64) -> Vec<f64> {
    normal(-10, 10, mean, deviation)
}

#[test]
fn the_driver_turns_as_each_behaviour_requests() {
    let mut expected = Vec::new();
    for behaviour in 0..3 {
        for (dir, prox) in
            (-10..=10).flat_map(|dir| (0..=15).map(move |prox| (f64::from(dir), f64::from(prox))))
        {
            let follow = 0.25 * (18.0 - prox) * if dir > 0.0 { dir - 10.0 } else { dir + 10.0 };
            expected.extend(speed([dir, follow, -dir][behaviour], 18.0 - prox));
        }
    }
    let model = program("khepera_driver");
    near(&probabilities(&model, "turn", &[]), &expected, 1e-12);
    let seen = [speed(8.0, 4.0)[17], speed(-2.0, 4.0)[17], speed(-8.0, 4.0)[17]];
    near(&probabilities(&model, "behaviour", &[]), &normalised(seen.to_vec()), 1e-12);
}

#[test]
fn homing_mixes_two_behaviours() {
    let model = program("homing");
    let avoid = |prox: f64| 1.0 / (1.0 + (0.25 * (9.0 - prox)).exp());
    let mut expected = Vec::new();
    for dir in (-10..=10).map(f64::from) {
        for prox in (0..=15).map(f64::from) {
            for theta in (-10..=10).map(f64::from) {
                let (away, home) = (speed(-dir, 18.0 - prox), speed(theta, 2.0));
                expected
                    .extend(away.iter().zip(home).map(|(p, q)| avoid(prox) * p + (1.0 - avoid(prox)) * q));
            }
        }
    }
    near(&probabilities(&model, "turn", &[]), &expected, 1e-12);
    let seen = [avoid(12.0) * speed(-6.0, 6.0)[4], (1.0 - avoid(12.0)) * speed(8.0, 2.0)[4]];
    near(&probabilities(&model, "behaviour", &[]), &normalised(seen.to_vec()), 1e-12);
}

#[test]
fn the_light_is_turned_to() {
    let model = program("phototaxy");
    let laws = [
        (-10.0, 1.0),
        (-8.0, 1.5),
        (-5.0, 2.0),
        (-1.0, 2.0),
        (1.0, 2.0),
        (5.0, 2.0),
        (8.0, 1.5),
        (10.0, 1.0),
    ];
    let rows = laws.map(|(mean, deviation)| speed(mean, deviation));
    near(&probabilities(&model, "turn", &[]), &rows.concat(), 1e-12);
    let seen = rows.iter().map(|row| row[15]).collect();
    near(&probabilities(&model, "seen", &[]), &normalised(seen), 1e-12);
}

#[test]
fn distances_are_called_near_or_far() {
    let model = program("categorisation");
    let (close, far) = (normal(0, 30, 6.0, 4.0), normal(0, 30, 20.0, 6.0));
    let expected: Vec<f64> =
        close.iter().zip(far).flat_map(|(p, q)| normalised(vec![0.4 * p, 0.6 * q])).collect();
    near(&probabilities(&model, "category", &[]), &expected, 1e-12);
    near(&probabilities(&model, "distance", &[]), &close, 1e-12);
}

#[test]
fn a_known_object_is_recognised_and_a_new_one_is_new() {
    let model = program("situation_recognition");
    let ways = |nlt: usize, nrt: usize, per: usize, llsl: usize| {
        let bells = [
            [(0.0, 1.0), (4.0, 1.0), (8.0, 2.0), (2.0, 1.0)],
            [(0.0, 1.0), (2.0, 1.0), (14.0, 2.0), (6.0, 1.0)],
            [(2.0, 1.5), (5.0, 1.5), (12.0, 3.0), (4.0, 1.5)],
        ];
        let read = [(15, nlt), (15, nrt), (20, per), (10, llsl)];
        let known = bells.map(|bells| {
            let each = bells
                .iter()
                .zip(read)
                .map(|((mean, deviation), (high, at))| normal(0, high, *mean, *deviation)[at]);
            each.product::<f64>()
        });
        let new = 1.0 / (16.0 * 16.0 * 21.0 * 11.0);
        normalised(known.into_iter().chain([new]).collect())
    };
    let (boxed, strange) = (ways(0, 4, 9, 2), ways(9, 11, 20, 1));
    near(&probabilities(&model, "object", &[]), &boxed, 1e-11);
    near(&probabilities(&model, "strange", &[]), &strange, 1e-11);
    assert_eq!((largest(&boxed), largest(&strange)), (0, 3));
}

#[test]
fn eight_poor_sensors_give_one_sharp_peak() {
    let model = program("light_fusion");
    let facing = [-90.0, -45.0, -10.0, 10.0, 45.0, 90.0, 170.0, -170.0];
    let reading = [500.0, 500.0, 310.0, 180.0, 20.0, 170.0, 500.0, 500.0];
    let mean = |sensor: usize, theta: f64, distance: f64| {
        let seen = (theta - facing[sensor]).to_radians().cos().max(0.0);
        500.0 * (1.0 - seen * (1.0 - distance / 40.0))
    };
    let with = |sensors: std::ops::Range<usize>| {
        let places = (0..36).flat_map(|bin| (0..=30).map(move |d| (f64::from(10 * bin - 175), f64::from(d))));
        let weight = |(theta, distance): (f64, f64)| {
            let off = sensors.clone().map(|one| ((reading[one] - mean(one, theta, distance)) / 60.0).powi(2));
            (-0.5 * off.sum::<f64>()).exp()
        };
        normalised(places.map(weight).collect())
    };
    let all = with(0..8);
    near(&probabilities(&model, "light", &[("Lm", &reading)]), &all, 1e-10);
    let alone = (0..8).map(|one| entropy(&with(one..one + 1))).fold(f64::INFINITY, f64::min);
    assert!(entropy(&all) < 0.8 * alone, "{} of {alone} nats", entropy(&all));
    // The light is at 45° to the right, near: 45 is not a centre; 35 and 55 are equally near.
    let theta = 10.0 * (largest(&all) / 31) as f64 - 175.0;
    assert!((theta - 45.0).abs() <= 10.0, "{theta}");
}

#[test]
fn a_repelling_and_an_attracting_object_are_headed_between() {
    let model = program("inverse_programming");
    let weight = |h: i32| {
        let repelled = |b: i32| 1.0 - (-f64::from(b - h).powi(2) / (2.0 * 70.0 * 70.0)).exp();
        let total: f64 = (0..360).map(repelled).sum();
        repelled(270) / total * normal(0, 359, f64::from(h), 40.0)[270]
    };
    let expected = normalised((0..360).map(weight).collect());
    near(&probabilities(&model, "belief", &[]), &expected, 1e-10);
    let heading = super::answers(&model, "heading", &[]).unwrap().remove(0).answer;
    assert_eq!((heading.len(), heading[0].values[0].1.as_str(), largest(&expected)), (1, "217", 217));
}

#[test]
fn a_code_is_coherent_with_a_bell() {
    let model = program("log_coding");
    let bell = normal(1, 255, 32.0, 30.0);
    let codes = (1..=7).map(|a| bell[(1 << a) - 1..((2 << a) - 1).min(255)].iter().sum()).collect();
    near(&probabilities(&model, "code_of_bell", &[]), &normalised(codes), 1e-12);
}
