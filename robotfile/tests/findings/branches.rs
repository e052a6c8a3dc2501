//! Missions whose token is in two branches, and transitions that change nothing in them.

use super::follow_ups::{kinds, only};
use armor_robotfile::{Colours, check, read};

/// A patrol next to an arm; both places are left together.
const FORKED: &str = r#"<armor version="1"><system><component name="tour" kind="patrol" rate="5Hz"><parameter name="stay" value="2s"/></component><component name="arm" kind="arm"/><component name="power" kind="battery"/></system><mission goal="over" safe="hold"><variable name="n" min="0" max="2"/><variable name="level" source="power.state.level"/><place name="ready" initial="true"/><place name="north" components="tour"/><place name="south" components="tour"/><place name="lifted" components="arm"/><place name="seen"/><place name="over"/><place name="hold"/><transition name="begin" from="ready" to="north lifted" timeout="3s"/><transition name="turn" from="north" to="south seen" on="tour.done"/><transition name="again" from="south" to="north seen" on="tour.done" when="n &lt; 1"><set variable="n" value="n + 1"/></transition><transition name="enough" from="south lifted" to="over" on="tour.done" when="n == 1"/><transition name="weak-north" from="north lifted" to="hold" when="level &lt; 30 and power.state.voltage &gt; 5" priority="5"><reset place="seen"/></transition><transition name="weak-south" from="south lifted" to="hold" when="level &lt; 30" priority="5"><reset place="seen"/></transition><transition name="late-north" from="north lifted" to="hold" timeout="4min"/><transition name="late-south" from="south lifted" to="hold" timeout="4min"/></mission></armor>"#;

fn changed(right: &str, wrong: &str) -> String {
    assert_eq!(FORKED.matches(right).count(), 1, "{right}");
    FORKED.replace(right, wrong)
}

#[test]
fn the_mission_without_a_mistake_has_no_finding() {
    let reading = read("a.xml".as_ref(), &mut |_| Ok(FORKED.into()));
    let found = check(reading, &[], Some(&kinds())).findings.without_notes();
    assert!(found.is_empty(), "{}", found.render(Colours::No));
}

#[test]
fn a_join_that_waits_for_nothing_next_to_a_report_is_found() {
    let late = r#"from="south lifted" to="hold" timeout="4min""#;
    let shown = "late-south has no condition: it fires as soon as south is marked";
    only("W0272", shown, &changed(late, r#"from="south lifted" to="hold""#));
    // One that joins a token which comes later waits for that.
    let joined =
        r#"<place name="broken"/><transition name="give-up" from="broken lifted" to="hold"/>"#;
    let file = changed(r#"<place name="seen"/>"#, &format!(r#"<place name="seen"/>{joined}"#));
    let file = file
        .replace(r#"name="south" components"#, r#"name="south" on-failure="broken" components"#);
    let reading = read("a.xml".as_ref(), &mut |_| Ok(file.clone().into()));
    let found = check(reading, &[], Some(&kinds())).findings.without_notes();
    assert!(found.is_empty(), "{}", found.render(Colours::No));
}

#[test]
fn a_task_is_done_before_a_join_leaves_its_place() {
    let file = changed(r#"value="2s""#, r#"value="20min""#);
    only("W0279", "is not done before 20min, and late-north leaves north after 4min", &file);
}

#[test]
fn a_reset_of_the_only_token_that_is_taken_is_without_effect() {
    let file = changed(
        r#"when="level &lt; 30" priority="5"><reset place="seen"/>"#,
        r#"when="level &lt; 30" priority="5"><reset place="lifted"/>"#,
    );
    only("W0027", "weak-south takes the token from lifted, which has one at most", &file);
}

#[test]
fn of_two_transitions_that_do_the_same_one_changes_nothing() {
    let file = changed(r#""weak-south" from="south"#, r#""weak-south" from="north"#);
    only("W0283", "weak-north changes nothing: whenever", &file);
}

#[test]
fn a_variable_that_transitions_set_is_always_known() {
    let file = changed("power.state.voltage &gt; 5", "known(n)");
    only("W0236", "`known(n)` is always true: n follows no data", &file);
    let never = changed("power.state.voltage &gt; 5", "not known(n)");
    only("W0236", "`known(n)` is always true: n follows no data", &never);
}

#[test]
fn a_class_that_is_written_and_the_default_is_without_effect() {
    let file = changed(r#"<place name="hold"/>"#, r#"<place name="hold" class="normal"/>"#);
    only("W0027", r#"was class="safety" meant?"#, &file);
}
