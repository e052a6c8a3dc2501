//! The system as a drawing: a block for each component, with the ports that its kind has.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use armor_robotfile::model::{Component, Link, LinkMode, Transport};
use armor_robotfile::{Code, Severity, TypedManifests};
use armor_wire::keep::{Keep, Wake};
use armor_wire::manifest::{Manifest, ParameterManifest, PortManifest};
use eframe::egui::{Pos2, Rect, Vec2, vec2};

use crate::canvas::{
    Badge, Diagram, DiagramNode, Direction, Mark, NodeLook, NodePort, NodeShape, Outline, PortAt,
    PortSide, Wire, WireEnd, arrange,
};
use crate::item::Item;
use crate::kinds::Kinds;
use crate::layout::{self, Layout};
use crate::project::Project;
use crate::system::folding::Hidden;
use crate::system::rules::{Joint, Joints};
use crate::view::View;

/// From the upper edge of a block to the middle of its first port.
pub(super) const FIRST_PORT: f32 = 60.0;
/// From port to port.
pub(super) const PORT_STEP: f32 = 20.0;
/// Left free below the last port.
const BELOW: f32 = 20.0;
/// Approximate width of a letter at the sizes of the drawing.
const TITLE_LETTER: f32 = 9.0;
const LETTER: f32 = 6.8;
const NARROWEST: f32 = 140.0;
const WIDEST: f32 = 360.0;

/// The drawing of a system.
#[derive(Debug, Default)]
pub struct SystemDrawing {
    /// What is drawn.
    pub diagram: Diagram<Item>,
    /// What may be joined.
    pub joints: Joints,
    /// Components without a position in the file.
    pub unplaced: BTreeSet<usize>,
    /// What folded groups hide.
    pub hidden: Hidden,
}

/// Draws the system of a project as it is now, with all groups unfolded.
pub fn draw(project: &Project) -> SystemDrawing {
    let Some(configuration) = project.configuration() else { return SystemDrawing::default() };
    let document = project.document_with(armor_robotfile::Item::System);
    let layout = document.map(|document| layout::read(document, View::System)).unwrap_or_default();
    let system = &configuration.system;
    let kinds = Arc::clone(project.kinds());
    let types: BTreeMap<_, _> =
        kinds.types().into_iter().enumerate().map(|(number, name)| (name, number)).collect();
    let typed = kinds.manifests().map(|manifests| TypedManifests::of(system, manifests));
    let mut shown: BTreeSet<&str> = BTreeSet::new();
    let mut nodes = Vec::new();
    let mut joints = Joints::default();
    for component in &system.components {
        // The check reports a second one of the same name.
        if shown.insert(&component.name.value) {
            let kind = typed.as_ref().and_then(|typed| typed.find(&component.name.value));
            let (mut node, mut ends) = block(component, &system.links, &kinds, kind);
            if let Some(kind) = kinds.find(&component.kind.value) {
                let takes_any = |id: &str| kind.inputs.iter().any(|it| it.id == id && it.is_any());
                ends.iter_mut().for_each(|joint| joint.takes_any = takes_any(&joint.port));
            }
            for (port, joint) in node.ports.iter_mut().zip(&ends) {
                let name = joint.message.as_ref().map(|(name, ..)| name.as_str());
                port.colour = name.and_then(|name| types.get(name)).copied().unwrap_or_default();
            }
            nodes.push(node);
            joints.ports.push(ends);
        }
    }
    let mut drawing = SystemDrawing { joints, ..SystemDrawing::default() };
    let names: BTreeMap<&str, usize> =
        nodes.iter().enumerate().map(|(n, node)| (node.title.as_str(), n)).collect();
    let wires = wires(&system.links, &names, &mut drawing.joints);
    for wire in &wires {
        for end in [wire.from, wire.to] {
            drawing.joints.ports[end.node][end.port].wires += 1;
        }
    }
    for (node, ends) in nodes.iter_mut().zip(&drawing.joints.ports) {
        for (port, joint) in node.ports.iter_mut().zip(ends) {
            port.is_wired = joint.wires > 0;
        }
    }
    place(&mut nodes, &wires, &layout, &mut drawing.unplaced);
    let mut diagram = Diagram::new(nodes, wires, layout.decorations);
    mark(&mut diagram, project);
    drawing.diagram = diagram;
    drawing
}

