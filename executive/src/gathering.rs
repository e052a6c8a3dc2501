//! Waits before a mission begins until every component is registered and every link is up.
//! Otherwise the components of the initial places could publish before their subscribers are
//! linked, and data would be lost.

use crate::given_up::GivenUpComponents;
use crate::watch::GuardWatching;
use armor_plan::Plan;
use armor_sdk::control::{ControlConnection, Role, Status};
use armor_sdk::directory::Directory;
use armor_sdk::time_link;
use armor_sdk::wire::registry::ComponentEntry;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long the mission waits. A component that is missing after that may be broken; the mission
/// handles that as a failure.
const LIMIT: Duration = Duration::from_secs(10);
/// Time between two looks: a start takes tens of milliseconds.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// How long the registry or a component may take to answer before it counts as missing this time.
const ANSWER_LIMIT: Duration = Duration::from_secs(1);

/// Waits until every component and link is up, for at most [`LIMIT`], and not for a component that
/// is given up.
pub(crate) fn gather(
    plan: &Plan,
    registry: &str,
    watching: &GuardWatching,
    given_up: &GivenUpComponents,
    stop: &AtomicBool,
) {
    let directory = Directory::observer(registry, "executive");
    let mut connections = HashMap::new();
    let start = Instant::now();
    while !stop.load(Ordering::Relaxed) {
        if let Some(why) = given_up.find_first(plan) {
            tracing::warn!("begins although {why}");
            return;
        }
        let unwatched = || Some(format!("{} has no link to the guards", watching.unlinked()?));
        let missing = find_missing(plan, &directory, &mut connections).or_else(unwatched);
        let Some(missing) = missing else { return };
        if start.elapsed() >= LIMIT {
            tracing::warn!("begins although {missing}");
            return;
        }
        std::thread::sleep(LOOK_EVERY);
    }
}

/// Describes the first component or link that is missing.
fn find_missing(
    plan: &Plan,
    directory: &Directory,
    connections: &mut HashMap<u64, ControlConnection>,
) -> Option<String> {
    let Ok(listing) = directory.fetch_listing(ANSWER_LIMIT) else {
        return Some("the registry does not answer".into());
    };
    let mut all = Vec::new();
    for name in plan.components().iter().map(|component| &component.name) {
        let Some(entry) = listing.components.iter().find(|entry| entry.name == *name) else {
            return Some(format!("`{name}` has not registered"));
        };
        let Some(status) = query_status(entry, connections) else {
            return Some(format!("`{name}` does not answer"));
        };
        all.push(status);
    }
    let untimed = || plan.clock().as_ref().and_then(|clock| find_untimed(clock, &all));
    all.iter().find_map(|consumer| unlinked(consumer, &all)).or_else(untimed)
}

/// Describes a component that is not yet linked to the data that the system's time follows.
fn find_untimed(clock: &str, all: &[Status]) -> Option<String> {
    let mut outputs =
        all.iter().flat_map(|status| status.outputs.iter().map(move |it| (status, it)));
    let (source, output) = outputs.find(|(_, output)| output.data == clock)?;
    let is_linked = |name: &str| output.links.iter().any(|link| link.to == time_link(name));
    let mut others = all.iter().filter(|status| status.name != source.name);
    let late = others.find(|status| !is_linked(&status.name))?;
    Some(format!("`{}` has no link to {clock}, which its time follows", late.name))
}

/// Describes an input that the file connects and that has no link yet. The provider is asked: it is
/// the last of the two to know the link.
fn unlinked(consumer: &Status, all: &[Status]) -> Option<String> {
    let outputs = || all.iter().flat_map(|status| &status.outputs);
    let is_linked = |data: &str| {
        let mut links = outputs().filter(|output| output.data == data).flat_map(|it| &it.links);
        links.any(|link| link.to == consumer.name)
    };
    let mut fed = consumer.inputs.iter().filter(|input| !input.data.is_empty());
    let input = fed.find(|input| !is_linked(&input.data))?;
    Some(format!("`{}.{}` has no link to {}", consumer.name, input.id, input.data))
}

fn query_status(
    entry: &ComponentEntry,
    connections: &mut HashMap<u64, ControlConnection>,
) -> Option<Status> {
    let connection = match connections.remove(&entry.instance) {
        Some(connection) => connection,
        None => ControlConnection::connect(entry, Role::Observer, "executive", |_| {}).ok()?,
    };
    let status = connection.status(ANSWER_LIMIT).ok()?;
    connections.insert(entry.instance, connection);
    Some(status)
}
