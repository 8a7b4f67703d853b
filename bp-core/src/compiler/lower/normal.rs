//! Normal laws over integers and on bins, as loops.
//!
//! In: mean and deviation. Out: the probability of a value, by the equations of `forms/`. Invariant: over a finite
//! domain the probabilities sum to one, however far away the mean is.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::forms::{normal, normal_bins};
use crate::ids::{ExpressionId, ValueId, VariableId};
use crate::kernel::Fold;
use crate::law::{self, Constraint};
use crate::model::Domain;
use crate::operators::Binary;

impl Lowering<'_> {
    /// A normal law over integers, normalised over the domain.
    pub(super) fn normal(
        &mut self,
        variable: VariableId,
        domain: &Domain,
        ordinal: ValueId,
        parameters: [ValueId; 2],
    ) -> Result<ValueId, Error> {
        let extent = self.extent(domain);
        let (zero, one, count) =
            (self.builder.constant(0.0), self.builder.constant(1.0), self.count_of(extent));
        let last = self.builder.binary(Binary::Subtract, count, one);
        let ends = [self.number_at(variable, zero), self.number_at(variable, last)];
        let nearest = normal::nearest(&mut self.builder, parameters[0], ends);
        let nearest = law::normal::standard(&mut self.builder, nearest, parameters);
        let x = self.number_at(variable, ordinal);
        let weight = normal::weight(&mut self.builder, x, nearest, parameters);
        let name = self.name("support");
        let axis = self.builder.axis(&name, extent);
        let running = self.builder.running(axis);
        let number = self.number_at(variable, running);
        let value = normal::weight(&mut self.builder, number, nearest, parameters);
        let total = self.fold_over("normal total", Fold::Sum, &[axis], value);
        Ok(self.builder.binary(Binary::Divide, weight, total))
    }

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
