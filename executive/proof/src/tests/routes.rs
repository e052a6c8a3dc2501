//! Routes that are proven one by one, and those that cannot be.

use armor_petri::TransitionId;
use armor_petri::analysis::rules::FiringRules;
use armor_petri::analysis::{AnalysisBudget, classes::is_possible};

use super::dice::Dice;
use super::*;
use crate::prove::prove_and_count;
use crate::routes::{RouteMachines, RouteProof};

/// A mission with these routes, and the other elements that are given.
fn drawn(robots: usize, routes: &str, more: &str) -> String {
    let ways: String =
        (0..robots).map(|robot| format!("<component name='way{robot}' kind='k'/>")).collect();
    let ends: Vec<_> = (0..robots).map(|robot| format!("r{robot}-over")).collect();
    let places: String = ends.iter().map(|end| format!("<place name='{end}'/>")).collect();
    format!(
        "<armor version='1'><system>{ways}<component name='power' kind='k'/>\
         <component name='arm0' kind='k'/><component name='arm1' kind='k'/></system>\
         <mission goal='over' safe='hold'><map><point name='P0' at='0 0'/>\
         <point name='P1' at='9 0'/><rally name='R1' at='5 5'/></map>{routes}\
         <variable name='battery' source='power.state.percentage' min='0' max='1'/>\
         <place name='over'/><place name='hold'/>{places}{more}\
         <transition name='all' from='{}' to='over'/></mission></armor>",
        ends.join(" ")
    )
}

fn route(robot: usize, attributes: &str, steps: &str, exits: &str) -> String {
    format!(
        "<route name='r{robot}' mover='way{robot}.route' start='P0' out='r{robot}-over' {attributes}>\
         {steps}{exits}</route>"
    )
}

fn legs(name: char, count: usize) -> String {
    let leg = |leg| format!("<leg name='{name}{leg}' to='P{}' by='2min'/>", leg % 2);
    (1..=count).map(leg).collect()
}

const RALLY: &str = "patience='5min' rally-by='3min'";
const EXITS: &str = "<otherwise on='blocked late lost-link recall' do='rally'/>\
                     <otherwise name='weak' when='battery &lt; 30%' do='home'/>";
const FEW_EXITS: &str = "<otherwise on='blocked late' do='rally'/>";

/// Eight routes of so many legs with five exits each; neighbours meet twice.
fn fleet(count: usize) -> String {
    let steps = |robot: usize| {
        let meet = |n| format!("<meet name='m{n}' with='r{}' patience='90s'/>", robot ^ 1);
        format!("{}{}{}{}", legs('a', count), meet(1), legs('b', count), meet(2)) + &legs('c', 1)
    };
    let routes: String = (0..8).map(|it| route(it, RALLY, &steps(it), EXITS)).collect();
    drawn(8, &routes, "")
}

fn found(file: &str) -> Vec<Finding> {
    all_proven(file, few(20_000, 1_000)).into_iter().collect()
}

fn texts(found: &[Finding]) -> Vec<String> {
    found.iter().map(|it| format!("{}: {}", it.code.as_str(), it.message)).collect()
}

#[test]
fn routes_with_patience_are_proven_one_by_one() {
    let found = texts(&found(&fleet(6)));
    let [only] = found.as_slice() else { panic!("{found:#?}") };
    assert!(only.starts_with("N0285: 8 routes proven one by one"), "{only}");
    for part in ["goal or safe place stays in reach", "never stands still", "second token"] {
        assert!(only.contains(part), "{only}");
    }
}

#[test]
fn checks_over_few_routes_are_decided_without_the_states_of_all() {
    let checked = |check: &str| {
        let check = format!("<check>{check}</check><place name='over'/>");
        texts(&found(&fleet(6).replacen("<place name='over'/>", &check, 1)))
    };
    for holds in
        ["always reachable(over or hold)", "never r0.a1 and r0.b2", "never r0.b1 and r1.a1"]
    {
        let found = checked(holds);
        assert!(found.iter().all(|it| it.starts_with("N0285")), "{holds}: {found:#?}");
    }
    // Neighbours wait for each other, others do not.
    let found = checked("never r0.b1 and r2.a1");
    assert!(
        found.iter().any(|it| it.starts_with("E0252") || it.starts_with("W0253")),
        "{found:#?}"
    );
}

