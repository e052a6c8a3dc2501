//! The trace of a probe, and checks on it.

use std::path::Path;

/// One line of a trace.
#[derive(Clone, Debug)]
pub struct Note {
    pub at_ns: u64,
    pub pid: i32,
    pub words: Vec<String>,
}

/// All lines of a probe, from all of its processes, in the order of writing.
#[derive(Clone, Debug, Default)]
pub struct Trace(pub Vec<Note>);

/// A message that a probe received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Got {
    pub at_ns: u64,
    pub pid: i32,
    pub input: String,
    pub count: u64,
    pub lost: u64,
    /// The process start that sent it.
    pub from: String,
}

impl Trace {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        // The last line may still be in writing.
        let whole = text.rfind('\n').map_or("", |at| &text[..at]);
        Self(whole.lines().map(Note::parse).collect())
    }

    /// Returns the notes whose text is `what`.
    pub fn all(&self, what: &str) -> Vec<&Note> {
        self.0.iter().filter(|note| note.words == what.split(' ').collect::<Vec<_>>()).collect()
    }

    pub fn count(&self, what: &str) -> usize {
        self.all(what).len()
    }

    /// Returns the messages received at `input`.
    pub fn got(&self, input: &str) -> Vec<Got> {
        self.0.iter().filter_map(Note::got).filter(|got| got.input == input).collect()
    }

    /// Returns the spans of time in which the probe was certainly active: from each start to its
    /// last call, or to the last note of the same process if the process was killed.
    pub fn activations(&self) -> Vec<(u64, u64)> {
        let mut spans: Vec<(u64, u64)> = Vec::new();
        let mut open = None;
        for note in &self.0 {
            match note.words[0].as_str() {
                "started" => {
                    spans.push((note.at_ns, note.at_ns));
                    open = Some(note.pid);
                }
                _ if open == Some(note.pid) => {
                    if let Some(span) = spans.last_mut() {
                        span.1 = note.at_ns;
                    }
                }
                _ => {}
            }
            if note.words[0] == "stopping" {
                open = None;
            }
        }
        spans
    }
}

impl Note {
    fn parse(line: &str) -> Self {
        let mut words = line.split(' ').map(String::from);
        let number = |word: Option<String>| word.and_then(|word| word.parse().ok());
        let at_ns = number(words.next()).unwrap_or_else(|| panic!("a time in {line:?}"));
        let pid = number(words.next()).and_then(|pid| i32::try_from(pid).ok());
        let pid = pid.unwrap_or_else(|| panic!("a process in {line:?}"));
        Self { at_ns, pid, words: words.collect() }
    }

    fn got(&self) -> Option<Got> {
        let [what, input, count, lost, from] = &self.words[..] else { return None };
        (what == "got").then(|| Got {
            at_ns: self.at_ns,
            pid: self.pid,
            input: input.clone(),
            count: count.parse().expect("a count"),
            lost: lost.parse().expect("a count"),
            from: from.clone(),
        })
    }
}

/// Checks that no message from one process to another is missing, duplicated or out of order. The
/// check starts over when either process is replaced.
pub fn check_nothing_lost(what: &str, all: &[Got]) {
    let mut before: Option<&Got> = None;
    for got in all {
        if let Some(before) = before
            && (before.pid, &before.from) == (got.pid, &got.from)
        {
            assert_eq!(
                (before.count + 1, 0),
                (got.count, got.lost),
                "{what}: number and loss after {before:?}"
            );
        }
        before = Some(got);
    }
}

/// Checks that no two of the spans overlap.
pub fn check_apart(one: &[(u64, u64)], other: &[(u64, u64)]) {
    for a in one {
        for b in other {
            assert!(a.1 < b.0 || b.1 < a.0, "active at once: {a:?} and {b:?}");
        }
    }
}
