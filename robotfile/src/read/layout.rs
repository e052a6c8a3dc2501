//! `<layout>` → the blocks in it. All other content belongs to the programs that wrote it.

use std::sync::Arc;

use crate::model::LayoutBlock;
use crate::read::limits::MAX_ELEMENTS;
use crate::source::{Location, Source, Spanned};
use crate::tree::Element;

/// The blocks of a layout that are checked: one for each component, place and transition that there
/// may be.
const MAX_BLOCKS: usize = 2 * MAX_ELEMENTS;

/// Adds the blocks of a layout, however deep they are in it. Recursion is bounded by the tree's
/// depth.
pub(super) fn read(layout: &Element, source: &Arc<Source>, blocks: &mut Vec<LayoutBlock>) {
    for element in layout.elements() {
        if element.name == "block" && blocks.len() < MAX_BLOCKS {
            blocks.push(read_block(element, source));
        }
        read(element, source, blocks);
    }
}

fn read_block(element: &Element, source: &Arc<Source>) -> LayoutBlock {
    let value = |name: &str| {
        let attribute = element.attribute(name)?;
        let at = Location::new(source, attribute.value_span);
        Some(Spanned::new(attribute.value.clone(), at))
    };
    let is_number = |text: &str| text.trim().parse().is_ok_and(f64::is_finite);
    let coordinates = ["x", "y"].into_iter().filter_map(|name| Some((name, value(name)?)));
    LayoutBlock {
        of: value("of"),
        transition: value("transition"),
        not_numbers: coordinates.filter(|(_, value)| !is_number(&value.value)).collect(),
    }
}
