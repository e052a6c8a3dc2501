//! The kinds of components that there are: what `armor describe` prints, asked again when an
//! executable or a component directory changes.

mod watch;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use armor_robotfile::Manifests;
use armor_robotfile::model::Component;
use armor_wire::manifest::Manifest;
use serde_json::Value;

pub use watch::KindsWatch;

/// The origin of a kind that is part of the `armor` binary.
const STOCK: &str = "stock";

/// The kinds, and where they are from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kinds {
    /// None as long as no answer has arrived.
    manifests: Option<Manifests>,
    origins: BTreeMap<String, String>,
    /// What went wrong with single executables, as `armor describe` prints it.
    troubles: String,
}

/// Why it is not known which kinds there are.
#[derive(Debug, thiserror::Error)]
pub enum KindsError {
    /// No `armor` binary.
    #[error(
        "the program `armor` was not found: put it next to `armor-designer` or into PATH, or set ARMOR to its path"
    )]
    NoArmor,
    /// It cannot be started.
    #[error("{path} describe cannot be run: {reason}", path = path.display())]
    NotRun {
        /// The binary.
        path: PathBuf,
        /// Why not.
        reason: std::io::Error,
    },
    /// It failed.
    #[error("{path} describe failed: {stderr}", path = path.display())]
    Failed {
        /// The binary.
        path: PathBuf,
        /// What it printed.
        stderr: String,
    },
    /// It printed something else than manifests.
    #[error("{path} describe printed an invalid manifest: {reason}; is it another version?", path = path.display())]
    NotManifests {
        /// The binary.
        path: PathBuf,
        /// What is wrong with it.
        reason: serde_json::Error,
    },
}

impl Kinds {
    /// Kinds that all have the same origin.
    pub fn of(manifests: impl IntoIterator<Item = Manifest>, origin: &str) -> Self {
        let manifests: Manifests =
            manifests.into_iter().map(|manifest| (manifest.kind.clone(), manifest)).collect();
        let origins = manifests.keys().map(|kind| (kind.clone(), origin.to_owned())).collect();
        Self { manifests: Some(manifests), origins, troubles: String::new() }
    }

    /// Asks the `armor` binary for its own kinds and those in component directories: those given,
    /// and `components/` in `folder`.
    ///
    /// # Errors
    /// If it cannot be asked.
    pub fn ask(armor: &Path, folder: &Path, directories: &[PathBuf]) -> Result<Self, KindsError> {
        let mut command = Command::new(armor);
        command.args(["describe", "--format", "json"]).stdin(Stdio::null());
        for directory in directories {
            command.arg("--components").arg(directory);
        }
        if folder.is_dir() {
            command.current_dir(folder);
        }
        let not_run = |reason| KindsError::NotRun { path: armor.to_path_buf(), reason };
        let output = command.output().map_err(not_run)?;
        let stderr = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        // With a finding it ends with 1 and has printed the kinds that are sound all the same.
        if !output.status.success() && output.stdout.is_empty() {
            return Err(KindsError::Failed { path: armor.to_path_buf(), stderr });
        }
        let kinds = Self::read(&String::from_utf8_lossy(&output.stdout));
        let kinds =
            kinds.map_err(|reason| KindsError::NotManifests { path: armor.into(), reason })?;
        Ok(Self { troubles: stderr, ..kinds })
    }

    /// Reads what `armor describe --format json` prints: a manifest on each line, with its origin.
    ///
    /// # Errors
    /// If a line is none.
    pub fn read(lines: &str) -> Result<Self, serde_json::Error> {
        let mut kinds = Self { manifests: Some(Manifests::new()), ..Self::default() };
        for line in lines.lines().filter(|line| !line.trim().is_empty()) {
            let mut value: Value = serde_json::from_str(line)?;
            let origin = value.as_object_mut().and_then(|object| object.remove("origin"));
            let manifest: Manifest = serde_json::from_value(value)?;
            let origin = origin.as_ref().and_then(Value::as_str).unwrap_or(STOCK).to_owned();
            kinds.origins.insert(manifest.kind.clone(), origin);
            kinds.manifests.get_or_insert_default().insert(manifest.kind.clone(), manifest);
        }
        Ok(kinds)
    }

