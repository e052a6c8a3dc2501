//! The folder of keys on a host: the host's own key and the list of revoked ones. It is read again when
//! it changes, so that neither a renewal nor a revocation needs a restart.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};
use rustls::{ClientConfig, ServerConfig};
use thiserror::Error;

use crate::certificate::CertificateFacts;
use crate::folder::{AUTHORITY, FolderError, KEY_SUFFIX, REVOKED, read_list};
use crate::identity::KeyPurpose;
use crate::key_file::{KeyFile, KeyFileError, check_folder};
use crate::revoked::{RevokedKeys, parse_revoked};
use crate::tls::{browser_config, client_config, gate_config};

/// Why the keys of a gate cannot be used.
#[derive(Debug, Error)]
pub enum GateKeysError {
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] KeyFileError),
    /// There is not one key of a host.
    #[error("{path}: {reason}", path = path.display())]
    Folder {
        /// The folder, or a file in it.
        path: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
}

/// The keys of this host, which its gate and its connections to other hosts share.
#[derive(Clone)]
pub struct HostKeys {
    keys: Arc<Mutex<GateKeys>>,
    name: Arc<str>,
}

impl HostKeys {
    /// Reads the folder.
    ///
    /// # Errors
    /// If there is not one key of a host, or no list of revoked keys, or others can read the folder.
    pub fn read(folder: &Path) -> Result<Self, GateKeysError> {
        let keys = GateKeys::read(folder)?;
        let name = keys.host.facts.holder.name.as_str().into();
        Ok(Self { keys: Arc::new(Mutex::new(keys)), name })
    }

    /// What the certificate of its key contains, as last read.
    pub fn facts(&self) -> CertificateFacts {
        self.lock().host.facts.clone()
    }

    /// The name of this host in its key.
    pub fn host_name(&self) -> &str {
        &self.name
    }

    /// How a server of pages accepts browsers, with the key as last read.
    pub fn browser_config(&self) -> Arc<ServerConfig> {
        Arc::clone(&self.lock().browser)
    }

    /// Whether the key of this host itself is revoked.
    pub fn is_revoked(&self) -> bool {
        let keys = self.lock();
        keys.revoked.contains(&keys.host.facts.serial)
    }

    /// The certificate of the authority, in DER.
    pub fn authority_certificate(&self) -> Vec<u8> {
        self.lock().host.authority.to_vec()
    }

    /// The fingerprint of the host's certificate, as browsers show it.
    pub fn fingerprint(&self) -> String {
        self.lock().host.fingerprint()
    }

    /// The fingerprint of the authority's certificate.
    pub fn authority_fingerprint(&self) -> String {
        self.lock().host.authority_fingerprint()
    }

    /// Reads the folder again if it has changed.
    pub fn look(&self) -> Option<KeysChange> {
        self.lock().look()
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, GateKeys> {
        self.keys.lock()
    }
}

/// The keys of a host, as last read.
pub(crate) struct GateKeys {
    folder: PathBuf,
    /// The host's key.
    pub(crate) host: KeyFile,
    /// How its gate accepts others.
    pub(crate) config: Arc<ServerConfig>,
    /// How it accepts browsers.
    browser: Arc<ServerConfig>,
    /// How it connects to the gates of other hosts.
    pub(crate) client: Arc<ClientConfig>,
    pub(crate) revoked: Arc<RevokedKeys>,
    seen: FolderState,
}

/// What is looked at to find out whether the folder has changed.
#[derive(Clone, Debug, Default, PartialEq)]
struct FolderState {
    /// Name, inode, size and time of change of every key file and of the list of revoked keys.
    files: Vec<(String, u64, u64, i64, i64)>,
}

/// What has changed in the folder.
#[derive(Debug, Default)]
pub struct KeysChange {
    /// The host has another key.
    pub renewed: bool,
    /// The number of keys that are revoked and were not before.
    pub revoked: usize,
    /// What cannot be used; what was read before stays in force.
    pub problems: Vec<String>,
}

impl GateKeys {
    /// Reads the folder.
    ///
    /// # Errors
    /// If there is not one key of a host, or no list of revoked keys, or others can read the folder.
    pub(crate) fn read(folder: &Path) -> Result<Self, GateKeysError> {
        let seen = FolderState::of(folder);
        let host = read_host_key(folder)?;
        let revoked = Arc::<RevokedKeys>::default();
        revoked.add_keys(read_revoked(folder)?);
        let HostConfigs { config, browser, client } = make_configs(folder, &host, &revoked)?;
        Ok(Self { folder: folder.into(), host, config, browser, client, revoked, seen })
    }

