//! Forms that have a name and arguments: `normal(0, 1)`, `mixture(0.3, …)`.
//!
//! In: a name and its arguments. Out: a [`Form`]. Invariant: arguments that are forms are of the same kinds;
//! distributions have the names of [`Law`], the others are listed here.

use super::expressions::{Scope, plural};
use super::forms::Target;
use super::names::{did_you_mean, listed, otherwise_called};
use super::types::Type;
use super::{Checker, Meaning};
use crate::diagnostic::Diagnostic;
use crate::ids::{ExpressionId, VariableId};
use crate::law::{Dirichlet, Law};
use crate::model::{Domain, Expression, Form, VariableUse};
use crate::source::Span;
use crate::spelling::exact;
use crate::syntax::ast::{Expr, ExprKind, Name};

/// The forms that are not in [`Law`].
const OTHERS: [&str; 23] = [
    "bernoulli",
    "categorical",
    "table",
    "normal_bins",
    "dirac",
    "previous",
    "ask",
    "weights",
    "histogram",
    "laplace_succession",
    "noisy_or",
    "noisy_and",
    "softmax",
    "mixture",
    "truncated",
    "zero_inflated",
    "flat",
    "half_flat",
    Dirichlet::NAME,
    "multinomial",
    "ordered",
    "linear_regression",
    "unknown",
];

/// Forms by other names, and how they are written here.
const ELSEWHERE: [(&str, &str); 6] = [
    ("gauss gaussian", "`normal(mean, deviation)`"),
    ("delta constant deterministic point", "`dirac(value)`"),
    (
        "discrete multinoulli cpt probabilities",
        "`categorical(p, q, …)`, or `table { … }` with a row for each case",
    ),
    ("flip coin binary", "`bernoulli(p)`"),
    ("student t studentt", "`student_t(nu, m, s)`"),
    ("vonmises", "`von_mises(m, k)`"),
];

/// The forms that the language knows, under their usual names.
pub(super) fn known_forms() -> impl Iterator<Item = &'static str> {
    Law::ALL.iter().map(|law| law.name()).chain(OTHERS)
}

