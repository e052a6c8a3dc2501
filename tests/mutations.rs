//! A file that is saved while its system runs: seeded changes of the example mission, saved in
//! fifty styles. Whatever the file contains, the last good version stays in force, every fault is
//! published, and no process is restarted.

mod change;
mod observer;
mod save;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use armor_wire::config::{ConfigurationState, ListedParameter};

use crate::dice::{Dice, seed};
use crate::fixture::{Folder, Run, wait_for};
use change::{Changed, Fate, Sign, change};
use observer::Observer;
use save::{Place, STYLES};

/// Saves under `CI` and `ARMOR_FULL`.
const MANY: usize = 1000;
/// Saves otherwise: each style twice.
const SOME: usize = 104;
/// Far more than the intended half second, because the machine may be busy.
const DEADLINE: Duration = Duration::from_secs(60);
/// After every this many saves all parameters are compared, not only the version.
const COMPARE_EVERY: usize = 5;

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions")
}

/// The office mission as an endless patrol: the robot comes home and explores again.
fn patrol() -> String {
    let text = std::fs::read_to_string(examples().join("office.xml")).expect("the example");
    let text = text
        .replace("from=\"return\" to=\"home\"", "from=\"return\" to=\"explore\"")
        .replace("to=\"return\" timeout=\"150s\"", "to=\"home\" timeout=\"3600s\"")
        .replace("to=\"hold\" timeout=\"60s\"", "to=\"hold\" timeout=\"3600s\"");
    assert!(text.contains("to=\"home\" timeout=\"3600s\"") && text.contains("to=\"hold\" timeout"));
    text
}

