//! Checks questions: searched and known variables, and their values.
//!
//! In: asks as written, in a program or typed by a user. Out: the model's questions. Invariant: a lower-case name that
//! is neither a value of the variable nor similar to one stands for a value given when the question is asked; the
//! plate's index is always known.

use super::functions::ordinal_of;
use super::names::{did_you_mean, listed, near};
use super::{Checker, constant, number, words};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::ids::VariableId;
use crate::model::{Ask, Domain, Evidence, Known, Model, Question, Searched, Statistic, Value};
use crate::source::Span;
use crate::syntax::ast::{self, Item, Name, Occurrence, Sign, ValueKind};

impl Checker<'_> {
    pub(super) fn question(&mut self, name: &Name, asks: &[ast::Ask]) {
        if self.model.so_far().question(&name.text).is_some() {
            self.complain(name.span(), format!("the question `{name}` is declared twice"));
        }
        let mut read: Vec<(Ask, Span)> = Vec::new();
        for written in asks {
            let told = self.wrong.0.len();
            let ask = ask(self.model.so_far(), written, &mut self.wrong);
            // Do not report a second error for a wrong one.
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

/// One ask; errors are reported.
pub(super) fn ask(model: &Model, written: &ast::Ask, wrong: &mut Diagnostics) -> Ask {
    let known = |distribution: &ast::Distribution, wrong: &mut Diagnostics| {
        distribution.known.iter().filter_map(|item| known(model, item, wrong)).collect()
    };
    let items = &written.distribution.searched;
    let searched: Vec<Searched> = items.iter().filter_map(|item| searched(model, item, wrong)).collect();
    let first = known(&written.distribution, wrong);
    let (mut statistic, when) = words::read(written, wrong);
    if let (Statistic::Divergence { from, .. }, Some(second)) = (&mut statistic, &written.from) {
        let second = &second.distribution;
        let whole = searched.len() == items.len();
        let others: Vec<Searched> =
            second.searched.iter().filter_map(|item| self::searched(model, item, wrong)).collect();
        let same = others.len() == searched.len() && others.iter().all(|item| searched.contains(item));
        if whole && others.len() == second.searched.len() && !same {
            let names = |searched: &[Searched]| {
                let names: Vec<_> = searched.iter().map(|item| model.variable_name(item.variable)).collect();
                listed(names.iter().map(String::as_str), "and")
            };
            let (one, other) = (names(&searched), names(&others));
            let message = format!(
                "`divergence` compares two distributions of the same variables, but these search {one} and {other}"
            );
            wrong.push(Diagnostic::new(second.at.0, message));
        }
        *from = known(second, wrong);
    }
    Ask { statistic, when, searched, known: first }
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
        Some(evidence) => {
            let kind = if let ast::Evidence::Soft(_) = evidence { "soft" } else { "virtual" };
            let message =
                format!("{kind} evidence belongs to a known variable, but `{}` is searched", item.variable);
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
        Some(_) if model.plate_index() == Some(variable) => {
            let name = model.variable_name(variable);
            let message =
                format!("`{name}` is the plate's index: every question is answered for each of its elements");
            let help = format!("leave `{name}` out; the rows of the answer name their element");
            wrong.push(Diagnostic::new(item.at.0, message).with_help(help));
            return None;
        }
        None => Evidence::Each,
        Some(ast::Evidence::Hard(written)) => Evidence::Hard(value(model, variable, written, wrong)?),
        Some(ast::Evidence::Virtual(written)) => Evidence::Virtual(weights(written, "a likelihood", wrong)?),
        Some(ast::Evidence::Soft(written)) => Evidence::Soft(weights(written, "a probability", wrong)?),
    };
    Some(Known { variable, evidence })
}

fn weights(written: &[ast::Expr], what: &str, wrong: &mut Diagnostics) -> Option<Vec<f64>> {
    let unknown = |entry: &ast::Expr| {
        Diagnostic::new(entry.span(), format!("{what} must be a number that is known here"))
    };
    let weight = |entry: &ast::Expr| constant(entry).ok_or_else(|| unknown(entry));
    written.iter().map(weight).collect::<Result<_, _>>().map_err(|told| wrong.push(told)).ok()
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
    let slip = match &written.kind {
        // `Fails = fails` is how a value that is given later is written, however near `fails` is to `false`.
        ValueKind::Name(name) if !is_family && !is_own_name(&name.text, &model.variable_name(variable)) => {
            slip(&name.text, domain)
        }
        _ => None,
    };
    match (&written.kind, domain) {
        (ValueKind::Name(name), _)
            if slip.is_none()
                && name.text.starts_with(|first: char| first.is_lowercase() || first == '_') =>
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
        let message = format!("`{name}` is {what} `{text}`: a single value is not enough");
        Diagnostic::new(written.at.0, message)
            .with_help(format!("write `{name}`, and give its values when asking"))
    } else {
        Diagnostic::new(written.at.0, format!("`{written}` is not a value of `{name}`, which is `{text}`"))
    };
    if let Some(meant) = slip {
        diagnostic.help = Some(format!("did you mean `{meant}`?"));
    }
    wrong.push(diagnostic);
    None
}

/// Whether a name is the variable's name in lower case, with or without `_` between its words.
fn is_own_name(name: &str, variable: &str) -> bool {
    let plain = |text: &str| text.replace('_', "").to_lowercase();
    name != variable && plain(name) == plain(variable)
}

/// The value that a name was probably meant to be. A name such as `w` resembles none: it stands for a given value.
fn slip<'d>(name: &str, domain: &'d Domain) -> Option<&'d str> {
    match domain {
        Domain::Boolean => near(name, ["false", "true"]),
        Domain::Finite { labels, .. } => near(name, labels.iter().map(String::as_str)),
        _ => None,
    }
}
