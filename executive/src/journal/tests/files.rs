//! Journals on disk.

use super::{records, snapshot};
use crate::journal::*;
use crate::record::{JournalEntry, JournalRecord};
use crate::terms::{ComponentReport, MissionOutcome};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A new folder of this test, and the path of a journal in it.
fn folder(name: &str) -> (PathBuf, PathBuf) {
    let folder = std::env::temp_dir().join(format!("armor-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let journal = folder.join("mission.journal");
    (folder, journal)
}

fn damage(path: &Path) -> Box<JournalDamage> {
    match Journal::open(path) {
        Err(JournalError::Damaged(damage)) => damage,
        other => panic!("damage was expected: {other:?}"),
    }
}

#[test]
fn what_was_written_is_read_and_a_torn_line_is_cut_off() {
    let (folder, path) = folder("journal");
    let (mut journal, story) = Journal::open(&path).unwrap();
    assert!(story.records.is_empty() && story.life.is_none());
    let life = Life {
        boot: "b".to_owned(),
        zero_ns: -5,
        anchor: Some(Anchor { instance: u64::MAX, stamp_s: 1.5, at_ns: 3 }),
    };
    journal.begin(life.clone()).unwrap();
    records().into_iter().for_each(|record| journal.write(record).unwrap());
    journal.sync().unwrap();
    let whole = std::fs::read(&path).unwrap();
    let mut torn = whole.clone();
    torn.extend(b"{\"journal\":2,\"n\":6,\"mo");
    std::fs::write(&path, &torn).unwrap();
    assert_eq!(read(&path).unwrap().records, records());
    assert_eq!(std::fs::read(&path).unwrap(), torn, "reading changes nothing");
    let (_, story) = Journal::open(&path).unwrap();
    assert_eq!((story.records, story.life), (records(), Some(life)));
    assert_eq!(std::fs::read(&path).unwrap(), whole);
    std::fs::write(&path, b"nonsense\n").unwrap();
    let fault = damage(&path).fault;
    assert!(matches!(fault, JournalFault::Line { line: 1, damage: LineDamage::NoRecord, .. }));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_journal_laid_to_rest_continues_from_its_last_record() {
    let (folder, path) = folder("rest");
    rest(&path).unwrap();
    let story = read(&path).unwrap();
    assert!(!story.is_blank() && !story.is_unfinished(), "nothing has begun");
    let second = Duration::from_secs(1);
    assert_eq!(clock(&story, "boot", 100 * second).1, Duration::ZERO);

    let (mut journal, story) = Journal::open(&path).unwrap();
    journal.begin(clock(&story, "boot", 100 * second).0).unwrap();
    records().into_iter().for_each(|record| journal.write(record).unwrap());
    journal.sync().unwrap();
    let story = read(&path).unwrap();
    assert!(story.is_unfinished());
    assert_eq!(clock(&story, "boot", 160 * second).1, 60 * second, "it was only killed");
    rest(&path).unwrap();
    let story = read(&path).unwrap();
    assert_eq!(story.records, records());
    let last = story.records.last().unwrap().at;
    assert_eq!(clock(&story, "boot", 160 * second).1, last);

    let over =
        JournalRecord { at: last, entry: JournalEntry::Ended { outcome: MissionOutcome::Goal } };
    let (mut journal, _) = Journal::open(&path).unwrap();
    journal.write(over).unwrap();
    journal.sync().unwrap();
    assert!(!read(&path).unwrap().is_unfinished());
    assert!(Story::default().is_blank());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_report_of_any_value_is_read_back() {
    for value in [0.1, -1e300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let report = ComponentReport::Event { name: "seen".to_owned(), value };
        let component = "c".to_owned();
        let entry = JournalEntry::Heard { component, instance: 1, serial: 1, report };
        let record = JournalRecord { at: Duration::ZERO, entry };
        let line = serde_json::to_string(&record).unwrap();
        let again: JournalRecord = serde_json::from_str(&line).unwrap();
        assert_eq!(format!("{again:?}"), format!("{record:?}"), "{line}");
    }
}

#[test]
fn a_cut_journal_holds_one_record_and_continues() {
    let (folder, path) = folder("cut");
    let life = Life { boot: "b".to_owned(), zero_ns: -5, anchor: None };
    let (first, records) = (&snapshot(), records());
    let last = records.last().unwrap();
    let (mut journal, _) = Journal::open(&path).unwrap();
    journal.begin(life.clone()).unwrap();
    assert!(!journal.is_longer_than(1000));
    while !journal.is_longer_than(1000) {
        records.iter().for_each(|record| journal.write(record.clone()).unwrap());
        journal.sync().unwrap();
    }
    // The unfinished file of a killed executive does not disturb the cut.
    std::fs::write(folder.join("left-over.new"), b"{\"at_ns\":12,\"ent").unwrap();
    journal.cut(life.clone(), first.clone()).unwrap();
    assert!(!journal.is_longer_than(0), "it is as short as it can be");
    journal.write(last.clone()).unwrap();
    journal.sync().unwrap();
    let (_, story) = Journal::open(&path).unwrap();
    assert_eq!((story.records, story.life), (vec![first.clone(), last.clone()], Some(life)));
    let files = std::fs::read_dir(&folder).unwrap().count();
    assert_eq!(files, 3, "the cut leaves no file but the journal and its state");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_journal_of_another_version_is_refused_and_stays() {
    let (folder, path) = folder("old");
    let old = b"{\"life\":{\"boot\":\"\",\"zero_ns\":0}}\n";
    std::fs::write(&path, old).unwrap();
    let error = Journal::open(&path).unwrap_err();
    assert!(matches!(error, JournalError::Foreign { format: 1, .. }));
    let text = error.to_string();
    assert!(text.contains("an earlier version of Armor") && text.contains("move the"), "{text}");
    assert_eq!(std::fs::read(&path).unwrap(), old);
    assert!(!state_path(&path).exists());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_damaged_journal_is_kept_and_its_successor_counts_as_damaged_until_it_has_begun() {
    let (folder, path) = folder("replaced");
    let (mut journal, _) = Journal::open(&path).unwrap();
    records().into_iter().for_each(|record| journal.write(record).unwrap());
    journal.sync().unwrap();
    std::fs::remove_file(&path).unwrap();
    let missing = damage(&path);
    assert_eq!(missing.fault, JournalFault::Missing { committed: 4 });
    let (_, kept) = Journal::replace_damaged(&missing).unwrap();
    assert_eq!(kept, None);
    assert_eq!(damage(&path).fault, JournalFault::Emptied { committed: 1 });

    std::fs::write(&path, b"nonsense\n").unwrap();
    let (mut journal, kept) = Journal::replace_damaged(&damage(&path)).unwrap();
    let kept = kept.unwrap();
    assert_eq!(std::fs::read(&kept).unwrap(), b"nonsense\n");
    assert!(state_path(&kept).exists());
    records().into_iter().for_each(|record| journal.write(record).unwrap());
    assert!(matches!(Journal::open(&path), Err(JournalError::Damaged(_))), "nothing is written");
    journal.sync().unwrap();
    assert_eq!(Journal::open(&path).unwrap().1.records, records());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_reserved_space_is_not_part_of_the_content() {
    let (folder, path) = folder("reserved");
    let (mut journal, _) = Journal::open(&path).unwrap();
    records().into_iter().for_each(|record| journal.write(record).unwrap());
    journal.sync().unwrap();
    assert_eq!(journal.shortage(), None);
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(bytes.last(), Some(&b'\n'));
    journal.release_reserve();
    assert_eq!(std::fs::read(&path).unwrap(), bytes);
    std::fs::remove_dir_all(&folder).unwrap();
}
