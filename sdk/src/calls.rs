//! Numbers the calls of user code, so that a message knows in which call it was sent and the
//! service thread knows how long a call takes.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

use crate::counter::SingleWriterCounter;

/// The number that stands for "not in a call of user code". Calls are numbered from 1.
const NO_CALL: u64 = 0;

thread_local! {
    /// The call of user code that this thread is in.
    static CURRENT_CALL: Cell<u64> = const { Cell::new(NO_CALL) };
}

/// The function of user code that a call is in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum CalledFunction {
    #[default]
    Exec,
    DataReceived,
    ParameterReceived,
    New,
}

impl CalledFunction {
    const ALL: [Self; 4] = [Self::Exec, Self::DataReceived, Self::ParameterReceived, Self::New];

    /// Its name in the trait `Component`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exec => "exec",
            Self::DataReceived => "data_received",
            Self::ParameterReceived => "parameter_received",
            Self::New => "new",
        }
    }
}

/// The calls of one component. Written only by the thread that holds the component's call gate.
#[derive(Default)]
pub(crate) struct CallCounter {
    started: SingleWriterCounter,
    is_running: AtomicBool,
    /// When the running call began, in milliseconds of [`coarse_ms`].
    began_ms: AtomicU64,
    /// The [`CalledFunction`] of the running call.
    function: AtomicU8,
    exec_calls: SingleWriterCounter,
    skipped_ticks: SingleWriterCounter,
}

impl CallCounter {
    /// Marks that this thread runs user code until the returned value is dropped.
    pub fn begin_call(&self, function: CalledFunction) -> RunningCall<'_> {
        self.enter_function(function);
        self.began_ms.store(coarse_ms(), Ordering::Relaxed);
        self.is_running.store(true, Ordering::Relaxed);
        CURRENT_CALL.set(self.started.increment());
        RunningCall(self)
    }

    /// The number of the running call, if user code runs on any thread.
    pub fn running_call(&self) -> Option<u64> {
        self.is_running.load(Ordering::Relaxed).then(|| self.started.count())
    }

    /// How long the running call has taken; of no meaning if none runs.
    pub fn time_taken(&self) -> Duration {
        Duration::from_millis(coarse_ms().saturating_sub(self.began_ms.load(Ordering::Relaxed)))
    }

    /// Marks that the running call is in `function` from now on.
    fn enter_function(&self, function: CalledFunction) {
        self.function.store(function as u8, Ordering::Relaxed);
    }

    /// The function of the call that runs, or ran last.
    pub fn function(&self) -> CalledFunction {
        let index = usize::from(self.function.load(Ordering::Relaxed));
        CalledFunction::ALL.get(index).copied().unwrap_or_default()
    }

    /// Marks that the running call enters `exec`, and counts it.
    pub fn enter_exec(&self) {
        self.enter_function(CalledFunction::Exec);
        self.exec_calls.increment();
    }

    pub fn exec_calls(&self) -> u64 {
        self.exec_calls.count()
    }

    /// Counts ticks at which `exec` was not called, because earlier calls took too long.
    pub fn add_skipped_ticks(&self, count: u64) {
        self.skipped_ticks.add(count);
    }

    pub fn skipped_ticks(&self) -> u64 {
        self.skipped_ticks.count()
    }
}

/// The host's monotonic clock as of the last tick of the kernel: every call reads it, and this costs
/// less than the exact time.
fn coarse_ms() -> u64 {
    let now = clock_gettime(ClockId::MonotonicCoarse);
    now.tv_sec.unsigned_abs() * 1000 + now.tv_nsec.unsigned_abs() / 1_000_000
}

/// The number of the call of user code that the calling thread is in; 0 outside of one.
pub(crate) fn current_call() -> u64 {
    CURRENT_CALL.get()
}

/// Whether the calling thread is in a call of user code.
pub(crate) fn is_in_call() -> bool {
    current_call() != NO_CALL
}

/// While it exists, this thread runs user code.
pub(crate) struct RunningCall<'a>(&'a CallCounter);

impl Drop for RunningCall<'_> {
    fn drop(&mut self) {
        CURRENT_CALL.set(NO_CALL);
        self.0.is_running.store(false, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_has_a_number_on_its_thread_until_it_ends() {
        let calls = CallCounter::default();
        assert_eq!((current_call(), calls.running_call()), (NO_CALL, None));
        for number in 1..3 {
            let running = calls.begin_call(CalledFunction::DataReceived);
            assert_eq!((current_call(), calls.running_call()), (number, Some(number)));
            assert_eq!(calls.function().name(), "data_received");
            let elsewhere = std::thread::scope(|scope| scope.spawn(current_call).join().unwrap());
            assert_eq!(elsewhere, NO_CALL, "a thread of the user's own is in no call");
            drop(running);
            assert_eq!((current_call(), calls.running_call()), (NO_CALL, None));
        }
        let running = calls.begin_call(CalledFunction::ParameterReceived);
        assert_eq!(calls.function().name(), "parameter_received");
        calls.enter_exec();
        assert_eq!((calls.exec_calls(), calls.function().name()), (1, "exec"));
        drop(running);
    }
}