/// The same patrol in two files: the mission file and the system file.
fn patrol_in_two() -> [(&'static str, String); 2] {
    let text = patrol();
    let (head, rest) = text.split_once("  <system ").expect("a system");
    let (system, mission) = rest.split_once("</system>\n").expect("its end");
    let mission = mission.replacen("<mission ", "<mission system=\"robot.xml\" ", 1);
    let system = format!("{head}  <system {system}</system>\n</armor>\n");
    [("mission.xml", format!("{head}{mission}")), ("robot.xml", system)]
}

// Slow under `CI` and `ARMOR_FULL` (about a minute): 500 saves, each followed until its report.
#[test]
fn one_file_survives_a_thousand_different_changes() {
    let files = [("office.xml", patrol())];
    Trial::start("mutations", &files).run(0..share(2));
}

// Slow under `CI` and `ARMOR_FULL` (about a minute): 500 saves, each followed until its report.
#[test]
fn a_mission_and_its_system_file_survive_a_thousand_different_changes() {
    let files = patrol_in_two();
    Trial::start("mutations-two", &files).run(share(2)..share(1));
}

/// Returns the number of all saves divided by `parts`.
fn share(parts: usize) -> usize {
    let full = ["CI", "ARMOR_FULL"].iter().any(|name| std::env::var_os(name).is_some());
    (if full { MANY } else { SOME }) / parts
}

/// A running system, and its files with their original text.
struct Trial {
    files: Vec<(PathBuf, String)>,
    elsewhere: PathBuf,
    observer: Observer,
    /// The version in force.
    version: u64,
    parameters: Vec<ListedParameter>,
    reports: Vec<(Duration, &'static str)>,
    run: Run,
    // The last field, because fields are dropped in order: the run must end before its folder goes.
    _folder: Folder,
}

impl Trial {
    fn start(name: &str, files: &[(&str, String)]) -> Self {
        let folder = Folder::new(name);
        let worlds = folder.path().join("worlds");
        std::fs::create_dir(&worlds).expect("writable");
        std::fs::copy(examples().join("worlds/office.svg"), worlds.join("office.svg"))
            .expect("the world");
        let elsewhere = folder.path().join("elsewhere");
        std::fs::create_dir(&elsewhere).expect("writable");
        // Some styles make the file a link into this folder; relative paths must resolve there,
        // too.
        std::os::unix::fs::symlink(&worlds, elsewhere.join("worlds")).expect("a link");
        let files: Vec<_> =
            files.iter().map(|(name, text)| (folder.write(name, text), text.clone())).collect();
        let run = folder.run("out", &[files[0].0.to_str().expect("UTF-8"), "--headless"]);
        let observer = Observer::of(&run);
        let first = wait_for("the first state", || observer.state(Duration::ZERO));
        assert_eq!((first.1.version, first.1.refused), (1, false), "{first:?}");
        let (version, _, parameters) = observer.parameters();
        assert!(parameters.len() > 20, "{parameters:?}");
        let reports = Vec::new();
        Self { files, elsewhere, observer, version, parameters, reports, run, _folder: folder }
    }

    fn run(mut self, saves: std::ops::Range<usize>) {
        let seed = seed(1);
        let mut dice = Dice::of(seed);
        let before =
            wait_for("every process", || Some(self.processes()).filter(|all| self.all(all)));
        let count = saves.len();
        for n in saves {
            let (style, save) = STYLES[n % STYLES.len()];
            let chosen = dice.throw(self.files.len());
            // A save of the bytes that are on the disk already is no change: configd reports
            // nothing.
            let changed = loop {
                let changed = change(&self.files[chosen].1, n, &mut dice);
                if std::fs::read(&self.files[chosen].0).ok().as_ref() != Some(&changed.bytes) {
                    break changed;
                }
            };
            let what = format!("save {n} of seed {seed}: {}, {style}", changed.what);
            // An earlier save may have left the other file broken.
            for other in (0..self.files.len()).filter(|other| *other != chosen) {
                self.restore(other, &what);
            }
            let (path, elsewhere) = (self.files[chosen].0.clone(), self.elsewhere.clone());
            save(&Place { path, elsewhere, n }, &changed.bytes)
                .unwrap_or_else(|error| panic!("{what}: {error}"));
            self.reported(&changed, Instant::now(), style, &what);
            self.in_force(&changed.fate, n, &what);
        }
        assert_eq!(before, self.processes(), "a process was restarted\n{}", self.run.log());
        self.print(count);
    }

    /// Restores the original text of a file, if the file differs.
    fn restore(&mut self, at: usize, what: &str) {
        let (path, text) = &self.files[at];
        if std::fs::read_to_string(path).is_ok_and(|now| now == *text) {
            return;
        }
        let (_, was_refused, _) = self.observer.parameters();
        let new = path.with_extension("restored");
        std::fs::write(&new, text).and_then(|()| std::fs::rename(&new, path)).expect("writable");
        // All files have their original text, so they are valid: configd publishes that the version
        // in force is no longer refused, or that a new version is in force.
        let deadline = Instant::now() + DEADLINE;
        let left = || deadline.saturating_duration_since(Instant::now());
        while let Some((_, state)) = self.observer.state(left()) {
            if !state.refused && (was_refused || state.version > self.version) {
                self.version = state.version;
                break;
            }
        }
        let (version, refused, parameters) = self.observer.parameters();
        assert_eq!((version, refused), (self.version, false), "before {what}");
        self.parameters = parameters;
    }

    /// Waits for the expected report of a save that ended at `saved`.
    fn reported(&mut self, changed: &Changed, saved: Instant, style: &'static str, what: &str) {
        let mut last = None;
        while let Some((at, state)) = self.observer.state(DEADLINE.saturating_sub(saved.elapsed()))
        {
            if fulfils(&state, &changed.fate, self.version) {
                self.version = state.version;
                // A report may come before the save returns; that counts as zero.
                self.reports.push((at.saturating_duration_since(saved), style));
                return;
            }
            last = Some(state);
        }
        let text = String::from_utf8_lossy(&changed.bytes);
        let text: String = text.chars().take(8000).collect();
        panic!("{what}: not {:?}, but {last:#?}\n{text}\n{}", changed.fate, self.run.log());
    }

    /// Checks that configd answers with the version that must be in force.
    fn in_force(&mut self, fate: &Fate, n: usize, what: &str) {
        let taken = matches!(fate, Fate::Taken);
        if !taken && !n.is_multiple_of(COMPARE_EVERY) {
            return;
        }
        let (version, refused, parameters) = self.observer.parameters();
        assert_eq!((version, refused), (self.version, !taken), "{what}");
        if taken {
            self.parameters = parameters;
        } else {
            assert_eq!(self.parameters, parameters, "{what}");
        }
    }

    /// Whether the daemons and every component that has parameters are registered.
    fn all(&self, processes: &[(String, u32)]) -> bool {
        let there = |name: &str| processes.iter().any(|(other, _)| other == name);
        let mut components = self.parameters.iter().map(|parameter| parameter.component.as_str());
        ["configd", "executive"].into_iter().all(there) && components.all(there)
    }

    /// Every registered process.
    fn processes(&self) -> Vec<(String, u32)> {
        let mut all = self.observer.processes();
        all.sort();
        all
    }

    fn print(mut self, count: usize) {
        self.reports.sort();
        let at = |share: f64| self.reports[((self.reports.len() - 1) as f64 * share) as usize];
        let ms = |(time, _): (Duration, &str)| time.as_secs_f64() * 1e3;
        println!(
            "{count} saves in {} styles, from the end of a save until it is reported: \
             p50 {:.0} ms, p99 {:.0} ms, max {:.0} ms ({})",
            STYLES.len(),
            ms(at(0.5)),
            ms(at(0.99)),
            ms(at(1.0)),
            at(1.0).1
        );
    }
}

fn fulfils(state: &ConfigurationState, fate: &Fate, version: u64) -> bool {
    match fate {
        Fate::Taken => state.version > version && !state.refused,
        Fate::Refused { code, sign } => {
            state.version == version
                && state.refused
                && state.findings.iter().any(|finding| {
                    finding.code == *code
                        && match sign {
                            Sign::Line(line) => usize::try_from(finding.line) == Ok(*line),
                            Sign::Word(word) => finding.message.contains(word.as_str()),
                        }
                })
        }
    }
}
