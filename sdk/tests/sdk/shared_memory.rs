//! Links with shared memory: the same order, policies and counts as over a socket.

use std::sync::mpsc::{Receiver, Sender, channel};

use armor_sdk::control::{Command, Role};
use armor_sdk::prelude::*;

use crate::bench_system::{DEADLINE, ProbeEvent, System, data, sample};

const SHARED: &str = ",transport=shm";

/// Runs a publisher of the numbers 0, 1, … that sends as many samples as the test asks for.
fn run_source(system: &mut System, output: &'static str, len: usize) -> Sender<u64> {
    let (send, go) = channel();
    let mut next = 0;
    system.run("source", &["--rate=200Hz"], None, move |armor, call| {
        // An order that came before the first tick waits for it.
        if call == Call::Tick {
            for _ in 0..go.try_iter().sum() {
                armor.send_data(output, &sample(next, len))?;
                next += 1;
            }
        }
        Ok(Outcome::CarryOn)
    });
    send
}

fn run_sink(
    system: &mut System,
    name: &str,
    output: &str,
    how: &str,
    gate: Option<Receiver<()>>,
) -> Receiver<ProbeEvent> {
    let link = format!("--link=in={}.{output},{how}", system.name("source"));
    let probe = system.run(name, &[&link], gate, |_, _| Ok(Outcome::CarryOn));
    system.until_linked("source", name);
    probe
}

fn transport(system: &System) -> String {
    system.status("source").outputs[0].links[0].transport.clone()
}

#[test]
fn keep_all_loses_nothing_of_any_size_asleep_or_spinning() {
    for (len, wake) in
        [(0, ""), (100, ",wake=spin"), (5_000, ""), (70_000, ""), (1 << 20, ",wake=spin")]
    {
        let mut system = System::start();
        let send = run_source(&mut system, "out", len);
        let probe = run_sink(&mut system, "sink", "out", &format!("keep=all{SHARED}{wake}"), None);
        let total = if len > 100_000 { 200 } else { 2_000 };
        send.send(total).unwrap();
        for expected in 0..total {
            assert_eq!(data(&probe), ("in".into(), expected, 0), "{len} bytes");
        }
        assert_eq!(transport(&system), "shm");
        // A message is counted when its call has ended.
        let sink = system.until("sink", |it| it.inputs[0].received == total).inputs.remove(0);
        assert_eq!((sink.lost, sink.dropped), (0, 0));
    }
}

#[test]
fn large_messages_are_shared_without_being_asked_for_and_none_is_lost_at_the_change() {
    for (how, small, expected) in [
        ("keep=all", 100, "unix"),
        ("keep=all", 200_000, "shm"),
        ("keep=all,transport=tcp", 200_000, "tcp"),
        ("keep=30", 200_000, "shm"),
        ("keep=50", 200_000, "unix"),
    ] {
        let mut system = System::start();
        let send = run_source(&mut system, "out", small);
        let probe = run_sink(&mut system, "sink", "out", how, None);
        send.send(20).unwrap();
        (0..20).for_each(|value| assert_eq!(data(&probe), ("in".into(), value, 0), "{how}"));
        assert_eq!(transport(&system), expected, "{how}, {small} bytes");
    }
}

#[test]
fn a_link_changes_to_memory_between_two_messages() {
    let mut system = System::start();
    let (send, go) = channel();
    let mut next = 0;
    system.run("source", &["--rate=200Hz"], None, move |armor, _| {
        for len in go.try_iter() {
            armor.send_data("out", &sample(next, len))?;
            next += 1;
        }
        Ok(Outcome::CarryOn)
    });
    let probe = run_sink(&mut system, "sink", "out", "keep=all", None);
    for (value, len) in [10, 10, 100_000, 10, 3 << 20, 0, 300_000].into_iter().enumerate() {
        send.send(len).unwrap();
        let events = std::iter::from_fn(|| probe.recv_timeout(DEADLINE).ok());
        let mut data = events.filter_map(|event| match event {
            ProbeEvent::Data { value, lost, len, .. } => Some((value, lost, len)),
            _ => None,
        });
        assert_eq!(data.next(), Some((value as u64, 0, len)));
    }
    assert_eq!(transport(&system), "shm");
}

#[test]
fn a_busy_subscriber_gets_the_newest_of_its_policy_and_every_loss_is_counted() {
    for (keep, least) in [("latest", 1), ("20", 20)] {
        let mut system = System::start();
        let send = run_source(&mut system, "out", 50_000);
        let (open, gate) = channel();
        let probe =
            run_sink(&mut system, "sink", "out", &format!("keep={keep}{SHARED}"), Some(gate));
        // What is published before its first message, a subscriber does not count.
        send.send(1).unwrap();
        let mut values = vec![data(&probe).1];
        send.send(499).unwrap();
        let source = system.until("source", |status| status.outputs[0].published == 500);
        assert_eq!(source.outputs[0].links[0].transport, "shm");
        drop(open);
        while values.last() != Some(&499) {
            values.push(data(&probe).1);
        }
        assert!(values.is_sorted_by(|a, b| a < b), "in order, each once: {values:?}");
        let newest = (500 - least..500).collect::<Vec<_>>();
        assert!(values.ends_with(&newest), "the newest {least} are kept: {values:?}");
        let sink = system.until("sink", |it| it.inputs[0].received == values.len() as u64);
        let counted = sink.inputs[0].lost + sink.inputs[0].dropped;
        assert_eq!(counted, 500 - values.len() as u64, "keep={keep}: every loss is counted");
    }
}

