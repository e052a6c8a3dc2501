//! What tells executables of two hosts apart: the same kind may be there in another build.

use std::fs::File;
use std::hash::Hasher;
use std::io::Read;
use std::path::Path;
use std::sync::OnceLock;

use armor_wire::manifest::Manifest;
use armor_wire::schema::hash_text;

use super::Origin;
use crate::run::process::OWN_PROGRAM;

/// Bytes that are read at a time.
const PIECE_LEN: usize = 1 << 20;

/// Returns a number that is the same for the same ports, parameters and events.
pub fn fingerprint_manifest(manifest: &Manifest) -> u64 {
    serde_json::to_string(manifest).map(|text| hash_text(&text)).unwrap_or_default()
}

/// Returns a number that is the same for the same executable, by its bytes; 0 if it cannot be read.
pub fn find_build(origin: &Origin) -> u64 {
    static OWN: OnceLock<u64> = OnceLock::new();
    match origin {
        Origin::Stock => *OWN.get_or_init(|| hash_file(Path::new(OWN_PROGRAM)).unwrap_or_default()),
        Origin::Executable(path) => hash_file(path).unwrap_or_default(),
    }
}

/// The length and the checksum of the bytes: copies agree, and two builds do not by chance.
fn hash_file(path: &Path) -> std::io::Result<u64> {
    let mut file = File::open(path)?;
    let mut hasher = crc32fast::Hasher::new();
    let mut bytes = vec![0; PIECE_LEN];
    let mut length = 0_u64;
    loop {
        match file.read(&mut bytes)? {
            0 => break,
            len => {
                hasher.write(&bytes[..len]);
                length += len as u64;
            }
        }
    }
    Ok(length << 32 | u64::from(hasher.finalize()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

    #[test]
    fn a_copy_is_the_same_build_and_another_byte_is_not() {
        let scratch = ScratchFolder::new("build");
        let write = |name: &str, text: &str| {
            let path = scratch.path().join(name);
            std::fs::write(&path, text).expect("the folder is ours");
            find_build(&Origin::Executable(path))
        };
        let first = write("first", "the same bytes");
        assert_eq!(write("copy", "the same bytes"), first);
        assert_ne!(write("other", "the same bytez"), first);
        assert_eq!(find_build(&Origin::Executable("/nowhere".into())), 0);
        assert_ne!(find_build(&Origin::Stock), 0);
    }
}
