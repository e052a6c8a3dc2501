//! The reports of each component that no transition of the mission waits for: the executive counts them.

use std::collections::BTreeMap;
use std::time::Duration;

use armor_inspect::ObservedSystem;
use armor_marking::Marking;
use armor_wire::WireType;
use armor_wire::codec;

use super::mission::MARKING;

/// Longest time to wait for the latched marking.
const WITHIN: Duration = Duration::from_secs(1);

/// How many reports of each component no transition waits for; nothing without a mission.
#[derive(Clone, Debug, Default)]
pub struct UnheardReports(BTreeMap<String, u64>);

impl UnheardReports {
    /// Reads them from the marking, if a mission runs and its executive answers.
    pub fn read(observed: &ObservedSystem) -> Self {
        Self::find(observed).unwrap_or_default()
    }

    fn find(observed: &ObservedSystem) -> Option<Self> {
        observed.list().ok()?.data.iter().find(|entry| entry.data == MARKING)?;
        let mut tap = observed.tap(MARKING).ok()?;
        if tap.schema().hash() != Marking::schema().hash() {
            return None;
        }
        let marking: Marking = codec::decode(&tap.next(WITHIN).ok()??.payload).ok()?;
        let counts = marking.components.into_iter().map(|it| (it.component, it.unheard_reports));
        Some(Self(counts.collect()))
    }

    /// Returns the number of a component.
    pub fn count(&self, component: &str) -> u64 {
        self.0.get(component).copied().unwrap_or_default()
    }

    /// Returns the number of a component in words, if there are any.
    pub fn describe(&self, component: &str) -> Option<String> {
        match self.count(component) {
            0 => None,
            1 => Some("1 report that no transition waits for".to_owned()),
            count => Some(format!("{count} reports that no transition waits for")),
        }
    }
}

#[cfg(test)]
impl UnheardReports {
    /// Those of one component, for tests.
    pub fn of(component: &str, count: u64) -> Self {
        Self(BTreeMap::from([(component.to_owned(), count)]))
    }
}
