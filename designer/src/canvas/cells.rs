//! Which nodes and wires are where: a grid of cells, so that a look-up costs the same however large
//! the drawing is.

use std::collections::HashMap;

use eframe::egui::{Rect, Vec2};

use crate::canvas::diagram::{Diagram, DiagramId};
use crate::canvas::edges::path;

/// The side of a cell.
const CELL: f32 = 256.0;
/// Largest distance from the middle of a port at which it is hit, in points of the window.
pub(super) const PORT_REACH: f32 = 11.0;
/// Which nodes and wires are in which cell.
#[derive(Clone, Debug, Default)]
pub(super) struct CellIndex {
    nodes: HashMap<(i32, i32), Vec<u32>>,
    wires: HashMap<(i32, i32), Vec<u32>>,
}

impl CellIndex {
    pub(super) fn of<Id: DiagramId>(diagram: &Diagram<Id>) -> Self {
        let mut grid = Self::default();
        for n in 0..diagram.nodes.len() {
            enter(&mut grid.nodes, diagram.area(n).expand(PORT_REACH), n);
        }
        for n in 0..diagram.wires.len() {
            // Alone, and as it is drawn in its bundle.
            let alone = path(diagram, n, |_| Vec2::ZERO, 8).unwrap_or_default();
            let bundle = diagram.bundle(n);
            let bundled = bundle.and_then(|it| diagram.bundled_path(it, n, |_| Vec2::ZERO, 8));
            let bundled = bundled.map(|pieces| pieces.concat()).unwrap_or_default();
            for piece in alone.windows(2).chain(bundled.windows(2)) {
                enter(&mut grid.wires, Rect::from_two_pos(piece[0], piece[1]).expand(8.0), n);
            }
        }
        grid
    }

    /// The nodes that may be in an area, each once, in their order.
    pub(super) fn nodes_in(&self, area: Rect, count: usize) -> Vec<usize> {
        gather(&self.nodes, area, count)
    }

    /// The same of wires.
    pub(super) fn wires_in(&self, area: Rect, count: usize) -> Vec<usize> {
        gather(&self.wires, area, count)
    }
}

fn cells(area: Rect) -> impl Iterator<Item = (i32, i32)> {
    let cell = |at: f32| (at / CELL).floor().clamp(-1e7, 1e7) as i32;
    let (left, right) = (cell(area.min.x), cell(area.max.x));
    let (top, bottom) = (cell(area.min.y), cell(area.max.y));
    (top..=bottom).flat_map(move |y| (left..=right).map(move |x| (x, y)))
}

fn enter(map: &mut HashMap<(i32, i32), Vec<u32>>, area: Rect, number: usize) {
    let number = u32::try_from(number).unwrap_or(u32::MAX);
    // A wire that is a thousand cells long is not entered into the grid; it is always examined.
    for cell in cells(area).take(1000) {
        let list = map.entry(cell).or_default();
        if list.last() != Some(&number) {
            list.push(number);
        }
    }
}

fn gather(map: &HashMap<(i32, i32), Vec<u32>>, area: Rect, count: usize) -> Vec<usize> {
    let wide = (area.width() / CELL + 2.0) * (area.height() / CELL + 2.0);
    if !wide.is_finite() || wide > map.len() as f32 * 2.0 + 64.0 {
        return (0..count).collect();
    }
    let found = cells(area).filter_map(|cell| map.get(&cell)).flatten();
    let mut found: Vec<usize> = found.map(|n| *n as usize).filter(|n| *n < count).collect();
    found.sort_unstable();
    found.dedup();
    found
}
