//! Where a new project gets `armor-sdk` from, and copies of it that need nothing else of Armor's
//! sources.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::arguments::OutputFormat;
use crate::print::{end_printing, print_line};
use crate::verb::Verb;

/// Where armor-sdk was when this program was built.
const BUILT_WITH_SDK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../sdk");
/// Folders of a copy, relative to the folder of this program.
const NEXT_TO_PROGRAM: [&str; 2] = ["sdk", "../share/armor/sdk"];
/// The folder of a project's own copy, inside it.
pub const VENDORED: &str = "vendor/armor";
/// The crates of a copy: armor-sdk and what it needs of Armor.
const CRATES: [&str; 7] =
    ["sdk", "sdk/derive", "memory", "socket", "wire", "wire/derive", "wire/quantity"];
/// Parts of a crate that are not needed to build it.
const LEFT_OUT: [&str; 3] = ["target", "tests", "benches"];
/// Tables of a manifest that concern what is left out.
const LEFT_OUT_TABLES: [&str; 2] = ["[dev-dependencies]", "[[test]]"];

/// Copy armor-sdk into a folder, to create components without Armor's sources: `armor new` finds
/// the copy if it is called `sdk` and is next to this program.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor sdk ~/robot/bin/sdk                 next to a copy of this program
  cp target/release/armor ~/robot/bin/
  ~/robot/bin/armor new blinker             the project has its own copy of the SDK")]
pub struct SdkArguments {
    /// The folder to write.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

impl Verb for SdkArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        let source = SdkSource::find(None)?;
        source.copy_to(&self.folder)?;
        let line = format!("armor-sdk is copied to {} from {source}", self.folder.display());
        Ok(end_printing(print_line(line))?.into())
    }
}

/// Where armor-sdk is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SdkSource {
    /// The folder of the crate, with the others of Armor around it.
    Sources(PathBuf),
    /// A copy that `armor sdk` has made.
    Copy(PathBuf),
}

impl std::fmt::Display for SdkSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Sources(path) => write!(f, "{}, a part of Armor's sources", path.display()),
            Self::Copy(path) => write!(f, "{}, a copy made by `armor sdk`", path.display()),
        }
    }
}

impl SdkSource {
    /// Finds armor-sdk: in the given folder; otherwise a copy next to this program; otherwise the
    /// sources that this program was built from.
    ///
    /// # Errors
    /// If it is in none of them; the error names all.
    pub fn find(given: Option<&Path>) -> Result<Self> {
        let own = std::env::current_exe().ok();
        Self::find_in(given, own.as_deref().and_then(Path::parent), Path::new(BUILT_WITH_SDK))
    }

    fn find_in(given: Option<&Path>, own: Option<&Path>, built_with: &Path) -> Result<Self> {
        if let Some(path) = given {
            return Self::at(path).with_context(|| {
                format!("armor-sdk is not in {}; name its folder with --sdk DIR", path.display())
            });
        }
        let next_to = own.iter().flat_map(|own| NEXT_TO_PROGRAM.map(|folder| own.join(folder)));
        let places: Vec<PathBuf> = next_to.chain([built_with.to_path_buf()]).collect();
        if let Some(found) = places.iter().find_map(|path| Self::at(path)) {
            return Ok(found);
        }
        let places: Vec<_> = places.iter().map(|path| path.display().to_string()).collect();
        bail!(
            "armor-sdk was not found: looked in {}; install the package `armor-dev`, name its folder \
             with --sdk DIR, or copy it next to this program with `armor sdk DIR` where Armor's \
             sources are",
            places.join(", ")
        )
    }

    fn at(path: &Path) -> Option<Self> {
        let path = path.canonicalize().ok()?;
        let is_sdk = |folder: &Path| {
            let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
            manifest.contains("name = \"armor-sdk\"")
        };
        // A copy has the crates' folders inside it. The sources' own folder needs those next to it.
        if is_sdk(&path.join("sdk")) {
            return Some(Self::Copy(path));
        }
        let has_others = path.parent().is_some_and(|root| root.join("wire/Cargo.toml").is_file());
        (is_sdk(&path) && has_others).then_some(Self::Sources(path))
    }

    /// Returns the folder of the crate.
    pub fn crate_folder(&self) -> PathBuf {
        match self {
            Self::Sources(path) => path.clone(),
            Self::Copy(path) => path.join("sdk"),
        }
    }

    /// Writes a copy that needs nothing else of Armor's sources.
    ///
    /// # Errors
    /// If the folder exists already, or a file cannot be read or written.
    pub fn copy_to(&self, folder: &Path) -> Result<()> {
        if folder.exists() {
            bail!("{} exists already; remove it or name another folder", folder.display());
        }
        let root = match self {
            Self::Sources(path) => path.parent().unwrap_or(path),
            Self::Copy(path) => path,
        };
        for name in CRATES {
            copy_crate(&root.join(name), &folder.join(name))?;
        }
        for licence in ["LICENSE-APACHE", "LICENSE-MIT"] {
            let path = root.join(licence);
            if path.is_file() {
                copy_file(&path, &folder.join(licence))?;
            }
        }
        let manifest = read_text(&root.join("Cargo.toml"))?;
        write_text(&folder.join("Cargo.toml"), &reduce_workspace(&manifest))
    }
}

