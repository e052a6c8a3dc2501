use armor_robotfile::mission::ArcKind;

use super::*;

const FILE: &str = r#"<armor version="1">
  <system>
    <component name="explorer" kind="explorer"/>
  </system>
  <mission goal="home" safe="hold">
    <place name="explore" initial="true" components="explorer"/>
    <place name="home"/>
    <place name="hold"/>
    <!-- mapped in time -->
    <transition name="seen" from="explore" to="home" on="explorer.done"/>
    <transition name="late" from="explore" to="hold" timeout="90s" overrun="hold"/>
  </mission>
</armor>
"#;

fn document() -> Document {
    Document::open("a.xml".as_ref(), FILE.as_bytes()).unwrap()
}

/// The lines that an edit removes and adds.
fn check(edit: impl FnOnce(&mut Document), gone: &[&str], new: &[&str]) {
    let mut document = document();
    edit(&mut document);
    let after = String::from_utf8(document.bytes().to_vec()).unwrap();
    let lines = |text: &str| text.lines().map(|line| line.trim().to_owned()).collect::<Vec<_>>();
    let (before, after) = (lines(FILE), lines(&after));
    let only = |these: &[String], those: &[String]| {
        these.iter().filter(|line| !those.contains(line)).cloned().collect::<Vec<_>>()
    };
    assert_eq!((only(&before, &after), only(&after, &before)), (owned(gone), owned(new)));
}

fn owned(lines: &[&str]) -> Vec<String> {
    lines.iter().map(|line| (*line).to_owned()).collect()
}

#[test]
fn places_and_transitions_come_with_names_of_their_own_and_their_positions() {
    let at = Position { x: 1.0, y: 2.0 };
    check(
        |document| {
            assert_eq!(add_place(document, "home", &["explorer"], at).unwrap(), "home-2");
            let added = add_transition(document, "late", &["explore"], &["home-2"], Some(at));
            assert_eq!(added.unwrap(), "late-2");
        },
        &[],
        &[
            r#"<place name="home-2" components="explorer"/>"#,
            r#"<transition name="late-2" from="explore" to="home-2"/>"#,
            "<layout>",
            r#"<block of="home-2" x="1" y="2"/>"#,
            r#"<block transition="late-2" x="1" y="2"/>"#,
            "</layout>",
        ],
    );
}

