//! What the controller plays: a net, which components each place activates, what may not be
//! active together, and how long things may take. Names are resolved; nothing here can dangle.

use crate::counters::{PlannedCounter, PlannedSet};
use crate::dates::PlannedDates;
use crate::guards::{Operand, PlannedGuard, PlannedVariable, Watch, WatchId};
use crate::values::GivenValue;
use crate::version::Version;
use armor_petri::{Net, PlaceId, TransitionId};
use armor_robotfile::mission::{Autonomy, LostLink};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::time::Duration;

/// A component of one plan, numbered in the order of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ComponentId(pub u32);

impl ComponentId {
    /// The position in [`Plan::components`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// How long the controller waits, and how often it tries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// For every component to appear after the start of the executive.
    pub muster: Duration,
    /// For a component that died or was cut off to be back and ready.
    pub return_within: Duration,
    /// For the confirmation of an activation; the first call may open hardware.
    pub start_within: Duration,
    /// For the confirmation of a freeze; asked twice, then the component is killed.
    pub stop_within: Duration,
    /// For a component that excludes one to be started and that nothing will stop any more, in
    /// mission time: long enough for an operator to see to it.
    pub wait_within: Duration,
    /// For a killed component to be gone.
    pub kill_within: Duration,
    /// For the holder of the lease to come back after its connection broke.
    pub lease: Duration,
    /// For a value that guards look at, after its provider could be reached last.
    pub value_holds: Duration,
    /// How late a transition may fire before that is an overrun.
    pub overrun: Duration,
    /// Firings in flight at once; a net that needs more grows without end.
    pub firings: usize,
    /// Firings at one moment before they count as an endless loop.
    pub step_bound: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            muster: Duration::from_secs(30),
            return_within: Duration::from_secs(15),
            start_within: Duration::from_secs(10),
            stop_within: Duration::from_secs(1),
            wait_within: Duration::from_secs(10),
            kill_within: Duration::from_secs(2),
            lease: Duration::from_secs(5),
            value_holds: Duration::from_secs(2),
            overrun: Duration::from_millis(100),
            firings: 256,
            step_bound: 1000,
        }
    }
}

/// What a restarted executive does first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnResume {
    /// It goes on with the same marking.
    #[default]
    Continue,
    /// It waits for an operator.
    Hold,
    /// It goes to the safe place.
    Safe,
}

/// A component as the plan sees it.
#[derive(Clone, Debug)]
pub struct PlannedComponent {
    /// Its name in the system.
    pub name: String,
    /// Whether the file lets a mission command it. One that is in no place is left alone all the
    /// same, and is always active.
    pub controllable: bool,
    /// The places that activate it.
    pub places: Vec<PlaceId>,
    /// The components it may never be active together with.
    pub peers: Vec<ComponentId>,
    /// Whether its process is started again when it has ended: not where `restart="never"`.
    pub returns: bool,
}

impl PlannedComponent {
    /// Whether the executive activates and freezes it.
    pub fn is_controlled(&self) -> bool {
        self.controllable && !self.places.is_empty()
    }
}

/// A place as the plan sees it.
#[derive(Clone, Debug, Default)]
pub struct PlannedPlace {
    /// The components that are active while it is marked.
    pub components: Vec<ComponentId>,
    /// Where its token goes when one of them fails for good; without it, the mission retreats.
    pub on_failure: Option<PlaceId>,
    /// Whether it goes on during a pause.
    pub safety: bool,
    /// Values that it gives parameters of its components.
    pub values: Vec<(ComponentId, GivenValue)>,
}

/// A transition as the plan sees it, beside what the net knows.
#[derive(Clone, Debug, Default)]
pub struct PlannedTransition {
    /// The report it consumes.
    pub on: Option<(ComponentId, String)>,
    /// What must hold.
    pub guard: Option<PlannedGuard>,
    /// What it sets variables to.
    pub sets: Vec<PlannedSet>,
    /// When it may be enabled at all.
    pub dates: Option<PlannedDates>,
    /// Where the tokens go when a component does not stop; without it, the mission retreats.
    pub on_stop_fail: Option<PlaceId>,
    /// Where the tokens go when a component does not start; without it, the mission retreats.
    pub on_start_fail: Option<PlaceId>,
    /// The place that gets a token more when it fires late.
    pub overrun: Option<PlaceId>,
    /// Who decides that it fires.
    pub autonomy: Autonomy,
    /// What it does when the link to the operator is lost.
    pub lost_link: Option<LostLink>,
}

