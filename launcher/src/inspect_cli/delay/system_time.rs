//! The time in which stamps are written: the registry's clock, or the data that the system's time
//! follows; and how exactly it is known here and at the provider.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;
use armor_inspect::ObservedSystem;
use armor_sdk::SystemClock;
use armor_sdk::tap::Tap;
use armor_wire::clock::Clock;
use armor_wire::codec;
use armor_wire::keep::Keep;

use crate::inspect_cli::time_source::find_source_of;

/// Time within which the registry must answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(3);
const LOOK_EVERY: Duration = Duration::from_millis(10);
/// Time between two attempts to link to the source of the time.
const RETRY: Duration = Duration::from_millis(200);

/// The time of the provider, as it is known here.
pub enum MeasuredTime {
    /// The registry's clock.
    Registry(Arc<SystemClock>),
    /// The last reading of these data.
    Followed { source: String, reading: Arc<LastReading> },
}

/// The last reading of a source of time, as bits; NaN before the first one.
pub struct LastReading(AtomicU64);

impl MeasuredTime {
    /// Finds the time by which the provider of `data` stamps them.
    ///
    /// # Errors
    /// If the registry does not answer, or no thread can be started that reads the source of the time.
    pub fn find(observed: &ObservedSystem, data: &str) -> Result<Self> {
        let component = data.split('.').next().unwrap_or_default();
        let sightings = observed.ask_statuses()?;
        let statuses: Vec<_> = sightings.into_iter().filter_map(|it| it.status.ok()).collect();
        match find_source_of(&statuses, component) {
            Some(source) => {
                let reading = LastReading::follow(observed, &source)?;
                Ok(Self::Followed { source, reading })
            }
            None => {
                let clock = Arc::clone(observed.directory().clock());
                let start = Instant::now();
                while clock.estimate().is_none() && start.elapsed() < ANSWER_WITHIN {
                    thread::sleep(LOOK_EVERY);
                }
                Ok(Self::Registry(clock))
            }
        }
    }

    /// Returns the time in seconds; none before the first reading of its source.
    pub fn now_s(&self) -> Option<f64> {
        match self {
            Self::Registry(clock) => Some(clock.timestamp()),
            Self::Followed { reading, .. } => {
                Some(f64::from_bits(reading.0.load(Ordering::Relaxed))).filter(|it| !it.is_nan())
            }
        }
    }

    /// Returns the largest error of the time in seconds. The time that follows data is that of their
    /// last reading, by definition.
    pub fn error_s(&self) -> Option<f64> {
        match self {
            Self::Registry(clock) => clock.estimate().map(|estimate| estimate.error_s),
            Self::Followed { .. } => Some(0.0),
        }
    }

    /// Returns the data that the time follows; none for the registry's clock.
    pub fn source(&self) -> Option<&str> {
        match self {
            Self::Registry(_) => None,
            Self::Followed { source, .. } => Some(source),
        }
    }
}

impl LastReading {
    /// Reads `source` on a thread of its own until the process ends.
    fn follow(observed: &ObservedSystem, source: &str) -> Result<Arc<Self>> {
        let reading = Arc::new(Self(AtomicU64::new(f64::NAN.to_bits())));
        let (directory, source) = (observed.directory().clone(), source.to_owned());
        let written = Arc::clone(&reading);
        thread::Builder::new().name("time".into()).spawn(move || {
            loop {
                if let Ok(mut tap) = Tap::open(&directory, &source, Keep::Latest, ANSWER_WITHIN) {
                    written.read_from(&mut tap);
                }
                thread::sleep(RETRY);
            }
        })?;
        Ok(reading)
    }

    /// Reads until the link ends.
    fn read_from(&self, tap: &mut Tap) {
        while let Ok(item) = tap.next(ANSWER_WITHIN) {
            if let Some(Ok(Clock { clock })) = item.map(|item| codec::decode(&item.payload)) {
                self.0.store(clock.to_bits(), Ordering::Relaxed);
            }
        }
    }
}

/// How exactly the provider knows the registry's clock. It is asked once per start of its process.
pub struct ProviderClock {
    observed: ObservedSystem,
    component: String,
    instance: Option<u64>,
    error_s: Option<f64>,
}

impl ProviderClock {
    /// Asks nothing yet.
    pub fn new(observed: &ObservedSystem, data: &str) -> Self {
        let component = data.split('.').next().unwrap_or_default().to_owned();
        let observed = observed.clone();
        Self { observed, component, instance: None, error_s: None }
    }

    /// Notes which start of the process the data come from.
    pub fn note_instance(&mut self, instance: u64) {
        if self.instance != Some(instance) {
            (self.instance, self.error_s) = (Some(instance), None);
        }
    }

    /// Returns the error at the provider in seconds; asks if it is not known.
    pub fn error_s(&mut self) -> Option<f64> {
        if self.error_s.is_none() && self.instance.is_some() {
            let status = self.observed.ask_component(&self.component).ok();
            self.error_s = status.and_then(|status| status.clock_error_s);
        }
        self.error_s
    }
}
