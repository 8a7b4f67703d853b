//! The channels of a recording: what makes them no pair of ears.
//!
//! In: frames of two channels. Out: the reason why a look has no direction ([`Channels::fault`]), and warnings.
//! Invariant: memory does not grow with the length of a look.
//!
//! The channels are correlated at about 8 kHz over lags of up to 10 ms. Two ears of one head differ by less than a
//! millisecond; a longer delay is that of a device, and a negative correlation is a wire that is exchanged.

/// Rate of the correlation, Hz.
const RATE_HZ: f64 = 8000.0;
/// Longest lag, s.
const LONGEST_S: f64 = 10e-3;
/// Longest lag of two ears, s.
const EARS_S: f64 = 1.2e-3;
/// Least correlation that shows a fault, and by how much it exceeds that of ears.
const LEAST: f64 = 0.5;
const CLEARLY: f64 = 1.3;
/// Full scale, as a sample.
const FULL: f64 = 0.9999;
/// Share of the samples at full scale that is called clipping.
const CLIPPED: f64 = 1e-3;
/// Share of the power at frequency zero that is called an offset.
const OFFSET: f64 = 0.5;
/// Time constant of the high-pass before the correlation, s.
const SLOW_S: f64 = 10e-3;

/// Statistics of two channels.
#[derive(Clone, Debug)]
pub struct Channels {
    every: usize,
    rate_hz: f64,
    phase: usize,
    pair: [f64; 2],
    slow: [f64; 2],
    past: [Vec<f64>; 2],
    products: Vec<f64>,
    powers: [f64; 2],
    differ: bool,
    frames: f64,
    sums: [f64; 2],
    squares: [f64; 2],
    full: f64,
}

impl Channels {
    /// Nothing heard, at a sampling rate in Hz.
    pub fn new(rate_hz: f64) -> Channels {
        let every = ((rate_hz / RATE_HZ) as usize).max(1);
        let rate_hz = rate_hz / every as f64;
        let lags = (LONGEST_S * rate_hz) as usize;
        Channels {
            every,
            rate_hz,
            phase: 0,
            pair: [0.0; 2],
            slow: [0.0; 2],
            past: [vec![0.0; lags + 1], vec![0.0; lags + 1]],
            products: vec![0.0; 2 * lags + 1],
            powers: [0.0; 2],
            differ: false,
            frames: 0.0,
            sums: [0.0; 2],
            squares: [0.0; 2],
            full: 0.0,
        }
    }

    /// Adds frames.
    pub fn add(&mut self, left: &[f64], right: &[f64]) {
        for (left, right) in left.iter().zip(right) {
            let frame = [*left, *right];
            self.frames += 1.0;
            self.differ |= left != right;
            if frame.iter().any(|value| value.abs() >= FULL) {
                self.full += 1.0;
            }
            for (channel, value) in frame.iter().enumerate() {
                self.sums[channel] += value;
                self.squares[channel] += value * value;
                self.pair[channel] += value / self.every as f64;
            }
            self.phase += 1;
            if self.phase == self.every {
                self.phase = 0;
                self.correlate();
            }
        }
    }

    fn correlate(&mut self) {
        let lags = self.products.len() / 2;
        for channel in 0..2 {
            let value = std::mem::take(&mut self.pair[channel]);
            self.slow[channel] += (value - self.slow[channel]) / (SLOW_S * self.rate_hz);
            let fast = value - self.slow[channel];
            self.powers[channel] += fast * fast;
            self.past[channel].rotate_right(1);
            self.past[channel][0] = fast;
        }
        let [left, right] = &self.past;
        for lag in 0..=lags {
            // The left channel leads by the lag.
            self.products[lags + lag] += left[lag] * right[0];
            if lag > 0 {
                self.products[lags - lag] += left[0] * right[lag];
            }
        }
    }

    /// Why these channels have no direction.
    pub fn fault(&self) -> Option<String> {
        if self.squares == [0.0; 2] {
            return Some("silence".to_owned());
        }
        if let Some(channel) = self.squares.iter().position(|square| *square == 0.0) {
            return Some(format!("the {} channel is silent", ["left", "right"][channel]));
        }
        if !self.differ {
            return Some("both channels are the same to the bit: one sound without any cue".to_owned());
        }
        let scale = (self.powers[0] * self.powers[1]).sqrt();
        if scale == 0.0 {
            return None;
        }
        let lags = self.products.len() / 2;
        let seconds = |at: usize| (at as f64 - lags as f64) / self.rate_hz;
        let best = (0..self.products.len()).max_by(|a, b| self.products[*a].total_cmp(&self.products[*b]))?;
        let within = |at: &usize| seconds(*at).abs() <= EARS_S;
        let ears = (0..self.products.len()).filter(within).map(|at| self.products[at]).fold(0.0, f64::max);
        let least = self.products.iter().copied().fold(0.0, f64::min);
        let most = self.products[best];
        if -least > LEAST * scale && -least > CLEARLY * most {
            return Some(
                "one channel has inverted polarity: exchange its wires, or multiply it by −1".to_owned(),
            );
        }
        if !within(&best) && most > LEAST * scale && most > CLEARLY * ears {
            let late = if seconds(best) > 0.0 { "right" } else { "left" };
            return Some(format!(
                "the {late} channel is {:.1} ms late, which is the delay of a device and no direction",
                seconds(best).abs() * 1e3
            ));
        }
        None
    }

    /// What may disturb the cues.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.full > CLIPPED * self.frames {
            warnings.push(format!(
                "{:.1} % of the frames are at full scale: clipped?",
                100.0 * self.full / self.frames
            ));
        }
        for (channel, name) in ["left", "right"].iter().enumerate() {
            let mean = self.sums[channel] / self.frames.max(1.0);
            if mean * mean > OFFSET * self.squares[channel] / self.frames.max(1.0) && mean != 0.0 {
                warnings.push(format!("the {name} channel has an offset of {mean:.3}"));
            }
        }
        warnings
    }
}
