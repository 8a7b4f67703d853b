//! Derivations of a plan: those of its routes, and what is made of several distributions.
//!
//! In: a plan. Out: for each step its rule, its reason and its equation. Invariant: every line is true as it stands: values enter
//! on both sides at once, and `∝` stands where constants have been dropped.

use super::{Marked, Notation, Plan, Route};
use crate::equation::{Line, made_of_parts};
use crate::model::Model;
use crate::strategies::over_time::By;

impl Plan {
    /// The derivation of the answer, step by step: (rule, reason, equation).
    pub fn derivation(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let distributions = self.routes.iter().flat_map(|route| route.derivation(model, notation));
        distributions.chain(self.made(model, notation)).collect()
    }

    /// All that is computed: the equation of each distribution, then what each ask makes of it.
    pub fn computed(&self, model: &Model, notation: Notation) -> Vec<String> {
        let of_route = |route: &Route| {
            let (mut steps, read_outs) = route.lines(model, notation);
            steps.pop().into_iter().chain(read_outs).map(|(_, _, equation)| equation).collect::<Vec<_>>()
        };
        let made = self.made(model, notation).into_iter().map(|(_, _, equation)| equation);
        self.routes.iter().flat_map(of_route).chain(made).collect()
    }

    /// What is made of several distributions, or of one that is not what was asked.
    fn made(&self, model: &Model, notation: Notation) -> Vec<Line> {
        self.question.asks.iter().flat_map(|ask| made_of_parts(model, ask, notation)).collect()
    }

    /// The equation that is computed: the last line of each derivation.
    pub fn equations(&self, model: &Model, notation: Notation) -> Vec<String> {
        (self.routes.iter())
            .filter_map(|route| route.derivation(model, notation).pop())
            .map(|(_, _, equation)| equation)
            .collect()
    }
}

impl Route {
    /// Which way the answer is found, and why it can be.
    pub fn reason(&self) -> &'static str {
        match self {
            Route::Exact(exact) if exact.has_scan() => {
                "exact, by sums, products and a scan: all that is summed is finite"
            }
            Route::Exact(exact) if exact.eliminations.is_empty() => {
                "exact, by products: nothing is left to be summed but what is searched"
            }
            Route::Exact(_) => "exact, by sums and products: all that is summed is finite",
            Route::Tree(_) => {
                "exact, by a join tree: sums and products of finite variables, too many for a loop each"
            }
            Route::Gaussian(_) => "exact, in closed form: all is real, linear and Gaussian",
            Route::Sampled(_) => "estimated, by draws: what is summed is not finite, nor linear and Gaussian",
            Route::OverTime(over_time) => match over_time.by {
                By::Chain => "exact, instant by instant: what is carried is finite",
                By::Gaussian(_) => "exact, instant by instant: what is carried is linear and Gaussian",
                By::Particles { .. } => "estimated, instant by instant, by particles",
            },
        }
    }

    fn derivation(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let (mut lines, read_outs) = self.lines(model, notation);
        lines.extend(read_outs);
        lines
    }

    /// The lines that lead to the distribution, and those that make the answers of it.
    fn lines(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        match self {
            Route::Exact(exact) => exact.lines(model, notation),
            Route::Tree(tree) => tree.exact.lines(model, notation),
            Route::Gaussian(gaussian) => (gaussian.derivation(model, notation), Vec::new()),
            Route::Sampled(sampled) => (sampled.derivation(model, notation), Vec::new()),
            Route::OverTime(over_time) => (over_time.derivation(model, notation), Vec::new()),
        }
    }
}

impl Plan {
    /// The products of all routes, each with its mark.
    pub fn marks(&self, model: &Model, notation: Notation) -> Vec<Marked> {
        let of_route = |route: &Route| match route {
            Route::Exact(exact) => exact.marks(model, notation),
            Route::OverTime(over_time) => over_time.marks(model, notation),
            _ => Vec::new(),
        };
        self.routes.iter().flat_map(of_route).collect()
    }
}
