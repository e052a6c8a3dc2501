//! Mission file → plan. What the file may say and this executive does not play is refused with a
//! finding, never passed over.

use crate::builder::PlanBuilder;
use crate::counters::{PlannedCounter, PlannedSet};
use crate::dates::PlannedDates;
use crate::guards::{PlannedGuard, PlannedVariable};
use crate::plan::{ComponentId, OnResume, Plan, PlannedTransition};
use crate::values::GivenValue;
use crate::version::Version;
use armor_missions::guard::{Count, Guard, Name};
use armor_missions::mission::{
    ArcKind, Autonomy, Class, Mission, Place, PlaceParameter, Resume, SetVariable, Transition,
    Variable,
};
use armor_missions::model::Restart;
use armor_missions::{
    Code, Configuration, Date, Feature, Finding, Findings, Location, Spanned, System,
};
use armor_petri::{Interval, PlaceId};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// What of a mission this executive plays, beyond plain ArMoR.
pub const PLAYED: &[Feature] = &[
    Feature::Interval,
    Feature::Priority,
    Feature::SafetyClass,
    Feature::Weight,
    Feature::ReadArc,
    Feature::InhibitorArc,
    Feature::ResetArc,
    Feature::Operator,
    Feature::Overrun,
    Feature::Period,
    Feature::Resume,
    Feature::Submission,
    Feature::Guard,
    Feature::Variable,
    Feature::Date,
    Feature::Check,
    Feature::Clock,
    Feature::PlaceParameter,
    Feature::FreeVariable,
];

impl Plan {
    /// The plan of a configuration's mission with its sub-missions put in; none if it has none.
    ///
    /// # Errors
    /// Findings: what it does not play, names that lead nowhere, or that the whole is larger than a
    /// mission may be.
    pub fn of(configuration: &Configuration) -> Result<Option<Self>, Findings> {
        Self::compiled(configuration, None)
    }

    /// The same for a mission that is to follow the one that is played: over the components that
    /// run, under the same numbers, and looking at what is looked at already.
    ///
    /// # Errors
    /// As [`Self::of`]; also a component that the mission speaks of and that does not run.
    pub fn over(configuration: &Configuration, running: &Self) -> Result<Option<Self>, Findings> {
        Self::compiled(configuration, Some(running))
    }

    fn compiled(
        configuration: &Configuration,
        running: Option<&Self>,
    ) -> Result<Option<Self>, Findings> {
        let mut unplayed = Findings::default();
        configuration.refuse_unplayed(PLAYED, &mut unplayed);
        if unplayed.has_errors() {
            return Err(unplayed);
        }
        let Some(mission) = configuration.flattened()? else { return Ok(None) };
        let compiler = match running {
            None => Compiler::of(&configuration.system),
            Some(running) => Compiler::over(&configuration.system, running),
        };
        let mut plan = Self::compile(compiler, &mission)?;
        plan.version = Version::of(configuration, 0).into();
        // Whoever runs keeps the time that it was started with.
        plan.clock = match running {
            Some(running) => running.clock.clone(),
            None => configuration.system.clock.as_ref().map(|clock| clock.source.data()),
        };
        let began = running.map(|running| &running.began);
        plan.began = Arc::clone(began.unwrap_or(&plan.version));
        Ok(Some(plan))
    }

    /// The plan of a whole mission over a system, both checked before.
    fn compile(mut compiler: Compiler, mission: &Mission) -> Result<Self, Findings> {
        compiler.plan.mission =
            mission.name.as_ref().map_or_else(|| "mission".to_owned(), |name| name.value.clone());
        mission.places.iter().for_each(|place| compiler.place(place));
        for place in &mission.places {
            let id = compiler.find_place(&place.name);
            let refuge = place.on_failure.as_ref().and_then(|refuge| compiler.find_place(refuge));
            if let Some(id) = id {
                compiler.plan.places[id.index()].on_failure = refuge;
            }
        }
        compiler.plan.goal = mission.goal.as_ref().and_then(|goal| compiler.find_place(goal));
        compiler.plan.safe = mission.safe.as_ref().and_then(|safe| compiler.find_place(safe));
        compiler.plan.period = mission.period.as_ref().map(|period| period.value);
        compiler.plan.on_resume = match mission.resume.as_deref() {
            Some(Resume::Safe) => OnResume::Safe,
            Some(Resume::Hold) => OnResume::Hold,
            Some(Resume::Continue) | None => OnResume::Continue,
        };
        for exclusive in &mission.exclusives {
            let names = exclusive.components.iter();
            let set = names.filter_map(|name| compiler.exclusive(name)).collect();
            compiler.plan.exclusives.push(set);
        }
        mission.variables.iter().for_each(|variable| compiler.variable(variable));
        mission.transitions.iter().for_each(|t| compiler.transition(mission, t));
        compiler.finish(mission)
    }
}

