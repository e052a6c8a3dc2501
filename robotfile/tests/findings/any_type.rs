//! Components that pass on messages of any type: what comes out has the type of what goes in.

use armor_robotfile::{Colours, Manifests, TypedManifests};
use armor_wire::manifest::Manifest;

use super::{reading, system};

/// Those of the examples, of which `board` takes any type.
fn manifests() -> Manifests {
    let manifests: Vec<Manifest> =
        serde_json::from_str(include_str!("../example_kinds.json")).unwrap();
    manifests.into_iter().map(|it| (it.kind.clone(), it)).collect()
}

const COMPONENTS: &str = r#"<component name="front" kind="laser"/><component name="rear" kind="laser"/><component name="battery" kind="battery"/><component name="board" kind="board" rate="20Hz"/><component name="second" kind="board" rate="20Hz"/><component name="mapper" kind="mapper"/><component name="viewer" kind="viewer"/><component name="cartographer" kind="cartographer"/>"#;
/// What a mapper, a viewer and a second board need.
const OTHERS: &str = r#"<link from="rear.scan" to="cartographer.scan"/><link from="cartographer.map" to="viewer.map"/><link from="battery.state" to="second.writers"/>"#;

fn file(links: &str) -> String {
    system(&format!("{COMPONENTS}{OTHERS}{links}"))
}

/// The file has one finding that is not a note, of this code and at its mark.
fn only(code: &str, file: &str) {
    let (reading, mark) = reading(file, Some(&manifests()));
    let problems = reading.findings.without_notes();
    let shown = problems.render(Colours::No);
    let found = problems
        .iter()
        .map(|it| (it.code.as_str(), it.at.as_ref().map_or(0, |at| at.span.start())));
    assert_eq!(found.collect::<Vec<_>>(), [(code, mark)], "{file}\n{shown}");
}

fn errors(file: &str) -> String {
    let (reading, _) = reading(file, Some(&manifests()));
    let findings = reading.findings.render(Colours::No);
    if reading.is_valid() { String::new() } else { findings }
}

