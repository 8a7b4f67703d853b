//! Text of the language as mathematics: `sigma_v * X^-1[0]` has a σ with an index, and a raised −1.
//!
//! In: an expression, the head of a factor, a form or a question, in the spelling of the language. Out: the same in a
//! notation, on one line. Invariant: every token of the text is shown, in order; only `if` and `match` put a value before
//! its condition. A blank outside braces (outside elements, in MathML) is a possible line break.

use super::Notation;
use super::notation::operator;
use crate::latex;
use crate::spelling::quoted;
use crate::xml;
use std::collections::HashMap;

/// Words of the language that stand between names.
const WORDS: [&str; 14] = [
    "and", "or", "not", "in", "if", "else", "with", "at", "from", "virtual", "soft", "nearest", "except",
    "over",
];

/// Functions with signs of their own in LaTeX.
const OPERATORS: [&str; 7] = ["exp", "ln", "min", "max", "sin", "cos", "arg"];

impl Notation {
    /// Text of the language as mathematics.
    pub fn typeset(self, text: &str) -> String {
        match self {
            Notation::Unicode => unicode(text),
            _ => Setter { notation: self, tokens: tokens(text), at: 0 }.until(&[]),
        }
    }
}

/// The text with the signs of mathematics that a terminal has.
fn unicode(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let quoted = if first == '"' { rest[1..].find('"').map(|end| end + 2) } else { None };
        let signs = [
            ("^-1", "⁻¹"),
            ("<=", "≤"),
            (">=", "≥"),
            ("!=", "≠"),
            ("==", "="),
            (" * ", " · "),
            ("..=", " … "),
        ];
        let sign = signs.iter().find(|(sign, _)| rest.starts_with(sign));
        let length = quoted.or(sign.map(|(sign, _)| sign.len())).unwrap_or(first.len_utf8());
        shown.push_str(sign.map_or(&rest[..length], |(_, shown)| shown));
        rest = &rest[length..];
    }
    shown
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Word,
    Number,
    Sign,
}

#[derive(Clone, Debug)]
struct Token {
    kind: Kind,
    text: String,
    /// Whether a blank precedes it.
    apart: bool,
}

