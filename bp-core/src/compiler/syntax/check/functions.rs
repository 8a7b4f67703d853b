//! Functions, and the patterns of `match`.
//!
//! In: `min(a, b)`, `frontier(C)`, the arms of a match. Out: nodes of the model. Invariant: a match covers every value;
//! its last arm applies if no other does.

use super::cover::LeftOut;
use super::expressions::{Scope, Typed, plural};
use super::names::{did_you_mean, listed};
use super::types::Type;
use super::{Checker, integer, number};
use crate::diagnostic::Diagnostic;
use crate::ids::ExpressionId;
use crate::model::{Domain, Expression, SetKind};
use crate::operators::{Binary, Unary};
use crate::source::Span;
use crate::syntax::ast::{
    At, Expr, ExprKind, Name, Occurrence, Pattern, PatternKind, Sign, Value, ValueKind,
};
use std::collections::HashMap;

const FUNCTIONS: [&str; 24] = [
    "min",
    "max",
    "abs",
    "exp",
    "ln",
    "log2",
    "sqrt",
    "floor",
    "ceil",
    "round",
    "sin",
    "cos",
    "ln_gamma",
    "logistic",
    "probit",
    "atan2",
    "pow",
    "mod",
    "norm",
    "rotate",
    "gradient",
    "frontier",
    "innermost",
    "first",
];

