//! What cannot be in the file is refused at its field, with the reason, and is never written.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{Queryable, by};

use crate::ui::Window;

const ROBOT: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
  </system>
  <mission goal="home" safe="hold" period="0.5s">
    <variable name="round" min="0" max="3" initial="0"/>
    <place name="go" initial="true" components="arm"/>
    <place name="home" initial="2"/>
    <place name="hold"/>
    <transition name="seen" from="go" to="home" on="arm.done"/>
    <transition name="late" from="go" timeout="90s" priority="5" not-after="2030-01-01T00:00Z">
      <arc to="hold" weight="7"/>
    </transition>
    <transition name="soon" from="go" to="hold" interval="[2s,5s]"/>
    <transition name="later" from="go" to="hold" after="2s"/>
    <transition name="asks" from="go" to="hold" autonomy="confirm" answer-within="5s"/>
    <check>always reachable(home)</check>
  </mission>
</armor>
"#;

fn mission() -> Window {
    let mut window = Window::open(Some(ROBOT));
    window.click("view: Mission");
    window
}

#[test]
fn it_stays_in_its_field_with_the_reason_and_never_reaches_the_file() {
    let (late, soon) = ("transition late", "transition soon");
    // What is clicked, the field, what is typed, and what the reason contains.
    for (click, field, text, reason) in [
        ("", "name of the mission", "two words", "a name starts with a letter"),
        ("", "period", "76", ""),
        ("", "period", "0s", "`0s` is not valid: a duration above zero"),
        ("", "name of round", "2nd", "a name starts with a letter"),
        ("", "greatest round", "x", ""),
        ("", "greatest round", "2.5", "`2.5` is not valid"),
        ("", "least round", "9", "`3` is not valid: max must not be below min"),
        ("", "round at the start", "4", "`4` is not valid"),
        ("", "check 1", "often home", ""),
        ("place home", "name of the place", "a b", "a name starts with a letter"),
        ("place home", "name of the place", "hold", "place hold"),
        ("place home", "tokens at the start", "-1", "a whole number from 0 to 999"),
        (late, "timeout", "76", ""),
        (late, "timeout", "-5s", "is not between 0s"),
        (late, "timeout", "1e300s", "is not between 0s"),
        (late, "timeout", "9m", ""),
        (late, "guard", "round < ) 3", "at )"),
        (late, "priority", "high", "a whole number from"),
        (late, "not after this date", "2030", "! "),
        (late, "sets round to", "round +", "! "),
        ("transition seen", "report", "not this", "a name starts with a letter"),
        (soon, "earliest time", "9s", "`[9s,5s]` is not valid: the interval ends"),
        (soon, "latest time", "1s", "`[2s,1s]` is not valid: the interval ends"),
        (soon, "latest time", "5", "! "),
        ("transition later", "not before this time", "soon", "! "),
        ("transition asks", "answer within", "5", ""),
    ] {
        let mut window = mission();
        if !click.is_empty() {
            window.click(click);
        }
        window.harness.get_by_label(field).scroll_to_me();
        window.settle();
        let before = window.value(field);
        window.fill(field, text);
        let case = format!("{field}: {text}");
        assert_eq!(window.text(), ROBOT, "{case}");
        assert_eq!(window.value(field), text, "{case}");
        let beneath = window.harness.query_all(by().predicate(move |node| {
            // The text of a label is its value.
            let text = node.label().or_else(|| node.value());
            text.is_some_and(|why| why.starts_with("! ") && why.contains(reason))
        }));
        assert!(beneath.count() > 0, "{case}: no reason beneath the field");
        assert_eq!(window.last_message(), "", "{case}: it is stated once");
        // Escape restores what the file has.
        window.click(field);
        window.key(Key::Escape);
        assert_eq!(window.value(field), before, "{case}");
    }
}

#[test]
fn it_is_tried_again_when_its_field_is_left_again() {
    let mut window = mission();
    window.fill("greatest round", "-1");
    assert_eq!(window.text(), ROBOT);
    window.fill("least round", "-4");
    window.fill("round at the start", "-2");
    window.click("greatest round");
    window.key(Key::Enter);
    let expected = r#"<variable name="round" min="-4" max="-1" initial="-2"/>"#;
    assert!(window.text().contains(expected), "{}", window.text());
}

#[test]
fn it_is_gone_once_the_file_has_another_value() {
    let mut window = mission();
    window.fill("period", "2s");
    window.fill("period", "76");
    assert_eq!(window.value("period"), "76");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.value("period"), "0.5s");
}
