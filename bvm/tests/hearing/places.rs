//! The posterior of the place of a sound.
//!
//! In: a calibrated sphere, sounds from known places. Out: the program's posterior, as densities multiplied by hand say;
//! directions, their mirror images behind the head, distances.

use bp_core::compiler::random::seeded;
use bvm::audition::synthesis::{Waypoint, add_noise, binaural};
use bvm::audition::{BinauralUnit, Calibration, Directions, Found, Head, Listening, Origin, Source};
use bvm::frame::Spherical;
use bvm::programs::listening;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;
use std::sync::OnceLock;

const RATE_HZ: f64 = 32_000.0;

/// Calibrated once for all tests.
fn sphere() -> &'static Calibration {
    static SPHERE: OnceLock<Calibration> = OnceLock::new();
    SPHERE
        .get_or_init(|| Calibration::of(&Head::Sphere(0.0875), Origin::Sphere { radius_m: 0.0875 }).unwrap())
}

/// Half a second of noise from a place, and noise in the ears.
fn heard(degrees: f64, rho_m: f64, snr_db: f64, directions: Directions) -> Found {
    let mut random = seeded(9, "source");
    let sound: Vec<f64> = (0..16_000).map(|_| StandardNormal.sample(&mut random)).collect();
    let place = Spherical { rho_m, azimuth: degrees.to_radians(), elevation: 0.0 };
    let mut ears = binaural(&Head::Sphere(0.0875), &sound, RATE_HZ, &[Waypoint { time_s: 0.0, place }]);
    add_noise(&mut ears, snr_db, 4);
    let independent = std::array::from_fn(|band| sphere().independent[band]);
    let cues = BinauralUnit::new(RATE_HZ, &independent).hear(&ears[0], &ears[1]).bands();
    Listening::new(sphere(), directions).unwrap().find(&cues).unwrap()
}

