//! Messages of any type: ports learn their type from the first link, and pass on bytes and stamps.

use std::collections::HashMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{LazyLock, Mutex};
use std::time::Duration;

use armor_sdk::control::Status;
use armor_sdk::prelude::*;
use armor_sdk::wire::schema::ANY_SCHEMA;

use crate::bench_system::{DEADLINE, Sample, System, data, is_linked_to, sample};

/// What a relay receives: source, stamp and bytes.
type Relayed = (String, f64, Vec<u8>);

static RELAYED: LazyLock<Mutex<HashMap<String, Sender<Relayed>>>> = LazyLock::new(Mutex::default);

/// Passes on what it receives, and shows it to the test.
struct Relay {
    armor: Armor,
    relayed: Sender<Relayed>,
}

impl Component for Relay {
    const KIND: &'static str = "relay";
    const SUMMARY: &'static str = "Passes messages on.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<AnyMessage>("out")?;
        armor.provide::<Latched<AnyMessage>>("last")?;
        armor.subscribe::<Many<AnyMessage>>("in")?;
        let name = armor.provided_data("out").unwrap_or_default().replace(".out", "");
        let relayed = RELAYED.lock().unwrap().get(&name).cloned();
        Ok(Self { armor, relayed: relayed.unwrap_or_else(|| channel().0) })
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let relayed = (header.data().into(), header.stamp_s, data.bytes().to_vec());
        let _ = self.relayed.send(relayed);
        let message = AnyMessage::received(header, data)?;
        assert_eq!(message.bytes(), data.bytes());
        for output in ["out", "last"] {
            self.armor.send_data(output, &message)?;
        }
        Ok(())
    }
}

fn run_relay(system: &mut System, name: &str, links: &[String]) -> Receiver<Relayed> {
    let (sender, receiver) = channel();
    RELAYED.lock().unwrap().insert(system.name(name), sender);
    let links: Vec<_> = links.iter().map(String::as_str).collect();
    system.run_kind::<Relay>(name, &links);
    receiver
}

/// Runs a publisher of samples of the lengths that the test sends it.
fn run_source(system: &mut System, name: &str) -> Sender<usize> {
    let (send, go) = channel();
    let mut next = 0;
    system.run(name, &["--rate=200Hz"], None, move |armor, _| {
        for len in go.try_iter() {
            armor.send_data("out", &sample(next, len))?;
            next += 1;
        }
        Ok(Outcome::CarryOn)
    });
    send
}

