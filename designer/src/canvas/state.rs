//! How a drawing is looked at: where, how large, what is selected, what is being dragged.

use std::collections::HashMap;

use eframe::egui::{self, Popup, Pos2, Rect, Sense, Stroke, StrokeKind};

use crate::canvas::arrange::SHAPE;
use crate::canvas::cells::CellIndex;
use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::event::CanvasEvent;
use crate::canvas::gesture::Gesture;
use crate::canvas::hit::Hit;
use crate::canvas::rules::JoinRules;
use crate::canvas::selection::Selection;
use crate::canvas::snap::snapped;
use crate::canvas::viewport::Viewport;
use armor_picture::theme::ThemeColours;

/// The result of showing the drawing.
pub struct CanvasOutput<Id> {
    /// The user's actions.
    pub events: Vec<CanvasEvent<Id>>,
    /// The response of the whole drawing, for drops, menus and focus.
    pub response: egui::Response,
    /// What the pointer is over.
    pub hovered: Option<Hit>,
}

/// The view of a drawing: position, zoom, selection, and what is being dragged.
pub struct Canvas<Id> {
    pub(super) name: &'static str,
    /// Which part is shown, and how large.
    pub viewport: Viewport,
    /// What is selected.
    pub selection: Selection<Id>,
    /// Whether moved nodes are aligned with the grid.
    pub snap: bool,
    /// Whether the small map is shown.
    pub minimap: bool,
    /// Whether the drawing can be changed.
    pub is_editable: bool,
    /// Whether the dots of the grid are shown.
    pub has_dots: bool,
    pub(super) gesture: Gesture<Id>,
    pub(super) grid: CellIndex,
    /// The area to fit into the window once its size is known.
    pub(super) fit: Option<FitTarget>,
    pub(super) rect: Rect,
    /// Where texts of bars and wires are painted in this frame.
    pub(super) labels: Vec<Rect>,
    /// How many lines of the text of a bar are painted in this frame.
    pub(super) bar_lines: HashMap<usize, usize>,
    /// The links that are drawn one by one, because the pointer is at their bundle: its two ends.
    pub(super) open_bundle: Option<(Id, Id)>,
    /// When a wheel was turned last, in seconds.
    pub(super) wheel_turned: f64,
    /// Whether the whole drawing stays fitted into the window: until the user moves the view.
    pub(super) stays_fitted: bool,
    /// Where in the drawing the pointer is, if it is over it.
    pub(super) pointer: Option<Pos2>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FitTarget {
    Everything,
    Area(Rect),
}

impl<Id: DiagramId> Canvas<Id> {
    /// A canvas called `name` by screen readers, which shows all of its drawing at first.
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            viewport: Viewport::default(),
            selection: Selection::default(),
            snap: true,
            minimap: true,
            is_editable: true,
            has_dots: true,
            gesture: Gesture::Idle,
            grid: CellIndex::default(),
            fit: Some(FitTarget::Everything),
            rect: Rect::ZERO,
            labels: Vec::new(),
            bar_lines: HashMap::new(),
            open_bundle: None,
            wheel_turned: f64::NEG_INFINITY,
            stays_fitted: true,
            pointer: None,
        }
    }

    /// Adapts to a new drawing: items that are no longer in it are deselected.
    pub fn drawing_changed(&mut self, diagram: &Diagram<Id>) {
        self.grid = CellIndex::of(diagram);
        self.selection.retain(|item| diagram.holds(item));
        self.gesture = Gesture::Idle;
    }

    /// Shows everything in the next frame.
    pub fn fit_everything(&mut self) {
        self.stays_fitted = true;
        self.fit = Some(FitTarget::Everything);
    }

    /// The same, unless the user has moved the view since.
    pub fn fit_again(&mut self) {
        if self.stays_fitted {
            self.fit = Some(FitTarget::Everything);
        }
    }

    /// Shows this part of the drawing in the next frame.
    pub fn fit_area(&mut self, area: Rect) {
        self.fit = Some(FitTarget::Area(area));
    }

    /// Where the canvas is in the window.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// The width of the canvas to its height; before it is shown, that of most windows.
    pub fn shape(&self) -> f32 {
        if self.rect.is_positive() { self.rect.aspect_ratio() } else { SHAPE }
    }

    /// The point of the drawing under a point of the window.
    pub fn to_drawing(&self, point: Pos2) -> Pos2 {
        self.viewport.to_drawing(self.rect, point)
    }

    /// The point of the window where a point of the drawing is shown.
    pub fn to_window(&self, point: Pos2) -> Pos2 {
        self.viewport.to_window(self.rect, point)
    }

    /// The middle of what is shown, on the grid.
    pub fn centre(&self) -> Pos2 {
        snapped(self.viewport.centre)
    }

    /// The position of a new item: at the pointer if it is over the drawing, otherwise in the
    /// middle.
    pub fn spot(&self) -> Pos2 {
        let shown = self.viewport.shown(self.rect);
        snapped(self.pointer.filter(|at| shown.contains(*at)).unwrap_or(self.viewport.centre))
    }

    /// Returns whether something is being dragged.
    pub fn is_busy(&self) -> bool {
        !matches!(self.gesture, Gesture::Idle)
    }

    /// Cancels the current gesture. Returns whether there was one.
    pub fn cancel(&mut self) -> bool {
        !matches!(std::mem::take(&mut self.gesture), Gesture::Idle)
    }

    /// Changes the size at which the drawing is shown, about its middle.
    pub fn zoom_by(&mut self, factor: f32) {
        self.viewport.zoom_at(self.rect, self.rect.center(), factor);
        self.stays_fitted = false;
    }

    /// Shows the drawing at actual size. Of an empty one, it shows where the first item goes.
    pub fn show_actual_size(&mut self, diagram: &Diagram<Id>) {
        match diagram.extent() {
            Some(_) => {
                self.viewport.zoom = 1.0;
                self.stays_fitted = false;
            }
            None => {
                self.viewport = Viewport::default();
                self.stays_fitted = true;
            }
        }
    }

    /// Shows the drawing and handles the user's actions.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        diagram: &Diagram<Id>,
        rules: &dyn JoinRules,
    ) -> CanvasOutput<Id> {
        let size = ui.available_size();
        let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
        let response = ui.interact(rect, ui.scope_id().with(self.name), Sense::click_and_drag());
        if self.stays_fitted && self.rect.size() != rect.size() {
            self.fit = Some(FitTarget::Everything);
        }
        self.rect = rect;
        self.apply_fit(diagram);
        let fitted = self.viewport;
        let mut events = Vec::new();
        let in_map = self.minimap && self.drag_map(ui, diagram, &response);
        if !in_map {
            self.navigate_view(ui, &response);
        }
        let pointer = response.hover_pos().or_else(|| response.interact_pointer_pos());
        let hovered =
            pointer.filter(|_| !in_map).and_then(|at| self.hit(diagram, self.to_drawing(at)));
        // A dialog in which something is chosen for the drawing covers it.
        if ui.memory(|memory| memory.top_modal_layer().is_none()) {
            self.pointer = response.hover_pos().map(|at| self.to_drawing(at));
        }
        self.open_hovered_bundle(diagram, pointer.filter(|_| !in_map), hovered);
        if !in_map {
            self.handle_pointer(ui, diagram, rules, &response, hovered, &mut events);
        }
        // The drawing takes the keyboard unless another widget needs it.
        let is_free = ui.memory(|m| m.focused().is_none() && m.top_modal_layer().is_none());
        if is_free && !Popup::is_any_open(ui.ctx()) {
            response.request_focus();
        }
        if response.has_focus() {
            self.handle_keys(ui, &response, diagram, &mut events);
        }
        self.stays_fitted &= self.viewport == fitted && !self.is_busy();
        let colours = ThemeColours::of(ui.visuals());
        self.paint(ui, diagram, rules, hovered, colours);
        if response.has_focus() {
            let line = Stroke::new(1.0, colours.accent);
            ui.painter().rect_stroke(rect, 0.0, line, StrokeKind::Inside);
        }
        self.describe_drawing(ui, &response, diagram);
        CanvasOutput { events, response, hovered }
    }

    fn apply_fit(&mut self, diagram: &Diagram<Id>) {
        if self.rect.width() < 10.0 {
            return;
        }
        match self.fit.take() {
            Some(FitTarget::Everything) => {
                if let Some(bounds) = diagram.extent() {
                    self.viewport.fit(self.rect, bounds, 1.0);
                }
            }
            Some(FitTarget::Area(area)) => self.viewport.fit(self.rect, area, 1.25),
            None => {}
        }
    }
}
