//! "Did you mean …?": the known name that differs least from an unknown one.

/// Longer names are not compared, and no more candidates than this: the effort stays bounded
/// whatever a file holds.
const MAX_COMPARED_LEN: usize = 32;
const MAX_CANDIDATES: usize = 512;

/// A remedy that names the candidate nearest to `name`, if one is near enough to be meant.
pub(crate) fn did_you_mean<'a>(
    name: &str,
    candidates: impl Iterator<Item = &'a str>,
) -> Option<String> {
    let near = |candidate: &str| candidate.len().abs_diff(name.len()) <= 2;
    let limit = if name.len() <= 4 { 1 } else { 2 };
    candidates
        .filter(|candidate| name.len().max(candidate.len()) <= MAX_COMPARED_LEN && near(candidate))
        .take(MAX_CANDIDATES)
        .map(|candidate| (distance(name, candidate), candidate))
        .filter(|(distance, _)| *distance <= limit)
        .min()
        .map(|(_, candidate)| format!("did you mean {candidate}?"))
}

/// Levenshtein's distance in bytes, with two neighbours exchanged counted as one slip.
fn distance(a: &str, b: &str) -> usize {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut before = Vec::new();
    let mut above: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut row = vec![i + 1];
        for j in 0..b.len() {
            let substituted = above[j] + usize::from(a[i] != b[j]);
            let mut least = substituted.min(above[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                let exchanged: usize = before[j - 1];
                least = least.min(exchanged + 1);
            }
            row.push(least);
        }
        before = std::mem::replace(&mut above, row);
    }
    above[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_offered_and_a_far_one_is_not() {
        let known = ["explorer", "driver", "homing"];
        let guess = |name| did_you_mean(name, known.iter().copied());
        assert_eq!(guess("explorr").as_deref(), Some("did you mean explorer?"));
        assert_eq!(guess("hooming").as_deref(), Some("did you mean homing?"));
        assert_eq!(guess("camera"), None);
        assert_eq!(did_you_mean("amr", ["arm"].into_iter()).as_deref(), Some("did you mean arm?"));
    }
}
