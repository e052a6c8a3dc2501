//! The system that the window watches: a run that it started, one that it is attached to, or none.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use armor_configd::KeptVersion;
use armor_inspect::launch::{ChildRun, LaunchError, LaunchPlan, LaunchVerb, RunStage};
use armor_inspect::log::{LogLine, RunLog, Tail};
use armor_inspect::systems::{self, RunRecord};
use armor_inspect::{
    MissionLook, MissionWatch, ParameterClient, SystemPicture, SystemWatch, WakeCallback, this_user,
};
use armor_recording::playback::{PlaybackState, PlayerRemote};
use armor_sdk::control::Order;
use eframe::egui;

use super::play_folder::PlayFolder;
use super::playback::{Playback, PlaybackWish};
use super::version::RunningVersions;
use super::watched::{self, Watched};
use super::words;
use crate::commands::Command;
use crate::kinds::find_armor;

/// News of a running system are shown within this time, all those of it immediately.
const SHOW_WITHIN: Duration = Duration::from_millis(100);

/// Earlier runs whose logs are kept. Each log is bounded.
const MAX_PAST: usize = 4;
/// Pause between two looks for the run that took the address of another one.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// The log of an earlier run.
pub struct PastRun {
    /// The system, its address and when it was started.
    pub name: String,
    /// What its processes wrote.
    pub log: RunLog,
}

/// How things stand, in a word or two.
#[derive(Clone, Debug, PartialEq)]
pub enum Standing {
    /// The window knows of no running system.
    Idle,
    /// A run was started, and cannot be found yet.
    Starting,
    /// It is watched.
    Watching,
    /// The system that is watched has ended, or cannot be reached any longer.
    Lost,
    /// The run was asked to stop.
    Stopping,
    /// The run has ended; its last known state is still shown.
    Over,
}

/// What the window watches.
#[derive(Default)]
pub struct Session {
    /// What the processes say.
    pub log: RunLog,
    /// Which run it is of.
    pub log_name: String,
    /// The logs of earlier runs, the newest first.
    pub past: VecDeque<PastRun>,
    /// When another run at the same address was last looked for.
    looked: Option<Instant>,
    /// In whose name orders are given.
    pub author: String,
    /// Component directories, in addition to those of the file.
    components: Vec<PathBuf>,
    watched: Option<Watched>,
    run: Option<ChildRun>,
    /// The recording that is played.
    playback: Option<Playback>,
    /// The folder of what this window plays. After the run, which writes into it.
    play_folder: Option<PlayFolder>,
    /// How the last run ended, and whether that was well.
    ended: Option<(String, bool)>,
    ctx: Option<egui::Context>,
}

impl Session {
    /// Nothing is watched yet; `ctx` is woken when there is something new.
    pub fn new(ctx: &egui::Context, components: Vec<PathBuf>) -> Self {
        Self { author: this_user(), components, ctx: Some(ctx.clone()), ..Self::default() }
    }

    /// Component directories, in addition to those of the file.
    pub fn component_folders(&self) -> &[PathBuf] {
        &self.components
    }

    /// Whether a command about what runs can be run now.
    pub fn may(&self, command: Command) -> bool {
        let heard = || self.watched.as_ref().filter(|watched| watched.silence().is_none());
        let orderable = || heard().filter(|watched| !watched.is_recorded());
        let marking = || orderable()?.mission.look().marking;
        match command {
            Command::Run => self.run.is_none(),
            Command::Stop => self.run.is_some(),
            Command::Detach => self.run.is_none() && self.watched.is_some(),
            Command::Pause => {
                marking().is_some_and(|it| it.pause.is_none() && !words::is_over(it.stage))
            }
            Command::Resume => marking().is_some_and(|it| it.pause.is_some()),
            _ => false,
        }
    }

    /// Runs one, but for [`Command::Run`].
    pub fn run_command(&mut self, command: Command) {
        let order = match command {
            Command::Stop | Command::Detach => return self.stop(),
            Command::Pause => Order::Pause,
            Command::Resume => Order::Resume,
            _ => return,
        };
        if let Some(watched) = &self.watched {
            watched.orders.give(&self.author, false, order);
        }
    }

