//! The panics that processes print before they end: the reason of their end, place and message.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Longest message that is kept, in characters.
const MAX_MESSAGE_LEN: usize = 200;

/// The last panic of each process. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct LastPanics(Arc<Mutex<BTreeMap<Arc<str>, NotedPanic>>>);

#[derive(Debug)]
struct NotedPanic {
    /// As `FILE:LINE`.
    place: String,
    /// None until the next line has come.
    message: Option<String>,
}

impl LastPanics {
    /// Reads a line of a process's error output.
    pub fn note_line(&self, name: &Arc<str>, line: &str) {
        let mut panics = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = find_place(line) {
            panics.insert(name.clone(), NotedPanic { place, message: None });
        } else if let Some(panic) = panics.get_mut(name)
            && panic.message.is_none()
        {
            panic.message = Some(line.trim().chars().take(MAX_MESSAGE_LEN).collect());
        }
    }

    /// Takes the last panic of a process that has ended, in words.
    pub fn take(&self, name: &str) -> Option<String> {
        let mut panics = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let NotedPanic { place, message } = panics.remove(name)?;
        let message = message.filter(|message| !message.is_empty());
        Some(format!(
            "panicked at {place}{}",
            message.map(|it| format!(": {it}")).unwrap_or_default()
        ))
    }
}

/// Returns the place of `thread 'main' (7) panicked at src/main.rs:12:5:`, without its column.
fn find_place(line: &str) -> Option<String> {
    let (thread, place) = line.split_once(" panicked at ")?;
    if !thread.trim_start().starts_with("thread '") {
        return None;
    }
    let place = place.trim_end().trim_end_matches(':');
    let without_column = place.rsplit_once(':').filter(|(before, _)| before.contains(':'));
    Some(without_column.map_or(place, |(before, _)| before).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_its_place_and_the_first_line_of_its_message() {
        let (panics, name): (_, Arc<str>) = (LastPanics::default(), "arm".into());
        for line in [
            "INFO ready",
            "thread 'main' (7) panicked at src/main.rs:12:5:",
            "no power",
            "note: run",
        ] {
            panics.note_line(&name, line);
        }
        assert_eq!(panics.take("leg"), None);
        assert_eq!(panics.take("arm").as_deref(), Some("panicked at src/main.rs:12: no power"));
        assert_eq!(panics.take("arm"), None);
    }

    #[test]
    fn only_the_last_panic_is_kept_and_a_message_may_be_missing() {
        let (panics, name): (_, Arc<str>) = (LastPanics::default(), "arm".into());
        panics.note_line(&name, "the arm panicked at noon");
        assert_eq!(panics.take("arm"), None);
        for line in ["thread 'a' panicked at a.rs:1:1:", "x", "thread 'b' panicked at b.rs:2:2:"] {
            panics.note_line(&name, line);
        }
        assert_eq!(panics.take("arm").as_deref(), Some("panicked at b.rs:2"));
    }
}
