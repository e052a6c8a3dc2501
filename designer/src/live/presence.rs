//! The drawing of what runs, over that of the text on the screen: what only one of them has is
//! drawn too, and marked.

use std::collections::BTreeMap;

use armor_robotfile::{Configuration, Difference, Subject, differences};
use eframe::egui::{Rect, vec2};

use crate::canvas::{Badge, Diagram, DiagramNode, Outline, PortAt, PortSide, Wire};
use crate::item::Item;
use armor_picture::theme::ThemeColours;

/// Space between a removed block and what it would cover.
const GAP: f32 = 30.0;
/// From port to port of a block that gets the ports of both versions.
const PORT_STEP: f32 = 20.0;

/// Which of the two has an item that is not the same in both.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Presence {
    /// Only the text: it does not run.
    OnlyText,
    /// Only the version that runs.
    OnlyRunning,
    /// Both, with these differences.
    Differs(Vec<String>),
}

impl Presence {
    /// What the drawing states of it.
    pub fn words(&self) -> &'static str {
        match self {
            Self::OnlyText => "not running: only in the text",
            Self::OnlyRunning => "removed in the text",
            Self::Differs(_) => "differs in the text",
        }
    }

    fn badge(&self) -> &'static str {
        match self {
            Self::OnlyText => "not running",
            Self::OnlyRunning => "removed",
            Self::Differs(_) => "differs",
        }
    }
}

/// What is not the same in both, by the names of the drawings.
pub type Presences = BTreeMap<String, Presence>;

/// Draws the text over what runs: what both have is that of the version that runs, at the position
/// that it has in the text.
pub fn merge(running: Diagram<Item>, text: Diagram<Item>) -> (Diagram<Item>, Presences) {
    let mut presences = Presences::new();
    let numbers: BTreeMap<_, _> =
        running.nodes.iter().enumerate().map(|(n, node)| (node.label.clone(), n)).collect();
    let mut nodes = Vec::new();
    for node in &text.nodes {
        match numbers.get(&node.label) {
            Some(n) => nodes.push(united(&running.nodes[*n], node)),
            None => {
                presences.insert(node.label.clone(), Presence::OnlyText);
                nodes.push(node.clone());
            }
        }
    }
    for node in &running.nodes {
        if !nodes.iter().any(|known: &DiagramNode<Item>| known.label == node.label) {
            presences.insert(node.label.clone(), Presence::OnlyRunning);
            let mut node = node.clone();
            node.rect = free_area(node.rect, &nodes);
            nodes.push(node);
        }
    }
    let mut wires = Vec::new();
    for wire in &running.wires {
        let in_text = text.wires.iter().any(|other| other.label == wire.label);
        let Some(wire) = led(wire, &running, &nodes) else { continue };
        if !in_text {
            presences.insert(wire.label.clone(), Presence::OnlyRunning);
        }
        wires.push(wire);
    }
    for wire in &text.wires {
        if wires.iter().any(|other: &Wire<Item>| other.label == wire.label) {
            continue;
        }
        let Some(wire) = led(wire, &text, &nodes) else { continue };
        presences.insert(wire.label.clone(), Presence::OnlyText);
        wires.push(wire);
    }
    (Diagram::new(nodes, wires, text.decorations), presences)
}

/// A node of the version that runs, where the text has it, with the ports of both.
fn united(running: &DiagramNode<Item>, text: &DiagramNode<Item>) -> DiagramNode<Item> {
    let mut node = running.clone();
    node.rect = Rect::from_min_size(text.rect.min, running.rect.size());
    for port in &text.ports {
        if port_number(&node, &port.label).is_some() || port.label.is_empty() {
            continue;
        }
        let same_side = node.ports.iter().filter(|other| other.side == port.side);
        let lowest = same_side.map(|other| other.at.y).fold(40.0, f32::max);
        let mut port = port.clone();
        let x = if port.side == PortSide::Right { node.rect.width() } else { 0.0 };
        port.at = vec2(x, lowest + PORT_STEP);
        let height = node.rect.height().max(port.at.y + PORT_STEP);
        node.rect.set_height(height);
        node.ports.push(port);
    }
    node
}

