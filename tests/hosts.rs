//! One system on two hosts: an agent runs the components of the second one. Both are on this machine;
//! the names of the hosts keep them apart, so every connection between them goes through both gates.

mod announcing;
mod cable;
mod datagrams;
mod executables;
mod freezing;
mod left_processes;
mod pages;
mod reading;
mod resuming;

use std::fs::{self, DirBuilder};
use std::net::TcpListener;
use std::os::unix::fs::DirBuilderExt;
use std::path::Path;
use std::process::{Child, Stdio};

use rustix::process::Signal;
use serde_json::Value;

use cable::Cable;

use crate::fixture::{
    Dialogue, Folder, Run, free_port, is_alive, run_to_end, send_signal, wait_for,
};

const WORLD: &str = r#"<svg><rect x="-3" y="-3" width="6" height="6"/>
    <circle id="start" cx="-1" cy="0.5"/>
    <circle class="start" id="blue" cx="1" cy="0.5"/></svg>"#;

/// A folder with the keys of two hosts and of alice, and the ports of their gates.
struct Hosts {
    folder: Folder,
    gate: u16,
    agent: u16,
}

/// Two robots in one room, the one called `far` on the host arm; more attributes of that are in `more`.
fn system_at(at: &str, more: &str) -> String {
    format!(
        r#"<armor version="1">
  <system name="two-hosts">
    <host name="arm" at="{at}"{more}/>
    <component name="near" kind="simulator" rate="50Hz">
      <parameter name="world" value="room.svg"/>
    </component>
    <component name="far" kind="simulator" rate="50Hz" host="arm">
      <parameter name="world" value="room.svg"/>
      <parameter name="start" value="blue"/>
    </component>
    <link from="near.presence" to="far.other1"/>
    <link from="far.presence" to="near.other1"/>
  </system>
  <mission name="two-hosts" goal="over" safe="hold">
    <place name="work" initial="true" components="near far"/>
    <place name="over"/>
    <place name="hold"/>
    <transition name="leave" from="work" to="over" operator="true"/>
  </mission>
</armor>"#
    )
}

/// A running agent, which ends with the test.
struct Agent(Child);

impl Hosts {
    fn new(name: &str, cut_off: &str) -> Self {
        Self::with_file(name, |agent, _| system_at(&format!("127.0.0.1:{agent}"), cut_off))
    }

    /// With a file that depends on the port of the agent and the folder.
    fn with_file(name: &str, write: impl FnOnce(u16, &Path) -> String) -> Self {
        let folder = Folder::new(name);
        let hosts = Self { folder, gate: free_port(), agent: free_port() };
        hosts.folder.write("room.svg", WORLD);
        hosts.folder.write("robots.xml", &write(hosts.agent, hosts.folder.path()));
        hosts.keys(&["init"]);
        for host in ["robot", "arm"] {
            hosts.keys(&["add", host, "--role", "host"]);
            let folder = hosts.folder.path().join(host);
            DirBuilder::new().mode(0o700).create(&folder).expect("a folder");
            for file in [&format!("{host}.key"), "revoked"] {
                let from = hosts.folder.path().join("authority").join(file);
                fs::copy(from, folder.join(file)).expect("it is copied");
            }
        }
        hosts
    }

    fn keys(&self, arguments: &[&str]) {
        let mut command = self.folder.armor(&["keys"]);
        let (code, out, err) = run_to_end(command.args(arguments).args(["--keys", "authority"]));
        assert_eq!(code, 0, "{arguments:?} {out} {err}");
    }

    fn start_agent(&self, from: &str) -> Agent {
        self.start_agent_with(from, &[])
    }

    fn start_agent_with(&self, from: &str, arguments: &[&str]) -> Agent {
        let listen = format!("127.0.0.1:{}", self.agent);
        let mut command = self.folder.armor(&["host", "--from", from, "--listen", &listen]);
        command.args(["--keys", "arm", "--out", "arm-out"]).args(arguments);
        // The folder that the shell names is not the one that the agent is given.
        command.env("ARMOR_KEYS", self.folder.path().join("none"));
        let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        Agent(child.expect("it starts"))
    }

