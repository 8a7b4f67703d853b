//! Factors of some elements of a family: `P(Y[1])` beside `prod(t in 2..=N) { P(Y[t] | Y[t - 1]) }`.
//!
//! In: the factors of a family's elements, and their forms. Out: one factor of the whole family, whose form chooses by the index.
//! Invariant: each element has one factor.

use super::Checker;
use super::decomposition::key;
use super::expressions::Scope;
use super::forms::Target;
use crate::diagnostic::Diagnostic;
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::model::{Bound, Domain, Expression, Factor, Form, IndexSpace, Range, VariableUse};
use crate::operators::Binary;
use crate::radix;
use crate::source::Span;
use crate::syntax::ast::{self, Definition};

/// A factor of some elements of a family.
pub(super) struct Piece {
    key: String,
    span: Span,
    head: String,
    /// Its variables, and the product with the range of the whole family.
    own: Factor,
    /// The elements.
    range: Range,
    form: Option<Form>,
    /// Where its form stands, if there is one.
    defined: Option<Span>,
}

impl Piece {
    fn family(&self) -> VariableId {
        self.own.left[0].variable
    }
}

impl Checker<'_> {
    /// The elements that a factor distributes, where they may be some of a family.
    pub(super) fn range_of(&self, factor: &Factor) -> Option<(Range, Range)> {
        let [left] = factor.left.as_slice() else { return None };
        let model = self.model.so_far();
        let IndexSpace::Range(whole) = model.variables[left.variable].family?.over else { return None };
        match (&model.expressions[left.element?], factor.products.as_slice()) {
            (Expression::Number(at), []) => {
                Some((Range { low: *at as i64, high: Bound::constant(*at as i64) }, whole))
            }
            (Expression::Index(0), [(_, IndexSpace::Range(range))]) => Some((*range, whole)),
            _ => None,
        }
    }

    /// A factor of some elements.
    pub(super) fn piece(&mut self, written: &ast::Factor, mut own: Factor, range: Range, whole: Range) {
        let (key, span, head) = (key(written), written.at.0, written.to_string());
        // A field that a form reads has numbers for the whole family.
        own.products.iter_mut().for_each(|(_, over)| *over = IndexSpace::Range(whole));
        self.pieces.push(Piece { key, span, head, own, range, form: None, defined: None });
    }

    /// Makes one factor of the pieces of each family, once all are known.
    pub(super) fn bind_pieces(&mut self) {
        let mut families: Vec<VariableId> = self.pieces.iter().map(Piece::family).collect();
        families.sort_unstable();
        families.dedup();
        for family in families {
            let mut own: Vec<usize> =
                (0..self.pieces.len()).filter(|at| self.pieces[*at].family() == family).collect();
            own.sort_by_key(|at| self.pieces[*at].range.low);
            match self.whole(family, &own) {
                Some(factor) => {
                    let id = self.model.push_factor(factor);
                    let last = own[own.len() - 1];
                    self.factor_spans.insert(id, self.pieces[last].span);
                    self.wholes.push((id, own));
                }
                None => {
                    self.broken_variables.insert(family);
                    own.iter().for_each(|at| {
                        self.broken_heads.insert(self.pieces[*at].key.clone());
                    });
                }
            }
        }
    }

    /// The factor of a family whose pieces, in order, have each of its elements once.
    fn whole(&mut self, family: VariableId, pieces: &[usize]) -> Option<Factor> {
        let model = self.model.so_far();
        let name = model.spelled(family);
        let IndexSpace::Range(whole) = model.variables[family].family?.over else { return None };
        let one = |piece: &Piece| (piece.span, piece.head.clone());
        if let Some(other) = model.factor_of(family) {
            let (span, _) = one(&self.pieces[pieces[0]]);
            let message = format!("the elements of `{name}` have two distributions");
            let head = model.head(&model.factors[other]);
            let wrong = Diagnostic::new(span, message)
                .with_label(self.factor_spans[&other], format!("`{head}` is of all elements"));
            self.wrong.push(wrong.with_help("begin the product later, such as `prod(t in 2..=N)`"));
            return None;
        }
        let mut next = whole.low;
        for (place, at) in pieces.iter().enumerate() {
            let piece = &self.pieces[*at];
            let (span, head) = one(piece);
            let low = piece.range.low;
            if low != next {
                let message = match low < next {
                    true if low < whole.low => {
                        format!("`{name}` begins at {}: there is no `{name}[{low}]`", whole.low)
                    }
                    true => format!("`{name}[{low}]` has two distributions"),
                    false => format!("`{name}[{next}]` has no distribution"),
                };
                let wrong = Diagnostic::new(span, message);
                let wrong = match place {
                    0 => wrong,
                    _ => wrong
                        .with_label(self.pieces[pieces[place - 1]].span, "the factor of the elements before"),
                };
                self.wrong.push(wrong);
                return None;
            }
            let is_last = place + 1 == pieces.len();
            let high = piece.range.high;
            if is_last && high != whole.high || !is_last && high.size.is_some() {
                let model = self.model.so_far();
                let text = |range: Range| {
                    model.domain_text(&Domain::Finite { labels: Vec::new(), range: Some(range) })
                };
                let message = format!(
                    "`{name}` has the elements {}, but `{head}` is of {}",
                    text(whole),
                    text(piece.range)
                );
                self.complain(span, message);
                return None;
            }
            next = high.offset + 1;
        }
        let index = pieces.iter().rev().find_map(|at| self.pieces[*at].own.products.first());
        let index = index.map_or_else(|| "i".to_owned(), |(name, _)| name.clone());
        let mut right: Vec<VariableUse> = Vec::new();
        // The right-hand side of the last piece comes first, so that a table there keeps its rows.
        for at in pieces.iter().rev() {
            for use_ in &self.pieces[*at].own.right {
                let text = |use_: &VariableUse| self.model.so_far().use_name(use_, &[]);
                if right.iter().all(|other| text(other) != text(use_)) {
                    right.push(use_.clone());
                }
            }
        }
        let element = Some(self.model.expression(Expression::Index(0)));
        let left = vec![VariableUse { variable: family, element }];
        let products = vec![(index, IndexSpace::Range(whole))];
        Some(Factor { left, right, form: Form::Uniform, products })
    }

    /// Whether a key is that of a factor of some elements.
    pub(super) fn is_piece(&self, key: &str) -> bool {
        self.pieces.iter().any(|piece| piece.key == key)
    }

    /// The form of a factor of some elements.
    pub(super) fn piece_form(&mut self, key: &str, definition: &Definition) {
        let Some(position) = self.pieces.iter().position(|piece| piece.key == key) else { return };
        let (piece, span) = (&self.pieces[position], definition.head.at.0);
        if let Some(first) = piece.defined {
            let wrong = Diagnostic::new(span, format!("`{}` has two forms", definition.head));
            self.wrong.push(wrong.with_label(first, "first here"));
            return;
        }
        let model = self.model.so_far();
        let right: Vec<VariableId> = piece.own.right.iter().map(|use_| use_.variable).collect();
        let mut visible = right.clone();
        visible.extend(model.plate_index());
        let left = piece.family();
        let domain = model.variables[left].domain.clone();
        let (head, products) = (definition.head.to_string(), piece.own.products.clone());
        let mut scope = Scope { head, visible, products, bound: Vec::new(), numbered: false };
        let form = self.form(&definition.form, &Target { left, domain, right }, &mut scope);
        self.pieces[position].form = form;
        self.pieces[position].defined = Some(span);
    }

    /// Joins the forms of the pieces of each family; returns the factors.
    pub(super) fn join_pieces(&mut self) -> Vec<FactorId> {
        let wholes = std::mem::take(&mut self.wholes);
        let mut pieces: Vec<Option<Piece>> = std::mem::take(&mut self.pieces).into_iter().map(Some).collect();
        for (factor, own) in &wholes {
            let own: Vec<Piece> = own.iter().filter_map(|at| pieces[*at].take()).collect();
            match self.joined(*factor, own) {
                Some(form) => self.model.set_form(*factor, form),
                None => {
                    self.broken_forms.insert(*factor);
                }
            }
        }
        wholes.into_iter().map(|(factor, _)| factor).collect()
    }

    fn joined(&mut self, factor: FactorId, pieces: Vec<Piece>) -> Option<Form> {
        let missing: Vec<(Span, String)> = (pieces.iter())
            .filter(|piece| piece.defined.is_none())
            .map(|piece| (piece.span, piece.head.clone()))
            .collect();
        for (span, head) in missing {
            let help = format!("add `{head} = …;` to `forms`");
            self.complain_and_help(span, format!("`{head}` has no form"), help);
        }
        let several = pieces.len() > 1;
        let family = self.model.so_far().factors[factor].left[0].variable;
        let reads_itself = |piece: &Piece| piece.own.right.iter().any(|use_| use_.variable == family);
        let of_a_sequence = pieces.iter().any(reads_itself);
        let mut joined: Option<Form> = None;
        for piece in pieces.into_iter().rev() {
            let mut form = piece.form?;
            if several && is_unknown(&form) {
                let message =
                    format!("`{}` is `unknown`, but forms of some elements are not learned", piece.head);
                let help = match of_a_sequence {
                    true => "a sequence is learned over time: `P(X | X^-1) = unknown`".to_owned(),
                    false => {
                        let name = self.model.so_far().spelled(family);
                        format!(
                            "write one product of all elements, `prod(i) {{ P({name}[i] | …) }}`, whose form is `unknown by i`"
                        )
                    }
                };
                self.complain_and_help(piece.defined.unwrap_or(piece.span), message, help);
                return None;
            }
            if self.model.so_far().factors[factor].right.len() != piece.own.right.len() {
                form = self.without_keys(form, &piece.own.right)?;
            }
            joined = Some(match joined {
                None => form,
                Some(otherwise) => {
                    let index = self.node(piece.span, Expression::Index(0));
                    let last = self.node(piece.span, Expression::Number(piece.range.high.offset as f64));
                    let inside = Expression::Binary(Binary::LessOrEqual, index, last);
                    let condition = self.node(piece.span, inside);
                    Form::If { condition, then: Box::new(form), otherwise: Box::new(otherwise) }
                }
            });
        }
        joined
    }

    /// A form without a table, whose rows are those of its own right-hand side: a row is chosen by the values.
    pub(super) fn without_keys(&mut self, form: Form, right: &[VariableUse]) -> Option<Form> {
        match form {
            Form::Table(rows) => {
                let model = self.model.so_far();
                let counts: Option<Vec<usize>> =
                    right.iter().map(|use_| model.variables[use_.variable].domain.count()).collect();
                let counts = counts?;
                let mut chosen: Option<Form> = None;
                for (place, row) in rows.into_iter().enumerate().rev() {
                    let row = Form::Categorical(row);
                    chosen = Some(match chosen {
                        None => row,
                        Some(otherwise) => {
                            let ordinals = radix::in_order(place, counts.iter().copied());
                            let condition = self.all_equal(right, &ordinals)?;
                            Form::If { condition, then: Box::new(row), otherwise: Box::new(otherwise) }
                        }
                    });
                }
                chosen
            }
            Form::If { condition, then, otherwise } => Some(Form::If {
                condition,
                then: Box::new(self.without_keys(*then, right)?),
                otherwise: Box::new(self.without_keys(*otherwise, right)?),
            }),
            form => Some(form),
        }
    }

    /// Whether all variables have these values.
    fn all_equal(&mut self, right: &[VariableUse], ordinals: &[usize]) -> Option<ExpressionId> {
        let mut all: Option<ExpressionId> = None;
        for (use_, ordinal) in right.iter().zip(ordinals) {
            let number = self.model.so_far().variables[use_.variable].domain.number(*ordinal);
            let (value, number) =
                (self.model.expression(Expression::Variable(use_.clone())), self.model.number(number));
            let equal = self.model.binary(Binary::Equal, value, number);
            all = Some(match all {
                None => equal,
                Some(before) => self.model.binary(Binary::And, before, equal),
            });
        }
        all
    }
}

/// Whether a form or a part of it is to be learned.
fn is_unknown(form: &Form) -> bool {
    let mut found = matches!(form, Form::Unknown(_));
    form.each_part(&mut |part| found |= is_unknown(part));
    found
}
