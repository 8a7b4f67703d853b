//! The patterns of `match`.
//!
//! In: the arms of a match, and what it is on. Out: a condition for each arm but the last. Invariant: a match covers every
//! value; its last arm applies if no other does.

use super::cover::LeftOut;
use super::expressions::Scope;
use super::functions::as_name;
use super::names::did_you_mean;
use super::types::Type;
use super::{Checker, integer, number};
use crate::diagnostic::Diagnostic;
use crate::ids::ExpressionId;
use crate::model::{Domain, Expression, IndexSpace};
use crate::operators::Binary;
use crate::source::Span;
use crate::syntax::ast::{Expr, Pattern, PatternKind, Sign, Value, ValueKind};
use std::collections::HashMap;

impl Checker<'_> {
    /// The conditions of all arms but the last.
    pub(super) fn conditions(
        &mut self,
        span: Span,
        on: &Expr,
        arms: &[&Pattern],
        scope: &Scope,
    ) -> Option<Vec<ExpressionId>> {
        let domain = self.domain_of(on).or_else(|| index_domain(on, scope));
        let (value, kind) = self.expression(on, scope, None)?;
        let domain = match (&kind, domain) {
            (Type::Boolean, _) => Some(Domain::Boolean),
            (Type::Label(domain), _) => Some(domain.clone()),
            (Type::Number, domain) => domain,
            (Type::Element(set), _) => Some(Domain::Set(*set)),
            (Type::Vector(_), _) => {
                let found = kind.words(self.model.so_far());
                self.complain(
                    on.span(),
                    format!(
                        "`match` takes a truth value, a label, a number or an element of a set, found {found}"
                    ),
                );
                return None;
            }
        };
        let mut conditions = Vec::new();
        // Looked up once for all arms: there may be as many arms as labels.
        let labels: HashMap<&str, usize> = match &domain {
            Some(Domain::Finite { labels, .. }) => {
                labels.iter().enumerate().map(|(ordinal, label)| (label.as_str(), ordinal)).collect()
            }
            _ => HashMap::new(),
        };
        let mut left = LeftOut::of(domain.as_ref());
        let mut total = false;
        for pattern in arms {
            if total {
                self.complain(pattern.at.0, "this arm is never reached: what precedes it covers every value");
                return None;
            }
            let (low, high) = match &pattern.kind {
                PatternKind::Any => (f64::NEG_INFINITY, f64::INFINITY),
                PatternKind::Value(written) => {
                    let label = match &written.kind {
                        ValueKind::Name(name) => labels.get(name.text.as_str()),
                        _ => None,
                    };
                    let value = match (label, &domain) {
                        (Some(ordinal), Some(domain)) => (*ordinal as i64 + domain.base()) as f64,
                        _ => self.pattern_value(written, domain.as_ref())?,
                    };
                    (value, value)
                }
                PatternKind::Range(low, high) => {
                    // Of bins those whose centres, their numbers, are in the range.
                    let of = domain.as_ref().filter(|domain| domain.bins().is_none());
                    (self.pattern_value(low, of)?, self.pattern_value(high, of)?)
                }
            };
            total = left.cover(low, high) || low == f64::NEG_INFINITY;
            conditions.push(self.within(pattern.at.0, value, low, high));
        }
        if !total {
            let missing = match (left.first(), &domain) {
                (Some(ordinal), Some(domain)) => format!("`{}`", domain.value_name(ordinal)),
                _ => "every value".to_owned(),
            };
            let wrong = Diagnostic::new(span, format!("this `match` does not cover {missing}"));
            self.wrong.push(wrong.with_help("end it with `_ => …`"));
            return None;
        }
        conditions.pop();
        Some(conditions)
    }

    fn within(&mut self, span: Span, value: ExpressionId, low: f64, high: f64) -> ExpressionId {
        let low_id = self.node(span, Expression::Number(low.max(-f64::MAX)));
        if low == high {
            return self.node(span, Expression::Binary(Binary::Equal, value, low_id));
        }
        let high_id = self.node(span, Expression::Number(high.min(f64::MAX)));
        let above = self.node(span, Expression::Binary(Binary::GreaterOrEqual, value, low_id));
        let below = self.node(span, Expression::Binary(Binary::LessOrEqual, value, high_id));
        self.node(span, Expression::Binary(Binary::And, above, below))
    }

    /// The number of a value in an expression.
    fn pattern_value(&mut self, value: &Value, domain: Option<&Domain>) -> Option<f64> {
        match (domain, &value.kind) {
            (Some(Domain::Real) | None, ValueKind::Number(sign, text)) => {
                number(text).map(|number| if *sign == Sign::Minus { -number } else { number })
            }
            (Some(domain), _) if domain.is_finite() => {
                let ordinal = self.ordinal(value, domain, None)?;
                Some(domain.number(ordinal))
            }
            _ => {
                self.complain(value.at.0, format!("expected a number, found `{value}`"));
                None
            }
        }
    }

    /// The ordinal of a value in a finite domain; `of` is the variable that the domain belongs to.
    pub(super) fn ordinal(&mut self, value: &Value, domain: &Domain, of: Option<&str>) -> Option<usize> {
        if let Some(ordinal) = ordinal_of(value, domain) {
            return Some(ordinal);
        }
        let values = self.values_text(domain);
        let belongs = of.map_or_else(String::new, |name| format!(" of `{name}`"));
        let mut wrong =
            Diagnostic::new(value.at.0, format!("`{value}` is not a value{belongs}: expected {values}"));
        if let (Domain::Finite { labels, .. }, ValueKind::Name(name)) = (domain, &value.kind) {
            wrong.help = did_you_mean(&name.text, labels.iter().map(String::as_str));
        } else if matches!(domain, Domain::Bins(_)) {
            wrong.help = domain.help();
        }
        self.wrong.push(wrong);
        None
    }
}

/// The values of an index of a product over a range.
fn index_domain(on: &Expr, scope: &Scope) -> Option<Domain> {
    let name = as_name(on)?;
    let (_, over) = scope.products.iter().rev().find(|(index, _)| *index == name.text)?;
    match over {
        IndexSpace::Range(range) => Some(Domain::Finite { labels: Vec::new(), range: Some(*range) }),
        IndexSpace::Set(_) => None,
    }
}

/// The ordinal of a value, if it is one of the domain.
pub(super) fn ordinal_of(value: &Value, domain: &Domain) -> Option<usize> {
    match (&value.kind, domain) {
        (ValueKind::Boolean(value), Domain::Boolean) => Some(usize::from(*value)),
        (ValueKind::Boolean(value), Domain::Finite { .. }) => domain.ordinal_of(&value.to_string()),
        (ValueKind::Name(name), Domain::Finite { .. }) => domain.ordinal_of(&name.text),
        (ValueKind::Number(sign, text), Domain::Finite { range: Some(_), .. }) => {
            domain.ordinal_of(&integer(*sign, text)?.to_string())
        }
        (ValueKind::Number(sign, text), Domain::Bins(bins)) => {
            let number = number(text)?;
            bins.holding(if *sign == Sign::Minus { -number } else { number })
        }
        (ValueKind::Number(sign, text), Domain::Set(_)) => usize::try_from(integer(*sign, text)?).ok(),
        _ => None,
    }
}
