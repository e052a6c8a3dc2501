//! Small drawn signs for buttons, always next to a text. They are lines and areas of the painter, so
//! that they need no font and are sharp at every scale.

use egui::{Atom, Color32, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Vec2, pos2, vec2};

/// Side of a sign next to a text of the body's size, in points.
const SIDE: f32 = 14.0;
/// Width of its lines, as a share of its side.
const LINE: f32 = 0.1;

/// A sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Icon {
    /// A disk: save.
    Save,
    /// An arrow that turns back.
    Undo,
    /// An arrow that turns on.
    Redo,
    /// A plus: add.
    Add,
    /// Blocks in columns: arrange.
    Arrange,
    /// A frame around two blocks.
    Group,
    /// A sheet of paper.
    Note,
    /// Four corners: all of the drawing.
    Fit,
    /// A magnifying glass.
    Find,
    /// A triangle: run, play.
    Run,
    /// A square: stop.
    Stop,
    /// Two bars: pause.
    Pause,
    /// Two linked blocks.
    System,
    /// Two places with a transition.
    Mission,
    /// A pin on a folded sheet: the map.
    Map,
    /// A pulse: what runs.
    Live,
    /// A sheet with an arrow: open.
    Open,
    /// A question mark in a circle: help.
    Help,
    /// A triangle with an exclamation mark.
    Alert,
    /// A sun: the light theme.
    Sun,
    /// A moon: the dark theme.
    Moon,
}

/// All signs.
pub const ICONS: [Icon; 21] = [
    Icon::Save,
    Icon::Undo,
    Icon::Redo,
    Icon::Add,
    Icon::Arrange,
    Icon::Group,
    Icon::Note,
    Icon::Fit,
    Icon::Find,
    Icon::Run,
    Icon::Stop,
    Icon::Pause,
    Icon::System,
    Icon::Mission,
    Icon::Map,
    Icon::Live,
    Icon::Open,
    Icon::Help,
    Icon::Alert,
    Icon::Sun,
    Icon::Moon,
];

impl Icon {
    /// Returns the sign as a part of a button, in the colour of the button's text:
    /// `Button::new((Icon::Save.to_atom(), "Save"))`.
    pub fn to_atom<'a>(self) -> Atom<'a> {
        Atom::paint(Vec2::splat(SIDE), move |ui, place| {
            paint_icon(ui.painter(), place.rect, self, place.fallback_text_color);
        })
    }

    /// The same in a colour of its own, as the text of a main button has.
    pub fn to_coloured_atom<'a>(self, colour: Color32) -> Atom<'a> {
        Atom::paint(Vec2::splat(SIDE), move |ui, place| {
            paint_icon(ui.painter(), place.rect, self, colour);
        })
    }
}

/// Paints a sign into the middle of a rectangle.
pub fn paint_icon(painter: &Painter, rect: Rect, icon: Icon, colour: Color32) {
    let side = rect.size().min_elem();
    let place = Rect::from_center_size(rect.center(), Vec2::splat(side));
    painter.extend(draw_icon(Pen { place, colour }, icon));
}

/// Draws in a square of 1 × 1.
#[derive(Clone, Copy)]
struct Pen {
    place: Rect,
    colour: Color32,
}

impl Pen {
    fn at(&self, x: f32, y: f32) -> Pos2 {
        self.place.min + vec2(x, y) * self.place.width()
    }

    fn stroke(&self) -> Stroke {
        Stroke::new((LINE * self.place.width()).max(1.0), self.colour)
    }

    fn line<const N: usize>(&self, points: [(f32, f32); N]) -> Shape {
        let points = points.map(|(x, y)| self.at(x, y)).to_vec();
        Shape::line(points, self.stroke())
    }

    fn area<const N: usize>(&self, points: [(f32, f32); N]) -> Shape {
        let points = points.map(|(x, y)| self.at(x, y)).to_vec();
        Shape::convex_polygon(points, self.colour, Stroke::NONE)
    }

    fn frame(&self, min: (f32, f32), max: (f32, f32)) -> Shape {
        let rect = Rect::from_min_max(self.at(min.0, min.1), self.at(max.0, max.1));
        Shape::rect_stroke(rect, 1.0, self.stroke(), StrokeKind::Inside)
    }

