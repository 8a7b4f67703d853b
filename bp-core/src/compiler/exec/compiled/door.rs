//! The runtime of the builders and answers of emitted questions: values of domains, and their positions in arrays.
//!
//! In: values as a program writes them. Out: numbers, and positions in arrays. Invariant: only errors allocate.

use crate::bins::holding;
use crate::error::Error;
use crate::radix;

/// A value of a domain, in Rust: a boolean, an integer, a real, or a value of an enum that the macro makes from labels.
pub trait Value: Copy {
    /// Its number in the program.
    fn number(self) -> f64;
    /// The value with this number.
    fn of(number: f64) -> Self;
}

impl Value for bool {
    #[inline]
    fn number(self) -> f64 {
        f64::from(u8::from(self))
    }
    #[inline]
    fn of(number: f64) -> Self {
        number != 0.0
    }
}

impl Value for f64 {
    #[inline]
    fn number(self) -> f64 {
        self
    }
    #[inline]
    fn of(number: f64) -> Self {
        number
    }
}

impl Value for i64 {
    #[inline]
    fn number(self) -> f64 {
        self as f64
    }
    #[inline]
    fn of(number: f64) -> Self {
        number as i64
    }
}

impl Value for usize {
    #[inline]
    fn number(self) -> f64 {
        self as f64
    }
    #[inline]
    fn of(number: f64) -> Self {
        number as usize
    }
}

/// The value of a required input.
///
/// # Errors
/// It is missing.
#[inline]
pub fn needed<V>(value: Option<V>, name: &str) -> Result<V, Error> {
    value.ok_or_else(|| missing(name))
}

#[cold]
fn missing(name: &str) -> Error {
    Error::input(name, format!("it was not given, and it has no default; call `.{name}(…)` before asking"))
}

/// The position of a value among `count` whole numbers from `first` on.
#[inline]
pub fn whole(value: impl Value, first: i64, count: usize) -> Option<usize> {
    let place = value.number() - first as f64;
    (place >= 0.0 && place < count as f64 && place.fract() == 0.0).then_some(place as usize)
}

/// The bin that holds a number.
pub fn bin(number: f64, edges: &[f64], circle: bool) -> Option<usize> {
    holding(edges, circle, number)
}

/// The row-major position of several values, the last one fastest; each comes with its position and its count.
#[inline]
pub fn place(values: &[(Option<usize>, usize)]) -> Option<usize> {
    radix::position_inside(values.iter().map(|(value, count)| Some(((*value)?, *count))))
}

/// The cells of an array at some values; empty where one of them is not in its domain. The axes after the values (those
/// of the plate) are included whole.
#[inline]
pub fn cells<'c, T>(array: &'c [T], values: &[(Option<usize>, usize)]) -> &'c [T] {
    let contexts: usize = values.iter().map(|(_, count)| *count).product();
    let each = array.len() / contexts.max(1);
    let found = place(values).and_then(|place| array.get(place * each..(place + 1) * each));
    found.unwrap_or_default()
}

/// The cell of an array at some values; `None` where one of them is not in its domain.
#[inline]
pub fn cell<T: Copy>(array: &[T], values: &[(Option<usize>, usize)]) -> Option<T> {
    array.get(place(values)?).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_found_by_value() {
        // Two values of a boolean, three integers from 4 on, and a plate of two.
        let array: Vec<f64> = (0..12).map(f64::from).collect();
        let at =
            |first: bool, second: i64| cells(&array, &[(whole(first, 0, 2), 2), (whole(second, 4, 3), 3)]);
        assert_eq!((at(false, 4), at(true, 5)), (&[0.0, 1.0][..], &[8.0, 9.0][..]));
        assert!(at(true, 7).is_empty() && at(true, 3).is_empty() && at(true, i64::MIN).is_empty());
        assert_eq!(cell(&array, &[(whole(5i64, 4, 3), 3)]), Some(1.0));
        assert_eq!(bin(1.0, &[0.0, 1.0, 10.0], false), Some(1));
        assert_eq!(whole(f64::NAN, 0, 2), None);
    }
}
