//! Legs among zones against brute force in rationals: none missed, none invented.
//!
//! The brute force shares no code and no method with the predicates: it computes nearest points and
//! crossings as fractions, and counts turns of the boundary around a point by quadrants.

use std::cmp::Ordering;

use armor_geo::{Clearance, MapArea, MapCircle, MapPoint, MapPolygon, MapSegment, PointLocation};
use num_rational::Ratio;

type Fraction = Ratio<i128>;
type Exact = (Fraction, Fraction);

/// A map unit of the tests is 1/16 m: floats hold it exactly.
const UNITS_PER_METRE: f64 = 16.0;

fn fraction(value: i64) -> Fraction {
    Fraction::from_integer(i128::from(value))
}

fn exact(point: (i64, i64)) -> Exact {
    (fraction(point.0), fraction(point.1))
}

fn float(point: (i64, i64)) -> MapPoint {
    let metres = |units: i64| units as f64 / UNITS_PER_METRE;
    MapPoint::new(metres(point.0), metres(point.1)).expect("valid")
}

fn clearance(units: i64) -> Clearance {
    Clearance::new(units as f64 / UNITS_PER_METRE).expect("valid")
}

fn square(a: Exact, b: Exact) -> Fraction {
    let (x, y) = (a.0 - b.0, a.1 - b.1);
    x * x + y * y
}

fn cross(o: Exact, a: Exact, b: Exact) -> Fraction {
    (a.0 - o.0) * (b.1 - o.1) - (a.1 - o.1) * (b.0 - o.0)
}

/// The squared distance of a point from a segment, from its nearest point.
fn point_to_segment(a: Exact, b: Exact, p: Exact) -> Fraction {
    let length = square(a, b);
    if length == fraction(0) {
        return square(a, p);
    }
    let along = ((p.0 - a.0) * (b.0 - a.0) + (p.1 - a.1) * (b.1 - a.1)) / length;
    let along = along.max(fraction(0)).min(fraction(1));
    square((a.0 + along * (b.0 - a.0), a.1 + along * (b.1 - a.1)), p)
}

/// The squared distance of two segments: 0 if the parameters of their lines' crossing are both
/// within 0 and 1.
fn segment_to_segment(a: Exact, b: Exact, c: Exact, d: Exact) -> Fraction {
    let (r, s) = ((b.0 - a.0, b.1 - a.1), (d.0 - c.0, d.1 - c.1));
    let denominator = r.0 * s.1 - r.1 * s.0;
    if denominator != fraction(0) {
        let offset = (c.0 - a.0, c.1 - a.1);
        let t = (offset.0 * s.1 - offset.1 * s.0) / denominator;
        let u = (offset.0 * r.1 - offset.1 * r.0) / denominator;
        let unit = fraction(0)..=fraction(1);
        if unit.contains(&t) && unit.contains(&u) {
            return fraction(0);
        }
    }
    let ends = [
        point_to_segment(a, b, c),
        point_to_segment(a, b, d),
        point_to_segment(c, d, a),
        point_to_segment(c, d, b),
    ];
    ends.into_iter().min().expect("valid")
}

/// The quadrant of `p` seen from `o`, 0 to 3.
fn quadrant(o: Exact, p: Exact) -> i32 {
    match (p.0 >= o.0, p.1 >= o.1) {
        (true, true) => 0,
        (false, true) => 1,
        (false, false) => 2,
        (true, false) => 3,
    }
}

fn locate(corners: &[Exact], p: Exact) -> PointLocation {
    let mut quarters = 0;
    for (index, a) in corners.iter().enumerate() {
        let b = corners[(index + 1) % corners.len()];
        if point_to_segment(*a, b, p) == fraction(0) {
            return PointLocation::Boundary;
        }
        quarters += match (quadrant(p, b) - quadrant(p, *a)).rem_euclid(4) {
            0 => 0,
            1 => 1,
            3 => -1,
            _ => 2 * if cross(p, *a, b) > fraction(0) { 1 } else { -1 },
        };
    }
    if quarters == 0 { PointLocation::Outside } else { PointLocation::Inside }
}

