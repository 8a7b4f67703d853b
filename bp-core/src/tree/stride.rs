//! Where the cells of a clique lie in a smaller table.
//!
//! In: the axes of a clique, and the strides of a table over some of them. Out: a [`Reach`]: the table's offset at the
//! first cell of each block, and within a block. Invariant: a block is the cells of the clique's last axes; the offset of
//! cell (block o, place j) is `outer[o] + inner[j]`.

/// How a table's offset moves within a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Step {
    /// It stays.
    Still,
    /// It moves with the cells.
    Along,
    /// It stays for some cells, then moves to the next: (cells, moves).
    Runs(usize),
    /// It moves along some cells, then starts again.
    Again(usize),
    /// As `inner` says.
    Gather,
}

/// Where the cells of a clique lie in a table.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    outer: Vec<u32>,
    inner: Vec<u32>,
    step: Step,
}

/// How the cells of a clique are cut into blocks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Blocks {
    /// The values of each axis, slowest first.
    extents: Vec<usize>,
    /// How many axes lie outside the blocks.
    split: usize,
    /// How many blocks.
    pub(super) count: usize,
    /// Cells of a block.
    pub(super) width: usize,
}

/// A block is not shorter than this, where the clique is not.
const SHORTEST: usize = 64;

impl Blocks {
    pub(super) fn of(extents: Vec<usize>) -> Self {
        let (mut split, mut width) = (extents.len(), 1);
        while split > 0 && width < SHORTEST {
            split -= 1;
            width *= extents[split];
        }
        let count = extents[..split].iter().product();
        Self { extents, split, count, width }
    }

    pub(super) fn cells(&self) -> usize {
        self.count * self.width
    }

    /// The offsets of a table that has these strides along the axes; 0 along those that it does not have.
    pub(super) fn reach(&self, strides: &[usize]) -> Reach {
        let outer = offsets(&self.extents[..self.split], &strides[..self.split]);
        let inner = offsets(&self.extents[self.split..], &strides[self.split..]);
        let step = step_of(&inner);
        Reach { outer, inner, step }
    }
}

/// All offsets of an odometer.
fn offsets(extents: &[usize], strides: &[usize]) -> Vec<u32> {
    let mut all = vec![0u32];
    for (extent, stride) in extents.iter().zip(strides) {
        let next = |offset: &u32| {
            let offset = *offset;
            (0..*extent).map(move |value| offset + (value * stride) as u32)
        };
        all = all.iter().flat_map(next).collect();
    }
    all
}

fn step_of(inner: &[u32]) -> Step {
    let runs =
        |length: usize| inner.iter().enumerate().all(|(place, offset)| *offset as usize == place / length);
    let again =
        |length: usize| inner.iter().enumerate().all(|(place, offset)| *offset as usize == place % length);
    if inner.iter().all(|offset| *offset == 0) {
        return Step::Still;
    }
    if again(inner.len()) {
        return Step::Along;
    }
    let length = inner.iter().take_while(|offset| **offset == 0).count();
    if length > 1 && runs(length) {
        return Step::Runs(length);
    }
    let period = inner.iter().skip(1).position(|offset| *offset == 0).map_or(inner.len(), |place| place + 1);
    if period > 1 && again(period) { Step::Again(period) } else { Step::Gather }
}

impl Reach {
    /// block[j] *= table[…]
    #[inline]
    pub(super) fn multiply(&self, block: &mut [f64], number: usize, table: &[f64], base: usize) {
        let table = &table[base + self.outer[number] as usize..];
        match self.step {
            Step::Still => {
                let factor = table[0];
                block.iter_mut().for_each(|cell| *cell *= factor);
            }
            Step::Along => block.iter_mut().zip(table).for_each(|(cell, factor)| *cell *= factor),
            Step::Runs(length) => {
                for (run, factor) in block.chunks_exact_mut(length).zip(table) {
                    run.iter_mut().for_each(|cell| *cell *= factor);
                }
            }
            Step::Again(length) => {
                let table = &table[..length];
                for run in block.chunks_exact_mut(length) {
                    run.iter_mut().zip(table).for_each(|(cell, factor)| *cell *= factor);
                }
            }
            Step::Gather => {
                block.iter_mut().zip(&self.inner).for_each(|(cell, place)| *cell *= table[*place as usize]);
            }
        }
    }

    /// block[j] = table[…]
    #[inline]
    pub(super) fn copy(&self, block: &mut [f64], number: usize, table: &[f64], base: usize) {
        block.fill(1.0);
        self.multiply(block, number, table, base);
    }

    /// table[…] += block[j]
    #[inline]
    pub(super) fn add(&self, block: &[f64], number: usize, table: &mut [f64]) {
        let table = &mut table[self.outer[number] as usize..];
        match self.step {
            Step::Still => table[0] += sum(block),
            Step::Along => table.iter_mut().zip(block).for_each(|(total, cell)| *total += cell),
            Step::Runs(length) => {
                for (run, total) in block.chunks_exact(length).zip(table) {
                    *total += sum(run);
                }
            }
            Step::Again(length) => {
                let table = &mut table[..length];
                for run in block.chunks_exact(length) {
                    table.iter_mut().zip(run).for_each(|(total, cell)| *total += cell);
                }
            }
            Step::Gather => {
                block.iter().zip(&self.inner).for_each(|(cell, place)| table[*place as usize] += cell);
            }
        }
    }

    /// table[…] = max(table[…], block[j])
    pub(super) fn maximise(&self, block: &[f64], number: usize, table: &mut [f64]) {
        let table = &mut table[self.outer[number] as usize..];
        for (cell, place) in block.iter().zip(&self.inner) {
            let best = &mut table[*place as usize];
            *best = best.max(*cell);
        }
    }

    /// The offset of one cell.
    pub(super) fn offset(&self, number: usize, place: usize) -> usize {
        (self.outer[number] + self.inner[place]) as usize
    }
}

/// Σ by four partial sums.
fn sum(cells: &[f64]) -> f64 {
    let (quads, rest) = cells.as_chunks::<4>();
    let mut totals = [0.0; 4];
    for quad in quads {
        totals.iter_mut().zip(quad).for_each(|(total, cell)| *total += cell);
    }
    (totals[0] + totals[1]) + (totals[2] + totals[3]) + rest.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_finds_its_place() {
        // A clique over (a, b, c) with 3, 40 and 5 values; tables over some of them.
        let blocks = Blocks::of(vec![3, 40, 5]);
        assert_eq!((blocks.count, blocks.width), (3, 200));
        for (strides, length) in [
            ([0, 0, 0], 1),
            ([200, 5, 1], 600),
            ([0, 5, 1], 200),
            ([40, 1, 0], 120),
            ([5, 0, 1], 15),
            ([0, 1, 40], 200),
        ] {
            let reach = blocks.reach(&strides);
            let table: Vec<f64> = (0..length).map(|place| 1.0 + f64::from(place)).collect();
            let mut totals = vec![0.0; length as usize];
            let mut expected = vec![0.0; length as usize];
            for a in 0..3 {
                let mut block = vec![2.0; 200];
                reach.multiply(&mut block, a, &table, 0);
                for (place, cell) in block.iter().enumerate() {
                    let at = a * strides[0] + (place / 5) * strides[1] + (place % 5) * strides[2];
                    assert_eq!(*cell, 2.0 * table[at], "{strides:?} {a} {place}");
                    assert_eq!(reach.offset(a, place), at);
                    expected[at] += cell;
                }
                reach.add(&block, a, &mut totals);
            }
            assert_eq!(totals, expected, "{strides:?}");
        }
    }
}
