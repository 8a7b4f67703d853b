//! The product of two tables, summed over the axes that the result lacks: Z[z] = Σ X[x] · Y[y].
//!
//! In: the axes of three tables, the last few of which are contiguous. Out: a [`Contraction`]: loops over four kinds of
//! axes and a row. Invariant: each cell of Z is summed in the same order for any number of threads.
//!
//! An axis is in two of the tables or in all three: *batch* in all, *left* in X and Z, *right* in Y and Z, *summed* in
//! X and Y. For each kind of axes a list of offsets locates the cells in each table. The row is the rest: cells that
//! are contiguous in each table that has them. On the way up, Z is the product of two children; on the way down, the
//! derivative by one of them.

use crate::exec::scalar::Scalar;
use crate::radix;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

/// The axes of a table, slowest first.
pub(super) type Axes = [u32];

/// Loops over one kind of axes: the number of iterations, and where in the pool the offsets of each table begin.
#[derive(Clone, Copy, Debug, Default)]
struct Loop {
    count: u32,
    x: u32,
    y: u32,
    z: u32,
}

/// Which tables contain the row.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Row {
    /// All.
    Each,
    /// X and Z: each cell of Y multiplies a row.
    Scaled,
    /// X and Y: a cell of Z is a sum over rows.
    Dot,
}

/// The product of two tables.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contraction {
    batch: Loop,
    left: Loop,
    right: Loop,
    summed: Loop,
    row: Row,
    length: u32,
    /// Whether X and Y are exchanged.
    swapped: bool,
    /// The slowest axes of Z that are of one kind: (0 batch, 1 left, 2 right; the number of parts they make).
    parts: (u8, u32),
    /// The number of products of two cells.
    pub(super) cells: f64,
}

/// The offsets of all contractions of a tree.
#[derive(Clone, Debug)]
pub(super) struct Pool {
    offsets: Vec<u32>,
}

impl Pool {
    pub(super) fn new() -> Self {
        // The offsets of an empty list of axes.
        Self { offsets: vec![0] }
    }

    /// The offsets of some axes in a table, the last axis fastest.
    fn along(&mut self, axes: &Axes, table: &Axes, cardinalities: &[usize]) -> u32 {
        if axes.is_empty() {
            return 0;
        }
        let start = self.offsets.len();
        let extent = |one: &u32| cardinalities[*one as usize];
        let axes = axes.iter().map(|axis| (extent(axis), radix::stride(table, axis, extent))).collect();
        self.offsets.extend(radix::offsets(axes).map(|offset| offset as u32));
        start as u32
    }

    fn at(&self, start: u32, count: u32) -> &[u32] {
        &self.offsets[start as usize..(start + count) as usize]
    }
}

