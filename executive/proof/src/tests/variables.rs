//! Proofs of missions whose transitions set variables.

use super::dice::Dice;
use super::*;
use crate::proof::MAX_BYTES;
use armor_petri::PlaceId;
use armor_petri::analysis::invariants::PlaceBounds;
use armor_petri::analysis::runs::MarkingGraph;
use armor_petri::analysis::{AnalysisBudget, ExplorationEnd, explore_states};
use std::collections::BTreeSet;

const ROUNDS: &str = "<variable name='round' min='0' max='3'/>
    <place name='x' initial='true' components='a'/>";

#[test]
fn guards_over_variables_are_decided() {
    let check = |transitions: &str, checks: &str, expected: &[&str]| {
        let net = format!("{ROUNDS}{transitions}{checks}");
        assert_eq!(codes(&net), expected, "{transitions} {checks}");
    };
    let again = "<transition name='again' from='x' to='x' on='a.done' when='round &lt; 3'>
        <set variable='round' value='round + 1'/></transition>";
    let enough = "<transition name='enough' from='x' to='over' on='a.done' when='round == 3'/>";
    let whole = format!("{again}{enough}");
    check(&whole, "<check>always round &lt;= 3</check>", &[]);
    check(&whole, "<check>never over and round &lt; 3</check>", &[]);
    check(&whole, "<check>always reachable(over and round == 3)</check>", &[]);
    check(&whole, "<check>round == 2 leads to round == 3</check>", &[]);
    check(&whole, "<check>always round &lt;= 2</check>", &["E0252"]);
    check(&whole, "<check>reachable(over and round != 3)</check>", &["E0252"]);
    // Without the guard the fourth firing sets the variable to a value outside its domain.
    let careless = again.replace(" when='round &lt; 3'", "");
    check(&format!("{careless}{enough}"), "", &["E0254"]);
    // No value satisfies this guard: the transition never fires, and the goal is never reached.
    let never = enough.replace("round == 3", "round * 2 == 3");
    check(&format!("{again}{never}"), "", &["W0217", "E0241"]);
    // Without `enough` no transition is enabled after three rounds.
    check(again, "", &["E0241"]);
    let data = "<transition name='seen' from='x' to='over' when='a.o.x &lt; 1 and round == 5'/>";
    check(&format!("{again}{data}"), "", &["W0217", "E0241"]);
}

#[test]
fn a_value_outside_is_reported_with_the_firings_that_lead_there() {
    let net = format!(
        "{ROUNDS}<transition name='again' from='x' to='x' on='a.done'>
         <set variable='round' value='2 * round + 1'/></transition>
         <transition name='t' from='x' to='over' timeout='9s'/>"
    );
    let findings = proven(&mission(&net));
    let [finding] = &findings.iter().collect::<Vec<_>>()[..] else { panic!("{findings:?}") };
    let message = "after again, again again would set round to 7, and it is 0 to 3";
    assert_eq!((finding.code, finding.message.as_str()), (Code::ValueOutside, message));
    assert_eq!(finding.at.as_ref().map(|at| at.text()), Some("2 * round + 1"));
    let path = finding.trace.as_ref().expect("a trace");
    assert_eq!(path.firings, ["again", "again", "again/outside"]);
}

#[test]
fn a_count_of_rounds_bounds_the_time() {
    let net = |limit: &str| {
        format!(
            "{ROUNDS}<transition name='again' from='x' to='x' timeout='10s' when='round &lt; 3'>
             <set variable='round' value='round + 1'/></transition>
             <transition name='enough' from='x' to='over' timeout='1s' when='round >= 3'/>
             <check>duration(over) &lt;= {limit}</check><check>duration(over) >= 31s</check>"
        )
    };
    assert_eq!(codes(&net("31s")), [] as [&str; 0]);
    assert_eq!(codes(&net("30s")), ["E0252"]);
}

#[test]
fn where_a_clock_continues_while_variables_change_times_are_open() {
    // The net has two copies of `slow`, for n = 0 and n = 2, each with a clock of its own. So the
    // proof does not decide what depends on the time since `slow` was enabled.
    let net = "<variable name='n' min='0' max='2'/><place name='x' initial='true'/>
        <place name='y' initial='true'/>
        <transition name='slow' from='x' to='over' timeout='3s' when='n != 1'/>
        <transition name='up' from='y' to='y' timeout='1s' when='n &lt; 2'>
        <set variable='n' value='n + 1'/></transition>
        <check>never over and n == 0</check><check>always n &lt;= 2</check>";
    assert_eq!(codes(net), ["W0253"], "only what times decide");
}

#[test]
fn too_many_values_are_left_open_and_named() {
    let net = "<variable name='n' min='0' max='500'/><variable name='m' min='0' max='500'/>
        <place name='x' initial='true'/>
        <transition name='t' from='x' to='x' timeout='1s'><set variable='n' value='n + m'/></transition>
        <transition name='u' from='x' to='over' timeout='1s' when='n * m == 1000'/>
        <check>never n > 3</check><check>never hold</check><check>reachable(over)</check>";
    let findings = proven(&mission(net));
    let found: Vec<_> = findings.iter().map(|it| (it.code.as_str(), it.message.as_str())).collect();
    let open =
        "n and m are not followed in the proof: t depends on 251001 combinations of their values";
    assert!(found.contains(&("W0249", open)), "{found:?}");
    let undecided = found.iter().filter(|it| it.0 == "W0253").count();
    assert_eq!((undecided, found.len()), (2, 3), "{found:?}");
}

/// A state by the definition: tokens, and values of variables.
type State = (Vec<u32>, Vec<i64>);