    /// The manifests by kind; none as long as no answer has arrived.
    pub fn manifests(&self) -> Option<&Manifests> {
        self.manifests.as_ref()
    }

    /// All kinds by name.
    pub fn iter(&self) -> impl Iterator<Item = &Manifest> {
        self.manifests.iter().flat_map(BTreeMap::values)
    }

    /// One kind.
    pub fn find(&self, kind: &str) -> Option<&Manifest> {
        self.manifests.as_ref()?.get(kind)
    }

    /// Why no mission can activate a component; none if one can.
    pub fn explain_uncontrolled(&self, component: &Component) -> Option<String> {
        if !component.controllable {
            return Some("controllable=\"false\": no mission controls it".to_owned());
        }
        let kind = self.find(&component.kind.value).filter(|kind| !kind.controllable)?;
        Some(format!("the kind {} is always active: no mission controls it", kind.kind))
    }

    /// All types of data that the kinds know, sorted.
    pub fn types(&self) -> std::collections::BTreeSet<&str> {
        let ports = self.iter().flat_map(|kind| kind.inputs.iter().chain(&kind.outputs));
        ports.map(|port| port.type_name.as_str()).collect()
    }

    /// Where a kind is from: `stock`, or the path of its executable.
    pub fn origin(&self, kind: &str) -> &str {
        self.origins.get(kind).map_or(STOCK, String::as_str)
    }

    /// Whether a kind is one of the `armor` binary's own.
    pub fn is_stock(&self, kind: &str) -> bool {
        self.origin(kind) == STOCK
    }

    /// What went wrong with single executables; empty if nothing did.
    pub fn troubles(&self) -> &str {
        &self.troubles
    }
}

/// The `armor` binary: named by `ARMOR`, else next to this program, else in `PATH`.
pub fn find_armor() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("ARMOR").filter(|named| !named.is_empty()) {
        return Some(absolute_program(PathBuf::from(named)));
    }
    let own = std::env::current_exe().ok().and_then(|exe| Some(exe.parent()?.join("armor")));
    let path = std::env::var_os("PATH").unwrap_or_default();
    let in_path = std::env::split_paths(&path).map(|folder| folder.join("armor"));
    own.into_iter().chain(in_path).find(|candidate| candidate.is_file())
}

/// Returns a program that is named by a path as an absolute path, since it is started in the folder of
/// the open file; a plain name is looked up in `PATH`.
fn absolute_program(named: PathBuf) -> PathBuf {
    match named.components().count() {
        1 => named,
        _ => std::path::absolute(&named).unwrap_or(named),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_named_by_a_path_is_found_from_every_folder() {
        let here = std::env::current_dir().unwrap();
        for (named, expected) in [
            ("armor", PathBuf::from("armor")),
            ("target/debug/armor", here.join("target/debug/armor")),
            ("/usr/bin/armor", PathBuf::from("/usr/bin/armor")),
        ] {
            assert_eq!(absolute_program(PathBuf::from(named)), expected);
        }
    }

    #[test]
    fn what_armor_describe_prints_is_read_with_its_origin() {
        let lines = concat!(
            r#"{"armor_manifest":1,"kind":"lamp","summary":"Shines.","inputs":[],"outputs":[],"parameters":[],"origin":"/x/lamp"}"#,
            "\n",
            r#"{"armor_manifest":1,"kind":"bell","summary":"Rings.","inputs":[],"outputs":[],"parameters":[],"origin":"stock"}"#,
        );
        let kinds = Kinds::read(lines).unwrap();
        assert_eq!(kinds.iter().map(|m| m.kind.as_str()).collect::<Vec<_>>(), ["bell", "lamp"]);
        assert_eq!((kinds.origin("lamp"), kinds.is_stock("bell")), ("/x/lamp", true));
        assert!(Kinds::read("lamp: Shines.").is_err());
    }

    #[test]
    fn a_missing_binary_is_named() {
        let error = Kinds::ask(Path::new("/nowhere/armor"), Path::new("."), &[]).unwrap_err();
        assert!(error.to_string().starts_with("/nowhere/armor describe cannot be run"), "{error}");
    }
}
