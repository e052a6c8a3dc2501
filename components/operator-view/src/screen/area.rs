//! The map with what lies on it. A click is a goal, a stroke one with a heading; the wheel zooms,
//! the right or middle button moves the map, a right click deletes the goal.

use armor_grid::{Point2, Pose2};
use armor_picture::icons::Icon;
use armor_picture::theme::{self, TOUCH, ThemeColours};
use eframe::egui::{
    Align2, Button, Event, FontId, Painter, PointerButton, Pos2, Rect, Response, RichText, Sense,
    Stroke, Ui, Vec2, vec2,
};

use super::SMALL_WIDTH;
use super::camera::CameraImage;
use super::colours::colours_of;
use super::layers::{Layer, Layers};
use super::map_viewport::{MapViewport, pose_of};
use super::marks;
use super::new_buttons::NewButtons;
use super::notices;
use super::open_parts::{self, OpenPart};
use super::tiles::Tiles;
use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;

/// Shorter strokes are clicks, in points.
const STROKE: f32 = 12.0;
/// Zoom for each point that the wheel turns.
const WHEEL: f32 = 0.004;
/// Length of the scale bar at most, in points.
const BAR: f32 = 120.0;

/// Least width that notices need next to the camera image, in points.
const NOTICE_WIDTH: f32 = 360.0;

/// What keys and pointer do.
const HELP: [&str; 5] = [
    "click: goal; drag: goal with a heading.",
    "right click or Esc: no goal; Esc closes first what is open.",
    "wheel: zoom; right or middle drag: move the map.",
    "image: drag it; click it for a large one.",
    "W A S D or arrows: drive while held. Space: STOP.",
];

/// The map area, and how it is looked at.
pub(super) struct Area {
    look: MapViewport,
    tiles: Tiles,
    camera: CameraImage,
    /// Whether the robot is kept in the middle.
    follows: bool,
    /// Whether the whole map is shown, as it is until the operator moves the view.
    fits: bool,
    /// Where a goal is being drawn from, on the screen and on the map, which may move meanwhile.
    stroke: Option<(Pos2, Point2)>,
    /// What notices covered in the last frame.
    covered: Vec<Rect>,
}

impl Default for Area {
    fn default() -> Self {
        let (look, tiles, camera) =
            (MapViewport::default(), Tiles::default(), CameraImage::default());
        Self { look, tiles, camera, follows: false, fits: true, stroke: None, covered: Vec::new() }
    }
}

impl Area {
    /// The point in the middle.
    #[cfg(test)]
    pub(super) fn centre(&self) -> Point2 {
        self.look.centre
    }

    /// The place of the map on the screen.
    #[cfg(test)]
    pub(super) fn place(&self) -> Rect {
        self.look.rect
    }

    /// The place of a point of the map on the screen.
    #[cfg(test)]
    pub(super) fn on_screen(&self, point: Point2) -> Pos2 {
        self.look.on_screen(point)
    }

    /// Whether a notice lies over a point of the screen.
    #[cfg(test)]
    pub(super) fn is_covered(&self, at: Pos2) -> bool {
        self.covered.iter().any(|place| place.contains(at))
    }

    /// The scale of the map.
    #[cfg(test)]
    pub(super) fn points_per_metre(&self) -> f32 {
        self.look.scale
    }

    /// How it is looked at.
    pub(super) fn show_view_buttons(&mut self, ui: &mut Ui) {
        let hint = "keeps the robot in the middle";
        // In a small window the signs would take another row from the map.
        let fit = match ui.max_rect().width() < SMALL_WIDTH {
            true => Button::new("fit"),
            false => Button::new((Icon::Fit.to_atom(), "fit")),
        };
        if ui.checkbox(&mut self.follows, "follow").on_hover_text(hint).changed() {
            self.fits = false;
        }
        if ui.add(fit.min_size(Vec2::splat(TOUCH))).on_hover_text("shows all of the map").clicked()
        {
            (self.fits, self.follows) = (true, false);
        }
        let help = Button::new(RichText::new("?").strong()).min_size(Vec2::splat(TOUCH));
        let help = ui.add(help).accessible_name("keys and pointer");
        if help.on_hover_text("keys and pointer").clicked() {
            open_parts::toggle(ui.ctx(), OpenPart::Help);
        }
        if open_parts::is_open(ui.ctx(), OpenPart::Help) {
            for line in HELP {
                ui.label(line);
            }
        }
    }

