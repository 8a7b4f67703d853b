//! `unknown`: forms to be learned.
//!
//! In: the arguments of `unknown`. Out: a [`Fit`]. Invariant: the estimator is given by names and numbers known here;
//! the model checks that it fits the domain.
//!
//! `unknown` is Laplace's law of succession for a finite variable, a normal distribution for a real one.

use super::expressions::Scope;
use super::forms::Target;
use super::names::{did_you_mean, listed};
use super::{Checker, Meaning};
use crate::law::Law;
use crate::model::{Apart, Fit, Form, Unlearned};
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, Name};

/// The estimators that are not in [`Law`].
const WAYS: [&str; 4] = ["laplace_succession", "histogram", "dirichlet", "linear_regression"];

/// A name with numbers: `dirichlet(2)`, `normal`.
struct Way<'e> {
    name: &'e str,
    /// Its arguments, if all of them are known.
    numbers: Option<Vec<f64>>,
}

impl<'e> Way<'e> {
    fn of(written: &'e Expr) -> Option<Self> {
        match &written.kind {
            ExprKind::Name(name) => Some(Way { name: &name.text, numbers: Some(Vec::new()) }),
            ExprKind::Call(name, arguments) => {
                Some(Way { name: &name.text, numbers: arguments.iter().map(super::constant).collect() })
            }
            _ => None,
        }
    }
}

