//! The law of `models/scanline.bp`, as numbers.
//!
//! In: the program's parameters. Out: the likelihood of a cost at the pixel's own disparity, up to a factor that all
//! disparities share, and the probability of a jump. All other costs are uniform and say nothing:
//!
//! ```text
//! P(Cost | D = d) ∝ (1 − hidden) · beta · e^(−beta c) · largest + hidden ∝ e^(−beta c) + floor,    c = Cost[d]
//! ```

use crate::programs::scanline;

/// Numbers of a line.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Law {
    beta: f64,
    floor: f64,
    pub(super) slant: f64,
    jump: f64,
    edge: f64,
    half: f64,
}

impl Law {
    /// The law with the program's own parameters.
    pub(in super::super) fn of_the_program() -> Self {
        let (beta, hidden) = (scanline::DEFAULT_BETA, scanline::DEFAULT_HIDDEN);
        Self {
            beta,
            floor: hidden / ((1.0 - hidden) * beta * scanline::DEFAULT_LARGEST),
            slant: scanline::DEFAULT_SLANT,
            jump: scanline::DEFAULT_JUMP,
            edge: scanline::DEFAULT_EDGE,
            half: scanline::DEFAULT_HALF,
        }
    }

    /// The likelihood of a cost, up to a factor.
    pub(super) fn likelihood(&self, cost: f64) -> f64 {
        (-self.beta * cost).exp() + self.floor
    }

    /// The probability that a surface ends between two pixels of this contrast, grey levels.
    pub(super) fn jump(&self, contrast: f64) -> f64 {
        self.jump + (self.edge - self.jump) * contrast / (contrast + self.half)
    }
}
