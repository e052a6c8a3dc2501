//! Curves as charts: in a terminal, as text, and on a sheet for a file.

use armor_picture::chart::{SHEET_WIDTH, draw_curve};
use armor_picture::plot_sheet::PlotSheet;
use ratatui::backend::TestBackend;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Chart, Dataset, GraphType, Paragraph};
use ratatui::{Frame, Terminal};

use super::curves::{PlotCurve, PlotCurves, find_bounds};

const COLOURS: [Color; 6] =
    [Color::Cyan, Color::Yellow, Color::Magenta, Color::Green, Color::Red, Color::Blue];
/// Points of a curve for each column: the lowest and the highest of each half.
const POINTS_PER_COLUMN: usize = 4;

/// Draws the charts, of the last `window_s` seconds or of all values.
pub fn draw(frame: &mut Frame<'_>, curves: &PlotCurves, window_s: Option<f64>) {
    let groups = curves.group_by_unit();
    let Some([first_s, last_s]) = curves.time_span() else {
        let text = "waiting for values; q ends";
        frame.render_widget(Paragraph::new(text).alignment(Alignment::Center), frame.area());
        return;
    };
    let from_s = window_s.map_or(first_s, |window_s| last_s - window_s);
    let heights = groups.iter().map(|_| Constraint::Fill(1));
    let areas = Layout::vertical(heights).split(frame.area());
    for (group, area) in groups.iter().zip(areas.iter()) {
        draw_group(frame, group, *area, [from_s, last_s]);
    }
}

fn draw_group(frame: &mut Frame<'_>, group: &[&PlotCurve], area: Rect, [from_s, to_s]: [f64; 2]) {
    let [head, area] =
        Layout::vertical([Constraint::Length(group.len() as u16), Constraint::Min(0)]).areas(area);
    let count = usize::from(area.width) * POINTS_PER_COLUMN;
    let points: Vec<Vec<(f64, f64)>> = group
        .iter()
        .map(|curve| {
            let thin = curve.series.thin_points(from_s, count);
            thin.into_iter().map(|[time_s, value]| (time_s - to_s, value)).collect()
        })
        .collect();
    let bounds = find_bounds(points.iter().flatten().map(|(_, value)| *value));
    let colour_of = |number: usize| COLOURS[number % COLOURS.len()];
    let lines = group.iter().enumerate().map(|(number, curve)| {
        let last = curve.series.last().map_or("no value yet".into(), |[_, it]| format_value(it));
        let unit = if curve.unit.is_empty() { String::new() } else { format!(" {}", curve.unit) };
        Line::styled(format!("{}: {last}{unit}", curve.label), Style::new().fg(colour_of(number)))
    });
    frame.render_widget(Paragraph::new(lines.collect::<Vec<_>>()), head);
    let datasets = points.iter().enumerate().map(|(number, points)| {
        let style = Style::new().fg(colour_of(number));
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(style)
            .data(points)
    });
    let span_s = (to_s - from_s).max(1e-3);
    let times = [format!("-{} s", format_value(span_s)), "0 s".into()];
    let values = bounds.map(format_value);
    let chart = Chart::new(datasets.collect())
        .x_axis(Axis::default().bounds([-span_s, 0.0]).labels(times))
        .y_axis(Axis::default().bounds(bounds).labels(values));
    frame.render_widget(chart, area);
}

/// A number with about four digits.
fn format_value(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        it if !(1e-3..1e6).contains(&it) => format!("{value:.3e}"),
        it if it < 1.0 => format!("{value:.4}"),
        it if it < 100.0 => format!("{value:.3}"),
        _ => format!("{value:.1}"),
    }
}

/// Returns the charts of all values as lines of text.
pub fn format_chart(curves: &PlotCurves, width: u16, height: u16) -> String {
    let height = height.saturating_mul(curves.group_by_unit().len().max(1) as u16);
    let Ok(mut terminal) = Terminal::new(TestBackend::new(width, height));
    let Ok(_) = terminal.draw(|frame| draw(frame, curves, None));
    let buffer = terminal.backend().buffer();
    let line = |y| (0..width).map(|x| buffer[(x, y)].symbol()).collect::<String>();
    (0..height).map(|y| line(y).trim_end().to_owned() + "\n").collect()
}

/// Draws a chart for each curve, one below the other.
pub fn draw_sheet(curves: &PlotCurves) -> PlotSheet {
    let mut sheet = PlotSheet::new(SHEET_WIDTH);
    let first_s = curves.time_span().map_or(0.0, |[first_s, _]| first_s);
    for curve in curves.group_by_unit().into_iter().flatten() {
        let points = curve.series.thin_points(f64::MIN, usize::MAX).into_iter();
        let points = points.map(|[time_s, value]| (time_s - first_s, value)).collect();
        let unit =
            if curve.unit.is_empty() { String::new() } else { format!(" in {}", curve.unit) };
        draw_curve(&mut sheet, &format!("{}{unit} over time in s", curve.label), points);
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::super::curves::tests::curves;
    use super::*;

    #[test]
    fn a_chart_as_text_has_its_labels_values_and_a_line() {
        let text = format_chart(&curves(), 60, 12);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 24, "two units, two charts: {text}");
        assert_eq!(lines[0], "arm.pose.x: 20.000 m");
        assert_eq!(lines[1], "arm.pose.y: no value yet m");
        assert_eq!(lines[12], "arm.pose.yaw: 0.5000 rad");
        assert!(text.contains("20.000") && text.contains("-2.000 s"), "{text}");
        let is_braille = |it: char| ('\u{2801}'..='\u{28ff}').contains(&it);
        // The curve rises: its first dot is in the lowest line, its last in the highest.
        let with_dots: Vec<_> =
            lines[2..12].iter().filter(|line| line.contains(is_braille)).collect();
        assert!(with_dots.len() >= 8, "{text}");
        let column = |line: &str| line.chars().position(is_braille);
        assert!(column(with_dots[0]) > column(with_dots[with_dots.len() - 1]), "{text}");
    }

    #[test]
    fn a_terminal_of_any_size_can_be_drawn() {
        for (width, height) in [(1, 1), (3, 2), (20, 4), (80, 24), (300, 100)] {
            format_chart(&curves(), width, height);
        }
        let empty = PlotCurves::new(&[]);
        assert!(format_chart(&empty, 40, 3).contains("waiting for values"));
    }

    #[test]
    fn a_sheet_has_a_chart_for_each_curve_with_values() {
        let svg = draw_sheet(&curves()).to_svg();
        assert!(svg.contains("arm.pose.x in m over time in s"), "{svg}");
        assert!(svg.contains("arm.pose.yaw") && !svg.contains("arm.pose.y in m"), "{svg}");
    }

    #[test]
    fn numbers_have_about_four_digits() {
        let written = [0.0, 0.12345, -3.2789, 1234.56, 2.5e7, 1e-5].map(format_value);
        assert_eq!(written, ["0", "0.1235", "-3.279", "1234.6", "2.500e7", "1.000e-5"]);
    }
}
