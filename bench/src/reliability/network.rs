//! Hosts as network namespaces, each connected to a router between them, which can drop what one
//! sends to another. Nothing at either end notices a cut but by the silence.

use std::fs;
use std::io::Write;
use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use rustix::process::{Signal, geteuid};

use super::processes::send_signal;

/// The names of the hosts. The first one is where the system is started.
pub const HOSTS: [&str; 3] = ["robot", "arm", "wrist"];
const PREFIX: &str = "armor-bench-";
const ROUTER: &str = "router";
/// How long the router may take to apply a rule.
const IN_FORCE_WITHIN: Duration = Duration::from_secs(5);

/// The namespaces of a job; they are removed when it is dropped.
pub struct TestNetwork {
    count: usize,
    cuts: Vec<(usize, usize)>,
    rules: RouterRules,
}

/// A process `ip` on the router that waits for rules. To start one for each rule took 15 to 30 ms on a
/// busy machine, in which packets still passed.
struct RouterRules {
    process: Child,
    lines: Option<ChildStdin>,
}

impl TestNetwork {
    /// Makes the namespaces of `count` hosts.
    ///
    /// # Errors
    /// If this user or this kernel cannot.
    pub fn create(count: usize) -> Result<Self> {
        ensure!(geteuid().is_root(), "network namespaces need root: start the bench with sudo");
        ensure!((2..=HOSTS.len()).contains(&count), "2 or 3 hosts, not {count}");
        remove_abandoned();
        let made = build(count).and_then(|()| RouterRules::start());
        let rules = made.inspect_err(|_| remove_namespaces(count));
        let rules = rules.context("the network namespaces cannot be made")?;
        Ok(Self { count, cuts: Vec::new(), rules })
    }

    /// A command that runs on a host.
    pub fn command_on(&self, host: usize, program: &Path) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &name_namespace(HOSTS[host])]).arg(program);
        command
    }

    /// A command that runs on the router between them.
    pub fn command_on_router(&self, program: &Path) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &name_namespace(ROUTER)]).arg(program);
        command
    }

    /// The processes of all hosts.
    pub fn list_processes(&self) -> Vec<u32> {
        let hosts = HOSTS.iter().take(self.count);
        hosts.flat_map(|name| list_processes_in(&name_namespace(name))).collect()
    }

    /// Drops everything that `from` sends to `to`, from now on.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub fn cut(&mut self, from: usize, to: usize) -> Result<()> {
        self.cuts.push((from, to));
        self.set_rule("add", from, to)?;
        Ok(())
    }

    /// Lets everything through again.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub fn heal_all(&mut self) -> Result<()> {
        while let Some((from, to)) = self.cuts.pop() {
            self.set_rule("del", from, to)?;
        }
        Ok(())
    }

    fn set_rule(&mut self, change: &str, from: usize, to: usize) -> Result<()> {
        let (from, to) = (address_of(from).to_string(), address_of(to).to_string());
        self.rules.write_line(&format!("rule {change} from {from} to {to} blackhole"))?;
        let end = Instant::now() + IN_FORCE_WITHIN;
        let rule = format!("from {from} to {to} blackhole");
        while list_rules()?.contains(&rule) != (change == "add") {
            ensure!(Instant::now() < end, "the router does not take: rule {change} {rule}");
            thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }
}

impl RouterRules {
    fn start() -> Result<Self> {
        let mut command = Command::new("ip");
        command.args(["-n", &name_namespace(ROUTER), "-force", "-batch", "-"]);
        let mut process =
            command.stdin(Stdio::piped()).spawn().context("`ip` cannot be started")?;
        let lines = process.stdin.take();
        Ok(Self { process, lines })
    }

    fn write_line(&mut self, line: &str) -> Result<()> {
        let lines = self.lines.as_mut().context("`ip` takes no rules")?;
        lines.write_all(format!("{line}\n").as_bytes()).context("`ip` has ended")
    }
}

impl Drop for RouterRules {
    fn drop(&mut self) {
        // It ends with its input.
        drop(self.lines.take());
        let _ = self.process.wait();
    }
}

/// The rules of the router, as `ip` prints them.
fn list_rules() -> Result<String> {
    let listed = Command::new("ip").args(["-n", &name_namespace(ROUTER), "rule", "list"]).output();
    Ok(String::from_utf8_lossy(&listed.context("`ip` cannot be started")?.stdout).into_owned())
}

