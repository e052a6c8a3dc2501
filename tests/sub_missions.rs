//! A sub-mission, with real processes.

use crate::fixture::Folder;
use crate::resilience::system::Draft;

const TRIP: &str = "
<mission name='trip' goal='over' safe='hold'>
  <place name='drive' initial='true' components='driver'/>
  <place name='at-dock'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='there' from='drive' to='at-dock' on='driver.done'/>
  <submission ref='dock.xml' in='at-dock' out='over'/>
</mission>";

fn docked(name: &str, crawler: &str, missed_after: &str) -> (Option<i32>, String) {
    let folder = Folder::new(name);
    let dock = format!(
        "<armor version='1'>
           <mission name='dock' goal='docked' safe='away'>
             <place name='near' initial='true' components='crawler'/>
             <place name='docked'/>
             <place name='away'/>
             <transition name='contact' from='near' to='docked' on='crawler.done'/>
             <transition name='missed' from='near' to='away' timeout='{missed_after}'/>
           </mission>
         </armor>"
    );
    folder.write("dock.xml", &dock);
    let draft = Draft::default()
        .probe("driver", "rate='50Hz'", "done=20")
        .probe("crawler", "rate='50Hz'", crawler)
        .mission(TRIP);
    let mut system = draft.run(folder);
    let code = system.run.code();
    let started = system.trace("crawler").count("started");
    assert_eq!(started, 1, "the sub-mission's component is the mission's to activate");
    (code, system.run.log())
}

#[test]
fn a_sub_mission_is_played_under_its_name_and_left_by_its_goal() {
    let (code, log) = docked("docks", "done=20", "10min");
    assert_eq!(code, Some(0), "{log}");
    for line in ["dock.enter: at-dock -> dock.near", "dock.leave: dock.docked -> over"] {
        assert!(log.contains(line), "{line} in\n{log}");
    }
}

#[test]
fn a_sub_mission_that_fails_sends_the_whole_mission_to_safety() {
    let (code, log) = docked("does-not-dock", "", "1s");
    assert_eq!(code, Some(1), "{log}");
    assert!(log.contains("dock.fail: dock.away -> hold"), "{log}");
}
