//! How mathematics is written: the small pieces of an equation, in Unicode and in LaTeX.
//!
//! In: names and texts. Out: pieces of one line of mathematics. Invariant: everything that comes from a program
//! (names, labels, expressions) is escaped where LaTeX would read it as a command.

use crate::ids::VariableId;
use crate::model::Model;

/// How mathematics is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Notation {
    /// For terminals and comments.
    Unicode,
    /// For papers.
    Latex,
}

impl Notation {
    /// One of two spellings.
    pub(super) fn choose<'t>(self, unicode: &'t str, latex: &'t str) -> &'t str {
        match self {
            Notation::Unicode => unicode,
            Notation::Latex => latex,
        }
    }

    /// A variable, as mathematics prints it.
    pub(super) fn name(self, model: &Model, id: VariableId) -> String {
        let variable = &model.variables[id];
        let base = match self {
            Notation::Latex if variable.name.chars().count() > 1 => {
                format!("\\mathit{{{}}}", escaped(&variable.name))
            }
            _ => variable.name.clone(),
        };
        match variable.previous_of {
            None => base,
            Some(_) => format!("{base}{}", self.choose("⁻¹", "^{-1}")),
        }
    }

    /// Names of several variables.
    pub(super) fn names(self, model: &Model, ids: &[VariableId]) -> Vec<String> {
        ids.iter().map(|id| self.name(model, *id)).collect()
    }

    /// A value's name, or an expression as it was written.
    pub(super) fn label(self, text: &str) -> String {
        let number = text.parse::<f64>().is_ok();
        let letter = text.chars().count() == 1 && text.chars().all(char::is_alphabetic);
        match self {
            Notation::Unicode => text.replace("^-1", "⁻¹"),
            Notation::Latex if number || letter => text.to_owned(),
            Notation::Latex => format!("\\text{{{}}}", escaped(text)),
        }
    }

    /// `X = x`.
    pub(super) fn item(self, name: &str, value: &str) -> String {
        format!("{name} = {value}")
    }

    /// The likelihood that virtual evidence gives.
    pub(super) fn likelihood(self, variable: &str) -> String {
        format!("{}({variable})", self.choose("λ", "\\lambda"))
    }

    /// `P(left | right)`.
    pub(super) fn distribution(self, left: &[String], right: &[String]) -> String {
        let list = |items: &[String]| {
            let separator = match items.iter().any(|item| item.contains('=')) {
                true => ", ",
                false => self.choose(" ", "\\,"),
            };
            items.join(separator)
        };
        match right.is_empty() {
            true => format!("P({})", list(left)),
            false => format!("P({} {} {})", list(left), self.choose("|", "\\mid"), list(right)),
        }
    }

    /// `Σ_X`, with the blank behind it.
    pub(super) fn sum(self, over: &[String]) -> String {
        match self {
            Notation::Unicode if over.len() == 1 => format!("Σ_{} ", over[0]),
            Notation::Unicode => format!("Σ_{{{}}} ", over.join(" ")),
            Notation::Latex => format!("\\sum_{{{}}} ", over.join("\\,")),
        }
    }

    /// `∫_X`, with the blank behind it.
    pub(super) fn integral(self, over: &[String]) -> String {
        self.sum(over).replacen("Σ", "∫", 1).replacen("\\sum", "\\int", 1)
    }

    /// `Π_i`, with the blank behind it.
    pub(super) fn product(self, over: &str) -> String {
        match self {
            Notation::Unicode => format!("Π_{over} "),
            Notation::Latex => format!("\\prod_{{{}}} ", self.label(over)),
        }
    }

    /// `max_X`, with the blank behind it.
    pub(super) fn extremum(self, what: &str, over: &[String]) -> String {
        match self {
            Notation::Unicode if over.len() == 1 => format!("{what}_{} ", over[0]),
            Notation::Unicode => format!("{what}_{{{}}} ", over.join(" ")),
            Notation::Latex => {
                format!("{}_{{{}}} ", if what == "max" { "\\max" } else { "\\arg\\max" }, over.join("\\,"))
            }
        }
    }

    /// One distribution over another.
    pub(super) fn ratio(self, above: &str, below: &str) -> String {
        let simple = |text: &str| {
            text.starts_with("P(") && text.matches('(').count() == 1
                || text.chars().all(char::is_alphanumeric)
        };
        let group = |text: &str| if simple(text) { text.to_owned() } else { format!("({text})") };
        match self {
            Notation::Unicode => format!("{} / {}", group(above), group(below)),
            Notation::Latex => format!("\\frac{{{above}}}{{{below}}}"),
        }
    }

    /// A term over its normaliser: `(1/P(K)) …`.
    pub(super) fn over(self, body: &str, below: &str) -> String {
        match self {
            Notation::Unicode => format!("1/{below} · {body}"),
            Notation::Latex => format!("\\frac{{1}}{{{below}}} {body}"),
        }
    }
}

/// A text in which LaTeX reads no command.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '_' | '{' | '}' | '&' | '%' | '#' | '$' => escaped.extend(['\\', character]),
            '^' => escaped.push_str("\\^{}"),
            '~' => escaped.push_str("\\~{}"),
            '\\' => escaped.push_str("\\textbackslash{}"),
            '<' | '>' | '|' => escaped.extend(['$', character, '$']),
            _ => escaped.push(character),
        }
    }
    escaped
}
