//! The parameters of a component that runs, and setting them: configd judges the file as it would
//! be, writes it and computes when the change takes effect.

use armor_inspect::{ParameterClient, SetReport};
use armor_wire::config::{FindingSeverity, ListedParameter};
use eframe::egui::{self, Align, Button, Key, Label, Layout, Response, TextEdit, vec2};

use super::watched::Watched;
use super::words::printable;
use crate::panels::fields::{is_entered, show_edit};
use armor_picture::theme::ThemeColours;

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
    /// Whether configd was requested to write it into the file.
    is_requested: bool,
}

impl Panel {
    /// Shows the parameters of `component`.
    pub fn show(&mut self, ui: &mut egui::Ui, watched: &Watched, component: &str) {
        let client = &watched.parameters;
        self.request_list(watched);
        let Some(listed) = client.listed() else {
            ui.weak(watched.silence().unwrap_or("loading"));
            return;
        };
        let colours = ThemeColours::of(ui.visuals());
        let listed = match listed.as_ref() {
            Ok(listed) => listed,
            Err(problem) => {
                ui.colored_label(colours.warning, printable(ui, problem));
                if watched.silence().is_none() && ui.button("Reload").clicked() {
                    client.list();
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
            self.show_row(ui, watched, parameter);
        }
        show_result(ui, client, component, colours);
    }

    /// Lists them once, and again when the running system has another version of the file.
    fn request_list(&mut self, watched: &Watched) {
        let (client, marking) = (&watched.parameters, watched.mission.look().marking);
        let version = marking.map_or(0, |marking| marking.version);
        let is_new = self.asked != Some(version) || client.listed().is_none();
        // After the end of the system the last list stays.
        if is_new && watched.silence().is_none() {
            self.asked = Some(version);
            client.list();
        }
    }

    /// A parameter with its field: what is written stays there until it is in the file, and why it
    /// is refused stands below.
    fn show_row(&mut self, ui: &mut egui::Ui, watched: &Watched, parameter: &ListedParameter) {
        let name = format!("{}.{}", parameter.component, parameter.name);
        let mut draft = self.draft.take_if(|draft| draft.parameter == name);
        let result = draft.as_ref().and_then(|draft| {
            let about_it = |result: &SetReport| result.value.as_ref() == Some(&draft.text);
            watched
                .parameters
                .last_result()
                .filter(|result| result.parameter == name && about_it(result))
        });
        let is_set = result.as_ref().is_some_and(|result| result.is_set);
        draft.take_if(|draft| draft.is_requested && is_set);
        let refused = result.filter(|result| !result.is_set);
        let mut text = draft.as_ref().map_or(&parameter.value, |draft| &draft.text).clone();
        let row = ui.horizontal(|ui| {
            let size = vec2((ui.available_width() * 0.35).max(60.0), ui.spacing().interact_size.y);
            let layout = Layout::left_to_right(Align::Center);
            ui.allocate_ui_with_layout(size, layout, |ui| {
                ui.set_min_width(size.x);
                let label = ui.add(Label::new(&parameter.name).truncate());
                label.on_hover_text(printable(ui, &about(parameter)));
            });
            let field = show_field(ui, &name, &mut text, refused.is_some());
            if field.changed() {
                let (parameter, text) = (name.clone(), text.clone());
                draft = Some(Draft { parameter, text, is_requested: false });
            }
            if field.lost_focus() && ui.input(|i| i.key_pressed(Key::Escape)) {
                draft = None;
            }
            let entered = is_entered(ui, &field);
            if text == parameter.value {
                show_unit(ui, parameter);
                return false;
            }
            let why_not = watched.refuses_values(&parameter.component);
            show_set_button(ui, &name, why_not) || (entered && why_not.is_none())
        });
        if row.inner {
            watched.parameters.set(&parameter.component, &parameter.name, Some(&text));
            draft = draft.map(|draft| Draft { is_requested: true, ..draft });
        }
        if draft.is_some() {
            self.draft = draft;
        }
        if let Some(result) = refused {
            show_refusal(ui, &result, parameter);
        }
    }
}

fn show_field(ui: &mut egui::Ui, name: &str, text: &mut String, is_wrong: bool) -> Response {
    let mut field = TextEdit::singleline(text);
    if is_wrong {
        field = field.text_color(ThemeColours::of(ui.visuals()).error);
    }
    let size = vec2(FIELD_WIDTH, ui.spacing().interact_size.y);
    let layout = Layout::left_to_right(Align::Center);
    let shown = ui.allocate_ui_with_layout(size, layout, |ui| {
        show_edit(ui, &name, field.desired_width(size.x).min_size(size))
    });
    shown.inner.accessible_name(format!("parameter {name}"))
}

/// The button that writes it into the file, which cannot be if `why_not` states so.
fn show_set_button(ui: &mut egui::Ui, name: &str, why_not: Option<&str>) -> bool {
    let set = ui.add_enabled(why_not.is_none(), Button::new("Set"));
    let set = set.on_hover_text("Writes it into the file");
    let set = set.on_disabled_hover_text(why_not.unwrap_or_default());
    set.accessible_name(format!("set {name}")).clicked()
}

fn show_unit(ui: &mut egui::Ui, parameter: &ListedParameter) {
    if parameter.live {
        ui.weak("live").on_hover_text("A change reaches the running component.");
    } else {
        ui.weak(&parameter.unit);
    }
}

/// Why a value was refused, and what it may be.
fn show_refusal(ui: &mut egui::Ui, result: &SetReport, parameter: &ListedParameter) {
    let colours = ThemeColours::of(ui.visuals());
    let found = result.findings.iter().filter(|finding| finding.severity == FindingSeverity::Error);
    let found: Vec<_> = found.collect();
    if found.is_empty() {
        ui.colored_label(colours.error, printable(ui, &result.text));
    }
    for finding in found {
        ui.colored_label(
            colours.error,
            printable(ui, &format!("{}: {}", finding.code, finding.message)),
        );
        if !finding.remedy.is_empty() {
            ui.weak(printable(ui, &finding.remedy));
        }
    }
    let has_remedy = result.findings.iter().any(|finding| !finding.remedy.is_empty());
    if let Some(range) = range(parameter).filter(|_| !has_remedy) {
        ui.weak(printable(ui, &format!("It may be: {range}.")));
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

/// Shows the result of the last request, if the file was changed; a refusal is shown at its field.
fn show_result(
    ui: &mut egui::Ui,
    client: &ParameterClient,
    component: &str,
    colours: &ThemeColours,
) {
    let Some(result) = client.last_result().filter(|result| result.is_set) else { return };
    if result.parameter.split('.').next() == Some(component) {
        ui.colored_label(colours.good, printable(ui, &result.text));
        for finding in &result.findings {
            let text = format!("{}: {}; {}", finding.code, finding.message, finding.remedy);
            ui.colored_label(colours.warning, printable(ui, &text));
        }
    }
}