impl Contraction {
    /// The product of tables with these axes; `row` lists the contiguous axes and may be empty.
    pub(super) fn of(
        z: &Axes,
        x: &Axes,
        y: &Axes,
        row: &Axes,
        cardinalities: &[usize],
        pool: &mut Pool,
    ) -> Self {
        let inside = |table: &Axes| row.first().is_some_and(|axis| table.contains(axis));
        // A row that only one of X and Y contains must be in X.
        let swapped = !row.is_empty() && !inside(x);
        let (x, y) = if swapped { (y, x) } else { (x, y) };
        let mut kinds: [Vec<u32>; 4] = Default::default();
        let mut leading = None;
        for axis in z.iter().filter(|axis| !row.contains(axis)) {
            let kind = match (x.contains(axis), y.contains(axis)) {
                (true, true) => 0,
                (true, false) => 1,
                _ => 2,
            };
            kinds[kind].push(*axis);
            let extent = cardinalities[*axis as usize] as u32;
            leading = match leading {
                None => Some((kind as u8, extent, true)),
                Some((first, parts, true)) if usize::from(first) == kind && parts < PARTS => {
                    Some((first, parts * extent, true))
                }
                Some((first, parts, _)) => Some((first, parts, false)),
            };
        }
        kinds[3].extend(x.iter().filter(|axis| !row.contains(axis) && !z.contains(axis)));
        let count =
            |axes: &Axes| axes.iter().map(|one| cardinalities[*one as usize]).product::<usize>() as u32;
        let mut along = |axes: &Axes, table: &Axes| pool.along(axes, table, cardinalities);
        let [batch, left, right, summed] = &kinds;
        let batch = Loop { count: count(batch), x: along(batch, x), y: along(batch, y), z: along(batch, z) };
        let left = Loop { count: count(left), x: along(left, x), y: 0, z: along(left, z) };
        let right = Loop { count: count(right), x: 0, y: along(right, y), z: along(right, z) };
        let summed = Loop { count: count(summed), x: along(summed, x), y: along(summed, y), z: 0 };
        let length = count(row);
        let row = match (inside(y), inside(z)) {
            _ if row.is_empty() => Row::Dot,
            (true, true) => Row::Each,
            (false, _) => Row::Scaled,
            (true, false) => Row::Dot,
        };
        let cells = [batch, left, right, summed].iter().map(|one| f64::from(one.count)).product::<f64>();
        let parts = leading.map_or((0, 1), |(kind, parts, _)| (kind, parts));
        Self { batch, left, right, summed, row, length, swapped, parts, cells: cells * f64::from(length) }
    }

    /// Sets Z to the product of X and Y. Cells of Z may remain zero where `mask` is zero.
    pub(super) fn run<T: Scalar, const MAXIMUM: bool>(
        &self,
        pool: &Pool,
        x: &[T],
        y: &[T],
        z: &mut [T],
        mask: Option<&[T]>,
    ) {
        let (x, y) = if self.swapped { (y, x) } else { (x, y) };
        if self.cells < WORTH_SHARING || self.parts.1 < 2 {
            return self.part(Rows::<T, MAXIMUM> { contraction: self, pool, x, y, z, mask, base: 0 });
        }
        let size = z.len() / self.parts.1 as usize;
        z.par_chunks_mut(size).enumerate().for_each(|(part, z)| {
            let mut own = *self;
            let (kinds, base) = ([&mut own.batch, &mut own.left, &mut own.right], part * size);
            let [batch, left, right] = kinds;
            let kind =
                [batch, left, right].into_iter().nth(self.parts.0.into()).expect("internal: one of three");
            kind.count /= self.parts.1;
            let skip = part as u32 * kind.count;
            let has = |start: u32| if start == 0 { 0 } else { start + skip };
            (kind.x, kind.y, kind.z) = (has(kind.x), has(kind.y), has(kind.z));
            let mask = mask.map(|mask| &mask[base..base + size]);
            own.part(Rows::<T, MAXIMUM> { contraction: &own, pool, x, y, z, mask, base: base as u32 });
        });
    }

    /// The cells of Z from `base` on.
    fn part<T: Scalar, const MAXIMUM: bool>(&self, rows: Rows<'_, T, MAXIMUM>) {
        match self.length {
            1 => rows.nest::<1>(),
            2 => rows.nest::<2>(),
            3 => rows.nest::<3>(),
            4 => rows.nest::<4>(),
            // Uses the widest SIMD instructions of the processor. All of them sum in the same order.
            _ => pulp::Arch::new().dispatch(rows),
        }
    }
}

/// A part of a product: the cells of Z from `base` on.
struct Rows<'r, T, const MAXIMUM: bool> {
    contraction: &'r Contraction,
    pool: &'r Pool,
    x: &'r [T],
    y: &'r [T],
    z: &'r mut [T],
    mask: Option<&'r [T]>,
    base: u32,
}

impl<T: Scalar, const MAXIMUM: bool> NullaryFnOnce for Rows<'_, T, MAXIMUM> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.nest::<0>();
    }
}

