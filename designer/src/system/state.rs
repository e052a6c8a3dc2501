//! What the view of the system keeps from frame to frame.

use super::choices::SystemPicker;
use super::drawing::SystemDrawing;
use super::folding::draw_folded;
use super::palette::SystemPalette;
use super::properties::field::{Field, Focus};
use crate::diagram_pane::DiagramPane;
use crate::panels::fields::Drafts;
use crate::panels::path::PathChoice;
use crate::view::View;
use crate::workspace::Workspace;

/// The view of the system.
pub struct SystemView {
    pub(super) pane: DiagramPane,
    pub(super) drawing: SystemDrawing,
    /// What the drawing was made of: the revision, and whether its findings were there.
    drawn: Option<(u64, u64, bool)>,
    pub(super) palette: SystemPalette,
    pub(super) drafts: Drafts<Field>,
    /// A part of the names of the parameters that are shown, and whether only changed ones are.
    pub(super) parameter_words: String,
    pub(super) only_changed: bool,
    pub(super) picker: Option<SystemPicker>,
    /// A file that is being chosen for a parameter.
    pub(super) choosing: Option<(Field, PathChoice)>,
    /// Which field of the properties is to get the focus.
    pub(super) wants_focus: Focus,
}

impl SystemView {
    /// Creates a view that shows the whole system at first.
    pub fn new() -> Self {
        Self {
            pane: DiagramPane::new("drawing of the system", View::System),
            drawing: SystemDrawing::default(),
            drawn: None,
            palette: SystemPalette::default(),
            drafts: Drafts::default(),
            parameter_words: String::new(),
            only_changed: false,
            picker: None,
            choosing: None,
            wants_focus: Focus::Nothing,
        }
    }

    /// Draws the system again if it or its findings have changed.
    pub(super) fn update(&mut self, workspace: &Workspace) {
        let checked = workspace.project.checked();
        let now = (workspace.project.revision(), checked.revision, checked.is_complete);
        if self.drawn == Some(now) {
            return;
        }
        self.drawing = draw_folded(&workspace.project);
        self.pane.set_drawing(&self.drawing.diagram);
        if workspace.project.undoable().is_none() {
            // Nothing has been edited: the kinds have just arrived, and blocks have grown by their
            // ports, so that what was fitted no longer fits.
            self.pane.canvas.fit_again();
        }
        self.drawn = Some(now);
    }
}

impl Default for SystemView {
    fn default() -> Self {
        Self::new()
    }
}
