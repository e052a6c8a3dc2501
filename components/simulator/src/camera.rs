//! A camera: one ray per column of the picture, walls of one height shaded by distance and
//! direction, people and robots before them, floor and ceiling. As early computer games drew their
//! worlds; enough to see what is ahead, and people have the outline by which detectors find them.

use crate::pose::{Portable, Pose2};
use crate::scene::{BodyKind, WorldScene};

/// The camera and its pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraModel {
    /// Columns of a picture.
    pub width: u32,
    /// Rows of a picture.
    pub height: u32,
    /// Angle from the left to the right edge of a picture, in radians, less than a half turn.
    pub field_of_view_rad: f64,
    /// Where it sits on the base, and where it looks.
    pub mount: Pose2,
    /// How high it sits above the floor, in metres.
    pub above_m: f64,
}

impl Default for CameraModel {
    fn default() -> Self {
        Self {
            width: 160,
            height: 120,
            field_of_view_rad: 70f64.to_radians(),
            mount: Pose2::new(0.1, 0.0, 0.0),
            above_m: 0.4,
        }
    }
}

type Rgb = [u8; 3];

/// How high walls are, in metres.
const WALL_M: f64 = 2.5;
const WALL: Rgb = [222, 214, 196];
const PERSON: Rgb = [214, 120, 60];
const ROBOT: Rgb = [70, 110, 190];
const FLOOR: Rgb = [120, 104, 88];
const CEILING: Rgb = [232, 236, 240];
/// What is this far away has half of its brightness left, in metres.
const HALF_BRIGHT_M: f64 = 12.0;
/// Nothing is seen beyond, in metres.
const FAR_M: f64 = 100.0;
/// Nothing is drawn larger than as if it were this near, in metres.
const NEAR_M: f64 = 0.02;

impl CameraModel {
    /// Takes a picture from where the base is: rows from the top, each from the left, three bytes a
    /// pixel (red, green, blue).
    pub fn picture(&self, scene: WorldScene<'_>, map_from_base: Pose2) -> Vec<u8> {
        let eye = map_from_base.then(self.mount);
        let columns: Vec<PictureColumn> =
            (0..self.width).map(|column| self.look_along(scene, eye, column)).collect();
        let mut rgb = vec![0; 3 * self.width as usize * self.height as usize];
        for (index, column) in columns.iter().enumerate() {
            // The next column's wall gives the direction that this one's faces.
            let neighbour = columns.get(index + 1).or_else(|| columns[..index].last());
            let facing = neighbour.map_or(1.0, |neighbour| column.facing(neighbour));
            for row in 0..self.height {
                let at = 3 * (row as usize * self.width as usize + index);
                rgb[at..at + 3].copy_from_slice(&self.pixel_colour(column, row, facing));
            }
        }
        rgb
    }

    /// The distance of the picture from the eye, in pixels.
    fn focal_pixels(&self) -> f64 {
        f64::from(self.width) / 2.0 / libm::tan(self.field_of_view_rad / 2.0)
    }

    fn look_along(&self, scene: WorldScene<'_>, eye: Pose2, column: u32) -> PictureColumn {
        let aside = f64::from(self.width) / 2.0 - f64::from(column) - 0.5;
        let angle_rad = libm::atan2(aside, self.focal_pixels());
        let ray = eye.then(Pose2::new(0.0, 0.0, angle_rad));
        // Depth along the camera's axis, so that straight walls stay straight.
        let cos = libm::cos(angle_rad);
        let depth_m = |range_m: f64| (range_m * cos).max(NEAR_M);
        let wall_range_m = scene.world.range_m(ray, FAR_M);
        let mut bodies: Vec<SeenBody> = scene
            .bodies
            .iter()
            .filter_map(|body| Some((body.range_m(ray)?, body)))
            .filter(|(range_m, _)| wall_range_m.is_none_or(|wall_m| *range_m < wall_m))
            .map(|(range_m, body)| {
                let (ahead_m, aside_m) = body.seen_along(ray);
                // A person is a flat figure that faces the camera, a robot is round.
                let range_m = if body.kind == BodyKind::Person { ahead_m } else { range_m };
                SeenBody { depth_m: depth_m(range_m), aside_m, kind: body.kind }
            })
            .collect();
        bodies.sort_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
        let wall = wall_range_m.map(|range_m| (depth_m(range_m), ray.point_from(range_m, 0.0)));
        PictureColumn { wall, bodies }
    }

    /// What is seen in a pixel: the nearest of what its line of sight meets.
    fn pixel_colour(&self, column: &PictureColumn, row: u32, facing: f64) -> Rgb {
        let down = f64::from(row) + 0.5 - f64::from(self.height) / 2.0;
        // How much lower than the eye a line of sight is, for each metre ahead.
        let slope = down / self.focal_pixels();
        let height_m = |depth_m: f64| self.above_m - slope * depth_m;
        for body in &column.bodies {
            let above_m = height_m(body.depth_m);
            let (is_met, colour) = match body.kind {
                BodyKind::Person => (is_of_person(body.aside_m, above_m), PERSON),
                BodyKind::Robot | BodyKind::Wall => ((0.0..0.4).contains(&above_m), ROBOT),
            };
            if is_met {
                return shade_colour(colour, body.depth_m, 1.0);
            }
        }
        match column.wall {
            Some((depth_m, _)) if (0.0..WALL_M).contains(&height_m(depth_m)) => {
                shade_colour(WALL, depth_m, facing)
            }
            _ if slope > 0.0 => shade_colour(FLOOR, self.above_m / slope, 1.0),
            _ => shade_colour(CEILING, (self.above_m - WALL_M) / slope.min(-1e-9), 1.0),
        }
    }
}

