//! Where a robot may be on a map: out of some areas, and within one of others.

use crate::area::MapArea;
use crate::clearance::Clearance;
use crate::map_point::MapPoint;
use crate::segment::MapSegment;

/// The plane without some areas, or the inside of others, with a distance to keep from each.
#[derive(Clone, Debug, Default)]
pub struct FreeSpace<'a> {
    kept_out: Vec<KeptArea<'a>>,
    kept_in: Vec<KeptArea<'a>>,
}

/// An area with the distance to keep from its boundary.
#[derive(Clone, Debug)]
pub(crate) struct KeptArea<'a> {
    pub(crate) area: &'a MapArea,
    pub(crate) clearance: Clearance,
    /// What a segment must reach to be nearer than the distance: least x and y, greatest x and y.
    reach: [f64; 4],
}

impl<'a> FreeSpace<'a> {
    /// The plane.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an area to keep out of.
    pub fn keep_out(&mut self, area: &'a MapArea, clearance: Clearance) {
        self.kept_out.push(KeptArea::new(area, clearance));
    }

    /// Adds an area to stay in; of several, the robot stays in any one.
    pub fn keep_in(&mut self, area: &'a MapArea, clearance: Clearance) {
        self.kept_in.push(KeptArea::new(area, clearance));
    }

    /// Whether a robot may drive along the segment: it [intrudes](MapSegment::intrudes) into no area
    /// to keep out of, and [stays within](MapSegment::stays_within) one to stay in. Exact.
    pub fn is_clear(&self, segment: MapSegment) -> bool {
        let is_out = |kept: &KeptArea<'_>| {
            !kept.is_reached(segment) || !segment.intrudes(kept.area, kept.clearance)
        };
        let is_in = |kept: &KeptArea<'_>| segment.stays_within(kept.area, kept.clearance);
        self.kept_out.iter().all(is_out)
            && (self.kept_in.is_empty() || self.kept_in.iter().any(is_in))
    }

    pub(crate) fn kept_out(&self) -> &[KeptArea<'a>] {
        &self.kept_out
    }

    pub(crate) fn kept_in(&self) -> &[KeptArea<'a>] {
        &self.kept_in
    }
}

impl<'a> KeptArea<'a> {
    fn new(area: &'a MapArea, clearance: Clearance) -> Self {
        let of_points = |points: &[MapPoint]| {
            let none = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
            points.iter().fold(none, |[x, y, right, top], point| {
                let (here, up) = (point.x_m(), point.y_m());
                [x.min(here), y.min(up), right.max(here), top.max(up)]
            })
        };
        let (of_area, more_m) = match area {
            MapArea::Polygon(polygon) => (of_points(polygon.corners()), 0.0),
            MapArea::Circle(circle) => (of_points(&[circle.centre()]), circle.radius().metres()),
        };
        let wider_m = clearance.metres() + more_m;
        let low = |value: f64| (value - wider_m).next_down();
        let high = |value: f64| (value + wider_m).next_up();
        let [x, y, right, top] = of_area;
        Self { area, clearance, reach: [low(x), low(y), high(right), high(top)] }
    }

    /// Whether the segment may be nearer than the distance: a comparison of boxes.
    fn is_reached(&self, segment: MapSegment) -> bool {
        let (a, b) = (segment.start(), segment.end());
        let [x, y, right, top] = self.reach;
        a.x_m().max(b.x_m()) >= x
            && a.x_m().min(b.x_m()) <= right
            && a.y_m().max(b.y_m()) >= y
            && a.y_m().min(b.y_m()) <= top
    }
}
