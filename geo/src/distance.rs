//! Exact comparisons of distances. Each is computed rounded first, with a bound of the error;
//! only where the bound leaves the result open is it computed with expansions.

use std::cmp::Ordering;

use robust::orient2d;

use crate::exact::Expansion;
use crate::map_point::MapPoint;

/// One rounding: half a unit in the last place of 1.
const ROUNDING: f64 = f64::EPSILON / 2.0;

/// The side of the line from `a` to `b` on which `p` is: greater is left.
pub(crate) fn compare_side(a: MapPoint, b: MapPoint, p: MapPoint) -> Ordering {
    sign_of(orient2d(a.coord(), b.coord(), p.coord()))
}

/// Whether `p` is on the closed segment from `a` to `b`, which may be one point.
pub(crate) fn is_on_segment(a: MapPoint, b: MapPoint, p: MapPoint) -> bool {
    let between = |a: f64, b: f64, p: f64| a.min(b) <= p && p <= a.max(b);
    between(a.x_m(), b.x_m(), p.x_m())
        && between(a.y_m(), b.y_m(), p.y_m())
        && compare_side(a, b, p).is_eq()
}

/// Whether two closed segments have a point in common.
pub(crate) fn do_segments_touch(a: MapPoint, b: MapPoint, c: MapPoint, d: MapPoint) -> bool {
    // Most pairs are apart in x or y, which takes no arithmetic.
    let apart = |a: f64, b: f64, c: f64, d: f64| a.max(b) < c.min(d) || c.max(d) < a.min(b);
    if apart(a.x_m(), b.x_m(), c.x_m(), d.x_m()) || apart(a.y_m(), b.y_m(), c.y_m(), d.y_m()) {
        return false;
    }
    let opposite = |one: Ordering, other: Ordering| one.is_ne() && one == other.reverse();
    let crosses = opposite(compare_side(a, b, c), compare_side(a, b, d))
        && opposite(compare_side(c, d, a), compare_side(c, d, b));
    crosses
        || is_on_segment(a, b, c)
        || is_on_segment(a, b, d)
        || is_on_segment(c, d, a)
        || is_on_segment(c, d, b)
}

/// A length as the sum of two floats, such as a radius and a margin.
#[derive(Clone, Copy)]
pub(crate) struct ExactLength {
    pub(crate) length_m: f64,
    pub(crate) more_m: f64,
}

impl ExactLength {
    pub(crate) fn of(length_m: f64) -> Self {
        Self { length_m, more_m: 0.0 }
    }

    fn rounded(self) -> f64 {
        self.length_m + self.more_m
    }

    fn exact(self) -> Expansion {
        Expansion::of(self.length_m).plus(&Expansion::of(self.more_m))
    }

    /// Against zero.
    pub(crate) fn sign(self) -> Ordering {
        self.exact().sign()
    }
}

/// The distance between two points against a length that is not negative.
pub(crate) fn compare_point_distance(p: MapPoint, q: MapPoint, length: ExactLength) -> Ordering {
    let (dx, dy) = (p.x_m() - q.x_m(), p.y_m() - q.y_m());
    let (square, limit) = (dx * dx + dy * dy, length.rounded() * length.rounded());
    decide(square - limit, 8.0 * ROUNDING * (square + limit)).unwrap_or_else(|| {
        let square = exact_square(p, q);
        square.minus(&length.exact().squared()).sign()
    })
}

/// The distance of `p` from the closed segment from `a` to `b` against a length that is not
/// negative.
pub(crate) fn compare_segment_distance(
    a: MapPoint,
    b: MapPoint,
    p: MapPoint,
    length: ExactLength,
) -> Ordering {
    if compare_along(a, b, p).is_le() {
        compare_point_distance(a, p, length)
    } else if compare_along(b, a, p).is_le() {
        compare_point_distance(b, p, length)
    } else {
        compare_line_distance(a, b, p, length)
    }
}

/// The sign of the component of `p - a` along `b - a`.
fn compare_along(a: MapPoint, b: MapPoint, p: MapPoint) -> Ordering {
    let x = (b.x_m() - a.x_m()) * (p.x_m() - a.x_m());
    let y = (b.y_m() - a.y_m()) * (p.y_m() - a.y_m());
    decide(x + y, 8.0 * ROUNDING * (x.abs() + y.abs())).unwrap_or_else(|| {
        let product = |from: f64, to: f64, of: f64| {
            Expansion::difference(to, from).times(&Expansion::difference(of, from))
        };
        product(a.x_m(), b.x_m(), p.x_m()).plus(&product(a.y_m(), b.y_m(), p.y_m())).sign()
    })
}

/// The distance of `p` from the line through `a` and `b`, which are not the same.
fn compare_line_distance(a: MapPoint, b: MapPoint, p: MapPoint, length: ExactLength) -> Ordering {
    let (x, y) = (b.x_m() - a.x_m(), b.y_m() - a.y_m());
    let (left, right) = (x * (p.y_m() - a.y_m()), y * (p.x_m() - a.x_m()));
    let cross = left - right;
    let cross_error = 8.0 * ROUNDING * (left.abs() + right.abs());
    let square = cross * cross;
    let limit = length.rounded() * length.rounded() * (x * x + y * y);
    let error =
        cross_error * (2.0 * cross.abs() + cross_error) + 16.0 * ROUNDING * (square + limit);
    decide(square - limit, error).unwrap_or_else(|| {
        let product = |to: f64, from: f64, of: f64, origin: f64| {
            Expansion::difference(to, from).times(&Expansion::difference(of, origin))
        };
        let cross = product(b.x_m(), a.x_m(), p.y_m(), a.y_m()).minus(&product(
            b.y_m(),
            a.y_m(),
            p.x_m(),
            a.x_m(),
        ));
        let limit = length.exact().squared().times(&exact_square(a, b));
        cross.squared().minus(&limit).sign()
    })
}

/// The squared distance of two points.
fn exact_square(p: MapPoint, q: MapPoint) -> Expansion {
    let x = Expansion::difference(p.x_m(), q.x_m()).squared();
    x.plus(&Expansion::difference(p.y_m(), q.y_m()).squared())
}

/// The sign of a rounded value, if its error cannot change it.
fn decide(value: f64, error: f64) -> Option<Ordering> {
    (value.abs() > error).then(|| sign_of(value))
}

fn sign_of(value: f64) -> Ordering {
    value.partial_cmp(&0.0).unwrap_or(Ordering::Equal)
}
