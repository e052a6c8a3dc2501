//! How long a component's pulls took: the SDK traces each, and the component's own process collects
//! the values.

use std::fmt::Debug;

use parking_lot::Mutex;
use tracing::field::{Field, Visit};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;

/// Under which the SDK traces its pulls.
const PULLS: &str = "armor_sdk::pulls";

static PULLS_NS: Mutex<PullTimes> =
    Mutex::new(PullTimes { took_ns: Vec::new(), taking_ns: Vec::new() });

/// Of each pull.
#[derive(Default)]
pub struct PullTimes {
    /// From its beginning to the call of `exec`.
    pub took_ns: Vec<u64>,
    /// The part without handing the data to the component's code.
    pub taking_ns: Vec<u64>,
}

/// Collects the pulls of this process from here on, in place of the SDK's log.
pub fn collect() {
    let pulls = Targets::new().with_target(PULLS, LevelFilter::TRACE);
    // It fails only if there is a log already, and then nothing is collected, which is seen.
    let _ = tracing_subscriber::registry().with(PullLayer.with_filter(pulls)).try_init();
}

/// What was collected since the last call.
pub fn take() -> PullTimes {
    std::mem::take(&mut PULLS_NS.lock())
}

struct PullLayer;

impl<S: tracing::Subscriber> Layer<S> for PullLayer {
    fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
        event.record(&mut PullTime);
    }
}

struct PullTime;

impl Visit for PullTime {
    fn record_u64(&mut self, field: &Field, value: u64) {
        let mut pulls = PULLS_NS.lock();
        match field.name() {
            "took_ns" => pulls.took_ns.push(value),
            "taking_ns" => pulls.taking_ns.push(value),
            _ => {}
        }
    }

    fn record_debug(&mut self, _: &Field, _: &dyn Debug) {}
}
