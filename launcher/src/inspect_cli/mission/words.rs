//! A marking as text.

use armor_inspect::words::{describe_enabled, format_duration, transition_clock};
use armor_marking::{
    ChangeState, Confirmation, DateStand, DateWindow, FlightPhase, GuardTruth, Holder, InFlight,
    MarkedPlace, Marking, MissedAction, MissionChange, MissionComponent, OrderGiven,
    UnansweredAction, VariableValue, WaitingTransition,
};

/// Formats a marking that was sent `age_s` ago. `file`: the problem of the file on the disk, if
/// there is one.
pub fn format_marking(marking: &Marking, age_s: f64, file: Option<&str>) -> String {
    let now_s = marking.now_at_s + age_s;
    let mut out = format!(
        "mission {}: {}, {} after its start, {} fired\n",
        marking.mission,
        marking.stage,
        format_duration(now_s),
        marking.fired
    );
    if !marking.clock.is_empty() {
        out += &format!("its time follows {}\n", marking.clock);
    }
    if !marking.why.is_empty() {
        out += &format!("because {}\n", marking.why);
    }
    if let Some(pause) = &marking.pause {
        let rest = if pause.at_rest { "" } else { "; not everything has come to rest yet" };
        let for_s = format_duration(now_s - pause.since_at_s);
        out += &format!("paused by {} for {for_s}{rest}\n", pause.by);
    }
    if let Some(at_s) = marking.link_lost_at_s {
        let for_s = format_duration(now_s - at_s);
        out += &format!("the link to the operator has been lost for {for_s}\n");
    }
    if marking.version_since_at_s > 0.0 {
        let for_s = format_duration(now_s - marking.version_since_at_s);
        out += &format!("version {} of the file has been played for {for_s}\n", marking.version);
    }
    marking.change.iter().for_each(|it| out += &format_change(it, marking.version));
    file.iter().for_each(|problem| out += &format!("{problem}\n"));
    let mut rows = Vec::new();
    let mut section = |name: &str, lines: Vec<String>| {
        let lines = if lines.is_empty() { vec!["none".into()] } else { lines };
        for (number, line) in lines.into_iter().enumerate() {
            rows.push((if number == 0 { name.to_owned() } else { String::new() }, line));
        }
    };
    let paused = marking.pause.is_some();
    section("marked", marking.places.iter().map(|it| format_place(it, marking, paused)).collect());
    section("in flight", marking.in_flight.iter().map(format_in_flight).collect());
    // Whose clock is stopped stands where it stood when the pause began.
    let clock_s = transition_clock(marking, now_s);
    let can_fire = marking.enabled.iter().map(|it| describe_enabled(it, clock_s(it.held)));
    section("can fire", can_fire.collect());
    if !marking.waiting.is_empty() {
        section("waits", marking.waiting.iter().map(|it| format_waiting(it, marking)).collect());
    }
    if !marking.confirmations.is_empty() {
        let asked = marking.confirmations.iter();
        section("asks", asked.map(|it| format_confirmation(it, now_s)).collect());
    }
    if let Some(holder) = &marking.holder {
        section("command", vec![in_command(holder, now_s)]);
    }
    if !marking.variables.is_empty() {
        section("variables", marking.variables.iter().map(format_variable).collect());
    }
    if !marking.guards.is_empty() {
        section("guards", marking.guards.iter().map(format_guard).collect());
    }
    let dates: Vec<_> = marking.dates.iter().filter_map(|it| format_date(it, now_s)).collect();
    if !dates.is_empty() {
        section("dates", dates);
    }
    section("components", marking.components.iter().map(format_component).collect());
    let history = marking.history.iter();
    section(
        "fired",
        history.map(|it| format!("{} at {:.1} s", it.transition, it.fired_at_s)).collect(),
    );
    if !marking.orders.is_empty() {
        section("orders", marking.orders.iter().map(format_order).collect());
    }
    for (name, line) in rows {
        out += &format!("{name:10}  {line}\n");
    }
    if marking.late_reports + marking.unheard_reports > 0 {
        let unheard = marking.components.iter().filter(|it| it.unheard_reports > 0);
        let unheard = unheard.map(|it| format!("{} {}", it.component, it.unheard_reports));
        let unheard = unheard.collect::<Vec<_>>().join(", ");
        let of = if unheard.is_empty() { String::new() } else { format!(" ({unheard})") };
        out += &format!(
            "reports that changed nothing: {} too late, {} that no transition waits for{of}\n",
            marking.late_reports, marking.unheard_reports
        );
    }
    if marking.unwritten_orders > 0 {
        let orders = marking.unwritten_orders;
        out += &format!(
            "orders that are not in the journal, as too many were refused or changed nothing: {orders}\n"
        );
    }
    out
}

/// What becomes of a newer version of the file.
fn format_change(change: &MissionChange, played: u64) -> String {
    let MissionChange { version, state, why, changes } = change;
    let mut out = match state {
        ChangeState::Refused => {
            format!("version {version} of the file is refused, {played} continues: {why}\n")
        }
        ChangeState::Waiting => {
            format!("version {version} of the file waits, {played} continues: {why}\n")
        }
        ChangeState::Reading => {
            format!("version {version} of the file is being read, {played} continues\n")
        }
    };
    changes.iter().for_each(|change| out += &format!("            {change}\n"));
    out
}

