//! Our kinds that are separate programs in the folder of this one, since they open a window or serve
//! another program, so that a robot does not need to carry them.

use std::path::{Path, PathBuf};

/// Each kind, and the program (and package) that runs it.
const PROGRAMS: &[(&str, &str)] =
    &[("foxglove", "armor-foxglove"), ("operator-view", "armor-operator-view")];

/// Returns the folder of this program.
pub fn own_folder() -> Option<PathBuf> {
    std::env::current_exe().ok()?.parent().map(Path::to_path_buf)
}

/// Returns the programs that exist in `folder`.
pub fn list_programs(folder: Option<&Path>) -> impl Iterator<Item = PathBuf> {
    let paths = PROGRAMS.iter().filter_map(move |(_, program)| Some(folder?.join(program)));
    paths.filter(|path| path.is_file())
}

/// Returns whether `path` is the program of a kind.
pub fn is_program(path: &Path, kind: &str) -> bool {
    PROGRAMS.iter().any(|(known, program)| *known == kind && path.ends_with(program))
}

/// Returns how to get one of these kinds if its program is missing.
pub fn suggest_build(kind: &str) -> Option<String> {
    let (_, program) = PROGRAMS.iter().find(|(known, _)| *known == kind)?;
    Some(format!(
        "it is a separate program next to `armor`: build it with `cargo build --release -p {program}`, or \
         install the package `{program}`"
    ))
}
