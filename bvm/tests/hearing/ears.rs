//! The cochlear and the binaural unit, and the rigid sphere.
//!
//! In: impulses, tones, delayed noise. Out: what closed forms, or mpmath at 30 digits, say of them.

use crate::noise;
use bvm::audition::sphere::{HEAD_RADIUS_M, SOUND_SPEED_M_S, responses, transfer};
use bvm::audition::{BANDS, BinauralUnit, Cochlea, Cochleagram, bands_at, centres_hz, erb_hz, independent};
use std::f64::consts::{PI, TAU};

#[test]
fn bands_are_equally_spaced_on_the_erb_scale() {
    // mpmath: equal steps of ln(1 + 0.00437 f) from 100 to 15000 Hz, and 24.7 (0.00437 f + 1).
    let centres = centres_hz();
    for (band, centre, width) in [
        (0, 100.0, 35.4939),
        (8, 655.938_596_035, 95.501_356_117_4),
        (16, 2_151.769_987_89, 256.959_900_723),
        (31, 15_000.0, 1_643.785),
    ] {
        assert!((centres[band] / centre - 1.0).abs() < 1e-11, "{band}: {}", centres[band]);
        assert!((erb_hz(centres[band]) / width - 1.0).abs() < 1e-11);
    }
    assert_eq!((bands_at(44_100.0), bands_at(192_000.0)), (BANDS, BANDS));
    assert!(bands_at(8_000.0) > 15 && centres[bands_at(8_000.0) - 1] < 3_400.0);
}

#[test]
fn an_impulse_has_the_power_of_a_gammatone() {
    // |y[n]| = 2 (1 - λ)⁴ C(n + 3, 3) λⁿ, at every rate whose outputs are not decimated, and in the lowest band, in which
    // direct forms of order eight diverge.
    let rate_hz = 32_000.0;
    let mut impulse = vec![0.0; 3200];
    impulse[0] = 1.0;
    let mut found = Cochleagram::default();
    Cochlea::new(rate_hz).filter(&impulse, &vec![0.0; 3200], &mut found);
    for band in [0, 5, 16, 25] {
        let radius = (-TAU * 1.019 * 24.7 * (4.37e-3 * centres_hz()[band] + 1.0) / rate_hz).exp();
        for n in [0_usize, 1, 10, 100, 1000] {
            let m = n as f64;
            let binomial = (m + 1.0) * (m + 2.0) * (m + 3.0) / 6.0;
            let expected = (2.0 * (1.0 - radius).powi(4) * binomial * radius.powi(n as i32)).powi(2);
            let power = f64::from(found.power[n][band]);
            assert!((power - expected).abs() <= 1e-6 * expected + 1e-37, "{band} {n}: {power} {expected}");
            assert_eq!(found.power[n][BANDS + band], 0.0, "the right ear is silent");
        }
    }
}

#[test]
fn a_tone_has_gain_one_at_its_band_and_the_closed_form_beside_it() {
    // mpmath at 48 kHz, band 16: |(1 - λ)/(1 - λ exp(2πi d ERB/48000))|⁴ in dB for d = 0, 1/2, 1, 2.
    let (rate_hz, band) = (48_000.0, 16);
    let (centre, width) = (centres_hz()[band], erb_hz(centres_hz()[band]));
    for (bandwidths, gain_db) in
        [(0.0, 0.0), (0.5, -3.747_158_635), (1.0, -11.715_671_58), (2.0, -27.431_085_33)]
    {
        let step = TAU * (centre + bandwidths * width) / rate_hz;
        let tone: Vec<f64> = (0..9600).map(|n| 0.5 * (step * n as f64).cos()).collect();
        let mut found = Cochleagram::default();
        Cochlea::new(rate_hz).filter(&tone, &tone, &mut found);
        let last = &found.power[found.power.len() - 2000..];
        let power = last.iter().map(|row| f64::from(row[band])).sum::<f64>() / 2000.0;
        let level = 10.0 * (power / 0.25).log10();
        // The filter's answer to the tone's negative frequency is what remains.
        assert!((level - gain_db).abs() < 0.02, "{bandwidths}: {level}");
    }
}

#[test]
fn hair_cells_pass_the_mean_of_half_a_wave() {
    // The mean of max(0, A cos) is A/π; the low-pass has gain one at frequency zero.
    let rate_hz = 48_000.0;
    let step = TAU * centres_hz()[20] / rate_hz;
    let tone: Vec<f64> = (0..9600).map(|n| 0.8 * (step * n as f64).cos()).collect();
    let mut found = Cochleagram::default();
    Cochlea::new(rate_hz).filter(&tone, &tone, &mut found);
    let last = &found.hair[found.hair.len() - 2400..];
    let mean = last.iter().map(|row| f64::from(row[20])).sum::<f64>() / 2400.0;
    assert!((mean / (0.8 / PI) - 1.0).abs() < 5e-3, "{mean}");
}

#[test]
fn blocks_do_not_matter_and_no_rate_diverges() {
    for rate_hz in [8_000.0, 44_100.0, 192_000.0] {
        let (left, right) = (noise(3, 9000, "left"), noise(3, 9000, "right"));
        let whole = {
            let mut cues = BinauralUnit::new(rate_hz, &[0.0; BANDS]);
            let mut found = cues.silence();
            cues.add(&left, &right, &mut found);
            found
        };
        let mut unit = BinauralUnit::new(rate_hz, &[0.0; BANDS]);
        let mut found = unit.silence();
        for start in (0..9000).step_by(77) {
            let end = (start + 77).min(9000);
            unit.add(&left[start..end], &right[start..end], &mut found);
        }
        assert_eq!(found, whole);
        assert!(found.bands().iter().all(|cue| cue.itd_s.is_finite() && cue.ild_db.is_finite()));
    }
}

