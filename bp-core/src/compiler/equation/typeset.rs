//! Text of the language as mathematics: `sigma_v * X^-1[0]` has a σ with an index, and a raised −1.
//!
//! In: an expression, the head of a factor, a form or a question, in the spelling of the language. Out: the same in a
//! notation, on one line. Invariant: every token of the text is shown, in order; only `if` and `match` put a value before
//! its condition. A blank outside braces (outside elements, in MathML) is a possible line break.

use super::Notation;
use super::notation::operator;
use super::tokens::{Kind, Token, WORDS, tokens};
use crate::latex;
use crate::xml;

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
            ";" => (";\\, ", ";"),
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
    fn mathml_is_well_formed() {
        for text in ["P(\"<5\" | X[i]^-1)", "if X < 3 { a } else if Y { b } else { -c }", "f(x, [1, 2])"] {
            let shown = format!("<math>{}</math>", Notation::MathMl.typeset(text));
            roxmltree::Document::parse(&shown).unwrap_or_else(|error| panic!("{shown}: {error}"));
        }
    }
}
