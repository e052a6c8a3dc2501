//! What flows on the outputs that somebody looks at right now, and on no other.
//!
//! A link for looking is `keep="latest"`: a window that is slow misses data, and neither delays the
//! provider nor makes it keep more than one. It is let go a moment after nobody looks any more.

use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use armor_sdk::directory::Directory;
use armor_sdk::tap::{Tap, TapData};
use armor_wire::keep::Keep;
use armor_wire::schema::{Glimpse, PayloadError, Schema, ValuePath, glimpse_message};

use crate::Wake;
use crate::series::Series;
use crate::watch::spawn;

/// What a link for looking keeps: never `all`, which could make a provider wait.
const KEEP: Keep = Keep::Latest;
/// How long after the last look a link is let go.
const LINGER: Duration = Duration::from_secs(3);
/// How long to wait for data before looking whether somebody still looks.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// How long a provider is waited for at a time.
const PROVIDER_WITHIN: Duration = Duration::from_secs(1);
/// Time over which a rate is taken.
const RATE_OVER: Duration = Duration::from_secs(2);

/// The data that are looked at.
pub struct Values {
    directory: Directory,
    channels: Arc<Channels>,
}

struct Channels {
    all: Mutex<HashMap<String, Channel>>,
    /// Nothing is forgotten, whether somebody looks or not.
    is_kept: AtomicBool,
    is_closing: AtomicBool,
    wake: Wake,
}

/// One output that is looked at.
struct Channel {
    /// When somebody looked at it last.
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

/// An output as it looks now.
#[derive(Clone, Debug)]
pub struct ValueLook {
    /// Name of its type; empty while its provider is not linked to.
    pub type_name: String,
    /// The layout of its data.
    pub schema: Option<Arc<Schema>>,
    /// The newest data.
    pub data: Option<Arc<TapData>>,
    /// How often data arrive here.
    pub rate_hz: f64,
    /// How many were lost on the way here.
    pub lost: u64,
    /// Why there is nothing; empty if there is.
    pub problem: String,
}

impl ValueLook {
    /// The first `lines` values of the newest data.
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

impl Values {
    /// Looks at nothing yet; `wake` is called when data have arrived.
    pub fn new(directory: Directory, wake: Wake) -> Self {
        let channels = Channels {
            all: Mutex::default(),
            is_kept: AtomicBool::new(false),
            is_closing: AtomicBool::new(false),
            wake,
        };
        Self { directory, channels: Arc::new(channels) }
    }

    /// How `data` looks now. Whoever goes on asking goes on being shown; a link is made with the
    /// first look.
    pub fn look(&self, data: &str) -> ValueLook {
        self.with(data, |channel| channel.look())
    }

    /// The value at `path` of `data` over time, from the first time this is asked.
    pub fn series<R>(&self, data: &str, path: &str, show: impl FnOnce(&Series) -> R) -> R {
        self.with(data, |channel| show(channel.series.entry(path.to_owned()).or_default()))
    }

    /// The value at `path` is plotted no more.
    pub fn forget(&self, data: &str, path: &str) {
        if let Some(channel) = self.channels.lock().get_mut(data) {
            channel.series.remove(path);
        }
    }

    /// The data that are linked to now.
    pub fn linked(&self) -> Vec<String> {
        let mut linked: Vec<_> = self.channels.lock().keys().cloned().collect();
        linked.sort();
        linked
    }

    /// Keeps what is looked at now, though nobody goes on asking: a system that is out of reach says
    /// nothing new, and its last values are all there is. Or no longer.
    pub fn keep(&self, is_kept: bool) {
        let mut all = self.channels.lock();
        all.values_mut().for_each(|channel| channel.looked = Instant::now());
        self.channels.is_kept.store(is_kept, Ordering::Relaxed);
    }

    /// Links to nothing any more: the values stay as they were seen last.
    pub fn rest(&self) {
        self.channels.is_closing.store(true, Ordering::Relaxed);
    }

