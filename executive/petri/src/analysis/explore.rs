//! The reachability graph in breadth-first order, with exact counts: states, edges (a state and a
//! transition it enables), most tokens, deadlocks. The order makes firing sequences shortest.

use super::boundedness::{PumpingSequence, pumping_on_path};
use super::budget::{AnalysisBudget, Exhausted};
use super::invariants::PlaceBounds;
use super::layout::{MarkingLayout, Room};
use super::rules::FiringRules;
use super::space::Space;
use super::store::{Insertion, MOST_STATES, StateStore, hash_of};
use crate::net::{Net, TransitionId};

/// Whether to stop is checked after states with this many places in total.
const PLACES_BETWEEN_STOP_CHECKS: usize = 1 << 18;

/// How an exploration ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExplorationEnd {
    /// All states were found.
    Complete,
    /// Some place can grow without bound.
    Unbounded(PumpingSequence),
    /// A budget ran out first.
    Undecided(Exhausted),
}

/// What an exploration found.
#[derive(Debug)]
pub struct StateExploration {
    /// The states found.
    pub space: Space,
    /// Whether they are complete.
    pub ending: ExplorationEnd,
}

/// Explores the states of `net` from its initial marking. `bounds` make states small, and may leave
/// places unbounded; then the search also looks for unbounded growth.
///
/// `with_paths` records how each state was reached, in 4 bytes, for [`Space::path_to`].
pub fn explore_states(
    net: &Net,
    bounds: &PlaceBounds,
    with_paths: bool,
    budget: &AnalysisBudget<'_>,
) -> StateExploration {
    let mut search = StateSearch::new(net, bounds, with_paths || !bounds.is_bounded());
    let ending = search.explore_all(bounds.is_bounded(), budget);
    StateExploration { space: search.space, ending }
}

/// One transition's firing on packed states.
#[derive(Debug)]
struct Packed {
    difference: Vec<(u32, u64)>,
    /// Places that gain tokens: place, tokens gained, and the capacity of its field.
    growing: Vec<(u32, u32, u32)>,
}

struct StateSearch {
    space: Space,
    packed: Vec<Packed>,
    marking: Vec<u32>,
    after: Vec<u32>,
    state: Vec<u64>,
    successors: Vec<u64>,
    hashes: Vec<(u64, u32)>,
    /// Per place, the tokens at which the search last looked for unbounded growth.
    looked_at: Vec<u32>,
}

impl StateSearch {
    fn new(net: &Net, bounds: &PlaceBounds, with_paths: bool) -> Self {
        let rules = FiringRules::new(net);
        let layout = MarkingLayout::new(&rooms_of(net, &rules, bounds));
        let initial = net.initial().to_vec();
        let mut state = vec![0; layout.words()];
        layout.pack(&initial, &mut state);
        let mut store = StateStore::new(layout.words());
        store.insert(&state, hash_of(&state));
        let packed = pack_rules(&rules, &layout);
        let space = Space {
            most_in_place: initial.clone(),
            most_in_marking: 0,
            edges: 0,
            expanded: 0,
            deadlocks: 0,
            first_deadlock: None,
            fired: vec![false; net.transitions().len()],
            parents: with_paths.then(|| vec![0]),
            rules,
            layout,
            store,
        };
        Self {
            after: initial.clone(),
            looked_at: initial.clone(),
            marking: initial,
            packed,
            space,
            state,
            successors: Vec::new(),
            hashes: Vec::new(),
        }
    }

    fn explore_all(&mut self, bounded: bool, budget: &AnalysisBudget<'_>) -> ExplorationEnd {
        if let Err(exhausted) = self.check_growth(budget) {
            return ExplorationEnd::Undecided(exhausted);
        }
        let between = (PLACES_BETWEEN_STOP_CHECKS / self.marking.len().max(64)).max(1);
        while self.space.expanded < self.space.store.len() {
            if self.space.expanded.is_multiple_of(between) && (budget.stop)() {
                return ExplorationEnd::Undecided(Exhausted::Time);
            }
            budget.count_explored();
            match self.expand_next_state(bounded, budget) {
                Ok(None) => self.space.expanded += 1,
                Ok(Some(pumping)) => return ExplorationEnd::Unbounded(pumping),
                Err(exhausted) => return ExplorationEnd::Undecided(exhausted),
            }
        }
        ExplorationEnd::Complete
    }

