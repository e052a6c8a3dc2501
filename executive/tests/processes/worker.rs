//! A component that keeps a diary of when it runs, and the check that reads it.

use armor_sdk::prelude::*;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path as FilePath, PathBuf};
use std::process::ExitCode;

pub fn main(arguments: impl Iterator<Item = OsString>) -> ExitCode {
    armor_sdk::run_with::<Worker>(arguments)
}

/// Done after a few ticks.
struct Worker {
    name: String,
    diary: PathBuf,
    ticks: u32,
}

impl Component for Worker {
    const KIND: &'static str = "worker";
    const SUMMARY: &'static str = "Works for a moment and is done.";
    const PARAMETERS: &'static [Parameter] = &[Parameter::path("diary").doc("where it writes")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Count>("ticks")?;
        let name = armor.provided_data("ticks").unwrap_or_default();
        armor.get_parameter("diary")?;
        armor.synchronize()?;
        let name = name.split('.').next().unwrap_or_default().to_owned();
        Ok(Self { name, diary: PathBuf::new(), ticks: 0 })
    }

    fn parameter_received(&mut self, _: &str, value: &Value) -> Result<(), Fault> {
        self.diary = value.path()?;
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => {
                self.ticks = 0;
                note(&self.diary, &self.name, "starts");
            }
            Call::Stopping => note(&self.diary, &self.name, "stops"),
            Call::Tick | Call::Data => self.ticks += 1,
        }
        Ok(if self.ticks >= 4 { Outcome::Done } else { Outcome::CarryOn })
    }
}

/// Appends a line. Appending keeps the lines of several processes whole and in order.
pub fn note(diary: &FilePath, name: &str, what: &str) {
    let file = OpenOptions::new().append(true).create(true).open(diary);
    let line = format!("{name} {what}\n");
    file.and_then(|mut file| file.write_all(line.as_bytes())).expect("a line in the diary");
}

/// Checks that the two workers never run at the same time; returns how many times they started.
pub fn check(diary: &FilePath) -> usize {
    let text = std::fs::read_to_string(diary).expect("a diary");
    let mut running = BTreeSet::new();
    let mut starts = 0;
    for line in text.lines() {
        let (name, what) = line.split_once(' ').expect("name and deed");
        if what == "starts" {
            starts += 1;
            running.insert(name);
        } else {
            running.remove(name);
        }
        assert!(running.len() < 2, "both run:\n{text}");
    }
    starts
}
