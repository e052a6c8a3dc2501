//! The worlds that come with the missions: they read, they are closed, and the robot fits.

use std::path::Path;

use armor_grid::{Cell, Grid, Occupancy, Point2, distance_transform};
use armor_simulator::world::World;

fn world(name: &str) -> World {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions/worlds");
    World::read(&folder.join(name)).expect("a world that reads")
}

/// The cells where a round base of a given radius can get to from the start.
fn reachable(truth: &Grid<Occupancy>, radius_m: f64) -> Grid<bool> {
    let clearance_m = distance_transform(&truth.map(|&cell| cell == Occupancy::Occupied));
    let is_open = |cell: Cell| {
        truth.get(cell) == Some(&Occupancy::Free) && f64::from(clearance_m[cell]) > radius_m
    };
    let mut reached = Grid::filled(*truth.geometry(), false);
    let mut next = vec![truth.geometry().cell_at(Point2::default())];
    while let Some(cell) = next.pop() {
        if is_open(cell) && !reached[cell] {
            reached[cell] = true;
            next.extend(cell.edge_neighbours());
        }
    }
    reached
}

/// Checks that a base of 0.3 m radius, far more than the robot's 0.18 m, gets to points of the
/// sheet (metres, y down), and that free space has the area expected (so nothing leaks out).
#[track_caller]
fn check(name: &str, start: (f64, f64), rooms: &[(f64, f64)], area_m2: std::ops::Range<f64>) {
    let world = world(name);
    world.check_start(0.3).expect("room at the start");
    let truth = world.free_space(0.05).expect("a raster");
    let free = truth.values().iter().filter(|&&cell| cell == Occupancy::Free).count();
    let free_m2 = free as f64 * 0.05 * 0.05;
    assert!(area_m2.contains(&free_m2), "{name}: {free_m2} m² free");
    let reached = reachable(&truth, 0.3);
    for &(x, y) in rooms {
        let at = Point2::new(x - start.0, start.1 - y);
        assert_eq!(reached.at(at), Some(&true), "{name}: {x} {y}");
    }
}

#[test]
fn the_office_has_six_rooms_and_a_corridor() {
    let rooms = [
        (14.0, 6.0),  // corridor
        (2.6, 3.0),   // office
        (6.0, 4.0),   // meeting room
        (7.8, 0.85),  // behind its table
        (14.0, 3.0),  // laboratory
        (2.9, 9.8),   // kitchen
        (7.8, 9.5),   // studio
        (12.4, 10.0), // store, both aisles
        (14.5, 10.0),
    ];
    check("office.svg", (5.6, 6.0), &rooms, 140.0..170.0);
}

#[test]
fn the_small_worlds_are_open_all_through() {
    check("rooms.svg", (1.2, 3.0), &[(2.0, 5.0), (7.0, 2.0), (4.5, 4.5), (7.3, 5.4)], 38.0..46.0);
    check("empty.svg", (3.0, 2.0), &[(0.5, 0.5), (5.5, 3.5)], 22.0..24.1);
}
