//! A mission after all of its processes have ended. It can be resumed, never starts again by
//! itself, and its journal is never lost.

use armor_executive::journal;
use rustix::process::Signal;

use crate::fixture::{Folder, Run, is_alive, run_to_end, wait_for};
use crate::resilience::system::{Draft, System};

/// `one` is done after five ticks; then `two` works for a minute of mission time.
const RELAY: &str = "
<mission name='relay' goal='over' safe='hold'>
  <place name='first' initial='true' components='one'/>
  <place name='second' components='two'/>
  <place name='over'/>
  <place name='hold'/>
  <exclusive components='one two'/>
  <transition name='handover' from='first' to='second' on='one.done'/>
  <transition name='late' from='second' to='over' timeout='1min'/>
</mission>";

fn relay(folder: &str) -> System {
    let system = Draft::default()
        .probe("one", "rate='50Hz'", "done=5 alone=alone")
        .probe("two", "rate='50Hz'", "alone=alone")
        .mission(RELAY)
        .run(Folder::new(folder));
    is_in_second(&system.folder, &system.run);
    system
}

fn shown(folder: &Folder, run: &Run) -> String {
    let registry = run.registry().to_string();
    run_to_end(&mut folder.armor(&["mission", "show", "--registry", &registry])).1
}

/// Waits until the second place is marked and `two` is active.
fn is_in_second(folder: &Folder, run: &Run) {
    wait_for(&format!("the second place\n{}", run.log()), || {
        let shown = shown(folder, run);
        (shown.contains("marked      second\n") && shown.contains("two active")).then_some(())
    });
}

/// Simulates a power failure: kills all processes, so that none can react.
fn power_fails(run: &mut Run) {
    let children = run.children();
    run.signal(Signal::KILL);
    run.code();
    wait_for("the end of everything", || (!children.iter().any(|it| is_alive(*it))).then_some(()));
}

#[test]
fn a_mission_resumes_after_all_processes_have_died() {
    let mut system = relay("resumed");
    power_fails(&mut system.run);
    let folder = &system.folder;
    let crashed = system.run.log();
    let mut again = folder.run("out", &["probes.xml", "--resume"]);
    is_in_second(folder, &again);
    assert!(again.log().starts_with(&crashed), "the log continues\n{}", again.log());
    assert!(again.log().contains("continues mission relay, "), "{}", again.log());
    assert!(again.log().contains("continues where it stopped: second"), "{}", again.log());
    assert_eq!(system.trace("one").count("started"), 1, "its work was done before");

    // A new run in the same folder keeps the unfinished mission, which can be resumed there.
    power_fails(&mut again);
    let mut fresh_run = folder.run("out", &["probes.xml"]);
    wait_for("the first place", || (system.trace("one").count("started") > 1).then_some(()));
    fresh_run.wait_for_log("an unfinished mission was here and is kept", 1);
    assert!(fresh_run.log().contains("out/unfinished-1 --resume"), "{}", fresh_run.log());
    power_fails(&mut fresh_run);
    let kept = std::fs::read_to_string(again.out().join("unfinished-1/logs/all.log"));
    assert!(kept.expect("kept with its mission").starts_with(&crashed));
    let third = folder.run("out/unfinished-1", &["probes.xml", "--resume"]);
    is_in_second(folder, &third);
    assert_eq!(system.trace("one").count("started"), 2, "this one has gone on");
}

