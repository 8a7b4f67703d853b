//! Sums over hidden values: a tree of cliques, in logarithms.
//!
//! In: the hidden slots of each family of a case, and the ln density of each family at their values. Out: ln Σ Π, and
//! for each family the posterior of its hidden values given the case. Invariant: only logarithms are added, so nonzero
//! numbers do not underflow, for any number of families.
//!
//! Variables are eliminated one by one; messages go to the root and back (Lauritzen and Spiegelhalter 1988; Jensen,
//! Lauritzen and Olesen 1990).

use crate::distribution::{ln_sum, normalise};
use crate::elimination::order;
use crate::radix;

/// One clique.
#[derive(Clone, Debug)]
struct Clique {
    cells: usize,
    /// The clique that receives its message, the position in the message of each own cell, and of each of that
    /// clique's.
    parent: Option<(usize, Vec<u32>, Vec<u32>)>,
    /// The number of cells of its message.
    message: usize,
}

/// A tree of cliques, or several.
#[derive(Clone, Debug)]
pub(super) struct Cliques {
    /// Children first.
    cliques: Vec<Clique>,
    /// For each family its clique, and the position in its table of each cell of the clique.
    homes: Vec<(usize, Vec<u32>)>,
    /// The number of cells of each family.
    counts: Vec<usize>,
}

impl Cliques {
    /// For families with these hidden slots; `count` gives the number of values of each. The last slot of a family is
    /// the fastest in its table.
    ///
    /// # Errors
    /// The slots of a clique with more than `most` cells.
    pub(super) fn new(
        families: &[Vec<usize>],
        count: &dyn Fn(usize) -> usize,
        most: usize,
    ) -> Result<Self, Vec<usize>> {
        let mut slots: Vec<usize> = families.iter().flatten().copied().collect();
        slots.sort_unstable();
        slots.dedup();
        let number = |slot: &usize| slots.partition_point(|one| one < slot);
        let scopes: Vec<Vec<u32>> =
            families.iter().map(|family| family.iter().map(|slot| number(slot) as u32).collect()).collect();
        let all: Vec<u32> = (0..slots.len() as u32).collect();
        let found = order(slots.iter().map(|slot| count(*slot) as f64).collect(), &scopes, &all).variables;
        let mut turns = vec![0; slots.len()];
        found.iter().enumerate().for_each(|(turn, one)| turns[*one as usize] = turn);
        let first = |scope: &[usize]| scope.iter().map(|slot| turns[number(slot)]).min();
        // The slots that each clique takes from families and messages: those that are first eliminated in it.
        let mut taken: Vec<Vec<usize>> = vec![Vec::new(); slots.len()];
        let homes: Vec<usize> = (families.iter())
            .map(|family| first(family).expect("internal: a family has a hidden slot"))
            .collect();
        homes.iter().zip(families).for_each(|(home, family)| taken[*home].extend(family));
        let mut made: Vec<(Vec<usize>, Vec<usize>, Option<usize>)> = Vec::with_capacity(slots.len());
        for (turn, own) in found.iter().map(|one| slots[*one as usize]).enumerate() {
            let mut scope = std::mem::take(&mut taken[turn]);
            scope.sort_unstable();
            scope.dedup();
            if scope.iter().map(|one| count(*one) as f64).product::<f64>() > most as f64 {
                return Err(scope);
            }
            let message: Vec<usize> = scope.iter().copied().filter(|slot| *slot != own).collect();
            let parent = first(&message);
            parent.into_iter().for_each(|parent| taken[parent].extend(&message));
            made.push((scope, message, parent));
        }
        let cliques = made.iter().map(|(scope, message, parent)| {
            let parent = parent.map(|parent| {
                (parent, places(scope, message, count), places(&made[parent].0, message, count))
            });
            let cells = |slots: &[usize]| slots.iter().map(|slot| count(*slot)).product();
            Clique { cells: cells(scope), parent, message: cells(message) }
        });
        let homes =
            homes.iter().zip(families).map(|(home, family)| (*home, places(&made[*home].0, family, count)));
        let counts = families.iter().map(|family| family.iter().map(|slot| count(*slot)).product());
        Ok(Self { cliques: cliques.collect(), homes: homes.collect(), counts: counts.collect() })
    }

