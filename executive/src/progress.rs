//! How firings move on, and what becomes of them when a component does not stop, does not start,
//! fails or stays away.

use crate::controller::Controller;
use crate::ledger::{Firing, Phase, Stage};
use crate::record::{Cause, Entry, Report};
use crate::roster::{Doing, Presence};
use armor_petri::PlaceId;
use armor_plan::ComponentId;
use std::collections::BTreeSet;
use std::time::Duration;

/// Which half of a firing went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Half {
    Stop,
    Start,
}

impl Controller {
    /// Takes every firing in flight as far as it gets.
    pub(crate) fn move_firings_on(&mut self) {
        let unstopped = std::mem::take(&mut self.unstopped);
        for component in &unstopped {
            self.blame_for_not_stopping(*component);
        }
        let numbers: Vec<_> = self.ledger.firings.keys().copied().collect();
        for number in numbers {
            let firing = self.ledger.firings.get(&number);
            match firing.filter(|firing| !self.ledger.is_held(firing)).map(|firing| firing.phase) {
                Some(Phase::Stopping) => self.move_on_stopping(number),
                Some(Phase::Starting) => self.move_on_starting(number),
                None => {}
            }
        }
    }

    /// Failures that have no firing to answer for them: of marked places, of what is always on.
    pub(crate) fn notice_failures(&mut self) {
        for component in self.plan.component_ids() {
            if self.ledger.stage != Stage::Playing {
                return;
            }
            self.notice_absence(component);
            let Some(reason) = self.ledger.activations[component.index()].failed.clone() else {
                continue;
            };
            let planned = self.plan.component(component);
            let why = format!("`{}` failed: {reason}", planned.name);
            if planned.places.is_empty() {
                let heard = !self.plan.listeners(component, "failed").is_empty();
                if planned.controllable && !heard {
                    self.retreat(&why);
                }
                continue;
            }
            for place in planned.places.clone() {
                let marked = self.ledger.state.tokens(place) > 0 && self.ledger.plays(place);
                if marked && !self.is_heard_failing(place, component) {
                    self.fail_place(place, component, &why);
                }
            }
        }
    }

    /// When patience with a component that should be up runs out.
    pub(crate) fn patience(&self) -> impl Iterator<Item = Duration> {
        let in_flight = self.ledger.firings.iter();
        let firings = in_flight.filter(|(_, f)| f.is_starting() && !self.ledger.is_held(f));
        let starting = firings.flat_map(move |(number, firing)| {
            let since = self.host_times.since(*number);
            let wanted = self.components_now(&firing.to);
            // One that another is in the way of has all the time that this takes.
            let waits = |c: &ComponentId| !self.is_up(*c) && !self.is_kept_waiting(*c);
            let down = wanted.into_iter().filter(waits);
            down.map(move |component| self.up_deadline(component, Some(since)))
        });
        let playing = self.ledger.stage == Stage::Playing;
        let standing = self.plan.component_ids().filter(move |c| playing && self.is_missed(*c));
        starting
            .chain(standing.map(|component| self.up_deadline(component, None)))
            .filter(|_| !self.stopping)
    }

    /// A component that should be on, for a marked place or always, and is not.
    fn is_missed(&self, component: ComponentId) -> bool {
        let planned = self.plan.component(component);
        let wanted = planned.places.is_empty() || self.ledger.runs(component);
        let known = self.ledger.activations[component.index()].failed.is_some();
        wanted && planned.controllable && !known && !self.is_up(component)
    }

    /// One that stays away for too long has failed, and that is a report like any other.
    fn notice_absence(&mut self, component: ComponentId) {
        if !self.is_missed(component) || self.host < self.up_deadline(component, None) {
            return;
        }
        let reason = self.absence(component);
        let component = self.plan.component(component).name.clone();
        let report = Report::Failed { reason };
        self.record(Entry::Heard { component, instance: 0, serial: 0, report });
    }

    fn fail_place(&mut self, place: PlaceId, component: ComponentId, why: &str) {
        let Some(refuge) = self.plan.place(place).on_failure else {
            return self.retreat(why);
        };
        let cause = Cause::Failure {
            place: self.plan.net().place(place).to_owned(),
            component: self.plan.component(component).name.clone(),
        };
        let from = [(place, self.ledger.state.tokens(place))];
        self.begin(cause, &from, &[(refuge, 1)], Duration::ZERO);
    }

    fn is_heard_failing(&self, place: PlaceId, component: ComponentId) -> bool {
        self.plan.is_heard_from(place, component, "failed")
    }

    /// A component had to be killed, or could not even be: whoever waited for it goes elsewhere.
    fn blame_for_not_stopping(&mut self, component: ComponentId) {
        let name = &self.plan.component(component).name;
        let why = match self.roster.of(component).activation {
            0 => format!("`{name}` could not be made to stop: {}", self.absence(component)),
            _ => format!("`{name}` did not stop when told to"),
        };
        let waits = |firing: &Firing| {
            firing.phase == Phase::Stopping
                && self.plan.component(component).places.iter().any(|p| firing.leaving.contains(p))
        };
        let firings = self.ledger.firings.iter();
        let blamed: Vec<_> = firings.filter(|f| waits(f.1)).map(|f| *f.0).collect();
        if blamed.is_empty() && self.roster.of(component).unstoppable {
            self.retreat(&why);
        }
        for number in blamed {
            self.fail_firing(number, Half::Stop, &why);
        }
    }

