//! Control measures: points, lines and areas, drawn over positions that the caller gives.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use crate::measure_geometry as geometry;
use crate::outline::{
    PaintRole, PathStep, Position, ShapeLine, SymbolShape, arc, ellipse, polyline, rectangle,
};
use crate::stroke_text::{centred_text, text_width};

/// One control measure of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ControlMeasure {
    /// Its entity: digits 11 to 16 of the code, in symbol set 25.
    pub entity: u32,
    /// Its name.
    pub name: &'static str,
    /// Dimension and function of the older code, if it has one.
    letters: Option<[&'static str; 2]>,
    style: &'static str,
    /// The text of the standard, such as `PL`; may be empty.
    pub text: &'static str,
}

/// What a control measure is drawn over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeasureGeometry {
    /// One position.
    Point,
    /// Two positions or more.
    Line,
    /// Three corners or more.
    Area,
}

impl MeasureGeometry {
    /// How many positions it needs.
    pub fn positions(self) -> usize {
        match self {
            Self::Point => 1,
            Self::Line => 2,
            Self::Area => 3,
        }
    }
}

/// Why a control measure cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeasureError {
    /// Too few positions for its geometry.
    #[error("{name} needs {needed} positions or more, but there are {found}; add the missing ones")]
    TooFew {
        /// The control measure.
        name: &'static str,
        /// How many there are.
        found: usize,
        /// How many it needs.
        needed: usize,
    },
    /// A position or the size is no finite number, or the size is not positive.
    #[error("position {index} or the size of {name} is no finite number above zero; correct it")]
    NotFinite {
        /// The control measure.
        name: &'static str,
        /// The first wrong position, or the number of positions if the size is wrong.
        index: usize,
    },
}

static MEASURES: LazyLock<Vec<ControlMeasure>> =
    LazyLock::new(|| include_str!("controls.txt").lines().filter_map(read_line).collect());

fn read_line(line: &'static str) -> Option<ControlMeasure> {
    if line.starts_with('#') {
        return None;
    }
    let mut fields = line.splitn(4, '|').map(str::trim);
    let (entity, letters) = (fields.next()?.parse().ok()?, fields.next()?);
    let (name, style) = (fields.next()?, fields.next()?);
    let (style, text) = style.split_once(' ').unwrap_or((style, ""));
    let letters = letters.split_once(' ').map(|(dimension, function)| [dimension, function]);
    Some(ControlMeasure { entity, name, letters, style, text })
}

/// The entity of an older code's dimension and function.
pub(crate) fn entity_of_letters(dimension: char, function: &str) -> Option<u32> {
    let measure = MEASURES.iter().find(|measure| {
        measure.letters.is_some_and(|[of_dimension, of_function]| {
            of_function == function && of_dimension.starts_with(dimension)
        })
    })?;
    Some(measure.entity)
}

/// Where and how large to draw.
struct Pen<'a> {
    positions: &'a [Position],
    /// The height of text.
    size: f64,
    text: String,
    planned: bool,
}

impl ControlMeasure {
    /// All control measures.
    pub fn all() -> &'static [Self] {
        &MEASURES
    }

    /// The control measure of an entity of symbol set 25.
    pub fn of_entity(entity: u32) -> Option<&'static Self> {
        MEASURES.iter().find(|measure| measure.entity == entity)
    }

    /// What it is drawn over.
    pub fn geometry(&self) -> MeasureGeometry {
        match self.style {
            "flag" | "square" | "circle" | "crossed-circle" | "star" | "waypoint" | "triangle"
            | "cross" => MeasureGeometry::Point,
            "area" | "dashed-area" | "battlement" | "hatched" | "hatched-teeth" => {
                MeasureGeometry::Area
            }
            _ => MeasureGeometry::Line,
        }
    }

    /// Draws it over these positions, in their units; `size` is the height of text, `label` the
    /// name that stands after the standard's text. What is planned is dashed.
    ///
    /// # Errors
    /// If there are too few positions, or one of them or the size is no finite number.
    pub fn draw(
        &self,
        positions: &[Position],
        size: f64,
        label: &str,
        planned: bool,
    ) -> Result<Vec<SymbolShape>, MeasureError> {
        let (name, found) = (self.name, positions.len());
        let needed = self.geometry().positions();
        if found < needed {
            return Err(MeasureError::TooFew { name, found, needed });
        }
        // Far beyond any map, and small enough that no sum of them overflows.
        let bad = |value: f64| !value.is_finite() || value.abs() > 1e12;
        if let Some(index) = positions.iter().position(|[x, y]| bad(*x) || bad(*y)) {
            return Err(MeasureError::NotFinite { name, index });
        }
        if bad(size) || size <= 0.0 {
            return Err(MeasureError::NotFinite { name, index: found });
        }
        let text = [self.text, label].join(" ").trim().to_owned();
        let pen = Pen { positions, size, text, planned };
        Ok(match self.geometry() {
            MeasureGeometry::Point => pen.point(self.style),
            MeasureGeometry::Line => pen.line(self.style),
            MeasureGeometry::Area => pen.area(self.style),
        })
    }

    /// An example of it, in the octagon.
    pub(crate) fn example(&self, planned: bool) -> Vec<SymbolShape> {
        let line: &[Position] = &[[-170.0, 40.0], [-50.0, -30.0], [60.0, 30.0], [170.0, -20.0]];
        let area: &[Position] =
            &[[-150.0, -80.0], [40.0, -112.0], [160.0, -20.0], [90.0, 100.0], [-120.0, 90.0]];
        let (positions, size) = match self.geometry() {
            MeasureGeometry::Point => (&[[0.0, 100.0]][..], 56.0),
            MeasureGeometry::Line => (line, 30.0),
            MeasureGeometry::Area => (area, 36.0),
        };
        // The example's positions are finite and as many as each geometry needs.
        self.draw(positions, size, "", planned).unwrap_or_default()
    }
}