/// All states, enumerated by the definition of firing; guards over data may be true or false.
fn defined(plan: &Plan, limit: usize) -> Option<BTreeSet<State>> {
    let counters: Vec<_> = plan.counters().iter().map(|it| it.counts.initial).collect();
    let first = (plan.net().initial().to_vec(), counters);
    let mut known = BTreeSet::from([first.clone()]);
    let mut waiting = vec![first];
    while let Some((marking, counters)) = waiting.pop() {
        if known.len() > limit || marking.iter().any(|tokens| *tokens > 5) {
            return None;
        }
        let is_over = |place: &PlaceId| marking[place.index()] > 0;
        if [plan.goal(), plan.safe()].iter().flatten().any(is_over) {
            continue;
        }
        for id in plan.net().transition_ids() {
            let (t, planned) = (plan.net().transition(id), plan.transition(id));
            let needs = t.inputs.iter().chain(&t.reads);
            let has = needs.into_iter().all(|(place, n)| marking[place.index()] >= *n)
                && t.inhibitors.iter().all(|(place, n)| marking[place.index()] < *n);
            if !has || !may_hold(plan, planned, &counters) {
                continue;
            }
            let (mut after, mut values) = (marking.clone(), counters.clone());
            t.inputs.iter().for_each(|(place, n)| after[place.index()] -= n);
            match plan.sets_of(id, &counters) {
                Ok(sets) => {
                    t.resets.iter().for_each(|place| after[place.index()] = 0);
                    t.outputs.iter().for_each(|(place, n)| after[place.index()] += n);
                    sets.into_iter().for_each(|(index, value)| values[index] = value);
                }
                Err(_) => {
                    t.resets.iter().for_each(|place| after[place.index()] = 0);
                    plan.safe().iter().for_each(|safe| after[safe.index()] += 1);
                }
            }
            if known.insert((after.clone(), values.clone())) {
                waiting.push((after, values));
            }
        }
    }
    Some(known)
}

/// Whether some data make the guard true.
fn may_hold(plan: &Plan, planned: &armor_plan::PlannedTransition, counters: &[i64]) -> bool {
    let Some(guard) = &planned.guard else { return true };
    // The data of these missions are compared with 1 alone.
    [None, Some(0.0), Some(1.0), Some(2.0)].into_iter().any(|data: Option<f64>| {
        let names = guard.guard.names().iter();
        let value = names.map(|name| {
            let counter = plan.counters().iter().position(|it| it.name == name.as_str());
            let number = counter.map_or(data, |index| Some(counters[index] as f64));
            number.map(armor_robotfile::guard::Scalar::Number)
        });
        guard.guard.holds(&value.collect::<Vec<_>>()) == Some(true)
    })
}

const GUARDS: [&str; 8] = [
    "n &lt; 2",
    "n != 1",
    "n == m",
    "m > -1 and n &lt;= 2",
    "n + m >= 1 or m == -2",
    "a.o.x &lt; 1 and n > 0",
    "not (a.o.x > 1) or m &lt; 0",
    "6 / n > 2",
];
const VALUES: [[&str; 5]; 2] =
    [["n + 1", "0", "3 - n", "m * m", "n - 1"], ["-m", "n - 2", "m + 1", "2", "m - n"]];

fn draw(dice: &mut Dice) -> String {
    let mut net = "<variable name='n' min='0' max='3' initial='1'/><variable name='m' min='-2' max='2' initial='0'/>"
        .to_owned();
    for place in 0..3 {
        let initial = if place == 0 { 1 } else { usize::from(dice.one_in(3)) };
        net += &format!("<place name='p{place}' initial='{initial}'/>");
    }
    for number in 0..2 + dice.roll(4) {
        let guard = match dice.one_in(4) {
            true => String::new(),
            false => format!("when='{}'", GUARDS[dice.roll(GUARDS.len())]),
        };
        let to = if dice.one_in(6) { "over".to_owned() } else { format!("p{}", dice.roll(3)) };
        net += &format!("<transition name='t{number}' from='p{}' to='{to}' {guard}>", dice.roll(3));
        for (variable, values) in ["n", "m"].into_iter().zip(VALUES) {
            if dice.one_in(2) {
                let value = values[dice.roll(values.len())];
                net += &format!("<set variable='{variable}' value='{value}'/>");
            }
        }
        net += "</transition>";
    }
    net
}

#[test]
fn random_missions_with_variables_have_the_states_of_the_definition() {
    let (mut compared, mut states, mut copies) = (0, 0, 0);
    for seed in 0..600 {
        let net = draw(&mut Dice::new(seed));
        let reading = read("m.xml".as_ref(), &mut |_| Ok(mission(&net).into_bytes()));
        let configuration = reading.configuration.expect("it can be read");
        let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
        let Some(expected) = defined(&plan, 3000) else { continue };
        let analysed = Analysed::of(&plan).expect("a net");
        let bounds = PlaceBounds::of_net(&analysed.net, &|| false);
        let budget =
            AnalysisBudget { states: 5000, memory_bytes: MAX_BYTES, ..AnalysisBudget::UNLIMITED };
        let found = explore_states(&analysed.net, &bounds, true, &budget);
        assert_eq!(found.ending, ExplorationEnd::Complete, "seed {seed}\n{net}");
        let state = |node: u32| {
            let marking = found.space.tokens(node).into_owned();
            let values = analysed.values(&marking).map(|it| it.1).collect();
            (analysed.tokens(&marking).to_vec(), values)
        };
        let found: BTreeSet<State> = (0..found.space.nodes()).map(state).collect();
        assert_eq!(found, expected, "seed {seed}\n{net}");
        compared += 1;
        states += found.len();
        copies += analysed.net.transitions().len() - plan.net().transitions().len();
    }
    println!("{compared} missions, {states} states, {copies} copies of transitions");
    assert!(compared > 300 && states > 2000 && copies > 1000);
}
