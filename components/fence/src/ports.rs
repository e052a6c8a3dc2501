//! The fence as a component: pose and zones in, events and the nearest zone out.

use std::collections::VecDeque;

use armor_convert::{FrameNews, FrameWatch, ZoneWatch, read_robot_pose};
use armor_sdk::prelude::*;

use crate::fencing::{FenceNews, FenceSettings, Fencing, LocatedRobot};

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct FenceParameters {
    /// circle around the robot's centre that encloses it
    #[parameter(unit = "m", default = "0.18m", range = 0.0..=5.0)]
    radius_m: f64,
    /// a zone is near within this
    #[parameter(unit = "m", default = "0.5m", range = 0.0..=1000.0)]
    near_m: f64,
    /// standard deviations of the pose that a breach must exceed, and by which near comes earlier
    #[parameter(default = 2, range = 0.0..=10.0)]
    sigmas: f64,
    /// what was reported ends only when the robot is this much further away
    #[parameter(unit = "m", default = "0.1m", range = 0.0..=100.0)]
    release_m: f64,
}

impl FenceParameters {
    fn settings(&self) -> FenceSettings {
        let Self { radius_m, near_m, sigmas, release_m } = *self;
        FenceSettings { radius_m, near_m, sigmas, release_m }
    }
}

/// What it reports to the mission.
#[derive(Debug, Events)]
enum FenceEvent {
    /// the robot is in a no-go zone, outside of the stay-in zones, or within the margin of either;
    /// its value is how far
    #[event(unit = "m")]
    Breach(f64),
    /// no breach is left
    Back,
    /// a no-go, stay-in or observed zone has come near; its value is the distance
    #[event(unit = "m")]
    Near(f64),
    /// the map frame has another origin: nothing is known of zones until those of this one arrive
    FrameChanged,
}

/// Reports that the robot is near a zone, where it must not be, and back.
pub struct Fence {
    armor: Armor,
    parameters: FenceParameters,
    fencing: Fencing,
    frames: FrameWatch,
    zones: ZoneWatch,
    /// Why the zones are not known, as logged last.
    zone_fault: Option<String>,
    /// One is reported per call: at most two for each zone.
    news: VecDeque<FenceNews>,
}

impl Component for Fence {
    const KIND: &'static str = "fence";
    const SUMMARY: &'static str =
        "Reports that the robot is near a zone, where it must not be, and back.";
    const REPORTS_DONE: bool = false;
    const PARAMETERS: &'static [Parameter] = FenceParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("pose", "where the robot is on the map, with its covariance"),
        ("zones", "the zones; nothing is reported without zones of the map's frame"),
        ("nearest", "the name of the nearest zone, at every pose; empty without one"),
        (
            "distance",
            "how far the robot's outline is from that zone's margin, in metres, at every pose; \
             negative where it must not be, infinite without a zone",
        ),
    ];
    const EVENTS: &'static [DeclaredEvent] = FenceEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.subscribe::<Zones>("zones")?;
        armor.provide::<Text>("nearest")?;
        armor.provide::<Number>("distance")?;
        let parameters = FenceParameters::request(&armor)?;
        let fencing = Fencing::new(parameters.settings());
        Ok(Self {
            armor,
            parameters,
            fencing,
            frames: FrameWatch::default(),
            zones: ZoneWatch::default(),
            zone_fault: None,
            news: VecDeque::new(),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        if header.id() == "zones" {
            if let Some(zones) = self.zones.zones_seen(&data.decode()?) {
                self.fencing.zones_seen(zones);
            }
            return Ok(());
        }
        let pose: PoseWithCovarianceStamped = data.decode()?;
        if self.frames.frame_seen(&pose.frame) == FrameNews::Changed {
            // What was reported was about places of the other frame.
            self.forget_reports();
        }
        if self.are_zones_known() { self.judge_pose(&pose) } else { Ok(()) }
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.zones.expect_zones(true);
            self.forget_reports();
        }
        if self.frames.take_change() {
            return Ok(FenceEvent::FrameChanged.into());
        }
        Ok(match self.news.pop_front() {
            None => Outcome::CarryOn,
            Some(FenceNews::Breach { zone, depth_m }) => {
                tracing::warn!("the robot is {depth_m:.2} m past the border of the zone {zone}");
                FenceEvent::Breach(depth_m).into()
            }
            Some(FenceNews::Back) => {
                tracing::info!("the robot is back where it may be");
                FenceEvent::Back.into()
            }
            Some(FenceNews::Near { zone, distance_m }) => {
                tracing::info!("the zone {zone} is near: {distance_m:.2} m");
                FenceEvent::Near(distance_m).into()
            }
        })
    }
}

