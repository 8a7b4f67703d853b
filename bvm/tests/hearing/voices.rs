//! Two voices: the programs against sums by hand, and two noises that take turns in bands.
//!
//! In: made-up likelihoods; noises from two places. Out: posteriors by enumeration; both directions.

use crate::noise;
use bvm::audition::synthesis::{Waypoint, binaural};
use bvm::audition::{BinauralUnit, Calibration, Directions, Head, Listening, Origin, Parts};
use bvm::frame::Spherical;
use bvm::programs::{voice, voices};

#[test]
fn the_program_of_two_voices_sums_over_both_angles() {
    // By hand, for three angles and two units.
    let sine = [-0.5, 0.0, 0.1];
    let likely = [1.0, 0.2, 0.1, 0.05, 0.6, 1.0];
    let none = [0.3, 0.25];
    let (part, prior) = ([1.0, 0.5, 0.62, 0.74], [0.7, 0.1, 0.1, 0.1]);
    let mut weights = Vec::new();
    for at in 0..4 {
        for a in 0..3 {
            let far = |b: usize| f64::abs(sine[a] - sine[b]) >= 0.23;
            let others = (0..3).filter(|b| far(*b)).count() as f64;
            for b in 0..3 {
                let units: f64 = (0..2)
                    .map(|u| {
                        let voices = part[at] * likely[3 * u + a] + (1.0 - part[at]) * likely[3 * u + b];
                        0.2 * none[u] + 0.8 * voices
                    })
                    .product();
                let of_b = if far(b) { 1.0 / others } else { 0.0 };
                weights.push(prior[at] / 3.0 * of_b * units);
            }
        }
    }
    let total: f64 = weights.iter().sum();
    let found = voices::angles()
        .units(2)
        .angles(3)
        .sine(&sine)
        .likely(&likely)
        .none(&none)
        .part(&part)
        .heard(&[1.0, 1.0])
        .ask()
        .unwrap();
    for (p, weight) in found.distribution().iter().zip(&weights) {
        assert!((p - weight / total).abs() < 1e-14, "{p} {}", weight / total);
    }
}

#[test]
fn a_unit_belongs_to_the_voice_that_explains_it() {
    let (first, second, none) = ([0.9, 0.1], [0.2, 1.0], [0.4, 0.3]);
    let found =
        voice::unit().units(2).part(0.62).stray(0.2).first(&first).second(&second).none(&none).ask().unwrap();
    for unit in 0..2 {
        let weights = [0.8 * 0.62 * first[unit], 0.8 * 0.38 * second[unit], 0.2 * none[unit]];
        for (from, weight) in weights.iter().enumerate() {
            let p = found.p(from as i64)[unit];
            assert!((p - weight / weights.iter().sum::<f64>()).abs() < 1e-15, "{from}: {p}");
        }
    }
}

#[test]
fn two_noises_that_take_turns_are_two_sources_and_one_is_one() {
    let rate_hz = 32_000.0;
    let head = Head::Sphere(0.0875);
    let calibration = Calibration::of(&head, Origin::Sphere { radius_m: 0.0875 }).unwrap();
    let sound = noise(8, 16_000, "voices");
    // Each has every other tenth of a second.
    let turns = |odd: bool| -> Vec<f64> {
        let own = |at: usize| (at / 3200 % 2 == 1) == odd;
        sound.iter().enumerate().map(|(at, value)| if own(at) { *value } else { 0.0 }).collect()
    };
    let at = |degrees: f64| Waypoint {
        time_s: 0.0,
        place: Spherical { rho_m: 1.6, azimuth: degrees.to_radians(), elevation: 0.0 },
    };
    let [one, other] = [(false, 40.0), (true, -10.0)]
        .map(|(odd, degrees)| binaural(&head, &turns(odd), rate_hz, &[at(degrees)]));
    let alone = binaural(&head, &sound, rate_hz, &[at(40.0)]);
    let both = [0, 1].map(|ear| one[ear].iter().zip(&other[ear]).map(|(a, b)| a + b).collect::<Vec<f64>>());
    let independent = std::array::from_fn(|band| calibration.independent[band]);
    let mut listening = Listening::new(&calibration, Directions::Frontal).unwrap();
    for (ears, expected) in [(both, vec![40.0, -10.0]), (alone, vec![40.0])] {
        let mut unit = BinauralUnit::new(rate_hz, &independent);
        let mut parts = Parts::default();
        for (left, right) in ears[0].chunks(3200).zip(ears[1].chunks(3200)) {
            let mut cues = unit.silence();
            unit.add(left, right, &mut cues);
            parts.push(&cues);
        }
        let found = listening.find_voices(parts.all()).unwrap();
        let sure: Vec<f64> =
            found.sources.iter().filter(|one| one.probability > 0.5).map(|one| one.azimuth_deg).collect();
        assert_eq!(sure.len(), expected.len(), "{sure:?}");
        for azimuth in &expected {
            assert!(sure.iter().any(|found| (found - azimuth).abs() < 4.0), "{azimuth}: {sure:?}");
        }
    }
}