impl Pen<'_> {
    fn stroke(&self, steps: Vec<PathStep>) -> SymbolShape {
        let shape = SymbolShape::line(steps, self.size / 8.0);
        if self.planned { shape.dashed([self.size * 0.6, self.size * 0.4]) } else { shape }
    }

    fn label(&self, at: Position) -> Option<SymbolShape> {
        (!self.text.is_empty()).then(|| centred_text(&self.text, at, self.size))
    }

    fn point(&self, style: &str) -> Vec<SymbolShape> {
        let ([x, y], s) = (self.positions[0], self.size);
        let half = (text_width(&self.text, s) / 2.0 + s * 0.3).max(s * 0.7);
        let (outline, label_at) = match style {
            "flag" => {
                let (top, foot) = (y - 2.8 * s, y - s);
                let corners =
                    [[x - half, top], [x + half, top], [x + half, foot], [x, y], [x - half, foot]];
                (vec![polyline(&corners, true)], [x, y - 1.9 * s])
            }
            "square" => (vec![rectangle([x - half, y - half], [x + half, y + half])], [x, y]),
            "triangle" => {
                let corners =
                    [[x, y - 1.2 * s], [x + 1.1 * s, y + 0.8 * s], [x - 1.1 * s, y + 0.8 * s]];
                (vec![polyline(&corners, true)], [x, y + 1.5 * s])
            }
            "star" => (vec![star([x, y], 1.3 * s)], [x, y + 2.0 * s]),
            "cross" => (
                vec![
                    polyline(&[[x - 1.2 * s, y], [x + 1.2 * s, y]], false),
                    polyline(&[[x, y - 1.2 * s], [x, y + 1.2 * s]], false),
                ],
                [x + 1.4 * s + half, y - s],
            ),
            "crossed-circle" | "waypoint" => {
                let reach = if style == "waypoint" { 0.9 * s } else { 0.9 * s * 0.5_f64.sqrt() };
                let cross = if style == "waypoint" {
                    [[[x - reach, y], [x + reach, y]], [[x, y - reach], [x, y + reach]]]
                } else {
                    [
                        [[x - reach, y - reach], [x + reach, y + reach]],
                        [[x - reach, y + reach], [x + reach, y - reach]],
                    ]
                };
                let mut outline = vec![ellipse([x, y], [0.9 * s, 0.9 * s])];
                outline.extend(cross.map(|line| polyline(&line, false)));
                (outline, [x, y + 1.7 * s])
            }
            _ => (vec![ellipse([x, y], [half * 1.15, half * 1.15])], [x, y]),
        };
        outline.into_iter().map(|steps| self.stroke(steps)).chain(self.label(label_at)).collect()
    }

    fn line(&self, style: &str) -> Vec<SymbolShape> {
        let s = self.size;
        let mut shapes = match style {
            "lobes" => vec![self.stroke(self.lobes())],
            "teeth" => vec![self.stroke(polyline(self.positions, false)), self.teeth(false)],
            "lane" => self.parallels(0.8 * s),
            "corridor" => {
                let mut shapes = self.parallels(0.9 * s);
                let at = |position: &Position| self.stroke(ellipse(*position, [0.9 * s, 0.9 * s]));
                shapes.extend(self.positions.iter().map(at));
                shapes
            }
            "arrow" | "arrow-main" | "arrow-air" => self.arrow(style),
            "axis" | "axis-main" | "axis-air" => self.axis(style),
            "dashed" => {
                let line = self.stroke(polyline(self.positions, false));
                vec![line.dashed([s * 0.6, s * 0.4])]
            }
            _ => vec![self.stroke(polyline(self.positions, false))],
        };
        let half = text_width(&self.text, s) / 2.0 + s * 0.5;
        if matches!(style, "line" | "dashed") {
            // The standard labels both ends of a line, in its direction.
            for (end, before) in geometry::ends(self.positions) {
                let [along_x, along_y] = geometry::direction(before, end);
                shapes.extend(self.label([end[0] + along_x * half, end[1] + along_y * s]));
            }
        } else {
            let middle = geometry::middle(self.positions);
            shapes.extend(self.label([middle[0], middle[1] - 1.6 * s]));
        }
        shapes
    }

    fn parallels(&self, distance: f64) -> Vec<SymbolShape> {
        [distance, -distance]
            .map(|by| self.stroke(polyline(&geometry::offset(self.positions, by), false)))
            .to_vec()
    }

    /// A row of half circles along the line.
    fn lobes(&self) -> Vec<PathStep> {
        let mut steps = Vec::new();
        let spacing = geometry::spacing(self.positions, 1.2 * self.size);
        for ([x, y], [along_x, along_y]) in geometry::marks(self.positions, spacing) {
            let turn = along_y.atan2(along_x).to_degrees();
            let radius = spacing / 2.0;
            steps.extend(arc([x, y], [radius, radius], turn - 180.0, turn));
        }
        steps
    }

    /// A row of filled triangles along the line or around the area.
    fn teeth(&self, closed: bool) -> SymbolShape {
        let mut positions = self.positions.to_vec();
        if closed {
            positions.push(self.positions[0]);
        }
        let (s, mut steps) = (self.size, Vec::new());
        let spacing = geometry::spacing(&positions, 1.6 * s);
        for ([x, y], [along_x, along_y]) in geometry::marks(&positions, spacing) {
            let at = |along: f64, up: f64| {
                [x + along_x * along + along_y * up, y + along_y * along - along_x * up]
            };
            steps.extend(polyline(&[at(-0.4 * s, 0.0), at(0.0, 0.8 * s), at(0.4 * s, 0.0)], true));
        }
        SymbolShape::filled(steps, PaintRole::Icon)
    }

    fn arrow(&self, style: &str) -> Vec<SymbolShape> {
        let (tip, before) = geometry::tip(self.positions);
        let along = geometry::direction(before, tip);
        let mut shapes = vec![self.stroke(polyline(self.positions, false))];
        let heads: &[f64] = if style == "arrow-main" { &[0.0, 0.5] } else { &[0.0] };
        for back in heads {
            let head = geometry::arrow_head(tip, along, back * self.size, self.size);
            shapes.push(self.stroke(polyline(&head, style == "arrow-main")));
        }
        if style == "arrow-air" {
            shapes.push(self.bow_tie());
        }
        shapes
    }

    /// The mark of aviation in the middle of a line.
    fn bow_tie(&self) -> SymbolShape {
        let ([x, y], s) = (geometry::middle(self.positions), self.size);
        let (half, tall) = (0.9 * s, 0.5 * s);
        let corners = [
            [x - half, y - tall],
            [x + half, y + tall],
            [x + half, y - tall],
            [x - half, y + tall],
        ];
        SymbolShape::filled(polyline(&corners, true), PaintRole::Icon)
    }

    /// A hollow arrow along the line.
    fn axis(&self, style: &str) -> Vec<SymbolShape> {
        let s = self.size;
        let (tip, before) = geometry::tip(self.positions);
        let along = geometry::direction(before, tip);
        let neck = [tip[0] - along[0] * 1.4 * s, tip[1] - along[1] * 1.4 * s];
        let mut body = self.positions.to_vec();
        if let Some(last) = body.last_mut() {
            *last = neck;
        }
        let head = geometry::arrow_head(tip, along, 0.0, 1.4 * s);
        let left = geometry::offset(&body, 0.6 * s);
        let mut outline = left;
        outline.extend([head[0], head[1], head[2]]);
        outline.extend(geometry::offset(&body, -0.6 * s).into_iter().rev());
        let mut shapes = vec![self.stroke(polyline(&outline, false))];
        match style {
            "axis-main" => {
                let inner = geometry::arrow_head(tip, along, 0.9 * s, 1.4 * s * 0.4);
                shapes.push(self.stroke(polyline(&inner, false)));
            }
            "axis-air" => shapes.push(self.bow_tie()),
            _ => {}
        }
        shapes
    }

    fn area(&self, style: &str) -> Vec<SymbolShape> {
        let (s, mut shapes) = (self.size, Vec::new());
        if style.starts_with("hatched") {
            let lines = geometry::hatch(self.positions, 0.9 * s);
            let steps = lines.iter().flat_map(|line| polyline(line, false)).collect();
            let mut hatch = SymbolShape::line(steps, s / 20.0);
            hatch.line = hatch.line.map(|line| ShapeLine { width: s / 20.0, ..line });
            shapes.push(hatch);
        }
        shapes.push(match style {
            "battlement" => {
                self.stroke(polyline(&geometry::battlement(self.positions, 0.7 * s), true))
            }
            "dashed-area" => self.stroke(polyline(self.positions, true)).dashed([s * 0.6, s * 0.4]),
            _ => self.stroke(polyline(self.positions, true)),
        });
        if style == "hatched-teeth" {
            shapes.push(self.teeth(true));
        }
        shapes.extend(self.label(geometry::centroid(self.positions)));
        shapes
    }
}

