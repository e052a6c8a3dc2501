//! Each kind of statement: where it is valid, where it fails (with its counterexample), and where
//! the budget leaves it undecided.

use super::*;

/// A patrol: explored or late, then walked or stuck. A lamp blinks independently of it.
const PATROL: &str = "<place name='explore' initial='true' components='a'/><place name='rounds'/>
    <place name='on'/><place name='off' initial='true'/>
    <transition name='explored' from='explore' to='rounds' on='a.done'/>
    <transition name='late' from='explore' to='rounds' timeout='90s'/>
    <transition name='walked' from='rounds' to='over' interval='[10s,60s]'/>
    <transition name='stuck' from='rounds' to='hold' on='b.failed'/>
    <transition name='light' from='off' to='on' after='1s'/>
    <transition name='dark' from='on' to='off' after='1s'/>";

fn found(net: &str, check: &str, effort: ProofEffort) -> Option<Finding> {
    let check = check.replace('<', "&lt;");
    let file = mission(&format!("{net}<check>{check}</check>"));
    let findings = all_proven(&file, effort).into_iter();
    let mut own = findings.filter(|f| matches!(f.code, Code::CheckFails | Code::CheckUndecided));
    let first = own.next();
    assert!(own.next().is_none(), "one finding for one check");
    first
}

fn holds(net: &str, check: &str) {
    let found = found(net, check, ProofEffort::default());
    assert!(found.is_none(), "{check}: {found:?}");
}

/// Checks that `check` fails: `message` is part of its finding's message, `path` its trace (the
/// names of the transitions, separated by spaces).
fn fails(net: &str, check: &str, message: &str, path: &str) {
    let found =
        found(net, check, ProofEffort::default()).unwrap_or_else(|| panic!("{check} holds"));
    assert_eq!(found.code, Code::CheckFails, "{check}: {found:?}");
    assert!(found.message.contains(message), "{check}: {}", found.message);
    let at = found.at.as_ref().expect("it has a place");
    assert_eq!(at.text().replace("&lt;", "<"), check);
    let shown = found.trace.unwrap_or_default();
    assert_eq!(shown.firings.join(" "), path, "{check}: {}", found.message);
    assert!(!found.remedy.is_empty(), "{check}");
}

#[test]
fn invariants_hold_or_are_refuted_with_a_trace() {
    holds(PATROL, "never explore and rounds");
    holds(PATROL, "always explore + rounds + over + hold == 1");
    holds(PATROL, "always (on or off) and not (on and off)");
    holds(PATROL, "never active(a) and not explore");
    fails(PATROL, "never rounds and on", "there are tokens in", "explored light");
    fails(PATROL, "always off", "there are tokens in", "light");
    fails(PATROL, "always not hold", "hold", "explored stuck");
    fails(PATROL, "never true", "at the start", "");
}

#[test]
fn times_exclude_what_tokens_alone_allow() {
    let race = "<place name='x' initial='true'/><place name='y'/>
        <transition name='soon' from='x' to='over' timeout='2s'/>
        <transition name='too-late' from='x' to='y' timeout='3s'/>
        <transition name='on' from='y' to='over' timeout='1s'/>";
    holds(race, "never y");
    holds(race, "dead(too-late)");
    fails(race, "reachable(y)", "no sequence of firings leads there", "");
    fails(race, "fires(too-late)", "no sequence of firings contains it", "");
    holds(race, "fires(soon)");
    fails(race, "dead(soon)", "it fires: soon", "soon");
}

#[test]
fn reachability_is_of_some_run_and_from_everywhere() {
    holds(PATROL, "reachable(over and on)");
    fails(PATROL, "reachable(over and hold)", "no sequence of firings", "");
    holds(PATROL, "always reachable(over or hold)");
    fails(PATROL, "always reachable(over)", "hold", "explored stuck");
    let found = found(PATROL, "always reachable(over)", ProofEffort::default()).expect("it fails");
    assert!(found.remedy.contains("… or hold"), "{}", found.remedy);
}

#[test]
fn every_run_comes_to_it_unless_a_circle_or_a_dead_end_avoids_it() {
    holds(
        "<place name='x' initial='true'/><place name='y'/>
        <transition name='t' from='x' to='y' on='a.done'/>
        <transition name='u' from='y' to='over' timeout='9s'/>",
        "eventually over",
    );
    let turns = "<place name='x' initial='true'/><place name='y'/><place name='z'/>
        <transition name='go' from='x' to='y' timeout='1s'/>
        <transition name='back' from='y' to='x' timeout='1s'/>
        <transition name='out' from='y' to='z' on='a.done'/>
        <transition name='end' from='z' to='over' timeout='1s'/>";
    fails(turns, "x leads to over", "can continue forever without it: go, back", "");
    holds(turns, "z leads to over");
    holds(turns, "x leads to y");
    fails(turns, "y leads to z", "can continue forever without it", "go");
    let found = found(turns, "y leads to z", ProofEffort::default()).expect("it fails");
    assert_eq!(found.trace.expect("a trace").circle.join(" "), "back go");
    let trap = "<place name='x' initial='true'/><place name='y'/>
        <transition name='t' from='x' to='y' timeout='1s'/>
        <transition name='u' from='x' to='over' on='a.done'/>";
    fails(trap, "eventually over", "after t there is a token in y, and nothing fires", "t");
}

