//! The mapper as a component: scans and odometry in, poses and the map out.

mod kept_state;
mod messages;
mod parameters;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use armor_convert::build_transform;
use armor_grid::Pose2 as GridPose2;
use armor_sdk::prelude::*;

use kept_state::KeptState;
use messages::{build_estimate, build_map, build_pose, build_trajectory, build_update, read_scan};
use parameters::GridSlamParameters;

use crate::filter::ScanEstimate;
use crate::pairing::Pairing;
use crate::pose::Pose as Pose2;
use crate::recognition::PlaceSearch;
use crate::slam::Slam;
use crate::snapshot::GridSnapshot;

/// Frame of the map (REP-105).
const MAP: &str = "map";
/// Frame of the odometry (REP-105).
const ODOM: &str = "odom";

/// What it reports to the mission.
#[derive(Debug, Events)]
enum GridSlamEvent {
    /// after a restart: where the robot is on the stored map is not known yet, no pose is published
    Lost,
    /// after a restart: the robot was recognised, the map is continued in the same frame
    Continued,
    /// after a restart: the stored map could not be continued, the frame has another origin
    FrameChanged,
}

/// Draws a map while the robot drives, and publishes the robot's pose on it.
pub struct GridSlam {
    armor: Armor,
    parameters: GridSlamParameters,
    pairing: Pairing,
    slam: Slam,
    /// Whether the map has changed since any of it was published.
    is_new: bool,
    /// The whole map as it was published last, with the changes published since.
    published: Option<GridSnapshot>,
    published_s: f64,
    /// Scans in the trajectory as it was published last, those known at the last tick, and ticks
    /// since one came.
    published_scans: usize,
    ticked: usize,
    quiet: u32,
    stamp_s: f64,
    dropped: u64,
    /// Frame of all that is published; `None` before the first scan.
    frame: Option<String>,
    /// Whether a frame was begun that no file knows of.
    has_begun: bool,
    /// The mission, or the system, has activated it.
    was_active: bool,
    /// The robot's place on a stored map is not known yet.
    search: Option<PlaceSearch>,
    state: Option<KeptState>,
    events: VecDeque<GridSlamEvent>,
}

/// The trajectory is published at most once in this long for each of its poses, seconds: its cost
/// stays a share of the time however long it grows.
const TRAJECTORY_S: f64 = 2e-4;
/// Ticks without a scan after which none is expected.
const QUIET_TICKS: u32 = 3;

