//! Paints shapes into the pixels of a tile: areas filled, lines of two pixels.

use crate::pixels::Pixels;

/// A point in pixels from the tile's top left corner.
pub(crate) type PixelPoint = (f64, f64);

/// Half the width of a line, in pixels.
const HALF_LINE: f64 = 1.0;
/// Rows in a row of pixels, for edges of areas that are nearly level.
const SUB_ROWS: u32 = 4;
/// How opaque a filled area is, and its colour; the lines' colour.
const FILL: ([u8; 3], f32) = ([120, 144, 168], 0.45);
const LINE: [u8; 3] = [32, 36, 44];

/// How much of each pixel of a square is covered, 0 to 1.
struct Coverage {
    side: u32,
    values: Vec<f32>,
}

/// What is painted on one tile.
pub(crate) struct TilePainter {
    areas: Coverage,
    lines: Coverage,
}

impl Coverage {
    fn new(side: u32) -> Self {
        Self { side, values: vec![0.0; side as usize * side as usize] }
    }

    fn row(&mut self, row: u32) -> &mut [f32] {
        let side = self.side as usize;
        &mut self.values[row as usize * side..][..side]
    }

    /// The pixels between two values, as a half-open range within the square.
    fn span(&self, from: f64, to: f64) -> std::ops::Range<u32> {
        // A cast saturates, also of what is not a number.
        let first = from.floor().max(0.0) as u32;
        first.min(self.side)..(to.ceil().max(0.0) as u32).min(self.side)
    }

    fn add_line(&mut self, from: PixelPoint, to: PixelPoint) {
        let reach = HALF_LINE + 0.5;
        let (low, high) = if from.1 <= to.1 { (from, to) } else { (to, from) };
        let (dx, dy) = (high.0 - low.0, high.1 - low.1);
        let length_squared = dx * dx + dy * dy;
        for row in self.span(low.1 - reach, high.1 + reach) {
            let y = f64::from(row) + 0.5;
            // The part of the line that may touch this row.
            let share = |at: f64| if dy > 0.0 { ((at - low.1) / dy).clamp(0.0, 1.0) } else { 0.0 };
            let (first, last) = if dy > 0.0 {
                (low.0 + dx * share(y - reach), low.0 + dx * share(y + reach))
            } else {
                (low.0, high.0)
            };
            let columns = self.span(first.min(last) - reach, first.max(last) + reach);
            let row = self.row(row);
            for column in columns {
                let x = f64::from(column) + 0.5;
                let along = (x - low.0) * dx + (y - low.1) * dy;
                let along = if length_squared > 0.0 {
                    (along / length_squared).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = (x - low.0 - along * dx).hypot(y - low.1 - along * dy);
                let covered = (reach - distance).clamp(0.0, 1.0) as f32;
                let value = &mut row[column as usize];
                *value = value.max(covered);
            }
        }
    }

    /// Fills rings by the rule of even and odd.
    fn add_area(&mut self, rings: &[Vec<PixelPoint>]) {
        let side = f64::from(self.side);
        let mut edges: Vec<(PixelPoint, PixelPoint)> = rings
            .iter()
            .flat_map(|ring| ring.windows(2).map(|pair| (pair[0], pair[1])))
            .map(|(a, b)| if a.1 <= b.1 { (a, b) } else { (b, a) })
            .filter(|(low, high)| low.1 < high.1 && high.1 > 0.0 && low.1 < side)
            .collect();
        edges.sort_by(|a, b| a.0.1.total_cmp(&b.0.1));
        let mut next = 0;
        let mut active: Vec<(PixelPoint, PixelPoint)> = Vec::new();
        let mut crossings = Vec::new();
        for sub_row in 0..self.side * SUB_ROWS {
            let y = (f64::from(sub_row) + 0.5) / f64::from(SUB_ROWS);
            while let Some(edge) = edges.get(next).filter(|(low, _)| low.1 <= y) {
                active.push(*edge);
                next += 1;
            }
            active.retain(|(_, high)| high.1 > y);
            crossings.clear();
            crossings.extend(active.iter().map(|(low, high)| {
                let x = low.0 + (high.0 - low.0) * (y - low.1) / (high.1 - low.1);
                x.clamp(-1.0, side + 1.0)
            }));
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.as_chunks::<2>().0 {
                let columns = self.span(pair[0], pair[1]);
                let row = self.row(sub_row / SUB_ROWS);
                for column in columns {
                    let left = f64::from(column);
                    let covered = pair[1].min(left + 1.0) - pair[0].max(left);
                    row[column as usize] += (covered.max(0.0) / f64::from(SUB_ROWS)) as f32;
                }
            }
        }
    }
}

impl TilePainter {
    pub(crate) fn new(side: u32) -> Self {
        Self { areas: Coverage::new(side), lines: Coverage::new(side) }
    }

