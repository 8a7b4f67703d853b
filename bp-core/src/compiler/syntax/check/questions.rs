//! Checks questions: searched and known variables, and their values.
//!
//! In: asks as written, in a program or typed by a user. Out: the model's questions. Invariant: a lower-case name that
//! is neither a value of the variable nor similar to one is a value to be given when the question is asked; the plate's
//! index is always known.

use super::derived::{Found, derives, nothing};
use super::lists::spread;
use super::names::{did_you_mean, listed, near};
use super::patterns::ordinal_of;
use super::{Checker, constant, number, words};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::ids::{Id, VariableId};
use crate::model::{Ask, Derived, Domain, Finding, Known, Model, Question, Searched, Statistic, Value};
use crate::source::Span;
use crate::syntax::ast::{self, Expr, ExprKind, Item, Name, Occurrence, Sign, Subject, ValueKind};
use crate::units;
use std::borrow::Cow;

impl Checker<'_> {
    pub(super) fn question(&mut self, name: &Name, asks: &[ast::Ask]) {
        if self.model.so_far().question(&name.text).is_some() {
            self.complain(name.span(), format!("the question `{name}` is declared twice"));
        }
        let mut read: Vec<(Ask, Span)> = Vec::new();
        let mut derived = Vec::new();
        for written in asks {
            let before = self.wrong.0.len();
            let written = &*spread(self.model.so_far(), written, &mut self.wrong);
            let found = self.derive(written, &mut derived);
            let ask = ask_of(self.model.so_far(), written, (&derived, &found), &mut self.wrong);
            if self.has_untyped(&written.to_string()) {
                self.wrong.0.truncate(before);
                continue;
            }
            // Do not report a second error for the same ask.
            if self.wrong.0.len() == before {
                read.push((ask, written.at.0));
            }
        }
        let (read, spans): (Vec<Ask>, Vec<Span>) = read.into_iter().unzip();
        let id = self.model.question(Question { name: name.text.clone(), asks: read, derived });
        for (position, span) in spans.into_iter().enumerate() {
            self.ask_spans.insert((id, position), span);
        }
    }
}

/// A question as a user types it, as far as it can be read.
pub(super) fn typed(model: &Model, written: &[ast::Ask], wrong: &mut Diagnostics) -> Question {
    let (mut derived, mut asks) = (Vec::new(), Vec::new());
    for written in written {
        let written = &*spread(model, written, wrong);
        let mut found = Found::new();
        if derives(written) {
            let program = nothing();
            let mut checker = Checker::of(model, &program);
            found = checker.derive(written, &mut derived);
            checker.wrong.0.into_iter().for_each(|mistake| wrong.push(mistake));
        }
        asks.push(ask_of(model, written, (&derived, &found), wrong));
    }
    Question { name: String::new(), asks, derived }
}

/// One ask, as far as it can be read; the rest is reported. Derived variables have the ids of the question.
fn ask_of(
    model: &Model,
    written: &ast::Ask,
    (derived, found): (&[Derived], &Found),
    wrong: &mut Diagnostics,
) -> Ask {
    let names = Question { name: String::new(), asks: Vec::new(), derived: derived.to_vec() };
    let first = model.variables.len();
    let mut model = Cow::Borrowed(model);
    if !derived.is_empty() {
        model.to_mut().named(&names);
    }
    let reader = Reader { model: &model, found, first };
    let ask = reader.ask(written, wrong);
    let local = |id: VariableId| match id.position().checked_sub(first) {
        Some(number) => Derived::id(number),
        None => id,
    };
    Question { asks: vec![ask], ..names }.renamed(&local).asks.remove(0)
}

/// A program with the derived variables of an ask.
struct Reader<'r> {
    model: &'r Model,
    found: &'r Found,
    /// The first derived variable.
    first: usize,
}

