//! Several writers of one element, in processes of their own: by priority, over their deaths, and of one
//! type.

use std::collections::BTreeMap;
use std::os::unix::fs::symlink;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use armor_sdk::control::{Answer, ControlConnection, ControlEvent, ReportKind, Role};
use armor_sdk::directory::Directory;
use armor_sdk::tap::{Tap, TapData};
use armor_wire::keep::Keep;

use crate::fixture::{DEADLINE, Folder, run_to_end, wait_for};
use crate::resilience::system::{Draft, System, probe};

/// A board by priority. Its timeout is far longer than any pause of a busy machine.
const BOARD: &str = "<component name='board' kind='board' rate='50Hz'>
  <parameter name='timeout' value='1.5s'/>
</component>";

/// The links of two writers to the board, and of its element to `sink`, which lose nothing.
const LINKS: &str = "<link from='high.numbers' to='board.writers' keep='all'/>
<link from='low.numbers' to='board.writers' keep='all'/>
<link from='board.element' to='sink.a' keep='all'/>";

/// Two writers that stay dead when they are killed, with messages of different lengths.
fn writers() -> Draft {
    Draft::default()
        .component(BOARD)
        .probe("high", "rate='50Hz' restart='never'", "bulk=40000")
        .probe("low", "rate='50Hz' restart='never'", "bulk=20")
        .probe("sink", "", "")
}

/// Everything that is published under a name, from every process that publishes it.
fn listen(system: &System, data: &'static str) -> Arc<Mutex<Vec<TapData>>> {
    let heard: Arc<Mutex<Vec<TapData>>> = Arc::default();
    let (list, address) = (Arc::downgrade(&heard), system.registry.to_string());
    std::thread::spawn(move || {
        let directory = Directory::observer(&address, "listener");
        while list.strong_count() > 0 {
            let keep = Keep::Last { count: 1000 };
            let opened = Tap::open(&directory, data, keep, Duration::from_secs(1));
            let Ok(mut tap) = opened else { continue };
            while let Ok(next) = tap.next(Duration::from_millis(100)) {
                let Some(list) = list.upgrade() else { return };
                list.lock().expect("no panic").extend(next);
            }
        }
    });
    heard
}

/// The events of a component from now on.
fn events(system: &System, name: &str) -> (ControlConnection, Receiver<(String, f64)>) {
    let (sender, events) = channel();
    let sink = move |event| {
        if let ControlEvent::Answer(Answer::Report { outcome, .. }) = event
            && let ReportKind::Event { name, value } = outcome
        {
            let _ = sender.send((name, value));
        }
    };
    let entry = system.entry(name);
    let connection = ControlConnection::connect(&entry, Role::Observer, "test", sink);
    (connection.expect("it answers"), events)
}

fn wait_for_event(events: &Receiver<(String, f64)>, name: &str, value: f64) {
    loop {
        let event = events.recv_timeout(DEADLINE).unwrap_or_else(|_| panic!("no {name} {value}"));
        if event == (name.to_owned(), value) {
            return;
        }
    }
}

fn holder(system: &System) -> String {
    let shown = system.read_json(&["echo", "--once", "board.holder"]);
    shown.first().map(|it| it["value"]["data"].to_string()).unwrap_or_default()
}

fn is_held_by(system: &System, name: &str) {
    wait_for(&format!("{name} as the holder"), || (holder(system) == name).then_some(()));
}

fn published(system: &System) -> u64 {
    let outputs = system.status("board").outputs;
    outputs.into_iter().find(|it| it.id == "element").expect("it is declared").published
}

