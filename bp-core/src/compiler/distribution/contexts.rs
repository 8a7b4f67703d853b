//! The distributions of an instance, each computed once.
//!
//! In: an instance whose parents are finite, and the values of the variables. Out: its distribution. Invariant: the
//! distribution in a context is that of [`Setting::distribution`], computed when it is first read, whichever thread
//! reads it.

use super::{Distribution, Instance, Setting};
use crate::error::Error;
use crate::radix;
use std::borrow::Cow;
use std::sync::OnceLock;

/// Limit of the numbers of the distributions of one instance.
const MOST_NUMBERS: usize = 1 << 16;

/// The distributions of an instance, one for each combination of the values of its parents.
#[derive(Debug)]
pub(crate) struct Contexts {
    /// The slots of the parents, each with its number of values.
    parents: Vec<(usize, usize)>,
    known: Vec<OnceLock<Distribution>>,
}

impl Contexts {
    /// `None` where a parent is real, where the left-hand side is a component of a vector, or where there are more contexts
    /// than `most`.
    pub(crate) fn of(setting: &Setting<'_>, instance: &Instance, most: usize) -> Option<Self> {
        let count = |slot: usize| {
            let variable = setting.variable_of(slot);
            let finite = setting.model.variables[variable].domain.is_finite();
            finite.then(|| (slot, setting.count(variable)))
        };
        if setting.components(setting.variable_of(instance.left[0])) > 1 {
            return None;
        }
        let parents = setting.reads(instance).into_iter().filter(|slot| !instance.left.contains(slot));
        let parents: Vec<(usize, usize)> = parents.map(count).collect::<Option<_>>()?;
        let left: Vec<(usize, usize)> = instance.left.iter().filter_map(|slot| count(*slot)).collect();
        let product = |counts: &[(usize, usize)]| {
            counts.iter().try_fold(1usize, |product, (_, count)| product.checked_mul(*count))
        };
        let contexts = product(&parents)?;
        let numbers = contexts.checked_mul(product(&left)?)?;
        (contexts <= most && numbers <= MOST_NUMBERS)
            .then(|| Self { parents, known: (0..contexts).map(|_| OnceLock::new()).collect() })
    }

    /// The distribution of the instance at these values of its parents.
    ///
    /// # Errors
    /// As [`Setting::distribution`].
    pub(crate) fn at(
        &self,
        setting: &Setting<'_>,
        instance: &Instance,
        values: &[f64],
    ) -> Result<Cow<'_, Distribution>, Error> {
        let digits = self.parents.iter().map(|(slot, count)| (values[*slot] as usize, *count));
        let is_known = self.parents.iter().all(|(slot, count)| (0.0..*count as f64).contains(&values[*slot]));
        let Some(known) = self.known.get(radix::position(digits)).filter(|_| is_known) else {
            return Ok(Cow::Owned(setting.distribution(instance, values)?));
        };
        if let Some(distribution) = known.get() {
            return Ok(Cow::Borrowed(distribution));
        }
        let made = setting.distribution(instance, values)?;
        Ok(Cow::Borrowed(known.get_or_init(|| made)))
    }
}
