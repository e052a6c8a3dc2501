//! The tooltip of what the pointer rests on: the state of a block, the last values on a link.

use super::systems::component_of;
use super::values;
use super::watched::Watched;
use super::words::printable;
use crate::canvas::{CanvasOutput, Diagram, Direction, Hit, PortAt};
use crate::item::Item;

/// Shows the tooltip. It subscribes to data only while it shows their values.
pub fn show_tooltip(
    shown: &CanvasOutput<Item>,
    diagram: &Diagram<Item>,
    watched: Option<&Watched>,
) {
    let (Some(watched), Some(hit)) = (watched, shown.hovered) else { return };
    let Some((data, doc)) = about(diagram, hit) else { return };
    shown.response.clone().on_hover_ui_at_pointer(|ui| {
        if let Some(data) = &data {
            ui.strong(data);
            ui.monospace(printable(ui, &values::in_brief(&watched.values.look(data))));
            ui.weak(printable(ui, doc));
        } else {
            ui.label(printable(ui, doc));
        }
    });
}

/// Returns the data there, and the description of the item.
fn about(diagram: &Diagram<Item>, hit: Hit) -> Option<(Option<String>, &str)> {
    Some(match hit {
        Hit::Wire(number) => {
            let wire = diagram.wires.get(number)?;
            (data_on(&wire.item), &wire.doc)
        }
        Hit::Port(at) => (Some(data_at(diagram, at)?), &diagram.port(at)?.doc),
        Hit::Node(number) => (None, &diagram.nodes.get(number)?.doc),
        Hit::Grip { .. } | Hit::Decoration(_) | Hit::Corner(_) => return None,
    })
}

/// The data of an output, or those that feed an input.
fn data_at(diagram: &Diagram<Item>, at: PortAt) -> Option<String> {
    let mut wires = diagram.wires.iter().filter(|wire| wire.from == at || wire.to == at);
    if let Some(data) = wires.find_map(|wire| data_on(&wire.item)) {
        return Some(data);
    }
    let (node, port) = (diagram.nodes.get(at.node)?, diagram.port(at)?);
    let component = component_of(&node.item)?;
    (port.direction == Direction::Out).then(|| format!("{component}.{}", port.name))
}

fn data_on(item: &Item) -> Option<String> {
    match item {
        Item::Link { from, .. } => Some(from.to_string()),
        _ => None,
    }
}
