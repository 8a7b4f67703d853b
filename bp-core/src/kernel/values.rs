//! Values that the host gives: which numbers an input may hold, and which ordinal a kernel reads for each.
//!
//! In: the domain of the variable of which an input holds values. Out: [`Values`]. Invariant: a host gives values as the
//! program writes them (the sum 9, the angle 37.5); a kernel reads ordinals, from 0; whoever binds inputs converts.

use super::Extent;
use crate::bins::Bins;

/// The values that an input may hold.
#[derive(Clone, PartialEq, Debug)]
pub struct Values {
    /// The variable of which they are values.
    pub variable: String,
    /// Its domain, as the program writes it; behind it, which number a label is.
    pub domain: String,
    /// The numbers.
    pub numbers: Numbers,
}

/// Numbers that are values of a domain.
#[derive(Clone, PartialEq, Debug)]
pub enum Numbers {
    /// Whole numbers from `first` on, as many as the extents multiply to; the ordinal is the distance from `first`.
    Whole {
        /// The first of them.
        first: i64,
        /// How many: three extents for the cells of a grid, else one.
        count: Vec<Extent>,
    },
    /// Numbers of a line or a circle in bins; the ordinal is that of the bin.
    Bins(Bins),
    /// Finite reals, which are read as they are.
    Real,
}