impl Component for GridSlam {
    const KIND: &'static str = "grid-slam";
    const SUMMARY: &'static str = "Maps and localises from scans and odometry: a particle filter on occupancy grids, and a pose graph that closes loops.";
    const REPORTS_DONE: bool = false;
    const VALUE_EFFECTS: &'static [(&'static str, ParameterEffect)] =
        &[("map_period", ParameterEffect::Paces("map"))];
    const FRAMES: &'static [(&'static str, &'static str)] = &[("scan", "laser_frame")];
    const PARAMETERS: &'static [Parameter] = GridSlamParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("scan", "what the laser sees"),
        ("odometry", "where the wheels believe the robot is"),
        ("map", "the map; the frame map begins where the robot stood first"),
        ("map_updates", "tiles of the map that changed since it was published"),
        ("pose", "where the robot was at each scan, one per scan"),
        ("correction", "map_from_odom: brings the odometry into the map"),
        ("transforms", "where odom is in the map, at each scan; the same as correction"),
        ("trajectory", "where each scan was taken, as corrected so far"),
        ("particles", "where each hypothesis has the robot, at each scan"),
        ("diagnostics", "quality of the match and counts, once per scan"),
    ];

    const EVENTS: &'static [DeclaredEvent] = GridSlamEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<LaserScan>("scan")?;
        armor.subscribe::<Odometry>("odometry")?;
        armor.provide::<Latched<OccupancyGrid>>("map")?;
        armor.provide::<OccupancyGridUpdate>("map_updates")?;
        armor.provide::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("correction")?;
        armor.provide::<FrameTransforms>("transforms")?;
        armor.provide::<Latched<Path>>("trajectory")?;
        armor.provide::<PoseArray>("particles")?;
        armor.provide::<SlamDiagnostics>("diagnostics")?;
        let parameters = GridSlamParameters::request(&armor)?;
        let slam = Slam::new(parameters.config());
        Ok(Self {
            armor,
            parameters,
            pairing: Pairing::default(),
            slam,
            is_new: false,
            published: None,
            published_s: f64::NEG_INFINITY,
            published_scans: 0,
            ticked: 0,
            quiet: 0,
            stamp_s: 0.0,
            dropped: 0,
            frame: None,
            has_begun: false,
            was_active: false,
            search: None,
            state: None,
            events: VecDeque::new(),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        // All of them arrive before the first scan, but for those of a place of the mission: the
        // map is then continued as after a restart, if it fits the new ones.
        self.write_state(true);
        (self.frame, self.search, self.state) = (None, None, None);
        self.slam = Slam::new(self.parameters.config());
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        match header.id() {
            "scan" => {
                // Where the beams were is not assumed.
                self.parameters.robot_from_laser()?;
                self.pairing.scan_seen(read_scan(&data.decode()?));
            }
            "odometry" => {
                let odometry: Odometry = data.decode()?;
                let Pose2D { x, y, theta } = odometry.pose.pose.to_planar();
                self.pairing.odometry_seen(odometry.stamp, Pose2::new(x, y, theta));
            }
            _ => {}
        }
        while let Some((odometry, scan)) = self.pairing.next_pair() {
            let begun = Instant::now();
            if self.frame.is_none() {
                self.choose_frame(&scan);
            }
            if self.search.is_some() && !self.find_place(odometry, &scan) {
                continue;
            }
            let estimate = self.slam.add(odometry, &scan);
            self.record_scan(odometry, &estimate, &scan);
            self.is_new |= estimate.drawn;
            self.stamp_s = scan.stamp_s;
            self.publish_pose(scan.stamp_s, &estimate)?;
            self.publish_particles(scan.stamp_s)?;
            self.publish_diagnostics(scan.stamp_s, &estimate, begun.elapsed())?;
        }
        if self.dropped != self.pairing.dropped() {
            self.dropped = self.pairing.dropped();
            // The first, and then ever more rarely: a log is not to be filled with it.
            if self.dropped.is_power_of_two() {
                tracing::warn!(dropped = self.dropped, "scans without odometry were dropped");
            }
        }
        Ok(())
    }

    /// Publishes what has changed. At the end of a log no scan follows, so it is the tick, not the
    /// scan, that checks; when scans stop, the last ones are published though they drew nothing.
    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started && !std::mem::replace(&mut self.was_active, true) {
            self.mark_first_start();
        }
        self.write_state(call == Call::Stopping);
        if let Some(event) = self.events.pop_front() {
            return Ok(event.into());
        }
        self.quiet =
            if self.ticked == self.slam.scans() { self.quiet.saturating_add(1) } else { 0 };
        self.ticked = self.slam.scans();
        if self.is_new || (self.quiet >= QUIET_TICKS && self.published_scans < self.ticked) {
            self.publish_map(self.armor.timestamp())?;
        }
        Ok(Outcome::CarryOn)
    }
}

impl GridSlam {
    fn frame(&self) -> String {
        self.frame.clone().unwrap_or_else(|| MAP.into())
    }

    /// The whole map with the trajectory when its period is over, else the tiles that changed.
    fn publish_map(&mut self, now_s: f64) -> Result<(), Fault> {
        let period_s = self.parameters.map_period_s.max(TRAJECTORY_S * self.slam.scans() as f64);
        // Time that jumps back begins again.
        let is_due = now_s - self.published_s >= period_s || now_s < self.published_s;
        let snapshot = self.slam.snapshot();
        let earlier = self.published.as_ref();
        let changes = earlier.and_then(|earlier| snapshot.changed_since(earlier));
        match changes {
            Some(changes) if !is_due => {
                for (corner, size) in changes {
                    let update =
                        build_update(self.stamp_s, self.frame(), &snapshot, (corner, size));
                    self.armor.send_data("map_updates", &update)?;
                }
            }
            // It has outgrown what was published, but not for long.
            _ if !is_due => return Ok(()),
            _ => {
                let trajectory = build_trajectory(self.stamp_s, self.frame(), &self.slam);
                self.armor.send_data("trajectory", &trajectory)?;
                self.armor.send_data("map", &build_map(self.stamp_s, self.frame(), &snapshot))?;
                (self.is_new, self.published_s) = (false, now_s);
                self.published_scans = self.slam.scans();
            }
        }
        self.published = Some(snapshot);
        Ok(())
    }

