//! The commands that observe a running system: what they measure, print and refuse.

use std::path::Path;

use rustix::process::Signal;
use serde_json::Value;

use crate::fixture::{Dialogue, Folder, run_to_end, send_signal, wait_for};
use crate::resilience::system::{Draft, System};

/// Runs `armor` on a system; returns its exit code, stdout and stderr.
fn armor(system: &System, arguments: &[&str]) -> (i32, String, String) {
    let registry = system.registry.to_string();
    run_to_end(system.folder.armor(arguments).args(["--registry", &registry]))
}

#[test]
fn bytes_and_ages_of_data_are_measured() {
    let draft = Draft::default().probe("north", "rate='50Hz'", "bulk=1000").probe(
        "mute",
        "rate='0.01Hz'",
        "",
    );
    let system = draft.run(Folder::new("measured"));
    system.status("north");
    let sizes = system.read_json(&["bw", "north.numbers", "-n", "2"]);
    assert_eq!(sizes.len(), 2, "{sizes:?}");
    // A count and a length of eight bytes each, and the bulk.
    let [size, received] = ["message_max_bytes", "received"].map(|name| sizes[1][name].as_u64());
    assert_eq!((sizes[1]["message_min_bytes"].as_u64(), size), (Some(1016), Some(1016)));
    assert_eq!(sizes[1]["bytes"].as_u64(), received.map(|count| count * 1016), "{sizes:?}");
    assert!(sizes[1]["bytes_per_s"].as_f64() > Some(0.0), "{sizes:?}");

    let ages = system.read_json(&["delay", "north.numbers", "-n", "2"]);
    assert_eq!(ages.len(), 2, "{ages:?}");
    let error_s = ages[1]["clock_error_s"].as_f64().expect("both clocks are known");
    let p50_s = ages[1]["published"]["p50_s"].as_f64().expect("data arrived");
    assert!(p50_s >= -error_s, "they were not published in the future: {ages:?}");
    assert!(ages[1]["stamp"].is_null() && ages[1]["clock"].is_null(), "{ages:?}");

    // One result over the time, and why there is none where nothing arrives.
    for tool in ["hz", "bw", "delay"] {
        let results = system.read_json(&[tool, "north.numbers", "--for", "1500ms"]);
        let [result] = &results[..] else { panic!("{tool}: {results:?}") };
        assert!(result["received"].as_u64() > Some(1), "{tool}: {result}");
        let (code, out, err) = armor(&system, &[tool, "mute.numbers", "--for", "100ms"]);
        assert_eq!((code, out.lines().count()), (1, 1), "{tool}: {out}{err}");
        assert!(err.contains("no mute.numbers so far: `mute` is active"), "{tool}: {err}");
    }

    for tool in ["bw", "delay"] {
        let (code, out, err) = armor(&system, &[tool, "north.numbers", "-n", "1"]);
        assert!(code == 0 && out.contains(" received"), "{tool}: {out}{err}");
        let (code, _, err) = armor(&system, &[tool, "north.nubmers"]);
        assert!(code == 1 && err.contains("did you mean north.numbers?"), "{tool}: {err}");
    }
}

#[test]
fn ages_are_in_the_time_that_the_system_follows() {
    let world = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/worlds/empty.svg");
    let simulator = format!(
        "<clock source='simulator.clock'/>
         <component name='simulator' kind='simulator' rate='100Hz'>
           <parameter name='world' value='{}'/>
           <parameter name='speed' value='5'/>
         </component>\n",
        world.display()
    );
    let draft = Draft::default().component(&simulator).probe("north", "rate='50Hz'", "");
    let system = draft.run(Folder::new("simulated-ages"));
    let ages = wait_for("an age", || {
        let ages = system.read_json(&["delay", "north.numbers", "-n", "1"]);
        ages.into_iter().find(|it| it["published"].is_object() && it["clock"].is_string())
    });
    assert_eq!(ages["clock"], Value::from("simulator.clock"));
    // Simulated time begins at 0: by the host's clock they would be decades old.
    assert!(ages["published"]["max_s"].as_f64().is_some_and(|max_s| max_s < 3600.0), "{ages}");
    // The simulator itself uses the host's clock.
    let own = system.read_json(&["delay", "simulator.odometry", "-n", "1"]);
    assert!(own[0]["clock"].is_null(), "{own:?}");
}

