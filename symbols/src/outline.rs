//! Shapes: outlines of lines and cubic curves, each with its roles of colour. All constructions
//! that the symbols use are built here.

use std::f64::consts::TAU;

/// A position in the plane of a drawing: x to the right, y down.
pub type Position = [f64; 2];

/// One step of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathStep {
    /// Begins a new line at a position.
    Move(Position),
    /// A straight line to a position.
    Line(Position),
    /// A cubic Bézier curve: two control points and the end.
    Curve(Position, Position, Position),
    /// Back to the last `Move`.
    Close,
}

/// What a colour is for; the drawing program chooses the colour itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PaintRole {
    /// The inside of the frame: the colour of the identity.
    FrameFill,
    /// The line of the frame.
    FrameLine,
    /// The icon, its text and the amplifiers.
    Icon,
    /// Light areas inside an icon.
    IconFill,
    /// The bar of the operational condition.
    Condition,
}

/// The line of a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeLine {
    /// Which colour it has.
    pub role: PaintRole,
    /// Its width, in the units of the shape.
    pub width: f64,
    /// Lengths of dash and gap, if it is dashed.
    pub dash: Option<[f64; 2]>,
}

/// An outline that is filled, drawn as a line, or both.
#[derive(Debug, Clone, PartialEq)]
pub struct SymbolShape {
    /// The outline.
    pub steps: Vec<PathStep>,
    /// The colour of its inside.
    pub fill: Option<PaintRole>,
    /// Its line.
    pub line: Option<ShapeLine>,
    /// The text that these strokes draw, for screen readers and search.
    pub text: Option<String>,
}

impl SymbolShape {
    /// A shape that is only a line.
    pub(crate) fn line(steps: Vec<PathStep>, width: f64) -> Self {
        let line = ShapeLine { role: PaintRole::Icon, width, dash: None };
        Self { steps, fill: None, line: Some(line), text: None }
    }

    /// A shape that is only filled.
    pub(crate) fn filled(steps: Vec<PathStep>, role: PaintRole) -> Self {
        Self { steps, fill: Some(role), line: None, text: None }
    }

    pub(crate) fn dashed(mut self, dash: [f64; 2]) -> Self {
        if let Some(line) = &mut self.line {
            line.dash = Some(dash);
        }
        self
    }

    /// The smallest and largest coordinates of the outline's positions and control points, widened
    /// by half of the line.
    pub fn bounds(&self) -> Option<[Position; 2]> {
        let half = self.line.map_or(0.0, |line| line.width / 2.0);
        let mut bounds: Option<[Position; 2]> = None;
        for step in &self.steps {
            let positions: &[Position] = match step {
                PathStep::Move(to) | PathStep::Line(to) => &[*to],
                PathStep::Curve(first, second, to) => &[*first, *second, *to],
                PathStep::Close => &[],
            };
            for [x, y] in positions {
                let [low, high] = bounds.get_or_insert([[*x, *y], [*x, *y]]);
                *low = [low[0].min(x - half), low[1].min(y - half)];
                *high = [high[0].max(x + half), high[1].max(y + half)];
            }
        }
        bounds
    }
}

/// Straight lines through positions.
pub(crate) fn polyline(positions: &[Position], closed: bool) -> Vec<PathStep> {
    let mut steps = Vec::with_capacity(positions.len() + 1);
    for (index, position) in positions.iter().enumerate() {
        steps.push(if index == 0 { PathStep::Move(*position) } else { PathStep::Line(*position) });
    }
    if closed && !steps.is_empty() {
        steps.push(PathStep::Close);
    }
    steps
}

/// A rectangle from one corner to the opposite one.
pub(crate) fn rectangle([left, top]: Position, [right, bottom]: Position) -> Vec<PathStep> {
    polyline(&[[left, top], [right, top], [right, bottom], [left, bottom]], true)
}

/// An arc of an ellipse, from one angle to another in degrees, clockwise on the screen from the
/// right. The error of the cubic curves is below 0.03 % of the radius.
pub(crate) fn arc(centre: Position, radii: Position, from_deg: f64, to_deg: f64) -> Vec<PathStep> {
    let sweep = (to_deg - from_deg).to_radians();
    let pieces = (sweep.abs() / (TAU / 4.0)).ceil().max(1.0);
    let piece = sweep / pieces;
    let handle = 4.0 / 3.0 * (piece / 4.0).tan();
    let at = |angle: f64| [centre[0] + radii[0] * angle.cos(), centre[1] + radii[1] * angle.sin()];
    let mut angle = from_deg.to_radians();
    let mut steps = vec![PathStep::Move(at(angle))];
    for _ in 0..pieces as usize {
        let end = angle + piece;
        let (from, to) = (at(angle), at(end));
        steps.push(PathStep::Curve(
            [from[0] - handle * radii[0] * angle.sin(), from[1] + handle * radii[1] * angle.cos()],
            [to[0] + handle * radii[0] * end.sin(), to[1] - handle * radii[1] * end.cos()],
            to,
        ));
        angle = end;
    }
    steps
}

/// A whole ellipse.
pub(crate) fn ellipse(centre: Position, radii: Position) -> Vec<PathStep> {
    let mut steps = arc(centre, radii, 0.0, 360.0);
    steps.push(PathStep::Close);
    steps
}

/// Two straight lines whose ends are joined by half ellipses: `half` is half the length of the
/// straight lines, `radii` those of the ends.
pub(crate) fn capsule(centre: Position, half: f64, radii: Position) -> Vec<PathStep> {
    let mut steps = arc([centre[0] + half, centre[1]], radii, -90.0, 90.0);
    for step in arc([centre[0] - half, centre[1]], radii, 90.0, 270.0) {
        steps.push(match step {
            PathStep::Move(to) => PathStep::Line(to),
            other => other,
        });
    }
    steps.push(PathStep::Close);
    steps
}

/// Moves and scales an outline: each position is multiplied by `scale`, then moved by `by`.
pub(crate) fn moved(steps: &[PathStep], scale: f64, by: Position) -> Vec<PathStep> {
    let map = |[x, y]: Position| [x * scale + by[0], y * scale + by[1]];
    steps
        .iter()
        .map(|step| match *step {
            PathStep::Move(to) => PathStep::Move(map(to)),
            PathStep::Line(to) => PathStep::Line(map(to)),
            PathStep::Curve(first, second, to) => PathStep::Curve(map(first), map(second), map(to)),
            PathStep::Close => PathStep::Close,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_curve_of_an_ellipse_ends_on_it() {
        for step in ellipse([3.0, -2.0], [40.0, 25.0]) {
            if let PathStep::Move([x, y]) | PathStep::Curve(_, _, [x, y]) = step {
                let radius = ((x - 3.0) / 40.0).hypot((y + 2.0) / 25.0);
                assert!((radius - 1.0).abs() < 1e-9, "{x} {y}");
            }
        }
    }

    #[test]
    fn bounds_include_half_of_the_line() {
        let shape = SymbolShape::line(polyline(&[[0.0, 0.0], [10.0, 4.0]], false), 2.0);
        assert_eq!(shape.bounds(), Some([[-1.0, -1.0], [11.0, 5.0]]));
        assert_eq!(SymbolShape::line(Vec::new(), 2.0).bounds(), None);
    }
}
