//! The world as the robot meets it, in the map frame, whose origin is the start pose: walls drawn
//! as SVG, or the cells of a grid map. Both have the same outlines; rays find drawn walls by a tree
//! and cells by walking over the grid.

use std::path::Path;

pub use armor_drawn_world::{DrawingError, DrawingFault, Segment, WorldStart};
use armor_drawn_world::{WalkedRoute, WorldDrawing};
use armor_map_file::{MapFileError, read_solid_cells};

use crate::pose::{Portable, Pose2};
use crate::raster::{Raster, SolidCells};
use crate::walls::Walls;

/// An axis-aligned extent in the map frame, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The smallest x and y.
    pub min_m: (f64, f64),
    /// The largest x and y.
    pub max_m: (f64, f64),
}

/// Why there is no world to be in.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// The drawing cannot be read.
    #[error(transparent)]
    Drawing(#[from] DrawingError),
    /// The grid map cannot be read.
    #[error(transparent)]
    Map(#[from] MapFileError),
    /// A wall is too near to the start.
    #[error(
        "{place}: the start is {clearance_m:.2} m from a wall, the base has a radius of \
         {radius_m:.2} m; move the start into the open"
    )]
    StartBlocked {
        /// The file, with the line of the start if it is drawn.
        place: String,
        /// Radius of the base, in metres.
        radius_m: f64,
        /// Distance to the nearest wall, in metres; 0 within one.
        clearance_m: f64,
    },
}

/// A world, in the map frame (REP-103, origin and heading of the start).
#[derive(Clone)]
pub struct World {
    /// Where it was read, for errors: file and line of the start.
    place: String,
    /// The start in the frame of the drawing with y up, or of the grid map.
    sheet_from_map: Pose2,
    walls: Walls,
    raster: Option<Raster>,
    routes: Vec<WalkedRoute>,
}

impl World {
    /// Reads a world from an SVG drawing, or from the YAML file of a grid map.
    ///
    /// # Errors
    /// The first fault of the file, with its line.
    pub fn read(path: &Path) -> Result<Self, WorldError> {
        Self::read_from(path, &WorldStart::default())
    }

    /// Reads a world in which the robot begins somewhere of its own.
    ///
    /// # Errors
    /// The first fault of the file, with its line; no such start in the drawing.
    pub fn read_from(path: &Path, start: &WorldStart) -> Result<Self, WorldError> {
        let is_map = path.extension().is_some_and(|e| e == "yaml" || e == "yml");
        if is_map {
            let (solid, sheet_from_cells) = read_solid_cells(path)?;
            let sheet_from_map = start.otherwise.unwrap_or_default();
            let map_from_cells = sheet_from_map.inverted().then(sheet_from_cells);
            let file = path.display().to_string();
            let cells = SolidCells { file: file.clone(), solid };
            Ok(Self::from_raster(file, sheet_from_map, Raster::new(cells, map_from_cells)?))
        } else {
            Ok(Self::from_drawing(path.display().to_string(), WorldDrawing::read(path, start)?))
        }
    }

    /// Reads the world from the bytes of a drawing; `file` names it in errors.
    ///
    /// # Errors
    /// The first fault of the drawing, with file and line.
    pub fn parse(file: &str, bytes: &[u8]) -> Result<Self, DrawingError> {
        Ok(Self::from_drawing(
            file.to_owned(),
            WorldDrawing::parse(file, bytes, &WorldStart::default())?,
        ))
    }

    fn from_drawing(file: String, drawing: WorldDrawing) -> Self {
        let map_from_sheet = drawing.start.inverted();
        let moved = |(x_m, y_m): (f64, f64)| map_from_sheet.point_from(x_m, y_m);
        let segments = drawing
            .segments
            .iter()
            .map(|wall| Segment { from_m: moved(wall.from_m), to_m: moved(wall.to_m) });
        let place = drawing.start_line.map_or(file.clone(), |line| format!("{file}:{line}"));
        let routes = drawing.routes.into_iter().map(|route| route.moved(moved)).collect();
        Self {
            place,
            sheet_from_map: drawing.start,
            walls: Walls::new(segments.collect()),
            raster: None,
            routes,
        }
    }

