//! Terms as mathematics.
//!
//! In: a term under its bindings. Out: one line of mathematics. Invariant: the printed equation is the computed one:
//! the printer reads the same terms as lowering.

use super::{Binding, Exact, FirstScan, Notation, Term, elision};
use crate::analysis::{of_expression, of_form};
use crate::ids::{ExpressionId, FactorId, TermId, VariableId};
use crate::model::{Expression, Finding, IndexSpace, Model, Value, VariableUse};
use crate::spelling::{exact, list};
use std::collections::BTreeMap;

/// Limit of the depth of printed sums.
const DEEPEST: usize = 24;

pub(super) struct Printer<'p> {
    pub(super) model: &'p Model,
    pub(super) exact: &'p Exact,
    pub(super) bindings: &'p BTreeMap<VariableId, Binding>,
    /// Whether the evidence has been substituted.
    pub(super) conditioned: bool,
    /// Whether constants have been dropped, so that the body is only proportional to the answer.
    pub(super) proportional: bool,
    /// Whether the forms of factors stand in their place.
    pub(super) forms: bool,
    pub(super) notation: Notation,
}

impl Printer<'_> {
    /// A step as an equation.
    pub(super) fn equation(&self, term: TermId) -> String {
        let (relation, right) = match (&self.exact.terms[term], self.evidence()) {
            (Term::Normalise(_, body), _) if self.proportional => ("∝", self.term(*body)),
            (Term::Normalise(_, body), Some(evidence)) => match self.exact.terms[*body] {
                Term::Joint => ("=", self.notation.ratio(&self.term(*body), &evidence)),
                _ => ("=", self.notation.over(&self.term(*body), &evidence)),
            },
            (Term::Normalise(_, body), None) => ("=", self.term(*body)),
            _ => ("=", self.term(term)),
        };
        self.notation.equation(&self.asked(), relation, &right)
    }

    /// The question, with the values substituted so far: `P(Rain | Wet)`, then `P(Rain | Wet = true)`.
    pub(super) fn asked(&self) -> String {
        let mut right = self.known();
        right.extend(self.plate());
        self.notation.distribution(&self.searched(), &right)
    }

    /// The probability of the evidence; `None` if there is none.
    pub(super) fn evidence(&self) -> Option<String> {
        let known = self.known();
        (!known.is_empty()).then(|| self.notation.distribution(&known, &self.plate()))
    }

    fn searched(&self) -> Vec<String> {
        self.exact.searched.iter().map(|variable| self.variable(*variable)).collect()
    }

    fn known(&self) -> Vec<String> {
        let known = self.exact.asks[0].known.iter().filter_map(|known| match known.evidence {
            Finding::Virtual(_) => {
                let name = self.notation.name(self.model, known.variable);
                self.conditioned.then(|| self.notation.likelihood(&name))
            }
            _ => Some(self.variable(known.variable)),
        });
        known.chain(self.index(true)).collect()
    }

    /// The plate's index, if no factor distributes it: then everything is conditioned on it.
    fn plate(&self) -> Vec<String> {
        self.index(false).into_iter().collect()
    }

    /// The plate's index, with or without a factor.
    fn index(&self, distributed: bool) -> Option<String> {
        let index = self.model.plate_index()?;
        let is_distributed = self.model.factor_of(index).is_some();
        (is_distributed == distributed).then(|| self.notation.name(self.model, index))
    }

    /// A term; deeply nested sums are omitted.
    pub(super) fn term(&self, id: TermId) -> String {
        self.term_at(id, 0)
    }

    fn term_at(&self, id: TermId, depth: usize) -> String {
        let notation = self.notation;
        match &self.exact.terms[id] {
            // Before the first sum, the joint distribution is over the variables of the question.
            Term::Joint => {
                let mut all = self.searched();
                all.extend(self.known());
                notation.distribution(&all, &self.plate())
            }
            Term::Factor(factor) => self.factor(*factor),
            Term::Likelihood(variable, _) => notation.likelihood(&self.variable(*variable)),
            Term::Possible(factor) => {
                let zero = notation.label("0");
                notation.indicator(&notation.relation(&self.factor(*factor), ">", &zero))
            }
            Term::Inside(variable) => {
                let domain = self.model.domain_text(&self.model.variables[*variable].domain);
                let domain = match notation {
                    Notation::Unicode => domain,
                    _ => notation.typeset(&domain),
                };
                let inside = notation.relation(&self.value_of(*variable), "∈", &domain);
                notation.indicator(&inside)
            }
            Term::Product(factors) if factors.is_empty() => notation.label("1"),
            Term::Product(factors) => {
                let part = |at: usize| match at + 1 == factors.len() {
                    true => self.term_at(factors[at], depth),
                    false => self.grouped(factors[at], depth),
                };
                let others = |count| elision::dots(notation, count, "factors");
                let parts = elision::list(factors.len(), part, others);
                parts.join(notation.choose(" ", " ", "<mspace width=\"0.15em\"/> "))
            }
            Term::Sum(..) if depth > DEEPEST => notation.text("…", "\\dots"),
            Term::Sum(over, body) => {
                let body = match self.exact.terms[*body] {
                    Term::Joint => self.joint_of_all(),
                    _ => self.term_at(*body, depth + 1),
                };
                let finite = |id: &VariableId| self.model.variables[*id].domain.is_finite();
                let (finite, real): (Vec<_>, Vec<_>) = over.iter().copied().partition(finite);
                let mut signs = String::new();
                if !real.is_empty() {
                    signs.push_str(&notation.integral(&notation.names(self.model, &real)));
                }
                if !finite.is_empty() {
                    signs.push_str(&notation.sum(&notation.names(self.model, &finite)));
                }
                format!("{signs}{body}")
            }
            Term::FirstScan(scan) => self.first_scan(scan),
            Term::At(_, body) | Term::Normalise(_, body) => self.term_at(*body, depth),
        }
    }

    fn joint_of_all(&self) -> String {
        let all = self.model.variables.ids().filter(|id| Some(*id) != self.model.plate_index());
        let all: Vec<_> = all.map(|id| self.variable(id)).chain(self.index(true)).collect();
        self.notation.distribution(&all, &self.plate())
    }

    /// A term followed by others.
    fn grouped(&self, id: TermId, depth: usize) -> String {
        match &self.exact.terms[id] {
            Term::Sum(..) | Term::FirstScan(_) => self.notation.group(&self.term_at(id, depth)),
            _ => self.term_at(id, depth),
        }
    }

    /// Σ_k P(first = k | …) P(Z | first = k).
    fn first_scan(&self, scan: &FirstScan) -> String {
        let family = self.notation.name(self.model, scan.family);
        let with = scan.with.map(|(value, at)| (self.expression(value, &[]), self.expression(at, &[])));
        let with = with.as_ref().map(|(value, at)| (value.as_str(), at.as_str()));
        let first = self.notation.first(&family, with);
        let event = vec![self.notation.item(&first, &self.notation.label("k"))];
        let factor = &self.model.factors[scan.factor];
        let left: Vec<_> = factor.left.iter().map(|use_| self.use_(use_, scan.factor)).collect();
        let mut given = of_form(self.model, scan.prior);
        for part in scan.with.iter().flat_map(|(value, at)| [*value, *at]) {
            of_expression(self.model, part, &mut given);
        }
        let order = |id: &VariableId| factor.right.iter().position(|use_| use_.variable == *id);
        let mut given: Vec<_> = given.into_iter().filter(|id| *id != scan.family).collect();
        given.sort_by_key(order);
        let given: Vec<_> = given.into_iter().map(|id| self.variable(id)).collect();
        let weight = self.notation.distribution(&event, &given);
        let sum = self.notation.sum(&[self.notation.label("k")]);
        format!("{sum}{weight} {}", self.notation.distribution(&left, &event))
    }

    fn factor(&self, id: FactorId) -> String {
        if self.forms {
            return self.form(id);
        }
        let factor = &self.model.factors[id];
        let list = |uses: &[VariableUse]| uses.iter().map(|use_| self.use_(use_, id)).collect::<Vec<_>>();
        let products: String =
            factor.products.iter().map(|(index, _)| self.notation.product(index)).collect();
        format!("{products}{}", self.notation.distribution(&list(&factor.left), &list(&factor.right)))
    }

    fn use_(&self, use_: &VariableUse, factor: FactorId) -> String {
        let text = self.variable(use_.variable);
        let Some(element) = use_.element else { return text };
        let index = self.expression(element, &self.model.factors[factor].products);
        let name = self.notation.name(self.model, use_.variable);
        let at = |name: &str| self.notation.element(name, &index);
        match self.bindings.get(&use_.variable) {
            // A family's values are given one for each element.
            Some(Binding::Value(Value::Given(_))) => {
                self.notation.item(&at(&name), &at(&self.value_of(use_.variable)))
            }
            _ => text.replacen(&name, &at(&name), 1),
        }
    }

    /// A variable or its binding.
    fn variable(&self, id: VariableId) -> String {
        let written = self.notation.name(self.model, id);
        match self.bindings.get(&id) {
            None => written,
            Some(Binding::Value(_)) => self.notation.item(&written, &self.value_of(id)),
            Some(_) => self.value_of(id),
        }
    }

    fn value_of(&self, id: VariableId) -> String {
        let name = |id| self.notation.name(self.model, id);
        match self.bindings.get(&id) {
            None => name(id),
            Some(Binding::Value(Value::Ordinal(ordinal))) => {
                self.notation.label(&self.model.value_name(id, *ordinal))
            }
            Some(Binding::Value(Value::Real(number))) => self.notation.label(&exact(*number)),
            Some(Binding::Value(Value::Vector(numbers))) => self.notation.label(&list(numbers)),
            Some(Binding::Value(Value::Given(given))) if *given == self.model.variable_name(id) => {
                self.notation.label(&given.to_lowercase())
            }
            Some(Binding::Value(Value::Given(given))) => self.notation.label(given),
            Some(Binding::Expression(expression)) => self.expression(*expression, &[]),
            Some(Binding::Solved(solution)) => {
                solution.written(&name(solution.of), |operand| self.expression(operand, &[]), "−")
            }
            Some(Binding::Antecedent { cell, displacement }) => {
                self.notation.relation(&name(*cell), "−", &name(*displacement))
            }
        }
    }

    fn expression(&self, id: ExpressionId, products: &[(String, IndexSpace)]) -> String {
        match &self.model.expressions[id] {
            Expression::Variable(use_) if use_.element.is_none() => {
                self.notation.name(self.model, use_.variable)
            }
            _ => match self.notation {
                Notation::Unicode => self.notation.label(&self.model.expression_text(id, products)),
                _ => self.notation.typeset(&self.model.expression_text(id, products)),
            },
        }
    }
}
