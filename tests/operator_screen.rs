//! A window that an operator has started stays when a run ends, with the last picture and the reason,
//! and shows the next run of the same file. It is no process of any run: of these none is left.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};

use rustix::process::Signal;

use crate::fixture::{Folder, Run, send_signal, wait_for};

/// An operator's screen in a mission that ends after a second, unless an operator holds it.
const ROBOT: &str = "<armor version='1'>
  <system name='rover'>
    <component name='simulator' kind='simulator' rate='20Hz'>
      <parameter name='world' value='room.svg'/>
    </component>
    <component name='view' kind='operator-view' rate='20Hz' controllable='false'/>
    COMPONENT
    <link from='simulator.odometry' to='view.odometry'/>
  </system>
  <mission name='rover' goal='over' safe='hold'>
    <place name='under-way' initial='true'/>
    <place name='over'/>
    <place name='hold'/>
    <transition name='arrive' from='under-way' to='over' AFTER/>
  </mission>
</armor>";

const WORLD: &str =
    r#"<svg><rect x="-6" y="-6" width="12" height="12"/><circle id="start"/></svg>"#;

/// A window without a display: it paints its screen as a file.
struct Station {
    child: Child,
    lines: Arc<Mutex<Vec<String>>>,
}

impl Station {
    fn start(folder: &Folder, watched: &str) -> Self {
        let program = Path::new(env!("CARGO_BIN_EXE_armor")).with_file_name("armor-operator-view");
        let mut command = Command::new(program);
        command.args(["--watch", watched, "--picture", "screen.png"]).current_dir(folder.path());
        command.env("XDG_RUNTIME_DIR", folder.path().join("run")).env_remove("DISPLAY");
        let mut child = command.stderr(Stdio::piped()).spawn().expect("it starts");
        let lines = Arc::<Mutex<Vec<String>>>::default();
        let (heard, stderr) = (Arc::clone(&lines), child.stderr.take().expect("piped"));
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                heard.lock().expect("no panic").push(line);
            }
        });
        let station = Self { child, lines };
        station.wait_for_line("waiting for a run of", 1);
        station
    }

    fn wait_for_line(&self, text: &str, times: usize) {
        wait_for(&format!("{text:?} {times} times"), || {
            let lines = self.lines.lock().expect("no panic");
            (lines.iter().filter(|line| line.contains(text)).count() >= times).then_some(())
        });
    }
}

impl Drop for Station {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Writes the file: with a component that dies at its start, or a mission that continues.
fn write_robot(folder: &Folder, component: &str, after: &str) {
    let text = ROBOT.replace("COMPONENT", component).replace("AFTER", after);
    folder.write("rover.xml", &text);
}

/// The screen: a program of its own next to `armor`.
fn program() -> PathBuf {
    Path::new(env!("CARGO_BIN_EXE_armor")).with_file_name("armor-operator-view")
}

fn is_there() -> bool {
    let there = program().exists();
    assert!(there || std::env::var_os("CI").is_none(), "armor-operator-view is not built");
    if !there {
        println!("skipped: no armor-operator-view; cargo build -p armor-operator-view");
    }
    there
}

/// Waits until every process of the run has ended.
fn none_is_left(processes: &[i32]) {
    wait_for("the end of all processes of the run", || {
        let left = processes.iter().filter(|pid| Path::new(&format!("/proc/{pid}")).exists());
        (left.count() == 0).then_some(())
    });
}

fn start(folder: &Folder) -> Run {
    folder.run("out", &["rover.xml", "--headless"])
}

#[test]
fn the_window_stays_with_the_reason_and_shows_the_next_run_of_the_file() {
    if !is_there() {
        return;
    }
    let folder = Folder::new("operator-screen");
    folder.write("room.svg", WORLD);
    write_robot(&folder, "", "after='1s'");
    let station = Station::start(&folder, "rover.xml");

    let mut run = start(&folder);
    station.wait_for_line("shows rover", 1);
    assert_eq!(run.code(), Some(0), "{}", run.log());
    station.wait_for_line("has ended: the mission reached its goal", 1);

    // The same file again, with a mission that continues: interrupted, and then killed.
    write_robot(&folder, "", "operator='true'");
    let mut run = start(&folder);
    station.wait_for_line("shows rover", 2);
    let processes = run.children();
    assert!(processes.len() > 3, "{processes:?}");
    // Its component is killed: it returns, and the run has not ended.
    let is_view = |pid: &&i32| {
        let command = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        command.starts_with(program().as_os_str().as_encoded_bytes())
    };
    let view = processes.iter().find(is_view).expect("the component of the screen");
    send_signal(*view, Signal::KILL);
    station.wait_for_line("shows rover", 3);
    station.wait_for_line("alert: view ", 1);
    let ends = station
        .lines
        .lock()
        .expect("no panic")
        .iter()
        .filter(|it| it.contains("has ended"))
        .count();
    assert_eq!(ends, 1, "only the run before");
    let processes = run.children();
    run.signal(Signal::INT);
    assert_eq!(run.code(), Some(130), "{}", run.log());
    station.wait_for_line("has ended: it was interrupted", 1);
    none_is_left(&processes);

    let mut run = start(&folder);
    station.wait_for_line("shows rover", 4);
    let processes = run.children();
    send_signal(run.pid(), Signal::KILL);
    assert_eq!(run.code(), None);
    station.wait_for_line("has ended: its launcher is gone", 1);
    none_is_left(&processes);

    // A component that is given up.
    let dies = "<component name='arm' kind='arm'/>";
    folder.script("arm", "sleep 0.3; exit 7");
    write_robot(&folder, dies, "operator='true'");
    let text = std::fs::read_to_string(folder.path().join("rover.xml")).expect("the file");
    folder.write("rover.xml", &text.replace("initial='true'", "initial='true' components='arm'"));
    let mut run = start(&folder);
    station.wait_for_line("shows rover", 5);
    assert_eq!(run.code(), Some(1), "{}", run.log());
    station.wait_for_line("has ended: the mission ended in its safe place: ", 1);
    station.wait_for_line("arm was given up after 5 starts", 1);

    let picture = std::fs::read(folder.path().join("screen.png")).expect("its picture");
    assert!(picture.starts_with(b"\x89PNG"));
}

#[test]
fn a_second_window_for_the_same_file_is_refused() {
    if !is_there() {
        return;
    }
    let folder = Folder::new("operator-screens");
    write_robot(&folder, "", "operator='true'");
    let first = Station::start(&folder, "rover.xml");
    let mut second = Command::new(program());
    second.args(["--watch", "rover.xml", "--picture", "other.png"]).current_dir(folder.path());
    second.env("XDG_RUNTIME_DIR", folder.path().join("run"));
    let second = second.output().expect("it starts");
    let text = String::from_utf8_lossy(&second.stderr);
    assert!(!second.status.success() && text.contains("is open already"), "{text}");
    drop(first);
}