    fn from_raster(place: String, sheet_from_map: Pose2, raster: Raster) -> Self {
        let walls = Walls::new(raster.outlines());
        Self { place, sheet_from_map, walls, raster: Some(raster), routes: Vec::new() }
    }

    /// All walls as outlines; never empty.
    pub fn segments(&self) -> &[Segment] {
        self.walls.segments()
    }

    /// The routes of the people in it.
    pub fn routes(&self) -> &[WalkedRoute] {
        &self.routes
    }

    /// The start in the frame of the drawing with y up, or of the grid map: what several robots
    /// in one world have in common.
    pub fn sheet_from_map(&self) -> Pose2 {
        self.sheet_from_map
    }

    /// The extent of all walls.
    pub fn extent(&self) -> Extent {
        let mut extent = Extent {
            min_m: (f64::INFINITY, f64::INFINITY),
            max_m: (f64::NEG_INFINITY, f64::NEG_INFINITY),
        };
        for (x, y) in self.segments().iter().flat_map(|wall| [wall.from_m, wall.to_m]) {
            extent.min_m = (extent.min_m.0.min(x), extent.min_m.1.min(y));
            extent.max_m = (extent.max_m.0.max(x), extent.max_m.1.max(y));
        }
        extent
    }

    /// Checks that a round base fits where it starts.
    ///
    /// # Errors
    /// [`WorldError::StartBlocked`] when a wall is nearer than the radius.
    pub fn check_start(&self, radius_m: f64) -> Result<(), WorldError> {
        let is_inside = self.raster.as_ref().is_some_and(|raster| raster.is_solid_at(0.0, 0.0));
        let clearance_m = if is_inside { 0.0 } else { self.clearance_m(0.0, 0.0) };
        if clearance_m > radius_m {
            return Ok(());
        }
        Err(WorldError::StartBlocked { place: self.place.clone(), radius_m, clearance_m })
    }

    /// The distance from a pose along its heading to the first wall, if one is nearer than
    /// `max_range_m` (metres).
    pub fn range_m(&self, from: Pose2, max_range_m: f64) -> Option<f64> {
        match &self.raster {
            Some(raster) => raster.range_m(from, max_range_m),
            None => self.walls.range_m(from, max_range_m),
        }
    }

    /// The distance from a point in the map frame to the nearest wall, in metres.
    pub fn clearance_m(&self, x_m: f64, y_m: f64) -> f64 {
        self.walls.nearest(x_m, y_m).map_or(f64::INFINITY, |(away_m, _)| away_m)
    }

