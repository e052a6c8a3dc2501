//! Links that pull: the newest data before each call of `exec`, and nothing in between.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};

use armor_sdk::control::{Command, Role};
use armor_sdk::prelude::*;

use crate::bench_system::{ProbeEvent, System, data, sample};

/// Within one host a link that pulls has memory, unless it must use TCP.
const WAYS: [&str; 2] = ["", ",transport=tcp"];

/// Publishes 1, 2, 3, … once per tick.
fn count_up(len: usize) -> impl FnMut(&Armor, Call) -> Result<Outcome, Fault> {
    let mut next = 0;
    move |armor, call| {
        if call == Call::Tick {
            next += 1;
            armor.send_data("out", &sample(next, len))?;
        }
        Ok(Outcome::CarryOn)
    }
}

/// Runs a subscriber that pulls; returns its events, and counts its calls.
fn run_puller(
    system: &mut System,
    arguments: &[&str],
    how: &str,
) -> (Receiver<ProbeEvent>, Arc<AtomicU64>) {
    let calls = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&calls);
    let link = system.link("in", "source", "out", "pull") + how;
    let arguments: Vec<_> = [&link as &str].into_iter().chain(arguments.iter().copied()).collect();
    let probe = system.run("sink", &arguments, None, move |_, call| {
        if call == Call::Tick || call == Call::Data {
            counted.fetch_add(1, Ordering::SeqCst);
        }
        Ok(Outcome::CarryOn)
    });
    (probe, calls)
}

#[test]
fn one_message_is_sent_for_each_call_and_what_is_passed_over_is_counted_as_skipped() {
    let lens = [10, 20_000, 1 << 20];
    for (len, how) in lens.iter().flat_map(|len| WAYS.map(|how| (*len, how))) {
        let mut system = System::start();
        let (probe, calls) = run_puller(&mut system, &["--rate=50Hz"], how);
        let published_so_far = Arc::new(AtomicU64::new(0));
        let counter = Arc::clone(&published_so_far);
        let mut publish = count_up(len);
        system.run("source", &["--rate=500Hz"], None, move |armor, call| {
            counter.fetch_add(u64::from(call == Call::Tick), Ordering::SeqCst);
            publish(armor, call)
        });
        let values: Vec<_> = (0..20).map(|_| data(&probe)).collect();
        assert!(values.is_sorted_by(|a, b| a.1 < b.1), "in order, each once: {values:?}");
        assert!(values.iter().all(|(_, _, lost)| *lost == 0), "nothing is lost: {values:?}");
        let published = system.status("source").outputs[0].published;
        let source = system.until("source", |it| it.outputs[0].published > published + 50);
        let link = &source.outputs[0].links[0];
        assert_eq!((link.keep.to_string().as_str(), link.dropped), ("pull", 0), "{len} bytes{how}");
        assert_eq!(link.transport, if how.is_empty() { "shm" } else { "tcp" });
        // While the offer of a new slot is awaited, a second message comes in the same pull.
        let slots = if how.is_empty() { 6 } else { 0 };
        let most = calls.load(Ordering::SeqCst) + 1 + slots;
        assert!(link.sent <= most, "{len} bytes{how}: {} sent, {most} calls", link.sent);
        system.terminate("source");
        let published_at_end = published_so_far.load(Ordering::SeqCst);
        let sink = system.until("sink", |it| !it.inputs[0].connected).inputs.remove(0);
        assert_eq!((sink.lost, sink.dropped), (0, 0));
        // A message is counted before the component's code has it.
        let last = (20..sink.received).fold(values[19].1, |_, _| data(&probe).1);
        let counted = sink.received + sink.skipped;
        // A first message that comes too late for its pull is passed over, and counted. So is what
        // comes before an answer that waits for a pull.
        let from_first = last - values[0].1 + 1;
        let most = if sink.waiting == 0 { last } else { published_at_end };
        assert!((from_first..=most).contains(&counted), "{len} bytes{how}: {last} {sink:#?}");
    }
}

