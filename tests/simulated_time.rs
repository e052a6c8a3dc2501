//! Mission time that follows data, with real processes. It stops, then runs faster than real time;
//! its source and the executive are killed meanwhile. The office mission runs at five times real
//! time.

use std::path::Path;
use std::time::{Duration, Instant};

use armor_executive::journal::Journal;
use armor_executive::{Cause, ComponentReport, JournalEntry, JournalRecord};

use crate::fixture::{Folder, run_to_end, wait_for};
use crate::resilience::system::Draft;

/// A world in which time stands still until the test sets its speed.
fn simulator() -> String {
    let world = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/worlds/empty.svg");
    format!(
        "<clock source='simulator.clock'/>
         <component name='simulator' kind='simulator' rate='100Hz'>
           <parameter name='world' value='{}'/>
           <parameter name='speed' value='0'/>
         </component>\n",
        world.display()
    )
}

/// The explorer is done after 40 ticks at 20 Hz; then the mission waits for 10 s.
const MISSION: &str = "<mission name='wait' goal='home' safe='hold'>
    <place name='explore' initial='true' components='explorer'/>
    <place name='stay'/>
    <place name='home'/>
    <place name='hold'/>
    <transition name='explored' from='explore' to='stay' on='explorer.done'/>
    <transition name='late' from='explore' to='hold' timeout='10min'/>
    <transition name='stayed' from='stay' to='home' timeout='10s'/>
  </mission>";

/// Returns the mission time of the first record that satisfies `what`.
fn at(records: &[JournalRecord], what: impl Fn(&JournalEntry) -> bool) -> Duration {
    records.iter().find(|record| what(&record.entry)).expect("it was decided").at
}

fn took(entry: &JournalEntry, name: &str) -> bool {
    matches!(entry, JournalEntry::Took { cause: Cause::Transition(it), .. } if it == name)
}

#[test]
fn a_mission_follows_simulated_time_whichever_process_is_killed() {
    let draft =
        Draft::default().component(&simulator()).probe("explorer", "rate='20Hz'", "done=40");
    let mut system = draft.mission(MISSION).run(Folder::new("simulated-time"));
    let explores = |system: &crate::resilience::system::System| {
        wait_for("the marking", || {
            let shown = system.shown(&["mission", "show"]);
            let stands = shown.contains("its time follows simulator.clock");
            (stands && shown.contains("explore")).then_some(())
        });
    };
    system.traced("explorer", "the start", |trace| (trace.count("started") == 1).then_some(()));
    explores(&system);
    system.replace("executive");
    explores(&system);
    system.replace("simulator");
    explores(&system);
    let set = wait_for("configd", || {
        let printed = system.shown(&["param", "set", "simulator.speed", "50"]);
        printed.contains("50").then_some(printed)
    });
    let code = system.run.code();
    let log = system.run.log();
    assert_eq!(code, Some(0), "{set}\n{log}");

    let journal = system.run.out().join("executive.journal");
    let records = Journal::open(&journal).expect("a journal").1.records;
    let done = at(&records, |entry| {
        matches!(entry, JournalEntry::Heard { report: ComponentReport::Done, .. })
    });
    // The first tick, and a tick at which the time jumped to that of the new simulator, take no
    // mission time.
    assert!(done >= Duration::from_millis(37 * 50), "40 ticks of 20 Hz within {done:?}");
    let stayed = at(&records, |entry| took(entry, "stayed"));
    let explored = at(&records, |entry| took(entry, "explored"));
    assert!(stayed - explored >= Duration::from_secs(10), "{explored:?} to {stayed:?}");
    assert_eq!(system.trace("explorer").count("started"), 1, "{log}");
}

#[test]
fn the_office_is_explored_at_five_times_real_time() {
    let folder = Folder::new("office-fast");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/office-fast.xml");
    let file = file.display().to_string();
    let start = Instant::now();
    let (code, log, _) =
        run_to_end(&mut folder.armor(&["run", &file, "--headless", "--out", "fast"]));
    let host = start.elapsed();
    assert_eq!(code, 0, "{log}");
    let journal = folder.path().join("fast/executive.journal");
    let records = Journal::open(&journal).expect("a journal").1.records;
    let mission = records.last().expect("an end").at;
    println!("office: {mission:.1?} of mission time in {host:.1?} of the host's");
    assert!(mission > Duration::from_secs(15), "no robot is that fast: {mission:?}");
    let order: Vec<_> = ["explored", "arrived"]
        .iter()
        .map(|name| at(&records, |entry| took(entry, name)))
        .collect();
    assert!(order.is_sorted(), "{order:?}");
}
