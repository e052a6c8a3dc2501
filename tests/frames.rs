//! Frames of a running system: a component has the mounts that the file gives, a change reaches it,
//! and a file without a frame that it needs is refused while the last good one stays.

use serde_json::Value;

use crate::fixture::{Folder, HomeRobot, run_to_end, wait_for};

const ROOM: &str = r#"<svg><rect x="-4" y="-4" width="8" height="0.1"/><circle id="start"/></svg>"#;

/// A robot with the laser at `x` of its mast.
fn system(x: &str) -> String {
    let frames = format!(
        r#"<frame name="laser" in="mast" x="{x}"/><frame name="mast" in="base_link" z="0.2m"/>"#
    );
    HomeRobot { name: "mounts", frames: &frames, world: "room.svg", home_x: "0m" }.file("")
}

/// The value that configd gives a parameter of the driver.
fn value(folder: &Folder, parameter: &str) -> Option<String> {
    let (code, out, _) = run_to_end(&mut folder.armor(&["param", "get", parameter]));
    (code == 0).then(|| out.trim().to_owned())
}

fn state(folder: &Folder) -> Option<Value> {
    let echo = ["echo", "configuration.state", "-n", "1", "--format", "json"];
    let (code, out, _) = run_to_end(&mut folder.armor(&echo));
    let mut message: Value = serde_json::from_str(out.trim()).ok().filter(|_| code == 0)?;
    Some(message["value"].take())
}

/// The transform that the simulator has published last.
fn moved(folder: &Folder) -> Option<Value> {
    let echo = ["echo", "simulator.transforms", "-n", "1", "--format", "json"];
    let (code, out, _) = run_to_end(&mut folder.armor(&echo));
    let message: Value = serde_json::from_str(out.trim()).ok().filter(|_| code == 0)?;
    Some(message["value"]["transforms"][0].clone())
}

#[test]
fn a_mount_is_written_once_changes_live_and_is_never_missing() {
    let folder = Folder::new("frames");
    folder.write("room.svg", ROOM);
    let save = |text: &str| folder.write("mounts.xml", text);
    let file = save(&system("0.08m"));
    let run = folder.run("out", &[file.to_str().expect("a path")]);
    let placed = |x: &str| format!("laser,mast,{x},0,0,0,0,0 mast,base_link,0,0,0.2,0,0,0");
    for name in ["driver.frames", "mapper.frames", "simulator.frames"] {
        let given = wait_for("the value", || value(&folder, name));
        assert_eq!(given, placed("0.08"), "{name}\n{}", run.log());
    }
    let moved = wait_for("the robot's base in odom", || moved(&folder));
    assert_eq!((&moved["parent"], &moved["child"]), (&"odom".into(), &"base_link".into()));

    save(&system("12cm"));
    wait_for("the new mount", || {
        (value(&folder, "driver.frames")? == placed("0.12")).then_some(())
    });
    let (_, diff, _) = run_to_end(&mut folder.armor(&["param", "diff"]));
    assert!(diff.contains("frame laser: x 0.08m → 0.12m"), "{diff}");
    assert!(diff.contains("reaches driver immediately"), "{diff}");
    assert!(diff.contains("takes effect when simulator is started again"), "{diff}");

    let lost = system("12cm").replace("<frame name=\"laser\"", "<frame name=\"lidar\"");
    save(&lost);
    let refused =
        wait_for("the file is refused", || state(&folder).filter(|state| state["refused"] == true));
    assert_eq!(refused["findings"][0]["code"], "E0146", "{refused}");
    assert_eq!(value(&folder, "driver.frames"), Some(placed("0.12")), "the last good one stays");
    let given = ["param", "set", "driver.frames", "laser,base_link,0,0,0,0,0,0"];
    save(&system("12cm"));
    wait_for("the file is good again", || state(&folder).filter(|it| it["refused"] == false));
    let (code, _, err) = run_to_end(&mut folder.armor(&given));
    assert!(code == 1 && err.contains("error[E0112]") && err.contains("<frame"), "{err}");
}
