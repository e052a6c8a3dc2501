//! What a folder offers to open, and what a typed path means. No window: the dialog shows it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Entries shown of one folder; in a larger one the user types.
const MAX_ENTRIES: usize = 2000;

/// One line of a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its name, as shown; what is not UTF-8 is replaced.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
    /// Whether one goes into it rather than opening it.
    pub is_folder: bool,
}

/// The folders and the files of `folder` that end with `ending`, or all if that is empty; folders
/// first, by name. Hidden ones are left out.
///
/// # Errors
/// If the folder cannot be read.
pub fn entries(folder: &Path, ending: &str) -> io::Result<Vec<Entry>> {
    let found = fs::read_dir(folder)?.flatten();
    let entries = found.filter_map(|found| entry(&found, ending));
    let mut entries: Vec<_> = entries.take(MAX_ENTRIES).collect();
    entries.sort_by_key(|entry| (!entry.is_folder, entry.name.to_lowercase(), entry.name.clone()));
    Ok(entries)
}

fn entry(entry: &fs::DirEntry, ending: &str) -> Option<Entry> {
    let name = entry.file_name().to_string_lossy().into_owned();
    if name.starts_with('.') {
        return None;
    }
    let path = entry.path();
    // Through a link: what it leads to counts.
    let is_folder = fs::metadata(&path).ok()?.is_dir();
    let ends_so = || path.extension().is_some_and(|its| its.eq_ignore_ascii_case(ending));
    let is_wanted = is_folder || ending.is_empty() || ends_so();
    is_wanted.then_some(Entry { name, path, is_folder })
}

/// The path that the user means who types `typed` while looking at `folder`: `~` is the home, and
/// what is relative counts from the folder.
pub fn meant(folder: &Path, home: Option<&Path>, typed: &str) -> PathBuf {
    let typed = typed.trim_start();
    let at_home = typed.strip_prefix('~').filter(|rest| rest.is_empty() || rest.starts_with('/'));
    match (at_home, home) {
        (Some(rest), Some(home)) => home.join(rest.trim_start_matches('/')),
        _ => folder.join(typed),
    }
}

/// What the path may continue as: the text as far as all possibilities agree, and these.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Completion {
    /// The typed text, longer if there is only one way to continue.
    pub typed: String,
    /// What begins so.
    pub choices: Vec<Entry>,
}

/// The folders of a typed path up to its last slash, and what is begun behind.
pub fn parts(typed: &str) -> (&str, &str) {
    typed.split_at(typed.rfind('/').map_or(0, |slash| slash + 1))
}

/// Completes a typed path as a shell does. `listed` are the entries of the folder that the path has
/// reached. Case is ignored only if nothing matches otherwise.
pub fn complete(listed: &[Entry], typed: &str) -> Completion {
    let (parent, begun) = parts(typed);
    let lower = begun.to_lowercase();
    let exact = |entry: &&Entry| entry.name.starts_with(begun);
    let loose = |entry: &&Entry| entry.name.to_lowercase().starts_with(&lower);
    let mut choices: Vec<Entry> = listed.iter().filter(exact).cloned().collect();
    if choices.is_empty() {
        choices = listed.iter().filter(loose).cloned().collect();
    }
    let typed = match choices.as_slice() {
        [] => typed.to_owned(),
        [only] => format!("{parent}{}{}", only.name, if only.is_folder { "/" } else { "" }),
        [first, others @ ..] => {
            let shared = others.iter().fold(first.name.as_str(), |a, b| shared(a, &b.name));
            // Never less than what was typed, which may differ in case.
            if shared.len() >= begun.len() { format!("{parent}{shared}") } else { typed.to_owned() }
        }
    };
    Completion { typed, choices }
}

/// What both begin with.
fn shared<'a>(a: &'a str, b: &str) -> &'a str {
    let same = a.char_indices().zip(b.chars()).find(|((_, one), other)| one != other);
    match same {
        Some(((at, _), _)) => &a[..at],
        None => &a[..a.len().min(b.len())],
    }
}

/// The path to save as: a name without an ending gets this one, if it is any.
pub fn with_ending(path: PathBuf, ending: &str) -> PathBuf {
    if path.extension().is_none() && path.file_name().is_some() && !ending.is_empty() {
        path.with_extension(ending)
    } else {
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::scratch::Scratch;

    fn folder() -> Scratch {
        let folder = Scratch::new();
        for name in ["Rover.xml", "robot.xml", "robots.XML", "notes.txt", ".hidden.xml"] {
            fs::write(folder.path().join(name), "").expect("written");
        }
        fs::create_dir(folder.path().join("worlds")).expect("made");
        folder
    }

    #[test]
    fn folders_come_first_and_other_files_not_at_all() {
        let folder = folder();
        let names: Vec<_> =
            entries(folder.path(), "xml").expect("read").into_iter().map(|e| e.name).collect();
        assert_eq!(names, ["worlds", "robot.xml", "robots.XML", "Rover.xml"]);
    }

    #[track_caller]
    fn check(typed: &str, expected: &str, choices: usize) {
        let folder = folder();
        let listed = entries(&meant(folder.path(), None, parts(typed).0), "xml").expect("read");
        let found = complete(&listed, typed);
        assert_eq!((found.typed.as_str(), found.choices.len()), (expected, choices));
    }

    #[test]
    fn typing_goes_on_as_far_as_it_is_clear() {
        check("rob", "robot", 2);
        check("robot.", "robot.xml", 1);
        check("w", "worlds/", 1);
        check("worlds/", "worlds/", 0);
        check("ROV", "Rover.xml", 1);
        check("none", "none", 0);
    }

    #[test]
    fn a_typed_path_is_relative_absolute_or_at_home() {
        let (folder, home) = (Path::new("/here"), Some(Path::new("/home/a")));
        assert_eq!(meant(folder, home, "a.xml"), Path::new("/here/a.xml"));
        assert_eq!(meant(folder, home, "/b.xml"), Path::new("/b.xml"));
        assert_eq!(meant(folder, home, "~/c.xml"), Path::new("/home/a/c.xml"));
        assert_eq!(meant(folder, home, "~odd.xml"), Path::new("/here/~odd.xml"));
    }

    #[test]
    fn a_name_without_an_ending_gets_one() {
        assert_eq!(with_ending("/a/robot".into(), "xml"), Path::new("/a/robot.xml"));
        assert_eq!(with_ending("/a/robot.armor".into(), "xml"), Path::new("/a/robot.armor"));
    }
}
