//! Which process holds a port that this one needs, as far as the kernel reports it.

use std::fs;
use std::io;
use std::net::SocketAddr;
use std::path::Path;

use rustix::process::geteuid;

use crate::owner::find_listener;

/// Returns why listening on `address` has failed with `error`. For a port that is in use: the
/// process that holds it, and whether this user can end it.
pub fn explain_bind_error(address: SocketAddr, error: &io::Error) -> String {
    if error.kind() != io::ErrorKind::AddrInUse {
        return error.to_string();
    }
    let own = geteuid().as_raw();
    match find_listener(address) {
        None => "the address is in use".to_owned(),
        Some((user, inode)) => {
            let process = find_process(inode).map(|(pid, name)| format!("{pid} ({name})"));
            describe_holder(user, own, process.as_deref())
        }
    }
}

/// `process`: its number and name, if this user may see them.
fn describe_holder(user: u32, own: u32, process: Option<&str>) -> String {
    let process = process.map_or_else(|| "a process".to_owned(), |it| format!("process {it}"));
    if user == own {
        return format!("{process} of this user already listens there; end it if it is not needed");
    }
    format!("{process} of user {user} already listens there, which only that user and root can end")
}

/// Returns the process id of the process that listens on `address`, if this user may know.
pub fn find_holder(address: SocketAddr) -> Option<u32> {
    let (_, inode) = find_listener(address)?;
    find_process(inode).map(|(pid, _)| pid)
}

/// Returns the number and the name of the process that has the socket with this inode open. Those
/// of other users are visible only to root.
fn find_process(inode: u32) -> Option<(u32, String)> {
    let socket = format!("socket:[{inode}]");
    let holds = |process: &Path| {
        let files = fs::read_dir(process.join("fd")).ok()?;
        let mut targets = files.filter_map(|file| fs::read_link(file.ok()?.path()).ok());
        targets.any(|target| target.as_os_str() == socket.as_str()).then_some(())
    };
    fs::read_dir("/proc").ok()?.find_map(|entry| {
        let entry = entry.ok()?;
        let number: u32 = entry.file_name().to_str()?.parse().ok()?;
        holds(&entry.path())?;
        let name = fs::read_to_string(entry.path().join("comm")).unwrap_or_default();
        // The process chooses its name: no control characters on a terminal.
        let name: String = name.trim_end().chars().flat_map(char::escape_debug).collect();
        Some((number, name))
    })
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn the_process_of_this_user_that_holds_a_port_is_named() {
        let held = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = held.local_addr().unwrap();
        assert_eq!(find_holder(address), Some(std::process::id()));
        let error = TcpListener::bind(address).unwrap_err();
        let text = explain_bind_error(address, &error);
        assert!(text.starts_with(&format!("process {} (", std::process::id())), "{text}");
        assert!(text.contains("of this user already listens there; end it"), "{text}");
    }

    #[test]
    fn no_advice_is_given_to_end_what_another_user_runs() {
        let text = describe_holder(1001, 1000, None);
        assert_eq!(
            text,
            "a process of user 1001 already listens there, which only that user and root can end"
        );
        assert!(
            describe_holder(1001, 0, Some("7 (nc)")).starts_with("process 7 (nc) of user 1001")
        );
    }

    #[test]
    fn another_error_is_its_own_reason() {
        let error = io::Error::from(io::ErrorKind::AddrNotAvailable);
        let address = ([127, 0, 0, 1], 1).into();
        assert_eq!(explain_bind_error(address, &error), error.to_string());
    }
}
