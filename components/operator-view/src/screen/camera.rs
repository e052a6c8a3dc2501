//! The camera image over the map: dragged to another place, large after a click.

use armor_picture::theme::{self, ThemeColours};
use eframe::egui::{
    Align2, Color32, ColorImage, FontId, Painter, Pos2, Rect, Role, Sense, Stroke, TextureHandle,
    TextureOptions, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use super::open_parts::{self, OpenPart};
use crate::console::Console;
use crate::scene::RobotScene;

/// Widest image, in points, and as a share of the map's width.
const WIDEST: (f32, f32) = (300.0, 0.3);
/// Share of the map that a large image takes.
const LARGE: f32 = 0.9;
/// Away from the edges of the map, in points.
const MARGIN: f32 = 10.0;

/// The image shown last.
#[derive(Default)]
pub(super) struct CameraImage {
    shown: Option<(u64, TextureHandle)>,
    /// How far it was dragged from its corner.
    moved: Vec2,
}

impl CameraImage {
    /// Takes what is done with it, and returns its place in `map`, if there is a camera.
    pub(super) fn find_place(&mut self, ui: &Ui, map: Rect, console: &Console) -> Option<Rect> {
        console.link("image")?;
        let [width, height] = match &console.scene.photo {
            (0, _) => [4.0, 3.0],
            (_, photo) => photo.size.map(|side| side as f32),
        };
        let is_large = open_parts::is_open(ui.ctx(), OpenPart::Image);
        let (widest, highest) = if is_large {
            (map.width() * LARGE, map.height() * LARGE)
        } else {
            (WIDEST.0.min(map.width() * WIDEST.1), map.height() * 0.6)
        };
        let shown = widest.min(highest * width / height);
        let size = vec2(shown, shown * height / width);
        let corner = pos2(map.right() - MARGIN - size.x, map.top() + MARGIN);
        let area = Rect::from_min_max(map.min, (map.max - size).max(map.min));
        let place = |moved: Vec2| Rect::from_min_size(area.clamp(corner + moved), size);
        let name = Self::describe_trouble(console).unwrap_or_else(|| "image".into());
        let id = ui.scope_id().with("image");
        let response = ui.interact(place(self.moved), id, Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
        if response.dragged() {
            // From where it is, which the edges of the map may limit.
            self.moved = place(self.moved).min - corner + response.drag_delta();
        }
        if response.clicked() {
            open_parts::toggle(ui.ctx(), OpenPart::Image);
        }
        Some(place(self.moved))
    }

    /// Paints the image there, or the reason why there is none.
    pub(super) fn paint_image(
        &mut self,
        painter: &Painter,
        colours: &ThemeColours,
        rect: Rect,
        console: &Console,
    ) {
        painter.rect_filled(rect, 2.0, colours.panel);
        if console.scene.photo.0 > 0 {
            let texture = self.load_texture(painter, &console.scene);
            let all = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            painter.image(texture.id(), rect, all, Color32::WHITE);
        }
        let stroke = Stroke::new(1.0, colours.weak);
        painter.rect_stroke(rect, 2.0, stroke, eframe::egui::StrokeKind::Outside);
        if let Some(text) = Self::describe_trouble(console) {
            let font = FontId::proportional(theme::BODY);
            let galley = painter.layout(text, font, colours.warning, rect.width() - 12.0);
            let at = Align2::CENTER_CENTER.anchor_size(rect.center(), galley.size());
            painter.rect_filled(at.expand(4.0), 2.0, colours.panel);
            painter.galley(at.min, galley, colours.warning);
        }
    }

    /// Returns why there is no image, or no new one.
    pub(super) fn describe_trouble(console: &Console) -> Option<String> {
        let problem = console.link("image").and_then(|link| link.problem.clone());
        problem.or_else(|| (console.scene.photo.0 == 0).then(|| "no image yet".to_owned()))
    }

    fn load_texture(&mut self, painter: &Painter, scene: &RobotScene) -> &TextureHandle {
        let (number, photo) = &scene.photo;
        let old = self.shown.take().filter(|(shown, _)| shown == number);
        let (_, texture) = self.shown.insert(old.unwrap_or_else(|| {
            let image = ColorImage::from_rgb(photo.size, &photo.rgb);
            (*number, painter.ctx().load_texture("image", image, TextureOptions::LINEAR))
        }));
        texture
    }
}
