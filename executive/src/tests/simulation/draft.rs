//! Plans for tests: hand-written and random ones.

use super::dice::Dice;
use armor_petri::{FiringClass, FiringInterval, PlaceId};
use armor_plan::{
    ComponentId, GivenValue, OnResume, Plan, PlanBuilder, PlannedCounter, PlannedDates,
    PlannedGuard, PlannedSet, PlannedTransition, PlannedVariable, Watch,
};
use armor_robotfile::Date;
use armor_robotfile::guard::{Count, Guard};
use armor_robotfile::mission::{Autonomy, Counts, LostLink, Missed};
use std::time::Duration;

/// A transition of a test plan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Way {
    pub(crate) from: Vec<PlaceId>,
    pub(crate) to: Vec<PlaceId>,
    pub(crate) on: Option<(ComponentId, &'static str)>,
    pub(crate) after: Option<Duration>,
    pub(crate) priority: i32,
    pub(crate) on_stop_fail: Option<PlaceId>,
    pub(crate) on_start_fail: Option<PlaceId>,
    pub(crate) overrun: Option<PlaceId>,
    pub(crate) inhibitor: Option<PlaceId>,
    pub(crate) read: Option<PlaceId>,
    pub(crate) reset: Option<PlaceId>,
    pub(crate) safety: bool,
    pub(crate) autonomy: Autonomy,
    pub(crate) lost_link: Option<LostLink>,
    pub(crate) guard: Option<PlannedGuard>,
    pub(crate) sets: Vec<PlannedSet>,
    pub(crate) dates: Option<PlannedDates>,
}

/// Shorthand for the parts of a plan.
pub(crate) trait DraftPlan {
    /// A guard that must be valid.
    fn guarded(&mut self, text: &str) -> PlannedGuard;
    /// A value for a counter; the text must be valid.
    fn setting(&self, counter: usize, text: &str) -> PlannedSet;
    /// A counter whose initial value is 0, or the value of its domain nearest to 0.
    fn counter(&mut self, name: &str, minimum: i64, maximum: i64) -> usize;
    /// Adds a transition.
    fn way(&mut self, name: &str, way: Way);
}

impl DraftPlan for PlanBuilder {
    fn guarded(&mut self, text: &str) -> PlannedGuard {
        self.guard("", Guard::parse(text).expect("a guard")).expect("its variables")
    }

    fn setting(&self, counter: usize, text: &str) -> PlannedSet {
        self.set("", counter, Count::parse(text).expect("a value")).expect("its counters")
    }

    fn counter(&mut self, name: &str, minimum: i64, maximum: i64) -> usize {
        let counts = Counts { minimum, maximum, initial: 0.clamp(minimum, maximum) };
        self.counters.push(PlannedCounter { name: name.to_owned(), counts });
        self.counters.len() - 1
    }

    fn way(&mut self, name: &str, way: Way) {
        let mut t = self.net.transition(name).priority(way.priority);
        t = way.from.iter().fold(t, |t, place| t.input(*place, 1));
        t = way.to.iter().fold(t, |t, place| t.output(*place, 1));
        t = way.inhibitor.into_iter().fold(t, |t, place| t.inhibitor(place, 1));
        t = way.read.into_iter().fold(t, |t, place| t.read(place, 1));
        t = way.reset.into_iter().fold(t, armor_petri::TransitionBuilder::reset);
        t = way.after.into_iter().fold(t, |t, after| t.interval(FiringInterval::exactly(after)));
        if way.autonomy != Autonomy::Auto {
            let earliest = way.after.unwrap_or_default();
            t = t.interval(FiringInterval { earliest, latest: None });
        }
        t = if way.safety { t.class(FiringClass::Safety) } else { t };
        let gated = way.on.is_some() || way.guard.is_some() || way.dates.is_some();
        if gated {
            t.gated();
        }
        self.transitions.push(PlannedTransition {
            on: way.on.map(|(component, name)| (component, name.to_owned())),
            guard: way.guard,
            sets: way.sets,
            dates: way.dates,
            on_stop_fail: way.on_stop_fail,
            on_start_fail: way.on_start_fail,
            overrun: way.overrun,
            autonomy: way.autonomy,
            lost_link: way.lost_link,
        });
    }
}

