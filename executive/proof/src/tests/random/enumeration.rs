//! All states of a small net with its clocks in whole seconds, one tick or one firing at a time,
//! and claims judged on them by the definition alone.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use armor_petri::{Net, TransitionId};
use armor_robotfile::FiringTrace;
use armor_robotfile::claim::{Relation, Statement};

use crate::analysed::Analysed;
use crate::formula::PlaceFormula;
use armor_plan::Plan;

/// Beyond so many states, or sets of them, a net is left alone.
const MOST: usize = 1500;
const MOST_TOKENS: u32 = 5;

/// Tokens, and the clocks of the enabled transitions.
type State = (Vec<u32>, Vec<Option<u64>>);

pub struct Enumeration {
    net: Net,
    states: Vec<State>,
    /// The firings of a state, and the state a second later if time may pass.
    firings: Vec<Vec<(u32, usize)>>,
    ticks: Vec<Option<usize>>,
}

fn s(time: std::time::Duration) -> u64 {
    assert_eq!(time.subsec_nanos(), 0, "whole seconds");
    time.as_secs()
}

impl Enumeration {
    pub fn of(net: &Net) -> Option<Self> {
        let mut found = Self { net: net.clone(), states: vec![], firings: vec![], ticks: vec![] };
        let initial = net.initial().to_vec();
        let clocks = net.transition_ids().map(|t| found.enabled(&initial, t).then_some(0));
        let first = (initial.clone(), clocks.collect());
        let mut numbers = BTreeMap::from([(first.clone(), 0)]);
        found.states.push(first);
        let mut next = 0;
        while next < found.states.len() {
            let state = found.states[next].clone();
            let fired: Vec<_> =
                net.transition_ids().filter_map(|t| Some((t.0, found.fire(&state, t)?))).collect();
            let mut number = |state: State, states: &mut Vec<State>| {
                let new = states.len();
                *numbers.entry(state.clone()).or_insert_with(|| {
                    states.push(state);
                    new
                })
            };
            let fired = fired.into_iter().map(|(t, after)| (t, number(after, &mut found.states)));
            let fired: Vec<_> = fired.collect();
            let later = found.tick(&state).map(|later| number(later, &mut found.states));
            found.firings.push(fired);
            found.ticks.push(later);
            if found.states.len() > MOST
                || found.states.iter().any(|s| s.0.iter().any(|n| *n > MOST_TOKENS))
            {
                return None;
            }
            next += 1;
        }
        Some(found)
    }

    fn enabled(&self, marking: &[u32], t: TransitionId) -> bool {
        let t = self.net.transition(t);
        let needs = t.inputs.iter().chain(&t.reads);
        needs.into_iter().all(|(p, n)| marking[p.index()] >= *n)
            && t.inhibitors.iter().all(|(p, n)| marking[p.index()] < *n)
    }

    fn latest(&self, t: TransitionId) -> Option<u64> {
        let t = self.net.transition(t);
        t.interval.latest.filter(|_| !t.gated).map(s)
    }

    fn fire(&self, (marking, clocks): &State, t: TransitionId) -> Option<State> {
        let clock = clocks[t.index()]?;
        let transition = self.net.transition(t);
        if clock < s(transition.interval.earliest) {
            return None;
        }
        let mut between = marking.clone();
        transition.inputs.iter().for_each(|(p, n)| between[p.index()] -= n);
        transition.resets.iter().for_each(|p| between[p.index()] = 0);
        let mut after = between.clone();
        transition.outputs.iter().for_each(|(p, n)| after[p.index()] += n);
        let clock = |other: TransitionId| {
            let continues = other != t && self.enabled(&between, other);
            let old = clocks[other.index()].filter(|_| continues);
            self.enabled(&after, other).then_some(old.unwrap_or(0))
        };
        let clocks = self.net.transition_ids().map(clock).collect();
        Some((after, clocks))
    }

