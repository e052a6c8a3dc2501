//! Mistakes that would otherwise be several findings, or one that leads away from them.

use std::path::Path;

use armor_robotfile::{Colours, Reading, check, load, load_copy, read};

use super::follow_ups::{END, LATE, kinds, only, robot};
use super::{found_in, mission, none, one, one_with};

/// With a sub-mission in `inner.xml`: the codes, and the findings as they are shown.
pub(super) fn with_inner(main: &str, inner: &str) -> (Vec<&'static str>, String) {
    let inner = format!("<armor version=\"1\">{inner}</armor>");
    let reading = read(Path::new("a.xml"), &mut |path| match path == Path::new("a.xml") {
        true => Ok(main.into()),
        false if path.ends_with("inner.xml") => Ok(inner.clone().into()),
        false => Err(std::io::ErrorKind::NotFound.into()),
    });
    let reading = check(reading, &[], None);
    let found = reading.findings.without_notes();
    (found.iter().map(|it| it.code.as_str()).collect(), found.render(Colours::No))
}

fn with_inner_shown(main: &str, inner: &str, expected: &[&str], shown: &str) {
    let (codes, text) = with_inner(main, inner);
    assert_eq!(codes, expected, "{main}\n{text}");
    assert!(text.contains(shown), "{shown}\n{text}");
}

/// The only finding of a file without manifests, apart from notes.
fn only_of(code: &str, shown: &str, file: &str) {
    let (codes, text) = with_inner(file, "");
    assert_eq!(codes, [code], "{file}\n{text}");
    assert!(text.contains(shown), "{shown}\n{text}");
}

const INNER: &str = r#"<mission name="in" goal="g" safe="s"><place name="p" initial="true" components="stop"/><place name="g"/><place name="s"/><transition name="t" from="p" to="g" on="stop.done"/><transition name="u" from="p" to="s" timeout="9s"/></mission>"#;

fn main_with(content: &str) -> String {
    mission(&format!(
        r#"<place name="b"/><place name="c"/><transition name="there" from="a" to="b" timeout="5s"/>{content}<transition name="back" from="c" to="over" timeout="5s"/>"#
    ))
}

