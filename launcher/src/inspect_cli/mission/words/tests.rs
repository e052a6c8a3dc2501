//! Markings of every kind and their texts.

use super::*;
use armor_marking::{
    EnabledTransition, FiringDecider, MarkingStage, MissionComponentState, Paused, TruthValue,
};

pub fn marking() -> Marking {
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
        places: vec![MarkedPlace {
            place: "explore".into(),
            tokens: 1,
            active: true,
            waits_for: Vec::new(),
        }],
        in_flight: Vec::new(),
        enabled: vec![
            enabled("recall", FiringDecider::Operator, 0.0, None),
            enabled("late", FiringDecider::Mission, 150.0, Some(150.0)),
        ],
        waiting: Vec::new(),
        variables: Vec::new(),
        guards: Vec::new(),
        dates: Vec::new(),
        components: vec![MissionComponent {
            component: "explorer".into(),
            controlled: true,
            state: MissionComponentState::Active,
            activation: 1,
            unheard_reports: 2,
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

pub fn variable(name: &str, value: &str) -> VariableValue {
    VariableValue {
        variable: name.into(),
        value: value.into(),
        number: value.parse().ok(),
        outside: 0,
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
reports that changed nothing: 0 too late, 2 that no transition waits for (explorer 2)
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
    marking.variables = vec![VariableValue { outside: 2, ..variable("battery", "0.42") }];
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
fn what_each_place_firing_and_transition_waits_for_is_named() {
    let mut marking = marking();
    marking.places[0].waits_for = vec!["explorer".into(), "mapper".into()];
    marking.in_flight = vec![InFlight {
        firing: 1,
        cause: "explored".into(),
        from: vec!["explore".into()],
        to: vec!["return".into()],
        phase: FlightPhase::Stopping,
        waits_for: vec!["driver".into()],
    }];
    let waiting = |transition: &str, report: &str, guard, hindrance: &str| WaitingTransition {
        transition: transition.into(),
        from: vec!["explore".into()],
        report: report.into(),
        guard,
        hindrance: hindrance.into(),
    };
    marking.waiting = vec![
        waiting("explored", "explorer.done", false, ""),
        waiting("weak", "explorer.failed", true, ""),
        waiting("meet", "", true, "its date has not come: 2026-11-21T12:00:30Z"),
        waiting("both", "", false, "`charged` holds 0 of the 1 tokens it needs"),
    ];
    let guard = |transition: &str| GuardTruth {
        transition: transition.into(),
        guard: "battery.voltage < 11V".into(),
        truth: TruthValue::False,
        because: "battery.voltage is 12.3457 V".into(),
    };
    marking.guards = vec![guard("weak"), guard("meet")];
    let expected = "\
marked      explore  waits for the start of explorer (active), mapper (unseen)
in flight   explored: explore -> return, stopping, waits for the stop of driver
can fire    recall now, by the operator
            late in 2 min 18 s
waits       explored (from explore) waits for the report done of explorer
            weak (from explore) waits for the report failed of explorer, and for its guard \
battery.voltage < 11V, which is false: battery.voltage is 12.3457 V
            meet (from explore) waits for its guard battery.voltage < 11V, which is false: \
battery.voltage is 12.3457 V; its date has not come: 2026-11-21T12:00:30Z
            both (from explore): `charged` holds 0 of the 1 tokens it needs
guards ";
    let shown = format_marking(&marking, 0.5, None);
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
    let open =
        DateStand { not_after: None, ..stand(DateWindow::Open, MissedAction::Skip, false, None) };
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
