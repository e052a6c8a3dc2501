//! Orders to the process that plays a recording, on their way from its control connections.

use std::sync::mpsc::{self, Receiver, Sender};

use armor_wire::control::{Answer, PlaybackOrder};
use parking_lot::Mutex;

/// An order as it has arrived.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenPlaybackOrder {
    /// The connection to which the answer goes.
    pub connection: u64,
    /// Names the answer.
    pub request: u64,
    /// The order.
    pub order: PlaybackOrder,
}

/// Passes orders on to the player, if the process is one.
#[derive(Debug, Default)]
pub(crate) struct PlaybackInbox(Mutex<Option<Sender<GivenPlaybackOrder>>>);

impl PlaybackInbox {
    /// Accepts orders from now on. Returns where they arrive.
    pub fn accept_orders(&self) -> Receiver<GivenPlaybackOrder> {
        let (sender, receiver) = mpsc::channel();
        *self.0.lock() = Some(sender);
        receiver
    }

    /// Passes an order on; its answer comes later. Returns the answer if it is refused.
    pub fn submit_order(&self, given: GivenPlaybackOrder) -> Option<Answer> {
        let request = given.request;
        let is_taken = self.0.lock().as_ref().is_some_and(|sender| sender.send(given).is_ok());
        (!is_taken).then(|| Answer::Ordered {
            request,
            accepted: false,
            text: "it plays no recording".into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_player_takes_orders() {
        let inbox = PlaybackInbox::default();
        let given = GivenPlaybackOrder { connection: 1, request: 2, order: PlaybackOrder::Pause };
        let refused = inbox.submit_order(given.clone());
        assert!(matches!(refused, Some(Answer::Ordered { request: 2, accepted: false, .. })));
        let orders = inbox.accept_orders();
        assert_eq!(inbox.submit_order(given.clone()), None);
        assert_eq!(orders.recv(), Ok(given.clone()));
        drop(orders);
        assert!(inbox.submit_order(given).is_some(), "it has ended");
    }
}
