//! What the facts about a host mean for a system, and what to do.

use std::borrow::Cow;

use super::host::{HostFacts, ProcessLimit};
use super::network::LoopbackFault;
use crate::run::control_group::GroupObstacle;
use crate::run::cpu_share::ShareObstacle;
use armor_wire::hello::VERSION;

/// Descriptors of a system of 100 components, measured as about 5 each in the launcher, and as many
/// links in a component with many.
const MANY_DESCRIPTORS: u64 = 1024;
/// Descriptors without which no system of a few components starts.
const FEW_DESCRIPTORS: u64 = 128;
/// Processes and threads of a system of some dozen components.
const MANY_PROCESSES: u64 = 1024;
/// Send buffer that a link asks for.
const LINK_BUFFER_LEN: u64 = 4 << 20;
/// Disk that an hour of a run's logs, journal and maps fits into.
const MUCH_DISK: u64 = 1 << 30;
/// Disk without which a run is about to fail.
const LITTLE_DISK: u64 = 50 << 20;
/// Memory of the daemons, a dozen components and a map.
const MUCH_MEMORY: u64 = 512 << 20;
/// Files that configd and the designer watch.
const MANY_WATCHES: u64 = 1024;
/// Watching processes: configd and a designer for each system.
const MANY_INSTANCES: u64 = 16;

/// How something on the host is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum HostCondition {
    /// As it has to be.
    Good,
    /// Worth knowing.
    Note,
    /// Some systems will not work as they should.
    Warning,
    /// No system will work.
    Fault,
}

impl HostCondition {
    /// All of them.
    const ALL: [Self; 4] = [Self::Good, Self::Note, Self::Warning, Self::Fault];

    /// Returns the one of this name; a note for one that is not known.
    pub fn named(name: &str) -> Self {
        Self::ALL.into_iter().find(|one| one.as_str() == name).unwrap_or(Self::Note)
    }

    /// Its name, for people and programs.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Good => "ok",
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Fault => "fault",
        }
    }
}

/// What was found about one subject.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnosis {
    /// The other host that has found it of itself; none for what was found here.
    pub host: Option<String>,
    /// What it is about, in one or two words.
    pub subject: Cow<'static, str>,
    /// How it is.
    pub condition: HostCondition,
    /// What was found.
    pub found: String,
    /// What to do; empty if nothing.
    pub remedy: String,
}

impl Diagnosis {
    /// One that needs no remedy.
    pub fn good(subject: impl Into<Cow<'static, str>>, found: impl Into<String>) -> Self {
        Self::new(subject, HostCondition::Good, found, "")
    }

    /// One of this host.
    pub fn new(
        subject: impl Into<Cow<'static, str>>,
        condition: HostCondition,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let (subject, found, remedy) = (subject.into(), found.into(), remedy.into());
        Self { host: None, subject, condition, found, remedy }
    }
}

/// Judges all facts, in the order in which they are printed.
pub fn diagnose(facts: &HostFacts) -> Vec<Diagnosis> {
    let mut all = vec![
        Diagnosis::good(
            "versions",
            format!(
                "armor {}, protocol {VERSION}, {}, {}",
                env!("CARGO_PKG_VERSION"),
                facts.kernel,
                count_cores(facts.cores)
            ),
        ),
        diagnose_memory(facts.free_memory),
        diagnose_descriptors(facts.descriptors),
        diagnose_processes(facts.processes),
        diagnose_loopback(facts.loopback.as_ref()),
        diagnose_ports(facts.registry_ports),
        diagnose_name(&facts.name),
        diagnose_disk(facts),
        diagnose_send_buffer(facts.send_buffer),
        diagnose_watches(facts.watches),
        diagnose_shared_memory(facts.shared_memory.as_deref()),
        diagnose_clock(facts.clock_doubts.as_deref()),
        diagnose_realtime(facts.realtime),
        diagnose_control_group(facts.control_group),
        diagnose_cpu_shares(facts.cpu_shares.as_ref()),
        diagnose_display(facts.has_display),
    ];
    all.extend(diagnose_components(facts));
    all
}

