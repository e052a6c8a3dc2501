//! Sub-missions: read and checked with the mission that they are part of.

use std::path::Path;

use armor_robotfile::{check, read};

/// The codes found in `robot.xml` of these files.
fn codes_of(files: &[(&str, &str)]) -> Vec<String> {
    let reading = read(Path::new("robot.xml"), &mut |path| {
        let found = files.iter().find(|(name, _)| path == Path::new(name));
        found.map(|(_, text)| text.as_bytes().to_vec()).ok_or(std::io::ErrorKind::NotFound.into())
    });
    let reading = check(reading, &[], None);
    reading.findings.iter().map(ToString::to_string).collect()
}

#[test]
fn sub_missions_are_read_and_checked_with_the_mission() {
    let robot = r#"<armor version="1"><system><component name="go" kind="k"/></system><mission safe="a"><place name="a" initial="true"/>
        <submission ref="sub/dock.xml" in="a" out="a"/><submission ref="./sub/dock.xml"/></mission></armor>"#;
    let dock = |inner: &str| {
        format!(
            r#"<armor version="1"><mission system="../robot.xml"><place name="x" initial="true" components="go"/>{inner}</mission></armor>"#
        )
    };
    let found = |dock: &str| codes_of(&[("robot.xml", robot), ("sub/dock.xml", dock)]);
    assert_eq!(found(&dock("")), Vec::<String>::new());
    let only = |dock: &str, code: &str, place: &str| {
        let found = found(dock);
        assert!(
            found.len() == 1 && found[0].contains(code) && found[0].contains(place),
            "{found:?}"
        );
    };
    only(&dock(r#"<transition name="t" from="y"/>"#), "E0203", "sub/dock.xml:1:");
    only(&dock(r#"<submission ref="dock.xml"/>"#), "E0024", "sub/dock.xml:1:");
    only(&dock(r#"<submission ref="../robot.xml"/>"#), "E0024", "sub/dock.xml:1:");
    only(&dock("").replace("../robot", "../other"), "E0025", "sub/dock.xml:1:");
    only(r#"<armor version="1"><system/></armor>"#, "E0023", "robot.xml:2:");
    only(
        &dock("").replace(" system=\"../robot.xml\"", "").replace("<mission", "<system/><mission"),
        "E0025",
        "robot.xml:2:",
    );
    assert_eq!(codes_of(&[("robot.xml", robot)]).len(), 1, "a file is asked for once");
}

#[test]
fn a_place_that_is_not_reached_is_found_also_next_to_a_sub_mission() {
    let robot = r#"<armor version="1"><system><component name="go" kind="k"/><component name="arm" kind="k"/></system>
        <mission goal="over" safe="hold"><place name="a" initial="true"/><place name="b"/>
        <place name="over"/><place name="hold"/><place name="lift" components="arm"/>
        <submission ref="dock.xml" in="a" out="b"/>
        <transition name="t" from="b" to="over" timeout="1s"/></mission></armor>"#;
    let dock = r#"<armor version="1"><mission goal="y" safe="z"><place name="x" initial="true" components="go"/><place name="y"/>
        <place name="z"/><transition name="t" from="x" to="y" on="go.done"/></mission></armor>"#;
    let found = codes_of(&[("robot.xml", robot), ("dock.xml", dock)]);
    let [only] = &found[..] else { panic!("{found:?}") };
    assert!(only.contains("W0212") && only.contains("lift, so arm is never active"), "{only}");
    let lifted = r#"<transition name="u" from="lift" to="over" on="arm.done"/></mission>"#;
    let reached = robot.replace("from=\"b\" to=\"over\"", "from=\"b\" to=\"lift\"");
    let reached = reached.replace("</mission>", lifted);
    assert_eq!(codes_of(&[("robot.xml", &reached), ("dock.xml", dock)]), [""; 0]);
    // A sub-mission without a goal is never left, and so `b` is not reached.
    let endless = dock.replace("goal=\"y\" ", "");
    let found = codes_of(&[("robot.xml", &reached), ("dock.xml", &endless)]);
    assert!(found.iter().any(|one| one.contains("W0260") && one.contains("dock.xml")), "{found:?}");
}

#[test]
fn a_report_of_a_component_that_only_a_sub_mission_activates_is_found() {
    let robot = r#"<armor version="1"><system><component name="go" kind="k"/></system>
        <mission goal="over" safe="hold"><place name="a" initial="true"/><place name="b"/>
        <place name="over"/><place name="hold"/><submission ref="dock.xml" in="a" out="b"/>
        <transition name="t" from="b" to="over" on="go.done"/></mission></armor>"#;
    let dock = r#"<armor version="1"><mission goal="y" safe="z"><place name="x" initial="true" components="go"/><place name="y"/>
        <place name="z"/><transition name="t" from="x" to="y" on="go.done"/></mission></armor>"#;
    let found = codes_of(&[("robot.xml", robot), ("dock.xml", dock)]);
    let of_robot = found.iter().any(|one| one.contains("W0214") && one.contains("robot.xml:4:"));
    assert!(of_robot, "{found:?}");
}

#[test]
fn a_missing_system_file_is_one_finding() {
    let robot = r#"<armor version="1"><mission system="gone.xml" goal="over" safe="hold"><place name="a" initial="true"/>
        <place name="over"/><place name="hold"/><submission ref="dock.xml" in="a" out="over"/></mission></armor>"#;
    let dock = r#"<armor version="1"><mission system="rover.xml" goal="y" safe="z"><place name="x" initial="true"/><place name="y"/>
        <place name="z"/><transition name="t" from="x" to="y" timeout="1s"/></mission></armor>"#;
    let found = codes_of(&[("robot.xml", robot), ("dock.xml", dock)]);
    assert!(found.len() == 1 && found[0].contains("E0023"), "{found:?}");
}

#[test]
fn the_period_is_that_of_the_mission_that_is_played() {
    let robot = r#"<armor version="1"><system><component name="go" kind="k"/></system>
        <mission goal="over" safe="hold" period="1.5s"><place name="a" initial="true"/><place name="b"/>
        <place name="over"/><place name="hold"/><submission ref="dock.xml" in="a" out="b"/>
        <transition name="t" from="b" to="over" timeout="2s"/></mission></armor>"#;
    let dock = r#"<armor version="1"><mission goal="y" safe="z"><place name="x" initial="true" components="go"/><place name="y"/>
        <place name="z"/><transition name="t" from="x" to="y" timeout="1s"/></mission></armor>"#;
    let found = codes_of(&[("robot.xml", robot), ("dock.xml", dock)]);
    let [only] = &found[..] else { panic!("{found:?}") };
    assert!(only.contains("W0220") && only.starts_with("dock.xml"), "{only}");
    let robot = robot.replace(" period=\"1.5s\"", "");
    let slow = dock.replace("safe=\"z\"", "safe=\"z\" period=\"30s\"");
    assert_eq!(codes_of(&[("robot.xml", &robot), ("dock.xml", &slow)]), [""; 0]);
}

#[test]
fn a_guarded_transition_next_to_the_entrance_of_a_sub_mission() {
    let robot = |more: &str| {
        format!(
            r#"<armor version="1"><system><component name="go" kind="k"/></system>
        <mission goal="over" safe="hold"><variable name="n" min="0" max="1"/><place name="a" initial="true"/><place name="b"/>
        <place name="over"/><place name="hold"/>
        <transition name="skip" from="a" to="b" when="n == 1" {more}/>
        <submission ref="dock.xml" in="a" out="b"/>
        <transition name="t" from="b" to="over" timeout="1s"><set variable="n" value="1"/></transition></mission></armor>"#
        )
    };
    let dock = r#"<armor version="1"><mission goal="y" safe="z"><place name="x" initial="true" components="go"/><place name="y"/>
        <place name="z"/><transition name="t" from="x" to="y" on="go.done"/></mission></armor>"#;
    let found = |more: &str| codes_of(&[("robot.xml", &robot(more)), ("dock.xml", dock)]);
    let [only] = &found("")[..] else { panic!("{:?}", found("")) };
    assert!(only.contains("W0218") && only.contains("begins as soon as a is marked"), "{only}");
    assert_eq!(found(r#"priority="1""#), Vec::<String>::new());
}
