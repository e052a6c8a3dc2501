//! One file, one fault, one finding: the right code at the marked piece of text.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use armor_missions::{Colours, Manifests, Override, Reading, check, read};
use armor_wire::manifest::Manifest;

/// Reads `file`, in which `[[…]]` marks what is to be underlined.
fn reading(file: &str, manifests: Option<&Manifests>) -> (Reading, usize) {
    let mark = file.find("[[").unwrap_or(0);
    let plain = file.replace("[[", "").replace("]]", "");
    let reading = read(Path::new("a.xml"), &mut |path| {
        if path == Path::new("a.xml") {
            Ok(plain.clone().into())
        } else {
            Err(std::io::ErrorKind::NotFound.into())
        }
    });
    (check(reading, &[], manifests), mark)
}

/// The file has exactly one finding, of this code, at its mark.
fn one(code: &str, file: &str) {
    one_with(code, file, None);
}

/// The file has no finding at all.
fn none(file: &str) {
    let (reading, _) = reading(file, None);
    assert!(reading.findings.is_empty(), "{file}\n{}", reading.findings.render(Colours::No));
}

fn one_with(code: &str, file: &str, manifests: Option<&Manifests>) {
    let (reading, mark) = reading(file, manifests);
    let shown = reading.findings.render(Colours::No);
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert_eq!(codes, [code], "{file}\n{shown}");
    let finding = reading.findings.iter().next().unwrap();
    assert!(!finding.remedy.is_empty(), "{shown}");
    if file.contains("[[") {
        let at = finding.at.as_ref().unwrap();
        let wanted = file.split("[[").nth(1).unwrap().split("]]").next().unwrap();
        assert_eq!((at.span.start(), at.text()), (mark, wanted), "{shown}");
    }
}

fn system(inner: &str) -> String {
    format!("<armor version=\"1\"><system>{inner}</system></armor>")
}

fn mission(inner: &str) -> String {
    let components = r#"<component name="go" kind="k"/><component name="stop" kind="k"/><component name="free" kind="k" controllable="false"/>"#;
    format!(
        "<armor version=\"1\"><system>{components}</system><mission safe=\"a\"><place name=\"a\" initial=\"true\"/>{inner}</mission></armor>"
    )
}

