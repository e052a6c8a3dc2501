//! Each kind of process is killed, one at a time. The rest continues, and the process returns.

use armor_wire::control::RunState;
use rustix::process::Signal;

use super::system::{Draft, System};
use super::trace::check_nothing_lost;
use crate::fixture::{Folder, is_alive, send_signal, wait_for};

/// Returns the number of messages that the probe `name` has received at its input `a`.
fn received(system: &System, name: &str) -> usize {
    system.trace(name).got("a").len()
}

/// Waits until the probe `name` has received `more` further messages.
fn receives(system: &System, name: &str, more: usize) {
    let before = received(system, name);
    system.traced(name, "more data", |trace| (trace.got("a").len() >= before + more).then_some(()));
}

#[test]
fn data_keeps_flowing_without_registry_and_configd() {
    let limit = 20_000;
    let draft = Draft::default()
        .probe("source", "rate='500Hz'", &format!("burst=10 limit={limit}"))
        .probe("sink", "", "")
        .link("source", "sink.a", "all");
    let system = draft.run(Folder::new("daemons-killed"));
    receives(&system, "sink", 500);
    let entry = system.entry("source");
    let registry = system.kill("registry");
    receives(&system, "sink", 500);
    // A subscriber that starts while the registry is down, or just after, must be linked as well.
    let _late = system.by_hand(&[
        "--name",
        "late",
        "--alone",
        "--link",
        "a=source.numbers,keep=all",
        "--set",
        "trace=late.trace",
    ]);
    wait_for("another registry", || Some(system.pid("registry")).filter(|pid| *pid != registry));
    receives(&system, "late", 100);
    assert_eq!(system.entry("source"), entry, "the same process is registered again");

    let configd = system.replace("configd");
    receives(&system, "sink", 500);
    assert_eq!(system.trace("source").count("sent all"), 0, "all this happened in the flow");
    for name in ["sink", "late"] {
        let got = system.traced(name, "the last number", |trace| {
            let got = trace.got("a");
            got.last().is_some_and(|got| got.count == limit - 1).then_some(got)
        });
        check_nothing_lost(name, &got);
        let [first, last] = [&got[0], &got[got.len() - 1]];
        assert_eq!(got.len() as u64, last.count - first.count + 1, "{name}: each one once");
    }
    assert!(is_alive(configd), "it stays");
    assert_eq!(system.trace("sink").count("started"), 1, "it never noticed");
    assert_eq!(system.status("sink").inputs[0].connections, 1);
}

#[test]
fn a_component_that_starts_without_configd_waits_for_it() {
    let draft = Draft::default()
        .probe("source", "rate='100Hz'", "")
        .probe("sink", "", "")
        .link("source", "sink.a", "all");
    let system = draft.run(Folder::new("waits-for-configd"));
    receives(&system, "sink", 10);
    // A stopped process still counts as running for the launcher, but answers no request.
    let configd = system.pid("configd");
    send_signal(configd, Signal::STOP);
    let sink = system.kill("sink");
    wait_for("another sink", || {
        system.entries().into_iter().find(|e| e.name == "sink" && e.pid.cast_signed() != sink)
    });
    send_signal(configd, Signal::KILL);
    receives(&system, "sink", 10);
}

#[test]
fn a_killed_component_disturbs_no_other_and_returns_with_its_links() {
    let draft = Draft::default()
        .probe("source", "rate='200Hz'", "")
        .probe("relay", "rate='200Hz'", "")
        .probe("sink", "", "")
        .probe("witness", "", "")
        .link("source", "relay.a", "all")
        .link("relay", "sink.a", "all")
        .link("source", "witness.a", "all");
    let system = draft.run(Folder::new("component-killed"));
    receives(&system, "sink", 20);
    receives(&system, "witness", 20);
    for name in ["relay", "sink", "source"] {
        let before = system.kill(name);
        for sink in ["relay", "sink", "witness"] {
            system.traced(sink, "data after the death", |trace| {
                let (mut from, mut pids) = (Vec::new(), Vec::new());
                for got in trace.got("a") {
                    from.push(got.from);
                    pids.push(got.pid);
                }
                from.dedup();
                pids.dedup();
                let (links, lives) = match (name, sink) {
                    ("relay", "relay") | ("sink", "sink") => (0, 2),
                    ("relay", "sink") => (2, 0),
                    ("source", "relay" | "witness") => (2, 0),
                    _ => (0, 0),
                };
                (from.len() >= links && pids.len() >= lives).then_some(())
            });
        }
        receives(&system, "witness", 20);
        assert!(!is_alive(before));
    }
    for name in ["relay", "sink", "witness"] {
        check_nothing_lost(name, &system.trace(name).got("a"));
    }
    assert_eq!(system.trace("witness").count("started"), 1, "it never noticed");
    assert_eq!(system.run.log().matches("SIGKILL").count(), 3, "{}", system.run.log());
}

