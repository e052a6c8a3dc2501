//! What a component has started on another host, and hidden, ends with its agent, or with the next one.

use std::fs;

use super::Hosts;
use crate::fixture::{daemons_of, has_control_groups, is_alive, kill_together, wait_for};

/// Leaves a process that is in no group, session and variable of its component, and has no parent.
const HIDER: &str = "setsid env -i /bin/sh -c 'sleep 600 & echo $! >> \"$0/left\"' \"$ARMOR_OUT\"; \
                     exec sleep 600";

#[test]
fn what_hides_ends_with_the_agent_or_with_the_next_one() {
    let hosts = Hosts::with_file("hosts-hiders", |agent, _| {
        format!(
            r#"<armor version="1"><system name="two-hosts">
  <host name="arm" at="127.0.0.1:{agent}"/>
  <component name="hider" kind="hider" host="arm"/>
</system></armor>"#
        )
    });
    if !has_control_groups(&hosts.folder) {
        return;
    }
    hosts.folder.script("hider", HIDER);
    let start = || hosts.start_agent_with("robot", &["--components", "components"]);
    let left = |number: usize| {
        wait_for("a process that was left", || {
            let text =
                fs::read_to_string(hosts.folder.path().join("arm-out/two-hosts/left")).ok()?;
            text.lines().nth(number)?.parse::<i32>().ok()
        })
    };
    let agent = start();
    let _run = hosts.run(&[]);
    let first = left(0);
    kill_together(&[agent.pid()]);
    wait_for("the end of what the agent has left", || (!is_alive(first)).then_some(()));
    drop(agent);

    let agent = start();
    let second = left(1);
    let mut all = daemons_of(agent.pid(), "group-killer");
    assert_eq!(all.len(), 2, "{all:?}");
    all.push(agent.pid());
    kill_together(&all);
    drop(agent);
    let _agent = start();
    wait_for("the end of what the second agent has left", || (!is_alive(second)).then_some(()));
    assert!(is_alive(left(2)));
}
