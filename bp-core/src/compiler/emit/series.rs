//! Questions about a whole series: each instant given all observations, or the most likely states together.
//!
//! In: a route of finite states. Out: a module with the builder of an instant's inputs, and `Series`, which runs over a list of
//! instants. Invariant: time is a loop of the host over kernels of one instant; a series of the same length allocates nothing again.

use super::instant::{Instant, open_builder, setters};
use super::interface::Interface;
use super::names::{Names, snake};
use super::naming::Naming;
use super::question::uses;
use super::text::Text;
use super::value::constant;
use super::values::Enums;
use crate::error::Error;
use crate::kernel::OutputKey;
use crate::lower::Phase;
use crate::model::{Domain, Model, When};
use crate::plan::OverTime;

/// The result of a function that runs a kernel.
const RESULT: &str = "Result<Report, ::bp_core::compiler::error::Error>";

/// Writes the module of a question about a whole series.
pub(super) fn emit(
    (model, enums): (&Model, &Enums),
    route: &OverTime,
    (name, question, number): (&str, &str, usize),
    equation: &str,
    text: &mut Text,
) -> Result<(), Error> {
    let instants = Instant::all(model, route, question)?;
    let mut naming = Naming::new();
    let interfaces: Vec<Interface<'_>> = (instants.iter())
        .map(|it| {
            naming.unique(&method(it));
            it.interface(&mut naming)
        })
        .collect();
    let documentation = [equation.to_owned()];
    interfaces[1].function(model, name, &documentation, text);
    text.documented(&documentation);
    text.open(format!("pub mod {name}"));
    uses(text);
    text.line("fn model() -> ::bp_core::compiler::model::Model { super::model() }");
    let all = setters(&instants, &interfaces, enums);
    open_builder(&instants, &interfaces, &all, text);
    for ((it, interface), setters) in instants.iter().zip(&interfaces).zip(&all) {
        let (arguments, [carried, later]) = match it.phase {
            Phase::First => ("counts: &mut [usize; CARRIED]", ["&[]", "&[]"]),
            Phase::Back => ("later: &[T]", ["&[]", "later"]),
            Phase::Both => {
                ("carried: &[T], later: &[T], extents: &mut [usize; EXTENTS]", ["carried", "later"])
            }
            Phase::Trace => ("carried: &[T], then: &[Vec<T>]", ["carried", "&[]"]),
            Phase::Later | Phase::Best | Phase::Ahead => ("carried: &[T]", ["carried", "&[]"]),
        };
        let module = it.name();
        text.open(format!(
            "fn {}(self, {arguments}, outputs: &mut {module}::Outputs<T>) -> {RESULT}",
            method(it)
        ));
        it.inputs(interface, setters, [carried, later], text);
        let extents = |all: Vec<String>| all.join(", ");
        match it.phase {
            Phase::First => {
                let out = it.kernel.outputs().find(|(_, key)| *key == OutputKey::Ask(0));
                let axes = &it.kernel.buffers[out.expect("internal: states are carried").0].axes;
                let own = axes.iter().take(route.carried.len()).map(|axis| &it.kernel.axes[*axis].extent);
                text.line(format!(
                    "*counts = [{}];",
                    extents(own.map(|extent| interface.extent(extent)).collect())
                ));
            }
            Phase::Both => {
                let open = interface.open_extents();
                let open = open.iter().map(|extent| interface.extent(extent)).collect();
                text.line(format!("*extents = [{}];", extents(open)));
            }
            _ => {}
        }
        text.line(format!("{module}::run(&inputs, outputs)"));
        text.close();
    }
    text.close();
    text.line(format!("const CARRIED: usize = {};", route.carried.len()));
    let fields: Vec<&str> = instants.iter().zip(&interfaces).map(|(it, own)| it.carried_field(own)).collect();
    match route.ask().when {
        When::Sequence => sequence((model, enums), route, &fields, text),
        _ => {
            let both = &instants[3];
            text.line(format!("const EXTENTS: usize = {};", interfaces[3].open_extents().len()));
            text.line("use both::Outputs;");
            let shown = |key| key == OutputKey::Ask(0);
            interfaces[3].answer(&both.step().model, enums, &both.outputs, shown, text);
            smoothed(model, &fields, text);
        }
    }
    for (it, interface) in instants.iter().zip(&interfaces) {
        it.module(interface, (question, number), model.plate.is_none(), true, text);
    }
    text.close();
    Ok(())
}

