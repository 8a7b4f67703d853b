//! Kernels as WGSL: the text of a compute shader for WebGPU, in f32.
//!
//! In: a [`Kernel`]. Out: a [`Shader`]: one module, and an entry point for each pass of its schedule. Invariant: the same
//! nests and schedule as the other back ends read; an invocation makes one cell of a pass and reads only what earlier
//! passes have finished, or what it has made itself.
//!
//! All numbers, given and made, stand in one array, so that a kernel needs three bindings whatever it reads: `numbers`,
//! `positions` and `shape`. [`Layout`] says where in `shape` an extent, an offset or a stride is.
//! Language: W3C, *WebGPU Shading Language*, 2026.

mod functions;
mod value;

use super::text::Text;
use crate::ids::{AxisId, BufferId, Id};
use crate::kernel::schedule::{Group, Loops, Schedule};
use crate::kernel::{Fold, Kernel, Reduce, Role};

/// Invocations in a workgroup.
pub const WORKGROUP: u32 = 64;

/// Workgroups along the first direction of a dispatch, at most; the second direction takes the rest.
pub const MOST_WORKGROUPS: u32 = 65_535;

/// A kernel as a compute shader.
#[derive(Clone, PartialEq, Debug)]
pub struct Shader {
    /// The module.
    pub text: String,
    /// Its entry points, in the order in which they are dispatched.
    pub passes: Vec<ShaderPass>,
}

/// One entry point.
#[derive(Clone, PartialEq, Debug)]
pub struct ShaderPass {
    /// Its name.
    pub entry: String,
    /// The axes of its cells: an invocation for each.
    pub axes: Vec<AxisId>,
}

/// Where things are in `shape`, an array of `u32`: the bits of ∞, then the extents of the axes, then for each buffer where
/// it begins and how far apart neighbours along each of its axes are.
#[derive(Clone, PartialEq, Debug)]
pub struct Layout {
    axes: usize,
    buffers: Vec<usize>,
    /// How many numbers `shape` has.
    pub length: usize,
}

impl Layout {
    /// The layout of a kernel.
    pub fn of(kernel: &Kernel) -> Self {
        let mut length = 1 + kernel.axes.len();
        let place = |buffer: &crate::kernel::Buffer| {
            let place = length;
            length += 1 + buffer.axes.len();
            place
        };
        let buffers = kernel.buffers.values().map(place).collect();
        Self { axes: kernel.axes.len(), buffers, length }
    }

    /// Where the extent of an axis is.
    pub fn extent(&self, axis: AxisId) -> usize {
        assert!(axis.position() < self.axes, "internal: an axis of another kernel");
        1 + axis.position()
    }

    /// Where it says at which number a buffer begins; its strides follow.
    pub fn buffer(&self, buffer: BufferId) -> usize {
        self.buffers[buffer.position()]
    }
}

/// Writes a kernel as WGSL.
pub fn emit_wgsl(kernel: &Kernel) -> Shader {
    let schedule = Schedule::of(kernel);
    let layout = Layout::of(kernel);
    let mut text = Text::default();
    text.line(format!("// {}: made from a Bayesian Program.", kernel.name));
    for (id, buffer) in kernel.buffers.iter() {
        let axes: Vec<&str> = buffer.axes.iter().map(|axis| kernel.axes[*axis].name.as_str()).collect();
        let what = match buffer.role {
            Role::Input { .. } => "given",
            Role::Table(_) => "a table",
            Role::Positions => "positions",
            Role::Scratch => "made on the way",
            Role::Output => "the answer",
        };
        text.line(format!(
            "// shape[{}]: `{}` [{}], {what}",
            layout.buffer(id),
            buffer.name,
            axes.join("][")
        ));
    }
    text.line("@group(0) @binding(0) var<storage, read_write> numbers: array<f32>;");
    text.line("@group(0) @binding(1) var<storage, read> positions: array<i32>;");
    text.line("@group(0) @binding(2) var<storage, read> shape: array<u32>;");
    let mut passes = Vec::new();
    let mut bodies = Text::default();
    for (number, group) in schedule.groups.iter().enumerate() {
        let pass = ShaderPass { entry: format!("pass_{number}"), axes: distributed(kernel, group) };
        Pass { kernel, layout: &layout, group, axes: &pass.axes }.write(&pass.entry, &mut bodies);
        passes.push(pass);
    }
    let bodies = bodies.finish();
    text.line(functions::needed(&bodies));
    text.line(bodies);
    Shader { text: text.finish(), passes }
}

