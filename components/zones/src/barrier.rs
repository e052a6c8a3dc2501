//! A border that no robot may cross.

use armor_grid::Point2;

use crate::outline::Outline;

/// What closes a part of the map: one no-go zone, or all stay-in zones together.
#[derive(Clone, Debug, PartialEq)]
pub struct Barrier {
    name: String,
    sides: BarrierSides,
}

/// Which side of which outlines is closed, with the margin to keep from each.
#[derive(Clone, Debug, PartialEq)]
enum BarrierSides {
    /// The inside.
    NoGo(Outline, f64),
    /// What is outside of all of them.
    StayIn(Vec<(Outline, f64)>),
}

impl Barrier {
    pub(crate) fn no_go(name: &str, outline: Outline, margin_m: f64) -> Self {
        Self { name: name.to_owned(), sides: BarrierSides::NoGo(outline, margin_m) }
    }

    /// The names of several are joined by "or": a robot must be in one of them.
    pub(crate) fn stay_in(names: &[&str], outlines: Vec<(Outline, f64)>) -> Self {
        Self { name: names.join(" or "), sides: BarrierSides::StayIn(outlines) }
    }

    /// Returns the zone's name, or the names of those that must not be left.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns whether it is the border of zones that must not be left.
    pub fn is_stay_in(&self) -> bool {
        matches!(self.sides, BarrierSides::StayIn(_))
    }

    /// Returns the room that is left at a point, in metres: the distance from the closed part minus
    /// the margin; negative within the margin and in the closed part.
    ///
    /// It changes by at most a metre per metre. Where two stay-in zones overlap, it is the larger of
    /// both rooms: a robot gets from one to the other if they overlap by twice its radius and margin.
    pub fn room_m(&self, point: Point2) -> f64 {
        match &self.sides {
            BarrierSides::NoGo(outline, margin_m) => outline.signed_distance_m(point) - margin_m,
            BarrierSides::StayIn(outlines) => {
                widest(outlines, point).map_or(f64::INFINITY, |(_, room_m)| room_m)
            }
        }
    }

    /// Returns the direction in which the room grows fastest, of length 1.
    pub fn outward(&self, point: Point2) -> (f64, f64) {
        match &self.sides {
            BarrierSides::NoGo(outline, _) => outline.outward(point),
            BarrierSides::StayIn(outlines) => {
                let outward = widest(outlines, point).map(|(outline, _)| outline.outward(point));
                outward.map_or((1.0, 0.0), |(x, y)| (-x, -y))
            }
        }
    }
}

/// The stay-in zone with the most room at a point, and the room.
fn widest(outlines: &[(Outline, f64)], point: Point2) -> Option<(&Outline, f64)> {
    let room = |(outline, margin_m): &(Outline, f64)| -outline.signed_distance_m(point) - margin_m;
    outlines.iter().map(|it| (&it.0, room(it))).max_by(|a, b| a.1.total_cmp(&b.1))
}
