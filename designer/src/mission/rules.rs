//! What may be joined in a net, and why not: the drawing asks before it draws, and shows the
//! answer next to the pointer.

use armor_robotfile::mission::{ArcKind, Mission};

/// An end of an arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End<'a> {
    /// A place of this file.
    Place(&'a str),
    /// A transition of this file.
    Transition(&'a str),
    /// A sub-mission, by its number.
    Submission(usize),
}

/// What is drawn when two ends are joined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Join {
    /// An arc of a transition.
    Arc {
        /// The transition.
        transition: String,
        /// The place.
        place: String,
        /// What it does.
        kind: ArcKind,
    },
    /// A transition between two places, with both arcs.
    Transition {
        /// Taken from.
        from: String,
        /// Put into.
        to: String,
    },
    /// A place between two transitions, with both arcs.
    Place {
        /// Puts into it.
        from: String,
        /// Takes from it.
        to: String,
    },
    /// The place that enters a sub-mission.
    Enter {
        /// The sub-mission's number.
        submission: usize,
        /// The place.
        place: String,
    },
    /// The place that a sub-mission leaves to.
    Leave {
        /// The sub-mission's number.
        submission: usize,
        /// The place.
        place: String,
    },
}

/// What comes of drawing from one end to another, with arcs of this kind between a place and a
/// transition where both kinds are possible.
///
/// # Errors
/// Why it may not be drawn.
pub fn join(mission: &Mission, from: End<'_>, to: End<'_>, kind: ArcKind) -> Result<Join, String> {
    match (from, to) {
        (End::Place(place), End::Transition(transition)) => {
            // Drawn from a place, an arc cannot be one that puts.
            let kind = if kind == ArcKind::Put { ArcKind::Take } else { kind };
            arc(mission, transition, place, kind)
        }
        (End::Transition(transition), End::Place(place)) => {
            arc(mission, transition, place, ArcKind::Put)
        }
        (End::Place(one), End::Place(other)) => {
            Ok(Join::Transition { from: one.into(), to: other.into() })
        }
        (End::Transition(one), End::Transition(other)) if one == other => {
            Err("an arc connects a place and a transition".into())
        }
        (End::Transition(one), End::Transition(other)) => {
            Ok(Join::Place { from: one.into(), to: other.into() })
        }
        (End::Place(place), End::Submission(number)) => enter(mission, number, place),
        (End::Submission(number), End::Place(place)) => leave(mission, number, place),
        (End::Submission(_), _) | (_, End::Submission(_)) => {
            Err("a sub-mission is connected only to places".into())
        }
    }
}

/// The transition and the place of an arc of a kind that is led from one end to another.
///
/// # Errors
/// Why it may not be.
pub fn lead<'a>(
    mission: &Mission,
    stays: End<'a>,
    to: End<'a>,
    kind: ArcKind,
) -> Result<(&'a str, &'a str), String> {
    let (transition, place) = match (stays, to) {
        (End::Place(place), End::Transition(transition))
        | (End::Transition(transition), End::Place(place)) => (transition, place),
        _ => return Err("an arc has a place at one end and a transition at the other".into()),
    };
    arc(mission, transition, place, kind)?;
    Ok((transition, place))
}

fn enter(mission: &Mission, submission: usize, place: &str) -> Result<Join, String> {
    let known = mission.submissions.get(submission).and_then(|known| known.enter.as_ref());
    match known {
        Some(known) if known.value == place => Err(format!("{place} already enters it")),
        _ => Ok(Join::Enter { submission, place: place.into() }),
    }
}

fn leave(mission: &Mission, submission: usize, place: &str) -> Result<Join, String> {
    let known = mission.submissions.get(submission).and_then(|known| known.leave.as_ref());
    match known {
        Some(known) if known.value == place => Err(format!("it already leaves to {place}")),
        _ => Ok(Join::Leave { submission, place: place.into() }),
    }
}

