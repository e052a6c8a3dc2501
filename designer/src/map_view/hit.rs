//! What is at a point of the window: the handles of what is selected, then points, legs, lines and
//! zones, from front to back.

use armor_geo::MapPoint;
use eframe::egui::{Pos2, Rect, Vec2};

use crate::item::Item;
use crate::map_view::camera::Camera;
use crate::map_view::corner::Corner;
use crate::map_view::layers::Layers;
use crate::map_view::scene::{
    MapScene, Outline, SceneItem, SceneShape, between, handles_of, new_corners_of,
};

/// How near the pointer must be to a point, in points of the window.
const POINT_REACH: f32 = 10.0;
/// The same for a line.
const LINE_REACH: f32 = 6.0;
/// How far beneath its point the first stay or meeting is written, and the next ones.
pub const STOP_OFFSET: f32 = 20.0;
/// Size of the octagon of a symbol in the window.
pub const SYMBOL_HEIGHT: f32 = 34.0;
/// Legs are drawn this far to the right of their direction, so that one back is next to it.
const LEG_ASIDE: f32 = 5.0;
/// Where along a leg its number is.
pub const LEG_NUMBER: f32 = 0.4;

/// What can be pointed at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapHit {
    /// An item.
    Item(Item),
    /// A corner of the selected zone or line.
    Corner(Corner),
    /// The middle of one of its sides, where a new corner can be drawn out.
    NewCorner(Corner),
    /// The middle of the selected leg, where a point between can be drawn out.
    NewLeg(Item),
}

/// A handle of what is selected.
#[derive(Clone, Copy, Debug)]
pub struct Handle {
    /// What it does.
    pub hit: MapHit,
    /// Where it is.
    pub at: Pos2,
}

/// The map in the window.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// What is drawn.
    pub scene: &'a MapScene,
    /// Which part.
    pub camera: &'a Camera,
    /// Where in the window.
    pub window: Rect,
    /// What is shown.
    pub layers: &'a Layers,
}

impl Sight<'_> {
    /// Where a position is in the window.
    pub fn at(&self, point: MapPoint) -> Pos2 {
        self.camera.to_window(self.window, point)
    }

    /// The items that are shown, from back to front.
    pub fn items(&self) -> impl DoubleEndedIterator<Item = &SceneItem> {
        let layers = self.layers;
        self.scene.items.iter().filter(move |entry| layers.shows(&entry.shape))
    }

    /// The handles of an item that is selected alone.
    pub fn handles(&self, selected: Option<Item>) -> Vec<Handle> {
        let Some(item) = selected else { return Vec::new() };
        let Some(entry) = self.items().find(|entry| entry.item == item) else {
            return Vec::new();
        };
        let corners = handles_of(&entry.shape).into_iter().enumerate();
        let corners = corners.map(|(number, at)| Handle {
            hit: MapHit::Corner(Corner { item, number }),
            at: self.at(at),
        });
        let new = new_corners_of(&entry.shape).into_iter().map(|(number, at)| Handle {
            hit: MapHit::NewCorner(Corner { item, number }),
            at: self.at(at),
        });
        let middle = match &entry.shape {
            SceneShape::Leg { from: Some(from), to } => {
                Some(Handle { hit: MapHit::NewLeg(item), at: self.at(between(*from, *to, 0.5)) })
            }
            _ => None,
        };
        corners.chain(new).chain(middle).collect()
    }

    /// The items at a point, from front to back.
    pub fn items_at(&self, point: Pos2) -> Vec<Item> {
        let mut found: Vec<(u8, Item)> = Vec::new();
        for entry in self.items().rev() {
            if let Some(depth) = self.depth_at(&entry.shape, point) {
                found.push((depth, entry.item));
            }
        }
        found.sort_by_key(|(depth, _)| *depth);
        found.into_iter().map(|(_, item)| item).collect()
    }

    /// What a press at a point is about.
    pub fn hit(&self, point: Pos2, selected: Option<Item>) -> Option<MapHit> {
        let near = |handle: &&Handle| handle.at.distance(point) <= POINT_REACH;
        let handles = self.handles(selected);
        let handle = handles.iter().filter(near).min_by(|one, other| {
            let distance = |handle: &Handle| handle.at.distance(point);
            distance(one).total_cmp(&distance(other))
        });
        let as_item = || self.items_at(point).first().copied().map(MapHit::Item);
        handle.map(|handle| handle.hit).or_else(as_item)
    }

    /// The point or rally point nearest to a point of the window, if one is near.
    pub fn point_near(
        &self,
        point: Pos2,
        except: &dyn Fn(Item) -> bool,
    ) -> Option<(Item, MapPoint)> {
        let near = self.items().filter_map(|entry| match entry.shape {
            SceneShape::Point(at) | SceneShape::Rally(at) if !except(entry.item) => {
                let distance = self.at(at).distance(point);
                (distance <= POINT_REACH).then_some((distance, entry.item, at))
            }
            _ => None,
        });
        near.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, item, at)| (item, at))
    }

    /// The ends of a leg as it is drawn.
    pub fn leg_ends(&self, from: MapPoint, to: MapPoint) -> [Pos2; 2] {
        let (from, to) = (self.at(from), self.at(to));
        let along = (to - from).normalized();
        // To the right: the window's y axis points down.
        let aside = Vec2::new(-along.y, along.x) * LEG_ASIDE;
        [from + aside, to + aside]
    }

    /// Where an item is named: in its middle, or on its boundary.
    pub fn anchor(&self, shape: &SceneShape) -> Pos2 {
        match shape {
            SceneShape::Point(at) | SceneShape::Rally(at) | SceneShape::Symbol { at, .. } => {
                self.at(*at)
            }
            SceneShape::Stop { at, row } => {
                self.at(*at) + Vec2::new(0.0, STOP_OFFSET * (*row as f32 + 1.0))
            }
            SceneShape::Leg { from: Some(from), to } => {
                let [from, to] = self.leg_ends(*from, *to);
                from + (to - from) * LEG_NUMBER
            }
            SceneShape::Leg { from: None, to } => self.at(*to) - Vec2::new(14.0, 14.0),
            SceneShape::Line { points, .. } => {
                let middle = points.len().saturating_sub(1) / 2;
                let ends = [points.get(middle), points.get(middle + 1)];
                match ends {
                    [Some(one), Some(other)] => self.at(between(*one, *other, 0.5)),
                    [Some(one), _] => self.at(*one),
                    _ => self.window.center(),
                }
            }
            SceneShape::Zone { outline, .. } => inner_point(outline, self),
        }
    }

    /// 0 is in front; none if the shape is not at the point.
    fn depth_at(&self, shape: &SceneShape, point: Pos2) -> Option<u8> {
        let is_near = |at: MapPoint| self.at(at).distance(point) <= POINT_REACH;
        let (depth, is_there) = match shape {
            SceneShape::Point(at) | SceneShape::Rally(at) => (0, is_near(*at)),
            SceneShape::Symbol { at, picture } => {
                let area = picture.as_ref().map(|it| it.area(self.at(*at), SYMBOL_HEIGHT));
                (1, area.is_some_and(|area| area.contains(point)) || is_near(*at))
            }
            SceneShape::Stop { .. } => {
                let area = Rect::from_center_size(self.anchor(shape), Vec2::new(70.0, 18.0));
                (1, area.contains(point))
            }
            SceneShape::Leg { from: Some(from), to } => {
                let [from, to] = self.leg_ends(*from, *to);
                (2, distance_to_segment(point, from, to) <= LINE_REACH)
            }
            SceneShape::Leg { from: None, .. } => {
                (2, self.anchor(shape).distance(point) <= POINT_REACH)
            }
            SceneShape::Line { points, .. } => {
                let points: Vec<_> = points.iter().map(|at| self.at(*at)).collect();
                let mut sides = points.windows(2);
                (3, sides.any(|it| distance_to_segment(point, it[0], it[1]) <= LINE_REACH))
            }
            SceneShape::Zone { outline, .. } => {
                let corners: Vec<_> = outline.corners().into_iter().map(|at| self.at(at)).collect();
                let next = corners.iter().cycle().skip(1);
                let mut sides = corners.iter().zip(next);
                let is_on = sides
                    .any(|(one, other)| distance_to_segment(point, *one, *other) <= LINE_REACH);
                if is_on { (4, true) } else { (5, is_inside(&corners, point)) }
            }
        };
        is_there.then_some(depth)
    }
}

