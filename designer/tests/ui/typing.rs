//! Keys that are typed into fields: each reaches one thing, and changes only that.

use std::collections::BTreeSet;
use std::path::Path;

use eframe::egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

use crate::ui::Window;

const THREE: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb0"/>
    </component>
    <component name="arm" kind="arm"/>
    <component name="spare" kind="arm"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <block of="arm" x="300" y="0"/>
      <block of="spare" x="0" y="260"/>
    </layout>
  </system>
</armor>
"#;

#[test]
fn undo_in_a_field_never_brings_the_text_of_another_component() {
    let mut window = Window::open(Some(THREE));
    window.click("component arm");
    window.fill("Component name", "hand");
    let renamed = window.text();
    assert!(renamed.contains(r#"name="hand""#), "{renamed}");
    window.click("component spare");
    window.key(Key::F2);
    window.keys(Modifiers::COMMAND, Key::Z);
    window.click("component eye");
    assert_eq!(window.text(), renamed);
    // The same field of the same component, after its value was changed and taken back elsewhere.
    window.fill("parameter device", "usb7");
    window.click("component hand");
    window.click("component eye");
    window.click("parameter device");
    window.keys(Modifiers::COMMAND, Key::Z);
    window.key(Key::Enter);
    assert!(window.text().contains(r#"value="usb7""#), "{}", window.text());
}

#[test]
fn undo_in_a_field_takes_back_what_was_typed_there() {
    let mut window = Window::open(Some(THREE));
    window.click("component eye");
    window.click("parameter device");
    window.keys(Modifiers::COMMAND, Key::A);
    window.write("usb9");
    window.keys(Modifiers::COMMAND, Key::Z);
    window.key(Key::Enter);
    assert_eq!(window.text(), THREE);
}

#[test]
fn return_in_a_field_reaches_nothing_else() {
    let mut window = Window::open(Some(THREE));
    window.click("component eye");
    window.fill("parameter device", "usb3");
    // No other field has got the focus, so letters are written nowhere.
    window.write("x");
    let text = window.text();
    assert!(text.contains(r#"value="usb3""#) && text.contains(r#"name="eye""#), "{text}");
    // Undo is that of the file.
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), THREE);
}

const DRAWN: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <group title="senses" x="-40" y="-60" width="260" height="200"/>
      <group title="limbs" x="300" y="-60" width="260" height="120"/>
      <note x="300" y="200" width="200" height="80">first</note>
      <note x="300" y="320" width="200" height="80">second</note>
    </layout>
  </system>
  <mission name="bench" goal="home">
    <place name="explore" initial="true"/>
    <place name="home"/>
    <transition name="late" from="explore" to="home" timeout="90s"/>
    <transition name="never" from="explore" to="home" timeout="80s"/>
  </mission>
</armor>
"#;

/// Clicks where also a group is hit: at its title.
fn select(window: &mut Window, label: &str) {
    let rect = window.harness.get_by_label(label).rect();
    let is_group = label.starts_with("group");
    window.click_at(if is_group { rect.min + vec2(30.0, 10.0) } else { rect.center() });
}

/// The same field of two things: undo in that of the second brings nothing of the first.
#[test]
fn undo_in_a_field_of_a_group_a_note_a_place_or_a_transition_stays_in_it() {
    for (view, first, second, field) in [
        ("view: System", "group senses", "group limbs", "Title"),
        ("view: System", "note first", "note second", "Text"),
        ("view: Mission", "place explore", "place home", "name of the place"),
        ("view: Mission", "transition late", "transition never", "timeout"),
    ] {
        let mut window = Window::open(Some(DRAWN));
        window.click(view);
        select(&mut window, first);
        window.fill(field, if field == "timeout" { "5s" } else { "fifth" });
        if field == "Text" {
            // Enter is a letter of a note; leaving the field takes it.
            window.click("component eye");
        }
        let changed = window.text();
        assert_ne!(changed, DRAWN, "{field}");
        select(&mut window, second);
        window.click(field);
        window.keys(Modifiers::COMMAND, Key::Z);
        window.click(if view == "view: System" { "component eye" } else { "view: System" });
        assert_eq!(window.text(), changed, "{field}: nothing came from {first}");
    }
}

/// What the file assigns to each component: its name, rate and parameters.
fn read_components(text: &str) -> Vec<[String; 3]> {
    let reading = armor_robotfile::read(Path::new("robot.xml"), &mut |_| Ok(text.into()));
    let system = reading.configuration.expect("the file is read").system;
    let components = system.components.iter().map(|component| {
        let rate = component.rate_hz.as_ref().map(|rate| rate.at.text().to_owned());
        let device = component.parameter("device").map(|it| it.value.value.clone());
        [component.name.value.clone(), rate.unwrap_or_default(), device.unwrap_or_default()]
    });
    components.collect()
}

/// Random letters and keys in random fields: what a field is left with is a text that it had while it
/// was edited, and nothing else changes.
#[test]
fn random_keys_in_a_field_change_that_field_alone() {
    let seed = std::env::var("ARMOR_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    let mut random = SmallRandom(seed);
    let mut window = Window::open(Some(THREE));
    for session in 0..60 {
        let before = read_components(&window.text());
        let which = random.below(before.len());
        window.click(&format!("component {}", before[which][0]));
        // The eye has a parameter that is a text.
        let field = if which == 0 { random.below(3) } else { random.below(2) };
        let label = ["Component name", "component rate", "parameter device"][field];
        if field == 1 && !window.has(label) {
            window.click("Execution");
        }
        window.click(label);
        window.keys(Modifiers::COMMAND, Key::A);
        let mut texts = BTreeSet::from([before[which][field].clone()]);
        for _ in 0..=random.below(6) {
            match random.below(8) {
                0 => window.key(Key::Backspace),
                1 => window.keys(Modifiers::COMMAND, Key::Z),
                2 => window.keys(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z),
                3 => window.keys(Modifiers::COMMAND, Key::A),
                4 if field == 1 => window.write("5Hz"),
                _ => window.write(["a", "b7", "q"][random.below(3)]),
            }
            texts.insert(window.value(label));
        }
        match random.below(4) {
            0 => window.key(Key::Escape),
            1 => window.key(Key::Tab),
            2 => window.click(&format!("component {}", before[(which + 1) % before.len()][0])),
            _ => {
                window.key(Key::Enter);
                window.write("z");
            }
        }
        let after = read_components(&window.text());
        let context =
            format!("seed {seed}, session {session}: {label} of {:?}, {texts:?}", before[which]);
        assert_eq!(after.len(), before.len(), "{context}");
        for (number, (one, other)) in before.iter().zip(&after).enumerate() {
            for part in 0..3 {
                if (number, part) == (which, field) {
                    // A text that is no value is refused, or shown as it is in the file.
                    assert!(
                        texts.contains(&other[part]) || other[part].is_empty(),
                        "{context}: {after:?}"
                    );
                } else {
                    assert_eq!(one[part], other[part], "{context}: {after:?}");
                }
            }
        }
        window.key(Key::Escape);
    }
}

/// Numbers by xorshift: enough to choose keys, and the same everywhere.
struct SmallRandom(u64);

impl SmallRandom {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}
