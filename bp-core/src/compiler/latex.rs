//! Text in LaTeX.
//!
//! In: any text. Out: escaped text, for text mode or, as a name, for mathematics. Invariant: the output is ASCII if
//! LaTeX has a command for the character, so that any engine reads it; letters of other scripts stay and need an engine
//! that reads Unicode.

/// Greek letters with commands of their own; the other capitals look like Latin ones.
const GREEK: &str = "αalpha βbeta γgamma δdelta εvarepsilon ζzeta ηeta θtheta ιiota κkappa λlambda μmu νnu ξxi πpi ρrho \
    σsigma τtau υupsilon φvarphi χchi ψpsi ωomega ΓGamma ΔDelta ΘTheta ΛLambda ΞXi ΠPi ΣSigma ΥUpsilon ΦPhi ΨPsi ΩOmega";

/// Symbols in mathematics.
const SIGNS: [(char, &str); 16] = [
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

/// A name in mathematics: one letter as it is, more of them as one word.
pub fn name(text: &str) -> String {
    let mut characters = text.chars();
    match (characters.next(), characters.next()) {
        (Some(letter), None) if letter.is_ascii_alphanumeric() => text.to_owned(),
        (Some(letter), None) if command(letter).is_some() => command(letter).unwrap_or_default(),
        _ if text.is_ascii() => format!("\\mathit{{{}}}", escaped(text)),
        _ => format!("\\textit{{{}}}", escaped(text)),
    }
}

#[cfg(test)]
mod tests {
    use super::{escaped, name};

    #[test]
    fn commands_become_text() {
        assert_eq!(escaped("a_b & 50% \\x{y}"), "a\\_b \\& 50\\% \\textbackslash{}x\\{y\\}");
        assert_eq!(escaped("V^-1 < 3"), "V\\textasciicircum{}-1 $<$ 3");
        assert_eq!(escaped("K = Σ Hᵀ"), "K = $\\Sigma$ H$^{\\top}$");
    }

    #[test]
    fn names_in_mathematics() {
        let names = ["X", "Rain", "a_1", "ρ", "ρmax", "été", "_"].map(name);
        let expected = [
            "X",
            "\\mathit{Rain}",
            "\\mathit{a\\_1}",
            "\\rho",
            "\\textit{$\\rho$max}",
            "\\textit{été}",
            "\\mathit{\\_}",
        ];
        assert_eq!(names, expected);
    }
}
