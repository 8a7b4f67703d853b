//! Derived variables of a question: predicates, functions, elements and slices of families.
//!
//! In: the items of an ask as written. Out: a [`Derived`] for each item that is not a whole variable. Invariant: equal
//! items of a question share one derived variable; elements written as numbers lie in their family.

use super::expressions::Scope;
use super::types::Type;
use super::{Checker, Meaning, words};
use crate::diagnostic::Diagnostics;
use crate::ids::{ExpressionId, Id, ParameterId, SetId, VariableId};
use crate::model::{
    self, Bound, Derived, DerivedKind, Domain, Expression, Family, IndexSpace, Model, ModelBuilder,
    VariableUse, When,
};
use crate::source::Span;
use crate::syntax::ast::{
    Ask, At, Comments, Expr, ExprKind, Item, Name, Occurrence, Program, Range, Subject,
};

/// The derived variable of each item that has one, by span; `None` where it is invalid.
pub(super) type Found = Vec<(Span, Option<usize>)>;

/// Whether an ask has an item that is not a whole variable.
pub(super) fn derives(ask: &Ask) -> bool {
    let whole = |item: &&Item| matches!(&item.subject, Subject::Variable(it) if it.index.is_empty());
    !items(ask).all(|item| whole(&item)) || !predicted(ask).is_empty()
}

fn items(ask: &Ask) -> impl Iterator<Item = &Item> {
    let distributions = std::iter::once(&ask.distribution).chain(ask.from.iter().map(|it| &it.distribution));
    distributions.flat_map(|it| it.searched.iter().chain(&it.known))
}

/// An empty program, for questions to a model.
pub(super) fn nothing() -> Program {
    let name = Name { at: At::default(), text: String::new() };
    let (at, comments) = (At::default(), Comments::default());
    Program { at, comments, name, plate: None, sections: Vec::new(), closing: Vec::new() }
}

impl<'p> Checker<'p> {
    /// A checker of questions to a model.
    pub(super) fn of(model: &Model, program: &'p Program) -> Self {
        let mut checker = Self { model: ModelBuilder::of(model.clone()), ..Self::new(program, &[]) };
        let mut declare = |name: &str, meaning| {
            checker.names.insert(name.to_owned(), (meaning, Span::default()));
        };
        let sets = (0..model.sets.len()).map(SetId::new);
        sets.for_each(|id| declare(&model.sets[id].name, Meaning::Set(id)));
        let parameters = (0..model.parameters.len()).map(ParameterId::new);
        parameters.for_each(|id| declare(&model.parameters[id].name, Meaning::Parameter(id)));
        let variables = model.variables.iter().filter(|(_, variable)| variable.previous_of.is_none());
        variables.for_each(|(id, variable)| declare(&variable.name, Meaning::Variable(id)));
        checker
    }

    /// Adds the derived variables of an ask to those of its question.
    pub(super) fn derive(&mut self, ask: &Ask, derived: &mut Vec<Derived>) -> Found {
        let mut found = Vec::new();
        let over_time = words::read(ask, &mut Diagnostics::default()).1.is_over_time();
        let from = ask.from.iter().map(|it| &it.distribution);
        let columns: Vec<Span> = std::iter::once(&ask.distribution)
            .chain(from)
            .flat_map(|it| &it.known)
            .filter(|item| over_time && item.evidence.is_none())
            .map(|item| item.at.0)
            .collect();
        let predicted = predicted(ask);
        let start = derived.len();
        let known =
            ask.distribution.known.iter().filter(|item| item.evidence.is_none() && ask.from.is_none());
        let given: Vec<Expr> = known
            .filter_map(
                |item| if let Subject::Term(term) = &item.subject { Some(term.clone()) } else { None },
            )
            .collect();
        let searched: Vec<Span> = ask.distribution.searched.iter().map(|item| item.at.0).collect();
        for item in items(ask) {
            if predicted.contains(&item.at.0) && self.derived_name(item).is_none() {
                if let Some(later) = self.later(item) {
                    derived.push(later);
                    found.push((item.at.0, Some(derived.len() - 1)));
                }
                continue;
            }
            let Some(name) = self.derived_name(item) else { continue };
            let holds = !searched.contains(&item.at.0) && item.evidence.is_none();
            // Known variables of an ask may occur in its functions.
            let same = |other: &Derived| other.name == name && (holds || other.kind != DerivedKind::Equation);
            let place = derived[start..].iter().position(same).map(|place| start + place).or_else(|| {
                derived.push(self.derived(item, name, (holds, columns.contains(&item.at.0)), &given)?);
                Some(derived.len() - 1)
            });
            found.push((item.at.0, place));
        }
        found
    }