#[derive(Default)]
struct Compiler {
    plan: PlanBuilder,
    components: HashMap<String, ComponentId>,
    places: HashMap<String, PlaceId>,
    findings: std::cell::RefCell<Findings>,
    /// Components of the file that do not run.
    idle: HashSet<String>,
}

impl Compiler {
    fn of(system: &System) -> Self {
        let mut compiler = Self::default();
        for component in &system.components {
            let returns = component.restart != Restart::Never;
            compiler.component(&component.name, component.controllable, returns);
        }
        compiler
    }

    fn over(system: &System, running: &Plan) -> Self {
        let mut compiler = Self::default();
        for component in &running.components {
            compiler.component(&component.name, component.controllable, component.returns);
        }
        compiler.plan.watches.clone_from(&running.watches);
        compiler.plan.limits = running.limits.clone();
        let names = system.components.iter().map(|component| component.name.value.clone());
        compiler.idle = names.filter(|name| !compiler.components.contains_key(name)).collect();
        compiler
    }

    fn component(&mut self, name: &str, controllable: bool, returns: bool) {
        let id = self.plan.component(name, controllable);
        self.plan.components[id.index()].returns = returns;
        self.components.insert(name.to_owned(), id);
    }

    fn place(&mut self, place: &Place) {
        let found = place.components.iter().filter_map(|name| self.find_component(name));
        let components: Vec<_> = found.collect();
        let id = self.plan.place(&place.name, place.initial, &components);
        let given = place.parameters.iter().filter_map(|given| {
            let PlaceParameter { component, parameter } = given;
            let value = GivenValue {
                parameter: parameter.name.value.clone(),
                text: parameter.value.value.clone(),
                folder: parameter.folder.clone(),
                origin: parameter.origin(),
            };
            Some((self.find_component(component)?, value))
        });
        let values = given.collect();
        self.plan.places[id.index()].safety = place.class == Class::Safety;
        self.plan.places[id.index()].values = values;
        self.places.insert(place.name.value.clone(), id);
    }

    fn transition(&mut self, mission: &Mission, transition: &Transition) {
        let manual = transition.autonomy != Autonomy::Auto;
        let guard = transition.when.as_ref().and_then(|when| self.guard(&transition.name, when));
        let found =
            |name: &Option<Spanned<String>>| name.as_ref().and_then(|name| self.find_place(name));
        let on = transition
            .on
            .as_ref()
            .and_then(|on| Some((self.find_component(&on.component)?, on.event.value.clone())));
        let planned = PlannedTransition {
            on,
            guard,
            sets: self.sets(transition),
            dates: dates(transition),
            on_stop_fail: found(&transition.on_stop_fail),
            on_start_fail: found(&transition.on_start_fail),
            overrun: found(&transition.overrun),
            autonomy: transition.autonomy,
            lost_link: transition.lost_link.as_deref().copied(),
        };
        let arcs: Vec<_> = transition
            .arcs
            .iter()
            .filter_map(|arc| Some((arc.kind, self.find_place(&arc.place)?, arc.weight)))
            .collect();
        let mut t = self.plan.net.transition(transition.name.value.as_str());
        for (kind, place, weight) in arcs {
            t = match kind {
                ArcKind::Take => t.input(place, weight),
                ArcKind::Put => t.output(place, weight),
                ArcKind::Read => t.read(place, weight),
                ArcKind::Inhibitor => t.inhibitor(place, weight),
                ArcKind::Reset => t.reset(place),
            };
        }
        if let Some(interval) = &transition.interval {
            // Whoever waits for a person is never too late.
            let latest = interval.latest.filter(|_| !manual);
            t = t.interval(Interval { earliest: interval.earliest, latest });
        } else if manual {
            t = t.interval(Interval::UNTIMED);
        }
        if is_safety(mission, transition) {
            t = t.class(armor_petri::Class::Safety);
        }
        t = t.priority(transition.priority);
        if planned.is_gated() {
            t.gated();
        }
        self.plan.transitions.push(planned);
    }

