//! The calls of a component's code, for a tool that follows messages through the system
//! (`armor trace`): which message each call was for, when it had arrived, and what the call published.
//!
//! Each component serves them as an output that it does not register: only a tool that asks for it by
//! its name gets them, and while none does, nothing is recorded (docs/protocol.md, Calls). Times are
//! the registry's, also in a system whose time follows data.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;

use crate::Message;
use crate::clock::SystemClock;

/// The local name of the output with the calls.
pub const CALLS: &str = "armor-calls";

/// Most calls that wait for the next report, 0.2 s of them: more are counted as missed.
const MAX_CALLS: usize = 4096;
/// Most messages of one call that are listed.
const MAX_PUBLISHED: usize = 64;

/// The calls that have ended since the last report.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct TracedCalls {
    /// In the order in which they ended.
    pub calls: Vec<TracedCall>,
    /// Calls, and messages of calls, that were left out because there were too many.
    pub missed: u64,
}

/// One call of a component's code.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct TracedCall {
    /// Counts the calls of this process that were reported, from 0.
    pub number: u64,
    /// The function that was called first: `data_received`, which `exec` follows in a component
    /// without a rate; `exec`, `parameter_received` or `new`. `send_data` for a message that a thread
    /// of the component's own has published.
    pub function: String,
    /// When it began, in the registry's time.
    #[message(unit = "s")]
    pub began_s: f64,
    /// When it ended, in the registry's time.
    #[message(unit = "s")]
    pub ended_s: f64,
    /// Whether it returned an error, or panicked.
    pub has_failed: bool,
    /// The message that it was called for.
    pub input: Option<TracedInput>,
    /// What it published, in this order.
    pub published: Vec<TracedOutput>,
}

/// A message that was handed to a component.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct TracedInput {
    /// Local name of the input.
    pub input: String,
    /// System-wide name of the data.
    pub data: String,
    /// The process start that published it.
    pub instance: u64,
    /// Its sequence.
    pub sequence: u64,
    /// Its stamp, in system time.
    #[message(unit = "s")]
    pub stamp_s: f64,
    /// When it had been read from the link, in the registry's time. 0 if that was before the first
    /// tool asked.
    #[message(unit = "s")]
    pub arrived_s: f64,
    /// How many messages were lost immediately before it.
    pub lost: u64,
}

/// A message that a component has published.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct TracedOutput {
    /// Local name of the output.
    pub output: String,
    /// Its sequence.
    pub sequence: u64,
    /// When it was published, in the registry's time.
    #[message(unit = "s")]
    pub at_s: f64,
}

/// The name of the data with the calls of a component.
pub fn calls_of(component: &str) -> String {
    format!("{component}.{CALLS}")
}

thread_local! {
    /// The call that this thread is in, if calls are recorded.
    static CURRENT: RefCell<Option<TracedCall>> = const { RefCell::new(None) };
}

/// The calls of one component.
pub(crate) struct CallTrace {
    clock: Arc<SystemClock>,
    /// Whether a tool has asked for them.
    is_watched: AtomicBool,
    waiting: Mutex<WaitingCalls>,
}

#[derive(Default)]
struct WaitingCalls {
    next_number: u64,
    report: TracedCalls,
}

impl CallTrace {
    pub fn new(clock: Arc<SystemClock>) -> Self {
        Self { clock, is_watched: AtomicBool::new(false), waiting: Mutex::default() }
    }

    /// Begins to record calls, or ends it.
    pub fn set_watched(&self, is_watched: bool) {
        if self.is_watched.swap(is_watched, Ordering::Relaxed) && !is_watched {
            self.waiting.lock().report = TracedCalls::default();
        }
    }

    /// The present time, if calls are recorded.
    pub fn time_s(&self) -> Option<f64> {
        self.is_watched.load(Ordering::Relaxed).then(|| self.clock.registry_time_s())
    }

    /// This thread begins a call.
    pub fn begin_call(&self, function: &str) {
        let Some(began_s) = self.time_s() else { return };
        let call = TracedCall { function: function.into(), began_s, ..TracedCall::default() };
        CURRENT.set(Some(call));
    }