/// `one` works until it is done, then `two` works and is never done.
const ONE_THEN_TWO: &str = "
<mission name='relay' goal='over' safe='hold'>
  <place name='first' initial='true' components='one'/>
  <place name='second' components='two'/>
  <place name='over'/>
  <place name='hold'/>
  <exclusive components='one two'/>
  <transition name='handover' from='first' to='second' on='one.done'/>
  <transition name='late' from='second' to='over' timeout='1h'/>
</mission>";

/// Returns the names of the marked places and the number of fired transitions.
fn marking(system: &System) -> Option<(Vec<String>, u64)> {
    let shown = system.read_json(&["mission", "show"]).pop()?;
    let places = shown["places"].as_array()?.iter();
    let names = places.filter_map(|place| Some(place["place"].as_str()?.to_owned())).collect();
    Some((names, shown["fired"].as_u64()?))
}

#[test]
fn the_executive_resumes_where_it_was_and_a_killed_component_gets_its_state_back() {
    let draft = Draft::default()
        .probe("one", "rate='50Hz'", "done=5 alone=alone")
        .probe("two", "rate='50Hz'", "alone=alone")
        .probe("watcher", "", "")
        .link("one", "watcher.b", "all")
        .link("two", "watcher.a", "all")
        .mission(ONE_THEN_TWO);
    let system = draft.run(Folder::new("executive-killed"));
    system.traced("two", "its start", |trace| (trace.count("tick") > 0).then_some(()));
    let second = (vec!["second".to_owned()], 1);
    wait_for("the second place", || marking(&system).filter(|now| *now == second));
    let activation = system.status("two").activation;
    for _ in 0..2 {
        let dead = system.kill("executive");
        receives(&system, "watcher", 20);
        wait_for("another executive", || Some(system.pid("executive")).filter(|pid| *pid != dead));
        wait_for("the same marking", || marking(&system).filter(|now| *now == second));
    }
    let trace = system.trace("two");
    assert_eq!((trace.count("started"), trace.count("stopping")), (1, 0), "never disturbed");
    assert_eq!(system.status("two").activation, activation);

    // The component of the marked place is activated again; the other one stays frozen.
    for name in ["two", "one"] {
        system.replace(name);
        let (state, starts) =
            if name == "two" { (RunState::Active, 2) } else { (RunState::Frozen, 1) };
        wait_for("its state", || system.answer(name).filter(|status| status.state == state));
        // A component reports that it is active before its first call ends, so the trace may lag.
        system.traced(name, "its starts", |trace| (trace.count("started") >= starts).then_some(()));
        assert_eq!(system.trace(name).count("started"), starts, "`{name}`");
        assert_eq!(system.trace(name).count("clash"), 0);
    }
    let now = wait_for("the marking", || marking(&system));
    assert_eq!(now, second, "it never left");
}

#[test]
fn a_component_that_does_not_stop_is_killed_before_its_successor_starts() {
    let draft = Draft::default()
        .probe("one", "rate='50Hz'", "hang=3 alone=alone")
        .probe("two", "rate='50Hz'", "alone=alone")
        .mission(
            "<mission name='relay' goal='over' safe='hold'>
              <place name='first' initial='true' components='one'/>
              <place name='second'/>
              <place name='rescue' components='two'/>
              <place name='over'/>
              <place name='hold'/>
              <exclusive components='one two'/>
              <transition name='late' from='first' to='second' timeout='1s' on-stop-fail='rescue'/>
              <transition name='never' from='rescue' to='over' timeout='1h'/>
              <transition name='nor' from='second' to='over' timeout='1h'/>
            </mission>",
        );
    let system = draft.run(Folder::new("hangs"));
    let hung = system
        .traced("one", "its hanging", |trace| trace.all("hangs").first().map(|note| note.pid));
    let two = system
        .traced("two", "its start", |trace| trace.all("started").first().map(|note| note.at_ns));
    assert!(!is_alive(hung), "killed first");
    let one = system.trace("one");
    assert_eq!(one.count("stopping"), 0, "it never came to rest by itself");
    assert!(one.0.iter().all(|note| note.at_ns < two), "{one:?}");
    assert_eq!(system.trace("two").count("clash"), 0);
    wait_for("the rescue", || marking(&system).filter(|now| now.0 == ["rescue"]));
}
