//! The folder of an authority: its own key, the keys it has made, and the list of those it has
//! revoked. It belongs on a computer of the person who decides about access, not on the robot.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use armor_files::{SaveError, create_own_folder, save_folder_owners_file};
use thiserror::Error;

use crate::authority::{Authority, IssuedKey, NewKey, Validity};
use crate::certificate::{CertificateFacts, Serial};
use crate::expiry::format_date;
use crate::identity::KeyHolder;
use crate::key_file::{KeyFileError, check_folder, read_secret, read_text};
use crate::revoked::parse_revoked;
use crate::site_name::SiteName;

/// The file of the authority's key.
pub(crate) const AUTHORITY: &str = "authority.key";
/// The list of the keys that were made.
const ISSUED: &str = "issued";
/// The list of the keys that were revoked; a gate needs a copy.
pub const REVOKED: &str = "revoked";
/// How the names of key files end.
pub const KEY_SUFFIX: &str = "key";

const ISSUED_HEADER: &str = "# The keys that this authority has made: serial number, role, name, valid from, valid until, names for browsers\n";
const REVOKED_HEADER: &str =
    "# The keys that this authority has revoked. Every gate needs a copy in its folder of keys.\n";

/// Why the folder of an authority cannot be used as asked.
#[derive(Debug, Error)]
pub enum FolderError {
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] KeyFileError),
    /// A file cannot be written.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// The folder cannot be used.
    #[error("{path}: {reason}", path = path.display())]
    Folder {
        /// The folder, or the file in it.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The request makes no sense here.
    #[error("{0}")]
    Refused(String),
}

/// The state of a key that was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyState {
    /// It is accepted.
    Valid,
    /// It was revoked.
    Revoked,
    /// Its time is over.
    Expired,
}

/// A key that was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ListedKey {
    /// What its certificate contains.
    pub facts: CertificateFacts,
    /// Whether it is accepted.
    pub state: KeyState,
}

/// A key that was just made.
#[derive(Clone, Debug)]
pub struct AddedKey {
    /// What its certificate contains.
    pub facts: CertificateFacts,
    /// Its file.
    pub path: PathBuf,
}

/// See the module.
#[derive(Debug)]
pub struct KeysFolder {
    path: PathBuf,
    /// Held while this exists, so that two commands do not change the lists at the same time.
    _lock: File,
}

impl KeysFolder {
    /// Creates the folder with a new authority.
    ///
    /// # Errors
    /// If there is one already, or it cannot be created.
    pub fn create(path: &Path, now_s: i64) -> Result<Self, FolderError> {
        let folder_error =
            |reason: String| FolderError::Folder { path: path.to_path_buf(), reason };
        create_own_folder(path).map_err(|error| folder_error(error.to_string()))?;
        check_folder(path)?;
        let file = path.join(AUTHORITY);
        if fs::symlink_metadata(&file).is_ok() {
            return Err(folder_error(
                "there is an authority already; its keys would be worthless with another one. \
                 Choose another folder, or remove this one"
                    .into(),
            ));
        }
        let authority = Authority::create(now_s).map_err(folder_error)?;
        save_folder_owners_file(&path.join(ISSUED), ISSUED_HEADER.as_bytes())?;
        save_folder_owners_file(&path.join(REVOKED), REVOKED_HEADER.as_bytes())?;
        save_folder_owners_file(&file, authority.to_text().as_bytes())?;
        Self::open(path)
    }

    /// Opens the folder of an authority.
    ///
    /// # Errors
    /// If it is not one, or others can read it.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let file = path.join(AUTHORITY);
        let folder_error = |reason: String| FolderError::Folder { path: path.into(), reason };
        if !file.exists() {
            return Err(folder_error(
                "there is no authority here; `armor keys init` makes one, --keys DIR names another \
                 folder"
                    .into(),
            ));
        }
        check_folder(path)?;
        let lock = File::open(&file).and_then(|file| file.lock().map(|()| file));
        let lock = lock.map_err(|error| folder_error(error.to_string()))?;
        Ok(Self { path: path.into(), _lock: lock })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Until when the authority itself is valid, in seconds since 1970.
    ///
    /// # Errors
    /// If its file cannot be used.
    pub fn authority_end_s(&self) -> Result<i64, FolderError> {
        Ok(self.read_authority()?.not_after_s())
    }

