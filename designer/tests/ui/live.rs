//! The view of what runs, over a picture and a mission that were recorded: all states by name, what
//! links carry, where the net stands, and what an operator presses.

use std::time::Duration;

use armor_inspect::log::LogLine;
use armor_inspect::run_control::{HostLink, HostReport};
use armor_inspect::{
    DEAD_AFTER, MissionLook, ParameterClient, SetReport, SystemEvent, SystemPicture,
};
use armor_marking::{
    Confirmation, EnabledTransition, Fired, FiringDecider, MarkedPlace, Marking, MarkingStage,
    Paused, UnansweredAction,
};
use armor_sdk::configuration::ParameterList;
use armor_sdk::control::{Answer, InputStatus, LinkStatus, OutputStatus, RunState, Status};
use armor_sdk::directory::DirectoryChange;
use armor_wire::config::{FindingRecord, FindingSeverity, ListedParameter, ListedType};
use armor_wire::manifest::ParameterType;
use armor_wire::registry::ComponentEntry;
use eframe::egui::{self, MouseWheelSource, MouseWheelUnit, TouchPhase};
use egui_kittest::kittest::Queryable;

use crate::ui::Window;
use crate::ui::still_system::{self, entry, playing};

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

/// What the eye and the arm say of themselves, at a time and with so many data sent.
fn status(name: &str, uptime_s: f64, sent: u64) -> Status {
    let link = LinkStatus {
        to: "arm".into(),
        keep: armor_wire::keep::Keep::Last { count: 10 },
        sent,
        dropped: 0,
        queued: 0,
        paused: false,
        transport: "unix".into(),
    };
    let output = OutputStatus {
        id: "target".into(),
        data: "eye.target".into(),
        type_name: "Pose".into(),
        published: sent,
        published_bytes: 0,
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
        skipped: 0,
        history_dropped: 0,
        connections: 1,
        problem: String::new(),
    };
    Status {
        uptime_s,
        outputs: if name == "eye" { vec![output] } else { Vec::new() },
        inputs: if name == "arm" { vec![input] } else { Vec::new() },
        ..still_system::status(name)
    }
}

/// One of each state.
fn picture() -> SystemPicture {
    let mut picture = SystemPicture::default();
    let mut handle = |event, now| drop(picture.handle_event(event, now));
    let start = Duration::ZERO;
    for name in ["configd", "configuration"] {
        handle(SystemEvent::Registry(DirectoryChange::Appeared(entry(name))), start);
    }
    for name in ["eye", "arm", "idle", "silent", "back", "lost"] {
        handle(SystemEvent::Registry(DirectoryChange::Appeared(entry(name))), start);
        handle(SystemEvent::Connected(name.into(), 1), start);
        let state = if name == "idle" { RunState::Frozen } else { RunState::Active };
        let answer = Answer::State { state, activation: 1, controllable: true };
        handle(SystemEvent::Answered(name.into(), 1, answer), start);
    }
    handle(SystemEvent::Registry(DirectoryChange::Gone(entry("lost"))), start);
    handle(SystemEvent::Tick, DEAD_AFTER);
    handle(SystemEvent::Registry(DirectoryChange::Gone(entry("back"))), DEAD_AFTER);
    handle(SystemEvent::Closed("silent".into(), 1, "it fell silent".into()), DEAD_AFTER);
    for (uptime_s, sent) in [(10.0, 100), (12.0, 140)] {
        for name in ["eye", "arm"] {
            let status = status(name, uptime_s, sent);
            handle(
                SystemEvent::Answered(name.into(), 1, Answer::Status { request: 1, status }),
                DEAD_AFTER,
            );
        }
    }
    picture.rebuild_links();
    picture
}

