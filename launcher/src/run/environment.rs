//! What processes get of the launcher's environment: what programs need to find files, people,
//! screens and time zones, and what the file names. Anything else, such as the tokens and passwords
//! of the shell that starts the system, stays with the launcher.

use std::ffi::{OsStr, OsString};

/// Variables that every process gets. docs/file-format.md lists them.
const KEPT: [&str; 16] = [
    "PATH",
    "LD_LIBRARY_PATH",
    "VIRTUAL_ENV",
    "HOME",
    "USER",
    "LOGNAME",
    "SHELL",
    "TMPDIR",
    "TZ",
    "LANG",
    "LANGUAGE",
    "TERM",
    "NO_COLOR",
    "DISPLAY",
    "WAYLAND_DISPLAY",
    "XAUTHORITY",
];
/// What the names of further ones begin with: locale, desktop, Armor, Rust, and graphics drivers.
const KEPT_PREFIXES: [&str; 12] = [
    "LC_", "XDG_", "ARMOR_", "RUST_", "PYTHON", "CONDA_", "LIBGL_", "MESA_", "GALLIUM_", "VK_",
    "WGPU_", "WINIT_",
];

/// Returns the variables among `all` that a process gets, with those that the file names for it.
pub fn select_variables(
    all: impl Iterator<Item = (OsString, OsString)>,
    named: &[String],
) -> Vec<(OsString, OsString)> {
    all.filter(|(name, _)| is_kept(name) || named.iter().any(|it| OsStr::new(it) == name)).collect()
}

fn is_kept(name: &OsStr) -> bool {
    let Some(name) = name.to_str() else { return false };
    KEPT.contains(&name) || KEPT_PREFIXES.iter().any(|prefix| name.starts_with(prefix))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_stay_with_the_launcher_unless_the_file_names_them() {
        let all = ["PATH", "LC_TIME", "ARMOR_LOG", "AWS_SECRET_ACCESS_KEY", "MAP_TOKEN", "PATHS"];
        let select = |named: &[&str]| -> Vec<OsString> {
            let named: Vec<String> = named.iter().map(ToString::to_string).collect();
            let all = all.iter().map(|name| (OsString::from(name), OsString::from("x")));
            select_variables(all, &named).into_iter().map(|(name, _)| name).collect()
        };
        assert_eq!(select(&[]), ["PATH", "LC_TIME", "ARMOR_LOG"]);
        assert_eq!(select(&["MAP_TOKEN"]), ["PATH", "LC_TIME", "ARMOR_LOG", "MAP_TOKEN"]);
    }

    #[test]
    fn the_documentation_lists_every_variable() {
        let text = include_str!("../../../docs/file-format.md");
        let line = text.lines().find(|line| line.contains("`LD_LIBRARY_PATH`")).expect("a list");
        for name in KEPT {
            assert!(line.contains(&format!("`{name}`")), "{name}");
        }
        for prefix in KEPT_PREFIXES {
            assert!(line.contains(&format!("`{prefix}…`")), "{prefix}");
        }
    }
}