/// The function that runs a kernel.
fn method(it: &Instant) -> String {
    format!("kernel_{}", it.name())
}

/// ln P(observations), as a method.
fn ln_evidence(model: &Model, text: &mut Text) {
    match model.plate {
        None => {
            text.line("/// ln P(all observations).");
            text.line(
                "pub fn ln_evidence(&self) -> f64 { self.ln_evidence.first().copied().unwrap_or(0.0) }",
            );
        }
        Some(_) => {
            text.line("/// ln P(all observations), for each element of the plate.");
            text.line("pub fn ln_evidence(&self) -> &[f64] { &self.ln_evidence }");
        }
    }
}

/// The first lines of `run`: the forward messages, one after the other in `forward`.
fn forward(later: &str, fields: &[&str], sums: bool, text: &mut Text) {
    text.line("/// Computes the answer for all instants together.\n///\n/// # Errors\n/// An input that is missing or outside its domain; numbers that a form refuses; observations of probability zero.");
    text.open(format!("pub fn run(&mut self, instants: &[Question<'_, T>]) -> {RESULT}"));
    text.line("let mut report = Report::default();");
    text.line("self.forward.clear();\nself.ln_evidence.clear();");
    text.line("let mut counts = [1usize; CARRIED];");
    text.open("for (number, instant) in instants.iter().enumerate()");
    text.open("if number == 0");
    text.line("report.impossible += instant.kernel_first(&mut counts, &mut self.first)?.impossible;");
    text.line(format!("self.forward.extend_from_slice(&self.first.{});", fields[0]));
    if sums {
        text.line("add_up(&mut self.ln_evidence, &self.first.ln_evidence);");
    }
    text.close_with("} else {");
    text.line(format!("let carried = &self.forward[self.forward.len() - self.first.{}.len()..];", fields[0]));
    text.line(format!(
        "report.impossible += instant.kernel_{later}(carried, &mut self.{later})?.impossible;"
    ));
    text.line(format!("self.forward.extend_from_slice(&self.{later}.{});", fields[1]));
    if sums {
        text.line(format!("add_up(&mut self.ln_evidence, &self.{later}.ln_evidence);"));
    }
    text.line("}");
    text.close();
    text.line(format!("let cells = self.first.{}.len();", fields[0]));
}

/// `Series` of a question `smooth`.
fn smoothed(model: &Model, fields: &[&str], text: &mut Text) {
    text.line(
        "/// The distribution at each instant, given all observations.\n#[derive(Clone, Debug, Default)]",
    );
    text.open("pub struct Series<T>");
    text.line("first: first::Outputs<T>,\nlater: later::Outputs<T>,\nback: back::Outputs<T>,\nforward: Vec<T>,\nmessage: Vec<T>,\nanswers: Vec<Answer<T>>,\nln_evidence: Vec<f64>,");
    text.close();
    text.open("impl<T: Scalar> Series<T>");
    text.line("/// Of no instant.\npub fn new() -> Self { ::core::default::Default::default() }");
    text.line("/// The number of instants.\npub fn instants(&self) -> usize { self.answers.len() }");
    text.line(
        "/// The answer at an instant, counted from 0.\n///\n/// # Panics\n/// There is no such instant.",
    );
    text.line("#[inline]\npub fn at(&self, instant: usize) -> &Answer<T> { &self.answers[instant] }");
    ln_evidence(model, text);
    forward("later", fields, true, text);
    text.line("self.answers.resize_with(instants.len(), ::core::default::Default::default);");
    text.line("self.message.clear();\nself.message.resize(cells, T::ONE);");
    text.open("for (number, instant) in instants.iter().enumerate().rev()");
    text.line(
        "let (carried, answer) = (&self.forward[number * cells..][..cells], &mut self.answers[number]);",
    );
    text.line("answer.report = instant.kernel_both(carried, &self.message, &mut answer.extents, &mut answer.outputs)?;");
    text.open("if number > 0");
    text.line("instant.kernel_back(&self.message, &mut self.back)?;");
    text.line(format!("self.message.copy_from_slice(&self.back.{});", fields[2]));
    text.close();
    text.close();
    text.line("Ok(report)");
    text.close();
    text.close();
}

