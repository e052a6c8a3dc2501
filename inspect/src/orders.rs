//! An operator's orders, sent one after the other on a thread of their own, and the executive's
//! answers. The executive is not connected to before the first order.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

use armor_sdk::control::Order;
use armor_sdk::directory::Directory;
use armor_sdk::operator::Operator;
use parking_lot::Mutex;

use crate::wake::{WakeCallback, spawn_detached};

/// How long an order may wait for its answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// Time between two checks of the command holder's link.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// How long one attempt waits to get the command back while the executive restarts.
const COME_BACK_WITHIN: Duration = Duration::from_secs(2);
/// Orders remembered with their answers.
const MAX_GIVEN: usize = 100;

/// An order and its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct SentOrder {
    /// The order as text.
    pub order: String,
    /// Name of the operator who gave it.
    pub author: String,
    /// Whether it was accepted; `None` while it waits for its answer.
    pub accepted: Option<bool>,
    /// Its consequence, or why it was refused or not answered.
    pub text: String,
    /// The order to repeat with `take`, if it was refused only because another operator has the
    /// command.
    pub if_taken: Option<Order>,
}

/// Sends orders. Releases the command when dropped.
pub struct OrderSender {
    wanted: Sender<QueuedOrder>,
    shared: Arc<SharedOrders>,
}

struct QueuedOrder {
    number: u64,
    author: String,
    take: bool,
    order: Order,
}

#[derive(Default)]
struct SharedOrders {
    state: Mutex<OrderState>,
}

#[derive(Default)]
struct OrderState {
    given: VecDeque<(u64, SentOrder)>,
    count: u64,
    holds: bool,
}

impl OrderSender {
    /// Starts the thread that sends orders; `from` is the program, as the executive names it, and
    /// `wake` is called at every answer.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn open(directory: &Directory, from: &str, wake: WakeCallback) -> io::Result<Self> {
        let (wanted, orders) = mpsc::channel();
        let shared = Arc::<SharedOrders>::default();
        let sender = OrderThread {
            directory: directory.clone(),
            from: format!("{from}, process {}", std::process::id()),
            shared: Arc::clone(&shared),
            wake,
            operator: None,
        };
        spawn_detached("look-orders", move || sender.send_orders(&orders))?;
        Ok(Self { wanted, shared })
    }

    /// Sends an order in the name of `author`; `take` takes the command over from its present
    /// holder.
    pub fn give(&self, author: &str, take: bool, order: Order) {
        let mut state = self.shared.state.lock();
        state.count += 1;
        let number = state.count;
        let given = SentOrder {
            order: order_text(&order),
            author: author.into(),
            accepted: None,
            text: String::new(),
            if_taken: None,
        };
        state.given.push_back((number, given));
        while state.given.len() > MAX_GIVEN {
            state.given.pop_front();
        }
        drop(state);
        let wanted = QueuedOrder { number, author: author.into(), take, order };
        if self.wanted.send(wanted).is_err() {
            self.shared.record_answer(number, false, "orders are no longer accepted here", None);
        }
    }

    /// Returns the orders sent here, the newest last.
    pub fn given(&self) -> Vec<SentOrder> {
        self.shared.state.lock().given.iter().map(|(_, given)| given.clone()).collect()
    }

    /// Returns whether this program holds the command.
    pub fn holds(&self) -> bool {
        self.shared.state.lock().holds
    }
}

impl SharedOrders {
    fn record_answer(&self, number: u64, accepted: bool, text: &str, if_taken: Option<Order>) {
        let mut state = self.state.lock();
        if let Some((_, given)) = state.given.iter_mut().find(|(other, _)| *other == number) {
            (given.accepted, given.text, given.if_taken) = (Some(accepted), text.into(), if_taken);
        }
    }
}

/// The thread that sends the orders.
struct OrderThread {
    directory: Directory,
    from: String,
    shared: Arc<SharedOrders>,
    wake: WakeCallback,
    operator: Option<(String, Operator)>,
}

