//! One component of a running system: restarted, stopped, watched, and its log made longer. Data
//! that a tool prints, and the reasons why there is none.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use rustix::process::Signal;

use crate::fixture::{Dialogue, Folder, run_to_end, send_signal, wait_for};
use crate::resilience::system::{Draft, System};

/// Runs `armor` on a system; returns its exit code, stdout and stderr.
fn armor(system: &System, arguments: &[&str]) -> (i32, String, String) {
    let registry = system.registry.to_string();
    run_to_end(system.folder.armor(arguments).args(["--registry", &registry]))
}

fn armor_ok(system: &System, arguments: &[&str]) -> String {
    let (code, out, err) = armor(system, arguments);
    assert_eq!(code, 0, "{arguments:?}: {out}{err}\n{}", system.run.log());
    out
}

/// `worker` works; an operator can let `sleeper` take over.
const WORK: &str = "
<mission name='work' goal='over' safe='hold'>
  <place name='working' initial='true' components='worker'/>
  <place name='over'/>
  <place name='hold' components='sleeper'/>
  <transition name='worked' from='working' to='over' on='worker.done'/>
  <transition name='nap' from='working' to='hold' operator='true'/>
</mission>";

fn started(system: &System, name: &str, times: usize) {
    let what = format!("start number {times}");
    system.traced(name, &what, |trace| (trace.count("started") == times).then_some(()));
}

#[test]
fn a_component_that_has_failed_is_restarted_and_one_is_stopped_for_good() {
    let draft = Draft::default().probe("worker", "rate='50Hz'", "fail=50").probe(
        "other",
        "rate='50Hz'",
        "",
    );
    let mut system = draft.run(Folder::new("restarted"));
    wait_for("the failure", || system.shown(&["ps"]).contains("failed").then_some(()));
    let out = armor_ok(&system, &["restart", "worker"]);
    assert!(out.contains("worker is restarted\nworker runs: process "), "{out}");
    started(&system, "worker", 2);
    let (code, _, err) = armor(&system, &["restart", "wroker"]);
    assert!(code == 1 && err.contains("no component called wroker; did you mean worker?"), "{err}");

    armor_ok(&system, &["stop", "worker"]);
    wait_for("its end", || system.entries().iter().all(|it| it.name != "worker").then_some(()));
    system.run.wait_for_log("an operator has stopped it", 1);
    armor_ok(&system, &["restart", "worker"]);
    started(&system, "worker", 3);
    wait_for("the failure", || system.shown(&["ps"]).contains("failed").then_some(()));
    assert_eq!(system.trace("other").count("started"), 1, "the other one never noticed");
    armor_ok(&system, &["stop", "--all"]);
    // A component has failed, so the run has.
    assert_eq!(system.run.code(), Some(1), "{}", system.run.log());
    system.run.wait_for_log("probes: an operator has stopped it; failed: worker", 1);
}

#[test]
fn a_restart_that_does_not_succeed_fails_with_the_reason() {
    let draft = Draft::default().probe("worker", "rate='50Hz'", "fail=1");
    let system = draft.run(Folder::new("restarted-in-vain"));
    wait_for("the failure", || system.shown(&["ps"]).contains("failed").then_some(()));
    let (code, _, err) = armor(&system, &["restart", "worker"]);
    assert!(code == 1 && err.contains("error: worker has failed: "), "{err}");

    let draft = Draft::default().probe("worker", "rate='50Hz'", "panic=1").probe(
        "other",
        "rate='50Hz'",
        "",
    );
    let system = draft.run(Folder::new("given-up-again"));
    wait_for("the end", || system.shown(&["ps"]).contains("given up").then_some(()));
    let (code, out, err) = armor(&system, &["restart", "worker"]);
    // It is seen while it ends, or when it is given up.
    let expected = ["panicked: as the test wants it", "worker does not run: ended with code 101"];
    let is_expected = code == 1 && expected.iter().any(|why| err.contains(why));
    assert!(is_expected, "{code}: {out}{err}{}", system.run.log());
}

