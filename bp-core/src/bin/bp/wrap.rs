//! Text in lines that fit a terminal.
//!
//! In: words. Out: lines of at most [`WIDTH`] columns. Invariant: lines break at blanks only; a single word that is too
//! long stays whole.

/// The columns of a terminal.
pub(crate) const WIDTH: usize = 80;

/// A text in lines; the first starts with `head`, the others with as many blanks as `hang` says.
pub(crate) fn wrapped(head: &str, text: &str, hang: usize) -> String {
    let mut lines = String::new();
    let mut line = head.to_owned();
    let mut empty = true;
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        if !empty && columns(&line) + 1 + columns(word) > WIDTH {
            lines.push_str(line.trim_end());
            lines.push('\n');
            line = " ".repeat(hang);
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(word);
        empty = false;
    }
    lines.push_str(line.trim_end());
    lines.push('\n');
    lines
}

/// The columns that a text takes.
pub(crate) fn columns(text: &str) -> usize {
    text.chars().count()
}

/// A text, filled with blanks to a width.
pub(crate) fn filled(text: &str, width: usize) -> String {
    format!("{text}{}", " ".repeat(width.saturating_sub(columns(text))))
}
