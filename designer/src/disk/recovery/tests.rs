use super::*;
use crate::disk::scratch::Scratch;

fn work(text: &str) -> Kept {
    let path = Some("/home/a/rover.xml".into());
    Kept { at: 1, files: vec![KeptFile { path, saved: "old".into(), text: Some(text.into()) }] }
}

fn read(recovery: &mut Recovery) -> Option<Kept> {
    recovery.wait_until_written();
    let bytes = fs::read(recovery.file()).ok()?;
    Some(serde_json::from_slice(&bytes).expect("what was written"))
}

#[test]
fn the_first_change_is_kept_at_once_and_the_next_after_a_pause() {
    let folder = Scratch::new();
    let mut recovery = Recovery::begin(folder.path()).expect("a name");
    let start = Instant::now();
    assert_eq!(recovery.back_up(start, 1, || Some(work("one"))), None);
    assert_eq!(read(&mut recovery), Some(work("one")));

    let soon = start + Duration::from_millis(500);
    let wait = recovery.back_up(soon, 2, || unreachable!("it is too soon"));
    assert_eq!(wait, Some(EVERY - Duration::from_millis(500)));
    assert_eq!(recovery.back_up(start + EVERY, 2, || Some(work("two"))), None);
    assert_eq!(read(&mut recovery), Some(work("two")));
    let later = start + 10 * EVERY;
    assert_eq!(recovery.back_up(later, 2, || unreachable!("nothing has changed")), None);
}

#[test]
fn nothing_is_left_when_all_is_saved() {
    let folder = Scratch::new();
    let mut recovery = Recovery::begin(folder.path()).expect("a name");
    let start = Instant::now();
    recovery.back_up(start, 1, || Some(work("one")));
    recovery.back_up(start + EVERY, 2, || None);
    assert_eq!(read(&mut recovery), None);
    recovery.back_up(start + EVERY, 3, || Some(work("three")));
    drop(recovery);
    assert_eq!(fs::read_dir(folder.path()).expect("there").count(), 0);
}

#[test]
fn work_is_offered_when_its_process_is_gone_and_not_before() {
    let folder = Scratch::new();
    let mut recovery = Recovery::begin(folder.path()).expect("a name");
    recovery.back_up(Instant::now(), 1, || Some(work("one")));
    recovery.wait_until_written();
    assert!(orphans(folder.path()).is_empty(), "its designer lives");

    // A crash: the lock goes, the files stay.
    let died = std::thread::scope(|scope| {
        let crash = scope.spawn(move || {
            let _recovery = recovery;
            std::panic::resume_unwind(Box::new("a crash"));
        });
        crash.join()
    });
    assert!(died.is_err());
    let mut found = orphans(folder.path());
    assert_eq!(found.len(), 1);
    assert!(orphans(folder.path()).is_empty(), "it is offered once at a time");
    let orphan = found.remove(0);
    assert_eq!(orphan.kept, work("one"));
    orphan.discard();
    assert_eq!(fs::read_dir(folder.path()).expect("there").count(), 0);
}

#[test]
fn what_cannot_be_read_is_neither_offered_nor_removed() {
    let folder = Scratch::new();
    let broken = folder.path().join("7-0.json");
    fs::write(&broken, "{ not ours").expect("written");
    assert!(orphans(folder.path()).is_empty());
    assert!(broken.exists());
}

#[test]
fn a_folder_that_cannot_be_written_is_reported() {
    let folder = Scratch::new();
    let mut recovery = Recovery::begin(folder.path()).expect("a name");
    fs::remove_dir_all(folder.path()).expect("removed");
    recovery.back_up(Instant::now(), 1, || Some(work("one")));
    recovery.wait_until_written();
    let trouble = recovery.trouble().expect("trouble is reported");
    assert!(trouble.contains("cannot be backed up"), "{trouble}");
}