/// Copies a crate without tests. The crates inside its folder have copies of their own.
fn copy_crate(from: &Path, to: &Path) -> Result<()> {
    let entries = fs::read_dir(from).with_context(|| format!("{} cannot be read", from.display()));
    for entry in entries? {
        let path = entry.with_context(|| format!("{} cannot be read", from.display()))?.path();
        let Some(name) = path.file_name() else { continue };
        if LEFT_OUT.iter().any(|left_out| name == *left_out) || path.join("Cargo.toml").is_file() {
            continue;
        }
        let target = to.join(name);
        if path.is_dir() {
            copy_crate(&path, &target)?;
        } else if name == "Cargo.toml" {
            write_text(&target, &without_tables(&read_text(&path)?, &LEFT_OUT_TABLES))?;
        } else {
            copy_file(&path, &target)?;
        }
    }
    Ok(())
}

/// Returns the manifest of a workspace with the crates of a copy alone.
fn reduce_workspace(manifest: &str) -> String {
    let members: Vec<_> = CRATES.iter().map(|name| format!("{name:?}")).collect();
    let mut out = format!("[workspace]\nresolver = \"3\"\nmembers = [{}]\n", members.join(", "));
    let mut is_kept = false;
    for line in manifest.lines() {
        if line.starts_with('[') {
            is_kept = line.starts_with("[workspace.");
            if is_kept {
                out.push('\n');
            }
        }
        // A dependency inside the workspace that is not copied has no use here.
        let of_workspace = line.split_once("{ path = \"").map(|(_, rest)| rest);
        let is_left_out = of_workspace.is_some_and(|rest| {
            !CRATES.iter().any(|name| rest.strip_prefix(name).is_some_and(|it| it.starts_with('"')))
        });
        if is_kept && !is_left_out && !line.trim().is_empty() && !line.starts_with('#') {
            out += line;
            out.push('\n');
        }
    }
    out
}

fn without_tables(manifest: &str, tables: &[&str]) -> String {
    let mut out = String::new();
    let mut is_kept = true;
    for line in manifest.lines() {
        if line.starts_with('[') {
            is_kept = !tables.contains(&line.trim());
        }
        if is_kept {
            out += line;
            out.push('\n');
        }
    }
    out
}

fn read_text(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    make_folder_of(path)?;
    fs::write(path, text).with_context(|| format!("{} cannot be written", path.display()))
}

fn copy_file(from: &Path, to: &Path) -> Result<()> {
    make_folder_of(to)?;
    fs::copy(from, to).with_context(|| format!("{} cannot be copied", from.display()))?;
    Ok(())
}

fn make_folder_of(path: &Path) -> Result<()> {
    let folder = path.parent().unwrap_or(path);
    fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

    #[test]
    fn a_copy_has_what_the_crates_need_and_no_tests() {
        let scratch = ScratchFolder::new("sdk-copy");
        let copy = scratch.path().join("bin/sdk");
        let sources = SdkSource::find_in(None, None, Path::new(BUILT_WITH_SDK)).expect("found");
        assert!(matches!(sources, SdkSource::Sources(_)), "{sources:?}");
        sources.copy_to(&copy).expect("copied");
        for (file, part) in [
            ("Cargo.toml", "armor-wire = { path = \"wire\", version = \"0.1.0\" }"),
            ("Cargo.toml", "[workspace.lints.rust]"),
            ("sdk/Cargo.toml", "name = \"armor-sdk\""),
            ("sdk/derive/src/lib.rs", "proc_macro"),
            ("wire/derive/Cargo.toml", "proc-macro = true"),
            ("socket/src/lib.rs", "//!"),
        ] {
            assert!(read_text(&copy.join(file)).expect("it exists").contains(part), "{file}");
        }
        let manifest = read_text(&copy.join("Cargo.toml")).expect("it exists");
        assert!(!manifest.contains("launcher") && !manifest.contains("profile"), "{manifest}");
        assert!(!copy.join("wire/tests").exists());
        for name in CRATES {
            let manifest = read_text(&copy.join(name).join("Cargo.toml")).expect("it exists");
            assert!(!manifest.contains("dev-dependencies"), "{name}");
        }
        // A copy of the copy is the same.
        let found = SdkSource::find_in(None, Some(&scratch.path().join("bin")), Path::new("/none"));
        let found = found.expect("it is next to the program");
        assert!(matches!(found, SdkSource::Copy(_)), "{found:?}");
        let again = scratch.path().join("again");
        found.copy_to(&again).expect("copied");
        assert_eq!(read_text(&again.join("Cargo.toml")).expect("it exists"), manifest);
        assert!(found.copy_to(&again).is_err(), "nothing is overwritten");
    }

    #[test]
    fn all_places_are_named_if_it_is_in_none() {
        let own = Some(Path::new("/opt/robot/bin"));
        let error = SdkSource::find_in(None, own, Path::new("/gone/sdk")).expect_err("none");
        let text = error.to_string();
        for place in ["/opt/robot/bin/sdk", "/gone/sdk", "--sdk", "armor sdk DIR"] {
            assert!(text.contains(place), "{text}");
        }
    }
}
