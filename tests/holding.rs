//! Who commands a mission, and who looks at it: bound to that mission, told what becomes of it.

use rustix::process::Signal;

use crate::fixture::{Folder, Talker, ended, send, wait_for};
use crate::resilience::system::{Draft, System};

/// It does nothing but wait for orders.
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

fn shows(system: &System, words: &str) {
    wait_for(&format!("{words:?} is shown\n{}", system.run.log()), || {
        system.shown(&["mission", "show"]).contains(words).then_some(())
    });
}

/// `armor mission` about a system: code, stdout, stderr.
fn mission(system: &System, arguments: &[&str]) -> (i32, String, String) {
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["mission"]);
    ended(command.args(arguments).args(["--registry", &registry]))
}

fn talker(system: &System, arguments: &[&str]) -> Talker {
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["mission"]);
    Talker::start(command.args(arguments).args(["--registry", &registry]))
}

#[test]
fn whoever_is_ousted_ends_at_once_and_stays_ousted() {
    let system = watch("ousted");
    let ruth = talker(&system, &["operate", "--as", "ruth"]);
    assert_eq!(ruth.says(), "the command is yours");
    let (code, out, err) = mission(&system, &["fire", "leave", "--take", "--as", "sam"]);
    assert_eq!((code, out.as_str()), (1, ""), "{err}");
    shows(&system, "command     ruth (armor mission, process");
    let (code, out, err) = mission(&system, &["fire", "descend", "--take", "--as", "sam"]);
    assert_eq!((code, out.trim()), (0, "`descend` fires; the command is taken from ruth"), "{err}");
    ruth.end();
    system.replace("executive");
    shows(&system, "marked      down");
    assert!(!system.run.log().contains("ruth orders: go on with the command"));
    let shown = system.shown(&["mission", "show"]);
    assert!(!shown.contains("command     "), "{shown}");
}

#[test]
fn the_command_of_one_mission_is_none_of_the_next() {
    let mut system = watch("next-system");
    let mut ruth = talker(&system, &["operate", "--as", "ruth"]);
    assert_eq!(ruth.says(), "the command is yours");
    system.run.signal(Signal::KILL);
    system.run.code();
    let registry = system.registry.to_string();
    let next = system.folder.run("next", &["probes.xml", "--registry", &registry]);
    system.run = next;
    shows(&system, "marked      up");
    ruth.hang_up();
    ruth.end();
    // At most she asked for what had been hers, and was refused.
    let log = system.run.log();
    assert!(!log.contains("the command is yours"), "she commands another: {log}");
    let shown = system.shown(&["mission", "show"]);
    assert!(shown.contains("marked      up") && !shown.contains("command     "), "{shown}");
}

#[test]
fn a_mission_is_left_by_an_order_and_whoever_gave_it_is_told() {
    let mut system = watch("left");
    let mut ruth = talker(&system, &["operate", "--as", "ruth"]);
    assert_eq!(ruth.says(), "the command is yours");
    ruth.hears("fire descend");
    assert_eq!(ruth.says(), "`descend` fires");
    shows(&system, "marked      down");
    ruth.hears("fire leave");
    assert_eq!(ruth.says(), "`leave` fires");
    assert_eq!(system.run.code(), Some(0), "{}", system.run.log());
    ruth.end();
}

#[test]
fn what_is_shown_goes_on_through_a_restart_and_names_a_broken_file() {
    let system = watch("shown");
    let follower = talker(&system, &["show", "--follow"]);
    let heads = || assert!(follower_says(&follower, "mission watch: playing"));
    heads();
    system.replace("executive");
    heads();
    let (code, _, _) = mission(&system, &["fire", "descend"]);
    assert_eq!(code, 0);
    assert!(follower_says(&follower, "marked      down"));

    let text = std::fs::read_to_string(system.folder.path().join("probes.xml")).expect("the file");
    system.folder.write("probes.xml", &text.replace("to='over'", "to='nowhere'"));
    shows(&system, "the file on the disk is not valid (E0");
    shows(&system, "version 1 goes on");

    // One that is stopped is there all the same.
    let executive = system.pid("executive");
    send(executive, Signal::STOP);
    let (code, _, err) = mission(&system, &["show"]);
    assert!(code == 1 && !err.contains("no mission runs"), "{err}");
    send(executive, Signal::CONT);
}

fn follower_says(follower: &Talker, words: &str) -> bool {
    (0..1000).any(|_| follower.says().starts_with(words))
}

#[test]
fn what_is_no_journal_is_told_what_it_is() {
    let folder = Folder::new("no-journal");
    folder.write("watch.xml", WATCH);
    folder.write("empty", "");
    let put = r#"{"at_ns":12,"entry":"put","firing":3}"#;
    folder.write("cut", &format!("{put}\n"));
    for (file, why) in [
        ("watch.xml", "is a mission file and no journal: `armor mission replay watch.xml --fire"),
        ("empty", "holds no record: no mission has begun in it"),
        ("cut", "the beginning of cut is missing (it begins with \"firing 3: complete\")"),
    ] {
        let (code, _, err) = ended(&mut folder.armor(&["mission", "replay", file]));
        assert!(code == 1 && err.contains(why), "{file}: {err}");
    }
    // A variable that is set to nothing is as good as none.
    let mut show = folder.armor(&["mission", "show"]);
    let (code, _, err) = ended(show.env("ARMOR_REGISTRY", ""));
    assert!(code == 1 && err.contains("no system is running"), "{err}");
}
