//! Operators and observers of a mission: bound to one mission, and informed of its end.

use rustix::process::Signal;

use crate::fixture::{DEADLINE, Dialogue, Folder, find_within, run_to_end, send_signal};
use crate::resilience::system::{Draft, System};

/// A mission that only waits for orders.
const WATCH: &str = "
<mission name='watch' goal='over' safe='hold'>
  <place name='up' initial='true'/>
  <place name='down'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='descend' from='up' to='down' operator='true'/>
  <transition name='leave' from='down' to='over' operator='true'/>
</mission>";

fn watch(folder: &str) -> System {
    let system = Draft::default().mission(WATCH).run(Folder::new(folder));
    shows(&system, "marked      up");
    system
}

/// Waits until the mission shows these words; returns what it shows then.
fn shows(system: &System, words: &str) -> String {
    let mut shown = String::new();
    let found = find_within(DEADLINE, || {
        shown = system.shown(&["mission", "show"]);
        shown.contains(words).then_some(())
    });
    assert!(found.is_some(), "{words:?} is not shown, but {shown:?}\n{}", system.run.log());
    shown
}

/// Runs `armor mission` on a system; returns its exit code, stdout and stderr.
fn mission(system: &System, arguments: &[&str]) -> (i32, String, String) {
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["mission"]);
    run_to_end(command.args(arguments).args(["--registry", &registry]))
}

fn talker(system: &System, arguments: &[&str]) -> Dialogue {
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["mission"]);
    Dialogue::start(command.args(arguments).args(["--registry", &registry]))
}

#[test]
fn an_ousted_operator_ends_immediately_and_stays_ousted() {
    let system = watch("ousted");
    let ruth = talker(&system, &["operate", "--as", "ruth"]);
    assert_eq!(ruth.read_line(), "the command is yours");
    let (code, out, err) = mission(&system, &["fire", "leave", "--take", "--as", "sam"]);
    assert_eq!((code, out.as_str()), (1, ""), "{err}");
    shows(&system, "command     ruth (armor mission, process");
    let (code, out, err) = mission(&system, &["fire", "descend", "--take", "--as", "sam"]);
    assert_eq!((code, out.trim()), (0, "`descend` fires; the command is taken from ruth"), "{err}");
    ruth.wait_for_end();
    system.replace("executive");
    shows(&system, "marked      down");
    // Before that her link may have broken on a busy host, and then she claims what is still hers.
    let log = system.run.log();
    let (_, after) = log.split_once("sam orders: fire descend").expect("the order is logged");
    assert!(!after.contains("ruth orders: keep the command"), "{log}");
    let shown = system.shown(&["mission", "show"]);
    assert!(!shown.contains("command     "), "{shown}");
}

#[test]
fn the_command_of_one_mission_does_not_carry_over_to_the_next() {
    let mut system = Draft::default().mission(WATCH).run_on_own_port(Folder::new("next-system"));
    shows(&system, "marked      up");
    let mut ruth = talker(&system, &["operate", "--as", "ruth"]);
    assert_eq!(ruth.read_line(), "the command is yours");
    system.run.signal(Signal::KILL);
    system.run.code();
    let registry = system.registry.to_string();
    let next = system.folder.run("next", &["probes.xml", "--registry", &registry]);
    system.run = next;
    shows(&system, "marked      up");
    ruth.close_input();
    ruth.wait_for_end();
    // The client may have asked the new mission for the command again; it must have been refused.
    let log = system.run.log();
    assert!(!log.contains("the command is yours"), "she commands another: {log}");
    // For a moment the executive of the killed launcher may have answered instead of the new one.
    let shown = shows(&system, "marked      up");
    assert!(!shown.contains("command     "), "{shown}");
}

#[test]
fn an_order_ends_a_mission_and_its_author_is_informed() {
    let mut system = watch("left");
    let mut ruth = talker(&system, &["operate", "--as", "ruth"]);
    assert_eq!(ruth.read_line(), "the command is yours");
    ruth.write_line("fire descend");
    assert_eq!(ruth.read_line(), "`descend` fires");
    shows(&system, "marked      down");
    ruth.write_line("fire leave");
    assert_eq!(ruth.read_line(), "`leave` fires");
    assert_eq!(system.run.code(), Some(0), "{}", system.run.log());
    ruth.wait_for_end();
}

#[test]
fn the_display_continues_through_a_restart_and_names_a_broken_file() {
    let system = watch("shown");
    let follower = talker(&system, &["show", "--follow"]);
    let heads = || assert!(follower_shows(&follower, "mission watch: playing"));
    heads();
    // The new executive sends the same marking, which is not printed again.
    system.replace("executive");
    let (code, _, _) = mission(&system, &["fire", "descend"]);
    assert_eq!(code, 0);
    assert!(follower_shows(&follower, "marked      down"));

    let text = std::fs::read_to_string(system.folder.path().join("probes.xml")).expect("the file");
    system.folder.write("probes.xml", &text.replace("to='over'", "to='nowhere'"));
    shows(&system, "the file on the disk is not valid (E0");
    shows(&system, "version 1 continues");

    // A stopped executive does not answer, but its mission still exists.
    let executive = system.pid("executive");
    send_signal(executive, Signal::STOP);
    let (code, _, err) = mission(&system, &["show"]);
    assert!(code == 1 && !err.contains("no mission runs"), "{err}");
    send_signal(executive, Signal::CONT);
}

fn follower_shows(follower: &Dialogue, words: &str) -> bool {
    (0..1000).any(|_| follower.read_line().starts_with(words))
}

#[test]
fn a_file_that_is_no_journal_is_refused_with_the_reason() {
    let folder = Folder::new("no-journal");
    folder.write("watch.xml", WATCH);
    folder.write("empty", "");
    folder.write("none", "nonsense\n");
    let put = r#"{"at_ns":12,"entry":"put","firing":3}"#;
    folder.write("cut", &format!("{put}\n"));
    for (file, why) in [
        ("watch.xml", "is a mission file and no journal: `armor mission replay watch.xml --fire"),
        ("empty", "has no record: no mission has begun in it"),
        ("cut", "journal cut was written by an earlier version of Armor"),
        ("none", "line 1 is not a record"),
    ] {
        let (code, _, err) = run_to_end(&mut folder.armor(&["mission", "replay", file]));
        assert!(code == 1 && err.contains(why), "{file}: {err}");
    }
    // An empty variable counts as unset.
    let mut show = folder.armor(&["mission", "show"]);
    let (code, _, err) = run_to_end(show.env("ARMOR_REGISTRY", ""));
    assert!(code == 1 && err.contains("no system is running"), "{err}");
}
