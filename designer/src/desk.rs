//! What the views share, and what a view is.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use eframe::egui;

use crate::canvas::Diagram;
use crate::commands::{Command, about};
use crate::item::Item;
use crate::live::session::Session;
use crate::project::{Documents, Project, Refused};
use crate::settings::Settings;

/// A message is shown for so long.
const SHOWN_FOR: Duration = Duration::from_secs(8);

/// What every view works with.
pub struct Desk {
    /// The open files.
    pub project: Project,
    /// What runs.
    pub live: Session,
    /// What the user likes.
    pub settings: Settings,
    /// The messages.
    pub messages: Messages,
    /// Commands that are to be run at the end of this frame.
    pub commands: Vec<Command>,
    /// An item that is to be shown at the end of this frame, in whichever view has it.
    pub shown: Option<Item>,
}

impl Desk {
    /// Runs a command once the frame is drawn.
    pub fn order(&mut self, command: Command) {
        self.commands.push(command);
    }

    /// A line of a menu at the pointer that runs a command.
    pub fn offer(&mut self, ui: &mut egui::Ui, command: Command, may: bool) {
        let entry = about(command);
        let mut button = egui::Button::new(entry.name);
        if let Some(keys) = entry.keys {
            button = button.shortcut_text(ui.ctx().format_shortcut(&keys));
        }
        let button = ui.add_enabled(may, button).on_hover_text(entry.doc);
        if button.accessible_name(format!("here: {}", entry.name)).clicked() {
            self.order(command);
            ui.close();
        }
    }

    /// Makes one edit of the files, one step of the history; why it is refused is a message.
    /// Returns whether it was made.
    pub fn edit(
        &mut self,
        what: impl Into<String>,
        edit: impl FnOnce(&mut Documents) -> Result<(), Refused>,
    ) -> bool {
        match self.project.edit(what, edit) {
            Ok(()) => true,
            Err(refused) => {
                self.messages.warn(refused.to_string());
                false
            }
        }
    }
}

/// One view: what it shows in which part of the window, and which commands it knows.
pub trait Pane {
    /// The panel at the left, if it has one.
    fn left(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        let _ = (ui, desk);
    }

    /// The panel at the right: what is selected.
    fn right(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        let _ = (ui, desk);
    }

    /// The middle.
    fn centre(&mut self, ui: &mut egui::Ui, desk: &mut Desk);

    /// Whether a question is open over the drawing, which takes the keys.
    fn is_asking(&self) -> bool {
        false
    }

    /// Whether a command can be run now; `None` if it is none of this view's.
    fn may(&self, command: Command, desk: &Desk) -> Option<bool>;

    /// Runs a command of this view's.
    fn run(&mut self, command: Command, ctx: &egui::Context, desk: &mut Desk);

    /// Ends what is being written into a field, as if the field were left: saving or leaving the
    /// files means it too. Returns whether it was taken; if not, a message states why.
    fn finish(&mut self, desk: &mut Desk) -> bool {
        let _ = desk;
        true
    }

    /// What is being written into a field, to be kept with what is not saved.
    fn draft(&self) -> Option<Draft> {
        None
    }

    /// The whole drawing as it is now, for a picture.
    fn drawing(&mut self, desk: &Desk) -> &Diagram<Item>;

    /// Selects an item and brings it into view.
    fn show_item(&mut self, item: Item, desk: &Desk);

    /// Selects items and looks where it looked.
    fn select(&mut self, items: BTreeSet<Item>) {
        let _ = items;
    }

    /// Takes what was pasted, if it is for this view.
    fn paste(&mut self, text: &str, desk: &mut Desk);

    /// Everything that can be found, with the words it is found by.
    fn findable(&self, desk: &Desk) -> Vec<(Item, String)>;
}

/// What is being written into a field, and has changed nothing yet.
pub struct Draft {
    /// Another number with each letter.
    pub revision: u64,
    /// Makes the change that leaving the field would make.
    pub change: Box<Edit>,
}

/// A change of the files.
pub type Edit = dyn FnOnce(&mut Documents) -> Result<(), Refused>;

/// How grave a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Something was done.
    Told,
    /// Something was not done.
    Warned,
}

/// The messages, the newest last.
#[derive(Debug, Default)]
pub struct Messages {
    list: Vec<(Instant, Tone, String)>,
}

impl Messages {
    /// Reports that something was done.
    pub fn tell(&mut self, text: impl Into<String>) {
        self.push(Tone::Told, text.into());
    }

    /// Reports that something was not done, and why.
    pub fn warn(&mut self, text: impl Into<String>) {
        self.push(Tone::Warned, text.into());
    }

    /// What is still shown.
    pub fn current(&mut self) -> &[(Instant, Tone, String)] {
        self.list.retain(|(since, ..)| since.elapsed() < SHOWN_FOR);
        &self.list
    }

    /// How long until the oldest goes.
    pub fn next_change(&self) -> Option<Duration> {
        self.list.first().map(|(since, ..)| SHOWN_FOR.saturating_sub(since.elapsed()))
    }

    /// The newest, also one that is not shown any longer.
    pub fn last(&self) -> Option<&str> {
        self.list.last().map(|(.., text)| text.as_str())
    }

    /// Takes one away.
    pub fn dismiss(&mut self, number: usize) {
        if number < self.list.len() {
            self.list.remove(number);
        }
    }

    fn push(&mut self, tone: Tone, text: String) {
        self.list.retain(|(.., old)| *old != text);
        self.list.push((Instant::now(), tone, text));
        // More would cover the drawing.
        if self.list.len() > 4 {
            self.list.remove(0);
        }
    }
}
