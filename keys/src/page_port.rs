//! The port of the page that was served last from a folder of keys, for the links of invitations.

use std::fs;
use std::path::Path;

use armor_files::save_folder_owners_file;

use crate::folder::{FolderError, read_list};

/// The file.
const PAGE_PORT: &str = "page-port";

/// Notes the port of a page that is served with the keys of this folder.
///
/// # Errors
/// If the file cannot be written.
pub fn note_page_port(folder: &Path, port: u16) -> Result<(), FolderError> {
    if read_page_port(folder) == Some(port) {
        return Ok(());
    }
    Ok(save_folder_owners_file(&folder.join(PAGE_PORT), format!("{port}\n").as_bytes())?)
}

/// Returns the port of the page that was served last; `None` if there was none, or the file is another one.
pub fn read_page_port(folder: &Path) -> Option<u16> {
    let path = folder.join(PAGE_PORT);
    // A link could lead to a file that must not be read.
    if fs::symlink_metadata(&path).ok()?.is_symlink() {
        return None;
    }
    read_list(&path).ok()?.trim().parse().ok().filter(|port| *port != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_port_is_read_back_and_nothing_else_is_one() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(read_page_port(folder.path()), None);
        for port in [8443, 9000, 9000] {
            note_page_port(folder.path(), port).expect("it is written");
            assert_eq!(read_page_port(folder.path()), Some(port));
        }
        for text in ["", "0\n", "70000\n", "9000 9001\n", "x"] {
            fs::write(folder.path().join(PAGE_PORT), text).expect("written");
            assert_eq!(read_page_port(folder.path()), None, "{text}");
        }
        fs::remove_file(folder.path().join(PAGE_PORT)).expect("it is removed");
        assert!(note_page_port(&folder.path().join("none"), 9000).is_err());
    }
}
