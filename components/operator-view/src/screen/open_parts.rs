//! What the operator has opened: lists, help and the large image. Escape closes it.

use eframe::egui::{Context, Id};

/// A part of the screen that can be opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OpenPart {
    /// The list of alerts.
    Alerts,
    /// The table of links.
    Links,
    /// The image, large.
    Image,
    /// The switches of the layers, in a small window.
    Layers,
    /// What keys and pointer do.
    Help,
}

const KEY: &str = "open parts";

fn list_open(context: &Context) -> Vec<OpenPart> {
    context.data(|data| data.get_temp(Id::unique(KEY)).unwrap_or_default())
}

/// Returns whether a part is open.
pub(crate) fn is_open(context: &Context, part: OpenPart) -> bool {
    list_open(context).contains(&part)
}

/// Opens a part, or closes it.
pub(crate) fn toggle(context: &Context, part: OpenPart) {
    let mut open = list_open(context);
    if open.contains(&part) {
        open.retain(|other| *other != part);
    } else {
        open.push(part);
    }
    context.data_mut(|data| data.insert_temp(Id::unique(KEY), open));
}

/// Closes what was opened last. Returns whether anything was open.
pub(super) fn close_last(context: &Context) -> bool {
    let mut open = list_open(context);
    let is_any = open.pop().is_some();
    context.data_mut(|data| data.insert_temp(Id::unique(KEY), open));
    is_any
}
