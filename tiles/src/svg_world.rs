//! Worlds as the simulator reads them, in the frame of the map: where the robot starts.

use std::path::Path;

use armor_drawn_world::{DrawingError, DrawingFault, WorldDrawing, WorldStart};

use crate::drawn_plan::{DrawnPlan, PlanShapes};
use crate::error::{OpenError, OpenFault};
use crate::reference::PlanePoint;

/// Opens a drawing. The start pose is the origin of the map, as it is for the simulator; a drawing
/// without a start lies as it is drawn, with y up.
pub(crate) fn open_world(path: &Path) -> Result<DrawnPlan, OpenError> {
    let read = |start: &WorldStart| WorldDrawing::read(path, start);
    let drawing = match read(&WorldStart::default()) {
        Err(DrawingError { fault: DrawingFault::NoStart(_), .. }) => {
            let otherwise = Some(Default::default());
            read(&WorldStart { otherwise, ..WorldStart::default() })
        }
        drawing => drawing,
    };
    let drawing = drawing.map_err(|error| {
        let place = if error.line == 0 { String::new() } else { format!("line {}", error.line) };
        OpenError { file: error.file, place, fault: OpenFault::Drawing(error.fault.to_string()) }
    })?;
    let (sin, cos) = drawing.start.yaw_rad.sin_cos();
    let in_map = |(x_m, y_m): (f64, f64)| {
        let (x, y) = (x_m - drawing.start.x_m, y_m - drawing.start.y_m);
        PlanePoint::new(cos * x + sin * y, cos * y - sin * x)
    };
    let walls = drawing.segments.iter();
    let lines = walls.map(|wall| vec![in_map(wall.from_m), in_map(wall.to_m)]).collect();
    DrawnPlan::new(PlanShapes { lines, ..PlanShapes::default() })
        .map_err(|fault| OpenError::new(&path.display().to_string(), "", fault))
}