#[test]
fn an_output_is_described_and_ports_are_found() {
    let draft = Draft::default().probe("north", "rate='50Hz'", "bulk=10").probe("watcher", "", "");
    let draft = draft.link("north", "watcher.a", "1000");
    let system = draft.run(Folder::new("described"));
    let info = wait_for("the link", || {
        let info = system.read_json(&["data", "info", "north.numbers"]).pop()?;
        (info["links"].as_array()?.len() == 1 && info["last"].is_object()).then_some(info)
    });
    assert_eq!((&info["type"], &info["latched"]), (&Value::from("Numbered"), &Value::from(false)));
    assert_eq!(info["fields"][0]["path"], Value::from("count"), "{info}");
    assert_eq!(info["provider"]["component"], Value::from("north"), "{info}");
    let link = &info["links"][0];
    assert_eq!((&link["to"], &link["keep"]), (&"watcher.a".into(), &"1000".into()), "{info}");
    // A count and a length of eight bytes each, and the bulk.
    assert_eq!(info["last"]["bytes"], Value::from(26), "{info}");
    assert!(info["last"]["age_s"].is_f64(), "{info}");
    let (code, out, err) = armor(&system, &["data", "info", "north.numbers"]);
    assert_eq!(code, 0, "{err}");
    for part in
        ["north.numbers: Numbered\n", "LINKED TO", "watcher.a", "FIELD", "bulk", "last value"]
    {
        assert!(out.contains(part), "{part}: {out}");
    }
    let (code, _, err) = armor(&system, &["data", "info", "north.nubmers"]);
    assert!(code == 1 && err.contains("did you mean north.numbers?"), "{err}");

    let found = system.read_json(&["data", "find", "numbered"]);
    let ports: Vec<_> = found.iter().filter_map(|it| it["port"].as_str()).collect();
    assert!(ports.contains(&"north.numbers") && ports.contains(&"watcher.a"), "{ports:?}");
    let (code, out, _) = armor(&system, &["data", "find", "bul"]);
    assert!(code == 0 && out.contains("bulk"), "{out}");
    let (code, _, err) = armor(&system, &["data", "find", "velocity"]);
    assert!(code == 1 && err.contains("armor data list"), "{err}");
}

#[test]
fn data_are_published_by_hand_in_the_place_of_a_component_that_is_stopped() {
    let draft = Draft::default().probe("north", "rate='50Hz'", "").probe("watcher", "", "");
    let draft = draft.link("north", "watcher.a", "1000");
    let system = draft.run(Folder::new("published"));
    let publish = |fields: &[&str]| {
        let arguments = [&["data", "pub", "north.numbers"], fields].concat();
        armor(&system, &arguments)
    };
    system.status("watcher");
    let (code, _, err) = publish(&["Numbered", "count=77777"]);
    assert!(code == 1 && err.contains("`armor stop north` makes room"), "{err}");
    let (code, _, err) = armor(&system, &["data", "pub", "north.other", "Numbered"]);
    assert!(code == 1 && err.contains("only north itself can publish north.other"), "{err}");
    for (input, advice) in [
        ("watcher.a", "the file links north.numbers to it. `armor stop north` makes room"),
        ("watcher.b", "no link of the file feeds it. Link an output to it, and publish that"),
    ] {
        let (code, _, err) = armor(&system, &["data", "pub", input, "Numbered"]);
        let err = err.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(code == 1 && err.contains(&format!("{input} is an input")), "{err}");
        assert!(err.contains(advice), "{err}");
    }

    assert_eq!(armor(&system, &["stop", "north"]).0, 0);
    wait_for("its end", || system.entries().iter().all(|it| it.name != "north").then_some(()));
    for (fields, why) in [
        (&["Nubmered"][..], "no type is called Nubmered; did you mean Numbered?"),
        (&["Twist"], "watcher.a, which the file links to north.numbers, takes a Numbered"),
        (&["Numbered", "count=-1", "cuont=1"], "cuont: `cuont` is not a field there"),
        (&["Numbered", "count=-1", "cuont=1"], "count: -1 is not a whole number from 0 to"),
    ] {
        let (code, _, err) = publish(fields);
        assert!(code == 1 && err.contains(why), "{fields:?}: {err}");
    }
    let (code, out, err) = publish(&["Numbered", "count=77777", "bulk=AQID"]);
    assert!(code == 0 && out.contains("watcher.a: received"), "{out}{err}");
    system.traced("watcher", "it", |trace| {
        trace.got("a").iter().any(|got| got.count == 77777).then_some(())
    });
    let (code, out, err) = publish(&["Numbered", "--rate", "50", "-n", "5", "--format", "json"]);
    let result: Value = serde_json::from_str(&out).expect("one JSON object");
    assert_eq!((code, &result["published"]), (0, &Value::from(5)), "{out}{err}");
    assert_eq!(result["inputs"][0]["outcome"], Value::from("received"), "{out}");
    // Nothing is in the way of the component.
    let (code, out, err) = armor(&system, &["restart", "north"]);
    assert_eq!(code, 0, "{out}{err}");

    let (code, out, err) = armor(&system, &["data", "pub", "test.goal", "Twist", "linear.x=1"]);
    assert!(code == 1 && err.contains("nothing is linked to test.goal"), "{out}{err}");
}