/// A point in a zone: the middle of its corners if it is inside, otherwise near its first corner.
fn inner_point(outline: &Outline, sight: &Sight<'_>) -> Pos2 {
    let corners: Vec<_> = outline.corners().into_iter().map(|at| sight.at(at)).collect();
    let sum = corners.iter().fold(Vec2::ZERO, |sum, corner| sum + corner.to_vec2());
    let middle = (sum / corners.len().max(1) as f32).to_pos2();
    if is_inside(&corners, middle) {
        return middle;
    }
    let count = corners.len();
    let ears = (0..count).map(|n| {
        let [a, b, c] = [0, 1, 2].map(|k| corners[(n + k) % count].to_vec2());
        ((a + b + c) / 3.0).to_pos2()
    });
    ears.into_iter().find(|at| is_inside(&corners, *at)).unwrap_or(middle)
}

/// The distance of a point from a line between two points.
pub fn distance_to_segment(point: Pos2, from: Pos2, to: Pos2) -> f32 {
    let along = to - from;
    let length = along.length_sq();
    let share =
        if length > 0.0 { ((point - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(from + along * share)
}

/// Whether a point is within a polygon, by the crossings to its right.
pub fn is_inside(corners: &[Pos2], point: Pos2) -> bool {
    let next = corners.iter().cycle().skip(1);
    let crosses = |(one, other): (&Pos2, &Pos2)| {
        (one.y > point.y) != (other.y > point.y)
            && point.x < one.x + (point.y - one.y) / (other.y - one.y) * (other.x - one.x)
    };
    corners.iter().zip(next).filter(|sides| crosses(*sides)).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_and_near_are_measured_in_the_window() {
        let corners = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (50.0, 20.0), (0.0, 100.0)];
        let corners = corners.map(|(x, y)| Pos2::new(x, y));
        for (x, y, expected) in
            [(10.0, 10.0, true), (50.0, 60.0, false), (-1.0, 5.0, false), (90.0, 70.0, true)]
        {
            assert_eq!(is_inside(&corners, Pos2::new(x, y)), expected, "{x} {y}");
        }
        let at = |x, y| distance_to_segment(Pos2::new(x, y), corners[0], corners[1]);
        assert_eq!((at(50.0, 7.0), at(-3.0, 4.0), at(103.0, 4.0)), (7.0, 5.0, 5.0));
    }
}
