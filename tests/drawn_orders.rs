//! Orders of an operator to a robot that drives a drawn route, with real processes.

use std::path::Path;

use crate::fixture::{Folder, wait_for};

// Slow (about half a minute): the robot drives to its rally point, and then all of its route.
#[test]
fn a_recalled_robot_waits_at_its_rally_point_and_continues_its_leg() {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    let text = std::fs::read_to_string(missions.join("drawn.xml")).expect("missions/drawn.xml");
    let world = missions.join("worlds/office.svg");
    // A busy host takes its time for the orders.
    let text = text
        .replace("worlds/office.svg", world.to_str().expect("UTF-8"))
        .replace(r#"patience="1min""#, r#"patience="30min""#)
        .replace(r#"rally-by="1min""#, r#"rally-by="30min""#)
        .replace(r#"by="1min"/>"#, r#"by="30min"/>"#);
    let folder = Folder::new("drawn-orders");
    let file = folder.write("drawn.xml", &text).display().to_string();
    let mut run = folder.run("out", &[&file, "--headless"]);
    let registry = run.registry().to_string();
    let fire = |transition: &str| {
        let arguments = ["mission", "fire", transition, "--registry", &registry];
        wait_for(&format!("the order {transition}"), || {
            let fired = folder.armor(&arguments).output().expect("armor mission fire");
            fired.status.success().then_some(())
        });
    };
    fire("red.l1.recall");
    run.wait_for_log("red.l1.to-R1.done: red.l1.to-R1 -> red.l1.at-R1", 1);
    fire("red.l1.at-R1.resume");
    assert_eq!(run.code(), Some(0), "{}", run.log());
    let log = run.log();
    let mut rest = log.as_str();
    for fired in [
        "red.l1.recall: red.l1 -> red.l1.to-R1",
        "red.l1.at-R1.resume: red.l1.at-R1 -> red.l1",
        "red.l1.done: red.l1 -> red.l2",
        "red.l5.done: red.l5 -> over",
    ] {
        rest = rest.split_once(fired).unwrap_or_else(|| panic!("{fired}: {log}")).1;
    }
}
