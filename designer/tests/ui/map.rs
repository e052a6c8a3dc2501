//! The view of the map: looked at, drawn and edited by accessible names.

use armor_designer::{Command, Kinds, View};
use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers, Pos2, Vec2, vec2};
use egui_kittest::kittest::{NodeT, Queryable};

use crate::ui::{Window, bench_kinds, read};

const DRAWN: &str = r#"<armor version="1">
  <system name="bench">
    <component name="way" kind="way"/>
  </system>
  <mission goal="over" safe="hold">
    <!-- Metres from the door. -->
    <map>
      <point name="P1" at="0 0"/> <!-- the door -->
      <point name="P2" at="10 0"/>
      <point name="P3" at="10 8"/>
      <zone name="yard" kind="no-go" margin="0.5m" shape="2,2 8,2 8,6 2,6"/>
      <zone name="well" kind="observe" shape="circle 14,4 1m"/>
      <line name="green" kind="phase" shape="-2,-3 16,-3"/>
      <rally name="R1" at="-2 4"/>
      <symbol at="16 7" sidc="10031000131211000000" label="A"/>
    </map>
    <route name="red" mover="way.route" start="P1" out="over" rally-by="1min">
      <leg name="l1" to="P2" by="1min"/>
      <stay name="s1" for="2s"/>
      <leg name="l2" to="P3" by="1min"/>
      <otherwise on="late blocked" do="rally"/>
    </route>
    <place name="over"/>
    <place name="hold"/>
  </mission>
</armor>
"#;

/// A window on a file, with the view of its map open.
pub(super) fn map(text: &str) -> Window {
    Window::open_as(Some(text), |_, start| {
        start.kinds = Some(Kinds::of([bench_kinds::way()], "stock"));
        start.view = View::Map;
    })
}

/// One line has changed to `expected`, and undo restores the file.
#[track_caller]
fn check_line(window: &mut Window, before: &str, expected: &str) {
    let after = window.text();
    let changed: Vec<_> =
        after.lines().filter(|line| !before.lines().any(|it| it == *line)).collect();
    assert_eq!(changed.len(), 1, "{after}");
    assert!(changed[0].contains(expected), "{expected} is not in {}", changed[0]);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), before);
}

/// Where a position of the map is in the window: between P1 at 0 0 and P2 at 10 0.
fn place(window: &Window, x_m: f32, y_m: f32) -> Pos2 {
    let (origin, along) = (window.at("point P1"), window.at("point P2"));
    let metre = (along - origin).x / 10.0;
    origin + vec2(x_m, -y_m) * metre
}

#[test]
fn everything_on_the_map_has_a_name_and_can_be_selected() {
    let mut window = map(DRAWN);
    for label in [
        "point P1",
        "point P3",
        "rally point R1",
        "zone yard",
        "zone well",
        "line green",
        "leg l1 of route red",
        "stay s1 of route red",
        "leg l2 of route red",
    ] {
        assert!(window.has(label), "{label}");
        window.click(label);
        let node = window.harness.get_by_label(label);
        assert_eq!(node.accesskit_node().is_selected(), Some(true), "{label}");
        assert_eq!(node.accesskit_node().role(), Role::ListItem);
    }
    window.click_part("symbol 1: ");
    assert_eq!(window.value("text"), "A");
}