    /// The call of this thread is for this message.
    pub fn note_input(&self, describe: impl FnOnce() -> TracedInput) {
        CURRENT.with_borrow_mut(|call| {
            if let Some(call) = call {
                call.input = Some(describe());
            }
        });
    }

    /// A message was published at `at_s`: by the call of this thread, or outside of one.
    pub fn note_published(&self, output: &str, sequence: u64, at_s: f64) {
        let published = TracedOutput { output: output.into(), sequence, at_s };
        let outside = CURRENT.with_borrow_mut(|call| match call {
            None => Some(published),
            Some(call) if call.published.len() < MAX_PUBLISHED => {
                call.published.push(published);
                None
            }
            Some(_) => {
                self.waiting.lock().report.missed += 1;
                None
            }
        });
        let Some(published) = outside else { return };
        self.add_call(TracedCall {
            function: "send_data".into(),
            began_s: at_s,
            ended_s: self.clock.registry_time_s(),
            published: vec![published],
            ..TracedCall::default()
        });
    }

    /// The call of this thread has ended.
    pub fn end_call(&self, has_failed: bool) {
        let Some(call) = CURRENT.take() else { return };
        self.add_call(TracedCall { ended_s: self.clock.registry_time_s(), has_failed, ..call });
    }

    fn add_call(&self, call: TracedCall) {
        if !self.is_watched.load(Ordering::Relaxed) {
            return;
        }
        let mut waiting = self.waiting.lock();
        let number = waiting.next_number;
        waiting.next_number += 1;
        if waiting.report.calls.len() < MAX_CALLS {
            waiting.report.calls.push(TracedCall { number, ..call });
        } else {
            waiting.report.missed += 1;
        }
    }

    /// Takes what is to be reported, if there is anything.
    pub fn take_report(&self) -> Option<TracedCalls> {
        let mut waiting = self.waiting.lock();
        let is_empty = waiting.report == TracedCalls::default();
        (!is_empty).then(|| std::mem::take(&mut waiting.report))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_recorded_until_a_tool_asks() {
        let trace = CallTrace::new(Arc::default());
        trace.begin_call("exec");
        trace.end_call(false);
        assert_eq!((trace.time_s(), trace.take_report()), (None, None));
        trace.set_watched(true);
        trace.begin_call("exec");
        trace.end_call(false);
        trace.set_watched(false);
        assert_eq!(trace.take_report(), None, "no tool waits for it any more");
    }

    #[test]
    fn a_call_has_its_message_and_what_it_published() {
        let trace = CallTrace::new(Arc::default());
        trace.set_watched(true);
        trace.begin_call("data_received");
        let input = TracedInput { data: "laser.scan".into(), sequence: 7, ..Default::default() };
        trace.note_input(|| input.clone());
        let at_s = trace.time_s().expect("it records");
        trace.note_published("pose", 3, at_s);
        std::thread::scope(|scope| {
            scope.spawn(|| trace.note_published("status", 9, at_s));
        });
        trace.end_call(true);
        let report = trace.take_report().expect("two calls");
        let [own_thread, call] = report.calls.as_slice() else { panic!("{report:?}") };
        assert_eq!((own_thread.function.as_str(), own_thread.number), ("send_data", 0));
        assert_eq!((call.number, call.has_failed, &call.input), (1, true, &Some(input)));
        let published = TracedOutput { output: "pose".into(), sequence: 3, at_s };
        assert_eq!(call.published, [published]);
        assert!(call.began_s <= at_s && at_s <= call.ended_s, "{call:?}");
    }

    #[test]
    fn memory_is_bounded_and_what_is_left_out_is_counted() {
        let trace = CallTrace::new(Arc::default());
        trace.set_watched(true);
        trace.begin_call("exec");
        for sequence in 0..MAX_PUBLISHED as u64 + 2 {
            trace.note_published("burst", sequence, 0.0);
        }
        trace.end_call(false);
        for sequence in 0..MAX_CALLS as u64 {
            trace.note_published("own", sequence, 0.0);
        }
        let report = trace.take_report().expect("many calls");
        assert_eq!(report.calls[0].published.len(), MAX_PUBLISHED);
        assert_eq!((report.calls.len(), report.missed), (MAX_CALLS, 3));
        assert_eq!(trace.take_report(), None);
    }
}
