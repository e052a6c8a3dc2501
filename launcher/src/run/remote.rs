//! A component on another host, seen from the launcher: the agent there starts its process, and this
//! follows it, over cuts of the connection, to its end.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use armor_keys::connect::now_us;
use armor_keys::connect::{GateClient, GateError};
use armor_keys::run_channel::RunConnection;
use armor_socket::random_id;
use armor_wire::backoff::Backoff;
use armor_wire::clock::ClockSample;
use armor_wire::hello::RefusalCode;
use armor_wire::remote_process::{
    CutOff, OutputStream, ProcessEnd, RemoteEvent, RemoteOrder, RemoteStart, Takeover,
    VariableSetting,
};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use tokio::time::{Instant, sleep, timeout};

use super::host_states::HostStates;
use super::logs::{LogStream, RunLog};
use super::output_feed::{OutputFeed, open_feed};
use super::own_run::START_VARIABLE;
use super::supervisor::{ChildExit, LogLevel};

/// Orders that wait to be sent: one to end, one to kill, and room to spare.
const MAX_ORDERS: usize = 8;
/// Wait after the first failed attempt to reach the agent.
const FIRST_DELAY: Duration = Duration::from_millis(100);
/// Longest wait between two attempts: a host that is back has its component again within a second.
const MOST_DELAY: Duration = Duration::from_millis(500);
/// Period with which the clock of the host is asked for.
const ASK_CLOCK_EVERY: Duration = Duration::from_secs(2);
/// Longest wait for the last lines of a process that has ended.
const LAST_LINES_WITHIN: Duration = Duration::from_secs(1);

/// What is reported of it to the supervision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RemoteNotice {
    /// The agent cannot be reached at this moment: silence of the component proves nothing.
    CutOff,
    /// The process has ended.
    Ended(ChildExit),
}

/// How a component is run by the agent of another host.
#[derive(Clone)]
pub struct RemotePlan {
    /// The host.
    pub host: String,
    /// What its agent is asked for.
    pub start: RemoteStart,
    /// The agent's gate.
    pub gate: Arc<GateClient>,
    /// What the agent gets if it has no such executable; none for a kind that is part of `armor`.
    pub executable: Option<PathBuf>,
    /// Where it is noted whether the host is connected.
    pub states: HostStates,
}

impl std::fmt::Debug for RemotePlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RemotePlan").field("host", &self.host).field("start", &self.start).finish()
    }
}

/// A process on another host. What happens to it when this is dropped, its agent decides.
#[derive(Debug)]
pub struct RemoteProcess {
    /// Distinguishes it from other starts.
    pub id: u64,
    orders: mpsc::Sender<RemoteOrder>,
}

impl RemoteProcess {
    /// Has the component started, or taken over, and reports what becomes of it.
    pub fn begin(
        plan: &RemotePlan,
        (takeover, of_run): (Takeover, &str),
        log: &RunLog,
        report: impl Fn(RemoteNotice) + Send + 'static,
    ) -> Self {
        let (sender, orders) = mpsc::channel(MAX_ORDERS);
        let mut start = RemoteStart { takeover, ..plan.start.clone() };
        let (name, value) = (START_VARIABLE.to_owned(), of_run.to_owned());
        start.settings.push(VariableSetting { name, value });
        let follower = Follower {
            host: plan.host.clone(),
            gate: Arc::clone(&plan.gate),
            executable: plan.executable.clone(),
            states: plan.states.clone(),
            start,
            log: log.clone(),
            has_run: false,
            lost: None,
            dropped: 0,
        };
        tokio::spawn(follower.follow(orders, report));
        Self { id: random_id(), orders: sender }
    }

    /// Asks the process to end.
    pub fn terminate(&self) {
        let _ = self.orders.try_send(RemoteOrder::Terminate);
    }

    /// Kills the process and all that it has started.
    pub fn kill(&self) {
        let _ = self.orders.try_send(RemoteOrder::Kill);
    }
}

struct Follower {
    host: String,
    gate: Arc<GateClient>,
    executable: Option<PathBuf>,
    states: HostStates,
    start: RemoteStart,
    log: RunLog,
    /// The agent has reported that the process runs.
    has_run: bool,
    /// Why the agent cannot be reached, as last logged.
    lost: Option<String>,
    /// Bytes of output that the log had no room for.
    dropped: usize,
}

