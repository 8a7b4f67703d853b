//! The tables of a network, laid out for a tree.
//!
//! In: a table, its given variables, the order of the others. Out: its cells, one slice for each combination of given
//! values. Invariant: a slice is contiguous.

use super::cell::normalise;
use super::network::Network;
use super::problem::Problem;
use crate::exec::scalar::{Extended, Scalar};
use crate::radix;

/// The numbers of the tables that do not depend on the evidence.
#[derive(Clone, Debug)]
pub(super) struct Tables {
    pub(super) values: Vec<f64>,
    /// The same with separate exponents, where f64 cannot represent all of them.
    pub(super) wide: Option<Vec<Extended>>,
    /// For each slicing its given variables: (variable, slices to the next of its values).
    pub(super) slicings: Vec<Vec<(usize, usize)>>,
    /// Tables whose variables are all given: (start, slicing).
    pub(super) known: Vec<(usize, usize)>,
    /// The power of two taken out of constant tables.
    pub(super) exponent: i64,
    /// The powers of two taken out of slices: the largest cell of each is in [1, 2).
    pub(super) exponents: Vec<i64>,
}

/// The slicing of a table with one slice.
pub(super) const CONSTANT: usize = 0;

/// The builder of tables.
pub(super) struct Builder<'n> {
    network: &'n Network,
    pub(super) problem: &'n Problem,
    given: &'n [bool],
}

impl<'n> Builder<'n> {
    pub(super) fn new(network: &'n Network, problem: &'n Problem, given: &'n [bool]) -> Self {
        Self { network, problem, given }
    }

    /// Where the cells of some of a table's variables are, the last one fastest.
    fn offsets(&self, table: usize, variables: impl Iterator<Item = usize>) -> Vec<usize> {
        let (all, extent) =
            (&self.network.tables[table].variables, |one: &usize| self.network.cardinalities[*one]);
        let axes = variables.map(|variable| (extent(&variable), radix::stride(all, &variable, extent)));
        radix::offsets(axes.collect()).collect()
    }
}

impl Tables {
    pub(super) fn new(builder: &Builder<'_>) -> Self {
        let (network, problem) = (builder.network, builder.problem);
        let is_wide = problem.tables.iter().chain(&problem.known).any(|one| network.wide.contains_key(one));
        let mut tables = Self {
            values: Vec::new(),
            wide: is_wide.then(Vec::new),
            slicings: vec![Vec::new()],
            known: Vec::new(),
            exponent: 0,
            exponents: Vec::new(),
        };
        for table in &problem.known {
            let start = tables.values.len();
            let slicing = tables.slicing(builder, *table);
            let values = &network.tables[*table].values;
            tables.values.extend_from_slice(values);
            if let Some(all) = &mut tables.wide {
                match network.wide.get(table) {
                    Some(wide) => all.extend_from_slice(wide),
                    None => all.extend(values.iter().map(|value| Extended::from_f64(*value))),
                }
            }
            tables.known.push((start, slicing));
        }
        tables
    }

    /// The slicing by the given variables of a table.
    fn slicing(&mut self, builder: &Builder<'_>, table: usize) -> usize {
        let (mut slicing, mut slices) = (Vec::new(), 1);
        let all = builder.network.tables[table].variables.iter().rev().copied();
        for variable in all.filter(|one| builder.given[*one]) {
            slicing.push((variable, slices));
            slices *= builder.network.cardinalities[variable];
        }
        if slicing.is_empty() {
            return CONSTANT;
        }
        self.slicings.push(slicing);
        self.slicings.len() - 1
    }

    /// Stores a table of the problem with these axes, summed over the variables in `alone`. Returns where it and the
    /// exponents of its slices begin, and the slicing.
    pub(super) fn keep(
        &mut self,
        builder: &Builder<'_>,
        table: usize,
        axes: &[u32],
        alone: &[u32],
    ) -> (usize, usize, usize) {
        let (start, exponents) = (self.values.len(), self.exponents.len());
        let number = builder.problem.tables[table];
        let slicing = self.slicing(builder, number);
        let values = &builder.network.tables[number].values;
        let own = |axes: &[u32]| {
            builder.offsets(number, axes.iter().map(|axis| builder.problem.variables[*axis as usize]))
        };
        let (cells, rest) = (own(axes), own(alone));
        let all = &builder.network.tables[number].variables;
        for slice in builder.offsets(number, all.iter().copied().filter(|one| builder.given[*one])) {
            let sum = |cell: &usize| rest.iter().map(|place| values[slice + cell + place]).sum::<f64>();
            let own = self.values.len();
            self.values.extend(cells.iter().map(sum));
            let exponent = normalise(&mut self.values[own..]);
            self.exponents.push(exponent);
            if let Some(all) = &mut self.wide {
                let wide = builder.network.wide.get(&number);
                let cell =
                    |place: usize| wide.map_or_else(|| Extended::from_f64(values[place]), |wide| wide[place]);
                let sum =
                    |cells: &usize| rest.iter().map(|place| cell(slice + cells + place)).sum::<Extended>();
                all.extend(cells.iter().map(|cell| sum(cell).times_power_of_two(-exponent)));
            }
        }
        (start, exponents, slicing)
    }
}
