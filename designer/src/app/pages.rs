//! The pages of the documentation in the window: F1 shows that of what is selected.

use armor_picture::theme::{self, ThemeColours};
use armor_robotfile::Code;
use eframe::egui::{self, Align, ComboBox, Key, Layout, RichText, ScrollArea, vec2};

use crate::app::Designer;
use crate::app::dialogs::Dialog;
use crate::help::markdown;
use crate::help::pages::{DOCUMENTS, HelpPage};
use crate::system::show_manifest;

/// Height that a page leaves for its heading and its button.
const PAGE_MARGIN: f32 = 190.0;
/// Widest page, in points.
const PAGE_WIDTH: f32 = 860.0;
/// Width of the list of sections.
const SECTIONS_WIDTH: f32 = 210.0;

impl Designer {
    /// Shows the page of the selected item or of the field that has the focus; without one, the keys.
    pub(super) fn show_help(&mut self) {
        let ctx = self.ctx.clone();
        let (pane, workspace) = self.pane();
        let page = pane.help_page(workspace, &ctx);
        match page.filter(|_| !self.first_page) {
            Some(page) => self.dialog = Some(Dialog::Page(page)),
            None => self.shortcuts = true,
        }
    }

    /// The documents as a part of the menu.
    pub(super) fn documents_menu(&mut self, ui: &mut egui::Ui) {
        ui.menu_button("Documents", |ui| {
            ui.set_min_width(210.0);
            for (document, about) in DOCUMENTS.iter().enumerate() {
                if ui.button(about.title()).clicked() {
                    self.dialog = Some(Dialog::Page(HelpPage::Document { document, section: 0 }));
                    ui.close();
                }
            }
        });
    }

    /// Shows a page until it is closed or leads to another one.
    pub(super) fn show_page(&mut self, ui: &mut egui::Ui, page: HelpPage) {
        let room = ui.ctx().content_rect().size();
        let next = match &page {
            HelpPage::Finding(code) => {
                show_finding_page(ui, *code, room.y - PAGE_MARGIN);
                None
            }
            HelpPage::Document { document, section } => {
                ui.set_width((room.x - 60.0).min(PAGE_WIDTH));
                show_document(ui, *document, *section, room.y - PAGE_MARGIN)
            }
            HelpPage::Kind { kind, parameter } => {
                self.show_kind(ui, kind, parameter.as_deref(), room.y - PAGE_MARGIN)
            }
        };
        ui.add_space(theme::NEAR);
        let close = theme::main_button(ThemeColours::of(ui.visuals()), "Close");
        let is_closed = ui.add(close).clicked() || ui.input(|i| i.key_pressed(Key::Escape));
        if !is_closed {
            self.dialog = Some(Dialog::Page(next.unwrap_or(page)));
        }
    }

    fn show_kind(
        &self,
        ui: &mut egui::Ui,
        kind: &str,
        parameter: Option<&str>,
        height: f32,
    ) -> Option<HelpPage> {
        let kinds = self.workspace.project.kinds();
        let mut next = None;
        if let Some(manifest) = kinds.find(kind) {
            let found = manifest.parameters.iter().find(|it| Some(it.name.as_str()) == parameter);
            ScrollArea::vertical().max_height(height).show(ui, |ui| match found {
                Some(parameter) => {
                    ui.heading(format!("Parameter {} of {kind}", parameter.name));
                    ui.label(crate::text::paintable(ui.ctx(), &parameter.doc).into_owned());
                    let value = parameter.default_with_unit();
                    let default = value.as_deref().unwrap_or("none: it needs a value");
                    ui.weak(format!("Default: {default}"));
                    if ui.link(format!("All of {kind}")).clicked() {
                        next = Some(HelpPage::Kind { kind: kind.to_owned(), parameter: None });
                    }
                }
                None => {
                    ui.heading(format!("Kind {kind}"));
                    show_manifest(ui, manifest, kinds.origin(kind));
                }
            });
        }
        for (text, words) in
            [("<component> in the file", "<component>"), ("<parameter> in the file", "<parameter>")]
        {
            if ui.link(text).clicked() {
                next = HelpPage::find("file-format.md", words).or(next);
            }
        }
        next
    }
}

/// The page of a finding as it is in the documentation.
fn show_finding_page(ui: &mut egui::Ui, code: Code, height: f32) {
    let (title, text) = code.page().split_once('\n').unwrap_or((code.page(), ""));
    ui.heading(title.trim_start_matches('#').trim());
    ScrollArea::vertical().max_height(height).show(ui, |ui| {
        markdown::show(ui, text, &|_| false);
    });
}

/// A section of a document with the list of all; returns the page that a click leads to.
fn show_document(
    ui: &mut egui::Ui,
    document: usize,
    section: usize,
    height: f32,
) -> Option<HelpPage> {
    let about = DOCUMENTS.get(document)?;
    let sections = about.sections();
    let mut next = None;
    let combo = ComboBox::from_id_salt("document").selected_text(about.title()).width(300.0);
    let combo = combo.show_ui(ui, |ui| {
        for (number, other) in DOCUMENTS.iter().enumerate() {
            if ui.selectable_label(number == document, other.title()).clicked() {
                next = Some(HelpPage::Document { document: number, section: 0 });
            }
        }
    });
    combo.response.accessible_name("document");
    ui.separator();
    // Of a given height: what fills the rest of a window makes it higher with each frame.
    let room = vec2(ui.available_width(), height);
    ui.allocate_ui_with_layout(room, Layout::left_to_right(Align::Min), |ui| {
        ui.vertical(|ui| {
            ui.set_width(SECTIONS_WIDTH);
            ScrollArea::vertical().id_salt("sections").max_height(height).show(ui, |ui| {
                for (number, part) in sections.iter().enumerate() {
                    let indent = "    ".repeat(part.level.saturating_sub(2));
                    let title = part.title.replace('`', "");
                    let entry = ui.selectable_label(number == section, indent + &title);
                    if entry.accessible_name(format!("section {title}")).clicked() {
                        next = Some(HelpPage::Document { document, section: number });
                    }
                }
            });
        });
        ui.separator();
        ui.vertical(|ui| {
            let Some(part) = sections.get(section) else { return };
            let scroll = ScrollArea::vertical().id_salt((document, section)).max_height(height);
            scroll.auto_shrink(false).show(ui, |ui| {
                ui.label(RichText::new(part.title.replace('`', "")).heading());
                let leads = |target: &str| HelpPage::of_link(target, about.path);
                let clicked = markdown::show(ui, part.text, &|target| leads(target).is_some());
                next = clicked.and_then(leads).or(next.take());
            });
        });
    });
    next
}
