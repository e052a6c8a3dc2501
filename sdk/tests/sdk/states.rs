//! Activation, freezing, reports and failures, as the executive sees them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use armor_sdk::SendError;
use armor_sdk::control::{
    Answer, Assigned, Command, ControlEvent, GivenParameter, ReportKind, Role, RunState,
};
use armor_sdk::prelude::*;

use crate::bench_system::{DEADLINE, ProbeEvent, System, data, sample};

fn state(events: &Receiver<ControlEvent>, wanted: RunState) -> u64 {
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < DEADLINE, "never {wanted:?}");
        match events.recv_timeout(DEADLINE).expect("an answer") {
            ControlEvent::Answer(Answer::State { state, activation, .. }) if state == wanted => {
                return activation;
            }
            ControlEvent::Closed(reason) => panic!("closed: {reason}"),
            ControlEvent::Answer(_) => {}
        }
    }
}

fn report(events: &Receiver<ControlEvent>) -> (u64, u64, ReportKind) {
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < DEADLINE, "no report");
        if let ControlEvent::Answer(Answer::Report { report, activation, outcome }) =
            events.recv_timeout(DEADLINE).expect("a report")
        {
            return (report, activation, outcome);
        }
    }
}

#[test]
fn a_frozen_component_gets_no_calls_and_its_link_no_data() {
    let mut system = System::start();
    let link = system.link("in", "source", "out", "all");
    let probe = system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    let mut next = 0;
    system.run("source", &["--rate=500Hz"], None, move |armor, call| {
        if call == Call::Tick {
            armor.send_data("out", &sample(next, 10))?;
            next += 1;
        }
        Ok(Outcome::CarryOn)
    });
    data(&probe);
    let (control, events) = system.control("sink", Role::Executive);
    control.send(&Command::Freeze { activation: 0 }).unwrap();
    state(&events, RunState::Frozen);
    system.until("source", |status| status.outputs[0].links[0].paused);
    let before = probe.try_iter().collect::<Vec<_>>();
    assert!(before.contains(&ProbeEvent::Call(Call::Stopping)));
    let published = system.status("source").outputs[0].published;
    system.until("source", |status| status.outputs[0].published > published + 50);
    assert_eq!(probe.try_recv().ok(), None, "no call while frozen");
    control.send(&Command::Activate { activation: 3, parameters: Vec::new() }).unwrap();
    assert_eq!(state(&events, RunState::Active), 3);
    assert_eq!(probe.recv_timeout(DEADLINE), Ok(ProbeEvent::Call(Call::Started)));
    let (_, value, lost) = data(&probe);
    assert!(value > published, "nothing stale after a pause");
    assert_eq!(lost, 0, "what was published during a pause is not lost");
    assert_eq!(system.status("sink").inputs[0].lost, 0);
}

#[test]
fn crowds_keep_out_neither_the_executive_nor_a_further_operator() {
    let mut system = System::start();
    system.run("sink", &[], None, |_, _| Ok(Outcome::CarryOn));
    let connect =
        |role, count| -> Vec<_> { (0..count).map(|_| system.control("sink", role)).collect() };
    let observers = connect(Role::Observer, 100);
    let operators = connect(Role::Operator, 100);
    operators.last().unwrap().0.status(DEADLINE).expect("the last operator is served");
    let (control, events) = system.control("sink", Role::Executive);
    control.send(&Command::Freeze { activation: 1 }).unwrap();
    state(&events, RunState::Frozen);
    // The operator who has been idle for the longest time has given its place.
    let mut first = operators[0].1.iter();
    assert!(first.any(|event| matches!(event, ControlEvent::Closed(_))));
    observers[0].0.status(DEADLINE).expect("the first observers keep their places");
    let mut last = observers[99].1.iter();
    assert!(last.any(|event| matches!(event, ControlEvent::Closed(_))));
}