fn arc(mission: &Mission, transition: &str, place: &str, kind: ArcKind) -> Result<Join, String> {
    let arcs = mission.transitions.iter().find(|t| t.name.value == transition);
    let mut arcs = arcs.into_iter().flat_map(|transition| &transition.arcs);
    if arcs.any(|arc| arc.kind == kind && arc.place.value == place) {
        let verb = match kind {
            ArcKind::Take => "takes from",
            ArcKind::Put => "puts into",
            ArcKind::Read => "reads",
            ArcKind::Inhibitor => "is inhibited by",
            ArcKind::Reset => "empties",
        };
        return Err(format!("{transition} {verb} {place} already; change the arc's weight"));
    }
    Ok(Join::Arc { transition: transition.into(), place: place.into(), kind })
}

/// Why an arc between these two cannot have this weight, if it cannot.
pub fn weight_refused(
    mission: &Mission,
    place: &str,
    kind: ArcKind,
    weight: u32,
) -> Option<String> {
    let is_active = mission.place(place).is_some_and(|place| !place.components.is_empty());
    match kind {
        _ if weight == 0 => Some("an arc of weight 0 does nothing: remove it".into()),
        ArcKind::Reset if weight > 1 => Some("a reset arc takes all tokens".into()),
        ArcKind::Take | ArcKind::Put | ArcKind::Read if weight > 1 && is_active => Some(format!(
            "{place} activates components, so it has at most one token: count in a place without components"
        )),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mission() -> Mission {
        let file = r#"<armor version="1"><system><component name="c" kind="k"/></system>
            <mission><place name="a" initial="true" components="c"/><place name="b"/>
            <transition name="t" from="a" to="b"/><transition name="u" from="b" to="a"/>
            <submission ref="x.xml" in="a" out="b"/></mission></armor>"#;
        crate::mission::read_text(file).mission.unwrap()
    }

    #[test]
    fn arcs_join_places_and_transitions_once_and_others_get_something_between() {
        use ArcKind::{Inhibitor, Put, Take};
        use End::{Place, Submission, Transition};
        let mission = mission();
        let arc = |transition: &str, place: &str, kind| {
            Ok(Join::Arc { transition: transition.into(), place: place.into(), kind })
        };
        let check = |from, to, kind, expected: Result<Join, &str>| {
            assert_eq!(join(&mission, from, to, kind), expected.map_err(str::to_owned));
        };
        check(Place("b"), Transition("t"), Take, arc("t", "b", Take));
        check(Place("b"), Transition("t"), Put, arc("t", "b", Take));
        check(Place("a"), Transition("t"), Inhibitor, arc("t", "a", Inhibitor));
        check(Transition("t"), Place("a"), Take, arc("t", "a", Put));
        let already = "t takes from a already; change the arc's weight";
        check(Place("a"), Transition("t"), Take, Err(already));
        let between = Join::Transition { from: "a".into(), to: "b".into() };
        check(Place("a"), Place("b"), Take, Ok(between));
        let between = Join::Place { from: "t".into(), to: "u".into() };
        check(Transition("t"), Transition("u"), Take, Ok(between));
        check(Place("a"), Submission(0), Take, Err("a already enters it"));
        let enters = Join::Enter { submission: 0, place: "b".into() };
        check(Place("b"), Submission(0), Take, Ok(enters));
        let led = |stays, to, kind| lead(&mission, stays, to, kind);
        assert_eq!(led(Place("a"), Transition("u"), Take), Ok(("u", "a")));
        assert_eq!(led(Place("a"), Transition("t"), Put), Ok(("t", "a")));
        assert_eq!(led(Transition("t"), Place("a"), Take), Err(already.to_owned()));
        let why = "an arc has a place at one end and a transition at the other";
        assert_eq!(led(Place("a"), Place("b"), Take), Err(why.to_owned()));
        let why = "a sub-mission is connected only to places";
        check(Transition("t"), Submission(0), Take, Err(why));
    }

    #[test]
    fn places_with_components_hold_one_token() {
        let refused = |place, kind, weight| weight_refused(&mission(), place, kind, weight);
        assert!(refused("a", ArcKind::Take, 2).is_some());
        assert_eq!(refused("b", ArcKind::Take, 2), None);
        assert_eq!(refused("a", ArcKind::Inhibitor, 2), None);
        assert!(
            refused("b", ArcKind::Reset, 2).is_some() && refused("b", ArcKind::Put, 0).is_some()
        );
    }
}
