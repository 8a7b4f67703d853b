//! The answer of a question whose variables are normal: read by variable, as means, variances and covariances.
//!
//! In: the searched variables. Out: `Answer` with its methods. Invariant: a vector or a family is an array of its numbers; over a
//! plate a method returns the numbers of all elements.

use super::names::{Names, snake};
use super::text::Text;
use crate::ids::VariableId;
use crate::model::Model;

/// A searched variable: its name, its first number in the law, and how many it has; `None`: one number.
struct Searched {
    name: String,
    first: usize,
    count: Option<usize>,
}

/// Writes `Answer`. `searched` are variables, elements of families, and components.
pub(super) fn answer(model: &Model, searched: &[(VariableId, Option<usize>, usize)], text: &mut Text) {
    let mut total = 0;
    let mut names = Names::default();
    let all: Vec<Searched> = (searched.iter())
        .map(|(id, elements, components)| {
            let count = elements.unwrap_or(1) * components;
            let first = total;
            total += count;
            let several = elements.is_some() || *components > 1;
            let name = names.unique(snake(&model.variable_name(*id)).trim_matches('_'));
            Searched { name, first, count: several.then_some(count) }
        })
        .collect();
    let over_plate = model.plate.is_some();
    let one = if over_plate { "&[T]" } else { "T" };
    let read = |what: String| if over_plate { what } else { format!("number({what})") };
    let mean = |row: usize| read(format!("means(&self.outputs.moments, {total}, {row})"));
    let covariance = |one: usize, other: usize| {
        read(format!("covariances(&self.outputs.moments, {total}, {one}, {other})"))
    };
    text.line("/// The answer, a normal distribution, read by variable; zeros before the first instant.\n#[derive(Clone, Debug, Default)]");
    text.open("pub struct Answer<T>");
    text.line("outputs: Outputs<T>,\nreport: Report,");
    text.close();
    text.open("impl<T: Scalar> Answer<T>");
    text.line("/// The report beside the numbers.\npub fn report(&self) -> Report { self.report }");
    let mut method = |name: String, what: String, kind: String, value: String| {
        text.documented(&[what]);
        text.line("#[inline]");
        text.line(format!("pub fn {name}(&self) -> {kind} {{ {value} }}"));
    };
    let list = |count: usize, of: &dyn Fn(usize) -> String| {
        format!("[{}]", (0..count).map(of).collect::<Vec<_>>().join(", "))
    };
    for Searched { name, first, count } in &all {
        let suffix = if all.len() == 1 { String::new() } else { format!("_{name}") };
        let first = *first;
        let array = |of: &dyn Fn(usize) -> String| match count {
            None => (one.to_owned(), of(0)),
            Some(count) => (format!("[{one}; {count}]"), list(*count, of)),
        };
        let (kind, value) = array(&|place| mean(first + place));
        method(format!("mean{suffix}"), format!("The mean of `{name}`."), kind, value);
        let (kind, value) = array(&|place| covariance(first + place, first + place));
        method(format!("variance{suffix}"), format!("The variance of `{name}`."), kind, value);
        if !over_plate {
            let deviation =
                |place| format!("Scalar::square_root({})", covariance(first + place, first + place));
            let (kind, value) = array(&deviation);
            method(format!("deviation{suffix}"), format!("The standard deviation of `{name}`."), kind, value);
        }
        if let Some(count) = *count {
            let row = |row: usize| list(count, &|column| covariance(first + row, first + column));
            let kind = format!("[[{one}; {count}]; {count}]");
            method(
                format!("covariance{suffix}"),
                format!("The covariance matrix of `{name}`."),
                kind,
                list(count, &row),
            );
        }
    }
    for (place, one_of) in all.iter().enumerate() {
        for other in &all[place + 1..] {
            let (rows, columns) = (one_of.count.unwrap_or(1), other.count.unwrap_or(1));
            let (name, what) = (
                format!("covariance_{}_{}", one_of.name, other.name),
                format!(
                    "The covariance of `{}` with `{}`: a row for each number of the first.",
                    one_of.name, other.name
                ),
            );
            let (kind, value) = match (one_of.count, other.count) {
                (None, None) => (one.to_owned(), covariance(one_of.first, other.first)),
                _ => {
                    let row = |row: usize| {
                        list(columns, &|column| covariance(one_of.first + row, other.first + column))
                    };
                    (format!("[[{one}; {columns}]; {rows}]"), list(rows, &row))
                }
            };
            method(name, what, kind, value);
        }
    }
    text.close();
}
