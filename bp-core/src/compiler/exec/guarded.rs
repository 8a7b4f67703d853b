//! Guarded runs of a kernel: in f64 if that is sufficient, else with separate exponents.
//!
//! In: a kernel and its inputs in f64. Out: its outputs. Invariant: a result of 0 comes from the program, not from
//! underflow; whether a kernel runs again depends only on its outputs, not on the number of threads.

use super::scalar::{Extended, Scalar};
use super::{Inputs, Lanes, Outputs};
use crate::error::Error;
use crate::kernel::OutputKey;

/// A total below this may have lost terms: 2⁻⁵¹².
const SMALLEST_TOTAL: f64 = f64::from_bits((1023 - 512) << 52);

/// The result of a guarded run.
#[derive(Clone, PartialEq, Debug)]
pub struct Guarded {
    /// The outputs.
    pub outputs: Outputs<f64>,
    /// The same with separate exponents, if they were computed so.
    pub extended: Option<Outputs<Extended>>,
    /// The extent of each axis of each output.
    pub extents: Vec<Vec<usize>>,
}

impl Lanes {
    /// Runs the kernel in f64, and again with separate exponents if a total is below 2⁻⁵¹² or a number is not finite;
    /// with separate exponents from the start if `log` is set.
    ///
    /// # Errors
    /// As [`Lanes::run`].
    pub fn run_guarded(&self, inputs: &Inputs<'_, f64>, log: bool) -> Result<Guarded, Error> {
        if !log {
            let (outputs, extents) = self.run_shaped(inputs)?;
            if outputs.arrays.iter().all(|(key, cells)| is_safe(*key, cells)) {
                return Ok(Guarded { outputs, extended: None, extents });
            }
        }
        let (extended, extents) = self.run_shaped(&inputs.extended())?;
        let is_beyond = |(key, cells): &(OutputKey, Vec<Extended>)| {
            cells.iter().any(|cell| match key {
                OutputKey::Total => cell.is_beyond(),
                OutputKey::LnEvidence => cell.exponential().is_beyond(),
                OutputKey::Ask(_) | OutputKey::Law(_) | OutputKey::Moment(_) => false,
            })
        };
        if extended.arrays.iter().any(is_beyond) {
            return Err(beyond_range());
        }
        let rounded = |(key, cells): &(OutputKey, Vec<Extended>)| {
            (*key, cells.iter().map(|cell| cell.to_f64()).collect())
        };
        let outputs = Outputs { arrays: extended.arrays.iter().map(rounded).collect() };
        Ok(Guarded { outputs, extended: Some(extended), extents })
    }
}

/// The error that a probability is below the smallest number above 0.
pub(crate) fn beyond_range() -> Error {
    Error::Number {
        form: "P(evidence)".to_owned(),
        context: String::new(),
        message: "it is beyond the range of numbers, but not zero: an observation lies more than 10¹⁸ deviations from \
                  what the program expects; check its unit"
            .to_owned(),
    }
}

fn is_safe(key: OutputKey, cells: &[f64]) -> bool {
    cells.iter().all(|cell| match key {
        OutputKey::Total => cell.is_finite() && *cell >= SMALLEST_TOTAL,
        OutputKey::LnEvidence => cell.is_finite() && *cell >= SMALLEST_TOTAL.ln(),
        OutputKey::Ask(_) | OutputKey::Law(_) | OutputKey::Moment(_) => cell.is_finite(),
    })
}