fn tokens(text: &str) -> Vec<Token> {
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

struct Setter {
    notation: Notation,
    tokens: Vec<Token>,
    at: usize,
}

impl Setter {
    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.at)
    }

    fn is(&self, sign: &str) -> bool {
        self.peek().is_some_and(|token| token.kind == Kind::Sign && token.text == sign)
    }

    fn is_word(&self, word: &str) -> bool {
        self.peek().is_some_and(|token| token.kind == Kind::Word && token.text == word)
    }

    fn take(&mut self, sign: &str) {
        if self.is(sign) {
            self.at += 1;
        }
    }

    /// Everything up to one of these signs, which is not taken.
    fn until(&mut self, ends: &[&str]) -> String {
        let mut parts: Vec<String> = Vec::new();
        // Whether the last part is an operand, which a blank separates from the next.
        let mut operand = false;
        while let Some(token) = self.peek().cloned() {
            if token.kind == Kind::Sign && ends.contains(&token.text.as_str()) {
                break;
            }
            self.at += 1;
            let apart = token.apart && operand;
            let (part, is_operand) = match (token.kind, token.text.as_str()) {
                (Kind::Number, text) => (self.notation.label(text), true),
                (Kind::Word, "if") => (self.choice(), true),
                (Kind::Word, "match") => (self.arms(), true),
                (Kind::Word, text) => self.word(text),
                (Kind::Sign, "^-1") => {
                    let below = parts.pop().unwrap_or_default();
                    parts.push(self.previous(&below));
                    operand = true;
                    continue;
                }
                (Kind::Sign, "[") if operand && !token.apart => {
                    let below = parts.pop().unwrap_or_default();
                    let index = self.until(&["]"]);
                    self.take("]");
                    parts.push(self.notation.element(&below, &index));
                    continue;
                }
                (Kind::Sign, "[") => (self.bracketed("[", "]"), true),
                (Kind::Sign, "(") => (self.bracketed("(", ")"), true),
                (Kind::Sign, text) => (self.sign(text, operand), false),
            };
            if apart && is_operand {
                parts.push(self.notation.choose(" ", "\\, ", "<mspace width=\"0.25em\"/> ").to_owned());
            }
            operand = is_operand;
            parts.push(part);
        }
        parts.concat()
    }

    fn bracketed(&mut self, open: &str, close: &str) -> String {
        let inside = self.until(&[close]);
        self.take(close);
        match self.notation {
            Notation::MathMl => {
                let bracket = |sign: &str, side: &str| {
                    format!("<mo stretchy=\"false\" form=\"{side}\">{}</mo>", xml::escaped(sign))
                };
                format!("{}{inside}{}", bracket(open, "prefix"), bracket(close, "postfix"))
            }
            _ => format!("{open}{inside}{close}"),
        }
    }

    fn previous(&self, name: &str) -> String {
        match self.notation {
            Notation::MathMl => format!("<msup><mrow>{name}</mrow><mrow><mo>−</mo><mn>1</mn></mrow></msup>"),
            _ => format!("{name}^{{-1}}"),
        }
    }

    /// Plain words.
    fn text(&self, words: &str) -> String {
        match self.notation {
            Notation::MathMl => format!("<mtext>{}</mtext>", xml::escaped(words).replace(' ', "\u{a0}")),
            _ => format!("\\text{{{}}}", latex::escaped(words)),
        }
    }

    /// A name, a word of the language, or the name of a function; and whether it is an operand.
    fn word(&mut self, text: &str) -> (String, bool) {
        let is_call = self.is("(") && !self.peek().is_some_and(|token| token.apart);
        if WORDS.contains(&text) {
            return (self.between(text), false);
        }
        if !is_call {
            return match text {
                "true" | "false" => (self.text(text), true),
                _ => (self.notation.word(text), true),
            };
        }
        let name = match self.notation {
            _ if text == "P" => self.notation.choose("P", "P", "<mi>P</mi>").to_owned(),
            Notation::MathMl => format!("<mi mathvariant=\"normal\">{}</mi>", xml::escaped(text)),
            _ if OPERATORS.contains(&text) => format!("\\{text}"),
            _ => format!("\\operatorname{{{}}}", latex::escaped(text)),
        };
        self.at += 1;
        (format!("{name}{}", self.bracketed("(", ")")), true)
    }

    /// A word between two operands.
    fn between(&self, word: &str) -> String {
        match self.notation {
            Notation::MathMl => {
                format!("<mspace width=\"0.3em\"/> <mtext>{word}</mtext><mspace width=\"0.3em\"/> ")
            }
            _ => format!("\\ \\text{{{word}}}\\ "),
        }
    }

    fn sign(&self, text: &str, binary: bool) -> String {
        let (latex, sign) = match text {
            "|" => (" \\mid ", "∣"),
            "*" => (" \\cdot ", "·"),
            "<=" => (" \\le ", "≤"),
            ">=" => (" \\ge ", "≥"),
            "!=" => (" \\ne ", "≠"),
            "==" | "=" => (" = ", "="),
            "<" => (" < ", "<"),
            ">" => (" > ", ">"),
            "=>" => (" \\mapsto ", "↦"),
            "..=" => (" \\ldots ", "…"),
            "+" => (" + ", "+"),
            "-" if binary => (" - ", "−"),
            "-" => ("-", "−"),
            "/" => (" / ", "/"),
            "," => (",\\, ", ","),
            ";" => (";\\quad ", ";"),
            ":" => ("\\colon ", ":"),
            "." => (".", "."),
            "{" => ("\\{", "{"),
            "}" => ("\\}", "}"),
            other => return self.text(other),
        };
        match self.notation {
            Notation::MathMl if matches!(text, "," | ";") => {
                format!("<mo separator=\"true\">{sign}</mo> ")
            }
            Notation::MathMl if text == "|" => "<mo stretchy=\"false\">∣</mo>".to_owned(),
            Notation::MathMl if text == "-" && !binary => "<mo form=\"prefix\">−</mo>".to_owned(),
            Notation::MathMl => operator(sign),
            _ => latex.to_owned(),
        }
    }

    /// `if c { a } else { b }`: a if c, else b.
    fn choice(&mut self) -> String {
        let condition = self.until(&["{"]);
        self.take("{");
        let then = self.until(&["}"]);
        self.take("}");
        let mut shown = format!("{then}{}{condition}", self.between("if"));
        if self.is_word("else") {
            self.at += 1;
            let otherwise = match self.is_word("if") {
                true => {
                    self.at += 1;
                    self.choice()
                }
                false => {
                    self.take("{");
                    let body = self.until(&["}"]);
                    self.take("}");
                    body
                }
            };
            shown = format!("{shown}{}{otherwise}", self.between("else"));
        }
        shown
    }

    /// `match x { A => a, _ => b }`: a if x = A, else b.
    fn arms(&mut self) -> String {
        let on = self.until(&["{"]);
        self.take("{");
        let mut shown = Vec::new();
        while self.peek().is_some() && !self.is("}") {
            let start = self.at;
            let pattern = self.until(&["=>", "}"]);
            let otherwise = self.tokens[start].text == "_";
            self.take("=>");
            let value = self.until(&[",", "}"]);
            self.take(",");
            shown.push(match otherwise {
                true => format!(
                    "{value}{}",
                    self.notation.choose(" otherwise", "\\ \\text{otherwise}", OTHERWISE)
                ),
                false => {
                    let holds = self.notation.relation(&on, "=", &pattern);
                    format!("{value}{}{holds}", self.between("if"))
                }
            });
        }
        self.take("}");
        shown.join(self.notation.choose("; ", ";\\quad ", "<mo separator=\"true\">;</mo> "))
    }
}

