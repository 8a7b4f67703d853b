//! Tables: rows in the order of the right-hand values.
//!
//! In: rows as written, with or without keys. Out: [`Form::Table`], rows in the order of the right-hand values, the
//! last variable fastest. Invariant: with keys every combination has exactly one row.

use super::Checker;
use super::expressions::Scope;
use super::forms::Target;
use crate::diagnostic::Diagnostic;
use crate::ids::ExpressionId;
use crate::model::{Domain, Form};
use crate::radix;
use crate::source::Span;
use crate::syntax::ast::Row;

/// Limit of the rows of a table.
const MOST_ROWS: usize = 1 << 20;

impl Checker<'_> {
    pub(super) fn table(&mut self, span: Span, rows: &[Row], target: &Target, scope: &Scope) -> Option<Form> {
        if rows.is_empty() {
            self.complain(span, "this table has no rows");
            return None;
        }
        let entries: Vec<_> = rows.iter().map(|row| self.numbers(&row.values, scope)).collect();
        let entries: Option<Vec<Vec<ExpressionId>>> = entries.into_iter().collect();
        if rows.iter().all(|row| row.keys.is_empty()) {
            return entries.map(Form::Table);
        }
        if let Some(row) = rows.iter().find(|row| row.keys.is_empty()) {
            let message = "this row has no keys, but other rows do";
            self.complain_and_help(row.at.0, message, "write them before each row, or before none");
            return None;
        }
        self.keyed(span, rows, entries, target)
    }

    fn keyed(
        &mut self,
        span: Span,
        rows: &[Row],
        entries: Option<Vec<Vec<ExpressionId>>>,
        target: &Target,
    ) -> Option<Form> {
        let model = self.model.so_far();
        let right: Vec<(String, Domain)> = (target.right.iter())
            .map(|id| (model.variable_name(*id), model.variables[*id].domain.clone()))
            .collect();
        if target.right.iter().any(|id| self.broken_variables.contains(id)) {
            return None;
        }
        let mut total = 1usize;
        for (name, domain) in &right {
            let Some(count) = domain.count().filter(|count| total.saturating_mul(*count) <= MOST_ROWS) else {
                let text = self.model.so_far().domain_text(domain);
                let message = format!("a table needs values that can be listed, but `{name}` is `{text}`");
                self.complain(span, message);
                return None;
            };
            total *= count;
        }
        let mut places: Vec<Option<usize>> = vec![None; total];
        let mut whole = true;
        for (position, row) in rows.iter().enumerate() {
            let Some(place) = self.place_of(row, &right) else {
                whole = false;
                continue;
            };
            if let Some(first) = places[place].replace(position) {
                let message = format!("the row of {} is written twice", combination(place, &right));
                let wrong = Diagnostic::new(row.at.0, message).with_label(rows[first].at.0, "first here");
                self.wrong.push(wrong);
                whole = false;
            }
        }
        if !whole {
            return None;
        }
        if let Some(place) = places.iter().position(Option::is_none) {
            let found = rows.len();
            let message =
                format!("no row for {}: expected {total} rows, found {found}", combination(place, &right));
            self.complain(span, message);
            return None;
        }
        let mut entries: Vec<Option<Vec<ExpressionId>>> = entries?.into_iter().map(Some).collect();
        let ordered =
            places.into_iter().flatten().map(|position| entries[position].take().unwrap_or_default());
        Some(Form::Table(ordered.collect()))
    }

    /// The position of a row among all combinations.
    fn place_of(&mut self, row: &Row, right: &[(String, Domain)]) -> Option<usize> {
        if row.keys.len() != right.len() {
            let last = row.keys.last().map_or(row.at.0, |key| key.at.0);
            let at = row.keys.first().map_or(row.at.0, |key| key.at.0).to(last);
            let message = match right.len() {
                0 => "this factor has no right-hand variables: a row has no keys".to_owned(),
                count => format!(
                    "expected {count} keys, one for each variable on the right, found {}",
                    row.keys.len()
                ),
            };
            self.complain(at, message);
            return None;
        }
        // Every key is checked, so that all mistakes are reported.
        let digits = row.keys.iter().zip(right).map(|(key, (name, domain))| {
            Some((self.ordinal(key, domain, Some(name))?, domain.count().unwrap_or(1)))
        });
        let digits: Vec<Option<(usize, usize)>> = digits.collect();
        radix::position_inside(digits)
    }
}

/// A combination of values as text: `Rain = true, Sprinkler = false`.
fn combination(place: usize, right: &[(String, Domain)]) -> String {
    let counts = right.iter().rev().map(|(_, domain)| domain.count().unwrap_or(1).max(1));
    let word = |((name, domain), ordinal): (&(String, Domain), usize)| {
        format!("{name} = {}", domain.value_name(ordinal))
    };
    let ordinals = radix::ordinals(place, counts);
    let mut words: Vec<String> = right.iter().rev().zip(ordinals).map(word).collect();
    words.reverse();
    format!("`{}`", words.join(", "))
}