    fn variable(&mut self, variable: &Variable) {
        let Some(source) = &variable.source else {
            let name = variable.name.value.clone();
            match variable.counts() {
                Some(counts) => self.plan.counters.push(PlannedCounter { name, counts }),
                None => self.report(Code::BadValue, &variable.name.at, "it has no whole numbers"),
            }
            return;
        };
        let Some(name) = Name::of_data(&source.value) else {
            return self.report(Code::BadValue, &source.at, "this is not a field of data");
        };
        self.expect_data(&name, &source.at);
        let source = self.plan.watch(name.data().unwrap_or_default(), &name.fields());
        let end = |end: &Option<Spanned<f64>>| end.as_ref().map(|end| end.value);
        self.plan.variables.push(PlannedVariable {
            name: variable.name.value.clone(),
            source,
            minimum: end(&variable.minimum).unwrap_or(f64::NEG_INFINITY),
            maximum: end(&variable.maximum).unwrap_or(f64::INFINITY),
        });
    }

    fn guard(&mut self, transition: &str, when: &Spanned<String>) -> Option<PlannedGuard> {
        let guard = match Guard::parse(&when.value) {
            Ok(guard) => guard,
            Err(error) => {
                self.report(Code::GuardSyntax, &when.at, &error.to_string());
                return None;
            }
        };
        for name in guard.names().iter().filter(|name| name.data().is_some()) {
            self.expect_data(name, &when.at);
        }
        let planned = self.plan.guard(transition, guard);
        if let Err(name) = &planned {
            let message = format!("there is no variable called {name}");
            self.report(Code::UnknownVariable, &when.at, &message);
        }
        planned.ok()
    }

    fn sets(&self, transition: &Transition) -> Vec<PlannedSet> {
        let mut planned = Vec::new();
        for SetVariable { variable, value } in &transition.sets {
            let counters = &self.plan.counters;
            let counter = counters.iter().position(|counter| counter.name == variable.value);
            let Some(counter) = counter else {
                let message = format!("no transition can set {}", variable.value);
                self.report(Code::UnknownVariable, &variable.at, &message);
                continue;
            };
            let count = match Count::parse(&value.value) {
                Ok(count) => count,
                Err(error) => {
                    self.report(Code::CountSyntax, &value.at, &error.to_string());
                    continue;
                }
            };
            match self.plan.set(&transition.name, counter, count) {
                Ok(set) => planned.push(set),
                Err(name) => {
                    let message = format!("there is no variable called {name}");
                    self.report(Code::UnknownVariable, &value.at, &message);
                }
            }
        }
        planned
    }

    fn expect_data(&self, name: &Name, at: &Location) {
        let component = name.as_str().split('.').next().unwrap_or_default();
        if self.idle.contains(component) {
            self.idle(component, at);
        } else if !self.components.contains_key(component) {
            let message = format!("there is no component called {component}");
            self.report(Code::UnknownComponent, at, &message);
        }
    }

    fn idle(&self, component: &str, at: &Location) {
        let message = format!("{component} does not run: it was not in the file at the start");
        let finding = Finding::new(Code::UnknownComponent, at, message);
        let remedy = "run the system again, or leave it out of the mission";
        self.findings.borrow_mut().push(finding.remedy(remedy));
    }

    /// What [`armor_missions::check`] says with more words; nobody compiles what it refuses.
    fn report(&self, code: Code, at: &Location, message: &str) {
        let finding = Finding::new(code, at, message).remedy("correct it; armor check says how");
        self.findings.borrow_mut().push(finding);
    }

    /// A component that may be excluded from running: one that something starts and stops.
    fn exclusive(&self, name: &Spanned<String>) -> Option<ComponentId> {
        let id = self.find_component(name)?;
        if !self.plan.components[id.index()].is_controlled() {
            let message = format!("{} is in no place, so it is always active", name.value);
            let finding = Finding::new(Code::NotControllable, &name.at, message);
            let remedy = "put it into a place, or take it out of here";
            self.findings.borrow_mut().push(finding.remedy(remedy));
        }
        Some(id)
    }

