//! A robot on the map: its newest pose, how old that is, and where it has been.

use std::collections::VecDeque;
use std::f64::consts::PI;

use armor_geo::MapPoint;
use armor_inspect::ValueLook;
use armor_sdk::messages::{
    Odometry, Path, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion,
};
use armor_wire::WireType;
use armor_wire::codec;

/// A pose that is older is drawn as old, in seconds.
pub const OLD_S: f64 = 2.0;
/// Points of a trail are this far apart at least, in metres.
const TRAIL_STEP_M: f64 = 0.05;
/// Most points of a trail; then every second one is left out.
const MAX_TRAIL: usize = 4_000;
/// Most points of a path that are used.
const MAX_PATH: usize = 2_000;

/// A robot, as the output that its route names reports it.
#[derive(Default)]
pub struct ShownRobot {
    /// Its route.
    pub route: String,
    /// Its radius.
    pub radius_m: f64,
    /// The output with its pose.
    pub output: Option<String>,
    /// Where it was seen last.
    pub pose: Option<RobotPose>,
    /// Where it has been, the oldest first.
    pub trail: VecDeque<MapPoint>,
    /// The path that it is about to drive.
    pub path: Vec<MapPoint>,
    /// Why it is not drawn, if it is not.
    pub why_not: Option<String>,
    /// The message that the pose is of, and when it was seen here, in seconds of the window.
    seen: Option<((u64, u64), f64)>,
}

/// A pose on the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotPose {
    /// Where it is.
    pub at: MapPoint,
    /// Its heading, counterclockwise from the x axis.
    pub yaw_rad: f64,
}

impl ShownRobot {
    /// The robot of a route, of which nothing has been seen.
    pub fn of_route(route: &str, radius_m: f64, output: Option<&str>) -> Self {
        let (route, output) = (route.to_owned(), output.map(str::to_owned));
        Self { route, radius_m, output, ..Self::default() }
    }

    /// Takes the newest value of its output; `now_s` is the time of the window.
    pub fn take(&mut self, look: &ValueLook, now_s: f64) {
        self.take_on(look, now_s, &Some);
    }

    /// The same on another map than that of the pose: `bring` gives the pose there.
    pub fn take_on(
        &mut self,
        look: &ValueLook,
        now_s: f64,
        bring: &dyn Fn(RobotPose) -> Option<RobotPose>,
    ) {
        let Some(data) = &look.data else {
            let nothing = "no pose has arrived yet";
            let problem = if look.problem.is_empty() { nothing } else { &look.problem };
            self.why_not = Some(problem.to_owned());
            return;
        };
        let key = (data.header.instance, data.header.sequence);
        if self.seen.is_some_and(|(known, _)| known == key) {
            return;
        }
        self.seen = Some((key, now_s));
        match look.schema.as_deref().and_then(|schema| read_pose(schema.hash(), &data.payload)) {
            None => self.lose(format!("a {} is no pose", look.type_name)),
            Some((frame, _)) if !is_of_file(&frame) => self.lose(format!(
                "its pose is in `{frame}`, whose origin is not that of the file: the map was begun again"
            )),
            Some((_, pose)) => match place_of(&pose).and_then(bring) {
                None => self.lose("its pose has no position".to_owned()),
                Some(pose) => self.go_to(pose),
            },
        }
    }

    fn lose(&mut self, why: String) {
        self.why_not = Some(why);
        self.pose = None;
        self.trail.clear();
    }

    fn go_to(&mut self, pose: RobotPose) {
        (self.why_not, self.pose) = (None, Some(pose));
        let is_new = |last: &MapPoint| last.distance_m(pose.at) >= TRAIL_STEP_M;
        if self.trail.back().is_none_or(is_new) {
            self.trail.push_back(pose.at);
        }
        if self.trail.len() > MAX_TRAIL {
            let thinned = self.trail.iter().step_by(2).copied();
            self.trail = thinned.collect();
        }
    }

    /// How old its pose is, in seconds, counted from when it arrived here.
    pub fn age_s(&self, now_s: f64) -> Option<f64> {
        self.seen.map(|(_, seen_s)| (now_s - seen_s).max(0.0))
    }

