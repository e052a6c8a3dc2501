//! One mistake whose effects are shown by several examinations: one finding, at its cause.

use super::follow_ups::{BOTH, LATE, OUT, expect, expect_with, mission};

const HOME: &str = r#"<transition name="in" from="b" to="home" on="back.done"/>"#;
const STOP: &str = r#"<transition name="stop" to="hold" operator="true" class="safety"/>"#;
const INNER: &str = r#"<mission name="in" goal="g" safe="s"><place name="p" initial="true" components="back"/><place name="g"/><place name="s"/><transition name="t" from="p" to="g" on="back.done"/><transition name="u" from="p" to="s" timeout="9s"/></mission>"#;

fn with_inner(content: &str) -> String {
    format!(
        r#"<mission {BOTH}><place name="a" initial="true" components="go"/><place name="c"/><place name="d"/><place name="home"/><place name="hold"/>{OUT}{LATE}<submission ref="inner.xml" in="c" out="d"/><transition name="on" from="d" to="home" timeout="1s"/>{content}</mission>"#
    )
    .replace(r#"to="b""#, r#"to="c""#)
    .replace(r#"from="b""#, r#"from="a""#)
}

#[test]
fn a_sub_mission_that_stands_still_is_one_finding_with_and_without_an_emergency() {
    expect_with(&with_inner(""), INNER, &[], "");
    let unnamed = INNER.replace(r#" safe="s""#, "");
    for content in ["", STOP] {
        expect_with(&with_inner(content), &unnamed, &["W0213"], "it stands still");
    }
    let check = "<check>eventually home or hold</check>";
    expect_with(&with_inner(check), &unnamed, &["E0252"], "write safe=\"s\"");
}

#[test]
fn a_guard_that_is_never_true_before_the_goal_is_named() {
    let rounds = |when: &str, set: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="3"/><place name="c"/>{OUT}{LATE}<transition name="again" from="b" to="a" on="back.done" when="n &lt; 1">{set}</transition><transition name="enough" from="b" to="c" on="back.done" when="{when}"/><transition name="end" from="c" to="home" timeout="1s"/><transition name="reset" from="b" to="hold" on="back.failed"><set variable="n" value="0"/></transition><check>fires(end)</check>"#
        );
        mission(BOTH, &content)
    };
    let set = r#"<set variable="n" value="n + 1"/>"#;
    expect(&rounds("n >= 1", set), &[], "");
    expect(&rounds("n > 1", set), &["E0241"], "enough never fires: `n > 1` is false");
    expect(&rounds("n >= 1", ""), &["E0241"], "enough never fires: `n >= 1` is false");
}

#[test]
fn what_always_fires_before_the_goal_is_named() {
    let emergency = STOP.replace(" operator=\"true\"", "");
    let file = mission(BOTH, &format!("{OUT}{HOME}{LATE}{emergency}"));
    expect(&file, &["W0272"], "stop fires as soon as the mission begins");
    let waits = OUT.replace("on=", "after=\"5s\" on=");
    let file = mission(BOTH, &format!("{waits}{HOME}{LATE}{emergency}"));
    expect(&file, &["E0241"], "stop fires as soon as the mission begins");
    let early = r#"<transition name="early" from="a" to="hold" timeout="2s"/>"#;
    let file = mission(BOTH, &format!("{waits}{HOME}{LATE}{early}"));
    expect(&file, &["E0241"], "early always fires before out can");
    expect(&file, &["E0241"], "out never fires: early always fires before it");
}

#[test]
fn a_check_that_a_transition_fires_fails_with_the_reason_why_it_does_not() {
    let content = |when: &str| {
        format!(
            r#"<variable name="n" min="0" max="3"/>{}{HOME}{LATE}<transition name="more" from="b" to="a" operator="true" when="{when}"/><check>fires(more)</check>"#,
            OUT.replace("/>", r#"><set variable="n" value="2"/></transition>"#)
        )
    };
    expect(&mission(BOTH, &content("n &lt; 3")), &[], "");
    expect(&mission(BOTH, &content("n &lt; 2")), &["E0252"], "because n is 2 there");
    expect(&mission(BOTH, &content("n &lt; 2")), &["E0252"], "compare n with a value");
}

#[test]
fn a_check_on_a_firing_after_a_value_outside_its_domain_is_one_finding() {
    let content = format!(
        r#"<variable name="n" min="0" max="1"/><place name="c"/>{}{LATE}<transition name="in" from="b" to="c" on="back.done"><set variable="n" value="n - 1"/></transition><transition name="end" from="c" to="home" operator="true" when="n &lt; 1"/><check>fires(end)</check>"#,
        OUT.replace("/>", r#"><set variable="n" value="0"/></transition>"#)
    );
    expect(&mission(BOTH, &content), &["E0254"], "this check fails, too");
}

#[test]
fn two_sub_missions_that_begin_in_one_place_stop_the_second() {
    let file = with_inner(r#"<place name="e"/><submission ref="inner.xml" in="e" out="home"/>"#)
        .replace(r#"to="home" timeout"#, r#"to="e" timeout"#);
    expect_with(&file, INNER, &[], "");
    let file = file.replace(r#"in="e""#, r#"in="c""#);
    expect_with(&file, INNER, &["W0218"], "did you mean in=\"e\"?");
    let check = "<check>always reachable(home or hold)</check></mission>";
    let file = file.replace("</mission>", check);
    expect_with(&file, INNER, &["E0252"], "did you mean in=\"e\"?");
}

#[test]
fn an_exclusive_component_in_a_place_that_stays_marked_is_one_finding() {
    let fork = |components: &str| {
        format!(
            r#"<mission {BOTH}><place name="a" initial="true"/><place name="r" components="{components}"/><place name="b" components="back"/><place name="c"/><place name="home"/><place name="hold"/><exclusive components="go back"/>
               <transition name="begin" from="a" to="b r" timeout="1s"/><transition name="in" from="b" to="c" on="back.done"/><transition name="late" from="b" to="hold" timeout="9s"/><transition name="end" from="c r" to="home"/>{STOP}</mission>"#
        )
    };
    let (wrong, right) =
        (fork("go"), fork("go").replace(r#"<exclusive components="go back"/>"#, ""));
    expect(&right, &[], "");
    expect(&wrong, &["E0241"], "exclude each other");
}

#[test]
fn the_goal_and_the_safe_place_that_are_exchanged_explain_the_checks() {
    let content = format!(
        "{OUT}{HOME}{LATE}{STOP}<check>never home and a</check><check>reachable(home)</check><check>always not hold or b</check>"
    );
    let file = mission(r#"goal="hold" safe="home""#, &content);
    expect(&file, &["E0252"], "did you mean goal=\"home\" safe=\"hold\"?");
}

#[test]
fn a_period_that_is_too_long_is_one_finding() {
    let content = |period: &str| {
        let of_mission = format!("{BOTH}{period}");
        let content = format!(
            r#"<variable name="n" min="0" max="3"/>{OUT}{LATE}<transition name="again" from="b" to="a" on="back.done" when="n &lt; 1"><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="home" timeout="50s" when="n >= 1"/><check>always reachable(home or hold)</check>"#
        );
        mission(&of_mission, &content)
    };
    expect(&content(""), &[], "");
    expect(&content(" period=\"10min\""), &["W0220"], "write a shorter period");
}

#[test]
fn the_file_of_a_sub_mission_that_never_leaves_has_one_finding() {
    let checked = INNER.replace(
        "</mission>",
        "<check>duration(g or s) &lt;= 9s</check><check>eventually g or s</check></mission>",
    );
    let stuck = checked.replace(
        r#"<transition name="t" from="p" to="g" on="back.done"/>"#,
        r#"<place name="q"/><transition name="t" from="p" to="q" on="back.done"/>"#,
    );
    expect_with(&with_inner(""), &checked, &[], "");
    expect_with(&with_inner(""), &stuck, &["E0241"], "no transition leads to g");
}

#[test]
fn tokens_that_went_to_another_place_than_the_one_that_is_missing() {
    let fork = |to: &str| {
        format!(
            r#"<mission {BOTH}><place name="a" initial="true"/><place name="r" components="go"/><place name="b" components="back"/><place name="c" components="back"/><place name="d"/><place name="home"/><place name="hold"/>
               <transition name="begin" from="a" to="b {to}" timeout="1s"/><transition name="in" from="b" to="c" on="back.done"/><transition name="late" from="b" to="hold" timeout="9s"/><transition name="on" from="c" to="d" timeout="5s"/><transition name="end" from="d r" to="home"/><transition name="lost" from="r" to="hold" operator="true"/><check>bounded(c) &lt;= 1</check></mission>"#
        )
    };
    expect(&fork("r"), &[], "");
    expect(&fork("c"), &["E0241"], "no transition leads to r");
}

#[test]
fn a_guard_that_is_constant_hides_the_tie_of_its_own_transition_alone() {
    let ties = |when: &str| {
        format!(
            r#"<variable name="n" min="0" max="3"/>{OUT}{LATE}
               <transition name="x" from="b" to="home" on="back.done" when="n &lt; 2"><set variable="n" value="n"/></transition><transition name="y" from="b" to="hold" on="back.done" when="n &lt;= 2"/>
               <transition name="z" from="a" to="hold" on="go.failed" when="{when}"/>"#
        )
    };
    expect(&mission(BOTH, &ties("n &lt;= 2")), &["W0218"], "the same report and their guards");
    expect(&mission(BOTH, &ties("n &lt;= 3")), &["W0236", "W0218"], "the same report and their");
}

#[test]
fn a_token_that_was_taken_instead_of_read_is_one_finding() {
    let sample = |arc: &str| {
        let content = format!(
            r#"{OUT}{HOME}{LATE}<place name="seen"/><transition name="sample" to="seen" on="back.failed">{arc}</transition><check>eventually home or hold</check>"#
        );
        mission(BOTH, &content).replace(
            LATE,
            &format!("{LATE}<transition name=\"early\" from=\"a\" to=\"hold\" timeout=\"60s\"/>"),
        )
    };
    expect(&sample(r#"<arc from="b"/>"#), &["E0252"], "write <read place=\"b\"/> in it instead");
}

#[test]
fn two_exclusive_components_that_are_together_name_the_fork() {
    let file = format!(
        r#"<mission {BOTH}><place name="a" initial="true"/><place name="b" components="go"/><place name="c" components="back"/><place name="home"/><place name="hold"/><exclusive components="go back"/><transition name="both" from="a" to="b c" timeout="1s"/><transition name="in" from="b" to="home" on="go.done"/><transition name="late" from="b" to="hold" timeout="60s"/><transition name="lost" from="c" to="hold" timeout="60s"/></mission>"#
    );
    expect(&file, &["E0241"], "this one put a token into each of the places");
}

#[test]
fn a_goal_that_is_the_safe_place_too_is_one_finding() {
    let stop = format!("{STOP}<check>never home and a</check>");
    let file = |of_mission: &str| mission(of_mission, &format!("{OUT}{HOME}{LATE}{stop}"));
    expect(&file(BOTH), &[], "");
    expect(&file(r#"goal="home" safe="home""#), &["W0213"], "did you mean safe=\"hold\"?");
}

#[test]
fn a_transition_without_its_place_is_why_a_check_fails() {
    let out = |from: &str| {
        let out = OUT.replace(r#" from="a""#, from);
        mission(BOTH, &format!("{out}{HOME}{LATE}<check>never a and b</check>"))
    };
    expect(&out(r#" from="a""#), &[], "");
    expect(&out(""), &["E0252"], "out takes tokens from no place");
}

#[test]
fn a_goal_before_a_read_or_a_sub_mission_is_one_finding() {
    let check = "<check>a leads to home or hold</check>";
    let ends =
        |goal: &str| with_inner(check).replace(r#"goal="home""#, &format!(r#"goal="{goal}""#));
    expect_with(&ends("home"), INNER, &[], "");
    expect_with(
        &ends("c"),
        INNER,
        &["E0252"],
        "inner.xml never begins: it leads on from c, the goal",
    );
}

#[test]
fn a_sub_mission_that_leads_on_from_its_goal_is_one_finding() {
    let inner = |goal: &str| {
        INNER.replace(r#"goal="g""#, &format!(r#"goal="{goal}""#)).replace(
            "</mission>",
            r#"<place name="m"/><transition name="v" from="m" to="g" after="1s" operator="true"/><transition name="w" from="m" to="s" timeout="5s"/></mission>"#,
        )
        .replace(r#"to="g" on="back.done""#, r#"to="m" on="back.done""#)
    };
    expect_with(&with_inner(""), &inner("g"), &[], "");
    expect_with(&with_inner(""), &inner("m"), &["W0217"], "did you mean goal=\"g\"?");
}

#[test]
fn a_timeout_that_ends_the_mission_before_all_others_is_one_finding() {
    let file = |time: &str| {
        let content = format!(
            r#"<place name="w" initial="true"/><transition name="long" from="w" to="hold" timeout="{time}"/><transition name="tired" from="a" to="hold" timeout="30s"/>"#
        );
        mission(BOTH, &format!("{OUT}{HOME}{LATE}{content}"))
    };
    expect(&file("85s"), &[], "");
    expect(&file("20s"), &["W0217"], "long ends the mission after 20 s, before");
}

#[test]
fn guards_that_are_never_true_for_one_value_are_one_finding() {
    let rounds = |initial: &str, when: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="3" initial="{initial}"/><place name="c" components="go"/>{OUT}{LATE}<transition name="again" from="b" to="b" on="back.done" when="{when}"><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="c" on="back.done" when="n == 2"><set variable="n" value="3"/></transition><transition name="end" from="c" to="home" on="go.done"/><transition name="skip" from="b" to="home" operator="true"/>"#
        );
        mission(BOTH, &content)
    };
    expect(&rounds("0", "n &lt; 2"), &[], "");
    let shown = "enough never fires: `n == 2` is false";
    expect(&rounds("0", "n &gt; 2"), &["W0217"], shown);
    expect(&rounds("3", "n &lt; 2"), &["W0217"], shown);
    expect(&rounds("3", "n &lt; 2"), &["W0217"], "let it begin with another value");
}

#[test]
fn an_attribute_without_effect_explains_the_check_that_fails() {
    let ask = r#"autonomy="confirm" answer-within="5s" unanswered="fire""#;
    let file = |ask: &str| {
        let out = OUT.replace(r#"on="go.done""#, ask);
        mission(BOTH, &format!("{out}{HOME}{LATE}<check>duration(home or hold) &lt;= 5min</check>"))
    };
    expect(&file(ask), &[], "");
    let endless = ask.replace(r#" answer-within="5s""#, "");
    expect(&file(&endless), &["E0252"], "write answer-within=\"30s\"");
    let operator = ask.replace("confirm", "operator");
    expect(&file(&operator), &["E0252"], "write autonomy=\"confirm\"");
}
