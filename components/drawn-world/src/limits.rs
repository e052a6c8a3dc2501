//! What a drawing may hold: far beyond any building, small enough to stay quick and bounded.

/// Bytes of a file: a large building drawn by hand has a tenth of it.
pub(crate) const BYTES: usize = 4 << 20;
/// Nesting, as the mission file has it.
pub(crate) const DEPTH: usize = 32;
/// Elements, annotations included.
pub(crate) const ELEMENTS: usize = 50_000;
/// Attributes of one element; drawing programs write a dozen.
pub(crate) const ATTRIBUTES: usize = 64;
/// Straight walls in all; keeps the search tree in a few tens of megabytes.
pub const SEGMENTS: usize = 200_000;
/// People in a world; each costs a little for every beam.
pub(crate) const PEOPLE: usize = 100;
/// Highest speed of a person, in metres per second.
pub(crate) const SPEED_MPS: f64 = 10.0;
/// Distance of any point from the origin, in metres: keeps single-precision boxes within 0.1 mm.
pub(crate) const COORDINATE_M: f64 = 1000.0;
