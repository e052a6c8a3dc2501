//! The panels around the view: palette, properties, problems, and messages.

pub(super) mod find;

use armor_robotfile::{Finding, Severity};
use eframe::egui::{
    self, Align2, Area, Frame, Id, Order, Panel, Rect, RichText, ScrollArea, Stroke, Vec2,
};

use crate::app::Designer;
use crate::app::dialogs::Dialog;
use crate::commands::{Command, about};
use crate::help::pages::HelpPage;
use crate::messages::MessageKind;
use crate::remedy::{APPLIES, offers};
use crate::view::View;
use crate::window_words::in_window_words;

/// A panel at a side gets at most this share of the window.
const SIDE_SHARE: f32 = 0.35;
/// The width of the palette when it is folded: that of its button.
const FOLDED_WIDTH: f32 = 28.0;
/// The width of a message, and what it leaves free of the drawing at its sides.
const MOST_MESSAGE: f32 = 560.0;
const LEAST_MESSAGE: f32 = 120.0;
const MESSAGE_MARGIN: f32 = 24.0;

impl Designer {
    pub(super) fn side_panels(&mut self, ui: &mut egui::Ui) {
        // In the live view the log takes their place.
        let is_shown = self.workspace.settings.problems && self.view != View::Live;
        if is_shown && !self.shows_notes && self.has_only_notes() {
            Panel::bottom("folded problems").show(ui, |ui| self.show_folded_problems(ui));
        } else if is_shown {
            let panel =
                Panel::bottom("problems").resizable(true).default_size(130.0).min_size(60.0);
            panel.show(ui, |ui| self.show_problems(ui));
        }
        // The drawing keeps the largest share, also after the window was made narrower.
        let most = ui.available_width() * SIDE_SHARE;
        if !self.is_palette_open() {
            let panel = Panel::left("folded palette").resizable(false).exact_size(FOLDED_WIDTH);
            panel.show(ui, |ui| self.show_folded_palette(ui));
        } else {
            let panel = Panel::left("palette").resizable(true).default_size(220.0);
            let panel = panel.size_range(150.0..=most.max(150.0));
            panel.show(ui, |ui| {
                let (pane, workspace) = self.pane();
                pane.show_left_panel(ui, workspace);
            });
        }
        if self.workspace.settings.properties {
            let panel = Panel::right("properties").resizable(true).default_size(260.0);
            let panel = panel.size_range(220.0..=most.max(220.0));
            panel.show(ui, |ui| {
                let (pane, workspace) = self.pane();
                pane.show_right_panel(ui, workspace);
            });
        }
    }

    /// Whether the panel at the left is open. In the live view it lists what runs, in that of the
    /// map the tools; there it stays open until it is folded.
    pub(super) fn is_palette_open(&self) -> bool {
        match self.view {
            View::Live | View::Map => self.workspace.settings.palette.unwrap_or(true),
            View::System | View::Mission => self.workspace.palette,
        }
    }

    /// Shows the button that opens the palette.
    fn show_folded_palette(&mut self, ui: &mut egui::Ui) {
        let entry = about(Command::TogglePalette);
        ui.add_space(armor_picture::theme::NEAR);
        ui.vertical_centered(|ui| {
            let button = egui::Button::new("»").min_size(Vec2::splat(FOLDED_WIDTH - 8.0));
            let keys = entry.keys.map(|keys| ui.ctx().format_shortcut(&keys)).unwrap_or_default();
            let button = ui.add(button).on_hover_text(format!("Open the palette ({keys})"));
            if button.accessible_name("Open the palette").clicked() {
                self.workspace.order_command(Command::TogglePalette);
            }
        });
    }

    fn has_only_notes(&self) -> bool {
        let mut findings = self.workspace.project.checked().findings.iter();
        findings.all(|finding| finding.severity() == Severity::Note)
    }

    /// Shows in one line that nothing needs attention.
    fn show_folded_problems(&mut self, ui: &mut egui::Ui) {
        let notes = self.workspace.project.checked().findings.iter().count();
        ui.horizontal(|ui| {
            ui.strong("Problems");
            ui.weak(match notes {
                0 => "none".to_owned(),
                1 => "none, 1 note".to_owned(),
                notes => format!("none, {notes} notes"),
            });
            if notes > 0 && ui.small_button("Show notes").clicked() {
                self.shows_notes = true;
            }
        });
    }

