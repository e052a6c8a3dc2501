//! `armor guard PARENT -- PROGRAM …`: becomes PROGRAM, in a process group of its own, and is killed
//! by the kernel when the thread that started it ends. So nothing outlives a killed launcher, not
//! even an executable that knows nothing of Armor.

use std::ffi::OsString;
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use rustix::process::{
    Pid, Resource, Rlimit, Signal, geteuid, getppid, getpriority_process, getrlimit,
    set_parent_process_death_signal, setpgid, setpriority_process, setrlimit,
};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

use crate::arguments::OutputFormat;
use crate::run::process::OWN_PROGRAM;
use crate::run::{control_group, cpu_share};
use crate::verb::Verb;

/// Run a program that does not outlive its parent.
#[derive(Args, Debug)]
pub struct GuardArguments {
    /// Process id of the parent that must be alive.
    pub parent: i32,
    /// The folder of the control group that it enters.
    #[arg(long, value_name = "DIR")]
    pub control_group: Option<PathBuf>,
    /// What it may use of the host.
    #[command(flatten)]
    pub resources: GuardedResources,
    /// The program and its arguments.
    #[arg(last = true, required = true)]
    pub program: Vec<OsString>,
}

/// What a program and all that it starts may use of the host; what is not given is not limited.
#[derive(Args, Clone, Debug, Default, PartialEq, Eq)]
pub struct GuardedResources {
    /// Its niceness.
    #[arg(long, allow_negative_numbers = true)]
    pub nice: Option<i32>,
    /// Its priority in real time.
    #[arg(long)]
    pub realtime: Option<u8>,
    /// The processors on which it may run.
    #[arg(long, value_delimiter = ',')]
    pub cpus: Vec<usize>,
    /// The time of processors that they get together, in thousandths of one.
    #[arg(long)]
    pub cpu_permille: Option<u32>,
    /// The bytes that each process may allocate.
    #[arg(long)]
    pub memory: Option<u64>,
}

impl Verb for GuardArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        become_program(&self)
    }
}

/// Becomes the program. Returns only if that is not possible.
fn become_program(guard: &GuardArguments) -> Result<ExitCode> {
    set_parent_process_death_signal(Some(Signal::KILL)).context("asking for the death signal")?;
    // The parent may have died before the signal was asked for; then it never comes.
    if getppid() != Pid::from_raw(guard.parent) {
        bail!("process {}, which started this one, has ended", guard.parent);
    }
    setpgid(None, None).context("making a process group")?;
    if let Some(permille) = guard.resources.cpu_permille {
        cpu_share::limit(guard.control_group.as_deref(), permille)?;
    }
    // Before the other limits: a process in real time may not change its group.
    if let Some(group) = &guard.control_group
        && let Err(error) = control_group::enter(group)
    {
        // The program is worth more than what it may leave.
        let group = group.display();
        let _ = writeln!(std::io::stderr(), "WARN {group} cannot be entered: {error}");
    }
    guard.resources.limit_own()?;
    let (program, arguments) =
        guard.program.split_first().context("no program is given after `--`")?;
    let mut command = Command::new(program);
    if program == OWN_PROGRAM
        && let Some(own) = std::env::args_os().next()
    {
        command.arg0(own);
    }
    let error = command.args(arguments).exec();
    Err(error).with_context(|| format!("{} cannot be started", program.to_string_lossy()))
}

/// Returns the arguments that start `program` under the guard of process `parent`.
pub fn list_arguments<'a>(
    parent: u32,
    control_group: Option<&Path>,
    resources: &GuardedResources,
    program: &'a OsString,
    arguments: &'a [OsString],
) -> impl Iterator<Item = OsString> + 'a {
    let resources = resources.list_arguments();
    let group = control_group.map(|path| ["--control-group".into(), path.into()]);
    ["guard".into(), parent.to_string().into()]
        .into_iter()
        .chain(group.into_iter().flatten())
        .chain(resources.into_iter().map(OsString::from))
        .chain(["--".into(), program.clone()])
        .chain(arguments.iter().cloned())
}

impl GuardedResources {
    /// Limits this process, and so the program that it becomes. Its control group limits `cpu_permille`.
    fn limit_own(&self) -> Result<()> {
        if let Some(nice) = self.nice {
            setpriority_process(None, nice).with_context(|| format!("nice=\"{nice}\""))?;
        }
        if let Some(priority) = self.realtime {
            run_in_real_time(priority).with_context(|| format!("realtime=\"{priority}\""))?;
        }
        if !self.cpus.is_empty() {
            let mut set = CpuSet::new();
            self.cpus.iter().filter(|cpu| **cpu < CpuSet::MAX_CPU).for_each(|cpu| set.set(*cpu));
            sched_setaffinity(None, &set).with_context(|| format!("cpus {:?}", self.cpus))?;
        }
        if let Some(bytes) = self.memory {
            let limit = Rlimit { current: Some(bytes), maximum: Some(bytes) };
            setrlimit(Resource::Data, limit).with_context(|| format!("{bytes} bytes of memory"))?;
        }
        Ok(())
    }

