//! Text in LaTeX.
//!
//! In: any text. Out: escaped text, for text mode or, as a name, for mathematics. Invariant: the output is ASCII if
//! LaTeX has a command for the character, so that any engine reads it; letters of other scripts stay and need an engine
//! that reads Unicode: [`unset`] finds them.

/// Greek letters with commands of their own; the other capitals look like Latin ones.
const GREEK: &str = "αalpha βbeta γgamma δdelta εvarepsilon ζzeta ηeta θtheta ιiota κkappa λlambda μmu νnu ξxi πpi ρrho \
    σsigma τtau υupsilon φvarphi χchi ψpsi ωomega ΓGamma ΔDelta ΘTheta ΛLambda ΞXi ΠPi ΣSigma ΥUpsilon ΦPhi ΨPsi ΩOmega";

/// Symbols in mathematics.
const SIGNS: [(char, &str); 28] = [
    ('−', "-"),
    ('·', "\\cdot"),
    ('×', "\\times"),
    ('∈', "\\in"),
    ('∝', "\\propto"),
    ('≤', "\\le"),
    ('≥', "\\ge"),
    ('≠', "\\ne"),
    ('∞', "\\infty"),
    ('∫', "\\int"),
    ('∅', "\\emptyset"),
    ('ᵀ', "^{\\top}"),
    ('⁻', "^{-}"),
    ('¹', "^{1}"),
    ('²', "^{2}"),
    ('…', "\\ldots"),
    ('₊', "_{+}"),
    ('ₙ', "_{n}"),
    ('ₜ', "_{t}"),
    ('ⁿ', "^{n}"),
    ('√', "\\surd"),
    ('→', "\\to"),
    ('←', "\\leftarrow"),
    ('≈', "\\approx"),
    ('∼', "\\sim"),
    ('½', "\\tfrac{1}{2}"),
    ('³', "^{3}"),
    ('∪', "\\cup"),
];

/// The command of a character in mathematics.
fn command(character: char) -> Option<String> {
    let greek = GREEK.split_whitespace().find_map(|word| word.strip_prefix(character));
    let sign = || SIGNS.iter().find(|(sign, _)| *sign == character).map(|(_, command)| (*command).to_owned());
    greek.map(|name| format!("\\{name}")).or_else(sign)
}

/// An escaped text, for text mode.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match (character, command(character)) {
            (_, Some(command)) => escaped.push_str(&format!("${command}$")),
            ('_' | '{' | '}' | '&' | '%' | '#' | '$', _) => escaped.extend(['\\', character]),
            ('^', _) => escaped.push_str("\\textasciicircum{}"),
            ('~', _) => escaped.push_str("\\textasciitilde{}"),
            ('\\', _) => escaped.push_str("\\textbackslash{}"),
            ('<' | '>' | '|', _) => escaped.extend(['$', character, '$']),
            _ if character.is_control() => escaped.push(' '),
            _ => escaped.push(character),
        }
    }
    escaped
}

/// Punctuation that pdfLaTeX sets without a package.
const PUNCTUATION: &str = "–—‘’‚“”„†‡•…‰‹›€™";

/// The first word of a document that pdfLaTeX cannot set, because it has letters of a script for which it has no fonts, such
/// as Chinese or Cyrillic. Comments are not set.
pub fn unset(document: &str) -> Option<&str> {
    let is_set = |character: char| (character as u32) < 0x180 || PUNCTUATION.contains(character);
    let lines = document.lines().filter(|line| !line.starts_with('%'));
    let mut words = lines
        .flat_map(|line| line.split(|character: char| character.is_ascii_punctuation() || character == ' '));
    words.find(|word| !word.chars().all(is_set))
}

/// The Greek letter that a word spells: `epsilon`, `Omega`.
pub fn letter(word: &str) -> Option<char> {
    GREEK.split_whitespace().find_map(|entry| {
        let letter = entry.chars().next()?;
        let name = &entry[letter.len_utf8()..];
        (name == word || name.strip_prefix("var") == Some(word)).then_some(letter)
    })
}

/// A name of one letter with an index: `tau_c` is τ with the index c.
pub fn indexed(text: &str) -> Option<(&str, &str)> {
    let (base, below) = text.split_once('_')?;
    let is_letter = base.chars().count() == 1 || letter(base).is_some();
    (is_letter && !below.is_empty() && !below.starts_with('_') && !below.ends_with('_'))
        .then_some((base, below))
}

/// A name in mathematics: one letter as it is, more of them as one word; a spelled-out Greek letter as that letter, what
/// follows its underscore as an index.
pub fn name(text: &str) -> String {
    if let Some(letter) = letter(text) {
        return command(letter).unwrap_or_default();
    }
    if let Some((base, below)) = indexed(text) {
        return format!("{}_{{{}}}", name(base), name(below));
    }
    let mut characters = text.chars();
    match (characters.next(), characters.next()) {
        (Some(letter), None) if letter.is_ascii_alphanumeric() => text.to_owned(),
        (Some(letter), None) if command(letter).is_some() => command(letter).unwrap_or_default(),
        _ if text.chars().all(|character| character.is_ascii_digit()) => text.to_owned(),
        _ if text.is_ascii() && !text.contains(['<', '>', '|', '^', '~', '\\']) => {
            format!("\\mathit{{{}}}", escaped(text))
        }
        _ => format!("\\textit{{{}}}", escaped(text)),
    }
}

