//! Links in datagrams (`transport="udp"`) within one host: what they carry, and where the stream does.

use std::sync::mpsc::{Receiver, channel};

use armor_sdk::control::{Command, Role};
use armor_sdk::prelude::*;

use crate::bench_system::{DEADLINE, ProbeEvent, System, data, sample};

/// More than datagrams carry.
const TOO_LONG: usize = 300 << 10;

/// Publishes 1, 2, 3, …, one per tick, of the lengths that `len` gives.
fn count_up(
    output: &'static str,
    len: impl Fn(u64) -> usize + Send + 'static,
) -> impl FnMut(&Armor, Call) -> Result<Outcome, Fault> + Send + 'static {
    let mut next = 0;
    move |armor, call| {
        if call == Call::Tick {
            next += 1;
            armor.send_data(output, &sample(next, len(next)))?;
        }
        Ok(Outcome::CarryOn)
    }
}

fn run_sink(system: &mut System, output: &str, keep: &str) -> Receiver<ProbeEvent> {
    let link = system.link("in", "source", output, keep) + ",transport=udp";
    system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn))
}

fn transport(system: &System, output: usize) -> String {
    let source = system.status("source");
    source.outputs[output].links.first().map_or(String::new(), |link| link.transport.clone())
}

/// Takes data until those of `last` have come; returns how many.
fn take_until(probe: &Receiver<ProbeEvent>, last: u64, mut before: u64) -> u64 {
    let mut count = 0;
    while before < last {
        let (_, value, _) = data(probe);
        assert!(value > before, "in order, each once: {value} after {before}");
        before = value;
        count += 1;
    }
    count
}

#[test]
fn data_of_every_length_come_in_order() {
    for keep in ["latest", "1", "3", "64"] {
        for len in [0, 100, 1200, 20_000] {
            let mut system = System::start();
            let probe = run_sink(&mut system, "out", keep);
            system.run("source", &["--rate=200Hz"], None, count_up("out", move |_| len));
            let first = data(&probe).1;
            system.until("source", |_| transport(&system, 0) == "udp");
            let published = system.status("source").outputs[0].published;
            let end = published + 60;
            let count = take_until(&probe, end, first);
            assert!(count >= 20, "{keep} {len}: {count} of {}", end - first);
            let link = &system.status("source").outputs[0].links[0];
            assert_eq!((link.transport.as_str(), link.dropped), ("udp", 0), "{keep} {len}");
            let sink = system.status("sink").inputs.remove(0);
            assert!(sink.received + sink.lost + sink.dropped >= end - first, "{sink:#?}");
        }
    }
}

#[test]
fn what_is_too_long_for_datagrams_takes_the_stream_in_its_place() {
    let mut system = System::start();
    let probe = run_sink(&mut system, "out", "64");
    let len = |value| if value % 100 == 0 { TOO_LONG } else { 10 };
    system.run("source", &["--rate=200Hz"], None, count_up("out", len));
    system.until("source", |_| transport(&system, 0) == "udp");
    let (_, mut before, _) = data(&probe);
    let mut lengths = Vec::new();
    while lengths.len() < 3 {
        let event = probe.recv_timeout(DEADLINE).unwrap();
        let ProbeEvent::Data { value, len, .. } = event else { continue };
        assert!(value > before, "{value} after {before}");
        before = value;
        if len > 10 {
            lengths.push(value);
        }
    }
    assert!(lengths.iter().all(|value| value % 100 == 0), "{lengths:?}");
    system.until("source", |_| transport(&system, 0) == "udp");
}

#[test]
fn a_latched_value_arrives_although_no_other_follows_it() {
    let mut system = System::start();
    let probe = run_sink(&mut system, "state", "latest");
    let (send, go) = channel();
    system.run("source", &["--rate=100Hz"], None, move |armor, _| {
        while let Ok(value) = go.try_recv() {
            armor.send_data("state", &sample(value, 2000))?;
        }
        Ok(Outcome::CarryOn)
    });
    system.until("sink", |it| it.inputs[0].connected);
    for value in 1..=5 {
        send.send(value).unwrap();
        assert_eq!(data(&probe), ("in".into(), value, 0));
        system.until("source", |_| transport(&system, 1) == "udp");
    }
}

#[test]
fn what_datagrams_cannot_keep_takes_the_stream() {
    for keep in ["all", "pull"] {
        let mut system = System::start();
        let link = system.link("in", "source", "out", keep) + ",transport=udp";
        let probe = system.run("sink", &[&link, "--rate=100Hz"], None, |_, _| Ok(Outcome::CarryOn));
        system.run("source", &["--rate=200Hz"], None, count_up("out", |_| 10));
        for _ in 0..50 {
            data(&probe);
        }
        assert_eq!(transport(&system, 0), "tcp", "{keep}");
    }
}

#[test]
fn a_subscriber_that_is_frozen_gets_nothing_and_then_the_newest() {
    let mut system = System::start();
    let probe = run_sink(&mut system, "out", "3");
    system.run("source", &["--rate=200Hz"], None, count_up("out", |_| 10));
    system.until("source", |_| transport(&system, 0) == "udp");
    let (control, _events) = system.control("sink", Role::Executive);
    control.send(&Command::Freeze { activation: 1 }).unwrap();
    system.until("source", |it| it.outputs[0].links[0].paused);
    let sent = system.status("source").outputs[0].links[0].sent;
    let published = system.status("source").outputs[0].published;
    system.until("source", |it| it.outputs[0].published > published + 50);
    assert_eq!(system.status("source").outputs[0].links[0].sent, sent);
    control.send(&Command::Activate { activation: 2, parameters: Vec::new() }).unwrap();
    let after = loop {
        let (_, value, lost) = data(&probe);
        if value > published + 40 {
            break (value, lost);
        }
    };
    assert_eq!(after.1, 0, "what was published meanwhile is not lost: {after:?}");
    assert_eq!(transport(&system, 0), "udp");
}
