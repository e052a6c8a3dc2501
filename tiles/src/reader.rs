//! What every kind of source can do.

use crate::error::PictureFault;
use crate::picture::WholePicture;
use crate::reference::{PlaneBounds, PlanePoint};
use crate::tile::{TileId, TileImage};

/// A file whose tiles can be decoded, from any thread.
pub(crate) trait TileReader: Send + Sync {
    /// The extent in the plane of the source.
    fn bounds(&self) -> PlaneBounds;

    /// The first and the last level.
    fn levels(&self) -> (u8, u8);

    /// Units of the plane for a pixel of the finest level.
    fn units_per_pixel(&self) -> f64;

    /// The tiles that a view needs, from its middle outwards.
    fn wanted(&self, view: PlaneBounds, pixels_per_unit: f64) -> Vec<TileId>;

    /// The tile of the next coarser level that contains a tile.
    fn coarser(&self, id: TileId) -> Option<TileId>;

    /// The corners of a tile: top left, top right, bottom right, bottom left.
    fn corners(&self, id: TileId) -> Option<[PlanePoint; 4]>;

    /// Decodes a tile; nothing where the source has none.
    fn decode(&self, id: TileId) -> Result<Option<TileImage>, PictureFault>;

    /// Bytes of a decoded tile, as far as it is known before.
    fn tile_bytes(&self) -> usize;

    /// The picture that is held in memory for its tiles, if there is one.
    fn whole(&self) -> Option<&WholePicture> {
        None
    }
}
