//! Two robots in one world: one simulator for each, which send their poses to each other.

use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::Value;

use crate::fixture::{Folder, run_to_end, wait_for};

/// A room in which two robots face each other at a distance of 2 m.
const WORLD: &str = r#"<svg><rect x="-3" y="-3" width="6" height="6"/>
    <circle id="start" cx="-1" cy="0.5"/>
    <circle class="start" id="blue" cx="1" cy="0.5" data-heading="180"/></svg>"#;

/// All components follow the clock of `red`, which runs at twice real time.
const SYSTEM: &str = r#"<armor version="1">
  <system name="robots">
    <clock source="red.clock"/>
    <frame name="laser" in="base_link" x="0.08m"/>
    <component name="red" kind="simulator" rate="50Hz">
      <parameter name="world" value="room.svg"/>
      <parameter name="speed" value="2"/>
    </component>
    <component name="blue" kind="simulator" rate="50Hz">
      <parameter name="world" value="room.svg"/>
      <parameter name="start" value="blue"/>
    </component>
    <link from="red.presence" to="blue.other1"/>
    <link from="blue.presence" to="red.other1"/>
  </system>
</armor>"#;

/// Returns the newest message of an output.
fn newest(folder: &Folder, output: &str) -> Option<Value> {
    let (code, out, _) =
        run_to_end(&mut folder.armor(&["echo", output, "-n", "1", "--format", "json"]));
    (code == 0).then(|| serde_json::from_str::<Value>(&out).ok()).flatten()
}

#[test]
fn two_robots_see_each_other_in_one_time() {
    let folder = Folder::new("robots");
    folder.write("room.svg", WORLD);
    let file = folder.write("robots.xml", SYSTEM);
    let run = folder.run("out", &[file.to_str().expect("a path"), "--headless"]);
    for robot in ["red", "blue"] {
        let ahead_m = wait_for(&format!("a scan of {robot}\n{}", run.log()), || {
            let scan = newest(&folder, &format!("{robot}.scan"))?;
            let ahead_m = scan["value"]["ranges"][135].as_f64()?;
            // Before the other robot has published its pose, the scan shows the wall, 4 m away.
            (ahead_m < 3.0).then_some(ahead_m)
        });
        // 2 m, less the radius of the other robot and the offset of the robot's own laser.
        assert!((ahead_m - (2.0 - 0.18 - 0.08)).abs() < 0.07, "{robot} sees it at {ahead_m} m");
    }
    // If blue used its own clock, its stamps would not run ahead of the host's clock.
    wait_for("blue's time to run ahead as red's does", || {
        let stamp_s = newest(&folder, "blue.truth")?["value"]["stamp"].as_f64()?;
        let host_s = SystemTime::now().duration_since(UNIX_EPOCH).ok()?.as_secs_f64();
        (stamp_s > host_s + 1.0).then_some(())
    });
}
