//! A running system, observed as the designer's window does. The observer sees states, rates and
//! values and disturbs nothing; a run ends with the process that started it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use armor_inspect::launch::{ChildRun, LaunchPlan, RunStage};
use armor_inspect::log::{LogLine, RunLog, Tail};
use armor_inspect::{
    Condition, MissionWatch, ObservedLink, OrderSender, ParameterClient, SystemWatch, WakeCallback,
    WatchedValues,
};
use armor_sdk::control::Order;
use rustix::process::Signal;
use serde_json::Value;

use crate::fixture::{Dialogue, Folder, is_alive, send_signal, wait_for};
use crate::resilience::system::{Draft, System};

/// A wake callback that counts its calls.
fn counted() -> (WakeCallback, Arc<AtomicUsize>) {
    let count = Arc::new(AtomicUsize::new(0));
    let counting = Arc::clone(&count);
    let wake = move || {
        counting.fetch_add(1, Ordering::Relaxed);
    };
    (Arc::new(wake), count)
}

fn nobody() -> WakeCallback {
    Arc::new(|| {})
}

/// `north` sends numbers to `watcher` at 50 Hz.
fn probes(name: &str) -> System {
    let draft = Draft::default().probe("north", "rate='50Hz'", "").probe("watcher", "", "").link(
        "north",
        "watcher.a",
        "1000",
    );
    draft.run(Folder::new(name))
}

fn watch(system: &System, wake: WakeCallback) -> SystemWatch {
    SystemWatch::begin(&system.registry.to_string(), "designer", wake).expect("threads")
}

fn is(watch: &SystemWatch, name: &str, condition: Condition) {
    wait_for(&format!("{name} to be {}", condition.word()), || {
        let picture = watch.picture();
        picture.processes.get(name).filter(|process| process.condition == condition).map(|_| ())
    });
}

fn link(watch: &SystemWatch, to: &str) -> Option<ObservedLink> {
    watch.picture().links.iter().find(|link| link.to == to).cloned()
}

/// Returns the links to tools, which `armor graph` lists without an input's name.
fn tools(system: &System) -> Vec<Value> {
    let links = system.read_json(&["graph"]);
    links
        .into_iter()
        .filter(|link| !link["to"].as_str().is_some_and(|to| to.contains('.')))
        .collect()
}

#[test]
fn an_observer_sees_states_rates_and_values_and_disturbs_nothing() {
    let system = probes("watched");
    let (wake, woken) = counted();
    let watch = watch(&system, wake);
    is(&watch, "north", Condition::Active);
    is(&watch, "watcher", Condition::Active);
    is(&watch, "configd", Condition::Active);
    wait_for("a rate", || link(&watch, "watcher.a")?.rate_hz.filter(|rate_hz| *rate_hz > 1.0));
    assert!(woken.load(Ordering::Relaxed) > 0, "a window is told when to look");
    assert_eq!(tools(&system), Vec::<Value>::new(), "who is not asked for data links to none");

    let values = WatchedValues::new(watch.directory().clone(), nobody());
    let seen = wait_for("data", || {
        let look = values.look("north.numbers");
        values.series("north.numbers", "count", |series| series.len() > 10).then_some(look)
    });
    assert_eq!((seen.problem.as_str(), values.linked()), ("", vec!["north.numbers".to_owned()]));
    let glance = seen.glance(10).expect("it fits its schema");
    assert!(glance.iter().any(|glimpse| glimpse.path == "count"), "{glance:?}");
    let tools =
        wait_for("the link for looking", || Some(tools(&system)).filter(|it| !it.is_empty()));
    assert!(tools.iter().all(|link| link["keep"] == "latest"), "{tools:?}");
    wait_for("the end of the look", || values.linked().is_empty().then_some(()));
    wait_for("its link let go", || self::tools(&system).is_empty().then_some(()));

    let edge = link(&watch, "watcher.a").expect("it is linked");
    assert_eq!((edge.keep.as_str(), edge.dropped, edge.lost), ("1000", 0, 0), "{edge:?}");
}

