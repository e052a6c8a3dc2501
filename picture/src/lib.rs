//! Pictures without a window or a GPU. The same content gives the same bytes on every machine.
//!
//! [`canvas`] is an RGB image with a few shapes; [`plot_sheet`] and [`chart`] draw curves,
//! histograms and trajectories as SVG or PNG. With the feature `egui`, `Stage` runs frames of an
//! egui user interface, `raster` paints their triangles, and `svg` writes their shapes. The look of
//! the programs with a window is here, too: `theme` has its colours and sizes, `icons` its signs.

pub mod canvas;
pub mod chart;
pub mod plot_sheet;

#[cfg(feature = "egui")]
pub mod icons;
#[cfg(feature = "egui")]
mod pixels;
#[cfg(feature = "egui")]
mod png;
#[cfg(feature = "egui")]
mod raster;
#[cfg(feature = "egui")]
mod stage;
#[cfg(feature = "egui")]
pub mod svg;
#[cfg(feature = "egui")]
pub mod theme;

#[cfg(feature = "egui")]
pub use crate::png::PixelsPngError;
#[cfg(feature = "egui")]
pub use pixels::{Pixels, Textures};
#[cfg(feature = "egui")]
pub use raster::paint_primitives;
#[cfg(feature = "egui")]
pub use stage::Stage;
