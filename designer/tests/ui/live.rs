//! The view of what runs, over a picture and a mission that were recorded: all states by name, what
//! links carry, where the net stands, and what an operator presses.

use std::time::Duration;

use armor_executive::{Confirmation, EnabledTransition, Fired, MarkedPlace, Marking};
use armor_look::log::Line;
use armor_look::{DEAD_AFTER, Event, MissionLook, Picture};
use armor_sdk::control::{Answer, InputStatus, LinkStatus, OutputStatus, RunState, Status};
use armor_sdk::directory::Change;
use armor_wire::registry::ComponentEntry;

use crate::Window;

const ROBOT: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <component name="idle" kind="lamp"/>
    <component name="silent" kind="lamp"/>
    <component name="back" kind="lamp"/>
    <component name="lost" kind="lamp"/>
    <link from="eye.target" to="arm.target" keep="10"/>
  </system>
  <mission name="bench" goal="home" safe="hold">
    <place name="explore" initial="true" components="arm"/>
    <place name="home"/>
    <place name="hold"/>
    <transition name="seen" from="explore" to="home" on="arm.done"/>
    <transition name="late" from="explore" to="hold" timeout="90s"/>
    <transition name="recall" from="explore" to="home" operator="true"/>
    <transition name="land" from="explore" to="home" autonomy="confirm"/>
  </mission>
</armor>
"#;

fn entry(name: &str) -> ComponentEntry {
    ComponentEntry {
        name: name.into(),
        kind: "bench".into(),
        instance: 1,
        pid: 7,
        host: "here".into(),
        endpoint: "127.0.0.1:1".into(),
    }
}

/// What the eye and the arm say of themselves, at a time and with so many data sent.
fn status(name: &str, uptime_s: f64, sent: u64) -> Status {
    let link = LinkStatus {
        to: "arm".into(),
        keep: "10".into(),
        sent,
        dropped: 0,
        queued: 0,
        paused: false,
    };
    let output = OutputStatus {
        id: "target".into(),
        data: "eye.target".into(),
        type_name: "Pose".into(),
        published: sent,
        links: vec![link],
    };
    let input = InputStatus {
        id: "target".into(),
        data: "eye.target".into(),
        connected: true,
        received: sent,
        waiting: 0,
        lost: 3,
        dropped: 0,
        connections: 1,
        problem: String::new(),
    };
    Status {
        name: name.into(),
        kind: "bench".into(),
        state: RunState::Active,
        activation: 1,
        controllable: true,
        uptime_s,
        exec_calls: 0,
        clock_offset_s: 0.0,
        clock_error_s: None,
        last_error: String::new(),
        outputs: if name == "eye" { vec![output] } else { Vec::new() },
        inputs: if name == "arm" { vec![input] } else { Vec::new() },
    }
}

/// One of each state.
fn picture() -> Picture {
    let mut picture = Picture::default();
    let mut tell = |event, now| drop(picture.handle(event, now));
    let start = Duration::ZERO;
    for name in ["eye", "arm", "idle", "silent", "back", "lost"] {
        tell(Event::Registry(Change::Appeared(entry(name))), start);
        tell(Event::Connected(name.into(), 1), start);
        let state = if name == "idle" { RunState::Frozen } else { RunState::Active };
        let answer = Answer::State { state, activation: 1, controllable: true };
        tell(Event::Said(name.into(), 1, answer), start);
    }
    tell(Event::Registry(Change::Gone(entry("lost"))), start);
    tell(Event::Tick, DEAD_AFTER);
    tell(Event::Registry(Change::Gone(entry("back"))), DEAD_AFTER);
    tell(Event::Closed("silent".into(), 1, "it fell silent".into()), DEAD_AFTER);
    for (uptime_s, sent) in [(10.0, 100), (12.0, 140)] {
        for name in ["eye", "arm"] {
            let status = status(name, uptime_s, sent);
            tell(Event::Said(name.into(), 1, Answer::Status { request: 1, status }), DEAD_AFTER);
        }
    }
    picture.link();
    picture
}

