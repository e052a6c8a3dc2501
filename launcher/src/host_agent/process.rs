//! One component's process on the agent's host: started under the guard, its output kept and sent to the
//! launcher, its end remembered until the launcher knows it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use armor_keys::connect::now_us;
use armor_socket::run_keys::{KEY_VARIABLE, read_key};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::remote_process::{
    CutOff, OutputStream, ProcessEnd, ProcessResources, REGISTRY_PORT, RemoteEvent, RemoteOrder,
    RemoteStart, VariableSetting,
};
use armor_wire::run_key::NameKey;
use parking_lot::Mutex;
use tokio::io::AsyncRead;
use tokio::process::{Child, Command};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;

use super::Agent;
use super::freezing::{FreezableProcess, freeze_while_cut_off};
use super::programs::FoundProgram;
use super::site::Site;
use crate::guard::{self, GuardedResources};
use crate::kinds::Origin;
use crate::run::control_group::ProcessControlGroup;
use crate::run::environment::select_variables;
use crate::run::logs::{LogStream, RunLog};
use crate::run::output_feed::open_feed;
use crate::run::own_run::START_VARIABLE;
use crate::run::process::{
    OWN_PROGRAM, ProcessGroup, exit_of, find_cause, kill_left_processes, own_path,
};
use crate::run::shared_read::read_once;
use crate::run::supervisor::{ChildExit, LogLevel};
use crate::run::survivors;

/// Events that wait for the connection to the launcher. Output beyond that is only in the log.
const MAX_EVENTS: usize = 128;
/// Longest piece of output that is read at a time.
const PIECE_LEN: usize = armor_keys::run_channel::MAX_OUTPUT_LEN;
/// With this code ends a guard that cannot become its program.
const GUARD_FAILED: i32 = 1;

/// A component of a system.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct ProcessKey {
    pub(super) system: String,
    pub(super) component: String,
}

/// A process, or the memory of one that has ended.
pub(super) struct AgentProcess {
    pub(super) key: ProcessKey,
    /// Its number at this agent.
    pub(super) id: u64,
    /// How it was started.
    start: RemoteStart,
    group: ProcessGroup,
    log: RunLog,
    log_path: PathBuf,
    /// What a person should know of it, such as that it is another build.
    notice: String,
    state: Mutex<ProcessState>,
    /// Whether a launcher is connected to it.
    attachment: watch::Sender<bool>,
    end: watch::Receiver<Option<ProcessEnd>>,
}

struct ProcessState {
    /// The start of the system that it belongs to.
    run: u64,
    cut_off: CutOff,
    /// An executive activates and freezes it.
    is_commanded: bool,
    /// Where it listens, since another host has connected to it.
    port: Option<u16>,
    /// The launcher's connection.
    events: Option<mpsc::Sender<RemoteEvent>>,
    /// Counts the connections.
    attached: u64,
    /// Bytes of output that no connection has taken.
    missed: u64,
    /// It is being ended because the launcher is cut off.
    was_cut_off: bool,
}

static LAST_ID: AtomicU64 = AtomicU64::new(0);

