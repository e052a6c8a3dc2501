//! One mistake with several effects: what was meant is named once, where it is written.

use super::follow_ups::{END, LATE, kinds, only, robot};
use super::one_cause::with_inner;
use super::{reading, system};

#[test]
fn a_parameter_of_an_unknown_name_is_meant_for_the_one_that_is_needed() {
    let player = |name: &str| {
        system(&format!(
            r#"<component name="front" kind="player"><parameter name="{name}" value="a.log"/></component><component name="mapper" kind="mapper"/><link from="front.scan" to="mapper.scan"/>"#
        ))
    };
    only("E0110", "did you mean file? It is needed, and has no value", &player("log"));
}

#[test]
fn exchanged_values_of_two_parameters_are_one_finding() {
    let file = robot(r#"safe="hold""#, &format!("{END}{LATE}"));
    let patrol = r#"<component name="tour" kind="patrol"><parameter name="laps" value="2s"/><parameter name="stay" value="3"/></component></system>"#;
    // A number without a unit is a time in seconds, so only one of these values is wrong.
    only("E0112", "laps: ", &file.replace("</system>", patrol));
    let patrol = patrol.replace(r#"value="3""#, r#"value="3m""#);
    only("E0112", "stay: ", &file.replace("</system>", &patrol.replace("2s", "2")));
}

#[test]
fn a_link_to_another_type_is_meant_for_the_input_that_nothing_feeds() {
    let file = system(
        r#"<component name="laser" kind="laser"/><component name="mapper" kind="mapper"/><component name="world" kind="world" rate="10Hz"/><link from="laser.scan" to="world.velocity"/>"#,
    );
    only("E0108", r#"did you mean to="mapper.scan"? It takes Scan"#, &file);
}

#[test]
fn a_link_to_an_output_is_meant_for_the_input_of_that_type() {
    let file = system(
        r#"<component name="laser" kind="laser" rate="10Hz"/><component name="relay" kind="relay" rate="10Hz"/><component name="mapper" kind="mapper"/><link from="laser.scan" to="relay.out"/><link from="relay.out" to="mapper.scan"/>"#,
    );
    only("E0107", r#"did you mean to="relay.in"?"#, &file);
}

#[test]
fn a_link_that_is_written_twice_may_be_from_an_output_that_nothing_uses() {
    let laser = |name: &str| format!(r#"<component name="{name}" kind="laser" rate="10Hz"/>"#);
    let from = |name: &str| format!(r#"<link from="{name}.scan" to="mapper.scans"/>"#);
    let file = |second: &str| {
        let mapper = r#"<component name="mapper" kind="scan-mapper"/>"#;
        system(&format!(
            "{}{}{mapper}{}{}",
            laser("left"),
            laser("right"),
            from("left"),
            from(second)
        ))
    };
    only("E0104", r#"did you mean from="right.scan", which no link uses?"#, &file("left"));
}

#[test]
fn a_name_of_a_submission_is_found_by_its_end_and_one_that_is_not_included_is_named() {
    let inner = r#"<mission goal="done" safe="lost"><place name="i" initial="true" components="arm"/><place name="done"/><place name="lost"/><transition name="raised" from="i" to="done" on="arm.done"/><transition name="slow" from="i" to="lost" timeout="9s"/></mission>"#;
    let main = |submission: &str, check: &str| {
        let next = r#"<place name="b"/><place name="c"/><transition name="next" from="a" to="b" on="go.done"/><transition name="on" from="c" to="over" timeout="1s"/>"#;
        let file = robot(r#"safe="hold""#, &format!("{next}{LATE}{submission}"));
        file.replace("</mission>", &format!("<check>fires({check})</check></mission>"))
    };
    let included = r#"<submission ref="inner.xml" in="b" out="c"/>"#;
    let found = |submission: &str, check: &str| with_inner(&main(submission, check), inner);
    assert!(found(included, "inner.raised").0.is_empty(), "{}", found(included, "inner.raised").1);
    let (codes, text) = found(included, "raised");
    assert_eq!(codes, ["E0251"], "{text}");
    assert!(text.contains("did you mean inner.raised?"), "{text}");
    let (codes, text) = found("", "inner.raised");
    assert!(codes.contains(&"E0251"), "{text}");
    assert!(text.contains("the mission includes no sub-mission inner: add"), "{text}");
    // The names of one whose attribute is misspelt are not known.
    let (codes, text) = found(&included.replace("ref=", "file="), "inner.raised");
    assert!(codes.contains(&"E0016") && !codes.contains(&"E0251"), "{text}");
}

#[test]
fn guards_that_one_domain_decides_are_one_finding() {
    let guards = r#"<variable name="n" min="1" max="3"/><transition name="t" from="a" to="hold" on="go.empty" when="n &lt; 1"><set variable="n" value="n + 1"/></transition><transition name="u" from="a" to="over" on="go.done" when="n &gt;= 1"/>"#;
    let file = robot(r#"safe="hold""#, &format!("{guards}{LATE}"));
    only("W0236", "widen the domain of n, which decides all of them", &file);
}

#[test]
fn the_parameter_that_names_events_is_named() {
    let file = |parameter: &str| {
        let patrol =
            format!(r#"<component name="tour" kind="patrol">{parameter}</component></system>"#);
        let more = r#"<transition name="more" from="a" to="hold" on="tour.again"/>"#;
        robot(r#"safe="hold""#, &format!("{END}{LATE}{more}")).replace("</system>", &patrol)
    };
    let given =
        |name: &str, value: &str| file(&format!(r#"<parameter name="{name}" value="{value}"/>"#));
    let (is_known, _) = reading(&given("buttons", "again stop"), Some(&kinds()));
    assert!(!is_known.findings.has_errors());
    let text = r#"add <parameter name="buttons" value="again"/> to tour"#;
    only("E0225", text, &file(""));
    let text = "did you mean agin? Otherwise add again to buttons of tour";
    only("E0225", text, &given("buttons", "agin stop"));
    only("E0110", "did you mean buttons?", &given("button", "again stop"));
}

#[test]
fn queues_that_are_too_short_for_one_rate_are_one_note() {
    let file = system(
        r#"<component name="laser" kind="laser" rate="100Hz"/><component name="rear" kind="laser" rate="100Hz"/><component name="pair" kind="recorder" rate="0.1Hz"/><component name="base" kind="base" rate="0.1Hz"/><link from="laser.scan" to="pair.scan" keep="10"/>"#,
    );
    let (reading, _) = reading(&file, Some(&kinds()));
    let notes = reading.findings.iter().filter(|it| it.code.as_str() == "N0122");
    let notes: Vec<_> = notes.map(|it| it.remedy.as_str()).collect();
    let [note] = notes[..] else { panic!("{notes:?}") };
    assert!(note.starts_with("are the rates right? laser works at 100 Hz, and pair at 0.1 Hz"));
}

#[test]
fn a_rate_above_the_steps_of_a_clock_whose_speed_is_given_is_found() {
    let file = |rate: &str, speed: &str| {
        system(&format!(
            r#"<component name="tracker" kind="tracker"/><component name="pilot" kind="pilot" rate="{rate}"/><component name="world" kind="world" rate="100Hz"><parameter name="speed" value="{speed}"/></component><link from="tracker.pose" to="pilot.pose"/><link from="pilot.velocity" to="world.velocity"/><clock source="world.clock"/>"#
        ))
    };
    only("W0132", "which moves it 25 times per second", &file("100Hz", "4"));
    for (rate, speed) in [("25Hz", "4"), ("100Hz", "1"), ("200Hz", "0.5")] {
        let (reading, _) = reading(&file(rate, speed), Some(&kinds()));
        assert!(reading.findings.without_notes().is_empty(), "{rate} {speed}");
    }
}
