//! The builder of a question, which takes its inputs by name and by value.
//!
//! In: the interface of a question. Out: `Question` with a method for each input, `ask` and `run_into`, and the
//! function that makes it. Invariant: grids and displacements are arguments, so that none is missing; inputs with a
//! default are optional; any other missing input is an error that names it; nothing allocates before the answer.

use super::interface::{Given, Interface, SizeField, SizeOf};
use super::names::Names;
use super::text::Text;
use super::value::constant;
use super::values::Enums;
use crate::ids::{BufferId, ParameterId};
use crate::kernel::{InputKey, Role, SizeKey};
use crate::model::{Model, ParameterKind};

/// The methods of a builder that are not inputs.
pub(super) const METHODS: [&str; 3] = ["new", "ask", "run_into"];

/// One input of a builder.
pub(super) struct Setter<'i> {
    pub(super) field: &'i str,
    /// The first line of its documentation.
    documentation: String,
    /// Its type in the builder, and the argument type of its method.
    pub(super) kind: String,
    taken: String,
    default: Option<String>,
    /// Whether the kernel takes it as a number.
    is_number: bool,
    /// The input of the kernel, if it is one.
    pub(super) key: Option<InputKey>,
    /// For a size, the expressions that infer it from the lengths of arrays when it is not given.
    from_arrays: String,
}

impl<'i> Setter<'i> {
    /// The setter of an array without a default.
    fn of_slice(field: &'i str, documentation: String) -> Self {
        let kind = "&'a [T]".to_owned();
        Self {
            field,
            documentation,
            taken: kind.clone(),
            kind,
            default: None,
            is_number: false,
            key: None,
            from_arrays: String::new(),
        }
    }

    /// Its value, as an expression of the builder: an error if it is missing.
    pub(super) fn value(&self) -> String {
        let Self { field, from_arrays, .. } = self;
        self.converted(&format!("needed(self.{field}{from_arrays}, {field:?})?"))
    }

    /// A value as the kernel takes it.
    pub(super) fn converted(&self, value: &str) -> String {
        if self.is_number { format!("T::from_f64({value}.number())") } else { value.to_owned() }
    }
}

/// The type of a parameter, and its default.
fn parameter(model: &Model, id: ParameterId) -> (&'static str, Option<String>) {
    let declared = &model.parameters[id];
    let whole = |default: f64| format!("{}", default as i64);
    let default = declared.default_number();
    match declared.kind {
        ParameterKind::Probability | ParameterKind::Real => ("f64", default.map(constant)),
        ParameterKind::Integer | ParameterKind::Element(_) => ("i64", default.map(whole)),
        ParameterKind::Size => ("usize", default.map(whole)),
    }
}

