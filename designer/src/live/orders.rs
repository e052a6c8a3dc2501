//! The buttons by which orders are given, and the result of the last order.

use armor_inspect::{OrderSender, SentOrder};
use armor_marking::Marking;
use armor_sdk::control::Order;
use eframe::egui::{self, Button, Color32, Label, Response, RichText};

use super::watched::Watched;
use super::words::{is_over, printable};
use armor_picture::theme::ThemeColours;

/// Where orders are given, by whom, and whether that can be.
pub struct Giving<'a> {
    client: &'a OrderSender,
    author: &'a str,
    /// Why nothing can be ordered now.
    closed: Option<&'static str>,
}

impl<'a> Giving<'a> {
    /// For the mission that stands so.
    pub fn to(watched: &'a Watched, marking: &Marking, author: &'a str) -> Self {
        let over = is_over(marking.stage).then_some("The mission is over.");
        Self { client: &watched.orders, author, closed: watched.refuses_orders().or(over) }
    }

    /// Gives an order.
    pub fn give(&self, order: Order) {
        self.client.give(self.author, false, order);
    }

    /// A button for an order.
    pub fn button(&self, ui: &mut egui::Ui, name: &str, doc: &str) -> Response {
        self.button_unless(ui, name, doc, None)
    }

    /// A button for an order that cannot be given now, if `why_not` states so.
    pub fn button_unless(
        &self,
        ui: &mut egui::Ui,
        name: &str,
        doc: &str,
        why_not: Option<&str>,
    ) -> Response {
        let why_not = self.closed.or(why_not);
        let button = ui.add_enabled(why_not.is_none(), Button::new(name));
        let button = if doc.is_empty() { button } else { button.on_hover_text(doc) };
        match why_not {
            Some(why_not) => button.on_disabled_hover_text(why_not),
            None => button,
        }
    }

    /// The button that takes and returns the command.
    pub fn hold(&self, ui: &mut egui::Ui) {
        let (name, order, doc) = if self.client.holds() {
            ("Release command", Order::Release, "Others can give orders again.")
        } else {
            let doc = "Others can then only pause. If this window is lost, the mission reacts \
                       as to a lost link.";
            ("Take command", Order::Lease, doc)
        };
        if self.button(ui, name, doc).clicked() {
            self.give(order);
        }
    }

    /// Shows the result of the last order, in one line that keeps its height while it is empty, so
    /// that what stands below does not move under the pointer.
    pub fn answer(&self, ui: &mut egui::Ui) {
        let last = self.client.given().pop();
        ui.horizontal(|ui| {
            ui.set_height(ui.spacing().interact_size.y);
            let Some(last) = last else { return };
            if let Some(order) = &last.if_taken
                && self.button(ui, "Take over and do it", "").clicked()
            {
                self.client.give(&last.author, true, order.clone());
            }
            let (text, colour) = in_words(&last, ThemeColours::of(ui.visuals()));
            let text = RichText::new(printable(ui, &text)).color(colour);
            ui.add(Label::new(text).truncate());
        });
    }

    /// Why the last order was refused, whole, and who else holds the command.
    pub fn refusal(&self, ui: &mut egui::Ui, marking: &Marking) {
        if let Some(holder) = marking.holder.as_ref().filter(|_| !self.client.holds()) {
            ui.weak(format!("{} has command ({}).", holder.author, holder.from));
        }
        if let Some(last) = self.client.given().pop().filter(|last| last.accepted == Some(false)) {
            ui.colored_label(ThemeColours::of(ui.visuals()).error, printable(ui, &last.text));
        }
    }
}

fn in_words(given: &SentOrder, colours: &ThemeColours) -> (String, Color32) {
    match given.accepted {
        None => (format!("{}: waits for its answer", given.order), colours.weak),
        Some(true) => (format!("{}: {}", given.order, given.text), colours.text),
        Some(false) => (format!("{} refused: {}", given.order, given.text), colours.error),
    }
}