#[test]
fn the_use_of_a_system_is_shown_once_and_line_by_line() {
    let draft = Draft::default().probe("north", "rate='50Hz'", "bulk=10");
    let draft = draft.probe("south", "rate='20Hz'", "bulk=100000").probe("watcher", "", "");
    let draft = draft.link("north", "watcher.a", "1000").link("south", "watcher.b", "1000");
    let system = draft.run(Folder::new("top"));
    system.status("watcher");
    let looks = system.read_json(&["top", "-n", "2"]);
    assert_eq!(looks.len(), 2, "{looks:?}");
    let last = &looks[1];
    let row = |name: &str| {
        let rows = last["components"].as_array().expect("rows");
        rows.iter().find(|row| row["name"] == name).cloned().unwrap_or_default()
    };
    for name in ["north", "south", "watcher", "configd"] {
        assert!(row(name)["memory_bytes"].as_u64() > Some(0), "{name}: {last}");
    }
    // The bytes are those of the messages, through a socket and through memory.
    for (name, len) in [("north", 26.0), ("south", 100_016.0)] {
        let [bytes, count] =
            ["output_bytes_per_s", "output_hz"].map(|it| row(name)[it].as_f64().expect("a rate"));
        assert!(count > 0.0 && (bytes / count - len).abs() < 1e-6, "{name}: {}", row(name));
    }
    assert_eq!(last["links"].as_array().map(Vec::len), Some(2), "{last}");
    assert!(last["mission"].is_null() && last["is_found"] == true, "{last}");

    assert_eq!(armor(&system, &["stop", "south"]).0, 0);
    wait_for("its end", || {
        let (code, out, err) = armor(&system, &["top", "--once", "--sort", "name"]);
        assert_eq!(code, 0, "{err}");
        assert!(out.contains("no mission") && out.contains("NAME"), "{out}");
        let stopped = out.lines().find(|line| line.starts_with("south"));
        stopped.filter(|line| line.contains("stopped")).map(drop)
    });
    let (code, _, err) = armor(&system, &["top", "--interval", "10ms"]);
    assert!(code == 2 && err.contains("at least 0.5s"), "{err}");
}

#[test]
fn the_logs_of_a_run_are_merged_filtered_and_followed_to_its_end() {
    let draft = Draft::default().probe("north", "rate='50Hz'", "panic=1 ").probe("south", "", "");
    let mut system = draft.run(Folder::new("logs"));
    let out = system.run.out().display().to_string();
    system.run.wait_for_log("as the test wants it", 1);
    let follow = {
        let registry = system.registry.to_string();
        let mut command = system.folder.armor(&["logs", "-f", "-n", "0", "--component", "north"]);
        Dialogue::start(command.args(["--registry", &registry]))
    };
    let line = follow.read_line();
    assert!(line.contains("north") && !line.contains("south"), "{line}");
    let warnings = wait_for("a warning", || {
        let lines = system.read_json(&["logs", "--level", "warn", "--component", "north"]);
        (!lines.is_empty()).then_some(lines)
    });
    for line in &warnings {
        assert!(matches!(line["level"].as_str(), Some("WARN" | "ERROR")), "{line}");
        assert!(line["date"].is_string() && line["name"] == "north", "{line}");
    }
    let all = system.read_json(&["logs"]);
    let dates: Vec<_> = all.iter().filter_map(|line| line["date"].as_str()).collect();
    assert!(dates.is_sorted() && dates.len() == all.len(), "{all:?}");
    assert_eq!(system.read_json(&["logs", "-n", "2"]).len(), 2);
    assert_eq!(system.read_json(&["logs", "--since", "2099-01-01T00:00:00"]), Vec::<Value>::new());
    let (code, _, err) = armor(&system, &["logs", "--component", "nroth"]);
    assert!(code == 1 && err.contains("no log of nroth; did you mean north?"), "{err}");

    system.run.signal(Signal::INT);
    system.run.code();
    follow.wait_for_end();
    let mut command = system.folder.armor(&["logs", "--out", &out, "--component", "launcher"]);
    let (code, text, err) = run_to_end(&mut command);
    assert!(code == 0 && text.contains("launcher"), "{text}{err}");
    let (code, _, err) = run_to_end(&mut system.folder.armor(&["logs", "--out", "nowhere"]));
    assert!(code == 1 && err.contains("it is not the folder of a run"), "{err}");
}

