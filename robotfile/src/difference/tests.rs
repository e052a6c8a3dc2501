use std::path::Path;

use super::*;
use crate::read;

const FILE: &str = r#"<armor version="1">
  <system name="rover">
    <component name="laser" kind="simulator" rate="20Hz"/>
    <component name="slam" kind="mapper">
      <parameter name="particles" value="30"/>
    </component>
    <component name="view" kind="view"/>
    <link from="laser.scan" to="slam.scan" keep="10"/>
    <link from="slam.map" to="view.map"/>
  </system>
  <mission goal="end">
    <place name="map" initial="true" components="slam"/>
    <place name="end"/>
    <exclusive components="slam view"/>
    <transition name="done" from="map" to="end" on="slam.done"/>
    <transition name="late" from="map" to="end" timeout="90s"/>
  </mission>
</armor>"#;

fn configuration(text: &str) -> Configuration {
    let reading = read(Path::new("a.xml"), &mut |path| match path == Path::new("a.xml") {
        true => Ok(text.into()),
        false => Ok("<armor version='1'><mission goal='g'/></armor>".into()),
    });
    reading.configuration.unwrap_or_else(|| panic!("{:?}", reading.findings))
}

/// Applies edits (an old and a new text each) and compares the listed differences with `expected`.
fn check(edits: &[(&str, &str)], expected: &[&str]) {
    let mut changed = FILE.to_owned();
    for (old, new) in edits {
        assert!(changed.contains(old), "{old}");
        changed = changed.replace(old, new);
    }
    let found = differences(&configuration(FILE), &configuration(&changed));
    let found: Vec<_> = found.iter().map(ToString::to_string).collect();
    assert_eq!(found, expected);
}

#[test]
fn a_submission_that_is_included_twice_has_not_changed() {
    let twice = FILE.replace(
        "  </mission>",
        r#"<submission ref="dock.xml" in="map" out="end"/><submission ref="dock.xml" in="end" out="map"/></mission>"#,
    );
    let read = |text: &str| configuration(&text.replace("dock.xml", "./dock.xml"));
    assert!(differences(&read(&twice), &read(&twice)).is_empty());
    let moved = twice.replace(r#"in="end" out="map""#, r#"in="end" out="late""#);
    let found = differences(&read(&twice), &read(&moved));
    let found: Vec<_> = found.iter().map(ToString::to_string).collect();
    assert_eq!(found, ["submission ./dock.xml (2): out map → late"]);
}

#[test]
fn changes_are_described_in_words() {
    check(&[("value=\"30\"", "value=\"50\"")], &["parameter slam.particles: 30 → 50"]);
    check(&[("value=\"30\"", "value=\"\"")], &["parameter slam.particles: 30 → \"\""]);
    check(
        &[("name=\"particles\"", "name=\"seed\"")],
        &["parameter slam.particles removed; it was 30", "parameter slam.seed added: 30"],
    );
    check(&[("rate=\"20Hz\"", "rate=\"5Hz\"")], &["component laser: rate 20Hz → 5Hz"]);
    check(&[(" rate=\"20Hz\"", "")], &["component laser: rate 20Hz → (none)"]);
    check(&[(" keep=\"10\"", "")], &["link laser.scan -> slam.scan: keep 10 → (none)"]);
    check(&[("timeout=\"90s\"", "timeout=\"2min\"")], &["transition late: time 90s → 2min"]);
    check(&[("goal=\"end\"", "goal=\"map\"")], &["mission: goal end → map"]);
    check(
        &[("components=\"slam\"", "components=\"slam view\"")],
        &["place map: components slam → slam view"],
    );
    check(&[("slam.done", "slam.over")], &["transition done: on slam.done → slam.over"]);
}

#[test]
fn a_removed_component_includes_its_parameters() {
    let block = "<component name=\"slam\" kind=\"mapper\">\n      <parameter name=\"particles\" value=\"30\"/>\n    </component>";
    let found = differences(&configuration(FILE), &configuration(&FILE.replace(block, "")));
    assert_eq!(found[0].to_string(), "component slam removed; it was kind mapper");
    assert_eq!(found.len(), 1, "{found:?}");
    let back = differences(&configuration(&FILE.replace(block, "")), &configuration(FILE));
    assert_eq!(back[0].to_string(), "component slam added: kind mapper");
}

#[test]
fn an_added_link_is_described_without_its_defaults() {
    let without = FILE.replace("<link from=\"slam.map\" to=\"view.map\"/>", "");
    let found = differences(&configuration(&without), &configuration(FILE));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].to_string(), "link slam.map -> view.map added");
    check(
        &[(" keep=\"10\"", " keep=\"10\" transport=\"tcp\"")],
        &["link laser.scan -> slam.scan: transport (none) → tcp"],
    );
}

#[test]
fn equal_meaning_is_no_difference() {
    check(&[("<system", "<!-- new -->\n\n<system")], &[]);
    check(&[("timeout=\"90s\"", "timeout=\"1.5min\"")], &[]);
    check(&[("exclusive components=\"slam view\"", "exclusive components=\"view slam\"")], &[]);
    check(&[(" keep=\"10\"", " keep=\"10\" wake=\"sleep\"")], &[]);
}

#[test]
fn the_order_of_transitions_counts() {
    let late = "<transition name=\"late\" from=\"map\" to=\"end\" timeout=\"90s\"/>";
    let first = "<transition name=\"done\"";
    check(
        &[(late, ""), (first, &format!("{late}{first}"))],
        &["mission: order of transitions done late → late done"],
    );
}

#[test]
fn a_whole_mission_can_be_added() {
    let start = FILE.find("<mission").unwrap();
    let end = FILE.find("</armor>").unwrap();
    let without = format!("{}{}", &FILE[..start], &FILE[end..]);
    let found = differences(&configuration(&without), &configuration(FILE));
    let found: Vec<_> = found.iter().map(ToString::to_string).collect();
    assert_eq!(found[0], "mission added: goal end");
    assert!(found.contains(&"exclusive slam view added".to_owned()), "{found:?}");
    assert!(
        found.contains(&"transition late added: from map, to end, time 90s".to_owned()),
        "{found:?}"
    );
}