/// What lies in the direction of a column.
struct PictureColumn {
    /// The depth of the wall, in metres, and where it is.
    wall: Option<(f64, (f64, f64))>,
    /// What is before it, the nearest first.
    bodies: Vec<SeenBody>,
}

/// A body in the direction of a column.
struct SeenBody {
    depth_m: f64,
    /// How far its middle is from the line of sight.
    aside_m: f64,
    kind: BodyKind,
}

/// Whether a point of the figure of a standing person is theirs: `aside_m` from the middle, `above_m`
/// the floor. Two legs, a trunk with arms, shoulders, neck and head, 1.75 m tall.
fn is_of_person(aside_m: f64, above_m: f64) -> bool {
    let aside_m = aside_m.abs();
    let half_width_m = match above_m {
        0.0..0.8 if aside_m < 0.03 => 0.0,
        0.0..0.8 => 0.17,
        0.8..1.35 => 0.22,
        1.35..1.48 => 0.22 - 0.14 * (above_m - 1.35) / 0.13,
        1.48..1.52 => 0.07,
        1.52..1.75 => {
            let from_middle = (above_m - 1.635) / 0.115;
            0.1 * libm::sqrt((1.0 - from_middle * from_middle).max(0.0))
        }
        _ => 0.0,
    };
    aside_m < half_width_m
}

impl PictureColumn {
    /// How bright a wall is by the direction in which it runs, 0.6 to 1, from where two columns
    /// meet it.
    fn facing(&self, neighbour: &Self) -> f64 {
        let (Some((_, here)), Some((_, there))) = (self.wall, neighbour.wall) else { return 1.0 };
        let (x, y) = (there.0 - here.0, there.1 - here.1);
        let length_m = libm::hypot(x, y);
        if length_m < 1e-9 { 1.0 } else { 0.6 + 0.4 * (x / length_m).abs() }
    }
}

fn shade_colour(colour: Rgb, depth_m: f64, facing: f64) -> Rgb {
    let bright = facing / (1.0 + depth_m / HALF_BRIGHT_M);
    colour.map(|part| (f64::from(part) * bright) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Body;
    use crate::world::World;

    fn room() -> World {
        let text = r#"<svg><rect x="-4" y="-4" width="8" height="8"/><circle id="start"/></svg>"#;
        World::parse("room.svg", text.as_bytes()).expect("a readable world")
    }

    const CAMERA: CameraModel = CameraModel {
        width: 81,
        height: 61,
        field_of_view_rad: 1.2,
        mount: Pose2::IDENTITY,
        above_m: 0.4,
    };

    /// The colour of a pixel of a picture taken at a pose.
    fn pixel(bodies: &[Body], pose: Pose2, column: usize, row: usize) -> Rgb {
        let world = room();
        let rgb = CAMERA.picture(WorldScene { world: &world, bodies }, pose);
        assert_eq!(rgb.len(), 3 * 81 * 61);
        let at = 3 * (row * 81 + column);
        [rgb[at], rgb[at + 1], rgb[at + 2]]
    }

    #[test]
    fn the_wall_is_between_floor_and_ceiling_and_darker_from_afar() {
        let near = pixel(&[], Pose2::new(2.0, 0.0, 0.0), 40, 30);
        let far = pixel(&[], Pose2::new(-3.0, 0.0, 0.0), 40, 30);
        assert!(near[0] > far[0] && near[2] > far[2], "{near:?} {far:?}");
        let ends = [0, 60].map(|row| pixel(&[], Pose2::new(-3.0, 0.0, 0.0), 40, row));
        let [ceiling, floor] = ends;
        assert!(ceiling[2] > ceiling[0] && floor[0] > floor[2], "{ceiling:?} {floor:?}");
    }

    #[test]
    fn walls_of_a_corner_differ() {
        let at_corner =
            |column| pixel(&[], Pose2::new(0.0, 0.0, std::f64::consts::FRAC_PI_4), column, 30);
        let (left, right) = (at_corner(20), at_corner(60));
        assert!(left[0].abs_diff(right[0]) > 20, "{left:?} {right:?}");
    }

    #[test]
    fn a_person_has_legs_shoulders_and_a_head() {
        let width_m = |above_m: f64| {
            (-300..300).filter(|it| is_of_person(f64::from(*it) / 1000.0, above_m)).count()
        };
        let [head, neck, shoulders, legs] = [1.64, 1.5, 1.3, 0.4].map(width_m);
        assert!(neck < head && head < legs && legs < shoulders, "{head} {neck} {legs} {shoulders}");
        assert!(!is_of_person(0.0, 0.4), "between the legs");
        assert_eq!((width_m(1.76), width_m(-0.01)), (0, 0));
    }

    #[test]
    fn a_person_stands_before_the_wall_on_the_side_where_they_are() {
        let person = Body { x_m: 2.0, y_m: 0.6, radius_m: 0.25, kind: BodyKind::Person };
        let is_person = |colour: Rgb| colour[0] > 2 * colour[2];
        assert!(is_person(pixel(&[person], Pose2::default(), 22, 15)), "to the left");
        assert!(!is_person(pixel(&[person], Pose2::default(), 58, 15)));
        // A robot is lower than the eye, and hides no wall.
        let robot = Body { x_m: 2.0, y_m: 0.0, radius_m: 0.2, kind: BodyKind::Robot };
        let wall = pixel(&[], Pose2::default(), 40, 25);
        assert_eq!(pixel(&[robot], Pose2::default(), 40, 25), wall);
        let colour = pixel(&[robot], Pose2::default(), 40, 34);
        assert!(colour[2] > colour[0], "{colour:?}");
    }
}
