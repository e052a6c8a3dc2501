//! The system under test: its file, keys, agents and launcher, each host in its own namespace.

use std::fs::{self, DirBuilder, File};
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use super::diary::DiaryReader;
use super::interrupt::wait_until;
use super::network::{HOSTS, TestNetwork, address_of, way_of};
use super::parts::DIARY_FOLDER;
use super::relay_process::RelayProcess;

/// The name of the system and of its mission.
const SYSTEM: &str = "bench";
const PORT: u16 = 7410;
const ROOM: &str =
    r#"<svg><rect x="-3" y="-3" width="6" height="6"/><circle id="start" cx="0" cy="0"/></svg>"#;
/// How long anything may take before the job gives up: what is measured is far shorter.
pub const PATIENCE: Duration = Duration::from_secs(40);

/// What a job needs to begin.
#[derive(Clone, Debug)]
pub struct SystemOptions {
    /// The program `armor`.
    pub program: PathBuf,
    pub hosts: usize,
    /// How many components send numbered messages: a multiple of the number of hosts.
    pub pulses: usize,
    pub rate_hz: u32,
    /// The seed of the relay through which the hosts are connected; none: directly.
    pub relay_seed: Option<u64>,
}

/// The running system. Dropping it ends everything.
pub struct SystemUnderTest {
    pub options: SystemOptions,
    pub network: TestNetwork,
    pub diary: DiaryReader,
    pub launcher: Option<Child>,
    /// The agent of each host; the first host has none.
    pub agents: Vec<Option<Child>>,
    relay: Option<RelayProcess>,
    folder: PathBuf,
}

impl SystemUnderTest {
    /// Sets up the hosts, starts the system and waits until every link carries data.
    ///
    /// # Errors
    /// If something of it fails.
    pub fn start(options: SystemOptions) -> Result<Self> {
        let SystemOptions { hosts, pulses, .. } = &options;
        ensure!(pulses % hosts == 0 && pulses / hosts > 1, "{pulses} pulses on {hosts} hosts");
        let network = TestNetwork::create(*hosts)?;
        let relay = match options.relay_seed {
            Some(_) if *hosts != 2 => bail!("a relay is between 2 hosts, not {hosts}"),
            Some(seed) => Some(RelayProcess::start(&network, seed, &list_routes())?),
            None => None,
        };
        let folder = std::env::temp_dir().join(format!("armor-bench-{}", std::process::id()));
        let diary = folder.join("diary");
        fs::create_dir_all(&diary)?;
        let agents = (0..*hosts).map(|_| None).collect();
        let diary = DiaryReader::new(diary);
        let mut system = Self { options, network, diary, launcher: None, agents, relay, folder };
        system.write_files()?;
        for host in 1..system.options.hosts {
            system.start_agent(host)?;
        }
        system.start_launcher(false)?;
        system.wait_for_links(0)?;
        Ok(system)
    }

    /// The relay between the hosts.
    ///
    /// # Errors
    /// If they are connected directly.
    pub fn relay_mut(&mut self) -> Result<&mut RelayProcess> {
        self.relay.as_mut().context("there is no relay")
    }

    /// The senders of numbered messages, with the host of each.
    pub fn pulses(&self) -> impl Iterator<Item = (String, usize)> + use<> {
        let hosts = self.options.hosts;
        (0..self.options.pulses).map(move |index| (name_pulse(index, hosts), index % hosts))
    }

    /// All components, with the host of each.
    pub fn components(&self) -> Vec<(String, usize)> {
        let others = [("left", 0), ("right", 1), ("pusher", 0), ("wheels", 1), ("witness", 1)];
        self.pulses().chain(others.map(|(name, host)| (name.to_owned(), host))).collect()
    }

    fn write_files(&self) -> Result<()> {
        let folder = &self.folder;
        fs::write(folder.join("room.svg"), ROOM)?;
        fs::write(folder.join("bench.xml"), self.write_system())?;
        let kinds = folder.join("kinds");
        fs::create_dir_all(&kinds)?;
        let own = std::env::current_exe()?;
        for kind in ["pulse", "hand", "pusher", "witness"] {
            let path = kinds.join(kind);
            let text = format!("#!/bin/sh\nexec '{}' part {kind} \"$@\"\n", own.display());
            fs::write(&path, text)?;
            fs::set_permissions(&path, fs::Permissions::from_mode(0o755))?;
        }
        self.run_keys(&["init"])?;
        for host in HOSTS.iter().take(self.options.hosts) {
            self.run_keys(&["add", host, "--role", "host"])?;
            let keys = folder.join(host);
            DirBuilder::new().mode(0o700).create(&keys)?;
            for file in [&format!("{host}.key"), "revoked"] {
                fs::copy(folder.join("authority").join(file), keys.join(file))?;
            }
        }
        Ok(())
    }

    fn run_keys(&self, arguments: &[&str]) -> Result<()> {
        let mut command = self.prepare(Command::new(&self.options.program), 0);
        let done = command.arg("keys").args(arguments).args(["--keys", "authority"]).output()?;
        ensure!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        Ok(())
    }

