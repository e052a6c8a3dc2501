//! `armor run FILE` as a process of this one: started, listened to, stopped in order, and gone when
//! this one is, however that ends.

use std::io::{self, BufRead, BufReader, Read};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use thiserror::Error;

use crate::Wake;
use crate::log::{Line, Log};
use crate::systems::{self, Record};

/// How long a run is given to stop in order before it is killed when this process ends.
pub const STOP_WITHIN: Duration = Duration::from_secs(10);
/// How often to look whether the run has made itself known.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// What is to be run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// The `armor` program.
    pub program: PathBuf,
    /// The system or mission file.
    pub file: PathBuf,
    /// The folder for what the run produces; by default `out/NAME` in the current one.
    pub out: Option<PathBuf>,
    /// Component directories.
    pub components: Vec<PathBuf>,
    /// Further arguments of `armor run`.
    pub arguments: Vec<String>,
}

/// Why a run could not be started.
#[derive(Debug, Error)]
pub enum LaunchError {
    /// No `armor` program is known.
    #[error(
        "the program `armor` was not found: it is looked for as $ARMOR, beside this program and in \
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

/// How far a run has come.
#[derive(Clone, Debug, PartialEq)]
pub enum Stage {
    /// It checks the file and starts.
    Starting,
    /// It runs, and can be found.
    Running(Record),
    /// It was asked to stop.
    Stopping,
    /// It has ended, with this in words, and whether that is well.
    Ended {
        /// How.
        how: String,
        /// Whether it ended well.
        is_fine: bool,
    },
}

/// A run of this process. Dropped, it is stopped in order, and killed if it takes too long.
pub struct Run {
    shared: Arc<Shared>,
    over: Receiver<()>,
}

struct Shared {
    state: Mutex<State>,
    wake: Wake,
}

struct State {
    stage: Stage,
    /// By its handle no signal can reach another process that has got its number.
    process: Option<OwnedFd>,
    asked: u32,
    end: Option<String>,
}

impl Run {
    /// Starts it; what it says goes to `log`, and `wake` is called when something has changed.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn start(plan: &Plan, log: Log, wake: Wake) -> Result<Self, LaunchError> {
        let state = State { stage: Stage::Starting, process: None, asked: 0, end: None };
        let shared = Arc::new(Shared { state: Mutex::new(state), wake });
        let (started, has_started) = mpsc::channel();
        let (ended, over) = mpsc::channel();
        let keeper = Keeper { shared: Arc::clone(&shared), log };
        let failed = |error| LaunchError::Start { program: plan.program.clone(), error };
        let of_keeper = plan.clone();
        // The kernel kills the run when the thread that started it ends: that one stays to the end.
        thread::Builder::new()
            .name("run".into())
            .spawn(move || {
                keeper.keep(&of_keeper, &started);
                drop(ended);
            })
            .map_err(failed)?;
        let lost = || io::Error::other("the thread that starts it has ended");
        has_started.recv().unwrap_or_else(|_| Err(lost())).map_err(failed)?;
        Ok(Self { shared, over })
    }

    /// How far it has come.
    pub fn stage(&self) -> Stage {
        self.shared.lock().stage.clone()
    }

    /// Asks it to stop in order; asked again, it kills what has not stopped yet.
    pub fn stop(&self) {
        let mut state = self.shared.lock();
        if let Some(process) = &state.process {
            // Gone already: its end is on the way here.
            let _ = pidfd_send_signal(process, Signal::INT);
            state.asked += 1;
            state.stage = Stage::Stopping;
        }
    }

    /// How often it was asked to stop.
    pub fn times_asked(&self) -> u32 {
        self.shared.lock().asked
    }

    /// Kills it, and with it everything that it has started.
    pub fn kill(&self) {
        if let Some(process) = &self.shared.lock().process {
            let _ = pidfd_send_signal(process, Signal::KILL);
        }
    }

    /// Whether it has ended.
    pub fn has_ended(&self) -> bool {
        matches!(self.shared.lock().stage, Stage::Ended { .. })
    }

