//! The parts that all panels share: their source, their requests, and common widgets.

use std::collections::BTreeSet;

use armor_robotfile::mission::{ArcKind, Mission};
use armor_robotfile::{Configuration, Finding, Severity};
use eframe::egui::{self, RichText};

use crate::item::Item;
use crate::kinds::Kinds;
use crate::mission::marks::Marks;
use crate::project::Project;
use crate::remedy::{APPLIES, Offer, offers};
use crate::window_words::in_window_words;
use armor_picture::theme::ThemeColours;

/// What the panels show.
pub struct PanelSource<'a> {
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
    /// The steps of routes that are open in the drawing.
    pub opened: &'a BTreeSet<Item>,
}

/// What a panel requests apart from changes.
#[derive(Clone, Debug)]
pub enum PanelRequest {
    /// Show this.
    Show(Item),
    /// Play these firings, at their earliest or latest moments.
    Play(armor_robotfile::FiringTrace),
    /// Apply this remedy.
    Apply(Offer),
    /// Open or fold this step of a route.
    Toggle(Item),
}

impl PanelSource<'_> {
    /// The file's text of an attribute, if that is not understood.
    pub fn unread(&self, item: &Item, attribute: &str) -> Option<&str> {
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

/// A finding in a few lines.
pub fn show_finding(
    ui: &mut egui::Ui,
    finding: &Finding,
    project: &Project,
    requests: &mut Vec<PanelRequest>,
) {
    let colours = ThemeColours::of(ui.visuals());
    let (sign, colour) = match finding.severity() {
        Severity::Error => ("x", colours.error),
        Severity::Warning => ("!", colours.warning),
        Severity::Note => ("i", colours.weak),
    };
    ui.label(RichText::new(format!("{sign} {}", finding.message)).color(colour));
    if !finding.remedy.is_empty() {
        ui.label(RichText::new(in_window_words(&finding.remedy)).weak().small());
    }
    for offer in offers(finding, project) {
        if ui.button(&offer.label).on_hover_text(APPLIES).clicked() {
            requests.push(PanelRequest::Apply(offer));
        }
    }
    if let Some(trace) = &finding.trace {
        let text = match trace.firings.len() + trace.circle.len() {
            1 => "Play its firing".to_owned(),
            count => format!("Play its {count} firings"),
        };
        if ui.button(text).on_hover_text(trace.firings.join(", ")).clicked() {
            requests.push(PanelRequest::Play(trace.clone()));
        }
    }
}

pub fn section(ui: &mut egui::Ui, title: &str) {
    ui.add_space(armor_picture::theme::GAP);
    ui.separator();
    ui.label(RichText::new(title).strong());
}

/// A link-like button that shows an item.
pub fn go_to(ui: &mut egui::Ui, text: &str, item: Item, requests: &mut Vec<PanelRequest>) {
    if ui.link(text).on_hover_text(format!("Show {item}")).clicked() {
        requests.push(PanelRequest::Show(item));
    }
}

/// What an arc does, in a word.
pub fn arc_word(kind: ArcKind) -> &'static str {
    match kind {
        ArcKind::Take => "takes from",
        ArcKind::Put => "puts into",
        ArcKind::Read => "reads",
        ArcKind::Inhibitor => "is inhibited by",
        ArcKind::Reset => "empties",
    }
}
