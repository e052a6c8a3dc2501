//! Processes that hang. A subscriber that is stopped (SIGSTOP) delays no other subscriber, and its
//! losses are counted. A process that stays silent is killed and replaced.

use armor_wire::control::LinkStatus;
use rustix::process::Signal;

use super::system::{Draft, System};
use super::trace::check_nothing_lost;
use crate::fixture::{DEADLINE, Folder, is_alive, send_signal, wait_for};

/// With 300 kB per message, a rate that a busy machine can sustain and that fills every buffer of a
/// link within a moment.
const BULK: &str = "rate='100Hz'";

fn three_subscribers(name: &str) -> System {
    let draft = Draft::default()
        .probe("source", BULK, "bulk=300000")
        .probe("latest", "", "")
        .probe("some", "", "")
        .probe("witness", "", "")
        .link("source", "latest.a", "latest")
        .link("source", "some.a", "20")
        .link("source", "witness.a", "all");
    let system = draft.run(Folder::new(name));
    for name in ["latest", "some", "witness"] {
        system.traced(name, "data", |trace| (trace.got("a").len() > 10).then_some(()));
    }
    system
}

/// Returns the link from the source to `name`, as the source reports it.
fn link(system: &System, name: &str) -> Option<LinkStatus> {
    let status = system.answer("source")?;
    status.outputs.first()?.links.iter().find(|link| link.to == name).cloned()
}

/// Stops `name` until the source has dropped messages for it, then continues it. Returns `false` if
/// that took so long that `name` was killed as hanging.
fn stop_for_a_moment(system: &System, name: &str) -> bool {
    let pid = system.pid(name);
    let instance = system.entry(name).instance;
    let before = link(system, name).map_or(0, |link| link.dropped);
    send_signal(pid, Signal::STOP);
    let dropped = wait_for("a loss or an end", || {
        let Some(link) = link(system, name) else { return Some(false) };
        (link.dropped > before + 5).then_some(true)
    });
    send_signal(pid, Signal::CONT);
    dropped && system.entry(name).instance == instance && {
        let got = system.trace(name).got("a").len();
        system.traced(name, "more data", |trace| (trace.got("a").len() > got).then_some(()));
        system.entry(name).instance == instance
    }
}

/// Returns the counts that `armor graph` prints for the link to `name`: sent, dropped, lost.
fn shown(system: &System, name: &str) -> Option<[u64; 3]> {
    let to = format!("{name}.a");
    let edge = system.read_json(&["graph"]).into_iter().find(|edge| edge["to"] == *to)?;
    Some(["sent", "dropped", "lost"].map(|field| edge[field].as_u64().expect("a number")))
}

#[test]
fn a_stopped_subscriber_delays_no_other_and_its_losses_are_counted() {
    let system = three_subscribers("stopped");
    for name in ["latest", "some"] {
        let start = std::time::Instant::now();
        while !stop_for_a_moment(&system, name) {
            assert!(start.elapsed() < DEADLINE, "`{name}` is killed each time before it goes on");
        }
        let [_, dropped, lost] = wait_for("the link in the graph", || {
            shown(&system, name).filter(|[_, dropped, lost]| dropped + lost > 0)
        });
        println!("{name}: {dropped} dropped and {lost} lost, as `armor graph` shows");
        assert!(lost > 0, "the gap is seen where the data arrives");

        // Every message between the first and the last is received or counted as lost or dropped.
        let pid = system.pid(name);
        let got: Vec<_> =
            system.trace(name).got("a").into_iter().filter(|got| got.pid == pid).collect();
        let [first, last] = [&got[0], &got[got.len() - 1]];
        let missing = last.count - first.count + 1 - got.len() as u64;
        let input = system.status(name).inputs[0].clone();
        assert!(missing <= input.lost + input.dropped, "{missing} are missing: {input:?}");
        assert!(missing > 0);
    }
    let witness = system.trace("witness").got("a");
    check_nothing_lost("the witness", &witness);
    assert_eq!(system.trace("witness").count("started"), 1);
}

