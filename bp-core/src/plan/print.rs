//! Plans as equations, in Unicode and in LaTeX.
//!
//! In: a term under its bindings. Out: one line of mathematics. Invariant: what is printed is what is computed:
//! the printer reads the same terms as lowering.

use super::{Binding, Exact, Gaussian, Plan, Route, Step, Term};
use crate::ids::{FactorId, TermId, VariableId};
use crate::model::{Ask, Evidence, Model, Reduction, Value, VariableUse};
use std::collections::BTreeMap;

/// How mathematics is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Notation {
    /// For terminals and comments.
    Unicode,
    /// For papers.
    Latex,
}

impl Plan {
    /// The derivation of the answer, step by step: (rule, reason, equation).
    pub fn derivation(&self, model: &Model, notation: Notation) -> Vec<(String, String, String)> {
        (self.routes.iter())
            .flat_map(|route| match route {
                Route::Exact(exact) => exact.derivation(model, notation),
                Route::Gaussian(gaussian) => gaussian.derivation(model, notation),
            })
            .collect()
    }

    /// The equation that is computed: the last line of each derivation.
    pub fn equations(&self, model: &Model, notation: Notation) -> Vec<String> {
        let last = |route: &Route| match route {
            Route::Exact(exact) => exact.derivation(model, notation).pop(),
            Route::Gaussian(gaussian) => gaussian.derivation(model, notation).pop(),
        };
        self.routes.iter().filter_map(last).map(|(_, _, equation)| equation).collect()
    }
}

impl Exact {
    fn derivation(&self, model: &Model, notation: Notation) -> Vec<(String, String, String)> {
        let left = left_hand_side(model, &self.asks, &self.searched, notation);
        let line = |step: &Step| {
            let printer = Printer { model, exact: self, bindings: &step.bindings, notation };
            let equation = format!("{left} {} {}", notation.equals(), printer.term(step.term));
            (step.rule.to_owned(), step.reason.clone(), equation)
        };
        let mut lines: Vec<_> = self.derivation.iter().map(line).collect();
        for ask in &self.asks {
            lines.extend(read_out(model, ask, &self.searched, notation));
        }
        lines
    }
}

impl Gaussian {
    fn derivation(&self, model: &Model, notation: Notation) -> Vec<(String, String, String)> {
        let searched: Vec<VariableId> =
            self.asks[0].searched.iter().map(|searched| searched.variable).collect();
        let left = left_hand_side(model, &self.asks, &searched, notation);
        let line = |(rule, reason, right): &(String, String, [String; 2])| {
            let right = &right[usize::from(notation == Notation::Latex)];
            (rule.clone(), reason.clone(), format!("{left} {} {right}", notation.equals()))
        };
        self.derivation.iter().map(line).collect()
    }
}

/// What an ask makes of the joint distribution, where it makes anything of it.
fn read_out(
    model: &Model,
    ask: &Ask,
    searched: &[VariableId],
    notation: Notation,
) -> Option<(String, String, String)> {
    let own: Vec<VariableId> = ask.searched.iter().map(|searched| searched.variable).collect();
    let left = left_hand_side(model, std::slice::from_ref(ask), &own, notation);
    let rest: Vec<_> = searched.iter().copied().filter(|variable| !own.contains(variable)).collect();
    let mut marginal = left_hand_side(model, std::slice::from_ref(ask), searched, notation);
    if !rest.is_empty() {
        let names: Vec<_> = rest.iter().map(|variable| name(model, *variable, notation)).collect();
        marginal = format!("{}{marginal}", notation.sum(&names));
    }
    let names = || own.iter().map(|variable| name(model, *variable, notation)).collect::<Vec<_>>();
    let (what, equation) = match (&ask.reduction, notation) {
        (Reduction::Probability, _) if rest.is_empty() => return None,
        (Reduction::Probability, _) => ("read-out", format!("{left} {} {marginal}", notation.equals())),
        (Reduction::Entropy, Notation::Unicode) => {
            ("entropy", format!("H = −Σ_{{{}}} p ln p, with p = {left}", names().join(" ")))
        }
        (Reduction::Entropy, Notation::Latex) => {
            ("entropy", format!("H = -\\sum_{{{}}} p \\ln p,\\quad p = {left}", names().join("\\,")))
        }
        (Reduction::Maximum, Notation::Unicode) => {
            ("maximum", format!("max_{{{}}} {left}", names().join(" ")))
        }
        (Reduction::Maximum, Notation::Latex) => {
            ("maximum", format!("\\max_{{{}}} {left}", names().join("\\,")))
        }
        (Reduction::Argmax { .. }, Notation::Unicode) => {
            ("argmax", format!("argmax_{{{}}} {left}", names().join(" ")))
        }
        (Reduction::Argmax { .. }, Notation::Latex) => {
            ("argmax", format!("\\arg\\max_{{{}}} {left}", names().join("\\,")))
        }
    };
    Some((what.to_owned(), "what is asked is made of the distribution".to_owned(), equation))
}

