//! The fingerprint of one mission, what changes it, and what does not.

use super::*;

const SYSTEM: &str = r#"<system><component name="a" kind="k"/><component name="b" kind="k"/>
  <component name="c" kind="k" restart="never"/></system>"#;

const MISSION: &str = r#"<mission name="m" goal="z" safe="s" period="1s" resume="hold">
  <variable name="v" source="a.o.x" min="0" max="1"/>
  <variable name="n" min="0" max="9" initial="2"/>
  <place name="x" initial="true" components="a" on-failure="z">
    <parameter component="a" name="q" value="1"/></place>
  <place name="y" components="b"/>
  <place name="z"/>
  <place name="s" class="safety"/>
  <exclusive components="a b"/>
  <transition name="t" from="x" to="z" on="a.done" priority="3" when="v &lt; 30% and c.o">
    <set variable="n" value="n + 1"/></transition>
  <transition name="u" from="x" to="y z" timeout="5s" on-stop-fail="z" on-start-fail="s"
    overrun="s"/>
  <transition name="w" from="x" to="z" autonomy="confirm" answer-within="5s" unanswered="fire"
    lost-link="wait"/>
  <transition name="d" from="y" to="z" not-before="2030-01-01T00:00Z" missed="fire">
    <read place="x" weight="2"/><inhibitor place="s"/><reset place="z"/></transition>
</mission>"#;

#[test]
fn a_mission_has_one_text_and_one_fingerprint_in_all_builds() {
    let plan = compiled(SYSTEM, MISSION);
    assert_eq!(canonical_text(&plan), include_str!("golden.txt"));
    assert_eq!(plan.fingerprint(), "af19f7a8f1a32cf5");
}