#[test]
fn a_dragged_point_changes_one_line() {
    let mut window = map(DRAWN);
    let to = place(&window, 12.0, -1.0);
    let from = window.at("point P2");
    window.drag(from, to);
    check_line(&mut window, DRAWN, r#"<point name="P2" at="12 -1"/>"#);
    assert_eq!(window.last_message(), "Undone: move point P2");
    let from = window.at("rally point R1");
    let to = place(&window, -1.0, 5.0);
    window.drag(from, to);
    check_line(&mut window, DRAWN, r#"<rally name="R1" at="-1 5"/>"#);
}

#[test]
fn a_zone_that_crosses_itself_is_drawn_and_a_corner_of_it_can_be_dragged() {
    let crossing = DRAWN.replace("2,2 8,2 8,6 2,6", "2,2 8,6 8,2 2,6");
    let mut window = map(&crossing);
    window.click("zone yard");
    let reasons =
        |window: &Window| window.harness.query_all_by_label_contains("cross or touch").count();
    assert!(reasons(&window) > 0);
    let from = window.at("corner 2 of zone yard");
    let to = place(&window, 8.0, 1.0);
    window.drag(from, to);
    assert_eq!(window.text(), DRAWN.replace("2,2 8,2 8,6 2,6", "2,2 8,1 8,2 2,6"));
    assert_eq!(reasons(&window), 0);
}

#[test]
fn a_zone_that_is_drawn_across_itself_says_what_to_do() {
    let mut window = map(DRAWN);
    window.click("map tool: Zone: no-go");
    for (x_m, y_m) in [(2.0, -1.0), (6.0, -2.0), (6.0, -1.0), (2.0, -2.0)] {
        let at = place(&window, x_m, y_m);
        window.click_at(at);
    }
    window.key(Key::Enter);
    let message = window.last_message();
    assert!(message.contains("cross or touch. Drag a corner of it."), "{message}");
    assert!(window.has("zone zone1") && window.has("corner 1 of zone zone1"));
}

#[test]
fn corners_are_moved_added_and_removed() {
    let mut window = map(DRAWN);
    window.click("zone yard");
    let from = window.at("corner 3 of zone yard");
    let to = place(&window, 9.0, 7.0);
    window.drag(from, to);
    check_line(&mut window, DRAWN, r#"shape="2,2 8,2 9,7 2,6""#);
    window.click("zone yard");
    let from = window.at("new corner 2 of zone yard");
    let to = place(&window, 5.0, 1.0);
    window.drag(from, to);
    check_line(&mut window, DRAWN, r#"shape="2,2 5,1 8,2 8,6 2,6""#);
    window.click("zone yard");
    window.click("corner 4 of zone yard");
    window.key(Key::Delete);
    check_line(&mut window, DRAWN, r#"shape="2,2 8,2 8,6""#);
}

#[test]
fn a_circle_is_moved_by_its_centre_and_sized_by_its_boundary() {
    let mut window = map(DRAWN);
    window.click("zone well");
    let from = window.at("corner 2 of zone well");
    let to = place(&window, 17.0, 4.0);
    window.drag(from, to);
    check_line(&mut window, DRAWN, r#"shape="circle 14,4 3m""#);
    window.click("zone well");
    let from = window.at("corner 1 of zone well");
    let to = place(&window, 13.0, 5.0);
    window.drag(from, to);
    check_line(&mut window, DRAWN, r#"shape="circle 13,5 1m""#);
}

#[test]
fn points_zones_and_lines_are_drawn_by_clicks() {
    let mut window = map(DRAWN);
    window.click("map tool: Point");
    let at = place(&window, 4.0, 8.0);
    window.click_at(at);
    check_line(&mut window, DRAWN, r#"<point name="P4" at="4 8"/>"#);
    window.click("map tool: Rally point");
    window.click_at(at);
    check_line(&mut window, DRAWN, r#"<rally name="R2" at="4 8"/>"#);
    window.click("map tool: Zone: stay-in");
    for (x_m, y_m) in [(-3.0, -4.0), (17.0, -4.0), (17.0, 9.0)] {
        let at = place(&window, x_m, y_m);
        window.click_at(at);
    }
    assert_eq!(window.text(), DRAWN, "it is not ended");
    window.key(Key::Enter);
    let expected = r#"<zone name="zone1" kind="stay-in" shape="-3,-4 17,-4 17,9"/>"#;
    check_line(&mut window, DRAWN, expected);
    window.click("map tool: Line: limit");
    let at = place(&window, 4.0, 9.0);
    window.click_at(at);
    window.key(Key::Enter);
    assert!(window.last_message().contains("needs 2 points"), "{}", window.last_message());
    let at = place(&window, 9.0, 9.0);
    window.click_at(at);
    window.key(Key::Enter);
    check_line(&mut window, DRAWN, r#"<line name="line1" kind="limit" shape="4,9 9,9"/>"#);
}

#[test]
fn legs_are_added_at_the_end_and_between() {
    let mut window = map(DRAWN);
    window.click("map tool: Leg");
    let to_known = window.at("point P1");
    window.click_at(to_known);
    check_line(&mut window, DRAWN, r#"<leg name="l3" to="P1"/>"#);
    let at = place(&window, 4.0, 8.0);
    window.click_at(at);
    let text = window.text();
    assert!(text.contains(r#"<point name="P4" at="4 8"/>"#), "{text}");
    let expected = "<leg name=\"l2\" to=\"P3\" by=\"1min\"/>\n      <leg name=\"l3\" to=\"P4\"/>\n";
    assert!(text.contains(expected), "{text}");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DRAWN, "point and leg are one step");
    window.key(Key::Escape);
    window.click("leg l1 of route red");
    let middle = window.at("middle of leg l1 of route red");
    let to = place(&window, 5.0, -1.0);
    window.drag(middle, to);
    let text = window.text();
    let expected = "<leg name=\"l3\" to=\"P4\"/>\n      <leg name=\"l1\" to=\"P2\" by=\"1min\"/>";
    assert!(text.contains(expected), "{text}");
    assert!(text.contains(r#"<point name="P4" at="5 -1"/>"#), "{text}");
    assert!(window.has("leg l3 of route red"));
}

#[test]
fn a_route_begins_where_the_first_click_is() {
    let empty = "<armor version=\"1\">\n  <system name=\"bench\">\n    \
                 <component name=\"way\" kind=\"way\"/>\n  </system>\n</armor>\n";
    let mut window = map(empty);
    window.click("map tool: Leg");
    let middle = window.at("drawing of the map");
    window.click_at(middle);
    assert_eq!(window.text(), empty);
    window.click_at(middle + vec2(200.0, 0.0));
    let text = window.text();
    for part in [
        r#"<point name="P1" at="0 0"/>"#,
        r#"<point name="P2" at="10 0"/>"#,
        r#"<route name="route" mover="way.route" start="P1" out="over">"#,
        r#"<leg name="l1" to="P2"/>"#,
        r#"<otherwise on="lost-link blocked late" do="hold"/>"#,
        r#"goal="over""#,
        r#"safe="hold""#,
        r#"<place name="over"/>"#,
        r#"<place name="hold"/>"#,
    ] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), empty);
}

/// The bench with a second route, to the point P2, too.
fn two_routes() -> String {
    let second = r#"    <route name="blue" mover="other.route" start="P3" out="over">
      <leg name="l1" to="P2" by="1min"/>
    </route>
    <place name="over"/>"#;
    let text = DRAWN.replace(r#"    <place name="over"/>"#, second);
    text.replace(
        r#"<component name="way" kind="way"/>"#,
        "<component name=\"way\" kind=\"way\"/>\n    <component name=\"other\" kind=\"way\"/>",
    )
}

#[test]
fn a_stay_is_added_behind_the_leg_that_is_clicked() {
    let mut window = map(DRAWN);
    window.click("map tool: Stay");
    window.click("point P3");
    let expected =
        "<leg name=\"l2\" to=\"P3\" by=\"1min\"/>\n      <stay name=\"s2\" for=\"10s\"/>\n";
    assert!(window.text().contains(expected), "{}", window.text());
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DRAWN);
    // Without a mouse: by the buttons of what is selected.
    window.key(Key::Escape);
    window.click("leg l1 of route red");
    window.click("add a stay behind it");
    let expected =
        "<leg name=\"l1\" to=\"P2\" by=\"1min\"/>\n      <stay name=\"s2\" for=\"10s\"/>\n";
    assert!(window.text().contains(expected), "{}", window.text());
}

#[test]
fn a_meeting_is_one_step_in_both_routes() {
    let text = two_routes();
    let mut window = map(&text);
    window.click("map tool: Meeting");
    // Both routes lead to it: one click.
    window.click("point P2");
    let met = window.text();
    let red = "<leg name=\"l1\" to=\"P2\" by=\"1min\"/>\n      \
               <meet name=\"m1\" with=\"blue\" patience=\"2min\"/>\n      <stay";
    let blue = "<leg name=\"l1\" to=\"P2\" by=\"1min\"/>\n      \
                <meet name=\"m1\" with=\"red\" patience=\"2min\"/>\n    </route>";
    assert!(met.contains(red) && met.contains(blue), "{met}");
    assert!(window.has("meeting m1 of route red") && window.has("meeting m1 of route blue"));
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), text);
    // Behind different points: a click for each route.
    window.click("point P3");
    assert_eq!(window.text(), text, "the other route is not known yet");
    window.click("leg l1 of route blue");
    let red = "<leg name=\"l2\" to=\"P3\" by=\"1min\"/>\n      \
               <meet name=\"m1\" with=\"blue\" patience=\"2min\"/>\n      <otherwise";
    let met = window.text();
    assert!(met.contains(red) && met.contains(blue), "{met}");
    window.keys(Modifiers::COMMAND, Key::Z);
    window.key(Key::Escape);
    window.click("leg l2 of route red");
    window.click("add a meeting with blue behind it");
    assert_eq!(window.text(), met, "by the button, too");
}

#[test]
fn a_meeting_of_a_route_with_itself_waits_for_another_leg() {
    let mut window = map(DRAWN);
    window.click("map tool: Meeting");
    window.click("point P2");
    window.click("point P3");
    assert_eq!(window.text(), DRAWN);
    window.click_at(place(&window, 5.0, 4.0));
    assert!(window.last_message().contains("Click a leg"), "{}", window.last_message());
}

#[test]
fn the_firings_that_lead_to_an_exit_through_a_zone_are_played_on_the_net() {
    // The rally point is on the other side of the yard.
    let text = DRAWN.replace(r#"at="-2 4""#, r#"at="5 12""#);
    let mut window = map(&text);
    window.click("leg l1 of route red");
    window.click("Play its firing");
    window.settle();
    assert!(window.has("Run being shown"), "the net is shown");
    assert!(window.has_part("> 1. red.l1."));
}

#[test]
fn a_second_route_begins_at_a_point_that_is_there() {
    let text = DRAWN.replace(
        r#"<component name="way" kind="way"/>"#,
        "<component name=\"way\" kind=\"way\"/>\n    <component name=\"other\" kind=\"way\"/>",
    );
    let mut window = map(&text);
    window.click("map tool: Leg");
    window.click("begin a new route");
    window.click("point P3");
    assert_eq!(window.text(), text);
    window.click("point P2");
    let expected = "<route name=\"route\" mover=\"other.route\" start=\"P3\" out=\"over\">\n      \
                    <leg name=\"l1\" to=\"P2\"/>";
    assert!(window.text().contains(expected), "{}", window.text());
    // The next leg is one of the route that was begun.
    window.click("point P1");
    let expected = "<leg name=\"l1\" to=\"P2\"/>\n      <leg name=\"l2\" to=\"P1\"/>\n      \
                    <otherwise on=\"lost-link blocked late\" do=\"rally\"/>";
    assert!(window.text().contains(expected), "{}", window.text());
}

#[test]
fn without_a_mover_a_route_is_refused_with_the_reason() {
    let mut window = map("<armor version=\"1\">\n  <system name=\"bench\"/>\n</armor>\n");
    window.click("map tool: Leg");
    let middle = window.at("drawing of the map");
    window.click_at(middle);
    assert!(window.last_message().contains("kind patrol"), "{}", window.last_message());
}

#[test]
fn a_point_is_removed_with_its_legs_and_one_that_a_route_begins_at_is_not() {
    let mut window = map(DRAWN);
    window.click("point P3");
    window.key(Key::Delete);
    let text = window.text();
    assert!(!text.contains("P3") && !text.contains("l2"), "{text}");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DRAWN);
    window.click("point P1");
    window.key(Key::Delete);
    assert_eq!(window.text(), DRAWN);
    let message = window.last_message();
    assert!(message.contains("is still named by route red"), "{message}");
}

#[test]
fn the_numbers_of_what_is_selected_are_fields() {
    let mut window = map(DRAWN);
    window.click("point P2");
    window.fill("position", "11.25 0.5");
    check_line(&mut window, DRAWN, r#"<point name="P2" at="11.25 0.5"/>"#);
    window.fill("position", "somewhere");
    assert_eq!(window.text(), DRAWN, "{}", window.last_message());
    window.key(Key::Escape);
    window.click("zone yard");
    window.fill("margin", "1m");
    check_line(&mut window, DRAWN, r#"margin="1m""#);
    window.click("leg l1 of route red");
    window.fill("takes at most", "2min");
    check_line(&mut window, DRAWN, r#"<leg name="l1" to="P2" by="2min"/>"#);
    window.choose("point of the leg", "R1");
    check_line(&mut window, DRAWN, r#"<leg name="l1" to="R1" by="1min"/>"#);
    window.click("point P2");
    window.fill("name of the point", "gate");
    let text = window.text();
    assert!(text.contains(r#"<leg name="l1" to="gate" by="1min"/>"#), "{text}");
    assert!(window.has("point gate"));
}

#[test]
fn the_keyboard_moves_what_is_selected_and_goes_from_item_to_item() {
    let mut window = map(DRAWN);
    window.click("point P1");
    window.keys(Modifiers::SHIFT, Key::ArrowRight);
    let text = window.text();
    assert!(
        !text.contains(r#"name="P1" at="0 0""#) && text.contains(" 0\"/> <!-- the door -->"),
        "{text}"
    );
    window.keys(Modifiers::COMMAND, Key::Z);
    window.click("point P2");
    window.key(Key::ArrowUp);
    let node = window.harness.get_by_label("point P2");
    assert_eq!(node.accesskit_node().is_selected(), Some(false));
}

#[test]
fn a_leg_through_a_zone_is_marked_and_leads_from_its_problem_to_the_map() {
    let text = DRAWN.replace("shape=\"2,2 8,2 8,6 2,6\"", "shape=\"2,-1 8,-1 8,6 2,6\"");
    let mut window = map(&text);
    window.click("leg l1 of route red");
    assert!(window.has_part("l1 enters yard"), "the finding is in the panel");
    let node = window.harness.get_by_label("leg l1 of route red");
    assert!(node.accesskit_node().description().unwrap_or_default().contains("enters yard"));
    window.click("view: Mission");
    for _ in 0..9 {
        if !window.has("drawing of the map") {
            window.key(Key::F4);
        }
    }
    assert!(window.has("drawing of the map"), "a problem of the map shows the map");
}

#[test]
fn several_items_are_moved_in_one_step() {
    let mut window = map(DRAWN);
    window.keys(Modifiers::COMMAND, Key::A);
    window.keys(Modifiers::SHIFT, Key::ArrowUp);
    let text = window.text();
    for item in ["P1", "P2", "P3", "yard", "well", "green", "R1"] {
        let line = |text: &str| {
            let found = text.lines().find(|line| line.contains(&format!("name=\"{item}\"")));
            found.map(str::to_owned)
        };
        assert_ne!(line(&text), line(DRAWN), "{item}");
    }
    assert!(text.contains("<!-- Metres from the door. -->"));
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DRAWN);
}

#[test]
fn the_wheel_zooms_and_fit_shows_everything() {
    let mut window = map(DRAWN);
    let length = |window: &Window| (window.at("point P2") - window.at("point P1")).x;
    let before = length(&window);
    let at = window.at("point P1");
    window.harness.event(Event::PointerMoved(at));
    window.harness.step();
    window.harness.event(Event::MouseWheel {
        unit: eframe::egui::MouseWheelUnit::Line,
        delta: Vec2::new(0.0, 2.0),
        modifiers: Modifiers::NONE,
        phase: eframe::egui::TouchPhase::Move,
        source: eframe::egui::MouseWheelSource::Wheel,
    });
    window.settle();
    assert!(length(&window) > 1.2 * before, "{} {before}", length(&window));
    assert!((window.at("point P1") - at).length() < 1.0, "what is at the pointer stays there");
    window.key(Key::F);
    assert!((length(&window) - before).abs() < 1.0);
}

#[test]
fn a_latitude_stays_one_when_it_is_moved() {
    let text = DRAWN
        .replace("<map>", "<map origin=\"48.8583 2.2945 35m\">")
        .replace("at=\"-2 4\"", "at=\"48.8583360N 2.2944727E\"");
    let mut window = map(&text);
    let from = window.at("rally point R1");
    let to = place(&window, -1.0, 5.0);
    window.drag(from, to);
    let changed = window.text();
    let line = changed.lines().find(|line| line.contains("R1")).unwrap_or_default();
    assert!(line.contains("at=\"48.85834") && line.contains("N 2.29448"), "{line}");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), text);
}

#[test]
fn the_map_is_exported_as_lines_and_text() {
    let mut window = map(DRAWN);
    window.harness.state_mut().workspace().order_command(Command::Export);
    window.settle();
    window.fill("File name", "map.svg");
    let file = window.path("map.svg");
    let svg = read(&file);
    for part in ["yard (no-go)", "green (phase)", ">P1<", "1. l1"] {
        assert!(svg.contains(part), "{part}");
    }
}
