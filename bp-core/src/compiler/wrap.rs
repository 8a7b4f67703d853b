//! Line wrapping for a terminal.
//!
//! In: words. Out: lines of at most [`WIDTH`] columns. Invariant: lines break only at blanks; a single word that is too
//! long is not broken.

/// The width of a terminal.
pub const WIDTH: usize = 80;

/// A text in lines; the first starts with `head`, the others are indented by `hang` blanks.
pub fn wrapped(head: &str, text: &str, hang: usize) -> String {
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

/// An equation in lines: a distribution, and the terms after a sum sign, are not broken if they fit.
pub fn wrapped_equation(head: &str, equation: &str, hang: usize) -> String {
    const KEPT: char = '\u{a0}';
    let mut kept = String::with_capacity(equation.len());
    // For each open bracket, whether it belongs to a name before it.
    let mut open: Vec<bool> = Vec::new();
    for (at, character) in equation.char_indices() {
        let word = equation[..at].rsplit([' ', '(']).next().unwrap_or("");
        match character {
            '(' => open.push(word.ends_with(char::is_alphanumeric)),
            '[' => open.push(true),
            ')' | ']' => drop(open.pop()),
            _ => {}
        }
        let whole = open.contains(&true) || word.starts_with(['Σ', 'Π', '∫']);
        kept.push(if character == ' ' && whole { KEPT } else { character });
    }
    let fits = |word: &str| hang + columns(word) <= WIDTH;
    let words: Vec<_> = kept
        .split(' ')
        .map(|word| if fits(word) { word.to_owned() } else { word.replace(KEPT, " ") })
        .collect();
    wrapped(head, &words.join(" "), hang).replace(KEPT, " ")
}

/// The width of a text in columns; characters of Chinese, Japanese and Korean are two columns wide.
pub fn columns(text: &str) -> usize {
    let is_wide = |character: char| {
        matches!(character as u32, 0x1100..=0x115f | 0x2e80..=0xa4cf | 0xac00..=0xd7a3 | 0xf900..=0xfaff
            | 0xfe30..=0xfe6f | 0xff00..=0xff60 | 0xffe0..=0xffe6 | 0x1f300..=0x1faff | 0x20000..=0x3fffd)
    };
    text.chars().map(|character| if is_wide(character) { 2 } else { 1 }).sum()
}

/// A text, padded with blanks to a width.
pub fn filled(text: &str, width: usize) -> String {
    format!("{text}{}", " ".repeat(width.saturating_sub(columns(text))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distribution_stays_whole() {
        let text = format!("P(A | B) = {}", "Σ_C P(Weather | Wind Pressure) ".repeat(4));
        let lines = wrapped_equation("  ", &text, 6);
        assert!(lines.lines().count() > 1 && lines.lines().all(|line| columns(line) <= WIDTH));
        let rest: Vec<_> = lines.lines().skip(1).collect();
        assert!(rest.iter().all(|line| line.starts_with("      Σ_C P(")), "{lines}");
    }

    #[test]
    fn words_that_are_too_long_are_broken() {
        let lines = wrapped_equation("", &format!("P({})", "Variable ".repeat(20)), 4);
        assert!(lines.lines().all(|line| columns(line) <= WIDTH), "{lines}");
    }
}
