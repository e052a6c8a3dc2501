//! A tile: its number, and its pixels with their place.

use crate::reference::{PlaneBounds, PlanePoint};

/// Tiles that one view gets from one source. A screen of 4000 × 2500 pixels has 160 of 256 pixels.
pub const MAX_WANTED_TILES: usize = 256;

/// The number of a tile within its source.
///
/// In archives of Web Mercator the level is the zoom, and columns and rows are those of web maps.
/// Pictures have the full resolution at level 0, and half as much at each further one. Drawings
/// have one tile at level 0, and twice as many in each direction at each further one. Rows count
/// from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TileId {
    /// The level.
    pub level: u8,
    /// The column.
    pub column: u32,
    /// The row, from the top.
    pub row: u32,
}

/// The pixels of a tile, and where they are.
#[derive(Clone, Debug, PartialEq)]
pub struct TileImage {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue, opacity (not multiplied with the colours), the top row first.
    pub rgba: Vec<u8>,
    /// The image's corners in the plane of the source: top left, top right, bottom right, bottom
    /// left.
    pub corners: [PlanePoint; 4],
}

impl std::fmt::Display for TileId {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{}/{}/{}", self.level, self.column, self.row)
    }
}

/// A rectangle of tiles of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TileRange {
    pub(crate) level: u8,
    /// The first and the last column.
    pub(crate) columns: (u32, u32),
    /// The first and the last row.
    pub(crate) rows: (u32, u32),
}

impl TileRange {
    /// The tiles of a grid that `area` touches. `area` counts in tiles from the grid's top left
    /// corner, y down; the grid has `columns` × `rows` tiles, at least one.
    pub(crate) fn touching(level: u8, area: PlaneBounds, columns: u32, rows: u32) -> Option<Self> {
        let span = |from: f64, to: f64, count: u32| {
            let last = count.checked_sub(1)?;
            let is_apart = !(from < f64::from(count) && to > 0.0);
            // A cast saturates.
            let within = |value: f64| (value.max(0.0) as u32).min(last);
            (!is_apart).then(|| (within(from), within((to.ceil() - 1.0).max(from.floor()))))
        };
        let columns = span(area.min.x, area.max.x, columns)?;
        let rows = span(area.min.y, area.max.y, rows)?;
        Some(Self { level, columns, rows })
    }

    /// The tiles from the middle outwards, at most [`MAX_WANTED_TILES`].
    pub(crate) fn list_from_middle(self) -> Vec<TileId> {
        let most = MAX_WANTED_TILES as u32;
        let (columns, rows) = (narrow_span(self.columns, most), narrow_span(self.rows, most));
        let mut tiles: Vec<TileId> = (rows.0..=rows.1)
            .flat_map(|row| (columns.0..=columns.1).map(move |column| (column, row)))
            .map(|(column, row)| TileId { level: self.level, column, row })
            .collect();
        // Twice the distances, so that the middle is a whole number.
        let distance = |at: u32, (first, last): (u32, u32)| {
            (2 * u64::from(at)).abs_diff(u64::from(first) + u64::from(last))
        };
        tiles.sort_by_key(|tile| {
            let (x, y) = (distance(tile.column, columns), distance(tile.row, rows));
            (x * x + y * y, tile.row, tile.column)
        });
        tiles.truncate(MAX_WANTED_TILES);
        tiles
    }
}

/// The middle of a span, `most` long.
fn narrow_span((first, last): (u32, u32), most: u32) -> (u32, u32) {
    if last - first < most {
        return (first, last);
    }
    let from = first + (last - first + 1 - most) / 2;
    (from, from + most - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tiles_of_a_view_come_from_the_middle_outwards() {
        let area = PlaneBounds::new(0.5, 0.2, 2.5, 1.0);
        let range = TileRange::touching(3, area, 4, 4).unwrap();
        assert_eq!((range.columns, range.rows), ((0, 2), (0, 0)));
        let columns: Vec<u32> = range.list_from_middle().iter().map(|tile| tile.column).collect();
        assert_eq!(columns, [1, 0, 2]);
        let nothing = PlaneBounds::new(4.0, 0.0, 9.0, 1.0);
        assert_eq!(TileRange::touching(0, nothing, 4, 4), None);
        let nowhere = PlaneBounds::new(f64::NAN, 0.0, f64::NAN, 1.0);
        assert_eq!(TileRange::touching(0, nowhere, 4, 4), None);
    }

    #[test]
    fn a_view_of_the_whole_world_has_a_bound() {
        let world = PlaneBounds::new(f64::NEG_INFINITY, -1e300, f64::INFINITY, 1e300);
        let range = TileRange::touching(30, world, 1 << 30, 1 << 30).unwrap();
        let tiles = range.list_from_middle();
        assert_eq!(tiles.len(), MAX_WANTED_TILES);
        assert!(tiles[0].column.abs_diff(1 << 29) <= 1, "{}", tiles[0]);
    }
}