/// `kind`: that of the component, with the types that its ports have in this system.
fn block(
    component: &Component,
    links: &[Link],
    kinds: &Kinds,
    kind: Option<&Manifest>,
) -> (DiagramNode<Item>, Vec<Joint>) {
    let name = &component.name.value;
    let is_known = kinds.manifests().is_none() || kind.is_some();
    let mut ports = Vec::new();
    let mut joints = Vec::new();
    let mut rows = [0_usize; 2];
    let mut add = |direction: Direction, id: &str, manifest: Option<&PortManifest>| {
        let row = &mut rows[usize::from(direction == Direction::Out)];
        let y = FIRST_PORT + PORT_STEP * *row as f32;
        *row += 1;
        ports.push(port(name, id, direction, y, manifest, kinds.manifests().is_some()));
        joints.push(Joint::new(name, id, direction, manifest));
    };
    for input in kind.iter().flat_map(|kind| &kind.inputs) {
        add(Direction::In, &input.id, Some(input));
    }
    for output in kind.iter().flat_map(|kind| &kind.outputs) {
        add(Direction::Out, &output.id, Some(output));
    }
    let has = |direction: Direction, id: &str| {
        let ports = match direction {
            Direction::Out => kind.map(|kind| &kind.outputs),
            _ => kind.map(|kind| &kind.inputs),
        };
        ports.is_some_and(|ports| ports.iter().any(|port| port.id == id))
    };
    // What links name and the kind does not have: it vanished, or the kind is not there.
    let mut missing: BTreeSet<(bool, &str)> = BTreeSet::new();
    for link in links {
        if link.to.component.value == *name && !has(Direction::In, &link.to.port.value) {
            missing.insert((false, &link.to.port.value));
        }
        if link.from.component.value == *name && !has(Direction::Out, &link.from.port.value) {
            missing.insert((true, &link.from.port.value));
        }
    }
    for (is_output, id) in missing {
        add(if is_output { Direction::Out } else { Direction::In }, id, None);
    }
    let size = block_size(name, &component.kind.value, &ports, rows[0].max(rows[1]));
    for port in &mut ports {
        port.at.x = if port.side == PortSide::Right { size.x } else { 0.0 };
    }
    let unassigned = kind.map_or(0, |kind| unassigned(component, kind).count());
    let node = DiagramNode {
        item: Item::component(name),
        title: name.clone(),
        subtitle: subtitle(component, is_known),
        lines: Vec::new(),
        rect: Rect::from_min_size(Pos2::ZERO, size),
        shape: NodeShape::Block,
        ports,
        badge: (unassigned > 0).then(|| Badge {
            text: unassigned.to_string(),
            doc: format!("parameters that need a value: {unassigned}"),
            tint: None,
        }),
        mark: Mark::None,
        look: NodeLook {
            outline: if is_known { Outline::Plain } else { Outline::Dashed },
            is_dim: !is_known,
            ..NodeLook::default()
        },
        label: format!("component {name}"),
        doc: doc(component, kind, is_known, unassigned),
    };
    (node, joints)
}

/// The parameters of a kind that need a value and have none.
pub fn unassigned<'a>(
    component: &'a Component,
    kind: &'a Manifest,
) -> impl Iterator<Item = &'a ParameterManifest> {
    let wanted = kind.parameters.iter().filter(|parameter| parameter.default.is_none());
    wanted.filter(|parameter| component.parameter(&parameter.name).is_none())
}

