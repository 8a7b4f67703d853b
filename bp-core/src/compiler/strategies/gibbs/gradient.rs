//! The density of a block of reals with its gradient, in coordinates without bounds.
//!
//! In: the sites of a chain and the nodes that depend on them. Out: [`Gradient`]: ln of the density at any point of these coordinates,
//! and its derivatives. Invariant: x = eᵘ where the form allows positive numbers only, x = a + (b − a) / (1 + e⁻ᵘ) between two bounds,
//! and x = m + s z where the form has a scale s that is drawn too (not centred: Papaspiliopoulos, Roberts and Sköld, *Statistical
//! Science* 22:59-73, 2007). The density is that of the coordinates.

use super::blanket::{Blankets, Node, Site};
use super::compiled::Terms;
use crate::distribution::{Assigned, Cells, Instance, Setting, scale_of};
use crate::ids::{ExpressionId, Id};
use crate::law::{Law, Support};
use crate::model::Form;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// How a real is written without bounds.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Scale {
    Linear,
    Logarithmic,
    /// Between a bound and the bound so far above it.
    Logistic([f64; 2]),
    /// By z, in this slot beyond those of the program: x = m + s z.
    Standard(usize),
}

impl Scale {
    /// The scale of a left-hand side; `None` where it has no density on an interval that is known beforehand.
    fn of(setting: &Setting<'_>, instance: &Instance) -> Option<Self> {
        let known = |id: &ExpressionId| {
            let is_known = setting.slots_read(*id, &instance.indices).is_empty();
            is_known.then(|| setting.expression(*id, instance, &[]))
        };
        match setting.form_at(instance) {
            Form::Flat => Some(Scale::Linear),
            Form::HalfFlat => Some(Scale::Logarithmic),
            Form::Law { law: Law::Uniform, arguments } => {
                let bounds = arguments.iter().map(known).collect::<Option<Vec<f64>>>()?;
                Some(Scale::Logistic([bounds[0], bounds[1] - bounds[0]]))
            }
            Form::Law { law, .. } => match law.support() {
                Support::Reals => Some(Scale::Linear),
                Support::Positive => Some(Scale::Logarithmic),
                Support::UnitInterval => Some(Scale::Logistic([0.0, 1.0])),
                Support::Counts => None,
            },
            _ => None,
        }
    }

    /// The coordinate of a number; of a standardised one, of z.
    fn coordinate(self, x: f64) -> f64 {
        match self {
            Scale::Linear | Scale::Standard(_) => x,
            Scale::Logarithmic => x.ln(),
            Scale::Logistic([low, width]) => {
                let share = (x - low) / width;
                share.ln() - (-share).ln_1p()
            }
        }
    }

    /// The number at a coordinate, its derivative, ln of this, and the derivative of the latter.
    fn number(self, u: f64) -> [f64; 4] {
        match self {
            Scale::Linear | Scale::Standard(_) => [u, 1.0, 0.0, 0.0],
            Scale::Logarithmic => [u.exp(), u.exp(), u, 1.0],
            Scale::Logistic([low, width]) => {
                let small = (-u.abs()).exp();
                let (near, far) = (small / (1.0 + small), 1.0 / (1.0 + small));
                let share = if u < 0.0 { near } else { far };
                let ln = width.ln() - u.abs() - 2.0 * small.ln_1p();
                [low + width * share, width * near * far, ln, 1.0 - 2.0 * share]
            }
        }
    }
}

/// Left-hand sides that are computed together: a group, and places in it that do not depend on each other.
type Batch = (usize, Vec<u32>);

/// The density of a block.
#[derive(Debug)]
pub(super) struct Gradient {
    /// The numbers of its sites.
    pub(super) sites: Vec<usize>,
    /// The slots of the block, and how they are written.
    coordinates: Vec<(usize, Scale)>,
    /// For each slot that is standardised that of z.
    standard: HashMap<usize, usize>,
    /// The slots of the program.
    slots: usize,
    /// What is computed from others, parents first.
    batches: Vec<Batch>,
    groups: Vec<Assigned>,
    terms: Terms,
}

/// A state with room for z, and memory for the gradient.
#[derive(Clone, Debug, Default)]
pub(super) struct Slopes {
    state: Vec<f64>,
    cells: Cells,
    found: Vec<f64>,
    by_slot: Vec<f64>,
}

