//! Bins: conversion between the ordinal of a bin and the number that represents it.
//!
//! In: bins, and an ordinal or a number. Out: the other. Invariant: as `Bins::centre` and `Bins::holding`, also within
//! rounding of an edge; a number in no bin gets an ordinal outside the domain.

use super::Lowering;
use crate::ids::ValueId;
use crate::kernel::{Extent, Fold, Index, Role};
use crate::model::Bins;
use crate::operators::{Binary, Unary};

impl Lowering<'_> {
    /// The centre of a bin.
    pub(super) fn centre(&mut self, bins: &Bins, ordinal: ValueId) -> ValueId {
        if let Some(width) = bins.width() {
            let (first, width) = (self.builder.constant(bins.centre(0)), self.builder.constant(width));
            let offset = self.builder.binary(Binary::Multiply, ordinal, width);
            return self.builder.binary(Binary::Add, first, offset);
        }
        let centres = (0..bins.count()).map(|bin| bins.centre(bin)).collect();
        self.bin_table("centres", centres, ordinal)
    }

    /// The lower and the upper edge of a bin.
    pub(super) fn bounds(&mut self, bins: &Bins, ordinal: ValueId) -> (ValueId, ValueId) {
        let one = self.builder.constant(1.0);
        let next = self.builder.binary(Binary::Add, ordinal, one);
        (self.edge(bins, ordinal), self.edge(bins, next))
    }

    /// The lower edge of a bin; for the ordinal after the last, the upper end.
    fn edge(&mut self, bins: &Bins, ordinal: ValueId) -> ValueId {
        let low = bins.ends().0;
        // A narrow distribution at the edge 0.3 is not on the other side of 3 · 0.1.
        let is_edge =
            |width: &f64| bins.edges().iter().enumerate().all(|(at, edge)| low + at as f64 * width == *edge);
        if let Some(width) = bins.width().filter(is_edge) {
            let (low, width) = (self.builder.constant(low), self.builder.constant(width));
            let offset = self.builder.binary(Binary::Multiply, ordinal, width);
            return self.builder.binary(Binary::Add, low, offset);
        }
        self.bin_table("edges", bins.edges().to_vec(), ordinal)
    }

    /// Reads a table at an ordinal; 0 outside.
    fn bin_table(&mut self, what: &str, numbers: Vec<f64>, ordinal: ValueId) -> ValueId {
        let name = self.name(what);
        let axis = self.builder.axis(&name, Extent::constant(numbers.len()));
        let buffer = self.builder.buffer(&name, Role::Table { key: None, numbers }, &[axis]);
        let (place, zero) = (self.builder.at(ordinal), self.builder.constant(0.0));
        self.builder.load_or(buffer, vec![place], zero)
    }

    /// The ordinal of the bin that holds a number; a number outside the domain if no bin holds it.
    pub(super) fn bin_holding(&mut self, bins: &Bins, number: ValueId) -> ValueId {
        let ((low, high), count) = (bins.ends(), bins.count());
        let low_value = self.builder.constant(low);
        let mut from_low = self.builder.binary(Binary::Subtract, number, low_value);
        if bins.is_circle() {
            let span = self.builder.constant(high - low);
            from_low = self.builder.binary(Binary::Remainder, from_low, span);
        }
        let bin = match bins.width() {
            Some(width) => {
                let most = (0..=count).map(|edge| bins.rounding(edge)).fold(0.0, f64::max);
                let (rounding, width) = (self.builder.constant(most / width), self.builder.constant(width));
                let bin = self.builder.binary(Binary::Divide, from_low, width);
                let bin = self.builder.binary(Binary::Add, bin, rounding);
                self.builder.unary(Unary::Floor, bin)
            }
            None => {
                // The number of edges at or below the number, less one.
                let name = self.name("edge");
                let axis = self.builder.axis(&name, Extent::constant(bins.edges().len()));
                let name = self.name("edges");
                let edges = bins.edges().iter().enumerate();
                let numbers = edges.map(|(at, edge)| edge - bins.rounding(at)).collect();
                let buffer = self.builder.buffer(&name, Role::Table { key: None, numbers }, &[axis]);
                let edge = self.builder.load(buffer, vec![Index::Axis(axis)]);
                let below = self.builder.binary(Binary::GreaterOrEqual, number, edge);
                let count = self.fold_over("bins below", Fold::Sum, &[axis], below);
                let one = self.builder.constant(1.0);
                self.builder.binary(Binary::Subtract, count, one)
            }
        };
        let after = self.builder.constant(count as f64);
        let at_end = self.builder.binary(Binary::GreaterOrEqual, bin, after);
        if bins.is_circle() {
            // The upper end is the lower one.
            let first = self.builder.constant(0.0);
            return self.builder.select(at_end, first, bin);
        }
        let last = self.builder.constant(count as f64 - 1.0);
        let most = self.builder.constant(high + bins.rounding(count));
        let inside = self.builder.binary(Binary::LessOrEqual, number, most);
        let at_end = self.builder.binary(Binary::And, at_end, inside);
        self.builder.select(at_end, last, bin)
    }
}
