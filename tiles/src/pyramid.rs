//! A picture in memory with its reductions, cut into tiles.

use crate::pixels::Pixels;

/// Side of the tiles that pictures are cut into.
pub(crate) const CUT_SIDE: u32 = 512;

/// A picture: first in full, then each time half as wide and high, down to one tile.
pub(crate) struct Pyramid {
    levels: Vec<Pixels>,
}

/// The number of reductions of a picture, so that the last one is a single tile.
pub(crate) fn count_reductions(width: u32, height: u32) -> u8 {
    let mut side = width.max(height);
    let mut count = 0;
    while side > CUT_SIDE {
        side = side.div_ceil(2);
        count += 1;
    }
    count
}

/// The width and height of a reduction.
pub(crate) fn reduced_size(width: u32, height: u32, level: u8) -> (u32, u32) {
    (0..level).fold((width, height), |(w, h), _| (w.div_ceil(2), h.div_ceil(2)))
}

/// The bytes of a picture with its reductions, at most.
pub(crate) fn pyramid_bytes(width: u32, height: u32) -> usize {
    // A third more, and a row and a column of each level, for sides that are odd.
    let full = width as usize * height as usize * 4;
    full + full / 3 + 8 * (width as usize + height as usize) + 64
}

impl Pyramid {
    pub(crate) fn new(full: Pixels) -> Self {
        let count = count_reductions(full.width, full.height);
        let mut levels = vec![full];
        for level in 0..usize::from(count) {
            levels.push(halve(&levels[level]));
        }
        Self { levels }
    }

    /// Bytes in memory.
    pub(crate) fn len_bytes(&self) -> usize {
        self.levels.iter().map(|level| level.rgba.len()).sum()
    }

    /// The pixels of a rectangle of a level, which must lie within it.
    pub(crate) fn cut(&self, level: u8, left: u32, top: u32, width: u32, height: u32) -> Pixels {
        let from = &self.levels[usize::from(level)];
        let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
        for row in top..top + height {
            let at = (row as usize * from.width as usize + left as usize) * 4;
            rgba.extend_from_slice(&from.rgba[at..at + width as usize * 4]);
        }
        Pixels { width, height, rgba }
    }
}

/// Half the width and height: each pixel is the mean of four, weighted by their opacity.
fn halve(from: &Pixels) -> Pixels {
    let (width, height) = (from.width.div_ceil(2), from.height.div_ceil(2));
    let stride = from.width as usize * 4;
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for row in 0..height as usize {
        let upper = &from.rgba[2 * row * stride..][..stride];
        // The last row of an odd height stands for two.
        let lower = from.rgba.get((2 * row + 1) * stride..).filter(|rest| !rest.is_empty());
        let lower = &lower.unwrap_or(upper)[..stride];
        for (up, low) in upper.chunks(8).zip(lower.chunks(8)) {
            let right = up.len() - 4;
            let four = [&up[..4], &up[right..], &low[..4], &low[right..]];
            rgba.extend_from_slice(&mean_color(four));
        }
    }
    Pixels { width, height, rgba }
}

fn mean_color(pixels: [&[u8]; 4]) -> [u8; 4] {
    let opacity: u32 = pixels.iter().map(|pixel| u32::from(pixel[3])).sum();
    let channel = |index: usize| {
        if opacity == 4 * 255 {
            let sum: u32 = pixels.iter().map(|pixel| u32::from(pixel[index])).sum();
            return ((sum + 2) / 4) as u8;
        }
        let sum: u32 = pixels.iter().map(|it| u32::from(it[index]) * u32::from(it[3])).sum();
        (sum + opacity / 2).checked_div(opacity).unwrap_or_default() as u8
    };
    [channel(0), channel(1), channel(2), ((opacity + 2) / 4) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reduction_is_the_mean_and_keeps_odd_edges() {
        let pixel = |value: u8, opacity: u8| [value, value, value, opacity];
        let rgba = [
            pixel(0, 255),
            pixel(100, 255),
            pixel(7, 255),
            pixel(50, 255),
            pixel(50, 255),
            pixel(9, 255),
            pixel(10, 255),
            pixel(200, 0),
            pixel(30, 255),
        ]
        .concat();
        let half = halve(&Pixels { width: 3, height: 3, rgba });
        assert_eq!((half.width, half.height), (2, 2));
        let expected = [pixel(50, 255), pixel(8, 255), pixel(10, 128), pixel(30, 255)].concat();
        assert_eq!(half.rgba, expected);
    }

    #[test]
    fn the_last_reduction_is_one_tile() {
        for (width, height) in [(1, 1), (512, 512), (513, 1), (4000, 4000), (65_535, 300)] {
            let count = count_reductions(width, height);
            let (w, h) = reduced_size(width, height, count);
            assert!(w <= CUT_SIDE && h <= CUT_SIDE);
            assert!(count == 0 || reduced_size(width, height, count - 1).0.max(h) > CUT_SIDE);
        }
        let rgba = vec![9; 1025 * 3 * 4];
        let pyramid = Pyramid::new(Pixels { width: 1025, height: 3, rgba });
        assert_eq!(pyramid.levels.len(), 3);
        assert!(pyramid.len_bytes() <= pyramid_bytes(1025, 3));
        let cut = pyramid.cut(1, 512, 0, 1, 2);
        assert_eq!((cut.width, cut.height, cut.rgba), (1, 2, vec![9; 8]));
    }
}
