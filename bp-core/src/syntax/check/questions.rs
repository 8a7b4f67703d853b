//! Questions: what is searched, what is known, and of which value.
//!
//! In: asks as written, in a program or typed by a user. Out: the model's questions. Invariant: a name that is no value
//! of the variable, and that starts with a small letter, stands for a value given when the question is asked; the
//! plate's index is known without being written.

use super::functions::ordinal_of;
use super::names::{did_you_mean, listed};
use super::{Checker, constant, number};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::ids::VariableId;
use crate::model::{Ask, Domain, Evidence, Known, Model, Question, Reduction, Searched, Value};
use crate::source::Span;
use crate::syntax::ast::{self, Item, Name, Occurrence, Sign, ValueKind};

const REDUCTIONS: [&str; 3] = ["argmax", "max", "entropy"];

impl Checker<'_> {
    pub(super) fn question(&mut self, name: &Name, asks: &[ast::Ask]) {
        if self.model.so_far().question(&name.text).is_some() {
            self.complain(name.span(), format!("the question `{name}` is declared twice"));
        }
        let mut read: Vec<(Ask, Span)> = Vec::new();
        for written in asks {
            let told = self.wrong.0.len();
            let ask = ask(self.model.so_far(), written, &mut self.wrong);
            // One that is already wrong would only be found wrong again.
            if self.wrong.0.len() == told {
                read.push((ask, written.at.0));
            }
        }
        let (read, spans): (Vec<Ask>, Vec<Span>) = read.into_iter().unzip();
        let id = self.model.question(Question { name: name.text.clone(), asks: read });
        for (position, span) in spans.into_iter().enumerate() {
            self.ask_spans.insert((id, position), span);
        }
    }
}

/// One ask, as far as it can be read; what cannot is told.
pub(super) fn ask(model: &Model, written: &ast::Ask, wrong: &mut Diagnostics) -> Ask {
    let reduction = reduction(written, wrong);
    let searched = written.searched.iter().filter_map(|item| searched(model, item, wrong)).collect();
    let known = written.known.iter().filter_map(|item| known(model, item, wrong)).collect();
    Ask { reduction, searched, known }
}

fn reduction(written: &ast::Ask, wrong: &mut Diagnostics) -> Reduction {
    let nearest = written.nearest.as_ref();
    let reduction = match written.reduction.as_ref().map(|name| name.text.as_str()) {
        None => Reduction::Probability,
        Some("max") => Reduction::Maximum,
        Some("entropy") => Reduction::Entropy,
        Some("argmax") => return Reduction::Argmax { nearest: nearest.map(|name| name.text.clone()) },
        Some(other) => {
            let span = written.reduction.as_ref().map_or(written.at.0, Name::span);
            let message =
                format!("`{other}` is not a reduction; the reductions are {}", listed(REDUCTIONS, "and"));
            wrong
                .push(Diagnostic { help: did_you_mean(other, REDUCTIONS), ..Diagnostic::new(span, message) });
            return Reduction::Probability;
        }
    };
    if let Some(name) = nearest {
        let message = "only `argmax` has ties that `nearest` could break";
        wrong.push(Diagnostic::new(name.span(), message).with_help("write `argmax P(…) nearest …`"));
    }
    reduction
}

fn searched(model: &Model, item: &Item, wrong: &mut Diagnostics) -> Option<Searched> {
    let variable = variable(model, &item.variable, wrong)?;
    if model.plate_index() == Some(variable) {
        let name = model.variable_name(variable);
        let message =
            format!("`{name}` is the plate's index: it is known in every question, and cannot be searched");
        wrong.push(Diagnostic::new(item.at.0, message));
        return None;
    }
    let at = match &item.evidence {
        None => None,
        Some(ast::Evidence::Hard(written)) => Some(value(model, variable, written, wrong)?),
        Some(ast::Evidence::Virtual(_)) => {
            let message = format!("virtual evidence says what is known, but `{}` is searched", item.variable);
            wrong.push(Diagnostic::new(item.at.0, message).with_help("move it behind the bar"));
            return None;
        }
    };
    Some(Searched { variable, at })
}

