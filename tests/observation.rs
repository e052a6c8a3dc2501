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

#[test]
fn an_output_is_described_and_ports_are_found() {
    let draft = Draft::default().probe("north", "rate='50Hz'", "bulk=10").probe("watcher", "", "");
    let draft = draft.link("north", "watcher.a", "1000");
    let system = draft.run(Folder::new("described"));
    let info = wait_for("the link", || {
        let info = system.read_json(&["data", "info", "north.numbers"]).pop()?;
        (info["links"].as_array()?.len() == 1 && info["last"].is_object()).then_some(info)
    });
    assert_eq!((&info["type"], &info["latched"]), (&Value::from("Numbered"), &Value::from(false)));
    assert_eq!(info["fields"][0]["path"], Value::from("count"), "{info}");
    assert_eq!(info["provider"]["component"], Value::from("north"), "{info}");
    let link = &info["links"][0];
    assert_eq!((&link["to"], &link["keep"]), (&"watcher.a".into(), &"1000".into()), "{info}");
    // A count and a length of eight bytes each, and the bulk.
    assert_eq!(info["last"]["bytes"], Value::from(26), "{info}");
    assert!(info["last"]["age_s"].is_f64(), "{info}");
    let (code, out, err) = armor(&system, &["data", "info", "north.numbers"]);
    assert_eq!(code, 0, "{err}");
    for part in
        ["north.numbers: Numbered\n", "LINKED TO", "watcher.a", "FIELD", "bulk", "last value"]
    {
        assert!(out.contains(part), "{part}: {out}");
    }
    let (code, _, err) = armor(&system, &["data", "info", "north.nubmers"]);
    assert!(code == 1 && err.contains("did you mean north.numbers?"), "{err}");

    let found = system.read_json(&["data", "find", "numbered"]);
    let ports: Vec<_> = found.iter().filter_map(|it| it["port"].as_str()).collect();
    assert!(ports.contains(&"north.numbers") && ports.contains(&"watcher.a"), "{ports:?}");
    let (code, out, _) = armor(&system, &["data", "find", "bul"]);
    assert!(code == 0 && out.contains("bulk"), "{out}");
    let (code, _, err) = armor(&system, &["data", "find", "velocity"]);
    assert!(code == 1 && err.contains("armor data list"), "{err}");
}

#[test]
fn data_are_published_by_hand_in_the_place_of_a_component_that_is_stopped() {
    let draft = Draft::default().probe("north", "rate='50Hz'", "").probe("watcher", "", "");
    let draft = draft.link("north", "watcher.a", "1000");
    let system = draft.run(Folder::new("published"));
    let publish = |fields: &[&str]| {
        let arguments = [&["data", "pub", "north.numbers"], fields].concat();
        armor(&system, &arguments)
    };
    system.status("watcher");
    let (code, _, err) = publish(&["Numbered", "count=77777"]);
    assert!(code == 1 && err.contains("`armor stop north` makes room"), "{err}");
    let (code, _, err) = armor(&system, &["data", "pub", "north.other", "Numbered"]);
    assert!(code == 1 && err.contains("only north itself can publish north.other"), "{err}");

    assert_eq!(armor(&system, &["stop", "north"]).0, 0);
    wait_for("its end", || system.entries().iter().all(|it| it.name != "north").then_some(()));
    for (fields, why) in [
        (&["Nubmered"][..], "no type is called Nubmered; did you mean Numbered?"),
        (&["Twist"], "watcher.a, which the file links to north.numbers, takes a Numbered"),
        (&["Numbered", "count=-1", "cuont=1"], "cuont: `cuont` is not a field there"),
        (&["Numbered", "count=-1", "cuont=1"], "count: -1 is not a whole number from 0 to"),
    ] {
        let (code, _, err) = publish(fields);
        assert!(code == 1 && err.contains(why), "{fields:?}: {err}");
    }
    let (code, out, err) = publish(&["Numbered", "count=77777", "bulk=AQID"]);
    assert!(code == 0 && out.contains("watcher.a: received"), "{out}{err}");
    system.traced("watcher", "it", |trace| {
        trace.got("a").iter().any(|got| got.count == 77777).then_some(())
    });
    let (code, out, err) = publish(&["Numbered", "--rate", "50", "-n", "5", "--format", "json"]);
    let result: Value = serde_json::from_str(&out).expect("one JSON object");
    assert_eq!((code, &result["published"]), (0, &Value::from(5)), "{out}{err}");
    assert_eq!(result["inputs"][0]["outcome"], Value::from("received"), "{out}");
    // Nothing is in the way of the component.
    let (code, out, err) = armor(&system, &["restart", "north"]);
    assert_eq!(code, 0, "{out}{err}");

    let (code, out, err) = armor(&system, &["data", "pub", "test.goal", "Twist", "linear.x=1"]);
    assert!(code == 1 && err.contains("nothing is linked to test.goal"), "{out}{err}");
}
