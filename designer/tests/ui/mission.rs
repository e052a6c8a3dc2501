//! The view of the mission: drawn, edited, simulated, proven, all by accessible names.

use eframe::egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::{NodeT, Queryable};

use crate::ui::Window;

const SURVEY: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <component name="lamp" kind="lamp"/>
    <link from="eye.target" to="arm.target"/>
  </system>
  <mission goal="home" safe="hold">
    <place name="explore" initial="true" components="arm"/>
    <place name="home"/>
    <place name="hold"/>
    <transition name="seen" from="explore" to="home" on="arm.done"/>
    <transition name="late" from="explore" to="hold" timeout="90s"/>
    <layout>
      <block of="explore" x="0" y="0"/>
      <block of="home" x="400" y="-100"/>
      <block of="hold" x="400" y="100"/>
      <block transition="seen" x="250" y="-100"/>
      <block transition="late" x="250" y="100"/>
    </layout>
  </mission>
</armor>
"#;

/// A window on a mission, with its view open.
fn mission(text: &str) -> Window {
    let mut window = Window::open(Some(text));
    window.click("view: Mission");
    window
}

fn check(window: &mut Window, expected: &str) {
    let text = window.text();
    assert!(text.contains(expected), "{expected} is not in {text}");
}

#[test]
fn places_and_transitions_are_drawn_with_names() {
    let window = mission(SURVEY);
    for label in ["place explore", "place home", "transition late", "arc: late puts into hold"] {
        assert!(window.has(label), "{label}");
    }
}

