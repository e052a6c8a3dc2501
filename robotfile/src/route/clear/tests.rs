//! Exits among zones against brute force in whole numbers: none missed, none invented. The robot may
//! leave a leg at any of its points, so an exit fills a triangle; the brute force compares all edges of
//! the triangle with all of the zone, and the corners of each with the other.

use armor_geo::{Clearance, MapCircle, MapPoint, MapPolygon};

use super::{find_exit_fault, find_leg_fault};
use crate::site_map::SiteMap;

/// A unit of the test is 1/16 m: floats hold it exactly.
const UNITS_PER_METRE: f64 = 16.0;

type Whole = (i128, i128);

fn point((x, y): Whole) -> MapPoint {
    MapPoint::new(x as f64 / UNITS_PER_METRE, y as f64 / UNITS_PER_METRE).expect("a point")
}

fn length(units: i128) -> Clearance {
    Clearance::new(units as f64 / UNITS_PER_METRE).expect("a length")
}

fn square(a: Whole, b: Whole) -> i128 {
    (a.0 - b.0).pow(2) + (a.1 - b.1).pow(2)
}

fn cross(o: Whole, a: Whole, b: Whole) -> i128 {
    (a.0 - o.0) * (b.1 - o.1) - (a.1 - o.1) * (b.0 - o.0)
}

/// Whether a point is nearer to a segment than `limit`, or at most so far.
fn is_near(p: Whole, (a, b): (Whole, Whole), limit: i128, at_most: bool) -> bool {
    let near = |far: i128, limit: i128| if at_most { far <= limit } else { far < limit };
    let whole = square(a, b);
    let along = (p.0 - a.0) * (b.0 - a.0) + (p.1 - a.1) * (b.1 - a.1);
    match along {
        _ if along <= 0 => near(square(p, a), limit * limit),
        _ if along >= whole => near(square(p, b), limit * limit),
        _ => near(cross(a, b, p).pow(2), limit * limit * whole),
    }
}

fn touch((a, b): (Whole, Whole), (c, d): (Whole, Whole)) -> bool {
    let on = |p, ends| is_near(p, ends, 0, true);
    let sides = |o, p, x, y| cross(o, p, x).signum() * cross(o, p, y).signum();
    (sides(a, b, c, d) < 0 && sides(c, d, a, b) < 0)
        || on(a, (c, d))
        || on(b, (c, d))
        || on(c, (a, b))
        || on(d, (a, b))
}

fn edges(corners: &[Whole]) -> Vec<(Whole, Whole)> {
    (0..corners.len()).map(|at| (corners[at], corners[(at + 1) % corners.len()])).collect()
}

/// Whether a point is in a polygon or on its boundary: how many times a ray to the right crosses it.
fn is_in(p: Whole, corners: &[Whole]) -> bool {
    let edges = edges(corners);
    let crossed = edges.iter().filter(|(a, b)| {
        let (low, high) = if a.1 < b.1 { (*a, *b) } else { (*b, *a) };
        low.1 <= p.1 && p.1 < high.1 && cross(low, high, p) > 0
    });
    edges.iter().any(|edge| is_near(p, *edge, 0, true)) || crossed.count() % 2 == 1
}

enum Zone {
    Polygon(Vec<Whole>),
    Circle(Whole, i128),
}

impl Zone {
    fn random(random: &mut fastrand::Rng) -> Self {
        let size = if random.bool() { 8 } else { 400 };
        let mut near = |reach: i64| {
            let mut value = || i128::from(random.i64(-reach..=reach));
            (value(), value())
        };
        let centre = near(2 * size);
        let corners: Vec<_> = (0..3 + centre.0.rem_euclid(4))
            .map(|_| {
                let (x, y) = near(size);
                (centre.0 + x, centre.1 + y)
            })
            .collect();
        let is_polygon = MapPolygon::new(corners.iter().copied().map(point).collect()).is_ok();
        if is_polygon && centre.1 % 4 != 0 {
            return Self::Polygon(corners);
        }
        Self::Circle(centre, 1 + near(size).0.abs())
    }

