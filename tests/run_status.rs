//! The status of `armor run` on stderr: plain lines if stderr is not a terminal.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use crate::fixture::{Folder, run_to_end};
use crate::resilience::system::probe;

const RELAY: &str = "<armor version='1'>
<system name='relay'>
  <component name='first' kind='worker' rate='10Hz'/>
  <component name='second' kind='worker' rate='10Hz'/>
</system>
<mission name='relay' goal='over' safe='hold'>
  <place name='sort' initial='true' components='first'/>
  <place name='check' components='second'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='handover' from='sort' to='check' on='first.done'/>
  <transition name='finish' from='check' to='over' on='second.done'/>
</mission>
</armor>
";

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("relay.xml", RELAY);
    // Under this name the program is a `worker`; a symbolic link would be resolved to `probe`.
    let script = format!("#!/bin/sh\nexec -a worker '{}' \"$@\"\n", probe().display());
    folder.executable("components/worker", &script.replace("/bin/sh", "/bin/bash"));
    folder
}

#[test]
fn each_marking_is_a_plain_line() {
    let folder = folder("run-status");
    let (code, _, err) = run_to_end(&mut folder.armor(&["run", "relay.xml"]));
    assert_eq!(code, 0, "{err}");
    let lines: Vec<&str> = err.lines().filter(|line| line.starts_with("status: ")).collect();
    let has = |place: &str| lines.iter().any(|line| line.contains(&format!(" s | {place}")));
    assert!(has("sort") && has("check"), "{err}");
    assert!(lines.len() <= 6, "a line for each marking, and no more: {err}");
}

#[test]
fn quiet_and_json_print_no_status() {
    let folder = folder("run-quiet");
    for option in ["--quiet", "--format=json"] {
        let (code, _, err) = run_to_end(&mut folder.armor(&["run", "relay.xml", option]));
        assert_eq!((code, err.contains("status: ")), (0, false), "{option}: {err}");
    }
}

#[test]
fn a_call_that_hangs_is_in_the_plain_lines() {
    let folder = folder("run-hanging");
    let script = format!("#!/bin/sh\nexec '{}' \"$@\"\n", probe().display());
    folder.executable("components/probe", &script);
    let system = "<armor version='1'><system><component name='first' kind='probe' rate='50Hz'>\
                  <parameter name='hang' value='3'/></component></system></armor>";
    folder.write("hanging.xml", system);
    let mut command = folder.armor(&["run", "hanging.xml"]);
    let mut run = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let lines = BufReader::new(run.stderr.take().expect("piped")).lines();
    let mut statuses =
        lines.map(|line| line.expect("UTF-8")).filter(|line| line.starts_with("status: "));
    let shown = statuses.find(|line| line.contains(" | first in exec for "));
    let _ = run.kill();
    let _ = run.wait();
    assert!(shown.is_some(), "the run has ended before");
}

const RETURN: &str = "<armor version='1'>
<system name='return'>
  <frame name='laser' in='base_link' x='0.08m' z='0.2m'/>
  <component name='simulator' kind='simulator' rate='20Hz'>
    <parameter name='world' value='WORLDS/office.svg'/>
  </component>
  <component name='mapper' kind='grid-slam' rate='10Hz'>
    <parameter name='map_period' value='0.5s'/>
  </component>
  <component name='explorer' kind='explorer' rate='5Hz'/>
  <component name='homing' kind='homing' rate='5Hz'>
    <parameter name='x' value='1.5m'/>
  </component>
  <component name='planner' kind='planner' rate='10Hz'/>
  <component name='driver' kind='driver' rate='20Hz'/>
  <link from='simulator.scan' to='mapper.scan' keep='10'/>
  <link from='simulator.odometry' to='mapper.odometry' keep='50'/>
  <link from='mapper.map' to='explorer.map'/>
  <link from='mapper.pose' to='explorer.pose'/>
  <link from='mapper.pose' to='homing.pose'/>
  <link from='homing.goal' to='planner.goal'/>
  <link from='mapper.map' to='planner.map'/>
  <link from='mapper.pose' to='planner.pose'/>
  <link from='planner.path' to='driver.path'/>
  <link from='mapper.map' to='driver.map'/>
  <link from='mapper.pose' to='driver.pose'/>
  <link from='simulator.scan' to='driver.scan'/>
  <link from='simulator.odometry' to='driver.odometry'/>
  <link from='driver.velocity' to='simulator.velocity'/>
</system>
<mission name='return' goal='home' safe='hold'>
  <place name='drive' initial='true' components='homing driver explorer'/>
  <place name='home'/>
  <place name='hold'/>
  <transition name='arrived' from='drive' to='home' on='homing.done'/>
  <transition name='lost' from='drive' to='hold' timeout='3min'/>
</mission>
</armor>
";

/// Returns whether `line` has a positive number between the two texts.
fn has_distance(line: &str, before: &str, after: &str) -> bool {
    let number = |rest: &str| rest.split_once(after)?.0.rsplit(' ').next()?.parse::<f64>().ok();
    line.split_once(before).is_some_and(|(_, rest)| number(rest).is_some_and(|left| left > 0.0))
}

/// A robot drives 1.5 m. Nothing but the status line subscribes to the progress.
#[test]
fn the_line_has_the_progress_of_the_stock_components() {
    let folder = Folder::new("run-return");
    let worlds = format!("{}/../missions/worlds", env!("CARGO_MANIFEST_DIR"));
    folder.write("return.xml", &RETURN.replace("WORLDS", &worlds));
    let drawn = draw_on_terminal(&folder, "return.xml");
    let is_shown = |before: &str, after: &str| {
        drawn.iter().any(|line| line.contains(" | drive | ") && has_distance(line, before, after))
    };
    assert!(is_shown("homing: returning home, ", " m to home"), "{drawn:#?}");
    assert!(is_shown("driver: driving, ", " m to go"), "{drawn:#?}");
    assert!(is_shown("explorer: exploring, ", " % explored"), "{drawn:#?}");
}

/// Runs a file to its goal and returns each state of the line. The program `script` gives the
/// launcher a terminal, on which it redraws the line in place.
fn draw_on_terminal(folder: &Folder, file: &str) -> Vec<String> {
    let armor = folder.armor(&[]);
    let mut script = Command::new("script");
    script.args(["--quiet", "--return", "--command"]);
    script.arg(format!("{} run {file}", armor.get_program().display())).arg("screen");
    script.current_dir(folder.path()).stdin(Stdio::null());
    for (name, value) in armor.get_envs() {
        match value {
            Some(value) => script.env(name, value),
            None => script.env_remove(name),
        };
    }
    let (code, out, err) = run_to_end(&mut script);
    assert_eq!(code, 0, "{out}{err}");
    out.split("\r\x1b[2K").map(str::to_owned).collect()
}

#[test]
fn on_a_terminal_the_line_has_the_progress_of_the_active_component() {
    let folder = folder("run-terminal");
    let drawn = draw_on_terminal(&folder, "relay.xml");
    let is_shown = |text: &str| drawn.iter().any(|line| line.contains(text));
    assert!(is_shown(" | sort | first: sorting, "), "{drawn:?}");
    assert!(is_shown(" | check | second: sorting, "), "{drawn:?}");
    assert!(!is_shown("check | first:"), "a frozen component's progress is old: {drawn:?}");
    assert!(drawn.last().is_some_and(|line| !line.contains("sorting")), "erased: {drawn:?}");
}