    /// Memory for the sums of one case.
    pub(super) fn beliefs(&self) -> Beliefs {
        let of = |count: &dyn Fn(&Clique) -> usize| -> Vec<Vec<f64>> {
            self.cliques.iter().map(|clique| vec![0.0; count(clique)]).collect()
        };
        let message = |clique: &Clique| clique.parent.as_ref().map_or(1, |_| clique.message);
        Beliefs {
            cells: of(&|clique| clique.cells),
            messages: of(&message),
            back: Vec::new(),
            most: Vec::new(),
        }
    }

    /// ln Σ Π of tables of logarithms, one for each family; `beliefs` receives the distribution of each clique.
    pub(super) fn sum<'t>(&self, tables: impl Iterator<Item = &'t [f64]>, beliefs: &mut Beliefs) -> f64 {
        let Beliefs { cells, messages, back, most } = beliefs;
        cells.iter_mut().for_each(|cells| cells.fill(0.0));
        for (table, (home, places)) in tables.zip(&self.homes) {
            add(&mut cells[*home], table, places);
        }
        let mut total = 0.0;
        for (own, clique) in self.cliques.iter().enumerate() {
            match &clique.parent {
                Some((parent, own_places, theirs)) => {
                    sum_into(&cells[own], own_places, most, &mut messages[own]);
                    add(&mut cells[*parent], &messages[own], theirs);
                }
                None => total += ln_sum(&cells[own]),
            }
        }
        if total == f64::NEG_INFINITY {
            cells.iter_mut().for_each(|cells| cells.fill(0.0));
            return total;
        }
        for (own, clique) in self.cliques.iter().enumerate().rev() {
            if let Some((parent, own_places, theirs)) = &clique.parent {
                back.resize(clique.message, 0.0);
                sum_into(&cells[*parent], theirs, most, back);
                for (back, message) in back.iter_mut().zip(&messages[own]) {
                    // A state excluded by the clique stays excluded: −∞ − −∞ is NaN.
                    *back = if *message == f64::NEG_INFINITY { *message } else { *back - message };
                }
                add(&mut cells[own], back, own_places);
            }
        }
        cells.iter_mut().for_each(|cells| normalise(cells));
        total
    }

    /// Appends the probabilities of each family's cells, from the distributions of the cliques; all 0 if the sum is.
    pub(super) fn shares(&self, beliefs: &Beliefs, shares: &mut Vec<f64>) {
        for ((home, places), count) in self.homes.iter().zip(&self.counts) {
            let begin = shares.len();
            shares.resize(begin + count, 0.0);
            for (p, place) in beliefs.cells[*home].iter().zip(places) {
                shares[begin + *place as usize] += p;
            }
        }
    }
}

/// The memory of [`Cliques::sum`].
pub(super) struct Beliefs {
    /// Logarithms, at last the distribution of each clique.
    cells: Vec<Vec<f64>>,
    messages: Vec<Vec<f64>>,
    back: Vec<f64>,
    most: Vec<f64>,
}

/// Adds to each cell the entry at its position.
pub(super) fn add(cells: &mut [f64], table: &[f64], places: &[u32]) {
    cells.iter_mut().zip(places).for_each(|(cell, place)| *cell += table[*place as usize]);
}

/// ln Σ exp of the cells with the same position.
pub(super) fn summed(cells: &[f64], places: &[u32], count: usize) -> Vec<f64> {
    let mut sums = vec![0.0; count];
    sum_into(cells, places, &mut Vec::new(), &mut sums);
    sums
}

