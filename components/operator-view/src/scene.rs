//! The robot and its surroundings in the map frame: the scan at the robot's pose of its time, and
//! odometry next to the corrected trajectory, so that drift is visible.

use armor_convert::{FrameNews, FrameWatch};
use armor_grid::{Point2, Pose2};

use crate::map::{MapShapeError, OccupancyMap};
use crate::photo::{Photo, PhotoError};
use crate::track::TrajectoryLine;

/// Most rays of a scan and most particles drawn; of more every n-th is.
const MAX_MARKS: usize = 4000;
/// Most poses of a trajectory drawn; of more every n-th is.
const MAX_TRAJECTORY: usize = 50_000;

/// Why data are not shown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A map that cannot be drawn.
    #[error("{0}")]
    Map(#[from] MapShapeError),
    /// An image that cannot be read.
    #[error("{0}")]
    Photo(#[from] PhotoError),
    /// A pose with numbers that are not finite.
    #[error("the numbers of the pose are not finite")]
    Nowhere,
    /// Bytes that are no message of the type.
    #[error("the bytes are no message of this type: {0}")]
    Bytes(String),
    /// A scan of a laser whose place on the robot is not known.
    #[error("{why}")]
    NoLaser {
        /// Why not.
        why: String,
    },
    /// A scan without angles.
    #[error("the scan's angles are not finite")]
    Angles,
    /// Data of another epoch than the newest pose or map.
    #[error("they are in the frame {frame}, and the robot is in another one")]
    Frame {
        /// Their frame.
        frame: String,
    },
}

/// A pose of the robot from localisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocatedPose {
    /// System time in seconds.
    pub stamp_s: f64,
    /// The pose on the map.
    pub pose: Pose2,
    /// Covariance of x and y: xx, xy, yy, in m².
    pub covariance_m2: [f64; 3],
}

/// A laser scan as points from the middle of the robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanPoints {
    /// System time in seconds.
    pub stamp_s: f64,
    /// Points in the robot's frame, in metres.
    pub points: Vec<Point2>,
}

/// A scan as it arrives.
#[derive(Clone, Copy, Debug)]
pub struct Rays<'a> {
    /// System time in seconds.
    pub stamp_s: f64,
    /// Angle of the first ray, in radians.
    pub first_rad: f64,
    /// Angle from one to the next.
    pub step_rad: f64,
    /// Shortest and longest range that is one, in metres.
    pub range_m: [f32; 2],
    /// Range of each ray.
    pub ranges_m: &'a [f32],
}

/// The place of the laser on the robot.
#[derive(Clone, Debug, PartialEq)]
pub enum LaserPlace {
    /// Its pose on the base.
    Known(Pose2),
    /// Why it is not known.
    Unknown(String),
}

impl Default for LaserPlace {
    fn default() -> Self {
        Self::Unknown("no frames were received yet".into())
    }
}

/// Everything that is shown on the map.
#[derive(Clone, Debug, Default)]
pub struct RobotScene {
    /// The pose of the laser on the robot.
    pub robot_from_laser: LaserPlace,
    /// Whether localisation is linked; otherwise only odometry gives the pose.
    pub is_localised: bool,
    /// The frame of the map.
    pub frames: FrameWatch,
    /// The map.
    pub map: OccupancyMap,
    /// Odometry, in its own frame.
    pub odometry: TrajectoryLine,
    /// The true trajectory, in the frame of the simulated world.
    pub truth: TrajectoryLine,
    /// The poses from localisation, on the map.
    pub poses: TrajectoryLine,
    /// The last of these, with its covariance.
    pub located: Option<LocatedPose>,
    /// The newest scan.
    pub scan: ScanPoints,
    /// Hypotheses of the robot's pose.
    pub particles: Vec<Pose2>,
    /// The trajectory with all corrections, and the time of its end.
    pub trajectory: (f64, Vec<Point2>),
    /// The planned path.
    pub path: Vec<Point2>,
    /// The newest image, and its number.
    pub photo: (u64, Photo),
    /// Ahead in m/s, to the left in rad/s.
    pub velocity: Option<(f64, f64)>,
}

