//! Running systems are found by the files of their launchers.

use std::fs;
use std::path::{Path, PathBuf};

use armor_inspect::systems::{RunFile, RunRecord, list_running};

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).expect("a folder for the test");
    path
}

fn record(system: &str, pid: u32) -> RunRecord {
    RunRecord {
        system: system.into(),
        file_names: vec![],
        pid,
        registry: ([127, 0, 0, 1], 7411).into(),
        started_s: f64::from(pid),
        file: "office.xml".into(),
        place: None,
        out: "out/office".into(),
    }
}

#[test]
fn a_system_is_found_while_its_launcher_lives() {
    let folder = folder("run-files");
    let first = RunFile::write(&folder, &record("rover", 1)).expect("written");
    let second = RunFile::write(&folder, &record("rover", 2)).expect("written");
    let list = || list_running(&folder).expect("readable");
    assert_eq!(list(), [record("rover", 1), record("rover", 2)]);
    drop(first);
    assert_eq!(list(), [record("rover", 2)]);
    drop(second);
    assert_eq!(list(), []);
}

#[test]
fn files_of_ended_systems_are_removed() {
    let folder = folder("stale-run-files");
    let path = folder.join("rover-9.json");
    let text = serde_json::to_string(&record("rover", 9)).expect("serialises");
    fs::write(&path, text).expect("writable");
    assert_eq!(list_running(&folder).expect("readable"), []);
    assert!(!path.exists());
}
