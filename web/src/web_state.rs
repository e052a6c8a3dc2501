//! What all routes share: the watched system, its mission, its data, and who may command it.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use armor_inspect::words::describe_call;
use armor_inspect::{
    HANGING_CALL_S, MissionWatch, ObservedProcess, SystemPicture, SystemWatch, WakeCallback,
};
use armor_marking::Marking;
use armor_sdk::directory::Directory;
use armor_wire::WireType;
use armor_wire::codec;
use armor_wire::schema::to_json;
use axum::http::StatusCode;
use parking_lot::Mutex;
use serde_json::{Value, json};
use tokio::sync::{Semaphore, watch};

use crate::commands::RobotCommands;
use crate::control_desk::ControlDesk;
use crate::data_hub::DataHub;
use crate::histogram::TimeHistogram;
use crate::launcher_question::LauncherQuestion;
use crate::order_desk::OrderDesk;
use crate::remote::RemoteAccess;
use crate::stop_desk::StopDesk;
use crate::web_options::WebOptions;

/// Requests that ask a process of the system and take a thread while they wait.
const MAX_ASKING: usize = 8;

/// Logins and log-outs that take a thread while they wait for the disk. They have places of their own, so
/// that requests for data go through while the disk hangs, and logins while a process hangs.
const MAX_LOGINS: usize = 4;

/// The name under which the executive is registered.
const EXECUTIVE: &str = "executive";

/// The state of a server.
pub(crate) struct WebState {
    pub(crate) directory: Directory,
    pub(crate) watch: SystemWatch,
    pub(crate) mission: MissionWatch,
    pub(crate) hub: DataHub,
    pub(crate) stop: StopDesk,
    pub(crate) control: Arc<ControlDesk>,
    pub(crate) orders: OrderDesk,
    pub(crate) counters: Counters,
    pub(crate) commands: Option<Arc<dyn RobotCommands>>,
    /// For browsers on other hosts; none on loopback.
    pub(crate) remote: Option<Arc<RemoteAccess>>,
    /// Raised when the system's picture, STOP or control has changed.
    pub(crate) system_news: watch::Sender<u64>,
    /// Raised when the mission has changed.
    pub(crate) mission_news: watch::Sender<u64>,
    pub(crate) asking: Arc<Semaphore>,
    pub(crate) logging_in: Arc<Semaphore>,
    system_text: Mutex<(u64, Arc<str>)>,
    mission_text: Mutex<(u64, Arc<str>)>,
}

impl WebState {
    /// Begins to watch the system.
    ///
    /// # Errors
    /// If no thread can be started.
    pub(crate) fn begin(
        options: &WebOptions,
        commands: Option<Arc<dyn RobotCommands>>,
        remote: Option<Arc<RemoteAccess>>,
    ) -> io::Result<Arc<Self>> {
        // The counters begin at 1: the texts of 0 have not been made.
        let (system_news, mission_news) = (watch::Sender::new(1), watch::Sender::new(1));
        let watch = SystemWatch::begin(&options.registry, "web", raise(&system_news))?;
        let directory = watch.directory().clone();
        let mission = MissionWatch::begin(&directory, raise(&mission_news))?;
        let author = &options.author;
        Ok(Arc::new(Self {
            hub: DataHub::new(directory.clone()),
            stop: StopDesk::open(
                &directory,
                LauncherQuestion::new(&options.registry),
                author,
                commands.clone(),
                system_news.clone(),
            )?,
            control: Arc::new(ControlDesk::new(system_news.clone())),
            orders: OrderDesk::open(&directory, "armor web", author)?,
            counters: Counters::default(),
            directory,
            watch,
            mission,
            commands,
            remote,
            system_news,
            mission_news,
            asking: Arc::new(Semaphore::new(MAX_ASKING)),
            logging_in: Arc::new(Semaphore::new(MAX_LOGINS)),
            system_text: Mutex::default(),
            mission_text: Mutex::default(),
        }))
    }

    /// Returns whether the mission is paused.
    pub(crate) fn is_paused(&self) -> bool {
        self.mission.look().marking.is_some_and(|marking| marking.pause.is_some())
    }

    /// Returns whether an executive is registered, as of the last picture.
    pub(crate) fn has_executive(&self) -> bool {
        let picture = self.watch.picture();
        picture.processes.get(EXECUTIVE).is_some_and(|process| !process.condition.is_gone())
    }

    /// Returns the limits of driving by hand; null if the robot cannot be driven from here.
    pub(crate) fn drive_limits(&self) -> Value {
        let limits = self.commands.as_ref().map(|commands| commands.limits());
        limits.map_or(
            Value::Null,
            |limits| json!({"speed_mps": limits.speed_mps, "turn_radps": limits.turn_radps}),
        )
    }

