//! Finding one's way: the list of commands, the page of keys, the first page.

use armor_designer::{Command, Menu, about};
use eframe::egui::{Key, Modifiers, ViewportId};
use egui_kittest::kittest::Queryable;

use crate::ui::{Window, read};

#[test]
fn a_command_is_run_by_a_part_of_its_name() {
    let mut window = Window::open(None);
    assert!(window.has("kind lamp"));
    window.keys(Modifiers::COMMAND, Key::P);
    window.write("palet");
    window.key(Key::Enter);
    assert!(!window.has("kind lamp"), "the palette is hidden");
    window.keys(Modifiers::COMMAND, Key::P);
    window.key(Key::Escape);
    assert!(!window.has("Type what to do"));
}

#[test]
fn the_palette_is_folded_for_a_drawing_until_it_is_opened() {
    let robot = "<armor version=\"1\">\n  <system>\n    <component name=\"arm\" kind=\"arm\"/>\n  \
                 </system>\n</armor>\n";
    let mut window = Window::open(Some(robot));
    assert!(!window.has("kind lamp"));
    window.click("Open the palette");
    assert!(window.has("kind lamp"));
    window.key(Key::F6);
    assert!(!window.has("kind lamp") && window.has("Open the palette"));
}

/// The drawing is most of the window that a small laptop has.
#[test]
fn the_drawing_has_seven_tenths_of_a_small_window() {
    let robot = "<armor version=\"1\">\n  <system>\n    <frame name=\"laser\" in=\"base_link\" \
                 x=\"0.1m\"/>\n    <component name=\"eye\" kind=\"eye\">\n      \
                 <parameter name=\"device\" value=\"usb\"/>\n    </component>\n    \
                 <component name=\"arm\" kind=\"arm\"/>\n    <link from=\"eye.target\" \
                 to=\"arm.target\"/>\n  </system>\n</armor>\n";
    let mut window = Window::open(Some(robot));
    window.harness.set_size(eframe::egui::vec2(1280.0, 800.0));
    window.settle();
    let drawing = window.harness.get_by_label("drawing of the system").rect();
    let share = drawing.area() / (1280.0 * 800.0);
    assert!(share >= 0.7, "{share}");
}

/// The window of a small laptop at each scale that a system sets: as many points, and more pixels.
#[test]
fn the_drawing_and_the_main_buttons_have_their_place_at_each_scale_of_the_system() {
    let robot = "<armor version=\"1\">\n  <system>\n    <component name=\"eye\" kind=\"eye\"/>\n    \
                 <component name=\"arm\" kind=\"arm\"/>\n    <link from=\"eye.target\" \
                 to=\"arm.target\"/>\n  </system>\n  <mission goal=\"home\">\n    \
                 <place name=\"home\" initial=\"true\"/>\n  </mission>\n</armor>\n";
    for scale in [1.0, 1.5, 2.0, 3.0] {
        let mut window = Window::open(Some(robot));
        let viewport = window.harness.input_mut().viewports.entry(ViewportId::ROOT).or_default();
        viewport.native_pixels_per_point = Some(scale);
        window.harness.set_size(eframe::egui::vec2(1280.0, 800.0));
        window.settle();
        assert_eq!(window.harness.ctx.pixels_per_point(), scale);
        let whole = window.harness.ctx.content_rect();
        for view in ["System", "Mission", "Live"] {
            window.click(&format!("view: {view}"));
            if view != "Live" {
                let name = format!("drawing of the {}", view.to_lowercase());
                let drawing = window.harness.get_by_label(&name).rect();
                let share = drawing.intersect(whole).area() / whole.area();
                assert!(share >= 0.5, "{name} at {scale}: {share}");
            }
            for button in [
                "tool: Run",
                "tool: Save",
                "tool: Undo",
                "view: System",
                "view: Live",
                "File",
                "Help",
            ] {
                let rect = window.harness.get_by_label(button).rect();
                assert!(whole.contains_rect(rect), "{button} at {scale}: {rect:?}");
            }
        }
    }
}

#[test]
fn every_key_is_on_the_page_of_keys() {
    let mut window = Window::open(None);
    window.key(Key::F1);
    for menu in Menu::ALL {
        assert!(window.harness.query_all_by_label_contains(menu.name()).next().is_some());
    }
    let doc = about(Command::SpaceAcross).name;
    assert!(window.harness.query_all_by_label_contains(doc).next().is_some());
    assert!(window.has("Close"));
    window.key(Key::F1);
    assert!(!window.has("Close"));
    window.key(Key::F1);
    window.key(Key::Escape);
    assert!(!window.has("Close"));
}

