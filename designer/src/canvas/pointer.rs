//! The pointer on the drawing: moving it, selecting, dragging, drawing wires.

use eframe::egui::{self, CursorIcon, Key, PointerButton, Pos2, Rect, Vec2};

use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::event::CanvasEvent;
use crate::canvas::gesture::Gesture;
use crate::canvas::gesture::PendingWire;
use crate::canvas::hit::Hit;
use crate::canvas::node::PortAt;
use crate::canvas::rules::JoinRules;
use crate::canvas::selection::Selection;
use crate::canvas::snap::snapped;
use crate::canvas::state::Canvas;

/// Nearer to the edge of the window than this, a drag moves the drawing.
const EDGE: f32 = 24.0;
/// Distance per frame, in points.
const EDGE_SPEED: f32 = 12.0;
/// One step of a mouse wheel.
const WHEEL_STEP: f32 = 1.18;
/// How many seconds a wheel's scrolling is smoothed out after its event.
const SMOOTHED: f64 = 0.4;
/// The smallest size of a group or note.
const SMALLEST: Vec2 = Vec2::new(80.0, 50.0);

impl<Id: DiagramId> Canvas<Id> {
    /// Moving and sizing the view: wheel and trackpad, the middle button, the space bar.
    pub(super) fn navigate_view(&mut self, ui: &egui::Ui, response: &egui::Response) {
        let Some(at) = ui.input(|i| i.pointer.hover_pos()) else { return };
        if response.contains_pointer() {
            let (pinch, pan, wheel) = ui.input(|i| {
                let wheel = i.events.iter().fold(0.0, |sum, event| sum + wheel_steps(event));
                (i.zoom_delta(), i.smooth_scroll_delta(), wheel)
            });
            if pinch != 1.0 {
                self.viewport.zoom_at(self.rect, at, pinch);
            } else if wheel != 0.0 {
                self.wheel_turned = ui.input(|i| i.time);
                self.viewport.zoom_at(self.rect, at, WHEEL_STEP.powf(wheel));
            } else if pan != Vec2::ZERO && ui.input(|i| i.time) > self.wheel_turned + SMOOTHED {
                self.viewport.pan(pan);
            }
        }
        let with_space = ui.input(|i| i.key_down(Key::Space)) && response.has_focus();
        let starts = response.drag_started_by(PointerButton::Middle)
            || (with_space && response.drag_started_by(PointerButton::Primary));
        if starts {
            self.gesture = Gesture::Pan;
        }
        if matches!(self.gesture, Gesture::Pan) {
            ui.set_cursor_icon(CursorIcon::Grabbing);
            self.viewport.pan(response.drag_delta());
            if response.drag_stopped() || !ui.input(|i| i.pointer.any_down()) {
                self.gesture = Gesture::Idle;
            }
        } else if with_space && response.contains_pointer() {
            ui.set_cursor_icon(CursorIcon::Grab);
        }
    }

    /// Everything else that the pointer does.
    pub(super) fn handle_pointer(
        &mut self,
        ui: &egui::Ui,
        diagram: &Diagram<Id>,
        rules: &dyn JoinRules,
        response: &egui::Response,
        hovered: Option<Hit>,
        events: &mut Vec<CanvasEvent<Id>>,
    ) {
        self.show_cursor(ui, response, hovered);
        if response.clicked() || response.drag_started() || response.secondary_clicked() {
            response.request_focus();
        }
        self.handle_clicks(ui, diagram, rules, response, hovered, events);
        if response.drag_started_by(PointerButton::Primary) && matches!(self.gesture, Gesture::Idle)
        {
            self.begin(ui, diagram, rules, response);
        }
        self.go_on(ui, response);
        let is_over = response.drag_stopped_by(PointerButton::Primary);
        if is_over && !matches!(self.gesture, Gesture::Wire { is_hanging: true, .. }) {
            let gesture = std::mem::take(&mut self.gesture);
            self.end_gesture(diagram, rules, gesture, events);
        }
    }

    fn handle_clicks(
        &mut self,
        ui: &egui::Ui,
        diagram: &Diagram<Id>,
        rules: &dyn JoinRules,
        response: &egui::Response,
        hovered: Option<Hit>,
        events: &mut Vec<CanvasEvent<Id>>,
    ) {
        let Some(pointer) = response.interact_pointer_pos() else { return };
        let at = self.to_drawing(pointer);
        if response.clicked()
            && let Gesture::Wire { is_hanging: true, .. } = self.gesture
        {
            let gesture = std::mem::take(&mut self.gesture);
            return self.end_gesture(diagram, rules, gesture, events);
        }
        let hit = hovered.or_else(|| self.hit(diagram, at));
        let item = hit.and_then(|hit| item_of(diagram, hit));
        if response.double_clicked() {
            events.push(match item {
                Some(item) => CanvasEvent::Opened(item),
                None => CanvasEvent::OpenedEmpty(snapped(at)),
            });
        } else if response.clicked() {
            match hit {
                Some(Hit::Port(from)) if self.is_editable => {
                    let to = at;
                    self.gesture = Gesture::Wire { from, to, taken: None, is_hanging: true };
                }
                _ => self.select_item(item, ui.input(|i| i.modifiers)),
            }
        } else if response.secondary_clicked() {
            self.gesture = Gesture::Idle;
            if let Some(item) = item
                && !self.selection.contains(item)
            {
                self.select_item(Some(item), egui::Modifiers::NONE);
            }
            events.push(CanvasEvent::Menu { of: item, at: snapped(at) });
        }
    }