fn count_cores(cores: usize) -> String {
    if cores == 1 { "1 core".to_owned() } else { format!("{cores} cores") }
}

fn diagnose_memory(free: Option<u64>) -> Diagnosis {
    const SUBJECT: &str = "memory";
    match free {
        None => Diagnosis::new(SUBJECT, HostCondition::Note, "/proc/meminfo cannot be read", ""),
        Some(free) if free < MUCH_MEMORY => {
            let found = format!("{} can be had", format_bytes(free));
            Diagnosis::new(
                SUBJECT,
                HostCondition::Warning,
                found,
                "end programs that are not needed",
            )
        }
        Some(free) => Diagnosis::good(SUBJECT, format!("{} can be had", format_bytes(free))),
    }
}

fn diagnose_descriptors((current, maximum): ProcessLimit) -> Diagnosis {
    const SUBJECT: &str = "descriptors";
    let found = format!("{} open files per process", format_limit(current, maximum));
    if let Some(count) = maximum.filter(|count| *count < MANY_DESCRIPTORS) {
        let condition =
            if count < FEW_DESCRIPTORS { HostCondition::Fault } else { HostCondition::Warning };
        let remedy = format!(
            "raise the hard limit: `* hard nofile {MANY_DESCRIPTORS}` in /etc/security/limits.conf, \
             or LimitNOFILE= of the service; then log in again"
        );
        return Diagnosis::new(SUBJECT, condition, found, remedy);
    }
    if current.is_some_and(|count| count < MANY_DESCRIPTORS) {
        let remedy = format!("for a large system: `ulimit -n {MANY_DESCRIPTORS}`");
        return Diagnosis::new(SUBJECT, HostCondition::Note, found, remedy);
    }
    Diagnosis::good(SUBJECT, found)
}

fn diagnose_processes((current, maximum): ProcessLimit) -> Diagnosis {
    const SUBJECT: &str = "processes";
    let found = format!("{} processes and threads of this user", format_limit(current, maximum));
    if current.is_some_and(|count| count < MANY_PROCESSES) {
        let remedy = format!("`ulimit -u {MANY_PROCESSES}`, or nproc in /etc/security/limits.conf");
        return Diagnosis::new(SUBJECT, HostCondition::Warning, found, remedy);
    }
    Diagnosis::good(SUBJECT, found)
}

fn diagnose_loopback(fault: Option<&LoopbackFault>) -> Diagnosis {
    const SUBJECT: &str = "loopback";
    let (found, remedy) = match fault {
        None => return Diagnosis::good(SUBJECT, "processes of this host reach each other"),
        Some(LoopbackFault::Listen(why)) => (
            format!("nothing can listen on 127.0.0.1: {why}"),
            "bring the device up: `ip link set lo up`",
        ),
        Some(LoopbackFault::Connect(why)) => (
            format!("a connection within this host fails: {why}"),
            "allow the device lo in the firewall: `nft list ruleset` shows its rules",
        ),
        Some(LoopbackFault::Owner(why)) => (
            format!("the kernel does not say which user a connection belongs to: {why}"),
            "load its module (`modprobe tcp_diag inet_diag`), or allow NETLINK_SOCK_DIAG in the \
             sandbox; without it TCP connections are refused (docs/security.md)",
        ),
    };
    Diagnosis::new(SUBJECT, HostCondition::Fault, found, remedy)
}

fn diagnose_ports((free, all): (usize, usize)) -> Diagnosis {
    const SUBJECT: &str = "ports";
    let found = format!("{free} of {all} ports for registries are free");
    match free {
        0 => Diagnosis::new(
            SUBJECT,
            HostCondition::Fault,
            found,
            "stop systems that are not needed (`armor stop --all`), or give `armor run` another \
             --registry",
        ),
        _ => Diagnosis::good(SUBJECT, found),
    }
}

