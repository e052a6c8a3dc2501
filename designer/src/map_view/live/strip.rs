//! The strip beneath the map: the state of the mission, a row for each robot, and the buttons of an operator.

use armor_inspect::words::{format_duration, transition_clock};
use armor_marking::{FiringDecider, Marking};
use armor_picture::theme::ThemeColours;
use armor_robotfile::timing::RouteProgress;
use armor_sdk::control::Order;
use eframe::egui::{self, Color32, Grid, Panel, RichText, Role, ScrollArea, WidgetInfo};

use crate::canvas::paintable;
use crate::live::orders::Giving;
use crate::map_view::live::LiveMap;
use crate::map_view::live::words::{
    done_text, expected_text, is_breach, late_text, limit_text, stand_text, zones_text,
};
use crate::map_view::state::MapView;
use crate::workspace::Workspace;

/// The columns of the table.
const COLUMNS: [&str; 10] = [
    "Robot",
    "Orders",
    "Step",
    "Done",
    "Left",
    "Expected",
    "Against nominal",
    "Limit",
    "Off the leg",
    "Zones",
];

impl MapView {
    /// Shows the strip, if it is open, and follows the system.
    pub(in crate::map_view) fn show_live(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        if !self.live.is_open {
            return;
        }
        self.live.follow(ui.ctx(), workspace);
        let panel = Panel::bottom("mission while it runs").resizable(true);
        let panel = panel.default_size(170.0).min_size(110.0);
        panel.show(ui, |ui| {
            // It keeps its height while there is little in it.
            ui.set_min_height(ui.available_height());
            self.live.show_strip(ui, workspace);
        });
    }
}

impl LiveMap {
    fn show_strip(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        let colours = ThemeColours::of(ui.visuals());
        let watched = workspace.live.watched();
        if let Some(why) = &self.why_not {
            ui.horizontal_wrapped(|ui| {
                ui.strong("Live");
                ui.weak(paintable(ui.ctx(), why));
            });
            return;
        }
        let Some(watched) = watched else { return };
        let look = watched.mission.look();
        let Some(marking) = look.marking.clone() else { return };
        let now_s = watched.mission_s(&look);
        let giving = Giving::to(watched, &marking, &workspace.live.author);
        ui.horizontal_wrapped(|ui| {
            ui.strong("Live");
            let stage = RichText::new(marking.stage.as_str()).strong();
            ui.label(stage).on_hover_text("The state of the mission");
            ui.label(format_duration(now_s)).on_hover_text("Mission time");
            ui.weak(format!("version {} of the file", marking.version));
            if let Some(silence) = watched.silence() {
                ui.colored_label(colours.warning, silence);
            }
        });
        if let Some(change) = &marking.change {
            let text = format!(
                "Version {} of the file is {}, {} continues: {}",
                change.version, change.state, marking.version, change.why
            );
            ui.colored_label(colours.warning, paintable(ui.ctx(), &text));
        }
        self.orders.commands(ui, &workspace.live);
        let scroll = ScrollArea::both().id_salt("robots of the mission").auto_shrink(false);
        scroll.show(ui, |ui| {
            self.show_robots(ui, &giving, &marking, now_s);
            self.show_rest(ui, &giving, &marking, now_s);
            giving.refusal(ui, &marking);
        });
    }

    fn show_robots(&self, ui: &mut egui::Ui, giving: &Giving<'_>, marking: &Marking, now_s: f64) {
        if self.progress.is_empty() {
            ui.weak("No route is drawn in the version that is played.");
            return;
        }
        let grid = Grid::new("progress of the routes").num_columns(COLUMNS.len()).striped(true);
        grid.show(ui, |ui| {
            for name in COLUMNS {
                ui.weak(name);
            }
            ui.end_row();
            for (number, progress) in self.progress.iter().enumerate() {
                let route = &progress.route;
                let colour = ThemeColours::of(ui.visuals()).of_type(number);
                let name = RichText::new(paintable(ui.ctx(), route)).strong();
                ui.colored_label(colour, name);
                // Next to the name: they are to be seen whatever the width of the window is.
                ui.horizontal(|ui| show_orders_of(ui, giving, marking, route, now_s));
                self.show_robot(ui, number, progress, now_s);
                ui.end_row();
            }
        });
    }