    fn move_on_stopping(&mut self, number: u64) {
        let firing = &self.ledger.firings[&number];
        let leaving: Vec<_> = firing.leaving.iter().map(|place| (*place, 1)).collect();
        let waits = |component: &ComponentId| {
            self.wants_off(*component) && !self.is_settled_off(*component)
        };
        let leaving = self.components_of(&leaving);
        if !leaving.iter().chain(&firing.renewing).any(waits) {
            self.record(Entry::Stopped { firing: number });
        }
    }

    fn move_on_starting(&mut self, number: u64) {
        let firing = &self.ledger.firings[&number];
        let wanted = |component: &ComponentId| self.ledger.activates_now(&firing.to, *component);
        let since = self.host_times.since(number);
        let renewing = firing.renewing.iter().any(wanted);
        let components = self.components_now(&firing.to);
        let failed = components.iter().find_map(|component| self.start_failure(firing, *component));
        if let Some(why) = failed {
            return self.fail_firing(number, Half::Start, &why);
        }
        if !renewing && components.iter().all(|component| self.is_up(*component)) {
            return self.record(Entry::Put { firing: number });
        }
        if let Some(why) = self.waited_in_vain(number) {
            return self.fail_firing(number, Half::Start, &why);
        }
        let late = |c: &&ComponentId| {
            !self.is_up(**c)
                && !self.is_kept_waiting(**c)
                && self.host >= self.up_deadline(**c, Some(since))
        };
        if let Some(late) = components.iter().find(late) {
            let name = &self.plan.component(*late).name;
            let why = format!("`{name}` did not start: {}", self.absence(*late));
            self.fail_firing(number, Half::Start, &why);
        }
    }

    /// A component that has been started for this firing and reported a failure, which nothing in
    /// the place it was started for waits for.
    fn start_failure(&self, firing: &Firing, component: ComponentId) -> Option<String> {
        let reason = self.ledger.activations[component.index()].failed.as_ref()?;
        let heard = |arc: &(PlaceId, u32)| {
            self.plan.place(arc.0).components.contains(&component)
                && self.is_heard_failing(arc.0, component)
        };
        let name = &self.plan.component(component).name;
        let excused = firing.renewing.contains(&component) || firing.to.iter().any(heard);
        (!excused).then(|| format!("`{name}` failed: {reason}"))
    }

    fn fail_firing(&mut self, number: u64, half: Half, why: &str) {
        let Some(firing) = self.ledger.firings.get(&number) else { return };
        let refuge = match &firing.cause {
            Cause::Transition(name) if !firing.redirected => {
                let planned = self.plan.transition_named(name).map(|id| self.plan.transition(id));
                planned.and_then(|t| match half {
                    Half::Stop => t.on_stop_fail,
                    Half::Start => t.on_start_fail,
                })
            }
            Cause::Retreat => return self.record(Entry::GaveUp { why: why.to_owned() }),
            _ => None,
        };
        match refuge {
            Some(place) => {
                let to = self.ledger.tokens_named(&[(place, 1)]);
                self.record(Entry::Redirected { firing: number, to, why: why.to_owned() });
            }
            None => self.retreat(why),
        }
    }

    /// Until when, in host time, a component must be up. `since`: when a firing began to start it; without it,
    /// the component should have been up all along.
    fn up_deadline(&self, component: ComponentId, since: Option<Duration>) -> Duration {
        let (limits, observed) = (self.plan.limits(), self.roster.of(component));
        let began = self.roster.began.max(self.host_times.resumed());
        let from = since.unwrap_or(Duration::ZERO).max(began).max(observed.unblocked);
        let starting = observed.order.filter(|order| !order.stop);
        let deadline = match (observed.presence, observed.doing) {
            (Presence::Unseen, _) => from.max(began + limits.muster),
            (Presence::Here, Doing::Frozen | Doing::Active) => {
                // It waits for those it excludes, or for its own stop, which have their deadlines.
                from.max(observed.since) + limits.muster + limits.start_within
            }
            (Presence::Here, _) if starting.is_some() => {
                starting.map_or(from, |order| order.since) + limits.start_within
            }
            (Presence::Gone, _) if !self.plan.component(component).returns => {
                from.max(observed.since)
            }
            _ => from.max(observed.since) + limits.return_within,
        };
        match since {
            // One that comes and goes does not start its patience anew each time.
            Some(_) => deadline.min(from + limits.muster + limits.start_within * 2),
            None => deadline,
        }
    }

    fn absence(&self, component: ComponentId) -> String {
        let (limits, observed) = (self.plan.limits(), self.roster.of(component));
        match observed.presence {
            Presence::Unseen => format!("it did not appear within {:?}", limits.muster),
            Presence::Gone if !self.plan.component(component).returns => {
                "its process has ended, and restart=\"never\" leaves it so".to_owned()
            }
            Presence::Lost | Presence::Gone => {
                format!("it did not come back within {:?}", limits.return_within)
            }
            Presence::Here if observed.doing == Doing::Frozen => {
                "one that it excludes is not known to be off".to_owned()
            }
            Presence::Here => format!("no confirmation within {:?}", limits.start_within),
        }
    }

    /// Those of them that run now: during a pause only the ones of safety.
    pub(crate) fn components_now(&self, places: &[(PlaceId, u32)]) -> BTreeSet<ComponentId> {
        let playing = places.iter().filter(|arc| self.ledger.plays(arc.0)).copied();
        self.components_of(&playing.collect::<Vec<_>>())
    }

    fn components_of(&self, places: &[(PlaceId, u32)]) -> BTreeSet<ComponentId> {
        places.iter().flat_map(|arc| self.plan.place(arc.0).components.iter().copied()).collect()
    }
}
