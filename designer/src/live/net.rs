//! The drawing of the net with the state of the mission: tokens, firings in flight, clocks.

use std::collections::BTreeMap;

use armor_inspect::words::{describe_enabled, format_duration, transition_clock};
use armor_marking::{EnabledTransition, FiringDecider, MarkedPlace, Marking};

use super::presence::{self, Presences};
use crate::canvas::{Badge, Diagram, DiagramNode, Mark, NodeShape, Outline};
use crate::item::Item;
use armor_picture::theme::ThemeColours;

/// Updates the drawing with the marking; `base` is the drawing without it, of the same nodes, and
/// `now_s` is mission time.
pub fn show(
    diagram: &mut Diagram<Item>,
    base: &Diagram<Item>,
    marking: &Marking,
    now_s: f64,
    presences: &Presences,
    colours: &ThemeColours,
) {
    let marked: BTreeMap<_, _> =
        marking.places.iter().map(|place| (place.place.as_str(), place)).collect();
    let clock_s = transition_clock(marking, now_s);
    for (node, plain) in diagram.nodes.iter_mut().zip(&base.nodes) {
        (node.look, node.mark, node.badge) = (plain.look, Mark::None, None);
        let word = match &plain.item {
            Item::Place(name) => {
                place(node, marked.get(name.as_str()).copied(), name, marking, colours)
            }
            Item::Transition(name) => {
                let enabled = marking.enabled.iter().find(|one| *name == one.transition);
                let now_s = enabled.map_or(now_s, |one| clock_s(one.held));
                transition(node, enabled, name, marking, now_s, colours)
            }
            Item::Submission(_) => inside(node, &plain.title, marking, colours),
            _ => continue,
        };
        node.label = format!("{}: {word}", plain.label);
        node.doc = format!("{word}\n{}", plain.doc);
    }
    mark_presences(diagram, base, presences, colours);
}

/// Marks what only the text or only the version that runs has, after its state was drawn.
pub fn mark_presences(
    diagram: &mut Diagram<Item>,
    base: &Diagram<Item>,
    presences: &Presences,
    colours: &ThemeColours,
) {
    for (node, plain) in diagram.nodes.iter_mut().zip(&base.nodes) {
        if let Some(presence) = presences.get(&plain.label) {
            presence::mark_node(node, plain, presence, false, colours);
        }
    }
    for (wire, plain) in diagram.wires.iter_mut().zip(&base.wires) {
        if let Some(presence) = presences.get(&plain.label) {
            wire.clone_from(plain);
            presence::mark_wire(wire, plain, presence, colours);
        }
    }
}

fn place(
    node: &mut DiagramNode<Item>,
    place: Option<&MarkedPlace>,
    name: &str,
    marking: &Marking,
    colours: &ThemeColours,
) -> String {
    if let NodeShape::Place { tokens, .. } = &mut node.shape {
        *tokens = place.map_or(0, |place| place.tokens);
    }
    let comes = marking.in_flight.iter().any(|flight| flight.to.iter().any(|to| to == name));
    let (tint, outline, word) = match place {
        Some(place) if place.active || marking.pause.is_some() => {
            (Some(colours.good), Outline::Strong, "marked")
        }
        Some(_) => {
            let word = "marked; not all of its components are running yet";
            (Some(colours.warning), Outline::Strong, word)
        }
        None if comes => (Some(colours.warning), Outline::Dashed, "a token is arriving"),
        None => (None, Outline::Plain, "not marked"),
    };
    (node.look.tint, node.look.outline) = (tint, outline);
    node.look.is_dim = tint.is_none();
    word.into()
}

fn transition(
    node: &mut DiagramNode<Item>,
    enabled: Option<&EnabledTransition>,
    name: &str,
    marking: &Marking,
    now_s: f64,
    colours: &ThemeColours,
) -> String {
    let flies = marking.in_flight.iter().any(|flight| flight.cause == name);
    let asks = marking.confirmations.iter().any(|asked| asked.transition == name);
    let (tint, badge, word) = match enabled {
        _ if flies => (Some(colours.good), Some("fires".to_owned()), "fires".to_owned()),
        _ if asks => (Some(colours.warning), Some("asks".into()), "asks for confirmation".into()),
        Some(enabled) => {
            let left_s = enabled.earliest_at_s - now_s;
            let badge = match enabled.by {
                _ if left_s > 0.0 => format!("in {}", format_duration(left_s)),
                FiringDecider::Operator => "by operator".into(),
                FiringDecider::Mission | FiringDecider::Confirmation | FiringDecider::Declined => {
                    "waits".into()
                }
            };
            (Some(colours.accent), Some(badge), describe_enabled(enabled, now_s))
        }
        None => (None, None, "not enabled".into()),
    };
    node.badge = badge.map(|text| Badge { text, doc: word.clone(), tint });
    node.look.tint = tint;
    node.look.outline = if tint.is_some() { Outline::Strong } else { Outline::Plain };
    node.look.is_dim = tint.is_none();
    word
}

/// The tokens in the places of a sub-mission.
fn inside(
    node: &mut DiagramNode<Item>,
    mission: &str,
    marking: &Marking,
    colours: &ThemeColours,
) -> String {
    let own = marking
        .places
        .iter()
        .filter(|place| place.place.split_once('.').is_some_and(|(outer, _)| outer == mission));
    let own: Vec<_> = own.map(|place| place.place.as_str()).collect();
    if own.is_empty() {
        return "no tokens inside".into();
    }
    node.look.tint = Some(colours.good);
    node.look.outline = Outline::Strong;
    let doc = format!("tokens in {}", own.join(", "));
    let (text, tint) = (own.len().to_string(), node.look.tint);
    node.badge = Some(Badge { text, doc: doc.clone(), tint });
    doc
}
