//! What all threads of a component share: its ports, parameters, reports, orders and numbers.

use std::any::TypeId;
use std::cell::Cell;
use std::collections::VecDeque;
use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, RwLock};
use std::thread::Thread;

use armor_wire::control::{Answer, GivenParameter, ReportKind, RunState, Status};
use armor_wire::manifest::ParameterManifest;
use armor_wire::message::Message;
use rustix::event::{EventfdFlags, eventfd};

use crate::armor::SendError;
use crate::clock::Clock;
use crate::component::{Fault, Outcome};
use crate::configuration::Asking;
use crate::directory::Directory;
use crate::faults::Faults;
use crate::link::{Input, Output, Sent};
use crate::orders::OrderDesk;
use crate::parameter::Value;

/// Reports that wait for an executive. Events beyond it are dropped, oldest first, and logged.
const MAX_REPORTS: usize = 256;

thread_local! {
    /// The call of user code that this thread is in; 0 if none.
    static CALL: Cell<u64> = const { Cell::new(0) };
}

/// What the executive wants.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Wanted {
    Activate(Begin),
    Freeze(u64),
}

/// An activation that is to begin.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Begin {
    pub activation: u64,
    /// The values that the mission gives parameters while it lasts.
    pub parameters: Vec<GivenParameter>,
}

/// A report that is not acknowledged yet.
#[derive(Clone, Debug)]
pub(crate) struct Report {
    pub number: u64,
    pub activation: u64,
    pub outcome: ReportKind,
}

#[derive(Default)]
pub(crate) struct Reports {
    last: u64,
    pub waiting: VecDeque<Report>,
}

#[derive(Default)]
struct Orders {
    wanted: VecDeque<Wanted>,
}

/// See the module.
pub(crate) struct Shared {
    pub name: String,
    pub kind: String,
    pub instance: u64,
    pub clock: Arc<Clock>,
    /// The constructor runs only to find out what it declares.
    pub describing: bool,
    pub declared: Vec<ParameterManifest>,
    pub parameters: Asking,
    outputs: RwLock<Vec<Arc<Output>>>,
    inputs: RwLock<Vec<Arc<Input>>>,
    directory: OnceLock<Directory>,
    controllable: AtomicBool,
    controlled: AtomicBool,
    state: Mutex<(RunState, u64)>,
    /// States to be told to who controls this component, in order.
    untold: Mutex<Vec<(RunState, u64)>>,
    active: AtomicBool,
    orders: Mutex<Orders>,
    has_orders: AtomicBool,
    ending: AtomicBool,
    gone: AtomicBool,
    crashed: AtomicBool,
    main: Mutex<Option<Thread>>,
    wake: OwnedFd,
    reports: Mutex<Reports>,
    /// These three change only under the component's lock.
    calls: AtomicU64,
    in_call: AtomicBool,
    exec_calls: AtomicU64,
    gathered: AtomicBool,
    last_error: Mutex<String>,
    /// What operators order.
    pub desk: OrderDesk,
    /// What strangers did wrong.
    pub faults: Arc<Faults>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Counts one more, where a lock already keeps other writers out: an atomic addition costs more than
/// the rest of a small message's bookkeeping.
pub(crate) fn increment(counter: &AtomicU64) -> u64 {
    let count = counter.load(Ordering::Relaxed) + 1;
    counter.store(count, Ordering::Relaxed);
    count
}

impl Shared {
    pub fn new(
        name: &str,
        kind: &str,
        instance: u64,
        declared: Vec<ParameterManifest>,
        describing: bool,
    ) -> std::io::Result<Self> {
        Ok(Self {
            name: name.into(),
            kind: kind.into(),
            instance,
            clock: Arc::default(),
            describing,
            declared,
            parameters: Asking::default(),
            outputs: RwLock::default(),
            inputs: RwLock::default(),
            directory: OnceLock::new(),
            controllable: AtomicBool::new(true),
            controlled: AtomicBool::new(false),
            state: Mutex::new((RunState::Starting, 0)),
            untold: Mutex::default(),
            active: AtomicBool::new(false),
            orders: Mutex::default(),
            has_orders: AtomicBool::new(false),
            ending: AtomicBool::new(false),
            gone: AtomicBool::new(false),
            crashed: AtomicBool::new(false),
            main: Mutex::default(),
            wake: eventfd(0, EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC)?,
            reports: Mutex::default(),
            calls: AtomicU64::new(0),
            in_call: AtomicBool::new(false),
            exec_calls: AtomicU64::new(0),
            gathered: AtomicBool::new(false),
            last_error: Mutex::default(),
            desk: OrderDesk::default(),
            faults: Arc::default(),
        })
    }

