//! Control connections: orders of the executive, of the launcher and of operators, and questions of
//! observers.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::{Stream, is_temporary};
use armor_wire::acting::{KeyRole, Preface};
use armor_wire::codec;
use armor_wire::control::{Answer, Command, CurrentCall, Role};
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::Refusal;
use armor_wire::liveness::{BEAT, Liveness};
use rustix::event::PollFd;

use super::handshake::AdmittedControl;
use crate::call_watch::{CallNotice, CallWatch, ObservedCall, describe_watchdog, patience_for};
use crate::calls::CalledFunction;
use crate::faults::PeerFault;
use crate::lifecycle::{ActivationOrder, EnteredState, LifecycleOrder};
use crate::log;
use crate::orders::GivenOrder;
use crate::participant::Participant;
use crate::playback_orders::GivenPlaybackOrder;
use crate::reports::PendingReport;
use crate::tick_watch::{TickCounts, TickWatch};

/// Most connections of observers. Further ones are refused.
const MAX_OBSERVERS: usize = 48;
/// Most connections of operators. A further one takes the place of the operator who has sent no
/// command for the longest time: an order to pause or to stop always gets through.
const MAX_OPERATORS: usize = 16;
/// Most connections of operators whose key only lets them bring the robot to rest; they compete for
/// places among themselves, so that they cannot end the link of one who commands.
const MAX_STOPPERS: usize = 8;
/// Most connections of launchers: the system's own, and that of a run that takes over.
const MAX_LAUNCHERS: usize = 2;
/// Only one executive commands; an older connection belongs to one that has died.
const MAX_EXECUTIVES: usize = 1;
/// Unsent bytes after which an observer that does not read is cut off.
const MAX_UNSENT_LEN: usize = 4 << 20;

struct ControlPeer {
    stream: Stream,
    reader: FrameReader,
    /// Counted in this process, for the answers to orders.
    id: u64,
    role: Role,
    from: String,
    instance: u64,
    /// On whose behalf it acts, if a gate forwards it.
    preface: Option<Preface>,
    liveness: Liveness,
    /// When its last command arrived; at first, when it connected.
    last_command: Instant,
    unsent: Vec<u8>,
    /// Reports up to this number were sent on this connection.
    reported: u64,
    broken: bool,
    /// It has sent something that is not a command.
    babbles: bool,
}

/// The places for which connections compete.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Of(Role),
    /// Operators whose key only lets them bring the robot to rest.
    Stopper,
}

impl Place {
    fn of(role: Role, preface: Option<&Preface>) -> Self {
        match preface {
            Some(preface)
                if role == Role::Operator && preface.role() == Some(KeyRole::Observer) =>
            {
                Self::Stopper
            }
            _ => Self::Of(role),
        }
    }
}

pub(super) struct ControlServer {
    participant: Arc<Participant>,
    connections: Vec<ControlPeer>,
    /// The connections so far; the next one's id.
    count: u64,
    /// The state that all connections have been sent.
    sent_state: EnteredState,
    last_beat: Instant,
    call_watch: CallWatch,
    tick_watch: TickWatch,
}

impl ControlServer {
    pub fn new(participant: Arc<Participant>) -> Self {
        let sent_state = participant.lifecycle.state();
        let (connections, last_beat) = (Vec::new(), Instant::now());
        let (call_watch, tick_watch) = (CallWatch::default(), TickWatch::default());
        Self { participant, connections, count: 0, sent_state, last_beat, call_watch, tick_watch }
    }

