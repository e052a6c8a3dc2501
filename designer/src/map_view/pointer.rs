//! The pointer on the map: looking around, selecting, dragging, drawing.

use eframe::egui::{self, CursorIcon, Key, Modifiers, PointerButton, Pos2, Rect, Vec2};

use crate::canvas::wheel_steps;
use crate::commands::Command;
use crate::item::Item;
use crate::map_view::camera::map_point;
use crate::map_view::hit::MapHit;
use crate::map_view::state::{MapGesture, MapView};
use crate::map_view::tools::Tool;
use crate::workspace::Workspace;

/// One step of a mouse wheel.
const WHEEL_STEP: f64 = 1.18;
/// Clicks this near to each other, in points, are at the same place.
const SAME_PLACE: f32 = 4.0;
/// How many seconds a wheel's scrolling is smoothed out after its event.
const SMOOTHED: f64 = 0.4;

impl MapView {
    /// Moving and sizing the view: wheel and trackpad, the middle button, the space bar.
    pub(super) fn navigate(&mut self, ui: &egui::Ui, response: &egui::Response) {
        let Some(at) = ui.input(|i| i.pointer.hover_pos()) else { return };
        if response.contains_pointer() {
            let (pinch, pan, wheel) = ui.input(|i| {
                let wheel =
                    i.events.iter().fold(0.0, |sum, event| sum + f64::from(wheel_steps(event)));
                (i.zoom_delta(), i.smooth_scroll_delta(), wheel)
            });
            if pinch != 1.0 {
                self.camera.zoom_at(self.window, at, f64::from(pinch));
            } else if wheel != 0.0 {
                self.wheel_turned = ui.input(|i| i.time);
                self.camera.zoom_at(self.window, at, WHEEL_STEP.powf(wheel));
            } else if pan != Vec2::ZERO && ui.input(|i| i.time) > self.wheel_turned + SMOOTHED {
                self.camera.pan(pan);
            }
        }
        let with_space = ui.input(|i| i.key_down(Key::Space)) && response.has_focus();
        let starts = response.drag_started_by(PointerButton::Middle)
            || (with_space && response.drag_started_by(PointerButton::Primary));
        if starts {
            self.gesture = MapGesture::Pan;
        }
        if self.gesture == MapGesture::Pan {
            ui.set_cursor_icon(CursorIcon::Grabbing);
            self.camera.pan(response.drag_delta());
            if response.drag_stopped() || !ui.input(|i| i.pointer.any_down()) {
                self.gesture = MapGesture::Idle;
            }
        }
    }

    /// Everything else that the pointer does.
    pub(super) fn handle_pointer(
        &mut self,
        ui: &egui::Ui,
        response: &egui::Response,
        workspace: &mut Workspace,
    ) {
        if response.clicked() || response.drag_started() || response.secondary_clicked() {
            response.request_focus();
        }
        self.show_cursor(ui, response);
        let Some(at) = response.interact_pointer_pos() else { return };
        let modifiers = ui.input(|i| i.modifiers);
        if response.double_clicked()
            && self.tool == Tool::Select
            && let Some(MapHit::Item(item)) = self.hit(at)
        {
            self.select([item]);
            workspace.order_command(Command::Properties);
            return;
        }
        if response.double_clicked() && self.tool.least_points().is_some() {
            // Its first click has drawn the last point.
            self.finish_draft(workspace);
        } else if response.clicked() {
            self.click(at, modifiers, workspace);
        } else if response.secondary_clicked() {
            self.gesture = MapGesture::Idle;
            let items = self.sight().items_at(at);
            let item = items.iter().find(|item| self.selection.contains(item)).or(items.first());
            if let Some(item) = item.copied().filter(|item| !self.selection.contains(item)) {
                self.select([item]);
            }
            self.menu = (item.copied(), self.position_at(at, workspace));
        }
        if response.drag_started_by(PointerButton::Primary) && self.gesture == MapGesture::Idle {
            let pressed = ui.input(|i| i.pointer.press_origin()).unwrap_or(at);
            self.begin_drag(pressed, modifiers);
        }
        if self.gesture != MapGesture::Idle && self.gesture != MapGesture::Pan {
            self.go_on(at, workspace);
            if response.drag_stopped_by(PointerButton::Primary) {
                self.end_drag(at, modifiers, workspace);
            }
        }
    }

