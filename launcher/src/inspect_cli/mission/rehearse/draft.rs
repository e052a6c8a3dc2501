//! The copy of a file that is rehearsed: with the simulator where it stands in, the speed and the world. The
//! folders around it are mirrored with links to what they hold, so that relative paths mean the same.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use armor_robotfile::{Document, Item, NewElement, read_bytes};

use super::stand_in::{SIMULATOR, StandIn};
use crate::check::CheckedFile;

/// Steps of simulated time per second: 20 ms, so that a component of 20 Hz has its ticks in time.
const STEPS_HZ: f64 = 50.0;
/// The highest rate that a simulator gets.
const MAX_RATE_HZ: f64 = 1000.0;

/// The copy, which lives in a folder of its caller.
#[derive(Debug)]
pub struct RehearsalDraft {
    /// The file to run.
    pub file: PathBuf,
}

impl RehearsalDraft {
    /// Writes the copy of a file into a folder, which is made again.
    ///
    /// # Errors
    /// If the folder cannot be written, or the file cannot be edited.
    pub fn write(
        checked: &CheckedFile,
        stand_in: &StandIn,
        speed: f64,
        folder: &Path,
    ) -> Result<Self> {
        if folder.exists() {
            fs::remove_dir_all(folder)?;
        }
        let mut documents = Vec::new();
        for path in checked.files() {
            let bytes = read_bytes(path).with_context(|| path.display().to_string())?;
            let document = Document::open(path, &bytes)
                .map_err(|_| anyhow!("{} cannot be edited", path.display()))?;
            documents.push((plain_path(path)?, document));
        }
        edit_files(&mut documents, stand_in, speed)?;
        let Some((main, _)) = documents.first() else { bail!("there is no file") };
        let main = place_in(folder, main);
        mirror_folders(&documents, folder)?;
        for (path, document) in &documents {
            fs::write(place_in(folder, path), document.bytes())?;
        }
        Ok(Self { file: main })
    }
}

/// A path of this host within the folder.
fn place_in(folder: &Path, path: &Path) -> PathBuf {
    folder.join(path.strip_prefix("/").unwrap_or(path))
}

fn edit_files(documents: &mut [(PathBuf, Document)], stand_in: &StandIn, speed: f64) -> Result<()> {
    for (_, document) in documents.iter_mut() {
        for [(from, to), (new_from, new_to)] in &stand_in.moved_links {
            if document.find(Item::Link { from, to }).is_none() {
                continue;
            }
            if from != new_from {
                document.set_attribute(Item::Link { from, to }, "from", Some(new_from))?;
            }
            if to != new_to {
                let link = Item::Link { from: new_from, to };
                document.set_attribute(link, "to", Some(new_to))?;
            }
        }
        for name in stand_in.replaced.iter().skip(1) {
            if document.find(Item::Component(name)).is_some() {
                document.remove(Item::Component(name))?;
            }
        }
    }
    let world = stand_in.world.as_ref().map(|world| plain_path(world)).transpose()?;
    let Some(clock) = stand_in.simulators.first() else { return Ok(()) };
    for name in &stand_in.simulators {
        let item = Item::Component(name);
        let holder = documents.iter_mut().find(|(_, document)| document.find(item).is_some());
        let (_, document) = holder.with_context(|| format!("no file has the component {name}"))?;
        if !stand_in.replaced.is_empty() {
            become_simulator(document, item)?;
        }
        if name == clock {
            let text = speed.to_string();
            document.set_parameter(name, "speed", Some(&text))?;
            let rate_hz = find_rate_hz(document, item);
            let rate_hz = rate_hz.max((speed * STEPS_HZ).min(MAX_RATE_HZ));
            document.set_attribute(item, "rate", Some(&format!("{rate_hz}Hz")))?;
            if !stand_in.has_clock {
                add_clock(document, name)?;
            }
        }
        if let Some(world) = &world {
            document.set_parameter(name, "world", Some(&world.to_string_lossy()))?;
        }
    }
    Ok(())
}

