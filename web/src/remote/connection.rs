//! A connection of a browser on another host: who uses it, and its end when their session ends.

use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};

use armor_keys::StrangerPlace;
use armor_keys::invitations::Secret;
use futures_util::task::AtomicWaker;
use parking_lot::Mutex;

use super::RemoteAccess;

/// See the module.
pub(crate) struct RemoteConnection {
    pub(crate) address: IpAddr,
    session: Mutex<Option<Secret>>,
    /// The place of a client that is not logged in, or of one that is on the thread for STOP.
    place: Mutex<Option<StrangerPlace>>,
    /// The place of a client that is logged in.
    visitor_place: Mutex<Option<StrangerPlace<Secret>>>,
    /// Whether the thread for STOP serves it.
    is_stop: bool,
    is_cut: AtomicBool,
    waiting: AtomicWaker,
}

impl RemoteConnection {
    /// A connection of a client that is not logged in.
    pub(crate) fn new(address: IpAddr, is_stop: bool) -> Self {
        Self {
            address,
            session: Mutex::default(),
            place: Mutex::default(),
            visitor_place: Mutex::default(),
            is_stop,
            is_cut: AtomicBool::new(false),
            waiting: AtomicWaker::new(),
        }
    }

    /// Keeps a place until [`Self::bind`], and ends with it when another connection takes it.
    pub(crate) fn hold_place(self: &Arc<Self>, mut place: StrangerPlace) {
        self.end_with(place.take_end());
        *self.place.lock() = Some(place);
    }

    fn end_with(self: &Arc<Self>, is_taken: impl Future<Output = bool> + Send + 'static) {
        let connection = Arc::downgrade(self);
        tokio::spawn(async move {
            if is_taken.await
                && let Some(connection) = connection.upgrade()
            {
                connection.cut();
            }
        });
    }

    /// Notes the session of the newest request: the connection ends with it. A person who is logged
    /// in needs no place of a guest, and has some of their own, fewer than there are in total: one
    /// person does not shut the others out.
    pub(crate) fn bind(self: &Arc<Self>, session: Secret, remote: &RemoteAccess) {
        if self.session.lock().replace(session.clone()).is_some() {
            return;
        }
        drop(self.place.lock().take());
        if self.is_stop {
            self.hold_place(remote.stop_seats.enter(self.address));
        } else {
            let mut place = remote.visitors.enter(session);
            self.end_with(place.take_end());
            *self.visitor_place.lock() = Some(place);
        }
    }

    /// The session with which it ends.
    pub(crate) fn session(&self) -> Option<Secret> {
        self.session.lock().clone()
    }

    /// Ends it, also what a WebSocket or a stream of events has made of it.
    pub(crate) fn cut(&self) {
        self.is_cut.store(true, Ordering::Release);
        self.waiting.wake();
    }

    /// Whether the thread for STOP serves it.
    pub(crate) fn is_stop(&self) -> bool {
        self.is_stop
    }

    /// Whether it was ended.
    pub(crate) fn is_cut(&self) -> bool {
        self.is_cut.load(Ordering::Acquire)
    }

    /// Is ready once it was ended; wakes the task then.
    pub(crate) fn poll_cut(&self, context: &Context<'_>) -> Poll<()> {
        self.waiting.register(context.waker());
        if self.is_cut() { Poll::Ready(()) } else { Poll::Pending }
    }
}
