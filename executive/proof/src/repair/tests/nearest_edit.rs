//! Of several edits with which a mission has no fault, the one at the mistake is named.

use super::{expect_remedy, findings};
use armor_robotfile::Colours;

/// Trips that an operator repeats, a question, and places in a row at the end.
const MISSION: &str = r#"<armor version="1">
  <system>
    <component name="deliver" kind="k"/><component name="back" kind="k"/>
    <component name="eye" kind="k"/>
  </system>
  <mission name="courier" goal="parked" safe="halt">
    <variable name="trips" min="0" max="3" initial="0"/>
    <place name="carry" initial="true" components="deliver eye"/>
    <place name="alarm" components="eye"/>
    <place name="unload"/>
    <place name="go-home" components="back"/>
    <place name="charged"/>
    <place name="parked"/>
    <place name="halt"/>
    <transition name="delivered" from="carry" to="unload" on="deliver.done">
      <set variable="trips" value="trips + 1"/>
    </transition>
    <transition name="again" from="unload" to="carry" operator="true" when="trips &lt; 3"/>
    <transition name="enough" from="unload" to="go-home" when="trips == 3" priority="2"/>
    <transition name="unanswered" from="unload" to="go-home" timeout="30s"/>
    <transition name="touched" from="carry" to="alarm" on="eye.touched" priority="1"/>
    <transition name="slow" from="carry" to="halt" timeout="4min"/>
    <transition name="resume" from="alarm" to="carry" autonomy="confirm" after="3s" answer-within="20s" unanswered="decline"/>
    <transition name="given-up" from="alarm" to="halt" timeout="5min"/>
    <transition name="home" from="go-home" to="charged" on="back.done"/>
    <transition name="lost" from="go-home" to="halt" timeout="90s"/>
    <transition name="end" from="charged" to="parked" after="3s"/>
  </mission>
</armor>"#;

fn expect(right: &str, wrong: &str, remedy: &str) {
    expect_remedy(MISSION, (right, wrong), &format!("{remedy}? With it"));
}

#[test]
fn the_mission_without_a_mistake_has_no_finding() {
    let found = findings(MISSION, "");
    assert!(found.is_empty(), "{}", found.render(Colours::No));
}

#[test]
fn the_guard_that_ends_a_count_is_missing() {
    let guard = r#" operator="true" when="trips &lt; 3""#;
    expect(guard, r#" operator="true""#, r#"when="trips < 3" in again"#);
}

#[test]
fn the_operator_of_a_transition_that_fires_before_others_is_missing() {
    expect(r#" operator="true" when"#, " when", r#"operator="true" in again"#);
}

#[test]
fn an_earliest_time_that_is_too_long_is_wrong_and_not_the_timeout_before_it() {
    expect(
        r#"autonomy="confirm" after="3s""#,
        r#"autonomy="confirm" after="3h""#,
        r#"after="3min" in resume"#,
    );
}

#[test]
fn the_last_transition_leads_to_the_goal_and_no_exit_after_a_failure_does() {
    let last = r#"from="charged" to="parked""#;
    expect(last, r#"from="charged" to="carry""#, r#"to="parked" in end"#);
}
