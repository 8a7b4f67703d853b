//! Evidence taken into the tables, and tables over the same variables made one.
//!
//! In: a network and what is known. Out: a smaller network of what is left, and the logarithm of a number that was taken out
//! of it. Invariant: the product of the tables, times that number, is the joint distribution with the evidence; many small
//! numbers over the same variables are summed as logarithms, so that thousands of readings of one cause neither underflow
//! nor vanish beside each other: what is impossible is a zero of the program.

use super::evidence::{Evidence, contradiction};
use super::network::{Network, Table};
use super::refused::Refused;
use super::session::beyond_tables;
use crate::error::Error;
use std::collections::HashMap;

/// What is left of a network.
pub(crate) struct Absorbed {
    pub(crate) network: Network,
    /// For each variable of the whole its number in what is left; `usize::MAX` where it is known.
    pub(crate) numbers: Vec<usize>,
    pub(crate) ln_scale: f64,
}

/// The network where some variables have values.
///
/// # Errors
/// The tables give them probability zero; a form refuses a number in a context that they leave possible.
pub(crate) fn absorb(network: Network, evidence: &Evidence) -> Result<Absorbed, Error> {
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
    for table in network.tables {
        let variables = table.variables.clone();
        let sliced = sliced(table, &values, &network.cardinalities);
        if let ([], [number]) = (sliced.variables.as_slice(), sliced.values.as_slice()) {
            if *number == 0.0 {
                return Err(if network.is_lossy { beyond_tables() } else { contradiction(variables) });
            }
            ln_scale += number.ln();
            continue;
        }
        match scopes.get(&sliced.variables) {
            Some(known) => tables[*known].multiply(&sliced.values),
            None => {
                scopes.insert(sliced.variables.clone(), tables.len());
                tables.push(Merged { table: sliced, logarithms: None });
            }
        }
    }
    let mut left = Network {
        table_of: vec![None; cardinalities.len()],
        cardinalities,
        is_lossy: network.is_lossy,
        ..Network::default()
    };
    for merged in tables {
        let finished = merged.finish();
        let (mut table, ln) = if left.is_lossy { finished.map_err(|_| beyond_tables())? } else { finished? };
        table.variables.iter_mut().for_each(|variable| *variable = numbers[*variable]);
        left.tables.push(table);
        ln_scale += ln;
    }
    Ok(Absorbed { network: left, numbers, ln_scale })
}

/// A table, and the sum of the logarithms of all that have its variables, where there are several.
struct Merged {
    table: Table,
    logarithms: Option<Vec<f64>>,
}

impl Merged {
    fn multiply(&mut self, values: &[f64]) {
        let own = &self.table.values;
        let sums = self.logarithms.get_or_insert_with(|| own.iter().map(|value| value.ln()).collect());
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value.ln());
    }

    /// The product, its largest number 1, and the logarithm of what was taken out.
    fn finish(self) -> Result<(Table, f64), Error> {
        let Some(logarithms) = self.logarithms else { return Ok((self.table, 0.0)) };
        let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if most == f64::NEG_INFINITY {
            return Err(contradiction(self.table.variables));
        }
        let values = logarithms.iter().map(|ln| (ln - most).exp()).collect();
        Ok((Table { variables: self.table.variables, values }, most))
    }
}

/// The cells of a table at the values of its known variables.
fn sliced(table: Table, values: &[usize], cardinalities: &[usize]) -> Table {
    if table.variables.iter().all(|variable| values[*variable] == usize::MAX) {
        return table;
    }
    let mut places = vec![0];
    let mut free = Vec::new();
    for variable in &table.variables {
        let extent = cardinalities[*variable];
        places = match values[*variable] {
            usize::MAX => {
                free.push(*variable);
                places.iter().flat_map(|place| (0..extent).map(move |value| place * extent + value)).collect()
            }
            value => places.iter().map(|place| place * extent + value).collect(),
        };
    }
    Table { variables: free, values: places.into_iter().map(|place| table.values[place]).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_of_one_cause_become_one_table() {
        // P(H), and thrice P(R | H) with R = 1: 0.5 · 0.1³ and 0.5 · 0.4³, whose larger one is taken out.
        let reading = |number| Table { variables: vec![0, number], values: vec![0.9, 0.1, 0.6, 0.4] };
        let tables =
            vec![Table { variables: vec![0], values: vec![0.5; 2] }, reading(1), reading(2), reading(3)];
        let network =
            Network { cardinalities: vec![2; 4], tables, table_of: vec![None; 4], ..Network::default() };
        let evidence = Evidence { hard: vec![(1, 1), (2, 1), (3, 1)], likelihoods: Vec::new() };
        let Absorbed { network, numbers, ln_scale } = absorb(network, &evidence).unwrap();
        assert_eq!((network.tables.len(), numbers), (1, vec![0, usize::MAX, usize::MAX, usize::MAX]));
        assert!((ln_scale - (0.5 * 0.064f64).ln()).abs() < 1e-14);
        assert!(
            (network.tables[0].values[0] - 1.0 / 64.0).abs() < 1e-15 && network.tables[0].values[1] == 1.0
        );
    }
}