    pub fn add_poll_fds<'a>(&'a self, fds: &mut Vec<PollFd<'a>>) {
        fds.extend(
            self.connections.iter().map(|c| super::watched(&c.stream, !c.unsent.is_empty())),
        );
    }

    pub fn add_peer(&mut self, admitted: AdmittedControl) {
        if !self.make_room(Place::of(admitted.role, admitted.preface.as_ref())) {
            let why = format!("{MAX_OBSERVERS} observers are connected already");
            report_fault(&self.participant, &admitted.stream, PeerFault::Crowded, &why);
            return;
        }
        let AdmittedControl { stream, reader, role, from, instance, preface } = admitted;
        let liveness = Liveness::new(self.participant.clock.monotonic());
        self.count += 1;
        let mut connection = ControlPeer {
            stream,
            reader,
            id: self.count,
            role,
            from,
            instance,
            preface,
            liveness,
            last_command: Instant::now(),
            unsent: Vec::new(),
            reported: if role == Role::Executive {
                0
            } else {
                self.participant.reports.last_number()
            },
            broken: false,
            babbles: false,
        };
        // States entered since then follow.
        connection.queue_answer(&self.state_answer(self.sent_state));
        self.connections.push(connection);
    }

    /// Makes room for one more connection. Each kind has places of its own, so that a crowd of
    /// observers keeps out neither the executive nor an operator's order to stop.
    fn make_room(&mut self, place: Place) -> bool {
        let most = match place {
            Place::Stopper => MAX_STOPPERS,
            Place::Of(Role::Executive) => MAX_EXECUTIVES,
            Place::Of(Role::Launcher) => MAX_LAUNCHERS,
            Place::Of(Role::Observer) => MAX_OBSERVERS,
            Place::Of(Role::Operator) => MAX_OPERATORS,
        };
        let of_place = |peer: &&mut ControlPeer| {
            Place::of(peer.role, peer.preface.as_ref()) == place && !peer.broken
        };
        if self.connections.iter_mut().filter(of_place).count() < most {
            return true;
        }
        let longest_idle =
            self.connections.iter_mut().filter(of_place).min_by_key(|peer| peer.last_command);
        match longest_idle {
            Some(peer) if place != Place::Of(Role::Observer) => {
                peer.broken = true;
                true
            }
            _ => false,
        }
    }

    fn state_answer(&self, EnteredState { state, activation }: EnteredState) -> Answer {
        Answer::State {
            state,
            activation,
            controllable: self.participant.lifecycle.is_controllable(),
        }
    }

    pub fn serve_peers(&mut self) {
        let now = self.participant.clock.monotonic();
        for index in 0..self.connections.len() {
            if self.connections[index].broken {
                // It has given its place to another.
                continue;
            }
            let commands = self.connections[index].read_commands(now);
            if self.connections[index].babbles {
                let connection = &self.connections[index];
                let why = format!("`{}` does not speak the control protocol", connection.from);
                report_fault(&self.participant, &connection.stream, PeerFault::NoCommand, &why);
            }
            for command in commands {
                self.obey_command(index, command);
            }
        }
        // Taken before the reports are sent, so that no state overtakes the report that led to it.
        let unsent = self.participant.lifecycle.take_unsent();
        self.send_reports();
        for entered in unsent {
            self.sent_state = entered;
            let answer = self.state_answer(entered);
            self.queue_for_all(&answer);
        }
        while let Some((id, answer)) = self.participant.operator_orders.take_answer() {
            if let Some(connection) = self.connections.iter_mut().find(|c| c.id == id) {
                connection.queue_answer(&answer);
            }
        }
        self.send_beats();
        for connection in &mut self.connections {
            connection.flush_unsent();
            connection.broken |= connection.liveness.is_silent(now);
            if connection.broken && connection.role == Role::Operator {
                self.participant.operator_orders.report_closed(connection.id);
            }
        }
        self.connections.retain(|connection| !connection.broken);
    }

    fn obey_command(&mut self, index: usize, command: Command) {
        let call = self.current_call();
        let has_executive = self.connections.iter().any(|peer| peer.role == Role::Executive);
        let connection = &mut self.connections[index];
        if command != Command::Beat {
            connection.last_command = Instant::now();
        }
        let refused = connection.preface.as_ref().and_then(|it| it.check(&command).err());
        if let Some(refusal) = refused {
            self.participant.faults.log_role_once(&refusal);
            connection.refuse_command(&command, refusal);
            return;
        }
        match (command, connection.role) {
            (Command::Activate { activation, parameters }, Role::Executive) => {
                if self.participant.lifecycle.is_controllable() {
                    let order = ActivationOrder { activation, parameters };
                    self.participant.lifecycle.push_order(LifecycleOrder::Activate(order));
                } else {
                    self.confirm_state(index);
                }
            }
            (Command::Freeze { activation }, Role::Executive) => {
                if self.participant.lifecycle.is_controllable() {
                    self.participant.lifecycle.push_order(LifecycleOrder::Freeze(activation));
                } else {
                    self.confirm_state(index);
                }
            }
            (Command::Terminate, Role::Executive | Role::Launcher) => {
                self.participant.lifecycle.request_end();
            }
            (Command::Acknowledge { report }, Role::Executive) => {
                self.participant.reports.remove_acknowledged(report);
            }
            (Command::Status { request }, _) => {
                let skipped_share = self.tick_watch.skipped_share();
                let mut status = self.participant.compose_status(call, skipped_share);
                status.busy |= has_executive && !self.participant.reports.is_empty();
                connection.queue_answer(&Answer::Status { request, status });
            }
            (Command::Order { request, author, take, order }, Role::Operator) => {
                let (from, instance) = (connection.from.clone(), connection.instance);
                // Whatever the client claims.
                let preface = connection.preface.as_ref();
                let author = preface.map_or_else(|| author.clone(), |it| it.name_author(&author));
                let connection = connection.id;
                let given = GivenOrder { connection, from, instance, request, author, take, order };
                if let Some(answer) = self.participant.operator_orders.submit_order(given) {
                    self.connections[index].queue_answer(&answer);
                }
            }
            (Command::SetLogFilter { request, filter }, Role::Operator | Role::Launcher) => {
                let (accepted, text) = match log::set_filter(&filter) {
                    Ok(()) => (true, format!("logs {filter} from now on")),
                    Err(why) => (false, why),
                };
                connection.queue_answer(&Answer::Ordered { request, accepted, text });
            }
            (Command::Playback { request, order }, Role::Operator | Role::Launcher) => {
                let given = GivenPlaybackOrder { connection: connection.id, request, order };
                if let Some(answer) = self.participant.playback_orders.submit_order(given) {
                    connection.queue_answer(&answer);
                }
            }
            (Command::Beat, _) => {}
            (command, role) => {
                connection.broken = true;
                let why = format!("`{}`, an {role:?}, may not order {command:?}", connection.from);
                report_fault(&self.participant, &connection.stream, PeerFault::NotAllowed, &why);
            }
        }
    }

    fn confirm_state(&mut self, index: usize) {
        let answer = self.state_answer(self.participant.lifecycle.state());
        self.connections[index].queue_answer(&answer);
    }

    /// Reports go before the state they led to, so that `done` is known when `Done` is seen. The
    /// executive gets all that it has not acknowledged, an observer those since it connected.
    fn send_reports(&mut self) {
        let gets_reports =
            |peer: &&mut ControlPeer| matches!(peer.role, Role::Executive | Role::Observer);
        for peer in self.connections.iter_mut().filter(gets_reports) {
            for PendingReport { number, activation, outcome, .. } in
                self.participant.reports.list_after(peer.reported)
            {
                peer.reported = number;
                peer.queue_answer(&Answer::Report { report: number, activation, outcome });
            }
        }
    }

    fn send_beats(&mut self) {
        if self.last_beat.elapsed() < BEAT {
            return;
        }
        self.last_beat = Instant::now();
        let calls = &self.participant.calls;
        let running = calls.running_call().map(|number| ObservedCall {
            number,
            function: calls.function(),
            taken: calls.time_taken(),
        });
        let now = self.participant.clock.monotonic();
        let ticks = TickCounts { called: calls.exec_calls(), skipped: calls.skipped_ticks() };
        self.tick_watch.look(ticks, now);
        match self.call_watch.look(running, now, patience_for(self.participant.period())) {
            Some(CallNotice::Hangs { function: CalledFunction::New, taken }) => tracing::warn!(
                "new has not returned for {:.1} s; until it does, the component does not start",
                taken.as_secs_f64()
            ),
            Some(CallNotice::Hangs { function, taken }) => tracing::warn!(
                "{} has not returned for {:.1} s; until it does, the component handles no data, \
                 no parameter and no order, not even to freeze; {}",
                function.name(),
                taken.as_secs_f64(),
                describe_watchdog(self.participant.watchdog())
            ),
            Some(CallNotice::Returned { function, taken }) => tracing::warn!(
                "{} has returned after {:.1} s",
                function.name(),
                taken.as_secs_f64()
            ),
            None => {}
        }
        let call = self.current_call();
        self.queue_for_all(&Answer::Beat { call });
    }

    /// The call of user code that ran at the last beat and still runs.
    fn current_call(&self) -> Option<CurrentCall> {
        let (calls, clock) = (&self.participant.calls, &self.participant.clock);
        let (function, taken) = self.call_watch.current(calls.running_call(), clock.monotonic())?;
        Some(CurrentCall { function: function.name().into(), call_s: taken.as_secs_f64() })
    }

    fn queue_for_all(&mut self, answer: &Answer) {
        for connection in &mut self.connections {
            connection.queue_answer(answer);
        }
    }
}

