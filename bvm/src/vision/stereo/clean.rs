//! The claims that their neighbourhood does not support are withdrawn.
//!
//! In: the claims of all pixels. Out: the same, fewer.
//! - *Support*: over a small window, the disparities claimed must match clearly better than disparities at
//!   large: their cost is below the mean, and most others are worse. Where the picture is flat, saturated or
//!   mere noise they do not: there the aggregation only carried the surroundings inwards, and nothing was
//!   measured.
//! - *Speckles*: a patch of claims that hang together (neighbours differ by at most one pixel) and is small is
//!   a chance match.
//!
//! Invariant: no claim is added or changed.

use super::Claim;

/// Half the side of the window of support, pixels.
const SUPPORT_RADIUS: usize = 3;
/// Least part of the mean matching cost that the claims must save.
const LEAST_SAVING: f32 = 0.45;
/// Least part of the disparities that must match clearly worse than the one claimed.
const LEAST_WORSE: f32 = 0.7;
/// Least mean matching cost of a window; below, there is nothing to match.
const LEAST_COST: f32 = 4.0;
/// Smallest patch that stays, pixels.
const LEAST_PATCH: usize = 150;
/// Most disparity between neighbours of one patch, pixels.
const PATCH_STEP: f32 = 1.0;

/// Withdraws the claims whose window does not support them.
pub(super) fn drop_unsupported(claims: &mut [Option<Claim>], width: usize) {
    let part = |of: fn(&Claim) -> f32| {
        let values: Vec<f32> = claims.iter().map(|claim| claim.as_ref().map_or(0.0, of)).collect();
        window_sums(&values, width, SUPPORT_RADIUS)
    };
    let paid = part(|claim| f32::from(claim.cost));
    let usual = part(|claim| claim.mean_cost);
    let worse = part(|claim| claim.worse);
    let counts = part(|_| 1.0);
    for (at, claim) in claims.iter_mut().enumerate() {
        let saved = 1.0 - paid[at] / usual[at];
        if !(saved >= LEAST_SAVING
            && worse[at] >= LEAST_WORSE * counts[at]
            && usual[at] >= LEAST_COST * counts[at])
        {
            *claim = None;
        }
    }
}

/// Withdraws small patches.
pub(super) fn drop_speckles(claims: &mut [Option<Claim>], width: usize) {
    let mut seen = vec![false; claims.len()];
    let mut patch = Vec::new();
    for start in 0..claims.len() {
        if seen[start] || claims[start].is_none() {
            continue;
        }
        patch.clear();
        patch.push(start);
        seen[start] = true;
        let mut next = 0;
        while let Some(&at) = patch.get(next) {
            next += 1;
            let Some(here) = claims[at] else { continue };
            for other in neighbours(at, width, claims.len()).into_iter().flatten() {
                if let Some(claim) = claims[other]
                    && !seen[other]
                    && (claim.disparity - here.disparity).abs() <= PATCH_STEP
                {
                    seen[other] = true;
                    patch.push(other);
                }
            }
        }
        if patch.len() < LEAST_PATCH {
            patch.iter().for_each(|&at| claims[at] = None);
        }
    }
}

/// The four neighbours of a pixel that lie inside the image.
fn neighbours(at: usize, width: usize, count: usize) -> [Option<usize>; 4] {
    let x = at % width;
    [
        (x > 0).then(|| at - 1),
        (x + 1 < width).then_some(at + 1),
        at.checked_sub(width),
        (at + width < count).then_some(at + width),
    ]
}

/// Sums over windows of side `2 * radius + 1`, cut at the border.
fn window_sums(values: &[f32], width: usize, radius: usize) -> Vec<f32> {
    let height = values.len() / width;
    let mut rows = vec![0.0; values.len()];
    for (sums, row) in rows.chunks_exact_mut(width).zip(values.chunks_exact(width)) {
        for (x, sum) in sums.iter_mut().enumerate() {
            *sum = row[x.saturating_sub(radius)..(x + radius + 1).min(width)].iter().sum();
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
