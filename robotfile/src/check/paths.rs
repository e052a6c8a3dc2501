//! Files that parameters name. The check itself opens none of them: it returns the paths, and who calls
//! it tries them.

use std::path::{Path, PathBuf};

use armor_wire::manifest::ParameterType;
use armor_wire::text_format::TextFormat;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Configuration, Parameter};
use crate::source::{Spanned, plain_path};
use crate::suggestion::suggest_similar;

/// Entries of a folder that are compared with a name that is missing.
const MAX_ENTRIES: usize = 512;

/// A file or folder that a component requires.
#[derive(Clone, Debug)]
pub struct NeededPath {
    component: String,
    parameter: String,
    /// As written, and where.
    written: Spanned<String>,
    /// What must be there, if the component states it.
    format: Option<TextFormat>,
    /// The path from the folder in which the program runs.
    pub path: PathBuf,
}

impl NeededPath {
    /// Whether it is this value of this parameter.
    pub fn is_value_of(&self, component: &str, parameter: &str, value: &str) -> bool {
        self.component == component && self.parameter == parameter && self.written.value == value
    }

    /// Returns the finding that it cannot be opened, with the reason.
    pub fn refuse(&self, why: &std::io::Error) -> Finding {
        let Self { component, parameter, written, path, .. } = self;
        let names = format!("{component}.{parameter} names {}", written.value);
        if why.kind() != std::io::ErrorKind::NotFound {
            let message = format!("{names}, which cannot be read: {why}");
            let remedy = format!("check the permissions of {}", path.display());
            return Finding::new(Code::FileMissing, &written.at, message).remedy(remedy);
        }
        let message = format!("{names}, which does not exist");
        let finding = Finding::new(Code::FileMissing, &written.at, message);
        let place = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let place =
            place.map_or("the current folder".into(), |folder| folder.display().to_string());
        let remedy = format!("it was expected in {place}: correct the path, or put the file there");
        finding.remedy(match self.guess_name() {
            Some(guess) => format!("{guess} Otherwise: {remedy}"),
            None => remedy,
        })
    }

    /// Returns a remedy that names a similar file of the folder.
    fn guess_name(&self) -> Option<String> {
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?;
        let names =
            entries.take(MAX_ENTRIES).filter_map(|it| it.ok()?.file_name().into_string().ok());
        let names: Vec<_> = names.collect();
        let name = self.path.file_name()?.to_str()?;
        // As it is to be written, with its folder.
        let written = Path::new(&self.written.value);
        let within = |name: &str| written.with_file_name(name).display().to_string();
        if let Some(guess) = suggest_similar(name, names.iter().map(String::as_str)) {
            let meant = guess.trim_start_matches("did you mean ").trim_end_matches('?');
            return Some(format!("did you mean {}?", within(meant)));
        }
        // The folder may be forgotten.
        let folder = folder.unwrap_or(Path::new("."));
        let mut holding = names.iter().filter(|it| folder.join(it).join(name).is_file());
        let (Some(only), None) = (holding.next(), holding.next()) else { return None };
        Some(format!("did you mean {}?", within(&format!("{only}/{name}"))))
    }

    /// Tries to read it, and returns the finding if that fails. Only a file is opened: a device or a
    /// pipe might wait, or do something.
    pub fn find_fault(&self) -> Option<Finding> {
        let found = std::fs::metadata(&self.path);
        let found = match found {
            Ok(found) => found,
            Err(why) => return Some(self.refuse(&why)),
        };
        match self.format {
            Some(TextFormat::File) if found.is_dir() => {
                Some(self.refuse_type("a folder", "a file"))
            }
            Some(TextFormat::Folder) if !found.is_dir() => {
                Some(self.refuse_type("a file", "a folder"))
            }
            _ if found.is_file() => {
                std::fs::File::open(&self.path).err().map(|why| self.refuse(&why))
            }
            _ => None,
        }
    }