    fn write_system(&self) -> String {
        let (hosts, rate) = (self.options.hosts, self.options.rate_hz);
        let place = |host: usize| match host {
            0 => String::new(),
            _ => format!(" host=\"{}\"", HOSTS[host]),
        };
        let mut text = format!("<armor version=\"1\"><system name=\"{SYSTEM}\">\n");
        for name in &HOSTS[1..hosts] {
            // The longest cut is shorter.
            let at = match self.options.relay_seed {
                Some(_) => way_of(0).to_string(),
                None => (*name).to_owned(),
            };
            text += &format!("<host name=\"{name}\" at=\"{at}:{PORT}\" patience=\"2min\"/>\n");
        }
        for (name, host) in self.pulses() {
            let at = place(host);
            text += &format!("<component name=\"{name}\" kind=\"pulse\" rate=\"{rate}Hz\"{at}/>\n");
        }
        let arm = place(1);
        text += &format!(
            "<component name=\"left\" kind=\"hand\" rate=\"10Hz\"/>
<component name=\"right\" kind=\"hand\" rate=\"10Hz\"{arm}/>
<component name=\"pusher\" kind=\"pusher\" rate=\"20Hz\"/>
<component name=\"wheels\" kind=\"simulator\" rate=\"50Hz\"{arm}>
  <parameter name=\"world\" value=\"{}\"/>
  <parameter name=\"odometry_rate\" value=\"100Hz\"/></component>
<component name=\"witness\" kind=\"witness\" rate=\"5Hz\"{arm}/>
<link from=\"pusher.velocity\" to=\"wheels.velocity\"/>
<link from=\"wheels.odometry\" to=\"witness.odometry\" keep=\"1000\"/>\n",
            self.folder.join("room.svg").display()
        );
        let count = self.options.pulses;
        for index in 0..count {
            let own = name_pulse(index, hosts);
            for (input, back) in [("far", 1), ("near", hosts)] {
                let other = name_pulse((index + count - back) % count, hosts);
                text +=
                    &format!("<link from=\"{other}.pulse\" to=\"{own}.{input}\" keep=\"1000\"/>\n");
            }
        }
        text + &format!(
            "</system><mission name=\"{SYSTEM}\" goal=\"over\" safe=\"hold\">
<place name=\"left-works\" initial=\"true\" components=\"left\"/>
<place name=\"right-works\" components=\"right\"/><place name=\"over\"/><place name=\"hold\"/>
<exclusive components=\"left right\"/>
<transition name=\"to-right\" from=\"left-works\" to=\"right-works\" operator=\"true\"/>
<transition name=\"to-left\" from=\"right-works\" to=\"left-works\" operator=\"true\"/>
<transition name=\"end\" from=\"left-works\" to=\"over\" operator=\"true\"/>
</mission></armor>\n"
        )
    }

    /// A command on a host: its folder for what runs, its diary, and no variable of this shell.
    fn prepare(&self, mut command: Command, host: usize) -> Command {
        for (name, _) in std::env::vars_os() {
            if name.to_string_lossy().starts_with("ARMOR_") {
                command.env_remove(name);
            }
        }
        let own = self.folder.join(format!("{}-run", HOSTS[host]));
        command.current_dir(&self.folder).env("XDG_RUNTIME_DIR", &own);
        command.env("XDG_CACHE_HOME", own.join("cache"));
        command.env(DIARY_FOLDER, self.folder.join("diary"));
        command.stdin(Stdio::null());
        command
    }

    fn armor_on(&self, host: usize) -> Command {
        self.prepare(self.network.command_on(host, &self.options.program), host)
    }

    fn start_on(&self, host: usize, arguments: &[&str]) -> Result<Child> {
        let name = HOSTS[host];
        let messages = self.folder.join(format!("{name}.stderr"));
        let messages = File::options().create(true).append(true).open(messages)?;
        let mut command = self.armor_on(host);
        command.args(arguments).args(["--keys", name, "--components", "kinds"]);
        command.stdout(Stdio::null()).stderr(messages);
        command.spawn().with_context(|| format!("nothing starts on {name}"))
    }

    /// Starts the agent of a host.
    ///
    /// # Errors
    /// If no process can be started.
    pub fn start_agent(&mut self, host: usize) -> Result<()> {
        let out = format!("{}-out", HOSTS[host]);
        let agent = self.start_on(host, &["host", "--from", HOSTS[0], "--out", &out])?;
        self.agents[host] = Some(agent);
        Ok(())
    }

    /// Starts the launcher, or lets another one continue its run.
    ///
    /// # Errors
    /// If no process can be started.
    pub fn start_launcher(&mut self, resume: bool) -> Result<()> {
        let gate = format!("0.0.0.0:{PORT}");
        let out = format!("{}-out", HOSTS[0]);
        let mut arguments = vec!["run", "bench.xml", "--headless", "--gate", &gate, "--out", &out];
        if resume {
            arguments.push("--resume");
        }
        self.launcher = Some(self.start_on(0, &arguments)?);
        Ok(())
    }

