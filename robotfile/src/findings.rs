//! All findings of one reading: bounded, sorted, and each mistake once.

use crate::code::Code;
use crate::finding::{Finding, Severity};
use crate::source::Span;

/// The findings that are kept of one reading. A file with a million problems is refused for the
/// first few hundred, and a list without end helps no user.
pub const MAX_FINDINGS: usize = 500;

/// All findings of a reading, at most [`MAX_FINDINGS`].
#[derive(Clone, Debug, Default)]
pub struct Findings {
    list: Vec<Finding>,
    left_out: usize,
    /// Whether the list ends with the finding that counts those left out, if there are any.
    is_finished: bool,
    /// Start tags about which no findings are kept, in the order of the file.
    ignored: Vec<Span>,
    /// The findings about them.
    ignored_count: usize,
}

impl Findings {
    /// Returns an empty list for one file that keeps no findings about some start tags, which are in
    /// the order of the file. They count in [`Self::total`].
    pub(crate) fn ignoring(tags: Vec<Span>) -> Self {
        Self { ignored: tags, ..Self::default() }
    }

    fn is_ignored(&self, finding: &Finding) -> bool {
        let Some(at) = &finding.at else { return false };
        let after = self.ignored.partition_point(|tag| tag.start() <= at.span.start());
        let tag = after.checked_sub(1).and_then(|last| self.ignored.get(last));
        tag.is_some_and(|tag| at.span.end() <= tag.end())
    }

    /// Adds a finding, or counts it if the list is full. An error then replaces a warning: a file
    /// must not be accepted because it has many warnings. Another mention of an unknown name is
    /// merged into the first.
    pub fn push(&mut self, finding: Finding) {
        self.list.pop_if(|last| last.code == Code::More);
        if self.is_ignored(&finding) {
            self.ignored_count += 1;
        } else if finding.code == Code::More {
            self.left_out += finding.more;
        } else if let Some(first) = self.find_same_name(&finding) {
            first.fold_mention(finding);
        } else if self.list.len() < MAX_FINDINGS {
            self.list.push(finding);
        } else {
            self.left_out += 1;
            self.make_room(finding);
        }
        self.add_left_out();
    }

    fn find_same_name(&mut self, finding: &Finding) -> Option<&mut Finding> {
        if !finding.is_about_name() {
            return None;
        }
        self.list.iter_mut().find(|other| other.is_same_name(finding))
    }

    /// Replaces a finding that is not an error by an error.
    fn make_room(&mut self, finding: Finding) {
        let is_minor = |other: &Finding| other.severity() != Severity::Error;
        if finding.severity() == Severity::Error
            && let Some(other) = self.list.iter_mut().rfind(|other| is_minor(other))
        {
            *other = finding;
        }
    }

    fn add_left_out(&mut self) {
        if self.is_finished && self.left_out > 0 {
            self.list.push(Finding::left_out(self.left_out));
        }
    }

    /// Merges each finding into the first one for which `is_same` is true: of one mistake, one finding
    /// with the other places.
    pub(crate) fn merge_same(&mut self, is_same: impl Fn(&Finding, &Finding) -> bool) {
        let mut merged: Vec<Finding> = Vec::new();
        for finding in std::mem::take(&mut self.list) {
            match merged.iter_mut().find(|first| is_same(first, &finding)) {
                Some(first) => first.merge_place(finding),
                None => merged.push(finding),
            }
        }
        self.list = merged;
    }

    /// Returns the number of findings, with those left out.
    pub(crate) fn total(&self) -> usize {
        self.list.iter().map(|finding| 1 + finding.more).sum::<usize>()
            + self.left_out
            + self.ignored_count
    }

    /// Removes the findings for which `keep` is false.
    pub(crate) fn retain(&mut self, keep: impl Fn(&Finding) -> bool) {
        self.list.retain(keep);
    }

    /// Adds all findings of another reading.
    pub fn extend(&mut self, others: impl IntoIterator<Item = Finding>) {
        others.into_iter().for_each(|finding| self.push(finding));
    }

    /// Adds the findings of another list for which `keep` is true, and the number of those that it
    /// left out.
    pub(crate) fn absorb(&mut self, others: Self, keep: impl Fn(&Finding) -> bool) {
        self.left_out += others.left_out;
        self.extend(others.list.into_iter().filter(keep));
    }

    /// Adds the findings of another reading that are new: the same code at the same location is the
    /// same mistake.
    pub fn extend_new(&mut self, others: impl IntoIterator<Item = Finding>) {
        for finding in others {
            let place = |finding: &Finding| finding.at.as_ref().map(ToString::to_string);
            let known =
                self.list.iter().any(|f| f.code == finding.code && place(f) == place(&finding));
            if !known {
                self.push(finding);
            }
        }
    }

    /// Replaces the errors and warnings by one finding, of which all of them are effects.
    pub fn replace_faults(&mut self, cause: Finding) {
        self.list.retain(|finding| finding.severity() == Severity::Note);
        self.push(cause);
    }

    /// Returns the findings that `known` does not have: the same code with the same message is the
    /// same mistake, wherever it has moved to in the file.
    #[must_use]
    pub fn without_known(&self, known: &Self) -> Self {
        let mut known: Vec<_> = known.list.iter().map(|it| (it.code, &it.message)).collect();
        let mut new = Self::default();
        for finding in &self.list {
            match known.iter().position(|it| *it == (finding.code, &finding.message)) {
                // Each known finding stands for one: a second one like it is new.
                Some(at) => drop(known.swap_remove(at)),
                None => new.push(finding.clone()),
            }
        }
        new
    }

