//! One question: its inputs, its outputs, and the function that computes them.
//!
//! In: a lowered kernel. Out: a module with `Inputs`, `Outputs` and `run`. Invariant: lengths and values are checked once,
//! at the top; the loop below neither allocates nor fails.

use super::again::{Asked, again};
use super::given::given;
use super::interface::{Given, Interface};
use super::names::local;
use super::naming::Naming;
use super::nest::Nests;
use super::straight::{numbers, numbers_once};
use super::text::{Text, in_a_comment};
use super::uniform::with_uniform_conditions;
use super::values::Enums;
use crate::ids::{BufferId, Id};
use crate::kernel::schedule::{Group, Schedule};
use crate::kernel::{
    Buffer, Check, Kernel, Numbers, Role, USUAL_DISPLACEMENTS, Values, has_loop, with_plate,
    with_usual_displacements,
};
use crate::lower::Lowered;
use crate::model::{Model, Question};

/// The largest number of nests of a question that is computed inline in the caller.
const INLINED_NESTS: usize = 8;

/// Writes the module of a question.
pub(super) fn emit(
    (model, enums): (&Model, &Enums),
    lowered: &Lowered,
    (name, question, route): (&str, &str, usize),
    (is_linear, equation): (bool, &str),
    text: &mut Text,
) {
    let kernel = &prepared(&lowered.kernel);
    let interface = Interface::new(model, kernel, &lowered.outputs, &mut Naming::new());
    interface.function(model, name, &[equation.to_owned()], text);
    text.documented(&[equation.to_owned()]);
    text.open(format!("pub mod {name}"));
    uses(text);
    interface.builder(model, enums, text);
    interface.answer(model, enums, &lowered.outputs, |_| true, text);
    let generics = interface.inputs_structure("", text);
    interface.outputs_structure("", text);
    let asked = Asked { question, route, instant: None };
    computation(&interface, (generics, ""), &asked, (model.plate.is_none(), is_linear), text);
    text.close();
}

/// A kernel ready to be written.
pub(super) fn prepared(kernel: &Kernel) -> Kernel {
    with_uniform_conditions(&given(kernel)).validated()
}

/// What the code of a question uses, by name, because the surrounding code may have no prelude.
pub(super) fn uses(text: &mut Text) {
    text.line("use ::std::prelude::v1::*;");
    text.line("use ::bp_core::compiler::exec::compiled::*;");
    text.line("use ::bp_core::compiler::exec::scalar::Scalar;");
    text.line("pub use ::bp_core::compiler::exec::compiled::Report;");
}

/// The function that computes the answer, and the one for suspect cells. `alone`: the program has no plate.
pub(super) fn computation(
    interface: &Interface<'_>,
    (generics, visible): (&str, &str),
    asked: &Asked<'_>,
    (alone, is_linear): (bool, bool),
    text: &mut Text,
) {
    let kernel = interface.kernel;
    let impossible = match kernel.parallel.is_empty() && alone {
        true => "Evidence of probability zero.",
        false => "None for evidence of probability zero: its elements are zeros, which the report counts.",
    };
    text.line("/// Computes the answer.\n///\n/// # Errors");
    text.line(format!(
        "/// A wrong length; a number outside its domain, or that a form refuses. {impossible}"
    ));
    // A few numbers that are computed once: a call would take as long.
    if kernel.parallel.is_empty() && kernel.nests.len() <= INLINED_NESTS {
        text.line("#[inline(always)]");
    }
    text.line("#[allow(clippy::all, unused)]");
    text.open(format!("{visible}fn run<T: Scalar>(inputs: &Inputs{generics}, outputs: &mut Outputs<T>) -> Result<Report, ::bp_core::compiler::error::Error>"));
    for (id, axis) in kernel.axes.iter() {
        text.line(format!("let {}: usize = {};", local("e", id), interface.extent(&axis.extent)));
    }
    buffers(kernel, interface, text);
    text.line("let mut suspects: usize = 0;");
    let schedule = Schedule::of(kernel);
    let mut next = 0;
    while let Some(group) = schedule.groups.get(next) {
        let rest = &schedule.groups[next..];
        let numbers = numbers(kernel, rest);
        next += numbers.max(1);
        match (numbers, group.parallel) {
            (2.., _) => numbers_once(kernel, &schedule, rest, is_linear, text),
            (_, true) => {
                rooms(kernel, &schedule, group, text);
                let usual =
                    with_usual_displacements(kernel).filter(|(axis, _)| has_loop(kernel, group, *axis));
                if let Some((axis, known)) = &usual {
                    text.open(format!("if {} == {USUAL_DISPLACEMENTS}", local("e", *axis)));
                    parallel(known, &schedule, group, (is_linear, false), text);
                    text.close();
                    text.open("else");
                }
                parallel(kernel, &schedule, group, (is_linear, false), text);
                usual.iter().for_each(|_| text.close());
            }
            _ => match with_plate(kernel, group.nests[0].nest) {
                Some((own, schedule)) => {
                    rooms(&own, &schedule, &schedule.groups[0], text);
                    parallel(&own, &schedule, &schedule.groups[0], (is_linear, true), text)
                }
                None => Nests::new(kernel, &schedule, group, is_linear).serial(text),
            },
        }
    }
    conclusion(alone, kernel, text);
    for id in interface.outputs() {
        if let Some(best) = interface.best(*id) {
            best.fill(*id, interface.output(*id), &kernel.buffers[*id].name, text);
        }
    }
    text.line("Ok(report)");
    text.close();
    again(interface, generics, asked, (alone, is_linear), text);
}

