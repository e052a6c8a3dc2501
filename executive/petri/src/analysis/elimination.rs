//! The non-negative integer solutions of minimal support of `y·C = 0` or `y·C ≤ 0`: columns are
//! eliminated one by one, each pair of rows of opposite sign making one that has a zero there
//! (Farkas; Martínez and Silva, 1982: a row whose support contains another's is dropped).

use std::collections::BTreeSet;

/// A row: what is left of `y·C`, and `y`.
#[derive(Clone, Debug, Default)]
struct EliminationRow {
    /// Column and value, by column.
    rest: Vec<(u32, i64)>,
    /// Variable and weight, by variable.
    weights: Vec<(u32, i64)>,
}

/// The limits of an elimination: minimal solutions can be exponentially many.
#[derive(Clone, Copy, Debug)]
pub(super) struct EliminationLimits {
    pub rows: usize,
    pub steps: u64,
}

/// The solutions found, and whether they are complete.
#[derive(Debug)]
pub(super) struct Solutions {
    pub solutions: Vec<Vec<(u32, i64)>>,
    pub complete: bool,
}

/// Solves for the matrix with the rows `matrix`, one per variable. Variables from `slack_from` on
/// are left out of the solutions.
pub(super) fn solve_by_elimination(
    matrix: Vec<Vec<(u32, i64)>>,
    columns: usize,
    slack_from: u32,
    effort: EliminationLimits,
    stop: &dyn Fn() -> bool,
) -> Solutions {
    let mut table = EliminationTable::new(matrix, columns, effort.steps);
    let mut complete = true;
    // The column that adds the fewest rows first: the order decides how many there are in between.
    while let Some((_, column)) = table.open.pop_first() {
        if table.live.len() > effort.rows
            || stop()
            || !table.eliminate_column(column, effort.rows, stop)
        {
            complete = false;
            break;
        }
    }
    let finished = table.live.iter().map(|&row| &table.rows[row]).filter(|row| row.rest.is_empty());
    let solutions = finished
        .map(|row| row.weights.iter().copied().filter(|(v, _)| *v < slack_from).collect())
        .filter(|weights: &Vec<_>| !weights.is_empty())
        .collect();
    Solutions { solutions, complete: complete && !table.overflowed }
}

struct EliminationTable {
    rows: Vec<EliminationRow>,
    live: BTreeSet<usize>,
    /// Per column, rows with a value in it; some may have been removed since.
    holders: Vec<Vec<usize>>,
    /// Per column, the number of live rows with a positive and with a negative value.
    signs: Vec<(i64, i64)>,
    /// The remaining columns, by how many rows their elimination adds.
    open: BTreeSet<(i64, u32)>,
    /// Per variable, the rows whose support begins with it; some may have been removed since.
    by_first: Vec<Vec<usize>>,
    steps_left: u64,
    overflowed: bool,
}

impl EliminationTable {
    fn new(matrix: Vec<Vec<(u32, i64)>>, columns: usize, steps: u64) -> Self {
        let mut table = Self {
            rows: Vec::new(),
            live: BTreeSet::new(),
            holders: vec![Vec::new(); columns],
            signs: vec![(0, 0); columns],
            open: (0..columns as u32).map(|column| (0, column)).collect(),
            by_first: vec![Vec::new(); matrix.len()],
            steps_left: steps,
            overflowed: false,
        };
        for (variable, rest) in matrix.into_iter().enumerate() {
            table.add_row(EliminationRow { rest, weights: vec![(variable as u32, 1)] });
        }
        table
    }

    fn add_row(&mut self, row: EliminationRow) {
        let number = self.rows.len();
        for &(column, value) in &row.rest {
            self.holders[column as usize].push(number);
            self.count_sign(column, value, 1);
        }
        if let Some((first, _)) = row.weights.first() {
            self.by_first[*first as usize].push(number);
        }
        self.live.insert(number);
        self.rows.push(row);
    }

    fn remove_row(&mut self, number: usize) {
        self.live.remove(&number);
        let rest = std::mem::take(&mut self.rows[number].rest);
        for &(column, value) in &rest {
            self.count_sign(column, value, -1);
        }
    }

    /// Counts `more` rows with a value of this sign in a column.
    fn count_sign(&mut self, column: u32, value: i64, more: i64) {
        let cost = |(positive, negative): (i64, i64)| positive * negative - positive - negative;
        let signs = &mut self.signs[column as usize];
        let before = (cost(*signs), column);
        if value > 0 {
            signs.0 += more;
        } else {
            signs.1 += more;
        }
        let after = (cost(*signs), column);
        // The column that is being eliminated has already left `open`.
        if self.open.remove(&before) {
            self.open.insert(after);
        }
    }

