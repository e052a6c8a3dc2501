//! The end of a run: no process outlives a killed launcher, and an interrupted launcher stops every
//! component in order before it ends.

use rustix::process::Signal;

use super::system::{Draft, System};
use crate::fixture::{Folder, is_alive, send_signal, wait_for};

/// Starts a mission with three active components and one frozen component.
fn at_work(name: &str) -> System {
    let draft = Draft::default()
        .probe("source", "rate='100Hz'", "")
        .probe("sink", "", "")
        .probe("worker", "rate='100Hz'", "")
        .probe("idler", "rate='100Hz'", "")
        .link("source", "sink.a", "all")
        .mission(
            "<mission name='work' goal='over' safe='over'>
              <place name='working' initial='true' components='worker'/>
              <place name='idling' components='idler'/>
              <place name='over'/>
              <transition name='tired' from='working' to='idling' timeout='1h'/>
              <transition name='fired' from='idling' to='over' timeout='1h'/>
            </mission>",
        );
    let system = draft.run(Folder::new(name));
    for name in ["source", "worker"] {
        system.traced(name, "a tick", |trace| (trace.count("tick") > 5).then_some(()));
    }
    system.traced("sink", "data", |trace| (trace.got("a").len() > 5).then_some(()));
    system.entry("idler");
    system
}

#[test]
fn no_process_of_a_system_outlives_its_killed_launcher() {
    let mut system = at_work("launcher-killed");
    let all = system.run.children();
    assert!(all.len() >= 8, "registry, configd, executive, group killer, four probes: {all:?}");
    system.run.signal(Signal::KILL);
    assert_eq!(system.run.code(), None, "it ends by the signal");
    wait_for("the end of all", || all.iter().all(|pid| !is_alive(*pid)).then_some(()));
    assert_eq!(system.trace("worker").count("stopping"), 0, "killed, not asked");
}

#[test]
fn an_interrupted_system_comes_to_rest_in_order() {
    let mut system = at_work("interrupted");
    let all = system.run.children();
    system.run.signal(Signal::INT);
    assert_eq!(system.run.code(), Some(130), "{}", system.run.log());
    assert!(all.iter().all(|pid| !is_alive(*pid)), "no process is left");
    for (name, stops) in [("source", 1), ("sink", 1), ("worker", 1), ("idler", 0)] {
        let trace = system.trace(name);
        assert_eq!((trace.count("started"), trace.count("stopping")), (stops, stops), "`{name}`");
        if stops > 0 {
            let last = trace.0.last().map(|note| note.words.join(" "));
            assert_eq!(last.as_deref(), Some("stopping"), "`{name}`: nothing comes after it");
        }
    }
    let log = system.run.log();
    assert!(!log.contains("SIGKILL") && !log.contains("is killed"), "{log}");
}

#[test]
fn after_its_last_call_a_component_gets_no_further_calls() {
    // The sink's event has no receiver. The sink waits a moment to deliver it, and must get no call
    // in that time.
    let draft = Draft::default()
        .probe("source", "rate='200Hz'", "")
        .probe("sink", "rate='50Hz' restart='never'", "event=1")
        .link("source", "sink.a", "all");
    let system = draft.run(Folder::new("last-call"));
    system.traced("sink", "data", |trace| (trace.got("a").len() > 20).then_some(()));
    let pid = system.pid("sink");
    send_signal(pid, Signal::TERM);
    wait_for("its end", || (!is_alive(pid)).then_some(()));
    let last = system.trace("sink").0.last().map(|note| note.words.join(" "));
    assert_eq!(last.as_deref(), Some("stopping"));
}
