//! Frontiers: where seen free space meets the unseen (Yamauchi, "A Frontier-Based Approach for
//! Autonomous Exploration", CIRA 1997).

use armor_grid::{Cell, Grid, Occupancy, Point2};

/// A connected run of free cells that border on unknown ones.
#[derive(Clone, Debug)]
pub(crate) struct Frontier {
    /// Its cells, in the order in which they were found.
    pub(crate) cells: Vec<Cell>,
    /// The mean of its cells, in metres.
    pub(crate) centre: Point2,
}

/// Returns the frontiers of at least `min_size_m`, made of cells in places that count.
pub(crate) fn find_frontiers(
    map: &Grid<Occupancy>,
    min_size_m: f64,
    counts: impl Fn(Point2) -> bool,
) -> Vec<Frontier> {
    let mut open = Grid::filled(*map.geometry(), false);
    for cell in map.geometry().cells() {
        open[cell] = is_frontier(map, cell) && counts(map.geometry().centre(cell));
    }
    let mut found = Vec::new();
    for cell in map.geometry().cells() {
        if open[cell] {
            let cells = take_connected(&mut open, cell);
            let size_m = cells.len() as f64 * map.geometry().resolution_m;
            if size_m >= min_size_m {
                let centre = mean_point(map, &cells);
                found.push(Frontier { cells, centre });
            }
        }
    }
    found
}

fn is_frontier(map: &Grid<Occupancy>, cell: Cell) -> bool {
    map[cell] == Occupancy::Free
        && cell.edge_neighbours().any(|next| map.get(next) == Some(&Occupancy::Unknown))
}

/// Removes from `open` all cells connected with `first` and returns them.
fn take_connected(open: &mut Grid<bool>, first: Cell) -> Vec<Cell> {
    open[first] = false;
    let mut cells = vec![first];
    let mut done = 0;
    while let Some(&cell) = cells.get(done) {
        done += 1;
        for next in cell.neighbours() {
            if let Some(is_open) = open.get_mut(next)
                && std::mem::take(is_open)
            {
                cells.push(next);
            }
        }
    }
    cells
}

fn mean_point(map: &Grid<Occupancy>, cells: &[Cell]) -> Point2 {
    let centres = cells.iter().map(|&cell| map.geometry().centre(cell));
    let sum = centres.fold((0.0, 0.0), |sum, c| (sum.0 + c.x_m, sum.1 + c.y_m));
    Point2::new(sum.0 / cells.len() as f64, sum.1 / cells.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::MapDrawing;

    /// Checks the sizes, in cells, of the frontiers of at least two cells.
    fn check(rows: &[&str], expected: &[usize]) {
        let map = MapDrawing::read(0.1, rows).map;
        let mut sizes: Vec<usize> =
            find_frontiers(&map, 0.2, |_| true).iter().map(|f| f.cells.len()).collect();
        sizes.sort_unstable();
        assert_eq!(sizes, expected, "{rows:#?}");
    }

    #[test]
    fn free_cells_next_to_unknown_ones_make_a_frontier() {
        check(&["#####", "#...?", "#...?", "#...?", "#####"], &[3]);
    }

    #[test]
    fn a_wall_parts_two_frontiers() {
        check(&["..??", "..??", "####", "...?", "...?", "...?"], &[2, 3]);
    }

    #[test]
    fn small_ones_are_left_out() {
        check(&["####", "#..?", "####"], &[]);
    }

    #[test]
    fn the_edge_of_the_map_is_no_frontier() {
        check(&["....", "....", "...."], &[]);
    }

    #[test]
    fn nothing_known_has_no_frontier() {
        check(&["????", "????"], &[]);
    }
}
