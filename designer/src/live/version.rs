//! The texts of the versions that a system of this host runs, from the folder of its run.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use armor_configd::{KeptVersion, kept_numbers, kept_version};
use armor_inspect::WakeCallback;
use parking_lot::Mutex;

/// The folder of the versions in the folder of a run.
const VERSIONS: &str = "configd";
/// Pause between two looks at the folder, which may be on a slow disk: a thread looks.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// The versions of the file that a system runs.
pub struct RunningVersions {
    shared: Arc<SharedVersions>,
}

#[derive(Default)]
struct SharedVersions {
    known: Mutex<KnownVersions>,
    /// The version that the mission plays; 0 if there is no mission.
    wanted: AtomicU64,
    is_closing: AtomicBool,
}

#[derive(Default)]
struct KnownVersions {
    in_force: Option<Arc<KeptVersion>>,
    played: Option<Arc<KeptVersion>>,
}

impl RunningVersions {
    /// Begins to follow the versions of the run whose folder is `out`; `wake` is called at each
    /// new one.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(out: &Path, wake: WakeCallback) -> io::Result<Self> {
        let shared = Arc::<SharedVersions>::default();
        let (of_thread, folder) = (Arc::clone(&shared), out.join(VERSIONS));
        std::thread::Builder::new()
            .name("look-versions".into())
            .spawn(move || of_thread.follow(&folder, &wake))?;
        Ok(Self { shared })
    }

    /// These versions, which stay: for tests.
    pub fn still(in_force: KeptVersion, played: Option<KeptVersion>) -> Self {
        let known =
            KnownVersions { in_force: Some(Arc::new(in_force)), played: played.map(Arc::new) };
        let shared = SharedVersions { known: Mutex::new(known), ..SharedVersions::default() };
        Self { shared: Arc::new(shared) }
    }

    /// The version that the components run.
    pub fn in_force(&self) -> Option<Arc<KeptVersion>> {
        self.shared.known.lock().in_force.clone()
    }

    /// The version with this number, which the mission plays. It may be read a moment later.
    pub fn played(&self, number: u64) -> Option<Arc<KeptVersion>> {
        self.shared.wanted.store(number, Ordering::Relaxed);
        let known = self.shared.known.lock();
        let versions = [&known.in_force, &known.played];
        versions.into_iter().flatten().find(|version| version.number == number).cloned()
    }
}

impl Drop for RunningVersions {
    fn drop(&mut self) {
        self.shared.is_closing.store(true, Ordering::Relaxed);
    }
}

impl SharedVersions {
    fn follow(&self, folder: &Path, wake: &WakeCallback) {
        while !self.is_closing.load(Ordering::Relaxed) {
            if self.look(folder) {
                wake();
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }

    /// Reads what is new; returns whether anything is. After the end of the run the folder may be
    /// that of another one, or gone: what is known stays until a whole version is read.
    fn look(&self, folder: &Path) -> bool {
        let numbers = kept_numbers(folder);
        let (in_force, played) = {
            let known = self.known.lock();
            (number_of(known.in_force.as_ref()), number_of(known.played.as_ref()))
        };
        let mut is_new = false;
        if let Some(version) = new_version(folder, numbers.last().copied(), in_force) {
            self.known.lock().in_force = Some(version);
            is_new = true;
        }
        let wanted = Some(self.wanted.load(Ordering::Relaxed)).filter(|it| numbers.contains(it));
        if let Some(version) = new_version(folder, wanted, played) {
            self.known.lock().played = Some(version);
            is_new = true;
        }
        is_new
    }
}

fn number_of(version: Option<&Arc<KeptVersion>>) -> Option<u64> {
    version.map(|version| version.number)
}

fn new_version(folder: &Path, wanted: Option<u64>, known: Option<u64>) -> Option<Arc<KeptVersion>> {
    let wanted = wanted.filter(|wanted| Some(*wanted) != known)?;
    kept_version(folder, wanted).ok().map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn store(folder: &Path, number: u64, text: &str) {
        let folder = folder.join(number.to_string());
        std::fs::create_dir_all(&folder).expect("writable");
        std::fs::write(folder.join("1-a.xml"), text).expect("writable");
        std::fs::write(folder.join("index"), "1-a.xml\tm/a.xml\n").expect("writable");
    }

    #[test]
    fn the_newest_version_and_the_played_one_are_read_once_each() {
        let folder = std::env::temp_dir().join(format!("armor-versions-{}", std::process::id()));
        let shared = Arc::<SharedVersions>::default();
        let versions = RunningVersions { shared: Arc::clone(&shared) };
        assert!(!shared.look(&folder), "there is no run yet");
        store(&folder, 1, "one");
        assert!(shared.look(&folder) && !shared.look(&folder));
        store(&folder, 3, "three");
        assert!(shared.look(&folder));
        assert_eq!(versions.in_force().map(|it| it.number), Some(3));
        assert!(versions.played(1).is_none(), "it is read at the next look");
        assert!(shared.look(&folder) && !shared.look(&folder));
        assert_eq!(versions.played(1).map(|it| it.files[0].1.clone()), Some("one".into()));
        assert_eq!(versions.played(3).map(|it| it.number), Some(3));
        std::fs::remove_dir_all(&folder).expect("ours");
        assert!(!shared.look(&folder), "what is known stays");
        assert_eq!(versions.in_force().map(|it| it.number), Some(3));
    }
}