    /// Reads the folder again if it has changed.
    pub(crate) fn look(&mut self) -> Option<KeysChange> {
        let state = FolderState::of(&self.folder);
        if state == self.seen {
            return None;
        }
        self.seen = state;
        let mut change = KeysChange::default();
        match read_revoked(&self.folder) {
            Ok(serials) => change.revoked = self.revoked.add_keys(serials),
            Err(error) => change.problems.push(error.to_string()),
        }
        let host = read_host_key(&self.folder).and_then(|host| {
            let configs = make_configs(&self.folder, &host, &self.revoked)?;
            Ok((host, configs))
        });
        match host {
            Ok((host, _)) if host.facts == self.host.facts => {}
            Ok((host, _)) if host.facts.holder != self.host.facts.holder => {
                let (own, other) = (&self.host.facts.holder.name, &host.facts.holder.name);
                change.problems.push(format!(
                    "the folder now has the key of {other}; this is {own}, until it is started again"
                ));
            }
            Ok((host, HostConfigs { config, browser, client })) => {
                (self.host, self.config, self.client) = (host, config, client);
                self.browser = browser;
                change.renewed = true;
            }
            Err(error) => change.problems.push(error.to_string()),
        }
        Some(change)
    }
}

impl FolderState {
    fn of(folder: &Path) -> Self {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut files: Vec<_> = entries
            .filter_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                let is_key = Path::new(&name).extension().is_some_and(|it| it == KEY_SUFFIX);
                let metadata = fs::metadata(entry.path()).ok()?;
                (is_key || name == REVOKED).then(|| {
                    let changed = (metadata.mtime(), metadata.mtime_nsec());
                    (name, metadata.ino(), metadata.size(), changed.0, changed.1)
                })
            })
            .collect();
        files.sort_unstable();
        Self { files }
    }
}

/// How a host speaks TLS in each of its parts.
struct HostConfigs {
    config: Arc<ServerConfig>,
    browser: Arc<ServerConfig>,
    client: Arc<ClientConfig>,
}

fn make_configs(
    folder: &Path,
    host: &KeyFile,
    revoked: &Arc<RevokedKeys>,
) -> Result<HostConfigs, GateKeysError> {
    let folder_error = |reason| GateKeysError::Folder { path: folder.into(), reason };
    let config = gate_config(host, Arc::clone(revoked)).map_err(folder_error)?;
    let browser = browser_config(host).map_err(folder_error)?;
    let client = client_config(host).map_err(folder_error)?;
    Ok(HostConfigs {
        config: Arc::new(config),
        browser: Arc::new(browser),
        client: Arc::new(client),
    })
}

fn read_host_key(folder: &Path) -> Result<KeyFile, GateKeysError> {
    let folder_error = |reason: String| GateKeysError::Folder { path: folder.into(), reason };
    check_folder(folder)?;
    let entries = fs::read_dir(folder).map_err(|error| folder_error(error.to_string()))?;
    let mut hosts = Vec::new();
    for path in entries.flatten().map(|entry| entry.path()) {
        let is_key = path.extension().is_some_and(|it| it == KEY_SUFFIX);
        if is_key && path.file_name().is_some_and(|name| name != AUTHORITY) {
            let key = KeyFile::load(&path)?;
            if key.facts.holder.purpose == KeyPurpose::Host {
                hosts.push((path, key));
            }
        }
    }
    match hosts.len() {
        1 => Ok(hosts.swap_remove(0).1),
        0 => Err(folder_error(
            "there is no key of a host here; where the authority's key is, `armor keys add NAME \
             --role host` makes one, which belongs into this folder"
                .into(),
        )),
        _ => {
            let mut names: Vec<_> =
                hosts.iter().map(|(path, _)| path.display().to_string()).collect();
            names.sort_unstable();
            Err(folder_error(format!(
                "there are several keys of hosts ({}); keep this host's only, in a folder of its \
                 own",
                names.join(", ")
            )))
        }
    }
}

fn read_revoked(folder: &Path) -> Result<Vec<crate::Serial>, GateKeysError> {
    let path = folder.join(REVOKED);
    if !path.exists() {
        let reason = "the list of revoked keys is missing; copy it from the authority's folder, \
                      after each `armor keys revoke` too"
            .into();
        return Err(GateKeysError::Folder { path, reason });
    }
    let text = read_list(&path).map_err(|error| match error {
        FolderError::File(error) => error.into(),
        error => GateKeysError::Folder { path: path.clone(), reason: error.to_string() },
    })?;
    parse_revoked(&text).map_err(|reason| GateKeysError::Folder { path, reason })
}
