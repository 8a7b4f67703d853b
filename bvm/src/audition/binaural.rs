//! The binaural unit: interaural cues of every band over time.
//!
//! In: cochleagrams. Out: the [`Cues`] of a stretch of sound (a look): for each band the correlogram, in which every peak
//! of the interaural time difference (ITD) is kept, the interaural level difference (ILD), and the slope of the spectrum
//! from the band to the next one, all of coherent moments.
//! Invariant: memory does not grow with the length of a look; both cues are positive when the left ear leads or is
//! louder.
//!
//! Per band, with a recursive window (C. Faller and J. Merimaa, *JASA* 116, 2004):
//!
//! ```text
//! a12(n, m) = α x_L(n - max(m, 0)) x_R(n - max(-m, 0)) + (1 - α) a12(n - 1, m)       and so a11, a22
//! γ(n, m)   = a12 / √(a11 a22)          interaural coherence = max over |m| ≤ 1 ms of γ
//! ```
//!
//! There is a moment each 5 ms. The hair cells of independent noises are coherent to some degree, because they are
//! positive ([`independent`]). A moment counts by its coherence above that, on a scale from 0 to 1: its weight in the
//! correlogram is the square, and its levels count above 0.7: the difference between the ears, and, where the next band is
//! as coherent at that moment, the difference of the power of both ears from band to band.

use super::cochlea::{BANDS, Cochlea, Cochleagram, bands_at, centres_hz, erb_hz};
use bp_core::compiler::random::seeded;
use rand_distr::{Distribution, StandardNormal};

/// The largest time difference that is searched, s.
const MOST_ITD_S: f64 = 1e-3;
/// Least time constant of the window, s.
const WINDOW_S: f64 = 10e-3;
/// The same, in inverse bandwidths, which are longer in low bands: fewer would be coherent by chance.
const WINDOW_CYCLES: f64 = 3.0;
/// Time between two moments, s.
const HOP_S: f64 = 5e-3;
/// Time constants until a window counts as filled.
const FILLED: f64 = 1.5;
/// Least coherence, above that of independent noise, of a moment whose levels count.
const FOR_LEVELS: f64 = 0.7;
/// Length of the noise whose coherence is that of independence, s.
const INDEPENDENT_S: f64 = 4.0;
/// Power below which a band is silent, relative to full scale: −100 dB.
const SILENT: f32 = 1e-10;

/// The cues of one band during a look.
#[derive(Clone, Debug, Default, PartialEq)]
struct BandCues {
    /// The correlogram: the sum over moments of γ times the weight of the moment, one value for each lag from right to
    /// left.
    curve: Vec<f64>,
    /// Sums over moments of the weight, of its square, and of the coherence times the weight.
    weights: [f64; 3],
    /// Sums over the moments that are coherent enough for levels: their number, ΔL in dB, and the coherence.
    levels: [f64; 3],
    /// The same over the moments at which the next band is coherent enough too: their number, and the slope in dB.
    slopes: [f64; 2],
}

/// The cues of a look.
#[derive(Clone, Debug, PartialEq)]
pub struct Cues {
    rate_hz: f64,
    bands: Vec<BandCues>,
}

/// The cues of a band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BandCue {
    /// Interaural time difference at the highest peak of the correlogram, s.
    pub itd_s: f64,
    /// Mean coherence above that of independent noise, from 0 to 1; 0 if the band was silent.
    pub coherence: f64,
    /// The number of independent moments of the correlogram.
    pub count: f64,
    /// Interaural level difference, dB.
    pub ild_db: f64,
    /// The number of independent moments of the level; 0 if there was none.
    pub level_count: f64,
    /// Mean coherence, as above, of the moments of the level; 0 if there was none.
    pub level_coherence: f64,
    /// The power of both ears in the next higher band, relative to this one, dB.
    pub slope_db: f64,
    /// The number of independent moments of the slope; 0 if there was none.
    pub slope_count: f64,
}

