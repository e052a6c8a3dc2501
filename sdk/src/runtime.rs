//! The loop that ticks a component and changes its state, and the threads of its inputs, which run
//! its code on data: all through one [call gate](crate::call_gate).

use std::sync::Arc;
use std::sync::atomic::{Ordering, fence};
use std::time::Duration;

use armor_wire::frame::DataHeader;
use parking_lot::MutexGuard;

use crate::call::Call;
use crate::call_gate::CallGate;
use crate::link::inbox::{InboxItem, next_turn};
use crate::link::input::InputPort;
use crate::link::payload::Payload;
use crate::participant::Participant;
use crate::running_component::RunningComponent;
use crate::timeline::TickSchedule;
use crate::user_code::UserCode;

/// Period of a component without a rate and without a connected input.
const DEFAULT_PERIOD: Duration = Duration::from_millis(100);
/// The main loop sleeps no longer than this.
const LONGEST_WAIT: Duration = Duration::from_millis(500);

/// A thread inside the component. After it is dropped, [`Runtime::after_release`] takes care of
/// what arrived meanwhile.
pub(crate) struct EnteredComponent<'a>(MutexGuard<'a, RunningComponent>);

impl EnteredComponent<'_> {
    /// Hands data of input `index` to the component, if it is active.
    pub fn deliver_data(
        &mut self,
        index: usize,
        header: DataHeader,
        lost: u64,
        arrived_s: f64,
        payload: Payload<'_>,
    ) {
        self.0.deliver_data(index, header, lost, arrived_s, payload);
    }
}

/// A component and its threads.
pub(crate) struct Runtime {
    pub participant: Arc<Participant>,
    gate: CallGate<RunningComponent>,
    inputs: Vec<Arc<InputPort>>,
    period: Option<Duration>,
}

impl Runtime {
    pub fn new(
        code: Box<dyn UserCode>,
        participant: Arc<Participant>,
        rate_hz: Option<f64>,
    ) -> Self {
        let inputs = participant.ports.inputs();
        let is_fed = inputs.iter().any(|input| input.data().is_some());
        let period = match rate_hz {
            Some(rate_hz) => Some(Duration::from_secs_f64(1.0 / rate_hz)),
            None if is_fed => None,
            None => Some(DEFAULT_PERIOD),
        };
        if let Some(period) = period {
            participant.set_period(period);
        }
        let component = RunningComponent::new(code, Arc::clone(&participant), period.is_none());
        Self { participant, gate: CallGate::new(component), inputs, period }
    }

