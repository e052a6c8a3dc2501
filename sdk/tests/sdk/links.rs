//! Data from one component to another: order, loss, policies, reconnects.

use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

use armor_sdk::prelude::*;
use armor_sdk::tap::Tap;
use armor_wire::keep::Keep;

use crate::bench_system::{DEADLINE, ProbeEvent, System, data, sample};

/// Sends `count` samples per tick, of `len` bytes each, up to `total`.
fn burst(total: u64, count: u64, len: usize) -> impl FnMut(&Armor, Call) -> Result<Outcome, Fault> {
    let mut next = 0;
    move |armor, call| {
        for _ in 0..count {
            if call == Call::Tick && next < total {
                armor.send_data("out", &sample(next, len))?;
                next += 1;
            }
        }
        Ok(Outcome::CarryOn)
    }
}

/// Runs a publisher called `source`, whose script begins with a message.
fn run_source(
    system: &mut System,
    rate: &str,
    mut send: impl FnMut(&Armor, Call) -> Result<Outcome, Fault> + Send + 'static,
) -> Sender<()> {
    let (start, go) = channel();
    let mut started = false;
    system.run("source", &[rate], None, move |armor, call| {
        started |= go.try_recv().is_ok();
        if started { send(armor, call) } else { Ok(Outcome::CarryOn) }
    });
    start
}

/// Waits until the publisher's output has so many links, and none of them is paused, as that of a
/// subscriber which is still starting.
fn linked(system: &System, name: &str, links: usize) {
    system.until(name, |status| {
        let all = &status.outputs[0].links;
        all.len() == links && all.iter().all(|link| !link.paused)
    });
}

#[test]
fn a_crowd_of_tools_is_bounded_and_takes_no_place_of_a_component() {
    let mut system = System::start();
    system.run("source", &["--rate=10Hz"], None, |_, _| Ok(Outcome::CarryOn));
    system.until("source", |status| !status.outputs.is_empty());
    let data = format!("{}.out", system.name("source"));
    let open = || Tap::open(&system.directory, &data, Keep::Latest, DEADLINE);
    let mut taps: Vec<_> = (0..64).map(|_| open().expect("a place")).collect();
    let refused = open().err().expect("one too many").to_string();
    assert!(refused.contains("already linked to 64 tools"), "{refused}");
    taps.truncate(10);
    linked(&system, "source", 10);
    open().expect("places are free again");
    let (link, sink) = (system.link("in", "source", "out", "latest"), system.name("sink"));
    system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    system.until("source", |status| status.outputs[0].links.iter().any(|link| link.to == sink));
}

#[test]
fn keep_all_loses_nothing_whatever_the_size() {
    for len in [0, 100, 5_000, 20_000, 70_000, 1 << 20] {
        let mut system = System::start();
        let link = system.link("in", "source", "out", "all");
        let probe = system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
        let total = if len > 100_000 { 200 } else { 3_000 };
        let start = run_source(&mut system, "--rate=100Hz", burst(total, 500, len));
        linked(&system, "source", 1);
        start.send(()).unwrap();
        for expected in 0..total {
            assert_eq!(data(&probe), ("in".into(), expected, 0), "{len} bytes");
        }
        let status = system.status("sink");
        assert_eq!((status.inputs[0].lost, status.inputs[0].dropped), (0, 0));
    }
}

#[test]
fn a_spinning_link_is_a_link_like_any_other() {
    is_a_link_like_any_other(",wake=spin");
}

#[test]
fn a_link_over_tcp_is_a_link_like_any_other() {
    is_a_link_like_any_other(",transport=tcp");
    is_a_link_like_any_other(",transport=tcp,wake=spin");
}

#[test]
fn a_link_over_shared_memory_is_a_link_like_any_other() {
    is_a_link_like_any_other(",transport=shm");
    is_a_link_like_any_other(",transport=shm,wake=spin");
}