impl Cues {
    /// The cue of each band.
    pub fn bands(&self) -> [BandCue; BANDS] {
        let centres = centres_hz();
        std::array::from_fn(|band| self.bands[band].cue(self.rate_hz, window_s(centres[band])))
    }

    /// The correlogram: for each band the mean cross-correlation at each lag, from the one at which the right ear leads most
    /// to that at which the left ear does; and the largest lag, s. Bands without cues have none.
    pub fn correlogram(&self) -> (Vec<Vec<f64>>, f64) {
        let mean = |band: &BandCues| {
            let weight = band.weights[0].max(f64::MIN_POSITIVE);
            band.curve.iter().map(|sum| sum / weight).collect::<Vec<f64>>()
        };
        let bands: Vec<Vec<f64>> = self.bands.iter().map(mean).collect();
        let lags = bands.iter().map(Vec::len).max().unwrap_or(0) / 2;
        (bands, lags as f64 / self.rate_hz)
    }

    /// Adds the moments of another stretch of sound, heard at the same rate.
    pub fn add(&mut self, other: &Cues) {
        (0..BANDS).for_each(|band| self.add_band(other, band, true));
    }

    /// The same of one band; the slope to the next band is that of both only where they have one source.
    pub(super) fn add_band(&mut self, other: &Cues, band: usize, has_slope: bool) {
        let (own, other) = (&mut self.bands[band], &other.bands[band]);
        own.curve.resize(own.curve.len().max(other.curve.len()), 0.0);
        let sum = |own: &mut [f64], other: &[f64]| own.iter_mut().zip(other).for_each(|(a, b)| *a += b);
        sum(&mut own.curve, &other.curve);
        sum(&mut own.weights, &other.weights);
        sum(&mut own.levels, &other.levels);
        if has_slope {
            sum(&mut own.slopes, &other.slopes);
        }
    }

    /// No cues, at the same rate.
    pub(super) fn silence(&self) -> Cues {
        Cues { rate_hz: self.rate_hz, bands: vec![BandCues::default(); BANDS] }
    }
}

impl BandCues {
    fn cue(&self, rate_hz: f64, window_s: f64) -> BandCue {
        let curve = &self.curve;
        if curve.len() < 3 || self.weights[0] <= 0.0 {
            return BandCue::default();
        }
        let higher = |best: usize, at: usize| if curve[at] > curve[best] { at } else { best };
        let top = (1..curve.len() - 1).fold(1, higher);
        let [before, here, after] = [curve[top - 1], curve[top], curve[top + 1]];
        let bend = before - 2.0 * here + after;
        let shift = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        // Moments within two windows are not independent.
        let dependent = (2.0 * window_s / HOP_S).max(1.0);
        let [count, level, of_levels] = self.levels;
        let [slope_count, slope] = self.slopes;
        BandCue {
            itd_s: (top as f64 - (curve.len() / 2) as f64 + shift) / rate_hz,
            coherence: (self.weights[2] / self.weights[0]).min(1.0),
            count: self.weights[0] * self.weights[0] / self.weights[1] / dependent,
            ild_db: if count > 0.0 { level / count } else { 0.0 },
            level_count: count / dependent,
            level_coherence: if count > 0.0 { (of_levels / count).min(1.0) } else { 0.0 },
            slope_db: if slope_count > 0.0 { slope / slope_count } else { 0.0 },
            slope_count: slope_count / dependent,
        }
    }
}

/// The time constant of a band's window, s.
fn window_s(centre_hz: f64) -> f64 {
    WINDOW_S.max(WINDOW_CYCLES / erb_hz(centre_hz))
}

/// The mean coherence of independent noises in each band, at a sampling rate of 44.1 kHz: that of the hair cells, whose
/// output is positive.
pub fn independent() -> [f64; BANDS] {
    const RATE_HZ: f64 = 44_100.0;
    let mut random = seeded(0, "independent noises");
    let mut noise = || -> Vec<f64> {
        (0..(INDEPENDENT_S * RATE_HZ) as usize).map(|_| StandardNormal.sample(&mut random)).collect()
    };
    let (left, right) = (noise(), noise());
    let cues = BinauralUnit::new(RATE_HZ, &[0.0; BANDS]).hear(&left, &right);
    std::array::from_fn(|band| {
        let [weight, _, coherence] = cues.bands[band].weights;
        if weight > 0.0 { coherence / weight } else { 0.0 }
    })
}