/// The first robot waits without patience for the second, which may have parked; without it the mission
/// could still end.
fn waiting(count: usize) -> String {
    let meet = |with: &str| format!("<meet name='m' with='{with}'/>");
    let first = legs('a', count) + &meet("r1") + &legs('b', count);
    let second = legs('a', count) + &meet("r0") + &legs('b', count);
    let mut routes = route(0, RALLY, &first, FEW_EXITS);
    routes += &route(1, &format!("{RALLY} safe='parked'"), &second, EXITS);
    routes += &(2..6).map(|it| route(it, RALLY, &legs('a', count), EXITS)).collect::<String>();
    let without = "<place name='parked'/><transition name='without' \
                   from='r0-over parked r2-over r3-over r4-over r5-over' to='over'/>";
    drawn(6, &routes, without)
}

#[test]
fn a_robot_that_waits_for_one_that_parked_is_found_with_firings_that_lead_there() {
    let file = waiting(6);
    let found = found(&file);
    let lost = found.iter().find(|it| it.code == Code::Standstill);
    let lost = lost.unwrap_or_else(|| panic!("{:#?}", texts(&found)));
    let firings = &lost.trace.as_ref().expect("a trace").firings;
    // Four drive all their legs, one drives to the meeting, and one parks when its mover fails.
    assert_eq!(firings.len(), 4 * 6 + 6 + 1, "{firings:?}");
    let (plan, _) = plan_of(&file);
    let net = &Analysed::of(&plan).expect("a net").net;
    let is_called = |name: &str, id: &TransitionId| net.transition(*id).name == name;
    let id = |name: &String| net.transition_ids().find(|id| is_called(name, id));
    let path: Vec<_> = firings.iter().filter_map(id).collect();
    let marking = FiringRules::new(net).play(net.initial(), &path).expect("it plays");
    for waiting in ["r0.m", "parked", "r3-over"] {
        let place = plan.place_named(waiting).expect("a place");
        assert_eq!(marking[place.index()], 1, "{waiting}");
    }
    assert!(found.iter().all(|it| !it.message.contains("stays in reach")), "{:#?}", texts(&found));
    // With patience the first robot ends the mission.
    let patient = file.replace("with='r1'/>", "with='r1' patience='90s'/>");
    let found = texts(&all_proven(&patient, few(20_000, 1_000)).into_iter().collect::<Vec<_>>());
    assert!(found.len() == 1 && found[0].starts_with("N0285"), "{found:#?}");
}

#[test]
fn a_place_of_its_own_from_which_nothing_leads_is_found() {
    let parked = format!("{RALLY} safe='parked'");
    let routes: String = (0..6)
        .map(|it| route(it, if it == 2 { &parked } else { RALLY }, &legs('a', 8), EXITS))
        .collect();
    let found = found(&drawn(6, &routes, "<place name='parked'/>"));
    let lost = found.iter().find(|it| it.code == Code::Standstill);
    let lost = lost.unwrap_or_else(|| panic!("{:#?}", texts(&found)));
    assert!(lost.message.contains("parked"), "{}", lost.message);
}

#[test]
fn exclusive_components_of_two_routes_are_compared() {
    let works = |arm: &str, name: &str, count: usize| {
        let legs = legs('w', count);
        legs.replace(&format!("name='{name}'"), &format!("name='{name}' components='{arm}'"))
    };
    let all = |first: &str, second: &str| {
        let others: String = (2..6).map(|it| route(it, RALLY, &legs('a', 8), EXITS)).collect();
        let routes = route(0, RALLY, first, EXITS) + &route(1, RALLY, second, EXITS) + &others;
        found(&drawn(6, &routes, "<exclusive components='arm0 arm1'/>"))
    };
    let together = all(&works("arm0", "w3", 8), &works("arm1", "w6", 8));
    let met = together.iter().find(|it| it.code == Code::MarkedTogether);
    let met = met.unwrap_or_else(|| panic!("{:#?}", texts(&together)));
    assert_eq!(met.trace.as_ref().map(|it| it.firings.len()), Some(2 + 5), "{met:?}");
    assert!(together.iter().all(|it| it.code != Code::ProvenByRoutes));
    // The first works before the meeting, the second after it; a route that misses it does not continue.
    let meet = |with: &str| format!("<meet name='m' with='{with}' patience='90s'/>");
    let before = works("arm0", "w3", 4) + &meet("r1") + &legs('b', 4);
    let after = legs('a', 4) + &meet("r0") + &works("arm1", "w2", 4);
    let apart = all(&before, &after);
    let [only] = apart.as_slice() else { panic!("{:#?}", texts(&apart)) };
    assert!(only.message.contains("exclusive components are never wanted together"), "{only:?}");
}

