//! The parameters of a component that runs, and setting them: configd judges the file as it would
//! be, writes it and computes when the change takes effect.

use armor_inspect::{ParameterClient, SetReport};
use armor_wire::config::{FindingSeverity, ListedParameter};
use eframe::egui::{self, Align, Button, Key, Label, Layout, Response, TextEdit, vec2};

use super::watched::Watched;
use super::words::said;
use crate::canvas::CanvasColours;

/// How wide a field is, in points: a number with its unit, or the end of a path.
const FIELD_WIDTH: f32 = 110.0;

/// What is written into the fields.
#[derive(Debug, Default)]
pub struct Panel {
    draft: Option<Draft>,
    /// The version of the file that the running system had when they were listed.
    asked: Option<u64>,
}

/// What is being written into the field of a parameter.
#[derive(Debug)]
struct Draft {
    parameter: String,
    text: String,
    /// Whether it was asked to be put into the file.
    is_wished: bool,
}

impl Panel {
    /// Shows the parameters of `component`.
    pub fn show(&mut self, ui: &mut egui::Ui, watched: &Watched, component: &str) {
        let desk = &watched.parameters;
        self.ask(watched);
        let Some(listed) = desk.listed() else {
            ui.weak(watched.silence().unwrap_or("loading"));
            return;
        };
        let colours = CanvasColours::of(ui.visuals());
        let listed = match listed.as_ref() {
            Ok(listed) => listed,
            Err(problem) => {
                ui.colored_label(colours.warning, said(ui, problem));
                if watched.silence().is_none() && ui.button("Reload").clicked() {
                    desk.list();
                }
                return;
            }
        };
        if listed.refused {
            let text = format!(
                "The file on the disk is not valid; these are the values of version {}.",
                listed.version
            );
            ui.colored_label(colours.warning, text);
        }
        let own: Vec<_> =
            listed.parameters.iter().filter(|one| one.component == component).collect();
        if own.is_empty() {
            ui.weak("None.");
        }
        for parameter in own {
            self.row(ui, watched, parameter);
        }
        answer(ui, desk, component, &colours);
    }

    /// Lists them once, and again when the running system has another version of the file.
    fn ask(&mut self, watched: &Watched) {
        let (desk, marking) = (&watched.parameters, watched.mission.look().marking);
        let version = marking.map_or(0, |marking| marking.version);
        let is_new = self.asked != Some(version) || desk.listed().is_none();
        // Of what has gone, those that were listed last stay.
        if is_new && watched.silence().is_none() {
            self.asked = Some(version);
            desk.list();
        }
    }

    /// A parameter with its field: what is written stays there until it is in the file, and why it
    /// is refused stands below.
    fn row(&mut self, ui: &mut egui::Ui, watched: &Watched, parameter: &ListedParameter) {
        let name = format!("{}.{}", parameter.component, parameter.name);
        let mut draft = self.draft.take_if(|draft| draft.parameter == name);
        let told = draft.as_ref().and_then(|draft| {
            let about_it = |told: &SetReport| told.value.as_ref() == Some(&draft.text);
            watched.parameters.last_result().filter(|told| told.parameter == name && about_it(told))
        });
        let is_set = told.as_ref().is_some_and(|told| told.is_set);
        draft.take_if(|draft| draft.is_wished && is_set);
        let refused = told.filter(|told| !told.is_set);
        let mut text = draft.as_ref().map_or(&parameter.value, |draft| &draft.text).clone();
        let row = ui.horizontal(|ui| {
            let size = vec2((ui.available_width() * 0.35).max(60.0), ui.spacing().interact_size.y);
            let layout = Layout::left_to_right(Align::Center);
            ui.allocate_ui_with_layout(size, layout, |ui| {
                ui.set_min_width(size.x);
                let label = ui.add(Label::new(&parameter.name).truncate());
                label.on_hover_text(said(ui, &about(parameter)));
            });
            let field = field(ui, &name, &mut text, refused.is_some());
            if field.changed() {
                let (parameter, text) = (name.clone(), text.clone());
                draft = Some(Draft { parameter, text, is_wished: false });
            }
            let left_by = |key| field.lost_focus() && ui.input(|i| i.key_pressed(key));
            if left_by(Key::Escape) {
                draft = None;
            }
            let entered = left_by(Key::Enter);
            if text == parameter.value {
                remark(ui, parameter);
                return false;
            }
            set(ui, &name, watched.silence()) || (entered && watched.silence().is_none())
        });
        if row.inner {
            watched.parameters.set(&parameter.component, &parameter.name, Some(&text));
            draft = draft.map(|draft| Draft { is_wished: true, ..draft });
        }
        if draft.is_some() {
            self.draft = draft;
        }
        if let Some(told) = refused {
            complain(ui, &told, parameter);
        }
    }
}

