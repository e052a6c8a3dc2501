//! Recordings of a running system, made and read with the program as a user does.

use std::path::Path;
use std::process::{Command, Stdio};

use armor_recording::{RecordedMessage, Recording};
use rustix::process::Signal;
use serde_json::Value;

use crate::fixture::{Folder, run_to_end, send_signal, wait_for};
use crate::resilience::system::{Draft, System};

/// `north` and `south` send numbers at 50 Hz.
fn two_probes(name: &str) -> System {
    let draft =
        Draft::default().probe("north", "rate='50Hz'", "").probe("south", "rate='50Hz'", "");
    draft.run(Folder::new(name))
}

fn read(path: &Path) -> Vec<RecordedMessage> {
    let mut recording = Recording::open(path).expect("a recording");
    std::iter::from_fn(|| recording.next_message().expect("whole")).collect()
}

fn bag(folder: &Folder, arguments: &[&str]) -> (i32, String, String) {
    let arguments: Vec<_> = [&["bag"], arguments].concat();
    run_to_end(&mut folder.armor(&arguments))
}

fn start_recorder(system: &System, file: &str) -> std::process::Child {
    let registry = system.registry.to_string();
    let mut command: Command =
        system.folder.armor(&["record", "--registry", &registry, "--output", file]);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts")
}

#[test]
fn every_message_of_a_system_is_recorded_and_what_is_lost_is_counted() {
    let system = two_probes("recorded");
    let report = system.read_json(&["record", "-o", "all.mcap", "--for", "3s"]).remove(0);
    assert_eq!((&report["lost"], &report["end"]), (&0.into(), &"asked".into()), "{report}");
    let path = system.folder.path().join("all.mcap");
    let messages = read(&path);
    assert_eq!(report["messages"], messages.len());
    for data in ["north.numbers", "south.numbers"] {
        let of_it: Vec<_> = messages.iter().filter(|message| message.data == data).collect();
        assert!(of_it.len() > 20, "{data}: {}", of_it.len());
        for pair in of_it.windows(2) {
            assert_eq!(pair[1].head.sequence, pair[0].head.sequence + 1, "without a gap");
            assert!(pair[1].head.stamp_s > pair[0].head.stamp_s && pair[1].payload.is_ok());
        }
    }
    let (code, out, _) = bag(&system.folder, &["info", "all.mcap", "--format", "json"]);
    let info: Value = serde_json::from_str(&out).expect("one object");
    assert_eq!((code, &info["complete"]), (0, &true.into()));
    let north = info["outputs"].as_array().expect("outputs").iter();
    let north = north.into_iter().find(|output| output["data"] == "north.numbers").expect("north");
    let rate_hz = north["rate_hz"].as_f64().expect("a rate");
    assert!(rate_hz > 1.0 && north["lost"] == 0, "{north}");
    assert_eq!(info["files"].as_array().expect("files").len(), 1, "the file of the system");

    let named = ["record", "north.*", "--exclude", "north.x", "-o", "north.mcap", "--for", "1s"];
    system.read_json(&named);
    let only_north = read(&system.folder.path().join("north.mcap"));
    assert!(!only_north.is_empty());
    // What the run leaves is in every recording, unless it is excluded by its name.
    let is_named =
        |it: &RecordedMessage| it.data.starts_with("north.") || it.data.starts_with("armor.");
    assert!(only_north.iter().all(is_named));
    let again = system.read_json(&["record", "-o", "north.mcap", "--for", "1s"]);
    assert!(again.is_empty(), "a recording replaces no file: {again:?}");
}

