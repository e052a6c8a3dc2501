//! Another user of the host, with and without the group that the file names. Only root can start a
//! process of another user, so the tests end early elsewhere.

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;

use rustix::process::geteuid;

use crate::fixture::{Folder, Run, run_to_end, wait_for};

/// The user and the group that own no files, by convention (Debian: `nobody`, `nogroup`).
const OTHER: u32 = 65534;

/// The rest of a system of one component.
const SIMULATOR: &str = concat!(
    "<component name='simulator' kind='simulator'><parameter name='world' value='",
    env!("CARGO_MANIFEST_DIR"),
    "/../missions/worlds/empty.svg'/></component></system></armor>"
);

/// Returns the name of the other user's group.
fn name_of_group() -> String {
    let groups = std::fs::read_to_string("/etc/group").expect("readable");
    let mut fields = groups.lines().map(|line| line.split(':').collect::<Vec<_>>());
    let group = fields.find(|fields| fields.get(2) == Some(&OTHER.to_string().as_str()));
    group.expect("a group of that id")[0].to_owned()
}

/// Starts a system of one component, and waits until the component runs.
fn start(folder: &Folder, attributes: &str) -> Run {
    let text = format!("<armor version='1'><system name='shared' {attributes}>{SIMULATOR}");
    folder.write("shared.xml", &text);
    let run = folder.run("out", &["shared.xml"]);
    wait_for("the component", || {
        let registry = run.registry().to_string();
        let (code, out, _) = run_to_end(&mut folder.armor(&["ps", "--registry", &registry]));
        // A process that has not registered yet is listed too, but only to its own user.
        let mut rows = out.lines().filter(|row| row.starts_with("simulator"));
        (code == 0 && rows.any(|row| row.contains("active"))).then_some(())
    });
    run
}

/// Runs `armor ps` as the other user: exit code, stdout and stderr.
fn look_as_other(folder: &Folder, run: &Run, group: Option<&str>) -> (i32, String, String) {
    // The other user may not search the folder of the sources.
    let program = folder.path().join("armor");
    if !program.exists() {
        let copied = Command::new("cp").arg(env!("CARGO_BIN_EXE_armor")).arg(&program).status();
        assert!(copied.expect("cp runs").success());
    }
    let mut command = Command::new(&program);
    command.args(["ps", "--registry", &run.registry().to_string()]);
    command.current_dir(Path::new("/")).env_clear().uid(OTHER).gid(OTHER);
    command.envs(group.map(|group| ("ARMOR_GROUP", group)));
    run_to_end(&mut command)
}

#[test]
fn a_member_of_the_group_that_the_file_names_takes_part() {
    if !geteuid().is_root() {
        eprintln!("skipped: only root can start a process of another user");
        return;
    }
    let folder = Folder::new("group");
    let group = name_of_group();
    let run = start(&folder, &format!("group='{group}'"));
    // The system is root's, whom every user trusts, so the other user needs no variable.
    let (code, out, err) = look_as_other(&folder, &run, None);
    assert_eq!(code, 0, "{out}{err}{}", run.log());
    assert!(out.contains("simulator") && out.contains("configd"), "{out}");
}

#[test]
fn a_file_without_a_group_admits_no_other_user_whatever_the_environment_of_either_is() {
    if !geteuid().is_root() {
        eprintln!("skipped: only root can start a process of another user");
        return;
    }
    let folder = Folder::new("no-group");
    let run = start(&folder, "");
    let (code, out, err) = look_as_other(&folder, &run, Some(&name_of_group()));
    assert_ne!(code, 0, "{out}{err}");
    assert!(!out.contains("simulator"), "{out}");
}

#[test]
fn a_group_that_does_not_exist_is_refused_with_its_place() {
    let folder = Folder::new("unknown-group");
    let system = "<armor version='1'><system name='shared' group='armor-no-such'>";
    folder.write("shared.xml", &format!("{system}{SIMULATOR}"));
    let (code, out, err) =
        run_to_end(&mut folder.armor(&["run", "shared.xml", "--headless", "--for", "1s"]));
    assert_eq!(code, 1, "{out}{err}");
    assert!(err.contains("this host has no group armor-no-such"), "{err}");
    assert!(err.contains("shared.xml:1:"), "{err}");
}
