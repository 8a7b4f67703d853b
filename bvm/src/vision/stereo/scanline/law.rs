//! The parameters of `models/scanline.bp`, as numbers.
//!
//! In: the program's parameters. Out: the likelihood of a cost at the true disparity, up to a factor common to all
//! disparities, and the probability of a jump. All other costs are uniform and uninformative:
//!
//! ```text
//! P(Cost | D = d) ∝ (1 − hidden) · beta · e^(−beta c) · largest + hidden ∝ e^(−beta c) + floor,    c = Cost[d]
//! ```

use crate::programs::scanline;
use bp_core::compiler::model::Parameter;
use std::f32::consts::LN_2;
use std::f64::consts::LOG2_E;

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
        let model = scanline::model();
        let number = |name: &str| {
            let parameter = model.parameters.values().find(|parameter| parameter.name == name);
            parameter.and_then(Parameter::default_number).expect("internal: a parameter of the program")
        };
        let (beta, hidden) = (number("beta"), number("hidden"));
        Self {
            beta,
            floor: hidden / ((1.0 - hidden) * beta * number("largest")),
            slant: number("slant"),
            jump: number("jump"),
            edge: number("edge"),
            half: number("half"),
        }
    }

    /// The likelihood of a cost, up to a factor.
    #[cfg(test)]
    pub(super) fn likelihood(&self, cost: f64) -> f64 {
        (-self.beta * cost).exp() + self.floor
    }

    /// [`Law::likelihood`] of many costs, with a relative error of 1e-4 at most: 2^t is its whole part as the exponent of
    /// a number, times the polynomial that fits 2^f for −½ ≤ f ≤ ½.
    #[inline(always)]
    pub(super) fn likelihoods(&self, costs: &[u8], likelihoods: &mut [f32]) {
        /// A number of this magnitude has no fractional bits.
        const WHOLE: f32 = 12_582_912.0;
        let (scale, floor) = ((-self.beta * LOG2_E) as f32, self.floor as f32);
        for (likelihood, cost) in likelihoods.iter_mut().zip(costs) {
            let power = f32::from(*cost) * scale;
            let shifted = power + WHOLE;
            let f = power - (shifted - WHOLE);
            let part = 1.0 + f * (LN_2 + f * (0.240_153_6 + f * (0.055_833_2 + f * 0.009_016_1)));
            *likelihood = f32::from_bits(part.to_bits().wrapping_add(shifted.to_bits() << 23)) + floor;
        }
    }

    /// The probability that a surface ends between two pixels of this contrast, grey levels.
    pub(super) fn jump(&self, contrast: f64) -> f64 {
        self.jump + (self.edge - self.jump) * contrast / (contrast + self.half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_likelihoods_are_those_of_one() {
        let law = Law::of_the_program();
        let costs: Vec<u8> = (0..=255).collect();
        let mut found = [0f32; 256];
        law.likelihoods(&costs, &mut found);
        for (cost, found) in costs.iter().zip(found) {
            let expected = law.likelihood(f64::from(*cost));
            assert!((f64::from(found) / expected - 1.0).abs() < 1e-4, "{cost}: {found} is not {expected}");
        }
    }
}