#[test]
fn the_program_multiplies_the_densities_of_all_bands() {
    // By hand, for two bands and three places.
    let (frequency, coherence) = ([0.5, 3.0], [0.9, 0.5]);
    let (count, level_count) = ([20.0, 8.0], [10.0, 0.0]);
    let (level_coherence, slope_count) = ([0.81, 0.0], [6.0, 0.0]);
    let (tau, l, slope) = ([0.21, -0.10], [2.0, 0.0], [-1.5, 0.0]);
    let mu_tau = [0.20, 0.21, -0.30, 0.25, 0.25, 0.24];
    let mu_l = [2.5, 7.0, -3.0, 1.0, 9.0, 5.0];
    let mu_slope = [0.5, 7.0, -3.0, 1.0, 2.0, 5.0];
    // The size of the cells, and their areas.
    let (size, area) = (1.5, [1.0, 3.0, 2.0]);
    let normal = |x: f64, mu: f64, s: f64| (-0.5 * ((x - mu) / s).powi(2)).exp() / (s * (2.0 * PI).sqrt());
    let few = |count: f64| 1.0 + 4.0 / count;
    // How well the calibration fits, and how rough the source is, are the same in both bands, and not known.
    let of_fit = |source: bool, place: usize, fit: usize| -> f64 {
        (0..2)
            .map(|k| {
                let lost: f64 = 1.0 - coherence[k];
                let stray = if source { 0.05 + 2.0 * (lost - 0.4_f64).max(0.0) } else { 1.0 };
                let cycle = 1.0 / frequency[k];
                let ears = match k {
                    0 => 0.002 * cycle * (5.2 * lost).exp(),
                    _ => f64::max(0.0012 * cycle, 0.0006) * (4.3 * lost).exp(),
                };
                let head = [0.002, 0.006, 0.02][fit] * (1.0 + 0.6 * cycle);
                let within = 0.005 * size;
                let sigma = (few(count[k]) * ears * ears + head * head + within * within).sqrt();
                let mu = mu_tau[2 * place + k];
                let peaks: f64 = [(-2.0, 0.05), (-1.0, 0.15), (0.0, 0.6), (1.0, 0.15), (2.0, 0.05)]
                    .iter()
                    .map(|(cycles, weight)| weight * normal(tau[k], mu + cycles * cycle, sigma))
                    .sum();
                let of_time = stray / 2.4 + (1.0 - stray) * peaks;
                // The second band has no level.
                let ears = 0.08 * (6.0 * lost).exp();
                let (head, within) = ([0.15, 1.0, 3.5][fit], 0.3 * size);
                let sigma = (few(10.0) * ears * ears + head * head + within * within).sqrt();
                let stray = if source { 0.05 + (lost - 0.4_f64).max(0.0) } else { 1.0 };
                let of_level = match k {
                    0 => {
                        // Noise of power n in both ears, beside r on the left and 1 on the right, leaves the squared coherence
                        // r / ((r + n) (1 + n)) = 0.81^1.5 = 0.729.
                        let r = 10f64.powf(mu_l[2 * place] / 10.0);
                        let n = 0.5 * (((1.0 + r).powi(2) + 4.0 * r * (1.0 / 0.729 - 1.0)).sqrt() - 1.0 - r);
                        assert!((r / ((r + n) * (1.0 + n)) - 0.729).abs() < 1e-12);
                        let mu = 10.0 * ((r + n) / (1.0 + n)).log10();
                        stray / 120.0 + (1.0 - stray) * normal(l[0], mu, sigma)
                    }
                    _ => 1.0 / 120.0,
                };
                of_time * of_level
            })
            .product()
    };
    let of_roughness = |source: bool, place: usize, rough: usize| -> f64 {
        let (step, fall) = ([0.5_f64, 2.0, 5.0][rough], [0.0, 0.8, 1.2][rough]);
        let ears = 0.2 * (4.0 * (1.0 - coherence[0])).exp();
        let within = 0.3 * size;
        let sigma = (few(6.0) * ears * ears + step * step + 0.25 + within * within).sqrt();
        let stray = if source { 0.05 } else { 1.0 };
        // The second band has no slope.
        (stray / 120.0 + (1.0 - stray) * normal(slope[0], mu_slope[2 * place] - fall, sigma)) / 120.0
    };
    let weigh = |source: bool, place: usize| -> f64 {
        let fits: f64 = (0..3).map(|fit| of_fit(source, place, fit)).sum();
        let roughness: f64 = (0..3).map(|rough| of_roughness(source, place, rough)).sum();
        area[place] * fits * roughness
    };
    let weights = [false, true].map(|source| [0, 1, 2].map(|place| weigh(source, place)));
    // A source has the probability 0.1.
    let weights = [weights[0].map(|weight| 0.9 * weight), weights[1].map(|weight| 0.1 * weight)];
    let total: f64 = weights.iter().flatten().sum();
    let found = listening::place()
        .places(3)
        .bands(2)
        .mu_tau(&mu_tau)
        .mu_l(&mu_l)
        .mu_slope(&mu_slope)
        .size(size)
        .area(&area)
        .frequency(&frequency)
        .coherence(&coherence)
        .count(&count)
        .level_count(&level_count)
        .level_coherence(&level_coherence)
        .slope_count(&slope_count)
        .tau(&tau)
        .l(&l)
        .slope(&slope)
        .ask()
        .unwrap();
    for source in [false, true] {
        for (place, weight) in weights[usize::from(source)].iter().enumerate() {
            let p = found.p(source, place);
            assert!((p - weight / total).abs() < 1e-12, "{source} {place}: {p} {}", weight / total);
        }
    }
}

#[test]
fn a_sound_is_where_it_came_from() {
    for (degrees, snr_db, tolerance) in
        [(0.0, 20.0, 2.0), (25.0, 20.0, 2.0), (-50.0, 10.0, 2.5), (70.0, 10.0, 6.0)]
    {
        let found = heard(degrees, 1.6, snr_db, Directions::Frontal);
        let first = &found.sources[0];
        assert!(
            !found.flat && (first.azimuth_deg - degrees).abs() < tolerance,
            "{degrees}: {}",
            first.azimuth_deg
        );
        assert!(first.probability > 0.8, "{degrees}: {}", first.probability);
    }
}

