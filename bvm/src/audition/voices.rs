//! Several sources at once: which source each band at each moment belongs to.
//!
//! In: the cues of the parts of a look. Out: the cues of each voice. Invariant: every probability is that of
//! `models/voices.bp` and `models/voice.bp`; a band of a part belongs to one voice or to none.
//!
//! A band of a part is a unit. Sources on one cone of confusion are one voice here: it is their lateral angles that tell them
//! apart.

use super::binaural::Cues;
use super::cochlea::BANDS;
use crate::error::Error;
use crate::programs::{voice, voices};

/// Parts of the units that the first voice may have: alone, or before a second one.
const PART: [f64; 4] = [1.0, 0.5, 0.62, 0.74];
/// A unit is that of a voice from this probability on.
const SURE: f64 = 0.5;

/// A unit: its part and band, and its likelihood for a source at each lateral angle, relative to that of no source.
pub(super) struct Unit {
    pub(super) part: usize,
    pub(super) band: usize,
    pub(super) ratios: Vec<f64>,
}

/// The cues of each voice; a single voice has all cues.
pub(super) fn separated(
    parts: &[Cues],
    units: &[Unit],
    sines: &[f64],
    silence: Cues,
) -> Result<Vec<Cues>, Error> {
    let whole = || {
        let mut all = silence.clone();
        parts.iter().for_each(|part| all.add(part));
        Ok(vec![all])
    };
    if units.is_empty() {
        return whole();
    }
    let largest = |unit: &Unit| unit.ratios.iter().fold(1.0, |most: f64, ratio| most.max(*ratio));
    let none: Vec<f64> = units.iter().map(|unit| 1.0 / largest(unit)).collect();
    let likely: Vec<f64> = (units.iter().zip(&none))
        .flat_map(|(unit, none)| unit.ratios.iter().map(move |ratio| (ratio * none).min(1.0)))
        .collect();
    let found = voices::angles()
        .units(units.len())
        .angles(sines.len())
        .part(&PART)
        .sine(sines)
        .likely(&likely)
        .none(&none)
        .heard(&vec![1.0; units.len()])
        .ask()?;
    let angles = sines.len();
    let all = found.distribution();
    let (of_one, of_two) = all.split_at(angles * angles);
    if of_one.iter().sum::<f64>() >= 0.5 {
        return whole();
    }
    let best = (0..of_two.len()).fold(0, |best, at| if of_two[at] > of_two[best] { at } else { best });
    let (part, first, second) = (1 + best / (angles * angles), best / angles % angles, best % angles);
    let at = |angle: usize| -> Vec<f64> { likely.iter().skip(angle).step_by(angles).copied().collect() };
    let from = voice::unit()
        .units(units.len())
        .part(PART[part])
        .stray(voices::DEFAULT_STRAY)
        .first(&at(first))
        .second(&at(second))
        .none(&none)
        .ask()?;
    let mut voice_of = vec![[None; BANDS]; parts.len()];
    for (number, unit) in units.iter().enumerate() {
        voice_of[unit.part][unit.band] = (0..2).find(|voice| from.p(*voice)[number] > SURE);
    }
    let mut separated = vec![silence.clone(), silence];
    for (part, voices) in parts.iter().zip(&voice_of) {
        for (band, voice) in voices.iter().enumerate() {
            let Some(voice) = *voice else { continue };
            let has_slope = voices.get(band + 1) == Some(&Some(voice));
            separated[voice as usize].add_band(part, band, has_slope);
        }
    }
    Ok(separated)
}