    /// Shows the map and takes what is pointed at.
    pub(super) fn show_map(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        layers: &Layers,
        new_buttons: &NewButtons,
        now: ClockTimes,
        orders: &mut Vec<OperatorOrder>,
    ) {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        let response = response.accessible_name("area of the map");
        let response = response.on_hover_cursor(eframe::egui::CursorIcon::Crosshair);
        self.look.rect = rect;
        self.update_view(ui, &response, console);
        let camera = layers
            .is_shown(Layer::Camera)
            .then(|| self.camera.find_place(ui, rect, console))
            .flatten();
        // A click at the picture or a notice is not meant for the map under it.
        let covered = camera.iter().chain(&self.covered);
        let pointer = ui.input(|input| input.pointer.interact_pos());
        let is_covered =
            pointer.is_some_and(|at| covered.into_iter().any(|place| place.contains(at)));
        let drawn = self.update_stroke(ui, &response, is_covered, console, orders);
        let painter = ui.painter_at(rect);
        if layers.is_shown(Layer::Map) && !console.scene.map.is_empty() {
            self.tiles.paint(&painter, &self.look, &console.scene.map);
        }
        marks::paint_marks(&painter, &self.look, console, layers);
        if let Some(place) = drawn {
            marks::paint_goal(&painter, &self.look, place);
            self.paint_heading(&painter, colours_of(ui), place);
        }
        if let Some(place) = camera {
            self.camera.paint_image(&painter, colours_of(ui), place, console);
        }
        self.scale_bar(&painter, colours_of(ui), response.hover_pos());
        let room = leave_out(rect, camera);
        self.covered =
            notices::show_notices(ui, &self.look, room, console, now, new_buttons, orders);
    }

    /// Shows the heading of the goal that is being drawn, in degrees.
    fn paint_heading(&self, painter: &Painter, colours: &ThemeColours, place: Pose2) {
        let at = self.look.on_screen(place.point()) + vec2(0.0, 30.0);
        let text = format!("heading {:.0}°", place.yaw_rad.to_degrees());
        let font = FontId::proportional(theme::HEADING);
        let galley = painter.layout_no_wrap(text, font, colours.text);
        let rect = Align2::CENTER_TOP.anchor_size(at, galley.size() + vec2(12.0, 6.0));
        painter.rect_filled(rect, 4.0, colours.panel);
        painter.galley(rect.min + vec2(6.0, 3.0), galley, colours.text);
    }

