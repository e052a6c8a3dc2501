//! Words that a plain sentence does without, counted by line (CONTRIBUTING.md, Plain English), and
//! the share of lines that are comments.

use std::path::Path;

use anyhow::Result;

use crate::sources::find_files;

/// The words that are counted. Each has a plainer one: reports, prints, specifies; the client,
/// no subscriber; alongside, again.
const WORDS: &[&str] = &[
    "told", "said", "says", "tells", "whoever", "beside", "anew", "nobody", "anybody", "somebody",
];

/// In how many lines a word stands.
#[derive(Clone, Copy, Debug)]
pub struct WordCount {
    /// The word.
    pub word: &'static str,
    /// Lines of sources and documents that hold it.
    pub lines: usize,
}

/// Counts the words in all sources and documents below `root`, and the share of `//` lines among
/// the lines of Rust that are not blank, in per cent.
///
/// # Errors
/// If a file cannot be read.
pub fn count_words(root: &Path) -> Result<(Vec<WordCount>, f64)> {
    let mut counts: Vec<_> = WORDS.iter().map(|word| WordCount { word, lines: 0 }).collect();
    let (mut comments, mut lines) = (0_usize, 0_usize);
    for file in find_files(root, &["rs", "md", "xml", "sh", "txt"])? {
        // This file names the words in order to count them.
        if file.ends_with("tests/house/src/wording.rs") {
            continue;
        }
        let is_code = file.extension().is_some_and(|ending| ending == "rs");
        for line in String::from_utf8_lossy(&std::fs::read(&file)?).lines() {
            for count in &mut counts {
                count.lines += usize::from(holds_word(line, count.word));
            }
            let line = line.trim_start();
            if is_code && !line.is_empty() {
                lines += 1;
                let is_doc = line.starts_with("///") || line.starts_with("//!");
                comments += usize::from(line.starts_with("//") && !is_doc);
            }
        }
    }
    Ok((counts, 100.0 * comments as f64 / lines.max(1) as f64))
}

fn holds_word(line: &str, word: &str) -> bool {
    let line = line.to_ascii_lowercase();
    let is_letter = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(word).any(|(at, _)| {
        let before = line[..at].chars().next_back().is_some_and(is_letter);
        let after = line[at + word.len()..].chars().next().is_some_and(is_letter);
        !before && !after
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_found_only_where_it_stands_alone() {
        assert!(holds_word("Whoever asks", "whoever"));
        assert!(!holds_word("besides", "beside") && !holds_word("x_told", "told"));
    }
}