impl Checker<'_> {
    pub(super) fn call(
        &mut self,
        span: Span,
        name: &Name,
        arguments: &[Expr],
        scope: &Scope,
    ) -> Option<Typed> {
        let unary = |operator| Some(operator);
        let operator = match name.text.as_str() {
            "abs" => unary(Unary::Absolute),
            "exp" => unary(Unary::Exponential),
            "ln" => unary(Unary::NaturalLogarithm),
            "sqrt" => unary(Unary::SquareRoot),
            "floor" => unary(Unary::Floor),
            "ceil" => unary(Unary::Ceiling),
            "round" => unary(Unary::Round),
            "log2" => unary(Unary::BinaryLogarithm),
            "sin" => unary(Unary::Sine),
            "cos" => unary(Unary::Cosine),
            "ln_gamma" => unary(Unary::LnGamma),
            "probit" => unary(Unary::NormalCumulative),
            _ => None,
        };
        if let Some(operator) = operator {
            let [argument] = self.arguments(span, name, arguments)?;
            let id = self.number_of(argument, scope)?;
            return Some((self.node(span, Expression::Unary(operator, id)), Type::Number));
        }
        match name.text.as_str() {
            "logistic" => {
                let [argument] = self.arguments(span, name, arguments)?;
                let argument = self.number_of(argument, scope)?;
                Some((self.model.logistic(argument), Type::Number))
            }
            "min" | "max" => self.extreme(span, name, arguments, scope),
            "atan2" => self.of_two(span, name, arguments, Binary::ArcTangent, scope),
            "pow" => self.of_two(span, name, arguments, Binary::Power, scope),
            "mod" => self.of_two(span, name, arguments, Binary::Remainder, scope),
            "norm" => self.norm(span, name, arguments, scope),
            "rotate" => {
                let [vector, by] = self.arguments(span, name, arguments)?;
                let (first, second) =
                    (self.expression(vector, scope, None), self.expression(by, scope, None));
                let ((first, kind), (second, other)) = (first?, second?);
                let right = self.expect(vector.span(), &kind, &Type::Vector(3));
                let right = self.expect(by.span(), &other, &Type::Vector(3)) && right;
                let node = Expression::Vector("rotate".to_owned(), vec![first, second]);
                right.then(|| (self.node(span, node), Type::Vector(3)))
            }
            "gradient" => {
                self.complain_and_help(
                    span,
                    "`gradient` is only known under `norm`",
                    "write `norm(gradient(…, C))`",
                );
                None
            }
            "frontier" => self.frontier(span, name, arguments, scope),
            "innermost" => {
                let [cell] = self.arguments(span, name, arguments)?;
                let (at, set) = self.element_of(cell, scope)?;
                self.grid(set, cell.span())?;
                Some((self.node(span, Expression::Innermost { at }), Type::Boolean))
            }
            "first" => {
                let [family] = self.arguments(span, name, arguments)?;
                let ExprKind::Name(of) = &family.kind else {
                    self.complain(
                        family.span(),
                        format!("`first` needs a family, but `{family}` is not one"),
                    );
                    return None;
                };
                let family = Occurrence { at: family.at, name: of.clone(), index: Vec::new(), before: false };
                let family = self.family_along_a_range(&family, scope)?;
                Some((self.node(span, Expression::First { family, with: None }), Type::Number))
            }
            other => {
                let message = if super::named_forms::known_forms().any(|form| form == other) {
                    format!("`{other}` is a form, not a function")
                } else {
                    format!("function `{other}` is not known; the functions are {}", listed(FUNCTIONS, "and"))
                };
                let mut wrong = Diagnostic::new(name.span(), message);
                wrong.help = did_you_mean(other, FUNCTIONS);
                self.wrong.push(wrong);
                None
            }
        }
    }

    /// The arguments of a function or a form that takes this many.
    pub(super) fn arguments<'a, const N: usize>(
        &mut self,
        span: Span,
        name: &Name,
        arguments: &'a [Expr],
    ) -> Option<[&'a Expr; N]> {
        let found: Vec<&Expr> = arguments.iter().collect();
        let array = found.try_into().ok();
        if array.is_none() {
            let what = plural(N, "argument", "arguments");
            self.complain(span, format!("`{name}` takes {N} {what}, found {}", arguments.len()));
        }
        array
    }

    fn extreme(&mut self, span: Span, name: &Name, arguments: &[Expr], scope: &Scope) -> Option<Typed> {
        let operator = if name.text == "min" { Binary::Minimum } else { Binary::Maximum };
        let ids: Vec<_> = arguments.iter().map(|argument| self.number_of(argument, scope)).collect();
        let ids: Vec<ExpressionId> = ids.into_iter().collect::<Option<_>>()?;
        let ([first, rest @ ..], true) = (ids.as_slice(), ids.len() > 1) else {
            self.complain(span, format!("`{name}` takes two arguments or more, found {}", ids.len()));
            return None;
        };
        let mut result = *first;
        for id in rest {
            result = self.node(span, Expression::Binary(operator, result, *id));
        }
        Some((result, Type::Number))
    }

    fn of_two(
        &mut self,
        span: Span,
        name: &Name,
        arguments: &[Expr],
        operator: Binary,
        scope: &Scope,
    ) -> Option<Typed> {
        let [first, second] = self.arguments(span, name, arguments)?;
        let (first, second) = (self.number_of(first, scope), self.number_of(second, scope));
        let node = Expression::Binary(operator, first?, second?);
        Some((self.node(span, node), Type::Number))
    }

    /// `norm(gradient(map.H, C))`, optionally with the value of the field before the first cell, or the length of a
    /// vector.
    fn norm(&mut self, span: Span, name: &Name, arguments: &[Expr], scope: &Scope) -> Option<Typed> {
        let [argument] = self.arguments(span, name, arguments)?;
        if let ExprKind::Call(inner, parts) = &argument.kind
            && inner.text == "gradient"
        {
            let (field, cell, gap) = match parts.as_slice() {
                [field, cell, gap] => (field, cell, Some(gap)),
                _ => {
                    let [field, cell] = self.arguments(argument.span(), inner, parts)?;
                    (field, cell, None)
                }
            };
            let (at, set) = self.element_of(cell, scope)?;
            let (field, _) = self.foreign(field, Some(at), scope)?;
            self.grid(set, cell.span())?;
            let before = match gap {
                Some(gap) => Some(self.number_of(gap, scope)?),
                None => None,
            };
            return Some((self.node(span, Expression::GradientNorm { field, at, before }), Type::Number));
        }
        let (id, kind) = self.expression(argument, scope, None)?;
        if !matches!(kind, Type::Vector(_)) {
            let found = kind.words(self.model.so_far());
            self.complain(argument.span(), format!("`norm` takes a vector or a gradient, found {found}"));
            return None;
        }
        Some((self.node(span, Expression::Vector("norm".to_owned(), vec![id])), Type::Number))
    }

    /// `frontier(condition, C)`; `frontier(C)` takes the cells that are probably empty.
    fn frontier(&mut self, span: Span, name: &Name, arguments: &[Expr], scope: &Scope) -> Option<Typed> {
        let (condition, cell) = match arguments {
            [cell] => (None, cell),
            _ => {
                let [condition, cell] = self.arguments(span, name, arguments)?;
                (Some(condition), cell)
            }
        };
        let (at, set) = self.element_of(cell, scope)?;
        self.grid(set, cell.span())?;
        let condition = match condition {
            Some(condition) => self.truth_of(condition, scope)?,
            None => {
                let path = format!("map.P(O | {cell})");
                let occupied = self.node(span, Expression::Foreign { path, at: Some(at) });
                let half = self.node(span, Expression::Number(0.5));
                self.node(span, Expression::Binary(Binary::Less, occupied, half))
            }
        };
        Some((self.node(span, Expression::Frontier { condition, at }), Type::Boolean))
    }

    /// Marks a set as a grid.
    fn grid(&mut self, set: crate::ids::SetId, span: Span) -> Option<()> {
        let known = &self.model.so_far().sets[set];
        if matches!(known.kind, SetKind::Displacements(_)) {
            let message = format!("a cell was expected, but `{}` is a set of displacements", known.name);
            self.complain(span, message);
            return None;
        }
        self.model.set_kind(set, SetKind::Grid);
        Some(())
    }

    /// The conditions of all arms but the last.
    pub(super) fn conditions(
        &mut self,
        span: Span,
        on: &Expr,
        arms: &[&Pattern],
        scope: &Scope,
    ) -> Option<Vec<ExpressionId>> {
        let domain = self.domain_of(on);
        let (value, kind) = self.expression(on, scope, None)?;
        let domain = match (&kind, domain) {
            (Type::Boolean, _) => Some(Domain::Boolean),
            (Type::Label(domain), _) => Some(domain.clone()),
            (Type::Number, domain) => domain,
            (Type::Element(_) | Type::Vector(_), _) => {
                let found = kind.words(self.model.so_far());
                self.complain(
                    on.span(),
                    format!("`match` takes a truth value, a label or a number, found {found}"),
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
                    (self.pattern_value(low, domain.as_ref())?, self.pattern_value(high, domain.as_ref())?)
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
            (Some(Domain::Real | Domain::Bins(_)) | None, ValueKind::Number(sign, text)) => {
                number(text).map(|number| if *sign == Sign::Minus { -number } else { number })
            }
            (Some(domain), _) if domain.is_finite() => {
                let ordinal = self.ordinal(value, domain, None)?;
                Some((ordinal as i64 + domain.base()) as f64)
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
        }
        self.wrong.push(wrong);
        None
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

/// An expression that is a name, for forms that take one.
pub(super) fn as_name(expr: &Expr) -> Option<&Name> {
    match &expr.kind {
        ExprKind::Name(name) => Some(name),
        ExprKind::Group(inner) => as_name(inner),
        _ => None,
    }
}

/// The occurrence of a name.
pub(super) fn occurrence(name: &Name) -> Occurrence {
    Occurrence { at: At(name.span()), name: name.clone(), index: Vec::new(), before: false }
}