/// Checks that each message of the element is one that a writer has sent, to the byte and with its
/// stamp. Returns how many were found of each writer; a tap sees nothing before it is linked.
fn compare(element: &[TapData], writers: [&[TapData]; 2]) -> [usize; 2] {
    let mut sent: BTreeMap<&[u8], Vec<(usize, u64)>> = BTreeMap::new();
    for (writer, messages) in writers.iter().enumerate() {
        for message in *messages {
            let stamp = message.header.stamp_s.to_bits();
            sent.entry(&message.payload).or_default().push((writer, stamp));
        }
    }
    let mut found = [0; 2];
    for message in element {
        // A writer that was restarted counts from 0 again, so the same bytes may have two stamps.
        let Some(same) = sent.get(message.payload.as_slice()) else { continue };
        let stamp = message.header.stamp_s.to_bits();
        let origin = same.iter().find(|(_, sent)| *sent == stamp);
        let (writer, _) = origin.unwrap_or_else(|| panic!("another stamp: {:?}", message.header));
        found[*writer] += 1;
    }
    found
}

#[test]
fn the_lower_writer_takes_over_when_the_higher_is_killed_and_gives_way_when_it_returns() {
    let system = writers().links(LINKS).run(Folder::new("board"));
    let [element, high, low] =
        ["board.element", "high.numbers", "low.numbers"].map(|data| listen(&system, data));
    let (_connection, events) = events(&system, "board");
    is_held_by(&system, "\"high.numbers\"");
    let count = |data: &Mutex<Vec<TapData>>| data.lock().expect("no panic").len();
    wait_for("messages of both", || (count(&high) > 60 && count(&low) > 60).then_some(()));

    system.kill("high");
    wait_for_event(&events, "changed", 2.0);
    is_held_by(&system, "\"low.numbers\"");
    let before = count(&element);
    wait_for("messages of the lower one", || (count(&element) > before + 60).then_some(()));

    system.shown(&["restart", "high"]);
    wait_for_event(&events, "changed", 1.0);
    is_held_by(&system, "\"high.numbers\"");
    let before = count(&element);
    wait_for("messages of the higher one", || (count(&element) > before + 60).then_some(()));
    let age = system.read_json(&["echo", "--once", "board.age"]);
    assert!(age[0]["value"]["age"].as_f64().is_some_and(|age| age < 60.0), "{age:?}");

    for writer in ["high", "low"] {
        system.kill(writer);
    }
    wait_for_event(&events, "lost", 1.0);
    is_held_by(&system, "\"\"");
    let found = {
        let lists = [&element, &high, &low].map(|list| list.lock().expect("no panic").clone());
        compare(&lists[0], [&lists[1], &lists[2]])
    };
    println!("of the element, found at high and low: {found:?}");
    assert!(found.iter().all(|found| *found > 30), "{found:?}");

    // With keep="all" every message of the element has arrived since the sink was linked, and none twice.
    let outputs = system.status("board").outputs;
    let output = outputs.iter().find(|it| it.id == "element").expect("it is declared");
    let link = output.links.iter().find(|it| it.to == "sink").expect("it is linked");
    assert!(link.keep.is_all() && link.dropped == 0, "{link:?}");
    let got = system.traced("sink", "all of the element", |trace| {
        let got = trace.got("a");
        (got.len() as u64 == link.sent).then_some(got)
    });
    assert!(got.iter().all(|got| got.lost == 0), "{got:?}");
}

#[test]
fn a_board_that_is_killed_learns_its_type_again() {
    let system = writers().links(LINKS).run(Folder::new("board-killed"));
    let got = |system: &System| system.trace("sink").got("a").len();
    wait_for("the element", || (got(&system) > 10).then_some(()));
    let listed = system.read_json(&["data", "list"]);
    let typed = |data: &str| {
        let found = listed.iter().find(|it| it["data"] == data);
        found.unwrap_or_else(|| panic!("no {data} in {listed:?}"))["type"].clone()
    };
    assert_eq!(
        (typed("board.element"), typed("board.latest")),
        ("Numbered".into(), "Numbered".into())
    );
    let links = system.read_json(&["graph"]);
    assert!(links.iter().any(|it| it["from"] == "board.element" && it["type"] == "Numbered"));
    system.replace("board");
    let before = got(&system);
    wait_for("the element again", || (got(&system) > before + 10).then_some(()));
    is_held_by(&system, "\"high.numbers\"");
}

