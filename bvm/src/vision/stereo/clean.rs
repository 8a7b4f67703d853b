//! Rejection of estimates without support from their neighbourhood.
//!
//! In: the estimates of all pixels. Out: a subset of them.
//! - *Support*: over a small window, the estimated disparities must match, and most others match clearly worse. In
//!   untextured, saturated or noisy regions they do not: there the estimates only come from the surroundings by the
//!   chain.
//! - *Speckles*: a small connected patch of estimates (neighbours differ by at most one pixel) is a chance match.
//!
//! Invariant: no estimate is added or changed.

use super::{DisparityMap, Support};

/// Half the side of the window of support, pixels.
const SUPPORT_RADIUS: usize = 3;
/// Most average cost of the estimates.
const MOST_COST: i32 = 52;
/// Least share of the disparities that must match clearly worse than the estimate, in 255ths.
const LEAST_WORSE: i32 = 153;
/// Smallest patch that stays, pixels.
const LEAST_PATCH: u32 = 150;
/// Most disparity between neighbours of one patch, pixels.
const PATCH_STEP: f32 = 1.0;

/// Removes the estimates without support in their window.
pub(super) fn drop_unsupported(map: &mut DisparityMap, support: &[Support]) {
    let (width, height) = (map.width, map.height);
    // The margin of each column of the window, in cost and in worse matches; zero beyond the ends of the row.
    let mut columns = vec![[0i32; 2]; width + 2 * SUPPORT_RADIUS];
    let add = |columns: &mut [[i32; 2]], y: usize, sign: i32| {
        let row = &support[y * width..][..width];
        for (sums, Support { cost, worse }) in columns[SUPPORT_RADIUS..].iter_mut().zip(row) {
            // Pixels without an estimate do not count.
            let counts = sign * i32::from(*cost != Support::NONE.cost);
            sums[0] += counts * (MOST_COST - i32::from(*cost));
            sums[1] += counts * (i32::from(*worse) - LEAST_WORSE);
        }
    };
    (0..SUPPORT_RADIUS.min(height)).for_each(|y| add(&mut columns, y, 1));
    for y in 0..height {
        if y + SUPPORT_RADIUS < height {
            add(&mut columns, y + SUPPORT_RADIUS, 1);
        }
        if y > SUPPORT_RADIUS {
            add(&mut columns, y - SUPPORT_RADIUS - 1, -1);
        }
        for (x, window) in columns.windows(2 * SUPPORT_RADIUS + 1).enumerate() {
            let spare = window.iter().fold([0; 2], |[cost, worse], sums| [cost + sums[0], worse + sums[1]]);
            if spare[0] < 0 || spare[1] < 0 {
                map.withdraw(y * width + x);
            }
        }
    }
}

/// Removes small patches.
pub(super) fn drop_speckles(map: &mut DisparityMap) {
    let width = map.width;
    let mut patches = Patches::default();
    // For each pixel of a row, and of the one above, its run; none without an estimate.
    let [mut above, mut here] = [vec![NONE; width], vec![NONE; width]];
    let mut runs = Vec::new();
    for (y, row) in map.disparity.chunks_exact(width).enumerate() {
        for x in 0..width {
            if !row[x].is_finite() {
                here[x] = NONE;
                continue;
            }
            // A run is a connected part of a row.
            if x == 0 || here[x - 1] == NONE || (row[x] - row[x - 1]).abs() > PATCH_STEP {
                patches.parents.push(patches.parents.len() as u32);
                runs.push((y * width + x, 0u32));
            }
            here[x] = patches.parents.len() as u32 - 1;
            runs.last_mut().expect("internal: a run has begun").1 += 1;
        }
        if y > 0 {
            let before = &map.disparity[(y - 1) * width..][..width];
            let mut last = (NONE, NONE);
            for x in 0..width {
                let pair = (here[x], above[x]);
                if pair != last
                    && pair.0 != NONE
                    && pair.1 != NONE
                    && (row[x] - before[x]).abs() <= PATCH_STEP
                {
                    patches.join(pair.0, pair.1);
                    last = pair;
                }
            }
        }
        std::mem::swap(&mut above, &mut here);
    }
    let mut sizes = vec![0u32; runs.len()];
    let roots: Vec<u32> = (0..runs.len() as u32).map(|run| patches.root(run)).collect();
    roots.iter().zip(&runs).for_each(|(root, (_, length))| sizes[*root as usize] += length);
    for (root, (start, length)) in roots.iter().zip(&runs) {
        if sizes[*root as usize] < LEAST_PATCH {
            (*start..*start + *length as usize).for_each(|at| map.withdraw(at));
        }
    }
}

/// No run.
const NONE: u32 = u32::MAX;

/// Union of connected runs: each refers to an earlier run of its patch, or to itself (Tarjan 1975).
#[derive(Default)]
struct Patches {
    parents: Vec<u32>,
}

impl Patches {
    fn root(&mut self, mut run: u32) -> u32 {
        while self.parents[run as usize] != run {
            let above = self.parents[self.parents[run as usize] as usize];
            self.parents[run as usize] = above;
            run = above;
        }
        run
    }

    fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.root(one), self.root(other));
        self.parents[one.max(other) as usize] = one.min(other);
    }
}
