//! Systems: components and links, alone and together, and values given over the file.

use std::path::Path;

use armor_robotfile::{Colours, Override, check, read};

use super::{none, one, system};

#[test]
fn systems() {
    one("E0101", &system(r#"<component name="a" kind="k"/><component name="[[a]]" kind="j"/>"#));
    one(
        "E0102",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="1"/><parameter name="[[p]]" value="2"/></component>"#,
        ),
    );
    one(
        "E0103",
        &system(r#"<component name="laser" kind="k"/><link from="[[lasr]].x" to="laser.y"/>"#),
    );
    one(
        "E0104",
        &system(
            r#"<component name="a" kind="k"/><link from="a.x" to="a.z"/><link from="a.x" to="[[a.z]]"/>"#,
        ),
    );
    one("E0115", &system(r#"<component name="[[registry]]" kind="k"/>"#));
    one("E0103", &system(r#"<clock source="[[sim]].time"/>"#));
}

#[test]
fn links_together() {
    let three = r#"<component name="a" kind="k" rate="20Hz"/><component name="b" kind="k" rate="5Hz"/><component name="c" kind="k"/>"#;
    let with = |code: &str, links: &str| one(code, &system(&format!("{three}{links}")));
    let fine = |links: &str| none(&system(&format!("{three}{links}")));
    with("N0122", r#"<link from="a.x" to="b.y" keep="[[3]]"/>"#);
    fine(r#"<link from="a.x" to="b.y" keep="4"/><link from="b.x" to="a.y" keep="1"/>"#);
    fine(r#"<link from="a.x" to="c.y" keep="1"/>"#);
    with("W0027", r#"<link from="a.x" to="b.y" mode="pull" [[keep]]="all"/>"#);
    with("W0027", r#"<link from="a.x" to="b.y" mode="pull" [[wake]]="spin"/>"#);
    fine(r#"<link from="a.x" to="b.y" mode="pull" keep="latest" wake="sleep"/>"#);
    fine(r#"<link from="a.x" to="b.y" mode="pull" transport="shm"/>"#);
    with("W0027", r#"<link from="a.x" to="b.y" keep="40" [[transport]]="shm"/>"#);
    with("W0027", r#"<link from="a.x" to="b.y" keep="3" history="33" [[transport]]="shm"/>"#);
    fine(r#"<link from="a.x" to="b.y" keep="32" history="9" transport="shm"/>"#);
    let hosts = r#"<host name="h" at="h.local:7410"/><component name="d" kind="k" host="h"/><component name="e" kind="k" host="h"/>"#;
    with("W0027", &format!(r#"{hosts}<link from="a.x" to="d.y" transport="[[shm]]"/>"#));
    fine(&format!(r#"{hosts}<link from="e.x" to="d.y" transport="shm"/>"#));
    one(
        "W0120",
        &system(
            r#"<component name="a" kind="k"/><component name="[[c]]" kind="k"/><link from="a.x" to="c.y" mode="pull"/>"#,
        ),
    );
    fine(r#"<link from="a.x" to="c.y" mode="pull"/><link from="b.x" to="c.z"/>"#);
    with(
        "W0121",
        r#"<link from="a.x" to="b.y" keep="all"/><link from="b.x" to="c.y" keep="all"/><link from="[[c.x]]" to="a.y" keep="all"/>"#,
    );
    with("W0121", r#"<link from="[[a.x]]" to="a.y" keep="all"/>"#);
    fine(
        r#"<link from="a.x" to="b.y" keep="all"/><link from="a.x" to="c.y" keep="all"/><link from="b.x" to="c.z" keep="all"/><link from="c.x" to="a.y"/>"#,
    );
    one(
        "W0116",
        &system(r#"<component name="Laser" kind="k"/><component name="[[laser]]" kind="k"/>"#),
    );
    one("E0115", &system(r#"<component name="[[all]]" kind="k"/>"#));
}

#[test]
fn overrides_go_over_the_file() {
    let file = system(
        r#"<component name="player" kind="k"><parameter name="file" value="a.log"/></component>"#,
    );
    let set = |text: &str| {
        let over = Override::parse(text, Path::new("/home")).unwrap();
        let reading = read(Path::new("m/a.xml"), &mut |_| Ok(file.clone().into()));
        check(reading, &[over], None)
    };
    let reading = set("player.file=b.log=c");
    assert!(reading.is_valid());
    let parameter =
        reading.configuration.as_ref().unwrap().system.components[0].parameter("file").unwrap();
    assert_eq!((&*parameter.value.value, &*parameter.folder), ("b.log=c", Path::new("/home")));
    let reading = set("plaier.file=b.log");
    let shown = reading.findings.render(Colours::No);
    assert!(shown.contains("error[E0103]") && shown.contains("did you mean player?"), "{shown}");
    assert!(shown.contains(" --> --set:1:1\n"), "{shown}");
    for bad in ["", "=", "a=b", ".b=c", "a.b", "a b.c=d"] {
        assert_eq!(
            Override::parse(bad, Path::new("")).unwrap_err().code.as_str(),
            "E0114",
            "{bad}"
        );
    }
}

#[test]
fn what_a_process_cannot_do() {
    one("W0131", "<armor version=\"1\"><[[system]]/></armor>");
    let with = |attribute: &str| system(&format!(r#"<component name="a" kind="k" {attribute}/>"#));
    one("W0132", &with(r#"rate="[[100kHz]]""#));
    none(&with(r#"rate="10kHz""#));
    one("W0133", &with(r#"watchdog="[[1ms]]""#));
    none(&with(r#"watchdog="500ms""#));
    let block = |name: &str| {
        system(&format!(
            r#"<component name="a" kind="k"/><layout><block of="{name}" x="0" y="0"/></layout>"#
        ))
    };
    one("N0134", &block("[[b]]"));
    none(&block("a"));
}

#[test]
fn a_component_that_feeds_itself() {
    let link = |ends: &str| {
        system(&format!(
            r#"<component name="a" kind="k"/><component name="b" kind="k"/><link {ends}/>"#
        ))
    };
    one("W0139", &link(r#"from="[[a.x]]" to="a.y""#));
    one("W0121", &link(r#"from="[[a.x]]" to="a.y" keep="all""#));
    none(&link(r#"from="a.x" to="b.y""#));
}
