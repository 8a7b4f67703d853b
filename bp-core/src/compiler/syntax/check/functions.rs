//! Functions.
//!
//! In: `min(a, b)`, `frontier(C)`. Out: nodes of the model. Invariant: a function has the arguments that it takes, each of
//! its type.

use super::Checker;
use super::expressions::{Scope, Typed, plural};
use super::names::{did_you_mean, listed};
use super::types::Type;
use crate::diagnostic::Diagnostic;
use crate::ids::ExpressionId;
use crate::model::{Expression, SetKind};
use crate::operators::{Binary, Unary};
use crate::source::Span;
use crate::syntax::ast::{At, Expr, ExprKind, Name, Occurrence};

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
                let is_instant = |argument: &Expr| {
                    let text: String = argument.to_string().split_whitespace().collect();
                    ["t", "t-1", "t+1", "k", "k-1", "n-1"].contains(&text.as_str())
                };
                wrong.help = match arguments {
                    [instant] if is_instant(instant) => Some(format!(
                        "over time `{other}` is the variable at each instant, and `{other}^-1` that of the instant before"
                    )),
                    _ if other == "do" => Some(
                        "an intervention is another program, in which the variable has a form of its own: `P(X) = dirac(true)`".to_owned(),
                    ),
                    _ => did_you_mean(other, FUNCTIONS),
                };
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
