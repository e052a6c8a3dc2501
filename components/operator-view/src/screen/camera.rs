//! The camera image, in a corner of the map.

use eframe::egui::{
    Align2, Color32, ColorImage, FontId, Painter, Pos2, Rect, Stroke, TextureHandle,
    TextureOptions, pos2, vec2,
};

use super::colours;
use crate::console::Console;
use crate::scene::RobotScene;

/// Widest image, in points, and as a share of the map's width.
const WIDEST: (f32, f32) = (300.0, 0.3);
/// Away from the edges of the map, in points.
const MARGIN: f32 = 10.0;

/// The image shown last.
#[derive(Default)]
pub(super) struct CameraImage {
    shown: Option<(u64, TextureHandle)>,
}

impl CameraImage {
    /// Returns its place in `map`, if there is a camera.
    pub(super) fn find_place(map: Rect, console: &Console) -> Option<Rect> {
        console.link("image")?;
        let [width, height] = match &console.scene.photo {
            (0, _) => [4.0, 3.0],
            (_, photo) => photo.size.map(|side| side as f32),
        };
        let shown = WIDEST.0.min(map.width() * WIDEST.1);
        let size = vec2(shown, (shown * height / width).min(map.height() * 0.6));
        let top = pos2(map.right() - MARGIN - size.x, map.top() + MARGIN);
        Some(Rect::from_min_size(top, size))
    }

    /// Paints the image there, or the reason why there is none.
    pub(super) fn paint_image(&mut self, painter: &Painter, rect: Rect, console: &Console) {
        painter.rect_filled(rect, 2.0, colours::CANVAS);
        if console.scene.photo.0 > 0 {
            let texture = self.load_texture(painter, &console.scene);
            let all = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            painter.image(texture.id(), rect, all, Color32::WHITE);
        }
        let stroke = Stroke::new(1.0, colours::WEAK);
        painter.rect_stroke(rect, 2.0, stroke, eframe::egui::StrokeKind::Outside);
        if let Some(text) = Self::describe_trouble(console) {
            let font = FontId::proportional(13.0);
            let galley = painter.layout(text, font, colours::LATE, rect.width() - 12.0);
            let at = Align2::CENTER_CENTER.anchor_size(rect.center(), galley.size());
            painter.rect_filled(at.expand(4.0), 2.0, colours::CANVAS.gamma_multiply(0.9));
            painter.galley(at.min, galley, colours::LATE);
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
