//! Checks values given by the host, and converts them to what kernels read.
//!
//! In: numbers of an input, and the domain that they are values of. Out: ordinals (reals unchanged), or an error that
//! names the input, the index, the number and the domain. Invariant: only valid values reach a kernel.

use super::scalar::Scalar;
use crate::bins::holding;
use crate::error::Error;
use pulp::NullaryFnOnce;
use std::borrow::Cow;

/// The values of one input.
#[derive(Clone, Copy, Debug)]
pub struct Domain<'d> {
    /// The name of the input.
    pub input: &'d str,
    /// Its variable.
    pub variable: &'d str,
    /// The domain of the variable, as text.
    pub text: &'d str,
    /// The numbers that are values.
    pub numbers: Numbers<'d>,
}

/// Numbers that are values of a domain whose size is known.
#[derive(Clone, Copy, Debug)]
pub enum Numbers<'d> {
    /// `count` whole numbers from `first` on.
    Whole {
        /// The first.
        first: i64,
        /// Their number.
        count: usize,
    },
    /// Numbers between edges, or on a circle.
    Bins {
        /// The edges, ascending.
        edges: &'d [f64],
        /// Whether the ends meet.
        circle: bool,
    },
    /// Finite numbers.
    Real,
}

impl Domain<'_> {
    /// The converted value.
    ///
    /// # Errors
    /// A number that is not a value of the domain.
    pub fn ordinal<T: Scalar>(&self, number: T) -> Result<T, Error> {
        self.find(number.to_f64()).map(T::from_f64).ok_or_else(|| self.refused(None, number.to_f64()))
    }

    /// The converted array: the array itself if values are their own ordinals.
    ///
    /// # Errors
    /// As [`Domain::ordinal`]; the error names the first index, counted from 0.
    pub fn ordinals<'n, T: Scalar>(&self, numbers: &'n [T]) -> Result<Cow<'n, [T]>, Error> {
        let valid = match self.numbers {
            Numbers::Whole { first: 0, count } => all(numbers, |number| number.is_below(count)),
            Numbers::Real => all(numbers, T::is_finite_number),
            Numbers::Whole { .. } | Numbers::Bins { .. } => {
                let ordinal = |(place, number): (usize, &T)| {
                    let number = number.to_f64();
                    let place = (numbers.len() > 1).then_some(place);
                    self.find(number).map(T::from_f64).ok_or_else(|| self.refused(place, number))
                };
                return numbers.iter().enumerate().map(ordinal).collect();
            }
        };
        let wrong = |number: &T| self.find(number.to_f64()).is_none();
        if !valid && let Some(place) = numbers.iter().position(wrong) {
            let at = (numbers.len() > 1).then_some(place);
            return Err(self.refused(at, numbers[place].to_f64()));
        }
        Ok(Cow::Borrowed(numbers))
    }

    fn find(&self, number: f64) -> Option<f64> {
        match self.numbers {
            Numbers::Whole { first, count } => {
                let ordinal = number - first as f64;
                let inside = number.fract() == 0.0 && ordinal >= 0.0 && ordinal < count as f64;
                inside.then_some(ordinal)
            }
            Numbers::Bins { edges, circle } => holding(edges, circle, number).map(|bin| bin as f64),
            Numbers::Real => number.is_finite().then_some(number),
        }
    }

    /// The error of an invalid number; indices of arrays are counted from 0.
    fn refused(&self, place: Option<usize>, number: f64) -> Error {
        let Domain { input, variable, text, .. } = self;
        let place = place.map_or_else(String::new, |place| format!("[{place}]"));
        Error::input(
            format!("{input}{place}"),
            format!("{number} is not a value of `{variable}`, which is {text}"),
        )
    }
}

/// A predicate to test on all these numbers.
struct All<'n, T, H> {
    numbers: &'n [T],
    holds: H,
}

impl<T: Scalar, H: Fn(T) -> bool> NullaryFnOnce for All<'_, T, H> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.numbers.iter().fold(true, |all, number| all & (self.holds)(*number))
    }
}

/// Whether a predicate is true for all these numbers; tested with the widest instructions of the processor.
fn all<T: Scalar>(numbers: &[T], holds: impl Fn(T) -> bool) -> bool {
    pulp::Arch::new().dispatch(All { numbers, holds })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn domain(numbers: Numbers<'_>) -> Domain<'_> {
        Domain { input: "s", variable: "Sum", text: "`2..=12`", numbers }
    }

    #[test]
    fn values_become_ordinals() {
        let whole = domain(Numbers::Whole { first: 2, count: 11 });
        assert_eq!((whole.ordinal(9.0).unwrap(), whole.ordinal(2f32).unwrap()), (7.0, 0.0));
        assert_eq!(*whole.ordinals(&[2.0, 12.0]).unwrap(), [0.0, 10.0]);
        let bins = domain(Numbers::Bins { edges: &[0.0, 1.0, 10.0], circle: false });
        assert_eq!(*bins.ordinals(&[0.5, 1.0, 10.0]).unwrap(), [0.0, 1.0, 1.0]);
        let circle = domain(Numbers::Bins { edges: &[0.0, 90.0, 180.0, 270.0, 360.0], circle: true });
        assert_eq!(circle.ordinal(-1.0).unwrap(), 3.0);
        let from_zero = domain(Numbers::Whole { first: 0, count: 2 });
        assert!(matches!(from_zero.ordinals(&[0.0, 1.0, -0.0]), Ok(Cow::Borrowed(_))));
    }

    #[test]
    fn values_outside_the_domain_are_refused_with_their_place() {
        let whole = domain(Numbers::Whole { first: 2, count: 11 });
        for number in [1.0, 13.0, 2.5, -1.0, 1e30, f64::NAN, f64::INFINITY] {
            let message = whole.ordinal(number).unwrap_err().to_string();
            assert!(
                message.contains("`s`") && message.contains("`Sum`") && message.contains("2..=12"),
                "{message}"
            );
            assert!(message.contains(&number.to_string()), "{message}");
            let message = whole.ordinals(&[3.0, number]).unwrap_err().to_string();
            assert!(message.contains("`s[1]`"), "{message}");
        }
        let from_zero = domain(Numbers::Whole { first: 0, count: 2 });
        for number in [2f32, 0.5, -1.0, 1e30, f32::NAN, f32::INFINITY, -1e-30] {
            let message = from_zero.ordinals(&[1.0, 0.0, number]).unwrap_err().to_string();
            assert!(message.contains("`s[2]`"), "{message}");
        }
        let real = domain(Numbers::Real);
        assert!(real.ordinals(&[1.0, f64::NAN]).is_err() && real.ordinal(f32::NEG_INFINITY).is_err());
        let bins = domain(Numbers::Bins { edges: &[0.0, 1.0, 10.0], circle: true });
        for number in [f64::NAN, f64::INFINITY] {
            assert!(bins.ordinal(number).is_err());
        }
    }
}
