//! The claims that their neighbourhood does not support are withdrawn.
//!
//! In: the claims of all pixels. Out: the same, fewer.
//! - *Support*: over a small window, the disparities claimed must match, and most others clearly worse. Where the
//!   picture is flat, saturated or mere noise they do not: there the chains only carried the surroundings inwards,
//!   and nothing was measured.
//! - *Speckles*: a patch of claims that hang together (neighbours differ by at most one pixel) and is small is
//!   a chance match.
//!
//! Invariant: no claim is added or changed.

use super::Claim;

/// Half the side of the window of support, pixels.
const SUPPORT_RADIUS: usize = 3;
/// Most that the claims may cost, on average.
const MOST_COST: f32 = 52.0;
/// Least part of the disparities that must match clearly worse than the one claimed.
const LEAST_WORSE: f32 = 0.6;
/// Smallest patch that stays, pixels.
const LEAST_PATCH: u32 = 150;
/// Most disparity between neighbours of one patch, pixels.
const PATCH_STEP: f32 = 1.0;

/// Withdraws the claims whose window does not support them.
pub(super) fn drop_unsupported(claims: &mut [Option<Claim>], width: usize) {
    // Positive where the claim is supported; none has no say.
    let spare = |of: fn(&Claim) -> f32| {
        let values = claims.iter().map(|claim| claim.as_ref().map_or(0.0, of)).collect();
        window_sums(values, width, SUPPORT_RADIUS)
    };
    let cheap = spare(|claim| MOST_COST - f32::from(claim.cost));
    let worse = spare(|claim| claim.worse - LEAST_WORSE);
    for ((claim, cheap), worse) in claims.iter_mut().zip(&cheap).zip(&worse) {
        *claim = claim.filter(|_| *cheap >= 0.0 && *worse >= 0.0);
    }
}

/// Withdraws small patches.
pub(super) fn drop_speckles(claims: &mut [Option<Claim>], width: usize) {
    let disparities: Vec<f32> =
        claims.iter().map(|claim| claim.map_or(f32::NAN, |claim| claim.disparity)).collect();
    let mut patches = Patches { parents: (0..claims.len() as u32).collect() };
    for at in 0..claims.len() {
        // A comparison with NaN is false: where nothing is claimed, nothing hangs together.
        let near = |other: usize| (disparities[at] - disparities[other]).abs() <= PATCH_STEP;
        if at % width > 0 && near(at - 1) {
            patches.join(at, at - 1);
        }
        if at >= width && near(at - width) {
            patches.join(at, at - width);
        }
    }
    let mut sizes = vec![0u32; claims.len()];
    let roots: Vec<usize> = (0..claims.len()).map(|at| patches.root(at)).collect();
    roots.iter().for_each(|root| sizes[*root] += 1);
    for (claim, root) in claims.iter_mut().zip(&roots) {
        *claim = claim.filter(|_| sizes[*root] >= LEAST_PATCH);
    }
}

/// Which pixels hang together: each names one of its patch that comes earlier, or itself (Tarjan 1975).
struct Patches {
    parents: Vec<u32>,
}

impl Patches {
    fn root(&mut self, mut at: usize) -> usize {
        while self.parents[at] as usize != at {
            let above = self.parents[self.parents[at] as usize];
            self.parents[at] = above;
            at = above as usize;
        }
        at
    }

    fn join(&mut self, one: usize, other: usize) {
        if self.parents[one] == self.parents[other] {
            return;
        }
        let (one, other) = (self.root(one), self.root(other));
        self.parents[one.max(other)] = one.min(other) as u32;
    }
}

/// Sums over windows of side `2 * radius + 1`, cut at the border.
fn window_sums(values: Vec<f32>, width: usize, radius: usize) -> Vec<f32> {
    let height = values.len() / width;
    let mut rows = vec![0.0; values.len()];
    for (sums, row) in rows.chunks_exact_mut(width).zip(values.chunks_exact(width)) {
        for offset in 0..=radius.min(width - 1) {
            let (near, far) = (&row[..width - offset], &row[offset..]);
            sums.iter_mut().zip(far).for_each(|(sum, value)| *sum += value);
            if offset > 0 {
                sums[offset..].iter_mut().zip(near).for_each(|(sum, value)| *sum += value);
            }
        }
    }
    let mut sums = vec![0.0; values.len()];
    for (y, out) in sums.chunks_exact_mut(width).enumerate() {
        for other in y.saturating_sub(radius)..(y + radius + 1).min(height) {
            out.iter_mut().zip(&rows[other * width..]).for_each(|(sum, value)| *sum += value);
        }
    }
    sums
}
