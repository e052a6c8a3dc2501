//! The planner as a component: map, pose and goals in, paths out.

use armor_convert::{
    FrameNews, FrameWatch, ZoneWatch, build_path, read_occupancy, read_pose, read_robot_pose,
};
use armor_grid::Thresholds;
use armor_sdk::prelude::*;

use crate::planning::{PlannerSettings, Planning, Rank};

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct PlannerParameters {
    /// circle around the robot's centre that encloses it
    #[parameter(unit = "m", default = "0.18m", range = 0.02..=5.0)]
    radius_m: f64,
    /// kept free around it
    #[parameter(unit = "m", default = "0.05m", range = 0.0..=1.0)]
    margin_m: f64,
    /// the robot's fastest speed: a slower zone costs the time that is lost in it
    #[parameter(unit = "m/s", default = "0.6m/s", range = 0.05..=50.0)]
    speed_mps: f64,
    /// a goal older than this is ignored
    #[parameter(unit = "s", default = "0.5s", range = 0.05..=10.0)]
    timeout_s: f64,
}

impl PlannerParameters {
    fn settings(&self) -> PlannerSettings {
        let Self { radius_m, margin_m, speed_mps, timeout_s } = *self;
        PlannerSettings { radius_m, margin_m, speed_mps, timeout_s }
    }
}

impl Default for PlannerSettings {
    fn default() -> Self {
        PlannerParameters::defaults().settings()
    }
}

/// Plans a path over the map to the goal that has priority.
pub struct Planner {
    armor: Armor,
    parameters: PlannerParameters,
    planning: Planning,
    frames: FrameWatch,
    /// Whether a goal of another epoch was refused since the last one of this epoch.
    has_refused: bool,
    zones: ZoneWatch,
    /// Why the zones are not known, as logged last.
    zone_fault: Option<String>,
    /// The zone that the goal of the last step was in.
    goal_zone: Option<String>,
}

/// What it reports to the mission.
#[derive(Debug, Events)]
enum PlannerEvent {
    /// the map frame has another origin: goals and path of before are dropped
    FrameChanged,
    /// the goal is in a no-go zone, outside of the stay-in zones, or within the margin of either
    GoalInZone,
}

impl Component for Planner {
    const KIND: &'static str = "planner";
    const SUMMARY: &'static str = "Plans a path over the map to the goal that has priority.";
    const REPORTS_DONE: bool = false;
    const STALE_AFTER: &'static [(&'static str, &'static str)] =
        &[("goal", "timeout"), ("override", "timeout"), ("operator", "timeout")];
    const PARAMETERS: &'static [Parameter] = PlannerParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("map", "the map on which the path is planned"),
        ("pose", "where the robot is on it"),
        ("goal", "where to drive; must be sent again within the timeout"),
        ("override", "a goal that has priority over the other one while it is fresh"),
        ("operator", "a person's goal; has priority over both while it is fresh"),
        (
            "zones",
            "where the robot may be, and how fast; if it is linked, no path is planned without zones \
             of the map's frame",
        ),
        (
            "path",
            "the path to the goal, as soon as it is another one and at every tick while one is fresh: from where the robot was \
             when it was planned to the goal's heading; empty if no path exists, and once when the \
             goal ends",
        ),
    ];

    const EVENTS: &'static [DeclaredEvent] = PlannerEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<OccupancyGrid>("map")?;
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.subscribe::<Optional<PoseStamped>>("goal")?;
        armor.subscribe::<Optional<PoseStamped>>("override")?;
        armor.subscribe::<Optional<PoseStamped>>("operator")?;
        armor.subscribe::<Optional<Zones>>("zones")?;
        armor.provide::<Path>("path")?;
        let parameters = PlannerParameters::request(&armor)?;
        let planning = Planning::new(parameters.settings());
        Ok(Self {
            armor,
            parameters,
            planning,
            frames: FrameWatch::default(),
            has_refused: false,
            zones: ZoneWatch::default(),
            zone_fault: None,
            goal_zone: None,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let rank = match header.id() {
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.frame_seen(&map.frame);
                self.planning.map_seen(read_occupancy(&map, Thresholds::default())?);
                return Ok(());
            }
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                self.frame_seen(&pose.frame);
                self.planning.pose_seen(read_robot_pose(&pose));
                return Ok(());
            }
            "zones" => {
                if let Some(zones) = self.zones.zones_seen(&data.decode()?) {
                    self.planning.zones_seen(zones);
                }
                return Ok(());
            }
            "goal" => Rank::Task,
            "override" => Rank::Override,
            _ => Rank::Operator,
        };
        let goal: PoseStamped = data.decode()?;
        if self.refuses(&goal.frame) {
            return Ok(());
        }
        let now_s = self.armor.timestamp();
        self.planning.goal_seen(now_s, rank, read_pose(&goal.pose));
        if self.planning.is_path_wanted(now_s) {
            self.publish_path(now_s)?;
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => {
                self.zones.expect_zones(self.armor.subscribed_data("zones").is_some());
                self.planning.reset_state(self.parameters.settings());
            }
            Call::Stopping => self.planning.forget_goals(),
            _ => {}
        }
        self.publish_path(self.armor.timestamp())?;
        if self.frames.take_change() {
            return Ok(PlannerEvent::FrameChanged.into());
        }
        Ok(if self.is_goal_newly_in_zone() {
            PlannerEvent::GoalInZone.into()
        } else {
            Outcome::CarryOn
        })
    }
}

