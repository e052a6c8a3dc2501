//! Rate, losses and age of each linked input.

use eframe::egui::{Color32, Grid, Ui, vec2};

use crate::console::Console;
use crate::links::{ClockTimes, Freshness, InputLink};
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::screen::{SidePanel, colours};

pub(super) const PANEL: PanelKind = PanelKind { inputs: &[], make: || Box::new(LinksPanel) };

struct LinksPanel;

impl SidePanel for LinksPanel {
    fn name(&self) -> &'static str {
        "links"
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        now: ClockTimes,
    ) -> Vec<OperatorOrder> {
        if console.links.is_empty() {
            ui.weak("no input is linked");
            return Vec::new();
        }
        let table = Grid::new("links").num_columns(4).spacing(vec2(10.0, 2.0)).striped(true);
        table.show(ui, |ui| {
            for title in ["input", "rate", "lost", "age"] {
                ui.weak(title);
            }
            ui.end_row();
            for link in &console.links {
                show_link(ui, link, now);
            }
        });
        Vec::new()
    }
}

fn show_link(ui: &mut Ui, link: &InputLink, now: ClockTimes) {
    ui.label(link.input).on_hover_text(&link.data);
    ui.label(format_rate(link.rate_hz(now)));
    let lost = if link.lost > 0 { colours::LATE } else { colours::TEXT };
    ui.colored_label(lost, link.lost.to_string());
    let age = ui.colored_label(age_colour(link, now), format_age(link.age_s(now)));
    if let Some(problem) = &link.problem {
        age.on_hover_text(problem);
    }
    ui.end_row();
    if let Some(problem) = &link.problem {
        ui.colored_label(colours::GONE, "!").on_hover_text(problem);
        ui.end_row();
    }
}

fn age_colour(link: &InputLink, now: ClockTimes) -> Color32 {
    if link.is_steady || link.freshness(now) == Freshness::Nothing {
        colours::of(link.freshness(now))
    } else {
        colours::TEXT
    }
}

fn format_rate(rate_hz: f64) -> String {
    match rate_hz {
        rate if rate < 0.05 => "-".into(),
        rate if rate < 9.95 => format!("{rate:.1} Hz"),
        rate => format!("{rate:.0} Hz"),
    }
}

fn format_age(age_s: Option<f64>) -> String {
    match age_s {
        None => "none yet".into(),
        Some(age_s) if age_s < 60.0 => format!("{age_s:.1} s"),
        Some(age_s) => format!("{:.0} min", (age_s / 60.0).floor()),
    }
}
