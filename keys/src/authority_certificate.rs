//! The certificate of an authority, for browsers that are to trust the pages of its robots.

use std::path::Path;

use crate::folder::{FolderError, KeysFolder, has_authority};
use crate::host_keys::HostKeys;
use crate::key_file::describe_fingerprint;

/// See the module.
#[derive(Clone, Debug)]
pub struct AuthorityCertificate {
    /// The certificate, in DER.
    pub der: Vec<u8>,
    /// Its fingerprint, as browsers show it.
    pub fingerprint: String,
}

/// Returns the certificate of the authority of this folder, or that in the key of a host there.
///
/// # Errors
/// If there is neither, or others can read the folder.
pub fn read_authority_certificate(folder: &Path) -> Result<AuthorityCertificate, FolderError> {
    if has_authority(folder) {
        let authority = KeysFolder::open(folder)?.read_authority()?;
        let der = authority.certificate_der().map_err(FolderError::Refused)?;
        return Ok(AuthorityCertificate { fingerprint: describe_fingerprint(&der), der });
    }
    let host = HostKeys::read(folder).map_err(|error| FolderError::Refused(error.to_string()))?;
    let der = host.authority_certificate();
    Ok(AuthorityCertificate { fingerprint: describe_fingerprint(&der), der })
}
