//! `armor configd`: configd as a process. It reports the state of the file in the log, and
//! publishes it as the latched data `configuration.state`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_configd::{ConfigdOptions, KindSource, Notice};
use armor_inspect::CONFIGURATION;
use armor_robotfile::{Colours, Finding, Severity};
use armor_sdk::directory::Directory;
use armor_sdk::messages::ConfigurationState;
use armor_sdk::node::{NodeOptions, SystemNode};
use armor_sdk::prelude::Latched;
use armor_socket::Registration;
use armor_socket::run_keys::own_secret;
use armor_wire::config::ChangeRecord;
use clap::Args;
use parking_lot::Mutex;
use tracing::{debug, error, info, warn};

use super::serving::{make_entry, serve_until_signal};
use crate::arguments::{KindFolders, OutputFormat, default_registry, parse_data_name};
use crate::check;
use crate::exit::CommandEnding;
use crate::kinds::{Catalogue, Identity};
use crate::print::print_notice;
use crate::verb::Verb;

/// Longest time of one attempt to register before the reason is logged; it is tried again
/// afterwards.
const REGISTER_WITHIN: Duration = Duration::from_secs(20);
/// Executables that have not changed for this time are complete.
const SETTLED_AFTER: Duration = Duration::from_millis(150);
/// Executables that change all the time are taken as they are after this many looks.
const MAX_SETTLING_LOOKS: usize = 10;
/// Most changes and findings that are logged in full.
const MAX_LOGGED: usize = 20;

/// Run the configuration daemon alone.
#[derive(Args, Debug)]
pub struct ConfigdArguments {
    /// The system or mission file.
    pub file: PathBuf,
    /// Where the registry listens.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY", default_value_t = default_registry())]
    pub registry: SocketAddr,
    /// Override the value of a parameter in the file.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    pub overrides: Vec<String>,
    /// Folder for accepted versions, which a restarted configd reads. Default:
    /// `configd` in the folder of the run, $ARMOR_OUT.
    #[arg(long, value_name = "DIR")]
    pub versions: Option<PathBuf>,
    /// If the file is not valid and no version is kept: keep running, and refuse requests until the
    /// file is valid.
    #[arg(long)]
    pub wait: bool,
    /// Let the time of all components follow this data, COMPONENT.OUTPUT, whatever the file says.
    #[arg(long, hide = true, value_name = "DATA", value_parser = parse_data_name)]
    pub clock: Option<String>,
    #[command(flatten)]
    pub kinds: KindFolders,
}

impl Verb for ConfigdArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        Ok(run_configd(&self)?.into())
    }
}

/// Runs configd until it is asked to end.
///
/// # Errors
/// If the file is not valid and no version of it is kept, or configd cannot listen.
fn run_configd(arguments: &ConfigdArguments) -> Result<CommandEnding> {
    armor_sdk::log::init();
    let folder = std::env::current_dir().context("the current folder is gone")?;
    let (overrides, malformed) = check::parse_overrides(&arguments.overrides, &folder);
    if let Some(finding) = malformed.first() {
        bail!("{finding}");
    }
    let versions = arguments.versions.clone().or_else(default_versions);
    // The file may be broken by now; the kinds are those of the version that will be in force.
    let mut files = armor_robotfile::load(&arguments.file).files;
    files.extend(versions.iter().flat_map(|kept| armor_configd::kept_files(kept, &arguments.file)));
    let files: Vec<_> = files.into_iter().collect();
    let directories = arguments.kinds.directories.clone();
    let known = Catalogue::sources(&directories, files.iter().map(AsRef::as_ref));
    let kinds = Catalogue::gather(&arguments.kinds.directories, files.iter().map(AsRef::as_ref))?;
    // `armor check` and `armor run` have printed them already.
    kinds.findings(None).iter().for_each(|finding| debug!("{finding}"));
    let options = ConfigdOptions {
        overrides,
        clock: arguments.clock.clone(),
        manifests: Some(kinds.manifests()),
        kinds: Some(watched(directories, files, known)),
        further: Some(check::of_the_mission_soon),
        versions,
        wait: arguments.wait,
        ..ConfigdOptions::new(&arguments.file)
    };
    let registry = arguments.registry;
    let publisher = publisher(registry)?;
    // Of a registry that was started by hand no client is configd; it grants everything.
    let report = own_secret().map(|_| Directory::observer(&registry.to_string(), "configd"));
    // Kept to the end: dropping it ends the registration.
    let mut registrations = Vec::new();
    let notify = |notice| match notice {
        Notice::Ready { address } => {
            registrations
                .push(Registration::keep_registered(registry, make_entry("configd", address)));
        }
        Notice::Readers(readers) => {
            report.iter().for_each(|report| report.report_readers(readers.clone()));
        }
        // No thread receives it only if none could be started, which was logged.
        Notice::State(state) => drop(publisher.send(*state)),
        other => log_notice(&other),
    };
    serve_until_signal(async {
        Ok(armor_configd::serve(options, notify).await.map(|never| match never {})?)
    })
}