/// The axes of which each cell is an invocation: those of the plate, or of the one buffer that is made.
fn distributed(kernel: &Kernel, group: &Group) -> Vec<AxisId> {
    if group.parallel {
        return kernel.parallel.clone();
    }
    let nest = &kernel.nests[group.nests[0].nest];
    let scanned = |axis: &AxisId| matches!(&nest.reduce, Reduce::Scan { axis: own, .. } if own == axis);
    kernel.buffers[nest.out].axes.iter().copied().filter(|axis| !scanned(axis)).collect()
}

/// One pass in the making.
struct Pass<'k> {
    kernel: &'k Kernel,
    layout: &'k Layout,
    group: &'k Group,
    axes: &'k [AxisId],
}

impl Pass<'_> {
    fn extent(&self, axis: AxisId) -> String {
        match self.kernel.axes[axis].extent.known() {
            Some(known) => format!("{known}"),
            None => format!("i32(shape[{}])", self.layout.extent(axis)),
        }
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
            text.open("");
            self.nest(loops, 0, text);
            text.close();
        }
        text.close();
    }

    fn level(&self, loops: &Loops, depth: usize, text: &mut Text) {
        loops.levels[depth].iter().for_each(|value| self.value(*value, text));
    }

    fn nest(&self, loops: &Loops, depth: usize, text: &mut Text) {
        let nest = &self.kernel.nests[loops.nest];
        self.level(loops, depth, text);
        let (outer, last) = (loops.outer.len(), loops.outer.len() + loops.inner.len());
        if depth < outer {
            let axis = loops.outer[depth];
            // Axes of the pass run already.
            match self.axes.contains(&axis) {
                true => self.nest(loops, depth + 1, text),
                false => self.through(loops, axis, depth, text),
            }
            return;
        }
        let value = format!("v{}", nest.value.position());
        match &nest.reduce {
            Reduce::None => text.line(format!("{} = {value};", self.place(nest.out))),
            Reduce::Scan { axis, backward, keep, initial } => {
                text.line(format!("var state = v{};", initial.position()));
                let (extent, running) = (self.extent(*axis), axis.position());
                text.open(format!("for (var step = 0; step < {extent}; step++)"));
                text.line(match backward {
                    true => format!("let i{running} = {extent} - 1 - step;"),
                    false => format!("let i{running} = step;"),
                });
                self.level(loops, depth + 1, text);
                text.line(format!("{} = state;", self.place(nest.out)));
                text.line(format!("state = v{} * state + {value};", keep.position()));
                text.close();
            }
            Reduce::Fold(fold, _) => {
                if depth == outer {
                    let start = match fold {
                        Fold::Sum => "0.0",
                        Fold::Product => "1.0",
                        Fold::Maximum => "-infinity()",
                    };
                    text.line(format!("var folded = f32({start});"));
                }
                match depth < last {
                    true => self.through(loops, loops.inner[depth - outer], depth, text),
                    false => text.line(match fold {
                        Fold::Sum => format!("folded += {value};"),
                        Fold::Product => format!("folded *= {value};"),
                        Fold::Maximum => format!("folded = max(folded, {value});"),
                    }),
                }
                if depth == outer {
                    text.line(format!("{} = folded;", self.place(nest.out)));
                }
            }
        }
    }

    fn through(&self, loops: &Loops, axis: AxisId, depth: usize, text: &mut Text) {
        let running = axis.position();
        text.open(format!("for (var i{running} = 0; i{running} < {}; i{running}++)", self.extent(axis)));
        self.nest(loops, depth + 1, text);
        text.close();
    }

    /// The running cell of a buffer that is made.
    fn place(&self, out: BufferId) -> String {
        let axes = &self.kernel.buffers[out].axes;
        let running = axes.iter().map(|axis| format!("i{}", axis.position()));
        format!("numbers[{}]", self.offset(out, running))
    }

    /// An offset into the array of all numbers.
    fn offset(&self, buffer: BufferId, indices: impl Iterator<Item = String>) -> String {
        let begin = self.layout.buffer(buffer);
        let terms = indices
            .enumerate()
            .map(|(position, index)| format!(" + u32({index}) * shape[{}]", begin + 1 + position));
        format!("shape[{begin}]{}", terms.collect::<String>())
    }
}
