//! What is wrong is corrected by a click, and the words are those of the window.

use armor_designer::{Project, in_window_words};
use armor_robotfile::Code;
use std::sync::Arc;

use crate::ui::{Window, bench_kinds};

/// A mission in which one value is wrong: the second transition begins at the wrong place.
const WRONG: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye"><parameter name="device" value="usb"/></component>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
  </system>
  <mission name="bench" goal="home" safe="hold">
    <place name="go" initial="true" components="eye arm"/>
    <place name="drive" components="eye arm"/>
    <place name="home"/>
    <place name="hold"/>
    <transition name="begin" from="go" to="drive" timeout="5s"/>
    <transition name="there" from="go" to="home" timeout="60s"/>
  </mission>
</armor>
"#;

fn problems(window: &mut Window) -> Vec<String> {
    let checked = window.harness.state_mut().workspace().project.checked().findings.clone();
    let faults = checked.iter().filter(|it| it.severity() != armor_robotfile::Severity::Note);
    faults.map(|it| format!("{it}: {} {:?}", it.remedy, it.edits)).collect()
}

/// The label of the first button in the window that offers a change.
fn offered(window: &Window, begins: &str) -> Option<String> {
    use egui_kittest::kittest::{NodeT, Queryable, by};
    let begins = begins.to_owned();
    let all = window.harness.query_all(
        by().predicate(move |node| node.label().is_some_and(|label| label.starts_with(&begins))),
    );
    all.into_iter().find_map(|node| node.accesskit_node().label())
}

#[test]
fn the_edit_that_was_proven_to_help_is_a_button() {
    let mut window = Window::open(Some(WRONG));
    let found = problems(&mut window);
    let label = offered(&window, "Set its source").unwrap_or_else(|| panic!("{found:#?}"));
    window.click(&label);
    let text = window.text();
    assert!(text.contains(r#"name="there" from="drive""#), "{label}: {text}");
    window.until("the check", |window| problems(window).is_empty());
    assert!(offered(&window, "Set its source").is_none());
    window.keys(eframe::egui::Modifiers::COMMAND, eframe::egui::Key::Z);
    assert_eq!(window.text(), WRONG);
    assert!(window.last_message().contains(&label), "{}", window.last_message());
}

#[test]
fn a_name_that_was_mistyped_is_changed_by_a_click() {
    let mistyped = WRONG
        .replace(r#"name="there" from="go""#, r#"name="there" from="drive""#)
        .replace(r#"from="eye.target""#, r#"from="eye.tarket""#);
    let mut window = Window::open(Some(&mistyped));
    let found = problems(&mut window);
    assert!(window.has("Change tarket to target"), "{found:#?}");
    window.click("Change tarket to target");
    assert!(window.text().contains(r#"from="eye.target" to="arm.target""#), "{}", window.text());
}

/// The remedies of the faulty example of every code, as the window shows them.
#[test]
fn no_remedy_shows_how_the_file_is_written() {
    let folder = std::env::temp_dir().join(format!("armor-remedies-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (mut count, mut translated) = (0, 0);
    for code in Code::ALL {
        let Some(text) =
            code.faulty_example().and_then(|it| it.file("robot.xml").map(ToOwned::to_owned))
        else {
            continue;
        };
        let path = folder.join(format!("{}.xml", code.as_str()));
        std::fs::write(&path, text).unwrap();
        let Ok(mut project) = Project::open(&path, Arc::new(bench_kinds::kinds())) else {
            continue;
        };
        project.settle();
        if project.is_broken() {
            continue;
        }
        for finding in project.checked().findings.iter() {
            let shown = in_window_words(&finding.remedy);
            count += 1;
            translated += usize::from(shown != finding.remedy);
            let is_of_file = finding.remedy.contains("<armor") || finding.remedy.contains("<?xml");
            let is_plain = !shown.contains("=\"") && !shown.contains("</") && !shown.contains("/>");
            assert!(is_of_file || is_plain, "{finding}\n{}\n{shown}", finding.remedy);
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
    assert!(count > 100 && translated > 20, "{count} remedies, {translated} translated");
}
