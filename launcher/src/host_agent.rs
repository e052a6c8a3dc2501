//! `armor host`: the agent of a host. It runs components of systems that were started on another host,
//! watches their processes, and carries the connections between them and the other hosts.
//!
//! The launcher of the system decides what runs; the agent only carries it out, so that there is one
//! place where restarts are counted and nothing runs twice. It keeps a process over a cut of the
//! connection if the file specifies that.

mod executables;
mod freezing;
mod idle_systems;
mod process;
mod programs;
mod reach;
mod site;

use std::collections::HashMap;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_keys::HostKeys;
use armor_keys::discovery::Announcement;
use armor_keys::gate::{self, GateLimits, GateOptions, HostExaminer, RunOrder};
use armor_keys::run_channel::RunChannel;
use armor_wire::gate::GATE_PORT;
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::name::is_name;
use armor_wire::remote_process::{ProcessEnd, RemoteEvent, RemoteStart, Takeover};
use clap::Args;
use parking_lot::Mutex;
use tokio::sync::mpsc;

use crate::arguments::{KindFolders, OutputFormat, parse_name};
use crate::daemon::serving::serve_until_signal;
use crate::doctor::examine_own_host;
use crate::keys_cli::KeysDirectory;
use crate::run::control_group::{ControlGroup, kill_left_groups};
use crate::run::descriptors;
use crate::run::group_killer::GroupKillers;
use crate::run::survivors::{self, kill_left_processes};
use crate::verb::Verb;
use executables::ExecutableStore;
use idle_systems::IdleSystems;
use process::{AgentProcess, ProcessKey};
use programs::{ProgramFinder, SearchThread};
use reach::AgentReach;
use site::Site;

/// What an agent has open besides its connections, with room to spare.
const DESCRIPTORS: usize = 256;
/// Requests that wait to be carried out.
const MAX_REQUESTS: usize = 64;
/// Period with which the group killers are looked at.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Why a request is refused that no launcher sends.
const NO_NAME: &str = "a name in the request is not one";
/// How long processes have to end when the agent ends.
const GRACE: Duration = Duration::from_secs(5);

/// Run components of systems that are started on another host.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  armor host --from robot              on the host that the file of robot's system names
  armor host --from robot --announce   and for at=mdns in the file, in place of an address

The folder of keys holds the key of this host (`armor keys add NAME --role host`) and the list of
revoked keys. NAME is the name of the host in the file.")]
pub struct HostArguments {
    /// The host whose systems may run components here, as its key names it.
    #[arg(long, value_name = "HOST", value_parser = parse_name)]
    pub from: String,
    /// Where it listens.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = default_listen())]
    pub listen: SocketAddr,
    /// Announce it on the local network by multicast DNS, for `at="mdns"` in the file.
    #[arg(long)]
    pub announce: bool,
    #[command(flatten)]
    pub directory: KeysDirectory,
    #[command(flatten)]
    pub kinds: KindFolders,
    /// Folder for what the components produce and for their logs: a folder in it for each system.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Accept executables from that host, if a kind is missing here or is another build: it may then
    /// run any program as this user.
    #[arg(long)]
    pub accept_executables: bool,
}

fn default_listen() -> SocketAddr {
    ([0, 0, 0, 0], GATE_PORT).into()
}