    /// Fills an area: its rings, each ending where it begins, and their outlines.
    pub(crate) fn paint_area(&mut self, rings: &[Vec<PixelPoint>]) {
        self.areas.add_area(rings);
        rings.iter().for_each(|ring| self.paint_line(ring));
    }

    pub(crate) fn paint_line(&mut self, points: &[PixelPoint]) {
        let side = f64::from(self.lines.side);
        for pair in points.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let reach = HALF_LINE + 0.5;
            let is_near = |a: f64, b: f64| a.min(b) <= side + reach && a.max(b) >= -reach;
            if is_near(from.0, to.0) && is_near(from.1, to.1) {
                self.lines.add_line(from, to);
            }
        }
    }

    /// The pixels of the tile; nothing is painted where they are clear.
    pub(crate) fn finish(self) -> Pixels {
        let side = self.areas.side;
        let pairs = self.areas.values.iter().zip(&self.lines.values);
        let rgba = pairs
            .flat_map(|(&area, &line)| {
                let fill = area.min(1.0) * FILL.1;
                let opacity = line + fill * (1.0 - line);
                let [red, green, blue] = std::array::from_fn(|channel| {
                    let sum = f32::from(LINE[channel]) * line
                        + f32::from(FILL.0[channel]) * fill * (1.0 - line);
                    if opacity > 0.0 { (sum / opacity).round() as u8 } else { 0 }
                });
                [red, green, blue, (opacity * 255.0).round() as u8]
            })
            .collect();
        Pixels { width: side, height: side, rgba }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opacity(pixels: &Pixels, column: u32, row: u32) -> u8 {
        pixels.rgba[((row * pixels.width + column) * 4 + 3) as usize]
    }

    #[test]
    fn a_line_is_two_pixels_wide() {
        let mut painter = TilePainter::new(16);
        painter.paint_line(&[(2.0, 8.0), (14.0, 8.0)]);
        let pixels = painter.finish();
        let column: Vec<u8> = (5..11).map(|row| opacity(&pixels, 8, row)).collect();
        assert_eq!(column, [0, 0, 255, 255, 0, 0]);
        assert_eq!(opacity(&pixels, 0, 8), 0);
        assert_eq!(&pixels.rgba[((7 * 16 + 8) * 4) as usize..][..3], LINE);
    }

    #[test]
    fn a_hole_stays_clear_and_an_edge_within_a_pixel_is_partly_filled() {
        let square = |a: f64, b: f64| vec![(a, a), (b, a), (b, b), (a, b), (a, a)];
        let mut coverage = Coverage::new(16);
        coverage.add_area(&[square(1.5, 14.0), square(5.0, 10.0)]);
        let value = |column: usize, row: usize| coverage.values[row * 16 + column];
        assert_eq!((value(0, 3), value(1, 3), value(2, 3)), (0.0, 0.5, 1.0));
        assert_eq!((value(3, 1), value(7, 7), value(12, 12)), (0.5, 0.0, 1.0));
    }

    #[test]
    fn shapes_far_beyond_the_tile_are_bounded() {
        let mut painter = TilePainter::new(8);
        let far = vec![
            (-1e300, -1e300),
            (1e300, -1e300),
            (1e300, 1e300),
            (-1e300, 1e300),
            (-1e300, -1e300),
        ];
        painter.paint_area(&[far]);
        painter.paint_line(&[(f64::NAN, 0.0), (4.0, f64::INFINITY)]);
        painter.paint_line(&[(-1e12, 4.0), (1e12, 4.0)]);
        let pixels = painter.finish();
        assert_eq!(opacity(&pixels, 4, 4), 255);
    }
}
