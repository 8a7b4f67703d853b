//! Numbers, sizes and displacements, as values of Rust or as text.
//!
//! In: the value of a name. Out: its numbers; or an error that names both. Invariant: lists of lists are read row by row.

use super::Value;
use crate::error::Error;
use crate::units;

/// The parts of a list that is written in brackets: `[4, 4, 4]`; `None` for another text.
pub(super) fn listed_parts(text: &str) -> Option<std::str::Split<'_, char>> {
    Some(text.trim().strip_prefix('[')?.strip_suffix(']')?.split(','))
}

/// The parts of a value as texts; a list in a list has its elements separated by colons.
pub(super) fn words(value: &Value) -> Vec<String> {
    match value {
        Value::Label(text) => {
            let parts = listed_parts(text).unwrap_or_else(|| text.split(','));
            parts.map(|part| part.trim().to_owned()).collect()
        }
        Value::List(values) => values.iter().map(|value| words(value).join(":")).collect(),
        other => vec![other.to_string()],
    }
}

/// The numbers of a value.
pub(super) fn numbers(name: &str, value: &Value) -> Result<Vec<f64>, Error> {
    shaped(name, value).map(|(_, numbers)| numbers)
}

/// The lengths of the lists of a value, the outer one first, and its numbers.
pub(super) fn shaped(name: &str, value: &Value) -> Result<(Vec<usize>, Vec<f64>), Error> {
    match value {
        Value::List(values) => {
            of_rows(values.iter().map(|value| shaped(name, value)).collect::<Result<_, _>>()?)
                .ok_or_else(|| uneven(name))
        }
        Value::Real(number) if number.is_finite() => Ok((Vec::new(), vec![*number + 0.0])),
        Value::Integer(number) => Ok((Vec::new(), vec![*number as f64])),
        Value::Label(text) if text.starts_with('[') => listed_numbers(name, text),
        other => {
            let all: Vec<f64> =
                words(other).iter().map(|word| number(name, word)).collect::<Result<_, _>>()?;
            Ok((if all.len() == 1 { Vec::new() } else { vec![all.len()] }, all))
        }
    }
}

fn uneven(name: &str) -> Error {
    Error::input(name, "its rows have different lengths")
}

/// Rows of one shape together.
fn of_rows(rows: Vec<(Vec<usize>, Vec<f64>)>) -> Option<(Vec<usize>, Vec<f64>)> {
    let own = rows.first().map_or_else(Vec::new, |(shape, _)| shape.clone());
    let is_even = rows.iter().all(|(shape, _)| *shape == own);
    let shape = [vec![rows.len()], own].concat();
    is_even.then(|| (shape, rows.into_iter().flat_map(|(_, numbers)| numbers).collect()))
}

/// The numbers of a list, `[1, 2]`, or of a list of rows of one length, `[[1, 0.5], [0.5, 2]]`, row by row, with its shape.
fn listed_numbers(name: &str, text: &str) -> Result<(Vec<usize>, Vec<f64>), Error> {
    let wrong =
        || Error::input(name, format!("`{text}` is not a list of numbers, such as `[[1, 0.5], [0.5, 2]]`"));
    let inner = text.trim().strip_prefix('[').and_then(|inner| inner.strip_suffix(']'));
    let inner = inner.ok_or_else(wrong)?.trim();
    if !inner.contains(['[', ']']) {
        let all: Vec<f64> =
            inner.split(',').map(|word| number(name, word.trim())).collect::<Result<_, _>>()?;
        return Ok((vec![all.len()], all));
    }
    let (mut depth, mut from, mut rows) = (0, 0, Vec::new());
    for (at, character) in inner.char_indices().chain([(inner.len(), ',')]) {
        match character {
            '[' => depth += 1,
            ']' => depth -= 1,
            ',' if depth == 0 => {
                let row = inner[from..at].trim();
                rows.push(match row.starts_with('[') {
                    true => listed_numbers(name, row)?,
                    false => return Err(wrong()),
                });
                from = at + 1;
            }
            _ => {}
        }
    }
    if depth != 0 {
        return Err(wrong());
    }
    of_rows(rows).ok_or_else(|| uneven(name))
}

fn number(name: &str, text: &str) -> Result<f64, Error> {
    let finite = text.parse().ok().filter(|number: &f64| number.is_finite());
    // −0 is 0.
    let finite = finite.map(|number| number + 0.0);
    finite.ok_or_else(|| {
        let help = units::in_value(text).map_or_else(String::new, |help| format!(": {help}"));
        Error::input(name, format!("`{text}` is not a finite number{help}"))
    })
}

pub(super) fn one_size(name: &str, value: &Value) -> Result<usize, Error> {
    size(name, &words(value).join(","))
}

pub(super) fn size(name: &str, text: &str) -> Result<usize, Error> {
    const MOST: usize = 1 << 40;
    let size = text.parse().ok().filter(|size| (1..=MOST).contains(size));
    size.ok_or_else(|| {
        Error::input(name, format!("`{text}` is not a whole number of elements from 1 to {MOST}"))
    })
}

/// A displacement: `-1`, or `0:1:-2` along the three axes of the grid.
pub(super) fn displacement(name: &str, text: &str) -> Result<[i32; 3], Error> {
    let wrong = || Error::input(name, format!("`{text}` is not a displacement, such as `-1` or `0:1:-2`"));
    let parts: Vec<i32> =
        text.split(':').map(|part| part.parse().map_err(|_| wrong())).collect::<Result<_, _>>()?;
    let mut displacement = [0; 3];
    displacement.get_mut(..parts.len()).ok_or_else(wrong)?.copy_from_slice(&parts);
    Ok(displacement)
}
