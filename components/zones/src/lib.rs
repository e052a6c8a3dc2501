//! The zones of a map as algorithms use them. [`ZoneMap`] is all of them, [`Barrier`] a border that
//! no robot may cross, `outline` measures distances. Pure: no IO, no clock, no messages.

mod barrier;
mod outline;
mod zone_map;

pub use barrier::Barrier;
pub use zone_map::{MAX_ZONE_CORNERS, MAX_ZONES, MapZone, ZoneDuty, ZoneMap, ZoneMapError};
