//! STOP: published to the robot if a component takes it, otherwise a pause of the mission.

use std::io;
use std::sync::Arc;
use std::time::SystemTime;

use armor_sdk::control::Order;
use armor_sdk::directory::Directory;
use armor_sdk::operator::OrderVerdict;
use armor_sdk::orders::Repeats;
use axum::http::StatusCode;
use parking_lot::Mutex;
use serde_json::{Value, json};
use tokio::sync::watch;

use crate::commands::RobotCommands;
use crate::failure::WebFailure;
use crate::launcher_question::LauncherQuestion;
use crate::order_desk::OrderDesk;

/// How STOP reached the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StopMeans {
    /// Components took it as data.
    Published,
    /// The executive paused the mission, which freezes the components of the marked places.
    Paused,
}

#[derive(Clone, Copy, Debug)]
struct StopOrder {
    means: StopMeans,
    is_stopped: bool,
    at_s: f64,
}

/// Which orders were logged: a flood must fill no log.
#[derive(Debug, Default)]
struct LoggedOrders {
    /// Whether the last order was STOP.
    is_stop: Option<bool>,
    /// The same order again, by author.
    repeats: Repeats<String>,
}

impl LoggedOrders {
    /// Notes an order; returns what is to be logged. The first order of each author is, and the first
    /// one after another order.
    fn note(&mut self, author: &str, is_stop: bool) -> Option<String> {
        if self.is_stop.replace(is_stop) != Some(is_stop) {
            self.repeats.clear();
        }
        let what = if is_stop { "orders STOP" } else { "releases STOP" };
        match self.repeats.note(author.to_owned())? {
            1 => Some(format!("{author} {what}")),
            count => Some(format!("{author} {what}, {count} times meanwhile")),
        }
    }
}

/// Orders STOP and its release. It shares no thread and no connection with any other route.
pub(crate) struct StopDesk {
    commands: Option<Arc<dyn RobotCommands>>,
    orders: OrderDesk,
    launcher: LauncherQuestion,
    /// The last order of this process; none: it is not known whether the robot is stopped.
    last: Mutex<Option<StopOrder>>,
    logged: Mutex<LoggedOrders>,
    news: watch::Sender<u64>,
}

impl StopDesk {
    /// Opens the desk; `news` is raised at every change.
    pub(crate) fn open(
        directory: &Directory,
        launcher: LauncherQuestion,
        author: &str,
        commands: Option<Arc<dyn RobotCommands>>,
        news: watch::Sender<u64>,
    ) -> io::Result<Self> {
        let orders = OrderDesk::open(directory, "the STOP of armor web", author)?;
        let (last, logged) = (Mutex::default(), Mutex::default());
        Ok(Self { commands, orders, launcher, last, logged, news })
    }

    /// Returns whether STOP is in force, as far as this process knows; `is_paused` is the mission's
    /// state.
    pub(crate) fn is_stopped(&self, is_paused: bool) -> bool {
        self.last.lock().is_some_and(|last| {
            last.is_stopped && (last.means == StopMeans::Published || is_paused)
        })
    }

    /// Returns its state for clients.
    pub(crate) fn to_json(&self, is_paused: bool) -> Value {
        let Some(last) = *self.last.lock() else { return json!({"ordered": null}) };
        json!({
            "ordered": self.is_stopped(is_paused),
            "means": last.means.word(),
            "at_s": last.at_s,
        })
    }

