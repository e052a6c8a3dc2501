//! The running component: its code, guarded so that only one thread is ever in it, and the loop that
//! ticks it and changes its state.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering, fence};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

use armor_wire::control::{ReportKind, RunState};
use armor_wire::frame::DataHeader;
use armor_wire::name::is_name;

use crate::component::{Call, Component, Data, Fault, Header, Outcome};
use crate::link::{Input, turn};
use crate::parameter::Value;
use crate::shared::{Begin, Shared, Wanted};
use crate::timeline::Beat;

/// How often a component without a rate and without a connected input is called.
const DEFAULT_PERIOD: Duration = Duration::from_millis(100);
/// How long the main loop sleeps at most.
const LONGEST_WAIT: Duration = Duration::from_millis(500);

/// A component without its type.
pub(crate) trait UserCode: Send {
    fn parameter(&mut self, name: &str, value: &Value) -> Result<(), Fault>;
    fn data(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault>;
    fn exec(&mut self, call: Call) -> Result<Outcome, Fault>;
}

impl<C: Component> UserCode for C {
    fn parameter(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameter_received(name, value)
    }
    fn data(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        self.data_received(header, data)
    }
    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        Component::exec(self, call)
    }
}

/// The component and what only the thread inside it may touch.
pub(crate) struct Core {
    user: Box<dyn UserCode>,
    shared: Arc<Shared>,
    inputs: Vec<(Arc<Input>, String)>,
    state: RunState,
    activation: u64,
    /// `exec` follows each data.
    on_data: bool,
    /// The activation that begins as soon as the time is known.
    awaits_time: Option<Begin>,
}

/// Holds the component; releasing it may find more to do, see [`Runtime::after_release`].
pub(crate) struct Guard<'a>(MutexGuard<'a, Core>);

impl Guard<'_> {
    /// Hands data to the component, if it is active.
    pub fn data(&mut self, index: usize, header: DataHeader, lost: u64, payload: &[u8]) {
        self.0.data(index, header, lost, payload);
    }
}

/// A component at work.
pub(crate) struct Runtime {
    pub shared: Arc<Shared>,
    core: Mutex<Core>,
    inputs: Vec<Arc<Input>>,
    /// Somebody has put data into an inbox that may not have been seen yet.
    backlog: AtomicUsize,
    /// How many data have been put into inboxes.
    arrivals: AtomicU64,
    /// The main loop wants the component next.
    main_waits: AtomicBool,
    period: Option<Duration>,
}

impl Runtime {
    pub fn new(user: Box<dyn UserCode>, shared: Arc<Shared>, rate_hz: Option<f64>) -> Self {
        let inputs = shared.inputs();
        let named: Vec<_> = inputs
            .iter()
            .map(|input| (Arc::clone(input), input.data().unwrap_or_default()))
            .collect();
        let fed = named.iter().any(|(_, data)| !data.is_empty());
        let period = match rate_hz {
            Some(rate_hz) => Some(Duration::from_secs_f64(1.0 / rate_hz)),
            None if fed => None,
            None => Some(DEFAULT_PERIOD),
        };
        let core = Core {
            user,
            shared: Arc::clone(&shared),
            inputs: named,
            state: RunState::Starting,
            activation: 0,
            on_data: period.is_none(),
            awaits_time: None,
        };
        Self {
            shared,
            core: Mutex::new(core),
            inputs,
            backlog: AtomicUsize::new(0),
            arrivals: AtomicU64::new(0),
            main_waits: AtomicBool::new(false),
            period,
        }
    }