fn diagnose_name((name, is_resolved): &(String, bool)) -> Diagnosis {
    const SUBJECT: &str = "name";
    if *is_resolved {
        return Diagnosis::good(SUBJECT, format!("{name}, which the resolver knows"));
    }
    let found = format!("{name}, which the resolver does not know");
    let remedy = format!("add `127.0.1.1 {name}` to /etc/hosts if other programs need it");
    Diagnosis::new(SUBJECT, HostCondition::Note, found, remedy)
}

fn diagnose_disk(facts: &HostFacts) -> Diagnosis {
    const SUBJECT: &str = "disk";
    let folder = facts.out.display();
    if !facts.is_out_writable {
        let found = format!("{folder} cannot be written");
        let remedy = "choose another folder with `armor run --out DIR`";
        return Diagnosis::new(SUBJECT, HostCondition::Fault, found, remedy);
    }
    let Some(free) = facts.free_disk else {
        return Diagnosis::new(
            SUBJECT,
            HostCondition::Note,
            format!("{folder}: size not known"),
            "",
        );
    };
    let found = format!("{} free in {folder}", format_bytes(free));
    let remedy = "free some space, or choose another disk with `armor run --out DIR`";
    match free {
        free if free < LITTLE_DISK => Diagnosis::new(SUBJECT, HostCondition::Fault, found, remedy),
        free if free < MUCH_DISK => Diagnosis::new(SUBJECT, HostCondition::Warning, found, remedy),
        _ => Diagnosis::good(SUBJECT, found),
    }
}

fn diagnose_send_buffer(largest: Option<u64>) -> Diagnosis {
    const SUBJECT: &str = "send buffers";
    let Some(largest) = largest else {
        return Diagnosis::new(SUBJECT, HostCondition::Note, "net.core.wmem_max is not known", "");
    };
    let found = format!("at most {} per link (net.core.wmem_max)", format_bytes(largest));
    if largest >= LINK_BUFFER_LEN {
        return Diagnosis::good(SUBJECT, found);
    }
    let remedy = format!(
        "for messages of a megabyte and more: `sudo sysctl -w net.core.wmem_max={LINK_BUFFER_LEN}`"
    );
    Diagnosis::new(SUBJECT, HostCondition::Note, found, remedy)
}

fn diagnose_watches(watches: Option<(u64, u64)>) -> Diagnosis {
    const SUBJECT: &str = "file watches";
    let Some((files, instances)) = watches else {
        let remedy = "configd and the designer ask for changes of their files from time to time";
        return Diagnosis::new(SUBJECT, HostCondition::Note, "inotify cannot be asked", remedy);
    };
    let found = format!("{files} files, {instances} programs that watch (inotify)");
    if files >= MANY_WATCHES && instances >= MANY_INSTANCES {
        return Diagnosis::good(SUBJECT, found);
    }
    let remedy = "`sudo sysctl -w fs.inotify.max_user_watches=65536 \
                  fs.inotify.max_user_instances=128`";
    Diagnosis::new(SUBJECT, HostCondition::Warning, found, remedy)
}

fn diagnose_shared_memory(obstacle: Option<&str>) -> Diagnosis {
    const SUBJECT: &str = "shared memory";
    match obstacle {
        None => Diagnosis::good(SUBJECT, "links of large messages can share memory (memfd)"),
        Some(obstacle) => Diagnosis::new(
            SUBJECT,
            HostCondition::Note,
            format!("processes cannot share memory: {obstacle}"),
            "large messages go through sockets, which costs more time; allow memfd_create and its \
             seals in the sandbox, and a file size (`ulimit -f`) of 64 MiB and more",
        ),
    }
}

fn diagnose_clock(doubts: Option<&str>) -> Diagnosis {
    const SUBJECT: &str = "clock";
    let Some(doubts) = doubts else { return Diagnosis::good(SUBJECT, "kept by a time service") };
    let remedy = "`timedatectl set-ntp true`, or chrony; only the dates in logs, and missions with \
                  dates, depend on it";
    let found = format!("no time service is known to keep it: {doubts}");
    Diagnosis::new(SUBJECT, HostCondition::Note, found, remedy)
}