fn subtitle(component: &Component, is_known: bool) -> String {
    let kind = &component.kind.value;
    match &component.rate_hz {
        _ if !is_known => format!("{kind}: unknown kind"),
        Some(rate) => format!("{kind}, {} Hz", rate.value),
        None => kind.clone(),
    }
}

fn doc(
    component: &Component,
    kind: Option<&Manifest>,
    is_known: bool,
    unassigned: usize,
) -> String {
    let mut doc = match kind {
        Some(kind) => format!("{}: {}", kind.kind, kind.summary),
        None if is_known => component.kind.value.clone(),
        None => format!(
            "There is no kind called {}: its executable is gone or was renamed. \
             The properties offer another kind.",
            component.kind.value
        ),
    };
    if unassigned > 0 {
        doc += &format!("\n{unassigned} of its parameters need a value.");
    }
    doc
}

fn port(
    component: &str,
    id: &str,
    direction: Direction,
    y: f32,
    manifest: Option<&PortManifest>,
    is_judged: bool,
) -> NodePort {
    let is_output = direction == Direction::Out;
    let sort = if is_output { "output" } else { "input" };
    let doc = match manifest {
        Some(port) => {
            let nature = match (port.required, port.latched, port.many) {
                (true, _, true) => ", takes any number of links, at least one",
                (_, _, true) => ", takes any number of links",
                (true, ..) => ", must be fed",
                (_, true, _) => ", keeps its last value for late subscribers",
                _ => "",
            };
            let about = if port.doc.is_empty() { "" } else { "\n" };
            format!("{sort} {id}: {}{nature}{about}{}", port.type_name, port.doc)
        }
        None if is_judged => {
            format!(
                "{sort} {id} is not there any more: link another one instead, or remove the link"
            )
        }
        None => format!("{sort} {id}"),
    };
    NodePort {
        name: match manifest {
            Some(port) if port.many => format!("{id} …"),
            _ => id.to_owned(),
        },
        at: vec2(0.0, y),
        side: if is_output { PortSide::Right } else { PortSide::Left },
        direction,
        colour: 0,
        is_wired: false,
        is_required: manifest.is_some_and(|port| port.required),
        is_missing: manifest.is_none() && is_judged,
        label: format!("{sort} {component}.{id}"),
        doc,
    }
}

/// The size of a block with this text and so many rows of ports.
pub(super) fn block_size(name: &str, kind: &str, ports: &[NodePort], rows: usize) -> Vec2 {
    let longest = |side: PortSide| {
        let names = ports.iter().filter(|port| port.side == side);
        names.map(|port| port.name.chars().count()).max().unwrap_or(0) as f32
    };
    let title = name.chars().count() as f32 * TITLE_LETTER + 30.0;
    let kind = (kind.chars().count() + 8) as f32 * 6.0 + 24.0;
    let names = (longest(PortSide::Left) + longest(PortSide::Right)) * LETTER + 44.0;
    let width = title.max(kind).max(names).clamp(NARROWEST, WIDEST);
    let height = if rows == 0 { 50.0 } else { FIRST_PORT + PORT_STEP * (rows - 1) as f32 + BELOW };
    // Even steps, so that blocks in a row line up.
    vec2((width / 10.0).ceil() * 10.0, height)
}

fn wires(links: &[Link], names: &BTreeMap<&str, usize>, joints: &mut Joints) -> Vec<Wire<Item>> {
    let mut wires: Vec<Wire<Item>> = Vec::new();
    for link in links {
        let end = |port: &armor_robotfile::model::Port, direction: Direction| {
            let node = *names.get(port.component.value.as_str())?;
            let ends = &joints.ports[node];
            let is_it =
                |joint: &Joint| joint.port == port.port.value && joint.direction == direction;
            Some(PortAt { node, port: ends.iter().position(is_it)? })
        };
        let (from, to) = (end(&link.from, Direction::Out), end(&link.to, Direction::In));
        // The check reports a link to a component that does not exist.
        let (Some(from), Some(to)) = (from, to) else { continue };
        let number = wires.len();
        joints.ports[to.node][to.port].fed_by.push((number, link.from.data()));
        wires.push(wire(link, from, to));
    }
    wires
}