#[test]
fn a_killed_component_is_seen_to_leave_and_to_return() {
    let system = probes("watched-deaths");
    let watch = watch(&system, nobody());
    is(&watch, "north", Condition::Active);
    let before = system.kill("north");
    wait_for("the next north", || {
        let picture = watch.picture();
        let north = &picture.processes["north"];
        let is_back = north.starts == 2 && north.condition == Condition::Active;
        (is_back && i32::try_from(north.entry.pid) != Ok(before)).then_some(())
    });
    is(&watch, "watcher", Condition::Active);
    let log = RunLog::default();
    let path = system.run.out().join("logs/all.log");
    let _tail = Tail::begin(&path, log.clone(), nobody()).expect("a thread");
    wait_for("the launcher's word of it", || {
        let (_, lines) = log.since(0);
        lines
            .iter()
            .any(|line| line.name == "north" && line.text.contains("starts again"))
            .then_some(())
    });
    drop(system);
    wait_for("the end of the system", || watch.picture().has_ended().then_some(()));
}

/// Copies the office mission into the folder, where a test may change it.
fn office(folder: &Folder) -> PathBuf {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("missions");
    std::fs::create_dir_all(folder.path().join("worlds")).expect("writable");
    for file in ["office.xml", "worlds/office.svg"] {
        std::fs::copy(examples.join(file), folder.path().join(file)).expect("an example");
    }
    folder.path().join("office.xml")
}

fn plan(folder: &Folder) -> LaunchPlan {
    LaunchPlan {
        program: env!("CARGO_BIN_EXE_armor").into(),
        file: office(folder),
        out: Some(folder.path().join("out")),
        ..LaunchPlan::default()
    }
}

fn running(run: &ChildRun, log: &RunLog) -> armor_inspect::systems::RunRecord {
    wait_for("the run", || match run.stage() {
        RunStage::Running(record) => Some(record),
        RunStage::Starting => None,
        other => panic!("{other:?} {:?}", log.since(0)),
    })
}

