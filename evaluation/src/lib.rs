//! How good a trajectory or a map is. Pure: text and grids in, numbers and charts out.
//!
//! [`trajectory`] and [`columns`] read CSV. [`relations`] judges a trajectory by known relations
//! between its scans, [`alignment`] by a reference. [`map_score`] scores a map against the true
//! one, [`map_agreement`] compares maps in different frames. [`plots`] draws the results.

pub mod alignment;
pub mod columns;
pub mod error;
pub mod map_agreement;
pub mod map_score;
pub mod plots;
pub mod relations;
pub mod statistics;
pub mod trajectory;
