//! The player as a component: a log in, odometry and scans out.

pub mod messages;

use std::io::BufRead;
use std::path::PathBuf;

use armor_sdk::prelude::*;

use messages::{make_laser_scan, make_odometry};

use crate::log::CarmenLog;
use crate::playback::{OdometrySource, Playback};
use crate::record::{Mount, RecordedScan};

/// Most scans of one call, so that a call stays short however fast they are taken.
const SCANS_PER_CALL: u32 = 50;

type LogFile = Box<dyn BufRead + Send>;

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct CarmenParameters {
    /// the log, plain or gzip
    #[parameter(format = "file")]
    file: PathBuf,
    /// times the log's own timing; 0: as fast as the scans are taken
    #[parameter(default = 0, range = 0.0..=1e6)]
    speed: f64,
    /// readings from here on mean that nothing was seen
    // The logs' own robot_front_laser_max is often that of another program, so it is not used.
    #[parameter(unit = "m", default = "50m", range = 0.1..=1000.0)]
    range_max_m: f32,
    /// which laser is played
    #[parameter(default = "front", choices("front" = Mount::Front, "rear" = Mount::Rear))]
    laser: Mount,
    /// from the scan's own line, or interpolated between ODOM lines
    #[parameter(
        default = "scan",
        choices("scan" = OdometrySource::Scan, "apart" = OdometrySource::Apart),
    )]
    odometry_from: OdometrySource,
}

/// Plays a CARMEN log, as if the robot were here.
pub struct CarmenPlayer {
    armor: Armor,
    parameters: CarmenParameters,
    playback: Option<Playback<LogFile>>,
    last_stamp_s: Option<f64>,
}

impl Component for CarmenPlayer {
    const KIND: &'static str = "carmen-player";
    const SUMMARY: &'static str = "Plays a CARMEN log: recorded laser scans and odometry.";
    const PARAMETERS: &'static [Parameter] = CarmenParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("scan", "ranges from right to left, stamps of the log"),
        ("odometry", "before each scan the odometry of the same stamp"),
        ("transforms", "where base_link is in odom, as the odometry has it"),
        ("clock", "time of the log, for <clock>; before each scan, and with a speed between them"),
        ("end", "number of scans, after the last"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<LaserScan>("scan")?;
        armor.provide::<Odometry>("odometry")?;
        armor.provide::<FrameTransforms>("transforms")?;
        armor.provide::<Latched<Clock>>("clock")?;
        armor.provide::<Latched<Count>>("end")?;
        let parameters = CarmenParameters::request(&armor)?;
        Ok(Self { armor, parameters, playback: None, last_stamp_s: None })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => self.start_playback()?,
            Call::Stopping => return Ok(Outcome::CarryOn),
            Call::Tick | Call::Data => {}
        }
        let Some(mut playback) = self.playback.take() else { return Ok(Outcome::CarryOn) };
        let file = self.parameters.file.display().to_string();
        for _ in 0..SCANS_PER_CALL {
            match playback.next_due(self.armor.timestamp()).map_err(|e| format!("{file}: {e}"))? {
                Some(scan) => self.publish_scan(&scan)?,
                None => break,
            }
        }
        if let Some(fault) = playback.take_fault() {
            tracing::warn!("{file}: {fault}");
        }
        if let Some(clock) =
            playback.time_s(self.armor.timestamp()).filter(|_| !playback.has_ended())
        {
            self.armor.send_data("clock", &Clock { clock })?;
        }
        if playback.has_ended() {
            return self.report_end(&playback);
        }
        self.playback = Some(playback);
        Ok(Outcome::CarryOn)
    }
}

impl CarmenPlayer {
    /// Opens the log, or continues in it after a pause.
    fn start_playback(&mut self) -> Result<(), Fault> {
        if let Some(playback) = &mut self.playback {
            playback.resume();
            return Ok(());
        }
        let log = CarmenLog::<LogFile>::open(&self.parameters.file)
            .map_err(|error| format!("{}: {error}", self.parameters.file.display()))?;
        let CarmenParameters { laser, odometry_from, speed, .. } = self.parameters;
        self.playback = Some(Playback::new(log, laser, odometry_from, speed));
        Ok(())
    }

    fn report_end(&self, playback: &Playback<LogFile>) -> Result<Outcome, Fault> {
        let (count, tally) = (playback.played(), playback.tally());
        if let Some(damage) = playback.damage() {
            let file = self.parameters.file.display();
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
            let laser = if self.parameters.laser == Mount::Front { "front" } else { "rear" };
            let text =
                format!("{} has no scan of the {laser} laser", self.parameters.file.display());
            return Ok(Outcome::Failed(text));
        }
        self.armor.send_data("end", &Count { count })?;
        Ok(Outcome::Done)
    }

    fn publish_scan(&mut self, scan: &RecordedScan) -> Result<(), Fault> {
        let stamp = scan.stamp_s;
        self.armor.send_data("clock", &Clock { clock: stamp })?;
        let odometry = make_odometry(scan);
        self.armor.send_data("transforms", &FrameTransforms::from_odometry(&odometry))?;
        self.armor.send_data("odometry", &odometry)?;
        let scan_time_s = self.last_stamp_s.map_or(0.0, |last_s| stamp - last_s);
        self.last_stamp_s = Some(stamp);
        let laser_scan = make_laser_scan(scan, self.parameters.range_max_m, scan_time_s);
        self.armor.send_data("scan", &laser_scan)?;
        Ok(())
    }
}
