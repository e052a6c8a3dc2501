//! Drawn missions: the net that is derived, names that stay, findings at the leg, routes written out.

use std::path::Path;

use armor_robotfile::{Code, Document, Item, Mission, Position, Reading, check, read};

const SYSTEM: &str = "<system><component name='way' kind='patrol'/><component name='path' \
                      kind='patrol'/><component name='driver' kind='driver'/></system>";
const MARKS: &str = "<point name='P0' at='0 0'/><point name='P1' at='12 0'/>
    <point name='P2' at='12 9'/><rally name='R1' at='-1 0'/><rally name='R2' at='14 9'/>";
const LEGS: &str = "<leg name='l1' to='P1' by='2min' speed='0.5m/s'/>
    <stay name='s1' for='30s'/><leg name='l2' to='P2'/>
    <otherwise on='blocked late recall' do='rally'/><otherwise on='lost-link' do='home'/>";

fn file(marks: &str, legs: &str) -> String {
    format!(
        "<armor version='1'>{SYSTEM}<mission goal='over' safe='hold'><map>{MARKS}{marks}</map>
         <route name='red' mover='way.route' pace='driver.speed' start='P0' out='over'
           patience='5min'>{legs}</route>
         <place name='over'/><place name='hold'/></mission></armor>"
    )
}

fn read_text(text: &str) -> Reading {
    let reading = read(Path::new("a.xml"), &mut |_| Ok(text.as_bytes().to_vec()));
    check(reading, &[], None)
}

fn mission(text: &str) -> Mission {
    let reading = read_text(text);
    assert!(reading.is_valid(), "{:?}", reading.findings);
    reading.configuration.unwrap().mission.unwrap()
}

fn codes(text: &str) -> Vec<Code> {
    read_text(text).findings.iter().map(|finding| finding.code).collect()
}

fn places(mission: &Mission) -> Vec<&str> {
    mission.places.iter().map(|place| place.name.value.as_str()).collect()
}

/// `from -> to` of a transition.
fn arcs(mission: &Mission, name: &str) -> String {
    let found = mission.transitions.iter().find(|it| it.name.value == name);
    let found = found.unwrap_or_else(|| panic!("no {name}"));
    let list = |arcs: Vec<&armor_robotfile::mission::Arc>| {
        arcs.iter().map(|arc| arc.place.value.clone()).collect::<Vec<_>>().join(" ")
    };
    format!("{} -> {}", list(found.inputs().collect()), list(found.outputs().collect()))
}

#[test]
fn a_route_becomes_a_state_machine_with_an_exit_from_each_step() {
    let mission = mission(&file("", LEGS));
    let expected = [
        "over",
        "hold",
        "red.l1",
        "red.l1.to-R1",
        "red.l1.at-R1",
        "red.l1.to-P0",
        "red.l1.at-P0",
        "red.s1",
        "red.s1.to-R2",
        "red.s1.at-R2",
        "red.s1.to-P0",
        "red.s1.at-P0",
        "red.l2",
        "red.l2.to-R2",
        "red.l2.at-R2",
        "red.l2.to-P0",
        "red.l2.at-P0",
    ];
    assert_eq!(places(&mission), expected);
    for (name, expected) in [
        ("red.l1.done", "red.l1 -> red.s1"),
        ("red.l1.blocked", "red.l1 -> red.l1.to-R1"),
        ("red.l1.late", "red.l1 -> red.l1.to-R1"),
        ("red.l1.lost-link", "red.l1 -> red.l1.to-P0"),
        ("red.l1.to-R1.done", "red.l1.to-R1 -> red.l1.at-R1"),
        ("red.l1.to-R1.blocked", "red.l1.to-R1 -> hold"),
        ("red.l1.at-R1.resume", "red.l1.at-R1 -> red.l1"),
        ("red.l1.at-R1.over", "red.l1.at-R1 -> hold"),
        ("red.s1.done", "red.s1 -> red.l2"),
        ("red.l2.done", "red.l2 -> over"),
    ] {
        assert_eq!(arcs(&mission, name), expected, "{name}");
    }
    let leg = mission.place("red.l1").unwrap();
    let active: Vec<_> = leg.components.iter().map(|name| name.value.as_str()).collect();
    assert_eq!(active, ["way", "driver"]);
    let given: Vec<_> = leg
        .parameters
        .iter()
        .map(|it| {
            format!(
                "{}.{}={}",
                it.component.value, it.parameter.name.value, it.parameter.value.value
            )
        })
        .collect();
    assert_eq!(given, ["way.route=12,0", "driver.speed=0.5m/s"]);
    assert_eq!(mission.places.iter().map(|place| place.initial).sum::<u32>(), 1);
    // A leg without a time is never late, and a stay waits for no report that may fail.
    for absent in ["red.l2.late", "red.s1.blocked"] {
        assert!(mission.transitions.iter().all(|it| it.name.value != absent), "{absent}");
    }
}

