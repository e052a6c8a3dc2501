//! A host with `cut-off="safe"`: what runs there is frozen by its agent while it is cut off, keeps its
//! state, and runs again afterwards.

use std::os::unix::fs::symlink;
use std::path::Path;

use super::Hosts;
use super::cable::Cable;
use crate::fixture::wait_for;
use crate::resilience::system::probe;
use crate::resilience::trace::Trace;

/// `far` is commanded by the mission, `free` and `stuck` are in no place, and no mission may freeze
/// `fixed`. `stuck` hangs after a while.
fn write_system(at: &str, folder: &Path) -> String {
    let folder = folder.display();
    let probe = |name: &str, more: &str, hang: u32| {
        format!(
            r#"<component name="{name}" kind="probe" rate="50Hz" host="arm" {more}>
      <parameter name="trace" value="{folder}/{name}.trace"/>
      <parameter name="hang" value="{hang}"/>
    </component>"#
        )
    };
    let all = [
        probe("far", "", 0),
        probe("free", "", 0),
        probe("fixed", r#"controllable="false""#, 0),
        probe("stuck", "", 20),
    ];
    format!(
        r#"<armor version="1">
  <system name="two-hosts">
    <host name="arm" at="{at}" cut-off="safe"/>
    <component name="near" kind="probe" rate="50Hz"/>
    {}
    <link from="far.numbers" to="near.a"/>
  </system>
  <mission name="two-hosts" goal="over" safe="hold">
    <place name="work" initial="true" components="near far"/>
    <place name="over"/>
    <place name="hold"/>
    <transition name="leave" from="work" to="over" operator="true"/>
  </mission>
</armor>"#,
        all.join("\n    ")
    )
}

#[test]
fn a_host_that_is_cut_off_freezes_what_the_file_lets_it_freeze() {
    let mut cable = None;
    let hosts = Hosts::with_file("hosts-safe", |agent, folder| {
        let cable = cable.insert(Cable::to(agent));
        write_system(&format!("127.0.0.1:{}", cable.port), folder)
    });
    let cable = cable.expect("a cable");
    std::fs::create_dir_all(hosts.folder.path().join("components")).expect("a folder");
    symlink(probe(), hosts.folder.path().join("components/probe")).expect("a link to the probe");
    let _agent = hosts.start_agent_with("robot", &["--components", "components"]);
    let run = hosts.run(&[]);
    let trace = |name: &str| Trace::read(&hosts.folder.path().join(format!("{name}.trace")));
    let wait_for_trace = |name: &str, what: &str, times: usize| {
        wait_for(&format!("{times} times {what} of {name}\n{}", run.log()), || {
            (trace(name).count(what) >= times).then_some(())
        });
    };
    let first = hosts.wait_for_far(&run, &[]);
    for name in ["far", "free", "fixed"] {
        wait_for_trace(name, "tick", 5);
    }
    wait_for_trace("stuck", "hangs", 1);
    cable.cut();
    for name in ["far", "free"] {
        hosts.wait_for_agent_log(name, "frozen until robot is connected again");
        assert_eq!(trace(name).count("stopping"), 1, "{name}");
    }
    hosts.wait_for_agent_log("stuck", "cannot be frozen (it did not stop within 2s); it is killed");
    hosts.wait_for_agent_log("fixed", "is cut off (it has fallen silent); it continues");
    // They stay at rest while what none may freeze continues.
    let ticks = ["far", "free"].map(|name| trace(name).count("tick"));
    wait_for_trace("fixed", "tick", trace("fixed").count("tick") + 25);
    assert_eq!(ticks, ["far", "free"].map(|name| trace(name).count("tick")));
    run.wait_for_log("arm is cut off (it has fallen silent); its agent freezes it", 1);

    cable.heal();
    wait_for_trace("far", "started", 2);
    wait_for_trace("free", "started", 2);
    hosts.wait_for_agent_log("free", "active again");
    assert_eq!(hosts.wait_for_far(&run, &[]), first, "{}", run.log());
    hosts.wait_for_data(&run, "far.numbers");
    assert_eq!(trace("fixed").count("stopping"), 0);
    run.wait_for_log("ended while its host was cut off", 1);
    wait_for_trace("stuck", "started", 2);
}
