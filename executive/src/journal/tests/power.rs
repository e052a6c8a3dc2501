//! Power failures at every boundary between writes, and at every byte of a write.

use super::*;

/// A journal of batches of one to three records; the last of them are returned unwritten.
fn batches() -> Vec<Vec<String>> {
    let mut firing = 0;
    let mut batches = vec![vec![life_line(), put_line(0)]];
    for size in [1, 2, 1, 3, 1, 2] {
        let batch = (0..size).map(|_| {
            firing += 1;
            put_line(firing)
        });
        batches.push(batch.collect());
    }
    batches
}

#[test]
fn a_batch_is_read_as_a_whole_or_not_at_all_wherever_the_power_fails() {
    let mut disk = JournalOnDisk::new();
    let mut before = disk.reopen();
    for batch in batches() {
        let (bytes, _) = disk.encode(&batch);
        // While the batch is written.
        for len in 0..bytes.len() {
            let mut failed = disk.clone();
            failed.journal.extend_from_slice(&bytes[..len]);
            let found = failed.verify();
            assert_eq!(found.torn_len, len as u64);
            assert_eq!(failed.reopen(), before, "{len} bytes were written");
            // Pages that never reached the disk are zeros.
            let mut failed = disk.clone();
            failed.journal.extend(bytes[..len].iter().copied().chain(vec![0; bytes.len() - len]));
            assert_eq!(failed.reopen(), before, "{len} bytes were written, the others are zeros");
            failed.append(&batch);
            failed.commit();
            assert_eq!(failed.verify().fault, None);
        }
        // Between the two files, and while the state file is written.
        disk.append(&batch);
        let after = disk.verify().story;
        assert_ne!(after, before);
        for len in (0..200).chain([SLOT_LEN - 1]) {
            let mut failed = disk.clone();
            failed.commit_up_to(len);
            assert_eq!(failed.reopen(), after, "{len} bytes of the state file were written");
            assert_eq!(failed.verify().committed, Some(disk.end.number));
        }
        disk.commit();
        before = disk.reopen();
        assert_eq!(before, after);
    }
}

#[test]
fn a_cut_journal_is_read_whether_its_state_file_was_written_or_not() {
    let mut disk = JournalOnDisk::new();
    for batch in batches() {
        disk.append(&batch);
        disk.commit();
    }
    let snapshot = snapshot();
    disk.cut(&[life_line(), serde_json::to_string(&snapshot).unwrap()]);
    let story = disk.clone().reopen();
    assert_eq!(story.records, [snapshot]);
    assert_eq!(disk.verify().first, 13);
    disk.commit();
    disk.append(&[put_line(99)]);
    disk.commit();
    assert_eq!(disk.verify().fault, None);
    // Without its snapshot it is not complete.
    let second = disk.journal.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    disk.journal.drain(..second);
    assert_eq!(disk.verify().fault, Some(JournalFault::Beginning { record: 14 }));
}