impl RobotScene {
    /// Takes the frame of a pose or a map. If it has another origin than before, everything on the
    /// map is removed, with the tracks.
    pub fn frame_seen(&mut self, frame: &str) -> FrameNews {
        let news = self.frames.frame_seen(frame);
        if news == FrameNews::Changed {
            *self = Self {
                robot_from_laser: self.robot_from_laser.clone(),
                is_localised: self.is_localised,
                frames: self.frames.clone(),
                photo: std::mem::take(&mut self.photo),
                velocity: self.velocity,
                map: std::mem::take(&mut self.map).emptied(),
                ..Self::default()
            };
        }
        news
    }

    /// Returns the robot's pose at a time: from localisation, extrapolated by odometry.
    pub fn robot_at(&self, stamp_s: f64) -> Option<Pose2> {
        let moved = |from_s: f64| {
            Some(self.odometry.at(from_s)?.inverse().compose(self.odometry.at(stamp_s)?))
        };
        match self.located {
            Some(located) => Some(match moved(located.stamp_s) {
                Some(motion) => located.pose.compose(motion),
                None => self.poses.at(stamp_s).unwrap_or(located.pose),
            }),
            None if self.is_localised => None,
            None => self.odometry.at(stamp_s),
        }
    }

    /// Returns the current pose.
    pub fn robot(&self) -> Option<Pose2> {
        let newest = self.odometry.last().or(self.poses.last());
        newest.and_then(|(stamp_s, _)| self.robot_at(stamp_s))
    }

    /// Returns the drift of odometry since both frames were first known, in metres and radians.
    pub fn drift(&self) -> Option<(f64, f64)> {
        let (robot, map_from_odom) = (self.robot()?, self.odometry.map_from_frame?);
        let believed = map_from_odom.compose(self.odometry.last()?.1);
        let turn_rad = armor_grid::wrap_angle(believed.yaw_rad - robot.yaw_rad);
        self.is_localised.then(|| (believed.point().distance_m(robot.point()), turn_rad.abs()))
    }

    /// Sets a pose from localisation.
    ///
    /// # Errors
    /// If its numbers are not finite.
    pub fn set_located(&mut self, located: LocatedPose) -> Result<(), SceneError> {
        if !is_finite(&located.pose) {
            return Err(SceneError::Nowhere);
        }
        self.poses.push(located.stamp_s, located.pose);
        self.poses.map_from_frame = Some(Pose2::IDENTITY);
        self.located = Some(located);
        self.align();
        Ok(())
    }

    /// Adds a pose and velocity of odometry.
    ///
    /// # Errors
    /// If its numbers are not finite.
    pub fn add_odometry(
        &mut self,
        stamp_s: f64,
        pose: Pose2,
        velocity: (f64, f64),
    ) -> Result<(), SceneError> {
        self.odometry.push(stamp_s, pose);
        self.velocity = (velocity.0.is_finite() && velocity.1.is_finite()).then_some(velocity);
        self.align();
        if is_finite(&pose) { Ok(()) } else { Err(SceneError::Nowhere) }
    }

    /// Adds a true pose.
    ///
    /// # Errors
    /// If its numbers are not finite.
    pub fn add_truth(&mut self, stamp_s: f64, pose: Pose2) -> Result<(), SceneError> {
        self.truth.push(stamp_s, pose);
        self.align();
        if is_finite(&pose) { Ok(()) } else { Err(SceneError::Nowhere) }
    }

    /// Aligns other frames with the map at the first moment at which both are known; later
    /// distances are drift.
    fn align(&mut self) {
        if self.odometry.map_from_frame.is_none() {
            self.odometry.map_from_frame = match self.located {
                Some(LocatedPose { stamp_s, pose, .. }) => {
                    self.odometry.at(stamp_s).map(|odom| pose.compose(odom.inverse()))
                }
                None => (!self.is_localised).then_some(Pose2::IDENTITY),
            };
        }
        if self.truth.map_from_frame.is_none()
            && let Some((stamp_s, truth)) = self.truth.last()
        {
            let robot = self.robot_at(stamp_s);
            self.truth.map_from_frame = robot.map(|robot| robot.compose(truth.inverse()));
        }
    }

