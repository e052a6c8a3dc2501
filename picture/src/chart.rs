//! Charts on a sheet, one below the other: curves, histograms, and trajectories seen from above.

use crate::canvas::RgbColour;
use crate::plot_sheet::PlotSheet;

/// The width of a sheet of charts, in points.
pub const SHEET_WIDTH: f64 = 900.0;
/// The colour of what is measured.
pub const MEASURED: RgbColour = [31, 95, 191];
/// The colour of what it is compared with.
pub const REFERENCE: RgbColour = [153, 153, 153];

/// Heights of a picture of trajectories and of each other chart, in points.
const TRAJECTORIES_HEIGHT: f64 = 600.0;
const CHART_HEIGHT: f64 = 160.0;
/// Around a chart; the numbers of its vertical axis stand in the wider margin on the left.
const MARGIN: f64 = 28.0;
const LEFT_MARGIN: f64 = 64.0;
const AXIS: RgbColour = [60, 60, 60];
/// Bars of a histogram.
const BARS: usize = 60;
/// Length of the scale bar below trajectories, in metres.
const SCALE_BAR_M: f64 = 10.0;

/// Draws a curve through points that are sorted by x first. Points that are not finite are left
/// out; without any other nothing is drawn.
pub fn draw_curve(sheet: &mut PlotSheet, title: &str, mut points: Vec<(f64, f64)>) {
    points.retain(|(x, y)| x.is_finite() && y.is_finite());
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(first, _)) = points.first() else { return };
    let top = sheet.add_row(CHART_HEIGHT);
    // With a point at y = 0, so that the vertical axis contains it.
    let zero = [(first, 0.0)];
    let with_zero = points.iter().chain(&zero);
    let area = ChartArea::around(with_zero, top, CHART_HEIGHT, Scaling::EachAxis);
    area.draw_axes(sheet, title);
    sheet.draw_line(points.iter().map(|&point| area.place(point)).collect(), MEASURED);
}

/// Draws how many values lie in each of 60 equal intervals from 0 to the largest value.
pub fn draw_histogram(
    sheet: &mut PlotSheet,
    title: &str,
    values: impl Iterator<Item = f64> + Clone,
) {
    let largest = values.clone().fold(0.0, f64::max);
    if largest <= 0.0 {
        return;
    }
    let mut counts = [0u32; BARS];
    values.for_each(|v| counts[((v / largest * BARS as f64) as usize).min(BARS - 1)] += 1);
    let top = sheet.add_row(CHART_HEIGHT);
    let highest = f64::from(counts.iter().copied().max().unwrap_or(0));
    let corners = [(0.0, 0.0), (largest, highest)];
    let area = ChartArea::around(corners.iter(), top, CHART_HEIGHT, Scaling::EachAxis);
    area.draw_axes(sheet, title);
    for (number, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (left, right) = (number as f64, number as f64 + 0.9);
        let corner = area.place((left / BARS as f64 * largest, f64::from(*count)));
        let foot = area.place((right / BARS as f64 * largest, 0.0));
        sheet.fill_bar(corner, (foot.0 - corner.0, foot.1 - corner.1), MEASURED);
    }
}

/// Draws trajectories in metres over each other at one scale, the last one on top, with a scale
/// bar.
pub fn draw_trajectories(
    sheet: &mut PlotSheet,
    title: &str,
    trajectories: &[(&[(f64, f64)], RgbColour)],
) {
    let all = trajectories.iter().flat_map(|(points, _)| points.iter());
    if all.clone().next().is_none() {
        return;
    }
    let top = sheet.add_row(TRAJECTORIES_HEIGHT);
    let area = ChartArea::around(all, top, TRAJECTORIES_HEIGHT, Scaling::OneForBoth);
    for (points, colour) in trajectories {
        sheet.draw_line(points.iter().map(|&point| area.place(point)).collect(), *colour);
    }
    sheet.draw_text((LEFT_MARGIN, top + 16.0), title);
    let (y, length) = (top + TRAJECTORIES_HEIGHT - 10.0, SCALE_BAR_M * area.scale.0);
    sheet.fill_bar((LEFT_MARGIN, y), (length, 3.0), AXIS);
    sheet.draw_text((LEFT_MARGIN + length + 8.0, y + 4.0), format!("{SCALE_BAR_M} m"));
}

