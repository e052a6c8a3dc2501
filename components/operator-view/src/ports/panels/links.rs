//! The health of all links in one line; opened, rate, losses and age of each linked input.

use eframe::egui::{Button, Color32, Grid, RichText, Ui, vec2};

use crate::console::Console;
use crate::links::{ClockTimes, Freshness, InputLink};
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::screen::colours::TOUCH;
use crate::screen::open_parts::{self, OpenPart};
use crate::screen::{Palette, SidePanel};

pub(super) const PANEL: PanelKind = PanelKind { inputs: &[], make: || Box::new(LinksPanel) };

/// Links that are named in the line of all.
const MAX_NAMED: usize = 3;

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
        let palette = Palette::of(ui);
        let (health, text) = describe_health(console, now);
        let text = RichText::new(text).color(palette.of_freshness(health));
        let button = ui.add_sized(vec2(ui.available_width(), TOUCH), Button::new(text));
        if button.on_hover_text("rate, losses and age of each link").clicked() {
            open_parts::toggle(ui.ctx(), OpenPart::Links);
        }
        if open_parts::is_open(ui.ctx(), OpenPart::Links) {
            show_table(ui, palette, console, now);
        }
        Vec::new()
    }
}

/// Returns the worst freshness of a link, and all links in one line.
fn describe_health(console: &Console, now: ClockTimes) -> (Freshness, String) {
    if console.connection.is_old() {
        return (Freshness::Nothing, "no data: the readings are old".into());
    }
    let names_of = |wanted: fn(&InputLink, ClockTimes) -> bool| -> Vec<&str> {
        let links = console.links.iter().filter(|link| wanted(link, now));
        links.map(|link| link.input).collect()
    };
    let gone =
        names_of(|link, now| link.problem.is_some() || link.freshness(now) == Freshness::Gone);
    let late = names_of(|link, now| link.freshness(now) == Freshness::Late);
    let silent = names_of(|link, now| link.freshness(now) == Freshness::Nothing);
    let count = console.links.len();
    match (gone.as_slice(), late.as_slice(), silent.as_slice()) {
        ([], [], []) => (Freshness::Fresh, format!("links: all {count} fine")),
        ([], [], silent) => {
            (Freshness::Nothing, format!("{count} links, no data yet: {}", list(silent)))
        }
        ([], late, _) => (Freshness::Late, format!("! late: {}", list(late))),
        (gone, ..) => (Freshness::Gone, format!("! not usable: {}", list(gone))),
    }
}

/// Names the first ones.
fn list(names: &[&str]) -> String {
    let shown = names.iter().take(MAX_NAMED).copied().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(MAX_NAMED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

fn show_table(ui: &mut Ui, palette: &Palette, console: &Console, now: ClockTimes) {
    let table = Grid::new("links").num_columns(4).spacing(vec2(10.0, 2.0));
    table.min_row_height(20.0).show(ui, |ui| {
        for title in ["input", "rate", "lost", "age"] {
            ui.weak(title);
        }
        ui.end_row();
        for link in &console.links {
            show_link(ui, palette, link, now);
        }
    });
}

fn show_link(ui: &mut Ui, palette: &Palette, link: &InputLink, now: ClockTimes) {
    ui.label(link.input).on_hover_text(&link.data);
    ui.label(format_rate(link.rate_hz(now)));
    let lost = if link.lost > 0 { palette.late } else { palette.text };
    ui.colored_label(lost, link.lost.to_string());
    let age = ui.colored_label(age_colour(palette, link, now), format_age(link.age_s(now)));
    if let Some(problem) = &link.problem {
        age.on_hover_text(problem);
    }
    ui.end_row();
    if let Some(problem) = &link.problem {
        ui.colored_label(palette.gone, "!").on_hover_text(problem);
        ui.end_row();
    }
}

fn age_colour(palette: &Palette, link: &InputLink, now: ClockTimes) -> Color32 {
    if link.is_steady || link.freshness(now) == Freshness::Nothing {
        palette.of_freshness(link.freshness(now))
    } else {
        palette.text
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
