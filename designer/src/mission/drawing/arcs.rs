//! The arcs of the drawing.

use std::collections::BTreeMap;

use armor_robotfile::mission::{Arc, ArcKind, Transition};

use super::scene::Scene;
use super::steps::RouteSteps;
use super::{IN, OUT, WHOLE};
use crate::canvas::{DiagramNode, Mark, PortAt, Wire, WireEnd};
use crate::item::Item;

impl Scene<'_> {
    pub(super) fn wires(
        &self,
        nodes: &[DiagramNode<Item>],
        steps: &RouteSteps<'_>,
    ) -> Vec<Wire<Item>> {
        let numbers: BTreeMap<_, _> =
            nodes.iter().enumerate().map(|(number, node)| (node.item, number)).collect();
        let mut wires = Vec::new();
        let mut of_steps: BTreeMap<(usize, usize), Vec<Wire<Item>>> = BTreeMap::new();
        for transition in &self.mission.transitions {
            let own = Item::transition(&transition.name.value);
            let Some(own) = steps.number(&own, &numbers) else { continue };
            for arc in &transition.arcs {
                let place = Item::place(&arc.place.value);
                // The check reports an arc to a place that does not exist.
                let Some(place) = steps.number(&place, &numbers) else { continue };
                let is_left = nodes[place].rect.center().x < nodes[own].rect.center().x;
                let is_step = |node: usize| matches!(nodes[node].item, Item::Step { .. });
                if is_step(own) || is_step(place) {
                    if own != place {
                        let wire = self.arc(transition, arc, (own, place), None);
                        of_steps.entry((wire.from.node, wire.to.node)).or_default().push(wire);
                    }
                } else {
                    wires.push(self.arc(transition, arc, (own, place), Some(is_left)));
                }
            }
        }
        wires.extend(of_steps.into_values().filter_map(|wires| as_one(nodes, wires)));
        for (number, submission) in self.mission.submissions.iter().enumerate() {
            let Some(own) = numbers.get(&Item::Submission(number)) else { continue };
            let ends = [(&submission.enter, true), (&submission.leave, false)];
            for (place, enters) in ends {
                let place = place.as_ref().map(|place| Item::place(&place.value));
                if let Some(place) = place.as_ref().and_then(|place| numbers.get(place)) {
                    wires.push(of_submission(number, *own, *place, enters));
                }
            }
        }
        wires
    }

    /// Arcs enter a bar at its left edge and leave it at its right one, if that is the shorter way
    /// or another arc joins the same two. `is_left` is none at a folded step, which has no edges.
    fn arc(
        &self,
        transition: &Transition,
        arc: &Arc,
        (own, place): (usize, usize),
        is_left: Option<bool>,
    ) -> Wire<Item> {
        let name = &transition.name.value;
        let item = Item::arc(name, &arc.place.value, arc.kind);
        let others = transition.arcs.iter().filter(|other| other.place.value == arc.place.value);
        let is_pair = others.count() > 1;
        let port = |port: usize| match is_left {
            None => WHOLE,
            Some(is_left) if is_pair || is_left == (port == IN) => port,
            Some(_) => WHOLE,
        };
        let at = |node, port| PortAt { node, port };
        let (from, to, end) = match arc.kind {
            ArcKind::Take => (at(place, WHOLE), at(own, port(IN)), WireEnd::Arrow),
            ArcKind::Put => (at(own, port(OUT)), at(place, WHOLE), WireEnd::Arrow),
            ArcKind::Read => (at(place, WHOLE), at(own, WHOLE), WireEnd::Plain),
            ArcKind::Inhibitor => (at(place, WHOLE), at(own, WHOLE), WireEnd::Circle),
            ArcKind::Reset => (at(place, WHOLE), at(own, port(IN)), WireEnd::Double),
        };
        let text = match arc.weight {
            1 => String::new(),
            weight => weight.to_string(),
        };
        Wire {
            label: item.to_string(),
            doc: arc_doc(name, arc),
            item,
            from,
            to,
            end,
            text,
            is_dashed: matches!(arc.kind, ArcKind::Read | ArcKind::Inhibitor),
            is_strong: false,
            is_led: true,
            tint: None,
            mark: Mark::None,
        }
    }
}

/// The arcs of a folded step from or to one node, as one line.
fn as_one(nodes: &[DiagramNode<Item>], wires: Vec<Wire<Item>>) -> Option<Wire<Item>> {
    let count = wires.len();
    let is_dashed = wires.iter().all(|wire| wire.is_dashed);
    let docs: Vec<_> = wires.iter().map(|wire| wire.doc.clone()).collect();
    let one = wires.into_iter().next()?;
    let title = |at: PortAt| nodes[at.node].title.as_str();
    let label = match count {
        1 => one.label.clone(),
        _ => format!("{count} arcs from {} to {}", title(one.from), title(one.to)),
    };
    let text = if count > 1 { format!("{count} arcs") } else { one.text.clone() };
    Some(Wire { label, text, is_dashed, is_led: false, doc: docs.join("\n"), ..one })
}

fn arc_doc(transition: &str, arc: &Arc) -> String {
    let (place, weight) = (&arc.place.value, arc.weight);
    let tokens = if weight == 1 { "a token".to_owned() } else { format!("{weight} tokens") };
    match arc.kind {
        ArcKind::Take => format!("{transition} takes {tokens} from {place}"),
        ArcKind::Put => format!("{transition} puts {tokens} into {place}"),
        ArcKind::Read => format!("{transition} needs {tokens} in {place}, and leaves it there"),
        ArcKind::Inhibitor if weight == 1 => format!("{transition} waits while {place} is marked"),
        ArcKind::Inhibitor => format!("{transition} waits while {place} holds {tokens} or more"),
        ArcKind::Reset => format!("{transition} takes all tokens from {place}"),
    }
}

fn of_submission(number: usize, own: usize, place: usize, enters: bool) -> Wire<Item> {
    let (own, place) = (PortAt { node: own, port: WHOLE }, PortAt { node: place, port: WHOLE });
    let (from, to) = if enters { (place, own) } else { (own, place) };
    let word = if enters { "in" } else { "out" };
    Wire {
        item: Item::Submission(number),
        from,
        to,
        end: WireEnd::Arrow,
        text: word.into(),
        is_dashed: false,
        is_strong: true,
        is_led: false,
        tint: None,
        mark: Mark::None,
        label: format!("{word} of sub-mission {}", number + 1),
        doc: String::new(),
    }
}
