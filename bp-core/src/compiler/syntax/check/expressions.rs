//! Name resolution and types of expressions.
//!
//! In: an expression as written, and its [`Scope`]. Out: a node of the model and its type. Invariant: an error is
//! reported once: `None` means that it has been reported.

use super::names::{did_you_mean, listed};
use super::types::Type;
use super::{Checker, Meaning, number};
use crate::diagnostic::Diagnostic;
use crate::ids::{ExpressionId, VariableId};
use crate::model::{Domain, Expression, IndexSpace, ParameterKind, Variable, VariableUse};
use crate::source::Span;
use crate::syntax::ast::{self, Expr, ExprKind};

/// A node and its type.
pub(super) type Typed = (ExpressionId, Type);

/// The names that an expression may use.
pub(super) struct Scope {
    /// The head of the factor of its form, as written.
    pub(super) head: String,
    /// The variables on the right of the factor, and the plate's index.
    pub(super) visible: Vec<VariableId>,
    /// The enclosing products.
    pub(super) products: Vec<(String, IndexSpace)>,
    /// Names bound by `let`, innermost last.
    pub(super) bound: Vec<(String, Typed)>,
    /// Whether a number denotes an element of a set, as in questions.
    pub(super) numbered: bool,
}

impl Scope {
    /// The scope of an index in the decomposition: only the products' indices.
    pub(super) fn of_indices(products: &[(String, IndexSpace)]) -> Self {
        let (head, products) = (String::new(), products.to_vec());
        Self { head, visible: Vec::new(), products, bound: Vec::new(), numbered: false }
    }
}