#[test]
fn a_recorder_that_is_killed_leaves_a_file_that_can_be_read_and_completed() {
    let system = two_probes("killed-recorder");
    for round in 0..5 {
        let file = format!("{round}.mcap");
        let path = system.folder.path().join(&file);
        let mut recorder = start_recorder(&system, &file);
        wait_for("something on the disk", || {
            let recording = Recording::open(&path).ok()?;
            (!recording.summary().outputs.is_empty()).then_some(())
        });
        send_signal(recorder.id() as i32, Signal::KILL);
        recorder.wait().expect("it was killed");
        let messages = read(&path);
        assert!(!Recording::open(&path).expect("it opens").summary().is_complete);
        let copy = format!("{round}-whole.mcap");
        let (code, out, err) = bag(&system.folder, &["recover", &file, &copy]);
        assert_eq!(code, 0, "{err}");
        assert!(out.contains(&format!("{} messages", messages.len())), "{out}");
        let whole = Recording::open(&system.folder.path().join(&copy)).expect("it opens");
        assert!(whole.summary().is_complete);
        assert_eq!(read(&system.folder.path().join(&copy)), messages);
    }
}

#[test]
fn a_recording_ends_in_order_with_its_system_and_can_be_cut_and_merged() {
    let system = two_probes("cut-recording");
    let mut recorder = start_recorder(&system, "all.mcap");
    let path = system.folder.path().join("all.mcap");
    wait_for("some messages", || {
        let recording = Recording::open(&path).ok()?;
        let count: u64 = recording.summary().outputs.iter().map(|it| it.messages).sum();
        (count > 200).then_some(())
    });
    system.shown(&["stop", "--all"]);
    assert_eq!(recorder.wait().expect("it ends").code(), Some(0));
    let all = read(&path);
    let folder = &system.folder;
    let cut = [
        "cut",
        "all.mcap",
        "part.mcap",
        "--from",
        "200ms",
        "--to",
        "1s",
        "--data",
        "south.numbers",
    ];
    let (code, out, err) = bag(folder, &cut);
    assert_eq!(code, 0, "{out}{err}");
    let part = read(&folder.path().join("part.mcap"));
    assert!(!part.is_empty() && part.len() < all.len());
    assert!(part.iter().all(|message| message.data == "south.numbers" && all.contains(message)));
    let (code, _, err) = bag(folder, &["merge", "all.mcap", "part.mcap", "both.mcap"]);
    assert_eq!(code, 0, "{err}");
    let both = read(&folder.path().join("both.mcap"));
    assert_eq!(both.len(), all.len() + part.len());
    let count = |message: &RecordedMessage| both.iter().filter(|it| *it == message).count();
    assert!(part.iter().all(|message| count(message) == 2), "once of each file");

    for (arguments, expected) in [
        (&["info", "none.mcap"][..], "none.mcap cannot be read as a recording"),
        (&["info", "draft.xml"], "cannot be read as a recording"),
        (&["cut", "all.mcap", "x.mcap", "--data", "suoth.numbers"], "did you mean south.numbers?"),
        (&["recover", "all.mcap", "both.mcap"], "both.mcap cannot be created"),
    ] {
        let (code, out, err) = bag(folder, arguments);
        assert!(code == 1 && out.is_empty() && err.contains(expected), "{arguments:?}: {err}");
    }
    assert!(!folder.path().join("x.mcap").exists(), "a refused copy leaves nothing");
}

