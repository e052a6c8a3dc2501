//! Lists of names in one attribute, such as `from="a b"`.

/// The list with one of its names replaced by another one that it does not have.
pub(super) fn replace_word(list: &str, at: usize, new: &str) -> Option<String> {
    let words: Vec<_> = list.split_whitespace().collect();
    (!words.contains(&new)).then(|| {
        let words = words.iter().enumerate();
        let words: Vec<_> = words.map(|(n, word)| if n == at { new } else { word }).collect();
        words.join(" ")
    })
}

/// Whether two lists have a name in common.
pub(super) fn share_word(one: Option<&str>, other: Option<&str>) -> bool {
    let (one, other) = (one.unwrap_or(""), other.unwrap_or(""));
    one.split_whitespace().any(|word| other.split_whitespace().any(|it| it == word))
}

/// The list with a further name.
pub(super) fn add_word(list: &str, new: &str) -> Option<String> {
    let is_known = list.split_whitespace().any(|word| word == new);
    (!is_known).then(|| format!("{list} {new}"))
}

/// The list without one of its names, if others are left.
pub(super) fn remove_word(list: &str, at: usize) -> Option<String> {
    let words: Vec<_> = list.split_whitespace().collect();
    (words.len() > 1).then(|| {
        let left = words.iter().enumerate().filter(|(n, _)| *n != at);
        left.map(|(_, word)| *word).collect::<Vec<_>>().join(" ")
    })
}