#[test]
fn a_breach_leads_to_safety_from_every_place_of_a_route() {
    let system = SYSTEM.replace("</system>", "<component name='guard' kind='fence'/></system>");
    let line =
        "<line name='green' kind='phase' shape='6,-5 6,5' not-before='2026-11-21T14:30:00Z'/>";
    let text = file(line, LEGS).replace(SYSTEM, &system);
    let text = text.replace("out='over'", "out='over' fence='guard'");
    let drawn = mission(&text);
    for (place, target) in [
        ("red.l1", "hold"),
        ("red.l1.at-green", "hold"),
        ("red.l1.after-green", "hold"),
        ("red.s1", "hold"),
        ("red.l2", "hold"),
        ("red.l1.to-R1", "hold"),
        ("red.l1.at-R1", "hold"),
    ] {
        let name = format!("{place}.breach");
        assert_eq!(arcs(&drawn, &name), format!("{place} -> {target}"));
        let breach = drawn.transitions.iter().find(|it| it.name.value == name).unwrap();
        let on = breach.on.as_ref().unwrap();
        assert_eq!((&*on.component.value, &*on.event.value), ("guard", "breach"));
        let active = &drawn.place(place).unwrap().components;
        assert!(active.iter().any(|it| it.value == "guard"), "{place}");
    }
    assert!(drawn.place("hold").unwrap().components.is_empty());
    // An exit for it leads elsewhere; on the drive there the next one leads to the safe place.
    let drawn = mission(&text.replace("blocked late recall", "blocked late recall breach"));
    assert_eq!(arcs(&drawn, "red.l1.breach"), "red.l1 -> red.l1.to-R1");
    assert_eq!(arcs(&drawn, "red.l1.to-R1.breach"), "red.l1.to-R1 -> hold");
    // Without a fence nothing reports it.
    let alone = file("", &LEGS.replace("recall", "recall breach"));
    let reading = read_text(&alone);
    let found: Vec<_> = reading.findings.iter().map(|it| (it.code, it.message.as_str())).collect();
    let message = "nothing reports a breach: route red names no fence";
    assert_eq!(found, [(Code::DrawnIncomplete, message)]);
    // A fence is renamed where it is named, and one that is missing is one finding.
    let mut document = Document::open(Path::new("a.xml"), text.as_bytes()).unwrap();
    document.rename(Item::Component("guard"), "watch").unwrap();
    let renamed = String::from_utf8(document.bytes().to_vec()).unwrap();
    assert_eq!(renamed, text.replace("'guard'", "'watch'"));
    assert_eq!(codes(&text.replace("fence='guard'", "fence='gaurd'")).len(), 1);
}

