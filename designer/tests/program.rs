//! The program as it is run: `--check` next to `armor check`, pictures, and what a kill leaves.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use armor_designer::disk::recovery::orphans;
use armor_designer::export::Stage;
use armor_designer::{Designer, Kinds, Settings, Start};
use armor_robotfile::Code;
use eframe::egui::Context;

const DESIGNER: &str = env!("CARGO_BIN_EXE_armor-designer");

fn missions() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions")
}

/// The `armor` binary of the same build. It is there when the whole workspace is tested, which the
/// gate does; a test of this crate alone goes without.
fn armor() -> Option<PathBuf> {
    let armor = Path::new(DESIGNER).parent().expect("a folder").join("armor");
    assert!(armor.exists() || std::env::var_os("CI").is_none(), "{} is missing", armor.display());
    armor.exists().then_some(armor)
}

fn run(program: impl AsRef<std::ffi::OsStr>, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).env_remove("ARMOR").output().expect("it runs")
}

/// Returns the findings without the folders that `armor check` looked in: the designer asks it for
/// the kinds alone.
fn without_search(findings: &str) -> String {
    let lines = findings.lines().map(|line| line.split("; looked in").next().unwrap_or(line));
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_designer_finds_what_armor_check_finds() {
    let Some(armor) = armor() else { return };
    let folder = scratch("findings");
    let valid = ["office.xml", "survey.xml", "meeting.xml", "appointment.xml"];
    let mut paths: Vec<_> = valid.iter().map(|file| missions().join(file)).collect();
    for code in
        ["E0002", "E0004", "E0103", "E0105", "E0109", "E0111", "E0201", "E0205", "W0213", "W0218"]
    {
        let example = Code::named(code).and_then(Code::faulty_example).expect("an example");
        let path = folder.join(format!("{code}.xml"));
        std::fs::write(&path, example.file("robot.xml").expect("a file")).expect("it is written");
        paths.push(path);
    }
    for path in paths {
        assert!(path.exists(), "{} is missing", path.display());
        let path = path.to_str().expect("UTF-8");
        let (ours, theirs) = (run(DESIGNER, &["--check", path]), run(&armor, &["check", path]));
        let errors = |output: &Output| without_search(&String::from_utf8_lossy(&output.stderr));
        assert_eq!(errors(&ours), errors(&theirs), "{path}");
        assert_eq!(ours.stdout, theirs.stdout, "{path}");
        assert_eq!(ours.status.code(), theirs.status.code(), "{path}");
    }
}

#[test]
fn pictures_are_taken_without_a_display() {
    if armor().is_none() {
        return;
    }
    let folder = scratch("pictures");
    let file = missions().join("office.xml");
    let file = file.to_str().expect("UTF-8");
    for (option, name, begins) in [
        ("--screenshot", "window.png", &b"\x89PNG"[..]),
        ("--export", "system.svg", b"<svg"),
        ("--export", "system.png", b"\x89PNG"),
    ] {
        let path = folder.join(name);
        let to = path.to_str().expect("UTF-8");
        let mut command = Command::new(DESIGNER);
        command.args([option, to, file]).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        let output = command.output().expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(std::fs::read(&path).expect("written").starts_with(begins), "{name}");
    }
    std::fs::remove_dir_all(&folder).expect("removed");
}

#[test]
fn a_mistake_in_the_command_line_is_reported() {
    let output = run(DESIGNER, &["--size", "large"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("1280x800"));
}

fn scratch(name: &str) -> PathBuf {
    let name = format!("armor-designer-{name}-{}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// The variable that makes this program the one that is killed: its folder.
const VICTIM: &str = "ARMOR_DESIGNER_VICTIM";
const ROBOT: &str = "<armor version=\"1\">\n  <system name=\"robot-0\"/>\n</armor>\n";

/// Draws without end, and states each change.
#[test]
fn draws_until_it_is_killed() {
    let Some(folder) = std::env::var_os(VICTIM).map(PathBuf::from) else { return };
    let context = Context::default();
    let start = Start {
        file: Some(folder.join("robot.xml")),
        kinds: Some(Kinds::default()),
        own_folder: Some(folder.join("own")),
        ..Start::default()
    };
    let mut designer = Designer::new(&context, start, Settings::default());
    let mut stage = Stage::new(context, 800, 600, 1.0);
    for n in 1.. {
        let is_made = designer.workspace().edit("counting", |documents| {
            let document = documents.system()?;
            Ok(document.set_attribute_at(&[0], "name", Some(&format!("robot-{n}")))?)
        });
        assert!(is_made);
        stage.settle(1, |ui| designer.show(ui));
        println!("drawn {n}");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
}

#[test]
fn a_kill_in_the_middle_of_work_leaves_the_work_and_the_file() {
    let folder = scratch("killed");
    std::fs::write(folder.join("robot.xml"), ROBOT).expect("written");
    let mut victim = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "program::draws_until_it_is_killed", "--nocapture"])
        .env(VICTIM, &folder)
        .stdout(Stdio::piped())
        .spawn()
        .expect("it runs");
    let lines = BufReader::new(victim.stdout.take().expect("piped")).lines();
    let kept = folder.join("own/recovery");
    let mut seen = Vec::new();
    let mut drawn = 0;
    // Until it was written again twice: the last changes count, not the first alone.
    for line in lines.map_while(Result::ok) {
        let number = line.strip_prefix("drawn ").and_then(|number| number.parse::<u64>().ok());
        drawn = number.unwrap_or(drawn);
        seen.extend(newest(&kept).filter(|number| !seen.contains(number)));
        if seen.len() >= 3 {
            break;
        }
    }
    victim.kill().expect("it lives");
    victim.wait().expect("it is dead");
    let found = orphans(&kept);
    assert_eq!(found.len(), 1, "the work is offered");
    let text = found[0].kept.files[0].text.clone().expect("it was changed");
    let number = counted(&text).expect("a whole text");
    assert!(number >= seen[2] && number <= drawn + 1, "{number} of {drawn}, seen {seen:?}");
    assert_eq!(std::fs::read_to_string(folder.join("robot.xml")).expect("there"), ROBOT);
    std::fs::remove_dir_all(&folder).expect("removed");
}

/// How far the work is that is kept now.
fn newest(folder: &Path) -> Option<u64> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let mut files = entries.filter(|entry| entry.path().extension().is_some_and(|e| e == "json"));
    counted(&std::fs::read_to_string(files.next()?.path()).ok()?)
}

/// The number in the name of the system.
fn counted(text: &str) -> Option<u64> {
    let rest = text.rsplit("robot-").next()?;
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().ok()
}
