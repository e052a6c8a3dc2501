//! An example file, spoiled at random and saved in fifty ways while configd runs over it: each time
//! what is judged wrong is refused, and the last good version stays. `ARMOR_SEED` and
//! `ARMOR_MUTATIONS` choose others and more.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use armor_configd::{BackgroundConfigd, ConfigdOptions, Notice};
use armor_robotfile::{check, read};

use crate::bench::{DEADLINE, Folder};

const EXAMPLE: &str = include_str!("../../../missions/office.xml");

struct Dice(fastrand::Rng);

impl Dice {
    fn throw(&mut self, sides: usize) -> usize {
        self.0.usize(..sides)
    }

    /// The example with one thing in it spoiled.
    fn mutation(&mut self) -> Vec<u8> {
        let text = EXAMPLE.as_bytes();
        let at = self.throw(text.len());
        let to = (at + 1 + self.throw(40)).min(text.len());
        match self.throw(6) {
            0 => text[..at].to_vec(),
            1 => [&text[..at], &text[to..]].concat(),
            2 => [&text[..to], &text[at..]].concat(),
            3 => [&text[..at], &[b"\"<>&=\xff\0/"[self.throw(8)]], &text[at + 1..]].concat(),
            4 => EXAMPLE.replacen("simulator", "explorer", 1 + self.throw(9)).into_bytes(),
            _ => {
                let lines: Vec<_> = EXAMPLE.split_inclusive('\n').collect();
                let gone = self.throw(lines.len());
                let kept = lines.iter().enumerate().filter(|(number, _)| *number != gone);
                kept.map(|(_, line)| *line).collect::<String>().into_bytes()
            }
        }
    }
}

/// Saves in one of ten ways, and does one of five things after it.
fn save(folder: &Folder, style: usize, bytes: &[u8]) {
    let (file, other) = (folder.file(), folder.0.join("robot.xml.other"));
    let in_pieces = |path: &Path, len: usize| {
        let mut file = fs::File::create(path).unwrap();
        bytes.chunks(len).for_each(|piece| file.write_all(piece).unwrap());
    };
    match style % 10 {
        0 => fs::write(&file, bytes).unwrap(),
        1 => in_pieces(&file, 512),
        2 => {
            fs::write(&other, bytes).unwrap();
            fs::rename(&other, &file).unwrap();
        }
        3 => {
            fs::rename(&file, folder.0.join("robot.xml~")).unwrap();
            in_pieces(&file, 4096);
        }
        4 => {
            fs::copy(&file, folder.0.join("robot.xml~")).unwrap();
            in_pieces(&file, 1024);
            fs::remove_file(folder.0.join("robot.xml~")).unwrap();
        }
        5 => {
            fs::remove_file(&file).unwrap();
            fs::write(&file, bytes).unwrap();
        }
        6 => {
            let _ = fs::remove_file(&other);
            in_pieces(&other, 2048);
            fs::remove_file(&file).unwrap();
            fs::hard_link(&other, &file).unwrap();
        }
        7 => {
            let target = format!("target-{}.xml", style % 3);
            fs::write(folder.0.join(&target), bytes).unwrap();
            let _ = fs::remove_file(&other);
            std::os::unix::fs::symlink(target, &other).unwrap();
            fs::rename(&other, &file).unwrap();
        }
        8 => {
            let open = fs::OpenOptions::new().write(true).open(&file).unwrap();
            open.set_len(bytes.len() as u64).unwrap();
            (&open).write_all(bytes).unwrap();
            open.sync_all().unwrap();
        }
        _ => {
            in_pieces(&file, 300);
            fs::write(&file, bytes).unwrap();
        }
    }
    match style / 10 % 5 {
        0 => {}
        1 => fs::File::open(&folder.0).unwrap().sync_all().unwrap(),
        2 => {
            let mut permissions = fs::metadata(&file).unwrap().permissions();
            std::os::unix::fs::PermissionsExt::set_mode(&mut permissions, 0o644);
            fs::set_permissions(&file, permissions).unwrap();
        }
        3 => fs::write(folder.0.join(".robot.xml.swp"), bytes).unwrap(),
        _ => drop(fs::read(&file).unwrap()),
    }
}

fn is_valid(folder: &Folder, bytes: &[u8]) -> bool {
    let reading = read(&folder.file(), &mut |_| Ok(bytes.to_vec()));
    check(reading, &[], None).is_valid()
}

/// The version that is in force once `wanted` is seen, and when that was reported.
fn settled(configd: &BackgroundConfigd, version: &mut u64, wanted: bool) -> Instant {
    loop {
        match configd.notices().recv_timeout(DEADLINE).unwrap() {
            Notice::Taken { version: taken, .. } => {
                assert_eq!(taken, *version + 1);
                *version = taken;
                if wanted {
                    return Instant::now();
                }
            }
            Notice::Restored { version: kept } => {
                assert_eq!(kept, *version);
                if wanted {
                    return Instant::now();
                }
            }
            Notice::Refused { kept, findings } => {
                assert!(kept == Some(*version) && findings.has_errors());
                if !wanted {
                    return Instant::now();
                }
            }
            Notice::Outdated { .. } => panic!("no kind has changed"),
            Notice::State(_) | Notice::Readers(_) | Notice::Ready { .. } => {}
        }
    }
}

fn number(variable: &str, usual: u64) -> u64 {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[test]
fn spoiled_files_are_refused_however_they_are_saved() {
    let (seed, rounds) = (number("ARMOR_SEED", 7), number("ARMOR_MUTATIONS", 20));
    println!("ARMOR_SEED={seed} ARMOR_MUTATIONS={rounds}");
    let folder = Folder::new("mutations");
    fs::write(folder.file(), EXAMPLE).unwrap();
    let configd = BackgroundConfigd::start(ConfigdOptions::new(folder.file())).unwrap();
    let mut version = 0;
    settled(&configd, &mut version, true);
    let mut dice = Dice(fastrand::Rng::with_seed(seed));
    let (mut refused, mut took) = (0, Vec::<Duration>::new());
    for round in 0..usize::try_from(rounds).unwrap() {
        let bytes = dice.mutation();
        if bytes == EXAMPLE.as_bytes() {
            continue;
        }
        let valid = is_valid(&folder, &bytes);
        save(&folder, round, &bytes);
        let saved = Instant::now();
        let reported = settled(&configd, &mut version, valid);
        took.push(reported - saved);
        refused += u64::from(!valid);
        save(&folder, round / 10, EXAMPLE.as_bytes());
        settled(&configd, &mut version, true);
    }
    took.sort_unstable();
    println!(
        "{refused} of {} refused; reported after {:?} (half of them), {:?} (longest)",
        took.len(),
        took[took.len() / 2],
        took[took.len() - 1]
    );
    assert!(refused > 0);
}
