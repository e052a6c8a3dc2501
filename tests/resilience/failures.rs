//! Components that fail, panic or die: what they report, when the launcher gives them up, and where
//! the mission goes.

use std::net::{SocketAddr, TcpStream};
use std::process::Command;
use std::time::Duration;

use armor_registry::{BackgroundRegistry, RegistryOptions};
use armor_sdk::control::{ControlConnection, Role};
use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};

use super::system::{Draft, System, probe};
use super::trace::check_nothing_lost;
use crate::fixture::{Folder, is_alive, run_to_end, wait_for};

const WORKING: &str = "
<mission name='work' goal='over' safe='hold'>
  <place name='working' initial='true' components='worker'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='worked' from='working' to='over' on='worker.done'/>
</mission>";

fn working(name: &str, worker: &str) -> System {
    let draft = Draft::default()
        .probe("source", "rate='100Hz'", "")
        .probe("sink", "", "")
        .probe("worker", "rate='50Hz'", worker)
        .link("source", "sink.a", "all")
        .mission(WORKING);
    let system = draft.run(Folder::new(name));
    system.traced("worker", "its start", |trace| (trace.count("started") > 0).then_some(()));
    system.traced("sink", "data", |trace| (trace.got("a").len() > 5).then_some(()));
    system
}

#[test]
fn a_panic_is_a_report_and_sends_the_mission_to_its_safe_place() {
    let mut system = working("panics", "panic=20");
    assert_eq!(system.run.code(), Some(1), "{}", system.run.log());
    let log = system.run.log();
    assert!(log.contains("panicked: as the test wants it"), "{log}");
    assert!(log.contains("the mission ended in its safe place"), "{log}");
    check_nothing_lost("the sink", &system.trace("sink").got("a"));
    let last = system.trace("source").0.last().map(|note| note.words.join(" "));
    assert_eq!(last.as_deref(), Some("stopping"), "the others came to rest");
}

#[test]
fn a_panic_of_a_thread_of_its_own_is_a_failure_of_the_component_and_its_process_stays() {
    let mut system = working("thread-panics", "thread_panic=20");
    assert_eq!(system.run.code(), Some(1), "{}", system.run.log());
    let log = system.run.log();
    let why =
        "retreats: `worker` failed: the thread `aside` panicked at launcher/../tests/probe.rs:";
    assert!(log.lines().any(|line| line.contains(why) && line.ends_with("wants it")), "{log}");
    let reported = |line: &&str| line.contains("ERROR") && line.contains("the thread `aside`");
    assert_eq!(log.lines().filter(reported).count(), 1, "{log}");
    let trace = system.trace("worker");
    assert_eq!(trace.count("started"), 1, "it was not restarted");
    assert_eq!(trace.count("stopping"), 1, "it came to rest");
}

#[test]
fn a_component_that_has_failed_fails_a_run_without_a_mission() {
    // A component that fails needs time to start and to reach its third tick.
    for (fail, code, time) in [("fail=3", 1, "8s"), ("", 0, "1s")] {
        let draft = Draft::default().probe("worker", "rate='50Hz'", fail);
        let mut system = draft.run_with(Folder::new("fails-alone"), &["--for", time]);
        assert_eq!(system.run.code(), Some(code), "{}", system.run.log());
        assert_eq!(system.run.log().contains("failed: worker"), code == 1, "{}", system.run.log());
    }
}

/// Kills the worker until the launcher gives it up.
fn kill_until_given_up(system: &System) {
    for death in 1..=5 {
        let pid = system.kill("worker");
        wait_for("its end", || (!is_alive(pid)).then_some(()));
        if death < 5 {
            // Each time it is restarted and activated again.
            system.traced("worker", "another start", |trace| {
                (trace.count("started") > death).then_some(())
            });
        }
    }
    system.run.wait_for_log("it is given up after 5 starts", 1);
}

#[test]
fn a_component_that_is_given_up_fails_the_mission_with_the_reason() {
    let mut system = working("dies-too-often", "");
    kill_until_given_up(&system);
    assert_eq!(system.run.code(), Some(1), "{}", system.run.log());
    let log = system.run.log();
    let why = "retreats: `worker` failed: worker was given up after 5 starts in";
    assert!(log.lines().any(|line| line.contains(why) && line.contains("SIGKILL")), "{log}");
    assert!(log.contains("the mission ended in its safe place"), "{log}");
    check_nothing_lost("the sink", &system.trace("sink").got("a"));
}

