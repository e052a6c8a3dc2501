//! Processes: started under the guard, read line by line, killed with their whole group.

use std::ffi::OsString;
use std::io::PipeWriter;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;

use anyhow::{Context, Result};
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use tokio::process::{Child, Command};
use tokio::task::JoinHandle;

use super::control_group::{ControlGroup, ProcessControlGroup};
use super::logs::{LogStream, RunLog};
use super::own_run::START_VARIABLE;
use super::process_stat::read_state;
use super::supervisor::ChildExit;
use super::survivors::kill_survivors;
use crate::guard::{self, GuardedResources};

/// With this code ends a guard that cannot become its program.
const GUARD_FAILED: i32 = 1;

/// How to start a process.
#[derive(Clone, Debug)]
pub struct ProcessStart {
    /// Name in its log lines.
    pub name: String,
    /// The executable.
    pub program: PathBuf,
    /// Its arguments.
    pub arguments: Vec<OsString>,
    /// All its variables.
    pub environment: Vec<(OsString, OsString)>,
    /// What the processes that it starts itself inherit, in [`super::survivors::VARIABLE`].
    pub mark: String,
    /// What it may use of the host.
    pub resources: GuardedResources,
    /// Whether the launcher reports to it on its stdin.
    pub takes_reports: bool,
}

/// A process that was started.
#[derive(Debug)]
pub struct ChildProcess {
    pid: Pid,
    child: Child,
    readers: [JoinHandle<()>; 2],
    mark: String,
    control_group: Option<ProcessControlGroup>,
    reports: Option<PipeWriter>,
    program: PathBuf,
}

/// A process group, which signals are sent to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessGroup(Pid);

impl ChildProcess {
    /// Starts a process, in a control group of its own if the run has one; `of_run` states which start
    /// of the run it is. Must be called on the main thread: the kernel kills the process when the
    /// thread that started it ends.
    ///
    /// # Errors
    /// If the guard cannot be started; an executable that cannot be started ends with code 1.
    pub fn start(
        start: &ProcessStart,
        of_run: &str,
        run: Option<&ControlGroup>,
        log: &RunLog,
    ) -> Result<Self> {
        // Without one, the mark finds most of what it starts.
        let control_group = run.and_then(|run| run.make_for(&start.name).ok());
        let program = start.program.clone().into_os_string();
        let (stdin, reports) = if start.takes_reports {
            let (reader, writer) = std::io::pipe().context("no pipe to a process")?;
            // A process that does not read must not delay the launcher.
            rustix::io::ioctl_fionbio(&writer, true).context("no pipe to a process")?;
            (Stdio::from(reader), Some(writer))
        } else {
            (Stdio::null(), None)
        };
        let mut child = Command::new(OWN_PROGRAM)
            .arg0(own_path())
            .args(guard::list_arguments(
                std::process::id(),
                control_group.as_ref().map(ProcessControlGroup::path),
                &start.resources,
                &program,
                &start.arguments,
            ))
            .env_clear()
            .envs(start.environment.iter().map(|(name, value)| (name, value)))
            .env(START_VARIABLE, of_run)
            .stdin(stdin)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Before the guard makes the group itself, so that a kill never misses the process.
            .process_group(0)
            .spawn()
            .context("a process cannot be started")?;
        let pid = child.id().and_then(|pid| Pid::from_raw(i32::try_from(pid).ok()?));
        let pid = pid.context("the process has no id")?;
        let name: Arc<str> = start.name.as_str().into();
        let out = child.stdout.take().context("the process has no output")?;
        let err = child.stderr.take().context("the process has no error output")?;
        let readers = [
            tokio::spawn(log.clone().read(name.clone(), LogStream::Out, out)),
            tokio::spawn(log.clone().read(name, LogStream::Err, err)),
        ];
        let (mark, program) = (start.mark.clone(), start.program.clone());
        Ok(Self { pid, child, readers, mark, control_group, reports, program })
    }

