//! One question: its inputs, its outputs, and the function that computes them.
//!
//! In: a lowered kernel. Out: a module with `Inputs`, `Outputs` and `run`. Invariant: lengths are checked once, at
//! the top; the loop below neither allocates nor fails.

use super::given::given;
use super::names::{self, Given, Taken, local, snake};
use super::nest::Nests;
use super::text::{Text, words};
use crate::error::Error;
use crate::ids::{BufferId, Id};
use crate::kernel::schedule::{Group, Schedule};
use crate::kernel::{Kernel, Role, with_plate};
use crate::lower::Lowered;
use crate::model::Question;

/// Writes the module of a question.
///
/// # Errors
/// Two names that would be one in Rust; nothing is written then.
pub(super) fn emit(lowered: &Lowered, name: &str, equation: &str, text: &mut Text) -> Result<(), Error> {
    let kernel = &given(&lowered.kernel);
    check_names(kernel)?;
    text.line(format!("/// {equation}"));
    text.open(format!("pub mod {name}"));
    text.line("use ::bp_core::exec::compiled::*;");
    text.line("use ::bp_core::exec::scalar::Scalar;");
    let generics = structures(kernel, text);
    text.line("/// Computes the answer; outputs are made as long as they have to be.\n///\n/// # Errors\n/// An input of the wrong length.");
    text.line("#[allow(clippy::all, unused)]");
    text.open(format!("pub fn run<T: Scalar>(inputs: &Inputs{}, outputs: &mut Outputs<T>) -> Result<(), ::bp_core::error::Error>", generics.replace("'a", "'_")));
    extents(kernel, text);
    buffers(kernel, text);
    let schedule = Schedule::of(kernel);
    for group in &schedule.groups {
        match group.parallel {
            true => parallel(kernel, &schedule, group, false, text),
            false => match with_plate(kernel, group.nests[0].nest) {
                Some((alone, schedule)) => parallel(&alone, &schedule, &schedule.groups[0], true, text),
                None => Nests::new(kernel, &schedule, group).serial(text),
            },
        }
    }
    text.line("Ok(())");
    text.close();
    text.close();
    Ok(())
}

/// A question that is answered in closed form: a function that makes its filter.
pub(super) fn emit_filter(question: &Question, number: usize, name: &str, equation: &str, text: &mut Text) {
    text.line(format!("/// {equation}"));
    text.open(format!("pub mod {name}"));
    text.line("/// The filter that answers, at rest.\n///\n/// # Errors\n/// A parameter that is missing, or has a value that it cannot have.");
    text.open(
        "pub fn filter(parameters: &[(&str, f64)]) -> Result<::bp_core::exec::Filter, ::bp_core::error::Error>",
    );
    text.line("let model = super::model();");
    text.line(format!(
        "let question = model.question({:?}).expect(\"internal: it was there\");",
        question.name
    ));
    text.line("let plan = ::bp_core::plan::plan(&model, question, ::bp_core::plan::Options::default())?;");
    text.open(format!("match &plan.routes[{number}]"));
    text.line(
        "::bp_core::plan::Route::Gaussian(plan) => ::bp_core::exec::Filter::new(&model, plan, parameters),",
    );
    text.line("_ => unreachable!(\"internal: it was linear and Gaussian\"),");
    text.close();
    text.close();
    text.close();
}

