//! Mistakes with which a mission or a system seems to be complete, and does not work as meant.

use armor_robotfile::{Colours, check, read};

use super::follow_ups::{END, LATE, kinds, only, robot};

fn with(content: &str) -> String {
    robot(r#"safe="hold""#, &format!("{END}{LATE}{content}"))
}

/// The main file and, as `inner.xml`, its sub-mission.
fn found_with(main: &str, inner: &str) -> (Vec<&'static str>, String) {
    let reading = read("a.xml".as_ref(), &mut |path| match path.to_str() {
        Some("a.xml") => Ok(main.into()),
        Some("inner.xml") => Ok(inner.into()),
        _ => Err(std::io::ErrorKind::NotFound.into()),
    });
    let reading = check(reading, &[], Some(&kinds()));
    let text = reading.findings.render(Colours::No);
    let findings = reading.findings.without_notes();
    (findings.iter().map(|finding| finding.code.as_str()).collect(), text)
}

fn nothing(file: &str) {
    let (codes, text) = found_with(file, "");
    assert!(codes.is_empty(), "{file}\n{text}");
}

fn only_with(code: &str, shown: &str, main: &str, inner: &str) {
    let (codes, text) = found_with(main, inner);
    assert_eq!(codes, [code], "{main}\n{inner}\n{text}");
    assert!(text.contains(shown), "{shown}\n{text}");
}

fn inner(ends: &str) -> String {
    format!(
        r#"<armor version="1"><mission name="park" {ends}><place name="creep" initial="true" components="arm"/><place name="settle"/><place name="still"/><place name="missed"/><transition name="arrived" from="creep" to="settle" on="arm.done"/><transition name="creep-late" from="creep" to="missed" timeout="90s"/><transition name="stands" from="settle" to="still" when="n &lt; 3" after="2s"/><transition name="slides" from="settle" to="missed" timeout="30s"/><variable name="n" source="power.state.voltage" min="0" max="9"/></mission></armor>"#
    )
}

fn outer(submission: &str) -> String {
    robot(
        r#"safe="hold""#,
        &format!(
            r#"<place name="gate"/><place name="parked"/><transition name="near" from="a" to="gate" on="go.done"/>{LATE}{submission}<transition name="end" from="parked" to="over"/><transition name="flat" from="a" to="hold" when="power.state.level &lt; 0.1"/>"#
        ),
    )
}

const INNER: &str = r#"<submission ref="inner.xml" in="gate" out="parked"/>"#;

#[test]
fn the_ends_of_a_sub_mission_are_not_exchanged_and_not_the_same() {
    let (codes, text) = found_with(&outer(INNER), &inner(r#"goal="still" safe="missed""#));
    assert!(codes.is_empty(), "{text}");
    let exchanged = inner(r#"goal="missed" safe="still""#);
    only_with("W0276", r#"did you mean goal="still" safe="missed"?"#, &outer(INNER), &exchanged);
    // Nor if another report than done leads there as well.
    let skipped =
        r#"<transition name="skipped" from="creep" to="missed" on="arm.skipped"/></mission>"#;
    let exchanged = exchanged.replace("</mission>", skipped);
    only_with("W0276", "timeouts, failures and other reports than done", &outer(INNER), &exchanged);
    let same = inner(r#"goal="still" safe="still""#);
    only_with("W0276", r#"did you mean safe="missed"?"#, &outer(INNER), &same);
}

#[test]
fn a_wait_after_the_work_may_end_at_the_goal_unless_the_battery_is_low() {
    let file = |late: &str| {
        let content = format!(
            r#"<place name="b"/><transition name="home" from="a" to="b" on="go.done"/><transition name="low" from="b" to="hold" when="power.state.level &lt; 0.1"/><transition name="waited" from="b" to="over" timeout="60s"/>{late}"#
        );
        robot(r#"safe="hold""#, &content)
    };
    nothing(&file(LATE));
    let late = LATE.replace(r#"to="hold""#, r#"to="over""#);
    only("W0276", r#"did you mean goal="hold" safe="over"?"#, &file(&late));
}

#[test]
fn a_goal_that_the_mission_leads_on_from_is_probably_another_place() {
    let park = inner(r#"goal="creep" safe="missed""#);
    only_with("W0217", r#"did you mean goal="still"?"#, &outer(INNER), &park);
    let main = outer(INNER).replace(r#"goal="over""#, r#"goal="gate""#);
    let park = inner(r#"goal="still" safe="missed""#);
    only_with("W0217", r#"inner.xml never begins: it leads on from gate"#, &main, &park);
    only_with("W0217", r#"did you mean goal="over"?"#, &main, &park);
    let main = outer(INNER).replace(r#"safe="hold""#, r#"safe="gate""#);
    only_with("W0217", r#"did you mean safe="hold"?"#, &main, &park);
}

#[test]
fn work_that_begins_together_with_a_wrong_goal_is_one_finding() {
    let fork = r#"<place name="b" components="arm"/><place name="c"/><transition name="begin" from="c" to="a b"/>"#;
    let file =
        with(&format!(r#"{fork}<transition name="stop" from="b" to="hold" on="arm.done"/>"#))
            .replace(r#"initial="true""#, "")
            .replace(r#"name="c""#, r#"name="c" initial="true""#);
    nothing(&file);
    let goal = file.replace(r#"goal="over""#, r#"goal="a""#);
    only("W0217", r#"did you mean goal="over"?"#, &goal);
}

#[test]
fn an_emergency_waits_for_something_and_not_for_a_person() {
    let stop = |attributes: &str| {
        let stop = r#"<transition name="stop" to="hold" class="safety""#;
        with(&format!("{stop} {attributes}/>"))
    };
    nothing(&stop(r#"operator="true""#));
    only("W0280", "is asked as soon as the mission begins", &stop(r#"autonomy="confirm""#));
    let delayed = r#"stop fires `500ms` after the mission begins"#;
    only("W0272", delayed, &stop(r#"after="500ms""#));
    nothing(&stop(r#"after="500ms" when="power.state.level &lt; 0.1""#));
    let bumped = r#"when="power.state.level &lt; 0.1""#;
    let asks = format!(r#"{bumped} autonomy="confirm""#);
    only("W0280", "does not fire before the operator has agreed", &stop(&asks));
    nothing(&stop(&format!(r#"{asks} answer-within="9s" unanswered="fire""#)));
}

#[test]
fn a_timeout_leads_to_another_place_or_sets_something() {
    let again = r#"<transition name="again" from="a" to="a" timeout="30s""#;
    only(
        "W0281",
        "again changes nothing: after 30s it puts the token back into a",
        &with(&format!("{again}/>")),
    );
    only("W0281", "and restarts go only if it is done", &with(&format!("{again}/>")));
    let low = r#"<transition name="low" from="a" to="a" when="power.state.level &lt; 0.1"/>"#;
    let shown =
        "low changes nothing: as long as `power.state.level < 0.1` is true, again and again,";
    only("W0281", shown, &with(low));
    let counts = r#"<variable name="n" min="0" max="9"/><transition name="t" from="a" to="over" on="go.packed" when="n &lt; 3"/>"#;
    let with = |content: &str| robot(r#"safe="hold""#, &format!("{END}{content}"));
    nothing(&with(&format!(r#"{again}><set variable="n" value="n + 1"/></transition>{counts}"#)));
    // A report is used up, and the times of the place begin again.
    nothing(&with(&again.replace("timeout=\"30s\"", r#"on="go.packed"/>"#)));
}

#[test]
fn an_inhibitor_does_not_keep_two_tokens_apart() {
    let file = |kind: &str, more: &str| {
        let content = format!(
            r#"<place name="s" initial="true"/><place name="b" components="arm"/><place name="c"/><place name="d"/><transition name="begin" from="s" to="a b"/><transition name="seen" from="a" to="c" on="go.done"/>{LATE}<transition name="saved" from="b" to="d" after="5s"><{kind} place="c"/></transition><transition name="end" from="c d" to="over"/><transition name="slow" from="b" to="hold" timeout="90s"/>{more}"#
        );
        robot(r#"safe="hold""#, &content).replace(r#"name="a" initial="true""#, r#"name="a""#)
    };
    nothing(&file("read", ""));
    only("W0282", r#"did you mean <read place="c"/>?"#, &file("inhibitor", ""));
    // The place may be emptied in another way.
    nothing(&file("inhibitor", r#"<transition name="back" from="c" to="a" timeout="9s"/>"#));
}

#[test]
fn a_guard_that_is_true_before_another_one_has_its_turn_preempts_it() {
    let file = |first: &str, second: &str| {
        let content = format!(
            r#"<variable name="n" min="0" max="3"/><variable name="level" source="power.state.level" min="0" max="1"/><place name="b"/><transition name="t" from="a" to="b" on="go.packed"/><transition name="again" from="b" to="a" {first}><set variable="n" value="n + 1"/></transition><transition name="enough" from="b" to="hold" {second}/><transition name="u" from="b" to="hold" timeout="60s"/>"#
        );
        with(&content)
    };
    let enough = r#"when="n == 2 or level &lt;= 40%" priority="1""#;
    nothing(&file(r#"after="5s" when="n &lt; 2 and level > 40%""#, enough));
    let wrong = r#"when="n &lt; 2 and level &lt; 40%""#;
    only("W0217", "again never fires: enough fires before it", &file(wrong, enough));
    let after = format!(r#"after="5s" {wrong}"#);
    only(
        "W0217",
        "change one of the two guards",
        &file(&after, &enough.replace(r#" priority="1""#, "")),
    );
    // Without a time and a priority, the order decides; with a time of its own, the other one is later.
    nothing(&file(wrong, &enough.replace(r#" priority="1""#, "")));
    nothing(&file(wrong, &format!(r#"after="9s" {enough}"#)));
}

#[test]
fn a_condition_that_another_one_implies_changes_nothing() {
    let file =
        |guard: &str| with(&format!(r#"<transition name="t" from="a" to="hold" when="{guard}"/>"#));
    let level = "power.state.voltage";
    nothing(&file(&format!("{level} &lt; 3V and {level} > 2V")));
    nothing(&file(&format!("{level} &lt; 3V or {level} > 4V")));
    let both = file(&format!("{level} > 3V and {level} > 2V"));
    only("W0283", "`power.state.voltage > 2V` changes nothing: it is true whenever", &both);
    let either = file(&format!("{level} > 3V or {level} >= 2V"));
    only("W0283", "`power.state.voltage > 3V` changes nothing: whenever it is true,", &either);
    let twice = file(&format!("{level} > 3V and not ({level} &lt; 5V or {level} &lt; 4V)"));
    only("W0283", "`power.state.voltage < 4V` changes nothing", &twice);
}

#[test]
fn a_parameter_does_not_name_the_file_of_the_robot() {
    let file = |name: &str| {
        format!(
            r#"<armor version="1"><system><component name="p" kind="player"><parameter name="file" value="{name}"/></component><component name="m" kind="mapper"/><link from="p.scan" to="m.scan"/></system></armor>"#
        )
    };
    nothing(&file("x.log"));
    nothing(&file("b/a.xml"));
    only("W0151", "p.file names a.xml, which describes this robot itself", &file("a.xml"));
    only("W0151", "name the file that p is to read", &file("./a.xml"));
}

#[test]
fn a_parameter_with_the_name_of_another_component_is_not_only_misspelt() {
    let file = |parameter: &str, laser: &str| {
        super::system(&format!(
            r#"<component name="m" kind="tracker">{parameter}</component><component name="p" kind="patrol">{laser}</component>"#
        ))
    };
    let stay = r#"<parameter name="stay" value="9s"/>"#;
    only("E0110", "was it meant for p? Otherwise", &file(stay, ""));
    let laps = r#"<parameter name="peroid" value="9s"/>"#;
    only("E0110", "did you mean period?", &file(laps, ""));
}

#[test]
fn a_file_that_is_none_of_armor_shows_where_it_is_named() {
    let (codes, text) = found_with(&outer(INNER), "<robot><system/></robot>");
    assert_eq!(codes, ["E0020"], "{text}");
    assert!(text.contains("named here: name another file?"), "{text}");
    assert!(text.contains(r#"<submission ref="inner.xml""#), "{text}");
}

#[test]
fn of_a_file_in_which_nothing_resembles_one_no_line_is_shown() {
    for content in ["root:x:0:0:hidden", "<svg id='hidden'/>", "<!-- hidden", "hidden <mission>"] {
        let (codes, text) = found_with(&outer(INNER), content);
        assert_eq!(codes, ["E0020"], "{text}");
        assert!(text.contains("inner.xml is no Armor file"), "{text}");
        assert!(text.contains(r#"<submission ref="inner.xml""#), "{text}");
        assert!(!text.contains("hidden"), "{text}");
    }
}

/// A fork, a join and a sub-mission.
fn joined(begin: &str, near: &str, submission: &str) -> String {
    let content = format!(
        r#"<place name="s" initial="true"/><place name="b" components="arm"/><place name="filed"/><place name="gate"/><place name="parked"/><transition name="begin" from="s" to="{begin}" when="power.state.level > 0.5"/><transition name="flat" from="s" to="hold" timeout="60s"/><transition name="near" from="a" to="{near}" on="go.done"/>{LATE}{submission}<transition name="saved" from="b" to="filed" on="arm.done"><read place="parked"/></transition><transition name="end" from="parked filed" to="over"/><transition name="slow" from="b" to="hold" timeout="9min"/><transition name="low" from="a" to="hold" when="power.state.level &lt; 0.1"/>"#
    );
    robot(r#"safe="hold""#, &content).replace(r#"name="a" initial="true""#, r#"name="a""#)
}

#[test]
fn a_place_that_was_lost_is_offered_where_it_was_lost() {
    let park = inner(r#"goal="still" safe="missed""#);
    let (codes, text) = found_with(&joined("a b", "gate", INNER), &park);
    assert!(codes.is_empty(), "{text}");
    for (begin, near, submission, shown) in [
        ("a", "gate", INNER, r#"did you mean to="a b" in begin?"#),
        ("b", "gate", INNER, r#"did you mean to="b a" in begin?"#),
        ("a b", "parked", INNER, r#"did you mean to="gate" in near?"#),
        (
            "a b",
            "gate",
            &INNER.replace("parked", "filed"),
            r#"did you mean out="parked" for inner.xml?"#,
        ),
        (
            "a b",
            "gate",
            &INNER.replace("parked", "over"),
            r#"did you mean out="parked" for inner.xml?"#,
        ),
        ("a b", "gate", "", r#"<submission in="gate" out="parked">"#),
    ] {
        only_with("W0212", shown, &joined(begin, near, submission), &park);
    }
}

/// A patrol in a place that these transitions lead on from.
fn patrol(parameter: &str, transitions: &str) -> String {
    format!(
        r#"<armor version="1"><system><component name="p" kind="patrol" rate="5Hz">{parameter}</component><component name="go" kind="explorer"/><component name="power" kind="battery"/></system><mission goal="over" safe="hold"><place name="s" initial="true" components="go"/><place name="a" components="p"/><place name="over"/><place name="hold"/><transition name="begin" from="s" to="a" on="go.done"/><transition name="slow" from="s" to="hold" timeout="9min"/>{transitions}<transition name="flat" from="s" to="hold" when="power.state.level &lt; 0.1"/></mission></armor>"#
    )
}

#[test]
fn the_end_of_a_task_is_waited_for() {
    let late = r#"<transition name="late" from="a" to="over" timeout="9min"/>"#;
    let on =
        |event: &str| format!(r#"<transition name="on" from="a" to="over" on="p.{event}"/>{late}"#);
    nothing(&patrol("", &on("done")));
    let shown = "once it is done, nothing happens in a until late, after 9min";
    only("W0284", shown, &patrol("", late));
    let twice = r#"<parameter name="laps" value="2"/>"#;
    let shown = "on waits in a for lap of p, and no transition waits for its done";
    only("W0284", shown, &patrol(twice, &on("lap")));
    only("W0284", r#"did you mean on="p.done"?"#, &patrol(twice, &on("waypoint")));
    // The first round may be meant; an event that may never come is not.
    nothing(&patrol("", &on("lap")));
    let shown = "on waits in a for skipped of p, and no transition waits for its done";
    only("W0284", shown, &patrol("", &on("skipped")));
    // Another place waits for it.
    let other = r#"<place name="c" components="p"/><transition name="end" from="c" to="over" on="p.done"/>"#;
    let shown = "no transition waits for its done there";
    let enter = r#"<transition name="enter" from="s" to="c" on="go.failed"/>"#;
    only("W0284", shown, &patrol(twice, &format!("{other}{enter}{}", on("lap"))));
    let works_on = on("lap").replacen("to=\"over\"", "to=\"c\"", 1);
    nothing(&patrol(twice, &format!("{other}{works_on}")));
    // One without end is left by other events, and by timeouts.
    let endless = r#"<parameter name="laps" value="0"/>"#;
    nothing(&patrol(endless, late));
    nothing(&patrol(endless, &on("lap")));
    // A guard and an operator are other ways out.
    let low = r#"<transition name="low" from="a" to="hold" when="power.state.level &lt; 0.1"/>"#;
    nothing(&patrol("", &format!("{late}{low}")));
    let stop = r#"<transition name="stop" from="a" to="hold" operator="true"/>"#;
    nothing(&patrol("", &format!("{late}{stop}")));
    // The end of another component counts there.
    let other = r#"<transition name="on" from="a" to="over" on="go.done"/>"#;
    let both = patrol("", &format!("{late}{other}"))
        .replace(r#"name="a" components="p""#, r#"name="a" components="p go""#);
    nothing(&both);
    // Any other fault may be the reason.
    let faulty = patrol("", late).replace(r#"safe="hold""#, "");
    let (codes, text) = found_with(&faulty, "");
    assert!(!codes.contains(&"W0284"), "{text}");
}