    fn show_cursor(&self, ui: &egui::Ui, response: &egui::Response) {
        let Some(at) = response.hover_pos() else { return };
        let icon = match (self.tool, self.hit(at)) {
            (Tool::Select, Some(MapHit::Item(_) | MapHit::Corner(_))) => CursorIcon::PointingHand,
            (Tool::Select, Some(MapHit::NewCorner(_) | MapHit::NewLeg(_))) => CursorIcon::Copy,
            (Tool::Select, None) => return,
            _ => CursorIcon::Crosshair,
        };
        ui.set_cursor_icon(icon);
    }

    fn click(&mut self, at: Pos2, modifiers: Modifiers, workspace: &mut Workspace) {
        match self.tool {
            Tool::Select => self.click_to_select(at, modifiers),
            Tool::Point | Tool::Rally => {
                self.add_point(
                    self.tool == Tool::Rally,
                    self.position_at(at, workspace),
                    workspace,
                );
            }
            Tool::Symbol => self.add_symbol(self.position_at(at, workspace), workspace),
            Tool::Leg => self.add_leg_at(at, workspace),
            Tool::Stay | Tool::Meeting => self.add_stop_at(at, workspace),
            Tool::Zone(_) | Tool::Line(_) | Tool::Measure => {
                let point = self.sight().point_near(at, &|_| false);
                let to = point.map_or_else(|| self.position_at(at, workspace), |(_, at)| at);
                let first =
                    self.draft.first().map(|first| self.camera.to_window(self.window, *first));
                let is_whole = self.tool.least_points().is_some_and(|least| {
                    self.draft.len() >= least
                        && first.is_some_and(|first| first.distance(at) < 10.0)
                });
                if is_whole {
                    return self.finish_draft(workspace);
                }
                if self.draft.last() != Some(&to) {
                    self.draft.push(to);
                }
            }
        }
    }

    /// A click selects what is in front; a further click at the same place what is behind it.
    fn click_to_select(&mut self, at: Pos2, modifiers: Modifiers) {
        if let Some(MapHit::Corner(corner)) = self.hit(at) {
            self.corner = Some(corner);
            return;
        }
        let items = self.sight().items_at(at);
        if modifiers.shift || modifiers.command {
            if let Some(item) = items.first()
                && !self.selection.remove(item)
            {
                self.selection.insert(*item);
            }
            return;
        }
        let is_again = self.clicked.is_some_and(|before| before.distance(at) <= SAME_PLACE);
        self.clicked = Some(at);
        let only = self.only().filter(|_| is_again);
        let only = only.and_then(|only| items.iter().position(|item| *item == only));
        let next = match only {
            Some(number) => items.get((number + 1) % items.len()),
            None => items.first(),
        };
        self.select(next.copied());
    }

    fn begin_drag(&mut self, at: Pos2, modifiers: Modifiers) {
        self.clicked = None;
        if self.tool != Tool::Select {
            return;
        }
        let to = self.camera.to_map(self.window, at);
        self.gesture = match self.hit(at) {
            Some(MapHit::Corner(corner)) => {
                self.corner = Some(corner);
                MapGesture::Corner { corner, to }
            }
            Some(MapHit::NewCorner(corner)) => MapGesture::NewCorner { corner, to },
            Some(MapHit::NewLeg(step)) => MapGesture::NewLeg { step, to },
            Some(MapHit::Item(item)) => {
                let selected = self.sight().items_at(at);
                let selected = selected.into_iter().find(|item| self.selection.contains(item));
                let grabbed = selected.or_else(|| movable_point(item).then_some(item));
                match grabbed.filter(|_| !modifiers.shift) {
                    Some(item) => self.begin_move(item),
                    None => MapGesture::Frame { from: at, to: at },
                }
            }
            None => MapGesture::Frame { from: at, to: at },
        };
    }