#[test]
fn a_component_of_a_mission_is_not_stopped_from_outside() {
    let draft = Draft::default()
        .probe("worker", "rate='50Hz'", "")
        .probe("sleeper", "rate='50Hz'", "")
        .mission(WORK);
    let system = draft.run(Folder::new("not-stopped"));
    started(&system, "worker", 1);
    let (code, _, err) = armor(&system, &["stop", "worker"]);
    assert!(code == 1 && err.contains("refused: a mission runs in this system"), "{err}");
    let (code, _, err) = armor(&system, &["mission", "fire", "napp"]);
    assert!(code == 1 && err.contains("called `napp`; did you mean nap?"), "{err}");

    // The other one is frozen, so its data do not arrive; the reason is reported.
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["echo", "sleeper.numbers", "--registry", &registry]);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    let mut echo = command.spawn().expect("armor starts");
    let mut lines = BufReader::new(echo.stderr.take().expect("piped")).lines();
    let line = lines.next().expect("a line").expect("UTF-8");
    let _ = echo.kill();
    let _ = echo.wait();
    assert!(line.starts_with("no sleeper.numbers so far: `sleeper` is frozen"), "{line}");
}

#[test]
fn a_watch_shows_states_and_reports_through_a_restart() {
    let draft = Draft::default().probe("worker", "rate='50Hz'", "fail=100");
    let system = draft.run(Folder::new("watched-reports"));
    started(&system, "worker", 1);
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["watch", "worker", "--registry", &registry]);
    let watch = Dialogue::start(&mut command);
    let await_line = |part: &str| while !watch.read_line().contains(part) {};
    await_line("  worker  active");
    armor_ok(&system, &["restart", "worker"]);
    await_line("  worker  gone: ended; an operator has restarted it");
    await_line("  worker  started again: process ");
    await_line("  worker  active");
    await_line("  worker  reports failed: ");
    await_line("  worker  failed");
    send_signal(system.pid("worker"), Signal::KILL);
    await_line("  worker  gone: ended by signal 9 (SIGKILL); it starts again in 0.1 s");
    await_line(", start number 3");
    send_signal(system.pid("worker"), Signal::STOP);
    await_line("  worker  gone: was killed while stopped (SIGSTOP or a debugger); it starts again");
    await_line(", start number 4");
    let (code, _, err) = armor(&system, &["watch", "wroker"]);
    assert!(code == 1 && err.contains("did you mean worker?"), "{err}");
}

#[test]
fn data_of_a_component_that_has_ended_for_good_is_not_waited_for() {
    let draft = Draft::default().probe("worker", "rate='50Hz' restart='never'", "panic=20");
    let system = draft.probe("other", "rate='50Hz'", "").run(Folder::new("echo-ended"));
    started(&system, "worker", 1);
    let why = [
        "`worker` has been given up (panicked at ",
        ": as the test wants it; it is not started again); `armor restart worker` starts it again",
    ];
    // The first may begin before its end, the second does not.
    for command in ["echo", "hz"] {
        let (code, _, err) = armor(&system, &[command, "worker.numbers"]);
        assert!(code == 1 && why.iter().all(|it| err.contains(it)), "{command}: {err}");
    }
    let (code, _, err) = armor(&system, &["echo", "other.nubmers"]);
    assert!(code == 1 && err.contains("did you mean other.numbers?"), "{err}");
}

#[test]
fn a_command_that_waits_ends_when_its_reader_has_seen_enough() {
    let draft = Draft::default()
        .probe("worker", "rate='50Hz'", "")
        .probe("sleeper", "rate='50Hz'", "")
        .mission(WORK);
    let system = draft.run(Folder::new("watched-pipe"));
    started(&system, "worker", 1);
    // Nothing happens in this system any more: only the closed pipe can end these.
    for arguments in [
        &["watch", "sleeper"][..],
        &["mission", "show", "--follow"],
        &["echo", "executive.marking", "--field", "stage"],
    ] {
        let registry = system.registry.to_string();
        let mut command = system.folder.armor(arguments);
        command.args(["--registry", &registry]).stdout(Stdio::piped());
        let mut child = command.spawn().expect("armor starts");
        let mut out = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        out.read_line(&mut line).expect("it prints");
        assert!(!line.is_empty(), "{arguments:?}");
        drop(out);
        let what = format!("the end of {arguments:?}");
        let status = wait_for(&what, || child.try_wait().expect("it is ours"));
        assert!(status.success(), "{arguments:?}: {status}");
    }
    let (code, _, err) = armor(&system, &["hz", "sleeper.numbers", "--count", "1"]);
    assert!(code == 1 && err.contains("no sleeper.numbers so far: `sleeper` is"), "{err}");
    let shown = system.shown(&["mission", "show"]);
    let waits = "worked (from working) waits for the report done of worker";
    assert!(shown.contains(waits) && shown.contains("\ncan fire    nap now"), "{shown}");
}