impl Drop for TestNetwork {
    fn drop(&mut self) {
        remove_namespaces(self.count);
    }
}

/// Makes the namespaces, and connects them.
fn build(count: usize) -> Result<()> {
    let router = name_namespace(ROUTER);
    run_ip(&["netns", "add", &router])?;
    let names: String =
        (0..count).map(|host| format!("{} {}\n", address_of(host), HOSTS[host])).collect();
    for (host, name) in HOSTS.iter().enumerate().take(count) {
        let space = name_namespace(name);
        let (port, way) = (format!("to-{name}"), way_of(host));
        run_ip(&["netns", "add", &space])?;
        // `ip netns exec` shows this file as /etc/hosts.
        let folder = settings_of(&space);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join("hosts"), format!("127.0.0.1 localhost\n{names}"))?;
        let (own, other) = (format!("{}/24", address_of(host)), format!("{way}/24"));
        let pair = ["link", "add", &port, "netns", &router, "type", "veth"];
        run_ip(&[&pair[..], &["peer", "name", "eth0", "netns", &space]].concat())?;
        run_ip(&["-n", &router, "addr", "add", &other, "dev", &port])?;
        run_ip(&["-n", &router, "link", "set", &port, "up"])?;
        run_ip(&["-n", &space, "addr", "add", &own, "dev", "eth0"])?;
        run_ip(&["-n", &space, "link", "set", "eth0", "up"])?;
        run_ip(&["-n", &space, "link", "set", "lo", "up"])?;
        run_ip(&["-n", &space, "route", "add", "default", "via", &way.to_string()])?;
    }
    let forward = "echo 1 > /proc/sys/net/ipv4/ip_forward";
    run_ip(&["netns", "exec", &router, "sh", "-c", forward])
}

fn remove_namespaces(count: usize) {
    for name in HOSTS.iter().take(count).chain([&ROUTER]) {
        remove_namespace(&name_namespace(name));
    }
}

/// The address of a host, which all others reach.
pub fn address_of(host: usize) -> Ipv4Addr {
    Ipv4Addr::new(10, 77, 1 + host as u8, 2)
}

/// The router's address next to it.
pub fn way_of(host: usize) -> Ipv4Addr {
    Ipv4Addr::new(10, 77, 1 + host as u8, 1)
}

fn name_namespace(host: &str) -> String {
    format!("{PREFIX}{}-{host}", std::process::id())
}

fn settings_of(space: &str) -> PathBuf {
    Path::new("/etc/netns").join(space)
}

/// Removes what a bench that was killed has left.
fn remove_abandoned() {
    let Ok(spaces) = fs::read_dir("/run/netns") else { return };
    for space in spaces.filter_map(|entry| entry.ok()?.file_name().into_string().ok()) {
        let owner = space.strip_prefix(PREFIX).and_then(|rest| rest.split('-').next());
        let is_abandoned = |owner: &str| !Path::new("/proc").join(owner).exists();
        if owner.is_some_and(is_abandoned) {
            remove_namespace(&space);
        }
    }
}

/// Kills the processes of a namespace, and removes it.
fn remove_namespace(space: &str) {
    if !Path::new("/run/netns").join(space).exists() {
        return;
    }
    for pid in list_processes_in(space) {
        let _ = send_signal(pid, Signal::KILL);
    }
    let _ = fs::remove_dir_all(settings_of(space));
    if let Err(error) = run_ip(&["netns", "del", space]) {
        eprintln!("the namespace {space} is left: {error:#}");
    }
}

fn list_processes_in(space: &str) -> Vec<u32> {
    let Ok(listed) = Command::new("ip").args(["netns", "pids", space]).output() else {
        return Vec::new();
    };
    let text = String::from_utf8_lossy(&listed.stdout).into_owned();
    text.lines().filter_map(|line| line.trim().parse().ok()).collect()
}

fn run_ip(arguments: &[&str]) -> Result<()> {
    let done = Command::new("ip").args(arguments).output();
    let done = done.context("`ip` cannot be started; it is in Debian's package iproute2")?;
    if !done.status.success() {
        let why = String::from_utf8_lossy(&done.stderr);
        bail!("ip {}: {}", arguments.join(" "), why.trim());
    }
    Ok(())
}
