//! The status of `armor run` on stderr: plain lines if stderr is not a terminal.

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

/// The program `script` gives the launcher a terminal, on which it redraws the line in place.
#[test]
fn on_a_terminal_the_line_has_the_progress_of_the_active_component() {
    let folder = folder("run-terminal");
    let armor = folder.armor(&["run", "relay.xml"]);
    let mut script = std::process::Command::new("script");
    script.args(["--quiet", "--return", "--command"]);
    script.arg(format!("{} run relay.xml", armor.get_program().display())).arg("screen");
    script.current_dir(folder.path()).stdin(std::process::Stdio::null());
    for (name, value) in armor.get_envs() {
        match value {
            Some(value) => script.env(name, value),
            None => script.env_remove(name),
        };
    }
    let (code, out, err) = run_to_end(&mut script);
    assert_eq!(code, 0, "{out}{err}");
    let drawn: Vec<&str> = out.split("\r\x1b[2K").collect();
    let is_shown = |text: &str| drawn.iter().any(|line| line.contains(text));
    assert!(is_shown(" | sort | first: sorting, "), "{out:?}");
    assert!(is_shown(" | check | second: sorting, "), "{out:?}");
    assert!(!is_shown("check | first:"), "a frozen component's progress is old: {out:?}");
    assert!(drawn.last().is_some_and(|line| !line.contains("sorting")), "erased: {out:?}");
}
