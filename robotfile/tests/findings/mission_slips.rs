//! Slips in a mission: each is one finding, at the word that is wrong, with what to write instead.

use std::path::Path;

use armor_robotfile::{Colours, check, read};

use super::follow_ups::{END, LATE, kinds, only, robot};
use super::one;

/// With its safe place.
fn with(content: &str) -> String {
    robot(r#"safe="hold""#, &format!("{END}{LATE}{content}"))
}

#[test]
fn a_less_than_sign_in_a_check_is_one_finding() {
    for text in
        ["duration(over) [[<]]= 15min", "always a [[<]] 3", "always a [[<]]over", "never a [[<]]3"]
    {
        one("E0004", &super::mission(&format!("<check>{text}</check>")).replace("go.done", "x.y"));
    }
    only("E0004", "write it as &lt;", &with("<check>duration(over or hold) <= 15min</check>"));
    // The rest of the check is read, and so is the rest of the file.
    let file = with("<check>never a < zz</check><place name=\"b\" wrong=\"1\"/>");
    let (codes, shown) = super::found_in(&file);
    assert_eq!(codes, ["E0004", "E0203", "E0016"], "{shown}");
    let element = with("<check><place name=\"b\"/></check>");
    assert!(super::all_of(&element).contains(&"E0015"));
    let many = with(&format!("<check>never a {}</check>", "< ".repeat(3000)));
    assert!(super::all_of(&many).contains(&"E0004"));
}

#[test]
fn a_component_that_is_missing_in_a_place_is_one_finding() {
    let parameter = r#"<parameter component="go" name="speed" value="1m/s"/>"#;
    let file = |components: &str| {
        let file = robot(
            r#"safe="hold""#,
            &format!(
                "{END}{}",
                r#"<transition name="late" from="a" to="hold" on="go.failed"/><check>never active(go)</check><place name="b" components="go"/>"#
            ),
        );
        let place = format!(
            r#"<place name="a" initial="true" components="{components}">{parameter}{}</place>"#,
            parameter.replace("speed", "turn")
        );
        file.replace(r#"<place name="a" initial="true" components="go"/>"#, &place)
    };
    only("E0103", "did you mean go?", &file("goo"));
    only("E0103", "did you mean go?", &file("Go"));
    let forgotten = file("arm");
    only("E0209", "add go to the components of a", &forgotten);
    only("E0209", "this report is never sent", &forgotten);
}

#[test]
fn a_check_on_a_component_that_is_misspelt_in_its_place_is_left_out() {
    let place = r#"<place name="b" components="Arm"/><check>never active(arm)</check>"#;
    only("E0103", "did you mean arm?", &with(place));
}

#[test]
fn a_statement_in_an_attribute_is_one_finding() {
    let text = "write the statement between <check> and </check>";
    only("E0016", text, &with(r#"<check statement="never hold"/>"#));
    only("E0019", "this check is empty", &with("<check/>"));
}

#[test]
fn a_parameter_with_a_dot_names_a_component_and_a_parameter() {
    let place = r#"<place name="a" initial="true" components="go"><parameter name="[[go.speed]]" value="1m/s"/></place>"#;
    let file = with("").replace(r#"<place name="a" initial="true" components="go"/>"#, place);
    one("E0018", &file);
    only(
        "E0018",
        r#"write component="go" name="speed""#,
        &file.replace("[[", "").replace("]]", ""),
    );
}

#[test]
fn a_component_that_is_given_twice_is_one_finding_in_all_files() {
    let system = r#"<armor version="1"><system><component name="go" kind="explorer"/><component name="go" kind="arm"/><link from="arm.out" to="go.in"/></system></armor>"#;
    let mission = with(
        r#"<place name="b" components="arm"/><transition name="t" from="b" to="over" on="arm.done"/><transition name="u" from="a" to="b" on="go.failed"/>"#,
    );
    let end = mission.find("</system>").expect("a system") + "</system>".len();
    let mission = mission.replace(&mission[..end], r#"<armor version="1">"#);
    let mission = mission.replace("<mission ", r#"<mission system="s.xml" "#);
    let reading = read(Path::new("a.xml"), &mut |path| match path.to_str() {
        Some("a.xml") => Ok(mission.clone().into()),
        _ => Ok(system.into()),
    });
    let findings = check(reading, &[], None).findings;
    let codes: Vec<_> = findings.iter().map(|finding| finding.code.as_str()).collect();
    assert_eq!(codes, ["E0101"], "{}", findings.render(Colours::No));
}

#[test]
fn an_empty_system_besides_the_one_that_is_named_is_one_finding() {
    let system = with("");
    let start = system.find("<system>").expect("a system");
    let end = system.find("</system>").expect("a system") + "</system>".len();
    let mission = system.replace(&system[start..end], "<system name=\"q\"/>");
    let mission = mission.replace("<mission ", r#"<mission system="s.xml" "#);
    let system = format!(r#"<armor version="1">{}</armor>"#, &system[start..end]);
    let found = |is_there: bool| {
        let reading = read(Path::new("a.xml"), &mut |path| match path.to_str() {
            Some("a.xml") => Ok(mission.clone().into()),
            _ if is_there => Ok(system.clone().into()),
            _ => Err(std::io::ErrorKind::NotFound.into()),
        });
        let findings = check(reading, &[], Some(&kinds())).findings;
        let codes: Vec<_> = findings.iter().map(|finding| finding.code.as_str()).collect();
        (codes, findings.render(Colours::No))
    };
    let (codes, shown) = found(true);
    assert_eq!(codes, ["E0025"], "{shown}");
    let (codes, shown) = found(false);
    assert!(codes.contains(&"E0103") && !codes.contains(&"E0023"), "{shown}");
    assert!(shown.contains("add it: there is no component at all"), "{shown}");
}

#[test]
fn places_that_follow_from_an_unreached_one_are_one_finding() {
    // There and back: what leads to b starts from c, and what leads to c from b.
    let circle = r#"<place name="b" components="arm"/><place name="c"/><transition name="t" from="b" to="c" on="arm.done"/><transition name="u" from="c" to="b" timeout="9s"/><transition name="v" from="b" to="over" timeout="9s"/>"#;
    only(
        "W0212",
        "what leads to b starts from places that are never reached either",
        &with(circle),
    );
    only("W0212", "and here", &with(circle));
}

#[test]
fn from_and_to_exchanged_is_one_finding() {
    let turned = r#"<place name="b" components="arm"/><place name="c"/><transition name="t" from="a" to="b" on="go.failed"/><transition name="u" from="c" to="b" on="arm.done"/><transition name="v" from="b" to="over" timeout="9s"/>"#;
    only("W0214", r#"did you mean from="b" to="c"?"#, &with(turned));
    let other = r#"<place name="b" components="arm"/><transition name="t" from="a" to="b" on="go.failed"/><transition name="v" from="b" to="over" on="go.done"/>"#;
    only(
        "W0214",
        "name a component of the place: arm; or one of the places that activate go: a",
        &with(other),
    );
}

#[test]
fn a_transition_back_to_its_own_place_is_one_finding() {
    let content = r#"<place name="b"/><place name="c" components="arm"/><transition name="t" from="a" to="b" on="go.failed"/><transition name="u" from="b" to="b"/><transition name="v" from="c" to="over" on="arm.done"/>"#;
    only("W0222", "u puts the token back into b", &with(content));
    only("W0222", "write the place that it leads to", &with(content));
}

#[test]
fn a_failure_that_leads_to_the_goal_is_no_success() {
    let to = |place: &str| {
        with("")
            .replace(r#"components="go"/>"#, &format!(r#"components="go" on-failure="{place}"/>"#))
    };
    let shown = "after a failure in a, the mission ends in its goal over, as if it had succeeded";
    only("W0263", shown, &to("over"));
    let reading = read(Path::new("a.xml"), &mut |_| Ok(to("hold").into()));
    let found = check(reading, &[], Some(&kinds())).findings.without_notes();
    assert!(found.is_empty(), "{}", found.render(Colours::No));
}

#[test]
fn a_goal_that_is_the_safe_place_names_the_one_that_is_meant() {
    let file = with("").replace(r#"goal="over""#, r#"goal="hold""#);
    only("W0213", r#"did you mean goal="over"?"#, &file);
}

#[test]
fn a_question_that_puts_the_token_back_changes_nothing() {
    let place = r#"<place name="q" components="go"/><transition name="aside" from="a" to="q" operator="true"/><transition name="slow" from="q" to="hold" timeout="9min"/>"#;
    let ask = |to: &str| {
        with(&format!(
            r#"{place}<transition name="ask" from="q" to="{to}" autonomy="confirm" after="3s" answer-within="20s" unanswered="decline"/>"#
        ))
    };
    only(
        "W0281",
        "ask changes nothing: once the question is answered, it puts the token back into q",
        &ask("q"),
    );
    let idle = |to: &str| {
        with(&format!(
            r#"{}<transition name="again" from="q" to="{to}" operator="true"/>"#,
            place.replace(r#" components="go""#, "")
        ))
    };
    only("W0281", "again changes nothing: when the operator fires it, it puts", &idle("q"));
    for right in [ask("a"), idle("a")] {
        let reading = read(Path::new("a.xml"), &mut |_| Ok(right.clone().into()));
        let found = check(reading, &[], Some(&kinds())).findings.without_notes();
        assert!(found.is_empty(), "{}", found.render(Colours::No));
    }
}