/// What goes in and what comes out; gives the generics of the inputs: those that a field needs.
fn structures(kernel: &Kernel, text: &mut Text) -> &'static str {
    let mut fields: Vec<String> = Vec::new();
    let (mut borrows, mut numbers) = (false, false);
    for (field, kind, what) in names::sizes(kernel) {
        borrows |= kind.starts_with('&');
        fields.push(format!("/// {what}\npub {field}: {kind},"));
    }
    for (id, buffer) in kernel.inputs() {
        let shape: Vec<&str> = buffer.axes.iter().map(|axis| kernel.axes[*axis].name.as_str()).collect();
        let shape = shape.join("][");
        let once = match buffer.role {
            Role::Input { broadcast: true, .. } => ", or one for the whole plate",
            _ => "",
        };
        match names::given(kernel, id) {
            Given::Number(field) => {
                numbers = true;
                fields.push(format!("/// `{}`.\npub {field}: T,", buffer.name));
            }
            Given::Slice(field) => {
                (borrows, numbers) = (true, true);
                fields.push(format!("/// `{}`, by \\[{shape}\\]{once}.\npub {field}: &'a [T],", buffer.name));
            }
            Given::Derived(_) => {}
        }
    }
    text.line("/// What the question is given.\n#[derive(Clone, Copy, Debug)]");
    let generics = match (borrows, numbers) {
        (true, true) => "<'a, T>",
        (true, false) => "<'a>",
        (false, true) => "<T>",
        (false, false) => "",
    };
    text.open(format!("pub struct Inputs{generics}"));
    fields.iter().for_each(|field| text.line(field));
    text.close();
    text.line("/// What the question answers.\n#[derive(Clone, Debug, Default)]");
    text.open("pub struct Outputs<T>");
    for (_, buffer) in kernel.outputs() {
        let shape: Vec<&str> = buffer.axes.iter().map(|axis| kernel.axes[*axis].name.as_str()).collect();
        text.line(format!("/// `{}`, by \\[{}\\].", buffer.name, shape.join("][")));
        text.line(format!("pub {}: Vec<T>,", snake(&buffer.name)));
    }
    text.close();
    generics
}

/// Names of the kernel that would be one name in Rust.
fn check_names(kernel: &Kernel) -> Result<(), Error> {
    let mut fields = Taken::default();
    for (field, _, _) in names::sizes(kernel) {
        let size =
            kernel.sizes().into_iter().find(|size| snake(size.split('.').next().unwrap_or(size)) == field);
        fields.take(field, size.unwrap_or("a size"))?;
    }
    for (id, buffer) in kernel.inputs() {
        match names::given(kernel, id) {
            Given::Number(field) | Given::Slice(field) => fields.take(field, &buffer.name)?,
            Given::Derived(_) => {}
        }
    }
    let mut fields = Taken::default();
    kernel.outputs().try_for_each(|(_, buffer)| fields.take(snake(&buffer.name), &buffer.name))
}

fn extents(kernel: &Kernel, text: &mut Text) {
    for (id, axis) in kernel.axes.iter() {
        text.line(format!("let {}: usize = {};", local("e", id), names::extent(kernel, &axis.extent)));
    }
}

