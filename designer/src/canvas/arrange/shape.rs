//! The shape of a large part of a drawing: high layers are split, and a long row of layers is broken
//! into several, so that the part is shown as large as the window allows.

use eframe::egui::{Vec2, vec2};

use super::{ACROSS, DOWN, arrange_part, rows_of};

/// Parts with fewer nodes stay in one row of layers.
const LARGE: usize = 20;
/// A split or broken arrangement is taken if it is shown so much larger.
const WORTH_IT: f32 = 1.25;
/// Most heights at which layers are split, and most rows of layers, that are tried.
const TRIES: usize = 4;
/// Space between two rows of layers, in which links lead back.
const BAND: f32 = 120.0;

/// The size of an area with nodes at these positions, from the origin.
pub(super) fn extent(placed: &[Vec2], sizes: &[Vec2], part: &[usize]) -> Vec2 {
    placed.iter().zip(part).fold(Vec2::ZERO, |size, (at, n)| size.max(*at + sizes[*n]))
}

/// Positions of the nodes of one part: of the arrangements that are tried the one that is shown
/// largest in a window of this shape, the plain one unless another one is clearly larger.
pub(super) fn arrange_to_shape(
    sizes: &[Vec2],
    forward: &[Vec<usize>],
    layer: &[usize],
    own: &[usize],
    shape: f32,
) -> Vec<Vec2> {
    let plain = arrange_part(sizes, forward, rows_of(layer, own), own);
    let shown = |placed: &[Vec2]| {
        let size = extent(placed, sizes, own);
        (shape / size.x.max(1.0)).min(1.0 / size.y.max(1.0))
    };
    let whole = extent(&plain, sizes, own);
    let is_fitting = whole.x < whole.y * shape * 2.0 && whole.y * shape < whole.x * 2.0;
    if own.len() < LARGE || is_fitting {
        return plain;
    }
    let least = shown(&plain) * WORTH_IT;
    let tried: Vec<_> = if whole.x > whole.y * shape {
        let best = (whole.x / (whole.y + BAND) / shape).sqrt().ceil() as usize;
        (best.max(2) - 1..best + TRIES)
            .map(|count| break_row(&plain, sizes, own, whole.x / count.max(2) as f32))
            .collect()
    } else {
        let area: f32 = own.iter().map(|n| (sizes[*n].x + ACROSS) * (sizes[*n].y + DOWN)).sum();
        let best = (area / shape).sqrt();
        (1..=TRIES)
            .map(|n| {
                let rows = split_layers(rows_of(layer, own), sizes, best * 0.5 * n as f32);
                arrange_part(sizes, forward, rows, own)
            })
            .collect()
    };
    let best = tried.into_iter().map(|placed| (shown(&placed), placed));
    let best = best.max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(shown, _)| *shown >= least).map_or(plain, |(_, placed)| placed)
}

/// Splits each layer that is higher than this: no link joins two nodes of one layer, so its parts
/// are layers again.
fn split_layers(rows: Vec<Vec<usize>>, sizes: &[Vec2], height: f32) -> Vec<Vec<usize>> {
    let mut split = Vec::new();
    for row in rows {
        let whole: f32 = row.iter().map(|node| sizes[*node].y + DOWN).sum();
        let count = (whole / height.max(1.0)).ceil().max(1.0) as usize;
        let each = row.len().div_ceil(count).max(1);
        split.extend(row.chunks(each).map(<[usize]>::to_vec));
    }
    split
}

/// Breaks one long row of layers into several that are at most so wide, one below the other.
fn break_row(placed: &[Vec2], sizes: &[Vec2], own: &[usize], width: f32) -> Vec<Vec2> {
    let mut columns: Vec<f32> = placed.iter().map(|at| at.x).collect();
    columns.sort_by(f32::total_cmp);
    columns.dedup();
    // Where each row of layers begins.
    let mut starts = vec![0.0_f32];
    for column in columns {
        let nodes = placed.iter().zip(own).filter(|(at, _)| at.x == column);
        let right = nodes.map(|(at, n)| at.x + sizes[*n].x).fold(column, f32::max);
        let start = starts.last().copied().unwrap_or(0.0);
        if right - start > width && column > start {
            starts.push(column);
        }
    }
    let band_of = |at: &Vec2| starts.iter().rposition(|start| *start <= at.x).unwrap_or(0);
    let mut tops = vec![f32::INFINITY; starts.len()];
    let mut bottoms = vec![0.0_f32; starts.len()];
    for (at, n) in placed.iter().zip(own) {
        let band = band_of(at);
        tops[band] = tops[band].min(at.y);
        bottoms[band] = bottoms[band].max(at.y + sizes[*n].y);
    }
    let mut y = 0.0;
    let shifts: Vec<f32> = tops
        .iter()
        .zip(&bottoms)
        .map(|(top, bottom)| {
            let shift = y - top;
            y += bottom - top + BAND;
            shift
        })
        .collect();
    let moved = |at: &Vec2| {
        let band = band_of(at);
        vec2(at.x - starts[band], at.y + shifts[band])
    };
    placed.iter().map(moved).collect()
}

#[cfg(test)]
mod tests {
    use eframe::egui::Rect;

    use super::super::arrange;
    use super::*;

    /// Arranges blocks of one size; returns the shape of the whole.
    fn shape_of(count: usize, links: &[(usize, usize)], shape: f32) -> f32 {
        let sizes = vec![vec2(150.0, 80.0); count];
        let wanted: Vec<_> = (0..count).collect();
        let at = arrange(&sizes, links, &wanted, shape);
        let areas: Vec<_> = at
            .iter()
            .zip(&sizes)
            .map(|(at, size)| Rect::from_min_size(at.to_pos2(), *size))
            .collect();
        for (n, one) in areas.iter().enumerate() {
            for (m, other) in areas.iter().enumerate().skip(n + 1) {
                assert!(!one.expand(4.0).intersects(*other), "{n} {one:?} is over {m} {other:?}");
            }
        }
        let whole = areas.into_iter().reduce(Rect::union).unwrap();
        whole.width() / whole.height()
    }

    #[test]
    fn a_large_drawing_has_about_the_shape_of_the_window() {
        let chain: Vec<_> = (0..59).map(|n| (n, n + 1)).collect();
        let star: Vec<_> = (1..60).map(|n| (0, n)).collect();
        let tree: Vec<_> = (1..60).map(|n| ((n - 1) / 3, n)).collect();
        for shape in [0.7, 1.0, 1.6, 2.4] {
            for (name, links) in [("chain", &chain), ("star", &star), ("tree", &tree)] {
                let found = shape_of(60, links, shape);
                let ratio = found / shape;
                // Links that pass a layer need room there.
                let most = if name == "tree" { 3.2 } else { 2.2 };
                assert!((1.0 / most..most).contains(&ratio), "{name} for {shape}: {found}");
            }
        }
    }

    #[test]
    fn a_small_drawing_stays_in_one_row() {
        let chain: Vec<_> = (0..9).map(|n| (n, n + 1)).collect();
        assert!(shape_of(10, &chain, 1.6) > 15.0);
    }
}
