//! The accept loops of a host with keys while their process has no free descriptors: each logs that it
//! can accept no connection, and its recovery.

use std::fs;
use std::net::{SocketAddr, TcpStream};
use std::os::unix::net::UnixStream;
use std::path::Path;

use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};
use serde_json::Value;

use super::Site;
use crate::fixture::{Dialogue, free_port, wait_for};

/// Runs `test` while a process cannot open or accept anything.
fn without_descriptors<T>(pid: i32, test: impl FnOnce() -> T) -> T {
    let pid = Pid::from_raw(pid);
    let no_more = Rlimit { current: Some(0), ..getrlimit(Resource::Nofile) };
    let before = prlimit(pid, Resource::Nofile, no_more).expect("it is ours");
    let result = test();
    prlimit(pid, Resource::Nofile, before).expect("it is ours");
    result
}

#[test]
fn what_cannot_accept_connections_logs_that_and_its_recovery() {
    let site = Site::new("keys-descriptors");
    let run = site.run();
    let registry = run.registry();
    for (round, (daemon, address)) in
        [("registry", registry), ("gate", site.gate)].into_iter().enumerate()
    {
        let pid = wait_for(daemon, || run.daemon(daemon));
        let waiting = without_descriptors(pid, || {
            let waiting = TcpStream::connect(address).expect("it listens");
            run.wait_for_log("cannot accept connections; trying again", round + 1);
            waiting
        });
        run.wait_for_log("connections are accepted again", round + 1);
        drop(waiting);
    }
    let socket = wait_for("the launcher's socket", || {
        let files = fs::read_dir(site.path("run/armor")).ok()?;
        let mut paths = files.filter_map(|file| Some(file.ok()?.path()));
        paths.find(|path| path.extension().is_some_and(|it| it == "sock"))
    });
    let waiting = without_descriptors(run.pid(), || {
        let waiting = UnixStream::connect(&socket).expect("it listens");
        run.wait_for_log("armor restart and stop get no answer: ", 1);
        waiting
    });
    run.wait_for_log("armor restart and stop work again", 1);
    drop(waiting);
}

#[test]
fn what_carries_connections_to_other_hosts_logs_that_it_accepts_none_and_its_recovery() {
    let site = Site::new("carriers-descriptors");
    site.add("alice", "engineer");
    let (gate, router) = (site.gate.to_string(), free_port());
    let port = router.to_string();
    let mut serve = site.folder.armor(&["gate", "--listen", &gate, "--registry", "127.0.0.1:1"]);
    serve.args(["--keys", "robot", "--host", "arm=127.0.0.1:1", "--router", &port]);
    let gate_log = site.path("gate.log");
    let server = Dialogue::start_with_log(&mut serve, &gate_log);
    wait_for("the gate", || TcpStream::connect(site.gate).ok());
    let check_carrier = |carrier: &Dialogue, address: SocketAddr, log: &Path, texts: [&str; 2]| {
        let wait_for_text = |text: &str| {
            let is_in = |logged: String| logged.contains(text).then_some(());
            wait_for(text, || fs::read_to_string(log).ok().and_then(is_in));
        };
        let waiting = without_descriptors(carrier.pid(), || {
            let waiting = TcpStream::connect(address).expect("it listens");
            wait_for_text(texts[0]);
            waiting
        });
        wait_for_text(texts[1]);
        drop(waiting);
    };
    let texts = ["cannot accept connections to other hosts", "to other hosts are accepted again"];
    check_carrier(&server, ([127, 0, 0, 1], router).into(), &gate_log, texts);
    let key = ["connect", gate.as_str(), "--key", "authority/alice.key", "--format", "json"];
    let connect_log = site.path("connect.log");
    let connect = Dialogue::start_with_log(&mut site.folder.armor(&key), &connect_log);
    let link: Value = serde_json::from_str(&connect.read_line()).expect("JSON");
    let proxy = link["via"].as_str().and_then(|via| via.parse().ok()).expect("a proxy");
    let texts = ["no connection of a tool can be accepted", "of tools are accepted again"];
    check_carrier(&connect, proxy, &connect_log, texts);
}
