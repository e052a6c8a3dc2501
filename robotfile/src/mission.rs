//! The mission's model: a Petri net over the system's components, as written. Guards stay text
//! here, for [`crate::guard`] to read, and so do checks.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Duration;

use crate::date::Date;
use crate::drawn_route::DrawnRoute;
use crate::guard::MAX_COUNT;
use crate::model::{LayoutBlock, Parameter};
use crate::site_map::SiteMap;
use crate::source::{Location, Spanned};
use crate::unreadable::UnreadableParts;

/// The Petri net over a system.
#[derive(Clone, Debug)]
pub struct Mission {
    /// The name, if it has one.
    pub name: Option<Spanned<String>>,
    /// The file with the system, as written, if it is another file.
    pub system: Option<Spanned<String>>,
    /// The place that ends the mission well.
    pub goal: Option<Spanned<String>>,
    /// The place to be in when something fails.
    pub safe: Option<Spanned<String>>,
    /// The behaviour of a restarted executive after its recovery.
    pub resume: Option<Spanned<Resume>>,
    /// Time between two looks at the net; without it, it acts on events.
    pub period: Option<Spanned<Duration>>,
    /// Values that guards use.
    pub variables: Vec<Variable>,
    /// The places in the order of the file.
    pub places: Vec<Place>,
    /// Components of which at most one is active.
    pub exclusives: Vec<Exclusive>,
    /// The transitions in the order of the file, which decides between equals.
    pub transitions: Vec<Transition>,
    /// The sub-missions.
    pub submissions: Vec<Submission>,
    /// What is drawn on the map.
    pub map: Option<SiteMap>,
    /// The routes over the map, as drawn; their places and transitions are among the others.
    pub routes: Vec<DrawnRoute>,
    /// The statements to be proven, as text.
    pub checks: Vec<Spanned<String>>,
    /// The `<mission>` tag.
    pub at: Location,
    /// The blocks of its layout.
    pub(crate) layout: Vec<LayoutBlock>,
    /// The parts that could not be read.
    pub(crate) unreadable: UnreadableParts,
}

impl Mission {
    /// The place called `name`.
    pub fn place(&self, name: &str) -> Option<&Place> {
        self.places.iter().find(|place| place.name.value == name)
    }

    /// Whether the transition takes tokens from no place and depends on none, so that it can fire in
    /// any marking, again and again. One of the safety class that ends the mission is an emergency
    /// exit, for which this is intended.
    pub fn lacks_input(&self, transition: &Transition) -> bool {
        let ends = [&self.goal, &self.safe];
        let is_end = |arc: &Arc| ends.into_iter().flatten().any(|end| end.value == arc.place.value);
        let is_exit = transition.class == Class::Safety && transition.outputs().all(is_end);
        let mut arcs = transition.arcs.iter();
        !transition.arcs.is_empty() && arcs.all(|arc| arc.kind == ArcKind::Put) && !is_exit
    }

    /// Whether the transition would be an emergency exit if the safe place were named that is
    /// probably meant: no other is named, or one that does not exist, that the mission leads on from,
    /// or the goal. That is a finding.
    pub(crate) fn is_meant_exit(&self, transition: &Transition) -> bool {
        let is_goal = |place: &str| self.goal.as_ref().is_some_and(|goal| goal.value == place);
        let is_named = self
            .safe
            .as_ref()
            .filter(|safe| self.place(&safe.value).is_some())
            .is_some_and(|safe| !self.leads_on_from(&safe.value) && !is_goal(&safe.value));
        let end = self.find_unnamed_end().filter(|_| !is_named);
        transition.class == Class::Safety
            && end.is_some_and(|end| {
                transition.outputs().all(|arc| arc.place.value == end.name.value)
            })
    }

    /// Whether a transition or a sub-mission takes the token from the place.
    pub(crate) fn leads_on_from(&self, place: &str) -> bool {
        let mut inputs = self.transitions.iter().flat_map(|it| it.inputs());
        let mut entered = self.submissions.iter().filter_map(|inner| inner.enter.as_ref());
        inputs.any(|arc| arc.place.value == place) || entered.any(|enter| enter.value == place)
    }

    /// Returns the first place without components that no transition leaves and that is not the goal:
    /// in a mission without a safe place, probably the one that was meant.
    pub(crate) fn find_unnamed_end(&self) -> Option<&Place> {
        let arcs = self.transitions.iter().flat_map(|transition| &transition.arcs);
        let left = arcs.filter(|arc| arc.kind != ArcKind::Put).map(|arc| &arc.place);
        let entered = self.submissions.iter().filter_map(|inner| inner.enter.as_ref());
        let left = left.chain(entered).chain(&self.goal);
        let left: BTreeSet<_> = left.map(|place| place.value.as_str()).collect();
        self.places.iter().find(|place| {
            let is_left = left.contains(place.name.value.as_str());
            place.components.is_empty() && place.initial == 0 && !is_left
        })
    }