    /// What a click selects: it alone, or with shift or ctrl it as well.
    fn select_item(&mut self, item: Option<Id>, modifiers: egui::Modifiers) {
        let adds = modifiers.shift || modifiers.command;
        match item {
            Some(item) if adds => {
                if !self.selection.remove(item) {
                    self.selection.insert(item);
                }
            }
            Some(item) => self.selection = [item].into(),
            None if adds => {}
            None => self.selection.clear(),
        }
    }

    fn begin(
        &mut self,
        ui: &egui::Ui,
        diagram: &Diagram<Id>,
        rules: &dyn JoinRules,
        response: &egui::Response,
    ) {
        let pressed = ui.input(|i| i.pointer.press_origin()).or(response.interact_pointer_pos());
        let Some(pressed) = pressed else { return };
        let at = self.to_drawing(pressed);
        let modifiers = ui.input(|i| i.modifiers);
        match self.hit(diagram, at) {
            Some(Hit::Port(port)) if self.is_editable => {
                let taken = rules.taken_by(port);
                let stays = taken
                    .and_then(|wire| diagram.wires.get(wire))
                    .map(|wire| if wire.to == port { wire.from } else { wire.to });
                let from = stays.unwrap_or(port);
                self.gesture = Gesture::Wire { from, to: at, taken, is_hanging: false };
            }
            Some(Hit::Grip { wire, stays }) => {
                let taken = Some(wire);
                self.gesture = Gesture::Wire { from: stays, to: at, taken, is_hanging: false };
            }
            Some(Hit::Corner(number)) if self.is_editable => {
                let rect = diagram.decorations[number].rect;
                self.gesture = Gesture::Resize { number, rect };
            }
            Some(hit @ (Hit::Node(_) | Hit::Decoration(_) | Hit::Port(_) | Hit::Corner(_))) => {
                let Some(item) = item_of(diagram, hit) else { return };
                if !self.selection.contains(item) {
                    self.select_item(Some(item), modifiers);
                    self.selection.insert(item);
                }
                self.take_group_along(diagram, item);
                if self.is_editable {
                    self.gesture = Gesture::Move { from: at, by: Vec2::ZERO };
                }
            }
            Some(Hit::Wire(_)) | None => {
                let adds = modifiers.shift || modifiers.command;
                let kept = if adds { self.selection.clone() } else { Default::default() };
                self.gesture = Gesture::Band { from: at, to: at, kept };
            }
        }
    }

    /// A group that is dragged takes along what is in it.
    fn take_group_along(&mut self, diagram: &Diagram<Id>, item: Id) {
        let groups = diagram.decorations.iter().filter(|d| !d.is_note && d.item == item);
        for area in groups.map(|group| group.rect) {
            let nodes = diagram.nodes.iter().filter(|node| area.contains_rect(node.rect));
            self.selection.extend(nodes.map(|node| node.item));
            let inner = diagram.decorations.iter().filter(|d| area.contains_rect(d.rect));
            self.selection.extend(inner.map(|decoration| decoration.item));
        }
    }

    fn go_on(&mut self, ui: &egui::Ui, response: &egui::Response) {
        if matches!(self.gesture, Gesture::Idle | Gesture::Pan) {
            return;
        }
        let Some(pointer) = ui.input(|i| i.pointer.latest_pos()) else { return };
        self.pan_at_edge(ui, pointer);
        let at = self.to_drawing(pointer);
        let delta = response.drag_delta() / self.viewport.zoom;
        let free = ui.input(|i| i.modifiers.alt);
        let snap = self.snap && !free;
        match &mut self.gesture {
            Gesture::Move { from, by } => {
                let wanted = at - *from;
                *by = if snap { snapped(wanted.to_pos2()).to_vec2() } else { wanted };
            }
            Gesture::Band { to, .. } | Gesture::Wire { to, .. } => *to = at,
            Gesture::Resize { rect, .. } => {
                let wanted = rect.max + delta;
                rect.max = wanted.max(rect.min + SMALLEST);
            }
            Gesture::Idle | Gesture::Pan => {}
        }
    }

    fn pan_at_edge(&mut self, ui: &egui::Ui, pointer: Pos2) {
        let inner = self.rect.shrink(EDGE);
        if inner.contains(pointer) || !ui.input(|i| i.pointer.any_down()) {
            return;
        }
        let outside = pointer - inner.clamp(pointer);
        if outside.length() < 10.0 * EDGE {
            self.viewport.pan(-outside.normalized() * EDGE_SPEED);
            ui.ctx().request_repaint();
        }
    }

