//! Lists as evidence: `Y = [28, 8, -3]` gives each element of a family, or each component of a vector, a value.
//!
//! In: an ask as written. Out: the same ask with an item for each value, where the list is not the value of a vector. Invariant: a
//! list of another length is an error.

use super::patterns::ordinal_of;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::model::{Domain, Form, IndexSpace, Model};
use crate::source::Span;
use crate::syntax::ast::{Ask, Expr, ExprKind, Finding, Item, Occurrence, Sign, Subject, Value, ValueKind};
use std::borrow::Cow;

/// The ask with lists spread over elements.
pub(super) fn spread<'a>(model: &Model, ask: &'a Ask, wrong: &mut Diagnostics) -> Cow<'a, Ask> {
    let from = ask.from.iter().flat_map(|from| &from.distribution.known);
    if !ask.distribution.known.iter().chain(from).any(|item| list(item).is_some()) {
        return Cow::Borrowed(ask);
    }
    let mut ask = ask.clone();
    let from = ask.from.iter_mut().map(|from| &mut from.distribution);
    for distribution in std::iter::once(&mut ask.distribution).chain(from) {
        let items = std::mem::take(&mut distribution.known);
        distribution.known = items.into_iter().flat_map(|item| elements(model, item, wrong)).collect();
    }
    Cow::Owned(ask)
}

fn list(item: &Item) -> Option<&[Value]> {
    match &item.evidence {
        Some(Finding::Hard(Value { kind: ValueKind::List(values), .. })) => Some(values),
        _ => None,
    }
}

/// Whether the components of a form are counts of one total, which are known together.
fn counts(form: &Form) -> bool {
    let mut found = matches!(form, Form::Multinomial { .. });
    form.each_part(&mut |part| found |= counts(part));
    found
}

/// The numbers of a list; none if a value is given when the question is asked.
pub(super) fn vector(values: &[Value]) -> Option<Vec<f64>> {
    let one = |value: &Value| match &value.kind {
        ValueKind::Number(sign, text) => {
            super::number(text).map(|number| if *sign == Sign::Minus { -number } else { number })
        }
        _ => None,
    };
    values.iter().map(one).collect()
}

/// An item for each value of a list.
fn elements(model: &Model, item: Item, wrong: &mut Diagnostics) -> Vec<Item> {
    let Some(values) = list(&item) else { return vec![item] };
    let (name, before) = match &item.subject {
        Subject::Variable(occurrence) if occurrence.index.is_empty() => (&occurrence.name, occurrence.before),
        Subject::Slice(name, _) => (name, false),
        _ => return vec![item],
    };
    let spoken = if before { format!("{}^-1", name.text) } else { name.text.clone() };
    let Some(id) = model.variable(&spoken) else { return vec![item] };
    let variable = &model.variables[id];
    let bound = |bound: &crate::syntax::ast::Bound| match (&bound.name, &bound.offset) {
        (None, Some((sign, text))) => super::integer(*sign, text),
        _ => None,
    };
    let (first, count) = match (&item.subject, variable.family.map(|family| family.over), &variable.domain) {
        (Subject::Slice(_, range), Some(_), _) => {
            let (Some(low), high) = (bound(&range.low), bound(&range.high)) else { return vec![item] };
            (low, high.map(|high| (high - low + 1).max(0) as usize))
        }
        (_, Some(IndexSpace::Set(_)), _) => (0, None),
        (_, Some(over), _) => (over.first(), model.index_count(&over)),
        (_, None, Domain::Vector(length)) => (0, Some(*length)),
        _ => return vec![item],
    };
    if count.is_some_and(|count| count != values.len()) {
        let (count, found) = (count.unwrap_or(0), values.len());
        let what = if variable.family.is_some() { "elements" } else { "components" };
        let message = format!("`{}` has {count} {what}, but {found} values are given", name.text);
        wrong.push(Diagnostic::new(item.at.0, message));
        return Vec::new();
    }
    let form = model.factor_of(id).map(|factor| &model.factors[factor].form);
    if variable.family.is_none() && vector(values).is_some() && form.is_some_and(counts) {
        return vec![item];
    }
    if let Some(fault) = of_another_domain(values, &variable.domain, (&name.text, item.at.0)) {
        wrong.push(fault);
        return Vec::new();
    }
    let one = |(place, value): (i64, &Value)| {
        let index = vec![Expr { at: value.at, kind: ExprKind::Number((first + place).to_string()) }];
        let occurrence = Occurrence { at: value.at, name: name.clone(), index, before };
        let evidence = Some(Finding::Hard(value.clone()));
        Item { at: value.at, subject: Subject::Variable(occurrence), evidence }
    };
    (0..).zip(values).map(one).collect()
}

/// One mistake where several values are no values of a finite domain: `[1, 0, 1]` of truth values.
fn of_another_domain(values: &[Value], domain: &Domain, (name, span): (&str, Span)) -> Option<Diagnostic> {
    let is_wrong = |value: &&Value| {
        matches!(value.kind, ValueKind::Number(..) | ValueKind::Boolean(_))
            && ordinal_of(value, domain).is_none()
    };
    if !domain.is_finite() || values.iter().filter(is_wrong).count() < 2 {
        return None;
    }
    let text = |values: &[String]| format!("[{}]", values.join(", "));
    let written: Vec<String> = values.iter().map(ToString::to_string).collect();
    let truth = |value: &String| match value.as_str() {
        "0" => Some("false".to_owned()),
        "1" => Some("true".to_owned()),
        _ => None,
    };
    let truths: Option<Vec<String>> = written.iter().map(truth).collect();
    let message = format!("`{}` has values that are none of `{name}`", text(&written));
    let fault = Diagnostic::new(span, message);
    Some(match (domain, truths) {
        (Domain::Boolean, Some(truths)) => fault.with_help(format!("write `{name} = {}`", text(&truths))),
        _ => Diagnostic { help: domain.help(), ..fault },
    })
}