impl Planner {
    /// Publishes the path to the goal that has priority, if there is one.
    fn publish_path(&mut self, now_s: f64) -> Result<(), Fault> {
        self.check_zones();
        if let Some(poses) = self.planning.step(now_s) {
            let frame = self.frames.frame().unwrap_or("map");
            self.armor.send_data("path", &build_path(now_s, frame, poses))?;
        }
        Ok(())
    }

    /// Takes the frame of a pose or a map; what is known of another epoch is dropped.
    fn frame_seen(&mut self, frame: &str) {
        match self.frames.frame_seen(frame) {
            FrameNews::Same => {}
            // Goals are sent again; those that came before may be of another epoch.
            FrameNews::First => self.planning.forget_goals(),
            FrameNews::Changed => {
                tracing::warn!(frame, "the map frame has another origin: the path is dropped");
                self.planning.forget_frame();
            }
        }
    }

    /// Plans no path while it is not known where the robot may be.
    fn check_zones(&mut self) {
        let fault = self.zones.fault(&self.frames);
        self.planning.set_zones_known(fault.is_none());
        if fault != self.zone_fault {
            if let Some(fault) = &fault {
                tracing::warn!("no path is planned: {fault}");
            }
            self.zone_fault = fault;
        }
    }

    /// Returns whether the goal is in a zone that it was not in at the last call; logs it.
    fn is_goal_newly_in_zone(&mut self) -> bool {
        let zone = self.planning.goal_zone().map(str::to_owned);
        let is_new = zone.is_some() && zone != self.goal_zone;
        if let Some(zone) = zone.as_deref().filter(|_| is_new) {
            tracing::warn!("no path to the goal: the zone {zone} does not allow a robot there");
        }
        self.goal_zone = zone;
        is_new
    }