#[test]
fn a_component_that_is_given_up_is_listed_with_its_history_and_the_others_continue() {
    let draft = Draft::default()
        .probe("source", "rate='100Hz'", "")
        .probe("sink", "", "")
        .probe("worker", "rate='50Hz'", "")
        .link("source", "sink.a", "all");
    let system = draft.run(Folder::new("given-up"));
    system.traced("worker", "its start", |trace| (trace.count("started") > 0).then_some(()));
    kill_until_given_up(&system);
    let got = system.trace("sink").got("a").len();
    let (code, shown, _) = run_to_end(&mut system.folder.armor(&["ps"]));
    let row = shown.lines().find(|line| line.starts_with("worker ")).unwrap_or_default();
    let history = ["given up", "5 starts; the last ends: ended by signal 9 (SIGKILL), ended by"];
    assert!(code == 0 && history.iter().all(|text| row.contains(text)), "{shown}");
    system.traced("sink", "more data", |trace| (trace.got("a").len() > got + 50).then_some(()));
    check_nothing_lost("the sink", &system.trace("sink").got("a"));
}

#[test]
fn without_configd_a_component_reports_it_and_ends() {
    let folder = Folder::new("no-configd");
    let listen = SocketAddr::from(([127, 0, 0, 1], 0));
    let registry =
        BackgroundRegistry::start(RegistryOptions { listen, ..RegistryOptions::default() })
            .expect("it listens");
    let mut lonely = Command::new(probe());
    let lonely = lonely.args(["--name", "lonely", "--registry", &registry.address().to_string()]);
    let (code, _, err) = run_to_end(lonely.current_dir(folder.path()));
    assert_eq!(code, 1, "{err}");
    let expected = ["configd has not answered within", "trace", "no process is called `configd`"];
    assert!(expected.iter().all(|text| err.contains(text)), "{err}");
}

#[test]
fn a_component_without_free_descriptors_logs_that_once_and_its_recovery() {
    let draft = Draft::default().probe("source", "rate='100Hz'", "").probe("sink", "", "");
    let system = draft.link("source", "sink.a", "all").run(Folder::new("no-descriptors"));
    system.traced("sink", "data", |trace| (trace.got("a").len() > 5).then_some(()));
    let source = system.entry("source");
    let pid = Pid::from_raw(system.pid("source"));
    let no_more = Rlimit { current: Some(0), ..getrlimit(Resource::Nofile) };
    let before = prlimit(pid, Resource::Nofile, no_more).expect("it is ours");
    let waiting = TcpStream::connect(&source.endpoint).expect("a place in the queue of the port");
    system.run.wait_for_log("cannot accept a connection: ", 1);
    let arrived = system.trace("sink").got("a").len();
    // Its links still work, and wake the thread that accepts.
    system.traced("sink", "more data", |trace| (trace.got("a").len() > arrived + 20).then_some(()));
    prlimit(pid, Resource::Nofile, before).expect("it is ours");
    system.run.wait_for_log("connections are accepted again", 1);
    let log = system.run.log();
    assert_eq!(log.matches("cannot accept a connection: ").count(), 1, "{log}");
    drop(waiting);
}

#[test]
fn a_component_with_fewer_descriptors_than_connections_serves_them_and_logs_that_once() {
    let draft = Draft::default().probe("source", "rate='100Hz'", "").probe("sink", "", "");
    let system = draft.link("source", "sink.a", "all").run(Folder::new("fewer-descriptors"));
    system.traced("sink", "data", |trace| (trace.got("a").len() > 5).then_some(()));
    let source = system.entry("source");
    let observer = ControlConnection::connect(&source, Role::Observer, "test", |_| {});
    let observer = observer.expect("it accepts connections");
    let pid = Pid::from_raw(system.pid("source"));
    // poll(2) fails for more descriptors than that.
    let fewer = Rlimit { current: Some(1), ..getrlimit(Resource::Nofile) };
    let before = prlimit(pid, Resource::Nofile, fewer).expect("it is ours");
    system.run.wait_for_log("cannot wait for ", 1);
    let arrived = system.trace("sink").got("a").len();
    system.traced("sink", "more data", |trace| (trace.got("a").len() > arrived + 20).then_some(()));
    wait_for("an answer", || observer.status(Duration::from_secs(2)).ok());
    prlimit(pid, Resource::Nofile, before).expect("it is ours");
    system.run.wait_for_log("connections are waited for again", 1);
    let log = system.run.log();
    assert_eq!(log.matches("cannot wait for ").count(), 1, "{log}");
}