#[test]
fn the_first_place_of_a_mission_is_where_it_begins() {
    let mut document =
        Document::open("a.xml".as_ref(), b"<armor version=\"1\"><mission/></armor>").unwrap();
    add_place(&mut document, "start", &[], Position { x: 0.0, y: 0.0 }).unwrap();
    let text = String::from_utf8(document.bytes().to_vec()).unwrap();
    assert!(text.contains(r#"<place name="start" initial="true"/>"#), "{text}");
}

#[test]
fn an_arc_is_listed_until_it_has_a_weight() {
    check(
        |document| {
            add_arc(document, "seen", "hold", ArcKind::Put).unwrap();
            set_weight(document, "seen", "hold", ArcKind::Put, 3).unwrap();
            add_arc(document, "seen", "hold", ArcKind::Inhibitor).unwrap();
        },
        &[r#"<transition name="seen" from="explore" to="home" on="explorer.done"/>"#],
        &[
            r#"<transition name="seen" from="explore" to="home" on="explorer.done">"#,
            r#"<arc to="hold" weight="3"/>"#,
            r#"<inhibitor place="hold"/>"#,
            "</transition>",
        ],
    );
    check(
        |document| {
            add_arc(document, "seen", "hold", ArcKind::Put).unwrap();
            set_weight(document, "seen", "hold", ArcKind::Put, 3).unwrap();
            set_arc_kind(document, "seen", "hold", ArcKind::Put, ArcKind::Read).unwrap();
            remove_arc(document, "seen", "hold", ArcKind::Read).unwrap();
        },
        &[],
        &[],
    );
}

#[test]
fn a_place_goes_with_all_that_leads_to_it() {
    check(
        |document| remove(document, &[crate::Item::place("hold")]).unwrap(),
        &[
            r#"<mission goal="home" safe="hold">"#,
            r#"<place name="hold"/>"#,
            r#"<transition name="late" from="explore" to="hold" timeout="90s" overrun="hold"/>"#,
        ],
        &[r#"<mission goal="home">"#, r#"<transition name="late" from="explore" timeout="90s"/>"#],
    );
}

#[test]
fn much_is_removed_in_a_few_edits() {
    let mission = |count: usize| {
        let number = |n: usize| {
            format!(
                "    <place name=\"p{n}\"/>\n    <transition name=\"t{n}\" from=\"first p{n}\">\n      \
                 <arc to=\"p{n}\" weight=\"2\"/>\n      <read place=\"first\"/>\n    \
                 </transition>\n    <check>never first</check>\n"
            )
        };
        let numbers: String = (0..count).map(number).collect();
        format!(
            "<armor version=\"1\">\n  <mission>\n    <place name=\"first\"/>\n{numbers}  \
             </mission>\n</armor>\n"
        )
    };
    let edits_of = |count: usize| {
        let text = mission(count);
        let mut document = Document::open("m.xml".as_ref(), text.as_bytes()).unwrap();
        let place = |n| crate::Item::place(format!("p{n}"));
        let items: Vec<_> = (0..count).flat_map(|n| [place(n), crate::Item::Check(n)]).collect();
        remove(&mut document, &items).unwrap();
        let text = String::from_utf8_lossy(document.bytes()).into_owned();
        assert!(!text.contains("check") && !text.contains("\"p"), "{text}");
        assert_eq!(text.matches("from=\"first\"").count(), count);
        assert_eq!(text.matches("<read place=\"first\"/>").count(), count);
        document.revision()
    };
    assert_eq!((edits_of(2), edits_of(80)), (3, 3));
}

#[test]
fn timing_is_one_attribute_and_takes_with_it_what_it_makes_meaningless() {
    let late = r#"<transition name="late" from="explore" to="hold" timeout="90s" overrun="hold"/>"#;
    let set = |timing: Timing| {
        move |document: &mut Document| {
            set_timing(document, "late", &timing).unwrap();
        }
    };
    check(
        set(Timing::Interval("2s".into(), "5s".into())),
        &[late],
        &[
            r#"<transition name="late" from="explore" to="hold" overrun="hold" interval="[2s,5s]"/>"#,
        ],
    );
    check(
        set(Timing::After("2s".into())),
        &[late],
        &[r#"<transition name="late" from="explore" to="hold" after="2s"/>"#],
    );
    check(
        set(Timing::Timeout("1min".into())),
        &[late],
        &[r#"<transition name="late" from="explore" to="hold" timeout="1min" overrun="hold"/>"#],
    );
}

#[test]
fn who_decides_leaves_nothing_of_who_decided_before() {
    check(
        |document| {
            set_decides(document, "seen", Decides::Confirm).unwrap();
            let item = Item::Transition("seen");
            document.set_attribute(item, "answer-within", Some("30s")).unwrap();
            set_decides(document, "seen", Decides::Operator).unwrap();
        },
        &[r#"<transition name="seen" from="explore" to="home" on="explorer.done"/>"#],
        &[
            r#"<transition name="seen" from="explore" to="home" on="explorer.done" operator="true"/>"#,
        ],
    );
}

#[test]
fn sets_checks_and_sub_missions_are_found_by_their_number() {
    check(
        |document| {
            add_exclusive(document, &["explorer", "homing"]).unwrap();
            toggle_exclusive(document, 0, "driver", true).unwrap();
            toggle_exclusive(document, 0, "explorer", false).unwrap();
            add_check(document, "always explore").unwrap();
            add_check(document, "never home").unwrap();
            set_check(document, 0, "duration(home) < 20min").unwrap();
            remove(document, &[crate::Item::Check(1)]).unwrap();
            add_submission(document, "dock.xml").unwrap();
            set_submission(document, 0, "in", Some("home")).unwrap();
            add_variable(document, "battery", Some("power.state.level")).unwrap();
        },
        &[],
        &[
            r#"<variable name="battery" source="power.state.level"/>"#,
            r#"<exclusive components="homing driver"/>"#,
            r#"<submission ref="dock.xml" in="home"/>"#,
            "<check>duration(home) &lt; 20min</check>",
        ],
    );
}

#[test]
fn what_a_place_does_not_activate_gets_no_values_from_it() {
    check(
        |document| {
            document.set_place_parameter("explore", "explorer", "area", Some("north")).unwrap();
            set_component(document, "explore", "driver", true).unwrap();
            set_component(document, "explore", "explorer", false).unwrap();
        },
        &[r#"<place name="explore" initial="true" components="explorer"/>"#],
        &[r#"<place name="explore" initial="true" components="driver"/>"#],
    );
}
