//! A file and those that it names → one [`Configuration`]. [`read`] is pure: the caller brings the
//! bytes; [`load`] brings them from the disk.

mod similar_files;
mod submissions;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use similar_files::suggest_file;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::Mission;
use crate::model::{Configuration, System};
use crate::read::{Contents, contents};
use crate::recover::{Recovered, recover};
use crate::source::{Location, Source, Spanned, plain_path};
use crate::xml::{MAX_FILE_BYTES, parse};

/// The result of reading a file.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The contents of the file, as far as they could be read; none if it is not XML or has no
    /// system. It may be used only if [`Self::is_valid`].
    pub configuration: Option<Configuration>,
    /// The problems of the file.
    pub findings: Findings,
    /// Every file that was requested, also missing ones: the files to watch.
    pub files: Vec<PathBuf>,
    /// Whether a part could not be read, so that things that seem to be missing may exist.
    pub(crate) is_partial: bool,
}

impl Reading {
    /// Returns whether there is a configuration without errors.
    pub fn is_valid(&self) -> bool {
        self.configuration.is_some() && !self.findings.has_errors()
    }
}

/// Reads the file at `path`, the system file and the sub-missions that it may name, taking their
/// bytes from `loader`. It checks each file separately; [`crate::check`] checks the whole.
pub fn read(path: &Path, loader: &mut dyn FnMut(&Path) -> io::Result<Vec<u8>>) -> Reading {
    read_as(path, loader, false)
}

fn read_as(
    path: &Path,
    loader: &mut dyn FnMut(&Path) -> io::Result<Vec<u8>>,
    is_copy: bool,
) -> Reading {
    let (findings, asked) = (Findings::default(), Vec::new());
    let mut files = FileReader { loader, findings, asked, is_partial: false, is_copy };
    let configuration = files.configuration(path);
    Reading {
        configuration,
        findings: files.findings,
        files: files.asked,
        is_partial: files.is_partial,
    }
}

/// Reads the file at `path` from the disk.
pub fn load(path: &Path) -> Reading {
    let mut reading = read(path, &mut read_bytes);
    similar_files::suggest_files(&mut reading.findings);
    reading
}

/// Reads a file that may be a copy, such as a backup, of the one that its sub-missions name as their
/// system.
pub fn load_copy(path: &Path) -> Reading {
    read_as(path, &mut read_bytes, true)
}

/// Returns the bytes of a file, at most one more than the limit, so that a giant or endless file
/// costs nothing. Only regular files are opened: a pipe could block the reader forever.
///
/// # Errors
/// The error of the operating system, or that it is not a regular file.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::new(ErrorKind::IsADirectory, "it is a folder"));
    }
    if !metadata.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_FILE_BYTES as u64 + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

struct FileReader<'a> {
    loader: &'a mut dyn FnMut(&Path) -> io::Result<Vec<u8>>,
    findings: Findings,
    asked: Vec<PathBuf>,
    is_partial: bool,
    /// Whether the file may have another name than its sub-missions know.
    is_copy: bool,
}

