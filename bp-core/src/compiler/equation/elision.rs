//! Long lists with the middle omitted.
//!
//! In: the items of a list. Out: its first and last ones, and the number between them. Invariant: short lists are
//! unchanged; the text of a derivation is bounded for any number of variables.

use super::Notation;

/// A list of more items is shortened.
pub(super) const MANY: usize = 64;

/// Number of items shown first, and last.
const FIRST: usize = 24;
const LAST: usize = 2;

/// The shown positions, and the number of omitted ones after the first of them.
pub(super) fn shown(count: usize) -> (Vec<usize>, Option<usize>) {
    match count > MANY {
        false => ((0..count).collect(), None),
        true => ((0..FIRST).chain(count - LAST..count).collect(), Some(count - FIRST - LAST)),
    }
}

/// The shown items of a list, with a replacement for the others.
pub(super) fn list(
    count: usize,
    mut item: impl FnMut(usize) -> String,
    others: impl Fn(usize) -> String,
) -> Vec<String> {
    let (positions, left_out) = shown(count);
    let mut items: Vec<String> = positions.into_iter().map(&mut item).collect();
    if let Some(left_out) = left_out {
        items.insert(FIRST, others(left_out));
    }
    items
}

/// The items of a list of at most `most`, else the first of them, the number of the others, and the last.
pub(crate) fn elided(
    count: usize,
    most: usize,
    item: impl FnMut(usize) -> String,
    others: impl Fn(usize) -> String,
) -> Vec<String> {
    if count <= most {
        return (0..count).map(item).collect();
    }
    let kept = most.saturating_sub(1);
    let mut items: Vec<String> = (0..kept).chain(std::iter::once(count - 1)).map(item).collect();
    items.insert(kept, others(count - kept - 1));
    items
}

/// The replacement in an equation.
pub(super) fn dots(notation: Notation, left_out: usize, what: &str) -> String {
    let words = format!("… ({} more {what}) …", grouped(left_out));
    notation.text(&words, &format!("\\dots \\text{{ ({} more {what}) }} \\dots", grouped(left_out)))
}

/// A count with blanks between thousands, which do not break a line.
pub(super) fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (position, digit) in digits.chars().enumerate() {
        if position > 0 && (digits.len() - position).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_long_list_is_counted() {
        let item = |position: usize| position.to_string();
        assert_eq!(list(3, item, |_| unreachable!()), ["0", "1", "2"]);
        let long = list(100_000, item, |others| format!("{others} more"));
        assert_eq!((long.len(), long[24].as_str(), long[26].as_str()), (27, "99974 more", "99999"));
        assert_eq!((grouped(99_974), grouped(7)), ("99\u{202f}974".to_owned(), "7".to_owned()));
    }
}
