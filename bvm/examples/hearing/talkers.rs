//! Two voices at once.
//!
//! In: a head, voices, places. Out: in how many cases both are found within 10 degrees, and in how many cases of one voice two
//! seem to speak.

use crate::cases::{RATE_HZ, Sound, both, rendered};
use bvm::audition::{BANDS, BinauralUnit, Head, Listening, PART_S, Parts, Source};
use bvm::error::Error;
use bvm::frame::{Spherical, great_circle};
use rayon::prelude::*;

/// Pairs of voices 40 degrees apart at 10 dB: in how many both are found, of how many; and single voices that seem to be two,
/// of how many.
pub(crate) fn count(
    head: &Head,
    sounds: &[Sound],
    places: &[Spherical],
    every: usize,
    ears: &Listening,
    independent: &[f64; BANDS],
) -> Result<[usize; 4], Error> {
    let heard = |waves: &[Vec<f64>; 2]| {
        let mut unit = BinauralUnit::new(RATE_HZ, independent);
        let mut parts = Parts::default();
        let length = (PART_S * RATE_HZ) as usize;
        for (left, right) in waves[0].chunks(length).zip(waves[1].chunks(length)) {
            let mut cues = unit.silence();
            unit.add(left, right, &mut cues);
            parts.push(&cues);
        }
        ears.clone().find_voices(parts.all())
    };
    let away = |one: &Source, place: Spherical| {
        let found = (one.azimuth_deg.to_radians(), one.elevation_deg.to_radians());
        great_circle(found, (place.azimuth, place.elevation)).to_degrees()
    };
    let pairs: Vec<(usize, Spherical, Spherical)> = (places.iter().enumerate())
        .flat_map(|(number, one)| places.iter().map(move |other| (number, *one, *other)))
        .filter(|(_, one, other)| ((one.azimuth - other.azimuth).to_degrees() - 40.0).abs() < 0.5)
        .step_by(every.div_ceil(2))
        .collect();
    let both = pairs.par_iter().map(|(number, one, other)| {
        let waves =
            both(head, [&sounds[0].samples, &sounds[1].samples], [*one, *other], 10.0, *number as u64);
        let found = heard(&waves)?;
        let first: Vec<&Source> = found.sources.iter().take(2).collect();
        let is_found =
            [one, other].iter().all(|place| first.iter().any(|source| away(source, **place) <= 10.0));
        Ok(is_found)
    });
    let both = both.collect::<Result<Vec<bool>, Error>>()?;
    let single = pairs.par_iter().map(|(number, one, _)| {
        let found = heard(&rendered(head, &sounds[number % 2].samples, *one, 10.0, *number as u64))?;
        Ok(found.sources.iter().map(|source| source.probability).sum::<f64>() > 1.2)
    });
    let single = single.collect::<Result<Vec<bool>, Error>>()?;
    let count = |all: &[bool]| all.iter().filter(|one| **one).count();
    Ok([count(&both), both.len(), count(&single), single.len()])
}