/// The report: empty, unless a cell is suspect.
fn conclusion(alone: bool, kernel: &Kernel, text: &mut Text) {
    let total = kernel.checks.iter().find(|(_, check)| *check == Check::Total);
    let contexts = match (alone, total) {
        (true, Some((total, _))) => local("n", *total),
        (true, None) => "0".to_owned(),
        _ => String::new(),
    };
    let comma = if contexts.is_empty() { "" } else { ", " };
    text.open("let report: Report = match suspects");
    text.line("0 => Report::default(),");
    text.line(format!("_ => again(inputs, outputs, suspects{comma}{contexts})?,"));
    text.close_with("};");
}

/// A question that is not compiled: a module that states the reason, in its documentation and as a compile-time error
/// of a caller.
pub(super) fn emit_refused(model: &Model, question: &Question, name: &str, reason: &str, text: &mut Text) {
    let asked: Vec<String> = question.asks.iter().map(|ask| format!("`{}`", model.ask_text(ask))).collect();
    text.documented(&[
        format!("{}: this question is not compiled, and calling `ask` is an error.", asked.join("; ")),
        format!("The reason: {reason}."),
        "`bp_core::compiler::answer::ask` asks it of `model()` at run time, where it has an answer."
            .to_owned(),
    ]);
    text.line(format!("pub fn {name}() -> {name}::Question<()> {{ {name}::Question {{ nothing: () }} }}"));
    text.documented(&["Why it is not compiled: see the function of this name.".to_owned()]);
    text.open(format!("pub mod {name}"));
    text.line("use ::std::prelude::v1::*;");
    text.line("/// A question that is not compiled.\n#[derive(Clone, Copy, Debug)]\npub struct Question<N> { pub(super) nothing: N }");
    text.open("impl<N> Question<N>");
    let reason = in_a_comment(&format!("the question `{}` is not compiled: {reason}", question.name));
    text.line(format!("/// Not compiled: see the function that made it.\n#[deprecated(note = {reason:?})]"));
    text.open("pub fn ask(self) where Self: ::bp_core::compiler::exec::compiled::Compiled");
    text.close();
    text.close();
    text.close();
}

