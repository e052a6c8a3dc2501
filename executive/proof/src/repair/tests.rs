//! One wrong value in a mission: one finding, at that value, with the right one.

mod counted_tokens;
mod nearest_edit;

use armor_plan::Plan;
use armor_robotfile::{Colours, Findings, check, read};

use super::{Recheck, explain_by_edit};
use crate::prove::prove;

/// A mission with a fork, a join, a counted round, timeouts, a question and a sub-mission.
const MISSION: &str = r#"<armor version="1">
  <system>
    <component name="scout" kind="k"/><component name="tour" kind="k"/>
    <component name="homing" kind="k"/><component name="writer" kind="k"/>
  </system>
  <mission name="barn" goal="over" safe="hold">
    <variable name="round" min="0" max="3" initial="0"/>
    <place name="ready" initial="true"/>
    <place name="scouting" components="scout" on-failure="touring"/>
    <place name="touring" components="tour"/>
    <place name="returning" components="homing"/>
    <place name="back"/>
    <place name="recording" components="writer"/>
    <place name="gate"/>
    <place name="over"/>
    <place name="hold" class="safety"/>
    <exclusive components="scout tour homing"/>
    <transition name="begin" from="ready" to="scouting recording" autonomy="confirm" answer-within="5s" unanswered="fire"/>
    <transition name="scouted" from="scouting" to="touring" on="scout.done"/>
    <transition name="scout-late" from="scouting" to="touring" timeout="2min"/>
    <transition name="again" from="touring" to="touring" on="tour.done" when="round &lt; 2">
      <set variable="round" value="round + 1"/>
    </transition>
    <transition name="enough" from="touring" to="returning" on="tour.done" when="round == 2">
      <set variable="round" value="3"/>
    </transition>
    <transition name="recall" from="touring" to="returning" operator="true"/>
    <transition name="tour-late" from="touring" to="returning" timeout="4min"/>
    <transition name="arrived" from="returning" to="back" on="homing.done"/>
    <transition name="lost" from="returning" to="hold" timeout="2min"/>
    <transition name="join" from="back recording" to="gate" timeout="6s"/>
    <submission ref="park.xml" in="gate" out="over"/>
    <check>returning leads to over or hold</check>
    <check>duration(over or hold) &lt;= 25min</check>
  </mission>
</armor>"#;

const PARK: &str = r#"<armor version="1">
  <mission name="park" goal="parked" safe="astray">
    <place name="creep" initial="true" components="homing"/>
    <place name="settle"/>
    <place name="parked"/>
    <place name="astray"/>
    <transition name="near" from="creep" to="settle" on="homing.done"/>
    <transition name="creep-late" from="creep" to="astray" timeout="60s"/>
    <transition name="still" from="settle" to="parked" operator="true"/>
    <transition name="slides" from="settle" to="astray" timeout="20s"/>
  </mission>
</armor>"#;

fn findings(mission: &str, park: &str) -> Findings {
    findings_unless(mission, park, &|| false)
}

/// The findings, with a search for edits that can be cancelled.
fn findings_unless(mission: &str, park: &str, is_cancelled: &dyn Fn() -> bool) -> Findings {
    let reading = read("robot.xml".as_ref(), &mut |path| {
        let is_park = path.ends_with("park.xml");
        Ok(if is_park { park } else { mission }.as_bytes().to_vec())
    });
    let mut reading = check(reading, &[], None);
    let configuration = reading.configuration.clone().expect("a configuration");
    let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
    let proven = prove(&configuration, &plan, &|| false);
    reading.findings.extend_proven(proven, &configuration);
    explain_by_edit(&mut reading, &Recheck { overrides: &[], manifests: None, is_cancelled });
    reading.findings.without_notes()
}

/// `right` replaced by `wrong` is one finding on that line, with this remedy.
fn expect(right: &str, wrong: &str, code: &str, remedy: &str) {
    let is_in = |text: &str| text.matches(right).count();
    assert_eq!(is_in(MISSION) + is_in(PARK), 1, "{right}");
    let (mission, park) = (MISSION.replace(right, wrong), PARK.replace(right, wrong));
    let changed = if is_in(PARK) == 1 { PARK } else { MISSION };
    let line = changed[..changed.find(right).unwrap()].lines().count();
    let found = findings(&mission, &park);
    let text = found.render(Colours::No);
    let [finding] = found.iter().collect::<Vec<_>>()[..] else { panic!("{wrong}\n{text}") };
    assert_eq!(finding.code.as_str(), code, "{wrong}\n{text}");
    assert!(finding.remedy.contains(remedy), "{remedy}\n{text}");
    let at = finding.at.as_ref().expect("a location").line_column().0;
    assert_eq!(at, line, "{wrong}\n{text}");
}

/// `right` replaced by `wrong` in `mission` is one finding with this remedy.
fn expect_remedy(mission: &str, (right, wrong): (&str, &str), remedy: &str) {
    assert_eq!(mission.matches(right).count(), 1, "{right}");
    let found = findings(&mission.replace(right, wrong), "");
    let text = found.render(Colours::No);
    assert_eq!(found.iter().count(), 1, "{wrong}\n{text}");
    assert!(text.contains(&format!("did you mean {remedy}")), "{remedy}\n{text}");
}

