//! Missions compiled, and what is refused.

use armor_robotfile::guard::Guard;
use armor_robotfile::mission::{LostLink, Missed};

use super::*;
use crate::guards::{Operand, PlannedVariable, WatchId};

fn compiled(mission: &str) -> Result<Plan, Findings> {
    let file = format!(
        r#"<armor version="1"><system><component name="a" kind="k"/><component name="b" kind="k"/>
        <component name="free" kind="k"/></system><mission name="m" {mission}</mission></armor>"#
    );
    let reading = armor_robotfile::read("m.xml".as_ref(), &mut |_| Ok(file.clone().into_bytes()));
    assert!(!reading.findings.has_errors(), "{:?}", reading.findings);
    let configuration = reading.configuration.expect("a configuration");
    Plan::of(&configuration).map(|plan| plan.expect("a mission"))
}

#[test]
fn everything_written_is_in_the_plan() {
    let plan = compiled(
        r#"goal="z" safe="s" period="1s"><place name="x" initial="true" components="a" on-failure="z"/>
        <place name="z"/><place name="s" class="safety" components="b"/>
        <exclusive components="a b"/>
        <transition name="t" from="x" to="z" on="a.done" priority="3"/>
        <transition name="late" from="x" to="s" timeout="5s" on-stop-fail="z" overrun="s"/>"#,
    )
    .expect("it plays all of that");
    let place = |name| plan.place_named(name);
    assert_eq!((plan.goal, plan.safe), (place("z"), place("s")));
    let a = plan.component_named("a").expect("a");
    assert_eq!(plan.components[a.index()].peers, [plan.component_named("b").expect("b")]);
    assert!(!plan.components[2].is_controlled(), "in no place, so always active");
    assert_eq!(plan.places[0].on_failure, place("z"));
    let (t, late) = (&plan.net.transitions()[0], &plan.net.transitions()[1]);
    assert!(t.gated && t.priority == 3 && t.class == armor_petri::FiringClass::Ordinary);
    assert_eq!(plan.transitions[0].on, Some((a, "done".to_owned())));
    assert_eq!(late.class, armor_petri::FiringClass::Safety, "it leads to a place of that class");
    assert_eq!(late.interval, FiringInterval::exactly(std::time::Duration::from_secs(5)));
    assert_eq!(
        (plan.transitions[1].on_stop_fail, plan.transitions[1].overrun),
        (place("z"), place("s"))
    );
}

#[test]
fn a_transition_that_waits_for_a_person_is_never_too_late() {
    let plan = compiled(
        r#"resume="hold"><place name="x" initial="true" components="a" class="safety"/>
        <place name="z"/>
        <transition name="t" from="x" to="z" operator="true" timeout="3s" lost-link="fire"/>
        <transition name="u" from="x" to="z" on="a.done" autonomy="confirm"
                    answer-within="5s" unanswered="fire"/>"#,
    )
    .expect("it plays all of that");
    let second = std::time::Duration::from_secs(1);
    let (t, u) = (&plan.net.transitions()[0], &plan.net.transitions()[1]);
    assert_eq!(t.interval, FiringInterval { earliest: 3 * second, latest: None });
    assert_eq!(u.interval, FiringInterval::UNTIMED);
    assert!(u.gated && !t.gated && plan.listeners.len() == 1);
    let within = Some(5 * second);
    assert_eq!(
        plan.transitions.iter().map(|t| t.autonomy).collect::<Vec<_>>(),
        [Autonomy::Operator, Autonomy::Confirm { within, fire_unanswered: true }]
    );
    assert_eq!(plan.transitions[0].lost_link, Some(LostLink::Fire));
    assert!(plan.places[0].safety && plan.on_resume == OnResume::Hold);
}