    /// Enters the component if nobody is in it.
    pub fn try_enter(&self) -> Option<Guard<'_>> {
        if self.main_waits() {
            return None;
        }
        match self.core.try_lock() {
            Ok(core) => Some(Guard(core)),
            Err(TryLockError::Poisoned(poisoned)) => Some(Guard(poisoned.into_inner())),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    pub fn main_waits(&self) -> bool {
        self.main_waits.load(Ordering::Relaxed)
    }

    /// The place of data that are put into an inbox among those of all inputs.
    pub fn arrival(&self) -> u64 {
        self.arrivals.fetch_add(1, Ordering::Relaxed)
    }

    /// Called after putting data into an inbox: whoever is or was in the component will see it.
    pub fn backlog_grew(&self) {
        self.backlog.fetch_add(1, Ordering::SeqCst);
        self.after_release();
    }

    /// Called after leaving the component: takes care of what arrived while its lock was held.
    ///
    /// The adder adds, then tries the lock; the holder unlocks, then looks at the count. Whichever
    /// comes last sees the other's step, so nothing is left lying. What arrives meanwhile is for the
    /// main loop: whoever reads an input must come back to it.
    pub fn after_release(&self) {
        let end = self.arrivals.load(Ordering::SeqCst);
        loop {
            fence(Ordering::SeqCst);
            if self.backlog.load(Ordering::SeqCst) == 0 || self.main_waits() {
                return;
            }
            let Some(mut guard) = self.try_enter() else { return };
            if self.drain(&mut guard.0, end, || false) {
                return self.nudge();
            }
        }
    }

    /// Delivers what waits and arrived before `end`, in that order: an input that is filled faster
    /// than it is emptied must not keep the others waiting. More data than the component can take
    /// must not keep it from its orders and ticks: then the rest stays in the backlog. Whether there
    /// may be a rest.
    fn drain(&self, core: &mut Core, end: u64, is_tick_due: impl Fn() -> bool) -> bool {
        self.backlog.swap(0, Ordering::SeqCst);
        let next = || turn(self.inputs.iter().map(|input| input.oldest()));
        while let Some((index, oldest, others)) = next() {
            // Whoever comes after these may have waited longer than what comes here after these.
            let turn_end = end.min(others).min(self.arrivals.load(Ordering::SeqCst));
            let enough = oldest >= end
                || self.inputs[index].drain(turn_end, |item| {
                    core.data(index, item.header, item.lost, &item.bytes);
                    self.main_waits() || self.shared.has_orders() || is_tick_due()
                });
            if enough {
                self.backlog.fetch_add(1, Ordering::SeqCst);
                return true;
            }
        }
        false
    }

    /// Wakes the main loop.
    pub fn nudge(&self) {
        self.shared.wake_main();
    }

    /// Runs the component until it is told to end. Returns whether its code has panicked.
    pub fn run(&self) -> bool {
        self.shared.set_main(std::thread::current());
        let clock = &self.shared.clock;
        let mut beat = self.period.map(Beat::new);
        let mut initial = Some(self.shared.starts_active());
        let mut jumps_seen = 0;
        loop {
            self.main_waits.store(true, Ordering::SeqCst);
            let mut core = self.core.lock().unwrap_or_else(PoisonError::into_inner);
            self.main_waits.store(false, Ordering::SeqCst);
            core.parameters();
            let was_active = core.state == RunState::Active;
            self.begin(&mut core, &mut initial);
            self.obey(&mut core);
            let (now, jumps) = clock.ticking();
            let is_active = core.state == RunState::Active;
            let has_jumped = std::mem::replace(&mut jumps_seen, jumps) != jumps;
            if let Some(beat) = &mut beat
                && ((is_active && !was_active) || has_jumped)
            {
                beat.start(now);
            }
            let ticks = beat.as_ref().filter(|_| is_active);
            self.drain(&mut core, u64::MAX, || {
                ticks.is_some_and(|beat| beat.is_due(clock.ticking().0))
            });
            let mut wait = LONGEST_WAIT;
            if core.state == RunState::Active
                && let Some(beat) = &mut beat
            {
                let now = clock.ticking().0;
                if beat.is_due(now) {
                    core.exec(Call::Tick);
                    beat.ticked(now);
                }
                // Simulated time wakes this thread when it passes.
                if clock.runs_by_itself() {
                    wait = wait.min(beat.left(clock.ticking().0));
                }
            }
            let (crashed, ending) = (self.shared.has_crashed(), self.shared.is_ending());
            if crashed || ending {
                if ending && !crashed {
                    core.stop();
                    // Data may arrive until the links are closed; they are for nobody any more.
                    core.enter_state(RunState::Frozen, &self.inputs);
                }
                return crashed;
            }
            drop(core);
            fence(Ordering::SeqCst);
            // Parking for no time at all still costs the kernel's timer slack.
            if self.backlog.load(Ordering::SeqCst) == 0
                && !self.shared.has_orders()
                && !wait.is_zero()
            {
                std::thread::park_timeout(wait);
            }
        }
    }

    /// Begins to live, as soon as the time is known if it is to be active.
    fn begin(&self, core: &mut Core, initial: &mut Option<bool>) {
        let is_known = self.shared.clock.is_known();
        if let Some(active) = initial.take_if(|active| is_known || !*active) {
            if active {
                core.activate(Begin { activation: 0, parameters: Vec::new() }, &self.inputs);
            } else {
                core.enter_state(RunState::Frozen, &self.inputs);
            }
        }
        if is_known && let Some(begin) = core.awaits_time.take() {
            core.activate(begin, &self.inputs);
        }
    }

    fn obey(&self, core: &mut Core) {
        while let Some(wanted) = self.shared.take_wanted() {
            match wanted {
                Wanted::Activate(begin) if self.shared.clock.is_known() => {
                    core.activate(begin, &self.inputs);
                }
                Wanted::Activate(begin) => core.awaits_time = Some(begin),
                Wanted::Freeze(activation) => {
                    core.awaits_time = None;
                    core.stop();
                    core.activation = activation.max(core.activation);
                    core.enter_state(RunState::Frozen, &self.inputs);
                }
            }
        }
    }
}

impl Core {
    fn data(&mut self, index: usize, header: DataHeader, lost: u64, payload: &[u8]) {
        if self.shared.has_parameters() {
            self.parameters();
        }
        if self.state != RunState::Active {
            return;
        }
        let (input, name) = &self.inputs[index];
        let header = Header {
            id: &input.id,
            data: name,
            sequence: header.sequence,
            stamp_s: header.stamp_s,
            instance: header.instance,
            lost,
        };
        let user = &mut self.user;
        let on_data = self.on_data;
        let shared = &self.shared;
        let result = call(shared, || {
            user.data(&header, &Data { bytes: payload })?;
            if on_data {
                shared.counted_exec(|| user.exec(Call::Data))
            } else {
                Ok(Outcome::CarryOn)
            }
        });
        self.conclude(result);
    }