#[test]
fn a_change_of_the_mission_changes_the_fingerprint() {
    for (what, before, after) in [
        ("the mission's name", r#"mission name="m""#, r#"mission name="m2""#),
        ("the goal", r#"goal="z""#, r#"goal="y""#),
        ("the safe place", r#"safe="s""#, r#"safe="y""#),
        ("the period", "period=\"1s\"", "period=\"2s\""),
        ("what a restart does", "resume=\"hold\"", "resume=\"safe\""),
        ("the source of a variable", "a.o.x", "a.o.y"),
        ("the domain of a variable", "min=\"0\" max=\"1\"", "min=\"0\" max=\"2\""),
        ("the domain of a counter", "max=\"9\"", "max=\"8\""),
        ("the initial value of a counter", "initial=\"2\"", "initial=\"3\""),
        ("the initial marking", "<place name=\"y\"", "<place name=\"y\" initial=\"true\""),
        ("the components of a place", "components=\"b\"", "components=\"b a\""),
        ("the failure of a place", "on-failure=\"z\"", "on-failure=\"s\""),
        ("the class of a place", "<place name=\"y\"", "<place name=\"y\" class=\"safety\""),
        ("a value of a parameter", "name=\"q\" value=\"1\"", "name=\"q\" value=\"2\""),
        ("the name of a parameter", "name=\"q\"", "name=\"r\""),
        ("what excludes what", "<exclusive components=\"a b\"/>", ""),
        ("the name of a transition", "transition name=\"u\"", "transition name=\"u2\""),
        ("an arc", "to=\"y z\"", "to=\"y\""),
        ("the weight of an arc", "weight=\"2\"", "weight=\"3\""),
        ("a read arc", "<read place=\"x\"", "<inhibitor place=\"x\""),
        ("an inhibitor arc", "<inhibitor place=\"s\"/>", ""),
        ("a reset arc", "<reset place=\"z\"/>", ""),
        ("a report", "on=\"a.done\"", "on=\"a.failed\""),
        ("a priority", "priority=\"3\"", "priority=\"4\""),
        ("a guard", "30%", "31%"),
        ("the data of a guard", "and c.o", "and b.o"),
        ("what a transition sets", "n + 1", "n + 2"),
        ("an interval", "timeout=\"5s\"", "timeout=\"6s\""),
        ("the failure of a stop", "on-stop-fail=\"z\"", "on-stop-fail=\"y\""),
        ("the failure of a start", "on-start-fail=\"s\"", "on-start-fail=\"y\""),
        ("the overrun", "overrun=\"s\"", "overrun=\"y\""),
        ("the time for an answer", "answer-within=\"5s\"", "answer-within=\"6s\""),
        ("the result without an answer", "unanswered=\"fire\"", "unanswered=\"decline\""),
        ("a lost link", "lost-link=\"wait\"", "lost-link=\"fire\""),
        ("a date", "2030-01-01", "2030-01-02"),
        ("a missed date", "missed=\"fire\"", "missed=\"fail\""),
    ] {
        check_changes(what, SYSTEM, &MISSION.replacen(before, after, 1));
    }
    for (what, before, after) in [
        ("whether a component returns", "restart=\"never\"", ""),
        ("the name of a component", "name=\"c\"", "name=\"d\""),
        ("whether a component is commanded", "name=\"b\"", "name=\"b\" controllable=\"false\""),
    ] {
        let mission = MISSION.replace("<exclusive components=\"a b\"/>", "");
        let mission = mission.replace(" and c.o", "").replace(" components=\"b\"", "");
        let changed = compiled(&SYSTEM.replacen(before, after, 1), &mission);
        assert_ne!(compiled(SYSTEM, &mission).fingerprint(), changed.fingerprint(), "{what}");
    }
    let [first, second] = ["<place name=\"y\" components=\"b\"/>", "<place name=\"z\"/>"];
    let swapped = MISSION.replace(first, "").replace(second, &format!("{second}{first}"));
    check_changes("the order of places", SYSTEM, &swapped);
}

#[test]
fn the_patience_of_a_host_is_that_of_its_components() {
    let system = |patience: &str| {
        let host = format!("<system><host name=\"h\" at=\"h.local\"{patience}/>");
        let system = SYSTEM.replacen("<system>", &host, 1);
        system.replacen("name=\"b\"", "name=\"b\" host=\"h\"", 1)
    };
    let usual = compiled(&system(""), MISSION);
    let patient = compiled(&system(" patience=\"1min\""), MISSION);
    assert_ne!(usual.fingerprint(), patient.fingerprint());
    let waits = |plan: &Plan| -> Vec<u64> {
        plan.components().iter().map(|component| component.return_within.as_secs()).collect()
    };
    assert_eq!((waits(&usual), waits(&patient)), (vec![15, 15, 15], vec![15, 60, 15]));
}

#[test]
fn layout_and_order_without_effect_do_not_change_the_fingerprint() {
    let plan = compiled(SYSTEM, MISSION);
    for (what, before, after) in [
        ("a line", "<place name=\"z\"/>", "\n\n   <place name=\"z\"/>"),
        ("a comment", "<place name=\"z\"/>", "<!-- the end --><place name=\"z\"/>"),
        ("the order of attributes", "from=\"x\" to=\"y z\"", "to=\"y z\" from=\"x\""),
        ("the order of names", "to=\"y z\"", "to=\"z y\""),
        ("the spelling of a guard", "v &lt; 30% and c.o", "((v&lt;30%)  and c.o)"),
        ("the spelling of a duration", "timeout=\"5s\"", "timeout=\"5000ms\""),
        ("the spelling of a date", "2030-01-01T00:00Z", "2030-01-01T00:00:00Z"),
        ("a default", "<place name=\"y\"", "<place name=\"y\" initial=\"false\""),
    ] {
        let mission = MISSION.replacen(before, after, 1);
        assert_ne!(mission, MISSION, "{what}: the mission has no `{before}`");
        assert_eq!(compiled(SYSTEM, &mission).fingerprint(), plan.fingerprint(), "{what}");
    }
    let [first, second] =
        ["<component name=\"a\" kind=\"k\"/>", "<component name=\"b\" kind=\"k\"/>"];
    let swapped = SYSTEM.replace(first, "").replace(second, &format!("{second}{first}"));
    let swapped = compiled(&swapped, MISSION);
    assert_eq!(swapped.fingerprint(), plan.fingerprint(), "the order of components");
    assert_eq!(plan.clone().numbered(7).fingerprint(), plan.fingerprint(), "the version's number");
}

#[test]
fn no_name_can_imitate_another_line() {
    assert_eq!(quoted("a\" \\\nb"), r#""a\" \\\nb""#);
}

fn check_changes(what: &str, system: &str, mission: &str) {
    assert_ne!(mission, MISSION, "{what}: nothing was replaced");
    let changed = compiled(system, mission).fingerprint();
    assert_ne!(changed, compiled(SYSTEM, MISSION).fingerprint(), "{what}");
}

fn compiled(system: &str, mission: &str) -> Plan {
    let file = format!("<armor version=\"1\">{system}{mission}</armor>");
    let reading = armor_robotfile::read("m.xml".as_ref(), &mut |_| Ok(file.clone().into_bytes()));
    let configuration = reading.configuration.expect("a configuration");
    let plan = Plan::of(&configuration).unwrap_or_else(|findings| panic!("{findings:?}"));
    plan.expect("a mission")
}