/// Binds inputs, makes room for what is made, and gives strides.
fn buffers(kernel: &Kernel, text: &mut Text) {
    for (id, buffer) in kernel.buffers.iter() {
        let product = |axes: &mut dyn Iterator<Item = crate::ids::AxisId>| {
            // More than can be counted is refused where room is made.
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
            Role::Input { .. } => match names::given(kernel, id) {
                Given::Number(field) => {
                    text.line(format!("let {name}: &[T] = ::std::slice::from_ref(&inputs.{field});"))
                }
                Given::Slice(field) => {
                    text.line(format!("let {name}: &[T] = inputs.{field};"));
                    text.line(match broadcast {
                        true => format!("check_broadcast({:?}, {name}.len(), {len}, {once})?;", buffer.name),
                        false => format!("check_length({:?}, {name}.len(), {len})?;", buffer.name),
                    });
                }
                Given::Derived(expression) => {
                    text.line(format!("let {name} = [{expression}];"));
                    text.line(format!("let {name}: &[T] = &{name};"));
                }
            },
            Role::Table(numbers) => {
                let (count, fixed) = (numbers.len(), local("TABLE", id));
                text.line(format!("static {fixed}: [f64; {count}] = {numbers:?};"));
                text.line(format!("let {name}: &[f64] = &{fixed};"));
                if buffer.axes.iter().any(|axis| kernel.axes[*axis].extent.size.is_some()) {
                    text.line(format!("check_length({:?}, {name}.len(), {len})?;", buffer.name));
                }
            }
            Role::Positions => {
                let Given::Derived(expression) = names::given(kernel, id) else {
                    unreachable!("internal: positions belong to a set")
                };
                text.line(format!("let {name}: &[i32] = {expression};"));
                text.line(format!("check_length({:?}, {name}.len(), {len})?;", buffer.name));
            }
            Role::Output => text.line(format!(
                "make_room({:?}, {len}, &mut outputs.{})?;",
                buffer.name,
                snake(&buffer.name)
            )),
            Role::Scratch => {}
        }
        // A parallel axis of an input that was given once for the plate has stride 0.
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

/// Room for a buffer that a serial group makes, or that a parallel one makes for another.
pub(super) fn room(kernel: &Kernel, id: BufferId, text: &mut Text) {
    let buffer = &kernel.buffers[id];
    let (len, name) = (local("n", id), local("m", id));
    match (&buffer.role, kernel.known_cells(&buffer.axes)) {
        (Role::Output, _) => {
            text.line(format!("let {name}: &mut [T] = &mut outputs.{}[..];", snake(&buffer.name)))
        }
        (_, Some(known)) if known <= 1024 => text.line(format!("let mut {name} = [T::ZERO; {known}];")),
        _ => {
            text.line(format!("let mut {name}: Vec<T> = Vec::new();"));
            text.line(format!("make_room({:?}, {len}, &mut {name})?;", buffer.name));
        }
    }
}

/// A pass over a plate. One that is computed once, along axes of its own, is so in f64 as all that is computed once.
fn parallel(kernel: &Kernel, schedule: &Schedule, group: &Group, in_f64: bool, text: &mut Text) {
    let mut shared: Vec<BufferId> = Vec::new();
    for nest in &group.nests {
        let out = kernel.nests[nest.nest].out;
        if !schedule.local[out.position()] {
            room(kernel, out, text);
            shared.push(out);
        }
    }
    let (lane, rows) = kernel.parallel.split_last().expect("internal: a parallel group has axes");
    let row_count: Vec<String> = rows.iter().map(|axis| local("e", *axis)).collect();
    let (units, unit) = match rows.is_empty() {
        true => (local("e", *lane), "1".to_owned()),
        false => (row_count.join(" * "), local("e", *lane)),
    };
    let slices: Vec<String> = shared.iter().map(|id| format!("&mut {}[..]", local("m", *id))).collect();
    let mut body = Text::default();
    Nests::new(kernel, schedule, group).blocks(&shared, &mut body);
    let body = body.finish();
    let made: Vec<BufferId> = group.nests.iter().map(|nest| kernel.nests[nest.nest].out).collect();
    let fields = captured(kernel, &made, &body);
    text.open("");
    text.line("/// One pass: what it reads.");
    text.open("struct Group<'g, T>");
    fields.iter().for_each(|(name, kind)| text.line(format!("{name}: {kind},")));
    text.line("number: ::std::marker::PhantomData<&'g T>,");
    text.close();
    text.open("impl<T: Scalar> Pass<T> for Group<'_, T>");
    text.line("#[inline(always)]");
    text.open("fn piece(&self, first: usize, count: usize, planes: &mut [Planes<'_, T>])");
    let names: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
    text.line(format!(
        "let Self {{ {} .. }} = *self;",
        names.iter().map(|n| format!("{n},")).collect::<String>()
    ));
    text.line(body);
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
        "let group: Group<'_, {precision}> = Group {{ {given}number: ::std::marker::PhantomData }};"
    ));
    text.line(format!("{each}({units}, {unit}, vec![{}], &group);", slices.join(", ")));
    text.close();
}

/// The names of a pass that come from outside it, and their types.
fn captured(kernel: &Kernel, made: &[BufferId], body: &str) -> Vec<(String, &'static str)> {
    let mut fields: Vec<(String, &'static str)> = Vec::new();
    for word in words(body) {
        let (prefix, number) = word.split_at(1);
        let buffer = number.split('_').next().and_then(|number| number.parse::<usize>().ok());
        let kind = match (prefix, buffer) {
            ("e" | "q" | "g", Some(_)) => "usize",
            ("m", Some(buffer)) => {
                let id = kernel.buffers.ids().nth(buffer).expect("internal: a name of a buffer");
                match kernel.buffers[id].role {
                    _ if made.contains(&id) => continue,
                    Role::Positions => "&'g [i32]",
                    Role::Table(_) => "&'g [f64]",
                    _ => "&'g [T]",
                }
            }
            _ => continue,
        };
        if !fields.iter().any(|(known, _)| *known == word) {
            fields.push((word.to_owned(), kind));
        }
    }
    fields
}