#[test]
fn a_delay_and_a_gain_are_the_cues_of_every_band() {
    // The right ear gets the sound 13 samples later, at half the amplitude: the left leads by 294.8 µs, and is louder by
    // 20 log10 2 = 6.02 dB.
    let (rate_hz, delay) = (44_100.0, 13);
    let sound = noise(3, 22_050, "sound");
    let late: Vec<f64> = (0..22_050).map(|n| if n < delay { 0.0 } else { 0.5 * sound[n - delay] }).collect();
    let independent = independent();
    for (left, right, side) in [(&sound, &late, 1.0), (&late, &sound, -1.0)] {
        let cues = BinauralUnit::new(rate_hz, &independent).hear(left, right).bands();
        for (band, cue) in cues.iter().enumerate() {
            // Fine structure that remains in high bands is ambiguous by a cycle.
            let error = cue.itd_s - side * delay as f64 / rate_hz;
            let error = error - (error * centres_hz()[band]).round() / centres_hz()[band];
            assert!(error.abs() < 4e-6, "band {band}: {} µs", cue.itd_s * 1e6);
            assert!((cue.ild_db - side * 6.0206).abs() < 0.15, "band {band}: {} dB", cue.ild_db);
            assert!(cue.coherence > 0.95, "band {band}: {}", cue.coherence);
        }
    }
}

#[test]
fn independent_noises_are_not_coherent() {
    let cues = BinauralUnit::new(44_100.0, &independent())
        .hear(&noise(3, 44_100, "one"), &noise(3, 44_100, "other"))
        .bands();
    assert!(cues.iter().all(|cue| cue.coherence < 0.7), "{cues:?}");
    let mean = cues.iter().map(|cue| cue.coherence).sum::<f64>() / BANDS as f64;
    assert!(mean < 0.4, "{mean}");
}

#[test]
fn the_series_of_the_sphere_is_summed() {
    // mpmath at 40 digits: spherical Hankel functions and Legendre polynomials, 120 terms.
    for (rho, mu, degrees, re, im) in [
        (1.25, 0.5, 0.0_f64, 6.892_494_015_519_026, -4.209_185_458_372_259),
        (1.25, 0.5, 90.0, 0.584_218_317_440_376_6, 0.189_232_980_099_833_2),
        (2.0, 3.0, 60.0, 0.902_561_526_542_677_1, -1.182_323_824_327_443),
        (100.0, 1.0, 180.0, 0.027_084_200_511_813_08, 1.052_011_130_676_036),
        (10.0, 16.0, 30.0, 0.877_743_097_168_127_5, -1.950_260_394_576_431),
        (1.25, 12.0, 150.0, 0.093_473_159_391_052_17, 0.034_162_909_014_951_86),
    ] {
        let cosine = degrees.to_radians().cos();
        for found in transfer(rho, mu, [cosine, cosine]) {
            let error = (found.re - re).hypot(found.im - im) / re.hypot(im);
            assert!(error < 1e-9, "{rho} {mu} {degrees}: {found}, {error:e}");
        }
    }
}

#[test]
fn low_frequencies_follow_kuhn_and_near_sources_the_published_levels() {
    // Kuhn 1977: ITD = 3 (a/c) sin θ at low frequencies.
    let unit = TAU * HEAD_RADIUS_M / SOUND_SPEED_M_S;
    for degrees in [10.0_f64, 40.0, 80.0] {
        let sine = degrees.to_radians().sin();
        let [left, right] = transfer(100.0, 100.0 * unit, [sine, -sine]);
        // Time is exp(-iωt): the ear that leads has the smaller phase.
        let itd_s = (right / left).arg() / (TAU * 100.0);
        let kuhn = 3.0 * HEAD_RADIUS_M / SOUND_SPEED_M_S * sine;
        assert!((itd_s / kuhn - 1.0).abs() < 0.02, "{degrees}°: {itd_s} {kuhn}");
    }
    // The level difference of a source at 90° and 300 Hz, by an independent series: dB to one digit.
    for (distance_m, level_db) in [(0.2, 12.2), (0.25, 9.6), (0.5, 4.9), (1.0, 2.7), (3.0, 1.2)] {
        let [left, right] = transfer(distance_m / HEAD_RADIUS_M, 300.0 * unit, [1.0, -1.0]);
        let found = 20.0 * (left.norm() / right.norm()).log10();
        assert!((found - level_db).abs() < 0.06, "{distance_m} m: {found}");
    }
}

#[test]
fn responses_have_the_onsets_of_woodworth() {
    // High frequencies go around the sphere: a/c (θ + sin θ) between the ears.
    let rate_hz = 96_000.0;
    for degrees in [0.0_f64, 30.0, 60.0, 90.0] {
        let angle = degrees.to_radians();
        let ears = responses(HEAD_RADIUS_M, 5.0, angle.sin(), rate_hz);
        let onset = |ear: &[f64]| {
            let most = ear.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            ear.iter().position(|value| value.abs() > 0.25 * most).unwrap() as f64 / rate_hz
        };
        let itd_s = onset(&ears[1]) - onset(&ears[0]);
        let woodworth = HEAD_RADIUS_M / SOUND_SPEED_M_S * (angle + angle.sin());
        assert!((itd_s - woodworth).abs() < 50e-6, "{degrees}°: {itd_s} {woodworth}");
    }
}