const SECOND: Duration = Duration::from_secs(1);
const MS: Duration = Duration::from_millis(1);
const GUARDS: [&str; 10] = [
    "level < 5",
    "c0.level >= 3 and c1.load.x < 6",
    "c1.load.x != 4 or level == 2",
    "not known(level)",
    "known(c0.level) and not (c1.load.x > 2)",
    "true",
    "n < 3",
    "n + m >= 1 and level < 5",
    "n != 2 or c0.level >= 3",
    "m * m < 4 and known(n)",
];
/// Expressions that `n` and `m` are set to; some give values outside the domain.
const VALUES: [[&str; 4]; 2] = [["0", "3 - n", "n + 2", "m * m"], ["-m", "n - 1", "m - 1", "0"]];

/// The differences of another version of a plan: some parts are drawn from other dice.
#[derive(Clone, Debug)]
pub(crate) struct Edits {
    /// The other dice; without them the version does not differ.
    pub(crate) dice: Option<Dice>,
    /// The watches of the plan in force; those of the new plan begin with them.
    pub(crate) watches: Vec<Watch>,
}

/// Draws a plan in which every feature of a mission may occur anywhere. With `edits`, draws another
/// version of the plan that the same dice give without them.
pub(crate) fn random_plan(dice: &mut Dice, mut edits: Option<Edits>) -> Plan {
    let mut plan = PlanBuilder { mission: "random".to_owned(), ..PlanBuilder::default() };
    plan.watches = edits.iter().flat_map(|edits| edits.watches.clone()).collect();
    // Once in `sides` calls, returns dice by which this part of the plan differs.
    let mut edited = |sides: usize| {
        let dice = edits.as_mut()?.dice.as_mut()?;
        dice.one_in(sides).then(|| Dice::new(dice.roll(1 << 30) as u64))
    };
    let count = 2 + dice.roll(5);
    let components: Vec<_> = (0..count)
        .map(|index| plan.component(&format!("c{index}"), index == 0 || !dice.one_in(12)))
        .collect();
    let placed: Vec<_> =
        components.iter().copied().filter(|c| plan.components[c.index()].controllable).collect();
    let pick = |dice: &mut Dice, most: usize| {
        let mut some: Vec<_> =
            (0..dice.roll(most + 1)).map(|_| placed[dice.roll(placed.len())]).collect();
        some.sort_unstable();
        some.dedup();
        some
    };
    let mut places = Vec::new();
    for index in 0..4 + dice.roll(5) {
        let mut active = pick(dice, 2);
        if let Some(mut dice) = edited(12) {
            active = pick(&mut dice, 2);
        }
        let tokens = u32::from(index == 0 || (index < 3 && dice.one_in(3)));
        let letter = if edited(12).is_some() { 'q' } else { 'p' };
        places.push(plan.place(&format!("{letter}{index}"), tokens, &active));
    }
    for _ in 0..dice.roll(3) {
        // A component that is always active cannot exclude others; the compiler refuses that.
        let mut set = pick(dice, 3);
        set.retain(|c| plan.components[c.index()].is_controlled());
        plan.exclusives.push(set);
    }
    if let Some(mut dice) = edited(3) {
        let mut set = pick(&mut dice, 3);
        set.retain(|c| plan.components[c.index()].is_controlled());
        plan.exclusives.push(set);
    }
    let mut givers = Dice::new(dice.roll(1 << 30) as u64);
    for place in &places {
        let components = plan.places[place.index()].components.clone();
        let mut again = edited(6);
        let mut given = |component: ComponentId| {
            let dice = again.as_mut().unwrap_or(&mut givers);
            let parameter = ["area", "speed"][dice.roll(2)].to_owned();
            let text = format!("{}", dice.roll(2));
            let (folder, origin) = ("maps".into(), format!("seeds:{}", place.0));
            (component, GivenValue { parameter, text, folder, origin })
        };
        let values: Vec<_> = components.into_iter().map(&mut given).collect();
        plan.places[place.index()].values = values.into_iter().filter(|_| dice.one_in(3)).collect();
    }
    for place in &places {
        plan.places[place.index()].safety = dice.one_in(8);
    }
    plan.on_resume = if dice.one_in(5) { OnResume::Hold } else { OnResume::Continue };
    plan.goal = dice.one_in(2).then(|| places[places.len() - 1]);
    plan.safe = (!dice.one_in(5)).then(|| places[places.len() - 2]);
    plan.period = dice.one_in(6).then(|| Duration::from_secs(1));
    let any_place = |dice: &mut Dice| dice.one_in(4).then(|| places[dice.roll(places.len())]);
    for place in &places {
        plan.places[place.index()].on_failure = any_place(dice);
    }
    let level = plan.watch("c0.level", &[]);
    plan.variables.push(PlannedVariable {
        name: "level".to_owned(),
        source: level,
        minimum: 2.0,
        maximum: 7.0,
    });
    let most = if edited(6).is_some() { 5 } else { 4 };
    let counters = [plan.counter("n", 0, most), plan.counter("m", -2, 2)];
    for index in 0..4 + dice.roll(10) {
        let mut way = random_way(dice, &places, &components, any_place);
        if dice.one_in(3) {
            way.guard = Some(plan.guarded(GUARDS[dice.roll(GUARDS.len())]));
        }
        for counter in counters {
            if dice.one_in(5) {
                way.sets.push(plan.setting(counter, VALUES[counter][dice.roll(4)]));
            }
        }
        if edited(8).is_some() {
            continue;
        }
        if let Some(mut dice) = edited(6) {
            way = random_way(&mut dice, &places, &components, any_place);
        }
        if let Some(mut dice) = edited(6) {
            way.guard = Some(plan.guarded(GUARDS[dice.roll(GUARDS.len())]));
        }
        if let Some(mut dice) = edited(4) {
            way.after = Some(Duration::from_millis(100 + dice.roll(8000) as u64));
        }
        plan.way(&format!("t{index}"), way);
    }
    plan.build().expect("names are numbered")
}