    /// Returns whether there are no findings, not even notes.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Returns whether the file is refused.
    pub fn has_errors(&self) -> bool {
        self.count(Severity::Error) > 0
    }

    /// Returns the number of findings of a severity (among those kept).
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|finding| finding.severity() == severity).count()
    }

    /// Returns the number of findings of a severity, in words: `1 error`, `2 errors`, `500 or more
    /// errors` where some were left out; none if there are none.
    pub fn counted(&self, severity: Severity) -> Option<String> {
        Some(match self.count(severity) {
            0 => return None,
            n if self.left_out > 0 && severity != Severity::Note => {
                format!("{n} or more {severity}s")
            }
            1 => format!("1 {severity}"),
            n => format!("{n} {severity}s"),
        })
    }

    /// Returns the code of the first error, or else of the first warning.
    pub fn gravest(&self) -> Option<Code> {
        let codes = self.iter().map(|finding| finding.code);
        codes.filter(|code| code.severity() != Severity::Note).min_by_key(|code| code.severity())
    }

    /// Returns the findings in the order of the files and their lines.
    pub fn iter(&self) -> std::slice::Iter<'_, Finding> {
        self.list.iter()
    }

    /// Returns the findings, to add to them.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Finding> {
        self.list.iter_mut()
    }

    /// Returns whether the list is full, so that a suggestion need not be computed.
    pub(crate) fn is_full(&self) -> bool {
        self.list.len() >= MAX_FINDINGS
    }

    /// Returns the errors and warnings, and the finding that counts those left out.
    #[must_use]
    pub fn without_notes(&self) -> Self {
        let is_kept = |f: &&Finding| f.severity() != Severity::Note || f.code == Code::More;
        let list = self.list.iter().filter(is_kept).cloned().collect();
        Self { list, left_out: self.left_out, is_finished: self.is_finished, ..Self::default() }
    }

    /// Sorts by file and location; findings without a location come first, the one that counts
    /// those left out last.
    pub fn sort(&mut self) {
        let place = |finding: &Finding| {
            finding.at.as_ref().map(|at| (at.source.path().to_path_buf(), at.span, finding.code))
        };
        self.list.sort_by_key(|finding| (finding.code == Code::More, place(finding)));
    }

    /// Sorts, and adds the finding that counts those left out, also after later additions.
    pub(crate) fn finish(mut self) -> Self {
        self.list.retain(|finding| finding.code != Code::More);
        self.sort();
        self.is_finished = true;
        self.add_left_out();
        self
    }
}

impl IntoIterator for Findings {
    type Item = Finding;
    type IntoIter = std::vec::IntoIter<Finding>;
    fn into_iter(self) -> Self::IntoIter {
        self.list.into_iter()
    }
}

impl<'a> IntoIterator for &'a Findings {
    type Item = &'a Finding;
    type IntoIter = std::slice::Iter<'a, Finding>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finding::MAX_RELATED;
    use crate::source::Location;

    #[test]
    fn warnings_never_hide_that_there_are_errors() {
        let mut findings = Findings::default();
        for _ in 0..2 * MAX_FINDINGS {
            findings.push(Finding::nowhere(Code::NoSafePlace, "a warning"));
        }
        assert!(!findings.has_errors());
        findings.push(Finding::nowhere(Code::NoSystem, "an error"));
        assert!(findings.has_errors());
        assert_eq!(findings.count(Severity::Warning), MAX_FINDINGS - 1);
        assert_eq!(findings.counted(Severity::Error).as_deref(), Some("1 or more errors"));
        let last = findings.finish().into_iter().last().map(|finding| finding.message);
        assert_eq!(last.as_deref(), Some("501 more findings were left out"));
    }

    #[test]
    fn later_additions_are_counted_once() {
        let many = |count| {
            let mut findings = Findings::default();
            (0..count).for_each(|_| findings.push(Finding::nowhere(Code::NoSystem, "an error")));
            findings.finish()
        };
        let mut findings = many(4000);
        findings.push(Finding::nowhere(Code::NoSystem, "an error"));
        findings.push(Finding::nowhere(Code::FileMissing, "a warning"));
        findings.extend(many(501));
        findings.sort();
        for findings in [findings.without_notes(), findings.clone().finish(), findings] {
            let notes = findings.iter().filter(|finding| finding.code == Code::More);
            let notes: Vec<_> = notes.map(|finding| finding.message.as_str()).collect();
            assert_eq!(notes, ["4003 more findings were left out"]);
            assert_eq!(findings.count(Severity::Error), MAX_FINDINGS);
        }
    }

    #[test]
    fn a_name_that_is_missing_in_many_places_is_one_finding() {
        let source = crate::source::Source::new("a.xml", "laser ".repeat(1000));
        let mut findings = Findings::default();
        for n in 0..1000 {
            let at = Location::new(&source, Span::new(6 * n, 6 * n + 5));
            findings.push(Finding::new(Code::UnknownComponent, &at, "there is no laser"));
        }
        let found: Vec<_> = findings.finish().into_iter().collect();
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].message, "there is no laser; it is also named in 999 more places");
        assert_eq!(found[0].related.len(), MAX_RELATED);
    }
}
