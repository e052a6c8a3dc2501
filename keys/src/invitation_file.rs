//! The file of invitations in the folder of a host's keys. `armor keys` and the servers of this host
//! change it, each under a lock; a server sees a change of another program within a second.

use std::fs::{self, File};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use armor_files::save_folder_owners_file;
use parking_lot::Mutex;
use ring::rand::{SecureRandom, SystemRandom};

use crate::folder::FolderError;
use crate::invitations::{Invitations, SECRET_LEN, Secret};
use crate::key_file::{check_folder, read_long_secret};

/// The file.
pub const INVITATIONS: &str = "invitations";
/// Longest file, in bytes: half as much again as the most invitations with all their sessions need.
const MAX_LEN: u64 = 1 << 20;

/// See the module.
#[derive(Debug)]
pub struct InvitationFile {
    folder: PathBuf,
    /// Held while the file is read or written; what it was when it was last read.
    disk: Mutex<Option<FileState>>,
    /// Held for a moment only: STOP asks for it, and must not wait for a disk.
    current: Mutex<Arc<Invitations>>,
}

/// What is looked at to find out whether the file has changed.
type FileState = (u64, u64, i64, i64);

impl InvitationFile {
    /// Reads the file in this folder; without one there are no invitations.
    ///
    /// # Errors
    /// If others can read the folder or the file, or it is not one of `armor keys`.
    pub fn open(folder: &Path) -> Result<Self, FolderError> {
        check_folder(folder)?;
        let path = folder.join(INVITATIONS);
        let seen = look_at(&path);
        let current = Mutex::new(Arc::new(read_invitations(&path)?));
        Ok(Self { folder: folder.into(), disk: Mutex::new(seen), current })
    }

    /// Whether there is a file in this folder.
    pub fn exists_in(folder: &Path) -> bool {
        folder.join(INVITATIONS).symlink_metadata().is_ok()
    }

    /// Where it is.
    pub fn path(&self) -> PathBuf {
        self.folder.join(INVITATIONS)
    }

    /// Reads the file again if it has changed; returns whether it has.
    ///
    /// # Errors
    /// As [`Self::open`]; what was read before stays in force.
    pub fn look(&self) -> Result<bool, FolderError> {
        self.look_again(&mut self.disk.lock())
    }

    /// Does the same as [`Self::look`], unless the file is being read or written right now: that may
    /// take long while the disk hangs, and what is changed here is current without another look.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn look_unless_busy(&self) -> Result<bool, FolderError> {
        self.disk.try_lock().map_or(Ok(false), |mut seen| self.look_again(&mut seen))
    }

    fn look_again(&self, seen: &mut Option<FileState>) -> Result<bool, FolderError> {
        let path = self.path();
        let state = look_at(&path);
        if state == *seen {
            return Ok(false);
        }
        // A problem is reported once.
        *seen = state;
        check_folder(&self.folder)?;
        let read = Arc::new(read_invitations(&path)?);
        *self.current.lock() = read;
        Ok(true)
    }

    /// The invitations as last read.
    pub fn current(&self) -> Arc<Invitations> {
        Arc::clone(&self.current.lock())
    }

    /// Changes the invitations: reads them, and saves what `change` has made of them if it succeeds.
    /// No other program changes them meanwhile. They are on the disk when this returns.
    ///
    /// # Errors
    /// That of `change`, or why the file was not read or saved; the file is unchanged then.
    pub fn change<R, E: From<FolderError>>(
        &self,
        change: impl FnOnce(&mut Invitations) -> Result<R, E>,
    ) -> Result<R, E> {
        let path = self.path();
        let folder_error = |reason: std::io::Error| FolderError::Folder {
            path: self.folder.clone(),
            reason: reason.to_string(),
        };
        check_folder(&self.folder).map_err(FolderError::from)?;
        let lock = File::open(&self.folder).map_err(folder_error)?;
        // Before the mutex: another program that hangs with the lock keeps no reader waiting.
        lock.lock().map_err(folder_error)?;
        let mut seen = self.disk.lock();
        let mut invitations = read_invitations(&path)?;
        let done = change(&mut invitations)?;
        save_folder_owners_file(&path, invitations.to_text().as_bytes())
            .map_err(FolderError::from)?;
        *seen = look_at(&path);
        *self.current.lock() = Arc::new(invitations);
        Ok(done)
    }
}

/// Draws a new secret.
///
/// # Errors
/// If the system has no random numbers.
pub fn draw_secret() -> Result<Secret, FolderError> {
    let mut bytes = [0; SECRET_LEN];
    let drawn = SystemRandom::new().fill(&mut bytes);
    drawn.map_err(|_| FolderError::Refused("the system has no random numbers".into()))?;
    Ok(Secret::new(bytes))
}

