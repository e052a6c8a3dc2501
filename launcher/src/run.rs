//! `armor run FILE`: checks the file, starts its components, and supervises them to the end.

pub mod arguments;
mod component_link;
pub mod control_group;
pub mod cpu_share;
pub mod descriptors;
pub mod environment;
pub mod given_up;
pub mod glibc;
pub mod group_killer;
mod hanging_calls;
pub mod host_states;
mod left_hosts;
pub mod logs;
mod other_hosts;
pub mod output_feed;
mod output_folder;
pub mod own_run;
mod plan;
pub mod port;
pub mod process;
pub mod process_stat;
mod remote;
mod requests;
pub mod shared_read;
pub mod status;
mod supervise;
pub mod supervisor;
pub mod survivors;
mod unfinished;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};
use serde_json::json;

use crate::arguments::OutputFormat;
use crate::check;
use crate::exit::CommandEnding;
use crate::kinds::Catalogue;
use crate::playback_cli::keys::PlaybackKeys;
use crate::playback_cli::played::{PLAYBACK_CLOCK, PlayedRecording};
use crate::print::{end_printing, print_line};
use crate::verb::Verb;
use arguments::RunArguments;
use armor_inspect::systems::{self, RunFile, RunRecord};
use armor_keys::HostKeys;
use armor_robotfile::Configuration;
use hanging_calls::HangingCalls;
use left_hosts::LeftHosts;
use logs::{EarlierLogs, RunLog};
use other_hosts::OtherHosts;
use own_run::OwnRun;
use plan::ProcessPlan;
use port::PortLease;
use status::{StatusLine, StatusObserver, StatusSources};
use supervise::RunIdentity;
use supervisor::{LogLevel, RunVerdict};

/// Variables that direct a process to a system on another host; all processes of a run would
/// inherit them.
const REMOTE_VARIABLES: [&str; 2] = ["ARMOR_VIA", "ARMOR_PORT"];
/// Threads for connecting to components, so that components that hang do not delay the others.
const CONNECTING_AT_ONCE: usize = 32;

impl Verb for RunArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(run_system(&self, format)?.into())
    }
}

/// Runs the system to its end.
///
/// # Errors
/// If it cannot be started at all.
fn run_system(arguments: &RunArguments, format: OutputFormat) -> Result<CommandEnding> {
    let checked = check::load_file(&arguments.file, &arguments.overrides, &arguments.kinds)?;
    checked.print_problems(format);
    let Some(configuration) = checked.accepted() else {
        return Ok(CommandEnding::Failed);
    };
    run_checked(arguments, &checked.catalogue, configuration, None, format)
}

/// Runs the system of a file that has been checked to its end; with a recording, that plays some of
/// its components.
///
/// # Errors
/// If it cannot be started at all.
pub fn run_checked(
    arguments: &RunArguments,
    catalogue: &Catalogue,
    configuration: &Configuration,
    played: Option<&PlayedRecording>,
    format: OutputFormat,
) -> Result<CommandEnding> {
    for variable in REMOTE_VARIABLES {
        if std::env::var_os(variable).is_some_and(|value| !value.is_empty()) {
            bail!("{variable} is set, for systems on another host; unset it to run one here");
        }
    }
    if !arguments.trust_clock {
        check::check_clock(configuration)?;
    }
    let name =
        arguments.system.clone().unwrap_or_else(|| plan::name_of(configuration, &arguments.file));
    // The mission to resume is in the folder of that name, and in no numbered one.
    let usual = arguments.resume.then(|| output_folder::default_folder(&name));
    // The mission of a replay is never continued on a robot, and does not touch the folder of one.
    let folder_name = if played.is_some() { format!("{name}-played") } else { name.clone() };
    let out = output_folder::OutputFolder::take(
        arguments.out.as_deref().or(usual.as_deref()),
        &folder_name,
    )?;
    if played.is_some() {
        unfinished::forget_mission(out.path())?;
    }
    let past = unfinished::prepare_folder(configuration, arguments, out.path())?;
    let own_run = OwnRun::begin(out.path(), arguments.resume)?;
    // For the connections of the launcher itself, to components and to the registry.
    armor_socket::adopt_secret(own_run.secret());
    let lease = PortLease::take(arguments.registry)?;
    let hosts = OtherHosts::find(configuration, arguments, &name, &own_run)?;
    let addresses = hosts.as_ref().map(OtherHosts::addresses).unwrap_or_default();
    let left_hosts = LeftHosts::find(out.path(), &name, &addresses)?;
    let (registry, folder) = (lease.address, out.path());
    let mut plan = ProcessPlan::new(
        configuration,
        catalogue,
        arguments,
        registry,
        folder,
        hosts.as_ref(),
        played,
    )?;
    plan.set_variable(own_run.variable());
    plan.set_keys(own_run.secret());
    let (system, manifests) = (&configuration.system, catalogue.manifests());
    let needed = descriptors::count_needed(system, &manifests, plan.duties.len());
    descriptors::raise_limit(needed)?;
    let record = RunRecord {
        system: name.clone(),
        file_names: plan::list_file_names(configuration),
        pid: std::process::id(),
        registry: lease.address,
        started_s: SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64(),
        file: arguments.file.clone(),
        out: out.path().into(),
        place: hosts.as_ref().map(|hosts| hosts.place().clone().into()),
    };
    let _run_file = RunFile::write(&systems::record_directory()?, &record)?;

    let line = StatusLine::for_stderr();
    let earlier = if arguments.resume { EarlierLogs::Append } else { EarlierLogs::Replace };
    let logs = out.path().join(unfinished::LOGS);
    let (log, sinks) = RunLog::start(&logs, earlier, &plan.names(), format, line.clone())?;
    let text = format!("{name}: registry {}, output {}", lease.address, out.path().display());
    log.report(plan::LAUNCHER, LogLevel::Info, text);
    for warning in &plan.warnings {
        log.report(plan::LAUNCHER, LogLevel::Warn, warning);
    }
    if let Some((level, text)) = past {
        log.report(plan::LAUNCHER, level, text);
    }
    if !lease.is_default() && arguments.registry.is_none() {
        let text = "the default port is taken, probably by another system; tools find both";
        log.report(plan::LAUNCHER, LogLevel::Info, text);
    }
    // The main thread starts every process: the kernel kills them when the thread that started them
    // ends.
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .max_blocking_threads(CONNECTING_AT_ONCE)
        .build()
        .context("the launcher cannot start its event loop")?;
    let restarts = Arc::new(AtomicU32::new(0));
    let hanging_calls = HangingCalls::default();
    // Programs that read JSON Lines from stdout do not expect plain lines on stderr.
    let is_wanted = !arguments.quiet && !line.is_discarded();
    let shows_status = is_wanted && (format != OutputFormat::Json || line.is_live());
    let takes_keys = played.is_some() && shows_status;
    let keys = takes_keys.then(|| PlaybackKeys::start(lease.address, &line)).flatten();
    let observer = (shows_status && keys.is_none()).then(|| {
        let file_clock = configuration.system.clock.as_ref().map(|clock| clock.source.data());
        let sources = StatusSources {
            registry: lease.address,
            has_mission: configuration.mission.is_some(),
            clock: played.map(|_| PLAYBACK_CLOCK.into()).or(file_clock),
            progress_outputs: plan::list_progress_outputs(configuration, catalogue),
            latched_outputs: plan::list_latched_outputs(configuration, catalogue),
            restarts: restarts.clone(),
            hanging_calls: hanging_calls.clone(),
            start: log.start_time(),
        };
        StatusObserver::start(sources, line)
    });
    let observer = observer.transpose()?;
    let resumes = arguments.resume;
    let identity = RunIdentity { system: name.clone(), time: arguments.time, resumes };
    let supervision = supervise::supervise(plan, identity, &log, restarts, hanging_calls);
    let verdict = runtime.block_on(async {
        left_hosts.release(|| Ok(HostKeys::read(&arguments.keys.path()?)?), &log);
        supervision.await
    });
    drop(keys);
    if let Some(observer) = observer {
        observer.finish();
    }
    runtime.shutdown_background();
    if let Ok(verdict) = &verdict {
        log.report(plan::LAUNCHER, LogLevel::Info, format!("{name}: {}", format_verdict(verdict)));
    }
    sinks.close();
    let verdict = verdict?;
    let ending = ending_of(&verdict);
    if format == OutputFormat::Json {
        let code = ending.code();
        let end = json!({"event": "end", "how": format_verdict(&verdict), "code": code});
        end_printing(print_line(end))?;
    }
    Ok(ending)
}

