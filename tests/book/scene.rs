//! The places in which commands of the book are run: a folder with the example missions and a
//! recording, and the system that runs in it meanwhile.

use std::path::Path;

use super::REPOSITORY;
use crate::fixture::{Folder, wait_for};
use crate::tutorial::terminal::{Program, Terminal};

/// A scene by its name, with the commands that run meanwhile.
const SCENES: [(&str, &[&str]); 5] = [
    ("folder", &[]),
    ("office", &["armor run missions/office.xml"]),
    // The office robot without a mission, whose components an operator may stop.
    ("robot", &["armor run robot.xml"]),
    ("playing", &["armor play drive.mcap --loop"]),
    ("web", &["armor run missions/office.xml", "armor web"]),
];

/// What `armor run` prints when its mission begins.
const PLAYS: &str = "the start:";

/// Returns whether there is a scene of this name.
pub fn is_scene(name: &str) -> bool {
    SCENES.iter().any(|(scene, _)| *scene == name)
}

/// All names.
pub fn scene_names() -> Vec<&'static str> {
    SCENES.iter().map(|(name, _)| *name).collect()
}

/// The folder of one page.
pub fn make_folder(name: &str, needs_recording: bool) -> Folder {
    let folder = Folder::new(name);
    let repository = Path::new(REPOSITORY).canonicalize().expect("it is there");
    // A copy: a command may write a parameter into its mission.
    copy_folder(&repository.join("missions"), &folder.path().join("missions"));
    std::os::unix::fs::symlink(repository.join("docs"), folder.path().join("docs"))
        .expect("a link");
    let office = std::fs::read_to_string(repository.join("missions/office.xml")).expect("a file");
    let office = office.replace("\"worlds/", "\"missions/worlds/");
    let (before, mission) = office.split_once("<mission").expect("it has a mission");
    let after = mission.split_once("</mission>").expect("its end").1;
    folder.write("robot.xml", &format!("{before}{after}"));
    let program = folder.path().join("target/release");
    std::fs::create_dir_all(&program).expect("writable");
    std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_armor"), program.join("armor")).expect("a link");
    folder.write("intel.log.gz", &laser_log());
    if needs_recording {
        write_recordings(&folder);
    }
    folder
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir(to).expect("writable");
    for entry in std::fs::read_dir(from).expect("readable") {
        let entry = entry.expect("an entry");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).expect("writable");
        }
    }
}

/// A log of CARMEN: a robot stands in the middle of a round room. The player reads it as it is,
/// although its name is that of a compressed one.
fn laser_log() -> String {
    let line = |scan| {
        let time = f64::from(scan) / 5.0;
        format!("FLASER 181{} 0 0 0 0 0 0 {time} robot {time}\n", " 2.00".repeat(181))
    };
    (0..20).map(line).collect()
}

/// Writes the recordings that pages name: `drive.mcap` of the office robot, and what else they
/// cut, merge, recover and convert.
fn write_recordings(folder: &Folder) {
    let terminal = Terminal::at_home(folder);
    let mut scene = Scene::begin(&terminal, "office", "");
    terminal.run("armor record -o drive.mcap --for 4s", false, "a recording");
    scene.end();
    terminal.run(
        "cp drive.mcap front.mcap; cp drive.mcap rear.mcap\n\
         head -c $(($(stat -c %s drive.mcap) / 2)) drive.mcap > broken.mcap\n\
         rm -r .bin out",
        false,
        "further recordings",
    );
}

/// What runs while the commands of a block do.
pub struct Scene<'a> {
    programs: Vec<Program>,
    terminal: &'a Terminal<'a>,
    /// The address of the page for browsers.
    page: &'a str,
}

impl<'a> Scene<'a> {
    /// A scene in which nothing runs yet.
    pub fn empty(terminal: &'a Terminal<'a>, page: &'a str) -> Self {
        Self { programs: Vec::new(), terminal, page }
    }

    /// Starts what the scene of this name runs.
    pub fn begin(terminal: &'a Terminal<'a>, name: &str, page: &'a str) -> Self {
        let mut scene = Self::empty(terminal, page);
        let (_, commands) = SCENES.iter().find(|(scene, _)| *scene == name).expect("a scene");
        commands.iter().for_each(|command| scene.start(command, "the scene"));
        scene
    }

    /// Starts a program that runs until the end of the scene, and waits until it can be used.
    pub fn start(&mut self, command: &str, at: &str) {
        // Another server may have the default port.
        let command =
            &command.replacen("armor web", &format!("armor web --listen {}", self.page), 1);
        let program = self.terminal.start(command);
        // A system is ready when its mission plays, or, without one, its components are there.
        let verb = command.split_whitespace().nth(1);
        let has_mission = !["robot.xml", "explorer.xml"].iter().any(|file| command.contains(file));
        let mark = match verb {
            Some("run") if command.contains("--resume") => "continues",
            Some("run") if has_mission => PLAYS,
            Some("run") => "registered name=driver",
            _ => "",
        };
        wait_for(&format!("{at}: {command} runs"), || {
            let output = program.output();
            let is_ready = program.catches_interrupt() && output.contains(mark);
            (is_ready || program.has_ended()).then_some(())
        });
        if program.has_ended() {
            program.wait_for_success(at);
            return;
        }
        self.programs.push(program);
        if mark == PLAYS {
            wait_for(&format!("{at}: {command} has begun"), || {
                let (_, shown) = self.terminal.try_run("armor mission show");
                shown.contains("in flight   none").then_some(())
            });
        }
    }

    /// Ends all of them as Ctrl-C does, the last one first.
    pub fn end(&mut self) {
        while let Some(program) = self.programs.pop() {
            program.interrupt("the end of the scene");
        }
    }
}