fn marking() -> Marking {
    let enabled = |name: &str, by: &str, at_s| EnabledTransition {
        transition: name.into(),
        enabled_at_s: 0.0,
        earliest_at_s: at_s,
        latest_at_s: None,
        by: by.into(),
        held: false,
    };
    Marking {
        // Nobody has said what time it is: none of it passes in the test.
        stamp: 0.0,
        mission: "bench".into(),
        now_at_s: 30.0,
        clock: String::new(),
        stage: "playing".into(),
        why: String::new(),
        places: vec![MarkedPlace { place: "explore".into(), tokens: 1, active: true }],
        in_flight: Vec::new(),
        enabled: vec![
            enabled("recall", "operator", 0.0),
            enabled("land", "confirmation", 0.0),
            enabled("late", "mission", 90.0),
        ],
        variables: Vec::new(),
        guards: Vec::new(),
        dates: Vec::new(),
        components: Vec::new(),
        fired: 1,
        history: vec![Fired { transition: "began".into(), fired_at_s: 0.0 }],
        late_reports: 0,
        unheard_reports: 0,
        unwritten_orders: 0,
        pause: None,
        holder: None,
        link_lost_at_s: None,
        confirmations: vec![Confirmation {
            transition: "land".into(),
            asked_at_s: 20.0,
            answer_by_at_s: Some(40.0),
            unanswered: "decline".into(),
            put_off: false,
        }],
        orders: Vec::new(),
        version: 1,
        version_since_at_s: 0.0,
        change: None,
    }
}

fn watching() -> Window {
    let mut window = Window::open(Some(ROBOT));
    let live = &mut window.harness.state_mut().desk().live;
    live.show_still(picture(), MissionLook::of(marking())).unwrap();
    window.click("view: Live");
    window
}

/// The orders given in the window.
fn ordered(window: &mut Window) -> Vec<String> {
    let live = &window.harness.state_mut().desk().live;
    let given = live.watched().map(|watched| watched.orders.given()).unwrap_or_default();
    given.into_iter().map(|given| format!("{}: {}", given.author, given.order)).collect()
}

#[test]
fn blocks_and_processes_say_their_states() {
    let window = watching();
    for (name, word) in [
        ("eye", "active"),
        ("idle", "frozen"),
        ("silent", "suspected"),
        ("back", "restarting"),
        ("lost", "dead"),
    ] {
        for label in [format!("component {name}: {word}"), format!("process {name}: {word}")] {
            assert!(window.has(&label), "{label}");
        }
    }
}

#[test]
fn links_say_what_they_carry_and_the_net_where_it_stands() {
    let window = watching();
    for label in [
        "link eye.target to arm.target: 20 Hz, 3 lost",
        "place explore: marked",
        "place home: not marked",
        "transition late: late in 1 min 00 s",
        "transition land: it asks to be confirmed",
        "transition seen: not enabled",
    ] {
        assert!(window.has(label), "{label}");
    }
}

#[test]
fn an_operator_fires_confirms_and_pauses_under_a_name() {
    let mut window = watching();
    window.harness.state_mut().desk().live.author = "ruth".into();
    window.click("Fire recall");
    window.click("Decline land");
    window.click("Pause");
    window.click("Safe place");
    let first = ["ruth: fire recall", "ruth: decline land", "ruth: pause"];
    assert_eq!(ordered(&mut window), first, "the safe place is asked for twice");
    window.click("Yes, to the safe place");
    assert_eq!(ordered(&mut window).last().map(String::as_str), Some("ruth: go to the safe place"));
}

#[test]
fn the_log_of_what_is_selected_is_one_click_away() {
    let mut window = watching();
    let log = window.harness.state_mut().desk().live.log.clone();
    log.push(Line::said("eye", "INFO", "sees something"));
    log.push(Line::said("arm", "INFO", "reaches for it"));
    window.settle();
    assert!(window.has("sees something") && window.has("reaches for it"));
    window.click("process eye: active");
    window.click("Its log");
    assert!(window.has("sees something") && !window.has("reaches for it"));
    window.click("live: Fired");
    assert!(window.has("began"));
}

#[test]
fn nothing_is_linked_to_that_is_not_shown() {
    let mut window = watching();
    let linked = |window: &mut Window| {
        let live = &window.harness.state_mut().desk().live;
        live.watched().map(|watched| watched.values.linked()).unwrap_or_default()
    };
    window.click("component eye: active");
    assert_eq!(linked(&mut window), Vec::<String>::new(), "its outputs are closed");
    window.click("output eye.target of type Pose");
    assert_eq!(linked(&mut window), ["eye.target"]);
}