fn ending_of(verdict: &RunVerdict) -> CommandEnding {
    match verdict {
        RunVerdict::Goal => CommandEnding::Fine,
        RunVerdict::Interrupted => CommandEnding::Interrupted,
        RunVerdict::Safe | RunVerdict::Failed | RunVerdict::Essential(_) => CommandEnding::Failed,
        RunVerdict::Stopped { is_unfinished: true, .. }
        | RunVerdict::RecordingOver { is_unfinished: true, .. } => CommandEnding::Stopped,
        RunVerdict::TimeUp { failed }
        | RunVerdict::AllEnded { failed }
        | RunVerdict::RecordingOver { failed, .. }
        | RunVerdict::Stopped { failed, .. } => {
            if failed.is_empty() {
                CommandEnding::Fine
            } else {
                CommandEnding::Failed
            }
        }
    }
}

fn format_verdict(verdict: &RunVerdict) -> String {
    let with = |text: &str, failed: &[String]| match failed {
        [] => text.into(),
        failed => format!("{text}; failed: {}", failed.join(", ")),
    };
    match verdict {
        RunVerdict::Goal => "the mission reached its goal".into(),
        RunVerdict::Safe => "the mission ended in its safe place".into(),
        RunVerdict::Failed => "the mission failed".into(),
        RunVerdict::Interrupted => "interrupted".into(),
        RunVerdict::Stopped { is_unfinished: false, failed } => {
            with("an operator has stopped it", failed)
        }
        RunVerdict::Stopped { is_unfinished: true, failed } => {
            with("an operator has stopped it before its mission was over", failed)
        }
        RunVerdict::TimeUp { failed } => with("the time is over", failed),
        RunVerdict::AllEnded { failed } => with("every component has ended", failed),
        RunVerdict::RecordingOver { is_unfinished: false, failed } => {
            with("the recording is over", failed)
        }
        RunVerdict::RecordingOver { is_unfinished: true, failed } => {
            with("the recording is over, and the mission is not", failed)
        }
        RunVerdict::Essential(name) => {
            format!("{name} failed for good, and the system needs it")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_an_operator_stops_is_distinguished_from_an_interrupted_one() {
        let check = |is_unfinished, failed: &[&str], code, text: &str| {
            let failed = failed.iter().map(ToString::to_string).collect();
            let verdict = RunVerdict::Stopped { is_unfinished, failed };
            assert_eq!(ending_of(&verdict).code(), code, "{verdict:?}");
            assert_eq!(format_verdict(&verdict), text);
        };
        check(false, &[], 0, "an operator has stopped it");
        check(false, &["arm"], 1, "an operator has stopped it; failed: arm");
        check(true, &[], 3, "an operator has stopped it before its mission was over");
        assert_eq!(ending_of(&RunVerdict::Interrupted).code(), 130);
    }
}