/// The cochlear and the binaural unit, one after the other.
#[derive(Clone, Debug)]
pub struct BinauralUnit {
    cochlea: Cochlea,
    correlator: Correlator,
    block: Cochleagram,
}

impl BinauralUnit {
    /// Ears at rest for a sampling rate in Hz, with the coherence of independent noises in each band.
    pub fn new(rate_hz: f64, independent: &[f64; BANDS]) -> BinauralUnit {
        let cochlea = Cochlea::new(rate_hz);
        let correlator = Correlator::new(cochlea.rate_hz(), bands_at(rate_hz), independent);
        BinauralUnit { cochlea, correlator, block: Cochleagram::default() }
    }

    /// No cues yet.
    pub fn silence(&self) -> Cues {
        Cues { rate_hz: self.cochlea.rate_hz(), bands: vec![BandCues::default(); BANDS] }
    }

    /// Adds the moments of a block of samples in [-1, 1] to the cues of a look.
    pub fn add(&mut self, left: &[f64], right: &[f64], cues: &mut Cues) {
        // Short pieces stay in the cache.
        for (left, right) in left.chunks(1024).zip(right.chunks(1024)) {
            self.cochlea.filter(left, right, &mut self.block);
            self.correlator.add(&self.block, cues);
        }
    }

    /// The cues of a whole sound.
    pub fn hear(mut self, left: &[f64], right: &[f64]) -> Cues {
        let mut cues = self.silence();
        self.add(left, right, &mut cues);
        cues
    }
}

/// The running correlations of one band.
#[derive(Clone, Debug)]
struct Running {
    keep: f32,
    floor: f32,
    /// Moments until the window is filled: before, everything is coherent.
    until_filled: usize,
    /// The hair cells of the left and the right ear, and their smoothed powers: the past, then the present block.
    ears: [Vec<f32>; 2],
    powers: [Vec<f32>; 2],
    /// a12 at lags m = M, …, 0 (left leads) and then at m = −M, …, 0.
    products: [Vec<f32>; 2],
    /// Smoothed power of the band in each ear.
    levels: [f32; 2],
}

/// Correlates the ears, band by band.
#[derive(Clone, Debug)]
struct Correlator {
    lags: usize,
    hop: usize,
    until_moment: usize,
    bands: Vec<Running>,
    curve: Vec<f32>,
}

impl Correlator {
    /// A correlator at rest of the first `bands` bands, for cochleagrams at a rate in Hz, with the coherence of
    /// independent noises in each band.
    fn new(rate_hz: f64, bands: usize, independent: &[f64; BANDS]) -> Correlator {
        // One lag more on each side, for the parabola through a peak at the end.
        let lags = (MOST_ITD_S * rate_hz).ceil() as usize + 1;
        let hop = ((HOP_S * rate_hz).round() as usize).max(1);
        let zeros = |length| [vec![0.0; length], vec![0.0; length]];
        let centres = centres_hz();
        let running = |band: usize| Running {
            floor: independent[band] as f32,
            until_filled: (FILLED * window_s(centres[band]) / HOP_S).ceil() as usize,
            keep: (-1.0 / (window_s(centres[band]) * rate_hz)).exp() as f32,
            ears: zeros(lags + 1),
            powers: zeros(lags + 1),
            products: zeros(lags + 1),
            levels: [0.0; 2],
        };
        let bands = (0..bands.min(BANDS)).map(running).collect();
        Correlator { lags, hop, until_moment: hop, bands, curve: vec![0.0; 2 * lags + 1] }
    }

