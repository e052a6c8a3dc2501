//! The window as a person or a screen reader meets it: everything by its accessible name, without a
//! display.

mod bench_kinds;
mod catalogue;
mod changes;
mod derived;
mod disk;
mod drafts;
mod drawings;
mod elsewhere;
mod folding;
mod help;
mod keyboard;
mod links;
mod live;
mod live_room;
mod map;
mod map_attach;
mod map_live;
mod map_numbers;
mod map_times;
mod mission;
mod model;
mod playback;
mod properties;
mod refused;
mod remedies;
mod still_system;
mod typing;
mod undo;
mod unread;
mod versions;
mod window;
mod writing;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use armor_designer::{Designer, Settings, Start, View};
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

/// A window of the size of a small screen.
const SIZE: Vec2 = Vec2::new(1400.0, 900.0);

/// A window on a file, and the folder that the file is in.
struct Window {
    harness: Harness<'static, Designer>,
    folder: PathBuf,
}

impl Window {
    /// A window on a file with this text; none begins from nothing.
    fn open(text: Option<&str>) -> Self {
        Self::open_as(text, |_, _| ())
    }

    /// The same, begun otherwise: `change` is given the window's own folder.
    fn open_as(text: Option<&str>, change: impl FnOnce(&Path, &mut Start)) -> Self {
        Self::open_sized(SIZE, text, change)
    }

    /// The same of another size.
    fn open_sized(size: Vec2, text: Option<&str>, change: impl FnOnce(&Path, &mut Start)) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("armor-designer-ui-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        let file = text.map(|text| {
            let path = folder.join("robot.xml");
            std::fs::write(&path, text).unwrap();
            path
        });
        let mut start = Start {
            file,
            view: View::System,
            kinds: Some(bench_kinds::kinds()),
            ..Start::default()
        };
        change(&folder, &mut start);
        let harness = Harness::builder()
            .with_size(size)
            .with_max_steps(64)
            .build_eframe(|creation| Designer::new(&creation.egui_ctx, start, Settings::default()));
        let mut window = Self { harness, folder };
        window.settle();
        window
    }

    /// Waits until all is checked and drawn.
    fn settle(&mut self) {
        self.harness.run_steps(3);
        let saved = self.harness.state_mut().workspace().project.settle();
        assert!(saved.is_none(), "a save was in progress that no test had requested");
        self.harness.run_steps(3);
    }

    /// Draws frames until `is_so`, for what another thread or the disk takes part in.
    #[track_caller]
    fn until(&mut self, what: &str, is_so: impl Fn(&mut Self) -> bool) {
        let start = Instant::now();
        while !is_so(self) {
            assert!(start.elapsed() < Duration::from_secs(60), "in vain: {what}");
            self.harness.step();
            std::thread::sleep(Duration::from_millis(10));
        }
        self.harness.run_steps(3);
    }

    /// The text of the file as it would be saved.
    fn text(&mut self) -> String {
        self.harness.state_mut().workspace().project.files()[0].text().to_string()
    }

    /// The last message to the user.
    fn last_message(&mut self) -> String {
        self.harness.state_mut().workspace().messages.last().unwrap_or_default().to_owned()
    }

    /// The middle of what has this name.
    fn at(&self, label: &str) -> Pos2 {
        self.harness.get_by_label(label).rect().center()
    }

    /// Whether something has this name.
    fn has(&self, label: &str) -> bool {
        self.harness.query_by_label(label).is_some()
    }

    /// The text in a field.
    fn value(&self, label: &str) -> String {
        self.harness.get_by_label(label).value().unwrap_or_default()
    }

    fn click(&mut self, label: &str) {
        let at = self.at(label);
        self.click_at(at);
    }

    fn click_at(&mut self, at: Pos2) {
        self.press(at, true);
        self.press(at, false);
        self.settle();
    }

    fn double_click(&mut self, label: &str) {
        let pos = self.at(label);
        self.harness.event(Event::PointerMoved(pos));
        self.harness.step();
        // Within one frame: the time between two frames is longer than that of a double click.
        for pressed in [true, false, true, false] {
            let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
            let event = Event::PointerButton { pos, button, pressed, modifiers };
            self.harness.input_mut().events.push(event);
        }
        self.settle();
    }

    /// Drags from point to point as a hand does: in steps.
    fn drag(&mut self, from: Pos2, to: Pos2) {
        self.drag_and_hold(from, to);
        self.press(to, false);
        self.settle();
    }

    /// The same without letting go.
    fn drag_and_hold(&mut self, from: Pos2, to: Pos2) {
        self.harness.event(Event::PointerMoved(from));
        self.harness.step();
        self.press(from, true);
        for n in 1..=6 {
            self.harness.event(Event::PointerMoved(from + (to - from) * (n as f32 / 6.0)));
            self.harness.step();
        }
    }

    fn drag_between(&mut self, from: &str, to: &str) {
        let (from, to) = (self.at(from), self.at(to));
        self.drag(from, to);
    }

    fn press(&mut self, pos: Pos2, pressed: bool) {
        self.harness.event(Event::PointerMoved(pos));
        self.harness.event(Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
        self.harness.step();
    }

    fn key(&mut self, key: Key) {
        self.keys(Modifiers::NONE, key);
    }

    fn keys(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.settle();
    }

    /// Writes into the field that has the focus.
    fn write(&mut self, text: &str) {
        self.harness.event(Event::Text(text.to_owned()));
        self.settle();
    }

    /// Rewrites a field and leaves it with Enter.
    fn fill(&mut self, label: &str, text: &str) {
        self.click(label);
        self.keys(Modifiers::COMMAND, Key::A);
        self.write(text);
        self.key(Key::Enter);
    }

    /// A path in the window's own folder.
    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        // What is left behind in the folder for temporary files harms no one.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// The text of a file.
fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}
