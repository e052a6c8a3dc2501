//! Sparse symmetric positive definite systems of 3 × 3 blocks, solved by factorising them as LDLᵀ.
//! Whichever unknown has the fewest neighbours is eliminated next (minimum degree), so that a chain
//! with a few closures costs little more than a chain.

use nalgebra::{Matrix3, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// `A x = b` while it is gathered.
#[derive(Clone, Debug)]
pub struct SparseSystem {
    diagonal: Vec<Matrix3<f64>>,
    right: Vec<Vector3<f64>>,
    /// Blocks off the diagonal by column; each stands in both its rows.
    rows: Vec<BTreeMap<usize, Matrix3<f64>>>,
}

/// An unknown that has been expressed by others.
struct Eliminated {
    unknown: usize,
    inverse: Matrix3<f64>,
    right: Vector3<f64>,
    others: Vec<(usize, Matrix3<f64>)>,
}

impl SparseSystem {
    /// Makes a system of `unknowns` blocks that is all zero.
    pub fn new(unknowns: usize) -> Self {
        Self {
            diagonal: vec![Matrix3::zeros(); unknowns],
            right: vec![Vector3::zeros(); unknowns],
            rows: vec![BTreeMap::new(); unknowns],
        }
    }

    /// Adds to a block on the diagonal and to the right side.
    pub fn add_block(&mut self, unknown: usize, block: &Matrix3<f64>, right: &Vector3<f64>) {
        self.diagonal[unknown] += block;
        self.right[unknown] += right;
    }

    /// Adds to the block of two different unknowns, and its transpose to the one across.
    pub fn couple_blocks(&mut self, row: usize, column: usize, block: &Matrix3<f64>) {
        *self.rows[row].entry(column).or_default() += block;
        *self.rows[column].entry(row).or_default() += block.transpose();
    }

    /// Solves it; `None` if it is not positive definite.
    pub fn solve(mut self) -> Option<Vec<Vector3<f64>>> {
        let mut waiting: BTreeSet<(usize, usize)> =
            self.rows.iter().enumerate().map(|(unknown, row)| (row.len(), unknown)).collect();
        let mut eliminated = Vec::with_capacity(self.rows.len());
        while let Some((_, unknown)) = waiting.pop_first() {
            eliminated.push(self.eliminate_column(unknown, &mut waiting)?);
        }
        // Back substitution: an unknown depends only on those that were eliminated after it.
        let mut solution = vec![Vector3::zeros(); eliminated.len()];
        for one in eliminated.iter().rev() {
            let known = one.others.iter().map(|(other, block)| block * solution[*other]);
            solution[one.unknown] = one.inverse * (one.right - known.sum::<Vector3<f64>>());
        }
        Some(solution)
    }

    fn eliminate_column(
        &mut self,
        unknown: usize,
        waiting: &mut BTreeSet<(usize, usize)>,
    ) -> Option<Eliminated> {
        let inverse = self.diagonal[unknown].cholesky()?.inverse();
        let right = self.right[unknown];
        let others: Vec<_> = std::mem::take(&mut self.rows[unknown]).into_iter().collect();
        // The Schur complement: eliminating an unknown couples all its neighbours with each other,
        // also those that had no common block before (fill-in).
        for (number, (i, block)) in others.iter().enumerate() {
            let degree = self.rows[*i].len();
            let factor = block.transpose() * inverse;
            self.diagonal[*i] -= factor * block;
            self.right[*i] -= factor * right;
            self.rows[*i].remove(&unknown);
            for (j, _) in others.iter().filter(|(j, _)| j != i) {
                self.rows[*i].entry(*j).or_default();
            }
            for (j, beyond) in &others[number + 1..] {
                let change = factor * beyond;
                *self.rows[*i].entry(*j).or_default() -= change;
                *self.rows[*j].entry(*i).or_default() -= change.transpose();
            }
            waiting.remove(&(degree, *i));
            waiting.insert((self.rows[*i].len(), *i));
        }
        Some(Eliminated { unknown, inverse, right, others })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A chain with some couplings across, against the dense solution.
    #[test]
    fn it_solves_what_a_dense_solver_solves() {
        let unknowns = 30;
        let mut system = SparseSystem::new(unknowns);
        let mut dense = DMatrix::zeros(3 * unknowns, 3 * unknowns);
        let right = DVector::from_fn(3 * unknowns, |i, _| (i as f64 * 0.7).sin());
        let across = [(2, 27), (5, 19), (19, 2), (11, 28)];
        for (i, j) in (1..unknowns).map(|i| (i - 1, i)).chain(across) {
            let block = Matrix3::from_fn(|r, c| ((i * 7 + j * 3 + r * 5 + c) as f64).cos());
            system.couple_blocks(i, j, &block);
            let mut view = dense.view_mut((3 * i, 3 * j), (3, 3));
            view += block;
            let mut view = dense.view_mut((3 * j, 3 * i), (3, 3));
            view += block.transpose();
        }
        for i in 0..unknowns {
            let block = Matrix3::identity() * 20.0;
            system.add_block(i, &block, &right.fixed_rows::<3>(3 * i).into());
            let mut view = dense.view_mut((3 * i, 3 * i), (3, 3));
            view += block;
        }
        let expected = dense.cholesky().unwrap().solve(&right);
        for (i, found) in system.solve().unwrap().iter().enumerate() {
            assert!((found - expected.fixed_rows::<3>(3 * i)).norm() < 1e-12, "unknown {i}");
        }
    }

    #[test]
    fn what_is_not_definite_has_no_solution() {
        let mut system = SparseSystem::new(2);
        system.add_block(0, &Matrix3::identity(), &Vector3::zeros());
        assert!(system.solve().is_none(), "nothing determines the second unknown");
    }
}
