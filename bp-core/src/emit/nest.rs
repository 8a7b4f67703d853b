//! The loops of one group of nests: blocks of lanes, all nests fused in one pass.
//!
//! In: a schedule's group. Out: its loops as text. Invariant: `u` are uniform numbers (f64), `t` the same as lanes
//! see them, `r` lanes that were fetched, `a` lanes that were computed at an outer depth, `x` one lane.

use super::names::local;
use super::question::room;
use super::text::Text;
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::schedule::{Group, Loops, Schedule};
use crate::kernel::{Fold, Index, Kernel, Node, Reduce};
use crate::operators::{Binary, Unary};

pub(super) struct Nests<'k> {
    kernel: &'k Kernel,
    schedule: &'k Schedule,
    group: &'k Group,
    /// Depth at which each value of the nest at hand is computed.
    depth: Vec<usize>,
}

impl<'k> Nests<'k> {
    pub(super) fn new(kernel: &'k Kernel, schedule: &'k Schedule, group: &'k Group) -> Self {
        Self { kernel, schedule, group, depth: vec![0; kernel.nodes.len()] }
    }

    /// A group that is done once.
    pub(super) fn serial(&mut self, text: &mut Text) {
        let group = self.group;
        for nest in &group.nests {
            room(self.kernel, self.kernel.nests[nest.nest].out, text);
            text.open("");
            self.nest(nest, &[], text);
            text.close();
            let name = local("m", self.kernel.nests[nest.nest].out);
            text.line(format!("let {name}: &[T] = &{name}[..];"));
        }
    }

    /// A group that runs over blocks of the plate.
    pub(super) fn blocks(&mut self, shared: &[BufferId], text: &mut Text) {
        let group = self.group;
        for nest in &group.nests {
            let out = self.kernel.nests[nest.nest].out;
            let cells: Vec<String> = self.serial_axes(out).iter().map(|axis| local("e", *axis)).collect();
            let cells = if cells.is_empty() { "1".to_owned() } else { cells.join(" * ") };
            if !shared.contains(&out) {
                text.line(format!("let mut {} = vec![T::ZERO; {cells} * LANES];", local("m", out)));
            }
        }
        for value in group.nests.iter().flat_map(|nest| nest.levels.iter().flatten()) {
            if self.is_fetched(*value) {
                text.line(format!("let mut b{} = [T::ZERO; LANES];", value.position()));
            }
        }
        let (lane, rows) = self.kernel.parallel.split_last().expect("internal: a parallel group has axes");
        let (row_range, span) = match rows.is_empty() {
            true => ("0..1", ("first".to_owned(), "first + count".to_owned())),
            false => ("first..first + count", ("0".to_owned(), local("e", *lane))),
        };
        text.open(format!("for row in {row_range}"));
        text.line("let mut rest = row;");
        for axis in rows.iter().rev() {
            text.line(format!("let i{0} = rest % e{0}; rest /= e{0};", axis.position()));
        }
        text.line(format!("let mut start: usize = {};", span.0));
        text.open(format!("while start < {}", span.1));
        text.line(format!("let width = LANES.min({} - start);", span.1));
        text.line(match rows.is_empty() {
            true => "let place = start - first;".to_owned(),
            false => format!("let place = (row - first) * {} + start;", local("e", *lane)),
        });
        for nest in &group.nests {
            text.open("");
            self.nest(nest, shared, text);
            text.close();
        }
        text.line("start += LANES;");
        text.close();
        text.close();
    }

    fn serial_axes(&self, buffer: BufferId) -> Vec<AxisId> {
        let parallel = |axis: &AxisId| self.group.parallel && self.kernel.parallel.contains(axis);
        self.kernel.buffers[buffer].axes.iter().copied().filter(|axis| !parallel(axis)).collect()
    }

    fn varies(&self, value: ValueId) -> bool {
        self.group.parallel && self.schedule.is_varying(value)
    }

    /// Loads whose lanes are contiguous, or the same: fetched before the loop over lanes.
    fn is_fetched(&self, value: ValueId) -> bool {
        match &self.kernel.nodes[value] {
            Node::Load { indices, .. } if self.varies(value) => {
                !indices.iter().any(|index| matches!(index, Index::At(at) if self.varies(*at)))
            }
            _ => false,
        }
    }

