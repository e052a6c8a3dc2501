//! The commands that observe a running system: what they measure, print and refuse.

use std::path::Path;

use serde_json::Value;

use crate::fixture::{Folder, run_to_end, wait_for};
use crate::resilience::system::{Draft, System};

/// Runs `armor` on a system; returns its exit code, stdout and stderr.
fn armor(system: &System, arguments: &[&str]) -> (i32, String, String) {
    let registry = system.registry.to_string();
    run_to_end(system.folder.armor(arguments).args(["--registry", &registry]))
}

#[test]
fn bytes_and_ages_of_data_are_measured() {
    let draft = Draft::default().probe("north", "rate='50Hz'", "bulk=1000");
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