fn known(model: &Model, item: &Item, wrong: &mut Diagnostics) -> Option<Known> {
    let variable = variable(model, &item.variable, wrong)?;
    let evidence = match &item.evidence {
        // It is known anyway.
        None if model.plate_index() == Some(variable) => return None,
        None => Evidence::Each,
        Some(ast::Evidence::Hard(written)) => Evidence::Hard(value(model, variable, written, wrong)?),
        Some(ast::Evidence::Virtual(written)) => {
            let mut weights = Vec::new();
            for entry in written {
                let Some(weight) = constant(entry) else {
                    wrong.push(Diagnostic::new(
                        entry.span(),
                        "a likelihood must be a number that is known here",
                    ));
                    return None;
                };
                weights.push(weight);
            }
            Evidence::Virtual(weights)
        }
    };
    Some(Known { variable, evidence })
}

fn variable(model: &Model, occurrence: &Occurrence, wrong: &mut Diagnostics) -> Option<VariableId> {
    let name = &occurrence.name.text;
    let spoken = if occurrence.before { format!("{name}^-1") } else { name.clone() };
    let Some(id) = model.variable(&spoken) else {
        let known: Vec<String> = model.variables.ids().map(|id| model.variable_name(id)).collect();
        let mut diagnostic = Diagnostic::new(occurrence.at.0, format!("unknown variable `{spoken}`"));
        diagnostic.help = did_you_mean(name, known.iter().map(String::as_str)).or_else(|| {
            let listed = listed(known.iter().map(String::as_str), "and");
            (known.len() <= 12 && !known.is_empty()).then(|| format!("the variables are {listed}"))
        });
        wrong.push(diagnostic);
        return None;
    };
    if !occurrence.index.is_empty() {
        let message = match model.variables[id].family {
            Some(_) => format!("a question takes the whole of the family `{name}`, not one element"),
            None => format!("`{name}` is one variable, not a family: it takes no index"),
        };
        wrong.push(Diagnostic::new(occurrence.at.0, message).with_help(format!("write `{name}`")));
        return None;
    }
    Some(id)
}

/// The value that is written for a variable.
fn value(
    model: &Model,
    variable: VariableId,
    written: &ast::Value,
    wrong: &mut Diagnostics,
) -> Option<Value> {
    let domain = &model.variables[variable].domain;
    let is_family = model.variables[variable].family.is_some();
    if !is_family && let Some(ordinal) = ordinal_of(written, domain) {
        return Some(Value::Ordinal(ordinal));
    }
    match (&written.kind, domain) {
        (ValueKind::Name(name), _)
            if name.text.starts_with(|first: char| first.is_lowercase() || first == '_') =>
        {
            return Some(Value::Given(name.text.clone()));
        }
        (ValueKind::Number(sign, text), Domain::Real) if !is_family => {
            if let Some(number) = number(text) {
                return Some(Value::Real(if *sign == Sign::Minus { -number } else { number }));
            }
        }
        _ => {}
    }
    let name = model.variable_name(variable);
    let text = model.domain_text(domain);
    let array = is_family || matches!(domain, Domain::Vector(_));
    let mut diagnostic = if array {
        let what = if is_family { "a family of" } else { "a" };
        let message = format!("`{name}` is {what} `{text}`: one value cannot say what it is");
        Diagnostic::new(written.at.0, message)
            .with_help(format!("write `{name}`, and give its values when asking"))
    } else {
        Diagnostic::new(written.at.0, format!("`{written}` is not a value of `{name}`, which is `{text}`"))
    };
    if let (ValueKind::Name(label), Domain::Finite { labels, .. }) = (&written.kind, domain) {
        diagnostic.help = did_you_mean(&label.text, labels.iter().map(String::as_str));
    }
    wrong.push(diagnostic);
    None
}
