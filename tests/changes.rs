//! The mission file is edited while the mission runs. A proven edit takes effect; an unproven edit
//! is refused with a counterexample; a killed executive resumes in the net that was in effect.

use armor_executive::journal;
use armor_executive::{Cause, JournalEntry, JournalRecord};

use crate::fixture::{Folder, wait_for};
use crate::resilience::system::{Draft, System};

/// Explores for an hour, then returns for an hour; `more` is appended to the mission.
fn mission(more: &str) -> String {
    format!(
        "<mission name='survey' goal='home' safe='hold'>
           <place name='explore' initial='true' components='explorer'/>
           <place name='return' components='homing'/>
           <place name='home'/>
           <place name='hold' components='brake'/>
           <exclusive components='explorer homing brake'/>
           <transition name='late' from='explore' to='return' timeout='1h'/>
           <transition name='arrived' from='return' to='home' timeout='1h'/>
           {more}
         </mission>"
    )
}

fn run(folder: &str) -> System {
    let attributes = "rate='20Hz'";
    let system = Draft::default()
        .probe("explorer", attributes, "")
        .probe("homing", attributes, "")
        .probe("brake", attributes, "")
        .mission(&mission(""))
        .run(Folder::new(folder));
    shows(&system, "marked      explore");
    system
}

/// Replaces the mission and keeps the system. Like most editors, it writes a second file and
/// renames it over the first.
fn save(system: &System, mission: &str) {
    let file = system.folder.path().join("probes.xml");
    let text = std::fs::read_to_string(&file).expect("the file");
    let (head, rest) = text.split_once("<mission").expect("a mission");
    let (_, tail) = rest.split_once("</mission>").expect("its end");
    let temporary = system.folder.write("probes.new", &format!("{head}{mission}{tail}"));
    std::fs::rename(temporary, file).expect("renamed");
}

/// Waits until `armor mission show` prints `words`; returns its output.
fn shows(system: &System, words: &str) -> String {
    let what = format!("{words:?} is shown; the log:\n{}", system.run.log());
    wait_for(&what, || {
        let shown = system.shown(&["mission", "show"]);
        shown.contains(words).then_some(shown)
    })
}

fn records(system: &System) -> Vec<JournalRecord> {
    let path = system.run.out().join("executive.journal");
    journal::read(&path).expect("a journal").records
}

#[test]
fn a_proven_edit_is_played_and_survives_a_restart_of_the_executive() {
    let mut system = run("edited");
    save(&system, &mission("<transition name='soon' from='explore' to='return' timeout='1s'/>"));
    shows(&system, "version 2 of the file has been played for");
    shows(&system, "marked      return");
    // The file on the disk is now invalid. The restarted executive must not need it.
    save(&system, "<mission nonsense></mission>");
    system.replace("executive");
    system.run.wait_for_log("continues where it stopped: return", 1);
    let shown = shows(&system, "marked      return");
    assert!(shown.contains("version 2 of the file has been played for"), "{shown}");
    save(&system, &mission("<transition name='now' from='return' to='home' timeout='0s'/>"));
    assert_eq!(system.run.code(), Some(0), "{}", system.run.log());
    let fired = records(&system).into_iter().filter_map(|record| match record.entry {
        JournalEntry::Took { cause: Cause::Transition(name), .. } => Some(name),
        _ => None,
    });
    assert_eq!(fired.collect::<Vec<_>>(), ["soon", "now"]);
    let journal = system.run.out().join("executive.journal");
    let printed =
        system.shown(&["mission", "journal", "--journal", journal.to_str().expect("UTF-8")]);
    let folder = system.run.out();
    let of_folder = system.shown(&["mission", "journal", folder.to_str().expect("UTF-8")]);
    assert!(of_folder.contains("transition soon added"), "{of_folder}");
    assert!(
        printed.contains("version 2 of the file is played; transition soon added"),
        "{printed}"
    );
    let mut replay = system.folder.armor(&["mission", "replay"]);
    let (code, printed, err) = crate::fixture::run_to_end(replay.arg(&journal));
    assert_eq!(code, 0, "{err}");
    assert!(
        printed.contains("= return") && printed.trim_end().ends_with("ended at its goal"),
        "{printed}"
    );
}

#[test]
fn an_unproven_edit_is_refused_and_the_old_net_stays() {
    let system = run("refused");
    save(
        &system,
        &mission(
            "<place name='scout' components='explorer'/>
             <transition name='both' from='explore' on='explorer.done'>
               <arc to='return'/><arc to='scout'/>
             </transition>
             <transition name='scouted' from='scout' to='home' timeout='1h'/>",
        ),
    );
    let shown = shows(&system, "version 2 of the file is refused, 1 continues");
    assert!(shown.contains("after both") && shown.contains("exclude each other"), "{shown}");
    assert!(shown.contains("marked      explore"), "{shown}");
    let without = mission("").replace("'explore'", "'wander'");
    save(&system, &without);
    let why = "version 3 of the file waits, 1 continues: `explore` holds a token, and the new file \
               has no such place";
    shows(&system, why);
    save(&system, &mission(""));
    wait_for("the version that is played again", || {
        let shown = system.shown(&["mission", "show"]);
        (shown.contains("marked      explore") && !shown.contains("continues")).then_some(())
    });
    assert_eq!(system.trace("explorer").count("stopping"), 0, "never disturbed");
    let is_refusal =
        |record: &&JournalRecord| matches!(record.entry, JournalEntry::Refused { version: 2, .. });
    assert_eq!(records(&system).iter().filter(is_refusal).count(), 1);
}
