//! Conditioning of a network's tables on hard evidence, and multiplication of tables over the same variables.
//!
//! In: a network and evidence. Out: a smaller network over the remaining variables, and the logarithm of a constant
//! taken out of it. Invariant: the product of the tables, times that constant, is the joint distribution with the
//! evidence; small numbers over the same variables are multiplied with separate exponents, so that thousands of
//! readings of one cause neither underflow nor absorb each other: a zero is a zero of the program.

use super::evidence::{NetworkEvidence, contradiction};
use super::network::{FactorTable, Network};
use super::refused::Refused;
use crate::error::Error;
use crate::exec::scalar::{Extended, Scalar};
use std::collections::HashMap;

/// A network conditioned on hard evidence.
pub(crate) struct Absorbed {
    pub(crate) network: Network,
    /// For each variable of the whole network its number in the remaining one; `usize::MAX` where it is known.
    pub(crate) numbers: Vec<usize>,
    pub(crate) ln_scale: f64,
}

/// The network conditioned on the values of some variables.
///
/// # Errors
/// The tables give these values probability zero; a form refuses a number in a context that they leave possible.
pub(crate) fn absorb(network: Network, evidence: &NetworkEvidence) -> Result<Absorbed, Error> {
    let count = network.cardinalities.len();
    let mut values = vec![usize::MAX; count];
    for (variable, value) in &evidence.hard {
        values[*variable] = *value;
    }
    Refused::check(&network.refused, &values)?;
    let (mut numbers, mut cardinalities) = (vec![usize::MAX; count], Vec::new());
    for variable in (0..count).filter(|variable| values[*variable] == usize::MAX) {
        numbers[variable] = cardinalities.len();
        cardinalities.push(network.cardinalities[variable]);
    }
    let mut ln_scale = 0.0;
    let mut scopes: HashMap<Vec<usize>, usize> = HashMap::new();
    let mut tables: Vec<Merged> = Vec::new();
    let Network { tables: all, mut wide, cardinalities: extents, .. } = network;
    for (number, table) in all.into_iter().enumerate() {
        let places = Places::of(&table, &values, &extents);
        let wide = wide.remove(&number).map(|wide| places.taken(wide));
        let own = places.taken(table.values);
        if let ([], [value]) = (places.free.as_slice(), own.as_slice()) {
            let value = wide.map_or_else(|| Extended::from_f64(*value), |wide| wide[0]);
            if value == Extended::ZERO {
                return Err(contradiction(table.variables));
            }
            ln_scale += value.natural_logarithm().to_f64();
            continue;
        }
        match scopes.get(&places.free) {
            Some(known) => tables[*known].multiply(&own, wide),
            None => {
                scopes.insert(places.free.clone(), tables.len());
                tables.push(Merged {
                    table: FactorTable { variables: places.free, values: own },
                    product: wide,
                });
            }
        }
    }
    let mut left = Network { table_of: vec![None; cardinalities.len()], cardinalities, ..Network::default() };
    for merged in tables {
        let Finished { mut table, wide, ln } = merged.finish()?;
        table.variables.iter_mut().for_each(|variable| *variable = numbers[*variable]);
        if let Some(wide) = wide {
            left.wide.insert(left.tables.len(), wide);
        }
        left.tables.push(table);
        ln_scale += ln;
    }
    Ok(Absorbed { network: left, numbers, ln_scale })
}

/// A table: the product of all tables over its variables, where there are several or where f64 cannot represent one of
/// them.
struct Merged {
    table: FactorTable,
    product: Option<Vec<Extended>>,
}

/// A table, its cells with separate exponents where f64 cannot represent them, and the logarithm of the constant taken
/// out.
struct Finished {
    table: FactorTable,
    wide: Option<Vec<Extended>>,
    ln: f64,
}

fn widened(values: &[f64]) -> Vec<Extended> {
    values.iter().map(|value| Extended::from_f64(*value)).collect()
}

impl Merged {
    fn multiply(&mut self, values: &[f64], wide: Option<Vec<Extended>>) {
        let own = &self.table.values;
        let product = self.product.get_or_insert_with(|| widened(own));
        let other = wide.unwrap_or_else(|| widened(values));
        product.iter_mut().zip(other).for_each(|(product, value)| *product = *product * value);
    }

    /// The product, scaled so that its largest number is in [1, 2).
    fn finish(self) -> Result<Finished, Error> {
        let Some(mut wide) = self.product else {
            return Ok(Finished { table: self.table, wide: None, ln: 0.0 });
        };
        let largest = wide.iter().filter_map(|cell| cell.binary_exponent()).max();
        let Some(largest) = largest else { return Err(contradiction(self.table.variables)) };
        wide.iter_mut().for_each(|cell| *cell = cell.times_power_of_two(-largest));
        let values: Vec<f64> = wide.iter().map(|cell| cell.to_f64()).collect();
        let is_lost = |(cell, value): (&Extended, &f64)| *cell > Extended::ZERO && *value < f64::MIN_POSITIVE;
        let is_wide = wide.iter().zip(&values).any(is_lost);
        let table = FactorTable { variables: self.table.variables, values };
        Ok(Finished { table, wide: is_wide.then_some(wide), ln: largest as f64 * std::f64::consts::LN_2 })
    }
}

/// The cells of a table at the values of its known variables.
struct Places {
    free: Vec<usize>,
    /// All cells, where no variable is known.
    places: Option<Vec<usize>>,
}

impl Places {
    fn of(table: &FactorTable, values: &[usize], cardinalities: &[usize]) -> Self {
        if table.variables.iter().all(|variable| values[*variable] == usize::MAX) {
            return Self { free: table.variables.clone(), places: None };
        }
        let mut places = vec![0];
        let mut free = Vec::new();
        for variable in &table.variables {
            let extent = cardinalities[*variable];
            places = match values[*variable] {
                usize::MAX => {
                    free.push(*variable);
                    places
                        .iter()
                        .flat_map(|place| (0..extent).map(move |value| place * extent + value))
                        .collect()
                }
                value => places.iter().map(|place| place * extent + value).collect(),
            };
        }
        Self { free, places: Some(places) }
    }

    fn taken<T: Copy>(&self, cells: Vec<T>) -> Vec<T> {
        match &self.places {
            Some(places) => places.iter().map(|place| cells[*place]).collect(),
            None => cells,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_of_one_cause_become_one_table() {
        // P(H), and three times P(R | H) with R = 1: 0.5 · 0.1³ and 0.5 · 0.4³; the larger one is taken out.
        let reading = |number| FactorTable { variables: vec![0, number], values: vec![0.9, 0.1, 0.6, 0.4] };
        let tables = vec![
            FactorTable { variables: vec![0], values: vec![0.5; 2] },
            reading(1),
            reading(2),
            reading(3),
        ];
        let network =
            Network { cardinalities: vec![2; 4], tables, table_of: vec![None; 4], ..Network::default() };
        let evidence = NetworkEvidence { hard: vec![(1, 1), (2, 1), (3, 1)], likelihoods: Vec::new() };
        let Absorbed { network, numbers, ln_scale } = absorb(network, &evidence).unwrap();
        assert_eq!((network.tables.len(), numbers), (1, vec![0, usize::MAX, usize::MAX, usize::MAX]));
        let values = &network.tables[0].values;
        assert!((ln_scale + values[1].ln() - (0.5 * 0.064f64).ln()).abs() < 1e-14);
        assert!((values[0] / values[1] - 1.0 / 64.0).abs() < 1e-15);
    }
}
