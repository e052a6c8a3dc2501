//! Which kinds of components there are: the stock in this program, and every executable in the
//! component directories that describes itself. Adding one rebuilds nothing.

mod probe;
pub mod stock;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_missions::Manifests;
use armor_wire::manifest::Manifest;

/// Folder beside the system file that is looked into without being told.
const BESIDE: &str = "components";
/// More folders, separated by colons.
const VARIABLE: &str = "ARMOR_COMPONENTS";

/// A kind of component.
#[derive(Clone, Debug)]
pub struct Kind {
    /// What it says of itself.
    pub manifest: Manifest,
    /// What runs it.
    pub origin: Origin,
}

/// What runs a kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// This program.
    Stock,
    /// An executable of a component directory.
    Executable(PathBuf),
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stock => f.write_str("stock"),
            Self::Executable(path) => path.display().fmt(f),
        }
    }
}

/// All kinds, by name.
#[derive(Debug, Default)]
pub struct Catalogue {
    /// The kinds.
    pub kinds: BTreeMap<String, Kind>,
    /// Executables that could not be used, each with the reason.
    pub problems: Vec<String>,
}

impl Catalogue {
    /// The stock and what is in the `directories` given, those of the environment, and the ones
    /// beside the `files`.
    ///
    /// # Errors
    /// If a folder that was asked for cannot be read, or two things claim the same kind.
    pub fn gather<'a>(
        directories: &[PathBuf],
        files: impl IntoIterator<Item = &'a Path>,
    ) -> Result<Self> {
        let mut catalogue = Self::default();
        for stock in stock::STOCK {
            let manifest = (stock.manifest)().map_err(|fault| {
                anyhow::anyhow!("the stock component {} is broken: {fault}", stock.kind)
            })?;
            catalogue.add(Kind { manifest, origin: Origin::Stock })?;
        }
        for (path, manifest) in probe::all(&executables(directories, files)?) {
            match manifest {
                Ok(manifest) => {
                    catalogue.add(Kind { manifest, origin: Origin::Executable(path) })?;
                }
                Err(problem) => {
                    catalogue.problems.push(format!("{}: {problem}", path.display()));
                }
            }
        }
        Ok(catalogue)
    }

    /// The manifests alone.
    pub fn manifests(&self) -> Manifests {
        self.kinds.iter().map(|(name, kind)| (name.clone(), kind.manifest.clone())).collect()
    }

    fn add(&mut self, kind: Kind) -> Result<()> {
        match self.kinds.entry(kind.manifest.kind.clone()) {
            Entry::Vacant(entry) => {
                entry.insert(kind);
                Ok(())
            }
            Entry::Occupied(entry) => bail!(
                "the kind {} is there twice: {} and {}; rename or remove one",
                entry.key(),
                entry.get().origin,
                kind.origin
            ),
        }
    }
}

/// The executables of all folders, each once, in order.
fn executables<'a>(
    asked: &[PathBuf],
    files: impl IntoIterator<Item = &'a Path>,
) -> Result<Vec<PathBuf>> {
    let variable = std::env::var_os(VARIABLE).unwrap_or_default();
    let variable: Vec<_> =
        std::env::split_paths(&variable).filter(|path| !path.as_os_str().is_empty()).collect();
    let mut found = Vec::new();
    for directory in asked.iter().chain(&variable) {
        found.extend(executables_in(directory).with_context(|| {
            format!("the component directory {} cannot be read", directory.display())
        })?);
    }
    for file in files {
        let beside = file.parent().unwrap_or(Path::new("")).join(BESIDE);
        if beside.is_dir() {
            found.extend(executables_in(&beside).with_context(|| {
                format!("the component directory {} cannot be read", beside.display())
            })?);
        }
    }
    let mut once: Vec<PathBuf> = Vec::new();
    for path in found {
        if !once.contains(&path) {
            once.push(path);
        }
    }
    Ok(once)
}

fn executables_in(directory: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(directory)? {
        let path = entry?.path();
        let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
        let Ok(metadata) = path.metadata() else { continue };
        if !hidden && metadata.is_file() && metadata.permissions().mode() & 0o111 != 0 {
            found.push(path.canonicalize()?);
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;

    fn script(path: &Path, text: &str) {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        // Written aside by another process, so that no thread of this one still has it open for
        // writing when it is executed.
        let status = std::process::Command::new("/bin/sh")
            .args(["-c", "printf '%s' \"$1\" > \"$0\" && chmod +x \"$0\""])
            .arg(path)
            .arg(text)
            .status()
            .expect("sh runs");
        assert!(status.success());
    }

    fn describing(kind: &str) -> String {
        format!(
            "#!/bin/sh\necho '{{\"armor_manifest\":1,\"kind\":\"{kind}\",\"summary\":\"x\",\
             \"inputs\":[],\"outputs\":[],\"parameters\":[]}}'"
        )
    }

    #[test]
    fn executables_describe_themselves_and_broken_ones_are_findings() {
        let scratch = Scratch::new("kinds");
        let there = |name: &str| scratch.path().join("components").join(name);
        script(&there("good"), &describing("arm"));
        script(&there("silent"), "#!/bin/sh\nexit 3");
        script(&there("hanging"), "#!/bin/sh\nsleep 600 & sleep 600");
        script(&there("endless"), "#!/bin/sh\nexec yes");
        script(&there("garbage"), "#!/bin/sh\necho hello");
        std::fs::write(there("README.md"), "not executable").expect("writable");
        let file = scratch.path().join("rover.xml");
        let catalogue = Catalogue::gather(&[], [file.as_path()]).expect("gathered");
        let arm = &catalogue.kinds["arm"];
        assert!(matches!(&arm.origin, Origin::Executable(path) if path.ends_with("good")));
        let of = |name: &str| {
            let path = there(name).display().to_string();
            let found = catalogue.problems.iter().find(|problem| problem.contains(&path));
            found.unwrap_or_else(|| panic!("{name} in {:?}", catalogue.problems)).clone()
        };
        assert!(of("silent").contains("code 3"), "{}", of("silent"));
        assert!(of("hanging").contains("within"), "{}", of("hanging"));
        assert!(of("endless").contains("MiB"), "{}", of("endless"));
        assert!(of("garbage").contains("manifest"), "{}", of("garbage"));
        assert_eq!(catalogue.problems.len(), 4);
    }

    #[test]
    fn a_kind_claimed_twice_names_both() {
        let scratch = Scratch::new("twice");
        script(&scratch.path().join("one"), &describing("arm"));
        script(&scratch.path().join("two"), &describing("arm"));
        let error = Catalogue::gather(&[scratch.path().into()], []).expect_err("arm is twice");
        let text = error.to_string();
        assert!(text.contains("one") && text.contains("two") && text.contains("arm"), "{text}");
    }

    #[test]
    fn a_folder_that_was_asked_for_must_be_there() {
        let error = Catalogue::gather(&["/no/such/folder".into()], []).expect_err("it is missing");
        assert!(error.to_string().contains("/no/such/folder"), "{error}");
    }
}