impl Follower {
    async fn follow(
        mut self,
        mut orders: mpsc::Receiver<RemoteOrder>,
        report: impl Fn(RemoteNotice) + Send + 'static,
    ) {
        let mut backoff = Backoff::new(FIRST_DELAY, MOST_DELAY, random_id());
        // Orders that were given so far: a connection that breaks may not have carried them.
        let mut given = Vec::new();
        loop {
            let Some(attempt) = self.try_to_run(&mut orders, &mut given).await else {
                return self.give_up(&report);
            };
            let lost = match attempt {
                Ok(connection) => {
                    backoff.reset();
                    let (sender, mut all_orders) = mpsc::channel(MAX_ORDERS);
                    for order in &given {
                        let _ = sender.try_send(*order);
                    }
                    let forward = async {
                        while let Some(order) = orders.recv().await {
                            keep_order(&mut given, order);
                            let _ = sender.send(order).await;
                        }
                        std::future::pending().await
                    };
                    let ask_clock = async {
                        loop {
                            let order = RemoteOrder::Clock { asked_us: now_us() };
                            let _ = sender.send(order).await;
                            sleep(ASK_CLOCK_EVERY).await;
                        }
                    };
                    let ended = tokio::select! {
                        ended = self.follow_connection(connection, &mut all_orders) => ended,
                        never = forward => never,
                        never = ask_clock => never,
                    };
                    match ended {
                        Ok(end) => {
                            self.states.remove_component(&self.host, &self.start.component);
                            return report(RemoteNotice::Ended(convert_end(end)));
                        }
                        Err(why) => why,
                    }
                }
                Err(GateError::Refused(refusal))
                    if self.has_run && refusal.code == RefusalCode::UnknownData =>
                {
                    return report(RemoteNotice::Ended(ChildExit::WithAgent));
                }
                // Such as too many connections: it may be there again.
                Err(GateError::Refused(refusal)) if refusal.code == RefusalCode::Limit => {
                    refusal.text
                }
                Err(GateError::Refused(refusal)) => {
                    let text = format!("the agent of {} refuses it: {}", self.host, refusal.text);
                    self.report(LogLevel::Error, &text);
                    return report(RemoteNotice::Ended(ChildExit::Code(1)));
                }
                Err(error) => error.to_string(),
            };
            self.report_loss(lost);
            if given.contains(&RemoteOrder::Kill) {
                return self.give_up(&report);
            }
            report(RemoteNotice::CutOff);
            let until = Instant::now() + backoff.delay();
            while let Ok(Some(order)) = tokio::time::timeout_at(until, orders.recv()).await {
                if order == RemoteOrder::Kill {
                    return self.give_up(&report);
                }
                keep_order(&mut given, order);
            }
            if orders.is_closed() && orders.is_empty() {
                return;
            }
        }
    }

    /// Asks the agent; keeps the orders that come meanwhile. `None` if one is to kill.
    async fn try_to_run(
        &self,
        orders: &mut mpsc::Receiver<RemoteOrder>,
        given: &mut Vec<RemoteOrder>,
    ) -> Option<Result<RunConnection, GateError>> {
        let mut attempt =
            std::pin::pin!(self.gate.run(self.start.clone(), self.executable.as_deref()));
        loop {
            tokio::select! {
                attempt = &mut attempt => return Some(attempt),
                Some(order) = orders.recv() => match order {
                    RemoteOrder::Kill => return None,
                    RemoteOrder::Terminate | RemoteOrder::Clock { .. } => keep_order(given, order),
                },
            }
        }
    }

    /// The process is to be killed, and its agent cannot be reached.
    fn give_up(&self, report: &impl Fn(RemoteNotice)) {
        if self.has_run {
            let host = &self.host;
            let text = format!(
                "{host} is cut off, so it is not known when it ends there; the next start of the \
                 system ends what is left"
            );
            self.report(LogLevel::Warn, &text);
        }
        report(RemoteNotice::Ended(ChildExit::WithAgent));
    }

