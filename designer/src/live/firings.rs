//! The firings, and the orders with their authors.

use armor_inspect::FiringHistory;
use armor_inspect::words::format_duration;
use eframe::egui::{self, RichText, ScrollArea};

use super::watched::Watched;
use super::words::printable;
use armor_picture::theme::ThemeColours;

/// The firings, the newest first.
pub fn fired(ui: &mut egui::Ui, watched: &Watched) {
    let look = watched.mission.look();
    let history: &FiringHistory = &look.history;
    if history.fired.is_empty() {
        ui.weak("Nothing has fired yet.");
        return;
    }
    let row = ui.text_style_height(&egui::TextStyle::Body);
    let count = history.fired.len();
    ScrollArea::vertical().auto_shrink(false).show_rows(ui, row, count, |ui, rows| {
        for number in rows {
            let Some(fired) = history.fired.get(count - 1 - number) else { continue };
            ui.horizontal(|ui| {
                ui.label(
                    RichText::new(format!("{:>12}", format_duration(fired.fired_at_s))).monospace(),
                );
                ui.label(&fired.transition);
            });
        }
    });
    if history.unseen > 0 {
        ui.weak(format!("{} more are in the journal of the run.", history.unseen));
    }
}

/// Shows the orders of all operators, the newest first.
pub fn ordered(ui: &mut egui::Ui, watched: &Watched) {
    let colours = ThemeColours::of(ui.visuals());
    let look = watched.mission.look();
    let orders = look.marking.as_ref().map(|marking| marking.orders.as_slice()).unwrap_or_default();
    if orders.is_empty() {
        ui.weak("No orders yet.");
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for order in orders.iter().rev() {
            ui.horizontal_wrapped(|ui| {
                ui.label(
                    RichText::new(format!("{:>12}", format_duration(order.given_at_s))).monospace(),
                );
                ui.strong(printable(ui, &order.author));
                ui.label(&order.order);
                let (word, colour) = if order.accepted {
                    ("accepted", colours.good)
                } else {
                    ("refused", colours.error)
                };
                ui.colored_label(colour, word);
                ui.weak(printable(ui, &order.text));
            });
        }
    });
}