/// Binds inputs, allocates results, and computes strides.
fn buffers(kernel: &Kernel, interface: &Interface<'_>, text: &mut Text) {
    for (id, buffer) in kernel.buffers.iter() {
        let product = |axes: &mut dyn Iterator<Item = crate::ids::AxisId>| {
            // An overflow is refused at the allocation.
            let product = axes
                .map(|axis| local("e", axis))
                .reduce(|some, more| format!("{some}.saturating_mul({more})"));
            product.unwrap_or_else(|| "1usize".to_owned())
        };
        let (len, name) = (local("n", id), local("m", id));
        let whole = product(&mut buffer.axes.iter().copied());
        let once = product(&mut buffer.axes.iter().copied().filter(|axis| !kernel.parallel.contains(axis)));
        text.line(format!("let {len}: usize = {whole};"));
        let broadcast = matches!(buffer.role, Role::Input { broadcast: true, .. });
        match &buffer.role {
            Role::Input { .. } | Role::Table { key: Some(_), .. } => match interface.given(id) {
                Given::Number(field) => match domain(interface, id, buffer, text) {
                    Some(domain) => {
                        text.line(format!("let {name}: [T; 1] = [{domain}.ordinal(inputs.{field})?];"));
                        text.line(format!("let {name}: &[T] = &{name};"));
                    }
                    None => {
                        text.line(format!("let {name}: &[T] = ::core::slice::from_ref(&inputs.{field});"))
                    }
                },
                Given::Slice(field) => {
                    text.line(format!("let {name}: &[T] = inputs.{field};"));
                    text.line(match broadcast {
                        true => format!("check_broadcast({:?}, {name}.len(), {len}, {once})?;", buffer.name),
                        false => format!("check_length({:?}, {name}.len(), {len})?;", buffer.name),
                    });
                    if let Some(domain) = domain(interface, id, buffer, text) {
                        text.line(format!("let {name} = {domain}.ordinals({name})?;"));
                        text.line(format!("let {name}: &[T] = &{name};"));
                    }
                }
                Given::Derived(expression) => {
                    text.line(format!("let {name} = [{expression}];"));
                    text.line(format!("let {name}: &[T] = &{name};"));
                }
                Given::Part(field, place) => {
                    let (place, places) = (*place, interface.parts(field));
                    if place == 0 {
                        let title = &buffer.name;
                        text.line(format!(
                            "check_length({title:?}, inputs.{field}.len(), {len} * {places})?;"
                        ));
                    }
                    text.line(format!("let {name}: &[T] = &inputs.{field}[{place} * {len}..][..{len}];"));
                }
                Given::Table(field) => {
                    text.line(format!("let {name}: &[f64] = inputs.{field};"));
                    text.line(format!("check_length({:?}, {name}.len(), {len})?;", buffer.name));
                }
            },
            Role::Table { numbers, .. } => {
                let (count, fixed) = (numbers.len(), local("TABLE", id));
                text.line(format!("static {fixed}: [f64; {count}] = {numbers:?};"));
                text.line(format!("let {name}: &[f64] = &{fixed};"));
                if buffer.axes.iter().any(|axis| kernel.axes[*axis].extent.size.is_some()) {
                    text.line(format!("check_length({:?}, {name}.len(), {len})?;", buffer.name));
                }
            }
            Role::Positions(by, coordinate) => {
                let expression = interface.positions(*by, *coordinate);
                text.line(format!("let {name}: &[i32] = {expression};"));
                text.line(format!("check_length({:?}, {name}.len(), {len})?;", buffer.name));
            }
            Role::Output(_) if interface.part(id).is_some() => {
                let (field, place) = (interface.output(id), interface.part(id).unwrap_or_default());
                if place == 0 {
                    let places = interface.parts(field);
                    text.line(format!(
                        "make_room({:?}, {len} * {places}, &mut outputs.{field})?;",
                        buffer.name
                    ));
                    text.line(format!(
                        "let mut parts_of_{field} = outputs.{field}.chunks_exact_mut({len}.max(1));"
                    ));
                }
                text.line(format!(
                    "let {name}: &mut [T] = parts_of_{field}.next().expect(\"internal: a part for each moment\");"
                ));
            }
            Role::Output(_) => {
                let field = interface.output(id);
                text.line(format!("make_room({:?}, {len}, &mut outputs.{field})?;", buffer.name));
                text.line(format!("let {name}: &mut [T] = &mut outputs.{field}[..{len}];"));
            }
            Role::Scratch => {}
        }
        // A parallel axis of an input that is given once for the plate has stride 0.
        if broadcast {
            text.line(format!(
                "let g{}: usize = usize::from({name}.len() == {len} && {len} != {once} || {len} == 1);",
                id.position()
            ));
        }
        for (position, axis) in buffer.axes.iter().enumerate() {
            let after = &buffer.axes[position + 1..];
            let parallel = |axis: &crate::ids::AxisId| kernel.parallel.contains(axis);
            let stride = match broadcast {
                false => product(&mut after.iter().copied()),
                true if parallel(axis) => {
                    format!("g{} * {}", id.position(), product(&mut after.iter().copied()))
                }
                true => format!(
                    "if g{} == 1 {{ {} }} else {{ {} }}",
                    id.position(),
                    product(&mut after.iter().copied()),
                    product(&mut after.iter().copied().filter(|axis| !parallel(axis)))
                ),
            };
            text.line(format!("let q{}_{position}: usize = {stride};", id.position()));
        }
    }
}

