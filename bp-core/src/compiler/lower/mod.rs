//! Lowering: from the equation of a plan to the loops that compute it.
//!
//! In: a model and an exact route of a plan. Out: a [`Lowered`] kernel and the meaning of its outputs. Invariant: the
//! kernel computes exactly the terms of the plan; a sum of more than a handful of products becomes a nest; a value that
//! does not depend on the plate is a nest without the plate's axes and so is computed once.

mod asked;
mod bins;
mod choice;
mod density;
mod environment;
mod expression;
mod first_scan;
mod given;
mod law;
mod logarithm;
mod normal_bins;
mod over_time;
mod read_out;
mod table;
mod term;
mod validity;

pub use over_time::{NormalLowered, Phase, Step, lower_normal};
pub use read_out::{Lowered, Output};

use crate::equation::Exact;
use crate::error::Error;
use crate::ids::{AxisId, BufferId, ExpressionId, Id, SetId, ValueId, VariableId};
use crate::kernel::{
    Displacements, Extent, GridAxis, Index, InputKey, Kernel, KernelBuilder, Node, Role, Size, SizeKey,
    share_between_neighbours, with_tables, without_copies,
};
use crate::model::{Bound, Domain, IndexSpace, Model, ParameterKind, SetKind};
use std::collections::{BTreeSet, HashMap};

/// Lowers a route.
///
/// # Errors
/// A form or an expression that has no kernel.
pub fn lower(model: &Model, exact: &Exact, name: &str) -> Result<Lowered, Error> {
    lowered(Lowering::new(model, exact, name))
}

/// Lowers a route to a kernel with one more output where ln P(evidence) is not asked: the totals by which its answers
/// are divided ([`OutputKey::Total`](crate::kernel::OutputKey)), from which
/// [`Lanes::run_guarded`](crate::exec::Lanes::run_guarded) detects underflow in f64.
///
/// # Errors
/// As [`lower`].
pub fn lower_guarded(model: &Model, exact: &Exact, name: &str) -> Result<Lowered, Error> {
    let guarded = !exact.ln_evidence;
    lowered(Lowering { guarded, runs_anew: true, ..Lowering::new(model, exact, name) })
}

/// Lowers a route for printed Rust, which has [`again`](crate::answer::again): a few probabilities are multiplied
/// without logarithms, because a total below 2⁻⁵¹² (2⁻⁶⁴ in f32) is computed again with separate exponents.
///
/// # Errors
/// As [`lower`].
pub fn lower_printed(model: &Model, exact: &Exact, name: &str) -> Result<Lowered, Error> {
    let multiplies = exact.is_multiplied(model);
    lowered(Lowering { multiplies, takes_all: true, ..Lowering::new(model, exact, name) })
}

/// Lowers one instant of a filter, as [`lower_printed`], or, `guarded`, as [`lower_guarded`].
///
/// # Errors
/// As [`lower`].
pub fn lower_instant(step: &Step, exact: &Exact, name: &str, guarded: bool) -> Result<Lowered, Error> {
    let multiplies = exact.is_multiplied_at(&step.model) && !guarded;
    let (is_step, maximises) = (true, step.phase == Phase::Best);
    let own = Lowering::new(&step.model, exact, name);
    let mut made = lowered(Lowering { multiplies, is_step, maximises, runs_anew: guarded, ..own })?;
    made.kernel = with_tables(made.kernel);
    Ok(made)
}

fn lowered(mut lowering: Lowering<'_>) -> Result<Lowered, Error> {
    let outputs = lowering.read_out()?;
    if lowering.takes_all {
        lowering.take_all();
    }
    let kernel = share_between_neighbours(without_copies(lowering.finish()));
    Ok(Lowered { kernel: kernel.validated(), outputs })
}

/// The meaning of a variable in the loop under construction.
#[derive(Clone, Debug)]
enum Meaning {
    /// The ordinal of a value of a finite domain.
    Ordinal(ValueId),
    /// A real number.
    Real(ValueId),
    /// A cell of a grid.
    Cell([Index; 3]),
    /// The elements of a family of known length.
    Family(Vec<Meaning>),
}

