//! A length that something must keep from something else.

use crate::error::ShapeError;
use crate::map_point::MAX_COORDINATE_M;

/// Smaller ones become zero, so that no product of the exact predicates underflows.
const MIN_CLEARANCE_M: f64 = 1e-15;

/// A distance to keep, or a half width: at least 0 m, at most 100,000 km.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Clearance(f64);

impl Clearance {
    /// No distance: touching is allowed.
    pub const ZERO: Self = Self(0.0);

    /// The length `metres`.
    ///
    /// # Errors
    /// A length that is negative, not finite, or too large.
    pub fn new(metres: f64) -> Result<Self, ShapeError> {
        if (0.0..=MAX_COORDINATE_M).contains(&metres) {
            Ok(Self(if metres < MIN_CLEARANCE_M { 0.0 } else { metres }))
        } else {
            Err(ShapeError::Length { value: metres })
        }
    }

    /// The sum of two lengths, such as a margin and half the width of a robot; rounded up, so that
    /// the sum is never less than its parts require.
    ///
    /// # Errors
    /// A sum that is too large.
    pub fn plus(self, other: Self) -> Result<Self, ShapeError> {
        let sum = self.0 + other.0;
        let is_exact = sum - self.0 == other.0 && sum - other.0 == self.0;
        Self::new(if is_exact { sum } else { sum.next_up() })
    }

    /// Metres.
    pub fn metres(self) -> f64 {
        self.0
    }
}