    /// Returns the system as JSON, made once for all clients.
    pub(crate) fn system_text(&self) -> Arc<str> {
        let compose = || self.system_json().to_string();
        reuse_text(&self.system_text, *self.system_news.borrow(), compose)
    }

    /// Returns the mission as JSON, with the present mission time: a marking is published only when
    /// it changes. The rest is made once for all clients.
    pub(crate) fn mission_text(&self) -> Arc<str> {
        let compose = || self.mission_json().to_string();
        let text = reuse_text(&self.mission_text, *self.mission_news.borrow(), compose);
        let now_at_s = self.mission.look().now_at_s(self.watch.timestamp());
        format!("{{\"now_at_s\":{now_at_s},{}", &text[1..]).into()
    }

    fn system_json(&self) -> Value {
        let picture = self.watch.picture();
        json!({
            "found": picture.is_found,
            "ended": picture.has_ended(),
            "processes": list_processes(&picture),
            "links": picture.links,
            "hosts": picture.hosts,
            "stop": self.stop.to_json(self.is_paused()),
            "control": {"held": self.control.is_held()},
            "drive": self.drive_limits(),
        })
    }

    fn mission_json(&self) -> Value {
        let look = self.mission.look();
        let marking = look
            .marking
            .as_deref()
            .and_then(|marking| to_json(&Marking::schema(), &codec::encode(marking).ok()?).ok());
        json!({"marking": marking, "problem": look.problem})
    }
}

fn raise(news: &watch::Sender<u64>) -> WakeCallback {
    let news = news.clone();
    Arc::new(move || news.send_modify(|news| *news += 1))
}

fn reuse_text(
    kept: &Mutex<(u64, Arc<str>)>,
    number: u64,
    compose: impl FnOnce() -> String,
) -> Arc<str> {
    let mut kept = kept.lock();
    if kept.0 != number {
        *kept = (number, compose().into());
    }
    Arc::clone(&kept.1)
}

fn list_processes(picture: &SystemPicture) -> Vec<Value> {
    let shown = picture.processes.iter().filter(|(name, _)| !picture.is_second_name(name));
    let describe = |(name, process): (&String, &ObservedProcess)| {
        let status = process.status.as_ref();
        let call = process.call.as_ref();
        let hangs = call.is_some_and(|call| call.call_s >= HANGING_CALL_S);
        let call = call.map(describe_call);
        let age = picture.now.saturating_sub(process.since);
        let outputs = status.map(|status| {
            let names = status.outputs.iter();
            names.map(|it| json!({"data": it.data, "type": it.type_name})).collect::<Vec<_>>()
        });
        json!({
            "name": name,
            "kind": process.entry.kind,
            "host": process.entry.host,
            "pid": process.entry.pid,
            "state": process.condition.word(),
            "state_for_s": age.as_secs_f64(),
            "uptime_s": status.map(|status| status.uptime_s),
            "starts": process.starts,
            "exec_calls": status.map(|status| status.exec_calls),
            "skipped_share": status.map(|status| status.skipped_share),
            "last_error": status.map(|status| status.last_error.clone()).unwrap_or_default(),
            "call": call,
            "hangs": hangs,
            "problem": process.problem,
            "outputs": outputs.unwrap_or_default(),
        })
    };
    shown.map(describe).collect()
}

/// Counts what the server does.
#[derive(Default)]
pub(crate) struct Counters {
    /// Open connections.
    pub(crate) connections: AtomicU64,
    /// Connections refused because there were too many, or their user was a stranger.
    pub(crate) refused: AtomicU64,
    /// Values that clients of the live WebSocket did not get because they read too slowly.
    pub(crate) dropped: AtomicU64,
    responses: Mutex<ResponseCounts>,
}

/// Responses by the first digit of their status, and how long they took.
#[derive(Clone, Debug, Default)]
pub(crate) struct ResponseCounts {
    pub(crate) by_class: [u64; 5],
    pub(crate) times: TimeHistogram,
}

impl Counters {
    /// Counts one response.
    pub(crate) fn count_response(&self, status: StatusCode, time: Duration) {
        let mut responses = self.responses.lock();
        let class = usize::from(status.as_u16() / 100).clamp(1, 5) - 1;
        responses.by_class[class] += 1;
        responses.times.add(time.as_secs_f64());
    }

    /// Returns the responses so far.
    pub(crate) fn responses(&self) -> ResponseCounts {
        self.responses.lock().clone()
    }

    /// Counts a refused connection.
    pub(crate) fn count_refusal(&self) {
        self.refused.fetch_add(1, Ordering::Relaxed);
    }
}
