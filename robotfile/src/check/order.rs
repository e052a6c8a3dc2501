//! Transitions that compete: one that another always precedes, and two between which only the order
//! in the file decides. Both are found if the conditions of one are a subset of the other's;
//! conflicts that depend on the marking need the analysis of the net.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::{Guard, Name, implies};
use crate::mission::{ArcKind, Autonomy, Class, Mission, Transition};

/// The limit for compared conditions: four thousand transitions from one place must not take
/// minutes.
const MAX_COMPARED: usize = 2_000_000;
/// The comparison of two guards takes as long as that of so many conditions.
const IMPLICATION: usize = 50;

pub(super) fn check(mission: &Mission, findings: &mut Findings) {
    let safety = mission.places.iter().filter(|place| place.class == Class::Safety);
    let safety: BTreeSet<_> = safety.map(|place| place.name.value.as_str()).collect();
    let is_measured = |name: &Name| {
        name.data().is_some()
            || mission
                .variables
                .iter()
                .any(|it| it.name.value == name.as_str() && it.source.is_some())
    };
    let all = mission.transitions.iter().map(|t| {
        let conditions = Conditions::of(t, &safety);
        let mut names = conditions.guard.iter().flat_map(Guard::names);
        let is_measured = names.any(is_measured);
        Conditions { is_measured, ..conditions }
    });
    let all: Vec<_> = all.collect();
    let mut by_place: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, conditions) in all.iter().enumerate() {
        for place in conditions.needs.keys() {
            by_place.entry(place).or_default().push(index);
        }
    }
    let mut compared = 0;
    for (index, conditions) in all.iter().enumerate() {
        let competing = conditions.needs.keys().flat_map(|place| &by_place[place]).copied();
        for other in competing.filter(|other| *other != index) {
            compared += conditions.len() + all[other].len();
            if compared > MAX_COMPARED {
                return;
            }
            if let Some(mut finding) = conditions.hindered_by(&all[other], other < index) {
                if finding.code == Code::NeverFires {
                    let pair = [&all[other], conditions];
                    let hint = pair.iter().find_map(|it| it.suggest_exchange(mission, &all));
                    if let Some(hint) = hint {
                        finding.remedy = format!("{hint} Otherwise {}", finding.remedy);
                    }
                }
                findings.push(finding);
                break;
            }
            compared += IMPLICATION;
            if let Some(finding) = conditions.preempted_by_guard(&all[other]) {
                findings.push(finding);
                break;
            }
        }
    }
}

/// When a transition can fire.
struct Conditions<'a> {
    transition: &'a Transition,
    /// The tokens required in each place.
    needs: BTreeMap<&'a str, u32>,
    /// The number of tokens that each place must stay below.
    inhibitors: BTreeMap<&'a str, u32>,
    is_safety: bool,
    /// Whether not all of its conditions could be read.
    is_vague: bool,
    guard: Option<Guard>,
    /// Whether the guard changes with data while the places stay marked.
    is_measured: bool,
    earliest: Duration,
    latest: Option<Duration>,
}

impl<'a> Conditions<'a> {
    fn of(transition: &'a Transition, safety: &BTreeSet<&str>) -> Self {
        let (mut needs, mut inhibitors) = (BTreeMap::new(), BTreeMap::new());
        for arc in &transition.arcs {
            let place = arc.place.value.as_str();
            match arc.kind {
                ArcKind::Take | ArcKind::Read => {
                    let most: &mut u32 = needs.entry(place).or_default();
                    *most = arc.weight.max(*most);
                }
                ArcKind::Inhibitor => {
                    let least = inhibitors.entry(place).or_insert(arc.weight);
                    *least = arc.weight.min(*least);
                }
                ArcKind::Put | ArcKind::Reset => {}
            }
        }
        let interval = transition.interval.as_ref().map(|interval| interval.value);
        let guard = transition.when.as_ref().map(|when| Guard::parse(&when.value));
        Self {
            transition,
            needs,
            inhibitors,
            is_safety: transition.class == Class::Safety
                || transition.outputs().any(|arc| safety.contains(arc.place.value.as_str())),
            is_vague: transition.is_doubtful || guard.as_ref().is_some_and(Result::is_err),
            guard: guard.and_then(Result::ok),
            is_measured: false,
            earliest: interval.map_or(Duration::ZERO, |interval| interval.earliest),
            latest: interval.map_or(Some(Duration::ZERO), |interval| interval.latest),
        }
    }

