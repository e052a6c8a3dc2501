//! The strip at the top: robot, connection, mission, battery, alerts, theme; and the
//! list of alerts, which it opens over the map.

use super::colours::colours_of;
use armor_picture::icons::Icon;
use armor_picture::theme::{self, TOUCH, ThemeColours};
use eframe::egui::{
    Align2, Button, Color32, FontId, Frame, Grid, Margin, Rect, RichText, Role, ScrollArea, Sense,
    Stroke, StrokeKind, Ui, Vec2, WidgetInfo, vec2,
};

use super::open_parts::{self, OpenPart};
use crate::connection::SystemConnection;
use crate::console::Console;
use crate::links::ClockTimes;
use crate::mission::{MissionState, format_clock};
use crate::orders::OperatorOrder;
use crate::readings::BatteryReading;

/// Size of the battery's gauge, in points.
const GAUGE: [f32; 2] = [74.0, 22.0];

/// A narrower strip is without the name, in points.
const NAMED_WIDTH: f32 = 480.0;

/// Shows the strip. What comes and goes is last, so that it moves nothing else.
pub(super) fn show_strip(ui: &mut Ui, console: &mut Console, now: ClockTimes) {
    let colours = colours_of(ui);
    ui.add_space(3.0);
    ui.horizontal_wrapped(|ui| {
        // The title of a small window has the name.
        let is_wide = ui.available_width() >= NAMED_WIDTH;
        if is_wide {
            ui.label(RichText::new(&console.robot_name).size(theme::HEADING).strong());
        }
        show_connection(ui, colours, console);
        if let Some(battery) = console.readings.newest::<BatteryReading>() {
            ui.separator();
            show_battery(ui, colours, battery);
        }
        ui.separator();
        let count = console.alerts.count_new();
        let text = match count {
            0 => "alerts".to_owned(),
            1 => "1 alert".to_owned(),
            count => format!("{count} alerts"),
        };
        let text = match count {
            0 => RichText::new(text),
            // The sign is a shape; where it has no room, a letter.
            _ if is_wide => RichText::new(text).strong().color(colours.error),
            _ => RichText::new(format!("! {text}")).strong().color(colours.error),
        };
        let sign = match count {
            0 => Icon::Alert.to_atom(),
            _ => Icon::Alert.to_coloured_atom(colours.error),
        };
        let button = if is_wide { Button::new((sign, text)) } else { Button::new(text) };
        if ui.add(button).on_hover_text("what has gone wrong, with its time").clicked() {
            open_parts::toggle(ui.ctx(), OpenPart::Alerts);
        }
        let (sign, name) =
            if console.is_light { (Icon::Moon, "dark") } else { (Icon::Sun, "light") };
        let button = match is_wide {
            true => Button::new((sign.to_atom(), name)),
            false => Button::new(sign.to_atom()).min_size(Vec2::splat(TOUCH)),
        };
        let button = ui.add(button).accessible_name(name);
        if button.on_hover_text("the other theme: light is for sunlight").clicked() {
            console.is_light = !console.is_light;
        }
        if let Some(mission) = &console.mission {
            ui.separator();
            let run_time = console.run_time(now);
            show_mission(ui, mission, run_time, console.connection.has_ended());
        }
    });
    ui.add_space(3.0);
}

fn show_connection(ui: &mut Ui, colours: &ThemeColours, console: &Console) {
    let (colour, text) = match &console.connection {
        SystemConnection::Part | SystemConnection::Live { .. } => (colours.good, "connected"),
        SystemConnection::Awaited { .. } => (colours.warning, "waiting for a system"),
        SystemConnection::Cut { .. } => (colours.error, "! connection lost"),
        SystemConnection::Ending { .. } => (colours.text, "ending"),
        SystemConnection::Ended { is_normal: true, .. } => (colours.text, "ended"),
        SystemConnection::Ended { .. } => (colours.error, "! ended"),
    };
    ui.colored_label(colour, text);
}