    /// The cells of a robot but its name and its orders.
    fn show_robot(&self, ui: &mut egui::Ui, number: usize, progress: &RouteProgress, now_s: f64) {
        let colours = ThemeColours::of(ui.visuals());
        let route = &progress.route;
        let cell = |ui: &mut egui::Ui, what: &str, text: String, colour: Color32| {
            let shown = RichText::new(paintable(ui.ctx(), &text)).color(colour);
            let name = format!("{what} of {route}: {text}");
            // Its text alone means nothing to a screen reader.
            let label = ui.label(shown);
            label.widget_info(|| WidgetInfo::labeled(Role::Label, true, &name));
        };
        let (text, missing) = (colours.text, || "-".to_owned());
        cell(ui, "step", stand_text(progress), text);
        cell(ui, "done", done_text(progress), text);
        cell(
            ui,
            "left",
            progress.left_m.map_or_else(missing, |left_m| format!("{left_m:.1} m")),
            text,
        );
        cell(ui, "expected", expected_text(progress, now_s), text);
        let late_s = progress.late_s();
        let is_late = late_s.is_some_and(|late_s| late_s > 0.5);
        let colour = if is_late { colours.warning } else { text };
        cell(ui, "against nominal", late_s.map_or_else(missing, late_text), colour);
        let limit =
            progress.current.and_then(|current| progress.steps.get(current)?.limit.as_ref());
        let is_missed = limit.and_then(|limit| limit.left_s).is_some_and(|left_s| left_s < 0.0);
        let colour = if is_missed { colours.error } else { text };
        cell(ui, "limit", limit.map_or_else(missing, limit_text), colour);
        cell(
            ui,
            "off the leg",
            progress.off_leg_m.map_or_else(missing, |off_m| format!("{off_m:.2} m")),
            text,
        );
        let problem = self.robots.get(number).and_then(|robot| robot.why_not.as_ref());
        match problem {
            Some(problem) => {
                cell(ui, "not drawn", format!("not drawn: {problem}"), colours.warning);
            }
            None => {
                let is_breached = progress.zones.iter().any(is_breach);
                let colour = if is_breached { colours.error } else { text };
                cell(ui, "zones", zones_text(&progress.zones), colour);
            }
        }
    }

    /// Orders of no route, and tracks that are not drawn.
    fn show_rest(&self, ui: &mut egui::Ui, giving: &Giving<'_>, marking: &Marking, now_s: f64) {
        let is_of_route = |transition: &str| {
            let mut routes = self.progress.iter();
            routes.any(|it| {
                transition.strip_prefix(it.route.as_str()).is_some_and(|rest| rest.starts_with('.'))
            })
        };
        ui.horizontal_wrapped(|ui| {
            show_orders(ui, giving, marking, now_s, |name| (!is_of_route(name)).then_some(name));
        });
        let colours = ThemeColours::of(ui.visuals());
        for (output, why) in &self.tracks.why_not {
            let text = format!("The tracks of {output} are not drawn: {why}");
            ui.colored_label(colours.warning, paintable(ui.ctx(), &text));
        }
    }
}

/// The transitions of a route that an operator may fire: `recall`, `lost-link`, `resume`.
fn show_orders_of(
    ui: &mut egui::Ui,
    giving: &Giving<'_>,
    marking: &Marking,
    route: &str,
    now_s: f64,
) {
    show_orders(ui, giving, marking, now_s, |name| {
        let of_route = name.strip_prefix(route)?.strip_prefix('.')?;
        of_route.rsplit('.').next()
    });
}

/// The transitions that an operator may fire, each with the text that `word` gives it.
fn show_orders<'a>(
    ui: &mut egui::Ui,
    giving: &Giving<'_>,
    marking: &'a Marking,
    now_s: f64,
    word: impl Fn(&'a str) -> Option<&'a str>,
) {
    let clock_s = transition_clock(marking, now_s);
    for enabled in marking.enabled.iter().filter(|it| it.by == FiringDecider::Operator) {
        let name = enabled.transition.as_str();
        let Some(word) = word(name) else { continue };
        let why_not = if enabled.held {
            Some("The mission is paused: resume it first.")
        } else if enabled.earliest_at_s > clock_s(false) {
            Some("It is not due yet.")
        } else {
            None
        };
        let doc = format!("Fires {name}");
        let button = giving.button_unless(ui, word, &doc, why_not);
        if button.accessible_name(format!("Fire {name}")).clicked() {
            giving.give(Order::Fire { transition: name.to_owned() });
        }
    }
}
