//! The worlds that come with the missions: they read, they are closed, and the robot fits.

use std::path::Path;

use armor_grid::{Cell, Grid, Occupancy, Point2, distance_transform};
use armor_simulator::pose::Pose2;
use armor_simulator::world::{World, WorldError, WorldStart};

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

#[test]
fn the_ring_leads_round_a_core_with_two_rooms() {
    // All four sides, and both rooms.
    let rooms = [(9.0, 1.4), (16.6, 6.0), (9.0, 10.8), (1.4, 6.5), (5.0, 7.0), (13.0, 5.0)];
    check("ring.svg", (2.0, 10.7), &rooms, 155.0..180.0);
}

#[test]
fn the_hall_is_open_between_its_pillars() {
    let rooms = [(2.0, 6.0), (10.0, 1.5), (17.0, 5.0), (18.8, 12.5), (6.0, 12.5), (10.0, 7.0)];
    check("hall.svg", (1.6, 12.0), &rooms, 236.0..250.0);
    // Where people turn round there is room for them.
    let hall = world("hall.svg");
    assert_eq!(hall.routes().len(), 3);
    for &(x_m, y_m) in hall.routes().iter().flat_map(|route| &route.points) {
        assert!(hall.clearance_m(x_m, y_m) > 0.25, "{x_m} {y_m}");
    }
}

#[test]
fn every_aisle_of_the_warehouse_is_wide_enough() {
    let rooms = [
        (9.5, 0.9), // the aisles from the top
        (7.0, 3.4),
        (9.5, 4.7),
        (7.0, 6.0),
        (7.0, 8.6),
        (9.5, 9.9),
        (7.0, 11.2),
        (9.5, 13.4),
        (19.0, 2.0), // office
        (16.0, 9.0),
        (21.2, 11.0),
    ];
    check("warehouse.svg", (2.2, 7.2), &rooms, 226.0..240.0);
}

#[test]
fn the_painted_cave_leads_round_a_loop_to_four_chambers() {
    let chambers = [(5.0, -0.5), (3.0, -3.6), (9.7, -3.2), (0.4, 3.3), (10.2, 3.4)];
    check("cave.yaml", (0.0, 0.0), &chambers, 63.0..68.0);
}

/// A folder of its own that goes when the test ends.
struct Folder(std::path::PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("armor-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Writes the truth of a world as `map_server` has it: white free, black walls, grey the rest.
fn write_map(folder: &Folder, truth: &Grid<Occupancy>) -> std::path::PathBuf {
    let geometry = truth.geometry();
    let mut pgm = format!("P5\n{} {}\n255\n", geometry.width, geometry.height).into_bytes();
    for row in truth.values().chunks_exact(geometry.width).rev() {
        pgm.extend(row.iter().map(|cell| match cell {
            Occupancy::Free => 254,
            Occupancy::Occupied => 0,
            Occupancy::Unknown => 205,
        }));
    }
    std::fs::write(folder.0.join("map.pgm"), pgm).expect("a picture");
    let yaml = format!(
        "image: map.pgm\nmode: trinary\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        geometry.resolution_m, geometry.origin.x_m, geometry.origin.y_m
    );
    let path = folder.0.join("map.yaml");
    std::fs::write(&path, yaml).expect("a map");
    path
}

#[test]
fn a_map_of_the_office_is_the_office_to_within_a_cell() {
    let folder = Folder::new("office-map");
    let drawn = world("office.svg");
    let mapped = World::read(&write_map(&folder, &drawn.free_space(0.02).expect("a raster")));
    let mapped = mapped.expect("a readable map");
    mapped.check_start(0.18).expect("room at the start");
    // Where something stands is known to a cell of 2 cm and its diagonal; a ray that grazes a
    // corner may pass it in one and meet it in the other.
    let beams = (0..3600).map(|beam| Pose2::new(0.0, 0.0, f64::from(beam).to_radians() / 10.0));
    let off: Vec<f64> = beams
        .map(|ray| {
            let range_m = |world: &World| world.range_m(ray, 30.0).expect("a closed world");
            (range_m(&drawn) - range_m(&mapped)).abs()
        })
        .collect();
    let close = off.iter().filter(|&&off_m| off_m < 0.06).count();
    assert!(close > 3400, "{close} of 3600");
    for (x_m, y_m) in [(0.0, 0.0), (2.2, 0.1), (-3.0, 3.0)] {
        let off_m = drawn.clearance_m(x_m, y_m) - mapped.clearance_m(x_m, y_m);
        assert!(off_m.abs() < 0.03, "{x_m} {y_m}: {off_m}");
    }
}

#[test]
fn a_robot_begins_in_a_map_where_the_file_places_it_and_not_in_a_wall() {
    let folder = Folder::new("rooms-map");
    let path = write_map(&folder, &world("rooms.svg").free_space(0.05).expect("a raster"));
    let read = |x_m, y_m| {
        let otherwise = Some(Pose2::new(x_m, y_m, std::f64::consts::FRAC_PI_2));
        World::read_from(&path, &WorldStart { otherwise, ..WorldStart::default() })
            .expect("a readable map")
    };
    // The lower wall of the hall is 2.9 m below the drawn start, and now behind the robot.
    let world = read(0.5, 0.5);
    world.check_start(0.18).expect("room there");
    let behind = world.range_m(Pose2::new(0.0, 0.0, std::f64::consts::PI), 10.0);
    assert!((behind.expect("the wall") - 3.4).abs() < 0.06, "{behind:?}");
    let in_wall = read(2.22, 2.5).check_start(0.18);
    assert!(
        matches!(in_wall, Err(WorldError::StartBlocked { clearance_m: 0.0, .. })),
        "{in_wall:?}"
    );
    std::fs::remove_file(folder.0.join("map.pgm")).expect("the picture");
    let error = World::read(&path).err().expect("no picture").to_string();
    assert!(error.contains("map.pgm: cannot read it"), "{error}");
}