#[test]
fn guards_and_variables_are_resolved_to_the_data_they_look_at() {
    let plan = compiled(
        r#"><variable name="v" source="a.o.x" min="0" max="1"/>
        <place name="x" initial="true"/><place name="z"/>
        <transition name="t" from="x" to="z" when="v &lt; 30% and b.o"/>
        <transition name="u" from="x" to="z" on="a.done" when="a.o.x > v"/>"#,
    )
    .expect("it plays all of that");
    let watches: Vec<_> =
        plan.watches.iter().map(|it| format!("{} {}", it.data, it.field.join("."))).collect();
    assert_eq!(watches, ["a.o x", "b.o "], "each once");
    let ids: Vec<_> = plan.net.transition_ids().collect();
    assert_eq!(plan.watchers, [vec![ids[0], ids[1]], vec![ids[0]]]);
    assert!(plan.net.transitions().iter().all(|t| t.gated));
    let guard = plan.transitions[0].guard.as_ref().expect("it has one");
    assert_eq!(guard.operands, [Operand::Variable(0), Operand::Field(WatchId(1))]);
    assert_eq!((plan.variables[0].minimum, plan.variables[0].maximum), (0.0, 1.0));
}

#[test]
fn dates_are_gates() {
    let plan = compiled(
        r#"><place name="x" initial="true"/><place name="z"/>
        <transition name="t" from="x" to="z" not-before="2030-01-01T00:00Z" priority="1"/>
        <transition name="u" from="x" to="z" timeout="5s" not-after="2030-01-01T00:00:00.5Z"
                    missed="fail"/>
        <transition name="v" from="x" to="z" timeout="5s"/>"#,
    )
    .expect("it plays all of that");
    let [t, u] = [0, 1].map(|index| plan.transitions[index].dates.expect("it has some"));
    assert_eq!(
        (t.first.map(|date| date.to_string()), t.last),
        (Some("2030-01-01T00:00:00Z".to_owned()), None)
    );
    assert_eq!(t.missed, Missed::Skip, "the default");
    assert_eq!(
        u.last.and_then(|last| last.after(t.first?)),
        Some(std::time::Duration::from_millis(500))
    );
    assert_eq!((u.first, u.missed), (None, Missed::Fail));
    assert!(plan.has_dates() && plan.transitions[2].dates.is_none());
    let gated: Vec<_> = plan.net.transitions().iter().map(|t| t.gated).collect();
    assert_eq!(gated, [true, true, false], "what is proven holds whenever they open");
}

#[test]
fn a_sub_mission_s_variables_are_its_own() {
    let mut plan = PlanBuilder::default();
    for (name, data) in [("v", "a.o"), ("dock.v", "b.o")] {
        let source = plan.watch(data, &[]);
        let (minimum, maximum) = (0.0, 1.0);
        let name = name.to_owned();
        plan.variables.push(PlannedVariable { name, source, minimum, maximum });
    }
    let mut variable = |transition: &str, guard: &str| {
        let planned = plan.guard(transition, Guard::parse(guard).expect("a guard"));
        planned.map(|planned| planned.operands[0]).ok()
    };
    assert_eq!(variable("t", "v < 1"), Some(Operand::Variable(0)));
    assert_eq!(variable("dock.t", "v < 1"), Some(Operand::Variable(1)));
    // A transition of a route, in the mission and in the sub-mission.
    assert_eq!(variable("red.l1.t", "v < 1"), Some(Operand::Variable(0)));
    assert_eq!(variable("dock.red.l1.t", "v < 1"), Some(Operand::Variable(1)));
    assert_eq!(variable("t", "w < 1"), None);
}

