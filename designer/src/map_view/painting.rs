//! The map as shapes of the window. What a colour means, a form or a word repeats.

use std::sync::Arc;

use armor_picture::theme::{self, ThemeColours};
use armor_robotfile::site_map::{LineKind, ZoneKind};
use eframe::egui::{
    Align2, Color32, FontId, Galley, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Vec2,
};

use crate::canvas::{Mark, paintable};
use crate::item::Item;
use crate::map_view::camera::Camera;
use crate::map_view::hatching::{hatch, inward_ticks, ticks};
use crate::map_view::hit::{LEG_NUMBER, MapHit, SYMBOL_HEIGHT, Sight};
use crate::map_view::layers::Layer;
use crate::map_view::leg_labels::{leg_line, meets, places_beside};
use crate::map_view::mesh_batch::MeshBatch;
use crate::map_view::scene::{SceneItem, SceneShape};

/// Distance of the lines of a no-go zone and of a zone with a speed.
const HATCH: f32 = 9.0;
const SPARSE_HATCH: f32 = 16.0;
/// Distance and length of ticks.
const TICKS: (f32, f32) = (12.0, 6.0);
/// Radius of a point, and half the side of a handle.
const POINT_RADIUS: f32 = 5.0;
const HANDLE: f32 = 4.0;

/// With more legs than this, their lines are not kept free of texts.
const MAX_LINES: usize = 200;

/// What is to be seen of the items besides their shapes.
pub struct Looks<'a> {
    /// Whether an item is selected.
    pub is_selected: &'a dyn Fn(Item) -> bool,
    /// What is selected alone, whose handles are shown.
    pub only: Option<Item>,
    /// What the pointer is at.
    pub hovered: Option<MapHit>,
    /// The corner that the keyboard acts on.
    pub corner: Option<MapHit>,
    /// Whether lines stay lines, for a file of them.
    pub keeps_lines: bool,
    /// The colours of the theme.
    pub colours: &'a ThemeColours,
}

/// Paints lines of a lattice whose distance is a round number of metres.
pub fn paint_lattice(painter: &Painter, camera: &Camera, window: Rect, colours: &ThemeColours) {
    let step_m = camera.snap_step_m() * 10.0;
    let shown = camera.shown(window);
    let stroke = Stroke::new(1.0, colours.grid);
    for axis in 0..2 {
        let (low, high) = (shown.low_m()[axis], shown.high_m()[axis]);
        for number in (low / step_m).ceil() as i64..=(high / step_m).floor() as i64 {
            let mut at = [0.0; 2];
            at[axis] = number as f64 * step_m;
            let at = camera.offset_to_window(window, at);
            match axis {
                0 => painter.vline(at.x, window.y_range(), stroke),
                _ => painter.hline(window.x_range(), at.y, stroke),
            };
        }
    }
}

/// Paints everything that is drawn.
pub fn paint_scene(painter: &Painter, sight: &Sight<'_>, looks: &Looks<'_>) {
    let near = sight.camera.shown(sight.window).expand_m(60.0 / sight.camera.scale());
    let mut batch = MeshBatch::new(painter, looks.keeps_lines);
    if sight.layers.is_shown(Layer::Exits) {
        add_exits(&mut batch, sight, looks);
    }
    let is_near =
        |entry: &&SceneItem| entry.shape.bounds().is_some_and(|bounds| bounds.meets(&near));
    let shown: Vec<_> = sight.items().filter(is_near).collect();
    for entry in &shown {
        paint_shape(painter, sight, looks, entry, &mut batch);
    }
    batch.paint(painter);
    let mut taken = TakenSpace::of(sight.window);
    // No text covers the sign of a point, nor, if there is another place, the line of another leg.
    let signs = shown
        .iter()
        .filter(|entry| matches!(entry.shape, SceneShape::Point(_) | SceneShape::Rally(_)));
    for at in signs.flat_map(|entry| entry.shape.points()) {
        taken.take(Rect::from_center_size(sight.at(at), Vec2::splat(2.0 * POINT_RADIUS)));
    }
    let legs: Vec<_> = shown.iter().filter_map(|entry| leg_line(sight, entry)).collect();
    let legs = if legs.len() > MAX_LINES { &[][..] } else { &legs };
    // What is in front, and what is selected, gets its text first.
    let (selected, others): (Vec<&SceneItem>, Vec<&SceneItem>) =
        shown.iter().rev().copied().partition(|entry| (looks.is_selected)(entry.item));
    for entry in selected.into_iter().chain(others) {
        paint_text(painter, sight, looks, entry, legs, &mut taken);
    }
    for handle in sight.handles(looks.only) {
        let is_hot = looks.hovered == Some(handle.hit) || looks.corner == Some(handle.hit);
        let half = if is_hot { HANDLE + 2.0 } else { HANDLE };
        let area = Rect::from_center_size(handle.at, Vec2::splat(2.0 * half));
        let stroke = Stroke::new(1.5, looks.colours.accent);
        match handle.hit {
            MapHit::Corner(_) | MapHit::Item(_) => {
                let fill = if is_hot { looks.colours.accent } else { looks.colours.background };
                painter.rect(area, 0.0, fill, stroke, StrokeKind::Middle);
            }
            MapHit::NewCorner(_) | MapHit::NewLeg(_) => {
                painter.circle(handle.at, half, looks.colours.background, stroke);
                let arm = half - 1.5;
                painter.hline(handle.at.x - arm..=handle.at.x + arm, handle.at.y, stroke);
                painter.vline(handle.at.x, handle.at.y - arm..=handle.at.y + arm, stroke);
            }
        }
    }
}