#[test]
fn all_writers_have_the_type_of_the_first_one() {
    let fine = r#"<link from="front.scan" to="board.writers"/><link from="rear.scan" to="board.writers"/><link from="board.element" to="mapper.scan"/>"#;
    assert_eq!(errors(&file(fine)), "");
    let third = format!(r#"{fine}<link from="[[battery.state]]" to="board.writers"/>"#);
    only("E0150", &file(&third));
    // Also where the first one is wrong: its subscriber has the type of the others.
    let wrong_first = r#"<link from="battery.state" to="board.writers"/><link from="[[front.scan]]" to="board.writers"/><link from="board.element" to="mapper.scan"/>"#;
    only("E0150", &file(wrong_first));
}

#[test]
fn a_first_writer_that_differs_from_all_others_is_one_finding() {
    let wrong = r#"<link from="[[battery.state]]" to="board.writers"/><link from="front.scan" to="board.writers"/><link from="rear.scan" to="board.writers"/><link from="board.element" to="mapper.scan"/>"#;
    only("E0150", &file(wrong));
    let (reading, _) = reading(&file(wrong), Some(&manifests()));
    let shown = reading.findings.render(Colours::No);
    let wanted = "battery.state gives board.writers the type Battery, and all other writers, front and \
                  rear, publish Scan";
    assert!(shown.contains(wanted), "{shown}");
}

#[test]
fn only_what_is_passed_on_has_the_type_of_the_writers() {
    let mut manifests = manifests();
    let mut holder = manifests["battery"].outputs[0].clone();
    holder.id = "holder".into();
    manifests.get_mut("board").unwrap().outputs.push(holder);
    let links = r#"<link from="front.scan" to="board.writers"/><link from="board.holder" to="mapper.scan"/>"#;
    let (reading, _) = reading(&file(links), Some(&manifests));
    let shown = reading.findings.without_notes().render(Colours::No);
    assert!(shown.contains("error[E0108]") && shown.ends_with("1 error\n"), "{shown}");
}

#[test]
fn two_versions_of_a_type_are_distinguished_by_their_fields() {
    let mut manifests = manifests();
    let mut other = manifests["laser"].clone();
    other.kind = "sonar".into();
    other.outputs[0].schema = "Scan{ranges:[f64]}".into();
    other.outputs[0].schema_hash = 7;
    manifests.insert("sonar".into(), other);
    let file = file(
        r#"<component name="sonar" kind="sonar"/><link from="front.scan" to="board.writers"/><link from="sonar.scan" to="board.writers"/><link from="board.element" to="mapper.scan"/>"#,
    );
    let (reading, _) = reading(&file, Some(&manifests));
    let shown = reading.findings.render(Colours::No);
    let expected = "sonar.scan and front.scan use the name Scan for different messages";
    assert!(shown.contains(expected) && shown.contains("ranges"), "{shown}");
}

#[test]
fn a_subscriber_is_checked_against_what_goes_in() {
    let wrong = r#"<link from="battery.state" to="board.writers"/><link from="board.element" to="[[mapper.scan]]"/>"#;
    only("E0108", &file(wrong));
    let plain = file(wrong).replace("[[", "").replace("]]", "");
    let shown = errors(&plain);
    for part in [
        "board.element cannot feed mapper.scan: it publishes Battery, and mapper.scan takes Scan",
        "it passes on what comes from here",
    ] {
        assert!(shown.contains(part), "{part} is not in {shown}");
    }
}

#[test]
fn a_type_passes_through_several_components_whatever_the_order_of_the_links() {
    let chain = |links: &str| {
        system(&format!(
            r#"{COMPONENTS}<link from="rear.scan" to="cartographer.scan"/><link from="cartographer.map" to="viewer.map"/>{links}"#
        ))
    };
    let good = chain(
        r#"<link from="second.element" to="mapper.scan"/><link from="board.element" to="second.writers"/><link from="front.scan" to="board.writers"/>"#,
    );
    let (valid, _) = reading(&good, Some(&manifests()));
    assert!(valid.is_valid(), "{}", valid.findings.render(Colours::No));
    let configuration = valid.configuration.expect("it is valid");
    let manifests = manifests();
    let typed = TypedManifests::of(&configuration.system, &manifests);
    for board in ["board", "second"] {
        let kind = typed.find(board).expect("a known kind");
        let types = kind.inputs.iter().chain(&kind.outputs).map(|port| port.type_name.as_str());
        assert!(types.eq(["Scan", "Scan"]), "{kind:?}");
    }
    assert!(manifests["board"].outputs[0].is_any(), "the kind itself has no type");
    let bad = good.replace("front.scan", "battery.state");
    assert!(errors(&bad).contains("second.element cannot feed mapper.scan: it publishes Battery"));
    // In a circle there is no type, and nothing to compare.
    let circle = chain(
        r#"<link from="second.element" to="board.writers"/><link from="board.element" to="second.writers"/><link from="second.element" to="mapper.scan"/>"#,
    );
    assert_eq!(errors(&circle), "");
}

#[test]
fn what_only_follows_from_a_missing_writer_is_no_finding() {
    let unfed = system(
        &format!(r#"{COMPONENTS}{OTHERS}<link from="board.element" to="mapper.scan"/>"#)
            .replace(r#"name="board""#, r#"name="[[board]]""#),
    );
    only("E0109", &unfed);
    assert!(errors(&unfed.replace("[[", "").replace("]]", "")).contains("an output of any type"));
    let unknown = file(
        r#"<component name="odd" kind="[[oddity]]"/><link from="odd.out" to="board.writers"/><link from="board.element" to="mapper.scan"/>"#,
    );
    only("E0105", &unknown);
}

#[test]
fn a_guard_reads_the_fields_of_what_is_passed_on() {
    let mission = |guard: &str| {
        format!(
            r#"<armor version="1"><system><component name="battery" kind="battery"/><component name="board" kind="board" rate="20Hz"/><link from="battery.state" to="board.writers"/></system>
            <mission goal="home" safe="hold"><place name="out" initial="true" components="board"/><place name="home"/><place name="hold"/>
            <transition name="low" from="out" to="home" when="{guard}"/><transition name="late" from="out" to="hold" timeout="9s"/></mission></armor>"#
        )
    };
    assert_eq!(errors(&mission("board.element.voltage &lt; 11V")), "");
    only("E0232", &mission("board.element.[[volts]] &lt; 11V"));
}

#[test]
fn one_frozen_source_of_several_does_not_starve_the_input() {
    let mission = |second: &str| {
        format!(
            r#"<armor version="1"><system><component name="front" kind="laser"/>{second}<component name="mapper" kind="scan-mapper"/><link from="front.scan" to="mapper.scans"/></system>
            <mission goal="home" safe="hold"><place name="out" initial="true" components="front mapper"/><place name="on" components="[[mapper]]"/><place name="home"/><place name="hold"/>
            <transition name="go" from="out" to="on" timeout="5s"/><transition name="end" from="on" to="home" on="mapper.done"/><transition name="late" from="on" to="hold" timeout="9s"/></mission></armor>"#
        )
    };
    only("W0270", &mission(""));
    let both = mission(
        r#"<component name="rear" kind="laser"/><link from="rear.scan" to="mapper.scans"/>"#,
    );
    let (reading, _) = reading(&both, Some(&manifests()));
    let problems = reading.findings.without_notes();
    assert!(problems.is_empty(), "{}", problems.render(Colours::No));
}

#[test]
fn a_link_from_a_writer_past_the_board_is_found() {
    let links = |from: &str| {
        system(&format!(
            r#"{COMPONENTS}{OTHERS}<link from="front.scan" to="board.writers"/><link from="[[{from}]]" to="mapper.scan"/>"#
        ))
    };
    let plain = |from: &str| links(from).replace("[[", "").replace("]]", "");
    assert_eq!(errors(&plain("board.element")), "");
    only("W0135", &links("front.scan"));
    let (reading, _) = reading(&plain("front.scan"), Some(&manifests()));
    let text = reading.findings.render(Colours::No);
    assert!(text.contains(r#"did you mean from="board.element"?"#), "{text}");
}
