//! `armor new NAME`: the project of a component that builds and runs.

mod cmake;
mod script;
pub mod sdk;
mod type_name;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use armor_robotfile::RESERVED_NAMES;
use armor_wire::name::is_name;
use clap::{Args, CommandFactory};

use crate::arguments::OutputFormat;
use crate::command_line::CommandLine;
use crate::exit::CommandEnding;
use crate::kinds::stock::STOCK;
use crate::print::{end_printing, print_line};
use crate::verb::Verb;
use cmake::CmakeLanguage;
use sdk::{SdkSource, VENDORED};
use type_name::type_name_in;

const MAIN: &str = include_str!("new/main.rs.txt");
/// The files of a project, with `{{name}}`, `{{Type}}` and `{{sdk}}` to be filled in.
const FILES: [(&str, &str); 4] = [
    ("Cargo.toml", include_str!("new/Cargo.toml.txt")),
    ("src/main.rs", MAIN),
    ("README.md", include_str!("new/README.md.txt")),
    (".gitignore", "/target\n"),
];

/// Names under which no package builds: Rust's keywords and crates, and folders of cargo.
const UNBUILDABLE: &[&str] = &[
    "abstract",
    "alloc",
    "as",
    "async",
    "await",
    "become",
    "box",
    "break",
    "build",
    "const",
    "continue",
    "core",
    "crate",
    "deps",
    "do",
    "dyn",
    "else",
    "enum",
    "examples",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gen",
    "if",
    "impl",
    "in",
    "incremental",
    "let",
    "loop",
    "macro",
    "match",
    "mod",
    "move",
    "mut",
    "override",
    "priv",
    "proc_macro",
    "pub",
    "ref",
    "return",
    "self",
    "static",
    "std",
    "struct",
    "super",
    "test",
    "trait",
    "true",
    "try",
    "type",
    "typeof",
    "unsafe",
    "unsized",
    "use",
    "virtual",
    "where",
    "while",
    "yield",
];

/// Create the project of a new component.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor new blinker                       uses the SDK next to this program, or Armor's sources
  armor new blinker --vendor              with a copy of the SDK inside the project
  armor new blinker --path parts/blinker --sdk ~/armor/sdk
  armor new blinker --python              a script in Python, with its test
  armor new blinker --c                   in C, for CMake and the package Armor; or --cpp")]
pub struct NewArguments {
    /// Name of the component: its kind, its folder and its package.
    pub name: String,
    /// Folder to write. Default: NAME in the current one.
    #[arg(long, value_name = "DIR")]
    pub path: Option<PathBuf>,
    /// Folder of armor-sdk. Default: a copy in the folder `sdk` next to this program, else the
    /// sources that this program was built from.
    #[arg(long, value_name = "DIR")]
    pub sdk: Option<PathBuf>,
    /// Copy armor-sdk into the project, which then needs no other folder.
    #[arg(long)]
    pub vendor: bool,
    /// Write a component in Python: a script, which needs the package `armor` (docs/python.md).
    #[arg(long, conflicts_with_all = ["c", "cpp", "sdk", "vendor"])]
    pub python: bool,
    /// A component in C, which CMake builds with the package Armor (sdk/c/install.sh).
    #[arg(long, conflicts_with_all = ["cpp", "sdk", "vendor"])]
    pub c: bool,
    /// A component in C++, built in the same way.
    #[arg(long, conflicts_with_all = ["sdk", "vendor"])]
    pub cpp: bool,
}

impl Verb for NewArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        Ok(create_project(&self)?.into())
    }
}

