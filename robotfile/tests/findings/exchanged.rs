//! Names that were exchanged with those of another element, and what one such mistake leads to: one
//! finding, which names the exchange.

use super::follow_ups::{END, LATE, only, robot};
use super::{found_in, mission, one, system};

/// With its safe place.
fn with(content: &str) -> String {
    robot(r#"safe="hold""#, &format!("{END}{LATE}{content}"))
}

#[test]
fn two_exchanged_kinds_are_one_finding() {
    let file = |pilot: &str, world: &str| {
        system(&format!(
            r#"<component name="p" kind="{pilot}" rate="10Hz"/><component name="w" kind="{world}" rate="10Hz"><parameter name="speed" value="1"/></component><component name="t" kind="tracker" rate="10Hz"/><link from="t.pose" to="p.pose"/><link from="p.velocity" to="w.velocity"/>"#
        ))
    };
    assert_eq!(codes(&file("pilot", "world")), [""; 0]);
    only("E0106", "the kinds of p and w seem to be exchanged", &file("world", "pilot"));
    only("E0106", r#"kind="pilot" here and kind="world" for w"#, &file("world", "pilot"));
}

#[test]
fn two_exchanged_names_are_one_finding() {
    let file = |first: &str, second: &str| {
        system(&format!(
            r#"<component name="{first}" kind="pilot" rate="10Hz"/><component name="{second}" kind="world" rate="10Hz"><parameter name="speed" value="1"/></component><component name="t" kind="tracker" rate="10Hz"/><link from="t.pose" to="p.pose"/><link from="p.velocity" to="w.velocity"/>"#
        ))
    };
    assert_eq!(codes(&file("p", "w")), [""; 0]);
    only("E0106", "the names of w and p seem to be exchanged", &file("w", "p"));
    only("E0106", r#"name="p" here and name="w" for the other one"#, &file("w", "p"));
}

#[test]
fn an_unknown_kind_is_the_one_that_has_all_that_is_used() {
    let tour = r#"<component name="tour" kind="wanderer"><parameter name="route" value="1,2"/><parameter name="stay" value="2s"/></component>"#;
    let file = robot(r#"safe="hold""#, &format!("{END}{LATE}"));
    let file = file.replace("</system>", &format!("{tour}</system>"));
    only("E0105", "did you mean patrol? It has all that tour uses", &file);
}

#[test]
fn a_kind_that_needs_a_parameter_may_be_another_one() {
    let file = system(
        r#"<component name="l" kind="player" rate="10Hz"/><component name="m" kind="mapper"/><link from="l.scan" to="m.scan"/>"#,
    );
    let mut kinds = super::follow_ups::kinds();
    kinds.retain(|name, _| ["player", "laser", "mapper"].contains(&name.as_str()));
    let reading = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(file.clone().into()));
    let found = armor_robotfile::check(reading, &[], Some(&kinds)).findings;
    let text = found.render(armor_robotfile::Colours::No);
    assert!(text.contains(r#"or did you mean kind="laser"? It has all that l uses"#), "{text}");
}

#[test]
fn the_reports_of_an_exchanged_kind_are_not_missing_too() {
    let file = with("").replace(
        r#"<component name="go" kind="explorer"/>"#,
        r#"<component name="go" kind="world"><parameter name="area" value="x"/></component><component name="w" kind="explorer"><parameter name="speed" value="1"/></component>"#,
    );
    only("E0106", "the kinds of go and w seem to be exchanged", &file);
}

#[test]
fn an_exchanged_kind_may_lack_only_what_it_needs() {
    let file = |first: &str, second: &str| {
        system(&format!(
            r#"<component name="l" kind="{first}" rate="10Hz"/><component name="p" kind="{second}"><parameter name="file" value="x"/></component><component name="r" kind="recorder"/><component name="s" kind="recorder"/><link from="l.scan" to="r.scan"/><link from="p.scan" to="s.scan"/>"#
        ))
    };
    assert_eq!(codes(&file("base", "player")), [""; 0]);
    only("E0106", "the kinds of p and l seem to be exchanged", &file("player", "base"));
}

#[test]
fn a_kind_that_lacks_a_port_and_needs_another_is_one_finding() {
    let file = |kind: &str| {
        system(&format!(
            r#"<component name="t" kind="tracker" rate="10Hz"/><component name="pilots" kind="{kind}"/><link from="t.pose" to="pilots.pose"/>"#
        ))
    };
    assert_eq!(codes(&file("judge")), [""; 0]);
    // A judge takes a pose, too: the name decides.
    only("E0106", r#"did you mean kind="pilot"?"#, &file("cartographer"));
    only("E0106", "no port called pose, and needs scan; a pilot has all", &file("cartographer"));
    // Without such a name, both are possible.
    let other = file("cartographer").replace("pilots", "x");
    only("E0106", "there is no input of cartographer called pose", &other);
}

#[test]
fn the_data_of_a_wrong_kind_are_not_missing_in_guards_too() {
    let file = |kind: &str| {
        with(r#"<variable name="level" source="power.state.level" min="0" max="1"/><transition name="weak" from="a" to="hold" when="level &lt; 30% and power.state.level &gt; 1%"/>"#)
            .replace(r#"kind="battery""#, &format!(r#"kind="{kind}""#))
    };
    assert_eq!(codes(&file("battery")), [""; 0]);
    only("E0106", r#"did you mean kind="battery"?"#, &file("cartographer"));
}

#[test]
fn the_places_of_a_sub_mission_may_be_exchanged() {
    let file = |enter: &str, leave: &str| {
        mission(&format!(
            r#"<place name="b"/><place name="c"/><transition name="there" from="a" to="b" timeout="5s"/><transition name="past" from="a" to="c" timeout="9s"/><submission ref="inner.xml" in="{enter}" out="{leave}"/><transition name="on" from="c" to="over" timeout="5s"/>"#
        ))
    };
    let inner = r#"<mission name="in" goal="g" safe="s"><place name="p" initial="true" components="stop"/><place name="g"/><place name="s"/><transition name="t" from="p" to="g" on="stop.done"/><transition name="u" from="p" to="s" timeout="9s"/></mission>"#;
    let found = |enter: &str, leave: &str| super::one_cause::with_inner(&file(enter, leave), inner);
    let (codes, text) = found("c", "b");
    assert!(codes.contains(&"W0217"), "{text}");
    assert!(text.contains(r#"did you mean in="b" out="c"?"#), "{text}");
    let (_, text) = found("b", "c");
    assert!(!text.contains("did you mean in="), "{text}");
}

#[test]
fn from_and_to_of_a_timeout_may_be_exchanged() {
    let file = |from: &str, to: &str| {
        with(&format!(
            r#"<place name="b" components="arm"/><place name="c"/><transition name="t" from="a" to="b" on="go.packed"/><transition name="u" from="b" to="c" on="arm.done"/><transition name="v" from="b" to="hold" timeout="90s"/><transition name="w" from="{from}" to="{to}" timeout="5s"/>"#
        ))
    };
    assert_eq!(codes(&file("c", "b")), [""; 0]);
    only("W0217", r#"did you mean from="c" to="b" in w?"#, &file("b", "c"));
    // That place has a time of its own.
    let timed = file("b", "c").replace(
        r#"<place name="c"/>"#,
        r#"<place name="c"/><transition name="x" from="c" to="a" timeout="9s"/>"#,
    );
    only("W0217", "= help: give one of the two another condition", &timed);
}

#[test]
fn a_failure_under_the_guard_of_an_end_is_probably_an_end() {
    let file = |first: &str, second: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="3"/><place name="b" components="arm"/><place name="c"/>
            <transition name="t" from="a" to="b" on="go.packed"><set variable="n" value="1"/></transition>
            <transition name="again" from="b" to="c" on="arm.{first}" when="n &lt; 2"/>
            <transition name="enough" from="b" to="over" on="arm.{second}" when="n >= 2"/>
            <transition name="v" from="b" to="hold" timeout="90s"/><transition name="w" from="c" to="b" timeout="5s"/>"#
        );
        with(&content)
    };
    assert_eq!(codes(&file("done", "done")), [""; 0]);
    only("W0277", r#"did you mean on="arm.done"?"#, &file("failed", "done"));
    only("W0277", "again waits in b for a failure of arm where `n < 2`", &file("failed", "done"));
    only("W0277", "enough waits in b for a failure", &file("done", "failed"));
    // Both are decided for both reports.
    let all = file("done", "done").replace(
        r#"<transition name="v""#,
        r#"<transition name="retry" from="b" to="c" on="arm.failed" when="n &lt; 2"/><transition name="v""#,
    );
    assert_eq!(codes(&all), [""; 0]);
}

#[test]
fn a_failure_leads_to_the_goal_and_an_event_to_the_safe_place_only_if_both_are_exchanged() {
    let ends = r#"<transition name="end" from="a" to="over" on="go.packed"/><transition name="broken" from="a" to="hold" on="go.failed"/>"#;
    let file = robot(r#"safe="hold""#, &format!("{ends}{LATE}"));
    assert_eq!(codes(&file), [""; 0]);
    let exchanged = file.replace(r#"goal="over" safe="hold""#, r#"goal="hold" safe="over""#);
    only("W0276", r#"did you mean goal="over" safe="hold"?"#, &exchanged);
    // A round that ends with its time, or in safety on an event.
    let timed = r#"<transition name="full" from="a" to="hold" on="go.packed"/><transition name="enough" from="a" to="over" timeout="60s"/>"#;
    assert_eq!(codes(&robot(r#"safe="hold""#, timed)), [""; 0]);
}

#[test]
fn the_place_of_class_safety_is_not_the_goal() {
    let end = r#"<transition name="end" from="a" to="over" on="go.packed"/>"#;
    let plain = r#"<place name="hold"/>"#;
    let file = |place: &str| robot(r#"safe="hold""#, &format!("{end}{LATE}")).replace(plain, place);
    let exchange =
        |file: String| file.replace(r#"goal="over" safe="hold""#, r#"goal="hold" safe="over""#);
    let safety = file(r#"<place name="hold" class="safety"/>"#);
    assert!(safety != file(plain), "the place is marked");
    assert_eq!(codes(&safety), [""; 0]);
    only("W0276", r#"did you mean goal="over" safe="hold"?"#, &exchange(safety));
}

#[test]
fn a_component_that_excludes_several_of_its_place_is_one_finding() {
    let exclusive = r#"<exclusive components="go arm"/><exclusive components="go third"/>"#;
    let file = |components: &str| {
        with(&format!(
            r#"<place name="b" components="{components}"/>{exclusive}<transition name="t" from="a" to="b" on="go.packed"/><transition name="u" from="b" to="hold" on="arm.done"/>"#
        ))
        .replace("</system>", r#"<component name="third" kind="arm"/></system>"#)
    };
    assert_eq!(codes(&file("arm third")), [""; 0]);
    only("E0207", "remove go from the components of b", &file("arm third go"));
    // A second place that is initial.
    let initial = file("arm third").replace(r#"name="b""#, r#"name="b" initial="true""#);
    only("E0207", r#"write initial="true" only on a or on b"#, &initial);
}

#[test]
fn a_place_without_its_components_is_one_finding() {
    let file = |components: &str| {
        with(&format!(
            r#"<place name="b" {components} on-failure="hold"><parameter component="arm" name="grip" value="1"/></place><exclusive components="go arm"/><transition name="t" from="a" to="b" on="go.packed"/><transition name="u" from="b" to="hold" on="arm.done"/>"#
        ))
    };
    let (codes, text) = found_in(&file(r#"components="arm""#));
    assert_eq!(codes, [""; 0], "{text}");
    let checked =
        file("").replace("</mission>", "<check>never active(arm) and active(go)</check></mission>");
    one("E0209", &checked);
    one("E0209", &file("").replace(r#"component="arm""#, r#"component="[[arm]]""#));
}

#[test]
fn a_guard_that_was_deleted_is_one_finding() {
    let level = r#"<variable name="level" source="power.state.level" min="0" max="1"/>"#;
    let file = |condition: &str| {
        with(&format!(r#"{level}<transition name="weak" from="a" to="hold" {condition}/>"#))
    };
    assert_eq!(codes(&file(r#"when="level &lt; 30%""#)), [""; 0]);
    only("W0272", "no guard uses this variable", &file(""));
    assert_eq!(codes(&file(r#"when="level &lt; 30%" after="10s""#)), [""; 0]);
    only("W0272", "weak waits for nothing but its earliest time", &file(r#"after="10s""#));
    only("W0272", r#"or timeout="10s" if it fires"#, &file(r#"after="10s""#));
    assert_eq!(codes(&file(r#"when="level &lt; 30%" after="10s" operator="true""#)), [""; 0]);
}

#[test]
fn a_parameter_of_another_component_names_it() {
    let file = |first: &str, second: &str| {
        system(&format!(
            r#"<component name="l" kind="laser">{first}</component><component name="e" kind="explorer">{second}</component>"#
        ))
    };
    let area = r#"<parameter name="area" value="x"/>"#;
    only("E0110", "was it meant for e? Otherwise", &file(area, ""));
    only("E0110", "was it meant for e, which has a value for it already?", &file(area, area));
}

#[test]
fn a_circle_that_no_rate_starts_is_never_called() {
    let file = |rate: &str| {
        system(&format!(
            r#"<component name="one" kind="relay"/><component name="two" kind="relay"{rate}/><component name="third" kind="relay"/><link from="one.out" to="two.in"/><link from="two.out" to="one.in"/><link from="two.out" to="third.in"/>"#
        ))
    };
    assert_eq!(codes(&file(r#" rate="5Hz""#)), [""; 0]);
    only("W0120", "nothing calls one, two: they have no rate", &file(""));
    // An input that is not required starts without data.
    let base = file("").replace(r#"name="one" kind="relay""#, r#"name="one" kind="base""#);
    let base = base.replace("one.out", "one.scan").replace("one.in", "one.way");
    assert_eq!(codes(&base), [""; 0]);
}

#[test]
fn a_time_that_stands_still_is_one_finding() {
    let file = with("").replace(
        "</system>",
        r#"<component name="w" kind="world" rate="10Hz"><parameter name="speed" value="SPEED"/></component><component name="j" kind="judge"/><link from="w.truth" to="j.truth"/></system>"#,
    );
    only("W0143", "with 0 w does nothing", &file.replace("SPEED", "0"));
}

/// The codes of all findings but notes, with the kinds of the examples.
fn codes(file: &str) -> Vec<&'static str> {
    let reading = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(file.into()));
    let reading = armor_robotfile::check(reading, &[], Some(&super::follow_ups::kinds()));
    let found = reading.findings.without_notes();
    found.iter().map(|finding| finding.code.as_str()).collect()
}

#[test]
fn a_place_that_lost_its_components_names_the_report() {
    let file = |components: &str| {
        with(&format!(
            r#"<place name="b" {components} on-failure="hold"/><place name="c" components="arm"/><transition name="t" from="a" to="b" on="go.packed"/><transition name="u" from="b" to="c" on="arm.done"/><transition name="v" from="c" to="hold" on="arm.done"/>"#
        ))
    };
    assert_eq!(codes(&file(r#"components="arm""#)), [""; 0]);
    only("W0214", "arm is frozen in every place that u starts from", &file(""));
}

#[test]
fn a_link_to_an_output_is_one_finding() {
    let file = |to: &str| {
        system(&format!(
            r#"<component name="l" kind="laser" rate="10Hz"/><component name="c" kind="cartographer"/><component name="v" kind="viewer"/><link from="l.scan" to="{to}"/><link from="c.map" to="v.map"/>"#
        ))
    };
    assert_eq!(codes(&file("c.scan")), [""; 0]);
    only("E0107", "c.map is an output", &file("c.map"));
}
