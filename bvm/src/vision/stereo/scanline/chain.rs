//! One step along a chain of disparities, the recurrence of `models/scanline.bp`.
//!
//! In: the unnormalised message of a pixel, and the probability that the surface ends before the next one. Out: the
//! prediction for the next pixel. With a(d) the message, A its sum, j the probability of a jump, s that of one
//! disparity up (and down), and n disparities,
//!
//! ```text
//! m(d) = (1 − j) · [(1 − 2s) a(d) + s a(d − 1) + s a(d + 1)] / A + j / n,      a(−1) = a(0), a(n) = a(n − 1)
//! ```
//!
//! which is Σ_i P(D = d | D^-1 = i) a(i) / A in O(n) rather than O(n²): the disparity after a jump is uniform, and
//! without a jump it changes by at most one. The matrix is symmetric, so the step backward is the same. A forward pass,
//! a backward pass and the evidence of the pixel itself make the exact posterior of a line (Baum et al. 1970).
//! Invariant: sums are in sixteen lanes in a fixed order, so every instruction set gives the same bits.

use super::super::lanes::{LANES, across, both};
use nalgebra::{RealField, convert};

/// A step of the chain over `levels` disparities.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<T> {
    levels: usize,
    slant: T,
}

impl<T: RealField + Copy> Step<T> {
    pub(super) fn new(levels: usize, slant: f64) -> Self {
        Self { levels, slant: convert(slant) }
    }

    /// Length of a message: the disparities, padded with zeros to whole vectors.
    pub(super) fn stride(&self) -> usize {
        self.levels.next_multiple_of(LANES)
    }

    /// Length of [`Step::carry`]: a message with a neighbour on either side.
    pub(super) fn carried(&self) -> usize {
        self.stride() + 2
    }

    /// The first pixel has a uniform message.
    #[inline(always)]
    pub(super) fn begin(&self, message: &mut [T]) {
        message.fill(T::one() / convert(self.levels as f64));
    }

    /// Keeps evidence · message for the next step; returns its sum.
    #[inline(always)]
    pub(super) fn carry(&self, evidence: &[T], message: &[T], carried: &mut [T]) -> T {
        let own = evidence.as_chunks().0.iter().zip(message.as_chunks().0);
        let beliefs = carried[1..=evidence.len()].as_chunks_mut().0.iter_mut();
        let mut lanes = [T::zero(); LANES];
        for (belief, (evidence, message)) in beliefs.zip(own) {
            *belief = both(evidence, message, |evidence, message| evidence * message);
            lanes = both(&lanes, belief, |lane, belief| lane + belief);
        }
        carried[0] = carried[1];
        carried[self.levels + 1] = carried[self.levels];
        across(lanes)
    }

    /// The message to the next pixel, before which the surface ends with the probability `jump`.
    #[inline(always)]
    pub(super) fn advance(&self, carried: &[T], total: T, jump: T, message: &mut [T]) {
        let goes_on = (T::one() - jump) / total;
        let aside = goes_on * self.slant;
        let here = goes_on - aside - aside;
        let anywhere = jump / convert(self.levels as f64);
        for (at, message) in message.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let window = &carried[at * LANES..][..LANES + 2];
            for lane in 0..LANES {
                let neighbours = window[lane] + window[lane + 2];
                message[lane] = here * window[lane + 1] + aside * neighbours + anywhere;
            }
        }
    }
}

/// The posterior of every pixel of one line, given its evidence (`stride` values each, zeros in the fill) and the
/// probabilities of a jump before each pixel but the first.
#[cfg(test)]
fn posterior<T: RealField + Copy>(step: Step<T>, evidence: &[T], jumps: &[T]) -> Vec<T> {
    let stride = step.stride();
    let count = evidence.len() / stride;
    let mut carried = vec![T::zero(); step.carried()];
    let mut message = vec![T::zero(); stride];
    let mut beliefs = evidence.to_vec();
    let mut pass = |order: &mut dyn Iterator<Item = (usize, Option<usize>)>| {
        let mut total = T::one();
        for (pixel, jump) in order {
            match jump {
                Some(jump) => step.advance(&carried, total, jumps[jump - 1], &mut message),
                None => step.begin(&mut message),
            }
            let own = &evidence[pixel * stride..][..stride];
            total = step.carry(own, &message, &mut carried);
            beliefs[pixel * stride..][..stride].iter_mut().zip(&message).for_each(|(b, m)| *b *= *m);
        }
    };
    pass(&mut (0..count).map(|pixel| (pixel, (pixel > 0).then_some(pixel))));
    pass(&mut (0..count).rev().map(|pixel| (pixel, (pixel + 1 < count).then_some(pixel + 1))));
    for belief in beliefs.chunks_exact_mut(stride) {
        let total: T = belief.iter().fold(T::zero(), |sum, value| sum + *value);
        belief.iter_mut().for_each(|value| *value /= total);
    }
    beliefs
}

