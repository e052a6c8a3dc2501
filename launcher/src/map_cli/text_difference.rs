//! The difference of two texts line by line, as `diff -u` prints it and `patch` applies it. Pure.

use std::fmt::Write;

/// Lines around a change that are shown.
const CONTEXT: usize = 3;
/// Most pairs of lines that are compared; larger changes are shown as removed and added.
const MOST_PAIRS: usize = 4_000_000;

/// A line of the difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ChangedLine<'a> {
    Kept(&'a str),
    Removed(&'a str),
    Added(&'a str),
}

/// Returns the unified difference from `old` to `new`, both called `name`; empty if they are equal.
pub fn unified_difference(name: &str, old: &str, new: &str) -> String {
    let old_lines: Vec<_> = old.split_inclusive('\n').collect();
    let new_lines: Vec<_> = new.split_inclusive('\n').collect();
    let lines = compare_lines(&old_lines, &new_lines);
    let hunks = find_hunks(&lines);
    let mut text = String::new();
    if hunks.is_empty() {
        return text;
    }
    // Writing to a string cannot fail.
    let _ = writeln!(text, "--- {name}\n+++ {name}");
    let (mut at, mut old_line, mut new_line) = (0, 0, 0);
    for (start, end) in hunks {
        for line in &lines[at..start] {
            count_line(line, &mut old_line, &mut new_line);
        }
        let (mut old_end, mut new_end) = (old_line, new_line);
        lines[start..end].iter().for_each(|line| count_line(line, &mut old_end, &mut new_end));
        let (old_range, new_range) =
            (describe_range(old_line, old_end), describe_range(new_line, new_end));
        let _ = writeln!(text, "@@ -{old_range} +{new_range} @@");
        for line in &lines[start..end] {
            let (sign, content) = match line {
                ChangedLine::Kept(content) => (' ', content),
                ChangedLine::Removed(content) => ('-', content),
                ChangedLine::Added(content) => ('+', content),
            };
            text.push(sign);
            text += content;
            if !content.ends_with('\n') {
                text += "\n\\ No newline at end of file\n";
            }
        }
        (at, old_line, new_line) = (end, old_end, new_end);
    }
    text
}

fn count_line(line: &ChangedLine<'_>, old: &mut usize, new: &mut usize) {
    *old += usize::from(!matches!(line, ChangedLine::Added(_)));
    *new += usize::from(!matches!(line, ChangedLine::Removed(_)));
}

/// `FIRST,COUNT`, with the first line counted from 1; of no lines, the one before.
fn describe_range(from: usize, to: usize) -> String {
    let first = if to > from { from + 1 } else { from };
    format!("{first},{}", to - from)
}

/// The ranges of lines that are shown: changes with the lines around them.
fn find_hunks(lines: &[ChangedLine<'_>]) -> Vec<(usize, usize)> {
    let mut hunks: Vec<(usize, usize)> = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        if matches!(line, ChangedLine::Kept(_)) {
            continue;
        }
        let (start, end) = (index.saturating_sub(CONTEXT), (index + 1 + CONTEXT).min(lines.len()));
        match hunks.last_mut() {
            Some(last) if start <= last.1 => last.1 = end,
            _ => hunks.push((start, end)),
        }
    }
    hunks
}

fn compare_lines<'a>(old: &[&'a str], new: &[&'a str]) -> Vec<ChangedLine<'a>> {
    let same = |one: &&&'a str, other: &&&'a str| one == other;
    let begin = old.iter().zip(new).take_while(|(one, other)| same(one, other)).count();
    let (old_rest, new_rest) = (&old[begin..], &new[begin..]);
    let reversed = old_rest.iter().rev().zip(new_rest.iter().rev());
    let end = reversed.take_while(|(one, other)| same(one, other)).count();
    let (old_middle, old_end) = old_rest.split_at(old_rest.len() - end);
    let new_middle = &new_rest[..new_rest.len() - end];
    let kept =
        |lines: &[&'a str]| lines.iter().map(|line| ChangedLine::Kept(line)).collect::<Vec<_>>();
    let mut lines = kept(&old[..begin]);
    lines.extend(compare_middle(old_middle, new_middle));
    lines.extend(kept(old_end));
    lines
}

/// By the longest common subsequence.
fn compare_middle<'a>(old: &[&'a str], new: &[&'a str]) -> Vec<ChangedLine<'a>> {
    let columns = new.len() + 1;
    if (old.len() + 1).saturating_mul(columns) > MOST_PAIRS {
        let removed = old.iter().map(|line| ChangedLine::Removed(line));
        return removed.chain(new.iter().map(|line| ChangedLine::Added(line))).collect();
    }
    // The length of the longest common subsequence of what is left from each pair on.
    let mut longest = vec![0_u32; (old.len() + 1) * columns];
    for row in (0..old.len()).rev() {
        for column in (0..new.len()).rev() {
            longest[row * columns + column] = if old[row] == new[column] {
                longest[(row + 1) * columns + column + 1] + 1
            } else {
                longest[(row + 1) * columns + column].max(longest[row * columns + column + 1])
            };
        }
    }
    let (mut row, mut column, mut lines) = (0, 0, Vec::new());
    while row < old.len() || column < new.len() {
        let is_same = row < old.len() && column < new.len() && old[row] == new[column];
        let after_removal = |row: usize| longest[(row + 1) * columns + column];
        if is_same {
            lines.push(ChangedLine::Kept(old[row]));
            (row, column) = (row + 1, column + 1);
        } else if column == new.len()
            || (row < old.len() && after_removal(row) >= longest[row * columns + column + 1])
        {
            lines.push(ChangedLine::Removed(old[row]));
            row += 1;
        } else {
            lines.push(ChangedLine::Added(new[column]));
            column += 1;
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(old: &str, new: &str, expected: &str) {
        assert_eq!(unified_difference("a", old, new), expected);
    }

    #[test]
    fn changes_are_shown_with_the_lines_around_them() {
        check("a\nb\n", "a\nb\n", "");
        check(
            "1\n2\n3\n4\n5\n6\n7\n8\n9\n",
            "1\n2\n3\n4\n5\nx\ny\n6\n7\n8\n",
            "--- a\n+++ a\n@@ -3,7 +3,8 @@\n 3\n 4\n 5\n+x\n+y\n 6\n 7\n 8\n-9\n",
        );
        check("", "x\n", "--- a\n+++ a\n@@ -0,0 +1,1 @@\n+x\n");
        check(
            "a\nb",
            "a\nc\n",
            "--- a\n+++ a\n@@ -1,2 +1,2 @@\n a\n-b\n\\ No newline at end of file\n+c\n",
        );
    }

    #[test]
    fn distant_changes_are_hunks_of_their_own() {
        let old: String = (0..30).map(|line| format!("{line}\n")).collect();
        let new = old.replace("\n4\n", "\nx\n").replace("\n25\n", "\n");
        let text = unified_difference("a", &old, &new);
        assert_eq!(text.matches("@@ -").count(), 2, "{text}");
        assert!(text.contains("@@ -2,7 +2,7 @@") && text.contains("@@ -23,7 +23,6 @@"), "{text}");
    }

    #[test]
    fn the_difference_of_large_texts_is_bounded() {
        let old: String = (0..3_000).map(|line| format!("{line}\n")).collect();
        let new: String = (0..3_000).map(|line| format!("x{line}\n")).collect();
        let text = unified_difference("a", &old, &new);
        assert_eq!(text.lines().count(), 3 + 6_000);
    }
}