    /// Takes an item, and with it everything that is selected if it is.
    fn begin_move(&mut self, item: Item) -> MapGesture {
        if !self.selection.contains(&item) {
            self.select([item]);
        }
        let grabbed = self.scene.find(item).and_then(|entry| entry.shape.points().first().copied());
        match grabbed {
            Some(grabbed) => MapGesture::Move { grabbed, by_m: [0.0, 0.0] },
            None => MapGesture::Idle,
        }
    }

    /// The pointer has moved on.
    fn go_on(&mut self, at: Pos2, workspace: &Workspace) {
        let selection = &self.selection;
        let is_moved = |item: Item| selection.contains(&item);
        let is_none = |_: Item| false;
        let near = match self.gesture {
            // What is dragged is where the pointer is: it does not attract itself.
            MapGesture::Move { .. } => self.sight().point_near(at, &is_moved),
            _ => self.sight().point_near(at, &is_none),
        };
        let to = match near.filter(|_| workspace.settings.snap) {
            Some((_, point)) => point,
            None => self.position_at(at, workspace),
        };
        match &mut self.gesture {
            MapGesture::Move { grabbed, by_m } => {
                *by_m = [to.x_m() - grabbed.x_m(), to.y_m() - grabbed.y_m()];
            }
            MapGesture::Corner { to: shown, .. }
            | MapGesture::NewCorner { to: shown, .. }
            | MapGesture::NewLeg { to: shown, .. } => *shown = to,
            MapGesture::Frame { to, .. } => *to = at,
            MapGesture::Idle | MapGesture::Pan => {}
        }
    }

    fn end_drag(&mut self, at: Pos2, modifiers: Modifiers, workspace: &mut Workspace) {
        match std::mem::take(&mut self.gesture) {
            MapGesture::Move { by_m, .. } => {
                // The positions of the file again, not those of the drag.
                self.update(workspace);
                self.move_selected(by_m, workspace);
            }
            MapGesture::Corner { corner, to } => self.move_corner(corner, to, workspace),
            MapGesture::NewCorner { corner, to } => self.insert_corner(corner, to, workspace),
            MapGesture::NewLeg { step, to } => self.insert_leg(step, at, to, workspace),
            MapGesture::Frame { from, to } => {
                self.select_frame(Rect::from_two_pos(from, to), modifiers);
            }
            MapGesture::Idle | MapGesture::Pan => {}
        }
    }

    /// Selects the items that are wholly within a frame of the window.
    fn select_frame(&mut self, frame: Rect, modifiers: Modifiers) {
        let sight = self.sight();
        let is_within = |point| frame.contains(sight.at(point));
        let items = sight.items().filter(|entry| entry.shape.points().into_iter().all(is_within));
        let items: Vec<_> = items.map(|entry| entry.item).collect();
        let before = std::mem::take(&mut self.selection);
        self.select(items);
        if modifiers.shift || modifiers.command {
            self.selection.extend(before);
        }
    }

    /// The distance of one step of the keyboard.
    pub(super) fn nudge_m(&self, direction: Vec2) -> [f64; 2] {
        let step_m = self.camera.snap_step_m();
        [f64::from(direction.x) * step_m, f64::from(-direction.y) * step_m]
    }

    /// Moves what is selected by these metres.
    pub(super) fn move_selected(&mut self, by_m: [f64; 2], workspace: &mut Workspace) {
        if by_m == [0.0, 0.0] {
            return;
        }
        let placed = self
            .selected_corners()
            .into_iter()
            .map(|(corner, at)| (corner, map_point([at.x_m() + by_m[0], at.y_m() + by_m[1]])));
        let placed: Vec<_> = placed.collect();
        let what = match self.only() {
            Some(item) => format!("move {item}"),
            None => format!("move {} items", self.selection.len()),
        };
        self.place(what, &placed, workspace);
    }
}

/// Whether an item is dragged without having been selected before: a zone or line would be moved by
/// mistake where a frame is meant.
fn movable_point(item: Item) -> bool {
    matches!(item, Item::MapPoint(_) | Item::Rally(_) | Item::Symbol(_))
}
