//! What the small list at the pointer offers: the components that can be added there, and the ports
//! that a wire dropped on nothing can be linked to.

use eframe::egui::{Pos2, vec2};

use crate::canvas::{Direction, JoinRules, PortAt};
use crate::kinds::Kinds;
use crate::panels::pick::{Entry, Picker};
use crate::system::drawing::SystemDrawing;
use crate::system::robot;
use crate::system::rules::{Joint, types_fit};
use crate::workspace::Workspace;

/// What is done with what is picked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum SystemChoice {
    /// A component of this kind is added.
    Add(String),
    /// The same, and its port is linked with the one the wire comes from.
    AddLinked { kind: String, port: String },
    /// Two ports that are there are linked.
    Join(PortAt, PortAt),
}

/// The list.
pub(super) struct SystemPicker {
    pub(super) picker: Picker,
    pub(super) name: &'static str,
    pub(super) entries: Vec<Entry<SystemChoice>>,
    pub(super) at: Pos2,
    pub(super) from: Option<(Direction, String)>,
}

impl SystemPicker {
    /// Everything that can be added.
    pub(super) fn to_add(workspace: &Workspace, at: Pos2) -> Self {
        let kinds = workspace.project.kinds();
        // Behind the kinds: its summary names some of them.
        let robot = robot::entry(kinds);
        let entries = kinds.iter().chain(&robot).map(|kind| Entry {
            name: kind.kind.clone(),
            about: kind.summary.clone(),
            value: SystemChoice::Add(kind.kind.clone()),
        });
        Self {
            picker: Picker::default(),
            name: "Add a component",
            entries: entries.collect(),
            at,
            from: None,
        }
    }

    /// What fits a port: ports that are there and free before components that could be added.
    pub(super) fn for_port(
        drawing: &SystemDrawing,
        workspace: &Workspace,
        from: PortAt,
        at: Pos2,
    ) -> Self {
        let Some(joint) = drawing.joints.joint(from) else { return Self::to_add(workspace, at) };
        let mut entries = joinable(drawing, from);
        entries.extend(addable(workspace.project.kinds(), joint));
        Self {
            picker: Picker::default(),
            name: "Link to a matching port",
            entries,
            at,
            from: Some((joint.direction, joint.data())),
        }
    }

    /// Everything that the ports of a node can be linked with.
    pub(super) fn to_link(drawing: &SystemDrawing, node: usize) -> Self {
        let block = &drawing.diagram.nodes[node];
        let ports = (0..block.ports.len()).map(|port| PortAt { node, port });
        Self {
            picker: Picker::default(),
            name: "Link with a matching port",
            entries: ports.flat_map(|port| joinable(drawing, port)).collect(),
            at: block.rect.right_top() + vec2(20.0, 0.0),
            from: None,
        }
    }
}

/// The ports that a port may be joined to, as they are now.
fn joinable(drawing: &SystemDrawing, from: PortAt) -> Vec<Entry<SystemChoice>> {
    let mut entries = Vec::new();
    for (node, ends) in drawing.joints.ports.iter().enumerate() {
        for port in 0..ends.len() {
            let to = PortAt { node, port };
            if drawing.joints.may_join(from, to).is_ok()
                && let Ok((output, input)) = drawing.joints.ends(from, to)
            {
                entries.push(Entry {
                    name: format!("{} > {}", output.data(), input.data()),
                    about: String::new(),
                    value: SystemChoice::Join(from, to),
                });
            }
        }
    }
    entries
}

/// The kinds that have a port which fits.
fn addable(kinds: &Kinds, joint: &Joint) -> Vec<Entry<SystemChoice>> {
    let mut entries = Vec::new();
    for kind in kinds.iter() {
        let is_output = joint.direction == Direction::Out;
        let ports = if is_output { &kind.inputs } else { &kind.outputs };
        let direction = if is_output { Direction::In } else { Direction::Out };
        for port in ports {
            let other = Joint::new(&kind.kind, &port.id, direction, Some(port));
            let fits = if is_output { types_fit(joint, &other) } else { types_fit(&other, joint) };
            if fits.is_ok() {
                entries.push(Entry {
                    name: format!("add {}, {}", kind.kind, port.id),
                    about: kind.summary.clone(),
                    value: SystemChoice::AddLinked {
                        kind: kind.kind.clone(),
                        port: port.id.clone(),
                    },
                });
            }
        }
    }
    entries
}
