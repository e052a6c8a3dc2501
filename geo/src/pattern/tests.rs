use super::*;
use crate::polygon::PointLocation;
use crate::segment::MapSegment;

fn at(x_m: f64, y_m: f64) -> MapPoint {
    MapPoint::new(x_m, y_m).expect("a point")
}

fn polygon(corners: &[[f64; 2]]) -> MapPolygon {
    MapPolygon::new(corners.iter().map(|[x, y]| at(*x, *y)).collect()).expect("a polygon")
}

fn lanes(spacing_m: f64, inset_m: f64) -> SurveyLanes {
    let inset = Clearance::new(inset_m).expect("a distance");
    SurveyLanes { spacing_m, direction_rad: 0.0, inset, from: None }
}

#[test]
fn a_rectangle_is_swept_in_lanes_of_the_distance() {
    let area = polygon(&[[0.0, 0.0], [10.0, 0.0], [10.0, 6.0], [0.0, 6.0]]);
    let path = sweep_area(&area, lanes(2.0, 0.0));
    let expected = [[0.0, 1.0], [10.0, 1.0], [10.0, 3.0], [0.0, 3.0], [0.0, 5.0], [10.0, 5.0]];
    assert_eq!(path, Ok(expected.map(|[x, y]| at(x, y)).to_vec()));
    // From the other end, and half a metre from the boundary.
    let from = SurveyLanes { from: Some(at(11.0, 7.0)), ..lanes(2.0, 0.5) };
    let path = sweep_area(&area, from).expect("a path");
    assert_eq!((path[0], path[1]), (at(9.5, 5.0), at(0.5, 5.0)));
    // The outer lanes are as far from the boundary as the inset.
    let path = sweep_area(&area, lanes(1.0, 0.5)).expect("a path");
    assert_eq!((path.len(), path[0], path[11]), (12, at(0.5, 0.5), at(0.5, 5.5)));
}

#[test]
fn lanes_in_another_direction_are_those_of_the_turned_area() {
    let area = polygon(&[[0.0, 0.0], [6.0, 0.0], [6.0, 10.0], [0.0, 10.0]]);
    let turned = SurveyLanes { direction_rad: std::f64::consts::FRAC_PI_2, ..lanes(2.0, 0.0) };
    let path = sweep_area(&area, turned).expect("a path");
    assert_eq!(path.len(), 6);
    assert!(path.chunks(2).all(|lane| lane[0].x_m() == lane[1].x_m()), "{path:?}");
}