#[test]
fn a_subscriber_that_stands_still_delays_no_other_one() {
    let mut system = System::start();
    let send = run_source(&mut system, "out", 1 << 20);
    let (open, gate) = channel();
    let held = run_sink(&mut system, "held", "out", "keep=latest", Some(gate));
    let probe = run_sink(&mut system, "sink", "out", "keep=all", None);
    send.send(100).unwrap();
    (0..100).for_each(|value| assert_eq!(data(&probe), ("in".into(), value, 0)));
    drop(open);
    let mut values = vec![data(&held).1];
    while values.last() != Some(&99) {
        values.push(data(&held).1);
    }
    assert!(values.len() < 50 && values.is_sorted_by(|a, b| a < b), "{values:?}");
}

#[test]
fn a_latched_value_and_a_history_come_through_memory_too() {
    let mut system = System::start();
    let send = run_source(&mut system, "state", 100_000);
    let early = run_sink(&mut system, "early", "state", "keep=all,history=4", None);
    send.send(6).unwrap();
    (0..6).for_each(|value| assert_eq!(data(&early), ("in".into(), value, 0)));
    let late = run_sink(&mut system, "late", "state", "keep=4,history=4", None);
    let history = std::iter::from_fn(|| late.recv_timeout(DEADLINE).ok());
    let last = history.filter_map(|event| match event {
        ProbeEvent::History(values) => Some(values),
        _ => None,
    });
    let last: Vec<_> = last.take(4).collect();
    assert_eq!(last, [vec![2], vec![3, 2], vec![4, 3, 2], vec![5, 4, 3, 2]]);
    let status = system.status("source");
    let transports = status.outputs[1].links.iter().map(|link| link.transport.as_str());
    assert_eq!(transports.collect::<Vec<_>>(), ["shm", "shm"]);
}

#[test]
fn a_frozen_subscriber_gets_what_is_new_after_it_and_a_publisher_that_comes_back_is_linked_again() {
    let mut system = System::start();
    let send = run_source(&mut system, "out", 100);
    let probe = run_sink(&mut system, "sink", "out", &format!("keep=20{SHARED}"), None);
    send.send(1).unwrap();
    assert_eq!(data(&probe), ("in".into(), 0, 0));
    let (control, _events) = system.control("sink", Role::Executive);
    control.send(&Command::Freeze { activation: 1 }).unwrap();
    system.until("source", |it| it.outputs[0].links[0].paused);
    send.send(5).unwrap();
    system.until("source", |it| it.outputs[0].published == 6);
    control.send(&Command::Activate { activation: 2, parameters: Vec::new() }).unwrap();
    system.until("source", |it| !it.outputs[0].links[0].paused);
    send.send(1).unwrap();
    assert_eq!(data(&probe), ("in".into(), 6, 0), "a pause is no loss");
    system.terminate("source");
    system.until("sink", |it| !it.inputs[0].connected);
    let send = run_source(&mut system, "out", 100);
    system.until_linked("source", "sink");
    send.send(1).unwrap();
    assert_eq!(data(&probe), ("in".into(), 0, 0));
}

#[test]
fn a_subscriber_whose_history_holds_all_slots_that_it_may_still_gets_the_newest_message() {
    for (keep, rate) in [("pull", "--rate=100Hz"), ("latest", ""), ("2", "")] {
        let mut system = System::start();
        let send = run_source(&mut system, "out", 50_000);
        let (open, gate) = channel();
        let link = system.link("in", "source", "out", keep) + SHARED + ",history=60";
        let arguments: Vec<_> =
            [&link as &str, rate].into_iter().filter(|it| !it.is_empty()).collect();
        let probe = system.run("sink", &arguments, Some(gate), |_, _| Ok(Outcome::CarryOn));
        system.until_linked("source", "sink");
        for value in 0..=40 {
            send.send(1).unwrap();
            assert_eq!(data(&probe), ("in".into(), value, 0), "keep={keep}");
            if value < 40 {
                open.send(()).unwrap();
            }
        }
        // It is in its code, with a slot more than it may store.
        send.send(5).unwrap();
        let source = system.until("source", |status| status.outputs[0].published == 46);
        let link = &source.outputs[0].links[0];
        assert!(keep != "pull" || link.dropped == 0, "{link:#?}");
        drop(open);
        while data(&probe).1 < 45 {}
    }
}

#[test]
fn long_histories_of_many_subscribers_leave_a_slot_for_the_next_message() {
    let mut system = System::start();
    let how = format!("keep=all{SHARED}");
    let mut next = 0;
    system.run("source", &["--rate=500Hz"], None, move |armor, call| {
        if call == Call::Tick {
            for value in next..next + 4 {
                armor.send_data("out", &sample(value, 10))?;
            }
            next += 4;
        }
        Ok(Outcome::CarryOn)
    });
    let probe = run_sink(&mut system, "sink", "out", &how, None);
    let pulled = system.link("in", "source", "out", "pull") + ",history=32";
    for number in 0..12 {
        let (name, rate) = (format!("puller-{number}"), format!("--rate={}Hz", 20 + 3 * number));
        system.run(&name, &[&pulled, &rate], None, |_, _| Ok(Outcome::CarryOn));
    }
    // Each of them has pulled 32 messages, and nearly all of these are different ones.
    for number in 0..12 {
        system.until(&format!("puller-{number}"), |it| it.inputs[0].received > 40);
    }
    let published = system.status("source").outputs[0].published;
    while data(&probe).1 < published {}
    let source = system.status("source").outputs.remove(0);
    let dropped: Vec<_> = source.links.iter().map(|link| (&link.to, link.dropped)).collect();
    assert!(dropped.iter().all(|(_, dropped)| *dropped == 0), "{dropped:?}");
    assert_eq!(system.status("sink").inputs[0].lost, 0);
}
