//! Which places may be marked together, from the arcs alone: the structural concurrency relation of
//! A. Kovalyov and J. Esparza, "A polynomial algorithm to compute the concurrency relation of free-choice
//! signal transition graphs", 1996. It contains all pairs that are marked together in some marking,
//! and in nets that are not free-choice, and for guards and times, perhaps more. So a pair that is
//! not in it is never marked together.

use std::collections::BTreeMap;

use crate::mission::{ArcKind, Mission, Transition};

/// Places of a mission for which the relation is computed: its size is the square of that.
const MAX_PLACES: usize = 256;
/// Steps of the computation, so that it takes milliseconds for any mission.
const MAX_STEPS: usize = 20_000_000;

/// The pairs of places that may be marked together.
pub(super) struct PlaceConcurrency<'a> {
    indices: BTreeMap<&'a str, usize>,
    /// Whether a place may be marked.
    reached: Vec<bool>,
    /// Whether two places may be marked together; of one place, whether it may hold two tokens.
    pairs: Vec<Vec<bool>>,
    has_changed: bool,
}

/// The tokens that a transition, or a failure, moves.
struct TokenMove {
    inputs: Vec<usize>,
    /// Each with its number of tokens.
    outputs: Vec<(usize, u32)>,
}

impl<'a> PlaceConcurrency<'a> {
    /// Computes the relation for a mission without sub-missions; none if it is too large.
    pub(super) fn of(mission: &'a Mission) -> Option<Self> {
        let count = mission.places.len();
        let names = mission.places.iter().map(|place| place.name.value.as_str());
        let mut relation = Self {
            indices: names.enumerate().map(|(index, name)| (name, index)).collect(),
            reached: vec![false; count],
            pairs: vec![vec![false; if count > MAX_PLACES { 0 } else { count }]; count],
            has_changed: false,
        };
        if count > MAX_PLACES {
            return None;
        }
        let marked = mission.places.iter().enumerate().filter(|(_, place)| place.initial > 0);
        relation.put(&marked.map(|(index, place)| (index, place.initial)).collect::<Vec<_>>());
        let moves = relation.find_moves(mission);
        let mut steps = 0;
        loop {
            relation.has_changed = false;
            for moved in &moves {
                steps += count * (1 + moved.inputs.len() + moved.outputs.len());
                if steps > MAX_STEPS {
                    return None;
                }
                relation.fire(moved);
            }
            if !relation.has_changed {
                return Some(relation);
            }
        }
    }

    /// Whether the places may be marked in one marking; a place and itself, whether it may be
    /// marked.
    pub(super) fn may_be_together(&self, one: &str, other: &str) -> bool {
        let (Some(one), Some(other)) = (self.indices.get(one), self.indices.get(other)) else {
            return true;
        };
        if one == other { self.reached[*one] } else { self.pairs[*one][*other] }
    }

    /// The moves of all transitions, and those after failures.
    fn find_moves(&self, mission: &Mission) -> Vec<TokenMove> {
        let mut moves = Vec::new();
        for transition in &mission.transitions {
            let inputs = self.input_places(transition);
            let targets = [&transition.on_stop_fail, &transition.on_start_fail];
            for target in targets.into_iter().flatten() {
                moves.push(TokenMove {
                    inputs: inputs.clone(),
                    outputs: self.index_of(&target.value).map(|place| (place, 1)).collect(),
                });
            }
            let outputs = self.output_places(transition);
            moves.push(TokenMove { inputs, outputs });
        }
        for (index, place) in mission.places.iter().enumerate() {
            let target = place.on_failure.as_ref().or(mission.safe.as_ref());
            let target = target.and_then(|target| self.indices.get(target.value.as_str()));
            if let Some(target) = target.filter(|target| **target != index) {
                moves.push(TokenMove { inputs: vec![index], outputs: vec![(*target, 1)] });
            }
        }
        moves
    }

    fn index_of(&self, place: &str) -> impl Iterator<Item = usize> {
        self.indices.get(place).copied().into_iter()
    }

