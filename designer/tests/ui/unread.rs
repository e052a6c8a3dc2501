//! What a file states and is not understood stands in its field, to be fixed there.

use egui_kittest::kittest::{NodeT, Queryable};

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
    <transition name="asks" from="go" to="hold" autonomy="confirm" answer-within="5s"/>
  </mission>
</armor>
"#;

/// A field whose value is not understood: the file's text instead of what, where one clicks, the
/// field, what is wrong there, and what it states after it was fixed.
struct Case {
    broken: (&'static str, &'static str),
    click: &'static str,
    field: &'static str,
    shown: &'static str,
    fixed: &'static str,
    expected: &'static str,
}

fn check(case: &Case) {
    let text = ROBOT.replace(case.broken.0, case.broken.1);
    assert_ne!(text, ROBOT, "{}", case.broken.0);
    let mut window = Window::open(Some(&text));
    window.click("view: Mission");
    if !case.click.is_empty() {
        window.click(case.click);
    }
    let shown = window.harness.get_by_label(case.field).accesskit_node().value();
    assert_eq!(shown.as_deref(), Some(case.shown), "{}", case.field);
    window.fill(case.field, case.fixed);
    let text = window.text();
    assert!(text.contains(case.expected), "{} is not in {text}", case.expected);
}

#[test]
fn it_is_shown_as_it_stands_and_can_be_fixed() {
    let case = |broken, click, field, shown, fixed, expected| Case {
        broken,
        click,
        field,
        shown,
        fixed,
        expected,
    };
    let late = "transition late";
    for case in [
        case(("\"90s\"", "\"76\""), late, "timeout", "76", "76s", "timeout=\"76s\""),
        case(
            ("timeout=\"90s\"", "after=\"soon\""),
            late,
            "not before this time",
            "soon",
            "9s",
            "after=\"9s\"",
        ),
        case(
            ("timeout=\"90s\"", "interval=\"[2,5s]\""),
            late,
            "earliest time",
            "2",
            "2s",
            "interval=\"[2s,5s]\"",
        ),
        case(("\"5\"", "\"high\""), late, "priority", "high", "0", "timeout=\"90s\" not-after"),
        case(
            ("2030-01-01T00:00Z", "2030"),
            late,
            "not after this date",
            "2030",
            "2031-01-01T00:00Z",
            "not-after=\"2031-01-01T00:00Z\"",
        ),
        case(
            ("\"7\"", "\"many\""),
            "arc: late puts into hold",
            "weight",
            "many",
            "2",
            "weight=\"2\"",
        ),
        case(
            ("\"5s\"", "\"5\""),
            "transition asks",
            "answer within",
            "5",
            "6s",
            "answer-within=\"6s\"",
        ),
        case(("\"2\"", "\"-2\""), "place home", "tokens at the start", "-2", "3", "initial=\"3\""),
        case(("\"0.5s\"", "\"0.5\""), "", "period", "0.5", "1s", "period=\"1s\""),
        case(("max=\"3\"", "max=\"x\""), "", "greatest round", "x", "9", "max=\"9\""),
    ] {
        check(&case);
    }
}

#[test]
fn a_word_that_is_none_of_the_choices_is_reported() {
    let text = ROBOT.replace("\"confirm\"", "\"ask\"");
    let mut window = Window::open(Some(&text));
    window.click("view: Mission");
    window.click("transition asks");
    assert!(window.has("! not understood: ask"));
    window.click("who decides");
    window.click("the robot");
    assert!(!window.text().contains("autonomy"), "{}", window.text());
}

#[test]
fn a_link_s_attributes_can_be_fixed_too() {
    let link = "<link from=\"eye.target\" to=\"arm.target\"";
    let text = ROBOT.replace(link, &format!("{link} history=\"x\""));
    let mut window = Window::open(Some(&text));
    window.click("link eye.target to arm.target");
    let shown = window.harness.get_by_label("link history").accesskit_node().value();
    assert_eq!(shown.as_deref(), Some("x"));
    window.fill("link history", "4");
    assert!(window.text().contains("history=\"4\""), "{}", window.text());
}

#[test]
fn one_error_is_no_errors() {
    let text = ROBOT.replace("\"90s\"", "\"76\"");
    let mut window = Window::open(Some(&text));
    window.click("view: Mission");
    assert!(window.has("not proven: 1 error"));
}