    fn nest(&mut self, loops: &Loops, shared: &[BufferId], text: &mut Text) {
        for (depth, level) in loops.levels.iter().enumerate() {
            level.iter().for_each(|value| self.depth[value.position()] = depth);
        }
        self.depth(loops, 0, shared, text);
    }

    fn depth(&mut self, loops: &Loops, depth: usize, shared: &[BufferId], text: &mut Text) {
        let nest = &self.kernel.nests[loops.nest];
        let (outer, last) = (loops.outer.len(), loops.outer.len() + loops.inner.len());
        let lanes = self.group.parallel;
        if let (Reduce::Scan { axis, backward, keep, initial }, true) = (&nest.reduce, depth == outer) {
            self.level(loops, depth, &[], text);
            match lanes {
                true => {
                    text.line("let mut state = [T::ZERO; LANES];");
                    text.line(format!(
                        "for l in 0..LANES {{ state[l] = {}; }}",
                        self.operand(*initial, usize::MAX)
                    ));
                }
                false => text.line(format!("let mut state = {};", self.operand(*initial, usize::MAX))),
            }
            text.open(format!("for step in 0..{}", local("e", *axis)));
            let running =
                if *backward { format!("{} - 1 - step", local("e", *axis)) } else { "step".to_owned() };
            text.line(format!("let i{} = {running};", axis.position()));
            let (target, copy) = self.target(nest.out, shared, text);
            let (keep, value) = (self.operand(*keep, depth + 1), self.operand(nest.value, depth + 1));
            match lanes {
                true => {
                    let update = [
                        format!("{target}[l] = state[l];"),
                        format!("state[l] = {keep} * state[l] + {value};"),
                    ];
                    self.level(loops, depth + 1, &update, text);
                    copy.iter().for_each(|copy| text.line(copy));
                }
                false => {
                    self.level(loops, depth + 1, &[], text);
                    text.line(format!("{target} = T::from_f64(state);"));
                    text.line(format!("state = {keep} * state + {value};"));
                }
            }
            text.close();
            return;
        }
        let mut actions = Vec::new();
        let mut after = Vec::new();
        if let (Some(fold), true) = (nest.reduce.fold(), depth == outer) {
            let start = match fold {
                Fold::Sum => "0.0f64",
                Fold::Product => "1.0f64",
                Fold::Maximum => "f64::NEG_INFINITY",
            };
            text.line(match lanes {
                true => format!("let mut folded = [T::from_f64({start}); LANES];"),
                false => format!("let mut folded = {start};"),
            });
        }
        if depth == last {
            let value = self.operand(nest.value, depth);
            match (nest.reduce.fold(), lanes) {
                (None, true) => {
                    let (target, copy) = self.target(nest.out, shared, text);
                    actions.push(format!("{target}[l] = {value};"));
                    after = copy;
                }
                (None, false) => {
                    let (target, _) = self.target(nest.out, shared, text);
                    after.push(format!("{target} = T::from_f64({value});"));
                }
                (Some(fold), true) => {
                    actions.push(match fold {
                        Fold::Sum => format!("folded[l] = folded[l] + {value};"),
                        Fold::Product => format!("folded[l] = folded[l] * {value};"),
                        Fold::Maximum => format!("folded[l] = Scalar::maximum(folded[l], {value});"),
                    });
                }
                (Some(fold), false) => after.push(match fold {
                    Fold::Sum => format!("folded += {value};"),
                    Fold::Product => format!("folded *= {value};"),
                    Fold::Maximum => format!("folded = f64::max(folded, {value});"),
                }),
            }
        }
        self.level(loops, depth, &actions, text);
        after.iter().for_each(|line| text.line(line));
        if depth < last {
            let axis = if depth < outer { loops.outer[depth] } else { loops.inner[depth - outer] };
            text.open(format!("for i{0} in 0..e{0}", axis.position()));
            self.depth(loops, depth + 1, shared, text);
            text.close();
        }
        if nest.reduce.fold().is_some() && depth == outer {
            let (target, copy) = self.target(nest.out, shared, text);
            match lanes {
                true => copy.iter().for_each(|copy| text.line(copy.replace("made", "folded"))),
                false => text.line(format!("{target} = T::from_f64(folded);")),
            }
        }
    }