impl Verb for HostArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        armor_sdk::log::init();
        let limits = GateLimits::of_hosts();
        descriptors::raise_limit((2 * limits.sessions + limits.strangers + DESCRIPTORS) as u64)?;
        let keys = HostKeys::read(&self.directory.path()?)?;
        let mark = survivors::make_mark();
        let accepts = self.accept_executables;
        let executables = accepts.then(|| ExecutableStore::open(&self.out)).transpose()?;
        let programs = ProgramFinder {
            directories: self.kinds.directories.clone(),
            executables,
            host: keys.host_name().to_owned(),
            from: self.from.clone(),
            searches: SearchThread::start().context("starting the search for programs")?,
        };
        let control_group = ControlGroup::make().ok();
        let left = kill_left_groups() + kill_left_processes();
        if left > 0 {
            tracing::warn!(left, "processes that killed agents or runs have left were ended");
        }
        let agent = Arc::new(Agent {
            group_killers: Mutex::new(GroupKillers::start(&mark, control_group.as_ref())?),
            control_group,
            mark,
            keys: keys.clone(),
            programs: Arc::new(programs),
            arguments: self,
            format,
            sites: Mutex::default(),
            processes: Mutex::default(),
            starting: tokio::sync::Mutex::default(),
        });
        let listen = agent.arguments.listen;
        let (sender, orders) = mpsc::channel(MAX_REQUESTS);
        let reach = Arc::new(AgentReach::new(&agent));
        let examined = Arc::clone(&agent);
        let examiner: HostExaminer = Arc::new(move || {
            let HostArguments { out, kinds, .. } = &examined.arguments;
            examine_own_host(out, &kinds.directories)
        });
        let options = GateOptions { listen, keys, reach, runs: Some(sender), examiner, limits };
        let mut announcement = None;
        let ready = |address| {
            announcement = agent.announce(address);
            report_ready();
        };
        let ending = serve_until_signal(async {
            tokio::select! {
                ended = gate::serve(options, ready) => match ended? {},
                () = take_orders(&agent, orders) => Ok(()),
                () = agent.watch_itself() => Ok(()),
            }
        });
        drop(announcement);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        runtime.context("the event loop cannot be started")?.block_on(agent.end_processes());
        Ok(ending?.into())
    }
}

/// Reports to systemd, if it has started the agent, that the agent serves (sd_notify(3)).
fn report_ready() {
    if let Err(error) = sd_notify::notify(&[sd_notify::NotifyState::Ready]) {
        tracing::warn!("systemd cannot be notified: {error}");
    }
}

async fn take_orders(agent: &Arc<Agent>, mut orders: mpsc::Receiver<RunOrder>) {
    while let Some(order) = orders.recv().await {
        let agent = Arc::clone(agent);
        tokio::spawn(async move { agent.serve_order(order).await });
    }
}

/// The agent of this host.
pub(crate) struct Agent {
    arguments: HostArguments,
    format: OutputFormat,
    keys: HostKeys,
    programs: Arc<ProgramFinder>,
    /// The mark of all its processes.
    mark: String,
    group_killers: Mutex<GroupKillers>,
    /// None where this host allows no control groups.
    control_group: Option<ControlGroup>,
    /// What it has for each system.
    sites: Mutex<HashMap<String, Arc<Site>>>,
    /// The last process of each component.
    processes: Mutex<HashMap<ProcessKey, Arc<AgentProcess>>>,
    /// One start at a time, so that no component runs twice.
    starting: tokio::sync::Mutex<()>,
}

impl Agent {
    /// Announces it at `address`, if the arguments ask for that.
    fn announce(&self, address: SocketAddr) -> Option<Announcement> {
        if !self.arguments.announce {
            return None;
        }
        match Announcement::start(self.keys.host_name(), address) {
            Ok(announcement) => Some(announcement),
            Err(error) => {
                tracing::warn!("the agent cannot be announced on the network: {error}");
                None
            }
        }
    }

    /// Replaces group killers that have ended, and forgets systems of which nothing has run for long.
    async fn watch_itself(&self) {
        let mut idle = IdleSystems::default();
        loop {
            tokio::time::sleep(LOOK_EVERY).await;
            if self.group_killers.lock().replace_ended() > 0 {
                tracing::warn!("a group killer has ended; there is a new one");
            }
            let systems: Vec<_> = self.sites.lock().keys().cloned().collect();
            let systems = systems.into_iter().map(|system| {
                let is_used = self.runs_something_of(&system);
                (system, is_used)
            });
            for system in idle.list_expired(systems, Instant::now()) {
                let _no_start_meanwhile = self.starting.lock().await;
                if !self.runs_something_of(&system) {
                    self.forget_system(&system);
                }
            }
        }
    }

    /// Whether a process of the system is alive, or a launcher is connected to what is known of one.
    fn runs_something_of(&self, system: &str) -> bool {
        let processes = self.processes.lock();
        let mut of_system = processes.values().filter(|process| process.key.system == system);
        of_system.any(|process| process.is_alive() || process.is_attached())
    }

