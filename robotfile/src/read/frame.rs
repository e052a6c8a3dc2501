//! `<frame>` → [`PlacedFrame`].

use std::sync::Arc;

use armor_wire::quantity::Dimension;
use armor_wire::text_format::FixedFrame;

use crate::fields::ElementFields;
use crate::findings::Findings;
use crate::model::PlacedFrame;
use crate::source::Source;
use crate::tree::Element;

/// Reads a frame. A number that is malformed, which is a finding then, counts as 0, so that the
/// frame is known to those that name it.
pub(super) fn read(
    element: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<PlacedFrame> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    let parent = fields.required_name("in");
    let mut number = |attribute, dimension| {
        fields.number_in(attribute, dimension).map_or(0.0, |number| number.value)
    };
    let translation_m = ["x", "y", "z"].map(|axis| number(axis, Dimension::Length));
    let rotation_rad = ["roll", "pitch", "yaw"].map(|axis| number(axis, Dimension::Angle));
    fields.finish(&[]);
    let (name, parent) = (name?, parent?);
    let fixed = FixedFrame {
        name: name.value.clone(),
        parent: parent.value.clone(),
        translation_m,
        rotation_rad,
    };
    Some(PlacedFrame { name, parent, fixed })
}
