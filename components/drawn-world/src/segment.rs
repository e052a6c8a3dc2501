//! A straight piece of wall.

/// A straight piece of wall between two points (x, y), in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end.
    pub from_m: (f64, f64),
    /// The other end.
    pub to_m: (f64, f64),
}