struct Lowering<'m> {
    model: &'m Model,
    exact: &'m Exact,
    builder: KernelBuilder,
    plate: Vec<AxisId>,
    /// Loop variables.
    running: HashMap<VariableId, Meaning>,
    /// The values of Dirac variables while no loop begins or ends: chains of them are lowered once.
    determined: HashMap<VariableId, Meaning>,
    /// While an expression is lowered: its nodes so far.
    lowered: Option<HashMap<ExpressionId, ValueId>>,
    /// The indices of the surrounding `prod`s, outermost first.
    products: Vec<ValueId>,
    /// While a factor is lowered inside a scan: the value of its `first(…)`.
    first: Option<ValueId>,
    /// The axes on which each value depends, computed on demand.
    axes_of: Vec<BTreeSet<AxisId>>,
    /// The number of named nests.
    named: usize,
    /// Whether totals are an output.
    guarded: bool,
    /// Whether the kernel is run again with separate exponents where numbers underflow: it needs no logarithms then.
    runs_anew: bool,
    /// Whether every value that the question leaves open is an input, also where the answer does not depend on it.
    takes_all: bool,
    /// Whether the joint is multiplied without logarithms, because it is computed again where its total is too small.
    multiplies: bool,
    /// Whether it is one instant of a filter, where `flat` stands for an observation that is absent.
    is_step: bool,
    /// Whether variables that no ask searches are maximised, not summed.
    maximises: bool,
    /// The terms that multiply densities of reals, computed on demand.
    densities: Vec<bool>,
    /// The arrays of known numbers of each factor, by the name of the first.
    tables: HashMap<String, Vec<BufferId>>,
    /// The numbers of values of extents known at run time.
    counts: HashMap<Extent, ValueId>,
}

impl<'m> Lowering<'m> {
    fn new(model: &'m Model, exact: &'m Exact, name: &str) -> Self {
        let mut lowering = Self {
            model,
            exact,
            builder: KernelBuilder::new(name),
            plate: Vec::new(),
            running: HashMap::new(),
            determined: HashMap::new(),
            lowered: None,
            products: Vec::new(),
            first: None,
            axes_of: Vec::new(),
            named: 0,
            guarded: false,
            runs_anew: false,
            takes_all: false,
            multiplies: false,
            is_step: false,
            maximises: false,
            densities: Vec::new(),
            tables: HashMap::new(),
            counts: HashMap::new(),
        };
        if let Some(index) = model.plate_index() {
            lowering.plate = lowering.run_through(index);
        }
        lowering
    }

    fn unplanned(&self, reason: impl Into<String>) -> Error {
        Error::Unplanned { question: self.model.ask_text(&self.exact.asks[0]), reason: reason.into() }
    }

    /// Loops over the values of a searched variable. One that ranges over the plate's own set is distributed over the
    /// plate: its value is the plate's element.
    fn run_through_searched(&mut self, variable: VariableId) -> Vec<AxisId> {
        let Some(index) = self.own_plate(variable) else { return self.run_through(variable) };
        self.running.insert(variable, self.running[&index].clone());
        self.plate.clone()
    }

    /// The plate's index, where a variable ranges over the plate's own set.
    fn own_plate(&self, variable: VariableId) -> Option<VariableId> {
        let declared = &self.model.variables[variable];
        let plate = self.model.plate.filter(|plate| declared.domain == Domain::Set(plate.set))?;
        declared.family.is_none().then_some(plate.index)
    }

    /// Makes loops over the values of a variable; returns their axes.
    fn run_through(&mut self, variable: VariableId) -> Vec<AxisId> {
        let name = self.model.variable_name(variable);
        let declared = &self.model.variables[variable];
        let (meaning, axes) = match declared.family.map(|family| self.model.index_count(&family.over)) {
            None => self.values(&name, &declared.domain),
            Some(count) => {
                let count = count.expect("internal: a family of unknown length is not run through");
                let first = match declared.family.map(|family| family.over) {
                    Some(IndexSpace::Range(range)) => range.low,
                    _ => 0,
                };
                let element = |at: usize| self.model.element_name(variable, first + at as i64);
                let names: Vec<String> = (0..count).map(element).collect();
                let parts: Vec<_> = names.iter().map(|name| self.values(name, &declared.domain)).collect();
                let axes = parts.iter().flat_map(|(_, axes)| axes.clone()).collect();
                (Meaning::Family(parts.into_iter().map(|(meaning, _)| meaning).collect()), axes)
            }
        };
        self.run(variable, meaning);
        axes
    }

