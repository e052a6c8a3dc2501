//! Orders to the mission, one after the other on a thread of their own.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::thread;
use std::time::Instant;

use armor_sdk::control::Order;
use armor_sdk::directory::Directory;
use armor_sdk::operator::{Operator, OrderVerdict};
use axum::http::StatusCode;
use parking_lot::Mutex;
use tokio::sync::oneshot;

use crate::failure::WebFailure;
use crate::order_queue::{OrderQueue, WaitingOrder, fail_order};

/// Sends orders to the executive. Two desks do not wait for each other.
pub(crate) struct OrderDesk {
    queue: Arc<Mutex<OrderQueue>>,
    /// Wakes the thread. One wake-up is enough for all orders that wait.
    wake: SyncSender<()>,
}

impl OrderDesk {
    /// Starts the thread. `from` is the program, as the executive names it, and `author` who gives
    /// an order that names no one. The executive is not connected to before the first order.
    pub(crate) fn open(directory: &Directory, from: &str, author: &str) -> io::Result<Self> {
        let (wake, woken) = mpsc::sync_channel(1);
        let queue = Arc::<Mutex<OrderQueue>>::default();
        let from = format!("{from}, process {}", std::process::id());
        let (directory, author) = (directory.clone(), author.to_owned());
        let waiting = Arc::clone(&queue);
        thread::Builder::new()
            .name("web-orders".into())
            .spawn(move || send_orders(&waiting, &woken, &directory, &from, &author))?;
        Ok(Self { queue, wake })
    }

    /// Sends an order; `take` takes the command over from its holder. The answer arrives within 5 s, of
    /// which the order may spend a part in the queue. If this future is dropped while the order waits
    /// there, only STOP is still sent.
    pub(crate) async fn send(
        &self,
        author: Option<String>,
        take: bool,
        order: Order,
    ) -> Result<OrderVerdict, WebFailure> {
        let (reply, answer) = oneshot::channel();
        let waiting = WaitingOrder { author, take, order, reply };
        self.queue.lock().push(waiting, Instant::now())?;
        let fail = |what: &str| fail_order(StatusCode::BAD_GATEWAY, what);
        if let Err(TrySendError::Disconnected(())) = self.wake.try_send(()) {
            return Err(fail("orders are no longer sent"));
        }
        answer.await.unwrap_or_else(|_| Err(fail("the thread that sends orders has ended")))
    }
}

fn send_orders(
    queue: &Mutex<OrderQueue>,
    woken: &Receiver<()>,
    directory: &Directory,
    from: &str,
    author: &str,
) {
    // Kept, because an order over an open connection takes a fraction of a millisecond.
    let mut own = Operator::new(directory.clone(), from, author);
    while woken.recv().is_ok() {
        loop {
            let next = queue.lock().take_next(Instant::now());
            let Some((WaitingOrder { author: named, take, order, reply }, left)) = next else {
                break;
            };
            let verdict = match named {
                None => own.order(take, &order, left),
                Some(named) => {
                    let mut other = Operator::new(directory.clone(), from, &named);
                    other.order(take, &order, left)
                }
            };
            let verdict =
                verdict.map_err(|error| fail_order(StatusCode::BAD_GATEWAY, error.to_string()));
            // A client that has left needs no answer; the journal has it.
            let _ = reply.send(verdict);
        }
    }
}
