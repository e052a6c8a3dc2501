//! The component's end of a window that watches its system: hands data over, and carries out what
//! comes back.

use std::collections::VecDeque;
use std::io;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use armor_grid::Pose2;
use armor_sdk::prelude::*;
use parking_lot::Mutex;

use super::mission_lookout::MissionLookout;
use super::robot_commands::send_command;
use super::watch_messages::{
    AskedQuestion, MessageWriter, ToComponent, ToWindow, check_owner, find_record, read_message,
    socket_of,
};
use crate::mission::MissionState;
use crate::orders::RobotCommand;

/// Time between two looks for a window.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// How long a window may take to answer.
const ANSWER_WITHIN: Duration = Duration::from_millis(250);
/// The inputs of the map and of its changes.
const MAP: &str = "map";
const MAP_CHANGES: &str = "map_updates";
/// Most changes of the map that are kept for a window that connects later.
const MAX_CHANGES: usize = 256;
/// Most events that wait to be reported.
const MAX_EVENTS: usize = 16;
/// Names the run to its processes.
const RUN_VARIABLE: &str = "ARMOR_RUN";

/// The search for a window, and the connection to it.
pub(super) struct Relay {
    sockets: Vec<PathBuf>,
    hello: RelayHello,
    looked: Option<Instant>,
    link: Option<RelayLink>,
    /// What a window that connects needs, as it may not be sent again: the newest data of inputs that
    /// are not steady, and the changes of the map since it was published.
    kept: Vec<KeptData>,
    events: Arc<Mutex<VecDeque<String>>>,
    stop: SharedStop,
}

/// What was published on `stop` last, and the number of links that have accepted it.
pub(super) type SharedStop = Arc<Mutex<Option<(bool, usize)>>>;

/// What the window gets of the run.
#[derive(Clone, Default)]
struct RelayHello {
    system: String,
    robot: String,
    run: String,
    launcher: u32,
    log: String,
}

/// Data as they arrived.
#[derive(Clone)]
struct KeptData {
    input: String,
    instance: u64,
    sequence: u64,
    stamp_s: f64,
    bytes: Vec<u8>,
}

impl KeptData {
    fn to_message(&self) -> ToWindow {
        ToWindow::Data {
            input: self.input.clone(),
            instance: self.instance,
            sequence: self.sequence,
            stamp_s: self.stamp_s,
            bytes: self.bytes.clone().into(),
        }
    }
}

struct RelayLink {
    writer: MessageWriter,
    is_open: Arc<AtomicBool>,
}

impl Relay {
    /// Begins to look for a window that watches the file of the run, or its registry's address.
    pub(super) fn new(registry: Option<&str>) -> Self {
        let record = registry.and_then(find_record);
        let file = record.as_ref().map(|record| record.file.to_string_lossy().into_owned());
        let file = file.map(|file| super::watch_messages::subject_of(&file));
        let subjects = [file.as_deref(), registry];
        let sockets = subjects.into_iter().flatten().filter_map(socket_of).collect();
        let run = std::env::var(RUN_VARIABLE).unwrap_or_default();
        let hello = record.map_or_else(RelayHello::default, |record| RelayHello {
            robot: record.file_names.last().cloned().unwrap_or_else(|| record.system.clone()),
            system: record.system,
            launcher: record.pid,
            log: record.out.join("logs/launcher.log").to_string_lossy().into_owned(),
            run: String::new(),
        });
        let hello = RelayHello { run, ..hello };
        Self {
            sockets,
            hello,
            looked: None,
            link: None,
            kept: Vec::new(),
            events: Arc::default(),
            stop: Arc::default(),
        }
    }

    /// What was published on `stop` last, by any window.
    pub(super) fn stop(&self) -> SharedStop {
        Arc::clone(&self.stop)
    }

    /// Publishes a STOP again that no link has accepted: the links of a component that has been
    /// restarted are not there from the beginning.
    pub(super) fn repeat_stop(&self, armor: &Armor) -> Result<(), Fault> {
        let mut stop = self.stop.lock();
        if *stop != Some((true, 0)) {
            return Ok(());
        }
        let to = send_command(armor, &RobotCommand::Stop(true))?;
        if to > 0 {
            *stop = Some((true, to));
            drop(stop);
            self.send(&ToWindow::StopState { is_on: true, to: to as u64 });
        }
        Ok(())
    }

    /// Returns whether a window is connected.
    pub(super) fn is_connected(&self) -> bool {
        self.link.as_ref().is_some_and(|link| link.is_open.load(Ordering::Relaxed))
    }

