//! The interface of a question: the fields of its inputs and outputs, their names and their documentation.
//!
//! In: a lowered question. Out: an [`Interface`] with the field of each buffer and size. Invariant: names within a
//! structure are unique; the documentation of an array lists its indices, slowest first, and its length.

use super::best::{Best, is_scores};
use super::documentation;
use super::names::{Names, snake};
use super::naming::{Naming, input_name};
use super::reading::searched_by;
use super::text::Text;
use crate::ids::{BufferId, SetId, VariableId};
use crate::kernel::{Coordinate, Displacements, Extent, InputKey, Kernel, OutputKey, Role, SizeKey};
use crate::lower::Output;
use crate::model::{Model, Statistic};
use std::collections::HashMap;

/// How an input is given.
#[derive(Clone)]
pub(super) enum Given {
    /// A field of the inputs, one number.
    Number(String),
    /// A field of the inputs, a slice.
    Slice(String),
    /// An expression of other fields.
    Derived(String),
    /// A part of a field of the inputs: a slice, with its place.
    Part(String, usize),
    /// A field of the inputs, a slice in f64 with a default: the numbers of a parameter.
    Table(String),
}

/// The field that an output shares with others, and its place there.
fn shared(key: OutputKey) -> Option<(&'static str, usize)> {
    match key {
        OutputKey::Law(place) => Some(("law", place)),
        OutputKey::Moment(place) => Some(("moments", place)),
        _ => None,
    }
}

/// The source of sizes in a field of the inputs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SizeOf {
    Grid(SetId),
    Displacements(SetId),
    /// A number of its own.
    Number(SizeKey),
}

impl SizeOf {
    fn of(kernel: &Kernel, key: SizeKey) -> Self {
        let displaces =
            |role: &Role, set: SetId| matches!(role, Role::Positions(Displacements::Of(by), _) if *by == set);
        match key {
            SizeKey::Grid(grid, _) => Self::Grid(grid),
            SizeKey::Set(set) if kernel.buffers.values().any(|buffer| displaces(&buffer.role, set)) => {
                Self::Displacements(set)
            }
            _ => Self::Number(key),
        }
    }

    /// The type of the field.
    pub(super) fn kind(self) -> &'static str {
        match self {
            Self::Grid(_) => "&'a ::bp_core::compiler::space::Space",
            Self::Displacements(_) => "&'a ::bp_core::compiler::space::Moves",
            Self::Number(_) => "usize",
        }
    }
}

/// A field that gives sizes.
pub(super) struct SizeField {
    pub(super) of: SizeOf,
    /// The name of the set, the grid or the size.
    pub(super) name: String,
    pub(super) field: String,
}

/// The field of an output's buffer.
struct OutputField {
    field: String,
    /// Its place in the field, where others share it.
    part: Option<usize>,
    documentation: Vec<String>,
    /// The answer, if the question asks for the most probable values.
    best: Option<Best>,
}

/// The fields of a question.
pub(super) struct Interface<'k> {
    pub(super) kernel: &'k Kernel,
    pub(super) sizes: Vec<SizeField>,
    pub(super) inputs: Vec<(BufferId, Given)>,
    /// The inputs that are no fields of the builder, because a filter gives them.
    pub(super) unseen: Vec<BufferId>,
    /// For `nearest`: the field of each name.
    pub(super) fields: Vec<(String, String)>,
    outputs: HashMap<BufferId, OutputField>,
    /// The outputs in order.
    order: Vec<BufferId>,
}