#[test]
fn bytes_and_xml() {
    one("E0004", "");
    one("E0004", "<armor version=\"1\"><system/></armor>[[<]]");
    one("E0004", "<armor version=\"1\"><system/></armor><[[armor]]/>");
    one("E0004", "<armor version=\"1\"><system/></armor>[[more]]");
    one("E0004", &system(r#"<component [[name]] kind="k"/>"#));
    one(
        "E0004",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="1[[<]]2"/></component>"#,
        ),
    );
    one("E0004", &system(r#"<component name="a"[[kind]]="k"/>"#));
    one("E0004", &system("[[<!-- a -- b -->]]"));
    one("E0005", "[[<!DOCTYPE]] armor [<!ENTITY a \"b\">]><armor version=\"1\"><system/></armor>");
    one(
        "E0009",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="[[&nbsp;]]"/></component>"#,
        ),
    );
    one(
        "E0009",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="a [[&]] b"/></component>"#,
        ),
    );
    one("E0010", &system("<!-- [[\u{7}]] -->"));
    one("E0011", &system(r#"<component name="a" kind="k" [[name]]="b"/>"#));
    one("E0012", "<armor version=\"1\"><[[system]]></armor>");
    one("E0012", &system("[[</component>]]"));
    one("E0013", &system(r#"<component name="a" kind="k" [[my:note]]="x"/>"#));
    one("E0013", "<armor version=\"1\" [[xmlns]]=\"urn:a\"><system/></armor>");
}

#[test]
fn vocabulary() {
    one("E0014", &system("[[hello]]"));
    one("E0015", &system("<[[componant]]/>"));
    one("E0016", &system(r#"<component name="a" kind="k" [[kond]]="x"/>"#));
    one("E0017", &system(r#"<[[component]] name="a"/>"#));
    one("E0018", &system(r#"<component name="[[a b]]" kind="k"/>"#));
    one("E0018", &system(r#"<component name="a" kind="[[]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" rate="[[10]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" rate="[[10s]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" restart="[[maybe]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" watchdog="[[0s]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" controllable="[[yes]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k"/><link from="[[a]]" to="a.x"/>"#));
    one(
        "E0019",
        &system(r#"<component name="a" kind="k"/><link from="a.x" to="a.y" keep="[[none]]"/>"#),
    );
    one("E0019", &mission(r#"<transition name="t" from="a" timeout="[[1e300h]]"/>"#));
    one("E0019", &mission(r#"<transition name="t" from="a" interval="[[5s]]"/>"#));
    one("E0019", &mission(r#"<transition name="t" from="a" not-before="[[tomorrow]]"/>"#));
    one("E0019", &mission("<[[check]]> </check>"));
    one("E0020", "<[[robot]]/>");
    one("E0020", "<armor version=\"[[2]]\"><system/></armor>");
    one("E0021", "<armor version=\"1\"><system/><[[system]]/></armor>");
    one("E0022", "<[[armor]] version=\"1\"/>");
    one("E0026", &mission(r#"<transition name="t" from="a" timeout="1s" [[after]]="2s"/>"#));
}

#[test]
fn other_files() {
    one("E0023", "<armor version=\"1\"><mission system=\"[[gone.xml]]\"/></armor>");
    one("E0024", "<armor version=\"1\"><mission system=\"[[./a.xml]]\"/></armor>");
    one(
        "E0025",
        "<armor version=\"1\"><system/><mission safe=\"a\" system=\"[[b.xml]]\"><place name=\"a\" initial=\"true\"/></mission></armor>",
    );
    let reading = read(Path::new("a.xml"), &mut |path| {
        let other = if path.ends_with("a.xml") { "b.xml" } else { "a.xml" };
        Ok(format!("<armor version=\"1\"><mission system=\"{other}\"/></armor>").into())
    });
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert_eq!(codes, ["E0024"]);
    let reading = read(Path::new("a.xml"), &mut |_| Err(std::io::ErrorKind::NotFound.into()));
    assert_eq!(reading.findings.iter().next().unwrap().code.as_str(), "E0003");
}

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
            r#"<component name="a" kind="k"/><link from="a.x" to="a.z"/><link from="a.y" to="[[a.z]]"/>"#,
        ),
    );
    one("E0115", &system(r#"<component name="[[registry]]" kind="k"/>"#));
    one("E0103", &system(r#"<clock source="[[sim]].time"/>"#));
}

#[test]
fn missions() {
    one("E0201", &mission(r#"<place name="[[a]]"/>"#));
    one("E0202", &mission(r#"<transition name="t" from="a"/><transition name="[[t]]" from="a"/>"#));
    one("E0203", &mission(r#"<transition name="t" from="a" to="[[b]]"/>"#));
    one(
        "E0203",
        &mission(r#"<transition name="t" from="a"><inhibitor place="[[b]]"/></transition>"#),
    );
    one("E0203", &mission(r#"<transition name="t" from="a" overrun="[[b]]"/>"#));
    one("E0103", &mission(r#"<transition name="t" from="a" on="[[robot]].done"/>"#));
    one(
        "E0103",
        &mission(
            r#"<exclusive components="go [[robot]]"/><place name="b" initial="true" components="go"/><place name="c" initial="true"/>"#,
        ),
    );
    one("E0205", &mission(r#"<transition name="[[t]]"/>"#));
    one("E0205", &mission(r#"<transition name="t" from="a"><[[arc]]/></transition>"#));
    one(
        "E0206",
        &mission(
            r#"<exclusive components="go [[free]]"/><place name="b" initial="true" components="go"/><place name="c" initial="true"/>"#,
        ),
    );
    one(
        "E0208",
        &mission(
            r#"<exclusive components="go stop [[go]]"/><place name="b" initial="true" components="go"/><place name="c" components="stop"/><transition name="x" from="b" to="c"/>"#,
        ),
    );
    one(
        "E0207",
        &mission(
            r#"<exclusive components="go stop"/><place name="b" components="go [[stop]]"/><transition name="t" from="a" to="b"/>"#,
        ),
    );
    one(
        "E0207",
        &mission(
            r#"<exclusive components="go stop"/><place name="b" initial="true" components="go"/><place name="c" initial="true" components="[[stop]]"/>"#,
        ),
    );
    one(
        "E0209",
        &mission(
            r#"<place name="b" initial="true" components="go"><parameter component="[[stop]]" name="p" value="1"/></place>"#,
        ),
    );
    one("E0210", &mission(r#"<variable name="v"/><variable name="[[v]]"/>"#));
    one("E0211", &mission(r#"<transition name="t" from="a"><arc from="[[a]]"/></transition>"#));
    one("W0212", &mission(r#"<place name="[[b]]"/>"#));
    one(
        "W0214",
        &mission(
            r#"<place name="b" components="go"/><transition name="s" from="a" to="b"/><transition name="t" from="a" on="[[go]].done"/>"#,
        ),
    );
    one("W0215", &mission(r#"<[[exclusive]] components="go"/>"#));
    one(
        "E0204",
        "<armor version=\"1\"><system/><[[mission]] safe=\"a\"><place name=\"a\"/></mission></armor>",
    );
    one(
        "W0213",
        "<armor version=\"1\"><system/><[[mission]]><place name=\"a\" initial=\"true\"/></mission></armor>",
    );
    one(
        "E0203",
        "<armor version=\"1\"><system/><mission safe=\"a\" goal=\"[[b]]\"><place name=\"a\" initial=\"true\"/></mission></armor>",
    );
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
fn transitions_that_hinder_themselves_or_each_other() {
    let b = r#"<place name="b" components="go"/><transition name="in" from="a" to="b"/>"#;
    let with = |code: &str, inner: &str| one(code, &mission(&format!("{b}{inner}")));
    let fine = |inner: &str| none(&mission(&format!("{b}{inner}")));
    with("W0217", r#"<transition name="t" from="b"><inhibitor place="[[b]]"/></transition>"#);
    with("W0217", r#"<transition name="t"><arc from="[[b]]" weight="2"/></transition>"#);
    fine(r#"<transition name="t" from="b"><inhibitor place="a" weight="2"/></transition>"#);
    with(
        "E0216",
        r#"<place name="c" initial="true"/><transition name="t" from="c"><arc to="[[b]]" weight="2"/></transition>"#,
    );
    with("E0216", r#"<place name="[[c]]" initial="2" components="stop"/>"#);
    fine(r#"<place name="c" initial="2"/>"#);
    // Immediate before late, early before late; but not if something else must be there too.
    with("W0217", r#"<transition name="[[t]]" from="a" timeout="5s"/>"#);
    with(
        "W0217",
        r#"<transition name="s" from="b" timeout="2s"/><transition name="[[t]]" from="b" on="go.done" after="3s"/>"#,
    );
    fine(
        r#"<place name="c" initial="true"/><transition name="s" from="b c" timeout="2s"/><transition name="t" from="b" timeout="3s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" timeout="2s"/><transition name="t" from="b" timeout="3s" class="safety"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" on="go.done"/><transition name="t" from="b" timeout="3s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" timeout="2s" operator="true"/><transition name="t" from="b" timeout="3s"/>"#,
    );
    with(
        "W0217",
        r#"<transition name="[[s]]" from="b" on="go.done"/><transition name="t" from="b" on="go.done" priority="1"/>"#,
    );
    with(
        "W0218",
        r#"<transition name="s" from="b" on="go.done"/><transition name="[[t]]" from="b" on="go.done"/>"#,
    );
    with(
        "W0218",
        r#"<place name="c" initial="true"/><transition name="s" from="b c" timeout="2s"/><transition name="[[t]]" from="b" timeout="2s"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" on="go.done"/><transition name="t" from="b" on="go.failed"/>"#,
    );
    fine(
        r#"<transition name="s" from="b" when="go.o.x &lt; 1"/><transition name="t" from="b" when="go.o.x &gt; 1"/>"#,
    );
}

#[test]
fn dates_periods_and_attributes_without_effect() {
    let with = |code: &str, inner: &str| {
        one(
            code,
            &mission(&format!(
                "<place name=\"b\"/>{}",
                inner.replace("T>", "name=\"t\" from=\"a\" to=\"b\"")
            )),
        );
    };
    with(
        "E0219",
        r#"<transition T> not-before="2026-11-21T15:00Z" not-after="[[2026-11-21T14:59:59.9Z]]"/>"#,
    );
    with("E0019", r#"<transition T> not-after="[[2026-02-30T00:00Z]]"/>"#);
    with("W0027", r#"<transition T> [[missed]]="skip"/>"#);
    with("W0027", r#"<transition T> [[lost-link]]="fire"/>"#);
    with("W0027", r#"<transition T> operator="true" [[answer-within]]="5s"/>"#);
    with("W0027", r#"<transition T> autonomy="confirm" [[unanswered]]="fire"/>"#);
    with("W0027", r#"<transition T> after="5s" [[overrun]]="a"/>"#);
    with("W0027", r#"<transition T>/><place name="c" initial="true" on-failure="[[a]]"/>"#);
    with("E0103", r#"<transition T>/><variable name="v" source="[[robot]].battery"/>"#);
    let late = |period: &str, time: &str| {
        format!(
            r#"<armor version="1"><system/><mission safe="a" period="{period}"><place name="a" initial="true"/><transition name="t" from="a" {time}/></mission></armor>"#
        )
    };
    one("W0220", &late("1s", "timeout=\"[[0.5s]]\""));
    none(&late("1s", "timeout=\"1s\""));
    none(&late("1s", "after=\"0.5s\""));
    one("E0019", &late("[[0s]]", ""));
}

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
fn what_is_read_is_bounded_however_many_files_are_named() {
    let mut asked = 0;
    let reading = read(Path::new("0.xml"), &mut |path| {
        asked += 1;
        let n: u32 = path.file_stem().unwrap().to_str().unwrap().parse().unwrap();
        Ok(format!(
            r#"<armor version="1"><mission safe="a"><place name="a" initial="true"/><submission ref="{}.xml"/><submission ref="{}.xml"/></mission></armor>"#,
            n + 1,
            n + 2
        )
        .into())
    });
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert!(codes.contains(&"E0008") && asked == 64, "{asked} {codes:?}");
}

#[test]
fn what_is_left_out_is_said() {
    let links = r#"<link from="a.x" to="b.y"/>"#.repeat(armor_missions::MAX_FINDINGS);
    let codes = all_of(&system(&links));
    assert_eq!(codes.len(), armor_missions::MAX_FINDINGS + 1);
    assert_eq!(codes.last(), Some(&"N0999"));
}

/// All that is found, as codes, in the order of the file.
fn all_of(file: &str) -> Vec<&'static str> {
    let (reading, _) = reading(file, None);
    assert!(!reading.is_valid());
    reading.findings.iter().map(|finding| finding.code.as_str()).collect()
}

#[test]
fn tags_that_do_not_match_hide_nothing_else() {
    let file = |first: &str, second: &str| {
        system(&format!(
            r#"{first}<component name="b" kind="k" rate="x"/><link from="a.x" to="c.y"/>{second}"#
        ))
    };
    let a = r#"<component name="a" kind="k">"#;
    // Without the mistake: a bad rate and an unknown component.
    assert_eq!(all_of(&file(&format!("{a}</component>"), "")), ["E0019", "E0103"]);
    assert_eq!(all_of(&file(a, "")), ["E0012", "E0019", "E0103"]);
    assert_eq!(all_of(&file(&format!("{a}</component>"), "</clock>")), ["E0019", "E0103", "E0012"]);
    let mission = r#"<mission safe="h"><place name="h" initial="true"><transition name="t" from="h" to="g"/></mission>"#;
    let both = format!("<armor version=\"1\"><system>{a}</component>{mission}</armor>");
    assert_eq!(all_of(&both), ["E0012", "E0012", "E0203"]);
}

#[test]
fn a_misspelt_end_tag_is_one_mistake() {
    let file =
        r#"<armor version="1"><system><component name="a" kind="k"></componet></system></armor>"#;
    assert_eq!(all_of(file), ["E0012"]);
    let misspelt = r#"<armor version="1"><system><component name="a" kind="k"/></systm></armor>"#;
    assert_eq!(all_of(misspelt), ["E0012"]);
}

#[test]
fn a_malformed_tag_brings_no_follow_up() {
    // The component is not understood, so whether links lead to it is not known.
    let file = r#"<component name="a" kind=k/><component name="b" kind="k" rate="x"/><link from="a.x" to="b.y"/><link from="b.x" to="b.y"/>"#;
    assert_eq!(all_of(&system(file)), ["E0004", "E0019", "E0104"]);
    let cut = r#"<armor version="1"><system><component name="b" kind="k" rate="x"/><link from="a.x" to="b"#;
    assert_eq!(all_of(cut), ["E0019", "E0004"]);
}

fn manifests() -> Manifests {
    let port = |id: &str, name: &str, required: bool| {
        format!(
            r#"{{"id":"{id}","type":"{name}","schema":"{name}{{}}","schema_hash":"00000000000000{:02x}","required":{required}}}"#,
            name.len()
        )
    };
    let text = format!(
        r#"{{"armor_manifest":1,"kind":"k","summary":"","inputs":[{},{}],"outputs":[{},{}],"parameters":[
            {{"name":"speed","type":"number","unit":"m/s","default":"1","minimum":0.1,"maximum":2}},
            {{"name":"colour","type":"choice","choices":["red","blue"],"default":"red"}},
            {{"name":"count","type":"integer","default":"3"}},
            {{"name":"file","type":"path","doc":"the log"}}]}}"#,
        port("in", "Scan", true),
        port("extra", "Map", false),
        port("out", "Scan", false),
        port("map", "Map", false),
    );
    let manifest: Manifest = serde_json::from_str(&text).unwrap();
    Manifests::from([("k".into(), manifest)])
}

#[test]
fn systems_against_manifests() {
    let manifests = manifests();
    let with = |code: &str, parameters: &str, links: &str| {
        let file = format!(
            r#"<component name="a" kind="k"><parameter name="file" value="x"/>{parameters}</component>{links}"#
        );
        one_with(code, &system(&file), Some(&manifests));
    };
    let fed = r#"<link from="a.out" to="a.in"/>"#;
    with("E0106", "", &format!(r#"{fed}<link from="a.[[oot]]" to="a.extra"/>"#));
    with("E0107", "", &format!(r#"{fed}<link from="[[a.in]]" to="a.extra"/>"#));
    with("E0108", "", &format!(r#"{fed}<link from="a.out" to="[[a.extra]]"/>"#));
    with("E0110", r#"<parameter name="[[sped]]" value="1"/>"#, fed);
    with("E0112", r#"<parameter name="speed" value="[[fast]]"/>"#, fed);
    with("E0112", r#"<parameter name="speed" value="[[1m]]"/>"#, fed);
    with("E0112", r#"<parameter name="count" value="[[1.5]]"/>"#, fed);
    with("E0113", r#"<parameter name="speed" value="[[3m/s]]"/>"#, fed);
    with("E0113", r#"<parameter name="colour" value="[[green]]"/>"#, fed);
    let exchanged = r#"<component name="b" kind="k"><parameter name="file" value="x"/></component><link from="[[b.in]]" to="a.out"/>"#;
    with("E0107", "", &format!("{fed}{exchanged}"));
    // A slip in a name, and not also that what it meant is missing.
    with("E0106", "", r#"<link from="a.out" to="a.[[inn]]"/>"#);
    with("E0103", "", r#"<link from="a.out" to="[[aa]].in"/>"#);
    with("E0019", "", r#"<link from="[[a]]" to="a.in"/>"#);
    with("E0019", "", r#"<link from="a.out" to="[[a]]"/>"#);
    with("E0017", "", r#"<[[link]] from="a.out"/>"#);
    with("E0015", "", r#"<[[lnik]] from="a.out" to="a.in"/>"#);
    with("E0101", "", &format!(r#"{fed}<component name="[[a]]" kind="other"/>"#));
    for kind in ["[[]]", "[[k ]]"] {
        let malformed = format!(r#"<component name="a" kind="{kind}"/>{fed}"#);
        one_with("E0018", &system(&malformed), Some(&manifests));
    }
    one_with(
        "E0110",
        &system(&format!(
            r#"<component name="a" kind="k"><parameter name="[[fille]]" value="x"/></component>{fed}"#
        )),
        Some(&manifests),
    );
    one_with("E0105", &system(r#"<component name="a" kind="[[kk]]"/>"#), Some(&manifests));
    let no_input =
        r#"<component name="[[a]]" kind="k"><parameter name="file" value="x"/></component>"#;
    one_with("E0109", &system(no_input), Some(&manifests));
    let no_file = format!(r#"<component name="[[a]]" kind="k"/>{fed}"#);
    one_with("E0111", &system(&no_file), Some(&manifests));
    let right = r#"<component name="a" kind="k"><parameter name="file" value="x"/><parameter name="speed" value="5km/h"/></component>"#;
    let all = format!(r#"{right}{fed}<link from="a.map" to="a.extra"/>"#);
    let (reading, _) = reading(&system(&all), Some(&manifests));
    assert!(reading.findings.is_empty(), "{}", reading.findings.render(Colours::No));
}

#[test]
fn two_builds_of_one_message_are_told_apart_by_their_fields() {
    let port = |schema: &str, hash: u32| {
        format!(
            r#"{{"id":"p","type":"Scan","schema":"{schema}","schema_hash":"{hash:016x}","required":true}}"#
        )
    };
    let kind = |kind: &str, inputs: &str, outputs: &str| -> Manifest {
        let text = format!(
            r#"{{"armor_manifest":1,"kind":"{kind}","summary":"","inputs":[{inputs}],"outputs":[{outputs}],"parameters":[]}}"#
        );
        serde_json::from_str(&text).unwrap()
    };
    let old = kind("old", "", &port("Scan{ranges:[f32]}", 1));
    let new = kind("new", &port("Scan{ranges:[f64],stamp:f64}", 2), "");
    let manifests = Manifests::from([("old".into(), old), ("new".into(), new)]);
    let file = r#"<component name="a" kind="old"/><component name="b" kind="new"/><link from="a.p" to="b.p"/>"#;
    let (reading, _) = reading(&system(file), Some(&manifests));
    let shown = reading.findings.render(Colours::No);
    assert!(shown.contains("E0108") && shown.contains("both call it Scan"), "{shown}");
    assert!(shown.contains("ranges[]: a.p has f32, b.p has f64"), "{shown}");
    assert!(shown.contains("stamp"), "{shown}");
}

#[test]
fn all_findings_come_at_once_sorted_and_as_json() {
    let file = system(
        "\n<component name=\"a\" kind=\"k\" rate=\"x\"/>\n<component name=\"a\" kind=\"k\"/>\n<link from=\"b.x\" to=\"c.y\"/>",
    );
    let (reading, _) = reading(&file, None);
    let json: Vec<serde_json::Value> =
        reading.findings.iter().map(|finding| serde_json::to_value(finding).unwrap()).collect();
    let codes: Vec<_> = json.iter().map(|finding| finding["code"].as_str().unwrap()).collect();
    assert_eq!(codes, ["E0019", "E0101", "E0103", "E0103"]);
    assert_eq!(json[0]["line"], 2);
    assert_eq!(json[0]["column"], 36);
    assert_eq!(json[0]["end_column"], 37);
    assert_eq!(json[0]["text"], "x");
    assert_eq!(json[0]["file"], "a.xml");
    assert_eq!(json[0]["severity"], "error");
    assert_eq!(json[1]["related"][0]["line"], 2);
    assert_eq!(json[3]["text"], "c");
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

/// The codes of all findings of the file, and these as they are shown.
fn found_in(file: &str) -> (Vec<&'static str>, String) {
    let (reading, _) = reading(file, None);
    let codes = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    (codes, reading.findings.render(Colours::No))
}

#[test]
fn one_mistake_about_a_component_is_one_finding() {
    let with = |component: &str| {
        format!(
            "<armor version=\"1\"><system>{component}<component name=\"b\" kind=\"k\"/>\
             <link from=\"arm.x\" to=\"b.in\"/><link from=\"b.y\" to=\"arm.z\"/></system>\
             <mission safe=\"p\"><place name=\"p\" initial=\"true\" components=\"arm\">\
             <parameter component=\"arm\" name=\"n\" value=\"1\"/></place></mission></armor>"
        )
    };
    for (code, component) in [
        ("E0015", r#"<componnet name="arm" kind="k"/>"#),
        ("E0015", r#"<Component name="arm" kind="k"/>"#),
        ("E0016", r#"<component nmae="arm" kind="k"/>"#),
        ("E0017", r#"<component kind="k"/>"#),
        ("E0017", r#"<component name="arm"/>"#),
        ("E0018", r#"<component name="arm " kind="k"/>"#),
        ("E0018", r#"<component name="arm" kind="k "/>"#),
        ("E0101", r#"<component name="arm" kind="k"/><component name="arm" kind="j"/>"#),
        ("E0103", ""),
    ] {
        let (codes, shown) = found_in(&with(component));
        assert_eq!(codes, [code], "{component}\n{shown}");
        assert_eq!(code == "E0103", shown.contains("and named in 3 more places"), "{shown}");
    }
    let reserved = with(r#"<component name="executive" kind="k"/>"#)
        .replace("arm.", "executive.")
        .replace("\"arm\"", "\"executive\"");
    assert_eq!(found_in(&reserved).0, ["E0115"]);
    let malformed = r#"<component name="2arm" kind="k"/>"#;
    let (codes, shown) = found_in(&with(malformed).replace("arm.", "2arm."));
    assert_eq!(codes, ["E0018", "E0103"], "{shown}");
}

#[test]
fn one_mistake_in_a_mission_is_one_finding() {
    let mission = |inner: &str| {
        format!(
            "<armor version=\"1\"><system><component name=\"go\" kind=\"k\"/>\
             <component name=\"stop\" kind=\"k\"/></system><mission safe=\"hold\">{inner}\
             <place name=\"hold\"/></mission></armor>"
        )
    };
    let place = r#"<place name="a" initial="true" components="go"/><place name="b"/>"#;
    let ab = r#"<transition name="t" from="a" to="b" timeout="5s"/>"#;
    for (code, inner) in [
        ("E0019", r#"<place name="a" initial="yes"/>"#.to_owned()),
        ("E0019", r#"<place name="a" initial="true" components="go,stop"/>"#.to_owned()),
        ("E0019", format!("{place}{ab}<transition name=\"u\" from=\"a\" to=\"hold\" on=\"go\"/>")),
        (
            "E0230",
            format!("{place}{ab}<transition name=\"u\" from=\"a\" to=\"hold\" when=\"1 1\"/>"),
        ),
        (
            "E0230",
            format!("{place}<transition name=\"u\" from=\"a\" to=\"hold\" when=\"1 1\"/>{ab}"),
        ),
        (
            "E0009",
            format!("{place}{ab}<transition name=\"u\" from=\"a\" to=\"hold\" when=\"1 & 1\"/>"),
        ),
        ("E0015", format!("{place}{}", ab.replace("transition", "transtion"))),
        ("E0203", format!("{place}{}", ab.replace("\"b\"", "\"bb\""))),
        ("W0212", place.to_owned()),
    ] {
        let (codes, shown) = found_in(&mission(&inner));
        assert_eq!(codes, [code], "{inner}\n{shown}");
    }
    let goal = mission(place).replace("safe=\"hold\"", "safe=\"hold\" goal=\"b\"");
    assert!(found_in(&goal).1.contains("the goal can never be reached"));
}

#[test]
fn one_mistake_in_the_file_is_one_finding() {
    let (codes, shown) = found_in("<armor version=\"1\"><System/></armor>");
    assert_eq!(codes, ["E0015"], "{shown}");
    assert!(shown.contains("did you mean system?"), "{shown}");
    one(
        "E0010",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="[[&#0;]]"/></component>"#,
        ),
    );
    let conflict = "<armor version=\"1\">\n<system>\n[[<<<<<<<]] HEAD\n<component name=\"a\" kind=\"k\"/>\n\
                    =======\n<component name=\"a\" kind=\"j\"/>\n>>>>>>> other\n</system></armor>";
    one("E0004", conflict);
}

#[test]
fn what_is_expected_of_a_number_is_said() {
    let shown = |inner: &str| found_in(&mission(inner)).1;
    let count = shown(r#"<transition name="t" from="a" priority="99999999999999"/>"#);
    assert!(count.contains("a whole number from -999999999 to 999999999"), "{count}");
    let large = shown(r#"<variable name="v" min="1e999m/s"/>"#);
    assert!(large.contains("below 1e308"), "{large}");
    let empty = shown(r#"<transition name="t" from="a" priority=""/>"#);
    assert!(empty.contains("priority is empty"), "{empty}");
}

#[test]
fn a_report_that_is_almost_done_is_a_warning() {
    for report in ["dnoe", "Done", "don", "faild"] {
        one("W0221", &mission(&format!(r#"<transition name="t" from="a" on="go.[[{report}]]"/>"#)));
    }
    for report in ["done", "failed", "seen", "docked"] {
        none(&mission(&format!(r#"<transition name="t" from="a" on="go.{report}"/>"#)));
    }
}

#[test]
fn a_circle_that_takes_no_time_is_a_warning() {
    let circle = |first: &str, more: &str| {
        mission(&format!(
            r#"<place name="b"/><place name="c"/><transition name="t" from="a" to="b"/><transition name="[[u]]" from="b" to="c"/><transition name="v" from="c" to="b"{first}/>{more}"#
        ))
    };
    one("W0222", &circle("", ""));
    one("W0222", &mission(r#"<transition name="[[t]]" from="a" to="a"/>"#));
    for rest in [r#" after="1s""#, r#" timeout="1s""#, r#" on="go.done""#, r#" operator="true""#] {
        none(&circle(rest, "").replace("[[u]]", "u"));
    }
    // Another one goes first, and leads out of it.
    let out = r#"<place name="d"/><transition name="w" from="b" to="d" priority="1"/>"#;
    let (codes, shown) = found_in(&circle("", out).replace("[[u]]", "u"));
    assert!(!codes.contains(&"W0222"), "{shown}");
}

#[test]
fn how_many_findings_were_left_out_is_right_also_after_the_check() {
    let parts: String =
        (0..4000).map(|n| format!("<component name=\"c{n}\" kind=\"k\" rate=\"x\"/>")).collect();
    let (mut reading, _) = reading(&system(&parts), None);
    let configuration = reading.configuration.clone().unwrap();
    configuration.refuse_unplayed(&[], &mut reading.findings);
    reading.findings.sort();
    for findings in [reading.findings.without_notes(), reading.findings] {
        let shown = findings.render(Colours::No);
        assert_eq!(shown.matches("3500 more findings were left out").count(), 1, "{shown}");
        assert_eq!(findings.iter().len(), 501);
    }
}