    /// Connects to a window if there is a new one. Returns whether it has.
    pub(super) fn look_for_window(
        &mut self,
        armor: &Armor,
        lookout: Option<&MissionLookout>,
        links: impl FnOnce() -> ToWindowLinks,
    ) -> bool {
        if self.is_connected() || self.looked.is_some_and(|at| at.elapsed() < LOOK_EVERY) {
            return false;
        }
        self.link = None;
        self.looked = Some(Instant::now());
        let Some(stream) = self.sockets.iter().find_map(|path| UnixStream::connect(path).ok())
        else {
            return false;
        };
        let begun = self.begin_link(stream, armor, lookout, links());
        if let Err(error) = &begun
            && error.kind() != io::ErrorKind::ConnectionRefused
        {
            tracing::debug!("the window that watches this system cannot be used: {error}");
        }
        begun.is_ok()
    }

    fn begin_link(
        &mut self,
        stream: UnixStream,
        armor: &Armor,
        lookout: Option<&MissionLookout>,
        links: ToWindowLinks,
    ) -> io::Result<()> {
        check_owner(&stream)?;
        let writer = MessageWriter::new(&stream)?;
        let RelayHello { system, robot, run, launcher, log } = self.hello.clone();
        let ToWindowLinks { component, links } = links;
        let system = if system.is_empty() { component.clone() } else { system };
        let robot = if robot.is_empty() { component.clone() } else { robot };
        writer.send(&ToWindow::Hello { component, system, robot, run, launcher, log, links })?;
        if !is_welcome(&stream)? {
            return Err(io::ErrorKind::ConnectionRefused.into());
        }
        let is_open = Arc::new(AtomicBool::new(true));
        let reader = RelayReader {
            armor: armor.clone(),
            writer: writer.clone(),
            is_open: Arc::clone(&is_open),
            events: Arc::clone(&self.events),
            answers: lookout.map(MissionLookout::answers),
            stop: Arc::clone(&self.stop),
            drives: false,
        };
        // Before the reader begins, so that no newer order is overtaken.
        let stop = *self.stop.lock();
        if let Some((is_on, to)) = stop {
            writer.send(&ToWindow::StopState { is_on, to: to as u64 })?;
        }
        std::thread::Builder::new()
            .name("watched".into())
            .spawn(move || reader.carry_out(stream))?;
        self.kept.iter().try_for_each(|data| writer.send(&data.to_message()))?;
        self.link = Some(RelayLink { writer, is_open });
        Ok(())
    }

    /// Sends data to the window, if one is connected, and keeps what a later one needs. Returns
    /// whether one is connected.
    pub(super) fn hand_over(&mut self, header: &Header<'_>, bytes: &[u8], is_steady: bool) -> bool {
        let is_connected = self.is_connected();
        if is_steady && !is_connected {
            return false;
        }
        let data = KeptData {
            input: header.id().into(),
            instance: header.instance,
            sequence: header.sequence,
            stamp_s: header.stamp_s,
            bytes: bytes.into(),
        };
        if is_connected {
            self.send(&data.to_message());
        }
        if !is_steady {
            keep_data(&mut self.kept, data);
        }
        is_connected
    }

    /// Sends a message to the window, if one is connected.
    pub(super) fn send(&self, message: &ToWindow) {
        let Some(link) = self.link.as_ref().filter(|_| self.is_connected()) else { return };
        if link.writer.send(message).is_err() {
            link.is_open.store(false, Ordering::Relaxed);
        }
    }

    /// Sends the state of the mission.
    pub(super) fn send_mission(&self, mission: &MissionState) {
        let questions = mission.questions.iter().map(|question| AskedQuestion {
            transition: question.transition.clone(),
            answer_by_at_s: question.answer_by_at_s,
            unanswered: question.unanswered.clone(),
        });
        self.send(&ToWindow::Mission {
            name: mission.name.clone(),
            stage: mission.stage.clone(),
            why: mission.why.clone(),
            now_at_s: mission.now_at_s,
            is_running: mission.is_running,
            paused_by: mission.paused_by.clone(),
            frozen: mission.frozen.clone(),
            places: mission.places.clone(),
            last_cause: mission.last_cause.clone(),
            questions: questions.collect(),
        });
    }

    /// Returns the next event that the operator has caused.
    pub(super) fn take_event(&self) -> Option<String> {
        self.events.lock().pop_front()
    }

    /// Ends the connection.
    pub(super) fn close(&mut self) {
        if let Some(link) = self.link.take() {
            link.writer.close();
        }
    }
}

/// Adds data to those that a later window needs.
fn keep_data(kept: &mut Vec<KeptData>, data: KeptData) {
    match data.input.as_str() {
        MAP_CHANGES => {
            if kept.iter().filter(|other| other.input == MAP_CHANGES).count() == MAX_CHANGES
                && let Some(oldest) = kept.iter().position(|other| other.input == MAP_CHANGES)
            {
                kept.remove(oldest);
            }
        }
        // Its changes so far are in it.
        MAP => kept.retain(|other| other.input != MAP && other.input != MAP_CHANGES),
        _ => kept.retain(|other| other.input != data.input),
    }
    kept.push(data);
}

