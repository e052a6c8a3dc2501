//! Mistakes that passed in silence, or whose first remedy led away from them.

use super::follow_ups::{END, LATE, kinds, only, robot};
use super::{reading, system};

/// The codes of a file's findings, apart from notes.
fn codes(file: &str) -> Vec<&'static str> {
    let (reading, _) = reading(file, Some(&kinds()));
    let found = reading.findings.without_notes();
    found.iter().map(|it| it.code.as_str()).collect()
}

fn is_clean(file: &str) {
    assert_eq!(codes(file), [""; 0], "{file}");
}

#[test]
fn a_component_that_is_used_in_many_places_is_to_be_declared() {
    let file = |name: &str, links: &str| {
        system(&format!(
            r#"<component name="laser" kind="laser"/><component name="{name}" kind="relay"/><component name="mapper" kind="mapper"/>{links}"#
        ))
    };
    let through = r#"<link from="laser.scan" to="writer.in"/><link from="writer.out" to="mapper.scan"/><link from="writer.out" to="driver.in"/>"#;
    // Nothing but the declaration has the similar name.
    let unused = through.replace(r#"<link from="writer.out" to="driver.in"/>"#, "");
    let text = "nothing names the component driver, and there is no component called writer";
    only("E0103", text, &file("driver", &unused));
    let text = r#"declare it: <component name="writer" kind="relay"/>; or is driver meant"#;
    only("E0103", text, &file("driver", through));
    // One mention of a name is a misspelt one.
    let once =
        r#"<link from="laser.scan" to="driver.in"/><link from="writer.out" to="mapper.scan"/>"#;
    only("E0103", "did you mean driver?", &file("driver", once));
}

#[test]
fn a_component_that_is_called_like_another_kind_has_probably_that_kind() {
    let file = |name: &str, kind: &str| {
        system(&format!(
            r#"<component name="{name}" kind="{kind}"/><component name="mapper" kind="mapper"/><link from="{name}.scan" to="mapper.scan"/>"#
        ))
    };
    is_clean(&file("laser", "laser"));
    only("E0111", "did you mean kind=\"laser\"? Otherwise give it file", &file("laser", "player"));
    only("E0111", "front has no value for file", &file("front", "player"));
}

#[test]
fn a_component_that_is_never_done_is_not_proposed() {
    let file = |components: &str| {
        let world = r#"<component name="world" kind="world" rate="10Hz"/></system>"#;
        let end = END.replace("go.done", "world.failed");
        let done = r#"<place name="b" components="arm"/><transition name="v" from="a" to="b" on="go.done"/><transition name="u" from="b" to="a" timeout="9s"/>"#;
        let file = robot(r#"safe="hold""#, &format!("{end}{LATE}{done}"));
        let place = format!(r#"initial="true" components="{components}""#);
        file.replace("</system>", world).replace(r#"initial="true" components="go""#, &place)
    };
    only("W0275", r#"did you mean on="go.done"?"#, &file("world go"));
    let alone = file("world").replace(r#" on="go.done""#, r#" operator="true""#);
    only("W0275", "= help: add a transition that leads to over", &alone);
}

#[test]
fn a_report_of_another_place_names_the_components_of_this_one() {
    let content = |on: &str| {
        robot(
            r#"safe="hold""#,
            &format!(
                r#"<place name="b" components="arm"/><transition name="next" from="a" to="b" on="{on}"/><transition name="end" from="b" to="over" on="arm.done"/>{LATE}<transition name="slow" from="b" to="hold" timeout="9s"/>"#
            ),
        )
    };
    is_clean(&content("go.done"));
    let text = "name a component of the place: go; or one of the places that activate arm: b";
    only("W0214", text, &content("arm.done"));
    // The place in which it is active.
    let file = content("go.done")
        .replace(r#"initial="true" components="go""#, r#"initial="true" components="lamp""#);
    let file = file.replace("</system>", r#"<component name="lamp" kind="lamp"/></system>"#).replace(
        "</mission>",
        r#"<place name="c" components="go"/><transition name="in" from="a" to="c" on="lamp.failed"/><transition name="on" from="c" to="over" timeout="9s"/></mission>"#,
    );
    only("W0214", "one of the places that activate go: c", &file);
}

#[test]
fn a_guard_over_a_count_that_is_true_at_first_waits_for_nothing() {
    let rounds = |condition: &str, initial: &str| {
        robot(
            r#"safe="hold""#,
            &format!(
                r#"<variable name="n" min="0" max="3" initial="{initial}"/><transition name="again" from="a" to="a" {condition}><set variable="n" value="n + 1"/></transition><transition name="end" from="a" to="over" on="go.done" when="n == 2"><set variable="n" value="3"/></transition>{LATE}"#
            ),
        )
    };
    is_clean(&rounds(r#"on="go.done" when="n &lt; 2""#, "0"));
    only("W0272", r#"write on="go.done""#, &rounds(r#"when="n &lt; 2""#, "0"));
    // It is not true before the task has been done.
    let later = rounds(r#"when="n == 3""#, "0");
    assert!(!codes(&later).contains(&"W0272"), "{later}");
}

#[test]
fn a_guard_that_must_be_true_as_long_as_another_transition_waits() {
    let file = |condition: &str| {
        robot(
            r#"safe="hold""#,
            &format!(
                r#"{LATE}<transition name="full" from="a" to="over" when="power.state.level &gt; 90%" {condition}/>"#
            ),
        )
    };
    is_clean(&file(r#"after="50s""#));
    only("W0218", "late leaves the place at that moment", &file(r#"after="60s""#));
    only("W0217", "late always fires before it", &file(r#"after="61s""#));
    is_clean(&file(r#"after="60s" priority="1""#));
}

#[test]
fn two_comparisons_that_leave_out_one_number_are_almost_always_true() {
    let file = |guard: &str| {
        robot(
            r#"safe="hold""#,
            &format!(r#"{END}{LATE}<transition name="weak" from="a" to="hold" when="{guard}"/>"#),
        )
    };
    let (low, high) = ("power.state.level &lt; 40%", "power.state.level &gt; 40%");
    only("W0268", "is almost always true", &file(&format!("{low} or {high}")));
    only("W0268", "is almost always true", &file(&format!("{high} or {low}")));
    let both = format!("{low} and {high}").replace("&lt;", "&lt;=").replace("&gt;", "&gt;=");
    only("W0268", "is almost always false", &file(&both));
    is_clean(&file(&format!("{low} or {}", high.replace("40", "60"))));
}

#[test]
fn a_component_that_passes_on_and_leads_nowhere_is_unused() {
    let file = |link: &str| {
        system(&format!(
            r#"<component name="laser" kind="laser" rate="5Hz"/><component name="board" kind="board" rate="5Hz"/><component name="base" kind="base" rate="5Hz"/><component name="mapper" kind="mapper"/><link from="laser.scan" to="board.writers"/><link from="base.scan" to="mapper.scan"/>{link}"#
        ))
    };
    is_clean(&file(r#"<link from="board.element" to="base.way"/>"#));
    let text = r#"<link from="board.element" to="base.way"/>"#;
    only("W0135", text, &file(""));
    // Without an input that takes such data, it may be there to be looked at.
    let taken =
        r#"<component name="rear" kind="laser" rate="5Hz"/><link from="rear.scan" to="base.way"/>"#;
    is_clean(&file(taken));
}

#[test]
fn a_rate_that_is_too_low_behind_a_component_that_passes_on() {
    let file = |rate: &str| {
        system(&format!(
            r#"<component name="tracker" kind="tracker"/><component name="pilot" kind="pilot" rate="{rate}"/><component name="board" kind="board" rate="0.1Hz"/><component name="world" kind="world"/><link from="tracker.pose" to="pilot.pose"/><link from="pilot.velocity" to="board.writers"/><link from="board.element" to="world.velocity"/>"#
        ))
    };
    is_clean(&file("10Hz"));
    let text = "world takes pilot.velocity, which board passes on, for missing after 0.5 s";
    only("W0142", text, &file("1Hz"));
}

#[test]
fn a_rate_far_above_the_steps_of_time_is_too_high() {
    let file = |rate: &str| {
        system(&format!(
            r#"<component name="tracker" kind="tracker"/><component name="pilot" kind="pilot" rate="{rate}"/><component name="world" kind="world" rate="100Hz"/><link from="tracker.pose" to="pilot.pose"/><link from="pilot.velocity" to="world.velocity"/><clock source="world.clock"/>"#
        ))
    };
    is_clean(&file("1kHz"));
    let both = file("5kHz").replace(r#"kind="tracker""#, r#"kind="tracker" rate="5kHz""#);
    only("W0132", "pilot is called at these steps", &both);
    only("W0132", "time follows world.clock", &file("5kHz"));
    only("W0132", "write at most 10kHz", &file("50kHz"));
    is_clean(&file("5kHz").replace(r#"<clock source="world.clock"/>"#, ""));
}
