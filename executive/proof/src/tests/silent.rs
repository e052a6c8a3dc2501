//! Mistakes that the proof alone shows, and causes that it names: values that a variable never has, and
//! the transition that a trace or a time depends on.

use super::follow_ups::{BOTH, LATE, OUT, expect, expect_with, mission};

const FLAT: &str = r#"<transition name="flat" from="a" to="hold" when="go.o.x &lt; 1"/>"#;
const HOME: &str = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
const STOP: &str = r#"<transition name="stop" to="hold" operator="true" class="safety"/>"#;

fn rounds(enough: &str, value: &str) -> String {
    let content = format!(
        r#"<variable name="n" min="0" max="4"/><place name="c"/><transition name="out" from="a" to="c" on="go.done"/><transition name="again" from="c" to="a" when="n &lt; 2 and go.o.x &gt; 4"><set variable="n" value="{value}"/></transition><transition name="enough" from="c" to="b" when="{enough} or go.o.x &lt;= 4" priority="1"/><transition name="unsure" from="c" to="hold" timeout="30s"/>{HOME}{LATE}{FLAT}"#
    );
    mission(BOTH, &content)
}

#[test]
fn a_condition_that_no_value_meets_is_found_next_to_one_that_can_be_true() {
    expect(&rounds("n == 2", "n + 1"), &[], "");
    let never = "`n == 3` is never true where enough can fire: n is 0 or 1 or 2 there";
    expect(&rounds("n == 3", "n + 1"), &["W0255"], never);
    expect(&rounds("n == 2", "1"), &["W0255"], "n is 0 or 1 there");
    expect(&rounds("(n == 4 and go.o.y &lt; 2)", "n + 1"), &["W0255"], "never true");
    // One that only tests for more than it can be, and one under a not.
    expect(&rounds("n >= 2", "n + 1"), &[], "");
    expect(&rounds("not (n &lt; 2)", "n + 1"), &[], "");
}

#[test]
fn a_variable_that_is_set_to_what_it_is_never_changes() {
    for value in ["n", "0", "n * 1", "n * 2"] {
        expect(&rounds("n == 2", value), &["W0256"], "n never changes: again sets it to");
    }
    // Another transition changes it.
    let reset = r#"<transition name="reset" from="b" to="a" on="back.failed"><set variable="n" value="0"/></transition>"#;
    let file = rounds("n == 2", "n + 1").replace(LATE, &format!("{LATE}{reset}"));
    expect(&file, &[], "");
}

