//! How firings move on, and what follows when a component does not stop, does not start, fails or
//! stays away.

use super::blocked_starts::{BlockedStarts, is_kept_waiting};
use super::context::Context;
use super::wishes::{components_now, components_of, is_settled_off, is_up, wants_off};
use crate::ledger::{Firing, Phase};
use crate::record::JournalEntry;
use crate::roster::{Doing, ProcessPresence};
use crate::terms::{Cause, ComponentReport};
use armor_petri::PlaceId;
use armor_plan::ComponentId;
use std::time::Duration;

/// The phase of a firing that went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Half {
    Stop,
    Start,
}

/// Moves firings on. Their only state beyond the ledger are the starts that are blocked.
#[derive(Clone, Debug, Default)]
pub(super) struct FiringProgress {
    blocked: BlockedStarts,
}

impl FiringProgress {
    /// Notes the starts that nothing will unblock.
    pub(super) fn notice_blocked_starts(&mut self, cx: &mut Context) {
        self.blocked.notice_stuck(cx);
    }

    /// Returns when the next blocked start has waited for long enough, in mission time.
    pub(super) fn blocked_until(&self, cx: &Context) -> Option<Duration> {
        self.blocked.next_due(cx)
    }

    /// Takes every firing in flight as far as it gets. `unstopped`: the components that had to be
    /// killed, or could not be.
    ///
    /// A firing has two phases, and each waits for confirmations: while it stops, every component
    /// of the places it leaves must confirm that it rests; only then it starts those of the places
    /// it leads to, and its tokens are put when these have confirmed. So no component starts while
    /// one that it replaces still runs, and a restarted executive finds each firing at a phase that
    /// the journal names.
    pub(super) fn advance_firings(&mut self, cx: &mut Context, unstopped: Vec<ComponentId>) {
        for component in unstopped {
            blame_for_not_stopping(cx, component);
        }
        let numbers: Vec<_> = cx.ledger().firings().keys().copied().collect();
        for number in numbers {
            // One that was moved on before may have ended this one, by a retreat.
            let firing = cx.ledger().firings().get(&number);
            match firing.filter(|firing| !cx.ledger().is_held(firing)).map(|firing| firing.phase) {
                Some(Phase::Stopping) => move_on_stopping(cx, number),
                Some(Phase::Starting) => self.move_on_starting(cx, number),
                None => {}
            }
        }
    }

    fn move_on_starting(&self, cx: &mut Context, number: u64) {
        let firing = &cx.ledger().firings()[&number];
        let wanted = |component: &ComponentId| cx.ledger().activates_now(&firing.to, *component);
        let since = cx.host_times().since(number);
        let renewing = firing.renewing().iter().any(wanted);
        let components = components_now(cx, &firing.to);
        let failed = components.iter().find_map(|component| start_failure(cx, firing, *component));
        if let Some(why) = failed {
            return fail_firing(cx, number, Half::Start, &why);
        }
        if !renewing && components.iter().all(|component| is_up(cx, *component)) {
            return cx.record_entry(JournalEntry::Put { firing: number });
        }
        if let Some(why) = self.blocked.failure_of(cx, number) {
            return fail_firing(cx, number, Half::Start, &why);
        }
        let late = |c: &&ComponentId| {
            !is_up(cx, **c)
                && !is_kept_waiting(cx, **c)
                && cx.host() >= up_deadline(cx, **c, Some(since))
        };
        if let Some(late) = components.iter().find(late) {
            let name = &cx.plan().component(*late).name;
            let why = format!("`{name}` did not start: {}", describe_absence(cx, *late));
            fail_firing(cx, number, Half::Start, &why);
        }
    }
}

/// Acts on failures that belong to no firing: of marked places, and of components that are always
/// on.
pub(super) fn notice_failures(cx: &mut Context) {
    for component in cx.plan().component_ids() {
        if !cx.is_playing() {
            return;
        }
        notice_absence(cx, component);
        let Some(reason) = cx.ledger().activation(component).failed.clone() else {
            continue;
        };
        let planned = cx.plan().component(component);
        let why = format!("`{}` failed: {reason}", planned.name);
        if planned.places.is_empty() {
            let heard = !cx.plan().listeners(component, "failed").is_empty();
            if planned.controllable && !heard {
                cx.retreat(&why);
            }
            continue;
        }
        for place in planned.places.clone() {
            let marked = cx.ledger().state().tokens(place) > 0 && cx.ledger().plays(place);
            if marked && !is_heard_failing(cx, place, component) {
                fail_place(cx, place, component, &why);
            }
        }
    }
}