fn look_at(path: &Path) -> Option<FileState> {
    let metadata = fs::symlink_metadata(path).ok()?;
    Some((metadata.ino(), metadata.size(), metadata.mtime(), metadata.mtime_nsec()))
}

fn read_invitations(path: &Path) -> Result<Invitations, FolderError> {
    let folder_error = |reason| FolderError::Folder { path: path.into(), reason };
    let metadata = match fs::symlink_metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Ok(Invitations::default());
        }
        Err(error) => return Err(folder_error(error.to_string())),
    };
    if metadata.is_symlink() {
        let reason = "it is a symbolic link, which is not followed: remove the link".to_owned();
        return Err(folder_error(reason));
    }
    Invitations::from_text(&read_long_secret(path, MAX_LEN)?).map_err(|reason| {
        folder_error(format!(
            "{reason}; another version of armor may have written it. Without this file nobody is \
             logged in: remove it, and make new invitations with `armor keys invite`"
        ))
    })
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;
    use std::os::unix::fs::{PermissionsExt, symlink};

    use armor_wire::acting::KeyRole;

    use super::*;
    use crate::invitations::{InvitationOrder, MAX_DEVICES, MAX_INVITATIONS};

    fn private_folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        fs::set_permissions(folder.path(), Permissions::from_mode(0o700)).expect("its mode");
        folder
    }

    fn invite(file: &InvitationFile, name: &str) -> Secret {
        let secret = draw_secret().expect("random numbers");
        let order =
            InvitationOrder { name: name.into(), role: KeyRole::Observer, for_s: 60, devices: 1 };
        file.change(|all| all.invite(&order, &secret, 0).map(drop).map_err(FolderError::Refused))
            .expect("it is made");
        secret
    }

    #[test]
    fn a_change_of_another_program_is_seen_and_survives_a_restart() {
        let folder = private_folder();
        let server = InvitationFile::open(folder.path()).expect("no file yet");
        assert!(!InvitationFile::exists_in(folder.path()));
        assert!(!server.look().expect("nothing has changed"));
        let tool = InvitationFile::open(folder.path()).expect("another program");
        let link = invite(&tool, "alice");
        assert!(server.look().expect("it is read") && !server.look().expect("once"));
        let session = draw_secret().expect("random numbers");
        let redeemed = server.change(|all| {
            all.redeem(&link, &session, None, 1)
                .map_err(|fault| FolderError::Refused(fault.to_string()))
        });
        assert_eq!(redeemed.expect("it is accepted").name, "alice");
        invite(&tool, "bob");
        let again = InvitationFile::open(folder.path()).expect("a restart");
        assert!(again.current().find_visitor(&session, 2).is_ok(), "a session survives");
        assert_eq!(again.current().list().len(), 2, "no change is lost");
        let mode = fs::metadata(again.path()).expect("the file").mode() & 0o777;
        assert_eq!(mode, 0o600);
    }

    #[test]
    fn a_file_that_others_can_read_or_redirect_is_refused() {
        let folder = private_folder();
        let file = InvitationFile::open(folder.path()).expect("no file yet");
        invite(&file, "alice");
        fs::set_permissions(file.path(), Permissions::from_mode(0o644)).expect("its mode");
        let error = InvitationFile::open(folder.path()).expect_err("others can read it");
        assert!(error.to_string().contains("chmod 600"), "{error}");
        let elsewhere = folder.path().join("elsewhere");
        fs::rename(file.path(), &elsewhere).expect("it is moved");
        symlink(&elsewhere, file.path()).expect("a link");
        let before = fs::read(&elsewhere).expect("the file");
        let refused = file.change(|_| Ok::<_, FolderError>(()));
        assert!(refused.expect_err("a link").to_string().contains("symbolic link"));
        assert_eq!(fs::read(&elsewhere).expect("the file"), before);
        assert!(file.look().is_err() && !file.look().expect("reported once"));
        assert_eq!(file.current().list().len(), 1, "what was read before stays in force");
        fs::set_permissions(folder.path(), Permissions::from_mode(0o755)).expect("its mode");
        let error = InvitationFile::open(folder.path()).expect_err("others can enter");
        assert!(error.to_string().contains("chmod 700"), "{error}");
    }

    #[test]
    fn the_most_invitations_with_all_their_sessions_are_read_again() {
        let folder = private_folder();
        let file = InvitationFile::open(folder.path()).expect("no file yet");
        let name = "a".repeat(64);
        let order = InvitationOrder {
            name: name.clone(),
            role: KeyRole::Observer,
            for_s: 60,
            devices: MAX_DEVICES,
        };
        let fill = |all: &mut Invitations| {
            for _ in 0..MAX_INVITATIONS {
                let secret = draw_secret()?;
                all.invite(&order, &secret, 0).map_err(FolderError::Refused)?;
                for _ in 0..MAX_DEVICES {
                    let session = draw_secret()?;
                    let redeemed = all.redeem(&secret, &session, Some(&session), 1);
                    redeemed.map_err(|fault| FolderError::Refused(fault.to_string()))?;
                }
            }
            Ok::<_, FolderError>(())
        };
        file.change(fill).expect("they are saved");
        let len = fs::metadata(file.path()).expect("the file").len();
        assert!(len > 64 << 10 && len + len / 3 < MAX_LEN, "{len}");
        let revoked = file.change(|all| Ok::<_, FolderError>(all.revoke(&name, 2)));
        assert_eq!(revoked.expect("it is read"), MAX_INVITATIONS);
    }

    #[test]
    fn what_another_version_wrote_is_refused_with_what_to_do() {
        let folder = private_folder();
        let file = InvitationFile::open(folder.path()).expect("no file yet");
        invite(&file, "alice");
        let text = fs::read_to_string(file.path()).expect("the file");
        fs::write(file.path(), format!("{text}future 2 x\n")).expect("written");
        let error = InvitationFile::open(folder.path()).expect_err("an unknown line");
        assert!(error.to_string().contains("remove it, and make new invitations"), "{error}");
    }

    #[test]
    fn another_program_that_hangs_with_the_lock_keeps_no_reader_waiting() {
        let folder = private_folder();
        let file = InvitationFile::open(folder.path()).expect("no file yet");
        let other = File::open(folder.path()).expect("the folder");
        other.lock().expect("the lock");
        std::thread::scope(|scope| {
            // Moved here: if an assertion fails, the change must not wait for it.
            let other = other;
            let change = scope.spawn(|| invite(&file, "alice"));
            let begin = std::time::Instant::now();
            // By far long enough for the change to arrive at the lock.
            while begin.elapsed() < std::time::Duration::from_millis(200) {
                assert!(file.disk.try_lock().is_some(), "a reader would wait");
                assert!(!file.look().expect("nothing has changed"));
            }
            assert!(!change.is_finished());
            drop(other);
            change.join().expect("it is made");
        });
        assert_eq!(file.current().list().len(), 1);
    }

    #[test]
    fn a_look_that_may_not_wait_passes_over_a_change_under_way() {
        let folder = private_folder();
        let file = InvitationFile::open(folder.path()).expect("no file yet");
        invite(&InvitationFile::open(folder.path()).expect("another program"), "alice");
        let looked = file.change(|_| {
            let looked = file.look_unless_busy().expect("it does not wait");
            Ok::<_, FolderError>(looked)
        });
        assert!(!looked.expect("the change is made"));
        assert_eq!(file.current().list().len(), 1, "the change has read it");
        invite(&InvitationFile::open(folder.path()).expect("another program"), "bob");
        assert!(file.look_unless_busy().expect("it is read"));
    }

    #[test]
    fn what_root_writes_into_the_folder_of_another_user_is_theirs() {
        const OTHER: u32 = 65534;
        let folder = private_folder();
        if std::os::unix::fs::chown(folder.path(), Some(OTHER), Some(OTHER)).is_err() {
            // Only root can give a folder away.
            return;
        }
        let file = InvitationFile::open(folder.path()).expect("no file yet");
        let owner = || {
            let metadata = fs::metadata(file.path()).expect("the file");
            (metadata.uid(), metadata.gid(), metadata.mode() & 0o777)
        };
        invite(&file, "alice");
        assert_eq!(owner(), (OTHER, OTHER, 0o600));
        std::os::unix::fs::chown(file.path(), Some(0), Some(0))
            .expect("as an older version left it");
        invite(&file, "bob");
        assert_eq!(owner(), (OTHER, OTHER, 0o600), "it is repaired");
    }

    #[test]
    fn a_refused_change_writes_nothing() {
        let folder = private_folder();
        let file = InvitationFile::open(folder.path()).expect("no file yet");
        let refused = file.change(|_| Err::<(), _>(FolderError::Refused("no".into())));
        assert_eq!(refused.expect_err("refused").to_string(), "no");
        assert!(!file.path().exists());
    }
}
