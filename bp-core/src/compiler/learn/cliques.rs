//! Sums over hidden values: a tree of cliques, in logarithms.
//!
//! In: the hidden slots of each family of a case, and the ln density of each family at their values. Out: ln Σ Π, and
//! for each family the posterior of its hidden values given the case. Invariant: only logarithms are added, so nonzero
//! numbers do not underflow, for any number of families.
//!
//! Variables are eliminated one by one; messages go to the root and back (Lauritzen and Spiegelhalter 1988; Jensen,
//! Lauritzen and Olesen 1990).

use crate::elimination::order;

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
        Ok(Self { cliques: cliques.collect(), homes: homes.collect() })
    }

    /// ln Σ Π of tables of logarithms, one for each family, and the probabilities of each family's cells. All of them are
    /// 0 where the sum is.
    pub(super) fn sum(&self, tables: &[Vec<f64>]) -> (f64, Vec<Vec<f64>>) {
        let mut beliefs: Vec<Vec<f64>> = self.cliques.iter().map(|clique| vec![0.0; clique.cells]).collect();
        for (table, (home, places)) in tables.iter().zip(&self.homes) {
            add(&mut beliefs[*home], table, places);
        }
        let mut total = 0.0;
        let mut messages = Vec::with_capacity(self.cliques.len());
        for (own, clique) in self.cliques.iter().enumerate() {
            let message = match &clique.parent {
                Some((parent, own_places, theirs)) => {
                    let message = summed(&beliefs[own], own_places, clique.message);
                    add(&mut beliefs[*parent], &message, theirs);
                    message
                }
                None => {
                    total += summed(&beliefs[own], &vec![0; clique.cells], 1)[0];
                    Vec::new()
                }
            };
            messages.push(message);
        }
        if total == f64::NEG_INFINITY {
            return (total, tables.iter().map(|table| vec![0.0; table.len()]).collect());
        }
        for (own, clique) in self.cliques.iter().enumerate().rev() {
            let Some((parent, own_places, theirs)) = &clique.parent else { continue };
            let mut back = summed(&beliefs[*parent], theirs, clique.message);
            for (back, message) in back.iter_mut().zip(&messages[own]) {
                // A state excluded by the clique stays excluded: −∞ − −∞ is NaN.
                *back = if *message == f64::NEG_INFINITY { *message } else { *back - message };
            }
            add(&mut beliefs[own], &back, own_places);
        }
        let posteriors = tables.iter().zip(&self.homes).map(|(table, (home, places))| {
            let belief = &beliefs[*home];
            let most = belief.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let mut shares = vec![0.0; table.len()];
            for (cell, place) in belief.iter().zip(places) {
                shares[*place as usize] += (cell - most).exp();
            }
            let whole: f64 = shares.iter().sum();
            shares.iter_mut().for_each(|share| *share /= whole);
            shares
        });
        (total, posteriors.collect())
    }
}

/// Adds to each cell the entry at its position.
pub(super) fn add(cells: &mut [f64], table: &[f64], places: &[u32]) {
    cells.iter_mut().zip(places).for_each(|(cell, place)| *cell += table[*place as usize]);
}

/// ln Σ exp of the cells with the same position.
pub(super) fn summed(cells: &[f64], places: &[u32], count: usize) -> Vec<f64> {
    let mut most = vec![f64::NEG_INFINITY; count];
    for (cell, place) in cells.iter().zip(places) {
        most[*place as usize] = most[*place as usize].max(*cell);
    }
    let mut sums = vec![0.0; count];
    for (cell, place) in cells.iter().zip(places) {
        let most = most[*place as usize];
        if most > f64::NEG_INFINITY {
            sums[*place as usize] += (cell - most).exp();
        }
    }
    sums.iter().zip(&most).map(|(sum, most)| if *sum > 0.0 { most + sum.ln() } else { *most }).collect()
}

/// For each cell of a table over some slots the cell of one over some of them; the last slot fastest in both.
pub(super) fn places(from: &[usize], to: &[usize], count: &dyn Fn(usize) -> usize) -> Vec<u32> {
    let mut stride = 1;
    let mut strides = vec![0; from.len()];
    for slot in to.iter().rev() {
        if let Some(axis) = from.iter().position(|one| one == slot) {
            strides[axis] = stride;
        }
        stride *= count(*slot);
    }
    let mut places = vec![0];
    for (slot, stride) in from.iter().zip(strides) {
        let each =
            |place: &u32| (0..count(*slot)).map(|value| place + (value * stride) as u32).collect::<Vec<_>>();
        places = places.iter().flat_map(each).collect();
    }
    places
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
        let (total, shares) = cliques.sum(&tables);
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
        for (found, expected) in shares.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found - expected / sum).abs() < 1e-12, "{found} {}", expected / sum);
        }
        assert_eq!(Cliques::new(&families, &|slot| counts[slot], 6).unwrap_err().len(), 3);
        let nothing =
            cliques.sum(&tables.iter().map(|table| vec![f64::NEG_INFINITY; table.len()]).collect::<Vec<_>>());
        assert_eq!(nothing.0, f64::NEG_INFINITY);
    }
}