impl Interface<'_> {
    pub(super) fn setters(&self, model: &Model, enums: &Enums) -> Vec<Setter<'_>> {
        let sizes = self.sizes.iter().filter_map(|SizeField { of, name, field }| {
            let SizeOf::Number(key) = of else { return None };
            let default = match key {
                SizeKey::Parameter(id) => parameter(model, *id).1,
                _ => None,
            };
            let from_arrays = self.by_arrays(*key);
            let by = if from_arrays.is_empty() {
                ""
            } else {
                " If omitted, it is the length of the arrays over it."
            };
            let (kind, documentation) = ("usize".to_owned(), format!("The size `{name}`.{by}"));
            Some(Setter {
                field,
                documentation,
                taken: kind.clone(),
                kind,
                default,
                is_number: false,
                key: None,
                from_arrays,
            })
        });
        let inputs = self.inputs.iter().filter_map(|(id, given)| {
            let buffer = &self.kernel.buffers[*id];
            let documentation = format!("`{}`.", buffer.name);
            match given {
                Given::Derived(_) | Given::Part(..) => None,
                Given::Slice(field) => {
                    let key = buffer.role.input().cloned();
                    Some(Setter { key, ..Setter::of_slice(field, documentation) })
                }
                Given::Table(field) => {
                    let Role::Table { key, numbers } = &buffer.role else { return None };
                    let kind = "&'a [f64]".to_owned();
                    let numbers: Vec<String> = numbers.iter().map(|number| constant(*number)).collect();
                    Some(Setter {
                        key: key.clone(),
                        taken: kind.clone(),
                        kind,
                        default: Some(format!("&[{}]", numbers.join(", "))),
                        ..Setter::of_slice(field, documentation)
                    })
                }
                Given::Number(field) => {
                    let (kind, taken, default) = match buffer.role.input() {
                        Some(InputKey::Value(variable, _)) => {
                            let own = enums.of(model, *variable);
                            // A cell of a grid is given by its index in memory.
                            match own.name.as_str() {
                                "[usize; 3]" => ("usize".to_owned(), "usize".to_owned(), None),
                                _ => (own.name, own.taken, None),
                            }
                        }
                        Some(InputKey::Parameter(id)) => {
                            let (kind, default) = parameter(model, *id);
                            (kind.to_owned(), kind.to_owned(), default)
                        }
                        _ => ("f64".to_owned(), "f64".to_owned(), None),
                    };
                    Some(Setter {
                        field,
                        documentation,
                        kind,
                        taken,
                        default,
                        is_number: true,
                        key: buffer.role.input().cloned(),
                        from_arrays: String::new(),
                    })
                }
            }
        });
        let fields = self
            .fields
            .iter()
            .map(|(name, field)| Setter::of_slice(field, format!("`{name}`, which breaks ties.")));
        sizes.chain(inputs).chain(fields).collect()
    }

    /// Expressions that infer a size from the arrays of one axis of that size. One number is ignored, since it may be
    /// broadcast.
    fn by_arrays(&self, key: SizeKey) -> String {
        let length = |(id, given): &(BufferId, Given)| {
            let Given::Slice(field) = given else { return None };
            if self.unseen.contains(id) {
                return None;
            }
            let [axis] = self.kernel.buffers[*id].axes.as_slice() else { return None };
            let extent = self.kernel.axes[*axis].extent;
            let less = match extent.offset {
                0 => String::new(),
                offset => format!(".saturating_add_signed({})", -offset),
            };
            (extent.size == Some(key)).then(|| {
                format!(".or(self.{field}.filter(|given| given.len() > 1).map(|given| given.len(){less}))")
            })
        };
        self.inputs.iter().filter_map(length).collect()
    }

    /// Grids and displacements: name and type.
    pub(super) fn spaces(&self) -> Vec<(&str, &'static str)> {
        let spaces = self.sizes.iter().filter(|size| !matches!(size.of, SizeOf::Number(_)));
        spaces.map(|size| (size.field.as_str(), size.of.kind())).collect()
    }

    /// The function of the program that returns a question.
    pub(super) fn function(&self, model: &Model, name: &str, documentation: &[String], text: &mut Text) {
        let spaces = self.spaces();
        let arguments: Vec<String> = spaces.iter().map(|(name, kind)| format!("{name}: {kind}")).collect();
        let names: Vec<&str> = spaces.iter().map(|(name, _)| *name).collect();
        // Over a plate the arrays determine the precision; a single answer is computed in f64.
        let (scalar, number) = match model.plate {
            Some(_) => (", T: ::bp_core::compiler::exec::scalar::Scalar", "T"),
            None => ("", "::core::primitive::f64"),
        };
        text.documented(documentation);
        text.line("#[inline]");
        text.open(format!(
            "pub fn {name}<'a{scalar}>({}) -> {name}::Question<'a, {number}>",
            arguments.join(", ")
        ));
        text.line(format!("{name}::Question::new({})", names.join(", ")));
        text.close();
    }

    /// The builder.
    pub(super) fn builder(&self, model: &Model, enums: &Enums, text: &mut Text) {
        let (spaces, setters) = (self.spaces(), self.setters(model, enums));
        self.structure(&spaces, &setters.iter().collect::<Vec<_>>(), text);
        text.line("/// Asks it.\n///\n/// # Errors\n/// An input that is missing or outside its domain; numbers that a form refuses; evidence of probability zero.\n#[inline]");
        text.open("pub fn ask(self) -> Result<Answer<T>, ::bp_core::compiler::error::Error>");
        text.line("let mut answer = Answer::default();");
        text.line("self.run_into(&mut answer)?;");
        text.line("Ok(answer)");
        text.close();
        text.line("/// Asks it again, into the arrays of an earlier answer: nothing is allocated where they are long enough.\n///\n/// # Errors\n/// As `ask`.\n#[inline]");
        text.open("pub fn run_into(self, answer: &mut Answer<T>) -> Result<Report, ::bp_core::compiler::error::Error>");
        let spaces = spaces.iter().map(|(name, _)| format!("{name}: self.{name}, "));
        let given = setters.iter().map(|own| format!("{}: {}, ", own.field, own.value()));
        text.line(format!("let inputs = Inputs {{ {} }};", spaces.chain(given).collect::<String>()));
        text.line("answer.report = run(&inputs, &mut answer.outputs)?;");
        let extents: Vec<String> = self.open_extents().iter().map(|extent| self.extent(extent)).collect();
        text.line(format!("answer.extents = [{}];", extents.join(", ")));
        text.line("Ok(answer.report)");
        text.close();
        text.close();
    }

    /// The structure of a builder, its constructor, and a method for each input; leaves its implementation open.
    pub(super) fn structure(
        &self,
        spaces: &[(&str, &'static str)],
        setters: &[&Setter<'_>],
        text: &mut Text,
    ) {
        text.line("/// The question, with its inputs so far.\n#[derive(Clone, Copy, Debug)]");
        text.open("pub struct Question<'a, T>");
        spaces.iter().for_each(|(name, kind)| text.line(format!("{name}: {kind},")));
        setters.iter().for_each(|own| text.line(format!("{}: Option<{}>,", own.field, own.kind)));
        // The field that binds the number type has a name that no input has.
        let mut names = Names::default();
        spaces.iter().for_each(|(name, _)| drop(names.unique(name)));
        setters.iter().for_each(|own| drop(names.unique(own.field)));
        let bound = names.unique("number");
        text.line(format!("{bound}: ::core::marker::PhantomData<&'a T>,"));
        text.close();
        text.open("impl<'a, T: Scalar> Question<'a, T>");
        let arguments: Vec<String> = spaces.iter().map(|(name, kind)| format!("{name}: {kind}")).collect();
        text.line("/// The question, with the defaults of the program.\n#[inline]");
        text.open(format!("pub fn new({}) -> Self", arguments.join(", ")));
        let started = spaces.iter().map(|(name, _)| format!("{name}, "));
        let started = started.chain(setters.iter().map(|own| match &own.default {
            Some(default) => format!("{}: Some({default}), ", own.field),
            None => format!("{}: None, ", own.field),
        }));
        text.line(format!("Self {{ {}{bound}: ::core::marker::PhantomData }}", started.collect::<String>()));
        text.close();
        for Setter { field, documentation, kind, taken, default, .. } in setters {
            let default = default.as_ref().map(|default| format!("By default `{default}`."));
            text.documented(&std::iter::once(documentation.clone()).chain(default).collect::<Vec<_>>());
            text.line("#[inline]");
            text.open(format!("pub fn {field}(mut self, value: {taken}) -> Self"));
            let value = if taken == kind { "value" } else { "value.into()" };
            text.line(format!("self.{field} = Some({value});"));
            text.line("self");
            text.close();
        }
    }
}
