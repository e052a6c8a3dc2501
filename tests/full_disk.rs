//! A disk that is full: of `--out`, on a small file system of its own.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use crate::fixture::{Folder, is_alive, wait_for};
use crate::resilience::system::Draft;

/// Two tokens: one moves back and forth, which fills the journal; the other lets a component run.
const MISSION: &str = "
<mission name='turns' goal='over' safe='hold'>
  <place name='one' initial='true'/>
  <place name='two'/>
  <place name='work' initial='true' components='north'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='there' from='one' to='two' timeout='2ms'/>
  <transition name='back' from='two' to='one' timeout='2ms'/>
  <transition name='leave' from='one work' to='over' operator='true'/>
</mission>";

/// How a run ends whose mission ends in its safe place.
const SAFE: i32 = 1;

/// Writes until nothing more fits.
fn fill_disk(path: &Path) {
    let mut file = File::create(path).expect("on the small disk");
    for len in [64 << 10, 1 << 10, 1] {
        while file.write_all(&vec![b'x'; len]).is_ok() {}
    }
}

#[test]
fn a_full_disk_leads_to_the_safe_place_and_to_an_orderly_end() {
    let draft = Draft::default()
        .component("<component name='north' kind='probe' rate='50Hz'/>")
        .mission(MISSION);
    let folder = Folder::new("full-disk");
    let Some(mut system) = draft.run_on_small_disk(folder, 6 << 10) else {
        eprintln!("skipped: this user may not mount a file system");
        return;
    };
    let printed = system.folder.path().join("printed.log");
    let printed = || fs::read_to_string(&printed).unwrap_or_default();
    let north = system.pid("north");
    wait_for("the first turns", || printed().contains("back: two -> one").then_some(()));
    fill_disk(&system.run.out().join("filler"));
    let code = system.run.code();
    let log = printed();
    let position = |text: &str| log.find(text).unwrap_or_else(|| panic!("no {text:?} in\n{log}"));
    // The logs give way to the journal, and count what they lose.
    position("lines are lost: ");
    let noticed = position("no space is left for the journal of the mission");
    let retreat = position("retreats: no space is left for the journal");
    let ended = position("the mission ended in its safe place");
    assert!(noticed < retreat && retreat < ended, "{log}");
    assert_eq!(code, Some(SAFE), "{log}");
    assert!(!is_alive(north), "it ends as at every end of a run");
    assert!(!log.contains("panicked") && !log.contains("ended by signal"), "{log}");
}
