//! Which lines changed from one text to another: what both begin and end with is the same; between,
//! lines that stand once in each hold the texts together, in their longest common order (the idea
//! of Bram Cohen's patience diff). It need not be the shortest difference, and takes n log n.

use std::collections::HashMap;
use std::ops::Range;

/// Lines `old` of the one text are lines `new` of the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Change {
    pub(super) old: Range<usize>,
    pub(super) new: Range<usize>,
}

/// The changes in the order of the text; between any two there is an unchanged line.
pub(super) fn changes(old: &[&str], new: &[&str]) -> Vec<Change> {
    let mut out: Vec<Change> = Vec::new();
    let mut work = vec![(0..old.len(), 0..new.len())];
    while let Some((o, n)) = work.pop() {
        let (o, n) = without_the_same_ends(old, new, o, n);
        if o.is_empty() && n.is_empty() {
            continue;
        }
        let anchors = anchors(&old[o.clone()], &new[n.clone()]);
        if anchors.is_empty() || o.is_empty() || n.is_empty() {
            push(&mut out, Change { old: o, new: n });
            continue;
        }
        // The last part first, as the next is taken from the end.
        let (mut o_end, mut n_end) = (o.end, n.end);
        for (a, b) in anchors.into_iter().rev() {
            let (a, b) = (o.start + a, n.start + b);
            work.push((a + 1..o_end, b + 1..n_end));
            (o_end, n_end) = (a, b);
        }
        work.push((o.start..o_end, n.start..n_end));
    }
    out
}

/// Adds a change, joined with the one before if no line lies between.
fn push(out: &mut Vec<Change>, change: Change) {
    match out.last_mut() {
        Some(last) if last.old.end == change.old.start && last.new.end == change.new.start => {
            last.old.end = change.old.end;
            last.new.end = change.new.end;
        }
        _ => out.push(change),
    }
}

fn without_the_same_ends(
    old: &[&str],
    new: &[&str],
    mut o: Range<usize>,
    mut n: Range<usize>,
) -> (Range<usize>, Range<usize>) {
    while !o.is_empty() && !n.is_empty() && old[o.start] == new[n.start] {
        o.start += 1;
        n.start += 1;
    }
    while !o.is_empty() && !n.is_empty() && old[o.end - 1] == new[n.end - 1] {
        o.end -= 1;
        n.end -= 1;
    }
    (o, n)
}

/// The lines that stand once in each, as many as keep their order.
fn anchors(old: &[&str], new: &[&str]) -> Vec<(usize, usize)> {
    let (old_places, new_places) = (places(old), places(new));
    let mut pairs: Vec<(usize, usize)> = old_places
        .iter()
        .filter_map(|(line, place)| Some(((*place)?, (*new_places.get(line)?)?)))
        .collect();
    pairs.sort_unstable();
    longest_ascending(&pairs)
}

/// The position of each line; none if it occurs more than once.
fn places<'a>(lines: &[&'a str]) -> HashMap<&'a str, Option<usize>> {
    let mut places = HashMap::new();
    for (n, line) in lines.iter().enumerate() {
        places.entry(*line).and_modify(|place| *place = None).or_insert(Some(n));
    }
    places
}

/// Of pairs that ascend in the first number, the most that ascend in the second too.
fn longest_ascending(pairs: &[(usize, usize)]) -> Vec<(usize, usize)> {
    // For each length, the pair with the smallest end; and for each pair, the one before it.
    let mut ends: Vec<usize> = Vec::new();
    let mut before = vec![None; pairs.len()];
    for (n, pair) in pairs.iter().enumerate() {
        let length = ends.partition_point(|end| pairs[*end].1 < pair.1);
        before[n] = length.checked_sub(1).map(|shorter| ends[shorter]);
        if length == ends.len() {
            ends.push(n);
        } else {
            ends[length] = n;
        }
    }
    let mut chain = Vec::new();
    let mut at = ends.last().copied();
    while let Some(n) = at {
        chain.push(pairs[n]);
        at = before[n];
    }
    chain.reverse();
    chain
}