fn diagnose_realtime((current, _): ProcessLimit) -> Diagnosis {
    const SUBJECT: &str = "real time";
    match current {
        Some(0) => Diagnosis::new(
            SUBJECT,
            HostCondition::Note,
            "this user may not use real-time priorities",
            "needed only by components that ask for one: `* - rtprio 50` in \
             /etc/security/limits.conf",
        ),
        Some(priority) => Diagnosis::good(SUBJECT, format!("priorities up to {priority}")),
        None => Diagnosis::good(SUBJECT, "all priorities"),
    }
}

fn diagnose_cpu_shares(obstacle: Option<&ShareObstacle>) -> Diagnosis {
    const SUBJECT: &str = "cpu shares";
    let Some(obstacle) = obstacle else {
        return Diagnosis::good(SUBJECT, "the file may limit the processor time of a component");
    };
    Diagnosis::new(
        SUBJECT,
        HostCondition::Note,
        format!("the processor time of a component cannot be limited: {obstacle}"),
        format!("needed only by components with `cpu` in the file: {}", obstacle.remedy()),
    )
}

fn diagnose_control_group(obstacle: Option<GroupObstacle>) -> Diagnosis {
    const SUBJECT: &str = "control group";
    let Some(obstacle) = obstacle else {
        let found = "each process gets its own: nothing that it starts outlives it (cgroup v2)";
        return Diagnosis::good(SUBJECT, found);
    };
    let found = format!(
        "{obstacle}, so processes that a component starts can outlive it: those that leave their \
         session and clear their environment"
    );
    let remedy = match obstacle {
        GroupObstacle::NotMounted => "boot with `systemd.unified_cgroup_hierarchy=1`",
        GroupObstacle::NotOwn => {
            "start in a group of its own: `systemd-run --user --scope -p Delegate=yes armor run …`, \
             or with `Delegate=yes` in the service of systemd"
        }
        GroupObstacle::OldKernel => "use Linux 5.14 or newer",
    };
    Diagnosis::new(SUBJECT, HostCondition::Note, found, remedy)
}

fn diagnose_display(has_display: bool) -> Diagnosis {
    const SUBJECT: &str = "display";
    if has_display {
        return Diagnosis::good(SUBJECT, "windows can be opened");
    }
    let remedy = "the designer and the operator's screen need one; `armor run --headless` does not";
    Diagnosis::new(
        SUBJECT,
        HostCondition::Note,
        "neither DISPLAY nor WAYLAND_DISPLAY is set",
        remedy,
    )
}

fn diagnose_components(facts: &HostFacts) -> Vec<Diagnosis> {
    const SUBJECT: &str = "components";
    let found = format!("{} kinds", facts.kinds);
    let problems = facts.component_findings.iter().map(|finding| {
        let found = format!("{} ({})", finding.message, finding.code.as_str());
        Diagnosis::new(SUBJECT, HostCondition::Warning, found, finding.remedy.clone())
    });
    [Diagnosis::good(SUBJECT, found)].into_iter().chain(problems).collect()
}

fn format_limit(current: Option<u64>, maximum: Option<u64>) -> String {
    match (current, maximum) {
        (None, _) => "any number of".to_owned(),
        (Some(current), Some(maximum)) if maximum > current => {
            format!("{current} (up to {maximum} can be had)")
        }
        (Some(current), None) => format!("{current} (any number can be had)"),
        (Some(current), _) => current.to_string(),
    }
}