    fn refuse_type(&self, is: &str, expected: &str) -> Finding {
        let Self { component, parameter, written, .. } = self;
        let message = format!("{component}.{parameter} names {}, which is {is}", written.value);
        let finding = Finding::new(Code::FileMissing, &written.at, message);
        finding.remedy(format!("name {expected}"))
    }
}

/// Reports parameters that name one of the files from which the robot itself is read: a component reads
/// a file of its own, such as a drawing.
pub(super) fn check_own_files(
    configuration: &Configuration,
    manifests: &Manifests,
    findings: &mut Findings,
) {
    let own: Vec<_> =
        configuration.sources.iter().map(|source| plain_path(source.path())).collect();
    for needed in needed_paths(configuration, manifests) {
        if own.contains(&plain_path(&needed.path)) {
            let NeededPath { component, parameter, written, .. } = &needed;
            let message = format!(
                "{component}.{parameter} names {}, which describes this robot itself",
                written.value
            );
            let finding = Finding::new(Code::OwnFile, &written.at, message);
            findings.push(finding.remedy(format!("name the file that {component} is to read")));
        }
    }
}

/// Returns the paths that the file gives, apart from those that the component writes.
pub fn needed_paths(configuration: &Configuration, manifests: &Manifests) -> Vec<NeededPath> {
    let system = &configuration.system;
    let mut needed = Vec::new();
    let mut add = |kind: &str, component: &str, given: &Parameter| {
        let wanted = manifests.get(kind).and_then(|manifest| {
            manifest.parameters.iter().find(|wanted| wanted.name == given.name.value)
        });
        let is_needed =
            wanted.is_some_and(|wanted| wanted.kind == ParameterType::Path && !wanted.written);
        if is_needed && !given.value.value.is_empty() {
            needed.push(NeededPath {
                component: component.to_owned(),
                parameter: given.name.value.clone(),
                written: given.value.clone(),
                format: wanted.and_then(|wanted| wanted.format),
                path: given.folder.join(Path::new(&given.value.value)),
            });
        }
    };
    // What another host has is not known here.
    for component in system.components.iter().filter(|component| component.host.is_none()) {
        for given in &component.parameters {
            add(&component.kind.value, &component.name.value, given);
        }
    }
    for given in configuration.missions().flat_map(|m| &m.places).flat_map(|p| &p.parameters) {
        let component = system.component(&given.component.value);
        if let Some(component) = component.filter(|component| component.host.is_none()) {
            add(&component.kind.value, &component.name.value, &given.parameter);
        }
    }
    needed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Location, Source, Span};

    #[test]
    fn a_similar_file_of_the_folder_is_named() {
        let folder = std::env::temp_dir().join(format!("armor-paths-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join("office.svg"), "").expect("a file");
        let find = |name: &str| {
            let source = Source::new("a.xml", name);
            let at = Location::new(&source, Span::new(0, name.len()));
            let (component, parameter) = ("world".to_owned(), "drawing".to_owned());
            let written = Spanned::new(name.to_owned(), at);
            let path = folder.join(name);
            NeededPath { component, parameter, written, format: None, path }.find_fault()
        };
        let remedy = find("ofice.svg").expect("it is missing").remedy;
        assert!(remedy.starts_with("did you mean office.svg? Otherwise: it was"), "{remedy}");
        std::fs::create_dir_all(folder.join("worlds")).expect("a folder");
        std::fs::write(folder.join("worlds/cave.svg"), "").expect("a file");
        let remedy = find("cave.svg").expect("it is missing").remedy;
        assert!(remedy.starts_with("did you mean worlds/cave.svg?"), "{remedy}");
        let remedy = find("worlds/cav.svg").expect("it is missing").remedy;
        assert!(remedy.starts_with("did you mean worlds/cave.svg?"), "{remedy}");
        let remedy = find("cave.pgm").expect("it is missing").remedy;
        assert!(remedy.starts_with("it was expected in"), "{remedy}");
        assert!(find("office.svg").is_none());
        let _ = std::fs::remove_dir_all(&folder);
    }
}
