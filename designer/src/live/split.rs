//! How the drawings of the system and of the mission share their height: each gets what its texts
//! need to be readable, and what is left is shared, until a person moves the border between them.

use eframe::egui::{
    self, CursorIcon, Key, Modifiers, Rect, Response, Sense, Stroke, UiBuilder, Vec2,
};

use crate::canvas::{LABELLED, Viewport, keep_arrow_keys};

/// Letters are rounded to half a point: a little more than the zoom from which texts are drawn.
const READABLE: f32 = LABELLED * 1.01;
/// The least height of a drawing.
const LEAST: f32 = 90.0;
/// The least share of the height that the mission gets where there is no room for both.
const LEAST_SHARE: f32 = 0.3;
/// The height of the border.
const BORDER: f32 = 4.0;
/// How much of the height an arrow key moves the border by.
const STEP: f32 = 0.04;

/// The height of a window of this width in which a drawing of this size can be read: its ports have
/// their names, its links their rates, unless it is too wide for that.
pub fn least_height(width: f32, size: Vec2) -> f32 {
    if size == Vec2::ZERO { 0.0 } else { Viewport::height_for(width, size, READABLE).max(LEAST) }
}

/// The height of the mission beneath the system, where both have `room` together.
fn net_height(room: Vec2, system: Vec2, net: Vec2) -> f32 {
    let least = [system, net].map(|size| least_height(room.x, size));
    let left = room.y - least[0] - least[1];
    if left < 0.0 {
        // The system has the smaller letters.
        return (room.y - least[0]).max(room.y * LEAST_SHARE).min(least[1]);
    }
    // What each could still use; beyond that, both have the same.
    let most = [system, net].map(|size| Viewport::height_for(room.x, size, 1.0));
    let [more_system, more_net] = [0, 1].map(|n| (most[n] - least[n]).max(0.0));
    let more = more_system + more_net;
    if more <= left {
        return least[1] + more_net + (left - more) / 2.0;
    }
    least[1] + left * more_net / more
}

/// The border between the drawings.
#[derive(Debug, Default)]
pub struct Split {
    /// The share of the mission that a person has chosen.
    chosen: Option<f32>,
    /// Where both are.
    area: Option<(Rect, f32)>,
}

impl Split {
    /// Divides what is left of `ui` between drawings of these sizes.
    pub fn divide(&mut self, ui: &mut egui::Ui, system: Vec2, net: Vec2) -> [UiBuilder; 2] {
        let area = ui.available_rect_before_wrap();
        let room = area.size() - Vec2::new(0.0, BORDER);
        let wanted = self.chosen.map_or_else(|| net_height(room, system, net), |it| it * room.y);
        let height = wanted.min(room.y - LEAST).max(LEAST.min(room.y / 2.0));
        self.area = Some((area, height));
        let above = area.with_max_y(area.max.y - height - BORDER);
        let below = area.with_min_y(area.max.y - height);
        [("system", above), ("mission", below)]
            .map(|(name, part)| UiBuilder::new().id_salt(name).max_rect(part))
    }

    /// Shows the border; the pointer or the arrow keys move it, and a double-click leaves it to what
    /// is drawn again.
    pub fn show_border(&mut self, ui: &mut egui::Ui) {
        let Some((area, height)) = self.area else { return };
        let middle = area.max.y - height - BORDER / 2.0;
        let border = Rect::from_x_y_ranges(area.x_range(), middle - BORDER..=middle + BORDER);
        let id = ui.scope_id().with("border of the drawings");
        let response = ui.interact(border, id, Sense::click_and_drag());
        let response = response
            .on_hover_cursor(CursorIcon::ResizeVertical)
            .on_hover_text("Drag it, or use the arrow keys; double-click: as the drawings need it")
            .accessible_name("border between system and mission");
        let room = (area.height() - BORDER).max(1.0);
        if let Some(at) = response.interact_pointer_pos().filter(|_| response.dragged()) {
            self.chosen = Some((area.max.y - at.y) / room);
        }
        if response.double_clicked() {
            self.chosen = None;
        } else if let Some(by) = arrow_steps(ui, &response) {
            self.chosen = Some((height / room + by * STEP).clamp(0.0, 1.0));
        }
        let visuals = ui.visuals();
        let gap =
            Rect::from_x_y_ranges(area.x_range(), middle - BORDER / 2.0..=middle + BORDER / 2.0);
        ui.painter().rect_filled(gap, 0.0, visuals.panel_fill);
        let line = if response.has_focus() || response.hovered() || response.dragged() {
            Stroke::new(2.0, visuals.selection.stroke.color)
        } else {
            visuals.widgets.noninteractive.bg_stroke
        };
        ui.painter().hline(area.x_range(), middle, line);
    }
}

/// How far the arrow keys move the border that has the keyboard, upwards.
fn arrow_steps(ui: &egui::Ui, border: &Response) -> Option<f32> {
    if !border.has_focus() {
        return None;
    }
    keep_arrow_keys(ui, border);
    let count =
        |key| ui.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, key)) as f32;
    let steps = count(Key::ArrowUp) - count(Key::ArrowDown);
    (steps != 0.0).then_some(steps)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SYSTEM: Vec2 = Vec2::new(1314.0, 642.0);
    const NET: Vec2 = Vec2::new(1192.0, 417.0);

    fn zooms(room: Vec2) -> [f32; 2] {
        let net = net_height(room, SYSTEM, NET);
        [(SYSTEM, room.y - net), (NET, net)].map(|(size, height)| {
            let mut view = Viewport::default();
            let window = Rect::from_min_size(egui::Pos2::ZERO, Vec2::new(room.x, height));
            view.fit(window, Rect::from_min_size(egui::Pos2::ZERO, size), 1.0);
            view.zoom
        })
    }

    #[test]
    fn where_there_is_room_both_can_be_read() {
        for room in [Vec2::new(800.0, 680.0), Vec2::new(900.0, 700.0), Vec2::new(1400.0, 1000.0)] {
            let zooms = zooms(room);
            assert!(zooms.iter().all(|zoom| *zoom >= LABELLED), "{room}: {zooms:?}");
        }
    }

    #[test]
    fn without_room_for_both_the_system_can_be_read_and_the_mission_keeps_its_share() {
        let room = Vec2::new(800.0, 590.0);
        assert!(zooms(room)[0] >= LABELLED, "{:?}", zooms(room));
        let small = Vec2::new(800.0, 300.0);
        assert!(net_height(small, SYSTEM, NET) >= LEAST_SHARE * small.y - 1e-3);
        // Too wide to be read at any height, it does not take what the other can use.
        let wide = Vec2::new(20_000.0, 300.0);
        assert!(net_height(Vec2::new(800.0, 600.0), wide, NET) > 300.0);
    }

    #[test]
    fn what_neither_needs_is_shared() {
        let small = Vec2::new(100.0, 100.0);
        assert_eq!(net_height(Vec2::new(800.0, 800.0), small, small), 400.0);
    }
}
