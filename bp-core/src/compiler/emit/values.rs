//! The values of variables in Rust: `bool`, integers, reals, and an enum for each variable with labels.
//!
//! In: a model. Out: the enums, and the type of each variable's values. Invariant: a label keeps its name if that is a
//! Rust identifier; a variable and its previous instant share their type.

use super::names::{Names, camel, is_identifier};
use super::text::Text;
use crate::ids::VariableId;
use crate::model::{Domain, Model, SetKind};
use std::collections::HashMap;

/// The enums of a program.
#[derive(Default)]
pub(super) struct Enums(HashMap<VariableId, String>);

/// The representation of a variable's values.
pub(super) struct ValueType {
    /// The type of a value.
    pub(super) name: String,
    /// The type that a value is converted from: also integers, if there are labels before them.
    pub(super) taken: String,
}

impl Enums {
    /// Writes an enum for each variable with labels.
    pub(super) fn write(model: &Model, names: &mut Names, text: &mut Text) -> Self {
        let mut enums = Self::default();
        // Present variables first, since X^-1 has the type of X.
        let (now, before): (Vec<_>, Vec<_>) =
            model.variables.iter().partition(|(_, variable)| variable.previous_of.is_none());
        for (id, variable) in now.into_iter().chain(before) {
            let Domain::Finite { labels, range } = &variable.domain else { continue };
            if labels.is_empty() {
                continue;
            }
            let of = variable.previous_of.filter(|of| model.variables[*of].domain == variable.domain);
            if let Some(known) = of.and_then(|of| enums.0.get(&of)).cloned() {
                enums.0.insert(id, known);
                continue;
            }
            let name = names.unique(&camel(&variable.name));
            write_enum(&name, &variable.name, &variable.domain, labels, range.is_some(), text);
            enums.0.insert(id, name);
        }
        enums
    }

    /// The type of a variable's values, inside the module of a question.
    pub(super) fn of(&self, model: &Model, variable: VariableId) -> ValueType {
        let plain = |name: &str| ValueType { name: name.to_owned(), taken: name.to_owned() };
        match &model.variables[variable].domain {
            Domain::Boolean => plain("bool"),
            Domain::Finite { range, .. } => match (self.0.get(&variable), range) {
                (None, _) => plain("i64"),
                (Some(name), None) => plain(&format!("super::{name}")),
                (Some(name), Some(_)) => {
                    let name = format!("super::{name}");
                    ValueType { taken: format!("impl Into<{name}>"), name }
                }
            },
            Domain::Set(set) if model.sets[*set].kind == SetKind::Grid => plain("[usize; 3]"),
            Domain::Set(_) => plain("usize"),
            Domain::Bins(_) | Domain::Real | Domain::Vector(_) => plain("f64"),
        }
    }
}

fn write_enum(name: &str, variable: &str, domain: &Domain, labels: &[String], ranges: bool, text: &mut Text) {
    let mut variants = Names::default();
    let variants: Vec<String> = (labels.iter().map(String::as_str))
        .chain(ranges.then_some("Number"))
        .map(|label| variants.unique(&if is_identifier(label) { label.to_owned() } else { camel(label) }))
        .collect();
    text.documented(&[format!("A value of `{variable}`.")]);
    text.line("#[derive(::core::clone::Clone, ::core::marker::Copy, ::core::cmp::PartialEq, ::core::cmp::Eq, ::core::hash::Hash, ::core::fmt::Debug)]");
    text.open(format!("pub enum {name}"));
    for (variant, label) in variants.iter().zip(labels) {
        text.documented(&[format!("`{label}`")]);
        text.line(format!("{variant},"));
    }
    let number = variants.get(labels.len());
    if let Some(number) = number {
        text.documented(&["An integer.".to_owned()]);
        text.line(format!("{number}(::core::primitive::i64),"));
    }
    text.close();
    let numbers: Vec<i64> = (0..labels.len()).map(|ordinal| domain.base() + ordinal as i64).collect();
    text.open(format!("impl ::bp_core::compiler::exec::compiled::Value for {name}"));
    text.line("#[inline]");
    text.open("fn number(self) -> ::core::primitive::f64");
    text.open("match self");
    for (variant, number) in variants.iter().zip(&numbers) {
        text.line(format!("Self::{variant} => {number}f64,"));
    }
    if let Some(number) = number {
        text.line(format!("Self::{number}(number) => number as ::core::primitive::f64,"));
    }
    text.close();
    text.close();
    text.line("#[inline]");
    text.open("fn of(number: ::core::primitive::f64) -> Self");
    text.open("match number as ::core::primitive::i64");
    let listed = if ranges { numbers.len() } else { numbers.len() - 1 };
    for (variant, number) in variants.iter().zip(&numbers).take(listed) {
        text.line(format!("{number} => Self::{variant},"));
    }
    text.line(match number {
        Some(number) => format!("number => Self::{number}(number),"),
        None => format!("_ => Self::{},", variants[listed]),
    });
    text.close();
    text.close();
    text.close();
    if let Some(number) = number {
        text.open(format!("impl ::core::convert::From<::core::primitive::i64> for {name}"));
        text.line(format!("fn from(number: ::core::primitive::i64) -> Self {{ Self::{number}(number) }}"));
        text.close();
    }
}