/// Gathers the kinds again whenever the executables are others than those `known`.
fn watched(
    directories: Vec<PathBuf>,
    first: Vec<PathBuf>,
    known: Vec<(PathBuf, Option<Identity>)>,
) -> KindSource {
    let known = Mutex::new(known);
    KindSource::new(move |files| {
        let files = || first.iter().chain(files).map(AsRef::as_ref);
        let mut now = Catalogue::sources(&directories, files());
        let mut known = known.lock();
        if *known == now {
            return None;
        }
        // An executable may be half-written, or removed to be replaced.
        for _ in 0..MAX_SETTLING_LOOKS {
            std::thread::sleep(SETTLED_AFTER);
            let before = std::mem::replace(&mut now, Catalogue::sources(&directories, files()));
            if before == now {
                break;
            }
        }
        let gathered = Catalogue::gather(&directories, files());
        let kinds = gathered.inspect_err(|error| warn!("the kinds stay: {error:#}")).ok()?;
        kinds.findings(None).iter().for_each(|finding| warn!("{finding}"));
        info!(
            "the component directories have changed; files are checked against their new content"
        );
        *known = now;
        Some(kinds.manifests())
    })
}

/// In the folder of the run, if there is one.
pub(super) fn default_versions() -> Option<PathBuf> {
    std::env::var_os("ARMOR_OUT").map(|out| PathBuf::from(out).join("configd"))
}

fn log_notice(notice: &Notice) {
    match notice {
        Notice::Taken { version, findings, changes } if *version > 1 => {
            // A note is no news: it was there before, or is about what was meant.
            log_findings(findings.iter().filter(|finding| finding.severity() != Severity::Note));
            let meaning =
                if changes.is_empty() { "; it means what the last one meant" } else { "" };
            // What is played stands in the mission's own words: it may be refused from where it
            // stands, or wait.
            let mission = changes.iter().any(|change| change.subject.is_of_mission());
            let mission =
                if mission { "; the executive reports how it handles its mission" } else { "" };
            info!("version {version} of the file is valid and in force{meaning}{mission}");
            for ChangeRecord { text, effect, .. } in changes.iter().take(MAX_LOGGED) {
                info!("{text}; it {effect}");
            }
            if changes.len() > MAX_LOGGED {
                info!("and {} more; see `armor param diff`", changes.len() - MAX_LOGGED);
            }
        }
        Notice::Refused { kept, findings } => {
            match kept {
                Some(kept) => {
                    warn!(
                        "the file is not valid; version {kept}, the last good one, stays in force"
                    );
                }
                None => error!(
                    "the file is not valid, and no version of it is kept: requests are refused until \
                     it is"
                ),
            }
            log_findings(findings.iter());
        }
        Notice::Outdated { version, findings } => {
            warn!(
                "the file is not valid with the components' executables as they are now; version \
                 {version} stays in force, and running components keep running"
            );
            log_findings(findings.iter());
        }
        Notice::Restored { version } => {
            info!("the file is again that of version {version}, which is in force");
        }
        // The faults of the first version were reported before the start.
        Notice::Taken { .. } | Notice::Ready { .. } | Notice::Readers(_) | Notice::State(_) => {}
    }
}

/// As `armor check` shows them. The launcher gives every line its time and name.
fn log_findings<'a>(findings: impl Iterator<Item = &'a Finding> + Clone) {
    for finding in findings.clone().take(MAX_LOGGED) {
        let text = finding.render(Colours::No);
        print_notice(text.trim_end());
    }
    let more = findings.count().saturating_sub(MAX_LOGGED);
    if more > 0 {
        print_notice(format_args!("and {more} more findings; `armor check` shows all of them"));
    }
}

/// Takes what is to be published. Publishing waits for the registry, which may be away, so it has a
/// thread of its own.
fn publisher(registry: SocketAddr) -> Result<Sender<ConfigurationState>> {
    let (sender, states) = mpsc::channel();
    std::thread::Builder::new()
        .name("state".into())
        .spawn(move || publish(registry, &states))
        .context("no thread for publishing the state")?;
    Ok(sender)
}

fn publish(registry: SocketAddr, states: &Receiver<ConfigurationState>) {
    let options = NodeOptions {
        name: CONFIGURATION.into(),
        kind: CONFIGURATION.into(),
        registry: registry.to_string(),
    };
    let mut logged = String::new();
    let node = loop {
        match SystemNode::start(&options, REGISTER_WITHIN, |armor| {
            Ok(armor.provide::<Latched<ConfigurationState>>("state")?)
        }) {
            Ok(node) => break node,
            Err(fault) => {
                let text = fault.to_string();
                if text != logged {
                    warn!("{CONFIGURATION}.state is not published: {text}; trying on");
                }
                logged = text;
            }
        }
    };
    let armor = node.armor();
    for mut state in states {
        state.stamp = armor.timestamp();
        if let Err(error) = armor.send_data("state", &state) {
            warn!("{CONFIGURATION}.state is not published: {error}");
        }
    }
}