    fn publish_diagnostics(
        &self,
        stamp: f64,
        estimate: &ScanEstimate,
        took: Duration,
    ) -> Result<(), Fault> {
        let diagnostics = SlamDiagnostics {
            stamp,
            particles: self.parameters.particles as u32,
            effective_particles: estimate.effective,
            match_score: estimate.score,
            closures: self.slam.closures() as u64,
            update_time: took.as_secs_f64(),
            dropped: self.pairing.dropped(),
        };
        self.armor.send_data("diagnostics", &diagnostics)?;
        Ok(())
    }

    fn publish_particles(&self, stamp: f64) -> Result<(), Fault> {
        let poses = self.slam.particles().map(|pose| build_pose(&pose)).collect();
        self.armor.send_data("particles", &PoseArray { stamp, frame: self.frame(), poses })?;
        Ok(())
    }

    fn publish_pose(&self, stamp: f64, estimate: &ScanEstimate) -> Result<(), Fault> {
        self.armor.send_data("pose", &build_estimate(stamp, self.frame(), estimate))?;
        let Pose2 { x_m, y_m, yaw_rad } = estimate.map_from_odom;
        let map_from_odom = GridPose2::new(x_m, y_m, yaw_rad);
        let transforms = build_transform(stamp, &self.frame(), ODOM, map_from_odom);
        self.armor.send_data("transforms", &transforms)?;
        let pose = build_pose(&estimate.map_from_odom);
        self.armor.send_data("correction", &PoseStamped { stamp, frame: self.frame(), pose })?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use armor_sdk::testing::{TestError, TestedComponent};

    use super::*;

    /// Sends odometry and a scan of a round room.
    fn look_around(mapper: &mut TestedComponent) -> Result<f64, TestError> {
        let stamp = mapper.timestamp();
        let pose = Pose2D { x: 0.4, y: 0.0, theta: 0.1 };
        let odometry = Odometry::planar(stamp, ODOM, "base_link", pose, Twist::default());
        mapper.send("odometry", &odometry)?;
        let (angle_min, angle_increment, range_max) = (-1.5, 0.1, 10.0);
        let ranges = vec![3.0; 31].into();
        let scan = LaserScan {
            stamp,
            angle_min,
            angle_increment,
            range_max,
            ranges,
            ..Default::default()
        };
        mapper.send("scan", &scan)?;
        Ok(stamp)
    }

    #[test]
    fn where_odom_is_in_the_map_is_published_for_trees_of_frames() -> Result<(), TestError> {
        let parameters = [("frames", "laser,base_link,0.08,0,0.2,0,0,0"), ("keep_state", "false")];
        let mut mapper = TestedComponent::build::<GridSlam>(&parameters)?;
        mapper.start()?;
        let stamp = look_around(&mut mapper)?;
        let FrameTransforms { transforms, stamp: published } = mapper.last_output("transforms")?;
        let correction: PoseStamped = mapper.last_output("correction")?;
        let [FrameTransform { parent, child, translation, rotation }] = &transforms[..] else {
            panic!("one frame moves: {transforms:?}");
        };
        assert_eq!((parent, child.as_str()), (&correction.frame, ODOM));
        assert_eq!((published, *rotation), (stamp, correction.pose.orientation));
        let Point { x, y, .. } = correction.pose.position;
        assert_eq!(*translation, Vector3 { x, y, z: 0.0 });
        Ok(())
    }

    #[test]
    fn without_the_laser_s_frame_a_scan_is_a_failure() -> Result<(), TestError> {
        let mut mapper = TestedComponent::build::<GridSlam>(&[("keep_state", "false")])?;
        mapper.start()?;
        let error = look_around(&mut mapper).expect_err("it fails").to_string();
        assert!(error.contains("where the frame `laser` is on the robot is not known"), "{error}");
        assert!(mapper.outputs::<PoseStamped>("correction")?.is_empty());
        Ok(())
    }
}