#[test]
fn a_leg_that_is_inserted_renames_nothing() {
    let before = mission(&file("", LEGS));
    let inserted = LEGS.replace("<leg name='l2'", "<leg name='extra' to='P1'/><leg name='l2'");
    let after = mission(&file("", &inserted));
    let of_before: Vec<_> = places(&before);
    let kept: Vec<_> =
        places(&after).into_iter().filter(|name| !name.starts_with("red.extra")).collect();
    assert_eq!(kept, of_before);
    assert_eq!(arcs(&after, "red.s1.done"), "red.s1 -> red.extra");
}

#[test]
fn robots_wait_at_a_phase_line_for_its_date() {
    let line = "<line name='green' kind='phase' margin='1m' shape='6,-5 6,5' \
                not-before='2026-11-21T14:30Z'/>";
    let mission = mission(&file(line, LEGS));
    assert_eq!(arcs(&mission, "red.l1.reached"), "red.l1 -> red.l1.at-green");
    let crosses = "red.l1.at-green.crosses";
    assert_eq!(arcs(&mission, crosses), "red.l1.at-green -> red.l1.after-green");
    assert_eq!(arcs(&mission, "red.l1.after-green.done"), "red.l1.after-green -> red.s1");
    let found = mission.transitions.iter().find(|it| it.name.value == crosses).unwrap();
    assert!(found.not_before.is_some());
    let waypoint =
        |place: &str| mission.place(place).unwrap().parameters[0].parameter.value.value.clone();
    assert_eq!((waypoint("red.l1"), waypoint("red.l1.after-green")), ("5,0".into(), "12,0".into()));
}

#[test]
fn a_meeting_is_one_transition_of_both_routes() {
    let text = file("", "<leg name='l1' to='P1'/><meet name='m' with='blue' patience='9s'/>")
        .replace(
            "<place name='over'/>",
            "<route name='blue' mover='path.route' start='P0'><meet name='n' with='red'/>
             <leg name='l1' to='P2'/></route><place name='over'/>",
        );
    let mission = mission(&text);
    assert_eq!(arcs(&mission, "red.m.met"), "red.m blue.n -> over blue.l1");
    assert_eq!(arcs(&mission, "red.m.late"), "red.m -> hold");
    assert_eq!(arcs(&mission, "blue.l1.done"), "blue.l1 -> blue.end");
    let met = mission.transitions.iter().filter(|it| it.name.value.ends_with(".met"));
    assert_eq!(met.count(), 1);
}

/// A planner that drives around the zones of a chart, for a mover `way`.
const AROUND: &str = "<component name='chart' kind='chart'/><component name='planner' \
    kind='planner'/><link from='way.goal' to='planner.goal'/>\
    <link from='chart.zones' to='planner.zones'/></system>";

/// A U that is open to the right around the first leg, with a rally point behind its back, one above
/// its upper arm, and one far ahead.
const U_SHAPED: &str = "<point name='P0' at='2 5'/><point name='P1' at='8 5'/>
    <zone name='u' kind='no-go' shape='0,0 10,0 10,1 1,1 1,9 10,9 10,10 0,10'/>
    <rally name='behind' at='-1 5'/><rally name='above' at='8 12'/><rally name='ahead' at='40 5'/>";

fn u_shaped(legs: &str, system: &str) -> String {
    let text = file("", legs).replace(MARKS, U_SHAPED);
    text.replace("</system>", system)
}

const ONE_LEG: &str = "<leg name='l1' to='P1' by='2min'/><otherwise on='blocked late' do='rally'/>";