    /// The point of the walls that is nearest to a point in the map frame, and how far away it is.
    pub(crate) fn nearest(&self, x_m: f64, y_m: f64) -> Option<(f64, (f64, f64))> {
        self.walls.nearest(x_m, y_m)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use super::*;

    fn world(shapes: &str, start: &str) -> World {
        let text = format!(r#"<svg>{shapes}<circle id="start" {start}/></svg>"#);
        World::parse("world.svg", text.as_bytes()).expect("a readable world")
    }

    #[test]
    fn rays_in_a_box_have_the_analytic_length() {
        let world = world(r#"<rect x="-2" y="-1" width="5" height="3"/>"#, "");
        // y up: the box is x −2..3, y −2..1 around the start.
        for beam in 0..720 {
            let yaw_rad = TAU * f64::from(beam) / 720.0;
            let to_x = if yaw_rad.cos() >= 0.0 { 3.0 } else { -2.0 } / yaw_rad.cos();
            let to_y = if yaw_rad.sin() >= 0.0 { 1.0 } else { -2.0 } / yaw_rad.sin();
            let range_m =
                world.range_m(Pose2::new(0.0, 0.0, yaw_rad), 100.0).expect("a closed box");
            assert!((range_m - to_x.min(to_y)).abs() < 1e-9, "{beam}: {range_m}");
        }
    }

    #[test]
    fn rays_to_a_pillar_have_the_analytic_length() {
        let world = world(r#"<circle cx="4" cy="0" r="0.5"/>"#, "");
        for degrees in -12..=12 {
            let yaw_rad = f64::from(degrees).to_radians();
            let hit = world.range_m(Pose2::new(0.0, 0.0, yaw_rad), 10.0);
            let aside_m = 4.0 * yaw_rad.sin();
            if aside_m.abs() < 0.499 {
                let expected = 4.0 * yaw_rad.cos() - (0.25 - aside_m * aside_m).sqrt();
                assert!((hit.expect("a hit") - expected).abs() < 0.006, "{degrees}");
            } else if aside_m.abs() > 0.5 {
                assert_eq!(hit, None, "{degrees}");
            }
        }
    }

    #[test]
    fn the_map_frame_is_the_start_pose() {
        let world =
            world(r#"<line x1="-9" y1="3" x2="9" y2="3"/>"#, r#"cx="5" cy="8" data-heading="90""#);
        // The wall is 5 m above the start on the sheet: straight ahead.
        assert!((world.range_m(Pose2::default(), 10.0).expect("ahead") - 5.0).abs() < 1e-9);
        assert!((world.clearance_m(0.0, 0.0) - 5.0).abs() < 1e-9);
        assert!((world.clearance_m(2.0, 7.0) - 3.0).abs() < 1e-9);
        assert_eq!(world.range_m(Pose2::new(0.0, 0.0, PI), 100.0), None);
        assert_eq!(world.range_m(Pose2::default(), 4.9), None, "beyond the range");
    }

    #[test]
    fn a_wall_is_met_end_on_and_grazing() {
        let world = world(r#"<line x1="2" y1="0" x2="5" y2="0"/>"#, "");
        assert_eq!(world.range_m(Pose2::default(), 10.0), Some(2.0));
        let grazing = world.range_m(Pose2::new(0.0, 0.001, -0.0003), 10.0).expect("at 3.3 m");
        assert!((grazing - 3.333).abs() < 0.01, "{grazing}");
        assert_eq!(world.range_m(Pose2::new(6.0, 0.0, 0.0), 10.0), None, "it is behind");
    }

    #[test]
    fn the_clearance_is_to_the_nearest_wall() {
        let world = world(r#"<rect x="1" y="-1" width="2" height="2"/>"#, "");
        for (x_m, y_m, expected_m) in
            [(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (4.0, 2.0, 2.0f64.sqrt()), (2.0, 0.75, 0.25)]
        {
            assert!((world.clearance_m(x_m, y_m) - expected_m).abs() < 1e-12, "{x_m} {y_m}");
        }
    }

    #[test]
    fn a_start_in_a_wall_is_refused_with_its_line() {
        let text =
            "<svg>\n<line x1=\"0.1\" y1=\"-1\" x2=\"0.1\" y2=\"1\"/>\n<circle id=\"start\"/></svg>";
        let world = World::parse("world.svg", text.as_bytes()).expect("readable");
        assert_eq!(world.check_start(0.05), Ok(()));
        let error = world.check_start(0.18).expect_err("too near");
        assert!(error.to_string().starts_with("world.svg:3: "), "{error}");
        assert!(error.to_string().contains("0.10 m"), "{error}");
    }

    #[test]
    fn no_ray_leaks_through_a_corner() {
        let world = world(r#"<rect x="-1.3" y="-0.7" width="2.9" height="1.9"/>"#, "");
        for corner in world.segments() {
            let yaw_rad = libm::atan2(corner.from_m.1, corner.from_m.0);
            for nudge in -20..=20 {
                let from = Pose2::new(0.0, 0.0, yaw_rad + f64::from(nudge) * 1e-16);
                assert!(world.range_m(from, 10.0).is_some(), "{corner:?} {nudge}");
            }
        }
        assert!(world.range_m(Pose2::new(0.0, 0.0, FRAC_PI_2), 10.0).is_some());
    }
}
