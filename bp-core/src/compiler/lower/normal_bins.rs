//! `normal_bins(m, s)` as loops.
//!
//! In: mean and deviation. Out: the probability of a value, by the equations of `forms/`. Invariant: the probabilities
//! sum to one, however far away the mean is.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::forms::normal_bins;
use crate::ids::{ExpressionId, ValueId};
use crate::law::Constraint;
use crate::model::Domain;

impl Lowering<'_> {
    /// A normal law on unit bins after one label.
    pub(super) fn normal_bins(
        &mut self,
        domain: &Domain,
        at: &Meaning,
        mean: ExpressionId,
        deviation: ExpressionId,
    ) -> Result<ValueId, Error> {
        let Meaning::Ordinal(bin) = *at else {
            return Err(self.unplanned("`normal_bins` distributes one label and a range"));
        };
        let (mean, deviation) = (self.expression(mean)?, self.expression(deviation)?);
        let bins = match domain {
            Domain::Finite { range: Some(range), .. } => self.bounded(range.high, 1 - range.low),
            _ => return Err(self.unplanned("`normal_bins` distributes one label and a range")),
        };
        let bins = self.count_of(bins);
        // NaN propagates to every tail, so the check is made once for the deviation, not once for each bin.
        let holds = Constraint::Positive.holds(&mut self.builder, deviation);
        let deviation = self.only_if(holds, deviation);
        let within = normal_bins::within(&mut self.builder, bin, bins, [mean, deviation]);
        let empty = match self.builder.more_than(bins, mean) {
            Some(more) => self.builder.constant(f64::from(u8::from(more >= normal_bins::BEYOND))),
            None => normal_bins::is_beyond(&mut self.builder, mean, bins),
        };
        let beyond = normal_bins::beyond(&mut self.builder, bin);
        let beyond = self.only_if(holds, beyond);
        Ok(self.builder.select(empty, beyond, within))
    }
}