    /// Where the running cell of a buffer is written, and what has to be done afterwards.
    fn target(&self, out: BufferId, shared: &[BufferId], text: &mut Text) -> (String, Vec<String>) {
        let mut plane: Vec<String> = Vec::new();
        let serial = self.serial_axes(out);
        for (position, axis) in serial.iter().enumerate() {
            let after: Vec<String> = serial[position + 1..].iter().map(|axis| local("e", *axis)).collect();
            let factor = if after.is_empty() { String::new() } else { format!(" * {}", after.join(" * ")) };
            plane.push(format!("i{}{factor}", axis.position()));
        }
        let plane = if plane.is_empty() { "0".to_owned() } else { plane.join(" + ") };
        if !self.group.parallel {
            return (format!("{}[{plane}]", local("m", out)), Vec::new());
        }
        match shared.iter().position(|other| *other == out) {
            None => {
                // Lanes are made on the stack, where nothing else can be, and then kept.
                let name = local("m", out);
                text.line("let mut made = [T::ZERO; LANES];");
                let copy = format!("{name}[({plane}) * LANES..][..LANES].copy_from_slice(&made);");
                ("made".to_owned(), vec![copy])
            }
            Some(number) => {
                text.line("let mut made = [T::ZERO; LANES];");
                let copy = format!(
                    "planes[{number}][{plane}][place..place + width].copy_from_slice(&made[..width]);"
                );
                ("made".to_owned(), vec![copy])
            }
        }
    }

    /// The values of one depth, and what is done with them lane by lane.
    fn level(&self, loops: &Loops, depth: usize, actions: &[String], text: &mut Text) {
        let values = &loops.levels[depth];
        for value in values.iter().filter(|value| !self.varies(**value)) {
            let expression = self.uniform(*value);
            text.line(format!("let u{}: f64 = {expression};", value.position()));
            if self.group.parallel {
                text.line(format!("let t{0}: T = T::from_f64(u{0});", value.position()));
            }
        }
        for value in values.iter().filter(|value| self.is_fetched(**value)) {
            self.fetch(*value, text);
        }
        let computed: Vec<ValueId> =
            values.iter().copied().filter(|value| self.varies(*value) && !self.is_fetched(*value)).collect();
        let merged: Vec<ValueId> = values
            .iter()
            .copied()
            .filter(|value| self.is_fetched(*value) && self.is_merged(*value))
            .collect();
        if computed.is_empty() && actions.is_empty() && merged.is_empty() {
            return;
        }
        let kept: Vec<ValueId> = computed
            .iter()
            .chain(&merged)
            .copied()
            .filter(|value| self.used_deeper(loops, *value, depth))
            .collect();
        for value in &kept {
            text.line(format!("let mut a{} = [T::ZERO; LANES];", value.position()));
        }
        text.open("for l in 0..LANES");
        let mut here: Vec<ValueId> = computed.iter().chain(&merged).copied().collect();
        here.sort();
        for value in here {
            text.line(format!("let x{}: T = {};", value.position(), self.lane(value, depth)));
            if kept.contains(&value) {
                text.line(format!("a{0}[l] = x{0};", value.position()));
            }
        }
        actions.iter().for_each(|action| text.line(action));
        text.close();
    }

    fn used_deeper(&self, loops: &Loops, value: ValueId, depth: usize) -> bool {
        let nest = &self.kernel.nests[loops.nest];
        let last = loops.outer.len() + loops.inner.len();
        let deeper = loops.levels[depth + 1..].iter().flatten();
        deeper.into_iter().any(|other| self.kernel.operands(*other).contains(&value))
            || (depth < last && crate::kernel::schedule::roots(&nest.reduce, nest.value).contains(&value))
            || matches!(&nest.reduce, Reduce::Scan { initial, .. } if *initial == value)
    }

    /// Fetched lanes that are replaced, where they lie outside, by other lanes.
    fn is_merged(&self, value: ValueId) -> bool {
        match &self.kernel.nodes[value] {
            Node::Load { otherwise: Some(otherwise), .. } => self.varies(*otherwise),
            _ => false,
        }
    }

    /// A value as an operand at a depth; `usize::MAX`: after the loop over lanes of its own depth.
    fn operand(&self, value: ValueId, depth: usize) -> String {
        let position = value.position();
        if !self.varies(value) {
            return if self.group.parallel { format!("t{position}") } else { format!("u{position}") };
        }
        if self.is_fetched(value) && !self.is_merged(value) {
            return format!("r{position}[l]");
        }
        if self.depth[position] == depth { format!("x{position}") } else { format!("a{position}[l]") }
    }

