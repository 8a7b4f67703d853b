//! The cues of white noise that is played from a direction.
//!
//! In: the responses of both ears. Out: the cues of each band, identified by `models/ear.bp` from windows of the noise.
//! Invariant: time differences of all bands are those of one cycle.

use super::binaural::{BandCue, BinauralUnit};
use super::calibration::CueRow;
use super::cochlea::{BANDS, Cochlea, Cochleagram, bands_at, centres_hz};
use super::synthesis::convolved;
use crate::error::Error;
use crate::programs::ear;
use bp_core::compiler::learn::{Case, Learner};
use bp_core::compiler::random::seeded;
use rand_distr::{Distribution, StandardNormal};

/// Length of the noise that is played from each direction, s.
const NOISE_S: f64 = 0.4;
/// Length of a window of it, s.
const WINDOW_S: f64 = 0.1;
/// How long the lowest band rings, s.
const RINGING_S: f64 = 0.1;
/// Bands whose time differences are of one cycle, Hz.
pub(super) const UNAMBIGUOUS_HZ: [f64; 2] = [450.0, 1500.0];

/// The cues of white noise that is filtered by two responses: identified by `models/ear.bp` from windows of it.
pub(super) fn played(
    ears: &[Vec<f64>; 2],
    rate_hz: f64,
    independent: &[f64; BANDS],
) -> Result<CueRow, Error> {
    let mut random = seeded(0, "calibration of hearing");
    let noise: Vec<f64> =
        (0..(NOISE_S * rate_hz) as usize).map(|_| StandardNormal.sample(&mut random)).collect();
    let [left, right] = [0, 1].map(|ear| convolved(&noise, &ears[ear]));
    // Responses of any scale are far from silence.
    let loudest = left.iter().chain(&right).fold(f64::MIN_POSITIVE, |most, value| most.max(value.abs()));
    let scaled = |ear: Vec<f64>| -> Vec<f64> { ear.iter().map(|value| value / loudest).collect() };
    let [left, right] = [left, right].map(scaled);
    let mut unit = BinauralUnit::new(rate_hz, independent);
    let window = (WINDOW_S * rate_hz) as usize;
    let mut windows = Vec::new();
    for (left, right) in left.chunks(window).zip(right.chunks(window)) {
        let mut cues = unit.silence();
        unit.add(left, right, &mut cues);
        windows.push(unwrapped(&cues.bands()));
    }
    let [itd_us, ild_db] = identified(&windows)?;
    Ok(CueRow { itd_us, ild_db, slope_db: slopes_db(ears, rate_hz) })
}

/// The means of time differences (µs) and level differences (dB) of each band.
fn identified(windows: &[[Option<[f64; 2]>; BANDS]]) -> Result<[Vec<f64>; 2], Error> {
    let model = ear::model();
    let variable = |name| model.variable(name).expect("internal: a variable of the program");
    let [band, tau, l] = ["Band", "Tau", "L"].map(variable);
    let mut learner = Learner::new(&model)?;
    for window in windows {
        for (number, cues) in window.iter().enumerate() {
            let Some([itd_us, ild_db]) = *cues else { continue };
            let case = Case::new(&model).with(band, number as f64);
            learner.observe(&case.with(tau, itd_us).with(l, ild_db))?;
        }
    }
    let learned = learner.learned()?;
    let numbers = |name: &str| -> Vec<f64> {
        let parameter = learned.model().parameters.values().find(|parameter| parameter.name == name);
        let parameter = parameter.expect("internal: a parameter of the program");
        parameter.default.iter().map(|value| (value * 1e3).round() / 1e3).collect()
    };
    Ok([numbers("mu_tau"), numbers("mu_l")])
}

/// From each band to the next one, the power of both ears that a flat spectrum has after two responses, dB.
fn slopes_db(ears: &[Vec<f64>; 2], rate_hz: f64) -> Vec<f64> {
    let length = ears[0].len().max(ears[1].len()) + (RINGING_S * rate_hz) as usize;
    let padded = |ear: &Vec<f64>| ear.iter().copied().chain(std::iter::repeat(0.0)).take(length).collect();
    let [left, right]: [Vec<f64>; 2] = [padded(&ears[0]), padded(&ears[1])];
    let mut block = Cochleagram::default();
    Cochlea::new(rate_hz).filter(&left, &right, &mut block);
    let energy = |band: usize| -> f64 {
        let both = |row: &[f32; 2 * BANDS]| f64::from(row[band]) + f64::from(row[BANDS + band]);
        block.power.iter().map(both).sum()
    };
    let level_db: Vec<f64> = (0..bands_at(rate_hz)).map(|band| 10.0 * energy(band).log10()).collect();
    let slope = |band: usize| match (level_db.get(band), level_db.get(band + 1)) {
        (Some(lower), Some(upper)) if lower.is_finite() && upper.is_finite() => {
            ((upper - lower) * 1e3).round() / 1e3
        }
        _ => 0.0,
    };
    (0..BANDS).map(slope).collect()
}

/// The time difference (µs) and the level difference (dB) of each band that has cues. Time differences are of one cycle: those
/// of high bands are moved by whole periods to the median of the bands that have one cycle only.
fn unwrapped(cues: &[BandCue; BANDS]) -> [Option<[f64; 2]>; BANDS] {
    let centres = centres_hz();
    let unambiguous = |band: &usize| {
        (UNAMBIGUOUS_HZ[0]..UNAMBIGUOUS_HZ[1]).contains(&centres[*band]) && cues[*band].count > 0.0
    };
    let mut sure: Vec<f64> = (0..BANDS).filter(unambiguous).map(|band| cues[band].itd_s).collect();
    sure.sort_by(f64::total_cmp);
    let middle = sure.get(sure.len() / 2).copied().unwrap_or(0.0);
    std::array::from_fn(|band| {
        let (cue, centre) = (cues[band], centres[band]);
        let cycles = if centre < UNAMBIGUOUS_HZ[1] { 0.0 } else { ((middle - cue.itd_s) * centre).round() };
        (cue.count > 0.0 && cue.level_count > 0.0).then(|| [1e6 * (cue.itd_s + cycles / centre), cue.ild_db])
    })
}
