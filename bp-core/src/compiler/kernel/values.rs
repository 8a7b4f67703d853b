//! Values given by the host: the valid numbers of an input, and the ordinal of each.
//!
//! In: the domain of the input's variable. Out: [`Values`]. Invariant: a host gives values as the program writes them
//! (the sum 9, the angle 37.5); a kernel reads ordinals, from 0; the binding of inputs converts.

use super::Extent;
use crate::bins::Bins;

/// The valid values of an input.
#[derive(Clone, PartialEq, Debug)]
pub struct Values {
    /// The variable of which they are values.
    pub variable: String,
    /// Its domain as in the program, followed by the numbers of labels.
    pub domain: String,
    /// The numbers.
    pub numbers: Numbers,
}

/// Numbers that are values of a domain.
#[derive(Clone, PartialEq, Debug)]
pub enum Numbers {
    /// Integers from `first` on, as many as the product of the extents; the ordinal is the difference from `first`.
    Whole {
        /// The first of them.
        first: i64,
        /// How many: three extents for the cells of a grid, else one.
        count: Vec<Extent>,
    },
    /// Numbers of a line or a circle in bins; the ordinal is that of the bin.
    Bins(Bins),
    /// Finite reals, which are read unchanged.
    Real,
}
