//! The state of the mission, and the buttons of an operator.

use armor_inspect::words::{describe_enabled, format_duration, transition_clock};
use armor_marking::{
    Confirmation, DateWindow, FiringDecider, Marking, MarkingStage, UnansweredAction,
};
use armor_sdk::control::Order;
use eframe::egui::{self, RichText, TextEdit};

use super::moves;
use super::orders::Giving;
use super::session::Session;
use super::words::{is_over, printable, without_firings};
use armor_picture::theme::ThemeColours;

/// What of this panel is remembered from frame to frame.
#[derive(Debug, Default)]
pub struct Panel {
    /// The button for the safe place was clicked once. It ends the mission, so it needs a second
    /// click.
    is_leaving: bool,
    moves: moves::Panel,
}

impl Panel {
    /// Shows it; `places` are those that tokens could be moved to.
    pub fn show(&mut self, ui: &mut egui::Ui, session: &mut Session, places: &[String]) {
        let Some(watched) = session.watched() else {
            ui.weak("Not watching a system.");
            return;
        };
        let look = watched.mission.look();
        let Some(mut marking) = look.marking.clone() else {
            ui.weak("This system has no mission.");
            if !look.problem.is_empty() {
                ui.weak(printable(ui, &look.problem));
            }
            return;
        };
        if is_over(marking.stage) {
            marking = without_firings(&marking).into();
        }
        let now_s = watched.mission_s(&look);
        let giving = Giving::to(watched, &marking, &session.author);
        // What an order brings about stands below the buttons: they stay under the pointer.
        show_stage(ui, &marking, now_s, watched.silence());
        in_places(ui, &marking);
        show_questions(ui, &giving, &marking, now_s);
        show_transitions(ui, &giving, &marking, now_s);
        self.moves.show(ui, &giving, &marking, places);
        giving.refusal(ui, &marking);
        show_circumstances(ui, &marking, now_s);
        if !look.problem.is_empty() && !is_over(marking.stage) && watched.silence().is_none() {
            let colours = ThemeColours::of(ui.visuals());
            ui.colored_label(colours.warning, printable(ui, &look.problem));
        }
        show_facts(ui, &marking);
        ui.horizontal(|ui| {
            let label = ui.label("Orders as");
            let edit = TextEdit::singleline(&mut session.author).desired_width(150.0);
            ui.add(edit).labelled_by(label.id);
        });
    }

    /// What may be ordered at any time.
    pub fn commands(&mut self, ui: &mut egui::Ui, session: &Session) {
        let Some(watched) = session.watched() else { return };
        let Some(marking) = watched.mission.look().marking else { return };
        let giving = Giving::to(watched, &marking, &session.author);
        ui.horizontal_wrapped(|ui| {
            let (name, order, doc) = if marking.pause.is_some() {
                ("Resume", Order::Resume, "Continues where the mission was paused.")
            } else {
                let doc = "Stops clocks and components, but for those of safety.";
                ("Pause", Order::Pause, doc)
            };
            if giving.button(ui, name, doc).clicked() {
                giving.give(order);
            }
            if self.is_leaving {
                // First, at the position of the button before: a double click discards nothing.
                let no = ui.button("No");
                let sure = giving.button(ui, "Yes, to the safe place", "");
                if sure.clicked() {
                    giving.give(Order::Safe);
                }
                self.is_leaving = !sure.clicked() && !no.clicked();
            } else {
                let doc = "Aborts the mission and goes to its safe place. Asks first.";
                self.is_leaving = giving.button(ui, "Safe place", doc).clicked();
            }
            giving.hold(ui);
        });
        giving.answer(ui);
    }
}

/// Where it stands; `silence` is why nothing is heard of it any longer.
fn show_stage(ui: &mut egui::Ui, marking: &Marking, now_s: f64, silence: Option<&str>) {
    let colours = ThemeColours::of(ui.visuals());
    ui.horizontal_wrapped(|ui| {
        ui.strong(&marking.mission);
        let colour = match marking.stage {
            MarkingStage::Goal => colours.good,
            MarkingStage::Playing if silence.is_none() => colours.good,
            MarkingStage::Playing => colours.weak,
            // It was the last report: its system has ended since.
            MarkingStage::Stopping if silence.is_some() => colours.weak,
            MarkingStage::Failed => colours.error,
            MarkingStage::Paused
            | MarkingStage::Retreating
            | MarkingStage::Ending
            | MarkingStage::Stopping
            | MarkingStage::Safe => colours.warning,
        };
        let has_ended = marking.stage == MarkingStage::Stopping && silence.is_some();
        let stage = if has_ended { "ended" } else { marking.stage.as_str() };
        ui.colored_label(colour, RichText::new(stage).strong());
        ui.label(format_duration(now_s)).on_hover_text("Mission time");
        ui.weak(format!("{} fired", marking.fired));
    });
    if let Some(silence) = silence {
        ui.weak(format!("{silence} Last known state:"));
    }
}