    fn len(&self) -> usize {
        self.needs.len() + self.inhibitors.len()
    }

    /// Returns a finding if `other` prevents this transition from firing although it is enabled.
    fn hindered_by(&self, other: &Self, other_is_first: bool) -> Option<Finding> {
        let name = &other.transition.name.value;
        // Two of one name are an error already.
        if self.is_manual() || other.is_manual() || *name == self.transition.name.value {
            return None;
        }
        let always = other.is_met_with(self);
        let is_free = other.transition.on.is_none() && other.transition.when.is_none();
        // The clock of one that waits for a report starts only with that.
        let is_earlier = other.latest.is_some_and(|latest| {
            latest < self.earliest
                || (latest == self.earliest && !latest.is_zero() && self.transition.on.is_some())
        });
        // A pause stops all clocks but those of safety.
        if always && is_free && is_earlier && (other.is_safety || !self.is_safety) {
            return Some(self.never_fires(other, &format!("{name} always fires before it")));
        }
        // Its guard would have to be true from the first moment on.
        let is_as_late = other.latest == Some(self.earliest) && !self.earliest.is_zero();
        let waits_for_data = self.is_measured && self.latest.is_none();
        if always && is_free && is_as_late && waits_for_data && other.rank() >= self.rank() {
            return Some(self.report_as_late(other));
        }
        if !self.has_same_moment(other) {
            return None;
        }
        match other.rank().cmp(&self.rank()) {
            Ordering::Greater if always => Some(self.never_fires(
                other,
                &format!("{name} can always fire at the same moment, and has priority"),
            )),
            Ordering::Equal if other_is_first && (always || self.is_met_with(other)) => {
                Some(self.decided_by_order(other))
            }
            _ => None,
        }
    }

    /// Returns a finding if `other` waits for its guard alone, which is true whenever the guard of this one
    /// is, and fires first then.
    fn preempted_by_guard(&self, other: &Self) -> Option<Finding> {
        let (guard, of_other) = (self.guard.as_ref()?, other.guard.as_ref()?);
        let name = &other.transition.name.value;
        let is_decided =
            !self.is_manual() && !other.is_manual() && *name != self.transition.name.value;
        let is_immediate = other.transition.on.is_none() && other.latest == Some(Duration::ZERO);
        // A pause stops all clocks but those of safety.
        let is_first = other.rank() > self.rank()
            || (!self.earliest.is_zero() && (other.is_safety || !self.is_safety));
        let always = is_decided && is_immediate && is_first && other.is_met_with(self);
        if !always || !implies(guard, of_other) {
            return None;
        }
        let (when, of_other) = (&self.transition.when, &other.transition.when);
        let (when, of_other) = (&when.as_ref()?.value, &of_other.as_ref()?.value);
        let why = format!("{name} fires before it: `{of_other}` is true whenever `{when}` is");
        Some(self.never_fires(other, &why).remedy("change one of the two guards"))
    }

    /// Asks whether from and to of the transition are exchanged, if it leads from the one place to the
    /// other, and would neither hinder others nor be hindered in the other direction.
    fn suggest_exchange(&self, mission: &Mission, all: &[Self]) -> Option<String> {
        let own = self.transition;
        let is_plain = own.arcs.iter().all(|arc| arc.weight == 1) && own.arcs.len() == 2;
        let (from, to) = (own.inputs().next()?, own.outputs().next()?);
        let (from, to) = (from.place.value.as_str(), to.place.value.as_str());
        let mut ends = mission.goal.iter().chain(&mission.safe);
        if !is_plain || from == to || ends.any(|end| end.value == to) {
            return None;
        }
        let is_active = |name: &str| mission.place(to).is_some_and(|place| place.activates(name));
        if let Some(on) = &own.on
            && mission.controls(&on.component.value)
            && !is_active(&on.component.value)
        {
            return None;
        }
        // A token comes to that place all the same.
        let others = || all.iter().filter(|it| it.transition.name.value != own.name.value);
        let is_entered = mission.place(to).is_some_and(|place| place.initial > 0)
            || others().any(|it| it.transition.outputs().any(|arc| arc.place.value == to))
            || mission
                .submissions
                .iter()
                .filter_map(|it| it.leave.as_ref())
                .any(|it| it.value == to);
        // And from there nothing leads on at the same moment, or after a time.
        let is_free = |it: &Self| it.transition.on.is_none() && it.transition.when.is_none();
        let competes = |it: &&Self| {
            !it.is_manual()
                && it.transition.inputs().any(|arc| arc.place.value == to)
                && (it.has_same_moment(self) || (is_free(it) && it.latest.is_some()))
        };
        (is_entered && !others().any(|it| competes(&it)))
            .then(|| format!("did you mean from=\"{to}\" to=\"{from}\" in {}?", own.name.value))
    }