impl Fence {
    fn forget_reports(&mut self) {
        self.fencing.reset_state(self.parameters.settings());
        self.news.clear();
    }

    fn are_zones_known(&mut self) -> bool {
        let fault = self.zones.fault(&self.frames);
        if fault != self.zone_fault {
            if let Some(fault) = &fault {
                tracing::warn!("nothing is reported: {fault}");
            }
            self.zone_fault = fault;
        }
        self.zone_fault.is_none()
    }

    fn judge_pose(&mut self, pose: &PoseWithCovarianceStamped) -> Result<(), Fault> {
        let on_map = read_robot_pose(pose);
        if !on_map.is_finite() {
            return Ok(());
        }
        // Row-major over x, y, z and three rotations.
        let covariance = &pose.pose.covariance;
        let covariance_m2 = [covariance[0], covariance[1], covariance[7]];
        let robot = LocatedRobot { place: on_map.point(), covariance_m2 };
        self.news.extend(self.fencing.robot_seen(&robot));
        let (zone, distance_m) = self.fencing.nearest().unwrap_or(("", f64::INFINITY));
        self.armor.send_data("nearest", &Text { data: zone.to_owned() })?;
        self.armor.send_data("distance", &Number { data: distance_m })?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_sdk::testing::{ReportKind, TestError, TestedComponent};

    use super::*;

    const TICK: Duration = Duration::from_millis(100);

    fn send_zones(fence: &mut TestedComponent, frame: &str) -> Result<(), TestError> {
        let pond = Zone { name: "pond".into(), radius: 1.0, ..Zone::default() };
        fence.send("zones", &Zones { frame: frame.into(), zones: vec![pond], stamp: 0.0 })
    }

    fn send_pose(fence: &mut TestedComponent, frame: &str, x: f64) -> Result<(), TestError> {
        let mut pose = PoseWithCovarianceStamped { frame: frame.into(), ..Default::default() };
        pose.pose.pose.position.x = x;
        pose.pose.covariance[0] = 0.0001;
        pose.pose.covariance[7] = 0.0001;
        fence.send("pose", &pose)?;
        fence.tick_after(TICK)?;
        fence.tick_after(TICK)
    }

    fn names(fence: &TestedComponent) -> Vec<String> {
        let name = |report: &ReportKind| match report {
            ReportKind::Event { name, .. } => name.clone(),
            other => format!("{other:?}"),
        };
        fence.reports().iter().map(name).collect()
    }

    #[test]
    fn it_reports_near_breach_and_back_and_the_nearest_zone() -> Result<(), TestError> {
        let mut fence = TestedComponent::build::<Fence>(&[])?;
        fence.start()?;
        send_zones(&mut fence, "map")?;
        send_pose(&mut fence, "map", 3.0)?;
        assert_eq!(fence.last_output::<Text>("nearest")?.data, "pond");
        assert!((fence.last_output::<Number>("distance")?.data - 1.82).abs() < 1e-9);
        for x in [1.5, 0.5, 1.5, 3.0] {
            send_pose(&mut fence, "map", x)?;
        }
        assert_eq!(names(&fence), ["near", "breach", "back"]);
        Ok(())
    }

    #[test]
    fn without_zones_of_its_frame_nothing_is_reported() -> Result<(), TestError> {
        let mut fence = TestedComponent::build::<Fence>(&[])?;
        fence.start()?;
        send_pose(&mut fence, "map", 0.5)?;
        send_zones(&mut fence, "map#3f2a")?;
        send_pose(&mut fence, "map", 0.5)?;
        assert!(names(&fence).is_empty());
        assert!(fence.outputs::<Number>("distance")?.is_empty());
        send_pose(&mut fence, "map#3f2a", 0.5)?;
        send_pose(&mut fence, "map#3f2a", 0.5)?;
        assert_eq!(names(&fence), ["frame_changed", "breach", "near"]);
        Ok(())
    }

    #[test]
    fn a_breach_is_reported_in_each_activation() -> Result<(), TestError> {
        let mut fence = TestedComponent::build::<Fence>(&[])?;
        for count in 1..=2 {
            fence.start()?;
            send_zones(&mut fence, "map")?;
            send_pose(&mut fence, "map", 0.5)?;
            let breaches = names(&fence).into_iter().filter(|name| name == "breach").count();
            assert_eq!(breaches, count);
            fence.stop()?;
        }
        Ok(())
    }
}
