//! Exact Euclidean distance to the nearest marked cell (Felzenszwalb & Huttenlocher, "Distance
//! Transforms of Sampled Functions", Theory of Computing 2012): one pass over the columns, one
//! over the rows, linear in the number of cells.

use crate::Grid;

/// Returns for each cell the distance from its centre to the centre of the nearest marked one.
///
/// In metres; infinite everywhere if no cell is marked.
pub fn distance_transform(marked: &Grid<bool>) -> Grid<f32> {
    let geometry = *marked.geometry();
    let (width, height) = (geometry.width, geometry.height);
    let mut squared = marked.map(|&is| if is { 0.0_f32 } else { f32::INFINITY });
    let mut envelope = Envelope::default();
    let values = squared.values_mut();
    for column in 0..width {
        envelope.transform_line((0..height).map(|row| values[row * width + column]));
        for (row, value) in envelope.result.iter().enumerate() {
            values[row * width + column] = *value;
        }
    }
    for row in values.chunks_exact_mut(width.max(1)) {
        envelope.transform_line(row.iter().copied());
        row.copy_from_slice(&envelope.result);
    }
    let resolution_m = geometry.resolution_m as f32;
    for value in values {
        *value = value.sqrt() * resolution_m;
    }
    squared
}

/// The lower envelope of one parabola per sample of a line, with its buffers for reuse.
#[derive(Default)]
struct Envelope {
    samples: Vec<f32>,
    /// Where the parabolas of the envelope have their vertices, and from where each is lowest.
    vertices: Vec<(usize, f32)>,
    result: Vec<f32>,
}

impl Envelope {
    fn transform_line(&mut self, samples: impl Iterator<Item = f32>) {
        self.samples.clear();
        self.samples.extend(samples);
        self.vertices.clear();
        for q in 0..self.samples.len() {
            self.add_parabola(q);
        }
        self.result.clear();
        let mut k = 0;
        for q in 0..self.samples.len() {
            while self.vertices.get(k + 1).is_some_and(|next| next.1 < q as f32) {
                k += 1;
            }
            self.result.push(self.vertices.get(k).map_or(f32::INFINITY, |&(vertex, _)| {
                let away = q.abs_diff(vertex) as f32;
                away * away + self.samples[vertex]
            }));
        }
    }

    fn add_parabola(&mut self, q: usize) {
        let height = self.samples[q];
        if height.is_infinite() {
            return;
        }
        while let Some(&(p, from)) = self.vertices.last() {
            // In f64: squares of positions beyond 4096 no longer fit an f32 exactly.
            let square =
                |position: usize, height: f32| (position * position) as f64 + f64::from(height);
            let crossing =
                ((square(q, height) - square(p, self.samples[p])) / (2 * (q - p)) as f64) as f32;
            if crossing > from {
                self.vertices.push((q, crossing));
                return;
            }
            self.vertices.pop();
        }
        self.vertices.push((q, f32::NEG_INFINITY));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Geometry, Point2};
    use proptest::prelude::*;

    fn marked() -> impl Strategy<Value = Grid<bool>> {
        (1..24_usize, 1..24_usize, 0.0..0.3_f64).prop_flat_map(|(width, height, density)| {
            let geometry =
                Geometry { origin: Point2::default(), resolution_m: 0.05, width, height };
            prop::collection::vec(prop::bool::weighted(density), geometry.len())
                .prop_map(move |values| Grid::from_values(geometry, values).unwrap())
        })
    }

    proptest! {
        #[test]
        fn it_equals_the_search_over_all_cells(grid in marked()) {
            let fast = distance_transform(&grid);
            for (cell, &distance_m) in fast.iter() {
                let nearest = grid
                    .iter()
                    .filter(|(_, is)| **is)
                    .map(|(other, _)| cell.distance(other))
                    .fold(f64::INFINITY, f64::min);
                let expected_m = (nearest * 0.05) as f32;
                prop_assert!(distance_m == expected_m || (distance_m - expected_m).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn without_a_mark_all_is_infinitely_far() {
        let geometry =
            Geometry { origin: Point2::default(), resolution_m: 0.1, width: 3, height: 3 };
        let distances = distance_transform(&Grid::filled(geometry, false));
        assert!(distances.values().iter().all(|d| d.is_infinite()));
    }
}