impl PlannedTransition {
    /// Whether more than tokens and time decide that it is enabled.
    pub(crate) fn is_gated(&self) -> bool {
        self.on.is_some() || self.guard.is_some() || self.dates.is_some()
    }

    /// Whether the operator is asked before it fires.
    pub fn asks(&self) -> bool {
        matches!(self.autonomy, Autonomy::Confirm { .. })
    }
}

/// A mission ready to be played.
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
    pub(crate) limits: Limits,
    pub(crate) names: Names,
    /// What it was compiled from.
    pub(crate) version: Arc<Version>,
    /// What the components are of: the version that the mission began with.
    pub(crate) began: Arc<Version>,
    /// How a version that follows is read.
    pub(crate) reader: Reader,
}

/// Reads a version of the file over the plan that is played until then.
pub(crate) type Reader = fn(&Version, &Plan) -> Result<Plan, String>;

#[derive(Clone, Debug, Default)]
pub(crate) struct Names {
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
    pub fn version(&self) -> &Version {
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
    pub fn began(&self) -> &Version {
        &self.began
    }

    /// Replaces the waiting times.
    pub fn with_limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// Sixteen hexadecimal digits that change when the net or what it activates does; a journal
    /// belongs to one of them. What is watched under which number is not in it: that depends on the
    /// versions there were before.
    pub fn fingerprint(&self) -> String {
        let watch = |id: WatchId| &self.watches[id.index()];
        let transition = |planned: &PlannedTransition| {
            let guard = planned.guard.as_ref().map(|guard| {
                let operand = |operand: &Operand| match operand {
                    Operand::Field(id) => format!("{:?}", watch(*id)),
                    Operand::Variable(index) => self.variables[*index].name.clone(),
                    Operand::Counter(index) => format!("={}", self.counters[*index].name),
                };
                (guard.guard.to_string(), guard.operands.iter().map(operand).collect::<Vec<_>>())
            });
            (PlannedTransition { guard: None, ..planned.clone() }, guard)
        };
        let variable = |planned: &PlannedVariable| {
            let plain = PlannedVariable { source: WatchId(0), ..planned.clone() };
            (plain, watch(planned.source))
        };
        // Where a value is written is not what it is.
        let place = |planned: &PlannedPlace| {
            let mut planned = planned.clone();
            planned.values.iter_mut().for_each(|given| given.1.origin.clear());
            planned
        };
        let text = format!(
            "{:?}{:?}{:?}{:?}{:?}{:?}{:?}{:?}{:?}",
            self.net.places(),
            self.net.initial(),
            self.net.transitions(),
            self.components,
            self.places.iter().map(place).collect::<Vec<_>>(),
            self.transitions.iter().map(transition).collect::<Vec<_>>(),
            self.variables.iter().map(variable).collect::<Vec<_>>(),
            self.counters,
            (self.goal, self.safe, self.period, self.on_resume, &self.mission)
        );
        // FNV-1a, 64 bits: stable from build to build, unlike the standard library's hasher.
        let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        format!("{hash:016x}")
    }

    pub(crate) fn component(&self, id: ComponentId) -> &PlannedComponent {
        &self.components[id.index()]
    }

    pub(crate) fn place(&self, id: PlaceId) -> &PlannedPlace {
        &self.places[id.index()]
    }

    pub(crate) fn transition(&self, id: TransitionId) -> &PlannedTransition {
        &self.transitions[id.index()]
    }

    pub(crate) fn component_ids(&self) -> impl Iterator<Item = ComponentId> + use<> {
        (0..self.components.len() as u32).map(ComponentId)
    }

    pub(crate) fn place_ids(&self) -> impl Iterator<Item = PlaceId> + use<> {
        (0..self.places.len() as u32).map(PlaceId)
    }

    /// Whether `component` is active while one of `places` is marked.
    pub(crate) fn activates(&self, places: &[(PlaceId, u32)], component: ComponentId) -> bool {
        places.iter().any(|(place, _)| self.component(component).places.contains(place))
    }

    /// The transitions that consume this report.
    pub(crate) fn listeners(&self, component: ComponentId, report: &str) -> &[TransitionId] {
        self.listeners.get(&(component, report.to_owned())).map_or(&[], Vec::as_slice)
    }

    /// Whether a transition that takes from `place` waits for this report.
    pub(crate) fn is_heard_from(&self, place: PlaceId, component: ComponentId, name: &str) -> bool {
        let takes = |id: &TransitionId| {
            self.net.transition(*id).inputs.iter().any(|(input, _)| *input == place)
        };
        self.listeners(component, name).iter().any(takes)
    }
}
