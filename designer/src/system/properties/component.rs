//! A component: its name, how it is run, its parameters and its ports.

use std::collections::BTreeMap;

use armor_robotfile::model::{Component, Restart};
use armor_robotfile::resources::{parse_cpu, parse_cpus, parse_memory, parse_nice, parse_realtime};
use armor_wire::manifest::{Manifest, ParameterManifest};
use armor_wire::name::is_name;
use armor_wire::quantity;
use armor_wire::text_format::TextFormat;
use eframe::egui::{self, CollapsingHeader, ComboBox, RichText, TextEdit};

use crate::item::Item;
use crate::panels::fields::Form;
use crate::system::properties::field::{Field, Focus, check_name};
use crate::system::state::SystemView;
use crate::system::{docs, repair};
use crate::workspace::Workspace;

/// Fewer parameters are seen at a glance.
const FEW_PARAMETERS: usize = 4;
/// So many parameters are grouped, and so many make a group.
const MANY_PARAMETERS: usize = 12;
const LEAST_GROUP: usize = 3;

impl SystemView {
    pub(super) fn component_properties(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &mut Workspace,
        name: &str,
    ) {
        let component =
            workspace.project.configuration().and_then(|c| c.system.component(name)).cloned();
        let Some(component) = component else { return };
        let kinds = std::sync::Arc::clone(workspace.project.kinds());
        let kind = kinds.find(&component.kind.value);
        ui.horizontal(|ui| {
            ui.strong("Component");
            let origin = kinds.origin(&component.kind.value);
            let about = ui.weak(&component.kind.value);
            if let Some(kind) = kind {
                about.on_hover_ui(|ui| docs::show(ui, kind, origin));
            }
        });
        if let Some(kind) = kind {
            let summary = crate::text::paintable(ui.ctx(), &kind.summary).into_owned();
            ui.label(RichText::new(summary).small().weak());
        }
        repair::component(ui, workspace, &component, &mut self.drafts);
        ui.label("Name");
        let form = Form { name: "Component name", hint: "", width: 0.0, rows: 1 };
        let field = Field::Name(name.to_owned());
        let response = self.drafts.text(ui, &field, name, form, &|text| {
            if text.is_empty() { Err("a name is required".into()) } else { check_name(text) }
        });
        let needs = |kind: &Manifest| {
            let mut needed = kind.parameters.iter().filter(|it| it.default.is_none());
            needed.any(|it| component.parameter(&it.name).is_none())
        };
        if self.wants_focus == Focus::Name || !kind.is_some_and(needs) {
            self.focus(&response);
        }
        if let Some(kind) = kind {
            self.parameters(ui, workspace, &component, kind);
        }
        // The first parameter that needs a value may have no text field.
        self.wants_focus = Focus::Nothing;
        ui.collapsing("Execution", |ui| self.running(ui, workspace, &component));
        ui.collapsing("Ports and links", |ui| self.ports(ui, name));
    }

    fn parameters(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &mut Workspace,
        component: &Component,
        kind: &Manifest,
    ) {
        if kind.parameters.is_empty() {
            return;
        }
        ui.separator();
        ui.strong("Parameters");
        if kind.parameters.len() > FEW_PARAMETERS {
            ui.horizontal(|ui| {
                let words = TextEdit::singleline(&mut self.parameter_words).hint_text("filter");
                ui.add(words.desired_width(120.0)).accessible_name("filter of parameters");
                ui.checkbox(&mut self.only_changed, "changed only")
                    .on_hover_text("Hides the parameters that have their default.");
            });
        }
        let mut hidden = 0;
        let is_filtered = self.only_changed || !self.parameter_words.trim().is_empty();
        // Those that need a value come first.
        let (needed, others): (Vec<_>, Vec<_>) =
            kind.parameters.iter().partition(|parameter| parameter.default.is_none());
        let is_filled = |it: &&ParameterManifest| it.format == Some(TextFormat::Frames);
        let (alone, groups) = group_by_first_word(others);
        for parameter in needed.into_iter().chain(alone) {
            if is_filled(&parameter) {
                ui.weak(format!("{}: the frames of the system", parameter.name));
            } else if self.hides(component, parameter, kind) {
                hidden += 1;
            } else {
                self.parameter(ui, workspace, component, parameter);
            }
        }
        for (word, parameters) in groups {
            let (shown, left_out): (Vec<_>, Vec<_>) =
                parameters.into_iter().partition(|it| !self.hides(component, it, kind));
            hidden += left_out.len();
            if shown.is_empty() {
                continue;
            }
            let given = shown.iter().filter(|it| component.parameter(&it.name).is_some()).count();
            let title = match given {
                0 => format!("{word} ({})", shown.len()),
                given => format!("{word} ({}, {given} changed)", shown.len()),
            };
            // Under a name of its own in each component: what is changed there is open at first.
            let header = CollapsingHeader::new(title).id_salt((&component.name.value, word));
            let header = header.default_open(given > 0).open(is_filtered.then_some(true));
            header.show(ui, |ui| {
                for parameter in shown {
                    self.parameter(ui, workspace, component, parameter);
                }
            });
        }
        if hidden > 0 {
            ui.weak(format!("{hidden} parameters are hidden"));
        }
    }