impl OrderThread {
    fn send_orders(mut self, orders: &Receiver<QueuedOrder>) {
        loop {
            match orders.recv_timeout(LOOK_EVERY) {
                Ok(wanted) => self.send_order(wanted),
                Err(RecvTimeoutError::Timeout) => self.keep_command(),
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        if self.shared.state.lock().holds
            && let Some((_, operator)) = &mut self.operator
        {
            // Without a release the closed connection would count as a lost link.
            let _ = operator.order(false, &Order::Release, COME_BACK_WITHIN);
        }
    }

    fn send_order(&mut self, wanted: QueuedOrder) {
        let QueuedOrder { number, author, take, order } = wanted;
        let operator = self.operator_of(&author);
        let answer = operator.order(take, &order, ANSWER_WITHIN);
        match answer {
            Ok(verdict) => {
                let accepted = verdict.accepted;
                if accepted && matches!(order, Order::Lease | Order::Release) {
                    self.shared.state.lock().holds = order == Order::Lease;
                }
                let could = !accepted && !take && verdict.text.ends_with("take it over");
                self.shared.record_answer(number, accepted, &verdict.text, could.then_some(order));
            }
            Err(error) => self.shared.record_answer(number, false, &error.to_string(), None),
        }
        (self.wake)();
    }

    /// Returns the connection of `author`. Each author has one of their own, because the command
    /// belongs to the author of the order.
    fn operator_of(&mut self, author: &str) -> &mut Operator {
        let is_other = self.operator.as_ref().is_none_or(|(before, _)| before != author);
        if is_other {
            self.shared.state.lock().holds = false;
            self.operator = None;
        }
        let (directory, from) = (&self.directory, &self.from);
        let fresh = || (author.to_owned(), Operator::new(directory.clone(), from, author));
        &mut self.operator.get_or_insert_with(fresh).1
    }

    /// Keeps the command after a restart of the executive or a broken link, if the connection is
    /// back in time. Notices if another operator has taken the command over.
    fn keep_command(&mut self) {
        if !self.shared.state.lock().holds {
            return;
        }
        let Some((_, operator)) = &mut self.operator else { return };
        if !operator.is_connected() && operator.lost().is_none() {
            // An unanswered attempt is repeated; `lost` reports when it is too late.
            let _ = operator.order(false, &Order::Rejoin, COME_BACK_WITHIN);
        }
        if operator.lost().is_some() {
            self.shared.state.lock().holds = false;
            (self.wake)();
        }
    }
}

/// Returns an order as text.
fn order_text(order: &Order) -> String {
    match order {
        Order::Lease => "take the command".into(),
        Order::Rejoin => "keep the command".into(),
        Order::Release => "give the command back".into(),
        Order::Fire { transition } => format!("fire {transition}"),
        Order::Pause => "pause".into(),
        Order::Resume => "resume".into(),
        Order::Safe => "go to the safe place".into(),
        Order::Move { moves } => {
            let moves = moves.iter().map(|it| format!("{} {} to {}", it.tokens, it.from, it.to));
            format!("move {}", moves.collect::<Vec<_>>().join(", "))
        }
        Order::Confirm { transition } => format!("confirm {transition}"),
        Order::Decline { transition } => format!("decline {transition}"),
    }
}

/// Returns `user@host`, as far as it is known: the default author of orders.
pub fn this_user() -> String {
    let mut named = ["USER", "LOGNAME"].iter().filter_map(|name| std::env::var(name).ok());
    let user = named.find(|user| !user.is_empty());
    let id = rustix::process::getuid().as_raw();
    // A service or a container has no such variable.
    let user = user.or_else(|| find_user(&std::fs::read_to_string("/etc/passwd").ok()?, id));
    let user = user.unwrap_or_else(|| format!("user {id}"));
    format!("{user}@{}", rustix::system::uname().nodename().to_string_lossy())
}

/// Returns the name of a user in the text of `/etc/passwd`.
fn find_user(passwd: &str, id: u32) -> Option<String> {
    let is_it = |line: &&str| line.split(':').nth(2) == Some(id.to_string().as_str());
    passwd.lines().find(is_it)?.split(':').next().map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_without_variables_has_the_name_of_the_account() {
        let passwd = "root:x:0:0:root:/root:/bin/sh\nruth:x:1000:1000::/home/ruth:/bin/sh\n";
        assert_eq!(find_user(passwd, 1000).as_deref(), Some("ruth"));
        assert_eq!(find_user(passwd, 100), None);
    }
}