/// A star of five points.
fn star([x, y]: Position, radius: f64) -> Vec<PathStep> {
    let corner = |index: u8| {
        let reach = if index.is_multiple_of(2) { radius } else { radius * 0.382 };
        let angle = f64::from(index) / 10.0 * TAU - TAU / 4.0;
        [x + reach * angle.cos(), y + reach * angle.sin()]
    };
    polyline(&(0..10).map(corner).collect::<Vec<_>>(), true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_table_is_a_control_measure_that_can_be_drawn() {
        let lines = include_str!("controls.txt")
            .lines()
            .filter(|line| !line.starts_with('#') && !line.trim().is_empty());
        assert_eq!(lines.count(), ControlMeasure::all().len());
        assert!(ControlMeasure::all().len() >= 40);
        for measure in ControlMeasure::all() {
            for planned in [false, true] {
                assert!(!measure.example(planned).is_empty(), "{}", measure.name);
            }
            assert_eq!(ControlMeasure::of_entity(measure.entity), Some(measure));
        }
    }

    #[test]
    fn a_phase_line_carries_its_name_at_both_ends() {
        let line = ControlMeasure::of_entity(140_300).expect("it is in the table");
        let shapes =
            line.draw(&[[0.0, 0.0], [100.0, 0.0]], 4.0, "GREEN", false).expect("it is complete");
        let texts: Vec<_> = shapes.iter().filter_map(|shape| shape.text.as_deref()).collect();
        assert_eq!(texts, ["PL GREEN", "PL GREEN"]);
    }

    #[test]
    fn what_is_incomplete_is_refused_with_the_reason() {
        let area = ControlMeasure::of_entity(150_200).expect("it is in the table");
        let error = area.draw(&[[0.0, 0.0], [1.0, 0.0]], 4.0, "", false).expect_err("two corners");
        assert!(error.to_string().contains("Assembly Area needs 3"), "{error}");
        let corners = [[0.0, 0.0], [f64::NAN, 0.0], [1.0, 1.0]];
        let error = area.draw(&corners, 4.0, "", false).expect_err("no number");
        assert_eq!(error, MeasureError::NotFinite { name: "Assembly Area", index: 1 });
    }

    #[test]
    fn positions_that_coincide_or_are_far_apart_are_drawn_in_bounded_memory() {
        for measure in ControlMeasure::all() {
            for positions in
                [vec![[5.0, 5.0]; 4], vec![[-1e12, 0.0], [1e12, 1e12], [0.0, -1e12], [1.0, 1.0]]]
            {
                let shapes = measure.draw(&positions, 1.0, "X", false).expect(measure.name);
                let steps: usize = shapes.iter().map(|shape| shape.steps.len()).sum();
                assert!(steps < 20_000, "{}: {steps}", measure.name);
                for shape in &shapes {
                    let [low, high] = shape.bounds().unwrap_or_default();
                    let finite = low.iter().chain(&high).all(|value| value.is_finite());
                    assert!(finite, "{}", measure.name);
                }
            }
        }
    }
}