fn wire(link: &Link, from: PortAt, to: PortAt) -> Wire<Item> {
    let (output, input) = (link.from.data(), link.to.data());
    let unusual = unusual(link);
    let unusual_text = unusual.join(", ");
    let doc = match unusual.is_empty() {
        true => format!("{output} feeds {input}"),
        false => format!("{output} feeds {input}: {unusual_text}"),
    };
    Wire {
        item: Item::link(&output, &input),
        from,
        to,
        end: WireEnd::Plain,
        text: unusual_text,
        is_dashed: link.mode == LinkMode::Pull,
        is_strong: link.keep.is_all(),
        is_led: true,
        tint: None,
        mark: Mark::None,
        label: format!("link {output} to {input}"),
        doc,
    }
}

/// Returns the attributes of a link that differ from the defaults.
fn unusual(link: &Link) -> Vec<String> {
    let mut words = Vec::new();
    match link.keep {
        Keep::Latest => {}
        keep => words.push(format!("keep {keep}")),
    }
    if link.mode == LinkMode::Pull {
        words.push("pull".into());
    }
    if link.history != 1 {
        words.push(format!("history {}", link.history));
    }
    if link.wake == Wake::Spin {
        words.push("spin".into());
    }
    if link.transport != Transport::default() {
        words.push(link.transport.name().into());
    }
    words
}

/// Puts blocks at their positions in the file; those without a position are arranged next to
/// the others.
fn place(
    nodes: &mut [DiagramNode<Item>],
    wires: &[Wire<Item>],
    layout: &Layout,
    unplaced: &mut BTreeSet<usize>,
) {
    let mut bounds: Option<Rect> = None;
    for (n, node) in nodes.iter_mut().enumerate() {
        match layout.blocks.get(&node.title) {
            Some(at) => {
                node.rect = Rect::from_min_size(*at, node.rect.size());
                bounds = Some(bounds.map_or(node.rect, |bounds| bounds.union(node.rect)));
            }
            None => {
                unplaced.insert(n);
            }
        }
    }
    let links: Vec<_> = wires.iter().map(|wire| (wire.from.node, wire.to.node)).collect();
    let sizes: Vec<_> = nodes.iter().map(|node| node.rect.size()).collect();
    let wanted: Vec<_> = unplaced.iter().copied().collect();
    let positions = arrange::arrange(&sizes, &links, &wanted, arrange::SHAPE);
    let corner =
        bounds.map_or(Pos2::new(40.0, 40.0), |bounds| Pos2::new(bounds.min.x, bounds.max.y + 60.0));
    for (n, at) in wanted.into_iter().zip(positions) {
        nodes[n].rect = Rect::from_min_size(corner + at, nodes[n].rect.size());
    }
}

/// Marks what the findings are about.
fn mark(diagram: &mut Diagram<Item>, project: &Project) {
    let checked = project.checked();
    if checked.revision != project.revision() {
        return;
    }
    let mut marks: BTreeMap<Item, Mark> = BTreeMap::new();
    for finding in checked.findings.iter() {
        // The badge and the underlined port say these.
        if matches!(finding.code, Code::ParameterUnassigned | Code::InputUnfed) {
            continue;
        }
        let mark = match finding.severity() {
            Severity::Error => Mark::Error,
            Severity::Warning => Mark::Warning,
            Severity::Note => continue,
        };
        if let Some(item) = finding.at.as_ref().and_then(|at| project.item_at(at)) {
            let known = marks.entry(item).or_default();
            *known = mark.max(*known);
        }
    }
    for node in &mut diagram.nodes {
        node.mark = marks.get(&node.item).copied().unwrap_or_default();
    }
    for wire in &mut diagram.wires {
        wire.mark = marks.get(&wire.item).copied().unwrap_or_default();
    }
}