fn is_a_link_like_any_other(how: &str) {
    let mut system = System::start();
    let link = system.link("in", "source", "out", "all") + how;
    let probe = system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    let start = run_source(&mut system, "--rate=100Hz", burst(2_000, 100, 1_000));
    linked(&system, "source", 1);
    start.send(()).unwrap();
    for expected in 0..2_000 {
        assert_eq!(data(&probe), ("in".into(), expected, 0));
    }
    system.terminate("source");
    system.until("sink", |status| !status.inputs[0].connected);
}

#[test]
fn every_policy_keeps_what_it_promises_and_counts_the_rest() {
    for (keep, least) in [("latest", 1), ("50", 50)] {
        let mut system = System::start();
        let link = system.link("in", "source", "out", keep);
        let (open, gate) = channel();
        let probe = system.run("sink", &[&link], Some(gate), |_, _| Ok(Outcome::CarryOn));
        let start = run_source(&mut system, "--rate=200Hz", burst(5_000, 100, 2_000));
        linked(&system, "source", 1);
        start.send(()).unwrap();
        system.until("source", |status| status.outputs[0].published == 5_000);
        drop(open);
        let mut values = Vec::new();
        loop {
            let (_, value, _) = data(&probe);
            values.push(value);
            if value == 4_999 {
                break;
            }
        }
        assert!(values.is_sorted_by(|a, b| a < b), "in order, each once: {values:?}");
        assert!(values.len() >= least, "keep={keep} kept {}", values.len());
        let newest = (5_000 - least as u64..5_000).collect::<Vec<_>>();
        assert!(values.ends_with(&newest), "the newest {least} are kept");
        let sink = system.until("sink", |s| s.inputs[0].received == values.len() as u64);
        let missing = 5_000 - values.len() as u64;
        let counted = sink.inputs[0].lost + sink.inputs[0].dropped;
        assert_eq!(counted, missing, "keep={keep}: every loss is counted");
    }
}

/// What a subscriber gets that is busy with the first of 20 messages until all are published.
fn receive_after_a_pause(len: usize, how: &str) -> Vec<u64> {
    let mut system = System::start();
    let link = system.link("in", "source", "out", "latest") + how;
    let (open, gate) = channel();
    let probe = system.run("sink", &[&link], Some(gate), |_, _| Ok(Outcome::CarryOn));
    let start = run_source(&mut system, "--rate=500Hz", burst(20, 1, len));
    linked(&system, "source", 1);
    start.send(()).unwrap();
    let mut values = vec![data(&probe).1];
    system.until("source", |status| status.outputs[0].published == 20);
    drop(open);
    while values.last() != Some(&19) {
        values.push(data(&probe).1);
    }
    let count = values.len() as u64;
    let sink = system.until("sink", |status| status.inputs[0].received == count).inputs.remove(0);
    // Of what comes before the first that arrives, the subscriber counts what it drops itself, and
    // the publisher the rest.
    let (missing, counted) = (20 - count, sink.lost + sink.dropped);
    let source = system.status("source").outputs.remove(0);
    let by_publisher = missing.checked_sub(counted).expect("none is counted twice");
    assert!(by_publisher <= values[0], "every one is counted: {values:?} {sink:?}");
    assert!(source.links[0].dropped >= by_publisher, "{source:?}");
    values
}

#[test]
fn a_subscriber_that_was_busy_goes_on_with_the_newest() {
    for how in ["", ",transport=tcp"] {
        for len in [100, 100_000, 300_000, 1 << 20, 6 << 20] {
            // A publisher that gets no processor for long cannot say what is the newest.
            let mut rounds = (0..5).map(|_| receive_after_a_pause(len, how));
            let found = rounds.find(|values| *values == [0, 19]);
            assert!(found.is_some(), "{len} bytes{how}: it never got the newest at once");
        }
    }
}

