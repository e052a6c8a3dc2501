//! What lies over the map for the operator to read: STOPPED, a system that has ended or has not been
//! started, a missing map, missing data, and a goal that was refused or has no path.

use super::colours::{colours_of, freshness_ink};
use armor_picture::theme::{self, TOUCH, ThemeColours};
use eframe::egui::{
    Align2, Button, Color32, FontId, Frame, Galley, Margin, Painter, Pos2, Rect, RichText, Role,
    Sense, Ui, UiBuilder, WidgetInfo, vec2,
};
use std::sync::Arc;

use super::RESUME;
use super::map_viewport::MapViewport;
use super::new_buttons::NewButtons;
use super::open_parts::{self, OpenPart};
use super::questions::show_questions;
use super::strip;
use crate::connection::{CUT, SystemConnection};
use crate::console::Console;
use crate::links::{ClockTimes, Freshness};
use crate::mission::MissionState;
use crate::orders::OperatorOrder;
use crate::stop_delivery::StopStatus;

/// What the operator must know before the next goal.
const FRAME_CHANGED: &str = "The map has a new origin: goal, path and tracks are removed. Places on \
                             the map before mean nothing on this one.";
/// Over a picture of the past.
const VEIL: f32 = 0.45;

/// Shows all notices, those with something to click in this part of the map; returns the places that they cover, which a click at the map does not reach.
pub(super) fn show_notices(
    ui: &mut Ui,
    look: &MapViewport,
    room: Rect,
    console: &Console,
    now: ClockTimes,
    new_buttons: &NewButtons,
    orders: &mut Vec<OperatorOrder>,
) -> Vec<Rect> {
    let colours = colours_of(ui);
    let painter = ui.painter_at(look.rect);
    if console.connection.is_old() {
        painter.rect_filled(look.rect, 0.0, colours.unknown.gamma_multiply(VEIL));
        let font = FontId::proportional(2.0 * theme::LARGE);
        let middle = look.rect.center();
        painter.text(middle, Align2::CENTER_CENTER, "OLD", font, colours.text.gamma_multiply(0.75));
    }
    paint_middle(ui, colours, look, console);
    paint_goal_notices(ui, colours, look, console, now);
    let at = room.shrink2(vec2(16.0, 10.0));
    let mut column = ui.new_child(UiBuilder::new().max_rect(at).id_salt("notices"));
    let mut covered = Vec::new();
    covered.extend(show_connection(&mut column, colours, console, now));
    // Whether the robot of a run that has ended stands is not known.
    if let Some(status) = console.stop_status(now) {
        covered.push(show_stopped(&mut column, console, status, orders));
    }
    if !console.connection.is_old()
        && let Some(mission) = &console.mission
        && !mission.paused_by.is_empty()
    {
        let is_stopped = console.orders.is_stopped();
        let (rect, is_resumed) = show_pause(&mut column, colours, mission, is_stopped);
        covered.push(rect);
        if is_resumed && new_buttons.accepts(RESUME, now.host_s) {
            orders.push(OperatorOrder::Resume);
        }
    }
    covered.extend(show_questions(&mut column, colours, console, now, new_buttons, orders));
    if console.orders.is_frame_new() && !console.connection.has_ended() {
        covered.push(show_frame_change(&mut column, orders));
    }
    if open_parts::is_open(column.ctx(), OpenPart::Alerts) {
        covered.push(strip::show_alerts(&mut column, colours, console, now, orders));
    }
    if !console.connection.is_old() {
        show_silence(&mut column, colours, console, now);
    }
    covered
}

/// A notice across the map, with or without something to click.
fn show_banner<R>(ui: &mut Ui, fill: Color32, show: impl FnOnce(&mut Ui) -> R) -> (Rect, R) {
    let frame = Frame::new().fill(fill).inner_margin(Margin::same(8)).corner_radius(4);
    let shown = frame.show(ui, |ui| ui.horizontal_wrapped(show).inner);
    (shown.response.rect, shown.inner)
}

