//! Watches the data that guards read: one thread and one link per output, kept as long as the
//! mission is played. Fields are decoded by the provider's schema, without a Rust type.

use crate::event::ControllerEvent;
use crate::hub::ExecutiveInput;
use armor_plan::{Plan, WatchId};
use armor_robotfile::guard::Scalar;
use armor_sdk::directory::Directory;
use armor_sdk::tap::{Tap, TapData};
use armor_sdk::wire::keep::Keep;
use armor_sdk::wire::quantity::Unit;
use armor_sdk::wire::schema::{FieldPath, Schema};
use parking_lot::Mutex;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::time::Duration;

/// How long to wait for a provider or for data before checking whether the mission is over.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Time between two attempts to link to a provider that the registry knows.
const RETRY: Duration = Duration::from_millis(100);

/// The watchers of one mission. They end when this is dropped.
pub(crate) struct GuardWatching {
    shared: Arc<SharedNews>,
    registry: String,
    directory: Option<Directory>,
    /// How many of the plan's watches have a watcher: the first ones.
    watched: usize,
}

struct SharedNews {
    /// The newest value of each watch that the executive has not taken yet. Older values are
    /// dropped, so fast data cannot fill a queue.
    news: Mutex<BTreeMap<WatchId, WatchNews>>,
    /// The outputs that have not been linked yet.
    missing: Mutex<Vec<String>>,
    over: AtomicBool,
}

#[derive(Default)]
struct WatchNews {
    value: Option<Option<Scalar>>,
    unlinked: bool,
    /// The SI unit of the values, from the provider's schema.
    unit: Option<&'static str>,
}

impl GuardWatching {
    /// Starts the watchers of a plan.
    pub(crate) fn start(plan: &Plan, registry: &str, inputs: &Sender<ExecutiveInput>) -> Self {
        let shared = SharedNews {
            news: Mutex::default(),
            missing: Mutex::default(),
            over: AtomicBool::new(false),
        };
        let mut watching = Self {
            shared: Arc::new(shared),
            registry: registry.to_owned(),
            directory: None,
            watched: 0,
        };
        watching.follow(plan, inputs);
        watching
    }

    /// Starts watchers for the watches that a plan adds. Its watches begin with those already
    /// watched.
    pub(crate) fn follow(&mut self, plan: &Plan, inputs: &Sender<ExecutiveInput>) {
        let mut outputs: BTreeMap<&str, Vec<_>> = BTreeMap::new();
        for (id, watch) in (0..).map(WatchId).zip(plan.watches()).skip(self.watched) {
            outputs.entry(&watch.data).or_default().push((id, watch.field.clone()));
        }
        self.watched = plan.watches().len();
        self.shared.missing.lock().extend(outputs.keys().map(|data| (*data).to_owned()));
        let shared = &self.shared;
        for (data, fields) in outputs {
            let directory = self
                .directory
                .get_or_insert_with(|| Directory::observer(&self.registry, "executive"));
            let watcher = Watcher {
                data: data.to_owned(),
                fields,
                directory: directory.clone(),
                inputs: inputs.clone(),
                shared: Arc::clone(shared),
            };
            let spawned =
                std::thread::Builder::new().name("guard".into()).spawn(move || watcher.run());
            if let Err(error) = spawned {
                tracing::error!("no thread to watch {data} for a guard: {error}");
            }
        }
    }

    /// Takes the news of a watch.
    pub(crate) fn news(&self, watch: WatchId) -> Vec<ControllerEvent> {
        let Some(news) = self.shared.news.lock().remove(&watch) else {
            return Vec::new();
        };
        let unit = news.unit.map(|unit| ControllerEvent::UnitKnown { watch, unit });
        let value = news.value.map(|value| ControllerEvent::Sensed { watch, value });
        unit.into_iter()
            .chain(value)
            .chain(news.unlinked.then_some(ControllerEvent::Unlinked { watch }))
            .collect()
    }

    /// Returns an output that a guard reads and that is not linked yet.
    pub(crate) fn unlinked(&self) -> Option<String> {
        self.shared.missing.lock().first().cloned()
    }
}