fn paint_shape(
    painter: &Painter,
    sight: &Sight<'_>,
    looks: &Looks<'_>,
    entry: &SceneItem,
    batch: &mut MeshBatch,
) {
    let is_selected = (looks.is_selected)(entry.item);
    let is_hot = looks.hovered == Some(MapHit::Item(entry.item));
    let colour = colour_of(entry, looks);
    let width = 1.5 + if is_selected { 1.5 } else { 0.0 } + if is_hot { 1.0 } else { 0.0 };
    let stroke = Stroke::new(width, colour);
    match &entry.shape {
        SceneShape::Zone { kind, outline } => {
            let corners: Vec<_> = outline.corners().into_iter().map(|at| sight.at(at)).collect();
            add_zone(batch, sight.window, *kind, &corners, stroke, looks.colours);
        }
        SceneShape::Line { kind, points } => {
            let points: Vec<_> = points.iter().map(|at| sight.at(*at)).collect();
            add_line(batch, sight.window, *kind, &points, stroke, looks.colours);
        }
        SceneShape::Leg { from: Some(from), to } => {
            let [from, to] = sight.leg_ends(*from, *to);
            let halo = Stroke::new(width + 3.0, looks.colours.background);
            batch.add_shape(Shape::line_segment([from, to], halo), 1.0);
            batch.add_shape(Shape::line_segment([from, to], stroke), 1.0);
            add_arrow(batch, from, to, stroke);
        }
        SceneShape::Leg { from: None, .. } | SceneShape::Stop { .. } => {}
        SceneShape::Point(at) => {
            let at = sight.at(*at);
            let fill = if is_selected { colour } else { looks.colours.background };
            let size = POINT_RADIUS + if is_hot { 1.5 } else { 0.0 };
            batch.paint(painter);
            painter.circle(at, size, fill, stroke);
            painter.circle_filled(at, 1.5, if is_selected { fill } else { colour });
        }
        SceneShape::Rally(at) => {
            let at = sight.at(*at);
            let size = POINT_RADIUS + 3.0 + if is_hot { 1.5 } else { 0.0 };
            let corners = [(0.0, -1.0), (0.87, 0.5), (-0.87, 0.5)];
            let corners = corners.map(|(x, y)| at + Vec2::new(x, y) * size).to_vec();
            let fill = if is_selected { colour } else { looks.colours.background };
            batch.add_shape(Shape::convex_polygon(corners, fill, stroke), 1.0);
        }
        SceneShape::Symbol { at, picture } => {
            let at = sight.at(*at);
            let area = match picture {
                Some(picture) => {
                    batch.add_symbol(picture, at, SYMBOL_HEIGHT, 1.0);
                    picture.area(at, SYMBOL_HEIGHT)
                }
                None => {
                    let area = Rect::from_center_size(at, Vec2::splat(SYMBOL_HEIGHT * 0.6));
                    let frame = Shape::rect_stroke(area, 0.0, stroke, StrokeKind::Middle);
                    batch.add_shape(frame, 1.0);
                    area
                }
            };
            if is_selected || is_hot {
                let area = area.expand(3.0);
                let frame = Shape::rect_stroke(area, 2.0, stroke, StrokeKind::Outside);
                batch.add_shape(frame, 1.0);
            }
        }
    }
}