fn show_connection(
    ui: &mut Ui,
    colours: &ThemeColours,
    console: &Console,
    now: ClockTimes,
) -> Option<Rect> {
    let (title, why, colour, next) = match &console.connection {
        SystemConnection::Cut { why, .. } => {
            (format!("{CUT}; the robot may be moving"), format!("{why}."), colours.error, "")
        }
        SystemConnection::Ending { system } => {
            (format!("{system} is ending"), String::new(), colours.text, "")
        }
        SystemConnection::Ended { system, why, is_normal } => {
            let colour = if *is_normal { colours.text } else { colours.error };
            (
                format!("{system} has ended:"),
                format!("{why}."),
                colour,
                " Waiting for the next run.",
            )
        }
        _ => return None,
    };
    let age = match ((now.host_s - console.lost_s) / 60.0) as u64 {
        0 => "less than a minute".to_owned(),
        minutes => format!("{minutes} min"),
    };
    let (rect, ()) = show_banner(ui, colours.panel, |ui| {
        ui.label(RichText::new(title).size(theme::HEADING).strong().color(colour));
        ui.label(RichText::new(why).size(theme::HEADING));
        let age = format!("Map and readings are {age} old.{next}");
        ui.label(RichText::new(age).color(colours.warning));
    });
    Some(rect)
}

/// Returns what has become of STOP, for large letters and in a sentence.
fn describe_stop(status: StopStatus) -> (&'static str, String) {
    match status {
        StopStatus::Sent => ("STOP sent", "not confirmed yet".into()),
        StopStatus::NotDelivered => {
            let text = "it is sent again when the connection returns";
            ("STOP not delivered: the robot may be moving", text.into())
        }
        StopStatus::NoSubscriber => {
            ("STOP sent", "no link accepts `stop`: the robot may be moving".into())
        }
        StopStatus::OldData => {
            ("STOP sent", "the data are old: whether the robot stands is not known".into())
        }
        StopStatus::Unmeasured => {
            ("STOP sent", "no odometry is linked: whether the robot stands is not known".into())
        }
        StopStatus::Moving(mps) => ("STOP sent", format!("the robot still moves: {mps:.2} m/s")),
        StopStatus::Stands => ("STOPPED", "the robot stands".into()),
    }
}

/// STOP, with Release far from its button, so that a second click there never releases.
fn show_stopped(
    ui: &mut Ui,
    console: &Console,
    status: StopStatus,
    orders: &mut Vec<OperatorOrder>,
) -> Rect {
    let (title, text) = describe_stop(status);
    show_banner(ui, theme::STOP, |ui| {
        ui.label(RichText::new(title).size(theme::LARGE).strong().color(theme::ON_STOP));
        ui.label(RichText::new(text).size(theme::HEADING).color(theme::ON_STOP));
        if console.connection.check_orders().is_err() {
            return;
        }
        if let Some(button) = console.orders.pressed_in_stop() {
            let text = format!("Release: the robot continues with {button}");
            ui.label(RichText::new(text).size(theme::HEADING).strong().color(theme::ON_STOP));
        }
        let text = RichText::new("Release").size(theme::HEADING).strong().color(theme::ON_STOP);
        let button = Button::new(text).fill(theme::RELEASE).min_size(vec2(120.0, TOUCH));
        if ui.add(button).on_hover_text("the robot may drive again").clicked() {
            orders.push(OperatorOrder::Release);
        }
    })
    .0
}

/// A pause, with what it freezes and what it does not; and whether it is to end.
fn show_pause(
    ui: &mut Ui,
    colours: &ThemeColours,
    mission: &MissionState,
    is_stopped: bool,
) -> (Rect, bool) {
    show_banner(ui, colours.panel, |ui| {
        ui.label(RichText::new("PAUSED").size(theme::LARGE).strong().color(colours.warning));
        let button = Button::new(RichText::new("Resume").size(theme::HEADING).strong());
        let button = ui.add(button.min_size(vec2(120.0, TOUCH)));
        let button = button.on_hover_text("the mission and its components continue");
        let frozen = match mission.frozen.as_slice() {
            [] => String::new(),
            names => format!(" ({} stand still)", names.join(", ")),
        };
        let own = match is_stopped {
            true => "",
            false => " You can still move the robot: set a goal, or drive by hand.",
        };
        let text = format!("by {}: the mission waits{frozen}.{own}", mission.paused_by);
        ui.label(RichText::new(text).size(theme::HEADING));
        button.clicked()
    })
}

/// The map frame has changed, until the operator acknowledges.
fn show_frame_change(ui: &mut Ui, orders: &mut Vec<OperatorOrder>) -> Rect {
    show_banner(ui, theme::STOP, |ui| {
        ui.label(RichText::new(FRAME_CHANGED).size(theme::HEADING).strong().color(theme::ON_STOP));
        if ui.button("Acknowledge").on_hover_text("goals are accepted again").clicked() {
            orders.push(OperatorOrder::Acknowledge);
        }
    })
    .0
}

