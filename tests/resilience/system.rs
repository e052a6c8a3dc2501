//! A running system of probes, observed from outside.

use std::fmt::Write;
use std::net::SocketAddr;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use armor_sdk::control::{ControlConnection, Role, Status};
use armor_sdk::directory::Directory;
use armor_wire::registry::ComponentEntry;
use rustix::process::Signal;

use super::trace::Trace;
use crate::fixture::{Folder, Run, free_port, is_alive, run_to_end, send_signal, wait_for};

/// Time for one request; callers repeat it.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);

/// Builds the file of a system.
#[derive(Default)]
pub struct Draft {
    components: String,
    links: String,
    mission: String,
}

impl Draft {
    /// Adds a probe with attributes (`rate="50Hz"`) and parameters (`burst=3 limit=1000`) that
    /// writes its trace to `NAME.trace`.
    pub fn probe(mut self, name: &str, attributes: &str, parameters: &str) -> Self {
        let trace = format!("trace={name}.trace");
        let _ = writeln!(self.components, "<component name='{name}' kind='probe' {attributes}>");
        for parameter in parameters.split_whitespace().chain([trace.as_str()]) {
            let (name, value) = parameter.split_once('=').expect("NAME=VALUE");
            let _ = writeln!(self.components, "  <parameter name='{name}' value='{value}'/>");
        }
        self.components += "</component>\n";
        self
    }

    /// Adds a probe without a trace.
    pub fn quiet_probe(mut self, name: &str, attributes: &str) -> Self {
        let _ = writeln!(self.components, "<component name='{name}' kind='probe' {attributes}/>");
        self
    }

    /// Adds a component as XML.
    pub fn component(mut self, text: &str) -> Self {
        self.components += text;
        self
    }

    /// Links the numbers of the component `from` to `to`, which is `COMPONENT.INPUT`.
    pub fn link(mut self, from: &str, to: &str, keep: &str) -> Self {
        let _ = writeln!(self.links, "<link from='{from}.numbers' to='{to}' keep='{keep}'/>");
        self
    }

    /// Adds links as XML.
    pub fn links(mut self, text: &str) -> Self {
        self.links += text;
        self
    }

    /// Sets the mission, as XML.
    pub fn mission(mut self, text: &str) -> Self {
        self.mission = text.into();
        self
    }

    /// Starts the system; the run writes into `out`.
    pub fn run(self, folder: Folder) -> System {
        self.run_with(folder, &[])
    }

    /// Starts the system on a port that no other launcher chooses, so that a next one can have it.
    pub fn run_on_own_port(self, folder: Folder) -> System {
        self.run_with(folder, &["--registry", &format!("127.0.0.1:{}", free_port())])
    }

    /// Starts the system with further arguments of `armor run`.
    pub fn run_with(self, folder: Folder, arguments: &[&str]) -> System {
        let file = self.write_file(&folder);
        let run = folder.run("out", &[&[file.as_str()], arguments].concat());
        System::observe(run, folder)
    }

    /// Starts the system with `out` on a disk of so many KiB; `None` if this user may not mount one.
    pub fn run_on_small_disk(self, folder: Folder, kib: u32) -> Option<System> {
        let file = self.write_file(&folder);
        let run = folder.run_on_small_disk("out", kib, &[&file])?;
        Some(System::observe(run, folder))
    }

    fn write_file(self, folder: &Folder) -> String {
        let Self { components, links, mission } = self;
        let text = format!(
            "<armor version='1'>\n<system name='probes'>\n{components}{links}</system>\n{mission}\n</armor>\n"
        );
        let file = folder.write("probes.xml", &text);
        std::fs::create_dir_all(folder.path().join("components")).expect("writable");
        symlink(probe(), folder.path().join("components/probe")).expect("a link to the probe");
        file.into_os_string().into_string().expect("a path in UTF-8")
    }
}

/// Returns the executable of the probe, which `cargo test` builds and `cargo test --test system`
/// does not.
pub fn probe() -> PathBuf {
    let armor = Path::new(env!("CARGO_BIN_EXE_armor"));
    let path = armor.with_file_name("examples").join("probe");
    assert!(path.exists(), "no {}; `cargo build -p armor --example probe`", path.display());
    path
}

/// A running system. Dropping it ends all of its processes.
pub struct System {
    pub run: Run,
    pub registry: SocketAddr,
    pub directory: Directory,
    // The last field, because fields are dropped in order: the run must end before its folder goes.
    pub folder: Folder,
}

impl System {
    fn observe(run: Run, folder: Folder) -> Self {
        let registry = run.registry();
        let directory = Directory::observer(&SocketAddr::to_string(&registry), "test");
        Self { run, registry, directory, folder }
    }