    /// Whether the filter hides a parameter. One that needs a value is always shown.
    fn hides(&self, component: &Component, parameter: &ParameterManifest, kind: &Manifest) -> bool {
        let is_given = component.parameter(&parameter.name).is_some();
        if kind.parameters.len() <= FEW_PARAMETERS || (parameter.default.is_none() && !is_given) {
            return false;
        }
        let words = self.parameter_words.to_lowercase();
        let text = format!("{} {}", parameter.name, parameter.doc).to_lowercase();
        (self.only_changed && !is_given)
            || !words.split_whitespace().all(|word| text.contains(word))
    }

    fn running(&mut self, ui: &mut egui::Ui, workspace: &Workspace, component: &Component) {
        let item = Item::component(&component.name.value);
        let document = workspace.project.document_with(armor_robotfile::Item::System);
        let written = |attribute: &str| {
            let document = document?;
            let path = document.find(item.named()?)?;
            Some(document.tree().element(&path)?.attribute(attribute)?.value.clone())
        };
        for row in EXECUTION_ROWS {
            ui.label(row.label).on_hover_text(row.doc);
            let name = format!("component {}", row.attribute);
            let form = Form { name: &name, hint: row.hint, width: 0.0, rows: 1 };
            let value = written(row.attribute).unwrap_or_default();
            let field = Field::Attribute(item, row.attribute);
            self.drafts.text(ui, &field, &value, form, &|text| match text {
                "" => Ok(()),
                text => (row.check)(text),
            });
        }
        ui.label("Restart").on_hover_text("What happens when its process ends by itself.");
        let restarts = [
            (Restart::OnFailure, "", "unless it ended well"),
            (Restart::Always, "always", "always"),
            (Restart::Never, "never", "never"),
        ];
        let unread = item.named().and_then(|named| workspace.project.unread(named, "restart"));
        let is_it = |restart: Restart| restart == component.restart && unread.is_none();
        let shown = restarts.iter().find(|(restart, ..)| is_it(*restart));
        let shown = unread.unwrap_or(shown.map_or("", |restart| restart.2));
        let combo = ComboBox::from_id_salt("restart").selected_text(shown);
        let drafts = &mut self.drafts;
        let combo = combo.show_ui(ui, |ui| {
            for (restart, value, text) in restarts {
                if ui.selectable_label(is_it(restart), text).clicked() {
                    drafts.set(Field::Attribute(item, "restart"), value);
                }
            }
        });
        combo.response.accessible_name("component restart");
        let mut controllable = component.controllable;
        let check = ui.checkbox(&mut controllable, "the mission can freeze it");
        if check.changed() {
            let value = if controllable { "" } else { "false" };
            self.drafts.set(Field::Attribute(item, "controllable"), value);
        }
    }

    /// The ports with what they are linked to; a click selects the link.
    fn ports(&mut self, ui: &mut egui::Ui, name: &str) {
        let diagram = &self.drawing.diagram;
        let Some(node) = diagram.node(Item::component(name)) else { return };
        let mut selected = None;
        for (number, port) in diagram.nodes[node].ports.iter().enumerate() {
            let sort = if port.direction == crate::canvas::Direction::Out { "out" } else { "in" };
            let text = format!("{sort}: {}", port.name);
            let label = if port.is_missing {
                ui.colored_label(ui.visuals().error_fg_color, format!("{text} (no longer exists)"))
            } else {
                ui.label(text)
            };
            label.on_hover_text(crate::text::paintable(ui.ctx(), &port.doc).into_owned());
            let here = crate::canvas::PortAt { node, port: number };
            let wires = diagram.wires.iter().filter(|wire| wire.from == here || wire.to == here);
            for wire in wires {
                let Item::Link { from, to } = wire.item else { continue };
                let other = if wire.from == here { to } else { from };
                ui.horizontal(|ui| {
                    ui.add_space(armor_picture::theme::FAR);
                    if ui.link(other.as_str()).on_hover_text("Selects the link").clicked() {
                        selected = Some(wire.item);
                    }
                });
            }
        }
        if let Some(item) = selected {
            self.pane.select([item]);
        }
    }
}