    // Ports.

    pub fn add_output(&self, output: Output) {
        self.outputs.write().unwrap_or_else(PoisonError::into_inner).push(Arc::new(output));
    }

    pub fn add_input(&self, input: Input) {
        self.inputs.write().unwrap_or_else(PoisonError::into_inner).push(Arc::new(input));
    }

    pub fn outputs(&self) -> Vec<Arc<Output>> {
        self.outputs.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub fn inputs(&self) -> Vec<Arc<Input>> {
        self.inputs.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Publishes `message` on output `id`.
    pub fn publish<T: Message>(&self, id: &str, message: &T) -> Result<Sent, SendError> {
        let outputs = self.outputs.read().unwrap_or_else(PoisonError::into_inner);
        let output = outputs.iter().find(|output| output.id == id).ok_or_else(|| {
            SendError::UnknownOutput { component: self.name.clone(), id: id.into() }
        })?;
        if output.message != TypeId::of::<T>() {
            return Err(SendError::WrongType {
                data: output.entry.data.clone(),
                declared: output.entry.type_name.clone(),
                given: T::NAME,
            });
        }
        let how = crate::link::Publish {
            stamp_s: self.clock.timestamp(),
            instance: self.instance,
            call: CALL.get(),
            gathered: &self.gathered,
            wake: &|| self.wake_service(),
        };
        Ok(output.publish(message, &how)?)
    }

    /// Writes what the call that ends has gathered.
    pub fn flush_gathered(&self) {
        if self.is_gathering() && self.gathered.swap(false, Ordering::Relaxed) {
            let mut all = true;
            for output in self.outputs.read().unwrap_or_else(PoisonError::into_inner).iter() {
                all &= output.flush();
            }
            if !all {
                self.wake_service();
            }
        }
    }

    /// Answers an operator's order.
    pub fn answer_order(&self, connection: u64, answer: Answer) {
        self.desk.answer(connection, answer);
        self.wake_service();
    }

    /// Whether frames are being gathered right now.
    pub fn is_gathering(&self) -> bool {
        self.gathered.load(Ordering::Relaxed)
    }

    // The registry.

    pub fn set_directory(&self, directory: Directory) {
        let _ = self.directory.set(directory);
    }

    /// The connection to the registry; set before any other thread runs.
    pub fn directory(&self) -> &Directory {
        self.directory.get().expect("the directory is set before inputs and outputs are served")
    }

    // State and orders.

    pub fn set_non_controllable(&self) {
        self.controllable.store(false, Ordering::Relaxed);
    }

    pub fn is_controllable(&self) -> bool {
        self.controllable.load(Ordering::Relaxed)
    }

    pub fn set_controlled(&self, controlled: bool) {
        self.controlled.store(controlled, Ordering::Relaxed);
    }

    pub fn starts_active(&self) -> bool {
        !self.controlled.load(Ordering::Relaxed) || !self.is_controllable()
    }

    pub fn publish_state(&self, state: RunState, activation: u64) {
        *lock(&self.state) = (state, activation);
        lock(&self.untold).push((state, activation));
        self.active.store(state == RunState::Active, Ordering::SeqCst);
        self.wake_service();
    }

    pub fn state(&self) -> (RunState, u64) {
        *lock(&self.state)
    }

    /// Every state since the last time, also those that did not last.
    pub fn take_untold(&self) -> Vec<(RunState, u64)> {
        std::mem::take(&mut *lock(&self.untold))
    }

    pub fn is_active(&self) -> bool {
        self.active.load(Ordering::SeqCst)
    }

    pub fn order(&self, wanted: Wanted) {
        lock(&self.orders).wanted.push_back(wanted);
        self.has_orders.store(true, Ordering::SeqCst);
        self.wake_main();
    }

    pub fn take_wanted(&self) -> Option<Wanted> {
        let mut orders = lock(&self.orders);
        let wanted = orders.wanted.pop_front();
        self.has_orders.store(!orders.wanted.is_empty(), Ordering::SeqCst);
        wanted
    }

    pub fn has_orders(&self) -> bool {
        self.has_orders.load(Ordering::SeqCst) || self.is_ending()
    }

    pub fn end(&self) {
        self.ending.store(true, Ordering::SeqCst);
        self.wake_main();
    }

    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::SeqCst)
    }

