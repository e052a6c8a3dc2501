//! A mapper that is killed while a robot drives home by its map: it continues in the same frame, or
//! the robot stops.

use std::fs::OpenOptions;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use rustix::process::Signal;
use serde_json::Value;

use crate::fixture::{Folder, HomeRobot, Run, run_to_end, send_signal, wait_for};

/// A hall that looks like no other place, longer than the drive takes.
const WORLD: &str = r#"<svg>
  <rect x="0" y="0" width="9" height="0.1"/><rect x="0" y="4" width="9" height="0.1"/>
  <rect x="0" y="0" width="0.1" height="4"/><rect x="8.9" y="0" width="0.1" height="4.1"/>
  <rect x="2" y="0" width="0.6" height="0.8"/><rect x="5.5" y="3.2" width="1" height="0.8"/>
  <circle cx="3.8" cy="3.4" r="0.2"/><circle id="start" cx="1" cy="2"/></svg>"#;

const MISSION: &str = r#"<mission name="homecoming" goal="over" safe="hold">
    <place name="return" initial="true" components="homing driver"/>
    <place name="home"/>
    <place name="over"/>
    <place name="stranded" components="driver"/>
    <place name="hold"/>
    <transition name="arrived" from="return" to="home" on="homing.done"/>
    <transition name="seen" from="home" to="over" operator="true"/>
    <transition name="strange" from="return" to="stranded" on="homing.frame_changed"/>
    <transition name="recalled" from="stranded" to="hold" operator="true"/>
    <transition name="late" from="return" to="hold" timeout="3min"/>
  </mission>"#;

/// Starts the system, and returns when the robot has driven a metre.
fn start(folder: &Folder) -> Run {
    folder.write("hall.svg", WORLD);
    let robot = HomeRobot {
        name: "homecoming",
        frames: r#"<frame name="laser" in="base_link" x="0.08m" z="0.2m"/>"#,
        world: "hall.svg",
        home_x: "6m",
    };
    let file = folder.write("homecoming.xml", &robot.file(MISSION));
    let run = folder.run("out", &[file.to_str().expect("a path"), "--headless"]);
    wait_for(&format!("a metre of driving\n{}", run.log()), || {
        (position_m(folder, "mapper.pose")?[0] > 1.0).then_some(())
    });
    run
}

fn newest(folder: &Folder, output: &str) -> Option<Value> {
    let (code, out, _) =
        run_to_end(&mut folder.armor(&["echo", output, "-n", "1", "--format", "json"]));
    let message = (code == 0).then(|| serde_json::from_str::<Value>(&out).ok()).flatten()?;
    Some(message["value"].clone())
}

/// Returns where an output has the robot.
fn position_m(folder: &Folder, output: &str) -> Option<[f64; 2]> {
    let value = newest(folder, output)?;
    let position = &value["pose"]["pose"]["position"];
    Some([position["x"].as_f64()?, position["y"].as_f64()?])
}

/// Returns whether a place of the mission is marked.
fn is_marked(folder: &Folder, place: &str) -> bool {
    let (_, shown, _) = run_to_end(&mut folder.armor(&["mission", "show"]));
    shown.lines().any(|line| line.starts_with("marked") && line.ends_with(place))
}

fn kill_mapper(folder: &Folder) {
    let pid = wait_for("the mapper", || {
        let (_, out, _) = run_to_end(&mut folder.armor(&["ps", "--format", "json"]));
        let entries = out.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        entries.filter(|entry| entry["name"] == "mapper").find_map(|entry| entry["pid"].as_i64())
    });
    send_signal(i32::try_from(pid).expect("a process"), Signal::KILL);
}

#[test]
fn the_robot_comes_home_by_the_map_of_a_killed_mapper() {
    let folder = Folder::new("mapper-killed");
    let run = start(&folder);
    kill_mapper(&folder);
    run.wait_for_log("the robot was recognised on the map of before", 1);
    let frame = wait_for("a pose", || newest(&folder, "mapper.pose"))["frame"].clone();
    assert_eq!(frame, "map", "{}", run.log());
    wait_for("the mission to see it home", || is_marked(&folder, "home").then_some(()));
    let place_m = position_m(&folder, "simulator.truth").expect("the truth");
    // The truth begins at the start, as the map does; home is 6 m ahead.
    let left_m = (place_m[0] - 6.0).hypot(place_m[1]);
    assert!(left_m < 0.35, "{place_m:?}\n{}", run.log());
}

#[test]
fn without_its_map_the_frame_is_another_and_no_goal_of_before_is_driven_to() {
    check_loss_of_state("mapper-damaged", "it is damaged at byte", |state| {
        let mut file = OpenOptions::new().write(true).open(state).expect("a state");
        file.seek(SeekFrom::Start(100)).and_then(|_| file.write_all(b"damage")).expect("a write");
    });
    check_loss_of_state("mapper-removed", "its state is not kept, or is gone", |state| {
        std::fs::remove_file(state).expect("a state");
    });
}

fn check_loss_of_state(name: &str, reason: &str, lose_state: impl FnOnce(&Path)) {
    let folder = Folder::new(name);
    let run = start(&folder);
    lose_state(&run.out().join("states/mapper.state"));
    kill_mapper(&folder);
    run.wait_for_log(&format!("the map of before is not continued: {reason}"), 1);
    let frame = wait_for("a pose", || newest(&folder, "mapper.pose"))["frame"].clone();
    assert!(frame.as_str().is_some_and(|frame| frame.starts_with("map#")), "{frame}");
    let moved = wait_for("odom in the map", || newest(&folder, "mapper.transforms"));
    let moved = &moved["transforms"][0];
    assert_eq!((&moved["parent"], &moved["child"]), (&frame, &"odom".into()), "of the new epoch");
    wait_for("the mission to react", || is_marked(&folder, "stranded").then_some(()));
    // The driver is still active: it stands because there is no path that it may follow.
    let before_m = wait_for("the robot to stand", || {
        let velocity = newest(&folder, "driver.velocity")?;
        let is_still = velocity["linear"]["x"] == 0.0 && velocity["angular"]["z"] == 0.0;
        is_still.then(|| position_m(&folder, "simulator.truth")).flatten()
    });
    assert!(before_m[0] < 5.5, "it stopped on its way: {before_m:?}");
    // Some scans later it is where it was.
    (0..5).for_each(|_| drop(newest(&folder, "simulator.scan")));
    let after_m = position_m(&folder, "simulator.truth").expect("the truth");
    let moved_m = (after_m[0] - before_m[0]).hypot(after_m[1] - before_m[1]);
    assert!(moved_m < 0.05, "{before_m:?} {after_m:?}\n{}", run.log());
}
