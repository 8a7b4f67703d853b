//! Hugin potentials given by expressions instead of a table.
//!
//! In: the text of `model_data`: an expression for each combination of the model's nodes. Out: their rows, if they
//! consist of numbers: `Distribution (0.9, 0.1)`, and `Normal (mean, variance)` over intervals. Invariant: an
//! expression that is not read is reported, never guessed.

use crate::law::Law;

/// The row of each expression, for a variable with this number of values; for intervals, with these bounds. Otherwise
/// the text that is not supported.
pub(super) fn rows(text: &str, entries: usize, bounds: Option<&[f64]>) -> Result<Vec<Vec<f64>>, String> {
    let inside = text.trim().strip_prefix('(').and_then(|rest| rest.strip_suffix(')'));
    let inside = inside.ok_or_else(|| "expected `(…)`".to_owned())?;
    parts(inside).into_iter().map(|expression| row(expression.trim(), entries, bounds)).collect()
}

fn row(expression: &str, entries: usize, bounds: Option<&[f64]>) -> Result<Vec<f64>, String> {
    let unread = || {
        let short: String = expression.chars().take(40).collect();
        format!("`{short}` is not read")
    };
    let (name, rest) = expression.split_once('(').ok_or_else(unread)?;
    let arguments = rest.trim_end().strip_suffix(')').ok_or_else(unread)?;
    let numbers: Option<Vec<f64>> =
        parts(arguments).into_iter().map(|part| part.trim().parse().ok()).collect();
    match (name.trim(), numbers.as_deref(), bounds) {
        ("Distribution", Some(numbers), _) if numbers.len() == entries => Ok(numbers.to_vec()),
        ("Normal", Some(&[mean, variance]), Some(bounds)) if variance > 0.0 && mean.is_finite() => {
            let cumulative = |bound: f64| match bound {
                f64::NEG_INFINITY => 0.0,
                f64::INFINITY => 1.0,
                bound => Law::Normal.cumulative(bound, &[mean, variance.sqrt()]),
            };
            let masses: Vec<f64> =
                bounds.windows(2).map(|pair| cumulative(pair[1]) - cumulative(pair[0])).collect();
            let total: f64 = masses.iter().sum();
            match total > 0.0 {
                true => Ok(masses.into_iter().map(|mass| mass / total).collect()),
                false => Err(unread()),
            }
        }
        _ => Err(unread()),
    }
}

/// The parts between the commas outside brackets.
fn parts(text: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0i32, 0, Vec::new());
    for (at, letter) in text.char_indices() {
        match letter {
            '(' => depth += 1,
            ')' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_and_nothing_else() {
        let two = rows("( Distribution (0.9, 0.1), Distribution(0.5,0.5) )", 2, None);
        assert_eq!(two, Ok(vec![vec![0.9, 0.1], vec![0.5, 0.5]]));
        let bounds = [f64::NEG_INFINITY, 0.0, 10.0, f64::INFINITY];
        let normal = rows("(Normal (5, 3))", 3, Some(&bounds)).unwrap();
        let expected = [TAIL, 1.0 - 2.0 * TAIL, TAIL];
        for (found, expected) in normal[0].iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        for wrong in [
            "",
            "(",
            "(Normal (A, 3))",
            "(NoisyOR (A, 0.2))",
            "(Normal (5, -3))",
            "(Distribution (1))",
            "(0.5)",
        ] {
            assert!(rows(wrong, 3, Some(&bounds)).is_err(), "{wrong}");
        }
    }

    /// Φ(−5/√3): mpmath, 30 digits.
    const TAIL: f64 = 0.001_946_208_561_389_315;
}
