//! A drawing that is looked at, pointed at and dragged: nodes with ports, wires, groups and notes.
//!
//! [`Diagram`] is what is drawn, as plain data; [`Canvas`] is how one looks at it (where, how
//! large, what is selected, what is being dragged). Neither knows of files: gestures come out as
//! [`Event`]s, and what may be joined is asked of [`Rules`].

mod align;
pub mod arrange;
mod commands;
mod detour;
mod diagram;
mod edges;
mod gesture;
mod hit;
mod keyboard;
mod labels;
mod minimap;
mod names;
mod paint;
mod pointer;
mod telling;
mod view;

use std::collections::BTreeSet;

use eframe::egui::{self, Pos2, Rect, Sense, Vec2};

pub use align::{Alignment, align};
pub use diagram::{
    Badge, Decoration, Diagram, Direction, End, Line, Look, Mark, Node, Outline, Port, PortAt,
    Shape, Side, Wire,
};
pub use edges::{curve, path, wire_ends};
use gesture::Gesture;
use hit::Grid;
pub use hit::{Hit, NearestPort};
pub use view::Viewport;

use crate::item::Item;
use crate::theme::Colours;

/// Distance of the grid that positions keep to.
pub const GRID: f32 = 10.0;

/// What may be joined in a drawing.
pub trait Rules {
    /// Whether a wire between two ports is allowed, whichever it was dragged from; else why not, in
    /// a few words for a person.
    ///
    /// # Errors
    /// Why it is not allowed.
    fn may_join(&self, from: PortAt, to: PortAt) -> Result<(), String>;

    /// The same for a wire that is led elsewhere, whose other end stays at a port.
    ///
    /// # Errors
    /// Why it is not allowed.
    fn may_lead(&self, wire: usize, stays: PortAt, to: PortAt) -> Result<(), String> {
        let _ = wire;
        self.may_join(stays, to)
    }

    /// The wire that a drag from this port takes by its end, instead of beginning a new one.
    fn taken_by(&self, port: PortAt) -> Option<usize> {
        let _ = port;
        None
    }
}

/// What the user did.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Dragged what is selected.
    Moved(Vec2),
    /// Joined two ports that may be joined.
    Joined(PortAt, PortAt),
    /// Tried to join two that may not be.
    Refused(String),
    /// Let a wire go over nothing.
    Loose {
        /// The port it comes from.
        from: PortAt,
        /// Where, in the drawing.
        at: Pos2,
    },
    /// Took a wire by its end and let it go at another port, or nowhere.
    Rewired {
        /// The wire.
        wire: usize,
        /// The port that stays.
        stays: PortAt,
        /// The other end's new port.
        to: Option<PortAt>,
    },
    /// Clicked something twice.
    Opened(Item),
    /// Clicked the empty drawing twice, there.
    OpenedEmpty(Pos2),
    /// Asked for a menu.
    Menu {
        /// Of what; none is the drawing's own.
        of: Option<Item>,
        /// Where, in the drawing.
        at: Pos2,
    },
    /// Gave a group or note another size.
    Resized(Item, Rect),
}

/// What came of showing the drawing.
pub struct Shown {
    /// What the user did.
    pub events: Vec<Event>,
    /// The whole drawing as a widget: for drops, menus and focus.
    pub response: egui::Response,
    /// What the pointer is over.
    pub hovered: Option<Hit>,
}

