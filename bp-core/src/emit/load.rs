//! Loads in emitted code: offsets, contiguous lanes, and gathers.
//!
//! In: a load. Out: its text. Invariant: indices that may be out of range are checked before use; loads that are
//! contiguous along the lanes are slices of the array.

use super::names::local;
use super::nest::Nests;
use super::text::Text;
use crate::ids::{BufferId, Id, ValueId};
use crate::kernel::{Index, Node, Role};

impl Nests<'_> {
    /// A uniform value as a whole number.
    fn whole(&self, value: ValueId) -> String {
        let id = value.position();
        if self.is_whole(value) { format!("z{id}") } else { format!("u{id} as isize") }
    }

    /// Whether all uniform indices are in range, and their offset.
    pub(super) fn offset(&self, buffer: BufferId, indices: &[Index], skip_lane: bool) -> (String, String) {
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
                Index::At(at) if self.is_whole(*at) => {
                    let at = format!("z{}", at.position());
                    inside.push(format!("{at} >= 0 && {at} < {} as isize", local("e", *axis)));
                    terms.push(format!("({at} as usize) * ({stride})"));
                }
                Index::At(at) => {
                    let at = format!("u{}", at.position());
                    inside.push(format!("{at} >= 0.0 && {at} < {} as f64", local("e", *axis)));
                    terms.push(format!("({at} as usize) * ({stride})"));
                }
                Index::Turned { axis: turned, by, wraps } if !skip_lane => {
                    let (turned, extent) = (self.running(*turned), local("e", *axis));
                    let at = format!(
                        "turn({turned} as isize + {}, {extent}, u{} != 0.0)",
                        self.whole(*by),
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

    /// The array of the lanes, as a slice of numbers.
    pub(super) fn source(&self, buffer: BufferId) -> String {
        match self.kernel.buffers[buffer].role {
            // One cell for all lanes: it is copied.
            Role::Positions(..) | Role::Table { .. } => "&[]".to_owned(),
            _ => format!("&{}[..]", local("m", buffer)),
        }
    }

    /// The location of the lanes of a load; loads that are not contiguous are copied, from `slot` of its copies on.
    pub(super) fn fetch(&self, value: ValueId, slot: &str, grain: &str, text: &mut Text) {
        let Node::Load { buffer, indices, otherwise } = &self.kernel.nodes[value] else {
            unreachable!("internal: only loads are fetched")
        };
        let (id, source) = (value.position(), local("m", *buffer));
        let (inside, offset) = self.offset(*buffer, indices, true);
        let own = self.group.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == *buffer);
        let broadcast = matches!(self.kernel.buffers[*buffer].role, Role::Input { broadcast: true, .. });
        let lane = self.kernel.parallel.last().copied();
        let along =
            indices.iter().zip(&self.kernel.buffers[*buffer].axes).find_map(|(index, axis)| match index {
                Index::Axis(running) if Some(*running) == lane => Some((None, *axis)),
                Index::Turned { axis: running, by, wraps } if Some(*running) == lane => {
                    Some((Some((by, wraps)), *axis))
                }
                _ => None,
            });
        let others = self.other_lanes(value).map(|(other, buffer)| {
            let other = other.position();
            format!("&p{other}.of({}, &b{other}[..])[..width]", self.source(buffer))
        });
        let fill = match (otherwise, &others) {
            (_, Some(others)) => others.clone(),
            (Some(otherwise), _) if !self.varies(*otherwise) => format!("&[t{}]", otherwise.position()),
            _ => "&[T::ZERO]".to_owned(),
        };
        let fetched = match along {
            _ if own => format!("Place::at({offset})"),
            Some((Some((by, wraps)), axis)) => {
                text.line(format!("let from{id}: isize = start as isize + {};", self.whole(*by)));
                format!(
                    "fetch_turned(&mut b{id}[..], {slot}, {source}, {offset}, from{id}, {}, u{} != 0.0, width, {fill}, {grain})",
                    local("e", axis),
                    wraps.position()
                )
            }
            Some((None, _)) if broadcast => format!(
                "if g{0} == 1 {{ fetch(&mut b{id}[..], {slot}, {source}, {offset} + start, width) }} else {{ splat(&mut b{id}[..], {slot}, {source}[{offset}], width) }}",
                buffer.position()
            ),
            Some((None, _)) => format!("fetch(&mut b{id}[..], {slot}, {source}, {offset} + start, width)"),
            None => format!("splat(&mut b{id}[..], {slot}, {}, width)", self.cell(*buffer, &offset)),
        };
        match (otherwise, inside.as_str()) {
            (None, _) | (_, "true") => text.line(format!("let p{id}: Place = {fetched};")),
            _ => {
                text.line(format!("let inside{id}: bool = {inside};"));
                text.line(format!("let p{id}: Place = if inside{id} {{ {fetched} }} else {{ fill(&mut b{id}[..], {slot}, {fill}, width) }};"));
            }
        }
        if self.is_merged(value) && inside == "true" {
            text.line(format!("let inside{id}: bool = true;"));
        }
    }

    /// Fetched lanes that are replaced, where they are out of range, by computed lanes.
    pub(super) fn is_merged(&self, value: ValueId) -> bool {
        match &self.kernel.nodes[value] {
            Node::Load { otherwise: Some(otherwise), .. } => {
                self.varies(*otherwise) && self.other_lanes(value).is_none()
            }
            _ => false,
        }
    }

    /// The lanes that replace fetched lanes out of range, if these are fetched too.
    pub(super) fn other_lanes(&self, value: ValueId) -> Option<(ValueId, BufferId)> {
        let Node::Load { otherwise: Some(otherwise), .. } = &self.kernel.nodes[value] else { return None };
        match &self.kernel.nodes[*otherwise] {
            Node::Load { buffer, otherwise: None, indices } if self.is_fetched(*otherwise) => {
                let own = self.group.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == *buffer);
                // Lanes that wrap around may be in more than one piece.
                let whole = !indices.iter().any(|index| matches!(index, Index::Turned { .. }));
                (!own && whole).then_some((*otherwise, *buffer))
            }
            _ => None,
        }
    }

    /// One cell of a buffer, as a number of the lanes.
    fn cell(&self, buffer: BufferId, offset: &str) -> String {
        let source = local("m", buffer);
        match self.kernel.buffers[buffer].role {
            Role::Positions(..) => format!("T::from_f64(f64::from({source}[{offset}]))"),
            Role::Table { .. } => format!("T::from_f64({source}[{offset}])"),
            _ => format!("{source}[{offset}]"),
        }
    }

    /// A load whose index differs from lane to lane.
    pub(super) fn gather(
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
                        "turn(({first}) as isize + {}, {}, u{} != 0.0)",
                        self.whole(*by),
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
        let cell = self.cell(buffer, &offset);
        format!("if {} {{ {cell} }} else {{ {otherwise} }}", inside.join(" && "))
    }
}
