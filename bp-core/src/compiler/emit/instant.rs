//! The kernels of the instants of a question over time, and what they are given.
//!
//! In: a route over time. Out: for each kind of instant its module, and its inputs as an expression of the builder. Invariant: an
//! input has one name in all kernels; an observation that is not given is a value of its domain that is not read.

use super::again::Asked;
use super::door::Setter;
use super::interface::Interface;
use super::naming::Naming;
use super::question::{computation, prepared};
use super::text::Text;
use super::value::constant;
use super::values::Enums;
use crate::error::Error;
use crate::ids::{BufferId, VariableId};
use crate::kernel::{Buffer, InputKey, Kernel, OutputKey};
use crate::lower::{Output, Phase, Step};
use crate::model::{Domain, Model};
use crate::plan::{InstantCode, Mark, OverTime};

/// The kernel of one kind of instant.
pub(super) struct Instant {
    pub(super) phase: Phase,
    pub(super) code: InstantCode,
    pub(super) kernel: Kernel,
    pub(super) outputs: Vec<Output>,
    is_linear: bool,
}

impl Instant {
    fn new(model: &Model, route: &OverTime, phase: Phase, name: &str) -> Result<Self, Error> {
        let code = route.instant(model, phase, name, false)?;
        let (kernel, outputs, is_linear) = match &code {
            InstantCode::Chain { step, exact, lowered } => {
                let is_linear = model.plate.is_some() || exact.mark(&step.model) == Mark::Linear;
                (&lowered.kernel, lowered.outputs.clone(), is_linear)
            }
            InstantCode::Normal(normal) => {
                let (key, name) = (OutputKey::LnEvidence, "ln_evidence".to_owned());
                (&normal.kernel, vec![Output { key, name, ask: None, variables: Vec::new() }], false)
            }
        };
        let kernel = prepared(kernel);
        Ok(Self { phase, kernel, outputs, is_linear, code })
    }

    /// The kernels of a question.
    pub(super) fn all(model: &Model, route: &OverTime, question: &str) -> Result<Vec<Self>, Error> {
        route.phases().iter().map(|phase| Self::new(model, route, *phase, question)).collect()
    }

    /// Its fields; names are shared with the other kernels.
    pub(super) fn interface(&self, naming: &mut Naming) -> Interface<'_> {
        let model = &self.step().model;
        let mut interface = Interface::new(model, &self.kernel, &self.outputs, naming);
        let is_unseen = |id: &BufferId| {
            let key = self.kernel.buffers[*id].role.input();
            !matches!(source(self.step(), &interface, key), Source::Observed(_) | Source::Plain)
        };
        let unseen = interface.inputs.iter().map(|(id, _)| *id).filter(is_unseen).collect();
        interface.unseen = unseen;
        interface
    }

    pub(super) fn step(&self) -> &Step {
        match &self.code {
            InstantCode::Chain { step, .. } => step,
            InstantCode::Normal(normal) => &normal.step,
        }
    }

    /// The name of its module.
    pub(super) fn name(&self) -> &'static str {
        match self.phase {
            Phase::First => "first",
            Phase::Later => "later",
            Phase::Ahead => "ahead",
            Phase::Back => "back",
            Phase::Both => "both",
            Phase::Best => "best",
            Phase::Trace => "trace",
        }
    }

    /// The field of the output that is carried.
    pub(super) fn carried_field<'i>(&self, interface: &'i Interface<'_>) -> &'i str {
        let key = match &self.code {
            InstantCode::Chain { .. } => OutputKey::Ask(0),
            InstantCode::Normal(_) => OutputKey::Law(0),
        };
        let found = self.kernel.outputs().find(|(_, own)| *own == key);
        interface.output(found.expect("internal: something is carried").0)
    }

    /// Writes its module: `Inputs` and `run`; `whole`: `Outputs` too.
    pub(super) fn module(
        &self,
        interface: &Interface<'_>,
        (question, route): (&str, usize),
        alone: bool,
        whole: bool,
        text: &mut Text,
    ) {
        text.documented(&[format!("The kernel of {}.", described(self.phase))]);
        text.open(format!("mod {}", self.name()));
        text.line("use super::*;");
        let generics = interface.inputs_structure("pub(super) ", text);
        if whole {
            interface.outputs_structure("pub(super) ", text);
        }
        let is_law = matches!(self.code, InstantCode::Normal(_));
        let asked = Asked { question, route, instant: Some((self.phase, is_law)) };
        computation(interface, (generics, "pub(super) "), &asked, (alone, self.is_linear), text);
        text.close();
    }

    /// Writes `let inputs = …`. `carried` is the distribution of the instant before, `later` the message from later instants; the
    /// states that are known are in `then`.
    pub(super) fn inputs(
        &self,
        interface: &Interface<'_>,
        setters: &[Setter<'_>],
        [carried, later]: [&str; 2],
        text: &mut Text,
    ) {
        let step = self.step();
        let mut given: Vec<String> =
            interface.spaces().iter().map(|(name, _)| format!("{name}: self.{name}")).collect();
        for setter in setters {
            let field = setter.field;
            let is_slice = setter.kind == "&'a [T]";
            let value = match source(step, interface, setter.key.as_ref()) {
                Source::Carried => carried.to_owned(),
                Source::Later => later.to_owned(),
                Source::Then(place) if is_slice => format!("&then[{place}][..]"),
                Source::Then(place) => format!("then[{place}][0]"),
                Source::Plain => setter.value(),
                Source::Whether(field) => {
                    format!("if self.{field}.is_some() {{ T::ONE }} else {{ T::ZERO }}")
                }
                Source::Observed(variable) => {
                    let first = first_value(&step.model, variable);
                    match is_slice {
                        true => {
                            let key = setter.key.as_ref().expect("internal: it is an input");
                            let buffer = self.kernel.input(key).expect("internal: it is an input");
                            let count = once(&self.kernel, &self.kernel.buffers[buffer]);
                            text.line(format!("let absent_{field} = [T::from_f64({first}); {count}];"));
                            format!("self.{field}.unwrap_or(&absent_{field})")
                        }
                        false => format!("T::from_f64(self.{field}.map_or({first}, |value| value.number()))"),
                    }
                }
            };
            given.push(format!("{field}: {value}"));
        }
        // The carried moments are one slice.
        if interface.has_parts() {
            given.push(format!("law: {carried}"));
        }
        text.line(format!("let inputs = {}::Inputs {{ {} }};", self.name(), given.join(", ")));
    }
}

