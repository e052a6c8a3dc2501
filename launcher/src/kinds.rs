//! All kinds of components: the stock in this program, our programs next to it, and every
//! executable in the component directories that describes itself. Adding one rebuilds nothing; a
//! broken one is a finding and the rest still works.

mod ask;
pub mod build;
mod cache;
mod companions;
mod folders;
mod modules;
mod probe;
mod script;
#[cfg(test)]
mod sensor_manifest;
pub mod stock;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::Result;
use armor_robotfile::{Code, Configuration, Finding, Findings, Manifests};
use armor_wire::manifest::Manifest;

pub use cache::Identity;
#[cfg(test)]
pub use sensor_manifest::sensor_manifest;

use cache::Cache;

/// A kind of component.
#[derive(Clone, Debug)]
pub struct ComponentKind {
    /// Its description of itself.
    pub manifest: Manifest,
    /// What runs it.
    pub origin: Origin,
    /// What else claims to be this kind; if there is anything, the kind cannot be used.
    pub rivals: Vec<Origin>,
}

/// What runs a kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// This program.
    Stock,
    /// An executable of a component directory, or one of our programs next to this one.
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
    pub kinds: BTreeMap<String, ComponentKind>,
    /// What in the component directories could not be used, and why.
    problems: Vec<Finding>,
    /// The executables among it, each with its kind of finding.
    broken: Vec<(PathBuf, Code)>,
    /// Files of the component directories without execute permission.
    not_executable: Vec<PathBuf>,
    /// The component directories, and whether each exists.
    searched: Vec<(PathBuf, bool)>,
}

/// Asks one executable to describe itself.
///
/// # Errors
/// In words, why it does not.
pub fn describe_executable(path: &Path) -> Result<Manifest, String> {
    let mut answers = ask::ask_executables(vec![path.to_owned()], &Cache::of_user());
    let answer = answers.pop().map(|(_, answer)| answer);
    let answer = answer.unwrap_or_else(|| Err(probe::ProbeProblem::unasked()));
    answer.map_err(|problem| problem.finding(path).message)
}

