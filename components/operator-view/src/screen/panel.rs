//! The column of panels next to the map.

use super::colours::colours_of;
use eframe::egui::{Grid, RichText, ScrollArea, Ui};

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;

/// Width of the first column of rows, in points, so that rows of different panels line up.
const NAME_WIDTH: f32 = 84.0;

/// Height of a row, in points.
const ROW: f32 = 20.0;

/// A part of the column. What it shows comes from the console; what it keeps between frames is its
/// own.
pub(crate) trait SidePanel: Send {
    /// Returns the name, unique among the panels.
    fn name(&self) -> &'static str;

    /// Returns whether the panel stays in sight above those that scroll.
    fn is_pinned(&self) -> bool {
        false
    }

    /// Returns whether there is anything to show.
    fn is_visible(&self, _console: &Console, _now: ClockTimes) -> bool {
        true
    }

    /// Shows one frame, and returns the operator's orders.
    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        now: ClockTimes,
    ) -> Vec<OperatorOrder>;

    /// Returns where the panel is held to drive, as shares of the limits: ahead, to the left.
    fn held_direction(&self) -> Option<(f64, f64)> {
        None
    }
}

/// All panels, one below the other.
pub(super) struct PanelColumn {
    panels: Vec<Box<dyn SidePanel>>,
}

impl PanelColumn {
    pub(super) fn new(panels: Vec<Box<dyn SidePanel>>) -> Self {
        Self { panels }
    }

    /// Returns where a panel is held to drive.
    pub(super) fn held_direction(&self) -> Option<(f64, f64)> {
        self.panels.iter().find_map(|panel| panel.held_direction())
    }

    /// Shows the panels: the pinned ones stay in sight, the others scroll.
    pub(super) fn show_column(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        now: ClockTimes,
        orders: &mut Vec<OperatorOrder>,
    ) {
        ui.add_space(6.0);
        let shown = self.panels.iter_mut().filter(|panel| panel.is_visible(console, now));
        let (pinned, scrolling): (Vec<_>, Vec<_>) = shown.partition(|panel| panel.is_pinned());
        let is_divided = !pinned.is_empty() && !scrolling.is_empty();
        show_panels(pinned, ui, console, now, orders);
        if is_divided {
            ui.separator();
        }
        if console.connection.is_old() {
            let text = if console.connection.has_ended() {
                "old: the readings of the run that has ended"
            } else {
                "old: the readings before the connection was lost"
            };
            ui.colored_label(colours_of(ui).warning, RichText::new(text).strong());
        }
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            show_panels(scrolling, ui, console, now, orders);
        });
    }
}

/// Shows panels one below the other, with a line between two of them.
fn show_panels(
    panels: Vec<&mut Box<dyn SidePanel>>,
    ui: &mut Ui,
    console: &Console,
    now: ClockTimes,
    orders: &mut Vec<OperatorOrder>,
) {
    for (number, panel) in panels.into_iter().enumerate() {
        if number > 0 {
            ui.separator();
        }
        let shown = ui.push_id(panel.name(), |ui| panel.show_contents(ui, console, now));
        orders.extend(shown.inner);
    }
}

/// Shows names and values in two columns.
pub(crate) fn show_rows(ui: &mut Ui, id: &str, rows: Vec<(&str, String)>) {
    Grid::new(id).num_columns(2).min_col_width(NAME_WIDTH).min_row_height(ROW).show(ui, |ui| {
        for (name, value) in rows {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        }
    });
}