    /// Fires every enabled transition of the next state.
    fn expand_next_state(
        &mut self,
        bounded: bool,
        budget: &AnalysisBudget<'_>,
    ) -> Result<Option<PumpingSequence>, Exhausted> {
        let number = self.space.expanded as u32;
        self.state.copy_from_slice(self.space.store.state(number));
        self.space.layout.unpack(&self.state, &mut self.marking);
        while let Some((place, tokens)) = self.fire_enabled()? {
            self.make_room(place, tokens, budget)?;
            self.state.resize(self.space.layout.words(), 0);
            self.space.layout.pack(&self.marking, &mut self.state);
        }
        let tokens = self.marking.iter().map(|tokens| u64::from(*tokens)).sum();
        self.space.most_in_marking = self.space.most_in_marking.max(tokens);
        let firings = self.hashes.len();
        self.space.edges += firings as u64;
        if firings == 0 {
            self.space.deadlocks += 1;
            self.space.first_deadlock.get_or_insert(number);
        }
        // Reading all slots before searching lets the memory accesses overlap.
        let slots = self.hashes.iter().map(|(hash, _)| self.space.store.first_slot(*hash));
        std::hint::black_box(slots.fold(0u32, u32::wrapping_add));
        for index in 0..firings {
            if self.space.store.is_about_to_grow() {
                self.check_growth(budget)?;
            }
            let (hash, transition) = self.hashes[index];
            let words = self.space.layout.words();
            let successor = &self.successors[index * words..(index + 1) * words];
            let Insertion::New(new) = self.space.store.insert(successor, hash) else { continue };
            // Recorded before the limit is checked, so that the last state has a parent too.
            let record = self.record_new_state(number, transition);
            if u64::from(new) >= budget.states {
                return Err(Exhausted::States);
            }
            if record && !bounded {
                let found = pumping_on_path(&self.space, new);
                if found.is_some() {
                    return Ok(found);
                }
            }
        }
        Ok(None)
    }

    /// Computes the successors of the present state; returns a place whose field is too small for
    /// its new tokens, if there is one.
    fn fire_enabled(&mut self) -> Result<Option<(u32, u32)>, Exhausted> {
        let Self { space, packed, marking, after, state, successors, hashes, .. } = self;
        successors.clear();
        hashes.clear();
        let (mut full, mut uncountable) = (None, false);
        space.rules.for_each_enabled(marking, |transition| {
            let index = transition as usize;
            space.fired[index] = true;
            for &(place, by, capacity) in &packed[index].growing {
                match marking[place as usize].checked_add(by) {
                    Some(tokens) if tokens <= capacity => {}
                    Some(tokens) => full = Some((place, tokens)),
                    None => uncountable = true,
                }
            }
            let start = successors.len();
            successors.extend_from_slice(state);
            let rule = space.rules.rule(transition);
            if rule.reset_to.is_empty() {
                for &(word, difference) in &packed[index].difference {
                    let word = &mut successors[start + word as usize];
                    *word = word.wrapping_add(difference);
                }
            } else if full.is_none() && !uncountable {
                after.copy_from_slice(marking);
                let reset = rule.reset_to.iter();
                let over = reset.copied().find(|(p, put)| *put > space.layout.capacity(*p));
                full = over;
                if rule.fire(after).is_some() && full.is_none() {
                    space.layout.pack(after, &mut successors[start..]);
                }
            }
            hashes.push((hash_of(&successors[start..]), transition));
        });
        if uncountable { Err(Exhausted::Tokens) } else { Ok(full) }
    }

