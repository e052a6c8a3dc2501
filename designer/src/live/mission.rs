//! Where the mission stands, and the buttons of whoever may command it.

use armor_executive::{Confirmation, Marking};
use armor_look::words::{clock_s, lasting, when};
use armor_look::{MissionLook, OrderDesk};
use armor_sdk::control::Order;
use eframe::egui::{self, Button, RichText, TextEdit};

use super::session::{Session, Watched};
use super::words::{is_over, said};
use crate::theme::Colours;

/// What of this panel is remembered from frame to frame.
#[derive(Debug, Default)]
pub struct Panel {
    /// The safe place was asked for once: it ends the mission, so it is asked for twice.
    is_leaving: bool,
}

impl Panel {
    /// Shows it.
    pub fn show(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        let Some(watched) = session.watched() else {
            ui.weak("Nothing is watched.");
            return;
        };
        let look = watched.mission.look();
        let Some(marking) = look.marking.clone() else {
            ui.weak("No mission is seen in this system.");
            if !look.problem.is_empty() {
                ui.weak(said(ui, &look.problem));
            }
            return;
        };
        let now_s = look.now_at_s(watched.watch.timestamp());
        stage(ui, &look, &marking, now_s);
        let author = session.author.clone();
        self.commands(ui, watched, &marking, &author);
        asked(ui, watched, &marking, now_s, &author);
        places(ui, &marking);
        transitions(ui, watched, &marking, now_s, &author);
        facts(ui, &marking);
        ui.horizontal(|ui| {
            let label = ui.label("Orders are given by");
            let edit = TextEdit::singleline(&mut session.author).desired_width(150.0);
            ui.add(edit).labelled_by(label.id);
        });
    }

    /// What may be ordered at any time.
    fn commands(&mut self, ui: &mut egui::Ui, watched: &Watched, marking: &Marking, author: &str) {
        if is_over(&marking.stage) {
            return;
        }
        let orders = &watched.orders;
        let give = |order| orders.give(author, false, order);
        ui.horizontal_wrapped(|ui| {
            if marking.pause.is_some() {
                if ui.button("Resume").on_hover_text("Goes on where everything stood.").clicked() {
                    give(Order::Resume);
                }
            } else if ui
                .button("Pause")
                .on_hover_text("Stops clocks and components, but for those of safety.")
                .clicked()
            {
                give(Order::Pause);
            }
            if self.is_leaving {
                let sure = ui.button("Yes, to the safe place");
                if sure.clicked() {
                    give(Order::Safe);
                }
                if sure.clicked() || ui.button("No").clicked() {
                    self.is_leaving = false;
                }
            } else if ui
                .button("Safe place")
                .on_hover_text("Gives the mission up and goes to its safe place. Asks first.")
                .clicked()
            {
                self.is_leaving = true;
            }
            hold(ui, orders, author);
        });
        answers(ui, orders);
        if let Some(holder) = marking.holder.as_ref().filter(|_| !orders.holds()) {
            ui.weak(format!("{} holds the command ({}).", holder.author, holder.from));
        }
    }
}

/// Takes the command and gives it back.
fn hold(ui: &mut egui::Ui, orders: &OrderDesk, author: &str) {
    let (name, order, doc) = if orders.holds() {
        ("Give the command back", Order::Release, "Others may order again.")
    } else {
        let doc = "Nobody else may order then, but to pause; if this window is lost, the mission \
                   does what it has for a lost link.";
        ("Take the command", Order::Lease, doc)
    };
    if ui.button(name).on_hover_text(doc).clicked() {
        orders.give(author, false, order);
    }
}

/// What became of the last order.
fn answers(ui: &mut egui::Ui, orders: &OrderDesk) {
    let given = orders.given();
    let Some(last) = given.last() else { return };
    let colours = Colours::of(ui.visuals());
    let (text, colour) = match last.accepted {
        None => (format!("{}: waits for its answer", last.order), colours.weak),
        Some(true) => (format!("{}: {}", last.order, last.text), colours.text),
        Some(false) => (format!("{} refused: {}", last.order, last.text), colours.error),
    };
    ui.horizontal_wrapped(|ui| {
        ui.colored_label(colour, said(ui, &text));
        if let Some(order) = &last.if_taken
            && ui.button("Take over and do it").clicked()
        {
            orders.give(&last.author, true, order.clone());
        }
    });
}