/// The domain of an input, as an expression.
fn domain(interface: &Interface<'_>, id: BufferId, buffer: &Buffer, text: &mut Text) -> Option<String> {
    let Values { variable, domain, numbers } = buffer.values.as_ref()?;
    let numbers = match numbers {
        Numbers::Real => "Numbers::Real".to_owned(),
        Numbers::Whole { first, count } => {
            let counts: Vec<String> = count.iter().map(|extent| interface.extent(extent)).collect();
            let count = counts.into_iter().reduce(|some, more| format!("({some}).saturating_mul({more})"));
            let count = count.unwrap_or_else(|| "1".to_owned());
            format!("Numbers::Whole {{ first: {first}, count: {count} }}")
        }
        Numbers::Bins(bins) => {
            let (count, fixed) = (bins.edges().len(), local("EDGES", id));
            text.line(format!("static {fixed}: [f64; {count}] = {:?};", bins.edges()));
            format!("Numbers::Bins {{ edges: &{fixed}, circle: {} }}", bins.is_circle())
        }
    };
    let input = &buffer.name;
    Some(format!(
        "Domain {{ input: {input:?}, variable: {variable:?}, text: {domain:?}, numbers: {numbers} }}"
    ))
}

/// Allocates a buffer that a serial group computes, or that a parallel one computes for another.
pub(super) fn room(kernel: &Kernel, id: BufferId, text: &mut Text) {
    let buffer = &kernel.buffers[id];
    let (len, name) = (local("n", id), local("m", id));
    match (&buffer.role, kernel.known_cells(&buffer.axes)) {
        (Role::Output(_), _) => {}
        (_, Some(known)) if known <= 1024 => text.line(format!("let mut {name} = [T::ZERO; {known}];")),
        _ => {
            text.line(format!("let mut {name}: Vec<T> = Vec::new();"));
            text.line(format!("make_room({:?}, {len}, &mut {name})?;", buffer.name));
        }
    }
}

/// The buffers of a group that others read.
fn shared(kernel: &Kernel, schedule: &Schedule, group: &Group) -> Vec<BufferId> {
    let made = group.nests.iter().map(|nest| kernel.nests[nest.nest].out);
    made.filter(|out| !schedule.local[out.position()]).collect()
}

/// Allocates them.
fn rooms(kernel: &Kernel, schedule: &Schedule, group: &Group, text: &mut Text) {
    shared(kernel, schedule, group).into_iter().for_each(|out| room(kernel, out, text));
}

/// Writes a pass over a plate. A pass over its own axes is computed once, in f64 like all values that are computed
/// once.
fn parallel(
    kernel: &Kernel,
    schedule: &Schedule,
    group: &Group,
    (is_linear, in_f64): (bool, bool),
    text: &mut Text,
) {
    let shared = shared(kernel, schedule, group);
    let (lane, rows) = kernel.parallel.split_last().expect("internal: a parallel group has axes");
    let row_count: Vec<String> = rows.iter().map(|axis| local("e", *axis)).collect();
    let (units, unit) = match rows.is_empty() {
        true => (local("e", *lane), "1".to_owned()),
        false => (row_count.join(" * "), local("e", *lane)),
    };
    let slices: Vec<String> = shared.iter().map(|id| format!("&mut {}[..]", local("m", *id))).collect();
    let pass = Nests::new(kernel, schedule, group, is_linear).blocks(&shared);
    let made: Vec<BufferId> = group.nests.iter().map(|nest| kernel.nests[nest.nest].out).collect();
    let fields = pass.captured(kernel, &made);
    text.open("");
    text.line("/// The inputs of one pass.");
    text.open("struct Group<'g, T>");
    fields.iter().for_each(|(name, kind)| text.line(format!("{name}: {kind},")));
    text.line("number: ::core::marker::PhantomData<&'g T>,");
    text.close();
    text.open("impl<T: Scalar> Pass<T> for Group<'_, T>");
    text.line("#[inline(always)]");
    text.open("fn piece(&self, first: usize, count: usize, planes: &mut [Planes<'_, T>]) -> usize");
    let names: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
    text.line(format!(
        "let Self {{ {} .. }} = *self;",
        names.iter().map(|n| format!("{n},")).collect::<String>()
    ));
    pass.write(text);
    text.close();
    text.close();
    let mut given = String::new();
    for (name, kind) in &fields {
        given.push_str(&match *kind {
            "usize" => format!("{name}, "),
            "&'g [T]" if in_f64 => {
                text.line(format!("let wide_{name} = T::widen(&{name}[..]);"));
                format!("{name}: &wide_{name}[..], ")
            }
            _ => format!("{name}: &{name}[..], "),
        });
    }
    let (precision, each) = if in_f64 { ("f64", "each_piece_in_f64") } else { ("T", "each_piece") };
    text.line(format!(
        "let group: Group<'_, {precision}> = Group {{ {given}number: ::core::marker::PhantomData }};"
    ));
    text.line(format!("suspects += {each}({units}, {unit}, ::std::vec![{}], &group);", slices.join(", ")));
    text.close();
}