#[test]
fn the_first_page_leads_to_a_new_robot() {
    let mut window = Window::open_as(None, |_, start| start.first_page = true);
    assert!(!window.has("kind lamp"));
    window.click("Start a new robot");
    assert!(window.has("kind lamp") && window.has("drawing of the system"));
}

#[test]
fn the_first_page_opens_what_was_open_before() {
    let mut window = Window::open_as(None, |folder, start| {
        let robot = folder.join("before.xml");
        std::fs::write(&robot, "<armor version=\"1\"><system name=\"old\"/></armor>").unwrap();
        std::fs::create_dir_all(folder.join("own")).unwrap();
        std::fs::write(folder.join("own/recent"), format!("{}\n", robot.display())).unwrap();
        start.own_folder = Some(folder.join("own"));
        start.first_page = true;
    });
    window.click("before.xml");
    assert!(window.text().contains("\"old\""));
    let recent = read(&window.path("own/recent"));
    assert!(recent.ends_with("before.xml\n"), "{recent}");
}

#[test]
fn an_example_is_opened_wherever_its_card_is_clicked() {
    let mut window = Window::open_as(None, |folder, start| {
        start.own_folder = Some(folder.join("own"));
        start.first_page = true;
    });
    let words = window.harness.query_all_by_label_contains("never seen").next();
    let at = words.expect("the card has a title").rect().center();
    window.click_at(at);
    assert!(window.text().contains("office"), "{}", window.text());
}

#[test]
fn a_view_is_turned_to_from_the_first_page() {
    let mut window = Window::open_as(None, |_, start| start.first_page = true);
    window.click("view: Mission");
    assert!(window.has("drawing of the mission"));
}

#[test]
fn the_page_of_a_finding_is_one_click_away_and_closed_with_escape() {
    let mut window = Window::open(Some(
        "<armor version=\"1\"><system name=\"bench\">\n<component name=\"eye\" kind=\"eye\"/>\n</system></armor>",
    ));
    let page = armor_robotfile::Code::ParameterUnassigned.page();
    let title = page.lines().next().unwrap_or_default().trim_start_matches('#').trim().to_owned();
    let page_shown = |window: &Window| window.harness.query_by_label(&title).is_some();
    assert!(!page_shown(&window));
    window.click("page of E0111");
    assert!(page_shown(&window), "{title}");
    window.key(Key::Escape);
    assert!(!page_shown(&window));
}

const MISSION: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
  </system>
  <mission goal="home">
    <place name="go" initial="true" components="arm"/>
    <place name="home"/>
    <transition name="late" from="go" to="home" timeout="90s"/>
  </mission>
</armor>
"#;

#[test]
fn f1_shows_the_page_of_what_is_selected_or_edited() {
    for (view, click, field, section) in [
        ("view: System", "component arm", "", "Kind arm"),
        ("view: System", "link eye.target to arm.target", "", "<link>"),
        ("view: System", "component eye", "parameter device", "Parameter device of eye"),
        ("view: Mission", "place home", "", "<place>"),
        ("view: Mission", "transition late", "", "<transition>"),
        ("view: Mission", "transition late", "guard", "Guards"),
    ] {
        let mut window = Window::open(Some(MISSION));
        window.click(view);
        window.click(click);
        if !field.is_empty() {
            window.click(field);
        }
        window.key(Key::F1);
        assert!(window.has(section), "{click} {field}: {section}");
        window.key(Key::Escape);
        assert!(!window.has(section), "{click} {field}: Escape closes the page");
    }
}

#[test]
fn a_document_is_opened_from_the_menu_and_its_links_lead_on() {
    let mut window = Window::open(Some(MISSION));
    window.click("Help");
    window.click("Documents");
    window.click("Which link for which need");
    assert!(window.has("section Shared memory"));
    window.click("section Datagrams");
    assert!(window.harness.query_all_by_label("Datagrams").count() > 0);
    window.click("document");
    window.click("The designer");
    assert!(window.has("section From nothing to a robot that runs"));
    window.key(Key::Escape);
    assert!(!window.has("section From nothing to a robot that runs"));
}