#[test]
fn durations_are_of_the_shortest_and_the_longest_run() {
    let timed = "<place name='x' initial='true'/><place name='y'/>
        <transition name='done' from='x' to='y' on='a.done'/>
        <transition name='late' from='x' to='y' timeout='90s'/>
        <transition name='walk' from='y' to='over' interval='[10s,60s]'/>";
    holds(timed, "duration(over) <= 150s");
    holds(timed, "duration(over) < 151s");
    fails(timed, "duration(over) < 150s", "walk can take 2 min 30 s", "done walk");
    holds(timed, "duration(over) >= 10s");
    fails(timed, "duration(over) > 10s", "10 s are enough for done, walk", "done walk");
    holds(timed, "duration(x) <= 0s");
    fails(timed, "duration(hold) >= 1s", "it never happens", "");
    fails(timed, "duration(hold) <= 1h", "nothing fires any more", "done walk");
    // The lamp blinks without end, but each blink takes time, so the patrol still ends.
    holds(PATROL, "duration(over or hold) <= 150s");
}

#[test]
fn a_report_without_a_timeout_has_no_longest_and_is_named() {
    let open = "<place name='x' initial='true'/><place name='y'/>
        <transition name='t' from='x' to='y' timeout='5s'/>
        <transition name='docked' from='y' to='over' on='a.done'/>";
    let message = "there is no longest: after t docked may be waited for without end";
    fails(open, "duration(over) <= 20min", message, "t docked");
}

#[test]
fn a_period_adds_to_each_latest_moment() {
    let file = "<armor version='1'><system/><mission goal='over' safe='over' period='1s'>
        <place name='x' initial='true'/><place name='over'/>
        <transition name='t' from='x' to='over' timeout='5s'/>
        <check>duration(over) &lt;= 5s</check></mission></armor>";
    let findings = all_proven(file, ProofEffort::default());
    let found = findings.iter().find(|f| f.code == Code::CheckFails).expect("a period later");
    assert!(found.message.contains("t can take 6 s"), "{}", found.message);
}

#[test]
fn bounds_hold_by_sums_or_states_or_are_refuted() {
    let boxes = "<place name='x' initial='true'/><place name='boxes'/>
        <transition name='pack' from='x' to='x boxes' timeout='1s'/>
        <transition name='full' from='x' timeout='9s'><arc from='boxes' weight='3'/><arc to='over'/></transition>";
    fails(boxes, "bounded(boxes)", "again and again", "");
    holds(boxes, "bounded(x) <= 1");
    fails(boxes, "bounded(boxes) <= 2", "boxes (3)", "pack pack pack");
    holds(PATROL, "bounded(rounds) <= 1");
    holds(PATROL, "bounded(on)");
    fails(PATROL, "bounded(on) <= 0", "on", "light");
}

/// Forty independent lamps: 2^40 states.
fn lamps() -> String {
    let lamp = |n| {
        format!(
            "<place name='on{n}'/><place name='off{n}' initial='true'/>
             <transition name='up{n}' from='off{n}' to='on{n}' timeout='1s'/>
             <transition name='down{n}' from='on{n}' to='off{n}' timeout='1s'/>"
        )
    };
    (0..40).map(lamp).collect::<String>()
        + "<transition name='end' from='on0' to='over' timeout='9s'/>"
}

#[test]
fn what_the_budget_leaves_open_is_reported_and_never_passed() {
    let effort = few(1000, 100);
    let verdict = |check: &str| found(&lamps(), check, effort).map(|finding| finding.code.as_str());
    for open in [
        "always reachable(over)",
        "on1 leads to off1",
        "eventually over",
        "duration(over) <= 9s",
        "duration(over) >= 9s",
        "dead(end)",
        "never on1 and on2 and on3 and on4 and on5 and over",
    ] {
        assert_eq!(verdict(open), Some("W0253"), "{open}");
    }
    // Sums of tokens exclude markings without the state space, and a state that was explored is
    // proof enough that it can be reached.
    for sure in [
        "never on1 and off1",
        "always on1 + off1 == 1",
        "always on1 or off1",
        "always on1 + off1 + on2 + off2 <= 2",
        "bounded(on1) <= 1",
        "bounded(on1)",
        "reachable(on1)",
        "fires(up3)",
    ] {
        assert_eq!(verdict(sure), None, "{sure}");
    }
    assert_eq!(verdict("never on1"), Some("E0252"));
    assert_eq!(verdict("always on1 + off1 == 2"), Some("E0252"));
}

