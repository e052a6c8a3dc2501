//! One mistake in a mission that counts its rounds with tokens of one place, next to a fork.

use super::{expect_remedy, findings};
use armor_robotfile::Colours;

/// Two rooms in turn, filmed meanwhile; each visit puts a token, and the end takes three.
const MISSION: &str = r#"<armor version="1">
  <system>
    <component name="rounds" kind="k"/><component name="back" kind="k"/>
    <component name="eye" kind="k"/>
  </system>
  <mission name="count" goal="home" safe="hold">
    <variable name="tour" min="0" max="2" initial="0"/>
    <place name="warm-up" initial="true"/>
    <place name="north" components="rounds"/>
    <place name="south" components="rounds"/>
    <place name="filming" components="eye"/>
    <place name="counted"/>
    <place name="go-back" components="back"/>
    <place name="home"/>
    <place name="hold" class="safety"/>
    <transition name="begin" from="warm-up" to="north filming" timeout="3s"/>
    <transition name="north-done" from="north" to="south counted" on="rounds.done"/>
    <transition name="once-more" from="south" to="north counted" on="rounds.done" when="tour &lt; 1">
      <set variable="tour" value="tour + 1"/>
    </transition>
    <transition name="all-done" from="south filming" to="go-back" on="rounds.done" when="tour == 1">
      <arc from="counted" weight="3"/>
      <set variable="tour" value="2"/>
    </transition>
    <transition name="late" from="south filming" to="go-back" timeout="4min">
      <reset place="counted"/>
    </transition>
    <transition name="recall" from="north filming" to="go-back" operator="true">
      <inhibitor place="counted" weight="3"/>
      <reset place="counted"/>
    </transition>
    <transition name="north-late" from="north filming" to="go-back" timeout="4min">
      <reset place="counted"/>
    </transition>
    <transition name="arrived" from="go-back" to="home" on="back.done"/>
    <transition name="lost" from="go-back" to="hold" timeout="3min"/>
    <transition name="blind" from="go-back" to="hold" operator="true" after="20s"/>
    <check>never filming and go-back</check>
    <check>bounded(counted) &lt;= 3</check>
    <check>duration(home or hold) &lt;= 22min</check>
  </mission>
</armor>"#;

fn expect(right: &str, wrong: &str, remedy: &str) {
    expect_remedy(MISSION, (right, wrong), remedy);
}

#[test]
fn the_mission_without_a_mistake_has_no_finding() {
    let found = findings(MISSION, "");
    assert!(found.is_empty(), "{}", found.render(Colours::No));
}

#[test]
fn a_token_that_is_not_put_is_found_where_it_is_missing() {
    let meant = r#"to="south counted" in north-done"#;
    expect(r#"to="south counted""#, r#"to="south""#, meant);
    let meant = r#"to="north filming" in begin"#;
    expect(r#"to="north filming""#, r#"to="south filming""#, meant);
    let meant = r#"to="north counted" in once-more"#;
    expect(r#"to="north counted""#, r#"to="south counted""#, meant);
}

#[test]
fn another_kind_of_arc_is_found() {
    let arc = r#"<arc from="counted" weight="3"/>"#;
    expect(arc, r#"<arc to="counted" weight="3"/>"#, arc);
    let inhibitor = r#"<inhibitor place="counted" weight="3"/>"#;
    expect(inhibitor, r#"<read place="counted" weight="3"/>"#, inhibitor);
}

#[test]
fn a_token_that_stays_or_is_never_there_is_found_in_the_list() {
    let meant = r#"from="south filming" in all-done"#;
    expect(r#""all-done" from="south filming""#, r#""all-done" from="south""#, meant);
    let wrong = r#""recall" from="north south filming""#;
    expect(
        r#""recall" from="north filming""#,
        wrong,
        r#"from="south filming" in recall, or from="#,
    );
}

#[test]
fn a_count_that_does_not_count_by_one_is_found() {
    expect("tour + 1", "tour + 2", r#"value="tour + 1" in once-more"#);
    expect(r#" when="tour &lt; 1""#, "", r#"when="tour < 1" in once-more"#);
}

#[test]
fn a_timeout_that_is_always_first_is_the_mistake() {
    expect(r#"timeout="3min""#, r#"timeout="3s""#, r#"timeout="3min" in lost"#);
}