#[test]
fn more_data_than_it_can_take_keep_no_component_from_its_orders_and_ticks() {
    let mut system = System::start();
    let link = system.link("in", "source", "out", "all");
    let (open, gate) = channel();
    let (end_tick, tick_ends) = channel();
    let (ticked, ticks) = channel();
    let probe = system.run("sink", &["--rate=1000Hz", &link], Some(gate), move |_, call| {
        if call == Call::Tick {
            let _ = ticked.send(());
            let _ = tick_ends.recv();
        }
        Ok(Outcome::CarryOn)
    });
    system.run("source", &["--rate=100Hz"], None, |armor, call| {
        if call == Call::Tick {
            (0..10).try_for_each(|value| armor.send_data("out", &sample(value, 10)).map(drop))?;
        }
        Ok(Outcome::CarryOn)
    });
    // Its data wait while it ticks, and its next tick is due while it takes the first of them.
    ticks.recv_timeout(DEADLINE).unwrap();
    system.until("source", |status| {
        status.outputs[0].links.first().is_some_and(|link| link.sent > 500)
    });
    end_tick.send(()).unwrap();
    data(&probe);
    std::thread::sleep(Duration::from_millis(2));
    open.send(()).unwrap();
    ticks.recv_timeout(DEADLINE).expect("a tick before the second of them");
    let (control, events) = system.control("sink", Role::Executive);
    control.send(&Command::Freeze { activation: 1 }).unwrap();
    control.status(DEADLINE).expect("it has received the order to freeze");
    drop((end_tick, open));
    state(&events, RunState::Frozen);
    let left: Vec<_> =
        probe.try_iter().filter(|probe| matches!(probe, ProbeEvent::Data { .. })).collect();
    assert!(left.len() < 10, "it was kept from freezing: {} data", left.len());
}

#[test]
fn reports_carry_their_activation_and_are_sent_again_until_acknowledged() {
    let mut system = System::start();
    let mut ticks = 0;
    let probe = system.run("worker", &["--rate=100Hz"], None, move |_, call| {
        if call == Call::Tick {
            ticks += 1;
        }
        Ok(match ticks {
            3 if call == Call::Tick => Outcome::event("half", 0.5),
            6 => Outcome::Done,
            _ => Outcome::CarryOn,
        })
    });
    let (first, events) = system.control("worker", Role::Executive);
    let (number, activation, outcome) = report(&events);
    assert_eq!((activation, &outcome), (0, &ReportKind::Event { name: "half".into(), value: 0.5 }));
    assert_eq!(report(&events).2, ReportKind::Done);
    system.until("worker", |status| status.state == RunState::Done);
    drop(first);
    let (again, events) = system.control("worker", Role::Executive);
    assert_eq!(report(&events), (number, activation, outcome), "not acknowledged: sent again");
    again.send(&Command::Acknowledge { report: number }).unwrap();
    drop(again);
    let (control, events) = system.control("worker", Role::Executive);
    assert_eq!(report(&events).2, ReportKind::Done, "only what is not acknowledged");
    control.send(&Command::Activate { activation: 2, parameters: Vec::new() }).unwrap();
    assert_eq!(state(&events, RunState::Active), 2);
    let calls: Vec<_> = probe.try_iter().filter(|t| matches!(t, ProbeEvent::Call(_))).collect();
    assert_eq!(calls[0], ProbeEvent::Call(Call::Started));
}

#[test]
fn a_thread_of_its_own_publishes_only_until_the_component_is_frozen() {
    let mut system = System::start();
    let (handles, handle) = channel();
    system.run("worker", &["--rate=100Hz"], None, move |armor, call| {
        if call == Call::Started {
            handles.send(armor.clone()).unwrap();
        }
        Ok(Outcome::CarryOn)
    });
    let armor = handle.recv_timeout(DEADLINE).expect("its first call");
    let send = || armor.send_data("out", &sample(1, 0));
    // The handle is used on the test's thread, outside any call of the component.
    assert!(send().is_ok());
    let (control, events) = system.control("worker", Role::Executive);
    control.send(&Command::Freeze { activation: 1 }).unwrap();
    state(&events, RunState::Frozen);
    match send() {
        Err(error @ SendError::NotActive { .. }) => {
            assert!(
                error.to_string().starts_with("`out` is not sent: the component is not active")
            );
        }
        other => panic!("{other:?}"),
    }
    control.send(&Command::Activate { activation: 2, parameters: Vec::new() }).unwrap();
    state(&events, RunState::Active);
    assert!(send().is_ok());
}

