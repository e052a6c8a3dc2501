//! A robot whose battery runs low returns home: a guard on data, with real processes. The executive
//! is killed before the guard becomes true and while it is true.

use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use armor_executive::journal::Journal;
use armor_executive::{Cause, JournalEntry, JournalRecord};

use crate::fixture::{Folder, run_to_end, wait_for};
use crate::resilience::system::Draft;

/// Time for which the guard must be true before the transition fires.
const LOW_FOR: Duration = Duration::from_secs(6);

/// A simulator whose battery starts at 42 % and loses 2 % per second.
fn simulator() -> String {
    let world = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/worlds/empty.svg");
    format!(
        "<component name='simulator' kind='simulator' rate='20Hz'>
           <parameter name='world' value='{}'/>
           <parameter name='battery_level' value='0.42'/>
           <parameter name='battery_endurance' value='50s'/>
         </component>\n",
        world.display()
    )
}

fn mission(weak: &str) -> String {
    format!(
        "<mission name='survey' goal='home' safe='hold'>
           <variable name='battery' source='simulator.battery.percentage' min='0' max='1'/>
           <place name='explore' initial='true' components='explorer'/>
           <place name='home'/>
           <place name='hold'/>
           <transition name='weak' from='explore' to='home' {weak}/>
           <transition name='late' from='explore' to='hold' timeout='1h'/>
         </mission>"
    )
}

fn draft(weak: &str) -> Draft {
    Draft::default()
        .component(&simulator())
        .probe("explorer", "rate='20Hz'", "")
        .mission(&mission(weak))
}

/// Returns the changes of guards, and the mission time at which `weak` took its token.
fn story(records: &[JournalRecord]) -> (Vec<(Duration, bool)>, Option<Duration>) {
    let change = |record: &JournalRecord| match &record.entry {
        JournalEntry::Guard { holds, .. } => Some((record.at, *holds)),
        _ => None,
    };
    let weak = |record: &&JournalRecord| matches!(&record.entry, JournalEntry::Took { cause: Cause::Transition(name), .. } if name == "weak");
    (records.iter().filter_map(change).collect(), records.iter().find(weak).map(|it| it.at))
}

#[test]
fn a_low_battery_sends_the_robot_home_despite_kills_of_the_executive() {
    let weak = format!(
        "when=\"battery &lt; 30% and simulator.battery.power_supply_status == 'Discharging'\" \
         timeout='{}s'",
        LOW_FOR.as_secs()
    );
    let mut system = draft(&weak).run(Folder::new("low-battery"));
    let show = |one_of: &[&str]| {
        let shown = wait_for(one_of[0], || {
            let shown = system.shown(&["mission", "show"]);
            one_of.iter().any(|words| shown.contains(words)).then_some(shown)
        });
        assert!(shown.contains("battery is 0."), "{shown}");
    };
    show(&["is false"]);
    system.replace("executive");
    // On a slow machine the battery may already be low here.
    show(&["is false", "is true"]);
    system.run.wait_for_log("the guard of weak holds", 1);
    system.replace("executive");
    show(&["is true"]);
    let code = system.run.code();
    let log = system.run.log();
    assert_eq!(code, Some(0), "{log}");
    assert!(log.matches("continues where it stopped").count() >= 2, "{log}");
    let journal = system.run.out().join("executive.journal");
    let (changes, fired) = story(&Journal::open(&journal).expect("a journal").1.records);
    let last = changes.last().expect("it came to hold");
    let fired = fired.expect("it has fired");
    assert!(last.1 && fired >= last.0 + LOW_FOR, "{changes:?}, {fired:?}");
    assert_eq!(system.trace("explorer").count("stopping"), 1, "never disturbed before");
}

#[test]
fn a_provider_that_stays_away_is_reported_as_missing() {
    // 5 s are enough for the first value on a busy machine. The simulator is not the launcher's: one
    // that the launcher gives up ends the mission immediately.
    let mut system = draft("when='not known(battery)' after='5s'")
        .run_with(Folder::new("blind"), &["--without", "simulator"]);
    let registry = system.registry.to_string();
    let arguments = ["component", "simulator", "--name", "simulator", "--registry", &registry];
    let mut simulator = system
        .folder
        .armor(&arguments)
        .stderr(Stdio::null())
        .spawn()
        .expect("the simulator starts");
    wait_for("a value", || {
        system.shown(&["mission", "show"]).contains("battery is 0.").then_some(())
    });
    simulator.kill().expect("it runs");
    simulator.wait().expect("it has ended");
    system.run.wait_for_log("weak: explore -> home", 1);
    assert_eq!(system.run.code(), Some(0), "{}", system.run.log());
}

#[test]
fn an_invalid_guard_is_refused_with_its_position() {
    let folder = Folder::new("no-guard");
    let text = format!(
        "<armor version='1'><system>{}</system>{}</armor>",
        simulator(),
        mission("when='battery &lt; 10s'").replace(" components='explorer'", "")
    );
    folder.write("robot.xml", &text);
    let (code, _, err) = run_to_end(&mut folder.armor(&["check", "robot.xml"]));
    assert_eq!(code, 1);
    assert!(err.contains("error[E0234]: `battery` has no unit, and `10s` is a time"), "{err}");
}