#[cfg(test)]
mod tests {
    use super::super::Law;
    use super::*;
    use crate::programs::scanline;
    use bp_core::compiler::answer::ask_over_time;
    use bp_core::compiler::exec::Inputs;
    use bp_core::compiler::sample::Sampling;
    /// Costs and contrasts of a line, at random; a jump of the best disparity in the middle.
    fn line(seed: u64, levels: usize, count: usize) -> (Vec<f64>, Vec<f64>) {
        let mut state = seed;
        // Linear congruence; Knuth's multiplier.
        let mut below = |most: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % most
        };
        let best = |at: usize| if at / levels < count / 2 { 1 } else { levels - 2 };
        let costs: Vec<f64> = (0..levels * count)
            .map(|at| below(if at % levels == best(at) { 30 } else { 157 }) as f64)
            .collect();
        (costs, (0..count).map(|_| below(256) as f64).collect())
    }

    /// The answer of the program, by the interpreter's forward and backward pass over its own matrices.
    fn asked(levels: usize, costs: &[f64], contrasts: &[f64]) -> Vec<f64> {
        let model = scanline::model();
        let (_, question) = model.questions.iter().next().unwrap();
        let instants: Vec<Vec<(String, f64)>> = (costs.chunks(levels).zip(contrasts))
            .map(|(costs, contrast)| {
                let costs = costs.iter().enumerate().map(|(k, cost)| (format!("Cost[{k}]"), *cost));
                costs.chain([("Contrast".to_owned(), *contrast)]).collect()
            })
            .collect();
        let inputs = Inputs::new().size("M", levels - 1).number("M", (levels - 1) as f64);
        let answers = ask_over_time(&model, question, &instants, &inputs, Sampling::default()).unwrap();
        answers[0].answer.iter().map(|row| row.p().unwrap()).collect()
    }

    #[test]
    fn a_line_s_posterior_is_the_program_s() {
        let law = Law::of_the_program();
        for (seed, levels, count) in [(1, 5, 12), (2, 8, 9), (3, 13, 6), (4, 2, 7), (5, 16, 1)] {
            let (costs, contrasts) = line(seed, levels, count);
            let step = Step::new(levels, law.slant);
            let mut evidence = vec![0.0; count * step.stride()];
            for (own, costs) in evidence.chunks_exact_mut(step.stride()).zip(costs.chunks(levels)) {
                own.iter_mut().zip(costs).for_each(|(own, cost)| *own = law.likelihood(*cost));
            }
            let jumps: Vec<f64> = contrasts[1..].iter().map(|contrast| law.jump(*contrast)).collect();
            let found = posterior(step, &evidence, &jumps);
            let found: Vec<f64> =
                found.chunks(step.stride()).flat_map(|row| row[..levels].to_vec()).collect();
            let expected = asked(levels, &costs, &contrasts);
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-9, "{levels} levels: {found} is not {expected}");
            }
            // The same in the precision of the matcher.
            let single: Vec<f32> = evidence.iter().map(|value| *value as f32).collect();
            let jumps: Vec<f32> = jumps.iter().map(|jump| *jump as f32).collect();
            let single = posterior(Step::new(levels, law.slant), &single, &jumps);
            let single = single.chunks(step.stride()).flat_map(|row| row[..levels].to_vec());
            assert!(single.zip(&found).all(|(one, other)| (f64::from(one) - other).abs() < 1e-5));
        }
    }

    #[test]
    fn a_step_by_hand() {
        // Without a jump half of the probability stays and a quarter goes either way; at the ends that quarter stays.
        let step = Step::new(3, 0.25);
        let mut carried = vec![0.0; step.carried()];
        let (mut evidence, mut message) = ([0.0f64; LANES], [1.0; LANES]);
        evidence[..3].copy_from_slice(&[4.0, 2.0, 2.0]);
        assert_eq!(step.carry(&evidence, &message, &mut carried), 8.0);
        step.advance(&carried, 8.0, 0.0, &mut message);
        assert_eq!(message[..3], [3.5 / 8.0, 2.5 / 8.0, 2.0 / 8.0]);
        step.advance(&carried, 8.0, 0.6, &mut message);
        assert!((message[0] - (0.4 * 3.5 / 8.0 + 0.2)).abs() < 1e-15);
    }
}
