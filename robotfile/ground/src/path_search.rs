//! Shortest paths over open cells, to the eight neighbours: A* (Hart, Nilsson & Raphael 1968). A
//! diagonal step needs both cells next to it, so that no corner is cut. Pure; lengths are whole numbers, so
//! that sums are exact.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use armor_grid::{Cell, Geometry, Grid};

/// Length of a straight step. 17/12 is 0.17 % more than √2: no length is too short.
pub(crate) const STRAIGHT: u64 = 12;
/// Length of a diagonal step.
pub(crate) const DIAGONAL: u64 = 17;
/// What a closed cell costs where a path may lead through closed cells: more than any detour in a
/// grid of 4000 × 4000.
const CLOSED: u64 = 1 << 32;
/// What a wall costs there: a zone that closes a door is named, and not the wall next to the door. No path
/// over such a grid costs more than 64 bits hold.
const WALL: u64 = CLOSED << 7;

/// Returns the length of the shortest path over open cells in twelfths of a cell; none if there is none.
pub(crate) fn find_length(open: &Grid<bool>, from: Cell, to: Cell) -> Option<u64> {
    let is_open = |cell| open.get(cell).copied().unwrap_or(false);
    if !is_open(from) || !is_open(to) {
        return None;
    }
    search(open.geometry(), from, to, |cell| is_open(cell).then_some(0)).map(|found| found.0)
}

/// Returns the cells of a shortest path over open cells; none if there is none.
pub(crate) fn find_path(open: &Grid<bool>, from: Cell, to: Cell) -> Option<Vec<Cell>> {
    let is_open = |cell| open.get(cell).copied().unwrap_or(false);
    if !is_open(from) || !is_open(to) {
        return None;
    }
    search(open.geometry(), from, to, |cell| is_open(cell).then_some(0)).map(|found| found.1)
}

/// Returns the first closed cell of a path that leads through as few walls as possible, then through as few
/// other closed cells; none if a path without them exists, or a cell is outside.
pub(crate) fn find_blocked(
    open: &Grid<bool>,
    from: Cell,
    to: Cell,
    is_wall: impl Fn(Cell) -> bool,
) -> Option<Cell> {
    let cost = |cell| match open.get(cell)? {
        true => Some(0),
        false if is_wall(cell) => Some(WALL),
        false => Some(CLOSED),
    };
    let (_, path) = search(open.geometry(), from, to, cost)?;
    path.into_iter().find(|cell| open.get(*cell) == Some(&false))
}

/// Returns the length of the shortest path from a cell to each other one, in twelfths of a cell; `u32::MAX`
/// where there is none. Dial's algorithm ("Shortest-path forest with topological ordering", CACM 12,
/// 1969): lengths are small whole numbers, so that a ring of lists is the queue.
pub(crate) fn measure_all(open: &Grid<bool>, from: Cell) -> Grid<u32> {
    let mut reached = Grid::filled(*open.geometry(), u32::MAX);
    let cost = |cell: Cell| open.get(cell).copied().unwrap_or(false).then_some(0);
    let Some(start) = reached.get_mut(from).filter(|_| cost(from).is_some()) else {
        return reached;
    };
    *start = 0;
    let mut ring: Vec<Vec<Cell>> = vec![Vec::new(); DIAGONAL as usize + 1];
    ring[0].push(from);
    let (mut length, mut waiting) = (0_u32, 1);
    while waiting > 0 {
        let slot = length as usize % ring.len();
        let cells = std::mem::take(&mut ring[slot]);
        waiting -= cells.len();
        for cell in cells {
            if reached[cell] != length {
                continue;
            }
            for (next, step) in list_steps(cell, &cost) {
                let there = length.saturating_add(step as u32);
                if there < reached[next] {
                    reached[next] = there;
                    let slot = there as usize % ring.len();
                    ring[slot].push(next);
                    waiting += 1;
                }
            }
        }
        length += 1;
    }
    reached
}

/// `cost` is what a cell costs in addition to its length; none if it may not be entered.
fn search(
    geometry: &Geometry,
    from: Cell,
    to: Cell,
    cost: impl Fn(Cell) -> Option<u64>,
) -> Option<(u64, Vec<Cell>)> {
    let mut reached = Grid::filled(*geometry, u64::MAX);
    let mut queue = BinaryHeap::new();
    *reached.get_mut(from)? = cost(from)?;
    queue.push(Reverse((reached[from] + octile(from, to), from)));
    while let Some(Reverse((estimate, cell))) = queue.pop() {
        let here = reached[cell];
        if estimate > here + octile(cell, to) {
            continue;
        }
        if cell == to {
            return Some((here, trace_back(&reached, from, to, &cost)));
        }
        for (next, step) in list_steps(cell, &cost) {
            if here + step < reached[next] {
                reached[next] = here + step;
                queue.push(Reverse((here + step + octile(next, to), next)));
            }
        }
    }
    None
}

