//! Several sources at once: which source each band at each moment belongs to.
//!
//! In: the cues of the parts of a look. Out: the cues of each voice. Invariant: the cues of a look are those of its
//! voices and of what belongs to none.
//!
//! A band of a part is a unit, and has one source: voices overlap little in frequency and time. The likelihood of each unit
//! for a source at each lateral angle is that of `models/listening.bp` for this band alone. The shares of the units that
//! come from each lateral angle, and from no source, are those of greatest likelihood (expectation and maximisation). Sources
//! on one cone of confusion are one voice here: it is their lateral angles that tell them apart.

use super::binaural::Cues;

/// Voices are at least this far apart, and what is within the half belongs to one: sines of lateral angles, which time
/// differences follow.
const APART: f64 = 0.23;
/// The least share of a second voice in the units that have a source.
const LEAST_SHARE: f64 = 0.2;
/// Steps of expectation and maximisation, and the share of units of no source at their start.
const STEPS: usize = 60;
const STRAY: f64 = 0.2;
/// A unit is that of a voice from this probability on.
const SURE: f64 = 0.5;

/// A unit: its part and band, and its likelihood for a source at each lateral angle, relative to that of no source.
pub(super) struct Unit {
    pub(super) part: usize,
    pub(super) band: usize,
    pub(super) ratios: Vec<f64>,
}

/// The cues of each voice, the one with more units first; a single voice has all cues.
pub(super) fn voices(parts: &[Cues], units: &[Unit], sines: &[f64], silence: Cues) -> Vec<Cues> {
    let whole = || {
        let mut all = silence.clone();
        parts.iter().for_each(|part| all.add(part));
        vec![all]
    };
    if units.is_empty() {
        return whole();
    }
    let shares = shares(units, sines.len());
    let near = |at: usize, of: usize| (sines[at] - sines[of]).abs() <= 0.5 * APART;
    let around = |of: usize| (0..shares.len()).filter(|at| near(*at, of)).map(|at| shares[at]).sum::<f64>();
    let most = |free: &dyn Fn(usize) -> bool| {
        (0..shares.len()).filter(|at| free(*at)).max_by(|one, other| around(*one).total_cmp(&around(*other)))
    };
    let Some(first) = most(&|_| true) else { return whole() };
    let second = most(&|at| (sines[at] - sines[first]).abs() >= APART);
    let heard = shares.iter().sum::<f64>();
    let Some(second) = second.filter(|second| around(*second) >= LEAST_SHARE * heard) else { return whole() };
    let stray = (1.0 - heard).max(0.0);
    let mut found = vec![silence.clone(), silence.clone()];
    for unit in units {
        let weight = |at: usize| shares[at] * unit.ratios[at];
        let total = stray + (0..shares.len()).map(weight).sum::<f64>();
        for (voice, of) in found.iter_mut().zip([first, second]) {
            let own: f64 = (0..shares.len()).filter(|at| near(*at, of)).map(weight).sum();
            if own > SURE * total {
                voice.add_band(&parts[unit.part], unit.band);
            }
        }
    }
    found
}

/// The share of the units that come from each lateral angle.
fn shares(units: &[Unit], angles: usize) -> Vec<f64> {
    let mut shares = vec![(1.0 - STRAY) / angles as f64; angles];
    let mut stray = STRAY;
    for _ in 0..STEPS {
        let mut sums = vec![0.0; angles];
        let mut strays = 0.0;
        for unit in units {
            let total =
                stray + shares.iter().zip(&unit.ratios).map(|(share, ratio)| share * ratio).sum::<f64>();
            strays += stray / total;
            for ((sum, share), ratio) in sums.iter_mut().zip(&shares).zip(&unit.ratios) {
                *sum += share * ratio / total;
            }
        }
        let count = units.len() as f64;
        stray = strays / count;
        shares = sums.iter().map(|sum| sum / count).collect();
    }
    shares
}