    /// Takes the launcher's end of the pipe on which it reports to the process, if there is one.
    pub fn take_reports(&mut self) -> Option<PipeWriter> {
        self.reports.take()
    }

    /// What signals go to.
    pub fn group(&self) -> ProcessGroup {
        ProcessGroup(self.pid)
    }

    /// Waits for the end of the process, and gives the readers of its output.
    pub async fn wait(mut self) -> (ChildExit, [JoinHandle<()>; 2]) {
        let exit = match self.child.wait().await {
            Ok(status) => match exit_of(status) {
                ChildExit::Code(GUARD_FAILED) => find_cause(&self.program),
                exit => exit,
            },
            // Waiting failed, so its exit code is unknown; it is restarted like one that failed.
            Err(_) => ChildExit::Code(-1),
        };
        // What it started itself must not outlive it.
        ProcessGroup(self.pid).kill();
        let (mark, control_group) = (self.mark, self.control_group);
        let killing = tokio::task::spawn_blocking(move || {
            kill_left_processes(control_group.as_ref(), &mark);
        });
        let _ = killing.await;
        (exit, self.readers)
    }
}

impl ProcessGroup {
    /// That of a process which was started in a group of its own.
    pub fn of(pid: Pid) -> Self {
        Self(pid)
    }

    /// Its process id.
    pub fn pid(self) -> u32 {
        self.0.as_raw_nonzero().get().unsigned_abs()
    }

    /// Asks the process to end. A stopped process is continued so that it can.
    pub fn terminate(self) {
        // It may have ended in this moment; then there is nothing to do.
        let _ = kill_process(self.0, Signal::TERM);
        let _ = kill_process(self.0, Signal::CONT);
    }

    /// Kills the process and all of its group.
    pub fn kill(self) {
        let _ = kill_process_group(self.0, Signal::KILL);
    }
}

/// Kills what a process that has ended has started and left: all that is in its control group, if it
/// has one, and what has its mark, such as a process that has entered another control group.
pub fn kill_left_processes(control_group: Option<&ProcessControlGroup>, mark: &str) {
    if let Some(control_group) = control_group {
        control_group.kill();
    }
    kill_survivors(mark);
}

/// Returns whether a signal or a debugger has stopped the process.
pub fn is_suspended(pid: u32) -> bool {
    matches!(read_state(pid), Some('T' | 't'))
}

/// Why a process that ended like a guard has: it cannot be started if its executable may not be
/// executed any more.
pub fn find_cause(program: &Path) -> ChildExit {
    match rustix::fs::access(program, rustix::fs::Access::EXEC_OK) {
        Ok(()) => ChildExit::Code(GUARD_FAILED),
        Err(error) => ChildExit::NotStarted(error.raw_os_error()),
    }
}

/// How a process has ended.
pub fn exit_of(status: ExitStatus) -> ChildExit {
    match (status.code(), status.signal()) {
        (Some(code), _) => ChildExit::Code(code),
        (None, Some(signal)) => ChildExit::Signal(signal),
        (None, None) => ChildExit::Code(-1),
    }
}

/// This program: the very file that runs, also after it was replaced by a newer build or removed.
pub const OWN_PROGRAM: &str = "/proc/self/exe";

/// Where this program is or was, for people who list processes.
pub fn own_path() -> PathBuf {
    let path = std::env::current_exe().unwrap_or_else(|_| "armor".into());
    match path.to_string_lossy().strip_suffix(" (deleted)") {
        Some(before) => before.into(),
        None => path,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_executable_that_is_gone_or_not_executable_is_the_cause() {
        let gone = find_cause(Path::new("/nowhere/component")).to_string();
        assert_eq!(gone, "cannot be started: No such file or directory (os error 2)");
        let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
        let not_executable = find_cause(Path::new(manifest)).to_string();
        assert_eq!(not_executable, "cannot be started: Permission denied (os error 13)");
        assert_eq!(find_cause(Path::new(OWN_PROGRAM)), ChildExit::Code(GUARD_FAILED));
    }
}