fn add_zone(
    batch: &mut MeshBatch,
    window: Rect,
    kind: ZoneKind,
    corners: &[Pos2],
    stroke: Stroke,
    colours: &ThemeColours,
) {
    let shown = window.expand(20.0);
    let thin = Stroke::new(1.0, stroke.color.gamma_multiply(0.6));
    let closed: Vec<_> = corners.iter().chain(corners.first()).copied().collect();
    let lines = match kind {
        ZoneKind::NoGo => hatch(corners, shown, Vec2::new(0.8, -0.6), HATCH),
        ZoneKind::Speed => hatch(corners, shown, Vec2::new(1.0, 0.0), SPARSE_HATCH),
        ZoneKind::StayIn => inward_ticks(corners, shown, TICKS.0, TICKS.1),
        ZoneKind::Observe => Vec::new(),
    };
    batch.add_shapes(lines.into_iter().map(|line| Shape::line_segment(line, thin)));
    let halo = Stroke::new(stroke.width + 3.0, colours.background);
    batch.add_shape(Shape::line(closed.clone(), halo), 1.0);
    match kind {
        ZoneKind::Observe => batch.add_shapes(Shape::dashed_line(&closed, stroke, 8.0, 5.0)),
        _ => batch.add_shape(Shape::line(closed, stroke), 1.0),
    }
}

fn add_line(
    batch: &mut MeshBatch,
    window: Rect,
    kind: LineKind,
    points: &[Pos2],
    stroke: Stroke,
    colours: &ThemeColours,
) {
    let halo = Stroke::new(stroke.width + 3.0, colours.background);
    batch.add_shape(Shape::line(points.to_vec(), halo), 1.0);
    match kind {
        LineKind::Phase => batch.add_shape(Shape::line(points.to_vec(), stroke), 1.0),
        LineKind::Boundary => batch.add_shapes(Shape::dashed_line(points, stroke, 14.0, 5.0)),
        LineKind::Limit => {
            batch.add_shape(Shape::line(points.to_vec(), stroke), 1.0);
            for side in points.windows(2) {
                let lines = ticks([side[0], side[1]], window.expand(20.0), TICKS.0, TICKS.1);
                batch.add_shapes(lines.into_iter().map(|line| Shape::line_segment(line, stroke)));
            }
        }
    }
}

/// An arrow head at three quarters of the way, so that it is not under the point.
fn add_arrow(batch: &mut MeshBatch, from: Pos2, to: Pos2, stroke: Stroke) {
    let along = to - from;
    if along.length() < 24.0 {
        return;
    }
    let direction = along.normalized();
    let tip = from + along * 0.75 + direction * 5.0;
    let side = Vec2::new(-direction.y, direction.x) * 5.0;
    let corners = vec![tip, tip - direction * 10.0 + side, tip - direction * 10.0 - side];
    batch.add_shape(Shape::convex_polygon(corners, stroke.color, Stroke::NONE), 1.0);
}

fn add_exits(batch: &mut MeshBatch, sight: &Sight<'_>, looks: &Looks<'_>) {
    for exit in &sight.scene.exits {
        let is_selected = (looks.is_selected)(exit.of);
        let colour = if is_selected { looks.colours.accent } else { looks.colours.weak };
        let stroke = Stroke::new(if is_selected { 2.0 } else { 1.0 }, colour);
        let points: Vec<Pos2> = exit.points.iter().map(|point| sight.at(*point)).collect();
        if sight.window.intersects(Rect::from_points(&points).expand(1.0)) {
            for piece in points.windows(2) {
                batch.add_dashes([piece[0], piece[1]], stroke, 3.0, 4.0);
            }
        }
    }
}

