//! Places that are marked whenever another one is, as the two ends of a fork are while both branches
//! wait. It is shown by a sum of tokens that no firing makes negative; where none is found, nothing is
//! known.

use std::collections::BTreeSet;

use crate::check::reach::find_reached;
use crate::mission::{ArcKind, Mission, Transition};

/// What a transition, a failure or a sub-mission takes and puts.
struct Move<'a> {
    taken: Vec<(&'a str, i64)>,
    put: Vec<(&'a str, i64)>,
    emptied: Vec<&'a str>,
}

/// Returns whether `companion` certainly has a token whenever `place` has one.
///
/// Its tokens are at least as many as those in a set of places with `place` in it: the set begins with
/// this place, and grows by a place from which a firing takes a token that would break the sum.
pub(super) fn accompanies(mission: &Mission, place: &str, companion: &str) -> bool {
    if !find_reached(mission, &[], None).contains(place) {
        return false;
    }
    let moves = list_moves(mission);
    let mut set = BTreeSet::from([place]);
    if place == companion || moves.iter().any(|it| it.emptied.contains(&companion)) {
        return false;
    }
    let sum = |arcs: &[(&str, i64)], is_in: &dyn Fn(&str) -> bool| -> i64 {
        arcs.iter().filter(|arc| is_in(arc.0)).map(|arc| arc.1).sum()
    };
    loop {
        let is_in_set = |name: &str| set.contains(name);
        let is_companion = |name: &str| name == companion;
        let grows = |it: &&Move<'_>| {
            let set = sum(&it.put, &is_in_set) - sum(&it.taken, &is_in_set);
            sum(&it.put, &is_companion) - sum(&it.taken, &is_companion) < set
        };
        let Some(broken) = moves.iter().find(grows) else { break };
        let mut others = broken.taken.iter().map(|arc| arc.0);
        let Some(other) = others.find(|it| !set.contains(it) && *it != companion) else {
            return false;
        };
        set.insert(other);
    }
    let tokens = |name: &str| mission.place(name).map_or(0, |place| i64::from(place.initial));
    tokens(companion) >= set.iter().map(|name| tokens(name)).sum()
}

fn list_moves(mission: &Mission) -> Vec<Move<'_>> {
    let mut moves = Vec::new();
    for transition in &mission.transitions {
        let taken = || weighted(transition, ArcKind::Take);
        let emptied: Vec<_> =
            weighted(transition, ArcKind::Reset).into_iter().map(|arc| arc.0).collect();
        let of = |put| Move { taken: taken(), put, emptied: emptied.clone() };
        moves.push(of(weighted(transition, ArcKind::Put)));
        let refuges = [&transition.on_stop_fail, &transition.on_start_fail, &transition.overrun];
        moves.extend(refuges.into_iter().flatten().map(|it| of(vec![(it.value.as_str(), 1)])));
    }
    let alone = |taken, put| Move { taken, put, emptied: Vec::new() };
    for place in &mission.places {
        if let Some(refuge) = &place.on_failure {
            moves.push(alone(vec![(place.name.value.as_str(), 1)], vec![(&refuge.value, 1)]));
        }
    }
    for submission in &mission.submissions {
        let [enter, leave] = [&submission.enter, &submission.leave]
            .map(|it| it.iter().map(|place| (place.value.as_str(), 1)).collect::<Vec<_>>());
        // Between the two it has the token.
        moves.push(alone(enter, Vec::new()));
        moves.push(alone(Vec::new(), leave));
    }
    moves
}

fn weighted(transition: &Transition, kind: ArcKind) -> Vec<(&str, i64)> {
    let arcs = transition.arcs.iter().filter(|arc| arc.kind == kind);
    arcs.map(|arc| (arc.place.value.as_str(), i64::from(arc.weight))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read;

    /// A fork to two branches, of which the first has two places, and a join.
    fn forked(inner: &str) -> Mission {
        let file = format!(
            r#"<armor version="1"><system><component name="c" kind="k"/></system><mission goal="over"><place name="start" initial="true"/><place name="first"/><place name="second"/><place name="aside"/><place name="other"/><place name="over"/><transition name="fork" from="start" to="first other"/><transition name="next" from="first" to="second"/><transition name="back" from="second" to="first"/><transition name="join" from="second other" to="over"/>{inner}</mission></armor>"#
        );
        let reading = read("a.xml".as_ref(), &mut |path| match path.ends_with("a.xml") {
            true => Ok(file.clone().into()),
            false => Err(std::io::ErrorKind::NotFound.into()),
        });
        reading.configuration.and_then(|it| it.mission).expect("a mission")
    }

    #[test]
    fn a_branch_accompanies_the_places_of_the_other_one() {
        let mission = forked("");
        assert!(accompanies(&mission, "first", "other"));
        assert!(accompanies(&mission, "second", "other"));
        // The other branch may be in either of the two.
        assert!(!accompanies(&mission, "other", "first"));
        assert!(!accompanies(&mission, "start", "other"));
        assert!(!accompanies(&mission, "over", "other"));
        // Nothing is known of a place that is never marked.
        assert!(!accompanies(&mission, "aside", "other"));
    }

    #[test]
    fn a_branch_that_may_end_alone_accompanies_nothing() {
        for inner in [
            r#"<transition name="t" from="other" to="aside"/>"#,
            r#"<transition name="t" from="start" to="first"/>"#,
            r#"<transition name="t" to="first"/>"#,
            r#"<transition name="t" from="first" to="first"><reset place="other"/></transition>"#,
            r#"<submission ref="b.xml" in="other" out="aside"/>"#,
        ] {
            assert!(!accompanies(&forked(inner), "first", "other"), "{inner}");
        }
        let aside = r#"<transition name="t" from="first" to="aside"/>"#;
        let mission = forked(aside);
        assert!(accompanies(&mission, "first", "other"));
        let join = r#"<transition name="j" from="aside other" to="over"/>"#;
        assert!(accompanies(&forked(&format!("{aside}{join}")), "aside", "other"));
    }
}