    fn end_gesture(
        &mut self,
        diagram: &Diagram<Id>,
        rules: &dyn JoinRules,
        gesture: Gesture<Id>,
        events: &mut Vec<CanvasEvent<Id>>,
    ) {
        match gesture {
            Gesture::Move { by, .. } if by != Vec2::ZERO => events.push(CanvasEvent::Moved(by)),
            Gesture::Band { from, to, kept } => self.end_band(diagram, from, to, kept),
            Gesture::Wire { from, to, taken, .. } => {
                self.end_wire(diagram, rules, (from, to, taken), events);
            }
            Gesture::Resize { number, rect } => {
                if let Some(decoration) = diagram.decorations.get(number) {
                    let max = if self.snap { snapped(rect.max) } else { rect.max };
                    let rect = Rect::from_min_max(rect.min, max);
                    events.push(CanvasEvent::Resized(decoration.item, rect));
                }
            }
            _ => {}
        }
    }

    fn end_band(&mut self, diagram: &Diagram<Id>, from: Pos2, to: Pos2, kept: Selection<Id>) {
        let area = Rect::from_two_pos(from, to);
        self.selection = kept;
        let nodes = diagram.nodes.iter().filter(|node| area.intersects(node.rect));
        self.selection.extend(nodes.map(|node| node.item));
        let decorations = diagram.decorations.iter().filter(|d| area.contains_rect(d.rect));
        self.selection.extend(decorations.map(|decoration| decoration.item));
    }

    fn end_wire(
        &mut self,
        diagram: &Diagram<Id>,
        rules: &dyn JoinRules,
        (from, at, taken): (PortAt, Pos2, Option<usize>),
        events: &mut Vec<CanvasEvent<Id>>,
    ) {
        let dragged = PendingWire { from, taken };
        let fits = |port| port != from && dragged.may_end(rules, port).is_ok();
        let target = self.drop_port(diagram, at, &fits).filter(|port| *port != from);
        if let Some(wire) = taken {
            // Dropped where it was: no edit.
            let ends = diagram.wires.get(wire).map(|wire| [wire.from, wire.to]);
            if target.is_some() && ends.is_some_and(|ends| ends.contains(&target.unwrap_or(from))) {
                return;
            }
            let refusal = target.and_then(|to| dragged.may_end(rules, to).err());
            events.push(match refusal {
                Some(why) => CanvasEvent::Refused(why),
                None => CanvasEvent::Rewired { wire, stays: from, to: target },
            });
            return;
        }
        match target {
            Some(to) => match rules.may_join(from, to) {
                Ok(()) => events.push(CanvasEvent::Joined(from, to)),
                Err(why) => events.push(CanvasEvent::Refused(why)),
            },
            None => {
                // Released where it began: no wire.
                let start = diagram.port_position(from);
                if start.is_none_or(|start| (start - at).length() > 20.0) {
                    events.push(CanvasEvent::Loose { from, at: snapped(at) });
                }
            }
        }
    }

    fn show_cursor(&self, ui: &egui::Ui, response: &egui::Response, hovered: Option<Hit>) {
        let icon = match (&self.gesture, hovered) {
            (Gesture::Move { .. }, _) => CursorIcon::Grabbing,
            (Gesture::Wire { .. }, _) => CursorIcon::Crosshair,
            (Gesture::Resize { .. }, _) | (_, Some(Hit::Corner(_))) => CursorIcon::ResizeNwSe,
            (Gesture::Idle, Some(Hit::Port(_))) if self.is_editable => CursorIcon::Crosshair,
            (Gesture::Idle, Some(Hit::Grip { .. })) => CursorIcon::Grab,
            (Gesture::Idle, Some(Hit::Node(_) | Hit::Wire(_) | Hit::Decoration(_))) => {
                CursorIcon::PointingHand
            }
            _ => return,
        };
        if response.contains_pointer() {
            ui.set_cursor_icon(icon);
        }
    }
}

/// Returns what is at a point of the drawing.
pub(super) fn item_of<Id: DiagramId>(diagram: &Diagram<Id>, hit: Hit) -> Option<Id> {
    Some(match hit {
        Hit::Port(PortAt { node, .. }) | Hit::Node(node) => diagram.nodes.get(node)?.item,
        Hit::Wire(wire) | Hit::Grip { wire, .. } => diagram.wires.get(wire)?.item,
        Hit::Decoration(n) | Hit::Corner(n) => diagram.decorations.get(n)?.item,
    })
}

/// Whole steps of a mouse wheel; a trackpad scrolls by points or parts of a line.
pub(crate) fn wheel_steps(event: &egui::Event) -> f32 {
    match event {
        egui::Event::MouseWheel { unit: egui::MouseWheelUnit::Line, delta, modifiers, .. }
            if delta.x == 0.0
                && delta.y.fract() == 0.0
                && !modifiers.shift
                && !modifiers.command
                && !modifiers.alt =>
        {
            delta.y
        }
        _ => 0.0,
    }
}
