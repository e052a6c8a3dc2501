//! The recorder as a component: no inputs, since it records every output of the system.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use armor_inspect::find_own_registry;
use armor_recording::capture::{RecorderOptions, RecordingEnd, RecordingPath, SplitLimits};
use armor_recording::{Compression, OutputSelection};
use armor_sdk::prelude::*;

use crate::activation::ActivationRecording;

const BYTES_PER_MB: u64 = 1_000_000;
/// Time between two events about losses.
const LOSSES_EVERY: Duration = Duration::from_secs(1);

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct RecorderParameters {
    /// the file; a further activation and a further part have a number, recording-2.mcap
    #[parameter(default = "recording.mcap", written)]
    output: PathBuf,
    /// what is recorded, separated by spaces: COMPONENT.OUTPUT or COMPONENT.*; empty: everything
    #[parameter(default = "", parse = parse_names)]
    data: Vec<String>,
    /// what is left out, written the same way
    #[parameter(default = "", parse = parse_names)]
    exclude: Vec<String>,
    /// how the file is compressed
    #[parameter(
        default = "lz4",
        choices("none" = Compression::None, "lz4" = Compression::Lz4, "zstd" = Compression::Zstd)
    )]
    compress: Compression,
    /// another file begins after so many megabytes; 0: never
    #[parameter(default = 0, range = 0.0..=1e9)]
    split_len: u64,
    /// another file begins after this time; 0: never
    #[parameter(unit = "s", default = "0s", range = 0.0..=1e7)]
    split_time_s: f64,
    /// done after this time; 0: it records as long as it is active
    #[parameter(unit = "s", default = "0s", range = 0.0..=1e7)]
    for_s: f64,
    /// megabytes that are left on the disk for the mission
    #[parameter(default = 268, range = 0.0..=1e12, live)]
    keep_free: u64,
}

/// What it reports to the mission.
#[derive(Debug, Events)]
enum RecorderEvent {
    /// the disk has less than `keep_free` left: the file is complete, and nothing more is recorded
    DiskFull,
    /// messages were lost, because the disk or the recorder is too slow; the value is their number
    Lost(f64),
}

/// Records the system while it is active.
pub struct SystemRecorder {
    parameters: RecorderParameters,
    recording: Option<ActivationRecording>,
    reported_lost: u64,
    reported: Option<Instant>,
}

impl Component for SystemRecorder {
    const KIND: &'static str = "recorder";
    const SUMMARY: &'static str = "Records the data of the system into a file while it is active.";
    const READS_ALL: bool = true;
    const PARAMETERS: &'static [Parameter] = RecorderParameters::DECLARED;
    const EVENTS: &'static [DeclaredEvent] = RecorderEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        let parameters = RecorderParameters::request(&armor)?;
        Ok(Self { parameters, recording: None, reported_lost: 0, reported: None })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        if let Some(recording) = &self.recording {
            recording.set_least_free(self.parameters.least_free());
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => {
                let registry =
                    find_own_registry().ok_or("it runs without a registry, so it has no system")?;
                let recording = ActivationRecording::begin(&registry, self.parameters.options())?;
                (self.recording, self.reported_lost, self.reported) = (Some(recording), 0, None);
                Ok(Outcome::CarryOn)
            }
            Call::Stopping => {
                if let Some(mut recording) = self.recording.take() {
                    recording.finish();
                    // Too late for the mission, which waits for it to stop.
                    if let Some(Err(reason)) = recording.take_result() {
                        tracing::error!("the recording is not complete: {reason}");
                    }
                }
                Ok(Outcome::CarryOn)
            }
            _ => Ok(self.check_recording()),
        }
    }
}

impl SystemRecorder {
    fn check_recording(&mut self) -> Outcome {
        let Some(recording) = &self.recording else { return Outcome::CarryOn };
        match recording.take_result() {
            Some(Ok(RecordingEnd::Asked)) => return Outcome::Done,
            Some(Ok(RecordingEnd::DiskFull)) => return RecorderEvent::DiskFull.into(),
            Some(Err(reason)) => return Outcome::Failed(reason),
            Some(Ok(RecordingEnd::SystemEnded)) | None => {}
        }
        let lost = recording.count_lost() - self.reported_lost;
        let is_due = self.reported.is_none_or(|reported| reported.elapsed() >= LOSSES_EVERY);
        if lost == 0 || !is_due {
            return Outcome::CarryOn;
        }
        self.reported_lost += lost;
        self.reported = Some(Instant::now());
        RecorderEvent::Lost(lost as f64).into()
    }
}

impl RecorderParameters {
    fn least_free(&self) -> u64 {
        self.keep_free.saturating_mul(BYTES_PER_MB)
    }

    fn options(&self) -> RecorderOptions {
        let time = |seconds: f64| (seconds > 0.0).then(|| Duration::from_secs_f64(seconds));
        let len = self.split_len.saturating_mul(BYTES_PER_MB);
        RecorderOptions {
            selection: OutputSelection {
                include: self.data.clone(),
                exclude: self.exclude.clone(),
            },
            path: RecordingPath::NextFree(self.output.clone()),
            compression: self.compress,
            limits: SplitLimits {
                len: Some(len).filter(|len| *len > 0),
                time: time(self.split_time_s),
            },
            duration: time(self.for_s),
            least_free: self.least_free(),
        }
    }
}

/// Reads names that are separated by spaces.
fn parse_names(text: &str) -> Result<Vec<String>, String> {
    let check = |name: &str| {
        let checked = OutputSelection::check_name(name);
        checked.map(|()| name.to_owned()).map_err(|how| format!("{name}: {how}"))
    };
    text.split_whitespace().map(check).collect()
}

#[cfg(test)]
mod tests {
    use armor_sdk::testing::TestedComponent;

    use super::*;

    #[test]
    fn what_is_recorded_is_named_as_on_the_command_line() {
        TestedComponent::build::<SystemRecorder>(&[]).expect("its defaults");
        let names = parse_names("simulator.* mapper.pose").expect("two names");
        assert_eq!(names, ["simulator.*", "mapper.pose"]);
        for wrong in ["mapper", "mapper.pose,", "*", "mapper.*.x"] {
            assert!(parse_names(wrong).is_err_and(|error| error.contains(wrong)), "{wrong}");
        }
    }
}
