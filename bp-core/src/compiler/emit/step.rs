//! Questions over time: a filter that takes one instant after the other.
//!
//! In: a route over time. Out: a module with the builder of an instant's inputs, `State`, and the kernels of the first instant,
//! of later ones, and of those that are predicted. Invariant: a step that fails leaves the state as it was; after the first
//! instant nothing allocates; an observation that is not given is not observed.

use super::again::Asked;
use super::door::Setter;
use super::interface::Interface;
use super::moments;
use super::naming::Naming;
use super::question::{computation, prepared, uses};
use super::text::Text;
use super::value::constant;
use super::values::Enums;
use crate::error::Error;
use crate::ids::VariableId;
use crate::kernel::{Buffer, InputKey, Kernel, OutputKey};
use crate::lower::{Output, Phase, Step};
use crate::model::{Domain, Model};
use crate::plan::{InstantCode, Mark, OverTime};

/// The kernel of one kind of instant.
struct Instant {
    phase: Phase,
    code: InstantCode,
    kernel: Kernel,
    outputs: Vec<Output>,
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

    fn step(&self) -> &Step {
        match &self.code {
            InstantCode::Chain { step, .. } => step,
            InstantCode::Normal(normal) => &normal.step,
        }
    }

    /// The name of its module.
    fn name(&self) -> &'static str {
        match self.phase {
            Phase::First => "first",
            Phase::Later => "later",
            Phase::Ahead => "ahead",
        }
    }

    /// The output that is carried.
    fn carried(&self) -> OutputKey {
        match &self.code {
            InstantCode::Chain { .. } => OutputKey::Ask(0),
            InstantCode::Normal(_) => OutputKey::Law(0),
        }
    }
}

/// Writes the module of a question over time.
pub(super) fn emit(
    (model, enums): (&Model, &Enums),
    route: &OverTime,
    (name, question, number): (&str, &str, usize),
    equation: &str,
    text: &mut Text,
) -> Result<(), Error> {
    let instants: Vec<Instant> = (route.phases().iter())
        .map(|phase| Instant::new(model, route, *phase, question))
        .collect::<Result<_, _>>()?;
    let mut naming = Naming::new();
    naming.unique("step");
    let interfaces: Vec<Interface<'_>> = (instants.iter())
        .map(|it| Interface::new(&it.step().model, &it.kernel, &it.outputs, &mut naming))
        .collect();
    let (later, answers) = (&instants[1], &interfaces[1]);
    let mut documentation = vec![equation.to_owned()];
    if !route.is_exact() {
        documentation.push(
            "Approximate: an extended Kalman filter, whose tangents are taken at the mean before each observation."
                .to_owned(),
        );
    }
    answers.function(model, name, &documentation, text);
    text.documented(&documentation);
    text.open(format!("pub mod {name}"));
    uses(text);
    text.line(format!("const AHEAD: usize = {};", route.ask().when.ahead()));
    text.line("fn model() -> ::bp_core::compiler::model::Model { super::model() }");
    builder(&instants, &interfaces, enums, text);
    match &later.code {
        InstantCode::Chain { .. } => {
            let shown = |key| key == OutputKey::Ask(later.step().asks.len() - 1);
            answers.answer(&later.step().model, enums, &later.outputs, shown, text);
        }
        InstantCode::Normal(normal) => moments::answer(model, &normal.searched, text),
    }
    answers.outputs_structure(text);
    state(model, instants.len() > 2, text);
    for (it, interface) in instants.iter().zip(&interfaces) {
        text.documented(&[format!("The kernel of {}.", described(it.phase))]);
        text.open(format!("mod {}", it.name()));
        text.line("use super::*;");
        let generics = interface.inputs_structure("pub(super) ", text);
        let is_law = matches!(it.code, InstantCode::Normal(_));
        let asked = Asked { question, route: number, instant: Some((it.phase, is_law)) };
        let alone = (model.plate.is_none(), it.is_linear);
        computation(interface, (generics, "pub(super) "), &asked, alone, text);
        text.close();
    }
    text.close();
    Ok(())
}

fn described(phase: Phase) -> &'static str {
    match phase {
        Phase::First => "the first instant",
        Phase::Later => "the instants after the first",
        Phase::Ahead => "an instant without observations",
    }
}

/// What an input of a kernel is to the builder.
enum Source {
    /// The distribution that was carried.
    Carried,
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
    match key {
        Some(InputKey::Previous(_) | InputKey::Law(_)) => Source::Carried,
        Some(InputKey::Value(variable, _)) if is_absent(variable) => Source::Observed(*variable),
        Some(InputKey::Parameter(id)) => match step.absent.iter().find(|(_, flag)| flag == id) {
            Some((variable, _)) => Source::Whether(interface.field_of(*variable)),
            None => Source::Plain,
        },
        _ => Source::Plain,
    }
}