    /// The look: wheel, moving, following, fitting.
    fn update_view(&mut self, ui: &Ui, response: &Response, console: &Console) {
        let moved = [PointerButton::Secondary, PointerButton::Middle]
            .into_iter()
            .filter(|button| response.dragged_by(*button))
            .map(|_| response.drag_delta())
            .next();
        if let Some(moved) = moved {
            (self.fits, self.follows) = (false, false);
            self.look.centre = self.look.on_map(self.look.rect.center() - moved);
        }
        if let Some(at) = response.hover_pos() {
            let (wheel, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
            let factor = (wheel * WHEEL).exp() * pinch;
            if factor != 1.0 {
                self.fits = false;
                self.look.zoom(if self.follows { self.look.rect.center() } else { at }, factor);
            }
        }
        if self.follows
            && let Some(robot) = console.scene.robot()
        {
            self.look.centre = robot.point();
        }
        if self.fits {
            self.fit_map(console);
        }
    }

    fn fit_map(&mut self, console: &Console) {
        let layout = console.scene.map.layout();
        let (width, height) = (layout.width as f64, layout.height as f64);
        let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
        let corners = corners.map(|(column, row)| layout.place(column, row));
        let least = |of: fn(&Point2) -> f64| corners.iter().map(of).fold(f64::INFINITY, f64::min);
        let most = |of: fn(&Point2) -> f64| corners.iter().map(of).fold(-f64::INFINITY, f64::max);
        if !console.scene.map.is_empty() {
            let low = Point2::new(least(|p| p.x_m), least(|p| p.y_m));
            self.look.fit(low, Point2::new(most(|p| p.x_m), most(|p| p.y_m)));
        } else if let Some(robot) = console.scene.robot() {
            self.look.centre = robot.point();
        }
    }

    /// The goal being drawn, while it is; one that is finished is ordered.
    fn update_stroke(
        &mut self,
        ui: &Ui,
        response: &Response,
        is_covered: bool,
        console: &Console,
        orders: &mut Vec<OperatorOrder>,
    ) -> Option<Pose2> {
        if response.clicked_by(PointerButton::Secondary) {
            orders.push(OperatorOrder::Cancel);
        }
        // Esc, too: it also cancels the stroke being drawn.
        if orders.contains(&OperatorOrder::Cancel) {
            self.stroke = None;
        }
        let pointer = ui.input(|input| input.pointer.clone());
        // Where the button was pressed: a fast stroke is one frame, after which the pointer has
        // forgotten it.
        let pressed = ui.input(|input| input.events.iter().find_map(press_place));
        if let Some(at) = pressed
            && (response.contains_pointer() || response.clicked())
            && !is_covered
        {
            self.stroke = Some((at, self.look.on_map(at)));
        }
        let (from, point) = self.stroke?;
        let to = pointer.interact_pos().unwrap_or(from);
        let place = pose_of(point, self.look.on_map(to));
        let is_drawn = from.distance(to) >= STROKE;
        if pointer.primary_released() {
            let drawn = OperatorOrder::Goal { place, has_heading: true };
            orders.push(if is_drawn { drawn } else { goal_of_click(point, console) });
        }
        if !pointer.primary_down() {
            self.stroke = None;
        }
        (is_drawn && self.stroke.is_some()).then_some(place)
    }

    fn scale_bar(&self, painter: &Painter, colours: &ThemeColours, pointer: Option<Pos2>) {
        let length_m = self.look.bar_m(BAR);
        let length = length_m as f32 * self.look.scale;
        let left = self.look.rect.left_bottom() + vec2(14.0, -16.0);
        let stroke = Stroke::new(2.0, colours.text);
        let back =
            Rect::from_min_max(left - vec2(8.0, 20.0), left + vec2(length.max(150.0) + 8.0, 10.0));
        painter.rect_filled(back, 4.0, colours.panel);
        painter.line_segment([left, left + vec2(length, 0.0)], stroke);
        for end in [left, left + vec2(length, 0.0)] {
            painter.line_segment([end - vec2(0.0, 4.0), end + vec2(0.0, 4.0)], stroke);
        }
        let mut text =
            if length_m < 1.0 { format!("{length_m:.2} m") } else { format!("{length_m} m") };
        if let Some(at) = pointer {
            let point = self.look.on_map(at);
            text = format!("{text}   {:.2}, {:.2} m", point.x_m, point.y_m);
        }
        let font = FontId::proportional(theme::BODY);
        painter.text(left - vec2(0.0, 5.0), Align2::LEFT_BOTTOM, text, font, colours.text);
    }
}

/// Returns where the primary button was pressed.
fn press_place(event: &Event) -> Option<Pos2> {
    match event {
        Event::PointerButton { pos, button: PointerButton::Primary, pressed: true, .. } => {
            Some(*pos)
        }
        _ => None,
    }
}

/// The part of the map where notices lie: next to the camera image, which they would cover. On a small
/// map, and next to a large image, there is no room for them.
fn leave_out(map: Rect, camera: Option<Rect>) -> Rect {
    let Some(camera) = camera else { return map };
    let (left, right) = (camera.left() - map.left(), map.right() - camera.right());
    match () {
        // Below the notices, as far as they reach.
        () if camera.top() > map.center().y => map,
        () if left >= right && left >= NOTICE_WIDTH => map.with_max_x(camera.left()),
        () if right >= NOTICE_WIDTH => map.with_min_x(camera.right()),
        () => map,
    }
}

/// Returns a goal without a chosen heading: the robot keeps the heading of its approach.
fn goal_of_click(point: Point2, console: &Console) -> OperatorOrder {
    let robot = console.scene.robot();
    let yaw_rad = robot.map_or(0.0, |robot| robot.point().bearing_rad(point));
    let place = Pose2::new(point.x_m, point.y_m, yaw_rad);
    OperatorOrder::Goal { place, has_heading: false }
}