#[test]
fn what_only_waits_for_a_report_does_not_make_another_one_late() {
    // The whole mission is over before.
    let content = |late: &str| {
        format!(
            r#"<place name="s" initial="true"/><place name="c" components="back"/><place name="d"/><transition name="fork" from="s" to="a c" operator="true"/><transition name="done" from="a" to="home" on="go.done"/><transition name="low" from="a" to="hold" when="go.o.x &lt; 1"/><place name="e"/><transition name="late" from="a" to="e" timeout="{late}"/><transition name="rest" from="e" to="hold" operator="true"/><transition name="too-long" from="c" to="hold" timeout="40min"/><transition name="safe" from="c" to="d" on="back.done"/><transition name="on" from="d" to="hold" timeout="1s"/>"#
        )
    };
    let file = |late: &str| {
        mission(BOTH, &content(late))
            .replace(r#"name="a" initial="true""#, r#"name="a""#)
            .replace(r#"<place name="b" components="back"/>"#, "")
    };
    expect(&file("9min"), &[], "");
    expect(
        &file("9h"),
        &["W0217"],
        "late never fires in time: on or too-long always fires before it",
    );
}

#[test]
fn what_must_fire_is_named_and_not_an_emergency() {
    let early = r#"<transition name="early" from="a" to="hold" timeout="2s"/>"#;
    let waits = OUT.replace("on=", "after=\"5s\" on=");
    let file = mission(BOTH, &format!("{STOP}{waits}{HOME}{LATE}{early}"));
    expect(&file, &["E0241"], "early always fires before out can");
}

#[test]
fn a_sub_mission_that_begins_too_early_is_named() {
    let inner = r#"<mission name="in" goal="g" safe="s"><place name="p" initial="true" components="back"/><place name="g"/><place name="s"/><transition name="t" from="p" to="g" on="back.done"/><transition name="u" from="p" to="s" timeout="9s"/></mission>"#;
    let content = |enter: &str, rest: &str| {
        format!(
            r#"<place name="c"/><place name="d"/><transition name="out" from="a" to="c" on="go.done"/><transition name="slow" from="a" to="hold" timeout="9s"/><submission ref="inner.xml" in="{enter}" out="d"/><transition name="on" from="d" to="home" timeout="1s"/>{rest}"#
        )
    };
    let file = |enter: &str, rest: &str| {
        mission(BOTH, &content(enter, rest)).replace(r#"<place name="b" components="back"/>"#, "")
    };
    expect_with(&file("c", ""), inner, &[], "");
    let rest = r#"<transition name="x" from="c" to="hold" timeout="9s"/>"#;
    let shown = "inner.xml begins as soon as a is marked";
    expect_with(&file("a", rest), inner, &["W0217"], shown);
}

#[test]
fn a_check_that_fails_shows_the_firing_after_which_it_does() {
    let check = "<check>never home and b</check>";
    let file = |begin: &str, more: &str| {
        let content = format!(
            r#"<place name="s" initial="true"/><place name="f"/><transition name="begin" from="s" to="a b" operator="true"/><transition name="seen" from="a" to="{begin}" on="go.done"/><transition name="end" from="f" to="home" timeout="1s"/>{more}<transition name="slow" from="b" to="hold" timeout="9min"/>{check}"#
        );
        mission(BOTH, &content).replace(r#"name="a" initial="true""#, r#"name="a""#)
    };
    let shown = "this one leads there: it puts a token into home";
    expect(
        &file("home", r#"<transition name="x" from="b" to="f" on="back.done"/>"#),
        &["E0252"],
        shown,
    );
    let lost = r#"<transition name="x" from="b" to="f" on="back.done"/><transition name="lost" from="a" to="home" timeout="9s"/>"#;
    expect(&file("hold", lost), &["E0252"], "lead lost to another place");
    // The firing before put a token too many.
    let two = r#"<place name="e"/><transition name="y" from="e" to="hold" timeout="3s"/><transition name="x" from="b" to="f" on="back.done"/>"#;
    expect(&file("e f", two), &["E0252"], "this one puts a token into f, too");
    let failing = file("hold", r#"<transition name="x" from="b" to="f" on="back.done"/>"#)
        .replace(r#"name="a" components="go""#, r#"name="a" components="go" on-failure="home""#);
    expect(&failing, &["E0252"], "lead a/on-failure to another place");
}

/// Two branches that a transition joins; `saved` waits for the first one by this arc.
fn joined(arc: &str) -> String {
    let content = format!(
        r#"<place name="s" initial="true"/><place name="p"/><place name="f"/><transition name="begin" from="s" to="a b" operator="true"/><transition name="seen" from="a" to="p" on="go.done"/><transition name="saved" from="b" to="f" after="5s">{arc}</transition><transition name="end" from="p f" to="home"/><transition name="slow" from="a" to="hold" timeout="9min"/><transition name="slower" from="b" to="hold" timeout="90min"/>"#
    );
    mission(BOTH, &content).replace(r#"name="a" initial="true""#, r#"name="a""#)
}

#[test]
fn an_arc_that_takes_what_a_join_needs_is_named() {
    expect(&joined(r#"<read place="p"/>"#), &[], "");
    let meant = r#"did you mean <read place="p"/> in saved?"#;
    expect(&joined(r#"<arc from="p"/>"#), &["E0241"], meant);
    expect(&joined(r#"<reset place="p"/>"#), &["W0242"], meant);
    let weight = joined(r#"<read place="p" weight="2"/>"#);
    expect(&weight, &["E0241"], "saved needs 2 tokens in p, which holds at most 1");
}

/// A mission that repeats its first task as many times as `again` allows.
fn repeated(again: &str, enough: &str) -> String {
    let content = format!(
        r#"<variable name="n" min="0" max="2"/><transition name="again" from="a" to="a" on="go.done" when="{again}"><set variable="n" value="n + 1"/></transition>{enough}<transition name="late" from="a" to="b" timeout="60s"/><transition name="in" from="b" to="home" on="back.done"/><transition name="stay" from="b" to="hold" timeout="9s"/>"#
    );
    mission(BOTH, &content)
}

#[test]
fn the_end_of_a_task_that_is_not_waited_for_with_some_value_is_reported() {
    let enough = r#"<transition name="enough" from="a" to="b" on="go.done" when="n == 2"/>"#;
    expect(&repeated("n &lt; 2", enough), &[], "");
    expect(
        &repeated("n &lt; 2", ""),
        &["W0284"],
        "no transition waits in a for the end of go: n is 2",
    );
    // Another transition decides then.
    for decides in [
        r#"<transition name="enough" from="a" to="b" on="back.done" when="n == 2"/>"#,
        r#"<transition name="enough" from="a" to="b" on="go.lap" when="n == 2"/>"#,
        r#"<transition name="enough" from="a" to="b" operator="true" when="n == 2"/>"#,
    ] {
        let file =
            repeated("n &lt; 2", decides).replace(r#"components="go""#, r#"components="go back""#);
        expect(&file, &[], "");
    }
}
