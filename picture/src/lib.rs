//! Pictures without a window: what egui would show, as pixels painted by ourselves or as an SVG.
//! No display and no GPU are needed, and the same shapes give the same bytes on every machine.
//! Start with [`Stage`], which runs frames; `raster` paints their triangles.

mod pixels;
mod png;
mod raster;
mod stage;
pub mod svg;

pub use pixels::{Pixels, Textures};
pub use png::EncodeError;
pub use raster::paint;
pub use stage::Stage;
