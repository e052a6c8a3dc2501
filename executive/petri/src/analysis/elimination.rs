//! The non-negative integer solutions of minimal support of `y·C = 0` or `y·C ≤ 0`: columns are
//! eliminated one by one, each pair of rows of opposite sign making one that has a zero there
//! (Farkas; Martínez and Silva, 1982: rows whose support holds another's are dropped).

use std::collections::BTreeSet;

/// A row: what is left of `y·C`, and `y`.
#[derive(Clone, Debug, Default)]
struct Row {
    /// Column and value, by column.
    rest: Vec<(u32, i64)>,
    /// Variable and weight, by variable.
    weights: Vec<(u32, i64)>,
}

/// Where an elimination gives up: minimal solutions can be exponentially many.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    pub rows: usize,
    pub steps: u64,
}

/// Solutions found, and whether they are all.
#[derive(Debug)]
pub(super) struct Solutions {
    pub solutions: Vec<Vec<(u32, i64)>>,
    pub complete: bool,
}

/// Solves for the matrix whose rows, one per variable, are `matrix`. Variables from `slack_from`
/// on are not part of the answer.
pub(super) fn solve(
    matrix: Vec<Vec<(u32, i64)>>,
    columns: usize,
    slack_from: u32,
    effort: Effort,
    stop: &dyn Fn() -> bool,
) -> Solutions {
    let mut table = Table::new(matrix, columns, effort.steps);
    let mut complete = true;
    while let Some(column) = table.next_column() {
        if table.live.len() > effort.rows || stop() || !table.eliminate(column, effort.rows, stop) {
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

struct Table {
    rows: Vec<Row>,
    live: BTreeSet<usize>,
    /// Per column, rows with a value there; some may be dead meanwhile.
    holders: Vec<Vec<usize>>,
    /// Per column, how many live rows are positive and negative there.
    signs: Vec<(u64, u64)>,
    open: BTreeSet<u32>,
    steps_left: u64,
    overflowed: bool,
}

impl Table {
    fn new(matrix: Vec<Vec<(u32, i64)>>, columns: usize, steps: u64) -> Self {
        let mut table = Self {
            rows: Vec::new(),
            live: BTreeSet::new(),
            holders: vec![Vec::new(); columns],
            signs: vec![(0, 0); columns],
            open: (0..columns as u32).collect(),
            steps_left: steps,
            overflowed: false,
        };
        for (variable, rest) in matrix.into_iter().enumerate() {
            table.add(Row { rest, weights: vec![(variable as u32, 1)] });
        }
        table
    }

    fn add(&mut self, row: Row) {
        let number = self.rows.len();
        for &(column, value) in &row.rest {
            self.holders[column as usize].push(number);
            let signs = &mut self.signs[column as usize];
            if value > 0 { signs.0 += 1 } else { signs.1 += 1 }
        }
        self.live.insert(number);
        self.rows.push(row);
    }

    fn remove(&mut self, number: usize) {
        self.live.remove(&number);
        for &(column, value) in &self.rows[number].rest {
            let signs = &mut self.signs[column as usize];
            if value > 0 { signs.0 -= 1 } else { signs.1 -= 1 }
        }
    }

    /// The column whose elimination adds the fewest rows.
    fn next_column(&mut self) -> Option<u32> {
        let cost = |column: &u32| {
            let (positive, negative) = self.signs[*column as usize];
            (positive.saturating_mul(negative) as i64).saturating_sub((positive + negative) as i64)
        };
        self.steps_left = self.steps_left.saturating_sub(self.open.len() as u64 / 16);
        let column = self.open.iter().copied().min_by_key(cost)?;
        self.open.remove(&column);
        Some(column)
    }

    /// False if it gave up; the finished rows are solutions all the same.
    fn eliminate(&mut self, column: u32, most_rows: usize, stop: &dyn Fn() -> bool) -> bool {
        let holders = std::mem::take(&mut self.holders[column as usize]);
        let live: Vec<_> = holders.into_iter().filter(|row| self.live.contains(row)).collect();
        let value = |row: &Row| match row.rest.binary_search_by_key(&column, |entry| entry.0) {
            Ok(at) => row.rest[at].1,
            Err(_) => 0,
        };
        let (positive, negative): (Vec<_>, Vec<_>) =
            live.iter().copied().partition(|row| value(&self.rows[*row]) > 0);
        let mut made: Vec<Row> = Vec::new();
        for &plus in &positive {
            if stop() {
                return false;
            }
            for &minus in &negative {
                let (a, b) = (&self.rows[plus], &self.rows[minus]);
                self.steps_left =
                    self.steps_left.saturating_sub((a.rest.len() + b.rest.len()) as u64);
                if self.steps_left == 0 || made.len() > most_rows {
                    return false;
                }
                match combined(a, b, value(a), -value(b)) {
                    Some(row) => made.push(row),
                    None => self.overflowed = true,
                }
            }
        }
        live.iter().for_each(|row| self.remove(*row));
        self.keep_minimal(made)
    }

    /// Adds the rows whose support holds no other's. False if that takes too long.
    fn keep_minimal(&mut self, mut made: Vec<Row>) -> bool {
        made.sort_by_key(|row| row.weights.len());
        let mut kept: Vec<Row> = Vec::new();
        for row in made {
            let others = (self.live.len() + kept.len()) as u64;
            self.steps_left = self.steps_left.saturating_sub(others);
            if self.steps_left == 0 {
                return false;
            }
            let old = self.live.iter().map(|number| &self.rows[*number]);
            if !old.chain(&kept).any(|other| holds_support_of(&row, other)) {
                kept.push(row);
            }
        }
        kept.into_iter().for_each(|row| self.add(row));
        true
    }
}

/// `b_value * a + a_value * b` over their common divisor, where the column at hand vanishes.
fn combined(a: &Row, b: &Row, a_value: i64, b_value: i64) -> Option<Row> {
    let divisor = gcd(a_value.unsigned_abs(), b_value.unsigned_abs()) as i64;
    let (for_a, for_b) = (b_value / divisor, a_value / divisor);
    let mut row = Row {
        rest: sum(&a.rest, for_a, &b.rest, for_b)?,
        weights: sum(&a.weights, for_a, &b.weights, for_b)?,
    };
    let values = row.rest.iter().chain(&row.weights).map(|(_, value)| value.unsigned_abs());
    let common = values.fold(0, gcd) as i64;
    if common > 1 {
        row.rest.iter_mut().chain(&mut row.weights).for_each(|(_, value)| *value /= common);
    }
    Some(row)
}

fn sum(a: &[(u32, i64)], for_a: i64, b: &[(u32, i64)], for_b: i64) -> Option<Vec<(u32, i64)>> {
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

fn holds_support_of(row: &Row, other: &Row) -> bool {
    if other.weights.len() > row.weights.len() {
        return false;
    }
    let mut mine = row.weights.iter();
    other.weights.iter().all(|(variable, _)| mine.any(|(own, _)| own == variable))
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}