fn stage(ui: &mut egui::Ui, look: &MissionLook, marking: &Marking, now_s: f64) {
    let colours = Colours::of(ui.visuals());
    ui.horizontal_wrapped(|ui| {
        ui.strong(&marking.mission);
        let colour = match marking.stage.as_str() {
            "playing" | "goal" => colours.good,
            "failed" => colours.error,
            _ => colours.warning,
        };
        ui.colored_label(colour, RichText::new(&marking.stage).strong());
        ui.label(lasting(now_s)).on_hover_text("Mission time");
        ui.weak(format!("{} fired", marking.fired));
    });
    if !marking.clock.is_empty() {
        ui.weak(format!("Its time follows {}.", marking.clock));
    }
    if !marking.why.is_empty() {
        ui.colored_label(colours.warning, said(ui, &format!("because {}", marking.why)));
    }
    if let Some(pause) = &marking.pause {
        let rest = if pause.at_rest { "" } else { "; not everything has come to rest yet" };
        let for_s = lasting(now_s - pause.since_at_s);
        ui.colored_label(colours.warning, format!("paused by {} for {for_s}{rest}", pause.by));
    }
    if let Some(at_s) = marking.link_lost_at_s {
        let for_s = lasting(now_s - at_s);
        let text = format!("the link to the operator has been lost for {for_s}");
        ui.colored_label(colours.warning, text);
    }
    if let Some(change) = &marking.change {
        let text =
            format!("version {} of the file: {} {}", change.version, change.state, change.why);
        ui.colored_label(colours.warning, said(ui, &text));
    }
    if !look.problem.is_empty() && !is_over(&marking.stage) {
        ui.colored_label(colours.warning, said(ui, &look.problem));
    }
}

/// What the operator is asked.
fn asked(ui: &mut egui::Ui, watched: &Watched, marking: &Marking, now_s: f64, author: &str) {
    let colours = Colours::of(ui.visuals());
    for asked in &marking.confirmations {
        egui::Frame::group(ui.style()).stroke((1.5, colours.warning)).show(ui, |ui| {
            ui.strong(format!("May {} fire?", asked.transition));
            ui.label(unanswered(asked, now_s));
            ui.horizontal(|ui| {
                let transition = asked.transition.clone();
                let name = format!("Confirm {transition}");
                if ui.button("Confirm").accessible_name(name).clicked() {
                    let order = Order::Confirm { transition: transition.clone() };
                    watched.orders.give(author, false, order);
                }
                let name = format!("Decline {transition}");
                if ui.button("Decline").accessible_name(name).clicked() {
                    watched.orders.give(author, false, Order::Decline { transition });
                }
            });
        });
    }
}

fn unanswered(asked: &Confirmation, now_s: f64) -> String {
    let what = if asked.unanswered == "fire" { "fires" } else { "does not fire" };
    match asked.answer_by_at_s {
        None => "It waits for an answer.".to_owned(),
        Some(_) if asked.put_off => "Its time for an answer stands still.".to_owned(),
        Some(by_s) => {
            format!("Without an answer it {what} in {}.", lasting((by_s - now_s).max(0.0)))
        }
    }
}

fn places(ui: &mut egui::Ui, marking: &Marking) {
    let marked = marking.places.iter().map(|place| {
        let tokens = if place.tokens == 1 { String::new() } else { format!(" x {}", place.tokens) };
        let waits = if place.active || marking.pause.is_some() { "" } else { " (not all run yet)" };
        format!("{}{tokens}{waits}", place.place)
    });
    let marked: Vec<_> = marked.collect();
    ui.horizontal_wrapped(|ui| {
        ui.weak("In");
        ui.label(if marked.is_empty() { "no place".to_owned() } else { marked.join(", ") });
    });
    for flight in &marking.in_flight {
        let (from, to) = (flight.from.join(" "), flight.to.join(" "));
        let waits = match flight.waits_for.as_slice() {
            [] => String::new(),
            waits => format!(", waits for {}", waits.join(" ")),
        };
        ui.label(format!("{}: {from} to {to}, {}{waits}", flight.cause, flight.phase));
    }
}

/// What can fire, when, and by whom.
fn transitions(ui: &mut egui::Ui, watched: &Watched, marking: &Marking, now_s: f64, author: &str) {
    let clock_s = clock_s(marking, now_s);
    for enabled in &marking.enabled {
        ui.horizontal_wrapped(|ui| {
            if enabled.by == "operator" {
                let name = format!("Fire {}", enabled.transition);
                let is_ready = enabled.earliest_at_s <= clock_s(enabled.held) && !enabled.held;
                let fire = ui.add_enabled(is_ready, Button::new("Fire"));
                if fire.accessible_name(name).clicked() {
                    let order = Order::Fire { transition: enabled.transition.clone() };
                    watched.orders.give(author, false, order);
                }
            }
            ui.label(when(enabled, clock_s(enabled.held)));
        });
    }
}

/// Variables, guards, dates.
fn facts(ui: &mut egui::Ui, marking: &Marking) {
    for variable in &marking.variables {
        ui.weak(said(ui, &format!("{} is {}", variable.variable, variable.value)));
    }
    for guard in &marking.guards {
        let because = if guard.because.is_empty() { "" } else { ": " };
        let text = format!(
            "{}: {} is {}{because}{}",
            guard.transition, guard.guard, guard.truth, guard.because
        );
        ui.weak(said(ui, &text));
    }
    for date in marking.dates.iter().filter(|date| date.phase != "past" || !date.used) {
        let from = date.not_before.as_deref().unwrap_or("any time");
        let until = date.not_after.as_deref().unwrap_or("any time");
        ui.weak(format!("{} from {from} until {until}: {}", date.transition, date.phase));
    }
}
