//! What to do about a component whose kind changed or vanished.

use armor_robotfile::model::{Component, Link};
use armor_wire::manifest::{Manifest, PortManifest};
use eframe::egui::{self, ComboBox, Frame, Stroke};

use crate::item::Item;
use crate::kinds::Kinds;
use crate::panels::fields::Drafts;
use crate::system::edits;
use crate::system::properties::field::Field;
use crate::workspace::Workspace;

/// Shows the problem and the possible remedies; nothing if there is no problem.
pub(super) fn component(
    ui: &mut egui::Ui,
    workspace: &mut Workspace,
    component: &Component,
    drafts: &mut Drafts<Field>,
) {
    let kinds = std::sync::Arc::clone(workspace.project.kinds());
    if kinds.manifests().is_none() {
        return;
    }
    let stroke = Stroke::new(1.0, ui.visuals().error_fg_color);
    let frame = Frame::group(ui.style()).stroke(stroke);
    let Some(kind) = kinds.find(&component.kind.value) else {
        frame.show(ui, |ui| unknown_kind(ui, component, &kinds, workspace, drafts));
        return;
    };
    let unknown: Vec<_> = component
        .parameters
        .iter()
        .filter(|given| !kind.parameters.iter().any(|known| known.name == given.name.value))
        .collect();
    let broken = broken_links(workspace, component, kind);
    if unknown.is_empty() && broken.is_empty() {
        return;
    }
    frame.show(ui, |ui| {
        ui.label("This kind has changed since the file was written.");
        for given in unknown {
            ui.horizontal(|ui| {
                ui.label(format!("no parameter {}", given.name.value));
                let name = given.name.value.clone();
                let owner = component.name.value.clone();
                if ui.button(format!("remove {name}")).clicked() {
                    drafts.set(Field::NoParameter(owner, name), "");
                }
            });
        }
        for (link, is_output) in broken {
            broken_link(ui, workspace, &link, is_output, kind);
        }
    });
}

fn unknown_kind(
    ui: &mut egui::Ui,
    component: &Component,
    kinds: &Kinds,
    workspace: &Workspace,
    drafts: &mut Drafts<Field>,
) {
    ui.label(format!("Unknown kind {}.", component.kind.value));
    ui.label("Its executable is missing, or its directory was not named with --components.");
    let wanted = used_ports(workspace, component);
    let mut fitting: Vec<_> = kinds.iter().map(|kind| (missing(kind, &wanted), kind)).collect();
    // Those that have the ports that are linked come first.
    fitting.sort_by_key(|(missing, kind)| (*missing, kind.kind.clone()));
    let combo = ComboBox::from_id_salt("other kind").selected_text("choose another kind");
    let combo = combo.width(ui.available_width()).show_ui(ui, |ui| {
        for (missing, kind) in fitting {
            let text = match missing {
                0 => kind.kind.clone(),
                n => format!("{} ({n} of its linked ports missing)", kind.kind),
            };
            if ui.selectable_label(false, text).clicked() {
                let item = Item::component(&component.name.value);
                drafts.set(Field::Attribute(item, "kind"), kind.kind.as_str());
            }
        }
    });
    combo.response.accessible_name("Another kind");
}

/// The ports of a component that links name: the name, and whether it is an output.
fn used_ports(workspace: &Workspace, component: &Component) -> Vec<(String, bool)> {
    let name = &component.name.value;
    let links =
        workspace.project.configuration().map(|c| c.system.links.as_slice()).unwrap_or_default();
    let ends = links.iter().flat_map(|link| [(&link.from, true), (&link.to, false)]);
    let own = ends.filter(|(port, _)| port.component.value == *name);
    own.map(|(port, is_output)| (port.port.value.clone(), is_output)).collect()
}

fn missing(kind: &Manifest, wanted: &[(String, bool)]) -> usize {
    let has = |(name, is_output): &&(String, bool)| {
        let ports = if *is_output { &kind.outputs } else { &kind.inputs };
        ports.iter().any(|port| port.id == *name)
    };
    wanted.iter().filter(|wanted| !has(wanted)).count()
}

/// Links that name a port which the kind does not have, and whether that is an output.
fn broken_links(
    workspace: &Workspace,
    component: &Component,
    kind: &Manifest,
) -> Vec<(Link, bool)> {
    let name = &component.name.value;
    let links =
        workspace.project.configuration().map(|c| c.system.links.as_slice()).unwrap_or_default();
    let lacks = |ports: &[PortManifest], id: &str| !ports.iter().any(|port| port.id == id);
    let mut broken = Vec::new();
    for link in links {
        if link.from.component.value == *name && lacks(&kind.outputs, &link.from.port.value) {
            broken.push((link.clone(), true));
        }
        if link.to.component.value == *name && lacks(&kind.inputs, &link.to.port.value) {
            broken.push((link.clone(), false));
        }
    }
    broken
}

fn broken_link(
    ui: &mut egui::Ui,
    workspace: &mut Workspace,
    link: &Link,
    is_output: bool,
    kind: &Manifest,
) {
    let (from, to) = (link.from.data(), link.to.data());
    let port = if is_output { &link.from } else { &link.to };
    ui.label(format!("no {} {}", if is_output { "output" } else { "input" }, port.port.value));
    ui.horizontal(|ui| {
        let ports = if is_output { &kind.outputs } else { &kind.inputs };
        let mut other = None;
        let combo = ComboBox::from_id_salt((&from, &to)).selected_text("connect to");
        let combo = combo.show_ui(ui, |ui| {
            for port in ports {
                if ui.selectable_label(false, format!("{}: {}", port.id, port.type_name)).clicked()
                {
                    other = Some(format!(
                        "{}.{}",
                        if is_output { &link.from } else { &link.to }.component.value,
                        port.id
                    ));
                }
            }
        });
        combo.response.accessible_name(format!("instead of {}", port.port.value));
        if let Some(other) = other {
            let (new_from, new_to) = if is_output { (&other, &to) } else { (&from, &other) };
            workspace.edit(format!("reconnect a link to {other}"), |documents| {
                edits::rewire(documents, (&from, &to), (new_from, new_to))
            });
        }
        if ui.button("remove the link").clicked() {
            let item = Item::link(&from, &to);
            workspace.edit(format!("remove {item}"), |documents| edits::remove(documents, [&item]));
        }
    });
}