#[test]
fn a_sub_mission_s_values_and_counters_are_its_own() {
    let main = r#"<armor version="1"><system><component name="a" kind="k"/></system>
        <mission goal="z" safe="z"><variable name="n" min="0" max="9"/>
        <place name="x" initial="true"/><place name="z"/>
        <submission ref="dock.xml" in="x" out="z"/></mission></armor>"#;
    let dock = r#"<armor version="1"><mission name="dock" goal="g" safe="g">
        <variable name="n" min="-1" max="3" initial="2"/>
        <place name="g"/><place name="p" initial="true" components="a">
        <parameter component="a" name="q" value="1"/></place>
        <transition name="t" from="p" to="g" when="n &gt; 1"><set variable="n" value="n - 1"/>
        </transition></mission></armor>"#;
    let reading = armor_robotfile::read("m.xml".as_ref(), &mut |path| {
        let text = if path.ends_with("dock.xml") { dock } else { main };
        Ok(text.as_bytes().to_vec())
    });
    let plan = Plan::of(&reading.configuration.expect("a configuration"));
    let plan = plan.expect("all of it is played").expect("a mission");
    let place = plan.place(plan.place_named("dock.p").expect("the place"));
    let [(component, value)] = &place.values[..] else { panic!("{:?}", place.values) };
    assert_eq!(
        (plan.component(*component).name.as_str(), value.to_string().as_str()),
        ("a", "q=1")
    );
    assert!(value.origin.starts_with("dock.xml:4:"), "{}", value.origin);
    let t = plan.transition(plan.transition_named("dock.t").expect("the transition"));
    let [set] = &t.sets[..] else { panic!("{:?}", t.sets) };
    let counter = &plan.counters[set.counter];
    assert_eq!((counter.name.as_str(), counter.counts.initial), ("dock.n", 2));
    assert_eq!(t.guard.as_ref().expect("a guard").operands, [Operand::Counter(set.counter)]);
    assert_eq!(set.of(&[7, 2]), Some(1));
}

#[test]
fn what_is_always_active_excludes_nothing() {
    let mission =
        r#"><place name="x" initial="true" components="a"/><exclusive components="a free"/>"#;
    check_refused("free", mission, Code::NotControllable);
}

fn check_refused(what: &str, mission: &str, code: Code) {
    let findings = compiled(mission).expect_err(what);
    let found = findings.iter().next().expect("one finding");
    assert_eq!(found.code, code, "{what}");
    assert!(found.at.is_some() && found.message.contains(what), "{found}");
}

/// The same drawing gives the same net, to the byte; and another order of its marks does not matter.
#[test]
fn a_drawing_gives_the_same_net_each_time() {
    let drawn = |marks: &str| {
        let file = format!(
            r#"<armor version="1"><system><component name="way" kind="patrol"/></system>
            <mission goal="z" safe="s"><map>{marks}</map>
            <route name="red" mover="way.route" start="P0" out="z" patience="1min">
            <leg name="l1" to="P1" by="2min"/><stay name="s1" for="3s"/><leg name="l2" to="P2"/>
            <otherwise on="lost-link blocked late recall" do="rally"/>
            <otherwise name="weak" when="level &lt; 2" do="home"/></route>
            <variable name="level" min="0" max="5" initial="5"/><place name="z"/><place name="s"/></mission></armor>"#
        );
        let reading =
            armor_robotfile::read("m.xml".as_ref(), &mut |_| Ok(file.clone().into_bytes()));
        assert!(!reading.findings.has_errors(), "{:?}", reading.findings);
        let configuration = reading.configuration.expect("a configuration");
        let plan = Plan::of(&configuration).expect("it is played").expect("a mission");
        let file = armor_petri::file::NetFile::new(plan.mission(), plan.net().as_ref().clone());
        armor_petri::file::pnml::write(&file)
    };
    let points = r#"<point name="P0" at="0 0"/><point name="P1" at="12 0"/>"#;
    let more = r#"<point name="P2" at="12 9"/><rally name="R1" at="1 1"/>"#;
    let net = drawn(&format!("{points}{more}"));
    assert!(net.contains("red.l1.to-R1") && net.contains("red.l1.weak"), "{net}");
    assert_eq!(net, drawn(&format!("{points}{more}")));
    assert_eq!(net, drawn(&format!("{more}{points}")));
}
