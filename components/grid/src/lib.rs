//! Grid geometry shared by the mapping and navigation algorithms: planar poses, grids in metres,
//! line traversal, distance transform, inflated costs and shortest paths. Pure: no IO, no clock,
//! no messages.

mod cost;
mod distance;
mod grid;
mod pose;
mod search;
mod traversal;

pub use cost::{CostMap, Inflation, Occupancy, Thresholds};
pub use distance::distance_transform;
pub use grid::{Cell, Geometry, Grid};
pub use pose::{Point2, Pose2, wrap_angle};
pub use search::{shortest_path, wavefront};
pub use traversal::{Traversal, traverse};