fn format_bytes(bytes: u64) -> String {
    let units = [("GiB", 30), ("MiB", 20), ("KiB", 10)];
    let unit = units.iter().find(|(_, power)| bytes >> power > 0);
    unit.map_or_else(
        || format!("{bytes} B"),
        |(unit, power)| format!("{:.1} {unit}", bytes as f64 / f64::from(1_u32 << power)),
    )
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn healthy() -> HostFacts {
        HostFacts {
            cores: 4,
            free_memory: Some(8 << 30),
            descriptors: (Some(1024), Some(1 << 20)),
            processes: (None, None),
            realtime: (Some(99), Some(99)),
            send_buffer: Some(4 << 20),
            watches: Some((65536, 128)),
            out: PathBuf::from("/data/out"),
            is_out_writable: true,
            free_disk: Some(20 << 30),
            shared_memory: None,
            registry_ports: (101, 101),
            loopback: None,
            name: ("robot".to_owned(), true),
            clock_doubts: None,
            control_group: None,
            cpu_shares: None,
            kinds: 11,
            component_findings: Vec::new(),
            has_display: true,
            kernel: "Linux 6.18".to_owned(),
        }
    }

    fn of_subject(facts: &HostFacts, subject: &str) -> Diagnosis {
        diagnose(facts).into_iter().find(|one| one.subject == subject).unwrap()
    }

    #[test]
    fn a_healthy_host_has_nothing_to_mend() {
        for one in diagnose(&healthy()) {
            assert_eq!((one.condition, one.remedy.as_str()), (HostCondition::Good, ""), "{one:?}");
        }
    }

    #[test]
    fn everything_that_is_wrong_has_a_remedy() {
        type Change = fn(&mut HostFacts);
        let cases: [(&str, HostCondition, Change); 19] = [
            ("memory", HostCondition::Warning, |it| it.free_memory = Some(100 << 20)),
            ("descriptors", HostCondition::Fault, |it| it.descriptors = (Some(64), Some(64))),
            ("descriptors", HostCondition::Warning, |it| it.descriptors = (Some(256), Some(512))),
            ("descriptors", HostCondition::Note, |it| it.descriptors = (Some(256), Some(4096))),
            ("processes", HostCondition::Warning, |it| it.processes = (Some(100), None)),
            ("loopback", HostCondition::Fault, |it| {
                it.loopback = Some(LoopbackFault::Owner("not supported".into()));
            }),
            ("ports", HostCondition::Fault, |it| it.registry_ports = (0, 101)),
            ("name", HostCondition::Note, |it| it.name.1 = false),
            ("disk", HostCondition::Fault, |it| it.is_out_writable = false),
            ("disk", HostCondition::Fault, |it| it.free_disk = Some(1 << 20)),
            ("disk", HostCondition::Warning, |it| it.free_disk = Some(200 << 20)),
            ("send buffers", HostCondition::Note, |it| it.send_buffer = Some(212_992)),
            ("file watches", HostCondition::Warning, |it| it.watches = Some((65536, 1))),
            ("shared memory", HostCondition::Note, |it| {
                it.shared_memory = Some("not permitted".into());
            }),
            ("cpu shares", HostCondition::Note, |it| {
                it.cpu_shares = Some(ShareObstacle::NoController);
            }),
            ("cpu shares", HostCondition::Note, |it| {
                it.cpu_shares = Some(ShareObstacle::Shared(7));
            }),
            ("clock", HostCondition::Note, |it| {
                it.clock_doubts = Some("chronyc is missing".into());
            }),
            ("real time", HostCondition::Note, |it| it.realtime = (Some(0), Some(0))),
            ("control group", HostCondition::Note, |it| {
                it.control_group = Some(GroupObstacle::NotOwn);
            }),
        ];
        for (subject, condition, change) in cases {
            let mut facts = healthy();
            change(&mut facts);
            let diagnosis = of_subject(&facts, subject);
            assert_eq!(diagnosis.condition, condition, "{diagnosis:?}");
            assert!(!diagnosis.remedy.is_empty(), "{diagnosis:?}");
        }
    }

    #[test]
    fn sizes_and_limits_are_readable() {
        assert_eq!(format_bytes(512), "512 B");
        assert_eq!(format_bytes(3 << 29), "1.5 GiB");
        assert_eq!(format_limit(None, None), "any number of");
        assert_eq!(format_limit(Some(64), Some(64)), "64");
        assert_eq!(format_limit(Some(64), Some(128)), "64 (up to 128 can be had)");
    }
}
