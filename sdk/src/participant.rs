//! A process that takes part in a system: the parts that its threads share.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use armor_wire::control::{Answer, CurrentCall, RunState, Status};
use armor_wire::manifest::{EventManifest, ParameterManifest};

use crate::call_trace::CallTrace;
use crate::calls::CallCounter;
use crate::clock::SystemClock;
use crate::configuration::requests::ParameterRequests;
use crate::directory::Directory;
use crate::faults::PeerFaultLog;
use crate::identity::ProcessIdentity;
use crate::lifecycle::{EnteredState, Lifecycle};
use crate::message_type::MessageType;
use crate::operator::EXECUTIVE;
use crate::orders::OrderInbox;
use crate::playback_orders::PlaybackInbox;
use crate::port_table::PortTable;
use crate::reports::ReportQueue;
use crate::thread_panics::ThreadPanics;
use crate::wake::Wakers;

/// What the code of a component declares as constants; nothing for other processes.
pub(crate) struct Declarations {
    pub parameters: Vec<ParameterManifest>,
    pub events: Vec<EventManifest>,
    pub reports_done: bool,
}

impl Default for Declarations {
    fn default() -> Self {
        Self { parameters: Vec::new(), events: Vec::new(), reports_done: true }
    }
}

/// See the module.
pub(crate) struct Participant {
    pub identity: Arc<ProcessIdentity>,
    /// The events that the component declares: it reports no others.
    pub events: Vec<EventManifest>,
    /// Whether the component may report that it is done.
    pub reports_done: bool,
    pub clock: Arc<SystemClock>,
    /// The constructor runs only to find out what it declares.
    pub is_described: bool,
    pub ports: PortTable,
    pub parameters: ParameterRequests,
    pub lifecycle: Lifecycle,
    pub reports: ReportQueue,
    pub calls: CallCounter,
    /// Panics of threads that the component has started itself.
    pub thread_panics: ThreadPanics,
    /// What operators order.
    pub operator_orders: OrderInbox,
    /// Orders to a player of recordings.
    pub playback_orders: PlaybackInbox,
    /// What peers did wrong.
    pub faults: Arc<PeerFaultLog>,
    pub wakers: Arc<Wakers>,
    /// Whether a process that is no component has something to finish.
    pub is_busy: AtomicBool,
    /// The reading of the system's time that the main loop has seen; NaN without a main loop.
    pub turned_bits: AtomicU64,
    /// The period of `exec`, once it is known and if there is one.
    period: OnceLock<Duration>,
    /// How long one call of its code may take, once it is known and if the file limits it.
    watchdog: OnceLock<Duration>,
    directory: OnceLock<Directory>,
}

impl Participant {
    /// A process that is not connected to anything yet.
    ///
    /// # Errors
    /// If there are no file descriptors left.
    pub fn new(
        identity: ProcessIdentity,
        declared: Declarations,
        is_described: bool,
    ) -> std::io::Result<Self> {
        let identity = Arc::new(identity);
        let wakers = Arc::new(Wakers::new()?);
        let clock = Arc::<SystemClock>::default();
        Ok(Self {
            events: declared.events,
            reports_done: declared.reports_done,
            is_described,
            ports: PortTable::new(
                Arc::clone(&identity),
                Arc::clone(&wakers),
                CallTrace::new(Arc::clone(&clock)),
            ),
            clock,
            parameters: ParameterRequests::new(
                Arc::clone(&identity),
                declared.parameters,
                Arc::clone(&wakers),
            ),
            lifecycle: Lifecycle::new(Arc::clone(&wakers)),
            reports: ReportQueue::new(Arc::clone(&wakers)),
            calls: CallCounter::default(),
            thread_panics: ThreadPanics::new(Arc::clone(&wakers)),
            operator_orders: match identity.kind.as_str() {
                EXECUTIVE => OrderInbox::awaiting_taker(),
                _ => OrderInbox::default(),
            },
            playback_orders: PlaybackInbox::default(),
            faults: Arc::default(),
            is_busy: AtomicBool::new(false),
            turned_bits: AtomicU64::new(f64::NAN.to_bits()),
            period: OnceLock::new(),
            watchdog: OnceLock::new(),
            directory: OnceLock::new(),
            identity,
            wakers,
        })
    }

    pub fn set_directory(&self, directory: Directory) {
        let _ = self.directory.set(directory);
    }

    /// The connection to the registry; set before any other thread runs.
    pub fn directory(&self) -> &Directory {
        self.directory.get().expect("the directory is set before inputs and outputs are served")
    }

    /// Gives the outputs that were declared without a type the one of what they pass on, and declares
    /// them to the registry.
    pub fn give_outputs_type(&self, message_type: &MessageType) {
        for entry in self.ports.give_type(message_type) {
            self.directory().declare_output(entry);
        }
    }

    pub fn set_period(&self, period: Duration) {
        let _ = self.period.set(period);
    }

    /// The period of `exec`, once it is known and if there is one.
    pub fn period(&self) -> Option<Duration> {
        self.period.get().copied()
    }

    pub fn set_watchdog(&self, watchdog: Duration) {
        let _ = self.watchdog.set(watchdog);
    }

    /// How long one call of its code may take, once it is known and if the file limits it.
    pub fn watchdog(&self) -> Option<Duration> {
        self.watchdog.get().copied()
    }

    /// Answers an operator's order.
    pub fn answer_order(&self, connection: u64, answer: Answer) {
        self.operator_orders.queue_answer(connection, answer);
        self.wakers.wake_service();
    }

    /// Whether something is left to do: a call, or what follows from a reading of the time.
    fn has_work(&self) -> bool {
        let is_reading_new = || {
            let turned_s = f64::from_bits(self.turned_bits.load(Ordering::SeqCst));
            !self.clock.runs_by_itself() && turned_s < self.clock.timestamp()
        };
        self.calls.running_call().is_some()
            || self.is_busy.load(Ordering::Relaxed)
            || is_reading_new()
    }

    /// Leaves the system: the registry first, so that no new subscriber is sent here, then every
    /// connection.
    pub fn leave_system(&self) {
        // One that could not begin to listen has none.
        if let Some(directory) = self.directory.get() {
            directory.close();
        }
        self.lifecycle.set_left();
        self.ports.close_links();
        self.wakers.wake_service();
    }

    /// `call`: the call of user code that runs; `skipped_share`: of its ticks, lately.
    pub fn compose_status(&self, call: Option<CurrentCall>, skipped_share: f64) -> Status {
        let EnteredState { state, activation } = self.lifecycle.state();
        Status {
            name: self.identity.name.clone(),
            kind: self.identity.kind.clone(),
            state,
            activation,
            controllable: self.lifecycle.is_controllable(),
            uptime_s: self.clock.monotonic().as_secs_f64(),
            exec_calls: self.calls.exec_calls(),
            skipped_ticks: self.calls.skipped_ticks(),
            skipped_share,
            clock_offset_s: self.clock.offset_s(),
            clock_error_s: self.clock.estimate().map(|estimate| estimate.error_s),
            last_error: self.reports.current_error(state == RunState::Active, Instant::now()),
            untaken_events: self.reports.count_untaken_events(Instant::now()),
            call,
            time_s: self.clock.timestamp(),
            busy: self.has_work(),
            outputs: self.ports.outputs().iter().map(|output| output.status()).collect(),
            inputs: self.ports.inputs().iter().map(|input| input.status()).collect(),
        }
    }
}
