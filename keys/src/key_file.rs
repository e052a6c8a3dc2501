//! The file of one key: the secret key, its certificate, and that of the authority. It is all that a
//! person or a gate needs, and is carried as one file.

use std::fmt;
use std::fs;
use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use ring::digest::{SHA256, digest};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use thiserror::Error;

use crate::certificate::CertificateFacts;

/// Longest file that is read, in bytes; a key file has some 1,500.
const MAX_LEN: u64 = 64 << 10;
/// Rights of users other than the owner.
const OTHERS: u32 = 0o077;

/// Why a key cannot be used.
#[derive(Debug, Error)]
pub enum KeyFileError {
    /// It cannot be read.
    #[error("{path}: {reason}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: std::io::Error,
    },
    /// Other users can read or change it.
    #[error(
        "{path}: other users of this host may use it (mode {mode:03o}), so it may be known to them: \
         chmod {remedy} {path}, and if they could read a key, revoke it and make another",
        path = path.display()
    )]
    Open {
        /// The file or folder.
        path: PathBuf,
        /// Its mode.
        mode: u32,
        /// The mode that it should have.
        remedy: &'static str,
    },
    /// It is not a key.
    #[error("{path}: {reason}", path = path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

/// A key with its certificate and that of its authority.
pub struct KeyFile {
    /// What the certificate contains.
    pub facts: CertificateFacts,
    pub(crate) key: PrivateKeyDer<'static>,
    pub(crate) certificate: CertificateDer<'static>,
    pub(crate) authority: CertificateDer<'static>,
}

// The secret key is never printed.
impl fmt::Debug for KeyFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("KeyFile").field("facts", &self.facts).finish_non_exhaustive()
    }
}

impl KeyFile {
    /// Reads the file of a key that only its owner can read.
    ///
    /// # Errors
    /// [`KeyFileError`] if it cannot be read, if others could, or if it is not one.
    pub fn load(path: &Path) -> Result<Self, KeyFileError> {
        let text = read_secret(path)?;
        let invalid = |reason| KeyFileError::Invalid { path: path.into(), reason };
        Self::from_text(&text).map_err(invalid)
    }

    /// The fingerprint of the certificate, SHA-256, as browsers show it.
    pub fn fingerprint(&self) -> String {
        describe_fingerprint(&self.certificate)
    }

    /// The fingerprint of the authority's certificate.
    pub fn authority_fingerprint(&self) -> String {
        describe_fingerprint(&self.authority)
    }

    /// Reads the text of such a file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let wrong = "it is not the key of a person or a host, which `armor keys add` makes";
        let mut certificates = CertificateDer::pem_slice_iter(text.as_bytes());
        let (Some(Ok(certificate)), Some(Ok(authority))) =
            (certificates.next(), certificates.next())
        else {
            return Err(wrong.into());
        };
        let key = PrivateKeyDer::from_pem_slice(text.as_bytes()).map_err(|_| wrong)?;
        let facts = CertificateFacts::read(&certificate)?;
        Ok(Self { facts, key, certificate, authority })
    }
}

/// The SHA-256 of a certificate, as browsers show it.
pub(crate) fn describe_fingerprint(certificate: &[u8]) -> String {
    let bytes = digest(&SHA256, certificate);
    let pairs: Vec<_> = bytes.as_ref().iter().map(|byte| format!("{byte:02X}")).collect();
    pairs.join(":")
}

/// Reads a file with a secret, which only its owner may read.
pub(crate) fn read_secret(path: &Path) -> Result<String, KeyFileError> {
    read_long_secret(path, MAX_LEN)
}

/// As [`read_secret`], a file of at most so many bytes.
pub(crate) fn read_long_secret(path: &Path, max_len: u64) -> Result<String, KeyFileError> {
    let unreadable = |reason| KeyFileError::Unreadable { path: path.into(), reason };
    let mut file = armor_files::open_regular_file(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    check_mode(path, metadata.mode(), "600")?;
    read_at_most(&mut file, max_len).map_err(unreadable)
}

/// Reads a file of at most [`MAX_LEN`] bytes.
pub(crate) fn read_text(file: &mut fs::File) -> std::io::Result<String> {
    read_at_most(file, MAX_LEN)
}

fn read_at_most(file: &mut fs::File, max_len: u64) -> std::io::Result<String> {
    let mut text = String::new();
    file.take(max_len + 1).read_to_string(&mut text)?;
    if text.len() as u64 > max_len {
        return Err(std::io::Error::other(format!("it is longer than {max_len} bytes")));
    }
    Ok(text)
}

/// Checks that only its owner may enter a folder with keys.
pub(crate) fn check_folder(path: &Path) -> Result<(), KeyFileError> {
    let metadata = fs::metadata(path).map_err(|reason| KeyFileError::Unreadable {
        path: path.into(),
        reason: add_advice(reason),
    })?;
    check_mode(path, metadata.mode(), "700")
}

/// Adds what to do where there is no folder.
fn add_advice(reason: std::io::Error) -> std::io::Error {
    if reason.kind() != std::io::ErrorKind::NotFound {
        return reason;
    }
    let advice = "copy the key of this host (`armor keys add NAME --role host`) and the list \
                  `revoked` there, or name their folder with --keys DIR or the variable ARMOR_KEYS";
    std::io::Error::new(reason.kind(), format!("{reason}: {advice}"))
}

fn check_mode(path: &Path, mode: u32, remedy: &'static str) -> Result<(), KeyFileError> {
    if mode & OTHERS == 0 {
        return Ok(());
    }
    Err(KeyFileError::Open { path: path.into(), mode: mode & 0o777, remedy })
}
