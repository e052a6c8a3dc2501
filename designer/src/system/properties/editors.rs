//! An editor for each type of parameter. A mistake is described next to its value.

use armor_robotfile::model::Component;
use armor_wire::manifest::{ParameterManifest, ParameterType};
use armor_wire::quantity::{self, Unit};
use eframe::egui::{self, Color32, ComboBox, RichText, Slider};

use crate::panels::fields::Form;
use crate::panels::path::{Chosen, PathChoice};
use crate::system::docs;
use crate::system::properties::field::Field;
use crate::system::state::SystemView;
use crate::workspace::Workspace;

impl SystemView {
    pub(super) fn parameter(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &mut Workspace,
        component: &Component,
        parameter: &ParameterManifest,
    ) {
        let owner = &component.name.value;
        let given = component.parameter(&parameter.name).map(|given| given.value.value.clone());
        let field = Field::Parameter(owner.clone(), parameter.name.clone());
        let current = given.clone().unwrap_or_default();
        self.heading(ui, parameter, given.is_some(), owner);
        match parameter.kind {
            ParameterType::Flag => self.flag(ui, &field, parameter, given.as_deref()),
            ParameterType::Choice => self.choice(ui, &field, parameter, given.as_deref()),
            ParameterType::Colour => self.colour(ui, &field, parameter, &current),
            ParameterType::Path => self.path(ui, workspace, &field, parameter, &current),
            ParameterType::Number | ParameterType::Integer => {
                self.number(ui, &field, parameter, &current);
            }
            ParameterType::Text => self.value(ui, &field, parameter, &current, 0.0),
        }
        let written = self.drafts.writing(&field).map(ToOwned::to_owned).or(given);
        if let Some(Err(problem)) = written.map(|text| parameter.parse(&text)) {
            ui.label(RichText::new(problem).small().color(ui.visuals().error_fg_color));
        }
    }

    /// The field in which a value is written. If one was asked for, the first that needs a value
    /// gets the focus.
    fn value(
        &mut self,
        ui: &mut egui::Ui,
        field: &Field,
        parameter: &ParameterManifest,
        current: &str,
        width: f32,
    ) {
        let (name, hint) = (name_of(parameter), docs::value(parameter));
        let form = Form { name: &name, hint: &hint, width, rows: 1 };
        let check = |text: &str| judged(parameter, text);
        let response = self.drafts.text(ui, field, current, form, &check);
        if parameter.default.is_none() && current.is_empty() {
            self.focus(&response);
        }
    }