/// Its name on a plate, with the sign of its finding; left out where other texts are.
fn paint_text(
    painter: &Painter,
    sight: &Sight<'_>,
    looks: &Looks<'_>,
    entry: &SceneItem,
    legs: &[(Item, [Pos2; 2])],
    taken: &mut TakenSpace,
) {
    let sign = match entry.mark {
        Mark::Error => "x ",
        Mark::Warning => "! ",
        Mark::None => "",
    };
    if entry.text.is_empty() && sign.is_empty() {
        return;
    }
    let is_selected = (looks.is_selected)(entry.item);
    let is_wanted = is_selected || looks.hovered == Some(MapHit::Item(entry.item));
    let places = match &entry.shape {
        // On the leg itself, or where that would cover another leg, at its outer side.
        SceneShape::Leg { from: Some(from), to } => {
            let [from, to] = sight.leg_ends(*from, *to);
            let shares = [LEG_NUMBER, 0.2, 0.6, 0.85, 0.45, 0.3, 0.7, 0.1];
            let on_leg = shares.map(|share| (Align2::CENTER_CENTER, from + (to - from) * share));
            on_leg.into_iter().chain(places_beside(from, to)).collect()
        }
        shape => text_places(shape, sight.anchor(shape)),
    };
    // Before the text is laid out: of a thousand most have no room.
    let may_be = |(align, at): &(Align2, Pos2)| {
        let first = align.anchor_size(*at, Vec2::new(16.0, 8.0));
        taken.is_free(first)
    };
    let places: Vec<_> = places.into_iter().filter(|place| is_wanted || may_be(place)).collect();
    if places.is_empty() {
        return;
    }
    let colour = if entry.mark == Mark::None && !is_selected {
        looks.colours.text
    } else {
        colour_of(entry, looks)
    };
    let text = format!("{sign}{}", paintable(painter.ctx(), &entry.text));
    let galley = painter.layout_no_wrap(text, FontId::proportional(theme::SMALL), colour);
    let plates = places
        .into_iter()
        .map(|(align, at)| align.anchor_size(at, galley.size()).expand2(Vec2::new(3.0, 1.0)));
    let first = plates.clone().next().filter(|_| is_wanted);
    let of_others =
        |plate: &Rect| legs.iter().any(|(item, line)| *item != entry.item && meets(*plate, *line));
    let mut free = plates.filter(|plate| taken.is_free(*plate));
    let clear = free.clone().find(|plate| !of_others(plate));
    let Some(plate) = clear.or_else(|| free.next()).or(first) else { return };
    taken.take(plate);
    paint_plate(painter, plate, galley, looks.colours);
}

/// Where the text of a shape may be, the best place first.
fn text_places(shape: &SceneShape, anchor: Pos2) -> Vec<(Align2, Pos2)> {
    match shape {
        SceneShape::Point(_) | SceneShape::Rally(_) => vec![
            (Align2::LEFT_CENTER, anchor + Vec2::new(11.0, -9.0)),
            (Align2::RIGHT_CENTER, anchor + Vec2::new(-11.0, -9.0)),
            (Align2::LEFT_CENTER, anchor + Vec2::new(11.0, 11.0)),
            (Align2::RIGHT_CENTER, anchor + Vec2::new(-11.0, 11.0)),
            (Align2::CENTER_CENTER, anchor + Vec2::new(0.0, -20.0)),
        ],
        SceneShape::Symbol { picture, .. } => {
            let area = picture.as_ref().map(|picture| picture.area(anchor, SYMBOL_HEIGHT));
            let right = area.map_or(anchor.x + 12.0, |area| area.right());
            vec![(Align2::LEFT_CENTER, Pos2::new(right + 4.0, anchor.y))]
        }
        _ => vec![
            (Align2::CENTER_CENTER, anchor),
            (Align2::CENTER_CENTER, anchor + Vec2::new(0.0, 18.0)),
            (Align2::CENTER_CENTER, anchor - Vec2::new(0.0, 18.0)),
        ],
    }
}

/// Where texts are already, in cells: with a thousand texts each would otherwise be compared with
/// all others.
struct TakenSpace {
    window: Rect,
    columns: usize,
    cells: Vec<bool>,
}

impl TakenSpace {
    const CELL: Vec2 = Vec2::new(8.0, 6.0);

    fn of(window: Rect) -> Self {
        let count = (window.size().max(Vec2::ZERO) / Self::CELL).ceil();
        let (columns, rows) = (count.x as usize + 1, count.y as usize + 1);
        Self { window, columns, cells: vec![false; columns * rows] }
    }

    fn numbers(&self, plate: Rect) -> impl Iterator<Item = usize> + use<> {
        let plate = plate.intersect(self.window);
        let low = (plate.min - self.window.min) / Self::CELL;
        let high = (plate.max - self.window.min) / Self::CELL;
        let (columns, is_shown) = (self.columns, plate.is_positive());
        let rows = low.y.max(0.0) as usize..=high.y.max(0.0) as usize;
        let rows = rows.filter(move |_| is_shown);
        rows.flat_map(move |row| {
            let of_row = low.x.max(0.0) as usize..=high.x.max(0.0) as usize;
            of_row.map(move |column| row * columns + column)
        })
    }

