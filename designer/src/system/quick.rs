//! The small list at the pointer: what can be added there, and what a wire that was let go over
//! nothing can be led to.

use eframe::egui::{self, Pos2, vec2};

use crate::canvas::{Direction, PortAt, Rules};
use crate::desk::Desk;
use crate::kinds::Kinds;
use crate::panels::pick::{Entry, Picked, Picker};
use crate::system::drawing::Drawing;
use crate::system::rules::{Joint, types_fit};
use crate::system::{SystemView, edits};

/// What is done with what is picked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Pick {
    /// A component of this kind is added.
    Add(String),
    /// The same, and its port is linked with the one the wire comes from.
    AddLinked { kind: String, port: String },
    /// Two ports that are there are linked.
    Join(PortAt, PortAt),
}

/// The list.
pub(super) struct Quick {
    picker: Picker,
    name: &'static str,
    entries: Vec<Entry<Pick>>,
    at: Pos2,
    from: Option<(Direction, String)>,
}

impl Quick {
    /// Everything that can be added.
    pub(super) fn to_add(desk: &Desk, at: Pos2) -> Self {
        let kinds = desk.project.kinds().iter();
        let entries = kinds.map(|kind| Entry {
            name: kind.kind.clone(),
            about: kind.summary.clone(),
            value: Pick::Add(kind.kind.clone()),
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
    pub(super) fn for_port(drawing: &Drawing, desk: &Desk, from: PortAt, at: Pos2) -> Self {
        let Some(joint) = drawing.joints.joint(from) else { return Self::to_add(desk, at) };
        let mut entries = joinable(drawing, from);
        entries.extend(addable(desk.project.kinds(), joint));
        Self {
            picker: Picker::default(),
            name: "Link to what fits",
            entries,
            at,
            from: Some((joint.direction, joint.data())),
        }
    }

    /// Everything that the ports of a node can be linked with.
    pub(super) fn to_link(drawing: &Drawing, node: usize) -> Self {
        let block = &drawing.diagram.nodes[node];
        let ports = (0..block.ports.len()).map(|port| PortAt { node, port });
        Self {
            picker: Picker::default(),
            name: "Link with what fits",
            entries: ports.flat_map(|port| joinable(drawing, port)).collect(),
            at: block.rect.right_top() + vec2(20.0, 0.0),
            from: None,
        }
    }
}

/// The ports that a port may be joined to, as they are now.
fn joinable(drawing: &Drawing, from: PortAt) -> Vec<Entry<Pick>> {
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
                    value: Pick::Join(from, to),
                });
            }
        }
    }
    entries
}

/// The kinds that have a port which fits.
fn addable(kinds: &Kinds, joint: &Joint) -> Vec<Entry<Pick>> {
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
                    value: Pick::AddLinked { kind: kind.kind.clone(), port: port.id.clone() },
                });
            }
        }
    }
    entries
}

impl SystemView {
    pub(super) fn show_quick(&mut self, ui: &egui::Ui, desk: &mut Desk) {
        let Some(mut quick) = self.quick.take() else { return };
        let at = self.canvas.to_window(quick.at);
        match quick.picker.show_at(ui, quick.name, at, &quick.entries) {
            Picked::Open => self.quick = Some(quick),
            Picked::One(pick) => self.take_pick(pick, &quick, desk),
            Picked::Left => {}
        }
    }

    fn take_pick(&mut self, pick: Pick, quick: &Quick, desk: &mut Desk) {
        match pick {
            Pick::Add(kind) => {
                self.add(&kind, quick.at, desk);
            }
            Pick::Join(from, to) => self.join(from, to, desk),
            Pick::AddLinked { kind, port } => {
                let Some((direction, data)) = &quick.from else { return };
                let mut added = None;
                let shown = self.unplaced();
                // One step: the component and its link.
                desk.edit(format!("add {kind} to {data}"), |documents| {
                    edits::place(documents, &shown)?;
                    let name = edits::add_component(documents, &kind, quick.at)?;
                    let own = format!("{name}.{port}");
                    if *direction == Direction::Out {
                        edits::join(documents, data, &own)?;
                    } else {
                        edits::join(documents, &own, data)?;
                    }
                    added = Some(name);
                    Ok(())
                });
                self.select_next = added.into_iter().map(crate::item::Item::Component).collect();
            }
        }
    }
}
