//! `armor run FILE`, `armor play FILE` or `armor mission rehearse FILE` as a child process: starts it, reads its output, stops it in order. It ends
//! when this process ends, whatever the reason.

use std::io::{self, BufRead, BufReader, Read};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::Duration;

use parking_lot::Mutex;
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use thiserror::Error;

use crate::log::{LogLine, RunLog};
use crate::systems::{self, RunRecord};
use crate::wake::WakeCallback;

/// Time that a run has to stop in order before it is killed.
pub const STOP_WITHIN: Duration = Duration::from_secs(10);
/// Time between two checks whether the run has written its record.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// What to run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LaunchPlan {
    /// The `armor` program.
    pub program: PathBuf,
    /// What it does with the file.
    pub verb: LaunchVerb,
    /// The system or mission file, or the recording.
    pub file: PathBuf,
    /// The folder for what the run produces; by default `out/NAME` in the current one.
    pub out: Option<PathBuf>,
    /// Component directories.
    pub components: Vec<PathBuf>,
    /// Further arguments.
    pub arguments: Vec<String>,
}

/// What `armor` does with a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LaunchVerb {
    /// It runs a system.
    #[default]
    Run,
    /// It plays a recording.
    Play,
    /// It rehearses a mission; no system is to be watched.
    Rehearse,
}

/// Why a run could not be started.
#[derive(Debug, Error)]
pub enum LaunchError {
    /// No `armor` program is known.
    #[error(
        "the program `armor` was not found: it is looked for as $ARMOR, next to this program and in \
         $PATH; build it with `cargo build --release`, or set ARMOR"
    )]
    NoProgram,
    /// It could not be started.
    #[error("{} cannot be started: {error}", program.display())]
    Start {
        /// The program.
        program: PathBuf,
        /// Why.
        error: io::Error,
    },
}

/// The stage of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum RunStage {
    /// It checks the file and starts.
    Starting,
    /// It runs and has written its record.
    Running(RunRecord),
    /// It was asked to stop.
    Stopping,
    /// It has ended.
    Ended {
        /// How it ended, as text.
        how: String,
        /// Whether it ended well.
        is_fine: bool,
    },
}

/// A run started by this process. When dropped, it is stopped in order, and killed if that takes
/// too long.
pub struct ChildRun {
    shared: Arc<SharedRun>,
    over: Receiver<()>,
}

struct SharedRun {
    state: Mutex<RunProgress>,
    wake: WakeCallback,
}

struct RunProgress {
    stage: RunStage,
    /// A handle instead of a process id: no signal can reach another process that got the same id.
    process: Option<OwnedFd>,
    asked: u32,
    end: Option<String>,
}

impl ChildRun {
    /// Starts a run; its output goes to `log`, and `wake` is called when something has changed.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn start(plan: &LaunchPlan, log: RunLog, wake: WakeCallback) -> Result<Self, LaunchError> {
        let state = RunProgress { stage: RunStage::Starting, process: None, asked: 0, end: None };
        let shared = Arc::new(SharedRun { state: Mutex::new(state), wake });
        let (started, has_started) = mpsc::channel();
        let (ended, over) = mpsc::channel();
        let keeper = RunThread { shared: Arc::clone(&shared), log };
        let failed = |error| LaunchError::Start { program: plan.program.clone(), error };
        let of_keeper = plan.clone();
        // The kernel kills the run when the thread that started it ends, so that thread stays.
        thread::Builder::new()
            .name("run".into())
            .spawn(move || {
                keeper.keep_run(&of_keeper, &started);
                drop(ended);
            })
            .map_err(failed)?;
        let lost = || io::Error::other("the thread that starts it has ended");
        has_started.recv().unwrap_or_else(|_| Err(lost())).map_err(failed)?;
        Ok(Self { shared, over })
    }

    /// Returns its stage.
    pub fn stage(&self) -> RunStage {
        self.shared.state.lock().stage.clone()
    }

    /// Asks it to stop in order; a second request makes it kill the processes that still run.
    pub fn stop(&self) {
        let mut state = self.shared.state.lock();
        if let Some(process) = &state.process {
            // Fails if it has ended already, which `end` is about to report.
            let _ = pidfd_send_signal(process, Signal::INT);
            state.asked += 1;
            state.stage = RunStage::Stopping;
        }
    }

    /// Returns how many times it was asked to stop.
    pub fn times_asked(&self) -> u32 {
        self.shared.state.lock().asked
    }

    /// Kills it and every process that it has started.
    pub fn kill(&self) {
        if let Some(process) = &self.shared.state.lock().process {
            let _ = pidfd_send_signal(process, Signal::KILL);
        }
    }

    /// Returns whether it has ended.
    pub fn has_ended(&self) -> bool {
        matches!(self.shared.state.lock().stage, RunStage::Ended { .. })
    }

    /// Waits for its end; returns whether it ended in time.
    fn wait_for_end(&self, within: Duration) -> bool {
        self.over.recv_timeout(within) == Err(mpsc::RecvTimeoutError::Disconnected)
    }
}

