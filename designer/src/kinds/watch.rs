//! Asks for the kinds on a thread, immediately and whenever something they come from has changed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, SystemTime};

use crate::kinds::{Kinds, KindsError, find_armor};

/// Pause between two looks for a changed executable or directory.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// The kinds, kept up to date.
pub struct KindsWatch {
    folders: Sender<PathBuf>,
    news: Receiver<Result<Kinds, KindsError>>,
}

impl KindsWatch {
    /// Watches the given component directories and `components/` in `folder`; `wake` is called when
    /// there are news.
    pub fn start(
        folder: PathBuf,
        directories: Vec<PathBuf>,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let (folders, inbox) = channel();
        let (outbox, news) = channel();
        let mut watch = Watch { directories, seen: Stamps::new(), sent: None };
        let run = move || {
            let mut folder = folder;
            loop {
                if let Some(found) = watch.look(&folder) {
                    if outbox.send(found).is_err() {
                        return;
                    }
                    wake();
                }
                match inbox.recv_timeout(LOOK_EVERY) {
                    Ok(other) => folder = other,
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                }
            }
        };
        if let Err(error) = std::thread::Builder::new().name("kinds".into()).spawn(run) {
            tracing::error!(%error, "no kinds are known: no thread could be started");
        }
        Self { folders, news }
    }

    /// Shows that the file is in another folder now.
    pub fn set_folder(&self, folder: PathBuf) {
        // Sending fails only if the thread could not be started, which is in the log.
        let _ = self.folders.send(folder);
    }

    /// The newest kinds, if there are newer ones.
    pub fn news(&self) -> Option<Result<Kinds, KindsError>> {
        self.news.try_iter().last()
    }
}

/// When each file or folder was changed last.
type Stamps = BTreeMap<PathBuf, Option<SystemTime>>;

struct Watch {
    directories: Vec<PathBuf>,
    seen: Stamps,
    sent: Option<Kinds>,
}

impl Watch {
    /// Asks, if anything changed since it asked last.
    fn look(&mut self, folder: &Path) -> Option<Result<Kinds, KindsError>> {
        let armor = find_armor();
        let stamps = self.stamps(folder, armor.as_deref());
        if self.seen == stamps && !stamps.is_empty() {
            return None;
        }
        self.seen = stamps;
        let found = match armor {
            Some(armor) => Kinds::ask(&armor, folder, &self.directories),
            None => Err(KindsError::NoArmor),
        };
        match found {
            Ok(kinds) if self.sent.as_ref() == Some(&kinds) => None,
            Ok(kinds) => {
                self.sent = Some(kinds.clone());
                Some(Ok(kinds))
            }
            Err(error) => Some(Err(error)),
        }
    }

    fn stamps(&self, folder: &Path, armor: Option<&Path>) -> Stamps {
        let own = folder.join("components");
        let mut stamps = Stamps::new();
        for directory in self.directories.iter().chain([&own]) {
            stamps.insert(directory.clone(), changed(directory));
            for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
                stamps.insert(entry.path(), changed(&entry.path()));
            }
        }
        // Also when there is none: it may come.
        let armor = armor.map_or_else(|| PathBuf::from("armor"), Path::to_path_buf);
        stamps.insert(armor.clone(), changed(&armor));
        stamps
    }
}

fn changed(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|metadata| metadata.modified()).ok()
}
