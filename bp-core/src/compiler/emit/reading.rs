//! The answer of a question: read by the values of its variables, never by an index.
//!
//! In: the interface of a question. Out: `Answer` with a method for each ask: `p`, `entropy`, `argmax` and `max`,
//! `scores`. Invariant: the arguments are the searched variables, in the order of the ask, and then the known variables
//! without a value; over a plate a method returns the numbers of all elements, or takes the element last.

use super::best::{axis_count, is_over_plate, is_scores};
use super::interface::Interface;
use super::names::{Names, snake};
use super::text::Text;
use super::values::Enums;
use crate::ids::{AxisId, BufferId, VariableId};
use crate::kernel::{Extent, OutputKey};
use crate::lower::Output;
use crate::model::{Ask, Domain, Model, Statistic};
use std::collections::HashMap;

/// An answer with its arguments.
struct Reading {
    /// `, rain: bool`
    arguments: String,
    /// The conversion of arguments.
    conversions: String,
    /// The positions in the array: `(whole(rain, 0, 2), 2), `
    places: String,
}

/// The word of an ask.
fn word(model: &Model, output: &Output) -> &'static str {
    match output.ask.as_ref().map(|ask| &ask.statistic) {
        None => "ln_evidence",
        Some(Statistic::Entropy) => "entropy",
        Some(Statistic::Argmax { .. } | Statistic::Maximum) if is_scores(model, output) => "scores",
        Some(Statistic::Argmax { .. } | Statistic::Maximum) => "argmax",
        Some(_) => "p",
    }
}

/// The searched variables of an ask, as a part of a name.
pub(super) fn searched(model: &Model, output: &Output) -> String {
    output.ask.as_ref().map_or_else(String::new, |ask| searched_by(model, ask))
}

/// The searched variables of an ask, as a part of a name.
pub(super) fn searched_by(model: &Model, ask: &Ask) -> String {
    let names = ask.searched.iter().map(|item| {
        let variable = &model.variables[item.variable];
        let before = if variable.previous_of.is_some() { "previous_" } else { "" };
        format!("{before}{}", snake(&variable.name).trim_matches('_'))
    });
    names.collect::<Vec<_>>().join("_")
}

