//! The decomposition: factors, and the products that repeat them.
//!
//! In: terms as written. Out: factors of the model, still without their forms, and the key by which a form's head finds
//! its factor. Invariant: a wrong factor is omitted, and no further errors are reported for its variables and its form.

use super::expressions::Scope;
use super::names::{did_you_mean, nearest};
use super::{Checker, Meaning};
use crate::diagnostic::Diagnostic;
use crate::ids::VariableId;
use crate::model::{Expression, Factor, Form, IndexSpace, VariableUse};
use crate::source::Span;
use crate::syntax::ast::{self, Occurrence, Term};

/// The key of a head: its variables, in any order on each side.
pub(super) fn key(factor: &ast::Factor) -> String {
    let side = |side: &[Occurrence]| {
        let mut names: Vec<String> = side.iter().map(Occurrence::to_string).collect();
        names.sort();
        names.join(" ")
    };
    let left = side(&factor.left);
    let left = if factor.initial { format!("initial({left})") } else { left };
    format!("{left} | {}", side(&factor.right))
}

impl Checker<'_> {
    /// The terms under these products.
    pub(super) fn terms(&mut self, terms: &[Term], products: &mut Vec<(String, IndexSpace)>) {
        for term in terms {
            match term {
                Term::Factor(factor) => self.factor(factor, products),
                Term::Product(product) => {
                    let over = match &product.space {
                        Some(space) => self.space(space),
                        None => self.range_of_index(product),
                    };
                    if let Some((_, first)) = self.names.get(&product.index.text) {
                        let message = format!("`{}` already has a meaning", product.index.text);
                        let wrong = Diagnostic::new(product.index.span(), message)
                            .with_label(*first, "declared here");
                        self.wrong.push(wrong.with_help("give the index another name"));
                    }
                    let Some(over) = over else {
                        self.forget(&product.terms);
                        continue;
                    };
                    products.push((product.index.text.clone(), over));
                    self.terms(&product.terms, products);
                    products.pop();
                }
            }
        }
    }

    /// The range of `prod(j)`: the index of the first family that it indexes.
    fn range_of_index(&mut self, product: &ast::Product) -> Option<IndexSpace> {
        let found = self.indexed_by(&product.index.text, &product.terms);
        if found.is_none() {
            let message =
                format!("the range of `{0}` is unknown: no family is indexed by `{0}` here", product.index);
            let help = format!("write `prod({} in Set) {{ … }}`", product.index);
            self.complain_and_help(product.index.span(), message, help);
        }
        found
    }

    fn indexed_by(&self, index: &str, terms: &[Term]) -> Option<IndexSpace> {
        terms.iter().find_map(|term| match term {
            Term::Product(product) => self.indexed_by(index, &product.terms),
            Term::Factor(factor) => factor.left.iter().chain(&factor.right).find_map(|occurrence| {
                let is_index =
                    |expr: &ast::Expr| matches!(&expr.kind, ast::ExprKind::Name(name) if name.text == index);
                occurrence.index.iter().any(is_index).then_some(())?;
                let Some(Meaning::Variable(id)) = self.meaning(&occurrence.name.text) else { return None };
                self.model.so_far().variables[id].family.map(|family| family.over)
            }),
        })
    }

    /// Suppresses further errors for the factors under a wrong product.
    fn forget(&mut self, terms: &[Term]) {
        for term in terms {
            match term {
                Term::Product(product) => self.forget(&product.terms),
                Term::Factor(factor) => self.forget_factor(factor),
            }
        }
    }

    fn forget_factor(&mut self, factor: &ast::Factor) {
        self.broken_heads.insert(key(factor));
        for occurrence in &factor.left {
            let meant = self.meaning(&occurrence.name.text).is_none().then(|| {
                let known =
                    self.names.iter().filter(|(_, (meaning, _))| matches!(meaning, Meaning::Variable(_)));
                nearest(&occurrence.name.text, known.map(|(name, _)| name.as_str()))
                    .first()
                    .and_then(|name| self.meaning(name))
            });
            if let Some(Some(Meaning::Variable(id))) = meant {
                self.broken_variables.insert(id);
            }
            if let Some(Meaning::Variable(id)) = self.meaning(&occurrence.name.text) {
                let model = self.model.so_far();
                let previous = model.variables.find(|variable| variable.previous_of == Some(id));
                self.broken_variables.extend(if occurrence.before { previous } else { Some(id) });
            }
        }
    }

    fn factor(&mut self, written: &ast::Factor, products: &[(String, IndexSpace)]) {
        let left = self.side(&written.left, products, true);
        let right = self.side(&written.right, products, false);
        let (Some(left), Some(right)) = (left, right) else { return self.forget_factor(written) };
        if !self.apart(written) {
            return self.forget_factor(written);
        }
        let products = products.to_vec();
        if written.initial {
            return self.initial_factor(written, Factor { left, right, form: Form::Uniform, products });
        }
        let own = Factor { left, right, form: Form::Uniform, products };
        if let Some((range, whole)) = self.range_of(&own)
            && range != whole
        {
            return self.piece(written, own, range, whole);
        }
        let id = self.model.push_factor(own);
        self.factor_spans.insert(id, written.at.0);
        // A second factor with the same head is reported by the model: its variable has two distributions.
        self.factors.entry(key(written)).or_insert(id);
    }

    /// Every variable occurs in a factor once.
    fn apart(&mut self, factor: &ast::Factor) -> bool {
        let mut seen: Vec<(String, Span, bool)> = Vec::new();
        for (is_left, occurrence) in
            factor.left.iter().map(|one| (true, one)).chain(factor.right.iter().map(|one| (false, one)))
        {
            let text = occurrence.to_string();
            if let Some((_, first, was_left)) = seen.iter().find(|(other, ..)| *other == text) {
                let message = match (was_left, is_left) {
                    (true, false) => format!("`{text}` is on both sides of the bar"),
                    _ => format!("`{text}` is written twice in this factor"),
                };
                let wrong = Diagnostic::new(occurrence.at.0, message).with_label(*first, "first here");
                self.wrong.push(wrong);
                return false;
            }
            seen.push((text, occurrence.at.0, is_left));
        }
        true
    }

    fn side(
        &mut self,
        side: &[Occurrence],
        products: &[(String, IndexSpace)],
        is_left: bool,
    ) -> Option<Vec<VariableUse>> {
        let uses: Vec<_> =
            side.iter().map(|occurrence| self.occurrence(occurrence, products, is_left)).collect();
        uses.into_iter().collect()
    }

    /// A variable in a factor.
    fn occurrence(
        &mut self,
        occurrence: &Occurrence,
        products: &[(String, IndexSpace)],
        is_left: bool,
    ) -> Option<VariableUse> {
        let variable = self.variable_of(occurrence)?;
        let family = self.model.so_far().variables[variable].family;
        let name = &occurrence.name.text;
        let span = occurrence.at.0;
        match (family, occurrence.index.as_slice()) {
            (None, []) => Some(variable.into()),
            (None, _) => {
                self.complain(span, format!("`{name}` is one variable, not a family: it takes no index"));
                None
            }
            (Some(_), []) if is_left => {
                let message = format!("`{name}` is a family: its elements are distributed one by one");
                self.complain_and_help(span, message, format!("write `prod(j) {{ P({name}[j] | …) }}`"));
                None
            }
            (Some(_), []) => Some(variable.into()),
            (Some(family), [index]) => {
                let scope = Scope::of_indices(products);
                let element = self.index(index, &family.over, &scope)?;
                let is_one = match self.model.so_far().expressions[element] {
                    Expression::Index(_) => true,
                    Expression::Number(at) => {
                        products.is_empty()
                            && at.fract() == 0.0
                            && matches!(family.over, IndexSpace::Range(_))
                    }
                    _ => false,
                };
                if is_left && !is_one {
                    let message = format!("the elements of `{name}` are distributed under a product");
                    self.complain_and_help(span, message, format!("write `prod(j) {{ P({name}[j] | …) }}`"));
                    return None;
                }
                Some(VariableUse { variable, element: Some(element) })
            }
            (Some(_), more) => {
                self.complain(span, format!("`{name}` takes one index, but there are {}", more.len()));
                None
            }
        }
    }

    /// The variable of an occurrence, at its instant.
    pub(super) fn variable_of(&mut self, occurrence: &Occurrence) -> Option<VariableId> {
        let name = &occurrence.name;
        match self.meaning(&name.text) {
            Some(Meaning::Variable(id)) if !occurrence.before => Some(id),
            Some(Meaning::Variable(id)) => self.before(id, occurrence.at.0),
            Some(meaning) => {
                let what = match meaning {
                    Meaning::Set(_) => "a set",
                    _ => "a parameter",
                };
                let first = self.names[&name.text].1;
                let message = format!("a variable was expected, but `{}` is {what}", name.text);
                self.wrong.push(Diagnostic::new(name.span(), message).with_label(first, "declared here"));
                None
            }
            None => {
                let variables: Vec<String> =
                    self.model.so_far().variables.values().map(|variable| variable.name.clone()).collect();
                let mut wrong = Diagnostic::new(name.span(), format!("unknown variable `{}`", name.text));
                wrong.help = did_you_mean(&name.text, variables.iter().map(String::as_str));
                self.wrong.push(wrong);
                None
            }
        }
    }

    /// A variable at the previous instant.
    pub(super) fn before(&mut self, variable: VariableId, span: Span) -> Option<VariableId> {
        if self.model.so_far().plate_index() == Some(variable) {
            let name = &self.model.so_far().variables[variable].name;
            let message = format!("`{name}` is the plate's index: it has no previous instant");
            self.complain(span, message);
            return None;
        }
        let id = self.model.previous(variable);
        self.variable_spans.entry(id).or_insert(span);
        if self.broken_variables.contains(&variable) {
            self.broken_variables.insert(id);
        }
        Some(id)
    }
}