    /// Sets the newest scan.
    ///
    /// # Errors
    /// If its angles are not finite.
    pub fn set_scan(&mut self, rays: &Rays<'_>) -> Result<(), SceneError> {
        if !(rays.first_rad.is_finite() && rays.step_rad.is_finite()) {
            return Err(SceneError::Angles);
        }
        let robot_from_laser = match &self.robot_from_laser {
            LaserPlace::Known(pose) => *pose,
            LaserPlace::Unknown(why) => return Err(SceneError::NoLaser { why: why.clone() }),
        };
        let [nearest, farthest] = rays.range_m;
        let every = rays.ranges_m.len().div_ceil(MAX_MARKS).max(1);
        let seen = rays.ranges_m.iter().enumerate().step_by(every);
        let seen =
            seen.filter(|(_, range)| range.is_finite() && (nearest..=farthest).contains(range));
        let points = seen.map(|(ray, range)| {
            let (sin, cos) = (rays.first_rad + ray as f64 * rays.step_rad).sin_cos();
            let range_m = f64::from(*range);
            robot_from_laser.apply(Point2::new(range_m * cos, range_m * sin))
        });
        self.scan = ScanPoints { stamp_s: rays.stamp_s, points: points.collect() };
        Ok(())
    }

    /// Sets the hypotheses of the robot's pose.
    pub fn set_particles(&mut self, poses: impl ExactSizeIterator<Item = Pose2>) {
        self.particles = thinned(poses, MAX_MARKS).filter(is_finite).collect();
    }

    /// Sets the corrected trajectory.
    pub fn set_trajectory(&mut self, stamp_s: f64, poses: impl ExactSizeIterator<Item = Pose2>) {
        self.trajectory = (stamp_s, thin_line(poses));
    }

    /// Sets the planned path.
    pub fn set_path(&mut self, poses: impl ExactSizeIterator<Item = Pose2>) {
        self.path = thin_line(poses);
    }

    /// Sets the newest image.
    pub fn set_photo(&mut self, photo: Photo) {
        self.photo = (self.photo.0 + 1, photo);
    }

    /// Returns the trajectory on the map: with corrections, and the poses since.
    pub fn trajectory_points(&self) -> impl Iterator<Item = Point2> + '_ {
        let (stamp_s, corrected) = &self.trajectory;
        // Without corrections all there is are the poses themselves.
        let is_corrected = !corrected.is_empty();
        let poses = self.poses.line().filter(move |_| !is_corrected);
        let since = self.poses.since(*stamp_s).filter(move |_| is_corrected);
        corrected.iter().copied().chain(poses).chain(since)
    }
}

fn is_finite(pose: &Pose2) -> bool {
    pose.x_m.is_finite() && pose.y_m.is_finite() && pose.yaw_rad.is_finite()
}

fn thinned<T>(all: impl ExactSizeIterator<Item = T>, most: usize) -> impl Iterator<Item = T> {
    let every = all.len().div_ceil(most).max(1);
    all.step_by(every)
}

