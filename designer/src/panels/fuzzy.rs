//! Finding a name by some of its letters, as they are typed from memory.

/// Returns how well `typed` fits something named `name` with the description `about`; none if not.
/// Every word typed must be found, in any order; its letters in their order in the name, or all of
/// it in the description. Whole words count more than beginnings of words, those more than letters
/// strewn about, the name more than the description, and short names more than long ones.
pub fn fit(typed: &str, name: &str, about: &str) -> Option<Fit> {
    let letters: Vec<char> = name.chars().map(lower).collect();
    let (starts, about) = (starts(name), about.to_lowercase());
    let mut fit = Fit { score: 0, places: Vec::new() };
    for word in typed.to_lowercase().split_whitespace() {
        let in_name = best(&word.chars().collect::<Vec<_>>(), &letters, &starts);
        match in_name {
            Some((score, places)) => {
                fit.score += score;
                fit.places.extend(places);
            }
            None if about.contains(word) => fit.score += IN_DESCRIPTION,
            None => return None,
        }
    }
    fit.places.sort_unstable();
    fit.places.dedup();
    fit.score -= i32::try_from(letters.len()).unwrap_or(i32::MAX).min(99) / 4;
    Some(fit)
}

/// How something fits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fit {
    /// Larger is better.
    pub score: i32,
    /// The numbers of the characters that were found, ascending.
    pub places: Vec<usize>,
}

/// On top of the next, for the first word of all.
const AT_FRONT: i32 = 10;
const AT_START: i32 = 60;
/// As much as the start of another word, so that strewn letters never beat those that stand
/// together.
const IN_A_ROW: i32 = AT_START / 2;
/// For all letters of a word and no other: more than a front and a short name can make up for.
const WHOLE_WORD: i32 = 100;
const ANYWHERE: i32 = 4;
const IN_DESCRIPTION: i32 = 1;

fn lower(letter: char) -> char {
    letter.to_lowercase().next().unwrap_or(letter)
}

/// Which characters begin a word: after something that is no letter or digit, or a capital after a
/// small letter.
fn starts(name: &str) -> Vec<bool> {
    let mut before = ' ';
    let mut start = |letter: char| {
        let is_start = letter.is_alphanumeric()
            && (!before.is_alphanumeric() || before.is_lowercase() && letter.is_uppercase());
        before = letter;
        is_start
    };
    name.chars().map(&mut start).collect()
}

/// The best way to find the word: tried from each place where its first letter is, going on
/// greedily, but rather at the start of a word than before it.
fn best(word: &[char], letters: &[char], starts: &[bool]) -> Option<(i32, Vec<usize>)> {
    let first = word.first()?;
    let begins = letters.iter().enumerate().filter(|(_, letter)| *letter == first);
    let ways = begins.filter_map(|(begin, _)| from(begin, word, letters, starts));
    // Of equal ones, the first.
    ways.reduce(|best, other| if other.0 > best.0 { other } else { best })
}

fn from(
    begin: usize,
    word: &[char],
    letters: &[char],
    starts: &[bool],
) -> Option<(i32, Vec<usize>)> {
    let mut places = vec![begin];
    let mut score = if starts[begin] { AT_START } else { ANYWHERE };
    score += if begin == 0 { AT_FRONT } else { 0 };
    for letter in &word[1..] {
        let last = places[places.len() - 1];
        let rest = last + 1..letters.len();
        let is_it = |at: &usize| letters[*at] == *letter;
        let next = rest.clone().find(is_it)?;
        let at_start = rest.clone().find(|at| is_it(at) && starts[*at]);
        let (at, gain) = match at_start {
            _ if next == last + 1 => (next, IN_A_ROW),
            Some(start) => (start, AT_START / 2),
            None => (next, ANYWHERE),
        };
        score += gain;
        places.push(at);
    }
    let end = begin + word.len();
    let is_together = places[places.len() - 1] + 1 == end;
    let ends = letters.get(end).is_none_or(|next| !next.is_alphanumeric() || starts[end]);
    if starts[begin] && is_together && ends {
        score += WHOLE_WORD;
    }
    Some((score, places))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn is_before(typed: &str, better: &str, worse: &str) {
        let score = |name| fit(typed, name, "").map(|fit| fit.score);
        assert!(score(better) > score(worse), "{:?} {:?}", score(better), score(worse));
    }

    #[test]
    fn beginnings_of_words_come_first() {
        is_before("map", "map-writer", "grid-mapper");
        is_before("map", "grid-mapper", "bitmap");
        is_before("map", "bitmap", "clear amp");
        is_before("gm", "grid-mapper", "program");
    }

    #[test]
    fn a_whole_word_comes_before_letters_strewn_about() {
        is_before("lost", "transition lost", "link simulator.scan to mapper.scan");
        is_before("lost", "transition lost", "lamp on stand");
        is_before("stop", "a transition with a long name that may stop", "s-t-o-p");
        is_before("go", "place go", "goal");
    }

    #[test]
    fn words_are_found_in_any_order() {
        is_before("left align", "Align left", "Align right");
    }

    #[test]
    fn the_description_counts_when_the_name_does_not_fit() {
        assert!(fit("drives", "driver", "Drives somewhere.").is_some());
        assert!(fit("swims", "driver", "Drives somewhere.").is_none());
    }

    #[test]
    fn the_letters_found_are_returned() {
        assert_eq!(fit("zi", "Zoom in", "").map(|fit| fit.places), Some(vec![0, 5]));
        assert_eq!(fit("in", "Zoom in", "").map(|fit| fit.places), Some(vec![5, 6]));
        assert_eq!(fit("x", "Zoom in", ""), None);
    }
}
