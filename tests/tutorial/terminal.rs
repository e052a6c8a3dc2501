//! A reader's terminal. It keeps its current folder between commands; further terminals open there.

use std::fs::File;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};

use super::REPOSITORY;
use crate::fixture::{DEADLINE, Folder, wait_for, wait_within};

/// Time for a build. On a new machine it builds all dependencies.
const BUILD_DEADLINE: Duration = Duration::from_secs(900);

/// The reader's `cargo`, which reuses earlier downloads and builds.
const CARGO: &str = r#"#!/bin/sh
if [ -f Cargo.toml ] && [ ! -e target ]; then
  cp "$REPOSITORY/Cargo.lock" . && mkdir -p "$REPOSITORY/target/new-component"
  ln -s "$REPOSITORY/target/new-component" target
fi
exec "$REAL_CARGO" "$@"
"#;

/// A terminal.
pub struct Terminal<'a> {
    folder: &'a Folder,
    /// Where `armor` and `cargo` are found.
    path: String,
    /// Whether the folder is the reader's home, too.
    is_home: bool,
    opened: AtomicUsize,
}

impl<'a> Terminal<'a> {
    /// A terminal in `folder`.
    pub fn new(folder: &'a Folder) -> Self {
        let bin = folder.path().join(".bin");
        std::fs::create_dir_all(&bin).expect("writable");
        std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_armor"), bin.join("armor")).expect("a link");
        folder.executable(".bin/cargo", CARGO);
        let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
        let terminal = Self { folder, path, is_home: false, opened: AtomicUsize::new(0) };
        std::fs::write(terminal.place(), folder.path().display().to_string()).expect("writable");
        terminal
    }

    /// A terminal in `folder`, which is also the reader's home.
    pub fn at_home(folder: &'a Folder) -> Self {
        Self { is_home: true, ..Self::new(folder) }
    }

    /// Returns the length of a file in the current folder, 0 if there is none.
    pub fn len_of(&self, file: &Path) -> u64 {
        std::fs::metadata(self.here().join(file)).map_or(0, |metadata| metadata.len())
    }

    /// Where the name of the current folder is kept.
    fn place(&self) -> PathBuf {
        self.folder.path().join(".place")
    }

    fn here(&self) -> PathBuf {
        std::fs::read_to_string(self.place()).expect("it was written").trim_end().into()
    }

    fn bash(&self, script: &str) -> Command {
        let mut command = Command::new("bash");
        command.args(["-c", script]).current_dir(self.here()).stdin(Stdio::null());
        command.env("PATH", &self.path).env("REPOSITORY", REPOSITORY);
        command.env("REAL_CARGO", env!("CARGO")).env("CARGO_NET_OFFLINE", "true");
        command.env("XDG_RUNTIME_DIR", self.folder.path().join("run"));
        let others = ["ARMOR_REGISTRY", "ARMOR_COMPONENTS", "ARMOR_OUT", "ARMOR_LOG"];
        if self.is_home {
            command.env("HOME", self.folder.path());
            for variable in ["XDG_CONFIG_HOME", "XDG_DATA_HOME", "ARMOR_KEYS"] {
                command.env_remove(variable);
            }
        }
        for variable in others.into_iter().chain(["CARGO_TARGET_DIR"]) {
            command.env_remove(variable);
        }
        command
    }

    /// Writes a file of the page.
    pub fn write(&self, path: &str, text: &str) {
        let path = self.here().join(path);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        std::fs::write(path, text).expect("writable");
    }

    /// Runs commands to their end; returns their output.
    pub fn run(&self, commands: &str, fails: bool, at: &str) -> String {
        let (status, output) = self.try_run(commands);
        assert_eq!(status.success(), !fails, "{at}: {status}\n{commands}{output}");
        output
    }

    /// Runs commands to their end, whatever their exit code.
    pub fn try_run(&self, commands: &str) -> (ExitStatus, String) {
        let script = format!("set -e\n{commands}\npwd > \"{}\"", self.place().display());
        let mut program = self.spawn(&script);
        let limit = if ["cargo ", "cmake "].iter().any(|build| commands.contains(build)) {
            BUILD_DEADLINE
        } else {
            DEADLINE
        };
        let status = wait_within(limit, commands, || program.child.try_wait().expect("it is ours"));
        (status, program.output())
    }

    /// Starts a long-running command in a terminal of its own.
    pub fn start(&self, command: &str) -> Program {
        // `exec` replaces bash by the command, which so receives the signal and gives the exit
        // code.
        self.spawn(&format!("exec {command}"))
    }

    fn spawn(&self, script: &str) -> Program {
        let number = self.opened.fetch_add(1, Ordering::Relaxed);
        let screen = self.folder.path().join(format!(".screen-{number}"));
        let file = File::create(&screen).expect("writable");
        let mut bash = self.bash(script);
        bash.process_group(0).stdout(file.try_clone().expect("a file")).stderr(file);
        Program { child: bash.spawn().expect("bash starts"), screen }
    }
}

/// A program in a terminal; it ends with the test.
pub struct Program {
    child: Child,
    screen: PathBuf,
}

impl Program {
    /// Returns the output so far.
    pub fn output(&self) -> String {
        std::fs::read_to_string(&self.screen).expect("UTF-8")
    }

    /// Whether it has ended by itself.
    pub fn has_ended(&self) -> bool {
        let pid = i32::try_from(self.child.id()).expect("a process id");
        !crate::fixture::is_alive(pid)
    }

    /// Returns whether it handles Ctrl-C, as a program does that has begun its work.
    pub fn catches_interrupt(&self) -> bool {
        let status = format!("/proc/{}/status", self.child.id());
        let status = std::fs::read_to_string(status).unwrap_or_default();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let caught = caught.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).unwrap_or(0);
        caught & (1 << (Signal::INT.as_raw() - 1)) != 0
    }

    /// Waits for its end, which must be a success.
    pub fn wait_for_success(mut self, at: &str) {
        let status = wait_for(at, || self.child.try_wait().expect("it is ours"));
        assert!(status.success(), "{at}: {status}\n{}", self.output());
    }

    /// Sends Ctrl-C unless the program has already ended; returns all of its output.
    pub fn interrupt(mut self, at: &str) -> String {
        let status = self.press_control_c();
        let output = self.output();
        assert!(matches!(status.code(), Some(0 | 130)), "{at}: {status}\n{output}");
        output
    }

    /// As [`Self::interrupt`], of a program that has nothing to do at its end: the signal ends it.
    pub fn interrupt_reader(mut self, at: &str) {
        let status = self.press_control_c();
        let is_interrupted = status.signal() == Some(Signal::INT.as_raw());
        let is_fine = is_interrupted || matches!(status.code(), Some(0 | 130));
        assert!(is_fine, "{at}: {status}\n{}", self.output());
    }

    fn press_control_c(&mut self) -> ExitStatus {
        if !self.has_ended() {
            self.signal(Signal::INT);
        }
        wait_for("the end after Ctrl-C", || self.child.try_wait().expect("it is ours"))
    }

    /// Returns whether it is the program itself, no more the shell, and waits for something.
    pub fn waits_as(&self, name: &str) -> bool {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id()));
        stat.unwrap_or_default().contains(&format!("({name}) S"))
    }

    fn signal(&self, signal: Signal) {
        if let Some(group) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw) {
            // The program may have ended by itself.
            let _ = kill_process_group(group, signal);
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            self.signal(Signal::KILL);
            let _ = self.child.wait();
        }
    }
}
