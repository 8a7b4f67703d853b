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

use super::{DisparityMap, Support};

/// Half the side of the window of support, pixels.
const SUPPORT_RADIUS: usize = 3;
/// Most that the claims may cost, on average.
const MOST_COST: i32 = 52;
/// Least part of the disparities that must match clearly worse than the one claimed, in 255ths.
const LEAST_WORSE: i32 = 153;
/// Smallest patch that stays, pixels.
const LEAST_PATCH: u32 = 150;
/// Most disparity between neighbours of one patch, pixels.
const PATCH_STEP: f32 = 1.0;

/// Withdraws the claims whose window does not support them.
pub(super) fn drop_unsupported(map: &mut DisparityMap, support: &[Support]) {
    let (width, height) = (map.width, map.height);
    // What each column of the window has to spare, in cost and in worse matches; beyond both ends of the row nothing.
    let mut columns = vec![[0i32; 2]; width + 2 * SUPPORT_RADIUS];
    let add = |columns: &mut [[i32; 2]], y: usize, sign: i32| {
        let row = &support[y * width..][..width];
        for (sums, Support { cost, worse }) in columns[SUPPORT_RADIUS..].iter_mut().zip(row) {
            // No claim has no say.
            let says = sign * i32::from(*cost != Support::NONE.cost);
            sums[0] += says * (MOST_COST - i32::from(*cost));
            sums[1] += says * (i32::from(*worse) - LEAST_WORSE);
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

/// Withdraws small patches.
pub(super) fn drop_speckles(map: &mut DisparityMap) {
    let width = map.width;
    let mut patches = Patches::default();
    // For each pixel of a row, and of the one above, its run; none where nothing is claimed.
    let [mut above, mut here] = [vec![NONE; width], vec![NONE; width]];
    let mut runs = Vec::new();
    for (y, row) in map.disparity.chunks_exact(width).enumerate() {
        for x in 0..width {
            if !row[x].is_finite() {
                here[x] = NONE;
                continue;
            }
            // A run is a stretch of a row that hangs together.
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

/// Where there is no run.
const NONE: u32 = u32::MAX;

/// Which runs hang together: each names one of its patch that comes earlier, or itself (Tarjan 1975).
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