#[test]
fn a_sphere_leaves_the_cone_of_confusion() {
    // A sphere has no pinnae: all directions of one lateral angle are alike, in front, above and behind.
    let found = heard(40.0, 1.6, 20.0, Directions::All);
    let sides = |ahead: bool| {
        let on_side = |one: &&Source| (one.azimuth_deg.abs() < 90.0) == ahead;
        found.sources.iter().filter(on_side).map(|one| one.probability).sum::<f64>()
    };
    assert!(found.sources.len() > 2 && sides(true) > 0.05 && sides(false) > 0.05, "{found:?}");
    assert!(found.sources.iter().map(|one| one.probability).sum::<f64>() < 1.0 + 1e-9);
    for one in &found.sources {
        let [azimuth, elevation] = [one.azimuth_deg, one.elevation_deg].map(f64::to_radians);
        let lateral = (azimuth.sin() * elevation.cos()).asin().to_degrees();
        assert!((lateral - 40.0).abs() < 6.0, "{lateral}");
    }
}

#[test]
fn near_sources_at_the_side_have_a_distance() {
    for rho_m in [0.25, 0.4, 1.6] {
        let found = heard(70.0, rho_m, 20.0, Directions::Frontal);
        let ratio = found.sources[0].distance_m / rho_m;
        assert!((0.6..1.7).contains(&ratio), "{rho_m}: {}", found.sources[0].distance_m);
    }
}

#[test]
fn a_source_that_moves_is_followed() {
    let mut random = seeded(2, "moving");
    let sound: Vec<f64> = (0..64_000).map(|_| StandardNormal.sample(&mut random)).collect();
    let at = |time_s: f64, degrees: f64| Waypoint {
        time_s,
        place: Spherical { rho_m: 1.6, azimuth: degrees.to_radians(), elevation: 0.0 },
    };
    let ears = binaural(&Head::Sphere(0.0875), &sound, RATE_HZ, &[at(0.0, -40.0), at(2.0, 40.0)]);
    let independent = std::array::from_fn(|band| sphere().independent[band]);
    let mut unit = BinauralUnit::new(RATE_HZ, &independent);
    let mut listening = Listening::new(sphere(), Directions::Frontal).unwrap();
    for (look, expected) in [-35.0, -25.0, -15.0, -5.0, 5.0, 15.0, 25.0, 35.0].iter().enumerate() {
        let mut cues = unit.silence();
        unit.add(
            &ears[0][8000 * look..8000 * (look + 1)],
            &ears[1][8000 * look..8000 * (look + 1)],
            &mut cues,
        );
        let found = listening.find(&cues.bands()).unwrap();
        // It moves by 10 degrees during a look.
        assert!(
            (found.sources[0].azimuth_deg - expected).abs() < 6.0,
            "{look}: {}",
            found.sources[0].azimuth_deg
        );
    }
}

#[test]
fn independent_noises_are_no_source() {
    let noise = |name| -> Vec<f64> {
        let mut random = seeded(1, name);
        (0..32_000).map(|_| StandardNormal.sample(&mut random)).collect()
    };
    let independent = std::array::from_fn(|band| sphere().independent[band]);
    let cues = BinauralUnit::new(RATE_HZ, &independent).hear(&noise("left"), &noise("right")).bands();
    let found = Listening::new(sphere(), Directions::All).unwrap().find(&cues).unwrap();
    assert!(found.flat && found.sounding < 0.5 && found.sources.is_empty(), "{}", found.sounding);
}

#[test]
fn silence_is_flat() {
    let unit = BinauralUnit::new(RATE_HZ, &[0.5; 32]);
    let found = Listening::new(sphere(), Directions::All).unwrap().find(&unit.silence().bands()).unwrap();
    assert_eq!(found, Found::flat());
}
