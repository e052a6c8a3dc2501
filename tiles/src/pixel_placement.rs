//! Where the pixels of a picture lie in a plane.

use crate::reference::{PlaneBounds, PlanePoint};

/// The smallest and the largest side of a pixel, in units of the plane: a millionth of a degree of
/// a millimetre's hundredth, and more than the Earth.
const SIDES: std::ops::RangeInclusive<f64> = 1e-13..=1e8;
/// Largest coordinate of a corner: beyond every grid of the Earth.
const MAX_COORDINATE: f64 = 1e9;

/// The affine map from a picture's pixels to a plane: columns to the right and rows downwards, from
/// the top left corner of the top left pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelPlacement {
    origin: PlanePoint,
    /// One column to the right.
    column: PlanePoint,
    /// One row down.
    row: PlanePoint,
}

impl PixelPlacement {
    /// The placement by its corner and the steps of one column and one row; nothing if these span
    /// no area, or are not numbers.
    pub fn new(origin: PlanePoint, column: PlanePoint, row: PlanePoint) -> Option<Self> {
        let placement = Self { origin, column, row };
        let is_near = [origin.x, origin.y].iter().all(|value| value.abs() <= MAX_COORDINATE);
        let sides = [column.x.hypot(column.y), row.x.hypot(row.y)];
        let has_sides = sides.iter().all(|side| SIDES.contains(side));
        // A pixel that is flatter than a thousandth of a square is a mistake.
        let has_area = placement.determinant().abs() > 1e-3 * sides[0] * sides[1];
        (is_near && has_sides && has_area).then_some(placement)
    }

    /// Square pixels along the axes, the picture's top left corner at `origin`.
    pub fn upright(origin: PlanePoint, side: f64) -> Option<Self> {
        Self::new(origin, PlanePoint::new(side, 0.0), PlanePoint::new(0.0, -side))
    }

    fn determinant(&self) -> f64 {
        self.column.x * self.row.y - self.column.y * self.row.x
    }

    /// The point at a column and a row, which may be fractions.
    pub fn plane_from_pixel(&self, column: f64, row: f64) -> PlanePoint {
        PlanePoint::new(
            self.origin.x + column * self.column.x + row * self.row.x,
            self.origin.y + column * self.column.y + row * self.row.y,
        )
    }

    /// The column (x) and row (y) at a point.
    pub fn pixel_from_plane(&self, point: PlanePoint) -> PlanePoint {
        let (x, y) = (point.x - self.origin.x, point.y - self.origin.y);
        let area = self.determinant();
        PlanePoint::new(
            (x * self.row.y - y * self.row.x) / area,
            (y * self.column.x - x * self.column.y) / area,
        )
    }

    /// The smallest rectangle of pixels that contains `bounds`.
    pub fn pixels_around(&self, bounds: PlaneBounds) -> PlaneBounds {
        let [a, b, c, d] = bounds.corners().map(|corner| self.pixel_from_plane(corner));
        PlaneBounds::new(a.x, a.y, b.x, b.y).union(PlaneBounds::new(c.x, c.y, d.x, d.y))
    }

    /// The corners of a rectangle of pixels: top left, top right, bottom right, bottom left.
    pub fn corners_of(&self, left: f64, top: f64, right: f64, bottom: f64) -> [PlanePoint; 4] {
        [(left, top), (right, top), (right, bottom), (left, bottom)]
            .map(|(column, row)| self.plane_from_pixel(column, row))
    }

    /// Units of the plane for one pixel: the side of a square of the same area.
    pub fn units_per_pixel(&self) -> f64 {
        self.determinant().abs().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_pixel_is_found_again() {
        let at = PlanePoint::new;
        let placement = PixelPlacement::new(at(10.0, 20.0), at(0.3, 0.4), at(0.4, -0.3)).unwrap();
        assert!((placement.units_per_pixel() - 0.5).abs() < 1e-12);
        let pixel = placement.pixel_from_plane(placement.plane_from_pixel(7.25, -3.5));
        assert!((pixel.x - 7.25).abs() < 1e-9 && (pixel.y + 3.5).abs() < 1e-9, "{pixel:?}");
    }

    #[test]
    fn a_flat_or_endless_pixel_is_refused() {
        let at = PlanePoint::new;
        for (column, row) in [
            (at(1.0, 0.0), at(2.0, 0.0)),
            (at(0.0, 0.0), at(0.0, -1.0)),
            (at(f64::NAN, 0.0), at(0.0, -1.0)),
            (at(1e300, 0.0), at(0.0, -1.0)),
        ] {
            assert_eq!(PixelPlacement::new(at(0.0, 0.0), column, row), None);
        }
        assert_eq!(PixelPlacement::upright(at(f64::INFINITY, 0.0), 1.0), None);
    }
}