    fn fill(&self, min: (f32, f32), max: (f32, f32)) -> Shape {
        let rect = Rect::from_min_max(self.at(min.0, min.1), self.at(max.0, max.1));
        Shape::rect_filled(rect, 0.5, self.colour)
    }

    fn circle(&self, x: f32, y: f32, radius: f32) -> Shape {
        Shape::circle_stroke(self.at(x, y), radius * self.place.width(), self.stroke())
    }

    fn dot(&self, x: f32, y: f32, radius: f32) -> Shape {
        Shape::circle_filled(self.at(x, y), radius * self.place.width(), self.colour)
    }

    /// A part of a circle, from one angle to another, in turns clockwise from the right.
    fn arc(&self, (x, y): (f32, f32), radius: f32, from: f32, to: f32) -> Shape {
        const PIECES: u8 = 16;
        let points = (0..=PIECES).map(|n| {
            let share = f32::from(n) / f32::from(PIECES);
            let angle = std::f32::consts::TAU * (from + (to - from) * share);
            self.at(x + radius * angle.cos(), y + radius * angle.sin())
        });
        Shape::line(points.collect(), self.stroke())
    }

    /// The same drawing, with left and right exchanged.
    fn mirror(&self, shapes: Vec<Shape>) -> Vec<Shape> {
        let middle = self.place.center().x;
        let turn = |at: &mut Pos2| *at = pos2(2.0 * middle - at.x, at.y);
        let mirrored = shapes.into_iter().map(|mut shape| {
            if let Shape::Path(path) = &mut shape {
                path.points.iter_mut().for_each(turn);
            }
            shape
        });
        mirrored.collect()
    }
}

