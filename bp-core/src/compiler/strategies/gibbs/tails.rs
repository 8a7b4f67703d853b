//! Whether a flat variable that is drawn has a proper posterior.
//!
//! In: a state of a chain. Out: an error, where the density of a flat variable, given all others, has no total. Invariant: the state
//! is left as it was.

use super::blanket::{Blankets, Memory, Node};
use crate::error::Error;

impl Blankets<'_> {
    /// Refuses a flat variable whose density, given all others, falls too slowly to have a total: not faster than 1/x far from 0,
    /// or than 1/x rises towards 0.
    ///
    /// # Errors
    /// The posterior is improper.
    pub(super) fn check_tails(&self, values: &mut [f64], memory: &mut Memory) -> Result<(), Error> {
        let observed = (0..values.len()).filter(|slot| {
            let variable = self.setting.variable_of(*slot);
            !self.observations.values[*slot].is_nan()
                && !self.setting.model.variables[variable].domain.is_finite()
        });
        let scale = observed.map(|slot| values[slot].abs()).fold(0.0, f64::max);
        let scale = if scale > 0.0 { scale } else { 1.0 };
        for site in &self.sites {
            let own = site.blanket.iter().find_map(|node| match &self.nodes[*node] {
                Node::Weighed(instance) if instance.left.contains(&site.slot) => Some(instance),
                _ => None,
            });
            let Some(own) = own.filter(|instance| self.is_flat(instance)) else { continue };
            let before = values[site.slot];
            // Residuals below the digits of the data are rounding: there the density rises as if they were 0.
            let others = match self.is_half_flat(own) {
                true => vec![[1e-20, 1e-24], [1e-10 * scale, 1e-12 * scale]],
                false => vec![[-1e20, -1e24]],
            };
            for tail in others.into_iter().chain([[1e20, 1e24]]) {
                let ln = tail.map(|value| {
                    values[site.slot] = value;
                    self.ln_conditional(site, values, memory).unwrap_or(f64::NEG_INFINITY)
                });
                let steps = (tail[1].abs() / tail[0].abs()).ln();
                let slope = (ln[1] - ln[0]) / steps;
                let has_total =
                    ln[1] == f64::NEG_INFINITY || if steps > 0.0 { slope < -1.001 } else { slope > -0.999 };
                if !has_total {
                    let name = self.setting.slot_name(site.slot);
                    let reason = format!(
                        "the posterior is improper: the observations do not bound `{name}`, which is flat; observe more, or give \
                         a proper form such as `normal(0, 100)` or `half_normal(100)`"
                    );
                    return Err(Error::Unplanned { question: self.setting.model.name.clone(), reason });
                }
            }
            values[site.slot] = before;
            self.ln_conditional(site, values, memory)?;
        }
        Ok(())
    }
}
