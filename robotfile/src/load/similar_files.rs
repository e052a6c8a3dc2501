//! The file that was probably meant by the name of one that does not exist.

use std::path::{Path, PathBuf};

use crate::code::Code;
use crate::findings::Findings;
use crate::suggestion::suggest_similar;

/// Files of a folder that are compared: the effort stays bounded whatever is in it.
const MAX_FILES: usize = 512;

/// Names in the remedy of each file that is missing the one that was probably meant: in the folder of
/// the file that names it, without `.xml`, or with a typing mistake.
pub(super) fn suggest_files(findings: &mut Findings) {
    for finding in findings.iter_mut().filter(|it| it.code == Code::IncludeMissing) {
        let Some(at) = &finding.at else { continue };
        let meant = find_meant(&at.source.folder(), Path::new(at.text()));
        if let Some(meant) = meant {
            finding.remedy =
                format!("{meant} The path is relative to the file in which it is written");
        }
    }
}

/// Returns the question for the file that was probably meant by the name of one that does not exist:
/// `did you mean robot.xml?`. `None` if the file exists, or nothing resembles its name.
pub fn suggest_file(path: &Path) -> Option<String> {
    find_meant(Path::new(""), path)
}

/// Returns the question for the file that was meant by a name that is relative to `folder`.
pub(super) fn find_meant(folder: &Path, named: &Path) -> Option<String> {
    if folder.join(named).exists() {
        return None;
    }
    let ask = |path: PathBuf| format!("did you mean {}?", path.display());
    let name = named.file_name()?;
    if named.parent().is_some_and(|parent| !parent.as_os_str().is_empty())
        && folder.join(name).is_file()
    {
        return Some(ask(name.into()));
    }
    let with_ending = named.with_extension("xml");
    if folder.join(&with_ending).is_file() {
        return Some(ask(with_ending));
    }
    let within = named.parent().unwrap_or(Path::new(""));
    let here = folder.join(within);
    let here = if here.as_os_str().is_empty() { PathBuf::from(".") } else { here };
    let entries = std::fs::read_dir(here).ok()?.flatten().take(MAX_FILES);
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let names: Vec<_> = names.filter(|name| name.ends_with(".xml")).collect();
    let name = name.to_string_lossy();
    let meant = suggest_similar(&name, names.iter().map(String::as_str))?;
    let meant = meant.trim_start_matches("did you mean ").trim_end_matches('?');
    Some(ask(within.join(meant)))
}
