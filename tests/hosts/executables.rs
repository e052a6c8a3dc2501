//! Executables that the launcher copies to an agent that accepts them, and how they are refused
//! otherwise.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use rustix::process::Signal;

use super::Hosts;
use crate::fixture::send_signal;
use crate::resilience::system::probe;

const SYSTEM: &str = r#"<armor version="1">
  <system name="two-hosts">
    <host name="arm" at="127.0.0.1:PORT"/>
    <component name="near" kind="probe" rate="50Hz"/>
    <component name="far" kind="probe" rate="50Hz" host="arm"/>
    <link from="far.numbers" to="near.a"/>
  </system>
</armor>"#;

/// The executables that the agent has kept.
fn list_kept(hosts: &Hosts) -> Vec<PathBuf> {
    let folder = hosts.folder.path().join("arm-out/.executables");
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    entries.flatten().map(|entry| entry.path()).collect()
}

/// Replaces an executable by one with a further byte; a process may run the old one.
fn append_byte(path: &Path) {
    let new = path.with_extension("new");
    fs::copy(path, &new).expect("it is copied");
    let mut file = OpenOptions::new().append(true).open(&new).expect("it is ours");
    file.write_all(b"\n").expect("it is ours");
    fs::rename(new, path).expect("it is ours");
}

#[test]
fn an_executable_is_copied_to_an_agent_that_accepts_it() {
    let hosts =
        Hosts::with_file("hosts-copied", |agent, _| SYSTEM.replace("PORT", &agent.to_string()));
    let own = hosts.folder.path().join("components/probe");
    fs::create_dir_all(own.parent().expect("a folder")).expect("a folder");
    fs::copy(probe(), &own).expect("it is copied");

    // Without the option there is only a refusal, which names it.
    let agent = hosts.start_agent("robot");
    let run = hosts.run(&[]);
    run.wait_for_log("or start the agent with --accept-executables", 1);
    assert!(!hosts.folder.path().join("arm-out/.executables").exists());
    drop((run, agent));

    let _agent = hosts.start_agent_with("robot", &["--accept-executables"]);
    let run = hosts.run(&[]);
    let first = hosts.wait_for_far(&run, &[]);
    hosts.wait_for_data(&run, "far.numbers");
    let kept = list_kept(&hosts);
    let [copy] = &kept[..] else { panic!("one executable: {kept:?}") };
    let name = copy.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    assert!(name.starts_with("probe-") && name.len() == "probe-".len() + 64, "{name}");
    let mode = fs::metadata(copy).expect("a file").permissions().mode() & 0o777;
    assert_eq!((mode, fs::read(copy).expect("it")), (0o700, fs::read(&own).expect("it")));

    // What was changed there is not run: it is sent again.
    append_byte(copy);
    send_signal(first, Signal::KILL);
    let second = hosts.wait_for_far(&run, &[first]);
    assert_eq!(fs::read(copy).expect("it"), fs::read(&own).expect("it"));
    drop(run);

    // Another build is sent, too, and no build runs in the place of another.
    append_byte(&own);
    let run = hosts.run(&[]);
    hosts.wait_for_far(&run, &[first, second]);
    assert_eq!(list_kept(&hosts).len(), 2);
    assert!(!run.log().contains("is another build"), "{}", run.log());
}