fn left_hand_side(model: &Model, asks: &[Ask], searched: &[VariableId], notation: Notation) -> String {
    let value = |variable: VariableId, value: &Value| match value {
        Value::Ordinal(ordinal) => label(&model.value_name(variable, *ordinal), notation),
        Value::Real(number) => number.to_string(),
        Value::Given(given) => given.clone(),
    };
    let at = |variable: VariableId| {
        let found =
            asks.iter().flat_map(|ask| &ask.searched).find(|searched| searched.variable == variable)?;
        found.at.as_ref()
    };
    let item = |variable: VariableId, at: Option<&Value>| match at {
        Some(at) => format!("{} = {}", name(model, variable, notation), value(variable, at)),
        None => name(model, variable, notation),
    };
    let left: Vec<_> = searched.iter().map(|variable| item(*variable, at(*variable))).collect();
    let mut right: Vec<_> = (asks[0].known.iter())
        .map(|known| match &known.evidence {
            Evidence::Hard(value) => item(known.variable, Some(value)),
            Evidence::Each => name(model, known.variable, notation),
            Evidence::Virtual(_) => match notation {
                Notation::Unicode => format!("λ({})", name(model, known.variable, notation)),
                Notation::Latex => format!("\\lambda({})", name(model, known.variable, notation)),
            },
        })
        .collect();
    right.extend(model.plate_index().map(|index| name(model, index, notation)));
    notation.distribution(&left, &right)
}

/// A variable, as mathematics prints it.
fn name(model: &Model, id: VariableId, notation: Notation) -> String {
    let variable = &model.variables[id];
    let base = identifier(&variable.name, notation);
    match (variable.previous_of, notation) {
        (None, _) => base,
        (Some(_), Notation::Unicode) => format!("{base}⁻¹"),
        (Some(_), Notation::Latex) => format!("{base}^{{-1}}"),
    }
}

fn identifier(text: &str, notation: Notation) -> String {
    match notation {
        Notation::Latex if text.chars().count() > 1 => format!("\\mathit{{{}}}", text.replace('_', "\\_")),
        _ => text.to_owned(),
    }
}

fn label(text: &str, notation: Notation) -> String {
    match notation {
        Notation::Latex => format!("\\text{{{}}}", text.replace('_', "\\_")),
        Notation::Unicode => text.to_owned(),
    }
}

impl Notation {
    fn equals(self) -> &'static str {
        "="
    }

    fn distribution(self, left: &[String], right: &[String]) -> String {
        let separator = |items: &[String]| match (items.iter().any(|item| item.contains('=')), self) {
            (true, _) => ", ",
            (false, Notation::Unicode) => " ",
            (false, Notation::Latex) => "\\,",
        };
        match (right.is_empty(), self) {
            (true, _) => format!("P({})", left.join(separator(left))),
            (false, Notation::Unicode) => {
                format!("P({} | {})", left.join(separator(left)), right.join(separator(right)))
            }
            (false, Notation::Latex) => {
                format!("P({} \\mid {})", left.join(separator(left)), right.join(separator(right)))
            }
        }
    }

    fn sum(self, over: &[String]) -> String {
        match self {
            Notation::Unicode if over.len() == 1 => format!("Σ_{} ", over[0]),
            Notation::Unicode => format!("Σ_{{{}}} ", over.join(" ")),
            Notation::Latex => format!("\\sum_{{{}}} ", over.join("\\,")),
        }
    }

    fn product(self, over: &str) -> String {
        match self {
            Notation::Unicode => format!("Π_{over} "),
            Notation::Latex => format!("\\prod_{{{over}}} "),
        }
    }
}

struct Printer<'p> {
    model: &'p Model,
    exact: &'p Exact,
    bindings: &'p BTreeMap<VariableId, Binding>,
    notation: Notation,
}

