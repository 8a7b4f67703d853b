//! The location of the lanes that a load reads: in the array itself, or in a copy.
//!
//! In: an array and the position of its first lane. Out: a [`Place`]. Invariant: only lanes of a grain that is not
//! contiguous are copied; nothing is allocated.

use super::super::scalar::Scalar;
use super::tile::TILE;

/// The location of the lanes of a block: in the array that is read, or in a copy. Lanes are read in *grains*, a tile or
/// the whole block: a grain is read in the array if all its lanes are there. It fits two registers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// The position of lane 0 in the array; it may be negative where the row wraps around.
    at: usize,
    /// Lanes `from..until` are read in the array.
    from: u32,
    until: u32,
}

impl Place {
    /// In a copy.
    const COPIED: Place = Place { at: 0, from: 0, until: 0 };

    /// All lanes in the array itself, from this position on.
    #[inline(always)]
    pub fn at(at: usize) -> Self {
        Self { at, from: 0, until: u32::MAX }
    }

    /// The lanes of a block whose grain is the whole block, followed by the rest of the source.
    #[inline(always)]
    pub fn of<'s, T>(self, source: &'s [T], copy: &'s [T]) -> &'s [T] {
        if self.until == 0 { copy } else { &source[self.at..] }
    }
}

/// A tile of the lanes of a place, from `at` on; copied lanes begin at `slot`.
#[inline(always)]
pub fn read_tile<'s, T: Scalar>(
    place: Place,
    source: &'s [T],
    copy: &'s [T],
    slot: usize,
    at: usize,
) -> &'s [T; TILE] {
    match place.from as usize <= at && at + TILE <= place.until as usize {
        true => tile_of(source, place.at.wrapping_add(at)),
        false => tile_of(copy, slot + at),
    }
}

/// The lanes of a place whose grain is the whole block: at least a tile, of which the first `width` have a meaning.
#[inline(always)]
pub fn row_at<'s, T>(place: Place, source: &'s [T], copy: &'s [T], width: usize) -> &'s [T] {
    &place.of(source, copy)[..width.max(TILE)]
}

/// A tile of a row, from `at` on.
#[inline(always)]
pub fn tile_of<T>(row: &[T], at: usize) -> &[T; TILE] {
    row[at..].first_chunk().expect("internal: a whole tile")
}

/// Consecutive lanes from `at` on. Those of a block narrower than a tile are copied, so that whole tiles can be read.
#[inline(always)]
pub fn fetch<T: Scalar>(copy: &mut [T], slot: usize, source: &[T], at: usize, width: usize) -> Place {
    match width >= TILE {
        true => Place::at(at),
        false => {
            copy[slot..slot + width].copy_from_slice(&source[at..at + width]);
            Place::COPIED
        }
    }
}

/// The same number in all lanes, copied from `slot` on.
#[inline(always)]
pub fn splat<T: Scalar>(copy: &mut [T], slot: usize, number: T, width: usize) -> Place {
    copy[slot..slot + width].fill(number);
    Place::COPIED
}

/// These numbers, or a single one in all lanes, copied from `slot` on.
#[inline(always)]
pub fn fill<T: Scalar>(copy: &mut [T], slot: usize, numbers: &[T], width: usize) -> Place {
    match numbers {
        [number] => copy[slot..slot + width].fill(*number),
        numbers => copy[slot..slot + width].copy_from_slice(numbers),
    }
    Place::COPIED
}

/// Lanes of a row of `extent` numbers at `base`, from lane `from` on, which may be out of range: there the row wraps
/// around, or the value is `outside` (a number for each lane, or one for all). Grains that cross an end are copied,
/// from `slot` on.
#[inline(always)]
#[allow(clippy::too_many_arguments)] // emitted code names all arguments, so a struct would only repeat the names
pub fn fetch_turned<T: Scalar>(
    copy: &mut [T],
    slot: usize,
    source: &[T],
    base: usize,
    from: isize,
    extent: usize,
    wraps: bool,
    width: usize,
    outside: &[T],
    grain: usize,
) -> Place {
    if from >= 0 && from as usize + width <= extent {
        return fetch(copy, slot, source, base + from as usize, width);
    }
    let turned = Turned { row: &source[base..base + extent], from, wraps, outside };
    turned.place(&mut copy[slot..slot + width], base, grain)
}

/// A row that is read from an offset.
struct Turned<'r, T> {
    row: &'r [T],
    from: isize,
    wraps: bool,
    outside: &'r [T],
}

