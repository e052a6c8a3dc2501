//! The welcome page: three steps to a robot, the examples, and the recent files.

use std::path::{Path, PathBuf};

use armor_picture::theme::{self, ThemeColours};
use eframe::egui::{
    self, Align, CornerRadius, Frame, Layout, Margin, RichText, ScrollArea, Sense, Ui, UiBuilder,
};

use crate::commands::{Command, about};
use crate::disk::examples::{EXAMPLES, Example};

/// Widest that a line of the page gets.
const WIDTH: f32 = 900.0;

/// The three steps: a title, and how it is done.
const STEPS: [(&str, &str); 3] = [
    (
        "Draw the robot",
        "Drag components from the palette and link their ports. The number on a block counts \
         the parameters that need a value: double-click it.",
    ),
    (
        "Draw the mission",
        "Each place lists the components that are active in it; transitions lead from place to \
         place. Mistakes, and what can never happen, are shown while you draw.",
    ),
    (
        "Run it",
        "Save and press Run. The blocks show what is active, the links how much data flows, the \
         net where the mission is.",
    ),
];

/// What was chosen on the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Chosen {
    /// A command.
    Run(Command),
    /// A copy of an example.
    Example(&'static Example),
    /// A file that was open before.
    Open(PathBuf),
    /// The drawing that is open.
    Back,
}

/// Shows the page in all of `ui`. `has_drawing`: there is one to go back to.
pub fn show(ui: &mut Ui, recent: &[PathBuf], has_drawing: bool) -> Option<Chosen> {
    let mut chosen = None;
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let side = ((ui.available_width() - WIDTH) / 2.0).max(16.0);
        let rect = ui.available_rect_before_wrap();
        let rect = rect.with_min_x(rect.left() + side).with_max_x(rect.right() - side);
        ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
            ui.add_space(theme::FAR);
            ui.label(RichText::new("Armor designer").size(30.0).strong());
            ui.label("Draw a robot as blocks and its mission as a net, and watch both run.");
            ui.add_space(theme::FAR);
            steps(ui);
            ui.add_space(theme::FAR);
            chosen = begin(ui, has_drawing).or_else(|| examples(ui)).or_else(|| before(ui, recent));
            ui.add_space(theme::FAR);
        });
    });
    chosen
}

fn steps(ui: &mut Ui) {
    ui.columns(3, |columns| {
        for (n, (ui, (title, how))) in columns.iter_mut().zip(STEPS).enumerate() {
            card(ui, |ui| {
                ui.set_min_height(110.0);
                ui.label(
                    RichText::new(format!("{}  {title}", n + 1)).size(theme::HEADING).strong(),
                );
                ui.label(how);
            });
        }
    });
}

fn begin(ui: &mut Ui, has_drawing: bool) -> Option<Chosen> {
    let mut chosen = None;
    ui.horizontal(|ui| {
        for (command, name) in [(Command::New, "Start a new robot"), (Command::Open, "Open a file")]
        {
            let button = match command {
                Command::New => theme::main_button(ThemeColours::of(ui.visuals()), name),
                _ => egui::Button::new(name),
            };
            let button = ui.add(button.min_size([170.0, 36.0].into()));
            if button.on_hover_text(about(command).doc).clicked() {
                chosen = Some(Chosen::Run(command));
            }
        }
        if has_drawing {
            let back = egui::Button::new("Back to the drawing").min_size([110.0, 36.0].into());
            if ui.add(back).on_hover_text("Closes this page.").clicked() {
                chosen = Some(Chosen::Back);
            }
        }
        ui.weak("or drop a file on the window; F1 shows all keys");
    });
    ui.add_space(theme::FAR);
    chosen
}

fn examples(ui: &mut Ui) -> Option<Chosen> {
    let mut chosen = None;
    ui.label(RichText::new("Examples").size(theme::HEADING).strong());
    ui.weak("Examples open as copies that you can change.");
    for row in EXAMPLES.chunks(3) {
        ui.columns(3, |columns| {
            for (ui, example) in columns.iter_mut().zip(row) {
                let is_clicked = clickable(ui, example.title, |ui| {
                    ui.set_min_height(62.0);
                    ui.label(RichText::new(example.title).size(theme::HEADING).strong());
                    ui.label(example.about);
                });
                if is_clicked {
                    chosen = Some(Chosen::Example(example));
                }
            }
        });
        ui.add_space(theme::NEAR);
    }
    ui.add_space(theme::GAP);
    chosen
}

fn before(ui: &mut Ui, recent: &[PathBuf]) -> Option<Chosen> {
    if recent.is_empty() {
        return None;
    }
    let mut chosen = None;
    ui.label(RichText::new("Recent files").size(theme::HEADING).strong());
    for path in recent {
        ui.horizontal(|ui| {
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
            if ui.link(name.as_ref()).on_hover_text(crate::text::path(path)).clicked() {
                chosen = Some(Chosen::Open(path.clone()));
            }
            ui.weak(crate::text::path(path.parent().unwrap_or(Path::new(""))));
        });
    }
    chosen
}

fn card(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    let (fill, border) = (ui.visuals().window_fill, ui.visuals().window_stroke);
    let frame = Frame::NONE.fill(fill).stroke(border).corner_radius(CornerRadius::same(8));
    frame.inner_margin(Margin::same(12)).show(ui, |ui| {
        ui.with_layout(Layout::top_down(Align::LEFT), |ui| {
            ui.set_min_width(ui.available_width());
            add(ui);
        });
    });
}

/// A card that is a button called `name`.
fn clickable(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui)) -> bool {
    let response = ui
        // Selectable text would receive the click.
        .scope_builder(UiBuilder::new().id_salt(name).sense(Sense::click()), |ui| {
            ui.style_mut().interaction.selectable_labels = false;
            let is_lit = ui.response().hovered() || ui.response().has_focus();
            if is_lit {
                let lit = ui.visuals().widgets.hovered;
                ui.visuals_mut().window_fill = lit.weak_bg_fill;
                ui.visuals_mut().window_stroke = lit.bg_stroke;
            }
            card(ui, add);
        })
        .response;
    response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Open the example {name}"))
    });
    response.on_hover_cursor(egui::CursorIcon::PointingHand).clicked()
}