    fn input_places(&self, transition: &Transition) -> Vec<usize> {
        let arcs = transition.arcs.iter();
        let needed = arcs.filter(|arc| matches!(arc.kind, ArcKind::Take | ArcKind::Read));
        needed.flat_map(|arc| self.index_of(&arc.place.value)).collect()
    }

    /// What it puts, and what it reads: that stays.
    fn output_places(&self, transition: &Transition) -> Vec<(usize, u32)> {
        let arcs = transition.arcs.iter();
        let kept = arcs.filter(|arc| matches!(arc.kind, ArcKind::Put | ArcKind::Read));
        let overrun = transition.overrun.iter().flat_map(|place| self.index_of(&place.value));
        let kept = kept.flat_map(|arc| self.index_of(&arc.place.value).map(|p| (p, arc.weight)));
        kept.chain(overrun.map(|place| (place, 1))).collect()
    }

    fn fire(&mut self, moved: &TokenMove) {
        let TokenMove { inputs, outputs } = moved;
        let mut others = inputs.iter().enumerate();
        let can_fire = inputs.iter().all(|place| self.reached[*place])
            && others.all(|(n, place)| {
                inputs[n + 1..].iter().all(|other| other == place || self.pairs[*place][*other])
            });
        if !can_fire {
            return;
        }
        self.put(outputs);
        for place in 0..self.reached.len() {
            let stays = self.reached[place] && inputs.iter().all(|input| self.pairs[place][*input]);
            if stays {
                outputs.iter().for_each(|(output, _)| self.join(place, *output));
            }
        }
    }

    /// Marks places in one firing.
    fn put(&mut self, places: &[(usize, u32)]) {
        for (n, (place, tokens)) in places.iter().enumerate() {
            self.has_changed |= !std::mem::replace(&mut self.reached[*place], true);
            if *tokens > 1 {
                self.join(*place, *place);
            }
            places[n + 1..].iter().for_each(|(other, _)| self.join(*place, *other));
        }
    }

    fn join(&mut self, one: usize, other: usize) {
        self.has_changed |= !self.pairs[one][other];
        self.pairs[one][other] = true;
        self.pairs[other][one] = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read;

    fn together(mission: &str, pairs: &[(&str, &str, bool)]) {
        let file = format!("<armor version='1'><system/><mission>{mission}</mission></armor>");
        let reading = read("a.xml".as_ref(), &mut |_| Ok(file.clone().into_bytes()));
        let mission = reading.configuration.unwrap().mission.unwrap();
        let relation = PlaceConcurrency::of(&mission).unwrap();
        for (one, other, wanted) in pairs {
            assert_eq!(relation.may_be_together(one, other), *wanted, "{one} {other}");
            assert_eq!(relation.may_be_together(other, one), *wanted, "{other} {one}");
        }
    }

    #[test]
    fn one_token_marks_one_place_at_a_time() {
        together(
            "<place name='a' initial='true'/><place name='b'/><place name='c'/><place name='d'/>
             <transition name='t' from='a' to='b'/><transition name='u' from='b' to='a'/>
             <transition name='v' from='b' to='c'/><transition name='w' from='d' to='d'/>",
            &[("a", "b", false), ("b", "c", false), ("c", "c", true), ("d", "d", false)],
        );
    }

    #[test]
    fn branches_are_together_until_they_are_joined() {
        together(
            "<place name='a' initial='true'/><place name='b'/><place name='c'/><place name='d'/>
             <place name='e'/><place name='f'/>
             <transition name='t' from='a' to='b c'/><transition name='u' from='b' to='d'/>
             <transition name='v' from='c' to='e'/><transition name='w' from='d e' to='f'/>",
            &[("b", "c", true), ("b", "e", true), ("d", "e", true), ("b", "d", false)],
        );
        together(
            "<place name='a' initial='2'/><place name='b'/><transition name='t' from='a' to='b'/>",
            &[("a", "b", true)],
        );
        together(
            "<place name='a' initial='true'/><place name='b'/><place name='c'/>
             <transition name='t' to='b'><read place='a'/></transition>
             <transition name='u' from='b' to='c'/>",
            &[("a", "b", true), ("a", "c", true), ("b", "c", true)],
        );
    }
}