impl FileReader<'_> {
    fn configuration(&mut self, path: &Path) -> Option<Configuration> {
        self.asked.push(path.to_path_buf());
        let bytes = match (self.loader)(path) {
            Ok(bytes) => bytes,
            Err(error) => {
                let message = format!("{} cannot be read: {error}", path.display());
                let finding = Finding::of_file(Code::Unreadable, path, message);
                let meant = (error.kind() == ErrorKind::NotFound)
                    .then(|| similar_files::find_meant(Path::new(""), path))
                    .flatten();
                let remedy = match (error.kind(), meant) {
                    (_, Some(meant)) => meant,
                    (ErrorKind::IsADirectory, None) => {
                        "name the XML file in it; `armor describe KIND` shows a component".into()
                    }
                    _ => "check the path and its permissions".into(),
                };
                self.findings.push(finding.remedy(remedy));
                return None;
            }
        };
        let (source, Contents { system, mission, at }) = self.contents(path, &bytes)?;
        let (system, mut sources) = match (system, &mission) {
            (Some(system), None | Some(Mission { system: None, .. })) => (Some(system), Vec::new()),
            (Some(system), Some(Mission { system: Some(named), .. })) => {
                let message = "the mission names a system file, but its own file has a system too";
                let finding = Finding::new(Code::TwoSystems, &named.at, message);
                self.findings.push(finding.remedy("remove system=\"…\" or the <system>"));
                self.fuller_system(path, system, named)
            }
            (None, Some(Mission { system: Some(named), .. })) => self.named_system(path, named),
            (None, _) => {
                if !self.is_partial {
                    let finding = Finding::new(Code::NoSystem, &at, "there is no system");
                    let remedy = "add <system>, or name its file: <mission system=\"rover.xml\">";
                    self.findings.push(finding.remedy(remedy));
                }
                (None, Vec::new())
            }
        };
        sources.insert(0, source);
        // If the system's file could not be read, that is the finding.
        let of_system = system.as_ref().and(sources.last());
        let of_system = of_system.map(|source| source.path().to_path_buf());
        let included = match &mission {
            Some(mission) => self.submissions(path, mission, of_system.as_deref(), &mut sources),
            None => BTreeMap::new(),
        };
        Some(Configuration { sources, system: system?, mission, included })
    }

    /// Returns the contents of a file, as far as possible also of one that is not well-formed XML.
    fn contents(&mut self, path: &Path, bytes: &[u8]) -> Option<(Arc<Source>, Contents)> {
        let mut of_xml = Findings::default();
        let (source, tree) = parse(path, bytes, &mut of_xml);
        let recovered = tree.is_none().then(|| recover(&source, &of_xml)).flatten();
        self.findings.absorb(of_xml, |_| true);
        if let Some(tree) = tree {
            let contents = contents(tree.root(), &source, &mut self.findings);
            return Some((source, contents?));
        }
        let Recovered { root, is_whole } = recovered?;
        self.is_partial |= !is_whole;
        let mut findings = Findings::default();
        let contents = contents(&root, &source, &mut findings);
        self.findings.absorb(findings, |f| is_whole || !f.code.is_of_something_missing());
        Some((source, contents?))
    }

    /// The same of a file that another one names; if it is no Armor file at all, the finding shows where it
    /// is named. Of a file in which nothing resembles one, no line is shown: the right to
    /// write a system's file is none to read others.
    fn named_contents(
        &mut self,
        path: &Path,
        bytes: &[u8],
        named: &Location,
    ) -> Option<(Arc<Source>, Contents)> {
        if !bytes.trim_ascii().is_empty() && !resembles_armor_file(bytes) {
            let message = format!("{} is no Armor file", path.display());
            let finding = Finding::new(Code::WrongRoot, named, message);
            self.findings
                .push(finding.remedy("name a file that begins with <armor version=\"1\">"));
            return None;
        }
        let contents = self.contents(path, bytes);
        if contents.is_none() {
            let is_it = |finding: &&mut Finding| {
                finding.code == Code::WrongRoot
                    && finding.at.as_ref().is_some_and(|at| at.source.path() == path)
            };
            for finding in self.findings.iter_mut().filter(is_it) {
                finding.related.push((named.clone(), "named here: name another file?".into()));
            }
        }
        contents
    }

    /// Returns the system that the mission was probably written for: that of its own file, or the one
    /// that it names if its own is empty.
    fn fuller_system(
        &mut self,
        path: &Path,
        own: System,
        named: &Spanned<String>,
    ) -> (Option<System>, Vec<Arc<Source>>) {
        if !own.components.is_empty() {
            return (Some(own), Vec::new());
        }
        // Only one of the two is needed, so that the other one is missing is no finding.
        let before = (self.findings.clone(), self.is_partial);
        match self.named_system(path, named) {
            (Some(system), sources) => (Some(system), sources),
            (None, _) => {
                (self.findings, self.is_partial) = before;
                (Some(own), Vec::new())
            }
        }
    }

    /// Returns the system of the file that the mission in `path` names.
    fn named_system(
        &mut self,
        path: &Path,
        named: &Spanned<String>,
    ) -> (Option<System>, Vec<Arc<Source>>) {
        let file = named.at.source.folder().join(&named.value);
        let refuse = |code, message: String| {
            Finding::new(code, &named.at, message).remedy("name the file that contains <system>")
        };
        if plain_path(&file) == plain_path(path) {
            let message = format!("{} names itself as its system file", path.display());
            self.findings.push(refuse(Code::IncludeCycle, message));
            return (None, Vec::new());
        }
        let Some(bytes) = self.bytes_of(&file, named) else { return (None, Vec::new()) };
        let Some((source, contents)) = self.named_contents(&file, &bytes, &named.at) else {
            return (None, Vec::new());
        };
        if contents.system.is_none() && !self.is_partial {
            self.findings.push(match names_back(&contents, path, &file) {
                Some(back) => {
                    let message =
                        format!("{} and {} name each other", path.display(), file.display());
                    refuse(Code::IncludeCycle, message).related(back, "and back from here")
                }
                None => {
                    refuse(Code::IncludeMissing, format!("{} contains no system", file.display()))
                }
            });
        }
        (contents.system, vec![source])
    }

    /// Returns the bytes of a file named at `named`; if it cannot be read, that is a finding.
    fn bytes_of(&mut self, file: &Path, named: &Spanned<String>) -> Option<Vec<u8>> {
        self.asked.push(file.to_path_buf());
        match (self.loader)(file) {
            Ok(bytes) => Some(bytes),
            Err(error) => {
                let message = format!("{} cannot be read: {error}", file.display());
                let finding = Finding::new(Code::IncludeMissing, &named.at, message);
                let remedy = "correct the path (it is relative to the file in which it is written), or put \
                              the file there";
                self.findings.push(finding.remedy(remedy));
                None
            }
        }
    }
}

/// Returns whether something in a file resembles an Armor file: then findings about it are of use.
fn resembles_armor_file(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let begins_as_xml = text.trim_start_matches('\u{feff}').trim_start().starts_with('<');
    let elements = ["<armor", "<system", "<mission", "<component", "<place"];
    begins_as_xml && elements.into_iter().any(|element| text.contains(element))
}

/// Returns where a file without a system names one of the two as its system file.
fn names_back<'a>(contents: &'a Contents, path: &Path, file: &Path) -> Option<&'a Location> {
    let named = contents.mission.as_ref()?.system.as_ref()?;
    let next = plain_path(&file.parent().unwrap_or(Path::new("")).join(&named.value));
    [path, file].into_iter().any(|known| plain_path(known) == next).then_some(&named.at)
}
