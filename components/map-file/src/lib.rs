//! Reads grid maps as `map_server` has them: a YAML file and a grey picture. No messages, no clock.

mod map_error;
mod map_server;
mod pgm;

pub use map_error::{MapFileError, MapFileFault};
pub use map_server::{MapDescription, read_grey_picture, read_map_cells, read_solid_cells};
pub use pgm::{GreyPicture, PgmFault};
