//! `armor executive`: the executive as a process. It begins with the version of the file that
//! configd keeps, and adopts newer ones.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use armor_configd::KeptWatch;
use armor_executive::{ExecutiveOptions, GivenUpComponents, MissionOutcome, Newer};
use armor_plan::{FileText, Plan, Version};
use armor_robotfile::{Colours, Findings, Override};
use clap::Args;

use super::configd::default_versions;
use super::serving::watch_for_signals;
use crate::arguments::{OutputFormat, default_registry, parse_data_name};
use crate::check;
use crate::exit::CommandEnding;
use crate::run::given_up::take_reports;
use crate::verb::Verb;

/// Longest time until configd, which starts at the same time, keeps the first version.
const KEPT_WITHIN: Duration = Duration::from_secs(10);
/// Longest time between two looks for it.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Run the executive alone.
#[derive(Args, Debug)]
pub struct ExecutiveArguments {
    /// The mission file.
    pub file: PathBuf,
    /// Where the registry listens.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY", default_value_t = default_registry())]
    pub registry: SocketAddr,
    /// Override the value of a parameter in the file.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Folder of the versions that configd keeps: newer ones are adopted. Default:
    /// `$ARMOR_OUT/configd`; without it the mission is not updated.
    #[arg(long, value_name = "DIR")]
    pub versions: Option<PathBuf>,
    /// File of the journal, which a restarted executive continues.
    #[arg(long, value_name = "FILE")]
    pub journal: Option<PathBuf>,
    /// The journal exists already. If it is missing or empty it was lost, and the mission goes to
    /// its safe place instead of starting again.
    #[arg(long)]
    pub resume: bool,
    /// The launcher reports on stdin which components it has given up.
    #[arg(long, hide = true)]
    pub supervised: bool,
    /// Follow the time of this data, COMPONENT.OUTPUT, whatever the file says.
    #[arg(long, hide = true, value_name = "DATA", value_parser = parse_data_name)]
    pub clock: Option<String>,
    /// Accept absolute dates although no time service synchronizes this host's clock.
    #[arg(long)]
    pub trust_clock: bool,
}

impl Verb for ExecutiveArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        run_executive(&self)
    }
}

/// Plays the mission to its end: code 0 at its goal, 3 in its safe place, 4 if it failed, and 130
/// if it was interrupted, in which case the same journal continues it.
///
/// # Errors
/// If the mission or the journal cannot be used.
fn run_executive(arguments: &ExecutiveArguments) -> Result<ExitCode> {
    armor_sdk::log::init();
    let folder = std::env::current_dir().context("the current folder is gone")?;
    let (overrides, malformed) = check::parse_overrides(&arguments.overrides, &folder);
    if let Some(finding) = malformed.first() {
        bail!("{finding}");
    }
    let journal = arguments.journal.clone().unwrap_or_else(default_journal);
    let versions = arguments.versions.clone().or_else(default_versions);
    let newer = versions.map(|versions| kept_in(versions, arguments.file.clone()));
    let given_up = GivenUpComponents::default();
    if arguments.supervised {
        let list = given_up.clone();
        let take = move || take_reports(std::io::stdin().lock(), &list);
        std::thread::Builder::new().name("given-up".into()).spawn(take).context("no thread")?;
    }
    let options = ExecutiveOptions {
        registry: arguments.registry.to_string(),
        journal,
        is_laid_out: arguments.resume,
        newer,
        given_up,
        cut_at: armor_executive::journal::CUT_AT,
        clock: arguments.clock.clone(),
        trust_clock: arguments.trust_clock,
    };
    let stop = watch_for_signals()?;
    let first = || match options.newer.as_ref().and_then(|newer| first_kept(newer, stop)) {
        Some(version) => version.plan(),
        None => plan_of(&arguments.file, &overrides),
    };
    let outcome = armor_executive::run(first, &options, stop)?;
    Ok(ExitCode::from(match outcome {
        MissionOutcome::Goal => 0,
        MissionOutcome::Safe => 3,
        MissionOutcome::Failed => 4,
        MissionOutcome::Interrupted => CommandEnding::Interrupted.code(),
    }))
}

/// The versions of `file` that configd keeps.
fn kept_in(folder: PathBuf, file: PathBuf) -> Newer {
    let watch = KeptWatch::of(folder.clone());
    let find = move |known| {
        let kept = armor_configd::newer_than(known, &folder, &file)?;
        let files = kept.files.into_iter().map(|(path, text)| FileText { path, text });
        Some(Version { number: kept.number, files: files.collect() })
    };
    Newer::new(find, move |at_most| watch.wait(at_most))
}

/// Returns the version that configd keeps at the start; none if it keeps nothing.
fn first_kept(newer: &Newer, stop: &AtomicBool) -> Option<Version> {
    let start = Instant::now();
    while !stop.load(Ordering::Relaxed) && start.elapsed() < KEPT_WITHIN {
        if let Some(version) = newer.than(0) {
            return Some(version);
        }
        newer.wait(LOOK_EVERY);
    }
    None
}

/// The plan of the file as it is now.
fn plan_of(file: &Path, overrides: &[Override]) -> Result<Plan, String> {
    let in_words = |findings: &Findings| findings.render(Colours::No).trim_end().to_owned();
    let reading = armor_robotfile::check(armor_robotfile::load(file), overrides, None);
    let Some(configuration) = reading.configuration.as_ref().filter(|_| reading.is_valid()) else {
        return Err(in_words(&reading.findings));
    };
    let plan = Plan::of(configuration).map_err(|findings| in_words(&findings))?;
    plan.ok_or_else(|| format!("{} has no mission", file.display()))
}

/// In the folder of the run, or the current one.
fn default_journal() -> PathBuf {
    PathBuf::from(std::env::var_os("ARMOR_OUT").unwrap_or_default()).join("executive.journal")
}
