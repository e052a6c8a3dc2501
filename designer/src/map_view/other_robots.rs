//! The robots of another system that runs, on the map of the open file. Only their poses are followed: its
//! outputs are linked to while its drawing is shown.

use std::sync::Arc;

use armor_geo::{MapPlacement, MapPoint};
use armor_inspect::{WakeCallback, WatchedValues};
use armor_sdk::directory::Directory;

use crate::live::TOOL;
use crate::map_view::live::robots::{RobotPose, ShownRobot};
use crate::map_view::other_drawings::bring;

/// A step ahead of a robot, in metres, that gives its heading on another map.
const AHEAD_M: f64 = 1.0;

/// The routes of a system, as its file has them.
pub(super) struct OtherRoutes {
    /// The name of each, the radius of its robot, and the output with its pose.
    pub(super) robots: Vec<(String, f64, Option<String>)>,
    /// Where its map is in the world, and the map of the open file.
    pub(super) between: Option<[MapPlacement; 2]>,
}

/// The robots of a system that runs.
pub(super) struct OtherRobots {
    registry: String,
    routes: OtherRoutes,
    /// None while its drawing is hidden.
    values: Option<WatchedValues>,
    robots: Vec<ShownRobot>,
}

impl OtherRobots {
    /// The robots of the system whose registry listens there; nothing is linked to yet.
    pub(super) fn begin(registry: &str, routes: OtherRoutes) -> Self {
        let robots = routes.robots.iter().map(|(route, radius_m, output)| {
            ShownRobot::of_route(route, *radius_m, output.as_deref())
        });
        let robots = robots.collect();
        Self { registry: registry.to_owned(), routes, values: None, robots }
    }

    /// Takes the newest poses; of a hidden drawing none, and nothing of it is linked to any more.
    pub(super) fn follow(&mut self, is_shown: bool, wake: &WakeCallback, now_s: f64) {
        if !is_shown {
            self.values = None;
            return;
        }
        let values = self.values.get_or_insert_with(|| {
            let name = format!("{TOOL}-{}", std::process::id());
            WatchedValues::new(Directory::observer(&self.registry, &name), Arc::clone(wake))
        });
        for robot in &mut self.robots {
            let Some(output) = robot.output.clone() else { continue };
            let between = self.routes.between.as_ref();
            robot.take_on(&values.look(&output), now_s, &|pose| brought(between, pose));
        }
    }

    pub(super) fn robots(&self) -> impl Iterator<Item = &ShownRobot> {
        self.robots.iter()
    }
}

/// A pose of another map on this one.
fn brought(between: Option<&[MapPlacement; 2]>, pose: RobotPose) -> Option<RobotPose> {
    let (sin, cos) = pose.yaw_rad.sin_cos();
    let ahead = MapPoint::new(pose.at.x_m() + AHEAD_M * cos, pose.at.y_m() + AHEAD_M * sin).ok()?;
    let (at, ahead) = (bring(between, pose.at)?, bring(between, ahead)?);
    let yaw_rad = (ahead.y_m() - at.y_m()).atan2(ahead.x_m() - at.x_m());
    Some(RobotPose { at, yaw_rad })
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use armor_geo::GeoPosition;
    use armor_registry::{BackgroundRegistry, RegistryOptions};
    use armor_sdk::messages::{
        Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion,
    };
    use armor_sdk::node::{NodeOptions, SystemNode};

    use super::*;
    use crate::map_view::camera::map_point;

    /// Only a hang takes this long.
    const DEADLINE: Duration = Duration::from_secs(60);

    fn pose(x: f64) -> PoseWithCovarianceStamped {
        let position = Point { x, y: 4.0, z: 0.0 };
        let orientation = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
        let pose =
            PoseWithCovariance { pose: Pose { position, orientation }, ..Default::default() };
        PoseWithCovarianceStamped { frame: "map".into(), pose, ..Default::default() }
    }

    fn placement(heading_rad: f64) -> MapPlacement {
        let origin = GeoPosition::new(48.8583, 2.2945, 35.0).expect("a position");
        MapPlacement::new(origin, heading_rad, 1.0).expect("a placement")
    }

    #[test]
    fn the_robot_of_another_system_is_where_it_is_on_this_map() {
        let listen = "127.0.0.1:0".parse().expect("an address");
        let options = RegistryOptions { listen, ..RegistryOptions::default() };
        let registry = BackgroundRegistry::start(options).expect("a registry");
        let (name, kind) = ("eye".to_owned(), "eye".to_owned());
        let node = NodeOptions { name, kind, registry: registry.address().to_string() };
        let eye = SystemNode::start(&node, DEADLINE, |armor| {
            Ok(armor.provide::<PoseWithCovarianceStamped>("pose")?)
        })
        .expect("it is registered");
        // There y points east, and x south.
        let between = Some([placement(std::f64::consts::FRAC_PI_2), placement(0.0)]);
        let routes =
            OtherRoutes { robots: vec![("red".into(), 0.5, Some("eye.pose".into()))], between };
        let mut robots = OtherRobots::begin(&registry.address().to_string(), routes);
        let wake: WakeCallback = Arc::new(|| ());
        robots.follow(false, &wake, 0.0);
        assert!(robots.values.is_none(), "a hidden one links to nothing");
        let (start, mut x) = (Instant::now(), 3.0);
        while robots.robots[0].trail.len() < 3 {
            assert!(start.elapsed() < DEADLINE, "{:?}", robots.robots[0].why_not);
            x += 1.0;
            eye.armor().send_data("pose", &pose(x)).expect("it is published");
            std::thread::sleep(Duration::from_millis(10));
            robots.follow(true, &wake, 1.0);
        }
        let shown = robots.robots[0].pose.expect("a pose");
        assert!((shown.at.x_m() - 4.0).abs() < 1e-6 && shown.at.y_m() < -3.0, "{shown:?}");
        assert!((shown.yaw_rad + std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{shown:?}");
        assert!(robots.robots[0].trail[0].distance_m(map_point([4.0, -4.0])) < 100.0);
        robots.follow(false, &wake, 2.0);
        assert!(robots.values.is_none());
    }
}
