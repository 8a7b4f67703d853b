//! The tokens of text of the language, for its mathematics.
//!
//! In: an expression, a head or a question as text. Out: its words, numbers and signs; the text with names replaced.
//! Invariant: any text has tokens; a name is replaced as a whole.

use crate::spelling::quoted;
use std::collections::HashMap;

/// Words of the language that stand between names.
pub(super) const WORDS: [&str; 14] = [
    "and", "or", "not", "in", "if", "else", "with", "at", "from", "virtual", "soft", "nearest", "except",
    "over",
];

/// The kind of a token.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    Word,
    Number,
    Sign,
}

/// A token.
#[derive(Clone, Debug)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) text: String,
    /// Whether a blank precedes it.
    pub(super) apart: bool,
}

/// The tokens of a text; quotes of names are left out.
pub(super) fn tokens(text: &str) -> Vec<Token> {
    let (mut found, mut rest, mut apart) = (Vec::new(), text, false);
    while let Some(first) = rest.chars().next() {
        if first.is_whitespace() {
            (rest, apart) = (&rest[first.len_utf8()..], true);
            continue;
        }
        let while_ = |is: &dyn Fn(char) -> bool| rest.find(|letter| !is(letter)).unwrap_or(rest.len());
        let (kind, length) = match first {
            '"' => (Kind::Word, rest[1..].find('"').map_or(rest.len(), |end| end + 2)),
            '0'..='9' => {
                let mut length = while_(&|letter| letter.is_ascii_alphanumeric() || letter == '_');
                if let Some(fraction) = rest[length..].strip_prefix('.')
                    && fraction.starts_with(|letter: char| letter.is_ascii_digit())
                {
                    let digits = fraction.find(|letter: char| !letter.is_ascii_alphanumeric());
                    length += 1 + digits.unwrap_or(fraction.len());
                }
                if rest[..length].ends_with(['e', 'E']) && rest[length..].starts_with(['-', '+']) {
                    let digits = rest[length + 1..].find(|letter: char| !letter.is_ascii_digit());
                    length += 1 + digits.unwrap_or(rest.len() - length - 1);
                }
                (Kind::Number, length)
            }
            '_' => (Kind::Word, while_(&|letter| letter.is_alphanumeric() || letter == '_')),
            _ if first.is_alphabetic() => {
                (Kind::Word, while_(&|letter| letter.is_alphanumeric() || letter == '_'))
            }
            _ => {
                let long = ["^-1", "..=", "==", "!=", "<=", ">=", "=>"];
                let sign = long.iter().find(|sign| rest.starts_with(**sign));
                (Kind::Sign, sign.map_or(first.len_utf8(), |sign| sign.len()))
            }
        };
        let text = rest[..length].trim_matches('"').to_owned();
        found.push(Token { kind, text, apart });
        (rest, apart) = (&rest[length..], false);
    }
    found
}

/// Text of the language with names replaced; `X^-1` is a name, a name before a bracket is a function.
pub(super) fn substituted(text: &str, values: &HashMap<String, String>) -> String {
    let all = tokens(text);
    let mut shown = String::with_capacity(text.len());
    let mut at = 0;
    while let Some(token) = all.get(at) {
        at += 1;
        let previous = all.get(at).is_some_and(|next| next.text == "^-1");
        let call = all.get(at).is_some_and(|next| next.text == "(" && !next.apart);
        let key = match previous {
            true => format!("{}^-1", quoted(&token.text)),
            false => quoted(&token.text).into_owned(),
        };
        if token.apart {
            shown.push(' ');
        }
        match values.get(&key) {
            Some(value) if token.kind == Kind::Word && !call => {
                at += usize::from(previous);
                shown.push_str(value);
            }
            _ if token.kind == Kind::Word
                && !WORDS.contains(&token.text.as_str())
                && token.text != "match" =>
            {
                match token.text.as_str() {
                    plain @ ("true" | "false" | "_" | "P") => shown.push_str(plain),
                    name => shown.push_str(&quoted(name)),
                }
            }
            _ => shown.push_str(&token.text),
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::substituted;

    #[test]
    fn names_have_values() {
        let values =
            [("X", "true"), ("Y^-1", "(2)")].map(|(name, value)| (name.to_owned(), value.to_owned()));
        let values = values.into_iter().collect();
        assert_eq!(substituted("f(X + Y^-1 * Y, X(1))", &values), "f(true + (2) * Y, X(1))");
    }
}