fn field(ui: &mut egui::Ui, name: &str, text: &mut String, is_wrong: bool) -> Response {
    let mut field = TextEdit::singleline(text);
    if is_wrong {
        field = field.text_color(CanvasColours::of(ui.visuals()).error);
    }
    let size = vec2(FIELD_WIDTH, ui.spacing().interact_size.y);
    ui.add_sized(size, field).accessible_name(format!("parameter {name}"))
}

/// The button that writes it into the file, which cannot be if `why_not` states so.
fn set(ui: &mut egui::Ui, name: &str, why_not: Option<&str>) -> bool {
    let set = ui.add_enabled(why_not.is_none(), Button::new("Set"));
    let set = set.on_hover_text("Writes it into the file");
    let set = set.on_disabled_hover_text(why_not.unwrap_or_default());
    set.accessible_name(format!("set {name}")).clicked()
}

fn remark(ui: &mut egui::Ui, parameter: &ListedParameter) {
    if parameter.live {
        ui.weak("live").on_hover_text("A change reaches the running component.");
    } else {
        ui.weak(&parameter.unit);
    }
}

/// Why a value was refused, and what it may be.
fn complain(ui: &mut egui::Ui, told: &SetReport, parameter: &ListedParameter) {
    let colours = CanvasColours::of(ui.visuals());
    let found = told.findings.iter().filter(|finding| finding.severity == FindingSeverity::Error);
    let found: Vec<_> = found.collect();
    if found.is_empty() {
        ui.colored_label(colours.error, said(ui, &told.text));
    }
    for finding in found {
        ui.colored_label(
            colours.error,
            said(ui, &format!("{}: {}", finding.code, finding.message)),
        );
        if !finding.remedy.is_empty() {
            ui.weak(said(ui, &finding.remedy));
        }
    }
    let is_said = told.findings.iter().any(|finding| !finding.remedy.is_empty());
    if let Some(range) = range(parameter).filter(|_| !is_said) {
        ui.weak(said(ui, &format!("It may be: {range}.")));
    }
}

/// What it may be, if it is not free.
fn range(parameter: &ListedParameter) -> Option<String> {
    let ListedParameter { kind, range, unit, .. } = parameter;
    let text = format!("{kind} {range} {unit}");
    (!range.is_empty()).then(|| text.trim().to_owned())
}

fn about(parameter: &ListedParameter) -> String {
    let mut lines = Vec::new();
    if !parameter.doc.is_empty() {
        lines.push(parameter.doc.clone());
    }
    lines.extend(range(parameter));
    lines.push(format!("from {}", parameter.origin));
    lines.join("\n")
}

/// What became of the last wish, if it is in the file; where it is not, its field states so.
fn answer(ui: &mut egui::Ui, desk: &ParameterClient, component: &str, colours: &CanvasColours) {
    let Some(told) = desk.last_result().filter(|told| told.is_set) else { return };
    if told.parameter.split('.').next() == Some(component) {
        ui.colored_label(colours.good, said(ui, &told.text));
    }
}
