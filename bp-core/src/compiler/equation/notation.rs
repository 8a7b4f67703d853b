//! Notation: the small parts of an equation, in Unicode, in LaTeX and in MathML.
//!
//! In: names and texts. Out: pieces of one line of mathematics. Invariant: text from a program (names, labels,
//! expressions) is escaped for LaTeX and XML. In MathML a blank between two elements is a possible line break; there is
//! no other blank between elements.
//!
//! MathML Core, W3C 2025: presentation elements alone, as browsers draw them.

use super::elision;
use crate::ids::VariableId;
use crate::latex;
use crate::model::{DerivedKind, Factor, Model, VariableUse};
use crate::xml;

/// Brackets in MathML, as high as a letter.
pub(crate) const OPEN: &str = "<mo stretchy=\"false\" form=\"prefix\">(</mo>";
pub(crate) const CLOSE: &str = "<mo stretchy=\"false\" form=\"postfix\">)</mo>";

/// Number of variables above which `P(…)` may be broken.
const MANY: usize = 5;

/// Number of letters above which a fraction is too wide for a line.
const WIDE: usize = 72;

/// Number of letters under a sum sign above which they take another line.
const STACKED: usize = 14;

/// Number of distributions above which a fraction is too wide for a page.
const LONG: usize = 3;

/// The notation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Notation {
    /// For terminals and comments.
    Unicode,
    /// For papers.
    Latex,
    /// For browsers: the children of a `math` element.
    MathMl,
}

