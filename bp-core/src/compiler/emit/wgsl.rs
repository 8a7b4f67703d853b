//! Kernels as WGSL: the text of a compute shader for WebGPU, in f32.
//!
//! In: a [`Kernel`]. Out: a [`Shader`]: one module, and an entry point for each pass of its schedule. Invariant: nests
//! and schedule are those of the other back ends; an invocation computes one cell of a pass and reads only results of
//! earlier passes, or its own.
//!
//! All numbers, inputs and results, are in one array, so that a kernel needs three bindings regardless of its inputs:
//! `numbers`, `positions` and `shape`. [`Layout`] has the offsets. Results that only their own invocation reads are not
//! in that array, and short loops over them are unrolled, so that they can stay in registers.
//! Language: W3C, *WebGPU Shading Language*, 2026.

mod functions;
mod layout;
mod print;
mod value;

use super::cellwise::Cellwise;
use super::names::{Names, snake};
use super::text::{Text, in_a_comment};
use crate::error::Error;
use crate::ids::{AxisId, BufferId, Id};
use crate::kernel::schedule::{Group, Schedule};
use crate::kernel::{Buffer, Kernel, Node, Numbers, Reduce, Role, Values};
use crate::loops::{Of, Statement, validate};
pub use layout::Layout;
use layout::{Place, Term};
use print::Printer;

/// Invocations in a workgroup.
pub const WORKGROUP: u32 = 64;

/// Upper limit on workgroups along the first direction of a dispatch; the rest goes along the second direction.
pub const MOST_WORKGROUPS: u32 = 65_535;

/// A kernel as a compute shader.
#[derive(Clone, PartialEq, Debug)]
pub struct Shader {
    /// The module.
    pub text: String,
    /// Its entry points, in the order in which they are dispatched.
    pub passes: Vec<ShaderPass>,
    /// The offsets of its numbers.
    pub layout: Layout,
}

/// One entry point.
#[derive(Clone, PartialEq, Debug)]
pub struct ShaderPass {
    /// Its name.
    pub entry: String,
    /// The axes of its cells, each computed by one invocation.
    pub axes: Vec<AxisId>,
}

/// Writes a kernel as WGSL. Extents that are known ([`Kernel::with_sizes`]) are constants of the text, others are read
/// at run time.
///
/// # Errors
/// The kernel computes the probability of a bin under a law whose cumulative distribution WGSL has no function for.
pub fn emit_wgsl(kernel: &Kernel) -> Result<Shader, Error> {
    let part = Part::of(kernel, "")?;
    Ok(Shader { text: module(std::slice::from_ref(&part)), passes: part.passes, layout: part.layout })
}

/// Writes several kernels as one module of WGSL: they share the three bindings, and each has entry points that begin
/// with its name. Equal names are distinguished by a number.
///
/// # Errors
/// Those of [`emit_wgsl`].
pub fn emit_wgsl_module(kernels: &[Kernel]) -> Result<String, Error> {
    if let [kernel] = kernels {
        return Ok(emit_wgsl(kernel)?.text);
    }
    let mut names = Names::default();
    let part = |kernel: &Kernel| {
        // Identifiers of WGSL may begin with one underscore, not two.
        let name = names.unique(snake(&kernel.name).trim_matches('_'));
        Part::of(kernel, &format!("{name}_"))
    };
    Ok(module(&kernels.iter().map(part).collect::<Result<Vec<_>, Error>>()?))
}

/// One kernel of a module.
struct Part {
    /// Its comments.
    comments: String,
    /// Its entry points.
    bodies: String,
    passes: Vec<ShaderPass>,
    layout: Layout,
}

impl Part {
    /// The parts of a kernel; `before` is the prefix of its entry points.
    fn of(kernel: &Kernel, before: &str) -> Result<Self, Error> {
        if let Some(law) = kernel.nodes.values().find_map(Node::integrated) {
            return Err(Error::Unplanned {
                question: kernel.name.clone(),
                reason: format!(
                    "WGSL has no function for the probability of an interval under `{}`: emit Rust, or use integers, whose \
                     probabilities are densities",
                    law.name()
                ),
            });
        }
        let schedule = Schedule::of(kernel);
        let layout = Layout::of(kernel, &schedule);
        let mut comments = Text::default();
        comments.line(format!("// {}: made from a Bayesian Program.", in_a_comment(&kernel.name)));
        for (id, axis) in kernel.axes.iter() {
            if let Term::Shape(place) = layout.extent(id) {
                let name = in_a_comment(&axis.name);
                comments.line(format!("// shape[{place}]: how many values `{name}` has"));
            }
        }
        kernel.buffers.ids().for_each(|id| describe(kernel, &layout, id, &mut comments));
        let (mut passes, mut bodies) = (Vec::new(), Text::default());
        for (number, group) in schedule.groups.iter().enumerate() {
            let entry = format!("{before}pass_{number}");
            let pass = ShaderPass { entry, axes: distributed(kernel, group) };
            Pass { kernel, layout: &layout, group, axes: &pass.axes }.write(&pass.entry, &mut bodies);
            passes.push(pass);
        }
        Ok(Self { comments: comments.finish(), bodies: bodies.finish(), passes, layout })
    }
}