    fn forget_system(&self, system: &str) {
        self.processes.lock().retain(|key, _| key.system != system);
        self.sites.lock().remove(system);
    }

    /// Ends what earlier runs of a system have left, and forgets it.
    async fn end_system(&self, start: &RemoteStart) -> Result<(), Refusal> {
        let _no_start_meanwhile = self.starting.lock().await;
        self.refuse_second_launcher(start)?;
        self.end_others(start, None).await;
        self.forget_system(&start.system);
        tracing::info!(system = %start.system, "its file does not name this host any more");
        Ok(())
    }

    async fn serve_order(self: Arc<Self>, order: RunOrder) {
        let RunOrder { start, launcher, address, mut channel } = order;
        if start.takeover == Takeover::End {
            let ended = match self.check_launcher(&start, &launcher) {
                Ok(()) => self.end_system(&start).await,
                refused => refused,
            };
            if let Err(refusal) = ended {
                tracing::warn!(%launcher, system = %start.system, "refused: {refusal}");
                return channel.refuse(refusal).await;
            }
            let (sender, mut events) = mpsc::channel(1);
            let _ = sender.try_send(RemoteEvent::Ended { end: ProcessEnd::Code { code: 0 } });
            drop(sender);
            let _ = channel.serve(&mut events, |_| {}).await;
            return;
        }
        let found = match self.prepare(&start, &launcher, &mut channel).await {
            Ok(()) => self.find_or_start(&start, &launcher, address).await,
            Err(refusal) => Err(refusal),
        };
        let process = match found {
            Ok(found) => found,
            Err(refusal) => {
                tracing::warn!(%launcher, component = %start.component, "refused: {refusal}");
                return channel.refuse(refusal).await;
            }
        };
        let (attached, mut events) = process.attach();
        let lost = channel.serve(&mut events, |order| process.obey(order)).await;
        process.detach(attached);
        process.count_unsent(&mut events);
        if let Some(why) = lost {
            process.handle_cut(&launcher, &why);
        }
    }

    /// Checks whether this launcher may run systems here.
    fn check_launcher(&self, start: &RemoteStart, launcher: &str) -> Result<(), Refusal> {
        if launcher != self.arguments.from {
            let from = &self.arguments.from;
            let text =
                format!("this agent runs components for systems of {from}, not of {launcher}");
            return Err(Refusal::new(RefusalCode::Role, text));
        }
        if !is_name(&start.system) {
            return Err(Refusal::new(RefusalCode::Malformed, NO_NAME));
        }
        Ok(())
    }

    /// Checks whether the launcher may ask for this, and gets the executable if that is wanted.
    async fn prepare(
        self: &Arc<Self>,
        start: &RemoteStart,
        launcher: &str,
        channel: &mut RunChannel,
    ) -> Result<(), Refusal> {
        self.check_launcher(start, launcher)?;
        if [&start.component, &start.kind].into_iter().any(|name| !is_name(name)) {
            return Err(Refusal::new(RefusalCode::Malformed, NO_NAME));
        }
        if matches!(start.takeover, Takeover::Only { .. })
            || !self.programs.wants_executable(start).await?
        {
            return Ok(());
        }
        self.receive_executable(start, channel).await
    }

    async fn receive_executable(
        self: &Arc<Self>,
        start: &RemoteStart,
        channel: &mut RunChannel,
    ) -> Result<(), Refusal> {
        let Some(store) = &self.programs.executables else { return Ok(()) };
        let failed = |text: String| Refusal::new(RefusalCode::Limit, text);
        let RemoteStart { kind, executable_len, .. } = start;
        let mut arriving = store.begin(start)?;
        let received = channel.receive_executable(*executable_len, |bytes| arriving.take(bytes));
        received.await.map_err(|why| failed(format!("the executable of {kind}: {why}")))?;
        let finishing = tokio::task::spawn_blocking(move || arriving.finish());
        finishing.await.map_err(|error| failed(error.to_string()))??;
        store.remove_old(kind);
        tracing::info!(%kind, bytes = executable_len, sha256 = %start.build, "an executable was received");
        Ok(())
    }