    fn run(&self, arguments: &[&str]) -> Run {
        let gate = format!("127.0.0.1:{}", self.gate);
        let all = ["robots.xml", "--headless", "--gate", &gate, "--keys", "robot"];
        self.folder.run("out", &[&all, arguments].concat())
    }

    /// What `armor doctor` finds of the other host, and what it advises.
    fn examine(&self) -> (String, String) {
        self.find_diagnosis("host", "arm")
    }

    /// What `armor doctor` finds of a subject, with `named` in it.
    fn find_diagnosis(&self, subject: &str, named: &str) -> (String, String) {
        let doctor = ["doctor", "robots.xml", "--keys", "robot", "--format", "json"];
        let (_, out, err) = run_to_end(&mut self.folder.armor(&doctor));
        let found = out.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        let is_asked = |one: &Value| {
            one["subject"] == subject && one["found"].as_str().is_some_and(|it| it.contains(named))
        };
        let one = found.into_iter().find(is_asked);
        let one = one.unwrap_or_else(|| panic!("no {subject} of {named} in {out} {err}"));
        let text = |key: &str| one[key].as_str().unwrap_or_default().to_owned();
        (format!("{}: {}", text("condition"), text("found")), text("remedy"))
    }

    /// Waits until the agent has logged `text` of a component.
    fn wait_for_agent_log(&self, component: &str, text: &str) {
        let path = format!("arm-out/two-hosts/logs/{component}.log");
        let path = self.folder.path().join(path);
        wait_for(&format!("{text:?} in {}", path.display()), || {
            fs::read_to_string(&path).unwrap_or_default().contains(text).then_some(())
        });
    }

    /// What a tool prints on the launcher's host, one JSON object per line.
    fn lines(&self, run: &Run, tool: &[&str]) -> Vec<Value> {
        let registry = run.registry().to_string();
        let mut command = self.folder.armor(tool);
        let (_, out, _) = run_to_end(command.args(["--format", "json", "--registry", &registry]));
        out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }

    /// Waits until `far` takes part, with a process that is not one of `others`; returns it.
    fn wait_for_far(&self, run: &Run, others: &[i32]) -> i32 {
        self.wait_for_component(run, ("far", "arm"), others)
    }

    /// Waits until a component takes part on a host, with a process that is not one of `others`.
    fn wait_for_component(&self, run: &Run, (name, host): (&str, &str), others: &[i32]) -> i32 {
        wait_for(&format!("{name} to take part\n{}", run.log()), || {
            let all = self.lines(run, &["ps"]);
            let found = all.iter().find(|one| one["name"] == name && one["host"] == host)?;
            let pid = i32::try_from(found["pid"].as_i64()?).ok()?;
            (found["status"]["state"] == "active" && !others.contains(&pid)).then_some(pid)
        })
    }

    /// Waits until a link carries data.
    fn wait_for_data(&self, run: &Run, from: &str) {
        wait_for(&format!("{from} to travel\n{}", run.log()), || {
            let links = self.lines(run, &["graph"]);
            let link = links.iter().find(|link| link["from"] == from)?;
            (link["connected"] == true && link["rate_hz"].as_f64()? > 1.0).then_some(())
        });
    }
}

impl Agent {
    fn pid(&self) -> i32 {
        i32::try_from(self.0.id()).expect("a process id")
    }

