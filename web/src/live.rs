//! The live WebSocket: several data at the same time, each at its own rate.
//!
//! A client that reads slowly gets the newest value of each; the values that it did not get are
//! counted (`dropped`), and it uses no more memory than one value of each. Values that are left out
//! because the client asked for a lower rate are no loss.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::response::Response;
use parking_lot::Mutex;
use serde::Deserialize;
use serde_json::json;
use tokio::sync::{Notify, watch};
use tokio::task::JoinHandle;
use tokio::time::{Instant, interval, sleep_until, timeout};

use crate::data_hub::{ChannelLook, Sample};
use crate::data_routes::{describe_header, describe_sample};
use crate::failure::WebFailure;
use crate::web_state::WebState;

/// Longest message of a client, in bytes.
pub(crate) const WEB_SOCKET_LIMIT: usize = 64 << 10;
/// The lowest rate that a client may ask for.
pub(crate) const MIN_HZ: f64 = 0.01;
/// The highest rate that a client may ask for.
pub(crate) const MAX_HZ: f64 = 100.0;
/// Data of one client.
const MAX_SUBSCRIPTIONS: usize = 64;
/// Time within which a client must take a message.
const TAKEN_WITHIN: Duration = Duration::from_secs(20);
/// Time between two pings, by which a client that is gone is noticed.
const PING_EVERY: Duration = Duration::from_secs(10);
/// Time without a sign of a client after which it is disconnected.
const SILENCE: Duration = Duration::from_secs(30);
/// The system, as if it were data.
const SYSTEM: &str = "system";
/// The mission, as if it were data.
const MISSION: &str = "mission";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LiveRequest {
    #[serde(default)]
    subscribe: Vec<WantedData>,
    #[serde(default)]
    unsubscribe: Vec<String>,
    /// Returned in the answer.
    ping: Option<u64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WantedData {
    name: String,
    #[serde(default = "default_hz")]
    max_hz: f64,
    /// Without it only the arrival is announced, for data whose image is fetched.
    #[serde(default = "default_values")]
    values: bool,
}

fn default_hz() -> f64 {
    10.0
}

fn default_values() -> bool {
    true
}

/// What is to be sent to a client about one name.
enum LiveUpdate {
    Value(Arc<Sample>),
    /// Only the header of the value.
    Arrival(Arc<Sample>),
    Problem(String),
    /// The system or the mission.
    Text(Arc<str>),
}

/// The newest update of each name that has not been sent yet.
#[derive(Default)]
struct Outbox {
    waiting: Mutex<WaitingUpdates>,
    arrived: Notify,
}

#[derive(Default)]
struct WaitingUpdates {
    updates: BTreeMap<String, LiveUpdate>,
    /// Names with an update, the one that has waited longest first.
    order: VecDeque<String>,
    /// Updates of each name that were replaced before they were sent.
    dropped: BTreeMap<String, u64>,
}

impl Outbox {
    fn put(&self, name: &str, update: LiveUpdate, web: &WebState) {
        let mut waiting = self.waiting.lock();
        if waiting.updates.insert(name.to_owned(), update).is_some() {
            *waiting.dropped.entry(name.to_owned()).or_default() += 1;
            web.counters.dropped.fetch_add(1, Ordering::Relaxed);
        } else {
            waiting.order.push_back(name.to_owned());
        }
        drop(waiting);
        self.arrived.notify_one();
    }

    fn forget(&self, name: &str) {
        let mut waiting = self.waiting.lock();
        waiting.updates.remove(name);
        waiting.dropped.remove(name);
        waiting.order.retain(|other| other != name);
    }

    async fn take(&self) -> String {
        loop {
            if let Some(text) = self.try_take() {
                return text;
            }
            self.arrived.notified().await;
        }
    }

    fn try_take(&self) -> Option<String> {
        let mut waiting = self.waiting.lock();
        let name = waiting.order.pop_front()?;
        let update = waiting.updates.remove(&name)?;
        let dropped = waiting.dropped.get(&name).copied().unwrap_or_default();
        drop(waiting);
        Some(update.to_text(&name, dropped))
    }
}

impl LiveUpdate {
    fn to_text(&self, name: &str, dropped: u64) -> String {
        let counted = |mut text: String| {
            text.truncate(text.len() - 1);
            format!("{text},\"dropped\":{dropped}}}")
        };
        match self {
            Self::Value(sample) => match describe_sample(name, sample) {
                Ok(text) => counted(text),
                Err(failure) => describe_problem(name, failure.to_json().to_string()),
            },
            Self::Arrival(sample) => counted(describe_header(name, sample) + "}"),
            Self::Problem(problem) => json!({"name": name, "problem": problem}).to_string(),
            Self::Text(text) => {
                format!("{{\"name\":\"{name}\",\"dropped\":{dropped},\"value\":{text}}}")
            }
        }
    }
}

fn describe_problem(name: &str, error: String) -> String {
    json!({"name": name, "problem": error}).to_string()
}

/// `GET /api/live`.
pub(crate) async fn hold_live(
    State(web): State<Arc<WebState>>,
    upgrade: WebSocketUpgrade,
) -> Response {
    let upgrade = upgrade
        .max_message_size(WEB_SOCKET_LIMIT)
        .max_frame_size(WEB_SOCKET_LIMIT)
        .write_buffer_size(0);
    upgrade.on_upgrade(move |socket| async move {
        let mut client = LiveClient { web, outbox: Arc::default(), feeds: BTreeMap::new() };
        client.serve(socket).await;
    })
}

struct LiveClient {
    web: Arc<WebState>,
    outbox: Arc<Outbox>,
    feeds: BTreeMap<String, JoinHandle<()>>,
}

impl Drop for LiveClient {
    fn drop(&mut self) {
        self.feeds.values().for_each(JoinHandle::abort);
    }
}

impl LiveClient {
    async fn serve(&mut self, mut socket: WebSocket) {
        let outbox = Arc::clone(&self.outbox);
        let mut pings = interval(PING_EVERY);
        let mut heard = Instant::now();
        loop {
            let message = tokio::select! {
                message = socket.recv() => {
                    heard = Instant::now();
                    match message {
                        Some(Ok(Message::Text(text))) => match self.handle_request(&text) {
                            Some(answer) => Message::text(answer),
                            None => continue,
                        },
                        Some(Ok(Message::Binary(_) | Message::Ping(_) | Message::Pong(_))) => continue,
                        Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                    }
                }
                text = outbox.take() => Message::text(text),
                _ = pings.tick() => {
                    if heard.elapsed() > SILENCE {
                        return;
                    }
                    Message::Ping(Default::default())
                }
            };
            // While the client takes nothing, newer values replace those that wait.
            if !matches!(timeout(TAKEN_WITHIN, socket.send(message)).await, Ok(Ok(()))) {
                return;
            }
        }
    }

    fn handle_request(&mut self, text: &str) -> Option<String> {
        let request = match serde_json::from_str::<LiveRequest>(text) {
            Ok(request) => request,
            Err(error) => {
                let remedy = "send {\"subscribe\": [{\"name\": \"COMPONENT.OUTPUT\", \
                              \"max_hz\": 5}]} or {\"unsubscribe\": [\"COMPONENT.OUTPUT\"]}";
                let failure = WebFailure::bad(error.to_string(), "the message", remedy);
                return Some(failure.to_json().to_string());
            }
        };
        for name in &request.unsubscribe {
            if let Some(feed) = self.feeds.remove(name) {
                feed.abort();
                self.outbox.forget(name);
            }
        }
        for wanted in request.subscribe {
            if let Err(failure) = self.subscribe(wanted) {
                return Some(failure.to_json().to_string());
            }
        }
        request.ping.map(|ping| json!({"pong": ping}).to_string())
    }

    fn subscribe(&mut self, wanted: WantedData) -> Result<(), WebFailure> {
        let WantedData { name, max_hz, values } = wanted;
        if !(MIN_HZ..=MAX_HZ).contains(&max_hz) {
            let remedy = format!("a rate from {MIN_HZ} to {MAX_HZ}");
            return Err(WebFailure::bad("this rate cannot be had", "the field `max_hz`", remedy));
        }
        if !self.feeds.contains_key(&name) && self.feeds.len() >= MAX_SUBSCRIPTIONS {
            let what = format!("{MAX_SUBSCRIPTIONS} data are subscribed to already");
            return Err(WebFailure::bad(what, "the field `subscribe`", "unsubscribe from some"));
        }
        let (web, outbox) = (Arc::clone(&self.web), Arc::clone(&self.outbox));
        let period = Duration::from_secs_f64(1.0 / max_hz);
        let feed = match name.as_str() {
            SYSTEM => {
                let news = web.system_news.subscribe();
                let compose = |web: &WebState| web.system_text();
                tokio::spawn(feed_texts(web, outbox, SYSTEM, news, period, compose))
            }
            MISSION => {
                let news = web.mission_news.subscribe();
                let compose = |web: &WebState| web.mission_text();
                tokio::spawn(feed_texts(web, outbox, MISSION, news, period, compose))
            }
            _ => {
                let looks = web.hub.follow(&name)?;
                let feed = DataFeed { web, outbox, name: name.clone(), period, values };
                tokio::spawn(feed.run(looks))
            }
        };
        if let Some(before) = self.feeds.insert(name, feed) {
            before.abort();
        }
        Ok(())
    }
}

/// Puts the newest value of one output into the outbox, at most once per period.
struct DataFeed {
    web: Arc<WebState>,
    outbox: Arc<Outbox>,
    name: String,
    period: Duration,
    values: bool,
}

impl DataFeed {
    async fn run(self, mut looks: watch::Receiver<ChannelLook>) {
        looks.mark_changed();
        while looks.changed().await.is_ok() {
            let look = looks.borrow_and_update().clone();
            let update = match look.sample {
                _ if !look.problem.is_empty() => LiveUpdate::Problem(look.problem),
                Some(sample) if self.values => LiveUpdate::Value(sample),
                Some(sample) => LiveUpdate::Arrival(sample),
                None => continue,
            };
            self.outbox.put(&self.name, update, &self.web);
            sleep_until(Instant::now() + self.period).await;
        }
    }
}

async fn feed_texts(
    web: Arc<WebState>,
    outbox: Arc<Outbox>,
    name: &'static str,
    mut news: watch::Receiver<u64>,
    period: Duration,
    compose: impl Fn(&WebState) -> Arc<str>,
) {
    news.mark_changed();
    while news.changed().await.is_ok() {
        news.mark_unchanged();
        outbox.put(name, LiveUpdate::Text(compose(&web)), &web);
        sleep_until(Instant::now() + period).await;
    }
}