/// A distribution that is not longer is kept on one line.
const KEPT: usize = 44;

/// Mathematics between whose parts TeX may break a line: at the blanks outside braces, but not in a short `P(…)`, nor
/// between a sum sign and what it sums. (TeX itself breaks after relations and operators.)
pub fn breakable(mathematics: &str) -> String {
    let mut broken = String::with_capacity(mathematics.len() + 64);
    let (mut depth, mut piece, mut at) = (0_usize, 0, 0);
    while let Some(character) = mathematics[at..].chars().next() {
        let rest = &mathematics[at..];
        let alone = !broken.ends_with(|before: char| before.is_alphanumeric() || before == '\\');
        if depth == 0
            && alone
            && rest.starts_with("P(")
            && let Some(end) = closing(&rest[1..])
            && printed(&rest[..end + 2]) <= KEPT
        {
            broken.push_str(&format!("{{{}}}", &rest[..end + 2]));
            at += end + 2;
            continue;
        }
        let control = character == '\\' && rest[1..].starts_with(|next: char| !next.is_alphabetic());
        let length = if control {
            1 + rest[1..].chars().next().map_or(0, char::len_utf8)
        } else {
            character.len_utf8()
        };
        match (character, control) {
            ('{', false) => depth += 1,
            ('}', false) => depth = depth.saturating_sub(1),
            _ => {}
        }
        at += length;
        if depth > 0 || !(character == ' ' || &rest[..length] == "\\ ") {
            broken.push_str(&rest[..length]);
            continue;
        }
        broken.push_str(&rest[..length]);
        let (before, after) = (broken[piece..].trim(), mathematics[at..].trim_start());
        let sign = ["\\sum", "\\prod", "\\int", "\\max", "\\arg", "\\frac"]
            .iter()
            .any(|sign| before.starts_with(sign));
        if !sign && !is_operator(before) && !begins_operator(after) && !before.is_empty() && !after.is_empty()
        {
            broken.push_str("\\allowbreak ");
        }
        piece = broken.len();
    }
    broken
}

/// Signs after which TeX breaks a line.
const BREAKING: [&str; 14] = [
    "=", "<", ">", "+", "-", "\\cdot", "\\le", "\\ge", "\\ne", "\\in", "\\mid", "\\propto", "\\sim",
    "\\approx",
];

fn is_operator(piece: &str) -> bool {
    BREAKING.contains(&piece.trim_start_matches('&'))
}

fn begins_operator(text: &str) -> bool {
    text.split([' ', '{']).next().is_some_and(is_operator)
}

/// The place of the bracket that closes the one at the start.
fn closing(text: &str) -> Option<usize> {
    let mut open = 0;
    for (at, character) in text.char_indices() {
        match character {
            '(' => open += 1,
            ')' => open -= 1,
            _ => {}
        }
        if open == 0 {
            return Some(at);
        }
    }
    None
}

/// The approximate number of letters of mathematics as printed.
pub fn printed(piece: &str) -> usize {
    let (mut width, mut command) = (0, false);
    for character in piece.chars() {
        if character == '\\' {
            width += usize::from(!command);
            command = true;
            continue;
        }
        command = command && character.is_alphabetic();
        width += usize::from(!command && !matches!(character, '{' | '}' | '_' | '^' | ' ' | '&'));
    }
    width
}

#[cfg(test)]
mod tests {
    use super::{breakable, escaped, name};

    #[test]
    fn lines_break_between_factors() {
        let equation = "P(A \\mid B) = \\frac{1}{P(B)} \\sum_{C} P(A \\mid C) P(C)";
        let expected = "{P(A \\mid B)} = \\frac{1}{P(B)} \\sum_{C} {P(A \\mid C)} \\allowbreak {P(C)}";
        assert_eq!(breakable(equation), expected);
        // A long distribution may be broken between its variables.
        let long = format!("P({}Z)", "\\mathit{Weather}\\, ".repeat(9));
        assert_eq!(breakable(&long).matches("\\allowbreak").count(), 9);
        assert_eq!(breakable("a\\ \\text{if}\\ b").matches("\\allowbreak").count(), 2);
    }

    #[test]
    fn commands_become_text() {
        assert_eq!(escaped("a_b & 50% \\x{y}"), "a\\_b \\& 50\\% \\textbackslash{}x\\{y\\}");
        assert_eq!(escaped("V^-1 < 3"), "V\\textasciicircum{}-1 $<$ 3");
        assert_eq!(escaped("K = Σ Hᵀ"), "K = $\\Sigma$ H$^{\\top}$");
    }

    #[test]
    fn names_in_mathematics() {
        let names =
            ["X", "Rain", "a_1", "ρ", "ρmax", "été", "_", "tau_c", "Omega", "hit_rate", "<5"].map(name);
        let expected = [
            "X",
            "\\mathit{Rain}",
            "a_{1}",
            "\\rho",
            "\\textit{$\\rho$max}",
            "\\textit{été}",
            "\\mathit{\\_}",
            "\\tau_{c}",
            "\\Omega",
            "\\mathit{hit\\_rate}",
            "\\textit{$<$5}",
        ];
        assert_eq!(names, expected);
    }
}
