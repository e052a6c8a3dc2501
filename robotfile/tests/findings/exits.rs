//! Transitions that fire too early or never, and those that end the mission too early.

use super::follow_ups::{END, LATE, only, robot};
use super::none;

#[test]
fn a_transition_that_ends_the_mission_begins_no_work() {
    let twice = |to: &str| {
        let place = r#"<place name="b" components="arm"/><transition name="t" from="b" to="hold" timeout="9s"/>"#;
        let to = END.replace("to=\"over\"", &format!("to=\"{to}\""));
        robot(
            r#"safe="hold""#,
            &format!(
                r#"{place}{to}<transition name="u" from="a" to="b" timeout="9s"/><transition name="v" from="b" to="over" on="arm.done"/>"#
            ),
        )
    };
    only("W0273", "end marks over, the goal, together with b", &twice("b over"));
    only("W0273", "end marks hold, the safe place, together with b", &twice("hold b"));
    none(&twice("over"));
}

#[test]
fn a_component_that_is_always_active_may_have_been_done_before() {
    let arm = |place: &str, of_arm: &str| {
        let b = format!(r#"<place name="b"{place}/>"#);
        let out = END.replace("to=\"over\"", "to=\"b\"");
        let content = format!(
            r#"{b}{out}{LATE}<transition name="t" from="b" to="over" on="arm.done"/><transition name="u" from="b" to="hold" timeout="9s"/>"#
        );
        robot(r#"safe="hold""#, &content).replace("kind=\"arm\"", &format!("kind=\"arm\"{of_arm}"))
    };
    only("W0274", "arm is in no place", &arm("", ""));
    none(&arm(r#" components="arm""#, ""));
    none(&arm("", r#" controllable="false""#));
}

#[test]
fn an_operator_is_never_too_late() {
    let by_hand = LATE.replace("/>", " operator=\"true\"/>");
    only(
        "W0027",
        "this latest time has no effect",
        &robot(r#"safe="hold""#, &format!("{END}{by_hand}")),
    );
    let after = by_hand.replace("timeout=", "after=");
    none(&robot(r#"safe="hold""#, &format!("{END}{after}")));
}

#[test]
fn a_report_with_a_time_loses_against_the_same_time_alone() {
    let both = r#"<transition name="t" from="a" to="hold" on="go.failed" timeout="60s"/>"#;
    only(
        "W0217",
        "t never fires: late always fires before it",
        &robot(r#"safe="hold""#, &format!("{END}{LATE}{both}")),
    );
}

#[test]
fn an_exit_without_a_condition_leaves_no_time_for_reports() {
    let passive = r#"<place name="b"/><transition name="t" from="b" to="a" on="free.done"/>"#;
    let into = r#"<transition name="u" from="a" to="b" on="go.failed"/>"#;
    let file = |exit: &str| {
        let free = r#"<component name="free" kind="arm" controllable="false"/></system>"#;
        let content = format!("{END}{LATE}{passive}{into}{exit}");
        robot(r#"safe="hold""#, &content).replace("</system>", free)
    };
    let plain = r#"<transition name="v" from="b" to="hold"/>"#;
    only("W0272", "v has no condition", &file(plain));
    none(&file(&plain.replace("/>", " operator=\"true\"/>")));
}

#[test]
fn an_exit_without_a_condition_leaves_no_time_for_an_operator() {
    let passive = r#"<place name="b"/><transition name="u" from="a" to="b" on="go.failed"/>"#;
    let asks = r#"<transition name="t" from="b" to="a" autonomy="confirm" answer-within="9s"/>"#;
    let file = |exit: &str| robot(r#"safe="hold""#, &format!("{END}{LATE}{passive}{asks}{exit}"));
    let plain = r#"<transition name="v" from="b" to="hold"/>"#;
    only("W0272", "as soon as b is marked, before t can", &file(plain));
    none(&file(&plain.replace("/>", " timeout=\"20s\"/>")));
}