    /// Returns the only place without components that tokens come to and that nothing leads on from,
    /// apart from the mission's ends.
    pub fn find_unused_place(&self) -> Option<&str> {
        let left = self.submissions.iter().filter_map(|it| it.leave.as_ref());
        let put = self.transitions.iter().flat_map(|it| it.outputs()).map(|arc| &arc.place);
        let marked: BTreeSet<_> = put.chain(left).map(|place| place.value.as_str()).collect();
        let arcs = self.transitions.iter().flat_map(|it| &it.arcs);
        let used = arcs.filter(|arc| arc.kind != ArcKind::Put).map(|arc| &arc.place);
        let entered = self.submissions.iter().filter_map(|it| it.enter.as_ref());
        let used = used.chain(entered).chain(&self.goal).chain(&self.safe);
        let used: BTreeSet<_> = used.map(|place| place.value.as_str()).collect();
        let mut unused = self.places.iter().filter(|place| {
            let name = place.name.value.as_str();
            place.components.is_empty() && marked.contains(name) && !used.contains(name)
        });
        let only = unused.next().filter(|_| unused.next().is_none())?;
        Some(&only.name.value)
    }

    /// Whether a place activates the component, so that the mission controls it.
    pub fn controls(&self, component: &str) -> bool {
        self.places.iter().any(|place| place.activates(component))
    }
}

/// The behaviour of a restarted executive after its recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resume {
    /// It continues automatically.
    Continue,
    /// It waits for the operator.
    Hold,
    /// It goes to the safe place.
    Safe,
}

/// A value with a finite domain that guards use: it follows data, or transitions set it.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Its name.
    pub name: Spanned<String>,
    /// The field of data that it follows, such as `power.level`; without it, transitions set it.
    pub source: Option<Spanned<String>>,
    /// Smallest value, in SI.
    pub minimum: Option<Spanned<f64>>,
    /// Largest value, in SI.
    pub maximum: Option<Spanned<f64>>,
    /// The value at the start, if transitions set it; by default its smallest value.
    pub initial: Option<Spanned<i64>>,
}

impl Variable {
    /// The domain and first value of a variable that transitions set; `None` if it follows data, or
    /// if the file's numbers are not whole or do not fit each other.
    pub fn counts(&self) -> Option<Counts> {
        let whole = |end: &Option<Spanned<f64>>| {
            let value = end.as_ref()?.value;
            let is_count = value.fract() == 0.0 && value.abs() <= MAX_COUNT as f64;
            is_count.then_some(value as i64)
        };
        if self.source.is_some() {
            return None;
        }
        let (minimum, maximum) = (whole(&self.minimum)?, whole(&self.maximum)?);
        let initial = self.initial.as_ref().map_or(minimum, |initial| initial.value);
        let fits = (minimum..=maximum).contains(&initial);
        fits.then_some(Counts { minimum, maximum, initial })
    }
}

/// The domain of a variable that transitions set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Its smallest value.
    pub minimum: i64,
    /// Its largest value.
    pub maximum: i64,
    /// Its value at the start.
    pub initial: i64,
}

/// A state of the mission; while it is marked, its components are active.
#[derive(Clone, Debug)]
pub struct Place {
    /// Its name.
    pub name: Spanned<String>,
    /// Tokens at the start.
    pub initial: u32,
    /// The components that it activates.
    pub components: Vec<Spanned<String>>,
    /// Whether it is for safety.
    pub class: Class,
    /// Where its token goes when one of its components fails for good.
    pub on_failure: Option<Spanned<String>>,
    /// Values given to components while it is marked.
    pub parameters: Vec<PlaceParameter>,
}

impl Place {
    /// Whether the component is active while the place is marked.
    pub fn activates(&self, component: &str) -> bool {
        self.components.iter().any(|name| name.value == component)
    }
}

/// A value given to a component while a place is marked.
#[derive(Clone, Debug)]
pub struct PlaceParameter {
    /// The component.
    pub component: Spanned<String>,
    /// The parameter and its value.
    pub parameter: Parameter,
}

/// The purpose of a place or transition, for conflicts and pauses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// The mission itself.
    #[default]
    Normal,
    /// Keeps the robot safe: goes before all else and is not paused.
    Safety,
}

/// Components of which at most one is active, not for a microsecond more.
#[derive(Clone, Debug)]
pub struct Exclusive {
    /// The components.
    pub components: Vec<Spanned<String>>,
    /// The `<exclusive>` tag.
    pub at: Location,
}

