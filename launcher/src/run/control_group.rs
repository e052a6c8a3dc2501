//! A control group for each run (cgroups(7), version 2), and one in it for each process: what
//! a component has started can leave its process group, its session and its variables, but not this.
//!
//! The launcher holds a lock on the folder of its group. A group whose lock can be taken is that of a
//! launcher that has died, and the next one kills what is left in it.

use std::fmt::{self, Display, Formatter};
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{Access, access};
use rustix::process::geteuid;

use super::cpu_share;

/// What the names of all groups of runs begin with; the launcher's process id follows.
const PREFIX: &str = "armor-";
/// How many names are tried: another launcher may remove a new group before it is locked.
const MAX_ATTEMPTS: u32 = 8;
/// Most groups of this host that are searched for those of dead launchers.
const MAX_SEARCHED: usize = 10_000;
/// Most looks at whether a killed group is empty, with a rest between two.
const MAX_LOOKS: u32 = 50;
/// Rest between two looks, in which killed processes end.
const REST: Duration = Duration::from_millis(10);

/// Why no control groups can be made here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GroupObstacle {
    /// The hierarchy of version 2 is not mounted, or not with the group of this process.
    NotMounted,
    /// The group of this process belongs to another user, or is mounted read-only.
    NotOwn,
    /// The kernel cannot kill a group.
    OldKernel,
}

/// The control group of a run.
#[derive(Debug)]
pub struct ControlGroup {
    path: PathBuf,
    _lock: File,
}

/// The control group of one process of a run, and of all that it starts.
#[derive(Clone, Debug)]
pub struct ProcessControlGroup(PathBuf);

impl ControlGroup {
    /// Makes one in the group of this process.
    ///
    /// # Errors
    /// If this host allows none.
    pub fn make() -> Result<Self, GroupObstacle> {
        let own = find_own()?;
        for _ in 0..MAX_ATTEMPTS {
            let random = armor_socket::random_id();
            let path = own.join(format!("{PREFIX}{}-{random:016x}", std::process::id()));
            fs::create_dir(&path).map_err(|_| GroupObstacle::NotOwn)?;
            match lock(&path) {
                Ok(Some(lock)) => {
                    let group = Self { path, _lock: lock };
                    return examine(&group.path).map(|()| group);
                }
                // Another launcher has taken it for a left one.
                Ok(None) => {}
                Err(_) => break,
            }
        }
        Err(GroupObstacle::NotOwn)
    }

    /// Its folder, for a process that kills it when this one cannot.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the group of a process, or returns the one that exists.
    ///
    /// # Errors
    /// If the kernel refuses it, such as at its limit of groups.
    pub fn make_for(&self, process: &str) -> io::Result<ProcessControlGroup> {
        let path = self.path.join(process);
        // Limits of a process need the controller in the group of the run.
        cpu_share::pass_on(&self.path);
        match fs::create_dir(&path) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
            _ => Ok(ProcessControlGroup(path)),
        }
    }
}

impl Drop for ControlGroup {
    fn drop(&mut self) {
        kill_and_remove(&self.path);
    }
}

impl ProcessControlGroup {
    /// Its folder, which the guard of the process enters.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Kills all that is left in it, and removes it.
    pub fn kill(&self) {
        kill_and_remove(&self.0);
    }
}

impl Display for GroupObstacle {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotMounted => "cgroup v2 is not mounted",
            Self::NotOwn => "the control group of this process (cgroup v2) cannot be divided",
            Self::OldKernel => "the kernel cannot kill a control group",
        })
    }
}

/// Moves this process, and so the program that it becomes, into the group.
///
/// # Errors
/// If the kernel refuses it.
pub fn enter(path: &Path) -> io::Result<()> {
    // 0 is the process that writes.
    fs::write(path.join("cgroup.procs"), "0")
}