/// The same wire between the nodes of the common drawing.
fn led(wire: &Wire<Item>, of: &Diagram<Item>, nodes: &[DiagramNode<Item>]) -> Option<Wire<Item>> {
    let end = |at: PortAt| {
        let (node, port) = (of.nodes.get(at.node)?, of.port(at)?);
        let number = nodes.iter().position(|other| other.label == node.label)?;
        let port =
            if port.label.is_empty() { at.port } else { port_number(&nodes[number], &port.label)? };
        Some(PortAt { node: number, port })
    };
    Some(Wire { from: end(wire.from)?, to: end(wire.to)?, ..wire.clone() })
}

fn port_number(node: &DiagramNode<Item>, label: &str) -> Option<usize> {
    node.ports.iter().position(|port| port.label == label)
}

/// The area moved down until it covers no other node.
fn free_area(area: Rect, nodes: &[DiagramNode<Item>]) -> Rect {
    let mut area = area;
    while let Some(covered) = nodes.iter().find(|node| node.area().intersects(area)) {
        area = area.translate(vec2(0.0, covered.area().bottom() + GAP - area.top()));
    }
    area
}

/// The differences from what runs to the text, and of which items of the drawings they are.
pub fn compare(
    system: &Configuration,
    mission: &Configuration,
    text: &Configuration,
) -> Vec<Difference> {
    let is_of_mission = |difference: &Difference| difference.subject >= Subject::Mission;
    let of_system = differences(system, text).into_iter().filter(|it| !is_of_mission(it));
    of_system.chain(differences(mission, text).into_iter().filter(is_of_mission)).collect()
}

/// Marks the items that differ in both versions.
pub fn add_differences(presences: &mut Presences, found: &[Difference]) {
    for difference in found {
        let name = match difference.subject {
            Subject::Component => difference.name.as_str(),
            // A component has no point in its name.
            Subject::Parameter => difference.name.split('.').next().unwrap_or_default(),
            _ => difference.name.as_str(),
        };
        let label = match difference.subject {
            Subject::Component | Subject::Parameter => Item::component(name).to_string(),
            Subject::Place => Item::place(name).to_string(),
            Subject::Transition => Item::transition(name).to_string(),
            _ => continue,
        };
        let words = difference.to_string();
        match presences.entry(label).or_insert_with(|| Presence::Differs(Vec::new())) {
            Presence::Differs(all) => all.push(words),
            Presence::OnlyText | Presence::OnlyRunning => {}
        }
    }
}

/// Marks a node, after its state was drawn. One that is only in the text has no state, unless a
/// process of its name was seen.
pub fn mark_node(
    node: &mut DiagramNode<Item>,
    plain: &DiagramNode<Item>,
    presence: &Presence,
    is_seen: bool,
    colours: &ThemeColours,
) {
    let words = presence.words();
    match presence {
        Presence::OnlyText if !is_seen => {
            node.clone_from(plain);
            (node.look.outline, node.look.is_dim) = (Outline::Dashed, true);
            node.label = format!("{}: {words}", plain.label);
            node.badge = None;
        }
        _ => node.label = format!("{}, {words}", node.label),
    }
    let tint = match presence {
        Presence::OnlyText => colours.weak,
        _ => colours.warning,
    };
    let before = node.badge.take().map(|badge| format!("{}, ", badge.text)).unwrap_or_default();
    let text = format!("{before}{}", presence.badge());
    node.badge = Some(Badge { text, doc: words.into(), tint: Some(tint) });
    let detail = match presence {
        Presence::Differs(all) => all.join("\n"),
        _ => String::new(),
    };
    node.doc = format!("{words}\n{detail}\n{}", node.doc).replace("\n\n", "\n");
}

