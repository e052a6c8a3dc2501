//! A marking as text.

use armor_inspect::words::{describe_enabled, format_duration, transition_clock};
use armor_marking::{
    ChangeState, Confirmation, DateStand, DateWindow, GuardTruth, Holder, InFlight, MarkedPlace,
    Marking, MissedAction, MissionChange, MissionComponent, OrderGiven, UnansweredAction,
    VariableValue,
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
    section("marked", marking.places.iter().map(|it| format_place(it, paused)).collect());
    section("in flight", marking.in_flight.iter().map(format_in_flight).collect());
    // Whose clock is stopped stands where it stood when the pause began.
    let clock_s = transition_clock(marking, now_s);
    let can_fire = marking.enabled.iter().map(|it| describe_enabled(it, clock_s(it.held)));
    section("can fire", can_fire.collect());
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
        out += &format!(
            "reports that changed nothing: {} too late, {} that no transition waits for\n",
            marking.late_reports, marking.unheard_reports
        );
    }
    if marking.unwritten_orders > 0 {
        let orders = marking.unwritten_orders;
        out += &format!("orders refused that are not in the journal, as too many came: {orders}\n");
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

fn format_place(place: &MarkedPlace, paused: bool) -> String {
    let tokens = if place.tokens == 1 { String::new() } else { format!(" x {}", place.tokens) };
    let active = if place.active || paused { "" } else { "  (not all of its components run yet)" };
    format!("{}{tokens}{active}", place.place)
}

fn format_in_flight(flight: &InFlight) -> String {
    let waits = if flight.waits_for.is_empty() {
        String::new()
    } else {
        format!(", waits for {}", flight.waits_for.join(" "))
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
mod tests {
    use super::*;
    use armor_marking::{
        EnabledTransition, FiringDecider, MarkingStage, MissionComponentState, Paused, TruthValue,
    };

    fn marking() -> Marking {
        let enabled = |name: &str, by, at_s: f64, until: Option<f64>| EnabledTransition {
            transition: name.into(),
            enabled_at_s: 0.0,
            earliest_at_s: at_s,
            latest_at_s: until,
            by,
            held: false,
        };
        Marking {
            stamp: 1.7e9,
            mission: "survey".into(),
            now_at_s: 11.5,
            clock: String::new(),
            stage: MarkingStage::Playing,
            why: String::new(),
            places: vec![MarkedPlace { place: "explore".into(), tokens: 1, active: true }],
            in_flight: Vec::new(),
            enabled: vec![
                enabled("recall", FiringDecider::Operator, 0.0, None),
                enabled("late", FiringDecider::Mission, 150.0, Some(150.0)),
            ],
            variables: Vec::new(),
            guards: Vec::new(),
            dates: Vec::new(),
            components: vec![MissionComponent {
                component: "explorer".into(),
                controlled: true,
                state: MissionComponentState::Active,
                activation: 1,
                values: Vec::new(),
            }],
            fired: 0,
            history: Vec::new(),
            late_reports: 0,
            unheard_reports: 2,
            unwritten_orders: 0,
            pause: None,
            holder: None,
            link_lost_at_s: None,
            confirmations: Vec::new(),
            orders: Vec::new(),
            version: 1,
            version_since_at_s: 0.0,
            change: None,
        }
    }

    #[test]
    fn a_marking_in_words() {
        let expected = "\
mission survey: playing, 12.0 s after its start, 0 fired
marked      explore
in flight   none
can fire    recall now, by the operator
            late in 2 min 18 s
components  explorer active
fired       none
reports that changed nothing: 0 too late, 2 that no transition waits for
";
        assert_eq!(format_marking(&marking(), 0.5, None), expected);
    }

    #[test]
    fn the_version_played_and_the_one_that_is_not_are_named() {
        let mut marking = marking();
        (marking.version, marking.version_since_at_s) = (2, 10.0);
        marking.change = Some(MissionChange {
            version: 3,
            state: ChangeState::Waiting,
            why: "`explore` holds a token, and the new file has no such place".into(),
            changes: vec!["place explore removed".into()],
        });
        let expected = "\
version 2 of the file has been played for 2.0 s
version 3 of the file waits, 2 continues: `explore` holds a token, and the new file has no such place
            place explore removed
";
        let shown = format_marking(&marking, 0.5, None);
        assert!(shown.contains(expected), "{shown}");
        marking.change = Some(MissionChange {
            version: 3,
            state: ChangeState::Refused,
            why: "it has no mission any more".into(),
            changes: Vec::new(),
        });
        let shown = format_marking(&marking, 0.5, None);
        assert!(shown.contains("version 3 of the file is refused, 2 continues: it has no mission"));
    }

    #[test]
    fn variables_and_guards_are_there_if_the_mission_has_some() {
        let mut marking = marking();
        marking.variables = vec![VariableValue {
            variable: "battery".into(),
            value: "0.42".into(),
            number: Some(0.42),
            outside: 2,
        }];
        marking.guards = vec![GuardTruth {
            transition: "weak".into(),
            guard: "battery < 30%".into(),
            truth: TruthValue::False,
            because: "battery is 0.42".into(),
        }];
        let shown = format_marking(&marking, 0.5, None);
        let expected = "
variables   battery is 0.42  (2 values were outside of its domain)
guards      weak: battery < 30% is false: battery is 0.42
components  explorer active
";
        assert!(shown.contains(expected), "{shown}");
    }

    #[test]
    fn what_waits_for_a_date_and_what_has_missed_it() {
        let stand = |phase, missed, used: bool, next_at_s| DateStand {
            transition: "meet".into(),
            not_before: Some("2026-11-21T14:30:00Z".into()),
            not_after: Some("2026-11-21T14:35:00Z".into()),
            missed,
            phase,
            used,
            next_at_s,
        };
        let mut marking = marking();
        let open = DateStand {
            not_after: None,
            ..stand(DateWindow::Open, MissedAction::Skip, false, None)
        };
        marking.dates = vec![
            stand(DateWindow::Early, MissedAction::Skip, false, Some(212.0)),
            stand(DateWindow::Open, MissedAction::Skip, false, Some(312.0)),
            open,
            stand(DateWindow::Past, MissedAction::Fire, false, None),
            stand(DateWindow::Past, MissedAction::Skip, false, None),
            stand(DateWindow::Past, MissedAction::Fail, false, None),
            stand(DateWindow::Past, MissedAction::Fail, true, None),
        ];
        let shown = format_marking(&marking, 0.5, None);
        let expected = "
dates       meet waits until 2026-11-21T14:30:00Z, in 3 min 20 s
            meet may fire until 2026-11-21T14:35:00Z, in 5 min 00 s
            meet has missed 2026-11-21T14:35:00Z: it fires once, late
            meet has missed 2026-11-21T14:35:00Z: it fires no more
            meet has missed 2026-11-21T14:35:00Z: the mission fails as soon as tokens wait for it
components  explorer active
";
        assert!(shown.contains(expected), "{shown}");
    }

    #[test]
    fn who_commands_what_is_asked_and_what_was_ordered() {
        let mut marking = marking();
        marking.stage = MarkingStage::Paused;
        marking.unheard_reports = 0;
        marking.pause = Some(Paused { by: "ruth".into(), since_at_s: 10.0, at_rest: false });
        marking.enabled[1].held = true;
        marking.holder = Some(Holder {
            author: "ruth".into(),
            from: "mission-7".into(),
            since_at_s: 2.0,
            connected: false,
            runs_out_at_s: Some(15.0),
        });
        marking.confirmations = vec![Confirmation {
            transition: "land".into(),
            asked_at_s: 9.0,
            answer_by_at_s: Some(19.0),
            unanswered: UnansweredAction::Decline,
            put_off: false,
        }];
        marking.orders = vec![OrderGiven {
            given_at_s: 10.0,
            author: "sam".into(),
            order: "fire recall".into(),
            accepted: false,
            text: "ruth commands".into(),
        }];
        let expected = "\
mission survey: paused, 12.0 s after its start, 0 fired
paused by ruth for 2.0 s; not everything has come to rest yet
marked      explore
in flight   none
can fire    recall now, by the operator
            late in 2 min 20 s, once the mission resumes
asks        land: without an answer it does not fire in 7.0 s
command     ruth (mission-7), whose link is down; it counts as lost in 3.0 s
components  explorer active
fired       none
orders      sam: fire recall at 10.0 s; refused: ruth commands
";
        assert_eq!(format_marking(&marking, 0.5, None), expected);
    }
}
