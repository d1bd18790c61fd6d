//! How two pictures differ, for comparisons with a golden one.

use crate::Picture;

/// Differences of a channel from which pixels are counted.
pub const THRESHOLDS: [u8; 5] = [0, 2, 4, 8, 16];

/// Difference of two pictures of one size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureDifference {
    /// Pixels with a channel that differs by more than the tolerance.
    pub pixels: usize,
    /// Largest difference of a channel, 0 to 255.
    pub largest: u8,
    /// Pixels with a channel that differs by more than each of [`THRESHOLDS`].
    pub above: [usize; THRESHOLDS.len()],
    /// The picture, pale, with these pixels in red.
    pub picture: Picture,
}

/// Pictures of different sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the picture has {} x {} pixels, the golden one {} x {}", found[0], found[1], golden[0], golden[1])]
pub struct SizeMismatch {
    /// Width and height of the picture.
    pub found: [u32; 2],
    /// Width and height of the golden one.
    pub golden: [u32; 2],
}

impl Picture {
    /// Compares with a golden picture; channels may differ by `tolerance`.
    pub fn difference(&self, golden: &Self, tolerance: u8) -> Result<PictureDifference, SizeMismatch> {
        let [found, wanted] = [self, golden].map(|picture| [picture.width, picture.height]);
        if found != wanted {
            return Err(SizeMismatch { found, golden: wanted });
        }
        let (mut pixels, mut largest, mut above) = (0, 0, [0; THRESHOLDS.len()]);
        let mut rgba = Vec::with_capacity(self.rgba.len());
        for (own, other) in self.rgba.chunks_exact(4).zip(golden.rgba.chunks_exact(4)) {
            let most = own.iter().zip(other).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
            largest = largest.max(most);
            THRESHOLDS.iter().zip(&mut above).for_each(|(least, count)| *count += usize::from(most > *least));
            if most > tolerance {
                pixels += 1;
                rgba.extend([220, 20, 20, 255]);
            } else {
                rgba.extend(own.iter().take(3).map(|channel| 191 + channel / 4).chain([255]));
            }
        }
        Ok(PictureDifference { pixels, largest, above, picture: Self { width: self.width, height: self.height, rgba } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_beyond_the_tolerance_are_counted_and_red() {
        let plain = Picture { width: 4, height: 3, rgba: [100, 100, 100, 255].repeat(12) };
        let mut other = plain.clone();
        other.rgba[4 * 5] = 103;
        other.rgba[4 * 7 + 1] = 98;
        let difference = plain.difference(&other, 2).expect("one size");
        assert_eq!((difference.pixels, difference.largest), (1, 3));
        assert_eq!(difference.above, [2, 1, 0, 0, 0]);
        assert_eq!(difference.picture.rgba[20..24], [220, 20, 20, 255]);
        assert_eq!(difference.picture.rgba[28..32], [216, 216, 216, 255]);
        assert_eq!(plain.difference(&other, 3).expect("one size").pixels, 0);
        let wide = Picture { width: 6, height: 2, rgba: plain.rgba.clone() };
        let sizes = SizeMismatch { found: [6, 2], golden: [4, 3] };
        assert_eq!(wide.difference(&plain, 0), Err(sizes));
        assert_eq!(sizes.to_string(), "the picture has 6 x 2 pixels, the golden one 4 x 3");
    }
}