/// Marks a wire, after its state was drawn.
pub fn mark_wire(
    wire: &mut Wire<Item>,
    plain: &Wire<Item>,
    presence: &Presence,
    colours: &ThemeColours,
) {
    let words = presence.words();
    match presence {
        Presence::OnlyText => {
            wire.clone_from(plain);
            (wire.is_dashed, wire.is_strong, wire.tint) = (true, false, Some(colours.weak));
            wire.label = format!("{}: {words}", plain.label);
            wire.text = presence.badge().into();
        }
        Presence::OnlyRunning | Presence::Differs(_) => {
            let comma = if wire.text.is_empty() { "" } else { ", " };
            wire.text = format!("{}{comma}{}", wire.text, presence.badge());
            wire.label = format!("{}, {words}", wire.label);
        }
    }
    wire.doc = format!("{words}\n{}", wire.doc);
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use eframe::egui::Vec2;

    use super::*;
    use crate::project::Project;
    use crate::system::draw;

    fn drawn(text: &str) -> (Diagram<Item>, Project) {
        let project = Project::still(&[("a.xml".into(), text.to_owned())], Arc::default());
        (draw(&project).diagram, project)
    }

    const RUNS: &str = r#"<armor version="1"><system name="s">
        <component name="a" kind="k"><parameter name="p" value="1"/></component>
        <component name="b" kind="k"/><component name="c" kind="k"/>
        <link from="a.x" to="b.y"/><link from="a.x" to="c.y"/></system></armor>"#;

    #[test]
    fn what_only_one_version_has_is_drawn_and_marked() {
        let text = RUNS
            .replace(r#"value="1""#, r#"value="2""#)
            .replace(r#"<component name="c" kind="k"/>"#, r#"<component name="d" kind="k"/>"#)
            .replace(r#"to="c.y""#, r#"to="d.z""#);
        let ((running, old), (edited, new)) = (drawn(RUNS), drawn(&text));
        let (drawing, mut presences) = merge(running, edited);
        let (old, new) = (old.configuration().unwrap(), new.configuration().unwrap());
        add_differences(&mut presences, &compare(old, old, new));
        let labels: Vec<_> = drawing.nodes.iter().map(|node| node.label.as_str()).collect();
        assert_eq!(labels, ["component a", "component b", "component d", "component c"]);
        assert_eq!(drawing.wires.len(), 3);
        let expected = [
            ("component a", Presence::Differs(vec!["parameter a.p: 1 → 2".into()])),
            ("component c", Presence::OnlyRunning),
            ("component d", Presence::OnlyText),
            ("link a.x to c.y", Presence::OnlyRunning),
            ("link a.x to d.z", Presence::OnlyText),
        ];
        let expected: Presences =
            expected.into_iter().map(|(label, presence)| (label.into(), presence)).collect();
        assert_eq!(presences, expected);
        for wire in &drawing.wires {
            assert!(drawing.port(wire.from).is_some() && drawing.port(wire.to).is_some());
        }
        let areas: Vec<_> = drawing.nodes.iter().map(|node| node.area()).collect();
        for (n, area) in areas.iter().enumerate() {
            assert!(areas[..n].iter().all(|other| !other.intersects(*area)), "{areas:?}");
        }
    }

    #[test]
    fn a_port_that_only_the_text_uses_is_added_to_the_block_that_runs() {
        let text = RUNS.replace(r#"to="b.y""#, r#"to="b.other""#);
        let (drawing, presences) = merge(drawn(RUNS).0, drawn(&text).0);
        let b = &drawing.nodes[drawing.node(Item::component("b")).unwrap()];
        let ports: Vec<_> = b.ports.iter().map(|port| port.label.as_str()).collect();
        assert_eq!(ports, ["input b.y", "input b.other"]);
        assert!(b.ports[1].at.y < b.rect.height());
        assert_eq!(presences.len(), 2, "{presences:?}");
    }

    #[test]
    fn equal_versions_have_no_marks_and_keep_the_positions_of_the_text() {
        let (one, mut other) = (drawn(RUNS).0, drawn(RUNS).0);
        for node in &mut other.nodes {
            node.rect = node.rect.translate(Vec2::splat(40.0));
        }
        let areas: Vec<_> = other.nodes.iter().map(|node| node.rect).collect();
        let (drawing, presences) = merge(one, other);
        assert!(presences.is_empty());
        assert_eq!(drawing.nodes.iter().map(|node| node.rect).collect::<Vec<_>>(), areas);
    }
}