/// Starts the process of a component.
pub(super) async fn start(
    agent: &Arc<Agent>,
    site: &Arc<Site>,
    key: ProcessKey,
    start: &RemoteStart,
) -> Result<Arc<AgentProcess>, Refusal> {
    let refuse = |text: String| Refusal::new(RefusalCode::WrongPurpose, text);
    let FoundProgram { origin, notice } =
        agent.programs.find_program(start).await.map_err(refuse)?;
    let resources = read_resources(&start.resources).map_err(refuse)?;
    let registry = format!("{}:{REGISTRY_PORT}", agent.arguments.from);
    let mut arguments: Vec<OsString> =
        ["--name", &start.component, "--registry", &registry].map(OsString::from).to_vec();
    let program = match &origin {
        Origin::Stock => {
            arguments.splice(0..0, ["component".into(), (&start.kind).into()]);
            OWN_PROGRAM.into()
        }
        Origin::Executable(path) => path.clone(),
    };
    let mark = format!("{}{}/{}/", agent.mark, key.system, key.component);
    let group = format!("{}:{}", key.system, key.component);
    let control_group = agent.control_group.as_ref().and_then(|all| all.make_for(&group).ok());
    let entered = control_group.as_ref().map(ProcessControlGroup::path);
    let keys = agent.arguments.directory.variable();
    let variables = list_variables(site, start, &mark, keys);
    let mut child = spawn(&program, &arguments, entered, &resources, variables)
        .map_err(|error| refuse(format!("a process cannot be started: {error:#}")))?;
    let pid = child.id().and_then(|pid| i32::try_from(pid).ok());
    let group = pid.and_then(rustix::process::Pid::from_raw).map(ProcessGroup::of);
    let (Some(group), Some(out), Some(err)) = (group, child.stdout.take(), child.stderr.take())
    else {
        return Err(refuse("the process has ended while it was started".into()));
    };
    agent.group_killers.lock().add_group(group);
    let (sender, end) = watch::channel(None);
    let process = Arc::new(AgentProcess {
        log_path: site.folder.join("logs").join(format!("{}.log", key.component)),
        key,
        id: LAST_ID.fetch_add(1, Ordering::Relaxed) + 1,
        start: start.clone(),
        group,
        log: site.log.clone(),
        notice,
        state: Mutex::new(ProcessState {
            run: start.run,
            cut_off: start.cut_off,
            is_commanded: start.is_commanded,
            port: None,
            events: None,
            attached: 0,
            missed: 0,
            was_cut_off: false,
        }),
        attachment: watch::Sender::new(false),
        end,
    });
    process.report(LogLevel::Info, format!("started as process {}", group.pid()));
    let readers = [
        tokio::spawn(Arc::clone(&process).pass_on(OutputStream::Out, out)),
        tokio::spawn(Arc::clone(&process).pass_on(OutputStream::Error, err)),
    ];
    tokio::spawn(watch_end(
        Arc::clone(agent),
        Arc::clone(&process),
        child,
        program,
        LeftBehind { mark, control_group },
        readers,
        sender,
    ));
    Ok(process)
}

impl AgentProcess {
    pub(super) fn is_alive(&self) -> bool {
        self.end.borrow().is_none()
    }

    /// Whether a launcher is connected to it.
    pub(super) fn is_attached(&self) -> bool {
        self.state.lock().events.is_some()
    }

    /// Whether it was started as `start` asks.
    pub(super) fn fits(&self, start: &RemoteStart) -> bool {
        let RemoteStart { kind, manifest, build, variables, settings, resources, .. } = start;
        let own = &self.start;
        // Which start it is differs from one to the next.
        let lasting = |setting: &&VariableSetting| setting.name != START_VARIABLE;
        (kind, manifest, build) == (&own.kind, &own.manifest, &own.build)
            && (variables, resources) == (&own.variables, &own.resources)
            && settings.iter().filter(lasting).eq(own.settings.iter().filter(lasting))
    }

    pub(super) fn run(&self) -> u64 {
        self.state.lock().run
    }

    /// Continues under another start of its system, or after a cut.
    pub(super) fn adopt(&self, start: &RemoteStart) {
        let mut state = self.state.lock();
        (state.run, state.cut_off) = (start.run, start.cut_off);
        state.is_commanded = start.is_commanded;
    }

    pub(super) fn set_port(&self, port: u16) {
        self.state.lock().port = Some(port);
    }

    pub(super) fn obey(&self, order: RemoteOrder) {
        match order {
            RemoteOrder::Terminate => self.terminate(),
            RemoteOrder::Kill => self.kill(),
            RemoteOrder::Clock { asked_us } => {
                let event = RemoteEvent::Clock { asked_us, answered_us: now_us() };
                let state = self.state.lock();
                // Without room it is asked again.
                let _ = state.events.as_ref().map(|events| events.try_send(event));
            }
        }
    }

    pub(super) fn terminate(&self) {
        if self.is_alive() {
            self.group.terminate();
        }
    }

    pub(super) fn kill(&self) {
        if self.is_alive() {
            self.group.kill();
        }
    }

    pub(super) async fn wait_for_end(&self) -> ProcessEnd {
        let mut end = self.end.clone();
        let ended = end.wait_for(Option::is_some).await;
        ended.ok().and_then(|end| *end).unwrap_or(ProcessEnd::CutOff)
    }

