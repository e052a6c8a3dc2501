//! The example robots, carried along so that they are there wherever the designer is. They are
//! opened as copies, which may be changed at will.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// An example that the first page offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Example {
    /// What it is called.
    pub title: &'static str,
    /// What it shows, in one sentence.
    pub about: &'static str,
    /// Its file among the files below.
    pub file: &'static str,
}

/// The examples in the order in which one learns from them.
pub const EXAMPLES: &[Example] = &[
    Example {
        title: "Office",
        about: "A robot explores an office it has never seen, maps it and comes home. Start here.",
        file: "office.xml",
    },
    Example {
        title: "Patrol",
        about: "It gets to know two rooms and a corridor, then walks its rounds, with time limits.",
        file: "patrol.xml",
    },
    Example {
        title: "Survey",
        about: "A weak battery, an operator who calls it back, and a mission within the mission.",
        file: "survey.xml",
    },
    Example {
        title: "Appointment",
        about: "It drives to a meeting point and waits there for a date.",
        file: "appointment.xml",
    },
    Example {
        title: "Meeting",
        about: "Two robots wait for each other, stay together for a moment, and go home.",
        file: "meeting.xml",
    },
];

macro_rules! carried {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_bytes!(concat!("../../../missions/", $name)))),*]
    };
}

/// Every file that the examples need, by its path among them.
const FILES: &[(&str, &[u8])] = carried![
    "office.xml",
    "patrol.xml",
    "survey.xml",
    "dock.xml",
    "appointment.xml",
    "meeting.xml",
    "worlds/empty.svg",
    "worlds/office.svg",
    "worlds/rooms.svg",
];

/// Where the copies of this version's examples are, under the designer's folder for data.
pub fn folder(data: &Path) -> PathBuf {
    data.join(concat!("examples-", env!("CARGO_PKG_VERSION")))
}

/// Copies the examples into `folder`, except files that exist already and may have been changed.
///
/// # Errors
/// If the folder cannot be made or written.
pub fn unpack(folder: &Path) -> io::Result<()> {
    for (name, bytes) in FILES {
        let path = folder.join(name);
        if path.exists() {
            continue;
        }
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        armor_files::save_atomically(&path, bytes).map_err(io::Error::other)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::scratch::Scratch;

    #[test]
    fn every_example_opens_with_all_that_it_names() {
        let folder = Scratch::new();
        unpack(folder.path()).expect("written");
        for example in EXAMPLES {
            let reading = armor_robotfile::load(&folder.path().join(example.file));
            assert!(reading.is_valid(), "{}: {:?}", example.file, reading.findings);
            for file in reading.files {
                assert!(file.exists(), "{} is not carried along", file.display());
            }
        }
        let worlds = fs::read_dir(folder.path().join("worlds")).expect("there").count();
        assert_eq!(worlds, FILES.iter().filter(|(name, _)| name.starts_with("worlds/")).count());
    }

    #[test]
    fn a_changed_example_stays_as_it_is() {
        let folder = Scratch::new();
        unpack(folder.path()).expect("written");
        let path = folder.path().join("office.xml");
        fs::write(&path, "mine").expect("written");
        unpack(folder.path()).expect("written");
        assert_eq!(fs::read(&path).expect("there"), b"mine");
    }
}
