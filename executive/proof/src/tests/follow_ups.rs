//! The findings of a file together with the results of its proof: one fault, one finding.

use armor_plan::Plan;
use armor_robotfile::{Code, Colours, check, read};

use crate::prove::prove;

/// The file has these findings apart from notes, and `shown` is in their text.
fn expect(mission: &str, codes: &[&str], shown: &str) {
    let file = format!(
        r#"<armor version="1"><system><component name="go" kind="k"/><component name="back" kind="k"/></system>{mission}</armor>"#
    );
    let reading = read("robot.xml".as_ref(), &mut |_| Ok(file.clone().into_bytes()));
    let mut reading = check(reading, &[], None);
    let configuration = reading.configuration.clone().expect("a configuration");
    let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
    let proven = prove(&configuration, &plan, &|| false);
    reading.findings.extend_proven(proven, &configuration);
    let found = reading.findings.without_notes();
    let text = found.render(Colours::No);
    let found: Vec<_> = found.iter().map(|finding| finding.code.as_str()).collect();
    assert_eq!(found, codes, "{file}\n{text}");
    assert!(text.contains(shown), "{shown}\n{text}");
    assert!(reading.findings.iter().all(|f| f.code == Code::Takes || !f.remedy.is_empty()));
}

fn mission(of_mission: &str, content: &str) -> String {
    format!(
        r#"<mission {of_mission}><place name="a" initial="true" components="go"/><place name="b" components="back"/><place name="home"/><place name="hold"/>{content}</mission>"#
    )
}

const BOTH: &str = r#"goal="home" safe="hold""#;
const OUT: &str = r#"<transition name="out" from="a" to="b" on="go.done"/>"#;
const LATE: &str = r#"<transition name="late" from="b" to="hold" timeout="60s"/>"#;

#[test]
fn a_goal_that_is_never_reached_names_the_transition_that_never_fires() {
    let never = r#"<transition name="in" from="b" to="home" when="false"/>"#;
    let file = mission(BOTH, &format!("{OUT}{LATE}{never}"));
    expect(&file, &["E0241"], "this guard is always false");
    let frozen = r#"<transition name="in" from="home" to="b" on="back.done"/>"#;
    let file = mission(BOTH, &format!("{OUT}{LATE}{frozen}"));
    expect(&file, &["E0241"], "a frozen component reports nothing; activate it there");
    let nowhere = r#"<transition name="in" from="b" on="back.done"/>"#;
    let file = mission(BOTH, &format!("{OUT}{LATE}{nowhere}"));
    expect(&file, &["E0241"], "in takes the token from b and puts it into no place");
    expect(&mission(BOTH, &format!("{OUT}{LATE}")), &["E0241"], "no transition leads to it");
}

#[test]
fn a_transition_that_never_fires_is_reported_once() {
    let home = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
    let lost = LATE.replace("timeout=\"60s\"", "when=\"false\"");
    expect(&mission(BOTH, &format!("{OUT}{home}{lost}")), &["W0236"], "the transition never fires");
    let heavy =
        r#"<transition name="late" to="hold" timeout="9s"><arc from="b" weight="2"/></transition>"#;
    expect(&mission(BOTH, &format!("{OUT}{home}{heavy}")), &["W0217"], "remove the weight");
    let nowhere = LATE.replace(" to=\"hold\"", "");
    expect(&mission(BOTH, &format!("{OUT}{home}{nowhere}")), &["W0271"], "write to=");
}

#[test]
fn a_mission_without_a_safe_place_does_not_stand_still_in_it() {
    let home = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
    let file = mission(r#"goal="home""#, &format!("{OUT}{home}{LATE}"));
    expect(&file, &["W0213"], "write safe=\"hold\"");
}

#[test]
fn checks_that_wait_for_a_goal_that_is_never_reached_are_left_out() {
    let checks = r#"<check>always reachable(home or hold)</check><check>duration(home or hold) &lt;= 5min</check>"#;
    let out = OUT.replace("to=\"b\"", "to=\"c\"");
    let file = mission(BOTH, &format!("<place name=\"c\"/>{out}{checks}"));
    let file = file.replace("<place name=\"b\" components=\"back\"/>", "");
    expect(&file, &["E0241"], "no transition leads to it");
    let other = format!("<check>never c</check>{checks}");
    expect(&file.replace(checks, &other), &["E0241", "E0252"], "never c");
}

#[test]
fn results_of_the_same_firings_are_one_finding() {
    let home = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
    let checks =
        r#"<check>always reachable(home or hold)</check><check>eventually home or hold</check>"#;
    let stuck = LATE.replace("to=\"hold\"", "to=\"c\"");
    let file = mission(BOTH, &format!("<place name=\"c\"/>{OUT}{home}{stuck}{checks}"));
    expect(&file, &["E0252"], "this check fails by the same firings");
    expect(&file, &["E0252"], "the mission stands still");
}