    /// The running value of an axis, as usize; for the lanes' axis, of the first lane.
    fn running(&self, axis: AxisId) -> String {
        let lane = self.group.parallel && self.kernel.parallel.last() == Some(&axis);
        if lane { "start".to_owned() } else { format!("i{}", axis.position()) }
    }

    fn uniform(&self, value: ValueId) -> String {
        let u = |value: &ValueId| format!("u{}", value.position());
        match &self.kernel.nodes[value] {
            Node::Constant(bits) => constant(f64::from_bits(*bits)),
            Node::Axis(axis) => format!("{} as f64", self.running(*axis)),
            Node::Unary(operator, operand) => match operator {
                Unary::Not => format!("1.0 - {}", u(operand)),
                Unary::Negate => format!("-{}", u(operand)),
                operator => format!("<f64 as Scalar>::{}({})", function(*operator), u(operand)),
            },
            Node::Binary(operator, left, right) => arithmetic(*operator, &u(left), &u(right), "f64", "0.0"),
            Node::Select(condition, then, otherwise) => {
                format!("if {} != 0.0 {{ {} }} else {{ {} }}", u(condition), u(then), u(otherwise))
            }
            Node::Load { buffer, indices, otherwise } => {
                let (inside, offset) = self.offset(*buffer, indices, false);
                let cell = match self.kernel.buffers[*buffer].role {
                    crate::kernel::Role::Positions => format!("f64::from({}[{offset}])", local("m", *buffer)),
                    _ => format!("{}[{offset}].to_f64()", local("m", *buffer)),
                };
                match otherwise {
                    Some(otherwise) => format!("if {inside} {{ {cell} }} else {{ {} }}", u(otherwise)),
                    None => cell,
                }
            }
        }
    }