#[derive(Debug)]
enum Zone {
    Polygon(Vec<(i64, i64)>),
    Circle((i64, i64), i64),
}

impl Zone {
    fn random(random: &mut fastrand::Rng) -> Self {
        loop {
            let size = if random.bool() { 8 } else { 2_000 };
            let centre = (random.i64(-size..=size), random.i64(-size..=size));
            if random.u8(..) < 64 {
                return Self::Circle(centre, random.i64(1..=size));
            }
            let count = random.usize(3..=8);
            let near = |random: &mut fastrand::Rng| {
                (centre.0 + random.i64(-size..=size), centre.1 + random.i64(-size..=size))
            };
            let corners: Vec<_> = (0..count).map(|_| near(random)).collect();
            if MapPolygon::new(corners.iter().map(|corner| float(*corner)).collect()).is_ok() {
                return Self::Polygon(corners);
            }
        }
    }

    fn area(&self) -> MapArea {
        match self {
            Self::Polygon(corners) => {
                MapPolygon::new(corners.iter().map(|corner| float(*corner)).collect())
                    .expect("valid")
                    .into()
            }
            Self::Circle(centre, radius) => {
                MapCircle::new(float(*centre), clearance(*radius)).expect("valid").into()
            }
        }
    }

    /// The distance of a leg from the zone against `margin`, by brute force.
    fn compare(&self, a: Exact, b: Exact, margin: i64) -> Ordering {
        let limit = fraction(margin) * fraction(margin);
        match self {
            Self::Polygon(corners) => {
                let corners: Vec<_> = corners.iter().map(|corner| exact(*corner)).collect();
                if locate(&corners, a) != PointLocation::Outside {
                    return fraction(0).cmp(&limit);
                }
                edges(&corners)
                    .map(|(c, d)| segment_to_segment(a, b, c, d))
                    .min()
                    .expect("valid")
                    .cmp(&limit)
            }
            Self::Circle(centre, radius) => {
                let nearest = point_to_segment(a, b, exact(*centre));
                if nearest <= fraction(*radius) * fraction(*radius) {
                    return fraction(0).cmp(&limit);
                }
                let reach = fraction(radius + margin);
                if margin == 0 { Ordering::Greater } else { nearest.cmp(&(reach * reach)) }
            }
        }
    }

    /// Whether a leg stays inside and `margin` away from the boundary, by brute force.
    fn contains(&self, a: Exact, b: Exact, margin: i64) -> bool {
        let limit = fraction(margin) * fraction(margin);
        match self {
            Self::Polygon(corners) => {
                let corners: Vec<_> = corners.iter().map(|corner| exact(*corner)).collect();
                let nearest = edges(&corners)
                    .map(|(c, d)| segment_to_segment(a, b, c, d))
                    .min()
                    .expect("valid");
                locate(&corners, a) == PointLocation::Inside
                    && nearest > fraction(0)
                    && nearest >= limit
            }
            Self::Circle(centre, radius) => [a, b].into_iter().all(|end| {
                let (left, far) = (radius - margin, square(end, exact(*centre)));
                let left_square = fraction(left) * fraction(left);
                let inside = far < fraction(*radius) * fraction(*radius);
                left >= 0 && inside && far <= left_square
            }),
        }
    }
}

fn edges(corners: &[Exact]) -> impl Iterator<Item = (Exact, Exact)> {
    corners.iter().enumerate().map(|(index, a)| (*a, corners[(index + 1) % corners.len()]))
}