pub(super) fn marking() -> Marking {
    let enabled = |name: &str, by, at_s| EnabledTransition {
        transition: name.into(),
        enabled_at_s: 0.0,
        earliest_at_s: at_s,
        latest_at_s: None,
        by,
        held: false,
    };
    Marking {
        places: vec![MarkedPlace {
            place: "explore".into(),
            tokens: 1,
            active: true,
            waits_for: Vec::new(),
        }],
        enabled: vec![
            enabled("recall", FiringDecider::Operator, 0.0),
            enabled("land", FiringDecider::Confirmation, 0.0),
            enabled("late", FiringDecider::Mission, 90.0),
        ],
        fired: 1,
        history: vec![Fired { transition: "began".into(), fired_at_s: 0.0 }],
        confirmations: vec![Confirmation {
            transition: "land".into(),
            asked_at_s: 20.0,
            answer_by_at_s: Some(40.0),
            unanswered: UnansweredAction::Decline,
            put_off: false,
        }],
        version: 1,
        ..playing("bench", 30.0)
    }
}

/// The system after everything in it has gone, and the registry last.
fn ended() -> SystemPicture {
    let mut picture = picture();
    for name in ["configd", "configuration", "eye", "arm", "idle", "silent"] {
        picture.handle_event(SystemEvent::Closed(name.into(), 1, "it is gone".into()), DEAD_AFTER);
    }
    picture.handle_event(SystemEvent::Registry(DirectoryChange::RegistryLost), DEAD_AFTER);
    picture.rebuild_links();
    picture
}

pub(super) fn parameters() -> ParameterList {
    let speed = ListedParameter {
        component: "arm".into(),
        name: "speed".into(),
        kind: ListedType(Some(ParameterType::Number)),
        value: "0.5".into(),
        unit: "m/s".into(),
        range: "0 to 1".into(),
        ..ListedParameter::default()
    };
    ParameterList { version: 1, refused: false, parameters: vec![speed] }
}

fn watching() -> Window {
    watching_a(picture(), marking(), None)
}

/// A window on these, after a request to set a parameter with this result, if any.
fn watching_a(picture: SystemPicture, marking: Marking, result: Option<SetReport>) -> Window {
    let mut window = Window::open(Some(ROBOT));
    let live = &mut window.harness.state_mut().workspace().live;
    let parameters = ParameterClient::still(parameters(), result);
    live.show_still(picture, MissionLook::of(marking), parameters).unwrap();
    window.click("view: Live");
    window
}

/// When the window would be drawn again though nothing happens.
fn drawn_again_after(window: &Window) -> Duration {
    window.harness.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay
}