/// `otherwise` in MathML.
const OTHERWISE: &str = "<mspace width=\"0.3em\"/><mtext>otherwise</mtext>";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_the_language_becomes_mathematics() {
        let latex = |text: &str| Notation::Latex.typeset(text);
        assert_eq!(latex("tau_c * C^-1 + dt"), "\\tau_{c} \\cdot C^{-1} + \\mathit{dt}");
        assert_eq!(latex("P(Z[i] | V O)"), "P(Z_{i} \\mid V\\, O)");
        assert_eq!(latex("mu_tau[C] <= -2e-3"), "{\\mu_{\\tau}}_{C} \\le -2e-3");
        assert_eq!(
            latex("if Rain { 0.1 } else { 0.9 }"),
            "0.1\\ \\text{if}\\ \\mathit{Rain}\\ \\text{else}\\ 0.9"
        );
        assert_eq!(
            latex("match H { Go => 1, _ => exp(x) }"),
            "1\\ \\text{if}\\ H = \\mathit{Go};\\quad \\exp(x)\\ \\text{otherwise}"
        );
        assert_eq!(Notation::Unicode.typeset("X^-1 * 2 <= \"a <= b\""), "X⁻¹ · 2 ≤ \"a <= b\"");
    }

    #[test]
    fn names_have_values() {
        let values =
            [("X", "true"), ("Y^-1", "(2)")].map(|(name, value)| (name.to_owned(), value.to_owned()));
        let values = values.into_iter().collect();
        assert_eq!(substituted("f(X + Y^-1 * Y, X(1))", &values), "f(true + (2) * Y, X(1))");
    }

    #[test]
    fn mathml_is_well_formed() {
        for text in ["P(\"<5\" | X[i]^-1)", "if X < 3 { a } else if Y { b } else { -c }", "f(x, [1, 2])"] {
            let shown = format!("<math>{}</math>", Notation::MathMl.typeset(text));
            roxmltree::Document::parse(&shown).unwrap_or_else(|error| panic!("{shown}: {error}"));
        }
    }
}