    fn wake(&self) -> WakeCallback {
        let ctx = self.ctx.clone();
        std::sync::Arc::new(move || {
            if let Some(ctx) = &ctx {
                ctx.request_repaint_after(SHOW_WITHIN);
            }
        })
    }

    /// What is watched, if anything is.
    pub fn watched(&self) -> Option<&Watched> {
        self.watched.as_ref()
    }

    /// The recording that is played, if one is.
    pub fn playback(&self) -> Option<&Playback> {
        self.playback.as_ref()
    }

    /// Whether this window plays a recording, or has played it until its end.
    pub fn is_playing(&self) -> bool {
        self.playback.as_ref().is_some_and(|playback| playback.is_own)
    }

    /// The player of the system that is watched.
    pub fn player(&self) -> Option<&PlayerRemote> {
        self.watched.as_ref()?.player.as_ref()
    }

    /// Whether the player can be given orders.
    pub fn may_order_player(&self) -> bool {
        let heard = self.watched.as_ref().filter(|watched| watched.silence().is_none());
        let player = heard.and_then(|watched| watched.player.as_ref());
        player.is_some_and(|player| player.look().state().is_some())
    }

    /// Gives the player the orders for what the user wants.
    pub fn order_player(&self, wish: PlaybackWish) {
        let Some(player) = self.player().filter(|_| self.may_order_player()) else { return };
        let found = self.playback.as_ref().map(Playback::found).unwrap_or_default();
        wish.orders(&player.look(), &found).into_iter().for_each(|order| player.order(order));
    }

    /// The run that this window started, if it has not ended.
    pub fn run(&self) -> Option<&ChildRun> {
        self.run.as_ref()
    }

    /// How the last run ended, and whether that was well.
    pub fn ended(&self) -> Option<(&str, bool)> {
        self.ended.as_ref().map(|(how, is_fine)| (how.as_str(), *is_fine))
    }

    /// Where the results of what has ended lie, if that is known here.
    pub fn results(&self) -> Option<&Path> {
        if self.is_playing() {
            // Nothing but the log, which is shown.
            return None;
        }
        let watched = self.watched.as_ref().filter(|watched| watched.silence().is_some())?;
        Some(&watched.record.as_ref()?.out)
    }

    /// Whether a file that has changed is one that was changed from here, by setting a parameter.
    pub fn has_written(&self) -> bool {
        self.watched.as_ref().is_some_and(|watched| watched.parameters.has_written())
    }

    /// How things stand.
    pub fn standing(&self) -> Standing {
        match (self.run.as_ref().map(ChildRun::stage), &self.watched) {
            (Some(RunStage::Starting), _) => Standing::Starting,
            (Some(RunStage::Stopping), _) => Standing::Stopping,
            (None, Some(_)) if self.ended.is_some() => Standing::Over,
            (_, Some(watched)) if watched.silence().is_some() => Standing::Lost,
            (_, Some(_)) => Standing::Watching,
            (Some(_), None) => Standing::Starting,
            (None, None) => Standing::Idle,
        }
    }

    /// Runs a file; the system watched before is no longer watched.
    ///
    /// # Errors
    /// If `armor` is not found or does not start.
    pub fn start(&mut self, file: &Path) -> Result<(), LaunchError> {
        self.leave();
        let plan = LaunchPlan {
            program: find_armor().ok_or(LaunchError::NoProgram)?,
            file: file.into(),
            components: self.components.clone(),
            ..LaunchPlan::default()
        };
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        self.begin_log(format!("{name}, started {}", words::time_of_day(now_s)));
        self.run = Some(ChildRun::start(&plan, self.log.clone(), self.wake())?);
        Ok(())
    }