impl Catalogue {
    /// Gathers the stock, and the kinds in `directories`, in those of the environment, and in those
    /// next to the `files`.
    ///
    /// # Errors
    /// If a stock component is broken.
    pub fn gather<'a>(
        directories: &[PathBuf],
        files: impl IntoIterator<Item = &'a Path>,
    ) -> Result<Self> {
        Self::gather_with(
            &Cache::of_user(),
            companions::own_folder().as_deref(),
            directories,
            files,
        )
    }

    fn gather_with<'a>(
        cache: &Cache,
        own: Option<&Path>,
        directories: &[PathBuf],
        files: impl IntoIterator<Item = &'a Path>,
    ) -> Result<Self> {
        let mut catalogue = Self::default();
        for stock in stock::STOCK {
            let manifest = (stock.manifest)().map_err(|fault| {
                anyhow::anyhow!("the stock component {} is broken: {fault}", stock.kind)
            })?;
            catalogue.add(manifest, Origin::Stock);
        }
        let ours = companions::list_programs(own);
        let found = folders::search_folders(directories, files, &mut catalogue.problems);
        catalogue.not_executable = found.not_executable;
        catalogue.searched = found.searched;
        let executables = once(ours.chain(found.executables));
        for (path, answer) in ask::ask_executables(executables, cache) {
            match answer {
                Ok(manifest) => catalogue.add(manifest, Origin::Executable(path)),
                Err(problem) => {
                    catalogue.problems.push(problem.finding(&path));
                    catalogue.broken.push((path, problem.code()));
                }
            }
        }
        Ok(catalogue)
    }

    /// Returns the sources of all kinds: the executables, each with the identity of its build.
    pub fn sources<'a>(
        directories: &[PathBuf],
        files: impl IntoIterator<Item = &'a Path>,
    ) -> Vec<(PathBuf, Option<Identity>)> {
        let others = folders::search_folders(directories, files, &mut Vec::new()).executables;
        let executables =
            once(companions::list_programs(companions::own_folder().as_deref()).chain(others));
        let identity = |path: &PathBuf| Identity::of(path).ok();
        executables.into_iter().map(|path| (path.clone(), identity(&path))).collect()
    }

    /// The manifests alone.
    pub fn manifests(&self) -> Manifests {
        self.kinds.iter().map(|(name, kind)| (name.clone(), kind.manifest.clone())).collect()
    }

    /// What is wrong with the component directories, and with what `configuration` takes of them.
    pub fn findings(&self, configuration: Option<&Configuration>) -> Vec<Finding> {
        let mut findings = self.problems.clone();
        for (name, kind) in self.kinds.iter().filter(|(_, kind)| !kind.rivals.is_empty()) {
            let claims = [&kind.origin].into_iter().chain(&kind.rivals);
            let claims: Vec<_> = claims.map(ToString::to_string).collect();
            let message = format!("the kind {name} exists more than once: {}", claims.join(", "));
            let remedy = "remove all but one, or give the others another KIND";
            let components = configuration.iter().flat_map(|all| &all.system.components);
            let uses: Vec<_> = components.filter(|one| one.kind.value == *name).collect();
            findings.extend(uses.iter().map(|component| {
                Finding::new(Code::KindTwice, &component.kind.at, &message).remedy(remedy)
            }));
            if uses.is_empty() {
                findings.push(Finding::nowhere(Code::KindTwiceUnused, message).remedy(remedy));
            }
        }
        findings
    }

    /// Adds a remedy to the finding of each unknown kind: the unusable executable of its name, how
    /// to build it, or where it was looked for.
    pub fn point_to_broken(&self, findings: &mut Findings) {
        for finding in findings.iter_mut().filter(|finding| finding.code == Code::UnknownKind) {
            let kind = finding.at.as_ref().map(|at| at.text());
            let is_it = |path: &Path| {
                kind.is_some_and(|kind| is_named(path, kind) || companions::is_program(path, kind))
            };
            if let Some(remedy) = kind.and_then(companions::suggest_build) {
                finding.remedy = remedy;
            }
            if let Some((path, code)) = self.broken.iter().find(|(path, _)| is_it(path)) {
                let (path, code) = (path.display(), code.as_str());
                finding.remedy = format!("{path} exists, but did not describe itself ({code})");
            } else if let Some(path) =
                self.not_executable.iter().find(|path| is_it(path) && !is_text(path))
            {
                let path = path.display();
                finding.remedy = format!("{path} exists, but is not executable: chmod +x {path}");
            } else if let Some((path, other)) = self.find_executable(is_it) {
                let path = path.display();
                finding.remedy = format!("{path} is the kind {other}: write kind=\"{other}\"");
            } else if !finding.remedy.starts_with("did you mean")
                && kind.and_then(companions::suggest_build).is_none()
            {
                finding.remedy += "; ";
                finding.remedy += &self.describe_folders();
            }
        }
    }

    /// Returns an executable of a kind, and that kind.
    fn find_executable(&self, is_it: impl Fn(&Path) -> bool) -> Option<(&Path, &str)> {
        self.kinds.iter().find_map(|(name, kind)| match &kind.origin {
            Origin::Executable(path) if is_it(path) => Some((path.as_path(), name.as_str())),
            _ => None,
        })
    }

    /// Where a kind was looked for, and whether an executable of its name is another one.
    pub fn describe_search(&self, kind: &str) -> String {
        let is_it = |path: &Path| path.file_stem() == Some(kind.as_ref());
        match self.find_executable(is_it) {
            Some((path, other)) => format!("{} is the kind {other}", path.display()),
            None => format!("{}; --components names another folder", self.describe_folders()),
        }
    }

    /// Where kinds were looked for, and what there could have been one.
    fn describe_folders(&self) -> String {
        let folders = self.searched.iter().map(|(folder, exists)| {
            let missing = if *exists { "" } else { ", which does not exist" };
            format!("{}{missing}", folder.display())
        });
        let places: Vec<_> = std::iter::once("armor itself".to_owned()).chain(folders).collect();
        let scripts = self.not_executable.iter().filter(|path| is_script(path));
        let scripts: Vec<_> = scripts.map(|path| path.display().to_string()).collect();
        let scripts = match &scripts[..] {
            [] => String::new(),
            [one] => format!("; {one} is a script, but is not executable: chmod +x {one}"),
            several => format!("; these are scripts, but not executable: {}", several.join(", ")),
        };
        format!("looked in {}{scripts}", places.join("; in "))
    }

    fn add(&mut self, manifest: Manifest, origin: Origin) {
        match self.kinds.entry(manifest.kind.clone()) {
            Entry::Vacant(entry) => {
                entry.insert(ComponentKind { manifest, origin, rivals: Vec::new() });
            }
            Entry::Occupied(mut entry) => entry.get_mut().rivals.push(origin),
        }
    }
}

/// Returns whether a file begins as a script does.
fn is_script(path: &Path) -> bool {
    let mut first = [0; 2];
    std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut first)).is_ok()
        && first == *b"#!"
}

/// Returns each executable once, even if several links lead to it.
fn once(found: impl Iterator<Item = PathBuf>) -> Vec<PathBuf> {
    let mut once: Vec<PathBuf> = Vec::new();
    for path in found {
        let path = path.canonicalize().unwrap_or(path);
        if !once.contains(&path) {
            once.push(path);
        }
    }
    once
}

/// Whether a file is named after the kind; a module of Python has `_` in the place of `-`.
fn is_named(path: &Path, kind: &str) -> bool {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().replace('_', "-"));
    stem.is_some_and(|stem| stem == kind.replace('_', "-"))
}

/// Whether a file is a text that is never executed: the system's file may be named after a kind.
fn is_text(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "xml" || extension == "md")
}