#[test]
fn a_tool_that_asks_for_all_and_reads_nothing_delays_nobody() {
    let mut system = System::start();
    let link = system.link("in", "source", "out", "all");
    let probe = system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    let start = run_source(&mut system, "--rate=100Hz", burst(300, 10, 200_000));
    let data_name = format!("{}.out", system.name("source"));
    linked(&system, "source", 1);
    let _tap = Tap::open(&system.directory, &data_name, Keep::ALL, DEADLINE).expect("a place");
    linked(&system, "source", 2);
    start.send(()).unwrap();
    for expected in 0..300 {
        assert_eq!(data(&probe).1, expected);
    }
    let status = system.status("source");
    let of_tool = status.outputs[0].links.iter().find(|link| link.to.starts_with("tool-"));
    let of_tool = of_tool.expect("it is still linked");
    assert!(of_tool.keep == (Keep::Last { count: 16 }) && of_tool.dropped > 0, "{of_tool:?}");
}

#[test]
fn a_sender_loses_its_patience_with_a_subscriber_that_takes_nothing() {
    let mut system = System::start();
    let (open, gate) = channel::<()>();
    let stuck = format!("{},patience=0.2s", system.link("in", "source", "out", "all"));
    let fast = system.link("in", "source", "out", "all");
    let stuck_name = system.name("stuck");
    let _stuck = system.run("stuck", &[&stuck], Some(gate), |_, _| Ok(Outcome::CarryOn));
    let probe = system.run("quick", &[&fast], None, |_, _| Ok(Outcome::CarryOn));
    let start = run_source(&mut system, "--rate=100Hz", burst(300, 10, 200_000));
    linked(&system, "source", 2);
    let status = system.status("source");
    let keep = |of: &str| {
        let links = status.outputs[0].links.iter();
        links.into_iter().find(|link| link.to == of).map(|link| link.keep)
    };
    assert_eq!(keep(&stuck_name), Some(Keep::All { patience_ms: 200 }));
    start.send(()).unwrap();
    for expected in 0..300 {
        assert_eq!(data(&probe).1, expected);
    }
    drop(open);
}

#[test]
fn a_stuck_subscriber_delays_no_other() {
    let mut system = System::start();
    let (open, gate) = channel::<()>();
    let slow = system.link("in", "source", "out", "latest");
    let fast = system.link("in", "source", "out", "all");
    let _stuck = system.run("stuck", &[&slow], Some(gate), |_, _| Ok(Outcome::CarryOn));
    let probe = system.run("quick", &[&fast], None, |_, _| Ok(Outcome::CarryOn));
    let start = run_source(&mut system, "--rate=100Hz", burst(300, 10, 200_000));
    linked(&system, "source", 2);
    start.send(()).unwrap();
    for expected in 0..300 {
        assert_eq!(data(&probe).1, expected);
    }
    drop(open);
}

#[test]
fn an_input_that_is_never_empty_keeps_no_other_waiting() {
    let mut system = System::start();
    let rare = system.link("in2", "rare", "out", "all");
    let flood = system.link("in", "flood", "out", "all");
    let (open, gate) = channel();
    let probe = system.run("sink", &[&rare, &flood], Some(gate), |_, _| Ok(Outcome::CarryOn));
    let (send, sends) = channel::<()>();
    system.run("rare", &["--rate=100Hz"], None, move |armor, _| {
        for () in sends.try_iter() {
            armor.send_data("out", &sample(7, 10))?;
        }
        Ok(Outcome::CarryOn)
    });
    linked(&system, "rare", 1);
    send.send(()).unwrap();
    // While it takes the first of these, it is flooded; then it is to take the second.
    assert_eq!(data(&probe).0, "in2");
    system.run("flood", &["--rate=100Hz"], None, burst(u64::MAX, 1_000, 1_000));
    system.until("sink", |status| status.inputs[0].waiting > 900);
    send.send(()).unwrap();
    let take = || {
        open.send(()).unwrap();
        data(&probe).0 == "in2"
    };
    let start = Instant::now();
    while system.status("sink").inputs[1].waiting == 0 {
        assert!(start.elapsed() < DEADLINE, "its reader does something else all the time");
        if take() {
            return;
        }
    }
    let before = (0..10_000).position(|_| take());
    assert!(before.is_some(), "more and more come before it");
}

