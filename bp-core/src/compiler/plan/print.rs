//! Derivations of a plan: those of its routes, and the combination of several distributions.
//!
//! In: a plan. Out: for each step its rule, its reason and its equation. Invariant: every line is a true equation:
//! values are substituted on both sides at once, and `∝` is used after constants have been dropped.

use super::{Marked, Notation, Plan, Route};
use crate::equation::{Line, forms, made_of_parts};
use crate::model::Model;

impl Plan {
    /// The derivation of the answer, step by step: (rule, reason, equation).
    pub fn derivation(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let distributions = self.routes.iter().flat_map(|route| derivation(route, model, notation));
        distributions.chain(self.made(model, notation)).collect()
    }

    /// The forms: the equation that is computed with each factor replaced by its form, then each form.
    pub fn forms(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let mut lines = Vec::new();
        for route in &self.routes {
            let used = match route.equation() {
                Some(exact) => {
                    lines.push(exact.with_forms(model, notation));
                    exact.used_factors()
                }
                None => model.factors.ids().collect(),
            };
            lines.extend(forms(model, &used, notation));
        }
        lines.dedup();
        lines
    }

    /// All that is computed: the equation of each distribution, then the statistic of each ask.
    pub fn computed(&self, model: &Model, notation: Notation) -> Vec<String> {
        let of_route = |route: &Route| {
            let (mut steps, read_outs) = route.offered().derive(model, notation);
            steps.pop().into_iter().chain(read_outs).map(|(_, _, equation)| equation).collect::<Vec<_>>()
        };
        let made = self.made(model, notation).into_iter().map(|(_, _, equation)| equation);
        self.routes.iter().flat_map(of_route).chain(made).collect()
    }

    /// The combination of several distributions, or the statistic of one.
    fn made(&self, model: &Model, notation: Notation) -> Vec<Line> {
        self.question.asks.iter().flat_map(|ask| made_of_parts(model, ask, notation)).collect()
    }

    /// The equation that is computed: the last line of each derivation.
    pub fn equations(&self, model: &Model, notation: Notation) -> Vec<String> {
        (self.routes.iter())
            .filter_map(|route| derivation(route, model, notation).pop())
            .map(|(_, _, equation)| equation)
            .collect()
    }
}

impl Plan {
    /// The products of all routes, each with its mark.
    pub fn marks(&self, model: &Model, notation: Notation) -> Vec<Marked> {
        self.routes.iter().flat_map(|route| route.offered().marks(model, notation)).collect()
    }
}

fn derivation(route: &Route, model: &Model, notation: Notation) -> Vec<Line> {
    let (mut lines, read_outs) = route.offered().derive(model, notation);
    lines.extend(read_outs);
    lines
}