    /// A variable at the instant that is predicted, apart from the same variable as it is known up to now.
    fn later(&self, item: &Item) -> Option<Derived> {
        let Subject::Variable(occurrence) = &item.subject else { return None };
        let Some(Meaning::Variable(variable)) = self.meaning(&occurrence.name.text) else { return None };
        let declared = &self.model.so_far().variables[variable];
        let (name, domain) = (occurrence.name.text.clone(), declared.domain.clone());
        if let Some(family) = declared.family {
            let IndexSpace::Range(range) = family.over else { return None };
            return range.high.size.is_none().then(|| sliced(name, variable, domain, range));
        }
        let use_ = VariableUse::from(variable);
        let (right, nodes) = (vec![use_.clone()], vec![Expression::Variable(use_)]);
        Some(Derived { name, kind: DerivedKind::Element, domain, over: None, right, nodes })
    }

    /// The name of the derived variable of an item; `None` for a whole variable, or for an index on a variable that is
    /// not a family.
    fn derived_name(&self, item: &Item) -> Option<String> {
        let divided = |name: &Name| match self.meaning(&name.text) {
            Some(Meaning::Variable(id)) => {
                let variable = &self.model.so_far().variables[id];
                variable.family.is_some() || matches!(variable.domain, Domain::Vector(_))
            }
            // An element of a field at the value of a variable.
            Some(Meaning::Parameter(_)) => true,
            _ => false,
        };
        match &item.subject {
            Subject::Term(term) => Some(term.to_string()),
            Subject::Slice(name, range) => divided(name).then(|| format!("{name}[{range}]")),
            Subject::Variable(it) => (!it.index.is_empty() && divided(&it.name)).then(|| it.to_string()),
        }
    }