    /// Returns whether a goal is of another epoch than the newest pose or map. The first one is
    /// logged: it is sent many times per second.
    fn refuses(&mut self, frame: &str) -> bool {
        let is_refused = !self.frames.is_usable(frame);
        if is_refused && !self.has_refused {
            let now = self.frames.frame().unwrap_or_default();
            tracing::warn!("a goal in the frame {frame} is refused: the robot is in {now}");
        }
        self.has_refused = is_refused;
        is_refused
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_convert::build_stamped_pose;
    use armor_grid::Pose2;
    use armor_sdk::testing::{ReportKind, TestError, TestedComponent};

    use super::*;

    const TICK: Duration = Duration::from_millis(100);

    /// Sends no zones, which is not the same as sending nothing.
    fn send_map_and_pose(planner: &mut TestedComponent, frame: &str) -> Result<(), TestError> {
        planner.send("zones", &Zones { frame: frame.into(), ..Zones::default() })?;
        send_place(planner, frame)
    }

    fn send_place(planner: &mut TestedComponent, frame: &str) -> Result<(), TestError> {
        let (width, height, resolution) = (40, 40, 0.1);
        let info = MapMetaData { width, height, resolution, ..MapMetaData::default() };
        let data = vec![0; 1600].into();
        let pose = build_stamped_pose(0.0, frame, Pose2::new(1.0, 1.0, 0.0)).pose;
        let frame: String = frame.into();
        let map = OccupancyGrid { frame: frame.clone(), info, data, ..OccupancyGrid::default() };
        planner.send("map", &map)?;
        let pose = PoseWithCovariance { pose, ..PoseWithCovariance::default() };
        planner.send("pose", &PoseWithCovarianceStamped { stamp: 0.0, frame, pose })
    }

    fn send_goal(planner: &mut TestedComponent, frame: &str) -> Result<(), TestError> {
        planner.send("goal", &build_stamped_pose(0.0, frame, Pose2::new(3.0, 3.0, 0.0)))?;
        planner.tick_after(TICK)
    }

    #[test]
    fn a_goal_of_another_epoch_gets_no_path() -> Result<(), TestError> {
        let mut planner = TestedComponent::build::<Planner>(&[])?;
        planner.start()?;
        send_map_and_pose(&mut planner, "map")?;
        send_goal(&mut planner, "map")?;
        let path = planner.last_output::<Path>("path")?;
        assert!(path.frame == "map" && path.poses.len() > 2, "{path:?}");
        // The mapper begins a new frame; what sends the goal does not know it yet.
        send_map_and_pose(&mut planner, "map#3f2a")?;
        send_goal(&mut planner, "map")?;
        let path = planner.last_output::<Path>("path")?;
        assert_eq!((path.frame.as_str(), path.poses.len()), ("map#3f2a", 0), "the robot stops");
        let changed = ReportKind::Event { name: "frame_changed".into(), value: 1.0 };
        assert_eq!(planner.reports(), std::slice::from_ref(&changed));
        send_goal(&mut planner, "map#3f2a")?;
        assert!(planner.last_output::<Path>("path")?.poses.len() > 2);
        assert_eq!(planner.reports(), [changed], "it is reported once");
        Ok(())
    }

    #[test]
    fn another_goal_gets_its_path_before_the_next_tick() -> Result<(), TestError> {
        let mut planner = TestedComponent::build::<Planner>(&[])?;
        planner.start()?;
        send_map_and_pose(&mut planner, "map")?;
        let mut end_of_path = |x_m: f64, later: Duration| -> Result<(f64, usize), TestError> {
            planner.pass_time(later);
            let goal = build_stamped_pose(0.0, "map", Pose2::new(x_m, 3.0, 0.0));
            planner.send("goal", &goal)?;
            let end = planner.last_output::<Path>("path")?.poses.last().map(|it| it.pose.position);
            Ok((end.map_or(f64::NAN, |at| at.x), planner.outputs::<Path>("path")?.len()))
        };
        assert_eq!(end_of_path(3.0, TICK)?, (3.0, 1));
        assert_eq!(end_of_path(3.0, TICK)?, (3.0, 1), "the same goal waits for the tick");
        assert_eq!(end_of_path(2.0, TICK)?, (2.0, 2));
        assert_eq!(end_of_path(1.0, TICK / 2)?, (2.0, 2), "not with every message");
        assert_eq!(end_of_path(1.0, TICK)?, (1.0, 3));
        Ok(())
    }

    /// A no-go zone of `size` by `size` metres around the goal of `send_goal`.
    fn square(frame: &str, size: f64) -> Zones {
        let corner = |x, y| Point { x: 3.0 + x * size / 2.0, y: 3.0 + y * size / 2.0, z: 0.0 };
        let polygon =
            vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let zone = Zone { name: "school".into(), polygon, ..Zone::default() };
        Zones { stamp: 0.0, frame: frame.into(), zones: vec![zone] }
    }

    #[test]
    fn a_goal_in_a_no_go_zone_gets_no_path_and_is_reported_once() -> Result<(), TestError> {
        let mut planner = TestedComponent::build::<Planner>(&[])?;
        planner.start()?;
        send_map_and_pose(&mut planner, "map")?;
        planner.send("zones", &square("map", 1.0))?;
        send_goal(&mut planner, "map")?;
        send_goal(&mut planner, "map")?;
        assert_eq!(planner.last_output::<Path>("path")?.poses, []);
        let reported = ReportKind::Event { name: "goal_in_zone".into(), value: 1.0 };
        assert_eq!(planner.reports(), std::slice::from_ref(&reported));
        planner.send("zones", &Zones { frame: "map".into(), ..Zones::default() })?;
        send_goal(&mut planner, "map")?;
        assert!(planner.last_output::<Path>("path")?.poses.len() > 2, "the zone is gone");
        planner.send("zones", &square("map", 1.0))?;
        send_goal(&mut planner, "map")?;
        assert_eq!(planner.reports(), [reported.clone(), reported]);
        Ok(())
    }

    #[test]
    fn without_zones_of_its_frame_no_path_is_planned() -> Result<(), TestError> {
        let mut planner = TestedComponent::build::<Planner>(&[])?;
        planner.start()?;
        send_map_and_pose(&mut planner, "map")?;
        let length = |planner: &mut TestedComponent, zones: &Zones| -> Result<usize, TestError> {
            planner.send("zones", zones)?;
            send_goal(planner, "map")?;
            Ok(planner.last_output::<Path>("path")?.poses.len())
        };
        assert_eq!(length(&mut planner, &square("map#3f2a", 1.0))?, 0, "they are of another epoch");
        let mut faulty = square("map", 1.0);
        faulty.zones[0].polygon.truncate(2);
        assert_eq!(length(&mut planner, &faulty)?, 0, "a zone without a shape");
        let empty = Zones { frame: "map".into(), ..Zones::default() };
        assert!(length(&mut planner, &empty)? > 2);
        Ok(())
    }

    #[test]
    fn before_the_zones_have_arrived_no_path_is_planned() -> Result<(), TestError> {
        let mut planner = TestedComponent::build::<Planner>(&[])?;
        planner.start()?;
        send_place(&mut planner, "map")?;
        send_goal(&mut planner, "map")?;
        assert_eq!(planner.last_output::<Path>("path")?.poses, []);
        planner.send("zones", &Zones { frame: "map".into(), ..Zones::default() })?;
        send_goal(&mut planner, "map")?;
        assert!(planner.last_output::<Path>("path")?.poses.len() > 2);
        Ok(())
    }

    #[test]
    fn a_goal_that_came_before_the_first_pose_is_of_an_unknown_epoch() -> Result<(), TestError> {
        let mut planner = TestedComponent::build::<Planner>(&[])?;
        planner.start()?;
        send_goal(&mut planner, "map")?;
        send_map_and_pose(&mut planner, "map#3f2a")?;
        planner.tick_after(TICK)?;
        assert_eq!(planner.last_output::<Path>("path")?.poses, []);
        assert_eq!(planner.reports(), [], "there was no frame before");
        Ok(())
    }
}