    async fn find_or_start(
        self: &Arc<Self>,
        start: &RemoteStart,
        launcher: &str,
        address: SocketAddr,
    ) -> Result<Arc<AgentProcess>, Refusal> {
        let refuse = |code, text: String| Err(Refusal::new(code, text));
        let key = ProcessKey { system: start.system.clone(), component: start.component.clone() };
        let _one_at_a_time = self.starting.lock().await;
        let existing = self.processes.lock().get(&key).cloned();
        match (start.takeover, existing) {
            (Takeover::Only { process }, Some(existing)) if existing.id == process => {
                existing.adopt(start);
                // The launcher may have come back by another of its networks.
                self.find_site(start, launcher, address).await?;
                return Ok(existing);
            }
            (Takeover::Only { .. }, _) => {
                let text = "its process is not known any more: the agent was restarted";
                return refuse(RefusalCode::UnknownData, text.into());
            }
            (takeover, existing) => {
                self.refuse_second_launcher(start)?;
                let existing = existing.filter(|it| it.is_alive() && it.fits(start));
                if let (Takeover::Any, Some(existing)) = (takeover, existing) {
                    existing.adopt(start);
                    self.find_site(start, launcher, address).await?;
                    self.end_others(start, Some(existing.id)).await;
                    return Ok(existing);
                }
                self.end_others(start, None).await;
            }
        }
        let site = self.find_site(start, launcher, address).await?;
        let process = process::start(self, &site, key.clone(), start).await?;
        self.processes.lock().insert(key, Arc::clone(&process));
        Ok(process)
    }

    /// Refuses a second run of a system while the launcher of the first one is there: they would end
    /// each other's components.
    fn refuse_second_launcher(&self, start: &RemoteStart) -> Result<(), Refusal> {
        let is_others = |process: &&Arc<AgentProcess>| {
            process.key.system == start.system
                && process.run() != start.run
                && process.is_alive()
                && process.is_attached()
        };
        if !self.processes.lock().values().any(|process| is_others(&process)) {
            return Ok(());
        }
        let system = &start.system;
        let text = format!(
            "another run of {system} has components here, and its launcher is connected; stop it, \
             or give this run a name of its own with --system"
        );
        Err(Refusal::new(RefusalCode::Limit, text))
    }

    /// Kills the component's own process, unless it is kept, and what an earlier run of its system has
    /// left: with `Never` all of it, with `Any` what this run does not have on this host.
    async fn end_others(&self, start: &RemoteStart, kept: Option<u64>) {
        let is_left = |process: &&Arc<AgentProcess>| {
            let AgentProcess { key, id, .. } = &***process;
            let is_wanted =
                start.takeover == Takeover::Any && start.components.contains(&key.component);
            let is_earlier = process.run() != start.run && !is_wanted;
            key.system == start.system
                && Some(*id) != kept
                && (key.component == start.component || is_earlier)
        };
        let left: Vec<_> = self.processes.lock().values().filter(is_left).cloned().collect();
        for process in left {
            process.kill();
            process.wait_for_end().await;
        }
    }

    async fn find_site(
        &self,
        start: &RemoteStart,
        launcher: &str,
        address: SocketAddr,
    ) -> Result<Arc<Site>, Refusal> {
        let known = self.sites.lock().get(&start.system).cloned();
        if let Some(site) = known {
            site.set_hosts(start, launcher, address);
            return Ok(site);
        }
        let opened =
            Site::open(&self.arguments.out, &self.keys, start, launcher, address, self.format);
        match opened.await {
            Ok(site) => {
                let site = Arc::new(site);
                self.sites.lock().insert(start.system.clone(), Arc::clone(&site));
                Ok(site)
            }
            Err(error) => Err(Refusal::new(RefusalCode::Limit, format!("{error:#}"))),
        }
    }

    /// Asks every process to end, and kills those that do not.
    async fn end_processes(&self) {
        let processes: Vec<_> = self.processes.lock().values().cloned().collect();
        processes.iter().for_each(|process| process.terminate());
        let all = async {
            for process in &processes {
                process.wait_for_end().await;
            }
        };
        if tokio::time::timeout(GRACE, all).await.is_err() {
            processes.iter().for_each(|process| process.kill());
        }
    }
}
