//! Pictures for a map view: where a file's picture lies, and the decoded tiles that a view needs.
//! Reads files and decodes on threads; no network, no window.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use armor_tiles::{PlaneBounds, Source, TileImage, TileState, Tiles};
//!
//! let source = Source::open(Path::new("site.png"))?;
//! // A view of 40 m × 30 m on 800 × 600 pixels, in the source's own reference.
//! let view = PlaneBounds::new(0.0, 0.0, 40.0, 30.0);
//! let wanted = source.wanted(view, 20.0);
//!
//! let mut tiles: Tiles<TileImage> = Tiles::new(|| println!("a tile is ready"))?;
//! let layer = tiles.add(source);
//! tiles.want(wanted.iter().map(|&id| (layer, id)));
//! tiles.receive(|_, _, image| image);
//! if let TileState::Ready(image) = tiles.get(layer, wanted[0]) {
//!     println!("{} × {} pixels at {:?}", image.width, image.height, image.corners);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod attribution;
mod directory;
mod drawn_plan;
mod error;
mod geo_keys;
mod geojson;
mod geotiff;
mod limits;
mod map_server;
mod mbtiles;
mod paint;
mod picture;
mod pixel_placement;
mod pixels;
mod pmtiles;
mod projection;
mod pyramid;
mod reader;
mod reference;
mod source;
mod svg_world;
mod tile;
mod tiles;
mod web_tiles;
mod workers;
mod world_file;

pub use error::{DecodeError, OpenError, OpenFault, PictureFault};
pub use limits::MAX_TILE_MEMORY;
pub use pixel_placement::PixelPlacement;
pub use reference::{MapReference, PlacingError, PlaneBounds, PlanePoint, PlaneView};
pub use source::{Source, SourceKind};
pub use tile::{MAX_WANTED_TILES, TileId, TileImage};
pub use tiles::{LayerKey, TileState, Tiles};
