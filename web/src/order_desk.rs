//! Orders to the mission, one after the other on a thread of their own.

use std::io;
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::thread;
use std::time::Duration;

use armor_sdk::control::Order;
use armor_sdk::directory::Directory;
use armor_sdk::operator::{Operator, OrderError, OrderVerdict};
use axum::http::StatusCode;
use tokio::sync::oneshot;

use crate::failure::WebFailure;

/// How long an order may wait for the executive's answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// Orders that wait; more means that the executive does not answer.
const MAX_WAITING: usize = 16;

type Reply = oneshot::Sender<Result<OrderVerdict, OrderError>>;

struct WaitingOrder {
    author: Option<String>,
    take: bool,
    order: Order,
    reply: Reply,
}

/// Sends orders to the executive. Two desks do not wait for each other.
pub(crate) struct OrderDesk {
    waiting: SyncSender<WaitingOrder>,
}

impl OrderDesk {
    /// Starts the thread. `from` is the program, as the executive names it, and `author` who gives
    /// an order that names no one. The executive is not connected to before the first order.
    pub(crate) fn open(directory: &Directory, from: &str, author: &str) -> io::Result<Self> {
        let (waiting, orders) = mpsc::sync_channel(MAX_WAITING);
        let from = format!("{from}, process {}", std::process::id());
        let (directory, author) = (directory.clone(), author.to_owned());
        thread::Builder::new()
            .name("web-orders".into())
            .spawn(move || send_orders(&orders, &directory, &from, &author))?;
        Ok(Self { waiting })
    }

    /// Sends an order; `take` takes the command over from its holder.
    pub(crate) async fn send(
        &self,
        author: Option<String>,
        take: bool,
        order: Order,
    ) -> Result<OrderVerdict, WebFailure> {
        let (reply, answer) = oneshot::channel();
        let waiting = WaitingOrder { author, take, order, reply };
        let fail = |what: String| {
            let remedy = "see with `armor ps` whether the executive answers, and try again";
            WebFailure::new(StatusCode::BAD_GATEWAY, what, "the mission", remedy)
        };
        self.waiting.try_send(waiting).map_err(|error| match error {
            TrySendError::Full(_) => fail(format!("{MAX_WAITING} orders wait for an answer")),
            TrySendError::Disconnected(_) => fail("orders are no longer sent".into()),
        })?;
        match answer.await {
            Ok(Ok(verdict)) => Ok(verdict),
            Ok(Err(error)) => Err(fail(error.to_string())),
            Err(_) => Err(fail("the thread that sends orders has ended".into())),
        }
    }
}

fn send_orders(orders: &Receiver<WaitingOrder>, directory: &Directory, from: &str, author: &str) {
    // Kept, because an order over an open connection takes a fraction of a millisecond.
    let mut own = Operator::new(directory.clone(), from, author);
    while let Ok(WaitingOrder { author: named, take, order, reply }) = orders.recv() {
        let verdict = match named {
            None => own.order(take, &order, ANSWER_WITHIN),
            Some(named) => {
                let mut other = Operator::new(directory.clone(), from, &named);
                other.order(take, &order, ANSWER_WITHIN)
            }
        };
        // A client that has left needs no answer; the journal has it.
        let _ = reply.send(verdict);
    }
}