#[test]
fn the_rally_point_is_the_nearest_one_by_path() {
    let text = u_shaped(ONE_LEG, AROUND);
    // On the straight line that behind the back is nearest; to that ahead all paths are straight.
    let drawn = mission(&text);
    assert_eq!(arcs(&drawn, "red.l1.blocked"), "red.l1 -> red.l1.to-above");
    // The same drawing gives the same net; a leg that is inserted changes only its own places.
    let inserted = ONE_LEG.replace("<otherwise", "<leg name='l2' to='P0'/><otherwise");
    let longer = mission(&u_shaped(&inserted, AROUND));
    for name in ["red.l1.blocked", "red.l1.late"] {
        assert_eq!(arcs(&longer, name), arcs(&drawn, name));
    }
    assert_eq!(format!("{:?}", mission(&text).places), format!("{:?}", drawn.places));
    // Without the one above, the way around to that behind is still shorter than that ahead.
    let without = text.replace("<rally name='above' at='8 12'/>", "");
    assert_eq!(arcs(&mission(&without), "red.l1.blocked"), "red.l1 -> red.l1.to-behind");
    let nearer = without.replace("'40 5'", "'18 5'");
    assert_eq!(arcs(&mission(&nearer), "red.l1.blocked"), "red.l1 -> red.l1.to-ahead");
}

#[test]
fn a_path_around_a_zone_needs_a_robot_that_knows_it() {
    let found = |text: &str| -> Vec<(Code, String)> {
        let findings = read_text(text).findings;
        findings.iter().map(|it| (it.code, it.remedy.clone())).collect()
    };
    assert_eq!(found(&u_shaped(ONE_LEG, AROUND)), []);
    let instead = "drives around it; or write to=\"ahead\"";
    for system in [
        "</system>",
        // The planner knows no zones, or others.
        &AROUND.replace("<link from='chart.zones' to='planner.zones'/>", ""),
        &AROUND.replace(
            "<component name='chart' kind='chart'/>",
            "<component name='chart' \
            kind='chart'><parameter name='zones' value='z no-go circle 0,0 1m'/></component>",
        ),
        // It is not the planner of this mover.
        &AROUND.replace("'way.goal'", "'path.goal'"),
    ] {
        let found = found(&u_shaped(ONE_LEG, system));
        assert!(
            matches!(&found[..], [(Code::ExitIntrudes, advice)] if advice.ends_with(instead)),
            "{found:?}"
        );
    }
    let named = ONE_LEG.replace("do='rally'", "do='rally' to='ahead'");
    assert_eq!(found(&u_shaped(&named, "</system>")), []);
    // A ring: no path leads out of it, and what is nearest on the straight line is the finding.
    let ring = "<zone name='lid' kind='no-go' shape='9.5,0.5 11,0.5 11,9.5 9.5,9.5'/>";
    let text = u_shaped(ONE_LEG, AROUND)
        .replace("<rally name='behind'", &format!("{ring}<rally name='behind'"));
    let found = found(&text);
    assert!(
        matches!(&found[..], [(Code::ExitIntrudes, advice)] if advice.starts_with("draw a rally")),
        "{found:?}"
    );
}

#[test]
fn findings_are_at_the_leg() {
    let school = "<zone name='school' kind='no-go' margin='1m' shape='11,4 13,4 12,5'/>";
    let reading = read_text(&file(school, LEGS));
    let finding = reading.findings.iter().find(|it| it.code == Code::LegIntrudes).unwrap();
    assert_eq!(finding.at.as_ref().unwrap().text(), "l2");
    assert!(finding.message.contains("comes nearer to it than 1 m"), "{}", finding.message);
    // A zone between the leg and the rally point stops only the exit.
    let between = "<zone name='shed' kind='no-go' shape='circle 13.5,5 0.5m'/>
                   <zone name='den' kind='no-go' shape='circle 4,3 0.5m'/>";
    let found = codes(&file(between, LEGS));
    assert!(found.contains(&Code::ExitIntrudes), "{found:?}");
    assert!(!found.contains(&Code::LegIntrudes), "{found:?}");
}