    /// Makes a key and its file, `NAME.key`.
    ///
    /// # Errors
    /// If the holder has a valid key already, or the name or the number of days is wrong.
    pub fn add_key(
        &self,
        key: impl Into<NewKey>,
        days: u32,
        now_s: i64,
    ) -> Result<AddedKey, FolderError> {
        let new = key.into();
        let name = &new.holder.name;
        if let Some(key) = self.find_valid(name, now_s)? {
            return Err(FolderError::Refused(format!(
                "{} has a key until {}: `armor keys renew {name}` makes a new one, `armor keys \
                 revoke {name}` ends it",
                key.facts.holder,
                format_date(key.facts.not_after_s)
            )));
        }
        self.issue_key(new, days, now_s)
    }

    /// Makes a new key with the role of the last one, which stays valid until its own end; with its
    /// names for browsers, unless `sites` has others.
    ///
    /// # Errors
    /// If there was none, or the last one was revoked.
    pub fn renew_key(
        &self,
        name: &str,
        sites: &[SiteName],
        days: u32,
        now_s: i64,
    ) -> Result<AddedKey, FolderError> {
        let keys = self.list_keys(now_s)?;
        let last = keys.iter().rev().find(|key| key.facts.holder.name == name);
        let Some(last) = last else { return Err(unknown_name(name, &keys)) };
        if last.state == KeyState::Revoked {
            return Err(FolderError::Refused(format!(
                "the key of {name} is revoked; if {name} is to have one again: armor keys add \
                 {name} --role {}",
                last.facts.holder.purpose
            )));
        }
        let sites = if sites.is_empty() { &last.facts.sites } else { sites };
        let new = NewKey { holder: last.facts.holder.clone(), sites: sites.to_vec() };
        self.issue_key(new, days, now_s)
    }

    /// Revokes all keys of a name that are valid; returns them.
    ///
    /// # Errors
    /// If there is none.
    pub fn revoke_keys(
        &self,
        name: &str,
        now_s: i64,
    ) -> Result<Vec<CertificateFacts>, FolderError> {
        let keys = self.list_keys(now_s)?;
        let of_name = |key: &&ListedKey| key.facts.holder.name == name;
        let valid: Vec<_> = keys
            .iter()
            .filter(of_name)
            .filter(|key| key.state == KeyState::Valid)
            .map(|key| key.facts.clone())
            .collect();
        if valid.is_empty() {
            return Err(match keys.iter().rev().find(of_name) {
                None => unknown_name(name, &keys),
                Some(key) if key.state == KeyState::Revoked => {
                    FolderError::Refused(format!("the key of {name} is revoked already"))
                }
                Some(_) => FolderError::Refused(format!("the key of {name} has expired")),
            });
        }
        let lines = valid.iter().map(|facts| {
            format!("{} {}, revoked {}\n", facts.serial, facts.holder, format_date(now_s))
        });
        self.append_lines(REVOKED, REVOKED_HEADER, &lines.collect::<String>())?;
        Ok(valid)
    }

    /// Returns the keys that were made, in that order.
    ///
    /// # Errors
    /// If a list cannot be read.
    pub fn list_keys(&self, now_s: i64) -> Result<Vec<ListedKey>, FolderError> {
        let revoked = self.read_revoked()?;
        let issued = self.read_list(ISSUED)?;
        let mut keys = Vec::new();
        for (at, line) in issued.lines().enumerate() {
            if line.trim().is_empty() || line.starts_with('#') {
                continue;
            }
            let facts = parse_issued(line).ok_or_else(|| FolderError::Folder {
                path: self.path.join(ISSUED),
                reason: format!("line {} is not one of `armor keys`", at + 1),
            })?;
            let state = if revoked.contains(&facts.serial) {
                KeyState::Revoked
            } else if facts.not_after_s < now_s {
                KeyState::Expired
            } else {
                KeyState::Valid
            };
            keys.push(ListedKey { facts, state });
        }
        Ok(keys)
    }

    fn find_valid(&self, name: &str, now_s: i64) -> Result<Option<ListedKey>, FolderError> {
        let is_valid =
            |key: &ListedKey| key.facts.holder.name == name && key.state == KeyState::Valid;
        Ok(self.list_keys(now_s)?.into_iter().rev().find(is_valid))
    }