impl Interface<'_> {
    /// The extents of answers that are known only at run time.
    pub(super) fn open_extents(&self) -> Vec<Extent> {
        let mut open: Vec<Extent> = Vec::new();
        for axis in self.outputs().iter().flat_map(|id| &self.kernel.buffers[*id].axes) {
            let extent = self.kernel.axes[*axis].extent;
            if extent.known().is_none() && !open.contains(&extent) {
                open.push(extent);
            }
        }
        open
    }

    /// The number of values of an axis of an answer.
    fn count(&self, axis: AxisId) -> String {
        let extent = self.kernel.axes[axis].extent;
        match extent.known() {
            Some(known) => format!("{known}usize"),
            None => {
                let place = self.open_extents().iter().position(|open| *open == extent);
                format!("self.extents[{}]", place.expect("internal: it is an axis of an answer"))
            }
        }
    }

    /// The positions of the values of a variable; its axes are `axes`.
    fn places(&self, model: &Model, variable: VariableId, name: &str, axes: &[AxisId]) -> String {
        let declared = &model.variables[variable];
        let several = declared.family.is_some();
        let is_cell = |each: usize| each == 3 && !several;
        let mut places = String::new();
        for (element, axis) in axes.iter().enumerate() {
            let value =
                if several || is_cell(axes.len()) { format!("{name}[{element}]") } else { name.to_owned() };
            let count = self.count(*axis);
            let place = match &declared.domain {
                Domain::Bins(bins) => {
                    format!("bin({value}, &{:?}, {})", bins.edges(), bins.is_circle())
                }
                domain => format!("whole({value}, {}, {count})", domain.base()),
            };
            places.push_str(&format!("({place}, {count}), "));
        }
        places
    }

    /// The arguments of an answer: these variables, with their axes in the order of the array.
    fn reading(
        &self,
        model: &Model,
        enums: &Enums,
        inside: &[(VariableId, Vec<AxisId>)],
        order: &[VariableId],
    ) -> Reading {
        let mut names = Names::default();
        // The names that the methods use.
        let taken = ["self", "element", "places", "place", "cell", "cells", "bin", "whole"];
        taken.iter().for_each(|taken| drop(names.unique(taken)));
        let (mut arguments, mut known, mut conversions) = (String::new(), HashMap::new(), String::new());
        for variable in order {
            let name = names.unique(&snake(&model.variable_name(*variable)));
            let own = enums.of(model, *variable);
            let family = model.variables[*variable].family.and_then(|family| model.index_count(&family.over));
            match family {
                Some(count) => arguments.push_str(&format!(", {name}: [{}; {count}]", own.name)),
                None => {
                    arguments.push_str(&format!(", {name}: {}", own.taken));
                    if own.taken != own.name {
                        conversions.push_str(&format!("let {name}: {} = {name}.into(); ", own.name));
                    }
                }
            }
            known.insert(*variable, name);
        }
        let places =
            inside.iter().map(|(variable, axes)| self.places(model, *variable, &known[variable], axes));
        Reading { arguments, conversions, places: places.collect() }
    }

    /// The answer, with its methods.
    pub(super) fn answer(
        &self,
        model: &Model,
        enums: &Enums,
        meant: &[Output],
        shown: impl Fn(OutputKey) -> bool,
        text: &mut Text,
    ) {
        text.line("/// The answer, read by values.\n#[derive(Clone, Debug, Default)]");
        text.open("pub struct Answer<T>");
        text.line("outputs: Outputs<T>,");
        text.line(format!("extents: [usize; {}],", self.open_extents().len()));
        text.line("report: Report,");
        text.close();
        text.open("impl<T: Scalar> Answer<T>");
        text.line("/// The report beside the numbers.\npub fn report(&self) -> Report { self.report }");
        let mut names = Names::default();
        names.unique("report");
        let meant: Vec<&Output> = meant.iter().filter(|output| shown(output.key)).collect();
        for (id, key) in self.kernel.outputs().filter(|(_, key)| shown(*key)) {
            let output = meant.iter().find(|output| output.key == key);
            let output = output.expect("internal: each output of a kernel means something");
            let own = word(model, output);
            let alone = meant.iter().filter(|other| word(model, other) == own).count() == 1;
            let suffix = if alone { String::new() } else { format!("_{}", searched(model, output)) };
            self.methods(model, enums, (id, output), (own, &suffix), &mut names, text);
        }
        text.close();
    }

    fn methods(
        &self,
        model: &Model,
        enums: &Enums,
        (id, output): (BufferId, &Output),
        (own, suffix): (&str, &str),
        names: &mut Names,
        text: &mut Text,
    ) {
        let (documentation, array) = (self.documentation(id), format!("self.outputs.{}", self.output(id)));
        let axes = &self.kernel.buffers[id].axes;
        let (mut inside, mut rest) = (Vec::new(), axes.as_slice());
        for variable in output.variables.iter().filter(|variable| !is_over_plate(model, **variable)) {
            let (own, others) = rest.split_at(axis_count(model, *variable));
            inside.push((*variable, own.to_vec()));
            rest = others;
        }
        let is_own = |id: &VariableId| {
            output.ask.iter().flat_map(|ask| &ask.searched).any(|item| item.variable == *id)
        };
        let whole = inside.len() < output.variables.len() || own == "scores";
        let rows: Vec<VariableId> =
            output.variables.iter().copied().filter(|variable| !is_own(variable)).collect();
        let asked = output.ask.iter().flat_map(|ask| ask.searched.iter().map(|item| item.variable));
        let order: Vec<VariableId> =
            asked.filter(|id| output.variables.contains(id)).chain(rows.iter().copied()).collect();
        if let Some(best) = self.best(id) {
            let inside: Vec<_> = inside.into_iter().filter(|(variable, _)| rows.contains(variable)).collect();
            let Reading { arguments, conversions, places } = self.reading(model, enums, &inside, &rows);
            let on_plate = model.plate.is_some() && !whole;
            let plate: Vec<String> = rest.iter().map(|axis| self.count(*axis)).collect();
            let (argument, place) = match on_plate {
                true => (", element: usize", format!("(Some(element), {})", plate.join(" * "))),
                false => ("", String::new()),
            };
            let places = format!("{conversions}let places = [{places}{place}];");
            let name = names.unique(&format!("argmax{suffix}"));
            let (kind, value) = best.typed(model, enums);
            let what = format!("`{}`: the most probable value; of several, the first.", output.name);
            text.documented(&[what, "`None` where the context is impossible.".to_owned()]);
            text.open(format!("pub fn {name}(&self{arguments}{argument}) -> Option<{kind}>"));
            text.line(&places);
            text.line("let at: usize = place(&places)?;");
            text.line(value);
            text.close();
            let name = names.unique(&format!("max{suffix}"));
            text.line("/// The largest probability; 0 where the context is impossible.");
            text.open(format!("pub fn {name}(&self{arguments}{argument}) -> T"));
            text.line(&places);
            text.line(format!("cell(&self.outputs.{}, &places).unwrap_or(T::ZERO)", best.largest()));
            text.close();
            return;
        }
        let whole_name = match (own, whole, rows.is_empty()) {
            ("p", ..) => "distribution",
            ("entropy", _, false) => "entropies",
            (own, ..) => own,
        };
        let over_plate = model.plate.is_some();
        // One number is read by its method; an array of them also as a whole.
        if own == "p" || whole || (over_plate && rows.is_empty()) || !rows.is_empty() {
            let name = names.unique(&format!("{whole_name}{suffix}"));
            text.documented(&documentation);
            text.open(format!("pub fn {name}(&self) -> &[T]"));
            text.line(format!("&{array}[..]"));
            text.close();
            let name = names.unique(&format!("{name}_mut"));
            text.line("/// The same array, to begin from numbers of one's own, or to take it away.");
            text.open(format!("pub fn {name}(&mut self) -> &mut Vec<T>"));
            text.line(format!("&mut {array}"));
            text.close();
            if whole || (own != "p" && rows.is_empty()) {
                return;
            }
        }
        let Reading { arguments, conversions, places } = self.reading(model, enums, &inside, &order);
        let name = names.unique(&format!("{own}{suffix}"));
        let (kind, after) = match over_plate {
            true => ("&[T]", ""),
            false => ("T", ".first().copied().unwrap_or(T::ZERO)"),
        };
        text.documented(&documentation);
        text.line("#[inline]");
        text.open(format!("pub fn {name}(&self{arguments}) -> {kind}"));
        text.line(format!("{conversions}let places = [{places}];"));
        text.line(format!("cells(&{array}, &places){after}"));
        text.close();
    }
}