    /// Sends what happens from here on to a new connection, which replaces an older one.
    pub(super) fn attach(self: &Arc<Self>) -> (u64, mpsc::Receiver<RemoteEvent>) {
        let (sender, events) = mpsc::channel(MAX_EVENTS);
        let mut state = self.state.lock();
        let is_taken_over = state.attached > 0;
        state.attached += 1;
        let (pid, notice) = (self.group.pid(), self.notice.clone());
        let running = RemoteEvent::Running { process: self.id, pid, is_taken_over, notice };
        let _ = sender.try_send(running);
        state.events = Some(sender.clone());
        self.attachment.send_replace(true);
        self.report_missed(&mut state);
        let attached = state.attached;
        drop(state);
        let process = Arc::clone(self);
        tokio::spawn(async move {
            let end = tokio::select! {
                end = process.wait_for_end() => end,
                // The connection has ended before.
                () = sender.closed() => return,
            };
            let _ = sender.send(RemoteEvent::Ended { end }).await;
            process.detach(attached);
        });
        (attached, events)
    }

    /// Sends nothing more to the connection, unless a newer one has replaced it.
    pub(super) fn detach(&self, attached: u64) {
        let mut state = self.state.lock();
        if state.attached == attached {
            state.events = None;
            self.attachment.send_replace(false);
        }
    }

    /// Counts the output that waited for a connection which has ended.
    pub(super) fn count_unsent(&self, events: &mut mpsc::Receiver<RemoteEvent>) {
        while let Ok(event) = events.try_recv() {
            if let RemoteEvent::Output { bytes, .. } = event {
                self.state.lock().missed += bytes.len() as u64;
            }
        }
    }

    /// The launcher is cut off, or has died.
    pub(super) fn handle_cut(self: &Arc<Self>, launcher: &str, why: &str) {
        if !self.is_alive() || self.state.lock().events.is_some() {
            return;
        }
        let cut_off = self.state.lock().cut_off;
        let what = match cut_off {
            CutOff::Continue => "it continues",
            CutOff::Stop => "it is ended",
            CutOff::Safe => "it is frozen",
        };
        self.report(LogLevel::Warn, format!("{launcher} is cut off ({why}); {what}"));
        match cut_off {
            CutOff::Continue => {}
            CutOff::Stop => self.end_for_cut(),
            CutOff::Safe => {
                tokio::spawn(freeze_while_cut_off(Arc::clone(self), launcher.to_owned()));
            }
        }
    }

    fn end_for_cut(&self) {
        self.state.lock().was_cut_off = true;
        self.terminate();
        let (group, mut end) = (self.group, self.end.clone());
        tokio::spawn(async move {
            let ended = end.wait_for(Option::is_some);
            if tokio::time::timeout(super::GRACE, ended).await.is_err() {
                group.kill();
            }
        });
    }

    /// Reports the output that was not sent, if there is some, and room for the report.
    fn report_missed(&self, state: &mut ProcessState) {
        let bytes = state.missed;
        let file = || self.log_path.display().to_string();
        let report = || RemoteEvent::Missed { bytes, file: file() };
        if bytes > 0 && state.events.as_ref().is_some_and(|it| it.try_send(report()).is_ok()) {
            state.missed = 0;
        }
    }

    fn report(&self, level: LogLevel, text: String) {
        self.log.report(&self.key.component, level, text);
    }

    /// Reads the process's output into the log, and sends it to the launcher as far as it keeps up.
    async fn pass_on(self: Arc<Self>, stream: OutputStream, mut source: impl AsyncRead + Unpin) {
        let (feed, output) = open_feed();
        let log_stream = match stream {
            OutputStream::Out => LogStream::Out,
            OutputStream::Error => LogStream::Err,
        };
        let name = self.key.component.as_str().into();
        let reader = tokio::spawn(self.log.clone().read(name, log_stream, output));
        while let Ok(piece) = read_once(&mut source, PIECE_LEN, <[u8]>::to_vec).await {
            if piece.is_empty() {
                break;
            }
            let len = piece.len();
            // The log limits floods itself, and counts what it leaves out.
            feed.add(piece.clone()).await;
            let mut state = self.state.lock();
            self.report_missed(&mut state);
            let event = RemoteEvent::Output { stream, bytes: piece };
            let is_sent = state.events.as_ref().is_some_and(|it| it.try_send(event).is_ok());
            if !is_sent {
                state.missed += len as u64;
            }
        }
        drop(feed);
        let _ = reader.await;
    }
}

impl FreezableProcess for AgentProcess {
    fn key(&self) -> Option<NameKey> {
        let set = self.start.settings.iter().find(|setting| setting.name == KEY_VARIABLE)?;
        read_key(&set.value, &self.key.component)
    }

    fn port(&self) -> Option<u16> {
        self.state.lock().port
    }

