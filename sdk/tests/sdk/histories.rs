//! The last messages of an input: how many, since when, and those of a latched output.

use std::sync::mpsc::{Receiver, channel};

use armor_sdk::control::{Command, Role};
use armor_sdk::prelude::*;

use crate::bench_system::{DEADLINE, ProbeEvent, System, sample};

/// The next history that a probe sees.
fn next_history(probe: &Receiver<ProbeEvent>) -> Vec<u64> {
    loop {
        if let ProbeEvent::History(values) = probe.recv_timeout(DEADLINE).expect("a history") {
            return values;
        }
    }
}

/// Runs a publisher that sends the next number when the test asks for it.
fn run_counter(system: &mut System, output: &'static str) -> std::sync::mpsc::Sender<()> {
    let (send, go) = channel();
    let mut next = 0;
    system.run("source", &["--rate=200Hz"], None, move |armor, _| {
        while go.try_recv().is_ok() {
            next += 1;
            armor.send_data(output, &sample(next, 10))?;
        }
        Ok(Outcome::CarryOn)
    });
    send
}

#[test]
fn an_input_keeps_its_last_messages_of_one_activation() {
    let mut system = System::start();
    let link = system.link("in", "source", "out", "all") + ",history=3";
    let probe = system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    let send = run_counter(&mut system, "out");
    system.until_linked("source", "sink");
    for (_, expected) in [(1, vec![1]), (2, vec![2, 1]), (3, vec![3, 2, 1]), (4, vec![4, 3, 2])] {
        send.send(()).unwrap();
        assert_eq!(next_history(&probe), expected);
    }
    let (control, _events) = system.control("sink", Role::Executive);
    control.send(&Command::Freeze { activation: 1 }).unwrap();
    system.until("sink", |it| it.state.to_string() == "frozen");
    control.send(&Command::Activate { activation: 2, parameters: Vec::new() }).unwrap();
    system.until("source", |it| !it.outputs[0].links[0].paused);
    send.send(()).unwrap();
    assert_eq!(next_history(&probe), [5], "that of the activation before is forgotten");
}

#[test]
fn a_late_subscriber_of_a_latched_output_has_the_history_at_once() {
    let mut system = System::start();
    let send = run_counter(&mut system, "state");
    let early = system.link("in", "source", "state", "all") + ",history=4";
    let probe = system.run("early", &[&early], None, |_, _| Ok(Outcome::CarryOn));
    system.until("early", |it| it.inputs[0].connected);
    (0..6).for_each(|_| send.send(()).unwrap());
    while next_history(&probe) != [6, 5, 4, 3] {}
    for (history, expected) in [(3, vec![6, 5, 4]), (9, vec![6, 5, 4, 3]), (2, vec![6, 5])] {
        let name = format!("late-{history}");
        let link = system.link("in", "source", "state", "50") + &format!(",history={history}");
        let late = system.run(&name, &[&link], None, |_, _| Ok(Outcome::CarryOn));
        while next_history(&late) != expected {}
    }
    let link = system.link("in", "source", "state", "50");
    let plain = system.run("plain", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    let ProbeEvent::Data { value, .. } = first_data(&plain) else { unreachable!() };
    assert_eq!(value, 6, "without a history, the last value alone");
}

fn first_data(probe: &Receiver<ProbeEvent>) -> ProbeEvent {
    loop {
        let event = probe.recv_timeout(DEADLINE).expect("data");
        if matches!(event, ProbeEvent::Data { .. }) {
            return event;
        }
    }
}
