//! Processes: started under the guard, read line by line, killed with their whole group.

use std::ffi::OsString;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;

use anyhow::{Context, Result};
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use tokio::process::{Child, Command};
use tokio::task::JoinHandle;

use super::logs::{LogStream, RunLog};
use super::supervisor::ChildExit;
use crate::guard;

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
}

/// A process that was started.
#[derive(Debug)]
pub struct ChildProcess {
    pid: Pid,
    child: Child,
    readers: [JoinHandle<()>; 2],
}

/// A process group, which signals are sent to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessGroup(Pid);

impl ChildProcess {
    /// Starts a process. Must be called on the main thread: the kernel kills the process when the
    /// thread that started it ends.
    ///
    /// # Errors
    /// If the guard cannot be started; an executable that cannot be started ends with code 1.
    pub fn start(start: &ProcessStart, log: &RunLog) -> Result<Self> {
        let program = start.program.clone().into_os_string();
        let mut child = Command::new(own_program())
            .args(guard::list_arguments(std::process::id(), &program, &start.arguments))
            .env_clear()
            .envs(start.environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
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
        Ok(Self { pid, child, readers })
    }

    /// What signals go to.
    pub fn group(&self) -> ProcessGroup {
        ProcessGroup(self.pid)
    }

    /// Waits for the end of the process, and gives the readers of its output.
    pub async fn wait(mut self) -> (ChildExit, [JoinHandle<()>; 2]) {
        let exit = match self.child.wait().await {
            Ok(status) => exit_of(status),
            // Waiting failed, so its exit code is unknown; it is restarted like one that failed.
            Err(_) => ChildExit::Code(-1),
        };
        // What it started itself must not outlive it.
        self.group().kill();
        (exit, self.readers)
    }
}

impl ProcessGroup {
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

fn exit_of(status: ExitStatus) -> ChildExit {
    match (status.code(), status.signal()) {
        (Some(code), _) => ChildExit::Code(code),
        (None, Some(signal)) => ChildExit::Signal(signal),
        (None, None) => ChildExit::Code(-1),
    }
}

/// This program, also after its file was replaced by a newer build.
pub fn own_program() -> PathBuf {
    std::env::current_exe()
        .ok()
        .filter(|path| path.exists())
        .unwrap_or_else(|| PathBuf::from("/proc/self/exe"))
}