    /// Leaves the system: the registry first, so that nobody is sent here, then every connection.
    pub fn leave(&self) {
        self.directory().close();
        self.ending.store(true, Ordering::SeqCst);
        self.gone.store(true, Ordering::SeqCst);
        for output in self.outputs() {
            output.close();
        }
        for input in self.inputs() {
            input.close();
        }
        self.wake_service();
    }

    pub fn is_gone(&self) -> bool {
        self.gone.load(Ordering::SeqCst)
    }

    pub fn set_crashed(&self) {
        self.crashed.store(true, Ordering::SeqCst);
        self.wake_main();
    }

    pub fn has_crashed(&self) -> bool {
        self.crashed.load(Ordering::SeqCst)
    }

    // Threads.

    pub fn set_main(&self, thread: Thread) {
        *lock(&self.main) = Some(thread);
    }

    pub fn wake_main(&self) {
        if let Some(main) = &*lock(&self.main) {
            main.unpark();
        }
    }

    pub fn wake_fd(&self) -> &OwnedFd {
        &self.wake
    }

    pub fn wake_service(&self) {
        let _ = rustix::io::write(&self.wake, &1u64.to_ne_bytes());
    }

    // Parameters.

    pub fn has_parameters(&self) -> bool {
        self.parameters.has_arrived()
    }

    /// What the component's code says of a parameter.
    pub fn declaration(&self, name: &str) -> Option<&ParameterManifest> {
        self.declared.iter().find(|parameter| parameter.name == name)
    }

    pub fn take_parameter(&self) -> Option<(String, Value)> {
        self.parameters.take()
    }

    // Reports.

    pub fn report(&self, activation: u64, outcome: ReportKind) {
        let mut reports = lock(&self.reports);
        reports.last += 1;
        let number = reports.last;
        reports.waiting.push_back(Report { number, activation, outcome });
        if reports.waiting.len() > MAX_REPORTS {
            let is_event = |report: &Report| matches!(report.outcome, ReportKind::Event { .. });
            let oldest = reports.waiting.iter().position(is_event).unwrap_or(0);
            reports.waiting.remove(oldest);
            tracing::error!("a report was dropped: no executive has taken the last {MAX_REPORTS}");
        }
        drop(reports);
        self.wake_service();
    }

    pub fn reports(&self) -> MutexGuard<'_, Reports> {
        lock(&self.reports)
    }

    /// Notes and logs an error of the component.
    pub fn failed(&self, reason: &str) {
        tracing::error!("{reason}");
        reason.clone_into(&mut lock(&self.last_error));
    }

    // Calls.

    /// Marks that this thread runs user code until the returned value is dropped.
    pub fn begin_call(&self) -> InCall<'_> {
        self.in_call.store(true, Ordering::Relaxed);
        CALL.set(increment(&self.calls));
        InCall(self)
    }

    /// The number of the running call, if user code runs.
    pub fn running_call(&self) -> Option<u64> {
        self.in_call.load(Ordering::Relaxed).then(|| self.calls.load(Ordering::Relaxed))
    }

    pub fn counted_exec(
        &self,
        exec: impl FnOnce() -> Result<Outcome, Fault>,
    ) -> Result<Outcome, Fault> {
        increment(&self.exec_calls);
        exec()
    }

    pub fn status(&self) -> Status {
        let (state, activation) = self.state();
        Status {
            name: self.name.clone(),
            kind: self.kind.clone(),
            state,
            activation,
            controllable: self.is_controllable(),
            uptime_s: self.clock.monotonic().as_secs_f64(),
            exec_calls: self.exec_calls.load(Ordering::Relaxed),
            clock_offset_s: self.clock.offset_s(),
            clock_error_s: self.clock.estimate().map(|estimate| estimate.error_s),
            last_error: lock(&self.last_error).clone(),
            outputs: self.outputs().iter().map(|output| output.status()).collect(),
            inputs: self.inputs().iter().map(|input| input.status()).collect(),
        }
    }
}

/// While it lives, this thread runs user code.
pub(crate) struct InCall<'a>(&'a Shared);

impl Drop for InCall<'_> {
    fn drop(&mut self) {
        CALL.set(0);
        self.0.in_call.store(false, Ordering::Relaxed);
        self.0.flush_gathered();
    }
}