/// Kills all processes of the group, waits until they have ended, and removes it.
pub fn kill_and_remove(path: &Path) {
    // It may have been removed already.
    let _ = fs::write(path.join("cgroup.kill"), "1");
    for _ in 0..MAX_LOOKS {
        if !is_populated(path) {
            break;
        }
        std::thread::sleep(REST);
    }
    remove(path);
}

/// Kills what launchers that have died have left, and returns the number of their groups that had
/// processes.
pub fn kill_left_groups() -> usize {
    let mounts = fs::read_to_string("/proc/self/mountinfo").unwrap_or_default();
    let Some((_, root)) = find_mount(&mounts) else { return 0 };
    let mut unseen = vec![root];
    let (mut searched, mut killed) = (0, 0);
    while let Some(folder) = unseen.pop() {
        searched += 1;
        if searched > MAX_SEARCHED {
            break;
        }
        let is_of_run = folder.file_name().and_then(|name| name.to_str()).is_some_and(is_of_run);
        if is_of_run && let Ok(Some(lock)) = lock(&folder) {
            killed += usize::from(is_populated(&folder));
            kill_and_remove(&folder);
            drop(lock);
            continue;
        }
        unseen.extend(list_groups(&folder));
    }
    killed
}

/// Finds the group of this process that can be divided.
pub fn find_own() -> Result<PathBuf, GroupObstacle> {
    let read = |path| fs::read_to_string(path).unwrap_or_default();
    let own = locate_own(&read("/proc/self/mountinfo"), &read("/proc/self/cgroup"));
    let own = own.map(cpu_share::leave_leaf);
    let own = own.filter(|own| own.join("cgroup.procs").exists());
    let own = own.ok_or(GroupObstacle::NotMounted)?;
    // A process moves only between groups whose common one its user may write.
    let is_writable = |path: &Path| access(path, Access::WRITE_OK).is_ok();
    let is_own = is_writable(&own) && is_writable(&own.join("cgroup.procs"));
    if is_own { Ok(own) } else { Err(GroupObstacle::NotOwn) }
}

/// Whether a new group takes processes and can be killed.
fn examine(path: &Path) -> Result<(), GroupObstacle> {
    if !path.join("cgroup.kill").exists() {
        return Err(GroupObstacle::OldKernel);
    }
    // A group within one for threads takes no processes.
    let kind = fs::read_to_string(path.join("cgroup.type")).unwrap_or_default();
    if kind.trim() == "domain" { Ok(()) } else { Err(GroupObstacle::NotOwn) }
}

/// Returns the folder of the group that `cgroup` (/proc/PID/cgroup) names, by the mounts in `mountinfo`.
fn locate_own(mountinfo: &str, cgroup: &str) -> Option<PathBuf> {
    let (root, mount) = find_mount(mountinfo)?;
    let own = cgroup.lines().find_map(|line| line.strip_prefix("0::"))?;
    // Outside of what is mounted here, such as in a container.
    let own = Path::new(own).strip_prefix(root).ok()?;
    (!own.starts_with("..")).then(|| mount.join(own))
}

/// Returns the group that is mounted, and where (proc_pid_mountinfo(5)).
fn find_mount(mountinfo: &str) -> Option<(PathBuf, PathBuf)> {
    mountinfo.lines().find_map(|line| {
        let (mount, system) = line.split_once(" - ")?;
        let mut fields = mount.split(' ').skip(3);
        let (root, point) = (fields.next()?, fields.next()?);
        // A backslash begins the number of a character, such as a space: no usual place.
        let is_it = system.starts_with("cgroup2 ") && !point.contains('\\');
        is_it.then(|| (root.into(), point.into()))
    })
}

fn is_of_run(name: &str) -> bool {
    let number = name.strip_prefix(PREFIX).and_then(|rest| rest.split_once('-'));
    number.is_some_and(|(pid, random)| pid.parse::<u32>().is_ok() && random.len() == 16)
}