/// Returns until when components that should be up are waited for.
pub(super) fn patience_due(cx: &Context) -> impl Iterator<Item = Duration> {
    let in_flight = cx.ledger().firings().iter();
    let firings = in_flight.filter(|(_, f)| f.is_starting() && !cx.ledger().is_held(f));
    let starting = firings.flat_map(move |(number, firing)| {
        let since = cx.host_times().since(*number);
        let wanted = components_now(cx, &firing.to);
        // A blocked start has its own deadline, in mission time.
        let waits = |c: &ComponentId| !is_up(cx, *c) && !is_kept_waiting(cx, *c);
        let down = wanted.into_iter().filter(waits);
        down.map(move |component| up_deadline(cx, component, Some(since)))
    });
    let playing = cx.is_playing();
    let standing = cx.plan().component_ids().filter(move |c| playing && is_missed(cx, *c));
    starting
        .chain(standing.map(|component| up_deadline(cx, component, None)))
        .filter(move |_| !cx.is_stopping())
}

/// Whether a component should be on, for a marked place or always, and is not.
fn is_missed(cx: &Context, component: ComponentId) -> bool {
    let planned = cx.plan().component(component);
    let wanted = planned.places.is_empty() || cx.ledger().runs(component);
    let known = cx.ledger().activation(component).failed.is_some();
    wanted && planned.controllable && !known && !is_up(cx, component)
}

/// Records the failure of a component that stays away for too long: a report like any other.
fn notice_absence(cx: &mut Context, component: ComponentId) {
    if !is_missed(cx, component) || cx.host() < up_deadline(cx, component, None) {
        return;
    }
    let reason = describe_absence(cx, component);
    let component = cx.plan().component(component).name.clone();
    let report = ComponentReport::Failed { reason };
    cx.record_entry(JournalEntry::Heard { component, instance: 0, serial: 0, report });
}

fn fail_place(cx: &mut Context, place: PlaceId, component: ComponentId, why: &str) {
    let Some(refuge) = cx.plan().place(place).on_failure else {
        return cx.retreat(why);
    };
    let cause = Cause::Failure {
        place: cx.plan().net().place(place).to_owned(),
        component: cx.plan().component(component).name.clone(),
    };
    let from = [(place, cx.ledger().state().tokens(place))];
    cx.begin_firing(cause, &from, &[(refuge, 1)]);
}

fn is_heard_failing(cx: &Context, place: PlaceId, component: ComponentId) -> bool {
    cx.plan().is_heard_from(place, component, "failed")
}

/// Redirects the firings that waited for a component which had to be killed, or could not be.
fn blame_for_not_stopping(cx: &mut Context, component: ComponentId) {
    let name = &cx.plan().component(component).name;
    let why = match cx.roster.of(component).activation {
        0 => format!("`{name}` could not be made to stop: {}", describe_absence(cx, component)),
        _ => format!("`{name}` did not stop when requested"),
    };
    let waits = |firing: &Firing| {
        firing.phase == Phase::Stopping
            && cx.plan().component(component).places.iter().any(|p| firing.leaving().contains(p))
    };
    let firings = cx.ledger().firings().iter();
    let blamed: Vec<_> = firings.filter(|f| waits(f.1)).map(|f| *f.0).collect();
    if blamed.is_empty() && cx.roster.of(component).unstoppable {
        cx.retreat(&why);
    }
    for number in blamed {
        fail_firing(cx, number, Half::Stop, &why);
    }
}

fn move_on_stopping(cx: &mut Context, number: u64) {
    let firing = &cx.ledger().firings()[&number];
    let leaving: Vec<_> = firing.leaving().iter().map(|place| (*place, 1)).collect();
    let waits =
        |component: &ComponentId| wants_off(cx, *component) && !is_settled_off(cx, *component);
    let leaving = components_of(cx, &leaving);
    if !leaving.iter().chain(firing.renewing()).any(waits) {
        cx.record_entry(JournalEntry::Stopped { firing: number });
    }
}