    /// What a tool prints on the first host, one value per line.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn run_tool(&self, arguments: &[&str]) -> Result<Vec<Value>> {
        let done = self.armor_on(0).args(arguments).args(["--format", "json"]).output()?;
        let text = String::from_utf8_lossy(&done.stdout);
        Ok(text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect())
    }

    /// The marked places, as a tool shows them; `None` if it gets no answer.
    ///
    /// # Errors
    /// If the tool cannot be started.
    pub fn read_marking(&self) -> Result<Option<String>> {
        let shown = self.run_tool(&["mission", "show"])?;
        let Some(places) = shown.first().and_then(|it| it["places"].as_array().cloned()) else {
            return Ok(None);
        };
        let is_marked = |place: &&Value| place["tokens"].as_u64().is_some_and(|count| count > 0);
        let marked: Vec<_> = places
            .iter()
            .filter(is_marked)
            .filter_map(|place| Some(format!("{} {}", place["place"].as_str()?, place["tokens"])))
            .collect();
        Ok(Some(marked.join(", ")))
    }

    /// The moment at which the last of all links carried a message that was sent at or after
    /// `from_ns`, between the processes that live now.
    ///
    /// # Errors
    /// If that takes too long.
    pub fn wait_for_links(&mut self, from_ns: u64) -> Result<u64> {
        self.diary.await_messages(from_ns);
        let what = "every link to carry data";
        let found = wait_until(PATIENCE, what, || {
            ensure_runs(self.launcher.as_mut(), "the launcher")?;
            self.diary.read_on()?;
            Ok(self.find_slowest_link())
        });
        found.with_context(|| {
            let messages = fs::read_to_string(self.folder.join(format!("{}.stderr", HOSTS[0])));
            format!("{}\n{}", messages.unwrap_or_default(), self.describe_missing_links())
        })
    }

    fn find_slowest_link(&self) -> Option<u64> {
        let mut slowest = 0;
        for (name, _) in self.pulses() {
            let life = self.diary.find_life(&name)?;
            slowest = slowest.max(life.active_ns?);
            for input in ["far", "near"] {
                let first = life.first.get(input)?;
                // Not from a process that has died since.
                self.is_last(first.source).then_some(())?;
                slowest = slowest.max(first.at_ns);
            }
        }
        Some(slowest)
    }

    fn is_last(&self, pid: u32) -> bool {
        self.pulses().any(|(name, _)| self.diary.find_life(&name).is_some_and(|it| it.pid == pid))
    }

    fn describe_missing_links(&self) -> String {
        let mut missing = Vec::new();
        for (name, _) in self.pulses() {
            match self.diary.find_life(&name) {
                None => missing.push(format!("{name} has not started")),
                Some(life) if life.active_ns.is_none() => {
                    missing.push(format!("{name} is not active"));
                }
                Some(life) => {
                    for input in ["far", "near"] {
                        let first = life.first.get(input);
                        if !first.is_some_and(|first| self.is_last(first.source)) {
                            missing.push(format!("{name}.{input} has received nothing"));
                        }
                    }
                }
            }
        }
        missing.join(", ")
    }

    /// The lines of all logs of a host, without those that are double.
    pub fn read_logs(&self, host: usize) -> String {
        let out = self.folder.join(format!("{}-out", HOSTS[host]));
        let logs = match host {
            0 => out.join("logs"),
            _ => out.join(SYSTEM).join("logs"),
        };
        fs::read_to_string(logs.join("all.log")).unwrap_or_default()
    }

    /// Keeps the files of the job, for a person to look at.
    pub fn keep_files(&mut self) {
        eprintln!("its files are kept in {}", self.folder.display());
        self.folder = PathBuf::new();
    }
}

impl Drop for SystemUnderTest {
    fn drop(&mut self) {
        for child in self.launcher.iter_mut().chain(self.agents.iter_mut().flatten()) {
            let _ = child.kill();
            let _ = child.wait();
        }
        if self.folder != Path::new("") {
            let _ = fs::remove_dir_all(&self.folder);
        }
    }
}

/// A process that has ended by itself ends the job.
///
/// # Errors
/// If it has.
pub fn ensure_runs(child: Option<&mut Child>, what: &str) -> Result<()> {
    match child.map(Child::try_wait).transpose()?.flatten() {
        Some(status) => bail!("{what} has ended by itself: {status}"),
        None => Ok(()),
    }
}

/// The ports of the relay: the first host finds the agent at the router, and the agent the gate of the
/// first host, since it connects to where the launcher seems to be.
fn list_routes() -> [String; 2] {
    [(0, 1), (1, 0)].map(|(from, to)| format!("{}:{PORT}={}:{PORT}", way_of(from), address_of(to)))
}

fn name_pulse(index: usize, hosts: usize) -> String {
    format!("{}-{}", HOSTS[index % hosts], index / hosts + 1)
}