impl Drop for ChildRun {
    fn drop(&mut self) {
        if self.has_ended() {
            return;
        }
        self.stop();
        if !self.wait_for_end(STOP_WITHIN) {
            self.kill();
            self.wait_for_end(STOP_WITHIN);
        }
    }
}

impl SharedRun {
    fn change_progress(&self, change: impl FnOnce(&mut RunProgress)) {
        change(&mut self.state.lock());
        (self.wake)();
    }
}

/// The thread that starts the run and stays with it.
struct RunThread {
    shared: Arc<SharedRun>,
    log: RunLog,
}

impl RunThread {
    fn keep_run(self, plan: &LaunchPlan, started: &mpsc::Sender<io::Result<()>>) {
        let mut child = match guarded_command(plan).spawn() {
            Ok(child) => child,
            Err(error) => {
                // `start` waits for this message.
                let _ = started.send(Err(error));
                return;
            }
        };
        let pid = child.id();
        let handle = Pid::from_raw(i32::try_from(pid).unwrap_or_default())
            .ok_or(rustix::io::Errno::SRCH)
            .and_then(|pid| pidfd_open(pid, PidfdFlags::empty()));
        match handle {
            Ok(handle) => self.shared.state.lock().process = Some(handle),
            Err(error) => {
                // A process that could not be stopped later must not run.
                let _ = child.kill();
                let _ = child.wait();
                let _ = started.send(Err(error.into()));
                return;
            }
        }
        let _ = started.send(Ok(()));
        let stdout = child.stdout.take();
        let stderr = child.stderr.take();
        let status = thread::scope(|scope| {
            scope.spawn(|| self.read_output(stdout, LogLine::of_json));
            scope.spawn(|| self.read_output(stderr, |text| LogLine::own_line("armor", "", text)));
            if plan.verb != LaunchVerb::Rehearse {
                scope.spawn(|| self.await_record(pid));
            }
            let status = child.wait();
            self.shared.state.lock().process = None;
            status
        });
        // After the last line of its output.
        self.report_end(status);
    }

    fn read_output(&self, source: Option<impl Read>, read: impl Fn(&str) -> LogLine) {
        let Some(source) = source else { return };
        for line in BufReader::new(source).split(b'\n') {
            let Ok(line) = line else { return };
            let text = String::from_utf8_lossy(&line);
            let line = read(&text);
            if line.name == "launcher"
                && let Some(how) = line.text.strip_prefix("ended: ")
            {
                self.shared.state.lock().end = Some(how.into());
            }
            self.log.push(line);
            (self.shared.wake)();
        }
    }

    /// Waits until the run has written its record, or has ended.
    fn await_record(&self, pid: u32) {
        while self.shared.state.lock().process.is_some() {
            if let Some(record) = record_of(pid) {
                self.shared.change_progress(|state| {
                    if state.stage == RunStage::Starting {
                        state.stage = RunStage::Running(record);
                    }
                });
                return;
            }
            thread::sleep(LOOK_EVERY);
        }
    }

    fn report_end(&self, status: io::Result<std::process::ExitStatus>) {
        let (how, is_fine) = match status {
            Ok(status) => match status.code() {
                Some(0) => ("it ended".to_owned(), true),
                // Ctrl-C, and `armor stop --all` in the course of a mission.
                Some(130 | 3) => ("stopped".to_owned(), true),
                Some(code) => {
                    (format!("it ended with exit code {code}; the log states the reason"), false)
                }
                None => (format!("it was killed ({status})"), false),
            },
            Err(error) => (format!("how it ended is unknown: {error}"), false),
        };
        self.shared.change_progress(|state| {
            // The run's own report, unless it was asked to stop.
            let how = state.end.take().filter(|_| state.asked == 0).unwrap_or(how);
            state.stage = RunStage::Ended { how, is_fine };
        });
    }
}

fn record_of(pid: u32) -> Option<RunRecord> {
    let records = systems::list_running(&systems::record_directory().ok()?).ok()?;
    records.into_iter().find(|record| record.pid == pid)
}

/// Returns the command of the run, under the guard that ends it with this process.
fn guarded_command(plan: &LaunchPlan) -> Command {
    let mut command = Command::new(&plan.program);
    command.args(["guard", &std::process::id().to_string(), "--"]).arg(&plan.program);
    let verb: &[&str] = match plan.verb {
        LaunchVerb::Run => &["run"],
        LaunchVerb::Play => &["play"],
        LaunchVerb::Rehearse => &["mission", "rehearse"],
    };
    command.args(verb).args(["--format", "json"]).args(&plan.arguments);
    for directory in &plan.components {
        command.arg("--components").arg(directory);
    }
    if let Some(out) = &plan.out {
        command.arg("--out").arg(out);
    }
    command.arg(&plan.file).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}
