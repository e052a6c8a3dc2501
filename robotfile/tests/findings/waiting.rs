//! A component that the mission activates or waits for, and that cannot do what is expected of it.

use armor_robotfile::Manifests;
use armor_wire::manifest::{Manifest, PortManifest};

use super::{one_with, reading};

fn port(id: &str, properties: &str) -> String {
    format!(
        r#"{{"id":"{id}","type":"S","schema":"S{{}}","schema_hash":"0000000000000001"{properties}}}"#
    )
}

/// A guide that requires a pose, wheels that take a way, and a base that may take a speed.
fn manifests(pose: &str) -> Manifests {
    let required = r#","required":true"#;
    let kind = |kind: &str, input: String, output: String| -> (String, Manifest) {
        let text = format!(
            r#"{{"armor_manifest":1,"kind":"{kind}","summary":"","inputs":[{input}],"outputs":[{output}],"parameters":[]}}"#
        );
        (kind.to_owned(), serde_json::from_str(&text).unwrap())
    };
    Manifests::from([
        kind("guide", port("pose", required), port("goal", "")),
        kind("wheels", port("goal", required), port("speed", "")),
        kind("base", port("speed", ""), port("pose", pose)),
    ])
}

const LOOP: &str = r#"<link from="guide.goal" to="wheels.goal"/><link from="wheels.speed" to="base.speed"/><link from="base.pose" to="guide.pose"/>"#;

/// A mission that goes out and back; each place activates some components.
fn mission(links: &str, out: &str, back: &str, on: &str) -> String {
    format!(
        r#"<armor version="1"><system><component name="guide" kind="guide"/><component name="wheels" kind="wheels" rate="10Hz"/><component name="base" kind="base" rate="10Hz"/>{links}</system>
        <mission goal="home" safe="hold"><place name="out" initial="true" components="{out}"/><place name="back" components="{back}"/><place name="home"/><place name="hold"/>
        <transition name="there" from="out" to="back" timeout="5s"/><transition name="here" from="back" to="home" {on}/>
        <transition name="late" from="back" to="hold" timeout="9s"/></mission></armor>"#
    )
}

const DONE: &str = r#"on="guide.done""#;

fn has_no_finding(file: &str, manifests: &Manifests) {
    let (reading, _) = reading(file, Some(manifests));
    let problems = reading.findings.without_notes();
    assert!(problems.is_empty(), "{file}\n{}", problems.render(armor_robotfile::Colours::No));
}