/// Lists missing data at the top of the map, where they cannot be overlooked.
fn show_silence(ui: &mut Ui, colours: &ThemeColours, console: &Console, now: ClockTimes) {
    for wanted in [Freshness::Gone, Freshness::Late] {
        let silent: Vec<_> =
            console.list_silent(now).filter(|(_, how, _)| *how == wanted).collect();
        // The longest silence determines since when nothing is reliable.
        let age_s = silent.iter().map(|(.., age_s)| *age_s).fold(0.0, f64::max);
        let inputs: Vec<_> = silent.iter().map(|(link, ..)| link.input).collect();
        if inputs.is_empty() {
            continue;
        }
        let text = format!("nothing for {age_s:.1} s: {}", inputs.join(", "));
        show_banner(ui, colours.panel, |ui| {
            ui.label(
                RichText::new(text).size(theme::HEADING).color(freshness_ink(colours, wanted)),
            );
        });
    }
}

/// What is waited for, instead of an empty map.
fn paint_middle(ui: &Ui, colours: &ThemeColours, look: &MapViewport, console: &Console) {
    let text = match &console.connection {
        SystemConnection::Awaited { what } => {
            format!("no system yet: waiting for\n{what}")
        }
        SystemConnection::Cut { .. }
        | SystemConnection::Ending { .. }
        | SystemConnection::Ended { .. } => return,
        _ if !console.scene.map.is_empty() => return,
        _ => match console.link("map") {
            Some(link) => format!("no map yet: waiting for {}", link.data),
            None if console.links.is_empty() => "no input is linked".into(),
            None => return,
        },
    };
    let font = FontId::proportional(theme::HEADING);
    let painter = ui.painter_at(look.rect);
    let galley = painter.layout(text, font, colours.text, look.rect.width() - 40.0);
    paint_box(ui, &painter, colours, look.rect.center(), Align2::CENTER_CENTER, galley);
}

/// Paints a text over the map. Screen readers read it, too; clicks reach the map.
fn paint_box(
    ui: &Ui,
    painter: &Painter,
    colours: &ThemeColours,
    at: Pos2,
    anchor: Align2,
    galley: Arc<Galley>,
) {
    let rect = anchor.anchor_size(at, galley.size() + vec2(16.0, 10.0));
    // It stays on the map, wherever the place is.
    let area = painter.clip_rect().shrink(4.0);
    let low = (rect.min - area.min).min(vec2(0.0, 0.0));
    let high = (rect.max - area.max).max(vec2(0.0, 0.0));
    let rect = rect.translate(-low - high);
    // The panel `goal` names a goal without a path already.
    if !galley.text().starts_with("no path") {
        let name = galley.text().to_owned();
        let response = ui.interact(rect, ui.scope_id().with(("notice", &name)), Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &name));
    }
    painter.rect_filled(rect, 4.0, colours.panel);
    painter.galley(rect.min + vec2(8.0, 5.0), galley, colours.text);
}

/// The reason why a goal was refused, at the place of the click, and a goal without a path.
fn paint_goal_notices(
    ui: &Ui,
    colours: &ThemeColours,
    look: &MapViewport,
    console: &Console,
    now: ClockTimes,
) {
    let painter = &ui.painter_at(look.rect);
    let paint = |place, text: String, colour: Color32| {
        let at = look.on_screen(place);
        painter.circle_stroke(at, 8.0, (2.5, colour));
        for direction in [vec2(1.0, 1.0), vec2(1.0, -1.0)] {
            let arm = direction * 5.0;
            painter.line_segment([at - arm, at + arm], (2.5, colour));
        }
        let galley = painter.layout(text, FontId::proportional(theme::HEADING), colour, 320.0);
        paint_box(ui, painter, colours, at + vec2(14.0, -12.0), Align2::LEFT_BOTTOM, galley);
    };
    if let Some(refusal) = console.recent_refusal(now) {
        paint(refusal.place, format!("no goal here: {}", refusal.why), colours.error);
        // One box at a time, so that none covers another.
        return;
    }
    if console.connection.is_old() {
        return;
    }
    if let Some(place) = console.recent_arrival(now) {
        let galley = painter.layout_no_wrap(
            "goal reached".into(),
            FontId::proportional(theme::HEADING),
            colours.good,
        );
        let at = look.on_screen(place) + vec2(14.0, -12.0);
        paint_box(ui, painter, colours, at, Align2::LEFT_BOTTOM, galley);
    }
    if let (Some(goal), Some(problem)) = (console.orders.goal(), console.goal_problem(now)) {
        paint(goal.place.point(), problem, colours.error);
    }
}