    /// Whether its pose is old.
    pub fn is_old(&self, now_s: f64) -> bool {
        self.age_s(now_s).is_none_or(|age_s| age_s > OLD_S)
    }

    /// Where it is, if that is known and not old.
    pub fn present(&self, now_s: f64) -> Option<MapPoint> {
        self.pose.filter(|_| !self.is_old(now_s)).map(|pose| pose.at)
    }
}

/// Coordinates of the file belong to the first epoch of a frame, whose name has no `#`.
pub fn is_of_file(frame: &str) -> bool {
    !frame.contains('#')
}

/// The frame and the pose of a message that has one.
fn read_pose(hash: u64, payload: &[u8]) -> Option<(String, Pose)> {
    if hash == PoseWithCovarianceStamped::schema().hash() {
        let message: PoseWithCovarianceStamped = codec::decode(payload).ok()?;
        Some((message.frame, message.pose.pose))
    } else if hash == PoseStamped::schema().hash() {
        let message: PoseStamped = codec::decode(payload).ok()?;
        Some((message.frame, message.pose))
    } else if hash == Odometry::schema().hash() {
        let message: Odometry = codec::decode(payload).ok()?;
        Some((message.frame, message.pose.pose))
    } else {
        None
    }
}

fn place_of(pose: &Pose) -> Option<RobotPose> {
    let at = MapPoint::new(pose.position.x, pose.position.y).ok()?;
    Some(RobotPose { at, yaw_rad: yaw_of(&pose.orientation) })
}

/// The heading of an orientation; 0 of one without a direction.
fn yaw_of(turn: &Quaternion) -> f64 {
    let across = 2.0 * (turn.w * turn.z + turn.x * turn.y);
    let along = 1.0 - 2.0 * (turn.y * turn.y + turn.z * turn.z);
    let yaw_rad = across.atan2(along);
    if yaw_rad.is_finite() { yaw_rad.clamp(-PI, PI) } else { 0.0 }
}

/// The points of a published path; none of another type or of another epoch.
pub fn read_path(look: &ValueLook) -> Vec<MapPoint> {
    let (Some(schema), Some(data)) = (&look.schema, &look.data) else { return Vec::new() };
    if schema.hash() != Path::schema().hash() {
        return Vec::new();
    }
    let Ok(path) = codec::decode::<Path>(&data.payload) else { return Vec::new() };
    if !is_of_file(&path.frame) {
        return Vec::new();
    }
    let points = path.poses.iter().take(MAX_PATH).map(|stamped| stamped.pose.position);
    points.filter_map(|at| MapPoint::new(at.x, at.y).ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_is_the_turn_about_the_vertical() {
        let yaw = |degrees: f64| {
            let half = degrees.to_radians() / 2.0;
            let turn = Quaternion { x: 0.0, y: 0.0, z: half.sin(), w: half.cos() };
            yaw_of(&turn).to_degrees()
        };
        for degrees in [-170.0, -90.0, 0.0, 30.0, 179.0] {
            assert!((yaw(degrees) - degrees).abs() < 1e-9, "{degrees}");
        }
        let broken = Quaternion { x: f64::NAN, y: 0.0, z: 0.0, w: 0.0 };
        assert_eq!(yaw_of(&broken), 0.0);
    }

    #[test]
    fn a_trail_is_bounded_and_keeps_its_ends() {
        let mut robot = ShownRobot::default();
        for number in 0..3 * MAX_TRAIL {
            let at = MapPoint::new(number as f64, 0.0).expect("a position");
            robot.go_to(RobotPose { at, yaw_rad: 0.0 });
            robot.go_to(RobotPose { at, yaw_rad: 1.0 });
        }
        assert!(robot.trail.len() <= MAX_TRAIL);
        let (first, last) = (robot.trail.front(), robot.trail.back());
        assert_eq!(first.map(|at| at.x_m()), Some(0.0));
        assert_eq!(last.map(|at| at.x_m()), Some((3 * MAX_TRAIL - 1) as f64));
    }
}
