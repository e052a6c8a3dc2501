//! The data on those outputs that are displayed at the moment, and on no others.
//!
//! A display's link is `keep="latest"`: a slow window misses data, and neither delays the provider
//! nor makes it queue more than one message. The link ends shortly after the display does.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use armor_sdk::directory::Directory;
use armor_sdk::tap::{Tap, TapData};
use armor_wire::WireType;
use armor_wire::codec;
use armor_wire::frame::DataHeader;
use armor_wire::keep::Keep;
use armor_wire::schema::{Glimpse, PayloadError, Schema, ValuePath, glimpse_message};
use parking_lot::Mutex;

use crate::series::Series;
use crate::wake::{WakeCallback, spawn_detached};

/// The policy of a display's link: never `all`, which could make the provider wait.
const KEEP: Keep = Keep::Latest;
/// Time after the last look until a link ends.
const LINGER: Duration = Duration::from_secs(3);
/// How long to wait for data before checking whether the output is still displayed.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// How long one attempt waits for a provider.
const PROVIDER_WITHIN: Duration = Duration::from_secs(1);
/// Time over which a rate is taken.
const RATE_OVER: Duration = Duration::from_secs(2);

/// The outputs that are displayed.
pub struct WatchedValues {
    directory: Directory,
    channels: Arc<Channels>,
}

struct Channels {
    all: Mutex<HashMap<String, Channel>>,
    /// Values are kept whether or not they are displayed.
    is_kept: AtomicBool,
    is_closing: AtomicBool,
    wake: WakeCallback,
}

/// One output that is displayed.
struct Channel {
    /// Time of the last look.
    looked: Instant,
    /// The values that are plotted, by path.
    series: HashMap<String, Series>,
    schema: Option<Arc<Schema>>,
    type_name: String,
    last: Option<Arc<TapData>>,
    /// Arrivals within [`RATE_OVER`].
    arrivals: VecDeque<Instant>,
    lost: u64,
    problem: String,
}

/// The present state of an output.
#[derive(Clone, Debug)]
pub struct ValueLook {
    /// Name of its type; empty while its provider is not linked to.
    pub type_name: String,
    /// The layout of its data.
    pub schema: Option<Arc<Schema>>,
    /// The newest data.
    pub data: Option<Arc<TapData>>,
    /// Data arriving per second.
    pub rate_hz: f64,
    /// Data lost between the provider and this process.
    pub lost: u64,
    /// Why there are no data; empty if there are.
    pub problem: String,
}

impl ValueLook {
    /// Returns the first `lines` values of the newest data.
    ///
    /// # Errors
    /// If the data do not fit their own schema.
    pub fn glance(&self, lines: usize) -> Result<Vec<Glimpse>, PayloadError> {
        match (&self.schema, &self.data) {
            (Some(schema), Some(data)) => glimpse_message(schema, &data.payload, lines),
            _ => Ok(Vec::new()),
        }
    }
}

impl WatchedValues {
    /// Watches no output yet; `wake` is called when data have arrived.
    pub fn new(directory: Directory, wake: WakeCallback) -> Self {
        let channels = Channels {
            all: Mutex::default(),
            is_kept: AtomicBool::new(false),
            is_closing: AtomicBool::new(false),
            wake,
        };
        Self { directory, channels: Arc::new(channels) }
    }

    /// Returns the present state of `data`. The first look makes a link, and each look keeps it for
    /// another `LINGER`.
    pub fn look(&self, data: &str) -> ValueLook {
        self.with_channel(data, |channel| channel.present_look())
    }

    /// Calls `show` with the value at `path` of `data` over time, recorded since the first such
    /// call.
    pub fn series<R>(&self, data: &str, path: &str, show: impl FnOnce(&Series) -> R) -> R {
        self.with_channel(data, |channel| show(channel.series.entry(path.to_owned()).or_default()))
    }

    /// Forgets the recorded value at `path`.
    pub fn forget(&self, data: &str, path: &str) {
        if let Some(channel) = self.channels.all.lock().get_mut(data) {
            channel.series.remove(path);
        }
    }

    /// Shows this message as the newest on `data`, without a link: for tests.
    pub fn show_still<M: WireType>(&self, data: &str, message: &M) {
        let mut all = self.channels.all.lock();
        let channel = all.entry(data.to_owned()).or_insert_with(Channel::new);
        let sequence = channel.last.as_ref().map_or(0, |last| last.header.sequence + 1);
        let header = DataHeader { sequence, stamp_s: 0.0, instance: 1, fresh: false };
        let payload = codec::encode(message).unwrap_or_default();
        let name = std::any::type_name::<M>();
        channel.type_name = name.rsplit("::").next().unwrap_or(name).to_owned();
        channel.schema = Some(Arc::new(M::schema()));
        channel.last = Some(Arc::new(TapData { header, payload, lost: 0 }));
    }

    /// Returns the data that are linked now, sorted.
    pub fn linked(&self) -> Vec<String> {
        let mut linked: Vec<_> = self.channels.all.lock().keys().cloned().collect();
        linked.sort();
        linked
    }

    /// Keeps the present values even if they are not looked at again: a system that is out of reach
    /// sends nothing new, so its last values are the only ones. `false` ends that.
    pub fn keep(&self, is_kept: bool) {
        let mut all = self.channels.all.lock();
        all.values_mut().for_each(|channel| channel.looked = Instant::now());
        self.channels.is_kept.store(is_kept, Ordering::Relaxed);
    }

    /// Ends all links; the values stay as they were last seen.
    pub fn rest(&self) {
        self.channels.is_closing.store(true, Ordering::Relaxed);
    }