#[test]
fn a_component_that_is_slower_than_its_rate_is_found_and_each_skipped_tick_counted() {
    let mut system = System::start();
    system.run("slow", &["--rate=100Hz"], None, |_, call| {
        if call == Call::Tick {
            std::thread::sleep(Duration::from_millis(40));
        }
        Ok(Outcome::CarryOn)
    });
    let status = system.until("slow", |status| status.skipped_share > 0.2);
    assert!(status.skipped_ticks > status.exec_calls, "three of four: {status:?}");
}

#[test]
fn an_error_is_a_report_and_a_panic_too() {
    for panics in [false, true] {
        let mut system = System::start();
        system.run("worker", &["--rate=100Hz"], None, move |_, call| {
            if call == Call::Tick {
                assert!(!panics, "the wheel came off");
                return Err("the wheel came off".into());
            }
            Ok(Outcome::CarryOn)
        });
        let (_control, events) = system.control("worker", Role::Executive);
        match report(&events).2 {
            ReportKind::Failed { reason } => {
                assert!(reason.contains("the wheel came off"), "{reason}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn an_event_that_is_undeclared_or_that_a_mission_could_mistake_is_a_failure() {
    for name in ["done", "failed", "two words", "", "undeclared"] {
        let mut system = System::start();
        system.run("worker", &["--rate=100Hz"], None, move |_, call| {
            Ok(if call == Call::Tick { Outcome::event(name, 1.0) } else { Outcome::CarryOn })
        });
        let (_control, events) = system.control("worker", Role::Executive);
        match report(&events).2 {
            ReportKind::Failed { reason } => assert!(reason.contains("event"), "{reason}"),
            other => panic!("{name}: {other:?}"),
        }
    }
}

#[test]
fn an_observer_may_not_command() {
    let mut system = System::start();
    system.run("worker", &["--rate=100Hz"], None, |_, _| Ok(Outcome::CarryOn));
    let (control, events) = system.control("worker", Role::Observer);
    control.send(&Command::Freeze { activation: 1 }).unwrap();
    loop {
        match events.recv_timeout(DEADLINE).expect("an answer") {
            ControlEvent::Closed(_) => break,
            ControlEvent::Answer(Answer::State { state: RunState::Frozen, .. }) => panic!("obeyed"),
            ControlEvent::Answer(_) => {}
        }
    }
}

#[test]
fn all_components_have_the_registrys_time() {
    let mut system = System::start();
    system.run("worker", &["--rate=100Hz"], None, |_, _| Ok(Outcome::CarryOn));
    // Estimates get better with every exchange, and on a busy machine the first ones are bad.
    let status =
        system.until("worker", |status| status.clock_error_s.is_some_and(|error| error < 0.1));
    let off_s = status.clock_offset_s.abs() - status.clock_error_s.unwrap_or_default();
    assert!(off_s < 0.1, "one host, one clock: {status:?}");
}

fn activate(activation: u64, speed: Option<&str>) -> Command {
    let given = |text: &str| GivenParameter {
        name: "speed".into(),
        assigned: Assigned {
            text: text.into(),
            base: String::new(),
            origin: "robot.xml:9:1".into(),
        },
    };
    Command::Activate { activation, parameters: speed.map(given).into_iter().collect() }
}

#[test]
fn values_of_an_activation_come_before_its_first_call_and_go_with_it() {
    let mut system = System::start();
    let probe = system.run("mover", &["--rate=100Hz"], None, |_, _| Ok(Outcome::CarryOn));
    let next = || probe.recv_timeout(DEADLINE).expect("more");
    let speed = |value: f64| ProbeEvent::Parameter("speed".into(), value);
    assert_eq!([next(), next()], [speed(2.0), ProbeEvent::Call(Call::Started)], "its default");
    let (control, events) = system.control("mover", Role::Executive);
    // Each in m/s: given, the same given again, not given any more, and never given.
    let steps =
        [(Some("50cm/s"), Some(0.5)), (Some("50cm/s"), Some(0.5)), (None, Some(2.0)), (None, None)];
    for (activation, (given, handed)) in (1..).zip(steps) {
        control.send(&Command::Freeze { activation }).unwrap();
        state(&events, RunState::Frozen);
        assert_eq!(next(), ProbeEvent::Call(Call::Stopping));
        control.send(&activate(activation, given)).unwrap();
        assert_eq!(state(&events, RunState::Active), activation);
        if let Some(handed) = handed {
            assert_eq!(next(), speed(handed), "activation {activation}");
        }
        assert_eq!(next(), ProbeEvent::Call(Call::Started));
    }
    // Activated again while it runs: only changed values are handed over.
    control.send(&activate(4, Some("4m/s"))).unwrap();
    assert_eq!(next(), speed(4.0));
    control.send(&activate(4, Some("4m/s"))).unwrap();
    assert_eq!(state(&events, RunState::Active), 4);
    assert_eq!(probe.try_recv().ok(), None);
}

#[test]
fn a_value_that_cannot_be_read_fails_its_activation() {
    let mut system = System::start();
    let probe = system.run("mover", &["--rate=100Hz"], None, |_, _| Ok(Outcome::CarryOn));
    let (control, events) = system.control("mover", Role::Executive);
    control.send(&Command::Freeze { activation: 0 }).unwrap();
    state(&events, RunState::Frozen);
    probe.try_iter().count();
    control.send(&activate(1, Some("11m/s"))).unwrap();
    let (_, activation, outcome) = report(&events);
    let ReportKind::Failed { reason } = outcome else { panic!("{outcome:?}") };
    assert_eq!(activation, 1);
    assert!(reason.contains("`speed`") && reason.contains("robot.xml:9:1"), "{reason}");
    system.until("mover", |status| status.state == RunState::Failed);
    assert_eq!(probe.try_recv().ok(), None, "no call with half of its values");
}

#[test]
fn values_of_the_command_line_go_before_values_of_the_mission() {
    let mut system = System::start();
    let arguments = ["--rate=100Hz", "--set", "speed=3m/s"];
    let probe = system.run("mover", &arguments, None, |_, _| Ok(Outcome::CarryOn));
    let next = || probe.recv_timeout(DEADLINE).expect("more");
    let speed = |value: f64| ProbeEvent::Parameter("speed".into(), value);
    assert_eq!([next(), next()], [speed(3.0), ProbeEvent::Call(Call::Started)]);
    let (control, events) = system.control("mover", Role::Executive);
    control.send(&Command::Freeze { activation: 0 }).unwrap();
    state(&events, RunState::Frozen);
    control.send(&activate(1, Some("1m/s"))).unwrap();
    state(&events, RunState::Active);
    let calls = [next(), next(), next()];
    let wanted = [ProbeEvent::Call(Call::Stopping), speed(3.0), ProbeEvent::Call(Call::Started)];
    assert_eq!(calls, wanted);
}

/// Its constructor returns when the test lets it.
struct Slow;

static MAY_RETURN: AtomicBool = AtomicBool::new(false);

impl Component for Slow {
    const KIND: &'static str = "slow";
    const SUMMARY: &'static str = "Waits for its device.";

    fn new(_: Armor) -> Result<Self, Fault> {
        while !MAY_RETURN.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(Self)
    }
}

#[test]
fn a_constructor_that_does_not_return_is_a_call_that_runs() {
    let system = System::start();
    let address = system.registry.address().to_string();
    let name = system.name("slow");
    let arguments = ["--alone", "--name", &name, "--registry", &address].map(Into::into);
    let thread = std::thread::spawn(move || armor_sdk::run_with::<Slow>(arguments));
    let (control, _events) = system.control("slow", Role::Launcher);
    let until = |wanted: &dyn Fn(&armor_sdk::control::Status) -> bool| {
        let start = Instant::now();
        while !wanted(&control.status(DEADLINE).expect("it answers")) {
            assert!(start.elapsed() < DEADLINE, "never in the wanted state");
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    until(&|status| {
        let function = status.call.as_ref().map(|call| call.function.as_str());
        status.state == RunState::Starting && function == Some("new")
    });
    MAY_RETURN.store(true, Ordering::SeqCst);
    until(&|status| status.state == RunState::Active && status.call.is_none());
    control.send(&Command::Terminate).expect("it is there");
    thread.join().expect("it ends in order");
}
