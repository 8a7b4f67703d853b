//! The pictures of a replay.
//!
//! In: each frame with the map after it, then the map at the end. Out: `strip.png`, `occupancy_panorama.png`, `top_view.png`.
//! Invariant: the strip has a tile for each frame that was fused, in order of time.

use super::REACH_M;
use bvm::error::Error;
use bvm::map::Map;
use bvm::report::{ColourMap, Panorama, TopView, Window, first_occupied_range, panorama, top_view};
use bvm::vision::image::write_png_rgb;
use bvm::vision::{DisparityMap, Pair};
use std::path::{Path, PathBuf};

/// The part of the sphere in the strip, degrees of azimuth and elevation to either side.
const SHOWN: [f64; 2] = [60.0, 40.0];
/// Frames side by side in the strip.
pub(super) const ACROSS: usize = 7;

/// A small colour picture, row by row.
pub(super) struct Tile {
    width: usize,
    rgb: Vec<u8>,
}

/// The left picture, its disparities, and the first occupied cells at that time, one below the other.
pub(super) fn tile(pair: &Pair, found: &DisparityMap, map: &Map) -> Result<Tile, Error> {
    let grid = map.grid();
    let width = found.width / 4;
    let mut rgb = Vec::new();
    let most = pair.calibration.max_disparity_px() as f32 / 2.0;
    for y in 0..found.height / 4 {
        rgb.extend((0..width).flat_map(|x| [pair.left.pixels()[4 * y * found.width + 4 * x] as u8; 3]));
    }
    for y in 0..found.height / 4 {
        rgb.extend((0..width).flat_map(|x| {
            let disparity = found.disparity[4 * y * found.width + 4 * x];
            if disparity.is_finite() {
                ColourMap::Sequential.colour(f64::from(disparity / most))
            } else {
                [40; 3]
            }
        }));
    }
    let ranges = first_occupied_range(grid, map.occupancy(), 0.05)?;
    let height = (width as f64 * SHOWN[1] / SHOWN[0]) as usize;
    for y in 0..height {
        for x in 0..width {
            let share = |at: usize, of: usize| 2.0 * (at as f64 + 0.5) / of as f64 - 1.0;
            let azimuth = (-SHOWN[0] * share(x, width)).to_radians();
            let elevation = (-SHOWN[1] * share(y, height)).to_radians();
            let direction = grid.direction_of(azimuth, elevation);
            let range = direction.map_or(f64::NAN, |direction| ranges[grid.direction_index(direction)]);
            let near = (REACH_M[1] / range).ln() / (REACH_M[1] / REACH_M[0]).ln();
            rgb.extend(if near.is_finite() { ColourMap::Sequential.colour(near) } else { [214, 220, 230] });
        }
    }
    Ok(Tile { width, rgb })
}

/// Writes the pictures of the map; the head looks to `yaw`.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn write(folder: &Path, map: &Map, yaw: f64, tiles: &[Tile]) -> Result<Vec<PathBuf>, Error> {
    let (width, height) = (tiles[0].width, tiles[0].rgb.len() / tiles[0].width / 3);
    let (across, down) = (ACROSS.min(tiles.len()), tiles.len().div_ceil(ACROSS));
    let mut strip = vec![255; 3 * across * width * down * height];
    for (at, tile) in tiles.iter().enumerate() {
        let (column, row) = (at % ACROSS, at / ACROSS);
        for (y, line) in tile.rgb.chunks_exact(3 * width).enumerate() {
            let start = 3 * ((row * height + y) * across * width + column * width);
            strip[start..start + line.len()].copy_from_slice(line);
        }
    }
    let mut written = vec![folder.join("strip.png")];
    write_png_rgb(&written[0], across * width, down * height, &strip)?;
    let grid = map.grid();
    let first = first_occupied_range(grid, map.occupancy(), 0.05)?;
    let window = Window { azimuth_degrees: [SHOWN[0], -SHOWN[0]], elevation_degrees: [-SHOWN[1], SHOWN[1]] };
    let sphere = Panorama {
        title: "First occupied cell",
        quantity: "range (m)",
        values: &first,
        colours: ColourMap::Sequential,
        limits: Some([REACH_M[1], REACH_M[0]]),
        window,
        gaze_path: &[(yaw, 0.0)],
    };
    let from_above = TopView {
        occupancy: map.occupancy(),
        truth: None,
        heading: yaw,
        field: 80f64.to_radians(),
        band: 10f64.to_radians(),
    };
    for (name, picture) in
        [("occupancy_panorama.png", panorama(grid, &sphere)?), ("top_view.png", top_view(grid, &from_above)?)]
    {
        picture.write(&folder.join(name))?;
        written.push(folder.join(name));
    }
    Ok(written)
}
