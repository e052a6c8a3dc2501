//! `armor check FILE...`: proves a file, and prints all findings.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_executive::RunError;
use armor_plan::Plan;
use armor_proof::{Recheck, prove, prove_without_notes};
use armor_robotfile::{
    Code, Colours, Configuration, Finding, Findings, MAX_FILE_BYTES, MissionDuration, NeededPath,
    Override, Reading, Severity, needed_paths, passed_dates,
};
use clap::Args;

use crate::arguments::{KindFolders, OutputFormat};
use crate::exit::CommandEnding;
use crate::kinds::Catalogue;
use crate::print;
use crate::print::{end_printing, print_wrapped};
use crate::verb::Verb;

/// Longest time to prove a mission in which a parameter is changed. One that is drawn by hand takes
/// milliseconds. `armor check` has no such limit: it counts states, so that a file has the same
/// findings on every host.
const PROOF_WITHIN: Duration = Duration::from_secs(5);
/// The same as [`PROOF_WITHIN`] in configd, which answers no request during the proof: a longer silence would count as
/// a hang.
const SHORT_PROOF_WITHIN: Duration = Duration::from_millis(500);

/// The name of stdin in findings.
const STDIN_NAME: &str = "<stdin>";

/// A file with its findings.
pub struct CheckedFile {
    reading: Reading,
    /// The kinds it was checked against.
    pub catalogue: Catalogue,
}

/// Stands for stdin where a file is expected.
pub const STDIN: &str = "-";

