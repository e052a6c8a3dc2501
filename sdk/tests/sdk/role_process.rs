//! Processes of a test: this test program again, in a role. A test that kills components, or counts
//! what a process does, needs each of them in a process of its own.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use rustix::process::{Signal, set_parent_process_death_signal};

use crate::bench_system::{DEADLINE, System};
use crate::copies::{DecodingReader, LargePublisher, ViewingReader};
use crate::slot_kills::{FullPublisher, FullReader};

const ROLE_VARIABLE: &str = "ARMOR_TEST_ROLE";
const ARGUMENTS_VARIABLE: &str = "ARMOR_TEST_ARGUMENTS";

/// What a process does; [`RoleProcess::start`] starts this program with this test alone.
#[test]
#[ignore = "a process of other tests"]
fn play_role() {
    let Ok(role) = std::env::var(ROLE_VARIABLE) else { return };
    set_parent_process_death_signal(Some(Signal::KILL)).unwrap();
    let arguments = std::env::var(ARGUMENTS_VARIABLE).unwrap();
    let arguments = arguments.lines().map(Into::into);
    match role.as_str() {
        "full-publisher" => armor_sdk::run_with::<FullPublisher>(arguments),
        "full-reader" => armor_sdk::run_with::<FullReader>(arguments),
        "large-publisher" => armor_sdk::run_with::<LargePublisher>(arguments),
        "viewing-reader" => armor_sdk::run_with::<ViewingReader>(arguments),
        "decoding-reader" => armor_sdk::run_with::<DecodingReader>(arguments),
        _ => panic!("there is no role `{role}`"),
    };
}

/// A process in a role. Dropping it kills it.
pub struct RoleProcess {
    pub child: Child,
    pub lines: Receiver<String>,
    pub started: Instant,
}

impl RoleProcess {
    /// Starts the component of a kind under a name of the system.
    pub fn start(
        system: &System,
        kind: &str,
        name: &str,
        more: &[&str],
        variable: Option<(&str, &str)>,
    ) -> Self {
        let (name, registry) = (system.name(name), system.registry.address().to_string());
        let arguments = ["--alone", "--name", &name, "--registry", &registry];
        let arguments = [&arguments[..], more].concat().join("\n");
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "role_process::play_role", "--ignored", "--nocapture"]);
        command.env(ROLE_VARIABLE, kind).env(ARGUMENTS_VARIABLE, arguments);
        command.env("ARMOR_LOG", "error").stdin(Stdio::null()).stdout(Stdio::piped());
        command.envs(variable);
        let started = Instant::now();
        let mut child = command.spawn().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            stdout.lines().map_while(Result::ok).for_each(|line| drop(sender.send(line)));
        });
        Self { child, lines, started }
    }

    /// The next line that it prints.
    pub fn read_line(&self, what: &str) -> String {
        self.lines.recv_timeout(DEADLINE).unwrap_or_else(|_| panic!("{what}: it prints no more"))
    }
}

impl Drop for RoleProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
