//! The ln density of each family.
//!
//! In: a program with its numbers. Out: ln densities of a case's families. Invariant: of a family whose right-hand slots
//! are finite, the distribution in each context is computed at most once.

use super::program::Program;
use crate::distribution::{Contexts, Setting};
use crate::error::Error;

/// The densities of a program for its current numbers.
pub(super) struct Densities<'p> {
    program: &'p Program,
    setting: Setting<'p>,
    contexts: Vec<Option<Contexts>>,
}

impl<'p> Densities<'p> {
    /// For the current numbers of the program, and about this number of cases.
    pub(super) fn new(program: &'p Program, cases: usize) -> Result<Self, Error> {
        let setting = program.setting()?;
        let families = program.families.iter();
        let contexts = families.map(|family| Contexts::of(&setting, &family.instance, 16 * cases.max(16)));
        Ok(Self { program, contexts: contexts.collect(), setting })
    }

    /// The ln density of a family at values of its slots.
    pub(super) fn ln(&self, number: usize, values: &[f64]) -> Result<f64, Error> {
        let instance = &self.program.families[number].instance;
        let ln = match &self.contexts[number] {
            Some(contexts) => {
                let distribution = contexts.at(&self.setting, instance, values)?;
                distribution.ln_density(self.setting.left_value(instance, values))
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