/// The text of a module.
fn module(parts: &[Part]) -> String {
    let mut text = Text::default();
    parts.iter().for_each(|part| text.line(&part.comments));
    text.line("@group(0) @binding(0) var<storage, read_write> numbers: array<f32>;");
    text.line("@group(0) @binding(1) var<storage, read> positions: array<i32>;");
    text.line("@group(0) @binding(2) var<storage, read> shape: array<u32>;");
    let bodies: String = parts.iter().map(|part| part.bodies.as_str()).collect();
    text.line(functions::needed(&bodies));
    text.line(bodies);
    text.finish()
}

/// Documents the location of a buffer.
fn describe(kernel: &Kernel, layout: &Layout, id: BufferId, text: &mut Text) {
    let Place::Stored { first, strides } = layout.place(id) else { return };
    let buffer = &kernel.buffers[id];
    let (array, what) = match buffer.role {
        Role::Input { .. } => ("numbers", "given"),
        Role::Table { .. } => ("numbers", "a table"),
        Role::Positions(..) => ("positions", "given"),
        Role::Scratch => ("numbers", "made on the way"),
        Role::Output(_) => ("numbers", "the answer"),
    };
    let axes = buffer.axes.iter().zip(strides).map(|(axis, stride)| {
        let name = &kernel.axes[*axis].name;
        match stride {
            Term::Known(1) => format!("`{name}`"),
            stride => format!("{} `{name}`", stride.text()),
        }
    });
    let first = (*first != Term::Known(0) || buffer.axes.is_empty()).then(|| first.text());
    let place: Vec<String> = first.into_iter().chain(axes).collect();
    let line = format!("// {array}[{}]: `{}`, {what}{}", place.join(" + "), buffer.name, read_as(buffer));
    text.line(in_a_comment(&line));
}

/// Documents the encoding of an input with values of a variable: the caller converts them, as `exec::Inputs` does.
fn read_as(buffer: &Buffer) -> String {
    let Some(Values { variable, domain, numbers }) = &buffer.values else { return String::new() };
    let ordinal = match numbers {
        Numbers::Real => return String::new(),
        Numbers::Whole { first: 0, .. } => "which is".to_owned(),
        Numbers::Whole { first, .. } => format!("less {first}, where a value is"),
        Numbers::Bins(_) => "as the number of its bin, from 0, where it is".to_owned(),
    };
    format!(": a value of `{variable}`, {ordinal} {domain}")
}

/// The axes whose cells are distributed over invocations: those of the plate, or of the only result.
fn distributed(kernel: &Kernel, group: &Group) -> Vec<AxisId> {
    if group.parallel {
        return kernel.parallel.clone();
    }
    let nest = &kernel.nests[group.nests[0].nest];
    let scanned = |axis: &AxisId| matches!(&nest.reduce, Reduce::Scan { axis: own, .. } if own == axis);
    kernel.buffers[nest.out].axes.iter().copied().filter(|axis| !scanned(axis)).collect()
}

/// A pass under construction.
struct Pass<'k> {
    kernel: &'k Kernel,
    layout: &'k Layout,
    group: &'k Group,
    axes: &'k [AxisId],
}

impl Pass<'_> {
    fn extent(&self, axis: AxisId) -> String {
        self.layout.extent(axis).signed()
    }

    fn write(&self, entry: &str, text: &mut Text) {
        text.line(format!("@compute @workgroup_size({WORKGROUP})"));
        text.open(format!("fn {entry}(@builtin(global_invocation_id) id: vec3<u32>)"));
        text.line(format!("var cell = i32(id.x + id.y * {}u);", MOST_WORKGROUPS * WORKGROUP));
        for axis in self.axes.iter().rev() {
            let extent = self.extent(*axis);
            text.line(format!("let i{} = cell % {extent};\ncell = cell / {extent};", axis.position()));
        }
        text.open("if cell != 0");
        text.line("return;");
        text.close();
        for loops in &self.group.nests {
            let out = self.kernel.nests[loops.nest].out;
            if let Place::Private(count) = self.layout.place(out) {
                text.line(format!("var b{}: array<f32, {count}>;", out.position()));
            }
        }
        // The axes of the pass are fixed in an invocation.
        let cells = Cellwise { kernel: self.kernel, axes: self.axes, unrolls: true };
        let nests: Vec<Statement> =
            self.group.nests.iter().map(|nest| cells.nest(self.group, nest)).collect();
        validate(&nests, self.axes.iter().map(|axis| Of::Running(*axis).into()));
        Printer { kernel: self.kernel, layout: self.layout }.statements(&nests, text);
        text.close();
    }
}