#[test]
fn a_mission_is_begun_with_a_place_from_the_palette() {
    let empty = "<armor version=\"1\">\n  <system>\n  </system>\n</armor>\n";
    let mut window = mission(empty);
    let drawing = window.at("drawing of the mission");
    let from = window.at("new place");
    window.drag(from, drawing);
    check(&mut window, r#"<place name="place" initial="true"/>"#);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), empty);
}

#[test]
fn two_places_are_joined_by_a_transition_in_one_step() {
    let mut window = mission(SURVEY);
    window.drag_between("arc from place home", "place hold");
    check(&mut window, r#"<transition name="to-hold" from="home" to="hold"/>"#);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), SURVEY);
}

#[test]
fn arcs_of_all_kinds_are_drawn_and_doubles_are_refused() {
    let mut window = mission(SURVEY);
    window.click("Open the palette");
    window.drag_between("arc from transition seen", "place hold");
    check(&mut window, r#"from="explore" to="home hold" on="arm.done""#);
    window.click("arcs inhibit");
    window.drag_between("arc from place hold", "transition seen");
    check(&mut window, r#"<inhibitor place="hold"/>"#);
    window.click("arcs take");
    let before = window.text();
    window.drag_between("arc from place explore", "transition late");
    assert_eq!(window.text(), before);
    assert!(
        window.last_message().contains("late takes from explore already"),
        "{}",
        window.last_message()
    );
}

#[test]
fn an_arc_has_a_weight_and_a_kind() {
    let mut window = mission(SURVEY);
    window.click("arc: late puts into hold");
    window.fill("weight", "3");
    check(&mut window, r#"<arc to="hold" weight="3"/>"#);
    window.choose("kind of arc", "needs tokens and leaves them (read)");
    check(&mut window, r#"<read place="hold" weight="3"/>"#);
}

#[test]
fn the_components_of_a_place_are_a_checklist() {
    let mut window = mission(SURVEY);
    window.click("place home");
    window.click("lamp is active in home");
    check(&mut window, r#"<place name="home" components="lamp"/>"#);
    window.click("Safe: where the mission goes when something fails");
    check(&mut window, r#"<mission goal="home" safe="home">"#);
    window.click("lamp is active in home");
    check(&mut window, r#"<place name="home"/>"#);
}

#[test]
fn a_component_whose_kind_no_mission_controls_is_grey() {
    let view = "    <component name=\"screen\" kind=\"view\"/>\n  </system>";
    let mut window = mission(&SURVEY.replace("  </system>", view));
    let before = window.text();
    window.click("place home");
    let label = "screen is active in home";
    let is_grey = |window: &Window, label: &str| {
        window.harness.get_by_label(label).accesskit_node().is_disabled()
    };
    assert!(is_grey(&window, label) && !is_grey(&window, "lamp is active in home"));
    window.click(label);
    assert_eq!(window.text(), before);
    assert!(window.has("the kind view is always active: no mission controls it"));
}

#[test]
fn a_place_is_renamed_wherever_it_is_named() {
    let mut window = mission(SURVEY);
    window.click("place home");
    window.fill("name of the place", "dock");
    check(&mut window, r#"<mission goal="dock" safe="hold">"#);
    check(&mut window, r#"<transition name="seen" from="explore" to="dock" on="arm.done"/>"#);
    assert!(window.has("place dock"));
}

#[test]
fn what_a_transition_waits_for_is_edited_in_its_panel() {
    let mut window = mission(SURVEY);
    window.click("transition late");
    window.fill("timeout", "2min");
    check(&mut window, r#"timeout="2min""#);
    window.choose("when it fires", "between two times");
    check(&mut window, r#"interval="[2min,inf)""#);
    window.fill("latest time", "5min");
    check(&mut window, r#"interval="[2min,5min]""#);
    window.choose("who decides", "the operator");
    check(&mut window, r#"operator="true""#);
    window.choose("report of", "arm");
    window.fill("report", "packed");
    check(&mut window, r#"on="arm.packed""#);
    window.fill("priority", "5");
    check(&mut window, r#"priority="5""#);
}

#[test]
fn the_events_that_a_kind_declares_are_offered() {
    let mut window = mission(SURVEY);
    window.click("transition late");
    window.choose("report of", "arm");
    window.click("packed");
    check(&mut window, r#"on="arm.packed""#);
}

#[test]
fn a_mistake_in_a_guard_is_shown_below_it_while_it_is_typed() {
    let mut window = mission(SURVEY);
    window.click("transition late");
    window.click("guard");
    window.write("eye.target.x < ");
    assert!(
        window.has_part("the guard ends here"),
        "the mistake is shown before the field is left"
    );
    window.write("2");
    assert!(!window.has_part("the guard ends here"));
    window.key(Key::Enter);
    check(&mut window, r#"when="eye.target.x &lt; 2""#);
    window.fill("guard", "eye.image.x < 2");
    assert!(window.has_part("there is no field of Image called x"));
}

#[test]
fn a_field_that_is_left_for_another_thing_takes_effect_all_the_same() {
    let mut window = mission(SURVEY);
    window.click("transition late");
    window.click("guard");
    window.write("true");
    window.click("place hold");
    check(&mut window, r#"when="true""#);
}

#[test]
fn what_is_removed_takes_its_arcs_along_and_comes_back() {
    let mut window = mission(SURVEY);
    window.click("place hold");
    window.key(Key::Delete);
    let text = window.text();
    assert!(!text.contains("hold"), "{text}");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), SURVEY);
}

#[test]
fn what_comes_back_is_selected() {
    let mut window = mission(SURVEY);
    window.click("place hold");
    window.key(Key::Delete);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert!(window.has("name of the place"), "its panel is open");
}

#[test]
fn a_sub_mission_is_a_way_in_and_out() {
    let inner = "<submission ref=\"dock.xml\" in=\"hold\" out=\"home\"/>\n    <layout>";
    let mut window = mission(&SURVEY.replace("<layout>", inner));
    window.click("place home");
    let ways = window.harness.query_all_by_label("in by").count();
    assert_eq!(ways, 2, "by the transition seen and by the sub-mission");
}

#[test]
fn copies_lead_to_copies() {
    let mut window = mission(SURVEY);
    window.keys(Modifiers::COMMAND, Key::A);
    window.keys(Modifiers::COMMAND, Key::D);
    check(&mut window, r#"<place name="explore-2" components="arm"/>"#);
    check(&mut window, r#"<transition name="late-2" from="explore-2" to="hold-2" timeout="90s"/>"#);
}

#[test]
fn a_net_without_positions_is_placed_and_a_drag_writes_all_of_them() {
    let bare = SURVEY.split("    <layout>").next().unwrap().to_owned() + "  </mission>\n</armor>\n";
    let mut window = mission(&bare);
    let from = window.at("place home");
    window.drag(from, from + vec2(40.0, 60.0));
    for name in ["of=\"explore\"", "of=\"home\"", "transition=\"late\""] {
        check(&mut window, &format!("<block {name}"));
    }
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), bare);
}

#[test]
fn the_mission_is_played_by_hand_and_back() {
    let mut window = mission(SURVEY);
    window.key(Key::F5);
    assert!(window.has("Fire seen") && window.has("Fire late"));
    window.click("Fire late");
    assert!(window.has_part("in the safe place"));
    assert!(window.has("1 min 30 s"));
    window.click("Back");
    assert!(window.has("Fire seen"));
    let seen = window.at("transition seen");
    window.click_at(seen);
    assert!(window.has_part("goal reached"));
    assert_eq!(window.text(), SURVEY, "playing changes nothing");
    window.click("End");
    assert!(!window.has("Back"));
}

#[test]
fn it_plays_itself_to_an_end() {
    let mut window = mission(SURVEY);
    window.key(Key::F5);
    for _ in 0..20 {
        window.key(Key::F10);
    }
    assert!(window.has_part("the mission is over"));
}

#[test]
fn a_counterexample_is_played_firing_by_firing() {
    let file = SURVEY.replace(
        "    <layout>",
        "    <transition name=\"stray\" from=\"home\" to=\"hold\" timeout=\"1s\"/>\n    \
         <check>never hold</check>\n    <layout>",
    );
    let mut window = mission(&file);
    assert!(window.has_part("violated"));
    window.click_part("Play its firing");
    assert!(window.has("Run being shown"));
    assert!(window.has_part("> 1. late at 1 min 30 s"));
    window.key(Key::F10);
    assert!(window.has_part("in the safe place"));
    let stray = window.harness.get_by_label("transition stray").accesskit_node();
    let description = stray.description().unwrap_or_default();
    assert!(description.contains("stray never fires"), "{description}");
}

#[test]
fn checks_variables_and_exclusive_sets_are_edited_in_the_mission_s_panel() {
    let file =
        SURVEY.replace(r#"<place name="home"/>"#, r#"<place name="home" components="lamp"/>"#);
    let mut window = mission(&file);
    window.click("Add an exclusive set");
    check(&mut window, r#"<exclusive components="arm lamp"/>"#);
    window.click("Add a check…");
    window.click("always reachable(home or hold)");
    check(&mut window, "<check>always reachable(home or hold)</check>");
    assert!(window.has_part("valid"));
    window.click("Remove exclusive set 1");
    assert!(!window.text().contains("exclusive"));
}

#[test]
fn a_variable_that_transitions_set_has_a_value_at_the_start() {
    let mut window = mission(SURVEY);
    window.click("Add a variable…");
    window.click("Set by transitions");
    check(&mut window, r#"<variable name="count" min="0" max="3" initial="0"/>"#);
    assert!(window.has("count at the start"));
}

impl Window {
    /// Chooses from a drop-down list.
    pub fn choose(&mut self, label: &str, choice: &str) {
        self.click(label);
        // The list lies over all else that has the name.
        let at = self.harness.get_all_by_label(choice).last().unwrap().rect().center();
        self.click_at(at);
    }

    /// The names that contain this.
    pub fn parts(&self, part: &str) -> Vec<String> {
        let nodes = self.harness.query_all_by_label_contains(part);
        nodes.filter_map(|node| node.accesskit_node().label().or(node.value())).collect()
    }

    /// Whether something has this in its name.
    pub fn has_part(&self, part: &str) -> bool {
        self.harness.query_all_by_label_contains(part).next().is_some()
    }

    pub fn click_part(&mut self, part: &str) {
        let at = self.harness.get_by_label_contains(part).rect().center();
        self.click_at(at);
    }
}

#[test]
fn an_arc_is_led_elsewhere_by_its_end_with_its_weight_or_let_go() {
    let mut window = mission(SURVEY);
    window.click("arc: late puts into hold");
    window.fill("weight", "3");
    window.drag_between("end of arc: late puts into hold", "place home");
    check(&mut window, r#"<arc to="home" weight="3"/>"#);
    assert!(!window.text().contains(r#"<arc to="hold""#));
    window.drag_between("start of arc: late puts into home", "transition seen");
    assert!(
        window.last_message().contains("seen puts into home already"),
        "{}",
        window.last_message()
    );
    let end = window.at("end of arc: late puts into home");
    window.drag(end, end + vec2(0.0, 250.0));
    assert!(!window.text().contains("<arc"), "{}", window.text());
    window.keys(Modifiers::COMMAND, Key::Z);
    window.keys(Modifiers::COMMAND, Key::Z);
    check(&mut window, r#"<arc to="hold" weight="3"/>"#);
}

#[test]
fn a_transition_is_selected_and_moved_at_any_size() {
    for zooms in 0..6 {
        let mut window = mission(SURVEY);
        for _ in 0..zooms {
            window.keys(Modifiers::COMMAND, Key::Minus);
        }
        window.click("transition late");
        assert!(window.has("name of the transition"), "{zooms}");
        let bar = window.at("transition late");
        window.drag(bar, bar + vec2(40.0, 40.0));
        let text = window.text();
        assert!(!text.contains(r#"<block transition="late" x="250" y="100"/>"#), "{zooms}: {text}");
        assert_eq!(text.matches("<transition ").count(), 2, "{zooms}: {text}");
    }
}
