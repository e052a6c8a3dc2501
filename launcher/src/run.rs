//! `armor run FILE`: checks the file, starts what it names, and watches it to the end.

mod logs;
mod out;
mod past;
mod plan;
mod port;
pub mod process;
mod pulse;
mod supervise;
mod supervisor;
pub mod undertaker;

use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};
use serde_json::json;

use crate::arguments::{self, Format};
use crate::check;
use crate::exit::Ending;
use armor_inspect::systems::{self, RunFile, RunRecord};
use logs::Log;
use plan::Plan;
use port::Lease;
use supervisor::{Level, Verdict};

/// What leads a process to a system elsewhere; all the processes of a run would inherit it.
const FAR: [&str; 2] = ["ARMOR_VIA", "ARMOR_PORT"];
/// Threads for connecting to components, so that some that hang do not hold up the others.
const CONNECTING_AT_ONCE: usize = 32;

/// Runs the system to its end.
///
/// # Errors
/// If it cannot be started at all.
pub fn run(arguments: &arguments::Run, format: Format) -> Result<Ending> {
    for variable in FAR {
        if std::env::var_os(variable).is_some_and(|value| !value.is_empty()) {
            bail!("{variable} is set, for systems on another host; unset it to run one here");
        }
    }
    let checked = check::load(&arguments.file, &arguments.overrides, &arguments.kinds)?;
    checked.print_problems(format);
    let Some(configuration) = checked.accepted() else {
        return Ok(Ending::Failed);
    };
    if !arguments.trust_clock {
        check::clock(configuration)?;
    }
    let name =
        arguments.system.clone().unwrap_or_else(|| plan::name_of(configuration, &arguments.file));
    // What is gone on with is in the folder of that name, and in no other beside it.
    let usual = arguments.resume.then(|| out::usual(&name));
    let out = out::Folder::take(arguments.out.as_deref().or(usual.as_deref()), &name)?;
    let past = past::settle(configuration, arguments, out.path())?;
    let lease = Lease::take(arguments.registry)?;
    let plan = Plan::new(configuration, &checked.catalogue, arguments, lease.address, out.path())?;
    let record = RunRecord {
        system: name.clone(),
        pid: std::process::id(),
        registry: lease.address,
        started_s: SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64(),
        file: arguments.file.clone(),
        out: out.path().into(),
    };
    let _run_file = RunFile::write(&systems::record_directory()?, &record)?;

    let (log, sinks) = Log::start(&out.path().join("logs"), &plan.names(), format)?;
    let text = format!("{name}: registry {}, output {}", lease.address, out.path().display());
    log.say(plan::LAUNCHER, Level::Info, text);
    if let Some((level, text)) = past {
        log.say(plan::LAUNCHER, level, text);
    }
    if !lease.is_default() && arguments.registry.is_none() {
        let text = "the usual port is taken, probably by another system; tools find both";
        log.say(plan::LAUNCHER, Level::Info, text);
    }
    // The main thread starts every process: the kernel kills them when the thread that did ends.
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .max_blocking_threads(CONNECTING_AT_ONCE)
        .build()
        .context("the launcher cannot start its event loop")?;
    let verdict = runtime.block_on(supervise::supervise(plan, arguments.time, &log));
    runtime.shutdown_background();
    if let Ok(verdict) = &verdict {
        log.say(plan::LAUNCHER, Level::Info, format!("{name}: {}", in_words(verdict)));
    }
    sinks.close();
    let verdict = verdict?;
    let ending = ending(&verdict);
    if format == Format::Json {
        let code = ending.code();
        println!("{}", json!({"event": "end", "how": in_words(&verdict), "code": code}));
    }
    Ok(ending)
}

fn ending(verdict: &Verdict) -> Ending {
    match verdict {
        Verdict::Goal => Ending::Fine,
        Verdict::Interrupted => Ending::Interrupted,
        Verdict::Safe | Verdict::Failed | Verdict::Essential(_) => Ending::Failed,
        Verdict::TimeUp { failed } | Verdict::AllEnded { failed } => {
            if failed.is_empty() {
                Ending::Fine
            } else {
                Ending::Failed
            }
        }
    }
}

fn in_words(verdict: &Verdict) -> String {
    let with = |text: &str, failed: &[String]| match failed {
        [] => text.into(),
        failed => format!("{text}; failed: {}", failed.join(", ")),
    };
    match verdict {
        Verdict::Goal => "the mission reached its goal".into(),
        Verdict::Safe => "the mission ended in its safe place".into(),
        Verdict::Failed => "the mission failed".into(),
        Verdict::Interrupted => "interrupted".into(),
        Verdict::TimeUp { failed } => with("the time is over", failed),
        Verdict::AllEnded { failed } => with("every component has ended", failed),
        Verdict::Essential(name) => format!("{name} failed for good, and nothing works without it"),
    }
}