    /// Enters the component if no thread is inside and the main loop does not wait.
    pub fn try_enter(&self) -> Option<EnteredComponent<'_>> {
        self.gate.try_enter().map(EnteredComponent)
    }

    /// Whether the main loop wants to enter.
    pub fn main_waits(&self) -> bool {
        self.gate.main_waits()
    }

    /// The place of data that are put into an inbox, in the order of all inputs' data.
    pub fn next_arrival(&self) -> u64 {
        self.gate.next_arrival()
    }

    /// Called after putting data into an inbox: the thread that is or was inside the component will
    /// deliver them.
    pub fn add_backlog(&self) {
        self.gate.add_backlog();
        self.after_release();
    }

    /// Called after leaving the component: delivers what arrived while its lock was held.
    ///
    /// A reader adds to the backlog, then tries the lock; the thread inside unlocks, then reads the
    /// backlog. The later of the two sees the other's step, so no data stay behind. Data that
    /// arrive during the delivery are for the main loop: the calling thread must return to its
    /// input.
    pub fn after_release(&self) {
        let end = self.gate.arrivals();
        loop {
            fence(Ordering::SeqCst);
            if !self.gate.has_backlog() || self.main_waits() {
                return;
            }
            let Some(mut entered) = self.try_enter() else { return };
            if self.deliver_backlog(&mut entered.0, end, || false) {
                return self.wake_main();
            }
        }
    }

    /// Delivers the waiting data that arrived before `end`, in the order of their arrival over all
    /// inputs: an input that is filled faster than it is emptied must not keep the others waiting.
    ///
    /// Stops early for the main loop, for orders and for a due tick, so that more data than the
    /// component can take do not delay these; the rest stays in the backlog. Returns whether there
    /// may be a rest.
    fn deliver_backlog(
        &self,
        component: &mut RunningComponent,
        end: u64,
        is_tick_due: impl Fn() -> bool,
    ) -> bool {
        self.gate.clear_backlog();
        let find_turn = || next_turn(self.inputs.iter().map(|input| input.oldest_arrival()));
        while let Some(turn) = find_turn() {
            // Stop at the next input's oldest arrival: newer data here must not overtake it.
            let turn_end = end.min(turn.end).min(self.gate.arrivals());
            let has_rest = turn.oldest >= end
                || self.inputs[turn.input].deliver_waiting(turn_end, |item| {
                    let payload = item.payload.as_payload();
                    let InboxItem { header, lost, arrived_s, .. } = *item;
                    component.deliver_data(turn.input, header, lost, arrived_s, payload);
                    self.main_waits() || self.participant.lifecycle.has_orders() || is_tick_due()
                });
            if has_rest {
                self.gate.add_backlog();
                return true;
            }
        }
        false
    }

    pub fn wake_main(&self) {
        self.participant.wakers.wake_main();
    }

    /// Runs the component until it is ordered to end. Returns whether its code has panicked.
    pub fn run_main_loop(&self) -> bool {
        self.participant.wakers.set_main(std::thread::current());
        let lifecycle = &self.participant.lifecycle;
        let mut main_loop = MainLoop {
            runtime: self,
            beat: self.period.map(TickSchedule::new),
            initially_active: Some(lifecycle.starts_active()),
            jumps_seen: 0,
        };
        loop {
            let mut component = self.gate.enter_from_main();
            let seen_s = self.participant.clock.timestamp();
            let wait = main_loop.take_turn(&mut component);
            self.participant.turned_bits.store(seen_s.to_bits(), Ordering::SeqCst);
            let (has_crashed, is_ending) = (lifecycle.has_crashed(), lifecycle.is_ending());
            if is_ending && !has_crashed {
                component.end_life();
            }
            if has_crashed || is_ending {
                return has_crashed;
            }
            drop(component);
            // Orders this thread's unlock before its look at the backlog, as in `after_release`.
            fence(Ordering::SeqCst);
            // Parking for no time at all still costs the kernel's timer slack.
            if !self.gate.has_backlog() && !lifecycle.has_orders() && !wait.is_zero() {
                std::thread::park_timeout(wait);
            }
        }
    }
}

/// What the main loop remembers from one turn to the next.
struct MainLoop<'a> {
    runtime: &'a Runtime,
    /// When the next tick is due; `None` if the component has no period.
    beat: Option<TickSchedule>,
    /// The state to begin with, until the component has entered it.
    initially_active: Option<bool>,
    /// Jumps of the time so far; after a jump ticks start again.
    jumps_seen: u64,
}

impl MainLoop<'_> {
    /// One turn inside the component: parameters, orders, waiting data, then a tick if one is due.
    /// Returns how long there is nothing to do.
    fn take_turn(&mut self, component: &mut RunningComponent) -> Duration {
        component.deliver_parameters();
        let was_active = component.is_active();
        self.initially_active.take_if(|active| component.begin_life(*active));
        component.activate_when_time_is_known();
        component.obey_orders();
        component.report_thread_panics();
        self.restart_beat(component.is_active() && !was_active);
        let clock = &self.runtime.participant.clock;
        let beat = self.beat.as_ref().filter(|_| component.is_active());
        let is_tick_due = || beat.is_some_and(|beat| beat.is_due(clock.tick_time().0));
        self.runtime.deliver_backlog(component, u64::MAX, is_tick_due);
        let Some(beat) = self.beat.as_mut().filter(|_| component.is_active()) else {
            return LONGEST_WAIT;
        };
        let now = clock.tick_time().0;
        if beat.is_due(now) {
            component.pull_inputs();
            // The data may have been its last.
            if component.is_active() {
                component.execute_call(Call::Tick);
            }
            self.runtime.participant.calls.add_skipped_ticks(beat.record_tick(now));
        }
        // Simulated time wakes this thread when it passes.
        if clock.runs_by_itself() {
            LONGEST_WAIT.min(beat.time_left(clock.tick_time().0))
        } else {
            LONGEST_WAIT
        }
    }

    /// Ticks count from an activation, and again from a jump of the time.
    fn restart_beat(&mut self, has_activated: bool) {
        let (now, jumps) = self.runtime.participant.clock.tick_time();
        let has_jumped = std::mem::replace(&mut self.jumps_seen, jumps) != jumps;
        if let Some(beat) = &mut self.beat
            && (has_activated || has_jumped)
        {
            beat.start_at(now);
        }
    }
}