    /// The name, what it does, its range, and the button that restores the default.
    fn heading(
        &mut self,
        ui: &mut egui::Ui,
        parameter: &ParameterManifest,
        is_given: bool,
        owner: &str,
    ) {
        ui.horizontal(|ui| {
            let needs = parameter.default.is_none() && !is_given;
            let mut name = RichText::new(&parameter.name);
            if is_given {
                name = name.strong();
            }
            let label = ui.label(name);
            if !parameter.doc.is_empty() {
                label.on_hover_text(crate::text::paintable(ui.ctx(), &parameter.doc).into_owned());
            }
            if needs {
                ui.colored_label(ui.visuals().error_fg_color, "needs a value");
            }
            let range = parameter.range_with_unit();
            let unit = if range.is_empty() { parameter.unit.clone() } else { range };
            if !unit.is_empty() {
                ui.label(RichText::new(unit).small().weak());
            }
            if parameter.live {
                let live = ui.label(RichText::new("live").small().weak());
                live.on_hover_text("A change reaches the running component immediately.");
            }
            if is_given {
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let reset =
                        ui.button("reset").accessible_name(format!("reset {}", parameter.name));
                    let doc = format!(
                        "Removes the value from the file; the default is: {}",
                        docs::value(parameter)
                    );
                    if reset
                        .on_hover_text(crate::text::paintable(ui.ctx(), &doc).into_owned())
                        .clicked()
                    {
                        self.drafts
                            .set(Field::NoParameter(owner.to_owned(), parameter.name.clone()), "");
                    }
                });
            }
        });
    }

    fn flag(
        &mut self,
        ui: &mut egui::Ui,
        field: &Field,
        parameter: &ParameterManifest,
        given: Option<&str>,
    ) {
        let name = name_of(parameter);
        let value = given.or(parameter.default.as_deref());
        let mut is_on = value == Some("true");
        let text = if is_on { "yes" } else { "no" };
        let check = ui.checkbox(&mut is_on, text);
        let check = check.accessible_name(name);
        if check.changed() {
            self.drafts.set(field.clone(), if is_on { "true" } else { "false" });
        }
    }

    fn choice(
        &mut self,
        ui: &mut egui::Ui,
        field: &Field,
        parameter: &ParameterManifest,
        given: Option<&str>,
    ) {
        let name = name_of(parameter);
        let default = parameter.default.as_ref().map(|default| format!("{default} (default)"));
        let shown = given.map(ToOwned::to_owned).or(default).unwrap_or_else(|| "choose".into());
        let combo = ComboBox::from_id_salt(&parameter.name).selected_text(shown);
        let combo = combo.width(ui.available_width()).show_ui(ui, |ui| {
            for choice in &parameter.choices {
                if ui.selectable_label(given == Some(choice), choice).clicked() {
                    self.drafts.set(field.clone(), choice.as_str());
                }
            }
        });
        combo.response.accessible_name(name);
    }

    fn colour(
        &mut self,
        ui: &mut egui::Ui,
        field: &Field,
        parameter: &ParameterManifest,
        current: &str,
    ) {
        ui.horizontal(|ui| {
            let text = if current.is_empty() {
                parameter.default.as_deref().unwrap_or("")
            } else {
                current
            };
            let written = self.drafts.writing(field).unwrap_or(text);
            let mut colour = Color32::from_hex(written).unwrap_or(Color32::GRAY);
            let button = ui.color_edit_button_srgba(&mut colour);
            if button.changed() {
                let [r, g, b, _] = colour.to_array();
                self.drafts.begin(field.clone(), format!("#{r:02x}{g:02x}{b:02x}"));
            }
            button.accessible_name(format!("colour of {}", parameter.name));
            self.value(ui, field, parameter, current, 0.0);
        });
    }

    fn number(
        &mut self,
        ui: &mut egui::Ui,
        field: &Field,
        parameter: &ParameterManifest,
        current: &str,
    ) {
        let range = parameter.minimum.zip(parameter.maximum);
        let Some((low, high)) = range.filter(|_| !has_range_of_type(parameter)) else {
            self.value(ui, field, parameter, current, 0.0);
            return;
        };
        ui.horizontal(|ui| {
            self.value(ui, field, parameter, current, 90.0);
            let written = self.drafts.writing(field).unwrap_or(current);
            let written = if written.is_empty() {
                parameter.default.as_deref().unwrap_or("")
            } else {
                written
            };
            let unit = Unit::named(&parameter.unit);
            let to_si = unit.map_or(1.0, |unit| unit.to_si);
            let size = unit.map_or(1.0, Unit::received_size);
            let own = |received: f64| received / size;
            let read = quantity::parse(written).ok();
            let mut value = match read {
                Some(quantity) if quantity.unit.is_some() => quantity.si / to_si,
                Some(quantity) => quantity.si,
                None => own(low),
            };
            let mut slider = Slider::new(&mut value, own(low)..=own(high)).show_value(false);
            if parameter.kind == ParameterType::Integer {
                slider = slider.integer();
            } else if low > 0.0 && high / low > 100.0 {
                slider = slider.logarithmic(true);
            }
            ui.spacing_mut().slider_width = (ui.available_width() - 12.0).max(40.0);
            let slider = ui.add(slider).accessible_name(format!("slider of {}", parameter.name));
            if slider.drag_started() {
                // Otherwise the field that has the focus would receive the keys, such as undo.
                slider.request_focus();
            }
            if slider.changed() {
                let number = rounded(value, own(high) - own(low), parameter.kind);
                self.drafts.begin(field.clone(), format!("{number}{}", parameter.unit));
            }
            if slider.drag_stopped() || slider.lost_focus() {
                self.drafts.end();
            }
        });
    }

    fn path(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &mut Workspace,
        field: &Field,
        parameter: &ParameterManifest,
        current: &str,
    ) {
        ui.horizontal(|ui| {
            let width = (ui.available_width() - 70.0).max(60.0);
            self.value(ui, field, parameter, current, width);
            let button = ui.button("choose").accessible_name(format!("choose {}", parameter.name));
            if button.clicked() {
                let choice = PathChoice::new(&workspace.project.folder(), current, "", false);
                self.choosing = Some((field.clone(), choice));
            }
        });
        let Some((wanted, mut choice)) = self.choosing.take_if(|(wanted, _)| wanted == field)
        else {
            return;
        };
        let modal = egui::Modal::new(egui::Id::unique("choose a path"));
        let chosen = modal.show(ui.ctx(), |ui| {
            ui.set_width(460.0);
            ui.heading(format!("Choose {}", parameter.name));
            choice.show(ui, "Choose")
        });
        match chosen.inner {
            Chosen::Open => self.choosing = Some((wanted, choice)),
            Chosen::Left => {}
            Chosen::File(path) => {
                // Paths in a file are relative to it.
                let folder = workspace.project.folder();
                let path = path.strip_prefix(&folder).unwrap_or(&path);
                self.drafts.set(wanted, path.to_string_lossy());
            }
        }
    }
}

