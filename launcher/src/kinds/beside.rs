//! Kinds of ours that bring a window and all that it needs: programs of their own beside this one,
//! so that a robot need not carry them.

use std::path::{Path, PathBuf};

/// Each kind, and the program (and package) that runs it.
const PROGRAMS: &[(&str, &str)] = &[("operator-view", "armor-operator-view")];

/// The folder that this program is in.
pub fn folder() -> Option<PathBuf> {
    std::env::current_exe().ok()?.parent().map(Path::to_path_buf)
}

/// Those of the programs that are in `folder`.
pub fn programs(folder: Option<&Path>) -> impl Iterator<Item = PathBuf> {
    let paths = PROGRAMS.iter().filter_map(move |(_, program)| Some(folder?.join(program)));
    paths.filter(|path| path.is_file())
}

/// Whether `path` is the program of a kind.
pub fn is_program(path: &Path, kind: &str) -> bool {
    PROGRAMS.iter().any(|(known, program)| *known == kind && path.ends_with(program))
}

/// What to do if one of these kinds is not there.
pub fn remedy(kind: &str) -> Option<String> {
    let (_, program) = PROGRAMS.iter().find(|(known, _)| *known == kind)?;
    Some(format!(
        "it is a program of its own beside `armor`: `cargo build --release -p {program}` builds it"
    ))
}