    /// Orders STOP, and returns what was done. `author`: who, if not the user of the system;
    /// `has_executive`: whether one is registered. It is called only after STOP could not be published,
    /// which waits for no lock.
    pub(crate) async fn stop(
        &self,
        author: Option<String>,
        has_executive: impl Fn() -> bool,
    ) -> Result<Value, WebFailure> {
        self.log_order(author.as_deref(), true);
        let published = self.commands.as_ref().map(|commands| commands.stop(true));
        if let Some(Ok(links @ 1..)) = published {
            self.record(StopMeans::Published, true);
            let text = format!("STOP was sent over {}", count_links(links));
            return Ok(json!({"stopped": true, "means": "published", "text": text}));
        }
        let why_not = match published {
            None => "no component of this program publishes STOP".to_owned(),
            Some(Ok(_)) => "no component takes STOP from here".to_owned(),
            Some(Err(error)) => error,
        };
        // An executive that is being started gets the order as soon as it can take it, which may last
        // seconds; only the launcher knows that none will come.
        if !has_executive() && self.launcher.rules_out_executive().await {
            return Err(WebFailure::new(
                StatusCode::BAD_GATEWAY,
                format!(
                    "STOP is not delivered: {why_not}, and no mission runs that could be paused"
                ),
                "the robot",
                "it may be moving: use the switch on the robot, or end the system with `armor stop \
                 --all`; for STOP from here, link the output `stop` of a component `web-view` to \
                 what drives the robot",
            ));
        }
        let (status, text) = match self.orders.send(author, false, Order::Pause).await {
            // Also accepted if the mission is paused already.
            Ok(OrderVerdict { accepted: true, text, .. }) => {
                self.record(StopMeans::Paused, true);
                let means = StopMeans::Paused.word();
                return Ok(json!({"stopped": true, "means": means, "text": text, "note": why_not}));
            }
            Ok(verdict) => (StatusCode::BAD_GATEWAY, verdict.text),
            // It may have been carried out, so a client that keeps an order sends it again.
            Err(failure) => (StatusCode::GATEWAY_TIMEOUT, failure.what().to_owned()),
        };
        Err(WebFailure::new(
            status,
            format!("STOP is not delivered: {why_not}; the mission is not paused: {text}"),
            "the robot",
            "it may be moving: use the switch on the robot",
        ))
    }

    /// Releases STOP by the means by which it was ordered, and returns what was done.
    pub(crate) async fn release(&self, author: Option<String>) -> Result<Value, WebFailure> {
        self.log_order(author.as_deref(), false);
        let means = self.last.lock().map(|last| last.means);
        match (means, &self.commands) {
            (Some(StopMeans::Published) | None, Some(commands)) => {
                let links = commands.stop(false).map_err(|error| {
                    let remedy = "try again; `armor ps` shows the components";
                    WebFailure::new(StatusCode::BAD_GATEWAY, error, "the robot", remedy)
                })?;
                self.record(StopMeans::Published, false);
                let text = format!("the release was sent over {}", count_links(links));
                Ok(json!({"stopped": false, "means": "published", "text": text}))
            }
            (Some(StopMeans::Paused), _) => {
                let verdict = self.orders.send(author, false, Order::Resume).await?;
                if !verdict.accepted {
                    let remedy = "see with `armor mission show` who holds the command";
                    let status = StatusCode::CONFLICT;
                    return Err(WebFailure::new(status, verdict.text, "the mission", remedy));
                }
                self.record(StopMeans::Paused, false);
                Ok(json!({"stopped": false, "means": "paused", "text": verdict.text}))
            }
            _ => Err(WebFailure::new(
                StatusCode::CONFLICT,
                "STOP was not ordered here",
                "the robot",
                "a mission that another program has paused continues with the order `resume`",
            )),
        }
    }

    /// Logs who has ordered it: no journal has what is published to the robot.
    fn log_order(&self, author: Option<&str>, is_stop: bool) {
        let Some(author) = author else { return };
        let text = self.logged.lock().note(author, is_stop);
        if let Some(text) = text {
            tracing::info!("{text}");
        }
    }

    fn record(&self, means: StopMeans, is_stopped: bool) {
        let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let at_s = since_epoch.map_or(0.0, |time| time.as_secs_f64());
        *self.last.lock() = Some(StopOrder { means, is_stopped, at_s });
        self.news.send_modify(|news| *news += 1);
    }
}

fn count_links(links: usize) -> String {
    if links == 1 { "1 link".into() } else { format!("{links} links") }
}

impl StopMeans {
    fn word(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Paused => "paused",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_orders_of_several_persons_are_folded_and_each_change_is_logged() {
        let mut logged = LoggedOrders::default();
        let mut lines = Vec::new();
        for _ in 0..1000 {
            lines.extend(["olga", "bob"].iter().filter_map(|author| logged.note(author, true)));
        }
        assert_eq!(lines.len(), 20, "{lines:?}");
        assert_eq!(lines[..2], ["olga orders STOP", "bob orders STOP"]);
        assert_eq!(lines[18], "olga orders STOP, 512 times meanwhile");
        for is_stop in [false, true] {
            let what = if is_stop { "orders STOP" } else { "releases STOP" };
            assert_eq!(logged.note("bob", is_stop), Some(format!("bob {what}")));
        }
    }
}
