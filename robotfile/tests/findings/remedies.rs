//! What to write instead of a word or sign of another language, and slips that nothing else shows.

use super::follow_ups::{END, LATE, only, robot};

/// With its safe place.
fn with(content: &str) -> String {
    robot(r#"safe="hold""#, &format!("{END}{LATE}{content}"))
}

fn guard(text: &str) -> String {
    with(&format!(
        r#"<variable name="n" min="0" max="3"/><transition name="t" from="a" to="hold" on="go.failed" when="{text}"><set variable="n" value="n + 1"/></transition>"#
    ))
}

fn counted(value: &str) -> String {
    guard("n &lt; 3").replace("n + 1", value)
}

fn check(text: &str) -> String {
    let start = guard("n &lt; 3");
    start.replace("</mission>", &format!("<check>{text}</check></mission>"))
}

#[test]
fn a_decimal_comma_is_written_as_a_point() {
    only("E0230", "`11,5` is not a number", &guard("power.state.voltage &lt; 11,5V"));
    only("E0230", "did you mean 11.5V?", &guard("power.state.voltage &lt; 11,5V"));
    only("E0230", "did you mean 0.3?", &guard("n &lt; 0,3"));
    only("E0230", "write and or or between two conditions", &guard("n &lt; 3, n &gt; 1"));
    only("E0250", "did you mean 1.5min?", &check("duration(over or hold) &lt;= 1,5min"));
}

#[test]
fn words_for_comparisons_and_capital_letters_are_corrected() {
    for (word, sign) in [("lt", "&lt;"), ("GE", "&gt;="), ("eq", "=="), ("ne", "!=")] {
        only("E0230", &format!("did you mean {sign}?"), &guard(&format!("n {word} 3")));
    }
    only("E0230", "did you mean and?", &guard("n &lt; 3 AND n &gt; 0"));
    only("E0230", "did you mean or?", &guard("n &lt; 1 OR n &gt; 2"));
    only("E0250", "did you mean or?", &check("eventually over OR hold"));
}

#[test]
fn a_list_in_a_check_and_a_call_without_parentheses_are_corrected() {
    only("E0250", "write and or or between two conditions", &check("reachable(over, hold)"));
    let text = "put parentheses around what reachable is about: reachable(…)";
    only("E0250", text, &check("always reachable over or hold"));
}

#[test]
fn a_value_that_is_set_is_a_whole_number_or_a_variable() {
    only("E0238", "write n + 1 to count up by one", &counted("n++"));
    only("E0238", "or the variable before it to count up: round + 1", &counted("+1"));
    only("E0238", "a whole number or a variable that transitions set is expected", &counted("*"));
}

#[test]
fn a_text_without_quotes_is_one_of_the_field() {
    let file = guard("power.state.status == Full");
    only("E0231", "write it in single quotes: 'Full'", &file);
    let file = guard("power.state.status == Fulll");
    only("E0231", "there is no variable called Fulll", &file);
}

#[test]
fn places_in_an_exclusive_set_are_one_finding() {
    let file = with(r#"<exclusive components="a over"/>"#);
    only("E0103", "there is no component called a: a is a place", &file);
    only("E0103", "those of a: go", &file);
    let file = with(r#"<exclusive components="over hold"/>"#);
    only("E0103", "name components that must not be active together", &file);
}

#[test]
fn components_that_are_together_in_two_places_are_one_finding() {
    let places = r#"<place name="b" components="go arm"/><place name="c" components="go arm"/><exclusive components="go arm"/>"#;
    only("E0207", "arm would be active together with go", &with(places));
}

#[test]
fn a_check_outside_of_a_domain_is_decided_by_it() {
    only("W0236", "is always false: n is 0 to 3", &check("never n == 4"));
    only("W0236", "is always true: n is 0 to 3", &check("always n &lt; 5"));
    only("W0236", "is always false: n is 0 to 3", &check("a leads to 9 &lt;= n or over"));
    super::none(&check("never n == 3 and over").replace("kind=\"battery\"", "kind=\"k\""));
}

#[test]
fn on_stop_fail_where_nothing_stops_has_no_effect() {
    let place = |from: &str| {
        with(
            r#"<place name="b" components="arm"/><place name="c"/><transition name="t" from="a" to="b" on="go.failed"/><transition name="u" from="b" to="c" on="arm.done"/><transition name="v" from="c" to="over" timeout="2s"/>"#
        )
        .replace(&format!("name=\"{from}\""), &format!("name=\"{from}\" on-stop-fail=\"hold\""))
    };
    only("W0027", "on-stop-fail has no effect here", &place("v"));
    super::none(&place("u"));
}

#[test]
fn of_two_transitions_that_differ_in_their_names_one_is_to_be_removed() {
    let twice = r#"<transition name="t" from="a" to="hold" on="go.failed"/><transition name="u" from="a" to="hold" on="go.failed"/>"#;
    only("W0218", "t and u differ only in their names: remove one", &with(twice));
    let other = twice.replace(r#"name="u" from="a" to="hold""#, r#"name="u" from="a" to="over""#);
    only("W0218", r#"was on="go.done" meant for one of them?"#, &with(&other));
    let done = other.replace("failed", "done").replace(r#"to="hold" on"#, r#"to="a" on"#);
    let file = with(&done).replace(END, "");
    only("W0218", "give one of them another condition, or remove it", &file);
    let more = done.replace(
        r#"to="over" on="go.done"/>"#,
        r#"to="over" on="go.done"><read place="b"/></transition>"#,
    );
    let file = with(&format!(r#"<place name="b" initial="true"/>{more}"#)).replace(END, "");
    let (codes, text) = super::found_in(&file);
    assert!(codes.contains(&"W0218") && text.contains(r#"write priority="1" on u"#), "{text}");
}

#[test]
fn a_submission_that_is_included_twice_is_one_finding() {
    let inner = r#"<armor version="1"><mission goal="y" safe="z"><place name="x" initial="true"/><place name="y"/><place name="z"/><transition name="t" from="x" to="y" timeout="2s"/><transition name="u" from="x" to="z" operator="true"/></mission></armor>"#;
    let file = |second: &str| {
        with(&format!(
            r#"<place name="b"/><transition name="t" from="a" to="b" on="go.failed"/><submission ref="inner.xml" in="b" out="over"/><submission ref="inner.xml" {second}/>"#
        ))
    };
    let found = |file: &str| {
        let reading = armor_robotfile::read("a.xml".as_ref(), &mut |path| {
            Ok(if path.ends_with("inner.xml") { inner } else { file }.as_bytes().to_vec())
        });
        let findings = armor_robotfile::check(reading, &[], None).findings;
        let codes: Vec<_> = findings.iter().map(|finding| finding.code.as_str()).collect();
        (codes, findings.render(armor_robotfile::Colours::No))
    };
    let (codes, shown) = found(&file(r#"in="b" out="over""#));
    assert_eq!(codes, ["W0218"], "{shown}");
    assert!(shown.contains("is included twice with the same in and out"), "{shown}");
}

#[test]
fn a_list_as_in_other_languages_is_written_with_spaces() {
    let file = with("");
    let goal = |value: &str| file.replace(r#"goal="over""#, &format!(r#"goal="{value}""#));
    for value in ["[over]", "over,hold", "['over', 'hold']", "{over}", "over;hold"] {
        only("E0018", "one name is expected, without brackets", &goal(value));
    }
    only("E0018", "a name starts with a letter", &goal("over hold"));
    let file = with(r#"<exclusive components="['go', 'go2']"/>"#);
    only("E0019", r#"write components="go go2""#, &file);
}

#[test]
fn signs_and_words_in_another_order_or_joined_are_corrected() {
    only("E0230", "did you mean &lt;=?", &guard("n =&lt; 2"));
    only("E0230", "did you mean &gt;=?", &guard("n =&gt; 2"));
    only("E0238", "write the new value alone, such as count + 1", &counted("n += 1"));
    only("E0250", "did you mean leads to?", &check("a leads_to over or hold"));
    only("E0250", "did you mean leads to?", &check("a leadsTo over or hold"));
}

#[test]
fn a_beginning_of_a_field_is_completed_and_a_report_is_no_guard() {
    only("E0232", "did you mean voltage?", &guard("power.state.volt &lt; 11V"));
    only("E0106", "write on=\"go.done\" for a report", &guard("go.done"));
    only("E0106", "there are none", &guard("go.dnoe"));
}

#[test]
fn a_question_without_a_time_for_its_answer_lacks_only_that() {
    let asked =
        r#"<transition name="t" from="a" to="hold" autonomy="confirm" unanswered="decline"/>"#;
    only("W0027", "help: without a time the question waits", &with(asked));
    only(
        "W0027",
        "there is no question",
        &with(&asked.replace(" autonomy=\"confirm\"", " on=\"go.failed\"")),
    );
}

#[test]
fn an_element_in_the_wrong_place_is_answered_with_its_parent() {
    let link = r#"<link from="go.x" to="arm.y"/>"#;
    let file = with("").replace(
        r#"<component name="arm" kind="arm"/>"#,
        &format!(r#"<component name="arm" kind="arm">{link}</component>"#),
    );
    only("E0015", "write it directly in <system>: is an end tag missing or misplaced?", &file);
    let inside =
        with(&LATE.replace("/>", r#"><place name="q"/></transition>"#)).replacen(LATE, "", 1);
    only("E0015", "write it directly in <mission>", &inside);
}

#[test]
fn attributes_of_another_element_are_one_finding() {
    let place = with(r#"<place name="q" from="a" to="over" on="go.done"/>"#);
    only("E0016", "<place> has no attributes from, to, on", &place);
    only("E0016", "a <transition> has them: is this one meant?", &place);
    only("E0016", "<place> has no attribute colour", &with(r#"<place name="q" colour="red"/>"#));
}

#[test]
fn components_in_a_check_are_one_finding() {
    let both = r#"<place name="b" components="arm"/><transition name="t" from="a" to="b" on="go.failed"/><transition name="u" from="b" to="hold" timeout="9s"/>"#;
    let file = |check: &str| with(&format!("{both}<check>{check}</check>"));
    only("E0203", "write active(arm) and active(go)", &file("never go and arm"));
    only("E0203", "there is no place called go: go is a component", &file("never go and b"));
}

#[test]
fn two_initial_places_of_an_exclusive_set_are_named() {
    let file = with(
        r#"<place name="b" initial="true" components="arm"/><exclusive components="go arm"/><transition name="t" from="b" to="over" on="arm.done"/>"#,
    );
    only("E0207", "a and b are both initial", &file);
    only("E0207", r#"write initial="true" only on a or on b"#, &file);
}

#[test]
fn places_that_are_exchanged_are_proposed() {
    let file = with(
        r#"<place name="b" components="arm"/><transition name="in" from="a" to="b" on="go.failed"/><transition name="t" from="b" to="a" on="go.seen"/><transition name="u" from="b" to="over" on="arm.done"/>"#,
    );
    only("W0214", r#"did you mean from="a" to="b"? Otherwise, a frozen"#, &file);
}

#[test]
fn the_wrong_initial_place_is_named() {
    let file = with(
        r#"<place name="first" components="arm"/><transition name="t" from="first" to="a" on="arm.done"/>"#,
    );
    only("W0212", r#"write initial="true" on first, not on a, if the mission"#, &file);
}

#[test]
fn a_failure_is_answered_with_the_done_that_nothing_waits_for() {
    let failed = END.replace("done", "failed");
    let file = robot(r#"safe="hold""#, &format!("{failed}{LATE}"));
    only("W0277", r#"did you mean on="go.done"?"#, &file);
    // Another transition waits for its done, but does not lead to the goal.
    let done = r#"<place name="b" components="arm"/><transition name="v" from="a" to="b" on="go.done"/><transition name="u" from="b" to="a" timeout="9s"/>"#;
    let file = robot(r#"safe="hold""#, &format!("{failed}{LATE}{done}"));
    only("W0275", "end waits for go.failed", &file);
    only("W0275", r#"did you mean on="go.done"?"#, &file);
}

#[test]
fn the_done_of_another_component_of_the_place_was_meant() {
    let mut kinds = super::follow_ups::kinds();
    let mut wheels = kinds["arm"].clone();
    wheels.reports_done = false;
    kinds.insert("wheels".into(), wheels);
    let found = |on: &str| {
        let both = r#"<place name="b" components="arm wheels"/><transition name="t" from="a" to="b" on="go.failed"/>"#;
        let end = format!(r#"<transition name="u" from="b" to="over" on="{on}"/>"#);
        let late = r#"<transition name="v" from="b" to="hold" timeout="9s"/>"#;
        let file = robot(r#"safe="hold""#, &format!("{END}{LATE}{both}{end}{late}"));
        let wheels = r#"<component name="wheels" kind="wheels"/></system>"#;
        let file = file.replace("</system>", wheels);
        let reading = super::reading(&file, Some(&kinds)).0;
        let faults = reading.findings.without_notes();
        faults.iter().map(|it| format!("{} {}", it.code.as_str(), it.remedy)).collect::<Vec<_>>()
    };
    let wrong = found("wheels.failed");
    assert!(wrong.len() == 1 && wrong[0].starts_with("W0277"), "{wrong:?}");
    assert!(wrong[0].contains(r#"did you mean on="arm.done"?"#), "{wrong:?}");
    assert_eq!(found("arm.done"), Vec::<String>::new());
}

#[test]
fn a_sub_element_of_the_mission_in_the_system_is_no_clock() {
    let file = with("").replace("</system>", "<check>always a</check></system>");
    only("E0015", "write it directly in <mission>", &file);
}

#[test]
fn a_missing_to_is_the_place_that_nothing_leads_to() {
    let file = with(
        r#"<place name="b" components="arm"/><transition name="t" from="a" on="go.failed"/><transition name="u" from="b" to="hold" on="arm.done"/>"#,
    );
    only("W0271", r#"did you mean to="b"? Otherwise write"#, &file);
}

#[test]
fn a_component_that_is_together_with_several_of_a_set_does_not_belong_to_it() {
    let file = with(
        r#"<place name="b" components="arm go"/><place name="c" components="go third"/><exclusive components="arm third go"/><transition name="t" from="a" to="b" on="go.failed"/><transition name="u" from="b" to="c" on="arm.done"/><transition name="v" from="c" to="hold" on="third.done"/>"#,
    )
    .replace("</system>", r#"<component name="third" kind="arm"/></system>"#);
    only("E0207", "remove go from the exclusive set", &file);
}

#[test]
fn a_place_that_is_no_transition_is_reachable() {
    only("E0251", "a is a place: write reachable(a)", &with("<check>fires(a)</check>"));
}