    fn issue_key(&self, new: NewKey, days: u32, now_s: i64) -> Result<AddedKey, FolderError> {
        let holder = &new.holder;
        let path = self.path.join(format!("{}.{KEY_SUFFIX}", holder.name));
        if path.file_name().is_some_and(|name| name == AUTHORITY) {
            return Err(FolderError::Refused(format!(
                "{} is the name of the authority's own file; choose another name",
                holder.name
            )));
        }
        let validity = Validity::days_from(now_s, days.into());
        let IssuedKey { facts, text } =
            self.read_authority()?.issue_key(new, validity).map_err(FolderError::Refused)?;
        // A key that is in no list could not be revoked.
        self.append_lines(ISSUED, ISSUED_HEADER, &issued_line(&facts))?;
        if let Ok(metadata) = fs::symlink_metadata(&path)
            && !metadata.is_file()
        {
            let reason = "it is not a regular file; remove it".into();
            return Err(FolderError::Folder { path, reason });
        }
        // A file that exists would keep its mode.
        let _ = fs::remove_file(&path);
        save_folder_owners_file(&path, text.as_bytes())?;
        Ok(AddedKey { facts, path })
    }

    pub(crate) fn read_authority(&self) -> Result<Authority, FolderError> {
        let path = self.path.join(AUTHORITY);
        let text = read_secret(&path)?;
        Authority::from_text(&text).map_err(|reason| FolderError::Folder { path, reason })
    }

    fn read_revoked(&self) -> Result<Vec<Serial>, FolderError> {
        let path = self.path.join(REVOKED);
        parse_revoked(&self.read_list(REVOKED)?)
            .map_err(|reason| FolderError::Folder { path, reason })
    }

    fn read_list(&self, name: &str) -> Result<String, FolderError> {
        read_list(&self.path.join(name))
    }

    fn append_lines(&self, name: &str, header: &str, lines: &str) -> Result<(), FolderError> {
        let mut text = self.read_list(name)?;
        if text.is_empty() {
            text.push_str(header);
        }
        if !text.ends_with('\n') {
            text.push('\n');
        }
        text.push_str(lines);
        Ok(save_folder_owners_file(&self.path.join(name), text.as_bytes())?)
    }
}

/// The variable that names the folder of keys.
pub const KEYS_VARIABLE: &str = "ARMOR_KEYS";

/// Returns the folder of keys of this user: that in `ARMOR_KEYS`, or `armor/keys` in the folder for
/// configuration; `None` for a user without a home.
pub fn find_keys_folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    if let Some(folder) = set(KEYS_VARIABLE) {
        return Some(folder.into());
    }
    let configuration = set("XDG_CONFIG_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    let configuration =
        configuration.or_else(|| Some(PathBuf::from(set("HOME")?).join(".config")))?;
    Some(configuration.join("armor/keys"))
}

/// Whether this is the folder of an authority.
pub fn has_authority(folder: &Path) -> bool {
    folder.join(AUTHORITY).exists()
}

/// Reads a list, of which each line is short.
pub(crate) fn read_list(path: &Path) -> Result<String, FolderError> {
    let read = armor_files::open_regular_file(path).and_then(|mut file| read_text(&mut file));
    read.map_err(|reason| KeyFileError::Unreadable { path: path.into(), reason }.into())
}

fn unknown_name(name: &str, keys: &[ListedKey]) -> FolderError {
    let mut names: Vec<_> = keys.iter().map(|key| key.facts.holder.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    FolderError::Refused(format!("no key was made for {name} (there are: {names})"))
}

fn issued_line(facts: &CertificateFacts) -> String {
    let CertificateFacts { holder, serial, not_before_s, not_after_s, sites } = facts;
    let sites: Vec<_> = sites.iter().map(SiteName::to_string).collect();
    let line = format!(
        "{serial} {} {} {not_before_s} {not_after_s} {}",
        holder.purpose,
        holder.name,
        sites.join(",")
    );
    format!("{}\n", line.trim_end())
}

fn parse_issued(line: &str) -> Option<CertificateFacts> {
    let words: Vec<_> = line.split_whitespace().collect();
    let [serial, purpose, name, not_before_s, not_after_s, ref sites @ ..] = words[..] else {
        return None;
    };
    let sites = match sites {
        [] => Vec::new(),
        [sites] => sites.split(',').map(str::parse).collect::<Result<_, _>>().ok()?,
        _ => return None,
    };
    Some(CertificateFacts {
        holder: KeyHolder { name: name.into(), purpose: purpose.parse().ok()? },
        serial: serial.parse().ok()?,
        not_before_s: not_before_s.parse().ok()?,
        not_after_s: not_after_s.parse().ok()?,
        sites,
    })
}
