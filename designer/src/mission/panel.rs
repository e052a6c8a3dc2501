//! The panel at the right: what is selected in the mission, or the mission as a whole.

mod arcs;
mod claims;
mod fields;
mod place;
mod sets;
mod timing;
mod transition;
mod waits;
mod whole;

use armor_robotfile::mission::{ArcKind, Mission};
use armor_robotfile::{Configuration, Finding, Severity};
use eframe::egui::{self, RichText};

use super::form::Form;
use super::marks::Marks;
use crate::item::Item;
use crate::kinds::Kinds;
use crate::project::Project;
use crate::theme::Colours;

/// What the panels show.
pub struct Shown<'a> {
    /// The open files.
    pub project: &'a Project,
    /// The files as read.
    pub configuration: &'a Configuration,
    /// Its mission.
    pub mission: &'a Mission,
    /// The kinds of components.
    pub kinds: &'a Kinds,
    /// What was found in the files.
    pub marks: &'a Marks,
    /// Whether more may be found.
    pub is_checking: bool,
}

/// What a panel asks for beside changes.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// Show this.
    Show(Item),
    /// Play these firings, at their earliest or latest moments.
    Play(armor_robotfile::Way),
}

impl Shown<'_> {
    /// What the file says of an attribute, if that is not understood.
    fn unread(&self, item: &Item, attribute: &str) -> Option<&str> {
        self.project.unread(item.named()?, attribute)
    }

    /// The names of the places, behind them those that sub-missions bring are not.
    pub fn places(&self) -> Vec<String> {
        self.mission.places.iter().map(|place| place.name.value.clone()).collect()
    }

    /// The names of the components.
    pub fn components(&self) -> Vec<String> {
        let components = &self.configuration.system.components;
        components.iter().map(|component| component.name.value.clone()).collect()
    }
}

/// Shows what is selected; answers what else is wanted.
pub fn show(ui: &mut egui::Ui, shown: &Shown<'_>, selected: &[Item], form: &mut Form) -> Vec<Wish> {
    let mut wishes = Vec::new();
    match selected {
        [item @ Item::Place(name)] => {
            if let Some(place) = shown.mission.place(name) {
                place::show(ui, shown, place, form.of(item), &mut wishes);
            }
        }
        [item @ Item::Transition(name)] => {
            let transitions = &shown.mission.transitions;
            if let Some(transition) = transitions.iter().find(|t| t.name.value == *name) {
                transition::show(ui, shown, transition, form.of(item), &mut wishes);
            }
        }
        [item @ Item::Arc { .. }] => arcs::show_one(ui, shown, item, form.of(item)),
        [item @ Item::Submission(number)] => {
            sets::submission(ui, shown, *number, form.of(item));
        }
        [] | [Item::Mission | Item::Variable(_) | Item::Exclusive(_) | Item::Check(_)] => {
            whole::show(ui, shown, form.of("mission"), &mut wishes);
            return wishes;
        }
        many => {
            ui.heading(format!("{} things", many.len()));
            ui.label("Drag moves them, Delete removes them, Ctrl+D duplicates them.");
        }
    }
    if let [item] = selected {
        findings(ui, shown, item, &mut wishes);
    }
    wishes
}

/// What was found of an item, with the firings that show it.
fn findings(ui: &mut egui::Ui, shown: &Shown<'_>, item: &Item, wishes: &mut Vec<Wish>) {
    let mut found = shown.marks.found(item).peekable();
    if found.peek().is_none() {
        return;
    }
    section(ui, "What is found");
    for finding in found {
        tell(ui, finding, wishes);
    }
}

/// A finding in a few lines.
pub fn tell(ui: &mut egui::Ui, finding: &Finding, wishes: &mut Vec<Wish>) {
    let colours = Colours::of(ui.visuals());
    let (sign, colour) = match finding.severity() {
        Severity::Error => ("x", colours.error),
        Severity::Warning => ("!", colours.warning),
        Severity::Note => ("i", colours.weak),
    };
    ui.label(RichText::new(format!("{sign} {}", finding.message)).color(colour));
    if !finding.remedy.is_empty() {
        ui.label(RichText::new(&finding.remedy).weak().small());
    }
    if let Some(way) = &finding.way {
        let text = match way.firings.len() + way.circle.len() {
            1 => "Play its firing".to_owned(),
            count => format!("Play its {count} firings"),
        };
        if ui.button(text).on_hover_text(way.firings.join(", ")).clicked() {
            wishes.push(Wish::Play(way.clone()));
        }
    }
}

fn section(ui: &mut egui::Ui, title: &str) {
    ui.add_space(8.0);
    ui.separator();
    ui.label(RichText::new(title).strong());
}

/// A link-like button that shows an item.
fn go_to(ui: &mut egui::Ui, text: &str, item: Item, wishes: &mut Vec<Wish>) {
    if ui.link(text).on_hover_text(format!("Show {item}")).clicked() {
        wishes.push(Wish::Show(item));
    }
}

/// What an arc does, in a word.
pub fn arc_word(kind: ArcKind) -> &'static str {
    match kind {
        ArcKind::Take => "takes from",
        ArcKind::Put => "puts into",
        ArcKind::Read => "reads",
        ArcKind::Inhibitor => "not while in",
        ArcKind::Reset => "empties",
    }
}
