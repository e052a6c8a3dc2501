//! The folder of the designer's own files. It is never next to the user's files.

use std::ffi::OsString;
use std::path::PathBuf;

/// Where recent files and unsaved work are kept: `$XDG_STATE_HOME/armor/designer`, or the same
/// under `~/.local/state`. None if there is no home.
pub fn state_folder() -> Option<PathBuf> {
    folder(std::env::var_os("XDG_STATE_HOME"), std::env::var_os("HOME"), ".local/state")
}

/// Where the examples are put when there is no clone at hand: `$XDG_DATA_HOME/armor/designer`, or
/// the same under `~/.local/share`.
pub fn data_folder() -> Option<PathBuf> {
    folder(std::env::var_os("XDG_DATA_HOME"), std::env::var_os("HOME"), ".local/share")
}

/// A relative path in the variable counts as none, as the XDG specification states.
fn folder(given: Option<OsString>, home: Option<OsString>, under_home: &str) -> Option<PathBuf> {
    let absolute = |path: &PathBuf| path.is_absolute();
    let base = given
        .map(PathBuf::from)
        .filter(absolute)
        .or_else(|| Some(home.map(PathBuf::from).filter(absolute)?.join(under_home)))?;
    Some(base.join("armor").join("designer"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(given: Option<&str>, home: Option<&str>, expected: Option<&str>) {
        let found = folder(given.map(Into::into), home.map(Into::into), ".local/state");
        assert_eq!(found, expected.map(PathBuf::from));
    }

    #[test]
    fn the_variable_counts_before_the_home() {
        check(Some("/s"), Some("/home/a"), Some("/s/armor/designer"));
        check(None, Some("/home/a"), Some("/home/a/.local/state/armor/designer"));
        check(Some("relative"), Some("/home/a"), Some("/home/a/.local/state/armor/designer"));
        check(None, None, None);
    }
}
