//! The arcs of the drawing.

use std::collections::BTreeMap;

use armor_robotfile::mission::{Arc, ArcKind, Transition};

use super::{IN, OUT, Scene, WHOLE};
use crate::canvas::{DiagramNode, Mark, PortAt, Wire, WireEnd};
use crate::item::Item;

impl Scene<'_> {
    pub(super) fn wires(&self, nodes: &[DiagramNode<Item>]) -> Vec<Wire<Item>> {
        let numbers: BTreeMap<_, _> =
            nodes.iter().enumerate().map(|(number, node)| (node.item, number)).collect();
        let mut wires = Vec::new();
        for transition in &self.mission.transitions {
            let own = Item::transition(&transition.name.value);
            let Some(own) = numbers.get(&own) else { continue };
            for arc in &transition.arcs {
                let place = Item::place(&arc.place.value);
                // The check reports an arc to a place that does not exist.
                if let Some(place) = numbers.get(&place) {
                    let is_left = nodes[*place].rect.center().x < nodes[*own].rect.center().x;
                    wires.push(self.arc(transition, arc, (*own, *place), is_left));
                }
            }
        }
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
    /// or another arc joins the same two.
    fn arc(
        &self,
        transition: &Transition,
        arc: &Arc,
        (own, place): (usize, usize),
        is_left: bool,
    ) -> Wire<Item> {
        let name = &transition.name.value;
        let item = Item::arc(name, &arc.place.value, arc.kind);
        let others = transition.arcs.iter().filter(|other| other.place.value == arc.place.value);
        let is_pair = others.count() > 1;
        let port = |port: usize| {
            let is_ahead = is_left == (port == IN);
            if is_pair || is_ahead { port } else { WHOLE }
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
