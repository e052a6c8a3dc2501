//! Paths by hand, and random areas against Dijkstra's algorithm over a fine grid.

use super::*;
use crate::area::{MapArea, MapCircle};
use crate::clearance::Clearance;
use crate::polygon::MapPolygon;

fn at(x_m: f64, y_m: f64) -> MapPoint {
    MapPoint::new(x_m, y_m).expect("a point")
}

fn polygon(corners: &[[f64; 2]]) -> MapArea {
    MapPolygon::new(corners.iter().map(|[x, y]| at(*x, *y)).collect()).expect("a polygon").into()
}

fn circle(x_m: f64, y_m: f64, radius_m: f64) -> MapArea {
    MapCircle::new(at(x_m, y_m), length(radius_m)).expect("a circle").into()
}

fn length(metres: f64) -> Clearance {
    Clearance::new(metres).expect("a length")
}

fn graph_of<'a>(
    kept_out: &'a [MapArea],
    kept_in: &'a [MapArea],
    clearance_m: f64,
) -> VisibilityGraph<'a> {
    let mut space = FreeSpace::new();
    kept_out.iter().for_each(|area| space.keep_out(area, length(clearance_m)));
    kept_in.iter().for_each(|area| space.keep_in(area, length(clearance_m)));
    VisibilityGraph::new(space).expect("few bends")
}

fn find(graph: &mut VisibilityGraph<'_>, from: MapPoint, to: MapPoint) -> Option<ShortestPath> {
    let tree = graph.find_paths_to(to);
    let path = graph.find_path(from, &tree)?;
    let parts = || path.points.windows(2).map(|part| MapSegment::new(part[0], part[1]));
    assert!(parts().all(|part| graph.space().is_clear(part)), "{path:?}");
    let whole_m: f64 = parts().map(length_of).sum();
    assert!((whole_m - path.length_m).abs() < 1e-9 * (1.0 + whole_m), "{path:?}");
    Some(path)
}

#[track_caller]
fn check(graph: &mut VisibilityGraph<'_>, from: MapPoint, to: MapPoint, expected_m: f64) {
    let found_m = find(graph, from, to).map_or(f64::INFINITY, |path| path.length_m);
    assert!((found_m - expected_m).abs() < 0.01, "{found_m} instead of {expected_m}");
}

/// A U that is open to the right, with arms from x = 0 to 10 and 1 m thick.
fn open_to_the_right() -> MapArea {
    polygon(&[[0., 0.], [10., 0.], [10., 1.], [1., 1.], [1., 9.], [10., 9.], [10., 10.], [0., 10.]])
}

#[test]
fn a_path_leads_out_of_a_u_and_around_it() {
    let areas = [open_to_the_right()];
    let mut graph = graph_of(&areas, &[], 0.0);
    let (inside, behind) = (at(5.0, 5.0), at(-2.0, 5.0));
    // Out at a corner of an arm, over it and down.
    let out_m = 5_f64.hypot(4.0) + 1.0 + 10.0 + 2_f64.hypot(5.0);
    check(&mut graph, inside, behind, out_m);
    check(&mut graph, inside, at(12.0, 5.0), 7.0);
    // With a distance, the corners are round: longer by less than that of straight pieces.
    let mut graph = graph_of(&areas, &[], 0.5);
    let path = find(&mut graph, inside, behind).expect("a path");
    assert!(path.length_m > out_m + 0.5 && path.length_m < out_m + 2.5, "{path:?}");
    // What is wider than the opening does not come out.
    let mut graph = graph_of(&areas, &[], 4.1);
    assert_eq!(find(&mut graph, at(-6.0, 5.0), at(5.0, 5.0)), None);
    // From within an area, no path leads anywhere.
    assert_eq!(find(&mut graph, at(0.5, 5.0), at(20.0, 5.0)), None);
}

