//! The frame of the map, and the state on the disk by which a mapper that is started again continues
//! it.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use armor_convert::build_frame;

use super::{GridSlam, GridSlamEvent, MAP};
use crate::continuation::{
    Continuation, KnownMap, MapperStart, RefusedState, draw_epoch, judge_state, mark_not_begun,
};
use crate::filter::ScanEstimate;
use crate::pose::Pose;
use crate::recognition::MOST_S;
use crate::recorder::StateRecorder;
use crate::scan::MapperScan;
use crate::slam::Slam;
use crate::state::{StateFit, StateHeader, encode_header};
use crate::state_file::{StateFile, read_state, replace_state};

/// Names the run to its processes. Without it there is no run whose frame could be continued.
const RUN_VARIABLE: &str = "ARMOR_RUN";
/// States whether a process is the first of its component in the run; this value if it is not.
const START_VARIABLE: &str = "ARMOR_START";
const LATER: &str = "later";
/// The state is written this often. In a second a robot sees a new aisle, and without the scans of
/// that second the next mapper finds its place in it less exactly.
const STATE_PERIOD: Duration = Duration::from_millis(200);

/// The state as far as it was written.
pub(super) struct KeptState {
    file: StateFile,
    recorder: StateRecorder,
    written: Option<Instant>,
    /// That of the last scan.
    odometry: Pose,
}

impl GridSlam {
    /// Marks in place of a state that no frame was begun in this run, if this is its first mapper.
    pub(super) fn mark_first_start(&self) {
        let run = std::env::var(RUN_VARIABLE).unwrap_or_default();
        if run.is_empty() || !self.parameters.keep_state || !is_first_of_run() {
            return;
        }
        // Without it a mapper that dies before its first scan is followed by one in another epoch.
        if let Err(error) = replace_state(&self.state_path(), &mark_not_begun(&run)) {
            tracing::warn!("the state of the map cannot be kept: {error}");
        }
    }

    /// Decides in which frame to map, when the first scan is there.
    pub(super) fn choose_frame(&mut self, scan: &MapperScan) {
        let run = std::env::var(RUN_VARIABLE).unwrap_or_default();
        let is_first = is_first_of_run();
        if run.is_empty() || !self.parameters.keep_state {
            let is_known = is_first && !self.has_begun;
            let epoch = if is_known { String::new() } else { draw_epoch() };
            if !is_known {
                tracing::warn!("{}: {MAP}#{epoch} begins here", RefusedState::Gone);
                self.events.push_back(GridSlamEvent::FrameChanged);
            }
            (self.frame, self.has_begun) = (Some(build_frame(MAP, &epoch)), true);
            return;
        }
        let config = self.parameters.config();
        let found = match read_state(&self.state_path()) {
            Ok(file) => {
                judge_state(file.as_deref(), MapperStart { run: &run, is_first }, &config, scan)
            }
            Err(error) => Continuation::NewEpoch(RefusedState::Disk(error.to_string())),
        };
        match found {
            Continuation::First => self.begin_frame(String::new()),
            Continuation::Known(known) => self.continue_frame(*known),
            Continuation::NewEpoch(refused) => self.begin_epoch(&refused),
        }
    }

    fn continue_frame(&mut self, known: KnownMap) {
        let KnownMap { slam, search, recorder, epoch, len } = known;
        match StateFile::resume(&self.state_path(), len) {
            Ok(file) => {
                let odometry = Pose::default();
                self.state = Some(KeptState { file, recorder, written: None, odometry });
            }
            // The map is known all the same.
            Err(error) => tracing::warn!("the state of the map is written no more: {error}"),
        }
        tracing::info!(
            scans = slam.scans(),
            "the map of before is continued: looking for the robot"
        );
        (self.slam, self.search) = (slam, Some(search));
        self.frame = Some(build_frame(MAP, &epoch));
        self.events.push_back(GridSlamEvent::Lost);
    }

    fn begin_epoch(&mut self, refused: &RefusedState) {
        let epoch = draw_epoch();
        tracing::warn!(
            "the map of before is not continued: {refused}; the frame {MAP}#{epoch} begins here"
        );
        self.slam = Slam::new(self.parameters.config());
        self.search = None;
        self.events.push_back(GridSlamEvent::FrameChanged);
        self.begin_frame(epoch);
    }

    /// Begins a frame whose origin is where the robot stands. That it was begun is on the disk
    /// before any pose is published in it: otherwise the next start could take it for the first.
    fn begin_frame(&mut self, epoch: String) {
        let run = std::env::var(RUN_VARIABLE).unwrap_or_default();
        let fit = StateFit::of(&self.parameters.config());
        let header = StateHeader { run, epoch: epoch.clone(), fit };
        let (recorder, odometry) = (StateRecorder::default(), Pose::default());
        let begun = StateFile::begin(&self.state_path(), &encode_header(&header));
        self.state = match begun {
            Ok(file) => Some(KeptState { file, recorder, written: None, odometry }),
            Err(error) => {
                tracing::warn!("the state of the map cannot be kept: {error}");
                None
            }
        };
        // A frame that the next start cannot know needs a name that it will not use again.
        let is_marked = self.state.is_some() || !epoch.is_empty();
        let epoch = if is_marked { epoch } else { draw_epoch() };
        self.frame = Some(build_frame(MAP, &epoch));
    }

    /// Looks where the robot is on the stored map. Returns whether a scan may be added: the robot
    /// was found, or is taken for being elsewhere.
    pub(super) fn find_place(&mut self, odometry: Pose, scan: &MapperScan) -> bool {
        let Some(search) = &mut self.search else { return true };
        if let Some(robot) = self.slam.find_place(search, odometry, scan) {
            self.slam.place_robot(robot, odometry, scan.stamp_s);
            tracing::info!("the robot was recognised on the map of before");
            (self.search, self.is_new) = (None, true);
            self.events.push_back(GridSlamEvent::Continued);
        } else if search.is_over(scan.stamp_s) {
            self.begin_epoch(&RefusedState::Lost(MOST_S));
        }
        self.search.is_none()
    }

    pub(super) fn record_scan(
        &mut self,
        odometry: Pose,
        estimate: &ScanEstimate,
        scan: &MapperScan,
    ) {
        let Some(state) = &mut self.state else { return };
        state.odometry = odometry;
        if estimate.drawn {
            state.recorder.scan_drawn(self.slam.travelled_m(), scan.clone());
        }
        self.write_state(false);
    }

    /// Adds to the file what is new, if its period is over or nothing follows.
    pub(super) fn write_state(&mut self, is_last: bool) {
        let Some(state) = &mut self.state else { return };
        let is_due = state.written.is_none_or(|written| written.elapsed() >= STATE_PERIOD);
        // A robot that is not recognised adds nothing.
        if self.search.is_none() && (is_due || is_last) {
            let batch = state.recorder.take_batch(&self.slam, state.odometry);
            if !batch.is_empty() {
                state.written = Some(Instant::now());
            }
            state.file.add_batch(batch);
        }
    }

    fn state_path(&self) -> PathBuf {
        let name = self.armor.provided_data("map").unwrap_or_default();
        let name = name.trim_end_matches(".map");
        self.parameters.state_folder.join(format!("{name}.state"))
    }
}

/// Whether no mapper before this one can have begun a frame in its run.
fn is_first_of_run() -> bool {
    std::env::var(START_VARIABLE).as_deref() != Ok(LATER)
}
