//! Rally points among random zones against Dijkstra's algorithm over a fine grid.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use armor_geo::{MapArea, MapCircle, MapPolygon};

use super::*;
use crate::route::clear::find_leg_fault;
use crate::site_map::DrawnZone;

const CELL_M: f64 = 0.5;
const CELLS: i32 = 44;

type Cell = (i32, i32);

fn at(x_m: f64, y_m: f64) -> MapPoint {
    MapPoint::new(x_m, y_m).expect("a point")
}

fn point((x, y): Cell) -> MapPoint {
    at(f64::from(x) * CELL_M, f64::from(y) * CELL_M)
}

fn length(metres: f64) -> Clearance {
    Clearance::new(metres).expect("a length")
}

fn read_map(marks: &str) -> SiteMap {
    let text = format!(
        "<armor version='1'><system/><mission goal='over'><map>{marks}</map>\
         <place name='over'/></mission></armor>"
    );
    let read = crate::read("a.xml".as_ref(), &mut |_| Ok(text.as_bytes().to_vec()));
    read.configuration.and_then(|it| it.mission).and_then(|it| it.map).expect("a map")
}

/// The lengths of the shortest paths to a cell from each other one, along steps that are clear.
fn measure(map: &SiteMap, to: Cell, radius: Clearance) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; (CELLS * CELLS) as usize];
    let is_clear = |one, other| find_leg_fault(map, point(one), point(other), radius).is_none();
    if !is_clear(to, to) {
        return least;
    }
    least[index(to)] = 0.0;
    let mut open = BinaryHeap::from([Reverse((0_u64, to))]);
    while let Some(Reverse((bits, here))) = open.pop() {
        let length_m = f64::from_bits(bits);
        if length_m > least[index(here)] {
            continue;
        }
        for (x, y) in (-2..=2).flat_map(|x| (-2..=2).map(move |y| (x, y))) {
            let next = (here.0 + x, here.1 + y);
            if !(0..CELLS).contains(&next.0) || !(0..CELLS).contains(&next.1) {
                continue;
            }
            let there_m = length_m + distance_m(point(here), point(next));
            if there_m < least[index(next)] && is_clear(here, next) {
                least[index(next)] = there_m;
                open.push(Reverse((there_m.to_bits(), next)));
            }
        }
    }
    least
}

fn index((x, y): Cell) -> usize {
    (x * CELLS + y) as usize
}

fn draw_area(random: &mut fastrand::Rng) -> MapArea {
    let (x, y) = (random.f64() * 22.0, random.f64() * 22.0);
    if random.f64() < 0.3 {
        let circle = MapCircle::new(at(x, y), length(0.2 + random.f64() * 2.0));
        return circle.expect("a circle").into();
    }
    loop {
        let corners = (0..random.usize(3..8)).map(|_| {
            let mut near = || random.f64() * 14.0 - 7.0;
            at(x + near(), y + near())
        });
        if let Ok(polygon) = MapPolygon::new(corners.collect()) {
            return polygon.into();
        }
    }
}

/// A map in which all distances are larger by as much as the rounds of a path may be.
fn widen(map: &SiteMap, radius: Clearance) -> SiteMap {
    let mut wider = map.clone();
    for zone in &mut wider.zones {
        let kept_m = zone.margin.metres() + radius.metres() + 0.003;
        let of_circle_m = match &zone.area.value {
            MapArea::Circle(circle) => circle.radius().metres(),
            MapArea::Polygon(_) => 0.0,
        };
        zone.margin = length(1.09 * kept_m + 0.09 * of_circle_m - radius.metres());
    }
    wider
}

