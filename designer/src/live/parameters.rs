//! The parameters of a component that runs, and setting them: configd judges the file as it would
//! be, writes it and says when the change takes effect.

use armor_look::ParameterDesk;
use armor_wire::config::ListedParameter;
use eframe::egui::{self, Grid, TextEdit};

use super::session::Watched;
use super::words::said;
use crate::theme::Colours;

/// How wide a field is, in points: a number with its unit, or the end of a path.
const FIELD_WIDTH: f32 = 110.0;

/// What is being written into a field.
#[derive(Debug, Default)]
pub struct Panel {
    draft: Option<(String, String)>,
    /// The version of the file that the running system had when they were listed.
    asked: Option<u64>,
}

impl Panel {
    /// Shows the parameters of `component`.
    pub fn show(&mut self, ui: &mut egui::Ui, watched: &Watched, component: &str) {
        let desk = &watched.parameters;
        self.ask(watched);
        let Some(listed) = desk.listed() else {
            ui.weak("asking for them");
            return;
        };
        let colours = Colours::of(ui.visuals());
        let listed = match listed.as_ref() {
            Ok(listed) => listed,
            Err(problem) => {
                ui.colored_label(colours.warning, said(ui, problem));
                if ui.button("Ask again").clicked() {
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
            ui.weak("It has none.");
        }
        Grid::new(("live parameters", component)).num_columns(3).striped(true).show(ui, |ui| {
            for parameter in own {
                self.row(ui, desk, parameter);
                ui.end_row();
            }
        });
        answer(ui, desk, component, &colours);
    }

    /// Lists them once, and again when the running system has another version of the file.
    fn ask(&mut self, watched: &Watched) {
        let marking = watched.mission.look().marking;
        let version = marking.map_or(0, |marking| marking.version);
        if self.asked != Some(version) {
            self.asked = Some(version);
            watched.parameters.list();
        }
    }

    fn row(&mut self, ui: &mut egui::Ui, desk: &ParameterDesk, parameter: &ListedParameter) {
        let name = format!("{}.{}", parameter.component, parameter.name);
        ui.label(&parameter.name).on_hover_text(said(ui, &about(parameter)));
        let mut text = match &self.draft {
            Some((own, text)) if *own == name => text.clone(),
            _ => parameter.value.clone(),
        };
        // A grid gives a field no width of its own.
        let size = egui::vec2(FIELD_WIDTH, ui.spacing().interact_size.y);
        let response = ui
            .add_sized(size, TextEdit::singleline(&mut text))
            .accessible_name(format!("parameter {name}"));
        let is_other = text != parameter.value;
        if response.changed() {
            self.draft = Some((name.clone(), text.clone()));
        }
        let entered = response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let escaped = response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Escape));
        if escaped {
            self.draft = None;
        }
        ui.horizontal(|ui| {
            if is_other {
                let set = ui.button("Set").accessible_name(format!("set {name}"));
                if set.on_hover_text("Writes it into the file").clicked() || entered {
                    desk.set(&parameter.component, &parameter.name, Some(&text));
                    self.draft = None;
                }
            } else if parameter.live {
                ui.weak("live").on_hover_text("A change reaches the running component.");
            } else {
                ui.weak(&parameter.unit);
            }
        });
    }
}

fn about(parameter: &ListedParameter) -> String {
    let mut lines = Vec::new();
    if !parameter.doc.is_empty() {
        lines.push(parameter.doc.clone());
    }
    if !parameter.range.is_empty() {
        lines.push(format!("{} {} {}", parameter.kind, parameter.range, parameter.unit));
    }
    lines.push(format!("from {}", parameter.origin));
    lines.join("\n")
}

/// What became of the last wish.
fn answer(ui: &mut egui::Ui, desk: &ParameterDesk, component: &str, colours: &Colours) {
    let Some(told) = desk.told() else { return };
    if told.parameter.split('.').next() != Some(component) {
        return;
    }
    ui.colored_label(if told.is_set { colours.good } else { colours.error }, said(ui, &told.text));
    for finding in &told.findings {
        ui.label(said(ui, &format!("{}: {}", finding.code, finding.message)));
        if !finding.remedy.is_empty() {
            ui.weak(said(ui, &finding.remedy));
        }
    }
}