    /// Returns whether an operator, a date or an unreadable condition decides, so that the moment
    /// is unknown.
    fn is_manual(&self) -> bool {
        let t = self.transition;
        self.is_vague
            || t.autonomy != Autonomy::Auto
            || t.not_before.is_some()
            || t.not_after.is_some()
    }

    /// Returns whether this transition has its tokens whenever `other` has.
    fn is_met_with(&self, other: &Self) -> bool {
        let needs =
            self.needs.iter().all(|(place, n)| other.needs.get(place).is_some_and(|m| m >= n));
        let inhibitors = self.inhibitors.iter();
        let mut inhibitors =
            inhibitors.map(|(place, n)| other.inhibitors.get(place).is_some_and(|m| m <= n));
        needs && inhibitors.all(|met| met)
    }

    /// Returns whether both are enabled at the same moments, given their tokens.
    fn has_same_moment(&self, other: &Self) -> bool {
        let event =
            |t: &'a Transition| t.on.as_ref().map(|on| (&on.component.value, &on.event.value));
        let guard = |t: &'a Transition| t.when.as_ref().map(|when| &when.value);
        (self.earliest, self.latest) == (other.earliest, other.latest)
            && event(self.transition) == event(other.transition)
            && guard(self.transition) == guard(other.transition)
    }

    fn rank(&self) -> (bool, i32) {
        (self.is_safety, self.transition.priority)
    }

    fn never_fires(&self, other: &Self, why: &str) -> Finding {
        let name = &self.transition.name;
        let message = format!("{} never fires: {why}", name.value);
        Finding::new(Code::NeverFires, &name.at, message)
            .remedy("give one of the two another condition, time or priority, or remove this one")
            .related(&other.transition.name.at, "this one")
            .stops_transition()
    }

    /// The finding for one whose guard must be true for as long as `other` waits.
    fn report_as_late(&self, other: &Self) -> Finding {
        let (name, late) = (&self.transition.name, &other.transition.name);
        let time = |it: &Self| it.transition.interval.as_ref().map_or("", |it| it.at.text());
        let when = self.transition.when.as_ref().map_or("", |when| when.value.as_str());
        let message = format!(
            "{} fires after `{when}` has been true for {}, and {} leaves the place at that moment: \
             only if it is true from the first moment on, the order in the file decides",
            name.value,
            time(self),
            late.value
        );
        Finding::new(Code::Tie, &name.at, message)
            .remedy(format!(
                "write a shorter after=\"…\" here, or a longer time for {}",
                late.value
            ))
            .related(&late.at, "this one leaves the place")
    }

    fn decided_by_order(&self, other: &Self) -> Finding {
        let (name, first) = (&self.transition.name, &other.transition.name);
        let message = format!(
            "{} and {} can fire at the same moment, and only the order in the file decides",
            first.value, name.value
        );
        let on = self.transition.on.as_ref();
        let failed = on.filter(|_| [self, other].iter().all(|it| it.transition.is_on_failure()));
        // With priority on the other one, the one that needs more tokens would never fire.
        let preferred = match (other.is_met_with(self), self.is_met_with(other)) {
            (true, true) => None,
            (true, false) => Some(&name.value),
            (false, _) => Some(&first.value),
        };
        let rank = self.transition.priority.saturating_add(1);
        let otherwise = match preferred {
            Some(preferred) => format!("write priority=\"{rank}\" on {preferred}"),
            None => "give one of them another condition, or remove it".to_owned(),
        };
        let remedy = match failed {
            Some(on) => format!(
                "was on=\"{}.done\" meant for one of them? Otherwise {otherwise}",
                on.component.value
            ),
            None => otherwise,
        };
        Finding::new(Code::Tie, &name.at, message)
            .remedy(remedy)
            .related(&first.at, "this one fires first now")
    }
}
