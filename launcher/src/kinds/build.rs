//! What distinguishes executables of two hosts: the same kind may be there in another build.

use std::fmt::Write;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::OnceLock;

use armor_wire::manifest::Manifest;
use armor_wire::schema::hash_text;
use ring::digest::{Context, SHA256};

use super::Origin;
use crate::run::process::OWN_PROGRAM;

/// Bytes that are read at a time.
const PIECE_LEN: usize = 1 << 20;

/// Returns a number that is the same for the same ports, parameters and events.
pub fn fingerprint_manifest(manifest: &Manifest) -> u64 {
    serde_json::to_string(manifest).map(|text| hash_text(&text)).unwrap_or_default()
}

/// Returns the SHA-256 of an executable, in hexadecimal digits; empty if it cannot be read.
pub fn find_build(origin: &Origin) -> String {
    static OWN: OnceLock<String> = OnceLock::new();
    let own = || OWN.get_or_init(|| hash_file(Path::new(OWN_PROGRAM)).unwrap_or_default());
    match origin {
        Origin::Stock => own().clone(),
        Origin::Executable(path) => hash_file(path).unwrap_or_default(),
    }
}

/// Computes the SHA-256 of an executable that arrives in pieces.
pub struct BuildHasher(Context);

impl Default for BuildHasher {
    fn default() -> Self {
        Self(Context::new(&SHA256))
    }
}

impl BuildHasher {
    /// Adds the next bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Returns the hash, in hexadecimal digits.
    pub fn finish(self) -> String {
        self.0.finish().as_ref().iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        })
    }
}

fn hash_file(path: &Path) -> std::io::Result<String> {
    let mut file = File::open(path)?;
    let mut hasher = BuildHasher::default();
    let mut bytes = vec![0; PIECE_LEN];
    loop {
        match file.read(&mut bytes)? {
            0 => return Ok(hasher.finish()),
            len => hasher.update(&bytes[..len]),
        }
    }
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
        assert_eq!(find_build(&Origin::Executable("/nowhere".into())), "");
        assert_eq!(find_build(&Origin::Stock).len(), 64);
        // As sha256sum(1) prints it.
        let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(write("empty", ""), empty);
    }
}
