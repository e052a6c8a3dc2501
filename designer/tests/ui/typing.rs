//! Keys that are typed into fields: each reaches one thing, and changes only that.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use armor_robotfile::tree::Element;
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

/// A mission, groups and notes, each with two of everything.
const FIELDS: &str = r#"<armor version="1">
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
    <variable name="b7" min="0" max="3" initial="0"/>
    <transition name="late" from="explore" to="home" when="b7 == 0" timeout="90s"/>
    <transition name="never" from="explore" to="home" when="b7 == 0" timeout="80s"/>
    <layout>
      <block of="explore" x="0" y="0"/>
      <block of="home" x="400" y="0"/>
      <block transition="late" x="200" y="-80"/>
      <block transition="never" x="200" y="80"/>
    </layout>
  </mission>
</armor>
"#;

/// Where a value is in the file: the numbers of the elements from the root, and the attribute or
/// `text`.
type ValuePlace = (Vec<usize>, String);

/// Every value of the file. A name that refers to a place or transition is the number of that
/// element, so that it stays the same when the name changes everywhere.
fn read_values(text: &str) -> BTreeMap<ValuePlace, String> {
    let tree = armor_robotfile::parse_tree(Path::new("robot.xml"), text.as_bytes()).unwrap();
    let mut named = BTreeMap::new();
    let mut values = BTreeMap::new();
    let mut open = vec![(Vec::new(), tree.root())];
    while let Some((path, element)) = open.pop() {
        for (number, child) in element.elements().enumerate() {
            open.push(([&path[..], &[number]].concat(), child));
        }
        values.insert((path.clone(), "text".to_owned()), written_text(element));
        for attribute in &element.attributes {
            if matches!(element.name.as_str(), "place" | "transition") && attribute.name == "name" {
                named.insert((element.name == "place", attribute.value.clone()), path.clone());
            }
            values.insert((path.clone(), attribute.name.clone()), attribute.value.clone());
        }
    }
    let refer = |(_, attribute): &ValuePlace| match attribute.as_str() {
        "from" | "to" | "goal" | "of" => Some(true),
        "transition" => Some(false),
        _ => None,
    };
    for (at, value) in &mut values {
        let Some(is_place) = refer(at) else { continue };
        if let Some(path) = named.get(&(is_place, value.clone())) {
            *value = format!("{path:?}");
        }
    }
    values
}

/// The text of a note; that of other elements is their indentation.
fn written_text(element: &Element) -> String {
    if element.name == "note" { element.text().0 } else { String::new() }
}

/// The same of the fields of places, transitions, groups and notes: names, times, guards, titles and
/// texts. Arcs (`from`, `to`) have no field, and stay between the same elements.
#[test]
fn random_keys_in_a_field_of_the_mission_a_group_or_a_note_change_that_field_alone() {
    let seed = std::env::var("ARMOR_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    let mut random = SmallRandom(seed);
    let mut window = Window::open(Some(FIELDS));
    // Problems of what is written would take room from the drawing.
    window.key(Key::F8);
    // The elements of the system's layout and of the mission by their numbers.
    let fields: [(&str, &str, &[usize], &str, &str); 12] = [
        ("System", "group", &[0, 1, 1], "title", "Title"),
        ("System", "group", &[0, 1, 2], "title", "Title"),
        ("System", "note", &[0, 1, 3], "text", "Text"),
        ("System", "note", &[0, 1, 4], "text", "Text"),
        ("Mission", "place", &[1, 0], "name", "name of the place"),
        ("Mission", "place", &[1, 1], "name", "name of the place"),
        ("Mission", "transition", &[1, 3], "name", "name of the transition"),
        ("Mission", "transition", &[1, 4], "name", "name of the transition"),
        ("Mission", "transition", &[1, 3], "timeout", "timeout"),
        ("Mission", "transition", &[1, 4], "timeout", "timeout"),
        ("Mission", "transition", &[1, 3], "when", "guard"),
        ("Mission", "transition", &[1, 4], "when", "guard"),
    ];
    let label_of = |values: &BTreeMap<ValuePlace, String>, sort: &str, path: &[usize]| {
        let key = match sort {
            "group" => "title",
            "note" => "text",
            _ => "name",
        };
        let value = values.get(&(path.to_vec(), key.to_owned()));
        format!("{sort} {}", value.map_or("", String::as_str))
    };
    let mut changes = 0;
    for session in 0..60 {
        let before = read_values(&window.text());
        let (view, sort, path, attribute, label) = fields[random.below(fields.len())];
        window.click(&format!("view: {view}"));
        select(&mut window, &label_of(&before, sort, path));
        window.click(label);
        window.keys(Modifiers::COMMAND, Key::A);
        let edited: ValuePlace = (path.to_vec(), attribute.to_owned());
        let old = before.get(&edited).cloned().unwrap_or_default();
        let mut texts = BTreeSet::from([old.clone()]);
        // What is written has the session's number, so that two elements never have one name.
        let own = format!("s{session}");
        for step in 0..=random.below(6) {
            match random.below(9) {
                0 => window.key(Key::Backspace),
                1 => window.keys(Modifiers::COMMAND, Key::Z),
                2 => window.keys(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z),
                3 => window.keys(Modifiers::COMMAND, Key::A),
                4 => window.write("7s"),
                5 => window.write("b7 < 3"),
                _ if step == 0 => window.write(&own),
                _ => window.write(["a", "b7", "q"][random.below(3)]),
            }
            texts.insert(window.value(label).trim().to_owned());
        }
        let other = fields.iter().find(|it| it.0 == view && it.2 != path && it.1 != "group");
        let other = other.map(|it| label_of(&before, it.1, it.2)).unwrap();
        match random.below(4) {
            0 => window.key(Key::Escape),
            1 => window.key(Key::Tab),
            2 => select(&mut window, &other),
            // In a note, Enter is a letter of its text.
            _ if sort == "note" => select(&mut window, &other),
            _ => {
                window.key(Key::Enter);
                window.write("z");
            }
        }
        // A note that still has the focus is left.
        select(&mut window, &other);
        let after = read_values(&window.text());
        let context = format!("seed {seed}, session {session}: {label} of {path:?}, {texts:?}");
        let new = after.get(&edited).cloned().unwrap_or_default();
        assert!(texts.contains(new.trim()) || new.trim().is_empty(), "{context}: {new}");
        changes += usize::from(new != old);
        let others = |values: &BTreeMap<ValuePlace, String>| {
            let mut values = values.clone();
            values.remove(&edited);
            values
        };
        assert_eq!(others(&before), others(&after), "{context}");
    }
    assert!(changes > 10, "only {changes} of the fields changed");
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