    fn with<R>(&self, data: &str, show: impl FnOnce(&mut Channel) -> R) -> R {
        let mut all = self.channels.lock();
        if !all.contains_key(data) {
            let mut channel = Channel::new();
            if self.channels.is_closing.load(Ordering::Relaxed) {
                channel.problem = "it was not looked at while the system ran".into();
                return show(&mut channel);
            }
            let link = Link {
                directory: self.directory.clone(),
                channels: Arc::clone(&self.channels),
                data: data.into(),
            };
            if let Err(error) = spawn("look-value", move || link.run()) {
                channel.problem = format!("no thread to look at it: {error}");
                return show(&mut channel);
            }
            all.insert(data.into(), channel);
        }
        let channel = all.get_mut(data).expect("it is there by now");
        channel.looked = Instant::now();
        show(channel)
    }
}

impl Drop for Values {
    fn drop(&mut self) {
        self.rest();
    }
}

impl Channels {
    fn lock(&self) -> MutexGuard<'_, HashMap<String, Channel>> {
        self.all.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether its link is to end. What nobody looks at any more is forgotten then.
    fn is_over(&self, data: &str) -> bool {
        let mut all = self.lock();
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

    fn look(&mut self) -> ValueLook {
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

    fn take(&mut self, schema: &Schema, data: TapData) {
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
struct Link {
    directory: Directory,
    channels: Arc<Channels>,
    data: String,
}

impl Link {
    fn run(self) {
        while !self.channels.is_over(&self.data) {
            let problem = match Tap::open(&self.directory, &self.data, KEEP, PROVIDER_WITHIN) {
                Ok(tap) => self.follow(tap),
                Err(error) => Some(error.to_string()),
            };
            let Some(problem) = problem else { return };
            self.tell(|channel| {
                let is_new = channel.problem != problem;
                channel.problem = problem;
                is_new
            });
            thread::sleep(LOOK_EVERY);
        }
    }

    /// Reads until the link ends, and says why; nothing if nobody looks any more.
    fn follow(&self, mut tap: Tap) -> Option<String> {
        let schema = Arc::new(tap.schema().clone());
        self.tell(|channel| {
            channel.schema = Some(Arc::clone(&schema));
            channel.type_name = tap.type_name().into();
            channel.problem.clear();
            true
        });
        while !self.channels.is_over(&self.data) {
            match tap.next(LOOK_EVERY) {
                Ok(Some(data)) => self.tell(|channel| {
                    channel.take(&schema, data);
                    true
                }),
                Ok(None) => {}
                Err(error) => return Some(error.to_string()),
            }
        }
        None
    }

    /// Changes what is seen; `news` says whether it has.
    fn tell(&self, news: impl FnOnce(&mut Channel) -> bool) {
        let is_new = self.channels.lock().get_mut(&self.data).is_some_and(news);
        if is_new {
            (self.channels.wake)();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nobody_looks(values: &Values) {
        let mut all = values.channels.lock();
        let long_ago = Instant::now().checked_sub(2 * LINGER).expect("the host is up for longer");
        all.values_mut().for_each(|channel| channel.looked = long_ago);
    }

    fn values() -> Values {
        let directory = Directory::observer("127.0.0.1:1", "test");
        directory.close();
        let values = Values::new(directory, Arc::new(|| {}));
        values.channels.lock().insert("eye.target".into(), Channel::new());
        values
    }

    #[test]
    fn what_nobody_looks_at_is_forgotten_unless_it_is_all_there_is() {
        let values = values();
        values.keep(true);
        nobody_looks(&values);
        assert!(!values.channels.is_over("eye.target"));
        values.keep(false);
        assert!(!values.channels.is_over("eye.target"), "somebody may look at it again");
        nobody_looks(&values);
        assert!(values.channels.is_over("eye.target"));
        assert_eq!(values.linked(), Vec::<String>::new());
    }

    #[test]
    fn at_rest_nothing_is_linked_to_and_nothing_forgotten() {
        let values = values();
        values.rest();
        nobody_looks(&values);
        assert!(values.channels.is_over("eye.target"), "its link is to end");
        assert_eq!(values.linked(), ["eye.target"]);
        assert!(!values.look("eye.other").problem.is_empty());
        assert_eq!(values.linked(), ["eye.target"]);
    }
}