/// The same into an array; `most` is memory.
fn sum_into(cells: &[f64], places: &[u32], most: &mut Vec<f64>, sums: &mut [f64]) {
    most.clear();
    most.resize(sums.len(), f64::NEG_INFINITY);
    for (cell, place) in cells.iter().zip(places) {
        most[*place as usize] = most[*place as usize].max(*cell);
    }
    sums.fill(0.0);
    for (cell, place) in cells.iter().zip(places) {
        let most = most[*place as usize];
        if most > f64::NEG_INFINITY {
            sums[*place as usize] += (cell - most).exp();
        }
    }
    for (sum, most) in sums.iter_mut().zip(most) {
        *sum = if *sum > 0.0 { *most + sum.ln() } else { *most };
    }
}

/// For each cell of a table over some slots the cell of one over some of them; the last slot fastest in both.
pub(super) fn places(from: &[usize], to: &[usize], count: &dyn Fn(usize) -> usize) -> Vec<u32> {
    let count = |slot: &usize| count(*slot);
    let axes = from.iter().map(|slot| (count(slot), radix::stride(to, slot, count))).collect();
    radix::offsets(axes).map(|place| place as u32).collect()
}

#[cfg(test)]
mod tests {
    use super::Cliques;
    use crate::radix;

    /// A loop of four variables of 2, 3, 2 and 3 values, and one unconnected, by enumeration.
    #[test]
    fn sums_and_shares_are_those_of_all_combinations() {
        let counts = [2, 3, 2, 3, 4];
        let families = [vec![0, 1], vec![1, 2], vec![2, 3], vec![3, 0], vec![4], vec![2]];
        let tables: Vec<Vec<f64>> = (families.iter().enumerate())
            .map(|(number, family)| {
                let cells = family.iter().map(|slot| counts[*slot]).product::<usize>();
                // Far below the range of exp(), and zeros.
                let cell = |cell: usize| match (7 * number + 5 * cell) % 11 {
                    0 => f64::NEG_INFINITY,
                    rest => -900.0 + 0.37 * rest as f64,
                };
                (0..cells).map(cell).collect()
            })
            .collect();
        let cliques = Cliques::new(&families, &|slot| counts[slot], 100).unwrap();
        let (mut beliefs, mut shares) = (cliques.beliefs(), Vec::new());
        // The memory of another case has no effect.
        let others: Vec<Vec<f64>> = tables.iter().map(|table| vec![-1.0; table.len()]).collect();
        cliques.sum(others.iter().map(Vec::as_slice), &mut beliefs);
        let total = cliques.sum(tables.iter().map(Vec::as_slice), &mut beliefs);
        cliques.shares(&beliefs, &mut shares);
        let mut expected: Vec<Vec<f64>> = tables.iter().map(|table| vec![0.0; table.len()]).collect();
        let mut sum = 0.0;
        for joint in 0..counts.iter().product::<usize>() {
            let values: Vec<usize> = radix::ordinals(joint, counts.iter().copied()).collect();
            let cells: Vec<usize> = (families.iter())
                .map(|family| family.iter().fold(0, |cell, slot| cell * counts[*slot] + values[*slot]))
                .collect();
            let ln: f64 = cells.iter().zip(&tables).map(|(cell, table)| table[*cell]).sum();
            let p = (ln + 900.0 * families.len() as f64).exp();
            sum += p;
            expected.iter_mut().zip(&cells).for_each(|(shares, cell)| shares[*cell] += p);
        }
        assert!((total - (sum.ln() - 900.0 * families.len() as f64)).abs() < 1e-9, "{total} {sum}");
        assert_eq!(shares.len(), expected.iter().flatten().count());
        for (found, expected) in shares.iter().zip(expected.iter().flatten()) {
            assert!((found - expected / sum).abs() < 1e-12, "{found} {}", expected / sum);
        }
        assert_eq!(Cliques::new(&families, &|slot| counts[slot], 6).unwrap_err().len(), 3);
        let nothing: Vec<Vec<f64>> =
            tables.iter().map(|table| vec![f64::NEG_INFINITY; table.len()]).collect();
        assert_eq!(cliques.sum(nothing.iter().map(Vec::as_slice), &mut beliefs), f64::NEG_INFINITY);
    }
}