    /// Returns the trace of the probe `name` so far.
    pub fn trace(&self, name: &str) -> Trace {
        Trace::read(&self.folder.path().join(format!("{name}.trace")))
    }

    /// Waits until `find` finds something in the trace of `name`; returns it.
    pub fn traced<T>(
        &self,
        name: &str,
        what: &str,
        mut find: impl FnMut(&Trace) -> Option<T>,
    ) -> T {
        wait_for(&format!("{what} of `{name}`\n{}", self.run.log()), || find(&self.trace(name)))
    }

    /// Returns the registered processes; none if the registry does not answer.
    pub fn entries(&self) -> Vec<ComponentEntry> {
        self.directory
            .fetch_listing(ANSWER_WITHIN)
            .map(|listing| listing.components)
            .unwrap_or_default()
    }

    /// Waits until `name` is registered by a process that runs; returns its entry.
    pub fn entry(&self, name: &str) -> ComponentEntry {
        wait_for(&format!("`{name}` in the registry"), || {
            let pid_lives = |pid: u32| i32::try_from(pid).is_ok_and(is_alive);
            self.entries().into_iter().find(|entry| entry.name == name && pid_lives(entry.pid))
        })
    }

    /// Waits for the status of a component; returns it.
    pub fn status(&self, name: &str) -> Status {
        wait_for(&format!("an answer of `{name}`"), || self.answer(name))
    }

    /// Returns the status of a component, if it answers now.
    pub fn answer(&self, name: &str) -> Option<Status> {
        let entry = self.entries().into_iter().find(|entry| entry.name == name)?;
        let connection = ControlConnection::connect(&entry, Role::Observer, "test", |_| {}).ok()?;
        connection.status(ANSWER_WITHIN).ok()
    }

    /// Waits until a component or a daemon runs; returns its process id.
    pub fn pid(&self, name: &str) -> i32 {
        match name {
            "registry" | "configd" | "executive" => wait_for(name, || self.run.daemon(name)),
            name => i32::try_from(self.entry(name).pid).expect("a process id"),
        }
    }

    /// Kills a process without warning; returns its id.
    pub fn kill(&self, name: &str) -> i32 {
        let pid = self.pid(name);
        send_signal(pid, Signal::KILL);
        pid
    }

    /// Kills a process and waits for its successor; returns the successor's process id.
    pub fn replace(&self, name: &str) -> i32 {
        let before = self.kill(name);
        wait_for(&format!("another {name}"), || Some(self.pid(name)).filter(|pid| *pid != before))
    }

    /// Runs `armor` with `arguments` on this system; returns its output, one JSON value per line.
    pub fn read_json(&self, arguments: &[&str]) -> Vec<serde_json::Value> {
        let registry = self.registry.to_string();
        let mut command = self.folder.armor(arguments);
        let (code, out, err) =
            run_to_end(command.args(["--registry", &registry, "--format", "json"]));
        if code != 0 {
            // The process that should answer is being restarted; the caller repeats the command.
            eprintln!("armor {arguments:?}: {err}");
        }
        out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }

    /// As [`Self::read_json`], but returns the output as text.
    pub fn shown(&self, arguments: &[&str]) -> String {
        let registry = self.registry.to_string();
        let mut command = self.folder.armor(arguments);
        run_to_end(command.args(["--registry", &registry])).1
    }

    /// Starts a probe without the launcher.
    pub fn by_hand(&self, arguments: &[&str]) -> ByHand {
        let mut command = Command::new(probe());
        command.args(["--registry", &self.registry.to_string()]).args(arguments);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        ByHand(command.current_dir(self.folder.path()).spawn().expect("the probe starts"))
    }
}

/// A process that ends with the test.
pub struct ByHand(Child);

impl Drop for ByHand {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Returns a number from a file of `/proc/PID`: `VmRSS` in KiB or `Threads` from `status`, `Pss` in
/// KiB from `smaps_rollup`.
pub fn proc_number(pid: i32, file: &str, field: &str) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{pid}/{file}")).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(field)?.strip_prefix(':'));
    let number = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
    number.unwrap_or_default()
}

/// Returns the CPU time that a process has used, in seconds.
pub fn cpu_s(pid: i32) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let after_name = text.rsplit_once(')').map_or("", |(_, fields)| fields);
    let fields: Vec<&str> = after_name.split_whitespace().collect();
    // utime and stime, proc(5) fields 14 and 15, in ticks of 10 ms.
    let ticks = |at: usize| fields.get(at).and_then(|ticks| ticks.parse::<f64>().ok());
    (ticks(11).unwrap_or_default() + ticks(12).unwrap_or_default()) / 100.0
}
