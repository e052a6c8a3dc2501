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

/// Levenshtein's distance, in bytes.
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.bytes().enumerate() {
            let substituted = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
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
    }
}
