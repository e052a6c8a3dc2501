//! Shapes that are painted tile by tile: drawn worlds and floor plans.

use crate::error::{OpenFault, PictureFault};
use crate::paint::{PixelPoint, TilePainter};
use crate::pixels::Pixels;
use crate::pyramid::CUT_SIDE;
use crate::reader::TileReader;
use crate::reference::{PlaneBounds, PlanePoint};
use crate::tile::{TileId, TileImage, TileRange};

/// Metres of a pixel of the finest level.
const FINEST_M: f64 = 0.000_5;
/// The deepest level: a plan of 4,000 km to half a metre.
const MAX_LEVEL: u8 = 14;
/// Space around the shapes for their lines: a share of the extent, and metres at least.
const BORDER: f64 = 0.01;
const MIN_BORDER_M: f64 = 0.25;

/// Areas and lines, all in metres of a plane.
#[derive(Default)]
pub(crate) struct PlanShapes {
    /// Each with its rings, the outer one first, each ending where it begins.
    pub(crate) areas: Vec<Vec<Vec<PlanePoint>>>,
    pub(crate) lines: Vec<Vec<PlanePoint>>,
}

/// An area or a line with its extent.
struct PlacedShape {
    bounds: PlaneBounds,
    rings: Vec<Vec<PlanePoint>>,
    is_area: bool,
}

/// A plan whose tiles are painted when they are needed.
pub(crate) struct DrawnPlan {
    shapes: Vec<PlacedShape>,
    bounds: PlaneBounds,
    /// The side of the one tile of level 0.
    side: f64,
    last_level: u8,
}

impl DrawnPlan {
    pub(crate) fn new(shapes: PlanShapes) -> Result<Self, OpenFault> {
        let areas = shapes.areas.into_iter().map(|rings| (rings, true));
        let lines = shapes.lines.into_iter().map(|line| (vec![line], false));
        let shapes: Vec<PlacedShape> = areas
            .chain(lines)
            .filter_map(|(rings, is_area)| {
                let bounds = PlaneBounds::containing(rings.iter().flatten().copied())?;
                Some(PlacedShape { bounds, rings, is_area })
            })
            .collect();
        let drawn = shapes.iter().map(|shape| shape.bounds).reduce(PlaneBounds::union);
        let drawn = drawn.ok_or(OpenFault::NoShapes)?;
        let border = (BORDER * drawn.width().max(drawn.height())).max(MIN_BORDER_M);
        let bounds = PlaneBounds::new(
            drawn.min.x - border,
            drawn.min.y - border,
            drawn.max.x + border,
            drawn.max.y + border,
        );
        let side = bounds.width().max(bounds.height());
        let levels = (side / f64::from(CUT_SIDE) / FINEST_M).log2().ceil();
        // A cast saturates.
        let last_level = (levels.max(0.0) as u8).min(MAX_LEVEL);
        Ok(Self { shapes, bounds, side, last_level })
    }

    fn tile_side(&self, level: u8) -> f64 {
        self.side / f64::from(1_u32 << level)
    }

    fn count_tiles(&self, level: u8) -> (u32, u32) {
        let side = self.tile_side(level);
        let count = |extent: f64| ((extent / side).ceil() as u32).clamp(1, 1 << level);
        (count(self.bounds.width()), count(self.bounds.height()))
    }

    fn tile_bounds(&self, id: TileId) -> Option<PlaneBounds> {
        if id.level > self.last_level {
            return None;
        }
        let (columns, rows) = self.count_tiles(id.level);
        if id.column >= columns || id.row >= rows {
            return None;
        }
        let side = self.tile_side(id.level);
        let left = self.bounds.min.x + f64::from(id.column) * side;
        let top = self.bounds.max.y - f64::from(id.row) * side;
        Some(PlaneBounds::new(left, top - side, left + side, top))
    }
}

impl TileReader for DrawnPlan {
    fn bounds(&self) -> PlaneBounds {
        self.bounds
    }

    fn levels(&self) -> (u8, u8) {
        (0, self.last_level)
    }

    fn units_per_pixel(&self) -> f64 {
        self.tile_side(self.last_level) / f64::from(CUT_SIDE)
    }

    fn wanted(&self, view: PlaneBounds, pixels_per_unit: f64) -> Vec<TileId> {
        let level = (self.side * pixels_per_unit / f64::from(CUT_SIDE)).log2().round();
        // A cast saturates.
        let level = (level.max(0.0) as u8).min(self.last_level);
        let side = self.tile_side(level);
        let area = PlaneBounds::new(
            (view.min.x - self.bounds.min.x) / side,
            (self.bounds.max.y - view.max.y) / side,
            (view.max.x - self.bounds.min.x) / side,
            (self.bounds.max.y - view.min.y) / side,
        );
        let (columns, rows) = self.count_tiles(level);
        let range = TileRange::touching(level, area, columns, rows);
        range.map(TileRange::list_from_middle).unwrap_or_default()
    }

    fn coarser(&self, id: TileId) -> Option<TileId> {
        let level = id.level.checked_sub(1)?;
        Some(TileId { level, column: id.column / 2, row: id.row / 2 })
    }

    fn corners(&self, id: TileId) -> Option<[PlanePoint; 4]> {
        self.tile_bounds(id).map(PlaneBounds::corners)
    }

    fn decode(&self, id: TileId) -> Result<Option<TileImage>, PictureFault> {
        let bounds = self.tile_bounds(id).ok_or(PictureFault::NoSuchTile)?;
        let scale = f64::from(CUT_SIDE) / self.tile_side(id.level);
        // Lines of a neighbour reach into this tile.
        let reach = 2.0 / scale;
        let around = PlaneBounds::new(
            bounds.min.x - reach,
            bounds.min.y - reach,
            bounds.max.x + reach,
            bounds.max.y + reach,
        );
        let pixel = |at: &PlanePoint| -> PixelPoint {
            ((at.x - bounds.min.x) * scale, (bounds.max.y - at.y) * scale)
        };
        let mut painter = TilePainter::new(CUT_SIDE);
        let mut is_clear = true;
        for shape in &self.shapes {
            if shape.bounds.intersection(around).is_none() {
                continue;
            }
            is_clear = false;
            let rings: Vec<Vec<PixelPoint>> =
                shape.rings.iter().map(|ring| ring.iter().map(pixel).collect()).collect();
            if shape.is_area {
                painter.paint_area(&rings);
            } else {
                rings.iter().for_each(|ring| painter.paint_line(ring));
            }
        }
        if is_clear {
            return Ok(None);
        }
        let Pixels { width, height, rgba } = painter.finish();
        Ok(Some(TileImage { width, height, rgba, corners: bounds.corners() }))
    }

    fn tile_bytes(&self) -> usize {
        (CUT_SIDE * CUT_SIDE) as usize * 4
    }
}