#[test]
fn a_path_stays_in_its_area_and_passes_to_another_one() {
    // An L: from the end of one arm to that of the other, around the inner corner.
    let rooms = [polygon(&[[0., 0.], [10., 0.], [10., 4.], [4., 4.], [4., 10.], [0., 10.]])];
    let mut graph = graph_of(&[], &rooms, 0.0);
    check(&mut graph, at(9.0, 1.0), at(1.0, 9.0), 2.0 * 5_f64.hypot(3.0));
    // Two rooms that overlap, and two that do not.
    let rooms = [
        polygon(&[[0., 0.], [6., 0.], [6., 4.], [0., 4.]]),
        polygon(&[[4., 2.], [10., 2.], [10., 6.], [4., 6.]]),
    ];
    let mut graph = graph_of(&[], &rooms, 0.1);
    assert!(find(&mut graph, at(1.0, 1.0), at(9.0, 5.0)).is_some());
    let rooms = [rooms[0].clone(), polygon(&[[7., 0.], [9., 0.], [9., 4.], [7., 4.]])];
    let mut graph = graph_of(&[], &rooms, 0.1);
    assert_eq!(find(&mut graph, at(1.0, 1.0), at(8.0, 1.0)), None);
}

#[test]
fn a_path_around_a_circle_or_a_needle_is_little_longer_than_the_shortest() {
    let areas = [circle(0.0, 0.0, 2.0)];
    let mut graph = graph_of(&areas, &[], 1.0);
    let path = find(&mut graph, at(-5.0, 0.0), at(5.0, 0.0)).expect("a path");
    // Two tangents of 4 m, and the arc between them.
    let shortest_m = 8.0 + 3.0 * (std::f64::consts::PI - 2.0 * (3_f64 / 5.0).acos());
    assert!((shortest_m..shortest_m * 1.03).contains(&path.length_m), "{path:?}");
    let areas = [polygon(&[[-9.0, -1e-9], [0.0, 0.0], [-9.0, 1e-9]])];
    let mut graph = graph_of(&areas, &[], 1.0);
    let path = find(&mut graph, at(-2.0, 2.0), at(-2.0, -2.0)).expect("a path");
    assert!((7.3..8.2).contains(&path.length_m), "{path:?}");
}

#[test]
fn the_longest_path_may_begin_within_a_segment() {
    // A wall along the segment: from its middle the way around is the longest.
    let areas = [polygon(&[[-5.0, 1.0], [5.0, 1.0], [5.0, 2.0], [-5.0, 2.0]])];
    let mut graph = graph_of(&areas, &[], 0.0);
    let tree = graph.find_paths_to(at(0.0, 3.0));
    let along = MapSegment::new(at(-6.0, 0.0), at(6.0, 0.0));
    let longest = graph.find_longest(along, &tree).expect("a path");
    assert!(longest.points[0].x_m().abs() < 0.1, "{longest:?}");
    let expected_m = 5_f64.hypot(1.0) + 1.0 + 5_f64.hypot(1.0);
    assert!((longest.length_m - expected_m).abs() < 0.1, "{longest:?}");
    let within = |most_m| graph.find_longest_within(along, &tree, most_m);
    assert_eq!((within(longest.length_m), within(longest.length_m - 0.1)), (Some(longest), None));
    // A part of it is where no robot may be.
    let through = MapSegment::new(at(-6.0, 0.0), at(6.0, 3.0));
    assert_eq!(graph.find_longest(through, &tree), None);
}

#[test]
fn bends_are_counted() {
    let areas: Vec<_> = (0..129).map(|at| circle(f64::from(at) * 3.0, 0.0, 1.0)).collect();
    let space = |areas: &'_ [MapArea]| {
        let mut space = FreeSpace::new();
        areas.iter().for_each(|area| space.keep_out(area, Clearance::ZERO));
        VisibilityGraph::new(space).is_some()
    };
    assert!(space(&areas[..128]) && !space(&areas));
}

const CELL_M: f64 = 0.5;
const CELLS: i32 = 40;

