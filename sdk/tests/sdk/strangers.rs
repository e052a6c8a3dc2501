//! Other users of the host: they read nothing, command nothing, and take no daemon's place.

use std::net::TcpListener;

use armor_sdk::control::{ControlConnection, Role};
use armor_sdk::directory::{Directory, DirectoryError};
use armor_sdk::prelude::*;
use armor_sdk::wire::registry::ComponentEntry;
use rustix::process::{Uid, geteuid};
use rustix::thread::set_thread_res_uid;

use crate::bench_system::{DEADLINE, System};

/// The user id that owns no files, by convention.
const OTHER_USER: u32 = 65534;

/// Does `work` on a thread of another user: Linux keeps the user of each thread. Only root can
/// become another user, so elsewhere `None` is returned and the test ends early.
fn as_other_user<T: Send>(work: impl FnOnce() -> T + Send) -> Option<T> {
    if !geteuid().is_root() {
        eprintln!("skipped: only root can start a thread of another user");
        return None;
    }
    let user = Uid::from_raw(OTHER_USER);
    let other = move || {
        set_thread_res_uid(user, user, user).unwrap();
        work()
    };
    std::thread::scope(|scope| Some(scope.spawn(other).join().unwrap()))
}

#[test]
fn another_user_connects_to_no_component_over_any_transport_in_any_role() {
    let mut system = System::start();
    system.run("sink", &[], None, |_, _| Ok(Outcome::CarryOn));
    let entry = system.entry("sink");
    // An entry of another host has no Unix socket here, so its port is used.
    let over_tcp = ComponentEntry { host: "elsewhere".into(), ..entry.clone() };
    for entry in [&entry, &over_tcp] {
        for role in [Role::Executive, Role::Launcher, Role::Operator, Role::Observer] {
            let connect = || ControlConnection::connect(entry, role, "stranger", |_| {});
            connect().expect("the same user");
            let Some(refused) = as_other_user(|| connect().map(drop)) else { return };
            let error = refused.expect_err("another user").to_string();
            assert!(error.contains("belongs to user 65534, and this system to user 0"), "{error}");
        }
    }
    let status = system.status("sink");
    assert_eq!(status.untaken_events, 0, "it lives on: {status:?}");
}

#[test]
fn another_user_learns_nothing_from_the_registry() {
    let mut system = System::start();
    system.run("sink", &[], None, |_, _| Ok(Outcome::CarryOn));
    let name = system.entry("sink").name;
    let address = system.registry.address().to_string();
    let look = || {
        let directory = Directory::observer(&address, "stranger");
        // The threads of the directory belong to the user of the thread that makes it.
        (directory.find_process(&name, DEADLINE), directory.fetch_listing(DEADLINE))
    };
    let (found, listed) = look();
    found.expect("the same user");
    listed.expect("the same user");
    let Some((found, listed)) = as_other_user(look) else { return };
    // The refusal itself, not that there is no answer after the whole deadline.
    for error in [found.map(drop).unwrap_err(), listed.map(drop).unwrap_err()] {
        assert!(matches!(error, DirectoryError::OtherUser { .. }), "{error}");
        assert!(error.to_string().contains("belongs to another user: the other end"), "{error}");
    }
}

#[test]
fn a_false_registry_of_another_user_is_not_believed() {
    let Some(listener) = as_other_user(|| TcpListener::bind("127.0.0.1:0").unwrap()) else {
        return;
    };
    let address = listener.local_addr().unwrap().to_string();
    let error = armor_socket_error(&address);
    assert!(error.contains("belongs to user 65534"), "{error}");
    listener.set_nonblocking(true).unwrap();
    let (mut stream, _) = listener.accept().unwrap();
    let mut heard = Vec::new();
    std::io::Read::read_to_end(&mut stream, &mut heard).unwrap();
    assert!(heard.is_empty(), "it is not even greeted: {heard:?}");
}

/// Connects as every process of the system does, and returns why not.
fn armor_socket_error(address: &str) -> String {
    let endpoint = armor_sdk::wire::transport::Endpoint::Tcp(address.into());
    armor_socket::connect(&endpoint, DEADLINE).expect_err("another user").to_string()
}