/// Makes a component one of the simulator's kind: its parameters are those of another kind.
fn become_simulator(document: &mut Document, item: Item<'_>) -> Result<()> {
    for attribute in ["rate", "watchdog", "host"] {
        document.set_attribute(item, attribute, None)?;
    }
    document.set_attribute(item, "kind", Some(SIMULATOR))?;
    let path = document.find(item).context("the component")?;
    let count = count_elements(document, &path);
    for number in (0..count).rev() {
        let child: Vec<_> = path.iter().copied().chain([number]).collect();
        document.remove_element(&child)?;
    }
    Ok(())
}

fn count_elements(document: &Document, path: &[usize]) -> usize {
    document.tree().element(path).map_or(0, |element| element.elements().count())
}

/// The rate that a component has, in hertz; 0 without one.
fn find_rate_hz(document: &Document, item: Item<'_>) -> f64 {
    let path = document.find(item).unwrap_or_default();
    let rate = document.tree().element(&path).and_then(|element| element.attribute("rate"));
    let hertz = rate.and_then(|rate| armor_wire::quantity::hertz(&rate.value).ok());
    hertz.unwrap_or_default()
}

fn add_clock(document: &mut Document, simulator: &str) -> Result<()> {
    let system = document.find(Item::System).context("the file has no <system>")?;
    let clock = NewElement::new("clock").attribute("source", format!("{simulator}.clock"));
    document.insert_element(&system, 0, &clock)?;
    Ok(())
}

/// Makes the folders of the files within `folder`, from as far up as relative paths lead, with links to
/// everything else that these folders hold on this host.
fn mirror_folders(documents: &[(PathBuf, Document)], folder: &Path) -> Result<()> {
    let files: BTreeSet<&Path> = documents.iter().map(|(path, _)| path.as_path()).collect();
    let ups = documents.iter().map(|(_, document)| count_ups(document.bytes())).max().unwrap_or(0);
    let mut folders: BTreeSet<&Path> = BTreeSet::new();
    for file in &files {
        folders.extend(file.ancestors().skip(1));
    }
    // All are ancestors of the files; those that every file is below, but for the lowest, need no mirror.
    let is_common = |path: &&&Path| files.iter().all(|file| file.starts_with(path));
    let lowest_common =
        folders.iter().filter(is_common).map(|path| path.components().count()).max();
    let depth = lowest_common.unwrap_or(1).saturating_sub(ups).max(1);
    for path in &folders {
        let place = place_in(folder, path);
        fs::create_dir_all(&place).with_context(|| place.display().to_string())?;
        if path.components().count() < depth {
            continue;
        }
        let entries = fs::read_dir(path).with_context(|| path.display().to_string())?;
        for entry in entries.flatten() {
            let real = entry.path();
            if files.contains(real.as_path()) || folders.contains(real.as_path()) {
                continue;
            }
            let link = place.join(entry.file_name());
            symlink(&real, &link).with_context(|| link.display().to_string())?;
        }
    }
    Ok(())
}

/// How many folders up the relative paths of a text lead at most: the longest run of `../`.
fn count_ups(bytes: &[u8]) -> usize {
    let (mut most, mut at) = (0, 0);
    while at < bytes.len() {
        let ups = bytes[at..].chunks(3).take_while(|part| *part == b"../").count();
        most = most.max(ups);
        at += (3 * ups).max(1);
    }
    most
}

/// The absolute path of a file, without `.` and `..`.
fn plain_path(path: &Path) -> Result<PathBuf> {
    let mut plain = PathBuf::new();
    for part in std::path::absolute(path)?.components() {
        match part {
            std::path::Component::ParentDir => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    Ok(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relative_path_leads_as_far_up_as_it_has_steps() {
        assert_eq!(count_ups(b"world=\"../a/../../../b.svg\" x=\"./c\""), 3);
        assert_eq!(count_ups(b"world=\"worlds/b.svg\" ..."), 0);
        assert_eq!(count_ups(b".../"), 1);
    }

    #[test]
    fn a_path_within_the_folder_keeps_its_parts() {
        let path = place_in(Path::new("/tmp/x"), Path::new("/home/anna/robot.xml"));
        assert_eq!(path, Path::new("/tmp/x/home/anna/robot.xml"));
    }
}
