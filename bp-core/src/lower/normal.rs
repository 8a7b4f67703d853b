//! Normal laws: of a real, over integers, and read on bins.
//!
//! In: mean and deviation. Out: the density, or the probability of a value. Invariant: over a finite domain the
//! probabilities sum to one, however far the mean is.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{ExpressionId, ValueId, VariableId};
use crate::kernel::Fold;
use crate::model::Domain;
use crate::operators::{Binary, Unary};

impl Lowering<'_> {
    /// A normal density; over integers, normalised over the domain.
    pub(super) fn normal(
        &mut self,
        variable: VariableId,
        domain: &Domain,
        at: &Meaning,
        mean: ExpressionId,
        deviation: ExpressionId,
    ) -> Result<ValueId, Error> {
        let (mean, deviation) = (self.expression(mean)?, self.expression(deviation)?);
        let x = self.number_of(variable, at)?;
        let zero = self.builder.constant(0.0);
        if *domain == Domain::Real {
            let standard = self.standard(x, mean, deviation);
            let bell = self.bell(standard, zero);
            let root = self.builder.constant(std::f64::consts::TAU.sqrt());
            let total = self.builder.binary(Binary::Multiply, deviation, root);
            return Ok(self.builder.binary(Binary::Divide, bell, total));
        }
        // Relative to the value nearest to the mean, so that a mean far outside leaves something to divide by.
        let extent = self.extent(domain);
        let (count, one, half) =
            (self.count_of(extent), self.builder.constant(1.0), self.builder.constant(0.5));
        let last = self.builder.binary(Binary::Subtract, count, one);
        let low = self.number_of(variable, &Meaning::Ordinal(zero))?;
        let high = self.number_of(variable, &Meaning::Ordinal(last))?;
        let rounded = self.builder.binary(Binary::Add, mean, half);
        let rounded = self.builder.unary(Unary::Floor, rounded);
        let nearest = self.builder.binary(Binary::Maximum, rounded, low);
        let nearest = self.builder.binary(Binary::Minimum, nearest, high);
        let nearest = self.standard(nearest, mean, deviation);
        let standard = self.standard(x, mean, deviation);
        let bell = self.bell(standard, nearest);
        let name = self.name("support");
        let axis = self.builder.axis(&name, extent);
        let running = self.builder.running(axis);
        let number = self.number_of(variable, &Meaning::Ordinal(running))?;
        let standard = self.standard(number, mean, deviation);
        let value = self.bell(standard, nearest);
        let total = self.fold_over("normal total", Fold::Sum, &[axis], value);
        Ok(self.builder.binary(Binary::Divide, bell, total))
    }

    /// (x − m) / s
    fn standard(&mut self, x: ValueId, mean: ValueId, deviation: ValueId) -> ValueId {
        let centred = self.builder.binary(Binary::Subtract, x, mean);
        self.builder.binary(Binary::Divide, centred, deviation)
    }

    /// exp(−½ z²) / exp(−½ z₀²) = exp(½ (z₀ − z) (z₀ + z))
    fn bell(&mut self, standard: ValueId, from: ValueId) -> ValueId {
        let difference = self.builder.binary(Binary::Subtract, from, standard);
        let sum = self.builder.binary(Binary::Add, from, standard);
        let product = self.builder.binary(Binary::Multiply, difference, sum);
        let half = self.builder.constant(0.5);
        let exponent = self.builder.binary(Binary::Multiply, half, product);
        self.builder.unary(Unary::Exponential, exponent)
    }

    /// Paper, Eq. 4, made exact: Φ((j−m)/s) − Φ((j−1−m)/s) for bin j, all below for the first, the rest for
    /// "nothing"; and "nothing" for sure where the mean lies beyond N + ½. Above the mean the difference is that of the upper
    /// tails, Φ((m−j+1)/s) − Φ((m−j)/s), which do not cancel there.
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
        // NaN reaches every tail; so it is asked where the deviation is made, not once a bin.
        let holds = self.is_positive(deviation);
        let deviation = self.only_if(holds, deviation);
        let (zero, half, one) =
            (self.builder.constant(0.0), self.builder.constant(0.5), self.builder.constant(1.0));
        // The tail beyond an edge on its own side of the mean: Φ(−|z|), one Φ for each edge.
        let turned = self.builder.unary(Unary::Negate, deviation);
        let tail = |lowering: &mut Self, edge: ValueId| {
            let centred = lowering.builder.binary(Binary::Subtract, edge, mean);
            let size = lowering.builder.unary(Unary::Absolute, centred);
            let standard = lowering.builder.binary(Binary::Divide, size, turned);
            lowering.builder.unary(Unary::NormalCumulative, standard)
        };
        let nothing = self.builder.binary(Binary::LessOrEqual, bin, zero);
        let first = self.builder.binary(Binary::LessOrEqual, bin, one);
        // Upper edge of the bin, or N for "nothing"; what lies below its lower edge.
        let upper = self.builder.select(nothing, bins, bin);
        let upper_tail = tail(self, upper);
        // One below the upper one, as neighbouring means see it: so they share it.
        let lower = self.builder.binary(Binary::Subtract, upper, one);
        let lower_tail = tail(self, lower);
        // On which side of the mean an edge is takes no division. Where it is the mean, either side will do.
        let centred = self.builder.binary(Binary::Subtract, upper, mean);
        let upper_above = self.builder.binary(Binary::Greater, centred, zero);
        let lower_above = self.builder.binary(Binary::Greater, centred, one);
        // What lies below the upper edge; for "nothing", what lies above it.
        let is_rest = self.builder.binary(Binary::NotEqual, upper_above, nothing);
        let rest = self.builder.binary(Binary::Subtract, one, upper_tail);
        let up_to = self.builder.select(is_rest, rest, upper_tail);
        let falling = self.builder.binary(Binary::Subtract, lower_tail, upper_tail);
        let rising = self.builder.binary(Binary::Subtract, up_to, lower_tail);
        let within = self.builder.select(lower_above, falling, rising);
        // "Nothing" comes before the first.
        let value = self.builder.select(first, up_to, within);
        let empty = match self.builder.more_than(bins, mean) {
            Some(more) => self.builder.constant(f64::from(u8::from(more >= 0.5))),
            None => {
                let edge = self.builder.binary(Binary::Add, bins, half);
                self.builder.binary(Binary::GreaterOrEqual, mean, edge)
            }
        };
        let sure = self.builder.select(nothing, one, zero);
        let sure = self.only_if(holds, sure);
        Ok(self.builder.select(empty, sure, value))
    }
}
