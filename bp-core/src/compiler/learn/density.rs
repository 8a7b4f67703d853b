//! The ln density of each family.
//!
//! In: a program with its numbers. Out: ln densities of a case's families. Invariant: a family over finite slots is
//! read from a table, each row of which is computed at most once.

use super::program::{Family, Program};
use crate::distribution::Setting;
use crate::error::Error;
use std::sync::OnceLock;

/// Limit of the cells of a stored table.
const MOST_CELLS: usize = 1 << 16;

/// The densities of a program for its current numbers.
pub(super) struct Densities<'p> {
    program: &'p Program,
    setting: Setting<'p>,
    tables: Vec<Option<Table>>,
}

/// The rows of a family: one for each combination of the values that it reads.
struct Table {
    /// The slots that determine the row, with their strides.
    right: Vec<(usize, usize)>,
    rows: Vec<OnceLock<Vec<f64>>>,
}

impl<'p> Densities<'p> {
    /// For the current numbers of the program, and about this number of cases.
    pub(super) fn new(program: &'p Program, cases: usize) -> Result<Self, Error> {
        let tables = program.families.iter().map(|family| Table::of(program, family, cases));
        Ok(Self { program, setting: program.setting()?, tables: tables.collect() })
    }

    /// The ln density of a family at values of its slots.
    pub(super) fn ln(&self, number: usize, values: &[f64]) -> Result<f64, Error> {
        let family = &self.program.families[number];
        let instance = &family.instance;
        let left = self.setting.left_value(instance, values);
        let ln = match &self.tables[number] {
            Some(table) => {
                let row =
                    table.right.iter().map(|(slot, stride)| values[*slot] as usize * stride).sum::<usize>();
                match table.rows[row].get() {
                    Some(row) => row[left as usize],
                    None => {
                        let distribution = self.setting.distribution(instance, values)?;
                        let count: usize = instance
                            .left
                            .iter()
                            .map(|slot| self.program.slots[*slot].count.unwrap_or(1))
                            .product();
                        let own = (0..count).map(|value| distribution.ln_density(value as f64));
                        table.rows[row].get_or_init(|| own.collect())[left as usize]
                    }
                }
            }
            None => self.setting.ln_density(instance, values)?,
        };
        match ln < f64::INFINITY {
            true => Ok(ln),
            false => {
                let shown = self.program.spelled(instance.left[0], values[instance.left[0]]);
                let message = format!(
                    "at {shown} its density is {}",
                    if ln.is_nan() { "not a number" } else { "infinite" }
                );
                Err(self.program.wrong(instance.factor, message))
            }
        }
    }
}

impl Table {
    fn of(program: &Program, family: &Family, cases: usize) -> Option<Self> {
        let count = |slot: usize| program.slots[slot].count;
        family.slots.iter().copied().map(count).collect::<Option<Vec<usize>>>()?;
        let (mut right, mut stride) = (Vec::new(), 1usize);
        for slot in family.slots.iter().filter(|slot| !family.instance.left.contains(slot)) {
            right.push((*slot, stride));
            stride = stride.checked_mul(count(*slot)?)?;
        }
        let cells =
            family.instance.left.iter().try_fold(stride, |cells, slot| cells.checked_mul(count(*slot)?))?;
        let fits = cells <= MOST_CELLS && stride <= 16 * cases.max(16);
        fits.then(|| Self { right, rows: (0..stride).map(|_| OnceLock::new()).collect() })
    }
}