#[test]
fn data_that_are_not_newer_are_not_sent_again_and_the_calls_go_on() {
    for how in WAYS {
        let mut system = System::start();
        let (probe, calls) = run_puller(&mut system, &["--rate=100Hz"], how);
        let (send, go) = channel();
        let mut next = 0;
        system.run("source", &["--rate=100Hz"], None, move |armor, _| {
            while go.try_recv().is_ok() {
                next += 1;
                armor.send_data("out", &sample(next, 10))?;
            }
            Ok(Outcome::CarryOn)
        });
        system.until("sink", |it| it.inputs[0].connected);
        for value in 1..=3 {
            send.send(()).unwrap();
            assert_eq!(data(&probe), ("in".into(), value, 0));
            let before = calls.load(Ordering::SeqCst);
            system.until("sink", |_| calls.load(Ordering::SeqCst) > before + 10);
            assert_eq!(system.status("sink").inputs[0].received, value, "once each");
        }
    }
}
#[test]
fn a_component_without_a_rate_pulls_before_the_call_that_other_data_cause() {
    for how in WAYS {
        let mut system = System::start();
        let pushed = system.link("in2", "clock", "out", "all");
        let (probe, _) = run_puller(&mut system, &[&pushed], how);
        system.run("source", &["--rate=200Hz"], None, count_up(10));
        system.until("sink", |it| it.inputs[0].connected);
        let mut left = 10;
        system.run("clock", &["--rate=20Hz"], None, move |armor, call| {
            if call == Call::Tick && left > 0 {
                left -= 1;
                armor.send_data("out", &sample(left, 10))?;
            }
            Ok(Outcome::CarryOn)
        });
        let mut inputs = Vec::new();
        while inputs.len() < 16 {
            inputs.push(data(&probe).0);
        }
        // Before each of the pushed data, at most one that was pulled.
        let doubled = inputs.windows(2).filter(|pair| pair[0] == "in" && pair[1] == "in").count();
        assert_eq!(doubled, 0, "{inputs:?}");
        assert!(inputs.iter().filter(|input| *input == "in").count() >= 6, "{inputs:?}");
    }
}
#[test]
fn a_frozen_component_pulls_nothing_and_one_that_is_activated_again_the_newest() {
    for how in WAYS {
        let mut system = System::start();
        let (probe, _) = run_puller(&mut system, &["--rate=100Hz"], how);
        let stops = Arc::new(AtomicBool::new(false));
        let (is_over, mut publish) = (Arc::clone(&stops), count_up(10));
        system.run("source", &["--rate=200Hz"], None, move |armor, call| {
            if is_over.load(Ordering::SeqCst) { Ok(Outcome::CarryOn) } else { publish(armor, call) }
        });
        data(&probe);
        let (control, _events) = system.control("sink", Role::Executive);
        control.send(&Command::Freeze { activation: 1 }).unwrap();
        system.until("sink", |it| it.state.to_string() == "frozen");
        while probe.try_recv().is_ok() {}
        let sent = |system: &System| {
            let output = system.status("source").outputs.remove(0);
            (output.links[0].sent, output.published)
        };
        let (before, published) = sent(&system);
        system.until("source", |it| it.outputs[0].published > published + 40);
        assert_eq!(sent(&system).0, before, "nothing is sent to it");
        stops.store(true, Ordering::SeqCst);
        let skipped = system.status("sink").inputs[0].skipped;
        control.send(&Command::Activate { activation: 2, parameters: Vec::new() }).unwrap();
        let (_, value, lost) = data(&probe);
        assert!(value > published + 40 && lost == 0, "{value} of {published}");
        let sink = system.status("sink").inputs.remove(0);
        // One that was taken from memory before it was frozen may be passed over.
        assert!(sink.skipped <= skipped + 1, "what was published meanwhile was not meant for it");
    }
}
#[test]
fn a_publisher_that_comes_back_is_pulled_from_again() {
    for how in WAYS {
        let mut system = System::start();
        let (probe, calls) = run_puller(&mut system, &["--rate=100Hz"], how);
        system.run("source", &["--rate=200Hz"], None, count_up(10));
        data(&probe);
        system.terminate("source");
        let before = calls.load(Ordering::SeqCst);
        system.until("sink", |_| calls.load(Ordering::SeqCst) > before + 10);
        while probe.try_recv().is_ok() {}
        system.run("source", &["--rate=200Hz"], None, count_up(10));
        let (_, value, lost) = data(&probe);
        assert!(value > 0 && lost == 0);
    }
}

#[test]
fn a_latched_value_is_there_at_the_first_pull() {
    for how in WAYS {
        let mut system = System::start();
        let mut next = 0;
        system.run("source", &["--rate=100Hz"], None, move |armor, call| {
            if call == Call::Tick && next < 3 {
                next += 1;
                armor.send_data("state", &sample(next, 10))?;
            }
            Ok(Outcome::CarryOn)
        });
        system.until("source", |it| it.outputs[1].published == 3);
        let link = system.link("in", "source", "state", "pull") + how;
        let probe = system.run("sink", &[&link, "--rate=100Hz"], None, |_, _| Ok(Outcome::CarryOn));
        assert_eq!(data(&probe), ("in".into(), 3, 0));
        let sink = system.status("sink").inputs.remove(0);
        assert_eq!((sink.skipped, sink.dropped), (0, 0));
    }
}

#[test]
fn a_publisher_that_stands_still_or_ends_delays_no_call() {
    for how in WAYS {
        let mut system = System::start();
        let (probe, calls) = run_puller(&mut system, &["--rate=100Hz"], how);
        let (stop, stopped) = channel::<()>();
        let mut next = 0;
        system.run("source", &["--rate=200Hz"], None, move |armor, _| {
            next += 1;
            armor.send_data("out", &sample(next, 10))?;
            // It stands still in its code, until the test ends.
            if next == 100 {
                let _ = stopped.recv();
            }
            Ok(Outcome::CarryOn)
        });
        let mut last = data(&probe);
        while last.1 < 100 {
            last = data(&probe);
        }
        let before = calls.load(Ordering::SeqCst);
        system.until("sink", |_| calls.load(Ordering::SeqCst) > before + 20);
        assert_eq!(system.status("sink").inputs[0].lost, 0);
        drop(stop);
    }
}