    /// The variable that an item derives; `holds` where it is known to be true, `given` is all that is; `has_column` of
    /// an element that is read from the data at each instant.
    fn derived(
        &mut self,
        item: &Item,
        name: String,
        (holds, has_column): (bool, bool),
        given: &[Expr],
    ) -> Option<Derived> {
        let model = self.model.so_far();
        let first = model.expressions.len();
        let (parameters, variables) = (model.parameters.len(), model.variables.len());
        let scope = Scope::of_question(model);
        let span = item.at.0;
        let (expr, is_term) = match &item.subject {
            Subject::Slice(name, range) => return self.slice(name, range),
            Subject::Term(term) => (term.clone(), true),
            Subject::Variable(occurrence) => {
                let is_field = matches!(self.meaning(&occurrence.name.text), Some(Meaning::Parameter(_)));
                (element(occurrence), is_field)
            }
        };
        let before = self.wrong.0.len();
        let typed = self.expression(&expr, &scope, None);
        if self.model.so_far().variables.len() > variables {
            self.model.forget_variables(variables);
            self.wrong.0.truncate(before);
            self.complain(
                span,
                format!("`{expr}` is of the previous instant, which the program does not use"),
            );
            return None;
        }
        let model = self.model.so_far();
        if let Some(new) = model.parameters.values().nth(parameters) {
            let message = format!("`{}` is neither a variable nor a parameter of the program", new.name);
            self.complain(span, message);
            return None;
        }
        let (root, kind) = typed?;
        let equation = (holds && kind == Type::Boolean).then(|| self.equation(root, span)).flatten();
        let root = match equation {
            Some(difference) => difference,
            None => {
                self.where_given(root, &kind, span, (given.iter().filter(|other| **other != expr), &scope))
            }
        };
        let model = self.model.so_far();
        if root.position() + 1 < model.expressions.len() {
            let root = model.expressions[root].clone();
            self.node(span, root);
        }
        self.inside(first, span)?;
        let model = self.model.so_far();
        let root = ExpressionId::new(model.expressions.len() - 1);
        let right = parents(model, first, root);
        if right.is_empty() {
            self.complain(span, format!("`{name}` contains no variable"));
            return None;
        }
        let of_family = right.iter().all(|use_| model.variables[use_.variable].family.is_some());
        if let ([use_], true, true) = (right.as_slice(), has_column && !is_term, of_family)
            && let Some(place) = use_.element.and_then(|element| model.constant(element))
        {
            // A slice of one element: its values are read by the name of the element.
            let (variable, place) = (use_.variable, place as i64);
            let range = model::Range { low: place, high: Bound { size: None, offset: place } };
            let domain = model.variables[variable].domain.clone();
            self.model.take_nodes(first);
            return Some(sliced(name, variable, domain, range));
        }
        let (kind, domain) = match (&kind, is_term) {
            (_, false) if of_family => {
                (DerivedKind::Element, model.variables[right[0].variable].domain.clone())
            }
            (Type::Boolean, _) if equation.is_some() => (DerivedKind::Equation, Domain::Real),
            (Type::Boolean, _) => (DerivedKind::Predicate, Domain::Boolean),
            (Type::Label(domain), _) => (DerivedKind::Function, domain.clone()),
            (Type::Element(set), _) => (DerivedKind::Function, Domain::Set(*set)),
            (Type::Vector(length), _) => (DerivedKind::Function, Domain::Vector(*length)),
            (Type::Number, _) => {
                let values = model.values_of(root).and_then(Domain::of_numbers);
                (DerivedKind::Function, values.unwrap_or(Domain::Real))
            }
        };
        let local = |id: ExpressionId| ExpressionId::new(id.position() - first);
        let local = |use_: VariableUse| VariableUse { element: use_.element.map(local), ..use_ };
        let right = right.into_iter().map(local).collect();
        Some(Derived { name, kind, domain, over: None, right, nodes: self.model.take_nodes(first) })
    }

    /// `Y[1..=4]`
    fn slice(&mut self, name: &Name, written: &Range) -> Option<Derived> {
        let Some(Meaning::Variable(variable)) = self.meaning(&name.text) else { return None };
        let range = self.range(written)?;
        let declared = &self.model.so_far().variables[variable];
        let domain = declared.domain.clone();
        let Some(family) = declared.family else {
            self.complain(written.at.0, format!("`{name}` is one variable, not a family: it takes no index"));
            return None;
        };
        if range.high.size.is_some() {
            let message = "the last element of a slice must be a number";
            self.complain(written.at.0, message);
            return None;
        }
        for number in [range.low, range.high.offset] {
            self.element_inside(variable, family, number as f64, written.at.0)?;
        }
        Some(sliced(format!("{name}[{written}]"), variable, domain, range))
    }

    /// Refuses elements, written as numbers, that are outside their family.
    fn inside(&mut self, first: usize, span: Span) -> Option<()> {
        let model = self.model.so_far();
        let uses = (first..model.expressions.len()).filter_map(|place| {
            let Expression::Variable(use_) = &model.expressions[ExpressionId::new(place)] else {
                return None;
            };
            let number = model.constant(use_.element?)?;
            Some((use_.variable, model.variables[use_.variable].family?, number))
        });
        for (variable, family, number) in uses.collect::<Vec<_>>() {
            self.element_inside(variable, family, number, span)?;
        }
        Some(())
    }

