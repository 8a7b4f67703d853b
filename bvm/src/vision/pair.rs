//! A rectified pair of pictures, from any kind of files.
//!
//! In: two image files and a calibration, of a rectified pair or of two raw cameras. Out: [`Pair`]. Invariant: pixels
//! of an ideal camera that the real camera did not see have no estimate.

use super::calibration::raw::RawPair;
use super::stereo::match_pair_with_population;
use super::{Calibration, DisparityMap, GreyImage, Matcher, Population, VisionError, image, match_pair};
use std::path::Path;

/// A rectified pair.
#[derive(Clone, Debug)]
pub struct Pair {
    /// The left picture.
    pub left: GreyImage,
    /// The right picture.
    pub right: GreyImage,
    /// Their geometry.
    pub calibration: Calibration,
    /// Which pixels of the left picture, and of the right one, the real cameras saw; all, if it was rectified.
    seen: Option<[Vec<bool>; 2]>,
}

impl Pair {
    /// Two pictures of a rectified pair.
    ///
    /// # Errors
    /// Pictures of different sizes, or narrower than the largest disparity.
    pub fn new(left: GreyImage, right: GreyImage, calibration: Calibration) -> Result<Self, VisionError> {
        let [left_size, right_size] = [&left, &right].map(|image| (image.width(), image.height()));
        if left_size != right_size {
            return Err(VisionError::PairSizes { left: left_size, right: right_size });
        }
        Ok(Self { left, right, calibration, seen: None })
    }

    /// Reads a pair.
    ///
    /// # Errors
    /// A file that cannot be read, or is not an image or a calibration; pictures that do not fit the cameras or the
    /// calibration.
    pub fn read(left: &Path, right: &Path, calibration: &Path) -> Result<Self, VisionError> {
        let raw = RawPair::find(calibration)?;
        let rig = match &raw {
            Some(raw) => *raw.calibration(),
            None => Calibration::read(calibration, Some(left))?,
        };
        let paths = [left, right];
        let (left, right) = (image::read(left)?, image::read(right)?);
        let size = |image: &GreyImage| format!("{}x{}", image.width(), image.height());
        if size(&left) != size(&right) {
            let (own, other, expected) = (size(&right), paths[0].display(), size(&left));
            let reason =
                format!("the picture is {own}, but the left one of the pair, `{other}`, is {expected}");
            return Err(VisionError::File { path: paths[1].to_path_buf(), reason });
        }
        match raw {
            Some(raw) => Self::rectified(&raw, &left, &right),
            None => {
                rig.check_pictures(calibration, left.width(), left.height())?;
                Ok(Self { left, right, calibration: rig, seen: None })
            }
        }
    }

    /// Rectifies the pictures of two raw cameras.
    ///
    /// # Errors
    /// Pictures of another size than the cameras make.
    pub fn rectified(raw: &RawPair, left: &GreyImage, right: &GreyImage) -> Result<Self, VisionError> {
        let [left, right] = raw.rectify(left, right)?;
        let seen = Some([left.seen, right.seen]);
        Ok(Self { left: left.image, right: right.image, calibration: *raw.calibration(), seen })
    }

    /// The disparities of the left picture.
    ///
    /// # Errors
    /// Pictures of different sizes, or narrower than the largest disparity.
    pub fn matched(&self, matcher: Matcher) -> Result<DisparityMap, VisionError> {
        let found = match_pair(&self.left, &self.right, self.calibration.max_disparity_px(), matcher)?;
        Ok(self.without_unseen(found))
    }

    /// [`Pair::matched`], and the posterior of every pixel over its disparity.
    ///
    /// # Errors
    /// The same.
    pub fn matched_with_population(
        &self,
        matcher: Matcher,
    ) -> Result<(DisparityMap, Option<Population>), VisionError> {
        let most = self.calibration.max_disparity_px();
        let (found, population) = match_pair_with_population(&self.left, &self.right, most, matcher)?;
        Ok((self.without_unseen(found), population))
    }

    /// Removes the estimates of pixels that the real cameras did not see.
    fn without_unseen(&self, mut found: DisparityMap) -> DisparityMap {
        if let Some([left, right]) = &self.seen {
            for (at, left) in left.iter().enumerate() {
                let there = || at - (found.disparity[at].round() as usize).min(at % found.width);
                if !left || (found.disparity[at].is_finite() && !right[there()]) {
                    found.withdraw(at);
                }
            }
        }
        found
    }
}
