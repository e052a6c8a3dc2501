//! Numbers the calls of user code, so that a message knows in which call it was sent and the
//! service thread knows how long a call takes.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::counter::SingleWriterCounter;

/// The number that stands for "not in a call of user code". Calls are numbered from 1.
const NO_CALL: u64 = 0;

thread_local! {
    /// The call of user code that this thread is in.
    static CURRENT_CALL: Cell<u64> = const { Cell::new(NO_CALL) };
}

/// The calls of one component. Written only by the thread that holds the component's call gate.
#[derive(Default)]
pub(crate) struct CallCounter {
    started: SingleWriterCounter,
    is_running: AtomicBool,
    exec_calls: SingleWriterCounter,
}

impl CallCounter {
    /// Marks that this thread runs user code until the returned value is dropped.
    pub fn begin_call(&self) -> RunningCall<'_> {
        self.is_running.store(true, Ordering::Relaxed);
        CURRENT_CALL.set(self.started.increment());
        RunningCall(self)
    }

    /// The number of the running call, if user code runs on any thread.
    pub fn running_call(&self) -> Option<u64> {
        self.is_running.load(Ordering::Relaxed).then(|| self.started.count())
    }

    /// Counts one call of `exec`.
    pub fn count_exec(&self) {
        self.exec_calls.increment();
    }

    pub fn exec_calls(&self) -> u64 {
        self.exec_calls.count()
    }
}

/// The number of the call of user code that the calling thread is in; 0 outside of one.
pub(crate) fn current_call() -> u64 {
    CURRENT_CALL.get()
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
            let running = calls.begin_call();
            assert_eq!((current_call(), calls.running_call()), (number, Some(number)));
            let elsewhere = std::thread::scope(|scope| scope.spawn(current_call).join().unwrap());
            assert_eq!(elsewhere, NO_CALL, "a thread of the user's own is in no call");
            drop(running);
            assert_eq!((current_call(), calls.running_call()), (NO_CALL, None));
        }
        calls.count_exec();
        assert_eq!(calls.exec_calls(), 1);
    }
}