/// The cells that can be entered from a cell, and what that costs.
fn list_steps(
    cell: Cell,
    cost: &impl Fn(Cell) -> Option<u64>,
) -> impl Iterator<Item = (Cell, u64)> {
    cell.neighbours().filter_map(move |next| {
        let own = cost(next)?;
        if next.column == cell.column || next.row == cell.row {
            return Some((next, STRAIGHT + own));
        }
        let corners = [Cell::new(cell.column, next.row), Cell::new(next.column, cell.row)];
        corners.into_iter().all(|cell| cost(cell) == Some(0)).then_some((next, DIAGONAL + own))
    })
}

/// The way back from the goal: each cell's predecessor is one from which its cost is reached.
fn trace_back(
    reached: &Grid<u64>,
    from: Cell,
    to: Cell,
    cost: &impl Fn(Cell) -> Option<u64>,
) -> Vec<Cell> {
    let mut path = vec![to];
    let mut cell = to;
    while cell != from {
        let before = cell.neighbours().find(|before| {
            let there = reached.get(*before).copied().filter(|there| *there < u64::MAX);
            there.is_some_and(|there| {
                list_steps(*before, cost)
                    .any(|(next, step)| next == cell && there + step == reached[cell])
            })
        });
        // Every reached cell has one.
        let Some(before) = before else { break };
        path.push(before);
        cell = before;
    }
    path.reverse();
    path
}

/// The length between two cells on an empty grid.
fn octile(from: Cell, to: Cell) -> u64 {
    let columns = u64::from(from.column.abs_diff(to.column));
    let rows = u64::from(from.row.abs_diff(to.row));
    let diagonal = columns.min(rows);
    diagonal * DIAGONAL + (columns.max(rows) - diagonal) * STRAIGHT
}

#[cfg(test)]
mod tests {
    use armor_grid::Point2;

    use super::*;

    fn draw_grid(random: &mut fastrand::Rng) -> Grid<bool> {
        let (width, height) = (random.usize(1..12), random.usize(1..12));
        let geometry = Geometry { origin: Point2::default(), resolution_m: 0.1, width, height };
        let share = random.f64() * 0.6;
        let cells = (0..geometry.len()).map(|_| random.f64() >= share).collect();
        Grid::from_values(geometry, cells).expect("its cells")
    }

    /// All lengths from a cell, by repeating every step until nothing changes.
    fn relax_all(open: &Grid<bool>, from: Cell) -> Grid<u64> {
        let mut least = Grid::filled(*open.geometry(), u64::MAX);
        let is_open = |cell: Cell| open.get(cell) == Some(&true);
        if is_open(from) {
            least[from] = 0;
        }
        loop {
            let mut has_changed = false;
            for cell in open.geometry().cells().filter(|cell| is_open(*cell)) {
                for next in cell.neighbours().filter(|next| is_open(*next)) {
                    let is_diagonal = next.column != cell.column && next.row != cell.row;
                    let corners =
                        [Cell::new(cell.column, next.row), Cell::new(next.column, cell.row)];
                    if is_diagonal && !corners.into_iter().all(is_open) {
                        continue;
                    }
                    let step = if is_diagonal { DIAGONAL } else { STRAIGHT };
                    let there = least[cell].saturating_add(step);
                    if there < least[next] {
                        (least[next], has_changed) = (there, true);
                    }
                }
            }
            if !has_changed {
                return least;
            }
        }
    }

    #[test]
    fn the_length_is_that_of_trying_everything() {
        let mut random = fastrand::Rng::with_seed(19);
        let (mut found, mut none) = (0, 0);
        for _ in 0..3_000 {
            let open = draw_grid(&mut random);
            let geometry = *open.geometry();
            let draw = |random: &mut fastrand::Rng| geometry.cell(random.usize(..geometry.len()));
            let (from, to) = (draw(&mut random), draw(&mut random));
            let expected = Some(relax_all(&open, from)[to]).filter(|length| *length < u64::MAX);
            assert_eq!(find_length(&open, from, to), expected, "{open:?} {from:?} {to:?}");
            let measured = Some(measure_all(&open, from)[to]).filter(|it| *it < u32::MAX);
            assert_eq!(measured.map(u64::from), expected, "{open:?} {from:?} {to:?}");
            let blocked = find_blocked(&open, from, to, |_| false);
            assert_eq!(blocked.is_none(), expected.is_some(), "{open:?} {from:?} {to:?}");
            assert!(blocked.is_none_or(|cell| !open[cell]));
            if expected.is_some() { found += 1 } else { none += 1 }
        }
        assert!(found > 500 && none > 500, "{found} {none}");
    }

    #[test]
    fn a_cell_outside_is_not_reached() {
        let geometry =
            Geometry { origin: Point2::default(), resolution_m: 1.0, width: 3, height: 3 };
        let open = Grid::filled(geometry, true);
        assert_eq!(find_length(&open, Cell::new(0, 0), Cell::new(3, 0)), None);
        assert_eq!(find_blocked(&open, Cell::new(-1, 0), Cell::new(2, 0), |_| false), None);
        assert_eq!(find_length(&open, Cell::new(0, 0), Cell::new(2, 1)), Some(DIAGONAL + STRAIGHT));
    }
}