/// How numbers are scaled to points.
#[derive(Clone, Copy)]
enum Scaling {
    /// Each axis fills its room.
    EachAxis,
    /// Both axes have the same scale, so that shapes keep their proportions.
    OneForBoth,
}

/// Where the numbers of a chart lie on the sheet.
struct ChartArea {
    low: (f64, f64),
    high: (f64, f64),
    top: f64,
    height: f64,
    scale: (f64, f64),
}

impl ChartArea {
    fn around<'a>(
        points: impl Iterator<Item = &'a (f64, f64)>,
        top: f64,
        height: f64,
        scaling: Scaling,
    ) -> Self {
        let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
        for &(x, y) in points.filter(|(x, y)| x.is_finite() && y.is_finite()) {
            (low, high) = ((low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y)));
        }
        // All points on one line would divide by zero.
        let scale = |room: f64, span: f64| room / span.max(1e-9);
        let x = scale(SHEET_WIDTH - LEFT_MARGIN - MARGIN, high.0 - low.0);
        let y = scale(height - 2.0 * MARGIN, high.1 - low.1);
        let scale = match scaling {
            Scaling::EachAxis => (x, y),
            Scaling::OneForBoth => (x.min(y), x.min(y)),
        };
        Self { low, high, top, height, scale }
    }

    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let down = self.height - MARGIN - (y - self.low.1) * self.scale.1;
        (LEFT_MARGIN + (x - self.low.0) * self.scale.0, self.top + down)
    }

    /// Draws lines on the left and below, with the numbers at their ends.
    fn draw_axes(&self, sheet: &mut PlotSheet, title: &str) {
        let corners = [(self.low.0, self.high.1), self.low, (self.high.0, self.low.1)];
        let corners = corners.map(|corner| self.place(corner));
        sheet.draw_line(corners.to_vec(), AXIS);
        sheet.draw_text((LEFT_MARGIN, self.top + 16.0), title);
        sheet.draw_text((2.0, corners[0].1 + 10.0), format_axis_number(self.high.1));
        sheet.draw_text((2.0, corners[1].1), format_axis_number(self.low.1));
        sheet.draw_text((LEFT_MARGIN, corners[1].1 + 14.0), format_axis_number(self.low.0));
        let right = sheet.width() - MARGIN - 60.0;
        sheet.draw_text((right, corners[2].1 + 14.0), format_axis_number(self.high.0));
    }
}

/// Three decimals for small numbers; whole seconds for time stamps and other large ones.
fn format_axis_number(number: f64) -> String {
    if number != 0.0 && number.abs() < 100.0 {
        format!("{number:.3}")
    } else {
        format!("{number:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_sorted_and_without_gaps() {
        let mut sheet = PlotSheet::new(SHEET_WIDTH);
        draw_curve(&mut sheet, "none", vec![(f64::NAN, 1.0)]);
        assert!(!sheet.to_svg().contains("<text"), "nothing finite, nothing drawn");
        draw_curve(&mut sheet, "curve", vec![(2.0, 1.0), (0.0, f64::INFINITY), (1.0, 0.5)]);
        let svg = sheet.to_svg();
        assert!(svg.contains("points=\"64.0,80.0 872.0,28.0 \""), "{svg}");
    }

    #[test]
    fn a_histogram_has_a_bar_for_each_interval_with_values() {
        let mut sheet = PlotSheet::new(SHEET_WIDTH);
        draw_histogram(&mut sheet, "errors", [0.0, 0.0, 1.0, 6.0].into_iter());
        // The white sheet, and three bars.
        assert_eq!(sheet.to_svg().matches("<rect").count(), 1 + 3);
    }
}