/// Writes the project.
///
/// # Errors
/// If the name is not valid, the folder exists already, or armor-sdk is not found.
fn create_project(arguments: &NewArguments) -> Result<CommandEnding> {
    let name = &arguments.name;
    if !is_name(name) || name != &name.to_lowercase() {
        bail!(
            "`{name}` cannot be the name of a kind: it starts with a letter and has small letters, \
             digits, _ and -"
        );
    }
    if let Some(why) = explain_taken(name) {
        let stem = match name.trim_start_matches("armor").trim_start_matches(['-', '_']) {
            "" => "my",
            stem => stem,
        };
        bail!("a component cannot be named {name}: {why}; for example: armor new {stem}-component");
    }
    let folder = arguments.path.clone().unwrap_or_else(|| PathBuf::from(name));
    if folder.exists() {
        bail!("{} exists already; remove it or give another --path", folder.display());
    }
    if arguments.python {
        return create_script(name, &folder);
    }
    match (arguments.c, arguments.cpp) {
        (true, _) => create_cmake_project(name, &folder, CmakeLanguage::C),
        (_, true) => create_cmake_project(name, &folder, CmakeLanguage::Cpp),
        _ => create_rust_project(arguments, &folder),
    }
}

fn create_cmake_project(
    name: &str,
    folder: &Path,
    language: CmakeLanguage,
) -> Result<CommandEnding> {
    for (file, text) in language.fill_files(name) {
        write_file(folder, file, &text)?;
    }
    let at = folder.display();
    end_printing(print_line(format_args!(
        "{at} is created. Next, with PREFIX where sdk/c/install.sh has installed the package Armor \
         (without `-D…` where `armor-dev` is installed):\n  \
         cd {at} && cmake -B build -DCMAKE_PREFIX_PATH=PREFIX && cmake --build build && ctest --test-dir \
         build\nand read its README.md."
    )))
}

fn write_file(folder: &Path, file: &str, text: &str) -> Result<()> {
    let path = folder.join(file);
    let written =
        fs::create_dir_all(path.parent().unwrap_or(folder)).and_then(|()| fs::write(&path, text));
    written.with_context(|| format!("{} cannot be written", path.display()))
}

fn create_rust_project(arguments: &NewArguments, folder: &Path) -> Result<CommandEnding> {
    let name = &arguments.name;
    let source = SdkSource::find(arguments.sdk.as_deref())?;
    // A copy next to the program would move with it, so the project gets its own.
    let is_copied =
        arguments.vendor || (arguments.sdk.is_none() && matches!(source, SdkSource::Copy(_)));
    let sdk = if is_copied { PathBuf::from(VENDORED).join("sdk") } else { source.crate_folder() };
    for (file, text) in FILES {
        let text = text
            .replace("{{name}}", name)
            .replace("{{Type}}", &type_name_in(MAIN, name))
            .replace("{{sdk}}", &sdk.display().to_string());
        write_file(folder, file, &text)?;
    }
    let at = folder.display();
    let origin = if is_copied {
        source.copy_to(&folder.join(VENDORED))?;
        format!("copied into {at}/{VENDORED} from {source}")
    } else {
        format!("used from {source}")
    };
    end_printing(print_line(format_args!(
        "{at} is created; armor-sdk is {origin}. Next:\n  cd {at} && cargo test && cargo run -- --describe\nand read its \
         README.md."
    )))
}

/// Writes the project of a component in Python.
fn create_script(name: &str, folder: &Path) -> Result<CommandEnding> {
    if script::is_taken(name) {
        bail!(
            "a component in Python cannot be named {name}: Python has a module or a word of that \
             name; for example: armor new {name}-component --python"
        );
    }
    let at = folder.display();
    let written = script::write_files(folder, name, &type_name_in(MAIN, name));
    written.with_context(|| format!("{at} cannot be written"))?;
    let module = script::module_name(name);
    end_printing(print_line(format_args!(
        "{at} is created. With the package `armor` in your Python, next:\n  cd {at} && python3 -m \
         unittest && ./{module}.py --describe\nand read its README.md."
    )))
}

