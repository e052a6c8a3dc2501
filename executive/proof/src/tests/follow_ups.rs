//! The findings of a file together with the results of its proof: one fault, one finding.

use armor_plan::Plan;
use armor_robotfile::{Code, Colours, check, read};

use crate::prove::prove;

/// The file has these findings apart from notes, and `shown` is in their text.
pub(super) fn expect(mission: &str, codes: &[&str], shown: &str) {
    expect_with(mission, "", codes, shown);
}

/// The same of a mission with the sub-mission `inner`, in `inner.xml`.
pub(super) fn expect_with(mission: &str, inner: &str, codes: &[&str], shown: &str) {
    let (found, text) = found_in(mission, inner);
    assert_eq!(found, codes, "{mission}\n{text}");
    assert!(text.contains(shown), "{shown}\n{text}");
}

/// The codes of its findings apart from notes, and their text.
pub(super) fn found_in(mission: &str, inner: &str) -> (Vec<String>, String) {
    let file = format!(
        r#"<armor version="1"><system><component name="go" kind="k"/><component name="back" kind="k"/></system>{mission}</armor>"#
    );
    let inner = format!(r#"<armor version="1">{inner}</armor>"#);
    let reading = read("robot.xml".as_ref(), &mut |path| {
        let is_inner = path.ends_with("inner.xml");
        Ok(if is_inner { inner.clone() } else { file.clone() }.into_bytes())
    });
    let mut reading = check(reading, &[], None);
    let configuration = reading.configuration.clone().expect("a configuration");
    let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
    let proven = prove(&configuration, &plan, &|| false);
    reading.findings.extend_proven(proven, &configuration);
    let found = reading.findings.without_notes();
    let text = found.render(Colours::No);
    assert!(reading.findings.iter().all(|f| f.code == Code::Takes || !f.remedy.is_empty()));
    (found.iter().map(|finding| finding.code.as_str().to_owned()).collect(), text)
}

pub(super) fn mission(of_mission: &str, content: &str) -> String {
    format!(
        r#"<mission {of_mission}><place name="a" initial="true" components="go"/><place name="b" components="back"/><place name="home"/><place name="hold"/>{content}</mission>"#
    )
}

pub(super) const BOTH: &str = r#"goal="home" safe="hold""#;
pub(super) const OUT: &str = r#"<transition name="out" from="a" to="b" on="go.done"/>"#;
pub(super) const LATE: &str = r#"<transition name="late" from="b" to="hold" timeout="60s"/>"#;

#[test]
fn a_goal_that_is_never_reached_names_the_transition_that_never_fires() {
    let never = r#"<transition name="in" from="b" to="home" when="false"/>"#;
    let file = mission(BOTH, &format!("{OUT}{LATE}{never}"));
    expect(&file, &["E0241"], "this guard is always false");
    let frozen = r#"<transition name="in" from="home" to="b" on="back.done"/>"#;
    let file = mission(BOTH, &format!("{OUT}{LATE}{frozen}"));
    expect(&file, &["E0241"], "did you mean from=\"b\" to=\"home\"?");
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

#[test]
fn a_join_without_one_of_its_places_is_one_finding() {
    let fork = |join: &str| {
        format!(
            r#"<mission goal="over" safe="hold"><place name="a" initial="true" components="go"/><place name="x" initial="true" components="back"/><place name="b"/><place name="y"/><place name="met"/><place name="q" components="back"/><place name="over"/><place name="hold"/>
               <transition name="there" from="a" to="b" on="go.done"/><transition name="come" from="x" to="y" on="back.done"/>
               <transition name="alone" from="b" to="hold" timeout="9s"/><transition name="late" from="y" to="hold" timeout="9s"/>
               <transition name="stay" from="a" to="hold" timeout="60s"/><transition name="blocked" from="x" to="q" on="back.failed"/>
               <transition name="meet" from="{join}" to="met"/><transition name="part" from="met" to="q" timeout="3s"/>
               <transition name="end" from="q" to="over" on="back.done"/><transition name="lost" from="q" to="hold" timeout="60s"/></mission>"#
        )
    };
    expect(&fork("b y"), &[], "");
    expect(&fork("b"), &["W0244"], "alone never fires: meet always fires before it");
}

#[test]
fn what_follows_from_a_value_outside_its_domain_is_one_finding() {
    let rounds = |max: &str, when: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="{max}"/>{OUT}<transition name="again" from="b" to="a" on="back.done" {when}><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="home" on="back.done" when="n == 2"/><check>never hold</check><check>never n &gt; 2</check>"#
        );
        mission(BOTH, &content)
    };
    expect(&rounds("2", r#"when="n &lt; 2""#), &[], "");
    expect(&rounds("2", ""), &["E0254"], "this check fails, too");
    expect(&rounds("1", r#"when="n &lt; 2""#), &["E0254"], "`n < 2` is always true");
}

#[test]
fn checks_that_ask_for_more_than_one_that_fails_are_merged() {
    let waits = r#"<place name="c"/><transition name="in" from="b" to="home" on="back.done"/><transition name="late" from="b" to="c" timeout="60s"/><transition name="again" from="c" to="c" timeout="60s"/>"#;
    let checks = r#"<check>duration(home or hold) &lt;= 5min</check><check>eventually home or hold</check><check>always reachable(home or hold)</check>"#;
    let file = mission(BOTH, &format!("{OUT}{waits}{checks}"));
    expect(&file, &["E0252"], "this check fails, too");
}

#[test]
fn a_mission_that_is_over_at_its_start_is_one_finding() {
    let home = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
    let file = mission(r#"goal="a" safe="hold""#, &format!("{OUT}{home}{LATE}"));
    expect(&file, &["W0262"], "");
    // The mark was moved to the goal: nothing leads to the place where it was.
    let moved = mission(r#"goal="home" safe="hold""#, &format!("{OUT}{home}{LATE}"));
    let moved = moved.replace(r#" initial="true""#, "");
    let moved = moved.replace(r#"name="home""#, r#"name="home" initial="true""#);
    expect(&moved, &["W0262"], "");
    let check = "<check>eventually home or hold</check><check>reachable(home)</check>";
    let file = mission(r#"goal="a" safe="hold""#, &format!("{OUT}{home}{LATE}{check}"));
    expect(&file, &["E0252"], "the mission is over at its start");
}

#[test]
fn a_place_that_is_marked_together_with_the_goal_is_too_late() {
    let out = OUT.replace("to=\"b\"", "to=\"c home\"");
    let rest = r#"<place name="c"/><transition name="on" from="c" to="b" timeout="1s"/><transition name="in" from="b" to="home" on="back.done"/>"#;
    let file = mission(BOTH, &format!("{out}{rest}{LATE}"));
    expect(&file, &["W0217"], "on never fires: out marks home, the goal, too");
}

#[test]
fn a_missing_safe_place_explains_the_checks_that_wait_for_it() {
    let home = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
    let check = "<check>always reachable(home or hold)</check><place name=\"c\"/>";
    let stuck = LATE.replace("to=\"hold\"", "to=\"c\"");
    let file = mission(r#"goal="home""#, &format!("{OUT}{home}{LATE}{stuck}{check}"));
    let file = file.replace(r#"name="late" from="b" to="c""#, r#"name="stuck" from="a" to="c""#);
    expect(&file, &["E0252"], "the mission has no safe place");
}

#[test]
fn a_question_that_comes_too_late_is_never_asked() {
    let ask = |after: &str| {
        let ask = format!(
            r#"<transition name="ask" from="c" to="home" after="{after}" autonomy="confirm" answer-within="1s" unanswered="fire"/>"#
        );
        let lead = OUT.replace("to=\"b\"", "to=\"c\"");
        let fast = r#"<transition name="fast" from="c" to="b" timeout="3s"/>"#;
        let home = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
        mission(BOTH, &format!(r#"<place name="c"/>{lead}{ask}{fast}{home}{LATE}"#))
    };
    expect(&ask("1s"), &[], "");
    expect(&ask("5s"), &["W0217"], "ask never fires in time: fast always fires before it");
}

#[test]
fn a_transition_that_leads_on_from_the_safe_place_explains_the_check() {
    let there = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
    let early = r#"<transition name="early" from="a" to="b" timeout="60s"/>"#;
    let exchanged = r#"<transition name="late" from="hold" to="b" timeout="60s"/>"#;
    let check = "<check>duration(home or hold) &lt;= 3min</check>";
    let file = mission(BOTH, &format!("{OUT}{there}{early}{exchanged}"));
    expect(&file, &["W0217"], r#"did you mean from="b" to="hold"?"#);
    let file = mission(BOTH, &format!("{OUT}{there}{early}{exchanged}{check}"));
    expect(&file, &["E0252"], "late never fires: it leads on from hold, the safe place");
    expect(&file, &["E0252"], r#"did you mean from="b" to="hold"?"#);
    // Where another one leads from there to the safe place, another place was meant to be safe.
    let file = mission(
        BOTH,
        &format!("{OUT}{there}{early}{LATE}{exchanged}")
            .replace("\"late\" from=\"hold\"", "\"on\" from=\"hold\""),
    );
    expect(&file, &["W0217"], "help: name another place as safe");
}
