//! Values that are in their range, and with which nothing works.

use armor_robotfile::{Colours, check, read};

use super::follow_ups::{kinds, only};

fn patrol(of_component: &str, of_place: &str, timeout: &str) -> String {
    format!(
        r#"<armor version="1"><system><component name="p" kind="patrol" rate="5Hz">{of_component}</component></system><mission goal="over" safe="hold"><place name="a" initial="true" components="p"/><place name="b" components="p">{of_place}</place><place name="over"/><place name="hold"/><transition name="on" from="a" to="b" on="p.done"/><transition name="end" from="b" to="over" on="p.done"/><transition name="late" from="a" to="hold" timeout="{timeout}"/><transition name="later" from="b" to="hold" timeout="{timeout}"/></mission></armor>"#
    )
}

fn nothing(file: &str) {
    let reading = read("a.xml".as_ref(), &mut |_| Ok(file.into()));
    let found = check(reading, &[], Some(&kinds())).findings.without_notes();
    assert!(found.is_empty(), "{file}\n{}", found.render(Colours::No));
}

fn given(name: &str, value: &str) -> String {
    format!(r#"<parameter name="{name}" value="{value}"/>"#)
}

fn given_in_place(name: &str, value: &str) -> String {
    format!(r#"<parameter component="p" name="{name}" value="{value}"/>"#)
}

#[test]
fn a_task_without_end_is_never_done() {
    nothing(&patrol(&given("laps", "2"), "", "1min"));
    only("W0279", "p is never done, so on never fires", &patrol(&given("laps", "0"), "", "1min"));
    let in_place = given_in_place("laps", "0");
    only("W0279", "so end never fires", &patrol("", &in_place, "1min"));
    // Without end is right where nothing waits for the end.
    let file = patrol(&given("laps", "0"), "", "1min").replace("p.done", "p.lap");
    nothing(&file);
}

#[test]
fn a_task_is_done_before_its_place_is_left() {
    nothing(&patrol(&given("stay", "50s"), "", "1min"));
    only("W0279", "p is not done before 60s", &patrol(&given("stay", "60s"), "", "1min"));
    let bare = patrol(&given("stay", "60"), "", "1min");
    only("W0279", "p is not done before 60 s (60 has no unit), and", &bare);
    only("W0279", "later leaves b", &patrol("", &given_in_place("stay", "1h"), "1min"));
    // The place has its own value.
    let file = patrol(&given("stay", "1h"), &given_in_place("stay", "1s"), "1min");
    only("W0279", "late leaves a", &file);
}

#[test]
fn the_time_of_all_rounds_is_compared_with_the_timeout_of_the_place() {
    let all = |laps: &str, stay: &str, timeout: &str| {
        let route = given("route", "2,0.8 5.5,0 6.5,1.5");
        let values = format!("{route}{}{}", given("laps", laps), given("stay", stay));
        patrol(&values, "", timeout)
    };
    nothing(&all("2", "2s", "13s"));
    let shown =
        "laps: p is not done before 12 s (stay 2 s × 2 laps × 3 in route), and late leaves a";
    only("W0279", &shown.replace("laps:", "stay:"), &all("2", "2s", "12s"));
    only(
        "W0279",
        "laps: p is not done before 600 s (stay 2 s × 100 laps",
        &all("100", "2s", "6min"),
    );
    only(
        "W0279",
        "stay: p is not done before 720 s (stay 120 s × 2 laps",
        &all("2", "2min", "6min"),
    );
    // What is given is to be shorter.
    let laps = patrol(&given("laps", "90"), "", "1min");
    only("W0279", "laps: p is not done before 90 s (stay 1 s × 90 laps)", &laps);
}

#[test]
fn a_component_that_does_nothing_is_a_warning() {
    let file = |speed: &str| {
        format!(
            r#"<armor version="1"><system><clock source="w.clock"/><component name="w" kind="world" rate="10Hz"><parameter name="speed" value="{speed}"/></component><component name="j" kind="judge"/><link from="w.truth" to="j.truth"/></system></armor>"#
        )
    };
    nothing(&file("2"));
    only("W0143", "with 0 w does nothing", &file("0"));
    only("W0143", "with 0.0 w does nothing", &file("0.0"));
}

#[test]
fn data_that_come_after_the_place_is_left_are_too_late() {
    let file = |period: &str| {
        format!(
            r#"<armor version="1"><system><component name="t" kind="tracker" rate="10Hz"><parameter name="period" value="{period}"/></component><component name="g" kind="pilot" rate="10Hz"/><component name="w" kind="world" rate="10Hz"/><component name="j" kind="judge"/><link from="t.pose" to="g.pose"/><link from="g.velocity" to="w.velocity"/><link from="w.truth" to="j.truth"/></system><mission goal="over" safe="hold"><place name="a" initial="true" components="g"/><place name="over"/><place name="hold"/><transition name="end" from="a" to="over" on="g.done"/><transition name="late" from="a" to="hold" timeout="1min"/></mission></armor>"#
        )
    };
    nothing(&file("1s"));
    only("W0279", "t sends t.pose every 1h, and late leaves a after 1min", &file("1h"));
    only("W0279", "t sends t.pose every 200 s (200 has no unit), and late", &file("200"));
}

#[test]
fn a_timeout_leaves_a_component_time_for_one_call() {
    nothing(&patrol("", "", "200ms"));
    let later =
        |time: &str| format!(r#"<transition name="later" from="b" to="hold" timeout="{time}"/>"#);
    let short = |of_component: &str| {
        patrol(of_component, "", "60ms").replace(&later("60ms"), &later("60s"))
    };
    only("W0264", "late leaves a before p is called", &short(""));
    // The timeout is wrong, and not the time of the component.
    only("W0264", "late leaves a before p is called", &short(&given("stay", "1s")));
}

#[test]
fn a_question_leaves_a_person_time_to_read_it() {
    let file = |time: &str, unanswered: &str| {
        let ask = format!(
            r#"<transition name="ask" from="a" to="hold" autonomy="confirm" answer-within="{time}"{unanswered}/></mission>"#
        );
        patrol("", "", "1min").replace("</mission>", &ask)
    };
    nothing(&file("1s", ""));
    only("W0264", "`30ms` is too short: ask is declined before a person", &file("30ms", ""));
    let fires = r#" unanswered="fire""#;
    only("W0264", "ask fires before a person has read the question", &file("0.5s", fires));
}

#[test]
fn a_question_may_be_answered_until_its_time_is_over() {
    let file = |time: &str| {
        let ask = r#"<transition name="ask" from="q" to="a" autonomy="confirm" answer-within="60s" unanswered="decline"/>"#;
        let content = format!(
            r#"<place name="q"/>{ask}<transition name="accept" from="q" to="over" timeout="{time}"/></mission>"#
        );
        patrol("", "", "1min")
            .replace(r#"from="b" to="over""#, r#"from="b" to="q""#)
            .replace("</mission>", &content)
    };
    nothing(&file("75s"));
    nothing(&file("60s"));
    only("W0264", "before the time for the answer about ask is over", &file("15s"));
}

#[test]
fn an_operator_has_time_to_fire_a_transition() {
    let file = |time: &str, by: &str| {
        let content = format!(
            r#"<place name="q"/><transition name="repeat" from="q" to="a" {by}/><transition name="leave" from="q" to="over" timeout="{time}"/></mission>"#
        );
        patrol("", "", "1min")
            .replace(r#"from="b" to="over""#, r#"from="b" to="q""#)
            .replace("</mission>", &content)
    };
    let operator = r#"operator="true""#;
    nothing(&file("1s", operator));
    let shown = "`0.5s` is too short: leave leaves q before a person can fire repeat";
    only("W0264", shown, &file("0.5s", operator));
    let shown = "before a person has read the question about repeat";
    only("W0264", shown, &file("0.5s", r#"autonomy="confirm""#));
}

#[test]
fn a_time_after_which_something_is_given_up_is_shorter_than_the_timeout() {
    nothing(&patrol(&given("patience", "50s"), "", "1min"));
    nothing(&patrol("", "", "10s"));
    let shown = "patience: p gives nothing up before 15min, and late leaves a after 4min";
    only("W0279", shown, &patrol(&given("patience", "15min"), "", "4min"));
}
