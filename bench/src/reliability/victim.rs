//! What can be killed, and how the system is seen to be back afterwards.

use std::time::Duration;

use anyhow::Result;
use rustix::process::Signal;

use super::interrupt::{rest, wait_until};
use super::network::HOSTS;
use super::processes::{find_start, list_children, send_signal};
use super::system::{PATIENCE, SystemUnderTest};
use crate::readings::monotonic_ns;

/// The daemons of the first host.
const DAEMONS: [&str; 4] = ["registry", "configd", "executive", "gate"];
/// After this time a new agent or launcher is started, as systemd would.
const SERVICE_DELAY: Duration = Duration::from_millis(100);

/// A process of the system.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FaultVictim {
    Component { name: String, host: usize },
    Daemon(&'static str),
    Agent { host: usize },
    Launcher,
}

/// How the system came back, in seconds.
#[derive(Clone, Copy, Debug)]
pub struct SystemReturn {
    /// From the kill.
    pub since_kill_s: f64,
    /// From the start of the process that replaces it.
    pub since_start_s: f64,
}

impl FaultVictim {
    /// Everything that can be killed.
    pub fn list_all(system: &SystemUnderTest) -> Vec<Self> {
        let components = system.components().into_iter();
        let components = components.map(|(name, host)| Self::Component { name, host });
        let agents = (1..system.options.hosts).map(|host| Self::Agent { host });
        components.chain(DAEMONS.map(Self::Daemon)).chain(agents).chain([Self::Launcher]).collect()
    }

    /// What kind it is, for a row of the table.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Component { host: 0, .. } => "component of the launcher's host",
            Self::Component { .. } => "component of another host",
            Self::Daemon(name) => name,
            Self::Agent { .. } => "agent",
            Self::Launcher => "launcher (--resume)",
        }
    }

    /// Its name in messages.
    pub fn name(&self) -> String {
        match self {
            Self::Component { name, .. } => name.clone(),
            Self::Daemon(name) => (*name).to_owned(),
            Self::Agent { host } => format!("the agent of {}", HOSTS[*host]),
            Self::Launcher => "the launcher".to_owned(),
        }
    }

    /// Its process, if it runs.
    pub fn find_process(&self, system: &SystemUnderTest) -> Option<u32> {
        let launcher = system.launcher.as_ref()?.id();
        match self {
            Self::Component { name, host } => {
                let parent = match host {
                    0 => launcher,
                    _ => system.agents[*host].as_ref()?.id(),
                };
                let is_it = |words: &[String]| {
                    words.windows(2).any(|pair| pair[0] == "--name" && pair[1] == *name)
                };
                let all = list_children(parent);
                all.into_iter().find(|(_, words)| is_it(words)).map(|(pid, _)| pid)
            }
            Self::Daemon(name) => {
                let is_it = |words: &[String]| words.get(1).is_some_and(|word| word == name);
                let all = list_children(launcher);
                all.into_iter().find(|(_, words)| is_it(words)).map(|(pid, _)| pid)
            }
            Self::Agent { host } => Some(system.agents[*host].as_ref()?.id()),
            Self::Launcher => Some(launcher),
        }
    }

    /// The components that die with it.
    fn list_lost(&self, system: &SystemUnderTest) -> Vec<String> {
        let of_host = |wanted: usize| {
            let all = system.components().into_iter();
            all.filter(|(_, host)| *host == wanted).map(|(name, _)| name).collect()
        };
        match self {
            Self::Component { name, .. } => vec![name.clone()],
            Self::Daemon(_) => Vec::new(),
            Self::Agent { host } => of_host(*host),
            Self::Launcher => of_host(0),
        }
    }

    /// Kills it, and waits until all links carry data again and the tools show the marking.
    ///
    /// # Errors
    /// If it is not back in time, or the marking is another one.
    pub fn kill(&self, system: &mut SystemUnderTest, marking: &str) -> Result<SystemReturn> {
        let before = wait_until(PATIENCE, "the process to kill", || Ok(self.find_process(system)))?;
        let kill_ns = monotonic_ns();
        send_signal(before, Signal::KILL)?;
        self.replace(system)?;
        let start = wait_until(PATIENCE, "its next process", || {
            let new = self.find_process(system).filter(|pid| *pid != before);
            Ok(new.and_then(find_start))
        })?;
        let mut back_ns = start;
        let lost = self.list_lost(system);
        for name in lost {
            back_ns = back_ns.max(wait_for_life(system, &name, kill_ns)?);
        }
        back_ns = back_ns.max(system.wait_for_links(kill_ns)?);
        let answered_ns = wait_for_marking(system, marking)?;
        if matches!(self, Self::Daemon(_) | Self::Launcher) {
            back_ns = back_ns.max(answered_ns);
        }
        let since = |from_ns: u64| back_ns.saturating_sub(from_ns) as f64 / 1e9;
        Ok(SystemReturn { since_kill_s: since(kill_ns), since_start_s: since(start) })
    }

    /// Agent and launcher are started again by the bench.
    fn replace(&self, system: &mut SystemUnderTest) -> Result<()> {
        match self {
            Self::Agent { host } => {
                if let Some(mut agent) = system.agents[*host].take() {
                    agent.wait()?;
                }
                rest(SERVICE_DELAY)?;
                system.start_agent(*host)
            }
            Self::Launcher => {
                if let Some(mut launcher) = system.launcher.take() {
                    launcher.wait()?;
                }
                rest(SERVICE_DELAY)?;
                system.start_launcher(true)
            }
            _ => Ok(()),
        }
    }
}

/// The moment at which a process of the component that was started after `from_ns` was active. For one
/// that no place activates now, or that has no diary, the moment at which it ran.
fn wait_for_life(system: &mut SystemUnderTest, name: &str, from_ns: u64) -> Result<u64> {
    let has_diary = name != "wheels";
    if !has_diary {
        return Ok(from_ns);
    }
    let is_hand = ["left", "right"].contains(&name);
    wait_until(PATIENCE, &format!("{name} to be active"), || {
        system.diary.read_on()?;
        let life = system.diary.find_life(name).filter(|life| life.new_ns >= from_ns);
        Ok(life.and_then(|life| if is_hand { Some(life.new_ns) } else { life.active_ns }))
    })
}

/// The moment at which a tool was shown this marking.
fn wait_for_marking(system: &SystemUnderTest, marking: &str) -> Result<u64> {
    let mut shown = None;
    let found = wait_until(PATIENCE, "the marking", || {
        shown = system.read_marking()?;
        Ok((shown.as_deref() == Some(marking)).then(monotonic_ns))
    });
    found.map_err(|error| error.context(format!("the marking is {shown:?}, not {marking}")))
}
