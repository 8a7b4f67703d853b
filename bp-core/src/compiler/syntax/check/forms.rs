//! Checks forms, one for each factor.
//!
//! In: definitions as written. Out: the forms of the model's factors, and the parameters that `identification` learns.
//! Invariant: a factor without a form and a form without a factor are errors; a form uses only the variables that its
//! factor depends on.

use super::decomposition::key;
use super::expressions::{Scope, plural};
use super::functions::{as_name, occurrence};
use super::{Checker, Meaning};
use crate::diagnostic::Diagnostic;
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::model::{Domain, Form, Identification};
use crate::source::Span;
use crate::syntax::ast::{self, Definition, Expr, FormKind, Learnt};
use std::collections::HashMap;

/// The factor of a form.
pub(super) struct Target {
    /// The left-hand variable.
    pub(super) left: VariableId,
    /// The domain of its first variable on the left.
    pub(super) domain: Domain,
    /// The variables on the right.
    pub(super) right: Vec<VariableId>,
}

impl Checker<'_> {
    pub(super) fn definitions(&mut self, definitions: &[&Definition]) {
        let mut given: HashMap<FactorId, Span> = HashMap::new();
        for definition in definitions {
            let key = key(&definition.head);
            if self.is_initial(&key) {
                self.initial_form(&key, definition);
                continue;
            }
            if self.is_piece(&key) {
                self.piece_form(&key, definition);
                continue;
            }
            let Some(factor) = self.factors.get(&key).copied() else {
                if !self.broken_heads.contains(&key) {
                    self.form_without_factor(definition);
                }
                continue;
            };
            if let Some(first) = given.insert(factor, definition.head.at.0) {
                let message = format!("`{}` has two forms", definition.head);
                let wrong = Diagnostic::new(definition.head.at.0, message).with_label(first, "first here");
                self.wrong.push(wrong);
                continue;
            }
            self.form_spans.insert(factor, definition.form.span());
            let before = self.wrong.0.len();
            let form = self.definition(factor, definition);
            if self.has_untyped(&definition.head.to_string()) {
                self.wrong.0.truncate(before);
            }
            match form {
                Some(form) => self.model.set_form(factor, form),
                None => {
                    self.broken_forms.insert(factor);
                }
            }
        }
        let wholes = self.join_pieces();
        self.join_initials();
        let missing = |id: &FactorId| !given.contains_key(id) && !wholes.contains(id);
        let missing: Vec<FactorId> = self.model.so_far().factors.ids().filter(missing).collect();
        for factor in missing {
            self.broken_forms.insert(factor);
            let model = self.model.so_far();
            // A second factor of a variable is already reported as its second distribution.
            let is_second =
                model.factors[factor].left.iter().any(|use_| model.factor_of(use_.variable) != Some(factor));
            if !is_second && self.factors.values().any(|known| *known == factor) {
                let head = model.head(&model.factors[factor]);
                let span = self.factor_spans[&factor];
                let help = format!("add `{head} = …;` to `forms`");
                self.complain_and_help(span, format!("`{head}` has no form"), help);
            }
        }
    }

    fn form_without_factor(&mut self, definition: &Definition) {
        let head = &definition.head;
        let is_broken = |occurrence: &ast::Occurrence| match self.meaning(&occurrence.name.text) {
            Some(Meaning::Variable(id)) => self.broken_variables.contains(&id),
            _ => false,
        };
        if head.left.iter().any(is_broken) {
            return;
        }
        let left = |key: &str| key.split(" | ").next().unwrap_or("").to_owned();
        let wanted = left(&key(head));
        let mut wrong =
            Diagnostic::new(head.at.0, format!("the decomposition has no factor `{head}` for this form"));
        let mut same: Vec<FactorId> =
            self.factors.iter().filter(|(key, _)| left(key) == wanted).map(|(_, id)| *id).collect();
        same.sort_unstable();
        if let Some(id) = same.first() {
            let model = self.model.so_far();
            let text = model.head(&model.factors[*id]);
            wrong = wrong.with_label(self.factor_spans[id], format!("here it is `{text}`"));
            // This is the factor's form with a wrong head: it is not missing too.
            self.factors.retain(|_, known| known != id);
        }
        if same.is_empty() {
            wrong = wrong.with_help(format!("add `{head}` to the decomposition"));
        }
        self.wrong.push(wrong);
    }

    fn definition(&mut self, factor: FactorId, definition: &Definition) -> Option<Form> {
        let model = self.model.so_far();
        let meant = &model.factors[factor];
        let right: Vec<VariableId> = meant.right.iter().map(|use_| use_.variable).collect();
        let mut visible = right.clone();
        visible.extend(model.plate_index());
        let left = meant.left.first()?.variable;
        let domain = model.variables[left].domain.clone();
        let products = meant.products.clone();
        let head = definition.head.to_string();
        let mut scope = Scope { head, visible, products, bound: Vec::new(), numbered: false };
        self.form(&definition.form, &Target { left, domain, right }, &mut scope)
    }

    pub(super) fn form(&mut self, form: &ast::Form, target: &Target, scope: &mut Scope) -> Option<Form> {
        match &form.kind {
            FormKind::Named { name, by, .. } if !by.is_empty() && name.text != "unknown" => {
                let message = format!("`by` belongs to `unknown`, and `{name}` is not learned");
                self.complain_and_help(by[0].span(), message, "leave `by` out");
                None
            }
            FormKind::Named { name, arguments, by } if !by.is_empty() => {
                self.unknown_form(form.span(), (arguments.as_deref().unwrap_or_default(), by), target, scope)
            }
            FormKind::Named { name, arguments, .. } => {
                self.named(form.span(), name, arguments.as_deref(), target, scope)
            }
            FormKind::Table(rows) => self.table(form.span(), rows, target, scope),
            FormKind::Previous { variable, of, otherwise } => {
                let known = self.variable_of(variable);
                let at = match of {
                    None => None,
                    Some(of) => {
                        let Some(name) = as_name(of) else {
                            self.complain(
                                of.span(),
                                format!("expected the variable of a cell, found `{of}`"),
                            );
                            return None;
                        };
                        self.element_of(of, scope)?;
                        self.variable_of(&occurrence(name))
                    }
                };
                let otherwise = match otherwise {
                    None => Some(Form::Uniform),
                    Some(form) => self.form(form, target, scope),
                };
                if variable.before || !variable.index.is_empty() {
                    let message = format!("`previous` takes a variable at this instant, found `{variable}`");
                    self.complain_and_help(
                        variable.at.0,
                        message,
                        format!("write `previous({})`", variable.name),
                    );
                    return None;
                }
                if of.is_some() && at.is_none() {
                    return None;
                }
                Some(Form::Previous { of: known?, at, otherwise: Box::new(otherwise?) })
            }
            FormKind::Ask { path, given } => self.ask_form(path, given.as_deref(), target, scope),
            FormKind::Let { name, value, body } => {
                if let Some((_, first)) = self.names.get(&name.text) {
                    let message = format!("`{name}` already has a meaning: `let` gives a new name");
                    let wrong = Diagnostic::new(name.span(), message).with_label(*first, "declared here");
                    self.wrong
                        .push(wrong.with_help(format!("write `let {} = … in …`", self.free_name(name))));
                    return None;
                }
                let typed = self.expression(value, scope, None)?;
                scope.bound.push((name.text.clone(), typed));
                let form = self.form(body, target, scope);
                scope.bound.pop();
                form
            }
            FormKind::If(choice) => {
                let mut branches = Vec::new();
                for (condition, body) in &choice.branches {
                    let condition = self.truth_of(condition, scope);
                    branches.push(condition.zip(self.form(body, target, scope)));
                }
                let otherwise = self.form(&choice.otherwise, target, scope)?;
                branches.into_iter().rev().try_fold(otherwise, |otherwise, branch| {
                    branch.map(|(condition, then)| choose(condition, then, otherwise))
                })
            }
            FormKind::Match(choice) => {
                let patterns: Vec<_> = choice.arms.iter().map(|(pattern, _)| pattern).collect();
                let conditions = self.conditions(form.span(), &choice.on, &patterns, scope);
                let bodies: Vec<_> =
                    choice.arms.iter().map(|(_, body)| self.form(body, target, scope)).collect();
                let mut bodies = bodies.into_iter().collect::<Option<Vec<_>>>()?;
                let (conditions, last) = (conditions?, bodies.pop()?);
                let arms = conditions.into_iter().zip(bodies).rev();
                Some(arms.fold(last, |otherwise, (condition, then)| choose(condition, then, otherwise)))
            }
        }
    }

    /// A name like this one that means nothing yet: `x` for `X`.
    fn free_name(&self, name: &ast::Name) -> String {
        let lower = name.text.to_lowercase();
        match self.names.contains_key(&lower) {
            true => format!("{lower}_here"),
            false => lower,
        }
    }

    pub(super) fn numbers(&mut self, expressions: &[Expr], scope: &Scope) -> Option<Vec<ExpressionId>> {
        let ids: Vec<_> = expressions.iter().map(|entry| self.number_of(entry, scope)).collect();
        ids.into_iter().collect()
    }

    /// Declares the parameters to be learned.
    pub(super) fn announce(&mut self, learnt: &Learnt) {
        if learnt.from.is_none() {
            return;
        }
        for name in &learnt.names {
            match self.meaning(&name.text) {
                Some(Meaning::Parameter(_)) => {}
                _ => {
                    self.declare(name, Meaning::Learnt);
                }
            }
        }
    }

    /// The parameters to be learned, with the shape found in the forms.
    pub(super) fn identification(&mut self, learnt: &Learnt) {
        let Some(from) = &learnt.from else {
            for name in &learnt.names {
                if let Some(variable) = self.variable_of(&occurrence(name)) {
                    self.model.hidden(variable);
                }
            }
            return;
        };
        let mut parameters = Vec::new();
        for name in &learnt.names {
            match self.meaning(&name.text) {
                Some(Meaning::Parameter(id)) => parameters.push(id),
                Some(Meaning::Learnt) => {
                    self.complain(name.span(), format!("`{name}` is to be learned, but no form uses it"));
                }
                _ => {}
            }
        }
        let by = match learnt.by.as_slice() {
            [] => None,
            [name] => self.variable_of(&occurrence(name)),
            [_, second, ..] => {
                let count = learnt.by.len();
                let what = plural(count, "variable", "variables");
                self.complain(second.span(), format!("`by` takes one variable, found {count} {what}"));
                None
            }
        };
        let data = from.text.clone();
        self.model.identification(Identification { parameters, data, by });
    }
}

fn choose(condition: ExpressionId, then: Form, otherwise: Form) -> Form {
    Form::If { condition, then: Box::new(then), otherwise: Box::new(otherwise) }
}