    fn tick(&self, (marking, clocks): &State) -> Option<State> {
        let later = |t: TransitionId| match clocks[t.index()] {
            None => Some(None),
            Some(clock) => match self.latest(t) {
                Some(latest) => (clock < latest).then_some(Some(clock + 1)),
                // It stops where it makes no difference any more.
                None => Some(Some((clock + 1).min(s(self.net.transition(t).interval.earliest)))),
            },
        };
        let clocks: Option<Vec<_>> = self.net.transition_ids().map(later).collect();
        Some((marking.clone(), clocks?))
    }

    fn holds(&self, formula: &PlaceFormula, state: usize) -> bool {
        formula.holds(&self.states[state].0)
    }

    fn nexts(&self, state: usize) -> impl Iterator<Item = usize> + '_ {
        self.firings[state].iter().map(|f| f.1).chain(self.ticks[state])
    }

    /// Whether the statement is true; none if that takes too much.
    pub fn judge(&self, statement: &Statement, plan: &Plan, analysed: &Analysed) -> Option<bool> {
        let formula =
            |formula| PlaceFormula::of(formula, plan, analysed).expect("names that are there");
        let all = || 0..self.states.len();
        let fires = |name: &str| {
            let id = plan.transition_named(name).expect("it is there").0;
            self.firings.iter().flatten().any(|firing| firing.0 == id)
        };
        Some(match statement {
            Statement::Always(f) => all().all(|state| self.holds(&formula(f), state)),
            Statement::Never(f) => all().all(|state| !self.holds(&formula(f), state)),
            Statement::Reachable(f) => all().any(|state| self.holds(&formula(f), state)),
            Statement::AlwaysReachable(f) => return self.always_reachable(&formula(f)),
            Statement::Eventually(f) => !self.can_avoid(&[0], &formula(f)),
            Statement::LeadsTo(from, to) => {
                let from = formula(from);
                let starts: Vec<_> = all().filter(|state| self.holds(&from, *state)).collect();
                !self.can_avoid(&starts, &formula(to))
            }
            Statement::Duration { until, relation, limit } => {
                let (until, limit) = (formula(until), s(*limit));
                match relation {
                    Relation::Greater => self.shortest(&until).is_some_and(|time| time > limit),
                    Relation::GreaterOrEqual => {
                        self.shortest(&until).is_some_and(|time| time >= limit)
                    }
                    Relation::Less => self.longest(&until).is_some_and(|time| time < limit),
                    _ => self.longest(&until).is_some_and(|time| time <= limit),
                }
            }
            Statement::Fires(name) => fires(name.as_str()),
            Statement::Dead(name) => !fires(name.as_str()),
            Statement::Bounded(place, most) => {
                let place = plan.place_named(place.as_str()).expect("it is there");
                all().all(|state| {
                    most.is_none_or(|most| self.states[state].0[place.index()] <= most)
                })
            }
        })
    }

    /// After every firing sequence, one of the states it can lead to can come to it.
    fn always_reachable(&self, f: &PlaceFormula) -> Option<bool> {
        let mut can: Vec<bool> = (0..self.states.len()).map(|state| self.holds(f, state)).collect();
        loop {
            let more: Vec<_> = (0..can.len())
                .filter(|state| !can[*state] && self.nexts(*state).any(|next| can[next]))
                .collect();
            if more.is_empty() {
                break;
            }
            more.into_iter().for_each(|state| can[state] = true);
        }
        let mut known = BTreeSet::from([self.waited(BTreeSet::from([0]))]);
        let mut waiting: Vec<_> = known.iter().cloned().collect();
        while let Some(set) = waiting.pop() {
            if !set.iter().any(|state| can[*state]) {
                return Some(false);
            }
            for t in self.net.transition_ids() {
                let after = self.after(&set, t);
                if !after.is_empty() && known.insert(after.clone()) {
                    waiting.push(after);
                }
            }
            if known.len() > MOST {
                return None;
            }
        }
        Some(true)
    }

    /// The states after some time more.
    fn waited(&self, mut set: BTreeSet<usize>) -> BTreeSet<usize> {
        let mut waiting: Vec<_> = set.iter().copied().collect();
        while let Some(state) = waiting.pop() {
            waiting.extend(self.ticks[state].filter(|later| set.insert(*later)));
        }
        set
    }

    fn after(&self, set: &BTreeSet<usize>, t: TransitionId) -> BTreeSet<usize> {
        let fired = set.iter().flat_map(|state| &self.firings[*state]);
        self.waited(fired.filter(|firing| firing.0 == t.0).map(|firing| firing.1).collect())
    }

    /// The states on paths that do not come to it.
    fn avoiding(&self, starts: &[usize], f: &PlaceFormula) -> BTreeSet<usize> {
        let mut found = BTreeSet::new();
        let mut waiting = starts.to_vec();
        while let Some(state) = waiting.pop() {
            if !self.holds(f, state) && found.insert(state) {
                waiting.extend(self.nexts(state));
            }
        }
        found
    }

    /// Whether a run avoids it: at the end nothing is enabled, or firings continue for ever.
    fn can_avoid(&self, starts: &[usize], f: &PlaceFormula) -> bool {
        let within = self.avoiding(starts, f);
        let is_dead = |state: &usize| self.states[*state].1.iter().all(Option::is_none);
        let comes_back = |state: usize| {
            self.firings[state].iter().any(|(_, next)| {
                within.contains(next) && self.avoiding(&[*next], f).contains(&state)
            })
        };
        within.iter().any(is_dead) || within.iter().any(|state| comes_back(*state))
    }

    fn shortest(&self, f: &PlaceFormula) -> Option<u64> {
        let mut least = vec![u64::MAX; self.states.len()];
        let mut waiting = VecDeque::from([(0, 0)]);
        while let Some((time, state)) = waiting.pop_front() {
            if time >= least[state] {
                continue;
            }
            least[state] = time;
            self.firings[state].iter().for_each(|(_, next)| waiting.push_front((time, *next)));
            waiting.extend(self.ticks[state].map(|later| (time + 1, later)));
        }
        let times = (0..self.states.len()).filter(|state| self.holds(f, *state));
        times.map(|state| least[state]).min()
    }

    /// How late it can come; none if it need not, or may be waited for without end.
    fn longest(&self, f: &PlaceFormula) -> Option<u64> {
        let within = self.avoiding(&[0], f);
        let waits_for_ever = |state: &usize| {
            self.avoiding_ticks(*state, &within).is_some_and(|later| later == *state)
        };
        if self.can_avoid(&[0], f) || within.iter().any(waits_for_ever) {
            return None;
        }
        // No circle is left, so the longest paths end after as many rounds as there are states.
        let mut most: BTreeMap<usize, u64> = BTreeMap::from([(0, 0)]);
        let mut latest = 0;
        for _ in 0..=self.states.len() {
            let mut next: BTreeMap<usize, u64> = BTreeMap::new();
            for (state, time) in most {
                if self.holds(f, state) {
                    latest = latest.max(time);
                    continue;
                }
                let fired = self.firings[state].iter().map(|firing| (firing.1, time));
                for (after, time) in fired.chain(self.ticks[state].map(|later| (later, time + 1))) {
                    let known = next.entry(after).or_insert(time);
                    *known = time.max(*known);
                }
            }
            most = next;
        }
        assert!(most.is_empty(), "there was no circle");
        Some(latest)
    }

    fn avoiding_ticks(&self, state: usize, within: &BTreeSet<usize>) -> Option<usize> {
        self.ticks[state].filter(|later| within.contains(later))
    }

    /// The firings are a run's, and their circle can be gone round a few times.
    pub fn assert_plays(&self, path: &FiringTrace, context: &str) {
        let mut set = self.waited(BTreeSet::from([0]));
        let circle = path.circle.iter().cycle().take(5 * path.circle.len());
        for name in path.firings.iter().chain(circle) {
            let t = self.net.transition_ids().find(|t| self.net.transition(*t).name == *name);
            set = self.after(&set, t.unwrap_or_else(|| panic!("{context}: no {name}")));
            assert!(!set.is_empty(), "{context}: {name} cannot fire there");
        }
    }
}
