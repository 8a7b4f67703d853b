//! The parts of the equations of an instant: messages, factors, conditions.
//!
//! In: the carried, observed and searched variables. Out: pieces of mathematics. Invariant: names and heads are those of
//! the program.

use crate::analysis::of_form;
use crate::equation::Notation;
use crate::ids::VariableId;
use crate::model::Model;
use std::collections::BTreeSet;

/// The parts of the equations of an instant.
pub(super) struct Instant<'m> {
    pub(super) model: &'m Model,
    pub(super) notation: Notation,
    pub(super) now: Vec<VariableId>,
    pub(super) before: Vec<VariableId>,
    pub(super) observed: Vec<VariableId>,
    pub(super) searched: Vec<VariableId>,
}

impl Instant<'_> {
    /// Names in a sentence.
    pub(super) fn plain(&self, ids: &[VariableId]) -> String {
        let names: Vec<String> =
            ids.iter().map(|id| format!("`{}`", self.model.variable_name(*id))).collect();
        names.join(", ")
    }

    /// Names in an equation.
    pub(super) fn list(&self, ids: &[VariableId]) -> String {
        let blank = self.notation.choose(" ", "\\,", "<mspace width=\"0.25em\"/>");
        self.notation.names(self.model, ids).join(blank)
    }

    /// A message: `α(X)`.
    pub(super) fn message(&self, letter: &str, ids: &[VariableId]) -> String {
        let letter = self.notation.word(letter);
        format!("{letter}{}", self.notation.group(&self.list(ids)))
    }

    /// `P(X | Z past)`.
    pub(super) fn given_past(&self, left: &[VariableId], observed: &[VariableId]) -> String {
        let notation = self.notation;
        let mut known = notation.names(self.model, observed);
        known.push(notation.text("past", "\\text{past}"));
        notation.distribution(&notation.names(self.model, left), &known)
    }

    /// `P(X | all observations)`.
    pub(super) fn given(&self, left: &[VariableId], words: &str) -> String {
        let notation = self.notation;
        let known = notation.text(words, &format!("\\text{{{words}}}"));
        notation.distribution(&notation.names(self.model, left), &[known])
    }

    pub(super) fn sum(&self, over: &[VariableId]) -> String {
        match over.is_empty() {
            true => String::new(),
            false => self.notation.sum(&self.notation.names(self.model, over)),
        }
    }

    /// Factors after a sign.
    pub(super) fn times(&self, sign: &str, parts: &[String]) -> String {
        let blank = self.notation.choose(" ", " ", "<mspace width=\"0.15em\"/> ");
        let parts: Vec<&str> = parts.iter().map(String::as_str).filter(|part| !part.is_empty()).collect();
        format!("{sign}{}", parts.join(blank))
    }

    /// The factors of an instant, but not those of X⁻¹, as far as these variables need them (and the observations, if
    /// they count), and the variables that are summed out.
    pub(super) fn factors(&self, axes: &[VariableId], observed: bool) -> (Vec<VariableId>, String) {
        let seen: &[VariableId] = if observed { &self.observed } else { &[] };
        let mut rest: Vec<VariableId> = axes.iter().chain(seen).copied().collect();
        let mut wanted = BTreeSet::new();
        while let Some(id) = rest.pop() {
            if !self.before.contains(&id)
                && let Some(factor) = self.model.factor_of(id)
                && wanted.insert(factor)
            {
                rest.extend(of_form(self.model, factor));
            }
        }
        let mut hidden = self.before.clone();
        let mut heads = Vec::with_capacity(wanted.len());
        for id in wanted {
            let factor = &self.model.factors[id];
            heads.push(self.notation.head(self.model, factor));
            let left = factor.left.iter().map(|use_| use_.variable);
            hidden.extend(left.filter(|id| !axes.contains(id) && !seen.contains(id)));
        }
        (hidden, self.times("", &heads))
    }

    /// The heads of the factors whose variables these are, but not those of X⁻¹.
    pub(super) fn heads_of(&self, of: impl Fn(VariableId) -> bool) -> Vec<String> {
        let factors = self.model.factors.values().filter(|factor| {
            factor.left.iter().any(|use_| of(use_.variable) && !self.before.contains(&use_.variable))
        });
        factors.map(|factor| self.notation.head(self.model, factor)).collect()
    }

    /// The same in a sentence.
    pub(super) fn heads(&self, of: impl Fn(VariableId) -> bool) -> String {
        let factors = self.model.factors.values().filter(|factor| {
            factor.left.iter().any(|use_| of(use_.variable) && !self.before.contains(&use_.variable))
        });
        let heads: Vec<String> = factors.map(|factor| format!("`{}`", self.model.head(factor))).collect();
        heads.join(", ")
    }
}