impl Printer<'_> {
    fn term(&self, id: TermId) -> String {
        match &self.exact.terms[id] {
            Term::Joint => {
                let known = self.model.plate_index();
                let all: Vec<_> = (self.model.variables.ids())
                    .filter(|id| Some(*id) != known)
                    .map(|id| name(self.model, id, self.notation))
                    .collect();
                let known: Vec<_> = known.iter().map(|id| name(self.model, *id, self.notation)).collect();
                self.notation.distribution(&all, &known)
            }
            Term::Factor(factor) => self.factor(*factor),
            Term::Likelihood(variable, _) => match self.notation {
                Notation::Unicode => format!("λ({})", self.variable(*variable)),
                Notation::Latex => format!("\\lambda({})", self.variable(*variable)),
            },
            Term::Possible(factor) => format!("[{} > 0]", self.factor(*factor)),
            Term::Inside(variable) => {
                let domain = self.model.domain_text(&self.model.variables[*variable].domain);
                match self.notation {
                    Notation::Unicode => format!("[{} ∈ {domain}]", self.value_of(*variable)),
                    Notation::Latex => {
                        format!("[{} \\in {}]", self.value_of(*variable), label(&domain, self.notation))
                    }
                }
            }
            Term::Product(factors) if factors.is_empty() => "1".to_owned(),
            Term::Product(factors) => {
                factors.iter().map(|factor| self.grouped(*factor)).collect::<Vec<_>>().join(" ")
            }
            Term::Sum(over, body) => {
                let names: Vec<_> = over.iter().map(|id| name(self.model, *id, self.notation)).collect();
                format!("{}{}", self.notation.sum(&names), self.term(*body))
            }
            Term::FirstScan(scan) => {
                let first = match scan.with {
                    Some((value, at)) => format!(
                        "first({} with {} at {})",
                        name(self.model, scan.family, self.notation),
                        self.model.expression_text(value, &[]),
                        self.model.expression_text(at, &[])
                    ),
                    None => format!("first({})", name(self.model, scan.family, self.notation)),
                };
                let factor = &self.model.factors[scan.factor];
                let left: Vec<_> = factor.left.iter().map(|use_| self.use_(use_, scan.factor)).collect();
                let event = vec![match self.notation {
                    Notation::Unicode => format!("{first} = k"),
                    Notation::Latex => format!("{} = k", label(&first, self.notation)),
                }];
                let given: Vec<_> = (scan.with.iter())
                    .flat_map(|(value, at)| [*value, *at])
                    .map(|part| self.model.expression_text(part, &[]))
                    .collect();
                let sum = self.notation.sum(&["k".to_owned()]);
                let weight = self.notation.distribution(&event, &given);
                format!("{sum}{weight} {}", self.notation.distribution(&left, &event))
            }
            Term::Normalise(over, body) => {
                let bound = |id: &&VariableId| !self.bindings.contains_key(id);
                let names: Vec<_> =
                    over.iter().filter(bound).map(|id| name(self.model, *id, self.notation)).collect();
                let body = self.term(*body);
                match (self.notation, names.is_empty()) {
                    (_, true) => body,
                    (Notation::Unicode, false) => {
                        format!("(1/Z) {body},  Z = Σ_{{{}}} of the same", names.join(" "))
                    }
                    (Notation::Latex, false) => {
                        format!("\\frac{{1}}{{Z}} {body},\\quad Z = \\sum_{{{}}}(\\cdot)", names.join("\\,"))
                    }
                }
            }
        }
    }

    /// A term inside a product.
    fn grouped(&self, id: TermId) -> String {
        match &self.exact.terms[id] {
            Term::Sum(..) | Term::FirstScan(_) => format!("({})", self.term(id)),
            _ => self.term(id),
        }
    }

    fn factor(&self, id: FactorId) -> String {
        let factor = &self.model.factors[id];
        let list = |uses: &[VariableUse]| uses.iter().map(|use_| self.use_(use_, id)).collect::<Vec<_>>();
        let products: String =
            factor.products.iter().map(|(index, _)| self.notation.product(index)).collect();
        format!("{products}{}", self.notation.distribution(&list(&factor.left), &list(&factor.right)))
    }

    fn use_(&self, use_: &VariableUse, factor: FactorId) -> String {
        let text = self.variable(use_.variable);
        match use_.element {
            None => text,
            Some(element) => {
                let index = self.model.expression_text(element, &self.model.factors[factor].products);
                let name = name(self.model, use_.variable, self.notation);
                match self.notation {
                    Notation::Unicode => text.replacen(&name, &format!("{name}[{index}]"), 1),
                    Notation::Latex => text.replacen(&name, &format!("{name}_{{{index}}}"), 1),
                }
            }
        }
    }

    /// A variable, or what it stands for.
    fn variable(&self, id: VariableId) -> String {
        let written = name(self.model, id, self.notation);
        match self.bindings.get(&id) {
            None => written,
            Some(Binding::Value(_)) => format!("{written} = {}", self.value_of(id)),
            Some(_) => self.value_of(id),
        }
    }

    fn value_of(&self, id: VariableId) -> String {
        match self.bindings.get(&id) {
            None => name(self.model, id, self.notation),
            Some(Binding::Value(Value::Ordinal(ordinal))) => {
                label(&self.model.value_name(id, *ordinal), self.notation)
            }
            Some(Binding::Value(Value::Real(number))) => number.to_string(),
            Some(Binding::Value(Value::Given(given))) => match *given == self.model.variable_name(id) {
                true => given.to_lowercase(),
                false => given.clone(),
            },
            Some(Binding::Expression(expression)) => {
                let text = self.model.expression_text(*expression, &[]);
                match self.notation {
                    Notation::Unicode => text.replace("^-1", "⁻¹"),
                    Notation::Latex => label(&text, self.notation),
                }
            }
            Some(Binding::Antecedent { cell, displacement }) => {
                let (cell, displacement) =
                    (name(self.model, *cell, self.notation), name(self.model, *displacement, self.notation));
                let minus = if self.notation == Notation::Unicode { "−" } else { "-" };
                format!("{cell}{minus}{displacement}")
            }
        }
    }
}