#[test]
fn a_mission_without_a_mistake_has_no_finding() {
    let found = findings(MISSION, PARK);
    assert!(found.is_empty(), "{}", found.render(Colours::No));
}

#[test]
fn a_wrong_place_is_found_where_it_is_written() {
    let lost = r#"from="returning" to="hold""#;
    expect(
        lost,
        r#"from="touring" to="hold""#,
        "E0252",
        r#"did you mean from="returning" in lost"#,
    );
    let late = r#""tour-late" from="touring""#;
    let meant = r#"did you mean from="touring" in tour-late"#;
    expect(late, r#""tour-late" from="scouting""#, "E0252", meant);
    expect(late, r#""tour-late" from="returning""#, "E0252", meant);
    let arrived = r#"to="back" on"#;
    expect(arrived, r#"to="over" on"#, "W0212", r#"to="back" in arrived"#);
    expect(arrived, "on", "E0241", r#"to="back" in arrived"#);
    let again = r#""again" from="touring" to="touring""#;
    let returning = r#""again" from="touring" to="returning""#;
    expect(again, returning, "W0217", r#"to="touring" in again"#);
    let failure = r#"on-failure="touring""#;
    expect(failure, r#"on-failure="recording""#, "E0252", failure);
    expect(
        r#"from="creep" to="astray""#,
        r#"from="settle" to="astray""#,
        "E0252",
        "from=\"creep\"",
    );
}

#[test]
fn exchanged_places_are_found() {
    let recall = r#""recall" from="touring" to="returning""#;
    let exchanged = r#""recall" from="returning" to="touring""#;
    expect(recall, exchanged, "E0252", r#"from="touring" to="returning" in recall"#);
    let join = r#"from="back recording" to="gate""#;
    expect(join, r#"from="gate" to="back recording""#, "E0241", join);
    let park = r#"in="gate" out="over""#;
    expect(park, r#"in="over" out="gate""#, "E0241", park);
    expect(park, r#"in="gate" out="back""#, "E0241", r#"out="over" in park.xml"#);
}

#[test]
fn a_join_and_a_fork_with_a_place_too_few_or_too_many_are_found() {
    let join = r#"from="back recording""#;
    expect(join, r#"from="returning recording""#, "E0252", join);
    expect(join, r#"from="recording""#, "W0245", r#"from="recording back""#);
    let enough = r#"from="touring" to="returning" on"#;
    let wrong = r#"from="touring recording" to="returning" on"#;
    expect(enough, wrong, "E0252", r#"from="touring" in enough"#);
    let scouted = r#"to="touring" on="scout.done""#;
    let wrong = r#"to="touring recording" on="scout.done""#;
    expect(scouted, wrong, "W0244", r#"to="touring" in scouted"#);
    let condition = r#"timeout="6s"><read place="touring"/></transition>"#;
    expect(r#"timeout="6s"/>"#, condition, "E0241", r#"no <read place="touring"/> in join"#);
}

#[test]
fn a_second_mark_is_asked_about() {
    let two = r#"begins in ready and touring: is that meant? If not, remove initial="true""#;
    let place = r#"<place name="touring""#;
    expect(place, r#"<place name="touring" initial="true""#, "W0244", two);
    let tokens = r#"begins with 2 tokens in ready: is that meant?"#;
    expect(r#""ready" initial="true""#, r#""ready" initial="2""#, "W0244", tokens);
}

#[test]
fn wrong_values_of_a_transition_are_found() {
    let enough = r#"when="round == 2""#;
    let meant = r#"did you mean when="round >= 2" in enough"#;
    expect(enough, r#"when="round &lt; 2""#, "W0218", meant);
    expect(r#"unanswered="fire""#, r#"unanswered="decline""#, "E0252", r#"unanswered="fire""#);
    for (right, wrong) in [
        (
            r#"timeout="2min"/>
    <transition name="again""#,
            r#"timeout="2h"/>
    <transition name="again""#,
        ),
        (r#"timeout="4min""#, r#"timeout="4h""#),
        (r#"timeout="60s""#, r#"timeout="60min""#),
    ] {
        let meant = right.lines().next().unwrap().trim_end_matches("/>");
        expect(right, wrong, "E0252", &format!("did you mean {meant} in "));
    }
    expect(
        "round\" min=\"0\" max=\"3\" initial=\"0\"",
        "round\" min=\"0\" max=\"3\" initial=\"3\"",
        "W0217",
        "initial=\"0\" in round",
    );
}

#[test]
fn a_check_with_its_sides_exchanged_is_found() {
    let check = "returning leads to over or hold";
    expect(check, "over leads to returning", "E0252", &format!("<check>{check}</check>"));
}

#[test]
fn a_missing_transition_is_found_at_its_place() {
    let arrived = r#"    <transition name="arrived" from="returning" to="back" on="homing.done"/>
"#;
    let found = findings(&MISSION.replace(arrived, ""), PARK);
    let text = found.render(Colours::No);
    assert_eq!(found.iter().count(), 1, "{text}");
    assert!(text.contains(r#"from="returning" to="back" on="homing.done"/> missing?"#), "{text}");
}

/// As [`expect`] for an element that is missing: it is not in the mission, and proposed.
fn expect_missing(right: &str, code: &str, remedy: &str) {
    assert_eq!(MISSION.matches(right).count(), 1, "{right}");
    let found = findings(&MISSION.replace(right, ""), PARK);
    let text = found.render(Colours::No);
    let codes: Vec<_> = found.iter().map(|it| it.code.as_str()).collect();
    assert_eq!(codes, [code], "{text}");
    assert!(text.contains(remedy) && text.contains(" missing?"), "{remedy}\n{text}");
}

#[test]
fn a_timeout_that_is_missing_is_proposed_as_other_places_have_one() {
    let late = r#"    <transition name="tour-late" from="touring" to="returning" timeout="4min"/>
"#;
    expect_missing(
        late,
        "E0252",
        r#"is <transition name="…" from="touring" to="returning" timeout="#,
    );
    let lost = r#"    <transition name="lost" from="returning" to="hold" timeout="2min"/>
"#;
    expect_missing(lost, "E0252", r#"is <transition name="…" from="returning" to="hold" timeout="#);
}

#[test]
fn a_count_that_is_wrong_is_found_at_the_transition_that_counts() {
    let again = r#"when="round &lt; 2""#;
    expect(again, r#"when="round &lt;= 2""#, "W0218", r#"when="round < 2" in again"#);
    let set = r#"value="round + 1""#;
    expect(set, r#"value="round""#, "E0252", r#"value="round + 1" in again"#);
    let set = r#"
      <set variable="round" value="round + 1"/>"#;
    expect_missing(set, "E0252", r#"is <set variable="round" value="round + 1"/> in again"#);
}

#[test]
fn a_fork_that_is_missing_is_proposed_from_where_the_mission_begins() {
    let begin = r#"    <transition name="begin" from="ready" to="scouting recording" autonomy="confirm" answer-within="5s" unanswered="fire"/>
"#;
    let found = findings(&MISSION.replace(begin, ""), PARK);
    let text = found.render(Colours::No);
    assert_eq!(found.iter().count(), 1, "{text}");
    assert!(text.contains(r#"from="ready" to="scouting recording"/>"#), "{text}");
}

#[test]
fn an_attribute_that_leads_nowhere_else_is_not_explained_by_a_token_that_ends_the_mission() {
    let within = r#"answer-within="5s""#;
    expect(within, r#"answer-within="5h""#, "E0252", "did you mean answer-within=\"");
    let join = r#"timeout="6s"/>"#;
    expect(join, r#"after="6s"/>"#, "E0252", r#"did you mean timeout="6s" in join"#);
    let mark = r#""ready" initial="true"/>
    <place name="scouting""#;
    let moved = r#""ready"/>
    <place name="scouting" initial="true""#;
    expect(mark, moved, "E0241", r#"initial="true" in ready, and not in scouting"#);
}

#[test]
fn a_time_that_is_far_too_long_is_found_where_it_is_written() {
    let both = r#"did you mean timeout="20s" in slides, or timeout="2min" in slides"#;
    expect(r#"timeout="20s""#, r#"timeout="20min""#, "E0252", both);
    let both = r#"did you mean timeout="40s" in tour-late, or timeout="4min" in tour-late"#;
    expect(r#"timeout="4min""#, r#"timeout="40min""#, "E0252", both);
}

#[test]
fn a_cancelled_search_keeps_the_findings() {
    let wrong = MISSION.replace(r#"timeout="4min""#, r#"timeout="4h""#);
    let explained = findings(&wrong, PARK).render(Colours::No);
    assert!(explained.contains("did you mean"), "{explained}");
    let cancelled = findings_unless(&wrong, PARK, &|| true).render(Colours::No);
    assert!(cancelled.contains("can take"), "{cancelled}");
    assert!(!cancelled.contains("did you mean"), "{cancelled}");
}

#[test]
fn what_no_edit_explains_keeps_its_findings() {
    // Nothing in the file shows which time was meant.
    let found = findings(&MISSION.replace("&lt;= 25min", "&lt;= 10s"), PARK);
    let text = found.render(Colours::No);
    assert!(text.contains("can take"), "{text}");
    assert!(!text.contains("did you mean"), "{text}");
    // A transition without a condition is found where it is, not where its place could be another.
    let wrong = MISSION.replace(
        " operator=\"true\"/>\n    <transition name=\"tour-late",
        "/>\n    <transition name=\"tour-late",
    );
    let text = findings(&wrong, PARK).render(Colours::No);
    assert!(text.contains("recall has no condition"), "{text}");
    assert!(!text.contains("did you mean"), "{text}");
}