fn described(phase: Phase) -> &'static str {
    match phase {
        Phase::First => "the first instant",
        Phase::Later => "the instants after the first",
        Phase::Ahead => "an instant without observations",
        Phase::Back => "the message to the instant before",
        Phase::Both => "the distribution given earlier and later observations",
        Phase::Best => "the most likely states so far",
        Phase::Trace => "the state before a known one",
    }
}

/// What an input of a kernel is to the builder.
enum Source {
    /// The distribution that was carried.
    Carried,
    /// The message from later instants.
    Later,
    /// A state that is known, by its place among the carried variables.
    Then(usize),
    /// An observation that may be left out.
    Observed(VariableId),
    /// Whether it is given: the field of the observation.
    Whether(String),
    /// Any other input.
    Plain,
}

/// The source of an input.
fn source(step: &Step, interface: &Interface<'_>, key: Option<&InputKey>) -> Source {
    let is_absent = |variable: &VariableId| step.absent.iter().any(|(own, _)| own == variable);
    let then = |variable: &VariableId| step.carried.iter().position(|(now, _)| now == variable);
    match key {
        Some(InputKey::Previous(_) | InputKey::Law(_)) => Source::Carried,
        Some(InputKey::Answer(_)) if matches!(step.phase, Phase::Back | Phase::Both) => Source::Later,
        Some(InputKey::Value(variable, _)) if step.phase == Phase::Trace && then(variable).is_some() => {
            Source::Then(then(variable).unwrap_or_default())
        }
        Some(InputKey::Value(variable, _)) if is_absent(variable) => Source::Observed(*variable),
        Some(InputKey::Parameter(id)) => match step.absent.iter().find(|(_, flag)| flag == id) {
            Some((variable, _)) => {
                let field = interface.field_of(*variable).map(str::to_owned);
                field.map_or(Source::Plain, Source::Whether)
            }
            None => Source::Plain,
        },
        _ => Source::Plain,
    }
}

/// The inputs of each kernel.
pub(super) fn setters<'i>(
    instants: &[Instant],
    interfaces: &'i [Interface<'_>],
    enums: &Enums,
) -> Vec<Vec<Setter<'i>>> {
    instants.iter().zip(interfaces).map(|(it, own)| own.setters(&it.step().model, enums)).collect()
}

/// The builder of an instant's inputs: those of all kernels, each once. Leaves its implementation open.
pub(super) fn open_builder(
    instants: &[Instant],
    interfaces: &[Interface<'_>],
    all: &[Vec<Setter<'_>>],
    text: &mut Text,
) {
    let mut setters: Vec<&Setter<'_>> = Vec::new();
    let (mut seen, mut spaces): (Vec<&str>, Vec<(&str, &'static str)>) = (Vec::new(), Vec::new());
    for ((it, own), interface) in instants.iter().zip(all).zip(interfaces) {
        for setter in own {
            let from = source(it.step(), interface, setter.key.as_ref());
            if matches!(from, Source::Observed(_) | Source::Plain) && !seen.contains(&setter.field) {
                seen.push(setter.field);
                setters.push(setter);
            }
        }
        for space in interface.spaces() {
            if !spaces.contains(&space) {
                spaces.push(space);
            }
        }
    }
    interfaces[1].structure(&spaces, &setters, text);
}

/// The number of values of an input that is given once for the plate.
fn once(kernel: &Kernel, buffer: &Buffer) -> usize {
    let own = buffer.axes.iter().filter(|axis| !kernel.parallel.contains(axis));
    kernel.known_cells(own).unwrap_or(1)
}

/// Any value of a variable, as a number of the program.
fn first_value(model: &Model, variable: VariableId) -> String {
    match &model.variables[variable].domain {
        Domain::Real | Domain::Vector(_) => constant(0.0),
        Domain::Bins(bins) => constant(bins.centre(0)),
        domain => constant(domain.base() as f64),
    }
}