fn until(system: &System, name: &str, wanted: impl Fn(&Status) -> bool) -> Status {
    let start = std::time::Instant::now();
    loop {
        let status = system.status(name);
        if wanted(&status) {
            return status;
        }
        assert!(start.elapsed() < DEADLINE, "never in the wanted state: {status:#?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Waits until what the first of a chain publishes reaches the last.
fn until_linked(system: &System, chain: &[&str]) {
    for pair in chain.windows(2) {
        until(system, pair[0], is_linked_to(system.name(pair[1])));
    }
}

fn are_linked(count: usize) -> impl Fn(&Status) -> bool {
    move |status| status.inputs.iter().filter(|input| input.connected).count() == count
}

#[test]
fn bytes_and_stamps_are_passed_on_unchanged_over_every_transport() {
    for transport in ["auto", "tcp", "shm"] {
        let mut system = System::start();
        let how = format!("all,transport={transport}");
        let source = run_source(&mut system, "source");
        let in_link = system.link("in", "source", "out", &how);
        let relay = run_relay(&mut system, "relay", &[in_link]);
        // The end learns the type from the relay, which has learned it from the source.
        let out_link = system.link("in", "relay", "out", &how);
        let end = run_relay(&mut system, "end", &[out_link]);
        until_linked(&system, &["source", "relay", "end"]);
        let lens = [0, 10, 20_000, 3, 1 << 20, 70_000];
        for len in lens {
            source.send(len).unwrap();
            let (sent, got) = (relay.recv_timeout(DEADLINE), end.recv_timeout(DEADLINE));
            let (sent, got) = (sent.expect("relayed"), got.expect("arrived"));
            assert_eq!(sent.2.len(), 16 + len);
            assert_eq!((sent.1, sent.2), (got.1, got.2), "{len} bytes, {transport}");
            assert_eq!(got.0, format!("{}.out", system.name("relay")));
        }
        let status = until(&system, "relay", |status| status.outputs[0].published == 6);
        assert_eq!((status.outputs[0].type_name.as_str(), status.inputs[0].lost), ("Sample", 0));
    }
}

#[test]
fn an_output_without_a_type_is_looked_up_in_vain_until_the_first_link_gives_it_one() {
    let mut system = System::start();
    let in_link = system.link("in", "source", "out", "latest");
    let _relay = run_relay(&mut system, "relay", &[in_link]);
    let sink_link = system.link("in", "relay", "out", "all");
    let sink = system.run("sink", &[&sink_link], None, |_, _| Ok(Outcome::CarryOn));
    until(&system, "relay", |status| status.outputs.len() == 2);
    let data_name = format!("{}.out", system.name("relay"));
    let early = system.directory.find_provider(&data_name, Duration::from_millis(50));
    assert!(early.is_err(), "{early:?}");
    let source = run_source(&mut system, "source");
    let found = system.directory.find_provider(&data_name, DEADLINE).expect("its type is known");
    assert_eq!(found.entry.type_name, "Sample");
    assert_ne!(found.entry.schema, ANY_SCHEMA);
    until_linked(&system, &["source", "relay", "sink"]);
    source.send(10).unwrap();
    assert_eq!(data(&sink), ("in".into(), 0, 0));
}

#[test]
fn a_source_of_another_type_is_refused_with_both_names_and_leaves_the_others() {
    let mut system = System::start();
    let source = run_source(&mut system, "source");
    let links = ["out", "clock"].map(|output| system.link("in", "source", output, "all"));
    let relay = run_relay(&mut system, "relay", &links[..1]);
    until(&system, "relay", are_linked(1));
    system.terminate("relay");
    drop(relay);
    // The one that is linked first gives the type, whichever that is.
    let relay = run_relay(&mut system, "relay", &links);
    let has_problem = |status: &Status| {
        are_linked(1)(status) && status.inputs.iter().any(|it| it.problem.contains("linked first"))
    };
    let status = until(&system, "relay", has_problem);
    let problem = &status.inputs.iter().find(|it| !it.connected).expect("one is refused").problem;
    let name = system.name("source");
    for part in
        [format!("`{name}.out`"), format!("`{name}.clock`"), "Sample".into(), "Clock".into()]
    {
        assert!(problem.contains(&part), "{part} in {problem}");
    }
    if status.inputs[0].connected {
        until(&system, "source", |status| status.outputs[0].links.iter().any(|link| !link.paused));
        source.send(10).unwrap();
        assert_eq!(relay.recv_timeout(DEADLINE).expect("it goes on").0, format!("{name}.out"));
    }
}

#[test]
fn subscribers_continue_after_a_restart_and_a_late_one_gets_the_last() {
    let mut system = System::start();
    let source = run_source(&mut system, "source");
    let in_link = system.link("in", "source", "out", "all");
    let relay = run_relay(&mut system, "relay", std::slice::from_ref(&in_link));
    let sink_link = system.link("in", "relay", "out", "all");
    let sink = system.run("sink", &[&sink_link], None, |_, _| Ok(Outcome::CarryOn));
    until_linked(&system, &["source", "relay", "sink"]);
    source.send(10).unwrap();
    assert_eq!(data(&sink).1, 0);
    system.terminate("relay");
    system.until("sink", |status| !status.inputs[0].connected);
    drop(relay);
    let _relay = run_relay(&mut system, "relay", &[in_link]);
    until_linked(&system, &["source", "relay", "sink"]);
    source.send(20).unwrap();
    assert_eq!(data(&sink).1, 1);
    let last = system.link("in", "relay", "last", "latest");
    let late = system.run("late", &[&last], None, |_, _| Ok(Outcome::CarryOn));
    assert_eq!(data(&late), ("in".into(), 1, 0));
}

/// Has an output of any type, and no input that gives it one.
struct Rootless;

impl Component for Rootless {
    const KIND: &'static str = "rootless";
    const SUMMARY: &'static str = "Passes on nothing.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<AnyMessage>("out")?;
        armor.subscribe::<Sample>("in")?;
        Ok(Self)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let error = AnyMessage::received(header, data).expect_err("it has a type").to_string();
        assert!(error.contains("input `in` is declared as Sample, but was decoded as Any"));
        Ok(())
    }
}

#[test]
fn a_component_without_an_input_of_any_type_has_no_output_of_any_type() {
    let error = armor_sdk::manifest_of::<Rootless>().expect_err("refused").to_string();
    let expected = "the port out: it has the type of the input of type Any, and the kind has 0 of \
                    them; declare exactly one input of type Any";
    assert_eq!(error, expected);
    let relay = armor_sdk::manifest_of::<Relay>().expect("it has one");
    assert!(relay.inputs[0].is_any() && relay.outputs.iter().all(|output| output.is_any()));
    let built = armor_sdk::testing::TestedComponent::build::<Rootless>(&[]);
    let error = built.err().expect("refused");
    assert_eq!(error.to_string(), format!("`rootless` cannot be built: {expected}"));
}