    /// Eliminates a column. Returns false if a limit was reached; the finished rows are still
    /// solutions.
    fn eliminate_column(&mut self, column: u32, most_rows: usize, stop: &dyn Fn() -> bool) -> bool {
        let holders = std::mem::take(&mut self.holders[column as usize]);
        let live: Vec<_> = holders.into_iter().filter(|row| self.live.contains(row)).collect();
        let value =
            |row: &EliminationRow| match row.rest.binary_search_by_key(&column, |entry| entry.0) {
                Ok(at) => row.rest[at].1,
                Err(_) => 0,
            };
        let (positive, negative): (Vec<_>, Vec<_>) =
            live.iter().copied().partition(|row| value(&self.rows[*row]) > 0);
        let mut made: Vec<EliminationRow> = Vec::new();
        for &plus in &positive {
            if stop() {
                return false;
            }
            for &minus in &negative {
                let (a, b) = (&self.rows[plus], &self.rows[minus]);
                let entries = a.rest.len() + b.rest.len() + a.weights.len() + b.weights.len();
                self.steps_left = self.steps_left.saturating_sub(entries as u64);
                if self.steps_left == 0 || made.len() > most_rows {
                    return false;
                }
                match combine_rows(a, b, value(a), -value(b)) {
                    Some(row) => made.push(row),
                    None => self.overflowed = true,
                }
            }
        }
        live.iter().for_each(|row| self.remove_row(*row));
        self.keep_minimal(made)
    }

    /// Adds the rows whose support contains no other row's. Returns false if a limit was reached.
    fn keep_minimal(&mut self, mut made: Vec<EliminationRow>) -> bool {
        // Smaller supports first, so that a row is compared with all that it could contain.
        made.sort_by_key(|row| row.weights.len());
        for row in made {
            // A support contained in this one begins with one of this one's variables.
            let mut minimal = true;
            for (variable, _) in &row.weights {
                let beginning = &self.by_first[*variable as usize];
                let mut steps = beginning.len() as u64 + 1;
                let others = beginning.iter().filter(|number| self.live.contains(number));
                let mut others = others.map(|number| &self.rows[*number]);
                minimal &= !others.any(|other| {
                    steps += other.weights.len() as u64;
                    contains_support_of(&row, other)
                });
                self.steps_left = self.steps_left.saturating_sub(steps);
                if !minimal {
                    break;
                }
            }
            if self.steps_left == 0 {
                return false;
            }
            if minimal {
                self.add_row(row);
            }
        }
        true
    }
}

/// Returns `b_value * a + a_value * b`, reduced, in which the eliminated column is zero; `None` on
/// overflow.
fn combine_rows(
    a: &EliminationRow,
    b: &EliminationRow,
    a_value: i64,
    b_value: i64,
) -> Option<EliminationRow> {
    let divisor = greatest_common_divisor(a_value.unsigned_abs(), b_value.unsigned_abs()) as i64;
    let (for_a, for_b) = (b_value / divisor, a_value / divisor);
    let mut row = EliminationRow {
        rest: add_scaled(&a.rest, for_a, &b.rest, for_b)?,
        weights: add_scaled(&a.weights, for_a, &b.weights, for_b)?,
    };
    let values = row.rest.iter().chain(&row.weights).map(|(_, value)| value.unsigned_abs());
    let common = values.fold(0, greatest_common_divisor) as i64;
    if common > 1 {
        row.rest.iter_mut().chain(&mut row.weights).for_each(|(_, value)| *value /= common);
    }
    Some(row)
}

fn add_scaled(
    a: &[(u32, i64)],
    for_a: i64,
    b: &[(u32, i64)],
    for_b: i64,
) -> Option<Vec<(u32, i64)>> {
    let mut out = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a, b);
    while !a.is_empty() || !b.is_empty() {
        let index = a
            .first()
            .map_or(u32::MAX, |entry| entry.0)
            .min(b.first().map_or(u32::MAX, |entry| entry.0));
        let mut value = 0i64;
        for (entries, factor) in [(&mut a, for_a), (&mut b, for_b)] {
            if let Some((first, rest)) = entries.split_first()
                && first.0 == index
            {
                value = value.checked_add(first.1.checked_mul(factor)?)?;
                *entries = rest;
            }
        }
        if value != 0 {
            out.push((index, value));
        }
    }
    Some(out)
}

fn contains_support_of(row: &EliminationRow, other: &EliminationRow) -> bool {
    if other.weights.len() > row.weights.len() {
        return false;
    }
    let mut mine = row.weights.iter();
    other.weights.iter().all(|(variable, _)| mine.any(|(own, _)| own == variable))
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
