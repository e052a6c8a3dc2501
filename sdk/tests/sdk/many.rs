//! An input with several sources: each link has its own queue, counters and connection.

use std::sync::mpsc::{Receiver, Sender, channel};

use armor_sdk::prelude::*;

use crate::bench_system::{DEADLINE, ProbeEvent, System, sample};

/// Runs a publisher that sends the next number, from `first`, when the test asks for it.
fn run_source(system: &mut System, name: &str, first: u64) -> Sender<()> {
    let (send, go) = channel();
    let mut next = first;
    system.run(name, &["--rate=200Hz"], None, move |armor, _| {
        while go.try_recv().is_ok() {
            armor.send_data("out", &sample(next, 10))?;
            next += 1;
        }
        Ok(Outcome::CarryOn)
    });
    send
}

/// The source and the value of the next data.
fn next_data(probe: &Receiver<ProbeEvent>) -> (String, u64) {
    loop {
        match probe.recv_timeout(DEADLINE).expect("data in time") {
            ProbeEvent::Data { source, value, .. } => return (source, value),
            _ => continue,
        }
    }
}

#[test]
fn each_link_has_its_own_counters_and_one_that_ends_leaves_the_others() {
    let mut system = System::start();
    let links = ["front", "rear"].map(|source| system.link("all", source, "out", "all"));
    let sink = system.run("sink", &[&links[0], &links[1]], None, |armor, call| {
        let fed = armor.subscribed_data("all").unwrap_or_default();
        match (call, fed.split(' ').count()) {
            (Call::Started, 2) => Ok(Outcome::event("half", 1.0)),
            _ => Ok(Outcome::CarryOn),
        }
    });
    let front = run_source(&mut system, "front", 100);
    let rear = run_source(&mut system, "rear", 200);
    let sources = ["front", "rear"].map(|name| format!("{}.out", system.name(name)));
    let of = |status: &armor_sdk::control::Status| {
        let all = status.inputs.iter().filter(|input| input.id == "all").cloned();
        all.collect::<Vec<_>>()
    };
    for source in ["front", "rear"] {
        system.until_linked(source, "sink");
    }
    for (send, count) in [(&front, 3), (&rear, 1)] {
        (0..count).for_each(|_| send.send(()).unwrap());
    }
    let mut arrived: Vec<_> = (0..4).map(|_| next_data(&sink)).collect();
    arrived.sort();
    let expected =
        [(0, 100), (0, 101), (0, 102), (1, 200)].map(|(of, value)| (sources[of].clone(), value));
    assert_eq!(arrived, expected);
    let inputs =
        of(&system.until("sink", |it| of(it).iter().map(|it| it.received).sum::<u64>() == 4));
    let counted: Vec<_> = inputs.iter().map(|it| (it.data.clone(), it.received)).collect();
    assert_eq!(counted, [(sources[0].clone(), 3), (sources[1].clone(), 1)]);

    system.terminate("front");
    let inputs = of(&system.until("sink", |it| !of(it)[0].connected));
    assert!(inputs[1].connected, "{inputs:?}");
    rear.send(()).unwrap();
    assert_eq!(next_data(&sink), (sources[1].clone(), 201));
    let back = run_source(&mut system, "front", 300);
    system.until_linked("front", "sink");
    back.send(()).unwrap();
    assert_eq!(next_data(&sink), (sources[0].clone(), 300));
    assert_eq!(of(&system.status("sink"))[1].connections, 1);
}