#[test]
fn a_subscriber_that_stays_silent_is_killed_and_linked_again() {
    let system = three_subscribers("silent");
    let stopped = system.pid("some");
    let before = system.trace("witness").got("a").len();
    send_signal(stopped, Signal::STOP);
    let got = system.traced("some", "data of its successor", |trace| {
        trace.got("a").into_iter().find(|got| got.pid != stopped)
    });
    let log = system.run.log();
    let killed = "WARN was killed while stopped (SIGSTOP or a debugger); it starts again";
    assert!(
        log.contains("stopped (SIGSTOP or a debugger): suspected of hanging and killed"),
        "{log}"
    );
    assert!(log.contains(killed), "{log}");

    // Meanwhile the other subscribers received everything.
    let witness = system.trace("witness").got("a");
    check_nothing_lost("the witness", &witness);
    let meanwhile: Vec<_> =
        witness[before..].iter().take_while(|data| data.at_ns < got.at_ns).collect();
    let longest_ns = meanwhile.windows(2).map(|pair| pair[1].at_ns - pair[0].at_ns).max();
    println!("{} data meanwhile, at most {:?} ns apart", meanwhile.len(), longest_ns);
    assert!(meanwhile.len() > 50, "two seconds and more at 100 Hz: {}", meanwhile.len());
}

#[test]
fn a_call_that_never_returns_is_a_hang_if_the_file_sets_a_watchdog() {
    let draft = Draft::default().probe("stuck", "rate='50Hz' watchdog='1s'", "hang=3").probe(
        "busy",
        "rate='50Hz' watchdog='30s'",
        "work=10ms",
    );
    let system = draft.run(Folder::new("watchdog"));
    let hung = system
        .traced("stuck", "its hanging", |trace| trace.all("hangs").first().map(|note| note.pid));
    system.traced("stuck", "another process", |trace| {
        trace.all("started").iter().any(|note| note.pid != hung).then_some(())
    });
    assert!(!is_alive(hung), "killed before");
    system.run.wait_for_log("longer than its watchdog of 1 s allows", 1);
    system.run.wait_for_log("was killed by its watchdog (one call took ", 1);
    let busy = system.trace("busy");
    assert!(busy.0.iter().all(|note| note.pid == busy.0[0].pid), "its calls return");
}

#[test]
fn a_call_that_does_not_return_is_logged_once_and_shown_without_a_watchdog_too() {
    let draft = Draft::default().probe("stuck", "rate='50Hz'", "hang=3").probe(
        "slow",
        "rate='50Hz' watchdog='30s'",
        "work=3s",
    );
    let system = draft.run(Folder::new("long-calls"));
    let lines = |component: &str, part: &str| {
        let log = system.run.log();
        let is_it = |line: &&str| line.contains(&format!(" {component} ")) && line.contains(part);
        log.lines().filter(is_it).count()
    };
    let wait = |component: &str, part: &str, times: usize| {
        wait_for(&format!("{part} of {component}\n{}", system.run.log()), || {
            (lines(component, part) >= times).then_some(())
        });
    };
    wait("stuck", "WARN exec has not returned for 2.", 1);
    let shown = wait_for("the call", || {
        let shown = system.shown(&["ps"]);
        shown.lines().find(|line| line.starts_with("stuck ")).map(str::to_owned)
    });
    assert!(shown.contains(" active ") && shown.contains("in exec for "), "{shown}");
    wait("slow", "exec has not returned for", 2);
    wait("slow", "exec has returned after", 2);
    wait("slow", "if the call takes longer than 30 s", 2);
    wait("stuck", "`watchdog` in the file has such a process killed", 1);
    assert_eq!(lines("stuck", "exec has not returned"), 1, "{}", system.run.log());
    assert_eq!(lines("stuck", "exec has returned"), 0);
}

#[test]
fn a_daemon_that_hangs_is_killed_and_replaced_while_data_flows() {
    let draft = Draft::default()
        .probe("source", "rate='100Hz'", "")
        .probe("sink", "", "")
        .link("source", "sink.a", "all")
        .mission(
            "<mission name='stay' goal='over' safe='over'>
              <place name='here' initial='true'/><place name='over'/>
              <transition name='late' from='here' to='over' timeout='1h'/>
            </mission>",
        );
    let system = draft.run(Folder::new("daemons-stopped"));
    system.traced("sink", "data", |trace| (!trace.got("a").is_empty()).then_some(()));
    for daemon in ["executive", "configd", "registry"] {
        let before = system.pid(daemon);
        system.entry("executive");
        send_signal(before, Signal::STOP);
        wait_for(&format!("another {daemon}"), || {
            Some(system.pid(daemon)).filter(|pid| *pid != before)
        });
        let got = system.trace("sink").got("a").len();
        system.traced("sink", "more data", |trace| (trace.got("a").len() > got + 10).then_some(()));
    }
    system.entry("executive");
    let sink = system.trace("sink");
    check_nothing_lost("the sink", &sink.got("a"));
    assert_eq!(sink.count("started"), 1);
    assert_eq!(system.run.log().matches("suspected of hanging and killed").count(), 3);
}