    /// Records a new state, reached from the present one by `transition`. Returns whether some
    /// place holds twice the tokens of the last search for growth.
    fn record_new_state(&mut self, from: u32, transition: u32) -> bool {
        let space = &mut self.space;
        if let Some(parents) = &mut space.parents {
            parents.push(from);
        }
        let mut record = false;
        let mut note = |place: u32, tokens: u32| {
            let most = &mut space.most_in_place[place as usize];
            if tokens > *most {
                *most = tokens;
                let looked_at = &mut self.looked_at[place as usize];
                // A place's first token is not growth.
                if tokens >= looked_at.saturating_mul(2).max(2) {
                    *looked_at = tokens;
                    record = true;
                }
            }
        };
        for &(place, by, _) in &self.packed[transition as usize].growing {
            note(place, self.marking[place as usize] + by);
        }
        for &(place, tokens) in &space.rules.rule(transition).reset_to {
            note(place, tokens);
        }
        record
    }

    /// Checks that one more state fits the budget.
    fn check_growth(&self, budget: &AnalysisBudget<'_>) -> Result<(), Exhausted> {
        let paths = self.space.parents.as_ref().map_or(0, |paths| paths.capacity() as u64 * 8);
        if self.space.store.bytes_with_one_more() + paths > budget.memory_bytes {
            return Err(Exhausted::Memory);
        }
        match self.space.store.len() >= MOST_STATES {
            true => Err(Exhausted::States),
            false => Ok(()),
        }
    }

    /// Widens the field of a place to hold `tokens`, in all states.
    fn make_room(
        &mut self,
        place: u32,
        tokens: u32,
        budget: &AnalysisBudget<'_>,
    ) -> Result<(), Exhausted> {
        let space = &mut self.space;
        let old = space.layout.clone();
        let mut rooms: Vec<_> = (0..self.marking.len() as u32).map(|p| old.room(p)).collect();
        rooms[place as usize] = Room::UpTo(tokens);
        space.layout = MarkingLayout::new(&rooms);
        let growth = space.layout.words() as u64 * 8 * space.store.len() as u64;
        if space.store.bytes_with_one_more() + growth > budget.memory_bytes {
            space.layout = old;
            return Err(Exhausted::Memory);
        }
        let (layout, after) = (&space.layout, &mut self.after);
        space.store = space.store.converted(layout.words(), |from, to| {
            old.unpack(from, after);
            layout.pack(after, to);
        });
        self.packed = pack_rules(&space.rules, &space.layout);
        Ok(())
    }
}

/// Returns the room of each place: its bound if it has one, else what the initial marking needs.
pub(super) fn rooms_of(net: &Net, rules: &FiringRules, bounds: &PlaceBounds) -> Vec<Room> {
    let mut changes = vec![false; net.places().len()];
    for rule in rules.all_rules() {
        rule.change.iter().for_each(|(place, _)| changes[*place as usize] = true);
        rule.reset_to.iter().for_each(|(place, _)| changes[*place as usize] = true);
    }
    let room = |place: usize| match (changes[place], bounds.of(place)) {
        (false, _) => Room::Constant(net.initial()[place]),
        (true, Some(bound)) => Room::UpTo(u32::try_from(bound).unwrap_or(u32::MAX)),
        (true, None) => Room::UpTo(net.initial()[place].max(1)),
    };
    (0..net.places().len()).map(room).collect()
}

fn pack_rules(rules: &FiringRules, layout: &MarkingLayout) -> Vec<Packed> {
    let packed = |rule: &super::rules::Rule| Packed {
        difference: layout.difference(&rule.change),
        growing: rule
            .change
            .iter()
            .filter(|(_, change)| *change > 0)
            .map(|&(place, by)| (place, by as u32, layout.capacity(place)))
            .collect(),
    };
    rules.all_rules().iter().map(packed).collect()
}

impl Space {
    /// Returns the transition that leads from one state to another.
    pub(crate) fn between(&self, from: u32, to: u32) -> TransitionId {
        let successors = self.successors(from);
        let found = successors.iter().find(|(_, state)| *state == to);
        found.expect("a state's parent has a transition that leads to it").0
    }
}