impl Reader<'_> {
    fn ask(&self, written: &ast::Ask, wrong: &mut Diagnostics) -> Ask {
        let model = self.model;
        let known = |distribution: &ast::Distribution, wrong: &mut Diagnostics| {
            let mut number = false;
            let mut known: Vec<Known> = Vec::new();
            for item in &distribution.known {
                let before = wrong.0.len();
                match self.known(item, wrong) {
                    Some(one) if !known.iter_mut().any(|other| other.multiply(&one)) => known.push(one),
                    _ => {}
                }
                // `M = 3 cm`: what follows a number may be meant as its unit.
                if let (Subject::Variable(occurrence), None, true, Some(last)) =
                    (&item.subject, &item.evidence, number && wrong.0.len() > before, wrong.0.last_mut())
                {
                    last.help = units::behind_number(&occurrence.name.text).or(last.help.take());
                }
                number = matches!(item.subject, Subject::Term(_))
                    || matches!(
                        &item.evidence,
                        Some(ast::Finding::Hard(value)) if matches!(value.kind, ValueKind::Number(..))
                    );
            }
            known
        };
        let items = &written.distribution.searched;
        let (mut statistic, when) = words::read(written, wrong);
        let whole = statistic == Statistic::Distribution;
        let mut searched: Vec<Searched> = Vec::with_capacity(items.len());
        let mut number = false;
        for item in items {
            let before = wrong.0.len();
            searched.extend(self.searched(item, whole, wrong));
            // `M > 3 cm`: as above.
            if let (Subject::Variable(occurrence), None, true, Some(last)) =
                (&item.subject, &item.evidence, number && wrong.0.len() > before, wrong.0.last_mut())
            {
                last.help = units::behind_number(&occurrence.name.text).or(last.help.take());
            }
            number = matches!(item.subject, Subject::Term(_));
        }
        let first = known(&written.distribution, wrong);
        if let (Statistic::Divergence { from, .. }, Some(second)) = (&mut statistic, &written.from) {
            let second = &second.distribution;
            let whole = searched.len() == items.len();
            let others: Vec<Searched> =
                second.searched.iter().filter_map(|item| self.searched(item, false, wrong)).collect();
            let same = others.len() == searched.len() && others.iter().all(|item| searched.contains(item));
            if whole && others.len() == second.searched.len() && !same {
                let names = |searched: &[Searched]| {
                    let names: Vec<_> =
                        searched.iter().map(|item| model.variable_name(item.variable)).collect();
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

    /// A searched item; a predicate without a value is asked for the probability that it is true.
    fn searched(&self, item: &Item, holds: bool, wrong: &mut Diagnostics) -> Option<Searched> {
        let model = self.model;
        let variable = self.variable(item, wrong)?;
        if model.plate_index() == Some(variable) {
            let name = model.variable_name(variable);
            let message = format!(
                "`{name}` is the plate's index: it is known in every question, and cannot be searched"
            );
            wrong.push(Diagnostic::new(item.at.0, message));
            return None;
        }
        let at = match &item.evidence {
            None if holds && model.is_predicate(variable) => Some(Value::Ordinal(1)),
            None => None,
            Some(ast::Finding::Hard(written)) => Some(value(model, variable, written, wrong)?),
            Some(evidence) => {
                let kind = if let ast::Finding::Soft(_) = evidence { "soft" } else { "virtual" };
                let message = format!(
                    "{kind} evidence belongs to a known variable, but `{}` is searched",
                    model.spelled(variable)
                );
                wrong.push(Diagnostic::new(item.at.0, message).with_help("move it behind the bar"));
                return None;
            }
        };
        Some(Searched { variable, at })
    }

    fn known(&self, item: &Item, wrong: &mut Diagnostics) -> Option<Known> {
        let model = self.model;
        let variable = self.variable(item, wrong)?;
        let evidence = match &item.evidence {
            // The plate's index is always known.
            None if model.plate_index() == Some(variable) => return None,
            Some(_) if model.plate_index() == Some(variable) => {
                let name = model.variable_name(variable);
                let message = format!(
                    "`{name}` is the plate's index: every question is answered for each of its elements"
                );
                let help = format!("leave `{name}` out; the rows of the answer name their element");
                wrong.push(Diagnostic::new(item.at.0, message).with_help(help));
                return None;
            }
            None if model.is_predicate(variable) => Finding::Hard(Value::Ordinal(1)),
            None if model.is_equation(variable) => Finding::Hard(Value::Real(0.0)),
            None => Finding::Each,
            Some(ast::Finding::Hard(written)) => Finding::Hard(value(model, variable, written, wrong)?),
            Some(ast::Finding::Virtual(written)) => {
                Finding::Virtual(weights(written, "a likelihood", wrong)?)
            }
            Some(ast::Finding::Soft(written)) => Finding::Soft(weights(written, "a probability", wrong)?),
        };
        Some(Known { variable, evidence })
    }

    /// The variable of an item, or the one derived from it; `None` if an error was reported.
    fn variable(&self, item: &Item, wrong: &mut Diagnostics) -> Option<VariableId> {
        if let Some((_, place)) = self.found.iter().find(|(span, _)| *span == item.at.0) {
            return place.map(|place| VariableId::new(self.first + place));
        }
        let name = match &item.subject {
            Subject::Variable(occurrence) => return variable(self.model, occurrence, wrong),
            // A slice of a variable that is not a family.
            Subject::Slice(name, _) => name.clone(),
            Subject::Term(_) => return None,
        };
        let index = vec![Expr { at: item.at, kind: ExprKind::Number("0".to_owned()) }];
        variable(self.model, &Occurrence { at: item.at, name, index, before: false }, wrong)
    }
}

fn weights(written: &[ast::Expr], what: &str, wrong: &mut Diagnostics) -> Option<Vec<f64>> {
    let unknown = |entry: &ast::Expr| {
        Diagnostic::new(entry.span(), format!("{what} must be a number that is known here"))
    };
    let weight = |entry: &ast::Expr| constant(entry).ok_or_else(|| unknown(entry));
    written.iter().map(weight).collect::<Result<_, _>>().map_err(|fault| wrong.push(fault)).ok()
}

fn variable(model: &Model, occurrence: &Occurrence, wrong: &mut Diagnostics) -> Option<VariableId> {
    let name = &occurrence.name.text;
    let spoken = if occurrence.before { format!("{name}^-1") } else { name.clone() };
    let Some(id) = model.variable(&spoken) else {
        let known: Vec<String> = model.variables.ids().map(|id| model.variable_name(id)).collect();
        let mut diagnostic = Diagnostic::new(occurrence.at.0, format!("unknown variable `{spoken}`"));
        let at_instant = name.strip_suffix("_t").filter(|stem| model.variable(stem).is_some()).map(|stem| {
            format!("over time `{stem}` is the variable at each instant, and `{stem}^-1` that of the instant before")
        });
        diagnostic.help =
            at_instant.or_else(|| did_you_mean(name, known.iter().map(String::as_str))).or_else(|| {
                let listed = listed(known.iter().map(String::as_str), "and");
                (known.len() <= 12 && !known.is_empty()).then(|| format!("the variables are {listed}"))
            });
        wrong.push(diagnostic);
        return None;
    };
    if !occurrence.index.is_empty() {
        let message = format!("`{name}` is one variable, not a family: it takes no index");
        let of_time = occurrence
            .index
            .iter()
            .any(|index| ["t", "t-1", "t+1"].contains(&index.to_string().replace(' ', "").as_str()));
        let help = match of_time {
            true => format!(
                "over time `{name}` is the variable at each instant, and `{name}^-1` that of the instant before"
            ),
            false => format!("write `{name}`"),
        };
        wrong.push(Diagnostic::new(occurrence.at.0, message).with_help(help));
        return None;
    }
    Some(id)
}

/// The value of a variable, as written.
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
        // `Fails = fails` denotes a value given later, even though `fails` is similar to `false`.
        ValueKind::Name(name) if !is_family && !is_own_name(&name.text, &model.variable_name(variable)) => {
            slip(&name.text, domain)
        }
        _ => None,
    };
    match (&written.kind, domain) {
        (ValueKind::Name(name), _)
            if slip.is_none()
                && (model.variable(&name.text).is_none_or(|other| other == variable))
                && name.text.starts_with(|first: char| first.is_lowercase() || first == '_') =>
        {
            return Some(Value::Given(name.text.clone()));
        }
        (ValueKind::List(values), Domain::Vector(_)) if !is_family => {
            if let Some(numbers) = super::lists::vector(values) {
                return Some(Value::Vector(numbers));
            }
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
    let other = match &written.kind {
        ValueKind::Name(other) if model.variable(&other.text).is_some() => Some(&other.text),
        _ => None,
    };
    let mut diagnostic = if let Some(other) = other {
        let message = format!("`{other}` is a variable, not a value of `{name}`");
        Diagnostic::new(written.at.0, message)
            .with_help(format!("write `{} == {other}` to compare the two", model.spelled(variable)))
    } else if array {
        let what = if is_family { "a family of" } else { "a" };
        let message = format!("`{name}` is {what} `{text}`: a single value is not enough");
        Diagnostic::new(written.at.0, message)
            .with_help(format!("write `{name}`, and give its values when asking"))
    } else {
        Diagnostic::new(written.at.0, format!("`{written}` is not a value of `{name}`, which is `{text}`"))
    };
    if let Some(meant) = slip {
        diagnostic.help = Some(format!("did you mean `{meant}`?"));
    } else if diagnostic.help.is_none() {
        diagnostic.help = domain.help();
    }
    wrong.push(diagnostic);
    None
}

/// Whether a name is the variable's name in lower case, with or without `_` between its words.
fn is_own_name(name: &str, variable: &str) -> bool {
    let plain = |text: &str| text.replace('_', "").to_lowercase();
    name != variable && plain(name) == plain(variable)
}

/// The value that a misspelled name probably means. A name such as `w` is similar to none: it is a value given later.
fn slip<'d>(name: &str, domain: &'d Domain) -> Option<&'d str> {
    match domain {
        Domain::Boolean if ["yes", "on"].contains(&name) => Some("true"),
        Domain::Boolean if ["no", "off"].contains(&name) => Some("false"),
        Domain::Boolean => near(name, ["false", "true"]),
        Domain::Finite { labels, .. } => near(name, labels.iter().map(String::as_str)),
        _ => None,
    }
}
