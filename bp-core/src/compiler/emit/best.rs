//! The most probable values in emitted code: `argmax` and `max`.
//!
//! In: an output with a distribution. Out: fields for its most probable values and for the probability there, and the
//! code that fills them. Invariant: ties are broken as in `answer::argmax`; the first value is returned.

use super::documentation;
use super::names::{Names, local, snake};
use super::text::Text;
use super::value::constant;
use super::values::Enums;
use crate::ids::{AxisId, BufferId, Id, VariableId};
use crate::kernel::Kernel;
use crate::lower::Output;
use crate::model::{Domain, Model, SetKind, Statistic};

/// One variable of an answer, or one element of a family.
struct Value {
    variable: VariableId,
    field: String,
    documentation: Vec<String>,
    /// Its axes, three for a cell of a grid.
    axes: Vec<AxisId>,
    /// Its number: the first value and a step of 1, or the centres of bins.
    first: i64,
    centres: Option<Vec<f64>>,
}

/// The answer to one `argmax` or `max`.
pub(super) struct Best {
    /// The field that breaks ties, of the inputs.
    nearest: Option<String>,
    values: Vec<Value>,
    largest: (String, Vec<String>),
    /// The axes of the distribution.
    width: Vec<AxisId>,
    /// The axes that come after them: the plate's.
    inner: Vec<AxisId>,
}

/// Whether an output is a score of each element of the plate, among which the calling code chooses by a field.
pub(super) fn is_scores(model: &Model, output: &Output) -> bool {
    let nearest =
        matches!(output.ask.as_ref().map(|ask| &ask.statistic), Some(Statistic::Argmax { nearest: Some(_) }));
    nearest && output.variables.iter().any(|variable| is_over_plate(model, *variable))
}

pub(super) fn is_over_plate(model: &Model, variable: VariableId) -> bool {
    let declared = &model.variables[variable];
    model.plate.is_some_and(|plate| declared.domain == Domain::Set(plate.set) && declared.family.is_none())
}

impl Best {
    /// The answer of an output, if the question asks for its most probable values.
    pub(super) fn of(
        model: &Model,
        kernel: &Kernel,
        id: BufferId,
        output: &Output,
        names: &mut Names,
        nearest: impl FnOnce(&str) -> String,
    ) -> Option<Self> {
        let ask = output.ask.as_ref()?;
        let field = match &ask.statistic {
            Statistic::Maximum => None,
            Statistic::Argmax { nearest } => nearest.as_deref(),
            _ => return None,
        };
        if is_scores(model, output) {
            return None;
        }
        let axes = &kernel.buffers[id].axes;
        let own_axes = |variable: &VariableId| match is_over_plate(model, *variable) {
            true => 0,
            false => axis_count(model, *variable),
        };
        let (mut serial, plate) = axes.split_at(output.variables.iter().map(own_axes).sum());
        let mut take = |count: usize| {
            let (taken, rest) = serial.split_at(count);
            serial = rest;
            taken.to_vec()
        };
        let searched = |variable: &VariableId| ask.searched.iter().any(|item| item.variable == *variable);
        let (open, rows): (Vec<VariableId>, Vec<VariableId>) =
            output.variables.iter().partition(|id| searched(id));
        let outer: Vec<AxisId> = rows.iter().flat_map(|row| take(axis_count(model, *row))).collect();
        let (over_plate, mut own): (Vec<VariableId>, Vec<VariableId>) =
            open.iter().partition(|variable| is_over_plate(model, **variable));
        own.extend(&over_plate);
        let (mut values, mut width) = (Vec::new(), Vec::new());
        for variable in own {
            let name = model.variable_name(variable);
            let each = if grid_axes(model, variable) { 3 } else { 1 };
            let axes = if is_over_plate(model, variable) {
                plate.to_vec()
            } else {
                take(axis_count(model, variable))
            };
            let elements = axes.chunks(if is_over_plate(model, variable) { axes.len() } else { each });
            let count = elements.len();
            for (element, axes) in elements.enumerate() {
                let place = if count > 1 { format!("_{element}") } else { String::new() };
                let field = names.unique(&format!("argmax_{}{place}", snake(&name).trim_matches('_')));
                let domain = &model.variables[variable].domain;
                let centres = match domain {
                    Domain::Bins(bins) => Some((0..bins.count()).map(|bin| bins.centre(bin)).collect()),
                    _ => None,
                };
                let what = format!(
                    "The value of `{name}` at which the distribution is largest: a number of `{}`. Of several, the first.",
                    model.domain_text(domain)
                );
                let documentation = vec![what, "`None` where the context is impossible.".to_owned()];
                values.push(Value {
                    variable,
                    field,
                    documentation,
                    axes: axes.to_vec(),
                    first: domain.base(),
                    centres,
                });
                width.extend_from_slice(axes);
            }
        }
        let inner = if over_plate.is_empty() { plate.to_vec() } else { Vec::new() };
        let contexts: Vec<AxisId> = outer.iter().chain(&inner).copied().collect();
        let shape = documentation::shape(kernel, &contexts);
        let index = rows.iter().filter_map(|row| documentation::index(model, *row));
        let shared: Vec<String> = std::iter::once(shape).chain(index).collect();
        values.iter_mut().for_each(|value| value.documentation.extend(shared.iter().cloned()));
        let searched = ask.searched.iter().map(|item| snake(&model.variable_name(item.variable)));
        let searched: Vec<String> = searched.map(|name| name.trim_matches('_').to_owned()).collect();
        let largest = names.unique(&format!("max_{}", searched.join("_")));
        let what = "The largest probability; 0 where the context is impossible.".to_owned();
        let documentation = std::iter::once(what).chain(shared).collect();
        Some(Self { nearest: field.map(nearest), values, largest: (largest, documentation), width, inner })
    }