#[test]
fn a_refused_value_leaves_the_last_good_one_and_the_log_can_be_changed() {
    let draft = Draft::default().probe("lamp", "rate='20Hz'", "mark=one");
    let system = draft.run(Folder::new("refused-value"));
    let marked = |mark: &str, times: usize| {
        let note = format!("mark {mark}");
        system.traced("lamp", &note, |trace| (trace.count(&note) == times).then_some(()));
    };
    let set = |mark: &str| armor_ok(&system, &["param", "set", "lamp.mark", mark]);
    let refused = |before: &str| {
        let (code, out, err) = armor(&system, &["param", "set", "lamp.mark", "refused"]);
        let why = "error: lamp refuses the value, which the file has now: parameter `mark`: it is";
        assert!(code == 1 && out.contains("reaches lamp immediately"), "{out}{err}");
        let err = err.split_whitespace().collect::<Vec<_>>().join(" ");
        let undo = format!("such as the one before: `armor param set lamp.mark '{before}'`");
        assert!(err.contains(why) && err.ends_with(&undo), "{err}");
    };
    marked("one", 1);
    refused("one");
    // The last good value is handed over again.
    marked("one", 2);
    let refusal = "parameter `mark`: it is refused; its last good value stays in force";
    system.run.wait_for_log(refusal, 1);
    let shown = system.shown(&["ps"]);
    assert!(shown.contains("active") && shown.contains("it is refused"), "{shown}");
    let listed = system.shown(&["param", "list", "lamp"]);
    assert!(listed.contains("refused (refused)"), "{listed}");
    set("two");
    marked("two", 1);
    let shown = system.shown(&["ps"]);
    assert!(!shown.contains("it is refused"), "a good value has arrived: {shown}");
    assert!(!system.shown(&["param", "list", "lamp"]).contains("(refused)"));

    let out = armor_ok(&system, &["log", "lamp", "off"]);
    assert_eq!(out, "lamp: logs off from now on\n");
    refused("two");
    marked("two", 2);
    armor_ok(&system, &["log", "lamp", "info"]);
    set("three");
    refused("three");
    marked("three", 2);
    system.run.wait_for_log(refusal, 2);
    assert_eq!(system.run.log().matches(refusal).count(), 2, "one was not logged");
    let (code, _, err) = armor(&system, &["log", "lamp", "loud"]);
    assert!(code == 1 && err.contains("refused: `loud` is no level"), "{err}");
    assert_eq!(system.trace("lamp").count("started"), 1, "it ran on all the time");
}

#[test]
fn a_value_that_does_not_reach_its_component_is_said_to_wait() {
    let draft = Draft::default().probe("lamp", "rate='20Hz'", "hang=5").probe(
        "other",
        "rate='20Hz'",
        "mark=one",
    );
    let system = draft.run(Folder::new("delayed-value"));
    wait_for("the hanging call", || system.shown(&["ps"]).contains("in exec for").then_some(()));
    let plain = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let out = plain(&armor_ok(&system, &["param", "set", "lamp.mark", "two"]));
    assert!(out.contains("; lamp is in exec for ") && out.ends_with("gets it when that returns"));
    armor_ok(&system, &["stop", "other"]);
    wait_for("the end of other", || system.shown(&["ps"]).contains("stopped").then_some(()));
    let out = plain(&armor_ok(&system, &["param", "set", "other.mark", "two"]));
    let wanted = "other is stopped, and has it when it is started again: `armor restart other`";
    assert!(out.ends_with(wanted), "{out}");
}