    /// Shows the findings as `armor check` prints them; a click shows the item.
    fn show_problems(&mut self, ui: &mut egui::Ui) {
        let findings = std::sync::Arc::clone(&self.workspace.project.checked().findings);
        ui.horizontal(|ui| {
            ui.strong("Problems");
            if self.workspace.project.is_checking() {
                ui.weak("checking");
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if self.shows_notes && ui.small_button("Fold notes").clicked() {
                    self.shows_notes = false;
                }
                if ui.small_button("Hide").clicked() {
                    self.workspace.order_command(Command::ToggleProblems);
                }
            });
        });
        if findings.is_empty() {
            ui.weak("No problems.");
        }
        // Only visible lines are laid out: there may be hundreds.
        let height = ui.text_style_height(&egui::TextStyle::Body) + 2.0;
        let list = ScrollArea::vertical().auto_shrink(false);
        let mut sorted: Vec<_> = findings.iter().collect();
        sorted.sort_by_key(|finding| match finding.severity() {
            Severity::Error => 0,
            Severity::Warning => 1,
            Severity::Note => 2,
        });
        list.show_rows(ui, height, sorted.len(), |ui, rows| {
            for finding in &sorted[rows] {
                self.show_problem(ui, finding, height);
            }
        });
    }

    /// Shows one line; its tooltip holds what does not fit.
    fn show_problem(&mut self, ui: &mut egui::Ui, finding: &Finding, height: f32) {
        let (sign, colour) = match finding.severity() {
            Severity::Error => ("error", ui.visuals().error_fg_color),
            Severity::Warning => ("warning", ui.visuals().warn_fg_color),
            Severity::Note => ("note", ui.visuals().weak_text_color()),
        };
        let ctx = ui.ctx().clone();
        let shown = |text: &str| crate::text::paintable(&ctx, text).into_owned();
        let place = finding.at.as_ref().map(|at| {
            let (line, _) = at.line_column();
            let file = at.source.path().file_name().unwrap_or_default().to_string_lossy();
            shown(&format!("{file}:{line}"))
        });
        ui.horizontal(|ui| {
            ui.set_height(height);
            ui.spacing_mut().item_spacing.x = 7.0;
            ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Truncate);
            ui.colored_label(colour, RichText::new(sign).strong());
            let code = finding.code.as_str();
            let page = ui.link(code).on_hover_text("Shows what it means, with an example");
            if page.accessible_name(format!("page of {code}")).clicked() {
                self.dialog = Some(Dialog::Page(HelpPage::Finding(finding.code)));
            }
            if let Some(place) = place {
                ui.weak(place);
            }
            let message = shown(&finding.message);
            let remedy = shown(&in_window_words(&finding.remedy));
            let whole = format!("{message}\n{remedy}");
            if ui.link(message).on_hover_text(whole).clicked()
                && let Some(at) = &finding.at
            {
                self.workspace.shown = self.workspace.project.item_at(at);
            }
            for offer in offers(finding, &self.workspace.project) {
                if !self.workspace.can_apply(&offer.edit) {
                    continue;
                }
                let button = ui.small_button(shown(&offer.label)).on_hover_text(APPLIES);
                if button.clicked() {
                    self.workspace.apply_offer(&offer);
                }
            }
            if !remedy.is_empty() {
                ui.weak(remedy);
            }
        });
    }

    /// Shows the messages over the drawing.
    pub(super) fn show_messages(&mut self, ctx: &egui::Context, middle: Rect) {
        let shown = self.workspace.messages.current().to_vec();
        if shown.is_empty() {
            return;
        }
        let mut dismissed = None;
        // Over the drawing only: the panels at its sides have fields.
        let width = (middle.width() - 2.0 * MESSAGE_MARGIN).clamp(LEAST_MESSAGE, MOST_MESSAGE);
        let area = Area::new(Id::unique("messages")).order(Order::Foreground);
        let area = area.fixed_pos(middle.center_bottom() - Vec2::new(0.0, 14.0));
        area.pivot(Align2::CENTER_BOTTOM).show(ctx, |ui| {
            for (n, message) in shown.iter().enumerate() {
                let colour = match message.kind {
                    MessageKind::Done => ui.visuals().widgets.noninteractive.bg_stroke.color,
                    MessageKind::Refused => ui.visuals().warn_fg_color,
                };
                let frame = Frame::popup(ui.style()).stroke(Stroke::new(1.0, colour));
                let response = frame.show(ui, |ui| {
                    ui.set_max_width(width);
                    let mut text = crate::text::paintable(ctx, &message.text).into_owned();
                    if message.count > 1 {
                        text += &format!(" ({} times)", message.count);
                    }
                    ui.add(egui::Label::new(text).wrap().sense(egui::Sense::click()))
                });
                if response.inner.on_hover_text("Click to dismiss").clicked() {
                    dismissed = Some(n);
                }
            }
        });
        if let Some(number) = dismissed {
            self.workspace.messages.dismiss(number);
        }
        if let Some(wait) = self.workspace.messages.next_change() {
            ctx.request_repaint_after(wait);
        }
    }
}
