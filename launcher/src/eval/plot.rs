//! What an evaluation looks like: the trajectories over each other, errors along the log and how
//! often they are how large.

use armor_grid_slam::evaluation::{Column, Judged};
use armor_grid_slam::pose::Pose;
use armor_map_writer::canvas::Colour;

use super::drawing::Drawing;

const WIDTH: f64 = 900.0;
/// Heights of the picture of the way and of each curve.
const WAY: f64 = 600.0;
const CURVE: f64 = 160.0;
/// Around a curve; left of it stand the numbers of its axis.
const MARGIN: f64 = 28.0;
const LEFT: f64 = 64.0;
const OWN: Colour = [31, 95, 191];
const OTHER: Colour = [153, 153, 153];
const AXIS: Colour = [60, 60, 60];
/// Bars of a histogram.
const BARS: usize = 60;

/// Draws it. `way` is drawn if nothing was laid over a reference.
pub fn plot(way: &[(f64, Pose)], laid: &[(f64, Pose, Pose)], judged: &[Judged]) -> Drawing {
    let mut drawing = Drawing::new(WIDTH);
    draw_way(&mut drawing, way, laid);
    let by_scan = |value: fn(&Judged) -> f64| -> Vec<(f64, f64)> {
        judged.iter().map(|one| (one.relation.to as f64, value(one))).collect()
    };
    let distance = |(s, pose, other): &(f64, Pose, Pose)| (*s, pose.distance_m(other));
    for (title, points) in [
        ("error of relations over the scan's number, metres", by_scan(|one| one.metres)),
        ("error of relations over the scan's number, degrees", by_scan(|one| one.degrees)),
        ("distance to the reference over time, metres", laid.iter().map(distance).collect()),
    ] {
        curve(&mut drawing, title, points);
    }
    histogram(&mut drawing, "relations by their error, metres", judged.iter().map(|j| j.metres));
    histogram(&mut drawing, "relations by their error, degrees", judged.iter().map(|j| j.degrees));
    drawing
}

/// Draws every column over the first one.
pub fn curves(columns: &[Column]) -> Drawing {
    let mut drawing = Drawing::new(WIDTH);
    let Some((first, others)) = columns.split_first() else { return drawing };
    for column in others {
        let points = first.numbers.iter().copied().zip(column.numbers.iter().copied());
        let title = format!("{} over {}", column.title, first.title);
        curve(&mut drawing, &title, points.collect());
    }
    drawing
}

/// Draws a curve over what stands in its first numbers.
fn curve(drawing: &mut Drawing, title: &str, mut points: Vec<(f64, f64)>) {
    points.retain(|(x, y)| x.is_finite() && y.is_finite());
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(first, _)) = points.first() else { return };
    let top = drawing.room(CURVE);
    let frame = Frame::around(points.iter().chain(&[(first, 0.0)]), top, CURVE, false);
    frame.axes(drawing, title);
    drawing.line(points.iter().map(|&point| frame.place(point)).collect(), OWN);
}

fn histogram(drawing: &mut Drawing, title: &str, values: impl Iterator<Item = f64> + Clone) {
    let most = values.clone().fold(0.0, f64::max);
    if most <= 0.0 {
        return;
    }
    let mut counts = [0u32; BARS];
    values.for_each(|v| counts[((v / most * BARS as f64) as usize).min(BARS - 1)] += 1);
    let top = drawing.room(CURVE);
    let highest = f64::from(counts.iter().copied().max().unwrap_or(0));
    let frame = Frame::around([(0.0, 0.0), (most, highest)].iter(), top, CURVE, false);
    frame.axes(drawing, title);
    for (number, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (left, right) = (number as f64, number as f64 + 0.9);
        let corner = frame.place((left / BARS as f64 * most, f64::from(*count)));
        let foot = frame.place((right / BARS as f64 * most, 0.0));
        drawing.bar(corner, (foot.0 - corner.0, foot.1 - corner.1), OWN);
    }
}