fn draw_icon(pen: Pen, icon: Icon) -> Vec<Shape> {
    match icon {
        Icon::Save => vec![
            pen.line([(0.1, 0.1), (0.7, 0.1), (0.9, 0.3), (0.9, 0.9), (0.1, 0.9), (0.1, 0.1)]),
            pen.fill((0.28, 0.1), (0.62, 0.36)),
            pen.frame((0.26, 0.56), (0.74, 0.9)),
        ],
        Icon::Undo => vec![
            pen.arc((0.54, 0.58), 0.3, -0.42, 0.3),
            pen.area([(0.06, 0.42), (0.46, 0.2), (0.42, 0.62)]),
        ],
        Icon::Redo => pen.mirror(draw_icon(pen, Icon::Undo)),
        Icon::Add => {
            vec![pen.line([(0.5, 0.12), (0.5, 0.88)]), pen.line([(0.12, 0.5), (0.88, 0.5)])]
        }
        Icon::Arrange => vec![
            pen.fill((0.08, 0.12), (0.4, 0.42)),
            pen.fill((0.08, 0.58), (0.4, 0.88)),
            pen.fill((0.6, 0.35), (0.92, 0.65)),
            pen.line([(0.4, 0.27), (0.5, 0.27), (0.5, 0.73), (0.4, 0.73)]),
            pen.line([(0.5, 0.5), (0.6, 0.5)]),
        ],
        Icon::Group => vec![
            pen.frame((0.04, 0.08), (0.96, 0.92)),
            pen.fill((0.2, 0.26), (0.5, 0.5)),
            pen.fill((0.5, 0.54), (0.8, 0.78)),
        ],
        Icon::Note => vec![
            pen.frame((0.14, 0.06), (0.86, 0.94)),
            pen.line([(0.3, 0.32), (0.7, 0.32)]),
            pen.line([(0.3, 0.5), (0.7, 0.5)]),
            pen.line([(0.3, 0.68), (0.55, 0.68)]),
        ],
        Icon::Fit => {
            let corner = [(0.1, 0.36), (0.1, 0.1), (0.36, 0.1)];
            let other = |(x, y): (f32, f32)| (x, 1.0 - y);
            let half = vec![pen.line(corner), pen.line(corner.map(other))];
            let right = pen.mirror(half.clone());
            half.into_iter().chain(right).chain([pen.dot(0.5, 0.5, 0.12)]).collect()
        }
        Icon::Find => vec![pen.circle(0.42, 0.42, 0.3), pen.line([(0.64, 0.64), (0.92, 0.92)])],
        Icon::Run => vec![pen.area([(0.2, 0.08), (0.9, 0.5), (0.2, 0.92)])],
        Icon::Stop => vec![pen.fill((0.16, 0.16), (0.84, 0.84))],
        Icon::Pause => {
            vec![pen.fill((0.18, 0.12), (0.4, 0.88)), pen.fill((0.6, 0.12), (0.82, 0.88))]
        }
        Icon::System => vec![
            pen.frame((0.04, 0.08), (0.42, 0.46)),
            pen.frame((0.58, 0.54), (0.96, 0.92)),
            pen.line([(0.42, 0.27), (0.77, 0.27), (0.77, 0.54)]),
        ],
        Icon::Mission => vec![
            pen.circle(0.2, 0.5, 0.16),
            pen.circle(0.82, 0.5, 0.14),
            pen.fill((0.46, 0.18), (0.57, 0.82)),
            pen.line([(0.36, 0.5), (0.68, 0.5)]),
        ],
        Icon::Map => vec![
            pen.circle(0.5, 0.34, 0.22),
            pen.dot(0.5, 0.34, 0.08),
            pen.line([(0.31, 0.46), (0.5, 0.84), (0.69, 0.46)]),
            pen.line([
                (0.3, 0.66),
                (0.06, 0.76),
                (0.06, 0.96),
                (0.94, 0.96),
                (0.94, 0.76),
                (0.7, 0.66),
            ]),
        ],
        Icon::Live => vec![pen.line([
            (0.02, 0.55),
            (0.26, 0.55),
            (0.4, 0.14),
            (0.58, 0.9),
            (0.72, 0.55),
            (0.98, 0.55),
        ])],
        Icon::Open => vec![
            pen.line([(0.08, 0.85), (0.08, 0.2), (0.4, 0.2), (0.5, 0.34), (0.88, 0.34)]),
            pen.line([(0.08, 0.85), (0.26, 0.5), (0.98, 0.5), (0.82, 0.85), (0.08, 0.85)]),
        ],
        Icon::Help => vec![
            pen.circle(0.5, 0.5, 0.44),
            pen.arc((0.5, 0.4), 0.14, -0.5, 0.12),
            pen.line([(0.58, 0.49), (0.5, 0.58), (0.5, 0.64)]),
            pen.dot(0.5, 0.76, 0.06),
        ],
        Icon::Alert => vec![
            pen.line([(0.5, 0.08), (0.95, 0.9), (0.05, 0.9), (0.5, 0.08)]),
            pen.line([(0.5, 0.36), (0.5, 0.62)]),
            pen.dot(0.5, 0.76, 0.06),
        ],
        Icon::Sun => {
            let rays = (0..8_u8).map(|n| {
                let angle = std::f32::consts::TAU * f32::from(n) / 8.0;
                let (x, y) = (angle.cos(), angle.sin());
                pen.line([(0.5 + 0.34 * x, 0.5 + 0.34 * y), (0.5 + 0.47 * x, 0.5 + 0.47 * y)])
            });
            rays.chain([pen.dot(0.5, 0.5, 0.22)]).collect()
        }
        Icon::Moon => {
            vec![pen.arc((0.46, 0.5), 0.4, 0.12, 0.88), pen.arc((0.7, 0.5), 0.28, 0.27, 0.73)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_icon_is_within_its_place_and_differs_from_all_others() {
        let place = Rect::from_min_size(pos2(10.0, 20.0), Vec2::splat(100.0));
        let mut drawn = Vec::new();
        for icon in ICONS {
            let shapes = draw_icon(Pen { place, colour: Color32::WHITE }, icon);
            let bounds = shapes.iter().map(Shape::visual_bounding_rect);
            let bounds = bounds.reduce(Rect::union).unwrap_or(Rect::NOTHING);
            assert!(place.expand(8.0).contains_rect(bounds), "{icon:?}: {bounds:?}");
            assert!(bounds.width() > 40.0 && bounds.height() > 40.0, "{icon:?}: {bounds:?}");
            assert!(!drawn.contains(&shapes), "{icon:?} looks like another one");
            drawn.push(shapes);
        }
    }
}