/// Returns why a name that is well formed cannot be used; none if it can.
fn explain_taken(name: &str) -> Option<&'static str> {
    let is_command = || CommandLine::command().get_subcommands().any(|it| it.get_name() == name);
    if STOCK.iter().any(|stock| stock.kind == name) {
        Some("it is the kind of a stock component")
    } else if RESERVED_NAMES.contains(&name) {
        Some("the name is reserved for Armor's own programs and logs")
    } else if name == "armor" || name.starts_with("armor-") || name.starts_with("armor_") {
        Some("`armor` and names that begin with `armor-` belong to Armor's own packages")
    } else if is_command() {
        Some("it is a command of `armor`")
    } else if UNBUILDABLE.contains(&name) {
        Some("cargo or Rust uses the name itself, so the project would not build")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

    fn new(name: &str, path: PathBuf) -> Result<CommandEnding> {
        create_project(&NewArguments {
            name: name.into(),
            path: Some(path),
            sdk: None,
            vendor: false,
            python: false,
            c: false,
            cpp: false,
        })
    }

    #[test]
    fn a_project_is_written_once_and_has_nothing_left_to_fill_in() {
        let scratch = ScratchFolder::new("new");
        let folder = scratch.path().join("laser-scanner");
        new("laser-scanner", folder.clone()).expect("written");
        for (file, _) in FILES {
            let text = fs::read_to_string(folder.join(file)).expect("it exists");
            assert!(!text.contains("{{"), "{file}: {text}");
        }
        let main = fs::read_to_string(folder.join("src/main.rs")).expect("it exists");
        assert!(main.contains("struct LaserScanner"), "{main}");
        let error = new("laser-scanner", folder).expect_err("it exists already");
        assert!(error.to_string().contains("--path"), "{error}");
    }

    #[test]
    fn a_project_with_its_own_copy_names_no_folder_outside() {
        let scratch = ScratchFolder::new("new-vendored");
        let folder = scratch.path().join("imu");
        let (name, path) = ("imu".into(), Some(folder.clone()));
        let arguments = NewArguments {
            name,
            path,
            sdk: None,
            vendor: true,
            python: false,
            c: false,
            cpp: false,
        };
        create_project(&arguments).expect("written");
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).expect("it exists");
        assert!(manifest.contains("path = \"vendor/armor/sdk\""), "{manifest}");
        assert!(folder.join("vendor/armor/sdk/src/lib.rs").is_file());
    }

    #[test]
    fn the_type_is_no_other_of_the_file() {
        for (name, expected) in [
            ("laser-scanner", "LaserScanner"),
            ("imu", "Imu"),
            ("count", "CountComponent"),
            ("armor", "ArmorComponent"),
            ("self", "SelfComponent"),
        ] {
            assert_eq!(type_name_in(MAIN, name), expected);
        }
    }

    #[test]
    fn what_is_no_name_is_refused() {
        let scratch = ScratchFolder::new("new-bad");
        for name in ["", "9lives", "../up", "a b", "Laser", "größe", "simulator"] {
            let folder = scratch.path().join("x");
            assert!(new(name, folder.clone()).is_err(), "{name}");
            assert!(!folder.exists());
        }
    }

    #[test]
    fn a_name_that_is_taken_is_refused_with_the_reason_and_another_one() {
        let scratch = ScratchFolder::new("new-taken");
        for (name, why, other) in [
            ("all", "reserved", "all-component"),
            ("executive", "reserved", "executive-component"),
            ("armor-sdk", "Armor's own packages", "sdk-component"),
            ("armor", "Armor's own packages", "my-component"),
            ("watch", "a command of `armor`", "watch-component"),
            ("homing", "a stock component", "homing-component"),
            ("self", "would not build", "self-component"),
        ] {
            let error = new(name, scratch.path().join("x")).expect_err(name).to_string();
            assert!(error.contains(why), "{error}");
            assert!(error.ends_with(&format!("armor new {other}")), "{error}");
            assert!(explain_taken(other).is_none() && is_name(other), "{other}");
        }
    }
}