/// The builder of an instant's inputs: those of all kernels, each once.
fn builder(instants: &[Instant], interfaces: &[Interface<'_>], enums: &Enums, text: &mut Text) {
    let all: Vec<Vec<Setter<'_>>> =
        instants.iter().zip(interfaces).map(|(it, own)| own.setters(&it.step().model, enums)).collect();
    let mut setters: Vec<&Setter<'_>> = Vec::new();
    let (mut seen, mut spaces): (Vec<&str>, Vec<(&str, &'static str)>) = (Vec::new(), Vec::new());
    for ((it, own), interface) in instants.iter().zip(&all).zip(interfaces) {
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
    text.line("/// Takes one instant: what is not given is not observed. The answer is read from the state.\n///\n/// # Errors\n/// An input that is missing or outside its domain; numbers that a form refuses; an observation of probability zero. The state\n/// is then as it was.");
    text.open("pub fn step(self, state: &mut State<T>) -> Result<Report, ::bp_core::compiler::error::Error>");
    let call = |at: usize, before: &str, into: &str, text: &mut Text| {
        let (it, interface) = (&instants[at], &interfaces[at]);
        let mut given: Vec<String> =
            interface.spaces().iter().map(|(name, _)| format!("{name}: self.{name}")).collect();
        for setter in &all[at] {
            let field = setter.field;
            let value = match source(it.step(), interface, setter.key.as_ref()) {
                Source::Carried => {
                    let (id, _) = (it.kernel.outputs())
                        .find(|(_, key)| *key == it.carried())
                        .expect("internal: it is carried");
                    format!("&{before}.outputs.{}[..]", interface.output(id))
                }
                Source::Plain => setter.value(),
                Source::Whether(field) => {
                    format!("if self.{field}.is_some() {{ T::ONE }} else {{ T::ZERO }}")
                }
                Source::Observed(variable) => {
                    let first = first_value(&it.step().model, variable);
                    match setter.kind.as_str() {
                        "&'a [T]" => {
                            let input = it.kernel.input(setter.key.as_ref().expect("internal: it has a key"));
                            let buffer = &it.kernel.buffers[input.expect("internal: it is an input")];
                            let count = once(&it.kernel, buffer);
                            text.line(format!("let absent_{field} = [T::from_f64({first}); {count}];"));
                            format!("self.{field}.unwrap_or(&absent_{field})")
                        }
                        _ => format!("T::from_f64(self.{field}.map_or({first}, |value| value.number()))"),
                    }
                }
            };
            given.push(format!("{field}: {value}"));
        }
        // The carried moments are one slice.
        if interface.has_parts() {
            given.push(format!("law: &{before}.outputs.law[..]"));
        }
        text.line(format!("let inputs = {}::Inputs {{ {} }};", it.name(), given.join(", ")));
        if let InstantCode::Chain { .. } = it.code {
            let extents: Vec<String> =
                interface.open_extents().iter().map(|extent| interface.extent(extent)).collect();
            text.line(format!("{into}.extents = [{}];", extents.join(", ")));
        }
        text.line(format!("{into}.report = {}::run(&inputs, &mut {into}.outputs)?;", it.name()));
    };
    text.line("let State { now, next, answer, spare, .. } = state;");
    text.open("if state.instants == 0");
    call(0, "now", "next", text);
    text.close_with("} else {");
    text.line("// Later instants begin with what the last one carried.");
    call(1, "now", "next", text);
    text.line("}");
    if instants.len() > 2 {
        text.line("let mut before: &Answer<T> = &*next;");
        text.open("for ahead in 0..AHEAD");
        call(2, "before", "spare", text);
        text.line("::core::mem::swap(answer, spare);");
        text.line("before = &*answer;");
        text.close();
    }
    text.line("::core::mem::swap(now, next);");
    text.line("state.instants += 1;");
    text.line("add_up(&mut state.ln_evidence, &state.now.outputs.ln_evidence);");
    text.line("Ok(state.now.report)");
    text.close();
    text.close();
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

/// `State`: what is carried, the answer, and the sums.
fn state(model: &Model, predicts: bool, text: &mut Text) {
    text.line("/// What a filter carries from instant to instant, and the answer at the last one.\n#[derive(Clone, Debug, Default)]");
    text.open("pub struct State<T>");
    text.line("now: Answer<T>,\nnext: Answer<T>,\nanswer: Answer<T>,\nspare: Answer<T>,\ninstants: usize,\nln_evidence: Vec<f64>,");
    text.close();
    text.open("impl<T: Scalar> State<T>");
    text.line("/// Before the first instant.\npub fn new() -> Self { ::core::default::Default::default() }");
    text.line("/// The number of instants so far.\npub fn instants(&self) -> usize { self.instants }");
    match model.plate {
        None => {
            text.line("/// ln P(all observations so far).");
            text.line(
                "pub fn ln_evidence(&self) -> f64 { self.ln_evidence.first().copied().unwrap_or(0.0) }",
            );
        }
        Some(_) => {
            text.line("/// ln P(all observations so far), for each element of the plate.");
            text.line("pub fn ln_evidence(&self) -> &[f64] { &self.ln_evidence }");
        }
    }
    text.close();
    let own = if predicts { "answer" } else { "now" };
    text.line("/// The answer at the last instant, or the predicted one.");
    text.open("impl<T> ::core::ops::Deref for State<T>");
    text.line("type Target = Answer<T>;");
    text.line(format!("#[inline]\nfn deref(&self) -> &Answer<T> {{ &self.{own} }}"));
    text.close();
}