#[test]
fn a_late_subscriber_gets_the_latched_value() {
    let mut system = System::start();
    system.run("source", &["--rate=100Hz"], None, |armor, call| {
        if call == Call::Started {
            armor.send_data("state", &sample(7, 100_000))?;
            armor.send_data("state", &sample(8, 100_000))?;
        }
        Ok(Outcome::CarryOn)
    });
    system.until("source", |status| status.outputs[1].published == 2);
    let link = system.link("in", "source", "state", "latest");
    let probe = system.run("late", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    assert_eq!(data(&probe), ("in".into(), 8, 0));
}

#[test]
fn links_outlive_the_registry_and_new_ones_wait_for_it() {
    let mut system = System::start();
    let link = system.link("in", "source", "out", "all");
    let probe = system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    let mut next = 0;
    system.run("source", &["--rate=200Hz"], None, move |armor, call| {
        if call == Call::Tick {
            armor.send_data("out", &sample(next, 10))?;
            next += 1;
        }
        Ok(Outcome::CarryOn)
    });
    let first = data(&probe).1;
    let address = system.registry.address();
    let listen = "127.0.0.1:0".parse().unwrap();
    let options =
        armor_registry::RegistryOptions { listen, ..armor_registry::RegistryOptions::default() };
    let other = armor_registry::BackgroundRegistry::start(options).unwrap();
    drop(std::mem::replace(&mut system.registry, other));
    for expected in first + 1..first + 101 {
        assert_eq!(data(&probe).1, expected, "nothing is lost without a registry");
    }
    let options = armor_registry::RegistryOptions {
        listen: address,
        ..armor_registry::RegistryOptions::default()
    };
    system.registry = armor_registry::BackgroundRegistry::start(options).unwrap();
    let link = system.link("in", "source", "out", "all");
    let late = system.run("late", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    data(&late);
    for expected in first + 101..first + 150 {
        assert_eq!(data(&probe).1, expected, "the old link never noticed");
    }
}

#[test]
fn a_restarted_publisher_is_found_again() {
    let mut system = System::start();
    let link = system.link("in", "source", "out", "all");
    let probe = system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    let publish = |armor: &Armor, call: Call| {
        if call == Call::Tick {
            armor.send_data("out", &sample(1, 10))?;
        }
        Ok(Outcome::CarryOn)
    };
    system.run("source", &["--rate=100Hz"], None, publish);
    data(&probe);
    system.terminate("source");
    system.until("sink", |status| !status.inputs[0].connected);
    while probe.try_recv().is_ok() {}
    system.run("source", &["--rate=100Hz"], None, publish);
    data(&probe);
    assert_eq!(system.status("sink").inputs[0].connections, 2);
}

#[test]
fn a_link_of_another_type_is_refused_naming_both() {
    let mut system = System::start();
    system.run("source", &["--rate=100Hz"], None, |_, _| Ok(Outcome::CarryOn));
    system.entry("source");
    let link = system.link("words", "source", "out", "latest");
    system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    // Its first problem may be of the connection, not of the type.
    system.until("sink", |status| {
        let problem = &status.inputs[2].problem;
        problem.contains("Sample") && problem.contains("Text")
    });
}

#[test]
fn parameters_arrive_before_the_first_call() {
    let mut system = System::start();
    let probe = system.run("probe", &["--set=speed=18km/h"], None, |_, _| Ok(Outcome::CarryOn));
    assert_eq!(probe.recv_timeout(DEADLINE), Ok(ProbeEvent::Parameter("speed".into(), 5.0)));
    assert_eq!(probe.recv_timeout(DEADLINE), Ok(ProbeEvent::Call(Call::Started)));
    let probe = system.run("plain", &[], None, |_, _| Ok(Outcome::CarryOn));
    assert_eq!(probe.recv_timeout(DEADLINE), Ok(ProbeEvent::Parameter("speed".into(), 2.0)));
}
