//! What the kernel states about a process in `/proc/PID/stat`, as proc(5) describes it.

/// The fields that are read, counted from the one after the name.
const STATE: usize = 0;
const PARENT: usize = 1;
const STARTED: usize = 19;

/// Returns the fields after the name, which may contain anything, from the text of the file.
pub fn split_fields(stat: &str) -> Option<impl Iterator<Item = &str>> {
    Some(stat.rsplit_once(')')?.1.split_whitespace())
}

/// Returns the state of a process: `R`, `S`, `T` and others; none if it has ended.
pub fn read_state(pid: u32) -> Option<char> {
    read_field(pid, STATE)?.chars().next()
}

/// Returns the parent of a process; none if it has ended.
pub fn read_parent(pid: u32) -> Option<u32> {
    read_field(pid, PARENT)?.parse().ok()
}

/// Returns when a process has started, in ticks since the host has; none if it has ended.
pub fn read_start(pid: u32) -> Option<u64> {
    read_field(pid, STARTED)?.parse().ok()
}

fn read_field(pid: u32, at: usize) -> Option<String> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    Some(split_fields(&stat)?.nth(at)?.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_may_contain_parentheses_and_spaces() {
        let stat = "4711 (a ) b) S 1 4711";
        let fields: Vec<_> = split_fields(stat).expect("it has a name").collect();
        assert_eq!(fields, ["S", "1", "4711"]);
        assert!(split_fields("4711 (a").is_none());
    }

    #[test]
    fn this_process_runs_and_has_a_parent() {
        let own = std::process::id();
        assert!(read_state(own).is_some_and(|state| "RS".contains(state)));
        assert_eq!(read_parent(own), Some(std::os::unix::process::parent_id()));
        assert!(read_start(own).is_some_and(|started| started > 0));
        assert_eq!(read_state(u32::MAX), None);
    }
}