    /// Adds the moments of a block to the cues of a look.
    fn add(&mut self, block: &Cochleagram, cues: &mut Cues) {
        let mut at = 0;
        while at < block.hair.len() {
            let length = self.until_moment.min(block.hair.len() - at);
            let rows = at..at + length;
            for (band, running) in self.bands.iter_mut().enumerate() {
                running.advance(band, self.lags, &block.hair[rows.clone()], &block.power[rows.clone()]);
            }
            at += length;
            self.until_moment -= length;
            if self.until_moment == 0 {
                self.until_moment = self.hop;
                let mut below = None;
                for band in 0..self.bands.len() {
                    let power_db = self.moment(band, &mut cues.bands[band]);
                    if let Some((lower, upper)) = below.zip(power_db) {
                        let [count, slope] = &mut cues.bands[band - 1].slopes;
                        (*count, *slope) = (*count + 1.0, *slope + upper - lower);
                    }
                    below = power_db;
                }
            }
        }
    }

    /// Adds the present moment of a band to its cues. The power of both ears in dB, if it is coherent enough for levels.
    fn moment(&mut self, band: usize, cues: &mut BandCues) -> Option<f64> {
        let running = &mut self.bands[band];
        if running.until_filled > 0 {
            running.until_filled -= 1;
            return None;
        }
        if !running.levels.iter().all(|level| *level > SILENT) {
            return None;
        }
        let (lags, curve) = (self.lags, &mut self.curve);
        for m in 0..=lags {
            let older = lags - m;
            let last = |ear: usize| &running.powers[ear][running.powers[ear].len() - 1 - lags..];
            let (left, right) = (last(0), last(1));
            let of =
                |product: f32, one: f32, other: f32| product / (one * other).sqrt().max(f32::MIN_POSITIVE);
            curve[lags + m] = of(running.products[0][older], left[older], right[lags]);
            curve[lags - m] = of(running.products[1][older], left[lags], right[older]);
        }
        let coherence = curve[1..2 * lags].iter().copied().fold(0.0, f32::max);
        let above = (coherence - running.floor) / (1.0 - running.floor);
        // Silence in one ear makes 0/0.
        if above.is_nan() || above <= 0.0 {
            return None;
        }
        let above = f64::from(above);
        let weight = above * above;
        cues.curve.resize(curve.len(), 0.0);
        for (sum, value) in cues.curve.iter_mut().zip(curve.iter()) {
            *sum += weight * f64::from(*value);
        }
        for (sum, term) in cues.weights.iter_mut().zip([1.0, weight, above]) {
            *sum += weight * term;
        }
        if above <= FOR_LEVELS {
            return None;
        }
        let [left, right] = running.levels.map(f64::from);
        cues.levels[0] += 1.0;
        cues.levels[1] += 10.0 * (left / right).log10();
        cues.levels[2] += above;
        Some(10.0 * (left + right).log10())
    }
}

impl Running {
    /// The correlations after some more samples: `hair` and `power` have one row each, for this band and all others.
    fn advance(&mut self, band: usize, lags: usize, hair: &[[f32; 2 * BANDS]], power: &[[f32; 2 * BANDS]]) {
        let part = 1.0 - self.keep;
        for ear in 0..2 {
            let lane = ear * BANDS + band;
            for values in [&mut self.ears[ear], &mut self.powers[ear]] {
                let past = values.len() - lags - 1;
                values.drain(..past);
            }
            let mut smooth = self.powers[ear].last().copied().unwrap_or_default();
            for (hair, power) in hair.iter().zip(power) {
                smooth = self.keep * smooth + part * hair[lane] * hair[lane];
                self.levels[ear] = self.keep * self.levels[ear] + part * power[lane];
                self.ears[ear].push(hair[lane]);
                self.powers[ear].push(smooth);
            }
        }
        for ear in 0..2 {
            let products = &mut self.products[ear][..=lags];
            for n in 0..hair.len() {
                // This ear's past with the other ear now.
                let now = part * self.ears[1 - ear][lags + 1 + n];
                let past = &self.ears[ear][n + 1..=n + 1 + lags];
                for (product, past) in products.iter_mut().zip(past) {
                    *product = self.keep * *product + now * past;
                }
            }
        }
    }
}
