//! The facts about this host that running a system depends on.

use std::fs;
use std::net::{Ipv4Addr, TcpListener, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use anyhow::Result;
use armor_robotfile::Finding;
use armor_wire::registry::DEFAULT_PORT;
use rustix::fs::{
    Access, MemfdFlags, SealFlags, access, fcntl_add_seals, ftruncate, memfd_create, statvfs,
};
use rustix::process::{Resource, Rlimit, getrlimit};

use super::network::{self, LoopbackFault};
use crate::kinds::Catalogue;
use crate::run::control_group::{ControlGroup, GroupObstacle};
use crate::run::cpu_share::{self, ShareObstacle};
use crate::run::port::LAST_PORT;

/// Bytes of shared memory that are tried: the longest message.
const SHARED_LEN: u64 = 64 << 20;
/// Longest wait for the resolver.
const RESOLVE_WITHIN: Duration = Duration::from_secs(3);

/// A limit of the process: what is in force, and what it may be raised to. None is unlimited.
pub type ProcessLimit = (Option<u64>, Option<u64>);

/// What was found on this host. A fact that the host does not tell is `None`.
#[derive(Clone, Debug, Default)]
pub struct HostFacts {
    /// Processor cores that this process may use.
    pub cores: usize,
    /// Memory that programs can get, in bytes.
    pub free_memory: Option<u64>,
    /// Open files per process.
    pub descriptors: ProcessLimit,
    /// Processes of this user.
    pub processes: ProcessLimit,
    /// Highest real-time priority (setrlimit(2), `RLIMIT_RTPRIO`).
    pub realtime: ProcessLimit,
    /// Largest send buffer that a socket gets, in bytes.
    pub send_buffer: Option<u64>,
    /// Watches and instances of inotify(7) for this user.
    pub watches: Option<(u64, u64)>,
    /// The folder for what a run produces, or the nearest folder above it that exists.
    pub out: PathBuf,
    /// Whether a file can be made there.
    pub is_out_writable: bool,
    /// Free bytes there.
    pub free_disk: Option<u64>,
    /// Why processes cannot share memory, if they cannot.
    pub shared_memory: Option<String>,
    /// Ports for a registry that are free, of all.
    pub registry_ports: (usize, usize),
    /// What keeps processes of this host from reaching each other.
    pub loopback: Option<LoopbackFault>,
    /// This host's name, and whether the resolver knows an address of it.
    pub name: (String, bool),
    /// Why the clock may not be right; none if a time service is known to keep it.
    pub clock_doubts: Option<String>,
    /// Why a run has no control groups, if it has none.
    pub control_group: Option<GroupObstacle>,
    /// Why a run could not limit the processors' time of a component, if it could not.
    pub cpu_shares: Option<ShareObstacle>,
    /// Kinds of components, and what is wrong with the component directories.
    pub kinds: usize,
    /// What is wrong with them.
    pub component_findings: Vec<Finding>,
    /// Whether a window can be opened.
    pub has_display: bool,
    /// The kernel's name and version.
    pub kernel: String,
}

impl HostFacts {
    /// Collects them. `out` is where a run would write.
    ///
    /// # Errors
    /// If a stock component is broken.
    pub fn collect(out: &Path, component_directories: &[PathBuf]) -> Result<Self> {
        let catalogue = Catalogue::gather(component_directories, [Path::new("robot.xml")])?;
        let existing = nearest_existing(out);
        let system = rustix::system::uname();
        let name = system.nodename().to_string_lossy().into_owned();
        let kernel = format!(
            "{} {}",
            system.sysname().to_string_lossy(),
            system.release().to_string_lossy()
        );
        let is_resolved = resolves(&name);
        let has_display = ["DISPLAY", "WAYLAND_DISPLAY"]
            .iter()
            .any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()));
        Ok(Self {
            cores: thread::available_parallelism().map_or(1, usize::from),
            free_memory: read_free_memory(),
            descriptors: read_limit(Resource::Nofile),
            processes: read_limit(Resource::Nproc),
            realtime: read_limit(Resource::Rtprio),
            send_buffer: read_number("/proc/sys/net/core/wmem_max"),
            watches: read_number("/proc/sys/fs/inotify/max_user_watches")
                .zip(read_number("/proc/sys/fs/inotify/max_user_instances")),
            is_out_writable: existing.is_dir()
                && read_free_space(&existing).is_some()
                && access(&existing, Access::WRITE_OK | Access::EXEC_OK).is_ok(),
            free_disk: read_free_space(&existing),
            out: existing,
            shared_memory: try_shared_memory().err().map(|error| error.to_string()),
            registry_ports: count_free_ports(),
            loopback: network::find_loopback_fault(),
            name: (name, is_resolved),
            clock_doubts: armor_executive::clock_doubts(),
            control_group: ControlGroup::make().err(),
            cpu_shares: cpu_share::foresee_obstacle(),
            kinds: catalogue.kinds.len(),
            component_findings: catalogue.findings(None),
            has_display,
            kernel,
        })
    }
}

