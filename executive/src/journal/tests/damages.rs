//! Damages of committed journals, drawn from seeds: each is found, and named.

use super::*;
use crate::tests::simulation::dice::Dice;

const SEEDS: u64 = 100;

/// A committed journal of 12 to 51 records in batches of one to three.
fn committed(dice: &mut Dice) -> JournalOnDisk {
    let mut disk = JournalOnDisk::new();
    disk.append(&[life_line()]);
    disk.commit();
    let records = 11 + dice.roll(40) as u64;
    let mut firing = 0;
    while firing < records {
        let size = (1 + dice.roll(3) as u64).min(records - firing);
        let batch: Vec<_> = (firing + 1..=firing + size).map(put_line).collect();
        disk.append(&batch);
        disk.commit();
        firing += size;
    }
    disk
}

fn lines(disk: &JournalOnDisk) -> Vec<Vec<u8>> {
    disk.journal.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect()
}

/// Damages the journal of each seed, and expects the fault.
fn check(kind: &str, damage: impl Fn(&mut JournalOnDisk, &mut Dice) -> &'static [&'static str]) {
    for seed in 0..SEEDS {
        let mut dice = Dice::new(seed);
        let mut disk = committed(&mut dice);
        let whole = disk.verify();
        assert_eq!((whole.fault, whole.torn_len), (None, 0), "seed {seed}");
        let kinds = damage(&mut disk, &mut dice);
        let found = disk.verify();
        let fault = found.fault.unwrap_or_else(|| panic!("{kind}, seed {seed}: nothing is found"));
        assert!(kinds.contains(&fault.kind()), "{kind}, seed {seed}: {fault:?}");
        let before = &whole.story.records[..found.story.records.len()];
        assert_eq!(found.story.records, before, "{kind}, seed {seed}: only what was written");
        let text = fault.to_string();
        let is_placed = fault.line().is_none_or(|line| {
            matches!(fault, JournalFault::Beginning { .. } | JournalFault::Emptied { .. })
                || text.contains(&format!("line {line}"))
        });
        assert!(is_placed, "{kind}, seed {seed}: {text}");
    }
}

/// Damages of lines: `edit` receives the lines and the index of one of them.
fn check_lines(
    kind: &str,
    kinds: &'static [&'static str],
    edit: impl Fn(&mut Vec<Vec<u8>>, usize, &mut Dice),
) {
    check(kind, |disk, dice| {
        let mut lines = lines(disk);
        let at = dice.roll(lines.len());
        edit(&mut lines, at, dice);
        disk.journal = lines.concat();
        kinds
    });
}

#[test]
fn a_flipped_bit_is_found() {
    let kinds = &["damaged-record", "missing-end"];
    check_lines("flipped bit", kinds, |lines, at, dice| {
        let byte = dice.roll(lines[at].len());
        lines[at][byte] ^= 1 << dice.roll(8);
    });
}

#[test]
fn a_lost_line_is_found() {
    let kinds = &["missing-record", "missing-beginning", "missing-end"];
    check_lines("lost line", kinds, |lines, at, _| drop(lines.remove(at)));
}

#[test]
fn swapped_lines_are_found() {
    let kinds = &["swapped-records", "missing-beginning", "repeated-record"];
    check_lines("swapped lines", kinds, |lines, at, dice| {
        let other = (at + 1 + dice.roll(lines.len() - 1)) % lines.len();
        lines.swap(at, other);
    });
}

#[test]
fn a_doubled_line_is_found() {
    check_lines("doubled line", &["repeated-record"], |lines, at, dice| {
        let line = lines[at].clone();
        lines.insert(at + 1 + dice.roll(lines.len() - at), line);
    });
}

#[test]
fn a_missing_second_half_is_found() {
    check("second half", |disk, dice| {
        let half = disk.journal.len() / 2 + dice.roll(200);
        disk.journal.truncate(half);
        &["missing-end"]
    });
}