/// What screen readers and tests call the editor; the name alone is the label above it.
fn name_of(parameter: &ParameterManifest) -> String {
    format!("parameter {}", parameter.name)
}

fn judged(parameter: &ParameterManifest, text: &str) -> Result<(), String> {
    if text.is_empty() { Ok(()) } else { parameter.parse(text).map(|_| ()) }
}

/// Whether its range is only that of the type of 32 bits that holds it: no slider can be set in it.
fn has_range_of_type(parameter: &ParameterManifest) -> bool {
    let width = parameter.maximum.zip(parameter.minimum).map(|(high, low)| high - low);
    parameter.kind == ParameterType::Integer && width >= Some(f64::from(u32::MAX))
}

/// A number from a slider with as many digits as the slider has steps.
fn rounded(value: f64, range: f64, kind: ParameterType) -> String {
    if kind == ParameterType::Integer {
        return format!("{}", value.round());
    }
    let digits = (3.0 - range.abs().max(1e-9).log10()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_of_a_type_gets_no_slider() {
        let parameter = |minimum: f64, maximum: f64| ParameterManifest {
            name: "count".into(),
            kind: ParameterType::Integer,
            unit: String::new(),
            default: None,
            minimum: Some(minimum),
            maximum: Some(maximum),
            choices: Vec::new(),
            format: None,
            doc: String::new(),
            live: false,
            written: false,
        };
        assert!(has_range_of_type(&parameter(0.0, f64::from(u32::MAX))));
        assert!(has_range_of_type(&parameter(f64::from(i32::MIN), f64::from(i32::MAX))));
        assert!(!has_range_of_type(&parameter(0.0, 65535.0)));
    }

    #[test]
    fn a_slider_writes_as_many_digits_as_it_has_steps() {
        assert_eq!(rounded(0.123_456, 1.0, ParameterType::Number), "0.123");
        assert_eq!(rounded(12.000_1, 100.0, ParameterType::Number), "12");
        assert_eq!(rounded(12.6, 100.0, ParameterType::Integer), "13");
        assert_eq!(rounded(1234.6, 50_000.0, ParameterType::Number), "1235");
    }
}