#[test]
fn recordings_are_converted_for_other_programs_and_from_them() {
    let folder = Folder::new("converted");
    let line = |stamp: u32| format!("FLASER 3 1 2 3 0 0 0 1 {stamp} 0.5 {stamp} h 0\n");
    folder.write("drive.log", &(1..=20).map(line).collect::<String>());
    let (code, out, err) = bag(&folder, &["convert", "drive.log", "drive.mcap"]);
    assert!(code == 0 && out.contains("60 messages"), "{out}{err}");
    let scans = read(&folder.path().join("drive.mcap"));
    let scans: Vec<_> = scans.iter().filter(|message| message.data == "carmen.scan").collect();
    assert_eq!((scans.len(), scans[4].head.stamp_s), (20, 5.0));

    let table = ["convert", "drive.mcap", "odometry.csv", "--data", "carmen.odometry"];
    let (code, out, err) = bag(&folder, &[&table[..], &["--from", "5s"]].concat());
    assert!(code == 0 && out.contains("15 messages"), "{out}{err}");
    let text = std::fs::read_to_string(folder.path().join("odometry.csv")).expect("a table");
    let rows: Vec<_> = text.lines().collect();
    assert!(rows.len() == 16 && rows[0].starts_with("stamp_s,sequence,"), "{text}");
    assert!(rows[1].starts_with("6,5,"), "{}", rows[1]);
    let (code, _, err) = bag(&folder, &["convert", "drive.mcap", "tables", "--to", "csv"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(std::fs::read_dir(folder.path().join("tables")).expect("a folder").count(), 3);

    let (code, _, err) = bag(&folder, &["convert", "drive.mcap", "ros.mcap", "--to", "ros2"]);
    assert_eq!(code, 0, "{err}");
    let (code, out, err) = bag(&folder, &["convert", "ros.mcap", "back.mcap"]);
    assert!(code == 0 && out.contains("60 messages"), "{out}{err}");
    let back = read(&folder.path().join("back.mcap"));
    assert!(back.iter().any(|message| message.data == "carmen.scan" && message.payload.is_ok()));

    // ROS 1 and CARMEN, each there and back: the same scans.
    let scans_of = |file: &str| -> Vec<(f64, Vec<u8>)> {
        let messages = read(&folder.path().join(file));
        let scans = messages.into_iter().filter(|message| message.data.ends_with(".scan"));
        scans.map(|it| (it.head.stamp_s, it.payload.expect("readable"))).collect()
    };
    for (there, back) in [("drive.bag", "bag.mcap"), ("again.log", "log.mcap")] {
        let (code, out, err) = bag(&folder, &["convert", "drive.mcap", there]);
        assert!(code == 0 && err.is_empty(), "{out}{err}");
        let (code, out, err) = bag(&folder, &["convert", there, back]);
        assert!(code == 0 && out.contains("60 messages"), "{there}: {out}{err}");
        assert_eq!(scans_of(back).len(), 20, "{there}");
    }
    assert_eq!(scans_of("bag.mcap"), scans_of("drive.mcap"));
    // A table there and back: the values of the columns, exactly.
    let table = ["--data", "carmen.odometry"];
    let (code, out, err) = bag(
        &folder,
        &[&["convert", "odometry.csv", "table.mcap", "--type", "Odometry"], &table[..]].concat(),
    );
    assert!(code == 0 && out.contains("15 messages"), "{out}{err}");
    let (code, _, err) =
        bag(&folder, &[&["convert", "table.mcap", "again.csv"], &table[..]].concat());
    assert_eq!(code, 0, "{err}");
    let again = std::fs::read_to_string(folder.path().join("again.csv")).expect("a table");
    assert_eq!(again, text);

    // What Armor does not have as a type is named with its reason, and the rest is converted.
    let (code, out, err) =
        bag(&folder, &["convert", "back.mcap", "rows.csv", "--data", "carmen.scan"]);
    assert!(code == 0 && out.contains("20 messages") && err.is_empty(), "{out}{err}");

    folder.write("no.log", "this is no log\n");
    for (arguments, expected) in [
        (&["convert", "no.log", "x.mcap"][..], "is neither an MCAP file nor a log of CARMEN"),
        (&["convert", "none.log", "x.mcap"], "none.log"),
        (&["convert", "drive.log", "x.csv"], "read as a log of CARMEN"),
        (&["convert", "drive.mcap", "x.log", "--data", "carmen.odometry"], "no LaserScan"),
        (&["convert", "drive.bag", "x.csv"], "a bag of ROS 1: that is converted to a recording"),
        (
            &["convert", "odometry.csv", "x.mcap", "--data", "a.b", "--type", "Odometri"],
            "Odometry?",
        ),
        (&["convert", "drive.mcap", "back.mcap"], "back.mcap cannot be created"),
        (&["convert", "drive.mcap", "x.csv", "--data", "carmen.scna"], "did you mean carmen.scan?"),
    ] {
        let (code, out, err) = bag(&folder, arguments);
        assert!(code == 1 && out.is_empty() && err.contains(expected), "{arguments:?}: {err}");
    }
}