    fn with_channel<R>(&self, data: &str, show: impl FnOnce(&mut Channel) -> R) -> R {
        let mut all = self.channels.all.lock();
        if !all.contains_key(data) {
            let mut channel = Channel::new();
            if self.channels.is_closing.load(Ordering::Relaxed) {
                channel.problem = "it was not watched while the system ran".into();
                return show(&mut channel);
            }
            let link = ValueLink {
                directory: self.directory.clone(),
                channels: Arc::clone(&self.channels),
                data: data.into(),
            };
            if let Err(error) = spawn_detached("look-value", move || link.follow_output()) {
                channel.problem = format!("no thread could be started to watch it: {error}");
                return show(&mut channel);
            }
            all.insert(data.into(), channel);
        }
        let channel = all.get_mut(data).expect("it was inserted above");
        channel.looked = Instant::now();
        show(channel)
    }
}

impl Drop for WatchedValues {
    fn drop(&mut self) {
        self.rest();
    }
}

impl Channels {
    /// Returns whether the link to `data` must end. Forgets a channel that is no longer displayed.
    fn is_over(&self, data: &str) -> bool {
        let mut all = self.all.lock();
        if self.is_closing.load(Ordering::Relaxed) {
            return true;
        }
        if self.is_kept.load(Ordering::Relaxed) {
            return false;
        }
        let is_over = all.get(data).is_none_or(|channel| channel.looked.elapsed() > LINGER);
        if is_over {
            all.remove(data);
        }
        is_over
    }
}

impl Channel {
    fn new() -> Self {
        Self {
            looked: Instant::now(),
            series: HashMap::new(),
            schema: None,
            type_name: String::new(),
            last: None,
            arrivals: VecDeque::new(),
            lost: 0,
            problem: String::new(),
        }
    }

    fn present_look(&mut self) -> ValueLook {
        self.forget_arrivals();
        ValueLook {
            type_name: self.type_name.clone(),
            schema: self.schema.clone(),
            data: self.last.clone(),
            rate_hz: self.arrivals.len() as f64 / RATE_OVER.as_secs_f64(),
            lost: self.lost,
            problem: self.problem.clone(),
        }
    }

    fn forget_arrivals(&mut self) {
        while self.arrivals.front().is_some_and(|arrival| arrival.elapsed() > RATE_OVER) {
            self.arrivals.pop_front();
        }
    }

    fn add_data(&mut self, schema: &Schema, data: TapData) {
        for (path, series) in &mut self.series {
            let value = ValuePath::find(schema, path).map(|pick| pick.read(schema, &data.payload));
            if let Some(Ok(Some(value))) = value {
                series.push(data.header.stamp_s, value);
            }
        }
        self.lost += data.lost;
        self.arrivals.push_back(Instant::now());
        self.forget_arrivals();
        self.last = Some(Arc::new(data));
    }
}

/// The thread that follows one output.
struct ValueLink {
    directory: Directory,
    channels: Arc<Channels>,
    data: String,
}

impl ValueLink {
    fn follow_output(self) {
        while !self.channels.is_over(&self.data) {
            let problem = match Tap::open(&self.directory, &self.data, KEEP, PROVIDER_WITHIN) {
                Ok(tap) => self.read_data(tap),
                Err(error) => Some(error.to_string()),
            };
            let Some(problem) = problem else { return };
            self.update_channel(|channel| {
                let is_new = channel.problem != problem;
                channel.problem = problem;
                is_new
            });
            thread::sleep(LOOK_EVERY);
        }
    }

    /// Reads until the link ends, and returns why; `None` if the output is no longer displayed.
    fn read_data(&self, mut tap: Tap) -> Option<String> {
        let schema = Arc::new(tap.schema().clone());
        self.update_channel(|channel| {
            channel.schema = Some(Arc::clone(&schema));
            channel.type_name = tap.type_name().into();
            channel.problem.clear();
            true
        });
        while !self.channels.is_over(&self.data) {
            match tap.next(LOOK_EVERY) {
                Ok(Some(data)) => self.update_channel(|channel| {
                    channel.add_data(&schema, data);
                    true
                }),
                Ok(None) => {}
                Err(error) => return Some(error.to_string()),
            }
        }
        None
    }

    /// Changes the channel, and wakes the window if `news` returns true.
    fn update_channel(&self, news: impl FnOnce(&mut Channel) -> bool) {
        let is_new = self.channels.all.lock().get_mut(&self.data).is_some_and(news);
        if is_new {
            (self.channels.wake)();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end_all_looks(values: &WatchedValues) {
        let mut all = values.channels.all.lock();
        let long_ago = Instant::now().checked_sub(2 * LINGER).expect("the host is up for longer");
        all.values_mut().for_each(|channel| channel.looked = long_ago);
    }

    fn values() -> WatchedValues {
        let directory = Directory::observer("127.0.0.1:1", "test");
        directory.close();
        let values = WatchedValues::new(directory, Arc::new(|| {}));
        values.channels.all.lock().insert("eye.target".into(), Channel::new());
        values
    }

    #[test]
    fn values_that_are_not_displayed_are_forgotten_unless_they_are_kept() {
        let values = values();
        values.keep(true);
        end_all_looks(&values);
        assert!(!values.channels.is_over("eye.target"));
        values.keep(false);
        assert!(!values.channels.is_over("eye.target"), "it may be displayed again");
        end_all_looks(&values);
        assert!(values.channels.is_over("eye.target"));
        assert_eq!(values.linked(), Vec::<String>::new());
    }

    #[test]
    fn at_rest_links_end_and_values_are_kept() {
        let values = values();
        values.rest();
        end_all_looks(&values);
        assert!(values.channels.is_over("eye.target"), "its link is to end");
        assert_eq!(values.linked(), ["eye.target"]);
        assert!(!values.look("eye.other").problem.is_empty());
        assert_eq!(values.linked(), ["eye.target"]);
    }
}