/// How a site is written without bounds; `None` where the density has no gradient in it.
fn coordinate(blankets: &Blankets<'_>, site: &Site) -> Option<(usize, Scale)> {
    let Node::Weighed(own) = &blankets.nodes[*site.blanket.first()?] else { return None };
    let is_own = own.left.as_slice() == [site.slot] && site.count.is_none();
    let is_alone = !site.moves_rest && site.clumps.is_empty();
    Some((site.slot, Scale::of(blankets.setting, own).filter(|_| is_own && is_alone)?))
}

/// The blocks of sites that are drawn along gradients: those that depend on each other, at least two.
pub(super) fn gradients(blankets: &Blankets<'_>) -> Vec<Gradient> {
    let sites = &blankets.sites;
    let mut rest: Vec<usize> =
        (0..sites.len()).filter(|number| coordinate(blankets, &sites[*number]).is_some()).collect();
    let mut found = Vec::new();
    while let Some(first) = rest.pop() {
        let mut own = vec![first];
        let mut nodes: BTreeSet<usize> = sites[first].blanket.iter().copied().collect();
        let mut more = true;
        while more {
            let before = own.len();
            rest.retain(|number| {
                let shares = sites[*number].blanket.iter().any(|node| nodes.contains(node));
                if shares {
                    own.push(*number);
                    nodes.extend(&sites[*number].blanket);
                }
                !shares
            });
            more = own.len() > before;
        }
        if own.len() > 1 && own.iter().any(|number| !sites[*number].is_normal) {
            own.sort_unstable();
            found.extend(Gradient::new(blankets, own, &nodes));
        }
    }
    found
}

/// Batches of instances, and the instances of each group.
#[derive(Default)]
struct Batches<'i> {
    batches: Vec<Batch>,
    groups: Vec<Vec<&'i Instance>>,
    numbers: BTreeMap<(usize, usize, usize), usize>,
    /// The left-hand sides of the last batch.
    together: Vec<usize>,
}

impl<'i> Batches<'i> {
    fn push(&mut self, setting: &Setting<'_>, instance: &'i Instance) {
        let form = std::ptr::from_ref(setting.form_at(instance)).addr();
        let next = self.groups.len();
        let group =
            *self.numbers.entry((instance.factor.position(), instance.component, form)).or_insert(next);
        if group == next {
            self.groups.push(Vec::new());
        }
        let row = self.groups[group].len() as u32;
        let reads = setting.reads(instance);
        match self.batches.last_mut() {
            Some((last, rows))
                if *last == group && !self.together.iter().any(|slot| reads.contains(slot)) =>
            {
                rows.push(row);
            }
            _ => {
                self.batches.push((group, vec![row]));
                self.together.clear();
            }
        }
        self.together.extend(&instance.left);
        self.groups[group].push(instance);
    }
}

impl Gradient {
    /// The density of a block of sites, on which these nodes depend; `None` where a node has no derivatives.
    fn new(blankets: &Blankets<'_>, sites: Vec<usize>, nodes: &BTreeSet<usize>) -> Option<Self> {
        let setting = blankets.setting;
        let of = |number: &usize| coordinate(blankets, &blankets.sites[*number]);
        let mut coordinates = sites.iter().map(of).collect::<Option<Vec<_>>>()?;
        let fixed = |slot: usize| Some(blankets.observations.values[slot]).filter(|value| !value.is_nan());
        let is_standardised = |instance: &Instance| {
            let scale = scale_of(setting.form_at(instance));
            let reads = |id: ExpressionId| setting.slots_read(id, &instance.indices);
            scale.is_some_and(|scale| reads(scale).iter().any(|slot| fixed(*slot).is_none()))
        };
        let mut standard = HashMap::new();
        for (slot, scale) in &mut coordinates {
            let own = nodes.iter().find_map(|node| match &blankets.nodes[*node] {
                Node::Weighed(instance) if instance.left.contains(slot) => Some((node, instance)),
                _ => None,
            });
            if let Some((node, _)) = own.filter(|(_, instance)| is_standardised(instance)) {
                let place = setting.slots() + standard.len();
                *scale = Scale::Standard(place);
                standard.insert(*slot, (place, *node));
            }
        }
        let left_out: BTreeSet<usize> = standard.values().map(|(_, node)| *node).collect();
        let terms: Vec<usize> = nodes.difference(&left_out).copied().collect();
        let terms = blankets.compiled.terms(&terms);
        let is_plain: BTreeSet<usize> = terms.plain.iter().copied().collect();
        // Flat variables have no factor, since their scales observe the bound; predicates have slope 0.
        let (mut plain, mut batches) = (Vec::new(), Batches::default());
        for node in nodes {
            match &blankets.nodes[*node] {
                Node::Weighed(instance) if left_out.contains(node) => batches.push(setting, instance),
                Node::Determined(instance) => batches.push(setting, instance),
                _ if !is_plain.contains(node) => {}
                Node::Weighed(instance) if blankets.is_flat(instance) => {}
                Node::Weighed(instance)
                    if setting.form_at(instance).has_point()
                        && instance.left.iter().all(|slot| fixed(*slot).is_some()) =>
                {
                    plain.push(*node);
                }
                _ => return None,
            }
        }
        let standard: HashMap<usize, usize> =
            standard.into_iter().map(|(slot, (place, _))| (slot, place)).collect();
        let compile = |instances: &Vec<&Instance>| match standard.contains_key(&instances[0].left[0]) {
            true => Assigned::standardised(setting, instances, &fixed, &|slot| standard[&slot]),
            false => Assigned::new(setting, instances, &fixed),
        };
        let groups = batches.groups.iter().map(compile).collect::<Option<Vec<Assigned>>>()?;
        let (batches, slots) = (batches.batches, setting.slots());
        let terms = Terms { plain, compiled: terms.compiled };
        Some(Self { sites, coordinates, standard, slots, batches, groups, terms })
    }