#[test]
fn no_other_rally_point_is_nearer_by_path() {
    let mut drawn = read_map(
        "<rally name='R0' at='0 0'/><rally name='R1' at='0 0'/><rally name='R2' at='0 0'/>\
         <rally name='R3' at='0 0'/><zone name='z' kind='no-go' shape='0,0 1,0 1,1'/>",
    );
    let zone = drawn.zones.remove(0);
    let mut random = fastrand::Rng::with_seed(19);
    let (mut around, mut not_straight, mut none) = (0, 0, 0);
    for round in 0..150 {
        let mut map = drawn.clone();
        for _ in 0..random.usize(1..6) {
            let margin = if random.bool() { 0.0 } else { random.f64() };
            let area = zone.area.with(draw_area(&mut random));
            map.zones.push(DrawnZone { area, margin: length(margin), ..zone.clone() });
        }
        let mut cell = || (random.i32(0..CELLS), random.i32(0..CELLS));
        let cells: Vec<Cell> = map.rallies.iter().map(|_| cell()).collect();
        for (rally, cell) in map.rallies.iter_mut().zip(&cells) {
            rally.position.value.point = point(*cell);
        }
        // Every point of the step that is compared is a cell.
        let start = cell();
        let (x, y) = [(1, 0), (0, 1), (1, 1), (1, -1)][random.usize(0..4)];
        let leg: Vec<Cell> = (0..random.i32(0..16))
            .map(|part| (start.0 + part * x, start.1 + part * y))
            .take_while(|(x, y)| (0..CELLS).contains(x) && (0..CELLS).contains(y))
            .collect();
        let Some((first, last)) = leg.first().zip(leg.last()) else { continue };
        let ends = (point(*first), point(*last));
        let radius = length(if random.bool() { 0.0 } else { 0.3 });
        if find_leg_fault(&map, ends.0, ends.1, radius).is_some() {
            continue;
        }
        let wider = widen(&map, radius);
        let longest = |lengths: Vec<f64>| {
            leg.iter().map(|cell| lengths[index(*cell)]).max_by(f64::total_cmp).unwrap_or(0.0)
        };
        let mut paths = ExitPaths::new(Some(&map));
        let chosen = paths.find_nearest_rally(ends, radius).expect("a rally point");
        let number = map.rallies.iter().position(|it| std::ptr::eq(it, chosen)).expect("it is one");
        let path = paths.find_path(ends, chosen.position.value.point, radius);
        let shortest_m = cells
            .iter()
            .map(|cell| longest(measure(&wider, *cell, radius)))
            .min_by(f64::total_cmp)
            .expect("rally points");
        let own_m = match &path {
            ExitPath::Straight => {
                let to = point(cells[number]);
                distance_m(ends.0, to).max(distance_m(ends.1, to))
            }
            ExitPath::Around(longest) => longest.length_m,
            ExitPath::Blocked => f64::INFINITY,
        };
        // The longest path of a step is known to a 256th of its length.
        let slack_m = distance_m(ends.0, ends.1) / 100.0 + 0.01;
        assert!(own_m <= shortest_m + slack_m, "round {round}: {own_m} > {shortest_m}");
        match &path {
            ExitPath::Around(longest) => {
                around += 1;
                // It leads there from the step, and every piece of it is clear.
                let points = &longest.points;
                assert_eq!(points.last(), Some(&point(cells[number])), "round {round}");
                let leg = MapSegment::new(ends.0, ends.1);
                assert!(leg.compare_distance_of_point(points[0], length(1e-6)).is_le());
                for part in points.windows(2) {
                    let fault = find_leg_fault(&map, part[0], part[1], radius);
                    assert!(fault.is_none(), "round {round}: {fault:?}");
                }
            }
            ExitPath::Straight => {
                let straight = |cell: &Cell| {
                    distance_m(ends.0, point(*cell)).max(distance_m(ends.1, point(*cell)))
                };
                let nearest = cells.iter().map(straight).min_by(f64::total_cmp);
                not_straight += u32::from(nearest.is_some_and(|nearest| nearest < own_m));
            }
            ExitPath::Blocked => none += 1,
        }
        // Another search, with nothing kept, finds the same.
        let again = ExitPaths::new(Some(&map)).find_nearest_rally(ends, radius);
        assert!(again.is_some_and(|again| std::ptr::eq(again, chosen)), "round {round}");
    }
    assert!(around > 8 && not_straight > 5 && none > 0, "{around} {not_straight} {none}");
}

#[test]
fn of_equal_paths_the_first_in_the_file_is_taken() {
    let find = |rallies: &str| {
        let map = read_map(&format!(
            "{rallies}<zone name='wall' kind='no-go' shape='-9,1 9,1 9,2 -9,2'/>"
        ));
        let mut paths = ExitPaths::new(Some(&map));
        let ends = (at(-1.0, 0.0), at(1.0, 0.0));
        let found = paths.find_nearest_rally(ends, length(0.25));
        found.map(|rally| rally.name.value.clone()).expect("a rally point")
    };
    // Both are behind the wall, to its left and to its right.
    let (left, right) = ("<rally name='left' at='-10 4'/>", "<rally name='right' at='10 4'/>");
    assert_eq!(find(&format!("{left}{right}")), "left");
    assert_eq!(find(&format!("{right}{left}")), "right");
    let same = "<rally name='one' at='0 -4'/><rally name='two' at='0 -4'/>";
    assert_eq!(find(&format!("{right}{same}")), "one");
}

#[test]
fn a_boundary_or_too_many_corners_leave_the_straight_paths() {
    let wall = "<zone name='wall' kind='no-go' shape='-2,1 2,1 2,2 -2,2'/>";
    let near = "<rally name='near' at='0 3'/><rally name='far' at='0 -20'/>";
    let find = |marks: &str| {
        let map = read_map(marks);
        let mut paths = ExitPaths::new(Some(&map));
        let found = paths.find_nearest_rally((at(-1.0, 0.0), at(1.0, 0.0)), Clearance::ZERO);
        found.map(|rally| rally.name.value.clone()).expect("a rally point")
    };
    assert_eq!(find(&format!("{near}{wall}")), "near");
    let line = "<line name='edge' kind='boundary' shape='-50,9 50,9'/>";
    assert_eq!(find(&format!("{near}{wall}{line}")), "far");
    let phase = line.replace("boundary", "phase");
    assert_eq!(find(&format!("{near}{wall}{phase}")), "near");
    let many: String = (0..130)
        .map(|number| {
            format!("<zone name='z{number}' kind='no-go' shape='circle {},50 1m'/>", 3 * number)
        })
        .collect();
    assert_eq!(find(&format!("{near}{wall}{many}")), "far");
}
