//! Values from elsewhere: elements of fields and families, and the answers of other programs.
//!
//! In: `sigma[ray]`, `Z[i]`, `map.P(O | C)`, `first(G with O at C)`. Out: nodes of the model. Invariant: an undeclared
//! lower-case name with indices is a field of real numbers over the sets of its indices, which must be the same at each
//! use.

use super::expressions::{Scope, Typed, plural};
use super::names::slipped;
use super::types::Type;
use super::{Checker, Meaning};
use crate::ids::{ExpressionId, ParameterId, SetId, VariableId};
use crate::model::{Bound, Domain, Expression, IndexSpace, ParameterKind, Range};
use crate::source::Span;
use crate::syntax::ast::{self, Expr, ExprKind, Occurrence};

impl Checker<'_> {
    /// `sigma[ray]`, `Z[i]`, `map.H[C]`
    pub(super) fn indexed(
        &mut self,
        span: Span,
        of: &Expr,
        indices: &[Expr],
        scope: &Scope,
    ) -> Option<Typed> {
        let ExprKind::Name(name) = &of.kind else {
            if matches!(of.kind, ExprKind::Field(..) | ExprKind::Answer { .. })
                && let [at] = indices
            {
                let (at, _) = self.element_of(at, scope)?;
                return self.foreign(of, Some(at), scope);
            }
            let before = self.wrong.0.len();
            return match (self.expression(of, scope, None), indices) {
                (Some((vector, Type::Vector(length))), [index]) => {
                    self.component(span, (vector, length), (of, index), scope)
                }
                (_, _) if self.wrong.0.len() > before => None,
                (_, _) => {
                    self.complain(span, format!("`{of}` cannot take an index"));
                    None
                }
            };
        };
        match self.meaning(&name.text) {
            Some(Meaning::Parameter(parameter)) => self.field(span, parameter, indices, scope),
            Some(Meaning::Variable(id)) => {
                let variable = &self.model.so_far().variables[id];
                if let (Domain::Vector(length), None, [index]) = (&variable.domain, variable.family, indices)
                {
                    let length = *length;
                    let (vector, _) = self.expression(of, scope, None)?;
                    return self.component(span, (vector, length), (of, index), scope);
                }
                let Some(family) = self.model.so_far().variables[id].family else {
                    self.complain(span, format!("`{name}` is one variable, not a family: it takes no index"));
                    return None;
                };
                let [index] = indices else {
                    self.complain(span, format!("`{name}` takes one index, but there are {}", indices.len()));
                    return None;
                };
                let element = self.index(index, &family.over, scope)?;
                self.value_of(id, Some(element), span, scope)
            }
            Some(Meaning::Set(_)) => {
                self.complain(span, format!("`{name}` is a set: it takes no index"));
                None
            }
            meaning => {
                if meaning.is_none() && name.text.starts_with(char::is_uppercase) {
                    // A separate error, with a suggestion.
                    return self.expression(of, scope, None);
                }
                let parameter = self.declared_by_use(name, indices, ParameterKind::Real, scope)?;
                self.field(span, parameter, indices, scope)
            }
        }
    }

    /// A component of a vector of this length.
    pub(super) fn component(
        &mut self,
        span: Span,
        (vector, length): (ExpressionId, usize),
        (of, index): (&Expr, &Expr),
        scope: &Scope,
    ) -> Option<Typed> {
        let at = self.number_of(index, scope)?;
        let number = self.model.so_far().constant(at);
        if let Some(number) =
            number.filter(|number| !(number.fract() == 0.0 && (0.0..length as f64).contains(number)))
        {
            let last = length.saturating_sub(1);
            let message = format!("`{of}` has the components 0..={last}: there is no `{of}[{number}]`");
            self.complain(index.span(), message);
            return None;
        }
        let component = Expression::Vector("component".to_owned(), vec![vector, at]);
        Some((self.node(span, component), Type::Number))
    }

    fn field(
        &mut self,
        span: Span,
        parameter: ParameterId,
        indices: &[Expr],
        scope: &Scope,
    ) -> Option<Typed> {
        let declared = &self.model.so_far().parameters[parameter];
        let (name, over) = (declared.name.clone(), declared.over.clone());
        if over.len() != indices.len() {
            let expected = over.len();
            let message = format!(
                "`{name}` takes {expected} {}, found {}",
                plural(expected, "index", "indices"),
                indices.len()
            );
            self.complain(span, message);
            return None;
        }
        let found: Vec<_> =
            indices.iter().zip(&over).map(|(index, over)| self.index(index, over, scope)).collect();
        let indices = found.into_iter().collect::<Option<_>>()?;
        let kind = self.kind_of(parameter);
        Some((self.node(span, Expression::Parameter { parameter, indices }), kind))
    }

    /// The kind of the value of a parameter.
    pub(super) fn kind_of(&self, parameter: ParameterId) -> Type {
        match self.model.so_far().parameters[parameter].kind {
            ParameterKind::Element(set) => Type::Element(set),
            _ => Type::Number,
        }
    }

    /// An undeclared field that is the index of an element: `school[row]` in `Alpha[school[row]]` has elements of the set of
    /// `Alpha`.
    pub(super) fn declare_index(&mut self, index: &Expr, set: SetId, scope: &Scope) {
        if let ExprKind::Index(of, indices) = &index.kind
            && let ExprKind::Name(name) = &of.kind
            && self.meaning(&name.text).is_none()
            && !name.text.starts_with(char::is_uppercase)
        {
            self.declared_by_use(name, indices, ParameterKind::Element(set), scope);
        }
    }

    fn declared_by_use(
        &mut self,
        name: &ast::Name,
        indices: &[Expr],
        kind: ParameterKind,
        scope: &Scope,
    ) -> Option<ParameterId> {
        let declared = self.names.iter().filter(|(_, (meaning, _))| matches!(meaning, Meaning::Parameter(_)));
        if let Some(meant) = slipped(&name.text, declared.map(|(name, _)| name.as_str())) {
            let (message, help) = (format!("unknown name `{name}`"), format!("did you mean `{meant}`?"));
            self.complain_and_help(name.span(), message, help);
            return None;
        }
        let spaces: Vec<_> = indices.iter().map(|index| self.space_of(index, scope)).collect();
        let spaces: Vec<IndexSpace> = spaces.into_iter().collect::<Option<_>>()?;
        Some(self.implicit(name, kind, spaces))
    }

    /// A parameter declared by its use.
    pub(super) fn implicit(
        &mut self,
        name: &ast::Name,
        kind: ParameterKind,
        over: Vec<IndexSpace>,
    ) -> ParameterId {
        let parameter = self.model.parameter_over(&name.text, kind, Vec::new(), over);
        self.parameter_spans.insert(parameter, name.span());
        self.names.insert(name.text.clone(), (Meaning::Parameter(parameter), name.span()));
        parameter
    }

    /// The range of an index of an undeclared field.
    fn space_of(&mut self, index: &Expr, scope: &Scope) -> Option<IndexSpace> {
        if let ExprKind::Name(name) = &index.kind {
            if let Some((_, over)) = scope.products.iter().rev().find(|(product, _)| *product == name.text) {
                return Some(*over);
            }
            match self.domain_of(index) {
                Some(Domain::Finite { labels, range: Some(range) }) if labels.is_empty() => {
                    return Some(IndexSpace::Range(range));
                }
                // From 0 on, as in expressions.
                Some(domain @ (Domain::Boolean | Domain::Finite { range: None, .. })) => {
                    let high = Bound::constant(domain.count()? as i64 - 1);
                    return Some(IndexSpace::Range(Range { low: 0, high }));
                }
                _ => {}
            }
        }
        match self.expression(index, scope, None)? {
            (_, Type::Element(set)) => Some(IndexSpace::Set(set)),
            _ => {
                let message = format!("the range of `{index}` is unknown");
                self.complain_and_help(
                    index.span(),
                    message,
                    "declare it: `parameters { name[Set] : real; }`",
                );
                None
            }
        }
    }

    /// An expression that must be an element of a set.
    pub(super) fn element_of(
        &mut self,
        expr: &Expr,
        scope: &Scope,
    ) -> Option<(ExpressionId, crate::ids::SetId)> {
        match self.expression(expr, scope, None)? {
            (id, Type::Element(set)) => Some((id, set)),
            (_, found) => {
                let found = found.words(self.model.so_far());
                self.complain(expr.span(), format!("expected a cell, an element of a set, found {found}"));
                None
            }
        }
    }

    /// `map.H` or `map.P(O | C)`, at a cell that is given or that the answer names.
    pub(super) fn foreign(&mut self, expr: &Expr, at: Option<ExpressionId>, scope: &Scope) -> Option<Typed> {
        let span = expr.span();
        let (of, known): (&Expr, &[Occurrence]) = match &expr.kind {
            ExprKind::Field(of, _) => (of, &[]),
            ExprKind::Answer { of, known, .. } => (of, known),
            _ => {
                self.complain(
                    span,
                    format!("expected the answer of another program, as `map.H`, found `{expr}`"),
                );
                return None;
            }
        };
        let mut base = of;
        while let ExprKind::Field(inner, _) | ExprKind::Index(inner, _) = &base.kind {
            base = inner;
        }
        match &base.kind {
            ExprKind::Name(name) if self.meaning(&name.text).is_none() => {}
            _ => {
                let message = format!("expected the name of another program before the dot, found `{base}`");
                self.complain(base.span(), message);
                return None;
            }
        }
        let mut at = at;
        for occurrence in known {
            let Some(Meaning::Variable(id)) = self.meaning(&occurrence.name.text) else { continue };
            let is_cell = matches!(self.model.so_far().variables[id].domain, Domain::Set(_));
            if is_cell && at.is_none() && !occurrence.before {
                at = Some(self.value_of(id, None, occurrence.at.0, scope)?.0);
            }
        }
        let path = expr.to_string();
        let otherwise = |node: &Expression| match node {
            Expression::Foreign { path: other, at: elsewhere } => {
                *other == path && elsewhere.is_some() != at.is_some()
            }
            _ => false,
        };
        if self.model.so_far().expressions.values().any(otherwise) {
            let message = format!("`{path}` is read at each cell in one place, and as one number in another");
            self.complain_and_help(span, &message, "write `P(… | C)` for the number at a cell");
            return None;
        }
        Some((self.node(span, Expression::Foreign { path, at }), Type::Number))
    }

    /// `first(G with O at C)`
    pub(super) fn first(
        &mut self,
        span: Span,
        family: &Occurrence,
        with: &Occurrence,
        index: &Expr,
        scope: &Scope,
    ) -> Option<Typed> {
        let family = self.family_along_a_range(family, scope)?;
        let over = self.model.so_far().variables[family].family?.over;
        let variable = self.variable_of(with)?;
        let (value, kind) = self.value_of(variable, None, with.at.0, scope)?;
        let right = self.expect(with.at.0, &kind, &Type::Boolean);
        let at = self.index(index, &over, scope)?;
        right.then(|| (self.node(span, Expression::First { family, with: Some((value, at)) }), Type::Number))
    }

    /// The family of booleans that `first` searches.
    pub(super) fn family_along_a_range(&mut self, family: &Occurrence, scope: &Scope) -> Option<VariableId> {
        let id = self.variable_of(family)?;
        if self.broken_variables.contains(&id) {
            return None;
        }
        let variable = &self.model.so_far().variables[id];
        let along = variable.family.is_some_and(|family| matches!(family.over, IndexSpace::Range(_)));
        if !along || variable.domain != Domain::Boolean || !family.index.is_empty() {
            let message =
                format!("`first` needs a family of truth values over a range, but `{family}` is not one");
            self.complain_and_help(family.at.0, message, "as `G[1..=N] : bool`");
            return None;
        }
        if !scope.visible.contains(&id) {
            let message = format!("`{family}` is not on the right of `{}`", scope.head);
            self.complain(family.at.0, message);
            return None;
        }
        Some(id)
    }
}
