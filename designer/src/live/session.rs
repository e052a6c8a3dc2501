//! What the window watches: a run that it started, a system that it is attached to, or nothing.

use std::path::{Path, PathBuf};
use std::time::Duration;

use armor_look::launch::{LaunchError, Plan, Run, Stage};
use armor_look::log::{Line, Log, Tail};
use armor_look::systems::{self, Record};
use armor_look::{
    MissionLook, MissionWatch, OrderDesk, ParameterDesk, Picture, Values, Wake, Watch, this_user,
};
use armor_sdk::control::Order;
use eframe::egui;

use super::words;
use crate::commands::Command;
use crate::kinds::find_armor;

/// Under which name the window looks at a system.
const TOOL: &str = "designer";
/// News of a running system are shown within this time, all those of it at once.
const SHOW_WITHIN: Duration = Duration::from_millis(100);

/// A system that is watched.
pub struct Watched {
    /// Where its registry listens.
    pub registry: String,
    /// What is known of it, if it is one of this user's on this host.
    pub record: Option<Record>,
    /// Who is there and what each does.
    pub watch: Watch,
    /// Where its mission stands.
    pub mission: MissionWatch,
    /// What flows on the outputs that are looked at.
    pub values: Values,
    /// Where orders are given.
    pub orders: OrderDesk,
    /// Where parameters are asked for and set.
    pub parameters: ParameterDesk,
    _tail: Option<Tail>,
}

/// How things stand, in a word or two.
#[derive(Clone, Debug, PartialEq)]
pub enum Standing {
    /// Nothing runs that the window knows of.
    Idle,
    /// A run was started, and cannot be found yet.
    Starting,
    /// It is watched.
    Watching,
    /// The system that is watched has ended, or cannot be reached any more.
    Lost,
    /// The run was asked to stop.
    Stopping,
}

/// What the window watches.
#[derive(Default)]
pub struct Session {
    /// What the processes say.
    pub log: Log,
    /// In whose name orders are given.
    pub author: String,
    /// Component directories, beside those of the file.
    components: Vec<PathBuf>,
    watched: Option<Watched>,
    run: Option<Run>,
    /// How the last run ended, and whether that was well.
    ended: Option<(String, bool)>,
    ctx: Option<egui::Context>,
}

impl Session {
    /// Nothing is watched yet; `ctx` is woken when there is something new.
    pub fn new(ctx: &egui::Context, components: Vec<PathBuf>) -> Self {
        Self { author: this_user(), components, ctx: Some(ctx.clone()), ..Self::default() }
    }