    /// The number of coordinates.
    pub(super) fn dimensions(&self) -> usize {
        self.coordinates.len()
    }

    /// Begins at a state, and returns its coordinates.
    pub(super) fn begin(&self, values: &[f64], memory: &mut Slopes) -> Vec<f64> {
        let Slopes { state, cells, .. } = memory;
        state.clear();
        state.extend(values);
        state.resize(self.slots + self.standard.len(), 0.0);
        for (group, rows) in &self.batches {
            self.groups[*group].standardise(rows, state, cells, &|slot| self.standard[&slot]);
        }
        let coordinate = |(slot, scale): &(usize, Scale)| match scale {
            Scale::Standard(place) => state[*place],
            _ => scale.coordinate(state[*slot]),
        };
        self.coordinates.iter().map(coordinate).collect()
    }

    /// Moves to these coordinates; whether all values are finite.
    fn put(&self, place: &[f64], memory: &mut Slopes) -> bool {
        let Slopes { state, cells, found, .. } = memory;
        let mut finite = true;
        for ((slot, scale), u) in self.coordinates.iter().zip(place) {
            let number = scale.number(*u)[0];
            finite &= number.is_finite();
            state[if let Scale::Standard(place) = scale { *place } else { *slot }] = number;
        }
        finite && self.batches.iter().all(|(group, rows)| self.groups[*group].put(rows, state, cells, found))
    }

    /// Puts a state where its coordinates are these.
    pub(super) fn end(&self, place: &[f64], memory: &mut Slopes, values: &mut [f64]) {
        if self.put(place, memory) {
            values.copy_from_slice(&memory.state[..self.slots]);
        }
    }

    /// ln of the density at these coordinates, and its derivatives by them; −∞ where there is none.
    pub(super) fn ln(
        &self,
        blankets: &Blankets<'_>,
        place: &[f64],
        memory: &mut Slopes,
        slopes: &mut [f64],
    ) -> f64 {
        let is_inside = self.put(place, memory)
            && blankets.ln_of(&self.terms.plain, &mut memory.state).is_ok_and(|ln| ln > f64::NEG_INFINITY);
        let Some(mut ln) = is_inside.then(|| self.ln_here(blankets, memory)).flatten() else {
            return f64::NEG_INFINITY;
        };
        for (((slot, scale), u), slope) in self.coordinates.iter().zip(place).zip(&mut *slopes) {
            let [_, factor, ln_factor, slope_of_ln] = scale.number(*u);
            ln += ln_factor;
            let slot = if let Scale::Standard(place) = scale { *place } else { *slot };
            *slope = memory.by_slot[slot] * factor + slope_of_ln;
        }
        let is_defined = ln.is_finite() && slopes.iter().all(|slope| slope.is_finite());
        if is_defined { ln } else { f64::NEG_INFINITY }
    }

    /// ln of the density of the state, and its derivatives by all slots; `None` where a number is not valid.
    fn ln_here(&self, blankets: &Blankets<'_>, memory: &mut Slopes) -> Option<f64> {
        let Slopes { state, cells, by_slot, .. } = memory;
        by_slot.clear();
        by_slot.resize(state.len(), 0.0);
        let mut ln = blankets.compiled.slopes(&self.terms, state, cells, by_slot)?;
        for (group, rows) in self.batches.iter().rev() {
            self.groups[*group].slopes(rows, state, cells, by_slot);
            ln += self.groups[*group].ln(rows, state, cells, by_slot)?;
        }
        Some(ln)
    }
}