    /// Plays a recording; the system watched before is no longer watched.
    ///
    /// # Errors
    /// If `armor` is not found or does not start.
    pub fn play(&mut self, recording: &Path) -> Result<(), LaunchError> {
        self.leave();
        let program = find_armor().ok_or(LaunchError::NoProgram)?;
        let failed = |error| LaunchError::Start { program: program.clone(), error };
        let playback = Playback::begin(recording, true, self.wake()).map_err(failed)?;
        let folder = PlayFolder::create().map_err(failed)?;
        let plan = LaunchPlan {
            program: program.clone(),
            verb: LaunchVerb::Play,
            file: recording.into(),
            out: Some(folder.path().into()),
            components: self.components.clone(),
            arguments: ["--stay", "--headless", "--quiet"].map(Into::into).into(),
        };
        self.begin_log(playback.name());
        self.run = Some(ChildRun::start(&plan, self.log.clone(), self.wake())?);
        (self.playback, self.play_folder) = (Some(playback), Some(folder));
        Ok(())
    }

    /// Watches the system whose registry listens at `registry`; what was watched before is let go,
    /// and a run that this window started is stopped.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn attach(&mut self, registry: &str, record: Option<RunRecord>) -> std::io::Result<()> {
        self.leave();
        self.begin_log(record.as_ref().map_or_else(|| registry.to_owned(), words::name_run));
        let tail = match &record {
            Some(record) => {
                let path = record.resolve(&record.out).join("logs/all.log");
                Some(Tail::begin(&path, self.log.clone(), self.wake())?)
            }
            None => {
                let text = "The log is on the system's host, in the folder of its run";
                self.log.push(LogLine::own_line(watched::TOOL, "INFO", text));
                None
            }
        };
        self.watched = Some(Watched::at(registry, record, tail, &self.wake())?);
        Ok(())
    }

    /// Begins the log of a run; the log before remains readable under its name.
    pub fn begin_log(&mut self, name: String) {
        let log = std::mem::take(&mut self.log);
        let before = std::mem::replace(&mut self.log_name, name);
        if log.count() > 0 {
            self.past.push_front(PastRun { name: before, log });
            self.past.truncate(MAX_PAST);
        }
    }

    /// Shows a picture and a mission that stay as they are, with no system behind them: for tests.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn show_still(
        &mut self,
        picture: SystemPicture,
        look: MissionLook,
        parameters: ParameterClient,
    ) -> std::io::Result<()> {
        let (watch, mission) = (SystemWatch::still(picture), MissionWatch::still(look));
        let mut watched = Watched::by(watch, mission, "nowhere", &self.wake())?;
        watched.parameters = parameters;
        self.watched = Some(watched);
        Ok(())
    }

    /// The same system, running these versions of a file: for tests.
    pub fn show_versions(&mut self, record: RunRecord, versions: RunningVersions) {
        if let Some(watched) = &mut self.watched {
            (watched.record, watched.versions) = (Some(record), Some(versions));
        }
    }

    /// The same system, played from a recording: for tests.
    pub fn show_playback(&mut self, playback: Playback, state: PlaybackState) {
        self.playback = Some(playback);
        if let Some(watched) = &mut self.watched {
            watched.player = Some(PlayerRemote::still(state));
        }
    }

    /// Lets go of what is watched, which continues; a run that this window started is stopped.
    pub fn leave(&mut self) {
        self.ended = None;
        self.watched = None;
        self.run = None;
        self.playback = None;
        self.play_folder = None;
    }

    /// Requests that the run stops in order. A second request kills the processes that still run.
    pub fn stop(&mut self) {
        match &self.run {
            Some(run) => run.stop(),
            None => self.leave(),
        }
    }

    /// Updates the state of the session; to be called in each frame.
    pub fn poll(&mut self) {
        self.poll_run();
        let is_over = self.run.is_none() && self.ended.is_some();
        let is_stopping = self.standing() == Standing::Stopping;
        if let Some(watched) = &mut self.watched {
            watched.poll(is_over);
            let lines = watched.take_losses();
            if !is_over && !is_stopping {
                lines.into_iter().for_each(|line| self.log.push(line));
            }
        }
        self.follow_address();
        self.follow_playback();
    }

    /// Reads the recording that the watched system plays.
    fn follow_playback(&mut self) {
        if self.is_playing() {
            let texts = self.playback.as_ref().map(|playback| playback.found().files);
            let is_drawn = |watched: &&mut Watched| watched.is_recording_drawn;
            let watched = self.watched.as_mut().filter(|watched| !is_drawn(watched));
            if let (Some(watched), Some(texts)) = (watched, texts)
                && !texts.is_empty()
            {
                // What was recorded is what is shown, also where it cannot run.
                let version = KeptVersion { number: 1, files: texts.to_vec() };
                watched.versions = Some(RunningVersions::still(version, None));
                watched.is_recording_drawn = true;
            }
            return;
        }
        let look = self.player().map(PlayerRemote::look);
        let state = look.as_ref().and_then(|look| look.state());
        let Some(path) = state.map(|state| PathBuf::from(&state.recording)) else { return };
        let is_read = self.playback.as_ref().is_some_and(|playback| playback.path() == path);
        // On another host the path leads nowhere, or to another file.
        if is_read || self.watched.as_ref().is_none_or(|watched| watched.record.is_none()) {
            return;
        }
        match Playback::begin(&path, false, self.wake()) {
            Ok(playback) => self.playback = Some(playback),
            Err(error) => {
                self.log.push(LogLine::own_line(watched::TOOL, "ERROR", error.to_string()));
            }
        }
    }

    /// Watches the run that has taken the address of the watched one. A registry that was only
    /// restarted has the record that it had before.
    fn follow_address(&mut self) {
        let is_doubtful =
            |watched: &&mut Watched| watched.may_be_another || watched.has_lost_registry();
        let Some(watched) = self.watched.as_mut().filter(is_doubtful) else { return };
        if self.run.is_some() || self.ended.is_some() {
            watched.may_be_another = false;
            return;
        }
        // Nothing else may draw a frame in which to look again.
        if let Some(ctx) = self.ctx.as_ref().filter(|_| watched.record.is_some()) {
            ctx.request_repaint_after(LOOK_EVERY);
        }
        if self.looked.is_some_and(|looked| looked.elapsed() < LOOK_EVERY) {
            return;
        }
        self.looked = Some(Instant::now());
        let Some(before) = &watched.record else {
            if !watched.may_be_another {
                return;
            }
            // On another host a new run cannot be distinguished from a restarted registry.
            watched.may_be_another = false;
            let text = "The registry was found again: these may be lines of another run";
            self.log.push(LogLine::own_line(watched::TOOL, "WARN", text));
            return;
        };
        let records = running().unwrap_or_default();
        match records.into_iter().find(|record| record.registry == before.registry) {
            Some(record) if !words::is_same_run(&record, before) => {
                let registry = record.registry.to_string();
                if let Err(error) = self.attach(&registry, Some(record)) {
                    self.log.push(LogLine::own_line(watched::TOOL, "ERROR", error.to_string()));
                }
            }
            Some(_) => watched.may_be_another = false,
            // The launcher has ended, and its run with it; the next run has no record yet.
            None => watched.end(),
        }
    }

    fn poll_run(&mut self) {
        let Some(run) = &self.run else { return };
        match run.stage() {
            RunStage::Running(record) if self.watched.is_none() => {
                let registry = record.registry.to_string();
                self.log_name = words::name_run(&record);
                match Watched::at(&registry, Some(record), None, &self.wake()) {
                    Ok(watched) => self.watched = Some(watched),
                    Err(error) => {
                        self.log.push(LogLine::own_line(watched::TOOL, "ERROR", error.to_string()));
                    }
                }
            }
            RunStage::Ended { how, is_fine } => {
                self.log.push(LogLine::own_line(
                    watched::TOOL,
                    if is_fine { "INFO" } else { "ERROR" },
                    &*how,
                ));
                self.ended = Some((how, is_fine));
                self.run = None;
            }
            _ => {}
        }
    }
}

/// The systems of this user that run on this host.
pub fn running() -> Result<Vec<RunRecord>, systems::SystemsError> {
    systems::list_running(&systems::record_directory()?)
}
