//! Draws an evaluation as SVG: the trajectories over each other, the errors over time below.

use std::fmt::Write;

use armor_grid_slam::evaluation::Judged;
use armor_grid_slam::pose::Pose;

const WIDTH: f64 = 900.0;
/// Heights of the picture of the way and of each curve.
const WAY: f64 = 600.0;
const CURVE: f64 = 160.0;
const MARGIN: f64 = 40.0;
const OWN: &str = "#1f5fbf";
const OTHER: &str = "#999999";

/// Returns the picture. `way` is drawn if nothing was laid over a reference.
pub fn svg(way: &[(f64, Pose)], laid: &[(f64, Pose, Pose)], judged: &[Judged]) -> String {
    let at = |pose: &Pose| (pose.x_m, pose.y_m);
    let (own, other): (Vec<_>, Vec<_>) = if laid.is_empty() {
        (way.iter().map(|(_, pose)| at(pose)).collect(), Vec::new())
    } else {
        laid.iter().map(|(_, pose, reference)| (at(pose), at(reference))).unzip()
    };
    let mut text = String::new();
    let frame = Frame::around(own.iter().chain(&other), 0.0, WAY, true);
    line(&mut text, &frame, &other, OTHER);
    line(&mut text, &frame, &own, OWN);
    label(&mut text, 16.0, "way, metres: blue as found, grey the reference");
    frame.scale(&mut text);
    let by_scan = |value: fn(&Judged) -> f64| -> Vec<(f64, f64)> {
        judged.iter().map(|one| (one.relation.to as f64, value(one))).collect()
    };
    let distance = |(s, pose, other): &(f64, Pose, Pose)| (*s, pose.distance_m(other));
    let curves = [
        ("error of relations over the scan's number, metres", by_scan(|one| one.metres)),
        ("error of relations over the scan's number, degrees", by_scan(|one| one.degrees)),
        ("distance to the reference over time, metres", laid.iter().map(distance).collect()),
    ];
    let mut top = WAY;
    for (title, points) in curves.iter().filter(|(_, points)| !points.is_empty()) {
        let mut points = points.clone();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let frame = Frame::around(points.iter().chain(&[(points[0].0, 0.0)]), top, CURVE, false);
        line(&mut text, &frame, &points, OWN);
        label(&mut text, top + 16.0, &format!("{title}, at most {:.3}", frame.high.1));
        top += CURVE;
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {top}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{WIDTH}\" height=\"{top}\" fill=\"white\"/>\n{text}</svg>\n"
    )
}

/// Where numbers lie in the picture.
struct Frame {
    low: (f64, f64),
    high: (f64, f64),
    top: f64,
    height: f64,
    scale: (f64, f64),
}

impl Frame {
    fn around<'a>(
        points: impl Iterator<Item = &'a (f64, f64)>,
        top: f64,
        height: f64,
        is_even: bool,
    ) -> Self {
        let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
        for &(x, y) in points.filter(|(x, y)| x.is_finite() && y.is_finite()) {
            (low, high) = ((low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y)));
        }
        let scale = |room: f64, span: f64| (room - 2.0 * MARGIN) / span.max(1e-9);
        let (x, y) = (scale(WIDTH, high.0 - low.0), scale(height, high.1 - low.1));
        let scale = if is_even { (x.min(y), x.min(y)) } else { (x, y) };
        Self { low, high, top, height, scale }
    }

    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let down = self.height - MARGIN - (y - self.low.1) * self.scale.1;
        (MARGIN + (x - self.low.0) * self.scale.0, self.top + down)
    }

    /// A bar of ten metres.
    fn scale(&self, text: &mut String) {
        let (y, end) = (self.height - 12.0, MARGIN + 10.0 * self.scale.0);
        let _ = writeln!(
            text,
            "<path d=\"M{MARGIN} {y}H{end:.1}\" stroke=\"black\" stroke-width=\"3\"/>\
             <text x=\"{:.1}\" y=\"{y}\">10 m</text>",
            end + 8.0
        );
    }
}

fn line(text: &mut String, frame: &Frame, points: &[(f64, f64)], colour: &str) {
    let _ = write!(text, "<polyline fill=\"none\" stroke=\"{colour}\" points=\"");
    for (x, y) in points.iter().map(|point| frame.place(*point)) {
        let _ = write!(text, "{x:.1},{y:.1} ");
    }
    text.push_str("\"/>\n");
}

fn label(text: &mut String, y: f64, words: &str) {
    let _ = writeln!(text, "<text x=\"{MARGIN}\" y=\"{y}\">{words}</text>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_and_the_distance_are_drawn_within_the_picture() {
        let pair = |i: u32| {
            let x_m = f64::from(i);
            (x_m, Pose::new(x_m, 0.0, 0.0), Pose::new(x_m, 0.5, 0.0))
        };
        let laid: Vec<_> = (0..20).map(pair).collect();
        let drawn = svg(&[], &laid, &[]);
        assert_eq!(drawn.matches("<polyline").count(), 3);
        assert!(drawn.contains("distance to the reference over time, metres, at most 0.500"));
        let places = drawn.split("points=\"").skip(1).flat_map(|part| {
            part.split('"').next().unwrap_or("").split_whitespace().flat_map(|p| p.split(','))
        });
        assert!(places.map(|p| p.parse::<f64>().unwrap()).all(|p| (0.0..=900.0).contains(&p)));
    }
}