impl Drop for GuardWatching {
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Relaxed);
    }
}

/// Watches one output.
struct Watcher {
    data: String,
    fields: Vec<(WatchId, Vec<String>)>,
    directory: Directory,
    inputs: Sender<ExecutiveInput>,
    shared: Arc<SharedNews>,
}

/// One field, and the value last sent.
struct Looked<'a> {
    watch: WatchId,
    path: FieldPath<'a>,
    to_si: f64,
    sent: Option<Option<Scalar>>,
}

impl Watcher {
    fn run(&self) {
        while !self.shared.over.load(Ordering::Relaxed) {
            match Tap::open(&self.directory, &self.data, Keep::Latest, LOOK_EVERY) {
                Ok(tap) => {
                    self.shared.missing.lock().retain(|data| *data != self.data);
                    self.follow(tap);
                    for (watch, _) in &self.fields {
                        self.send_news(*watch, |news| news.unlinked = true);
                    }
                }
                Err(error) => {
                    tracing::debug!(data = self.data.as_str(), "not linked for a guard: {error}");
                    std::thread::sleep(RETRY);
                }
            }
        }
    }

    fn follow(&self, mut tap: Tap) {
        let schema = tap.schema().clone();
        let mut looked: Vec<_> = self
            .fields
            .iter()
            .filter_map(|(watch, field)| self.find(*watch, field, &schema))
            .collect();
        let mut fits = true;
        while !self.shared.over.load(Ordering::Relaxed) {
            match tap.next(LOOK_EVERY) {
                Ok(None) => {}
                Ok(Some(TapData { payload, .. })) => {
                    for field in &mut looked {
                        fits &= self.look(field, &schema, &payload, fits);
                    }
                }
                Err(error) => {
                    let data = self.data.as_str();
                    tracing::info!(data, "a guard's data is lost: {error}");
                    return;
                }
            }
        }
    }

    fn find<'a>(&self, watch: WatchId, field: &[String], schema: &'a Schema) -> Option<Looked<'a>> {
        let names: Vec<_> = field.iter().map(String::as_str).collect();
        match FieldPath::find(schema, &names) {
            Ok(path) => {
                let unit = path.unit.and_then(Unit::named);
                let to_si = unit.map_or(1.0, |unit| unit.to_si);
                if let Some(unit) = unit.and_then(|unit| unit.dimension.si_unit()) {
                    self.send_news(watch, |news| news.unit = Some(unit));
                }
                Some(Looked { watch, path, to_si, sent: None })
            }
            Err(error) => {
                let (data, field) = (self.data.as_str(), field.join("."));
                tracing::error!(data, field, "what a guard looks at is not there: {error}");
                None
            }
        }
    }

    /// Reads one field and sends its value if it has changed. Returns whether it could be read.
    fn look(&self, field: &mut Looked<'_>, schema: &Schema, payload: &[u8], warn: bool) -> bool {
        let read = field.path.read(schema, payload);
        if let (Err(error), true) = (&read, warn) {
            let data = self.data.as_str();
            tracing::error!(data, "a message does not fit the schema of its provider: {error}");
        }
        let value = read.clone().unwrap_or_default().and_then(|value| match value {
            Scalar::Number(number) if number.is_nan() => None,
            Scalar::Number(number) => Some(Scalar::Number(number * field.to_si)),
            other => Some(other),
        });
        if field.sent.as_ref() != Some(&value) {
            field.sent = Some(value.clone());
            self.send_news(field.watch, |news| {
                *news = WatchNews { value: Some(value), unlinked: false, unit: news.unit }
            });
        }
        read.is_ok()
    }

    /// Changes the news of a watch, and wakes the executive if it had none.
    fn send_news(&self, watch: WatchId, change: impl FnOnce(&mut WatchNews)) {
        let mut all = self.shared.news.lock();
        // One message per watch, until the executive has taken its news: fast data cannot fill the
        // channel.
        let is_first = !all.contains_key(&watch);
        change(all.entry(watch).or_default());
        drop(all);
        if is_first {
            // The receiver is gone only when the executive is about to end.
            let _ = self.inputs.send(ExecutiveInput::News(watch));
        }
    }
}