/// Locks the folder of a group of this user, if no other process has locked it and it still exists.
fn lock(path: &Path) -> io::Result<Option<File>> {
    let folder = File::open(path)?;
    let metadata = folder.metadata()?;
    if metadata.uid() != geteuid().as_raw() || folder.try_lock().is_err() {
        return Ok(None);
    }
    let is_same = fs::metadata(path).is_ok_and(|now| now.ino() == metadata.ino());
    Ok(is_same.then_some(folder))
}

fn is_populated(path: &Path) -> bool {
    let events = fs::read_to_string(path.join("cgroup.events")).unwrap_or_default();
    events.lines().any(|line| line == "populated 1")
}

fn list_groups(path: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(path) else { return Vec::new() };
    let folders = entries.filter_map(Result::ok);
    let folders = folders.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    folders.map(|entry| entry.path()).collect()
}

/// Removes a group without processes, and those in it.
fn remove(path: &Path) {
    list_groups(path).iter().for_each(|inner| remove(inner));
    let _ = fs::remove_dir(path);
}

#[cfg(test)]
mod tests {
    use std::process::{Child, Command};

    use super::*;

    const MOUNTS: &str = "\
        22 1 8:1 / / rw - ext4 /dev/root rw\n\
        29 22 0:25 /user.slice /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw\n";

    #[test]
    fn the_own_group_is_found_below_what_is_mounted() {
        let check = |cgroup: &str, expected: Option<&str>| {
            let found = locate_own(MOUNTS, cgroup);
            assert_eq!(found.as_deref(), expected.map(Path::new), "{cgroup}");
        };
        check("1:name=systemd:/a\n0::/user.slice/a.scope\n", Some("/sys/fs/cgroup/a.scope"));
        check("0::/user.slice\n", Some("/sys/fs/cgroup"));
        check("0::/system.slice\n", None);
        check("1:cpu:/\n", None);
        assert_eq!(locate_own("", "0::/\n"), None);
    }

    #[test]
    fn only_groups_of_runs_are_taken_for_such() {
        assert!(is_of_run("armor-17-00112233445566aa"));
        for other in ["armor-17", "armor-trial-00112233445566aa", "armor.service", "user.slice"] {
            assert!(!is_of_run(other), "{other}");
        }
    }

    /// A process in the group, which a shell enters as the guard does.
    fn run_in(group: &ProcessControlGroup) -> Child {
        let script = "echo 0 > \"$0/cgroup.procs\"; echo; exec setsid env -i sleep 600";
        let mut command = Command::new("sh");
        command.arg("-c").arg(script).arg(group.path()).stdout(std::process::Stdio::piped());
        let mut child = command.spawn().expect("sh runs");
        let mut byte = [0];
        let mut out = child.stdout.take().expect("it is a pipe");
        io::Read::read_exact(&mut out, &mut byte).expect("it has entered");
        child
    }

    #[test]
    fn what_a_process_has_left_ends_with_its_group_and_all_with_the_run() {
        let Ok(run) = ControlGroup::make() else { return };
        let [one, other] = ["a", "b"].map(|name| run.make_for(name).expect("it is made"));
        let mut children = [run_in(&one), run_in(&other)];
        one.kill();
        assert!(!children[0].wait().expect("it is ours").success());
        assert!(!one.path().exists());
        assert_eq!(children[1].try_wait().expect("it is ours"), None, "it is in another group");
        let path = run.path().to_owned();
        kill_left_groups();
        assert_eq!(children[1].try_wait().expect("it is ours"), None, "its launcher lives");
        drop(run);
        assert!(!children[1].wait().expect("it is ours").success());
        assert!(!path.exists());
    }

    #[test]
    fn what_a_dead_launcher_has_left_is_killed() {
        let Ok(run) = ControlGroup::make() else { return };
        let path = run.path().to_owned();
        let mut child = run_in(&run.make_for("a").expect("it is made"));
        // The kernel frees the lock of a process that dies.
        run._lock.unlock().expect("it was locked");
        // Another test may do it at this moment.
        kill_left_groups();
        assert!(!child.wait().expect("it is ours").success());
        kill_and_remove(&path);
        assert!(!path.exists());
    }
}
