//! What was forgotten or taken for something else in a mission, and what its finding advises.

use super::follow_ups::{BOTH, LATE, OUT, expect, mission};

const HOME: &str = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;

#[test]
fn guards_that_overlap_on_one_report_leave_the_choice_to_the_order() {
    let rounds = |again: &str, enough: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="3"/>{OUT}<transition name="again" from="b" to="a" on="back.done" {again}><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="home" on="back.done" {enough}/>"#
        );
        mission(BOTH, &(content + LATE))
    };
    let (less, two) = (r#"when="n &lt; 2""#, r#"when="n == 2""#);
    expect(&rounds(less, two), &[], "");
    expect(&rounds(less, ""), &["W0218"], "again and enough can fire at the same moment");
    expect(&rounds(r#"when="n &lt;= 2""#, two), &["W0218"], "let their guards exclude each other");
    expect(&rounds(less, r#"priority="-1""#), &[], "");
    // No run comes to three rounds.
    expect(&rounds(less, r#"when="n == 2 or n == 3""#), &[], "");
}

#[test]
fn of_two_for_one_report_the_proof_fires_the_one_with_priority() {
    let rounds = |again: &str, enough: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="3"/>{OUT}<transition name="again" from="b" to="a" on="back.done" {again}><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="home" on="back.done" {enough}/>"#
        );
        mission(BOTH, &(content + LATE))
    };
    let two = r#"when="n == 2""#;
    expect(&rounds("", two), &["E0254"], "or let enough fire first: priority=\"1\" on it");
    expect(&rounds("", &format!("{two} priority=\"1\"")), &[], "");
    expect(&rounds("", &format!("{two} class=\"safety\"")), &[], "");
    // One that needs a further token does not always fire.
    let more = format!("{two} priority=\"1\"><read place=\"hold\"/></transition");
    let file = rounds("", "").replace("on=\"back.done\" />", &format!("on=\"back.done\" {more}>"));
    expect(&file, &["E0254"], "again would set n to 4");
    // Nor does one that waits for data or for a person.
    expect(&rounds("", &format!("{two} priority=\"1\" after=\"1s\"")), &["E0254"], "n to 4");
    let asks = format!("{two} priority=\"1\" autonomy=\"confirm\"");
    expect(&rounds("", &asks), &["E0254"], "again would set n to 4");
    let never = "enough never fires: again has the higher priority";
    let less = r#"when="n &lt; 3" priority="1""#;
    expect(&rounds(less, r#"when="n &lt;= 2""#), &["E0241"], never);
    expect(&rounds(less, r#"when="n == 3""#), &[], "");
}

#[test]
fn a_guard_that_nothing_changes_in_the_place_does_not_wait() {
    let rounds = |enough: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="2"/>{OUT}<transition name="again" from="b" to="a" on="back.done" when="n &lt; 2"><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="home" {enough} when="n == 2"/>"#
        );
        mission(BOTH, &(content + LATE))
    };
    expect(&rounds(r#"on="back.done""#), &[], "");
    expect(&rounds(""), &["W0272"], "enough waits for nothing: where `n == 2` is true");
    expect(&rounds(r#"after="1s""#), &[], "");
    let ticks = r#"<transition name="tick" from="b" to="b" after="1s"><set variable="n" value="2"/></transition></mission>"#;
    let counted = rounds("").replace("</mission>", ticks);
    expect(&counted.replace(LATE, ""), &[], "");
}

#[test]
fn what_sets_a_variable_while_a_place_has_no_token_does_not_change_it_there() {
    let rounds = |again: &str, enough: &str, more: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="3"/><place name="c"/>{OUT}<transition name="again" from="b" to="a" {again}><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="c" on="back.done" {enough}/><transition name="more" from="c" to="a" operator="true" when="n &lt; 3"><set variable="n" value="n + 1"/></transition><transition name="end" from="c" to="home" timeout="20s"/>{more}"#
        );
        mission(BOTH, &(content + LATE))
    };
    let (less, least) = (r#"on="back.done" when="n &lt; 1""#, r#"when="n &gt;= 1""#);
    expect(&rounds(less, least, ""), &[], "");
    let forgotten = rounds(r#"when="n &lt; 1""#, least, "");
    expect(&forgotten, &["W0272"], "again waits for nothing: where `n < 1` is true");
    let equal = r#"when="n == 1""#;
    expect(&rounds(less, equal, ""), &["W0284"], "for the end of back: n is 2");
    // A second token changes it in the meantime.
    let parallel = r#"<place name="d" initial="true"/><transition name="tick" from="d" to="d" timeout="9s"><set variable="n" value="3"/></transition>"#;
    let file = rounds(r#"when="n &gt; 2""#, r#"when="n &lt;= 2""#, parallel);
    let (codes, text) = super::follow_ups::found_in(&file, "");
    assert!(!codes.contains(&"W0272".to_owned()), "{text}");
}

#[test]
fn from_takes_a_token_from_each_of_its_places() {
    let either = r#"<transition name="weak" from="a b" to="hold" on="go.failed"/>"#;
    let file = mission(BOTH, &format!("{OUT}{HOME}{LATE}{either}"));
    expect(&file, &["W0217"], "a token from each of a and b, which are never marked together");
    let late = either.replace(r#"on="go.failed""#, r#"timeout="60s""#);
    let file = mission(BOTH, &format!("{OUT}{HOME}{late}{LATE}"));
    expect(&file, &["W0217"], "write one transition for each");
}

#[test]
fn a_time_out_that_leads_nowhere_is_one_finding_also_without_components() {
    let file = |end: &str, checks: &str| {
        let passive = format!(
            r#"<place name="c"/><transition name="ask" from="b" to="c" on="back.failed"/><transition name="yes" from="c" to="home" operator="true"/><transition name="no" from="c" {end} timeout="9s"/>"#
        );
        mission(BOTH, &format!("{OUT}{HOME}{LATE}{passive}{checks}"))
    };
    let checks =
        "<check>always reachable(home or hold)</check><check>a leads to home or hold</check>";
    expect(&file("to=\"hold\"", checks), &[], "");
    expect(&file("", ""), &["W0271"], "no takes the token from c and puts it into no place");
    expect(&file("", checks), &["E0252"], "write to=\"…\"");
}

#[test]
fn a_place_from_which_others_are_reached_was_to_be_initial() {
    let file = mission(BOTH, &format!("{OUT}{HOME}{LATE}<check>fires(out)</check>"));
    expect(&file, &[], "");
    let other = r#"<place name="x" initial="true"/><transition name="y" from="x" to="hold" timeout="9s"/></mission>"#;
    let forgotten = file.replace(r#" initial="true""#, "").replace("</mission>", other);
    expect(&forgotten, &["E0241"], " if the mission begins in it");
    expect(&forgotten, &["E0241"], "this check fails, too");
}

#[test]
fn a_variable_that_nothing_sets_is_why_the_goal_is_never_reached() {
    let content = r#"<variable name="n" min="0" max="1"/>"#;
    let out = OUT.replace("/>", r#" when="n == 1"/>"#);
    let away = r#"<transition name="away" from="a" to="hold" timeout="9s"/>"#;
    let file = mission(BOTH, &format!("{content}{out}{HOME}{LATE}{away}<check>fires(in)</check>"));
    expect(&file, &["E0241"], "no transition sets n, so its value never changes");
    expect(&file, &["E0241"], "or make it follow data");
}
