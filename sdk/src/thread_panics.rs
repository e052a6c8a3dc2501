//! Panics outside the calls of user code: in threads that the component has started itself. A hook
//! of the process notes them, and the main loop reports them.

use std::cell::RefCell;
use std::num::NonZeroU64;
use std::panic::{self, PanicHookInfo};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Once, OnceLock, Weak};
use std::thread;

use parking_lot::Mutex;
use rustix::thread::{current_timer_slack, set_current_timer_slack};

use crate::calls::is_in_call;
use crate::participant::Participant;
use crate::wake::Wakers;

/// Most panics that wait to be reported: a thread may panic in a loop.
const MAX_WAITING: usize = 16;

/// The default timer slack of a thread, in nanoseconds. Marks are larger, by so little that no sleep
/// shows it.
const DEFAULT_SLACK_NS: u64 = 50_000;
static LAST_MARK: AtomicU64 = AtomicU64::new(DEFAULT_SLACK_NS);

/// The components of this process: one, except in tests.
static COMPONENTS: Mutex<Vec<Weak<Participant>>> = Mutex::new(Vec::new());
static HOOK: Once = Once::new();

/// The panics of a component's own threads that are not reported yet, in words.
pub(crate) struct ThreadPanics {
    waiting: Mutex<Vec<String>>,
    /// Where several components share a process, in tests: by what their threads differ.
    mark: OnceLock<ThreadMark>,
    wakers: Arc<Wakers>,
}

/// Marks threads as those of one component: as their timer slack, which a thread inherits from the
/// one that starts it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ThreadMark(u64);

impl ThreadMark {
    /// Marks this thread, and each that it starts, until the returned value is dropped.
    pub fn mark_thread(self) -> MarkedThread {
        let before = current_timer_slack().ok().and_then(NonZeroU64::new);
        // Where the kernel has no timer slack, no thread is found to be the component's.
        let _ = set_current_timer_slack(NonZeroU64::new(self.0));
        MarkedThread(before)
    }

    fn is_of_this_thread(self) -> bool {
        current_timer_slack().is_ok_and(|slack| slack == self.0)
    }
}

/// While it exists, this thread is marked.
pub(crate) struct MarkedThread(Option<NonZeroU64>);

impl Drop for MarkedThread {
    fn drop(&mut self) {
        let _ = set_current_timer_slack(self.0);
    }
}

impl ThreadPanics {
    pub fn new(wakers: Arc<Wakers>) -> Self {
        Self { waiting: Mutex::default(), mark: OnceLock::new(), wakers }
    }

    /// From now on only the panics of threads with the returned mark are kept: other components and
    /// tests share the process.
    pub fn distinguish_threads(&self) -> ThreadMark {
        *self.mark.get_or_init(|| ThreadMark(LAST_MARK.fetch_add(1, Ordering::Relaxed) + 1))
    }

    /// Whether this thread is one of the component's own.
    fn is_of_component(&self) -> bool {
        self.mark.get().is_none_or(|mark| mark.is_of_this_thread())
    }

    /// Keeps a panic for the main loop and wakes it. Logs nothing: the thread that panics may hold
    /// any other lock.
    fn add_panic(&self, reason: String) {
        let mut waiting = self.waiting.lock();
        if waiting.len() < MAX_WAITING {
            waiting.push(reason);
        }
        drop(waiting);
        self.wakers.wake_main();
    }

    pub fn take_waiting(&self) -> Vec<String> {
        std::mem::take(&mut *self.waiting.lock())
    }
}

/// Reports panics of this process as failures of the component from now on. A panic in a call of user
/// code is not among them: it is caught where the call is made.
pub(crate) fn report_thread_panics(participant: &Arc<Participant>) {
    COMPONENTS.lock().push(Arc::downgrade(participant));
    add_hook();
}

fn add_hook() {
    HOOK.call_once(|| {
        let previous = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !note_quietly(info) {
                previous(info);
                note_panic(info);
            }
        }));
    });
}

/// Where this thread has panicked last, if its panics are caught and reported elsewhere.
enum QuietPanics {
    Off,
    On(Option<String>),
}

thread_local! {
    static QUIET: RefCell<QuietPanics> = const { RefCell::new(QuietPanics::Off) };
}

/// While it exists, panics of this thread are not printed.
pub(crate) struct KeptQuiet;

/// From now on panics of this thread are not printed: the caller catches and reports them.
pub(crate) fn keep_panics_quiet() -> KeptQuiet {
    add_hook();
    // A panic that aborts is never caught.
    if cfg!(panic = "unwind") {
        QUIET.set(QuietPanics::On(None));
    }
    KeptQuiet
}

impl KeptQuiet {
    /// Where this thread has panicked since, as FILE:LINE.
    pub fn place(&self) -> Option<String> {
        QUIET.with_borrow(|quiet| match quiet {
            QuietPanics::On(place) => place.clone(),
            QuietPanics::Off => None,
        })
    }
}

impl Drop for KeptQuiet {
    fn drop(&mut self) {
        QUIET.set(QuietPanics::Off);
    }
}

/// Notes the place if the panics of this thread are reported elsewhere; returns whether they are.
fn note_quietly(info: &PanicHookInfo<'_>) -> bool {
    QUIET.with_borrow_mut(|quiet| match quiet {
        QuietPanics::On(place) => {
            *place = info.location().map(|at| format!("{}:{}", at.file(), at.line()));
            true
        }
        QuietPanics::Off => false,
    })
}

fn note_panic(info: &PanicHookInfo<'_>) {
    if is_in_call() {
        return;
    }
    let thread = thread::current();
    let name = thread.name().map_or("a thread".into(), |name| format!("the thread `{name}`"));
    let text = info.payload_as_str().unwrap_or_default();
    let place = info.location().map(|at| format!(" at {}:{}", at.file(), at.line()));
    let reason = format!("{name} panicked{}: {text}", place.unwrap_or_default());
    let mut components = COMPONENTS.lock();
    components.retain(|component| component.strong_count() > 0);
    let components: Vec<_> = components.iter().filter_map(Weak::upgrade).collect();
    let concerned = |component: &Arc<Participant>| component.thread_panics.is_of_component();
    for component in components.into_iter().filter(concerned) {
        component.thread_panics.add_panic(reason.clone());
    }
}
