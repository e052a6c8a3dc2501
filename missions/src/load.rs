//! A file and those that it names → one [`Configuration`]. [`read`] is pure: the caller brings the
//! bytes; [`load`] brings them from the disk.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::code::Code;
use crate::finding::{Finding, Findings};
use crate::mission::Mission;
use crate::model::{Configuration, System};
use crate::read::{Contents, contents};
use crate::source::{Location, Source, Spanned};
use crate::xml::{MAX_FILE_BYTES, parse};

/// What came of reading a file.
#[derive(Clone, Debug)]
pub struct Reading {
    /// What the file says, as far as it could be understood; none if it is not XML or has no
    /// system. Only if [`Self::is_valid`] may it be used.
    pub configuration: Option<Configuration>,
    /// What is wrong with it.
    pub findings: Findings,
    /// Every file that was asked for, also those that are missing: what to watch.
    pub files: Vec<PathBuf>,
}

impl Reading {
    /// Whether the configuration is there and free of errors.
    pub fn is_valid(&self) -> bool {
        self.configuration.is_some() && !self.findings.has_errors()
    }
}

/// Reads the file at `path` and the system file that it may name, taking their bytes from
/// `loader`. It looks at each file by itself; [`crate::check`] looks at the whole.
pub fn read(path: &Path, loader: &mut dyn FnMut(&Path) -> io::Result<Vec<u8>>) -> Reading {
    let mut files = Files { loader, findings: Findings::default(), asked: Vec::new() };
    let configuration = files.configuration(path);
    Reading { configuration, findings: files.findings, files: files.asked }
}

/// Reads the file at `path` from the disk.
pub fn load(path: &Path) -> Reading {
    read(path, &mut read_bytes)
}

/// The bytes of a file, at most one more than the limit, so that a giant or endless one costs
/// nothing. Only regular files are opened: a pipe could hold the reader up for ever.
///
/// # Errors
/// As the operating system says, or that it is no regular file.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_FILE_BYTES as u64 + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

struct Files<'a> {
    loader: &'a mut dyn FnMut(&Path) -> io::Result<Vec<u8>>,
    findings: Findings,
    asked: Vec<PathBuf>,
}

impl Files<'_> {
    fn configuration(&mut self, path: &Path) -> Option<Configuration> {
        self.asked.push(path.to_path_buf());
        let bytes = match (self.loader)(path) {
            Ok(bytes) => bytes,
            Err(error) => {
                let message = format!("{} cannot be read: {error}", path.display());
                let finding = Finding::nowhere(Code::Unreadable, message);
                self.findings.push(finding.remedy("check the path and its permissions"));
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
                (Some(system), Vec::new())
            }
            (None, Some(Mission { system: Some(named), .. })) => self.named_system(path, named),
            (None, _) => {
                let finding = Finding::new(Code::NoSystem, &at, "there is no system");
                let remedy = "add <system>, or name its file: <mission system=\"rover.xml\">";
                self.findings.push(finding.remedy(remedy));
                (None, Vec::new())
            }
        };
        sources.insert(0, source);
        Some(Configuration { sources, system: system?, mission })
    }

    fn contents(&mut self, path: &Path, bytes: &[u8]) -> Option<(Arc<Source>, Contents)> {
        let (source, tree) = parse(path, bytes, &mut self.findings);
        let contents = contents(&tree?, &mut self.findings)?;
        Some((source, contents))
    }

    /// The system of the file that the mission in `path` names.
    fn named_system(
        &mut self,
        path: &Path,
        named: &Spanned<String>,
    ) -> (Option<System>, Vec<Arc<Source>>) {
        let file = named.at.source.folder().join(&named.value);
        let refuse = |code, message: String| {
            Finding::new(code, &named.at, message).remedy("name the file that holds <system>")
        };
        if plain(&file) == plain(path) {
            let message = format!("{} names itself as its system file", path.display());
            self.findings.push(refuse(Code::IncludeCycle, message));
            return (None, Vec::new());
        }
        self.asked.push(file.clone());
        let bytes = match (self.loader)(&file) {
            Ok(bytes) => bytes,
            Err(error) => {
                let message = format!("{} cannot be read: {error}", file.display());
                let remedy = "the path is relative to the mission's file";
                self.findings.push(refuse(Code::IncludeMissing, message).remedy(remedy));
                return (None, Vec::new());
            }
        };
        let Some((source, contents)) = self.contents(&file, &bytes) else {
            return (None, Vec::new());
        };
        if contents.system.is_none() {
            self.findings.push(match names_back(&contents, path, &file) {
                Some(back) => {
                    let message =
                        format!("{} and {} name each other", path.display(), file.display());
                    refuse(Code::IncludeCycle, message).related(back, "and back from here")
                }
                None => refuse(Code::IncludeMissing, format!("{} holds no system", file.display())),
            });
        }
        (contents.system, vec![source])
    }
}

/// Where a file, instead of holding a system, names one of the two as its system file.
fn names_back<'a>(contents: &'a Contents, path: &Path, file: &Path) -> Option<&'a Location> {
    let named = contents.mission.as_ref()?.system.as_ref()?;
    let next = plain(&file.parent().unwrap_or(Path::new("")).join(&named.value));
    [path, file].into_iter().any(|known| plain(known) == next).then_some(&named.at)
}

/// The path without `.` and `..` where that needs no disk, for telling files apart.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}
