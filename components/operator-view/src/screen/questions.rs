//! The questions of the mission, over the map where they cannot be overlooked.

use armor_picture::theme::{self, TOUCH, ThemeColours};
use eframe::egui::{Button, Frame, Margin, Rect, RichText, Stroke, Ui, vec2};

use super::new_buttons::NewButtons;
use crate::console::Console;
use crate::links::ClockTimes;
use crate::mission::{MissionQuestion, MissionState};
use crate::orders::OperatorOrder;

/// A new question calls for attention for this time, in seconds.
const CALLS_FOR_S: f64 = 10.0;
/// Half a period of its border, in seconds: slower than what disturbs people with epilepsy.
const PULSE_S: f64 = 0.5;

/// Shows the questions; returns the places that they cover.
pub(super) fn show_questions(
    ui: &mut Ui,
    colours: &ThemeColours,
    console: &Console,
    now: ClockTimes,
    new_buttons: &NewButtons,
    orders: &mut Vec<OperatorOrder>,
) -> Vec<Rect> {
    let Some(mission) = console.mission.as_ref().filter(|_| !console.connection.is_old()) else {
        return Vec::new();
    };
    let mut covered = Vec::new();
    for question in &mission.questions {
        let age_s = new_buttons.shown_for_s(&question.transition, now.host_s);
        let calls = age_s.is_none_or(|age_s| age_s < CALLS_FOR_S);
        if calls {
            ui.ctx().request_repaint_after_secs(PULSE_S as f32);
        }
        let periods = (age_s.unwrap_or_default() / PULSE_S) as u64;
        let is_wide = calls && periods.is_multiple_of(2);
        let border = Stroke::new(if is_wide { 6.0 } else { 3.0 }, colours.warning);
        // The border grows to the inside, so that nothing moves.
        let margin = if is_wide { 8 } else { 11 };
        let frame = Frame::new().fill(colours.panel).stroke(border).corner_radius(4);
        let shown = frame.inner_margin(Margin::same(margin)).show(ui, |ui| {
            ui.horizontal_wrapped(|ui| show_question(ui, colours, mission, question, now)).inner
        });
        covered.push(shown.response.rect);
        if let Some(is_confirmed) = shown.inner
            && new_buttons.accepts(&question.transition, now.host_s)
        {
            let transition = question.transition.clone();
            orders.push(OperatorOrder::Answer { transition, is_confirmed });
        }
    }
    covered
}

/// Shows a question; returns the answer if one is clicked.
fn show_question(
    ui: &mut Ui,
    colours: &ThemeColours,
    mission: &MissionState,
    question: &MissionQuestion,
    now: ClockTimes,
) -> Option<bool> {
    let left = question.answer_by_at_s.map(|by_s| {
        let left_s = (by_s - mission.now_at_s(now)).max(0.0);
        format!(" ({} in {left_s:.0} s)", question.unanswered)
    });
    ui.label(RichText::new("The mission asks:").size(theme::HEADING));
    let text = format!("{}?{}", question.transition, left.unwrap_or_default());
    ui.label(RichText::new(text).size(theme::LARGE).strong().color(colours.warning));
    let mut answer = None;
    let confirm = theme::main_button(colours, "Confirm");
    for (button, is_confirmed) in [(confirm, true), (Button::new("Decline"), false)] {
        let button = ui.add(button.min_size(vec2(110.0, TOUCH)));
        if button.on_hover_text("answers the mission's question").clicked() {
            answer = Some(is_confirmed);
        }
    }
    answer
}
