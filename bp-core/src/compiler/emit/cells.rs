//! Folds of a nest without a plate, all cells of its last axis at once.
//!
//! In: a nest that folds. Out: its loops, the folded axes outside, the last axis of the result inside. Invariant: each cell is folded
//! in the same order as alone; the inner loop runs over contiguous cells, so that it becomes SIMD.

use super::nest::Nests;
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::schedule::{Loops, reachable};
use crate::kernel::{Fold, Node, Reduce};
use crate::loops::{Expression, Kind, Of, Operation, Statement, Type};
use crate::operators::{Binary, Unary};

/// The cells that are folded at once: enough for SIMD, few enough for the stack.
const CELLS: std::ops::RangeInclusive<usize> = 4..=1024;

/// A nest whose loops are exchanged.
struct Exchanged<'l> {
    out: BufferId,
    value: ValueId,
    fold: Fold,
    last: AxisId,
    cells: usize,
    /// The number of loops outside the fold.
    outer: usize,
    order: Vec<AxisId>,
    levels: &'l [Vec<ValueId>],
}

impl Nests<'_> {
    /// The loops of a nest, if it is such a fold.
    pub(super) fn folded_cells(&self, loops: &Loops) -> Option<Vec<Statement>> {
        let nest = &self.kernel.nests[loops.nest];
        let Reduce::Fold(fold, _) = nest.reduce else { return None };
        let last = *self.kernel.buffers[nest.out].axes.last()?;
        let cells = self.kernel.axes[last].extent.known().filter(|cells| CELLS.contains(cells))?;
        let mut order: Vec<AxisId> = loops.outer.iter().copied().filter(|axis| *axis != last).collect();
        let outer = order.len();
        order.extend(&loops.inner);
        order.push(last);
        // Each value in the outermost loop that has all its axes.
        let mut levels: Vec<Vec<ValueId>> = vec![Vec::new(); order.len() + 1];
        let mut depths = vec![0; self.kernel.nodes.len()];
        for value in reachable(self.kernel, nest.value) {
            let depth = |axis: &AxisId| order.iter().position(|own| own == axis).map_or(0, |place| place + 1);
            let own = self.kernel.nodes[value].axes().iter().map(depth).max().unwrap_or(0);
            let operands = self.kernel.operands(value).into_iter().map(|operand| depths[operand.position()]);
            depths[value.position()] = operands.fold(own, usize::max);
            levels[depths[value.position()]].push(value);
        }
        // A value of the last axis alone would be computed once for each turn of the fold.
        let is_repeated = |value: &ValueId| {
            let is_dear = match &self.kernel.nodes[*value] {
                Node::Unary(operator, _) => !matches!(operator, Unary::Negate | Unary::Not),
                Node::Binary(operator, ..) => {
                    matches!(
                        operator,
                        Binary::Divide | Binary::Power | Binary::Remainder | Binary::ArcTangent
                    )
                }
                Node::Mass(..) => true,
                _ => false,
            };
            is_dear && !self.schedule.axes_of(*value).iter().any(|axis| loops.inner.contains(axis))
        };
        if levels[order.len()].iter().any(is_repeated) {
            return None;
        }
        let exchanged =
            Exchanged { out: nest.out, value: nest.value, fold, last, cells, outer, order, levels: &levels };
        Some(self.exchanged(&exchanged, 0))
    }

    fn exchanged(&self, it: &Exchanged<'_>, depth: usize) -> Vec<Statement> {
        let mut made: Vec<Statement> =
            it.levels[depth].iter().flat_map(|value| self.settled(*value)).collect();
        let cell = || Operation::At(Of::Cells.into()).of([Expression::from(Of::Running(it.last))]);
        if depth == it.order.len() {
            let operator = match it.fold {
                Fold::Sum => Binary::Add,
                Fold::Product => Binary::Multiply,
                Fold::Maximum => Binary::Maximum,
            };
            let value = Operation::Binary(Kind::Once, operator).of([cell(), Of::Once(it.value).into()]);
            made.push(Statement::Set(cell(), value));
            return made;
        }
        if depth == it.outer {
            let start = Operation::Constant(Kind::Once, it.fold.start().to_bits()).alone();
            made.push(Statement::Cells(it.cells, start));
        }
        made.push(Statement::For(it.order[depth], self.exchanged(it, depth + 1)));
        if depth == it.outer {
            let name = Of::Folded;
            let store = vec![
                Statement::Let(name.into(), Type::Once, cell()),
                Statement::Store(it.out, self.plane(it.out), name.into()),
            ];
            made.push(Statement::For(it.last, store));
        }
        made
    }
}