#[test]
fn meetings_without_patience_are_proven_over_all_states() {
    let steps = |robot: usize| {
        let meet = |n| format!("<meet name='m{n}' with='r{}'/>", robot ^ 1);
        legs('a', 5) + &meet(1) + &legs('b', 5) + &meet(2) + &legs('c', 1)
    };
    let mut routes: String = (0..2).map(|it| route(it, RALLY, &steps(it), FEW_EXITS)).collect();
    routes += &(2..6).map(|it| route(it, RALLY, &legs('a', 8), EXITS)).collect::<String>();
    // Next to the routes, something looks at where one has ended.
    let watch = "<place name='w' initial='true'/><place name='v'/><transition name='t' from='w' \
                 to='v' timeout='1min'><inhibitor place='r0-over'/></transition>";
    for more in ["", watch] {
        let found = texts(&found(&drawn(6, &routes, more)));
        let [only] = found.as_slice() else { panic!("{found:#?}") };
        assert!(only.starts_with("W0246"), "{only}");
        assert!(only.contains("its routes are not proven one by one"), "{only}");
    }
}

#[test]
fn a_route_that_two_tokens_enter_is_proven_over_all_states() {
    let enters = |tokens: u32| {
        let entering = format!("{RALLY} in='go'");
        let attributes = |it| if it == 0 { entering.as_str() } else { RALLY };
        let routes: String =
            (0..6).map(|it| route(it, attributes(it), &legs('a', 8), EXITS)).collect();
        texts(&found(&drawn(6, &routes, &format!("<place name='go' initial='{tokens}'/>"))))
    };
    let two = enters(2);
    let open = two.iter().find(|it| it.starts_with("W0246")).unwrap_or_else(|| panic!("{two:#?}"));
    let reason = "its routes are not proven one by one: r0 may get a second token";
    assert!(open.contains(reason), "{open}");
}

fn plan_of(file: &str) -> (Plan, armor_robotfile::Mission) {
    let reading = read("robot.xml".as_ref(), &mut |_| Ok(file.as_bytes().to_vec()));
    let reading = check(reading, &[], None);
    assert!(reading.is_valid(), "{}", reading.findings.render(Colours::No));
    let configuration = reading.configuration.expect("it is valid");
    let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
    let mission = configuration.flattened().expect("it is small").expect("a mission");
    (plan, mission)
}

/// A small fleet with whatever can go wrong.
fn random_fleet(dice: &mut Dice) -> String {
    let robots = 2 + dice.roll(2);
    let is_bold = dice.one_in(3);
    let mut meetings = Vec::new();
    for number in 0..dice.roll(3) {
        let one = dice.roll(robots);
        let other = (one + 1 + dice.roll(robots - 1)) % robots;
        meetings.push((number, one, other, !dice.one_in(3)));
    }
    let mut routes = String::new();
    for robot in 0..robots {
        let mut steps: Vec<String> = (1..=1 + dice.roll(2))
            .map(|leg| {
                let by = ["", "by='1min'", "by='2min'"][dice.roll(3)];
                let arm = if robot < 2 && dice.one_in(3) {
                    format!("components='arm{robot}'")
                } else {
                    String::new()
                };
                format!("<leg name='l{leg}' to='P{}' {by} {arm}/>", leg % 2)
            })
            .collect();
        for (number, one, other, is_patient) in &meetings {
            let with = match robot {
                it if it == *one => *other,
                it if it == *other => *one,
                _ => continue,
            };
            let patience = if *is_patient { "patience='90s'" } else { "" };
            let at = if is_bold { dice.roll(steps.len() + 1) } else { steps.len() };
            steps.insert(at, format!("<meet name='m{number}' with='r{with}' {patience}/>"));
        }
        let exits = [
            "",
            FEW_EXITS,
            "<otherwise on='recall' do='rally'/>",
            "<otherwise on='blocked late' do='skip'/>",
        ][dice.roll(4)];
        let mut attributes = ["", "patience='1min'", RALLY][dice.roll(3)].to_owned();
        if dice.one_in(3) {
            attributes += " safe='parked'";
        }
        routes += &route(robot, &attributes, &steps.concat(), exits);
    }
    let exclusive = if dice.one_in(2) { "<exclusive components='arm0 arm1'/>" } else { "" };
    let more = ["", "<transition name='freed' from='parked' to='hold' timeout='1h'/>"];
    let more = more[usize::from(dice.one_in(5))];
    drawn(robots, &routes, &format!("<place name='parked'/>{exclusive}{more}{CLAIM}"))
}

const CLAIM: &str = "<check>always reachable(over or hold)</check>";

