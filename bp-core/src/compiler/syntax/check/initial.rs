//! Factors of the first instant: `P(initial(X))` beside `P(X | X^-1)`.
//!
//! In: factors and forms that are headed by `initial`. Out: a [`Form::Initial`] for the factor of X. Invariant: at the
//! first instant X depends on the right-hand variables of its initial factor alone, which are among those of its own
//! factor.

use super::Checker;
use super::decomposition::key;
use super::expressions::Scope;
use super::forms::Target;
use crate::diagnostic::Diagnostic;
use crate::ids::{FactorId, VariableId};
use crate::model::{Factor, Form, VariableUse};
use crate::source::Span;
use crate::syntax::ast::{self, Definition};

/// A factor of the first instant.
pub(super) struct Initial {
    key: String,
    span: Span,
    head: String,
    /// Its variables and products.
    own: Factor,
    /// The factor of X at the other instants.
    factor: Option<FactorId>,
    form: Option<Form>,
    /// Where its form stands, if there is one.
    defined: Option<Span>,
}

impl Checker<'_> {
    /// `P(initial(X) | …)` in the decomposition.
    pub(super) fn initial_factor(&mut self, written: &ast::Factor, own: Factor) {
        let (key, span, head) = (key(written), written.at.0, written.to_string());
        if let Some(first) = self.initials.iter().find(|other| other.key == key) {
            let wrong = Diagnostic::new(span, format!("`{head}` is written twice"));
            self.wrong.push(wrong.with_label(first.span, "first here"));
            return;
        }
        self.initials.push(Initial { key, span, head, own, factor: None, form: None, defined: None });
    }

    /// Finds the factors of the other instants, once all are known; adds `P(X^-1)` where nothing else distributes it.
    pub(super) fn bind_initials(&mut self) {
        let mut initials = std::mem::take(&mut self.initials);
        let all: Vec<Factor> = initials.iter().map(|initial| initial.own.clone()).collect();
        for initial in &mut initials {
            initial.factor = self.continued(initial, &all);
            if initial.factor.is_none() {
                self.broken_heads.insert(initial.key.clone());
            }
        }
        initials.retain(|initial| initial.factor.is_some());
        self.initials = initials;
    }

    /// The factor of the same variable that conditions on the instant before; `all` are the factors of the first instant.
    fn continued(&mut self, initial: &Initial, all: &[Factor]) -> Option<FactorId> {
        let (head, span) = (&initial.head, initial.span);
        let [left] = initial.own.left.as_slice() else {
            self.complain(span, format!("`{head}` distributes several variables: write a factor for each"));
            return None;
        };
        let model = self.model.so_far();
        let name = model.use_name(left, &initial.own.products);
        let previous = model.variables.find(|variable| variable.previous_of == Some(left.variable));
        let reads = |factor: &Factor, id: VariableId| factor.right.iter().any(|use_| use_.variable == id);
        let factor = previous.and_then(|previous| {
            model.factors.find(|factor| {
                let same = |own: &VariableUse| {
                    own.variable == left.variable && model.use_name(own, &factor.products) == name
                };
                factor.left.len() == 1 && factor.left.iter().all(same) && reads(factor, previous)
            })
        });
        let (Some(previous), Some(factor)) = (previous, factor) else {
            let help = format!("add `P({name} | {name}^-1)` for the other instants, or write `P({name})`");
            let message = format!(
                "`{head}` is of the first instant, but no factor of `{name}` conditions on the one before"
            );
            self.complain_and_help(span, message, help);
            return None;
        };
        let later = &model.factors[factor];
        if let Some(other) = initial.own.right.iter().find(|use_| !reads(later, use_.variable)) {
            let message = format!(
                "`{head}` depends on `{}`, but `{}` does not: add it there",
                model.variable_name(other.variable),
                model.head(later)
            );
            self.complain(span, message);
            return None;
        }
        // A factor that another one replaces at the first instant does not read it there.
        let is_replaced = |other: &Factor| {
            let same =
                |own: &&Factor| own.left.first().map(|use_| use_.variable) == Some(other.left[0].variable);
            all.iter().find(same).is_some_and(|own| !reads(own, previous))
        };
        let alone = model.factors.iter().all(|(id, other)| {
            id == factor
                || is_replaced(other)
                || !(reads(other, previous) || other.left.iter().any(|use_| use_.variable == previous))
        });
        if alone && model.variables[previous].domain.is_finite() {
            // Nothing depends on it at the first instant; afterwards it is carried.
            let left = vec![VariableUse { variable: previous, element: left.element }];
            let otherwise = Box::new(Form::Uniform);
            let form = Form::Previous { of: initial.own.left[0].variable, at: None, otherwise };
            let products = initial.own.products.clone();
            let added = self.model.push_factor(Factor { left, right: Vec::new(), form, products });
            self.factor_spans.insert(added, span);
            self.form_spans.insert(added, span);
        }
        Some(factor)
    }

    /// Whether a key is that of a factor of the first instant.
    pub(super) fn is_initial(&self, key: &str) -> bool {
        self.initials.iter().any(|initial| initial.key == key)
    }

    /// `P(initial(X) | …) = form`
    pub(super) fn initial_form(&mut self, key: &str, definition: &Definition) {
        let Some(position) = self.initials.iter().position(|initial| initial.key == key) else { return };
        let (initial, span) = (&self.initials[position], definition.head.at.0);
        if let Some(first) = initial.defined {
            let wrong = Diagnostic::new(span, format!("`{}` has two forms", definition.head));
            self.wrong.push(wrong.with_label(first, "first here"));
            return;
        }
        let model = self.model.so_far();
        let right: Vec<VariableId> = initial.own.right.iter().map(|use_| use_.variable).collect();
        let mut visible = right.clone();
        visible.extend(model.plate_index());
        let left = initial.own.left[0].variable;
        let domain = model.variables[left].domain.clone();
        let (head, products) = (definition.head.to_string(), initial.own.products.clone());
        let mut scope = Scope { head, visible, products, bound: Vec::new(), numbered: false };
        let form = self.form(&definition.form, &Target { left, domain, right }, &mut scope);
        // The factor that it becomes a part of has other variables on the right, so rows are chosen by values.
        let right = self.initials[position].own.right.clone();
        let form = form.and_then(|form| self.without_keys(form, &right));
        self.initials[position].form = form;
        self.initials[position].defined = Some(span);
    }

    /// Joins the forms of the first instant to those of the others.
    pub(super) fn join_initials(&mut self) {
        for initial in std::mem::take(&mut self.initials) {
            let Some(factor) = initial.factor else { continue };
            match (initial.form, initial.defined) {
                (Some(first), _) if !self.broken_forms.contains(&factor) => {
                    let later = self.model.so_far().factors[factor].form.clone();
                    let form = Form::Initial { first: Box::new(first), later: Box::new(later) };
                    self.model.set_form(factor, form);
                }
                (None, None) => {
                    let help = format!("add `{} = …;` to `forms`", initial.head);
                    self.complain_and_help(initial.span, format!("`{}` has no form", initial.head), help);
                    self.broken_forms.insert(factor);
                }
                _ => {
                    self.broken_forms.insert(factor);
                }
            }
        }
    }
}