#[test]
fn a_missing_first_half_is_found() {
    check_lines("first half", &["missing-beginning", "missing-end"], |lines, at, _| {
        lines.drain(..at.max(1));
    });
}

#[test]
fn a_deleted_end_is_found() {
    check_lines("deleted end", &["missing-end", "empty-journal"], |lines, at, _| {
        lines.truncate(at);
    });
}

#[test]
fn overwritten_bytes_are_found() {
    let kinds = &["damaged-record", "missing-end"];
    check("zeros", |disk, dice| {
        let at = dice.roll(disk.journal.len());
        let to = (at + 1 + dice.roll(600)).min(disk.journal.len());
        disk.journal[at..to].fill(0);
        kinds
    });
}

#[test]
fn a_line_of_another_journal_is_found() {
    let kinds = &["foreign-record", "repeated-record", "missing-record", "foreign-state"];
    check("foreign line", |disk, dice| {
        // The same numbers, but another history.
        let mut other = JournalOnDisk::new();
        other.append(&[put_line(1000)]);
        while lines(&other).len() < lines(disk).len() {
            other.append(&[put_line(dice.roll(1000) as u64)]);
        }
        let mut own = lines(disk);
        let at = 1 + dice.roll(own.len() - 1);
        own[at].clone_from(&lines(&other)[at]);
        disk.journal = own.concat();
        kinds
    });
}

#[test]
fn a_missing_or_empty_journal_is_found() {
    for seed in 0..SEEDS {
        let disk = committed(&mut Dice::new(seed));
        let state = Some(&disk.state_file[..]);
        let fault = |journal| verify_bytes(journal, state).unwrap().fault.unwrap();
        let committed = disk.end.number;
        assert_eq!(fault(None), JournalFault::Missing { committed });
        assert_eq!(fault(Some(b"")), JournalFault::Emptied { committed });
    }
}

#[test]
fn a_missing_or_damaged_state_file_is_found() {
    for seed in 0..SEEDS {
        let mut dice = Dice::new(seed);
        let disk = committed(&mut dice);
        let verify = |state| verify_bytes(Some(&disk.journal), state).unwrap();
        assert_eq!(verify(None).fault, Some(JournalFault::StateMissing));
        let cut = dice.roll(disk.state_file.len());
        let cut = Some(&disk.state_file[..cut]);
        assert_eq!(verify(cut).fault, Some(JournalFault::StateDamaged));
        let mut flipped = disk.state_file.clone();
        flipped[dice.roll(2 * SLOT_LEN)] ^= 1 << dice.roll(8);
        let found = verify(Some(&flipped));
        // In the newest slot the damage looks like an interrupted write; the journal is complete.
        let is_complete = found.fault.is_none() && found.story == disk.verify().story;
        assert!(is_complete || found.fault == Some(JournalFault::StateDamaged), "seed {seed}");
    }
}

#[test]
fn a_state_file_of_another_moment_or_journal_is_found() {
    for seed in 0..SEEDS {
        let mut dice = Dice::new(seed);
        let mut disk = committed(&mut dice);
        let old = disk.state_file.clone();
        for firing in 0..2 + dice.roll(5) as u64 {
            disk.append(&[put_line(500 + firing)]);
            disk.commit();
        }
        let fault = |state| verify_bytes(Some(&disk.journal), Some(state)).unwrap().fault;
        let older = fault(&old);
        assert!(matches!(older, Some(JournalFault::StateOld { .. })), "seed {seed}: {older:?}");
        let mut other = JournalOnDisk::new();
        let length = 1 + dice.roll(disk.end.number as usize);
        (0..length).for_each(|_| other.append(&[put_line(7)]));
        other.commit();
        let foreign = fault(&other.state_file);
        assert!(
            matches!(foreign, Some(JournalFault::StateOfOther { .. })),
            "seed {seed}: {foreign:?}"
        );
    }
}
