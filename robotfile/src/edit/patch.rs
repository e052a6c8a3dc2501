//! Changes of a text, gathered before they are made.

use std::ops::Range;

/// Changes of one text, in any order.
#[derive(Debug, Default)]
pub(crate) struct Patches {
    list: Vec<(Range<usize>, String)>,
}

impl Patches {
    /// Replaces bytes by a text; either may be empty. Texts put at one place keep their order.
    pub(crate) fn replace(&mut self, range: Range<usize>, text: impl Into<String>) {
        self.list.push((range, text.into()));
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Returns the text with the changes applied. Where two overlap, both removals apply.
    pub(crate) fn apply(mut self, text: &str) -> String {
        self.list.sort_by_key(|(range, _)| range.start);
        let mut out = String::with_capacity(text.len() + 256);
        let mut at = 0;
        for (range, new) in self.list {
            out.push_str(&text[at..range.start.max(at)]);
            out.push_str(&new);
            at = range.end.max(at);
        }
        out.push_str(&text[at..]);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_come_in_any_order_and_may_touch() {
        let mut patches = Patches::default();
        patches.replace(4..6, "");
        patches.replace(0..0, "<");
        patches.replace(0..0, "(");
        patches.replace(2..5, "X");
        assert_eq!(patches.apply("abcdefg"), "<(abXg");
    }
}
