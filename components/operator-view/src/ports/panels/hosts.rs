//! The hosts of a system of several: connected or cut off, their clocks, and what runs there.

use crate::screen::colours_of;
use armor_inspect::run_control::HostLink;
use armor_inspect::{ObservedHost, SystemPicture};
use armor_picture::theme::ThemeColours;
use eframe::egui::{Color32, RichText, Ui};

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::ports::watch_messages::{ShownHost, ShownLink};
use crate::screen::SidePanel;

pub(super) const PANEL: PanelKind = PanelKind { inputs: &[], make: || Box::new(HostsPanel) };

/// What is shown of each host.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct HostsReading(Vec<ShownHost>);

impl HostsReading {
    pub(crate) fn of(picture: &SystemPicture) -> Self {
        Self(picture.list_hosts().iter().map(describe_host).collect())
    }

    /// Returns the reading that another process of the screen has sent.
    pub(crate) fn of_shown(hosts: Vec<ShownHost>) -> Self {
        Self(hosts)
    }

    /// Returns each host.
    pub(crate) fn hosts(&self) -> &[ShownHost] {
        &self.0
    }
}

fn describe_host(host: &ObservedHost<'_>) -> ShownHost {
    let runs = (!host.processes.is_empty()).then(|| host.processes.join(", "));
    let link = host.report.map(|report| report.describe_link());
    let clock = host.report.and_then(|report| report.describe_clock());
    let shown = |link| match link {
        HostLink::Awaited => ShownLink::Awaited,
        HostLink::Connected => ShownLink::Connected,
        HostLink::CutOff => ShownLink::CutOff,
    };
    ShownHost {
        name: host.name.into(),
        link: host.report.map(|report| shown(report.link)),
        texts: [link, clock, runs].into_iter().flatten().collect(),
    }
}

struct HostsPanel;

impl SidePanel for HostsPanel {
    fn name(&self) -> &'static str {
        "hosts"
    }

    fn is_visible(&self, console: &Console, _: ClockTimes) -> bool {
        console.readings.newest::<HostsReading>().is_some_and(|reading| !reading.0.is_empty())
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        _: ClockTimes,
    ) -> Vec<OperatorOrder> {
        let Some(reading) = console.readings.newest::<HostsReading>() else { return Vec::new() };
        for row in &reading.0 {
            show_host(ui, row);
        }
        Vec::new()
    }
}

/// A host that is cut off is framed, and its line begins with a sign: no colour is needed to see it.
fn show_host(ui: &mut Ui, row: &ShownHost) {
    let is_cut = row.link == Some(ShownLink::CutOff);
    let title = if is_cut { format!("! host {}", row.name) } else { format!("host {}", row.name) };
    let ink = ink_of(row.link, colours_of(ui));
    let show = |ui: &mut Ui| {
        ui.colored_label(ink, RichText::new(title).strong());
        for text in &row.texts {
            ui.label(text);
        }
    };
    if is_cut {
        let frame = eframe::egui::Frame::group(ui.style()).stroke((2.0, ink));
        frame.show(ui, |ui| {
            ui.set_width(ui.available_width());
            show(ui);
        });
    } else {
        show(ui);
    }
}

fn ink_of(link: Option<ShownLink>, colours: &ThemeColours) -> Color32 {
    match link {
        Some(ShownLink::CutOff) => colours.error,
        Some(ShownLink::Awaited) => colours.warning,
        Some(ShownLink::Connected) => colours.good,
        None => colours.text,
    }
}
