//! Semi-global aggregation: each cost learns from eight straight paths that end in its pixel.
//!
//! In: a [`CostVolume`] and the left image. Out: the sum over eight paths r of
//!
//! ```text
//! L_r(p, d) = C(p, d) + min(L_r(q, d), L_r(q, d ± 1) + P1, min_k L_r(q, k) + P2) − min_k L_r(q, k),   q = p − r
//! ```
//!
//! same layout as the costs. P1 lets a surface slant; P2 lets it jump, and costs less where the intensity
//! jumps too. Two sweeps of four paths each, one from the top left and one from the bottom right, run side by
//! side.
//! Invariant: whole numbers in a fixed order, so the result does not depend on the number of threads, and
//! `L_r <= 255 + P2`, so eight of them fit 16 bits.
//! Reference: Hirschmüller, Stereo processing by semiglobal matching and mutual information, IEEE Trans.
//! PAMI 30(2), 2008.

use super::volume::CostVolume;

/// Price of a step of one disparity along a path.
const SMALL_STEP: i16 = 24;
/// Price of a jump where the intensity does not change.
const JUMP: f32 = 130.0;
/// Least price of a jump.
const JUMP_LEAST: f32 = 34.0;
/// Change of intensity that halves the price of a jump.
const JUMP_HALVED_AT: f32 = 12.0;
/// Stands outside the range of disparities; larger than any path cost, small enough not to overflow.
const FAR: i16 = 8_000;

/// Sum of the eight path costs of every candidate.
pub(super) fn aggregate(volume: &CostVolume, guide: &[f32]) -> Vec<i16> {
    let (mut sums, backward) = rayon::join(|| sweep(volume, guide, false), || sweep(volume, guide, true));
    for (sum, other) in sums.iter_mut().zip(&backward) {
        *sum += other;
    }
    sums
}

/// Path costs of one pixel, with one [`FAR`] lane on either side, and their minimum.
#[derive(Clone)]
struct Path {
    lanes: Vec<i16>,
    least: i16,
}

/// The four paths that come from the side where the sweep began.
fn sweep(volume: &CostVolume, guide: &[f32], backward: bool) -> Vec<i16> {
    let (width, height, stride) = (volume.width, volume.height, volume.stride);
    let nothing = Path { lanes: vec![0; stride + 2], least: 0 };
    // Index 1 + x, so that both ends have a neighbour outside; there every path cost is zero.
    let mut rows: [Vec<Path>; 3] = std::array::from_fn(|_| vec![nothing.clone(); width + 2]);
    let mut next_rows = rows.clone();
    let mut sums = vec![0i16; volume.costs.len()];
    for step_y in 0..height {
        let mut along = nothing.clone();
        let mut next_along = nothing.clone();
        for step_x in 0..width {
            let in_order = step_y * width + step_x;
            let (pixel, from): (usize, isize) =
                if backward { (width * height - 1 - in_order, 1) } else { (in_order, -1) };
            let costs = &volume.costs[pixel * stride..][..stride];
            let sums = &mut sums[pixel * stride..][..stride];
            let jump = |offset: isize| {
                let other = pixel.checked_add_signed(from * offset).and_then(|at| guide.get(at));
                jump_price(guide[pixel], *other.unwrap_or(&guide[pixel]))
            };
            let line = width as isize;
            extend(costs, &along, jump(1), &mut next_along, sums);
            std::mem::swap(&mut along, &mut next_along);
            for (path, (offset, back)) in [(line + 1, 0), (line, 1), (line - 1, 2)].into_iter().enumerate() {
                let before = &rows[path][step_x + back];
                extend(costs, before, jump(offset), &mut next_rows[path][step_x + 1], sums);
            }
        }
        std::mem::swap(&mut rows, &mut next_rows);
    }
    sums
}

/// P2 between two neighbours.
fn jump_price(here: f32, there: f32) -> i16 {
    (JUMP / (1.0 + (here - there).abs() / JUMP_HALVED_AT)).max(JUMP_LEAST) as i16
}

/// One step of one path: the equation above for all disparities of a pixel.
fn extend(costs: &[u8], before: &Path, jump: i16, path: &mut Path, sums: &mut [i16]) {
    let count = costs.len();
    let lower = &before.lanes[..count];
    let same = &before.lanes[1..=count];
    let upper = &before.lanes[2..count + 2];
    let jumped = before.least + jump;
    let lanes = &mut path.lanes[1..=count];
    let sums = &mut sums[..count];
    let mut least = i16::MAX;
    for d in 0..count {
        let reached = same[d].min(lower[d].min(upper[d]) + SMALL_STEP).min(jumped);
        let value = i16::from(costs[d]) + reached - before.least;
        lanes[d] = value;
        sums[d] += value;
        least = least.min(value);
    }
    path.lanes[0] = FAR;
    path.lanes[count + 1] = FAR;
    path.least = least;
}