/// Three routes have few states together, and too many with their times.
#[test]
fn that_the_end_stays_in_reach_of_few_routes_is_shown_one_by_one() {
    let routes: String = (0..3).map(|it| route(it, RALLY, &legs('a', 3), EXITS)).collect();
    let file = drawn(3, &routes, CLAIM);
    let effort = ProofEffort { has_begun: true, ..few(500_000, 1_000) };
    let shown: Vec<_> = all_proven(&file, effort).into_iter().collect();
    assert!(shown.is_empty(), "{:#?}", texts(&shown));
    let (_, explored) = count_proven(&file, effort);
    let together = ProofEffort { explores_routes: true, ..effort };
    let (shown, all) = count_proven(&file, together);
    assert!(shown[0].starts_with("W0253"), "{shown:#?}");
    assert!(explored < all, "{explored} states, {all} with the routes together");
    // What the claim does not allow is still found.
    let parked = route(2, &format!("{RALLY} safe='parked'"), &legs('a', 3), EXITS);
    let routes = routes[..routes.rfind("<route").expect("three")].to_owned() + &parked;
    let lost = drawn(3, &routes, &format!("<place name='parked'/>{CLAIM}"));
    let lost = texts(&all_proven(&lost, effort).into_iter().collect::<Vec<_>>());
    let has = |code: &str| lost.iter().any(|it| it.starts_with(code));
    assert!(has(Code::Standstill.as_str()) && (has("E0252") || has("W0253")), "{lost:#?}");
}

fn count_proven(file: &str, effort: ProofEffort) -> (Vec<String>, u64) {
    let reading = read("robot.xml".as_ref(), &mut |_| Ok(file.as_bytes().to_vec()));
    let configuration = check(reading, &[], None).configuration.expect("it is valid");
    let (plan, _) = plan_of(file);
    let (found, explored) = prove_and_count(&configuration, &plan, effort, &|| false);
    (texts(&found.into_iter().collect::<Vec<_>>()), explored)
}

/// What is shown one by one is so over all states, and what is found there is found in them.
#[test]
fn one_by_one_never_differs_from_the_product() {
    let (mut proven, mut lost, mut met, mut open, mut claimed) = (0, 0, 0, 0, 0);
    for seed in 0..400 {
        let file = random_fleet(&mut Dice::new(seed));
        let reading = read("robot.xml".as_ref(), &mut |_| Ok(file.as_bytes().to_vec()));
        if !check(reading, &[], None).is_valid() {
            continue;
        }
        let (plan, mission) = plan_of(&file);
        let analysed = Analysed::of(&plan).expect("a net");
        let budget = AnalysisBudget {
            states: 100_000,
            memory_bytes: 1 << 28,
            stop: &|| false,
            explored: None,
        };
        let machines = RouteMachines::find(&plan, &mission, &analysed, &|| false);
        let machines = machines.unwrap_or_else(|why| panic!("{why:?}\n{file}"));
        let product: Vec<_> = proven_all(&file).into_iter().map(|it| it.code).collect();
        let has = |codes: &[Code]| product.iter().any(|code| codes.contains(code));
        // Small fleets are explored as a whole, but for the claim, which may have too many states with times.
        let in_short = all_proven(&file, ProofEffort::default()).into_iter().map(|it| it.code);
        let in_short: Vec<_> = in_short.collect();
        let is_decided = !in_short.contains(&Code::CheckUndecided);
        let decided = product.iter().filter(|it| !is_decided || **it != Code::CheckUndecided);
        assert_eq!(in_short.iter().collect::<Vec<_>>(), decided.collect::<Vec<_>>(), "{file}");
        if machines.keep_end_in_reach(&budget) && !has(&[Code::MarkedTogether]) {
            assert!(!has(&[Code::CheckFails]) && is_decided, "{product:?}\n{file}");
            claimed += 1;
        }
        match RouteProof::of(&plan, machines, &budget) {
            Err(_) => open += 1,
            Ok(shown) => {
                let seen = shown.lost.iter().chain(shown.met.iter().map(|met| &met.seen));
                for seen in seen {
                    assert_eq!(is_possible(&analysed.net, &seen.path), Ok(true), "{file}");
                }
                let is_met = !shown.met.is_empty();
                assert_eq!(is_met, has(&[Code::MarkedTogether]), "{product:?}\n{file}");
                met += usize::from(is_met);
                let ends_lost = [Code::Standstill, Code::GoalLost, Code::GoalNeverReached];
                if shown.lost.is_some() {
                    lost += 1;
                    assert!(has(&ends_lost) || is_met, "{product:?}\n{file}");
                } else if !is_met {
                    proven += 1;
                    assert!(!has(&ends_lost), "{product:?}\n{file}");
                }
            }
        }
    }
    assert!(
        proven > 40 && lost > 20 && met > 10 && claimed > 40,
        "{proven} proven, {lost} lost, {met} met, {open} open, {claimed} claimed"
    );
}

fn proven_all(file: &str) -> Findings {
    all_proven(file, ProofEffort { explores_routes: true, ..ProofEffort::default() })
}
