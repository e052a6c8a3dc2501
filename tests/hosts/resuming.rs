//! `--resume` after the file has changed where, and with which limits, a component runs; and the count
//! of the output that a cut has kept from the launcher.

use std::fs;

use rustix::process::Signal;

use super::{Hosts, cable::Cable};
use crate::fixture::{is_alive, wait_for};

/// Three robots in one room; `far` and `also` have more attributes.
fn write_system(agent: u16, far: &str, also: &str) -> String {
    let robot = |name: &str, more: &str| {
        format!(
            r#"    <component name="{name}" kind="simulator" rate="50Hz" {more}>
      <parameter name="world" value="room.svg"/>
    </component>
"#
        )
    };
    let robots = [robot("near", ""), robot("far", far), robot("also", also)].concat();
    format!(
        r#"<armor version="1">
  <system name="two-hosts">
    <host name="arm" at="127.0.0.1:{agent}"/>
{robots}  </system>
  <mission name="two-hosts" goal="over" safe="hold">
    <place name="work" initial="true" components="near far also"/>
    <place name="over"/>
    <place name="hold"/>
    <transition name="leave" from="work" to="over" operator="true"/>
  </mission>
</armor>"#
    )
}

#[test]
fn a_run_that_is_resumed_moves_a_component_and_keeps_the_others() {
    let here = r#"host="arm""#;
    let hosts = Hosts::with_file("hosts-moved", |agent, _| write_system(agent, here, here));
    let _agent = hosts.start_agent("robot");
    let mut run = hosts.run(&[]);
    let moved = hosts.wait_for_component(&run, ("far", "arm"), &[]);
    let kept = hosts.wait_for_component(&run, ("also", "arm"), &[]);
    let end = |run: &mut crate::fixture::Run| {
        run.signal(Signal::KILL);
        run.code();
    };
    end(&mut run);
    assert!(is_alive(moved) && is_alive(kept));
    hosts.folder.write("robots.xml", &write_system(hosts.agent, "", here));
    let mut run = hosts.run(&["--resume"]);
    let here_now = hosts.wait_for_component(&run, ("far", "robot"), &[moved]);
    assert_eq!(hosts.wait_for_component(&run, ("also", "arm"), &[]), kept, "{}", run.log());
    wait_for("the end of the old process", || (!is_alive(moved)).then_some(()));
    end(&mut run);

    // It goes back, and the other one gets another limit: that cannot be taken over.
    let limited = r#"host="arm" nice="5""#;
    hosts.folder.write("robots.xml", &write_system(hosts.agent, here, limited));
    let run = hosts.run(&["--resume"]);
    hosts.wait_for_component(&run, ("far", "arm"), &[moved, here_now]);
    let limited = hosts.wait_for_component(&run, ("also", "arm"), &[kept]);
    assert!(!is_alive(kept) && !is_alive(here_now));
    let stat = fs::read_to_string(format!("/proc/{limited}/stat")).expect("it runs");
    let fields = stat.rsplit_once(')').map_or("", |(_, fields)| fields);
    // The field 19 of proc(5), counted from the first after the name, which is field 3.
    assert_eq!(fields.split_whitespace().nth(16), Some("5"), "{stat}");
}

#[test]
fn a_run_without_a_host_of_the_earlier_one_has_its_components_ended_there() {
    let here = r#"host="arm""#;
    let hosts = Hosts::with_file("hosts-dropped", |agent, _| write_system(agent, here, ""));
    let with_host = fs::read_to_string(hosts.folder.path().join("robots.xml")).expect("it exists");
    let line = format!("    <host name=\"arm\" at=\"127.0.0.1:{}\"/>\n", hosts.agent);
    let without_host = with_host.replace(&line, "").replace(here, "");
    assert!(!without_host.contains("\"arm\""), "{without_host}");
    let mut agent = hosts.start_agent("robot");
    let mut run = hosts.run(&[]);
    let far = hosts.wait_for_component(&run, ("far", "arm"), &[]);
    run.signal(Signal::KILL);
    run.code();

    hosts.folder.write("robots.xml", &without_host);
    let mut run = hosts.run(&["--resume"]);
    wait_for("the end of the old process", || (!is_alive(far)).then_some(()));
    run.wait_for_log("arm is not in the file any more; it runs nothing of this system", 1);
    let record = run.out().join("hosts.json");
    wait_for("the end of the record", || (!record.exists()).then_some(()));
    // It has forgotten the system, with the threads of its log.
    let tasks = format!("/proc/{}/task", agent.pid());
    wait_for("the end of the log's threads", || {
        let names = fs::read_dir(&tasks)
            .expect("it runs")
            .filter_map(|task| fs::read_to_string(task.ok()?.path().join("comm")).ok());
        names.into_iter().all(|name| !name.starts_with("log-")).then_some(())
    });
    run.signal(Signal::KILL);
    run.code();

    // The agent cannot be reached at first.
    hosts.folder.write("robots.xml", &with_host);
    let mut run = hosts.run(&["--resume"]);
    hosts.wait_for_component(&run, ("far", "arm"), &[far]);
    run.signal(Signal::KILL);
    run.code();
    agent.kill();
    hosts.folder.write("robots.xml", &without_host);
    let mut run = hosts.run(&["--resume"]);
    run.wait_for_log("arm is not in the file any more, and may still run components", 1);
    run.signal(Signal::INT);
    assert_eq!(run.code(), Some(130), "{}", run.log());
    assert!(record.exists(), "the next run asks it");
    let _agent = hosts.start_agent("robot");
    let run = hosts.run(&["--resume"]);
    run.wait_for_log("it runs nothing of this system", 2);
}

#[test]
fn output_that_a_cut_keeps_from_the_launcher_is_counted_and_stays_with_the_agent() {
    let mut cable = None;
    let hosts = Hosts::with_file("hosts-missed", |agent, _| {
        let port = cable.insert(Cable::to(agent)).port;
        format!(
            r#"<armor version="1"><system name="two-hosts">
  <host name="arm" at="127.0.0.1:{port}"/>
  <component name="talker" kind="chatter" host="arm"/>
</system></armor>"#
        )
    });
    let cable = cable.expect("a cable");
    let go = hosts.folder.path().join("go");
    let script = "while sleep 0.05; do if [ -e GO ]; then rm GO; for line in 1 2 3 4 5 6 7 8 9; do \
                  echo a line of sixteen; done; fi; done";
    hosts.folder.script("chatter", &script.replace("GO", &go.display().to_string()));
    let _agent = hosts.start_agent_with("robot", &["--components", "components"]);
    let run = hosts.run(&[]);
    let speak = || {
        fs::write(&go, "").expect("the folder is ours");
        wait_for("what it prints", || (!go.exists()).then_some(()));
    };
    hosts.wait_for_agent_log("talker", "started as process");
    speak();
    run.wait_for_log("a line of sixteen", 9);
    cable.cut();
    hosts.wait_for_agent_log("talker", "robot is cut off");
    speak();
    let kept = hosts.folder.path().join("arm-out/two-hosts/logs/talker.log");
    wait_for("the lines in the agent's log", || {
        let text = fs::read_to_string(&kept).unwrap_or_default();
        (text.matches("a line of sixteen").count() == 18).then_some(())
    });
    cable.heal();
    let bytes = 9 * "a line of sixteen\n".len();
    run.wait_for_log(
        &format!("{bytes} bytes of its output were not sent while arm was cut off"),
        1,
    );
    speak();
    run.wait_for_log("a line of sixteen", 18);
}
