//! Covariance matrices: the second argument of `normal` of a vector.
//!
//! In: the name of a parameter, or a matrix as written. Out: an expression for each entry, row by row. Invariant: a
//! matrix has a row and a column for each component of the vector.

use super::expressions::Scope;
use super::forms::Target;
use super::{Checker, Meaning};
use crate::diagnostic::Diagnostic;
use crate::ids::{ExpressionId, ParameterId};
use crate::model::{Expression, IndexSpace};
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind};

impl Checker<'_> {
    /// The covariance matrix that an argument is: a field over two ranges, or a list of rows. `None` where it is
    /// neither, so that it is a standard deviation; `Some(None)` where it is wrong.
    pub(super) fn covariance(
        &mut self,
        argument: &Expr,
        length: usize,
        target: &Target,
        scope: &Scope,
    ) -> Option<Option<Vec<Vec<ExpressionId>>>> {
        let span = argument.span();
        match &argument.kind {
            ExprKind::Group(inner) => self.covariance(inner, length, target, scope),
            ExprKind::Name(name) => {
                let bound = scope.bound.iter().any(|(bound, _)| *bound == name.text);
                let Some(Meaning::Parameter(parameter)) = self.meaning(&name.text).filter(|_| !bound) else {
                    return None;
                };
                let fields = self.model.so_far().parameters[parameter].over.len();
                (fields == 2).then(|| self.entries(span, parameter, length, target))
            }
            ExprKind::Vector(rows) => Some(self.rows(span, rows, length, target, scope)),
            _ => None,
        }
    }

    /// The entries of a field over two ranges.
    fn entries(
        &mut self,
        span: Span,
        parameter: ParameterId,
        length: usize,
        target: &Target,
    ) -> Option<Vec<Vec<ExpressionId>>> {
        let declared = &self.model.so_far().parameters[parameter];
        let (name, over) = (declared.name.clone(), declared.over.clone());
        let sizes: Option<Vec<usize>> =
            over.iter().map(|over| self.model.so_far().index_count(over)).collect();
        let Some([rows, columns]) = sizes.as_deref() else {
            let last = length.saturating_sub(1);
            let message = format!("`{name}` is used as a covariance matrix, but its size is not written");
            let help = format!("declare it over ranges of numbers: `{name}[0..={last}, 0..={last}]`");
            self.complain_and_help(span, message, help);
            return None;
        };
        self.has_size(span, &format!("`{name}`"), (*rows, *columns), length, target)?;
        let firsts: Vec<i64> = over.iter().map(IndexSpace::first).collect();
        let mut entry = |row: usize, column: usize| {
            let indices = [(firsts[0], row), (firsts[1], column)];
            let indices = indices.map(|(first, at)| first as f64 + at as f64);
            let indices = indices.map(|index| self.node(span, Expression::Number(index))).to_vec();
            self.node(span, Expression::Parameter { parameter, indices })
        };
        Some((0..length).map(|row| (0..length).map(|column| entry(row, column)).collect()).collect())
    }

    /// The entries of a matrix as written.
    fn rows(
        &mut self,
        span: Span,
        rows: &[Expr],
        length: usize,
        target: &Target,
        scope: &Scope,
    ) -> Option<Vec<Vec<ExpressionId>>> {
        let mut all: Vec<&[Expr]> = Vec::new();
        for row in rows {
            let ExprKind::Vector(entries) = &row.kind else {
                let message = format!(
                    "the second argument of `normal` of a vector is a number or a matrix, found `{row}` in a list"
                );
                let help = "a number is the standard deviation of all components; a covariance matrix is a list of \
                            rows, `[[1, 0.5], [0.5, 2]]`, with the variances on its diagonal";
                self.complain_and_help(row.span(), message, help);
                return None;
            };
            if let Some(first) = all.first().filter(|first| first.len() != entries.len()) {
                let (found, expected) = (entries.len(), first.len());
                let message = format!(
                    "the rows of a matrix have one length, but this has {found} entries, the first {expected}"
                );
                self.complain(row.span(), message);
                return None;
            }
            all.push(entries);
        }
        let columns = all.first().map_or(0, |row| row.len());
        self.has_size(span, "the matrix", (all.len(), columns), length, target)?;
        let found: Vec<_> = all.into_iter().map(|row| self.numbers(row, scope)).collect();
        found.into_iter().collect()
    }

    /// Refuses a matrix that has not a row and a column for each component.
    fn has_size(
        &mut self,
        span: Span,
        name: &str,
        (rows, columns): (usize, usize),
        length: usize,
        target: &Target,
    ) -> Option<()> {
        if (rows, columns) == (length, length) {
            return Some(());
        }
        let model = self.model.so_far();
        let left = model.spelled(target.left);
        let message = format!(
            "the covariance matrix of `{left}`, which is `{}`, is {length} × {length}, but {name} is {rows} × {columns}",
            model.domain_text(&target.domain)
        );
        self.wrong.push(Diagnostic::new(span, message));
        None
    }
}
