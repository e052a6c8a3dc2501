//! "Did you mean …?": the known name that is most similar to an unknown one.

/// Longer names are not compared: the effort stays bounded whatever a file contains.
const MAX_COMPARED_LEN: usize = 32;
/// The candidates that are compared, for the same reason.
const MAX_CANDIDATES: usize = 512;
/// Names of at most this length may differ by one slip only: by two, any short name would resemble
/// any other.
const SHORT_NAME_LEN: usize = 4;

/// Returns a remedy that names the candidate most similar to `name`, if one is similar enough to be
/// a typing mistake. A letter that is inserted, removed or replaced counts as one slip, and so do
/// two neighbours that are exchanged.
pub fn suggest_similar<'a>(
    name: &str,
    candidates: impl Iterator<Item = &'a str>,
) -> Option<String> {
    let max_slips = if name.len() <= SHORT_NAME_LEN { 1 } else { 2 };
    let is_compared = |candidate: &&str| {
        name.len().max(candidate.len()) <= MAX_COMPARED_LEN
            && candidate.len().abs_diff(name.len()) <= 2
    };
    candidates
        .filter(is_compared)
        .take(MAX_CANDIDATES)
        .map(|candidate| (strsim::osa_distance(name, candidate), candidate))
        .filter(|(slips, _)| *slips <= max_slips)
        .min()
        .map(|(_, candidate)| format!("did you mean {candidate}?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_similar_name_is_suggested_and_a_different_one_is_not() {
        let known = ["explorer", "driver", "homing"];
        let guess = |name| suggest_similar(name, known.iter().copied());
        assert_eq!(guess("explorr").as_deref(), Some("did you mean explorer?"));
        assert_eq!(guess("hooming").as_deref(), Some("did you mean homing?"));
        assert_eq!(guess("camera"), None);
        let exchanged = suggest_similar("amr", ["arm"].into_iter());
        assert_eq!(exchanged.as_deref(), Some("did you mean arm?"));
    }
}