impl<'k> Interface<'k> {
    /// The fields of a kernel with these outputs.
    pub(super) fn new(model: &Model, kernel: &'k Kernel, meant: &[Output], naming: &mut Naming) -> Self {
        let mut interface = Self {
            kernel,
            sizes: Vec::new(),
            inputs: Vec::new(),
            unseen: Vec::new(),
            fields: Vec::new(),
            outputs: HashMap::new(),
            order: Vec::new(),
        };
        for size in kernel.sizes() {
            let of = SizeOf::of(kernel, size.key);
            if !interface.sizes.iter().any(|known| known.of == of) {
                let name = match size.key {
                    SizeKey::Grid(grid, _) => model.sets[grid].name.clone(),
                    _ => size.name.clone(),
                };
                interface.sizes.push(SizeField { of, field: naming.size(of, &snake(&name)), name });
            }
        }
        for (id, buffer) in kernel.inputs() {
            let given = match &buffer.role {
                Role::Positions(by, coordinate) => Given::Derived(interface.positions(*by, *coordinate)),
                Role::Input { key: InputKey::Wraps(grid), .. } => {
                    let grid = interface.size_field(SizeOf::Grid(*grid));
                    Given::Derived(format!("if inputs.{grid}.wraps() {{ T::ONE }} else {{ T::ZERO }}"))
                }
                Role::Input { key: InputKey::Law(place), .. } => Given::Part("law".to_owned(), *place),
                Role::Input { key, .. } => match interface.as_size(&buffer.role) {
                    Some(size) => Given::Derived(format!("T::from_f64(inputs.{} as f64)", size.field)),
                    None if buffer.axes.is_empty() => {
                        Given::Number(naming.input(key, &input_name(&buffer.name)))
                    }
                    None => Given::Slice(naming.input(key, &input_name(&buffer.name))),
                },
                Role::Table { key: Some(key), .. } => {
                    Given::Table(naming.input(key, &input_name(&buffer.name)))
                }
                // The host gives none of these.
                Role::Table { key: None, .. } | Role::Scratch | Role::Output(_) => continue,
            };
            interface.inputs.push((id, given));
        }
        let mut names = Names::default();
        let mut fields: Vec<(String, String)> = Vec::new();
        for (id, key) in kernel.outputs() {
            if let Some((field, place)) = shared(key) {
                let documentation = vec![documentation::law(field)];
                let (field, part) = (field.to_owned(), Some(place));
                interface.outputs.insert(id, OutputField { field, part, documentation, best: None });
                interface.order.push(id);
                continue;
            }
            let output = meant.iter().find(|output| output.key == key);
            let output = output.expect("internal: each output of a kernel means something");
            let best = Best::of(model, kernel, id, output, &mut names, |nearest| {
                if let Some((_, field)) = fields.iter().find(|(known, _)| known == nearest) {
                    return field.clone();
                }
                let field = naming.unique(&snake(nearest));
                fields.push((nearest.to_owned(), field.clone()));
                field
            });
            let wanted = match best {
                Some(_) => "scores".to_owned(),
                None => output_name(model, output),
            };
            let (field, documentation) =
                (names.unique(&wanted), documentation::output(model, kernel, id, output));
            interface.outputs.insert(id, OutputField { field, part: None, documentation, best });
            interface.order.push(id);
        }
        interface.fields = fields;
        interface
    }

    /// Whether inputs are parts of one field.
    pub(super) fn has_parts(&self) -> bool {
        self.inputs.iter().any(|(_, given)| matches!(given, Given::Part(..)))
    }

    /// The field of the values of a variable, if it has one.
    pub(super) fn field_of(&self, variable: VariableId) -> Option<&str> {
        let is_its = |(id, _): &&(BufferId, Given)| matches!(self.kernel.buffers[*id].role.input(), Some(InputKey::Value(own, _)) if *own == variable);
        match &self.inputs.iter().find(is_its)?.1 {
            Given::Number(field) | Given::Slice(field) => Some(field),
            Given::Derived(_) | Given::Part(..) | Given::Table(_) => None,
        }
    }

    /// How an input is given.
    pub(super) fn given(&self, id: BufferId) -> &Given {
        let found = self.inputs.iter().find(|(known, _)| *known == id);
        &found.expect("internal: every input has a field").1
    }

    /// The field of an output.
    pub(super) fn output(&self, id: BufferId) -> &str {
        &self.outputs[&id].field
    }

    /// The place of an output in its field, where others share it.
    pub(super) fn part(&self, id: BufferId) -> Option<usize> {
        self.outputs[&id].part
    }

    /// The number of outputs, or of inputs, that share a field.
    pub(super) fn parts(&self, field: &str) -> usize {
        let outputs = self.outputs.values().filter(|own| own.part.is_some() && own.field == field).count();
        let is_part = |(_, given): &&(BufferId, Given)| matches!(given, Given::Part(own, _) if own == field);
        outputs.max(self.inputs.iter().filter(is_part).count())
    }

    /// The answer of an output, if the question asks for the most probable values.
    pub(super) fn best(&self, id: BufferId) -> Option<&Best> {
        self.outputs[&id].best.as_ref()
    }

    /// A table of positions, as an expression of the inputs.
    pub(super) fn positions(&self, by: Displacements, coordinate: Coordinate) -> String {
        let (of, steps) = match by {
            Displacements::Steps(grid) => (SizeOf::Grid(grid), ".steps()"),
            Displacements::Of(set) => (SizeOf::Displacements(set), ""),
        };
        format!("&inputs.{}{steps}.{}", self.size_field(of), coordinate.name())
    }

    /// The documentation of an output.
    pub(super) fn documentation(&self, id: BufferId) -> Vec<String> {
        self.outputs[&id].documentation.clone()
    }

    /// The outputs, in order.
    pub(super) fn outputs(&self) -> &[BufferId] {
        &self.order
    }

    /// An extent, as an expression of the inputs.
    pub(super) fn extent(&self, extent: &Extent) -> String {
        let Some(size) = extent.size else { return extent.offset.to_string() };
        let of = SizeOf::of(self.kernel, size);
        let field = format!("inputs.{}", self.size_field(of));
        let field = match (of, size) {
            (SizeOf::Displacements(_), _) => format!("{field}.displacements"),
            (_, SizeKey::Grid(_, axis)) => format!("{field}.extents()[{}]", axis as usize),
            _ => field,
        };
        match extent.offset {
            0 => field,
            more if more > 0 => format!("{field}.saturating_add({more})"),
            less => format!("{field}.saturating_sub({})", less.unsigned_abs()),
        }
    }

