//! Points of the map are moved while a simulated robot drives to them: the file changes, and with it the
//! leg that is coming, or the one that is driven.

use std::path::Path;

use armor_executive::journal;
use armor_executive::{Cause, JournalEntry, JournalRecord};

use crate::fixture::{Folder, Run, wait_for};

/// The drawn mission at the speed of the host, with two legs: along the corridor, slowly, and back to the
/// door and into the studio.
fn drawing() -> String {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    let text = std::fs::read_to_string(missions.join("drawn.xml")).expect("missions/drawn.xml");
    let world = missions.join("worlds/office.svg");
    let text = text.replace("worlds/office.svg", world.to_str().expect("UTF-8"));
    let text = text.replace(r#"name="speed" value="5""#, r#"name="speed" value="1""#);
    let text = text.replace(
        r#"<leg name="l1" to="corridor-end" speed="0.9m/s" by="1min"/>"#,
        r#"<leg name="l1" to="corridor-end" speed="0.4m/s" by="1min"/>"#,
    );
    let (head, rest) = text.split_once(r#"<stay name="s1""#).expect("the stay");
    let (_, tail) = rest.split_once(r#"<otherwise on="#).expect("the exits");
    format!(r#"{head}<otherwise on={tail}"#)
}

/// Replaces the file, as most editors do: by a second one that is renamed.
fn save(folder: &Folder, text: &str) {
    let temporary = folder.write("drawn.new", text);
    std::fs::rename(temporary, folder.path().join("drawn.xml")).expect("renamed");
}

fn records(run: &Run) -> Vec<JournalRecord> {
    let path = run.out().join("executive.journal");
    journal::read(&path).map(|journal| journal.records).unwrap_or_default()
}

/// Waits for a record.
fn awaited<T>(run: &Run, what: &str, find: impl Fn(&JournalEntry) -> Option<T>) -> T {
    wait_for(&format!("{what}; the log:\n{}", run.log()), || {
        records(run).iter().find_map(|record| find(&record.entry))
    })
}

/// Waits until a version is played; returns the components that it starts again.
fn played(run: &Run, number: u64) -> Vec<String> {
    awaited(run, &format!("version {number}"), |entry| match entry {
        JournalEntry::Changed { version, restarts, .. } if version.number == number => {
            Some(restarts.clone())
        }
        _ => None,
    })
}

/// Waits until the robot is sent to a point.
fn sent_to(run: &Run, point: &str) {
    awaited(run, &format!("the way to {point}"), |entry| match entry {
        JournalEntry::Activating { component, values, .. } if component == "way" => {
            values.iter().any(|value| value.text == point).then_some(())
        }
        _ => None,
    });
}

/// The positions where the robot truly was.
fn read_truth(run: &Run) -> Vec<[f64; 2]> {
    let text = std::fs::read_to_string(run.out().join("truth.csv")).expect("truth.csv");
    let row = |line: &str| {
        let mut numbers = line.split(',').skip(2).map(|it| it.parse().expect("a number"));
        [numbers.next().expect("x"), numbers.next().expect("y")]
    };
    text.lines().skip(1).map(row).collect()
}

// Slow (about half a minute): two legs at the speed of the host.
#[test]
fn points_that_are_dragged_while_a_robot_drives_are_driven_to() {
    let folder = Folder::new("dragged");
    let drawn = drawing();
    save(&folder, &drawn);
    let file = folder.path().join("drawn.xml");
    let mut run = folder.run("out", &[file.to_str().expect("UTF-8"), "--headless"]);
    sent_to(&run, "6,0");

    // The point of the coming leg: no component is disturbed.
    let coming = drawn.replace(r#"at="2.15 -3""#, r#"at="2.15 -2.5""#);
    assert_ne!(coming, drawn);
    save(&folder, &coming);
    assert_eq!(played(&run, 2), [] as [&str; 0]);

    // The point of this leg into the kitchen, which no robot enters: the file is refused with the reason.
    save(&folder, &coming.replace(r#"at="6 0""#, r#"at="-3 -3""#));
    run.wait_for_log("the last good one, stays in force", 1);
    run.wait_for_log("E0304", 1);
    assert!(run.log().contains("kitchen"), "{}", run.log());

    // The point of this leg: only its mover is started again, and the robot drives to the new point.
    let current = coming.replace(r#"at="6 0""#, r#"at="4.4 0""#);
    save(&folder, &current);
    assert_eq!(played(&run, 3), ["way"]);
    sent_to(&run, "4.4,0");

    assert_eq!(run.code(), Some(0), "{}", run.log());
    let sent = records(&run).into_iter().filter_map(|record| match record.entry {
        JournalEntry::Activating { component, values, .. } if component == "way" => {
            Some(values.iter().map(|value| value.text.clone()).collect::<Vec<_>>().join(" "))
        }
        _ => None,
    });
    assert_eq!(sent.collect::<Vec<_>>(), ["6,0", "4.4,0", "2.15,0", "2.15,-2.5"]);
    let fired = records(&run).into_iter().filter_map(|record| match record.entry {
        JournalEntry::Took { cause: Cause::Transition(name), .. } => Some(name),
        _ => None,
    });
    assert_eq!(fired.collect::<Vec<_>>(), ["red.l1.done", "red.l2.done", "red.l3.done"]);
    let driven = read_truth(&run);
    let furthest_m = driven.iter().map(|at| at[0]).fold(0.0, f64::max);
    let deepest_m = driven.iter().map(|at| at[1]).fold(0.0, f64::min);
    println!("dragged: {furthest_m:.2} m along the corridor, {deepest_m:.2} m into the studio");
    assert!((3.9..5.5).contains(&furthest_m), "{furthest_m:.2} m along the corridor");
    assert!((-2.75..-2.1).contains(&deepest_m), "{deepest_m:.2} m into the studio");
}