#[test]
fn a_component_without_a_good_value_has_failed_until_one_arrives() {
    let draft = Draft::default().probe("lamp", "rate='20Hz'", "mark=refused");
    let system = draft.run(Folder::new("refused-at-start"));
    wait_for("the failure", || system.shown(&["ps"]).contains("failed").then_some(()));
    assert_eq!(system.trace("lamp").count("started"), 0);
    armor_ok(&system, &["param", "set", "lamp.mark", "fine"]);
    started(&system, "lamp", 1);
}

#[test]
fn data_are_listed_and_printed_by_field_and_as_a_table() {
    let draft = Draft::default()
        .probe("north", "rate='50Hz'", "")
        .probe("sink", "", "")
        .link("north", "sink.a", "latest");
    let system = draft.run(Folder::new("data"));
    system.traced("sink", "data", |trace| (trace.got("a").len() > 5).then_some(()));
    let listed = system.read_json(&["data", "list"]);
    let find = |data: &str| listed.iter().find(|output| output["data"] == data);
    let north = find("north.numbers").expect("it is listed");
    assert_eq!((&north["type"], &north["links"]), (&"Numbered".into(), &vec!["sink"].into()));
    assert!(north["rate_hz"].as_f64().is_some_and(|rate_hz| rate_hz > 1.0), "{north}");
    let sink = find("sink.numbers").expect("it is listed");
    assert_eq!(sink["links"], serde_json::json!([]));
    let table = armor_ok(&system, &["data", "list"]);
    assert!(table.contains("LINKED TO") && table.contains("not linked"), "{table}");
    for (tool, shown) in [
        (&["data", "list", "north"][..], "north.numbers"),
        (&["data", "list", "north.numbers"], "north.numbers"),
        (&["graph", "north"], "north.numbers"),
        (&["graph", "sink.a"], "north.numbers"),
        (&["ps", "north"], "north"),
    ] {
        let table = armor_ok(&system, tool);
        assert!(table.contains(shown) && !table.contains("sink.numbers"), "{tool:?}: {table}");
        assert!(!table.contains("configd"), "{tool:?}: {table}");
    }
    for tool in [&["data", "list", "nroth"][..], &["graph", "nroth"], &["ps", "nroth"]] {
        let (code, _, err) = armor(&system, tool);
        let meant = "no component is called nroth; did you mean north? (components: ";
        assert!(code == 1 && err.contains(meant), "{tool:?}: {err}");
    }

    let out = armor_ok(&system, &["echo", "north.numbers", "--once", "--field", "count"]);
    let value: serde_json::Value = serde_json::from_str(&out).expect("one JSON object");
    assert!(value["value"]["count"].is_u64() && value["value"]["bulk"].is_null(), "{out}");
    let out = armor_ok(&system, &["echo", "north.numbers", "--csv", "-n", "2"]);
    let rows: Vec<Vec<&str>> = out.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0], ["stamp_s", "sequence", "bulk", "count"]);
    assert!(rows.len() == 3 && rows[2].len() == 4, "{out}");
    let both = ["echo", "north.numbers", "--csv", "--format", "json"];
    let (code, out, err) = armor(&system, &both);
    assert!(code == 1 && out.is_empty() && err.contains("choose one"), "{out}{err}");
    let one = ["echo", "north.numbers", "--field", "count", "--once", "--csv"];
    let out = armor_ok(&system, &one);
    assert_eq!(out.lines().next(), Some("stamp_s,sequence,count"), "{out}");
    assert_eq!(out.lines().count(), 2, "{out}");
    let (code, _, err) = armor(&system, &["echo", "north.numbers", "--once", "--field", "cuont"]);
    assert!(code == 1 && err.contains("no field called cuont; did you mean count?"), "{err}");
    for (data, advice) in [
        (
            "north.nubmers",
            "`north` has no output called north.nubmers; did you mean north.numbers?",
        ),
        ("nroth.numbers", "none called `nroth` is running; did you mean north.numbers?"),
    ] {
        for tool in ["echo", "hz"] {
            let (code, _, err) = armor(&system, &[tool, data]);
            assert!(code == 1 && err.contains(advice), "{tool}: {err}");
        }
    }
}