#[test]
fn a_loop_is_interrupted_where_none_of_its_places_activates_all_of_it() {
    let all = manifests("");
    let broken = mission(LOOP, "wheels", "[[guide]]", DONE)
        .replace(r#"to="wheels.goal"/>"#, r#"to="wheels.goal" mode="pull"/>"#);
    one_with("W0269", &broken, Some(&all));
    has_no_finding(&mission(LOOP, "wheels", "guide wheels", DONE), &all);
    // Where it is whole, what was prepared may be carried out.
    let whole_first = mission(LOOP, "guide wheels", "guide", DONE);
    has_no_finding(&whole_first, &all);
    // Not if it reports there that it is done with the same.
    let same =
        r#"to="back" on="guide.done"/><transition name="slow" from="out" to="hold" timeout="5s"/>"#;
    let same = whole_first.replace(r#"to="back" timeout="5s"/>"#, same);
    one_with(
        "W0269",
        &same.replace(r#"name="back" components="guide""#, r#"name="back" components="[[guide]]""#),
        Some(&all),
    );
    // Nothing waits for its report.
    has_no_finding(&broken.replace("[[guide]]", "guide").replace(DONE, r#"operator="true""#), &all);
}

#[test]
fn what_a_component_requires_comes_from_a_frozen_one() {
    let starved = mission(LOOP, "guide wheels base", "[[guide]] wheels", DONE);
    one_with("W0270", &starved, Some(&manifests("")));
    let starved = starved.replace("[[guide]]", "guide");
    has_no_finding(&starved, &manifests(r#","latched":true"#));
    has_no_finding(&starved.replace(DONE, r#"operator="true""#), &manifests(""));
    // The base is active and gives the pose; what it passes on comes from the frozen wheels.
    let required = manifests("").into_iter().map(|(name, mut manifest)| {
        manifest.inputs.iter_mut().for_each(|input| input.required = true);
        manifest.outputs.retain(|output| output.id != "goal");
        (name, manifest)
    });
    let required: Manifests = required.collect();
    let through = mission(LOOP, "wheels", "[[guide]]", DONE)
        .replace(r#"<link from="guide.goal" to="wheels.goal"/>"#, "")
        .replace(r#"kind="wheels" rate="10Hz""#, r#"kind="source""#);
    let source = r#"{"armor_manifest":1,"kind":"source","summary":"","inputs":[],"outputs":[{"id":"speed","type":"S","schema":"S{}","schema_hash":"0000000000000001"}],"parameters":[]}"#;
    let source: Manifest = serde_json::from_str(source).unwrap();
    let kinds: Manifests = required.into_iter().chain([("source".to_owned(), source)]).collect();
    let by_data = through.replace(r#"kind="base" rate="10Hz""#, r#"kind="base""#);
    one_with("W0270", &by_data, Some(&kinds));
    // With a rate of its own it gives the pose also without a new speed.
    has_no_finding(&through.replace("[[guide]]", "guide"), &kinds);
    has_no_finding(&mission(LOOP, "guide wheels", "guide wheels", DONE), &manifests(""));
}

#[test]
fn the_work_of_an_active_component_is_unused_if_an_input_waits_for_it() {
    let links = LOOP.replace(r#"<link from="wheels.speed" to="base.speed"/>"#, "");
    let unused = mission(&links, "guide wheels", "guide wheels", DONE)
        .replace(r#"name="wheels""#, r#"name="[[wheels]]""#);
    one_with("W0135", &unused, Some(&manifests("")));
    // A link to the component itself is no use of its output.
    let own = links.clone() + r#"<link from="wheels.speed" to="wheels.stop"/>"#;
    let to_itself = mission(&own, "guide wheels", "guide wheels", DONE)
        .replace(r#"name="wheels""#, r#"name="[[wheels]]""#);
    let with_stop = manifests("").into_iter().map(|(name, mut manifest)| {
        let goal = manifest.inputs.iter().find(|input| input.id == "goal").cloned();
        let stop = |goal| PortManifest { id: "stop".into(), required: false, ..goal };
        manifest.inputs.extend(goal.map(stop));
        (name, manifest)
    });
    let with_stop: Manifests = with_stop.collect();
    one_with("W0135", &to_itself, Some(&with_stop));
    // A component in no place may be there to be looked at.
    has_no_finding(&mission(&links, "guide", "guide", DONE), &manifests(""));
    // No other input takes its data.
    let without_base = manifests("").into_iter().map(|(name, mut manifest)| {
        manifest.inputs.retain(|input| input.id != "speed");
        (name, manifest)
    });
    let file = unused.replace("[[wheels]]", "wheels");
    has_no_finding(&file, &without_base.collect());
}

#[test]
fn a_component_that_one_place_activates_by_mistake_is_named() {
    let file = |first: &str, second: &str, third: &str| {
        let places = [("out", first), ("back", second), ("on", third)];
        let places = places.map(|(name, components)| {
            let initial = if name == "out" { r#" initial="true""# } else { "" };
            format!(r#"<place name="{name}"{initial} components="{components}"/>"#)
        });
        format!(
            r#"<armor version="1"><system><component name="guide" kind="guide" rate="10Hz"/><component name="wheels" kind="wheels" rate="10Hz"/><component name="base" kind="base" rate="10Hz"/>{LOOP}</system>
            <mission goal="home" safe="hold">{}<place name="home"/><place name="hold"/>
            <transition name="there" from="out" to="back" on="guide.done"/><transition name="here" from="back" to="on" on="guide.done"/><transition name="end" from="on" to="home" on="guide.done"/>
            <transition name="slow" from="out" to="hold" timeout="9s"/><transition name="late" from="back" to="hold" timeout="9s"/><transition name="lost" from="on" to="hold" timeout="9s"/></mission></armor>"#,
            places.concat()
        )
        .replace(r#"to="wheels.goal"/>"#, r#"to="wheels.goal" mode="pull"/>"#)
        .replace(r#"to="guide.pose"/>"#, r#"to="guide.pose" mode="pull"/>"#)
    };
    let all = manifests("");
    has_no_finding(&file("guide", "guide", "guide"), &all);
    let wrong = file("guide", "guide", "guide [[wheels]]");
    one_with("W0269", &wrong, Some(&all));
    let (reading, _) = reading(&wrong, Some(&all));
    let shown = reading.findings.render(armor_robotfile::Colours::No);
    assert!(shown.contains("take wheels out of on, the only place that activates it"), "{shown}");
    has_no_finding(&file("guide wheels", "guide wheels", "guide wheels"), &all);
}

#[test]
fn a_component_that_is_forgotten_in_the_place_marked_at_the_start() {
    let all = manifests("");
    let file = |out: &str, links: &str| {
        let rest = r#"<place name="rest"/><transition name="tired" from="out" to="rest" operator="true"/><transition name="go-on" from="rest" to="out" timeout="5s"/></mission>"#;
        mission(links, out, "guide wheels", DONE)
            .replace(r#"<place name="back" components="guide wheels"/>"#, "")
            .replace(
                r#"from="out" to="back" timeout="5s"/>"#,
                r#"from="out" to="home" on="[[guide]].done"/>"#,
            )
            .replace(r#"<transition name="here" from="back" to="home" on="guide.done"/>"#, "")
            .replace(r#"from="back" to="hold""#, r#"from="out" to="hold""#)
            .replace("</mission>", rest)
    };
    one_with("W0274", &file("wheels", LOOP), Some(&all));
    let plain = |out: &str, links: &str| file(out, links).replace("[[", "").replace("]]", "");
    has_no_finding(&plain("guide wheels", LOOP), &all);
    // One that needs nothing that the mission freezes works all the time.
    let alone = LOOP.replace(
        r#"<link from="guide.goal" to="wheels.goal"/>"#,
        r#"<link from="base.pose" to="wheels.goal"/>"#,
    );
    let (reading, _) = reading(&plain("wheels", &alone), Some(&all));
    assert!(reading.findings.iter().all(|it| it.code.as_str() != "W0274"));
}