fn report_fault(participant: &Participant, stream: &Stream, fault: PeerFault, why: &str) {
    let peer = stream.peer_address().ok().map(|peer| peer.ip());
    participant.faults.log_once(peer, fault, why);
}

impl ControlPeer {
    /// Answers a command that the role of the key does not allow.
    fn refuse_command(&mut self, command: &Command, refusal: Refusal) {
        match command {
            Command::Order { request, .. }
            | Command::SetLogFilter { request, .. }
            | Command::Playback { request, .. } => {
                let (request, accepted, text) = (*request, false, refusal.text);
                self.queue_answer(&Answer::Ordered { request, accepted, text });
            }
            _ => self.broken = true,
        }
    }

    fn queue_answer(&mut self, answer: &Answer) {
        if let Err(error) = frame::append(FrameKind::Control, answer, &mut self.unsent) {
            tracing::error!("an answer to `{}` is too long: {error}", self.from);
        }
        self.broken |= self.unsent.len() > MAX_UNSENT_LEN;
    }

    fn flush_unsent(&mut self) {
        while !self.unsent.is_empty() && !self.broken {
            match self.stream.try_send(&self.unsent) {
                Ok(len) => {
                    self.unsent.drain(..len);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if is_temporary(&error) => return,
                Err(_) => self.broken = true,
            }
        }
    }

    fn read_commands(&mut self, now: Duration) -> Vec<Command> {
        let mut commands = Vec::new();
        match self.stream.try_receive(self.reader.space()) {
            Ok(0) => self.broken = true,
            Ok(len) => {
                self.reader.filled(len);
                self.liveness.heard(now);
            }
            Err(error) if is_temporary(&error) => return commands,
            Err(_) => self.broken = true,
        }
        loop {
            let command = match self.reader.next_frame() {
                Ok(None) => return commands,
                Ok(Some(frame)) if frame.kind == FrameKind::Beat => continue,
                Ok(Some(frame)) if frame.kind == FrameKind::Control => {
                    codec::decode_control(frame.body).ok()
                }
                Ok(Some(_)) | Err(_) => None,
            };
            let Some(command) = command else {
                (self.broken, self.babbles) = (true, true);
                return commands;
            };
            commands.push(command);
        }
    }
}