#[test]
fn an_area_that_a_lane_would_leave_is_refused() {
    // A U: a horizontal lane through both arms leaves it between them.
    let corners = [[0., 0.], [9., 0.], [9., 9.], [6., 9.], [6., 3.], [3., 3.], [3., 9.], [0., 9.]];
    let area = polygon(&corners);
    assert_eq!(sweep_area(&area, lanes(1.0, 0.0)), Err(PatternError::Divided));
    let narrow = polygon(&[[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [0.0, 1.0]]);
    let inset_m = 0.6;
    assert_eq!(sweep_area(&narrow, lanes(1.0, inset_m)), Err(PatternError::TooNarrow { inset_m }));
    let many = sweep_area(&area, lanes(0.01, 0.0));
    assert!(matches!(many, Err(PatternError::Divided | PatternError::TooManyPoints { .. })));
    assert!(matches!(
        sweep_area(&narrow, lanes(f64::NAN, 0.0)),
        Err(PatternError::Distance { .. })
    ));
}

#[test]
fn no_part_of_a_path_is_nearer_to_the_boundary_than_its_inset() {
    let mut random = numbers_of(11);
    let (mut swept, mut refused) = (0, 0);
    for _ in 0..2_000 {
        // Two random chains: left ones and right ones of the same heights.
        let count = 2 + (random() * 5.0) as usize;
        let heights: Vec<f64> = (0..count).map(|n| n as f64 * (1.0 + 3.0 * random())).collect();
        let left: Vec<_> = heights.iter().map(|y| [-1.0 - 6.0 * random(), *y]).collect();
        let right: Vec<_> = heights.iter().rev().map(|y| [1.0 + 6.0 * random(), *y]).collect();
        let corners: Vec<_> = left.into_iter().chain(right).collect();
        let Ok(area) = MapPolygon::new(corners.iter().map(|[x, y]| at(*x, *y)).collect()) else {
            continue;
        };
        let inset = 0.3 * random();
        let direction_rad = if random() < 0.7 { 0.0 } else { 6.0 * random() };
        let wanted = SurveyLanes { direction_rad, ..lanes(0.3 + random(), inset) };
        let Ok(path) = sweep_area(&area, wanted) else {
            refused += 1;
            continue;
        };
        swept += 1;
        assert!(
            path.iter().all(|point| area.locate(*point) != PointLocation::Outside
                || nearest(&area, *point) < 1e-9)
        );
        for pair in path.windows(2) {
            for share in 0..=20 {
                let point = MapSegment::new(pair[0], pair[1]).point_at(f64::from(share) / 20.0);
                let is_outside = area.locate(point) == PointLocation::Outside;
                let room = nearest(&area, point);
                assert!(!is_outside || room < 1e-9, "{area:?} {pair:?}");
                assert!(room > inset - 1e-6, "{room} of {inset}: {area:?} {pair:?}");
            }
        }
    }
    println!("patterns: {swept} areas swept, {refused} refused");
    assert!(swept > 800, "{swept} swept, {refused} refused");
}

#[test]
fn every_part_of_a_convex_area_is_within_half_a_lane_of_the_path() {
    let area = polygon(&[[0.0, 0.0], [8.0, 1.0], [9.0, 6.0], [3.0, 8.0], [-1.0, 4.0]]);
    let spacing_m = 1.0;
    let path = sweep_area(&area, lanes(spacing_m, 0.0)).expect("a path");
    let mut random = numbers_of(3);
    for _ in 0..3_000 {
        let point = at(12.0 * random() - 2.0, 9.0 * random());
        if area.locate(point) != PointLocation::Inside {
            continue;
        }
        let near = path
            .windows(2)
            .map(|pair| distance(pair[0], pair[1], point))
            .fold(f64::INFINITY, f64::min);
        // At the ends of lanes along a slanted side a little more.
        assert!(near <= spacing_m * 0.75, "{near} at {point:?}");
    }
}

#[test]
fn a_corridor_goes_up_and_down_next_to_its_line() {
    let line = MapPolyline::new(vec![at(0.0, 0.0), at(10.0, 0.0)]).expect("a line");
    let path = sweep_corridor(&line, 3.0, 1.0);
    let expected = [[0.0, -1.0], [10.0, -1.0], [10.0, 0.0], [0.0, 0.0], [0.0, 1.0], [10.0, 1.0]];
    assert_eq!(path, Ok(expected.map(|[x, y]| at(x, y)).to_vec()));
    assert_eq!(sweep_corridor(&line, 0.5, 1.0).map(|path| path.len()), Ok(2));
    let bent = MapPolyline::new(vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)]).expect("a line");
    assert!(matches!(sweep_corridor(&bent, 8.0, 1.0), Err(PatternError::Shape(_))));
    assert!(matches!(sweep_corridor(&line, 1e6, 0.01), Err(PatternError::TooManyPoints { .. })));
}

fn nearest(area: &MapPolygon, point: MapPoint) -> f64 {
    area.edges().map(|edge| distance(edge.start(), edge.end(), point)).fold(f64::INFINITY, f64::min)
}

fn distance(from: MapPoint, to: MapPoint, point: MapPoint) -> f64 {
    let (dx, dy) = (to.x_m() - from.x_m(), to.y_m() - from.y_m());
    let square = dx * dx + dy * dy;
    let along = (point.x_m() - from.x_m()) * dx + (point.y_m() - from.y_m()) * dy;
    let share = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
    (from.x_m() + dx * share - point.x_m()).hypot(from.y_m() + dy * share - point.y_m())
}

/// Numbers from 0 to 1 by a seed.
fn numbers_of(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}