    fn parameters(&mut self) {
        while let Some((name, value)) = self.shared.take_parameter() {
            let user = &mut self.user;
            let result = call(&self.shared, || {
                user.parameter(&name, &value)
                    .map(|()| Outcome::CarryOn)
                    .map_err(|fault| format!("parameter `{name}`: {fault}").into())
            });
            self.conclude(result);
        }
    }

    fn exec(&mut self, why: Call) {
        let user = &mut self.user;
        let shared = &self.shared;
        let result = call(shared, || shared.counted_exec(|| user.exec(why)));
        if why == Call::Stopping {
            // Its activation is over: nothing it returns can matter any more, except a failure.
            if let Err(failure) = result {
                self.shared.failed(&failure);
            }
        } else {
            self.conclude(result);
        }
    }

    /// The values of the activation come before its first call. One that cannot be taken fails it.
    fn activate(&mut self, begin: Begin, inputs: &[Arc<Input>]) {
        self.activation = begin.activation;
        let running = self.state == RunState::Active;
        if !running {
            self.state = RunState::Frozen;
        }
        if let Err(problem) = self.shared.parameters.give(&self.shared, begin.parameters, !running)
        {
            self.conclude(Err(problem));
        }
        self.parameters();
        if self.state == RunState::Failed {
            return;
        }
        self.enter_state(RunState::Active, inputs);
        if !running {
            self.exec(Call::Started);
        }
    }

    /// The last call before the component is frozen or ended.
    fn stop(&mut self) {
        if matches!(self.state, RunState::Active | RunState::Done | RunState::Failed) {
            self.exec(Call::Stopping);
        }
    }

    fn enter_state(&mut self, state: RunState, inputs: &[Arc<Input>]) {
        let was_active = self.state == RunState::Active;
        self.state = state;
        self.shared.publish_state(state, self.activation);
        if was_active != (state == RunState::Active) {
            for input in inputs {
                input.pause(state != RunState::Active);
            }
        }
    }

    fn conclude(&mut self, result: Result<Outcome, String>) {
        let (state, report) = match result.and_then(well_named) {
            Ok(Outcome::CarryOn) => return,
            Ok(Outcome::Event { name, value }) => {
                self.shared.report(self.activation, ReportKind::Event { name, value });
                return;
            }
            Ok(Outcome::Done) => {
                tracing::info!("done");
                (RunState::Done, ReportKind::Done)
            }
            Ok(Outcome::Failed(reason)) | Err(reason) => {
                self.shared.failed(&reason);
                (RunState::Failed, ReportKind::Failed { reason })
            }
        };
        self.shared.report(self.activation, report);
        let inputs: Vec<_> = self.inputs.iter().map(|(input, _)| Arc::clone(input)).collect();
        self.enter_state(state, &inputs);
    }
}

/// An event needs a name that a mission can wait for and that means nothing else there.
fn well_named(outcome: Outcome) -> Result<Outcome, String> {
    match &outcome {
        Outcome::Event { name, .. }
            if !is_name(name) || ["done", "failed"].contains(&name.as_str()) =>
        {
            Err(format!(
                "`{name}` is not a name for an event; `done` and `failed` are reports of their own"
            ))
        }
        _ => Ok(outcome),
    }
}

/// Runs user code; a panic in it becomes an error, and the process ends after reporting it.
fn call(shared: &Shared, run: impl FnOnce() -> Result<Outcome, Fault>) -> Result<Outcome, String> {
    let in_call = shared.begin_call();
    let result = catch_unwind(AssertUnwindSafe(run));
    drop(in_call);
    match result {
        Ok(outcome) => outcome.map_err(|fault| fault.to_string()),
        Err(panic) => {
            let text = panic
                .downcast_ref::<&str>()
                .map(|text| (*text).to_owned())
                .or_else(|| panic.downcast_ref::<String>().cloned())
                .unwrap_or_default();
            shared.set_crashed();
            Err(format!("panicked: {text}"))
        }
    }
}