#[test]
fn a_mission_that_cannot_be_resumed_is_refused_and_kept() {
    let mut system = relay("not-resumed");
    power_fails(&mut system.run);
    let refused = |arguments: &[&str], why: &str| {
        let (code, _, err) = run_to_end(&mut system.folder.armor(arguments));
        assert!(code == 1 && err.contains(why), "{code} {err}");
    };
    refused(&["run", "probes.xml", "--resume", "--out", "other"], "nothing to resume: no ");
    let text = std::fs::read_to_string(system.folder.path().join("probes.xml")).expect("the file");
    system.folder.write("renamed.xml", &text.replace("two", "three"));
    let resumed = ["run", "renamed.xml", "--resume", "--out", "out"];
    refused(&resumed, "whose component two is not in renamed.xml");
    let journal = system.run.out().join("executive.journal");
    assert!(journal::read(&journal).expect("it is there").is_unfinished());

    // An unreadable journal is kept, too.
    std::fs::write(&journal, "nonsense\n").expect("writable");
    let (code, found, _) =
        run_to_end(&mut system.folder.armor(&["mission", "journal", "verify", "out"]));
    assert!(code == 1 && found.contains("line 1 is not a record"), "{found}");
    system.folder.write("unsafe.xml", &text.replace(" safe='hold'", ""));
    let resumed = ["run", "unsafe.xml", "--resume", "--out", "out"];
    refused(&resumed, "mission relay has no safe place to go to");
    let run = system.folder.run("out", &["probes.xml", "--for", "1s"]);
    run.wait_for_log("an unfinished mission was here and is kept", 1);
    let kept = system.run.out().join("unfinished-1/executive.journal");
    assert_eq!(std::fs::read_to_string(kept).expect("kept"), "nonsense\n");
}

#[test]
fn a_mission_whose_journal_is_deleted_goes_to_its_safe_place() {
    let mut system = relay("journal-deleted");
    std::fs::remove_file(system.run.out().join("executive.journal")).expect("it was there");
    system.kill("executive");
    assert_eq!(system.run.code(), Some(1), "{}", system.run.log());
    let log = system.run.log();
    assert!(log.contains("executive.journal is damaged: it is gone, and "), "{log}");
    assert!(log.contains("it is not known where the mission stood"), "{log}");
    assert!(log.contains("the mission ended in its safe place"), "{log}");
    assert_eq!(system.trace("one").count("started"), 1, "it did not begin again");
    assert_eq!(system.trace("two").count("clash"), 0);
}

#[test]
fn a_mission_whose_journal_is_damaged_resumes_in_its_safe_place() {
    let mut system = relay("journal-damaged");
    power_fails(&mut system.run);
    let journal = system.run.out().join("executive.journal");
    let verify =
        |path: &str| run_to_end(&mut system.folder.armor(&["mission", "journal", "verify", path]));
    let (code, sound, _) = verify("out");
    assert!(code == 0 && sound.contains("fault      none"), "{sound}");

    // The record before the last one is lost.
    let text = std::fs::read_to_string(&journal).expect("a journal");
    let lines: Vec<_> = text.split_inclusive('\n').collect();
    let last = lines.len();
    let rest = [&lines[..last - 2], &lines[last - 1..]].concat().concat();
    std::fs::write(&journal, rest).expect("writable");
    let lost = last - 1;
    let fault = format!("line {lost} is record {last}, and record {lost} is missing");
    let fault = fault.as_str();
    let (code, found, _) = verify("out/executive.journal");
    assert!(code == 1 && found.contains(fault), "{found}");
    let printed = ["mission", "journal", "--journal", "out/executive.journal"];
    let (code, printed, err) = run_to_end(&mut system.folder.armor(&printed));
    assert!(code == 1 && printed.contains("mission relay begins") && err.contains(fault), "{err}");

    let mut again = system.folder.run("out", &["probes.xml", "--resume"]);
    assert_eq!(again.code(), Some(1), "{}", again.log());
    let log = again.log();
    assert!(log.contains(fault) && log.contains("mission relay goes to its safe place"), "{log}");
    assert!(log.contains("the mission ended in its safe place"), "{log}");
    assert!(log.contains("executive.journal.damaged-1"), "{log}");
    assert_eq!(system.trace("one").count("started"), 1, "it did not begin again");
    assert_eq!(system.trace("two").count("clash"), 0);
    assert_eq!(verify("out").0, 0, "the journal of the retreat is sound");
    assert_eq!(verify("out/executive.journal.damaged-1").0, 1);
}