    fn is_free(&self, plate: Rect) -> bool {
        self.numbers(plate).all(|cell| self.cells.get(cell) == Some(&false))
    }

    fn take(&mut self, plate: Rect) {
        for cell in self.numbers(plate) {
            if let Some(cell) = self.cells.get_mut(cell) {
                *cell = true;
            }
        }
    }
}

/// A text with its background.
pub fn paint_plate(painter: &Painter, plate: Rect, galley: Arc<Galley>, colours: &ThemeColours) {
    painter.rect_filled(plate, 3.0, colours.background.gamma_multiply(0.85));
    painter.galley(plate.center() - galley.size() / 2.0, galley, colours.text);
}

/// A text on a plate; returns where it is.
pub fn paint_note(
    painter: &Painter,
    at: Pos2,
    align: Align2,
    text: &str,
    colours: &ThemeColours,
) -> Rect {
    let font = FontId::proportional(theme::SMALL);
    let galley = painter.layout_no_wrap(text.to_owned(), font, colours.text);
    let plate = align.anchor_size(at, galley.size()).expand2(Vec2::new(4.0, 2.0));
    paint_plate(painter, plate, galley, colours);
    plate
}

/// The scale bar: a round length of the map.
pub fn paint_scale_bar(painter: &Painter, camera: &Camera, window: Rect, colours: &ThemeColours) {
    let (length_m, length) = camera.scale_bar();
    let left = window.left_bottom() + Vec2::new(14.0, -14.0);
    let right = left + Vec2::new(length, 0.0);
    let area = Rect::from_two_pos(left, right).expand2(Vec2::new(6.0, 8.0));
    painter.rect_filled(area, 3.0, colours.background.gamma_multiply(0.85));
    let stroke = Stroke::new(2.0, colours.text);
    painter.line_segment([left, right], stroke);
    for end in [left, right] {
        painter.line_segment([end - Vec2::new(0.0, 5.0), end + Vec2::new(0.0, 5.0)], stroke);
    }
    let middle = left + Vec2::new(length / 2.0, -16.0);
    paint_note(painter, middle, Align2::CENTER_CENTER, &length_text(length_m), colours);
}

/// A length for people: `0.5 m`, `120 m`, `2.4 km`.
pub fn length_text(length_m: f64) -> String {
    match length_m {
        length_m if length_m >= 1_000.0 => {
            let text = format!("{:.3}", length_m / 1_000.0);
            format!("{} km", text.trim_end_matches('0').trim_end_matches('.'))
        }
        length_m if length_m >= 10.0 => {
            let text = format!("{length_m:.1}");
            format!("{} m", text.trim_end_matches('0').trim_end_matches('.'))
        }
        length_m => {
            let text = format!("{length_m:.3}");
            format!("{} m", text.trim_end_matches('0').trim_end_matches('.'))
        }
    }
}

fn colour_of(entry: &SceneItem, looks: &Looks<'_>) -> Color32 {
    let colours = looks.colours;
    match (entry.mark, &entry.shape) {
        (Mark::Error, _) => colours.error,
        (Mark::Warning, _) => colours.warning,
        (_, _) if (looks.is_selected)(entry.item) => colours.accent,
        (_, SceneShape::Zone { kind: ZoneKind::NoGo, .. }) => colours.error,
        (_, SceneShape::Zone { kind: ZoneKind::Speed, .. }) => colours.warning,
        (_, SceneShape::Zone { kind: ZoneKind::StayIn, .. }) => colours.good,
        (_, SceneShape::Zone { kind: ZoneKind::Observe, .. }) => colours.weak,
        (_, SceneShape::Leg { .. } | SceneShape::Stop { .. }) => colours.accent,
        (_, SceneShape::Rally(_)) => colours.good,
        (_, SceneShape::Line { .. } | SceneShape::Point(_) | SceneShape::Symbol { .. }) => {
            colours.text
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_short() {
        for (length_m, expected) in [
            (0.05, "0.05 m"),
            (2.0, "2 m"),
            (3.606, "3.606 m"),
            (12.34, "12.3 m"),
            (500.0, "500 m"),
            (2_400.0, "2.4 km"),
        ] {
            assert_eq!(length_text(length_m), expected);
        }
    }
}