    /// Whether a command about what runs can be run now.
    pub fn may(&self, command: Command) -> bool {
        let marking = || self.watched.as_ref()?.mission.look().marking;
        match command {
            Command::Run => self.run.is_none(),
            Command::Stop => self.run.is_some(),
            Command::Detach => self.run.is_none() && self.watched.is_some(),
            Command::Pause => {
                marking().is_some_and(|it| it.pause.is_none() && !words::is_over(&it.stage))
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

    fn wake(&self) -> Wake {
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

    /// The run that this window started, if it has not ended.
    pub fn run(&self) -> Option<&Run> {
        self.run.as_ref()
    }

    /// How the last run ended, and whether that was well.
    pub fn ended(&self) -> Option<(&str, bool)> {
        self.ended.as_ref().map(|(how, is_fine)| (how.as_str(), *is_fine))
    }

    /// How things stand.
    pub fn standing(&self) -> Standing {
        match (self.run.as_ref().map(Run::stage), &self.watched) {
            (Some(Stage::Starting), _) => Standing::Starting,
            (Some(Stage::Stopping), _) => Standing::Stopping,
            (_, Some(watched)) if watched.watch.picture().has_ended() => Standing::Lost,
            (_, Some(_)) => Standing::Watching,
            (Some(_), None) => Standing::Starting,
            (None, None) => Standing::Idle,
        }
    }

    /// Runs a file; what was watched before is let go.
    ///
    /// # Errors
    /// If `armor` is not found or does not start.
    pub fn start(&mut self, file: &Path) -> Result<(), LaunchError> {
        self.leave();
        let plan = Plan {
            program: find_armor().ok_or(LaunchError::NoProgram)?,
            file: file.into(),
            components: self.components.clone(),
            ..Plan::default()
        };
        self.log = Log::default();
        self.ended = None;
        self.run = Some(Run::start(&plan, self.log.clone(), self.wake())?);
        Ok(())
    }

    /// Watches the system whose registry listens at `registry`; what was watched before is let go,
    /// and a run that this window started is stopped.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn attach(&mut self, registry: &str, record: Option<Record>) -> std::io::Result<()> {
        self.leave();
        self.ended = None;
        self.log = Log::default();
        let tail = match &record {
            Some(record) => {
                let path = record.resolve(&record.out).join("logs/all.log");
                Some(Tail::begin(&path, self.log.clone(), self.wake())?)
            }
            None => {
                let text = "the log is kept on the host of the system, in the folder of its run";
                self.log.push(Line::said(TOOL, "INFO", text));
                None
            }
        };
        self.watched = Some(self.watched_at(registry, record, tail)?);
        Ok(())
    }

    /// Shows a picture and a mission that stay as they are, with no system behind them: for tests.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn show_still(&mut self, picture: Picture, look: MissionLook) -> std::io::Result<()> {
        let (watch, mission) = (Watch::still(picture), MissionWatch::still(look));
        self.watched = Some(self.watched_by(watch, mission, "nowhere", None, None)?);
        Ok(())
    }

    /// Lets go of what is watched, which goes on; a run that this window started is stopped.
    pub fn leave(&mut self) {
        self.watched = None;
        self.run = None;
    }

    /// Asks the run to stop in order; asked again, it kills what has not stopped yet.
    pub fn stop(&mut self) {
        match &self.run {
            Some(run) => run.stop(),
            None => self.leave(),
        }
    }

    /// Takes notice of how the run goes: to be called in each frame.
    pub fn poll(&mut self) {
        let Some(run) = &self.run else { return };
        match run.stage() {
            Stage::Running(record) if self.watched.is_none() => {
                let registry = record.registry.to_string();
                match self.watched_at(&registry, Some(record), None) {
                    Ok(watched) => self.watched = Some(watched),
                    Err(error) => self.log.push(Line::said(TOOL, "ERROR", error.to_string())),
                }
            }
            Stage::Ended { how, is_fine } => {
                self.log.push(Line::said(TOOL, if is_fine { "INFO" } else { "ERROR" }, &*how));
                self.ended = Some((how, is_fine));
                self.leave();
            }
            _ => {}
        }
    }

    fn watched_at(
        &self,
        registry: &str,
        record: Option<Record>,
        tail: Option<Tail>,
    ) -> std::io::Result<Watched> {
        let watch = Watch::begin(registry, TOOL, self.wake())?;
        let mission = MissionWatch::begin(watch.directory(), self.wake())?;
        self.watched_by(watch, mission, registry, record, tail)
    }

    fn watched_by(
        &self,
        watch: Watch,
        mission: MissionWatch,
        registry: &str,
        record: Option<Record>,
        tail: Option<Tail>,
    ) -> std::io::Result<Watched> {
        let directory = watch.directory();
        Ok(Watched {
            registry: registry.into(),
            record,
            mission,
            values: Values::new(directory.clone(), self.wake()),
            orders: OrderDesk::open(directory, "armor-designer", self.wake())?,
            parameters: ParameterDesk::open(directory, TOOL, self.wake())?,
            watch,
            _tail: tail,
        })
    }
}

/// The systems of this user that run on this host.
pub fn running() -> Result<Vec<Record>, systems::SystemsError> {
    systems::running(&systems::directory()?)
}
