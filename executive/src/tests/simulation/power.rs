//! Power failures while the journal and its state file are written: between any two writes, and in
//! the middle of each. What the executive has not committed it has not acted on.

use super::Play;
use super::dice::Dice;
use crate::event::ControllerAction;
use crate::journal::tests::{JournalOnDisk, SLOT_LEN};
use crate::record::JournalRecord;

/// The files of a simulated mission, and the failures that are still to come.
pub(super) struct PowerFailures {
    disk: JournalOnDisk,
    dice: Dice,
    /// Records that are not on the disk yet.
    batch: Vec<JournalRecord>,
    left: usize,
    /// How many failures left nothing of a batch, a part of it, all of it without its commit, and
    /// all of it with a part of its commit.
    pub(super) met: [usize; 4],
}

impl PowerFailures {
    fn new(seed: u64) -> Self {
        let dice = Dice::new(seed ^ 0x0070_6f77_6572);
        Self { disk: JournalOnDisk::new(), dice, batch: Vec::new(), left: 12, met: [0; 4] }
    }

    fn lines(&self) -> Vec<String> {
        self.batch.iter().map(|record| serde_json::to_string(record).unwrap()).collect()
    }

    /// Writes the batch, or as much of it as the power lasts for. Returns whether it will be read
    /// back, and whether the power has failed.
    fn write(&mut self) -> (bool, bool) {
        let lines = self.lines();
        let fails = self.left > 0 && self.dice.one_in(20);
        if !fails {
            self.disk.append(&lines);
            self.disk.commit();
            return (true, false);
        }
        self.left -= 1;
        let kind = self.dice.roll(4);
        self.met[kind] += 1;
        match kind {
            0 => {}
            1 => {
                let bytes = self.disk.encode(&lines).0;
                let len = 1 + self.dice.roll(bytes.len() - 1);
                self.disk.journal.extend_from_slice(&bytes[..len]);
            }
            2 => self.disk.append(&lines),
            _ => {
                self.disk.append(&lines);
                let part = [1 + self.dice.roll(150), SLOT_LEN - 1, SLOT_LEN];
                self.disk.commit_up_to(part[self.dice.roll(3)]);
            }
        }
        (kind > 1, true)
    }
}

impl Play {
    /// Keeps a record until its batch is written. Returns any other action.
    pub(super) fn add_to_batch(&mut self, action: ControllerAction) -> Option<ControllerAction> {
        match (&mut self.power, action) {
            (Some(power), ControllerAction::Journal(record)) => {
                power.batch.push(record);
                None
            }
            (Some(_), ControllerAction::Publish) => None,
            (_, action) => Some(action),
        }
    }

    /// Writes the batch. Returns false if the power has failed.
    pub(super) fn write_batch(&mut self) -> bool {
        let Some(power) = self.power.as_mut().filter(|power| !power.batch.is_empty()) else {
            return true;
        };
        let (is_kept, failed) = power.write();
        for record in std::mem::take(&mut power.batch) {
            if is_kept {
                self.check_pause(&ControllerAction::Journal(record.clone()));
                self.write(&record);
            }
        }
        if failed {
            self.crash();
        }
        !failed
    }

    /// Opens the journal as a restarted executive does: it holds every decision once.
    pub(super) fn reopen_journal(&mut self) {
        if let Some(power) = &mut self.power {
            power.batch.clear();
            let story = power.disk.reopen();
            assert_eq!(story.records, self.records());
        }
    }

    /// Cuts the journal on the disk; the power may fail before the commit.
    pub(super) fn cut_on_disk(&mut self) {
        let lines = self.journal.clone();
        let Some(power) = &mut self.power else {
            return;
        };
        let life = r#"{"life":{"boot":"b","zero_ns":0}}"#.to_owned();
        power.disk.cut(&[vec![life], lines].concat());
        let fails = power.left > 0 && power.dice.one_in(4);
        if fails {
            power.left -= 1;
            self.crash();
        } else {
            power.disk.commit();
        }
    }
}

#[test]
fn a_mission_continues_wherever_the_power_fails() {
    let (mut met, mut firings) = ([0; 4], 0);
    for seed in 0..300 {
        let played = std::panic::catch_unwind(|| {
            let mut play = Play::new(seed);
            play.power = Some(PowerFailures::new(seed));
            play.run();
            let firings = play.written.iter().filter(|line| line.contains("\"took\"")).count();
            (play.power.map(|power| power.met), firings)
        });
        let Ok((Some(some), took)) = played else {
            panic!("seed {seed} fails");
        };
        met.iter_mut().zip(some).for_each(|(sum, one)| *sum += one);
        firings += took;
    }
    println!("{met:?} power failures, {firings} firings");
    assert!(met.iter().all(|count| *count > 50) && firings > 400, "{met:?}, {firings}");
}
