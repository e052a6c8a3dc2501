//! Panics outside the calls of user code: in threads that the component has started itself. A hook
//! of the process notes them, and the main loop reports them.

use std::panic::{self, PanicHookInfo};
use std::sync::{Arc, Once, Weak};
use std::thread;

use parking_lot::Mutex;

use crate::calls::is_in_call;
use crate::participant::Participant;
use crate::wake::Wakers;

/// Most panics that wait to be reported: a thread may panic in a loop.
const MAX_WAITING: usize = 16;

/// The components of this process: one, except in tests.
static COMPONENTS: Mutex<Vec<Weak<Participant>>> = Mutex::new(Vec::new());
static HOOK: Once = Once::new();

/// The panics of a component's own threads that are not reported yet, in words.
pub(crate) struct ThreadPanics {
    waiting: Mutex<Vec<String>>,
    wakers: Arc<Wakers>,
}

impl ThreadPanics {
    pub fn new(wakers: Arc<Wakers>) -> Self {
        Self { waiting: Mutex::default(), wakers }
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
    HOOK.call_once(|| {
        let previous = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            previous(info);
            note_panic(info);
        }));
    });
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
    for component in components {
        component.thread_panics.add_panic(reason.clone());
    }
}
