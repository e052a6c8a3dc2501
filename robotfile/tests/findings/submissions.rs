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