impl<T: Scalar, const MAXIMUM: bool> Rows<'_, T, MAXIMUM> {
    /// The loops; `LENGTH` is the length of a row if known at compile time, else 0.
    #[inline(always)]
    fn nest<const LENGTH: usize>(self) {
        let Self { contraction, pool, x, y, z, mask, base } = self;
        let length = if LENGTH == 0 { contraction.length as usize } else { LENGTH };
        let of = |kind: &Loop| {
            [kind.x, kind.y, kind.z].map(|start| pool.at(start, if start == 0 { 1 } else { kind.count }))
        };
        let ([batch_x, batch_y, batch_z], [left_x, _, left_z]) =
            (of(&contraction.batch), of(&contraction.left));
        let ([_, right_y, right_z], [summed_x, summed_y, _]) =
            (of(&contraction.right), of(&contraction.summed));
        for ((batch_x, batch_y), batch_z) in batch_x.iter().zip(batch_y).zip(batch_z) {
            for (left_x, left_z) in left_x.iter().zip(left_z) {
                let x = &x[(batch_x + left_x) as usize..];
                for (right_y, right_z) in right_y.iter().zip(right_z) {
                    let y = &y[(batch_y + right_y) as usize..];
                    let place = (batch_z + left_z + right_z - base) as usize;
                    let summed = summed_x.iter().zip(summed_y);
                    match contraction.row {
                        Row::Dot => {
                            let mut total = T::ZERO;
                            if mask.is_none_or(|mask| mask[place] != T::ZERO) {
                                for (at_x, at_y) in summed {
                                    let one = &x[*at_x as usize..][..length];
                                    let other = &y[*at_y as usize..][..length];
                                    total = fold::<T, MAXIMUM>(total, dot::<T, LENGTH, MAXIMUM>(one, other));
                                }
                            }
                            z[place] = total;
                        }
                        Row::Scaled => {
                            let row = &mut z[place..][..length];
                            row.fill(T::ZERO);
                            for (at_x, at_y) in summed {
                                let factor = y[*at_y as usize];
                                if factor != T::ZERO {
                                    let from = &x[*at_x as usize..][..length];
                                    for (cell, one) in row.iter_mut().zip(from) {
                                        *cell = fold::<T, MAXIMUM>(*cell, *one * factor);
                                    }
                                }
                            }
                        }
                        Row::Each => {
                            let row = &mut z[place..][..length];
                            row.fill(T::ZERO);
                            for (at_x, at_y) in summed {
                                let one = &x[*at_x as usize..][..length];
                                let other = &y[*at_y as usize..][..length];
                                for ((cell, one), other) in row.iter_mut().zip(one).zip(other) {
                                    *cell = fold::<T, MAXIMUM>(*cell, *one * *other);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The number of parts into which a large product is divided, approximately.
const PARTS: u32 = 16;

/// The least number of products that another thread computes faster than this one.
pub(super) const WORTH_SHARING: f64 = 1e5;

#[inline(always)]
fn fold<T: Scalar, const MAXIMUM: bool>(total: T, term: T) -> T {
    if MAXIMUM { if term > total { term } else { total } } else { total + term }
}

/// Σ one · other; long rows use eight partial sums.
#[inline(always)]
fn dot<T: Scalar, const LENGTH: usize, const MAXIMUM: bool>(one: &[T], other: &[T]) -> T {
    let add = |total: T, (one, other): (&T, &T)| fold::<T, MAXIMUM>(total, *one * *other);
    if LENGTH != 0 || one.len() < 8 {
        return one.iter().zip(other).fold(T::ZERO, add);
    }
    let (ones, others) = (one.chunks_exact(8), other.chunks_exact(8));
    let rest = ones.remainder().iter().zip(others.remainder());
    let mut total = rest.fold(T::ZERO, add);
    let mut lanes = [T::ZERO; 8];
    for (one, other) in ones.zip(others) {
        for ((lane, one), other) in lanes.iter_mut().zip(one).zip(other) {
            *lane = fold::<T, MAXIMUM>(*lane, *one * *other);
        }
    }
    lanes.iter().for_each(|lane| total = fold::<T, MAXIMUM>(total, *lane));
    total
}