fn format_place(place: &MarkedPlace, marking: &Marking, paused: bool) -> String {
    let tokens = if place.tokens == 1 { String::new() } else { format!(" x {}", place.tokens) };
    let waits = if place.waits_for.is_empty() || paused {
        String::new()
    } else {
        let state_of = |name: &String| {
            let component = marking.components.iter().find(|it| it.component == *name);
            let state = component.map_or("unseen", |it| it.state.as_str());
            format!("{name} ({state})")
        };
        let down: Vec<_> = place.waits_for.iter().map(state_of).collect();
        format!("  waits for the start of {}", down.join(", "))
    };
    format!("{}{tokens}{waits}", place.place)
}

/// Formats what a transition waits for: tokens or a date, its report, its guard with the values
/// that this reads.
fn format_waiting(waiting: &WaitingTransition, marking: &Marking) -> String {
    let WaitingTransition { transition, from, report, guard, hindrance } = waiting;
    let report = report.split_once('.');
    let report = report.map(|(component, report)| format!("the report {report} of {component}"));
    let truth = marking.guards.iter().find(|it| *guard && it.transition == *transition);
    let truth = truth.map(|it| {
        let GuardTruth { guard, truth, because, .. } = it;
        let because = if because.is_empty() { String::new() } else { format!(": {because}") };
        format!("its guard {guard}, which is {truth}{because}")
    });
    let waits: Vec<_> = report.into_iter().chain(truth).collect();
    let waits = if waits.is_empty() {
        String::new()
    } else {
        format!(" waits for {}", waits.join(", and for "))
    };
    let separator = if waits.is_empty() { ":" } else { ";" };
    let hindrance =
        if hindrance.is_empty() { String::new() } else { format!("{separator} {hindrance}") };
    format!("{transition} (from {}){waits}{hindrance}", from.join(", "))
}

fn format_in_flight(flight: &InFlight) -> String {
    let waits = if flight.waits_for.is_empty() {
        String::new()
    } else {
        let what = match flight.phase {
            FlightPhase::Stopping => "stop",
            FlightPhase::Starting => "start",
        };
        format!(", waits for the {what} of {}", flight.waits_for.join(", "))
    };
    let (from, to) = (flight.from.join(" "), flight.to.join(" "));
    format!("{}: {from} -> {to}, {}{waits}", flight.cause, flight.phase)
}

fn format_variable(variable: &VariableValue) -> String {
    let outside = match variable.outside {
        0 => String::new(),
        n => format!("  ({n} values were outside of its domain)"),
    };
    format!("{} is {}{outside}", variable.variable, variable.value)
}

fn format_guard(guard: &GuardTruth) -> String {
    let because = if guard.because.is_empty() { "" } else { ": " };
    format!("{}: {} is {}{because}{}", guard.transition, guard.guard, guard.truth, guard.because)
}

/// Formats what waits for a date, or has missed it; none if the date no longer matters.
fn format_date(stand: &DateStand, now_s: f64) -> Option<String> {
    let DateStand { transition, not_before, not_after, missed, next_at_s, .. } = stand;
    let left = match next_at_s {
        Some(at_s) => format!(", in {}", format_duration((at_s - now_s).max(0.0))),
        None => String::new(),
    };
    match (stand.phase, not_before, not_after) {
        (DateWindow::Early, Some(date), _) => {
            Some(format!("{transition} waits until {date}{left}"))
        }
        (DateWindow::Open, _, Some(date)) => {
            Some(format!("{transition} may fire until {date}{left}"))
        }
        (DateWindow::Past, _, Some(date)) if !stand.used => {
            let so = match missed {
                MissedAction::Fire => "it fires once, late",
                MissedAction::Fail => "the mission fails as soon as tokens wait for it",
                MissedAction::Skip => "it fires no more",
            };
            Some(format!("{transition} has missed {date}: {so}"))
        }
        (DateWindow::Early | DateWindow::Open | DateWindow::Past, _, _) => None,
    }
}

fn format_confirmation(asked: &Confirmation, now_s: f64) -> String {
    let what = match asked.unanswered {
        UnansweredAction::Fire => "fires",
        UnansweredAction::Decline => "does not fire",
    };
    let answer = match asked.answer_by_at_s {
        None => "waits for an answer".to_owned(),
        Some(_) if asked.put_off => "its time for an answer stands still".to_owned(),
        Some(by_s) => format!("without an answer it {what} in {}", format_duration(by_s - now_s)),
    };
    format!("{}: {answer}", asked.transition)
}

fn in_command(holder: &Holder, now_s: f64) -> String {
    let Holder { author, from, since_at_s, runs_out_at_s, .. } = holder;
    let for_s = format_duration(now_s - since_at_s);
    match runs_out_at_s {
        None => format!("{author} ({from}) for {for_s}"),
        Some(out_s) => {
            let left = format_duration((out_s - now_s).max(0.0));
            format!("{author} ({from}), whose link is down; it counts as lost in {left}")
        }
    }
}

fn format_order(order: &OrderGiven) -> String {
    let verdict = if order.accepted { "" } else { "refused: " };
    let OrderGiven { author, order, given_at_s, text, .. } = order;
    format!("{author}: {order} at {given_at_s:.1} s; {verdict}{text}")
}

fn format_component(component: &MissionComponent) -> String {
    let always = if component.controlled { "" } else { "  (not controlled by the mission)" };
    let given = component.values.iter().map(|given| format!("{}={}", given.parameter, given.value));
    let given: Vec<_> = given.collect();
    let with = if given.is_empty() { String::new() } else { format!(" with {}", given.join(", ")) };
    format!("{} {}{with}{always}", component.component, component.state)
}

#[cfg(test)]
pub mod tests;
