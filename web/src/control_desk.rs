//! Who is in control of the robot: one client at a time.

use std::sync::Arc;

use armor_socket::random_id;
use parking_lot::Mutex;
use tokio::sync::{Notify, watch};

struct Holder {
    token: String,
    /// Notified when another client takes control.
    replaced: Arc<Notify>,
}

/// Knows who is in control.
pub(crate) struct ControlDesk {
    holder: Mutex<Option<Holder>>,
    news: watch::Sender<u64>,
}

/// Control, until it is dropped or another client takes it.
pub(crate) struct ControlSeat {
    desk: Arc<ControlDesk>,
    /// What the holder proves with that it is in control.
    pub(crate) token: String,
    /// Notified when another client takes control.
    pub(crate) replaced: Arc<Notify>,
}

impl ControlDesk {
    /// Returns a desk without a holder; `news` is raised at every change.
    pub(crate) fn new(news: watch::Sender<u64>) -> Self {
        Self { holder: Mutex::default(), news }
    }

    /// Returns whether a client is in control.
    pub(crate) fn is_held(&self) -> bool {
        self.holder.lock().is_some()
    }

    /// Returns whether the client with this token is in control.
    pub(crate) fn is_holder(&self, token: &str) -> bool {
        self.holder.lock().as_ref().is_some_and(|holder| holder.token == token)
    }

    /// Takes control; `None` if another client has it, unless that is to lose it.
    pub(crate) fn take(self: &Arc<Self>, is_forced: bool) -> Option<ControlSeat> {
        let mut holder = self.holder.lock();
        if holder.is_some() && !is_forced {
            return None;
        }
        let token = format!("{:016x}{:016x}", random_id(), random_id());
        let replaced = Arc::new(Notify::new());
        let new = Holder { token: token.clone(), replaced: Arc::clone(&replaced) };
        if let Some(before) = holder.replace(new) {
            before.replaced.notify_one();
        }
        drop(holder);
        self.raise_news();
        Some(ControlSeat { desk: Arc::clone(self), token, replaced })
    }

    fn raise_news(&self) {
        self.news.send_modify(|news| *news += 1);
    }
}

impl Drop for ControlSeat {
    fn drop(&mut self) {
        let mut holder = self.desk.holder.lock();
        if holder.as_ref().is_some_and(|holder| holder.token == self.token) {
            *holder = None;
            drop(holder);
            self.desk.raise_news();
        }
    }
}
