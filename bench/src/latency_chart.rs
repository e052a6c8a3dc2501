//! Draws latencies over the length of a message as an SVG: a panel for each number of cores, a
//! logarithmic axis, one line for each means.

use std::fmt::Write;

/// One line of the chart: the latencies of one means, for each length.
pub struct LatencyCurve {
    pub name: &'static str,
    pub p50_us: Vec<f64>,
    pub p99_us: Vec<f64>,
}

/// The lines of one condition.
pub struct ChartPanel {
    pub title: &'static str,
    pub curves: Vec<LatencyCurve>,
}

const PANEL: (f64, f64) = (360.0, 320.0);
const LEFT: f64 = 64.0;
const TOP: f64 = 40.0;
/// Between two panels.
const GAP: f64 = 24.0;
const LEGEND_ROW: f64 = 18.0;
const COLOURS: [&str; 7] =
    ["#000000", "#888888", "#d62728", "#1f77b4", "#2ca02c", "#9467bd", "#ff7f0e"];

/// Draws the medians of all panels over `lens`, in bytes.
pub fn draw_chart(lens: &[usize], panels: &[ChartPanel]) -> String {
    let all = || panels.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.p50_us);
    let (low, high) =
        all().fold((f64::MAX, 0.0_f64), |(low, high), it| (low.min(*it), high.max(*it)));
    let (low, high) = (low.max(0.001).log10().floor(), high.max(1.0).log10().ceil());
    let most_len = lens.iter().copied().max().unwrap_or(1) as f64;
    let rows = panels.iter().map(|panel| panel.curves.len()).max().unwrap_or(0);
    let (width, bottom) = (LEFT + (PANEL.0 + GAP) * panels.len() as f64, TOP + PANEL.1);
    let height = bottom + 50.0 + LEGEND_ROW * rows.div_ceil(2) as f64;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    let y_of = |us: f64| bottom - PANEL.1 * (us.max(0.001).log10() - low) / (high - low);
    for (index, panel) in panels.iter().enumerate() {
        let left = LEFT + (PANEL.0 + GAP) * index as f64;
        let x_of = |len: f64| left + PANEL.0 * len / most_len;
        let middle = left + PANEL.0 / 2.0;
        let _ = writeln!(
            svg,
            "<text x=\"{middle}\" y=\"24\" text-anchor=\"middle\">latency, p50, {}</text>\n\
             <text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">payload, B</text>",
            panel.title,
            bottom + 36.0
        );
        for power in low as i32..=high as i32 {
            let (us, y) = (10_f64.powi(power), y_of(10_f64.powi(power)));
            let right = left + PANEL.0;
            let _ = writeln!(svg, "<path d=\"M{left} {y:.1}H{right}\" stroke=\"#dddddd\"/>");
            if index == 0 {
                let at = y + 4.0;
                let _ = writeln!(
                    svg,
                    "<text x=\"{}\" y=\"{at:.1}\" text-anchor=\"end\">{us} µs</text>",
                    left - 6.0
                );
            }
        }
        for len in lens {
            let x = x_of(*len as f64);
            let _ = writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{len}</text>",
                bottom + 18.0
            );
        }
        for (curve, colour) in panel.curves.iter().zip(COLOURS) {
            let points = lens.iter().zip(&curve.p50_us);
            let points =
                points.map(|(len, us)| format!("{:.1},{:.1}", x_of(*len as f64), y_of(*us)));
            let points = points.collect::<Vec<_>>().join(" ");
            let _ = writeln!(
                svg,
                "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>"
            );
        }
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{TOP}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"black\"/>",
            PANEL.0, PANEL.1
        );
    }
    // The same means have the same colours in all panels.
    for (row, (curve, colour)) in
        panels.iter().take(1).flat_map(|it| &it.curves).zip(COLOURS).enumerate()
    {
        let x = LEFT + (row % 2) as f64 * (PANEL.0 + GAP);
        let y = bottom + 58.0 + (row / 2) as f64 * LEGEND_ROW;
        let name = curve.name.replace('"', "&quot;");
        let _ = writeln!(
            svg,
            "<path d=\"M{x} {}h24\" stroke=\"{colour}\" stroke-width=\"2\"/><text x=\"{}\" y=\"{y}\">{name}</text>",
            y - 4.0,
            x + 32.0
        );
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_means_is_a_line_in_each_panel_and_has_its_name() {
        let curve =
            |name, us: f64| LatencyCurve { name, p50_us: vec![us, us * 2.0], p99_us: Vec::new() };
        let panel =
            |title| ChartPanel { title, curves: vec![curve("call", 0.1), curve("a \"b\"", 90.0)] };
        let svg = draw_chart(&[50, 1000], &[panel("two cores"), panel("one core")]);
        assert_eq!(svg.matches("<polyline").count(), 4);
        assert_eq!(svg.matches("call</text>").count(), 1);
        assert!(svg.contains("a &quot;b&quot;</text>") && svg.ends_with("</svg>\n"), "{svg}");
        // 0.1 µs is the lower end of the axis, 1,000 µs the upper one: 100 µs is three quarters up.
        assert!(svg.contains(">0.1 µs</text>") && svg.contains(">1000 µs</text>"), "{svg}");
    }
}