impl Checker<'_> {
    pub(super) fn unknown_form(
        &mut self,
        span: Span,
        (given, by): (&[Expr], &[Name]),
        target: &Target,
        scope: &Scope,
    ) -> Option<Form> {
        let by = by.iter().map(|index| self.kept_apart(index, scope)).collect::<Option<Vec<Apart>>>();
        let fit = match given {
            [] if target.domain.is_finite() => Fit::LaplaceSuccession,
            [] => Fit::law(Law::Normal),
            [how] => self.fit(how, target)?,
            [how, prior] => self.fit_with_prior(how, prior)?,
            more => {
                let message = format!(
                    "`unknown` takes an estimator and an optional prior, found {} arguments",
                    more.len()
                );
                self.complain_and_help(span, message, "write `unknown`, or `unknown(normal)`");
                return None;
            }
        };
        Some(Form::Unknown(Unlearned { fit, by: by? }))
    }

    /// An index for whose values a form is learned separately.
    fn kept_apart(&mut self, index: &Name, scope: &Scope) -> Option<Apart> {
        let model = self.model.so_far();
        if let Some(depth) = scope.products.iter().rposition(|(name, _)| *name == index.text) {
            return Some(Apart::Product(depth));
        }
        let plate = model.plate_index();
        if let (Some(Meaning::Variable(id)), Some(plate)) = (self.meaning(&index.text), plate)
            && id == plate
        {
            return Some(Apart::Plate);
        }
        let indices: Vec<String> = (scope.products.iter().map(|(name, _)| name.clone()))
            .chain(plate.map(|id| model.variable_name(id)))
            .collect();
        let head = &scope.head;
        let message = format!("`by` takes an index, and `{index}` is none of `{head}`");
        let help = match indices.as_slice() {
            [] => "leave `by` out: a form is learned for each combination of values on the right-hand side anyway".to_owned(),
            several => format!("an index here is {}", listed(several.iter().map(String::as_str), "or")),
        };
        self.complain_and_help(index.span(), message, help);
        None
    }

    fn fit(&mut self, how: &Expr, target: &Target) -> Option<Fit> {
        let way = Way::of(how);
        let fit = way.as_ref().and_then(|way| match (way.name, way.numbers.as_deref()?) {
            ("laplace_succession", []) => Some(Fit::LaplaceSuccession),
            ("histogram", []) => Some(Fit::Histogram),
            ("linear_regression", []) => Some(Fit::LinearRegression),
            ("dirichlet", [prior]) => Some(Fit::Dirichlet(*prior)),
            ("beta", [a, b]) => Some(Fit::Beta(*a, *b)),
            ("binomial", [trials]) => Some(Fit::Law { law: Law::Binomial, known: vec![*trials] }),
            (law, []) => Law::named(law).map(Fit::law),
            _ => None,
        });
        if fit.is_none() {
            self.no_way(how, way.map_or("", |way| way.name), target);
        }
        fit
    }

    fn no_way(&mut self, how: &Expr, name: &str, target: &Target) {
        let (message, help) = match name {
            "softmax" | "noisy_or" | "noisy_and" | "mixture" | "truncated" => (
                format!("`{name}` is not learned: its likelihood has no closed maximum"),
                Some(match (target.domain.is_finite(), name) {
                    (true, _) => "learn a table: `unknown`, or `unknown(histogram)`".to_owned(),
                    (false, "mixture") => {
                        "learn it by a hidden variable: `P(K) = unknown; P(X | K) = unknown(normal);`"
                            .to_owned()
                    }
                    (false, _) => "learn a law, such as `unknown(normal)`".to_owned(),
                }),
            ),
            "dirichlet" | "beta" | "binomial" if matches!(how.kind, ExprKind::Call(..)) => {
                let expected = match name {
                    "dirichlet" => "one number, the prior count of each value: `dirichlet(1)`",
                    "beta" => "the prior counts of `true` and `false`: `beta(1, 1)`",
                    _ => "one number, the number of trials: `binomial(10)`",
                };
                (format!("`{how}` cannot be learned in this way: `{name}` takes {expected}"), None)
            }
            law if Law::named(law).is_some() => (
                format!("`{how}` has arguments, but its parameters are learned"),
                Some(format!("write `unknown({law})`, or the form `{how}` itself")),
            ),
            _ => {
                let known: Vec<&str> =
                    WAYS.into_iter().chain(Law::ALL.iter().map(|law| law.name())).collect();
                let shown = known.iter().copied().filter(|way| *way != "dirichlet");
                let message = format!(
                    "`{how}` does not name an estimator; the estimators are `dirichlet(1)` (with a prior count) and {}",
                    listed(shown, "and")
                );
                (message, did_you_mean(name, known))
            }
        };
        let wrong = crate::diagnostic::Diagnostic::new(how.span(), message);
        self.wrong.push(crate::diagnostic::Diagnostic { help, ..wrong });
    }

    /// `unknown(poisson, gamma(2, 1))`, `unknown(normal, unbiased)`
    fn fit_with_prior(&mut self, how: &Expr, prior: &Expr) -> Option<Fit> {
        let (Some(way), Some(before)) = (Way::of(how), Way::of(prior)) else {
            let message = "`unknown` takes a law and its prior, such as `unknown(poisson, gamma(2, 1))`";
            self.complain(how.span().to(prior.span()), message);
            return None;
        };
        if (way.name, before.name) == ("normal", "unbiased") && matches!(how.kind, ExprKind::Name(_)) {
            return Some(Fit::UnbiasedNormal);
        }
        if before.name == "unbiased" {
            let message = format!("`unbiased` is an estimator of `normal` alone, found `{how}`");
            let help = format!("write `unknown(normal, unbiased)`, or `unknown({})`", way.name);
            self.complain_and_help(prior.span(), message, help);
            return None;
        }
        let law = Law::named(way.name);
        let Some((law, expected)) = law.and_then(|law| Some((law, Fit::prior_of(law)?))) else {
            let message = format!("no prior is known for `{how}`");
            let help = "laws with a prior are `poisson` and `exponential` (gamma), `binomial(n)` (beta) and \
                        `normal(deviation)` (normal); for a finite variable write `unknown(dirichlet(1))`";
            self.complain_and_help(how.span(), message, help);
            return None;
        };
        let count = usize::from(matches!(law, Law::Binomial | Law::Normal));
        let Some(known) = way.numbers.filter(|numbers| numbers.len() == count) else {
            let (message, help) = match law {
                Law::Normal => (
                    "with a prior on its mean, the deviation of `normal` is known",
                    "write it: `unknown(normal(2), normal(0, 10))`",
                ),
                Law::Binomial => (
                    "with a prior on its probability, the number of trials of `binomial` is known",
                    "write it: `unknown(binomial(10), beta(1, 1))`",
                ),
                _ => ("the rate is learned, and so is not given", "write `unknown(poisson, gamma(2, 1))`"),
            };
            self.complain_and_help(how.span(), message, help);
            return None;
        };
        let numbers = before.numbers.and_then(|numbers| <[f64; 2]>::try_from(numbers).ok());
        let Some(numbers) = numbers.filter(|_| before.name == expected.name()) else {
            let message =
                format!("the prior of `{}` is a `{}` law, found `{prior}`", law.name(), expected.name());
            let names: Vec<&str> = expected.parameters().iter().map(|(name, _)| *name).collect();
            let help = format!("write `{}({})` with numbers", expected.name(), names.join(", "));
            self.complain_and_help(prior.span(), message, help);
            return None;
        };
        Some(Fit::Conjugate { law, known, prior: numbers })
    }
}