/// Returns why a firing fails: a component that was started for it has reported a failure, and no
/// transition of the place waits for that.
fn start_failure(cx: &Context, firing: &Firing, component: ComponentId) -> Option<String> {
    let reason = cx.ledger().activation(component).failed.as_ref()?;
    let heard = |arc: &(PlaceId, u32)| {
        cx.plan().place(arc.0).components.contains(&component)
            && is_heard_failing(cx, arc.0, component)
    };
    let name = &cx.plan().component(component).name;
    let excused = firing.renewing().contains(&component) || firing.to.iter().any(heard);
    (!excused).then(|| format!("`{name}` failed: {reason}"))
}

fn fail_firing(cx: &mut Context, number: u64, half: Half, why: &str) {
    let Some(firing) = cx.ledger().firings().get(&number) else {
        return;
    };
    let refuge = match &firing.cause {
        Cause::Transition(name) if !firing.redirected => {
            let planned = cx.plan().transition_named(name).map(|id| cx.plan().transition(id));
            planned.and_then(|t| match half {
                Half::Stop => t.on_stop_fail,
                Half::Start => t.on_start_fail,
            })
        }
        Cause::Retreat => {
            return cx.record_entry(JournalEntry::GaveUp { why: why.to_owned() });
        }
        _ => None,
    };
    match refuge {
        Some(place) => {
            let to = cx.ledger().tokens_named(&[(place, 1)]);
            cx.record_entry(JournalEntry::Redirected { firing: number, to, why: why.to_owned() });
        }
        None => cx.retreat(why),
    }
}

/// Returns until when, in host time, a component must be up. `since`: when a firing began to start
/// it; without it, the component should have been up all along.
fn up_deadline(cx: &Context, component: ComponentId, since: Option<Duration>) -> Duration {
    let (limits, observed) = (cx.plan().limits(), cx.roster.of(component));
    let return_within = cx.plan().component(component).return_within;
    let began = cx.roster.began().max(cx.host_times().resumed());
    // A change of the file has ended its activation: it was up until then.
    let is_over = cx.ledger().is_activation_over(component);
    let changed = if is_over { cx.host_times().changed() } else { Duration::ZERO };
    let from = since.unwrap_or(Duration::ZERO).max(began).max(changed).max(observed.unblocked);
    let starting = observed.order.filter(|order| !order.stop);
    let deadline = match (observed.presence, observed.doing) {
        _ if observed.why_given_up().is_some() => from.max(observed.since),
        (ProcessPresence::Unseen, _) => from.max(began + limits.muster),
        (ProcessPresence::Here, Doing::Frozen | Doing::Active) => {
            // It waits for components that it excludes, or for its own stop; these have deadlines.
            from.max(observed.since) + limits.muster + limits.start_within
        }
        (ProcessPresence::Here, _) if starting.is_some() => {
            starting.map_or(from, |order| order.since) + limits.start_within
        }
        (ProcessPresence::Gone, _) if !cx.plan().component(component).returns => {
            from.max(observed.since)
        }
        _ => from.max(observed.since) + return_within,
    };
    match since {
        // A component that comes and goes does not get all of the time again each time.
        Some(_) => {
            let in_all = limits.muster.max(return_within) + limits.start_within * 2;
            deadline.min(from + in_all)
        }
        None => deadline,
    }
}

fn describe_absence(cx: &Context, component: ComponentId) -> String {
    let (limits, observed) = (cx.plan().limits(), cx.roster.of(component));
    if let Some(why) = observed.why_given_up() {
        return why.clone();
    }
    match observed.presence {
        ProcessPresence::Unseen => format!("it did not appear within {:?}", limits.muster),
        ProcessPresence::Gone if !cx.plan().component(component).returns => {
            "its process has ended, and restart=\"never\" leaves it so".to_owned()
        }
        ProcessPresence::Lost | ProcessPresence::Gone => {
            format!(
                "it did not come back within {:?}",
                cx.plan().component(component).return_within
            )
        }
        ProcessPresence::Here if observed.doing == Doing::Frozen => {
            "one that it excludes is not known to be off".to_owned()
        }
        ProcessPresence::Here => format!("no confirmation within {:?}", limits.start_within),
    }
}
