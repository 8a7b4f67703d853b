//! Derivatives of a tape by reverse accumulation.
//!
//! In: a finished tape, rows, the values of slots. Out: the sum of a node over the rows, and its derivatives by all slots. Invariant: a
//! step (a comparison, `floor`) has slope 0, and a choice that of the branch taken.
//!
//! From the last node to the first, x̄ = Σ ȳ ∂y/∂x over the nodes y that read x: all derivatives for the price of a few evaluations
//! (Linnainmaa, *BIT* 16:146-160, 1976; Griewank and Walther, *Evaluating Derivatives*, 2008).

use super::super::dual::{slope_of, slopes_of};
use super::{BLOCK, Node, Step, Tape};
use crate::operators::{Binary, Mass, OPERANDS, Unary};

/// Memory for the numbers of nodes, and for the derivatives by them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    pub(crate) numbers: Vec<f64>,
    derivatives: Vec<f64>,
}

impl Tape {
    /// Finds the nodes that depend on a slot.
    pub(super) fn find_moves(&mut self) {
        self.moves = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let mut moves = matches!(step, Step::Slot(_) | Step::Slots(_));
            let is_step = match step {
                Step::Unary(operator, _) => matches!(operator, Unary::Floor | Unary::Ceiling | Unary::Round),
                Step::Binary(operator, ..) => {
                    operator.compares() || matches!(operator, Binary::And | Binary::Or)
                }
                _ => false,
            };
            if !is_step {
                step.each_operand(|operand| moves |= self.moves[operand]);
            }
            self.moves.push(moves);
        }
    }

    /// As [`Tape::sum`]; also adds the derivatives by slots of Σ seed · node over the rows.
    pub(in super::super) fn slopes(
        &self,
        [summed, holds]: [Node; 2],
        rows: &[u32],
        values: &[f64],
        seed: Seed<'_>,
        cells: &mut Cells,
        slopes: &mut [f64],
    ) -> (f64, bool) {
        let length = self.steps.len() * BLOCK;
        if cells.numbers.len() < length {
            cells.numbers.resize(length, 0.0);
        }
        if cells.derivatives.len() < length {
            cells.derivatives.resize(length, 0.0);
        }
        let Cells { numbers, derivatives } = cells;
        let width = rows.len().min(BLOCK);
        for node in (0..self.steps.len()).filter(|node| !self.varies[*node]) {
            self.compute(node, &rows[..width.min(1)], values, numbers);
            let number = numbers[node * BLOCK];
            numbers[node * BLOCK..node * BLOCK + width].fill(number);
            derivatives[node * BLOCK] = 0.0;
        }
        let (mut sum, mut all) = (0.0, true);
        for rows in rows.chunks(BLOCK) {
            for node in (0..self.steps.len()).filter(|node| self.varies[*node]) {
                self.compute(node, rows, values, numbers);
                derivatives[node * BLOCK..][..rows.len()].fill(0.0);
            }
            sum += numbers[summed * BLOCK..][..rows.len()].iter().sum::<f64>();
            all &= numbers[holds * BLOCK..][..rows.len()].iter().all(|holds| *holds != 0.0);
            for (at, row) in rows.iter().enumerate() {
                let seed = match seed {
                    Seed::One => 1.0,
                    Seed::Slots(slots) => slopes[slots[*row as usize]],
                };
                derivatives[summed * BLOCK + if self.varies[summed] { at } else { 0 }] += seed;
            }
            for node in (0..=summed).rev().filter(|node| self.varies[*node] && self.moves[*node]) {
                self.accumulate(node, rows, numbers, derivatives, slopes);
            }
        }
        for node in (0..=summed).rev().filter(|node| !self.varies[*node] && self.moves[*node]) {
            self.accumulate(node, &rows[..width.min(1)], numbers, derivatives, slopes);
        }
        (sum, all)
    }

    /// Adds the derivative by a node, times the slopes of its operation, to those by its operands.
    fn accumulate(
        &self,
        node: Node,
        rows: &[u32],
        numbers: &[f64],
        derivatives: &mut [f64],
        slopes: &mut [f64],
    ) {
        let (before, own) = derivatives.split_at_mut(node * BLOCK);
        let own = &own[..rows.len()];
        let number = |operand: Node, row: usize| numbers[operand * BLOCK + row];
        // In a row that has no part in the sum, a slope that is infinite has none either.
        let live = || own.iter().copied().enumerate().filter(|(_, derivative)| *derivative != 0.0);
        let mut add = |operand: Node, row: usize, amount: f64| {
            before[operand * BLOCK + if self.varies[operand] { row } else { 0 }] += amount;
        };
        match &self.steps[node] {
            Step::Constant(_) | Step::Column(_) => {}
            Step::Slot(slot) => slopes[*slot] += own.first().copied().unwrap_or(0.0),
            Step::Slots(slots) => live().for_each(|(row, own)| slopes[slots[rows[row] as usize]] += own),
            Step::Unary(operator, x) => {
                for (row, own) in live() {
                    add(*x, row, own * slope_of(*operator, number(*x, row), number(node, row)));
                }
            }
            Step::Binary(operator, x, y) => {
                let (by_x, by_y) = (self.moves[*x], self.moves[*y]);
                for (row, own) in live() {
                    let slopes = slopes_of(*operator, number(*x, row), number(*y, row), number(node, row));
                    if by_x {
                        add(*x, row, own * slopes[0]);
                    }
                    if by_y {
                        add(*y, row, own * slopes[1]);
                    }
                }
            }
            Step::Select([condition, then, otherwise]) => {
                for (row, own) in live() {
                    add(if number(*condition, row) != 0.0 { *then } else { *otherwise }, row, own);
                }
            }
            Step::Mass(law, operands) => {
                for (row, own) in live() {
                    let at = operands.map(|operand| number(operand, row));
                    for (place, operand) in operands.iter().enumerate().filter(|(_, x)| self.moves[**x]) {
                        add(*operand, row, own * mass_slope(*law, at, place));
                    }
                }
            }
        }
    }
}

