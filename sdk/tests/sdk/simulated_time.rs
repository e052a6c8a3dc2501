//! Time that follows data: ticks and stamps with it, standing, jumping, and its source dying.

use std::sync::mpsc::{Receiver, Sender, channel};

use armor_sdk::control::RunState;
use armor_sdk::prelude::*;

use crate::bench_system::{DEADLINE, ProbeEvent, System};

/// Runs a component that gives the time: what the test sends.
fn run_clock(system: &mut System) -> Sender<f64> {
    let (give, times) = channel();
    system.run("world", &["--rate=1000Hz"], None, move |armor, _| {
        for clock in times.try_iter() {
            armor.send_data("clock", &Clock { clock })?;
        }
        Ok(Outcome::CarryOn)
    });
    give
}

/// Runs a component of 10 Hz that follows it, and reports the time at every call.
fn run_follower(system: &mut System) -> (Receiver<(Call, f64)>, Receiver<ProbeEvent>) {
    let (tell, calls) = channel();
    let clock = format!("--clock={}.clock", system.name("world"));
    let probe = system.run("robot", &["--rate=10Hz", &clock], None, move |armor, call| {
        let _ = tell.send((call, armor.timestamp()));
        Ok(Outcome::CarryOn)
    });
    (calls, probe)
}

fn next(calls: &Receiver<(Call, f64)>) -> (Call, f64) {
    calls.recv_timeout(DEADLINE).expect("a call")
}

/// Long enough for many ticks, were they those of the host's time.
fn let_the_hosts_time_pass(system: &System) {
    let calls = system.status("world").exec_calls;
    system.until("world", |status| status.exec_calls > calls + 300);
}

#[test]
fn ticks_follow_the_time_and_stand_with_it() {
    let mut system = System::start();
    let give = run_clock(&mut system);
    let (calls, _events) = run_follower(&mut system);
    give.send(10.0).unwrap();
    assert_eq!(next(&calls), (Call::Started, 10.0));
    assert_eq!(next(&calls), (Call::Tick, 10.0));
    for (between, at) in [(10.05, 10.1), (10.19, 10.25), (10.29, 10.3)] {
        give.send(between).unwrap();
        give.send(at).unwrap();
        assert_eq!(next(&calls), (Call::Tick, at), "not at {between}, and keeping the beat");
    }
    let_the_hosts_time_pass(&system);
    assert_eq!(calls.try_recv().ok(), None, "time stands still");
    give.send(1000.0).unwrap();
    assert_eq!(next(&calls), (Call::Tick, 1000.0), "late ticks are not made up for");
    give.send(1000.1).unwrap();
    assert_eq!(next(&calls), (Call::Tick, 1000.1));
}

#[test]
fn ticks_start_afresh_where_the_time_goes_back() {
    let mut system = System::start();
    let give = run_clock(&mut system);
    let (calls, _events) = run_follower(&mut system);
    give.send(500.0).unwrap();
    assert_eq!([next(&calls).0, next(&calls).0], [Call::Started, Call::Tick]);
    give.send(7.0).unwrap();
    assert_eq!(next(&calls), (Call::Tick, 7.0));
    give.send(7.1).unwrap();
    assert_eq!(next(&calls), (Call::Tick, 7.1));
}

#[test]
fn no_component_is_active_before_the_time_is_known() {
    let mut system = System::start();
    let give = run_clock(&mut system);
    let (calls, _events) = run_follower(&mut system);
    system.until("robot", |status| status.state == RunState::Starting);
    let_the_hosts_time_pass(&system);
    assert_eq!(calls.try_recv().ok(), None);
    give.send(3.0).unwrap();
    system.until("robot", |status| status.state == RunState::Active);
    assert_eq!(next(&calls), (Call::Started, 3.0));
}

#[test]
fn time_stands_while_its_source_is_dead_and_continues_with_another_start_of_it() {
    let mut system = System::start();
    let give = run_clock(&mut system);
    let (calls, _events) = run_follower(&mut system);
    give.send(20.0).unwrap();
    assert_eq!([next(&calls).0, next(&calls).0], [Call::Started, Call::Tick]);
    system.terminate("world");
    let give = run_clock(&mut system);
    let_the_hosts_time_pass(&system);
    assert_eq!(calls.try_recv().ok(), None);
    for at in [90.0, 90.1] {
        give.send(at).unwrap();
        assert_eq!(next(&calls), (Call::Tick, at));
    }
    // What it publishes is stamped with that time too.
    drop(give);
    assert_eq!(system.status("robot").state, RunState::Active);
}

#[test]
fn a_late_follower_has_the_time_immediately_and_messages_are_stamped_with_it() {
    let mut system = System::start();
    let give = run_clock(&mut system);
    give.send(33.0).unwrap();
    system.until("world", |status| status.outputs[2].published == 1);
    let clock = format!("--clock={}.clock", system.name("world"));
    system.run("robot", &["--rate=10Hz", &clock], None, |armor, _| {
        armor.send_data("state", &crate::bench_system::sample(1, 1))?;
        Ok(Outcome::CarryOn)
    });
    let data = format!("{}.state", system.name("robot"));
    let keep = armor_sdk::wire::keep::Keep::Latest;
    let mut tap =
        armor_sdk::tap::Tap::open(&system.directory, &data, keep, DEADLINE).expect("a provider");
    let latest = tap.next(DEADLINE).unwrap().expect("the last data");
    assert_eq!(latest.header.stamp_s, 33.0);
}
