//! Two robots that meet: the example mission, and a variant in which one never comes.

use std::path::Path;

use crate::fixture::{Folder, run_to_end};

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("in the workspace").join("missions")
}

/// Returns the position in the log of each of `lines`, in the order of `lines`.
fn places(log: &str, lines: &[&str]) -> Vec<usize> {
    let find = |line: &&str| log.find(*line).unwrap_or_else(|| panic!("{line} in\n{log}"));
    lines.iter().map(find).collect()
}

// Slow (about a minute): both robots drive to the meeting point and back in real time.
#[test]
fn two_robots_wait_for_each_other_and_go_home() {
    let folder_of_run = Folder::new("meeting");
    let file = folder().join("meeting.xml").display().to_string();
    let arguments = ["run", &file, "--headless", "--out", "meeting"];
    let (code, log, _) = run_to_end(&mut folder_of_run.armor(&arguments));
    assert_eq!(code, 0, "{log}");
    let met = places(&log, &["met: red-waits blue-waits -> together"])[0];
    let before = ["red-there: red-out -> red-waits", "blue-there: blue-out -> blue-waits"];
    assert!(places(&log, &before).iter().all(|at| *at < met), "{log}");
    let after = ["part: together -> red-return blue-return", "end: red-home blue-home -> over"];
    assert!(places(&log, &after).iter().all(|at| *at > met), "{log}");
}

// Slow (about half a minute): one robot drives to the meeting point and back in real time.
#[test]
fn a_robot_that_never_comes_does_not_keep_the_other() {
    let folder_of_run = Folder::new("no-meeting");
    let text = std::fs::read_to_string(folder().join("meeting.xml")).expect("the example");
    let mut changed = text.replace("worlds/", &format!("{}/worlds/", folder().display()));
    // Blue turns back immediately; red waits only briefly.
    for (name, is, becomes) in [("blue-late", "3min", "1s"), ("red-alone", "90s", "1s")] {
        let at = changed.find(&format!("name=\"{name}\"")).expect("a transition");
        let (before, after) = changed.split_at(at);
        assert!(after.contains(is), "{name} has its timeout");
        changed = format!("{before}{}", after.replacen(is, becomes, 1));
    }
    folder_of_run.write("meeting.xml", &changed);
    let arguments = ["run", "meeting.xml", "--headless", "--out", "meeting"];
    let (code, log, _) = run_to_end(&mut folder_of_run.armor(&arguments));
    assert_eq!(code, 0, "{log}");
    places(&log, &["blue-late: blue-out -> blue-return", "red-alone: red-waits -> red-return"]);
    assert!(!log.contains("met: "), "{log}");
}