/// Further facts about the state of the mission.
fn show_circumstances(ui: &mut egui::Ui, marking: &Marking, now_s: f64) {
    let colours = ThemeColours::of(ui.visuals());
    if !marking.clock.is_empty() {
        ui.weak(format!("Its time follows {}.", marking.clock));
    }
    if !marking.why.is_empty() {
        ui.colored_label(colours.warning, printable(ui, &format!("because {}", marking.why)));
    }
    if let Some(pause) = &marking.pause {
        let rest = if pause.at_rest { "" } else { "; some components have not stopped yet" };
        let for_s = format_duration(now_s - pause.since_at_s);
        ui.colored_label(colours.warning, format!("paused by {} for {for_s}{rest}", pause.by));
    }
    if let Some(at_s) = marking.link_lost_at_s {
        let for_s = format_duration(now_s - at_s);
        let text = format!("the link to the operator has been lost for {for_s}");
        ui.colored_label(colours.warning, text);
    }
    if let Some(change) = &marking.change {
        let text =
            format!("version {} of the file: {} {}", change.version, change.state, change.why);
        ui.colored_label(colours.warning, printable(ui, &text));
    }
}

/// What the operator is asked.
fn show_questions(ui: &mut egui::Ui, giving: &Giving<'_>, marking: &Marking, now_s: f64) {
    let colours = ThemeColours::of(ui.visuals());
    for asked in &marking.confirmations {
        egui::Frame::group(ui.style()).stroke((1.5, colours.warning)).show(ui, |ui| {
            ui.strong(format!("May {} fire?", asked.transition));
            ui.label(unanswered(asked, now_s));
            ui.horizontal(|ui| {
                let transition = asked.transition.clone();
                let name = format!("Confirm {transition}");
                if giving.button(ui, "Confirm", "").accessible_name(name).clicked() {
                    giving.give(Order::Confirm { transition: transition.clone() });
                }
                let name = format!("Decline {transition}");
                if giving.button(ui, "Decline", "").accessible_name(name).clicked() {
                    giving.give(Order::Decline { transition });
                }
            });
        });
    }
}

fn unanswered(asked: &Confirmation, now_s: f64) -> String {
    let what = match asked.unanswered {
        UnansweredAction::Fire => "fires",
        UnansweredAction::Decline => "does not fire",
    };
    match asked.answer_by_at_s {
        None => "It waits for an answer.".to_owned(),
        Some(_) if asked.put_off => "The time to answer is paused.".to_owned(),
        Some(by_s) => {
            format!("Without an answer it {what} in {}.", format_duration((by_s - now_s).max(0.0)))
        }
    }
}

fn in_places(ui: &mut egui::Ui, marking: &Marking) {
    let marked = marking.places.iter().map(|place| {
        let tokens = if place.tokens == 1 { String::new() } else { format!(" x {}", place.tokens) };
        let is_awaited = !place.active && marking.pause.is_none() && !is_over(marking.stage);
        let waits = if is_awaited { " (not all running yet)" } else { "" };
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
fn show_transitions(ui: &mut egui::Ui, giving: &Giving<'_>, marking: &Marking, now_s: f64) {
    let clock_s = transition_clock(marking, now_s);
    for enabled in &marking.enabled {
        ui.horizontal_wrapped(|ui| {
            if enabled.by == FiringDecider::Operator {
                let name = format!("Fire {}", enabled.transition);
                let why_not = if enabled.held {
                    Some("The mission is paused: resume it first.")
                } else if enabled.earliest_at_s > clock_s(false) {
                    Some("It is not due yet.")
                } else {
                    None
                };
                let fire = giving.button_unless(ui, "Fire", "", why_not);
                if fire.accessible_name(name).clicked() {
                    giving.give(Order::Fire { transition: enabled.transition.clone() });
                }
            }
            ui.label(describe_enabled(enabled, clock_s(enabled.held)));
        });
    }
}

/// Variables, guards, dates.
fn show_facts(ui: &mut egui::Ui, marking: &Marking) {
    for variable in &marking.variables {
        ui.weak(printable(ui, &format!("{} is {}", variable.variable, variable.value)));
    }
    for guard in &marking.guards {
        let because = if guard.because.is_empty() { "" } else { ": " };
        let text = format!(
            "{}: {} is {}{because}{}",
            guard.transition, guard.guard, guard.truth, guard.because
        );
        ui.weak(printable(ui, &text));
    }
    for date in marking.dates.iter().filter(|date| date.phase != DateWindow::Past || !date.used) {
        let from = date.not_before.as_deref().unwrap_or("any time");
        let until = date.not_after.as_deref().unwrap_or("any time");
        ui.weak(format!("{} from {from} until {until}: {}", date.transition, date.phase));
    }
}
