//! The table by which pictures of one camera are resampled: computed once, applied to every picture.
//!
//! In: for each pixel of the made picture, its place in the given one. Out: pixels, bilinear between four. Invariant: the
//! four pixels of a place are in the picture.

/// Where the pixels of a picture are found in another of the same size.
#[derive(Clone, Debug)]
pub(super) struct Lookup {
    places: Vec<Place>,
    /// Whether the place of each pixel is in the picture.
    pub(super) seen: Vec<bool>,
    /// From a pixel to the one right of it, and to the one below.
    steps: [usize; 2],
}

/// The upper left one of four pixels, and the distances from it to the right and down, pixels.
#[derive(Clone, Copy, Debug)]
struct Place {
    first: u32,
    right: f32,
    down: f32,
}

impl Lookup {
    /// The table of a picture of this size; `place` gives where a pixel is found, right and down, pixels, if it is.
    pub(super) fn of(width: usize, height: usize, place: impl Fn(usize) -> Option<[f64; 2]>) -> Self {
        let inside = |[x, y]: [f64; 2]| {
            let seen = x >= 0.0 && y >= 0.0 && x <= (width - 1) as f64 && y <= (height - 1) as f64;
            seen.then(|| {
                let (left, top) = ((x as usize).min(width.max(2) - 2), (y as usize).min(height.max(2) - 2));
                let (right, down) = ((x - left as f64) as f32, (y - top as f64) as f32);
                Place { first: (top * width + left) as u32, right, down }
            })
        };
        let places: Vec<Option<Place>> = (0..width * height).map(|at| place(at).and_then(inside)).collect();
        Self {
            seen: places.iter().map(Option::is_some).collect(),
            places: (places.into_iter())
                .map(|place| place.unwrap_or(Place { first: 0, right: 0.0, down: 0.0 }))
                .collect(),
            // In a picture one pixel wide or high there is no second one.
            steps: [usize::from(width > 1), if height > 1 { width } else { 0 }],
        }
    }

    /// The resampled picture; 0 where a pixel is not in the given one.
    pub(super) fn apply(&self, pixels: &[f32]) -> Vec<f32> {
        let [right, down] = self.steps;
        let found = self.places.iter().zip(&self.seen).map(|(place, seen)| {
            let four = &pixels[place.first as usize..][..right + down + 1];
            let between = |left: f32, next: f32| left * (1.0 - place.right) + next * place.right;
            let (upper, lower) = (between(four[0], four[right]), between(four[down], four[down + right]));
            let value = (upper * (1.0 - place.down) + lower * place.down).clamp(0.0, 255.0);
            if *seen { value } else { 0.0 }
        });
        found.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_pixels_by_hand() {
        // Of [[0, 4], [8, 16]]: the middle is 7, a quarter to the right and three down 0.25·(0.75·0 + 0.25·4) + …
        let pixels = [0.0, 4.0, 8.0, 16.0];
        let places = [Some([0.5, 0.5]), Some([0.25, 0.75]), Some([1.0, 1.0]), Some([1.01, 0.0])];
        let lookup = Lookup::of(2, 2, |at| places[at]);
        assert_eq!(lookup.apply(&pixels), [7.0, 0.25 * 1.0 + 0.75 * 10.0, 16.0, 0.0]);
        assert_eq!(lookup.seen, [true, true, true, false]);
    }

    #[test]
    fn a_picture_of_one_pixel() {
        assert_eq!(Lookup::of(1, 1, |_| Some([0.0, 0.0])).apply(&[3.0]), [3.0]);
        assert_eq!(Lookup::of(1, 2, |_| Some([0.0, 0.5])).apply(&[3.0, 5.0]), [4.0, 4.0]);
    }
}
