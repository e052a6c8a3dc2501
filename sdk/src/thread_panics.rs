//! Panics outside the calls of user code: in threads that the component has started itself. A hook
//! of the process notes them, and the main loop reports them.

use std::cell::RefCell;
use std::num::NonZeroU64;
use std::panic::{self, PanicHookInfo};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Once, Weak};
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
    /// By which its threads differ from those of other components and of tests in this process.
    mark: ThreadMark,
    /// Whether threads without its mark are its own, too, as long as it is the only component.
    includes_unmarked: AtomicBool,
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

    /// Marks this thread for good, unless its timer slack was set to another value than the default,
    /// as a service does that needs exact times.
    pub fn mark_main_thread(self) {
        if current_timer_slack().is_ok_and(|slack| slack == DEFAULT_SLACK_NS) {
            let _ = set_current_timer_slack(NonZeroU64::new(self.0));
        }
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
        let mark = ThreadMark(LAST_MARK.fetch_add(1, Ordering::Relaxed) + 1);
        Self { waiting: Mutex::default(), mark, includes_unmarked: AtomicBool::new(false), wakers }
    }

    /// Returns the mark of its threads.
    pub fn mark(&self) -> ThreadMark {
        self.mark
    }

    /// From now on threads without its mark are its own, too, as long as it is the only component of
    /// the process: those that began before it, or that a library has started elsewhere.
    pub fn include_unmarked(&self) {
        self.includes_unmarked.store(true, Ordering::Relaxed);
    }

    /// Keeps a panic for the main loop and wakes it. Logs nothing: the thread that panics may hold
    /// any other lock.
    pub fn add_panic(&self, reason: String) {
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
    let panics: Vec<_> = components.iter().map(|component| &component.thread_panics).collect();
    if let Some(concerned) = find_concerned(&panics) {
        concerned.add_panic(reason);
    }
}

/// Returns the component that this thread belongs to, of all those in the process.
fn find_concerned<'a>(components: &[&'a ThreadPanics]) -> Option<&'a ThreadPanics> {
    let marked = components.iter().find(|it| it.mark.is_of_this_thread()).copied();
    marked.or_else(|| match components {
        [only] if only.includes_unmarked.load(Ordering::Relaxed) => Some(only),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn new_panics() -> ThreadPanics {
        ThreadPanics::new(Arc::new(Wakers::new().expect("wakers")))
    }

    #[test]
    fn a_panic_is_that_of_the_component_whose_thread_it_is() {
        let [first, second] = [(); 2].map(|()| new_panics());
        let is = |found: Option<&ThreadPanics>, wanted: &ThreadPanics| {
            found.is_some_and(|found| std::ptr::eq(found, wanted))
        };
        for panics in [&first, &second] {
            panics.include_unmarked();
        }
        let both = [&first, &second];
        assert!(find_concerned(&both).is_none(), "the thread of a test");
        assert!(is(find_concerned(&both[..1]), &first), "it is alone");
        let marked = second.mark().mark_thread();
        let inherited = thread::scope(|scope| {
            scope.spawn(|| is(find_concerned(&both), &second)).join().expect("it ends")
        });
        assert!(inherited && is(find_concerned(&both), &second));
        drop(marked);
        assert!(find_concerned(&both).is_none());
    }

    #[test]
    fn a_tested_component_has_no_thread_without_its_mark() {
        let panics = new_panics();
        assert!(find_concerned(&[&panics]).is_none());
    }
}
