//! Execution of kernels: inputs, outputs, and the back ends.
//!
//! In: a [`Kernel`](crate::kernel::Kernel) and [`Inputs`]. Out: [`Outputs`]. Invariant: every buffer's length is
//! checked against the kernel once, in [`Inputs`]' binding; after that no back end can fail.

pub mod compiled;
mod guarded;
mod inputs;
mod interpreter;
mod lanes;
pub mod scalar;
pub mod values;

pub use guarded::Guarded;
pub(crate) use guarded::beyond_range;
#[cfg(feature = "gpu")]
pub(crate) use inputs::{Array, Bound};
pub use inputs::{Inputs, Outputs};
pub use interpreter::interpret;
pub use lanes::Lanes;

/// The error of a set, or of a bound of a range, without a size.
pub(crate) const SIZE_NOT_GIVEN: &str =
    "its size was not given: give the number of its elements, or a table with a row for each";
