//! Runs a mutant in the simulator: whether its mission reaches its goal, which components are
//! activated, which links deliver.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use armor_inspect::{Looks, ObservedSystem, combine_links};
use armor_robotfile::Span;
use serde_json::Value;

use crate::example::Example;

/// Longest time of a run. The slowest example takes half of it.
const RUN_WITHIN: Duration = Duration::from_secs(100);
/// Time between two looks at the links of a run.
const LOOK_EVERY: Duration = Duration::from_millis(400);
/// How much faster than real time the examples are run that have no `<clock>`.
const SPEED: &str = "5";
/// The rate that a simulator needs for that.
const RATE: &str = "100Hz";

/// What a run has shown.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// How it ended, in words.
    pub ending: String,
    /// Whether the mission reached its goal.
    pub reached_goal: bool,
    /// The components that the mission activated.
    pub activated: BTreeSet<String>,
    /// All links, each with whether it delivered anything.
    pub links: BTreeMap<String, bool>,
}

/// Runs systems, each in a folder of its own.
pub struct TrialGround {
    /// The program `armor`.
    pub armor: PathBuf,
    /// The folder of the examples.
    pub missions: PathBuf,
    /// The folder in which the runs write.
    pub scratch: PathBuf,
}

impl TrialGround {
    /// Runs `text` as the example of that name; the registry listens on `port`.
    ///
    /// # Errors
    /// If the files cannot be written or the program cannot be started.
    pub fn run_text(&self, example: &Example, text: &str, port: u16) -> Result<Outcome> {
        let folder = self.scratch.join(format!("run-{port}"));
        if folder.exists() {
            fs::remove_dir_all(&folder)?;
        }
        fs::create_dir_all(&folder)?;
        self.write_files(example, text, &folder)?;
        let registry = format!("127.0.0.1:{port}");
        let child = Command::new(&self.armor)
            .arg("run")
            .arg(folder.join(example.file_name()))
            .args(["--headless", "--quiet", "--format", "json", "--trust-clock"])
            .args(["--registry", &registry, "--out"])
            .arg(folder.join("out"))
            .stdin(Stdio::null())
            .stdout(fs::File::create(folder.join("stdout"))?)
            .stderr(fs::File::create(folder.join("stderr"))?)
            .spawn()
            .with_context(|| self.armor.display().to_string())?;
        let mut run = StartedRun(child);
        let mut outcome = Outcome::default();
        let start = Instant::now();
        let system = ObservedSystem::at(&registry, "mutants");
        let ended = loop {
            if run.0.try_wait()?.is_some() {
                break true;
            }
            if start.elapsed() > RUN_WITHIN {
                break false;
            }
            look_at_links(&system, &mut outcome);
            thread::sleep(LOOK_EVERY);
        };
        drop(run);
        outcome.ending = if ended {
            read_ending(&fs::read_to_string(folder.join("stdout"))?)
        } else {
            format!("it did not end within {} s", RUN_WITHIN.as_secs())
        };
        self.read_journal(&folder.join("out/executive.journal"), &mut outcome)?;
        Ok(outcome)
    }

    /// Writes the mutant, the files that it may name, and a link to the worlds.
    fn write_files(&self, example: &Example, text: &str, folder: &Path) -> Result<()> {
        for entry in fs::read_dir(&self.missions)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default();
            if path.is_dir() {
                symlink(path.canonicalize()?, folder.join(name))?;
            } else if path.extension().is_some_and(|it| it == "xml") {
                let is_mutant = name == example.file_name();
                let original = fs::read_to_string(&path)?;
                // The system that is mutated keeps its clock, or the lack of one.
                let has_clock = original.contains("<clock ");
                let text = if is_mutant { text.to_owned() } else { original };
                let text = if has_clock { text } else { quicken(&path, text)? };
                fs::write(folder.join(name), text)?;
            }
        }
        Ok(())
    }

    /// Reads which components the mission activated, and whether it reached its goal.
    fn read_journal(&self, journal: &Path, outcome: &mut Outcome) -> Result<()> {
        if !journal.exists() {
            return Ok(());
        }
        let printed = Command::new(&self.armor)
            .args(["mission", "journal", "--format", "json", "--journal"])
            .arg(journal)
            .output()?;
        if !printed.status.success() {
            bail!("{}: {}", journal.display(), String::from_utf8_lossy(&printed.stderr));
        }
        for line in String::from_utf8_lossy(&printed.stdout).lines() {
            let record = &serde_json::from_str::<Value>(line)?["record"];
            match (record["entry"].as_str(), record["component"].as_str()) {
                (Some("activating"), Some(component)) => {
                    outcome.activated.insert(component.to_owned());
                }
                (Some("ended"), _) => outcome.reached_goal = record["outcome"] == "goal",
                _ => {}
            }
        }
        Ok(())
    }
}

/// A run that ends with this value, with all its processes.
struct StartedRun(Child);

impl Drop for StartedRun {
    fn drop(&mut self) {
        // The kernel ends the processes that the launcher started.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn look_at_links(system: &ObservedSystem, outcome: &mut Outcome) {
    // At the start and at the end of a run there is no registry.
    let Ok(sightings) = system.ask_statuses() else { return };
    let statuses: Vec<_> = sightings.into_iter().filter_map(|it| it.status.ok()).collect();
    let looks: Vec<_> = statuses.iter().map(|now| Looks { before: None, now }).collect();
    for link in combine_links(&looks) {
        // What has no dot is a tool or the executive, not an input.
        if link.to.contains('.') {
            *outcome.links.entry(format!("{} -> {}", link.from, link.to)).or_default() |=
                link.received > 0;
        }
    }
}

fn read_ending(stdout: &str) -> String {
    let last = stdout.lines().rev().find_map(|line| {
        let event = serde_json::from_str::<Value>(line).ok()?;
        (event["event"] == "end").then(|| event["how"].as_str().unwrap_or_default().to_owned())
    });
    last.unwrap_or_else(|| "it did not start".into())
}

/// The same system in simulated time, faster than real time, so that it behaves the same and takes
/// less long. A file without a system or a simulator stays as it is.
fn quicken(path: &Path, text: String) -> Result<String> {
    let example = Example::parse(path, text)?;
    let system = example.elements.iter().find(|it| it.name == "system");
    let value_of = |element: &crate::example::KnownElement, name: &str| {
        element.attributes.iter().find(|it| it.name == name).map(|it| it.value.clone())
    };
    let simulator = example
        .elements
        .iter()
        .find(|it| it.name == "component" && value_of(it, "kind").as_deref() == Some("simulator"));
    let (Some(system), Some(simulator)) = (system, simulator) else { return Ok(example.text) };
    let name = value_of(simulator, "name").unwrap_or_default();
    let mut text = example.text.clone();
    let mut put = |at: usize, new: &str| text.insert_str(at, new);
    // From the end, so that the spans before stay true.
    let parameter = format!("<parameter name=\"speed\" value=\"{SPEED}\"/>");
    put(simulator.tag_span.end(), &parameter);
    match simulator.attributes.iter().find(|it| it.name == "rate") {
        Some(rate) => text.replace_range(range_of(rate.value_span), RATE),
        None => put(simulator.tag_span.end() - 1, &format!(" rate=\"{RATE}\"")),
    }
    text.insert_str(system.tag_span.end(), &format!("<clock source=\"{name}.clock\"/>"));
    Ok(text)
}

fn range_of(span: Span) -> std::ops::Range<usize> {
    span.start()..span.end()
}