#[test]
fn the_first_line_of_a_component_that_has_written_nothing_is_awaited() {
    let folder = Folder::new("silent-logs");
    folder.script("mute", "while [ ! -e go ]; do sleep 0.05; done; echo here; exec sleep 1000");
    let draft = Draft::default().component("<component name='mute' kind='mute'/>\n");
    let system = draft.run(folder);
    // Before it has written anything, the launcher has started it.
    let absent = |err: &str| err.contains("mute has written nothing yet; `-f` waits for it");
    wait_for("the run", || {
        let (code, _, err) = armor(&system, &["logs", "--component", "mute"]);
        (code == 1 && absent(&err)).then_some(())
    });
    let (code, _, err) = armor(&system, &["logs", "-f", "--component", "mtue"]);
    assert!(code == 1 && err.contains("no log of mtue; did you mean mute?"), "{err}");
    let noticed = system.folder.path().join("noticed");
    let registry = system.registry.to_string();
    let line = "exec \"$0\" logs -f --component mute --registry \"$1\" 2> noticed";
    let mut command = system.folder.command_of(Path::new("/bin/sh"));
    command.args(["-c", line, env!("CARGO_BIN_EXE_armor"), &registry]);
    let follow = Dialogue::start(&mut command);
    wait_for("the notice", || {
        let printed = std::fs::read_to_string(&noticed).unwrap_or_default();
        printed.contains("mute has written nothing yet; its first line is awaited").then_some(())
    });
    // The run's processes have the folder of `armor run` as their own.
    system.folder.write("go", "");
    let line = follow.read_line();
    assert!(line.contains("mute") && line.ends_with("here"), "{line}");
    follow.kill();
}

#[test]
fn values_are_plotted_as_text_as_a_picture_and_line_by_line() {
    let system = Draft::default().probe("north", "rate='50Hz'", "").run(Folder::new("plot"));
    system.status("north");
    let field = "north.numbers.count";
    let lines = system.read_json(&["plot", field, "--for", "1s"]);
    let values: Vec<_> = lines.iter().filter_map(|line| line["value"].as_f64()).collect();
    assert!(values.len() > 1 && values.is_sorted() && lines[0]["field"] == "count", "{lines:?}");
    let (code, out, err) = armor(&system, &["plot", field, "--for", "1s"]);
    assert!(
        code == 0 && out.starts_with("north.numbers.count: ") && out.contains(" s"),
        "{out}{err}"
    );
    let (code, out, err) = armor(&system, &["plot", field, "--for", "1s", "--png", "count.png"]);
    assert!(code == 0 && out.contains("values are in count.png"), "{out}{err}");
    let picture = std::fs::read(system.folder.path().join("count.png")).expect("a picture");
    assert!(picture.starts_with(b"\x89PNG"), "{} bytes", picture.len());
    for (arguments, why) in [
        (&["plot", "north.numbers.cuont"][..], "no number at cuont; did you mean count?"),
        (&["plot", "north.nubmers.count"], "did you mean north.numbers?"),
        (&["plot", field, "--png", "count.gif"], ".svg"),
    ] {
        let (code, _, err) = armor(&system, arguments);
        assert!(code == 1 && err.contains(why), "{arguments:?}: {err}");
    }
}