/// `Series` of a question `sequence`.
fn sequence((model, enums): (&Model, &Enums), route: &OverTime, fields: &[&str], text: &mut Text) {
    text.line("/// The most likely states of all instants together.\n#[derive(Clone, Debug, Default)]");
    text.open("pub struct Series<T>");
    text.line("first: first::Outputs<T>,\nbest: best::Outputs<T>,\ntrace: trace::Outputs<T>,\nforward: Vec<T>,\nthen: Vec<Vec<T>>,\nvalues: Vec<usize>,\nplate: usize,\nln_evidence: Vec<f64>,");
    text.close();
    let mut names = Names::default();
    ["new", "run", "instants"].iter().for_each(|taken| drop(names.unique(taken)));
    text.open("impl<T: Scalar> Series<T>");
    text.line("/// Of no instant.\npub fn new() -> Self { ::core::default::Default::default() }");
    text.line("/// The number of instants.");
    text.line("pub fn instants(&self) -> usize { self.values.len() / (CARRIED * self.plate.max(1)) }");
    let (argument, element) = match model.plate {
        Some(_) => (", element: usize", "element"),
        None => ("", "0"),
    };
    let carried: Vec<_> = route.carried.iter().map(|(now, _)| *now).collect();
    for (place, now) in carried.iter().enumerate() {
        let (kind, wanted) = (enums.of(model, *now).name, snake(&model.variable_name(*now)));
        let name = names.unique(wanted.trim_matches('_'));
        text.documented(&[
            format!("The value of `{}` at an instant, counted from 0.", model.variable_name(*now)),
            String::new(),
            "# Panics".to_owned(),
            "There is no such instant.".to_owned(),
        ]);
        text.open(format!("pub fn {name}(&self, instant: usize{argument}) -> {kind}"));
        text.line(format!(
            "<{kind} as Value>::of(number_{place}(self.values[(instant * CARRIED + {place}) * self.plate + {element}]))"
        ));
        text.close();
    }
    forward("best", fields, false, text);
    text.line("self.plate = cells / counts.iter().product::<usize>().max(1);");
    text.line("let plate = self.plate;");
    text.line("self.values.clear();\nself.values.resize(instants.len() * CARRIED * plate, 0);");
    text.line("self.then.resize_with(CARRIED, ::core::default::Default::default);");
    text.line("self.then.iter_mut().for_each(|own| own.resize(plate, T::ZERO));");
    text.open("for number in (0..instants.len()).rev()");
    text.open("if number + 1 < instants.len()");
    text.line("let carried = &self.forward[number * cells..][..cells];");
    text.line("instants[number + 1].kernel_trace(carried, &self.then, &mut self.trace)?;");
    text.close();
    text.line("let last = number + 1 == instants.len();");
    text.open("for element in 0..plate");
    text.line(format!(
        "let cells = if last {{ &self.forward[number * cells..][..cells] }} else {{ &self.trace.{}[..] }};",
        fields[2]
    ));
    text.line("let mut place = largest(cells, plate, element);");
    let numbers: Vec<String> = (0..carried.len()).map(|place| format!("number_{place}")).collect();
    text.line(format!("let numbers: [fn(usize) -> f64; CARRIED] = [{}];", numbers.join(", ")));
    text.open("for variable in (0..CARRIED).rev()");
    text.line("let ordinal = place % counts[variable];");
    text.line("place /= counts[variable];");
    text.line("self.values[(number * CARRIED + variable) * plate + element] = ordinal;");
    text.line("self.then[variable][element] = T::from_f64(numbers[variable](ordinal));");
    text.close();
    text.close();
    text.close();
    text.line("Ok(report)");
    text.close();
    text.close();
    for (place, now) in carried.iter().enumerate() {
        text.open(format!("fn number_{place}(ordinal: usize) -> f64"));
        match &model.variables[*now].domain {
            Domain::Bins(bins) => {
                let centres: Vec<String> = (0..bins.count()).map(|bin| constant(bins.centre(bin))).collect();
                text.line(format!("[{}][ordinal]", centres.join(", ")));
            }
            domain => text.line(format!("ordinal as f64 + {}", constant(domain.base() as f64))),
        }
        text.close();
    }
}