    fn is_alive(&self) -> bool {
        Self::is_alive(self)
    }

    fn is_commanded(&self) -> bool {
        self.state.lock().is_commanded
    }

    fn report(&self, level: LogLevel, text: String) {
        Self::report(self, level, text);
    }

    fn kill_for_cut(&self) {
        self.state.lock().was_cut_off = true;
        self.kill();
    }

    async fn wait_for_launcher(&self) {
        let mut attachment = self.attachment.subscribe();
        // The sender lives as long as this.
        let _ = attachment.wait_for(|is_attached| *is_attached).await;
    }
}

/// By what the processes are found that one has started.
struct LeftBehind {
    mark: String,
    control_group: Option<ProcessControlGroup>,
}

/// Waits for the end of the process, and ends what it has started.
async fn watch_end(
    agent: Arc<Agent>,
    process: Arc<AgentProcess>,
    mut child: Child,
    program: PathBuf,
    left: LeftBehind,
    readers: [JoinHandle<()>; 2],
    end: watch::Sender<Option<ProcessEnd>>,
) {
    let exit = match child.wait().await {
        Ok(status) => match exit_of(status) {
            ChildExit::Code(GUARD_FAILED) => find_cause(&program),
            exit => exit,
        },
        Err(_) => ChildExit::Code(-1),
    };
    // Not an end of its own, after which it might stay down.
    let exit = if process.state.lock().was_cut_off { ChildExit::CutOff } else { exit };
    process.group.kill();
    let killing = tokio::task::spawn_blocking(move || {
        kill_left_processes(left.control_group.as_ref(), &left.mark);
    });
    let _ = killing.await;
    let last = async {
        for reader in readers {
            let _ = reader.await;
        }
    };
    let _ = tokio::time::timeout(super::GRACE, last).await;
    process.report(LogLevel::Info, exit.to_string());
    agent.group_killers.lock().remove_group(process.group);
    let _ = end.send(Some(match exit {
        ChildExit::Code(code) => ProcessEnd::Code { code },
        ChildExit::Signal(signal) => ProcessEnd::Signal { signal },
        ChildExit::NotStarted(error) => ProcessEnd::NotStarted { error },
        ChildExit::CutOff | ChildExit::WithAgent => ProcessEnd::CutOff,
    }));
}

/// Checks what the process may use against what this host can grant.
fn read_resources(wanted: &ProcessResources) -> Result<GuardedResources, String> {
    let resources = GuardedResources {
        nice: wanted.nice,
        realtime: wanted.realtime,
        cpus: wanted.cpus.iter().map(|cpu| *cpu as usize).collect(),
        cpu_permille: wanted.cpu_permille,
        memory: wanted.memory,
    };
    let obstacle = resources
        .refuse_nice()
        .or_else(|| resources.refuse_realtime())
        .or_else(|| resources.refuse_cpus())
        .or_else(|| resources.refuse_cpu());
    obstacle.map_or(Ok(resources), Err)
}

fn list_variables(
    site: &Site,
    start: &RemoteStart,
    mark: &str,
    keys: Option<(OsString, OsString)>,
) -> Vec<(OsString, OsString)> {
    let mut variables = select_variables(std::env::vars_os(), &start.variables);
    let settings =
        start.settings.iter().map(|setting| (setting.name.clone(), setting.value.clone()));
    let place = site.place.list_variables().map(|(name, value)| (name.to_owned(), value));
    for (name, value) in settings.chain(place) {
        variables.retain(|(known, _)| *known != *name);
        variables.push((name.into(), value.into()));
    }
    if let Some((name, folder)) = keys {
        // That of this host: the launcher does not know its folders.
        variables.retain(|(known, _)| *known != name);
        variables.push((name, folder));
    }
    variables.push(("ARMOR_OUT".into(), site.folder.clone().into()));
    variables.push((survivors::VARIABLE.into(), mark.into()));
    variables
}

fn spawn(
    program: &Path,
    arguments: &[OsString],
    control_group: Option<&Path>,
    resources: &GuardedResources,
    variables: Vec<(OsString, OsString)>,
) -> std::io::Result<Child> {
    let program = program.as_os_str().to_owned();
    Command::new(OWN_PROGRAM)
        .arg0(own_path())
        .args(guard::list_arguments(
            std::process::id(),
            control_group,
            resources,
            &program,
            arguments,
        ))
        .env_clear()
        .envs(variables)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .process_group(0)
        .spawn()
}