impl<T: Scalar> Turned<'_, T> {
    /// Copies the grains that cross an end; returns the location of all.
    #[inline(never)]
    fn place(&self, copy: &mut [T], base: usize, grain: usize) -> Place {
        let (extent, width) = (self.row.len() as isize, copy.len());
        // The array position of lane 0 is `shift`; of a row that wraps around, the longer of its two contiguous ranges
        // is read in place.
        let stretch = |shift: isize| {
            let inside = |lane: isize| lane.clamp(0, width as isize) as usize;
            (inside(-shift), inside(extent - shift), shift)
        };
        let (from, until, shift) = match self.wraps {
            false => stretch(self.from),
            true => {
                let (here, there) = (self.from.rem_euclid(extent), self.from.rem_euclid(extent) - extent);
                let (here, there) = (stretch(here), stretch(there));
                if here.1 - here.0 >= there.1 - there.0 { here } else { there }
            }
        };
        if until < from + grain {
            self.copy(copy, 0);
            return Place::COPIED;
        }
        // A grain is copied if it begins before `from` or ends after `until`.
        if from > 0 {
            self.copy(&mut copy[..(from + grain).min(width)], 0);
        }
        if until < width {
            let lane = until - grain;
            self.copy(&mut copy[lane..], lane);
        }
        Place { at: base.wrapping_add_signed(shift), from: from as u32, until: until as u32 }
    }

    /// Copies consecutive lanes from `lane` on, range by range.
    fn copy(&self, copy: &mut [T], lane: usize) {
        let (extent, until) = (self.row.len() as isize, lane + copy.len());
        let (mut at, mut rest) = (self.from + lane as isize, copy);
        while !rest.is_empty() {
            if self.wraps {
                at = at.rem_euclid(extent);
            }
            let inside = (0..extent).contains(&at);
            let end = match (inside, at < 0) {
                (true, _) => extent,
                (false, true) => 0,
                (false, false) => isize::MAX,
            };
            let count = rest.len().min((end - at) as usize);
            let lane = until - rest.len();
            let (stretch, after) = rest.split_at_mut(count);
            match (inside, self.outside) {
                (true, _) => stretch.copy_from_slice(&self.row[at as usize..][..count]),
                (false, [number]) => stretch.fill(*number),
                (false, numbers) => stretch.copy_from_slice(&numbers[lane..lane + count]),
            }
            (rest, at) = (after, at + count as isize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition: the value of lane `lane` of a row that is read from `from` on.
    fn defined(row: &[f32], from: isize, wraps: bool, outside: &[f32], lane: usize) -> f32 {
        let at = from + lane as isize;
        let at = if wraps { at.rem_euclid(row.len() as isize) } else { at };
        match usize::try_from(at).ok().and_then(|at| row.get(at)) {
            Some(number) => *number,
            None => outside[lane % outside.len()],
        }
    }

    #[test]
    fn every_grain_of_a_turned_row_is_right() {
        const SLOT: usize = 3;
        let before = 5;
        let whole = [(360, 360), (130, 130), (64, 64), (40, 40), (1, 1), (70, 70)];
        let (parts, more) = ([(200, 100), (600, 512), (1000, 512)], [(40, 100)]);
        for (extent, width) in whole.into_iter().chain(parts).chain(more) {
            let source: Vec<f32> = (0..before + extent + 9).map(|at| at as f32).collect();
            let row = &source[before..before + extent];
            let numbers: Vec<f32> = (0..width).map(|lane| -1.0 - lane as f32).collect();
            for (outside, wraps) in [(&numbers[..], false), (&numbers[..1], false), (&numbers[..1], true)] {
                let end = 2 * extent as isize;
                for (from, grain) in (-end..=end).flat_map(|from| [(from, TILE), (from, 512)]) {
                    let mut copy = vec![f32::NAN; SLOT + width + TILE];
                    let place = fetch_turned(
                        &mut copy, SLOT, &source, before, from, extent, wraps, width, outside, grain,
                    );
                    let expected = |lane: usize| defined(row, from, wraps, outside, lane);
                    let check = |lanes: &[f32], at: usize| {
                        for (lane, found) in lanes.iter().enumerate().take(width) {
                            assert_eq!(
                                *found,
                                expected(at + lane),
                                "lane {at} + {lane} of {width} from {from}"
                            );
                        }
                    };
                    if grain != TILE {
                        check(place.of(&source, &copy[SLOT..]), 0);
                        let whole = row_at(place, &source, &copy[SLOT..], width);
                        check(&whole[..width], 0);
                        (0..=width.saturating_sub(TILE))
                            .step_by(7)
                            .for_each(|at| check(&tile_of(whole, at)[..], at));
                        continue;
                    }
                    for tile in (0..width).step_by(TILE) {
                        let at = tile.min(width.saturating_sub(TILE));
                        check(&read_tile(place, &source, &copy, SLOT, at)[..], at);
                    }
                }
            }
        }
    }
}