    /// Whether the exits of a leg touch the zone, or come nearer to it than `margin`.
    fn is_entered(&self, triangle: &[Whole; 3], margin: i128) -> bool {
        let sides = edges(triangle);
        match self {
            Self::Polygon(corners) => {
                let edges = edges(corners);
                let near = |(side, edge): (&(Whole, Whole), &(Whole, Whole))| {
                    touch(*side, *edge)
                        || is_near(side.0, *edge, margin, false)
                        || is_near(side.1, *edge, margin, false)
                        || is_near(edge.0, *side, margin, false)
                        || is_near(edge.1, *side, margin, false)
                };
                sides.iter().any(|side| edges.iter().any(|edge| near((side, edge))))
                    || triangle.iter().any(|corner| is_in(*corner, corners))
                    || corners.iter().any(|corner| is_in(*corner, triangle))
            }
            Self::Circle(centre, radius) => {
                is_in(*centre, triangle)
                    || sides.iter().any(|side| {
                        is_near(*centre, *side, *radius, true)
                            || is_near(*centre, *side, radius + margin, false)
                    })
            }
        }
    }

    /// The map with this zone alone.
    fn put_into(&self, map: &mut SiteMap, margin: i128) {
        let zone = &mut map.zones[0];
        zone.margin = length(margin);
        zone.area.value = match self {
            Self::Polygon(corners) => {
                let corners = corners.iter().copied().map(point).collect();
                MapPolygon::new(corners).expect("a polygon").into()
            }
            Self::Circle(centre, radius) => {
                MapCircle::new(point(*centre), length(*radius)).expect("a circle").into()
            }
        };
    }
}

#[test]
fn of_10_000_exits_no_intrusion_is_missed_and_none_is_invented() {
    const TEXT: &[u8] = b"<armor version='1'><system/><mission goal='over'><map>\
        <zone name='pit' kind='no-go' shape='0,0 1,0 1,1'/></map><place name='over'/></mission></armor>";
    let read = crate::read("a.xml".as_ref(), &mut |_| Ok(TEXT.to_vec()));
    let map = read.configuration.and_then(|it| it.mission).and_then(|it| it.map);
    let mut map = map.expect("a map");
    let mut random = fastrand::Rng::with_seed(8_192);
    let (mut entered, mut only_exits, mut by_ends) = (0, 0, 0);
    for round in 0..10_000 {
        let zone = Zone::random(&mut random);
        let reach = if random.bool() { 12 } else { 1_000 };
        let mut value = |reach: i64| i128::from(random.i64(-reach..=reach));
        let mut corner = || (value(reach), value(reach));
        let triangle @ [start, middle, end] = [corner(), corner(), corner()];
        let margin = if value(1) == 0 { 0 } else { value(reach).abs() };
        zone.put_into(&mut map, margin);
        let ends = (point(start), point(middle));
        let leg = find_leg_fault(&map, ends.0, ends.1, Clearance::ZERO).is_some();
        let exit = find_exit_fault(&map, ends, point(end), Clearance::ZERO).is_some();
        let wanted = zone.is_entered(&triangle, margin);
        // What only the leg enters is found at the leg.
        assert_eq!(leg || exit, wanted, "round {round}: {triangle:?}, {margin}");
        let at = |place| zone.is_entered(&[place, place, place], margin);
        entered += u32::from(wanted);
        only_exits += u32::from(exit && !leg);
        by_ends += u32::from(triangle.into_iter().any(at));
    }
    println!(
        "10,000 exits: {entered} enter the zone with their legs, {only_exits} without them; a check \
         of waypoints alone passes {}",
        entered - by_ends
    );
    assert!(only_exits > 500 && entered - by_ends > 500, "{only_exits} {by_ends}");
}