fn draw_way(drawing: &mut Drawing, way: &[(f64, Pose)], laid: &[(f64, Pose, Pose)]) {
    let at = |pose: &Pose| (pose.x_m, pose.y_m);
    let (own, other): (Vec<_>, Vec<_>) = if laid.is_empty() {
        (way.iter().map(|(_, pose)| at(pose)).collect(), Vec::new())
    } else {
        laid.iter().map(|(_, pose, reference)| (at(pose), at(reference))).unzip()
    };
    if own.is_empty() {
        return;
    }
    let top = drawing.room(WAY);
    let frame = Frame::around(own.iter().chain(&other), top, WAY, true);
    for (points, colour) in [(other, OTHER), (own, OWN)] {
        drawing.line(points.into_iter().map(|point| frame.place(point)).collect(), colour);
    }
    drawing.text((LEFT, top + 16.0), "way: blue as found, grey the reference");
    let (y, length) = (top + WAY - 10.0, 10.0 * frame.scale.0);
    drawing.bar((LEFT, y), (length, 3.0), AXIS);
    drawing.text((LEFT + length + 8.0, y + 4.0), "10 m");
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
        let scale = |room: f64, span: f64| room / span.max(1e-9);
        let x = scale(WIDTH - LEFT - MARGIN, high.0 - low.0);
        let y = scale(height - 2.0 * MARGIN, high.1 - low.1);
        let scale = if is_even { (x.min(y), x.min(y)) } else { (x, y) };
        Self { low, high, top, height, scale }
    }

    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let down = self.height - MARGIN - (y - self.low.1) * self.scale.1;
        (LEFT + (x - self.low.0) * self.scale.0, self.top + down)
    }

    /// Lines to the left and below, with the numbers at their ends.
    fn axes(&self, drawing: &mut Drawing, title: &str) {
        let corners = [(self.low.0, self.high.1), self.low, (self.high.0, self.low.1)];
        let corners = corners.map(|corner| self.place(corner));
        drawing.line(corners.to_vec(), AXIS);
        drawing.text((LEFT, self.top + 16.0), title);
        drawing.text((2.0, corners[0].1 + 10.0), short(self.high.1));
        drawing.text((2.0, corners[1].1), short(self.low.1));
        drawing.text((LEFT, corners[1].1 + 14.0), short(self.low.0));
        let right = drawing.width() - MARGIN - 60.0;
        drawing.text((right, corners[2].1 + 14.0), short(self.high.0));
    }
}

/// Three digits say enough on an axis; stamps keep their seconds.
fn short(number: f64) -> String {
    if number != 0.0 && number.abs() < 100.0 {
        format!("{number:.3}")
    } else {
        format!("{number:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_grid_slam::evaluation::Relation;

    fn drawn() -> Drawing {
        let pair = |i: u32| {
            let x_m = f64::from(i);
            (x_m, Pose::new(x_m, 0.0, 0.0), Pose::new(x_m, 0.5, 0.0))
        };
        let laid: Vec<_> = (0..20).map(pair).collect();
        let relation =
            |to: usize| Relation { from: 0, to, kind: "next".into(), motion: Pose::default() };
        let judged =
            |to: usize| Judged { relation: relation(to), metres: 0.1 * to as f64, degrees: 1.0 };
        plot(&[], &laid, &(1..20).map(judged).collect::<Vec<_>>())
    }

    #[test]
    fn all_is_drawn_within_the_picture() {
        let folder = std::env::temp_dir().join(format!("armor-plot-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("errors.svg");
        drawn().write(&file).unwrap();
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        // Both ways, three curves, five pairs of axes.
        assert_eq!(text.matches("<polyline").count(), 2 + 3 + 5);
        assert!(text.contains("distance to the reference over time, metres"));
        let places = text.split("points=\"").skip(1).flat_map(|part| {
            part.split('"').next().unwrap_or("").split_whitespace().flat_map(|p| p.split(','))
        });
        assert!(places.map(|p| p.parse::<f64>().unwrap()).all(|p| (0.0..=1400.0).contains(&p)));
    }

    #[test]
    fn other_endings_are_refused() {
        let error = drawn().write(std::path::Path::new("errors.gif")).unwrap_err().to_string();
        assert!(error.contains("errors.gif") && error.contains(".svg"), "{error}");
    }
}