/// Makes memory of the size that a link of large messages may need, as such a link does.
fn try_shared_memory() -> rustix::io::Result<()> {
    let file = memfd_create("armor-doctor", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
    ftruncate(&file, SHARED_LEN)?;
    fcntl_add_seals(&file, SealFlags::SHRINK)
}

/// Returns the path itself, or the nearest folder above it that exists.
fn nearest_existing(path: &Path) -> PathBuf {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let existing = whole.ancestors().find(|folder| folder.exists()).map(Path::to_path_buf);
    existing.unwrap_or(whole)
}

fn read_number(path: &str) -> Option<u64> {
    fs::read_to_string(path).ok()?.trim().parse().ok()
}

fn read_limit(resource: Resource) -> ProcessLimit {
    let Rlimit { current, maximum } = getrlimit(resource);
    (current, maximum)
}

fn read_free_space(path: &Path) -> Option<u64> {
    let space = statvfs(path).ok()?;
    // Without blocks it is no place for files, such as /proc.
    (space.f_blocks > 0).then(|| space.f_bavail.saturating_mul(space.f_frsize))
}

fn read_free_memory() -> Option<u64> {
    parse_free_memory(&fs::read_to_string("/proc/meminfo").ok()?)
}

/// Reads `MemAvailable` of proc_meminfo(5), in bytes.
fn parse_free_memory(text: &str) -> Option<u64> {
    let value = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = value.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

fn count_free_ports() -> (usize, usize) {
    let ports = DEFAULT_PORT..=LAST_PORT;
    let all = ports.clone().count();
    let free = ports.filter(|port| TcpListener::bind((Ipv4Addr::LOCALHOST, *port)).is_ok()).count();
    (free, all)
}

/// Returns whether the resolver knows the name. One that does not answer in time does not.
fn resolves(name: &str) -> bool {
    let (answer, answers) = mpsc::channel();
    let name = name.to_owned();
    thread::spawn(move || {
        let found = (name.as_str(), 0).to_socket_addrs().is_ok_and(|mut all| all.next().is_some());
        let _ = answer.send(found);
    });
    answers.recv_timeout(RESOLVE_WITHIN).unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_the_kernel_are_read() {
        let text = "MemTotal:       16384 kB\nMemAvailable:    2048 kB\n";
        assert_eq!(parse_free_memory(text), Some(2 << 20));
        assert_eq!(parse_free_memory("MemAvailable: many kB"), None);
    }

    #[test]
    fn a_folder_that_does_not_exist_yet_is_judged_by_the_one_above_it() {
        let folder = std::env::temp_dir();
        assert_eq!(nearest_existing(&folder.join("armor-never/there")), folder);
    }

    #[test]
    fn this_host_has_facts() {
        let facts = HostFacts::collect(Path::new("out"), &[]).unwrap();
        assert!(facts.cores > 0 && facts.kinds > 5, "{facts:?}");
        assert!(facts.descriptors.0.is_none_or(|count| count > 0), "{facts:?}");
        assert!(facts.loopback.is_none(), "{facts:?}");
        assert!(facts.kernel.starts_with("Linux "), "{facts:?}");
    }
}
