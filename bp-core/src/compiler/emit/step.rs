//! Questions over time: a filter that takes one instant after the other.
//!
//! In: a route over time. Out: a module with the builder of an instant's inputs, `State`, and the kernels of the first instant,
//! of later ones, and of those that are predicted. Invariant: a step that fails leaves the state as it was; after the first
//! instant nothing allocates; an observation that is not given is not observed.

use super::instant::{Instant, open_builder, setters};
use super::interface::Interface;
use super::moments;
use super::naming::Naming;
use super::question::uses;
use super::text::Text;
use super::values::Enums;
use crate::error::Error;
use crate::kernel::OutputKey;
use crate::model::Model;
use crate::plan::{InstantCode, OverTime};

/// Writes the module of a question over time.
pub(super) fn emit(
    (model, enums): (&Model, &Enums),
    route: &OverTime,
    (name, question, number): (&str, &str, usize),
    equation: &str,
    text: &mut Text,
) -> Result<(), Error> {
    let instants = Instant::all(model, route, question)?;
    let mut naming = Naming::new();
    naming.unique("step");
    let interfaces: Vec<Interface<'_>> = instants.iter().map(|it| it.interface(&mut naming)).collect();
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
    answers.outputs_structure("", text);
    state(model, instants.len() > 2, text);
    for (it, interface) in instants.iter().zip(&interfaces) {
        it.module(interface, (question, number), model.plate.is_none(), false, text);
    }
    text.close();
    Ok(())
}

/// The builder of an instant's inputs, with `step`.
fn builder(instants: &[Instant], interfaces: &[Interface<'_>], enums: &Enums, text: &mut Text) {
    let all = setters(instants, interfaces, enums);
    open_builder(instants, interfaces, &all, text);
    text.line("/// Takes one instant: what is not given is not observed. The answer is read from the state.\n///\n/// # Errors\n/// An input that is missing or outside its domain; numbers that a form refuses; an observation of probability zero. The state\n/// is then as it was.");
    text.open("pub fn step(self, state: &mut State<T>) -> Result<Report, ::bp_core::compiler::error::Error>");
    let call = |at: usize, before: &str, into: &str, text: &mut Text| {
        let (it, interface) = (&instants[at], &interfaces[at]);
        let carried = format!("&{before}.outputs.{}[..]", it.carried_field(interface));
        it.inputs(interface, &all[at], [&carried, "&[]"], text);
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