/// Check files and print all findings.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor check robot.xml
  armor check --strict missions/*.xml    fail on warnings too
  generate-robot | armor check -         from a pipe")]
pub struct CheckArguments {
    /// The system and mission files; - is stdin, as if it were a file in this folder.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Fail on warnings too.
    #[arg(long)]
    pub strict: bool,
    /// Override the value of a parameter.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    #[command(flatten)]
    pub kinds: KindFolders,
}

impl Verb for CheckArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(check_files(&self, format)?.into())
    }
}

/// Prints the findings of each file; fails on errors, and on warnings if it is to be strict.
///
/// # Errors
/// If a stock component is broken, or the current folder is gone.
fn check_files(arguments: &CheckArguments, format: OutputFormat) -> Result<CommandEnding> {
    let mut ending = CommandEnding::Fine;
    let mut gravest = None;
    for file in &arguments.files {
        let is_stdin = file.as_os_str() == STDIN;
        let name = if is_stdin { Path::new(STDIN_NAME) } else { file };
        let reading = if is_stdin {
            read_stdin(std::io::stdin().lock())
        } else {
            armor_robotfile::load(file)
        };
        let checked = check_reading(reading, &arguments.overrides, &arguments.kinds)?;
        let findings = &checked.reading.findings;
        print_findings(&checked.shown(format), format);
        gravest =
            gravest.into_iter().chain(findings.gravest()).min_by_key(|code: &Code| code.severity());
        let warnings = findings.count(Severity::Warning);
        if checked.accepted().is_none() || (arguments.strict && warnings > 0) {
            ending = CommandEnding::Failed;
        } else if warnings == 0 && format != OutputFormat::Json {
            end_printing(print_wrapped(format_args!("{} is fine", name.display())))?;
        }
        if let Some(takes) = findings.iter().find(|finding| finding.code == Code::Takes)
            && format != OutputFormat::Json
        {
            end_printing(print_wrapped(format_args!("{}: {}", name.display(), takes.message)))?;
        }
    }
    print_hint(gravest, format);
    Ok(ending)
}

/// Reads the file and checks it against every kind there is.
///
/// # Errors
/// If the current folder is gone, or the kinds cannot be read. Faults of the file are findings.
pub fn load_file(file: &Path, sets: &[String], kinds: &KindFolders) -> Result<CheckedFile> {
    check_reading(armor_robotfile::load(file), sets, kinds)
}

/// Checks what was read against every kind there is.
///
/// # Errors
/// If the current folder is gone, or the kinds cannot be read.
pub fn check_reading(
    mut reading: Reading,
    sets: &[String],
    kinds: &KindFolders,
) -> Result<CheckedFile> {
    let folder = std::env::current_dir().context("the current folder is gone")?;
    let (overrides, malformed) = parse_overrides(sets, &folder);
    reading.findings.extend(malformed);
    let files = reading.files.clone();
    let catalogue = Catalogue::gather(&kinds.directories, files.iter().map(AsRef::as_ref))?;
    reading.findings.extend(catalogue.findings(reading.configuration.as_ref()));
    let manifests = catalogue.manifests();
    let mut reading = armor_robotfile::check(reading, &overrides, Some(&manifests));
    catalogue.point_to_broken(&mut reading.findings);
    if let Some(configuration) = &reading.configuration {
        let needed = needed_paths(configuration, &manifests);
        reading.findings.extend(needed.iter().filter_map(NeededPath::find_fault));
        reading.findings.extend(passed_dates(configuration, armor_executive::utc()));
    }
    if reading.is_valid()
        && let Some(configuration) = &reading.configuration
    {
        // Times that are wrong on straight lines are so over the grid, and are there already.
        let found = armor_ground::check_ground(configuration);
        reading.findings.extend_new(found);
    }
    // The executive proves only missions that are valid otherwise.
    if reading.is_valid()
        && let Some(configuration) = &reading.configuration
    {
        let proven = plan_and(configuration, |plan| prove(configuration, plan, &|| false));
        reading.findings.extend_proven(proven, configuration);
    }
    let recheck =
        Recheck { overrides: &overrides, manifests: Some(&manifests), is_cancelled: &|| false };
    armor_proof::explain_by_edit(&mut reading, &recheck);
    reading.findings.sort();
    Ok(CheckedFile { reading, catalogue })
}

/// Reads a file that a pipe brings. Files that it names are read relative to the current folder.
fn read_stdin(stdin: impl Read) -> Reading {
    let mut bytes = Vec::new();
    let limit = MAX_FILE_BYTES as u64 + 1;
    let mut taken = Some(stdin.take(limit).read_to_end(&mut bytes).map(|_| bytes));
    armor_robotfile::read(Path::new(STDIN_NAME), &mut |path| match taken.take() {
        Some(bytes) => bytes,
        None => armor_robotfile::read_bytes(path),
    })
}

/// Returns what only the executive finds in a mission: that it cannot play it, or results of the
/// proof.
pub fn of_the_mission(configuration: &Configuration) -> Findings {
    let mut found = armor_ground::check_ground(configuration);
    if !found.has_errors() {
        found.extend(proven_within(configuration, PROOF_WITHIN));
    }
    found.without_notes()
}

/// The same within half a second. The executive itself proves the rest, from the current marking.
pub fn of_the_mission_soon(configuration: &Configuration) -> Findings {
    proven_within(configuration, SHORT_PROOF_WITHIN).without_notes()
}

fn proven_within(configuration: &Configuration, limit: Duration) -> Findings {
    let start = Instant::now();
    let is_over = || start.elapsed() > limit;
    plan_and(configuration, |plan| prove_without_notes(configuration, plan, &is_over))
}

/// What is found in the plan of a mission, or why it has none.
fn plan_and(configuration: &Configuration, prove: impl FnOnce(&Plan) -> Findings) -> Findings {
    match Plan::of(configuration) {
        Ok(Some(plan)) => prove(&plan),
        Ok(None) => Findings::default(),
        Err(findings) => findings,
    }
}

/// Checks that this host's clock is good enough for the dates of the mission, if it has some.
///
/// # Errors
/// If the clock may be wrong.
pub fn check_clock(configuration: &Configuration) -> Result<()> {
    let plan = Plan::of(configuration).ok().flatten();
    if plan.is_some_and(|plan| plan.has_dates())
        && let Some(doubts) = armor_executive::clock_doubts()
    {
        return Err(RunError::Clock(doubts).into());
    }
    Ok(())
}

/// Parses the `--set` options of a command line, and returns findings for malformed ones.
pub fn parse_overrides(sets: &[String], folder: &Path) -> (Vec<Override>, Vec<Finding>) {
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

impl CheckedFile {
    /// The configuration, if it is free of errors.
    pub fn accepted(&self) -> Option<&Configuration> {
        self.reading.configuration.as_ref().filter(|_| self.reading.is_valid())
    }

    /// The files that were read for it, the one that was named first.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let sources = self.reading.configuration.iter().flat_map(|it| &it.sources);
        sources.map(|source| source.path())
    }

    /// How long the mission takes by its proof, where this was found.
    pub fn mission_duration(&self) -> Option<&MissionDuration> {
        self.reading.findings.iter().find_map(|finding| finding.takes.as_ref())
    }

    /// The findings as they are printed: how long the mission takes is a line of its own for
    /// people.
    fn shown(&self, format: OutputFormat) -> Findings {
        let is_shown =
            |finding: &&Finding| format == OutputFormat::Json || finding.code != Code::Takes;
        let mut shown = Findings::default();
        shown.extend(self.reading.findings.iter().filter(is_shown).cloned());
        shown
    }

    /// The errors and warnings as they are printed.
    #[cfg(test)]
    pub fn describe_problems(&self) -> String {
        self.reading.findings.without_notes().render(Colours::No)
    }

    /// Prints what is worth stopping at: errors and warnings.
    pub fn print_problems(&self, format: OutputFormat) {
        let problems = self.reading.findings.without_notes();
        print_findings(&problems, format);
        print_hint(problems.gravest(), format);
    }
}

/// Prints findings: for people on stderr, for programs as JSON Lines on stdout.
fn print_findings(findings: &Findings, format: OutputFormat) {
    let (mut out, mut err) = (std::io::stdout().lock(), std::io::stderr().lock());
    // A write error is ignored: the reader has closed the stream.
    let _ = if format == OutputFormat::Json {
        findings.iter().try_for_each(|finding| writeln!(out, "{}", findings_to_json(finding)))
    } else {
        let colours = if print::wants_colours(&err) { Colours::Yes } else { Colours::No };
        write!(err, "{}", findings.render(colours))
    };
}

/// Prints which command explains the code.
fn print_hint(code: Option<Code>, format: OutputFormat) {
    if let Some(code) = code.filter(|_| format != OutputFormat::Json) {
        let _ = writeln!(std::io::stderr(), "see `armor explain {}`", code.as_str());
    }
}

fn findings_to_json(finding: &Finding) -> String {
    serde_json::to_string(finding).unwrap_or_else(|error| error.to_string())
}