/// The length of the shortest path over a grid whose steps are clear.
fn find_on_grid(space: &FreeSpace<'_>, from: (i32, i32), to: (i32, i32)) -> Option<f64> {
    let point = |(x, y): (i32, i32)| at(f64::from(x) * CELL_M, f64::from(y) * CELL_M);
    let at_cell = |(x, y): (i32, i32)| (x * CELLS + y) as usize;
    let mut least = vec![f64::INFINITY; (CELLS * CELLS) as usize];
    let mut open = BinaryHeap::from([Reverse((0_u64, from))]);
    least[at_cell(from)] = 0.0;
    if !space.is_clear(MapSegment::new(point(from), point(from))) {
        return None;
    }
    while let Some(Reverse((bits, here))) = open.pop() {
        let length_m = f64::from_bits(bits);
        if here == to {
            return Some(length_m);
        }
        if length_m > least[at_cell(here)] {
            continue;
        }
        for (x, y) in (-2..=2).flat_map(|x| (-2..=2).map(move |y| (x, y))) {
            let next = (here.0 + x, here.1 + y);
            let is_there = (0..CELLS).contains(&next.0) && (0..CELLS).contains(&next.1);
            let step = MapSegment::new(point(here), point(next));
            if !is_there || length_m + length_of(step) >= least[at_cell(next)] {
                continue;
            }
            if space.is_clear(step) {
                least[at_cell(next)] = length_m + length_of(step);
                open.push(Reverse((least[at_cell(next)].to_bits(), next)));
            }
        }
    }
    None
}

fn draw_areas(random: &mut fastrand::Rng) -> Vec<MapArea> {
    let mut areas = Vec::new();
    let count = random.usize(1..7);
    while areas.len() < count {
        let mut within = |reach: f64| random.f64() * reach;
        let (x, y) = (within(20.0), within(20.0));
        if within(1.0) < 0.3 {
            areas.push(circle(x, y, 0.1 + within(2.5)));
            continue;
        }
        let corners = (0..random.usize(3..8)).map(|_| {
            let mut near = || random.f64() * 12.0 - 6.0;
            at(x + near(), y + near())
        });
        // Those whose edges cross are none.
        areas.extend(MapPolygon::new(corners.collect()).ok().map(MapArea::from));
    }
    areas
}

#[test]
fn paths_are_not_longer_than_over_a_grid_with_more_room() {
    let mut random = fastrand::Rng::with_seed(19);
    let (mut bent, mut none) = (0, 0);
    for round in 0..300 {
        let areas = draw_areas(&mut random);
        let room = [polygon(&[[-1., -1.], [21., -1.], [21., 21.], [12., 12.], [-1., 21.]])];
        let room = if random.bool() { &room[..] } else { &[] };
        let clearance_m = if random.bool() { 0.0 } else { random.f64() };
        let mut graph = graph_of(&areas, room, clearance_m);
        let mut wider = FreeSpace::new();
        let more_m = 1.09 * (clearance_m + 0.002);
        for area in &areas {
            let round_m = match area {
                MapArea::Circle(circle) => 0.09 * circle.radius().metres(),
                MapArea::Polygon(_) => 0.0,
            };
            wider.keep_out(area, length(more_m + round_m));
        }
        room.iter().for_each(|area| wider.keep_in(area, length(more_m)));
        let mut cell = || (random.i32(0..CELLS), random.i32(0..CELLS));
        let (from, to) = (cell(), cell());
        let point = |(x, y): (i32, i32)| at(f64::from(x) * CELL_M, f64::from(y) * CELL_M);
        let found = find(&mut graph, point(from), point(to));
        let on_grid_m = find_on_grid(&wider, from, to);
        none += u32::from(found.is_none());
        bent += u32::from(found.as_ref().is_some_and(|path| path.points.len() > 2));
        if let Some(on_grid_m) = on_grid_m {
            let found_m = found.map_or(f64::INFINITY, |path| path.length_m);
            assert!(found_m <= on_grid_m + 1e-9, "round {round}: {found_m} > {on_grid_m}");
        }
        // The longest path from a segment is that of many of its points.
        let tree = graph.find_paths_to(point(to));
        let segment = MapSegment::new(point(from), point(cell()));
        let Some(longest) = graph.find_longest(segment, &tree) else { continue };
        for part in 0..=100 {
            let here = segment.point_at(f64::from(part) / 100.0);
            let Some(path) = graph.find_path(here, &tree) else { continue };
            let most_m = longest.length_m + length_of(segment) / 256.0 + 1e-9;
            assert!(path.length_m <= most_m, "round {round}: {path:?} {longest:?}");
        }
    }
    println!("300 spaces: {bent} paths bend, from {none} starts no path leads to the goal");
    assert!(bent > 30 && none > 30, "{bent} {none}");
}