    fn kill(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Drop for Agent {
    fn drop(&mut self) {
        self.kill();
    }
}

#[test]
fn components_of_two_hosts_take_part_in_one_system() {
    let hosts = Hosts::new("hosts", "");
    let (found, remedy) = hosts.examine();
    assert!(found.starts_with("fault: arm at 127.0.0.1:"), "{found}");
    assert!(remedy.starts_with("on arm: armor host --from robot"), "{remedy}");
    let agent = hosts.start_agent("robot");
    wait_for("the doctor to find the agent", || {
        hosts.examine().0.starts_with("ok: arm answers").then_some(())
    });
    // Both are this computer.
    let (clock, _) = hosts.find_diagnosis("clock", "the clock of arm");
    assert!(clock.starts_with("ok: the clock of arm is 0.0"), "{clock}");
    for (subject, found) in [
        ("versions", "arm has armor "),
        ("key", "the key of arm is valid until "),
        ("ports", "ports"),
    ] {
        let (found, _) = hosts.find_diagnosis(subject, found);
        assert!(found.starts_with("ok: "), "{subject}: {found}");
    }
    let mut run = hosts.run(&[]);
    let first = hosts.wait_for_far(&run, &[]);
    for data in ["near.presence", "far.presence"] {
        hosts.wait_for_data(&run, data);
    }
    let all = hosts.lines(&run, &["ps"]);
    for one in &all {
        let host = if one["name"] == "far" { "arm" } else { "robot" };
        let endpoint = one["endpoint"].as_str().unwrap_or_default();
        assert!(one["host"] == host && endpoint.starts_with(&format!("{host}:")), "{one}");
    }
    let far = all.iter().find(|one| one["name"] == "far").expect("far");
    assert_eq!(far["host_link"]["link"], "connected", "{far}");
    assert!(far["host_link"]["for_s"].as_f64().is_some_and(|for_s| for_s > 0.0), "{far}");
    wait_for("the clock of the other host, which is this one's", || {
        let all = hosts.lines(&run, &["ps"]);
        let link = &all.iter().find(|one| one["name"] == "far")?["host_link"];
        let (offset, error) = (link["clock_offset_s"].as_f64()?, link["clock_error_s"].as_f64()?);
        (offset.abs() <= error + 1e-3).then_some(())
    });
    let links = hosts.lines(&run, &["graph"]);
    let link = links.iter().find(|link| link["from"] == "far.presence").expect("a link");
    assert!(link["from_host"] == "arm" && link["to_host"] == "robot", "{link}");
    // A death there is noticed, and restarted, as one here.
    send_signal(first, Signal::KILL);
    run.wait_for_log("ended by signal 9 (SIGKILL); it starts again", 1);
    let second = hosts.wait_for_far(&run, &[first]);
    assert!(!hosts.lines(&run, &["restart", "far"]).is_empty(), "{}", run.log());
    let third = hosts.wait_for_far(&run, &[first, second]);
    assert!(!is_alive(first) && !is_alive(second));
    // A person reaches the processes of both hosts through the gate of the one, and only that.
    hosts.keys(&["add", "alice", "--role", "operator"]);
    let remote = |port: u16, tool: &[&str]| {
        let gate = format!("127.0.0.1:{port}");
        let connect = ["connect", &gate, "--key", "authority/alice.key", "--"];
        let mut command = hosts.folder.armor(&connect);
        run_to_end(command.arg(env!("CARGO_BIN_EXE_armor")).args(tool))
    };
    for data in ["far.odometry", "near.odometry"] {
        let (code, out, err) = remote(hosts.gate, &["echo", data, "--once"]);
        assert!(code == 0 && out.contains("odom"), "{code} {out} {err}");
    }
    let (code, out, err) = remote(hosts.gate, &["log", "far", "debug"]);
    assert!(code == 1 && err.contains("needs the role engineer"), "{code} {out} {err}");
    let (code, out, err) = remote(hosts.agent, &["ps"]);
    assert!(code == 1 && err.contains("connect to the gate there"), "{code} {out} {err}");
    // The agent lives on, its component ends with the system.
    hosts.lines(&run, &["stop", "--all"]);
    run.code();
    assert!(!is_alive(third) && is_alive(agent.pid()), "{}", run.log());
}

/// Whether the next look of `armor top` shows the host arm with this link, and `far` in this state with
/// its rate.
fn is_shown_as(top: &Dialogue, link: &str, state: &str) -> bool {
    let look: Value = serde_json::from_str(&top.read_line()).expect("a line of JSON");
    let rows = look["components"].as_array().expect("rows");
    let far = rows.iter().find(|row| row["name"] == "far");
    let is_so = far.is_some_and(|far| far["state"] == state && far["exec_hz"].is_f64());
    look["hosts"][0]["link"] == link && is_so
}

#[test]
fn a_host_that_is_cut_off_keeps_its_components_and_none_runs_twice() {
    let hosts = Hosts::new("hosts-cut", "");
    let agent = hosts.start_agent("robot");
    let run = hosts.run(&[]);
    let far = hosts.wait_for_far(&run, &[]);
    hosts.wait_for_data(&run, "far.presence");
    let mut top = hosts.folder.armor(&["top", "--format", "json", "--interval", "0.5s"]);
    let top = Dialogue::start(top.args(["--registry", &run.registry().to_string()]));
    wait_for("armor top to show both hosts", || {
        is_shown_as(&top, "connected", "active").then_some(())
    });
    for times in 1..=3 {
        send_signal(agent.pid(), Signal::STOP);
        run.wait_for_log("arm is cut off (it has fallen silent)", times);
        run.wait_for_log("gone name=far", times);
        wait_for("armor ps to show what is cut off", || {
            let registry = run.registry().to_string();
            let mut command = hosts.folder.armor(&["ps", "--registry", &registry]);
            let (_, out, _) = run_to_end(&mut command);
            out.contains("host arm: cut off for ").then_some(())
        });
        wait_for("armor top to show what was last known there", || {
            is_shown_as(&top, "cut-off", "cut off").then_some(())
        });
        send_signal(agent.pid(), Signal::CONT);
        run.wait_for_log("arm is connected again", times);
        assert_eq!(hosts.wait_for_far(&run, &[]), far, "{}", run.log());
        hosts.wait_for_data(&run, "far.presence");
    }
    assert!(!run.log().contains("suspected of hanging"), "{}", run.log());
}

#[test]
fn a_host_is_reached_at_any_of_its_addresses() {
    // Takes connections and never answers.
    let silent = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let dead = format!("127.0.0.1:{}", silent.local_addr().expect("it is bound").port());
    let mut cable = None;
    let hosts = Hosts::with_file("hosts-addresses", |agent, _| {
        let first = cable.insert(Cable::to(agent));
        system_at(&format!("{dead} 127.0.0.1:{} 127.0.0.1:{agent}", first.port), "")
    });
    let cable = cable.expect("a cable");
    let mut agent = hosts.start_agent("robot");
    wait_for("the doctor to find the agent", || {
        let (found, _) = hosts.examine();
        let first = format!("warning: arm answers at 127.0.0.1:{} after", cable.port);
        (found.starts_with(&first) && found.contains(&format!("; not at {dead}: "))).then_some(())
    });
    let run = hosts.run(&[]);
    let far = hosts.wait_for_far(&run, &[]);
    hosts.wait_for_data(&run, "far.presence");
    cable.cut();
    run.wait_for_log("arm is cut off (it has fallen silent)", 1);
    run.wait_for_log("arm is connected again", 1);
    assert_eq!(hosts.wait_for_far(&run, &[]), far, "{}", run.log());
    hosts.wait_for_data(&run, "far.presence");
    agent.kill();
    run.wait_for_log(&format!("; 127.0.0.1:{}: Connection refused", hosts.agent), 1);
    let log = run.log();
    let reason = log.lines().find(|line| line.contains("no address of the gate can be used: "));
    let names = [dead, format!("127.0.0.1:{}", cable.port)];
    assert!(reason.is_some_and(|line| names.iter().all(|name| line.contains(name))), "{log}");
}

#[test]
fn a_host_ends_its_components_when_it_is_cut_off_if_the_file_says_so() {
    let hosts = Hosts::new("hosts-stop", " cut-off=\"stop\"");
    let mut agent = hosts.start_agent("robot");
    let run = hosts.run(&[]);
    let first = hosts.wait_for_far(&run, &[]);
    // The launcher stands still: for the agent it is cut off.
    run.signal(Signal::STOP);
    wait_for("the end of far", || (!is_alive(first)).then_some(()));
    run.signal(Signal::CONT);
    let second = hosts.wait_for_far(&run, &[first]);
    // What an agent has started dies with it, and is started by the next agent.
    agent.kill();
    wait_for("the end of far", || (!is_alive(second)).then_some(()));
    run.wait_for_log("arm is cut off", 2);
    let _agent = hosts.start_agent("robot");
    hosts.wait_for_far(&run, &[first, second]);
}

#[test]
fn a_launcher_that_comes_back_takes_over_and_another_run_starts_from_scratch() {
    let hosts = Hosts::new("hosts-resume", "");
    let _agent = hosts.start_agent("robot");
    let mut run = hosts.run(&[]);
    let first = hosts.wait_for_far(&run, &[]);
    run.signal(Signal::KILL);
    run.code();
    assert!(is_alive(first));
    let mut run = hosts.run(&["--resume"]);
    assert_eq!(hosts.wait_for_far(&run, &[]), first, "{}", run.log());
    run.wait_for_log("runs on arm already", 1);
    // Another run of the system is kept out as long as this one is there.
    let gate = format!("127.0.0.1:{}", free_port());
    let other = ["robots.xml", "--headless", "--gate", &gate, "--keys", "robot"];
    let second = hosts.folder.run("other-out", &other);
    second.wait_for_log("another run of two-hosts has components here", 1);
    drop(second);
    assert_eq!(hosts.wait_for_far(&run, &[]), first, "{}", run.log());
    // A gate that hangs is replaced, and no component is taken for hanging.
    send_signal(run.daemon("gate").expect("it runs"), Signal::STOP);
    run.wait_for_log("was killed while stopped (SIGSTOP or a debugger)", 1);
    assert_eq!(hosts.wait_for_far(&run, &[]), first, "{}", run.log());
    hosts.wait_for_data(&run, "far.presence");
    run.signal(Signal::KILL);
    run.code();
    let run = hosts.run(&[]);
    hosts.wait_for_far(&run, &[first]);
    assert!(!is_alive(first));
}

#[test]
fn a_host_whose_key_is_revoked_takes_no_part_any_more() {
    let hosts = Hosts::new("hosts-revoked", "");
    let _agent = hosts.start_agent("robot");
    let run = hosts.run(&[]);
    hosts.wait_for_far(&run, &[]);
    hosts.keys(&["revoke", "arm"]);
    let list = |folder: &str| hosts.folder.path().join(folder).join("revoked");
    fs::copy(list("authority"), list("robot")).expect("it is copied");
    run.wait_for_log("arm is cut off (the key of arm is revoked)", 1);
    run.wait_for_log("gone name=far", 1);
    wait_for("the end of its links", || {
        let links = hosts.lines(&run, &["graph"]);
        let is_up = |link: &&Value| link["connected"] == true;
        let own = links.iter().filter(is_up).all(|link| link["from"] != "far.presence");
        own.then_some(())
    });
}

#[test]
fn what_cannot_work_is_refused_with_the_remedy() {
    let hosts = Hosts::new("hosts-refused", "");
    let refused = |arguments: &[&str], why: &str| {
        let mut command = hosts.folder.armor(&["run", "--headless", "--out", "out"]);
        let (code, _, err) = run_to_end(command.args(arguments));
        assert!(code == 1 && err.contains(why), "{arguments:?}: {code} {err}");
    };
    refused(&["robots.xml"], "which must reach this one: give --gate");
    let gate = format!("127.0.0.1:{}", hosts.gate);
    refused(&["robots.xml", "--gate", &gate, "--keys", "arm"], "arm is this host, by its key");
    // The agent is for the systems of another host.
    let agent = hosts.start_agent("base");
    let run = hosts.run(&[]);
    run.wait_for_log("this agent runs components for systems of base, not of robot", 1);
    drop((run, agent));
    // A kind that the other host does not have, or has with other ports.
    let _agent = hosts.start_agent("robot");
    hosts.folder.script("nod", "sleep 60");
    let at = hosts.agent;
    let text = format!(
        r#"<armor version="1"><system name="own">
  <host name="arm" at="127.0.0.1:{at}"/><component name="head" kind="nod" host="arm"/>
</system></armor>"#
    );
    hosts.folder.write("own.xml", &text);
    let all = ["own.xml", "--headless", "--gate", &gate, "--keys", "robot"];
    let run = hosts.folder.run("own-out", &all);
    run.wait_for_log("the host arm has no kind nod", 1);
}
