//! The player as a component: a log in, odometry and scans out.

use std::io::BufRead;
use std::path::PathBuf;

use armor_sdk::prelude::*;

use crate::log::Log;
use crate::playback::{OdometrySource, Playback};
use crate::record::{Mount, Scan};

/// Most scans of one call, so that a call stays short however fast they are taken.
const SCANS_PER_CALL: u32 = 50;
/// The scanners of these logs do not measure closer.
const RANGE_MIN_M: f32 = 0.02;

type LogFile = Box<dyn BufRead + Send>;

/// Plays a CARMEN log, as if the robot were here.
pub struct CarmenPlayer {
    armor: Armor,
    file: PathBuf,
    speed: f64,
    range_max_m: f32,
    mount: Mount,
    odometry: OdometrySource,
    playback: Option<Playback<LogFile>>,
    last_stamp_s: Option<f64>,
}

impl Component for CarmenPlayer {
    const KIND: &'static str = "carmen-player";
    const SUMMARY: &'static str = "Plays a CARMEN log: recorded laser scans and odometry.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::path("file").doc("the log, plain or gzip"),
        Parameter::number("speed", "")
            .default("0")
            .range(0.0, 1e6)
            .doc("times the log's own timing; 0: as fast as the scans are taken"),
        // The logs' own robot_front_laser_max is often that of another program, so it is not used.
        Parameter::number("range_max", "m")
            .default("50m")
            .range(0.1, 1000.0)
            .doc("readings from here on mean that nothing was seen"),
        Parameter::choice("laser", &["front", "rear"])
            .default("front")
            .doc("which laser is played"),
        Parameter::choice("odometry_from", &["scan", "apart"])
            .default("scan")
            .doc("from the scan's own line, or interpolated between ODOM lines"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("scan", "ranges from right to left, stamps of the log"),
        ("odometry", "before each scan the odometry of the same stamp"),
        ("clock", "time of the log, for <clock>; before each scan, and with a speed between them"),
        ("end", "how many scans there were, after the last"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<LaserScan>("scan")?;
        armor.provide::<Odometry>("odometry")?;
        armor.provide::<Latched<Clock>>("clock")?;
        armor.provide::<Latched<Count>>("end")?;
        for name in ["file", "speed", "range_max", "laser", "odometry_from"] {
            armor.get_parameter(name)?;
        }
        armor.synchronize()?;
        Ok(Self {
            armor,
            file: PathBuf::new(),
            speed: 0.0,
            range_max_m: 50.0,
            mount: Mount::Front,
            odometry: OdometrySource::Scan,
            playback: None,
            last_stamp_s: None,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "file" => self.file = value.path()?,
            "speed" => self.speed = value.number()?,
            "range_max" => self.range_max_m = value.number()? as f32,
            "laser" if value.text()? == "rear" => self.mount = Mount::Rear,
            "odometry_from" if value.text()? == "apart" => self.odometry = OdometrySource::Apart,
            _ => {}
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => self.start()?,
            Call::Stopping => return Ok(Outcome::CarryOn),
            Call::Tick | Call::Data => {}
        }
        let Some(mut playback) = self.playback.take() else { return Ok(Outcome::CarryOn) };
        let file = self.file.display().to_string();
        for _ in 0..SCANS_PER_CALL {
            match playback.next_due(self.armor.timestamp()).map_err(|e| format!("{file}: {e}"))? {
                Some(scan) => self.publish(&scan)?,
                None => break,
            }
        }
        if let Some(fault) = playback.take_fault() {
            tracing::warn!("{file}: {fault}");
        }
        if let Some(clock) = playback.time_s(self.armor.timestamp()).filter(|_| !playback.ended()) {
            self.armor.send_data("clock", &Clock { clock })?;
        }
        if playback.ended() {
            return self.end(&playback);
        }
        self.playback = Some(playback);
        Ok(Outcome::CarryOn)
    }
}

impl CarmenPlayer {
    /// Opens the log, or goes on in it after a pause.
    fn start(&mut self) -> Result<(), Fault> {
        if let Some(playback) = &mut self.playback {
            playback.resume();
            return Ok(());
        }
        let log = Log::<LogFile>::open(&self.file)
            .map_err(|error| format!("{}: {error}", self.file.display()))?;
        self.playback = Some(Playback::new(log, self.mount, self.odometry, self.speed));
        Ok(())
    }

    fn end(&self, playback: &Playback<LogFile>) -> Result<Outcome, Fault> {
        let (count, tally) = (playback.played(), playback.tally());
        if let Some(damage) = playback.damage() {
            let file = self.file.display();
            tracing::warn!("{file} breaks off: {damage}; the {count} scans before that are played");
        }
        tracing::info!(
            scans = count,
            lines = tally.lines,
            malformed = tally.malformed,
            unknown = tally.unknown,
            "the log is at its end"
        );
        if count == 0 {
            let laser = if self.mount == Mount::Front { "front" } else { "rear" };
            let text = format!("{} has no scan of the {laser} laser", self.file.display());
            return Ok(Outcome::Failed(text));
        }
        self.armor.send_data("end", &Count { count })?;
        Ok(Outcome::Done)
    }

    fn publish(&mut self, scan: &Scan) -> Result<(), Fault> {
        let (stamp, pose) = (scan.stamp_s, scan.odometry);
        let planar = Pose2D { x: pose.x_m, y: pose.y_m, theta: pose.yaw_rad };
        self.armor.send_data("clock", &Clock { clock: stamp })?;
        let odometry = Odometry::planar(stamp, "odom", "base_link", planar, Twist::default());
        self.armor.send_data("odometry", &odometry)?;
        let ranges = scan.ranges_within(self.range_max_m);
        let scan_time = self.last_stamp_s.map_or(0.0, |last_s| stamp - last_s);
        self.last_stamp_s = Some(stamp);
        let laser_scan = LaserScan {
            stamp,
            frame: "laser".into(),
            angle_min: scan.beams.angle_min_rad as f32,
            angle_max: scan.beams.angle_rad(ranges.len().saturating_sub(1)) as f32,
            angle_increment: scan.beams.increment_rad as f32,
            time_increment: 0.0,
            scan_time: scan_time as f32,
            range_min: RANGE_MIN_M,
            range_max: scan.beams.range_max_m.map_or(self.range_max_m, |max_m| max_m as f32),
            intensities: Array::default(),
            ranges: ranges.into(),
        };
        self.armor.send_data("scan", &laser_scan)?;
        Ok(())
    }
}