    /// Sets the meaning of a variable.
    fn run(&mut self, variable: VariableId, meaning: Meaning) {
        self.determined.clear();
        self.running.insert(variable, meaning);
    }

    /// Removes the meaning of a variable.
    fn stop(&mut self, variable: VariableId) {
        self.determined.clear();
        self.running.remove(&variable);
    }

    fn values(&mut self, name: &str, domain: &Domain) -> (Meaning, Vec<AxisId>) {
        if let Domain::Set(set) = domain
            && self.model.sets[*set].kind == SetKind::Grid
        {
            let axes: Vec<AxisId> = (GridAxis::ALL.into_iter())
                .map(|axis| {
                    let extent = Extent::sized(SizeKey::Grid(*set, axis));
                    self.builder.axis(&format!("{name}.{}", axis.name()), extent)
                })
                .collect();
            return (Meaning::Cell([0, 1, 2].map(|axis| Index::Axis(axes[axis]))), axes);
        }
        let axis = self.builder.axis(name, self.extent(domain));
        (Meaning::Ordinal(self.builder.running(axis)), vec![axis])
    }

    /// The number of values of a finite domain.
    fn extent(&self, domain: &Domain) -> Extent {
        match domain {
            Domain::Boolean => Extent::constant(2),
            Domain::Finite { labels, range: None } => Extent::constant(labels.len()),
            Domain::Finite { labels, range: Some(range) } => {
                self.bounded(range.high, (labels.len() as i64 + 1).saturating_sub(range.low))
            }
            Domain::Bins(bins) => Extent::constant(bins.count()),
            Domain::Set(set) => Extent::sized(SizeKey::Set(*set)),
            Domain::Real | Domain::Vector(_) => Extent::constant(1),
        }
    }

    fn bounded(&self, high: Bound, more: i64) -> Extent {
        Extent { size: high.size.map(SizeKey::Parameter), offset: high.offset.saturating_add(more) }
    }

    /// Axes for one index of a parameter or a family; those of the plate where it ranges over the plate's set.
    fn index_axes(&mut self, name: &str, over: &IndexSpace) -> Vec<AxisId> {
        match over {
            IndexSpace::Set(set) if self.model.plate.is_some_and(|plate| plate.set == *set) => {
                self.plate.clone()
            }
            IndexSpace::Set(set) => {
                vec![self.builder.axis(name, Extent::sized(SizeKey::Set(*set)))]
            }
            IndexSpace::Range(range) => {
                let extent = self.bounded(range.high, 1i64.saturating_sub(range.low));
                vec![self.builder.axis(name, extent)]
            }
        }
    }

    /// The axes on which a value depends.
    fn axes(&mut self, value: ValueId) -> BTreeSet<AxisId> {
        // Operands precede their uses.
        let kernel = self.builder.so_far();
        for position in self.axes_of.len()..=value.position() {
            let id = ValueId::new(position);
            let mut axes: BTreeSet<AxisId> = kernel.nodes[id].axes().into_iter().collect();
            for operand in kernel.operands(id) {
                axes.extend(&self.axes_of[operand.position()]);
            }
            self.axes_of.push(axes);
        }
        self.axes_of[value.position()].clone()
    }

