//! Colour maps.
//!
//! In: a number in `[0; 1]` (outside it is clamped, NaN is "no data"). Out: a colour. Invariant: lightness
//! rises steadily along the sequential map and falls steadily along the occupancy map, so that both survive
//! grey printing.

use plotters::style::RGBColor;

/// The colour of NaN.
pub(super) const NO_DATA: RGBColor = RGBColor(214, 220, 230);
/// Text and axes.
pub(super) const INK: RGBColor = RGBColor(34, 40, 49);
/// Grid lines and other background elements.
pub(super) const FAINT: RGBColor = RGBColor(225, 228, 233);
/// The current gaze.
pub(super) const GAZE: RGBColor = RGBColor(214, 40, 57);
/// Colours of the curves, distinguishable with red-green colour blindness.
pub(super) const CURVES: [RGBColor; 10] = [
    RGBColor(196, 50, 60),
    RGBColor(44, 102, 176),
    RGBColor(222, 146, 30),
    RGBColor(38, 138, 112),
    RGBColor(132, 84, 160),
    RGBColor(96, 104, 114),
    RGBColor(86, 180, 233),
    RGBColor(150, 100, 50),
    RGBColor(20, 20, 20),
    RGBColor(225, 120, 170),
];

/// Colour maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// Dark violet through teal to yellow: entropies, distances.
    Sequential,
    /// The convention of occupancy grids: 0 (empty) white, 1/2 (unknown) grey, 1 (occupied) black.
    Occupancy,
    /// Blue, white, red around 1/2: differences.
    Diverging,
}

const SEQUENTIAL: [[f64; 3]; 6] = [
    [42.0, 14.0, 78.0],
    [62.0, 62.0, 138.0],
    [40.0, 110.0, 146.0],
    [36.0, 156.0, 134.0],
    [128.0, 202.0, 88.0],
    [250.0, 232.0, 70.0],
];
const OCCUPANCY: [[f64; 3]; 3] = [[255.0, 255.0, 255.0], [158.0, 162.0, 168.0], [18.0, 20.0, 24.0]];
const DIVERGING: [[f64; 3]; 5] = [
    [34.0, 78.0, 150.0],
    [138.0, 176.0, 214.0],
    [247.0, 247.0, 247.0],
    [228.0, 150.0, 122.0],
    [164.0, 30.0, 48.0],
];

impl ColourMap {
    /// The colour `[red, green, blue]` of a value in `[0; 1]`.
    pub fn colour(self, value: f64) -> [u8; 3] {
        let anchors: &[[f64; 3]] = match self {
            ColourMap::Sequential => &SEQUENTIAL,
            ColourMap::Occupancy => &OCCUPANCY,
            ColourMap::Diverging => &DIVERGING,
        };
        if value.is_nan() {
            return [NO_DATA.0, NO_DATA.1, NO_DATA.2];
        }
        let place = value.clamp(0.0, 1.0) * (anchors.len() - 1) as f64;
        let lower = (place as usize).min(anchors.len() - 2);
        let share = place - lower as f64;
        [0, 1, 2].map(|i| (anchors[lower][i] * (1.0 - share) + anchors[lower + 1][i] * share).round() as u8)
    }

    /// The colour of `value` on a scale that runs from `limits[0]` to `limits[1]`.
    pub(super) fn on_scale(self, value: f64, limits: [f64; 2]) -> RGBColor {
        let [red, green, blue] = self.colour((value - limits[0]) / (limits[1] - limits[0]));
        RGBColor(red, green, blue)
    }
}