impl Checker<'_> {
    pub(super) fn named(
        &mut self,
        span: Span,
        name: &Name,
        arguments: Option<&[Expr]>,
        target: &Target,
        scope: &mut Scope,
    ) -> Option<Form> {
        let given = arguments.unwrap_or_default();
        match name.text.as_str() {
            "uniform" if given.is_empty() => Some(Form::Uniform),
            "uniform" if given.len() != 2 => {
                let message = format!("`uniform` takes no argument, or two bounds, found {}", given.len());
                self.complain(span, message);
                None
            }
            "flat" => {
                let [] = self.arguments(span, name, given)?;
                Some(Form::Flat)
            }
            "half_flat" => {
                let [] = self.arguments(span, name, given)?;
                Some(Form::HalfFlat)
            }
            "bernoulli" => {
                let [argument] = self.arguments(span, name, given)?;
                match self.link(argument, target, scope) {
                    Some(linked) => linked,
                    None => match self.expression(argument, scope, None)? {
                        (_, Type::Boolean) => {
                            let message = "`bernoulli` takes a probability, found a truth value";
                            let help =
                                format!("`dirac({argument})` is the truth value itself, without chance");
                            self.complain_and_help(argument.span(), message, help);
                            None
                        }
                        (id, found) => {
                            let is_number = self.expect(argument.span(), &found, &Type::Number);
                            is_number.then(|| self.model.bernoulli(id))
                        }
                    },
                }
            }
            "categorical" => {
                let entries = match given {
                    [row] => self.row(row, scope)?,
                    _ => self.one_for_each(span, name, given, "probability", target, scope)?,
                };
                Some(Form::Categorical(entries))
            }
            "softmax" => {
                let scores = self.one_for_each(span, name, given, "score", target, scope)?;
                Some(self.model.softmax(&scores))
            }
            "histogram" => {
                let counts = self.one_for_each(span, name, given, "count", target, scope)?;
                Some(self.model.histogram(&counts))
            }
            "laplace_succession" => {
                let counts = self.one_for_each(span, name, given, "count", target, scope)?;
                Some(self.model.laplace_succession(&counts))
            }
            Dirichlet::NAME => Some(Form::Dirichlet(self.numbers(given, scope)?)),
            "multinomial" => self.multinomial(span, given, scope),
            "ordered" => {
                let [form] = self.arguments(span, name, given)?;
                Some(Form::Ordered(Box::new(self.part(form, target, scope)?)))
            }
            "zero_inflated" => self.zero_inflated(span, name, given, target, scope),
            "noisy_or" | "noisy_and" => self.noisy(span, name, given, target, scope),
            "linear_regression" => self.linear_regression(span, given, target, scope),
            "mixture" => self.mixture(span, given, target, scope),
            "truncated" => {
                let [form, low, high] = self.arguments(span, name, given)?;
                let form = self.part(form, target, scope);
                let (low, high) = (self.number_of(low, scope), self.number_of(high, scope));
                Some(Form::Truncated { form: Box::new(form?), low: low?, high: high? })
            }
            "unknown" => self.unknown_form(span, (given, &[]), target, scope),
            "normal_bins" => {
                let [mean, deviation] = self.arguments(span, name, given)?;
                let (mean, deviation) = (self.number_of(mean, scope), self.number_of(deviation, scope));
                Some(Form::NormalBins { mean: mean?, deviation: deviation? })
            }
            "dirac" => {
                let [argument] = self.arguments(span, name, given)?;
                let (id, found) = self.expression(argument, scope, Some(&target.domain))?;
                let expected = Type::of(&target.domain);
                let is_zero = found == Type::Number && matches!(expected, Type::Vector(_));
                (is_zero || self.expect(argument.span(), &found, &expected)).then_some(Form::Dirac(id))
            }
            "weights" => {
                // Weights are over the left-hand variable, and so may use it.
                let [argument] = self.arguments(span, name, given)?;
                scope.visible.push(target.left);
                let weight = self.number_of(argument, scope);
                scope.visible.pop();
                Some(Form::Weights(weight?))
            }
            other => match Law::named(other) {
                Some(law) => self.law(span, law, given, target, scope),
                None if given.is_empty() && self.is_value(other, target, scope) => {
                    let message = format!("`{other}` is a value, not a form: a form is a distribution");
                    let help = match (self.meaning(other), &target.domain) {
                        (Some(Meaning::Parameter(_)), Domain::Boolean) => {
                            format!("write `bernoulli({other})`, which gives `true` this probability")
                        }
                        _ => format!("write `dirac({other})`, which is this value for certain"),
                    };
                    self.complain_and_help(name.span(), message, help);
                    None
                }
                None => {
                    let known: Vec<&str> = known_forms().collect();
                    let message = format!(
                        "form `{other}` is not known; known forms are {}",
                        listed(known.iter().copied(), "and")
                    );
                    let help = otherwise_called(other, &ELSEWHERE).or_else(|| did_you_mean(other, known));
                    self.wrong.push(Diagnostic { help, ..Diagnostic::new(name.span(), message) });
                    None
                }
            },
        }
    }

    /// Whether a name is that of a value: of a variable, a parameter, a label, a `let` or an index.
    fn is_value(&self, name: &str, target: &Target, scope: &Scope) -> bool {
        let is_label =
            matches!(&target.domain, Domain::Finite { labels, .. } if labels.iter().any(|one| one == name));
        let is_bound = scope.bound.iter().any(|(bound, _)| bound == name)
            || scope.products.iter().any(|(index, _)| index == name);
        let is_set = matches!(self.meaning(name), Some(Meaning::Set(_)));
        is_label || is_bound || self.meaning(name).is_some() && !is_set
    }

    fn law(&mut self, span: Span, law: Law, given: &[Expr], target: &Target, scope: &Scope) -> Option<Form> {
        let parameters = law.parameters();
        if given.len() != parameters.len() {
            let names: Vec<&str> = parameters.iter().map(|(name, _)| *name).collect();
            let (name, count) = (law.name(), parameters.len());
            let what = plural(count, "argument", "arguments");
            let message = format!("`{name}` takes {count} {what}, found {}", given.len());
            self.complain_and_help(span, message, format!("write `{name}({})`", names.join(", ")));
            return None;
        }
        if let (Law::Normal, Domain::Vector(length), [mean, spread]) = (law, &target.domain, given)
            && let Some(covariance) = self.covariance(spread, *length, target, scope)
        {
            let mean = self.mean(mean, target, scope)?;
            return Some(Form::NormalVector { mean, covariance: covariance? });
        }
        let arguments: Vec<_> = (given.iter().enumerate())
            .map(|(position, argument)| match (law, position) {
                (Law::Normal, 0) => self.mean(argument, target, scope),
                _ => self.number_of(argument, scope),
            })
            .collect();
        let arguments = arguments.into_iter().collect::<Option<Vec<ExpressionId>>>()?;
        Some(Form::Law { law, arguments })
    }

    /// The mean of a normal law: a number; for a vector also a vector, or one number for all components.
    fn mean(&mut self, mean: &Expr, target: &Target, scope: &Scope) -> Option<ExpressionId> {
        let (id, found) = self.expression(mean, scope, None)?;
        let vector = Type::of(&target.domain);
        if matches!(vector, Type::Vector(_)) && found == vector {
            return Some(id);
        }
        self.expect(mean.span(), &found, &Type::Number).then_some(id)
    }

    /// An argument that is a form: `normal(0, 1)` in a mixture.
    pub(super) fn part(&mut self, argument: &Expr, target: &Target, scope: &mut Scope) -> Option<Form> {
        match &argument.kind {
            ExprKind::Call(name, arguments) => {
                self.named(argument.span(), name, Some(arguments), target, scope)
            }
            ExprKind::Name(name) => self.named(argument.span(), name, None, target, scope),
            ExprKind::Group(inner) => self.part(inner, target, scope),
            _ => {
                let message = format!("expected a form such as `normal(0, 1)`, found `{argument}`");
                self.complain(argument.span(), message);
                None
            }
        }
    }

    /// Arguments, one for each value of the left-hand variable.
    fn one_for_each(
        &mut self,
        span: Span,
        name: &Name,
        given: &[Expr],
        what: &str,
        target: &Target,
        scope: &Scope,
    ) -> Option<Vec<ExpressionId>> {
        if given.is_empty() {
            self.complain(span, format!("`{name}` takes one {what} for each value, found none"));
            return None;
        }
        let count = target.domain.count();
        let own_message = name.text == "categorical";
        if let (Some(count), false) = (count.filter(|count| *count != given.len()), own_message) {
            let text = self.model.so_far().domain_text(&target.domain);
            let left = self.model.so_far().variable_name(target.left);
            let message = format!(
                "`{left}` has {count} values (`{text}`), but `{name}` is given {} {what}s",
                given.len()
            );
            self.complain(span, message);
            return None;
        }
        let numbers = self.numbers(given, scope)?;
        let model = self.model.so_far();
        let below_0 = |id: &ExpressionId| model.constant(*id).filter(|number| *number < 0.0);
        match numbers.iter().find_map(below_0).filter(|_| what == "count") {
            Some(number) => {
                self.complain(
                    span,
                    format!("a count of `{name}` is at least 0, but this is {}", exact(number)),
                );
                None
            }
            None => Some(numbers),
        }
    }

    /// One probability for each variable on the right, and optionally a leak.
    fn noisy(
        &mut self,
        span: Span,
        name: &Name,
        given: &[Expr],
        target: &Target,
        scope: &Scope,
    ) -> Option<Form> {
        let causes = target.right.clone();
        if causes.is_empty() || !(causes.len()..=causes.len() + 1).contains(&given.len()) {
            let count = causes.len();
            let message = format!(
                "`{name}` takes a probability for each of the {count} variables on the right, and optionally a leak, found {}",
                given.len()
            );
            self.complain(span, message);
            return None;
        }
        let other = |id: &&VariableId| self.model.so_far().variables[**id].domain != Domain::Boolean;
        if let Some(cause) = causes.iter().find(other) {
            let model = self.model.so_far();
            let text = model.domain_text(&model.variables[*cause].domain);
            let message = format!(
                "the causes of `{name}` are `bool`, but `{}` is `{text}`",
                model.variable_name(*cause)
            );
            self.complain(span, message);
            return None;
        }
        let chances = self.numbers(given, scope)?;
        let values = self.values_of(span, &causes);
        let pairs: Vec<(ExpressionId, ExpressionId)> =
            values.into_iter().zip(chances.iter().copied()).collect();
        let leak = match chances.get(causes.len()) {
            Some(leak) => *leak,
            None => self.node(span, Expression::Number(0.0)),
        };
        Some(match name.text.as_str() {
            "noisy_or" => self.model.noisy_or(&pairs, leak),
            _ => self.model.noisy_and(&pairs, leak),
        })
    }

    fn values_of(&mut self, span: Span, variables: &[VariableId]) -> Vec<ExpressionId> {
        (variables.iter())
            .map(|variable| self.node(span, Expression::Variable(VariableUse::from(*variable))))
            .collect()
    }

    /// Intercept, one slope for each variable on the right, standard deviation.
    fn linear_regression(
        &mut self,
        span: Span,
        given: &[Expr],
        target: &Target,
        scope: &Scope,
    ) -> Option<Form> {
        let right = target.right.clone();
        if given.len() != right.len() + 2 {
            let message = format!(
                "`linear_regression` takes an intercept, a slope for each variable on the right and a standard \
                 deviation: {} arguments, found {}",
                right.len() + 2,
                given.len()
            );
            self.complain(span, message);
            return None;
        }
        let numbers = self.numbers(given, scope)?;
        let values = self.values_of(span, &right);
        let (intercept, slopes, deviation) =
            (numbers[0], &numbers[1..=right.len()], numbers[right.len() + 1]);
        let terms: Vec<(ExpressionId, ExpressionId)> =
            values.into_iter().zip(slopes.iter().copied()).collect();
        Some(self.model.linear_regression(intercept, &terms, deviation))
    }

    /// Weights and forms, alternating.
    fn mixture(&mut self, span: Span, given: &[Expr], target: &Target, scope: &mut Scope) -> Option<Form> {
        if given.is_empty() || !given.len().is_multiple_of(2) {
            let message =
                format!("`mixture` takes weights and forms by turns, found {} arguments", given.len());
            self.complain_and_help(span, message, "write `mixture(0.3, normal(0, 1), 0.7, normal(5, 2))`");
            return None;
        }
        let mut parts = Vec::new();
        for pair in given.chunks(2) {
            let (weight, part) = (self.number_of(&pair[0], scope), self.part(&pair[1], target, scope));
            parts.push(weight.zip(part));
        }
        parts.into_iter().collect::<Option<Vec<_>>>().map(Form::Mixture)
    }
}
