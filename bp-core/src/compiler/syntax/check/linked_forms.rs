//! Forms whose probabilities are computed from their arguments: links of regressions, vectors of probabilities, inflated zeros.
//!
//! In: the arguments of `bernoulli`, `categorical`, `multinomial` and `zero_inflated`. Out: a [`Form`]. Invariant: the two
//! probabilities of a link are computed apart, so that neither loses its digits.

use super::Checker;
use super::expressions::Scope;
use super::forms::Target;
use super::types::Type;
use crate::ids::ExpressionId;
use crate::model::{Domain, Expression, Form};
use crate::operators::{Binary, Unary};
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, Name};

impl Checker<'_> {
    /// `bernoulli(logistic(x))` and `bernoulli(probit(x))`: with link(−x) for `false`, which 1 − link(x) would round to 0 where
    /// x is large.
    pub(super) fn link(&mut self, argument: &Expr, target: &Target, scope: &Scope) -> Option<Option<Form>> {
        let ExprKind::Call(name, arguments) = &argument.kind else { return None };
        let is_link = matches!(name.text.as_str(), "logistic" | "probit") && target.domain == Domain::Boolean;
        let [score] = arguments.as_slice() else { return None };
        if !is_link {
            return None;
        }
        let score = match self.number_of(score, scope) {
            Some(score) => score,
            None => return Some(None),
        };
        let minus = self.model.unary(Unary::Negate, score);
        let row = [minus, score].map(|score| match name.text.as_str() {
            "logistic" => self.model.logistic(score),
            _ => self.model.unary(Unary::NormalCumulative, score),
        });
        Some(Some(Form::Categorical(row.to_vec())))
    }

    /// Probabilities that are one argument: the components of a vector, or a single number.
    pub(super) fn row(&mut self, row: &Expr, scope: &Scope) -> Option<Vec<ExpressionId>> {
        let (id, found) = self.expression(row, scope, None)?;
        let Type::Vector(length) = found else {
            return self.expect(row.span(), &found, &Type::Number).then(|| vec![id]);
        };
        let component = |at: usize| {
            let at = self.node(row.span(), Expression::Number(at as f64));
            self.node(row.span(), Expression::Vector("component".to_owned(), vec![id, at]))
        };
        Some((0..length).map(component).collect())
    }

    /// `zero_inflated(p, form)`: 0 with probability p, else what the form gives.
    pub(super) fn zero_inflated(
        &mut self,
        span: Span,
        name: &Name,
        given: &[Expr],
        target: &Target,
        scope: &mut Scope,
    ) -> Option<Form> {
        let [chance, form] = self.arguments(span, name, given)?;
        let (chance, form) = (self.number_of(chance, scope), self.part(form, target, scope));
        let has_zero = match &target.domain {
            Domain::Finite { labels, range: Some(range) } => {
                labels.is_empty() && range.low <= 0 && (range.high.size.is_some() || range.high.offset >= 0)
            }
            _ => false,
        };
        if !has_zero {
            let model = self.model.so_far();
            let (left, text) = (model.variable_name(target.left), model.domain_text(&target.domain));
            let message =
                format!("`zero_inflated` needs an integer range that contains 0, but `{left}` is `{text}`");
            self.complain(span, message);
            return None;
        }
        let (chance, form) = (chance?, form?);
        let (zero, one) =
            (self.node(span, Expression::Number(0.0)), self.node(span, Expression::Number(1.0)));
        let rest = self.node(span, Expression::Binary(Binary::Subtract, one, chance));
        Some(Form::Mixture(vec![(chance, Form::Dirac(zero)), (rest, form)]))
    }

    /// `multinomial(n, p, q, …)`, `multinomial(n, Theta)`
    pub(super) fn multinomial(&mut self, span: Span, given: &[Expr], scope: &Scope) -> Option<Form> {
        let [trials, row @ ..] = given else {
            self.complain_and_help(
                span,
                "`multinomial` takes the number of trials and one probability for each component, found none",
                "write `multinomial(10, 0.2, 0.3, 0.5)`, or `multinomial(10, Theta)` with a vector `Theta`",
            );
            return None;
        };
        let trials = self.number_of(trials, scope);
        let probabilities = match row {
            [row] => self.row(row, scope),
            _ => self.numbers(row, scope),
        };
        Some(Form::Multinomial { trials: trials?, probabilities: probabilities? })
    }
}