/// Waits for the window's answer: one that hangs, or shows the system by another component, leaves the
/// screen to this one.
fn is_welcome(stream: &UnixStream) -> io::Result<bool> {
    let mut stream = stream.try_clone()?;
    stream.set_read_timeout(Some(ANSWER_WITHIN))?;
    let answer = read_message::<ToComponent>(&mut stream)?;
    stream.set_read_timeout(None)?;
    Ok(matches!(answer, Some(ToComponent::Welcome { is_accepted: true })))
}

/// What the window gets of the component.
pub(super) struct ToWindowLinks {
    pub(super) component: String,
    pub(super) links: Vec<super::watch_messages::LinkedInput>,
}

/// The thread that carries out what the window orders.
struct RelayReader {
    armor: Armor,
    writer: MessageWriter,
    is_open: Arc<AtomicBool>,
    events: Arc<Mutex<VecDeque<String>>>,
    answers: Option<super::mission_lookout::AnswerSender>,
    stop: SharedStop,
    drives: bool,
}

impl RelayReader {
    fn carry_out(mut self, mut stream: UnixStream) {
        loop {
            match read_message::<ToComponent>(&mut stream) {
                Ok(Some(message)) => self.handle_message(message),
                Ok(None) => break,
                Err(error) => {
                    tracing::warn!("the connection to the window has ended: {error}");
                    break;
                }
            }
        }
        self.is_open.store(false, Ordering::Relaxed);
        self.writer.close();
        // Without a window no key or stick is held.
        if self.drives {
            self.send_to_robot(&RobotCommand::Velocity { forward_mps: 0.0, turn_radps: 0.0 });
        }
    }

    fn handle_message(&mut self, message: ToComponent) {
        let command = match message {
            ToComponent::Welcome { .. } => return,
            ToComponent::Goal { frame, x_m, y_m, yaw_rad } => {
                RobotCommand::Goal { place: Pose2::new(x_m, y_m, yaw_rad), frame: frame.into() }
            }
            ToComponent::Velocity { forward_mps, turn_radps } => {
                self.drives = forward_mps != 0.0 || turn_radps != 0.0;
                RobotCommand::Velocity { forward_mps, turn_radps }
            }
            ToComponent::Stop { is_on } => RobotCommand::Stop(is_on),
            ToComponent::Event { name } => {
                let mut events = self.events.lock();
                if events.len() < MAX_EVENTS {
                    events.push_back(name);
                }
                return;
            }
            ToComponent::Resume => {
                if let Some(answers) = &self.answers {
                    answers.resume_mission();
                }
                return;
            }
            ToComponent::Answer { transition, is_confirmed } => {
                if let Some(answers) = &self.answers {
                    answers.give_answer(&transition, is_confirmed);
                }
                return;
            }
        };
        self.send_to_robot(&command);
    }

    fn send_to_robot(&self, command: &RobotCommand) {
        // STOP is published under the lock, so that it is not repeated after its release.
        let mut stop = self.stop.lock();
        match send_command(&self.armor, command) {
            Ok(to) => {
                if let &RobotCommand::Stop(is_on) = command {
                    *stop = Some((is_on, to));
                    drop(stop);
                    let state = ToWindow::StopState { is_on, to: to as u64 };
                    let _ = self.writer.send(&state);
                } else if let Some(output) = command.output() {
                    let sent = ToWindow::Sent { output: output.into(), to: to as u64 };
                    // A failure ends the connection, which the reader notices.
                    let _ = self.writer.send(&sent);
                }
            }
            Err(fault) => tracing::error!("an order was not sent: {fault}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_later_window_gets_the_map_with_its_changes_and_the_newest_of_the_others() {
        let mut kept = Vec::new();
        let mut keep = |input: &str, sequence| {
            let (input, bytes) = (input.to_owned(), Vec::new());
            keep_data(&mut kept, KeptData { input, instance: 1, sequence, stamp_s: 0.0, bytes });
            kept.iter().map(|data| (data.input.clone(), data.sequence)).collect::<Vec<_>>()
        };
        keep("map_updates", 0);
        keep("map", 0);
        keep("path", 0);
        keep("map_updates", 1);
        let all = keep("path", 1);
        let named = |name: &str, sequence| (name.to_owned(), sequence);
        assert_eq!(all, [named("map", 0), named("map_updates", 1), named("path", 1)]);
        for sequence in 2..400 {
            keep("map_updates", sequence);
        }
        let all = keep("path", 2);
        assert_eq!(all.len(), 2 + MAX_CHANGES);
        assert_eq!(all[1], named("map_updates", 144), "the newest changes");
        assert_eq!(keep("map", 1), [named("path", 2), named("map", 1)]);
    }
}