/// Writes the kind `liar`, whose manifest promises the probe's numbers, and which publishes the progress
/// of a worker instead: what `armor check` cannot know.
fn add_liar(folder: &Folder) {
    let described = run_to_end(std::process::Command::new(probe()).arg("--describe")).1;
    let mut manifest: serde_json::Value = serde_json::from_str(&described).expect("a manifest");
    manifest["kind"] = "liar".into();
    manifest["outputs"][0]["id"] = "progress".into();
    for list in ["inputs", "parameters"] {
        manifest[list] = serde_json::json!([]);
    }
    std::fs::create_dir_all(folder.path().join("hidden")).expect("writable");
    symlink(probe(), folder.path().join("hidden/worker")).expect("a link to the probe");
    let worker = folder.path().join("hidden/worker");
    let script = format!(
        "#!/bin/sh\nif [ \"$1\" = --describe ]; then echo '{manifest}'; exit; fi\nexec {} \"$@\"\n",
        worker.display()
    );
    folder.executable("components/liar", &script);
}

#[test]
fn a_third_writer_of_another_type_is_refused_by_the_check_and_by_the_board() {
    let folder = Folder::new("board-types");
    add_liar(&folder);
    let third = "<link from='third.progress' to='board.writers'/>";
    let draft = writers().component("<component name='third' kind='liar' rate='10Hz'/>");
    let system = draft.links(&format!("{LINKS}{third}")).run(folder);
    let problem = wait_for("the refusal", || {
        let inputs = system.answer("board")?.inputs;
        let refused = inputs.into_iter().find(|it| it.problem.contains("linked first"))?;
        Some(refused.problem)
    });
    for part in ["third.progress", "Progress", "Numbered"] {
        assert!(problem.contains(part), "{problem}");
    }
    assert!(problem.contains("high.numbers") || problem.contains("low.numbers"), "{problem}");

    // The same link from a kind that states its type.
    let text = std::fs::read_to_string(system.folder.path().join("probes.xml")).expect("readable");
    let text =
        text.replace("kind='liar'", "kind='camera'").replace("third.progress", "third.image");
    system.folder.write("honest.xml", &text);
    let (code, _, shown) = run_to_end(&mut system.folder.armor(&["check", "honest.xml"]));
    let expected =
        "error[E0150]: board.writers has the type Numbered of high.numbers, and third.image";
    assert!(code == 1 && shown.contains(expected), "{shown}");
}

#[test]
fn the_robot_of_the_page_about_blackboards_is_valid() {
    let page = include_str!("../docs/blackboard.md");
    let example = page.split("```xml\n").nth(1).and_then(|rest| rest.split("```").next());
    let folder = Folder::new("board-page");
    folder.write("robot.xml", example.expect("the page has an example"));
    let worlds = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/worlds");
    symlink(worlds, folder.path().join("worlds")).expect("a link to the worlds");
    let (code, out, shown) = run_to_end(&mut folder.armor(&["check", "--strict", "robot.xml"]));
    assert_eq!(code, 0, "{out}{shown}");
}

#[test]
fn the_links_behind_a_board_are_up_before_a_writer_is_activated() {
    let mission = "<mission name='late' goal='over' safe='hold'>
  <place name='idle' initial='true'/>
  <place name='driving' components='high low'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='go' from='idle' to='driving' operator='true'/>
  <transition name='held' from='driving' to='over' on='board.changed'/>
  <transition name='late' from='driving' to='hold' timeout='50s'/>
</mission>";
    let system = writers().links(LINKS).mission(mission).run(Folder::new("board-late"));
    // Nothing is published yet: the types are known from the links alone.
    wait_for("the sink's link", || {
        let inputs = system.answer("sink")?.inputs;
        inputs.iter().any(|it| it.id == "a" && it.connected).then_some(())
    });
    assert_eq!(published(&system), 0);
    system.run.wait_for_log("idle", 1);
    assert!(!system.run.log().contains("begins although"), "{}", system.run.log());
    wait_for("the order to go", || {
        system.shown(&["mission", "fire", "go"]).contains("go").then_some(())
    });
    let first = system.traced("sink", "the element", |trace| trace.got("a").first().cloned());
    assert_eq!((first.count, first.lost), (0, 0), "the first message of a writer is not missed");
}