    /// The type of the most probable values, and the expression that reads them at the context `at`.
    pub(super) fn typed(&self, model: &Model, enums: &Enums) -> (String, String) {
        let (mut kinds, mut values) = (Vec::new(), Vec::new());
        for elements in self.values.chunk_by(|one, other| one.variable == other.variable) {
            let variable = elements[0].variable;
            let kind = match grid_axes(model, variable) {
                true => "usize".to_owned(),
                false => enums.of(model, variable).name,
            };
            let read = |value: &Value| {
                let number = format!("self.outputs.{}.get(at).copied().flatten()?", value.field);
                format!("<{kind} as Value>::of({number}.to_f64())")
            };
            let read: Vec<String> = elements.iter().map(read).collect();
            let (kind, read) = match model.variables[variable].family {
                Some(_) => (format!("[{kind}; {}]", read.len()), format!("[{}]", read.join(", "))),
                None => (kind.clone(), read.concat()),
            };
            kinds.push(kind);
            values.push(read);
        }
        match (kinds.as_slice(), values.as_slice()) {
            ([kind], [value]) => (kind.clone(), format!("Some({value})")),
            _ => (format!("({})", kinds.join(", ")), format!("Some(({}))", values.join(", "))),
        }
    }

    /// The field of the largest probability.
    pub(super) fn largest(&self) -> &str {
        &self.largest.0
    }

    /// The fields of the outputs.
    pub(super) fn fields(&self, text: &mut Text) {
        for Value { field, documentation, .. } in &self.values {
            text.documented(documentation);
            text.line(format!("pub {field}: Vec<Option<T>>,"));
        }
        text.documented(&self.largest.1);
        text.line(format!("pub {}: Vec<T>,", self.largest.0));
    }

    /// Fills the fields from a buffer.
    pub(super) fn fill(&self, id: BufferId, scores: &str, asked: &str, text: &mut Text) {
        let product = |axes: &[AxisId]| {
            let extents: Vec<String> = axes.iter().map(|axis| local("e", *axis)).collect();
            if extents.is_empty() { "1usize".to_owned() } else { extents.join(" * ") }
        };
        text.open("");
        text.line(format!(
            "let (width, inner): (usize, usize) = ({}, {});",
            product(&self.width),
            product(&self.inner)
        ));
        let nearest = match &self.nearest {
            None => "None".to_owned(),
            Some(field) => {
                let whole = local("n", id);
                text.line(format!("check_broadcast({field:?}, inputs.{field}.len(), {whole}, width)?;"));
                format!("Some(inputs.{field})")
            }
        };
        text.line(format!(
            "let distributions = Distributions {{ scores: &outputs.{scores}[..], width, inner, nearest: {nearest} }};"
        ));
        text.line("let contexts: usize = distributions.count();");
        let largest = &self.largest.0;
        text.line(format!("make_room({asked:?}, contexts, &mut outputs.{largest})?;"));
        self.values
            .iter()
            .for_each(|value| text.line(format!("outputs.{}.resize(contexts, None);", value.field)));
        text.open("for context in 0..contexts");
        text.line("let best = distributions.best(context);");
        text.line(format!("outputs.{largest}[context] = best.map_or(T::ZERO, |(_, largest)| largest);"));
        // The last variable is the fastest.
        let mut after: Vec<AxisId> = Vec::new();
        for (number, value) in self.values.iter().enumerate().rev() {
            let ordinal = format!("at / ({}) % ({})", product(&after), product(&value.axes));
            let number = match &value.centres {
                None => format!("({ordinal}) as f64 + {}", constant(value.first as f64)),
                Some(centres) => {
                    let name = format!("CENTRES{}_{number}", id.position());
                    text.line(format!("static {name}: [f64; {}] = {centres:?};", centres.len()));
                    format!("{name}[{ordinal}]")
                }
            };
            text.line(format!(
                "outputs.{}[context] = best.map(|(at, _)| T::from_f64({number}));",
                value.field
            ));
            after.splice(0..0, value.axes.iter().copied());
        }
        text.close();
        text.close();
    }
}

fn grid_axes(model: &Model, variable: VariableId) -> bool {
    matches!(model.variables[variable].domain, Domain::Set(set) if model.sets[set].kind == SetKind::Grid)
}

/// The number of axes of the values of a variable.
pub(super) fn axis_count(model: &Model, variable: VariableId) -> usize {
    let each = if grid_axes(model, variable) { 3 } else { 1 };
    let family = model.variables[variable].family.and_then(|family| model.index_count(&family.over));
    each * family.unwrap_or(1)
}
