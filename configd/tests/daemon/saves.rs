//! Ways in which files are saved, cut, moved, deleted and linked.

use std::fs;
use std::io::Write;
use std::time::{Duration, Instant};

use armor_configd::Notice;

use crate::bench::*;

#[test]
fn the_last_good_version_outlives_every_fault() {
    let folder = Folder::new("faults");
    let configd = folder.configd();
    let whole = file(2);

    // Caught half-written: the first half is not valid, the whole is.
    let mut open = fs::File::create(folder.file()).unwrap();
    open.write_all(&whole.as_bytes()[..60]).unwrap();
    open.sync_all().unwrap();
    expect_refused(&configd, 1);
    assert_eq!(settings(&configd).version, 1);
    open.write_all(&whole.as_bytes()[60..]).unwrap();
    drop(open);
    expect_taken_in_the_end(&configd, 2);

    folder.save(&file(3).replace("rate=", "rat="));
    expect_refused(&configd, 2);
    assert_eq!(settings(&configd).rate_hz, Some(2.0));

    fs::remove_file(folder.file()).unwrap();
    expect_refused(&configd, 2);
    assert_eq!(settings(&configd).version, 2);
    folder.save(&whole);
    expect_restored(&configd, 2);

    // The dance of an editor that keeps a backup.
    fs::rename(folder.file(), folder.0.join("robot.xml~")).unwrap();
    expect_refused(&configd, 2);
    fs::write(folder.file(), file(4)).unwrap();
    expect_taken_in_the_end(&configd, 3);
    fs::rename(folder.0.join("robot.xml~"), folder.file()).unwrap();
    expect_taken(&configd, 4);
    assert_eq!(settings(&configd).rate_hz, Some(2.0));
}

#[test]
fn a_swapped_link_and_a_replaced_folder_are_noticed() {
    let folder = Folder::new("links");
    fs::write(folder.0.join("two.xml"), file(2)).unwrap();
    fs::rename(folder.file(), folder.0.join("one.xml")).unwrap();
    std::os::unix::fs::symlink("one.xml", folder.file()).unwrap();
    let configd = folder.configd();
    assert_eq!(settings(&configd).rate_hz, Some(1.0));
    std::os::unix::fs::symlink("two.xml", folder.0.join("link")).unwrap();
    fs::rename(folder.0.join("link"), folder.file()).unwrap();
    expect_taken(&configd, 2);
    assert_eq!(settings(&configd).rate_hz, Some(2.0));

    let away = folder.0.with_extension("away");
    let _ = fs::remove_dir_all(&away);
    fs::rename(&folder.0, &away).unwrap();
    expect_refused(&configd, 2);
    fs::create_dir(&folder.0).unwrap();
    fs::write(folder.file(), file(3)).unwrap();
    expect_taken_in_the_end(&configd, 3);
    folder.save(&file(4));
    expect_taken(&configd, 4);
}

/// A way of saving a file in several steps.
type Save = fn(&Folder, &str);

/// Ways in which editors and tools save, each with moments in which the file is not whole.
const SAVES: [(&str, Save); 8] = [
    ("written to another file and renamed", |folder, text| folder.save(text)),
    ("cut and written in pieces", |folder, text| {
        let mut file = fs::File::create(folder.file()).unwrap();
        for piece in text.as_bytes().chunks(40) {
            file.write_all(piece).unwrap();
            file.sync_all().unwrap();
        }
    }),
    ("written twice", |folder, text| {
        fs::write(folder.file(), &text[..text.len() / 2]).unwrap();
        fs::write(folder.file(), text).unwrap();
    }),
    ("moved to a backup and written again", |folder, text| {
        fs::rename(folder.file(), folder.0.join("robot.xml~")).unwrap();
        fs::write(folder.file(), text).unwrap();
    }),
    ("copied to a backup, written, backup removed", |folder, text| {
        fs::copy(folder.file(), folder.0.join("robot.xml.bak")).unwrap();
        fs::write(folder.file(), text).unwrap();
        fs::remove_file(folder.0.join("robot.xml.bak")).unwrap();
    }),
    ("deleted and written again", |folder, text| {
        fs::remove_file(folder.file()).unwrap();
        fs::write(folder.file(), text).unwrap();
    }),
    ("replaced by a hard link", |folder, text| {
        fs::write(folder.0.join("other"), text).unwrap();
        fs::remove_file(folder.file()).unwrap();
        fs::hard_link(folder.0.join("other"), folder.file()).unwrap();
    }),
    ("left as a link to another file", |folder, text| {
        fs::write(folder.0.join("target.xml"), text).unwrap();
        let _ = fs::remove_file(folder.file());
        std::os::unix::fs::symlink("target.xml", folder.file()).unwrap();
    }),
];

#[test]
fn no_step_of_a_save_is_taken_for_the_whole() {
    /// Well within the time that configd allows a save to take. If the machine took longer, the
    /// attempt proves nothing.
    const QUICK: Duration = Duration::from_millis(40);
    /// Most attempts for a style of saving on a machine that is too slow.
    const TRIES: usize = 20;
    let folder = Folder::new("saves");
    let configd = folder.configd();
    let mut version = 1;
    for (style, save) in SAVES {
        let mut tries = 0..TRIES;
        let quick = loop {
            assert!(
                tries.next().is_some(),
                "{style}: a step of it was taken for the whole each time"
            );
            version += 1;
            let start = Instant::now();
            save(&folder, &file(version));
            let was_quick = start.elapsed() < QUICK;
            match notice(&configd) {
                Notice::Taken { version: taken, .. } if taken == u64::from(version) => {
                    break was_quick;
                }
                Notice::Refused { .. } if !was_quick => {
                    expect_taken_in_the_end(&configd, version.into());
                }
                other => panic!("{style}: {other:?}"),
            }
        };
        if !quick {
            println!("{style}: the machine was too slow to show it");
        }
        assert_eq!(settings(&configd).rate_hz, Some(f64::from(version)), "{style}");
    }
}

#[test]
fn a_swapped_link_anywhere_on_the_way_is_noticed() {
    let folder = Folder::new("way");
    for version in [1, 2] {
        let robot = folder.0.join(format!("v{version}/robot"));
        fs::create_dir_all(&robot).unwrap();
        fs::write(robot.join("robot.xml"), file(version)).unwrap();
    }
    std::os::unix::fs::symlink("v1", folder.0.join("current")).unwrap();
    let configd = folder.configd_of(&folder.0.join("current/robot/robot.xml"));
    std::os::unix::fs::symlink("v2", folder.0.join("next")).unwrap();
    fs::rename(folder.0.join("next"), folder.0.join("current")).unwrap();
    expect_taken(&configd, 2);
    // The new target is watched, and the old one no more.
    fs::write(folder.0.join("v1/robot/robot.xml"), file(9)).unwrap();
    fs::write(folder.0.join("v2/robot/robot.xml"), file(3)).unwrap();
    expect_taken(&configd, 3);
    assert_eq!(settings(&configd).rate_hz, Some(3.0));
    // A folder on the way is moved away and another one put there.
    fs::rename(folder.0.join("v2"), folder.0.join("v2-old")).unwrap();
    fs::create_dir_all(folder.0.join("v2/robot")).unwrap();
    fs::write(folder.0.join("v2/robot/robot.xml"), file(4)).unwrap();
    expect_taken_in_the_end(&configd, 4);
}
