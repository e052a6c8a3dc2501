//! Where a robot begins in its world.

use armor_grid::Pose2;

/// Where a robot begins.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldStart {
    /// The id of the circle in the drawing.
    pub id: String,
    /// Where it begins if there is no such circle: on the sheet of a drawing as its circle would
    /// be (x right, y down), in the frame of a grid map (y up); heading anticlockwise from x.
    pub otherwise: Option<Pose2>,
}

impl Default for WorldStart {
    fn default() -> Self {
        Self { id: "start".to_owned(), otherwise: None }
    }
}