/// The orders given in the window.
fn ordered(window: &mut Window) -> Vec<String> {
    let live = &window.harness.state_mut().workspace().live;
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

/// The same on two hosts, one of which is cut off.
fn cut_off() -> SystemPicture {
    let mut picture = picture();
    let mut handle = |event| drop(picture.handle_event(event, DEAD_AFTER));
    let there = ComponentEntry { host: "far".into(), instance: 2, ..entry("arm") };
    handle(SystemEvent::Registry(DirectoryChange::Appeared(there)));
    handle(SystemEvent::Hosts(vec![HostReport {
        host: "far".into(),
        link: HostLink::CutOff,
        reason: "it has fallen silent".into(),
        for_s: 12.0,
        clock_offset_s: Some(0.25),
        clock_error_s: Some(0.001),
    }]));
    picture
}

#[test]
fn a_host_that_is_cut_off_is_shown_with_its_clock_and_what_runs_there() {
    let mut window = watching_a(cut_off(), marking(), None);
    for label in [
        "host far",
        "cut off for 12.0 s (it has fallen silent)",
        "its clock is 250.0 ms ahead of that of the launcher's host, ± 1.0 ms",
        "host here",
        "back, configd, eye, idle, lost, silent",
        "component arm: cut off on far, 1 restart",
        "component eye: active on here",
    ] {
        assert!(window.has(label), "{label}");
    }
    window.click("component arm: cut off on far, 1 restart");
    assert!(window.has("far is cut off for 12.0 s (it has fallen silent)"));
    assert!(!watching().has("component eye: active on here"), "one host is not worth a word");
}

#[test]
fn links_say_what_they_carry_and_the_net_where_it_stands() {
    let window = watching();
    for label in [
        "link eye.target to arm.target: 20 Hz, 3 lost",
        "place explore: marked",
        "place home: not marked",
        "transition late: late in 1 min 00 s",
        "transition land: asks for confirmation",
        "transition seen: not enabled",
    ] {
        assert!(window.has(label), "{label}");
    }
}

#[test]
fn an_operator_fires_confirms_and_pauses_under_a_name() {
    let mut window = watching();
    window.harness.state_mut().workspace().live.author = "ruth".into();
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
    let log = window.harness.state_mut().workspace().live.log.clone();
    log.push(LogLine::own_line("eye", "INFO", "sees something"));
    log.push(LogLine::own_line("arm", "INFO", "reaches for it"));
    window.settle();
    assert!(window.has("sees something") && window.has("reaches for it"));
    window.click("process eye: active");
    window.click("Show log");
    assert!(window.has("sees something") && !window.has("reaches for it"));
    window.click("live: Fired");
    assert!(window.has("began"));
}

#[test]
fn nothing_is_linked_to_that_is_not_shown() {
    let mut window = watching();
    let linked = |window: &mut Window| {
        let live = &window.harness.state_mut().workspace().live;
        live.watched().map(|watched| watched.values.linked()).unwrap_or_default()
    };
    window.click("component eye: active");
    assert_eq!(linked(&mut window), Vec::<String>::new(), "its outputs are closed");
    window.click("output eye.target of type Pose");
    assert_eq!(linked(&mut window), ["eye.target"]);
}

#[test]
fn a_process_of_two_names_is_one_row() {
    let window = watching();
    assert!(window.has("process configd: unknown"));
    assert!(!window.has("process configuration: unknown"));
}

#[test]
fn what_was_seen_of_a_system_stays_when_it_has_gone() {
    let running = watching();
    assert!(drawn_again_after(&running) < Duration::from_secs(1), "its clocks run");
    let mut window = watching_a(ended(), marking(), None);
    assert_eq!(drawn_again_after(&window), Duration::MAX, "no clock runs");
    assert!(window.has("It has ended or is unreachable. Last known state:"));
    assert!(window.has("process eye: ended"));
    for label in ["place explore: marked", "transition late: late in 1 min 00 s"] {
        assert!(window.has(label), "{label}");
    }
    window.click("live: Fired");
    assert!(window.has("began"));
    for label in ["Fire recall", "Confirm land", "Pause", "Safe place", "Take command"] {
        window.click(label);
    }
    assert_eq!(ordered(&mut window), Vec::<String>::new(), "no system receives orders");
    let at = window.at("Pause");
    window.harness.event(egui::Event::PointerMoved(at));
    window.until("the reason is shown", |window| window.has("It has ended or is unreachable."));
}

#[test]
fn of_a_mission_that_was_interrupted_nothing_fires_any_more() {
    let stopping = Marking { stage: MarkingStage::Stopping, ..marking() };
    let window = watching_a(picture(), stopping.clone(), None);
    assert!(window.has("stopping"));
    let window = watching_a(ended(), stopping, None);
    assert!(!window.has("stopping"), "it has ended");
    assert!(!window.has("Fire recall") && !window.has("Confirm land"));
    assert!(window.harness.query_by_label_contains("late in").is_none());
}

#[test]
fn tokens_are_moved_in_a_pause() {
    let mut marking = marking();
    let window = watching_a(picture(), marking.clone(), None);
    assert!(!window.has("Move tokens"), "only in a pause");
    marking.pause = Some(Paused { by: "ruth".into(), since_at_s: 20.0, at_rest: true });
    let mut window = watching_a(picture(), marking, None);
    window.click("Move tokens");
    window.click("a token more in hold");
    window.click("Move");
    assert_eq!(ordered(&mut window), Vec::<String>::new(), "a token cannot be made");
    window.click("a token less in explore");
    window.click("Move");
    let given = ordered(&mut window);
    assert!(given[0].ends_with(": move 1 explore to hold"), "{given:?}");
}

#[test]
fn buttons_of_an_operator_stay_under_the_pointer() {
    let mut window = watching();
    let places = |window: &Window| ["Pause", "Fire recall", "Confirm land"].map(|it| window.at(it));
    let before = places(&window);
    window.click("Pause");
    assert_eq!(ordered(&mut window).len(), 1);
    assert_eq!(places(&window), before, "the result of the order is shown");
}

#[test]
fn the_log_follows_its_newest_line_until_one_scrolls_away() {
    let mut window = watching();
    let log = window.harness.state_mut().workspace().live.log.clone();
    let say = |first: u32, last: u32| {
        (first..=last)
            .for_each(|n| log.push(LogLine::own_line("eye", "INFO", format!("line {n}"))));
    };
    window.click("live: Plots");
    say(1, 200);
    window.click("live: Log");
    assert!(window.has("line 200") && !window.has("line 1"));
    window.click("live: Fired");
    say(201, 400);
    window.click("live: Log");
    assert!(window.has("line 400"), "also after another tab");
    say(401, 402);
    window.settle();
    assert!(window.has("line 402"));

    let at = window.at("line 402");
    window.harness.event(egui::Event::PointerMoved(at));
    window.harness.event(egui::Event::MouseWheel {
        unit: MouseWheelUnit::Point,
        delta: egui::vec2(0.0, 600.0),
        phase: TouchPhase::Move,
        source: MouseWheelSource::Wheel,
        modifiers: egui::Modifiers::NONE,
    });
    window.until("it is scrolled", |window| !window.has("line 402"));
    say(403, 500);
    window.settle();
    assert!(!window.has("line 500"), "who reads older lines is left there");
}

#[test]
fn a_long_line_of_the_log_is_seen_whole() {
    let mut window = watching();
    let log = window.harness.state_mut().workspace().live.log.clone();
    log.push(LogLine::own_line("eye", "INFO", format!("{}the end", "word ".repeat(100))));
    log.push(LogLine::own_line("eye", "INFO", "the next"));
    window.settle();
    let log_of = |text: &str| window.harness.get_by_label_contains(text).rect();
    let (long, next) = (log_of("the end"), log_of("the next"));
    assert!(long.right() <= super::SIZE.x && long.height() > 1.5 * next.height());
    assert!(long.bottom() <= next.top() + 0.5);
}

#[test]
fn the_panel_beneath_is_as_high_whatever_it_shows() {
    let mut window = watching();
    let before = window.at("live: Log");
    for tab in ["live: Fired", "live: Plots", "live: Orders"] {
        window.click(tab);
        assert_eq!(window.at("live: Log"), before, "{tab}");
    }
}

#[test]
fn a_refused_value_stays_in_its_field_with_the_reason_and_the_range() {
    let finding = FindingRecord {
        severity: FindingSeverity::Error,
        code: "E0113".into(),
        message: "900 m/s is too fast".into(),
        ..FindingRecord::default()
    };
    let result = SetReport {
        parameter: "arm.speed".into(),
        value: Some("900m/s".into()),
        is_set: false,
        text: "nothing was written".into(),
        findings: vec![finding],
    };
    let mut window = watching_a(picture(), marking(), Some(result));
    window.click("process arm: active");
    window.click("Parameters");
    assert!(!window.has("E0113: 900 m/s is too fast"));
    window.fill("parameter arm.speed", "900m/s");
    assert!(
        window.has("E0113: 900 m/s is too fast") && window.has("It may be: number 0 to 1 m/s.")
    );
    let field = window.harness.get_by_label("parameter arm.speed");
    assert_eq!(field.value().as_deref(), Some("900m/s"));
    window.fill("parameter arm.speed", "0.7");
    assert!(!window.has("E0113: 900 m/s is too fast"), "it is about another value");
}

#[test]
fn a_parameter_set_here_is_no_change_by_another_program() {
    let result = SetReport {
        parameter: "eye.device".into(),
        value: Some("csi".into()),
        is_set: true,
        text: "version 2".into(),
        findings: Vec::new(),
    };
    let mut window = watching_a(picture(), marking(), Some(result));
    let change = |window: &mut Window, value: &str| {
        let text = ROBOT.replace("\"usb\"", &format!("\"{value}\""));
        std::fs::write(window.path("robot.xml"), &text).unwrap();
        window.until("it is read again", |window| window.text() == text);
    };
    change(&mut window, "csi");
    assert!(!window.last_message().contains("another program"), "{}", window.last_message());
    change(&mut window, "gmsl");
    assert!(window.last_message().contains("another program"), "{}", window.last_message());
}
