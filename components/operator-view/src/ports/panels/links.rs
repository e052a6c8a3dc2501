//! The health of all links in one line; opened, what carries each linked input, its rate, what it
//! has skipped and lost, and its age.

use crate::screen::{colours_of, freshness_ink};
use armor_inspect::SystemPicture;
use armor_picture::theme::{TOUCH, ThemeColours};
use eframe::egui::{Button, Color32, Grid, RichText, TextStyle, Ui, vec2};

use crate::console::Console;
use crate::links::{ClockTimes, Freshness, InputLink};
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::ports::watch_messages::LinkReport;
use crate::screen::SidePanel;
use crate::screen::open_parts::{self, OpenPart};

pub(super) const PANEL: PanelKind = PanelKind { inputs: &[], make: || Box::new(LinksPanel) };

/// Links that are named in the line of all.
const MAX_NAMED: usize = 3;

/// What both ends of each link report.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LinksReading(Vec<LinkReport>);

impl LinksReading {
    /// Returns the links of the inputs of `component`.
    pub(crate) fn of(picture: &SystemPicture, component: &str) -> Self {
        let reports = picture.links.iter().filter_map(|link| {
            let input = link.to.strip_prefix(component)?.strip_prefix('.')?;
            Some(LinkReport {
                input: input.into(),
                transport: link.transport.clone(),
                skipped: link.skipped,
                lost: link.lost,
                dropped: link.dropped,
            })
        });
        Self(reports.collect())
    }

    /// Returns the reading that another process of the screen has sent.
    pub(crate) fn of_reports(reports: Vec<LinkReport>) -> Self {
        Self(reports)
    }

    /// Returns each link.
    pub(crate) fn reports(&self) -> &[LinkReport] {
        &self.0
    }

    fn find(&self, input: &str) -> Option<&LinkReport> {
        self.0.iter().find(|report| report.input == input)
    }
}

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
        let colours = colours_of(ui);
        let (health, text) = describe_health(console, now);
        let text = RichText::new(text).color(freshness_ink(colours, health));
        let button = ui.add_sized(vec2(ui.available_width(), TOUCH), Button::new(text));
        if button.on_hover_text("transport, rate, losses and age of each link").clicked() {
            open_parts::toggle(ui.ctx(), OpenPart::Links);
        }
        if open_parts::is_open(ui.ctx(), OpenPart::Links) {
            show_table(ui, colours, console, now);
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
    let losing = names_of(InputLink::is_losing);
    let count = console.links.len();
    match (gone.as_slice(), late.as_slice(), silent.as_slice()) {
        ([], [], []) if !losing.is_empty() => {
            (Freshness::Late, format!("! data are lost: {}", list(&losing)))
        }
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

fn show_table(ui: &mut Ui, colours: &ThemeColours, console: &Console, now: ClockTimes) {
    // Six columns fit only in the smallest text.
    let table = Grid::new("links").num_columns(6).spacing(vec2(6.0, 2.0)).min_col_width(0.0);
    let reading = console.readings.newest::<LinksReading>();
    table.min_row_height(20.0).show(ui, |ui| {
        ui.style_mut().override_text_style = Some(TextStyle::Small);
        for title in ["input", "via", "rate", "skipped", "lost", "age"] {
            ui.weak(title);
        }
        ui.end_row();
        for link in &console.links {
            let report = reading.and_then(|reading| reading.find(link.input));
            show_link(ui, colours, link, report, now);
        }
    });
}

fn show_link(
    ui: &mut Ui,
    colours: &ThemeColours,
    link: &InputLink,
    report: Option<&LinkReport>,
    now: ClockTimes,
) {
    ui.label(link.input).on_hover_text(&link.data);
    // The fonts of the screen have no arrow.
    let transport = report.map(|report| report.transport.replace('→', ">")).unwrap_or_default();
    ui.label(if transport.is_empty() { "-" } else { &transport });
    ui.label(format_rate(link.rate_hz(now)));
    match report {
        Some(report) => ui.label(report.skipped.to_string()),
        None => ui.label("-"),
    };
    show_losses(ui, colours, link, report);
    let age = ui.colored_label(age_colour(colours, link, now), format_age(link.age_s(now)));
    if let Some(problem) = &link.problem {
        age.on_hover_text(problem);
    }
    ui.end_row();
    if let Some(problem) = &link.problem {
        ui.colored_label(colours.error, "!").on_hover_text(problem);
        ui.end_row();
    }
}

/// Without a report, the gaps in the sequence are all that is known.
fn show_losses(ui: &mut Ui, colours: &ThemeColours, link: &InputLink, report: Option<&LinkReport>) {
    let lost = report.map_or(link.lost, |report| report.lost + report.dropped);
    let ink = if lost > 0 { colours.warning } else { colours.text };
    let label = ui.colored_label(ink, lost.to_string());
    if let Some(LinkReport { lost, dropped, .. }) = report {
        label.on_hover_text(format!(
            "{lost} lost in transport, {dropped} dropped because this screen was slow"
        ));
    }
}

fn age_colour(colours: &ThemeColours, link: &InputLink, now: ClockTimes) -> Color32 {
    if link.is_steady || link.freshness(now) == Freshness::Nothing {
        freshness_ink(colours, link.freshness(now))
    } else {
        colours.text
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