    fn element_inside(
        &mut self,
        variable: VariableId,
        family: Family,
        number: f64,
        span: Span,
    ) -> Option<()> {
        let model = self.model.so_far();
        let first = family.over.first();
        let count = model.index_count(&family.over);
        let position = number - first as f64;
        if number.fract() == 0.0 && position >= 0.0 && count.is_none_or(|count| position < count as f64) {
            return Some(());
        }
        let name = model.spelled(variable);
        let has = match (family.over, count) {
            (_, Some(count)) => format!("has the elements {first}..={}", first + count as i64 - 1),
            (IndexSpace::Set(_), None) => "counts its elements from 0".to_owned(),
            (IndexSpace::Range(_), None) => format!("has the elements from {first} on"),
        };
        self.complain(span, format!("`{name}` {has}: there is no `{name}[{number}]`"));
        None
    }
}

impl Scope {
    /// The scope of a question: all variables, and the elements of sets by their numbers.
    fn of_question(model: &Model) -> Self {
        let visible = model.variables.ids().collect();
        let head = "the question".to_owned();
        Self { head, visible, products: Vec::new(), bound: Vec::new(), numbered: true }
    }
}

/// The searched variables of a prediction that are known too: up to now, not at the instant that is predicted.
fn predicted(ask: &Ask) -> Vec<Span> {
    if !matches!(words::read(ask, &mut Diagnostics::default()).1, When::Predict(_)) {
        return Vec::new();
    }
    let name = |item: &Item| match &item.subject {
        Subject::Variable(occurrence) if occurrence.index.is_empty() && !occurrence.before => {
            Some(occurrence.name.text.clone())
        }
        _ => None,
    };
    let known: Vec<Option<String>> = ask.distribution.known.iter().map(name).collect();
    let is_known = |item: &&Item| name(item).is_some() && known.contains(&name(item));
    ask.distribution.searched.iter().filter(is_known).map(|item| item.at.0).collect()
}

/// Some elements of a family, each the element of its index.
fn sliced(name: String, variable: VariableId, domain: Domain, range: model::Range) -> Derived {
    let element = VariableUse { variable, element: Some(ExpressionId::new(0)) };
    let nodes = vec![Expression::Index(0), Expression::Variable(element.clone())];
    Derived { name, kind: DerivedKind::Element, domain, over: Some(range), right: vec![element], nodes }
}

/// `Y[3]` as an expression.
fn element(occurrence: &Occurrence) -> Expr {
    let at = occurrence.at;
    let name = Expr { at, kind: ExprKind::Name(occurrence.name.clone()) };
    let indexed = Expr { at, kind: ExprKind::Index(Box::new(name), occurrence.index.clone()) };
    match occurrence.before {
        true => Expr { at, kind: ExprKind::Before(Box::new(indexed)) },
        false => indexed,
    }
}

/// The variables in an expression, each once; for a family its elements, where all of them are known.
fn parents(model: &Model, first: usize, root: ExpressionId) -> Vec<VariableUse> {
    let mut found: Vec<(VariableUse, Option<f64>)> = Vec::new();
    for place in first..=root.position() {
        let (use_, element) = match &model.expressions[ExpressionId::new(place)] {
            Expression::Variable(use_) => {
                let element = use_.element.and_then(|id| model.constant(id));
                (VariableUse { element: use_.element.filter(|_| element.is_some()), ..use_.clone() }, element)
            }
            Expression::First { family, .. } => (VariableUse::from(*family), None),
            _ => continue,
        };
        let same =
            |(other, at): &(VariableUse, Option<f64>)| other.variable == use_.variable && *at == element;
        if Some(use_.variable) != model.plate_index() && !found.iter().any(same) {
            found.push((use_, element));
        }
    }
    let whole: Vec<VariableId> =
        found.iter().filter(|(_, element)| element.is_none()).map(|(use_, _)| use_.variable).collect();
    found.retain(|(use_, element)| element.is_none() || !whole.contains(&use_.variable));
    found.into_iter().map(|(use_, _)| use_).collect()
}
