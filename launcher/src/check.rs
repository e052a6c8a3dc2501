//! `armor check FILE...`: the whole proof of a file, and all findings at once.

use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_executive::RunError;
use armor_plan::{PLAYED, Plan};
use armor_robotfile::{
    Code, Colours, Configuration, Finding, Findings, NeededPath, Override, Reading, Severity,
    needed_paths, passed_dates,
};

use crate::arguments::{self, Format};
use crate::exit::Ending;
use crate::kinds::Catalogue;
use crate::print;

/// How long a mission is looked at. One that people draw takes milliseconds.
const PROOF_WITHIN: Duration = Duration::from_secs(5);
/// The same where others wait: configd answers nobody meanwhile, and silence is taken for a hang.
const SHORT_PROOF_WITHIN: Duration = Duration::from_millis(500);

/// A file with all that was found.
pub struct Checked {
    reading: Reading,
    /// The kinds it was checked against.
    pub catalogue: Catalogue,
}

/// Prints the findings of each file; fails on errors, and on warnings if it is to be strict.
///
/// # Errors
/// If a stock component is broken, or the current folder is gone.
pub fn run(arguments: &arguments::Check, format: Format) -> Result<Ending> {
    let mut ending = Ending::Fine;
    let mut gravest = None;
    for file in &arguments.files {
        let checked = load(file, &arguments.overrides, &arguments.kinds)?;
        let findings = &checked.reading.findings;
        print(&checked.shown(format), format);
        gravest =
            gravest.into_iter().chain(findings.gravest()).min_by_key(|code: &Code| code.severity());
        let warnings = findings.count(Severity::Warning);
        if checked.accepted().is_none() || (arguments.strict && warnings > 0) {
            ending = Ending::Failed;
        } else if warnings == 0 && format != Format::Json {
            println!("{} is fine", file.display());
        }
        if let Some(takes) = findings.iter().find(|finding| finding.code == Code::Takes)
            && format != Format::Json
        {
            println!("{}: {}", file.display(), takes.message);
        }
    }
    hint(gravest, format);
    Ok(ending)
}

/// Reads the file and checks it against every kind there is.
///
/// # Errors
/// As [`run`]. What is wrong with the file is in the findings.
pub fn load(file: &Path, sets: &[String], kinds: &arguments::Kinds) -> Result<Checked> {
    let folder = std::env::current_dir().context("the current folder is gone")?;
    let mut reading = armor_robotfile::load(file);
    let (overrides, malformed) = overrides(sets, &folder);
    reading.findings.extend(malformed);
    let files = reading.files.clone();
    let catalogue = Catalogue::gather(&kinds.directories, files.iter().map(AsRef::as_ref))?;
    reading.findings.extend(catalogue.findings(reading.configuration.as_ref()));
    let manifests = catalogue.manifests();
    let mut reading = armor_robotfile::check(reading, &overrides, Some(&manifests));
    catalogue.point_to_broken(&mut reading.findings);
    if let Some(configuration) = &reading.configuration {
        configuration.refuse_unplayed(PLAYED, &mut reading.findings);
        let needed = needed_paths(configuration, &manifests);
        let missing = needed.iter().filter(|needed| !needed.path.exists());
        reading.findings.extend(missing.map(NeededPath::missing));
        reading.findings.extend(passed_dates(configuration, armor_executive::utc()));
    }
    // What only the executive can say of a mission, it says of one that is sound otherwise.
    if reading.is_valid()
        && let Some(configuration) = &reading.configuration
    {
        reading.findings.extend_new(proven_within(configuration, PROOF_WITHIN));
    }
    reading.findings.sort();
    Ok(Checked { reading, catalogue })
}

/// What only the executive finds in a mission: that it cannot play it, or what it proves of it.
pub fn of_the_mission(configuration: &Configuration) -> Findings {
    proven_within(configuration, PROOF_WITHIN).without_notes()
}

/// The same in half a second. What is not decided by then the executive decides for itself, from
/// where the mission stands.
pub fn of_the_mission_soon(configuration: &Configuration) -> Findings {
    proven_within(configuration, SHORT_PROOF_WITHIN).without_notes()
}

fn proven_within(configuration: &Configuration, limit: Duration) -> Findings {
    match Plan::of(configuration) {
        Ok(Some(plan)) => {
            let start = Instant::now();
            armor_proof::prove(configuration, &plan, &|| start.elapsed() > limit)
        }
        Ok(None) => Findings::default(),
        Err(findings) => findings,
    }
}

/// Whether this host's clock is good enough for the dates of the mission, if it has some.
///
/// # Errors
/// If it is not known to be.
pub fn clock(configuration: &Configuration) -> Result<()> {
    let plan = Plan::of(configuration).ok().flatten();
    if plan.is_some_and(|plan| plan.has_dates())
        && let Some(doubts) = armor_executive::clock_doubts()
    {
        return Err(RunError::Clock(doubts).into());
    }
    Ok(())
}

/// The `--set` of a command line, and what is wrong with them.
pub fn overrides(sets: &[String], folder: &Path) -> (Vec<Override>, Vec<Finding>) {
    let mut overrides = Vec::new();
    let mut malformed = Vec::new();
    for set in sets {
        match Override::parse(set, folder) {
            Ok(set) => overrides.push(set),
            Err(finding) => malformed.push(*finding),
        }
    }
    (overrides, malformed)
}

impl Checked {
    /// The configuration, if it is free of errors.
    pub fn accepted(&self) -> Option<&Configuration> {
        self.reading.configuration.as_ref().filter(|_| self.reading.is_valid())
    }

    /// The findings as they are printed: how long the mission takes is a line of its own for people.
    fn shown(&self, format: Format) -> Findings {
        let is_shown = |finding: &&Finding| format == Format::Json || finding.code != Code::Takes;
        let mut shown = Findings::default();
        shown.extend(self.reading.findings.iter().filter(is_shown).cloned());
        shown
    }

    /// Prints what is worth stopping at: errors and warnings.
    pub fn print_problems(&self, format: Format) {
        let problems = self.reading.findings.without_notes();
        print(&problems, format);
        hint(problems.gravest(), format);
    }
}

/// Prints findings: for people on stderr, for programs as JSON Lines on stdout.
fn print(findings: &Findings, format: Format) {
    let (mut out, mut err) = (std::io::stdout().lock(), std::io::stderr().lock());
    // Whoever closed the stream does not want to know.
    let _ = if format == Format::Json {
        findings.iter().try_for_each(|finding| writeln!(out, "{}", json(finding)))
    } else {
        let colours = if print::coloured(&err) { Colours::Yes } else { Colours::No };
        write!(err, "{}", findings.render(colours))
    };
}

/// Says once where there is more to read.
fn hint(code: Option<Code>, format: Format) {
    if let Some(code) = code.filter(|_| format != Format::Json) {
        let _ = writeln!(std::io::stderr(), "armor explain {} says more", code.as_str());
    }
}

fn json(finding: &Finding) -> String {
    serde_json::to_string(finding).unwrap_or_else(|error| error.to_string())
}
