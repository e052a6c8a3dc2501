//! The plan: a net, what each place activates, what excludes what, and how long things may take.

use crate::canonical::canonical_text;
use crate::counters::PlannedCounter;
use crate::dates::PlannedDates;
use crate::guards::{PlannedVariable, Watch, WatchId};
use crate::limits::{OnResume, PlanLimits};
use crate::planned::{ComponentId, PlannedComponent, PlannedPlace, PlannedTransition};
use crate::version::Version;
use armor_petri::{Net, PlaceId, TransitionId};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::time::Duration;

/// A mission ready to be played. Names are resolved; no id of it dangles.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(crate) mission: String,
    pub(crate) net: Arc<Net>,
    pub(crate) components: Vec<PlannedComponent>,
    pub(crate) places: Vec<PlannedPlace>,
    pub(crate) transitions: Vec<PlannedTransition>,
    pub(crate) listeners: BTreeMap<(ComponentId, String), Vec<TransitionId>>,
    pub(crate) watches: Vec<Watch>,
    pub(crate) variables: Vec<PlannedVariable>,
    /// The variables that transitions set.
    pub(crate) counters: Vec<PlannedCounter>,
    /// Per watch, the transitions whose guards look at it.
    pub(crate) watchers: Vec<Vec<TransitionId>>,
    /// Per counter, the transitions whose guards look at it.
    pub(crate) counter_readers: Vec<Vec<TransitionId>>,
    /// The transitions that have dates.
    pub(crate) dated: Vec<TransitionId>,
    pub(crate) goal: Option<PlaceId>,
    pub(crate) safe: Option<PlaceId>,
    pub(crate) period: Option<Duration>,
    /// The data that its time follows.
    pub(crate) clock: Option<String>,
    pub(crate) on_resume: OnResume,
    pub(crate) limits: PlanLimits,
    pub(crate) names: PlanNames,
    /// What it was compiled from.
    pub(crate) version: Arc<Version>,
    /// What the components are of: the version that the mission began with.
    pub(crate) began: Arc<Version>,
    /// How a version that follows is read.
    pub(crate) reader: PlanReader,
}

/// Reads a version of the file over the plan that is played until then.
pub type PlanReader = fn(&Version, &Plan) -> Result<Plan, String>;

/// The ids of names.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlanNames {
    pub(crate) components: HashMap<String, ComponentId>,
    pub(crate) places: HashMap<String, PlaceId>,
    pub(crate) transitions: HashMap<String, TransitionId>,
}

impl Plan {
    /// The mission's name.
    pub fn mission(&self) -> &str {
        &self.mission
    }

    /// The net it plays.
    pub fn net(&self) -> &Arc<Net> {
        &self.net
    }

    /// The components, in the order of the file.
    pub fn components(&self) -> &[PlannedComponent] {
        &self.components
    }

    /// Returns the places, in the order of the file.
    pub fn places(&self) -> &[PlannedPlace] {
        &self.places
    }

    /// Returns the transitions, in the order of the file.
    pub fn transitions(&self) -> &[PlannedTransition] {
        &self.transitions
    }

    /// Returns the variables that follow data.
    pub fn variables(&self) -> &[PlannedVariable] {
        &self.variables
    }

    /// Returns the variables that transitions set.
    pub fn counters(&self) -> &[PlannedCounter] {
        &self.counters
    }

    /// Returns the transitions whose guards read a watch.
    pub fn watchers(&self, watch: WatchId) -> &[TransitionId] {
        &self.watchers[watch.index()]
    }

    /// Returns the transitions whose guards read the counter at `index`.
    pub fn counter_readers(&self, index: usize) -> &[TransitionId] {
        &self.counter_readers[index]
    }

    /// Returns the period in which the net is looked at; without one, it is at every event.
    pub fn period(&self) -> Option<Duration> {
        self.period
    }

    /// Returns the data that mission time follows.
    pub fn clock(&self) -> Option<&str> {
        self.clock.as_deref()
    }

    /// Returns what a restarted executive does first.
    pub fn on_resume(&self) -> OnResume {
        self.on_resume
    }

    /// Returns the waiting times.
    pub fn limits(&self) -> &PlanLimits {
        &self.limits
    }

    /// The same plan in the time that these data bring.
    #[must_use]
    pub fn with_clock(mut self, data: String) -> Self {
        self.clock = Some(data);
        self
    }

    /// Whether a transition has absolute dates: such a mission needs a clock of known quality.
    pub fn has_dates(&self) -> bool {
        !self.dated.is_empty()
    }