    /// Passes the inputs by name, in f64, to `named` in the text.
    pub(super) fn named(&self, text: &mut Text) {
        for SizeField { of, name, field } in &self.sizes {
            text.line(match of {
                SizeOf::Number(_) => format!("let named = named.size({name:?}, inputs.{field});"),
                SizeOf::Grid(_) => format!("let named = named.grid({name:?}, inputs.{field});"),
                SizeOf::Displacements(_) => {
                    format!("let named = named.displacements({name:?}, inputs.{field});")
                }
            });
        }
        for (id, given) in &self.inputs {
            let buffer = &self.kernel.buffers[*id];
            let name = &buffer.name;
            match (given, self.as_size(&buffer.role)) {
                (Given::Number(field), _) => {
                    text.line(format!("let named = named.number({name:?}, inputs.{field}.to_f64());"))
                }
                (Given::Slice(field), _) => {
                    text.line(format!("let named = named.numbers({name:?}, T::widen(inputs.{field}));"))
                }
                (Given::Derived(_), Some(size)) => {
                    let field = &size.field;
                    text.line(format!("let named = named.number({name:?}, inputs.{field} as f64);"))
                }
                (Given::Table(field), _) => text.line(format!(
                    "let named = named.numbers({name:?}, ::std::borrow::Cow::Borrowed(inputs.{field}));"
                )),
                (Given::Derived(_), None) | (Given::Part(..), _) => {}
            }
        }
    }

    /// The size that an input is read as, if it is one.
    fn as_size(&self, role: &Role) -> Option<&SizeField> {
        let InputKey::Parameter(parameter) = role.input()? else { return None };
        self.sizes.iter().find(|known| known.of == SizeOf::Number(SizeKey::Parameter(*parameter)))
    }

    fn size_field(&self, of: SizeOf) -> &str {
        let found = self.sizes.iter().find(|known| known.of == of);
        &found.expect("internal: every size has a field").field
    }

    /// Writes `Inputs`; returns its generics: those that a field needs.
    pub(super) fn inputs_structure(&self, visible: &str, text: &mut Text) -> &'static str {
        let mut fields = Text::default();
        let (mut borrows, mut numbers) = (false, false);
        for SizeField { of, name, field } in &self.sizes {
            borrows |= !matches!(of, SizeOf::Number(_));
            fields.documented(&[match of {
                SizeOf::Grid(_) => format!("The grid `{name}`."),
                SizeOf::Displacements(_) => format!("Where the displacements `{name}` come from."),
                SizeOf::Number(_) => format!("The size `{name}`."),
            }]);
            fields.line(format!("pub {field}: {},", of.kind()));
        }
        for (id, given) in &self.inputs {
            let (field, kind) = match given {
                Given::Number(field) => (field, "T"),
                Given::Slice(field) => (field, "&'a [T]"),
                Given::Part(field, 0) => (field, "&'a [T]"),
                Given::Table(field) => (field, "&'a [f64]"),
                Given::Part(..) | Given::Derived(_) => continue,
            };
            borrows |= !matches!(given, Given::Number(_));
            numbers |= !matches!(given, Given::Table(_));
            fields.documented(&documentation::input(self.kernel, *id));
            fields.line(format!("pub {field}: {kind},"));
        }
        for (name, field) in &self.fields {
            (borrows, numbers) = (true, true);
            let what = format!("`{name}`: a number for each value, or for each value in each context.");
            fields
                .documented(&[what, "Among equals the value is chosen at which it is smallest.".to_owned()]);
            fields.line(format!("pub {field}: &'a [T],"));
        }
        text.line("/// The inputs of the question.\n#[derive(Clone, Copy, Debug)]");
        let (generics, used) = match (borrows, numbers) {
            (true, true) => ("<'a, T>", "<'_, T>"),
            (true, false) => ("<'a>", "<'_>"),
            (false, true) => ("<T>", "<T>"),
            (false, false) => ("", ""),
        };
        text.open(format!("{visible}struct Inputs{generics}"));
        text.line(fields.finish());
        text.close();
        used
    }

    /// Writes `Outputs`.
    pub(super) fn outputs_structure(&self, visible: &str, text: &mut Text) {
        text.line("/// The outputs of the question.\n#[derive(Clone, Debug, Default)]");
        text.open(format!("{visible}struct Outputs<T>"));
        for id in &self.order {
            let OutputField { field, part, documentation, best } = &self.outputs[id];
            match best {
                _ if part.is_some_and(|part| part > 0) => {}
                Some(best) => {
                    best.fields(text);
                    text.documented(&["Where the distribution is made.".to_owned()]);
                    text.line(format!("{field}: Vec<T>,"));
                }
                None => {
                    text.documented(documentation);
                    text.line(format!("pub {field}: Vec<T>,"));
                }
            }
        }
        text.close();
    }
}

/// The field of an output: the statistic, and the searched variables.
fn output_name(model: &Model, output: &Output) -> String {
    let Some(ask) = &output.ask else { return "ln_evidence".to_owned() };
    let word = match ask.statistic {
        Statistic::Distribution => "p".to_owned(),
        _ if is_scores(model, output) => "scores".to_owned(),
        ref other => snake(&other.word()),
    };
    format!("{}_{}", word.trim_matches('_'), searched_by(model, ask))
}