#[test]
fn of_10_000_legs_no_intrusion_is_missed_and_none_is_invented() {
    let mut random = fastrand::Rng::with_seed(22_255);
    let (mut intrusions, mut by_waypoints, mut equal, mut within) = (0, 0, 0, 0);
    for round in 0..10_000 {
        let zone = Zone::random(&mut random);
        let reach = if random.bool() { 12 } else { 3_000 };
        let mut end = || (random.i64(-reach..=reach), random.i64(-reach..=reach));
        let (start, stop) = (end(), end());
        let margin = if random.bool() { 0 } else { random.i64(0..=reach) };
        let leg = MapSegment::new(float(start), float(stop));
        let (area, keep) = (zone.area(), clearance(margin));
        let shown = || format!("round {round}: {start:?} to {stop:?}, {margin}, {zone:?}");

        let (a, b) = (exact(start), exact(stop));
        let compared = leg.compare_distance(&area, keep);
        assert_eq!(compared, zone.compare(a, b, margin), "{}", shown());
        let intrudes = zone.compare(a, b, 0).is_eq() || compared.is_lt();
        assert_eq!(leg.intrudes(&area, keep), intrudes, "{}", shown());
        assert_eq!(leg.stays_within(&area, keep), zone.contains(a, b, margin), "{}", shown());
        let location = match &zone {
            Zone::Polygon(corners) => {
                let corners: Vec<_> = corners.iter().map(|corner| exact(*corner)).collect();
                locate(&corners, b)
            }
            Zone::Circle(centre, radius) => {
                let limit = fraction(*radius) * fraction(*radius);
                match square(b, exact(*centre)).cmp(&limit) {
                    Ordering::Less => PointLocation::Inside,
                    Ordering::Equal => PointLocation::Boundary,
                    Ordering::Greater => PointLocation::Outside,
                }
            }
        };
        assert_eq!(area.locate(leg.end()), location, "{}", shown());

        let at = |end| MapSegment::new(end, end).intrudes(&area, keep);
        intrusions += u32::from(intrudes);
        by_waypoints += u32::from(intrudes && (at(leg.start()) || at(leg.end())));
        equal += u32::from(compared.is_eq());
        within += u32::from(zone.contains(a, b, margin));
    }
    let missed = intrusions - by_waypoints;
    println!(
        "10,000 legs: {intrusions} intrude, of which a check of waypoints alone passes {missed}; \
         {equal} are at exactly the distance, {within} stay within"
    );
    assert!(missed > 500 && equal > 100 && within > 100, "{missed} {equal} {within}");
}

/// Legs that pass a zone at a distance that rounded arithmetic cannot tell from the margin.
#[test]
fn a_margin_is_decided_where_rounding_leaves_it_open() {
    let point = |x, y| MapPoint::new(x, y).unwrap();
    // A 3-4-5 triangle far from the origin: the corner (0, 0) is exactly 12/5 from its hypotenuse.
    let far = 67_108_864.0;
    let corner = point(far, far);
    let leg = MapSegment::new(point(far + 3.0, far), point(far, far + 4.0));
    let keep = Clearance::new(2.4).unwrap();
    // 2.4 as a float is a little less than 12/5, so the leg keeps it; the next float is more.
    assert!(leg.compare_distance_of_point(corner, keep).is_gt());
    let next = Clearance::new(2.4_f64.next_up()).unwrap();
    assert!(leg.compare_distance_of_point(corner, next).is_lt());

    // A radius and a margin whose sum no float holds.
    let circle = MapCircle::new(point(0.0, 0.0), Clearance::new(1.0).unwrap()).unwrap().into();
    let tiny = Clearance::new(1e-14 + 1e-15).unwrap();
    let line = |y: f64| MapSegment::new(point(-5.0, y), point(5.0, y));
    let sum = 1.0 + tiny.metres();
    let expected = (sum - 1.0).total_cmp(&tiny.metres());
    assert_eq!(line(sum).compare_distance(&circle, tiny), expected);
    assert!(line(sum.next_up()).compare_distance(&circle, tiny).is_gt());
    assert!(line(sum.next_down()).compare_distance(&circle, tiny).is_lt());
}
