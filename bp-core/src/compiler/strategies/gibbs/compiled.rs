//! The densities of many nodes, compiled.
//!
//! In: the nodes of a program. Out: [`Compiled`], and the sum of ln of the densities of the nodes of a blanket. Invariant: nodes that
//! are not compiled, such as Diracs and hidden finite variables, are named apart.

use super::blanket::{Blankets, Memory, Node, Site};
use crate::distribution::{Cells, Densities, Instance, Setting};
use crate::ids::Id;
use crate::model::Form;
use crate::sample::Observations;
use std::collections::BTreeMap;

/// Compiled groups of nodes.
#[derive(Debug)]
pub(super) struct Compiled {
    groups: Vec<Densities>,
    /// The group of each node, and its place there.
    places: Vec<Option<(usize, u32)>>,
}

/// The nodes of a blanket.
#[derive(Clone, Debug, Default)]
pub(super) struct Terms {
    /// Those that are not compiled.
    pub(super) plain: Vec<usize>,
    /// The others: groups, with places in them.
    pub(super) compiled: Vec<(usize, Vec<u32>)>,
}

impl Compiled {
    /// Compiles what can be compiled.
    pub(super) fn new(setting: &Setting<'_>, observations: &Observations, nodes: &[Node]) -> Self {
        let observed = |slot: usize| Some(observations.values[slot]).filter(|value| !value.is_nan());
        let mut alike: BTreeMap<_, Vec<(usize, &Instance)>> = BTreeMap::new();
        for (number, node) in nodes.iter().enumerate() {
            let Node::Weighed(instance) = node else { continue };
            let [left] = instance.left.as_slice() else { continue };
            let form = setting.form_at(instance);
            // Instances with different values of a truth value or label have different entries.
            let value = match form {
                Form::Law { .. } => None,
                _ => observed(*left).map(f64::to_bits),
            };
            let key =
                (instance.factor.position(), instance.component, std::ptr::from_ref(form).addr(), value);
            alike.entry(key).or_default().push((number, instance));
        }
        let mut compiled = Self { groups: Vec::new(), places: vec![None; nodes.len()] };
        for group in alike.into_values() {
            let instances: Vec<&Instance> = group.iter().map(|(_, instance)| *instance).collect();
            if let Some(densities) = Densities::new(setting, &instances, &observed) {
                let own = compiled.groups.len();
                (0..).zip(&group).for_each(|(at, (node, _))| compiled.places[*node] = Some((own, at)));
                compiled.groups.push(densities);
            }
        }
        compiled
    }

    /// The nodes of a blanket, parted.
    pub(super) fn terms(&self, blanket: &[usize]) -> Terms {
        let mut terms = Terms::default();
        let mut groups: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for node in blanket {
            match self.places[*node] {
                Some((group, at)) => groups.entry(group).or_default().push(at),
                None => terms.plain.push(*node),
            }
        }
        terms.compiled = groups.into_iter().collect();
        terms
    }

    /// Σ ln of the compiled densities of a blanket; `None` where a number is not valid.
    pub(super) fn ln(&self, terms: &Terms, values: &[f64], cells: &mut Vec<f64>) -> Option<f64> {
        terms.compiled.iter().map(|(group, rows)| self.groups[*group].ln(rows, values, cells)).sum()
    }

    /// As [`Compiled::ln`]; adds its derivatives by all slots to `slopes`.
    pub(super) fn slopes(
        &self,
        terms: &Terms,
        values: &[f64],
        cells: &mut Cells,
        slopes: &mut [f64],
    ) -> Option<f64> {
        let of = |(group, rows): &(usize, Vec<u32>)| self.groups[*group].slopes(rows, values, cells, slopes);
        terms.compiled.iter().map(of).sum()
    }
}

impl Blankets<'_> {
    /// ln of the product of a site's blanket, by what is compiled of it; `None` where that has no number.
    pub(super) fn ln_compiled(&self, site: &Site, values: &mut [f64], memory: &mut Memory) -> Option<f64> {
        if site.terms.compiled.is_empty() {
            return None;
        }
        let plain = self.ln_of(&site.terms.plain, values).ok()?;
        if plain == f64::NEG_INFINITY {
            return Some(plain);
        }
        Some(plain + self.compiled.ln(&site.terms, values, &mut memory.cells)?)
    }
}