    /// The axes of a value except some, those of the plate last.
    fn axes_but(&mut self, value: ValueId, but: &[AxisId]) -> Vec<AxisId> {
        let axes = self.axes(value);
        let serial = axes.iter().copied().filter(|axis| !but.contains(axis) && !self.plate.contains(axis));
        let plate = self.plate.iter().copied().filter(|axis| axes.contains(axis) && !but.contains(axis));
        let mut ordered: Vec<AxisId> = serial.chain(plate.clone()).collect();
        // A buffer with some of the plate's axes gets all of them, so that its blocks have the same layout.
        if plate.count() > 0 {
            ordered.retain(|axis| !self.plate.contains(axis));
            ordered.extend(self.plate.iter().copied().filter(|axis| !but.contains(axis)));
        }
        ordered
    }

    /// A name for an internal nest.
    fn name(&mut self, what: &str) -> String {
        self.named += 1;
        format!("{what} {}", self.named)
    }

    fn finish(mut self) -> Kernel {
        let kernel = self.builder.so_far();
        let independent = |axis: &AxisId| {
            let scanned = kernel.nests.iter().any(|nest| match &nest.reduce {
                crate::kernel::Reduce::Scan { axis: scanned, .. } => scanned == axis,
                _ => false,
            });
            !scanned && !kernel.nodes.values().any(|node| reaches_across(kernel, node, *axis))
        };
        // Parallel axes must be contiguous in every buffer: the last axes of the plate.
        let first = self.plate.iter().rposition(|axis| !independent(axis)).map_or(0, |position| position + 1);
        let parallel: Vec<AxisId> = self.plate[first..].to_vec();
        self.builder.parallel(&parallel);
        let kernel = self.builder.so_far();
        let size = |key: SizeKey| Size { key, name: self.size_name(key), default: self.size_default(key) };
        let sizes = kernel.size_keys().into_iter().map(size).collect();
        let set = |role: &Role| match role {
            Role::Positions(Displacements::Of(set) | Displacements::Steps(set), _)
            | Role::Input { key: InputKey::Wraps(set), .. } => Some(*set),
            _ => None,
        };
        let mut sets: Vec<SetId> = kernel.buffers.values().filter_map(|buffer| set(&buffer.role)).collect();
        sets.sort();
        sets.dedup();
        let sets = sets.into_iter().map(|set| (set, self.model.sets[set].name.clone())).collect();
        self.builder.named(sizes, sets);
        self.builder.build()
    }

    /// The host's name of a size.
    fn size_name(&self, key: SizeKey) -> String {
        match key {
            SizeKey::Set(set) => self.model.sets[set].name.clone(),
            SizeKey::Grid(set, axis) => format!("{}.{}", self.model.sets[set].name, axis.name()),
            SizeKey::Parameter(parameter) => self.model.parameters[parameter].name.clone(),
        }
    }

    fn size_default(&self, key: SizeKey) -> Option<usize> {
        let SizeKey::Parameter(parameter) = key else { return None };
        let declared = &self.model.parameters[parameter];
        let default = declared.default_number().filter(|_| declared.kind == ParameterKind::Size);
        default.map(|default| default as usize)
    }

    /// The host's name of an input.
    fn input_name(&self, key: &InputKey) -> String {
        match key {
            InputKey::Parameter(parameter) => self.model.parameters[*parameter].name.clone(),
            InputKey::Previous(of) => format!("previous {}", self.model.variable_name(*of)),
            InputKey::Law(place) => format!("law {place}"),
            InputKey::Value(_, name) | InputKey::Answer(name) => name.clone(),
            InputKey::Wraps(grid) => format!("{}.wraps", self.model.sets[*grid].name),
        }
    }

    /// An input, which is shared by all its uses.
    fn input(&mut self, key: InputKey, default: Option<f64>, axes: &[AxisId]) -> BufferId {
        let name = self.input_name(&key);
        self.builder.buffer(&name, Role::Input { key, default, broadcast: false }, axes)
    }
}

/// Whether a node reads a buffer that this kernel computes at another position along an axis.
fn reaches_across(kernel: &Kernel, node: &Node, axis: AxisId) -> bool {
    let Node::Load { buffer, indices, .. } = node else { return false };
    let buffer = &kernel.buffers[*buffer];
    buffer.role == Role::Scratch
        && (buffer.axes.iter().zip(indices)).any(|(own, index)| *own == axis && *index != Index::Axis(axis))
}