#[test]
fn a_sub_mission_that_stands_still_on_failure_has_no_safe_place() {
    let main = main_with(r#"<submission ref="inner.xml" in="b" out="c"/>"#);
    with_inner_shown(&main, INNER, &[], "");
    let unnamed = INNER.replace(r#" safe="s""#, "");
    with_inner_shown(&main, &unnamed, &["W0213"], "write safe=\"s\"");
    // Nothing stands still where the mission leads on, or where a branch ends next to another.
    let leads_on = unnamed
        .replace("</mission>", r#"<transition name="v" from="s" to="p" timeout="1s"/></mission>"#);
    with_inner_shown(&main, &leads_on, &[], "");
    let forks = unnamed.replace(r#"to="g""#, r#"to="g s""#);
    with_inner_shown(&main, &forks, &[], "");
}

#[test]
fn two_sub_missions_that_begin_in_one_place_are_one_finding() {
    let twice = |enter: &str| {
        main_with(&format!(
            r#"<place name="d"/><transition name="on" from="c" to="d" timeout="1s"/><submission ref="inner.xml" in="b" out="c"/><submission ref="inner.xml" in="{enter}" out="over"/>"#
        ))
        .replace(r#"from="c" to="over" timeout"#, r#"from="a" to="c" priority="1" timeout"#)
        .replace(r#"priority="1" timeout="5s""#, r#"operator="true""#)
    };
    with_inner_shown(&twice("d"), INNER, &[], "");
    with_inner_shown(&twice("b"), INNER, &["W0218"], "did you mean in=\"d\"?");
}

#[test]
fn the_names_in_a_sub_mission_that_cannot_be_read_are_not_known() {
    let check = "<check>never in.p and active(stop)</check><check>never c.d</check>";
    let main = main_with(&format!(r#"<submission ref="other.xml" in="b" out="c"/>{check}"#));
    with_inner_shown(&main, INNER, &["E0023"], "other.xml cannot be read");
}

#[test]
fn a_safe_place_that_the_mission_leads_on_from_is_one_finding() {
    let exit = r#"<transition name="stop" to="hold" operator="true" class="safety"/><transition name="go-on" from="a" to="b" operator="true"/><transition name="end-late" from="b" to="over" timeout="9s"/><place name="b"/>"#;
    let right = mission(exit);
    none(&right);
    only_of(
        "W0217",
        "did you mean safe=\"hold\"?",
        &right.replace(r#"safe="hold""#, r#"safe="b""#),
    );
    only_of("W0213", "write safe=\"hold\"", &right.replace(r#" safe="hold""#, ""));
}

#[test]
fn goal_and_safe_place_are_exchanged_also_where_an_emergency_leads_to_the_goal() {
    let exit = r#"<transition name="stop" to="hold" operator="true" class="safety"/>"#;
    let file = robot(r#"safe="hold""#, &format!("{END}{LATE}{exit}"));
    let file = file.replace(r#"goal="over" safe="hold""#, r#"goal="hold" safe="over""#);
    only("W0276", "did you mean goal=\"over\" safe=\"hold\"?", &file);
}

#[test]
fn a_transition_of_the_safety_class_does_not_lead_to_the_goal_while_done_leads_to_the_safe_place() {
    let lost = r#"<transition name="lost" from="a" to="hold" when="power.state.level &lt; 0.1" class="safety"/>"#;
    let file = robot(r#"safe="hold""#, &format!("{END}{LATE}{lost}"));
    let file = file.replace(r#"goal="over" safe="hold""#, r#"goal="hold" safe="over""#);
    only("W0276", "did you mean goal=\"over\" safe=\"hold\"?", &file);
}

#[test]
fn an_element_of_another_noun_may_be_the_place_that_is_missing() {
    let file = mission(r#"<station name="b"/><transition name="t" from="a" to="b" timeout="5s"/>"#);
    only_of("E0015", "known elements", &file);
}

#[test]
fn a_quote_that_is_not_closed_is_one_finding() {
    for (right, wrong) in [
        (r#"name="b"/>"#, "name=[[\"b]]/>"),
        (r#"name="c"><"#, "name=[[\"c]]><"),
        (r#"from="a" to="b""#, "from=[[\"a to=]]\"b\""),
        (r#"timeout="5s"/>"#, "timeout=[[\"5s]]/>"),
    ] {
        let file = mission(
            r#"
            <place name="b"/>
            <place name="c"></place>
            <transition name="t" from="a" to="b" timeout="5s"/>
            <transition name="u" from="b" to="c" timeout="5s"/>
            "#,
        );
        one("E0004", &file.replacen(right, wrong, 1));
    }
    // An apostrophe in a text opens none.
    let (codes, shown) = found_in(&mission("it's\n<place name=\"b\"/> isn't\n"));
    assert!(!codes.contains(&"E0004"), "{shown}");
}

#[test]
fn signs_of_other_languages_in_a_value_are_named() {
    let file =
        mission(r#"<transition name="t" from="a" to="hold" when="free.state.ready [[&&]] true"/>"#);
    one("E0009", &file);
    only_of("E0009", "write and", &file.replace("[[", "").replace("]]", ""));
    let quotes = mission("<place name=\u{201c}b\u{201d}/>");
    let (codes, shown) = found_in(&quotes);
    assert_eq!(codes, ["E0004"], "{shown}");
    assert!(shown.contains("typographic"), "{shown}");
    only_of("E0017", "write version=\"1\"", &mission("").replace(r#" version="1""#, ""));
}

#[test]
fn the_file_that_was_probably_meant_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let missions = folder.path().join("m");
    std::fs::create_dir(&missions).unwrap();
    std::fs::write(missions.join("inner.xml"), format!("<armor version=\"1\">{INNER}</armor>"))
        .unwrap();
    let path = missions.join("main.xml");
    for named in ["m/inner.xml", "iner.xml", "inner", "./Inner.xml"] {
        let main = main_with(&format!(r#"<submission ref="{named}" in="b" out="c"/>"#));
        std::fs::write(&path, main).unwrap();
        let shown = load(&path).findings.render(Colours::No);
        assert!(shown.contains("inner.xml? The path is relative"), "{named}\n{shown}");
    }
}

#[test]
fn a_number_in_quotation_marks_is_to_be_written_without() {
    let file = robot(
        r#"safe="hold""#,
        &format!(
            r#"{END}{LATE}<transition name="weak" from="a" to="hold" when="power.state.voltage &lt; '3V'"/>"#
        ),
    );
    only("E0233", "write 3V without quotation marks", &file);
}

#[test]
fn a_copy_of_a_file_has_the_sub_missions_of_the_original() {
    let folder = tempfile::tempdir().unwrap();
    let inner = INNER.replace("name=\"in\"", "name=\"in\" system=\"main.xml\"");
    std::fs::write(
        folder.path().join("inner.xml"),
        format!("<armor version=\"1\">{inner}</armor>"),
    )
    .unwrap();
    let copy = folder.path().join("backup.xml");
    let main = main_with(r#"<submission ref="inner.xml" in="b" out="c"/>"#);
    std::fs::write(&copy, main).unwrap();
    let read = |reading: Reading| {
        let codes = reading.findings.iter().map(|it| it.code.as_str());
        codes.collect::<Vec<_>>().join(" ")
    };
    assert_eq!(read(load(&copy)), "E0025");
    assert_eq!(read(load_copy(&copy)), "");
}

#[test]
fn a_variable_that_follows_the_wrong_field_is_one_finding() {
    let file = |field: &str| {
        robot(
            r#"safe="hold""#,
            &format!(
                r#"<variable name="level" source="power.state.{field}" min="0" max="1"/>{END}{LATE}<transition name="weak" from="a" to="hold" when="level &lt; 30%" priority="1"/><transition name="low" from="a" to="hold" when="level &lt; 20%" priority="2"/>"#
            ),
        )
    };
    let (_, shown) = found_in(&file("level"));
    assert!(!shown.contains("E0234"), "{shown}");
    only("E0234", "is another field meant in the source of level?", &file("voltage"));
}

#[test]
fn a_failure_written_for_an_end_in_a_sub_mission_is_one_finding() {
    let main = main_with(r#"<submission ref="inner.xml" in="b" out="c"/>"#);
    let inner = INNER.replace("stop.done", "stop.failed");
    with_inner_shown(&main, &inner, &["W0275"], "did you mean on=\"stop.done\"?");
}

#[test]
fn a_fork_to_a_wrong_safe_place_is_one_finding() {
    let file = mission(
        r#"<place name="b" components="go"/><place name="c"/><transition name="fork" from="a" to="b c" timeout="5s"/><transition name="t" from="b" to="over" on="go.done"/><transition name="late" from="b" to="hold" timeout="9s"/>"#,
    );
    only_of("W0217", "did you mean safe=\"hold\"?", &file.replace(r#"safe="hold""#, r#"safe="b""#));
}

#[test]
fn a_guard_with_a_wrong_quantity_is_one_finding() {
    let file = mission(
        r#"<variable name="n" min="0" max="3"/><place name="b" components="go"/><transition name="in" from="a" to="b" timeout="5s"><set variable="n" value="1"/></transition><transition name="t" from="b" to="over" on="go.done"/><transition name="u" from="b" to="hold" when="n &lt; 30%"/>"#,
    );
    only_of("E0234", "is a fraction of one", &file);
}

#[test]
fn a_misspelt_declaration_is_found_where_it_is_written() {
    let parts = |component: &str, place: &str, variable: &str| {
        robot(
            r#"safe="hold""#,
            &format!(
                r#"<place name="{place}" components="arm lamp"/><variable name="{variable}" min="0" max="3" initial="0"/><transition name="next" from="a" to="lifting" on="go.done"/>{LATE}<transition name="up" from="lifting" to="over" on="arm.done" when="count &lt; 2"><set variable="count" value="count + 1"/></transition><transition name="slow" from="lifting" to="hold" timeout="9s"/><transition name="fails" from="lifting" to="hold" on="lamp.failed"/>"#
            ),
        )
        .replace("</system>", &format!("<component name=\"{component}\" kind=\"lamp\"/></system>"))
    };
    // The file has one finding, at its mark, that proposes this name.
    let marked = |code: &str, name: &str, file: &str| {
        only(code, &format!("did you mean {name}?"), &file.replace("[[", "").replace("]]", ""));
        one_with(code, file, Some(&kinds()));
    };
    marked("E0103", "lamp", &parts("[[lammp]]", "lifting", "count"));
    marked("E0203", "lifting", &parts("lamp", "[[liftng]]", "count"));
    marked("E0231", "count", &parts("lamp", "lifting", "[[counts]]"));
    // One use may be misspelt as well.
    let once = parts("lammp", "lifting", "count").replace("arm lamp", "arm");
    let once = once.replace("on=\"lamp.failed\"", "on=\"[[lamp]].failed\"");
    marked("E0103", "lammp", &once);
    // A name that is used is not misspelt.
    let used = parts("lamp", "liftng", "count");
    let used = used.replace(r#"name="slow" from="lifting""#, r#"name="slow" from="liftng""#);
    only("E0203", "there is no place called lifting", &used);
    let hosts = |name: &str| {
        super::system(&format!(
            r#"<host name="{name}" at="arm.local:7410"/><component name="go" kind="explorer" host="arm-board"/><component name="stop" kind="lamp" host="arm-board"/>"#
        ))
    };
    marked("E0137", "arm-board", &hosts("[[arm-bord]]"));
}
