//! Links in datagrams between two hosts: sealed from gate to gate, and by TCP where only that gets through.

use serde_json::Value;

use super::cable::Cable;
use super::{Hosts, system_at};
use crate::fixture::{Run, wait_for};

fn hosts_with_datagrams(name: &str, at: impl FnOnce(u16) -> u16) -> Hosts {
    Hosts::with_file(name, |agent, _| {
        system_at(&format!("127.0.0.1:{}", at(agent)), "")
            .replace(".other1\"/>", ".other1\" transport=\"udp\"/>")
    })
}

fn links(hosts: &Hosts, run: &Run) -> Vec<Value> {
    let mut links = hosts.lines(run, &["graph"]);
    links.retain(|link| link["from"].as_str().is_some_and(|from| from.ends_with(".presence")));
    links
}

#[test]
fn links_between_hosts_go_in_sealed_datagrams() {
    let hosts = hosts_with_datagrams("udp-hosts", |agent| agent);
    let _agent = hosts.start_agent("robot");
    let run = hosts.run(&[]);
    let udp = |link: &Value| link["transport"] == "udp" && link["rate_hz"].as_f64() > Some(1.0);
    wait_for("datagrams in both directions", || {
        let links = links(&hosts, &run);
        (links.len() == 2 && links.iter().all(udp)).then_some(())
    });
}

#[test]
fn where_only_tcp_gets_through_the_links_take_it() {
    // The cable carries no datagrams to the agent's gate.
    let mut cable = None;
    let hosts = hosts_with_datagrams("udp-blocked", |agent| cable.insert(Cable::to(agent)).port);
    let _agent = hosts.start_agent("robot");
    let run = hosts.run(&[]);
    wait_for("TCP from far, datagrams from near", || {
        let links = links(&hosts, &run);
        let transport = |from: &str| {
            let link = links.iter().find(|link| link["from"] == from)?;
            (link["rate_hz"].as_f64() > Some(1.0)).then(|| link["transport"].clone())
        };
        (transport("far.presence")? == "tcp" && transport("near.presence")? == "udp").then_some(())
    });
}
