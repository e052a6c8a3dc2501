//! Why a transition never fires or a check fails: the guard and the values of its variables, the safe
//! place, or a finding of the file.

use super::follow_ups::{BOTH, LATE, OUT, expect, expect_with, mission};

const HOME: &str = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;

#[test]
fn a_guard_that_is_never_true_is_named_with_the_values_there() {
    let rounds = |enough: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="9"/>{OUT}{LATE}<transition name="again" from="b" to="a" on="back.failed" when="n &lt; 2"><set variable="n" value="n + 1"/></transition>{HOME}<transition name="enough" from="b" to="home" on="back.failed" when="{enough}"/>"#
        );
        mission(BOTH, &content)
    };
    expect(&rounds("n >= 2"), &[], "");
    let shown = "`n > 2` is false whenever its places are marked, because n is 0 or 1 or 2 there";
    expect(&rounds("n > 2"), &["W0217"], shown);
    expect(&rounds("n > 2"), &["W0217"], "compare n with a value that it has there");
    let many = rounds("n == 9").replace("n &lt; 2", "n &lt; 8");
    expect(&many, &["W0217"], "n is 0 to 8 there");
}

#[test]
fn what_leads_on_from_the_safe_place_never_fires() {
    let recover = r#"<transition name="recover" from="hold" to="a" operator="true"/>"#;
    let file = mission(BOTH, &format!("{OUT}{LATE}{HOME}{recover}"));
    expect(&file, &["W0217"], "recover never fires: it leads on from hold, the safe place");
    // The goal is only reached through the safe place.
    let file = mission(r#"goal="home" safe="b""#, &format!("{OUT}{LATE}{HOME}"));
    let shown = "late and in never fire: they lead on from b, the safe place, and the mission is over when b";
    expect(&file, &["E0241"], shown);
    expect(&file, &["E0241"], "did you mean safe=\"hold\"?");
}

#[test]
fn a_transition_that_never_fires_explains_a_check_that_waits_forever() {
    let rounds = |set: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="9"/>{OUT}<transition name="stay" from="a" to="home" on="go.failed"/><transition name="late" from="a" to="b" timeout="60s"/><transition name="again" from="b" to="a" timeout="60s" when="n &lt; 2">{set}</transition><transition name="enough" from="b" to="home" timeout="60s" when="n &gt;= 2"><set variable="n" value="0"/></transition><check>b leads to home</check><check>duration(home) &lt;= 30min</check>"#
        );
        mission(BOTH, &content)
    };
    expect(&rounds(r#"<set variable="n" value="n + 1"/>"#), &[], "");
    expect(&rounds(""), &["E0252"], "enough never fires: `n >= 2` is false");
    expect(&rounds(""), &["E0252"], "compare n with a value that it has there");
    expect(&rounds(""), &["E0252"], "this check fails, too");
    // Without another path to the goal, that is never reached for the same reason.
    let stay = r#"<transition name="stay" from="a" to="home" on="go.failed"/>"#;
    expect(&rounds("").replace(stay, ""), &["E0241"], "enough never fires: `n >= 2` is false");
}

#[test]
fn a_place_that_nothing_leads_to_explains_the_checks_that_fail() {
    let stuck = r#"<place name="c"/><place name="d"/><transition name="out" from="a" to="c" on="go.done"/><transition name="on" from="d" to="b" timeout="1s"/><transition name="stay" from="a" to="home" on="go.failed"/>"#;
    let checks =
        r#"<check>always reachable(home or hold)</check><check>eventually home or hold</check>"#;
    let file = mission(BOTH, &format!("{stuck}{HOME}{LATE}{checks}"));
    expect(&file, &["E0252"], "no transition leads to d");
    expect(&file, &["E0252"], r#"nothing leads on from c: add <transition from="c" to="d">"#);
    expect(&file, &["E0252"], "this check fails, too");
    // Two reasons: it is not known which one explains the check.
    let other = r#"<place name="e"/><transition name="off" from="e" to="hold" timeout="1s"/>"#;
    let file =
        mission(BOTH, &format!("{stuck}{other}{HOME}{LATE}<check>eventually home or hold</check>"));
    expect(&file, &["W0212", "W0212", "E0252"], "");
}

#[test]
fn a_token_that_is_put_nowhere_explains_the_checks_that_fail() {
    let lost = LATE.replace(" to=\"hold\"", "");
    let checks = r#"<check>always reachable(home or hold)</check><check>duration(home or hold) &lt;= 5min</check>"#;
    let file = mission(BOTH, &format!("{OUT}{HOME}{lost}{checks}"));
    expect(&file, &["E0252"], "late takes the token from b and puts it into no place");
    expect(&file, &["E0252"], "write to=");
}

const INNER: &str = r#"<mission goal="y" safe="z"><place name="x" initial="true"/><place name="y"/><place name="z"/><transition name="t" from="x" to="y" timeout="2s"/><transition name="u" from="x" to="z" operator="true"/></mission>"#;

/// A mission whose sub-mission leads from c to b, with these attributes of it.
fn with_inner(attributes: &str) -> String {
    let out = OUT.replace("to=\"b\"", "to=\"c\"");
    let inner = format!(r#"<submission ref="inner.xml" {attributes}/>"#);
    let check = "<check>always reachable(home or hold)</check>";
    mission(
        BOTH,
        &format!(
            r#"<place name="c"/><place name="d"/><transition name="on" from="d" to="b"/>{out}{HOME}{LATE}{inner}{check}"#
        ),
    )
}

#[test]
fn a_submission_without_one_of_its_places_is_one_finding() {
    let file = with_inner(r#"in="c" out="d""#);
    expect_with(&file, INNER, &[], "");
    let exclusive = "<exclusive components=\"go back\"/><check>";
    let early = with_inner(r#"out="d""#).replace("<check>", exclusive);
    expect_with(&early, INNER, &["W0245"], r#"name the place that enters the sub-mission, in="c""#);
    expect_with(&file.replace("<check>", exclusive), INNER, &[], "");
    expect_with(&with_inner(r#"in="c""#), INNER, &["E0241"], r#"write out="d" if inner.xml"#);
    let turned = with_inner(r#"in="d" out="c""#);
    expect_with(&turned, INNER, &["E0241"], r#"did you mean in="c" out="d" for inner.xml?"#);
    expect_with(&with_inner(r#"in="c" out="c""#), INNER, &["E0241"], r#"write out="d""#);
}

#[test]
fn a_submission_whose_goal_is_missing_is_one_finding() {
    let file = with_inner(r#"in="c" out="d""#);
    expect_with(&file, &INNER.replace(r#"goal="y" "#, ""), &["E0241"], "write goal=\"y\"");
    let unreached = INNER.replace(r#"from="x" to="y""#, r#"from="x" to="z""#);
    expect_with(&file, &unreached, &["E0241"], "no transition leads to y");
}

#[test]
fn exclusive_components_that_keep_the_goal_away_are_one_finding() {
    let content = r#"<exclusive components="go back"/><place name="c"/><transition name="out" from="c" to="a b" timeout="1s"/><transition name="in" from="a b" to="home" on="back.done"/>"#;
    let file = mission(BOTH, content).replace(r#"name="a" initial="true""#, "name=\"a\"");
    let file = file.replace(r#"<place name="c"/>"#, r#"<place name="c" initial="true"/>"#);
    expect(&file, &["E0241"], "or do not declare the components exclusive");
}

#[test]
fn what_fires_before_all_others_is_the_only_finding() {
    let stay = r#"<transition name="stay" from="b" to="hold" timeout="90s"/>"#;
    let early = r#"<transition name="early" from="b" to="home"/>"#;
    expect(
        &mission(BOTH, &format!("{OUT}{HOME}{stay}{early}")),
        &["W0272"],
        "early has no condition",
    );
}

#[test]
fn a_second_initial_place_is_one_finding() {
    let content =
        format!(r#"{OUT}{HOME}{LATE}<check>never a and b</check><check>never a and home</check>"#);
    let file = mission(BOTH, &content);
    expect(&file, &[], "");
    let second = file.replace(r#"<place name="b""#, r#"<place name="b" initial="true""#);
    assert_ne!(second, file);
    expect(&second, &["E0252"], "b holds more than one token");
}

#[test]
fn a_forgotten_guard_is_one_finding() {
    let rounds = |again: &str, enough: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="2"/>{OUT}{LATE}<transition name="again" from="b" to="a" on="back.done"{again}><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="home" on="back.done"{enough}/><check>never home and n != 2</check>"#
        );
        mission(BOTH, &content)
    };
    let (less, reached) = (r#" when="n &lt; 2""#, r#" when="n &gt;= 2""#);
    expect(&rounds(less, reached), &[], "");
    expect(&rounds(less, ""), &["E0252"], "again and enough can fire at the same moment");
    expect(&rounds("", reached), &["E0254"], "would set n to 3");
}

#[test]
fn a_check_from_the_end_of_the_mission_is_turned_round() {
    let file = |check: &str| mission(BOTH, &format!("{OUT}{LATE}{HOME}<check>{check}</check>"));
    expect(&file("b leads to home or hold"), &[], "");
    expect(&file("home leads to b"), &["E0252"], "did you mean b leads to home?");
    expect(&file("hold leads to a or b"), &["E0252"], "exchange the two sides of leads to");
}