    async fn follow_connection(
        &mut self,
        connection: RunConnection,
        orders: &mut mpsc::Receiver<RemoteOrder>,
    ) -> Result<ProcessEnd, String> {
        let (out, out_reader) = self.open_stream(LogStream::Out);
        let (err, err_reader) = self.open_stream(LogStream::Err);
        let ended = connection.follow(orders, |event| self.hear(event, &out, &err)).await;
        drop((out, err));
        let last = async {
            let _ = out_reader.await;
            let _ = err_reader.await;
        };
        let _ = timeout(LAST_LINES_WITHIN, last).await;
        ended
    }

    fn open_stream(&self, stream: LogStream) -> (OutputFeed, JoinHandle<()>) {
        let (feed, output) = open_feed();
        let name = self.start.component.as_str().into();
        (feed, tokio::spawn(self.log.clone().read(name, stream, output)))
    }

    fn hear(
        &mut self,
        event: RemoteEvent,
        out: &OutputFeed,
        err: &OutputFeed,
    ) -> Option<ProcessEnd> {
        match event {
            RemoteEvent::Running { process, pid, is_taken_over, notice } => {
                if !notice.is_empty() {
                    self.report(LogLevel::Warn, &notice);
                }
                let host = self.host.clone();
                if self.lost.take().is_some() && self.has_run {
                    self.report(LogLevel::Info, &format!("{host} is connected again"));
                } else if is_taken_over {
                    let text = format!("runs on {host} already (process {pid}), and is taken over");
                    self.report(LogLevel::Info, &text);
                }
                self.has_run = true;
                self.states.report_connected(&self.host, &self.start.component);
                self.start.takeover = Takeover::Only { process };
            }
            RemoteEvent::Output { stream, bytes } => {
                let feed = match stream {
                    OutputStream::Out => out,
                    OutputStream::Error => err,
                };
                let len = bytes.len();
                if !feed.push(bytes) {
                    self.dropped += len;
                } else if self.dropped > 0 {
                    let text =
                        format!("{} bytes of its output were left out: too many", self.dropped);
                    self.report(LogLevel::Warn, &text);
                    self.dropped = 0;
                }
            }
            RemoteEvent::Missed { bytes, file } => {
                let host = &self.host;
                let text = format!(
                    "{bytes} bytes of its output were not sent while {host} was cut off or too \
                     slow; they are on {host} in {file}"
                );
                self.report(LogLevel::Info, &text);
            }
            RemoteEvent::Clock { asked_us, answered_us } => {
                let sample = ClockSample::of(asked_us, answered_us, now_us());
                self.states.record_clock(&self.host, sample);
            }
            RemoteEvent::Ended { end } => return Some(end),
        }
        None
    }

    /// Logs why the agent cannot be reached, each reason once until it is back.
    fn report_loss(&mut self, why: String) {
        self.states.report_lost(&self.host, &self.start.component, &why);
        if self.lost.as_ref() == Some(&why) {
            return;
        }
        let host = &self.host;
        let text = match (self.has_run, self.start.cut_off) {
            (false, _) => format!("waits for the agent of {host}: {why}"),
            (true, CutOff::Continue) => format!("{host} is cut off ({why}); it continues there"),
            (true, CutOff::Safe) => format!("{host} is cut off ({why}); its agent freezes it"),
            (true, CutOff::Stop) => format!("{host} is cut off ({why}); its agent ends it"),
        };
        self.report(LogLevel::Warn, &text);
        self.lost = Some(why);
    }

    fn report(&self, level: LogLevel, text: &str) {
        self.log.report(&self.start.component, level, text);
    }
}

fn keep_order(given: &mut Vec<RemoteOrder>, order: RemoteOrder) {
    if !given.contains(&order) {
        given.push(order);
    }
}

fn convert_end(end: ProcessEnd) -> ChildExit {
    match end {
        ProcessEnd::Code { code } => ChildExit::Code(code),
        ProcessEnd::Signal { signal } => ChildExit::Signal(signal),
        ProcessEnd::NotStarted { error } => ChildExit::NotStarted(error),
        ProcessEnd::CutOff => ChildExit::CutOff,
    }
}