/// The UTC time at which the simulated missions begin, by a correct wall clock.
pub(crate) fn noon() -> Date {
    Date::since_1970(Duration::from_secs(1_795_262_400))
}

/// Draws dates around the beginning of the mission; some have already passed.
fn random_dates(dice: &mut Dice) -> PlannedDates {
    let date = |dice: &mut Dice| noon().earlier(10 * SECOND).later(dice.up_to_ms(70_000));
    let (first, last) = match dice.roll(4) {
        0 => (Some(date(dice)), None),
        1 => (None, Some(date(dice))),
        _ => {
            let first = date(dice);
            (Some(first), Some(first.later(dice.up_to_ms(20_000) + MS)))
        }
    };
    PlannedDates { first, last, missed: [Missed::Fire, Missed::Skip, Missed::Fail][dice.roll(3)] }
}

fn random_way(
    dice: &mut Dice,
    places: &[PlaceId],
    components: &[ComponentId],
    any_place: impl Fn(&mut Dice) -> Option<PlaceId>,
) -> Way {
    // Rarely one of the last two places, goal and safe place: they end the mission.
    let place = |dice: &mut Dice| {
        let some = if dice.one_in(8) { places } else { &places[..places.len() - 2] };
        some[dice.roll(some.len())]
    };
    let mut way = Way { from: vec![place(dice)], to: vec![place(dice)], ..Way::default() };
    if dice.one_in(5) {
        way.from.push(place(dice));
    }
    if way.from.len() > 1 || dice.one_in(8) {
        way.to.push(place(dice));
    }
    let report = ["done", "done", "failed", "seen"][dice.roll(4)];
    let on = Some((components[dice.roll(components.len())], report));
    let after = Some(Duration::from_millis(100 + dice.roll(8000) as u64));
    (way.on, way.after) = match dice.roll(6) {
        0..3 => (on, None),
        3..5 => (None, after),
        _ => (on, after),
    };
    let within = dice.one_in(2).then(|| dice.up_to_ms(8000));
    let confirm = Autonomy::Confirm { within, fire_unanswered: dice.one_in(2) };
    way.autonomy = [Autonomy::Auto, Autonomy::Auto, Autonomy::Operator, confirm][dice.roll(4)];
    way.lost_link = [None, Some(LostLink::Fire), Some(LostLink::Wait)][dice.roll(3)];
    way.dates = dice.one_in(4).then(|| random_dates(dice));
    way.priority = dice.roll(3) as i32;
    way.safety = dice.one_in(10);
    (way.on_stop_fail, way.on_start_fail) = (any_place(dice), any_place(dice));
    way.overrun = any_place(dice).filter(|_| dice.one_in(4));
    way.inhibitor = any_place(dice).filter(|_| dice.one_in(3));
    way.read = any_place(dice).filter(|_| dice.one_in(3));
    way.reset = any_place(dice).filter(|_| dice.one_in(3));
    way
}
