//! Random gestures and keys against a model of the file: its text is what the steps of the history
//! make it, to the byte, and only saving writes the disk.

use eframe::egui::{Key, Modifiers, Pos2, vec2};
use egui_kittest::kittest::{Queryable, by};

use crate::ui::{Window, read};

const ROBOT: &str = r#"<?xml version="1.0"?>
<armor version="1">
  <!-- as a person wrote it -->
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device"   value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <component name="spare" kind="arm"/>
    <link from="eye.target" to="arm.target" keep="all"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <block of="arm" x="300" y="0"/>
      <block of="spare" x="0" y="260"/>
    </layout>
  </system>
  <mission name="bench" goal="home">
    <place name="explore" initial="true" components="arm"/>
    <place name="home"/>
    <transition name="late" from="explore" to="home" timeout="90s"/>
  </mission>
</armor>
"#;

/// Actions of one sequence.
const ACTIONS: usize = 40;

/// The texts that the history has made, the oldest first.
struct Model {
    texts: Vec<String>,
    at: usize,
}

impl Model {
    /// Takes note of what an action has made: a step, or several.
    fn take(&mut self, window: &mut Window, context: &str) {
        let now = window.text();
        if now == self.texts[self.at] {
            return;
        }
        // The steps in between, newest first, by undoing them.
        let mut between = vec![now.clone()];
        loop {
            let project = &mut window.harness.state_mut().workspace().project;
            assert!(project.undo().is_some(), "{context}: no step leads to the text");
            let text = window.text();
            if text == self.texts[self.at] {
                break;
            }
            between.push(text);
        }
        for _ in &between {
            let project = &mut window.harness.state_mut().workspace().project;
            assert!(project.redo().is_some(), "{context}: a step is lost");
        }
        assert_eq!(window.text(), now, "{context}");
        self.texts.truncate(self.at + 1);
        self.texts.extend(between.into_iter().rev());
        self.at = self.texts.len() - 1;
    }

    /// Undo or redo by key changes nothing, as in a field, or leads to the neighbour of the text.
    fn step(&mut self, window: &mut Window, is_undo: bool, context: &str) {
        let now = window.text();
        if now == self.texts[self.at] {
            return;
        }
        let neighbour = if is_undo { self.at.checked_sub(1) } else { Some(self.at + 1) };
        let expected = neighbour.and_then(|at| self.texts.get(at));
        if expected == Some(&now) {
            self.at = neighbour.unwrap_or_default();
        } else {
            // The field that was being edited was applied first.
            self.take(window, context);
        }
    }

    /// All steps undone are the first text, and redone the last.
    fn check_whole(&self, window: &mut Window, context: &str) {
        for text in self.texts[..self.at].iter().rev() {
            window.harness.state_mut().workspace().project.undo();
            assert_eq!(window.text(), *text, "{context}: undone");
        }
        assert!(window.harness.state_mut().workspace().project.undo().is_none(), "{context}");
        for text in &self.texts[1..] {
            window.harness.state_mut().workspace().project.redo();
            assert_eq!(window.text(), *text, "{context}: redone");
        }
        assert!(window.harness.state_mut().workspace().project.redo().is_none(), "{context}");
        assert_eq!(read(&window.path("robot.xml")), ROBOT, "{context}: only saving writes");
    }
}

/// Something to be pointed at: a block, a port, a place, or a point of the drawing.
fn point(window: &Window, random: &mut fastrand::Rng) -> Pos2 {
    let words =
        ["component", "output", "input", "place", "transition", "arc from", "link", "group "];
    let named = window.harness.query_all(by().predicate(move |node| {
        node.label().is_some_and(|label| words.iter().any(|word| label.starts_with(word)))
    }));
    let named: Vec<_> = named.map(|node| node.rect().center()).collect();
    let anywhere = Pos2::new(260.0 + 700.0 * random.f32(), 80.0 + 500.0 * random.f32());
    match named.len() {
        0 => anywhere,
        count if random.u8(..5) > 0 => named[random.usize(..count)],
        _ => anywhere,
    }
}

fn act(window: &mut Window, model: &mut Model, random: &mut fastrand::Rng, context: &str) {
    let shift = Modifiers::COMMAND | Modifiers::SHIFT;
    let ctrl = Modifiers::COMMAND;
    match random.u8(..24) {
        0..=3 => {
            let at = point(window, random);
            window.click_at(at);
        }
        4..=7 => {
            let (from, to) = (point(window, random), point(window, random));
            let to = if random.bool() { to } else { from + vec2(60.0, 40.0) };
            window.drag(from, to);
        }
        8 => {
            window.key(Key::A);
            window.write(["lam", "eye", "ho", "x"][random.usize(..4)]);
            window.key(Key::Enter);
        }
        9 => window.key(Key::Delete),
        10 if random.u8(..3) == 0 => window.keys(shift, Key::G),
        10 => window.keys(ctrl, [Key::D, Key::G, Key::L, Key::A][random.usize(..4)]),
        11 => window.key([Key::N, Key::Escape, Key::Tab, Key::L, Key::F][random.usize(..5)]),
        12 => {
            window.key(Key::F2);
            window.write(["q", "hand", "7", ""][random.usize(..4)]);
            window.key([Key::Enter, Key::Escape, Key::Tab][random.usize(..3)]);
        }
        13 => {
            let arrows = [Key::ArrowLeft, Key::ArrowRight, Key::ArrowUp, Key::ArrowDown];
            let modifiers = [Modifiers::NONE, Modifiers::SHIFT, Modifiers::ALT][random.usize(..3)];
            window.keys(modifiers, arrows[random.usize(..4)]);
        }
        14 => window.keys(ctrl, [Key::Num1, Key::Num2][random.usize(..2)]),
        15 => window.key(Key::Escape),
        16..=20 => {
            // The field that is being edited is applied by the command, as a step of its own.
            window.key(Key::Escape);
            model.take(window, context);
            window.keys(ctrl, Key::Z);
            model.step(window, true, context);
        }
        _ => {
            window.key(Key::Escape);
            model.take(window, context);
            let (modifiers, key) = if random.bool() { (shift, Key::Z) } else { (ctrl, Key::Y) };
            window.keys(modifiers, key);
            model.step(window, false, context);
        }
    }
}

/// `ARMOR_SEQUENCES` is the number of sequences, `ARMOR_SEED` the seed of the first.
#[test]
fn random_gestures_change_the_text_only_by_steps_of_the_history() {
    let number = |name: &str, default| {
        std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
    };
    let (sequences, first): (u64, u64) = (number("ARMOR_SEQUENCES", 4), number("ARMOR_SEED", 1));
    for seed in first..first + sequences {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut window = Window::open(Some(ROBOT));
        let mut model = Model { texts: vec![ROBOT.to_owned()], at: 0 };
        for action in 0..ACTIONS {
            let context = format!("seed {seed}, action {action}");
            act(&mut window, &mut model, &mut random, &context);
            model.take(&mut window, &context);
        }
        model.check_whole(&mut window, &format!("seed {seed}"));
    }
}