fn show_mission(ui: &mut Ui, mission: &MissionState, now: ClockTimes, has_ended: bool) {
    let places = if mission.places.is_empty() { "-".into() } else { mission.places.join(", ") };
    ui.label(RichText::new(places).size(theme::HEADING).strong())
        .on_hover_text(format!("the marked places of the mission {}", mission.name));
    let stage = match mission.stage.as_str() {
        "playing" => "",
        "stopping" if has_ended => "",
        stage => stage,
    };
    let clock = format_clock(mission.now_at_s(now));
    ui.weak(format!("{} {clock} {stage}", mission.name));
}

/// A gauge: its length is the charge, and the number is in it.
fn show_battery(ui: &mut Ui, colours: &ThemeColours, battery: &BatteryReading) {
    let (rect, response) = ui.allocate_exact_size(GAUGE.into(), Sense::hover());
    let charge = battery.charge.map(|charge| charge.clamp(0.0, 1.0));
    let text = match charge {
        Some(charge) => {
            format!("{:.0} %{}", 100.0 * charge, if battery.is_charging { " +" } else { "" })
        }
        None => "battery ?".into(),
    };
    let response = response.on_hover_text(format!("battery {text}"));
    response.widget_info(|| {
        WidgetInfo::labeled(Role::ProgressIndicator, true, format!("battery {text}"))
    });
    let painter = ui.painter();
    let edge = if battery.is_low() { colours.error } else { colours.weak };
    let body = rect.shrink(1.0).with_max_x(rect.max.x - 5.0);
    painter.rect_filled(body, 3.0, colours.button);
    let mut filled = body;
    filled.set_width(body.width() * charge.unwrap_or(0.0) as f32);
    painter.rect_filled(filled, 3.0, colours.filled);
    painter.rect_stroke(body, 3.0, Stroke::new(1.5, edge), StrokeKind::Inside);
    let pole = Rect::from_center_size(body.right_center() + vec2(2.5, 0.0), vec2(4.0, 8.0));
    painter.rect_filled(pole, 1.0, edge);
    let sign = if battery.is_low() { "! " } else { "" };
    let at = body.center();
    let font = FontId::proportional(theme::BODY);
    painter.text(at, Align2::CENTER_CENTER, format!("{sign}{text}"), font, colours.text);
}

/// Shows the list of alerts over the map, so that it moves nothing; returns its place.
pub(super) fn show_alerts(
    ui: &mut Ui,
    colours: &ThemeColours,
    console: &Console,
    now: ClockTimes,
    orders: &mut Vec<OperatorOrder>,
) -> Rect {
    let frame = Frame::new().fill(colours.panel).inner_margin(Margin::same(8)).corner_radius(4);
    let shown = frame.show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Alerts").size(theme::HEADING).strong());
            if ui.button("Acknowledge all").clicked() {
                orders.push(OperatorOrder::AcknowledgeAlerts);
            }
            ui.weak("Escape closes");
        });
        if console.alerts.newest_first().next().is_none() {
            ui.weak("none so far");
        }
        ScrollArea::vertical().max_height(180.0).show(ui, |ui| {
            Grid::new("alerts").num_columns(3).min_row_height(20.0).show(ui, |ui| {
                for alert in console.alerts.newest_first() {
                    let colour = if alert.is_acknowledged { colours.weak } else { colours.error };
                    let sign = match (alert.is_earlier, alert.is_acknowledged) {
                        (true, _) => "earlier run",
                        (false, true) => "seen",
                        (false, false) => "new",
                    };
                    show_alert(
                        ui,
                        colour,
                        sign,
                        &format_clock(now.host_s - alert.since_s),
                        &alert.text,
                    );
                }
            });
        });
    });
    shown.response.rect
}

fn show_alert(ui: &mut Ui, colour: Color32, sign: &str, ago: &str, text: &str) {
    ui.colored_label(colour, sign);
    ui.weak(format!("{ago} ago"));
    ui.colored_label(colour, text);
    ui.end_row();
}