    fn list_arguments(&self) -> Vec<String> {
        let nice = self.nice.map(|nice| format!("--nice={nice}"));
        let realtime = self.realtime.map(|priority| format!("--realtime={priority}"));
        let numbers: Vec<_> = self.cpus.iter().map(ToString::to_string).collect();
        let cpus = (!numbers.is_empty()).then(|| format!("--cpus={}", numbers.join(",")));
        let cpu = self.cpu_permille.map(|permille| format!("--cpu-permille={permille}"));
        let memory = self.memory.map(|bytes| format!("--memory={bytes}"));
        [nice, realtime, cpus, cpu, memory].into_iter().flatten().collect()
    }

    /// Returns why this user cannot have the niceness, and what to do.
    pub fn refuse_nice(&self) -> Option<String> {
        let nice = self.nice.filter(|nice| !may_be_as_nice(*nice))?;
        Some(format!(
            "this user may not run processes with a niceness of {nice}: write a higher one, or \
             raise the limit `nice` of the user in /etc/security/limits.conf"
        ))
    }

    /// Returns why this user cannot have the priority in real time, and what to do.
    pub fn refuse_realtime(&self) -> Option<String> {
        let priority = self.realtime?;
        // Rights, limits and control groups decide together, so a thread tries it.
        let tried = std::thread::spawn(move || run_in_real_time(priority)).join();
        let why = tried.unwrap_or_else(|_| Err(anyhow!("it could not be tried"))).err()?;
        Some(format!(
            "this user may not run processes with a real-time priority of {priority} ({why:#}): \
             raise the limit `rtprio` of the user in /etc/security/limits.conf, or leave it out"
        ))
    }

    /// Returns why the share of the processors' time cannot be kept, and what to do.
    pub fn refuse_cpu(&self) -> Option<String> {
        self.cpu_permille.and_then(|_| cpu_share::refuse())
    }

    /// Returns why the processors cannot be used.
    pub fn refuse_cpus(&self) -> Option<String> {
        let own = sched_getaffinity(None).ok()?;
        let is_missing = |cpu: &&usize| **cpu >= CpuSet::MAX_CPU || !own.is_set(**cpu);
        let missing = self.cpus.iter().find(is_missing)?;
        let usable: Vec<_> = (0..CpuSet::MAX_CPU).filter(|cpu| own.is_set(*cpu)).collect();
        let usable = usable.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        Some(format!(
            "there is no processor {missing} here: this process may use {usable}; name some of these"
        ))
    }
}

/// Gives the calling thread, and so all that it starts, this priority in real time.
fn run_in_real_time(priority: u8) -> Result<()> {
    let priority = ThreadPriorityValue::try_from(priority).map_err(|why| anyhow!("{why}"))?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let priority = ThreadPriority::Crossplatform(priority);
    set_thread_priority_and_policy(thread_native_id(), priority, policy).map_err(|why| match why {
        thread_priority::Error::OS(code) => std::io::Error::from_raw_os_error(code).into(),
        other => anyhow!("{other}"),
    })
}

/// Whether a process of this user may have this niceness. Only a lower one than its own needs a
/// right, which the kernel states as 20 minus the lowest.
fn may_be_as_nice(nice: i32) -> bool {
    let own = getpriority_process(None).unwrap_or(0);
    let lowest = getrlimit(Resource::Nice).current.map_or(-20, |right| 20 - right.min(40) as i32);
    nice >= own || geteuid().is_root() || nice >= lowest
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        guard: GuardArguments,
    }

    #[test]
    fn limits_reach_the_guard_as_they_are() {
        for resources in [
            GuardedResources::default(),
            GuardedResources {
                nice: Some(-5),
                realtime: Some(99),
                cpus: vec![0, 3],
                cpu_permille: Some(1500),
                memory: Some(1 << 40),
            },
        ] {
            let (program, arguments) = ("p".into(), ["--nice".into(), "x".into()]);
            let group = Path::new("/sys/fs/cgroup/a");
            let line = list_arguments(7, Some(group), &resources, &program, &arguments);
            let guard = Line::try_parse_from(line).expect("it is understood").guard;
            assert_eq!(guard.control_group.as_deref(), Some(group));
            assert_eq!((guard.parent, guard.resources), (7, resources));
            assert_eq!(guard.program, ["p", "--nice", "x"]);
        }
    }

    #[test]
    fn what_the_host_cannot_grant_is_named() {
        let missing = GuardedResources { cpus: vec![0, 1023], ..GuardedResources::default() };
        let why = missing.refuse_cpus().expect("no host has so many");
        assert!(why.contains("no processor 1023") && why.contains("name some of these"), "{why}");
        let nice = GuardedResources { nice: Some(19), ..GuardedResources::default() };
        assert_eq!((nice.refuse_nice(), nice.refuse_cpus()), (None, None));
        let urgent = GuardedResources { realtime: Some(99), ..GuardedResources::default() };
        let why = urgent.refuse_realtime();
        assert!(why.is_none_or(|why| why.contains("`rtprio`")));
    }
}