#[test]
fn a_system_that_ends_and_comes_back_is_followed() {
    let mut system = Draft::default()
        .probe("north", "rate='50Hz'", "")
        .run_on_own_port(Folder::new("top-again"));
    let before = system.pid("north");
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["top", "--registry", &registry, "--format", "json"]);
    let top = Dialogue::start(command.args(["--interval", "500ms"]));
    let await_north = |is_it: &dyn Fn(i64) -> bool| loop {
        let look: Value = serde_json::from_str(&top.read_line()).expect("one JSON object per line");
        let rows = look["components"].as_array().cloned().unwrap_or_default();
        let north = rows.iter().find(|row| row["name"] == "north");
        if north.and_then(|row| row["pid"].as_i64()).is_some_and(is_it) {
            break;
        }
    };
    await_north(&|pid| pid == i64::from(before));
    system.run.signal(Signal::KILL);
    system.run.code();
    let next = system.folder.run("next", &["probes.xml", "--registry", &registry]);
    system.run = next;
    await_north(&|pid| pid != i64::from(before));
    top.kill();
}

/// The escape sequences with which a terminal is left: its usual screen, and a visible cursor.
const LEFT: &str = "\u{1b}[?1049l";

#[test]
fn a_terminal_is_left_as_it_was_by_a_key_and_by_a_signal() {
    let system = Draft::default().probe("north", "rate='50Hz'", "").run(Folder::new("top-screen"));
    system.status("north");
    for (number, ends_by_key) in [true, false].into_iter().enumerate() {
        let recorded = system.folder.path().join(format!("screen-{number}"));
        let program = env!("CARGO_BIN_EXE_armor");
        let registry = system.registry;
        let line = format!(
            "stty rows 24 cols 80; echo $$ > pid; exec {program} top --registry {registry}"
        );
        let mut command = std::process::Command::new("script");
        command.args(["-qfec", &line]).arg(&recorded).env("TERM", "xterm");
        command.current_dir(system.folder.path()).stdin(std::process::Stdio::piped());
        let mut child = command.stdout(std::process::Stdio::null()).spawn().expect("script(1)");
        let screen = || {
            let bytes = std::fs::read(&recorded).unwrap_or_default();
            String::from_utf8_lossy(&bytes).into_owned()
        };
        wait_for("the table", || screen().contains("north").then_some(()));
        assert!(!screen().contains(LEFT), "it has not ended yet");
        if ends_by_key {
            let mut input = child.stdin.take().expect("piped");
            std::io::Write::write_all(&mut input, b"q").expect("a reader");
        } else {
            let pid = std::fs::read_to_string(system.folder.path().join("pid")).expect("a file");
            send_signal(pid.trim().parse().expect("a number"), Signal::TERM);
        }
        let status = wait_for("its end", || child.try_wait().expect("it is ours"));
        assert_eq!(status.code(), Some(if ends_by_key { 0 } else { 130 }));
        assert!(screen().contains(LEFT), "{:?}", screen());
    }
}

/// `worker` works, and nothing waits for what `odd` reports.
const UNHEARD: &str = "
<mission name='work' goal='over' safe='hold'>
  <place name='working' initial='true' components='worker'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='worked' from='working' to='over' on='worker.done'/>
  <transition name='late' from='working' to='hold' timeout='1h'/>
</mission>";

#[test]
fn a_report_that_no_transition_waits_for_is_shown_with_its_component() {
    let draft = Draft::default().probe("worker", "rate='20Hz'", "");
    let draft = draft.probe("odd", "rate='20Hz'", "event=1").mission(UNHEARD);
    let system = draft.run(Folder::new("unheard"));
    let shown = "1 report that no transition waits for";
    let row = wait_for("the report in ps", || {
        let rows = system.shown(&["ps"]);
        rows.lines().find(|row| row.contains(shown)).map(str::to_owned)
    });
    assert!(row.starts_with("odd "), "{row}");
    let graph = system.shown(&["graph"]);
    assert!(graph.contains(&format!("odd: {shown}")), "{graph}");
    let mission = system.shown(&["mission", "show"]);
    assert!(mission.contains("1 that no transition waits for (odd 1)"), "{mission}");
    let json = system.read_json(&["ps", "odd"]);
    assert_eq!(json[0]["unheard_reports"], 1, "{json:?}");
}