/// How one looks at a drawing.
pub struct Canvas {
    name: &'static str,
    /// Which part is shown, and how large.
    pub viewport: Viewport,
    /// What is selected.
    pub selection: BTreeSet<Item>,
    /// Whether what is moved keeps to the grid.
    pub snap: bool,
    /// Whether the small map is shown.
    pub minimap: bool,
    /// Whether the drawing can be changed.
    pub is_editable: bool,
    /// Whether the dots of the grid are shown.
    pub has_dots: bool,
    gesture: Gesture,
    grid: Grid,
    /// What is to be fitted into the window once its size is known.
    fit: Option<Fit>,
    rect: Rect,
    /// When a wheel was turned last, in seconds.
    wheel_turned: f64,
    /// Whether everything stays fitted into the window: until one looks elsewhere.
    stays_fitted: bool,
    /// Where in the drawing the pointer is, or was last.
    pointer: Option<Pos2>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fit {
    Everything,
    Area(Rect),
}

impl Canvas {
    /// A canvas called `name` by screen readers, which shows all of its drawing at first.
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            viewport: Viewport::default(),
            selection: BTreeSet::new(),
            snap: true,
            minimap: true,
            is_editable: true,
            has_dots: true,
            gesture: Gesture::default(),
            grid: Grid::default(),
            fit: Some(Fit::Everything),
            rect: Rect::ZERO,
            wheel_turned: f64::NEG_INFINITY,
            stays_fitted: true,
            pointer: None,
        }
    }

    /// Takes notice of another drawing: what is not in it any more is not selected any more.
    pub fn drawing_changed(&mut self, diagram: &Diagram) {
        self.grid = Grid::of(diagram);
        self.selection.retain(|item| diagram.holds(item));
        self.gesture = Gesture::default();
    }

    /// Shows everything in the next frame.
    pub fn fit_everything(&mut self) {
        self.stays_fitted = true;
        self.fit = Some(Fit::Everything);
    }

    /// The same, unless one has looked elsewhere since.
    pub fn fit_again(&mut self) {
        if self.stays_fitted {
            self.fit = Some(Fit::Everything);
        }
    }

    /// Shows this part of the drawing in the next frame.
    pub fn fit_area(&mut self, area: Rect) {
        self.fit = Some(Fit::Area(area));
    }

    /// Where the canvas is in the window.
    pub fn rect(&self) -> Rect {
        self.rect
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

    /// Where something new goes: to the pointer if it is over the drawing, else into the middle.
    pub fn spot(&self) -> Pos2 {
        let shown = self.viewport.shown(self.rect);
        snapped(self.pointer.filter(|at| shown.contains(*at)).unwrap_or(self.viewport.centre))
    }

    /// Whether a drag is going on.
    pub fn is_busy(&self) -> bool {
        !matches!(self.gesture, Gesture::Idle)
    }

    /// Ends what is going on, as if it had not begun. Answers whether anything was.
    pub fn cancel(&mut self) -> bool {
        !matches!(std::mem::take(&mut self.gesture), Gesture::Idle)
    }

    /// Changes the size at which the drawing is shown, about its middle.
    pub fn zoom_by(&mut self, factor: f32) {
        self.viewport.zoom_at(self.rect, self.rect.center(), factor);
    }

    /// Shows the drawing and takes what the user does with it.
    pub fn show(&mut self, ui: &mut egui::Ui, diagram: &Diagram, rules: &dyn Rules) -> Shown {
        let size = ui.available_size();
        let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
        let response = ui.interact(rect, ui.scope_id().with(self.name), Sense::click_and_drag());
        if self.stays_fitted && self.rect.size() != rect.size() {
            self.fit = Some(Fit::Everything);
        }
        self.rect = rect;
        self.apply_fit(diagram);
        let fitted = self.viewport;
        let mut events = Vec::new();
        let in_map = self.minimap && self.drag_map(ui, diagram, &response);
        if !in_map {
            self.navigate(ui, &response);
        }
        let pointer = response.hover_pos().or_else(|| response.interact_pointer_pos());
        let hovered =
            pointer.filter(|_| !in_map).and_then(|at| self.hit(diagram, self.to_drawing(at)));
        if !in_map {
            self.point(ui, diagram, rules, &response, hovered, &mut events);
        }
        // Whoever has no other use for the keyboard draws.
        let is_free = ui.memory(|m| m.focused().is_none() && m.top_modal_layer().is_none());
        if is_free && !ui.ctx().any_popup_open() {
            response.request_focus();
        }
        if response.has_focus() {
            self.keys(ui, &response, diagram, &mut events);
        }
        self.stays_fitted &= self.viewport == fitted && !self.is_busy();
        let colours = Colours::of(ui.visuals());
        self.paint(ui, diagram, rules, hovered, &colours);
        self.tell_names(ui, &response, diagram);
        Shown { events, response, hovered }
    }

    fn apply_fit(&mut self, diagram: &Diagram) {
        if self.rect.width() < 10.0 {
            return;
        }
        match self.fit.take() {
            Some(Fit::Everything) => {
                if let Some(bounds) = diagram.extent() {
                    self.viewport.fit(self.rect, bounds, 1.0);
                }
            }
            Some(Fit::Area(area)) => self.viewport.fit(self.rect, area, 1.25),
            None => {}
        }
    }
}

/// A point on the grid.
pub fn snapped(at: Pos2) -> Pos2 {
    Pos2::new((at.x / GRID).round() * GRID, (at.y / GRID).round() * GRID)
}
