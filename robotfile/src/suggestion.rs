//! "Did you mean …?": the known name that is most similar to an unknown one.

use std::cmp::Reverse;

/// Longer names are not compared: the effort stays bounded whatever a file contains.
const MAX_COMPARED_LEN: usize = 32;
/// The candidates that are compared, for the same reason.
const MAX_CANDIDATES: usize = 512;
/// Names of at most this length may differ by one slip only: by two, any short name would resemble
/// any other.
const SHORT_NAME_LEN: usize = 4;
/// Fewer letters are the beginning of too many names.
const MIN_ABBREVIATION_LEN: usize = 3;

/// Returns a remedy that names the candidate most similar to `name`, if one is similar enough to be
/// a typing mistake. A letter that is inserted, removed or replaced counts as one slip, and so do
/// two neighbours that are exchanged. If none is that similar, an abbreviation such as `odom` means
/// the one candidate that begins with it.
pub fn suggest_similar<'a>(
    name: &str,
    candidates: impl Iterator<Item = &'a str>,
) -> Option<String> {
    let candidates: Vec<&str> = candidates.take(MAX_CANDIDATES).collect();
    // An abbreviation is likelier than two slips.
    find_misspelt(name, &candidates, 1)
        .or_else(|| find_abbreviated(name, &candidates))
        .or_else(|| find_misspelt(name, &candidates, 2))
        .map(|candidate| format!("did you mean {candidate}?"))
}

fn find_misspelt<'a>(name: &str, candidates: &[&'a str], max_slips: usize) -> Option<&'a str> {
    let max_slips = if name.len() <= SHORT_NAME_LEN { 1 } else { max_slips };
    let is_compared = |candidate: &&str| {
        name.len().max(candidate.len()) <= MAX_COMPARED_LEN
            && candidate.len().abs_diff(name.len()) <= 2
    };
    candidates
        .iter()
        .copied()
        .filter(is_compared)
        .map(|candidate| (strsim::osa_distance(name, candidate), candidate))
        .filter(|(slips, candidate)| *slips <= max_slips && *slips < candidate.len())
        // Of two that are as similar, the one that begins like it: the first letters are rarely
        // wrong.
        .min_by_key(|(slips, candidate)| {
            let shared = name.chars().zip(candidate.chars()).take_while(|(a, b)| a == b).count();
            (*slips, Reverse(shared), *candidate)
        })
        .map(|(_, candidate)| candidate)
}

/// Returns the only candidate that begins with `name`. After a dot, `name` begins again: of
/// `base.odom`, three letters of `odom` are needed.
fn find_abbreviated<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let last = name.rsplit('.').next().unwrap_or_default();
    if last.len() < MIN_ABBREVIATION_LEN || name.len() > MAX_COMPARED_LEN {
        return None;
    }
    let mut meant = candidates.iter().filter(|it| it.starts_with(name) && **it != name);
    meant.next().copied().filter(|_| meant.next().is_none())
}

/// Returns [`suggest_similar`] as the end of a sentence, `; did you mean …?`, or nothing.
pub fn advise_similar<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> String {
    suggest_similar(name, candidates).map(|advice| format!("; {advice}")).unwrap_or_default()
}

/// Words that are written for `true` and `false` elsewhere.
const TRUTHS: [(&str, &[&str]); 2] =
    [("true", &["yes", "on", "1", "y", "t"]), ("false", &["no", "off", "0", "n", "f"])];

/// Returns a remedy that names the word of a closed list that was probably meant by `value`: without
/// quotation marks and spaces around it, in other letters, or with a typing mistake.
pub(crate) fn suggest_choice<'a>(
    value: &str,
    choices: impl Iterator<Item = &'a str> + Clone,
) -> Option<String> {
    let plain = |text: &str| text.to_lowercase().replace(['_', ' '], "-");
    let bare = value.trim_matches(|letter: char| !letter.is_alphanumeric());
    // A negative number is not meant as a word.
    let is_negative = value.trim_start().starts_with('-') && bare.parse::<f64>().is_ok();
    if bare.len() > MAX_COMPARED_LEN || is_negative {
        return None;
    }
    let typed = bare;
    let bare = plain(bare);
    let is_truth = |choice: &&str| {
        TRUTHS.iter().any(|(truth, words)| truth == choice && words.contains(&bare.as_str()))
    };
    let is_meant = |choice: &&str| plain(choice) == bare || is_truth(choice);
    match choices.clone().find(is_meant) {
        Some(choice) => Some(format!("did you mean {choice}?")),
        None => suggest_similar(typed, choices.clone()).or_else(|| suggest_similar(&bare, choices)),
    }
}

/// Returns the remedy for a value that is none of a closed list: the one that was probably meant, and
/// all of them.
pub(crate) fn list_choices<'a>(
    value: &str,
    choices: impl Iterator<Item = &'a str> + Clone,
) -> String {
    let all = format!("write one of {}", choices.clone().collect::<Vec<_>>().join(", "));
    match suggest_choice(value, choices) {
        Some(guess) => format!("{guess} {all}"),
        None => all,
    }
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
        assert_eq!(suggest_similar("b", ["a"].into_iter()), None);
        let known = ["base.odometry", "base.scan"];
        let abbreviated = |name| suggest_similar(name, known.into_iter());
        assert_eq!(abbreviated("base.odom"), Some("did you mean base.odometry?".into()));
        for several_or_short in ["base.", "base.od", "base"] {
            assert_eq!(abbreviated(several_or_short), None);
        }
        let percent = suggest_similar("percent", ["present", "percentage"].into_iter());
        assert_eq!(percent.as_deref(), Some("did you mean percentage?"));
        let forgotten = suggest_similar("sped", ["seed", "speed"].into_iter());
        assert_eq!(forgotten.as_deref(), Some("did you mean speed?"));
    }

    #[test]
    fn the_choice_that_was_meant_is_suggested() {
        let guess = |value| suggest_choice(value, ["auto", "on-failure", "true"].iter().copied());
        for value in ["AUTO", "‹auto›", "“auto”", " auto", "'auot'"] {
            assert_eq!(guess(value).as_deref(), Some("did you mean auto?"), "{value}");
        }
        assert_eq!(guess("on_failure").as_deref(), Some("did you mean on-failure?"));
        assert_eq!(guess("Yes").as_deref(), Some("did you mean true?"));
        assert_eq!(guess("manual"), None);
        let listed = list_choices("“up”", ["left", "right"].iter().copied());
        assert_eq!(listed, "write one of left, right");
    }
}
