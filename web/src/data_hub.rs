//! The data that clients look at: one link to each output, whatever the number of clients.
//!
//! A link is `keep="latest"`: this program misses data if it is slow, and never makes a provider
//! wait. It ends shortly after the last client has left.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use armor_sdk::directory::Directory;
use armor_sdk::tap::{Tap, TapData};
use armor_wire::keep::Keep;
use armor_wire::name::split_data;
use armor_wire::schema::{Schema, to_json};
use axum::http::StatusCode;
use parking_lot::Mutex;
use tokio::sync::watch;

use crate::failure::WebFailure;
use crate::histogram::TimeHistogram;
use crate::images::{WebImage, render_image};

/// The policy of every link: never `all`, for which the provider waits.
const KEEP: Keep = Keep::Latest;
/// Time after the last client until a link ends.
const LINGER: Duration = Duration::from_secs(3);
/// How long to wait for data before checking whether a client is left.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// How long one attempt waits for a provider.
const PROVIDER_WITHIN: Duration = Duration::from_secs(1);
/// Outputs linked at the same time; each takes a thread and one of its provider's places for tools.
const MAX_CHANNELS: usize = 128;
/// Longest message shown as JSON, in bytes: as a tree in memory it takes thirty times as much.
const MAX_JSON_PAYLOAD: usize = 1 << 20;
/// Stack of a link's thread, in bytes: it reads a socket.
const STACK_LEN: usize = 256 << 10;
/// A difference between two clocks, and no latency, in seconds.
const NO_LATENCY_S: f64 = 60.0;

/// One message of an output.
pub(crate) struct Sample {
    /// The message.
    pub(crate) data: TapData,
    /// Messages that were lost on this link so far.
    pub(crate) lost: u64,
    /// Name of its type.
    pub(crate) type_name: Arc<str>,
    schema: Arc<Schema>,
    json: OnceLock<Result<String, String>>,
    image: OnceLock<Result<WebImage, String>>,
}

impl Sample {
    /// Returns the message as JSON, converted once for all clients.
    pub(crate) fn json(&self) -> Result<&str, &str> {
        let convert = || {
            let len = self.data.payload.len();
            if len > MAX_JSON_PAYLOAD {
                return Err(format!(
                    "a message of {len} bytes is too long for JSON (at most {MAX_JSON_PAYLOAD})"
                ));
            }
            let value = to_json(&self.schema, &self.data.payload);
            value.map(|value| value.to_string()).map_err(|error| error.to_string())
        };
        self.json.get_or_init(convert).as_deref().map_err(String::as_str)
    }

    /// Returns the message as an image, made once for all clients.
    pub(crate) fn image(&self) -> Result<&WebImage, &str> {
        let render = || render_image(&self.schema, &self.type_name, &self.data.payload);
        self.image.get_or_init(render).as_ref().map_err(String::as_str)
    }
}

/// What a client of a link sees.
#[derive(Clone, Default)]
pub(crate) struct ChannelLook {
    /// The newest message.
    pub(crate) sample: Option<Arc<Sample>>,
    /// Why none arrives; empty while the link is up.
    pub(crate) problem: String,
}

type Channels = Arc<Mutex<BTreeMap<String, watch::Sender<ChannelLook>>>>;

/// All links.
pub(crate) struct DataHub {
    directory: Directory,
    channels: Channels,
    latencies: Arc<Mutex<BTreeMap<String, TimeHistogram>>>,
}

impl DataHub {
    /// Returns a hub without links.
    pub(crate) fn new(directory: Directory) -> Self {
        Self { directory, channels: Arc::default(), latencies: Arc::default() }
    }