    /// Whether all uniform indices are inside, and the offset that they give.
    fn offset(&self, buffer: BufferId, indices: &[Index], skip_lane: bool) -> (String, String) {
        let own = self.group.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == buffer);
        let axes = &self.kernel.buffers[buffer].axes;
        let lane = self.kernel.parallel.last().filter(|_| self.group.parallel);
        let (mut inside, mut terms) = (Vec::new(), Vec::new());
        for (position, (index, axis)) in indices.iter().zip(axes).enumerate() {
            let parallel = self.group.parallel && self.kernel.parallel.contains(axis);
            if own && parallel {
                continue;
            }
            let stride = match own {
                false => format!("q{}_{position}", buffer.position()),
                true => {
                    let after = axes[position + 1..]
                        .iter()
                        .filter(|axis| !(self.group.parallel && self.kernel.parallel.contains(axis)));
                    let factors: Vec<String> = after.map(|axis| local("e", *axis)).collect();
                    if factors.is_empty() { "1".to_owned() } else { factors.join(" * ") }
                }
            };
            match index {
                Index::Axis(axis) if skip_lane && Some(axis) == lane => {}
                Index::Axis(axis) => terms.push(format!("{} * ({stride})", self.running(*axis))),
                Index::At(at) => {
                    let at = format!("u{}", at.position());
                    inside.push(format!("{at} >= 0.0 && {at} < {} as f64", local("e", *axis)));
                    terms.push(format!("({at} as usize) * ({stride})"));
                }
                Index::Turned { axis: turned, by, wraps } if !skip_lane => {
                    let (turned, extent) = (self.running(*turned), local("e", *axis));
                    let at = format!(
                        "turn({turned} as isize + u{} as isize, {extent}, u{} != 0.0)",
                        by.position(),
                        wraps.position()
                    );
                    inside.push(format!("{at} >= 0 && {at} < {extent} as isize"));
                    terms.push(format!("({at} as usize) * ({stride})"));
                }
                Index::Turned { .. } => {}
            }
        }
        let join = |parts: Vec<String>, empty: &str, by: &str| {
            if parts.is_empty() { empty.to_owned() } else { parts.join(by) }
        };
        let mut offset = join(terms, "0", " + ");
        if own && self.group.parallel {
            offset = format!("({offset}) * LANES");
        }
        (join(inside, "true", " && "), offset)
    }

    fn fetch(&self, value: ValueId, text: &mut Text) {
        let Node::Load { buffer, indices, otherwise } = &self.kernel.nodes[value] else {
            unreachable!("internal: only loads are fetched")
        };
        let (id, source) = (value.position(), local("m", *buffer));
        let (inside, offset) = self.offset(*buffer, indices, true);
        let own = self.group.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == *buffer);
        let broadcast =
            matches!(self.kernel.buffers[*buffer].role, crate::kernel::Role::Input { broadcast: true, .. });
        let lane = self.kernel.parallel.last().copied();
        let along =
            indices.iter().zip(&self.kernel.buffers[*buffer].axes).find_map(|(index, axis)| match index {
                Index::Axis(running) if Some(*running) == lane => Some((None, *axis)),
                Index::Turned { axis: running, by, wraps } if Some(*running) == lane => {
                    Some((Some((by, wraps)), *axis))
                }
                _ => None,
            });
        let fill = match otherwise {
            Some(otherwise) if !self.varies(*otherwise) => format!("t{}", otherwise.position()),
            _ => "T::ZERO".to_owned(),
        };
        let fetched = match along {
            _ if own => format!("{source}[{offset}..].first_chunk::<LANES>().expect(\"internal: room\")"),
            Some((Some((by, wraps)), axis)) => {
                text.line(format!("let from{id}: isize = start as isize + u{} as isize;", by.position()));
                format!(
                    "fetch_turned(&mut b{id}, {source}, {offset}, from{id}, {}, u{} != 0.0, width, {fill})",
                    local("e", axis),
                    wraps.position()
                )
            }
            Some((None, _)) if broadcast => format!(
                "if g{0} == 1 {{ fetch(&mut b{id}, {source}, {offset} + start, width) }} else {{ splat(&mut b{id}, {source}[{offset}]) }}",
                buffer.position()
            ),
            Some((None, _)) => format!("fetch(&mut b{id}, {source}, {offset} + start, width)"),
            None => format!("splat(&mut b{id}, {source}[{offset}])"),
        };
        match (otherwise, inside.as_str()) {
            (None, _) | (_, "true") => text.line(format!("let r{id}: &[T; LANES] = {fetched};")),
            _ => {
                text.line(format!("let inside{id}: bool = {inside};"));
                text.line(format!("let r{id}: &[T; LANES] = if inside{id} {{ {fetched} }} else {{ splat(&mut b{id}, {fill}) }};"));
            }
        }
        if self.is_merged(value) && inside == "true" {
            text.line(format!("let inside{id}: bool = true;"));
        }
    }

    /// One lane of a value.
    fn lane(&self, value: ValueId, depth: usize) -> String {
        let x = |value: &ValueId| self.operand(*value, depth);
        match &self.kernel.nodes[value] {
            Node::Constant(bits) => format!("T::from_f64({})", constant(f64::from_bits(*bits))),
            Node::Axis(_) => "T::from_f64((start + l) as f64)".to_owned(),
            Node::Unary(operator, operand) => match operator {
                Unary::Not => format!("T::ONE - {}", x(operand)),
                Unary::Negate => format!("-{}", x(operand)),
                operator => format!("Scalar::{}({})", function(*operator), x(operand)),
            },
            Node::Binary(operator, left, right) => arithmetic(*operator, &x(left), &x(right), "T", "T::ZERO"),
            Node::Select(condition, then, otherwise) => {
                format!("if {} != T::ZERO {{ {} }} else {{ {} }}", x(condition), x(then), x(otherwise))
            }
            Node::Load { buffer, indices, otherwise } if self.is_fetched(value) => {
                let id = value.position();
                let otherwise = otherwise.as_ref().map_or_else(|| "T::ZERO".to_owned(), x);
                let lane = self.kernel.parallel.last().copied();
                let turned =
                    indices.iter().zip(&self.kernel.buffers[*buffer].axes).find_map(|(index, axis)| {
                        match index {
                            Index::Turned { axis: running, wraps, .. } if Some(*running) == lane => {
                                Some((wraps, axis))
                            }
                            _ => None,
                        }
                    });
                let within = turned.map_or_else(String::new, |(wraps, axis)| {
                    format!(
                        " && (u{} != 0.0 || (from{id} + l as isize >= 0 && from{id} + (l as isize) < {} as isize))",
                        wraps.position(),
                        local("e", *axis)
                    )
                });
                format!("if inside{id}{within} {{ r{id}[l] }} else {{ {otherwise} }}")
            }
            Node::Load { buffer, indices, otherwise } => self.gather(*buffer, indices, *otherwise, depth),
        }
    }

    /// A load whose index differs from lane to lane.
    fn gather(
        &self,
        buffer: BufferId,
        indices: &[Index],
        otherwise: Option<ValueId>,
        depth: usize,
    ) -> String {
        let own = self.group.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == buffer);
        let axes = &self.kernel.buffers[buffer].axes;
        let lane = self.kernel.parallel.last().copied();
        let (mut inside, mut terms) = (vec!["true".to_owned()], vec!["0".to_owned()]);
        for (position, (index, axis)) in indices.iter().zip(axes).enumerate() {
            if own && self.kernel.parallel.contains(axis) {
                continue;
            }
            let stride = match own {
                false => format!("q{}_{position}", buffer.position()),
                true => {
                    let after =
                        axes[position + 1..].iter().filter(|axis| !self.kernel.parallel.contains(axis));
                    let factors: Vec<String> = after.map(|axis| local("e", *axis)).collect();
                    if factors.is_empty() { "1".to_owned() } else { factors.join(" * ") }
                }
            };
            match index {
                Index::Axis(running) if Some(*running) == lane => {
                    terms.push(format!("(start + l.min(width - 1)) * ({stride})"))
                }
                Index::Axis(running) => terms.push(format!("i{} * ({stride})", running.position())),
                Index::At(at) => {
                    let at = format!("{}.to_f64()", self.operand(*at, depth));
                    inside.push(format!("{at} >= 0.0 && {at} < {} as f64", local("e", *axis)));
                    terms.push(format!("({at} as usize) * ({stride})"));
                }
                Index::Turned { axis: running, by, wraps } => {
                    let first = if Some(*running) == lane {
                        "start + l.min(width - 1)".to_owned()
                    } else {
                        format!("i{}", running.position())
                    };
                    let at = format!(
                        "turn(({first}) as isize + u{} as isize, {}, u{} != 0.0)",
                        by.position(),
                        local("e", *axis),
                        wraps.position()
                    );
                    inside.push(format!("{at} >= 0 && {at} < {} as isize", local("e", *axis)));
                    terms.push(format!("({at} as usize) * ({stride})"));
                }
            }
        }
        let mut offset = terms.join(" + ");
        if own {
            offset = format!("({offset}) * LANES + l");
        }
        let otherwise = otherwise.map_or_else(|| "T::ZERO".to_owned(), |value| self.operand(value, depth));
        let cell = match self.kernel.buffers[buffer].role {
            crate::kernel::Role::Positions => {
                format!("T::from_f64(f64::from({}[{offset}]))", local("m", buffer))
            }
            _ => format!("{}[{offset}]", local("m", buffer)),
        };
        format!("if {} {{ {cell} }} else {{ {otherwise} }}", inside.join(" && "))
    }
}