fn thin_line(poses: impl ExactSizeIterator<Item = Pose2>) -> Vec<Point2> {
    let last = poses.len().saturating_sub(1);
    let every = poses.len().div_ceil(MAX_TRAJECTORY).max(1);
    // Its end counts: it is where the robot is, or shall be.
    let kept = poses.enumerate().filter(|(n, _)| n % every == 0 || *n == last);
    kept.map(|(_, pose)| pose).filter(is_finite).map(Pose2::point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn located(stamp_s: f64, x_m: f64) -> LocatedPose {
        LocatedPose { stamp_s, pose: Pose2::new(x_m, 0.0, 0.0), covariance_m2: [0.0; 3] }
    }

    #[test]
    fn the_robot_is_where_it_was_located_carried_on_by_odometry() {
        let mut scene = RobotScene { is_localised: true, ..RobotScene::default() };
        for n in 0..=10 {
            let s = 0.1 * f64::from(n);
            scene.add_odometry(s, Pose2::new(7.0 + s, 0.0, 0.0), (1.0, 0.0)).unwrap();
        }
        assert_eq!(scene.robot(), None, "its place on the map is not known yet");
        scene.set_located(located(0.5, 20.0)).unwrap();
        let robot = scene.robot().unwrap();
        assert!((robot.x_m - 20.5).abs() < 1e-9, "{robot:?}");
        let earlier = scene.robot_at(0.25).unwrap();
        assert!((earlier.x_m - 19.75).abs() < 1e-9, "{earlier:?}");
    }

    #[test]
    fn odometry_is_drawn_from_where_both_began_so_that_drift_is_seen() {
        let mut scene = RobotScene { is_localised: true, ..RobotScene::default() };
        scene.add_odometry(0.0, Pose2::new(3.0, 0.0, 0.0), (0.0, 0.0)).unwrap();
        scene.add_truth(0.0, Pose2::new(-4.0, 0.0, 0.0)).unwrap();
        scene.set_located(located(0.0, 1.0)).unwrap();
        scene.add_odometry(1.0, Pose2::new(5.5, 0.0, 0.0), (0.0, 0.0)).unwrap();
        scene.set_located(located(1.0, 3.0)).unwrap();
        scene.add_truth(1.0, Pose2::new(-2.0, 0.0, 0.0)).unwrap();
        let ends =
            |track: &TrajectoryLine| (track.line().next().unwrap(), track.line().last().unwrap());
        assert_eq!(ends(&scene.odometry), (Point2::new(1.0, 0.0), Point2::new(3.5, 0.0)));
        assert_eq!(ends(&scene.truth).1, Point2::new(3.0, 0.0));
        assert_eq!(scene.drift(), Some((0.5, 0.0)));
    }

    #[test]
    fn without_a_localiser_odometry_is_the_map() {
        let mut scene = RobotScene::default();
        scene.add_odometry(0.0, Pose2::new(3.0, 0.0, 0.0), (0.0, 0.0)).unwrap();
        assert_eq!(scene.robot(), Some(Pose2::new(3.0, 0.0, 0.0)));
        assert_eq!(scene.drift(), None);
    }

    #[test]
    fn odd_data_are_refused_and_what_was_known_stays() {
        let mut scene = RobotScene::default();
        scene.set_located(located(1.0, 2.0)).unwrap();
        assert_eq!(scene.set_located(located(2.0, f64::NAN)), Err(SceneError::Nowhere));
        assert_eq!(
            scene.add_odometry(1.0, Pose2::new(f64::INFINITY, 0.0, 0.0), (f64::NAN, 0.0)),
            Err(SceneError::Nowhere)
        );
        assert_eq!(scene.robot().map(|robot| robot.x_m), Some(2.0));
        assert_eq!(scene.velocity, None);
        scene.set_particles([Pose2::new(f64::NAN, 0.0, 0.0), Pose2::IDENTITY].into_iter());
        assert_eq!(scene.particles.len(), 1);
        let rays = |ranges_m| Rays {
            stamp_s: 1.0,
            first_rad: 0.0,
            step_rad: 0.1,
            range_m: [0.1, 10.0],
            ranges_m,
        };
        let no_laser = scene.set_scan(&rays(&[2.0])).expect_err("its place is not known");
        assert_eq!(no_laser.to_string(), "no frames were received yet");
        assert!(scene.scan.points.is_empty(), "nothing is drawn where the laser may not be");
        scene.robot_from_laser = LaserPlace::Known(Pose2::IDENTITY);
        scene.set_scan(&rays(&[])).unwrap();
        assert_eq!(scene.scan.points, []);
        scene.set_scan(&rays(&[f32::NAN, f32::INFINITY, 11.0, 0.0, 1.0])).unwrap();
        assert_eq!(scene.scan.points.len(), 1);
        let bent = Rays { first_rad: f64::NAN, ..rays(&[1.0]) };
        assert_eq!(scene.set_scan(&bent), Err(SceneError::Angles));
    }

    #[test]
    fn the_trajectory_is_as_corrected_and_continues_to_the_robot() {
        let mut scene = RobotScene::default();
        for n in 0..4 {
            scene.set_located(located(f64::from(n), f64::from(n))).unwrap();
        }
        let xs = |scene: &RobotScene| {
            scene.trajectory_points().map(|point| point.x_m).collect::<Vec<_>>()
        };
        assert_eq!(xs(&scene).first(), Some(&0.0));
        scene.set_trajectory(1.0, [0.0, 0.9].map(|x| Pose2::new(x, 0.0, 0.0)).into_iter());
        assert_eq!(xs(&scene), [0.0, 0.9, 2.0, 3.0]);
    }
}
