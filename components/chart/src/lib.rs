//! Publishes what is drawn on a map: its zones, and the grid of a file. `zone_text` reads zones as
//! people write them; `ports` alone handles messages.

mod ports;
mod zone_text;

pub use ports::Chart;
pub use zone_text::{ZoneTextError, ZoneTextFault, parse_zones};
