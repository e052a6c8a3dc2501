//! Asks the components of a system for their statuses, on a thread of its own. Each is asked on a
//! connection that is closed afterwards: in a large system, beats on hundreds of open connections would
//! cost more than the questions.

use std::collections::HashMap;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use armor_inspect::{ObservedLink, ObservedSystem, Sighting, combine_links, pair_reports};
use armor_sdk::control::Status;
use armor_wire::registry::ComponentEntry;
use parking_lot::Mutex;

/// Time between two looks at the registry.
const LIST_EVERY: Duration = Duration::from_secs(1);
/// Time between two questions to one component, for each component of the system: not more than forty
/// questions a second are asked in all.
const ASK_SPACING: Duration = Duration::from_millis(25);
/// Time after which a poller without an owner ends.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// What the components have answered.
#[derive(Clone, Debug, Default)]
pub struct PolledSystem {
    /// Whether the registry answers; none before the first answer.
    pub is_found: Option<bool>,
    /// What is registered.
    pub entries: Vec<ComponentEntry>,
    /// The last answer of each process start, or why there is none.
    pub answers: HashMap<(String, u64), Result<Status, String>>,
    /// The links between them.
    pub links: Vec<ObservedLink>,
}

/// Asks until it is dropped.
pub struct StatusPoller {
    polled: Arc<Mutex<PolledSystem>>,
}

impl StatusPoller {
    /// Begins to ask.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(observed: ObservedSystem) -> std::io::Result<Self> {
        let polled = Arc::<Mutex<PolledSystem>>::default();
        let weak = Arc::downgrade(&polled);
        thread::Builder::new().name("poll".into()).spawn(move || {
            let mut rounds = 0_u32;
            let mut before: Vec<Status> = Vec::new();
            let (mut listed, mut asked): (Option<Instant>, Option<Instant>) = (None, None);
            while let Some(polled) = weak.upgrade() {
                let count = u32::try_from(polled.lock().entries.len()).unwrap_or(u32::MAX);
                // Two statuses make the first rates: these are not waited for.
                let pause = if rounds < 2 { LIST_EVERY } else { find_pause(count) };
                if asked.is_none_or(|asked| asked.elapsed() >= pause) {
                    asked = Some(Instant::now());
                    rounds = rounds.saturating_add(1);
                    before = ask_all(&observed, &polled, &before);
                    listed = asked;
                } else if listed.is_none_or(|listed| listed.elapsed() >= LIST_EVERY) {
                    listed = Some(Instant::now());
                    list_all(&observed, &polled);
                }
                drop(polled);
                thread::sleep(LOOK_EVERY);
            }
        })?;
        Ok(Self { polled })
    }

    /// Returns what is known.
    pub fn polled(&self) -> PolledSystem {
        self.polled.lock().clone()
    }
}

/// Returns the time between two questions to one of so many components.
fn find_pause(count: u32) -> Duration {
    ASK_SPACING.saturating_mul(count).max(LIST_EVERY)
}

fn list_all(observed: &ObservedSystem, polled: &Mutex<PolledSystem>) {
    let listing = observed.list();
    let mut polled = polled.lock();
    polled.is_found = Some(listing.is_ok());
    if let Ok(listing) = listing {
        polled.entries = listing.components;
    }
}

/// Asks all components. Returns their statuses.
fn ask_all(
    observed: &ObservedSystem,
    polled: &Mutex<PolledSystem>,
    before: &[Status],
) -> Vec<Status> {
    let sightings = observed.ask_statuses();
    let mut polled = polled.lock();
    polled.is_found = Some(sightings.is_ok());
    let Ok(sightings) = sightings else { return before.to_vec() };
    polled.entries = sightings.iter().map(|sighting| sighting.entry.clone()).collect();
    let answers = sightings.into_iter().map(|Sighting { entry, status }| {
        let start = (entry.name, entry.instance);
        (start, status)
    });
    polled.answers = answers.collect();
    let now: Vec<Status> =
        polled.answers.values().filter_map(|answer| answer.as_ref().ok()).cloned().collect();
    polled.links = combine_links(&pair_reports(before, &now));
    now
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_most_forty_questions_a_second_are_asked() {
        assert_eq!(find_pause(0), Duration::from_secs(1));
        assert_eq!(find_pause(40), Duration::from_secs(1));
        assert_eq!(find_pause(200), Duration::from_secs(5));
    }
}