fn constant(number: f64) -> String {
    if number.is_finite() {
        format!("{number:?}f64")
    } else if number.is_nan() {
        "f64::NAN".to_owned()
    } else {
        format!("{}f64::INFINITY", if number < 0.0 { "-" } else { "" })
    }
}

fn function(operator: Unary) -> &'static str {
    match operator {
        Unary::Absolute => "absolute",
        Unary::Exponential => "exponential",
        Unary::NaturalLogarithm => "natural_logarithm",
        Unary::SquareRoot => "square_root",
        Unary::Floor => "round_down",
        Unary::NormalCumulative => "normal_cumulative",
        Unary::Negate | Unary::Not => unreachable!("internal: written as operators"),
    }
}

fn arithmetic(operator: Binary, left: &str, right: &str, kind: &str, zero: &str) -> String {
    let truth = |condition: String| format!("<{kind} as Scalar>::truth({condition})");
    match operator {
        Binary::Add | Binary::Subtract | Binary::Multiply | Binary::Divide => {
            format!("{left} {} {right}", operator.notation().1)
        }
        Binary::Minimum => format!("Scalar::minimum({left}, {right})"),
        Binary::Maximum => format!("Scalar::maximum({left}, {right})"),
        Binary::And => truth(format!("{left} != {zero} && {right} != {zero}")),
        Binary::Or => truth(format!("{left} != {zero} || {right} != {zero}")),
        _ => truth(format!("{left} {} {right}", operator.notation().1)),
    }
}
