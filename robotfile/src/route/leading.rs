//! Firings that lead to a step of a route and out of it by an exit: they show where a finding about a
//! drawing happens.

use std::collections::BTreeMap;

use crate::mission::{ArcKind, Mission, Transition};

/// Transitions that are tried before it is given up: a file may be large, and the way to a step of a
/// drawing is short.
const MAX_TRIALS: usize = 20_000;
/// Tokens that a start may have, and depth of places that wait for each other.
const MAX_DEPTH: usize = 2_000;

/// Returns names of transitions that fire one after the other from the start, the last of which takes a
/// token from `place` and puts one into `target`. None if no such firings are found: guards, times and
/// reports are ignored, so each of them is assumed to come.
pub(crate) fn find_firings(mission: &Mission, place: &str, target: &str) -> Option<Vec<String>> {
    let leaves = |transition: &&Transition| {
        transition.inputs().any(|arc| arc.place.value == place)
            && transition.outputs().any(|arc| arc.place.value == target)
    };
    let exit = mission.transitions.iter().find(leaves)?;
    let mut producers: BTreeMap<&str, Vec<&Transition>> = BTreeMap::new();
    for transition in &mission.transitions {
        for arc in transition.outputs() {
            producers.entry(arc.place.value.as_str()).or_default().push(transition);
        }
    }
    let tokens = mission.places.iter().filter(|place| place.initial > 0);
    let tokens = tokens.map(|place| (place.name.value.as_str(), place.initial)).collect();
    let mut search = Search { producers, left: MAX_TRIALS };
    let start = Played { tokens, firings: Vec::new() };
    let played = search.enable(exit, start, &mut Vec::new())?;
    let firings = played.fire(exit)?.firings;
    Some(firings.into_iter().map(|transition| transition.name.value.clone()).collect())
}

/// Where the tokens are after some firings.
#[derive(Clone)]
struct Played<'a> {
    tokens: BTreeMap<&'a str, u32>,
    firings: Vec<&'a Transition>,
}

impl<'a> Played<'a> {
    fn count(&self, place: &str) -> u32 {
        self.tokens.get(place).copied().unwrap_or(0)
    }

    /// After the transition; none if it is not enabled.
    fn fire(mut self, transition: &'a Transition) -> Option<Self> {
        for arc in &transition.arcs {
            let (here, weight) = (self.count(&arc.place.value), arc.weight);
            match arc.kind {
                ArcKind::Take | ArcKind::Read if here < weight => return None,
                ArcKind::Inhibitor if here >= weight => return None,
                _ => {}
            }
        }
        for arc in &transition.arcs {
            let here = self.tokens.entry(arc.place.value.as_str()).or_default();
            match arc.kind {
                ArcKind::Take => *here = here.checked_sub(arc.weight)?,
                ArcKind::Put => *here = here.checked_add(arc.weight)?,
                ArcKind::Reset => *here = 0,
                ArcKind::Read | ArcKind::Inhibitor => {}
            }
        }
        self.firings.push(transition);
        Some(self)
    }
}

struct Search<'a> {
    producers: BTreeMap<&'a str, Vec<&'a Transition>>,
    left: usize,
}

impl<'a> Search<'a> {
    /// Marks the places that a transition takes from or reads; `open` are the places that wait for this.
    fn enable(
        &mut self,
        transition: &'a Transition,
        mut played: Played<'a>,
        open: &mut Vec<&'a str>,
    ) -> Option<Played<'a>> {
        let needed = transition.arcs.iter();
        let needed = needed.filter(|arc| matches!(arc.kind, ArcKind::Take | ArcKind::Read));
        for arc in needed {
            while played.count(&arc.place.value) < arc.weight {
                played = self.mark(&arc.place.value, played, open)?;
            }
        }
        Some(played)
    }

    /// Puts one more token into a place, by the first transition of the file with which it is possible:
    /// that is the one by which a step ends as drawn.
    fn mark(
        &mut self,
        place: &'a str,
        played: Played<'a>,
        open: &mut Vec<&'a str>,
    ) -> Option<Played<'a>> {
        if open.contains(&place) || open.len() > MAX_DEPTH {
            return None;
        }
        open.push(place);
        let before = played.count(place);
        let producers = self.producers.get(place).cloned().unwrap_or_default();
        let found = producers.into_iter().find_map(|transition| {
            self.left = self.left.checked_sub(1)?;
            let enabled = self.enable(transition, played.clone(), open)?;
            enabled.fire(transition).filter(|after| after.count(place) > before)
        });
        open.pop();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two routes that meet twice; the exit of a leg behind the second meeting.
    const MEETING: &str = r#"<armor version="1"><system><component name="way" kind="patrol"/>
        <component name="own" kind="patrol"/></system><mission goal="over" safe="hold"><map>
        <point name="P0" at="0 0"/><point name="P1" at="9 0"/><rally name="R1" at="0 3"/></map>
        <route name="red" mover="way.route" start="P0" out="over"><leg name="l1" to="P1"/>
        <meet name="m1" with="blue" patience="9s"/><leg name="l2" to="P0"/>
        <meet name="m2" with="blue" patience="9s"/><leg name="l3" to="P1"/>
        <otherwise on="blocked late" do="rally"/></route>
        <route name="blue" mover="own.route" start="P1" in="ready" out="over"><stay name="s1" for="2s"/>
        <meet name="m1" with="red" patience="9s"/><leg name="b1" to="P0"/>
        <meet name="m2" with="red" patience="9s"/></route><place name="ready" initial="true"/>
        <place name="over"/><place name="hold"/></mission></armor>"#;

    fn mission(text: &str) -> Mission {
        let read = crate::read("a.xml".as_ref(), &mut |_| Ok(text.as_bytes().to_vec()));
        read.configuration.and_then(|it| it.mission).expect("a mission")
    }

    #[test]
    fn the_firings_of_other_routes_are_among_those_that_lead_to_a_step() {
        let mission = mission(MEETING);
        let firings = find_firings(&mission, "red.l3", "red.l3.to-R1").expect("it is reached");
        let expected = [
            "red.l1.done",
            "blue.begin",
            "blue.s1.done",
            "red.m1.met",
            "red.l2.done",
            "blue.b1.done",
            "red.m2.met",
            "red.l3.blocked",
        ];
        assert_eq!(firings, expected);
    }

    #[test]
    fn a_step_that_nothing_leads_to_has_no_firings() {
        let text = MEETING.replace(r#"name="ready" initial="true""#, r#"name="ready""#);
        assert_eq!(find_firings(&mission(&text), "red.l3", "red.l3.to-R1"), None);
        assert!(find_firings(&mission(&text), "red.l1", "red.l1.to-R1").is_some());
    }
}