    /// Follows an output; the first client makes the link.
    pub(crate) fn follow(&self, data: &str) -> Result<watch::Receiver<ChannelLook>, WebFailure> {
        if split_data(data).is_none() {
            return Err(WebFailure::bad(
                "this is no name of data",
                format!("data `{}`", data.escape_default()),
                "write COMPONENT.OUTPUT; GET /api/data lists all outputs",
            ));
        }
        let mut channels = self.channels.lock();
        if let Some(channel) = channels.get(data) {
            return Ok(channel.subscribe());
        }
        let busy = |why: String| {
            let remedy = "follow fewer outputs, and try again in a few seconds";
            WebFailure::new(StatusCode::SERVICE_UNAVAILABLE, why, format!("data `{data}`"), remedy)
        };
        if channels.len() >= MAX_CHANNELS {
            return Err(busy(format!("{MAX_CHANNELS} outputs are followed already")));
        }
        let (sender, receiver) = watch::channel(ChannelLook::default());
        let link = OutputLink {
            directory: self.directory.clone(),
            channels: Arc::clone(&self.channels),
            latencies: Arc::clone(&self.latencies),
            data: data.to_owned(),
            sender: sender.clone(),
            left: None,
            number: 0,
            lost: 0,
        };
        thread::Builder::new()
            .name("web-data".into())
            .stack_size(STACK_LEN)
            .spawn(move || link.follow_output())
            .map_err(|error| busy(format!("no thread could be started: {error}")))?;
        channels.insert(data.to_owned(), sender);
        Ok(receiver)
    }

    /// Returns how long messages of each followed output were on their way.
    pub(crate) fn latencies(&self) -> BTreeMap<String, TimeHistogram> {
        self.latencies.lock().clone()
    }

    /// Returns the number of links.
    pub(crate) fn link_count(&self) -> usize {
        self.channels.lock().len()
    }
}

/// The thread that follows one output.
struct OutputLink {
    directory: Directory,
    channels: Channels,
    latencies: Arc<Mutex<BTreeMap<String, TimeHistogram>>>,
    data: String,
    sender: watch::Sender<ChannelLook>,
    /// When the last client has left.
    left: Option<Instant>,
    /// Messages that have arrived.
    number: u64,
    lost: u64,
}

impl OutputLink {
    fn follow_output(mut self) {
        while !self.is_over() {
            match Tap::open(&self.directory, &self.data, KEEP, PROVIDER_WITHIN) {
                Ok(tap) => self.read_tap(tap),
                Err(error) => {
                    self.report_problem(error.to_string());
                    // A refusal arrives immediately: many clients with wrong names must not keep the
                    // registry busy.
                    thread::sleep(LOOK_EVERY);
                }
            }
        }
    }

    fn read_tap(&mut self, mut tap: Tap) {
        let (schema, type_name) = (Arc::new(tap.schema().clone()), Arc::from(tap.type_name()));
        while !self.is_over() {
            match tap.next(LOOK_EVERY) {
                Ok(Some(data)) => self.publish(data, &schema, &type_name),
                Ok(None) => {}
                Err(error) => return self.report_problem(error.to_string()),
            }
        }
    }

    fn publish(&mut self, data: TapData, schema: &Arc<Schema>, type_name: &Arc<str>) {
        self.number += 1;
        self.lost += data.lost;
        let latency_s = self.directory.clock().timestamp() - data.header.stamp_s;
        // The first is latched, and its age is no latency.
        if self.number > 1 && latency_s.abs() < NO_LATENCY_S {
            let mut latencies = self.latencies.lock();
            latencies.entry(self.data.clone()).or_default().add(latency_s);
        }
        let sample = Arc::new(Sample {
            data,
            lost: self.lost,
            type_name: Arc::clone(type_name),
            schema: Arc::clone(schema),
            json: OnceLock::new(),
            image: OnceLock::new(),
        });
        self.sender.send_replace(ChannelLook { sample: Some(sample), problem: String::new() });
    }

    /// The last message stays: it is still the newest.
    fn report_problem(&self, problem: String) {
        self.sender.send_if_modified(|look| {
            let is_new = look.problem != problem;
            look.problem = problem;
            is_new
        });
    }

    /// Returns whether the last client has left long ago. Removes the link then.
    fn is_over(&mut self) -> bool {
        if self.sender.receiver_count() > 0 {
            self.left = None;
            return false;
        }
        if self.left.get_or_insert_with(Instant::now).elapsed() < LINGER {
            return false;
        }
        let mut channels = self.channels.lock();
        // Under the lock, so that no client joins a link that ends.
        if self.sender.receiver_count() > 0 {
            return false;
        }
        channels.remove(&self.data);
        true
    }
}