impl Checker<'_> {
    /// Adds a node with its span.
    pub(super) fn node(&mut self, span: Span, expression: Expression) -> ExpressionId {
        let id = self.model.expression(expression);
        self.expression_spans.insert(id, span);
        id
    }

    /// An expression; `hint` is the domain of labels in it.
    pub(super) fn expression(&mut self, expr: &Expr, scope: &Scope, hint: Option<&Domain>) -> Option<Typed> {
        let span = expr.span();
        match &expr.kind {
            ExprKind::Number(text) => match number(text) {
                Some(number) => Some((self.node(span, Expression::Number(number)), Type::Number)),
                None => {
                    self.complain(span, format!("the number `{text}` is too large"));
                    None
                }
            },
            ExprKind::Boolean(value) => {
                Some((self.node(span, Expression::Number(f64::from(u8::from(*value)))), Type::Boolean))
            }
            ExprKind::Group(inner) => self.expression(inner, scope, hint),
            ExprKind::Name(name) => self.name(name, scope, hint),
            ExprKind::Call(name, arguments) => self.call(span, name, arguments, scope),
            ExprKind::Index(of, indices) => self.indexed(span, of, indices, scope),
            ExprKind::Before(of) => self.previous_value(span, of, scope),
            ExprKind::Field(..) | ExprKind::Answer { .. } => self.foreign(expr, None, scope),
            ExprKind::First { family, with, index } => self.first(span, family, with, index, scope),
            ExprKind::Unary(op, operand) => self.unary(span, *op, operand, scope),
            ExprKind::Binary(..) => self.binary(expr, scope, hint),
            ExprKind::Vector(entries) => {
                let parts: Vec<_> = entries.iter().map(|entry| self.number_of(entry, scope)).collect();
                let parts: Vec<ExpressionId> = parts.into_iter().collect::<Option<_>>()?;
                let length = parts.len();
                Some((self.node(span, Expression::Vector("vector".to_owned(), parts)), Type::Vector(length)))
            }
            ExprKind::If(choice) => {
                let mut branches = Vec::new();
                for (condition, body) in &choice.branches {
                    let condition = self.truth_of(condition, scope);
                    branches.push((condition, self.expression(body, scope, hint), body.span()));
                }
                let (otherwise, kind) = self.expression(&choice.otherwise, scope, hint)?;
                self.choose(span, branches, otherwise, kind)
            }
            ExprKind::Match(choice) => {
                let arms: Vec<_> = choice.arms.iter().map(|(pattern, _)| pattern).collect();
                let conditions = self.conditions(span, &choice.on, &arms, scope);
                let bodies: Vec<_> = (choice.arms.iter())
                    .map(|(_, body)| self.expression(body, scope, hint).map(|typed| (typed, body.span())))
                    .collect();
                let mut bodies = bodies.into_iter().collect::<Option<Vec<_>>>()?;
                let conditions = conditions?;
                let ((otherwise, kind), _) = bodies.pop()?;
                let pairs = conditions.into_iter().zip(bodies);
                let branches =
                    pairs.map(|(condition, (typed, span))| (Some(condition), Some(typed), span)).collect();
                self.choose(span, branches, otherwise, kind)
            }
        }
    }

    /// A chain of `if`s whose branches all have one type.
    fn choose(
        &mut self,
        span: Span,
        branches: Vec<(Option<ExpressionId>, Option<Typed>, Span)>,
        otherwise: ExpressionId,
        kind: Type,
    ) -> Option<Typed> {
        let mut result = otherwise;
        let mut right = true;
        for (condition, body, place) in branches.into_iter().rev() {
            let (Some(condition), Some((then, found))) = (condition, body) else {
                right = false;
                continue;
            };
            if found != kind {
                let (found, last) = (found.words(self.model.so_far()), kind.words(self.model.so_far()));
                self.complain(
                    place,
                    format!("all branches must have one type, but this is {found} and the last is {last}"),
                );
                right = false;
            }
            result = self.node(span, Expression::If { condition, then, otherwise: result });
        }
        right.then_some((result, kind))
    }

    /// An expression that must be a number.
    pub(super) fn number_of(&mut self, expr: &Expr, scope: &Scope) -> Option<ExpressionId> {
        let (id, found) = self.expression(expr, scope, None)?;
        self.expect(expr.span(), &found, &Type::Number).then_some(id)
    }

    /// An expression that must be a truth value.
    pub(super) fn truth_of(&mut self, expr: &Expr, scope: &Scope) -> Option<ExpressionId> {
        let (id, found) = self.expression(expr, scope, None)?;
        self.expect(expr.span(), &found, &Type::Boolean).then_some(id)
    }

    pub(super) fn expect(&mut self, span: Span, found: &Type, expected: &Type) -> bool {
        if found == expected {
            return true;
        }
        let model = self.model.so_far();
        let message = format!("expected {}, found {}", expected.words(model), found.words(model));
        match (found, expected) {
            (Type::Boolean, Type::Number) => {
                self.complain_and_help(
                    span,
                    message,
                    "`if … { 1 } else { 0 }` turns a truth value into a number",
                );
            }
            _ => self.complain(span, message),
        }
        false
    }

    /// An index of a field or a family with this range.
    pub(super) fn index(&mut self, expr: &Expr, over: &IndexSpace, scope: &Scope) -> Option<ExpressionId> {
        if let IndexSpace::Set(set) = over {
            if let ExprKind::Name(name) = &expr.kind
                && scope.numbered
                && let elements = &self.model.so_far().sets[*set].elements
                && let Some(place) = elements.iter().position(|element| *element == name.text)
            {
                return Some(self.node(expr.span(), Expression::Number(place as f64)));
            }
            self.declare_index(expr, *set, scope);
        }
        if let ExprKind::Name(name) = &expr.kind
            && self.is_unbound_index(name, scope)
        {
            return None;
        }
        let (id, found) = self.expression(expr, scope, None)?;
        let expected = match over {
            IndexSpace::Set(_) if scope.numbered && found == Type::Number => return Some(id),
            IndexSpace::Set(set) => Type::Element(*set),
            // A boolean or a label has the number of its domain, from 0.
            IndexSpace::Range(_) if matches!(found, Type::Boolean | Type::Label(_)) => return Some(id),
            IndexSpace::Range(_) => Type::Number,
        };
        self.expect(expr.span(), &found, &expected).then_some(id)
    }

    /// Whether an index is a name that nothing binds; it is reported where a product would bind it, or a number is meant.
    fn is_unbound_index(&mut self, name: &ast::Name, scope: &Scope) -> bool {
        let text = &name.text;
        let is_bound = scope
            .products
            .iter()
            .map(|(own, _)| own)
            .chain(scope.bound.iter().map(|(own, _)| own))
            .any(|own| own == text);
        let help = match scope.products.as_slice() {
            _ if scope.numbered => {
                "an element is named by its number, as in `[1]`; the name alone is the whole family"
                    .to_owned()
            }
            [] if scope.head.is_empty() => {
                format!("a product binds an index: `prod({text}) {{ … }}` around the factor")
            }
            [.., (own, _)] => format!("the index here is `{own}`"),
            [] => return false,
        };
        if is_bound || self.meaning(text).is_some() || !text.starts_with(char::is_lowercase) {
            return false;
        }
        if self.unknown.insert(text.clone()) {
            self.complain_and_help(name.span(), format!("unknown index `{text}`"), help);
        }
        true
    }

    fn name(&mut self, name: &ast::Name, scope: &Scope, hint: Option<&Domain>) -> Option<Typed> {
        let (text, span) = (&name.text, name.span());
        if let Some((_, (id, kind))) = scope.bound.iter().rev().find(|(bound, _)| bound == text) {
            return Some((*id, kind.clone()));
        }
        if let Some(depth) = scope.products.iter().rposition(|(index, _)| index == text) {
            let kind = match scope.products[depth].1 {
                IndexSpace::Set(set) => Type::Element(set),
                IndexSpace::Range(_) => Type::Number,
            };
            return Some((self.node(span, Expression::Index(depth)), kind));
        }
        match self.meaning(text) {
            Some(Meaning::Variable(id)) => self.value_of(id, None, span, scope),
            Some(Meaning::Parameter(parameter)) => {
                let over = self.model.so_far().parameters[parameter].over.len();
                if over > 0 {
                    self.complain(
                        span,
                        format!("`{text}` takes {over} {}, found none", plural(over, "index", "indices")),
                    );
                    return None;
                }
                let kind = self.kind_of(parameter);
                Some((self.node(span, Expression::Parameter { parameter, indices: Vec::new() }), kind))
            }
            Some(Meaning::Learnt) => {
                let parameter = self.implicit(name, ParameterKind::Real, Vec::new());
                Some((
                    self.node(span, Expression::Parameter { parameter, indices: Vec::new() }),
                    Type::Number,
                ))
            }
            Some(Meaning::Set(_)) => {
                self.complain(span, format!("`{text}` is a set, not a value"));
                None
            }
            None => self.label(name, scope, hint),
        }
    }

    /// A label of the expected domain, or else of the only domain that has it.
    fn label(&mut self, name: &ast::Name, scope: &Scope, hint: Option<&Domain>) -> Option<Typed> {
        let (text, span) = (&name.text, name.span());
        let has = |domain: &&Domain| matches!(domain, Domain::Finite { labels, .. } if labels.contains(text));
        let model = self.model.so_far();
        let domain =
            hint.filter(has).or_else(|| model.variables.values().map(|variable| &variable.domain).find(has));
        if let Some(domain) = domain.cloned() {
            let ordinal = domain.ordinal_of(text)? as i64;
            let value = (ordinal + domain.base()) as f64;
            return Some((self.node(span, Expression::Number(value)), Type::of(&domain)));
        }
        if text == "pi" {
            return Some((self.node(span, Expression::Number(std::f64::consts::PI)), Type::Number));
        }
        if !self.unknown.insert(text.clone()) {
            return None;
        }
        let labels = hint.into_iter().chain(model.variables.values().map(|variable| &variable.domain));
        let labels = labels.filter_map(|domain| match domain {
            Domain::Finite { labels, .. } => Some(labels),
            _ => None,
        });
        let bound =
            scope.bound.iter().map(|(name, _)| name).chain(scope.products.iter().map(|(name, _)| name));
        let known = self.names.keys().chain(bound).chain(labels.flatten()).map(String::as_str);
        let mut known: Vec<&str> = known.collect();
        known.sort_unstable();
        let help = did_you_mean(text, known).or_else(|| {
            if text == "do" {
                return Some(
                    "an intervention is another program, in which the variable has a form of its own: `P(X) = dirac(true)`"
                        .to_owned(),
                );
            }
            let lower = text.starts_with(char::is_lowercase);
            lower.then(|| format!("declare it: `parameters {{ {text} : real; }}`"))
        });
        let mut wrong = Diagnostic::new(span, format!("unknown name `{text}`"));
        wrong.help = help;
        self.wrong.push(wrong);
        None
    }

    /// The value of a variable or of an element of a family, if it is in scope.
    pub(super) fn value_of(
        &mut self,
        id: VariableId,
        element: Option<ExpressionId>,
        span: Span,
        scope: &Scope,
    ) -> Option<Typed> {
        let model = self.model.so_far();
        let name = model.variable_name(id);
        if scope.head.is_empty() && !scope.visible.contains(&id) {
            self.complain(
                span,
                format!("an index is a number or the index of a product, but `{name}` is a variable"),
            );
            return None;
        }
        if !scope.visible.contains(&id) {
            let message = format!("`{name}` is not on the right of `{}`", scope.head);
            let help =
                format!("a form may only use the variables that its factor depends on: add `{name}` there");
            self.complain_and_help(span, message, help);
            return None;
        }
        let variable = &model.variables[id];
        if variable.family.is_some() && element.is_none() {
            let message = format!("`{name}` is a family: one value has to be picked from it");
            self.complain_and_help(
                span,
                message,
                format!("write `{name}[…]`, or `first({name} with … at …)`"),
            );
            return None;
        }
        let kind = Type::of(&variable.domain);
        Some((self.node(span, Expression::Variable(VariableUse { variable: id, element })), kind))
    }

    /// `X^-1`
    fn previous_value(&mut self, span: Span, of: &Expr, scope: &Scope) -> Option<Typed> {
        let (base, index) = match &of.kind {
            ExprKind::Index(base, indices) => (base.as_ref(), indices.first()),
            _ => (of, None),
        };
        let named = match &base.kind {
            ExprKind::Name(name) => self.meaning(&name.text),
            _ => None,
        };
        let Some(Meaning::Variable(id)) = named else {
            let message = format!("only a variable has a previous instant, and `{of}` is not one");
            self.complain_and_help(span, message, "`^` is not a power; write `pow(x, n)`");
            return None;
        };
        let before = self.before(id, span)?;
        let Variable { family, domain, .. } = self.model.so_far().variables[before].clone();
        if let (Domain::Vector(length), None, Some(index)) = (domain, family, index) {
            let (vector, _) = self.value_of(before, None, span, scope)?;
            return self.component(span, (vector, length), (base, index), scope);
        }
        let element = match (family, index) {
            (Some(family), Some(index)) => Some(self.index(index, &family.over, scope)?),
            _ => None,
        };
        self.value_of(before, element, span, scope)
    }

    /// The domain of an expression that is a variable.
    pub(super) fn domain_of(&self, expr: &Expr) -> Option<Domain> {
        let occurrence = match &expr.kind {
            ExprKind::Group(inner) | ExprKind::Before(inner) | ExprKind::Index(inner, _) => {
                return self.domain_of(inner);
            }
            ExprKind::Name(name) => name,
            _ => return None,
        };
        match self.meaning(&occurrence.text) {
            Some(Meaning::Variable(id)) => Some(self.model.so_far().variables[id].domain.clone()),
            _ => None,
        }
    }

    /// The names of the values of a domain, for a message.
    pub(super) fn values_text(&self, domain: &Domain) -> String {
        match domain {
            Domain::Boolean => listed(["false", "true"], "and"),
            Domain::Finite { labels, range: None } => listed(labels.iter().map(String::as_str), "and"),
            _ => format!("`{}`", self.model.so_far().domain_text(domain)),
        }
    }
}

/// The singular or the plural of a word.
pub(super) fn plural<'w>(count: usize, one: &'w str, many: &'w str) -> &'w str {
    if count == 1 { one } else { many }
}