/// A change of state, with its conditions.
#[derive(Clone, Debug)]
pub struct Transition {
    /// Its name.
    pub name: Spanned<String>,
    /// The arcs: the short form `from`/`to` first, then the child elements.
    pub arcs: Vec<Arc>,
    /// The variables that it sets when it fires.
    pub sets: Vec<SetVariable>,
    /// The report that must arrive.
    pub on: Option<ReportRef>,
    /// When it may and must fire, counted from when it is enabled.
    pub interval: Option<Spanned<Interval>>,
    /// The guard, as text.
    pub when: Option<Spanned<String>>,
    /// Goes before those of a lower priority.
    pub priority: i32,
    /// Whether it is for safety.
    pub class: Class,
    /// The decision to fire it.
    pub autonomy: Autonomy,
    /// The behaviour of an operator's transition when the link to the operator is lost.
    pub lost_link: Option<Spanned<LostLink>>,
    /// It is not enabled before this date.
    pub not_before: Option<Spanned<Date>>,
    /// It is not enabled from this date on, except by `missed`.
    pub not_after: Option<Spanned<Date>>,
    /// The behaviour when `not_after` passed before it fired; the default is `Skip`.
    pub missed: Option<Spanned<Missed>>,
    /// Where the token goes when a component does not stop.
    pub on_stop_fail: Option<Spanned<String>>,
    /// Where the token goes when a component does not start.
    pub on_start_fail: Option<Spanned<String>>,
    /// The place that gets a token when it fires after its deadline.
    pub overrun: Option<Spanned<String>>,
    /// The location of the attribute that specifies who decides, if present.
    pub(crate) autonomy_at: Option<Location>,
    /// The location of the time for an answer, if present.
    pub(crate) answer_at: Option<Location>,
    /// Whether something in its element could not be read.
    pub(crate) is_doubtful: bool,
}

impl Transition {
    /// A transition with these arcs and no conditions.
    pub(crate) fn new(name: Spanned<String>, arcs: Vec<Arc>) -> Self {
        Self {
            name,
            arcs,
            sets: Vec::new(),
            on: None,
            interval: None,
            when: None,
            priority: 0,
            class: Class::Normal,
            autonomy: Autonomy::Auto,
            lost_link: None,
            not_before: None,
            not_after: None,
            missed: None,
            on_stop_fail: None,
            on_start_fail: None,
            overrun: None,
            autonomy_at: None,
            answer_at: None,
            is_doubtful: false,
        }
    }

    /// The places that tokens are taken from.
    pub fn inputs(&self) -> impl Iterator<Item = &Arc> {
        self.arcs.iter().filter(|arc| arc.kind == ArcKind::Take)
    }

    /// The places that must be marked and stay so.
    pub(crate) fn reads(&self) -> impl Iterator<Item = &Arc> {
        self.arcs.iter().filter(|arc| arc.kind == ArcKind::Read)
    }

    /// The places that tokens are put into.
    pub fn outputs(&self) -> impl Iterator<Item = &Arc> {
        self.arcs.iter().filter(|arc| arc.kind == ArcKind::Put)
    }

    /// Whether it waits for the failure of a component.
    pub(crate) fn is_on_failure(&self) -> bool {
        self.on.as_ref().is_some_and(|on| on.event.value == "failed")
    }
}

/// A variable and the value that a transition sets it to, computed from the values before the
/// firing.
#[derive(Clone, Debug)]
pub struct SetVariable {
    /// The variable.
    pub variable: Spanned<String>,
    /// Its value, as text: a [`Count`](crate::guard::Count).
    pub value: Spanned<String>,
}

/// A place and a transition, joined.
#[derive(Clone, Debug)]
pub struct Arc {
    /// The kind of arc.
    pub kind: ArcKind,
    /// The place.
    pub place: Spanned<String>,
    /// How many tokens; 1 for a reset.
    pub weight: u32,
}

/// The kinds of arcs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ArcKind {
    /// Takes tokens when the transition fires.
    Take,
    /// Puts tokens when the transition fires.
    Put,
    /// Requires tokens and does not take them.
    Read,
    /// Requires fewer tokens than its weight.
    Inhibitor,
    /// Takes all tokens there are, none too.
    Reset,
}

/// `component.event`: `done`, `failed`, or an event that the component names.
#[derive(Clone, Debug)]
pub struct ReportRef {
    /// The component that reports.
    pub component: Spanned<String>,
    /// The name of the report.
    pub event: Spanned<String>,
}

/// `[earliest, latest]`, from when the transition is enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interval {
    /// It does not fire before.
    pub earliest: Duration,
    /// The latest time of the firing; none if there is no limit.
    pub latest: Option<Duration>,
}

/// The decision to fire a transition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Autonomy {
    /// The executive.
    #[default]
    Auto,
    /// The executive asks the operator; without an answer in time it follows this setting.
    Confirm {
        /// How long it waits for an answer; none is for ever.
        within: Option<Duration>,
        /// Whether it fires without an answer.
        fire_unanswered: bool,
    },
    /// The operator.
    Operator,
}

/// The behaviour of an operator's transition when the link to the operator is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LostLink {
    /// It fires.
    Fire,
    /// It waits for the operator to come back.
    Wait,
}

/// The behaviour of a transition whose `not-after` date passed before it fired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Missed {
    /// It fires once all the same, late.
    Fire,
    /// It is not fired any more.
    #[default]
    Skip,
    /// The mission goes to its safe place, if there are tokens that wait for it.
    Fail,
}

/// Another mission file put into this one.
#[derive(Clone, Debug)]
pub struct Submission {
    /// The file, as written.
    pub file: Spanned<String>,
    /// The same from where the program looks: the key in
    /// [`Configuration::included`](crate::Configuration::included).
    pub path: PathBuf,
    /// The place of this mission that enters it.
    pub enter: Option<Spanned<String>>,
    /// The place of this mission that it leaves to.
    pub leave: Option<Spanned<String>>,
}
