//! How well a map agrees with the true one: recall and precision of walls and free space.
//!
//! Both maps are in the same frame, so a map that is drawn well but turned or shifted scores badly,
//! as it should.

use armor_grid::{Grid, Occupancy, Point2, distance_transform};

/// How well a map agrees with the truth; every share is 0 to 1, 1 is best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapScore {
    /// Share of the true wall cells that the map has as occupied, within the tolerance.
    pub wall_recall: f64,
    /// Share of the map's occupied cells that are at a true wall, within the tolerance.
    pub wall_precision: f64,
    /// Share of the true free cells that the map has as free; cells within the tolerance of a wall
    /// do not count.
    pub free_recall: f64,
    /// Share of the map's free cells that are free in truth, within the tolerance.
    pub free_precision: f64,
}

/// Scores a map against the truth; `tolerance_cells` is how far off something may be, in cells of
/// the grid it is looked for in (1.5 takes in the diagonal neighbours).
pub fn score_map(map: &Grid<Occupancy>, truth: &Grid<Occupancy>, tolerance_cells: f32) -> MapScore {
    let near = |grid: &Grid<Occupancy>, wanted: Occupancy| {
        let distance_m = distance_transform(&grid.map(|&cell| cell == wanted));
        // A little more, for the rounding of metres to single precision.
        let tolerance_m = (tolerance_cells + 0.01) * grid.geometry().resolution_m as f32;
        move |at: Point2| distance_m.at(at).is_some_and(|&off_m| off_m <= tolerance_m)
    };
    let near_map_wall = near(map, Occupancy::Occupied);
    let near_true_wall = near(truth, Occupancy::Occupied);
    let near_true_free = near(truth, Occupancy::Free);
    let is_free_in_map = |at: Point2| map.at(at) == Some(&Occupancy::Free);
    MapScore {
        wall_recall: measure_share(truth, Occupancy::Occupied, |_| true, near_map_wall),
        wall_precision: measure_share(map, Occupancy::Occupied, |_| true, &near_true_wall),
        free_recall: measure_share(
            truth,
            Occupancy::Free,
            |at| !near_true_wall(at),
            is_free_in_map,
        ),
        free_precision: measure_share(map, Occupancy::Free, |_| true, near_true_free),
    }
}

/// Of the cells that are `wanted` and count, the share that is good; 0 if there are none.
fn measure_share(
    grid: &Grid<Occupancy>,
    wanted: Occupancy,
    counts: impl Fn(Point2) -> bool,
    is_good: impl Fn(Point2) -> bool,
) -> f64 {
    let (mut all, mut good) = (0u32, 0u32);
    for (cell, _) in grid.iter().filter(|(_, value)| **value == wanted) {
        let at = grid.geometry().centre(cell);
        if counts(at) {
            all += 1;
            good += u32::from(is_good(at));
        }
    }
    f64::from(good) / f64::from(all.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_simulator::world::World;

    fn world() -> World {
        let rooms = include_bytes!("../../components/simulator/tests/two-rooms.svg");
        World::parse("two-rooms.svg", rooms).expect("a readable world")
    }

    fn truth() -> Grid<Occupancy> {
        world().free_space(0.05).expect("a raster")
    }

    #[test]
    fn the_truth_scores_full_marks() {
        let truth = truth();
        let expected = MapScore {
            wall_recall: 1.0,
            wall_precision: 1.0,
            free_recall: 1.0,
            free_precision: 1.0,
        };
        assert_eq!(score_map(&truth, &truth, 0.0), expected);
    }

    #[test]
    fn a_shifted_map_scores_by_the_tolerance() {
        let truth = truth();
        let mut geometry = *truth.geometry();
        geometry.origin.x_m += 0.1;
        let shifted =
            Grid::from_values(geometry, truth.values().to_vec()).expect("the same number of cells");
        let strict = score_map(&shifted, &truth, 1.0);
        let lenient = score_map(&shifted, &truth, 2.5);
        assert!(strict.wall_recall < 0.7 && strict.wall_precision < 0.7, "{strict:?}");
        assert!(lenient.wall_recall > 0.99 && lenient.wall_precision > 0.99, "{lenient:?}");
    }

    #[test]
    fn a_map_without_the_second_room_misses_half() {
        let truth = truth();
        let mut half = truth.clone();
        for (cell, _) in truth.iter() {
            if truth.geometry().centre(cell).x_m > 1.55 {
                half[cell] = Occupancy::Unknown;
            }
        }
        let half = score_map(&half, &truth, 1.0);
        assert!((0.4..0.6).contains(&half.free_recall), "{half:?}");
        assert!((0.4..0.7).contains(&half.wall_recall), "{half:?}");
        assert_eq!((half.wall_precision, half.free_precision), (1.0, 1.0));
    }

    #[test]
    fn an_empty_map_scores_nothing() {
        let truth = truth();
        let empty = truth.map(|_| Occupancy::Unknown);
        let score = score_map(&empty, &truth, 2.0);
        assert_eq!((score.wall_recall, score.wall_precision, score.free_recall), (0.0, 0.0, 0.0));
    }
}
