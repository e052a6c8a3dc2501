//! Distances from an area, rounded. Whether a leg touches an area exactly is decided in `armor-geo`.

use armor_geo::MapArea;
use armor_grid::Point2;

/// An area, laid out for measuring many distances.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outline {
    /// The corners, the first one repeated as the last.
    Polygon(Vec<Point2>),
    /// A circle.
    Circle {
        /// Its centre.
        centre: Point2,
        /// Its radius, in metres.
        radius_m: f64,
    },
}

impl Outline {
    pub(crate) fn new(area: &MapArea) -> Self {
        let point = |at: armor_geo::MapPoint| Point2::new(at.x_m(), at.y_m());
        match area {
            MapArea::Polygon(polygon) => {
                let corners = polygon.corners();
                Self::Polygon(corners.iter().chain(corners.first()).map(|at| point(*at)).collect())
            }
            MapArea::Circle(circle) => {
                Self::Circle { centre: point(circle.centre()), radius_m: circle.radius().metres() }
            }
        }
    }

    /// The distance from the boundary, in metres; negative inside.
    pub(crate) fn signed_distance_m(&self, point: Point2) -> f64 {
        let corners = match self {
            Self::Circle { centre, radius_m } => return point.distance_m(*centre) - radius_m,
            Self::Polygon(corners) => corners,
        };
        let (mut square_m2, mut is_inside) = (f64::INFINITY, false);
        for edge in corners.windows(2) {
            let (a, b) = (edge[0], edge[1]);
            let (along_x, along_y) = (b.x_m - a.x_m, b.y_m - a.y_m);
            let (x, y) = (point.x_m - a.x_m, point.y_m - a.y_m);
            let share = (x * along_x + y * along_y) / (along_x * along_x + along_y * along_y);
            let share = share.clamp(0.0, 1.0);
            let (off_x, off_y) = (x - share * along_x, y - share * along_y);
            square_m2 = square_m2.min(off_x * off_x + off_y * off_y);
            // A ray in the direction of x: each edge contains its lower end and not its upper one.
            if (a.y_m <= point.y_m) != (b.y_m <= point.y_m) {
                is_inside ^= (along_x * y > x * along_y) == (along_y > 0.0);
            }
        }
        let distance_m = square_m2.sqrt();
        if is_inside { -distance_m } else { distance_m }
    }

    /// The direction in which the signed distance grows fastest, of length 1; along x where no
    /// direction does.
    pub(crate) fn outward(&self, point: Point2) -> (f64, f64) {
        // Central differences: an edge, a corner and a circle need no cases of their own.
        const STEP_M: f64 = 1e-4;
        let difference = |x_m: f64, y_m: f64| {
            let ahead = Point2::new(point.x_m + x_m, point.y_m + y_m);
            let behind = Point2::new(point.x_m - x_m, point.y_m - y_m);
            self.signed_distance_m(ahead) - self.signed_distance_m(behind)
        };
        let (x, y) = (difference(STEP_M, 0.0), difference(0.0, STEP_M));
        let length = x.hypot(y);
        if length > 0.0 { (x / length, y / length) } else { (1.0, 0.0) }
    }
}
