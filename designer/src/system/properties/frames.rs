//! The frames of the system: where things are fixed on others. Each is a line of the panel; what is
//! written there is what the file has.

use armor_robotfile::model::System;
use armor_robotfile::{BASE_FRAME, Document, Item as Named};
use armor_wire::quantity::{self, Dimension};
use eframe::egui;

use crate::panels::fields::Form;
use crate::project::Refused;
use crate::system::properties::field::{Field, check_name};
use crate::system::state::SystemView;
use crate::workspace::Workspace;

/// The measures of a frame: the attribute, the quantity, an example, and what it is.
const MEASURES: [(&str, Dimension, &str, &str); 6] = [
    ("x", Dimension::Length, "0m", "ahead of its parent's origin"),
    ("y", Dimension::Length, "0m", "to the left of its parent's origin"),
    ("z", Dimension::Length, "0m", "above its parent's origin"),
    ("roll", Dimension::Angle, "0deg", "turned about x"),
    ("pitch", Dimension::Angle, "0deg", "then about y"),
    ("yaw", Dimension::Angle, "0deg", "then about z, anticlockwise"),
];
/// The width of a name: with two of them and a button the panel is not wider than its default.
const NAME_WIDTH: f32 = 74.0;
/// The width of a measure: three of them are in a row.
const MEASURE_WIDTH: f32 = 64.0;

impl SystemView {
    /// The frames of the system, and a button for another one.
    pub(super) fn show_frames(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &Workspace,
        system: &System,
    ) {
        let document = workspace.project.document_with(Named::System);
        let written = |frame: &str, attribute: &str| {
            let document = document?;
            let path = document.find(Named::Frame(frame))?;
            Some(document.tree().element(&path)?.attribute(attribute)?.value.clone())
        };
        ui.separator();
        ui.strong("Frames").on_hover_text("Where sensors and parts are fixed on the robot.");
        for frame in &system.frames {
            let name = frame.name.value.as_str();
            ui.push_id(("frame", name), |ui| {
                self.show_parent(ui, name, &frame.parent.value);
                // In a narrow panel two next to each other.
                let in_row = if ui.available_width() < 4.0 * MEASURE_WIDTH { 2 } else { 3 };
                for row in MEASURES.chunks(in_row) {
                    ui.horizontal(|ui| {
                        for measure in row {
                            let value = written(name, measure.0).unwrap_or_default();
                            // The label above the field: three next to each other are too wide.
                            ui.vertical(|ui| self.show_measure(ui, name, &value, *measure));
                        }
                    });
                }
            });
            ui.add_space(armor_picture::theme::NEAR);
        }
        if ui.button("Add a frame").clicked() {
            self.drafts.set(Field::NewFrame, choose_name(system));
        }
    }

    /// The names of a frame and its parent, and the button that removes the frame.
    fn show_parent(&mut self, ui: &mut egui::Ui, name: &str, parent: &str) {
        ui.horizontal_wrapped(|ui| {
            for (attribute, value) in [("name", name), ("in", parent)] {
                let label = format!("frame {name} {attribute}");
                let form = Form { name: &label, hint: attribute, width: NAME_WIDTH, rows: 1 };
                let field = Field::Frame(name.to_owned(), attribute);
                self.drafts.text(ui, &field, value, form, &check_name);
                if attribute == "name" {
                    ui.label("in");
                }
            }
            let remove = ui.button("remove").accessible_name(format!("remove frame {name}"));
            if remove.clicked() {
                self.drafts.set(Field::NoFrame(name.to_owned()), "");
            }
        });
    }

    fn show_measure(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        value: &str,
        (attribute, dimension, example, doc): (&'static str, Dimension, &'static str, &str),
    ) {
        ui.label(attribute).on_hover_text(doc);
        let label = format!("frame {name} {attribute}");
        let form = Form { name: &label, hint: example, width: MEASURE_WIDTH, rows: 1 };
        let field = Field::Frame(name.to_owned(), attribute);
        self.drafts.text(ui, &field, value, form, &|text| match text {
            "" => Ok(()),
            text => quantity::parse_in(text, dimension, example)
                .map(drop)
                .map_err(|why| why.to_string()),
        });
    }
}

/// A name for a new frame that no other has.
fn choose_name(system: &System) -> String {
    let is_free = |name: &String| system.frames.iter().all(|frame| frame.name.value != *name);
    let numbered = (2..).map(|number| format!("frame{number}"));
    ["laser".to_owned(), "camera".to_owned()]
        .into_iter()
        .chain(numbered)
        .find(is_free)
        .unwrap_or_default()
}

/// Adds a frame at the origin of the robot's base.
pub(super) fn add_frame(document: &mut Document, name: &str) -> Result<(), Refused> {
    Ok(document.add(Named::Frame(name), &[("in", BASE_FRAME), ("x", "0m"), ("z", "0m")])?)
}

/// Sets an attribute of a frame; an empty text removes a measure, which is 0 then.
pub(super) fn write_frame(
    document: &mut Document,
    name: &str,
    attribute: &str,
    text: &str,
) -> Result<(), Refused> {
    let value = Some(text.trim()).filter(|text| !text.is_empty());
    Ok(document.set_attribute(Named::Frame(name), attribute, value)?)
}

/// Removes a frame.
pub(super) fn remove_frame(document: &mut Document, name: &str) -> Result<(), Refused> {
    Ok(document.remove(Named::Frame(name))?)
}
