//! The order of the axes of each table.
//!
//! In: a binary join tree. Out: the order of the axes of every node, and for each product the axes of its row.
//! Invariant: a row is contiguous in each of the three tables that contain it, so the way up and both ways down work on
//! rows.
//!
//! From the root down: part of a node's order is fixed by the product that uses it, part is free. Of the kinds of axes
//! in a product, the row is made of those with the least estimated time; a sparse table is best the one whose single
//! cells multiply rows, since a zero there saves a whole row.

use super::pair::Pairing;

/// The axes of all nodes, slowest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    pub(super) axes: Vec<Vec<u32>>,
    /// For each inner node the axes of the row of its product.
    pub(super) rows: Vec<Vec<u32>>,
}

const FIRST: u8 = 1;
const SECOND: u8 = 2;

/// Lays out a tree; `density` is the share of nonzero cells of each leaf.
pub(super) fn lay_out(pairing: &Pairing, cardinalities: &[usize], density: &[f64]) -> Layout {
    let count = pairing.nodes.len();
    let density = densities(pairing, cardinalities, density);
    let mut layout = Layout { axes: vec![Vec::new(); count], rows: vec![Vec::new(); count] };
    let mut fixed = vec![0; count];
    let mut member = vec![0u8; cardinalities.len()];
    for number in (0..count).rev() {
        let node = &pairing.nodes[number];
        if node.parent == number {
            layout.axes[number] = node.scope.clone();
        }
        let Some((first, second)) = node.children else { continue };
        let (one, other) = (&pairing.nodes[first].scope, &pairing.nodes[second].scope);
        one.iter().for_each(|axis| member[*axis as usize] |= FIRST);
        other.iter().for_each(|axis| member[*axis as usize] |= SECOND);
        let own = std::mem::take(&mut layout.axes[number]);
        let is_summed = |axis: &u32| node.scope.binary_search(axis).is_err();
        let summed: Vec<u32> = one.iter().copied().filter(is_summed).collect();
        let kinds =
            Kinds { member: &member, cardinalities, own: &own, fixed: fixed[number], summed: &summed };
        let row = kinds.row(density[first], density[second]);
        let free = &own[..own.len() - fixed[number]];
        let kept = |axis: &&u32| !row.contains(axis);
        let of = |kind: u8| {
            let axes = free.iter().copied();
            let own = axes.filter(|axis| member[*axis as usize] == kind && !row.contains(axis));
            own.collect::<Vec<u32>>()
        };
        let (batch, left, right) = (of(FIRST | SECOND), of(FIRST), of(SECOND));
        let tail: Vec<u32> = own[free.len()..].iter().copied().filter(|axis| !row.contains(axis)).collect();
        let inside = |axes: &[u32]| row.first().is_some_and(|axis| axes.contains(axis));
        let mut axes = [batch.as_slice(), &left, &right, &tail].concat();
        if inside(&own) {
            axes.extend_from_slice(&row);
        }
        let child = |kind: u8, scope: &[u32]| {
            let shared = axes.iter().copied().filter(|axis| member[*axis as usize] & kind != 0);
            let mut wish: Vec<u32> = shared.filter(|axis| !row.contains(axis)).collect();
            wish.extend(summed.iter().filter(kept));
            let has = inside(scope);
            if has {
                wish.extend_from_slice(&row);
            }
            (wish, if has { row.len() } else { 0 })
        };
        (layout.axes[first], fixed[first]) = child(FIRST, one);
        (layout.axes[second], fixed[second]) = child(SECOND, other);
        one.iter().chain(other).for_each(|axis| member[*axis as usize] = 0);
        layout.axes[number] = axes;
        layout.rows[number] = row;
    }
    layout
}

/// The share of nonzero cells of each node, estimated as if zeros were placed at random.
fn densities(pairing: &Pairing, cardinalities: &[usize], leaves: &[f64]) -> Vec<f64> {
    let mut all = Vec::with_capacity(pairing.nodes.len());
    for node in &pairing.nodes {
        all.push(match (node.children, &node.leaf) {
            (Some((first, second)), _) => {
                let scope = &pairing.nodes[first].scope;
                let summed = scope.iter().filter(|axis| node.scope.binary_search(axis).is_err());
                let count: f64 = summed.map(|axis| cardinalities[*axis as usize] as f64).product();
                let term: f64 = all[first] * all[second];
                1.0 - (1.0 - term).powf(count)
            }
            (None, Some((leaf, _))) => leaves[*leaf],
            (None, None) => 1.0,
        });
    }
    all
}

/// The axes of one product.
struct Kinds<'l> {
    /// Which of the two children have each axis.
    member: &'l [u8],
    cardinalities: &'l [usize],
    /// The axes of the product; the positions of the last `fixed` are determined.
    own: &'l [u32],
    fixed: usize,
    summed: &'l [u32],
}

impl Kinds<'_> {
    fn kind(&self, axis: u32) -> u8 {
        self.member[axis as usize]
    }

    fn cells(&self, axes: &[u32]) -> f64 {
        axes.iter().map(|axis| self.cardinalities[*axis as usize] as f64).product()
    }

    /// The axes of the row with the least estimated time.
    fn row(&self, first: f64, second: f64) -> Vec<u32> {
        let mut rows: Vec<(Vec<u32>, f64)> = Vec::new();
        if !self.summed.is_empty() {
            rows.push((self.summed.to_vec(), 1.0));
        }
        let free = &self.own[..self.own.len() - self.fixed];
        let all = |kind: u8| free.iter().copied().filter(move |axis| self.kind(*axis) == kind);
        // A row of the first child's axes is multiplied by single cells of the second.
        let multiplier = |kind: u8| match kind {
            FIRST => second,
            SECOND => first,
            _ => 1.0,
        };
        match self.own.last().filter(|_| self.fixed > 0) {
            None => rows.extend(
                [FIRST, SECOND, FIRST | SECOND]
                    .map(|kind| (all(kind).collect::<Vec<u32>>(), multiplier(kind)))
                    .into_iter()
                    .filter(|(axes, _)| !axes.is_empty()),
            ),
            Some(last) => {
                let kind = self.kind(*last);
                let tail = &self.own[free.len()..];
                let start =
                    tail.iter().rposition(|axis| self.kind(*axis) != kind).map_or(0, |place| place + 1);
                // If all fixed axes are of this kind, the free ones of the kind can join the row.
                let more: Vec<u32> = if start == 0 { all(kind).collect() } else { Vec::new() };
                rows.push(([more.as_slice(), &tail[start..]].concat(), multiplier(kind)));
            }
        }
        let union = self.cells(self.own) * self.cells(self.summed);
        let time = |(axes, density): &(Vec<u32>, f64)| {
            let count = union / self.cells(axes);
            // In nanoseconds, roughly: the cost of a row plus that of its cells.
            count * 0.7 + density * (count * 2.5 + union * 0.35)
        };
        let best = rows.into_iter().min_by(|one, other| time(one).total_cmp(&time(other)));
        best.map(|(axes, _)| axes).unwrap_or_default()
    }
}