/// Parameters under the first word of their names.
type ParameterGroup<'a> = (&'a str, Vec<&'a ParameterManifest>);

/// Splits the parameters of a kind that has many into those that stand alone and the groups of
/// those whose names begin with the same word, such as `laser_sigma` and `laser_dropout`.
fn group_by_first_word(
    parameters: Vec<&ParameterManifest>,
) -> (Vec<&ParameterManifest>, Vec<ParameterGroup<'_>>) {
    if parameters.len() < MANY_PARAMETERS {
        return (parameters, Vec::new());
    }
    let mut counts = BTreeMap::new();
    parameters.iter().for_each(|it| *counts.entry(first_word(it)).or_insert(0) += 1);
    let mut alone = Vec::new();
    let mut groups: Vec<ParameterGroup<'_>> = Vec::new();
    for parameter in parameters {
        let word = first_word(parameter);
        if counts[word] < LEAST_GROUP {
            alone.push(parameter);
        } else if let Some((_, members)) = groups.iter_mut().find(|(known, _)| *known == word) {
            members.push(parameter);
        } else {
            groups.push((word, vec![parameter]));
        }
    }
    (alone, groups)
}

fn first_word(parameter: &ParameterManifest) -> &str {
    parameter.name.split('_').next().unwrap_or_default()
}

/// An attribute of a component that is edited as text.
struct ExecutionRow {
    attribute: &'static str,
    label: &'static str,
    /// What an empty field means.
    hint: &'static str,
    doc: &'static str,
    check: fn(&str) -> Result<(), String>,
}

const EXECUTION_ROWS: [ExecutionRow; 9] = [
    ExecutionRow {
        attribute: "host",
        label: "Host",
        hint: "where the system is started",
        doc: "The <host> of the file on which it runs, through the agent there.",
        check: |text| match is_name(text) {
            true => Ok(()),
            false => Err("the name of a <host> of this file".into()),
        },
    },
    ExecutionRow {
        attribute: "rate",
        label: "Rate",
        hint: "after each data",
        doc: "How many times per second its exec is called, such as 10Hz.",
        check: |text| quantity::hertz(text).map(drop).map_err(|error| error.to_string()),
    },
    ExecutionRow {
        attribute: "watchdog",
        label: "Watchdog",
        hint: "none",
        doc: "Longest time of one call, such as 2s; after that it is killed.",
        check: |text| quantity::seconds(text).map(drop).map_err(|error| error.to_string()),
    },
    ExecutionRow {
        attribute: "env",
        label: "Environment",
        hint: "as every process",
        doc: "Names of further environment variables that its process gets, such as MAP_TOKEN.",
        check: |_| Ok(()),
    },
    ExecutionRow {
        attribute: "nice",
        label: "Niceness",
        hint: "that of armor run",
        doc: "-20 to 19: a low one goes before other processes, a high one leaves to them.",
        check: |text| parse_nice(text).map(drop),
    },
    ExecutionRow {
        attribute: "realtime",
        label: "Real-time priority",
        hint: "not in real time",
        doc: "1 to 99: it goes before every process with a lower one or none (SCHED_FIFO).",
        check: |text| parse_realtime(text).map(drop),
    },
    ExecutionRow {
        attribute: "cpus",
        label: "Processors",
        hint: "all",
        doc: "The processors on which it may run, from 0, such as 0 2-3.",
        check: |text| parse_cpus(text).map(drop),
    },
    ExecutionRow {
        attribute: "cpu",
        label: "Processor time",
        hint: "no limit",
        doc: "Its share of one processor, such as 50%, or 150% of two.",
        check: |text| parse_cpu(text).map(drop),
    },
    ExecutionRow {
        attribute: "memory",
        label: "Memory",
        hint: "no limit",
        doc: "The memory that it may allocate, such as 512MiB.",
        check: |text| parse_memory(text).map(drop),
    },
];
