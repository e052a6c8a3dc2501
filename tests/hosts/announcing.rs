//! A host without an address in the file: its agent announces itself on the local network.

use rustix::process::Signal;

use super::{Hosts, system_at};
use crate::fixture::{free_port, run_to_end};

#[test]
fn an_agent_that_announces_itself_is_found_wherever_it_listens() {
    let mut hosts = Hosts::with_file("hosts-announced", |_, _| system_at("mdns", ""));
    // It could be any host of the network, which does not reach a gate for this host only.
    let gate = ["run", "robots.xml", "--headless", "--keys", "robot", "--gate", "127.0.0.1:7410"];
    let (code, _, err) = run_to_end(&mut hosts.folder.armor(&gate));
    assert!(code == 1 && err.contains("arm cannot reach the gate of this host"), "{code} {err}");

    // One that does not announce itself is not found, and the reason states what to do.
    let silent = hosts.start_agent("robot");
    let gate = format!("0.0.0.0:{}", hosts.gate);
    let run = ["robots.xml", "--headless", "--keys", "robot", "--gate", &gate];
    let run = hosts.folder.run("out", &run);
    run.wait_for_log("no agent announces itself as arm on the local network", 1);
    run.wait_for_log("`armor host --announce`", 1);
    drop(silent);

    let mut agent = hosts.start_agent_with("robot", &["--announce"]);
    let first = hosts.wait_for_far(&run, &[]);
    hosts.wait_for_data(&run, "far.presence");
    let (found, _) = hosts.examine();
    let address = format!("mdns (127.0.0.1:{})", hosts.agent);
    assert!(found.starts_with("ok: arm answers at mdns after"), "{found} {address}");
    assert_eq!(hosts.lines(&run, &["ps"]).iter().filter(|one| one["host"] == "arm").count(), 1);

    // Killed, it sends no goodbye; the next one, at another port, is found all the same.
    agent.kill();
    hosts.agent = free_port();
    let agent = hosts.start_agent_with("robot", &["--announce"]);
    hosts.wait_for_far(&run, &[first]);
    hosts.wait_for_data(&run, "far.presence");
    run.signal(Signal::TERM);
    drop(agent);
}