impl Notation {
    /// A piece in each notation.
    pub(crate) fn choose<'t>(self, unicode: &'t str, latex: &'t str, mathml: &'t str) -> &'t str {
        match self {
            Notation::Unicode => unicode,
            Notation::Latex => latex,
            Notation::MathMl => mathml,
        }
    }

    /// Text between the parts of an equation.
    pub(crate) fn text(self, unicode: &str, latex: &str) -> String {
        match self {
            Notation::Unicode => unicode.to_owned(),
            Notation::Latex => latex.to_owned(),
            Notation::MathMl => format!("<mtext>{}</mtext>", xml::escaped(unicode)),
        }
    }

    /// A variable in mathematics.
    pub(crate) fn name(self, model: &Model, id: VariableId) -> String {
        let variable = &model.variables[id];
        // A derived variable is named as its expression.
        let base = match (variable.derived, self) {
            (Some(_), Notation::Latex | Notation::MathMl) => self.typeset(&variable.name),
            _ => self.word(&variable.name),
        };
        match (variable.previous_of, self) {
            // `X > 2` is a name of several words.
            (None, _) if variable.derived.is_some_and(|kind| kind != DerivedKind::Element) => {
                self.group(&base)
            }
            (None, _) => base,
            (Some(_), Notation::Unicode) => format!("{base}⁻¹"),
            (Some(_), Notation::Latex) => format!("{base}^{{-1}}"),
            (Some(_), Notation::MathMl) => {
                format!("<msup>{base}<mrow><mo>−</mo><mn>1</mn></mrow></msup>")
            }
        }
    }

    /// A name in mathematics: letters by their own signs, others as words.
    pub(crate) fn word(self, name: &str) -> String {
        match self {
            Notation::Unicode => name.to_owned(),
            Notation::Latex => latex::name(name),
            Notation::MathMl => match (latex::letter(name), latex::indexed(name)) {
                (Some(letter), _) => format!("<mi>{letter}</mi>"),
                (None, Some((base, below))) => {
                    format!("<msub>{}{}</msub>", self.word(base), self.word(below))
                }
                _ if name.chars().all(|character| character.is_ascii_digit()) => format!("<mn>{name}</mn>"),
                _ if name.chars().count() > 1 => {
                    format!("<mi class=\"name\">{}</mi>", xml::escaped(name))
                }
                _ => format!("<mi>{}</mi>", xml::escaped(name)),
            },
        }
    }

    /// Names of several variables.
    pub(crate) fn names(self, model: &Model, ids: &[VariableId]) -> Vec<String> {
        ids.iter().map(|id| self.name(model, *id)).collect()
    }

    /// A value's name, or an expression as it was written.
    pub(crate) fn label(self, text: &str) -> String {
        let number = text.parse::<f64>().is_ok_and(f64::is_finite);
        let letter = text.chars().count() == 1 && text.chars().all(char::is_alphabetic);
        match self {
            Notation::Unicode => text.replace("^-1", "⁻¹"),
            Notation::Latex if number => text.to_owned(),
            Notation::Latex if letter => latex::name(text),
            Notation::Latex => format!("\\text{{{}}}", latex::escaped(text)),
            Notation::MathMl if number => format!("<mn>{}</mn>", text.replace('-', "−")),
            Notation::MathMl if letter => format!("<mi>{}</mi>", xml::escaped(text)),
            Notation::MathMl => format!("<mtext>{}</mtext>", xml::escaped(&text.replace("^-1", "⁻¹"))),
        }
    }

    /// `left = right`: two sides of a relation, such as `=`, `∝`, `∈` or `−`.
    pub(crate) fn relation(self, left: &str, sign: &str, right: &str) -> String {
        match self {
            Notation::Unicode => format!("{left} {sign} {right}"),
            Notation::Latex => {
                let sign = match sign {
                    "∝" => "\\propto",
                    "∈" => "\\in",
                    "−" => "-",
                    "←" => "\\leftarrow",
                    "∼" => "\\sim",
                    other => other,
                };
                format!("{left} {sign} {right}")
            }
            Notation::MathMl => format!("{left}{}{right}", operator(sign)),
        }
    }

    /// A whole line: `left = right`, which may be broken after the sign.
    pub(crate) fn equation(self, left: &str, sign: &str, right: &str) -> String {
        match self {
            Notation::MathMl => format!("{left}{} {right}", operator(sign)),
            _ => self.relation(left, sign, right),
        }
    }

    /// `X = x`.
    pub(crate) fn item(self, name: &str, value: &str) -> String {
        self.relation(name, "=", value)
    }

    /// `X[i]`, an element of a family.
    pub(crate) fn element(self, name: &str, index: &str) -> String {
        match self {
            Notation::Unicode => format!("{name}[{index}]"),
            // A name with an index of its own is one part.
            Notation::Latex if name.contains("_{") => format!("{{{name}}}_{{{index}}}"),
            Notation::Latex => format!("{name}_{{{index}}}"),
            Notation::MathMl => format!("<msub><mrow>{name}</mrow><mrow>{index}</mrow></msub>"),
        }
    }

    /// 1 where something holds, else 0.
    pub(crate) fn indicator(self, what: &str) -> String {
        match self {
            Notation::MathMl => format!("<mrow>{}{what}{}</mrow>", operator("["), operator("]")),
            _ => format!("[{what}]"),
        }
    }

    /// A term followed by others, in brackets.
    pub(crate) fn group(self, what: &str) -> String {
        match self {
            // Nested sums grow long: they may be broken.
            Notation::MathMl if what.matches("<munder>").count() > 1 => format!("{OPEN}{what}{CLOSE}"),
            Notation::MathMl if what.contains("<munder>") => {
                format!("<mrow>{}{what}{}</mrow>", operator("("), operator(")"))
            }
            Notation::MathMl => format!("<mrow>{OPEN}{what}{CLOSE}</mrow>"),
            _ => format!("({what})"),
        }
    }

    /// `first(G with O at C)`: the first true element of a family.
    pub(crate) fn first(self, family: &str, with: Option<(&str, &str)>) -> String {
        let word = |text: &str| match self {
            Notation::Unicode => text.to_owned(),
            Notation::Latex if text.starts_with(' ') => format!(" \\text{{{text}}} "),
            Notation::Latex => format!("\\text{{{text}}}"),
            Notation::MathMl => format!("<mtext>{}</mtext>", text.replace(' ', "\u{a0}")),
        };
        let inside = match with {
            None => family.to_owned(),
            Some((value, at)) => [family, &word(" with "), value, &word(" at "), at].concat(),
        };
        format!("{}{}", word("first"), self.group(&inside))
    }

    /// The likelihood that virtual evidence gives.
    pub(crate) fn likelihood(self, variable: &str) -> String {
        format!("{}{}", self.choose("λ", "\\lambda", "<mi>λ</mi>"), self.group(variable))
    }

    /// The head of a factor, with its products: `Π_i P(Z[i] | V O C)`.
    pub(crate) fn head(self, model: &Model, factor: &Factor) -> String {
        let names = |uses: &[VariableUse]| -> Vec<String> {
            uses.iter().map(|use_| self.typeset(&model.use_name(use_, &factor.products))).collect()
        };
        let products: String = factor.products.iter().map(|(index, _)| self.product(index)).collect();
        format!("{products}{}", self.distribution(&names(&factor.left), &names(&factor.right)))
    }

    /// `P(left | right)`.
    pub(crate) fn distribution(self, left: &[String], right: &[String]) -> String {
        let long = left.len() + right.len() > MANY;
        let shown = |items: &[String]| {
            elision::list(
                items.len(),
                |at| items[at].clone(),
                |count| elision::dots(self, count, "variables"),
            )
        };
        let list = |items: &[String]| {
            let items = shown(items);
            let valued = items.iter().any(|item| item.contains(self.choose("=", "=", "<mo>=</mo>")));
            let separator = match valued {
                true => self.choose(
                    ", ",
                    ", ",
                    if long { "<mo separator=\"true\">,</mo> " } else { "<mo separator=\"true\">,</mo>" },
                ),
                false => self.choose(" ", "\\, ", if long { " " } else { "<mspace width=\"0.25em\"/>" }),
            };
            items.join(separator)
        };
        let inside = match right.is_empty() {
            true => list(left),
            false => {
                let bar = self.choose(" | ", " \\mid ", "<mo stretchy=\"false\">∣</mo>");
                [&list(left), bar, &list(right)].concat()
            }
        };
        match self {
            // A long list may be broken.
            Notation::MathMl if long => format!("<mi>P</mi>{OPEN}{inside}{CLOSE}"),
            Notation::MathMl => format!("<mrow><mi>P</mi>{OPEN}{inside}{CLOSE}</mrow>"),
            _ => format!("P({inside})"),
        }
    }

    /// A sign with its range below it, and a blank after it.
    fn under(self, sign: [&str; 3], over: &[String]) -> String {
        let sign = self.choose(sign[0], sign[1], sign[2]);
        let others = |count| elision::dots(self, count, "variables");
        let over = elision::list(over.len(), |at| over[at].clone(), others);
        match self {
            Notation::Unicode if over.len() == 1 && !over[0].contains(' ') => format!("{sign}_{} ", over[0]),
            Notation::Unicode => format!("{sign}_{{{}}} ", over.join(" ")),
            Notation::Latex => format!("{sign}_{{{}}} ", stacked(&over)),
            Notation::MathMl => {
                let over = over.join("<mspace width=\"0.2em\"/>");
                format!("<munder>{sign}<mrow>{over}</mrow></munder>")
            }
        }
    }

    /// `Σ_X`, with the blank behind it.
    pub(crate) fn sum(self, over: &[String]) -> String {
        self.under(["Σ", "\\sum", "<mo movablelimits=\"false\">∑</mo>"], over)
    }

    /// `∫_X`, with the blank behind it.
    pub(crate) fn integral(self, over: &[String]) -> String {
        self.under(["∫", "\\int", "<mo movablelimits=\"false\">∫</mo>"], over)
    }

    /// `Π_i`, with the blank behind it.
    pub(crate) fn product(self, over: &str) -> String {
        self.under(["Π", "\\prod", "<mo movablelimits=\"false\">∏</mo>"], &[self.label(over)])
    }

    /// `Π_{i ∈ S}`, of a range in this notation, with the blank behind it.
    pub(crate) fn product_over(self, over: &str) -> String {
        self.under(["Π", "\\prod", "<mo movablelimits=\"false\">∏</mo>"], &[over.to_owned()])
    }

    /// `max_X`, with the blank behind it.
    pub(crate) fn extremum(self, what: &str, over: &[String]) -> String {
        let sign = match what {
            "max" => ["max", "\\max", "<mi>max</mi>"],
            _ => ["argmax", "\\arg\\max", "<mrow><mi>arg</mi><mspace width=\"0.17em\"/><mi>max</mi></mrow>"],
        };
        self.under(sign, over)
    }

    /// One distribution over another.
    pub(crate) fn ratio(self, above: &str, below: &str) -> String {
        let simple = |text: &str| {
            text.starts_with("P(") && text.matches('(').count() == 1
                || text.chars().all(char::is_alphanumeric)
        };
        let group = |text: &str| if simple(text) { text.to_owned() } else { format!("({text})") };
        match self {
            Notation::Unicode => format!("{} / {}", group(above), group(below)),
            // A fraction that would be wider than a line is written on lines.
            Notation::Latex if is_wide(above, below) => {
                let group =
                    |text: &str| if simple(text) { text.to_owned() } else { format!("\\bigl({text}\\bigr)") };
                format!("{} / {}", group(above), group(below))
            }
            Notation::Latex => format!("\\frac{{{above}}}{{{below}}}"),
            Notation::MathMl => {
                format!("<mfrac><mrow>{}</mrow><mrow>{}</mrow></mfrac>", unbroken(above), unbroken(below))
            }
        }
    }

    /// A term over its own sum; a long sum gets a name, except in one line of text.
    pub(crate) fn normalised(self, above: &str, below: &str) -> String {
        let distributions = above.matches(self.choose("P(", "P(", "<mi>P</mi>")).count();
        match self {
            Notation::Unicode => self.ratio(above, below),
            _ if distributions <= LONG && (self != Notation::Latex || !is_wide(above, below)) => {
                self.ratio(above, below)
            }
            Notation::Latex => format!("{},\\quad Z = {below}", self.over(above, "Z")),
            Notation::MathMl => {
                let with = "<mo separator=\"true\">,</mo><mspace width=\"1em\"/> <mi>Z</mi><mo>=</mo>";
                format!("{}{with} {below}", self.over(above, "<mi>Z</mi>"))
            }
        }
    }

    /// A term over its normalising constant: `(1/P(K)) …`.
    pub(crate) fn over(self, body: &str, below: &str) -> String {
        match self {
            Notation::Unicode => format!("1/{below} · {body}"),
            Notation::Latex if latex::printed(below) + 2 * below.matches('=').count() > WIDE => {
                format!("1 / {below} \\cdot {body}")
            }
            Notation::Latex => format!("\\frac{{1}}{{{below}}} {body}"),
            Notation::MathMl => format!("<mfrac><mn>1</mn><mrow>{}</mrow></mfrac> {body}", unbroken(below)),
        }
    }
}

/// What stands in a fraction of MathML is on one line, and its blanks, at which lines break elsewhere, are spaces.
fn unbroken(text: &str) -> String {
    const SPACE: &str = "<mspace width=\"0.25em\"/>";
    // Behind another space there is one already.
    text.replace("> <", &format!(">{SPACE}<")).replace(&format!("/>{SPACE}<"), "/> <")
}

/// Whether a fraction is wider than a line.
fn is_wide(above: &str, below: &str) -> bool {
    latex::printed(above).max(latex::printed(below)) > WIDE
}

/// The variables under a sum sign in LaTeX, in lines if there are many.
fn stacked(over: &[String]) -> String {
    let mut lines: Vec<String> = Vec::new();
    for name in over {
        match lines.last_mut() {
            Some(line) if latex::printed(line) + latex::printed(name) <= STACKED => {
                line.push_str("\\,");
                line.push_str(name);
            }
            _ => lines.push(name.clone()),
        }
    }
    match lines.as_slice() {
        [one] => one.clone(),
        several => format!("\\substack{{{}}}", several.join("\\\\")),
    }
}

/// An operator in MathML.
pub(super) fn operator(sign: &str) -> String {
    format!("<mo>{}</mo>", xml::escaped(sign))
}