#[test]
fn a_route_written_out_is_the_same_net_under_plain_names() {
    let text = file("", LEGS).replace(
        "<place name='hold'/>",
        "<place name='hold'/><check>never red.l1 and red.l2</check><check>fires(red.l1.late)</check>",
    );
    let drawn = mission(&text);
    let mut document = Document::open(Path::new("a.xml"), text.as_bytes()).unwrap();
    assert_eq!(document.expand_routes(&drawn).unwrap(), 1);
    let written = String::from_utf8(document.bytes().to_vec()).unwrap();
    assert!(!written.contains("<route"), "{written}");
    let expanded = mission(&written);
    let plain = |names: Vec<&str>| -> Vec<String> {
        let mut names: Vec<_> = names.iter().map(|name| name.replace('.', "-")).collect();
        names.sort_unstable();
        names
    };
    assert_eq!(plain(places(&expanded)), plain(places(&drawn)));
    assert_eq!(arcs(&expanded, "red-l1-at-R1-resume"), "red-l1-at-R1 -> red-l1");
    assert_eq!(expanded.transitions.len(), drawn.transitions.len());
    let checks: Vec<_> = expanded.checks.iter().map(|check| check.value.as_str()).collect();
    assert_eq!(checks, ["never red-l1 and red-l2", "fires(red-l1-late)"]);
}

#[test]
fn what_is_derived_from_a_route_is_shown_anywhere_and_changed_at_its_line_only() {
    let check = "<place name='hold'/><check>fires(red.l1.late)</check>";
    let text = file("", LEGS).replace("<place name='hold'/>", check);
    let mut document = Document::open(Path::new("a.xml"), text.as_bytes()).unwrap();
    let (place, late) = (Item::Place("red.l1"), Item::Transition("red.l1.late"));
    let refusals = [
        document.remove(place),
        document.remove(late),
        document.rename(late, "red.l1.slow"),
        document.rename(place, "first"),
        document.set_attribute(place, "initial", Some("true")),
        document.set_attribute(Item::Place("red.end"), "initial", Some("true")),
    ];
    for (refusal, from) in refusals.into_iter().zip([
        "leg l1 of route red",
        "leg l1 of route red",
        "leg l1 of route red",
        "leg l1 of route red",
        "leg l1 of route red",
        "red.end is derived from route red",
    ]) {
        let refusal = refusal.unwrap_err().to_string();
        assert!(refusal.contains(from) && refusal.contains("a.xml:"), "{refusal}");
    }
    let unknown = document.remove(Item::Place("blue")).unwrap_err().to_string();
    assert!(unknown.contains("there is no place blue"), "{unknown}");
    assert_eq!(document.bytes(), text.as_bytes());

    let at = |x: f64| Some(Position { x, y: 20.0 });
    document.set_positions(&[(place, at(10.0)), (late, at(30.0))]).unwrap();
    let shown = String::from_utf8(document.bytes().to_vec()).unwrap();
    assert_eq!(document.position(late), at(30.0), "{shown}");
    assert!(codes(&shown).is_empty(), "{shown}");
    document.expand_routes(&mission(&shown)).unwrap();
    let written = String::from_utf8(document.bytes().to_vec()).unwrap();
    assert_eq!(document.position(Item::Transition("red-l1-late")), at(30.0), "{written}");
    assert!(!written.contains("red.l1"), "{written}");
}

#[test]
fn marks_are_renamed_where_routes_name_them_and_moved_in_their_line() {
    let text = file("", LEGS);
    let mut document = Document::open(Path::new("a.xml"), text.as_bytes()).unwrap();
    document.rename(Item::MapPoint("P1"), "gate").unwrap();
    document.set_attribute(Item::MapPoint("gate"), "at", Some("12 1")).unwrap();
    document.add(Item::Zone("shed"), &[("kind", "no-go"), ("shape", "30,30 31,30 31,31")]).unwrap();
    let changed = String::from_utf8(document.bytes().to_vec()).unwrap();
    assert!(changed.contains("<leg name='l1' to='gate'"), "{changed}");
    assert!(changed.contains("<point name='gate' at='12 1'/>"), "{changed}");
    let map = mission(&changed).map.unwrap();
    assert_eq!(map.zones.len(), 1);
    assert!(document.remove(Item::MapPoint("gate")).is_err(), "a leg leads there");
    document.remove(Item::Zone("shed")).unwrap();
}
