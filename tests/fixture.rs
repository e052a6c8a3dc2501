//! The fixture of every whole-system test: a separate folder in which `armor` runs.

pub mod fault_proxy;
mod home_robot;
pub mod program;

use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use armor_socket::random_id;
use rustix::process::{Pid, Signal, geteuid, kill_process};

pub use home_robot::HomeRobot;
pub use program::{Dialogue, run_to_end};

/// Folders that this process has made so far.
static FOLDERS: AtomicU32 = AtomicU32::new(0);

/// A folder for one test, removed when the test ends. Other tests cannot see its runs.
pub struct Folder(PathBuf);

impl Folder {
    /// Creates an empty folder. Its path contains `name`; no other folder has it, not even that of a
    /// test which gives the same name.
    pub fn new(name: &str) -> Self {
        let number = FOLDERS.fetch_add(1, Ordering::Relaxed);
        // Short, since the path of a socket in it may have 107 bytes.
        let unique = format!("armor-test-{}-{number}-{name}", std::process::id());
        let path = std::env::temp_dir().join(unique);
        // Left behind by a killed process that had the same id.
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a folder for the test");
        Self(path)
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes a file into it.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).expect("writable");
        path
    }

    /// Returns the command `armor` with `arguments`, in this folder and without Armor's environment
    /// variables.
    pub fn armor(&self, arguments: &[&str]) -> Command {
        let mut command = self.command_of(Path::new(env!("CARGO_BIN_EXE_armor")));
        command.args(arguments);
        command
    }

    /// Returns a program's command in the folder, of this folder's systems.
    pub fn command_of(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command.current_dir(&self.0).stdin(Stdio::null());
        command.env("XDG_RUNTIME_DIR", self.0.join("run"));
        command.env("XDG_CACHE_HOME", self.0.join("cache"));
        for variable in [
            "ARMOR_REGISTRY",
            "ARMOR_COMPONENTS",
            "ARMOR_OUT",
            "ARMOR_LOG",
            "ARMOR_VIA",
            "ARMOR_PORT",
            "ARMOR_KEYS",
        ] {
            command.env_remove(variable);
        }
        command
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Time after which a test gives up waiting: generous, for a busy machine.
pub const DEADLINE: Duration = Duration::from_secs(120);

/// Repeats `found` until it returns something.
pub fn wait_for<T>(what: &str, found: impl FnMut() -> Option<T>) -> T {
    wait_within(DEADLINE, what, found)
}

/// As [`wait_for`], with another deadline.
pub fn wait_within<T>(deadline: Duration, what: &str, found: impl FnMut() -> Option<T>) -> T {
    find_within(deadline, found).unwrap_or_else(|| panic!("{what} did not happen"))
}

/// Repeats `found` until it returns something; `None` after the deadline.
pub fn find_within<T>(deadline: Duration, mut found: impl FnMut() -> Option<T>) -> Option<T> {
    let start = Instant::now();
    loop {
        let result = found();
        if result.is_some() || start.elapsed() >= deadline {
            return result;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Below the ports that components choose, and those that the kernel assigns: a test that uses a port
/// of these later still finds it free.
const TEST_PORTS: std::ops::Range<u16> = 8_800..10_000;

/// Returns a free port. It is random, because several test runs may share this host.
pub fn free_port() -> u16 {
    wait_for("a free port", || {
        let offset = random_id() % u64::from(TEST_PORTS.end - TEST_PORTS.start);
        let port = TEST_PORTS.start + u16::try_from(offset).expect("below the width");
        TcpListener::bind(("127.0.0.1", port)).is_ok().then_some(port)
    })
}

/// A running `armor run`, which ends with the test.
pub struct Run {
    child: Child,
    out: PathBuf,
}

impl Folder {
    /// Writes `components/NAME`, a kind without ports that runs `script` in `sh`.
    pub fn script(&self, kind: &str, script: &str) {
        let manifest = format!(
            r#"{{"armor_manifest":1,"kind":"{kind}","summary":"a script","inputs":[],"outputs":[],"parameters":[]}}"#
        );
        let text = format!(
            "#!/bin/sh\nif [ \"$1\" = --describe ]; then echo '{manifest}'; exit; fi\n{script}\n"
        );
        self.executable(&format!("components/{kind}"), &text);
    }

    /// Writes an executable file.
    pub fn executable(&self, name: &str, text: &str) {
        let path = self.0.join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        // Another process writes the file. The kernel refuses to execute a file that is open for
        // writing, and a child that another thread forks meanwhile would inherit our open
        // descriptor.
        let written = Command::new("/bin/sh")
            .args(["-c", "printf '%s' \"$1\" > \"$0\" && chmod +x \"$0\""])
            .arg(&path)
            .arg(text)
            .status();
        assert!(written.expect("sh runs").success());
    }

    /// Writes `NAME.xml`: a system of components, each `name kind` and attributes.
    pub fn system(&self, name: &str, components: &[&str]) -> String {
        let mut text = format!("<armor version=\"1\">\n  <system name=\"{name}\">\n");
        for component in components {
            let mut words = component.splitn(3, ' ');
            let mut next = || words.next().unwrap_or_default();
            let (name, kind, rest) = (next(), next(), next());
            text += &format!("    <component name=\"{name}\" kind=\"{kind}\" {rest}/>\n");
        }
        text += "  </system>\n</armor>\n";
        let file = format!("{name}.xml");
        self.write(&file, &text);
        file
    }

    /// Starts `armor run` with `arguments`, writing into `out`.
    pub fn run(&self, out: &str, arguments: &[&str]) -> Run {
        self.run_program(Path::new(env!("CARGO_BIN_EXE_armor")), out, arguments)
    }

    /// As [`Self::run`], with another copy of the program.
    pub fn run_program(&self, program: &Path, out: &str, arguments: &[&str]) -> Run {
        let out = self.0.join(out);
        let mut command = self.command_of(program);
        command.args(["run", "--out"]).arg(&out).args(arguments);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let child = command.spawn().expect("armor starts");
        Run { child, out }
    }
}

impl Folder {
    /// As [`Self::run`], with `out` on a disk of so many KiB, which only the run sees and which ends
    /// with it; what it prints goes to `printed.log`. `None` if this user may not mount one.
    pub fn run_on_small_disk(&self, out: &str, kib: u32, arguments: &[&str]) -> Option<Run> {
        let unshare = if geteuid().is_root() { "-m" } else { "-rm" };
        let mount = format!("mount -t tmpfs -o size={kib}k,mode=0700 small \"$0\"");
        let out = self.0.join(out);
        std::fs::create_dir_all(&out).expect("writable");
        let tried = Command::new("unshare").args([unshare, "sh", "-c", &mount]).arg(&out).output();
        if !tried.is_ok_and(|tried| tried.status.success()) {
            return None;
        }
        let mut command = self.command_of(Path::new("unshare"));
        command.args([unshare, "sh", "-c", &format!("{mount} && exec \"$@\"")]).arg(&out);
        command.arg(env!("CARGO_BIN_EXE_armor")).args(["run", "--out"]).arg(&out).args(arguments);
        let printed = std::fs::File::create(self.0.join("printed.log")).expect("writable");
        let child = command.stdout(printed).stderr(Stdio::null()).spawn().expect("armor starts");
        // The files as that process sees them.
        let seen = format!("/proc/{}/root{}", child.id(), out.display());
        Some(Run { child, out: seen.into() })
    }
}

/// Returns the running processes that a process has started.
fn children_of(process: i32) -> Vec<i32> {
    let processes = std::fs::read_dir("/proc").expect("/proc");
    let pids = processes.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    pids.filter(|pid| parent(*pid) == Some(process)).collect()
}

/// Returns all children of a process that run `armor DAEMON`.
pub fn daemons_of(process: i32, daemon: &str) -> Vec<i32> {
    let is_it = |pid: &i32| command_of(*pid).get(1).is_some_and(|word| word == daemon);
    children_of(process).into_iter().filter(is_it).collect()
}

/// Kills processes at the same time: they are stopped first, so that none sees the end of another.
pub fn kill_together(processes: &[i32]) {
    for signal in [Signal::STOP, Signal::KILL] {
        processes.iter().for_each(|pid| send_signal(*pid, signal));
    }
}

/// Whether `armor` can make control groups on this host.
pub fn has_control_groups(folder: &Folder) -> bool {
    let (_, out, err) = run_to_end(&mut folder.armor(&["doctor", "--format", "json"]));
    let lines = out.lines().filter_map(|line| serde_json::from_str(line).ok());
    let mut found = lines.filter(|one: &serde_json::Value| one["subject"] == "control group");
    found.next().unwrap_or_else(|| panic!("no control group in {out} {err}"))["condition"] == "ok"
}

impl Run {
    /// Returns the launcher's process id.
    pub fn pid(&self) -> i32 {
        i32::try_from(self.child.id()).expect("a process id")
    }

    /// Returns the folder that it writes into.
    pub fn out(&self) -> &Path {
        &self.out
    }

    /// Returns the log so far.
    pub fn log(&self) -> String {
        std::fs::read_to_string(self.out.join("logs/all.log")).unwrap_or_default()
    }

    /// Waits until the log contains `text` at least `times` times.
    pub fn wait_for_log(&self, text: &str, times: usize) {
        wait_for(&format!("{text:?} {times} times in {}", self.out.display()), || {
            (self.log().matches(text).count() >= times).then_some(())
        });
    }

    /// Sends a signal to the launcher.
    pub fn signal(&self, signal: Signal) {
        send_signal(self.pid(), signal);
    }

    /// Waits for the end and returns the exit code.
    pub fn code(&mut self) -> Option<i32> {
        wait_for("the end of the run", || self.child.try_wait().expect("it is ours")).code()
    }

    /// Returns the running processes that the launcher has started.
    pub fn children(&self) -> Vec<i32> {
        children_of(self.pid())
    }

    /// Returns whether a process runs the program `armor` itself.
    pub fn is_own(&self, pid: i32) -> bool {
        command_of(pid).first().is_some_and(|program| program.ends_with("armor"))
    }

    /// Returns its child that runs `armor DAEMON`.
    pub fn daemon(&self, daemon: &str) -> Option<i32> {
        self.daemons(daemon).into_iter().next()
    }

    /// Returns all of its children that run `armor DAEMON`.
    pub fn daemons(&self, daemon: &str) -> Vec<i32> {
        daemons_of(self.pid(), daemon)
    }

    /// Waits for its registry and returns the address.
    pub fn registry(&self) -> SocketAddr {
        wait_for("the registry", || {
            command_of(self.daemon("registry")?).into_iter().nth(3)?.parse().ok()
        })
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the command line of a process; empty if it has ended.
fn command_of(pid: i32) -> Vec<String> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    text.split('\0').map(String::from).collect()
}

/// Sends a signal.
pub fn send_signal(pid: i32, signal: Signal) {
    let pid = Pid::from_raw(pid).expect("a process id");
    // Fails if the process has already ended; the test detects that by what it waits for.
    let _ = kill_process(pid, signal);
}

/// Returns whether a process runs; a zombie does not.
pub fn is_alive(pid: i32) -> bool {
    stat(pid).is_some_and(|fields| fields[0] != "Z")
}

/// Returns the fields of `/proc/PID/stat` after the name: state, parent, …
fn stat(pid: i32) -> Option<Vec<String>> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    Some(text.rsplit_once(')')?.1.split_whitespace().map(String::from).collect())
}

fn parent(pid: i32) -> Option<i32> {
    stat(pid)?.get(1)?.parse().ok()
}

#[test]
fn folders_of_the_same_name_are_separate() {
    let (one, other) = (Folder::new("same"), Folder::new("same"));
    let file = other.write("kept", "");
    drop(one);
    assert!(file.exists(), "the end of one test removes nothing of another");
}
