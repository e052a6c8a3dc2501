//! Values over time.

use armor_inspect::WatchedValues;
use armor_inspect::words::format_duration;
use eframe::egui::{self, RichText, ScrollArea, Vec2b};
use egui_plot::{Line, Plot, PlotPoints, PlotUi};

use armor_picture::theme::ThemeColours;

/// Points drawn of a line: two for each column of a wide window.
const MOST_POINTS: usize = 3000;
/// A lower plot is unreadable: the panel scrolls instead.
const LEAST_HEIGHT: f32 = 140.0;
/// How far back a plot may show, in seconds.
const SPANS_S: [f64; 5] = [10.0, 30.0, 60.0, 300.0, 3600.0];

/// The values that are plotted.
#[derive(Debug)]
pub struct Plots {
    lines: Vec<Plotted>,
    span_s: f64,
    by_hand: bool,
}

#[derive(Debug, PartialEq)]
struct Plotted {
    data: String,
    path: String,
    unit: Option<String>,
}

impl Plotted {
    fn name(&self) -> String {
        let path = if self.path.is_empty() { String::new() } else { format!(".{}", self.path) };
        let unit = self.unit.as_ref().map(|unit| format!(" [{unit}]")).unwrap_or_default();
        format!("{}{path}{unit}", self.data)
    }
}

impl Default for Plots {
    fn default() -> Self {
        Self { lines: Vec::new(), span_s: SPANS_S[1], by_hand: false }
    }
}

impl Plots {
    /// Whether a value is plotted.
    pub fn has(&self, data: &str, path: &str) -> bool {
        self.lines.iter().any(|line| line.data == data && line.path == path)
    }

    /// Plots a value, or stops plotting it.
    pub fn set(
        &mut self,
        values: &WatchedValues,
        data: &str,
        path: &str,
        unit: Option<&str>,
        on: bool,
    ) {
        self.lines.retain(|line| line.data != data || line.path != path);
        if on {
            let unit = unit.map(Into::into);
            self.lines.push(Plotted { data: data.into(), path: path.into(), unit });
        } else {
            values.forget(data, path);
        }
    }

    /// Keeps recording what is plotted, also while the plots are hidden: a gap in a line would look
    /// like a gap in the data.
    pub fn keep(&self, values: &WatchedValues) {
        for line in &self.lines {
            values.series(&line.data, &line.path, |_| {});
        }
    }

    /// Shows them.
    pub fn show(&mut self, ui: &mut egui::Ui, values: &WatchedValues) {
        if self.lines.is_empty() {
            ui.weak("Nothing is plotted. Select a block or a link, open an output and choose `plot` next to a number.");
            return;
        }
        self.choices(ui, values);
        let colours = ThemeColours::of(ui.visuals());
        let series: Vec<_> = self.lines.iter().map(|line| self.points(values, line)).collect();
        let newest =
            series.iter().flatten().map(|point| point[0]).fold(f64::NEG_INFINITY, f64::max);
        let span_s = self.span_s;
        let mut plot = Plot::new("plots")
            .height(ui.available_height().max(LEAST_HEIGHT))
            .allow_drag(self.by_hand)
            .allow_zoom(self.by_hand)
            .allow_scroll(self.by_hand)
            .allow_boxed_zoom(self.by_hand);
        if !self.by_hand {
            plot = plot.auto_bounds(Vec2b::new(false, true)).include_x(-span_s).include_x(0.0);
        }
        let draw = |shown: &mut PlotUi<'_>| {
            if !self.by_hand {
                shown.set_plot_bounds_x(-span_s..=0.0);
            }
            for (number, (line, points)) in self.lines.iter().zip(series).enumerate() {
                let points: Vec<_> =
                    points.iter().map(|[time_s, y]| [time_s - newest, *y]).collect();
                let colour = colours.of_type(number);
                shown.line(
                    Line::new(line.name(), PlotPoints::from(points)).color(colour).width(1.5),
                );
            }
        };
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| plot.show(ui, draw));
    }

    fn points(&self, values: &WatchedValues, line: &Plotted) -> Vec<[f64; 2]> {
        values.series(&line.data, &line.path, |series| {
            let from_s = series.last().map_or(0.0, |[time_s, _]| time_s - self.span_s);
            series.thin_points(from_s, MOST_POINTS)
        })
    }

    fn choices(&mut self, ui: &mut egui::Ui, values: &WatchedValues) {
        let mut gone = None;
        let colours = ThemeColours::of(ui.visuals());
        ui.horizontal_wrapped(|ui| {
            ui.weak("The last").on_hover_text("The newest value is at 0 seconds.");
            for span_s in SPANS_S {
                let name = format_duration(span_s)
                    .replace(".0 s", " s")
                    .replace(" 00 s", "")
                    .replace(" 00 min", "");
                if ui.selectable_label(self.span_s == span_s, name).clicked() {
                    self.span_s = span_s;
                }
            }
            ui.checkbox(&mut self.by_hand, "move and zoom by hand");
            ui.separator();
            for (number, line) in self.lines.iter().enumerate() {
                let name = line.name();
                // One thing, so that it is not broken into two rows; in the colour of its line.
                let text = RichText::new(format!("x {name}")).color(colours.of_type(number));
                let close = ui.button(text).on_hover_text("Removes the plot");
                if close.accessible_name(format!("no longer plot {name}")).clicked() {
                    gone = Some(number);
                }
            }
        });
        if let Some(number) = gone {
            let line = self.lines.remove(number);
            values.forget(&line.data, &line.path);
        }
    }
}