    /// Returns the transitions that have absolute dates, with these.
    pub fn dated(&self) -> impl Iterator<Item = (TransitionId, PlannedDates)> {
        self.dated.iter().filter_map(|id| Some((*id, self.transition(*id).dates?)))
    }

    /// The fields of data that its guards look at.
    pub fn watches(&self) -> &[Watch] {
        &self.watches
    }

    /// The place that ends it well.
    pub fn goal(&self) -> Option<PlaceId> {
        self.goal
    }

    /// The place where it goes when something fails.
    pub fn safe(&self) -> Option<PlaceId> {
        self.safe
    }

    /// The component called `name`.
    pub fn component_named(&self, name: &str) -> Option<ComponentId> {
        self.names.components.get(name).copied()
    }

    /// The place called `name`.
    pub fn place_named(&self, name: &str) -> Option<PlaceId> {
        self.names.places.get(name).copied()
    }

    /// The transition called `name`.
    pub fn transition_named(&self, name: &str) -> Option<TransitionId> {
        self.names.transitions.get(name).copied()
    }

    /// The version of the file that it was compiled from.
    pub fn version(&self) -> &Arc<Version> {
        &self.version
    }

    /// Gives the version it was compiled from the number that configd knows it by.
    #[must_use]
    pub fn numbered(mut self, number: u64) -> Self {
        let is_first = Arc::ptr_eq(&self.began, &self.version);
        Arc::make_mut(&mut self.version).number = number;
        if is_first {
            self.began = Arc::clone(&self.version);
        }
        self
    }

    /// The version of the file that the mission began with.
    pub fn began(&self) -> &Arc<Version> {
        &self.began
    }

    /// Reads a later version of the file over this plan.
    ///
    /// # Errors
    /// In words, why it cannot follow this plan.
    pub fn read_next(&self, version: &Version) -> Result<Self, String> {
        (self.reader)(version, self)
    }

    /// Replaces the version it was compiled from, the version that the mission began with, and the
    /// function that reads a later one.
    #[must_use]
    pub fn with_origin(
        mut self,
        version: Arc<Version>,
        began: Arc<Version>,
        reader: PlanReader,
    ) -> Self {
        (self.version, self.began, self.reader) = (version, began, reader);
        self
    }

    /// Replaces the waiting times.
    pub fn with_limits(mut self, limits: PlanLimits) -> Self {
        self.limits = limits;
        self
    }

    /// Returns sixteen hexadecimal digits that change when the mission does; a journal belongs to
    /// one of them. They hash the plan's canonical text (`canonical.rs`).
    pub fn fingerprint(&self) -> String {
        // FNV-1a, 64 bits: stable from build to build, unlike the standard library's hasher.
        let hash = canonical_text(self).bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        format!("{hash:016x}")
    }

    /// Returns a component.
    pub fn component(&self, id: ComponentId) -> &PlannedComponent {
        &self.components[id.index()]
    }

    /// Returns a place.
    pub fn place(&self, id: PlaceId) -> &PlannedPlace {
        &self.places[id.index()]
    }

    /// Returns a transition.
    pub fn transition(&self, id: TransitionId) -> &PlannedTransition {
        &self.transitions[id.index()]
    }

    /// Returns the ids of all components.
    pub fn component_ids(&self) -> impl Iterator<Item = ComponentId> + use<> {
        (0..self.components.len() as u32).map(ComponentId)
    }

    /// Returns the ids of all places.
    pub fn place_ids(&self) -> impl Iterator<Item = PlaceId> + use<> {
        (0..self.places.len() as u32).map(PlaceId)
    }

    /// Whether `component` is active while one of `places` is marked.
    pub fn activates(&self, places: &[(PlaceId, u32)], component: ComponentId) -> bool {
        places.iter().any(|(place, _)| self.component(component).places.contains(place))
    }

    /// The transitions that consume this report.
    pub fn listeners(&self, component: ComponentId, report: &str) -> &[TransitionId] {
        self.listeners.get(&(component, report.to_owned())).map_or(&[], Vec::as_slice)
    }

    /// Whether a transition that takes from `place` waits for this report.
    pub fn is_heard_from(&self, place: PlaceId, component: ComponentId, name: &str) -> bool {
        let takes = |id: &TransitionId| {
            self.net.transition(*id).inputs.iter().any(|(input, _)| *input == place)
        };
        self.listeners(component, name).iter().any(takes)
    }
}