    fn find_place(&self, name: &Spanned<String>) -> Option<PlaceId> {
        let id = self.places.get(&name.value).copied();
        if id.is_none() {
            self.unknown(Code::UnknownPlace, name, "place");
        }
        id
    }

    fn find_component(&self, name: &Spanned<String>) -> Option<ComponentId> {
        let id = self.components.get(&name.value).copied();
        if self.idle.contains(&name.value) {
            self.idle(&name.value, &name.at);
        } else if id.is_none() {
            self.unknown(Code::UnknownComponent, name, "component");
        }
        id
    }

    fn unknown(&self, code: Code, name: &Spanned<String>, what: &str) {
        let message = format!("there is no {what} called {}", name.value);
        let finding = Finding::new(code, &name.at, message).remedy("correct the name");
        self.findings.borrow_mut().push(finding);
    }

    fn finish(self, mission: &Mission) -> Result<Plan, Findings> {
        let mut findings = self.findings.into_inner();
        if findings.has_errors() {
            return Err(findings);
        }
        self.plan.build().map_err(|error| {
            let finding = Finding::new(Code::DuplicateTransition, &mission.at, error.to_string());
            findings.push(finding.remedy("give places and transitions names of their own"));
            findings
        })
    }
}

fn dates(transition: &Transition) -> Option<PlannedDates> {
    let date = |date: &Option<Spanned<Date>>| date.as_ref().map(|date| date.value);
    let (first, last) = (date(&transition.not_before), date(&transition.not_after));
    let missed = transition.missed.as_deref().copied().unwrap_or_default();
    (first.is_some() || last.is_some()).then_some(PlannedDates { first, last, missed })
}

/// What leads to a place of the safety class is of the safety class.
fn is_safety(mission: &Mission, transition: &Transition) -> bool {
    let safe = |name: &str| mission.place(name).is_some_and(|p| p.class == Class::Safety);
    transition.class == Class::Safety || transition.outputs().any(|arc| safe(&arc.place))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guards::{Operand, WatchId};
    use armor_missions::mission::{LostLink, Missed};

    fn compiled(mission: &str) -> Result<Plan, Findings> {
        let file = format!(
            r#"<armor version="1"><system><component name="a" kind="k"/><component name="b" kind="k"/>
            <component name="free" kind="k"/></system><mission name="m" {mission}</mission></armor>"#
        );
        let reading =
            armor_missions::read("m.xml".as_ref(), &mut |_| Ok(file.clone().into_bytes()));
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
        assert!(t.gated && t.priority == 3 && t.class == armor_petri::Class::Ordinary);
        assert_eq!(plan.transitions[0].on, Some((a, "done".to_owned())));
        assert_eq!(late.class, armor_petri::Class::Safety, "it leads to a place of that class");
        assert_eq!(late.interval, Interval::exactly(std::time::Duration::from_secs(5)));
        assert_eq!(
            (plan.transitions[1].on_stop_fail, plan.transitions[1].overrun),
            (place("z"), place("s"))
        );
    }

    #[test]
    fn whoever_waits_for_a_person_is_never_too_late() {
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
        assert_eq!(t.interval, Interval { earliest: 3 * second, latest: None });
        assert_eq!(u.interval, Interval::UNTIMED);
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
        assert_eq!(t.missed, Missed::Skip, "nothing said");
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
        assert_eq!(variable("dock.inner.t", "v < 1"), None);
        assert_eq!(variable("t", "w < 1"), None);
    }

    #[test]
    fn what_is_not_played_is_refused_where_it_stands() {
        let file = r#"<armor version="1"><system><component name="a" kind="k"/>
            <component name="b" kind="k"/><link from="a.o" to="b.i" mode="pull"/></system>
            <mission><place name="x" initial="true"/></mission></armor>"#;
        let mut open = |_: &std::path::Path| Ok(file.as_bytes().to_vec());
        let reading = armor_missions::read("m.xml".as_ref(), &mut open);
        let findings = Plan::of(&reading.configuration.expect("a configuration"));
        let findings = findings.expect_err("a pulling link is not played");
        let found = findings.iter().next().expect("one finding");
        assert_eq!(found.code, Code::NotPlayed);
        assert!(found.to_string().starts_with("m.xml:2:"), "{found}");
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
        let reading = armor_missions::read("m.xml".as_ref(), &mut |path| {
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
}