/// What the derivatives of the rows are multiplied by.
#[derive(Clone, Copy)]
pub(in super::super) enum Seed<'s> {
    /// By 1.
    One,
    /// By the derivatives by these slots, one for each row.
    Slots(&'s [usize]),
}

/// The derivative of a mass by one operand, by differences of fourth order.
fn mass_slope(law: Mass, at: [f64; OPERANDS], place: usize) -> f64 {
    let step = 1e-3 * at[place].abs().max(1e-3);
    let moved = |steps: f64| {
        let mut moved = at;
        moved[place] += steps * step;
        law.apply(moved)
    };
    (8.0 * (moved(1.0) - moved(-1.0)) - (moved(2.0) - moved(-2.0))) / (12.0 * step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::Arithmetic;

    /// Σ over 100 rows of c x₀ exp(−xᵣ x₀) + max(x₀, xᵣ)² / x₀, with a condition that is always true; each row has a c and a slot
    /// of its own. By hand: ∂/∂xᵣ = −c x₀² e^(−xᵣ x₀) + 2 xᵣ / x₀ where xᵣ > x₀, and ∂/∂x₀ is the sum of
    /// c (1 − x₀ xᵣ) e^(−xᵣ x₀), and of 1 where x₀ is the larger and −xᵣ²/x₀² elsewhere.
    #[test]
    fn derivatives_are_those_by_hand() {
        let rows = 100;
        let mut tape = Tape::new(rows);
        let coefficients: Vec<f64> = (0..rows).map(|row| 0.5 + row as f64 / 10.0).collect();
        let shared = tape.slots(vec![0; rows]);
        let own = tape.slots((1..=rows).collect());
        let c = tape.column(coefficients.clone());
        let product = tape.multiply(own, shared);
        let minus = tape.unary(Unary::Negate, product);
        let decay = tape.exp(minus);
        let scaled = tape.multiply(c, shared);
        let first = tape.multiply(scaled, decay);
        let most = tape.binary(Binary::Maximum, shared, own);
        let two = tape.constant(2.0);
        let square = tape.binary(Binary::Power, most, two);
        let ratio = tape.divide(square, shared);
        let all = tape.add(first, ratio);
        let zero = tape.constant(0.0);
        let positive = tape.greater(shared, zero);
        let all = tape.select(positive, all, zero);
        let one = tape.constant(1.0);
        let wanted = tape.finish(&[all, one]);
        let mut values = vec![0.7];
        values.extend((0..rows).map(|row| 0.1 + row as f64 / 60.0));
        let named: Vec<u32> = (0..rows as u32).filter(|row| row % 3 > 0).collect();
        let mut slopes = vec![0.0; rows + 1];
        let (sum, _) = tape.slopes(
            [wanted[0], wanted[1]],
            &named,
            &values,
            Seed::One,
            &mut Cells::default(),
            &mut slopes,
        );
        assert_eq!(sum, tape.sum([wanted[0], wanted[1]], &named, &values, &mut Vec::new()).0);
        let x = values[0];
        let mut by_shared = 0.0;
        for row in 0..rows {
            let (c, y) = (coefficients[row], values[row + 1]);
            let is_named = row % 3 > 0;
            let decay = (-x * y).exp();
            let by_own = -c * x * x * decay + if y > x { 2.0 * y / x } else { 0.0 };
            let expected = if is_named { by_own } else { 0.0 };
            assert!((slopes[row + 1] - expected).abs() < 1e-12 * expected.abs().max(1.0), "row {row}");
            if is_named {
                by_shared += c * (1.0 - x * y) * decay + if x >= y { 1.0 } else { -y * y / x / x };
            }
        }
        assert!(
            (slopes[0] - by_shared).abs() < 1e-12 * by_shared.abs(),
            "{}, expected {by_shared}",
            slopes[0]
        );
    }
}