#[test]
fn a_check_may_speak_of_places_of_sub_missions_and_theirs_are_proven_of_themselves() {
    let main = "<armor version='1'><system><component name='a' kind='k'/></system>
        <mission goal='z' safe='z'><place name='x' initial='true'/><place name='z'/>
        <submission ref='dock.xml' in='x' out='z'/>
        <check>never dock.p and x</check><check>fires(dock.enter)</check>
        <check>never dock.g</check></mission></armor>";
    let dock = "<armor version='1'><mission goal='g' safe='g'>
        <place name='p' initial='true'/><place name='g'/>
        <transition name='t' from='p' to='g' timeout='1s'/>
        <check>always reachable(g)</check><check>never g</check></mission></armor>";
    let reading = read("m.xml".as_ref(), &mut |path| {
        let text = if path.ends_with("dock.xml") { dock } else { main };
        Ok(text.as_bytes().to_vec())
    });
    let configuration = check(reading, &[], None).configuration.expect("a configuration");
    let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
    let findings = prove(&configuration, &plan, &|| false);
    let failed = findings.iter().filter(|finding| finding.code == Code::CheckFails);
    let place_and_trace = |finding: &Finding| {
        let path = finding.trace.clone().unwrap_or_default().firings.join(" ");
        format!("{} {path}", finding.at.as_ref().expect("a place"))
    };
    let found: Vec<_> = failed.map(place_and_trace).collect();
    assert_eq!(found, ["m.xml:5:16 dock.enter dock.t", "dock.xml:4:50 t"]);
}

#[test]
fn of_a_mission_that_has_begun_what_is_claimed_of_its_start_is_left_out() {
    let checks = ["never explore", "reachable(explore and on)", "duration(rounds) >= 1s"];
    let checks = checks.map(|text| format!("<check>{}</check>", text.replace('<', "&lt;")));
    let file = mission(&format!("{PATROL}{}", checks.concat()));
    let effort = ProofEffort { has_begun: true, ..ProofEffort::default() };
    let findings = all_proven(&file, effort);
    let found: Vec<_> = findings.iter().map(|f| f.at.as_ref().expect("a place").text()).collect();
    assert_eq!(found, ["never explore"]);
}

#[test]
fn the_mission_s_durations_are_reported_where_they_can_be_found() {
    let takes_finding = |net: &str| {
        let findings = all_proven(&mission(net), ProofEffort::default());
        findings.into_iter().find(|finding| finding.code == Code::Takes).expect("a finding")
    };
    let both = "<place name='x' initial='true'/><transition name='t' from='x' to='over'";
    let sure = takes_finding(&format!("{both} interval='[10s,20min]'/>"));
    assert_eq!(sure.message, "over comes after 10 s to 20 min");
    let takes = sure.takes.expect("as data");
    assert_eq!((takes.shortest_s, takes.longest_s), (10.0, Some(1200.0)));
    assert!(takes.always_goal && takes.longest_trace == ["t"]);
    let fail = "<transition name='u' from='x' to='hold' timeout='30s'/>";
    let either = takes_finding(&format!("{both} interval='[10s,20min]'/>{fail}"));
    assert_eq!(
        either.message,
        "over comes after 10 s at the earliest, and the mission is over after 30 s at the latest"
    );
    let open = takes_finding(&format!("{both} on='a.done'/>"));
    assert_eq!(
        open.message,
        "over comes after 0 s at the earliest; there is no latest end: at the start t may be \
         waited for without end"
    );
    assert_eq!(open.takes.expect("as data").longest_s, None);
    // A clock next to it is not why the mission has no end.
    let clock = "<place name='beat' initial='true'/>
        <transition name='tick' from='beat' to='beat' timeout='60s'/>";
    let parallel = takes_finding(&format!("{both} on='a.done'/>{clock}"));
    assert_eq!(
        parallel.message,
        "over comes after 0 s at the earliest; there is no latest end: again and again tick, while \
         t may be waited for without end"
    );
    let circle = "<place name='y'/><transition name='out' from='x' to='y' timeout='1s'/>
        <transition name='back' from='y' to='x' timeout='1s'/>";
    let round = takes_finding(&format!("{both} on='a.done'/>{circle}"));
    assert!(round.message.ends_with("again and again out, back"), "{}", round.message);
}