    /// Waits for its end.
    fn wait(&self, within: Duration) -> bool {
        self.over.recv_timeout(within) == Err(mpsc::RecvTimeoutError::Disconnected)
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        if self.has_ended() {
            return;
        }
        self.stop();
        if !self.wait(STOP_WITHIN) {
            self.kill();
            self.wait(STOP_WITHIN);
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        (self.wake)();
    }
}

/// The thread that starts the run and stays with it.
struct Keeper {
    shared: Arc<Shared>,
    log: Log,
}

impl Keeper {
    fn keep(self, plan: &Plan, started: &mpsc::Sender<io::Result<()>>) {
        let mut child = match command(plan).spawn() {
            Ok(child) => child,
            Err(error) => {
                // Who asked waits for this answer.
                let _ = started.send(Err(error));
                return;
            }
        };
        let pid = child.id();
        let handle = Pid::from_raw(i32::try_from(pid).unwrap_or_default())
            .ok_or(rustix::io::Errno::SRCH)
            .and_then(|pid| pidfd_open(pid, PidfdFlags::empty()));
        match handle {
            Ok(handle) => self.shared.lock().process = Some(handle),
            Err(error) => {
                // What cannot be stopped is not run.
                let _ = child.kill();
                let _ = child.wait();
                let _ = started.send(Err(error.into()));
                return;
            }
        }
        let _ = started.send(Ok(()));
        let said = child.stdout.take();
        let complained = child.stderr.take();
        let status = thread::scope(|scope| {
            scope.spawn(|| self.listen(said, Line::of_json));
            scope.spawn(|| self.listen(complained, |text| Line::said("armor", "", text)));
            scope.spawn(|| self.await_record(pid));
            let status = child.wait();
            self.shared.lock().process = None;
            status
        });
        // After its last words.
        self.end(status);
    }

    fn listen(&self, source: Option<impl Read>, read: impl Fn(&str) -> Line) {
        let Some(source) = source else { return };
        for line in BufReader::new(source).split(b'\n') {
            let Ok(line) = line else { return };
            let text = String::from_utf8_lossy(&line);
            let line = read(&text);
            if line.name == "launcher"
                && let Some(how) = line.text.strip_prefix("ended: ")
            {
                self.shared.lock().end = Some(how.into());
            }
            self.log.push(line);
            (self.shared.wake)();
        }
    }

    /// Waits until the run has made itself known, or has ended.
    fn await_record(&self, pid: u32) {
        while self.shared.lock().process.is_some() {
            if let Some(record) = record_of(pid) {
                self.shared.change(|state| {
                    if state.stage == Stage::Starting {
                        state.stage = Stage::Running(record);
                    }
                });
                return;
            }
            thread::sleep(LOOK_EVERY);
        }
    }

    fn end(&self, status: io::Result<std::process::ExitStatus>) {
        let (how, is_fine) = match status {
            Ok(status) => match status.code() {
                Some(0) => ("it has ended".to_owned(), true),
                Some(130) => ("stopped".to_owned(), true),
                Some(code) => (format!("it has ended with code {code}; the log says why"), false),
                None => (format!("it was killed ({status})"), false),
            },
            Err(error) => (format!("its end is not known: {error}"), false),
        };
        self.shared.change(|state| {
            // Its own words, where it had the time for any.
            let how = state.end.take().filter(|_| state.asked == 0).unwrap_or(how);
            state.stage = Stage::Ended { how, is_fine };
        });
    }
}

fn record_of(pid: u32) -> Option<Record> {
    let records = systems::running(&systems::directory().ok()?).ok()?;
    records.into_iter().find(|record| record.pid == pid)
}

/// The run under the guard that ends with this process.
fn command(plan: &Plan) -> Command {
    let mut command = Command::new(&plan.program);
    command.args(["guard", &std::process::id().to_string(), "--"]).arg(&plan.program);
    command.args(["run", "--format", "json"]).args(&plan.arguments);
    for directory in &plan.components {
        command.arg("--components").arg(directory);
    }
    if let Some(out) = &plan.out {
        command.arg("--out").arg(out);
    }
    command.arg(&plan.file).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}