#[test]
fn a_mission_is_run_watched_commanded_and_changed() {
    let folder = Folder::new("office-watched");
    let plan = plan(&folder);
    let log = RunLog::default();
    let run = ChildRun::start(&plan, log.clone(), nobody()).expect("armor starts");
    let record = running(&run, &log);
    assert!(record.runs(&plan.file), "{record:?}");
    let watch =
        SystemWatch::begin(&record.registry.to_string(), "designer", nobody()).expect("threads");
    let mission = MissionWatch::begin(watch.directory(), nobody()).expect("threads");
    let marked = |place: &str| {
        let look = mission.look();
        let marking = look.marking?;
        marking.places.iter().find(|marked| marked.place == place && marked.active).map(|_| ())
    };
    wait_for("the first place", || marked("explore"));
    is(&watch, "explorer", Condition::Active);
    is(&watch, "homing", Condition::Frozen);
    let first = mission.look().now_at_s(watch.timestamp());
    wait_for("mission time", || (mission.look().now_at_s(watch.timestamp()) > first).then_some(()));

    let desk = ParameterClient::open(watch.directory(), "designer", nobody()).expect("a thread");
    desk.set("driver", "speed", Some("40km/h"));
    let result = wait_for("the refusal", || desk.last_result());
    assert!(!result.is_set && !result.findings.is_empty(), "{result:?}");
    desk.set("driver", "speed", Some("0.8m/s"));
    wait_for("the value", || desk.last_result().filter(|result| result.is_set));
    let text = std::fs::read_to_string(&plan.file).expect("the file");
    assert!(text.contains(r#"<parameter name="speed" value="0.8m/s"/>"#), "{text}");

    let orders = OrderSender::open(watch.directory(), "designer", nobody()).expect("a thread");
    orders.give("ruth", false, Order::Pause);
    wait_for("the pause", || mission.look().marking?.pause.as_ref().map(|_| ()));
    orders.give("ruth", false, Order::Fire { transition: "nowhere".into() });
    orders.give("ruth", false, Order::Resume);
    let given = wait_for("three answers", || {
        let given = orders.given();
        (given.len() == 3 && given.iter().all(|given| given.accepted.is_some())).then_some(given)
    });
    let accepted: Vec<_> = given.iter().map(|given| given.accepted == Some(true)).collect();
    assert_eq!(accepted, [true, false, true], "{given:?}");
    orders.give("ruth", false, Order::Safe);
    let end = wait_for("the end", || match run.stage() {
        RunStage::Ended { how, is_fine } => Some((how, is_fine)),
        _ => None,
    });
    assert_eq!(end, ("the mission ended in its safe place".to_owned(), false));
    let (_, lines) = log.since(0);
    for (name, text) in [
        ("registry", "registered name=mapper"),
        ("executive", "ruth orders: safe; the mission goes to `hold`"),
        ("launcher", "ended: the mission ended in its safe place"),
    ] {
        let is_said = |line: &Arc<LogLine>| line.name == name && line.text.contains(text);
        assert!(lines.iter().any(is_said), "{name}: {text}: {lines:?}");
    }
}

#[test]
fn a_run_is_stopped_in_order() {
    let folder = Folder::new("office-stopped");
    let log = RunLog::default();
    let run = ChildRun::start(&plan(&folder), log.clone(), nobody()).expect("armor starts");
    running(&run, &log);
    run.stop();
    let end = wait_for("the end", || match run.stage() {
        RunStage::Ended { how, is_fine } => Some((how, is_fine)),
        _ => None,
    });
    assert_eq!(end, ("stopped".to_owned(), true));
}

#[test]
fn an_invalid_file_is_not_run_and_the_log_states_why() {
    let folder = Folder::new("not-run");
    let file = folder
        .write("wrong.xml", "<armor version='1'><system name='a'><component/></system></armor>");
    let log = RunLog::default();
    let run = ChildRun::start(&LaunchPlan { file, ..plan(&folder) }, log.clone(), nobody())
        .expect("it starts");
    let is_fine = wait_for("the end", || match run.stage() {
        RunStage::Ended { is_fine, .. } => Some(is_fine),
        _ => None,
    });
    let (_, lines) = log.since(0);
    let errors: Vec<_> = lines.iter().filter(|line| line.level == "ERROR").collect();
    assert!(!is_fine && errors.iter().any(|line| line.name == "check"), "{lines:?}");
}

/// Environment variable that is set only in the process that starts a run and is killed.
const STARTER: &str = "ARMOR_TEST_STARTER";

#[test]
fn a_run_ends_with_the_process_that_started_it() {
    let folder = Folder::new("killed-starter");
    let mut command = Command::new(std::env::current_exe().expect("this test"));
    command.args(["observers::starts_a_run_and_waits", "--exact", "--nocapture"]);
    command.env(STARTER, folder.path()).env("XDG_RUNTIME_DIR", folder.path());
    let starter = Dialogue::start(command.stderr(Stdio::null()));
    let pids = wait_for("the processes", || {
        let line = starter.read_line();
        let (_, pids) = line.split_once("pids ")?;
        pids.split(' ').map(|pid| pid.parse().ok()).collect::<Option<Vec<i32>>>()
    });
    assert!(pids.len() > 5 && pids.iter().all(|pid| is_alive(*pid)), "{pids:?}");
    starter.kill();
    for pid in pids {
        wait_for(&format!("the end of {pid}"), || (!is_alive(pid)).then_some(()));
    }
}

/// The process that [`a_run_ends_with_the_process_that_started_it`] starts and kills. Without
/// [`STARTER`] it is an ordinary test run and does nothing.
#[test]
fn starts_a_run_and_waits() {
    let Some(path) = std::env::var_os(STARTER) else { return };
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("missions");
    let plan = LaunchPlan {
        program: env!("CARGO_BIN_EXE_armor").into(),
        file: examples.join("office.xml"),
        out: Some(Path::new(&path).join("out")),
        ..LaunchPlan::default()
    };
    let log = RunLog::default();
    let run = ChildRun::start(&plan, log.clone(), nobody()).expect("armor starts");
    let record = running(&run, &log);
    let watch =
        SystemWatch::begin(&record.registry.to_string(), "designer", nobody()).expect("threads");
    is(&watch, "explorer", Condition::Active);
    let picture = watch.picture();
    let pids = picture.processes.values().map(|process| process.entry.pid).chain([record.pid]);
    println!("\npids {}", pids.map(|pid| pid.to_string()).collect::<Vec<_>>().join(" "));
    // The test kills this process meanwhile. If the test fails to, the run must end all the same.
    std::thread::sleep(crate::fixture::DEADLINE);
    send_signal(i32::try_from(record.pid).expect("a process id"), Signal::KILL);
}
