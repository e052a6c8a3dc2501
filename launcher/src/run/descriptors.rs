//! File descriptors: how many a run needs, and the limit that all of its processes inherit.

use anyhow::{Result, bail};
use armor_robotfile::Configuration;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// What the launcher has open without any process: its record, sockets, signals, the log, the status
/// line, and room for tools and for what is open only for a moment while a process starts.
const OF_LAUNCHER: u64 = 40;
/// What the launcher has open for each process: two pipes, the process, its log file, and for a
/// component the control connection (two).
const PER_PROCESS: u64 = 6;
/// What a component has open without links.
const OF_COMPONENT: u64 = 24;
/// What a component has open for each of its links.
const PER_LINK: u64 = 2;
/// Most that is asked of the kernel where there is no hard limit.
const UNLIMITED: u64 = 1 << 20;

/// Returns the number of descriptors that the largest process of a run needs: `processes` of them
/// under the launcher, and the links of the file.
pub fn count_needed(configuration: &Configuration, processes: usize) -> u64 {
    let launcher = OF_LAUNCHER + PER_PROCESS * processes as u64;
    let most_links = configuration.system.components.iter().map(|component| {
        let name = component.name.value.as_str();
        let ends = configuration.system.links.iter().flat_map(|link| [&link.from, &link.to]);
        ends.filter(|end| end.component.value == name).count() as u64
    });
    launcher.max(OF_COMPONENT + PER_LINK * most_links.max().unwrap_or(0))
}

/// Raises the limit to the most that is allowed.
///
/// # Errors
/// If that is less than `needed`.
pub fn raise_limit(needed: u64) -> Result<()> {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    let most = maximum.unwrap_or(UNLIMITED);
    let raised = current.is_some_and(|current| current < most)
        && setrlimit(Resource::Nofile, Rlimit { current: Some(most), maximum }).is_ok();
    let limit = if raised { most } else { current.unwrap_or(UNLIMITED) };
    if limit < needed {
        bail!(
            "this system needs {needed} file descriptors, and the limit is {limit}: run \
             `ulimit -n {needed}` first; where that is refused, raise the hard limit (`nofile` in \
             /etc/security/limits.conf, or `LimitNOFILE={needed}` in the service of systemd)"
        );
    }
    Ok(())
}

/// Returns whether this process can open another file.
pub fn has_free_descriptor() -> bool {
    std::fs::File::open("/dev/null").is_ok()
}
