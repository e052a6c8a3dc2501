//! Missions with more states than the budget allows, and warnings that times make void.

use super::*;

/// Twenty independent lamps: a million states, of which a thousand are explored.
fn lamps(more: &str) -> Finding {
    let lamps: String = (0..20)
        .map(|n| {
            format!(
                "<place name='on{n}'/><place name='off{n}' initial='true'/>
                 <transition name='up{n}' from='off{n}' to='on{n}' timeout='1s'/>
                 <transition name='down{n}' from='on{n}' to='off{n}' timeout='1s'/>"
            )
        })
        .collect();
    let end = "<transition name='end' from='on0' to='over' timeout='9s'/>";
    let effort = few(1000, 10);
    let findings = all_proven(&mission(&(lamps + end + more)), effort);
    findings.into_iter().find(|f| f.code == Code::NotProven).expect("it is too large")
}

#[test]
fn what_is_too_large_is_searched_for_deadlocks_and_weighed_by_sums() {
    let found = lamps("");
    assert!(found.message.contains("proven all the same: it never stands still"), "{found:?}");
    assert!(found.message.contains("open: that the goal stays in reach"), "{found:?}");
    let exclusive =
        "<place name='x' initial='true' components='a'/><place name='y' components='b'/>
        <transition name='t' from='x' to='y' timeout='1s'/>
        <transition name='u' from='y' to='x' timeout='1s'/><exclusive components='a b'/>";
    let found = lamps(exclusive);
    for part in ["exclusive components are never wanted together", "gets a second token"] {
        assert!(found.message.contains(part), "{found:?}");
    }
    let opened = "<place name='x' initial='true' components='a'/><place name='y' components='b'/>
        <place name='n'/><transition name='t' from='x n' to='y' timeout='1s'/>
        <transition name='n1' from='on19' to='n on19' timeout='1s'><inhibitor place='n'/></transition>
        <transition name='u' from='y' to='x y' timeout='1s'><inhibitor place='on18'/></transition>
        <exclusive components='a b'/>";
    let found = lamps(opened);
    assert!(
        found.message.contains("open: that the goal stays in reach, that it never"),
        "{found:?}"
    );
}

#[test]
fn a_standstill_far_beyond_the_budget_is_found_by_stubborn_sets() {
    let lamps: String = (0..20)
        .map(|n| {
            format!(
                "<place name='on{n}'/><place name='off{n}' initial='true'/>
                 <transition name='up{n}' from='off{n}' to='on{n}' timeout='1s'/>"
            )
        })
        .collect();
    let end = "<place name='x' initial='true'/>
        <transition name='end' from='x on0' to='over' timeout='9s'/>
        <transition name='lose' from='x on1' to='on1' timeout='9s'/>";
    let effort = few(1000, 10);
    // An emergency exit, which could always fire, does not hide it.
    let stop = "<transition name='stop' to='hold' class='safety' operator='true'/>";
    for more in ["", stop] {
        let findings = all_proven(&mission(&format!("{lamps}{end}{more}")), effort);
        let found = findings.iter().find(|f| f.code == Code::Standstill).expect("all on, x lost");
        let path = &found.trace.as_ref().expect("the trace").firings;
        assert!(path.contains(&"lose".to_owned()) && path.len() == 21, "{path:?}");
    }
}

#[test]
fn a_standstill_that_times_exclude_is_not_warned_of() {
    let net = |late: &str| {
        format!(
            "<place name='x' initial='true'/><place name='y'/>
             <transition name='t' from='x' to='over' timeout='2s'/>
             <transition name='u' from='x' to='y' timeout='{late}'/>"
        )
    };
    assert_eq!(codes(&net("2s")), ["W0242"]);
    assert_eq!(codes(&net("3s")), ["W0217"], "`u` comes too late");
}

#[test]
fn what_is_found_is_shown_as_firings() {
    let file = mission(
        "<place name='x' initial='true'/><place name='y'/><place name='n'/>
         <transition name='t' from='x' to='y' timeout='1s'/>
         <transition name='u' from='y' to='y n' timeout='1s'/>
         <transition name='v' from='y' to='over' timeout='1s'/>",
    );
    let findings = proven(&file);
    let found = findings.iter().find(|f| f.code == Code::FillsWithoutEnd).expect("n fills");
    let path = found.trace.clone().expect("a trace");
    assert_eq!((path.firings.join(" "), path.circle.join(" ")), ("t".into(), "u".into()));
    let json = serde_json::to_value(found).expect("JSON");
    assert_eq!((&json["trace"][0], &json["circle"][0]), (&"t".into(), &"u".into()));
}
